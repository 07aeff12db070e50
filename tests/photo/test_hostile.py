"""Hostile files: thousands of damaged and crafted ones are read or refused, and nothing else ever happens."""

import io
import shlex
import struct
import sys
import zlib
from collections import Counter
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from crafted_cves import cves
from hostile import PHOTOS, check, run
from hostile_corpus import Case, landmark_files, mutants, photos, png
from hostile_crafted import crafted
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from relit import inputs
from relit.cli import app as cli
from relit.errors import FaceNotFoundError, ImageError, LandmarkError
from relit.face.landmark_files import read_landmarks
from relit.photo.reading import read_image
from relit.photo.samples import sample


def assert_no_fault(verdicts, folder):
    """Name every case that broke something, and keep it for whoever has to look into it."""
    faults = [verdict for verdict in verdicts if verdict.fault]
    for verdict in faults:
        (folder / verdict.case.name).write_bytes(verdict.case.data)
    assert not faults, "\n".join(f"{folder / v.case.name}: {v.fault}" for v in faults)


ENDLESS = "while True: pass"
#: A test that cannot fail is none: what a reader might do, and what must be said of it.
MISDEEDS = {
    "import os; os.abort()": r"kills the process \(exit code -?\d+",
    ENDLESS: "runs for more than 10 s",
    "raise KeyError('k')": "KeyError: 'k'",
    "raise SystemExit(3)": "SystemExit: 3",
    "import warnings; warnings.warn('careful')": "UserWarning: careful",
    "print('hello')": r"prints b'hello",
    "import os; os.write(2, b'libnoise: odd')": "prints b'libnoise: odd'",
    "import time; t = time.process_time()\nwhile time.process_time() < t + 0.6: pass": r"takes 0\.\d s",
    "bytearray(b'x') * (2100 << 20)": r"takes 2\d\d\d MB" if sys.platform != "win32" else "takes",
}


@pytest.mark.rotating
@pytest.mark.slow
def test_every_misdeed_is_noticed_and_the_rest_goes_on(tmp_path):
    deeds = [part for deed in MISDEEDS for part in (deed, "")]
    cases = [Case(f"{number}.png", ".py", deed.encode()) for number, deed in enumerate(deeds)]
    endless = 2 * list(MISDEEDS).index(ENDLESS)
    # The others may take long on a busy machine.
    found = run(cases[endless : endless + 2], execute, seconds=0.5, patience=10, workers=1)
    found += run([*cases[:endless], *cases[endless + 2 :]], execute, seconds=0.5)
    verdicts = {verdict.case.name: verdict for verdict in found}
    for number, deed in enumerate(deeds):
        verdict = verdicts.pop(f"{number}.png")
        if not deed:
            assert not verdict.fault
            continue
        with pytest.raises(AssertionError, match=f"{number}.png: .*{MISDEEDS[deed]}"):
            assert_no_fault([verdict], tmp_path)
        assert (tmp_path / f"{number}.png").read_text() == deed
    assert not verdicts


def execute(path):
    """Do what a file says: the misdeeds above."""
    exec(path.read_text(), {})
    return "read"


class TestFiles:
    """Every case is a valid photo that can be written again, valid landmarks, or one line of ours.

    Each runs in at most 10 s and 2 GB, silently, and with warnings as errors: see `hostile.check`.
    """

    def test_what_is_to_be_damaged_is_whole(self, tmp_path):
        for name, data in (photos() | landmark_files()).items():
            path = tmp_path / name
            path.write_bytes(data)
            if name == "cmyk.jpg":
                continue
            assert check(path) == "read", name

    @pytest.mark.parametrize(
        "name",
        [
            *("plain.tif", "plain.png", "plain.jpg", "plain.webp", "plain.bmp", "plain.xml", "plain.json"),
            pytest.param("plain.exr", marks=pytest.mark.skipif(not find_spec("OpenEXR"), reason="an extra")),
            pytest.param("plain.dng", marks=pytest.mark.skipif(not find_spec("rawpy"), reason="an extra")),
        ],
    )
    def test_what_known_faults_are_put_into_is_whole(self, name, tmp_path):
        path = tmp_path / name
        path.write_bytes(dict(cves())[f"cve-{name}"])
        assert check(path) == "read"

    def test_there_are_enough_of_known_faults(self):
        names = [name for name, _ in cves()]
        assert len(names) == len(set(names)) > 800
        of = Counter(name.rpartition(".")[2] for name in names)
        assert (
            min(of[kind] for kind in ("tif", "png", "jpg", "webp", "bmp", "exr", "heic", "dng", "xml")) > 25
        )

    @pytest.mark.slow
    def test_damaged(self, part_of, tmp_path):
        numbers = list(part_of(range(6000), 4))
        verdicts = run(mutants(numbers))
        assert len(verdicts) == len(numbers) > 1000
        assert_no_fault(verdicts, tmp_path)
        outcomes = Counter(verdict.outcome for verdict in verdicts)
        assert outcomes["read"] > len(numbers) / 6
        assert outcomes["refused"] > len(numbers) / 6

    @pytest.mark.rotating
    @pytest.mark.slow
    def test_crafted(self, part_of, tmp_path):
        names = []

        def noted():
            for case in crafted():
                names.append(case.name)
                yield case

        # Not one of four, as the days of the test itself: then some cases would never have their turn.
        verdicts = run(part_of(noted(), 5, key=lambda case: case.name))
        assert len(set(names)) == len(names) > 600
        assert len({verdict.case.name for verdict in verdicts}) == len(verdicts) > 60
        assert_no_fault(verdicts, tmp_path)


CHUNKS = st.sampled_from(
    [
        b"IHDR",
        b"PLTE",
        b"IDAT",
        b"IEND",
        b"tRNS",
        b"iCCP",
        b"eXIf",
        b"iTXt",
        b"pHYs",
        b"acTL",
        b"gAMA",
        b"cHRM",
        b"cICP",
        b"tEXt",
        b"zTXt",
        b"sBIT",
    ]
)
CONTENTS = (
    st.binary(max_size=40)
    | st.binary(max_size=200).map(zlib.compress)
    | st.binary(max_size=40).map(lambda text: b"XML:com.adobe.xmp\0\1\0\0\0" + zlib.compress(text))
    | st.binary(max_size=40).map(lambda text: b"Author\0\0" + zlib.compress(text))
    | st.binary(max_size=40).map(lambda data: b"Raw profile type exif\0\n\n9\n" + data.hex().encode())
    | st.binary(min_size=32, max_size=32)
    | st.binary(min_size=4, max_size=4)
    | st.binary(max_size=40).map(lambda profile: b"x\0\0" + zlib.compress(profile))
    | st.binary(max_size=40).map(lambda block: b"II*\0\x08\0\0\0" + block)
)
HEADERS = st.builds(
    lambda *fields: (b"IHDR", struct.pack(">IIBBBBB", *fields)),
    st.integers(0, 20),
    st.integers(0, 20),
    st.sampled_from([1, 2, 4, 8, 16, 5]),
    st.sampled_from([0, 2, 3, 4, 6, 1]),
    st.integers(0, 1),
    st.integers(0, 1),
    st.integers(0, 2),
)
PIXELS = st.binary(min_size=400, max_size=3000).map(lambda rows: (b"IDAT", zlib.compress(rows)))
NUMBERS = st.sampled_from(
    ["0", "-1", "1e999", "nan", "7" * 400, "1e-400", "null", "", "x", "0x1", "1_0"]
) | st.one_of(st.integers(-99, 99), st.floats(0, 99)).map(str)
ROWS = st.lists(st.tuples(NUMBERS, NUMBERS), max_size=8)


def lines_of(rows, separator):
    return "".join(f"{x}{separator}{y}\n" for x, y in rows)


LAYOUTS = {
    ".pts": lambda rows, count: f"version: 1\nn_points: {count}\n{{\n{lines_of(rows, ' ')}}}\n",
    ".tem": lambda rows, count: f"{count}\n{lines_of(rows, ' ')}0\n",
    ".csv": lambda rows, _count: "x,y\n" + lines_of(rows, ","),
    ".json": lambda rows, count: (
        f'{{"version": 3, "groups": {{"a": {{"confidence": {count}, "landmarks": {{"points": '
        f"[{', '.join(f'[{y}, {x}]' for x, y in rows)}]}}}}}}}}"
    ),
    ".xml": lambda rows, count: (
        f"<dataset><images><image file='{count}'><box>"
        + "".join(f"<part name='{i}' x='{x}' y='{y}'/>" for i, (x, y) in enumerate(rows))
        + "</box></image></images></dataset>"
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("drawn")


class TestDrawn:
    """Files that are built as the format asks for, out of contents that it does not."""

    @given(
        header=HEADERS,
        chunks=st.lists(st.tuples(CHUNKS, CONTENTS), max_size=5),
        pixels=PIXELS,
        data=st.data(),
    )
    def test_png(self, folder, header, chunks, pixels, data):
        chunks.insert(data.draw(st.integers(0, len(chunks))), pixels)
        path = folder / "drawn.png"
        path.write_bytes(png(header, *chunks, (b"IEND", b"")))
        check(path)

    @pytest.mark.parametrize("extension", LAYOUTS)
    @given(rows=ROWS, count=st.integers(0, 8) | NUMBERS, cut=st.integers(0, 9))
    def test_landmarks(self, folder, extension, rows, count, cut):
        text = LAYOUTS[extension](rows, count)
        path = folder / f"drawn{extension}"
        path.write_text(text[: len(text) - cut])
        check(path)

    @pytest.mark.parametrize("extension", LAYOUTS)
    @given(
        rows=st.lists(st.tuples(st.integers(0, 99), st.integers(0, 99)), min_size=3, max_size=8, unique=True)
    )
    def test_the_layouts_are_right(self, folder, extension, rows):
        path = folder / f"right{extension}"
        path.write_text(LAYOUTS[extension](rows, 1 if extension == ".json" else len(rows)))
        with suppress(LandmarkError):  # on one line
            points = read_landmarks(path).points
            np.testing.assert_array_equal(points + (extension == ".pts"), rows)  # counted from 1


class TestSources:
    def test_a_stream_without_end(self):
        class Endless(io.RawIOBase):
            def read(self, count=-1):
                assert count > 0, "would never come back"
                return b"P5 " * (count // 3)

        with pytest.raises(ImageError, match=r"is larger than \d+ MB"):
            read_image(Endless(), max_pixels=1000)

    @pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="needs Linux")
    def test_a_file_that_cannot_be_read(self):
        with pytest.raises(ImageError, match=r"/proc/self/mem: cannot be read \(Input/output error\)"):
            read_image("/proc/self/mem")

    def test_a_photo_whose_parts_are_empty(self):
        data = next(case.data for case in crafted("tiff") if case.name == "strip-of-no-bytes.tif")
        with pytest.raises(ImageError, match="lacks a part of its picture"):
            read_image(io.BytesIO(data))

    def test_a_photo_that_takes_more_than_it_should(self):
        wide = np.zeros((10, 10, 3), np.float32)
        file = io.BytesIO()
        from relit.photo.writing import write_image

        write_image(file, wide, format="tiff")
        with pytest.raises(ImageError, match="claims 10x10 px of 12 bytes each, more than"):
            read_image(io.BytesIO(file.getvalue()), max_pixels=200)
        assert read_image(io.BytesIO(file.getvalue()), max_pixels=300).pixels.dtype == np.float32


@pytest.fixture
def studio(tmp_path, monkeypatch):
    """A working folder with one good photo and hostile files."""
    with Image.open(sample("reference")) as photo:
        photo.convert("RGB").crop((230, 130, 630, 650)).resize((80, 104)).save(tmp_path / "good.png")
    (tmp_path / "good.csv").write_text("x,y\n20,40\n60,40\n40,80\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def relit(studio, capfd):
    """Run a command that has to end in one line and leave the folder as it was."""

    def run(command):
        before = {path: path.read_bytes() for path in studio.iterdir()}
        with pytest.raises(SystemExit) as stop:
            cli.main(shlex.split(command))
        out, err = capfd.readouterr()
        assert stop.value.code in (1, 2)
        assert out == ""
        assert err.startswith("relit: error: ")
        assert err.count("\n") == 1
        assert {path: path.read_bytes() for path in studio.iterdir()} == before

    return run


def a_few(extensions):
    """Return damaged files, a few of every kind."""
    return [case for case in mutants(range(600)) if case.extension in extensions][::13]


@pytest.fixture
def one_search_for_each_picture(monkeypatch):
    """Search equal pictures once: many hostile files still hold the same one, and it has no face."""
    search, told = inputs.detect_landmarks, {}

    def detect(image, **options):
        picture = image.shape, image.dtype.str, image.tobytes(), *options.items()
        if picture not in told:
            with pytest.raises(FaceNotFoundError) as none_found:
                search(image, **options)
            told[picture] = none_found.value
        raise told[picture]

    monkeypatch.setattr(inputs, "detect_landmarks", detect)


class TestCommands:
    @pytest.mark.slow
    @pytest.mark.usefixtures("one_search_for_each_picture")
    def test_photos(self, studio, relit, part_of):
        cases = [*a_few(PHOTOS), *crafted("other")]
        assert len(cases) > 50
        cases = list(part_of(cases, 4, key=lambda case: case.name))
        assert len(cases) > 5
        for number, case in enumerate(cases):
            (studio / f"hostile{number}{case.extension}").write_bytes(case.data)
            relit(f"transfer hostile{number}{case.extension} good.png -o out.png --stages steps")

    def test_landmarks(self, studio, relit):
        cases = a_few({".pts", ".tem", ".csv", ".json", ".ljson", ".xml"})
        refused = 0
        for number, case in enumerate(cases):
            path = studio / f"hostile{number}{case.extension}"
            path.write_bytes(case.data)
            try:
                read_landmarks(path)
            except LandmarkError:
                refused += 1
                relit(
                    f"transfer good.png good.png -o out.png --target-landmarks {path.name} "
                    "--reference-landmarks good.csv"
                )
        assert refused > 5
