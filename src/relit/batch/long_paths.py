r"""Paths of more than 260 characters, which Windows takes only if they begin with ``\\?\``."""

from __future__ import annotations

from pathlib import PureWindowsPath

#: Of a folder, for which Windows leaves room for a name of 12 letters; a file may be 12 longer.
_LONGEST = 247


def extended(path: str) -> str:
    r"""Return a path of Windows as it must be given; it counts from a root, and has no ``..`` in it.

    Examples
    --------
    >>> extended(r"C:\faces\a.png")
    'C:\\faces\\a.png'
    >>> extended("C:/" + "deep/" * 60 + "a.png")[:12]
    '\\\\?\\C:\\deep\\'
    >>> extended(r"\\server\share" + r"\deep" * 60)[:20]
    '\\\\?\\UNC\\server\\share'
    """
    whole = PureWindowsPath(path)
    if len(str(whole)) <= _LONGEST or str(whole).startswith("\\\\?\\"):
        return str(whole)
    if whole.drive.startswith("\\\\"):
        return f"\\\\?\\UNC\\{str(whole)[2:]}"
    return f"\\\\?\\{whole}"
