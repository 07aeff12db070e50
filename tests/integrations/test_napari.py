"""The plug-in for napari: its manifest, and what its widget makes of layers."""

import importlib
import inspect
import tomllib
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import relit
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import STUDIO_LIGHTS

FOLDER = Path(__file__).parents[2] / "integrations" / "napari"


@pytest.fixture
def plugin(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    return importlib.import_module("napari_relit")


def layer(pixels, name="face"):
    return SimpleNamespace(data=pixels, name=name, scale=np.array([2.0, 2.0]), translate=np.array([5.0, 7.0]))


def test_the_manifest_names_what_is_there(plugin):
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text())["project"]
    entry = project["entry-points"]["napari.manifest"][project["name"]]
    module, _, file = entry.partition(":")
    manifest = tomllib.loads((FOLDER / module / file).read_text())
    assert manifest["name"] == project["name"]
    commands = {one["id"]: one["python_name"] for one in manifest["contributions"]["commands"]}
    for name in commands.values():
        home, _, function = name.partition(":")
        assert home == plugin.__name__
        assert callable(getattr(plugin, function))
    for kind in ("widgets", "sample_data"):
        assert all(one["command"] in commands for one in manifest["contributions"][kind])


def test_the_numbers_are_relit_s_options(plugin):
    declared = {option.name: option for option in fields(TransferOptions)}
    told = inspect.get_annotations(plugin.relight)
    for name in ("strength", "softness"):
        (about,) = told[name].__metadata__
        assert (about["min"], about["max"]) == (
            declared[name].metadata["at_least"],
            declared[name].metadata["at_most"],
        )
        assert inspect.signature(plugin.relight).parameters[name].default == declared[name].default
    assert set(plugin._LIGHTS[1:]) == set(STUDIO_LIGHTS)


def test_the_widget_gives_layers_in_the_place_of_the_target(plugin, studio):
    (image, about, kind), (mask, also, _) = plugin.relight(
        layer(studio.target), layer(studio.reference), strength=0.6
    )
    known = relit.transfer(studio.target, studio.reference, strength=0.6).image
    np.testing.assert_array_equal(image, known)
    assert (kind, about["name"], about["rgb"]) == ("image", "face, relit", True)
    assert about["scale"].tolist() == also["scale"].tolist() == [2, 2]
    assert about["translate"].tolist() == [5, 7]
    assert mask.shape == studio.target.shape[:2]
    assert (mask[(known != studio.target).any(axis=2)] > 0).all()


def test_a_light_by_name_needs_no_reference_and_grey_stays_grey(plugin, studio):
    grey = studio.target[..., 1]
    (image, about, _), _ = plugin.relight(layer(grey), light="split")
    np.testing.assert_array_equal(image, relit.transfer(grey, light="split").image)
    assert about["rgb"] is False
    with pytest.raises(relit.OptionError, match="reference"):
        plugin.relight(layer(grey))


def test_the_samples_are_those_of_relit(plugin):
    assert [about["name"] for _, about, _ in plugin.samples()] == ["reference", "target"]
    assert all(pixels.ndim == 3 for pixels, _, _ in plugin.samples())
