"""Facial landmarks: points, what they mean, how large the face is, and whether they can be used.

Conventions
-----------
Points are ``(x, y)`` in pixels, pixel centres at integers, origin at the centre of the top left pixel.
Where a scheme knows a depth, the third column is ``z`` in pixels, growing away from the camera. *Left* and
*right* are the subject's own, as in anatomy: the right eye is on the left side of a frontal photo.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from relit.errors import LandmarkError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

SchemeName = Literal["mesh478", "ibug68", "frl189", "points"]

#: The square root of a face's hull area, in interocular distances: the mean over mesh478 faces, and the
#: yardstick for hand-made points that do not say where the eyes are.
_ROOT_AREA_PER_IOD = 2.0

_LARGEST = 1e6  # px: far beyond any photo, far below where float64 arithmetic on squares suffers


def _span(first: int, last: int) -> tuple[int, ...]:
    return tuple(range(first, last + 1))


@dataclass(frozen=True)
class Scheme:
    """What the rows of a landmark array are.

    Attributes
    ----------
    count : int or None
        Number of points; None where any number goes.
    right_eye, left_eye : tuple of int
        Rows whose mean is the eye's centre.
    outline : tuple of int
        Rows round the face, in order; empty where the convex hull has to serve.
    has_forehead : bool
        Whether the outline reaches the hairline.
    groups : dict
        Facial feature → its rows.
    """

    count: int | None
    right_eye: tuple[int, ...] = ()
    left_eye: tuple[int, ...] = ()
    outline: tuple[int, ...] = ()
    has_forehead: bool = False
    groups: dict[str, tuple[int, ...]] | None = None


# fmt: off
_MESH_OVAL = (10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152,
              148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109)
_MESH_GROUPS = {
    "oval": _MESH_OVAL,
    "brows": (46, 53, 52, 65, 55, 70, 63, 105, 66, 107, 276, 283, 282, 295, 285, 300, 293, 334, 296, 336),
    "eyes": (33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246,
             263, 249, 390, 373, 374, 380, 381, 382, 362, 398, 384, 385, 386, 387, 388, 466),
    "nose": (168, 6, 197, 195, 5, 4, 1, 19, 94, 2, 98, 97, 326, 327, 294, 278, 344, 440, 275, 45, 220, 115,
             48, 64),
    "mouth": (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185),
    "inner_mouth": (78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308, 415, 310, 311, 312, 13, 82, 81,
                    80, 191),
    "cheeks": (50, 280, 101, 330, 205, 425, 36, 266, 117, 346, 187, 411, 207, 427, 123, 352, 147, 376, 213,
               433),
    "forehead": (9, 8, 151, 108, 337, 69, 299, 104, 333, 71, 301),
    "chin": (18, 200, 199, 175),
}

SCHEMES: dict[SchemeName, Scheme] = {
    "mesh478": Scheme(
        count=478,
        right_eye=(33, 160, 158, 133, 153, 144),
        left_eye=(362, 385, 387, 263, 373, 380),
        outline=_MESH_OVAL,
        has_forehead=True,
        groups=_MESH_GROUPS,
    ),
    "ibug68": Scheme(
        count=68,
        right_eye=_span(36, 41),
        left_eye=_span(42, 47),
        outline=(*_span(0, 16), *reversed(_span(17, 26))),
        groups={"jaw": _span(0, 16), "brows": _span(17, 26), "nose": _span(27, 35), "eyes": _span(36, 47),
                "mouth": _span(48, 59), "inner_mouth": _span(60, 67)},
    ),
    "frl189": Scheme(
        count=189,
        right_eye=(0,),
        left_eye=(1,),
        outline=(109, 185, 110, 186, 111, *_span(125, 133), 114, 188, 113, 187, 112,
                 *reversed(_span(134, 144))),
        has_forehead=True,
        groups={"jaw": _span(125, 133), "hairline": _span(134, 144), "brows": _span(71, 86),
                "eyes": (0, 1, *_span(2, 43)), "nose": _span(50, 70), "mouth": _span(87, 108)},
    ),
    "points": Scheme(count=None),
}
# fmt: on


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
        if array.ndim != 2 or array.shape[1] not in (2, 3):
            raise LandmarkError(f"landmarks: expected shape (n, 2) or (n, 3), got {array.shape}")
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
        eyes = self.eyes
        if eyes is None:
            return float(np.sqrt(ConvexHull(self.xy).volume) / _ROOT_AREA_PER_IOD)
        return float(np.linalg.norm(eyes[1] - eyes[0]))

    @property
    def eyes(self) -> NDArray[np.float64] | None:
        """The centres of the right eye and the left, a row each; None where the scheme knows none."""
        scheme = SCHEMES[self.scheme]
        if not scheme.right_eye:
            return None
        return np.stack(
            [self.points[list(rows)].mean(axis=0) for rows in (scheme.right_eye, scheme.left_eye)]
        )

    @property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Facial feature → its rows; one group ``points`` where the scheme knows no features."""
        return SCHEMES[self.scheme].groups or {"points": tuple(range(len(self)))}

    def shifted(self, dx: float, dy: float) -> Landmarks:
        """Return the landmarks moved by ``(dx, dy)`` px."""
        offset = np.zeros(self.points.shape[1])
        offset[:2] = dx, dy
        return Landmarks(self.points + offset, self.scheme, self.confidence)

    def reduced(self, factor: int) -> Landmarks:
        """Return the landmarks in the image whose pixels are ``factor x factor`` of this one's.

        Examples
        --------
        >>> Landmarks([[0.5, 0.5], [4.5, 0.5], [0.5, 4.5]]).reduced(2).xy.tolist()
        [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]
        """
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
    """Return the rows to align two faces by: all of them, but for the mesh.

    478 dense and noisy points fold a thin-plate spline; the mesh is represented by about 160 points on its
    features, without irises and inner lips, which follow gaze and speech, not the face.
    """
    if landmarks.scheme != "mesh478":
        return np.arange(len(landmarks))
    chosen = {row for name, rows in _MESH_GROUPS.items() if name != "inner_mouth" for row in rows}
    return np.array(sorted(chosen))


def check_inside(landmarks: Landmarks, shape: tuple[int, ...], name: str) -> None:
    """Refuse landmarks that cannot belong to an image of this shape.

    Placed points must lie on the image, give or take one pixel. The mesh covers a whole face even where
    the frame cuts it, so of its points at least half must.

    Parameters
    ----------
    landmarks : Landmarks
    shape : tuple of int
        ``(H, W, ...)`` of the image.
    name : str
        The argument's name, for the message.

    Raises
    ------
    LandmarkError
        If too many points lie outside.
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


def check_pair(target: Landmarks, reference: Landmarks) -> None:
    """Refuse two faces whose landmarks cannot be paired row by row.

    Raises
    ------
    LandmarkError
        If scheme or number of points differ, or if two target points coincide while their reference points
        do not: no map takes one place to two.
    """
    if target.scheme != reference.scheme or len(target) != len(reference):
        raise LandmarkError(
            "target_landmarks and reference_landmarks must pair up row by row: the target has "
            f"{len(target)} points ({target.scheme}), the reference has {len(reference)} "
            f"({reference.scheme}); give both from files of one scheme, or let both be detected"
        )
    for first, second in cKDTree(target.xy).query_pairs(1e-9):
        if np.abs(reference.xy[first] - reference.xy[second]).max() > 1e-9:
            raise LandmarkError(
                f"target_landmarks: points {first} and {second} are duplicates, but their reference points "
                "are not; move or remove one of the pairs"
            )


def _resolve_scheme(scheme: SchemeName | None, count: int) -> SchemeName:
    if scheme is None:
        return next((name for name, known in SCHEMES.items() if known.count == count), "points")
    if scheme not in get_args(SchemeName):
        raise LandmarkError(f"landmarks: unknown scheme {scheme!r}; expected one of {', '.join(SCHEMES)}")
    expected = SCHEMES[scheme].count
    if expected not in (None, count):
        raise LandmarkError(f"landmarks: scheme {scheme} has {expected} points, got {count}")
    return scheme


def _check_points(array: NDArray[np.float64]) -> None:
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
    if small <= 1e-6 * max(large, 1.0):
        raise LandmarkError(
            "landmarks: all points lie on one line (or in one place); a face needs points off it"
        )
