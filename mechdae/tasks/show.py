"""The structure of a problem for `show`: mobility by count and by rank, groups, unknowns."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.assembly import start
from mechdae.assembly.assembler import Assembler
from mechdae.assembly.idle_freedom import settled
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driven, Equilibrium, Motion, Reactions, Sweep, Synthesis
from mechdae.describe.tasks.synthesis import demand
from mechdae.dynamics.show import motion_structure
from mechdae.errors import MechdaeError
from mechdae.forces.show import force_structure
from mechdae.forces.task import loaded_bodies
from mechdae.kernels.graphs.steps import Graphs
from mechdae.model.groups import ROMAN, Group, count_mobility, formula
from mechdae.model.model import Model
from mechdae.model.reduction import Scene, scene
from mechdae.numerics.null_space import dependences, dependent
from mechdae.setup.drivers import plan, sketched
from mechdae.setup.outputs import Outputs


def structure(problem: Problem) -> dict[str, Any]:
    """Return what `show` prints, as plain data.

    ``mobility`` has n, p5, p4 and W by Chebyshev's formula and by rank at the sketched pose;
    ``formulas`` one entry for each distinct set of drivers of the tasks; ``tasks`` what each
    will build.
    """
    mechanism = problem.mechanism
    model = Model(mechanism)
    result: dict[str, Any] = {
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
    seen: dict[tuple[str, ...], dict[str, Any]] = {}
    for name, task in problem.tasks.items():
        if isinstance(task, Motion | Equilibrium):
            result["tasks"][name] = motion_structure(problem, task)
            continue
        if not isinstance(task, Driven):
            result["tasks"][name] = {"kind": task.kind, "available": task.available}
            if isinstance(task, Synthesis):
                result["tasks"][name] |= _design(problem, task)
            continue
        key = tuple(driver.coordinate for driver in task.all_drivers)
        if key not in seen:
            seen[key] = _driven(problem, task, model)
            result["formulas"].append(seen[key])
            if result["mobility"]["rank"] is None:
                result["mobility"]["rank"] = seen[key].pop("rank", None)
            seen[key].pop("rank", None)
            result["groups"] = result["groups"] or seen[key].get("groups", [])
        result["tasks"][name] = _task(problem, task, model)
    return result


def _driven(problem: Problem, task: Driven, model: Model) -> dict[str, Any]:
    entry: dict[str, Any] = {"drivers": [driver.coordinate for driver in task.all_drivers]}
    try:
        numbers = plan(problem.mechanism, task)
        whole = scene(model, numbers.coordinates)
    except MechdaeError as error:
        return {**entry, "error": str(error)}
    try:
        sketch = sketched(problem.mechanism)

        def build(coarse: bool) -> Assembler:
            the_scene = scene(model, numbers.coordinates, None, coarse)
            return Assembler(Graphs(the_scene, Outputs(the_scene).expression, 0), sketch)

        assembler = settled(build, lambda built: start.try_redundant(built, numbers))
        whole = assembler.scene
        u = start.start_values(numbers)
        found = assembler.from_sketch(u)
        if found.failure is None:
            entry["rank"] = rank_mobility(whole, assembler.coordinates(found.x, u))
        else:
            entry["assembly"] = str(start.not_assembled(whole, found.failure, u))
    except MechdaeError as error:
        entry["error"] = str(error)
    return entry | {
        "formula": formula(whole.groups),
        "groups": [group_entry(group) for group in whole.groups],
        "coordinates": len(model.q_names),
        "unknowns": len(whole.x_names),
        "blocks": [len(block.x) for block in whole.blocks],
    }


def group_entry(group: Group) -> dict[str, Any]:
    """Return a group as in the contract of the JSON."""
    return {
        "name": group.name,
        "bodies": list(group.bodies),
        "joints": list(group.joints),
        "class": ROMAN[min(group.class_, 10)],
        "order": group.order,
        "kind": group.kind,
        "after": list(group.after),
        "higher_pairs": group.higher_pairs,
        "superfluous": group.superfluous,
    }


def rank_mobility(whole: Scene, q: dict[tuple[str, str], float]) -> dict[str, Any]:
    """Return the mobility by the rank of the joints' Jacobian at a pose.

    Rows and columns are equilibrated (lengths by the mechanism's size). ``superfluous``
    names the joints that share a dependent equation.
    """
    model = whole.model
    scale = model.mechanism.scale
    values = np.array([q[name] for name in model.q_names])
    function = ca.Function("J", [model.q, model.p], [ca.densify(model.phi_q)])
    jacobian = np.array(function(values, model.p_values))
    jacobian = jacobian * model.coordinates.sizes(scale)
    rank = len(jacobian) - dependences(jacobian).shape[1]
    owners = [model.rows[i].owner for i in np.flatnonzero(dependent(jacobian))]
    return {
        "mobility": len(values) - rank,
        "rank": rank,
        "equations": len(model.rows),
        "superfluous": list(dict.fromkeys(owners)),
    }


def _design(problem: Problem, task: Synthesis) -> dict[str, Any]:
    """Return what a task of synthesis searches for."""
    try:
        asked = demand(problem, task)
    except MechdaeError as error:
        return {"error": str(error)}
    goals = [task.goal] if task.goal is not None else task.goals
    return {
        "goals": [str(goal["kind"]) for goal in goals],
        "free": [*asked.free, *asked.choices],
        "starts": asked.starts,
        "seed": asked.seed,
    }


def pruned(mechanism: Mechanism, task: Driven, model: Model | None = None) -> Scene:
    """Return the scene of a task: the groups that its outputs depend on."""
    model = Model(mechanism) if model is None else model
    kept = list(loaded_bodies(model)) if isinstance(task, Reactions) else None
    return scene(model, plan(mechanism, task).coordinates, task.outputs, loaded=kept)


def _task(problem: Problem, task: Driven, model: Model) -> dict[str, Any]:
    entry: dict[str, Any] = {"kind": task.kind, "available": task.available}
    forces = isinstance(task, Reactions)
    try:
        numbers = plan(problem.mechanism, task)
        own = pruned(problem.mechanism, task, model)
        if isinstance(task, Reactions):
            entry["forces"] = force_structure(own, task)
    except MechdaeError as error:
        return {**entry, "error": str(error)}
    entry |= {
        "drivers": [c.text for c in numbers.coordinates],
        "unknowns": len(own.x_names),
        "blocks": [len(block.x) for block in own.blocks],
        "not_in_scene": own.not_in_scene,
    }
    if isinstance(task, Sweep):
        words = ["positions", "velocities", "accelerations", "jerks"]
        entry["builds"] = words[: max(task.derivatives, 2 * forces) + 1]
        if task.measures:
            entry["builds"].append("measures " + ", ".join(task.measures))
        if own.selection.named:
            entry["builds"].append("outputs " + ", ".join(own.selection.named))
        entry["poses"] = numbers.poses
    return entry
