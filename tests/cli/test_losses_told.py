"""What a file cannot keep of a photo's metadata is said in one line."""

import json

import pytest

from relit.photo.photo import Metadata, Photo, Text
from relit.photo.writing import write_image
from tests.batch.runs import table
from tests.command import FACES

IPTC = b"\x1c\x02\x50\0\3Ann"
JOB = f"transfer told.png reference.png {FACES}"


@pytest.fixture
def told(studio, place):
    """A target with IPTC and a title."""
    metadata = Metadata(iptc=IPTC, text=(Text("Title", "light\x1b[2J"),))
    write_image(place / "told.png", Photo(studio.target, metadata=metadata))


@pytest.mark.usefixtures("told")
class TestTransfer:
    def test_it_is_named(self, run):
        done = run(f"{JOB} -o out.webp")
        assert (done.code, done.err) == (
            0,
            "relit: warning: out.webp: does not keep text (Title), IPTC\n",
        )
        done = run(f"{JOB} -o out.psd --json")
        assert done.err == "relit: warning: out.psd: does not keep text (Title)\n"
        assert json.loads(done.out)["not_kept"] == ["text (Title)"]

    def test_nothing_is_said_where_nothing_is_lost(self, succeed):
        succeed(f"{JOB} -o out.png")
        succeed(f"{JOB} -o out.ora")

    def test_nothing_is_said_where_nothing_is_asked(self, run):
        assert run(f"{JOB} -o out.webp -q").err == ""


@pytest.mark.usefixtures("told")
def test_batch_says_how_many_and_the_table_says_what(run):
    job = "batch --targets told.png --light loop -o out --format webp --engine local --jobs 1"
    said = "1 file does not keep all of the metadata; out/results.csv says what, in not_kept"
    assert run(job).err == f"relit: warning: {said}\n"
    (row,) = table()
    assert row["not_kept"] == "text (Title), IPTC"
    assert run(job).err == "", "it was done before"
    assert table() == [row]
