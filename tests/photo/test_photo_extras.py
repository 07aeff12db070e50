"""The formats of the optional extras: HEIC, camera raw and OpenEXR, as other libraries write them."""

from __future__ import annotations

import io
import sys

import numpy as np
import pytest
import tifffile
from cve_cameras import raws
from cve_exrs import exrs
from PIL import Image

from relit.errors import ImageError, OutputError
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.writing import check_destination, write_image
from tests.photo.photo_files import (
    P3,
    P3_TO_XYZ,
    SRGB_TO_XYZ,
    XMP,
    exif_block,
    full_exif,
    read,
    sample,
    split,
    srgb_curve,
    written,
)


@pytest.mark.parametrize(
    ("module", "name", "head"),
    [
        ("pillow_heif", "heic", b"\0\0\0\x18ftypheic\0\0\0\0"),
        ("rawpy", "raw", b"FUJIFILMCCD-RAW "),
        ("OpenEXR", "exr", b"v/1\x01"),
    ],
)
def test_without_the_extra_the_error_says_how_to_get_it(module, name, head, monkeypatch):
    for library in (module, "pi_heif"):
        monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImageError, match=rf"need an extra: pip install 'relit\[{name}\]'"):
        read(head)


def test_without_the_extra_it_is_not_written_either(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    for refuse in (check_destination, lambda path: write_image(path, sample(np.uint8))):
        with pytest.raises(
            OutputError, match=r"a\.exr: OpenEXR files need an extra: pip install 'relit\[exr"
        ):
            refuse(tmp_path / "a.exr")
    assert list(tmp_path.iterdir()) == []


class TestHeic:
    @pytest.fixture(params=["pillow_heif", "pi_heif"])
    def heif(self, request, monkeypatch):
        """What writes HEIC, while it or its twin reads it."""
        writer = pytest.importorskip("pillow_heif")
        if request.param == "pi_heif":
            pytest.importorskip("pi_heif")
            monkeypatch.setitem(sys.modules, "pillow_heif", None)
        return writer

    def heic(self, heif, samples, mode, **info):
        """What libheif writes, lossless: RGB as it is, at 8 or 10 bits."""
        file = io.BytesIO()
        opened = heif.from_bytes(mode, samples.shape[1::-1], np.ascontiguousarray(samples).tobytes())
        nclx = {key: info.pop(key) for key in ("color_primaries", "transfer_characteristics") if key in info}
        opened.info.update(info)
        opened.save(file, quality=-1, chroma=444, matrix_coefficients=0, **nclx)
        return file.getvalue()

    @pytest.mark.parametrize(("mode", "channels"), [("L", 1), ("RGB", 3), ("RGBA", 4)])
    def test_8_bits(self, heif, mode, channels):
        samples = sample(np.uint8, 48, 80, channels)
        photo = read(self.heic(heif, samples, mode))
        pixels, alpha = split(samples)
        np.testing.assert_array_equal(photo.pixels, pixels)
        assert photo.format == "HEIC"
        assert (photo.alpha is None) == (alpha is None)
        if alpha is not None:
            np.testing.assert_array_equal(photo.alpha, alpha)

    @pytest.mark.parametrize(("mode", "channels"), [("I;16", 1), ("RGB;16", 3), ("RGBA;16", 4)])
    def test_10_bits_fill_16(self, heif, mode, channels):
        tens = np.random.default_rng(0).integers(0, 1024, (48, 80, channels)).astype(np.uint16)
        tens[0, 0], tens[0, 1] = 0, 1023
        photo = read(self.heic(heif, tens << 6, mode))
        expected = np.rint(tens / 1023 * 65535)
        pixels, alpha = split(expected if channels > 1 else expected[..., 0])
        assert photo.pixels.dtype == np.uint16
        np.testing.assert_array_equal(photo.pixels, pixels)
        if alpha is not None:
            np.testing.assert_array_equal(photo.alpha, alpha)

    def test_what_travels_with_it(self, heif):
        data = self.heic(heif, sample(np.uint8, 48, 80), "RGB", exif=b"Exif\0\0" + full_exif(), xmp=XMP)
        photo = read(data)
        assert photo.metadata.xmp == XMP
        exif = Image.Exif()
        exif.load(photo.metadata.exif)
        assert exif[0x010F] == "Maker"
        assert exif.get_ifd(0x8769)[0x9003] == "2020:01:02 03:04:05"

    def test_a_profile_of_its_own(self, heif):
        image = Image.fromarray(sample(np.uint8, 48, 80))
        heif.register_heif_opener()
        file = io.BytesIO()
        image.save(file, "HEIF", icc_profile=P3)
        assert read(file.getvalue()).profile == P3

    def test_primaries_that_are_only_named(self, heif):
        samples = sample(np.uint8, 48, 80)
        photo = read(self.heic(heif, samples, "RGB", color_primaries=12, transfer_characteristics=13))
        linear = np.where(samples <= 10, samples / 255 / 12.92, ((samples / 255 + 0.055) / 1.055) ** 2.4)
        to_srgb = np.linalg.inv(SRGB_TO_XYZ)
        expected = srgb_curve((linear @ (to_srgb @ P3_TO_XYZ).T).clip(0, 1)) * 255
        got = photo.to_profile(None).pixels
        assert np.abs(expected - samples).max() > 20
        assert np.abs(got - expected).max() < 1.5

    @pytest.mark.parametrize(("transfer", "name"), [(16, "PQ"), (18, "HLG")])
    def test_high_dynamic_range_is_refused(self, heif, transfer, name):
        data = self.heic(
            heif, sample(np.uint8, 48, 80), "RGB", color_primaries=9, transfer_characteristics=transfer
        )
        with pytest.raises(ImageError, match=rf"holds HDR colours \({name}\); export it"):
            read(data)

    @pytest.mark.parametrize("orientation", [3, 6, 8])
    def test_it_is_turned_once(self, heif, orientation):
        """libheif writes the turn both as a box of its own and as EXIF, like phones do."""
        samples = sample(np.uint8, 48, 80)
        data = self.heic(heif, samples, "RGB", exif=b"Exif\0\0" + exif_block(orientation))
        assert b"irot" in data
        photo = read(data)
        np.testing.assert_array_equal(photo.pixels, np.rot90(samples, {3: 2, 6: -1, 8: 1}[orientation]))
        assert photo.metadata.exif == exif_block(1)[:34] + bytes(4) + exif_block(1)[38:]

    def test_the_cap_and_damage(self, heif):
        data = self.heic(heif, sample(np.uint8, 48, 80), "RGB")
        with pytest.raises(ImageError, match="claims 80x48 px, more than the 3839 px"):
            read(data, max_pixels=3839)
        for left in (0.1, 0.5, 0.9):
            with pytest.raises(ImageError, match="the HEIC data is damaged or cut short"):
                read(data[: int(left * len(data))])

    def test_it_is_not_written(self, heif, tmp_path):
        with pytest.raises(OutputError, match=r"no format to write goes by '\.heic'; use one of \.jpg"):
            write_image(tmp_path / "a.heic", sample(np.uint8))
        photo = read(self.heic(heif, sample(np.uint8, 48, 80), "RGB"))
        file = io.BytesIO()
        write_image(file, photo)
        assert read_image(io.BytesIO(file.getvalue())).format == "PNG"


def scene(height=96, width=128):
    """Smooth linear light that reaches white."""
    light = np.full((height, width, 3), 0.3)
    light[..., 0] = np.linspace(0.1, 0.6, width)
    light[..., 1] = np.linspace(0.2, 0.8, height)[:, None]
    light[:16, :16] = 1
    return light


def dng(light, *, orientation=1, **options):
    """A DNG 1.4 by tifffile: a sensor of sRGB's primaries behind red, green, green and blue filters."""
    neutral = np.array([0.5, 1, 1])  # what white is to the sensor, which white balance has to undo
    seen = (light * neutral * 65535).round().astype(np.uint16)
    mosaic = np.empty(seen.shape[:2], np.uint16)
    for y, x, colour in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        mosaic[y::2, x::2] = seen[y::2, x::2, colour]
    from_xyz = [3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570]
    tags = [
        (271, 2, 0, "Acme", True),
        (274, 3, 1, orientation, True),
        (700, 1, len(XMP), XMP, True),
        (33421, 3, 2, (2, 2), True),  # the filters' pattern
        (33422, 1, 4, bytes([0, 1, 1, 2]), True),
        (50706, 1, 4, bytes([1, 4, 0, 0]), True),
        (50708, 2, 0, "Acme One", True),
        (50717, 4, 1, 65535, True),  # white
        (50721, 10, 9, [part for x in from_xyz for part in (round(x * 10000), 10000)], True),
        (50728, 5, 3, (1, 2, 1, 1, 1, 1), True),  # as-shot neutral
        (50778, 3, 1, 21, True),  # D65
    ]
    file = io.BytesIO()
    tifffile.imwrite(file, mosaic, photometric="cfa", metadata=None, extratags=tags, **options)
    return file.getvalue()


class TestCameraRaw:
    @pytest.fixture(autouse=True)
    def rawpy(self):
        return pytest.importorskip("rawpy")

    def test_it_is_developed_to_the_light_of_the_scene(self):
        photo = read(dng(scene()))
        assert (photo.format, photo.pixels.dtype, photo.profile) == ("RAW", np.uint16, None)
        inside = (slice(24, -8), slice(24, -8))  # interpolated colours blur across edges
        expected = srgb_curve(scene())
        assert np.abs(photo.pixels / 65535 - expected)[inside].max() < 0.01

    def test_what_travels_with_it(self):
        metadata = read(dng(scene())).metadata
        exif = Image.Exif()
        exif.load(metadata.exif)
        assert (exif[0x010F], exif[0x0112], metadata.xmp) == ("Acme", 1, XMP)

    @pytest.mark.parametrize(("orientation", "turns"), [(3, 2), (6, -1), (8, 1)])
    def test_it_is_turned_once(self, orientation, turns):
        photo = read(dng(scene(), orientation=orientation))
        np.testing.assert_array_equal(photo.pixels, np.rot90(read(dng(scene())).pixels, turns))
        exif = Image.Exif()
        exif.load(photo.metadata.exif)
        assert exif[0x0112] == 1

    def test_one_that_starts_with_a_preview(self, tmp_path):
        """As cameras write them, read from a path."""
        path = tmp_path / "photo.dng"
        with tifffile.TiffWriter(path) as file:
            file.write(sample(np.uint8, 12, 16), photometric="rgb", subfiletype=1, metadata=None)
        with pytest.raises(ImageError, match="but is none that LibRaw knows; save the photo alone"):
            read_image(path)
        path.write_bytes(dng(scene()))
        assert read_image(path).format == "RAW"

    def test_the_cap_and_damage(self):
        data = dng(scene())
        with pytest.raises(ImageError, match="claims 128x96 px, more than the 100 px"):
            read(data, max_pixels=100)
        with pytest.raises(ImageError, match="the RAW data is damaged or cut short"):
            read(data[: len(data) // 2])

    def test_one_whose_pixels_are_not_there_is_no_black_photo(self, capfd):
        """LibRaw gives one, and tells stderr alone."""
        data = dict(raws())["strip-far.dng"]
        with pytest.raises(ImageError, match="the RAW data is damaged or cut short"):
            read(data)
        assert capfd.readouterr() == ("", "")

    def test_it_is_not_written(self, tmp_path):
        with pytest.raises(OutputError, match=r"no format to write goes by '\.dng'"):
            write_image(tmp_path / "a.dng", sample(np.uint8))


class TestOpenExr:
    @pytest.fixture(autouse=True)
    def library(self):
        return pytest.importorskip("OpenEXR")

    def test_of_a_damaged_one_only_the_exception_speaks(self, capfd):
        with pytest.raises(ImageError, match="the EXR data is damaged or cut short"):
            read(dict(exrs())["offsets-zero.exr"])
        assert capfd.readouterr() == ("", "")

    def exr(self, library, channels, **header):
        file = io.BytesIO()
        library.File(header, channels).write(file)
        return file.getvalue()

    @pytest.mark.parametrize("dtype", [np.float16, np.float32])
    @pytest.mark.parametrize("name", ["RGB", "Y"])
    def test_light_comes_to_the_curve_of_srgb(self, library, name, dtype):
        light = sample(np.float32, 20, 30, len(name)).astype(dtype)
        photo = read(self.exr(library, {name: light}))
        assert (photo.format, photo.pixels.dtype, photo.profile) == ("EXR", np.float32, None)
        np.testing.assert_allclose(photo.pixels, srgb_curve(light.astype(float)), atol=1e-6)

    def test_alpha_is_divided_out(self, library):
        samples = sample(np.float32, 20, 30, 4)
        samples[0, 0, 3] = 0
        multiplied = np.dstack([samples[..., :3] * samples[..., 3:], samples[..., 3]])
        photo = read(self.exr(library, {"RGBA": multiplied}))
        np.testing.assert_array_equal(photo.alpha, samples[..., 3])
        expected = srgb_curve(samples[..., :3])
        expected[0, 0] = 0
        np.testing.assert_allclose(photo.pixels, expected, atol=1e-5)

    @pytest.mark.parametrize("channels", [1, 2, 3, 4])
    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
    def test_there_and_back(self, library, dtype, channels):
        samples = sample(dtype, 20, 30, channels)
        pixels, alpha = split(samples)
        data = written(Photo(pixels, alpha), "EXR")
        full = 1 if dtype is np.float32 else np.iinfo(dtype).max
        part = library.File(io.BytesIO(data)).parts[0].channels
        assert sorted(part) == {1: ["Y"], 2: ["A", "Y"], 3: ["RGB"], 4: ["RGBA"]}[channels]
        if alpha is None:
            np.testing.assert_allclose(srgb_curve(part[min(part)].pixels), pixels / full, atol=1e-6)
        photo = read(data)
        seen = np.ones(photo.pixels.shape[:2], bool) if alpha is None else alpha > 0
        np.testing.assert_allclose(photo.pixels[seen], (pixels / full)[seen], atol=1e-5)
        if alpha is not None:
            np.testing.assert_allclose(photo.alpha, alpha / full, atol=1e-7)

    def test_other_primaries_become_a_profile(self, library):
        light = sample(np.float32, 20, 30)
        p3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290)
        photo = read(self.exr(library, {"RGB": light}, chromaticities=p3))
        to_srgb = np.linalg.inv(SRGB_TO_XYZ)
        expected = srgb_curve((light @ (to_srgb @ P3_TO_XYZ).T).clip(0, 1))
        assert np.abs(photo.pixels - expected).max() > 0.05
        assert np.abs(photo.to_profile(None).pixels - expected).max() < 2e-3
        again = read(self.exr(library, {"RGB": light}, chromaticities=p3))
        assert again.profile == photo.profile  # and no time of day in it

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (
                lambda light: light * 4,
                r"holds light from .* to 3\.9.*, and a photo ends at .* 1; tone-map",
            ),
            (lambda light: light - 0.5, "holds light from -0.4.* to 0.4"),
            (lambda light: light * np.nan, "holds light from nan to nan"),
        ],
    )
    def test_light_that_no_photo_holds(self, library, change, message):
        with pytest.raises(ImageError, match=message):
            read(self.exr(library, {"RGB": change(sample(np.float32, 20, 30))}))

    def test_what_is_no_photo(self, library):
        plane = sample(np.float32, 20, 30, 1)
        with pytest.raises(ImageError, match="holds the channels RGB, Z; save RGB"):
            read(self.exr(library, {"RGB": sample(np.float32, 20, 30), "Z": plane}))
        with pytest.raises(ImageError, match="holds uint32 values; save it in half or full floats"):
            read(self.exr(library, {"Y": plane.astype(np.uint32)}))
        parts = [library.Part({}, {"Y": plane}, name) for name in ("left", "right")]
        file = io.BytesIO()
        library.File(parts).write(file)
        with pytest.raises(ImageError, match="holds several parts; save one"):
            read(file.getvalue())

    def test_the_cap_and_damage(self, library):
        data = self.exr(library, {"RGB": sample(np.float32, 20, 30)})
        with pytest.raises(ImageError, match="claims 30x20 px, more than the 599 px"):
            read(data, max_pixels=599)
        for left in (0.1, 0.5, 0.9):
            with pytest.raises(ImageError, match="the EXR data is damaged or cut short"):
                read(data[: int(left * len(data))])
