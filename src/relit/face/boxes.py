"""Boxes round faces, as the detector of `face_models` gives them: where they may be, how they are merged."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Px that the detector sees.
BOX_SIDE = 128

_LEAST_OVERLAP = 0.3  # intersection over union, above which two boxes of one look are one face


def probability(score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``1 / (1 + e⁻ˢ)`` of a score, and overflow at none.

    Examples
    --------
    >>> probability(np.array([0.0, 1000.0, -1000.0])).tolist()
    [0.5, 1.0, 0.0]
    """
    return np.asarray((1 + np.tanh(score / 2)) / 2)


def decode_boxes(
    regressors: NDArray[np.float32], scores: NDArray[np.float32], least_score: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Turn the detector's output into boxes, many for one face.

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
    boxes : (n, 8, 2) array
        The best first: centre, size, right eye, left eye and four more keypoints, in [0, 1].
    scores : (n,) array
        The probability of each.
    """
    chance = probability(scores.ravel().astype(np.float64))
    likely = np.flatnonzero(chance >= least_score)
    order = likely[np.argsort(-chance[likely], kind="stable")]
    boxes = regressors.reshape(-1, 8, 2)[order].astype(np.float64) / BOX_SIDE
    boxes[:, [0, 2, 3, 4, 5, 6, 7]] += anchors()[order, None]
    return boxes, chance[order]


def merged(
    boxes: NDArray[np.float64], scores: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return one box for each face, of those that overlap, weighted by their scores, and the best of these.

    Parameters
    ----------
    boxes, scores
        As `decode_boxes` returns them, and as they are returned.
    """
    means, best = [], []
    while len(boxes):
        same = overlap(boxes[0], boxes) > _LEAST_OVERLAP
        same[0] = True
        means.append(np.average(boxes[same], axis=0, weights=scores[same]))
        best.append(scores[0])
        boxes, scores = boxes[~same], scores[~same]
    return np.array(means).reshape(-1, 8, 2), np.array(best)


@cache
def anchors() -> NDArray[np.float64]:
    """Return the centres, (896, 2) in [0, 1], from which the detector's outputs count.

    Two anchors for every cell of 8 px, then six for every cell of 16 px, row by row.
    """
    grids = []
    for stride, count in ((8, 2), (16, 6)):
        axis = (np.arange(BOX_SIDE // stride) + 0.5) * stride / BOX_SIDE
        cells = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        grids.append(np.repeat(cells, count, axis=0))
    return np.concatenate(grids)


def overlap(box: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return intersection over union of a box with others; row 0 is the centre, row 1 the size."""
    low = np.maximum(box[0] - box[1] / 2, others[:, 0] - others[:, 1] / 2)
    high = np.minimum(box[0] + box[1] / 2, others[:, 0] + others[:, 1] / 2)
    common = np.clip(high - low, 0, None).prod(axis=-1)
    union = box[1].prod() + others[:, 1].prod(axis=-1) - common
    return np.asarray(np.divide(common, union, out=np.zeros_like(union), where=union > 0))
