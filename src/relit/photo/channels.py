"""Pixels as vectors of one to four numbers, which NumPy takes ten times as long for as OpenCV.

What NumPy spreads over the last axis of planes, (H, W, k), it works on three numbers at a time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def within(planes: NDArray[Any], mask: NDArray[np.bool_]) -> NDArray[Any]:
    """Return the pixels of planes, (H, W) or (H, W, k), in a mask, (H, W): (n,) or (n, k).

    Examples
    --------
    >>> within(np.arange(8).reshape(2, 2, 2), np.array([[True, False], [False, True]])).tolist()
    [[0, 1], [6, 7]]
    """
    if planes.ndim == mask.ndim:
        return np.asarray(planes[mask])
    # A mask picks numbers one by one, and places pixels.
    return np.asarray(planes.reshape(-1, planes.shape[-1]).take(np.flatnonzero(mask), axis=0))


def repeated(plane: NDArray[Any], count: int) -> NDArray[Any]:
    """Return a plane, (H, W), as often as there are planes to multiply by it, (H, W, count).

    Examples
    --------
    >>> repeated(np.array([[1.0, 2.0]]), 3).tolist()
    [[[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]]
    """
    return np.asarray(cv2.merge([plane] * count)).reshape(*plane.shape, count)


def first_of(planes: NDArray[Any], count: int) -> NDArray[Any]:
    """Return the first of planes, (H, W, k), as they would lie without the others, (H, W, count).

    Examples
    --------
    >>> first_of(np.arange(8, dtype=np.uint8).reshape(1, 2, 4), 3).tolist()
    [[[0, 1, 2], [4, 5, 6]]]
    """
    made = np.empty((*planes.shape[:2], count), planes.dtype)
    pairs = [place for number in range(count) for place in (number, number)]
    cv2.mixChannels([np.ascontiguousarray(planes)], [made], pairs)
    return made


def transformed(vectors: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return ``matrix @ v`` of each vector; with a column more than it has numbers, the last is added.

    Parameters
    ----------
    vectors : (..., k) array
        float32 or float64, which is also what is returned; k is 1 to 4.
    matrix : (m, k) or (m, k + 1) array
        m is 1 to 4.

    Returns
    -------
    (..., m) array

    Examples
    --------
    >>> transformed(np.array([[1.0, 2.0]]), np.array([[0, 1, 10], [1, 0, 20]])).tolist()
    [[12.0, 21.0]]
    """
    if vectors.size == 0:
        return np.zeros((*vectors.shape[:-1], len(matrix)), vectors.dtype)
    lines = np.ascontiguousarray(vectors).reshape(len(vectors), -1, vectors.shape[-1])
    return np.asarray(cv2.transform(lines, matrix)).reshape(*vectors.shape[:-1], len(matrix))


def moved(vectors: NDArray[Any], by: NDArray[Any]) -> NDArray[Any]:
    """Return vectors, (..., k), plus another one.

    Examples
    --------
    >>> moved(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([10, 20])).tolist()
    [[11.0, 22.0], [13.0, 24.0]]
    """
    return transformed(vectors, np.column_stack([np.eye(len(by)), by]))


def clipped(planes: NDArray[Any], low: NDArray[Any], high: NDArray[Any]) -> NDArray[Any]:
    """Return planes, (H, W, k), within limits of each.

    Examples
    --------
    >>> clipped(np.array([[[0.0, 9.0]]]), np.array([1.0, 2.0]), np.array([3.0, 4.0])).tolist()
    [[[1.0, 4.0]]]
    """
    lines = planes.reshape(len(planes), -1)
    low, high = (np.tile(limit, planes.shape[1]).astype(planes.dtype) for limit in (low, high))
    return np.asarray(np.clip(lines, low, high)).reshape(planes.shape)


def squared_length(vectors: NDArray[Any]) -> NDArray[Any]:
    """Return the squared lengths of vectors, (..., k), k being 1 to 4.

    Examples
    --------
    >>> squared_length(np.array([[3.0, 4.0]])).tolist()
    [25.0]
    """
    return transformed(vectors * vectors, np.ones((1, vectors.shape[-1])))[..., 0]


def squared_distances(points: NDArray[Any], others: NDArray[Any]) -> NDArray[Any]:
    """Return the squared distances of points, (n, k), from others, (m, k): (n, m).

    Examples
    --------
    >>> squared_distances(np.array([[0.0, 0.0]]), np.array([[3.0, 4.0], [0.0, 1.0]])).tolist()
    [[25.0, 1.0]]
    """
    total = np.subtract.outer(points[:, 0], others[:, 0])
    total *= total
    for axis in range(1, points.shape[1]):
        apart = np.subtract.outer(points[:, axis], others[:, axis])
        apart *= apart
        total += apart
    return np.asarray(total)
