"""What a task of reactions builds, for `show`: loads, masses, friction with its laws."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Reactions
from mechdae.equations.forces.friction import Laws
from mechdae.equations.forces.generalised import MeshForces, massive
from mechdae.equations.forces.loads import Loads
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene, model_of
from mechdae.equations.tree.bars import check_in_space
from mechdae.forces.poses import loaded_bodies
from mechdae.motion.kinematics.show import driven_structure
from mechdae.motion.setup.drivers import plan

if TYPE_CHECKING:
    from mechdae.types import Json


def reactions_structure(problem: Problem, task: Reactions, model: Model | None = None) -> Json:
    """Return what a task of reactions will build: its sweep, and the parts of the balance."""
    if model is None:
        model = model_of(problem.mechanism, plan(problem.mechanism, task).coordinates)

    def parts(scene: Scene) -> dict[str, Json]:
        if scene.model.space.behind:
            check_in_space(scene.model.mechanism)
        return {"forces": force_structure(scene, task)}

    return driven_structure(problem, task, model, loaded_bodies(model), parts, order=2)


def force_structure(scene: Scene, task: Reactions) -> Json:
    """Return the parts of the balance of forces of a scene.

    ``loads`` have their kinds by name, ``friction`` the law of each joint that has one;
    without friction there is none, whatever the joints' coefficients.
    """
    model = scene.model
    joints = model.mechanism.joints
    solved = {name for group in scene.groups for name in group.joints}
    names = [name for name in joints if name in solved]
    masses = massive(model, scene.bodies)
    loads = Loads(model, task.direction == "load", heavy=scene.bodies)
    kinds = {name: load.kind for name, load in model.mechanism.loads.items()}
    result: Json = {
        "efforts": [c.text for c in scene.drivers],
        "reactions": names,
        "loads": {name: kinds.get(name, name) for name in loads.wrenches},
        "masses": masses,
        "massless": [name for name in scene.bodies if name not in masses],
        "direction": task.direction,
        "quasi_static": task.quasi_static,
    }
    if task.friction != "none":
        meshes: dict[str, MeshForces] = {}
        for case in scene.cases("forces of joints"):
            meshes |= case.meshes_as_described(model, names)
        laws = Laws(model, meshes, task.friction_radius)
        frictional = {name: [f for f in laws.of(name) if f.friction] for name in names}
        result["friction"] = {
            name: joints[name].friction_law(task.friction_radius == "article")
            for name, found in frictional.items()
            if found
        }
        result["coupled"] = task.friction == "coupled"
    words = (("cycle", task.cycle), ("parts", task.parts), ("axes", task.axes))
    result |= {word: value for word, value in words if value}
    return result
