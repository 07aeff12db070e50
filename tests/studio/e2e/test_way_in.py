"""A page whose server asks for a token: the address has it, or the visitor gives it."""

import re
import subprocess
import sys

import pytest

from tests.studio.e2e.page import settled, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow]


@pytest.fixture(scope="module")
def told():
    """What a server for others says when it starts, up to its token; it listens on this machine alone."""
    command = [sys.executable, "-c", "from relit.cli.app import main; main()"]
    for_others = ["serve", "--page", "--port", "0", "--allow-host", "light.team"]
    with subprocess.Popen([*command, *for_others], stderr=subprocess.PIPE, text=True) as server:
        try:
            lines = []
            while "made for this run" not in "".join(lines):
                lines.append(server.stderr.readline())
                assert lines[-1], lines
            yield "".join(lines)
        finally:
            server.terminate()
            server.wait(120)


@pytest.fixture(scope="module")
def token(told):
    return re.search("made for this run: (.+)", told)[1]


def test_the_address_that_is_printed_lets_in(told, token, blank):
    address = re.search(r"the page: (\S+)", told)[1]
    page = blank()
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    page.wait_for_selector("#samples:enabled")
    assert page.url == address.partition("#")[0], "the token does not stay in the address"
    assert not any(token in url for url in asked), "nor does it go into a log"
    page.click("#samples")
    page.wait_for_selector(".stage.filled")
    until(page, "[...document.images].every((one) => !one.src || (one.complete && one.naturalWidth))")
    page.reload()
    page.wait_for_selector("#samples:enabled")
    assert not page.locator("#way-in").is_visible()


def test_who_comes_without_is_asked(told, token, blank):
    page = blank()
    page.goto(re.search(r"the page: ([^\s#]+)", told)[1])
    page.wait_for_selector("#way-in[open]")
    assert page.inner_text("#token-problem") == ""
    page.keyboard.press("Escape")
    page.fill("#token", "another-token-than-this")
    page.keyboard.press("Enter")
    page.locator("#token-problem", has_text="not the token").wait_for()
    page.fill("#token", token)
    page.click("#way-in button")
    page.wait_for_selector("#samples:enabled")
    assert not page.locator("#way-in").is_visible()


def test_on_this_machine_alone_nobody_is_asked(visit):
    page = visit()
    assert not page.locator("#way-in").is_visible()
    page.click("#samples")
    page.wait_for_selector(".stage.filled")
    settled(page)
