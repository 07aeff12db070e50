"""What the plug-ins for editors share: the command, run for real, and what it says."""

import ast
import doctest
import importlib.util
import os
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pytest
from PIL import Image

import relit
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import STUDIO_LIGHTS
from tests.integrations.editor_files import EDITORS, relit_file


def module(name):
    spec = importlib.util.spec_from_file_location(f"editors_{name}", EDITORS / f"{name}.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


shared = module("relit_command")
installer = module("install")


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    return str(relit_file(tmp_path_factory.mktemp("bin")))


@pytest.fixture
def files(studio, tmp_path):
    made = shared.Files.within(tmp_path)
    Image.fromarray(studio.target).save(made.target)
    return made


def test_the_sliders_and_lights_are_relit_s_options():
    options = {option.name: option for option in fields(TransferOptions)}
    for slider in shared.SLIDERS:
        declared = options[slider.name].metadata
        assert (slider.flag, slider.default) == (declared["flag"], options[slider.name].default)
        assert (slider.title, slider.least, slider.most) == (
            declared["title"],
            declared["at_least"],
            declared["at_most"],
        )
    assert tuple(STUDIO_LIGHTS) == shared.LIGHTS


@pytest.mark.parametrize("file", sorted(EDITORS.rglob("*.py")), ids=lambda file: file.name)
def test_the_pythons_of_editors_understand_it(file):
    ast.parse(file.read_text("utf-8"), feature_version=(3, 8))


def test_the_command_says_what_differs_from_the_default_alone(files, command):
    wanted = shared.Wanted(None, "loop", {"strength": 0.85, "turn": 0.0, "tilt": -10.0}, command)
    assert shared.command_line(wanted, files)[:-5] == [
        *(command, "transfer", str(files.target), "--light", "loop"),
        *("--strength", "0.85", "--tilt", "-10.0"),
    ]


@pytest.mark.slow
def test_a_real_command_relights_and_its_mask_is_exact(files, command, studio):
    reference = studio.folder / "reference.png"
    shared.relight(shared.Wanted(str(reference), None, {"strength": 0.8}, command), files)
    known = relit.transfer(files.target, reference, strength=0.8)
    before, after, mask = (np.asarray(Image.open(one)) for one in files)
    np.testing.assert_array_equal(after, known.image)
    np.testing.assert_array_equal(mask == 255, (before != after).any(axis=2))
    assert set(np.unique(mask)) == {0, 255}
    laid = np.where(mask[..., None] == 255, after, before)
    np.testing.assert_array_equal(laid, after)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("light", "values", "told"),
    [
        ("loop", {}, "no face found; use a photo with a larger, upright face"),
        ("candle", {}, "--light: expected one of rembrandt"),
        ("loop", {"strength": 9.0}, "strength"),
    ],
)
def test_what_a_real_command_says_is_one_line(files, command, light, values, told):
    Image.new("RGB", (90, 90), "grey").save(files.target)
    with pytest.raises(shared.RelitError) as failed:
        shared.relight(shared.Wanted(None, light, values, command), files)
    message = str(failed.value)
    assert told in message
    assert "\n" not in message
    assert "Error:" not in message
    assert "Traceback" not in message


def test_the_examples_hold():
    assert doctest.testmod(shared).attempted > 0
    assert doctest.testmod(shared).failed == 0


def test_no_light_and_no_command_are_told(files, tmp_path, monkeypatch):
    with pytest.raises(shared.RelitError, match="Choose a photo that gives the light, or a light by name"):
        shared.command_line(shared.Wanted(None, None, {}, sys.executable), files)
    with pytest.raises(shared.RelitError, match="no program; give the place of the relit command"):
        shared.relit_command(str(tmp_path / "none"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(shared.RelitError, match="relit was not found: install it"):
        shared.relit_command()


def test_a_command_that_gives_nothing_or_hangs_is_told(files, tmp_path, monkeypatch):
    fake = tmp_path / "fake"
    for script, told in [
        ("exit 0", "relit wrote no result.png"),
        ("exit 3", "did not say why"),
        ("sleep 60", "no answer within 0.2 s"),
    ]:
        fake.write_text(f"#!/bin/sh\nexec {script}\n" if "sleep" in script else f"#!/bin/sh\n{script}\n")
        fake.chmod(0o755)
        monkeypatch.setattr(shared, "_SECONDS", 0.2 if "sleep" in script else 60)
        with pytest.raises(shared.RelitError, match=told):
            shared.relight(shared.Wanted(None, "loop", {}, str(fake)), files)
    fake.write_text("no script")
    with pytest.raises(shared.RelitError, match="cannot be started"):
        shared.relight(shared.Wanted(None, "loop", {}, str(fake)), files)


def test_an_editor_s_own_python_leads_nobody_astray(monkeypatch):
    monkeypatch.setenv("PYTHONHOME", "/editor")
    monkeypatch.setenv("PYTHONPATH", "/editor")
    told = shared._environment()
    assert not {"PYTHONHOME", "PYTHONPATH"} & set(told)
    assert set(os.environ) - set(told) == {"PYTHONHOME", "PYTHONPATH"}


@pytest.mark.parametrize("editor", ["gimp", "krita"])
def test_the_plug_in_is_put_where_the_editor_looks(editor, tmp_path, command, capsys):
    words = [editor, "--folder", str(tmp_path), "--command", command]
    assert installer.main(words) == 0
    told = capsys.readouterr().out
    assert (tmp_path / "relit" / "command.txt").read_text() == command
    assert (tmp_path / "relit" / "relit_command.py").read_bytes() == (
        EDITORS / "relit_command.py"
    ).read_bytes()
    if editor == "gimp":
        assert os.access(tmp_path / "relit" / "relit.py", os.X_OK)
    else:
        entry = (tmp_path / "relit.desktop").read_text()
        assert "X-KDE-Library=relit\n" in entry
        assert (tmp_path / "relit" / "Manual.html").is_file()
    for line in told.splitlines()[:-1]:
        assert os.path.isfile(line)  # noqa: PTH113 (a line of text)
    assert installer.main(words) == 0  # again, after an update


def test_what_is_not_relit_s_stays(tmp_path, command, capsys):
    (tmp_path / "relit").mkdir()
    (tmp_path / "relit" / "mine.py").write_text("mine")
    assert installer.main(["gimp", "--folder", str(tmp_path), "--command", command]) == 1
    assert "is there already, and is not relit's; move it" in capsys.readouterr().err
    assert [file.name for file in (tmp_path / "relit").iterdir()] == ["mine.py"]


def test_folders_are_those_of_the_newest_gimp_and_of_krita(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    with pytest.raises(installer.InstallError, match="start it once"):
        installer.gimp_folder()
    for version in ("2.10", "3.0", "3.2", "3.10"):
        (tmp_path / "config" / "GIMP" / version).mkdir(parents=True)
    assert installer.gimp_folder() == tmp_path / "config" / "GIMP" / "3.10" / "plug-ins"
    assert installer.krita_folder() == tmp_path / "data" / "krita" / "pykrita"


@pytest.mark.slow
def test_the_installer_needs_nothing_but_python(tmp_path):
    done = subprocess.run(
        [sys.executable, "-I", "-S", EDITORS / "install.py", "krita", "--folder", tmp_path, "--command", "x"],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
