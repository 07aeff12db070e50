"""How long the studio's page takes to show what a hand does: server and browser together."""

from __future__ import annotations

import io
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from typing import Any

from PIL import Image

from benchmarks.measure import Timing
from benchmarks.rows import Row

_RELIT = "from relit.cli.app import main; main()"
_BROWSER = "/usr/bin/chromium"
_SIDE = 1280  # px of the photos, which a preview of 640 px halves
_NOSE = 4  # its tip, of the face mesh

#: Waits for the picture that what happens next leads to: resolves with the ms from its event to its frame.
_WATCH = """(event) => {
    const seen = document.querySelector('#viewer .main .after');
    window.took = new Promise((shown, failed) => {
        let start;
        setTimeout(() => failed(new Error(`no picture after ${event}`)), 20_000);
        addEventListener(event, () => (start ??= performance.now()), { capture: true });
        const watch = new MutationObserver(async () => {
            if (start === undefined) return;
            watch.disconnect();
            await seen.querySelector('img').decode();
            requestAnimationFrame(() => setTimeout(() => shown(performance.now() - start)));
        });
        watch.observe(seen, { childList: true, subtree: true, attributeFilter: ['src'] });
    });
}"""


def studio(runs: int) -> Iterator[Row]:
    """Move a lamp, λ and a landmark on the studio's page, in Chromium."""
    from playwright.sync_api import FilePayload, sync_playwright

    count = max(runs, 30)
    with _served() as address, sync_playwright() as started:
        browser = started.chromium.launch(executable_path=_BROWSER, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1000, "height": 2400})
        page.goto(address)
        page.wait_for_selector("#samples:enabled")
        for part in ("#fit", "#expert"):
            page.locator(part).evaluate("one => (one.open = true)")
        for role, name in (("target", "target.png"), ("reference", "reference.jpg")):
            photo = FilePayload(name=name, mimeType="image/jpeg", buffer=_enlarged(name))
            page.locator(f".photo[data-role={role}] input[type=file]").first.set_input_files(photo)
            page.locator(f".photo[data-role={role}] .facts:not(:empty)").wait_for()
        page.wait_for_selector("#stage.filled")
        both = ("λ moved", 0.15, _slide), ("point dragged", 0.25, _drag)
        moves = {"shading": (*both, ("lamp dragged", 0.15, _lamp)), "ltv": both}
        for method, acts in moves.items():
            page.select_option("#option-method", label=method)
            _rest(page)
            for what, target, act in acts:
                page.click(f"[data-from={'lamp' if act is _lamp else 'photo'}]")
                _rest(page)
                width = page.evaluate("document.querySelector('#viewer .main .after img').naturalWidth")
                seconds = act(page, count + 2)[2:]
                _rest(page)
                case = f"{method}: {what} {count} times; {width} px preview"
                yield Row("studio, hand to eye, 2 cores", case, Timing.of(seconds), None, f"≤ {target:.3f} s")
        browser.close()


def _slide(page: Any, count: int) -> list[float]:
    """Move the slider of λ so many times; return the seconds that each took to be seen."""
    seconds = []
    for k in range(count):
        page.evaluate(_WATCH, "input")
        page.evaluate(
            """(place) => {
                const slider = document.querySelector('#option-lam');
                slider.value = place;
                slider.dispatchEvent(new Event('input', { bubbles: true }));
            }""",
            str(20 + k),
        )
        seconds.append(page.evaluate("window.took") / 1000)
    return seconds


def _drag(page: Any, count: int) -> list[float]:
    """Drag the tip of the nose along so many places; return the seconds that each took to be seen."""
    photo = page.locator(".photo[data-role=target] .frame img")
    photo.scroll_into_view_if_needed()
    box = photo.bounding_box()
    x, y = page.evaluate(
        """async ([point, side]) => {
            const { session } = JSON.parse(sessionStorage.getItem('relit'));
            const answer = await fetch(`/api/v1/sessions/${session}/landmarks/target`);
            return (await answer.json()).points[point].slice(0, 2).map((at) => (at + 0.5) / side);
        }""",
        [_NOSE, _SIDE],
    )
    x, y = box["x"] + x * box["width"], box["y"] + y * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    seconds = []
    for k in range(count):
        page.evaluate(_WATCH, "pointermove")
        page.mouse.move(x + 4 * (k % 2) + 2, y + 0.2 * k)
        seconds.append(page.evaluate("window.took") / 1000)
    page.mouse.up()
    return seconds


def _lamp(page: Any, count: int) -> list[float]:
    """Drag the lamp along the ball to so many places; return the seconds that each took to be seen."""
    lamp = page.locator("#desk .ball button").first
    lamp.scroll_into_view_if_needed()
    box = lamp.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    seconds = []
    for k in range(count):
        page.evaluate(_WATCH, "pointermove")
        page.mouse.move(x + 2 * (k + 1), y + 3 * (k % 2))
        seconds.append(page.evaluate("window.took") / 1000)
    page.mouse.up()
    return seconds


def _rest(page: Any) -> None:
    """Wait for the fine picture that follows the quick ones."""
    page.wait_for_selector("#stage[aria-busy=false]")


def _enlarged(name: str) -> bytes:
    """Return a sample photo, its longest side of `_SIDE` px."""
    with (files("relit.photo") / "sample_photos" / name).open("rb") as file, Image.open(file) as photo:
        scale = _SIDE / max(photo.size)
        large = photo.convert("RGB").resize([round(length * scale) for length in photo.size])
    buffer = io.BytesIO()
    large.save(buffer, "JPEG", quality=95)
    return buffer.getvalue()


@contextmanager
def _served() -> Iterator[str]:
    """Run the studio, and tell its address."""
    command = [sys.executable, "-c", _RELIT, "studio", "--port", "0", "--no-open"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        try:
            said = server.stderr.readline() if server.stderr else ""
            found = re.search(r"http://\S+", said)
            assert found, said
            yield found[0]
        finally:
            server.terminate()
