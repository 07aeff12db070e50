"""The plug-in for GIMP 3, by a stand-in of GIMP that keeps an image's layers; relit itself is real.

The stand-in has what the plug-in is to use of GIMP's interface, and nothing else: what is not there raises.
"""

import runpy
import shutil
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import relit
from tests.integrations.editor_files import EDITORS, relit_file

FILE = EDITORS / "gimp" / "relit.py"


class Path:
    def __init__(self, path):
        self.path = path

    def get_path(self):
        return self.path


class Layer:
    def __init__(self, pixels, name="Background"):
        self.pixels, self.name, self.mask = pixels, name, None

    def set_name(self, name):
        self.name = name

    def resize_to_image_size(self):
        pass

    def create_mask(self, kind):
        return self.pixels.copy() if kind == "copy" else Layer.selection

    def add_mask(self, mask):
        self.mask = mask


class Picture:
    def __init__(self, layers):
        self.layers, self.groups, self.selected, self.deleted, self.channels = layers, [], None, False, []

    def duplicate(self):
        self.copy = Picture(list(self.layers))
        return self.copy

    def merge_visible_layers(self, kind):
        assert kind == "clip to image"
        self.layers = [self.layers[0]]
        return self.layers[0]

    def delete(self):
        self.deleted = True

    def insert_layer(self, layer, parent, place):
        assert parent is None
        self.layers.insert(place, layer)

    def remove_layer(self, layer):
        self.layers.remove(layer)

    def remove_channel(self, channel):
        self.channels.remove(channel)

    def select_item(self, how, item):
        assert how == "replace"
        self.selected = Layer.selection = item

    def undo_group_start(self):
        self.groups.append("start")

    def undo_group_end(self):
        self.groups.append("end")


def saved_selection(image):
    image.channels.append(image.selected)
    return image.selected


class Procedure:
    def __init__(self, name, run):
        self.name, self.run, self.arguments, self.menu, self.label = name, run, {}, None, None

    @classmethod
    def new(cls, _plugin, name, kind, run, _data):
        assert kind == "plugin"
        return cls(name, run)

    def set_image_types(self, types):
        self.types = types

    def set_menu_label(self, label):
        self.label = label

    def add_menu_path(self, path):
        self.menu = path

    def set_documentation(self, blurb, text, name):
        assert (bool(blurb), bool(text), name) == (True, True, self.name)

    def set_attribution(self, *_):
        pass

    def add_file_argument(self, name, nick, blurb, action, none_ok, default, flags):
        assert (bool(nick), bool(blurb), action, none_ok, flags) == (True, True, "open", True, "rw")
        self.arguments[name] = default

    def add_choice_argument(self, name, _nick, _blurb, choice, value, _flags):
        assert value in choice.values
        self.arguments[name] = value

    def add_double_argument(self, name, _nick, _blurb, least, most, value, _flags):
        assert least <= value <= most
        self.arguments[name] = value

    def add_string_argument(self, name, _nick, _blurb, value, _flags):
        self.arguments[name] = value

    def new_return_values(self, status, error):
        return status, error


class Choice:
    def __init__(self):
        self.values = []

    @classmethod
    def new(cls):
        return cls()

    def add(self, value, number, _label, _help):
        assert number == len(self.values)
        self.values.append(value)


def stand_in(dialog):
    """Return modules as `gi.repository` has them, and what was called."""
    said = []

    def file_save(mode, image, file, options):
        assert (mode, options) == ("noninteractive", None)
        Image.fromarray(image.layers[0].pixels).save(file.get_path())
        return True

    def file_load_layer(mode, _image, file):
        assert mode == "noninteractive"
        return Layer(np.asarray(Image.open(file.get_path())))

    class PlugIn:
        __gtype__ = "type"

        @staticmethod
        def error_quark():
            return "quark"

    gimp = SimpleNamespace(
        PlugIn=PlugIn,
        ImageProcedure=Procedure,
        Choice=Choice,
        PDBProcType=SimpleNamespace(PLUGIN="plugin"),
        PDBStatusType=SimpleNamespace(SUCCESS="success", CANCEL="cancel", EXECUTION_ERROR="error"),
        RunMode=SimpleNamespace(INTERACTIVE="interactive", NONINTERACTIVE="noninteractive"),
        FileChooserAction=SimpleNamespace(OPEN="open"),
        MergeType=SimpleNamespace(CLIP_TO_IMAGE="clip to image"),
        ChannelOps=SimpleNamespace(REPLACE="replace"),
        AddMaskType=SimpleNamespace(COPY="copy", SELECTION="selection"),
        Selection=SimpleNamespace(
            is_empty=lambda image: image.selected is None,
            save=saved_selection,
            none=lambda image: setattr(image, "selected", None),
        ),
        file_save=file_save,
        file_load_layer=file_load_layer,
        progress_init=said.append,
        progress_pulse=lambda: None,
        progress_end=lambda: said.append("end"),
        displays_flush=lambda: said.append("flush"),
        main=lambda kind, words: said.append((kind, words is sys.argv)),
    )
    ui = SimpleNamespace(
        init=lambda name: said.append(name), ProcedureDialog=SimpleNamespace(new=lambda *_: dialog)
    )
    repository = ModuleType("gi.repository")
    repository.Gimp, repository.GimpUi = gimp, ui
    repository.Gio = SimpleNamespace(File=SimpleNamespace(new_for_path=Path))
    repository.GLib = SimpleNamespace(
        Error=SimpleNamespace(new_literal=lambda quark, text, code: (quark, text, code))
    )
    repository.GObject = SimpleNamespace(ParamFlags=SimpleNamespace(READWRITE="rw"))
    gi = ModuleType("gi")
    gi.require_version = lambda name, version: said.append((name, version))
    gi.repository = repository
    return {"gi": gi, "gi.repository": repository}, said


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """The plug-in as GIMP would start it, its procedure, and what it did."""
    agreed = [True]
    dialog = SimpleNamespace(fill=lambda _: None, run=lambda: agreed[0], destroy=lambda: None, agreed=agreed)
    modules, said = stand_in(dialog)
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    folder = tmp_path / "relit"
    folder.mkdir()
    commands = tmp_path / "bin"
    commands.mkdir()
    for file in (FILE, EDITORS / "relit_command.py"):
        shutil.copy(file, folder)
    (folder / "command.txt").write_text(str(relit_file(commands)))
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "relit_command", raising=False)
    made = runpy.run_path(str(folder / "relit.py"))["Relit"]()
    yield SimpleNamespace(made=made, said=said, dialog=dialog)
    sys.modules.pop("relit_command", None)


def config_of(procedure, **changes):
    values = {**procedure.arguments, **changes}
    return SimpleNamespace(get_property=values.__getitem__)


def test_gimp_learns_of_the_entry_and_its_dialog(plugin):
    assert plugin.said[:2] == [("Gimp", "3.0"), ("GimpUi", "3.0")]
    assert plugin.said[-1] == ("type", True)
    (name,) = plugin.made.do_query_procedures()
    procedure = plugin.made.do_create_procedure(name)
    assert (procedure.name, procedure.menu) == (name, "<Image>/Filters/Light and Shadow/")
    assert {"reference", "light", "strength", "command"} <= set(procedure.arguments)


@pytest.mark.slow
@pytest.mark.parametrize("selected", [None, "a selection"])
def test_the_result_becomes_the_top_layer_with_its_mask(plugin, studio, selected):
    procedure = plugin.made.do_create_procedure("relit-relight-face")
    image = Picture([Layer(studio.target)])
    image.selected = selected
    reference = Path(str(studio.folder / "reference.png"))
    config = config_of(procedure, reference=reference, strength=0.7)
    status, error = procedure.run(procedure, "interactive", image, [], config, None)
    assert (status, error) == ("success", None)
    known = relit.transfer(studio.target, studio.reference, strength=0.7).image
    assert [layer.name for layer in image.layers] == ["Relit", "Background"]
    np.testing.assert_array_equal(image.layers[0].pixels, known)
    np.testing.assert_array_equal(image.layers[0].mask == 255, (known != studio.target).any(axis=2))
    np.testing.assert_array_equal(image.layers[1].pixels, studio.target)
    assert image.groups == ["start", "end"]
    assert image.copy.deleted
    assert image.selected == selected
    assert image.channels == []
    assert plugin.said[-2:] == ["end", "flush"]


@pytest.mark.slow
def test_what_fails_is_told_in_one_line_and_leaves_the_image(plugin):
    procedure = plugin.made.do_create_procedure("relit-relight-face")
    image = Picture([Layer(np.full((90, 90, 3), 128, np.uint8))])
    config = config_of(procedure, light="loop")
    status, (quark, told, _) = procedure.run(procedure, "noninteractive", image, [], config, None)
    assert (status, quark) == ("error", "quark")
    assert "no face found" in told
    assert "\n" not in told
    assert [layer.name for layer in image.layers] == ["Background"]
    assert plugin.said[-1] == "end"


def test_a_light_must_be_chosen(plugin):
    procedure = plugin.made.do_create_procedure("relit-relight-face")
    image = Picture([Layer(np.full((90, 90, 3), 128, np.uint8))])
    status, (_, told, _) = procedure.run(procedure, "noninteractive", image, [], config_of(procedure), None)
    assert (status, told) == ("error", "Choose a photo that gives the light, or a light by name.")


def test_cancelling_changes_nothing(plugin):
    procedure = plugin.made.do_create_procedure("relit-relight-face")
    plugin.dialog.agreed[0] = False
    image = Picture([])
    assert procedure.run(procedure, "interactive", image, [], None, None) == ("cancel", None)
    assert image.layers == []
