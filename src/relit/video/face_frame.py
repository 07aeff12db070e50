"""A frame that moves with the face: the same place of it is in the same place of the frame at any time.

Where the face is, how it is turned in the picture and how large it is, a similarity tells; what of it moves
besides, as a head that turns or a mouth that opens, a thin-plate spline through landmarks, level round the
head. Landmarks are smoothed in this frame: how the face lies over a shorter time than what shape it has.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from relit.compose.person_matte import corners_round
from relit.face.landmarks import Landmarks, control_rows
from relit.photo.filters import at_places
from relit.photo.resampling import Enlarger
from relit.warp.rbf import fit_rbf
from relit.warp.similarity import Similarity, fit_similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.video.tracking import Track

#: Px that the eyes are apart in the frame: a change of light has no detail finer than that.
IOD = 40.0
_STEP = 8  # px between the places where a map is worked out
_EVERY = 3  # of the rows that align faces, those that bend the map
_SLACK = 1.0  # smoothing of the spline, in px of the frame: landmarks are no more exact
_SAMPLES = 64  # frames whose mean is the face of the frame
_ROUNDS = 3  # of the fixed point by which a map is inverted; the first is off by some px, the last by none


@dataclass(frozen=True, eq=False)
class FaceFrame:
    """The frame of a face.

    Attributes
    ----------
    template : (478, 3) float64 array
        The mean face, upright, its eyes `IOD` px apart, in px of the frame.
    size : (int, int)
        Width and height in px.
    """

    template: NDArray[np.float64]
    size: tuple[int, int]

    @classmethod
    def of(cls, track: Track) -> FaceFrame:
        """Return the frame of a face that was tracked."""
        known = np.flatnonzero(track.presence > 0)
        some = known[np.linspace(0, len(known) - 1, min(len(known), _SAMPLES)).round().astype(int)]
        first = np.asarray(track.points[some[0]], np.float64)
        eyes = Landmarks(first).eyes
        assert eyes is not None
        upright = fit_similarity(eyes[:, :2], np.array([[-IOD / 2, 0], [IOD / 2, 0]]))
        mean = moved(upright, first)
        for _ in range(2):  # once to the first face, once to the mean
            faces = [np.asarray(track.points[k], np.float64) for k in some]
            mean = np.mean([moved(fit_similarity(one[:, :2], mean[:, :2]), one) for one in faces], axis=0)
        corners = corners_round(Landmarks(mean))
        low = np.floor(corners.min(axis=0))
        width, height = (-(-(np.ceil(corners.max(axis=0)) - low).astype(int) // _STEP) * _STEP).tolist()
        mean[:, :2] -= low
        return cls(mean, (width, height))

    @cached_property
    def _rows(self) -> NDArray[np.intp]:
        return control_rows(Landmarks(self.template))[::_EVERY]

    @cached_property
    def _bend(self) -> NDArray[np.float32]:
        """What each control point's move does at each node of a grid, (nodes, points)."""
        points = self.template[self._rows, :2]
        width, height = self.size
        edge = np.linspace(0, 1, 7)
        ring = np.array([(x, y) for x in edge for y in edge if x in (0, 1) or y in (0, 1)]) * (width, height)
        unit = np.vstack([np.eye(len(points)), np.zeros((len(ring), len(points)))])
        spline = fit_rbf(np.vstack([points, ring]), unit, smoothing=_SLACK)
        xs, ys = (np.arange(size // _STEP) * _STEP + (_STEP - 1) / 2 for size in self.size)
        nodes = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
        return np.asarray(spline(nodes), np.float32)

    def placed(self, points: NDArray[np.float64]) -> Placed:
        """Return how the frame lies over a picture in which the face has these landmarks."""
        lying = fit_similarity(self.template[:, :2], points[:, :2])
        shape = moved(inverse(lying), points)
        away = (shape - self.template)[self._rows, :2].astype(np.float32)
        width, height = self.size
        # einsum: a product of matrices may round otherwise where there are more threads.
        nodes = np.einsum("ij,jk->ik", self._bend, away).reshape(height // _STEP, width // _STEP, 2)
        return Placed(self, lying, Enlarger(nodes, _STEP, (height, width)).rows(0, height))


@dataclass(frozen=True, eq=False)
class Placed:
    """The frame of a face as it lies over a picture; `bend` is how far each px of it is moved, in its px."""

    frame: FaceFrame
    lying: Similarity
    bend: NDArray[np.float32]

    def taken(self, planes: NDArray[np.float32], factor: int, corner: tuple[int, int]) -> NDArray[np.float32]:
        """Return planes of a picture, reduced by a factor from a corner (x, y) on, in the face's frame."""
        width, height = self.frame.size
        grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1) + np.float64(self.bend)
        places = self.lying(grid.reshape(-1, 2)).reshape(height, width, 2)
        places = (places - corner + 0.5) / factor - 0.5
        return _sampled(planes, places)

    def laid(
        self, planes: NDArray[np.float32], size: tuple[int, int], factor: int, corner: tuple[int, int]
    ) -> NDArray[np.float32]:
        """Return planes of the face's frame over a picture of so many rows and columns; undoes `taken`."""
        rows, columns = (-(-one // _STEP) for one in size)
        xs, ys = (np.arange(count) * _STEP + (_STEP - 1) / 2 for count in (columns, rows))
        nodes = (np.stack(np.meshgrid(xs, ys), axis=-1) + 0.5) * factor - 0.5 + corner
        flat = inverse(self.lying)(nodes.reshape(-1, 2)).reshape(rows, columns, 2).astype(np.float32)
        places = flat
        for _ in range(_ROUNDS):
            places = flat - _sampled(self.bend, places)
        return _sampled(planes, Enlarger(places, _STEP, size).rows(0, size[0]))


def _sampled(planes: NDArray[np.float32], places: NDArray[np.floating]) -> NDArray[np.float32]:
    return at_places(planes, places[..., 0], places[..., 1])


def inverse(similarity: Similarity) -> Similarity:
    """Return the similarity that undoes another."""
    linear = np.asarray(np.linalg.inv(similarity.linear), np.float64)
    return Similarity(linear, -linear @ similarity.shift)


def moved(similarity: Similarity, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) points moved, their depth at the scale of the rest."""
    return np.column_stack([similarity(points[:, :2]), points[:, 2] * similarity.scale])
