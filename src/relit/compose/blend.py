"""Make a change of light in a photo at its own size and depth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.compose.guided_filter import fit_lines
from relit.photo.pixels import DARKEST, from_unit, to_unit
from relit.photo.resampling import Enlarger
from relit.runtime.threads import available, pool

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.photo.planes import PlaneSpace

_ROWS = 128  # at a time, so that what is in work fits a processor's cache
_RADIUS, _LEAST = 1, 0.03  # px, and log I: of the lines that carry a change along the photo's edges


def base_of(planes: NDArray[Any]) -> NDArray[np.float32]:
    """Return planes as (H, W, k) in (0, 1]: what is darker than half an 8-bit level counts as that."""
    return np.maximum(np.atleast_3d(to_unit(planes)), np.float32(DARKEST))


def blend(
    target: NDArray[Any],
    change: NDArray[np.float32],
    mask: NDArray[np.float32] | None,
    space: PlaneSpace,
    base: NDArray[np.float32],
    factor: int,
    *,
    colored: bool,
) -> NDArray[Any]:
    """Return a photo with its planes changed: ``I · exp(mask · change)``.

    Parameters
    ----------
    target : (H, W) or (H, W, 3) array
    change : (h, w, k) array
        log of what the planes are multiplied with, on the photo reduced by `factor`.
    mask : (h, w) array or None
        Share of the change that is made. Where it is 0 the photo stays as it is, bit for bit.
    space : PlaneSpace
    base : (h, w, k) or (h, w, 1) array
        Planes of the reduced photo, as of `base_of`.
    factor : int
    colored : bool
        Whether a grey target takes on colours.

    Returns
    -------
    (H, W) or (H, W, 3) array
        In the target's dtype.
    """
    made = change if mask is None else change * mask[..., None]
    slope, offset = _lines(made, base) if factor > 1 else (np.zeros_like(made), made)
    enlarged = [Enlarger(plane, factor, target.shape) for plane in (slope, offset)]
    share = None if mask is None else Enlarger(mask, factor, target.shape)
    out = np.empty((*target.shape[:2], 3) if colored else target.shape, target.dtype)

    def work(first: int) -> None:
        rows = slice(first, min(first + _ROWS, len(target)))
        part = target[rows]
        planes = base_of(space.of_target(part))
        steep, shift = (plane.rows(rows.start, rows.stop) for plane in enlarged)
        if factor > 1:
            shift = shift + steep * np.log(planes)
        relit = np.clip(planes * np.exp(shift), 0, 1)
        new = from_unit(space.rebuild(part, relit[..., 0] if relit.shape[2] == 1 else relit), target.dtype)
        if share is not None:
            old = np.repeat(part[..., None], 3, axis=2) if colored and part.ndim == 2 else part
            touched = share.rows(rows.start, rows.stop) > 0
            new = np.where(touched if new.ndim == 2 else touched[..., None], new, old)
        out[rows] = new

    with pool(available()) as run:
        run(work, range(0, len(target), _ROWS))
    return out


def _lines(
    change: NDArray[np.float32], base: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the slope and offset of a change over log I; the offset takes what the line leaves over."""
    guide = np.broadcast_to(np.log(base), change.shape)
    slope = np.stack(
        [fit_lines(change[..., k], guide[..., k], _RADIUS, _LEAST).slope for k in range(change.shape[2])],
        axis=-1,
    )
    return slope, change - slope * guide
