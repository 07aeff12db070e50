"""What the tests of the page do with it: wait, look where things are, ask the server what it holds."""

import base64
import re
from pathlib import Path

import numpy as np

BROWSER = Path("/usr/bin/chromium")
WAIT = 120_000  # ms
#: Looks, 10 ms apart, without a question to the server, or a planned one, after which the page has no more.
#: No time: where the page did not have its turn for long, what it has planned comes before another look.
QUIET = 15

#: Counts what the page waits for: answers and what is in them, files, pictures.
WATCH = """
    window.asked = { open: 0, ended: 0 };
    const watch = (owner, ...names) => names.forEach((name) => {
        const wait = owner[name];
        owner[name] = async function (...given) {
            asked.open += 1;
            try { return await wait.apply(this, given); }
            finally { asked.open -= 1; asked.ended += 1; }
        };
    });
    watch(window, "fetch");
    watch(Response.prototype, "arrayBuffer", "blob", "json", "text");
    watch(Blob.prototype, "arrayBuffer", "text");
    watch(HTMLImageElement.prototype, "decode");
"""

_QUIET = """async ([quiet, most]) => {
    const began = performance.now();
    for (let looks = 0, ended = asked.ended; looks < quiet; looks += 1) {
        if (performance.now() - began > most) throw new Error("The page never rests.");
        await new Promise((go) => setTimeout(go, 10));
        if (asked.open || asked.ended > ended || document.querySelector("[aria-busy=true]")) looks = -1;
        ended = asked.ended;
    }
}"""


def quiet(page):
    """Wait until the page has nothing more to ask the server."""
    page.evaluate(_QUIET, [QUIET, WAIT])


def until(page, condition):
    """Wait for what a script says; Playwright's own way needs what the page's security forbids."""
    for _ in range(WAIT // 20):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(20)
    raise AssertionError(f"never: {condition}")


def drawn(page):
    """Wait until what has changed is on the screen."""
    page.evaluate("() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))")


def settled(page):
    """Wait until the preview shows the newest state."""
    quiet(page)
    assert re.match("Done", page.inner_text("#status")), page.inner_text("#status")


def begin(page, *files):
    """Drop files on the fresh page, and wait until it shows what it makes of them."""
    drop(page, "#stage", *files)
    page.wait_for_selector(".stage.filled")
    settled(page)


def api(page, path, method="GET"):
    """Ask the server what it holds of this page's session; the status and the answer."""
    return page.evaluate(
        """async ([path, method]) => {
            const { session } = JSON.parse(sessionStorage.getItem("relit"));
            const answer = await fetch(`/api/v1/sessions/${session}${path}`, { method });
            const json = answer.headers.get("Content-Type")?.includes("json");
            return [answer.status, json ? await answer.json() : null];
        }""",
        [path, method],
    )


def points(page, role):
    return np.array(api(page, f"/landmarks/{role}")[1]["points"])[:, :2]


def on_screen(page, role, place):
    """Return where a pixel of the photo is seen, and how large it is there, by where the picture is."""
    box = page.locator(f".photo[data-role={role}] .frame img").bounding_box()
    scale = box["width"] / api(page, "")[1][role]["width"]
    return box["x"] + (place[0] + 0.5) * scale, box["y"] + (place[1] + 0.5) * scale, scale


def drag(page, x, y, right, down):
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right, y + down, steps=4)
    page.mouse.up()


def drop(page, selector, *files):
    """Drop files on a part of the page, as a file manager does."""
    carried = page.evaluate_handle(
        """(files) => {
            const carried = new DataTransfer();
            for (const [name, bytes] of files) {
                carried.items.add(new File([Uint8Array.from(atob(bytes), (one) => one.charCodeAt(0))], name));
            }
            return carried;
        }""",
        [[Path(file).name, base64.b64encode(Path(file).read_bytes()).decode()] for file in files],
    )
    for event in ("dragover", "drop"):
        page.dispatch_event(selector, event, {"dataTransfer": carried})


def touch(page, *steps):
    """Touch the screen: each step is where the fingers are; at the end all are lifted."""
    screen = page.context.new_cdp_session(page)
    before = 0
    for fingers in (*steps, ()):
        kind = "touchEnd" if not fingers else "touchStart" if len(fingers) > before else "touchMove"
        places = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(fingers)]
        screen.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})
        before = len(fingers)
    screen.detach()
