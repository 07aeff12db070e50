"""Make a change of light in a photo at its own size and depth."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from relit.compose.guided_filter import fit_lines
from relit.photo.channels import repeated
from relit.photo.pixels import DARKEST, from_unit, full_of, to_unit
from relit.photo.resampling import Enlarger
from relit.runtime.threads import available, pool

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from relit.face.views import View
    from relit.photo.planes import PlaneSpace

_ROWS = 64  # of a photo at a time, so that what is in work fits a processor's cache
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
    made = change if mask is None else change * repeated(mask, change.shape[2])
    slope, offset = _lines(made, base) if view.factor > 1 else (None, made)

    def work(block: _Block) -> None:
        here = whole[block.window]
        unit, log = _unit_and_log(np.atleast_3d(space.of_target(here)))
        relit = block.of(offset) if slope is None else block.of(slope) * log + block.of(offset)
        relit = np.exp(relit)
        relit *= unit
        np.minimum(relit, 1, out=relit)
        new = from_unit(space.rebuild(here, relit), target.dtype)
        if mask is None:
            part[block.window] = new
        else:
            cv2.copyTo(new, np.asarray(block.of(mask) > 0, np.uint8), part[block.window])

    with pool(available()) as run:
        run(work, list(_blocks(view, mask)))
    return image


class _Block(NamedTuple):
    """Part of a view that is enlarged at a time, so that what is in work fits a processor's cache."""

    rows: slice
    columns: slice
    factor: int
    window: tuple[slice, slice]  # of the photo's px that the view shows

    def of(self, plane: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return this part of a plane of the view at the photo's size."""
        # With one more px on each side, the enlarged part is that of the whole.
        top, left = max(self.rows.start - 1, 0), max(self.columns.start - 1, 0)
        around = plane[top : self.rows.stop + 1, left : self.columns.stop + 1]
        rows, columns = (
            slice(one.start - first * self.factor, one.stop - first * self.factor)
            for one, first in zip(self.window, (top, left), strict=True)
        )
        enlarger = Enlarger(around, self.factor, (rows.stop, columns.stop))
        return enlarger.rows(rows.start, rows.stop)[:, columns]


def _blocks(view: View, mask: NDArray[np.float32] | None) -> Iterator[_Block]:
    """Return the parts of a view in which a mask is not 0 everywhere."""
    height, width = (one.stop - one.start for one in view.window)
    factor = view.factor
    high = max(_ROWS // factor, 1)
    for top in range(0, view.pixels.shape[0], high):
        rows = slice(top, min(top + high, view.pixels.shape[0]))
        columns = slice(0, view.pixels.shape[1])
        if mask is not None:
            some = np.flatnonzero(mask[max(top - 1, 0) : rows.stop + 1].any(axis=0))
            if not some.size:
                continue
            columns = slice(max(int(some[0]) - 1, 0), min(int(some[-1]) + 2, columns.stop))
        window = (
            slice(rows.start * factor, min(rows.stop * factor, height)),
            slice(columns.start * factor, min(columns.stop * factor, width)),
        )
        yield _Block(rows, columns, factor, window)


def _unit_and_log(planes: NDArray[Any]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return planes, (h, w, k), in (0, 1], and their logarithm; of integers, which are few, looked up."""
    if planes.dtype.kind == "u":
        unit, log = _of_integers(planes.dtype)
        if planes.dtype == np.uint8:
            unit, log = (np.asarray(cv2.LUT(planes, table), np.float32) for table in (unit, log))
            return unit.reshape(planes.shape), log.reshape(planes.shape)
        return unit.take(planes), log.take(planes)
    unit = base_of(planes)
    return unit, np.log(unit)


@cache
def _of_integers(dtype: np.dtype[Any]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    unit = base_of(np.arange(full_of(dtype) + 1, dtype=dtype)).ravel()
    return unit, np.log(unit)


def in_rgb(image: NDArray[Any]) -> NDArray[Any]:
    """Return a grey image in RGB."""
    return np.repeat(image[..., None], 3, axis=2)


def _lines(
    change: NDArray[np.float32], base: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the slope and offset of a change over log I; the offset takes what the line leaves over."""
    guide = np.broadcast_to(np.log(base), change.shape)
    slope = fit_lines(change, guide, _RADIUS, _LEAST).slope
    return slope, change - slope * guide
