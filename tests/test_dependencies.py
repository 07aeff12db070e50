"""Every dependency has a row in CONTRIBUTING, which tells what it is for; and no row is without one."""

import re
import tomllib
from pathlib import Path

from check import FOR_DEVELOPERS, extras_for_users
from tools.licences import is_allowed

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
(SECTION,) = re.findall(
    r"^## What it depends on\n(.+?)^## ", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), re.M | re.S
)
TABLES = [
    [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]
    for table in re.findall(r"(?:^\|.+\n)+", SECTION, re.M)
]


def names(cells):
    return [name for cell in cells for name in re.findall(r"`(.+?)`", cell)]


def wanted(requirements):
    return [re.split(r"[<>=]", requirement)[0] for requirement in requirements]


def test_the_base_has_its_rows():
    rows = TABLES[0]
    assert sorted(names(row[0] for row in rows)) == sorted(wanted(PROJECT["dependencies"]))
    assert [row[0] for row in rows if not is_allowed(row[2])] == []
    total = int(re.search(r"takes (\d+) MB", SECTION)[1])
    own = int(re.search(r"relit's own (\d+)", SECTION)[1])
    assert abs(sum(int(row[1]) for row in rows) + own - total) < 10


def test_extras_have_theirs():
    rows = TABLES[1]
    told = sorted((*names(row[:1]), *names(row[1:2])) for row in rows)
    assert told == sorted((extra, name) for extra in extras_for_users() for name in wanted(EXTRAS[extra]))
    assert [row[1] for row in rows if not is_allowed(row[3])] == ["`pillow-heif`", "`av`"]


def test_what_developers_need_has_a_row():
    rows = TABLES[2]
    told = names(row[0] for row in rows)
    needed = {name for extra in FOR_DEVELOPERS for name in wanted(EXTRAS[extra])}
    users = {name for extra in extras_for_users() for name in wanted(EXTRAS[extra])} - {"scipy"}
    assert len(told) == len(set(told))
    assert set(told) == needed - users
    assert all(row[1] for row in rows)
