"""Photos and results as HTML that stands alone: pictures inside, no scripts, nothing fetched."""

from __future__ import annotations

import base64
import io
from html import escape
from typing import TYPE_CHECKING

from relit.display.small import small
from relit.figures import STAGES, stage_pictures
from relit.photo.foreign_images import pixels_of

if TYPE_CHECKING:
    from PIL import Image

    from relit.photo.foreign_images import AnyImage
    from relit.results import TransferResult

#: The longest side, in px, of a picture, and of one among many: a notebook's page is about so wide.
LONGEST, LONGEST_OF_STAGE = 1280, 320
_QUALITY = 88  # of WebP; a portrait of 1280 px takes about 100 kB

# The slider is a row of radio buttons over two pictures, each of which cuts the upper one at its own place:
# under the pointer, by a tap, or by arrow keys. So it needs no script, which many pages that show notebooks
# leave out. A form keeps its buttons apart from those of the next; by "dialog" it is never sent.
_STEPS = 40
_STYLE = f"""
.relit {{max-width: {LONGEST}px; margin: 0; font: 14px/1.4 system-ui, sans-serif}}
.relit form {{position: relative; width: fit-content; max-width: 100%; margin: 0}}
.relit img {{display: block; max-width: 100%; height: auto; margin: 0}}
.relit form img + img {{position: absolute; inset: 0; clip-path: inset(0 0 0 50%)}}
.relit input {{position: absolute; z-index: 1; top: 0; height: 100%; width: {100 / _STEPS:g}%; margin: 0;
  appearance: none; background: none; outline: none; cursor: ew-resize}}
.relit input:hover, .relit form:not(:hover) input:checked {{
  background: linear-gradient(#fff, #fff) center / 2px 100% no-repeat}}
.relit form:focus-within {{outline: 2px solid #4363d8}}
.relit figcaption {{padding: 4px 0}}
.relit-row {{display: flex; flex-wrap: wrap; gap: 12px; align-items: flex-start}}
.relit-row figure {{margin: 0}}
"""


def _cuts() -> str:
    """Return the rules by which a button, chosen or pointed at, cuts the upper picture at its place."""
    return "".join(
        f".relit input:nth-of-type({step + 1}):{state} ~ img + img"
        f" {{clip-path: inset(0 0 0 {100 * (step + 0.5) / _STEPS:g}%)}}\n"
        for state in ("checked", "hover")
        for step in range(_STEPS)
    )


def result_html(result: TransferResult) -> str:
    """Return a result as HTML: before and after under a slider, and every stage, folded.

    Parameters
    ----------
    result : TransferResult

    Returns
    -------
    str

    Examples
    --------
    >>> from relit import sample, transfer
    >>> page = result_html(transfer(sample("target"), light="rembrandt"))
    >>> page.count("<script"), page.count("http"), page.count("<details>")
    (0, 0, 1)
    """
    stages = stage_pictures(result) | {"result": pixels_of(result.image, "image")}
    buttons = "".join(
        f'<input type="radio" name="cut" style="left:{100 * step / _STEPS:g}%"'
        f' aria-label="before up to {100 * (step + 0.5) / _STEPS:g} %"{" checked" * (step == _STEPS // 2)}>'
        for step in range(_STEPS)
    )
    shown = "".join(
        f"<figure>{_img(small(picture, LONGEST_OF_STAGE), STAGES[name])}"
        f"<figcaption>{escape(STAGES[name])}</figcaption></figure>"
        for name, picture in stages.items()
    )
    return (
        f"<style>{_STYLE}{_cuts()}</style>"
        f'<figure class="relit"><form method="dialog" aria-label="before and after">{buttons}'
        f"{_img(small(result.target, LONGEST), 'before')}"
        f"{_img(small(pixels_of(result.image, 'image'), LONGEST), 'after')}</form>"
        f"<figcaption>before | after: {escape(repr(result))}, confidence {result.confidence:.2f}</figcaption>"
        f'<details><summary>every stage</summary><div class="relit-row">{shown}</div></details></figure>'
    )


def image_html(image: AnyImage, caption: str = "") -> str:
    """Return an image of any kind as HTML, with a caption.

    Raises
    ------
    ImageError
        If it is of another kind, or cannot be read.

    Examples
    --------
    >>> import numpy as np
    >>> image_html(np.zeros((8, 8), np.uint8), "a < b")[-36:]
    'ption>a &lt; b</figcaption></figure>'
    """
    told = f"<figcaption>{escape(caption)}</figcaption>"
    return (
        f'<style>{_STYLE}</style><figure class="relit">{_img(small(image, LONGEST), caption)}{told}</figure>'
    )


def row_html(parts: list[str]) -> str:
    """Return pieces of HTML side by side."""
    return f'<div class="relit-row">{"".join(parts)}</div>'


def _img(picture: Image.Image, alt: str) -> str:
    """Return a picture as an element that holds it."""
    stream = io.BytesIO()
    picture.save(stream, "WEBP", quality=_QUALITY)
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    width, height = picture.size
    return (
        f'<img src="data:image/webp;base64,{data}" width="{width}" height="{height}" '
        f'alt="{escape(alt, quote=True)}">'
    )
