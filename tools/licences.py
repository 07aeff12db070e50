"""Check the licences of what is installed with relit: `python -m tools.licences PYTHON`.

`python check.py --licences` makes an environment of all that users may install, and runs this on it. What
packages say of themselves is read by pip-licenses. Of the libraries in their wheels they say little: these
are told by their file names.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

#: What may be used in any product, and passed on with it: by SPDX's names, and by those of older packages.
ALLOWED = {
    *("0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "CC0-1.0"),
    *("ISC", "MIT", "MIT-CMU", "MPL-2.0", "PSF-2.0", "Zlib"),
    *("3-Clause BSD License", "Apache 2.0", "Apache Software License", "BSD", "BSD License", "MIT License"),
    *("Mozilla Public License 2.0 (MPL 2.0)", "Python Software Foundation License"),
}
#: Packages that state no licence, and the one that lies in their wheels.
READ = {"OpenEXR": "BSD-3-Clause"}
#: Libraries under the GPL that wheels of photo and number software are known to hold.
GPL_LIBRARIES = re.compile(
    r"(lib)?(x26[45]|xvidcore|postproc|fftw3|gsl|readline|rubberband|vidstab)(?![a-z])"
)
#: The folders of packages that hold one all the same: the README says so, and what to do.
TOLD = ("pillow_heif", "av.libs")
_LIBRARY = re.compile(r"\.(so|dylib|dll|pyd)\b")


def terms_of(package: Mapping[str, str]) -> str:
    """Return what a package says of its licence, in what of its fields says it best.

    Examples
    --------
    >>> terms_of({"Name": "a", "License-Metadata": "A text.", "License-Classifier": "MIT License"})
    'MIT License'
    """
    fields = ("License-Expression", "License-Classifier", "License-Metadata")
    said = (package.get(field, "UNKNOWN") for field in fields)
    return next((one for one in said if one != "UNKNOWN"), READ.get(package["Name"], "UNKNOWN"))


def is_allowed(terms: str) -> bool:
    """Return whether all licences that have to be kept are allowed.

    Examples
    --------
    >>> is_allowed("(GPL-2.0-only OR MIT) AND Zlib"), is_allowed("MIT AND GPL-2.0-only")
    (True, False)
    """
    return all(
        any({one.strip(), one.strip("() ")} & ALLOWED for one in every.split(" OR "))
        for every in re.split(r" AND |; ", terms)
    )


def complaints(packages: Iterable[Mapping[str, str]], files: Iterable[Path]) -> list[str]:
    """Return a line on every package, and on every library in the folders of packages, that may not be."""
    told = {package["Name"]: terms_of(package) for package in packages}
    lines = [
        f"{name}: {terms.partition(chr(10))[0]!r} is not among the licences allowed"
        for name, terms in told.items()
        if not is_allowed(terms)
    ]
    libraries = (file for file in files if not file.parts[0].startswith(TOLD) and _LIBRARY.search(file.name))
    return lines + [f"{file}: is under the GPL" for file in libraries if GPL_LIBRARIES.match(file.name)]


def main(python: str) -> int:
    """Print the complaints on an environment; 1 if there are any."""
    command = [sys.executable, "-m", "piplicenses", "--python", python, "--from=all", "--format=json"]
    packages = json.loads(subprocess.check_output(command))
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    folder = Path(subprocess.check_output([python, "-c", ask], text=True).strip())
    found = complaints(packages, (path.relative_to(folder) for path in folder.rglob("*")))
    print(*found or [f"{len(packages)} packages, all under licences that are allowed"], sep="\n")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
