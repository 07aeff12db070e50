"""What several tests share: parts of a corpus, the data beside the checkout, a face with known landmarks."""

import datetime as dt
import json
import os
import zlib
from pathlib import Path

import hypothesis
import numpy as np
import pytest

from tests.compiled import cache_folder

if "NUMBA_CACHE_DIR" not in os.environ:  # Processes that this one starts inherit it.
    os.environ["NUMBA_CACHE_DIR"] = cache_folder()

from relit.face.landmarks import Landmarks
from tests.command import fail, place, plain, run, studio, succeed  # noqa: F401 (fixtures)

# Machines are shared and noisy, so no deadline; and a change lands or not by what it does, not by a draw.
hypothesis.settings.register_profile("relit", deadline=None, derandomize="CI" in os.environ)
hypothesis.settings.load_profile("relit")


def pytest_addoption(parser):
    parser.addoption("--all", action="store_true", help="try every test, and the whole of every corpus")
    parser.addoption(
        "--part",
        type=int,
        default=dt.date.today().toordinal(),
        help="which part of every corpus, and of the rotating tests, to try; today's by default",
    )


def pytest_report_header(config):
    chosen = "--all" if config.getoption("all") else f"--part {config.getoption('part')}"
    return f"corpora and rotating tests: {chosen}"


def _belongs(name, part, parts):
    # By its name, so that a part has some of every kind.
    return zlib.crc32(name.encode()) % parts == part % parts


@pytest.fixture(scope="session")
def part_of(pytestconfig):
    """Return this run's part of a corpus, one of several that together are all of it; or all of it, by --all.

    Every day has another part, so a run can be repeated, and after as many days all have been tried.
    """

    whole, part = pytestconfig.getoption("all"), pytestconfig.getoption("part")

    def part_of(cases, parts, key=str):
        for case in cases:
            if whole or _belongs(key(case), part, parts):
                yield case

    return part_of


def _waits(item, part):
    """Return whether a test is a rotating one of another day."""
    marker = item.get_closest_marker("rotating")
    return marker and not _belongs(marker.args[0] if marker.args else item.nodeid, part, 4)


def pytest_collection_modifyitems(config, items):
    """Leave out the rotating tests of other days, unless by --all or where a file or a test is named.

    Where processes share the files, start with those that have slow tests, so that all end together.
    The browser's come last of these: what its server needs is compiled by then, and pages do not wait for it.
    """
    if not config.getoption("all") and all(Path(named).is_dir() for named in config.args):
        waiting = [item for item in items if _waits(item, config.getoption("part"))]
        config.hook.pytest_deselected(items=waiting)
        items[:] = [item for item in items if item not in waiting]
    if hasattr(config, "workerinput"):
        slow, browser = (
            {item.path for item in items if item.get_closest_marker(name)} for name in ("slow", "e2e")
        )
        items.sort(key=lambda item: (item.path not in slow, item.path in browser))


BROWSER = Path("/usr/bin/chromium")


@pytest.fixture(scope="session")
def browser():
    """One browser for all tests of a process: Playwright takes no second one."""
    playwright = pytest.importorskip("playwright.sync_api", reason="the browser tests need playwright")
    if not BROWSER.exists():
        pytest.skip(f"the browser tests need {BROWSER}")
    with playwright.sync_playwright() as started:
        opened = started.chromium.launch(
            executable_path=str(BROWSER),
            args=["--no-sandbox", "--disable-background-networking"],
            timeout=180_000,
        )
        yield opened
        opened.close()


SHARED = Path(__file__).parents[2] / "shared"


def _folder(name):
    folder = SHARED / name
    if not folder.is_dir():
        pytest.skip(f"{folder.name} data is not beside the checkout (../shared/{name})")
    return folder


@pytest.fixture(scope="session")
def yaleb():
    """The Yale B development set."""
    return _folder("yaleb")


@pytest.fixture(scope="session")
def heads():
    """The rendered heads."""
    return _folder("heads")


@pytest.fixture(scope="session")
def portraits():
    """The colour portraits."""
    return _folder("portraits")


@pytest.fixture(scope="session")
def lit_photos():
    """The photos with a light."""
    return _folder("lit")


@pytest.fixture(scope="session")
def yale_landmarks(yaleb):
    """Subject → (478, 3) mesh on the frontal image."""
    faces = json.loads((yaleb / "landmarks_frontal.json").read_text())
    return {subject: np.array(points["mesh478"]) for subject, points in faces.items()}


@pytest.fixture
def face_points():
    """iBUG-like landmarks of a schematic face, 68 points about 100 px wide, at (60, 60) of a 120 px image."""
    angle = np.linspace(np.pi, 2 * np.pi, 17)
    jaw = np.column_stack([60 + 45 * np.cos(angle), 55 - 50 * np.sin(angle)])
    brow = np.column_stack([np.linspace(-12, 12, 5), [-2.0, -5, -6, -5, -2]])
    bridge = np.column_stack([np.full(4, 60.0), [48.0, 55, 62, 68]])
    nostrils = np.column_stack([np.linspace(52, 68, 5), [72.0, 74, 75, 74, 72]])
    eye = np.array([[-8.0, 0], [-4, -3], [4, -3], [8, 0], [4, 3], [-4, 3]])
    around = np.linspace(np.pi, 3 * np.pi, 12, endpoint=False)
    mouth = np.column_stack([60 + 16 * np.cos(around), 88 + 6 * np.sin(around)])
    around = np.linspace(np.pi, 3 * np.pi, 8, endpoint=False)
    inner = np.column_stack([60 + 11 * np.cos(around), 88 + 2 * np.sin(around)])
    return np.vstack(
        [
            jaw,
            brow + np.array([40, 38]),
            brow + np.array([80, 38]),
            bridge,
            nostrils,
            eye + np.array([40, 50]),
            eye + np.array([80, 50]),
            mouth,
            inner,
        ]
    )


@pytest.fixture
def ball():
    """Landmarks all over the front of a ball, its true normals on 100 by 100 px, and where it is."""
    angle, radius = np.meshgrid(np.linspace(0, 2 * np.pi, 60, endpoint=False), np.linspace(0.02, 0.9, 25))
    x, y = (radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()
    points = np.column_stack([50 + 40 * x, 50 + 40 * y, -40 * np.sqrt(1 - x**2 - y**2)])
    gy, gx = (np.mgrid[:100, :100] - 50) / 40
    face = gx**2 + gy**2 < 0.8**2
    gz = -np.sqrt(np.maximum(1 - gx**2 - gy**2, 0))
    return Landmarks(points), np.dstack([gx, gy, gz]), face
