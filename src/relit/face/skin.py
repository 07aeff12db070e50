"""What of a photo looks like the skin of its face: by hue, and by brightness where that tells.

Skin is one pigment in many lights: in ``log R/G`` and ``log B/G`` the face's own pixels lie close together,
and hair, cloth, spectacles and what is behind lie elsewhere. A light changes their brightness much more, so
that counts for little.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.photo.color import luma
from relit.photo.curves import log, squared_length
from relit.photo.pixels import to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

# What each of these is worth: docs/leaderboard.md, The constants.
_DARKEST = 4 / 255  # below, hue is noise
_HUE, _BRIGHTNESS = 0.045, 0.3  # the least standard deviations, in log
_ROUNDS = 5  # of leaving out what is not like most
_OUTLIER = 3.0  # standard deviations: the rule of three sigma
_EDGE, _SOFT = 3.0, 0.4  # standard deviations at which a pixel is as likely skin as not, and how sharply
_OF_MEDIAN = 1.4826  # a normal distribution's standard deviation over its median absolute deviation


@dataclass(frozen=True, eq=False)
class Skin:
    """The colours of a skin: mean and inverse covariance of `_colors`."""

    mean: NDArray[np.float64]
    precision: NDArray[np.float64]

    def likeness(self, image: NDArray[Any], *, hue_alone: bool = False) -> NDArray[np.float32]:
        """Return how likely each pixel is skin, (H, W) in [0, 1].

        Parameters
        ----------
        image : (H, W) or (H, W, 3) array
        hue_alone : bool
            Whether brightness does not count: what is dark may lie in a shadow. All grey is skin then.
        """
        off, precision = _colors(image) - self.mean, self.precision
        if hue_alone:
            if off.shape[-1] == 1:
                return np.ones(image.shape[:2], np.float32)
            off, precision = off[..., 1:], np.linalg.inv(np.linalg.inv(precision)[1:, 1:])
        distance = np.sqrt(squared_length(off @ np.linalg.cholesky(precision)))
        return np.asarray(1 / (1 + np.exp(np.clip((distance - _EDGE) / _SOFT, -30, 30))), np.float32)

    def whitened(self, image: NDArray[Any]) -> NDArray[np.float64]:
        """Return colours, (H, W, k), in which the skin's standard deviation is 1 in every direction."""
        return np.asarray((_colors(image) - self.mean) @ np.linalg.cholesky(self.precision))


def skin_of(image: NDArray[Any], face: NDArray[np.bool_]) -> Skin:
    """Learn a skin from the pixels of its face, those left out that are not like most.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        uint8, uint16 or float in [0, 1].
    face : (H, W) bool array
        Mostly skin.

    Returns
    -------
    Skin

    Examples
    --------
    >>> import numpy as np
    >>> photo = np.zeros((8, 8, 3), np.uint8)
    >>> photo[:, :4], photo[:, 4:] = (200, 140, 110), (90, 120, 90)
    >>> face = np.zeros((8, 8), bool)
    >>> face[:, :5] = True
    >>> skin_of(photo, face).likeness(photo)[0].round().astype(int).tolist()
    [1, 1, 1, 1, 0, 0, 0, 0]
    """
    samples = _colors(image[face][None])[0]
    floor = np.array([_BRIGHTNESS, _HUE, _HUE])[: samples.shape[-1]] ** 2
    mean = np.median(samples, axis=0)
    spread = _OF_MEDIAN * np.median(np.abs(samples - mean), axis=0)
    precision = np.diag(1 / np.maximum(spread**2, floor))
    for _ in range(_ROUNDS):
        near = squared_length((samples - mean) @ np.linalg.cholesky(precision)) < _OUTLIER**2
        share = near / np.count_nonzero(near)
        mean = share @ samples
        off = samples - mean
        precision = np.linalg.inv((off.T * share) @ off + np.diag(floor))
    return Skin(mean, precision)


def _colors(image: NDArray[Any]) -> NDArray[np.float64]:
    """Return log luma, and of colour also log R/G and log B/G, (H, W, 1 or 3)."""
    unit = np.maximum(to_unit(image), np.float32(_DARKEST))
    if unit.ndim == 2:
        return log(unit)[..., None].astype(np.float64)
    red, green, blue = np.moveaxis(log(unit), -1, 0)
    return np.stack([log(luma(unit)), red - green, blue - green], axis=-1).astype(np.float64)
