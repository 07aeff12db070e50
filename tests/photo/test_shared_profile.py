"""A reference in the profile of its target: which of the two is converted, and to what."""

import numpy as np
import pytest

from relit.photo.photo import Photo, in_one_profile
from tests.photo.photo_files import GREY_18, P3, sample

COLOUR, COLOUR_P3 = Photo(sample(np.uint8)), Photo(sample(np.uint8), profile=P3)
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
    here, there = in_one_profile(target, reference)
    if target.is_grey and not reference.is_grey:
        assert here.profile is None
    else:
        assert here is target
    np.testing.assert_array_equal(there.pixels, reference.to_profile_of(here).pixels)
    assert there.profile in (here.profile, None)
