"""Where a photo has bleached a skin, or burnt it in, and the hue that it takes on when its light changes.

A highlight is white, and a photo's curve leaves less colour in what is bright and more in what is dark: so a
bright place that gets darker would be ashen, and a dark one that gets brighter, red. In the dichromatic model
[1]_ a colour lies between that of a surface and that of the light: here, between the hue h of most of a skin
and white, in log. A pixel of hue H is bleached by ``t = 1 - H·h / h·h``: 0 if it has the skin's own hue, 1 if
it has none, and less than 0 if it has more.

References
----------
.. [1] S. A. Shafer, "Using color to separate reflection components", Color Res. Appl. 10(4), 1985.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from relit.photo.channels import moved, repeated, squared_length, transformed, within
from relit.photo.color import luma
from relit.photo.curves import log
from relit.photo.filters import gaussian
from relit.photo.ranks import median

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    Plane: TypeAlias = NDArray[np.float32]

# What each of these is worth: docs/leaderboard.md, The constants.
_USUAL = 0.1  # t that a skin may have by itself
_BESIDE = 0.3  # of h: what is so far beside the line from it to white counts half
_OF_BURNT = 0.5  # how much of what is burnt in is undone: skin in a shadow is redder by itself
_EDGE = 0.02  # interocular distances over which skin ends
_ALL = 0.5  # in log of light: a change from which on all of it is undone
_DARKEST = 1e-4  # linear light that counts as none


class Bleach(NamedTuple):
    """How far the skin of a face is bleached.

    Attributes
    ----------
    share : (H, W) array
        t, from -1 to 1, less what is usual; 0 off the skin.
    hue : (3,) array
        h: log of red, green and blue over the brightness.
    """

    share: Plane
    hue: Plane

    def undone(self, change: Plane) -> Plane:
        """Return what to add to the log of each colour, (H, W, 3), for a change of brightness, in log.

        Only what got darker is unbleached, and only what got brighter is bleached.

        Examples
        --------
        >>> bleach = Bleach(np.array([[1, 1, -1]], np.float32), np.array([0.3, -0.1, -0.2], np.float32))
        >>> bleach.undone(np.array([[-1, 1, 1]], np.float32))[0, :, 0].astype(float).round(2).tolist()
        [0.3, 0.0, -0.3]
        """
        share = np.where(self.share * change < 0, self.share, 0) * np.minimum(np.abs(change) / _ALL, 1)
        return transformed(np.asarray(share[..., None], np.float32), self.hue[:, None])


def bleach_of(
    smooth: Plane, own_hue: Plane | None, skin: Plane, inside: NDArray[np.bool_], iod: float
) -> Bleach | None:
    """Find how far a face's skin is bleached.

    Parameters
    ----------
    smooth : (H, W, 3) or (H, W) array
        Linear light, as of `hue.without_noise`.
    own_hue : (H, W, 3) array or None
        Of the light that falls on it, as log over its brightness.
    skin : (H, W) array
        Where the face shows skin, 0 to 1.
    inside : (H, W) bool array
        Where the face is; what is brighter there than most of its skin is a highlight.
    iod : float
        Interocular distance in px.

    Returns
    -------
    Bleach or None
        None of a grey photo, and where no skin is seen, or it has no hue.
    """
    shown = skin > 0.5
    if smooth.ndim == 2 or not shown.any():
        return None
    smooth = np.maximum(smooth, np.float32(_DARKEST))
    brightness = luma(smooth)
    hue = log(smooth / repeated(brightness, 3))
    if own_hue is not None:
        hue = moved(hue - own_hue, median(within(own_hue, shown)))
    usual = median(within(hue, shown))
    size = float(usual @ usual)
    if size < _DARKEST:
        return None
    share = transformed(hue, np.append(-usual / size, 1)[None])[..., 0]
    # Beside the line from a skin to white, or beyond white, there is paint, or another light.
    beside = squared_length(hue - transformed((1 - share)[..., None], usual[:, None])) / size
    trust = np.clip(2 - share, 0, 1) / (1 + beside / _BESIDE**2)
    share = np.clip(share - np.clip(share, -_USUAL, _USUAL), -1, 1)
    share = trust * np.where(share < 0, _OF_BURNT * share, share)
    there = np.maximum(skin, inside & (brightness > median(brightness[shown])))
    return Bleach(np.asarray(share * gaussian(there, _EDGE * iod), np.float32), usual)
