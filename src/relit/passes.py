"""A transfer as passes for compositing: the person and the light, whose product is the relit photo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.shape import head_shape
from relit.layering import at_full_size, before_and_after
from relit.photo.channels import repeated
from relit.photo.curves import exp, log
from relit.photo.pixels import to_unit
from relit.photo.profile import decode_srgb

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
    ones it is ``.Y`` alone. The light is what falls on the head, as far as the matte has it, and 1 beyond; of
    methods that do not tell light from person, it is what the photo was multiplied with. ``normals.X``,
    ``.Y``, ``.Z`` go right, up, and to the camera, and are 0 off the head. ``matte.Y`` is the share of the
    change that was made.

    Parameters
    ----------
    results, like
        As of `layers_of`.

    Returns
    -------
    (Photo, dict of str to (H, W) float16 array)
    """
    before, after = (photo.to_profile(None) for photo in before_and_after(results, like))
    relit = _linear(after)
    shape = after.pixels.shape
    light, matte = np.ones_like(relit), np.zeros(shape[:2], np.float32)
    normals = np.zeros((*shape[:2], 3), np.float32)
    for result in results:
        view = result.view
        share = np.ones(view.regions.shape, np.float32) if result.mask is None else result.mask
        np.maximum(matte, at_full_size(share, view, shape), out=matte)
        head = head_shape(view.landmarks, view.regions.shape)
        facing = at_full_size(head.normals * repeated(head.head.astype(np.float32), 3), view, shape)
        normals = np.where(facing.any(axis=2, keepdims=True), facing * _TO_CAMERA, normals)
        if (fallen := result.first.layers.get("new_light")) is not None:
            planes = np.atleast_3d(log(decode_srgb(fallen)))
            light *= exp(at_full_size(planes * repeated(share, planes.shape[2]), view, shape))
    if "new_light" in results[0].first.layers:
        person = relit / light
    else:
        person = _linear(before)
        np.divide(relit, person, out=light, where=person > 0)
    colours = "Y" if after.is_grey else "RGB"
    named = [("person", colours, person), ("light", colours, light), ("normals", "XYZ", normals)]
    channels = {
        f"{name}.{axis}": np.ascontiguousarray(planes[..., number], np.float16)
        for name, axes, planes in named
        for number, axis in enumerate(axes)
    }
    return after, channels | {"matte.Y": matte.astype(np.float16)}


def _linear(photo: Photo) -> NDArray[np.float32]:
    """Return the light of a photo in sRGB, (H, W, k), multiplied with its alpha."""
    light = np.asarray(decode_srgb(np.atleast_3d(to_unit(photo.pixels))), np.float32)
    if photo.alpha is not None:
        light *= to_unit(photo.alpha)[..., None]
    return light
