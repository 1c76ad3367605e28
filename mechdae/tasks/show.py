"""The structure of a problem for `show`: mobility by count and by rank, groups, unknowns."""

from __future__ import annotations

import math
from collections.abc import Mapping

import casadi as ca
import numpy as np

from mechdae.additions import at_home
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.tasks.synthesis import Synthesis, demand, listed_goals
from mechdae.describe.values import Number
from mechdae.equations.groups import Group, formula
from mechdae.equations.mobility import count_mobility
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene, model_of, scene
from mechdae.errors import MechdaeError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.assembly import not_assembled, start
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.idle_freedom import built_without_idle_freedom
from mechdae.motion.setup.drivers import plan, sketched
from mechdae.motion.setup.outputs import Outputs
from mechdae.numerics.null_space import dependences, dependent
from mechdae.tasks.dispatch.solve import KINDS, available
from mechdae.tasks.vector_modules import modules
from mechdae.types import Json


def structure(problem: Problem) -> Json:
    """Return what `show` prints, as plain data.

    ``mobility`` has n, p5, p4 and W by Chebyshev's formula and by rank at the sketched pose;
    ``formulas`` one entry for each distinct set of drivers of the tasks; ``tasks`` what each
    will build.
    """
    mechanism = problem.mechanism
    model = Model(mechanism) if mechanism.dimension == 2 else None
    result: Json = {
        "problem": problem.name,
        "title": problem.title,
        "source": problem.source,
        "sizes": dict(problem.sizes),
        "bodies": {name: list(body.points) for name, body in mechanism.bodies.items()},
        "joints": {
            name: {"kind": joint.kind, "between": [joint.first, joint.second]}
            for name, joint in mechanism.joints.items()
        },
        "parameters": mechanism.values(),
        "mobility": {**count_mobility(mechanism), "rank": None},
        "formulas": [],
        "tasks": {},
        "groups": [],
    }
    seen: dict[tuple[str, ...], Json] = {}
    for name, task in problem.tasks.items():
        result["tasks"][name] = _entry(problem, task, model)
        if not isinstance(task, Driven):
            continue
        key = tuple(driver.coordinate for driver in task.all_drivers)
        if key not in seen:
            seen[key] = _driven(problem, task, model)
            result["formulas"].append(seen[key])
            if idle := seen[key].pop("idle", None):
                counted = result["mobility"].get("idle", [])
                result["mobility"]["idle"] = list(dict.fromkeys([*counted, *idle]))
            if result["mobility"]["rank"] is None:
                result["mobility"]["rank"] = seen[key].pop("rank", None)
            seen[key].pop("rank", None)
            result["groups"] = result["groups"] or seen[key].get("groups", [])
    return result


def loops_and_vectors(mechanism: Mechanism) -> Json:
    """Return the loops of a mechanism and its vectors: lengths [m], angles [rad], or None.

    ``of`` is the link that a vector turns with, "" for none.
    """
    closure = mechanism.closure
    assert closure is not None
    known, values = mechanism.parameter_values, mechanism.values()
    vectors: Json = {}
    for name, vector in closure.vectors.items():
        parts = vectors[name] = dict.fromkeys(ANGLES[mechanism.dimension])
        body, turn = closure.directions.get(name, (vector.body, None))
        if turn is None:
            parts |= {word: _number(getattr(vector, word), known) for word in parts}
        elif not body:
            parts["angle"] = evaluate(turn, known)
        parts["length"] = _number(vector.length, known)
        if vector.from_ is not None and vector.to is not None:
            ends = [[values[f"{end}.{axis}"] for axis in mechanism.axes]
                    for end in (vector.from_, vector.to)]  # fmt: skip
            parts["length"] = math.dist(*ends)
        parts["of"] = body or ""
    return {"loops": {name: list(loop) for name, loop in closure.loops.items()}, "vectors": vectors}


ANGLES: dict[int, tuple[str, ...]] = {2: ("length", "angle"), 3: ("length", "elevation", "azimuth")}
"""What a vector has in the plane and in space."""


def _number(number: Number | None, known: Mapping[str, float]) -> float | None:
    return None if number is None else evaluate(number, known)


def _entry(problem: Problem, task: Task, model: Model | None = None) -> Json:
    """Return what a task will build."""
    show = KINDS[task.kind].show if task.kind in KINDS else ""
    if not show or not available(problem, task):
        return {"kind": task.kind, "available": available(problem, task)}
    entry: Json = at_home(show)(problem, task, model)
    return entry


def not_in_scene(problem: Problem, name: str) -> list[str]:
    """Return the bodies that no output of a task depends on, without solving anything."""
    task = problem.task(name)
    entry = _entry(problem, task) if isinstance(task, Driven) else {}
    bodies: list[str] = entry.get("not_in_scene", [])
    return bodies


def _driven(problem: Problem, task: Driven, model: Model | None) -> Json:
    entry: Json = {"drivers": [driver.coordinate for driver in task.all_drivers]}
    try:
        numbers = plan(problem.mechanism, task)
        model = model or model_of(problem.mechanism, numbers.coordinates)
        whole = scene(model, numbers.coordinates)
    except MechdaeError as error:
        return {**entry, "error": str(error)}
    try:
        sketch = sketched(problem.mechanism)

        def build(coarse: bool) -> Assembler:
            the_scene = scene(model, numbers.coordinates, None, coarse)
            return Assembler(Graphs(the_scene, Outputs(the_scene).expression, 0), sketch)

        assembler = built_without_idle_freedom(
            build, lambda built: start.try_redundant(built, numbers)
        )
        whole = assembler.scene
        u = start.start_values(numbers)
        found = assembler.from_sketch(u)
        if found.failure is None:
            entry["rank"] = rank_mobility(whole, assembler.coordinates(found.x, u))
        else:
            entry["assembly"] = str(not_assembled.not_assembled(whole, found.failure, u))
    except MechdaeError as error:
        entry["error"] = str(error)
    entry |= {"idle": whole.idle} if whole.idle else {}
    closing = modules(problem.mechanism, whole.groups, entry["drivers"])
    return entry | {
        "formula": formula(whole.groups),
        "groups": [
            group_entry(group) | ({"module": module} if module else {})
            for group, module in zip(whole.groups, closing, strict=True)
        ],
        "coordinates": len(model.q_names),
        "unknowns": len(whole.x_names),
        "blocks": [len(block.x) for block in whole.blocks],
    }


def group_entry(group: Group) -> Json:
    """Return a group as in the contract of the JSON."""
    return {
        **group.entry,
        "joints": list(group.joints),
        "kind": group.kind,
        "after": list(group.after),
        "higher_pairs": group.higher_pairs,
        "superfluous": group.superfluous,
    }


def rank_mobility(whole: Scene, q: dict[tuple[str, str], float]) -> Json:
    """Return the mobility by the rank of the joints' Jacobian at a pose.

    Rows and columns are equilibrated (lengths by the mechanism's size). ``superfluous``
    names the joints that share a dependent equation.
    """
    model = whole.model
    scale = model.mechanism.scale
    values = np.array([q.get(name, 0.0) for name in model.q_names])  # what is idle turns nothing
    function = ca.Function("J", [model.q, model.p], [ca.densify(model.phi_q)])
    jacobian = np.array(function(values, model.p_values))
    jacobian = jacobian * model.coordinates.sizes(scale)
    rank = len(jacobian) - dependences(jacobian).shape[1]
    owners = [model.rows[i].owner for i in np.flatnonzero(dependent(jacobian))]
    owners = model.sharing(list(dict.fromkeys(owners)))
    return {
        "mobility": len(values) - rank,
        "rank": rank,
        "equations": len(model.rows),
        "superfluous": owners,
    }


def design_structure(
    problem: Problem, task: Synthesis, _model: Model | None = None
) -> dict[str, object]:
    """Return what a task of synthesis searches for."""
    entry = {"kind": task.kind, "available": True}
    try:
        required = demand(problem, task)
    except MechdaeError as error:
        return {**entry, "error": str(error)}
    return {
        **entry,
        "goals": [goal.kind for goal, _ in listed_goals(task)],
        "free": [*required.free, *required.choices],
        "starts": required.starts,
        "seed": required.seed,
    }
