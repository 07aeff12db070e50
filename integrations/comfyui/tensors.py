"""ComfyUI's tensors as relit's arrays, and back: IMAGE is (B, H, W, C) and MASK (B, H, W), both in 0 to 1."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


def images_of(tensor: Any) -> list[NDArray[np.float32]]:
    """Return the images of a batch, (H, W, 3) or with alpha (H, W, 4); other nodes may overshoot 0 to 1."""
    batch = np.clip(tensor.detach().cpu().numpy().astype(np.float32), 0, 1)
    return list(np.repeat(batch, 3, axis=3) if batch.shape[3] == 1 else batch)


def masks_of(tensor: Any) -> list[NDArray[np.float32]]:
    """Return the masks of a batch, or of one (H, W) alone."""
    masks = np.clip(tensor.detach().cpu().numpy().astype(np.float32), 0, 1)
    return list(masks.reshape(-1, *masks.shape[-2:]))


def tensor_of(arrays: Sequence[NDArray[Any]]) -> Any:
    """Return a batch of arrays of one shape."""
    import torch  # ComfyUI has it; relit needs it nowhere else

    return torch.from_numpy(np.ascontiguousarray(np.stack(arrays), np.float32))


def at(batch: list[Any], number: int) -> Any:
    """Return an item of a batch; the last one goes on for longer ones, as everywhere in ComfyUI."""
    return batch[min(number, len(batch) - 1)]
