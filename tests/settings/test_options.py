"""Options check themselves."""

import re
from dataclasses import FrozenInstanceError, fields
from typing import Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest

from relit.errors import OptionError
from relit.settings.option_fields import GROUPS
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import studio_light
from relit.settings.transfer_changes import TransferChanges


def test_every_option_declares_its_flag_and_help():
    for option in fields(TransferOptions):
        assert option.metadata["flag"].startswith("--")
        assert len(option.metadata["help"]) > 15
        assert f"    {option.name} : " in TransferOptions.__doc__


def test_every_option_has_a_group_and_words_of_a_photographer():
    titles = [option.metadata["title"] for option in fields(TransferOptions)]
    assert len(set(titles)) == len(titles)
    for option in fields(TransferOptions):
        assert option.metadata["group"] in GROUPS
        assert option.metadata["title"][0].isupper()
        assert "_" not in option.metadata["title"]
    assert {option.metadata["group"] for option in fields(TransferOptions)} == set(GROUPS)


def test_options_have_the_types_that_editors_see():
    assert get_type_hints(TransferChanges) == get_type_hints(TransferOptions)
    assert not TransferChanges.__required_keys__


@pytest.mark.parametrize("option", fields(TransferOptions), ids=lambda option: option.name)
def test_types_allow_what_is_declared_and_no_other_words(option):
    kind = get_type_hints(TransferChanges)[option.name]
    parts = [kind] if get_origin(kind) is Literal else get_args(kind) or [kind]
    words = [word for part in parts if get_origin(part) is Literal for word in get_args(part)]
    others = {part for part in parts if get_origin(part) is not Literal}
    declared = option.metadata
    expected = set() if declared["choices"] else {type(option.default)}
    if declared["text"]:
        assert words == list(declared["choices"])
        expected |= set() if declared["choices"] else {str}
    else:
        assert words == [*declared["choices"], *declared["words"]]
        limits = (declared["at_least"], declared["at_most"], declared["above"])
        expected |= {float} if any(limit is not None for limit in limits) else set()
    expected |= {tuple[float, float]} if option.name == "light" else set()
    assert others == expected


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("method", "magic"),
        ("exposure", -9),
        ("exposure", "much"),
        ("exposure", np.nan),
        ("tint", 2),
        ("tint", "red"),
        ("strength", -0.1),
        ("strength", "1"),
        ("strength", None),
        ("shadows", 5),
        ("highlights", np.inf),
        ("strength", 10**400),
        ("light", "sun"),
        ("light", 3),
        ("light", "10,100"),
        ("light", (10, 100)),
        ("light", (np.nan, 0)),
        ("light", (10**400, 0)),
        ("light", (1,)),
        ("light", (1, 2, 3)),
        ("light", [1, 2]),
        ("light", ("1", "2")),
        ("light", (True, False)),
        ("light", {"rim"}),
        ("region", "hat"),
        ("region", ""),
        ("region", "left+"),
        ("region", None),
        ("full_resolution", 1),
        ("lam", 0),
        ("lam", -0.1),
        ("lam", np.nan),
        ("lam", np.inf),
        ("lam", "0.2"),
        ("lam", True),
        ("neighborhood", 6),
        ("neighborhood", 4.0),
        ("neighborhood", "8"),
        ("split_first", 1),
        ("color_space", "lab"),
        ("channels", "x"),
        ("channels", 0),
        ("mask", 1),
        ("mask", None),
        ("kernel", "linear"),
        ("affine", "yes"),
        ("smoothing", -1e-9),
        ("smoothing", np.inf),
    ],
)
def test_values_out_of_range_are_refused_by_name(name, value):
    with pytest.raises(OptionError, match=rf"^{name}: expected .*got {re.escape(repr(value))}"):
        TransferOptions(**{name: value})


@pytest.mark.parametrize(
    "values",
    [
        {"lam": 3},
        {"lam": np.float32(0.5)},
        {"neighborhood": 16},
        {"neighborhood": "isotropic"},
        {"color_space": "hsv", "channels": "v"},
        {"exposure": -1.5},
        {"exposure": "take"},
        {"exposure": None},
        {"tint": 1},
        {"tint": "neutral"},
        {"light": "rim"},
        {"light": "-30, 12.5"},
        {"strength": 0},
        {"region": "left+nose"},
        {"color_space": "ycbcr", "channels": "primary"},
        {"color_space": "hsv", "channels": "all"},
        {"method": "ltv", "color_space": "hsv", "channels": "h"},
        {"smoothing": 0},
        {"smoothing": None},
    ],
)
def test_values_in_range_pass(values):
    options = TransferOptions(**values)
    assert all(getattr(options, name) == value for name, value in values.items())


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ((-30, 20), "-30,20"),
        ((12.5, -0.0), "12.5,-0"),
        ((np.float32(0.1), 1e-7), "0.10000000149011612,0.0000001"),
        ("-30, 20", "-30, 20"),
    ],
)
def test_a_lamp_given_by_its_angles_is_kept_as_text(given, kept):
    options = TransferOptions(light=given)
    assert options.light == kept == TransferOptions().changed(light=given).light
    if not isinstance(given, str):
        assert studio_light(options.light).lamps[0][:2] == tuple(map(float, given))
        assert options == TransferOptions(light=kept)


def test_channels_are_checked_against_the_color_space():
    with pytest.raises(OptionError, match="channels: expected one of all, r, g, b"):
        TransferOptions(channels="v")


def test_changed_checks_names_and_values_and_keeps_the_rest():
    options = TransferOptions(lam=0.5)
    assert options.changed(mask=False) == TransferOptions(lam=0.5, mask=False)
    with pytest.raises(OptionError, match="lambda: no such option; expected one of method, lam"):
        options.changed(**{"lambda": 1})
    with pytest.raises(OptionError, match="lam"):
        options.changed(lam=-1)


def test_words_stand_for_shares():
    assert [TransferOptions(tint=tint).tint_share for tint in (None, "keep", "take", "neutral", 0.3)] == [
        None,
        0,
        1,
        0,
        0.3,
    ]
    assert [TransferOptions(exposure=given).stops for given in (None, "keep", "take", -2)] == [
        None,
        None,
        None,
        -2,
    ]
    assert [TransferOptions(exposure=given).exposure_share for given in (None, "keep", "take", 1)] == [
        0,
        0,
        1,
        0,
    ]
    assert TransferOptions(mask=False).exposure_share == 0.5


def test_options_are_frozen():
    with pytest.raises(FrozenInstanceError):
        TransferOptions().lam = 1


@pytest.mark.parametrize(("space", "channels"), [("hsv", "primary"), ("hsv", "s"), ("ycbcr", "cb")])
def test_shading_lights_what_has_a_brightness(space, channels):
    with pytest.raises(
        OptionError, match=f"channels: expected .* or 'all' with method 'shading'.*{channels}"
    ):
        TransferOptions(color_space=space, channels=channels)
    assert TransferOptions(color_space=space).lit_channels == {"hsv": "v", "ycbcr": "y"}[space]
    assert TransferOptions(color_space=space, method="ltv").lit_channels == "all"
