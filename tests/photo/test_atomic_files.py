from __future__ import annotations

import os
import stat
import threading
from pathlib import Path

import pytest

from relit.errors import OutputError
from relit.photo import atomic_files
from relit.photo.atomic_files import put_in_place, save_atomically


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_new_file_holds_the_bytes_and_nothing_else_appears(tmp_path, overwrite):
    save_atomically(tmp_path / "a.bin", b"\x00\r\n\xff", overwrite=overwrite)
    assert (tmp_path / "a.bin").read_bytes() == b"\x00\r\n\xff"
    assert names(tmp_path) == ["a.bin"]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no umask")
@pytest.mark.parametrize("overwrite", [False, True])
def test_permissions_are_those_of_any_new_file(tmp_path, overwrite):
    (tmp_path / "plain").write_bytes(b"")
    save_atomically(tmp_path / "a.bin", b"x", overwrite=overwrite)
    mode = stat.S_IMODE((tmp_path / "a.bin").stat().st_mode)
    assert mode == stat.S_IMODE((tmp_path / "plain").stat().st_mode)


def test_an_existing_file_is_refused_and_kept(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with pytest.raises(OutputError, match=r"a\.bin: exists already; use --force or overwrite=True"):
        save_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


def test_an_existing_file_is_replaced_when_asked(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old and longer")
    save_atomically(path, b"new", overwrite=True)
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["a.bin"]


def test_a_link_is_followed_when_overwriting(tmp_path):
    (tmp_path / "real.bin").write_bytes(b"old")
    (tmp_path / "link.bin").symlink_to("real.bin")
    save_atomically(tmp_path / "link.bin", b"new", overwrite=True)
    assert (tmp_path / "link.bin").is_symlink()
    assert (tmp_path / "real.bin").read_bytes() == b"new"


def test_a_dangling_link_is_refused(tmp_path):
    (tmp_path / "link.bin").symlink_to("nowhere.bin")
    with pytest.raises(OutputError, match="exists already"):
        save_atomically(tmp_path / "link.bin", b"new")
    assert names(tmp_path) == ["link.bin"]


@pytest.mark.parametrize("overwrite", [False, True])
def test_links_in_a_circle_are_an_output_error(tmp_path, overwrite):
    (tmp_path / "link.bin").symlink_to("link.bin")
    with pytest.raises(OutputError, match=r"exists already|cannot be written"):
        save_atomically(tmp_path / "link.bin", b"new", overwrite=overwrite)
    assert names(tmp_path) == ["link.bin"]


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_directory_or_device_is_never_replaced(tmp_path, overwrite):
    with pytest.raises(OutputError, match="is not a file"):
        save_atomically(tmp_path, b"x", overwrite=overwrite)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OutputError, match="is not a file"):
        save_atomically(tmp_path / "pipe", b"x", overwrite=overwrite)
    assert names(tmp_path) == ["pipe"]


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_missing_folder_is_named(tmp_path, overwrite):
    with pytest.raises(OutputError, match=r"there is no folder .*missing; create it"):
        save_atomically(tmp_path / "missing" / "a.bin", b"x", overwrite=overwrite)
    assert names(tmp_path) == []


@pytest.mark.parametrize("name", ["a\0b", "n" * 300])
@pytest.mark.parametrize("overwrite", [False, True])
def test_an_impossible_name_is_an_output_error(tmp_path, name, overwrite):
    with pytest.raises(OutputError, match="cannot be written"):
        save_atomically(tmp_path / name, b"x", overwrite=overwrite)
    assert names(tmp_path) == []


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(28, "No space left on device")])
@pytest.mark.parametrize("overwrite", [False, True])
def test_a_failure_half_way_leaves_the_old_state(tmp_path, monkeypatch, failure, overwrite):
    if overwrite:
        (tmp_path / "a.bin").write_bytes(b"old")
    before = names(tmp_path)

    def fail(_descriptor: int) -> None:
        raise failure

    monkeypatch.setattr(os, "fsync", fail)
    expected = OutputError if isinstance(failure, OSError) else KeyboardInterrupt
    with pytest.raises(expected, match=r"^$|No space left on device"):
        save_atomically(tmp_path / "a.bin", b"new", overwrite=overwrite)
    assert names(tmp_path) == before
    assert not overwrite or (tmp_path / "a.bin").read_bytes() == b"old"


@pytest.mark.parametrize("exists", [False, True])
def test_a_filesystem_without_hard_links(tmp_path, monkeypatch, exists):
    def no_links(*_paths: object, **_options: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    path = tmp_path / "a.bin"
    if exists:
        path.write_bytes(b"old")
        with pytest.raises(OutputError, match="exists already"):
            save_atomically(path, b"new")
    else:
        save_atomically(path, b"new")
    assert path.read_bytes() == (b"old" if exists else b"new")
    assert names(tmp_path) == ["a.bin"]


def test_a_name_taken_for_nothing_is_given_back(tmp_path, monkeypatch):
    def fail(*_paths: object, **_options: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", fail)
    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OutputError, match="cannot be written"):
        save_atomically(tmp_path / "a.bin", b"new")
    assert names(tmp_path) == []


def test_of_several_writers_at_once_one_wins(tmp_path):
    """The refusal has no gap between looking and writing."""
    start = threading.Barrier(8)
    saved: list[bytes] = []

    def write(data: bytes) -> None:
        start.wait()
        try:
            save_atomically(tmp_path / "a.bin", data)
        except OutputError:
            return
        saved.append(data)

    threads = [threading.Thread(target=write, args=(bytes([n]) * 1000,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [(tmp_path / "a.bin").read_bytes()] == saved
    assert names(tmp_path) == ["a.bin"]


class TestPutInPlace:
    """A file that lies there already, as a film does, gets its name."""

    @pytest.fixture
    def made(self, tmp_path):
        path = tmp_path / "made"
        path.write_bytes(b"film")
        return path

    def test_its_name_is_the_new_one_alone(self, tmp_path, made):
        put_in_place(made, tmp_path / "film.mp4")
        assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]
        assert (tmp_path / "film.mp4").read_bytes() == b"film"

    def test_what_came_there_meanwhile_is_kept(self, tmp_path, made, monkeypatch):
        path = tmp_path / "film.mp4"
        name = atomic_files._name

        def late(*given):
            path.write_bytes(b"another's")
            name(*given)

        monkeypatch.setattr(atomic_files, "_name", late)
        with pytest.raises(OutputError, match="exists already"):
            put_in_place(made, path)
        assert (path.read_bytes(), made.read_bytes()) == (b"another's", b"film")

    def test_a_link_that_may_be_overwritten_stays(self, tmp_path, made):
        real, link = tmp_path / "real.mp4", tmp_path / "link.mp4"
        real.write_bytes(b"old")
        link.symlink_to(real)
        put_in_place(made, link, overwrite=True)
        assert link.is_symlink()
        assert real.read_bytes() == b"film"
