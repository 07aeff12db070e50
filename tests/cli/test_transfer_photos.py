"""The command line: what the library gives is what the file holds, and what fails leaves nothing behind.

Photos written are read back with Pillow, imagecodecs and tifffile, not with relit.
"""

import zipfile

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from relit import relighting
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.writing import write_image
from tests.cli.photos import ROLES, as_16_bits, grey_profile, rgb_profile
from tests.command import FACES, TRANSFER, in_library, pixels_of
from tests.faces import untouched


class TestTransfer:
    @pytest.mark.parametrize(
        ("flags", "options"),
        [
            ("", {}),
            ("--lambda auto --neighborhood 16", {"lam": "auto", "neighborhood": 16}),
            (
                "--method ltv --neighborhood isotropic --smoothing 3",
                {"method": "ltv", "neighborhood": "isotropic", "smoothing": 3.0},
            ),
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

    def test_off_the_person_nothing_changes(self, studio, plain, succeed):
        succeed(f"{TRANSFER} -o out.png")
        changed = (pixels_of("out.png") != studio.target).any(axis=2)
        away = untouched(plain)
        assert not changed[away].any()
        assert changed[~away].mean() > 0.3

    def test_by_its_name_a_file_holds_layers(self, studio, plain, succeed):
        succeed(f"{TRANSFER} -o out.ora")
        with zipfile.ZipFile("out.ora") as file:
            merged = imagecodecs.png_decode(file.read("mergedimage.png"))
            lowest = file.read("stack.xml").decode().split("src=")[-1].split('"')[1]
            below = imagecodecs.png_decode(file.read(lowest))
        np.testing.assert_array_equal(merged, plain.image)
        np.testing.assert_array_equal(below, studio.target)
        succeed(f"{TRANSFER} -o out.psd")
        np.testing.assert_array_equal(pixels_of("out.psd"), plain.image)

    def test_png_keeps_16_bits(self, studio, place, succeed):
        target = as_16_bits(studio.target)
        (place / "deep.png").write_bytes(imagecodecs.png_encode(target))
        succeed(f"transfer deep.png reference.png {FACES} -o out.png")
        written = imagecodecs.png_decode((place / "out.png").read_bytes())
        assert written.dtype == np.uint16
        np.testing.assert_array_equal(written, in_library(studio, target).image)
        away = untouched(in_library(studio, target))
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
        away = untouched(in_library(studio, upright))
        np.testing.assert_array_equal(pixels_of("out.png")[away], upright[away])

    def test_a_wide_gamut_target_keeps_its_profile_and_its_pixels(self, studio, plain, place, succeed):
        write_image(place / "wide.png", Photo(studio.target, profile=rgb_profile()))
        succeed(f"transfer wide.png reference.png {FACES} -o out.png")
        with Image.open(place / "out.png") as picture:
            assert picture.info["icc_profile"] == rgb_profile()
        written = pixels_of("out.png")
        away = untouched(plain)
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
        away = untouched(in_library(studio, grey))
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
        away = untouched(in_library(studio, read_image("grey.png"), read_image("light.png")))
        before, after = (read_image(name).to_profile(None).pixels[away] for name in ("grey.png", "out.png"))
        assert np.abs(before.astype(int) - after).max() <= 2

    def test_a_second_reference(self, place, fail, succeed):
        succeed(f"{TRANSFER} -o out.png --method quotient --second-reference reference.png --stages steps")
        # A reference in the light that the target has already changes nothing.
        np.testing.assert_allclose(pixels_of("out.png").astype(int), pixels_of("target.png"), atol=2)
        np.testing.assert_array_equal(
            pixels_of("steps/warped_second_reference.png"), pixels_of("steps/warped_reference.png")
        )
        assert "--second-reference: expected the reference's face" in fail(
            f"{TRANSFER} -o o.png --method quotient", code=2
        )
        assert "expected none with method 'shading'" in fail(
            f"{TRANSFER} -o o.png --second-reference target.png", code=2
        )
        assert "belong to a --second-reference" in fail(f"{TRANSFER} -o o.png --second-face 1", code=2)
        assert not (place / "o.png").exists()
