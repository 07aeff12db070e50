"""Fill what is unknown of a plane as a membrane would: no more bent than its known rim makes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.photo.channels import repeated
from relit.photo.filters import gaussian
from relit.photo.resampling import Enlarger, reduced
from relit.solver.multigrid import held_membrane

if TYPE_CHECKING:
    from numpy.typing import NDArray

# What each of these is worth: docs/leaderboard.md, The constants.
_HOLD = 10.0  # how much more a known cell weighs than its neighbours' wish for smoothness
_UNKNOWN = 1e-6
_CELL, _LEAST_CELL = 1 / 20, 2  # interocular distances, and px: the size of the membrane's cells
_SETTLED = 0.4  # interocular distances, over which a change that is carried on turns into the mean


def carried_on(
    change: NDArray[np.float32], known: NDArray[np.float32], interocular_distance: float
) -> NDArray[np.float32]:
    """Return a change of light on a face, carried on over what is not known of it."""
    cell = max(round(_CELL * interocular_distance), _LEAST_CELL)
    return fill(change, known, cell=cell, reach=_SETTLED * interocular_distance)


def fill(
    planes: NDArray[np.floating[Any]],
    known: NDArray[np.floating[Any]],
    *,
    cell: int,
    reach: float = np.inf,
) -> NDArray[np.float32]:
    """Return planes, with what is not known replaced by the harmonic extension of what is.

    The membrane ``∫|∇x|² → min`` is solved in cells, held where they are known and free at the frame [1]_;
    within the known, the planes stay as they are. With a reach R, ``(x - m)² / R²`` is added, m being the
    mean of the known: farther off than R, little is left of how one side differs from another.

    Parameters
    ----------
    planes : (H, W) or (H, W, k) array
    known : (H, W) array
        In [0, 1]; between the two a pixel is a mixture. If nothing is known, nothing is filled.
    cell : int
        Side in px of the cells that the membrane is solved in.
    reach : float
        R, in px; by default there is no end to it.

    Returns
    -------
    (H, W) or (H, W, k) float32 array

    References
    ----------
    .. [1] P. Pérez, M. Gangnet, A. Blake, "Poisson image editing", SIGGRAPH 2003.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.tile(np.linspace(0, 1, 24), (24, 1))
    >>> known = np.ones((24, 24))
    >>> known[8:16, 8:16] = 0
    >>> filled = fill(np.where(known > 0, ramp, 9), known, cell=1)
    >>> bool(np.abs(filled - ramp).max() < 0.03)
    True
    """
    whole = planes if planes.ndim == 3 else planes[..., None]
    share = repeated(np.clip(known, 0, 1).astype(np.float32), whole.shape[2])
    if not (share > _UNKNOWN).any():
        return np.asarray(planes, np.float32)
    weight = reduced(share, cell)
    values = reduced(share * whole.astype(np.float32), cell) / np.maximum(weight, _UNKNOWN)
    hold = _HOLD * weight[..., 0].astype(np.float64)
    rest = max((cell / reach) ** 2, _UNKNOWN)
    soft = np.empty_like(values)
    for k, level in enumerate(np.moveaxis(values.astype(np.float64), -1, 0)):
        mean = np.average(level, weights=hold)
        soft[..., k] = mean + held_membrane(hold + rest, hold * (level - mean))
    filled = Enlarger(soft, cell, whole.shape).rows(0, whole.shape[0])
    if cell > 1:
        filled = gaussian(filled, cell / 2, edge="repeated")
    return np.asarray((share * whole + (1 - share) * filled).reshape(planes.shape), np.float32)
