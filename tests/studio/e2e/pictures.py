"""Take the studio's pictures of the README: ``python -m tests.studio.e2e.pictures ADDRESS``.

The address is the one that ``relit studio --no-open`` tells.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

from PIL import Image

from tests.studio.e2e.page import BROWSER, WATCH, settled

DOCS = Path(__file__).parents[3] / "docs"
#: File → width and height of the window, its colours, and the part that is at its lower edge.
PICTURES = {
    "studio-phone.jpg": (360, 740, "dark", "#desk .ball"),
}
_STEP = 250  # ms that a frame of the recording is seen
_WIDE = 800  # px of the recording


def main(address: str) -> None:
    from playwright.sync_api import sync_playwright  # pytest imports this module for its doctests

    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=str(BROWSER), args=["--no-sandbox"])
        for name, (width, height, colors, lowest) in PICTURES.items():
            page = opened(browser, address, width, height, colors, 2)
            if lowest:
                page.locator(lowest).evaluate("one => one.scrollIntoView({ block: 'end' })")
            with Image.open(io.BytesIO(page.screenshot())) as seen:
                seen.convert("RGB").save(DOCS / name, quality=82, optimize=True)
        frames = [*story(opened(browser, address, 1280, 860, "light", 1))]
        frames[0].save(
            DOCS / "studio.webp", save_all=True, append_images=frames[1:], duration=_STEP, loop=0, quality=60
        )
        browser.close()


def opened(browser, address, width, height, colors, dense):
    """Return the page with the samples."""
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=colors, device_scale_factor=dense
    )
    context.add_init_script(WATCH)
    page = context.new_page()
    page.goto(address)
    page.click("#samples:enabled")
    page.wait_for_selector(".stage.filled")
    settled(page)
    page.mouse.move(0, 0)
    return page


def story(page):
    """Yield what is seen while a lamp is dragged over the face, and looks are chosen."""

    def now(times=1):
        settled(page)
        with Image.open(io.BytesIO(page.screenshot())) as seen:
            small = seen.convert("RGB").resize((_WIDE, round(seen.height * _WIDE / seen.width)))
        return [small] * times

    yield from now(4)
    page.click("[data-from=lamp]")
    yield from now(2)
    box = page.locator("#desk .ball button").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(12):
        page.mouse.move(x + 8 * k, y + 2 * abs(k - 6))
        yield from now()
    page.mouse.up()
    for look in ("Rembrandt", "Rim", "reference.jpg"):
        page.locator("#looks li", has_text=look).locator(".look").click()
        yield from now(3)
    page.get_by_role("button", name="Side by side").click()
    yield from now(5)


if __name__ == "__main__":
    main(*sys.argv[1:])
