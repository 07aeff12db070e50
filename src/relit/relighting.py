"""Carry the light of a reference to a target.

1. Warp the reference onto the target through paired landmarks.
2. Relight the target by it, plane of colour by plane: by `methods.shading`, or as Algorithm 1 of Li, Yin and
   Deng (2009) has it, by `methods.ltv_swap`: ``u(warped reference) · v(target)``.
3. Blend the face back into its photo.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.alignment import Alignment, align
from relit.compose import blend, face_mask, face_outline
from relit.detect import detect_landmarks
from relit.errors import ImageError, OptionError
from relit.image import Photo, in_one_profile
from relit.landmarks import Landmarks, as_landmarks, check_inside, check_pair
from relit.ltv import Decomposition
from relit.methods import METHODS, WITH_SECOND_REFERENCE
from relit.methods.scene import Scene
from relit.options import TransferOptions
from relit.pixels import check_pixels
from relit.planes import planes_of
from relit.scale import lam_for

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

#: How far round the face the split is solved, in interocular distances: several times the scale 1/λ at which
#: u still feels what lies there.
_SURROUNDINGS = 0.75


@dataclass(frozen=True, eq=False)
class TransferResult:
    """A relit photo and every step on the way to it.

    Attributes
    ----------
    image : (H, W) or (H, W, 3) array
        The target in the reference's light, in the target's dtype and shape; RGB where a grey target took the
        colours of a reference.
    target, reference : array
        As given, or of a `Photo`, the pixels in the colour space of the transfer.
    target_landmarks, reference_landmarks : Landmarks
        As given or detected.
    region : (slice, slice)
        Rows and columns of the target that the following arrays cover: the face and its surroundings, or with
        ``mask=False`` the whole image.
    alignment : Alignment
        The reference laid over the region.
    target_split, reference_split : Decomposition or None
        Of the region and of the warped reference, in the channels that were relit; None of methods that do
        not split.
    relit : (h, w) or (h, w, 3) float32 array
        What the method made, in grey or RGB, before it is blended into the photo.
    mask : (h, w) float32 array or None
        Share of `relit` in the image; None with ``mask=False``.
    options : TransferOptions
    lam : float
        λ of the options for this face, in px⁻¹.
    second_alignment : Alignment or None
        The second reference laid over the region; None of methods that take none.
    layers : mapping of str to (h, w) or (h, w, 3) float32 array
        What the method made on the way, if it does not split: of ``shading``, the target's light as it was
        fitted, where it is lit, the person (half the albedo, relative to the skin's), and the new light.
    """

    image: NDArray[Any]
    target: NDArray[Any]
    reference: NDArray[Any]
    target_landmarks: Landmarks
    reference_landmarks: Landmarks
    region: tuple[slice, slice]
    alignment: Alignment
    target_split: Decomposition | None
    reference_split: Decomposition | None
    relit: NDArray[np.float32]
    mask: NDArray[np.float32] | None
    options: TransferOptions
    lam: float
    second_alignment: Alignment | None = None
    layers: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)


def transfer(
    target: NDArray[Any] | Photo,
    reference: NDArray[Any] | Photo,
    *,
    target_landmarks: Landmarks | ArrayLike | None = None,
    reference_landmarks: Landmarks | ArrayLike | None = None,
    second_reference: NDArray[Any] | Photo | None = None,
    second_landmarks: Landmarks | ArrayLike | None = None,
    options: TransferOptions | None = None,
    **changes: Any,
) -> TransferResult:
    """Relight the face in one photo with the light on the face in another.

    The target keeps the person, the reference gives the light. Colour is relit channel by channel. A grey
    target takes the colours of a colour reference; a colour target keeps its colours under a grey reference,
    which has but lightness to give.

    Parameters
    ----------
    target, reference : (H, W) or (H, W, 3) array, or Photo
        Grey or sRGB photos of any sizes: uint8, uint16, or float32/float64 in [0, 1]. Of a `Photo` that
        `read_image` gave, the pixels; the reference's are taken to the colour profile of the target.
    target_landmarks, reference_landmarks : Landmarks or (n, 2) or (n, 3) array_like, optional
        ``(x, y)`` in px, paired row by row; 478 rows are taken as the face mesh, 68 as iBUG, 189 as FRL. By
        default the largest face of each photo is detected.
    second_reference, second_landmarks : optional
        The reference's face in the target's light, for the methods that take one; grey or colour, as the
        reference is.
    options : TransferOptions, optional
        How to relight.
    **changes
        Single fields of `TransferOptions`, by name: ``lam=0.5``, ``color_space="ycbcr"``, ``mask=False``, ...

    Returns
    -------
    TransferResult
        With the relit photo as ``.image``.

    Raises
    ------
    ImageError
        If a photo has another shape, dtype or range, or a side below 8 px.
    FaceNotFoundError
        If landmarks are to be detected and there is no face.
    LandmarkError
        If landmarks are unusable, lie outside their image, or do not pair up.
    OptionError
        If an option is unknown or out of range, or a second reference is given to a method that takes none,
        or missing for one that does.

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
    _check_second(second_reference is not None, settings.method)
    photo, light = in_one_profile(_photo(target, "target"), _photo(reference, "reference"))
    target, reference = photo.pixels, light.pixels
    here = _landmarks_of(target, target_landmarks, "target")
    there = _landmarks_of(reference, reference_landmarks, "reference")
    check_pair(here, there)
    check_inside(here, target.shape, "target_landmarks")

    region = _region(here, target.shape) if settings.mask else _whole(target.shape)
    face = target[region]
    landmarks = here.shifted(-region[1].start, -region[0].start)
    lay = partial(
        align,
        target_landmarks=landmarks,
        shape=face.shape,
        kernel=settings.kernel,  # type: ignore[arg-type]
        affine=settings.affine,
        smoothing=settings.smoothing,
        dtype=target.dtype,
    )
    alignment = lay(reference, there)
    second_alignment = None
    if second_reference is not None:
        second = in_one_profile(photo, _photo(second_reference, "second_reference"))[1].pixels
        if second.ndim != reference.ndim:
            raise ImageError(
                "second_reference: expected grey or colour, as the reference is; convert one of them"
            )
        second_alignment = lay(second, _landmarks_of(second, second_landmarks, "second"))

    split = partial(
        planes_of,
        face,
        color_space=settings.color_space,  # type: ignore[arg-type]
        channels=settings.lit_channels,
    )
    planes = split(alignment.warped)
    mask = face_mask(landmarks, face.shape)
    inside = mask > 0.5
    scene = Scene(
        planes.target,
        planes.reference,
        landmarks,
        there,
        inside if inside.any() else np.ones_like(inside),
        lam_for(landmarks, settings),
        settings,
        split(second_alignment.warped).reference if second_alignment else None,
    )
    result = METHODS[settings.method](scene)
    relit = planes.rebuild(result.planes)

    image = np.repeat(target[..., None], 3, axis=2) if relit.ndim > target.ndim else target.copy()
    image[region] = blend(face, relit, mask if settings.mask else None)
    return TransferResult(
        image,
        target,
        reference,
        here,
        there,
        region,
        alignment,
        result.target_split,
        result.reference_split,
        relit,
        mask if settings.mask else None,
        settings,
        scene.lam_px,
        second_alignment,
        result.layers,
    )


def _check_second(given: bool, method: str) -> None:
    if given and method not in WITH_SECOND_REFERENCE:
        wanted = f"none with method {method!r}; leave it out, or choose {' or '.join(WITH_SECOND_REFERENCE)}"
    elif not given and method in WITH_SECOND_REFERENCE:
        wanted = f"the reference's face in the target's light with method {method!r}; give a photo of it"
    else:
        return
    raise OptionError(f"second_reference: expected {wanted}")


def _photo(image: NDArray[Any] | Photo, name: str) -> Photo:
    photo = image if isinstance(image, Photo) else Photo(image)
    check_pixels(photo.pixels, name)
    return photo


def _landmarks_of(image: NDArray[Any], given: Landmarks | ArrayLike | None, name: str) -> Landmarks:
    if given is None:
        return detect_landmarks(image, name=name)
    return as_landmarks(given, f"{name}_landmarks")


def _whole(shape: tuple[int, ...]) -> tuple[slice, slice]:
    return slice(0, shape[0]), slice(0, shape[1])


def _region(landmarks: Landmarks, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the rows and columns of the face and its surroundings, and of all landmarks, hair among them."""
    outline = face_outline(landmarks)
    margin = _SURROUNDINGS * landmarks.interocular_distance
    points = np.vstack([outline - margin, outline + margin, landmarks.xy])
    left, top = np.floor(points.min(axis=0)).astype(int)
    right, bottom = np.ceil(points.max(axis=0)).astype(int) + 1
    return slice(max(top, 0), min(bottom, shape[0])), slice(max(left, 0), min(right, shape[1]))
