"""relit in napari: the face in an image layer in another light, as new layers."""

from typing import TYPE_CHECKING, Annotated, Any, Optional

import numpy as np

import relit
from relit.layering import at_full_size
from relit.settings.studio_lights import STUDIO_LIGHTS

if TYPE_CHECKING:
    import napari.layers
    import napari.types

# Annotations are read by napari, which finds its own types by their names in quotes, and no others.
_FROM_REFERENCE = "of the reference"
_LIGHTS = (_FROM_REFERENCE, *STUDIO_LIGHTS)


def relight(
    target: "napari.layers.Image",
    reference: Optional["napari.layers.Image"] = None,
    light: Annotated[str, {"choices": _LIGHTS}] = _FROM_REFERENCE,
    strength: Annotated[float, {"min": 0.0, "max": 4.0, "step": 0.05}] = 1.0,
    softness: Annotated[float, {"min": 0.0, "max": 1.0, "step": 0.05}] = 0.0,
) -> list["napari.types.LayerDataTuple"]:
    """Return the relit image, and the share of the change at each pixel, as layers.

    Raises
    ------
    relit.RelitError
        If there is no face, or no light; napari shows why.
    """
    named = light if light != _FROM_REFERENCE else None
    given = None if named or reference is None else np.asarray(reference.data)
    result = relit.transfer(np.asarray(target.data), given, light=named, strength=strength, softness=softness)
    shape = result.target.shape[:2]
    mask = np.ones(shape) if result.mask is None else at_full_size(result.mask, result.view, shape)
    place: dict[str, Any] = {"scale": target.scale[-2:], "translate": target.translate[-2:]}
    return [
        (result.image, {"name": f"{target.name}, relit", "rgb": result.image.ndim == 3, **place}, "image"),
        (mask, {"name": f"{target.name}, changed", "visible": False, **place}, "image"),
    ]


def samples() -> list["napari.types.LayerDataTuple"]:
    """Return two photos to try it on."""
    return [
        (relit.read_image(relit.sample(name)).pixels, {"name": name, "rgb": True}, "image")
        for name in ("reference", "target")
    ]
