"""Places of photos: local paths."""

from __future__ import annotations

from glob import glob
from pathlib import Path

from relit.errors import ImageError, OutputError
from relit.files import save_atomically

_PHOTOS = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".ppm", ".pgm", ".bmp", ".heic", ".exr"}


def read_bytes(place: str) -> bytes:
    """Return what a place holds."""
    try:
        return Path(place).read_bytes()
    except FileNotFoundError:
        raise ImageError(f"{place}: there is no such file; check the name") from None
    except IsADirectoryError:
        raise ImageError(f"{place}: is a folder; give the name of one photo in it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ImageError(f"{place}: cannot be read ({reason}); give the file name of a photo") from error


def write_atomically(place: str, data: bytes, *, overwrite: bool) -> None:
    """Put bytes in a place, all or none."""
    try:
        Path(place).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{place}: cannot be written ({error.strerror}); choose another place") from error
    save_atomically(Path(place), data, overwrite=overwrite)


def exists(place: str) -> bool:
    """Return whether there is something."""
    return Path(place).exists()


def expand(pattern: str) -> list[str]:
    """Return the places that a pattern stands for."""
    if Path(pattern).is_dir():
        return sorted(
            str(path)
            for path in Path(pattern).rglob("*")
            if path.suffix.lower() in _PHOTOS and path.is_file()
        )
    found = glob(pattern, recursive=True)  # noqa: PTH207
    return sorted(path for path in found if Path(path).is_file())


def join(root: str, relative: str) -> str:
    """Return a place below another."""
    return f"{root.rstrip('/')}/{relative}" if root.rstrip("/") else f"{root[:1]}{relative}"
