"""Where the tests keep compiled functions: one cache for all their processes, of these very sources.

``python -m tests.compiled`` fills it, so that no two processes compile the same function.
"""

import hashlib
import os
import shutil
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[1]
CACHES = ROOT / ".numba_cache"


def cache_folder():
    """Return the folder of these sources, which numba has to be told of before it is imported.

    Sources that changed get a new one. In an old one, numba writes the index anew before it overwrites the
    code: a process that reads in between would take the old code under a new name. Where the folder was
    empty, it finds none, and compiles.
    """
    digest = hashlib.sha256(version("numba").encode())
    for path in sorted((ROOT / "src").rglob("*.py")):
        source = path.read_bytes()
        if b"relit.runtime.jit import" in source:
            digest.update(source)
    folder = CACHES / digest.hexdigest()[:16]
    for other in CACHES.glob("*"):
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)
    return str(folder)


def main():
    os.environ.setdefault("NUMBA_CACHE_DIR", cache_folder())
    import relit

    target, reference = (relit.read_image(relit.sample(role)).pixels for role in ("target", "reference"))
    relit.transfer(target, reference, method="ltv")
    relit.decompose(target[::8, ::8], interocular_distance=20, neighborhood="isotropic")


if __name__ == "__main__":
    main()
