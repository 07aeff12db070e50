"""What a user can ask of ``relit transfer`` beyond a target and a reference."""

import json
import re

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import distance_transform_edt

from relit.photo.samples import sample
from relit.relighting import transfer
from tests.command import FACES, TRANSFER, in_library, pixels_of
from tests.faces import off_the_face

HERE = "--target-landmarks target.csv"


class TestControl:
    @pytest.mark.parametrize(
        ("flags", "options"),
        [
            ("--strength 0.4", {"strength": 0.4}),
            ("--shadows 0 --highlights 1.5", {"shadows": 0.0, "highlights": 1.5}),
            ("--exposure take --tint 0.5", {"exposure": "take", "tint": 0.5}),
            ("--exposure -1 --tint neutral", {"exposure": -1.0, "tint": "neutral"}),
            ("--region left+nose", {"region": "left+nose"}),
            (
                "--method ltv --exposure keep --tint keep",
                {"method": "ltv", "exposure": "keep", "tint": "keep"},
            ),
        ],
    )
    def test_flags_do_what_the_library_does(self, studio, succeed, flags, options):
        succeed(f"{TRANSFER} -o out.png {flags}")
        np.testing.assert_array_equal(pixels_of("out.png"), in_library(studio, **options).image)

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("flags", ["", "--no-mask", "--method ltv", "--color-space hsv"])
    def test_no_strength_gives_the_target_back_bit_for_bit(self, studio, place, succeed, dtype, flags):
        import imagecodecs

        target = studio.target.astype(dtype) * (257 if dtype == np.uint16 else 1) + 1
        (place / "deep.png").write_bytes(imagecodecs.png_encode(target))
        succeed(f"transfer deep.png reference.png {FACES} -o out.png --strength 0 {flags}")
        np.testing.assert_array_equal(imagecodecs.png_decode((place / "out.png").read_bytes()), target)

    def test_more_strength_changes_more(self, studio, succeed):
        change = []
        for strength in (0.5, 1, 2):
            succeed(f"{TRANSFER} -o {strength}.png --strength {strength}")
            change.append(np.abs(pixels_of(f"{strength}.png").astype(int) - studio.target).mean())
        assert 0 < 1.5 * change[0] < change[1] < change[2] / 1.4

    def test_a_stop_more_is_a_stop_more(self, studio, succeed):
        """A stop is twice the light; sRGB is decoded by its own curve here, and by a power in relit."""

        def light(path):
            encoded = pixels_of(path)[face] / 255
            return (((encoded + 0.055) / 1.055) ** 2.4).mean()

        near = ~off_the_face(studio.target_landmarks, studio.target.shape)
        face = distance_transform_edt(near) > 1.2 * studio.target_landmarks.interocular_distance
        assert face.sum() > 200
        succeed(f"{TRANSFER} -o keep.png --exposure keep")
        succeed(f"{TRANSFER} -o less.png --exposure -1")
        assert light("keep.png") / light("less.png") == pytest.approx(2, rel=0.12)

    def test_a_region_leaves_the_rest_of_the_face(self, studio, succeed):
        succeed(f"{TRANSFER} -o right.png --region right --strength 2")
        changed = np.abs(pixels_of("right.png").astype(int) - studio.target).sum(axis=2)
        middle = int(studio.target_landmarks.xy[[1, 4, 168], 0].mean())
        unit = int(studio.target_landmarks.interocular_distance)
        assert changed[:, : middle - unit // 2].mean() < 0.02
        assert changed[:, middle:].mean() > 1

    def test_a_mask_of_ones_own(self, studio, place, fail, succeed):
        mask = np.zeros(studio.target.shape[:2], np.uint8)
        rows = slice(mask.shape[0] // 2, None)
        mask[rows] = 255
        Image.fromarray(mask).save(place / "mask.png")
        Image.fromarray(np.dstack([mask] * 3)).save(place / "grey_in_rgb.png")
        Image.fromarray(studio.target).save(place / "colours.png")
        Image.fromarray(mask[1:]).save(place / "small.png")
        succeed(f"{TRANSFER} -o whole.png")
        for name in ("mask", "grey_in_rgb"):
            succeed(f"{TRANSFER} -o part.png --force --region-mask {name}.png")
            np.testing.assert_array_equal(pixels_of("part.png")[: rows.start], studio.target[: rows.start])
            np.testing.assert_array_equal(pixels_of("part.png")[rows], pixels_of("whole.png")[rows])
        assert "expected a grey picture" in fail(f"{TRANSFER} -o o.png --region-mask colours.png")
        assert "--region-mask: expected 72x82 px" in fail(f"{TRANSFER} -o o.png --region-mask small.png")


class TestLights:
    def test_a_light_by_name_needs_no_reference(self, studio, succeed):
        said = json.loads(succeed(f"transfer target.png --light loop {HERE} -o out.png --json --stages s"))
        assert "reference" not in said
        expected = transfer(studio.target, light="loop", target_landmarks=studio.target_landmarks).image
        np.testing.assert_array_equal(pixels_of("out.png"), expected)
        assert np.abs(expected.astype(int) - studio.target).max() > 10
        np.testing.assert_array_equal(pixels_of("s/result.png"), expected)

    def test_light_from_the_left_lights_the_left(self, studio, succeed):
        halves = {}
        for azimuth in (-60, 60):
            succeed(f"transfer target.png --light={azimuth},10 {HERE} -o {azimuth}.png")
            change = np.log(pixels_of(f"{azimuth}.png") + 1.0).mean(axis=2) - np.log(
                studio.target + 1.0
            ).mean(axis=2)
            middle = int(studio.target_landmarks.xy[:, 0].mean())
            box = np.s_[
                int(studio.target_landmarks.xy[:, 1].min()) : int(studio.target_landmarks.xy[:, 1].max())
            ]
            halves[azimuth] = change[box][:, :middle].mean() - change[box][:, middle:].mean()
        assert halves[-60] > 0.03
        assert halves[60] < -0.03

    def test_every_name_arrives(self, succeed):
        from relit.settings.studio_lights import STUDIO_LIGHTS

        seen = set()
        for name in STUDIO_LIGHTS:
            succeed(f"transfer target.png --light {name} {HERE} -o {name}.png")
            seen.add(pixels_of(f"{name}.png").tobytes())
        assert len(seen) == len(STUDIO_LIGHTS)

    def test_several_references_count_by_their_median(self, studio, succeed):
        marks = " ".join(f"--reference-landmarks {name}.csv" for name in ("reference", "reference", "target"))
        succeed(f"transfer target.png reference.png reference.png target.png {HERE} {marks} -o most.png")
        # Two of three agree.
        np.testing.assert_array_equal(pixels_of("most.png"), in_library(studio).image)
        faces = [studio.reference_landmarks, studio.target_landmarks]
        both = transfer(
            studio.target,
            [studio.reference, studio.target],
            target_landmarks=studio.target_landmarks,
            reference_landmarks=faces,
        )
        # The median of two is their mean.
        np.testing.assert_allclose(
            np.mean([one.filled for one in both.lightings], axis=0),
            np.median([one.filled for one in both.lightings], axis=0),
            atol=1e-6,
        )
        assert len(both.references) == len(both.lightings) == 2


class TestFaces:
    @pytest.fixture
    def crowd(self, place):
        """Two people beside one another."""
        picture = Image.new("RGB", (460, 300), (120, 130, 125))
        for left, role, box in ((0, "target", (150, 20, 300, 220)), (230, "reference", (230, 130, 630, 650))):
            with Image.open(sample(role)) as photo:
                picture.paste(photo.convert("RGB").crop(box).resize((200, 260)), (left + 15, 20))
        picture.save(place / "crowd.png")
        return np.asarray(picture)

    def changed(self, crowd, path):
        off = np.abs(pixels_of(path).astype(int) - crowd).mean(axis=2)
        return off[:, :230].mean() > 0.5, off[:, 230:].mean() > 0.5

    def test_one_is_chosen_or_all_are_relit(self, crowd, fail, succeed):
        found = [
            json.loads(succeed(f"landmarks crowd.png --face {face} --json"))["points"] for face in (0, 1)
        ]
        left = [np.mean(points, axis=0)[0] < 230 for points in found]
        assert sorted(left) == [False, True]
        for face in (0, 1):
            succeed(f"transfer crowd.png --light split --face {face} -o {face}.png")
            assert self.changed(crowd, f"{face}.png") == (left[face], not left[face])
        said = json.loads(succeed("transfer crowd.png --light split --all-faces -o all.png --json"))
        assert self.changed(crowd, "all.png") == (True, True)
        assert len(said["target"]) == 2
        for face in (0, 1):
            side = np.s_[:, :215] if left[face] else np.s_[:, 245:]
            # Who is relit second stands beside one who is already, and who tells persons sees both.
            off = np.abs(pixels_of("all.png")[side].astype(int) - pixels_of(f"{face}.png")[side])
            assert off.mean() < 0.2
            assert (off > 1).mean() < 0.05
        assert "there is no face 2; 2 found" in fail("transfer crowd.png --light rim --face 2 -o o.png")
        assert "goes with no" in fail("transfer crowd.png --light rim --face 1 --all-faces -o o.png", code=2)

    def test_none_tells_what_to_do(self, place, fail):
        Image.new("RGB", (300, 200), (120, 130, 125)).save(place / "wall.png")
        for flags in ("", "--all-faces"):
            message = fail(f"transfer wall.png --light rim -o o.png {flags}")
            assert "no face found" in message
            assert "--target-landmarks FILE" in message


class TestSeeing:
    def test_timings_are_shown(self, run, place):
        done = run(f"{TRANSFER} -o out.png --timings")
        assert done.code == 0
        stages = re.findall(r"^(\D+?) +(\d+\.\d\d) s *$", done.err, re.M)
        names = [name.strip() for name, _ in stages]
        assert names[0] == "read"
        assert {"warp", "relight", "blend", "write"} < set(names)
        assert names[-1] == "in all"
        assert float(stages[-1][1]) == pytest.approx(sum(float(s) for _, s in stages[:-1]), abs=0.1)
        assert (place / "out.png").exists()

    @pytest.mark.parametrize("light", ["reference.png --reference-landmarks reference.csv", "--light rim"])
    @pytest.mark.parametrize("method", ["shading", "ltv"])
    def test_the_sheet_shows_them_side_by_side(self, fail, succeed, light, method):
        command = f"transfer target.png {light} {HERE} --method {method} -o out.png --sheet sheet.png"
        succeed(command)
        sheet = pixels_of("sheet.png")
        assert sheet.ndim == 3
        assert sheet.shape[1] > 3 * 300
        assert "exists already" in fail(command.replace("out.png", "o.png"))

    @pytest.mark.parametrize("target", ["target.png", "grey.png"])
    def test_the_mask_is_white_where_the_photo_was_changed(self, studio, place, fail, succeed, target):
        Image.fromarray(studio.target).convert("L").save(place / "grey.png")
        command = f"transfer {target} reference.png -o out.png --changed changed.png"
        told = json.loads(succeed(f"{command} --json"))
        before, after = (np.asarray(Image.open(name).convert("RGB")) for name in (target, "out.png"))
        mask = np.asarray(Image.open("changed.png"))
        assert told["changed"] == "changed.png"
        np.testing.assert_array_equal(mask, 255 * (before != after).any(axis=2))
        assert mask.any()
        assert "changed.png: exists already" in fail(command.replace("out.png", "o.png"))
        assert not (place / "o.png").exists()

    def test_full_resolution_looks_at_every_pixel(self, studio, place, succeed):
        large = Image.fromarray(studio.target).resize((720, 820), Image.Resampling.BICUBIC)
        large.save(place / "large.png")
        factors = [
            json.loads(succeed(f"transfer large.png --light loop -o o.png --force --json {flag}"))["factor"]
            for flag in ("", "--full-resolution")
        ]
        assert factors == [3, 1]
