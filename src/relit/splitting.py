"""Light and person of a photo as pictures, for `relit decompose` and `normalize`, alone or in a batch."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.figures import split_pictures
from relit.ltv.decomposition import FACE_SCALE, decompose, normalize
from relit.ltv.g_value import lam_for
from relit.photo.pixels import from_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo
    from relit.settings.options import TransferOptions


@dataclass(frozen=True)
class Splitting:
    """How a photo is split.

    Attributes
    ----------
    interocular_distance : float
        In px.
    lam : float
        λ for eyes 100 px apart.
    neighborhood : {4, 8, 16, "isotropic"}
    """

    interocular_distance: float
    lam: float
    neighborhood: int | str

    @classmethod
    def of(cls, face: Landmarks, options: TransferOptions) -> Splitting:
        """Return how the options have a face split."""
        return cls(face.interocular_distance, lam_for(face, options), options.neighborhood)

    @property
    def lam_px(self) -> float:
        """Return λ in px⁻¹."""
        return float(self.lam * FACE_SCALE / self.interocular_distance)

    def decomposed(self, photo: Photo) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return pictures of u, the light, and of v, the person."""
        return split_pictures(decompose(photo.pixels, self.lam, **self._rest))

    def normalized(self, photo: Photo) -> Photo:
        """Return v of the lightness, as grey as `grey_like` has it."""
        grey = grey_like(photo)
        v = normalize(photo.pixels, self.lam, **self._rest)
        return replace(grey, pixels=from_unit(v, grey.pixels.dtype))

    @property
    def _rest(self) -> dict[str, Any]:
        return {
            "neighborhood": self.neighborhood,
            "interocular_distance": self.interocular_distance,
        }


def grey_like(photo: Photo) -> Photo:
    """Return a black photo of the size of another, and of its depth where that has integers, else 8 bits."""
    depth = photo.pixels.dtype if photo.pixels.dtype.kind == "u" else np.dtype(np.uint8)
    return replace(photo, pixels=np.zeros(photo.pixels.shape[:2], depth), alpha=None, profile=None)
