"""Find faces and their 478 landmarks, with MediaPipe's FaceMesh models run by LiteRT.

Two small networks work in turn. The *detector* [1]_ looks at a square of the photo, 128 px a side, for boxes
with a face; the *mesh* [2]_ places 478 points in a square round a face, 256 px a side, and tells how sure it
is that there is one (*presence*). Both look at the photo and at a brightened version of it, since they were
trained on well-lit faces, and the surer answer counts.

What is tried, until something finds a face: the whole photo; a centred square without the detector, for crops
so tight that no box fits; tiles of a half and a quarter of the photo's size, for small faces.

References
----------
.. [1] V. Bazarevsky et al., "BlazeFace: sub-millisecond neural face detection on mobile GPUs", CVPR Workshop
       on Computer Vision for AR/VR, 2019.
.. [2] Y. Kartynnik et al., "Real-time facial surface geometry from monocular video on mobile GPUs", same
       workshop, 2019.
"""

from __future__ import annotations

import threading
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from PIL import Image
from scipy.ndimage import affine_transform
from scipy.special import expit

from relit.errors import FaceNotFoundError
from relit.landmarks import Landmarks
from relit.pixels import check_pixels, from_unit, to_unit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

#: The least presence that counts as a face. A cat reaches 0.03, a face in profile beyond 75° less than 0.06.
LEAST_PRESENCE = 0.5

# Tiles are many, and so are chances to see a face in a spoon: they must be surer.
_LEAST_SCORE, _LEAST_SCORE_IN_TILES = 0.5, 0.7
_SURE_PRESENCE = 0.99  # from which on no other look at the same face is worth its time
_LEAST_OVERLAP = 0.3  # intersection over union, above which two boxes are one face
_GAMMAS = (1.0, 0.45)
_BOX_SIDE, _MESH_SIDE = 128, 256
_AROUND = 1.5  # side of the mesh's square over that of the face's box
_PADDED = 1.5  # side of a view with a margin round the photo, for faces that fill it, over the longer side
_CENTRED = 1.4  # side of the square that stands in for a detected one, over the photo's shorter side
_EYE_CORNERS = (33, 263)


class Square(NamedTuple):
    """A turned square of the photo: centre and side in px, and angle in radians."""

    x: float
    y: float
    side: float
    angle: float = 0.0

    def to_photo(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) points of the unit square as ``(x, y)`` in the photo."""
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        turn = np.array([[cos, sin], [-sin, cos]])
        return np.asarray((points - 0.5) * self.side @ turn + (self.x, self.y))


def detect_landmarks(image: NDArray[Any], *, face: int = 0, name: str = "image") -> Landmarks:
    """Return the landmarks of one face.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        Grey or sRGB: uint8, uint16, or float in [0, 1].
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
    >>> import numpy as np
    >>> detect_landmarks(np.zeros((64, 64), np.uint8), name="target")
    Traceback (most recent call last):
        ...
    relit.errors.FaceNotFoundError: target: no face found; use a photo with a larger, upright face turned \
no more than 75°, or give landmarks placed by hand (--target-landmarks FILE)
    """
    found = detect_faces(image, name=name)
    if not found:
        option = f"--{name}-landmarks FILE" if name in ("target", "reference") else "--landmarks FILE"
        raise FaceNotFoundError(
            f"{name}: no face found; use a photo with a larger, upright face turned no more than 75°, or "
            f"give landmarks placed by hand ({option})"
        )
    if not 0 <= face < len(found):
        raise FaceNotFoundError(
            f"{name}: there is no face {face}; {len(found)} found, counted from 0, the largest first"
        )
    return found[face]


def detect_faces(image: NDArray[Any], *, name: str = "image") -> list[Landmarks]:
    """Return the landmarks of all faces found, the largest first.

    A photo in which the whole view finds a face is not searched for smaller ones in tiles.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        Grey or sRGB: uint8, uint16, or float in [0, 1].
    name : str
        The image's name, for messages.

    Returns
    -------
    list of Landmarks
        As of `detect_landmarks`; empty where there is no face.

    Raises
    ------
    ImageError
        If the image is not a photo's pixels.
    """
    check_pixels(image, name)
    pixels = image if image.dtype == np.uint8 else from_unit(to_unit(image), np.uint8)
    photo = Image.fromarray(pixels).convert("RGB")
    for squares in _views(photo):
        if faces := _distinct(_fit_all(photo, squares)):
            return sorted(faces, key=lambda face: -face.interocular_distance)
    return []


def _fit_all(photo: Image.Image, squares: list[Square]) -> list[Landmarks]:
    """Fit the mesh in every square, but for those in the middle of a face that is sure already."""
    found: list[Landmarks] = []
    for square in squares:
        if not any(_is_sure_at(face, square) for face in found):
            found += [face for gamma in _GAMMAS if (face := _fit(photo, square, gamma))]
    return found


def _is_sure_at(face: Landmarks, square: Square) -> bool:
    low, high = face.xy.min(axis=0), face.xy.max(axis=0)
    holds = (low < square[:2]).all() and (square[:2] < high).all()
    return bool(holds) and (face.confidence or 0) >= _SURE_PRESENCE


def _views(photo: Image.Image) -> Iterator[list[Square]]:
    """Yield lists of squares that may hold a face, the most promising first."""
    width, height = photo.size
    middle, longest = ((width - 1) / 2, (height - 1) / 2), max(width, height)
    yield _boxes(photo, [Square(*middle, longest), Square(*middle, _PADDED * longest)], _LEAST_SCORE)
    yield [Square(*middle, _CENTRED * min(width, height))]
    for parts in (2, 4):
        side = longest / parts
        # Half a tile apart, so that a face cut by one tile is whole in another.
        places = [
            np.linspace(side / 2, max(size - side / 2, side / 2), max(int(np.ceil(2 * size / side)) - 1, 1))
            for size in (width, height)
        ]
        tiles = [Square(x, y, side) for y in places[1] for x in places[0]]
        yield _boxes(photo, tiles, _LEAST_SCORE_IN_TILES)


def _boxes(photo: Image.Image, views: list[Square], least_score: float) -> list[Square]:
    """Return the squares round the faces that the detector sees in any of the views."""
    squares = []
    for view in views:
        crop = _crop(photo, view, _BOX_SIDE, "constant")
        for gamma in _GAMMAS:
            regressors, scores = _run("face_detector.tflite", 2 * crop**gamma - 1)
            for box in decode_boxes(regressors, scores, least_score):
                (x, y), right, left = (view.to_photo(point[None])[0] for point in (box[0], box[2], box[3]))
                angle = float(np.arctan2(left[1] - right[1], left[0] - right[0]))
                squares.append(Square(x, y, _AROUND * view.side * box[1].max(), angle))
    return squares


def decode_boxes(
    regressors: NDArray[np.float32], scores: NDArray[np.float32], least_score: float = _LEAST_SCORE
) -> NDArray[np.float64]:
    """Turn the detector's output into boxes, and merge those that overlap, weighted by their scores.

    Parameters
    ----------
    regressors : (1, 896, 16) array
        Per anchor, in px of its 128 px input: centre, size, and six keypoints, centre and keypoints from the
        anchor.
    scores : (1, 896, 1) array
        Logits.
    least_score : float
        Probability from which on a box counts.

    Returns
    -------
    (n, 8, 2) array
        Per face, the best first: centre, size, right eye, left eye and four more keypoints, in [0, 1].
    """
    boxes = regressors.reshape(-1, 8, 2).astype(np.float64) / _BOX_SIDE
    boxes[:, [0, 2, 3, 4, 5, 6, 7]] += anchors()[:, None]
    chance = expit(scores.ravel().astype(np.float64))
    order = np.argsort(-chance, kind="stable")
    order = order[chance[order] >= least_score]
    boxes, chance = boxes[order], chance[order]
    merged = []
    while len(boxes):
        same = overlap(boxes[0], boxes) > _LEAST_OVERLAP
        same[0] = True
        merged.append(np.average(boxes[same], axis=0, weights=chance[same]))
        boxes, chance = boxes[~same], chance[~same]
    return np.array(merged).reshape(-1, 8, 2)


@cache
def anchors() -> NDArray[np.float64]:
    """Return the centres, (896, 2) in [0, 1], from which the detector's outputs count.

    Two anchors for every cell of 8 px, then six for every cell of 16 px, row by row.
    """
    grids = []
    for stride, count in ((8, 2), (16, 6)):
        axis = (np.arange(_BOX_SIDE // stride) + 0.5) * stride / _BOX_SIDE
        cells = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        grids.append(np.repeat(cells, count, axis=0))
    return np.concatenate(grids)


def overlap(box: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return intersection over union of a box with others; row 0 is the centre, row 1 the size."""
    low = np.maximum(box[0] - box[1] / 2, others[:, 0] - others[:, 1] / 2)
    high = np.minimum(box[0] + box[1] / 2, others[:, 0] + others[:, 1] / 2)
    common = np.clip(high - low, 0, None).prod(axis=-1)
    union = np.asarray(box[1].prod() + others[:, 1].prod(axis=-1) - common, np.float64)
    shares = np.zeros_like(union)
    np.divide(common, union, out=shares, where=union > 0)
    return shares


def _fit(photo: Image.Image, square: Square, gamma: float) -> Landmarks | None:
    """Place the mesh, once more in a square that fits it, and return it if it is a face."""
    points, presence = _mesh(photo, square, gamma)
    # A weak first look in a poor square may become a sure one in a good square; a hopeless one does not.
    if presence < LEAST_PRESENCE / 10:
        return None
    again, second = _mesh(photo, _square_round(points), gamma)
    if second >= min(presence, LEAST_PRESENCE):
        points, presence = again, second
    return Landmarks(points, "mesh478", presence) if presence >= LEAST_PRESENCE else None


def _mesh(photo: Image.Image, square: Square, gamma: float) -> tuple[NDArray[np.float64], float]:
    points, presence, _ = _run(
        "face_landmarks_detector.tflite", _crop(photo, square, _MESH_SIDE, "nearest") ** gamma
    )
    unit = points.reshape(478, 3).astype(np.float64) / _MESH_SIDE
    placed = np.column_stack([square.to_photo(unit[:, :2]), unit[:, 2] * square.side])
    return placed, float(expit(np.float64(presence.item())))


def _square_round(points: NDArray[np.float64]) -> Square:
    """Return the square to look for a known mesh in: upright to the eyes, 1.5 times as large as the face."""
    right, left = points[list(_EYE_CORNERS), :2]
    angle = float(np.arctan2(left[1] - right[1], left[0] - right[0]))
    upright = Square(0.0, 0.0, 1.0, -angle).to_photo(points[:, :2] + 0.5)
    low, high = upright.min(axis=0), upright.max(axis=0)
    x, y = Square(0.0, 0.0, 1.0, angle).to_photo((low + high)[None] / 2 + 0.5)[0]
    return Square(x, y, _AROUND * float((high - low).max()), angle)


def _distinct(faces: list[Landmarks]) -> list[Landmarks]:
    """Return each face once, with its surest mesh."""
    kept: list[Landmarks] = []
    boxes: list[NDArray[np.float64]] = []
    for face in sorted(faces, key=lambda face: -(face.confidence or 0)):
        low, high = face.xy.min(axis=0), face.xy.max(axis=0)
        box = np.array([(low + high) / 2, high - low])
        if not boxes or (overlap(box, np.array(boxes)) <= _LEAST_OVERLAP).all():
            kept.append(face)
            boxes.append(box)
    return [face for face, box in zip(kept, boxes, strict=True) if not _is_inside(box, boxes)]


def _is_inside(box: NDArray[np.float64], others: list[NDArray[np.float64]]) -> bool:
    """Tell whether the centre of a box lies in a larger one: a face seen in a mouth or a cheek."""
    return any(
        other[1].prod() > box[1].prod() and bool((2 * np.abs(box[0] - other[0]) < other[1]).all())
        for other in others
    )


def _crop(
    photo: Image.Image, square: Square, size: int, outside: Literal["constant", "nearest"]
) -> NDArray[np.float32]:
    """Return the square, sampled at size x size px, in [0, 1]; averaged first where that shrinks it."""
    step = square.side / size
    factor = max(int(step), 1)
    corners = square.to_photo(np.array([[0.0, 0], [0, 1], [1, 0], [1, 1]]))
    limits = np.array(photo.size)
    low = np.clip(np.floor(corners.min(axis=0)).astype(int) - factor, 0, limits - 1)
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + factor + 1, low + 1, limits)
    part = np.asarray(photo.reduce(factor, box=(*low.tolist(), *high.tolist())), np.float32) / 255
    # Pixel (0, 0) of the part has its centre here, in px of the photo.
    origin = low + (factor - 1) / 2
    first = (square.to_photo(np.array([[0.5, 0.5]]) / size)[0] - origin) / factor
    cos, sin = np.cos(square.angle) * step / factor, np.sin(square.angle) * step / factor
    turn = np.array([[cos, sin], [-sin, cos]])  # (row, column) of the crop to (row, column) of the part
    shape = (size, size)
    planes = [
        affine_transform(part[..., k], turn, first[::-1], shape, output=np.float32, order=1, mode=outside)
        for k in range(3)
    ]
    return np.stack(planes, axis=-1)


_local = threading.local()


def _run(model: str, crop: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """Run a model on one crop; every thread has interpreters of its own, which are not thread-safe."""
    interpreters: dict[str, Any] = _local.__dict__.setdefault("interpreters", {})
    if model not in interpreters:
        interpreters[model] = _load(model)
    interpreter = interpreters[model]
    interpreter.set_tensor(interpreter.get_input_details()[0]["index"], crop[None].astype(np.float32))
    interpreter.invoke()
    return [interpreter.get_tensor(output["index"]) for output in interpreter.get_output_details()]


def _load(model: str) -> Any:
    from ai_edge_litert.interpreter import Interpreter, OpResolverType

    content = resources.files("relit").joinpath("models", model).read_bytes()
    # One thread, for the same bits everywhere; no default delegate, which announces itself on stderr.
    interpreter = Interpreter(
        model_content=content,
        num_threads=1,
        experimental_op_resolver_type=OpResolverType.BUILTIN_WITHOUT_DEFAULT_DELEGATES,
    )
    interpreter.allocate_tensors()
    return interpreter
