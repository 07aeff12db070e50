"""Find faces and their 478 landmarks in photos.

The networks of `face_models` look at the photo and at a brightened version of it, since they were trained on
well-lit faces, and the surer answer counts.

What is tried, until something finds a face: the whole photo, alone, with a margin (for tight crops) and,
unless one upright face is plainly alone, in quarter turns (for photos on their side or head); a centred
square without the detector, for crops so tight that no box fits; tiles of a half and a quarter of the photo's
size, for small faces.
"""

from __future__ import annotations

from itertools import chain, islice
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from PIL import Image

from relit.errors import FaceNotFoundError
from relit.face.boxes import merged
from relit.face.face_models import Square, see_boxes, see_mesh
from relit.face.landmarks import Landmarks
from relit.photo.foreign_images import pixels_of
from relit.photo.pixels import check_pixels, from_unit, to_unit
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from relit.face.face_models import Look
    from relit.photo.foreign_images import AnyImage

#: The least presence that counts as a face. A cat reaches 0.03, a face in profile beyond 75° less than 0.06.
LEAST_PRESENCE = 0.5

# Tiles and turns are many, and so are chances to see a face in a spoon: they must be surer. A face in the
# turn nearest to upright scores above 0.8; upside down it scores less, though the mesh may be sure of itself.
_LEAST_SCORE, _LEAST_SCORE_ELSEWHERE, _UPRIGHT = 0.5, 0.7, 0.8
# Of 199 turned faces that were found beside an upright one, in 600 photos pasted together, all have 0.08 and
# more in the upright looks; a backdrop has less than 0.05.
_FAINT = 0.05
_GAMMAS = (1.0, 0.45)
_AROUND = 1.5  # side of the mesh's square over that of the face's box
_MARGIN = 1.5  # side of the view that gives a tight crop some room, over the photo's longer side
_OVERVIEW = 1024  # px to look for boxes in, enough for tiles of a quarter; the mesh sees the photo's own
_EYE_CORNERS = (33, 263)  # rows of the mesh

_Found = TypeVar("_Found")


def detect_landmarks(image: AnyImage, *, face: int = 0, name: str = "image") -> Landmarks:
    """Return the landmarks of one face.

    Parameters
    ----------
    image : array, Photo, PIL image, torch tensor, or path
        Grey or sRGB, as of `relit.transfer`.
    face : int
        Which face, 0 for the largest.
    name : str
        The image's name, for messages.

    Returns
    -------
    Landmarks
        Of scheme ``mesh478``, ``(478, 3)``, in px; z grows away from the camera, at the scale of x. Its
        `confidence` is the presence.

    Raises
    ------
    ImageError
        If the image is not a photo's pixels.
    FaceNotFoundError
        If there is no face, or not that many.

    Examples
    --------
    >>> detect_landmarks(np.zeros((64, 64), np.uint8), name="target")
    Traceback (most recent call last):
        ...
    relit.errors.FaceNotFoundError: target: no face found; use a photo with a larger, upright face turned \
no more than 75°, or place landmarks by hand (in relit studio, or --target-landmarks FILE)
    """
    found = detect_faces(image, name=name)
    if not found:
        option = f"--{name}-landmarks FILE" if name in ("target", "reference") else "--landmarks FILE"
        raise FaceNotFoundError(
            f"{name}: no face found; use a photo with a larger, upright face turned no more than 75°, or "
            f"place landmarks by hand (in relit studio, or {option})"
        )
    if not 0 <= face < len(found):
        raise FaceNotFoundError(
            f"{name}: there is no face {face}; {len(found)} found, counted from 0, the largest first"
        )
    return found[face]


def detect_faces(image: AnyImage, *, name: str = "image") -> list[Landmarks]:
    """Return the landmarks of all faces found, the largest first; none where there is no face.

    A photo in which the whole view finds a face is not searched for smaller ones in tiles.

    Parameters
    ----------
    image, name
        As of `detect_landmarks`.

    Raises
    ------
    ImageError
        If the image is not a photo's pixels.
    """
    pixels = check_pixels(pixels_of(image, name), name)
    return list(faces_in(pixels if pixels.dtype == np.uint8 else _in_bytes(pixels)))


def _in_bytes(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """Return pixels at 8 bits, made row by row: the whole in floating point takes four times as much."""
    made = np.empty(pixels.shape, np.uint8)
    for row, values in zip(made, pixels, strict=True):
        row[:] = from_unit(to_unit(values), np.uint8)
    return made


@remembered
def faces_in(pixels: NDArray[np.uint8]) -> tuple[Landmarks, ...]:
    """Return what `detect_faces` does, by pixels of 8 bits alone, so that it can be remembered."""
    photo = Image.fromarray(pixels)
    if photo.mode != "RGB":  # of one that is, it would be a copy
        photo = photo.convert("RGB")
    factor = max(max(photo.size) // _OVERVIEW, 1)
    for squares in _views(photo.reduce(factor)):
        fits = [fit for square in squares if (fit := _fit(photo, square.scaled(factor)))]
        if fits:
            faces = _distinct([(face.confidence or 0, square_round(face.points), face) for face in fits])
            return tuple(sorted(faces, key=lambda face: -face.interocular_distance))
    return ()


def _views(photo: Image.Image) -> Iterator[list[Square]]:
    """Yield lists of squares that may hold a face, the most promising first."""
    width, height = photo.size
    middle, longest = ((width - 1) / 2, (height - 1) / 2), max(width, height)
    looks = see_boxes(photo, Square(*middle, longest), _GAMMAS, _FAINT, turns=4)
    upright = [*islice(looks, len(_GAMMAS))]
    upright += see_boxes(photo, Square(*middle, _MARGIN * longest), _GAMMAS, _FAINT)
    seen = _seen(upright, _LEAST_SCORE)
    if not _one_alone(seen, upright):
        seen += _seen(looks, _LEAST_SCORE_ELSEWHERE)
    yield _distinct(seen)
    # As if a face filled the photo.
    yield [Square(*middle, _AROUND * min(width, height))]
    for parts in (2, 4):
        side = longest / parts
        # Half a tile apart, so that a face cut by one tile is whole in another.
        across, down = (
            np.linspace(side / 2, max(size - side / 2, side / 2), max(int(np.ceil(2 * size / side)) - 1, 1))
            for size in (width, height)
        )
        tiles = [Square(x, y, side) for y in down for x in across]
        least = _LEAST_SCORE_ELSEWHERE
        looks = chain.from_iterable(see_boxes(photo, tile, _GAMMAS, least) for tile in tiles)
        yield _distinct(_seen(looks, least))


def _seen(looks: Iterable[Look], least_score: float) -> list[tuple[float, Square, Square]]:
    """Return the squares round the faces that the detector sees: score, where it is, and itself."""
    seen = []
    for view, boxes, scores in looks:
        sure = scores >= least_score
        faces, best = merged(boxes[sure], scores[sure])
        for box, score in zip(faces, best.tolist(), strict=True):
            (x, y), right, left = (view.to_photo(point[None])[0] for point in (box[0], box[2], box[3]))
            square = Square(x, y, _AROUND * view.side * float(box[1].max()), _angle(right, left))
            seen.append((score, square, square))
    return seen


def _one_alone(seen: list[tuple[float, Square, Square]], looks: list[Look]) -> bool:
    """Whether one upright face is in the looks, no larger than they are, and no turned one beside it.

    Upright, a turned face is faintly like a face, too; so there is none where all that is like one is in the
    same place.
    """
    score, face, _ = max(seen, default=(0.0, Square(0, 0, 0), None), key=lambda entry: entry[0])
    width = face.side / _AROUND
    return (
        score >= _UPRIGHT
        and width < min(view.side for view, _, _ in looks)
        and all(
            np.all(np.abs(view.to_photo(boxes[:, 0]) - (face.x, face.y)) < width / 2)
            for view, boxes, _ in looks
        )
    )


def _fit(photo: Image.Image, square: Square) -> Landmarks | None:
    """Place the mesh, once more in a square that fits it, and return it if it is a face."""
    looks = zip(_GAMMAS, see_mesh(photo, square, _GAMMAS), strict=True)
    gamma, (points, presence) = max(looks, key=lambda look: look[1][1])
    # A weak first look in a poor square may become a sure one in a good square; a hopeless one does not.
    if presence < LEAST_PRESENCE / 10:
        return None
    ((points, presence),) = see_mesh(photo, square_round(points), (gamma,))
    return Landmarks(points, "mesh478", presence) if presence >= LEAST_PRESENCE else None


def square_round(points: NDArray[np.float64]) -> Square:
    """Return the square to look for a known mesh in: upright to the eyes, 1.5 times as large as the face."""
    angle = _angle(*points[[*_EYE_CORNERS], :2])
    upright = Square(0.0, 0.0, 1.0, -angle).to_photo(points[:, :2] + 0.5)
    low, high = upright.min(axis=0), upright.max(axis=0)
    x, y = Square(0.0, 0.0, 1.0, angle).to_photo((low + high)[None] / 2 + 0.5)[0]
    return Square(x, y, _AROUND * float((high - low).max()), angle)


def _angle(right: NDArray[np.float64], left: NDArray[np.float64]) -> float:
    """Return how far a face is turned in the plane of the photo, in radians, by its two eyes."""
    return float(np.arctan2(left[1] - right[1], left[0] - right[0]))


def _distinct(found: list[tuple[float, Square, _Found]]) -> list[_Found]:
    """Return what was found once for each face: of those in the same place, the one of the best score."""
    kept: list[tuple[Square, _Found]] = []
    for _, square, thing in sorted(found, key=lambda entry: -entry[0]):
        if not any(_same_place(square, other) for other, _ in kept):
            kept.append((square, thing))
    return [thing for _, thing in kept]


def _same_place(one: Square, other: Square) -> bool:
    """Whether two squares are round the same face: the middle of the smaller is in the face of the larger.

    Intersection over union would keep the faces that the networks see within a face, in an eye or a mouth.
    """
    away = max(abs(one.x - other.x), abs(one.y - other.y))
    return away < max(one.side, other.side) / _AROUND / 2
