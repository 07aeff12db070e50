"""relit: carry the light of one face photo to another.

The target keeps the person, the reference gives the light:

>>> import relit
>>> result = relit.transfer(relit.sample("target"), relit.sample("reference"))
>>> result  # doctest: +ELLIPSIS
TransferResult(512x512 uint8, 1 reference, method='shading', ...)

Images are arrays, ``(H, W)`` grey or ``(H, W, 3)`` RGB, of uint8, uint16, or floats in [0, 1]; paths, PIL
images and torch tensors are taken, too. Landmarks are ``(x, y)`` in px, pixel centres at integers.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from relit._version import VERSION

if TYPE_CHECKING:
    from relit.display.showing import show
    from relit.errors import (
        FaceNotFoundError,
        ImageError,
        LandmarkError,
        OptionError,
        OutputError,
        RelitError,
    )
    from relit.face.detect import detect_faces, detect_landmarks
    from relit.face.landmark_files import read_landmarks, write_landmarks
    from relit.face.landmarks import Landmarks
    from relit.ltv.decomposition import Decomposition, decompose, normalize
    from relit.photo.photo import Photo
    from relit.photo.reading import read_image
    from relit.photo.samples import sample
    from relit.photo.writing import not_kept, write_image
    from relit.relighting import transfer
    from relit.results import Lighting, TransferResult
    from relit.settings.options import TransferOptions
    from relit.settings.transfer_changes import TransferChanges
    from relit.solver.certificate import Certificate, certify
    from relit.solver.exact import tv_l1
    from relit.solver.isotropic import IsotropicSolution, tv_l1_isotropic
    from relit.train.augment import RelightAugment
    from relit.train.light_normalizer import LightNormalizer
    from relit.warp.alignment import Alignment, align

__version__ = VERSION

# Public name → module. Imported when first used: the solvers bring a compiler along, the detector a runtime.
# No module has the name of something public, which its import would hide.
_HOME = {
    "Alignment": "warp.alignment",
    "Certificate": "solver.certificate",
    "Decomposition": "ltv.decomposition",
    "FaceNotFoundError": "errors",
    "ImageError": "errors",
    "IsotropicSolution": "solver.isotropic",
    "LandmarkError": "errors",
    "Landmarks": "face.landmarks",
    "LightNormalizer": "train.light_normalizer",
    "Lighting": "results",
    "OptionError": "errors",
    "OutputError": "errors",
    "Photo": "photo.photo",
    "RelightAugment": "train.augment",
    "RelitError": "errors",
    "TransferChanges": "settings.transfer_changes",
    "TransferOptions": "settings.options",
    "TransferResult": "results",
    "align": "warp.alignment",
    "certify": "solver.certificate",
    "decompose": "ltv.decomposition",
    "detect_faces": "face.detect",
    "detect_landmarks": "face.detect",
    "normalize": "ltv.decomposition",
    "not_kept": "photo.writing",
    "read_image": "photo.reading",
    "read_landmarks": "face.landmark_files",
    "sample": "photo.samples",
    "show": "display.showing",
    "transfer": "relighting",
    "tv_l1": "solver.exact",
    "tv_l1_isotropic": "solver.isotropic",
    "write_image": "photo.writing",
    "write_landmarks": "face.landmark_files",
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
    "LightNormalizer",
    "Lighting",
    "OptionError",
    "OutputError",
    "Photo",
    "RelightAugment",
    "RelitError",
    "TransferChanges",
    "TransferOptions",
    "TransferResult",
    "align",
    "certify",
    "decompose",
    "detect_faces",
    "detect_landmarks",
    "normalize",
    "not_kept",
    "read_image",
    "read_landmarks",
    "sample",
    "show",
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
