"""What the constants of matting, skin and rendering are worth: ``python -m benchmarks.constants``.

Every number that one of `MODULES` gives a name to is halved and doubled, one at a time, and everything is
relit anew: rendered heads and Yale B faces, whose truth is known, and portraits. Of shares close to 1, the
rest is halved and doubled. A table of the relative changes is written to ``constants.md``.

The folder of heads has, by person, ``LIGHT.png``, ``mask_face.png``, ``mask_background.png`` and
``landmarks.json`` with the points ``mesh478``; a light ``LIGHT_neutral`` is the same, made white. Its
``protocol.csv`` has the columns set, target, target_light, reference and reference_light.
"""

from __future__ import annotations

import ast
import csv
import importlib
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.console import Console
from scipy.ndimage import distance_transform_edt, gaussian_filter
from skimage.color import deltaE_ciede2000, rgb2lab
from skimage.metrics import structural_similarity

from relit import Landmarks, detect_landmarks, transfer
from relit.compose.matte import matte
from relit.evaluate.cases import protocol_cases
from relit.evaluate.scores import score
from relit.evaluate.yale_b import YaleB
from relit.face.views import whole
from relit.photo.color import luma
from relit.runtime.memo import Keeper, Memo

#: Modules in the order in which they work, and the trials in which their constants act.
MODULES = {
    "face.shape": ("heads", "yale", "lamps"),
    "light.horizon": ("heads", "yale", "lamps"),
    "light.dome": ("heads", "yale", "lamps"),
    "light.lamps": ("lamps",),
    "light.rendering": ("lamps",),
    "face.skin": ("heads", "matte"),
    "face.regions": ("heads", "matte"),
    "face.views": ("heads", "matte"),
    "face.trust": ("heads", "yale", "lamps"),
    "methods.lit_face": ("heads", "yale", "lamps"),
    "methods.residual": ("heads", "yale"),
    "methods.known_shape": ("heads", "lamps"),
    "methods.hue": ("heads",),
    "methods.bleach": ("heads", "lamps"),
    "methods.unlit": ("heads", "yale", "lamps"),
    "methods.light_change": ("heads", "yale", "lamps"),
    "methods.shading": ("heads", "yale", "lamps"),
    "solver.membrane": ("heads",),
    "compose.matte": ("matte",),
    "compose.person_matte": ("heads", "lamps"),
    "compose.hair": ("heads", "lamps"),
    "compose.adjust": ("kept",),
    "compose.blend": ("large",),
    "relighting": ("heads",),
}
SIDE = 256  # px, of heads: half of what they have, and a quarter of the time
#: Lamps of the heads, as they stand.
LAMPS = {"rembrandt": "45,45", "butterfly": "0,50", "split": "-80,5", "keyleft": "-40,25"}
#: Shares whose distance to 1 is what is scaled.
SHARES = ("BRIGHTEST", "_BRIGHTEST", "_NEARLY_ALL", "_ALL", "_WHITE", "_OTHERS")

Figures = dict[str, float]
Trial = Callable[[], Figures]


def constants(module: ModuleType) -> dict[str, float]:
    """Return the numbers that a module gives names to at its top."""
    tree = ast.parse(Path(str(module.__file__)).read_text("utf-8"))
    names = [
        node.id
        for statement in tree.body
        if isinstance(statement, (ast.Assign, ast.AnnAssign))
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id.isupper()
    ]
    return {name: value for name in names if isinstance(value := getattr(module, name), (int, float))}


def scaled(name: str, value: float, factor: float) -> float:
    """Return a constant's value, made larger or smaller."""
    if name in SHARES:
        return 1 - factor * (1 - value)
    return int(factor * value) if isinstance(value, int) else factor * value


@contextmanager
def changed(module: ModuleType, name: str, value: float) -> Iterator[None]:
    """Let a constant have another value meanwhile."""
    usual = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, usual)


class Earlier(Keeper):
    """Keeps what steps gave that work before the module whose constants are changed: nothing reaches them."""

    def __init__(self) -> None:
        self.changed = ""
        self._memos: dict[Any, Memo] = {}
        self._case: Any = None

    @contextmanager
    def case(self, *case: Any) -> Iterator[None]:
        """Keep results by case."""
        self._case = case
        with self.open():
            yield

    def recall(self, step: Callable[..., Any], given: dict[str, Any], go_on: Callable[[], None]) -> Any:
        """Return what a step gives."""
        order = ["relit.warp.alignment", *(f"relit.{name}" for name in MODULES)]
        if step.__module__ not in order[: order.index(self.changed)]:
            return step(**given)
        return self._memos.setdefault(self._case, Memo()).recall(step, given, go_on)


EARLIER = Earlier()


# Rendered heads


@cache
def image(path: Path, side: int = SIDE) -> NDArray[np.uint8]:
    """Return the pixels of a photo, made so wide."""
    with Image.open(path) as photo:
        return np.asarray(photo.convert("RGB").resize((side, side), Image.Resampling.BOX))


@cache
def head(folder: Path) -> tuple[Landmarks, Mapping[str, NDArray[np.bool_]]]:
    """Return the landmarks of a rendered head, and where its face, the rest of it and a halo round it are."""
    points = json.loads((folder / "landmarks.json").read_text())["mesh478"]
    face = image(folder / "mask_face.png")[..., 0] > 127
    beyond = image(folder / "mask_background.png")[..., 0] > 127
    halo = beyond & (distance_transform_edt(beyond) <= 10)
    return Landmarks(np.array(points)).reduced(2), {"face": face, "rest": ~face & ~beyond, "halo": halo}


def head_figures(folder: Path, target: str, truth: str, relit: NDArray[np.uint8]) -> Figures:
    """Compare a relit head with the truth, on the face after the one gain that fits best."""
    wanted, before, (_, where) = image(folder / truth), image(folder / target), head(folder)
    face = where["face"]
    got, true = (luma(one.astype(np.float64)) for one in (relit, wanted))
    fitted = got * (got[face] @ true[face]) / (got[face] @ got[face])
    likeness = structural_similarity(fitted, true, data_range=255, full=True)[1]  # type: ignore[no-untyped-call]
    linear, linear_true = (one[face].astype(np.float64) ** 2.2 for one in (relit, wanted))
    gain = ((linear * linear_true).sum() / (linear**2).sum()) ** (1 / 2.2)
    off = lab(np.clip(relit * gain, 0, 255))[..., 1:] - lab(wanted)[..., 1:]
    share = gaussian_filter(face.astype(float), 5)
    soft = np.stack([gaussian_filter(off[..., k] * face, 5) / np.maximum(share, 1e-9) for k in (0, 1)])
    return {
        "lum": float(np.abs(fitted - true)[face].mean() / 2.55),
        "raw": float(np.abs(got - true)[face].mean() / 2.55),
        "1-SSIM": float(1 - likeness[face].mean()),
        "dE": difference(np.clip(relit * gain, 0, 255), wanted, face),
        "blotch": float(np.sqrt(soft[:, face].var(axis=1).sum())),
        "rest": difference(relit, wanted, where["rest"]),
        "halo": difference(relit, before, where["halo"]),
    }


def lab(rgb: NDArray[Any]) -> NDArray[np.float64]:
    """Return the CIE L*a*b* of sRGB in 0 to 255."""
    return np.asarray(rgb2lab(rgb / 255.0))


def difference(one: NDArray[Any], other: NDArray[Any], where: NDArray[np.bool_]) -> float:
    """Return the mean CIEDE2000."""
    return float(deltaE_ciede2000(lab(one[where]), lab(other[where])).mean())  # type: ignore[no-untyped-call]


def mean(rows: list[Figures]) -> Figures:
    """Return the mean of every figure."""
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def heads(folder: Path, every: int, **options: Any) -> Figures:
    """Relight rendered heads by other heads."""
    with (folder / "protocol.csv").open() as file:
        rows = list(csv.DictReader(file))[::every]
    found = []
    for row in rows:
        ours, theirs = folder / row["target"], folder / row["reference"]
        white = f"{row['reference_light']}_neutral.png"
        truth = white if (ours / white).exists() else f"{row['reference_light']}.png"
        target = f"{row['target_light']}.png"
        with EARLIER.case(*row.values()):
            relit = transfer(
                image(ours / target),
                image(theirs / f"{row['reference_light']}.png"),
                target_landmarks=head(ours)[0],
                reference_landmarks=head(theirs)[0],
                **options,
            )
        found.append(head_figures(ours, target, truth, relit.image))
    return mean(found)


def lamps(folder: Path) -> Figures:
    """Relight rendered heads by lights of known angles."""
    found = []
    for person in sorted(path.parent for path in folder.glob("*/env.png"))[::3]:
        for lamp, angles in LAMPS.items():
            with EARLIER.case(person):
                relit = transfer(image(person / "env.png"), light=angles, target_landmarks=head(person)[0])
            found.append(head_figures(person, "env.png", f"{lamp}.png", relit.image))
    return {f"lamp {name}": figure for name, figure in mean(found).items()}


# Photos


def yale(folder: Path, every: int) -> Figures:
    """Relight Yale B faces, with the mask on."""
    faces, found = YaleB(folder), []
    for case in protocol_cases(folder / "protocol.csv", "quick")[::every]:
        with EARLIER.case(case):
            relit = transfer(
                faces.photo(*case.target),
                faces.photo(*case.reference),
                target_landmarks=faces.landmarks(*case.target),
                reference_landmarks=faces.landmarks(*case.reference),
            )
        got = faces.aligned(relit.image.astype(np.float64), *case.target)
        truth = faces.aligned(faces.photo(*case.truth).astype(np.float64), *case.truth)
        figures = score(got, truth, truth)
        found.append({"Yale gain": figures.gain, "Yale 1-SSIM": 1 - figures.ssim})
    return mean(found)


@cache
def portrait(path: Path, side: int) -> tuple[NDArray[np.uint8], Landmarks]:
    """Return a portrait and its landmarks."""
    pixels = image(path, side)
    return pixels, detect_landmarks(pixels)


@cache
def usual_mattes(folder: Path) -> list[NDArray[np.float32]]:
    """Return the mattes of the portraits as they are."""
    return mattes(folder)


def mattes(folder: Path) -> list[NDArray[np.float32]]:
    """Return the mattes of some portraits."""
    return [matte(whole(*portrait(path, SIDE))) for path in sorted(folder.glob("*.jpg"))[::2]]


def moved_mattes(folder: Path) -> Figures:
    """Tell how far the mattes of portraits are from the usual ones, in shares of their area; added to 1."""
    pairs = list(zip(mattes(folder), usual_mattes(folder), strict=True))
    return {"matte": 1 + float(np.mean([np.abs(new - old).sum() / old.sum() for new, old in pairs]))}


@cache
def in_full(target: Path, reference: Path) -> NDArray[np.uint8]:
    """Relight a portrait at its full resolution."""
    (ours, here), (theirs, there) = (portrait(path, 1350) for path in (target, reference))
    relit = transfer(ours, theirs, target_landmarks=here, reference_landmarks=there, full_resolution=True)
    return np.asarray(relit.image)


def large(folder: Path) -> Figures:
    """Relight large portraits through a small view; compare with the same at full resolution."""
    paths, found = sorted(folder.glob("*.jpg"))[:3], []
    for target, reference in zip(paths, paths[1:] + paths[:1], strict=True):
        (ours, here), (theirs, there) = (portrait(path, 1350) for path in (target, reference))
        relit = transfer(ours, theirs, target_landmarks=here, reference_landmarks=there)
        changed = (relit.image != ours).any(axis=2)
        found.append({"dE to full": difference(relit.image, in_full(target, reference), changed)})
    return mean(found)


@click.command(help=__doc__)
@click.option("--heads", "heads_folder", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--yaleb", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--portraits", type=click.Path(exists=True, path_type=Path), required=True)
@click.option(
    "--every", default=24, show_default=True, help="Take every so many rows of the heads' protocol."
)
@click.option("--only", multiple=True, type=click.Choice(list(MODULES)))
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("constants.md"))
def main(
    heads_folder: Path, yaleb: Path, portraits: Path, every: int, only: tuple[str, ...], output: Path
) -> None:
    """Measure all constants."""
    trials: dict[str, Trial] = {
        "heads": partial(heads, heads_folder, every),
        "kept": partial(heads, heads_folder, every, method="ltv", exposure="keep"),
        "lamps": partial(lamps, heads_folder),
        "yale": partial(yale, yaleb, 12),
        "matte": partial(moved_mattes, portraits),
        "large": partial(large, portraits),
    }
    console = Console()
    usual: dict[str, Figures] = {}
    lines = ["| constant | value | ×½ | ×2 |", "|---|---|---|---|"]
    for place in only or MODULES:
        module = importlib.import_module(f"relit.{place}")
        EARLIER.changed = f"relit.{place}"
        for trial in MODULES[place]:
            if trial not in usual:
                usual[trial] = trials[trial]()
                console.print(trial, usual[trial])
        for name, value in constants(module).items():
            cells = []
            for factor in (0.5, 2.0):
                with changed(module, name, scaled(name, value, factor)):
                    try:
                        new = [told(trials[trial](), usual[trial]) for trial in MODULES[place]]
                    except Exception as error:  # what cannot be
                        new = [type(error).__name__]
                cells.append(", ".join(part for part in new if part) or "nothing")
            lines.append(f"| `{place}.{name}` | {value:g} | {cells[0]} | {cells[1]} |")
            console.print(lines[-1], soft_wrap=True, highlight=False)
            output.write_text("\n".join(lines) + "\n", "utf-8")


def told(new: Figures, usual: Figures) -> str:
    """Return the relative changes of the figures that are above one in a thousand."""
    ratios = {name: new[name] / usual[name] - 1 for name in usual}
    return ", ".join(f"{name} {ratio:+.1%}" for name, ratio in ratios.items() if abs(ratio) >= 0.001)


if __name__ == "__main__":
    main()
