"""Double pendulums with dampers, as problem files hold them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tests.reference.pendulums import G


def pendulum(damping: float, **task: Any) -> dict[str, Any]:
    """A double pendulum with a damper in its second hinge."""
    return {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "upper": {"points": {"O": [0, 0], "P": [0, -1]}, "mass": 1.0, "center": [0, -1]},
            "lower": {"points": {"P": [0, 0], "Q": [0, -1]}, "mass": 1.0, "center": [0, -1]},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "upper.O"]},
            "P": {"kind": "revolute", "between": ["upper.P", "lower.P"]},
        },
        "sketch": {"upper": 1.0, "lower": 0.5},
        "loads": {"damper": {"kind": "spring", "coordinate": "P.angle", "damping": damping}},
        "tasks": {"m": {"kind": "motion", "at": [1.0], "tolerance": 1e-8, **task}},
    }


def bobs(damping: float, **task: Any) -> dict[str, Any]:
    """Two point masses on bars: four coordinates, two constraints; a damper to the ground."""
    data = pendulum(0.0, **task)
    data["bodies"] = {
        "a": {"points": {"P": [0, 0]}, "mass": 1.0},
        "b": {"points": {"Q": [0, 0]}, "mass": 1.0},
    }
    data["joints"] = {
        "near": {"kind": "distance", "between": ["ground.O", "a.P"], "length": 1.0},
        "far": {"kind": "distance", "between": ["a.P", "b.Q"], "length": 1.0},
    }
    places = np.array([math.sin(1), -math.cos(1), math.sin(1) + math.sin(0.5)])
    data["sketch"] = dict(zip(["a.P.x", "a.P.y", "b.Q.x"], places.tolist(), strict=True))
    data["sketch"]["b.Q.y"] = -math.cos(1) - math.cos(0.5)
    data["loads"] = {"damper": {"kind": "spring", "between": ["ground.O", "b.Q"],
                                "damping": damping}}  # fmt: skip
    return data
