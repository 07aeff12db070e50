"""What the command line refuses, in one line and leaving nothing behind."""

import json
import os
import sys

import numpy as np
import pytest
from PIL import Image

from relit.face import detect
from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.face.landmarks import Landmarks
from relit.methods import paper
from relit.photo import atomic_files as files
from relit.photo.samples import sample
from tests.command import FACES, TRANSFER, listing, the_line

IMAGES = "JPEG, PNG, TIFF, WebP, PPM, PGM or BMP"


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
        assert fail(f"transfer target.png {photo} -o out.png --stages steps").startswith(f"{photo}: ")

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
                "far.csv: 478 of 478 points lie outside the 72x82 image",
            ),
            ("--target-landmarks missing.pts", "missing.pts: cannot be read (No such file or directory)"),
            ("--target-landmarks target.png", "target.png: unknown landmark format '.png'"),
            ("--target-landmarks cut.csv", "the target has 18 points (points), the"),
            ("--target-landmarks folder", "folder: "),
            ("--target-landmarks target.csv --face 1", "target.csv: has no face 1: it holds 1"),
            ("--face 3", "target.png: there is no face 3; 1 found"),
        ],
    )
    def test_face(self, fail, command, flags, message):
        given = "--reference-landmarks reference.csv"
        assert message in fail(f"{command} target.png reference.png {given} {flags} -o out.png")

    def test_swapped_landmarks_are_told_by_their_own_file(self, fail):
        line = fail("transfer target.png reference.png --target-landmarks far.csv -o out.png --swap")
        assert line.startswith("far.csv: ")

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

    def test_layers_are_refused_as_photos_are(self, place, fail, monkeypatch):
        monkeypatch.setattr(
            detect, "detect_landmarks", lambda *_a, **_k: pytest.fail("looks for faces first")
        )
        monkeypatch.setitem(sys.modules, "OpenEXR", None)
        (place / "there.ora").write_bytes(b"")
        for output, message in {
            "there.ora": "there.ora: exists already; use --force",
            "no/out.psd": "there is no folder no",
            "out.layers.exr": "out.layers.exr: OpenEXR files need an extra: pip install 'relit[exr]'",
        }.items():
            assert message in fail(f"transfer target.png reference.png -o {output}")
        told = fail("align target.png reference.png -o out.ora")
        assert "no format to write goes by '.ora'" in told

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
            ("landmarks target.png -o out.csv --overlay reference.png", "reference.png: exists already"),
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
        assert line.startswith("--lambda: expected a finite number above 0, or 'auto', got 'little'")

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
            (f"{TRANSFER} -o out.png --face -1", "'-1' is not a whole number of 0 or more"),
            (f"{TRANSFER} -o out.png --face one", "'one' is not a whole number of 0 or more"),
            (f"{TRANSFER} -o out.png third.png", "--reference-landmarks was given 1 times for 2 photos"),
            (f"{TRANSFER} -o out.png third.png --light rim", "given 1 times for 2 photos"),
            ("transfer target.png reference.png --light rim -o out.png", "Give a REFERENCE, or --light, and"),
            ("transfer target.png --light sun -o out.png", "--light: expected one of rembrandt"),
            ("transfer target.png --light rim --swap -o out.png", "--swap takes one REFERENCE"),
            (f"{TRANSFER} -o out.png --all-faces", "--all-faces goes with no --face"),
            (f"{TRANSFER} -o out.png --strength -1", "--strength: expected a finite number of 0 or more"),
            (f"{TRANSFER} -o out.png --region hat", "--region: expected face, or parts"),
            (
                f"{TRANSFER} -o out.png --exposure much",
                "--exposure: expected a finite number of -8 or more and at most 8, or 'keep', or",
            ),
            (TRANSFER, "Missing option '-o'"),
            ("transfer target.png -o out.png", "Give a REFERENCE, or --light"),
            ("transfer - - -o out.png", "stdin holds one photo"),
            (f"{TRANSFER} -o - --json", "stdout cannot take both the photo and --json"),
            (f"align target.png reference.png {FACES} -o - --json", "stdout cannot take both"),
            ("landmarks target.png --overlay - --json", "stdout cannot take both"),
            ("align target.png reference.png -o out.png --lambda 1", "--lambda"),
            ("landmarks target.png", "Nothing to do: give -o FILE, --overlay PICTURE or --json"),
            ("decompose target.png -o parts --eye-distance 9 --face 0", "--eye-distance stands in for the"),
            (
                "decompose target.png -o parts --eye-distance 9 --landmarks target.csv",
                "--eye-distance stands",
            ),
            ("relight target.png", "No such command 'relight'"),
            (f"video clip.mp4 --light rim -o out.mp4 --from {10**400}:00", "is not a time, as 62.5"),
        ],
    )
    def test_usage(self, fail, command, message):
        assert message in fail(command, code=2)

    @pytest.mark.parametrize(
        ("command", "line"),
        [
            ("relight", "No such command 'relight' (see relit --help)"),
            ("transfer", "Missing argument 'TARGET' (see relit transfer --help)"),
            ("evaluate missing", "FOLDER|TABLE: Path 'missing' does not exist (see relit evaluate --help)"),
            ("studio target.png", "Give a TARGET and a REFERENCE, or neither (see relit studio --help)"),
            (
                f"{TRANSFER} -o q.png --strength",
                "Option '--strength' requires an argument (see relit --help)",
            ),
            (
                f"{TRANSFER} -o q.png --strength lots",
                "--strength: expected a finite number of 0 or more and at most 4 (80% is 0.8), got 'lots' "
                "(see relit transfer --help)",
            ),
            (
                f"{TRANSFER} -o q.png --face=-1",
                "--face / --target-face: '-1' is not a whole number of 0 or more (see relit transfer --help)",
            ),
        ],
    )
    def test_what_is_wrong_with_a_command_is_one_line_with_its_help(self, fail, command, line):
        assert fail(command, code=2) == line

    @pytest.mark.parametrize(
        ("flags", "line"),
        [
            (
                "reference.png --method ltv --turn 30",
                "--turn: does nothing with method 'ltv'; leave it out, or",
            ),
            (
                "reference.png --method ltv --fill 0",
                "--fill: does nothing with method 'ltv'; leave it out, or",
            ),
            (
                "reference.png --method moments --lambda 1",
                "--lambda: does nothing with method 'moments'; lea",
            ),
            ("reference.png --split-first", "--split-first: does nothing with method 'shading'; leave it o"),
            (
                "--light loop --kernel gaussian",
                "--kernel: does nothing with a light by name; leave it out, o",
            ),
            (
                "--light loop --exposure take",
                "--exposure: does nothing with a light by name; leave it out, o",
            ),
            (
                "--light loop --tint take",
                "--tint: does nothing with a white light; leave it out, or give the",
            ),
        ],
    )
    def test_an_option_that_would_do_nothing(self, fail, flags, line):
        assert fail(f"transfer target.png {flags} -o q.png", code=2).startswith(line)

    @pytest.mark.parametrize(
        ("command", "line"),
        [
            ("batch --light loop --smoothing 5", "--smoothing: does nothing with a light by name; leave it"),
            ("batch --light loop --address tcp://x", "--address goes with --engine dask or ray"),
            (
                "video film.mp4 reference.png --method wls --tilt 5",
                "--tilt: does nothing with method 'wls'; l",
            ),
        ],
    )
    def test_so_do_other_commands(self, fail, command, line):
        photos = "--targets target.png" if command.startswith("batch") else ""
        assert fail(f"{command} {photos} -o q.mp4", code=2).startswith(line)

    def test_settings_in_a_file_and_rows_of_a_table_may_hold_all(self, place, run):
        (place / "all.json").write_text(json.dumps({"options": {"method": "ltv", "turn": 30, "fill": 0.5}}))
        assert run(f"{TRANSFER} -o q.png --config all.json").code == 0
        assert "--turn" in run(f"{TRANSFER} -o r.png --config all.json --turn 20").err
        (place / "rows.csv").write_text("target,reference,method\ntarget.png,reference.png,shading\n")
        assert run("batch rows.csv --method ltv --turn 30 -o lit --dry-run").code == 0

    def test_a_huge_photo_without_a_face(self, place, fail):
        Image.new("L", (4000, 3000), 120).save(place / "huge.png", compress_level=1)
        assert "huge.png: no face found" in fail("transfer huge.png reference.png -o out.png")

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

        monkeypatch.setattr(paper, "decompose", starve)
        assert fail(f"{TRANSFER} -o out.png --method ltv").startswith(
            "not enough memory for photos of this size"
        )
