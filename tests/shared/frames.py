"""One four-bar of any size, its frame described in several ways, with goals of all kinds."""

from __future__ import annotations

from typing import Any

from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem

PIVOTS = {"A": ["ax", "ay"], "D": ["dx", "dy"]}
FRAMES: dict[str, tuple[dict[str, list[str]], tuple[str, ...]]] = {
    "weld": ({"A": ["ax", "ay"]}, ("ax", "ay", "r1", "th")),
    "pivots": (PIVOTS, ("ax", "ay", "dx", "dy")),
    "polygons": (PIVOTS, ()),
    "rocker's pivot": (PIVOTS, ("dx", "dy")),
    "crank's pivot": (PIVOTS, ("ax", "ay")),
    "along x": (PIVOTS, ("ax", "dx")),
    "beside": ({"A": ["ax", "ay"], "D": ["ax + w", "ay"]}, ("ax", "ay", "w")),
    "fixed": (PIVOTS, ()),
}
"""Points of the ground and the free parameters of each frame."""
NUMBERS = {
    "ax": 0.0, "ay": -0.08, "dx": 0.08, "dy": -0.08, "w": 0.08, "r1": 0.08, "r2": 0.04, "r3": 0.1,
    "r4": 0.09, "px": 0.06, "py": 0.06,
}  # fmt: skip
BOX = {
    "ax": (-0.3, 0.3), "ay": (-0.3, 0.3), "dx": (-0.3, 0.3), "dy": (-0.3, 0.3), "w": (-0.4, 0.4),
    "r1": (0.01, 0.4), "r2": (0.01, 0.3), "r3": (0.01, 0.4), "r4": (0.01, 0.4),
    "px": (-0.4, 0.4), "py": (-0.4, 0.4),
}  # fmt: skip
CORNERS = [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]]
PLACES = [
    [-0.06, 0.0], [-0.036, 0.0], [-0.012, 0.0], [0.012, 0.0], [0.036, 0.0], [0.06, 0.0],
    [0.0541, 0.0152], [0.0374, 0.0274], [0.0134, 0.0341], [-0.0134, 0.0341], [-0.0374, 0.0274],
    [-0.0541, 0.0152],
]  # fmt: skip
TURNS = [30 * k for k in range(12)]


def goals(size: float) -> dict[str, dict[str, Any]]:
    """Return goals of all kinds that starts are drawn for."""
    targets = [[size * x, size * y] for x, y in PLACES]
    path = {"kind": "path", "point": "coupler.P", "targets": targets}
    return {
        "path in order": {**path, "timing": "free", "closed": True},
        "path in any order": {**path, "timing": "any"},
        "path in steps": {**path, "steps_deg": TURNS},
        "path at angles": {**path, "at_deg": TURNS},
        "function": {
            "kind": "function", "input": "A.angle", "output": "D.angle",
            "targets_deg": [[60, 80], [90, 85], [120, 95], [150, 110]],
        },
        "swing": {"kind": "rocker", "body": "rocker", "swing_deg": 40},
        "straight line": {
            "kind": "straight-line", "point": "coupler.P", "stroke": 0.1 * size, "arc_deg": 120,
        },
    }  # fmt: skip


def on_frame(frame: str, goal: str, size: float = 1.0, starts: int = 12) -> Problem:
    """Return a problem of synthesis: a four-bar on a frame, so many times as large."""
    points, names = FRAMES[frame]
    asked = goals(size)[goal]
    traced = asked.get("point") is not None
    every = [*names, "r2", "r3", "r4", *(("px", "py") if traced else ())]
    free: dict[str, Any] = {name: [size * x for x in BOX[name]] for name in every if name != "th"}
    if "th" in every:
        free["th"] = [-6.3, 6.3]
    if frame == "polygons":
        polygon = [[size * x, size * y] for x, y in CORNERS]
        free |= {f"at{p}": {"point": f"ground.{p}", "polygon": polygon} for p in points}
    weld = frame == "weld"
    words = " ".join(str(x) for row in points.values() for x in row) + " r1" * weld
    used = {name for name in NUMBERS if name in words.split() or name in ("r2", "r3", "r4")}
    used |= {"px", "py"}
    A, D = ("frame.A", "frame.D") if weld else ("ground.A", "ground.D")
    pins = {
        "A": [A, "crank.A"], "B": ["crank.B", "coupler.B"], "C": ["coupler.C", "rocker.C"],
        "D": [D, "rocker.D"],
    }  # fmt: skip
    bodies: dict[str, Any] = {
        "crank": {"points": {"A": [0, 0], "B": ["r2", 0]}},
        "coupler": {"points": {"B": [0, 0], "C": ["r3", 0], "P": ["px", "py"]}},
        "rocker": {"points": {"D": [0, 0], "C": ["r4", 0]}},
    }
    joints: dict[str, Any] = {
        name: {"kind": "revolute", "between": between} for name, between in pins.items()
    }
    if weld:
        bodies = {"frame": {"points": {"A": [0, 0], "D": ["r1", 0]}}, **bodies}
        base = {"kind": "weld", "between": ["ground.A", "frame.A"], "turn": "th"}
        joints = {"base": base, **joints}
    full = [{"kind": "full-turn", "coordinate": "A.angle"}] if goal != "function" else []
    numbers = {name: size * NUMBERS[name] for name in NUMBERS if name in used}
    task = {
        "kind": "synthesis", "driver": {"coordinate": "A.angle"}, "constraints": full,
        "starts": starts, "goal": asked, "free": free,
    }  # fmt: skip
    return from_dict({
        "schema": 1, "title": "four-bar", "parameters": numbers | ({"th": 0.0} if weld else {}),
        "ground": {"points": points}, "bodies": bodies, "joints": joints,
        "sketch": {"crank_deg": 60, "coupler_deg": 20, "rocker_deg": 80},
        "tasks": {"design": task},
    })  # fmt: skip
