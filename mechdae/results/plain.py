"""Results as plain data: what JSON and CSV are written from."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np


def plain(value: object) -> Any:
    """Return lists, floats, ints and None for arrays, numpy scalars and nan."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            gaps = value.astype(object)
            gaps[~np.isfinite(value)] = None
            return gaps.tolist()
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float | np.floating):
        number = float(value)
        return number if np.isfinite(number) else None
    if isinstance(value, np.integer):
        return int(value)
    return value


@contextmanager
def no_collection() -> Iterator[None]:
    """Pause the search for unreachable cycles: among millions of new lists it takes most time."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()
