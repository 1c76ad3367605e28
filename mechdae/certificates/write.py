"""Writes a certificate: the mechanism, the steps of its path and its poses as exact numbers."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

import mechdae
from mechdae.certificates.crossings import meeting
from mechdae.certificates.in_balls import (
    check_count,
    complex_poses,
    left_out,
    looked_at,
    names_of,
    refined_mode,
    refined_path,
)
from mechdae.certificates.mechanism import (
    Formula,
    Frames,
    as_text,
    formulas,
    planar_mechanism_of,
)
from mechdae.certificates.space import SpatialFrames, spatial_mechanism_of
from mechdae.certificates.superfluous import steps_of, with_motion
from mechdae.continuation.legs import Legs
from mechdae.continuation.path import Path
from mechdae.continuation.reachable_arc import Arc, arc_of
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driver, Modes, Sweep
from mechdae.errors import UnavailableError
from mechdae.kinematics.modes_task import modes
from mechdae.kinematics.prepared import Run, Setting, prepare
from mechdae.kinematics.report import report
from mechdae.kinematics.sweep import run
from mechdae.model.reduction import Scene
from mechdae.results import ModesResult, Result, Status
from mechdae.setup.drivers import plan

BEFORE = 1e-3
"""Share of the largest step before a limit position from which on the way into it begins."""
MOST_NODES = 24
"""Steps of a path that are written down; the check takes each in as many parts as it needs."""
MOST_STEPS = 20000
"""Steps of a path across change points whose check takes some minutes."""


def certificate_of(problem: Problem, name: str) -> dict[str, Any]:
    """Return the certificate of a task as plain data; it is not checked yet.

    Raises
    ------
    UnavailableError
        The task, or a joint of it, is none of those that certificates are written for.
    """
    task = problem.task(name)
    content = {
        "certificate": 2,
        "mechdae": mechdae.__version__,
        "problem": problem.name,
        "task": name,
    }
    if isinstance(task, Sweep) and task.kind == "sweep":
        return content | _sweep(problem, name, task)
    if isinstance(task, Modes):
        return content | _modes(problem, name, task)
    raise UnavailableError(
        f"no certificate is written of a task of kind '{task.kind}'",
        where=f"tasks.{name}",
        hint="tasks of kind sweep and modes have one",
    )


def _groups(groups: Any, bodies: Any) -> list[list[str]]:
    """Return the bodies of each group that has any: links that turn freely have no place."""
    found = [[body for body in group.bodies if body in bodies] for group in groups]
    return [own for own in found if own]


def mechanism_of_task(problem: Problem, name: str) -> dict[str, Any]:
    """Return the mechanism of a task as its certificate has it."""
    task = problem.task(name)
    if isinstance(task, Sweep):
        setting = prepare(problem, task)
        done = run(setting, task)
        return mechanism_of(setting.scene, _laws(setting, done.path))
    setting, u = _at_pose(problem, task)
    return mechanism_of(setting.scene, _values(setting, u))


def mechanism_of(scene: Scene, laws: dict[str, Formula]) -> dict[str, Any]:
    """Return bodies, joints and drivers of a scene; of each driver its law."""
    spatial = scene.model.mechanism.dimension == 3
    return (spatial_mechanism_of if spatial else planar_mechanism_of)(scene, laws)


def _frames(scene: Scene, mechanism: dict[str, Any]) -> Frames | SpatialFrames:
    if "dimension" in mechanism:
        return SpatialFrames(scene, names_of(mechanism))
    return Frames(scene, mechanism["bodies"])


def _laws(setting: Setting, path: Any) -> dict[str, Formula]:
    """Return the law of each driver along a path."""
    names = [driver.text for driver in setting.scene.drivers]
    course = setting.graphs.course
    if course is not None:
        if course.switches.numel():
            raise UnavailableError("no certificate is written of laws with corners")
        own = formulas(ca.Function("law", [course.s], [ca.densify(course.smooth)]))
    elif isinstance(path, Legs):
        if setting.scene.model.mechanism.dimension == 2:
            raise UnavailableError("no certificate is written of poses by name")
        corners = path.corners.T if len(path.corners) > 1 else np.tile(path.corners.T, 2)
        own = [[as_text(value) for value in row] for row in corners]
    else:
        pairs = zip(path.u0, path.d, strict=True)
        own = ["s" if (u, d) == (0, 1) else _line(u, d) for u, d in pairs]
    return dict(zip(names, own, strict=True))


def _line(start: float, slope: float) -> Formula:
    return ["+", as_text(start), ["*", as_text(slope), "s"]]


def _values(setting: Setting, u: Any) -> dict[str, Formula]:
    """Return the values of the drivers at a pose: a single one is the parameter."""
    names = [driver.text for driver in setting.scene.drivers]
    return {names[0]: "s"} if len(names) == 1 else dict(zip(names, map(as_text, u), strict=True))


def _sweep(problem: Problem, name: str, task: Sweep) -> dict[str, Any]:
    """Return path and poses of a sweep."""
    where = f"tasks.{name}"
    setting = prepare(problem, task)
    mechanism_of(setting.scene, {})  # what is refused is refused before the poses are computed
    done = run(setting, task)
    mechanism = mechanism_of(setting.scene, _laws(setting, done.path))
    if setting.scene.redundant and "dimension" not in mechanism:
        return _closed_sweep(problem, name, task, (setting, done, mechanism))
    arc, frames = arc_of(done.path), _frames(setting.scene, mechanism)
    limits = any(end is not None and end.kind == "limit" for end in arc.limits)
    zones = done.path.zones
    if zones and ("dimension" in mechanism or limits or isinstance(done.path, Legs)):
        raise UnavailableError(
            "no certificate is written of a motion across change points in space, along legs, or "
            "to limit positions",
            where=where,
        )
    if any(zone.action == "switch" for zone in zones):
        raise UnavailableError(
            "no certificate is written of a motion that turns off at a change point", where=where
        )
    if isinstance(done.path, Path):
        path = _path(done.path, arc, frames, done.places, mechanism)
    else:
        assert isinstance(done.path, Legs)
        path = _corners(done.path, arc, frames)
    if setting.scene.redundant:
        middle = [path, *path["steps"]][len(path["steps"]) // 2]
        at = middle["to"] if "to" in middle else middle["at"]
        mechanism["superfluous"] = left_out(mechanism, middle["bodies"], at)
    return {
        "kind": "sweep",
        "mechanism": mechanism,
        "path": refined_path(mechanism, path),
        "poses": _poses(
            report(problem, name, task, setting, done), done, arc, path, mechanism["bodies"]
        ),
    }


def _closed_sweep(
    problem: Problem, name: str, task: Sweep, ran: tuple[Setting, Run, dict[str, Any]]
) -> dict[str, Any]:
    """Return motion in closed form and poses of a planar sweep with superfluous equations."""
    setting, done, mechanism = ran
    path, arc = done.path, arc_of(done.path)
    if not isinstance(path, Path) or any(end is not None for end in (arc.low, arc.high)):
        raise UnavailableError(
            "no certificate is written of superfluous equations along a path that ends, or legs"
        )
    k = len(path.s) // 2
    at, frames = np.array([path.s[k]]), _frames(setting.scene, mechanism)
    bodies = frames.at(path.state[k][: path.graphs.nx], path.drivers(at)[0])
    groups = _groups(setting.scene.groups, mechanism["bodies"])
    mechanism, _ = with_motion(mechanism, groups, bodies, as_text(at[0]))
    told = report(problem, name, task, setting, done)
    crossings = [zone.s for zone in path.zones]
    way = steps_of(float(min(done.places)), float(max(done.places)), crossings)
    poses = _poses(told, done, arc, way, mechanism["bodies"])
    return {"kind": "sweep", "mechanism": mechanism, "path": way, "poses": poses}


def _path(
    path: Path,
    arc: Arc,
    frames: Frames | SpatialFrames,
    places: Any,
    mechanism: dict[str, Any],
) -> dict[str, Any]:
    """Return the nodes of a path inside its arc, and the limit positions that end it.

    Where all is linear in the drivers' values there are none: the ends of the poses' `places`.
    """
    nx, ends = path.graphs.nx, [end.s for end in arc.limits if end is not None]
    known = [
        (s, state)
        for s, state in zip(path.s, path.state, strict=True)
        if arc.first <= s <= arc.last and all(abs(s - end) > BEFORE * path.largest for end in ends)
    ]
    inside = [s for s in places if arc.first <= s <= arc.last]
    if inside:  # the way on towards a singular pose proves nothing of the poses
        low, high = (end is not None and end.kind != "limit" for end in arc.limits)
        first = max((s for s, _ in known if s <= min(inside)), default=-np.inf)
        last = min((s for s, _ in known if s >= max(inside)), default=np.inf)
        known = [
            row for row in known if (not low or row[0] >= first) and (not high or row[0] <= last)
        ]
    zones = {zone.low: zone for zone in path.zones}
    known = [row for row in known if not any(z.low < row[0] < z.high for z in path.zones)]
    if not nx:
        reached = {*path.s, float(np.min(places)), float(np.max(places))}
        known = [(s, np.zeros(0)) for s in sorted(reached)]
    nodes = [
        {"at": as_text(s), "bodies": frames.at(state[:nx], path.drivers(np.array([s]))[0])}
        for s, state in known
    ]
    if not nodes:
        raise UnavailableError("no certificate is written of a pose at a limit position alone")
    if not zones:
        nodes = _thinned(nodes)
    steps = _steps(path, known, zones) if zones else 1
    if steps > MOST_STEPS:
        raise UnavailableError(
            f"no certificate is written of a path that takes about {steps} steps to check: it "
            "leads across change points to a singular pose"
        )
    found: dict[str, Any] = {**nodes[0], "steps": []}
    for (s, _), (before, after) in zip(known, pairwise(nodes), strict=False):
        step = {"from": before["at"], "to": after["at"], "bodies": after["bodies"]}
        if s in zones:
            place, x = zones[s].s, zones[s].nodes[1][1]
            bodies = frames.at(x, path.drivers(np.array([place]))[0])
            step["through"] = meeting(mechanism, bodies, place)
        found["steps"].append(step)
    for word, end in (("low", arc.low), ("high", arc.high)):
        if end is not None and end.kind == "limit":
            at = np.array([end.s])
            bodies = frames.at(path.guess(at)[0], path.drivers(at)[0])
            found[word] = {"at": as_text(end.s), "bodies": bodies}
    return found


def _corners(path: Legs, arc: Arc, frames: Frames | SpatialFrames) -> dict[str, Any]:
    """Return the corners of a path of legs that it comes to."""
    nodes = [
        {"at": str(k), "bodies": frames.at(x, path.corners[k])}
        for k, x in enumerate(path.nodes)
        if arc.holds(k)
    ]
    steps = [{"from": a["at"], "to": b["at"], "bodies": b["bodies"]} for a, b in pairwise(nodes)]
    return nodes[0] | {"steps": steps}


def _thinned(nodes: list[Any]) -> list[Any]:
    """Return the first node, the last one, and so many between that they make `MOST_NODES` steps.

    Nodes lie closer where the way is harder.
    """
    count = min(MOST_NODES, len(nodes) - 1)
    return [nodes[k * (len(nodes) - 1) // max(count, 1)] for k in range(count + 1)]


def _steps(path: Path, known: list[tuple[float, Any]], zones: dict[float, Any]) -> int:
    """Return about how many steps around tangents lead along the nodes of a path.

    As many as a step at whose beginning the test is passed goes into the way to the next node,
    one across a change point.
    """
    count = 0
    for (s, state), (to, _) in pairwise(known):
        parts = 1
        while s not in zones and parts < MOST_STEPS:
            if np.all(path.step(state, s, (to - s) / parts)[1] <= 1):
                break
            parts *= 2
        count += parts
    return count


def _poses(
    result: Result, done: Run, arc: Arc, path: dict[str, Any], bodies: Any
) -> list[dict[str, Any]]:
    """Return what is claimed of each pose: its place, points, angles, and their bounds.

    Of poses that are reached whole turns of the driver away, and of those between the last step
    and a limit position, nothing is claimed.
    """
    found, values = [], done.places
    names = [driver.text for driver in done.evaluator.graphs.scene.drivers]
    first, last = Fraction(path["at"]), Fraction([path, *path["steps"]][-1].get("to", path["at"]))
    ends = {-1: "low", 1: "high"}
    for k, (value, met) in enumerate(zip(values, arc.met(values), strict=True)):
        status = str(result.status[k])
        on_path = first <= Fraction(float(value)) <= last
        claim: dict[str, Any] = {"pose": k, "at": as_text(value), "status": status}
        if status == Status.LIMIT.value and met:
            found.append(claim | {"end": ends[met]} | reported(result, k, bodies))
        elif status == Status.OK.value and on_path:
            if isinstance(done.path, Path) and (len(names) > 1 or done.values[k, 0] != value):
                told = dict(zip(names, map(as_text, done.values[k]), strict=True))
                claim["drivers"] = told
            found.append(claim | reported(result, k, bodies))
        elif status == Status.UNASSEMBLED.value and _beyond(arc, value):
            found.append(claim)
    return found


def _beyond(arc: Arc, value: float) -> bool:
    """Whether a driver value lies behind a limit position of the arc."""
    low, high = (end is not None and end.kind == "limit" for end in arc.limits)
    return (low and value < arc.first) or (high and value > arc.last)


def reported(result: Result, k: int, bodies: Any) -> dict[str, Any]:
    """Return points of these bodies, angles or orientations and bounds of a pose as reported.

    Of spatial modes that are reported without bounds none of these are told.
    """
    points = {
        name: [as_text(v) for v in series.position[k]]
        for name, series in result.points.items()
        if name.split(".")[0] in bodies
    }
    bounds = {word: result.bound[word][k] for word in result.bound}
    if not np.isfinite([*bounds.values()]).all():
        if result.mechanism.dimension == 3 and isinstance(result, ModesResult):
            return {"points": {}, "bound": {}, "orientations": {}}
        raise UnavailableError(
            "no certificate is written of a mode that is next to a singular pose"
        )
    bound = {word: as_text(value) for word, value in bounds.items()}
    told: dict[str, Any] = {"points": points, "bound": bound}
    if result.mechanism.dimension == 3:
        turns = {name: [as_text(v) for v in s.orientation[k]] for name, s in result.bodies.items()}
        return told | {"orientations": turns}
    angles = {name: as_text(series.angle[k]) for name, series in result.bodies.items()}
    return told | {"angles": angles}


def _at_pose(problem: Problem, task: Any) -> tuple[Setting, Any]:
    """Return the scene of all bodies at the pose of a task of modes, and its driver value (1,)."""
    numbers = plan(problem.mechanism, task)
    if numbers.values is None or len(numbers.values) != 1:
        raise UnavailableError("no certificate is written of modes at several poses")
    u = numbers.values[0]
    drivers = tuple(
        Driver(c.text, at=(float(value),), speed=0.0)
        for c, value in zip(numbers.coordinates, u, strict=True)
    )
    return prepare(problem, Sweep(drivers=drivers, outputs=task.outputs, derivatives=0)), u


def _modes(problem: Problem, name: str, task: Modes) -> dict[str, Any]:
    """Return all modes at one pose, and all complex poses, which prove that there are no others."""
    setting, u = _at_pose(problem, task)
    mechanism = mechanism_of(setting.scene, _values(setting, u))
    groups = _groups(setting.scene.groups, mechanism["bodies"])
    wide = bool(setting.scene.redundant) and "dimension" not in mechanism
    proof = "" if wide else check_count(mechanism, groups)  # refusals come before all else
    result = modes(problem, name, task)
    frames = _frames(setting.scene, mechanism)
    every, _, _ = setting.assembler.modes(u, by_paths=True)
    if wide and every:
        mechanism, groups = with_motion(mechanism, groups, frames.at(every[0].x, u), as_text(u[0]))
    elif setting.scene.redundant and every:
        first = frames.at(every[0].x, u)
        mechanism["superfluous"] = left_out(mechanism, first, as_text(u[0]))
    if setting.assembler.free and not setting.scene.redundant:
        names = ", ".join(sorted({group.name for group in setting.assembler.free}))
        raise UnavailableError(
            "no certificate is written of modes beside poses in which bodies move by themselves: "
            f"{names}",
            hint="such poses are not alone: no count proves that there are no others",
        )
    if len(result.status) < len(every):
        raise UnavailableError("no certificate is written of some modes only", where="limit")
    labelled = [
        (setting.assembler.labelled(group), bool(_groups([group], mechanism["bodies"])))
        for group in setting.scene.groups
    ]
    found = []
    for k, mode in enumerate(every):
        labels = iter(mode.labels)
        told = [(next(labels)[0] + "1" if own else "1", there) for own, there in labelled]
        signs = [str(int(sign)) for sign, there in told if there]
        claim = {"label": mode.label, "bodies": frames.at(mode.x, u), "signs": signs}
        claim = refined_mode(mechanism, claim, as_text(u[0]))
        found.append(claim | reported(result, k, mechanism["bodies"]))
    content = {
        "kind": "modes",
        "at": as_text(u[0]),
        "mechanism": mechanism,
        "groups": groups,
    }
    solved = [group for runs in setting.assembler.counted.values() for group in runs]
    try:
        every_pose = [] if proof else complex_poses(content, found, solved)
    except UnavailableError:
        proof = looked_at(mechanism, groups)
        if not proof:
            raise
    if proof:
        return content | {"proof": proof, "modes": found}
    if wide:  # where the motion is, and what no determinant has
        found = [{key: mode[key] for key in mode.keys() - {"bodies", "signs"}} for mode in found]
    return content | {"modes": found, "complex": every_pose}
