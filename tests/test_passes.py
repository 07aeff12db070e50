"""The passes of a transfer, as OpenEXR's own library reads them: the person times the light is the photo."""

from dataclasses import replace

import numpy as np
import pytest

from relit.face.detect import detect_landmarks
from relit.passes import passes_of
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.relighting import transfer
from relit.result_files import write_results
from tests.photo.photo_files import srgb_curve

OpenEXR = pytest.importorskip("OpenEXR")


@pytest.fixture(scope="module")
def photo():
    return read_image(sample("target"))


@pytest.fixture(scope="module")
def face(photo):
    return detect_landmarks(photo.pixels)


@pytest.fixture(scope="module")
def result(photo, face):
    return transfer(photo, light="split", target_landmarks=face)


def channels_of(path, results, like):
    write_results(path, results, like=like)
    with OpenEXR.File(str(path)) as file:
        return {name: channel.pixels.astype(float) for name, channel in file.channels().items()}


def test_a_file_has_the_photo_and_its_layers_by_name(tmp_path, photo, result):
    found = channels_of(tmp_path / "a.layers.exr", [result], photo)
    assert set(found) == {"RGB", "person", "light", "matte.Y", "normals.X", "normals.Y", "normals.Z"}
    assert np.abs(srgb_curve(found["RGB"]) - result.image / 255).max() < 0.01  # its profile is all but sRGB


def test_person_times_light_is_the_photo(tmp_path, photo, result):
    found = channels_of(tmp_path / "a.layers.exr", [result], photo)
    made = found["person"] * found["light"]
    assert np.abs(made - found["RGB"]).max() < 2**-10  # of half floats
    assert (found["light"][found["matte.Y"] == 0] == 1).all()


def test_the_light_is_the_one_that_was_asked_for(tmp_path, photo, face, result):
    """A light from the side leaves one half of the face dark, and the person as bright on both."""
    found = channels_of(tmp_path / "a.layers.exr", [result], photo)
    points = face.xy.astype(int)
    left = points[:, 0] < points[:, 0].mean()
    at = {name: found[name][points[:, 1], points[:, 0]].mean(axis=1) for name in ("light", "person")}
    lit, dark = sorted((at["light"][left].mean(), at["light"][~left].mean()), reverse=True)
    assert lit > 2 * dark
    halves = np.median(at["person"][left]), np.median(at["person"][~left])
    assert max(halves) < 1.6 * min(halves)


def test_normals_are_of_length_one_and_look_at_the_camera(tmp_path, photo, face, result):
    found = channels_of(tmp_path / "a.layers.exr", [result], photo)
    normals = np.dstack([found[f"normals.{axis}"] for axis in "XYZ"])
    length = np.linalg.norm(normals, axis=2)
    assert (length == 0).mean() > 0.2
    middle = np.rint(face.xy.mean(axis=0)).astype(int)
    assert normals[middle[1], middle[0], 2] > 0.7
    right, left = (face.xy[:, 0].argmax(), face.xy[:, 0].argmin())
    at = [normals[tuple(np.rint(face.xy[row]).astype(int)[::-1])] for row in (right, left)]
    assert at[0][0] > 0.2 > -0.2 > at[1][0]
    chin, brow = face.xy[:, 1].argmax(), face.xy[:, 1].argmin()
    up = [normals[tuple(np.rint(face.xy[row]).astype(int)[::-1])][1] for row in (brow, chin)]
    assert up[0] > up[1]


def test_a_person_is_the_same_in_every_light(photo, face):
    shown = []
    for light in ("rembrandt", "split", "butterfly"):
        _, found = passes_of([transfer(photo, light=light, target_landmarks=face)], photo)
        points = face.xy.astype(int)
        shown.append(np.log(found["person.G"][points[:, 1], points[:, 0]].astype(float) + 0.01))
    assert np.median(np.ptp(shown, axis=0)) < 0.1


def test_of_a_method_that_tells_no_person_the_light_is_the_change(photo, face):
    made = transfer(photo, sample("reference"), target_landmarks=face, method="moments")
    relit, found = passes_of([made], photo)
    person = np.dstack([found[f"person.{axis}"] for axis in "RGB"]).astype(float)
    assert np.abs(srgb_curve(person) - photo.to_profile(None).pixels / 255).max() < 1e-2
    light = np.dstack([found[f"light.{axis}"] for axis in "RGB"]).astype(float)
    lit = person > 0.01
    assert np.abs(srgb_curve((person * light).clip(0, 1)) - relit.pixels / 255)[lit].max() < 1e-2


def test_a_grey_photo_has_one_channel_of_each(tmp_path):
    grey = read_image(sample("grey_target"))
    found = channels_of(tmp_path / "a.layers.exr", [transfer(grey, light="loop")], grey)
    assert {name for name in found if name[0] != "n"} == {"Y", "person.Y", "light.Y", "matte.Y"}
    assert np.abs(found["person.Y"] * found["light.Y"] - found["Y"]).max() < 2**-10


def test_colours_are_multiplied_with_alpha(tmp_path, photo, face):
    clear = replace(photo, alpha=np.full(photo.pixels.shape[:2], 51, np.uint8))
    found = channels_of(
        tmp_path / "a.layers.exr", [transfer(clear, light="loop", target_landmarks=face)], clear
    )
    assert np.abs(found["RGBA"][..., 3] - 0.2).max() < 1e-6
    assert np.abs(found["person"] * found["light"] - found["RGBA"][..., :3]).max() < 2**-10
