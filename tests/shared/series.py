"""Parts of results as tests compare them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

import mechdae as md


class Row(dict):  # type: ignore[type-arg]
    """Arrays by key or attribute."""

    def __getattr__(self, name: str) -> Any:
        return self[name]


class Poses(SimpleNamespace):
    def __init__(self, count: int, **keys: Any) -> None:
        super().__init__(**keys)
        self.count = count

    def __len__(self) -> int:
        return self.count


def only_poses(result: md.Result, poses: list[int]) -> Any:
    """Return the part of a result that `audit` reads, at some of its poses."""

    def cut(table: Any) -> dict[str, Any]:
        return {
            name: Row({key: np.asarray(array)[poses] for key, array in series.items()})
            for name, series in table.items()
        }

    return Poses(
        len(poses),
        bodies=cut(result.bodies),
        points=cut(result.points),
        joints=cut(result.joints),
        efforts={name: np.asarray(value)[poses] for name, value in result.efforts.items()},
    )


def jerk_of(series) -> np.ndarray:
    """Return the third rate of a series, points as complex numbers."""
    found = series[next(name for name in series if "jerk" in name)]
    return found[:, 0] + 1j * found[:, 1] if found.ndim == 2 else found
