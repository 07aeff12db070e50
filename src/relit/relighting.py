"""Carry the light of a reference to a target, in five calls.

1. *Look*: find the faces, and see them as large as the method needs.
2. *Warp* the reference onto the target through paired landmarks.
3. *Relight* the target by it, plane of colour by plane: by `methods.shading`, or by `methods.paper` as Li,
   Yin and Deng (2009) have it in their Algorithm 1, ``u(warped reference) · v(target)``.
4. *Adjust* that change of light: as far as it is known, on the target's skin, as much as is wanted.
5. *Blend* it into the photo at its own size and depth.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.compose.adjust import anchored, controlled
from relit.compose.blend import blend
from relit.compose.hair import sparing_hair
from relit.compose.matte import sparing_whites
from relit.compose.share import share_of_change
from relit.errors import OptionError
from relit.face.trust import known, skin_shown
from relit.inputs import as_photo, as_photos, check_region_mask, check_second, given_references, look
from relit.light.rendering import Rendered
from relit.ltv.decomposition import lam_in_px
from relit.methods import RELIGHT
from relit.methods.light_change import LightChange
from relit.methods.scene import Relit, Scene
from relit.photo.foreign_images import opened
from relit.results import Lighting, TransferResult
from relit.runtime.memo import doing_once
from relit.runtime.opencv import one_opencv_thread
from relit.runtime.threads import one_blas_thread
from relit.runtime.timing import Stopwatch
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import studio_light
from relit.solver.membrane import carried_on
from relit.warp.alignment import Alignment, lay_over

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Unpack

    from numpy.typing import NDArray

    from relit.inputs import AnyLandmarks, Reference, Seen
    from relit.photo.foreign_images import AnyImage
    from relit.settings.transfer_changes import TransferChanges

_LEAST = 1e-4  # brightness of 1 below which a relit plane is black


@one_opencv_thread()
@one_blas_thread()
@doing_once()
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
    second = None if second_reference is None else (second_reference, second_landmarks)
    watch = Stopwatch()

    with watch("look"):
        seen = look(photo, target_landmarks, given, second, settings, detail)
    with watch("warp"):
        lights = [_warp(seen, one, settings) for one in seen.references or (None,)]
    with watch("relight"):
        relit = [_relight(seen, light, settings) for light in lights]
    with watch("adjust"):
        lightings = tuple(
            _lighting(seen, light, made, settings) for light, made in zip(lights, relit, strict=True)
        )
        change = _adjust(seen, lightings, settings)
        mask = share_of_change(seen.view, settings, region_mask)
    with watch("blend"):
        image = blend(seen.photo.pixels, seen.view, change, mask, seen.space, seen.base)

    return TransferResult(
        image=back(image),
        target=seen.photo.pixels,
        references=tuple(one.original for one in seen.references),
        target_landmarks=seen.landmarks,
        references_landmarks=tuple(one.original_landmarks for one in seen.references),
        view=seen.view,
        lightings=lightings,
        change=change,
        relit=seen.space.rebuild(seen.view.pixels, np.clip(seen.base * np.exp(change), 0, 1)),
        mask=mask,
        options=settings,
        lam=lam_in_px(seen.lam, seen.view.landmarks.interocular_distance),
        seconds=watch.seconds,
    )


class _Light(NamedTuple):
    """A reference, or a face rendered in the light that the options name, as it lies on the view."""

    laid: Alignment | Rendered
    reference: Reference | None
    second_alignment: Alignment | None


def _warp(seen: Seen, reference: Reference | None, options: TransferOptions) -> _Light:
    """Lay a reference over the view, or render the light that the options name on the target's shape."""
    second = None if seen.second is None else _laid_over(seen, seen.second, options)
    if reference is not None:
        return _Light(_laid_over(seen, reference, options), reference, second)
    return _Light(
        Rendered(seen.view.regions, studio_light(options.light, options.fill), seen.view.pixels), None, second
    )


def _laid_over(seen: Seen, reference: Reference, options: TransferOptions) -> Alignment:
    return lay_over(
        reference.photo.pixels,
        reference.landmarks,
        seen.view.landmarks,
        seen.view.pixels.shape,
        kernel=options.kernel,
        affine=options.affine,
        smoothing=options.smoothing,
        dtype=seen.view.pixels.dtype,
        tolerance=options.record.map_tolerance,
    )


def _relight(seen: Seen, light: _Light, options: TransferOptions) -> Relit | LightChange:
    """Relight the view by the method that the options name."""
    reference, second, planes = light.reference, light.second_alignment, seen.space.of_reference
    shading = options.record.anchors_itself
    return RELIGHT[options.method](
        Scene(
            target=seen.space.of_target(seen.view.pixels),
            laid=None if shading and reference is None else planes(light.laid.warped),
            face=seen.view.regions,
            reference_landmarks=(reference or seen.view).landmarks,
            lam=seen.lam,
            options=options,
            second=planes(second.warped) if second else None,
            rendered=reference is None,
            own=planes(reference.photo.pixels) if reference and options.splits_alone else None,
            alignment=light.laid if isinstance(light.laid, Alignment) else None,
            encoded=bool(reference and light.laid.warped.ndim == 3)
            or seen.view.pixels.ndim == 3
            or seen.space.coloring,
            colored=seen.space.shows_colors,
            skin=skin_shown(seen.view) if shading else None,
            like_skin=seen.view.skin_likeness if shading else None,
            reference_skin=_trusted(seen, light, narrow=True) if shading and reference else None,
        )
    )


def _trusted(seen: Seen, light: _Light, *, narrow: bool = False) -> NDArray[np.float32]:
    """Return where a light can be trusted to fall on skin, in the target and in the reference."""
    laid = light.laid
    inside = laid.inside if isinstance(laid, Alignment) else np.ones(laid.warped.shape[:2], bool)
    return known(seen.view, laid.warped, inside, rendered=light.reference is None, narrow=narrow)


def _lighting(seen: Seen, light: _Light, made: Relit | LightChange, options: TransferOptions) -> Lighting:
    """Return the change of light that a method made, carried on over what is not known of it."""
    relit = anchored(made, options)
    change = np.log(np.maximum(np.atleast_3d(relit.planes), _LEAST) / seen.base)
    trust, filled = None, change
    if isinstance(made, LightChange):
        trust = made.known
    elif options.mask:
        trust = _trusted(seen, light)
        filled = carried_on(change, trust, seen.view.regions.interocular_distance)
    return Lighting(
        laid=light.laid,
        second_alignment=light.second_alignment,
        change=change,
        filled=filled,
        known=trust,
        lamps=made.lamps if isinstance(made, LightChange) else None,
        sources=made.sources if isinstance(made, LightChange) else None,
        confidence=made.confidence if isinstance(made, LightChange) else 1.0,
        target_split=relit.target_split,
        reference_split=relit.reference_split,
        layers=relit.layers,
    )


def _adjust(seen: Seen, lightings: Sequence[Lighting], options: TransferOptions) -> NDArray[np.float32]:
    """Return the change that most lights agree on, as bright, coloured and strong as the options want it."""
    change = lightings[0].filled
    if len(lightings) > 1:
        change = np.median([lighting.filled for lighting in lightings], axis=0)
    weights = seen.space.weights(change.shape[2])
    change = controlled(change, seen.base, seen.view.regions.interior, weights, options)
    if not options.mask:
        return change
    if options.record.relights_head:
        return sparing_hair(change, seen.base, seen.view)
    return sparing_whites(change, seen.view, seen.space)
