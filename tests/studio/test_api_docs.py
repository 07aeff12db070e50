"""docs/api.md is true: its program runs, and its tables and figures are those of the server."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.load import BOUND, LIMITS
from relit import studio
from relit.photo.reading import read_image
from relit.photo.samples import copy_samples
from relit.relighting import transfer
from relit.studio.app import create_app
from relit.studio.intake import LEAST_RATE, PATIENCE, SMALL_BYTES
from relit.studio.limits import SHARE, Limits
from relit.studio.sessions import EXPIRES
from tests.served import served

TEXT = (Path(__file__).parents[2] / "docs" / "api.md").read_text("utf-8")
API = "http://127.0.0.1:8765/api/v1"


def block(language, word):
    """Return the one code block that has a word in it."""
    (found,) = (code for code in re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL) if word in code)
    assert API in found
    return found


@pytest.fixture
def client(tmp_path, monkeypatch):
    """A server, with the samples where the document has them."""
    monkeypatch.chdir(tmp_path)
    copy_samples(tmp_path / "photos")
    with served(create_app()) as client:
        yield client


def test_the_program_makes_what_the_library_makes(client, tmp_path):
    code = block("python", "import httpx").replace(API, f"{client.base_url}api/v1")
    names = {}
    exec(code, names)
    names["api"].close()
    photos = [read_image(tmp_path / "photos" / name) for name in ("target.png", "reference.jpg")]
    expected = transfer(*photos, strength=0.8, shadows=0.7).image
    np.testing.assert_array_equal(read_image(tmp_path / "relit.png").pixels, expected)
    with Image.open(tmp_path / "preview.jpg") as preview:
        assert preview.format == "JPEG"
        assert max(preview.size) <= 640


@pytest.mark.skipif(not shutil.which("curl"), reason="curl is not installed")
def test_curl_does_the_same(client, tmp_path):
    code = block("sh", "curl").replace(API, f"{client.base_url}api/v1")
    subprocess.run(["sh", "-ec", code], check=True, timeout=600)
    with Image.open(tmp_path / "preview.jpg") as preview:
        assert preview.format == "JPEG"


def test_every_place_is_in_the_table(client):
    paths = client.get("/api/v1/openapi.json").json()["paths"]
    there = {
        f"{method.upper()} {path.removeprefix('/api/v1')}"
        for path, methods in paths.items()
        for method in methods
    }
    assert set(re.findall(r"^\| `([A-Z]+ /\S+)` \|", TEXT, re.MULTILINE)) == there


def test_every_kind_of_failure_is_in_the_table():
    source = "".join(path.read_text("utf-8") for path in Path(*studio.__path__).glob("*.py"))
    made = set(re.findall(r'\b(?:4\d\d|503)[,:]\s+"([a-z_]+)"', source))
    told = set(re.findall(r"`([a-z_]+)`", TEXT.partition("| status |")[2].partition("##")[0]))
    assert made == told - {"code"}


def test_the_failure_shown_is_the_one_made(client):
    session = client.post("/api/v1/sessions").json()["session"]
    answer = client.post(f"/api/v1/sessions/{session}/render", json={"options": {"strength": 9}})
    assert answer.text.replace('":"', '": "').replace('":{', '": {').replace('","', '", "') in TEXT


def test_limits_are_the_servers():
    assert (Limits.workers, SHARE) == (2, 0.75)
    text = " ".join(TEXT.split())
    for said in (
        f"at most {Limits.bytes / 1e6:.0f} MB and {Limits.pixels / 1e6:.0f} million px",
        f"any other body {SMALL_BYTES / 1e6} MB",
        f"at most {2 * Limits.bytes / 1e6:.0f} MB over all clients",
        f"half of that of one. A body has {Limits.body_seconds} s",
        f"each {LEAST_RATE / 1e3:.0f} kB",
        f"stopped coming for {PATIENCE} s",
        f"At most {Limits.sessions} sessions, {Limits.sessions_per_client} of them a client's",
        f"idle for {EXPIRES} s",
        f"idle for {Limits.live_seconds} s",
        f"all sessions hold at most {Limits.memory / 1e6:.0f} MB, a client's photos three quarters",
        f"{Limits.queue} may wait, {Limits.queue_per_session} of each session",
        f"wait for {Limits.compute_seconds} s and then take {Limits.compute_seconds} s",
        f"all together take at most {Limits.working_memory / 1e6:.0f} MB",
        f"photos {LIMITS.memory / 1e6:.0f} MB and computations {LIMITS.working_memory / 1e6:.0f} MB",
        f"holds the server to {BOUND} MB",
    ):
        assert said in text, said


def test_the_commands_are_known():
    from relit.cli.serve import serve

    known = {flag for option in serve.params for flag in option.opts}
    proxy = (Path(__file__).parents[2] / "docs" / "nginx.conf").read_text("utf-8")
    lines = re.findall(r"^(?:#   )?(?:RELIT_TOKEN=\S+ )?(relit serve.*)$", TEXT + proxy, re.MULTILINE)
    assert len(lines) == 4
    for line in lines:
        flags = {word for word in shlex.split(line, comments=True) if word.startswith("--")}
        assert flags <= known, line
