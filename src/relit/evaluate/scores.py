"""How near a relit face is to the truth: errors before and after the best exposure, and likeness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relit.errors import ImageError
from relit.ltv.decomposition import normalize
from relit.photo.doubles import window_mean

_WINDOW = 7
_K1, _K2 = 0.01, 0.03


@dataclass(frozen=True)
class Scores:
    """Scores of one relit image.

    Attributes
    ----------
    raw : float
        Mean absolute error in % of the range of values: the paper's own score.
    gain : float
        The same after the one gain that fits best in least squares: the strength of a flash cannot be known
        from one reference, and the raw error mixes it in.
    ssim : float
        Structural similarity after that gain, up to 1: whether it is still this person.
    identity : float
        By how much the features of the image correlate more with those of the truth than with those of the
        reference: below 0 it is rather the other person. Features are v of the LTV model.
    """

    raw: float
    gain: float
    ssim: float
    identity: float


def score(
    image: NDArray[Any],
    truth: NDArray[Any],
    reference: NDArray[Any],
    *,
    peak: float = 255.0,
    border: int = 8,
) -> Scores:
    """Compare a relit image with the truth.

    Parameters
    ----------
    image, truth, reference : (H, W) or (H, W, 3) array
        Of one shape and scale; the reference as it lies on the target.
    peak : float
        The greatest value that a pixel can have.
    border : int
        Rows and columns at every edge that do not count, in px.

    Returns
    -------
    Scores

    Raises
    ------
    ImageError
        If the shapes differ, or nothing is left within the border.

    Examples
    --------
    >>> import numpy as np
    >>> truth = np.linspace(0, 200, 32 * 32).reshape(32, 32)
    >>> dim = score(truth / 2, truth, np.flipud(truth))
    >>> round(dim.raw, 1), round(dim.gain, 6), round(dim.ssim, 6)
    (19.6, 0.0, 1.0)
    """
    if image.shape != truth.shape:
        raise ImageError(f"image: expected the shape of the truth, {truth.shape}, got {image.shape}")
    least = 2 * border + _WINDOW
    if min(image.shape[:2]) < least:
        raise ImageError(
            f"image: expected sides of {least} px or more, got {image.shape}; use a smaller border"
        )
    inner = (slice(border, image.shape[0] - border), slice(border, image.shape[1] - border))
    got, wanted = image[inner].astype(np.float64), truth[inner].astype(np.float64)
    power = float((got * got).sum())
    fitted = got * ((got * wanted).sum() / power if power > 0 else 1.0)
    ours, true, other = (_features(one[inner], peak) for one in (image, truth, reference))
    return Scores(
        raw=float(np.abs(got - wanted).mean() / peak * 100),
        gain=float(np.abs(fitted - wanted).mean() / peak * 100),
        ssim=structural_similarity(fitted, wanted, peak),
        identity=_correlation(ours, true) - _correlation(ours, other),
    )


def _features(image: NDArray[Any], peak: float) -> NDArray[np.float64]:
    levels = np.asarray(np.clip(np.rint(image / peak * 255), 0, 255), np.uint8)
    return np.log(normalize(levels))


def _correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the correlation of two images' features; 0 where one has none."""
    spread = float(a.std()), float(b.std())
    if min(spread) < 1e-6:
        return 0.0
    return float(((a - a.mean()) * (b - b.mean())).mean() / (spread[0] * spread[1]))


def structural_similarity(a: NDArray[np.float64], b: NDArray[np.float64], peak: float) -> float:
    """Return the mean structural similarity of two images [1]_, over windows of 7 by 7 px and all channels.

    References
    ----------
    .. [1] Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error
           visibility to structural similarity", IEEE TIP 13(4), 2004.

    Examples
    --------
    >>> import numpy as np
    >>> image = np.arange(100.0).reshape(10, 10)
    >>> structural_similarity(image, image, 255)
    1.0
    """
    inside = slice(_WINDOW // 2, -(_WINDOW // 2))  # of windows, only those that lie in the image count
    return float(similarity_map(a, b, peak)[inside, inside].mean())


def similarity_map(a: NDArray[np.float64], b: NDArray[np.float64], peak: float) -> NDArray[np.float64]:
    """Return the structural similarity of two images in the window round each pixel.

    Beyond the edge, images are mirrored.
    """
    unbiased = _WINDOW**2 / (_WINDOW**2 - 1)
    mean_a, mean_b, mean_aa, mean_bb, mean_ab = (
        window_mean(plane, _WINDOW) for plane in (a, b, a * a, b * b, a * b)
    )
    var_a = unbiased * (mean_aa - mean_a**2)
    var_b = unbiased * (mean_bb - mean_b**2)
    covariance = unbiased * (mean_ab - mean_a * mean_b)
    c1, c2 = (_K1 * peak) ** 2, (_K2 * peak) ** 2
    brightness = (2 * mean_a * mean_b + c1) / (mean_a**2 + mean_b**2 + c1)
    structure = (2 * covariance + c2) / (var_a + var_b + c2)
    return np.asarray(brightness * structure)
