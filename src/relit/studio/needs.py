"""How much memory a computation will take, told before it is taken: from sizes alone.

Each factor was measured, as the most that a process held beyond what it held before, over photos of 6 to 100
million px, and is rounded up.
"""

from __future__ import annotations

from math import ceil, prod

from relit.face.landmarks import Landmarks
from relit.inputs import face_window, reduction
from relit.photo.photo import Photo
from relit.settings.options import TransferOptions

#: Of every computation: what a thread has at hand, and networks.
_LEAST = 60_000_000
#: Bytes for a px in which a face is looked for, beside the photo.
_DETECTING = 7
#: Bytes for a byte of landmarks as text, once they are numbers of Python.
_PARSING = 30
#: Bytes for a px of what a method looks at, at the size at which it does, and of a reference at that size.
_VIEW, _REFERENCE = 360, 60
#: Bytes for a px of a preview: the photo at that size, and what a view is made of.
_SHOWN = 40
#: Bytes for a byte of a photo whose result becomes a file: of one picture, and of layers.
_FILE, _LAYERS = 3, {".psd": 13, ".ora": 13, ".exr": 26}


def of_reading(width: int, height: int, depth: int, length: int) -> int:
    """Return the bytes that it takes to read a photo and to find its face.

    Parameters
    ----------
    width, height, depth
        As of `claimed_size`.
    length : int
        Of the file, which decoders hold twice.
    """
    pixels = width * height
    samples = max(pixels * depth, length)
    return _LEAST + 2 * length + samples + max(samples, _DETECTING * pixels)


def of_parsing(length: int) -> int:
    """Return the bytes that it takes to read a file of landmarks."""
    return _LEAST + _PARSING * length


def of_detecting(photo: Photo) -> int:
    """Return the bytes that it takes to find the face in a photo."""
    height, width = photo.pixels.shape[:2]
    return _LEAST + _DETECTING * int(width * height)


def of_showing(width: int, height: int) -> int:
    """Return the bytes that it takes to show a photo at a size, or to tell the parts of its face."""
    return _LEAST + _REFERENCE * width * height


def of_transfer(
    target: tuple[Photo, Landmarks],
    reference: tuple[Photo, Landmarks] | None,
    options: TransferOptions,
    *,
    smaller: tuple[int, int] = (1, 1),
    detail: float | None = None,
    suffix: str | None = None,
) -> int:
    """Return the bytes that a transfer takes.

    Parameters
    ----------
    target, reference
        The photos and their landmarks.
    options : TransferOptions
        How to relight.
    smaller : (int, int)
        By how much the two are reduced first.
    detail : float, optional
        As of `relit.transfer`.
    suffix : str, optional
        Of the file that the result becomes.
    """
    pixels, marks = target[0].pixels, target[1].reduced(smaller[0])
    shape = tuple(ceil(side / smaller[0]) for side in pixels.shape[:2])
    factor = reduction(marks, options, detail)
    window = face_window(shape, marks, options, factor)
    seen = prod(len(range(*part.indices(side))) for part, side in zip(window, shape, strict=True))
    needed = _LEAST + _VIEW * seen // factor**2
    if reference is not None:
        other, marks = reference[0].pixels, reference[1].reduced(smaller[1])
        size = other.shape[0] * other.shape[1] // smaller[1] ** 2
        each = _VIEW if options.splits_alone else _REFERENCE
        needed += each * size // reduction(marks, options, detail) ** 2
    if suffix is None:
        needed += _SHOWN * prod(shape)
    else:
        needed += _LAYERS.get(suffix, _FILE) * pixels.nbytes
    return needed
