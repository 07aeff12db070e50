"""Photos as the command line gives them, and the faces in them."""

from __future__ import annotations

import re
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from relit.errors import ImageError, LandmarkError
from relit.photo.photo import Photo
from relit.photo.pixels import check_pixels
from relit.photo.reading import read_image

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.settings_file import Settings


def about(path: str, photo: Photo, found: Landmarks) -> dict[str, Any]:
    """Return the facts of a photo and its face."""
    height, width = photo.pixels.shape[:2]
    return {
        "path": path,
        "width": width,
        "height": height,
        "scheme": found.scheme,
        "confidence": found.confidence,
        "interocular_distance": found.interocular_distance,
    }


def read_photo(path: str) -> Photo:
    """Read a photo that may hold a face."""
    photo = read_image(path)
    check_pixels(photo.pixels, path)
    return photo


class Source(NamedTuple):
    """A photo as the command line gives it: its argument's name, path, and where its face is."""

    argument: str
    path: str
    landmarks: str | None
    face: int | None
    known: Landmarks | None = None

    @classmethod
    def of(cls, given: dict[str, Any], argument: str, path: str) -> Source:
        """Take the options of `options.face_options` for a photo out of those that a command was given."""
        return cls(argument, path, given.pop(f"{argument}_landmarks"), given.pop(f"{argument}_face"))

    @property
    def face_is_given(self) -> bool:
        """Whether an option says where the face is."""
        return self.landmarks is not None or self.face is not None

    @property
    def files(self) -> tuple[str | None, str | None]:
        """What is read, as far as it is given."""
        return self.path, self.landmarks

    def knowing(self, landmarks: Landmarks | None) -> Source:
        """Return the same with landmarks that count where no option says where the face is."""
        return self if self.face_is_given else self._replace(known=landmarks)

    @property
    def name(self) -> str:
        """What messages call the photo: by its file."""
        return f"{self.argument} from stdin" if self.path == "-" else self.path

    def face_in(self, photo: Photo) -> Landmarks:
        """Read the landmarks, or find them."""
        from relit.face.detect import detect_landmarks
        from relit.face.landmark_files import read_landmarks
        from relit.face.landmarks import check_inside

        try:
            found = self.known if self.landmarks is None else read_landmarks(self.landmarks, face=self.face)
            if found is None:
                return detect_landmarks(photo.pixels, face=self.face or 0, name=self.name)
        except LandmarkError as error:
            raise type(error)(self._with_own_flags(str(error))) from None
        where = self.landmarks or f"--config: landmarks of the {self.argument}"
        check_inside(found, photo.pixels.shape, where)
        return found

    def _with_own_flags(self, message: str) -> str:
        """Return what the library says of faces with the flags of this photo, where several have some."""
        prefix = "" if self.argument == "image" else f"{self.argument}-"
        advice = message.replace("--landmarks FILE", f"--{prefix}landmarks FILE")
        return re.sub(r"face=(\d+) to face=(\d+)$", rf"--{prefix}face \1 to \2", advice)


def sources_of(
    given: dict[str, Any], target: str, references: tuple[str, ...], saved: Settings, *, swap: bool
) -> list[Source]:
    """Return the target, then the references, each with the options that say where its face is."""
    landmarks, faces = given.pop("reference_landmarks"), given.pop("reference_face")
    for flag, values in (("landmarks", landmarks), ("face", faces)):
        if len(values) not in (0, len(references)):
            raise click.UsageError(
                f"--reference-{flag} was given {len(values)} times for {len(references)} photos; give it "
                "once for each, in their order, or not at all."
            )
    each = zip_longest(references, landmarks, faces)
    sources = [Source.of(given, "target", target), *(Source("reference", *one) for one in each)]
    sources[:2] = [source.knowing(getattr(saved, source.argument)) for source in sources[:2]]
    if swap and len(references) != 1:
        raise click.UsageError("--swap takes one REFERENCE.")
    return sources[::-1] if swap else sources


def read_mask(path: str) -> NDArray[Any]:
    """Return the lightness of a mask, which may have been saved with colours."""
    pixels = read_image(path).pixels
    if pixels.ndim == 2:
        return pixels
    if (pixels != pixels[..., :1]).any():
        raise ImageError(f"{path}: expected a grey picture as --region-mask, found colours; save it in grey")
    return pixels[..., 0].copy()


def find_faces(
    photos: list[tuple[Source, Photo]], *, all_faces: bool
) -> tuple[list[Landmarks], list[Landmarks]]:
    """Return the faces to relight in the target, which comes first, and the one in each reference."""
    from relit.face.detect import detect_faces
    from relit.runtime.threads import pool

    (ours, target), *references = photos
    faces = detect_faces(target.pixels, name=ours.name) if all_faces else []
    with pool(2) as at_once:  # looks at the target again where it has none, to say what to do then
        found = at_once(lambda pair: pair[0].face_in(pair[1]), references if faces else photos)
    return (faces, found) if faces else (found[:1], found[1:])
