"""Which planes of two photos are relit, and how they become a photo again (Sect. 6 of the paper).

====================  ==================================  ==============================================
target, reference     planes that are relit               what becomes of the others
====================  ==================================  ==============================================
grey, grey            the images
colour, colour        the chosen channels of the space    kept from the target
grey, colour          the same, of an achromatic target   the target becomes coloured
colour, grey          lightness alone: luma of RGB, V, Y  kept; R, G and B scale alike with their luma
====================  ==================================  ==============================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.color import COLOR_SPACES, ColorSpace, ColorSpaceName, channels_of, luma
from relit.ltv import DARKEST
from relit.pixels import to_unit

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Planes:
    """The planes to relight.

    Attributes
    ----------
    target, reference : (H, W) or (H, W, 3) array
        A target of one plane serves all three of a reference.
    rebuild : callable
        Takes the relit planes, (H, W) or (H, W, 3) float32, to grey or RGB.
    """

    target: NDArray[Any]
    reference: NDArray[Any]
    rebuild: Callable[[NDArray[np.float32]], NDArray[np.float32]]


def planes_of(
    target: NDArray[Any], reference: NDArray[Any], color_space: ColorSpaceName, channels: str
) -> Planes:
    """Return the planes of two photos of one frame that are to be relit.

    Parameters
    ----------
    target, reference : (H, W) or (H, W, 3) array
        Grey or RGB: uint8, uint16, or float in [0, 1].
    color_space, channels
        As in `TransferOptions`.

    Returns
    -------
    Planes

    Examples
    --------
    >>> import numpy as np
    >>> brown, grey = np.full((8, 8, 3), [120, 80, 40], np.uint8), np.full((8, 8), 9, np.uint8)
    >>> planes = planes_of(brown, grey, "rgb", "all")
    >>> twice_as_light = planes.rebuild(2 * planes.target)
    >>> (255 * twice_as_light[0, 0]).round().tolist()
    [240.0, 160.0, 80.0]
    """
    if target.ndim == 2 and reference.ndim == 2:
        return Planes(target, reference, lambda relit: relit)

    space = COLOR_SPACES[color_space]
    if reference.ndim == 2 and space.lightness is None:
        rgb = to_unit(target)
        lightness = np.clip(luma(rgb), DARKEST, 1)
        return Planes(lightness, reference, lambda relit: rgb * (relit / lightness)[..., None])
    if color_space == "rgb" and channels == "all":
        return Planes(target, reference, lambda relit: relit)

    chosen = channels_of(color_space, channels)
    if reference.ndim == 2 and space.lightness is not None:
        chosen = channels_of(color_space, space.lightness)
    whole, light = _in_space(target, space), _in_space(reference, space)

    def rebuild(relit: NDArray[np.float32]) -> NDArray[np.float32]:
        channels = whole.copy()
        channels[..., chosen] = np.clip(np.atleast_3d(relit), 0, 1)
        rgb: NDArray[np.float32] = space.to_rgb(channels)
        return rgb

    return Planes(_pick(whole, chosen), _pick(light, chosen), rebuild)


def _in_space(image: NDArray[Any], space: ColorSpace) -> NDArray[np.float32]:
    rgb = to_unit(image)
    if rgb.ndim == 2:
        rgb = np.repeat(rgb[..., None], 3, axis=2)
    # Rounding may leave [0, 1] by a hair.
    return np.asarray(np.clip(space.from_rgb(rgb), 0, 1))


def _pick(planes: NDArray[np.float32], chosen: tuple[int, ...]) -> NDArray[np.float32]:
    return np.asarray(planes[..., chosen[0]] if len(chosen) == 1 else planes[..., chosen])
