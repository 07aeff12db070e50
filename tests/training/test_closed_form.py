"""The method is watched and corrected from outside, and is itself again afterwards."""

import numpy as np

from relit import transfer
from relit.methods import shading
from relit.photo.reading import read_image
from relit.photo.samples import sample
from training.closed_form import PLANES, SIDE, box_round, corrected, planes_of


def test_a_change_that_is_corrected_is_what_the_photo_gets():
    ours, theirs = (read_image(sample(name)).pixels for name in ("target", "reference"))
    usual, explained = transfer(ours, theirs, detail=40), shading._explained
    found = []

    def watch(change, seen):
        found.append((planes_of(change, seen), box_round(seen.scene.face), seen.scene.face))
        return change

    with corrected(watch):
        watched = transfer(ours, theirs, detail=40)
    np.testing.assert_array_equal(watched.image, usual.image)
    planes, box, face = found[0]
    assert planes.shape == (PLANES, SIDE, SIDE)
    assert np.isfinite(planes).all()
    inside = planes[10] > 0.5
    np.testing.assert_allclose([np.median(plane[inside]) for plane in planes[:5]], 0, atol=1e-5)
    assert np.median(np.linalg.norm(planes[5:8], axis=0)[inside]) > 0.98
    y, x = np.nonzero(face.inside)
    assert box[0].min() < y.min() < y.max() < box[0].max()
    assert box[1].min() < x.min() < x.max() < box[1].max()

    with corrected(lambda change, _: 0.5 * change):
        half = transfer(ours, theirs, detail=40)
    assert np.abs(half.image.astype(int) - usual.image).mean() > 0.3
    assert shading._explained is explained
