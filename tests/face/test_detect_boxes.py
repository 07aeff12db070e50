"""The detector's boxes: where they may be, how far they overlap, how they are merged."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relit.face.boxes import anchors, decode_boxes, merged, overlap


def test_anchors():
    expected = []
    for cells, per_cell in ((16, 2), (8, 6)):
        for row in range(cells):
            for column in range(cells):
                for _ in range(per_cell):
                    expected.append(((column + 0.5) / cells, (row + 0.5) / cells))
    assert anchors().shape == (896, 2)
    assert np.array_equal(anchors(), expected)


def iou(one, other):
    """Return the intersection over union of two (centre x, centre y, width, height) by plain arithmetic."""
    common = 1.0
    for centre, size in ((0, 2), (1, 3)):
        low = max(one[centre] - one[size] / 2, other[centre] - other[size] / 2)
        high = min(one[centre] + one[size] / 2, other[centre] + other[size] / 2)
        common *= max(high - low, 0.0)
    return common / (one[2] * one[3] + other[2] * other[3] - common)


sides, centres = st.floats(0.01, 3), st.floats(-2, 2)
some_boxes = st.lists(st.tuples(centres, centres, sides, sides), min_size=1, max_size=8)


@given(st.tuples(centres, centres, sides, sides), some_boxes)
@settings(max_examples=100, deadline=None)
def test_overlap(box, others):
    found = overlap(np.reshape(box, (2, 2)), np.reshape(others, (-1, 2, 2)))
    assert found == pytest.approx([iou(box, other) for other in others], rel=1e-9, abs=1e-12)


def test_overlap_by_hand():
    box = np.array([[0.0, 0.0], [2.0, 2.0]])
    others = np.array(
        [[[0, 0], [2, 2]], [[1, 0], [2, 2]], [[1, 1], [2, 2]], [[2, 0], [2, 2]], [[0, 0], [1, 1]]]
    )
    assert overlap(box, others) == pytest.approx([1, 1 / 3, 1 / 7, 0, 1 / 4])


def brute_force_boxes(regressors, scores, least):
    """Weighted non-maximum suppression as one would do it by hand, with numbers in px of the 128 px view."""
    boxes = []
    for k in range(896):
        numbers = [float(value) for value in regressors[0, k]]
        anchor = [float(value) * 128 for value in anchors()[k]]
        for pair in (0, 2, 3, 4, 5, 6, 7):  # all but the size count from the anchor
            numbers[2 * pair] += anchor[0]
            numbers[2 * pair + 1] += anchor[1]
        chance = 1 / (1 + np.exp(-float(scores[0, k, 0])))
        if chance >= least:
            boxes.append((chance, numbers))
    boxes.sort(key=lambda entry: -entry[0])
    merged = []
    while boxes:
        same = [boxes[0]] + [entry for entry in boxes[1:] if iou(boxes[0][1], entry[1]) > 0.3]
        boxes = [entry for entry in boxes if entry not in same]
        total = sum(chance for chance, _ in same)
        merged.append([sum(chance * row[k] for chance, row in same) / total / 128 for k in range(16)])
    return merged


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 40), least=st.sampled_from([0.3, 0.5, 0.7]))
@settings(max_examples=40, deadline=None)
def test_boxes_are_merged_by_their_scores(seed, count, least):
    random = np.random.default_rng(seed)
    regressors = random.normal(0, 10, (1, 896, 16)).astype(np.float32)
    regressors[..., 2:4] = random.uniform(10, 70, (1, 896, 2))
    scores = np.full((1, 896, 1), -8, np.float32)
    scores[0, random.choice(896, count, replace=False)] = random.normal(0.5, 1.5, (count, 1))
    found, _ = merged(*decode_boxes(regressors, scores, least))
    expected = np.reshape(brute_force_boxes(regressors, scores, least), (-1, 8, 2))
    assert found.shape == expected.shape
    assert found == pytest.approx(expected, abs=1e-9)


def test_no_boxes():
    none, _ = merged(
        *decode_boxes(np.ones((1, 896, 16), np.float32), np.full((1, 896, 1), -100, np.float32), 0.5)
    )
    assert none.shape == (0, 8, 2)


def test_box_without_area_stands_alone():
    """A degenerate box overlaps nothing, not even itself, and must end the merging nevertheless."""
    scores = np.full((1, 896, 1), -100, np.float32)
    scores[0, [3, 700]] = 2
    boxes = np.ones((1, 896, 16), np.float32)
    boxes[..., 2] = 0
    assert merged(*decode_boxes(boxes, scores, 0.5))[0].shape == (2, 8, 2)
