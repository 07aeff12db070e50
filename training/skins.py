"""Skins of all complexions, made of melanin and blood.

Skin is what melanin and haemoglobin leave of white light [1]_: ``log albedo = log a0 - m M - h H``, with m
and h maps over the head. M leads from a fair skin's colour to a dark one's, H from a pale to a flushed one.

References
----------
.. [1] N. Tsumura et al., "Image-based skin color and texture analysis/synthesis by extracting hemoglobin and
   melanin information in the skin", SIGGRAPH 2003.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

_FAIR = np.log([0.66, 0.46, 0.37])  # linear albedo without melanin and blood
_MELANIN, _HAEMOGLOBIN = np.array([1.75, 2.15, 2.5]), np.array([0.04, 0.34, 0.30])
_IRIS_RADIUS = 0.085  # interocular distances
_IRIS, _WHITE = (0.05, 0.035, 0.03), (0.6, 0.57, 0.55)


class Skin(NamedTuple):
    """Of what the colours of somebody are made.

    Attributes
    ----------
    seed : int
        Of all that is random on it.
    melanin, blood : float
        m and h, as most of the skin has them; 0 to 1.
    stubble : float
        By how much a beard darkens it, in log.
    brows, freckles : float
        How dense they are.
    hair : (3,) array
        Linear albedo.
    """

    seed: int
    melanin: float
    blood: float
    stubble: float
    brows: float
    freckles: float
    hair: Floats

    def albedo(self, place: Floats, lip: Floats, eye: Floats, hair: Floats) -> Floats:
        """Return the linear albedo, (k, 3).

        Parameters
        ----------
        place : (k, 3) array
            On the mean head.
        lip, eye, hair : (k,) array
            How much of these there is.

        Returns
        -------
        (k, 3) array
        """
        random = np.random.default_rng(self.seed)
        color = np.exp(
            _FAIR
            - self._melanin(place, random).clip(0, 1.3)[:, None] * _MELANIN
            - self._blood(place, lip, random).clip(0, 5)[:, None] * _HAEMOGLOBIN
            - (self.stubble * _bearded(place) * (1 - lip))[:, None]
        )
        streaks = (1 + 0.5 * waves(place * [3, 0.6, 0.6], 0.06, random)).clip(0.3, 2)[:, None]
        color += (self.brows * _browed(place))[:, None] * (self.hair - color)
        color += hair[:, None] * (self.hair * streaks - color)
        iris = np.hypot(abs(place[:, 0]) - 0.5, place[:, 1]) < _IRIS_RADIUS
        white = np.where(iris[:, None], _IRIS, _WHITE)
        return np.asarray(color + eye[:, None] * (white - color))

    def _melanin(self, place: Floats, random: np.random.Generator) -> Floats:
        """Return m: mottled, with freckles, and darker round the eyes."""
        m = self.melanin + sum(
            much * waves(place, size, random)
            for much, size in ((0.05, 1.5), (0.04, 0.5), (0.025, 0.12), (0.03, 0.04))
        )
        freckles = np.clip(waves(place, 0.06, random) - 1.2, 0, 1)
        return np.asarray(
            m + self.freckles * freckles + random.uniform(0, 0.15) * _spot(place, (0.5, 0.05), (0.28, 0.2))
        )

    def _blood(self, place: Floats, lip: Floats, random: np.random.Generator) -> Floats:
        """Return h: mottled, more in cheeks and nose, and most in lips."""
        more = 0.4 * waves(place, 1.5, random) + 0.3 * waves(place, 0.5, random)
        more += random.uniform(0, 0.8) * _spot(place, (0.62, 0.75), (0.3, 0.3))
        more += random.uniform(0, 0.6) * _spot(place, (0, 0.75), (0.2, 0.2))
        fine = 0.1 * waves(place, 0.12, random)
        return np.asarray(self.blood * (1 + more) + fine + random.uniform(0.8, 3) * lip)


def _spot(place: Floats, middle: tuple[float, float], size: tuple[float, float]) -> Floats:
    """Return how near places are to one on either half of a face, 0 to 1."""
    away = (np.column_stack([abs(place[:, 0]), place[:, 1]]) - middle) / size
    return np.asarray(np.exp(-(away**2).sum(axis=1)))


def _bearded(place: Floats) -> Floats:
    """Return where a beard grows, 0 to 1: chin, jaw and the upper lip."""
    side, y = abs(place[:, 0]), place[:, 1]
    edge = 0.85 + 0.35 * np.exp(-((side / 0.35) ** 2))
    return np.asarray(np.clip((y - edge) / 0.2 + 0.5 * side, 0, 1) * np.clip((1.9 - y) / 0.3, 0, 1))


def _browed(place: Floats) -> Floats:
    """Return where brows are, 0 to 1."""
    side, y = abs(place[:, 0]), place[:, 1]
    arch = -0.33 - 0.06 * np.cos(4 * (side - 0.55))
    return np.asarray(np.exp(-(((y - arch) / 0.055) ** 4) - ((side - 0.52) / 0.3) ** 6) * (place[:, 2] < 0.5))


def waves(place: Floats, size: float, random: np.random.Generator, count: int = 32) -> Floats:
    """Return smooth noise of about so long a wave, with mean 0 and standard deviation 1, at places (k, 3)."""
    ways = random.normal(0, 1, (count, 3)) * (2 * np.pi / (1.7 * size))
    phases = random.uniform(0, 2 * np.pi, count)
    made = np.zeros(len(place))
    for way, phase in zip(ways, phases, strict=True):
        made += np.cos(place @ way + phase)
    return np.asarray(made * np.sqrt(2 / count))
