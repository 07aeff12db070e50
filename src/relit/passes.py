"""A transfer as passes for compositing: the person and the light, whose product is the relit photo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.shape import head_shape
from relit.layering import at_full_size, before_and_after
from relit.methods.lit_face import BRIGHTEST
from relit.photo.channels import repeated, within
from relit.photo.curves import exp, log
from relit.photo.pixels import DARKEST, to_unit
from relit.photo.profile import decode_srgb
from relit.photo.ranks import quantile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from relit.photo.photo import Photo
    from relit.results import TransferResult

_TO_CAMERA = np.array([1, -1, -1], np.float32)  # a shape's axes go down and away from the camera


def passes_of(
    results: Sequence[TransferResult], like: Photo
) -> tuple[Photo, dict[str, NDArray[np.floating[Any]]]]:
    """Return the relit photo in sRGB, and the channels of its passes in linear light.

    ``person.R``, ``.G``, ``.B`` times ``light.R``, ``.G``, ``.B`` is the relit photo, with its alpha; of grey
    ones it is ``.Y`` alone. ``normals.X``, ``.Y``, ``.Z`` go right, up, and to the camera, and are 0 off the
    head. ``matte.Y`` is the share of the change that was made.

    The light falls on the head as far as the matte has it, and beyond it is 1. How strong a light is, and its
    colour, cannot be told from how dark a skin is, and of what colour: where the face was brightest, its old
    light counts as 1. Of methods that do not tell light from person, all of that light does, and the person
    is the photo.

    Parameters
    ----------
    results, like
        As of `layers_of`.

    Returns
    -------
    (Photo, dict of str to (H, W) float16 array)
    """
    relit = before_and_after(results, like)[1].to_profile(None)
    shape = relit.pixels.shape
    person = _linear(relit)
    light, matte = np.ones_like(person), np.zeros(shape[:2], np.float32)
    normals = np.zeros((*shape[:2], 3), np.float32)
    for result in results:
        view = result.view
        share = np.ones(view.regions.shape, np.float32) if result.mask is None else result.mask
        np.maximum(matte, at_full_size(share, view, shape), out=matte)
        head = head_shape(view.landmarks, view.regions.shape)
        facing = at_full_size(head.normals * repeated(head.head.astype(np.float32), 3), view, shape)
        np.copyto(normals, facing * _TO_CAMERA, where=facing.any(axis=2, keepdims=True))
        fallen = log(_new_light(result))
        light *= exp(at_full_size(fallen * repeated(share, fallen.shape[2]), view, shape))
    person /= light
    colours = "Y" if relit.is_grey else "RGB"
    named = [("person", colours, person), ("light", colours, light), ("normals", "XYZ", normals)]
    channels = {
        f"{name}.{axis}": np.ascontiguousarray(planes[..., number], np.float16)
        for name, axes, planes in named
        for number, axis in enumerate(axes)
    }
    return relit, channels | {"matte.Y": matte.astype(np.float16)}


def _new_light(result: TransferResult) -> NDArray[np.float32]:
    """Return the light that falls on a view: its own, times what the change of light made of it."""
    view = result.view
    before, after = (
        decode_srgb(np.maximum(np.atleast_3d(to_unit(planes)), np.float32(DARKEST)))
        for planes in (view.pixels, result.relit)
    )
    change = np.asarray(after / before, np.float32)
    own = result.first.layers.get("target_light")
    if own is None:
        return change
    light = np.atleast_3d(decode_srgb(own)).astype(np.float32)
    light /= quantile(within(light, view.regions.interior), BRIGHTEST)
    return light * change


def _linear(photo: Photo) -> NDArray[np.float32]:
    """Return the light of a photo in sRGB, (H, W, k), multiplied with its alpha."""
    light = np.asarray(decode_srgb(np.atleast_3d(to_unit(photo.pixels))), np.float32)
    if photo.alpha is not None:
        light *= to_unit(photo.alpha)[..., None]
    return light
