"""Options that are said to do nothing do nothing, and the others something: the bytes of results decide."""

import numpy as np
import pytest

from relit.relighting import transfer
from relit.settings.idle import OF_METHODS, idle
from relit.settings.methods import METHODS
from relit.settings.options import TransferOptions
from tests.command import in_library

STRONG = {
    "lam": 1.5,
    "neighborhood": 16,
    "split_first": True,
    "softness": 0.9,
    "turn": 30.0,
    "tilt": 20.0,
    "fill": 0.6,
    "kernel": "gaussian",
    "affine": False,
    "smoothing": 9.0,
    "tint": 0.5,
    "exposure": "take",
}


def of(studio, options):
    second = {"second_reference": studio.reference, "second_landmarks": studio.reference_landmarks}
    given = second if options.record.needs_second else {}
    if options.light is not None:
        return transfer(studio.target, target_landmarks=studio.target_landmarks, options=options).image
    return in_library(studio, options=options, **given).image


def holds(studio, base, name):
    changed = base.changed(**{name: STRONG[name]})
    same = np.array_equal(of(studio, base), of(studio, changed))
    return same == (name in idle(changed))


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_method_heeds_what_its_record_says(studio, method):
    for name in OF_METHODS:
        assert holds(studio, TransferOptions(method=method), name), name


@pytest.mark.slow
@pytest.mark.parametrize("method", ["shading", "ltv"])
@pytest.mark.parametrize("light", ["loop", "-30,20:color=#ff4000"])
def test_a_light_by_name_leaves_out_what_is_of_references(studio, method, light):
    for name in STRONG:
        if (method, name) != ("ltv", "exposure"):  # of a rendered face, as by default
            assert holds(studio, TransferOptions(method=method, light=light), name), name


@pytest.mark.slow
def test_the_neighborhood_counts_where_it_finds_lambda(studio):
    assert holds(studio, TransferOptions(lam="auto"), "neighborhood")


def test_what_has_a_say_is_not_told():
    assert not {*idle(TransferOptions(light="loop", tint="neutral", exposure="keep"))} & {"tint", "exposure"}
    assert not {*idle(TransferOptions())} & {"lam", "turn", "tilt", "softness", "fill", "kernel", "tint"}
    assert {*idle(TransferOptions(method="ltv"))} == {"softness", "turn", "tilt", "fill"}
