"""A transfer in layers, to go on by hand: the relit photo, what was done, where its parts are, the photo."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.compose.blend import in_rgb
from relit.compose.hair import hair
from relit.compose.person_matte import person_area
from relit.photo.layers import Layer, Layers, as_mask, box_of, change_in_layers
from relit.photo.photo import Metadata, Photo
from relit.photo.pixels import to_depth
from relit.photo.resampling import Enlarger
from relit.photo.writing import joined

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from relit.face.views import View
    from relit.results import TransferResult

_FACE_EDGE = 0.08  # interocular distances: as soft as the edges of a face's parts, `regions`


def layers_of(results: Sequence[TransferResult], like: Photo) -> Layers:
    """Return a relit photo in layers.

    From the top: "Relit", which is what one sees; "Light change, darker" to multiply and "Light change,
    brighter" to dodge what is below, which make the same of the photo to a level; "Face", "Hair and clothes"
    and "Background", hidden, white, opaque where these are; and "Photo". A layer that would be empty is left
    out. Where the photo can be seen through, nothing but "Relit" is visible, since layers would add up.

    Parameters
    ----------
    results : sequence of TransferResult
        Of one photo, face after face, each in what came of those before.
    like : Photo
        The target, whose alpha, profile and metadata the layers have.

    Returns
    -------
    Layers
        With 8 bits, or 16 if the photo has more than 8.

    Examples
    --------
    >>> from relit import read_image, sample, transfer
    >>> photo = read_image(sample("target"))
    >>> made = layers_of([transfer(photo, light="rembrandt")], photo)
    >>> [layer.name for layer in made.layers]  # doctest: +NORMALIZE_WHITESPACE
    ['Relit', 'Light change, darker', 'Light change, brighter', 'Face', 'Hair and clothes', 'Background',
     'Photo']
    """
    before, after = (_of_eight_or_sixteen(photo) for photo in before_and_after(results, like))
    seen = like.alpha is None
    return Layers(
        after,
        (
            Layer("Relit", after),
            *(replace(layer, visible=seen) for layer in _change(before, after)),
            *_masks(results, before),
            Layer("Photo", before, visible=seen),
        ),
    )


def before_and_after(results: Sequence[TransferResult], like: Photo) -> tuple[Photo, Photo]:
    """Return the photo and what came of it, both in grey or in RGB, as of `layers_of`."""
    before, after = results[0].target, results[-1].image
    if before.ndim < after.ndim:
        before = in_rgb(before)
    return joined(before, like), joined(after, like)


def changed_area(before: Photo, after: Photo) -> NDArray[np.bool_]:
    """Return where two photos of one size and kind differ, (H, W).

    Through it, the one laid over the other looks as if it were there alone.
    """
    different = before.pixels != after.pixels
    return np.asarray(different if before.is_grey else different.any(axis=2))


def at_full_size(plane: NDArray[np.float32], view: View, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return a plane of a view, (h, w) or (h, w, k), as large as its photo, and 0 round the view."""
    whole = np.zeros((*shape[:2], *plane.shape[2:]), np.float32)
    part = whole[view.window]
    part[...] = Enlarger(plane, view.factor, part.shape).rows(0, len(part))
    return whole


def _of_eight_or_sixteen(photo: Photo) -> Photo:
    """Return a photo with 8 bits, or with 16."""
    depth = np.uint8 if photo.pixels.dtype == np.uint8 else np.uint16
    alpha = None if photo.alpha is None else to_depth(photo.alpha, depth)
    return replace(photo, pixels=to_depth(photo.pixels, depth), alpha=alpha)


def _change(before: Photo, after: Photo) -> Iterator[Layer]:
    """Return the layers that change a photo's light, as large as what changes."""
    box = box_of(changed_area(before, after))
    if box is None:
        return
    rows, columns = box
    brighter, darker = change_in_layers(before.pixels[box], after.pixels[box])

    def layer(name: str, pixels: NDArray[Any], mode: Any) -> Layer:
        alpha = None if before.alpha is None else before.alpha[box]
        photo = replace(before, pixels=pixels, alpha=alpha, metadata=Metadata())
        return Layer(f"Light change, {name}", photo, columns.start, rows.start, mode)

    yield layer("darker", darker, "multiply")
    yield layer("brighter", brighter, "color-dodge")


def _masks(results: Sequence[TransferResult], like: Photo) -> Iterator[Layer]:
    """Return where the faces are, hair and clothes of their persons, and what is behind all of these."""
    shape = like.pixels.shape
    faces, hairs, persons = (np.zeros(shape[:2], np.float32) for _ in range(3))
    for result in results:
        view = result.view
        person, covered = person_area(view), hair(view)
        face = view.regions.mask(_FACE_EDGE) * (person - covered)
        rows, _ = view.window
        for whole, part in ((faces, face), (hairs, covered), (persons, person)):
            large = at_full_size(part, view, shape)
            large[rows.stop :] = large[rows.stop - 1]  # a view ends across a body, which goes on below
            np.maximum(whole, large, out=whole)
    masks = {"Face": faces, "Hair and clothes": hairs, "Background": 1 - persons}
    yield from filter(None, (as_mask(name, share, like) for name, share in masks.items()))
