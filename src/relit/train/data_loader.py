"""The worker of a PyTorch ``DataLoader`` that this process may be; torch is never imported here."""

from __future__ import annotations

import sys
from typing import Any

from relit.runtime.threads import available


def loader_worker() -> Any:
    """Return what torch knows of the worker that this process is: its id and seed; None if it is none."""
    data = sys.modules.get("torch.utils.data")
    return data.get_worker_info() if data else None


def share_of_threads() -> int:
    """Return how many threads this process may take: workers share the cores."""
    info = loader_worker()
    return available() if info is None else max(1, available() // info.num_workers)
