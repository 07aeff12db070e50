"""Which photo, which face, which way round: what a transfer takes and where it puts what it makes."""

import io
import json
import os
import shlex

import numpy as np
import pytest
from PIL import Image

from relit import figures, relighting
from relit.face.landmark_files import write_landmarks
from relit.face.landmarks import Landmarks
from relit.settings.options import TransferOptions
from tests.cli.photos import ROLES
from tests.command import FACES, TRANSFER, listing, pixels_of


class TestPlaces:
    """Where photos come from and go to."""

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

    def test_names_in_any_script(self, place, succeed):
        odd = os.fsdecode(b"bad-\xff.png")
        for name in ("Füße 顔.png", odd):
            arguments = [*shlex.split(TRANSFER), "-o", name, "--json"]
            assert json.loads(succeed(*arguments))["output"] == name
            assert (place / name).is_file()


class TestFacesGiven:
    """Faces are found, chosen, or given by landmark files."""

    def test_faces_are_found_where_no_landmarks_are_given(self, studio, plain, succeed):
        report = json.loads(succeed("transfer target.png reference.png -o out.png --json"))
        np.testing.assert_array_equal(pixels_of("out.png"), plain.image)
        for role in ROLES:
            assert report[role]["confidence"] == vars(studio)[f"{role}_found"].confidence > 0.5

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
            x = np.nonzero((pixels_of("out.png") != both).any(axis=2))[1]
            # The two touch, and a change of light goes a little beyond the person.
            sides.append("left" if np.mean(x < 77) > 0.9 else "right" if np.mean(x > 77) > 0.9 else "both")
        assert sorted(sides) == ["left", "right"]
        default, largest, other = (
            json.loads(succeed(f"landmarks both.png --json {face}"))["image"]["interocular_distance"]
            for face in ("", "--face 0", "--face 1")
        )
        assert default == largest > other
        for flags in ("both.png target.png --face 2", "target.png both.png --reference-face 2"):
            marks = "target" if "--reference-face" in flags else "reference"
            message = fail(f"transfer {flags} --{marks}-landmarks target.csv -o no.png")
            assert message.startswith("both.png: there is no face 2; 2 found")


class TestStages:
    """What a transfer tells and shows besides its photo."""

    @pytest.mark.parametrize("flags", ["", "--no-mask"])
    def test_stages(self, place, plain, fail, succeed, flags):
        report = json.loads(succeed(f"{TRANSFER} -o out.png --stages steps --json {flags}"))
        names = {*figures.stage_pictures(plain), "sheet"} - ({"mask"} if flags else set())
        assert {path.name for path in (place / "steps").iterdir()} == {f"{name}.png" for name in names}
        assert sorted(report["stages"]) == sorted(f"steps/{name}.png" for name in names)
        np.testing.assert_array_equal(pixels_of("steps/result.png"), pixels_of("out.png"))
        before = listing(place / "steps")
        assert "exists already" in fail(f"{TRANSFER} -o other.png --stages steps {flags}")
        succeed(f"{TRANSFER} -o other.png --stages steps --force {flags}")
        assert listing(place / "steps") == before

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
