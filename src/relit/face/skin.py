"""What of a photo looks like the skin of its face: by hue, and by brightness where that tells.

Skin is one pigment in many lights: in ``log R/G`` and ``log B/G`` the face's own pixels lie close together,
and hair, cloth, spectacles and what is behind lie elsewhere. A light changes their brightness much more, so
that counts for little.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from relit.photo.channels import squared_length, transformed, within
from relit.photo.color import luma
from relit.photo.curves import exp, log
from relit.photo.pixels import to_unit
from relit.photo.ranks import median
from relit.runtime.threads import one_blas_thread

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
    """The colours of a skin: mean, (k,), and inverse covariance, (k, k), of `_colors`."""

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
        colors, mean, precision = _colors(image), self.mean, self.precision
        if hue_alone:
            if colors.shape[-1] == 1:
                return np.ones(image.shape[:2], np.float32)
            colors, mean = colors[..., 1:], mean[1:]
            precision = np.linalg.inv(np.linalg.inv(precision)[1:, 1:])
        away = (_distance(colors, mean, precision) - _EDGE) / _SOFT
        return np.asarray(1 / (1 + exp(np.clip(away, -30, 30))), np.float32)

    def whitened(self, image: NDArray[Any]) -> NDArray[np.float32]:
        """Return colours, (H, W, k), in which the skin's standard deviation is 1 in every direction."""
        return _white(_colors(image), self.mean, self.precision)


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
    samples = _colors(within(image, face)[None])[0].astype(np.float64)
    floor = np.array([_BRIGHTNESS, _HUE, _HUE])[: samples.shape[-1]] ** 2
    mean = middle = median(samples)
    off = np.ascontiguousarray((samples - middle).T)
    spread = _OF_MEDIAN * median(np.abs(off.T))
    precision = np.diag(1 / np.maximum(spread**2, floor))
    products = np.concatenate([off, *(off * one for one in off)])
    with one_blas_thread():
        for _ in range(_ROUNDS):
            near = _distance(samples, mean, precision) < _OUTLIER
            first, second = np.split(products @ near / np.count_nonzero(near), [len(off)])
            mean = middle + first
            spread = second.reshape(len(off), -1) - np.outer(first, first)
            precision = np.linalg.inv(spread + np.diag(floor))
    return Skin(mean, precision)


def _white(colors: NDArray[Any], mean: NDArray[np.float64], precision: NDArray[np.float64]) -> NDArray[Any]:
    """Return colours, (..., k), less their mean, and so that their covariance is 1."""
    matrix = np.linalg.cholesky(precision).T
    return transformed(colors, np.column_stack([matrix, -matrix @ mean]))


def _distance(
    colors: NDArray[Any], mean: NDArray[np.float64], precision: NDArray[np.float64]
) -> NDArray[Any]:
    """Return how many standard deviations each colour, (..., k), is off the mean."""
    return np.asarray(np.sqrt(squared_length(_white(colors, mean, precision))))


def _colors(image: NDArray[Any]) -> NDArray[np.float32]:
    """Return log luma, and of colour also log R/G and log B/G, (H, W, 1 or 3)."""
    unit = np.maximum(to_unit(image), np.float32(_DARKEST))
    if unit.ndim == 2:
        return log(unit)[..., None]
    red, green, blue = cv2.split(log(unit))
    return np.asarray(cv2.merge([log(luma(unit)), red - green, blue - green]), np.float32)
