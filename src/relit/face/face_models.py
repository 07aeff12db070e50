"""Three networks of MediaPipe, run by LiteRT: squares of a photo in; boxes, meshes and persons out.

The *detector* [1]_ looks at a square, 128 px a side, for boxes with a face; the *mesh* [2]_ places 478 points
in a square round a face, 256 px a side, and tells how sure it is that there is one (*presence*). The
*segmentation* [3]_ tells persons from what is behind.

References
----------
.. [1] V. Bazarevsky et al., "BlazeFace: sub-millisecond neural face detection on mobile GPUs", CVPR Workshop
       on Computer Vision for AR/VR, 2019.
.. [2] Y. Kartynnik et al., "Real-time facial surface geometry from monocular video on mobile GPUs", same
       workshop, 2019.
.. [3] T. Hou and T. Mullen, "Background features in Google Meet, powered by Web ML", Google AI Blog, 2020.
"""

from __future__ import annotations

import threading
from importlib import resources
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import cv2
import numpy as np
from PIL import Image

from relit.face.boxes import BOX_SIDE, decode_boxes, probability
from relit.runtime.muting import muted

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from contextlib import AbstractContextManager

    from numpy.typing import NDArray

_MESH_SIDE = 256

#: Px that the segmentation sees, and tells of.
PERSON_SIDE = 256


class Square(NamedTuple):
    """A turned square of the photo: centre and side in px, and angle in radians."""

    x: float
    y: float
    side: float
    angle: float = 0.0

    @property
    def turn(self) -> NDArray[np.float64]:
        """The rotation, a matrix to multiply ``(x, y)`` rows with, and (row, column) columns."""
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        return np.array([[cos, sin], [-sin, cos]])

    def to_photo(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) points of the unit square as ``(x, y)`` in the photo."""
        return np.asarray((points - 0.5) * self.side @ self.turn + (self.x, self.y))

    def scaled(self, factor: float) -> Square:
        """Return the same square of the photo enlarged; its corner, not its first pixel's centre, stays."""
        x, y = (self.x + 0.5) * factor - 0.5, (self.y + 0.5) * factor - 0.5
        return Square(x, y, self.side * factor, self.angle)


class Look(NamedTuple):
    """What the detector sees in a view: boxes and scores, as `decode_boxes` returns them."""

    view: Square
    boxes: NDArray[np.float64]
    scores: NDArray[np.float64]


def see_boxes(
    photo: Image.Image, view: Square, gammas: Sequence[float], least_score: float, turns: int = 1
) -> Iterator[Look]:
    """Run the detector on a view of an RGB photo, black beyond it; yield what `decode_boxes` returns.

    Once for each of so many turns, the view turned by a quarter more every time; and once for each gamma, to
    whose power the values in [0, 1] are taken before: below 1 brightens. It runs when the next is asked for.
    """
    crop = take_crop(photo, view, BOX_SIDE, "constant")
    crops = [2 * _brightened(crop, gamma) - 1 for gamma in gammas]
    for quarters in range(turns):
        turned = view._replace(angle=view.angle + quarters * np.pi / 2)
        for values in crops:
            regressors, scores = _run("face_detector.tflite", np.rot90(values, quarters))
            yield Look(turned, *decode_boxes(regressors, scores, least_score))


def see_mesh(
    photo: Image.Image, square: Square, gammas: Sequence[float]
) -> list[tuple[NDArray[np.float64], float]]:
    """Place the mesh in a square of an RGB photo; return its points, (478, 3), and the presence.

    Once for each gamma. The points are ``(x, y, z)`` in px of the photo, z at the scale of x.
    """
    crop = take_crop(photo, square, _MESH_SIDE, "nearest")
    seen = []
    for gamma in gammas:
        points, presence, _ = _run("face_landmarks_detector.tflite", _brightened(crop, gamma))
        unit = points.reshape(478, 3).astype(np.float64) / _MESH_SIDE
        placed = np.column_stack([square.to_photo(unit[:, :2]), unit[:, 2] * square.side])
        seen.append((placed, probability(presence.astype(np.float64)).item()))
    return seen


def see_person(photo: Image.Image, square: Square) -> NDArray[np.float32]:
    """Return how likely each of 256 by 256 px of a square of an RGB photo is of a person, in [0, 1]."""
    (likely,) = _run("selfie_segmentation.tflite", take_crop(photo, square, PERSON_SIDE, "nearest"))
    return likely[0, :, :, 0]


def take_crop(
    photo: Image.Image, square: Square, size: int, outside: Literal["constant", "nearest"]
) -> NDArray[np.float32]:
    """Return the square, sampled at size x size px, in [0, 1]; averaged first where that shrinks it."""
    step = square.side / size
    factor = max(int(step), 1)
    corners = square.to_photo(np.array([[0.0, 0], [0, 1], [1, 0], [1, 1]]))
    limits = np.array(photo.size)
    low = np.clip(np.floor(corners.min(axis=0)).astype(int) - factor, 0, limits - 1)
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + factor + 1, low + 1, limits)
    part = np.asarray(photo.reduce(factor, box=(*low.tolist(), *high.tolist())), np.float32)
    # Pixel (0, 0) of the part has its centre here, in px of the photo.
    origin = low + (factor - 1) / 2
    first = (square.to_photo(np.array([[0.5, 0.5]]) / size)[0] - origin) / factor
    turn = square.turn.T * step / factor  # (x, y) of the crop to (x, y) of the part
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    crop = cv2.warpAffine(
        part, np.column_stack([turn, first]), (size, size), flags=how, borderMode=cv2.BORDER_REPLICATE
    )
    if outside == "constant":
        axis = np.arange(size)
        for rows, offset, last in zip(turn, first, np.array(part.shape[1::-1]) - 1, strict=True):
            place = rows[0] * axis + (rows[1] * axis + offset)[:, None]
            crop[(place < 0) | (place > last)] = 0
    return np.asarray(crop / np.float32(255), np.float32)


def _brightened(crop: NDArray[np.float32], gamma: float) -> NDArray[np.float32]:
    return np.asarray(cv2.pow(crop, gamma), np.float32)  # a fifth of the time of NumPy's power


_local = threading.local()
_ANNOUNCEMENT = b"INFO: Created TensorFlow Lite XNNPACK delegate for CPU."


def _run(model: str, crop: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """Run a model on one crop; every thread has interpreters of its own, which are not thread-safe."""
    if model not in _local.__dict__:
        _local.__dict__[model] = _load(model)
    interpreter = _local.__dict__[model]
    interpreter.set_tensor(interpreter.get_input_details()[0]["index"], crop[None].astype(np.float32))
    interpreter.invoke()
    return [interpreter.get_tensor(output["index"]) for output in interpreter.get_output_details()]


def _load(model: str) -> Any:
    from ai_edge_litert.interpreter import Interpreter

    content = resources.files("relit.face").joinpath("models", model).read_bytes()
    with _unannounced():
        # One thread, for the same bits everywhere.
        interpreter = Interpreter(model_content=content, num_threads=1)
        interpreter.allocate_tensors()
    return interpreter


def _unannounced() -> AbstractContextManager[None]:
    """Keep from stderr that XNNPACK is at work."""
    return muted(lambda line: line.strip() == _ANNOUNCEMENT)
