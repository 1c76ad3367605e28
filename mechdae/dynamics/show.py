"""What `show` and `check` say about a task of motion or equilibrium."""

from __future__ import annotations

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Equilibrium, Motion
from mechdae.dynamics.equations import as_motion, setup
from mechdae.dynamics.task import motion_start
from mechdae.equations.model import Model
from mechdae.errors import MechdaeError


def motion_structure(
    problem: Problem, task: Motion | Equilibrium, _model: Model | None = None
) -> dict[str, object]:
    """Return coordinates, constraints, loads and laws of the released model."""
    entry: dict[str, bool | str] = {"kind": task.kind, "available": True}
    timed = isinstance(task, Motion)
    try:
        motion = task if isinstance(task, Motion) else as_motion(task)
        whole = setup(problem, motion, moves=timed)
        released = whole.released
    except MechdaeError as error:
        return {**entry, "error": str(error)}
    mechanism = problem.mechanism
    loads = {name: load.kind for name, load in mechanism.loads.items()}
    loads |= {"gravity": "gravity"} if mechanism.gravity is not None else {}
    return {
        **entry,
        "drivers": [law.coordinate.text for law in whole.laws],
        "coordinates": [".".join(c.key) for c in released.coordinates],
        "constraints": [released.rows[i].name for i in released.left],
        "eliminated": len(released.gone),
        "absolute": len(whole.model.q_names),
        "equations": len(released.rows),
        "loads": loads,
        **({"end": whole.end, "tolerance": whole.tolerance} if timed else {}),
        "not_in_scene": [],
    }


def tried(problem: Problem, task: Motion | Equilibrium) -> None:
    """Find the start of a motion, or where an equilibrium is looked for."""
    motion_start(problem, task if isinstance(task, Motion) else as_motion(task))
