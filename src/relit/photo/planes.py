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

from relit.photo.color import COLOR_SPACES, LUMA_WEIGHTS, ColorSpace, ColorSpaceName, channels_of, luma
from relit.photo.pixels import DARKEST, to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class PlaneSpace:
    """Which planes of two photos are relit, and the way back."""

    color_space: ColorSpaceName
    #: Channels of that space; None where all of the photo are taken as they are.
    chosen: tuple[int, ...] | None = None
    #: Whether the one plane is the luma of RGB, with which R, G and B scale.
    by_luma: bool = False
    #: Whether a grey target takes on colours.
    coloring: bool = False

    @property
    def shows_colors(self) -> bool:
        """Whether the planes of a colour reference have its colours, and not one channel alone."""
        return not self.by_luma and (self.chosen is None or len(self.chosen) > 1)

    def of_target(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return the planes of a target, (H, W) or (H, W, k). One plane serves all three of a reference."""
        if self.by_luma:
            return np.asarray(np.clip(luma(to_unit(image)), DARKEST, 1))
        return self.of_reference(image)

    def of_reference(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return the planes of a reference, (H, W) or (H, W, k)."""
        if self.by_luma or self.chosen is None:
            return image
        return self._channels(image)[..., self.chosen[0] if len(self.chosen) == 1 else self.chosen]

    def rebuild(self, target: NDArray[Any], relit: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the target with its planes relit, (H, W) or (H, W, k), in grey or RGB."""
        relit = relit[..., 0] if relit.ndim == 3 and relit.shape[2] == 1 else relit
        if self.by_luma:
            return np.asarray(to_unit(target) * (relit / self.of_target(target))[..., None], np.float32)
        if self.chosen is None:
            return relit
        channels = self._channels(target)
        channels[..., self.chosen] = np.clip(np.atleast_3d(relit), 0, 1)
        return np.asarray(self._space.to_rgb(channels), np.float32)

    def weights(self, count: int) -> NDArray[np.float32]:
        """Return the share of each of ``count`` planes in the brightness of a relit photo."""
        if count == 1:
            return np.ones(1, np.float32)
        lightness = self._space.lightness
        if lightness is None:
            return LUMA_WEIGHTS.astype(np.float32)
        return np.asarray(np.arange(count) == self._space.channels.index(lightness), np.float32)

    def _channels(self, image: NDArray[Any]) -> NDArray[np.float32]:
        """Return a new array of all three channels of the space."""
        rgb = to_unit(image)
        if rgb.ndim == 2:
            rgb = np.repeat(rgb[..., None], 3, axis=2)
        # Rounding may leave [0, 1] a little.
        return np.asarray(np.clip(self._space.from_rgb(rgb), 0, 1))

    @property
    def _space(self) -> ColorSpace:
        return COLOR_SPACES[self.color_space]


def plane_space(
    grey_target: bool, grey_reference: bool, color_space: ColorSpaceName, channels: str
) -> PlaneSpace:
    """Return the planes of two photos of one frame that are to be relit.

    Parameters
    ----------
    grey_target, grey_reference : bool
        Whether they are (H, W), and not (H, W, 3).
    color_space, channels
        As in `TransferOptions`.

    Examples
    --------
    >>> brown = np.full((8, 8, 3), [120, 80, 40], np.uint8)
    >>> space = plane_space(False, True, "rgb", "all")
    >>> twice_as_light = space.rebuild(brown, 2 * space.of_target(brown))
    >>> (255 * twice_as_light[0, 0]).round().tolist()
    [240.0, 160.0, 80.0]
    """
    if grey_target and grey_reference:
        return PlaneSpace("rgb")
    coloring = grey_target
    lightness = COLOR_SPACES[color_space].lightness
    if grey_reference and lightness is None:
        return PlaneSpace(color_space, by_luma=True)
    if color_space == "rgb" and channels == "all":
        return PlaneSpace(color_space, coloring=coloring)
    chosen = lightness if grey_reference and lightness is not None else channels
    return PlaneSpace(color_space, channels_of(color_space, chosen), coloring=coloring)
