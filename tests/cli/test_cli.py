"""The command line: what the library gives is what the file holds, and what fails leaves nothing behind.

Photos written are read back with Pillow, imagecodecs and tifffile, not with relit.
"""

import contextlib
import dataclasses
import functools
import io
import json
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from relit import figures, inputs, relighting
from relit.cli import app as module
from relit.face import detect
from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.face.landmarks import Landmarks
from relit.ltv.decomposition import decompose, normalize
from relit.ltv.g_value import automatic_lam
from relit.methods import light_and_person as explained
from relit.methods import paper as ltv_swap
from relit.photo import atomic_files as files
from relit.photo.color import COLOR_SPACES
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.photo.writing import write_image
from relit.settings.options import TransferOptions
from relit.warp import alignment
from tests.command import FACES, TRANSFER, in_library, listing, pixels_of, the_line
from tests.faces import off_the_face

FIELDS = {field.name: field for field in dataclasses.fields(TransferOptions)}
PYTHON = [sys.executable, "-W", "error", "-c", "from relit.cli.app import main; main()"]

IMAGES = "JPEG, PNG, TIFF, WebP, PPM, PGM or BMP"


@functools.cache  # it holds the time at which it was made
def rgb_profile():
    """An RGB profile that is not sRGB's."""
    return bytes(imagecodecs.cms_profile("adobergb"))


@functools.cache
def grey_profile():
    return bytes(imagecodecs.cms_profile("gray", gamma=1.0))


def as_16_bits(pixels):
    """Return 16-bit pixels that no 8-bit pixels stand for."""
    noise = np.random.default_rng(0).integers(-120, 120, pixels.shape)
    return (pixels.astype(int) * 257 + noise).clip(0, 65535).astype(np.uint16)


ROLES = ("target", "reference")


class TestTransfer:
    @pytest.mark.parametrize(
        ("flags", "options"),
        [
            ("", {}),
            ("--lambda 0.7 --neighborhood 16", {"lam": 0.7, "neighborhood": 16}),
            ("--neighborhood isotropic --smoothing 3", {"neighborhood": "isotropic", "smoothing": 3.0}),
            ("--color-space ycbcr --channels primary", {"color_space": "ycbcr", "channels": "primary"}),
            ("--color-space hsv --kernel gaussian", {"color_space": "hsv", "kernel": "gaussian"}),
            ("--no-mask --no-affine", {"mask": False, "affine": False}),
        ],
    )
    def test_the_file_holds_what_the_library_returns(self, studio, plain, succeed, flags, options):
        assert succeed(f"{TRANSFER} -o out.png {flags}") == b""
        expected = in_library(studio, **options).image
        np.testing.assert_array_equal(pixels_of("out.png"), expected)
        assert bool(options) == bool((expected != plain.image).any())

    def test_a_fold_is_told_in_one_line_and_the_photo_written(self, studio, run):
        done = run(f"{TRANSFER} -o out.png --kernel multiquadric --smoothing 0 --no-affine")
        result = in_library(studio, kernel="multiquadric", smoothing=0, affine=False)
        assert result.first.alignment.folded > 0
        assert done.code == 0
        assert done.err.startswith(
            f"relit: warning: the alignment turns over on {result.first.alignment.folded:.1%}"
        )
        assert done.err.count("\n") == 1
        np.testing.assert_array_equal(pixels_of("out.png"), result.image)

    def test_faces_are_found_where_no_landmarks_are_given(self, studio, plain, succeed):
        report = json.loads(succeed("transfer target.png reference.png -o out.png --json"))
        np.testing.assert_array_equal(pixels_of("out.png"), plain.image)
        for role in ROLES:
            assert report[role]["confidence"] == vars(studio)[f"{role}_found"].confidence > 0.5

    def test_off_the_face_nothing_changes(self, studio, succeed):
        succeed(f"{TRANSFER} -o out.png")
        changed = (pixels_of("out.png") != studio.target).any(axis=2)
        away = off_the_face(studio.target_landmarks, changed.shape)
        assert 0.05 < away.mean() < 0.9
        assert not changed[away].any()
        assert changed[~away].mean() > 0.3

    def test_png_keeps_16_bits(self, studio, place, succeed):
        target = as_16_bits(studio.target)
        (place / "deep.png").write_bytes(imagecodecs.png_encode(target))
        succeed(f"transfer deep.png reference.png {FACES} -o out.png")
        written = imagecodecs.png_decode((place / "out.png").read_bytes())
        assert written.dtype == np.uint16
        np.testing.assert_array_equal(written, in_library(studio, target).image)
        away = off_the_face(studio.target_landmarks, target.shape)
        np.testing.assert_array_equal(written[away], target[away])
        assert (written[~away] % 257 != 0).any()

    @pytest.mark.parametrize("dtype", [np.uint16, np.float32])
    def test_tiff_keeps_its_depth(self, studio, place, succeed, dtype):
        target = as_16_bits(studio.target)
        target = target if dtype == np.uint16 else (target / 65535).astype(dtype)
        tifffile.imwrite(place / "deep.tif", target, photometric="rgb")
        succeed(f"transfer deep.tif reference.png {FACES} -o out.tif")
        written = tifffile.imread(place / "out.tif")
        assert written.dtype == dtype
        np.testing.assert_array_equal(written, in_library(studio, target).image)

    def test_alpha_is_kept(self, studio, plain, place, succeed):
        alpha = np.random.default_rng(1).integers(0, 256, studio.target.shape[:2], np.uint8)
        Image.fromarray(np.dstack([studio.target, alpha])).save(place / "clear.png")
        succeed(f"transfer clear.png reference.png {FACES} -o out.png")
        np.testing.assert_array_equal(pixels_of("out.png"), np.dstack([plain.image, alpha]))

    def test_a_turned_jpeg_comes_out_upright_with_profile_and_exif(self, studio, place, succeed):
        exif = Image.Exif()
        exif[0x0112], exif[0x010F] = 6, "Camera Works"
        lying = Image.fromarray(studio.target).transpose(Image.Transpose.ROTATE_90)
        profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
        lying.save(place / "lying.jpg", exif=exif, icc_profile=profile, quality=95)
        succeed(f"transfer lying.jpg reference.png {FACES} -o out.png")
        succeed(f"transfer lying.jpg reference.png {FACES} -o out.jpg")
        for name in ("out.png", "out.jpg"):
            with Image.open(place / name) as picture:
                assert picture.info["icc_profile"] == profile
                assert picture.getexif()[0x010F] == "Camera Works"
                assert picture.getexif().get(0x0112, 1) == 1
                assert picture.size == studio.target.shape[1::-1]
        with Image.open(place / "lying.jpg") as picture:
            upright = np.array(picture.transpose(Image.Transpose.ROTATE_270))
        away = off_the_face(studio.target_landmarks, upright.shape)
        np.testing.assert_array_equal(pixels_of("out.png")[away], upright[away])

    def test_a_wide_gamut_target_keeps_its_profile_and_its_pixels(self, studio, place, succeed):
        write_image(place / "wide.png", Photo(studio.target, profile=rgb_profile()))
        succeed(f"transfer wide.png reference.png {FACES} -o out.png")
        with Image.open(place / "out.png") as picture:
            assert picture.info["icc_profile"] == rgb_profile()
        written = pixels_of("out.png")
        away = off_the_face(studio.target_landmarks, written.shape)
        np.testing.assert_array_equal(written[away], studio.target[away])
        converted = Photo(studio.reference).to_profile(rgb_profile()).pixels
        np.testing.assert_array_equal(written, in_library(studio, reference=converted).image)

    def test_photos_of_two_profiles_are_relit_as_in_the_library(self, studio, place, succeed):
        write_image(place / "wide.png", Photo(studio.reference, profile=rgb_profile()))
        succeed("transfer target.png wide.png -o out.png")
        expected = relighting.transfer(read_image("target.png"), read_image("wide.png")).image
        np.testing.assert_array_equal(pixels_of("out.png"), expected)

    def test_a_grey_target_takes_the_colours_of_the_face_alone(self, studio, place, succeed):
        grey = np.asarray(Image.fromarray(studio.target).convert("L"))
        Image.fromarray(grey).save(place / "grey.png")
        succeed(f"transfer grey.png reference.png {FACES} -o out.png")
        written = pixels_of("out.png")
        np.testing.assert_array_equal(written, in_library(studio, grey).image)
        away = off_the_face(studio.target_landmarks, grey.shape)
        np.testing.assert_array_equal(written[away], np.repeat(grey[..., None], 3, axis=2)[away])
        assert (np.ptp(written[~away].astype(int), axis=-1) > 10).mean() > 0.5

    def test_a_grey_reference_leaves_the_hue(self, studio, place, succeed):
        grey = np.asarray(Image.fromarray(studio.reference).convert("L"))
        Image.fromarray(grey).save(place / "grey.png")
        succeed(f"transfer target.png grey.png {FACES} -o out.png")
        written = pixels_of("out.png")
        np.testing.assert_array_equal(written, in_library(studio, reference=grey).image)
        red, green, _ = np.moveaxis(written + 1.0, -1, 0)
        was_red, was_green, _ = np.moveaxis(studio.target + 1.0, -1, 0)
        sure = (written > 40).all(axis=2) & (written < 250).all(axis=2) & (studio.target > 40).all(axis=2)
        assert sure.sum() > 500
        assert np.abs((red / green)[sure] - (was_red / was_green)[sure]).max() < 0.05

    def test_grey_stays_grey(self, studio, place, succeed):
        grey = {name: np.asarray(Image.fromarray(vars(studio)[name]).convert("L")) for name in ROLES}
        for name, pixels in grey.items():
            Image.fromarray(pixels).save(place / f"grey_{name}.png")
        succeed(f"transfer grey_target.png grey_reference.png {FACES} -o out.pgm")
        with Image.open(place / "out.pgm") as picture:
            assert picture.mode == "L"
        np.testing.assert_array_equal(pixels_of("out.pgm"), in_library(studio, **grey).image)

    def test_a_grey_profile_goes_with_its_pixels(self, studio, place, succeed):
        grey = np.asarray(Image.fromarray(studio.target).convert("L"))
        light = np.asarray(Image.fromarray(studio.reference).convert("L"))
        write_image(place / "grey.png", Photo(grey, profile=grey_profile()))
        Image.fromarray(light).save(place / "light.png")
        succeed(f"transfer grey.png light.png {FACES} -o out.png")
        away = off_the_face(studio.target_landmarks, grey.shape)
        before, after = (read_image(name).to_profile(None).pixels[away] for name in ("grey.png", "out.png"))
        assert np.abs(before.astype(int) - after).max() <= 2

    def test_swap_equals_swapped_arguments(self, place, succeed):
        succeed(
            "transfer reference.png target.png --target-landmarks reference.csv "
            "--reference-landmarks target.csv -o straight.png"
        )
        report = json.loads(succeed(f"{TRANSFER} --swap --json -o swapped.png"))
        assert (place / "swapped.png").read_bytes() == (place / "straight.png").read_bytes()
        assert (report["target"]["path"], report["reference"]["path"]) == ("reference.png", "target.png")
        succeed(f"{TRANSFER} -o as_given.png")
        assert (place / "swapped.png").read_bytes() != (place / "as_given.png").read_bytes()

    def test_streams(self, place, succeed):
        succeed(f"{TRANSFER} -o out.png")
        expected = (place / "out.png").read_bytes()
        before = listing(place)
        target, reference = ((place / f"{name}.png").read_bytes() for name in ROLES)
        assert succeed(f"transfer - reference.png {FACES} -o -", stdin=target) == expected
        assert succeed(f"transfer target.png - {FACES} -o -", stdin=reference) == expected
        assert listing(place) == before

    def test_a_stream_keeps_the_format_of_the_target(self, studio, place, succeed):
        Image.fromarray(studio.target).save(place / "target.bmp")
        with Image.open(io.BytesIO(succeed(f"transfer target.bmp reference.png {FACES} -o -"))) as picture:
            assert picture.format == "BMP"

    def test_force(self, place, fail, succeed):
        succeed(f"{TRANSFER} -o out.png")
        expected = (place / "out.png").read_bytes()
        (place / "out.png").write_bytes(b"precious")
        assert "out.png: exists already; use --force" in fail(f"{TRANSFER} -o out.png")
        succeed(f"{TRANSFER} -o out.png --force")
        assert (place / "out.png").read_bytes() == expected

    def test_a_photo_can_be_relit_in_place(self, plain, succeed):
        succeed(f"{TRANSFER} -o target.png --force")
        np.testing.assert_array_equal(pixels_of("target.png"), plain.image)

    @pytest.mark.parametrize("flags", ["", "--no-mask"])
    def test_stages(self, place, plain, fail, succeed, flags):
        report = json.loads(succeed(f"{TRANSFER} -o out.png --stages steps --json {flags}"))
        names = {*figures.stage_pictures(plain), "sheet"} - ({"known", "mask"} if flags else set())
        assert {path.name for path in (place / "steps").iterdir()} == {f"{name}.png" for name in names}
        assert sorted(report["stages"]) == sorted(f"steps/{name}.png" for name in names)
        np.testing.assert_array_equal(pixels_of("steps/result.png"), pixels_of("out.png"))
        before = listing(place / "steps")
        assert "exists already" in fail(f"{TRANSFER} -o other.png --stages steps {flags}")
        succeed(f"{TRANSFER} -o other.png --stages steps --force {flags}")
        assert listing(place / "steps") == before

    def test_a_second_reference(self, place, fail, succeed):
        succeed(f"{TRANSFER} -o out.png --method quotient --second-reference reference.png --stages steps")
        # A reference in the light that the target has already changes nothing.
        np.testing.assert_allclose(pixels_of("out.png").astype(int), pixels_of("target.png"), atol=2)
        np.testing.assert_array_equal(
            pixels_of("steps/warped_second_reference.png"), pixels_of("steps/warped_reference.png")
        )
        assert "second_reference: expected the reference's face" in fail(
            f"{TRANSFER} -o o.png --method quotient", code=2
        )
        assert "expected none with method 'shading'" in fail(
            f"{TRANSFER} -o o.png --second-reference target.png", code=2
        )
        assert "belong to a --second-reference" in fail(f"{TRANSFER} -o o.png --second-face 1", code=2)
        assert not (place / "o.png").exists()

    def test_stages_are_what_the_library_draws(self, plain, succeed):
        succeed(f"{TRANSFER} -o out.png --stages steps")
        for name, picture in figures.stage_pictures(plain).items():
            np.testing.assert_array_equal(pixels_of(f"steps/{name}.png"), picture)
        np.testing.assert_array_equal(pixels_of("steps/sheet.png"), figures.contact_sheet(plain))

    @pytest.mark.parametrize("clash", ["steps/result.png", "steps/../steps/target_u.png"])
    def test_a_photo_that_is_a_stage_too_is_refused(self, place, fail, clash):
        (place / "steps").mkdir()
        assert fail(f"{TRANSFER} -o {clash} --stages steps", code=(1, 2))

    def test_no_stages_of_a_photo_that_cannot_be_written(self, studio, place, fail):
        Image.fromarray(studio.target).convert("L").save(place / "grey.png")
        message = fail(f"transfer grey.png reference.png {FACES} -o out.pgm --stages steps")
        assert "PGM cannot hold colours" in message

    def test_json(self, studio, plain, succeed):
        report = json.loads(succeed(f"{TRANSFER} -o out.png --json"))
        assert report["output"] == "out.png"
        assert "stages" not in report
        assert report["lambda_px"] == 0.2 * 100 / studio.target_landmarks.interocular_distance
        assert report["smoothing"] == plain.first.alignment.smoothing
        assert report["folded"] == plain.first.alignment.folded
        assert TransferOptions(**report["options"]) == TransferOptions()
        for role in ROLES:
            height, width = vars(studio)[role].shape[:2]
            assert report[role] == {
                "path": f"{role}.png",
                "width": width,
                "height": height,
                "scheme": "mesh478",
                "confidence": None,
                "interocular_distance": vars(studio)[f"{role}_landmarks"].interocular_distance,
            }

    @pytest.mark.parametrize("extension", ["json", "csv"])
    def test_found_landmarks_can_be_given_back(self, plain, succeed, extension):
        for role in ROLES:
            succeed(f"landmarks {role}.png -o {role}.{extension} --force")
        marks = " ".join(f"--{role}-landmarks {role}.{extension}" for role in ROLES)
        succeed(f"transfer target.png reference.png {marks} -o out.png")
        np.testing.assert_array_equal(pixels_of("out.png"), plain.image)

    def test_formats_without_depth_give_the_same_points(self, studio, place, succeed):
        # Without its depth, a face that is turned away a little is taken as a little smaller.
        flat = Landmarks(studio.target_landmarks.xy)
        expected = relighting.transfer(
            studio.target,
            studio.reference,
            target_landmarks=flat,
            reference_landmarks=studio.reference_landmarks,
        )
        for extension in ("pts", "tem", "xml"):
            write_landmarks(place / f"t.{extension}", flat)
            succeed(
                f"transfer target.png reference.png --target-landmarks t.{extension} "
                "--reference-landmarks reference.csv -o out.png --force"
            )
            np.testing.assert_array_equal(pixels_of("out.png"), expected.image)

    def test_which_face(self, studio, place, fail, succeed):
        both = np.zeros((113, 170, 3), np.uint8)
        both[:82, :72], both[:104, 82:162] = studio.target, studio.reference
        Image.fromarray(both).save(place / "both.png")
        sides = []
        for face in ("--face 0", "--target-face 1"):
            light = "--reference-landmarks reference.csv"
            succeed(f"transfer both.png reference.png {light} {face} -o out.png --force")
            x = np.nonzero((pixels_of("out.png") != both).any(axis=(0, 2)))[0]
            sides.append("left" if x.max() < 77 else "right" if x.min() > 77 else "both")
        assert sorted(sides) == ["left", "right"]
        default, largest, other = (
            json.loads(succeed(f"landmarks both.png --json {face}"))["image"]["interocular_distance"]
            for face in ("", "--face 0", "--face 1")
        )
        assert default == largest > other
        for flags in ("both.png target.png --face 2", "target.png both.png --reference-face 2"):
            role = "reference" if "reference" in flags else "target"
            marks = "target" if role == "reference" else "reference"
            message = fail(f"transfer {flags} --{marks}-landmarks target.csv -o no.png")
            assert f"{role}: there is no face 2; 2 found" in message

    def test_names_in_any_script(self, place, succeed):
        odd = os.fsdecode(b"bad-\xff.png")
        for name in ("Füße 顔.png", odd):
            arguments = [*shlex.split(TRANSFER), "-o", name, "--json"]
            assert json.loads(succeed(*arguments))["output"] == name
            assert (place / name).is_file()


class TestOtherCommands:
    def test_samples(self, place, fail, succeed):
        names = {"target.png", "reference.jpg", "grey_target.png", "README.md"}
        assert succeed("samples photos") == b""
        originals = {file.name: file.read_bytes() for file in sample("target").parent.iterdir()}
        assert {path.name for path in (place / "photos").iterdir()} == names
        for path in (place / "photos").iterdir():
            assert path.read_bytes() == originals[path.name]
        (place / "photos" / "target.png").unlink()
        assert "photos/reference.jpg: exists already" in fail("samples photos")
        report = json.loads(succeed("samples photos --force --json"))
        assert {Path(path).name for path in report["output"]} == names
        assert (place / "photos" / "target.png").read_bytes() == originals["target.png"]

    def test_align(self, studio, succeed):
        report = json.loads(
            succeed(
                f"align target.png reference.png {FACES} -o out.png --json --smoothing 2 --kernel gaussian"
            )
        )
        expected = alignment.align(
            studio.reference,
            studio.reference_landmarks,
            studio.target_landmarks,
            studio.target.shape,
            kernel="gaussian",
            smoothing=2.0,
        )
        np.testing.assert_array_equal(pixels_of("out.png"), expected.warped)
        assert expected.warped.shape == studio.target.shape
        assert (report["smoothing"], report["folded"]) == (2.0, expected.folded)
        assert (report["target"]["path"], report["reference"]["path"]) == ("target.png", "reference.png")

    def test_align_leaves_alpha_behind_and_keeps_depth_and_profile(self, studio, place, succeed):
        deep = as_16_bits(studio.reference)
        alpha = np.full(deep.shape[:2], 999, np.uint16)
        write_image(place / "deep.png", Photo(deep, alpha=alpha, profile=rgb_profile()))
        succeed(f"align target.png deep.png {FACES} -o out.png")
        written = imagecodecs.png_decode((place / "out.png").read_bytes())
        expected = alignment.align(
            deep, studio.reference_landmarks, studio.target_landmarks, studio.target.shape
        )
        np.testing.assert_array_equal(written, expected.warped)
        assert written.dtype == np.uint16
        with Image.open(place / "out.png") as picture:
            assert picture.info["icc_profile"] == rgb_profile()

    @pytest.mark.parametrize("flags", ["--landmarks target.csv", "--eye-distance 50 --neighborhood 8"])
    def test_decompose(self, studio, succeed, flags):
        report = json.loads(succeed(f"decompose target.png -o parts --json --lambda 0.5 {flags}"))
        distance = 50 if "50" in flags else studio.target_landmarks.interocular_distance
        split = decompose(
            studio.target, 0.5, neighborhood=8 if "8" in flags else 4, interocular_distance=distance
        )
        u, v = (pixels_of(f"parts/{name}.png") for name in "uv")
        assert np.abs(u / 255 - split.u).max() <= 0.5 / 255 + 1e-6
        assert np.abs(v / 255 * 2 - np.minimum(split.v, 2)).max() <= 1 / 255 + 1e-6
        # Up to the rounding of both, the pictures multiply to the photo where v is not cut off.
        kept = v < 255
        assert np.abs(u * (v / 127.5) - studio.target)[kept].max() < 3
        assert report == {
            "output": ["parts/u.png", "parts/v.png"],
            "lambda_px": 0.5 * 100 / distance,
            "eye_distance": distance,
        }

    def test_lambda_auto(self, studio, succeed):
        lam = automatic_lam(studio.target_found)
        report = json.loads(succeed("decompose target.png -o parts --json --lambda auto"))
        assert report["lambda_px"] == pytest.approx(lam * 100 / studio.target_found.interocular_distance)
        report = json.loads(succeed("transfer target.png reference.png -o out.png --json --lambda auto"))
        assert report["options"]["lam"] == "auto"
        assert report["lambda_px"] == pytest.approx(lam * 100 / studio.target_found.interocular_distance)

    @pytest.mark.parametrize("flags", ["--landmarks target.csv", "--eye-distance 50 --neighborhood 8"])
    def test_normalize(self, studio, succeed, flags):
        report = json.loads(succeed(f"normalize target.png -o light-free.png --json --lambda 0.5 {flags}"))
        distance = 50 if "50" in flags else studio.target_landmarks.interocular_distance
        v = normalize(
            studio.target, 0.5, neighborhood=8 if "8" in flags else 4, interocular_distance=distance
        )
        assert np.abs(pixels_of("light-free.png") / 255 - v).max() <= 0.5 / 255 + 1e-6
        assert report == {
            "output": "light-free.png",
            "lambda_px": pytest.approx(0.5 * 100 / distance),
            "eye_distance": distance,
        }

    def test_decompose_finds_the_face(self, studio, succeed):
        report = json.loads(succeed("decompose target.png -o parts --json"))
        assert report["eye_distance"] == studio.target_found.interocular_distance

    @pytest.mark.parametrize("extension", ["pts", "tem", "json", "ljson", "csv", "xml"])
    def test_landmarks_file(self, studio, place, succeed, extension):
        assert succeed(f"landmarks target.png -o marks.{extension}") == b""
        write_landmarks(place / f"expected.{extension}", studio.target_found, image_name="target.png")
        assert (place / f"marks.{extension}").read_bytes() == (place / f"expected.{extension}").read_bytes()

    def test_landmarks_json(self, studio, place, succeed):
        before = listing(place)
        report = json.loads(succeed("landmarks target.png --json"))
        found = studio.target_found
        assert np.abs(np.array(report["points"]) - found.points).max() <= 0.0005 + 1e-9
        assert report["image"]["confidence"] == found.confidence
        assert (report["image"]["width"], report["image"]["height"]) == (72, 82)
        assert listing(place) == before
        report = json.loads(succeed("landmarks target.png --json -o marks.csv"))
        assert "points" not in report
        assert report["output"] == "marks.csv"

    def test_landmarks_overlay(self, studio, place, succeed):
        expected = figures.landmark_overlay(studio.target, studio.target_found)
        assert (expected != studio.target).any()
        succeed("landmarks target.png --overlay seen.png")
        np.testing.assert_array_equal(pixels_of("seen.png"), expected)
        assert succeed("landmarks target.png --overlay -") == (place / "seen.png").read_bytes()

    def test_no_landmarks_without_their_overlay(self, fail):
        assert "PGM cannot hold colours" in fail("landmarks target.png -o marks.pts --overlay seen.pgm")


class TestRefusals:
    """Whatever is wrong is told in one line, and nothing is written."""

    @pytest.fixture(autouse=True)
    def bad_files(self, place):
        (place / "text.jpg").write_text("Dear diary, today I am a photo.\n")
        jpeg = sample("reference").read_bytes()
        (place / "cut.jpg").write_bytes(jpeg[: len(jpeg) // 2])
        (place / "empty.png").write_bytes(b"")
        (place / "folder").mkdir()
        Image.new("RGB", (1, 1)).save(place / "one.png")
        noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
        Image.fromarray(noise).save(place / "noise.png")
        points = np.random.default_rng(0).uniform(10, 60, (68, 2))
        write_landmarks(place / "other.pts", Landmarks(points))
        write_landmarks(place / "far.csv", Landmarks(read_landmarks("target.csv").points + 300))
        (place / "cut.csv").write_bytes((place / "target.csv").read_bytes()[:1001])

    @pytest.mark.parametrize("command", ["transfer", "align", "decompose", "landmarks"])
    @pytest.mark.parametrize(
        ("photo", "message"),
        [
            ("text.jpg", f"text.jpg: found a text file; convert it to {IMAGES} first"),
            ("cut.jpg", "cut.jpg: the JPEG data is damaged or cut short; get the file again"),
            ("empty.png", "empty.png: is empty; get the file again"),
            ("one.png", "one.png: 1x1 px cannot hold a face; each side must be at least 8 px"),
            ("folder", "folder: is a folder; give the name of one photo in it"),
            ("missing.png", "missing.png: there is no such file; check the name"),
            ("'a\0b.png'", "cannot be read (embedded null byte); give the file name of a photo"),
            ("noise.png", ": no face found; use a photo with a larger, upright face"),
            ("-", "-: is empty; get the file again"),
        ],
    )
    def test_photo(self, fail, command, photo, message):
        output = {"decompose": "parts", "landmarks": "out.csv"}.get(command, "out.png")
        other = "reference.png" if command in ("transfer", "align") else ""
        assert message in fail(f"{command} {photo} {other} -o {output}")

    @pytest.mark.parametrize("photo", ["text.jpg", "cut.jpg", "noise.png", "missing.png"])
    def test_reference_photo(self, fail, photo):
        subject = "reference" if photo == "noise.png" else photo
        assert fail(f"transfer target.png {photo} -o out.png --stages steps").startswith(f"{subject}: ")

    @pytest.mark.parametrize("command", ["transfer", "align"])
    @pytest.mark.parametrize(
        ("flags", "message"),
        [
            (
                "--target-landmarks other.pts",
                "the target has 68 points (ibug68), the reference has 478 (mesh478)",
            ),
            (
                "--target-landmarks far.csv",
                "target_landmarks: 478 of 478 points lie outside the 72x82 image",
            ),
            ("--target-landmarks missing.pts", "missing.pts: cannot be read (No such file or directory)"),
            ("--target-landmarks target.png", "target.png: unknown landmark format '.png'"),
            ("--target-landmarks cut.csv", "the target has 18 points (points), the"),
            ("--target-landmarks folder", "folder: "),
            ("--target-landmarks target.csv --face 1", "target.csv: has no face 1: it holds 1"),
            ("--face 3", "target: there is no face 3; 1 found"),
        ],
    )
    def test_face(self, fail, command, flags, message):
        given = "--reference-landmarks reference.csv"
        assert message in fail(f"{command} target.png reference.png {given} {flags} -o out.png")

    def test_swapped_landmarks_are_told_by_their_own_option(self, fail):
        line = fail("transfer target.png reference.png --target-landmarks far.csv -o out.png --swap")
        assert "target_landmarks: " in line

    def test_swapped_advice_helps(self, place, fail, run):
        command = "transfer noise.png reference.png -o out.png --swap"
        line = fail(command)
        flag = next(word for word in line.replace("(", " ").split() if word.startswith("--"))
        write_landmarks(place / "noise.csv", Landmarks(read_landmarks("target.csv").points / 2))
        assert run(f"{command} {flag} noise.csv").code == 0

    @pytest.mark.parametrize("command", [TRANSFER, f"align target.png reference.png {FACES}"])
    @pytest.mark.parametrize(
        ("output", "message"),
        [
            ("no/such/out.png", "no/such/out.png: there is no folder no/such; create it"),
            ("out.gif", "out.gif: no format to write goes by '.gif'; use one of .jpg, "),
            ("out", "out: the name has no extension"),
            ("''", "the name has no extension"),
            ("folder", "folder: the name has no extension"),
            ("folder.png", "folder.png: is not a file"),
            ("target.png", "target.png: exists already; use --force"),
            ("'a\0b.png'", "embedded null byte"),
            ("out.pgm", "out.pgm: PGM cannot hold colours; write PPM, or another format"),
            (f"{'a' * 300}.png", "File name too long"),
        ],
    )
    def test_output(self, place, fail, command, output, message):
        (place / "folder.png").mkdir()
        assert message in fail(f"{command} -o {output}")

    @pytest.mark.parametrize("output", ["target.png", "no/out.png", "out.gif", "out.pgm"])
    @pytest.mark.parametrize("command", ["transfer", "align"])
    def test_output_is_refused_before_any_work(self, fail, monkeypatch, command, output):
        def work(*_arguments, **_options):
            pytest.fail("looks for faces first")

        monkeypatch.setattr(detect, "detect_landmarks", work)
        assert output in fail(f"{command} target.png reference.png -o {output}")

    def test_alpha_is_not_dropped_silently(self, place, fail):
        Image.new("RGBA", (72, 82)).save(place / "clear.png")
        assert "out.jpg: JPEG cannot hold the photo's alpha" in fail(
            f"transfer clear.png reference.png {FACES} -o out.jpg"
        )

    @pytest.mark.parametrize(
        ("command", "message"),
        [
            (f"{TRANSFER} -o out.png --stages no/such", "no/such: there is no folder no"),
            (f"{TRANSFER} -o out.png --stages target.png", "target.png: is not a folder"),
            ("decompose target.png -o no/such", "no/such: there is no folder no"),
            ("decompose target.png -o target.png", "target.png: is not a folder"),
            ("samples no/such", "no/such: this folder cannot be made"),
            ("samples target.png", "target.png: this folder cannot be made"),
            ("landmarks target.png -o out.foo", "out.foo: unknown landmark format '.foo'"),
            ("landmarks target.png -o out.foo --overlay out.png", "out.foo: unknown landmark format '.foo'"),
            (
                "landmarks target.png -o out.csv --overlay out.foo",
                "out.foo: no format to write goes by '.foo'",
            ),
            ("landmarks target.png -o target.csv", "target.csv: exists already"),
            ("landmarks target.png -o no/such.csv", "no/such.csv: there is no folder no"),
            ("landmarks target.png -o out.csv --overlay target.png", "target.png: exists already"),
        ],
    )
    def test_other_places(self, fail, command, message):
        assert message in fail(command)

    @pytest.mark.parametrize("flag", ["--lambda", "--smoothing"])
    @pytest.mark.parametrize("value", ["-1", "nan", "inf", "-inf", "1e999", "abc", "''", "0x1"])
    def test_numbers(self, fail, flag, value):
        line = fail(f"{TRANSFER} -o out.png {flag} {value}", code=2)
        assert flag.strip("-")[:3] in line

    def test_lambda_is_above_0(self, fail):
        line = fail(f"{TRANSFER} -o out.png --lambda 0", code=2)
        assert "--lambda: expected a finite number above 0, or 'auto', got 0.0" in line
        line = fail(f"{TRANSFER} -o out.png --lambda little", code=2)
        assert "'little' is neither a number nor 'auto'" in line

    @pytest.mark.parametrize("value", ["0", "-3", "nan", "inf", "abc"])
    def test_eye_distance(self, fail, value):
        assert "distance" in fail(f"decompose noise.png -o parts --eye-distance {value}", code=2)

    @pytest.mark.parametrize(
        ("command", "message"),
        [
            ("decompose target.png -o parts --lambda auto --eye-distance 50", "auto needs the face"),
            ("normalize target.png -o - --json", "stdout cannot take both"),
            (f"{TRANSFER} -o out.png --neighborhood 5", "'5' is not one of '4', '8', '16', 'isotropic'"),
            (f"{TRANSFER} -o out.png --kernel foo", "'foo' is not one of 'thin_plate_spline'"),
            (f"{TRANSFER} -o out.png --color-space lab", "'lab' is not one of 'rgb', 'hsv', 'ycbcr'"),
            (f"{TRANSFER} -o out.png --method magic", "'magic' is not"),
            (f"{TRANSFER} -o out.png --channels v", "channels: expected one of all, r, g, b for"),
            (f"{TRANSFER} -o out.png --channels primary", "channels: expected one of all, r, g, b for"),
            (f"{TRANSFER} -o out.png --bogus", "--bogus"),
            (f"{TRANSFER} -o out.png --face -1", "-1 is not in the range"),
            (f"{TRANSFER} -o out.png --face one", "'one' is not a valid"),
            (f"{TRANSFER} -o out.png third.png", "--reference-landmarks was given 1 times for 2 photos"),
            (f"{TRANSFER} -o out.png third.png --light rim", "given 1 times for 2 photos"),
            ("transfer target.png reference.png --light rim -o out.png", "Give a REFERENCE, or --light, and"),
            ("transfer target.png --light sun -o out.png", "--light: expected one of rembrandt"),
            ("transfer target.png --light rim --swap -o out.png", "--swap takes one REFERENCE"),
            (f"{TRANSFER} -o out.png --all-faces", "--all-faces goes with no --face"),
            (f"{TRANSFER} -o out.png --strength -1", "--strength: expected a finite number of 0 or more"),
            (f"{TRANSFER} -o out.png --region hat", "--region: expected face, or parts"),
            (f"{TRANSFER} -o out.png --exposure much", "'much' is neither a number nor 'keep' nor 'take'"),
            (TRANSFER, "Missing option '-o'"),
            ("transfer target.png -o out.png", "Give a REFERENCE, or --light"),
            ("transfer - - -o out.png", "stdin holds one photo"),
            (f"{TRANSFER} -o - --json", "stdout cannot take both the photo and --json"),
            (f"align target.png reference.png {FACES} -o - --json", "stdout cannot take both"),
            ("landmarks target.png --overlay - --json", "stdout cannot take both"),
            ("align target.png reference.png -o out.png --lambda 1", "--lambda"),
            ("landmarks target.png", "Nothing to do: give -o FILE, --overlay PICTURE or --json."),
            ("decompose target.png -o parts --eye-distance 9 --face 0", "--eye-distance stands in for the"),
            (
                "decompose target.png -o parts --eye-distance 9 --landmarks target.csv",
                "--eye-distance stands",
            ),
            ("relight target.png", "No such command 'relight'"),
        ],
    )
    def test_usage(self, fail, command, message):
        assert message in fail(command, code=2)

    def test_a_huge_photo_without_a_face(self, place, fail):
        Image.new("L", (4000, 3000), 120).save(place / "huge.png", compress_level=1)
        assert "target: no face found" in fail("transfer huge.png reference.png -o out.png")

    def test_a_photo_beyond_all_cameras(self, place, fail):
        # A PNG that claims 60000 x 60000 px and holds none of them.
        head = b"\x89PNG\r\n\x1a\n" + bytes.fromhex(
            "0000000d4948445200 00ea6000 00ea6008 02000000".replace(" ", "")
        )
        (place / "bomb.png").write_bytes(head + bytes(200))
        assert fail("transfer bomb.png reference.png -o out.png").startswith("bomb.png: ")

    def test_a_name_cannot_write_on_the_terminal(self, fail):
        assert "\x1b" not in fail(
            "transfer", "a\nrelit: all is well\x1b[2J.png", "reference.png", "-o", "out.png"
        )

    @pytest.mark.parametrize(
        "command", [f"{TRANSFER} -o out.png", "samples photos", "decompose target.png -o p"]
    )
    def test_a_full_disk(self, place, run, monkeypatch, command):
        def full(_file):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(files.os, "fsync", full)
        before = listing(place)
        done = run(command)
        assert done.code == 1
        assert "cannot be written (No space left on device)" in the_line(done.err)
        # A folder that was made may stay, empty.
        assert {name: digest for name, digest in listing(place).items() if digest or name in before} == before

    @pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is closed to root")
    def test_a_closed_folder(self, place, fail):
        (place / "folder").chmod(0o500)
        try:
            assert "folder/out.png: cannot be written" in fail(f"{TRANSFER} -o folder/out.png")
        finally:
            (place / "folder").chmod(0o700)

    def test_too_little_memory(self, fail, monkeypatch):
        def starve(*_arguments, **_options):
            raise MemoryError

        monkeypatch.setattr(ltv_swap, "decompose", starve)
        assert fail(f"{TRANSFER} -o out.png --method ltv").startswith(
            "not enough memory for photos of this size"
        )


# What a command takes besides transfer options.
PHOTOS = {"target", "reference", "target_landmarks", "target_face", "reference_landmarks", "reference_face"}
OTHERS = {
    "transfer": PHOTOS - {"reference"}
    | {
        "references",
        "second_reference",
        "second_landmarks",
        "second_face",
        "region_mask",
        "all_faces",
        "config",
    }
    | {"output", "swap", "stages", "sheet", "timings", "force", "as_json"},
    "align": PHOTOS | {"output", "force", "as_json"},
    "batch": {"manifest", "kind", "output", "targets", "references", "pairing", "seed", "suffix", "engine"}
    | {"workers", "address", "limit", "dry_run", "results", "journal", "cache_size", "force", "as_json"},
    "decompose": {"image", "output", "landmarks", "face", "eye_distance", "force", "as_json"},
    "normalize": {"image", "output", "landmarks", "face", "eye_distance", "force", "as_json"},
    "evaluate": {"source", "protocol", "chosen", "lams", "jobs", "limit", "output", "figure", "number"}
    | {"force", "as_json"},
    "landmarks": {"image", "output", "overlay", "face", "force", "as_json"},
    "samples": {"folder", "force", "as_json"},
    "studio": {"photos", "port", "opened"},
    "serve": {"host", "port", "names", "page"},
}
OPTIONS = {
    "transfer": set(FIELDS),
    "batch": set(FIELDS),
    "align": {"kernel", "affine", "smoothing"},
    "decompose": {"lam", "neighborhood"},
    "normalize": {"lam", "neighborhood"},
    "evaluate": {"method", "exposure", "neighborhood", "split_first", "kernel", "affine", "smoothing"},
}


class TestOneSourceOfOptions:
    """Flags, defaults, choices and help of the command line are those of `TransferOptions`."""

    @staticmethod
    def parameters(command):
        return {parameter.name: parameter for parameter in module.relit.commands[command].params}

    def test_commands(self):
        assert set(module.relit.commands) == set(OTHERS)

    @pytest.mark.parametrize("command", OTHERS)
    def test_there_are_no_other_parameters(self, command):
        assert set(self.parameters(command)) == OPTIONS.get(command, set()) | OTHERS[command]

    @pytest.mark.parametrize(
        ("command", "name"), [(c, n) for c, names in OPTIONS.items() for n in sorted(names)]
    )
    def test_each_option(self, command, name):
        parameter, field = self.parameters(command)[name], FIELDS[name]
        flag = {"lam": "--lambda"}.get(name, f"--{name.replace('_', '-')}")
        assert parameter.opts == [flag] == [field.metadata["flag"]]
        assert parameter.help == field.metadata["help"]
        assert not parameter.required
        if isinstance(field.default, bool):
            assert parameter.secondary_opts == [flag.replace("--", "--no-")]
        if field.metadata["choices"]:
            assert isinstance(parameter.type, click.Choice)
            assert list(parameter.type.choices) == [str(choice) for choice in field.metadata["choices"]]

    @pytest.fixture
    def options_of(self, run, monkeypatch):
        """Return the options with which the library would be called."""
        received = []

        def stop(*_arguments, options, **_others):
            received.append(options)
            raise KeyboardInterrupt

        monkeypatch.setattr(relighting, "transfer", stop)

        def of(*flags):
            assert run(*shlex.split(TRANSFER), "-o", "out.png", *flags).code == 130
            return received.pop()

        return of

    def test_defaults(self, options_of):
        assert options_of() == TransferOptions()

    @pytest.mark.parametrize(
        ("name", "choice"),
        [(name, choice) for name, field in FIELDS.items() for choice in field.metadata["choices"]],
    )
    def test_every_choice_arrives(self, options_of, name, choice):
        options = options_of(FIELDS[name].metadata["flag"], str(choice))
        assert options == TransferOptions(**{name: choice})
        assert type(getattr(options, name)) is type(choice)

    @pytest.mark.parametrize(
        ("space", "channel"),
        [
            (name, channel)
            for name, space in COLOR_SPACES.items()
            for channel in ("all", *space.channels, *(["primary"] if space.primary else []))
        ],
    )
    def test_every_channel_arrives(self, options_of, space, channel):
        options = options_of("--method", "ltv", "--color-space", space, "--channels", channel)
        assert options == TransferOptions(method="ltv", color_space=space, channels=channel)

    @pytest.mark.parametrize(
        "name", [name for name, field in FIELDS.items() if isinstance(field.default, bool)]
    )
    @pytest.mark.parametrize("value", [True, False])
    def test_every_switch_arrives(self, options_of, name, value):
        assert options_of(f"--{'' if value else 'no-'}{name.replace('_', '-')}") == TransferOptions(
            **{name: value}
        )

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("lam", 1e-3),
            ("lam", 7.25),
            ("smoothing", 0.0),
            ("exposure", 0.25),
            ("tint", 1.0),
            ("strength", 0.5),
            ("shadows", 0.0),
            ("highlights", 1.5),
        ],
    )
    def test_numbers_arrive(self, options_of, name, value):
        assert options_of(FIELDS[name].metadata["flag"], repr(value)) == TransferOptions(**{name: value})

    def test_every_field_is_tried_above(self):
        tried = {"channels", "exposure", "lam", "smoothing", "tint", "strength", "shadows", "highlights"}
        tried |= {"light", "region"}  # in TestControl
        for name, field in FIELDS.items():
            assert field.metadata["choices"] or isinstance(field.default, bool) or name in tried

    @pytest.mark.parametrize("command", OTHERS)
    def test_help(self, succeed, command):
        shown = "".join(succeed(f"{command} --help").decode().split())
        assert shown == "".join(succeed(f"{command} -h").decode().split())
        for name in OPTIONS.get(command, set()):
            field = FIELDS[name]
            assert "".join(field.metadata["help"].split()) in shown
            assert field.metadata["flag"] in shown
            assert "|".join(map(str, field.metadata["choices"])) in shown
            if not (field.default is None or isinstance(field.default, bool)):
                assert f"[default:{field.default}]" in shown
        for parameter in self.parameters(command).values():
            if isinstance(parameter, click.Option):
                assert parameter.help
                assert parameter.opts[-1] in shown

    def test_overview(self, succeed, run):
        shown = succeed("--help").decode()
        assert all(f"\n  {command} " in shown for command in OTHERS)
        assert run().code == 2

    def test_version(self, succeed):
        from relit import __version__

        assert succeed("--version").decode().split()[-1] == __version__


class TestInterruption:
    @pytest.mark.parametrize(
        ("owner", "name"),
        [
            (detect, "detect_landmarks"),
            (inputs, "align"),
            (explained, "fit_light"),
            (relighting, "blend"),
            (figures, "contact_sheet"),
        ],
    )
    def test_nothing_is_written(self, place, run, monkeypatch, owner, name):
        def press_control_c(*_arguments, **_options):
            raise KeyboardInterrupt

        monkeypatch.setattr(owner, name, press_control_c)
        before = listing(place)
        faces = "" if owner is detect else FACES
        done = run(f"transfer target.png reference.png {faces} -o out.png --stages steps")
        assert (done.code, done.out, done.err.strip()) == (130, b"", "relit: interrupted")
        assert listing(place) == before

    def test_nothing_is_half_written(self, place, run, monkeypatch):
        def press_control_c(_file):
            raise KeyboardInterrupt

        monkeypatch.setattr(files.os, "fsync", press_control_c)
        (place / "out.png").write_bytes(b"old")
        before = listing(place)
        done = run(f"{TRANSFER} -o out.png --force")
        assert (done.code, done.err.strip()) == (130, "relit: interrupted")
        assert listing(place) == before

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
    def test_a_real_signal(self, place):
        if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
            pytest.skip("these tests run in the background, where children ignore Ctrl-C")
        os.mkfifo(place / "slow.png")
        command = [*PYTHON[:1], *PYTHON[3:], "transfer", "slow.png", "reference.png", "-o", "out.png"]
        with (
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child,
            (place / "slow.png").open("wb"),  # opens as soon as the command has opened it to read
        ):
            child.send_signal(signal.SIGINT)
            out, err = child.communicate(timeout=30)
        assert (child.returncode, out) == (130, b"")
        assert err.decode().strip() == "relit: interrupted"
        assert {path.name for path in place.iterdir()} == {
            "slow.png",
            *(f"{role}.{kind}" for role in ROLES for kind in ("png", "csv")),
        }


@pytest.mark.usefixtures("place")
class TestProcess:
    """What only a process of its own shows: pipes, closed streams, and what C++ code prints."""

    @staticmethod
    def call(arguments, **streams):
        done = subprocess.run(
            [*PYTHON, *shlex.split(arguments)], stderr=subprocess.PIPE, timeout=60, check=False, **streams
        )
        return SimpleNamespace(code=done.returncode, out=done.stdout, err=done.stderr.decode())

    @contextlib.contextmanager
    def nobody_reads(self):
        reader, writer = os.pipe()
        os.close(reader)
        try:
            yield writer
        finally:
            os.close(writer)

    def test_silence(self, studio, place):
        done = self.call(
            "transfer - reference.png -o -",
            input=(place / "target.png").read_bytes(),
            stdout=subprocess.PIPE,
        )
        assert (done.code, done.err) == (0, "")
        with Image.open(io.BytesIO(done.out)) as picture:
            expected = relighting.transfer(studio.target, studio.reference).image
            np.testing.assert_array_equal(np.asarray(picture), expected)

    def test_a_photo_that_nobody_reads(self):
        with self.nobody_reads() as pipe:
            done = self.call("landmarks target.png --overlay -", stdout=pipe)
        assert done.code == 1
        assert "cannot be written" in the_line(done.err)

    def test_json_that_nobody_reads(self):
        with self.nobody_reads() as pipe:
            done = self.call("landmarks target.png --json", stdout=pipe)
        assert done.code == 1
        assert "Traceback" not in done.err
        assert "Exception" not in done.err

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
    def test_a_photo_on_a_full_device(self):
        with Path("/dev/full").open("wb") as full:
            done = self.call("landmarks target.png --overlay -", stdout=full)
        assert done.code == 1
        assert "No space left on device" in the_line(done.err)

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
    def test_json_on_a_full_device(self):
        with Path("/dev/full").open("wb") as full:
            done = self.call("landmarks target.png --json", stdout=full)
        assert done.code == 1
        assert "No space left on device" in the_line(done.err)

    @pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
    @pytest.mark.parametrize(
        "command", ["landmarks target.png --overlay - >&-", "landmarks - -o out.csv <&-"]
    )
    def test_closed_streams(self, command):
        script = f"exec {shlex.join(PYTHON)} {command}"
        done = subprocess.run(["sh", "-c", script], stderr=subprocess.PIPE, timeout=60, check=False)
        assert done.returncode == 1
        assert the_line(done.stderr.decode())
