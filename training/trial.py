"""Try the network where it has never been: on rendered heads of others, and on Yale B.

    python -m training.trial weights.pt --heads FOLDER --yaleb FOLDER

Every figure is told without the network and with it.
"""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import click
import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from relit.evaluate.cases import Case, head_cases, protocol_cases
from relit.evaluate.evaluation import evaluate
from relit.settings.options import TransferOptions
from training.closed_form import Planes, Watched, box_round, corrected, planes_of
from training.network import Correction

_SETS = {"heads": ("similar", "across", "harsh", "same"), "yaleb": ("quick", "harsh")}
_FIGURES = {"heads": ("lum", "ssim", "de", "blotch"), "yaleb": ("raw", "gain", "ssim")}
_RIM = 0.06  # interocular distances over which a correction ends at the face's outline
_MOST = 4.0  # log of brightness


class Corrector:
    """What the network makes of a change.

    Parameters
    ----------
    weights : Path
    """

    def __init__(self, weights: Path) -> None:
        self._net = Correction()
        self._net.load_state_dict(torch.load(weights))
        self._net.eval()

    def __call__(self, change: Planes, seen: Watched) -> Planes:
        """Return a change, corrected on the face; the mean of what is made of it and of its mirror image."""
        if seen.reference is None:
            return change
        planes, face = planes_of(change, seen), seen.scene.face
        planes[:5] = planes[:5].clip(-_MOST, _MOST)
        mirrored = planes[..., ::-1].copy()
        mirrored[5] *= -1
        with torch.no_grad():
            made, other = self._net(torch.from_numpy(np.stack([planes, mirrored]))).numpy()
        made = (made + other[:, ::-1]) / 2
        made -= np.median(made[planes[10] > 0.5])
        soft = gaussian_filter(face.inside.astype(np.float32), _RIM * face.interocular_distance)
        correction = np.clip(2 * soft - 1, 0, 1) * _enlarged(made, box_round(face), face.shape)
        return np.asarray(change + correction, np.float32)


def _enlarged(made: Planes, box: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return a plane of a box at the pixels of a view."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    step = box[0, 1, 0] - box[0, 0, 0]
    return np.asarray(
        map_coordinates(made, [(y - box[0, 0, 0]) / step, (x - box[1, 0, 0]) / step], order=1, mode="nearest")
    )


def figures(cases: list[Case], folder: Path, names: tuple[str, ...]) -> str:
    """Return the means of what the method scores, by name."""
    method = {"shading": TransferOptions()}
    found = [
        [getattr(outcome.scores, name) for name in names]
        for outcomes in evaluate(cases, method, folder=folder)
        for outcome in outcomes
        if outcome.method == "shading"
    ]
    return " / ".join(f"{value:.3f}" for value in np.mean(found, axis=0))


@click.command(help=__doc__)
@click.argument("weights", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--heads", type=click.Path(exists=True, path_type=Path))
@click.option("--yaleb", type=click.Path(exists=True, path_type=Path))
@click.option("--every", default=8, show_default=True, help="Take every so many rows of each set.")
def _command(weights: Path, heads: Path | None, yaleb: Path | None, every: int) -> None:
    for corpus, folder in (("heads", heads), ("yaleb", yaleb)):
        if folder is None:
            continue
        of_set = head_cases if corpus == "heads" else protocol_cases
        for name in _SETS[corpus]:
            cases = of_set(folder / "protocol.csv", name)[::every]
            for label, used in (("without", nullcontext()), ("with", corrected(Corrector(weights)))):
                with used:
                    told = figures(cases, folder, _FIGURES[corpus])
                print(f"{corpus} {name}, {' / '.join(_FIGURES[corpus])}, {label}: {told}", flush=True)


if __name__ == "__main__":
    _command()
