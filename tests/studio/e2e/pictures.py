"""Take the studio's pictures of the README: ``python -m tests.studio.e2e.pictures ADDRESS``.

The address is the one that ``relit studio --no-open`` tells.
"""

import io
import sys
from pathlib import Path

from PIL import Image

from tests.studio.e2e.page import BROWSER, WATCH, settled

DOCS = Path(__file__).parents[2] / "docs"
#: File → width and height of the window, its colours, and the part that is at its lower edge.
PICTURES = {
    "studio.jpg": (1280, 800, "light", None),
    "studio-phone.jpg": (360, 740, "dark", "#option-exposure"),
}


def main(address: str) -> None:
    from playwright.sync_api import sync_playwright  # pytest imports this module for its doctests

    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=str(BROWSER), args=["--no-sandbox"])
        for name, (width, height, colors, lowest) in PICTURES.items():
            context = browser.new_context(
                viewport={"width": width, "height": height}, color_scheme=colors, device_scale_factor=2
            )
            context.add_init_script(WATCH)
            page = context.new_page()
            page.goto(address)
            page.click("#samples:enabled")
            page.wait_for_selector(".stage.filled")
            settled(page)
            page.mouse.move(0, 0)
            if lowest:
                page.locator(lowest).evaluate("one => one.closest('.field').scrollIntoView({ block: 'end' })")
            with Image.open(io.BytesIO(page.screenshot())) as seen:
                seen.convert("RGB").reduce(1 if lowest else 2).save(DOCS / name, quality=82, optimize=True)
        browser.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
