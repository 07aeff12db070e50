"""Read and write landmark files.

Every format keeps its own habits on disk; in memory, points are always `Landmarks`: ``(x, y)`` from 0, pixel
centres at integers.

==================  =============  =======================================================================
extension           from           on disk
==================  =============  =======================================================================
``.pts``            iBUG, 300-W    x and y, counted **from 1**
``.tem``            WebMorph       x and y; line definitions are passed over, and none are written
``.json .ljson``    menpo          ``[y, x]``; keeps scheme, depth and confidence as well (see `write_json`)
``.csv``            OpenFace       columns ``x_0 ... y_0 ...``, a row a face, with its confidence
``.csv``            any table      columns x, y and perhaps z; this is what is written
``.xml``            dlib           ``<part>`` by number; whole numbers only where the points are whole
==================  =============  =======================================================================

What a format has no place for is left out. All numbers are written in full, so that what was written reads
back as exactly the same float64.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from relit.errors import FaceNotFoundError, LandmarkError, OutputError
from relit.face import landmark_lines as lines
from relit.face import landmark_trees as trees
from relit.face.landmarks import Landmarks, as_landmarks
from relit.photo.atomic_files import check_free, save_atomically

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

# A whole mesh takes 50 kB, a minute of OpenFace's video some megabytes. Points without end, as many as would
# fit into more, would take longer than anyone waits.
_MAX_BYTES = 4 * 2**20


class _Format(NamedTuple):
    read: Callable[[bytes], list[lines.Face]]
    write: Callable[[Landmarks, str], str]


FORMATS = {
    ".pts": _Format(lines.read_pts, lines.write_pts),
    ".tem": _Format(lines.read_tem, lines.write_tem),
    ".json": _Format(trees.read_json, trees.write_json),
    ".ljson": _Format(trees.read_json, trees.write_json),
    ".csv": _Format(lines.read_csv, lines.write_csv),
    ".xml": _Format(trees.read_xml, trees.write_xml),
}


def read_landmarks(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002
    face: int | None = None,
) -> Landmarks:
    r"""Read the landmarks of one face.

    Parameters
    ----------
    path : str or Path
    format : {"pts", "tem", "json", "ljson", "csv", "xml"}, optional
        By default the file's extension, in upper or lower case.
    face : int, optional
        Which face, from 0, in the order of the file: of OpenFace's rows (those with ``success`` 0 hold no
        face and are not counted), of dlib's boxes that have parts, of menpo's groups. Needed where the file
        holds several.

    Returns
    -------
    Landmarks
        The scheme is taken from the number of points; a ``.json`` file may name it.

    Raises
    ------
    FaceNotFoundError
        If the file holds no face, or not that many.
    LandmarkError
        If the file cannot be read, its content is not what its format asks for, it holds several faces and
        `face` is not given, or the points are unusable (see `Landmarks`).

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "face.pts")
    ...     _ = path.write_text("version: 1\nn_points: 3\n{\n31 41\n71 41\n51 81\n}\n")
    ...     read_landmarks(path).points[0]
    array([30., 40.])
    """
    _format_of(Path(path), format, LandmarkError)
    return landmarks_from(_bytes_of(Path(path)), path, format=format, face=face)


def landmarks_from(
    data: bytes,
    name: str | Path,
    *,
    format: str | None = None,  # noqa: A002
    face: int | None = None,
) -> Landmarks:
    r"""Return what `read_landmarks` would read from a file of these bytes and this name.

    Examples
    --------
    >>> landmarks_from(b"x,y\n30,40\n70,40\n50,80\n", "face.csv").points[0]
    array([30., 40.])
    """
    path = Path(name)
    read = _format_of(path, format, LandmarkError).read
    try:
        if len(data) > _MAX_BYTES:
            raise LandmarkError(f"is larger than {_MAX_BYTES >> 20} MB; give a file of one photo's landmarks")
        if not data.strip():
            raise LandmarkError("is empty; write the landmarks again")
        chosen = _choose(read(data), face)
        if not chosen.points:
            raise LandmarkError("holds no points; write the landmarks again")
        return Landmarks(chosen.points, chosen.scheme, chosen.confidence)
    except LandmarkError as error:
        raise type(error)(f"{path}: {str(error).removeprefix('landmarks: ')}") from None


def write_landmarks(
    path: str | Path,
    landmarks: Landmarks | ArrayLike,
    *,
    format: str | None = None,  # noqa: A002
    overwrite: bool = False,
    image_name: str = "",
) -> None:
    r"""Write the landmarks of one face, all at once or not at all.

    Parameters
    ----------
    path : str or Path
    landmarks : Landmarks or (n, 2) or (n, 3) array_like
    format : {"pts", "tem", "json", "ljson", "csv", "xml"}, optional
        By default the file's extension, in upper or lower case.
    overwrite : bool, optional
        Whether a file that exists may be replaced.
    image_name : str, optional
        The photo's file name, which dlib's ``.xml`` wants to know; the others pass it over.

    Raises
    ------
    LandmarkError
        If an array is unusable as `Landmarks`.
    OutputError
        If the extension is none of the above, the file exists, or it cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "face.csv")
    ...     write_landmarks(path, [[30, 40], [70, 40], [50, 80.25]])
    ...     path.read_text()
    'x,y\n30,40\n70,40\n50,80.25\n'
    """
    path = Path(path)
    data = landmarks_as_bytes(path, landmarks, format=format, image_name=image_name)
    save_atomically(path, data, overwrite=overwrite)


def landmarks_as_bytes(
    name: str | Path,
    landmarks: Landmarks | ArrayLike,
    *,
    format: str | None = None,  # noqa: A002
    image_name: str = "",
) -> bytes:
    """Return what `write_landmarks` would write into a file of a name; its errors are the same."""
    write = _format_of(Path(name), format, OutputError).write
    return write(as_landmarks(landmarks, "landmarks"), image_name).encode("utf-8", "replace")


def check_landmark_destination(path: str | Path, *, overwrite: bool = False) -> None:
    """Refuse a path that `write_landmarks` would refuse, before any work goes into the landmarks."""
    _format_of(Path(path), None, OutputError)
    check_free(Path(path), overwrite=overwrite)


def _format_of(path: Path, name: str | None, error: type[LandmarkError | OutputError]) -> _Format:
    extension = path.suffix if name is None else "." + name.removeprefix(".")
    if extension.lower() not in FORMATS:
        raise error(
            f"{path}: unknown landmark format {extension!r}; use one of {', '.join(FORMATS)} "
            "as extension or as format="
        )
    return FORMATS[extension.lower()]


def _bytes_of(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.read(_MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise LandmarkError(f"{path}: cannot be read ({reason}); give the path of a landmark file") from error


def _choose(faces: list[lines.Face], index: int | None) -> lines.Face:
    """Return the face of a number, from 0, or the only one."""
    count = len(faces)
    if count == 0:
        raise FaceNotFoundError(
            "holds no face (a row of OpenFace's with success 0, or a box of dlib's without parts, is none); "
            "give a file with landmarks"
        )
    if index is None and count > 1:
        shown = ", ".join(f"{i}: {face.where}" for i, face in enumerate(faces[:5]))
        more = ", ..." if count > 5 else ""
        raise LandmarkError(
            f"holds {count} faces ({shown}{more}); choose one with face=0 to face={count - 1}"
        )
    if index is not None and not 0 <= index < count:
        raise FaceNotFoundError(f"has no face {index}: it holds {count}, counted from 0; choose one of them")
    return faces[index or 0]
