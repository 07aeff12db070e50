"""The nodes: relight by a photo, relight by a lamp, and the light of a face as a picture."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

import relit
from relit.layering import at_full_size
from relit.photo.profile import encode_srgb
from relit.settings.studio_lights import STUDIO_LIGHTS

from .pictures import ball, disc, enlarged
from .tensors import at, images_of, masks_of, tensor_of
from .widgets import options_of, widgets

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

_TOGETHER, _ONE_BY_ONE = "all together", "one by one"
_STOP, _KEEP = "stop", "keep the image"
_LAMP = "lamp"


class _Relight:
    """What both nodes that relight share."""

    CATEGORY = "relit"
    FUNCTION = "relight"
    RETURN_TYPES = ("IMAGE", "MASK")
    RETURN_NAMES = ("image", "mask")
    OUTPUT_TOOLTIPS = ("The relit images.", "Share of the change that was made at each pixel.")

    @classmethod
    def VALIDATE_INPUTS(cls, **given: Any) -> bool | str:
        """Return True, or in one line what is wrong with the widgets, before anything is computed."""
        try:
            relit.TransferOptions().changed(**cls.options(given))
        except relit.RelitError as error:
            return str(error)
        return True

    @staticmethod
    def options(given: dict[str, Any]) -> dict[str, Any]:
        """Return changes of `TransferOptions` from what the widgets hold."""
        return options_of({name: value for name, value in given.items() if value is not None})

    def relight(self, target: Any, no_face: str, region_mask: Any = None, **given: Any) -> tuple[Any, Any]:
        """Relight a batch of images."""
        options = relit.TransferOptions().changed(**self.options(given))
        regions = [None] if region_mask is None else masks_of(region_mask)
        images, masks = [], []
        for number, image in enumerate(_watched(images_of(target))):
            references = self.references(given, number)
            try:
                result = relit.transfer(image, references, region_mask=at(regions, number), options=options)
            except relit.FaceNotFoundError:
                if no_face != _KEEP:
                    raise
                images.append(image)
                masks.append(np.zeros(image.shape[:2], np.float32))
            else:
                images.append(result.image)
                masks.append(_mask(result))
        return tensor_of(images), tensor_of(masks)

    def references(self, given: dict[str, Any], number: int) -> list[NDArray[Any]] | None:
        """Return the references of an image of the batch."""
        raise NotImplementedError


class RelightFromPhoto(_Relight):
    """Carry the light of the face in a photo to the face in another."""

    DESCRIPTION = "The target keeps the person, the reference gives the light. Runs on the CPU."

    @classmethod
    def INPUT_TYPES(cls) -> dict[str, dict[str, Any]]:
        """Return what the node takes."""
        return {
            "required": {
                "target": ("IMAGE", {"tooltip": "Its faces are relit, the largest of each image."}),
                "reference": ("IMAGE", {"tooltip": "The face in it gives the light."}),
                "references": (
                    [_TOGETHER, _ONE_BY_ONE],
                    {
                        "default": _TOGETHER,
                        "tooltip": "Of several references: what most of them do counts, or the first lights "
                        "the first image, the second the second, and so on.",
                    },
                ),
                **_no_face(),
                **widgets(expert=False),
            },
            "optional": {
                "reference_2": ("IMAGE", {"tooltip": "More references, of another size."}),
                "reference_3": ("IMAGE", {"tooltip": "More references, of another size."}),
                **_region_mask(),
                **widgets(expert=True),
            },
        }

    def references(self, given: dict[str, Any], number: int) -> list[NDArray[Any]]:
        """Return all references, or the one of this image."""
        tensors = [
            given[name] for name in ("reference", "reference_2", "reference_3") if given.get(name) is not None
        ]
        every = [image for tensor in tensors for image in images_of(tensor)]
        return [at(every, number)] if given["references"] == _ONE_BY_ONE else every


class RelightByLamp(_Relight):
    """Light the face in a photo by a lamp."""

    DESCRIPTION = "A light by a portraitist's name, or a lamp where you put it. Runs on the CPU."

    @classmethod
    def INPUT_TYPES(cls) -> dict[str, dict[str, Any]]:
        """Return what the node takes."""

        def number(
            default: float, least: float, most: float, step: float, tooltip: str
        ) -> tuple[str, dict[str, Any]]:
            return "FLOAT", {"default": default, "min": least, "max": most, "step": step, "tooltip": tooltip}

        return {
            "required": {
                "target": ("IMAGE", {"tooltip": "Its faces are relit, the largest of each image."}),
                "light": (
                    [*STUDIO_LIGHTS, _LAMP],
                    {"default": "rembrandt", "tooltip": f"A light by name; or {_LAMP}, the one set below."},
                ),
                "azimuth": number(
                    -30.0, -180, 180, 1, "Degrees from the camera to the right of the picture."
                ),
                "elevation": number(20.0, -90, 90, 1, "Degrees upwards from the camera."),
                "size": number(
                    10.0, 1, 60, 1, "Degrees from the middle of the lamp to its rim: large is soft."
                ),
                "color": ("STRING", {"default": "#ffffff", "tooltip": "Of the lamp: #rrggbb."}),
                **_no_face(),
                **widgets(expert=False),
            },
            "optional": {
                "more_lamps": (
                    "STRING",
                    {
                        "default": "",
                        "tooltip": "Joined to these by +, for example 120,10:power=0.4:color=#4060ff",
                    },
                ),
                **_region_mask(),
                **widgets(expert=True),
            },
        }

    @staticmethod
    def options(given: dict[str, Any]) -> dict[str, Any]:
        """Return changes of `TransferOptions`; what is linked is not known when widgets are checked."""
        known = {name: value for name, value in given.items() if value is not None}
        light = known.get("light", "flat")
        if light == _LAMP:
            azimuth, elevation, size = (
                np.format_float_positional(known.get(name, default), 3, trim="-")
                for name, default in (("azimuth", 0), ("elevation", 0), ("size", 10))
            )
            light = f"{azimuth},{elevation}:size={size}:color={known.get('color', '#ffffff')}"
        more = known.get("more_lamps", "").strip()
        return options_of(known) | {"light": f"{light}+{more}" if more else light}

    def references(self, given: dict[str, Any], number: int) -> None:
        """Return that there are none."""


class FaceLight:
    """The light on the face in a photo, as pictures."""

    CATEGORY = "relit"
    FUNCTION = "look"
    DESCRIPTION = "The light on a face: all round the head in latitude and longitude, and on a white ball."
    RETURN_TYPES = ("IMAGE", "IMAGE", "MASK", "FLOAT")
    RETURN_NAMES = ("panorama", "ball", "ball_mask", "confidence")
    OUTPUT_TOOLTIPS = (
        "In latitude and longitude; the middle is where the camera is.",
        "A white ball in this light.",
        "Where the ball is.",
        "How far it can be trusted, 0 to 1; of a batch, the least.",
    )

    @classmethod
    def INPUT_TYPES(cls) -> dict[str, dict[str, Any]]:
        """Return what the node takes."""
        return {
            "required": {
                "image": ("IMAGE", {"tooltip": "Photos with a face."}),
                "height": (
                    "INT",
                    {
                        "default": 256,
                        "min": 64,
                        "max": 2048,
                        "step": 64,
                        "tooltip": "Of the pictures, in px.",
                    },
                ),
            }
        }

    def look(self, image: Any, height: int) -> tuple[Any, Any, Any, float]:
        """Return the pictures of the light on each face."""
        results = [relit.transfer(one, one) for one in _watched(images_of(image))]
        lights = [result.light for result in results]
        return (
            tensor_of([enlarged(encode_srgb(light), height) for light in lights if light is not None]),
            tensor_of([encode_srgb(ball(light, height)) for light in lights if light is not None]),
            tensor_of([disc(height)] * len(lights)),
            min(result.confidence for result in results),
        )


def _no_face() -> dict[str, Any]:
    tooltip = "What becomes of an image in which no face is found."
    return {"no_face": ([_STOP, _KEEP], {"default": _STOP, "tooltip": tooltip})}


def _region_mask() -> dict[str, Any]:
    return {"region_mask": ("MASK", {"tooltip": "Relight where it is white; of the target's size."})}


def _mask(result: relit.TransferResult) -> NDArray[np.float32]:
    """Return the share of the change at each pixel of the target."""
    shape = result.target.shape[:2]
    return (
        np.ones(shape, np.float32) if result.mask is None else at_full_size(result.mask, result.view, shape)
    )


def _watched(images: list[NDArray[Any]]) -> Iterator[NDArray[Any]]:
    """Yield images; ComfyUI, if this runs in it, shows how far it is, and may stop between two."""
    utils, management = (sys.modules.get(f"comfy.{name}") for name in ("utils", "model_management"))
    bar = utils.ProgressBar(len(images)) if utils else None
    for image in images:
        if management:
            management.throw_exception_if_processing_interrupted()
        yield image
        if bar:
            bar.update(1)
