"""What lamps leave unexplained of a face, and how much of that is light.

Of e there is the person in both halves of a face, and a shadow or a highlight in one: what the halves share
counts less than that by which they differ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.face.mirror import halves
from relit.photo.resampling import blurred
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.methods.lit_face import LitFace, Plane

# What each of these is worth: docs/leaderboard.md, The constants.
_THEIRS = 0.4  # a
_OURS_SHARED, _OURS_DIFFERING = 0.4, 0.8  # b, of what the halves of a face share, and of what not
_FRINGE = 0.3  # in log: above the brows, what is farther off may be hair, and its shadow
_AROUND = 0.1  # interocular distances from where a residual is carried on over what is not skin


def of_reference(reference: LitFace, below_brows: NDArray[np.floating], blur: float, iod: float) -> Plane:
    """Return a r: what a new light has of the reference's residual.

    Parameters
    ----------
    reference : LitFace
    below_brows : (H, W) array
        Where the face is that no fringe reaches, 0 to 1.
    blur : float
        In px.
    iod : float
        Interocular distance in px.
    """
    most = np.where(below_brows > 0.5, np.inf, _FRINGE).astype(np.float32)
    return np.asarray(_THEIRS * _blurred(reference, most, blur, iod)[0], np.float32)


@remembered
def of_target(target: LitFace, twin: NDArray[np.float64] | None, blur: float, iod: float) -> Plane:
    """Return b t: what the old light has of the target's residual; `twin` is as of `mirror.twins`."""
    shared, differing = halves(*_blurred(target, np.inf, blur, iod), twin)
    return np.asarray(_OURS_SHARED * shared + _OURS_DIFFERING * differing, np.float32)


def _blurred(face: LitFace, most: Plane | float, blur: float, iod: float) -> tuple[Plane, Plane]:
    """Return a face's e, blurred where there is skin and carried on from there, and where that is known."""
    unexplained, weight = np.clip(face.unexplained, -most, most), face.weight
    near, around = blurred(weight, blur), blurred(weight, _AROUND * iod)
    fine = blurred(unexplained * weight, blur) / np.maximum(near, 1e-3)
    wide = blurred(unexplained * weight, _AROUND * iod) / np.maximum(around, 1e-2)
    share, known = np.minimum(4 * near, 1), np.minimum(4 * around, 1)
    return np.asarray(share * fine + (1 - share) * known * wide, np.float32), known
