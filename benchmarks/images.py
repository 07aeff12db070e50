"""The images that solvers are measured on: from the sample photos, so that everybody has them."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def photo(name: str) -> Image.Image:
    """Return a sample photo in grey."""
    with (files("relit.photo") / "sample_photos" / name).open("rb") as file:
        return Image.open(file).convert("L")


def face() -> NDArray[np.uint8]:
    """Return a face of the size of a cropped Yale B image, 192 by 168."""
    return np.asarray(
        photo("target.png").crop((160, 40, 300, 200)).resize((168, 192), Image.Resampling.LANCZOS)
    )


def portrait() -> NDArray[np.uint8]:
    """Return a portrait, 512 by 512."""
    return np.asarray(photo("target.png"))


def large_portrait() -> NDArray[np.uint8]:
    """Return another one, 1024 by 1024."""
    image = photo("reference.jpg")
    return np.asarray(image.crop((0, 0, 910, 910)).resize((1024, 1024), Image.Resampling.LANCZOS))


def mosaic(height: int, width: int) -> NDArray[np.uint8]:
    """Return so much of a plane that is tiled with mirrored portraits: the same content at any size."""
    tile = portrait()
    plane = np.pad(tile, ((0, max(height - 512, 0)), (0, max(width - 512, 0))), mode="symmetric")
    # A crop shows the face.
    top, left = min(60, len(plane) - height), min(120, plane.shape[1] - width)
    return plane[top : top + height, left : left + width]


def hard(size: int) -> dict[str, NDArray[np.generic]]:
    """Return images that a solver might stumble over, ``size`` by ``size``."""
    random = np.random.default_rng(1)
    y, x = np.mgrid[:size, :size]
    return {
        "noise": random.integers(0, 256, (size, size)).astype(np.uint8),
        "flat": np.full((size, size), 7, np.uint8),
        "two values": np.where(random.random((size, size)) < 0.5, 3, 250).astype(np.uint8),
        "checks": ((x + y) % 2).astype(np.uint8),
        "ramp": (x * 256 // size).astype(np.uint8),
        "fine ramp": (x * size + y).astype(np.uint32),
    }


def sixteen_bit(image: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return an image with noise in the bits below its own."""
    noise = np.random.default_rng(0).integers(0, 256, image.shape)
    return (image.astype(np.uint16) * 256 + noise).astype(np.uint16)
