"""A face on a pixel grid: its size, its axis, and where it and its parts are, drawn from the landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from relit.errors import LandmarkError
from relit.face.hull import convex_hull
from relit.face.landmarks import Landmarks
from relit.face.outline import IN_PAIRS, across, drawn, face_outline, feature_hulls
from relit.photo.curves import soft_step
from relit.photo.filters import distance_from, gaussian

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Width of a face's soft edge, inside its outline, in interocular distances.
FEATHER = 0.3

#: Brows, eyes and mouth, in which two persons differ most, and which are no skin.
FEATURES = ("brows", "eyes", "mouth")

# What each of these is worth: docs/leaderboard.md, The constants.
_TAIL = 2.5  # standard deviations of the blur from the middle of the soft edge to its ends
_SOFT_EDGE, _PART_MARGIN = 0.08, 0.12  # of the parts of a face, in interocular distances
_SKIN_MARGIN = 0.12  # interocular distances from the outline to where a face is mostly skin
_OVERHANG, _CHEEK_EDGE = 0.12, 0.03  # interocular distances that a mesh may overhang a cheek; a soft edge


@dataclass(frozen=True, eq=False)
class FaceRegions:
    """Where a face and its parts are on a pixel grid; each is worked out once, when it is first asked for.

    Attributes
    ----------
    landmarks : Landmarks
    shape : (int, int)
        Height and width of the grid.
    """

    landmarks: Landmarks
    shape: tuple[int, int]

    @cached_property
    def interocular_distance(self) -> float:
        """Distance of the two eye centres in px: the face's scale."""
        return self.landmarks.interocular_distance

    @cached_property
    def across(self) -> NDArray[np.float64]:
        """The unit vector ``(x, y)`` from the right eye to the left one, and along x where no eyes tell."""
        return across(self.landmarks)

    @property
    def up(self) -> NDArray[np.float64]:
        """The unit vector ``(x, y)`` up the face."""
        return np.array([self.across[1], -self.across[0]])

    @cached_property
    def height(self) -> NDArray[np.float32]:
        """How far each pixel lies above the chin, in px up the face: below it, negative."""
        rows, columns = (np.arange(size, dtype=np.float32) for size in self.shape)
        up = self.up.astype(np.float32)
        along = columns * up[0] + (rows * up[1])[:, None]
        return np.asarray(along - np.float32((self.outline @ self.up).min()), np.float32)

    @cached_property
    def outline(self) -> NDArray[np.float64]:
        """The polygon round the face, (m, 2) in px."""
        return face_outline(self.landmarks)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Where the face is, as its outline goes."""
        return drawn([self.outline], self.shape)

    @cached_property
    def distance(self) -> NDArray[np.float32]:
        """How far it is to what is not the face, in px: 0 outside the outline."""
        return distance_from(~self.inside)

    @cached_property
    def features(self) -> NDArray[np.bool_]:
        """Where brows, eyes and mouth are."""
        return self.hulls(FEATURES)

    @cached_property
    def skin_area(self) -> NDArray[np.bool_]:
        """The part of the face that is mostly skin; all of it, if nothing else is left."""
        area = (self.distance > _SKIN_MARGIN * self.interocular_distance) & ~self.features
        return area if area.any() else self.inside

    @cached_property
    def below_brows(self) -> NDArray[np.float32]:
        """Where there is face for sure, whatever it looks like: from the brows down to the chin, 0 to 1."""
        groups = self.landmarks.groups
        if "brows" not in groups:
            return self.inside.astype(np.float32)
        brows = self.landmarks.xy[list(groups["brows"])]
        below = self.outline[self.outline @ self.up <= (brows @ self.up).max()]
        points = np.vstack([below, brows])
        mask = drawn([convex_hull(points)], self.shape)
        inner = distance_from(~mask) > _OVERHANG * self.interocular_distance
        return gaussian(inner, _CHEEK_EDGE * self.interocular_distance)

    @cached_property
    def interior(self) -> NDArray[np.bool_]:
        """The face without the outer half of its soft edge; the whole grid, where nothing of it is there."""
        inner = self.mask() > 0.5
        return inner if inner.any() else np.ones_like(inner)

    def hulls(self, names: tuple[str, ...]) -> NDArray[np.bool_]:
        """Return where features are, as the convex hulls of their landmarks go."""
        return drawn(feature_hulls(self.landmarks, names), self.shape)

    def mask(self, feather: float = FEATHER) -> NDArray[np.float32]:
        """Return where the face is: 1 inside, falling smoothly to 0 at its outline.

        Parameters
        ----------
        feather : float
            Width of the soft edge in interocular distances.

        Returns
        -------
        (H, W) float32 array
            In [0, 1]; exactly 0 from two pixels outside the outline on.

        Examples
        --------
        >>> face = Landmarks([[20, 20], [80, 20], [80, 90], [20, 90]])
        >>> mask = FaceRegions(face, (100, 100)).mask()
        >>> float(mask[5, 50]), float(mask[60, 50])
        (0.0, 1.0)
        """
        if self.inside.all():
            return np.ones(self.shape, np.float32)
        # A face shrunk by half the feather and blurred over it. Beyond the frame the face goes on: the
        # frame's edge is not an edge of the face.
        band = max(feather * self.interocular_distance, 1.0)
        soft = gaussian(self.distance >= band / 2, band / (2 * _TAIL), edge="repeated")
        least = NormalDist().cdf(-_TAIL)  # what the blur leaves on a straight outline
        return np.asarray(np.clip((soft - least) / (1 - 2 * least), 0, 1) * self.inside, np.float32)

    def parts(self, region: str) -> NDArray[np.float32]:
        """Return where parts of the face are, 0 to 1, with soft edges that meet halfway.

        Parameters
        ----------
        region : str
            As in `TransferOptions`.

        Returns
        -------
        (H, W) float32 array

        Raises
        ------
        LandmarkError
            If the scheme of the landmarks does not know a part.

        Examples
        --------
        >>> face = Landmarks([[20, 20], [80, 20], [80, 90], [20, 90]])
        >>> mask = FaceRegions(face, (100, 100)).parts("left")
        >>> mask[50, [5, 95]].round(3).tolist()
        [1.0, 0.0]
        """
        return np.asarray(np.max([self._part(name) for name in region.split("+")], axis=0), np.float32)

    def _part(self, name: str) -> NDArray[np.float32]:
        if name == "face":
            return np.ones(self.shape, np.float32)
        middle, right = self._halves
        if name in ("left", "right"):
            y, x = np.indices(self.shape, np.float32)
            off = (x - middle[0]) * right[0] + (y - middle[1]) * right[1]
            off = off / (_SOFT_EDGE * self.interocular_distance)
            return soft_step(off if name == "right" else -off)
        rows = self.landmarks.groups.get(name)
        if rows is None:
            raise LandmarkError(
                f"region: these landmarks ({self.landmarks.scheme}) do not say where the {name} is; let them "
                "be detected, or choose another part"
            )
        points = self.landmarks.xy[list(rows)]
        on_right = (points - middle) @ right > 0
        sides = [points[on_right], points[~on_right]] if name in IN_PAIRS else [points]
        # Of a face in profile one side may have no points, and those of a chin may lie on one line.
        hulls = [convex_hull(side) for side in sides if len(side) > 2]
        margin = distance_from(drawn(hulls, self.shape))
        larger = margin <= _PART_MARGIN * self.interocular_distance
        return gaussian(larger, _SOFT_EDGE * self.interocular_distance)

    @cached_property
    def _halves(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The middle of the face, and the unit vector across it to the right of the picture."""
        if self.landmarks.eyes is None:
            middle = (self.outline.min(axis=0) + self.outline.max(axis=0)) / 2
        else:
            middle = self.landmarks.eyes[:, :2].sum(axis=0) / 2
        return middle, self.across if self.across[0] >= 0 else -self.across
