"""Names that every system can hold: a batch may be copied to a USB stick, a share, Windows or a Mac."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from hashlib import blake2b

#: Bytes of a name that ext4, btrfs and XFS hold; NTFS, exFAT and APFS hold as many units, which are no fewer.
_LONGEST = 255
#: What NTFS and FAT refuse in names, and halves of surrogates, which APFS does: bytes that are no Unicode.
_REFUSED = re.compile(r'[\0-\x1f<>:"|?*\\/\ud800-\udfff]')
#: Of "Naming Files, Paths, and Namespaces" at learn.microsoft.com: devices, with any suffix.
_DEVICE = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[1-9¹²³]) *(\.|$)", re.IGNORECASE)


@lru_cache(maxsize=4096)  # folders come again and again
def portable(name: str) -> str:
    """Return the name of a file or folder; where a system could not hold it, another one, always the same.

    What cannot stay becomes ``_``, and a digest of the name as it was follows, so that names stay apart.

    Examples
    --------
    >>> portable("anna.png"), portable("anna 3:4?.png"), portable("CON.png")
    ('anna.png', 'anna 3_4_~2bc3d4e3.png', '_CON~9f3ebb00.png')
    """
    is_device = _DEVICE.match(name) is not None
    ends_well = not name.endswith((".", " "))
    if not _REFUSED.search(name) and ends_well and not is_device and len(name.encode()) <= _LONGEST:
        return name
    safe = _REFUSED.sub("_", name).rstrip(". ") or "_"
    return marked(f"_{safe}" if is_device else safe, name)


def marked(name: str, what: str) -> str:
    """Return a name with a digest of what it stands for before its suffix, cut to what systems can hold."""
    stem, dot, suffix = name.rpartition(".")
    if not stem or len(suffix) > 16:  # no suffix of a photo
        stem, dot, suffix = name, "", ""
    mark = blake2b(what.encode("utf-8", "surrogatepass"), digest_size=4).hexdigest()
    end = f"~{mark}{dot}{suffix}"
    kept = stem.encode("utf-8", "surrogatepass")[: _LONGEST - len(end.encode("utf-8", "surrogatepass"))]
    return kept.decode("utf-8", "ignore") + end


def folded(text: str) -> str:
    """Return a text that is the same for all names that some file system takes for one.

    Examples
    --------
    >>> folded("É.PNG") == folded("e\u0301.png")
    True
    """
    if text.isascii():
        return text.lower()  # as below, in a tenth of the time
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", text).casefold())
