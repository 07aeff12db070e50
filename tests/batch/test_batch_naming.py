"""Names of results: below the folder, no two alike, and what clashes is told before anything starts."""

import os
from pathlib import Path, PurePosixPath

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relit.batch.clashes import check_names, is_below
from relit.batch.jobs import Job, Row
from relit.batch.naming import Naming
from relit.batch.pairing import Pairs
from relit.errors import OptionError
from relit.settings.options import TransferOptions

KINDS = ("transfer", "normalize", "decompose", "landmarks")
PARTS = st.sampled_from(
    ["a", "b", "A", "é", "e\u0301", "..", ".", ".relit", "a.png", "b.JPG", "-", "a__b", "ß"]
)
PATHS = st.builds(
    lambda root, parts, end: root + "/".join([*parts, end]),
    st.sampled_from(["", "/", "/x/", "../", "s3://faces/"]),
    st.lists(PARTS, max_size=3),
    PARTS,
)


def lit(row):
    """Return a row with a light, if it has no reference: without either it would be no job."""
    return row if row.reference or row.options else row._replace(options=(("light", "rim"),))


def jobs_of(rows, kind="transfer", suffix=None, **options):
    if kind == "transfer" and "light" not in options:
        rows = [lit(row) for row in rows]
    naming = Naming(rows, kind, TransferOptions(**options), suffix)
    return [naming.job(row) for row in rows]


def names(rows, kind="transfer", suffix=None):
    return [job.output for job in jobs_of(rows, kind, suffix)]


def clash(rows, kind="transfer", folder="out", reserved=(), suffix=None):
    with pytest.raises(OptionError) as error:
        check_names(zip(rows, jobs_of(rows, kind, suffix), strict=True), kind, folder, reserved)
    return str(error.value)


class TestNames:
    @given(
        st.lists(st.tuples(PATHS, st.none() | PATHS, st.none() | PATHS), min_size=1, max_size=6),
        st.sampled_from(KINDS),
    )
    @settings(max_examples=300, deadline=None)
    def test_they_stay_below_the_folder_and_differ_or_are_refused(self, given_rows, kind):
        rows = [Row(n, target, light, output) for n, (target, light, output) in enumerate(given_rows, 1)]
        jobs = jobs_of(rows, kind)
        files = []
        for job in jobs:
            if isinstance(job, str):
                assert job
                continue
            for file in job.files(kind):
                whole = Path(os.path.normpath(Path("/data/out", file)))
                assert whole.is_relative_to("/data/out")
                assert whole != Path("/data/out")
                assert ".relit" not in PurePosixPath(file).parts[:1]
                files.append(str(whole))
        try:
            check_names(zip(rows, jobs, strict=True), kind, "/data/out", ())
        except OptionError:
            return
        assert len({file.casefold() for file in files}) == len(files)
        assert not any(Path(one) in Path(other).parents for one in files for other in files)

    @given(
        st.lists(st.tuples(st.sampled_from("pqr"), st.sampled_from(["x.png", "x.jpg", "y.bmp", "x.heic"])))
    )
    def test_a_mirrored_tree_has_as_many_files_as_there_are_targets(self, photos):
        targets = [f"in/{folder}/{name}" for folder, name in dict.fromkeys(photos)]
        rows = [Row(n, target) for n, target in enumerate(targets, 1)]
        for kind in KINDS:
            if kind == "transfer":
                rows = [row._replace(reference="light.png") for row in rows]
            assert len({name.casefold() for name in names(rows, kind)}) == len(targets)

    def test_the_tree_is_mirrored(self):
        rows = [
            Row(1, "/in/x/a.png", "r.png"),
            Row(2, "/in/y/z/b.JPG", "r.png"),
            Row(3, "/in/c.heic", "r.png"),
        ]
        assert names(rows) == ["x/a.png", "y/z/b.JPG", "c.png"]
        assert names(rows, suffix=".tif") == ["x/a.tif", "y/z/b.tif", "c.tif"]
        assert names(rows, "landmarks") == ["x/a.json", "y/z/b.json", "c.json"]
        assert names(rows, "decompose") == ["x/a", "y/z/b", "c"]
        assert names([Row(1, "s3://faces/a/b.png"), Row(2, "s3://faces/c.png")]) == ["a/b.png", "c.png"]

    def test_a_target_of_several_references_is_told_apart_by_them(self):
        targets, references = ["in/a.png", "in/a.jpg"], ["l/1/x.png", "l/2/x.png", "l/2/y.png"]
        assert names(list(Pairs(targets, references))) == [
            *("a__1-x.png.png", "a__2-x.png.png", "a__y.png"),
            *("a__1-x.png.jpg", "a__2-x.png.jpg", "a__y.jpg"),
        ]
        lights = [Row(1, "a.png", options=(("light", "rim"),)), Row(2, "a.png")]
        assert [job.output for job in jobs_of(lights, light="flat")] == ["a__rim.png", "a__flat.png"]

    def test_targets_that_differ_in_their_suffix_alone_keep_it(self):
        rows = [Row(1, "in/a.png"), Row(2, "in/a.jpg"), Row(3, "in/b.jpg")]
        assert names(rows, "landmarks") == ["a.png.json", "a.jpg.json", "b.json"]
        assert names(rows, "decompose") == ["a.png", "a.jpg", "b"]

    @pytest.mark.parametrize(
        "output", ["../x.png", "a/../../x.png", "/x.png", "s3://b/x.png", "", "./", ".relit/x"]
    )
    def test_an_output_that_leaves_the_folder_fails(self, output):
        (job,) = jobs_of([Row(1, "a/..", output=output or "..")])
        assert job.startswith("output: expected ")

    def test_a_bad_option_fails(self):
        bad, good = jobs_of(
            [Row(1, "a", options=(("strength", "x"),)), Row(2, "b", options=(("lam", 1), ("light", "rim")))]
        )
        assert "strength: expected" in bad
        assert isinstance(good, Job)
        assert good.options == TransferOptions(lam=1, light="rim")

    def test_references_count_only_where_light_is_carried(self):
        (job,) = jobs_of([Row(1, "a.png", "b.png", reference_landmarks="b.csv")], "normalize")
        assert job.inputs == ("a.png",)


class TestClashes:
    @pytest.mark.parametrize(
        ("one", "other"),
        [("x.png", "x.png"), ("x.png", "X.PNG"), ("\u00e9.png", "e\u0301.png"), ("a/ß", "a/SS")],
    )
    def test_two_rows_of_one_name(self, one, other):
        rows = [
            Row(1, "a.png", output="first.png"),
            Row(2, "b.png", output=one),
            Row(3, "c.png", output=other),
        ]
        told = clash(rows)
        assert "row 2 writes it and row 3 writes it; choose other names" in told
        assert one in told or other in told

    def test_a_name_that_is_an_input(self, tmp_path):
        (tmp_path / "link").symlink_to(tmp_path)
        for folder in (tmp_path, tmp_path / "link"):
            told = clash([Row(1, f"{tmp_path}/a.png"), Row(2, f"{tmp_path}/b.png")], folder=str(folder))
            assert "a.png: row 1 reads it and row 1 writes it; b.png: row 2 reads it and row 2 writes" in told
        rows = [Row(1, "in/a.png", "out/a.png")]
        assert "a.png: row 1 reads it and row 1 writes it" in clash(rows)

    def test_a_name_that_the_run_needs(self):
        told = clash([Row(1, "in/run.png")], "landmarks", reserved=["out/run.json"])
        assert "run.json: the run itself writes it and row 1 writes it" in told

    def test_a_file_where_a_folder_must_be(self):
        told = clash([Row(1, "a.png", output="x"), Row(2, "b.png", output="x/y.png")])
        assert "x: row 1 writes it and row 2 writes below it" in told

    def test_only_some_are_named(self):
        rows = [Row(n, f"{n}.png", output=f"{n % 9}.png") for n in range(1, 100)]
        told = clash(rows)
        assert told.count("row ") == 15
        assert "; and 4 more; " in told

    def test_the_same_target_twice(self):
        assert "a__x.png: row 1 writes it and row 2 writes it" in clash(
            [Row(1, "a.png", "x.png")] * 1 + [Row(2, "a.png", "x.png", options=(("strength", 0.5),))]
        )

    def test_what_is_below(self, tmp_path):
        (tmp_path / "link").symlink_to(tmp_path / "out")
        assert is_below(f"{tmp_path}/out/a.png", f"{tmp_path}/link")
        assert not is_below(f"{tmp_path}/outer/a.png", f"{tmp_path}/out")
        assert is_below("s3://a/b/c", "s3://a/b/")
