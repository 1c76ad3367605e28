"""The task of kind modes: all assembly modes at one pose of the drivers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.assumed import about_closure
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driver, Modes, Sweep
from mechdae.equations.groups import formula
from mechdae.errors import InputError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.assembly import not_assembled
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.mode_tree import Mode, ModeTree
from mechdae.motion.continuation.evaluate import H_LIMIT
from mechdae.motion.continuation.output_bounds import WORST, OutputBounds, spread, widened
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.setup.drivers import plan
from mechdae.motion.setup.named_outputs import NamedOutputs
from mechdae.motion.setup.outputs import Outputs
from mechdae.motion.setup.scales import Constants, divisors
from mechdae.records import dataclass
from mechdae.results import ModesResult, Named, Series, Status, Summary
from mechdae.results.status import Cause
from mechdae.types import Booleans, Floats, Matrix, Unknowns

LISTED = 1000
"""Modes that are listed where the task sets no limit; all are counted."""
UNSURE = {
    Cause.RANK: "not certified, modes meet within the rounding of the data",
    Cause.CERTIFICATE: "not certified, though the equations keep their rank there",
    Cause.OPEN: "not certified, Newton's method does not close them",
}


@dataclass
class _Modes:
    """Assembly modes of one pose: those found, those listed, and with what.

    ``tree`` has all that were found, ``listed`` are those reported, ``certain`` their bounds,
    ``y`` (n, ny) their outputs; ``u`` and ``coordinates`` those of the drivers.
    """

    assembler: Assembler
    outputs: Outputs
    expressions: NamedOutputs | None
    coordinates: tuple[NamedCoordinate, ...]
    u: Floats
    tree: ModeTree
    fault: str | None
    listed: list[Mode]
    certain: Certified
    y: Floats


def modes(problem: Problem, name: str, task: Modes) -> ModesResult:
    """Return all assembly modes; rows of the result are modes.

    ``summary`` has the count, whether it is proven, and each mode as a sketch.
    """
    found = _found(problem, task)
    listed, certain = found.listed, found.certain
    drivers = {
        c.text: Series({"position": np.full(len(listed), found.u[k])})
        for k, c in enumerate(found.coordinates)
    }
    tables: dict[str, Any] = found.outputs.named([found.y])
    tables["outputs"], lost = Named("output", {}), list[str]()
    if found.expressions is not None:
        there = [found.y[:, found.outputs.columns(found.expressions.coordinates)]]
        sure = np.ones(len(listed), bool)
        tables["outputs"], lost = found.expressions.evaluate(there, None, sure)
    bounder = OutputBounds(found.assembler.graphs, found.outputs, certain.constants)
    bounds = bounder.by_kind(certain.error.T)
    summary, notes = _summary(found), lost + _notes(found)
    status = np.where(certain.sure, Status.OK.value, Status.SINGULAR.value).astype("U9")
    scene, p = found.assembler.scene, found.assembler.p
    for beyond in scene.cases("stops") if listed else ():
        faults = beyond(scene, certain.x, np.tile(found.u, (len(listed), 1)), p)
        status[[k for k in faults if certain.sure[k]]] = Status.STOPPED.value
        notes += [f"mode {','.join(listed[k].labels)}: {text}" for k, text in faults.items()]
    if notes:
        summary["notes"] = notes
    return ModesResult(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        drivers=Named("driver", drivers),
        status=status,
        bound=Series({key: np.where(certain.sure, v, np.nan) for key, v in bounds.items()}),
        labels=tuple(mode.labels for mode in listed),
        summary=summary,
        fault=found.fault,
        definition=task,
        **tables,
    )


def _found(problem: Problem, task: Modes) -> _Modes:
    """Return the modes of the task's pose."""
    if task.mode is not None:
        raise InputError("all modes are listed, none is chosen", where="mode", hint="leave it out")
    numbers = plan(problem.mechanism, task)
    if numbers.values is None or len(numbers.values) != 1:
        raise InputError("assembly modes are those of one pose: give the driver as at = [value]")
    u = numbers.values[0]
    held = [
        Driver(c.text, at=(float(value),), speed=0.0)
        for c, value in zip(numbers.coordinates, u, strict=True)
    ]
    setting = prepare(problem, Sweep(drivers=tuple(held), outputs=task.outputs, derivatives=0))
    assembler, outputs, expressions = setting.assembler, setting.outputs, setting.expressions
    the_scene, graphs = assembler.scene, assembler.graphs
    tree = assembler.modes(u, by_paths=True)
    found = tree.first(LISTED if task.limit is None else task.limit)
    certain = certified(graphs, np.array([m.x for m in found]).reshape(len(found), graphs.nx), u)
    found = [replace(mode, x=x) for mode, x in zip(found, certain.x, strict=True)]
    inputs = [the_scene.x, the_scene.u, the_scene.model.p]
    function = graphs.cache("outputs", lambda: ca.Function("y", inputs, [outputs.expression]))
    rows = [np.array(function(mode.x, u, assembler.p)).ravel() for mode in found]
    y = np.array(rows).reshape(len(found), graphs.ny)
    fault = (
        None
        if tree.failure is None
        else str(not_assembled.not_assembled(the_scene, tree.failure, u))
    )
    return _Modes(
        assembler,
        outputs,
        expressions,
        numbers.coordinates,
        *(u, tree, fault, found, certain, y),
    )


def _summary(modes: _Modes) -> Summary:
    """Return what there is to know of modes."""
    assembler, found, u = modes.assembler, modes.listed, modes.u
    the_scene = assembler.scene
    summary = Summary(
        count=modes.tree.count,
        proven=modes.tree.proven,
        basis=assembler.search.basis(),
        formula=formula(the_scene.groups),
        groups=[g.name for g in the_scene.groups if assembler.labelled(g)],
        not_in_scene=the_scene.not_in_scene,
        bound="estimated" if modes.certain.constants.estimated else "proved",
        sketches=[not_assembled.as_sketch(assembler, mode, u) for mode in found],
    )
    for cuts in the_scene.cases("cuts"):
        x = np.array([mode.x for mode in found])
        rollers = [
            {"mode": found[k].label, "joint": cut.joint, "depth": cut.depth}
            for cut in cuts(the_scene, x, np.tile(u, (len(found), 1)))
            for k in range(cut.first, cut.last + 1)
        ]
        if rollers:  # poses that solve the equations and cannot be built
            summary["undercut"] = rollers
    if the_scene.redundant and found:
        summary["superfluous"] = assembler.search.superfluous(found[0].x, u)
        if assumed := about_closure(the_scene.model.mechanism):
            summary["assumptions"] = assumed
    if assembler.search.free:
        names = sorted({group.name for group in assembler.search.free})
        summary["free"] = names  # modes in which the group moves by itself are not counted
    if assembler.search.singular_paths:
        summary["singular_paths"] = assembler.search.singular_paths
    if assembler.search.searched:
        summary["search"] = assembler.search.searches()
    return summary


def _notes(modes: _Modes) -> list[str]:
    """Return what there is to say of modes."""
    found, assembler = modes.listed, modes.assembler
    notes = assembler.scene.left_out
    sure = modes.certain.sure
    from mechdae.motion.kinematics.lost_poses import reason

    unsure: dict[Cause, list[str]] = {}
    for mode, certain in zip(found, sure, strict=True):
        if not certain:
            graphs, constants = assembler.graphs, modes.certain.constants
            why = reason(graphs, constants, mode.x, modes.u, range(graphs.nb))
            unsure.setdefault(why.cause, []).append(",".join(mode.labels))
    notes += [f"{UNSURE[cause]}: {', '.join(labels)}" for cause, labels in unsure.items()]
    if any(assembler.turns.endless) and found:
        names = sorted({group.name for group in assembler.endless_groups})
        notes.append(
            f"each whole turn of bodies of group {', '.join(names)} puts bodies solved later "
            f"elsewhere: listed are modes nearest to the sketch, there may be others"
        )
    if len(found) < modes.tree.count:
        notes.append(f"the first {len(found)} of {modes.tree.count} modes are listed")
    return notes


@dataclass(frozen=True)
class Certified:
    """Poses of one value of the drivers: ``sure`` (k,), and bounds ``error`` (k, nx) where so.

    ``x`` (k, nx) are the poses after one more Newton step, where they are certain.
    """

    x: Matrix
    sure: Booleans
    error: Floats
    constants: Constants


def certified(graphs: Graphs, x: Unknowns, u: Floats) -> Certified:
    """Return which poses (k, nx) at driver values `u` pass the test of Newton and Kantorovich."""
    k = len(x)
    constants = Constants(graphs, np.abs(u))
    wide = 1.5 * np.abs(x).max(axis=0, initial=0.0)
    measured = divisors(graphs, x, np.tile(u, (k, 1))) / 2 if graphs.contacts and k else None
    if measured is not None or np.any(wide > constants.size_x):
        size_x = np.maximum(constants.size_x, wide)
        constants = Constants(graphs, np.abs(u), size_x, measured)
    consts = constants.consts
    rates = [] if graphs.single else [np.zeros(graphs.nu) for _ in graphs.driven]
    poses, sure, error = np.array(x, float), np.zeros(k, bool), np.full((k, graphs.nx), np.nan)
    for row in range(k):
        moved, bound, det, beta, eta = graphs.pose(x[row], u, *rates, consts)[:5]
        det, beta, eta = (np.array(part).ravel() for part in (det, beta, eta))
        with np.errstate(invalid="ignore", over="ignore"):
            h = constants.kappa * beta * (np.sqrt(eta) + beta * constants.rho)
            good = h <= H_LIMIT
        redundant = np.array([graph.redundant for graph in graphs.blocks], bool)
        ill = spread(graphs, constants, det[None], beta[None])
        sure[row] = np.all(good & ((det > 0) | ~redundant)) and np.all(ill <= WORST)
        if sure[row]:
            poses[row] = np.array(moved).ravel()
            error[row] = widened(np.array(bound).reshape(1, -1), ill)
    return Certified(poses, sure, error, constants)
