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

    from relit.face.views import View
    from relit.photo.planes import PlaneSpace

_ROWS = 128  # at a time, so that what is in work fits a processor's cache
# What each of these is worth: docs/leaderboard.md, The constants.
_RADIUS, _LEAST = 1, 0.03  # px, and log I: of the lines that carry a change along the photo's edges


def base_of(planes: NDArray[Any]) -> NDArray[np.float32]:
    """Return planes as (H, W, k) in (0, 1]: what is darker than half an 8-bit level counts as that."""
    return np.maximum(np.atleast_3d(to_unit(planes)), np.float32(DARKEST))


def blend(
    target: NDArray[Any],
    view: View,
    change: NDArray[np.float32],
    mask: NDArray[np.float32] | None,
    space: PlaneSpace,
    base: NDArray[np.float32],
) -> NDArray[Any]:
    """Return a photo with its planes changed where a view shows them: ``I · exp(mask · change)``.

    Parameters
    ----------
    target : (H, W) or (H, W, 3) array
    view : View
        Of the target.
    change : (h, w, k) array
        log of what the planes of the view are multiplied with.
    mask : (h, w) array or None
        Share of the change that is made. Where it is 0 the photo stays as it is, bit for bit.
    space : PlaneSpace
    base : (h, w, k) or (h, w, 1) array
        Planes of the view, as of `base_of`.

    Returns
    -------
    (H, W) or (H, W, 3) array
        In the target's dtype; RGB where a grey target takes on colours.
    """
    image = in_rgb(target) if space.coloring else target.copy()
    part, whole = image[view.window], target[view.window]
    made = change if mask is None else change * mask[..., None]
    slope, offset = _lines(made, base) if view.factor > 1 else (np.zeros_like(made), made)
    enlarged = [Enlarger(plane, view.factor, whole.shape) for plane in (slope, offset)]
    share = None if mask is None else Enlarger(mask, view.factor, whole.shape)

    def work(first: int) -> None:
        rows = slice(first, min(first + _ROWS, len(whole)))
        planes = base_of(space.of_target(whole[rows]))
        steep, shift = (plane.rows(rows.start, rows.stop) for plane in enlarged)
        if view.factor > 1:
            shift = shift + steep * np.log(planes)
        relit = np.clip(planes * np.exp(shift), 0, 1)
        new = from_unit(space.rebuild(whole[rows], relit), target.dtype)
        touched = slice(None) if share is None else share.rows(rows.start, rows.stop) > 0
        part[rows][touched] = new[touched]

    with pool(available()) as run:
        run(work, range(0, len(whole), _ROWS))
    return image


def in_rgb(image: NDArray[Any]) -> NDArray[Any]:
    """Return a grey image in RGB."""
    return np.repeat(image[..., None], 3, axis=2)


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
