"""Rows of one target share all that depends on it alone, and give what each gives by itself."""

import numpy as np
import pytest

from relit.batch.cache import DiskCache
from relit.face import head, views
from relit.face.detect import detect_landmarks
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.photo.samples import sample
from relit.relighting import transfer
from tests.batch.caches import LARGE, counted


@pytest.fixture
def calls(monkeypatch):
    """The heads that are really drawn, and the skins that are really learned."""
    return counted(monkeypatch, (head, "rasterize"), (views, "skin_of"))


@pytest.mark.slow
def test_a_target_is_measured_once(tmp_path, calls):
    target, reference = (reduced(read_image(sample(name)).pixels, 2) for name in ("target", "reference"))
    here, there = map(detect_landmarks, (target, reference))
    lights = [reference, reference[::-1, ::-1] // 2 + reference // 2]

    def relit(light):
        given = {"target_landmarks": here, "reference_landmarks": there}
        return transfer(target.copy(), light, **given).image

    alone = [relit(light) for light in lights]
    assert not np.array_equal(*alone)
    del calls[:]
    with DiskCache(tmp_path, LARGE).open():
        for light, expected in zip(lights, alone, strict=True):
            np.testing.assert_array_equal(relit(light), expected)
    assert sorted(calls) == ["rasterize", "skin_of"]
