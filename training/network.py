"""The network: what the method gets wrong of a change of light, as a smooth field."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import avg_pool2d, interpolate, relu

from training.closed_form import PLANES

_WIDTHS = 24, 40, 56, 80


class Block(nn.Module):
    """Two convolutions, and what went in added."""

    def __init__(self, ins: int, outs: int) -> None:
        super().__init__()
        self.first, self.second = nn.Conv2d(ins, outs, 3, padding=1), nn.Conv2d(outs, outs, 3, padding=1)
        self.past = nn.Conv2d(ins, outs, 1) if ins != outs else nn.Identity()
        self.norm = nn.GroupNorm(4, outs)

    def forward(self, x: Tensor) -> Tensor:
        """Return planes, (n, outs, h, w), of planes, (n, ins, h, w)."""
        return relu(self.norm(self.second(relu(self.first(x)))) + self.past(x))


class Correction(nn.Module):
    """A U-Net at half of the planes' size; at first it corrects nothing."""

    def __init__(self) -> None:
        super().__init__()
        a, b, c, d = _WIDTHS
        self.stem = nn.Conv2d(PLANES, a, 4, stride=2, padding=1)
        self.down = nn.ModuleList([Block(a, a), Block(a, b), Block(b, c), Block(c, d)])
        self.up = nn.ModuleList([Block(d + c, c), Block(c + b, b), Block(b + a, a)])
        self.last = nn.Conv2d(a, 1, 3, padding=1)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self, planes: Tensor) -> Tensor:
        """Return what to add to a change, (n, SIDE, SIDE), of planes, (n, PLANES, SIDE, SIDE)."""
        x, seen = relu(self.stem(planes)), list[Tensor]()
        for k, block in enumerate(self.down):
            x = block(avg_pool2d(x, 2) if k else x)
            seen.append(x)
        for block, past in zip(self.up, seen[-2::-1], strict=True):
            x = block(torch.cat([interpolate(x, scale_factor=2, mode="bilinear"), past], dim=1))
        return interpolate(self.last(x), scale_factor=2, mode="bilinear")[:, 0]
