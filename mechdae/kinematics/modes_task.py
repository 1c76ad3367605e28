"""The task of kind modes: all assembly modes at one pose of the drivers."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.assembly import start
from mechdae.assembly.assembler import Assembler, Mode
from mechdae.assembly.idle_freedom import settled
from mechdae.continuation.output_bounds import output_bounds
from mechdae.continuation.single_pose import certified
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Modes
from mechdae.errors import InputError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kinematics.undercut import cuts
from mechdae.model.groups import formula
from mechdae.model.model import Model
from mechdae.model.reduction import scene
from mechdae.results import ModesResult, Named, Series, Summary
from mechdae.setup.drivers import plan, sketched
from mechdae.setup.named_outputs import NamedOutputs, requests
from mechdae.setup.outputs import Outputs


def modes(problem: Problem, name: str, task: Modes) -> ModesResult:
    """Return all assembly modes; rows of the result are modes.

    ``summary`` has the count, whether it is proven, and each mode as a sketch.
    """
    mechanism = problem.mechanism
    if task.mode is not None:
        raise InputError("all modes are listed, none is chosen", where="mode", hint="leave it out")
    numbers = plan(mechanism, task)
    if numbers.values is None or len(numbers.values) != 1:
        raise InputError("assembly modes are those of one pose: give the driver as at = [value]")
    u = numbers.values[0]
    model = Model(mechanism)
    listed, sketch = task.outputs is not None, sketched(mechanism)

    def build(coarse: bool) -> tuple[Assembler, Outputs, NamedOutputs]:
        the_scene = scene(model, numbers.coordinates, task.outputs, coarse)
        expressions = NamedOutputs(model, the_scene.selection.named, 0, listed=listed, time=False)
        outputs = Outputs(the_scene, requests(model, list(expressions.rates)))
        return Assembler(Graphs(the_scene, outputs.expression, 0), sketch), outputs, expressions

    assembler, outputs, expressions = settled(
        build, lambda built: start.try_redundant(built[0], numbers)
    )
    the_scene, graphs = assembler.scene, assembler.graphs
    everything, proven, failure = assembler.modes(u)
    found = everything[: task.limit]
    certain = certified(graphs, np.array([m.x for m in found]).reshape(len(found), graphs.nx), u)
    found = [replace(mode, x=x) for mode, x in zip(found, certain.x, strict=True)]
    function = ca.Function("y", [the_scene.x, the_scene.u, the_scene.model.p], [outputs.expression])
    rows = [np.array(function(mode.x, u, assembler.p)).ravel() for mode in found]
    y = np.array(rows).reshape(len(found), graphs.ny)
    fault = None if failure is None else str(start.not_assembled(the_scene, failure, u))
    summary: dict[str, Any] = {
        "count": len(everything),
        "proven": bool(proven),
        "formula": formula(the_scene.groups),
        "groups": [g.name for g in the_scene.groups if assembler.labelled(g)],
        "not_in_scene": the_scene.not_in_scene,
        "bound": "estimated" if certain.constants.estimated else "proved",
        "sketches": [start.as_sketch(assembler, mode, u) for mode in found],
    }
    rollers = cuts(the_scene, np.array([mode.x for mode in found]), np.tile(u, (len(found), 1)))
    if rollers:  # poses that solve the equations and cannot be built
        summary["undercut"] = [
            {"mode": found[k].label, "joint": cut.joint, "depth": cut.depth}
            for cut in rollers
            for k in range(cut.first, cut.last + 1)
        ]
    if the_scene.redundant and found:
        summary["superfluous"] = assembler.superfluous(found[0].x, u)
    if assembler.free:
        names = sorted({group.name for group in assembler.free})
        summary["free"] = names  # modes in which the group moves by itself are not counted
    if assembler.searched:
        summary["search"] = assembler.searches()
    drivers = {
        c.text: Series({"position": np.full(len(found), u[k])})
        for k, c in enumerate(numbers.coordinates)
    }
    tables: dict[str, Any] = outputs.named([y])
    there = [y[:, outputs.columns(expressions.coordinates)]]
    tables["outputs"], lost = expressions.evaluate(there, None, np.ones(len(found), bool))
    bounds = output_bounds(graphs, outputs, certain.constants, certain.error)
    notes = list(lost)
    unsure = [",".join(m.labels) for m, sure in zip(found, certain.sure, strict=True) if not sure]
    if unsure:
        notes.append(
            f"not certified, modes meet within the rounding of the data: {', '.join(unsure)}"
        )
    if any(assembler.endless) and found:
        names = sorted({group.name for group in assembler.endless_groups})
        notes.append(
            f"each whole turn of bodies of group {', '.join(names)} puts bodies solved later "
            f"elsewhere: listed are modes nearest to the sketch, there may be others"
        )
    if len(found) < len(everything):
        notes.append(f"the first {len(found)} of {len(everything)} modes are listed")
    if notes:
        summary["notes"] = notes
    return ModesResult(
        problem.name,
        name,
        task.kind,
        mechanism,
        problem.title,
        drivers=Named("driver", drivers),
        status=np.where(certain.sure, "ok", "singular"),
        bound=Series({key: np.where(certain.sure, v, np.nan) for key, v in bounds.items()}),
        labels=tuple(mode.labels for mode in found),
        summary=Summary(summary),
        fault=fault,
        definition=task,
        **tables,
    )


def sketch_text(sketch: dict[str, float]) -> str:
    """Return a mode as TOML lines."""
    return "\n".join(f"{json.dumps(k) if '.' in k else k} = {v}" for k, v in sketch.items())


__all__ = ["Assembler", "Mode", "modes", "sketch_text"]
