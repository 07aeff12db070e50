"""Teach the network.

    python -m training.learn FOLDER weights.pt --minutes 30

Every tenth person is held back. A run starts from the weights if there are any.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import torch
from torch import Tensor
from torch.nn.utils import clip_grad_norm_

from relit.photo.pixels import GAMMA
from training.network import Correction

_BATCH, _RATE, _DECAY, _CLIP = 16, 2e-3, 1e-3, 5.0
_WARM = 100  # steps until the rate is what it is to be
_EDGES = 1.0  # weight of the gradient's error
_SAME = 0.15  # share of pairs that are made one photo, twice: nothing is to be done
_GRAIN = 0.02  # log of brightness
_HELD_BACK = 10  # every so many persons
_MOST = 4.0  # log of brightness
_TOLD = 100  # steps between reports


class Pairs:
    """Pairs as of `training.pairs`: what is seen, (n, PLANES, SIDE, SIDE), and wanted, (n, SIDE, SIDE)."""

    def __init__(self, files: list[Path]) -> None:
        parts = [np.load(file) for file in files]
        self._seen, self._wanted = (
            torch.from_numpy(np.concatenate([part[name] for part in parts])) for name in ("seen", "wanted")
        )

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._seen)

    def take(self, index: Tensor) -> tuple[Tensor, Tensor]:
        """Return some of them."""
        seen = self._seen[index].float()
        seen[:, :5] = seen[:, :5].clamp(-_MOST, _MOST)
        return seen, self._wanted[index].float()

    def batches(self) -> Iterator[tuple[Tensor, Tensor]]:
        """Yield all of them, in order."""
        for index in torch.arange(len(self)).split(2 * _BATCH):
            yield self.take(index)


def error(made: Tensor, wanted: Tensor, inside: Tensor) -> tuple[Tensor, Tensor]:
    """Return how far off a log brightness is, as encoded after the one gain that fits best, and its gradient.

    Parameters
    ----------
    made, wanted, inside : (n, h, w) tensor

    Returns
    -------
    off, edges : (n,) tensor
        Mean absolute errors in % of what is 1.25 times as bright as most of the face.
    """
    here, there = (torch.exp(one.clamp(-6, _MOST) / GAMMA) for one in (made, wanted))
    gain = (here * there * inside).sum((1, 2), keepdim=True) / (here**2 * inside).sum((1, 2), keepdim=True)
    bright = (there * inside).flatten(1).quantile(0.93, dim=1)[:, None, None]
    off, area = 80 * (gain * here - there) * inside / bright, inside.sum((1, 2))
    edges = off.diff(dim=1).abs().sum((1, 2)) + off.diff(dim=2).abs().sum((1, 2))
    return off.abs().sum((1, 2)) / area, edges / area


def varied(seen: Tensor, wanted: Tensor, random: torch.Generator) -> tuple[Tensor, Tensor]:
    """Mirror some pairs, make some one photo twice, and add grain."""
    mirrored = seen.flip(3)
    mirrored[:, 5] *= -1  # x of the normals
    flip = torch.rand(len(seen), generator=random) < 0.5
    seen = torch.where(flip[:, None, None, None], mirrored, seen)
    wanted = torch.where(flip[:, None, None], wanted.flip(2), wanted)
    same = seen.clone()
    same[:, 1], same[:, 2], same[:, 4], same[:, 9] = seen[:, 0], 0, seen[:, 3], seen[:, 8]
    twice = torch.rand(len(seen), generator=random) < _SAME
    wanted = torch.where(twice[:, None, None], seen[:, 0], wanted)
    seen = torch.where(twice[:, None, None, None], same, seen)
    seen[:, :2] += _GRAIN * torch.randn(seen[:, :2].shape, generator=random)
    return seen, wanted


def held_back(net: Correction, pairs: Pairs) -> tuple[float, float]:
    """Return the mean errors of the method, and of it and the network."""
    errors: list[Tensor] = []
    with torch.no_grad():
        for seen, wanted in pairs.batches():
            plain = seen[:, 0] + seen[:, 2]
            both = [error(made, wanted, seen[:, 10])[0] for made in (plain, plain + net(seen))]
            errors.append(torch.stack(both))
    usual, learnt = torch.cat(errors, dim=1).mean(dim=1).tolist()
    return usual, learnt


def main(folder: Path, weights: Path, minutes: float, threads: int, people: int | None) -> None:
    """Learn for some minutes."""
    torch.manual_seed(0)
    torch.set_num_threads(threads)
    files = sorted(folder.glob("*.npz"))
    kept = Pairs(files[::_HELD_BACK])
    pairs = Pairs([file for k, file in enumerate(files) if k % _HELD_BACK][:people])
    net, random = Correction(), torch.Generator().manual_seed(0)
    if weights.exists():
        net.load_state_dict(torch.load(weights))
    optimizer = torch.optim.AdamW(net.parameters(), lr=_RATE, weight_decay=_DECAY)
    print(f"{len(pairs)} pairs, {len(kept)} held back, {sum(p.numel() for p in net.parameters())} weights")
    start, step, part = time.monotonic(), 0, 0.0
    while part < 1:
        part = (time.monotonic() - start) / (60 * minutes)
        for group in optimizer.param_groups:
            group["lr"] = _RATE * min(1, (step + 1) / _WARM) * (1 + np.cos(np.pi * min(part, 1))) / 2
        index = torch.randint(len(pairs), (_BATCH,), generator=random)
        seen, wanted = varied(*pairs.take(index), random)
        off, edges = error(seen[:, 0] + seen[:, 2] + net(seen), wanted, seen[:, 10])
        optimizer.zero_grad()
        (off + _EDGES * edges).mean().backward()
        clip_grad_norm_(net.parameters(), _CLIP)
        optimizer.step()
        step += 1
        if step % _TOLD == 0 or part >= 1:
            usual, learnt = held_back(net, kept)
            print(f"{60 * minutes * part:.0f} s, step {step}: {learnt:.3f}, without {usual:.3f}", flush=True)
            torch.save(net.state_dict(), weights)


@click.command(help=__doc__)
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("weights", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--minutes", default=30.0, show_default=True)
@click.option("--threads", default=2, show_default=True)
@click.option("--people", type=int, help="Learn from so many alone.")
def _command(folder: Path, weights: Path, minutes: float, threads: int, people: int | None) -> None:
    main(folder, weights, minutes, threads, people)


if __name__ == "__main__":
    _command()
