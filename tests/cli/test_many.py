"""Several photos and one light: the batch that relights them; shares as percentages."""

import shlex

import numpy as np
import pytest
from PIL import Image

from tests.command import TRANSFER, in_library, pixels_of

HERE = "--target-landmarks target.csv"


class TestBatchIsTold:
    @pytest.fixture(autouse=True)
    def folder(self, place, studio):
        (place / "in").mkdir()
        for name in ("one", "two", "three"):
            Image.fromarray(studio.target).save(place / "in" / f"{name}.png")

    def told(self, fail, command):
        message = fail(command, code=2)
        assert message.startswith("Give a REFERENCE, or --light, and not both.")
        return message.partition("To relight all of them: relit ")[2]

    @pytest.mark.parametrize(
        ("photos", "flags", "command"),
        [
            ("one three two", "--light loop", "--targets 'in/*.png' --light loop -o lit"),
            ("three two", "--light loop -o out.png", "--targets 'in/t*.png' --light loop -o out"),
            (
                "one two",
                "--light=-30,20 --strength 80% --no-mask -o d/lit",
                "--targets in/one.png --targets in/two.png --light=-30,20 --strength 0.8 --no-mask -o d/lit",
            ),
        ],
    )
    def test_the_very_command(self, fail, photos, flags, command):
        names = " ".join(f"in/{name}.png" for name in photos.split())
        assert self.told(fail, f"transfer {names} {flags}") == f"batch {command}"

    def test_it_does_what_was_asked(self, place, fail, succeed, run):
        command = self.told(fail, "transfer in/one.png in/two.png --light loop --strength 50% -o out.png")
        assert run(f"{command} --jobs 1").code == 0
        assert {path.name for path in (place / "out").glob("*.png")} == {"one.png", "two.png"}
        succeed("transfer in/one.png --light loop --strength 50% -o one.png")
        np.testing.assert_array_equal(pixels_of("out/one.png"), pixels_of("one.png"))

    def test_many_names_are_one_pattern(self, place, fail, studio):
        names = [f"in/more{k}.png" for k in range(9)]
        for name in names:
            Image.fromarray(studio.target).save(place / name)
        assert self.told(fail, f"transfer {' '.join(names[:8])} --light rim") == (
            "batch --targets 'in/more*.png' --light rim -o lit"
        )

    def test_several_references_need_no_batch(self, run):
        done = run("transfer target.png reference.png reference.png")
        assert "Missing option '-o'" in done.err


class TestShares:
    @pytest.mark.parametrize(
        ("flags", "options"),
        [
            ("--strength 80%", {"strength": 0.8}),
            ("--shadows 150% --highlights 0%", {"shadows": 1.5, "highlights": 0.0}),
            ("--softness 12.5%", {"softness": 0.125}),
            ("--tint 30%", {"tint": 0.3}),
        ],
    )
    def test_percentages_are_shares(self, studio, succeed, flags, options):
        succeed(f"{TRANSFER} -o out.png {flags}")
        np.testing.assert_array_equal(pixels_of("out.png"), in_library(studio, **options).image)

    @pytest.mark.parametrize("flags", ["--turn 10%", "--exposure 50%", "--lambda 20%", "--smoothing 1%"])
    def test_what_is_no_share_has_none(self, fail, flags):
        flag, value = shlex.split(flags)
        message = fail(f"{TRANSFER} -o out.png {flag} {value}", code=2)
        assert message.startswith(f"{flag}: expected a finite number")
        assert f", got {value!r} (see" in message
        assert "80%" not in message

    def test_a_share_keeps_its_range(self, fail):
        assert "at most 4, got 5.0" in fail(f"{TRANSFER} -o out.png --strength 500%", code=2)
        assert "got 1.01" in fail(f"{TRANSFER} -o out.png --tint 101%", code=2)
