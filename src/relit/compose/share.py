"""How much of a change of light is made at each pixel."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.compose.matte import matte
from relit.compose.person_matte import person_matte
from relit.photo.pixels import to_unit
from relit.photo.resampling import reduced

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.views import View
    from relit.settings.options import TransferOptions


def share_of_change(
    view: View, options: TransferOptions, region_mask: NDArray[Any] | None
) -> NDArray[np.float32] | None:
    """Return the share of a change that is made, 0 to 1: on the person or skin, in the region to be relit.

    None where all of it is made everywhere.
    """
    where = person_matte if options.record.relights_head else matte
    factors = [where(view)] if options.mask else []
    if options.region != "face":
        factors.append(view.regions.parts(options.region))
    if region_mask is not None:
        factors.append(to_unit(reduced(region_mask[view.window], view.factor)))
    if options.strength == 0:
        factors.append(np.zeros(view.regions.shape, np.float32))
    return reduce(np.multiply, factors) if factors else None
