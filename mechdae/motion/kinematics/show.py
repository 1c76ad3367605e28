"""What `show` and `check` say about a task with drivers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Driven, Sweep
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene, model_of, scene
from mechdae.errors import MechdaeError
from mechdae.motion.kinematics.prepared import first_pose, prepare
from mechdae.motion.setup.drivers import plan

if TYPE_CHECKING:
    from mechdae.types import Json


WORDS = ("positions", "velocities", "accelerations", "jerks")


def driven_structure(
    problem: Problem,
    task: Driven,
    model: Model | None = None,
    loaded: Iterable[str] | None = None,
    parts: Callable[[Scene], dict[str, Any]] | None = None,
    order: int = 0,
) -> Json:
    """Return what a task will build: unknowns, blocks, bodies outside of its scene.

    Parameters
    ----------
    model
        That of the mechanism, where it is built already.
    loaded
        Bodies that are kept whatever the outputs are.
    parts
        More entries, from the scene.
    order
        Derivatives that are computed at least.
    """
    entry: Json = {"kind": task.kind, "available": True}
    try:
        numbers = plan(problem.mechanism, task)
        if model is None:
            model = model_of(problem.mechanism, numbers.coordinates)
        names = None if loaded is None else list(loaded)
        the_scene = scene(model, numbers.coordinates, task.outputs, loaded=names)
        entry |= parts(the_scene) if parts is not None else {}
    except MechdaeError as error:
        return {"kind": task.kind, "available": True, "error": str(error)}
    entry |= {
        "drivers": [c.text for c in numbers.coordinates],
        "unknowns": len(the_scene.x_names),
        "blocks": [len(block.x) for block in the_scene.blocks],
        "not_in_scene": the_scene.not_in_scene,
    }
    if isinstance(task, Sweep):
        entry["builds"] = list(WORDS[: max(task.derivatives, order) + 1])
        if task.measures:
            entry["builds"].append("measures " + ", ".join(task.measures))
        if the_scene.selection.named:
            entry["builds"].append("outputs " + ", ".join(the_scene.selection.named))
        entry["poses"] = numbers.poses
    return entry


def tried(problem: Problem, task: Sweep) -> None:
    """Assemble the pose that a sweep starts from.

    Raises
    ------
    MechdaeError
        It cannot start.
    """
    first_pose(prepare(problem, task), task)
