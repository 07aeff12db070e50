"""The other half of a face: where the twin of each place on it is seen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.photo.filters import at_places

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.face.shape import FaceShape


def twins(landmarks: Landmarks, shape: FaceShape) -> NDArray[np.float64] | None:
    """Return where, ``(y, x)``, the same place of the other half of the face is seen, None if no eyes tell.

    The face's plane of symmetry is that between the eyes in space: ``x ↦ x - 2 ((x - m)·a) a``.

    Parameters
    ----------
    landmarks : Landmarks
    shape : FaceShape

    Returns
    -------
    (2, H, W) float64 array or None
        In px.
    """
    eyes = landmarks.eyes
    if eyes is None:
        return None
    right, left = np.pad(eyes, ((0, 0), (0, 3 - eyes.shape[1])))
    across = (left - right) / np.linalg.norm(left - right)
    y, x = np.indices(shape.depth.shape)
    beyond = x * across[0] + y * across[1] + shape.depth * across[2] - (left + right) @ across / 2
    return np.stack([y - 2 * beyond * across[1], x - 2 * beyond * across[0]])


def halves(
    plane: NDArray[np.float32], weight: NDArray[np.float32], twin: NDArray[np.float64] | None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the parts of a plane that both halves of a face share, and by which they differ.

    Parameters
    ----------
    plane : (H, W) array
    weight : (H, W) array
        Where it is known, 0 to 1. Where its twin is not, all is shared.
    twin : (2, H, W) array or None
        As of `twins`.

    Returns
    -------
    shared, differing : (H, W) float32 array
        Their sum is the plane.

    Examples
    --------
    >>> plane, twin = np.array([[1, 2, 3]], np.float32), np.array([[[0, 0, 0]], [[2, 1, 0]]])
    >>> [part.tolist() for part in halves(plane, np.ones((1, 3), np.float32), twin)]
    [[[2.0, 2.0, 2.0]], [[-1.0, 0.0, 1.0]]]
    """
    if twin is None:
        return plane, np.zeros_like(plane)
    both = at_places(np.dstack([weight, plane * weight]), twin[1], twin[0], edge="black")
    there, other = both[..., 0], both[..., 1] / np.maximum(both[..., 0], 1e-3)
    # A place whose twin is half known says half of it.
    differing = np.clip(2 * there - 1, 0, 1) * (plane - other) / 2
    return np.asarray(plane - differing, np.float32), np.asarray(differing, np.float32)
