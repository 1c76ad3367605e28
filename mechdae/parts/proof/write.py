"""Writes a certificate: the mechanism, the steps of its path and its poses as exact numbers."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

import mechdae
from mechdae.describe import Driver, Problem, Sweep
from mechdae.describe.mechanism import TOLERANCE
from mechdae.describe.tasks.kinds import Modes
from mechdae.equations.reduction import Scene
from mechdae.errors import UnavailableError
from mechdae.motion.continuation.any_path import Arc, arc_of
from mechdae.motion.continuation.legs import Legs
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.modes_task import modes
from mechdae.motion.kinematics.prepared import Run, Setting, prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.motion.setup.drivers import plan
from mechdae.parts.proof.checker import has_curves
from mechdae.parts.proof.in_balls import (
    check_count,
    complex_poses,
    left_out,
    looked_at,
    names_of,
    refined_mode,
    refined_path,
)
from mechdae.parts.proof.mechanism import (
    Formula,
    Frames,
    as_text,
    formulas,
    planar_mechanism_of,
)
from mechdae.parts.proof.paths import corners_of, path_of
from mechdae.parts.proof.space import SpatialFrames, spatial_mechanism_of
from mechdae.parts.proof.superfluous import steps_of, with_motion
from mechdae.results import ModesResult, Result, Status
from mechdae.types import Floats, Json, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.groups import Group


LOOKED_AT = 64
"""Places of a path at which redundant equations are chosen."""


def certificate_of(problem: Problem, name: str) -> Json:
    """Return the certificate of a task as plain data; it is not checked yet."""
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


def _groups(groups: list[Group], bodies: dict[str, dict[str, list[str]]]) -> list[list[str]]:
    """Return the bodies of each group that has any: links that turn freely have no place."""
    found = [[body for body in group.bodies if body in bodies] for group in groups]
    return [placed for placed in found if placed]


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
    if scene.redundant and scene.model.mechanism.tolerance:
        raise UnavailableError(
            "no certificate is written of redundant equations that are not met exactly",
            where=TOLERANCE,
        )
    spatial = scene.model.mechanism.dimension == 3
    return (spatial_mechanism_of if spatial else planar_mechanism_of)(scene, laws)


def _frames(scene: Scene, mechanism: Json) -> Frames | SpatialFrames:
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
        laws = formulas(ca.Function("law", [course.s], [ca.densify(course.smooth)]))
    elif isinstance(path, Legs):
        if setting.scene.model.mechanism.dimension == 2:
            raise UnavailableError("no certificate is written of poses by name")
        corners = path.corners.T if len(path.corners) > 1 else np.tile(path.corners.T, 2)
        laws = [[as_text(value) for value in row] for row in corners]
    else:
        pairs = zip(path.u0, path.d, strict=True)
        laws = ["s" if (u, d) == (0, 1) else _line(u, d) for u, d in pairs]
    return dict(zip(names, laws, strict=True))


def _line(start: float, slope: float) -> Formula:
    return ["+", as_text(start), ["*", as_text(slope), "s"]]


def _values(setting: Setting, u: Floats) -> dict[str, Formula]:
    """Return the values of the drivers at a pose: the first one is the parameter."""
    names = [driver.text for driver in setting.scene.drivers]
    return dict(zip(names, ["s", *map(as_text, u[1:])], strict=True))


def _sweep(problem: Problem, name: str, task: Sweep) -> Json:
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
        path = path_of(done.path, arc, frames, done.places, mechanism)
    else:
        assert isinstance(done.path, Legs)
        path = corners_of(done.path, arc, frames)
    if setting.scene.redundant:
        every = [path, *path["steps"]]
        some = [every[k] for k in np.unique(np.linspace(0, len(every) - 1, LOOKED_AT, dtype=int))]
        places = [(p["bodies"], p["to"] if "to" in p else p["at"]) for p in some]
        mechanism["superfluous"] = left_out(mechanism, places)
    return {
        "kind": "sweep",
        "mechanism": mechanism,
        "path": refined_path(mechanism, path),
        "poses": _poses(
            report(problem, name, task, setting, done), done, arc, path, mechanism["bodies"]
        ),
    }


def _closed_sweep(
    problem: Problem, name: str, task: Sweep, ran: tuple[Setting, Run, dict[str, Json]]
) -> Json:
    """Return motion in closed form and poses of a planar sweep with redundant equations."""
    setting, done, mechanism = ran
    path, arc = done.path, arc_of(done.path)
    if not isinstance(path, Path) or any(end is not None for end in (arc.low, arc.high)):
        raise UnavailableError(
            "no certificate is written of redundant equations along a path that ends, or legs"
        )
    k = len(path.s) // 2
    at, frames = np.array([path.s[k]]), _frames(setting.scene, mechanism)
    bodies = frames.at(path.state[k][: path.graphs.nx], path.drivers(at)[0])
    groups = _groups(setting.scene.groups, mechanism["bodies"])
    mechanism, _ = with_motion(mechanism, groups, bodies, as_text(at[0]))
    result = report(problem, name, task, setting, done)
    crossings = [zone.s for zone in path.zones]
    way = steps_of(float(min(done.places)), float(max(done.places)), crossings)
    poses = _poses(result, done, arc, way, mechanism["bodies"])
    return {"kind": "sweep", "mechanism": mechanism, "path": way, "poses": poses}


def _poses(
    result: Result, done: Run, arc: Arc, path: Json, bodies: dict[str, dict[str, list[str]]]
) -> list[Json]:
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
        claim: Json = {"pose": k, "at": as_text(value), "status": status}
        if status == Status.LIMIT.value and met:
            found.append(claim | {"end": ends[met]} | reported(result, k, bodies))
        elif status == Status.OK.value and on_path:
            if isinstance(done.path, Path) and (len(names) > 1 or done.values[k, 0] != value):
                drivers = dict(zip(names, map(as_text, done.values[k]), strict=True))
                claim["drivers"] = drivers
            found.append(claim | reported(result, k, bodies))
        elif status == Status.UNASSEMBLED.value and _beyond(arc, value):
            found.append(claim)
    return found


def _beyond(arc: Arc, value: float) -> bool:
    """Whether a driver value lies behind a limit position of the arc."""
    low, high = (end is not None and end.kind == "limit" for end in arc.limits)
    return (low and value < arc.first) or (high and value > arc.last)


def reported(result: Result, k: int, bodies: dict[str, dict[str, list[str]]]) -> dict[str, Json]:
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
    claim: Json = {"points": points, "bound": bound}
    if result.mechanism.dimension == 3:
        turns = {name: [as_text(v) for v in s.orientation[k]] for name, s in result.bodies.items()}
        return claim | {"orientations": turns}
    angles = {name: as_text(series.angle[k]) for name, series in result.bodies.items()}
    return claim | {"angles": angles}


def _without(modes: list[Json], *keys: str) -> list[Json]:
    """Return modes without some of their keys, in the order that they have."""
    return [{key: value for key, value in mode.items() if key not in keys} for mode in modes]


def _at_pose(problem: Problem, task: Any) -> tuple[Setting, Unknowns]:
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


def _modes(problem: Problem, name: str, task: Modes) -> Json:
    """Return all modes at one pose, and all complex poses, which prove that there are no others."""
    setting, u = _at_pose(problem, task)
    mechanism = mechanism_of(setting.scene, _values(setting, u))
    if "spins" in mechanism:
        raise UnavailableError("no certificate of modes is written where bodies spin freely")
    groups = _groups(setting.scene.groups, mechanism["bodies"])
    wide = bool(setting.scene.redundant) and "dimension" not in mechanism
    curved = has_curves(mechanism)
    proof = (
        "" if wide or curved else check_count(mechanism, groups)
    )  # refusals come before all else
    result = modes(problem, name, task)
    frames = _frames(setting.scene, mechanism)
    tree = setting.assembler.modes(u, by_paths=True)
    if len(result.status) < tree.count:
        raise UnavailableError("no certificate is written of some modes only", where="limit")
    every = tree.first(None)
    if wide and every:
        mechanism, groups = with_motion(mechanism, groups, frames.at(every[0].x, u), as_text(u[0]))
    elif setting.scene.redundant and every:
        first = frames.at(every[0].x, u)
        mechanism["superfluous"] = left_out(mechanism, [(first, as_text(u[0]))])
    if setting.assembler.search.free and not setting.scene.redundant:
        names = ", ".join(sorted({group.name for group in setting.assembler.search.free}))
        raise UnavailableError(
            "no certificate is written of modes beside poses in which bodies move by themselves: "
            f"{names}",
            hint="such poses are not alone: no count proves that there are no others",
        )
    labelled = [
        (setting.assembler.labelled(group), bool(_groups([group], mechanism["bodies"])))
        for group in setting.scene.groups
    ]
    found = []
    for k, mode in enumerate(every):
        labels = iter(mode.labels)
        senses = [(next(labels)[0] + "1" if counted else "1", there) for counted, there in labelled]
        signs = [str(int(sign)) for sign, there in senses if there]
        claim = {"label": mode.label, "bodies": frames.at(mode.x, u), "signs": signs}
        claim = refined_mode(mechanism, claim, as_text(u[0]))
        found.append(claim | reported(result, k, mechanism["bodies"]))
    content = {
        "kind": "modes",
        "at": as_text(u[0]),
        "mechanism": mechanism,
        "groups": groups,
    }
    if curved:  # their real poses are counted; no determinant is looked at
        return content | {"modes": _without(found, "signs")}
    solved = [group for runs in setting.assembler.search.counted.values() for group in runs]
    try:
        every_pose = [] if proof else complex_poses(content, found, solved)
    except UnavailableError:
        proof = looked_at(mechanism, groups)
        if not proof:
            raise
    if proof:
        return content | {"proof": proof, "modes": found}
    if wide:  # where the motion is, and what no determinant has
        found = _without(found, "bodies", "signs")
    return content | {"modes": found, "complex": every_pose}
