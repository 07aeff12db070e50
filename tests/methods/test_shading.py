"""Our own method on faces that are rendered, so that the truth is known."""

import dataclasses

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relit.compose.adjust import anchored
from relit.face.regions import FaceRegions
from relit.methods import shading
from relit.methods.scene import Scene
from relit.settings.options import TransferOptions


@pytest.fixture
def rendered(ball):
    """Return what takes two lights, and gives a scene of two persons and the truth."""
    landmarks, normals, face = ball
    random = np.random.default_rng(0)
    ours, theirs = (0.5 * np.exp(gaussian_filter(random.normal(0, 1, face.shape), 1.5)) for _ in range(2))

    def render(own, light, mask=True):
        shades = [np.maximum(normals @ np.array(b), 0) + 0.08 for b in (own, light)]
        target, reference, truth = ours * shades[0], theirs * shades[1], ours * shades[1]
        options = TransferOptions(mask=mask)
        scene = Scene(target, reference, FaceRegions(landmarks, face.shape), landmarks, 0.2, options)
        return scene, truth

    return render


def relight(scene):
    return anchored(shading.relight(scene), scene.options)


def error(image, truth, face):
    """Mean absolute error over the face, after the best gain, over the mean."""
    gain = (image * truth)[face].sum() / (image * image)[face].sum()
    return np.abs(gain * image - truth)[face].mean() / truth[face].mean()


FRONT, LEFT, RIGHT = (0, 0, -0.8), (-0.6, 0, -0.4), (0.6, -0.2, -0.4)


@pytest.mark.parametrize(("own", "light"), [(FRONT, LEFT), (LEFT, FRONT), (LEFT, RIGHT), (RIGHT, FRONT)])
def test_a_face_is_relit_as_it_would_be_lit(rendered, ball, own, light):
    scene, truth = rendered(own, light)
    face = ball[2]
    relit = relight(scene).planes
    assert error(relit, truth, face) < 0.75 * error(scene.reference, truth, face)
    assert error(relit, truth, face) < 0.4 * error(scene.target, truth, face)
    lit = face & (scene.target > 0.3 * scene.target.max()) & (truth > 0.3 * truth.max())
    assert error(relit, truth, lit) < 0.12


def test_a_photo_in_its_own_light_stays(rendered, ball):
    scene, _ = rendered(FRONT, LEFT)
    face = ball[2]
    same = dataclasses.replace(scene, reference=scene.target)
    np.testing.assert_allclose(relight(same).planes[face], scene.target[face], atol=1e-5)


def test_the_complexion_of_the_reference_does_not_matter(rendered, ball):
    scene, _ = rendered(FRONT, LEFT)
    face = ball[2]
    pale = np.dstack([scene.reference * share for share in (1, 0.9, 0.8)])
    dark = np.dstack([scene.reference * share for share in (0.5, 0.35, 0.25)])
    target = np.dstack([scene.target * share for share in (0.9, 0.6, 0.5)])
    results = [
        relight(dataclasses.replace(scene, target=target, reference=reference)).planes[face]
        for reference in (pale, dark)
    ]
    np.testing.assert_allclose(*results, atol=0.02)
    hue = [image / image.sum(axis=-1, keepdims=True) for image in (results[0], target[face])]
    np.testing.assert_allclose(hue[0].mean(axis=0), hue[1].mean(axis=0), atol=0.01)


def test_exposure_is_kept_taken_or_half_of_both(rendered, ball):
    scene, _ = rendered(FRONT, FRONT)
    face = ball[2]
    weak = dataclasses.replace(scene, reference=scene.reference / 3)

    def brightness(**options):
        scene = dataclasses.replace(weak, options=TransferOptions(**options))
        return np.median(relight(scene).planes[face])

    none, half, whole = brightness(exposure="keep"), brightness(mask=False), brightness(exposure="take")
    # Of two persons' albedo, the means differ a little.
    assert whole / none == pytest.approx(1 / 3, rel=0.15)
    assert half**2 == pytest.approx(none * whole, rel=0.05)
    assert brightness() == none
    assert brightness(exposure=2) == none  # stops are added to whatever the method


def test_tint_is_the_share_of_the_references_colour(rendered, ball):
    scene, _ = rendered(FRONT, LEFT)
    face = ball[2]
    orange = dataclasses.replace(
        scene,
        target=np.dstack([scene.target] * 3),
        reference=np.dstack([scene.reference * share for share in (1, 0.7, 0.4)]),
    )

    def red_over_blue(tint):
        planes = relight(dataclasses.replace(orange, options=TransferOptions(tint=tint))).planes[face]
        return np.median(planes[:, 0] / planes[:, 2])

    assert red_over_blue(0.0) == pytest.approx(1, abs=0.02)
    assert red_over_blue(1.0) == pytest.approx(2.5, rel=0.05)
    assert red_over_blue(0.5) == pytest.approx(np.sqrt(2.5), rel=0.05)


def test_a_grey_target_takes_the_colours(rendered, ball):
    scene, _ = rendered(FRONT, LEFT)
    face = ball[2]
    colors = np.dstack([scene.reference * share for share in (1, 0.7, 0.5)])

    def red_over_blue(exposure):
        given = dataclasses.replace(scene, reference=colors, options=TransferOptions(exposure=exposure))
        planes = relight(given).planes[face]
        return np.median(planes[:, 0] / planes[:, 2])

    assert red_over_blue("take") == pytest.approx(2, rel=0.1)
    # Made brighter than the reference, it is less vivid.
    assert 1.2 < red_over_blue("keep") < red_over_blue("take")


def test_what_is_in_the_dark_is_made_up_from_the_rest(rendered, ball):
    """A cast shadow on the target has no person in it."""
    scene, truth = rendered(FRONT, RIGHT)
    face = ball[2]
    shadowed = scene.target.copy()
    shadowed[35:75, 55:80] = 0.004
    relit = relight(dataclasses.replace(scene, target=shadowed))
    hole = np.zeros_like(face)
    hole[42:68, 60:75] = True
    hole &= face
    assert relit.layers["target_is_lit"][hole].max() < 0.1
    assert relit.layers["target_is_lit"][face & ~hole].mean() > 0.7
    gain = np.median((truth / relit.planes)[face & (shadowed > 0.1)])
    assert np.abs(gain * relit.planes - truth)[hole].mean() < 0.45 * truth[hole].mean()


def test_layers_make_up_the_result(rendered):
    scene, _ = rendered(LEFT, FRONT)
    result = relight(scene)
    whole = 2 * result.layers["person"] * result.layers["new_light"]
    np.testing.assert_allclose(result.planes, whole, rtol=1e-5)


def test_black_photos_are_relit(rendered):
    scene, _ = rendered(FRONT, LEFT)
    for role in ("target", "reference"):
        black = dataclasses.replace(scene, **{role: np.zeros_like(scene.target)})
        assert np.isfinite(relight(black).planes).all()
