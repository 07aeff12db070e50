"""Whatever landmarks within a photo are, a transfer takes no longer than it does, or says why not."""

import time
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from relit import transfer
from relit.errors import LandmarkError, RelitError
from relit.face.detect import detect_landmarks
from relit.photo.reading import read_image
from relit.photo.samples import sample

pytestmark = pytest.mark.slow

#: CPU seconds of a transfer of these photos, which takes half a second: landmarks in a pixel took minutes.
_LONGEST = 8


@pytest.fixture(scope="module")
def faces():
    """The sample photos at half their size, and their landmarks."""
    photos = [
        np.ascontiguousarray(read_image(sample(role)).pixels[::2, ::2]) for role in ("target", "reference")
    ]
    for method in ("shading", "ltv"):  # what is compiled for the first of them is no time of a transfer
        transfer(*photos, method=method)
    return [(photo, np.array(detect_landmarks(photo).points)) for photo in photos]


#: What is done to some of the points: how far each axis is shrunk, round which point, and a shift.
_STEP = st.tuples(
    st.tuples(st.integers(0, 477), st.integers(1, 478)),
    st.integers(0, 477),
    st.tuples(*(st.sampled_from([1, 1, 0.3, 1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 0]) for _ in range(3))),
    st.tuples(*(st.sampled_from([0, 0, 0.1, -0.5, 1]) for _ in range(3))),
)


def changed(photo, points, steps):
    points, (height, width) = points.copy(), photo.shape[:2]
    for (first, count), center, factors, shift in steps:
        some = np.arange(first, first + count) % len(points)
        points[some] = points[center] + (points[some] - points[center]) * factors
        points[some] += np.array(shift) * max(width, height)
    points[:, :2] = np.clip(points[:, :2], 0, [width - 1, height - 1])
    return points


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    steps=st.lists(_STEP, min_size=1, max_size=3),
    which=st.sampled_from(["target", "reference"]),
    method=st.sampled_from(["shading", "ltv"]),
    mask=st.booleans(),
)
def test_no_landmarks_take_for_ever(faces, steps, which, method, mask):
    marks = {role: points for role, (_, points) in zip(("target", "reference"), faces, strict=True)}
    photo = faces[which == "reference"][0]
    marks[which] = changed(photo, marks[which], steps)
    begun = time.process_time()
    with suppress(RelitError):
        transfer(
            *(photo for photo, _ in faces),
            target_landmarks=marks["target"],
            reference_landmarks=marks["reference"],
            method=method,
            mask=mask,
        )
    assert time.process_time() - begun < _LONGEST


@pytest.mark.parametrize("method", ["shading", "ltv"])
@pytest.mark.parametrize("share", [1e-4, 1e-6])
def test_a_face_within_a_pixel_is_refused(faces, method, share):
    (target, points), (reference, others) = faces
    shrunk = points.mean(axis=0) + share * (points - points.mean(axis=0))
    for here, there in ((shrunk, others), (points, shrunk)):
        with pytest.raises(LandmarkError, match="one to be at most 1000 times as large as the other"):
            transfer(target, reference, target_landmarks=here, reference_landmarks=there, method=method)


def test_a_face_a_hundred_times_as_large_is_not(faces):
    (target, points), (reference, others) = faces
    shrunk = points.mean(axis=0) + (points - points.mean(axis=0)) / 40
    begun = time.process_time()
    made = transfer(target, reference, target_landmarks=shrunk, reference_landmarks=others)
    assert made.image.shape == target.shape
    assert time.process_time() - begun < _LONGEST
