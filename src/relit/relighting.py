"""Carry the light of a reference to a target.

1. Warp the reference onto the target through paired landmarks.
2. Relight the target by it, plane of colour by plane: by `methods.shading`, or as Algorithm 1 of Li, Yin and
   Deng (2009) has it, by `methods.ltv_swap`: ``u(warped reference) · v(target)``, or if many targets are to
   share one split of a reference, ``warped u(reference) · v(target)``.
3. Make that change of light on the target's skin, as far as it is known and wanted.

Steps 1 and 2 work on views of the photos that are as large as a face needs; step 3 on the photo itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.compose.adjust import controlled
from relit.compose.blend import base_of, blend
from relit.compose.matte import eyes_and_teeth, known, matte
from relit.compose.membrane import fill
from relit.errors import OptionError
from relit.face.landmarks import check_inside
from relit.face.regions import face_mask, part_mask
from relit.face.shape import face_shape
from relit.face.views import View
from relit.inputs import (
    as_photo,
    as_photos,
    check_region_mask,
    check_second,
    face_view,
    given_references,
    in_profile_of,
    laid_over,
    landmarks_of,
    seen_reference,
)
from relit.light.rendering import render
from relit.ltv.decomposition import FACE_SCALE
from relit.ltv.g_value import lam_for
from relit.methods import METHODS
from relit.methods.scene import Scene
from relit.photo.foreign_images import opened
from relit.photo.photo import in_one_profile
from relit.photo.pixels import to_unit
from relit.photo.planes import PlaneSpace, plane_space
from relit.photo.resampling import reduced
from relit.results import Lighting, TransferResult
from relit.runtime.timing import Stopwatch
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import studio_light

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Unpack

    from numpy.typing import NDArray

    from relit.inputs import AnyLandmarks, Reference
    from relit.photo.foreign_images import AnyImage
    from relit.settings.transfer_changes import TransferChanges

_CELL = 1 / 20  # of the interocular distance, and at least 2 px: the size of the membrane's cells
_SETTLED = 0.4  # interocular distances, over which a change that is carried on turns into the mean
_LEAST = 1e-4  # brightness of 1 below which a relit plane is black


def transfer(
    target: AnyImage,
    reference: AnyImage | Sequence[AnyImage] | None = None,
    *,
    target_landmarks: AnyLandmarks | None = None,
    reference_landmarks: AnyLandmarks | Sequence[AnyLandmarks | None] | None = None,
    second_reference: AnyImage | None = None,
    second_landmarks: AnyLandmarks | None = None,
    region_mask: NDArray[Any] | None = None,
    detail: float | None = None,
    options: TransferOptions | None = None,
    **changes: Unpack[TransferChanges],
) -> TransferResult:
    """Relight the face in one photo with the light on the face in another, or with a light by name.

    The target keeps the person, the reference gives the light. Colour is relit channel by channel. A grey
    target takes the colours of a colour reference; a colour target keeps its colours under a grey reference,
    which has but lightness to give.

    Parameters
    ----------
    target : array, Photo, PIL image, torch tensor, or path
        Grey or RGB photo of any size: an array ``(H, W)`` or ``(H, W, 3)``, also ``(H, W, 1)``, or with alpha
        ``(H, W, 2)`` or ``(H, W, 4)``, of uint8, uint16, or float32/float64 in [0, 1], in sRGB; a `Photo`; a
        PIL image (L, RGB, with alpha or without, I;16); a tensor ``(1, H, W)`` or ``(3, H, W)``; or the path
        of a photo.
    reference : like target, or a list of such, optional
        Of any of these kinds. Taken to the colour profile of the target. Of several, pixel by pixel the
        median of what they do counts. None with ``light=...``.
    target_landmarks, reference_landmarks : Landmarks or (n, 2) or (n, 3) array_like, optional
        ``(x, y)`` in px, paired row by row; 478 rows are taken as the face mesh, 68 as iBUG, 189 as FRL. By
        default the largest face of each photo is detected. Of a list of references, a list.
    second_reference, second_landmarks : optional
        The reference's face in the target's light, for the methods that take one; grey or colour, as the
        reference is.
    region_mask : (H, W) array, optional
        Share of the change that is made at each pixel of the target: uint8, uint16, or float in [0, 1].
    detail : float, optional
        Distance of the eyes, in px, that a face may be reduced to before the method looks at it; by default,
        what the method asks for. Less is a quicker preview.
    options : TransferOptions, optional
        How to relight.
    **changes
        Single fields of `TransferOptions`, by name: ``lam=0.5``, ``strength=0.7``, ``light="rembrandt"``, ...

    Returns
    -------
    TransferResult
        With the relit photo as ``.image``, of the kind that the target is, with its alpha; of a `Photo` or a
        path, the array of pixels.

    Raises
    ------
    ImageError
        If a photo has another shape, dtype or range, or a side below 8 px, or cannot be read; or is a grey
        PIL image of 16 bits and would get colours, which PIL has not.
    FaceNotFoundError
        If landmarks are to be detected and there is no face.
    LandmarkError
        If landmarks are unusable, lie outside their image, or do not pair up.
    OptionError
        If an option is unknown or out of range; or a reference, a second one or a light by name is missing,
        or is one too many.

    Examples
    --------
    >>> import numpy as np
    >>> y, x = np.mgrid[:64, :64]
    >>> target = np.full((64, 64), 120, np.uint8)
    >>> target[41, 31] = 60  # a mole
    >>> reference = (60 + 2 * x).astype(np.uint8)  # light from the right
    >>> points = [[16, 20], [48, 20], [32, 36], [22, 50], [42, 50]]
    >>> landmarks = {"target_landmarks": points, "reference_landmarks": points}
    >>> result = transfer(target, reference, **landmarks, method="ltv", mask=False)
    >>> result.image[30, [10, 50]].tolist(), int(result.image[41, 31])
    ([80, 160], 61)
    """
    settings = (options or TransferOptions()).changed(**changes)
    photo, back = opened(target, "target")
    reference = as_photos(reference, "reference")
    if second_reference is not None:
        second_reference = as_photo(second_reference, "second_reference")
    if detail is not None and not (np.isfinite(detail) and detail > 0):
        raise OptionError(f"detail: expected a finite number of px above 0, or None, got {detail!r}")
    given = given_references(reference, reference_landmarks, settings)
    check_second(second_reference, given, settings.method)
    check_region_mask(region_mask, photo.pixels.shape)
    watch = Stopwatch()

    with watch("look"):
        here = landmarks_of(photo.pixels, target_landmarks, "target")
        check_inside(here, photo.pixels.shape, "target_landmarks")
        lights = [seen_reference(one, marks, "reference", here, settings, detail) for one, marks in given]
        second = None
        if second_reference is not None:
            second = seen_reference(second_reference, second_landmarks, "second", here, settings, detail)
        for light in lights:
            photo = in_one_profile(photo, light.photo)[0]
        lights = [in_profile_of(photo, light) for light in lights]
        second = second and in_profile_of(photo, second)
        view = face_view(photo.pixels, here, settings, detail)
        grey = not lights or lights[0].photo.pixels.ndim == 2
        space = plane_space(photo.pixels.ndim == 2, grey, settings.color_space, settings.lit_channels)
        face = face_mask(view.landmarks, view.pixels.shape) > 0.5
        shared = _Shared(
            view,
            space,
            base_of(space.of_target(view.pixels)),
            face if face.any() else np.ones_like(face),
            lam_for(view.landmarks, settings),
            settings,
            watch,
        )

    by_name: list[Reference | None] = [None]
    lightings = [_lighting(shared, light, second) for light in lights or by_name]
    with watch("combine"):
        change = np.median([lighting.filled for lighting in lightings], axis=0)
        change = controlled(change, shared.base, shared.face, space.weights(change.shape[2]), settings)
        mask = None
        if settings.mask:
            change = _sparing_whites(change, view, space)
            mask = matte(view.pixels, view.landmarks)
        mask = _in_region(mask, view, settings, region_mask)

    with watch("blend"):
        colored = photo.pixels.ndim == 2 and not grey
        image = np.repeat(photo.pixels[..., None], 3, axis=2) if colored else photo.pixels.copy()
        image[view.window] = blend(
            photo.pixels[view.window], change, mask, space, shared.base, view.factor, colored=colored
        )
    relit = np.clip(shared.base * np.exp(change), 0, 1)
    return TransferResult(
        back(image),
        photo.pixels,
        tuple(light.original for light in lights),
        here,
        tuple(light.original_landmarks for light in lights),
        view,
        tuple(lightings),
        change,
        space.rebuild(view.pixels, relit[..., 0] if relit.shape[2] == 1 else relit),
        mask,
        settings,
        shared.lam * FACE_SCALE / view.landmarks.interocular_distance,
        watch.seconds,
    )


class _Shared(NamedTuple):
    """What all lights on a face share."""

    view: View
    space: PlaneSpace
    base: NDArray[np.float32]
    face: NDArray[np.bool_]
    lam: float
    options: TransferOptions
    watch: Stopwatch


def _lighting(shared: _Shared, light: Reference | None, second: Reference | None) -> Lighting:
    """Relight the view by one reference, or by the light that the options name."""
    view, space, base, face, lam, options, watch = shared
    alignment = second_alignment = None
    with watch("align"):
        if light is None:
            shape = face_shape(view.landmarks, view.pixels.shape)
            lamp = studio_light(options.light or "")
            warped: NDArray[Any] = render(shape, lamp, view.landmarks.interocular_distance)
        else:
            alignment = laid_over(view, light, options)
            warped = alignment.warped
        if second is not None:
            second_alignment = laid_over(view, second, options)
    with watch("relight"):
        made = METHODS[options.method](
            Scene(
                space.of_target(view.pixels),
                space.of_reference(warped),
                view.landmarks,
                light.landmarks if light else view.landmarks,
                face,
                lam,
                options,
                space.of_reference(second_alignment.warped) if second_alignment else None,
                rendered=light is None,
                own=space.of_reference(light.photo.pixels) if light and options.splits_alone else None,
                alignment=alignment,
            )
        )
        change = np.log(np.maximum(np.atleast_3d(made.planes), _LEAST) / base)
    trust = None
    filled = change
    if options.mask:
        with watch("fill"):
            seen = alignment.inside if alignment else np.ones(warped.shape[:2], bool)
            trust = known(view.pixels, warped, seen, view.landmarks, rendered=light is None)
            cell = max(round(_CELL * view.landmarks.interocular_distance), 2)
            reach = _SETTLED * view.landmarks.interocular_distance
            filled = fill(change, trust, cell=cell, reach=reach)
    return Lighting(
        warped,
        alignment,
        second_alignment,
        change,
        filled,
        trust,
        made.target_split,
        made.reference_split,
        made.layers,
    )


def _sparing_whites(change: NDArray[np.float32], view: View, space: PlaneSpace) -> NDArray[np.float32]:
    """Return the change with eyes and teeth spared: less of it, no colour, and nothing of catchlights."""
    white, share = eyes_and_teeth(view.pixels, view.landmarks)
    if space.color_space == "rgb" and change.shape[2] == 3:
        brightness = (change @ space.weights(3))[..., None]
        change = change + white[..., None] * (brightness - change)
    return change * share[..., None]


def _in_region(
    mask: NDArray[np.float32] | None,
    view: View,
    options: TransferOptions,
    region_mask: NDArray[Any] | None,
) -> NDArray[np.float32] | None:
    """Return the mask within the region that is to be relit."""
    parts = []
    if options.region != "face":
        parts.append(part_mask(view.landmarks, view.pixels.shape, options.region))
    if region_mask is not None:
        parts.append(to_unit(reduced(region_mask[view.window], view.factor)))
    if options.strength == 0:
        parts.append(np.zeros(view.pixels.shape[:2], np.float32))
    for part in parts:
        mask = part if mask is None else mask * part
    return mask
