"""Facial landmarks: points, how large the face is, and whether they can be used.

Points are ``(x, y)`` in pixels, pixel centres at integers, origin at the centre of the top left pixel.
Where a depth is known, the third column is ``z`` in pixels, growing away from the camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

import numpy as np

from relit.errors import LandmarkError
from relit.face.hull import convex_hull, polygon_area
from relit.face.schemes import SCHEMES, SchemeName
from relit.photo.channels import squared_distances

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: The square root of a face's hull area, in interocular distances: the mean over mesh478 faces, and the
#: yardstick for hand-made points that do not say where the eyes are.
_ROOT_AREA_PER_IOD = 2.0

#: By how much the face in a reference may be larger or smaller than the target's. The largest that a photo of
#: 100 million px holds is 300 times as large as the smallest that is found in any.
_MOST_SCALE = 1000.0
#: How far from its image a point may lie, in longest sides of it: a frame that cuts a face leaves it some.
_BEYOND = 4
#: How far points must leave their best line, by what they spread along it: faces have 0.5 and more, even
#: turned by 85 degrees.
_FLATTEST = 0.01

_LARGEST = 1e6  # px: far beyond any photo, far below where float64 arithmetic on squares suffers


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Landmarks of one face.

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)
        ``(x, y)`` or ``(x, y, z)`` in pixels, pixel centres at integers. Kept as a read-only float64 array.
    scheme : {"mesh478", "ibug68", "frl189", "points"}, optional
        What the rows are. By default taken from their number: 478, 68 and 189 rows are the known
        schemes, any other number is plain hand-made ``points``.
    confidence : float, optional
        The detector's presence score in [0, 1]; None for points that were not detected.

    Raises
    ------
    LandmarkError
        If the array has another shape, fewer than 3 points, the wrong number of points for its scheme,
        values that are not finite or no pixel positions, points that all lie on one line, eyes that
        coincide, or a confidence outside [0, 1].

    Examples
    --------
    >>> face = Landmarks([[30, 40], [70, 40], [50, 60], [50, 80]])
    >>> face.scheme, len(face)
    ('points', 4)
    >>> face
    Landmarks(4 points, interocular distance 14.1 px)
    """

    points: NDArray[np.float64]
    scheme: SchemeName
    confidence: float | None = None

    def __init__(
        self, points: ArrayLike, scheme: SchemeName | None = None, confidence: float | None = None
    ) -> None:
        try:
            array = np.array(points, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise LandmarkError(
                f"landmarks: expected an (n, 2) or (n, 3) array of numbers; {error}"
            ) from None
        _check_points(array)
        array.flags.writeable = False
        object.__setattr__(self, "points", array)
        object.__setattr__(self, "scheme", _resolve_scheme(scheme, len(array)))
        object.__setattr__(self, "confidence", confidence)
        if confidence is not None and not 0 <= confidence <= 1:
            raise LandmarkError(f"landmarks: confidence must be in [0, 1], got {confidence!r}")
        if not self.interocular_distance > 0:
            raise LandmarkError(
                "landmarks: the two eyes coincide, so that the face has no size; place them apart"
            )

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    def __repr__(self) -> str:
        """Return the scheme, the face's scale and the confidence."""
        kind = f"{len(self)} points" if self.scheme == "points" else self.scheme
        told = [kind, f"interocular distance {self.interocular_distance:.1f} px"]
        if self.confidence is not None:
            told.append(f"confidence {self.confidence:.2f}")
        return f"Landmarks({', '.join(told)})"

    @property
    def xy(self) -> NDArray[np.float64]:
        """The ``(n, 2)`` image positions, without depth."""
        return self.points[:, :2]

    @property
    def interocular_distance(self) -> float:
        """Distance of the two eye centres in px (in space, where a depth is known): the face's scale.

        Plain ``points`` do not say where the eyes are: their scale is the square root of their convex
        hull's area over 2.0, which is what the two come to on whole faces.
        """
        if (eyes := self.eyes) is None:
            return float(np.sqrt(polygon_area(convex_hull(self.xy))) / _ROOT_AREA_PER_IOD)
        return float(np.linalg.norm(eyes[1] - eyes[0]))

    @property
    def eyes(self) -> NDArray[np.float64] | None:
        """The centres of the right eye and the left, a row each; None where the scheme has none."""
        scheme = SCHEMES[self.scheme]
        if not scheme.right_eye:
            return None
        return np.stack([self.points[[*rows]].mean(axis=0) for rows in (scheme.right_eye, scheme.left_eye)])

    @property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Facial feature → its rows; one group ``points`` where the scheme has no features."""
        return SCHEMES[self.scheme].groups or {"points": tuple(range(len(self)))}

    def shifted(self, dx: float, dy: float) -> Landmarks:
        """Return the landmarks moved by ``(dx, dy)`` px."""
        offset = np.zeros(self.points.shape[1])
        offset[:2] = dx, dy
        return Landmarks(self.points + offset, self.scheme, self.confidence)

    def reduced(self, factor: int) -> Landmarks:
        """Return the landmarks in the image whose pixels are ``factor x factor`` of this one's."""
        if factor == 1:
            return self
        points = self.points / factor
        points[:, :2] += 0.5 / factor - 0.5
        return Landmarks(points, self.scheme, self.confidence)


def as_landmarks(value: Landmarks | ArrayLike, name: str) -> Landmarks:
    """Return `value` as `Landmarks`; an array's scheme is taken from its number of rows.

    Raises
    ------
    LandmarkError
        As `Landmarks` does; the message names the argument `name`.
    """
    if isinstance(value, Landmarks):
        return value
    try:
        return Landmarks(value)
    except LandmarkError as error:
        raise LandmarkError(str(error).replace("landmarks", name, 1)) from None


def control_rows(landmarks: Landmarks) -> NDArray[np.intp]:
    """Return the rows to align two faces by: all of them, but of the mesh about 160 on its features.

    478 dense and noisy points fold a thin-plate spline; irises and inner lips follow gaze and speech, not
    the face.
    """
    if landmarks.scheme != "mesh478":
        return np.arange(len(landmarks))
    chosen = {row for name, rows in landmarks.groups.items() if name != "inner_mouth" for row in rows}
    return np.array(sorted(chosen))


def check_inside(landmarks: Landmarks, shape: tuple[int, ...], name: str) -> None:
    """Refuse landmarks that cannot belong to an image of shape ``(H, W, ...)``, with a `LandmarkError`.

    Placed points must lie on the image, give or take one pixel. The mesh covers a whole face even where
    the frame cuts it, so of its points at least half must, and the others, with their depth, not far from it.
    The message names the argument `name`.
    """
    height, width = shape[:2]
    x, y = landmarks.xy.T
    outside = (x < -1) | (y < -1) | (x > width) | (y > height)
    allowed = len(landmarks) // 2 if landmarks.scheme == "mesh478" else 0
    if (count := int(outside.sum())) > allowed:
        row = int(np.argmax(outside))
        raise LandmarkError(
            f"{name}: {count} of {len(landmarks)} points lie outside the {width}x{height} image, for example "
            f"point {row} at ({x[row]:.1f}, {y[row]:.1f}); are they landmarks of another image?"
        )
    if (farthest := np.abs(landmarks.points).max()) > (most := _BEYOND * max(width, height) + 1):
        raise LandmarkError(
            f"{name}: a coordinate of {farthest:.1f} px is far from the {width}x{height} image; expected at "
            f"most {most} px; are they landmarks of another image?"
        )


def check_pair(target: Landmarks, reference: Landmarks) -> None:
    """Refuse two faces whose landmarks cannot be paired row by row.

    Raises
    ------
    LandmarkError
        If scheme or number of points differ, if one face is more than 1000 times as large as the other, or if
        two target points coincide while their reference points do not: no map takes one place to two.
    """
    if target.scheme != reference.scheme or len(target) != len(reference):
        raise LandmarkError(
            "target_landmarks and reference_landmarks must pair up row by row: the target has "
            f"{len(target)} points ({target.scheme}), the reference has {len(reference)} "
            f"({reference.scheme}); give both from files of one scheme, or let both be detected"
        )
    # By the points that align them, in the plane: eyes may be far apart in depth.
    rows = control_rows(target)
    sizes = [float(one.xy[rows].std(axis=0).max()) for one in (target, reference)]
    if max(sizes) > _MOST_SCALE * min(sizes):
        eyes = " and ".join(f"{one.interocular_distance:.3g}" for one in (target, reference))
        raise LandmarkError(
            f"target_landmarks and reference_landmarks: the faces have sizes of {sizes[0]:.3g} and "
            f"{sizes[1]:.3g} px, and interocular distances of {eyes} px; expected one to be at most "
            f"{_MOST_SCALE:g} times as large as the other; are they landmarks of these two photos?"
        )
    near = np.triu(squared_distances(target.xy, target.xy) <= 1e-9**2, 1)
    for first, second in np.argwhere(near):
        if np.abs(reference.xy[first] - reference.xy[second]).max() > 1e-9:
            raise LandmarkError(
                f"target_landmarks: points {first} and {second} are duplicates, but their reference points "
                "are not; move or remove one of the pairs"
            )


def _resolve_scheme(scheme: SchemeName | None, count: int) -> SchemeName:
    """Return the scheme that was given, if it has so many points, or the one that has."""
    if scheme is None:
        return next((name for name, known in SCHEMES.items() if known.count == count), "points")
    if scheme not in get_args(SchemeName):
        raise LandmarkError(f"landmarks: unknown scheme {scheme!r}; expected one of {', '.join(SCHEMES)}")
    expected = SCHEMES[scheme].count
    if expected not in (None, count):
        raise LandmarkError(f"landmarks: scheme {scheme} has {expected} points, got {count}")
    return scheme


def _check_points(array: NDArray[np.float64]) -> None:
    """Refuse what is no array of points, or of points that span no face."""
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise LandmarkError(f"landmarks: expected shape (n, 2) or (n, 3), got {array.shape}")
    if len(array) < 3:
        raise LandmarkError(f"landmarks: at least 3 points are needed, got {len(array)}")
    if not np.isfinite(array).all():
        rows = np.flatnonzero(~np.isfinite(array).all(axis=1))
        shown = ", ".join(map(str, rows[:5])) + (", ..." if len(rows) > 5 else "")
        raise LandmarkError(
            f"landmarks: point {shown} is missing or not finite; place it, or leave it out of both"
        )
    if (largest := np.abs(array).max()) > _LARGEST:
        raise LandmarkError(f"landmarks: {largest:g} is no pixel position; expected at most {_LARGEST:g}")
    centred = array[:, :2] - array[:, :2].mean(axis=0)
    # The smaller singular value measures how far the points leave their best line.
    large, small = np.linalg.svd(centred, compute_uv=False)
    if small <= max(_FLATTEST * large, 1e-6):
        raise LandmarkError(
            "landmarks: all points lie on one line, or nearly so, or in one place; a face needs points off it"
        )
