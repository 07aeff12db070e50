"""How a JPEG is compressed: read from one, so that another can be written no worse and no larger."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from PIL import Image

_QUALITY = 95
_RGB_NAMES = [82, 71, 66]
#: The (px across, px down) sharing a colour that Pillow can write, beside 4:4:4.
_SUBSAMPLING = {(2, 2): "4:2:0", (2, 1): "4:2:2"}


@dataclass(frozen=True)
class JpegSettings:
    """How a JPEG is compressed.

    Attributes
    ----------
    tables : tuple of tuples of 64 ints
        What each component's coefficients are quantized by, row by row: one table for grey, two for
        brightness and colour alike, or three.
    subsampling : (int, int)
        How many px across, and how many down, share a colour: (1, 1) is 4:4:4, (2, 1) 4:2:2, (2, 2)
        4:2:0.
    progressive : bool
        Whether it is stored coarse to fine.
    rgb : bool
        Whether it holds red, green and blue, not brightness and colour.
    """

    tables: tuple[tuple[int, ...], ...]
    subsampling: tuple[int, int] = (1, 1)
    progressive: bool = False
    rgb: bool = False

    def turned(self) -> JpegSettings:
        """Return the settings of the same photo with rows and columns exchanged."""
        tables = tuple(tuple(np.reshape(table, (8, 8)).T.ravel().tolist()) for table in self.tables)
        across, down = self.subsampling
        return replace(self, tables=tables, subsampling=(down, across))


def settings_of(image: Image.Image) -> JpegSettings | None:
    """Return how a grey or colour JPEG, as Pillow has opened it, is compressed.

    None where its tables are only told among its pixels.
    """
    opened: Any = image
    names, across, down, numbers = zip(*opened.layer, strict=True)
    if not set(numbers) <= set(opened.quantization):
        return None
    tables = [tuple(opened.quantization[number]) for number in numbers]
    if len(tables) == 3 and tables[1] == tables[2]:
        tables.pop()
    stated = image.info.get("adobe_transform", 0 if list(names) == _RGB_NAMES else 1)
    return JpegSettings(
        tuple(tables),
        (across[0] // max(across[1:], default=across[0]), down[0] // max(down[1:], default=down[0])),
        bool(image.info.get("progressive")),
        rgb=len(names) == 3 and stated == 0 and "jfif" not in image.info,
    )


def encoder_options(settings: JpegSettings | None, *, grey: bool) -> dict[str, Any]:
    """Return the options Pillow writes a JPEG with: as `settings` say, else at quality 95 and 4:4:4.

    What not every reader takes becomes the nearest finer: a subsampling that Pillow does not write, and
    quantization beyond 8 bits.
    """
    if settings is None:
        return {"quality": _QUALITY, "subsampling": 0}
    tables = [[min(step, 255) for step in table] for table in settings.tables]
    options = {"progressive": settings.progressive}
    if grey:
        return {"qtables": tables[:1], **options}
    across, down = (min(shared, 2) for shared in settings.subsampling)
    name = _SUBSAMPLING.get((across, down), "4:4:4")
    return {"qtables": tables, "subsampling": name, "keep_rgb": settings.rgb, **options}
