"""One server and one browser for all tests of the page, and small photos to be quick with."""

import re
import subprocess
import sys

import httpx
import pytest
from PIL import Image

from relit.photo.samples import sample
from relit.studio.guard import HEADERS
from tests.studio.e2e.page import WAIT, WATCH, quiet, settled


@pytest.fixture(scope="session")
def address():
    """Start the studio as its command does, on any port that is free."""
    command = [sys.executable, "-c", "from relit.cli.app import main; main()"]
    with subprocess.Popen(
        [*command, "studio", "--port", "0", "--no-open"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as server:
        try:
            line = server.stdout.readline()
            found = re.search(r"http://\S+", line)
            assert found, line
            yield found[0]
        finally:
            server.terminate()
            server.wait(120)


@pytest.fixture(scope="session")
def photos(tmp_path_factory):
    """The files of two small photos with a face each, the target's and the reference's."""
    folder = tmp_path_factory.mktemp("photos")
    files = []
    for role, suffix, box, size in (
        ("target", "png", (150, 40, 300, 210), (150, 170)),
        ("reference", "jpg", (230, 130, 630, 650), (160, 208)),
    ):
        files.append(folder / f"{role}.{suffix}")
        with Image.open(sample(role)) as photo:
            photo.convert("RGB").crop(box).resize(size).save(files[-1])
    return files


@pytest.fixture
def blank(browser):
    """Open an empty page; what a page says on the console at the end must be nothing bad."""
    contexts, complaints = [], []

    def open_page(**settings):
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 800}, **settings})
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text) if refused(said) else None)
        page.on("dialog", lambda dialog: complaints.append(f"a dialog: {dialog.message}"))
        return page

    def refused(said):
        # A browser reports every answer of 4xx and 503; those are the server's, and shown in the page.
        return said.type == "error" and not re.search(r"responded with a status of (4|503)", said.text)

    yield open_page
    for context in contexts:
        context.close()
    assert complaints == []


@pytest.fixture
def visit(blank, address):
    """Open the page as a new visitor, high enough for the photos and landmarks below, which `fit` opens."""

    def open_page(session="", *, fit=True, **settings):
        page = blank(**{"viewport": {"width": 1280, "height": 2400 if fit else 800}, **settings})
        page.add_init_script(WATCH)
        page.goto(f"{address}#{session}")
        page.wait_for_selector("#samples:enabled")
        if fit:
            page.locator("#fit").evaluate("one => (one.open = true)")
        return page

    return open_page


@pytest.fixture
def mount(blank, address):
    """Open a page that holds one element, as safe as the studio's, and give it to a module of that."""

    def open_page(module, made, width=400, height=400, **settings):
        page = blank(**settings)
        styles = "".join(
            f'<link rel="stylesheet" href="/static/{name}.css">' for name in ("style", "viewer", "ball")
        )
        body = f"<!doctype html><html lang=en><title>One</title>{styles}<main><div id=one></div></main>"
        page.route(
            f"{address}one", lambda route: route.fulfill(body=body, content_type="text/html", headers=HEADERS)
        )
        page.goto(f"{address}one")
        page.evaluate(
            """async ([module, made, width, height]) => {
                document.querySelector("main").style.display = "block";
                const root = document.querySelector("#one");
                Object.assign(root.style, { width: `${width}px`, height: `${height}px` });
                window.one = new (await import(`/static/${module}.js`))[made](root);
            }""",
            [module, made, width, height],
        )
        return page

    return open_page


@pytest.fixture(scope="session")
def sat(address, photos):
    """A session on the server with the two photos, and a way to have its landmarks found anew at once."""
    with httpx.Client(base_url=f"{address}api/v1", timeout=300) as client:
        token = client.post("/sessions").json()["session"]
        found = {}
        for role, file in zip(("target", "reference"), photos, strict=True):
            answer = client.put(f"/sessions/{token}/photos/{role}", content=file.read_bytes()).json()
            found[role] = {name: answer["landmarks"][name] for name in ("scheme", "points")}

        def restore():
            for role, marks in found.items():
                client.put(f"/sessions/{token}/landmarks/{role}", json=marks).raise_for_status()
            return token

        yield restore


@pytest.fixture
def sitting(visit, sat):
    """The page with two photos and their preview."""
    page = visit(sat())
    page.wait_for_selector(".stage.filled")
    settled(page)
    return page


@pytest.fixture
def editing(visit, sat):
    """The page with two photos, where nobody looks at the preview: it is said to be overtaken."""
    page = visit(sat(), has_touch=True)
    page.route("**/render", lambda route: route.fulfill(status=409, json={"error": {"code": "stale"}}))
    page.wait_for_selector(".photo[data-role=reference].filled")
    quiet(page)
    return page
