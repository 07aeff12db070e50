"""A reference in the profile of its target: which of the two is converted, and to what."""

import numpy as np
import pytest

from relit.inputs import look
from relit.photo.photo import Photo
from relit.settings.options import TransferOptions
from tests.photo.photo_files import GREY_18, P3, sample

COLOUR, COLOUR_P3 = Photo(sample(np.uint8, 16, 12)), Photo(sample(np.uint8, 16, 12), profile=P3)
GREY, GREY_GAMMA = Photo(COLOUR.pixels[..., 1]), Photo(COLOUR.pixels[..., 1], profile=GREY_18)


@pytest.mark.parametrize(
    ("reference", "target", "profile"),
    [
        (COLOUR, COLOUR_P3, P3),
        (COLOUR_P3, COLOUR, None),
        (GREY, GREY_GAMMA, GREY_18),
        (GREY_GAMMA, COLOUR_P3, None),
        (COLOUR_P3, GREY_GAMMA, None),
    ],
)
def test_the_profile_is_the_targets_or_srgb_where_one_is_grey(reference, target, profile):
    photo = reference.to_profile_of(target)
    assert photo.profile == profile
    np.testing.assert_array_equal(photo.pixels, reference.to_profile(profile).pixels)


def test_a_photo_in_its_own_profile_is_itself():
    assert COLOUR_P3.to_profile_of(COLOUR_P3) is COLOUR_P3


@pytest.mark.parametrize("target", [COLOUR, COLOUR_P3, GREY, GREY_GAMMA])
@pytest.mark.parametrize("reference", [COLOUR, COLOUR_P3, GREY, GREY_GAMMA])
def test_only_a_grey_target_that_takes_colours_is_converted(target, reference):
    height, width = target.pixels.shape[:2]
    points = np.array([[0.2, 0.3], [0.8, 0.3], [0.5, 0.6], [0.3, 0.9], [0.7, 0.9]]) * [width - 1, height - 1]
    seen = look(target, points, [(reference, points)], None, TransferOptions(mask=False), None)
    there = seen.references[0].photo
    if target.is_grey and not reference.is_grey:
        assert seen.photo.profile is None
    else:
        assert seen.photo is target
    np.testing.assert_array_equal(there.pixels, reference.to_profile_of(seen.photo).pixels)
    assert there.profile in (seen.photo.profile, None)
