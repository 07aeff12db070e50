"""What heads have in common, and how they differ: their mean, and the ways they vary most [1]_.

References
----------
.. [1] V. Blanz and T. Vetter, "A morphable model for the synthesis of 3D faces", SIGGRAPH 1999.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FACE, _NECK = 0.6, 1.6  # interocular distances behind and below the eyes, up to which vertices are the face
_BESIDE_FACE = 0.3  # how much the others count


class Modes(NamedTuple):
    """Heads as a mean and modes.

    Attributes
    ----------
    mean : (n, 3) array
    modes : (k, n, 3) array
        Of one standard deviation each, the largest first.
    """

    mean: NDArray[np.float64]
    modes: NDArray[np.float64]


def modes_of(heads: NDArray[np.float64], count: int) -> Modes:
    """Return mean and modes of halves of heads, (m, n, 3), in interocular distances.

    Heads are alike that differ in size, place or how they are held: they are brought to the same first.
    """
    middle = heads.mean(axis=0)
    face = (middle[:, 2] < _FACE) & (abs(middle[:, 1]) < _NECK)
    heads = np.array([_upright(head, middle, face) for head in heads])
    mean = heads.mean(axis=0)
    counts = np.where(face, 1, _BESIDE_FACE)[:, None]
    off = ((heads - mean) * counts).reshape(len(heads), -1)
    _, sizes, ways = np.linalg.svd(off, full_matrices=False)
    modes = (sizes / np.sqrt(len(heads)))[:count, None] * ways[:count]
    return Modes(mean, modes.reshape(count, -1, 3) / counts)


def _upright(
    head: NDArray[np.float64], like: NDArray[np.float64], where: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return half a head, nodded, shifted and scaled so that it lies where another does."""
    here, there = head[where], like[where]
    center, middle = here[:, 1:].mean(axis=0), there[:, 1:].mean(axis=0)
    away, wanted = here[:, 1:] - center, there[:, 1:] - middle
    angle = np.arctan2((away[:, 0] * wanted[:, 1] - away[:, 1] * wanted[:, 0]).sum(), (away * wanted).sum())
    nod = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    overlap = (here[:, 0] * there[:, 0]).sum() + (away @ nod * wanted).sum()
    scale = overlap / ((here[:, 0] ** 2).sum() + (away**2).sum())
    return np.column_stack([scale * head[:, 0], (head[:, 1:] - center) @ nod * scale + middle])
