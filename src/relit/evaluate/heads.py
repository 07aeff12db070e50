"""Ground truth in colour: rendered heads, each under many lights, some of them coloured.

A folder holds ``people.csv`` and ``protocol.csv``, and of each person ``NNN/LIGHT.png``; of a coloured light
also ``LIGHT_neutral.png``, every lamp of it white and as bright; ``mask_face.png`` and
``mask_background.png``; and ``landmarks.json``, whose ``mesh478`` are the points of the face in every light.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relit.errors import ImageError, LandmarkError
from relit.evaluate.yale_b import pixels_of
from relit.face.landmarks import Landmarks

_WHITE = "_neutral"


def is_of_heads(folder: Path) -> bool:
    """Return whether a folder is one of rendered heads."""
    tables = ("people.csv", "protocol.csv")
    return all((folder / name).is_file() for name in tables) and any(folder.glob("*/front.png"))


@dataclass(frozen=True)
class Heads:
    """A folder of rendered heads."""

    folder: Path

    def photo(self, person: str, light: str) -> NDArray[Any]:
        """Return a person under a light, (H, W, 3)."""
        return pixels_of(self.folder / person / f"{light}.png")

    def white(self, person: str, light: str) -> str | None:
        """Return the name of a coloured light whose lamps were made white; None of one that is white."""
        name = f"{light}{_WHITE}"
        return name if (self.folder / person / f"{name}.png").is_file() else None

    def mask(self, person: str, area: str) -> NDArray[np.bool_]:
        """Return where a person's ``face`` or the ``background`` is, (H, W).

        Raises
        ------
        ImageError
            If the mask cannot be read, or is not grey.
        """
        path = self.folder / person / f"mask_{area}.png"
        mask = pixels_of(path)
        if mask.ndim != 2:
            raise ImageError(f"{path}: expected a grey photo, white where the {area} is, got {mask.shape}")
        return np.asarray(mask > np.iinfo(mask.dtype).max // 2)

    def landmarks(self, person: str, _light: str) -> Landmarks:
        """Return the landmarks of a person, which are those under every light."""
        return _mesh_of(self.folder / person / "landmarks.json")

    def aligned(self, image: NDArray[np.float64], _person: str, _light: str) -> NDArray[np.float64]:
        """Return an image as it is: a rendered head keeps still."""
        return image


@lru_cache(maxsize=64)
def _mesh_of(path: Path) -> Landmarks:
    try:
        return Landmarks(np.array(json.loads(path.read_text("utf-8"))["mesh478"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise LandmarkError(
            f"{path}: expected mesh478, a list of [x, y, z] ({error}); mend the file"
        ) from error
