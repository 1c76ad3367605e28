"""Computes the measures that a task lists."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any

import numpy as np

from mechdae.continuation.evaluate import Evaluator, Poses
from mechdae.continuation.path import Path
from mechdae.describe.expression import evaluate
from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import InputError, UnavailableError
from mechdae.measures import centres, curve, transmission
from mechdae.measures.courses import courses, quantities
from mechdae.measures.dwell import dwells
from mechdae.measures.extremes import envelope, extremes, stationary_events
from mechdae.measures.strokes import time_ratios
from mechdae.measures.track import Track
from mechdae.model.reduction import Scene
from mechdae.records import dataclass
from mechdae.setup.outputs import Outputs, Request

ORDERS = {
    "transmission": 2,
    "extremes": 2,
    "time-ratio": 2,
    "dwell": 2,
    "envelope": 2,
    "curve": 3,
    "centrodes": 2,
    "instant-centres": 1,
}
"""Rates that each measure needs."""
ALONG = ("extremes", "time-ratio", "dwell", "envelope")
"""Measures that follow the path of a single driver."""
TURNED = "turn of "


@dataclass
class Measured:
    """Series by kind, part and name; pairs of bodies; entries of the summary; events."""

    series: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    centres: dict[str, Any] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    events: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def put(self, kind: str, parts: dict[str, dict[str, Any]]) -> None:
        for part, arrays in parts.items():
            self.series.setdefault(kind, {}).setdefault(part, {}).update(arrays)


def order_of(task: Sweep) -> int:
    """Return the highest order of rates that the task's measures need."""
    return max((ORDERS[name] for name in task.measures or ()), default=0)


def requests(scene: Scene, task: Sweep, by_value: bool) -> list[Request]:
    """Return what is evaluated for the measures beside what is reported.

    `by_value` tells that one driver moves and no law moves it.

    Raises
    ------
    UnavailableError
        A measure along the path without such a driver.
    """
    asked = task.measures or ()
    along = [name for name in asked if name in ALONG]
    if along and not by_value:
        raise UnavailableError(
            f"'{along[0]}' needs a single driver that moves, by at, from and to, or range",
            where="measures",
            hint="leave it out",
        )
    found = []
    if "transmission" in asked:
        found += transmission.requests(scene)
    if "centrodes" in asked or "instant-centres" in asked:
        found += centres.requests(scene, "instant-centres" in asked)
    if set(asked) - {"instant-centres"} and by_value:
        for name in centres.bodies_of(scene):
            found.append((TURNED + name, scene.model.frame(name).angle, (name,)))
    return found


def at_poses(outputs: Outputs, task: Sweep, poses: Poses, unit: float = 1.0) -> Measured:
    """Return the measures of single poses; `unit` is what a radian is for other drivers."""
    found, asked = Measured(), task.measures or ()
    scale = outputs.scene.model.mechanism.scale
    if "transmission" in asked:
        found.put("joints", transmission.angles(outputs, poses.y[0]))
    if "curve" in asked:
        found.put("points", curve.directions(outputs, poses.y, unit))
    if "centrodes" in asked or "instant-centres" in asked:
        planes = centres.Planes(outputs, poses.y[:2], scale)
    if "centrodes" in asked:
        found.put("bodies", centres.centrodes(planes, outputs.scene.selection.bodies))
    if "instant-centres" in asked:
        found.centres, far = centres.instant_centres(planes)
        if far:
            found.summary["centres_at_infinity"] = far
    return found


def along_path(
    outputs: Outputs,
    task: Sweep,
    evaluator: Evaluator,
    path: Path,
    values: Any,
    found: Measured,
    moving: int,
) -> None:
    """Add the measures of the whole sweep of the driver that moves to `found`."""
    asked = task.measures or ()
    if not set(asked) - {"instant-centres"}:
        return
    scene = outputs.scene
    mechanism = scene.model.mechanism
    turns = outputs.columns(TURNED + name for name in centres.bodies_of(scene))
    driver = scene.drivers[moving]
    track = Track(evaluator, path, values, driver.is_angle, mechanism.scale, turns)
    summary = found.summary
    if "curve" in asked:
        facts, cusps = curve.curves(track, outputs)
        summary |= {"curve": facts} if facts else {}
        found.events += cusps
    if track.high == track.low:
        alone = [name for name in asked if name in (*ALONG, "transmission")]
        if alone:
            text = f"{', '.join(alone)}: over a single value of the driver there is no range"
            found.notes.append(text)
        return
    if "transmission" in asked:
        summary["transmission"] = transmission.summary(track, outputs)
    if "centrodes" in asked:
        summary["centrodes"] = centres.at_infinity(track, outputs, turns)
    wanted = quantities(outputs)
    followed = courses(track, wanted) if set(asked) & set(ALONG) else {}
    if "extremes" in asked:
        summary["extremes"] = extremes(track, followed)
        found.events += _once(stationary_events(followed))
    if "time-ratio" in asked:
        summary |= time_ratios(track, [q for q in wanted if q.name != driver.text])
    if "dwell" in asked:
        share = evaluate(task.dwell_tolerance, mechanism.parameter_values)
        if not 0 < share < 0.5:
            raise InputError(
                f"a share of the swing between 0 and 0.5 is needed, not {share:g}",
                where="dwell_tolerance",
                hint="0.01 is a band of 2 % of it",
            )
        summary["dwell"] = dwells(track, followed, share)
    if "envelope" in asked:
        summary["envelope"] = envelope(followed)
    if track.lost:
        found.notes.append(f"measures: {track.lost} places of the path were not certified")


def _once(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one event of a quantity at a place: a rest is met on all pieces that it joins."""
    found = {(event.get("of"), event["at"]): event for event in reversed(events)}
    return list(reversed(found.values()))


def sorted_events(events: Iterable[Mapping[str, Any]], moving: int = 0) -> list[Mapping[str, Any]]:
    """Return events in the order of time, or of the driver that moves."""
    return sorted(events, key=lambda e: float(e.get("time", np.ravel(e["at"])[moving])))
