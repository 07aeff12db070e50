"""What a transfer gives: the relit photo, and every step on the way to it."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

from relit.light.lamps import panorama
from relit.photo.pixels import size_and_dtype
from relit.warp.alignment import Alignment

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.face.views import View, Window
    from relit.light.dome import Lamps
    from relit.light.rendering import Rendered
    from relit.ltv.decomposition import Decomposition
    from relit.settings.options import TransferOptions


@dataclass(frozen=True, eq=False)
class Lighting:
    """What one light does to a face; arrays cover `TransferResult.view`.

    Attributes
    ----------
    laid : Alignment or Rendered
        How the reference lies over the target, from it reduced to the size that its face needs; of a light by
        name, a face of one albedo in it.
    second_alignment : Alignment or None
        The same of a second reference.
    change : (h, w, k) float32 array
        log of relit over target, plane by plane, as the method made it.
    filled : (h, w, k) float32 array
        The change, carried on from around where it is not known.
    known : (h, w) float32 array or None
        Where it is; None with ``mask=False`` of methods other than ``shading``, when all counts as known.
    lamps : Lamps or None
        The new light of ``shading``, as lamps on a dome.
    sources : Lamps or None
        The same, each lamp of a light by name as one direction, without what fills their shadows by the
        options.
    confidence : float
        How far it can be trusted that this is the reference's light, 0 to 1: the share of the face on which
        it is seen, and less the more of its brightness lamps do not explain. 1 of methods that do not say.
    target_split, reference_split : Decomposition or None
        In the channels that were relit; None of methods that do not split.
    layers : mapping of str to (h, w) or (h, w, 3) float32 array
        What the method made on the way, if it does not split: of ``shading``, the target's light as it was
        fitted, where it is lit, the person (half the albedo, relative to the skin's), and the new light, as
        bright as the first.
    """

    laid: Alignment | Rendered
    second_alignment: Alignment | None
    change: NDArray[np.float32]
    filled: NDArray[np.float32]
    known: NDArray[np.float32] | None
    lamps: Lamps | None
    sources: Lamps | None
    confidence: float
    target_split: Decomposition | None
    reference_split: Decomposition | None
    layers: Mapping[str, NDArray[np.float32]]

    @property
    def warped(self) -> NDArray[Any]:
        """The reference laid over the target, (h, w) or (h, w, 3); of a light by name, a face drawn in it."""
        return self.laid.warped

    @property
    def alignment(self) -> Alignment | None:
        """How the reference was laid; None of a light by name."""
        return self.laid if isinstance(self.laid, Alignment) else None

    def __repr__(self) -> str:
        """Return the size of the view, and how much of the change is known."""
        known = "all" if self.known is None else f"{self.known.mean():.0%}"
        return f"Lighting({size_and_dtype(self.warped)}, known={known})"


@dataclass(frozen=True, eq=False)
class TransferResult:
    """A relit photo and every step on the way to it.

    Attributes
    ----------
    image : array, PIL image or torch tensor
        The target in the new light: of its kind, dtype and shape, with its alpha; RGB where a grey target
        took the colours of a reference. Of a `Photo` or a path, the array of pixels.
    target : (H, W) or (H, W, 3) array
        The target's pixels, in the colour space of the transfer.
    references : tuple of array
        The references' pixels; none of a light by name.
    target_landmarks : Landmarks
        As given or detected.
    references_landmarks : tuple of Landmarks
        The same of each reference.
    view : View
        What the method saw of the target: the face and its surroundings, or with ``mask=False`` the whole
        image, reduced to the size that the face needs.
    lightings : tuple of Lighting
        What each reference, or the light by name, does to the face.
    change : (h, w, k) float32 array
        log of what the planes of the view are multiplied with: the median of what the lightings do, under
        the options' control.
    relit : (h, w) or (h, w, 3) float32 array
        The view with this change, in grey or RGB, wherever it is.
    mask : (h, w) float32 array or None
        Share of the change that is made in the photo; None where all of it is, everywhere.
    options : TransferOptions
    lam : float
        λ of the options for this face, in px⁻¹ of the view.
    seconds : mapping of str to float
        Wall time by stage.
    """

    image: Any
    target: NDArray[Any]
    references: tuple[NDArray[Any], ...]
    target_landmarks: Landmarks
    references_landmarks: tuple[Landmarks, ...]
    view: View
    lightings: tuple[Lighting, ...]
    change: NDArray[np.float32]
    relit: NDArray[np.float32]
    mask: NDArray[np.float32] | None
    options: TransferOptions
    lam: float
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the size, what gave the light, the method, and the time."""
        count = len(self.references)
        light = f"{count} reference{'s' * (count > 1)}" if count else f"light={self.options.light!r}"
        method, seconds = f"method={self.options.method!r}", f"{sum(self.seconds.values()):.1f} s"
        return f"TransferResult({', '.join([size_and_dtype(self.target), light, method, seconds])})"

    def _repr_html_(self) -> str:
        """Return what notebooks show: before and after under a slider, and every stage."""
        display = import_module("relit.display.html")  # stands above this module, and draws with PIL
        return str(display.result_html(self))

    @property
    def window(self) -> Window:
        """Rows and columns of the target that the view shows."""
        return self.view.window

    @property
    def first(self) -> Lighting:
        """What the first reference, or the light by name, does."""
        return self.lightings[0]

    @property
    def light(self) -> NDArray[np.float32] | None:
        """The new light of ``shading`` in latitude and longitude, (64, 128, 3), linear; as of `panorama`."""
        return None if self.first.lamps is None else panorama(self.first.lamps)

    @property
    def confidence(self) -> float:
        """How far the lights can be trusted: the least of the lightings' confidences, 0 to 1."""
        return min(one.confidence for one in self.lightings)

    @property
    def reference(self) -> NDArray[Any] | None:
        """The first reference; None of a light by name."""
        return self.references[0] if self.references else None

    @property
    def reference_landmarks(self) -> Landmarks | None:
        """Those of the first reference; None of a light by name."""
        return self.references_landmarks[0] if self.references else None
