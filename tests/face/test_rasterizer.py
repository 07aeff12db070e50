"""What is seen of a mesh, against brute force and a ball."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from relit.face import rasterizer
from relit.face.rasterizer import rasterize
from relit.face.template_head import vertex_normals


def solved(corners, x, y):
    """Barycentric coordinates of a pixel, by solving for them."""
    return np.linalg.solve(np.vstack([corners[:, :2].T, np.ones(3)]), [x, y, 1])


@given(st.integers(0, 2**32 - 1))
def test_the_nearest_triangle_is_seen_as_brute_force_sees_it(seed):
    random = np.random.default_rng(seed)
    vertices = random.uniform(-5, 20, (12, 3))
    triangles = random.permutation(12).reshape(4, 3).astype(np.int32)
    raster = rasterize(vertices, triangles, (13, 15))
    for y, x in np.ndindex(13, 15):
        depths = {}
        for row, corners in enumerate(vertices[triangles]):
            a, b, c = corners[:, :2]
            weights = solved(corners, x, y)
            if np.linalg.det([b - a, c - a]) > 0 and (weights >= 0).all():
                depths[row] = weights @ corners[:, 2]
        seen = min(depths, key=depths.get, default=-1)
        assert raster.triangle[y, x] == seen
        if seen >= 0:
            wanted = solved(vertices[triangles[seen]], x, y)
            np.testing.assert_allclose(raster.weights[y, x], wanted, atol=1e-5)


def test_normals_and_depth_of_a_ball_are_its_own():
    random = np.random.default_rng(0)
    points = random.normal(size=(3000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int32)
    # Clockwise where the front is seen: the outward normal looks at the camera, so it is -(b - a) × (c - a).
    a, b, c = points[triangles].swapaxes(0, 1)
    wrong = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) > 0
    triangles[wrong] = triangles[wrong][:, ::-1]
    assert np.abs(vertex_normals(points, triangles) - points).max() < 0.1
    raster = rasterize(points * 40 + [50, 50, 0], triangles, (100, 100, 3))
    y, x = (np.mgrid[:100, :100] - 50) / 40
    ball = np.hypot(x, y) < 0.9
    z = -np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    assert raster.covered[ball].all()
    assert not raster.covered[np.hypot(x, y) > 1].any()
    spread = raster.spread(np.column_stack([vertex_normals(points, triangles), points[:, 2]]), triangles)
    np.testing.assert_allclose(spread[ball][:, 3], z[ball], atol=0.02)
    normals = spread[..., :3] / np.linalg.norm(spread[..., :3], axis=2, keepdims=True).clip(1e-9)
    cosine = (normals * np.dstack([x, y, z])).sum(axis=2)[ball]
    assert np.rad2deg(np.arccos(cosine.clip(-1, 1))).max() < 6  # the angle between neighbours


def test_a_mesh_drawn_in_parts_is_the_same(monkeypatch):
    random = np.random.default_rng(1)
    vertices = random.uniform(-5, 20, (300, 3)).round(1)  # so that some lie in one place
    triangles = np.repeat(random.permutation(300).reshape(100, 3), 2, axis=0).astype(np.int32)
    whole = rasterize(vertices, triangles, (13, 15))
    assert (whole.triangle[whole.covered] % 2 == 0).all()  # of twins, the first
    monkeypatch.setattr(rasterizer, "_AT_ONCE", 20)
    parts = rasterize(vertices, triangles, (13, 15))
    np.testing.assert_array_equal(parts.triangle, whole.triangle)
    np.testing.assert_array_equal(parts.weights, whole.weights)


@pytest.mark.parametrize("away", [1e3, 1e12, -1e12])
def test_what_is_off_the_grid_is_not_seen(away):
    vertices = np.array([[away, 0, 0], [away + 9, 0, 0], [away, 9, 0]])
    assert not rasterize(vertices, np.array([[0, 1, 2]], np.int32), (20, 20)).covered.any()


def test_a_triangle_larger_than_any_index_covers_the_grid():
    vertices = np.array([[-1e12, -1e12, 3], [1e12, -1e12, 3], [0, 1e12, 3]])
    assert rasterize(vertices, np.array([[0, 1, 2]], np.int32), (9, 9)).covered.all()
