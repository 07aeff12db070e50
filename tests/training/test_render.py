"""A ball is lit by its normals, lights add up, and what is in the way casts a shadow."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

pytest.importorskip("embreex", reason="the training extra is not installed: pip install -e '.[training]'")

from relit.face.template_head import vertex_normals
from relit.photo.profile import decode_srgb
from training import render
from training.lights import LAMPS, lamps
from training.people import Person
from training.skins import Skin


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    """No gloss, no grain, heads upright, and lamps that are points."""
    monkeypatch.setattr(render, "_SHINE", (0.0, 0.0))
    monkeypatch.setattr(render, "_ANGLES", (0, 0, 0))
    monkeypatch.setattr(render, "_SPREAD", 0.0)
    monkeypatch.setattr(render, "_FAR", (1e4, 1e4))
    monkeypatch.setattr(Skin, "albedo", lambda _, place, *_parts: np.full((len(place), 3), 0.5))


def somebody(vertices, triangles):
    none, skin = np.zeros(len(vertices)), Skin(0, 0.5, 0.3, 0, 0, 0, np.zeros(3))
    normals = vertex_normals(vertices, triangles)
    return Person(vertices, normals, triangles, vertices, none, none, none, skin)


def ball(middle, radius, n=48):
    """Return vertices and triangles of a ball."""
    along, around = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n), indexing="ij")
    way = np.stack([np.sin(along) * np.cos(around), np.sin(along) * np.sin(around), np.cos(along)], axis=-1)
    row = np.arange(n * 2 * n).reshape(n, 2 * n)
    a, b, c, d = (row[i : n - 1 + i, j : 2 * n - 1 + j].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.array(middle) + radius * way.reshape(-1, 3), triangles.astype(np.int32)


def outward(vertices, triangles, middle):
    normals = vertex_normals(vertices, triangles)
    return normals if ((normals * (vertices - middle)).sum(axis=1)).mean() > 0 else None


MIDDLE = np.array([0, 0.6, 0.5])


def a_ball():
    vertices, triangles = ball(MIDDLE, 1.0)
    if outward(vertices, triangles, MIDDLE) is None:
        triangles = triangles[:, ::-1].copy()
    return vertices, triangles


def test_a_ball_is_lit_by_its_normals():
    shot = render.shoot(somebody(*a_ball()), 60, 20, np.random.default_rng(0))
    y, x = np.nonzero(shot.covered)
    # Far away, the camera sees the ball as a disc.
    nx, ny = (x - 30) / 20, (y - 0.45 * 60) / 20 - 0.6
    assert shot.covered.sum() == pytest.approx(np.pi * 20**2, rel=0.03)
    normals = np.column_stack([nx, ny, -np.sqrt(np.maximum(1 - nx**2 - ny**2, 0))])
    sure = nx**2 + ny**2 < 0.8
    wanted = np.maximum(lamps() @ normals.T, 0)
    np.testing.assert_allclose(shot.diffuse[:, sure], wanted[:, sure], atol=0.06)
    assert np.abs(shot.diffuse[:, sure] - wanted[:, sure]).mean() < 0.01


def test_what_is_in_the_way_casts_a_shadow_and_hides_the_sky():
    vertices, triangles = a_ball()
    near, its = ball(MIDDLE + np.array([0, -0.9, -1.2]), 0.45)
    both = np.vstack([vertices, near]), np.vstack([triangles, its + len(vertices)]).astype(np.int32)
    alone, shaded = (
        render.shoot(somebody(*one), 60, 20, np.random.default_rng(0))
        for one in ((vertices, triangles), both)
    )
    middle = int(np.flatnonzero(np.flatnonzero(alone.covered.ravel()) == 39 * 60 + 30)[0])
    other = int(np.flatnonzero(np.flatnonzero(shaded.covered.ravel()) == 39 * 60 + 30)[0])
    towards = np.array([0, -0.9, -0.2]) / np.linalg.norm([0, -0.9, -0.2])
    lamp = int(np.argmax(lamps() @ towards))
    assert alone.diffuse[lamp, middle] > 0.05
    assert shaded.diffuse[lamp, other] == 0
    assert shaded.open[other] < alone.open[middle] - 0.02
    assert alone.open[middle] == pytest.approx(1, abs=0.02)


def test_lights_add_up():
    shot = render.shoot(somebody(*a_ball()), 40, 14, np.random.default_rng(0))
    random = np.random.default_rng(1)
    one, other = random.random((2, LAMPS)) / LAMPS
    a, b, both = (
        decode_srgb(shot.photo(light, 0.3) / np.float32(255)) for light in (one, other, one + other)
    )
    inside = binary_erosion(shot.covered, iterations=3)  # the wall's light spreads over the rim
    np.testing.assert_allclose((a + b)[inside], both[inside], atol=0.01)
    gain = shot.gain(one, 0.4)
    assert np.quantile(shot.albedo[:, 1] * gain * (one @ shot.diffuse), 0.95) == pytest.approx(0.4)
