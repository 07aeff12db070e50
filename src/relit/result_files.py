"""Results of transfers into files: as photos, or by the names of some files in layers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit.errors import ImageError, OutputError
from relit.photo.atomic_files import check_free
from relit.photo.codecs.extras import encode_exr_layers, openexr
from relit.photo.codecs.formats import FORMATS
from relit.photo.codecs.keeping import OF_PHOTOSHOP, fitted
from relit.photo.codecs.openraster import encode_openraster
from relit.photo.codecs.psd import encode_psd
from relit.photo.streams import destination_of, name_of, save
from relit.photo.writing import check_destination, not_kept, write_image

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from relit.photo.photo import Photo
    from relit.photo.streams import FileOrName
    from relit.results import TransferResult


@dataclass(frozen=True)
class _Layered:
    """A file format of layers."""

    encode: Callable[[Sequence[TransferResult], Photo], bytes]
    longest: int | None = None  # px of a side, where the format sets a limit
    library: Callable[[], Any] | None = None  # loads an optional library, or raises where that is missing
    holds: tuple[str, ...] = ()  # the fields of `Metadata` it has a place for


# What makes the layers brings much along, and is imported when there is something to write.


def _openraster(results: Sequence[TransferResult], like: Photo) -> bytes:
    from relit.layering import layers_of

    return encode_openraster(layers_of(results, like))


def _psd(results: Sequence[TransferResult], like: Photo) -> bytes:
    from relit.layering import layers_of

    return encode_psd(layers_of(results, like))


def _exr(results: Sequence[TransferResult], like: Photo) -> bytes:
    from relit.passes import passes_of

    return encode_exr_layers(*passes_of(results, like))


#: What names of files with layers end with; an OpenEXR with another name is a photo alone.
LAYERED = {
    ".ora": _Layered(_openraster, holds=FORMATS["PNG"].holds),
    ".psd": _Layered(_psd, longest=30_000, holds=OF_PHOTOSHOP),
    ".layers.exr": _Layered(_exr, library=openexr),
}


def write_results(
    destination: FileOrName, results: Sequence[TransferResult], *, like: Photo, overwrite: bool = False
) -> None:
    """Write a relit photo, in layers if the name asks for them; a file appears whole, or not at all.

    Parameters
    ----------
    destination : str, Path or binary file
        ``.ora`` is OpenRaster and ``.psd`` Photoshop's, with layers as of `layers_of`; ``.layers.exr`` is
        OpenEXR with channels as of `passes_of`. All else is as of `write_image`.
    results : sequence of TransferResult
        Of one photo, face after face, each in what came of those before.
    like : Photo
        The target.
    overwrite : bool, optional
        Whether a file that exists may be replaced.
    """
    layered = _layered(destination)
    if layered is None:
        write_image(destination, results[-1].image, like=like, overwrite=overwrite)
    else:
        metadata, _ = fitted(like.metadata, layered.holds)
        save(layered.encode(results, replace(like, metadata=metadata)), destination, overwrite=overwrite)


def check_results_destination(destination: FileOrName, *, like: Photo, overwrite: bool = False) -> None:
    """Refuse a destination that `write_results` would refuse, before any work goes into a photo."""
    layered = _layered(destination)
    if layered is None:
        check_destination(destination, like=like, overwrite=overwrite, beside=LAYERED)
        return
    name = name_of(destination)
    if layered.library:
        try:
            layered.library()
        except ImageError as error:
            raise OutputError(f"{name}: {error}") from error
    height, width = like.pixels.shape[:2]
    if layered.longest and max(height, width) > layered.longest:
        raise ImageError(
            f"{name}: {width}x{height} px is too large for PSD, which ends at {layered.longest}; write .ora"
        )
    path = destination_of(destination)
    if isinstance(path, Path):
        check_free(path, overwrite=overwrite)


def not_kept_of(destination: FileOrName, like: Photo) -> tuple[str, ...]:
    """Return, in words, what a photo holds beside its pixels that `write_results` cannot keep."""
    layered = _layered(destination)
    return not_kept(destination, like) if layered is None else fitted(like.metadata, layered.holds)[1]


def _layered(destination: FileOrName) -> _Layered | None:
    """Return the format of layers that the name of a file asks for, if it does."""
    name = name_of(destination).lower()
    return next((known for ending, known in LAYERED.items() if name.endswith(ending)), None)
