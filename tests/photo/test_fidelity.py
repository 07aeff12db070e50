"""What nobody asked to change stays: how a JPEG is compressed, colours, depth, alpha and metadata."""

from __future__ import annotations

import struct
from dataclasses import replace

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image
from scipy.ndimage import binary_erosion
from skimage.color import deltaE_ciede2000

from relit.cli.app import main
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.photo.photo import JpegSettings, Metadata, Photo
from relit.photo.reading import read_image
from relit.photo.samples import sample as sample_photo
from relit.photo.writing import write_image
from relit.relighting import transfer
from tests import faces
from tests.photo.photo_files import (
    ADOBE_RGB,
    P3,
    PROPHOTO,
    XMP,
    exif_block,
    full_exif,
    read,
    sample,
    saved,
    written,
)


@pytest.fixture(scope="module")
def portrait():
    """A photo of whole 16 px blocks, in colour."""
    return np.ascontiguousarray(read_image(sample_photo("reference")).pixels[200:520, 200:440])


def anatomy(jpeg):
    """Quantization table and sampling of each component, and whether it is progressive: ISO 10918-1, B.2."""
    zigzag = sorted(range(64), key=lambda n: (n // 8 + n % 8, (n % 8, n // 8)[(n // 8 + n % 8) % 2]))
    tables, place = {}, 2
    while True:
        marker, length = struct.unpack_from(">HH", jpeg, place)
        content = jpeg[place + 4 : place + 2 + length]
        place += 2 + length
        if marker == 0xFFDB:
            while content:
                wide, number = divmod(content[0], 16)
                size = 64 << wide
                values = np.frombuffer(content[1 : 1 + size], f">u{1 + wide}")
                table = np.zeros(64, int)
                table[zigzag] = values
                tables[number], content = table.tolist(), content[1 + size :]
        elif marker in (0xFFC0, 0xFFC1, 0xFFC2):
            frame = [content[6 + 3 * n : 9 + 3 * n] for n in range(content[5])]
            progressive = marker == 0xFFC2
        elif marker == 0xFFDA:
            parts = [(tables[number], divmod(factors, 16)) for _name, factors, number in frame]
            return parts, progressive


class TestJpegSettings:
    @pytest.mark.parametrize("progressive", [False, True])
    @pytest.mark.parametrize("subsampling", ["4:4:4", "4:2:2", "4:2:0"])
    @pytest.mark.parametrize("quality", [30, 80, 98])
    def test_a_jpeg_is_written_as_it_was_read(self, portrait, quality, subsampling, progressive):
        data = saved(portrait, "JPEG", quality=quality, subsampling=subsampling, progressive=progressive)
        photo = read(data)
        for again in (written(photo, "JPEG"), written(photo.pixels, "JPEG", like=photo)):
            assert anatomy(again) == anatomy(data)
            assert len(again) == pytest.approx(len(data), rel=0.05)

    def test_a_second_generation_differs_by_rounding(self, portrait):
        photo = read(saved(portrait, "JPEG", quality=80, subsampling="4:4:4"))
        as_it_was = read(written(photo, "JPEG")).pixels.astype(int)
        at_95 = read(written(replace(photo, jpeg=None), "JPEG")).pixels.astype(int)
        lost, lost_at_95 = (np.abs(again - photo.pixels).mean() for again in (as_it_was, at_95))
        assert lost < 0.2
        assert lost < lost_at_95 / 2  # although that file is larger

    @pytest.mark.parametrize("channels", [1, 3])
    def test_others_stay_at_quality_95_and_full_resolution(self, channels):
        samples = sample(np.uint8, 32, 32, channels)
        photo = read(saved(samples, "PNG"))
        assert photo.jpeg is None
        expected = saved(samples, "JPEG", quality=95, subsampling="4:4:4")
        assert anatomy(written(photo, "JPEG")) == anatomy(expected)

    @pytest.mark.parametrize(
        ("subsampling", "finer"), [("440", (1, 1)), ("411", (2, 1)), ("422", (2, 1)), ("420", (2, 2))]
    )
    def test_odd_subsamplings_become_the_nearest_finer_one(self, portrait, subsampling, finer):
        data = imagecodecs.jpeg8_encode(portrait, level=85, subsampling=subsampling)
        before, after = anatomy(data)[0], anatomy(written(read(data), "JPEG"))[0]
        assert [table for table, _ in before] == [table for table, _ in after]
        assert [factors for _, factors in after] == [finer, (1, 1), (1, 1)]

    def test_each_component_keeps_its_own_table(self, portrait):
        tables = [list(range(first, first + 64)) for first in (1, 20, 50)]
        data = saved(portrait, "JPEG", qtables=tables, subsampling="4:2:0")
        assert [table for table, _ in anatomy(data)[0]] == tables
        assert anatomy(written(read(data), "JPEG")) == anatomy(data)

    @pytest.mark.parametrize("orientation", range(1, 9))
    def test_a_photo_put_upright_keeps_what_each_direction_had(self, portrait, orientation):
        tables = [[1 + 9 * (n % 8) + n // 8 for n in range(64)]] * 2  # coarser across than down
        exif = b"Exif\0\0" + exif_block(orientation)
        data = saved(portrait, "JPEG", qtables=tables, subsampling="4:4:4", exif=exif)
        photo = read(data)
        again = written(photo, "JPEG")
        turned = [np.reshape(table, (8, 8)).T.ravel().tolist() for table in tables]
        assert [table for table, _ in anatomy(again)[0]][:2] == (turned if orientation > 4 else tables)
        lost = np.abs(read(again).pixels.astype(int) - photo.pixels).mean()
        assert lost < 0.1, "the same blocks, quantized by the same steps"

    def test_colours_shared_across_are_shared_down_after_a_turn(self, portrait):
        data = saved(portrait, "JPEG", subsampling="4:2:2", exif=b"Exif\0\0" + exif_block(6))
        photo = read(data)
        assert photo.jpeg.subsampling == (1, 2)
        assert anatomy(written(photo, "JPEG"))[0][0][1] == (1, 1)  # the nearest finer that can be written

    def test_colours_on_a_grey_jpeg(self, portrait):
        data = saved(portrait[..., 1], "JPEG", quality=70)
        ((table, _),) = anatomy(data)[0]
        assert anatomy(written(read(data), "JPEG")) == anatomy(data)
        coloured = written(portrait, "JPEG", like=read(data))
        assert anatomy(coloured)[0] == [(table, (1, 1))] * 3
        assert np.abs(read(coloured).pixels.astype(int) - portrait).mean() < 4

    def test_grey_from_a_colour_jpeg(self, portrait):
        data = saved(portrait, "JPEG", quality=70, subsampling="4:2:0")
        ((table, factors),) = anatomy(written(portrait[..., 1], "JPEG", like=read(data)))[0]
        assert (table, factors) == (anatomy(data)[0][0][0], (1, 1))

    def test_red_green_and_blue_stay_so(self, portrait):
        data = saved(portrait, "JPEG", quality=70, keep_rgb=True)
        again = written(read(data), "JPEG")
        assert anatomy(again) == anatomy(data)
        assert np.abs(read(again).pixels.astype(int) - read(data).pixels).mean() < 0.1
        grey = written(portrait[..., 1], "JPEG", like=read(data))
        assert read(grey).pixels.ndim == 2

    @pytest.mark.parametrize("progressive", [False, True])
    def test_pure_noise_at_the_highest_quality(self, progressive, capfd):
        noise = sample(np.uint8, 700, 900)
        finest = JpegSettings(((1,) * 64,) * 2, progressive=progressive)
        data = written(Photo(noise, jpeg=finest), "JPEG")
        assert len(data) > 2.9 * noise[..., 0].size
        assert anatomy(data) == ([([1] * 64, (1, 1))] * 3, progressive)
        assert capfd.readouterr().err == ""

    def test_steps_beyond_8_bits_become_the_coarsest_that_all_read(self, capfd):
        coarse = saved(sample(np.uint8, 64, 64), "JPEG", qtables=[[300] * 64] * 2)
        capfd.readouterr()
        parts, _ = anatomy(written(read(coarse), "JPEG"))
        assert parts[0][0] == [255] * 64
        assert capfd.readouterr().err == ""

    def test_tables_may_come_between_the_scans(self):
        """One block, a scan for each component, each after its table: B.2.4 allows it."""

        def segment(marker, content):
            return struct.pack(">HH", marker, 2 + len(content)) + content

        frame = segment(0xFFC0, struct.pack(">BHHB", 8, 8, 8, 3) + bytes([1, 17, 0, 2, 17, 1, 3, 17, 2]))
        one_code = bytes([1, *[0] * 15, 0])  # nothing but zeros
        codes = segment(0xFFC4, b"\x00" + one_code) + segment(0xFFC4, b"\x10" + one_code)
        scans = b"".join(
            segment(0xFFDB, bytes([n, *[5] * 64])) + segment(0xFFDA, bytes([1, n + 1, 0, 0, 63, 0])) + b"\x3f"
            for n in range(3)
        )
        photo = read(b"\xff\xd8" + frame + codes + scans + b"\xff\xd9")
        assert photo.pixels.tolist() == [[[128] * 3] * 8] * 8
        assert photo.jpeg is None

    def test_settings_survive_a_change_of_profile(self, portrait):
        data = saved(portrait, "JPEG", quality=60)
        assert anatomy(written(read(data).to_profile(P3), "JPEG")) == anatomy(data)


PROFILES = {"Display P3": P3, "Adobe RGB": ADOBE_RGB, "ProPhoto": PROPHOTO}


LAB = bytes(imagecodecs.cms_profile("lab4"))


def delta_e(one, other, profile, other_profile=None):
    """How far apart colours look, ΔE2000: by Little CMS in floating point, and scikit-image."""
    labs = [
        imagecodecs.cms_transform(
            pixels / (1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max),
            space,
            LAB,
            colorspace="rgb",
            outcolorspace="lab",
            outdtype="float64",
        )
        for pixels, space in ((one, profile), (other, other_profile or profile))
    ]
    return deltaE_ciede2000(*labs)


@pytest.fixture(scope="module")
def people(tmp_path_factory):
    """The sample photos, cropped, as floats in sRGB, with their landmarks in files."""
    folder = tmp_path_factory.mktemp("people")
    for role, box in (("target", (75, 0, 375, 340)), ("reference", (230, 130, 630, 650))):
        with Image.open(sample_photo(role)) as opened:
            small = opened.convert("RGB").crop(box).resize((240, 272))
        Image.fromarray(np.asarray(small)).save(folder / f"{role}.png")
        write_landmarks(folder / f"{role}.csv", detect_landmarks(np.asarray(small)))
    return folder


@pytest.fixture(scope="module")
def off_the_person(people):
    """Where nothing is relit: in whatever profile, so a little less than by the mask in sRGB."""
    photos = {role: people / f"{role}.png" for role in ("target", "reference")}
    points = {f"{role}_landmarks": read_landmarks(people / f"{role}.csv") for role in photos}
    return binary_erosion(faces.untouched(transfer(**photos, **points)), np.ones((9, 9)), border_value=1)


def relight(people, target, output):
    """Run the command as a user does."""
    reference, marks = people / "reference.png", people / "target.csv"
    words = ["transfer", target, reference, "-o", output, "--target-landmarks", marks]
    with pytest.raises(SystemExit) as stop:
        main([*map(str, words), "--reference-landmarks", str(people / "reference.csv")])
    return stop.value.code


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("name", PROFILES)
def test_a_relit_photo_keeps_all_but_its_light(name, dtype, people, off_the_person, tmp_path):
    profile = PROFILES[name]
    with Image.open(people / "target.png") as opened:
        pixels = np.asarray(opened)
    full = 1 if dtype is np.float32 else np.iinfo(dtype).max
    converted = imagecodecs.cms_transform(
        pixels / 255, imagecodecs.cms_profile("srgb"), profile, colorspace="rgb", outcolorspace="rgb"
    ).clip(0, 1)
    converted = (converted * full).astype(dtype) if full == 1 else np.rint(converted * full).astype(dtype)
    alpha = sample(dtype, 272, 240, 1)
    metadata = Metadata(full_exif(), XMP, (300.0, 300.0))
    source, output = tmp_path / "target.tif", tmp_path / "relit.tif"
    write_image(source, Photo(converted, alpha, profile, metadata))
    assert delta_e(pixels, converted, imagecodecs.cms_profile("srgb"), profile).mean() < 1
    assert relight(people, source, output) == 0

    result = tifffile.imread(output)
    changed = delta_e(converted, result[..., :3], profile)
    assert changed[off_the_person].max() <= 1
    np.testing.assert_array_equal(result[off_the_person], np.dstack([converted, alpha])[off_the_person])
    assert changed[~off_the_person].mean() > 1
    np.testing.assert_array_equal(result[..., 3], alpha)
    with tifffile.TiffFile(output) as file:
        tags = file.pages[0].tags
        assert tags[34675].value == profile
        assert tags[700].value == XMP
        assert (tags[271].value, tags[282].value) == ("Maker", (300, 1))


@pytest.mark.parametrize("name", PROFILES)
def test_a_relit_jpeg_keeps_its_colours_but_for_rounding(name, people, off_the_person, tmp_path):
    with Image.open(people / "target.png") as opened:
        pixels = np.asarray(opened)
    source, output = tmp_path / "target.jpg", tmp_path / "relit.jpg"
    exif = b"Exif\0\0" + full_exif()
    source.write_bytes(
        saved(pixels, "JPEG", quality=80, subsampling="4:2:0", icc_profile=PROFILES[name], exif=exif, xmp=XMP)
    )
    assert relight(people, source, output) == 0
    assert anatomy(output.read_bytes()) == anatomy(source.read_bytes())
    with Image.open(source) as before, Image.open(output) as after:
        changed = delta_e(np.asarray(before), np.asarray(after), PROFILES[name])
        assert after.info["icc_profile"] == PROFILES[name]
        assert after.info["xmp"] == XMP
        assert after.getexif()[0x010F] == "Maker"
    away = binary_erosion(off_the_person, np.ones((33, 33)), border_value=1)
    assert changed[away].mean() < 1
    assert changed[~off_the_person].mean() > 1


@pytest.mark.parametrize(("dtype", "limit"), [(np.uint8, 3), (np.uint16, 0.1), (np.float32, 0.1)])
@pytest.mark.parametrize("name", PROFILES)
def test_colours_come_back_from_another_profile(name, dtype, limit, people):
    """To the reference's colours and back; at 8 bits, a level in the shadows is more than can be seen."""
    photo = read_image(people / "target.png")
    full = 1 if dtype is np.float32 else np.iinfo(dtype).max
    photo = replace(photo, pixels=(photo.pixels / 255 * full).astype(dtype))
    there = photo.to_profile(PROFILES[name])
    back = there.to_profile(None)
    srgb = imagecodecs.cms_profile("srgb")
    assert delta_e(photo.pixels, there.pixels, srgb, PROFILES[name]).mean() < 1
    changed = delta_e(photo.pixels, back.pixels, srgb)
    assert changed.mean() < 1
    assert changed.max() < limit


FRAMES = [sample(np.uint8, 32, 32, seed=seed) for seed in (0, 1)]
FURTHER = {"save_all": True, "append_images": [Image.fromarray(FRAMES[1])]}
REFUSED = {
    "CMYK JPEG": (saved(Image.new("CMYK", (32, 32)), "JPEG"), "holds CMYK colours; convert it to RGB"),
    "CMYK TIFF": (saved(Image.new("CMYK", (32, 32)), "TIFF"), "holds SEPARATED colours; convert it to RGB"),
    "animated GIF": (saved(FRAMES[0], "GIF", **FURTHER), "found a GIF file; convert it to JPEG, PNG"),
    "animated WebP": (saved(FRAMES[0], "WEBP", **FURTHER), "animated; save one frame as a photo"),
    "animated PNG": (saved(FRAMES[0], "PNG", **FURTHER), "animated; save one frame as a photo"),
    "pages": (saved(FRAMES[0], "TIFF", **FURTHER), "holds several pages; save one as a photo"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_one_photo_ends_in_one_line_and_no_file(name, people, tmp_path, capfd):
    data, message = REFUSED[name]
    source, output = tmp_path / "target.png", tmp_path / "relit.png"
    source.write_bytes(data)
    assert relight(people, source, output) == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(f"relit: error: {source}: {message}")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [source]
