"""The versions of the libraries that results depend on, down to their last bits."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

_LIBRARIES = ("numpy", "scipy", "numba", "pillow", "imagecodecs", "tifffile", "ai-edge-litert", "joblib")


def versions() -> dict[str, str]:
    """Return the version of each.

    Examples
    --------
    >>> import numpy
    >>> versions()["numpy"] == numpy.__version__
    True
    """
    found = {}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # installed in another way than by pip
            found[name] = "unknown"
    return found
