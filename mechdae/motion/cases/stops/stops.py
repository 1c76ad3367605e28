"""Where joints are beyond their limits, and where a motion meets a stop."""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.joints.joint import LIMITS
from mechdae.describe.joints.limits import limited
from mechdae.equations.reduction import Scene
from mechdae.kernels.run.functions import Batch
from mechdae.motion.assembly.not_assembled import shown
from mechdae.motion.kinematics.finds import SoughtOutput, at_place, named_poses, samples
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.types import Booleans, Floats, Json, Matrix, Unknowns

ROOM = 1e-9
"""By how much a joint may be beyond a limit by rounding [rad, sizes of the mechanism]."""
TURN = 2 * np.pi
FREE = ("swing", "stroke", "limits")
"""What a summary says of the whole motion."""


class Stops:
    """The joints of a scene that have limits.

    An angle is within its limits if it is but for whole turns, unless the limits are a turn apart.
    """

    def __init__(self, scene: Scene) -> None:
        model = scene.model
        named = [name for group in scene.groups for name in group.joints]
        joints = [joint for joint in limited(model.mechanism.joints) if joint.name in named]
        self.coordinates: list[NamedCoordinate] = [
            coordinate(model.mechanism, f"{joint.name}.{joint.usual}") for joint in joints
        ]
        self.angles: Booleans = np.array([c.is_angle for c in self.coordinates])
        rows = [scene.expression(model.coordinate(c)) for c in self.coordinates]
        rows += [model.numbers[f"{joint.name}.{end}"] for end in LIMITS for joint in joints]
        function = ca.Function(
            "stops", [scene.x, scene.u, model.p], [ca.densify(ca.vertcat(*rows))]
        )
        self._values = Batch(function, shared=[2])

    def off(self, x: Unknowns, u: Floats, p: Floats) -> tuple[Matrix, Matrix, Matrix]:
        """Return distances from the middle of the limits (n, k), half their widths, middles."""
        value, low, high = np.split(self._values(x, u, p)[0], 3, axis=1)
        middle, half = (low + high) / 2, (high - low) / 2
        off = value - middle
        whole = np.where(self.angles & (half < np.pi), TURN * np.round(off / TURN), 0.0)
        return off - whole, half, middle

    def over(self, scale: float, x: Unknowns, u: Floats, p: Floats) -> Matrix:
        """Return which limits poses are beyond (n, k): 1 the greatest, -1 the least, 0 none."""
        off, half, _ = self.off(x, u, p)
        room = ROOM * np.where(self.angles, 1.0, scale)
        with np.errstate(invalid="ignore"):
            return np.where(np.abs(off) > half + room, np.sign(off), 0.0)

    def sentence(self, k: int, side: float, middle: float, half: float) -> str:
        """Return which limit a joint is beyond."""
        c = self.coordinates[k]
        word, end = c.text.rpartition(".")[2], "greatest" if side > 0 else "least"
        return f"joint {c.part} is beyond its {end} {word} of {shown(c.unit, middle + side * half)}"


def _stops(scene: Scene) -> Stops:
    found: Stops = scene.cache("stops", lambda: Stops(scene))
    return found


def beyond(scene: Scene, x: Unknowns, u: Floats, p: Floats) -> dict[int, str]:
    """Return which limit poses (n, nx) are beyond, by row."""
    stops = _stops(scene)
    over = stops.over(scene.model.mechanism.scale, x, u, p)
    rows = np.flatnonzero(over.any(axis=1))
    _, half, middle = stops.off(x, u, p) if rows.size else (over,) * 3
    firsts = {int(n): int(np.flatnonzero(over[n])[0]) for n in rows}
    return {n: stops.sentence(k, over[n, k], middle[n, k], half[n, k]) for n, k in firsts.items()}


def mark(setting: Setting, run: Run) -> None:
    """Mark the poses of a run with joints beyond their limits, with events where they meet one."""
    scene, p = setting.scene, setting.assembler.p
    stops = _stops(scene)
    over = stops.over(scene.model.mechanism.scale, run.poses.x, run.values, p)
    _, half, middle = (part[0] for part in stops.off(run.poses.x[:1], run.values[:1], p))
    sentences = []
    for k in np.flatnonzero(over.any(axis=0)).tolist():
        rows = np.flatnonzero(over[:, k])
        text = stops.sentence(k, over[rows[0], k], middle[k], half[k])
        more = f" and {len(rows) - 1} more poses" if len(rows) > 1 else ""
        sentences.append(f"{text} at {named_poses(setting, run, rows[:1])}{more}")
    if len(run.values) > 1:
        for k in range(len(stops.coordinates)):
            run.events += _met(setting, run, stops, k)
    meets = sorted({event["joint"] for event in run.events if event["kind"] == "stop"})
    for name in FREE if meets or sentences else ():
        run.summary.pop(name, None)  # of the motion without stops
    if meets:
        run.found.notes.append(f"{', '.join(FREE)} are not given: {', '.join(meets)} meets a stop")
    if sentences:
        run.stopped, run.fault = np.array(over.any(axis=1)), "; ".join(sentences)
        run.summary["stopped"] = [
            stops.coordinates[k].part for k in np.flatnonzero(over.any(axis=0))
        ]


def _met(setting: Setting, run: Run, stops: Stops, k: int) -> list[Json]:
    """Return events where a joint is at a limit on a path."""
    p = setting.assembler.p

    def off(s: Floats) -> tuple[Floats, Floats, Floats, float, float]:
        poses = run.evaluator.at(run.path, s)
        off, half, middle = stops.off(poses.x, run.path.drivers(s), p)
        return off[:, k], poses.condition, poses.places, half[0, k], middle[0, k]

    def margin(s: Floats) -> tuple[Floats, Floats, Floats]:
        away, condition, places, half, _ = off(s)
        return half - np.abs(away), condition, places

    events = list[Json]()
    for place, bound, sense in SoughtOutput.along(samples(run), margin).crossings(0.0):
        away, _, _, half, middle = off(np.array([place]))
        side, c = float(np.sign(away[0])), stops.coordinates[k]
        event = {"kind": "stop", **at_place(setting, run, place), "bound": bound, "in_range": True}
        event |= {
            "joint": c.part,
            "name": c.text,
            "of": c.text,
            "value": float(middle + side * half),
        }
        events.append(event | {"direction": "up" if side * sense < 0 else "down"})
    return events
