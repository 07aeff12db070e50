"""The plug-in for Krita, in Krita itself where it is installed, and by a stand-in of what newer ones have."""

import importlib
import shutil
import subprocess
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import relit
from tests.integrations.editor_files import relit_file
from tests.integrations.test_editor_command import installer

SCRIPT = """
def main(_):
    try:
        from krita import Krita
        from relit.dialog import RelightDialog
        from relit.extension import relight_document

        dialog = RelightDialog()
        dialog.light.setCurrentIndex(3)
        dialog.numbers["strength"].setValue(0.8)
        wanted = dialog.wanted()
        Krita.instance().setBatchmode(True)
        document = Krita.instance().openDocument("photo.png")
        assert document.topLevelNodes()[0].name() == "Background"
        layer = relight_document(document, wanted)
        document.waitForDone()
        assert [node.name() for node in document.topLevelNodes()] == ["Background", "Relit"]
        for name, thing in (("seen", document), ("layer", layer)):
            with open(name, "wb") as file:
                file.write(bytes(thing.pixelData(0, 0, document.width(), document.height())))
        tell("MASKS", [child.type() for child in layer.childNodes()], wanted.light)
        layer = relight_document(document, wanted._replace(light="candle"))
    except Exception as error:
        tell("TOLD", type(error).__name__, error)


def tell(*words):
    with open("told", "a") as file:
        print(*words, file=file)
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("kritarunner") is None, reason="Krita is not installed")
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_krita_itself_lays_the_result_over_the_picture(tmp_path, studio, depth):
    command = relit_file(tmp_path)
    assert installer.main(["krita", "--folder", str(tmp_path / "pykrita"), "--command", str(command)]) == 0
    photo = studio.target.astype(depth) * depth(np.iinfo(depth).max // 255)
    relit.write_image(tmp_path / "photo.png", photo)
    (tmp_path / "trial.py").write_text(SCRIPT, "utf-8")
    done = subprocess.run(
        ["kritarunner", "-s", "trial", "-f", "main"],
        cwd=tmp_path,
        env={
            "PATH": "/usr/bin:/bin",  # or Krita would take the Python of this environment for its own
            "HOME": str(tmp_path),
            "QT_QPA_PLATFORM": "offscreen",
            "PYTHONPATH": f"{tmp_path}:{tmp_path / 'pykrita'}",
            "LANG": "C.UTF-8",
        },
        capture_output=True,
        text=True,
        timeout=600,
    )
    told = (tmp_path / "told").read_text()
    assert "MASKS" in told, told + done.stderr[-3000:]
    assert "split" in told
    known = relit.transfer(tmp_path / "photo.png", light="split", strength=0.8).image
    seen, layer = (
        np.frombuffer((tmp_path / name).read_bytes(), depth).reshape(*photo.shape[:2], 4)
        for name in ("seen", "layer")
    )
    # Krita takes 16 bits through colour management; an eighth of a level of 8 bits is what that may cost.
    most = 0 if depth is np.uint8 else 32
    for shown in (seen, layer):
        np.testing.assert_allclose(shown[..., 2::-1], known, rtol=0, atol=most)
    if "transparencymask" not in told:
        np.testing.assert_array_equal(layer[..., 3] > 0, (known != photo).any(axis=2))
    assert "TOLD RelitError --light: expected one of rembrandt" in told


class Recorder(SimpleNamespace):
    """Answers every call, and keeps it; `known` are attributes of its own."""

    def __init__(self, **known):
        super().__init__(calls=[], **known)

    def __getattr__(self, name):
        return lambda *given: self.calls.append((name, *given))


class Node(Recorder):
    def addChildNode(self, child, above):  # noqa: N802 (Krita's names)
        self.calls.append(("addChildNode", child, above))


@pytest.fixture
def extension(tmp_path, monkeypatch):
    """The plug-in as it is installed, beside a stand-in of Krita 5.2's module."""
    assert installer.main(["krita", "--folder", str(tmp_path), "--command", sys.executable]) == 0
    krita = ModuleType("krita")
    krita.told = []
    application = Recorder(added=krita.told)
    application.addExtension = krita.told.append
    krita.Krita = SimpleNamespace(instance=lambda: application)
    krita.application = application
    krita.Extension = type("Extension", (), {"__init__": lambda *_: None})
    krita.InfoObject = Recorder
    krita.Selection = Recorder
    monkeypatch.setitem(sys.modules, "krita", krita)
    return tmp_path, krita


def test_from_5_2_on_the_layer_has_a_mask(extension, monkeypatch):
    folder, krita = extension
    shutil.copytree(folder / "relit", folder / "relit_in_krita")
    (folder / "relit_in_krita" / "qt.py").write_text("QByteArray = bytes\nQImage = None\n")
    (folder / "relit_in_krita" / "dialog.py").write_text("ask = tell = None\n")
    monkeypatch.syspath_prepend(folder)
    plugin = importlib.import_module("relit_in_krita.extension")
    try:
        assert len(krita.told) == 1
        assert isinstance(krita.told[0], plugin.RelitExtension)
        photo = Recorder(pixelData=lambda *_: b"bgra" * 6)
        krita.application.openDocument = lambda _: photo
        monkeypatch.setattr(plugin, "_white", lambda _: b"\0\xff\xff\0\xff\xff")
        layer, mask, root = Node(), Node(), Node()
        document = Recorder(
            width=lambda: 3,
            height=lambda: 2,
            colorModel=lambda: "RGBA",
            colorDepth=lambda: "U8",
            colorProfile=lambda: "sRGB",
            createNode=lambda *named: layer if named == ("Relit", "paintlayer") else None,
            createTransparencyMask=lambda name: mask if name == "Changed" else None,
            rootNode=lambda: root,
        )
        assert plugin._insert(document, "result.png", "mask.png") is layer
        assert layer.calls[0] == ("setPixelData", b"bgra" * 6, 0, 0, 3, 2)
        assert root.calls == [("addChildNode", layer, None)]
        assert layer.calls[1] == ("addChildNode", mask, None)
        ((called, selection),) = mask.calls
        assert called == "setSelection"
        assert selection.calls == [("setPixelData", b"\0\xff\xff\0\xff\xff", 0, 0, 3, 2)]
        assert photo.calls[0] == ("setColorSpace", "RGBA", "U8", "sRGB")
        assert photo.calls[-1] == ("close",)
    finally:
        for name in [name for name in sys.modules if name.startswith("relit_in_krita")]:
            del sys.modules[name]
