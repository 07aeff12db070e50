"""The large picture: zoom and pan, comparison, histogram and clipping, and the ways out of the page."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from tests.studio.e2e.page import drag, drawn, touch, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]

WIDTH, HEIGHT = 1200, 900  # px of the photo


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode()


def scene(seed, ends=0.0):
    """Return a smooth picture with noise; a share of its pixels is black, and as many are white."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:HEIGHT:4, :WIDTH:4] / 1200
    pixels = 60 + 120 * np.stack([x, y, 1 - x], -1) + rng.normal(0, 5, (*x.shape, 3))
    pixels = np.clip(pixels, 1, 254).round().astype(np.uint8)
    flat = pixels.reshape(-1, 3)
    some = rng.permutation(len(flat))[: 2 * int(ends * len(flat))]
    flat[some[::2]], flat[some[1::2]] = 0, 255
    return pixels


def put(page, method, pixels, *more):
    page.evaluate(
        """async ([method, bytes, more]) => {
            const blob = new Blob([Uint8Array.from(atob(bytes), (one) => one.charCodeAt(0))]);
            await one[method](blob, ...more);
        }""",
        [method, png(pixels), list(more)],
    )


def before(page, pixels):
    put(page, "photo", pixels, {"width": WIDTH, "height": HEIGHT})


@pytest.fixture
def viewer(mount):
    """Open a viewer with a light photo before and a dark one after."""

    def open_viewer(mode="after", shades=(200, 80), width=640, **settings):
        page = mount("viewer", "Viewer", width, 620, **settings)
        page.evaluate("window.said = []; one.addEventListener('change', () => said.push(one.side))")
        before(page, np.full((90, 120, 3), shades[0], np.uint8))
        put(page, "show", np.full((180, 240, 3), shades[1], np.uint8))
        page.evaluate("(mode) => (one.mode = mode)", mode)
        drawn(page)
        return page

    return open_viewer


def view(page):
    """Return the scale and the offset of the picture, by where it is on the screen."""
    frame = page.locator("#one .main").bounding_box()
    box = page.locator("#one .main .before img").bounding_box()
    return np.array([box["width"] / WIDTH, box["x"] - frame["x"], box["y"] - frame["y"]])


def on(page, x, y, pane=".main"):
    """Return where a place of a pane is on the screen."""
    box = page.locator(f"#one {pane}").bounding_box()
    return np.array([box["x"] + x, box["y"] + y])


def seen(page, pane=".main"):
    """Return the pixels of a pane, as they are on the screen."""
    with Image.open(io.BytesIO(page.locator(f"#one {pane}").screenshot())) as picture:
        return np.asarray(picture.convert("RGB"))


def test_the_wheel_zooms_round_the_pointer_and_keeps_the_place_when_the_picture_is_replaced(viewer):
    page = viewer()
    frame = page.locator("#one .main").bounding_box()
    assert view(page)[0] == pytest.approx(min(frame["width"] / WIDTH, frame["height"] / HEIGHT), abs=1e-3)
    place = np.array([200, 130])
    scale, *off = view(page)
    page.mouse.move(*on(page, *place))
    page.mouse.wheel(0, -600)
    until(page, f"one.main.viewport.scale > {2 * scale}")
    closer, *to = view(page)
    assert closer / scale == pytest.approx(np.exp(1.2), rel=0.01)
    np.testing.assert_allclose((place - to) / closer, (place - off) / scale, atol=1)
    put(page, "show", np.full((450, 600, 3), 20, np.uint8))
    np.testing.assert_allclose(view(page), [closer, *to], atol=0.01)
    after = page.locator("#one .after img").bounding_box()
    assert after["width"] == pytest.approx(closer * WIDTH, abs=0.1), "a smaller picture fills the same frame"
    before(page, np.full((180, 240, 3), 200, np.uint8))
    np.testing.assert_allclose(view(page), [closer, *to], atol=0.01)


@pytest.mark.parametrize("density", [1, 2])
def test_fit_and_100_percent_by_double_click_button_and_key(viewer, density):
    page = viewer(device_scale_factor=density)
    fitted = view(page)
    page.mouse.dblclick(*on(page, 100, 100))
    assert view(page)[0] * density == pytest.approx(1, abs=1e-3)
    np.testing.assert_allclose(
        ([100, 100] - view(page)[1:]) / view(page)[0], ([100, 100] - fitted[1:]) / fitted[0], atol=2
    )
    page.mouse.dblclick(*on(page, 100, 100))
    np.testing.assert_allclose(view(page), fitted, atol=1e-3)
    page.get_by_role("button", name="100 %").click()
    assert view(page)[0] * density == pytest.approx(1, abs=1e-3)
    assert page.inner_text("#one .zoom") == "100 %"
    page.get_by_role("button", name="Fit").click()
    page.focus("#one .main")
    page.keyboard.press("1")
    assert view(page)[0] * density == pytest.approx(1, abs=1e-3)
    x, y = view(page)[1:]
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    np.testing.assert_allclose(view(page)[1:], [x - 40, y + 40], atol=0.1)
    page.keyboard.press("+")
    assert view(page)[0] * density == pytest.approx(1.25, abs=1e-3)
    page.keyboard.press("0")
    np.testing.assert_allclose(view(page), fitted, atol=1e-3)


def test_a_sharper_preview_is_asked_for_when_one_sees_closer(viewer):
    page = viewer()
    assert page.evaluate("one.side") == 640
    page.evaluate("said.length = 0; one.actual()")
    assert page.evaluate("said") == [1280], "the photo has 1200 px"
    page.evaluate("one.main.viewport.zoom(4)")
    assert page.evaluate("one.side") == 1280, "there are no more px than the photo has"


def test_a_drag_moves_the_picture_when_it_is_zoomed(viewer):
    page = viewer()
    page.evaluate("one.actual()")
    x, y = view(page)[1:]
    drag(page, *on(page, 300, 200), 50, -30)
    np.testing.assert_allclose(view(page)[1:], [x + 50, y - 30], atol=0.1)


def test_two_fingers_zoom_what_is_between_them(viewer):
    page = viewer(has_touch=True)
    scale, *off = view(page)
    middle = np.array([250, 200])
    x, y = on(page, *middle).tolist()
    touch(
        page,
        [(x - 40, y)],
        [(x - 40, y), (x + 40, y)],
        [(x - 60, y), (x + 60, y)],
        [(x - 80, y), (x + 80, y)],
    )
    closer, *to = view(page)
    assert closer / scale == pytest.approx(2, rel=0.02)
    np.testing.assert_allclose((middle - to) / closer, (middle - off) / scale, atol=3)
    touch(page, [(x, y)], [(x + 30, y + 10)])
    np.testing.assert_allclose(view(page)[1:], np.add(to, [30, 10]), atol=0.1)


def test_the_slider_shows_both_sides_and_does_not_move_with_the_picture(viewer):
    page = viewer("slider")
    bar = page.get_by_role("slider", name="Before and after")

    def split(share):
        pixels = seen(page)[40]
        bound = int(share * len(pixels))
        # The bar has a shadow.
        assert (pixels[5 : bound - 12] == 200).all()
        assert (pixels[bound + 12 : -5] == 80).all()

    split(0.5)
    width = page.locator("#one .main").bounding_box()["width"]
    drag(page, *on(page, width / 2, 40), -width / 4, 0)
    split(0.25)
    assert bar.get_attribute("aria-valuenow") == "25"
    page.keyboard.press("Shift+ArrowRight")
    split(0.35)
    page.evaluate("one.actual()")
    x, y = view(page)[1:]
    drag(page, *on(page, 400, 100), -60, 0)
    np.testing.assert_allclose(view(page)[1:], [x - 60, y], atol=0.1)
    split(0.35)
    handle = bar.bounding_box()
    drag(page, handle["x"] + 1, handle["y"] + 20, 0.4 * width, 0)
    split(0.75)
    np.testing.assert_allclose(view(page)[1:], [x - 60, y], atol=0.1)


def test_the_slider_stays_on_a_picture_that_is_narrower_than_its_frame(viewer):
    page = viewer("slider")
    page.evaluate("one.panes.style.aspectRatio = '4'")
    drawn(page)
    frame = page.locator("#one .main").bounding_box()
    picture = page.locator("#one .before img").bounding_box()
    start, width = picture["x"] - frame["x"], picture["width"]
    assert width < frame["width"] / 2
    for to, share in ((-0.2, 0), (0.3, 0.3), (1.2, 1)):
        drag(page, *on(page, start + width / 2, 30), (to - 0.5) * width, 0)
        pixels = seen(page)[30]
        x = np.arange(len(pixels)) - start
        inside = (x > 2) & (x < width - 3) & (np.abs(x - share * width) > 12)
        np.testing.assert_array_equal(pixels[inside, 0], np.where(x < share * width, 200, 80)[inside])


@pytest.mark.parametrize("below", [False, True])
def test_side_by_side_both_are_zoomed_and_moved_as_one(viewer, below):
    page = viewer("side")
    if below:  # where there is more height than width
        page.evaluate("Object.assign(one.panes.style, { width: '300px', aspectRatio: '0.6' })")

    def alike():
        inside = []
        for pane in (".twin", ".main"):
            frame = page.locator(f"#one {pane}").bounding_box()
            box = page.locator(f"#one {pane} img").last.bounding_box()
            inside.append([box["x"] - frame["x"], box["y"] - frame["y"], box["width"], frame["width"]])
        np.testing.assert_allclose(*inside, atol=0.51)

    drawn(page)
    alike()
    apart = on(page, 0, 0) - on(page, 0, 0, ".twin")
    assert (apart[1] > 0) == below
    assert (apart[0] > 0) != below
    for pane, shade in ((".twin", 200), (".main", 80)):
        pixels = seen(page, pane)
        assert (pixels[pixels.shape[0] // 2, pixels.shape[1] // 2] == shade).all()
        page.mouse.move(*on(page, 40, 60, pane))
        scale = view(page)[0]
        page.mouse.wheel(0, -300)
        until(page, f"one.main.viewport.scale > {1.5 * scale}")
        drag(page, *on(page, 50, 50, pane), 12, 7)
        alike()
    assert not page.evaluate("one.main.viewport.fitted")


def test_before_is_seen_as_long_as_a_key_or_the_button_is_held(viewer):
    page = viewer()

    def shade():
        pixels = seen(page)
        return pixels[pixels.shape[0] // 2, 100, 0]

    for key in ("b", "\\"):
        assert shade() == 80
        page.keyboard.down(key)
        assert shade() == 200
        page.keyboard.up(key)
    button = page.get_by_role("button", name="Hold: before")
    box = button.bounding_box()
    page.mouse.move(box["x"] + 5, box["y"] + 5)
    page.mouse.down()
    assert shade() == 200
    assert button.get_attribute("aria-pressed") == "true"
    page.mouse.move(5, 5)
    page.mouse.up()
    assert shade() == 80
    page.evaluate(
        "document.body.append(document.createElement('input')); document.querySelector('input').focus()"
    )
    page.keyboard.down("b")
    assert shade() == 80, "a letter that is typed is a letter"


def test_the_newest_picture_wins_and_none_comes_after_it_was_taken_away(viewer):
    page = viewer()
    given = [png(np.full((40 * k, 60 * k, 3), 10 * k, np.uint8)) for k in (20, 1, 2)]
    shown = page.evaluate(
        """async (given) => {
            const bytes = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
            const blobs = given.map((text) => new Blob([bytes(text)]));
            let most = 0, least = 9;
            const watch = new MutationObserver(() => {
                const there = document.querySelectorAll(".after img").length;
                [most, least] = [Math.max(most, there), Math.min(least, there)];
            });
            watch.observe(document.querySelector(".after"), { childList: true });
            await Promise.all(blobs.map((blob) => one.show(blob)));
            const size = one.pictures.after.naturalWidth;
            watch.disconnect();
            const late = one.show(blobs[0]);
            one.clear();
            await late;
            return [size, most, least, one.pictures.after];
        }""",
        given,
    )
    assert shown == [120, 1, 1, None]
    refused = page.evaluate("one.show(new Blob(['no picture'])).then(() => '', (error) => error.name)")
    assert refused == "EncodingError"


def test_the_histogram_is_that_of_the_picture(viewer):
    page, pixels = viewer(), scene(1, ends=0.02)
    put(page, "show", pixels)
    counts = page.evaluate(
        """() => {
            const { counts } = one.levels.known.get(one.pictures.after);
            for (const name of ["red", "green", "blue", "luminance"]) counts[name] = [...counts[name]];
            return counts;
        }"""
    )
    luminance = (pixels.astype(int) @ [2126, 7152, 722] + 5000) // 10000
    for name, channel in {
        "red": pixels[..., 0],
        "green": pixels[..., 1],
        "blue": pixels[..., 2],
        "luminance": luminance,
    }.items():
        np.testing.assert_array_equal(counts[name], np.bincount(channel.ravel(), minlength=256))
    assert counts["pixels"] == pixels[..., 0].size
    assert counts["low"] == (pixels == 0).any(axis=2).sum()
    assert counts["high"] == (pixels == 255).any(axis=2).sum()
    drawn = page.evaluate("[...one.levels.canvas.getContext('2d').getImageData(0, 0, 256, 64).data]")
    between = np.flatnonzero(np.array(drawn).reshape(64, 256, 4)[:60, 3:253, 3].any(axis=0)) + 3
    most = max(np.bincount(channel.ravel(), minlength=256)[4:252].max() for channel in pixels.T)
    for end, bound in ((1, between.min()), (-1, between.max())):
        high = [
            level
            for level in range(1, 255)
            if max((channel == level).sum() for channel in pixels.T) > (4 / 64) ** 2 * most
        ]
        assert bound == pytest.approx(high[0] if end > 0 else high[-1], abs=4)
    assert f"{luminance.mean():.0f} of 255" in page.get_by_role("img", name="Histogram").get_attribute(
        "aria-label"
    )
    page.keyboard.down("b")
    assert "200 of 255" in page.get_by_role("img", name="Histogram").get_attribute("aria-label")


def test_clipped_pixels_are_marked_when_they_are_more_than_a_few(viewer):
    page = viewer()
    low = page.locator("#one [data-end=low]")
    high = page.locator("#one [data-end=high]")
    put(page, "show", scene(2, ends=0.0009))
    assert low.is_disabled()
    assert high.is_disabled()
    pixels = scene(2, ends=0.01)
    put(page, "show", pixels)
    assert low.get_attribute("aria-label") == "Shadows: 1.0 % clipped; show where"
    high.click()
    marked = page.evaluate(
        """() => {
            const { width, height } = one.levels.marks;
            return [...one.levels.marks.getContext("2d").getImageData(0, 0, width, height).data];
        }"""
    )
    marked = np.array(marked).reshape(*pixels.shape[:2], 4)
    np.testing.assert_array_equal(marked[..., 3] > 0, (pixels == 255).any(axis=2))
    page.evaluate("one.main.viewport.zoom(8)")
    places = [page.locator(f"#one .after {one}").bounding_box() for one in ("img", "canvas")]
    assert places[0] == places[1], "the marks move with the picture"
    low.click()
    assert page.locator("#one .after canvas").count() == 1
    put(page, "show", scene(3))
    assert page.locator("#one .after canvas").count() == 0


def test_the_result_is_dragged_out_as_a_file(viewer, address):
    page = viewer()
    page.evaluate("one.file = () => ({ url: '/api/v1/x.jpg', name: 'me.jpg' })")
    carried = """(selector) => {
        const event = new DragEvent("dragstart", { bubbles: true, dataTransfer: new DataTransfer() });
        document.querySelector(selector).dispatchEvent(event);
        return ["DownloadURL", "text/uri-list"].map((kind) => event.dataTransfer.getData(kind));
    }"""
    for selector in ("#one .after img", "#one .grip"):
        assert page.evaluate(carried, selector) == [
            f"image/jpeg:me.jpg:{address}api/v1/x.jpg",
            f"{address}api/v1/x.jpg",
        ]
    draggable = "document.querySelector('#one .after img').draggable"
    assert page.evaluate(draggable)
    page.evaluate("one.actual()")
    assert not page.evaluate(draggable), "a drag moves what is zoomed"


def test_the_picture_is_copied_as_png(viewer):
    page = viewer(permissions=["clipboard-read", "clipboard-write"])
    pixels = scene(4)
    put(page, "show", pixels)
    assert page.evaluate("one.copy()") == ""
    copied = page.evaluate(
        """async () => {
            const [item] = await navigator.clipboard.read();
            const picture = await createImageBitmap(await item.getType("image/png"));
            const canvas = document.createElement("canvas");
            [canvas.width, canvas.height] = [picture.width, picture.height];
            canvas.getContext("2d").drawImage(picture, 0, 0);
            return [...canvas.getContext("2d").getImageData(0, 0, picture.width, picture.height).data];
        }"""
    )
    np.testing.assert_array_equal(np.array(copied).reshape(*pixels.shape[:2], 4)[..., :3], pixels)
    page.evaluate("void (navigator.clipboard.write = () => Promise.reject(new Error()))")
    assert "did not let" in page.evaluate("one.copy()")


def test_buttons_choose_the_mode(viewer):
    page = viewer("after")
    page.evaluate("window.modes = []; one.addEventListener('mode', (event) => modes.push(event.detail.mode))")
    for name, mode in (("Slider", "slider"), ("Side by side", "side"), ("After", "after")):
        page.get_by_role("button", name=name, exact=True).click()
        assert page.evaluate("one.mode") == mode
        assert page.get_attribute("#one", "data-mode") == mode
    assert page.evaluate("modes") == ["slider", "side", "after"]
