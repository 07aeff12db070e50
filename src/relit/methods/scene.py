"""What a method gets and gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relit.ltv.decomposition import lam_in_px

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from relit.face.landmarks import Landmarks
    from relit.face.regions import FaceRegions
    from relit.ltv.decomposition import Decomposition
    from relit.settings.options import TransferOptions
    from relit.warp.alignment import Alignment


#: Sides of an image, from where on 1/λ is as good as infinite: a blur that wide leaves 10⁻⁸ of its mean.
_BEYOND = 4


@dataclass(frozen=True, eq=False)
class Scene:
    """Two photos of one frame: the planes to relight, and where the face is.

    Attributes
    ----------
    target, laid : (H, W) or (H, W, 3) array
        Planes of the target, and of the reference laid over it: None of a light by name, for a method that
        needs its lamps alone. A target of one plane serves all three of a reference.
    face : FaceRegions
        Where the target's face is.
    reference_landmarks : Landmarks
        Of the reference in its own photo, paired with the target's.
    lam : float
        λ for a face whose eyes are 100 px apart.
    options : TransferOptions
    second : (H, W) or (H, W, 3) array or None
        Planes of the reference's face in the target's light, laid over the target as well.
    rendered : bool
        Whether the reference is nobody's face: all of it is light.
    own : (H', W') or (H', W', 3) array or None
        Planes of the reference in its own photo, where they are to be split there.
    alignment : Alignment or None
        How the reference was laid over the target; None if it was rendered.
    encoded : bool
        Whether the planes are light by the curve of sRGB; grey photos count as light itself.
    colored : bool
        Whether relit planes may have colours: a target's own, or those that the light gives to a grey one.
    skin, reference_skin : (H, W) array or None
        Where the target shows skin, and where the reference does as well; None if it was rendered.
    like_skin : (H, W) array or None
        Where the target has the colours of the face's skin, on the face or off it, 0 to 1.
    """

    target: NDArray[Any]
    laid: NDArray[Any] | None
    face: FaceRegions
    reference_landmarks: Landmarks
    lam: float
    options: TransferOptions
    second: NDArray[Any] | None = None
    rendered: bool = False
    own: NDArray[Any] | None = None
    alignment: Alignment | None = None
    encoded: bool = True
    colored: bool = True
    skin: NDArray[np.float32] | None = None
    reference_skin: NDArray[np.float32] | None = None
    like_skin: NDArray[np.float32] | None = None

    @property
    def reference(self) -> NDArray[Any]:
        """Planes of the reference laid over the target."""
        assert self.laid is not None
        return self.laid

    @property
    def lam_px(self) -> float:
        """λ in px⁻¹; where it is so small that the light has no details at all, as large as that may be."""
        side: int = max(self.target.shape)
        return max(lam_in_px(self.lam, self.face.interocular_distance), 1 / (_BEYOND * side))


@dataclass(frozen=True, eq=False)
class Layers(Mapping[str, NDArray[np.float32]]):
    """Planes by name, which are made when one is first asked for."""

    names: tuple[str, ...]
    make: Callable[[], Mapping[str, NDArray[np.float32]]]

    @cached_property
    def _made(self) -> Mapping[str, NDArray[np.float32]]:
        return self.make()

    def __getitem__(self, name: str) -> NDArray[np.float32]:
        """Return one."""
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        """Return their names, one by one."""
        return iter(self.names)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.names)


class Relit(NamedTuple):
    """Relit planes, and what they are made of: splits of the two photos, or layers by name, if any."""

    planes: NDArray[np.float32]
    target_split: Decomposition | None = None
    reference_split: Decomposition | None = None
    layers: Mapping[str, NDArray[np.float32]] = MappingProxyType({})


def recombined(target: Decomposition, reference: Decomposition) -> Relit:
    """Return the light of one split on the person of another: ``u(reference) · v(target)``."""
    coloring = target.v.ndim < reference.u.ndim
    return Relit(reference.u * (target.v[..., None] if coloring else target.v), target, reference)


def as_planes(image: NDArray[Any]) -> list[NDArray[Any]]:
    """Return the planes of an image, one by one."""
    return [image] if image.ndim == 2 else list(np.moveaxis(image, -1, 0))


def stacked(planes: list[NDArray[Any]]) -> NDArray[np.float32]:
    """Return an image of one plane or several."""
    return np.asarray(planes[0] if len(planes) == 1 else np.stack(planes, axis=-1), np.float32)
