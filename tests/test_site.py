"""The docs site: it is built strictly, no link of it is dead, it fetches nothing, and all can read it."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urljoin, urlsplit

import pytest

import relit
from relit.cli.app import relit as command_line
from tests.web import web

ROOT = Path(__file__).parents[1]
#: Attributes by which a page has a browser fetch something, at once or when it is pressed.
FETCHING = {"src", "srcset", "data", "poster", "action"}
#: Its links are absolute, since it is shown at any address.
ERROR_PAGE = "404.html"


class Page(HTMLParser):
    """What a page links to and fetches, and where links may lead to in it."""

    def __init__(self, path):
        super().__init__()
        self.links, self.fetched, self.anchors, self.images = [], [], {""}, []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, pairs):
        told = dict(pairs)
        self.anchors |= {told[name] for name in ("id", "name") if told.get(name)}
        self.fetched += [told[name] for name in FETCHING if told.get(name)]
        if tag == "link" and told.get("rel") not in ("prev", "next", "canonical"):
            self.fetched.append(told["href"])
        elif "href" in told:
            self.links.append(told["href"])
        if tag == "img":
            self.images.append(told)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site, which fails on a warning."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", folder],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html") if path.name != ERROR_PAGE}


pytestmark = pytest.mark.slow


def test_every_page_of_the_docs_is_on_it(site, pages):
    docs = {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    assert docs <= {path.relative_to(site) for path in pages}


def test_no_link_is_dead(site, pages):
    dead = []
    for path, page in pages.items():
        for link in page.links + page.fetched:
            if urlsplit(link).scheme:
                continue
            address, anchor = urldefrag(urljoin(path.as_uri(), link))
            target = Path(unquote(urlsplit(address).path))
            if not target.is_file() or not target.is_relative_to(site):
                dead.append(f"{path.name}: {link}: no such file")
            elif target in pages and unquote(anchor) not in pages[target].anchors:
                dead.append(f"{path.name}: {link}: no such place")
    assert not dead, "\n".join(dead)


def test_nothing_comes_from_elsewhere(site, pages):
    for path, page in pages.items():
        assert [one for one in page.fetched if urlsplit(one).scheme or one.startswith("//")] == [], path
    for style in site.rglob("*.css"):
        assert not re.findall(r"(?:url\(|@import )[\"']?(?:https?:|//)", style.read_text("utf-8")), style


def test_every_picture_has_a_text(pages):
    assert [
        (path.name, one["src"]) for path, page in pages.items() for one in page.images if not one["alt"]
    ] == []


def test_equations_are_mathml(site, pages):
    for path in pages:
        text = path.read_text("utf-8")
        assert "arithmatex" not in text, path
        assert "$$" not in text, f"{path}: an equation stands in no paragraph of its own"
        # A backslash would be a word of LaTeX that has not been understood.
        assert not [
            one for one in re.findall(r"<math.*?</math>", text) if "\\" in re.sub("<.*?>", "", one)
        ], path
    for name, least in (("ltv", 5), ("shading", 4)):
        assert (site / f"{name}.html").read_text("utf-8").count('display="block"') >= least


def test_every_public_name_is_documented(site):
    text = {path.stem: path.read_text("utf-8") for path in (site / "api").glob("*.html")}
    for name in relit.__all__:
        thing = f'id="relit.{relit._HOME[name]}.{name}"'
        (page,) = (body for body in text.values() if thing in body)
        # What begins with its docstring's first words has more than a signature.
        first = getattr(relit, name).__doc__.split(".")[0].split("`")[0].split("\n")[0]
        assert first[:20] in page, name


def test_every_command_is_told(site):
    text = (site / "commands.html").read_text("utf-8")
    for name, command in command_line.commands.items():
        section = text[text.index(f'id="relit-{name}"') :]
        for option in command.params:
            assert all(flag in section for flag in option.opts if flag.startswith("--")), (name, option.name)


@pytest.fixture
def visit(browser):
    """Open a page of its own; give it, what it asks for, and what it complains of."""
    contexts = []

    def visit(width=1280, scheme="light"):
        context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=scheme)
        contexts.append(context)
        context.set_default_timeout(120_000)
        page = context.new_page()
        asked, complaints = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
        return page, asked, complaints

    yield visit
    for context in contexts:
        context.close()


@pytest.mark.e2e
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (360, "dark")])
def test_pages_read_well_and_ask_nobody(visit, pages, width, scheme):
    page, asked, complaints = visit(width, scheme)
    for path in pages:
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width, path.name
        shown = page.evaluate("document.body.dataset.mdColorScheme")
        assert shown == {"light": "default", "dark": "slate"}[scheme]
    assert len(asked) > 5 * len(pages)
    assert {urlsplit(one).scheme for one in asked} <= {"file", "data", "blob"}
    assert complaints == []


@pytest.mark.e2e
def test_a_slider_moves_by_hand_and_by_keys(visit, site):
    page, _, _ = visit()
    page.goto((site / "gallery.html").as_uri())
    slider = page.locator("before-after").first
    place = slider.bounding_box()
    edge = lambda: slider.locator(".edge").bounding_box()["x"] + 1 - place["x"]  # noqa: E731
    assert edge() == pytest.approx(place["width"] / 2, abs=2)
    page.mouse.click(place["x"] + 0.2 * place["width"], place["y"] + 100)
    assert edge() == pytest.approx(0.2 * place["width"], abs=0.05 * place["width"])
    before = edge()
    page.keyboard.press("ArrowRight")
    assert edge() == pytest.approx(before + place["width"] / 100, abs=1)
    ranges = page.get_by_role("slider")
    assert ranges.count() == page.locator("before-after").count() >= 12
    assert "Rembrandt" in ranges.first.get_attribute("aria-label")


@pytest.mark.e2e
def test_without_scripts_both_pictures_stand_side_by_side(browser, site):
    context = browser.new_context(java_script_enabled=False)
    context.set_default_timeout(120_000)
    page = context.new_page()
    page.goto((site / "index.html").as_uri())
    left, right = (one.bounding_box() for one in page.locator("before-after").first.locator("img").all())
    assert left["y"] == right["y"]
    assert left["x"] + left["width"] <= right["x"]
    context.close()


@pytest.mark.e2e
@pytest.mark.parametrize("how", ["as files", "from a server"])
def test_search_finds_a_page_without_asking_anybody(visit, site, how):
    with web(site) as address:
        page, asked, complaints = visit()
        page.goto((site / "index.html").as_uri() if how == "as files" else f"{address}/index.html")
        page.locator("[data-md-component=search-query]").click()
        page.keyboard.type("certificate minimiser")
        page.locator(".md-search-result__link").first.wait_for()
        found = page.locator(".md-search-result__link").evaluate_all(
            "links => links.map(one => one.pathname)"
        )
        assert {Path(one).name for one in found} & {"solver.html", "ltv.html"}
        assert all(
            urlsplit(one).scheme in ("file", "blob", "data") or one.startswith(address) for one in asked
        )
        assert complaints == []


@pytest.mark.e2e
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (360, "dark")])
def test_axe_finds_nothing_in_what_is_ours(visit, site, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page, _, _ = visit(width, scheme)
    ours = {
        "include": [[".md-content"]],
        "exclude": [[".md-code__nav"]],
    }  # the theme's buttons to copy have no name
    for name in ("index", "gallery", "shading", "command-line", "how-good", "api/transfer"):
        page.goto((site / f"{name}.html").as_uri())
        found = axe.Axe().run(page, context=ours)
        assert found.violations_count == 0, f"{name}: {found.generate_report()}"
