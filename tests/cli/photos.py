"""Pixels and profiles that the tests of the command line put into photos."""

import functools

import imagecodecs
import numpy as np


@functools.cache  # it holds the time at which it was made
def rgb_profile():
    """An RGB profile that is not sRGB's."""
    return bytes(imagecodecs.cms_profile("adobergb"))


@functools.cache
def grey_profile():
    return bytes(imagecodecs.cms_profile("gray", gamma=1.0))


def as_16_bits(pixels):
    """Return 16-bit pixels that no 8-bit pixels stand for."""
    noise = np.random.default_rng(0).integers(-120, 120, pixels.shape)
    return (pixels.astype(int) * 257 + noise).clip(0, 65535).astype(np.uint16)


ROLES = ("target", "reference")
