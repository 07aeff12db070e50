"""One version, told alike everywhere; and a changelog of the form that it names."""

import datetime as dt
import re
import tomllib
from pathlib import Path

import pytest

from relit._version import VERSION

ROOT = Path(__file__).parents[1]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text("utf-8")
KINDS = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
SECTIONS = re.split(r"^## ", CHANGELOG, flags=re.M)[1:]
RELEASES = [re.match(r"\[(\d+)\.(\d+)\.(\d+)\] - (\d{4}-\d\d-\d\d)\n", text) for text in SECTIONS[1:]]


def test_it_is_written_down_once():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    assert "version" not in project["project"]
    assert project["project"]["dynamic"] == ["version"]
    assert project["tool"]["hatch"]["version"]["path"] == "src/relit/_version.py"


def test_the_citation_is_of_the_last_release():
    told = dict(re.findall(r"^([\w-]+): (.+)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.M))
    assert told["version"] == VERSION == ".".join(RELEASES[0].groups()[:3])
    assert told["date-released"] == RELEASES[0][4]


def test_the_api_tells_it():
    testclient = pytest.importorskip("fastapi.testclient")
    from relit.studio.app import create_app

    with testclient.TestClient(create_app(), base_url="http://localhost") as client:
        assert client.get("/api/v1/options").json()["version"] == VERSION
        assert client.get("/api/v1/openapi.json").json()["info"]["version"] == VERSION


def test_docs_tell_no_other():
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")):
        told = re.findall(r"\brelit(?:==| |-|:)v?(\d+\.\d+\.\d+)", page.read_text("utf-8"))
        assert set(told) <= {VERSION}, page


def test_the_changelog_keeps_its_form():
    assert SECTIONS[0].startswith("[Unreleased]\n")
    assert all(RELEASES), "a release is ## [1.2.3] - 2026-01-31"
    numbers = [tuple(map(int, release.groups()[:3])) for release in RELEASES]
    dates = [dt.date.fromisoformat(release[4]) for release in RELEASES]
    assert (numbers, dates) == (sorted(numbers, reverse=True), sorted(dates, reverse=True))
    for section in SECTIONS:
        kinds = re.findall(r"^### (.+)$", section, re.M)
        assert kinds == sorted(set(kinds), key=KINDS.index)
        entries = re.findall(r"^- (?:.+\n(?:  .+\n)*)", section, re.M)
        assert len(entries) == len(set(entries)), "an entry stands there twice"
