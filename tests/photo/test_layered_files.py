"""OpenRaster and PSD as other libraries read them: pyora, psd-tools, Pillow, and the standard library."""

import io
import zipfile
from dataclasses import replace
from xml.etree import ElementTree as ET

import imagecodecs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageCms

from relit.photo.codecs.openraster import encode_openraster
from relit.photo.codecs.psd import encode_psd
from relit.photo.layers import Layer, Layers
from relit.photo.photo import Metadata, Photo
from tests.photo.photo_files import sample, split

PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
MODES = ("normal", "multiply", "color-dodge")


def photo_of(dtype, height, width, channels, seed=0, **rest):
    return Photo(*split(sample(dtype, height, width, channels, seed)), **rest)


def stack(dtype=np.uint8, channels=3, height=21, width=13, **rest):
    """Three layers that lie in different places, each of its own pixels; the top one is what one sees."""
    alone = 1 if channels < 3 else 3
    top = photo_of(dtype, height, width, channels, **rest)
    return Layers(
        top,
        (
            Layer("Relit", top),
            Layer("Change", photo_of(dtype, 5, 7, alone, 1), 4, 9, "multiply"),
            Layer("More & <change>", photo_of(dtype, 4, 3, alone, 2), 2, 3, "color-dodge"),
            Layer("Face", photo_of(dtype, 6, 5, alone + 1, 3), 1, 2, visible=False),
        ),
    )


def facts(layer):
    height, width = layer.photo.pixels.shape[:2]
    return layer.name, layer.left, layer.top, width, height, layer.visible


class TestOpenRaster:
    def opened(self, layers):
        return zipfile.ZipFile(io.BytesIO(encode_openraster(layers)))

    def test_the_type_of_file_comes_first_and_as_it_is(self):
        data = encode_openraster(stack())
        assert data[30:54] == b"mimetypeimage/openraster"  # at the place where `file` looks for it
        assert zipfile.ZipFile(io.BytesIO(data)).infolist()[0].compress_type == zipfile.ZIP_STORED

    def test_all_that_is_demanded_is_there(self):
        with self.opened(stack()) as file:
            assert file.testzip() is None
            assert {"mimetype", "stack.xml", "mergedimage.png", "Thumbnails/thumbnail.png"} < {
                *file.namelist()
            }
            image = ET.fromstring(file.read("stack.xml"))
            assert image.attrib == {"version": "0.0.3", "w": "13", "h": "21"}
            ops = [layer.get("composite-op") for layer in image.iter("layer")]
            assert ops == ["svg:src-over", "svg:multiply", "svg:color-dodge", "svg:src-over"]

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("channels", [1, 2, 3, 4])
    def test_pngs_hold_the_pixels_of_layers(self, dtype, channels):
        layers = stack(dtype, channels)
        with self.opened(layers) as file:
            listed = ET.fromstring(file.read("stack.xml")).iter("layer")
            for layer, told in zip(layers.layers, listed, strict=True):
                pixels = imagecodecs.png_decode(file.read(told.get("src")))
                np.testing.assert_array_equal(pixels, layer.photo.samples.squeeze())
                assert pixels.dtype == dtype
            merged = imagecodecs.png_decode(file.read("mergedimage.png"))
            np.testing.assert_array_equal(merged, layers.picture.samples.squeeze())

    @pytest.mark.parametrize(
        ("size", "expected"), [((13, 21), (13, 21)), ((512, 300), (256, 150)), ((2000, 3), (256, 1))]
    )
    def test_the_thumbnail_is_small_and_of_the_same_shape(self, size, expected):
        layers = stack(np.uint16, 4, size[1], size[0])
        with self.opened(layers) as file, Image.open(file.open("Thumbnails/thumbnail.png")) as small:
            assert small.size == expected
            assert small.mode == "RGBA"

    def test_profile_and_resolution_are_kept(self):
        with self.opened(stack(profile=PROFILE, metadata=Metadata(dpi=(300.0, 240.0)))) as file:
            with Image.open(file.open("mergedimage.png")) as merged:
                assert merged.info["icc_profile"] == PROFILE
            image = ET.fromstring(file.read("stack.xml"))
            assert (image.get("xres"), image.get("yres")) == ("300", "240")

    def test_the_same_layers_give_the_same_bytes(self):
        assert encode_openraster(stack()) == encode_openraster(stack())

    def test_pyora_finds_the_layers(self, tmp_path):
        pyora = pytest.importorskip("pyora")
        layers, path = stack(), tmp_path / "a.ora"
        path.write_bytes(encode_openraster(layers))
        project = pyora.Project.load(str(path))
        assert project.dimensions == (13, 21)
        found = {layer.name: layer for layer in project.children}
        assert len(found) == len(layers.layers)
        for layer in layers.layers:
            other = found[layer.name]
            pixels = np.asarray(other.get_image_data(raw=True).convert("RGBA"))
            height, width = layer.photo.pixels.shape[:2]
            assert facts(layer) == (layer.name, *other.offsets, width, height, other.visible)
            np.testing.assert_array_equal(pixels[..., :3], layer.photo.pixels)


class TestPsd:
    def opened(self, layers):
        return pytest.importorskip("psd_tools").PSDImage.open(io.BytesIO(encode_psd(layers)))

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("channels", [1, 2, 3, 4])
    def test_psd_tools_finds_layers_and_pixels(self, dtype, channels):
        layers = stack(dtype, channels)
        psd = self.opened(layers)
        full = np.iinfo(dtype).max
        assert (psd.depth, psd.size) == (8 * np.dtype(dtype).itemsize, (13, 21))
        for layer, other in zip(layers.layers[::-1], psd, strict=True):
            assert facts(layer) == (other.name, *other.offset, *other.size, other.visible)
            assert other.blend_mode.name.lower().replace("_", "-") == layer.mode
            color = np.rint(other.numpy("color") * full).squeeze()
            np.testing.assert_array_equal(color, layer.photo.pixels)
            if layer.photo.alpha is not None:
                np.testing.assert_array_equal(
                    np.rint(other.numpy("shape") * full).squeeze(), layer.photo.alpha
                )

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("channels", [1, 2, 3, 4])
    def test_psd_tools_finds_the_picture(self, dtype, channels):
        picture = stack(dtype, channels).picture
        if picture.alpha is not None:  # what can hardly be seen is stored coarsely
            picture = replace(picture, alpha=np.maximum(picture.alpha, np.iinfo(dtype).max // 2))
        found = self.opened(Layers(picture, (Layer("Relit", picture),))).numpy()
        expected = picture.samples.squeeze() / np.iinfo(dtype).max
        assert np.abs(found.squeeze() - expected).max() <= 1.01 / np.iinfo(dtype).max

    @pytest.mark.parametrize("channels", [1, 3])
    @given(height=st.integers(1, 40), width=st.integers(1, 40))
    def test_pillow_finds_the_picture_of_any_size(self, channels, height, width):
        layers = stack(np.uint8, channels, height, width)
        with Image.open(io.BytesIO(encode_psd(layers))) as psd:
            np.testing.assert_array_equal(np.asarray(psd), layers.picture.pixels)
            assert [layer[0] for layer in psd.layers] == [layer.name for layer in layers.layers[::-1]]

    def test_pillow_finds_the_layers(self):
        layers = stack(np.uint8, 3)
        with Image.open(io.BytesIO(encode_psd(layers))) as psd:
            for layer, number in zip(layers.layers, range(len(layers.layers), 0, -1), strict=True):
                psd.seek(number)  # not to the first one at once: Pillow takes itself to be there
                left, top = layer.left, layer.top
                height, width = layer.photo.pixels.shape[:2]
                assert psd.layers[number - 1][2] == (left, top, left + width, top + height)
                pixels = np.asarray(psd.crop((left, top, left + width, top + height)))
                np.testing.assert_array_equal(pixels, layer.photo.samples.squeeze())

    def test_flat_rows_are_packed(self):
        flat = Photo(np.zeros((100, 1000, 3), np.uint8))
        assert len(encode_psd(Layers(flat, (Layer("Flat", flat),)))) < 2 * 3 * 100 * 1000 / 50

    def test_profile_metadata_and_resolution_are_kept(self):
        metadata = Metadata(b"II*\0\x08\0\0\0\0\0\0\0\0\0", b"<x:xmpmeta/>", (300.0, 240.5))
        data = encode_psd(stack(profile=PROFILE, metadata=metadata))
        with Image.open(io.BytesIO(data)) as psd:
            assert psd.info["icc_profile"] == PROFILE
        resources = pytest.importorskip("psd_tools").PSDImage.open(io.BytesIO(data)).image_resources
        assert resources.get_data(1058) == metadata.exif
        assert resources.get_data(1060) == metadata.xmp
        found = resources.get_data(1005)
        assert (found.horizontal / 0x10000, found.vertical / 0x10000) == (300.0, 240.5)
        assert (found.horizontal_unit, found.vertical_unit) == (1, 1)

    @pytest.mark.parametrize("mode", MODES)
    def test_a_name_beyond_ascii_is_kept(self, mode):
        layers = stack()
        named = replace(layers.layers[0], name="Licht ☀ 光", mode=mode)
        psd = self.opened(Layers(layers.picture, (named,)))
        assert [layer.name for layer in psd] == ["Licht ☀ 光"]
