"""Fill what is unknown of a plane as a membrane would: no more bent than its known rim makes it."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from relit.photo.channels import repeated
from relit.photo.filters import gaussian
from relit.photo.resampling import Enlarger, reduced
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse.linalg import SuperLU

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
    height, width, count = values.shape
    hold = _HOLD * weight[..., 0].ravel().astype(np.float64)
    level = values.reshape(-1, count).astype(np.float64)
    mean = np.average(level, axis=0, weights=hold)
    rest = max((cell / reach) ** 2, _UNKNOWN)
    solution = _membrane(hold + rest, (height, width)).solve(hold[:, None] * level + rest * mean)
    soft = solution.reshape(height, width, count).astype(np.float32)
    filled = Enlarger(soft, cell, whole.shape).rows(0, whole.shape[0])
    if cell > 1:
        filled = gaussian(filled, cell / 2, edge="repeated")
    return np.asarray((share * whole + (1 - share) * filled).reshape(planes.shape), np.float32)


@remembered
def _membrane(held: NDArray[np.float64], shape: tuple[int, int]) -> SuperLU:
    """Return what solves for a membrane that is held so much at each cell."""
    # Of a symmetric matrix, this order fills up less, and takes half the time.
    return splu((_stiffness(*shape) + diags_array(held)).tocsc(), permc_spec="MMD_AT_PLUS_A")


@lru_cache(maxsize=4)
def _stiffness(height: int, width: int) -> Any:
    """Return the matrix of ``Σ (x_i - x_j)²`` over neighbours i, j of a grid."""
    number = np.arange(height * width).reshape(height, width)
    one = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    other = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    ones = np.ones(len(one))
    size = (height * width, height * width)
    pull = coo_array((ones, (one, other)), size)
    pull = pull + pull.T
    return diags_array(pull.sum(axis=1)) - pull
