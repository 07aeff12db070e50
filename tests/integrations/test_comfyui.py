"""The node pack for ComfyUI, in what of ComfyUI's server it meets."""

import json
import shutil
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import relit
from relit.settings.methods import WITH_SECOND_REFERENCE
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import STUDIO_LIGHTS
from tests.integrations.comfy_server import KINDS, SOCKETS, Server, forget, load, torch_or_stand_in

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "integrations" / "comfyui"
PHOTO, LAMP, LIGHT = "RelitRelightFromPhoto", "RelitRelightByLamp", "RelitFaceLight"


@pytest.fixture(scope="module")
def torch():
    with pytest.MonkeyPatch.context() as patch:
        made = torch_or_stand_in()
        patch.setitem(sys.modules, "torch", made)
        yield made


@pytest.fixture(scope="module")
def pack():
    module = load(FOLDER)
    yield module
    forget(module)


@pytest.fixture(scope="module")
def server(pack):
    return Server(pack)


@pytest.fixture(scope="module")
def faces(studio):
    """Two photos with a face each, (H, W, 3) float32 in 0 to 1."""
    return [getattr(studio, name).astype(np.float32) / 255 for name in ("target", "reference")]


def prompt(server, torch, kind, changes=(), **batches):
    """Return a prompt of one node whose images are given."""
    nodes = {
        name: {"tensor": torch.from_numpy(np.stack(batch)), "kind": "IMAGE" if batch[0].ndim == 3 else "MASK"}
        for name, batch in batches.items()
    }
    links = {name: [name, 0] for name in batches}
    inputs = {**server.defaults(kind), **dict(changes), **links}
    return {**nodes, "node": {"class_type": kind, "inputs": inputs}}


def run(server, torch, kind, changes=(), **batches):
    return [
        one.numpy() if hasattr(one, "numpy") else one
        for one in server.run(prompt(server, torch, kind, changes, **batches), "node")
    ]


def test_the_pack_is_what_comfyui_looks_for(pack):
    assert set(pack.NODE_CLASS_MAPPINGS) == set(pack.NODE_DISPLAY_NAME_MAPPINGS)
    for node in pack.NODE_CLASS_MAPPINGS.values():
        assert node.__doc__
        assert callable(getattr(node, node.FUNCTION))
        assert len(node.RETURN_TYPES) == len(node.RETURN_NAMES) == len(node.OUTPUT_TOOLTIPS)
        assert set(node.RETURN_TYPES) <= SOCKETS
        told = node.INPUT_TYPES()
        assert set(told) <= {"required", "optional"}
        json.dumps(told)  # as /object_info sends it to the page
        for kind, about in (told["required"] | told.get("optional", {})).values():
            assert isinstance(kind, list) or kind in SOCKETS
            assert about["tooltip"]
            if "default" in about:
                assert about["default"] in kind if isinstance(kind, list) else True
                assert isinstance(kind, list) or isinstance(about["default"], KINDS[kind])


def test_importing_it_needs_no_torch(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "torch", None)
    shutil.copytree(FOLDER, tmp_path / "comfyui-relit")
    forget(load(tmp_path / "comfyui-relit"))


def test_every_option_is_a_widget_with_its_default_and_range(server):
    wanted = server.classes[PHOTO].INPUT_TYPES()
    both = wanted["required"] | wanted["optional"]
    for option in fields(TransferOptions):
        if option.name == "light":
            continue
        kind, about = both[option.name]
        assert option.metadata["help"] in about["tooltip"]
        assert bool(about.get("advanced")) == (option.metadata["group"] == "expert")
        for bound, end in (("min", "at_least"), ("max", "at_most")):
            if kind == "FLOAT":
                assert about[bound] == option.metadata[end]
    assert server.classes[PHOTO].options(server.defaults(PHOTO)) == {
        option.name: option.default for option in fields(TransferOptions) if option.name != "light"
    }
    assert not set(both["method"][0]) & set(WITH_SECOND_REFERENCE)
    assert set(server.classes[LAMP].INPUT_TYPES()["required"]["light"][0]) == {*STUDIO_LIGHTS, "lamp"}


def test_text_becomes_what_it_tells(server):
    read = server.classes[PHOTO].options
    given = {"exposure": "1.5", "tint": " keep ", "fill": "", "lam": "auto", "neighborhood": "8"}
    assert read(given) == {"exposure": 1.5, "tint": "keep", "fill": None, "lam": "auto", "neighborhood": 8}
    assert read({"neighborhood": "isotropic", "region": "nose+mouth"}) == {
        "neighborhood": "isotropic",
        "region": "nose+mouth",
    }


@pytest.mark.parametrize(
    ("kind", "changes", "told"),
    [
        (PHOTO, {"exposure": "bright"}, "exposure: expected a finite number of -8 or more"),
        (PHOTO, {"strength": 5}, "strength: expected a finite number of 0 or more and at most 4, got 5.0"),
        (PHOTO, {"region": "knee"}, "region: expected face, or parts joined by +"),
        (PHOTO, {"method": "magic"}, "method: expected one of shading"),
        (
            LAMP,
            {"light": "lamp", "color": "pink"},
            "light: lamp '-30,20:size=10:color=pink': expected a color",
        ),
        (
            LAMP,
            {"light": "lamp", "size": 90},
            "light: lamp '-30,20:size=90:color=#ffffff': expected a size of 1 to",
        ),
        (LAMP, {"more_lamps": "nonsense"}, "light: expected one of rembrandt"),
    ],
)
def test_wrong_widgets_are_told_before_anything_runs(server, torch, faces, kind, changes, told):
    given = prompt(
        server, torch, kind, changes, target=faces[:1], **({"reference": faces[1:]} if kind == PHOTO else {})
    )
    (error,) = server.validate(given, "node")
    assert error.startswith(f"Custom validation failed for node: {told}")
    assert "\n" not in error


def test_the_ranges_of_the_lamp_are_those_of_relit(server):
    wanted = server.classes[LAMP].INPUT_TYPES()["required"]
    for name in ("azimuth", "elevation", "size"):
        _, about = wanted[name]
        for end in ("min", "max"):
            read = server.classes[LAMP].VALIDATE_INPUTS
            assert read(light="lamp", **{name: about[end]}) is True
            assert read(light="lamp", **{name: about[end] + (1 if end == "max" else -1)}) is not True


def test_a_missing_or_wrong_link_is_told(server, torch, faces):
    given = prompt(server, torch, PHOTO, target=faces[:1])
    assert server.validate(given, "node") == ["Required input is missing: reference"]
    given = prompt(server, torch, PHOTO, target=faces[:1], reference=faces[1:])
    given["other"] = {"class_type": LIGHT, "inputs": {}}
    given["node"]["inputs"]["reference"] = ["other", 2]
    assert server.validate(given, "node") == [
        "Return type mismatch between linked nodes: reference, MASK != IMAGE"
    ]


def test_a_photo_relights_as_the_library_does(server, torch, faces):
    target, reference = faces
    image, mask = run(server, torch, PHOTO, {"strength": 0.7}, target=[target], reference=[reference])
    known = relit.transfer(target, reference, strength=0.7)
    np.testing.assert_array_equal(image[0], known.image)
    assert image.shape == (1, *target.shape)
    changed = (np.abs(known.image - target) > 1e-6).any(axis=2)
    assert (mask[0][changed] > 0).all()
    assert mask[0].max() == 1


def test_a_batch_takes_all_references_or_each_its_own(server, torch, faces):
    target, reference = faces
    other = np.ascontiguousarray(reference[:, ::-1])
    both = {"target": [target, target], "reference": [reference, other]}
    together, _ = run(server, torch, PHOTO, **both)
    known = relit.transfer(target, [reference, other]).image
    np.testing.assert_array_equal(together, [known, known])
    apart, _ = run(server, torch, PHOTO, {"references": "one by one"}, **both)
    for one, light in zip(apart, (reference, other), strict=True):
        np.testing.assert_array_equal(one, relit.transfer(target, light).image)
    more, _ = run(server, torch, PHOTO, target=[target], reference=[reference], reference_2=[other])
    np.testing.assert_array_equal(more[0], known)


def test_grey_alpha_and_overshoot(server, torch, faces):
    target, reference = faces
    alpha = np.linspace(0, 1, target[..., 0].size, dtype=np.float32).reshape(target.shape[:2])
    (image, _) = run(server, torch, LAMP, target=[np.dstack([target, alpha])])
    np.testing.assert_array_equal(image[0][..., 3], alpha)
    grey = target.mean(axis=2, keepdims=True)
    (image, _) = run(server, torch, PHOTO, target=[grey], reference=[reference])
    assert image.shape == (1, *target.shape)
    (image, _) = run(server, torch, LAMP, target=[target * 1.01 - 0.002])
    assert image.shape == (1, *target.shape)


def test_a_lamp_lights_as_the_library_does(server, torch, faces):
    target = faces[0]
    lamp = {"light": "lamp", "azimuth": 60, "elevation": 10, "size": 25, "color": "#ff8000"}
    (image, _) = run(server, torch, LAMP, {**lamp, "more_lamps": "rim:power=0.4"}, target=[target])
    known = relit.transfer(target, light="60,10:size=25:color=#ff8000+rim:power=0.4").image
    np.testing.assert_array_equal(image[0], known)


def test_a_region_mask_keeps_the_rest(server, torch, faces):
    target = faces[0]
    left = np.zeros(target.shape[:2], np.float32)
    left[:, : target.shape[1] // 2] = 1
    (image, mask) = run(server, torch, LAMP, target=[target], region_mask=[left])
    np.testing.assert_array_equal(image[0][left == 0], target[left == 0])
    assert not np.array_equal(image[0], target)
    assert (mask[0][left == 0] == 0).all()


def test_an_image_without_a_face_stops_or_stays(server, torch, faces):
    empty = np.full_like(faces[0], 0.5)
    with pytest.raises(relit.FaceNotFoundError, match="target: no face found"):
        run(server, torch, LAMP, target=[faces[0], empty])
    image, mask = run(server, torch, LAMP, {"no_face": "keep the image"}, target=[faces[0], empty])
    np.testing.assert_array_equal(image[1], empty)
    assert not mask[1].any()
    assert mask[0].any()


def test_the_light_of_a_face_comes_from_where_its_lamp_is(server, torch, faces):
    lit = [relit.transfer(faces[0], light=(side * 60, 10)).image for side in (-1, 1)]
    panorama, ball, disc, confidence = run(server, torch, LIGHT, {"height": 128}, image=lit)
    assert (panorama.shape, ball.shape, disc.shape) == ((2, 128, 256, 3), (2, 128, 128, 3), (2, 128, 128))
    assert 0 <= confidence <= 1
    for shown in (panorama, ball):
        left, right = shown[..., : shown.shape[2] // 2, :], shown[..., shown.shape[2] // 2 :, :]
        brighter = (left.mean(axis=(1, 2, 3)) > right.mean(axis=(1, 2, 3))).tolist()
        assert brighter == [True, False]
    assert not ball[disc == 0].any()


def test_a_ball_in_one_lamp_is_lambert_s(pack):
    pictures = sys.modules[f"{pack.__name__}.pictures"]
    panorama = np.zeros((64, 128, 3))
    panorama[30:34, 94:98] = 1  # 90° to the right, at the height of the eyes
    shown = pictures.ball(panorama, 101)[50, :, 0]
    x = (np.arange(101) + 0.5) * 2 / 101 - 1
    np.testing.assert_allclose(shown, np.maximum(x, 0), atol=0.06)


def test_progress_is_told_and_work_can_be_stopped(server, torch, faces, monkeypatch):
    steps = []

    class Bar:
        def __init__(self, total):
            steps.append(total)

        def update(self, by):
            steps.append(by)

    class Stopped(Exception):  # noqa: N818 (a stand-in)
        pass

    class Management:
        @staticmethod
        def throw_exception_if_processing_interrupted():
            if len(steps) > 1:
                raise Stopped

    monkeypatch.setitem(sys.modules, "comfy.utils", type("Utils", (), {"ProgressBar": Bar}))
    monkeypatch.setitem(sys.modules, "comfy.model_management", Management)
    with pytest.raises(Stopped):
        run(server, torch, LAMP, target=[faces[0]] * 3)
    assert steps == [3, 1]


def test_the_registry_learns_what_it_asks_for():
    told, ours = (tomllib.loads((folder / "pyproject.toml").read_text("utf-8")) for folder in (FOLDER, ROOT))
    assert told["project"]["requires-python"] == ours["project"]["requires-python"]
    assert {"name", "description", "version", "license"} <= set(told["project"])
    assert told["tool"]["comfy"]["DisplayName"] == "relit"
