"""Ground truth for relighting: the Extended Yale B faces in the layout of the public CroppedYale folder [1]_.

Each subject ``yaleBNN`` was photographed under 64 lights of known azimuth and elevation. Heads drift by a few
px between exposures: where the folder has ``registration_offsets.csv`` images are aligned by it, and where it
has ``landmarks_frontal.json`` the landmarks come from there; otherwise they are detected on the frontal one.

References
----------
.. [1] A. S. Georghiades, P. N. Belhumeur, D. J. Kriegman, "From few to many: illumination cone models for
       face recognition under variable lighting and pose", IEEE PAMI 23(6), 2001.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relit.errors import ImageError, LandmarkError, OptionError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.photo.reading import read_image


class Light(NamedTuple):
    """Where a flash stands, in degrees: to the left half of the image where the azimuth is positive."""

    azimuth: int
    elevation: int

    @property
    def angle(self) -> float:
        """Angle to the camera axis, in degrees."""
        cosine = np.cos(np.deg2rad(self.azimuth)) * np.cos(np.deg2rad(self.elevation))
        return float(np.rad2deg(np.arccos(np.clip(cosine, -1, 1))))

    @property
    def subset(self) -> int:
        """The usual subset by angle: 1 up to 12°, 2 up to 25°, 3 up to 52°, 4 up to 77°, 5 beyond.

        The third is said to end at 50°, but the lists in common use have 35° by 40° in it, which is 51°.

        Examples
        --------
        >>> Light(0, 0).subset, Light(-35, 40).subset, Light(120, 0).subset
        (1, 3, 5)
        """
        return 1 + sum(self.angle > limit + 1e-6 for limit in (12, 25, 52, 77))


FRONTAL = Light(0, 0)

_WORDS = {str: "text", int: "a whole number", float: "a number"}
_NAME = re.compile(r"A([+-]\d+)E([+-]\d+)\.pgm$")


@dataclass(frozen=True)
class YaleB:
    """A folder of Yale B faces.

    Parameters
    ----------
    folder : Path
        Holds ``yaleBNN/yaleBNN_P00A±azE±el.pgm``.

    Raises
    ------
    ImageError
        If there is no such folder.
    """

    folder: Path

    def __post_init__(self) -> None:
        """Check that the folder looks right."""
        if not any(self.folder.glob("yaleB*/yaleB*_P00A*.pgm")):
            raise ImageError(
                f"{self.folder}: expected a folder with yaleB01/yaleB01_P00A+000E+00.pgm and so on; download "
                "CroppedYale and give the folder that holds its subjects"
            )

    @cached_property
    def subjects(self) -> list[str]:
        """Names of the subjects, in order."""
        return sorted(path.name for path in self.folder.glob("yaleB*") if path.is_dir())

    def lights(self, subject: str) -> list[Light]:
        """Return the lights that a subject was photographed under."""
        names = [_NAME.search(path.name) for path in (self.folder / subject).glob(f"{subject}_P00A*.pgm")]
        return sorted(Light(*map(int, name.groups())) for name in names if name)

    def photo(self, subject: str, light: Light) -> NDArray[Any]:
        """Return one image, (192, 168), as it was taken."""
        azimuth, elevation = light
        return pixels_of(self.folder / subject / f"{subject}_P00A{azimuth:+04d}E{elevation:+03d}.pgm")

    def offset(self, subject: str, light: Light) -> tuple[float, float]:
        """Return (dy, dx) in px of an image's content against that of the subject's frontal image."""
        return self._offsets.get((subject, light), (0.0, 0.0))

    def aligned(self, image: NDArray[Any], subject: str, light: Light) -> NDArray[np.float64]:
        """Return what was taken, or made, under a light, laid over the subject's frontal image."""
        return _moved(image, *self.offset(subject, light))

    def landmarks(self, subject: str, light: Light) -> Landmarks:
        """Return the landmarks of the frontal image, moved to that under a light."""
        dy, dx = self.offset(subject, light)
        if subject not in self._frontal:
            self._frontal[subject] = detect_landmarks(self.photo(subject, FRONTAL), name=subject)
        return self._frontal[subject].shifted(dx, dy)

    @cached_property
    def _offsets(self) -> dict[tuple[str, Light], tuple[float, float]]:
        path = self.folder / "registration_offsets.csv"
        if not path.exists():
            return {}
        columns = {"subject": str, "azimuth": int, "elevation": int, "dy": float, "dx": float}
        return {
            (row["subject"], Light(row["azimuth"], row["elevation"])): (row["dy"], row["dx"])
            for row in read_table(path, columns)
        }

    @cached_property
    def _frontal(self) -> dict[str, Landmarks]:
        path = self.folder / "landmarks_frontal.json"
        if not path.exists():
            return {}
        try:
            faces = json.loads(path.read_text("utf-8"))
            return {subject: Landmarks(np.array(points["mesh478"])) for subject, points in faces.items()}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise LandmarkError(
                f"{path}: expected mesh478, a list of [x, y, z], of every subject ({error}); mend "
                "the file, or remove it to have faces detected"
            ) from error


@lru_cache(maxsize=64)
def pixels_of(path: Path) -> NDArray[Any]:
    """Return the pixels of a photo, kept for the next cases that take it."""
    return read_image(path).pixels


def read_table(path: Path, columns: Mapping[str, type]) -> list[dict[str, Any]]:
    """Return the rows of a CSV file, by column; lines that begin with # are comments.

    Parameters
    ----------
    path : Path
    columns : mapping of str to {str, int, float}
        The columns that there must be, and what is in them. Others are kept as text.

    Raises
    ------
    OptionError
        If it cannot be read, lacks one of the columns or any row, or a value is of the wrong kind.
    """
    try:
        lines = [line for line in path.read_text("utf-8").splitlines() if not line.startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise OptionError(f"{path}: cannot be read as a table ({reason}); give a CSV file") from error
    table = csv.DictReader(lines)
    for column in columns:
        if column not in (table.fieldnames or ()):
            raise OptionError(f"{path}: expected the columns {', '.join(columns)}; {column} is missing")
    rows: list[dict[str, Any]] = list(table)
    if not rows:
        raise OptionError(f"{path}: has no rows; give one for each transfer or image")
    for number, row in enumerate(rows, 1):
        for column, kind in columns.items():
            try:
                if not row[column]:
                    raise ValueError
                row[column] = kind(row[column])
            except ValueError:
                raise OptionError(
                    f"{path}: {column} of row {number}: expected {_WORDS[kind]}, got {row[column]!r}"
                ) from None
    return rows


def _moved(image: NDArray[Any], dy: float, dx: float) -> NDArray[np.float64]:
    """Return what an image shows so many px further down and right, linearly; its ends are repeated."""
    moved = image.astype(np.float64)
    for axis, step in enumerate((dy, dx)):
        first, share = divmod(step, 1)
        places = np.arange(image.shape[axis]) + int(first)
        one, other = (moved.take(places + further, axis, mode="clip") for further in (0, 1))
        moved = (1 - share) * one + share * other
    return moved
