"""Places: paths and URLs alike, written whole, and what patterns mean."""

import glob
import os
import subprocess
import sys
import uuid
from pathlib import Path

import fsspec
import pytest

from relit.batch.places import exists, expand, join, masked, read_bytes, write_atomically
from relit.errors import ImageError, OptionError, OutputError
from relit.photo.reading import PHOTO_SUFFIXES
from relit.train.reference_pool import ReferencePool
from tests.web import web

PHOTOS = [
    "1.jpg",
    "10.JPG",
    "2.png",
    "ann/3.tif",
    "ann/deep/4.heic",
    "bob/5.dng",
    "bob[1]/6.jpg",
    "é ü/7.webp",
]
OTHERS = ["notes.txt", "ann/3.csv", "ann/3.tif.tmp", "2.png~", "x.jpg.part"]
HIDDEN = [".relit-01ab.tmp", ".8.jpg", ".thumbs/9.jpg", "ann/._3.tif", "ann/.git/10.jpg"]


def bucket():
    """Return an S3 bucket of a server on this machine, where there is one."""
    pytest.importorskip("s3fs")
    moto = pytest.importorskip("moto.server")
    server = moto.ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    options = {"endpoint_url": f"http://{host}:{port}", "key": "k", "secret": "s"}
    fsspec.config.conf["s3"] = options
    fsspec.filesystem("s3").mkdir("shelf")
    return server


@pytest.fixture(scope="module")
def s3():
    server = bucket()
    yield "s3://shelf"
    fsspec.config.conf.pop("s3")
    server.stop()


@pytest.fixture(params=["path", "file", "memory", "renaming", "s3"])
def root(request, tmp_path):
    """An empty folder of each kind; fsspec's own ``local://`` writes by renaming, as sftp does."""
    if request.param == "s3":
        return f"{request.getfixturevalue('s3')}/{uuid.uuid4()}"
    return {
        "path": str(tmp_path),
        "file": f"file://{tmp_path}",
        "memory": f"memory://{uuid.uuid4()}",
        "renaming": f"local://{tmp_path}",
    }[request.param]


@pytest.fixture
def tree(root):
    """A folder with photos and other files, which hold their own names."""
    for name in PHOTOS + OTHERS + HIDDEN:
        write_atomically(join(root, name), name.encode(), overwrite=False)
    return root


class TestFiles:
    def test_come_back(self, root):
        place = join(root, "new/folders/1.png")
        assert not exists(place)
        write_atomically(place, b"one", overwrite=False)
        assert exists(place)
        assert read_bytes(place) == b"one"

    def test_are_replaced_only_if_they_may(self, root):
        place = join(root, "1.png")
        write_atomically(place, b"one", overwrite=True)
        with pytest.raises(OutputError, match=r"1\.png: exists already; use --force"):
            write_atomically(place, b"two", overwrite=False)
        assert read_bytes(place) == b"one"
        write_atomically(place, b"two", overwrite=True)
        assert read_bytes(place) == b"two"

    def test_leave_nothing_else_behind(self, root):
        for data in (b"one", b"two"):
            write_atomically(join(root, "1.png"), data, overwrite=True)
        store, key = fsspec.core.url_to_fs(root)
        assert [Path(name).name for name in store.find(key)] == ["1.png"]

    def test_that_others_wrote_are_seen(self, root):
        """fsspec's stores remember listings."""
        write_atomically(join(root, "1.png"), b"one", overwrite=False)
        assert expand(root) == [join(root, "1.png")]
        code = (
            "import sys\n"
            "from relit.batch.places import write_atomically\n"
            "write_atomically(sys.argv[1], b'', overwrite=False)"
        )
        if not root.startswith(("memory", "s3")):
            subprocess.run([sys.executable, "-c", code, join(root, "2.png")], check=True)
            assert expand(root) == [join(root, "1.png"), join(root, "2.png")]

    def test_that_are_missing(self, root):
        with pytest.raises(ImageError, match=r"1\.png: there is no such file; check the name"):
            read_bytes(join(root, "1.png"))
        assert not exists(join(root, "1.png"))

    def test_in_memory_belong_to_one_process(self):
        with pytest.raises(ImageError, match="in memory is known to its own process alone"):
            read_bytes("memory://no-such.png")

    def test_below_a_file_cannot_be(self, tmp_path):
        (tmp_path / "file").touch()
        for place in (f"{tmp_path}/file/1.png", f"local://{tmp_path}/file/1.png"):
            with pytest.raises(OutputError, match=r"1\.png: cannot be written"):
                write_atomically(place, b"", overwrite=True)
            with pytest.raises(ImageError, match=r"1\.png: cannot be read"):
                read_bytes(place)

    def test_are_no_folders(self, tmp_path):
        for place in (str(tmp_path), f"local://{tmp_path}"):
            with pytest.raises(ImageError, match="is a folder; give the name of one file in it"):
                read_bytes(place)
            with pytest.raises(OutputError):
                write_atomically(place, b"", overwrite=True)

    @pytest.mark.parametrize("scheme", ["", "local://"])
    def test_that_do_not_fit_leave_the_old_one(self, tmp_path, scheme):
        pytest.importorskip("resource", reason="needs the limits of POSIX")
        (tmp_path / "1.png").write_bytes(b"old")
        code = (
            "import resource, sys\n"
            "from relit.batch.places import write_atomically\n"
            "from relit.errors import OutputError\n"
            "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
            "try:\n    write_atomically(sys.argv[1], bytes(5000), overwrite=True)\n"
            "except OutputError as error:\n    sys.exit(str(error))\n"
        )
        words = [sys.executable, "-c", code, f"{scheme}{tmp_path}/1.png"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert "1.png: cannot be written (File too large); choose another place" in done.stderr
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"1.png": b"old"}


class TestPatterns:
    def test_a_folder_means_the_photos_below(self, tree):
        expected = sorted(join(tree, name) for name in PHOTOS)
        assert expand(tree) == expected
        assert expand(tree + "/") == expected

    def test_a_file_means_itself(self, tree):
        for name in ("notes.txt", "1.jpg", "bob[1]/6.jpg", ".8.jpg"):
            assert expand(join(tree, name)) == [join(tree, name)]

    def test_a_folder_with_a_wild_name(self, tree):
        assert expand(join(tree, "bob[1]")) == [join(tree, "bob[1]/6.jpg")]

    @pytest.mark.parametrize(
        ("pattern", "names"),
        [
            ("*.jpg", ["1.jpg"]),
            ("*.[jJ][pP][gG]", ["1.jpg", "10.JPG"]),
            ("?.*", ["1.jpg", "2.png"]),
            ("**/*.tif", ["ann/3.tif"]),
            ("**/*.jpg", ["1.jpg", "bob[1]/6.jpg"]),
            ("ann/**", ["ann/3.csv", "ann/3.tif", "ann/deep/4.heic"]),
            ("ann/*", ["ann/3.csv", "ann/3.tif"]),
            ("*/*.dng", ["bob/5.dng"]),
            ("bob[[]1]/*", ["bob[1]/6.jpg"]),
            ("é ?/*", ["é ü/7.webp"]),
        ],
    )
    def test_mean_what_a_shell_says(self, tree, pattern, names):
        assert expand(join(tree, pattern)) == sorted(join(tree, name) for name in names)

    @pytest.mark.parametrize(
        "pattern", ["*", "**", "**/*", "*/*", "**/[0-9].*", "*n*/**/*.*", "no/*", "**/deep/*"]
    )
    def test_agree_with_glob(self, tmp_path, monkeypatch, pattern):
        for name in PHOTOS + OTHERS + HIDDEN:
            write_atomically(str(tmp_path / name), b"", overwrite=False)
        monkeypatch.chdir(tmp_path)
        temporary = (".tmp", "~", ".part")
        found = glob.glob(pattern, recursive=True)  # noqa: PTH207 (pathlib finds hidden files as well)
        found = [name for name in found if Path(name).is_file()]
        expected = sorted(name for name in found if not name.endswith(temporary))
        if expected:
            assert expand(pattern) == expected
        else:
            with pytest.raises(OptionError):
                expand(pattern)

    @pytest.mark.parametrize("pattern", ["*.gif", "no-such", "no-such/*.jpg", "1.jpg/*"])
    def test_that_mean_nothing(self, tree, pattern):
        with pytest.raises(OptionError, match="means no file; expected the name of one, a folder"):
            expand(join(tree, pattern))

    @pytest.mark.skipif(os.name != "posix", reason="needs links and pipes")
    def test_follow_links_to_photos_and_not_to_folders(self, tmp_path):
        (tmp_path / "a").mkdir()
        (tmp_path / "a/1.jpg").touch()
        (tmp_path / "2.jpg").symlink_to(tmp_path / "a/1.jpg")
        (tmp_path / "round").symlink_to(tmp_path)
        (tmp_path / "broken.jpg").symlink_to(tmp_path / "no-such.jpg")
        os.mkfifo(tmp_path / "pipe.jpg")  # to read it would take for ever
        expected = [str(tmp_path / name) for name in ("2.jpg", "a/1.jpg")]
        assert expand(str(tmp_path)) == expand(f"{tmp_path}/**/*.jpg") == expected
        assert expand(str(tmp_path / "round")) == [
            f"{tmp_path}/round/{name}" for name in ("2.jpg", "a/1.jpg")
        ]

    @pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
    def test_below_a_folder_that_is_closed(self, tmp_path):
        (tmp_path / "closed").mkdir(mode=0)
        with pytest.raises(OptionError, match="closed: cannot be listed"):
            expand(str(tmp_path))

    @pytest.mark.skipif(os.name != "posix", reason="needs links")
    @pytest.mark.parametrize("pattern", ["", "/*.png", "/**/*.png"])
    def test_a_link_in_a_circle_does_not_stop_the_others(self, tmp_path, pattern):
        (tmp_path / "1.png").touch()
        (tmp_path / "deep").mkdir()
        (tmp_path / "circle.png").symlink_to(tmp_path / "circle.png")
        (tmp_path / "deep/circle").symlink_to(tmp_path / "deep/circle")
        found = expand(f"{tmp_path}{pattern}")
        assert found == [f"{tmp_path}/1.png", f"{tmp_path}/circle.png"]
        with pytest.raises(ImageError, match=r"circle\.png: cannot be read \(Too many levels of symbolic"):
            read_bytes(found[1])

    def test_are_those_of_all_that_look_for_photos(self, tmp_path):
        """Hidden and temporary files are no references either."""
        for name in PHOTOS + OTHERS + HIDDEN:
            write_atomically(str(tmp_path / name), b"", overwrite=False)
        for pattern in ("", "/*", "/**/*.jpg", "/ann", "/bob[1]", "/?.*"):
            found = map(str, ReferencePool(f"{tmp_path}{pattern}").given)
            assert sorted(found) == expand(f"{tmp_path}{pattern}")

    def test_know_the_photos_that_are_read(self):
        assert {".jpg", ".png", ".tif", ".heic", ".dng", ".exr", ".webp"} <= PHOTO_SUFFIXES


class TestUrls:
    @pytest.mark.parametrize(
        "do", [read_bytes, exists, expand, lambda p: write_atomically(p, b"", overwrite=True)]
    )
    def test_of_an_unknown_kind(self, do):
        with pytest.raises(OptionError, match=r"nonsense://x/1\.png: Protocol not known: nonsense"):
            do("nonsense://x/1.png")

    def test_need_what_their_kind_needs(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "gcsfs", None)
        with pytest.raises(OptionError, match="install"):
            read_bytes("gs://bucket/1.png")

    def test_of_the_web_are_read(self, tmp_path):
        pytest.importorskip("aiohttp")
        (tmp_path / "1.png").write_bytes(b"one")

        with web(tmp_path) as url:
            assert read_bytes(f"{url}/1.png?signature=secret") == b"one"
            with pytest.raises(ImageError, match="there is no such file") as caught:
                read_bytes(f"{url}/2.png?signature=secret")
        assert "secret" not in str(caught.value)
        assert expand(f"{url}/*.png?a=[b]") == [f"{url}/*.png?a=[b]"]
        with pytest.raises(OutputError, match="http can only be read from"):
            write_atomically(f"{url}/3.png", b"", overwrite=True)

    @pytest.mark.parametrize(
        ("text", "shown"),
        [
            ("sftp://ann:s3cret@host/1.png", "sftp://***@host/1.png"),
            ("sftp://ann:s3@cret@host/a@b.png", "sftp://***@host/a@b.png"),
            ("no https://x/y?sig=s3cret&a=b, or 'ftp://a:s3cret@b'", "no https://x/y?*** or 'ftp://***@b'"),
            ("s3://bucket/a@2x/1.png", "s3://bucket/a@2x/1.png"),
            ("ann@host?.png", "ann@host?.png"),
        ],
    )
    def test_keep_their_secrets(self, text, shown):
        assert masked(text) == shown

    def test_keep_their_secrets_in_errors(self):
        """Also in those that come from below, which hold the whole URL."""
        for do in (read_bytes, lambda place: write_atomically(place, b"", overwrite=True)):
            with pytest.raises((ImageError, OutputError, OptionError)) as caught:
                do("ftp://ann:s3cret@127.0.0.1:9/1.png")
            assert "s3cret" not in str(caught.value)
            assert caught.value.__cause__ is None
