"""What rows read is what is there, however it changes, and is read no oftener than need be."""

import os
import subprocess
import sys
import threading
import uuid

import fsspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from relit.batch import places
from relit.batch.cache import DiskCache
from relit.batch.places import version_of
from relit.batch.reading import Shelf
from relit.errors import ImageError
from relit.photo.reading import read_image
from tests.web import web


@pytest.fixture
def asked(monkeypatch):
    """The places that were really read."""
    found, read = [], places.read_bytes
    monkeypatch.setattr(places, "read_bytes", lambda place: found.append(place) or read(place))
    return found


@pytest.fixture
def root():
    return f"memory://{uuid.uuid4()}"


def contents(shelf, *names):
    return [held.data for held in shelf.read(names).values()]


class TestShelf:
    def test_what_is_as_it_was_is_read_and_decoded_once(self, tmp_path, asked):
        place = str(tmp_path / "1.png")
        Image.fromarray(np.arange(120, dtype=np.uint8).reshape(10, 12)).save(place)
        shelf = Shelf()
        first, again = (shelf.read([place])[place] for _ in range(2))
        assert asked == [place]
        assert first.photo is again.photo
        np.testing.assert_array_equal(first.photo.pixels, read_image(place).pixels)

    @settings(max_examples=30, deadline=None)
    @given(
        st.integers(0, 60),
        st.lists(
            st.tuples(st.integers(0, 3), st.integers(0, 3), st.none() | st.binary(max_size=30)), max_size=20
        ),
    )
    def test_it_gives_what_is_there(self, tmp_path_factory, most, steps):
        """Reads in any order, of files that are written in between, against reading them."""
        folder, shelf = tmp_path_factory.mktemp("held"), Shelf(most)
        for number in range(4):
            (folder / f"{number}").write_bytes(b"")
        for when, (one, other, new) in enumerate(steps):
            if new is not None:
                (folder / f"{one}").write_bytes(new)
                os.utime(folder / f"{one}", ns=(when, when))  # file systems' clocks tick slowly
            names = [str(folder / f"{one}"), str(folder / f"{other}")]
            found = shelf.read(names)
            assert list(found) == list(dict.fromkeys(names))
            for name, held in found.items():
                assert held.data == (folder / name).read_bytes()
                assert held.file.version == version_of(name)

    def test_it_holds_no_more_than_it_may_but_those_of_the_row(self, tmp_path, asked):
        for name in "abcd":
            (tmp_path / name).write_bytes(name.encode() * 10)
        a, b, c, d = (str(tmp_path / name) for name in "abcd")
        shelf = Shelf(30)
        for row in ((a, b), (a, c), (a, d), (a, c)):
            shelf.read(row)
        assert asked == [a, b, c, d]  # a stays while it is wanted
        shelf.read([b])  # a, c and d were 30 bytes, d was not asked for longest
        asked.clear()
        shelf.read([c, a, d])
        assert asked == [d]
        shelf.read([a, b, c, d])  # more than 30
        asked.clear()
        shelf.read([a, b, c, d])
        assert asked == []

    def test_what_is_missing_is_told_each_time(self, tmp_path):
        place, shelf = tmp_path / "1.png", Shelf()
        place.write_bytes(b"one")
        shelf.read([str(place)])
        place.unlink()
        for _ in range(2):
            with pytest.raises(ImageError, match=r"1\.png: there is no such file"):
                shelf.read([str(place)])

    def test_threads(self, tmp_path):
        for number in range(8):
            (tmp_path / f"{number}").write_bytes(bytes([number]) * 100)
        shelf, wrong = Shelf(300), []

        def read(seed):
            for number in np.random.default_rng(seed).integers(0, 8, 200):
                wrong.extend({bytes([number]) * 100} ^ set(contents(shelf, str(tmp_path / f"{number}"))))

        threads = [threading.Thread(target=read, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert wrong == []


class TestUrls:
    def test_are_fetched_once_for_all_processes(self, tmp_path, root, asked):
        """Two shelves with a cache between them stand for two processes."""
        place = f"{root}/1.png"
        places.write_atomically(place, b"one", overwrite=False)
        for _ in range(2):
            with DiskCache(tmp_path, 1000).open():
                assert contents(Shelf(), place) == [b"one"]
        assert asked == [place]
        places.write_atomically(place, b"two", overwrite=True)
        with DiskCache(tmp_path, 1000).open():
            assert contents(Shelf(), place) == [b"two"]
        assert asked == [place, place]

    def test_that_tell_no_version_are_read_each_time(self, root, asked, monkeypatch):
        place, shelf = f"{root}/1.png", Shelf()
        places.write_atomically(place, b"one", overwrite=False)
        kind = type(fsspec.filesystem("memory"))
        monkeypatch.setattr(kind, "info", lambda self, path: {"name": path, "size": 3})  # noqa: ARG005
        assert version_of(place) is None
        assert [contents(shelf, place) for _ in range(2)] == [[b"one"]] * 2
        assert asked == [place, place]


class TestVersions:
    def test_are_the_same_until_a_file_changes(self, root):
        place = f"{root}/1.png"
        assert version_of(place) is None
        places.write_atomically(place, b"one", overwrite=False)
        before = version_of(place)
        assert before == version_of(place)
        assert before.startswith("3 ")
        places.write_atomically(place, b"two", overwrite=True)
        assert version_of(place) != before

    def test_are_the_same_in_another_process(self, tmp_path):
        place = f"local://{tmp_path}/1.png"
        places.write_atomically(place, b"one", overwrite=False)
        code = "import sys; from relit.batch.places import version_of; print(version_of(sys.argv[1]))"
        told = subprocess.run([sys.executable, "-c", code, place], capture_output=True, check=True, text=True)
        assert told.stdout.strip() == version_of(place)

    def test_of_the_web_are_by_its_headers(self, tmp_path):
        pytest.importorskip("aiohttp")
        (tmp_path / "1.png").write_bytes(b"one")

        with web(tmp_path) as root:
            url = f"{root}/1.png"
            before = version_of(url)
            os.utime(tmp_path / "1.png", (0, 0))  # Last-Modified has whole seconds
            assert before is not None
            assert version_of(url) not in (before, None)

    def test_of_what_cannot_be_asked_are_none(self):
        assert version_of("nonsense://x") is None
        assert version_of("ftp://127.0.0.1:9/1.png") is None
