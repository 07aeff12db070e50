"""Faces to draw figures with: from folders, and rendered in a light or a pose that is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import binary_closing, distance_transform_edt, map_coordinates

from relit import Landmarks, TransferResult, detect_landmarks, read_image, transfer
from relit.evaluate.yale_b import Light, YaleB
from relit.face.regions import FaceRegions
from relit.face.shape import face_shape
from relit.runtime.threads import one_blas_thread

_GAMMA = 2.2
_BACKGROUND = 128


class Face(NamedTuple):
    """A photo, and the landmarks of the face in it."""

    pixels: NDArray[np.uint8]
    landmarks: Landmarks


@dataclass(frozen=True)
class Faces:
    """The folders that figures are drawn from.

    Attributes
    ----------
    yaleb : Path
        In the layout of CroppedYale, with a ``protocol.csv``.
    portraits : Path
        Colour photos ``NNN_03.jpg`` of faces from the front, in even light.
    """

    yaleb: Path
    portraits: Path

    @cached_property
    def yale(self) -> YaleB:
        """The Yale B folder."""
        return YaleB(self.yaleb)

    def lit(self, subject: str, azimuth: int = 0, elevation: int = 0) -> Face:
        """Return a Yale B face under a light."""
        light = Light(azimuth, elevation)
        return Face(self.yale.photo(subject, light), self.yale.landmarks(subject, light))

    def portrait(self, number: str) -> Face:
        """Return a portrait, made small."""
        return _small(self.portraits / f"{number}_03.jpg")


@lru_cache(maxsize=32)
def _small(path: Path, width: int = 400) -> Face:
    picture = Image.fromarray(read_image(path).pixels)
    height = round(picture.height * width / picture.width)
    pixels = np.asarray(picture.resize((width, height), Image.Resampling.LANCZOS))
    return Face(pixels, detect_landmarks(pixels))


def relit_face(target: Face, reference: Face, **changes: Any) -> TransferResult:
    """Carry the light of one face to another, as the paper does."""
    return transfer(
        target.pixels,
        reference.pixels,
        target_landmarks=target.landmarks,
        reference_landmarks=reference.landmarks,
        **{"method": "ltv", **changes},
    )


def inside(result: TransferResult, image: NDArray[Any]) -> NDArray[np.float64]:
    """Return the pixels of an image, of the target's size, that are in the face: (n,) or (n, 3)."""
    assert result.mask is not None
    return np.asarray(image[result.window][result.mask > 0.5], np.float64)


def errors_inside(result: TransferResult, truth: NDArray[Any]) -> tuple[float, float]:
    """Return how far from the truth the relit face is, and the target, in % of 255."""
    relit, target = (
        np.abs(inside(result, image) - inside(result, truth)).mean() / 2.55
        for image in (result.image, result.target)
    )
    return float(relit), float(target)


def in_light(
    face: Face, azimuth: float, elevation: float, color: tuple[float, float, float] = (1, 1, 1)
) -> Face:
    """Return a face that was photographed in even light as it would look, were it matt, in one from a side.

    Parameters
    ----------
    face : Face
    azimuth, elevation : float
        Where the light stands, in degrees: in the left half of the image where the azimuth is positive.
    color : (float, float, float)
        Of that light; a quarter as much comes from everywhere, and is white.
    """
    across, up = np.deg2rad([azimuth, elevation])
    towards = np.array([-np.sin(across) * np.cos(up), -np.sin(up), -np.cos(across) * np.cos(up)])
    lambertian = np.maximum(face_shape(face.landmarks, face.pixels.shape).normals @ towards, 0)
    # What is not face has no normals here, and the mean light.
    mask = FaceRegions(face.landmarks, face.pixels.shape[:2]).mask()
    lambertian = mask * lambertian + (1 - mask) * lambertian[mask == 1].mean()
    shade = 0.25 + 0.75 * lambertian[..., None] * np.array(color)
    lit = face.pixels * shade ** (1 / _GAMMA)
    return face._replace(pixels=np.asarray(np.rint(lit), np.uint8))


def turned(face: Face, angle: float) -> Face:
    """Return a face turned about its vertical axis by some degrees, rendered with the depth of its mesh."""
    points = face.landmarks.points
    left, top = np.floor(points[:, :2].min(axis=0))
    right, bottom = np.ceil(points[:, :2].max(axis=0))
    y, x = np.mgrid[top : bottom : 1 / 3, left : right : 1 / 3]  # fine enough to leave no holes
    with one_blas_thread():
        z = LinearNDInterpolator(points[:, :2], points[:, 2])(x, y)
    on_face = ~np.isnan(z)
    samples = np.stack([x[on_face], y[on_face], z[on_face]], axis=1)
    colors = np.stack(
        [map_coordinates(plane, samples[:, 1::-1].T, order=1) for plane in np.moveaxis(face.pixels, -1, 0)], 1
    )
    pivot = np.array([(left + right) / 2, 0, points[:, 2].max()])
    turn = np.deg2rad(angle)
    rotation = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    samples = (samples - pivot) @ rotation + pivot
    far_first = np.argsort(-samples[:, 2])
    column, row, _ = np.rint(samples[far_first].T).astype(int)
    height, width = face.pixels.shape[:2]
    column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
    pixels = np.full_like(face.pixels, _BACKGROUND)
    seen = np.zeros((height, width), bool)
    pixels[row, column], seen[row, column] = colors[far_first], True
    holes = binary_closing(seen, iterations=3) & ~seen
    nearest = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    pixels[holes] = pixels[nearest[0][holes], nearest[1][holes]]
    return Face(pixels, Landmarks((points - pivot) @ rotation + pivot))
