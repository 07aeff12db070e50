"""The commands beside `transfer` give what the library gives."""

import json
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from PIL import Image

from relit import figures
from relit.face.landmark_files import write_landmarks
from relit.ltv.decomposition import decompose, normalize
from relit.ltv.g_value import automatic_lam
from relit.photo.photo import Photo
from relit.photo.samples import sample
from relit.photo.writing import write_image
from relit.warp import alignment
from tests.cli.photos import as_16_bits, rgb_profile
from tests.command import FACES, listing, pixels_of


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
