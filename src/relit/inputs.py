"""What a transfer is given: checked, its faces found, and seen at the size that they need."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.compose.blend import base_of
from relit.compose.matte import REACH
from relit.compose.person_matte import corners_round
from relit.errors import ImageError, OptionError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks, as_landmarks, check_inside, check_pair
from relit.face.outline import face_outline
from relit.face.views import View, as_seen_before, view_of, whole, window_round
from relit.ltv.g_value import lam_for
from relit.photo.foreign_images import opened
from relit.photo.photo import Photo
from relit.photo.pixels import check_samples
from relit.photo.planes import PlaneSpace, plane_space
from relit.settings.methods import WITH_SECOND_REFERENCE
from relit.settings.studio_lights import studio_light

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from relit.face.views import Window
    from relit.photo.foreign_images import AnyImage
    from relit.settings.options import TransferOptions

    AnyPhoto = NDArray[Any] | Photo
    AnyLandmarks = Landmarks | ArrayLike

#: How far round the face the method looks, in interocular distances: several times the scale 1/λ at which u
#: still feels what lies there.
_SURROUNDINGS = 0.75


class Reference(NamedTuple):
    """A reference, and as it is seen: reduced to the size that its face needs.

    Attributes
    ----------
    original : array
    original_landmarks : Landmarks
    photo : Photo
        Reduced, without alpha, in the colours of the target's profile; where it is to be split alone, the
        face and its surroundings.
    landmarks : Landmarks
        In px of that.
    """

    original: NDArray[Any]
    original_landmarks: Landmarks
    photo: Photo
    landmarks: Landmarks


@dataclass(frozen=True, eq=False)
class Seen:
    """A target and what is to light it, as they are seen.

    Attributes
    ----------
    photo : Photo
        The target.
    landmarks : Landmarks
        In px of that.
    view : View
        Of the target's face.
    references : tuple of Reference
        None with a light by name.
    second : Reference or None
        The second reference.
    space : PlaneSpace
        The planes that are relit.
    base : (h, w, k) or (h, w, 1) float32 array
        Those of the view, in (0, 1].
    lam : float
        λ for a face whose eyes are 100 px apart.
    """

    photo: Photo
    landmarks: Landmarks
    view: View
    references: tuple[Reference, ...]
    second: Reference | None
    space: PlaneSpace
    base: NDArray[np.float32]
    lam: float


def look(
    target: Photo,
    target_landmarks: AnyLandmarks | None,
    references: Sequence[tuple[AnyPhoto, AnyLandmarks | None]],
    second: tuple[AnyPhoto, AnyLandmarks | None] | None,
    options: TransferOptions,
    detail: float | None,
) -> Seen:
    """Find the faces that are not given, and see all photos at the size that these need.

    Raises
    ------
    ImageError, FaceNotFoundError, LandmarkError
        As `relit.transfer` does.
    """
    photos = [as_photo(one, "reference") for one, _ in references]
    given = [(target.pixels, target_landmarks, "target")]
    given += [(one.pixels, marks, "reference") for one, (_, marks) in zip(photos, references, strict=True)]
    if second is not None:
        photos.append(as_photo(second[0], "second_reference"))
        given.append((photos[-1].pixels, second[1], "second"))
    here, *there = [landmarks_of(*one) for one in given]
    check_inside(here, target.pixels.shape, "target_landmarks")
    names = [name for *_, name in given[1:]]
    seen = [
        _reference(one, marks, name, here, options, detail)
        for one, marks, name in zip(photos, there, names, strict=True)
    ]
    beside = None if second is None else seen.pop()
    colored = options.light is not None and studio_light(options.light).colored
    if target.is_grey and (colored or any(not one.photo.is_grey for one in seen)):
        target = target.to_profile(None)  # a grey profile knows no colours
    view = as_seen_before(_face_view(target.pixels, here, options, detail))
    grey = (target.pixels.ndim == 2, seen[0].photo.pixels.ndim == 2 if seen else not colored)
    space = plane_space(*grey, options.color_space, options.lit_channels)
    return Seen(
        photo=target,
        landmarks=here,
        view=view,
        references=tuple(_in_profile_of(target, one) for one in seen),
        second=beside and _in_profile_of(target, beside),
        space=space,
        base=base_of(space.of_target(view.pixels)),
        lam=lam_for(view.landmarks, options),
    )


def _reference(
    photo: Photo,
    landmarks: Landmarks,
    name: str,
    here: Landmarks,
    options: TransferOptions,
    detail: float | None,
) -> Reference:
    """Check a reference, and reduce it."""
    check_pair(here, landmarks)
    check_inside(landmarks, photo.pixels.shape, f"{name}_landmarks")
    if options.splits_alone:
        view = _face_view(photo.pixels, landmarks, options, detail)
    else:
        window = whole(photo.pixels, landmarks).window
        view = view_of(photo.pixels, landmarks, window, reduction(landmarks, options, detail))
    return Reference(photo.pixels, landmarks, replace(photo, pixels=view.pixels, alpha=None), view.landmarks)


def _in_profile_of(target: Photo, reference: Reference) -> Reference:
    """Return a reference in the colours of the target's profile."""
    return reference._replace(photo=reference.photo.to_profile_of(target))


def _face_view(
    image: NDArray[Any], landmarks: Landmarks, options: TransferOptions, detail: float | None
) -> View:
    """Return the view that a method gets of a target."""
    factor = reduction(landmarks, options, detail)
    return view_of(image, landmarks, face_window(image.shape, landmarks, options, factor), factor)


def face_window(
    shape: tuple[int, ...], landmarks: Landmarks, options: TransferOptions, factor: int
) -> Window:
    """Return the part of a target that a method looks at."""
    if not options.mask:
        return slice(0, shape[0]), slice(0, shape[1])
    points = np.vstack([face_outline(landmarks), landmarks.xy])
    margin = max(REACH, _SURROUNDINGS) * landmarks.interocular_distance
    if options.record.relights_head:
        points, margin = np.vstack([corners_round(landmarks), landmarks.xy]), 0.0
    return window_round(points, margin, shape, factor)


def reduction(landmarks: Landmarks, options: TransferOptions, detail: float | None) -> int:
    """Return by how much a photo can be reduced before its face is smaller than the method needs."""
    if options.full_resolution:
        return 1
    return max(int(landmarks.interocular_distance / (detail or options.record.working_iod)), 1)


def as_photo(image: AnyImage, name: str) -> Photo:
    """Return an image of any kind as a photo that may hold a face."""
    return opened(image, name).photo


def as_photos(given: Any, name: str) -> Photo | list[Photo] | None:
    """Return an image, or each of a list, as a photo."""
    if isinstance(given, (list, tuple)):
        return [as_photo(one, name) for one in given]
    return None if given is None else as_photo(given, name)


def landmarks_of(image: NDArray[Any], given: AnyLandmarks | None, name: str) -> Landmarks:
    """Return the landmarks that were given, or find them."""
    if given is None:
        return detect_landmarks(image, name=name)
    return as_landmarks(given, f"{name}_landmarks")


def given_references(
    reference: AnyPhoto | Sequence[AnyPhoto] | None,
    landmarks: AnyLandmarks | Sequence[AnyLandmarks | None] | None,
    options: TransferOptions,
) -> list[tuple[AnyPhoto, AnyLandmarks | None]]:
    """Return the references, each with its landmarks if they were given."""
    if isinstance(reference, (list, tuple)):
        marks = [None] * len(reference) if landmarks is None else list(landmarks)  # type: ignore[arg-type]
        if len(marks) != len(reference):
            raise OptionError(
                f"reference_landmarks: expected one entry for each of {len(reference)} references, got "
                f"{len(marks)}"
            )
        given: list[tuple[Any, Any]] = list(zip(reference, marks, strict=True))
    else:
        given = [] if reference is None else [(reference, landmarks)]
    check_one_light(bool(given), options)
    if len({_planes(one) for one, _ in given}) > 1:
        raise ImageError("reference: expected all grey or all colour; convert some of them")
    return given


def check_one_light(has_reference: bool, options: TransferOptions) -> None:
    """Refuse a reference beside a light by name, and neither of them."""
    if options.light is not None and has_reference:
        raise OptionError("reference: expected none with a light by name; leave one of them out")
    if options.light is None and not has_reference:
        raise OptionError("reference: expected a photo; give one, or a light by name (light=...)")


def check_second(second: AnyPhoto | None, given: list[tuple[AnyPhoto, Any]], method: str) -> None:
    """Refuse a second reference too many, or too few, or of another kind than the reference."""
    wanted = None
    if second is not None and method not in WITH_SECOND_REFERENCE:
        wanted = f"none with method {method!r}; leave it out, or choose {' or '.join(WITH_SECOND_REFERENCE)}"
    elif method in WITH_SECOND_REFERENCE and not given:
        wanted = f"no light by name with method {method!r}; give a reference and a second one, both photos"
    elif method in WITH_SECOND_REFERENCE and second is None:
        wanted = f"the reference's face in the target's light with method {method!r}; give a photo of it"
    elif second is not None and _planes(second) != _planes(given[0][0]):
        raise ImageError(
            "second_reference: expected grey or colour, as the reference is; convert one of them"
        )
    if wanted:
        raise OptionError(f"second_reference: expected {wanted}")


def _planes(photo: AnyPhoto) -> int:
    return np.ndim(photo.pixels if isinstance(photo, Photo) else photo)


def check_region_mask(mask: NDArray[Any] | None, shape: tuple[int, ...]) -> None:
    """Refuse a mask that does not go with the target."""
    if mask is None:
        return
    check_samples(mask, "region_mask")
    if mask.shape != shape[:2]:
        raise ImageError(f"region_mask: expected shape {shape[:2]}, that of the target, got {mask.shape}")
