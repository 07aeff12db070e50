"""Sample photos that come with relit; the ``README.md`` beside them says where they are from."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from relit.errors import OptionError, OutputError
from relit.photo.atomic_files import check_free, save_atomically

#: Name → file. The grey target is the target without its colours, to be coloured by the reference.
SAMPLES = {"target": "target.png", "reference": "reference.jpg", "grey_target": "grey_target.png"}


def sample(name: str) -> Path:
    """Return the path of a sample photo.

    Parameters
    ----------
    name : {"target", "reference", "grey_target"}

    Raises
    ------
    OptionError
        For any other name.

    Examples
    --------
    >>> sample("target").name
    'target.png'
    """
    if name not in SAMPLES:
        raise OptionError(f"name: expected one of {', '.join(SAMPLES)}, got {name!r}")
    return _folder() / SAMPLES[name]


def copy_samples(folder: Path, *, overwrite: bool = False) -> list[Path]:
    """Copy the sample photos, and what there is to know about them, into a folder; return the copies.

    Parameters
    ----------
    folder : Path
        Made, if its parent exists.
    overwrite : bool
        Whether files that exist may be replaced.

    Raises
    ------
    OutputError
        If one exists already, or cannot be written. Nothing is written then.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{folder}: this folder cannot be made ({error.strerror}); choose another"
        ) from error
    copies = [folder / name for name in (*SAMPLES.values(), "README.md")]
    for copy in copies:
        check_free(copy, overwrite=overwrite)
    for copy in copies:
        save_atomically(copy, (_folder() / copy.name).read_bytes(), overwrite=overwrite)
    return copies


def _folder() -> Path:
    # The package is installed as plain files: photos are no use to other programs inside an archive.
    return Path(str(resources.files("relit.photo"))) / "sample_photos"
