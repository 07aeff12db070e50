"""How near a relit face in a colour photo is to the truth: on the face, round it, and behind it.

What is compared is light, whose strength cannot be known from one reference: one gain that fits best on the
face comes first, of luma or, where colour counts, of linear light.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relit.errors import ImageError
from relit.evaluate.color_difference import ciede2000, lab, linear_light
from relit.evaluate.scores import similarity_map
from relit.photo.color import luma
from relit.photo.doubles import gaussian
from relit.photo.filters import distance_from

_PEAK = 255.0
_BLOTCH = 0.03  # of the face's width: what is finer than this is no blotch
_HALO = 20.0  # px


@dataclass(frozen=True)
class FaceScores:
    """Scores of one relit colour photo.

    Attributes
    ----------
    raw : float
        Mean absolute error of the face's luma, in % of the range of values.
    lum : float
        The same after the one gain that fits best in least squares.
    ssim : float
        Structural similarity of luma after that gain, over windows round the face's pixels, up to 1.
    de : float
        Mean CIEDE2000 over the face, after the one gain in linear light that fits best.
    ab : float
        Mean distance in the plane of a* and b* over the face, after that gain.
    cast : float
        Length of the mean difference in that plane: the face as a whole has another hue.
    blotch : float
        How far the difference in that plane, smoothed, spreads about its mean: orange noses, grey cheeks.
    around_lum, around_de : float
        ``lum`` and ``de``, with the face's gains, over ears, neck and hair: what is neither face nor
        background.
    background, background_max : float
        Mean and greatest CIEDE2000 of the background to the target's, which should stay as it is.
    halo : float
        The mean beside the head: within 20 px of it, and no lower than the face.
    """

    raw: float
    lum: float
    ssim: float
    de: float
    ab: float
    cast: float
    blotch: float
    around_lum: float
    around_de: float
    background: float
    background_max: float
    halo: float


def face_scores(
    image: NDArray[Any],
    truth: NDArray[Any],
    target: NDArray[Any],
    face: NDArray[np.bool_],
    background: NDArray[np.bool_],
) -> FaceScores:
    """Compare a relit photo with the truth on the face and round it, and with the target behind it.

    Parameters
    ----------
    image, truth, target : (H, W, 3) array
        sRGB, of values 0 to 255.
    face : (H, W) bool array
        Where the skin and the lips are.
    background : (H, W) bool array
        What is not the person.

    Returns
    -------
    FaceScores

    Raises
    ------
    ImageError
        If the shapes differ, or the face, the background or the rest of the head is nowhere.

    Examples
    --------
    >>> truth = np.full((60, 60, 3), 120.0)
    >>> y, x = np.mgrid[-30:30, -30:30]
    >>> face, background = np.hypot(x, y) < 15, np.hypot(x, y) > 22
    >>> scores = face_scores(truth * 0.8, truth, truth, face, background)
    >>> round(scores.raw, 1), round(scores.lum, 6), round(scores.ssim, 6), round(scores.background, 1)
    (9.4, 0.0, 1.0, 9.3)
    """
    for name, one in (("truth", truth), ("target", target), ("face", face), ("background", background)):
        if one.shape[:2] != image.shape[:2]:
            raise ImageError(f"{name}: expected the size of the image, {image.shape[:2]}, got {one.shape}")
    if not face.any():
        raise ImageError("face: expected some pixels of it, got none; mend the mask")
    around, beside = ~(face | background), _beside_head(face, background)
    for name, area in (("around the face", around), ("background beside the head", beside)):
        if not area.any():
            raise ImageError(f"{name}: expected some pixels, which neither mask leaves; mend the masks")
    got, wanted = luma(image.astype(np.float64)), luma(truth.astype(np.float64))
    fitted = got * _gain(got[face], wanted[face])
    light, true_light = (linear_light(one / _PEAK) for one in (image, truth))
    gain = _gain(light[face], true_light[face])

    ours, true = lab(gain * light[face]), lab(true_light[face])
    difference = (ours - true)[:, 1:]
    behind = np.zeros(background.shape)
    changed = background & (image != target).any(axis=2)  # all else is as it was
    behind[changed] = ciede2000(lab(light[changed]), lab(linear_light(target[changed] / _PEAK)))
    return FaceScores(
        raw=_error(got[face], wanted[face]),
        lum=_error(fitted[face], wanted[face]),
        ssim=float(similarity_map(fitted, wanted, _PEAK)[face].mean()),
        de=float(ciede2000(ours, true).mean()),
        ab=float(np.hypot(*difference.T).mean()),
        cast=float(np.hypot(*difference.mean(axis=0))),
        blotch=_spread(difference, face),
        around_lum=_error(fitted[around], wanted[around]),
        around_de=float(ciede2000(lab(gain * light[around]), lab(true_light[around])).mean()),
        background=float(behind[background].mean()),
        background_max=float(behind.max()),
        halo=float(behind[beside].mean()),
    )


def _gain(got: NDArray[np.float64], wanted: NDArray[np.float64]) -> float:
    """Return what to multiply with to come nearest in least squares; 1 for black."""
    power = float((got * got).sum())
    return float((got * wanted).sum()) / power if power > 0 else 1.0


def _error(got: NDArray[np.float64], wanted: NDArray[np.float64]) -> float:
    return float(np.abs(got - wanted).mean() / _PEAK * 100)


def _beside_head(face: NDArray[np.bool_], background: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the background round the head; what is beside neck and shoulders does not count."""
    lowest = np.flatnonzero(face.any(axis=1))[-1]
    near = background & (distance_from(~background) <= _HALO)
    near[lowest + 1 :] = False
    return near


def _spread(values: NDArray[np.float64], face: NDArray[np.bool_]) -> float:
    """Return the standard deviation, over all channels, of what the face has, smoothed within it."""
    columns = np.flatnonzero(face.any(axis=0))
    sigma = _BLOTCH * (columns[-1] - columns[0] + 1)
    plane = np.zeros((*face.shape, values.shape[1]))
    plane[face] = values
    weight = gaussian(face, sigma)
    smooth = gaussian(plane, sigma)[face] / weight[face][:, None]
    return float(np.sqrt(smooth.var(axis=0).sum()))
