"""Names that every system can hold: by what Windows, FAT, ext4 and APFS say of names."""

import json
import os
import shutil
import unicodedata
import warnings
from pathlib import PureWindowsPath

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from relit.batch.jobs import Row
from relit.batch.long_paths import extended
from relit.batch.naming import Naming
from relit.batch.pairing import Pairs
from relit.batch.portable import folded, portable
from relit.settings.options import TransferOptions

DEVICES = ["CON", "prn", "Aux", "NUL", "COM1", "com9", "LPT3", "COM¹", "conin$", "CONOUT$"]
NAMES = st.builds(
    lambda first, rest, end: first + rest + end,
    st.sampled_from(["", *DEVICES]),
    st.text(st.characters(exclude_characters="\0/") | st.sampled_from('<>:"|?*\\\n\t \udcff.'), max_size=300),
    st.sampled_from(["", ".png", ".", " ", ".tar.gz"]),
).filter(bool)


def is_of_windows(name):
    """Return whether Windows takes a name, as Python's own pathlib knows."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        reserved = PureWindowsPath(name).is_reserved()
    return not (reserved or set(name) & set('<>:"|?*\\/') or min(name) < " " or name[-1] in ". ")


class TestPortable:
    @given(NAMES)
    @example("CON.png")
    @example("aux .tar.png")
    @example("...")
    @example("é" * 200 + ".png")
    @example("a." + "b" * 300)
    @example("\udcff" * 300)
    def test_every_system_holds_it(self, name):
        safe = portable(name)
        assert is_of_windows(safe)
        assert len(safe.encode()) <= 255  # and encodes at all, as APFS asks for
        assert portable(safe) == safe
        kept = name.isascii() and name.isprintable() and is_of_windows(name) and len(name) < 256
        assert safe == name or not kept

    @given(st.lists(NAMES, min_size=2, max_size=2, unique=True))
    def test_two_stay_two(self, names):
        assert portable(names[0]) != portable(names[1])

    @pytest.mark.parametrize(
        "name", ["anna.png", "Änne ü.JPG", "com10.png", "console.png", "a~b.png", ".x", "नमस्ते.png"]
    )
    def test_what_is_harmless_stays(self, name):
        assert portable(name) == name

    def test_the_suffix_stays(self):
        for name in ("CON.jpg", "a?.jpg", "x" * 300 + ".jpg", "nul..jpg"):
            assert portable(name).endswith(".jpg")


def outputs(targets, kind="transfer", references=("ref/x.png",)):
    rows = Pairs(targets, references)
    naming = Naming(rows, kind, TransferOptions())
    return {row.target: naming.job(row).output for row in rows}, naming


class TestMirrored:
    @pytest.mark.parametrize("kind", ["transfer", "landmarks", "decompose"])
    @pytest.mark.parametrize(
        "targets",
        [
            ["in/A.png", "in/a.png"],
            ["in/A.png", "in/a.png", "in/a.jpg"],
            ["in/\u00e9.png", "in/e\u0301.png"],
            ["in/X/a.png", "in/x/a.png"],
            ["in/stra\u00dfe.png", "in/STRASSE.png"],
        ],
    )
    def test_what_a_system_does_not_tell_apart_is_told_apart(self, kind, targets):
        names, naming = outputs(targets, kind)
        assert len({folded(name) for name in names.values()}) == len(targets)
        assert naming.renamed >= 2
        backwards, _ = outputs(targets[::-1], kind)
        assert backwards == names  # whatever the order

    def test_references_too(self):
        rows = Pairs(["in/t.png", "in/u.png"], ["ref/X.png", "ref/x.png"])
        naming = Naming(rows, "transfer", TransferOptions())
        assert len({folded(naming.job(row).output) for row in rows}) == 4

    def test_folders_are_made_safe_part_by_part(self):
        names, naming = outputs(["in/aux/b?/c.png", "in/d.png"])
        folder, inner, last = names["in/aux/b?/c.png"].split("/")
        assert (folder, inner, last) == (portable("aux"), portable("b?"), "c.png")
        assert (names["in/d.png"], naming.renamed) == ("d.png", 1)

    def test_lights_whose_name_is_none_of_a_file(self):
        rows = [Row(1, "a.png", options=(("light", "-30,20:size=25"),)), Row(2, "a.png")]
        naming = Naming(rows, "transfer", TransferOptions(light="rim"))
        assert is_of_windows(naming.job(rows[0]).output)

    def test_the_column_output_stays_as_it_is_but_on_windows(self, monkeypatch):
        rows = [Row(1, "a.png", output="x/CON.png"), Row(2, "b.png", output="y.png")]
        naming = Naming(rows, "normalize", TransferOptions())
        assert naming.job(rows[0]).output == "x/CON.png"
        monkeypatch.setattr("relit.batch.naming._IS_WINDOWS", True)
        assert naming.job(rows[0]).startswith(
            "output: Windows cannot hold 'x/CON.png'; choose another, such as 'x/_CON~"
        )
        assert naming.job(rows[1]).output == "y.png"

    def test_a_run_tells_of_them_and_goes_on_by_the_same_names(self, place, run):
        (place / "in").mkdir()
        for name in ("CON.png", "new\nline.png", "A.png", "a.png", "plain.png", "x" * 251 + ".png"):
            shutil.copy(place / "target.png", place / "in" / name)
        done = run("batch --do landmarks --targets in -o out --json")
        assert done.code == 0
        assert json.loads(done.out)["renamed"] == 5
        assert done.err.strip().endswith("out/results.csv has both")
        assert done.err.count("\n") == 1
        names = {path.name for path in (place / "out").glob("*.json")} - {"run.json"}
        assert len(names) == 6
        assert "plain.json" in names
        assert all(map(is_of_windows, names))
        assert json.loads((place / "out" / "run.json").read_text())["renamed"] == 5
        again = json.loads(run("batch --do landmarks --targets in -o out --json").out)
        assert (again["kept"], again["ok"]) == (6, 0)
        assert run("batch --do landmarks --targets in -o out -q").err == ""


class TestLongPaths:
    @given(st.lists(st.text(st.sampled_from("abcé"), min_size=1, max_size=40), max_size=20), st.booleans())
    def test_windows_takes_them_for_the_same_place(self, parts, shared):
        root = r"\\server\share" if shared else "C:"
        plain = "\\".join([root, *parts, "x.png"])
        given = extended(plain)
        assert given == plain or given.startswith("\\\\?\\")
        assert len(plain) < 248 or given != plain
        back = given.removeprefix("\\\\?\\UNC\\") if shared else given.removeprefix("\\\\?\\")
        assert PureWindowsPath(("\\\\" if shared and given != plain else "") + back) == PureWindowsPath(plain)
        assert extended(given) == given

    def test_slashes_become_what_the_prefix_asks_for(self):
        assert "/" not in extended("C:/" + "deep/" * 60)

    @pytest.mark.skipif(os.name == "nt", reason="of POSIX")
    def test_as_long_as_the_system_takes_them(self, place, run):
        deep = place.joinpath(*["d" * 200] * 3)  # 600 and more, over Windows' 260
        deep.mkdir(parents=True)
        name = "n" * 250 + ".png"
        shutil.copy(place / "target.png", deep / name)
        asked = ("batch", "--do", "normalize", "--targets", deep / name, "-o", deep / "out")
        done = run(*asked)
        assert done.code == 1
        assert "SQLite takes paths of 503 bytes at most); choose another place with --journal\n" in done.err
        done = run(*asked, "--journal", "journal.sqlite")
        assert (done.code, done.err) == (0, "")
        assert (deep / "out" / name).exists()

    @pytest.mark.skipif(os.name == "nt", reason="of POSIX")
    def test_longer_ones_are_one_line(self, run):
        done = run("batch", "--do", "normalize", "--targets", "target.png", "-o", "/".join(["d" * 200] * 30))
        assert done.code == 1
        assert done.err.count("\n") == 1
        assert "File name too long" in done.err


def test_normal_forms_are_those_of_unicode():
    assert all(folded(unicodedata.normalize(form, "É")) == folded("é") for form in ("NFC", "NFD", "NFKD"))
