"""relit: carry the light of one face photo to another.

The target keeps the person, the reference gives the light:

>>> import relit
>>> target = relit.read_image(relit.sample("target"))
>>> reference = relit.read_image(relit.sample("reference"))
>>> result = relit.transfer(target.pixels, reference.to_profile(target.profile).pixels)
>>> result.image.shape == target.pixels.shape
True

Images are arrays, ``(H, W)`` grey or ``(H, W, 3)`` RGB, of uint8, uint16, or floats in [0, 1]. Landmarks are
``(x, y)`` in px, pixel centres at integers.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from relit._version import VERSION

if TYPE_CHECKING:
    from relit.alignment import Alignment, align
    from relit.augment import RelightAugment
    from relit.certificate import Certificate, certify
    from relit.detect import detect_faces, detect_landmarks
    from relit.errors import (
        FaceNotFoundError,
        ImageError,
        LandmarkError,
        OptionError,
        OutputError,
        RelitError,
    )
    from relit.image import Photo, read_image, write_image
    from relit.landmark_files import read_landmarks, write_landmarks
    from relit.landmarks import Landmarks
    from relit.level_sets import tv_l1
    from relit.ltv import Decomposition, decompose, normalize
    from relit.options import TransferOptions
    from relit.primal_dual import IsotropicSolution, tv_l1_isotropic
    from relit.relighting import transfer
    from relit.results import Lighting, TransferResult
    from relit.samples import sample

__version__ = VERSION

# Public name → module. Imported when first used: the solvers bring a compiler along, the detector a runtime.
# No module has the name of something public, which its import would hide.
_HOME = {
    "Alignment": "alignment",
    "Certificate": "certificate",
    "Decomposition": "ltv",
    "FaceNotFoundError": "errors",
    "ImageError": "errors",
    "IsotropicSolution": "primal_dual",
    "LandmarkError": "errors",
    "Landmarks": "landmarks",
    "Lighting": "results",
    "OptionError": "errors",
    "OutputError": "errors",
    "Photo": "image",
    "RelightAugment": "augment",
    "RelitError": "errors",
    "TransferOptions": "options",
    "TransferResult": "results",
    "align": "alignment",
    "certify": "certificate",
    "decompose": "ltv",
    "detect_faces": "detect",
    "detect_landmarks": "detect",
    "normalize": "ltv",
    "read_image": "image",
    "read_landmarks": "landmark_files",
    "sample": "samples",
    "transfer": "relighting",
    "tv_l1": "level_sets",
    "tv_l1_isotropic": "primal_dual",
    "write_image": "image",
    "write_landmarks": "landmark_files",
}

__all__ = [
    "Alignment",
    "Certificate",
    "Decomposition",
    "FaceNotFoundError",
    "ImageError",
    "IsotropicSolution",
    "LandmarkError",
    "Landmarks",
    "Lighting",
    "OptionError",
    "OutputError",
    "Photo",
    "RelightAugment",
    "RelitError",
    "TransferOptions",
    "TransferResult",
    "align",
    "certify",
    "decompose",
    "detect_faces",
    "detect_landmarks",
    "normalize",
    "read_image",
    "read_landmarks",
    "sample",
    "transfer",
    "tv_l1",
    "tv_l1_isotropic",
    "write_image",
    "write_landmarks",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'relit' has no attribute {name!r}")
    return getattr(import_module(f"relit.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
