"""Computes the measures of a sweep: at its poses, and along its path."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING

from mechdae.describe.coordinate_kinds import ANGLE, UNIT
from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import GROUND
from mechdae.describe.tasks.kinds import Sweep
from mechdae.equations.reduction import Scene
from mechdae.errors import InputError, UnavailableError
from mechdae.motion.continuation.evaluate import Evaluator, Poses
from mechdae.motion.continuation.path import Path
from mechdae.motion.measures import bars, centres, curve, ratios, screws, transmission
from mechdae.motion.measures.along_sweep_extremes import AT_REST, Course, courses, quantities
from mechdae.motion.measures.dwell import dwells
from mechdae.motion.measures.measured import OF_POSES, Measured
from mechdae.motion.measures.strokes import time_ratios
from mechdae.motion.measures.track import Track
from mechdae.motion.setup.outputs import Outputs, Request

if TYPE_CHECKING:
    from mechdae.types import Floats, Json


ALONG = ("extremes", "time-ratio", "dwell", "envelope")
"""Measures that follow the path of a single driver."""
BY_DRIVER = (*ALONG, *ratios.NAMES)
"""Measures that are by the value of a single driver."""
TURNED = "turn of "


def requests(scene: Scene, task: Sweep, by_value: bool) -> list[Request]:
    """Return what the measures of a task need evaluated beside what is reported."""
    measures = task.measures or ()
    along = [name for name in measures if name in BY_DRIVER]
    if along and not by_value:
        raise UnavailableError(
            f"'{along[0]}' needs a single driver that moves, by at, from and to, or range",
            where="measures",
            hint="leave it out",
        )
    found = []
    if "transmission" in measures:
        found += _transmission(scene).requests(scene)
    if {"axodes", "screw-axes"} & set(measures):
        found += screws.requests(scene)
    if "centrodes" in measures or "instant-centres" in measures:
        found += centres.requests(scene, "instant-centres" in measures)
    if set(measures) - OF_POSES and by_value:
        found += _turning(scene)
    return found


def _transmission(scene: Scene) -> ModuleType:
    """Return the module that reads transmission angles off a scene: in space they are of bars."""
    return transmission if scene.model.mechanism.dimension == 2 else bars


def _turning(scene: Scene) -> list[Request]:
    """Return the angles of all bodies, in space those of the joints that place them.

    Where a body hangs on a quaternion its components are doubled: they change no faster than it
    turns.
    """
    inside = centres.bodies_of(scene)
    if scene.model.mechanism.dimension == 2:
        return [(TURNED + name, scene.model.frame(name).angle, (name,)) for name in inside]
    joints, found = scene.model.mechanism.joints, []
    for c in scene.model.coordinates:
        bodies = joints[c.owner].bodies if c.owner in joints else (c.owner,)
        bodies = tuple(body for body in bodies if body != GROUND)
        if c.kind in (ANGLE, UNIT) and set(bodies) <= set(inside):
            name = f"{TURNED}{c.owner}.{c.name}"
            found.append((name, (1 if c.kind is ANGLE else 2) * c.symbol, bodies))
    return found


def at_poses(
    outputs: Outputs, asked: Sequence[str], poses: Poses, unit: float, moving: int, found: Measured
) -> None:
    """Add the measures of single poses to `found`; `unit` is what a radian is for other drivers."""
    scale = outputs.scene.model.mechanism.scale
    if "transmission" in asked:
        found.put("joints", _transmission(outputs.scene).angles(outputs, poses.y[0]))
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
    if of_driver := set(asked) & set(ratios.NAMES):
        driver = outputs.scene.drivers[moving]
        of_parts = ratios.ratios(outputs, of_driver, poses.y[1], driver, unit)
        for kind, parts in of_parts.items():
            found.put(kind, parts)
    if {"axodes", "screw-axes"} & set(asked):
        twists = screws.Twists(outputs, poses.y[:2], scale, unit)
    if "axodes" in asked:
        surfaces, facts = screws.axodes(twists, outputs.scene.selection.bodies)
        found.put("bodies", surfaces)
        found.summary |= {"axodes": facts} if facts else {}
    if "screw-axes" in asked:
        found.centres, far = screws.screw_axes(twists)
        if far:
            found.summary["centres_at_infinity"] = far


def along_path(
    outputs: Outputs,
    task: Sweep,
    evaluator: Evaluator,
    path: Path,
    values: Floats,
    found: Measured,
    moving: int,
) -> None:
    """Add the measures of the whole sweep of the driver that moves to `found`."""
    measures = task.measures or ()
    scene = outputs.scene
    mechanism = scene.model.mechanism
    turns = outputs.columns(name for name, _, _ in _turning(scene))
    driver = scene.drivers[moving]
    track = Track(evaluator, path, values, driver.is_angle, mechanism.scale, turns)
    summary = found.summary
    if "curve" in measures:
        facts, cusps = curve.curves(track, outputs)
        summary |= {"curve": facts} if facts else {}
        found.events += cusps
    if track.high == track.low:
        alone = [name for name in measures if name in (*ALONG, "transmission")]
        if alone:
            text = f"{', '.join(alone)}: over a single value of the driver there is no range"
            found.notes.append(text)
        return
    if "transmission" in measures:
        summary["transmission"] = _transmission(scene).summary(track, outputs)
    if "centrodes" in measures:
        summary["centrodes"] = centres.at_infinity(track, outputs, turns)
    wanted = quantities(outputs)
    followed = courses(track, wanted) if set(measures) & set(ALONG) else {}
    if "extremes" in measures:
        summary["extremes"] = extremes(track, followed)
        found.events += _once(stationary_events(followed))
    if "time-ratio" in measures:
        summary |= time_ratios(track, [q for q in wanted if q.name != driver.text])
    if "dwell" in measures:
        share = evaluate(task.dwell_tolerance, mechanism.parameter_values)
        if not 0 < share < 0.5:
            raise InputError(
                f"a share of the swing between 0 and 0.5 is needed, not {share:g}",
                where="dwell_tolerance",
                hint="0.01 is a band of 2 % of it",
            )
        summary["dwell"] = dwells(track, followed, share)
    if "envelope" in measures:
        summary["envelope"] = envelope(followed)
    if track.lost:
        found.notes.append(f"measures: {track.lost} places of the path were not certified")


def _once(events: list[Json]) -> list[Json]:
    """Return one event of a quantity at a place: a rest is met on all pieces that it joins."""
    found = {(event.get("of"), event["at"]): event for event in reversed(events)}
    return list(reversed(found.values()))


def extremes(track: Track, courses: dict[str, Course]) -> dict[str, dict[str, dict[str, float]]]:
    """Return name -> {"min": {"value", "at", "error"}, "max": {...}} of everything that moves."""
    found = {}
    for name, course in courses.items():
        low, high = course.extreme(-1), course.extreme(1)
        if course.moves and low is not None and high is not None:
            size = 1.0 if course.quantity.is_angle else track.scale
            errors = track.errors([low.place, high.place], course.quantity.column)
            rests = [AT_REST * size if place.rest else 0.0 for place in (low, high)]
            found[name] = {
                word: {"value": place.value, "at": place.at, "error": float(error + rest)}
                for word, place, error, rest in zip(
                    ("min", "max"), (low, high), errors, rests, strict=True
                )
            }
    return found


def stationary_events(courses: dict[str, Course]) -> list[Json]:
    """Return the stationary positions (dead points) of bodies and slides as events."""
    return [
        {
            "kind": "stationary",
            "of": name,
            "at": place.at,
            "value": place.value,
            "extreme": "max" if place.sense > 0 else "min",
            "in_range": True,
            **({"rest": list(place.rest)} if place.rest else {}),
        }
        for name, course in courses.items()
        if course.quantity.is_output
        for place in course.stationary
    ]


def envelope(courses: dict[str, Course]) -> Json:
    """Return the box [xmin, xmax, ymin, ymax] swept by the points: of all, and by body.

    In space zmin and zmax follow.
    """
    boxes: dict[str, list[float]] = {}
    axes = {name[-1] for name, course in courses.items() if not course.quantity.is_output}
    for name, course in courses.items():
        part, _, axis = name.rpartition(".")
        low, high = course.extreme(-1), course.extreme(1)
        if course.quantity.is_output or low is None or high is None:
            continue
        first = 2 * "xyz".index(axis)
        for key in ("all", f"bodies/{part.split('.')[0]}"):
            box = boxes.setdefault(key, [float("inf"), -float("inf")] * len(axes))
            box[first] = min(box[first], low.value)
            box[first + 1] = max(box[first + 1], high.value)
    if not boxes:
        return {}
    bodies = {key.removeprefix("bodies/"): box for key, box in boxes.items() if key != "all"}
    return {"all": boxes["all"], "bodies": bodies}
