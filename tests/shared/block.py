"""A block on an inclined guide with a spring and a damper, whose motion is known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mechdae.describe.file.load import from_dict

M, K, C, X0 = 2.0, 50.0, 3.0, 0.4


def block(**tasks: Any) -> Any:
    """Return a block on a guide with spring and damper: x = exp(-d t) (...), all known."""
    spring = {"kind": "spring", "coordinate": "guide.slide", "stiffness": "k", "damping": "c"}
    return from_dict(
        {
            "schema": 1,
            "gravity": [0, -9.81],
            "parameters": {"m": M, "k": K, "c": C, "x0": X0},
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"block": {"points": {"P": [0, 0]}, "mass": "m"}},
            "joints": {
                "guide": {"kind": "prismatic", "between": ["ground.O", "block.P"], "axis": 0.3}
            },
            "outputs": {"x": "guide.slide"},
            "loads": {"s": spring},
            "tasks": {
                "rest": {"kind": "equilibrium", "linearise": True},
                "go": {"kind": "motion", "start": {"guide": "x0"}, "until": 3.0,
                       "tolerance": 1e-12},
                **tasks,
            },
        }
    )  # fmt: skip


def course(t: Any, m: float, k: float, c: float, x0: float) -> Any:
    """Return the place of the block over the time."""
    rest = -m * 9.81 * math.sin(0.3) / k
    d = c / (2 * m)
    w = math.sqrt(k / m - d * d)
    return rest + (x0 - rest) * np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))
