"""Forty pairs whose reference has a light, in default settings, on pages to be judged by eye."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from examples.sheets import columns
from relit import RelitError, read_image, transfer, write_image
from relit.face.views import window_round
from relit.figures import page, strip
from relit.photo.samples import sample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit import Landmarks, TransferResult


class Pair(NamedTuple):
    """Whose face, in whose light: a portrait's number, or the name of a lit photo or of a sample; and why."""

    target: str
    reference: str
    why: str


#: A pair's number is its place here, and in docs/portraits.md: only ever add at the end.
PAIRS = (
    # Sun through a window, from behind on the right: patches on nose and cheek, the rest in shadow; a fringe.
    Pair("005", "i9", "fringe over fringe"),
    Pair("096", "i9", "dark skin in sun, beard"),
    Pair("136", "i9", "fair skin, lines of age"),
    # A low sun behind the left shoulder, violet from the right; half profile, a long fringe.
    Pair("142", "i6", "bare forehead under a long fringe"),
    Pair("062", "i6", "dark skin in sun, loose curls"),
    Pair("069", "i6", "fair skin, curls on the forehead"),
    # Dim light from the right; half profile, one cheek in the dark, loose hair.
    Pair("017", "i10", "stubble, half profile"),
    Pair("099", "i10", "dark and shining skin, half profile"),
    Pair("030", "i10", "hair falls beside the lit cheek"),
    # A street at night, soft from the front; a see-through fringe, lipstick, half profile.
    Pair("007", "i3", "bare forehead under a see-through fringe"),
    Pair("114", "i3", "dark skin, lipstick on a man"),
    Pair("136", "i3", "fair skin of 54, reference as smooth as a doll"),
    # Red from the left, the rest in the dark; the same fringe.
    Pair("067", "o3", "fringe over fringe, red"),
    Pair("096", "o3", "dark skin in red, beard"),
    Pair("069", "o3", "fair skin in red, curls"),
    # Pink from the left, blue from the right, little in front; a small face.
    Pair("127", "o9", "two colours on even skin"),
    Pair("062", "o9", "two colours on dark skin"),
    Pair("136", "o9", "two colours on fair skin"),
    # A warm lamp above on the right; a frown.
    Pair("064", "alter_i1", "brown skin, make-up under a frown"),
    Pair("114", "alter_i1", "dark skin, shaven head"),
    Pair("005", "alter_i1", "fringe under a bare forehead"),
    # An overcast street, soft; long hair over one temple.
    Pair("142", "alter_i4", "the least of lights, bare forehead"),
    Pair("099", "alter_i4", "the least of lights, dark and shining skin"),
    Pair("president", "alter_i4", "outdoors on a studio smile"),
    # Green all over; the face of the boxing ring.
    Pair("030", "alter_o3", "green, hair on one side"),
    Pair("096", "alter_o3", "green on dark skin, beard"),
    Pair("astronaut", "alter_o3", "green on a small face that laughs, fringe"),
    # Pink all over, violet from the left; the same face.
    Pair("007", "alter_o4", "pink, bare forehead"),
    Pair("064", "alter_o4", "pink on brown skin, make-up"),
    Pair("067", "alter_o4", "pink under a fringe"),
    # The dim light once more, on a bright photo.
    Pair("astronaut", "i10", "small face that laughs, half profile"),
    # Swapped: the target has a light of its own, that has to go.
    Pair("i9", "096", "sunlit target, even light from dark skin"),
    Pair("i10", "030", "half profile as target, even light"),
    Pair("i10", "i6", "two half profiles, light from the other side"),
    Pair("i6", "alter_i4", "half profile in sun as target, fringe"),
    Pair("i3", "o9", "fringe and make-up as target, two colours"),
    Pair("o3", "alter_i4", "red and half dark target into daylight"),
    Pair("alter_o3", "136", "green target into even light"),
    Pair("alter_i1", "i10", "frown, half profile"),
    Pair("alter_i4", "president", "long hair as target, a laughing man"),
)
_SAMPLES = {"astronaut": "target", "president": "reference"}
_HEIGHT = 900  # of a picture in a strip, in px: that of a portrait's head, so that its pixels are nearly seen
_SMALL = 240
_MARGIN = 0.9  # round a face, of the distance between its eyes


def main(arguments: list[str]) -> None:
    """Read the arguments, relight, write."""
    parser = argparse.ArgumentParser(prog="python -m examples lit", description=__doc__)
    parser.add_argument("--lit", type=Path, required=True, help="photos with a light, NAME.jpg")
    parser.add_argument("--portraits", type=Path, required=True, help="colour portraits NNN_03.jpg")
    parser.add_argument("--only", type=_numbers, metavar="N,N", help="these pairs, and no pages")
    parser.add_argument("-o", "--output", type=Path, default=Path("lit"), help="folder to write to")
    given = parser.parse_args(arguments)
    strips, small = {}, []
    for number in given.only or range(1, len(PAIRS) + 1):
        name, pair = pair_name(number), PAIRS[number - 1]
        try:
            result = relit_pair(pair, given.lit, given.portraits)
        except RelitError as error:
            print(f"{name}: left out: {error}", flush=True)
            continue
        faces = panels(pair, result)
        strips[number] = strip([(f"{name[:2]} {faces[0][0]}", faces[0][1]), *faces[1:]], _HEIGHT)
        small.append(strip([(name, faces[0][1]), ("", faces[1][1]), ("", faces[2][1])], _SMALL))
        _write(given.output / "results" / f"{name}.png", result.image)
        _write(given.output / "strips" / f"{name}.png", page([strips[number]]))
        print(f"{name}: {pair.why}", flush=True)
    if small and not given.only:
        for start in range(1, len(PAIRS) + 1, 4):
            if four := [strips[number] for number in range(start, start + 4) if number in strips]:
                _write(given.output / f"page {start:02}.png", page(four))
        _write(given.output / "overview.png", columns(small, 4))


def pair_name(number: int) -> str:
    """Return the name of a pair's files.

    Examples
    --------
    >>> pair_name(1)
    '01 005xi9'
    """
    target, reference, _ = PAIRS[number - 1]
    return f"{number:02} {target}x{reference}"


def relit_pair(pair: Pair, lit: Path, portraits: Path) -> TransferResult:
    """Carry the light of one photo to the other, in default settings."""
    target, reference = (read_image(photo_of(name, lit, portraits)).pixels for name in pair[:2])
    return transfer(target, reference)


def photo_of(name: str, lit: Path, portraits: Path) -> Path:
    """Return where the photo of that name is."""
    if name in _SAMPLES:
        return sample(_SAMPLES[name])
    return portraits / f"{name}_03.jpg" if name.isdigit() else lit / f"{name}.jpg"


def panels(pair: Pair, result: TransferResult) -> list[tuple[str, NDArray[Any]]]:
    """Return target, reference and result, each round the face, and captions."""
    assert result.reference is not None
    assert result.reference_landmarks is not None
    photos = (
        (f"target {pair.target}", result.target, result.target_landmarks),
        (f"reference {pair.reference}", result.reference, result.reference_landmarks),
        ("result", result.image, result.target_landmarks),
    )
    return [(caption, _round_face(image, landmarks)) for caption, image, landmarks in photos]


def _round_face(image: NDArray[Any], landmarks: Landmarks) -> NDArray[Any]:
    margin = _MARGIN * landmarks.interocular_distance
    return image[window_round(landmarks.xy, margin, image.shape)]


def _numbers(text: str) -> list[int]:
    numbers = [int(part) for part in text.split(",")]
    if wrong := [number for number in numbers if not 1 <= number <= len(PAIRS)]:
        raise argparse.ArgumentTypeError(f"expected 1 to {len(PAIRS)}, got {wrong[0]}")
    return numbers


def _write(path: Path, pixels: NDArray[Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_image(path, pixels, overwrite=True)
