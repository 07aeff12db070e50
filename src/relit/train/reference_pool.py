"""References at hand: read when they are first asked for, their faces found once, and kept reduced."""

from __future__ import annotations

import glob
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit.errors import OptionError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks, as_landmarks, check_inside
from relit.inputs import reduction
from relit.photo.color import luma
from relit.photo.foreign_images import opened
from relit.photo.patterns import expand
from relit.photo.photo import Photo
from relit.photo.pixels import check_pixels, from_unit, to_unit
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.runtime.lru import LRU

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.inputs import AnyLandmarks
    from relit.settings.options import TransferOptions


class ReferencePool:
    """Photos by number.

    Landmarks are kept for good, and go along when it is pickled; what was read from files stays behind then.

    Attributes
    ----------
    given : list of Path or Photo
        The photos.

    Parameters
    ----------
    references : path, image, or list of such
        Images are of any kind that `relit.transfer` takes. A path is that of a photo, of a folder, whose
        photos it stands for, those of its folders too, or a pattern with ``*``, ``?``, ``[...]`` and ``**``,
        both sorted by name.
    landmarks : sequence of (landmarks or None), optional
        One entry for each photo.
    most_bytes : int
        How much the reduced photos that are kept may hold; what was not asked for longest is forgotten.

    Raises
    ------
    OptionError
        If there is no photo, or another number of landmarks.
    ImageError, LandmarkError
        If an image is not a photo's pixels, or landmarks are unusable.

    Examples
    --------
    >>> from relit.photo.samples import sample
    >>> pool = ReferencePool(sample("target"))
    >>> len(pool), pool.given[0].name
    (1, 'target.png')
    """

    def __init__(
        self,
        references: Any,
        landmarks: Sequence[AnyLandmarks | None] | None = None,
        *,
        most_bytes: int = 100_000_000,
    ) -> None:
        given = list(references) if isinstance(references, (list, tuple)) else [references]
        found = [one for reference in given for one in _expanded(reference)]
        self.given: list[Path | Photo] = [
            one if isinstance(one, Path) else opened(one, f"references[{number}]").photo
            for number, one in enumerate(found)
        ]
        if not self.given:
            raise OptionError("references: expected at least one photo, got none; or leave them out")
        marks = [None] * len(self.given) if landmarks is None else list(landmarks)
        if len(marks) != len(self.given):
            raise OptionError(
                f"reference_landmarks: expected one entry for each of {len(self.given)} references, got "
                f"{len(marks)}"
            )
        self._landmarks = {
            number: as_landmarks(one, f"reference_landmarks[{number}]")
            for number, one in enumerate(marks)
            if one is not None
        }
        self._kept: LRU[tuple[int, int, bool, bytes | None], Photo] = LRU(most_bytes, _pixels_of)

    def __len__(self) -> int:
        """Return the number of photos."""
        return len(self.given)

    def seen(
        self, number: int, target: Photo, options: TransferOptions, detail: float | None
    ) -> tuple[Photo, Landmarks]:
        """Return a photo and its landmarks, as small as a transfer makes it, and in the target's colours.

        Parameters
        ----------
        number : int
        target : Photo
            Of a grey one, the lightness alone is returned.
        options : TransferOptions
        detail : float or None
            As of `relit.transfer`.

        Raises
        ------
        ImageError, LandmarkError
            If it cannot be read, has no face, or its landmarks lie outside. The message names it.
        """
        photo = None
        if number not in self._landmarks:
            photo = self._read(number)
            self._landmarks[number] = detect_landmarks(photo.pixels, name=self._name(number))
        landmarks = self._landmarks[number]
        factor = reduction(landmarks, options, detail)
        grey = target.pixels.ndim == 2
        key = (number, factor, grey, target.profile)
        small = self._kept.get(key)
        if small is None:
            photo = photo or self._read(number)
            check_inside(landmarks, photo.pixels.shape, f"reference_landmarks[{number}]")
            if grey:
                photo = _grey(photo)
            small = replace(photo, pixels=reduced(photo.pixels, factor), alpha=None)
            small = small.to_profile_of(target)
            self._kept.put(key, small)
        return small, landmarks.reduced(factor)

    def _read(self, number: int) -> Photo:
        given = self.given[number]
        if isinstance(given, Photo):
            return given
        photo = read_image(given)
        check_pixels(photo.pixels, str(given))
        return photo

    def _name(self, number: int) -> str:
        given = self.given[number]
        return f"references[{number}]" if isinstance(given, Photo) else str(given)


def _pixels_of(photo: Photo) -> dict[int, int]:
    return {id(photo): photo.pixels.nbytes}


def _grey(photo: Photo) -> Photo:
    """Return the lightness of a photo."""
    if photo.pixels.ndim == 2:
        return photo
    pixels = photo.to_profile(None).pixels
    return Photo(from_unit(luma(to_unit(pixels)), pixels.dtype))


def _expanded(reference: Any) -> list[Any]:
    """Return the photos that a reference stands for: paths, or an image as it is."""
    if not isinstance(reference, (str, Path)):
        return [reference]
    path = Path(reference)
    try:
        found = sorted(map(Path, expand(path.as_posix())))
    except OSError as error:
        raise OptionError(
            f"references: {str(reference)!r} cannot be looked up ({error.strerror}); check the name"
        ) from error
    if not found and not path.is_dir() and not glob.has_magic(str(path)):
        return [path]  # whoever reads it says what is wrong
    if not found:
        raise OptionError(
            f"references: no photo found at {str(reference)!r}; expected a photo, a folder with some, or a "
            "pattern that fits some"
        )
    return found
