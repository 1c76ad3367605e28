"""Which gears, racks and belts are real pairs of wheels, and which belts go slack.

Real ones have forces at a pitch point; of others the torque is all there is. A pair is real if its
wheels do not move against each other at the pitch point, whatever the mechanism does, and if the
carrier that it names carries its wheels: the forces of teeth stand in for the equation of a pair,
and both must do the same work in every motion that the other joints allow. Where the carrier does
not hold the wheels, the equation still couples angles, but a force between the wheels would leave
the carrier without what turns it.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.joints.joint import PRESSURE_ANGLE
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.forces.generalised import MeshForces
from mechdae.equations.model import Model
from mechdae.equations.motion_equations import Released
from mechdae.equations.reduction import Scene
from mechdae.equations.tree.teeth import AxesOfMesh, axes_of_mesh
from mechdae.forces.teeth.mesh import Mesh
from mechdae.forces.teeth.spatial_mesh import SpatialMesh, teeth_along
from mechdae.kernels.run.functions import Batch
from mechdae.numerics.null_space import ZERO, freedoms
from mechdae.types import Booleans, Floats, Sym, Unknowns

REAL = 1e-8
"""Share of the speeds by which the teeth of a real pair of wheels may leave each other."""
SAME = 1e-8
"""Share by which the works of a pair and of its equation may differ."""
MOST = 5
"""Poses at which works are compared."""
ASIDE = (1e-2, 7e-3)
"""Ways along the freedoms, over natural sizes, to poses beside the start of a motion."""
STEPS = 6
"""Steps of Newton's method back to the constraints there."""


def real_along(
    scene: Scene, poses: Callable[[], Sequence[Any]], length: float
) -> tuple[tuple[str, bool | AxesOfMesh], ...]:
    """Return the gears, racks and belts of a scene, and whether they are real.

    In space they are, and it is said how their axes lie.

    Parameters
    ----------
    poses
        Gives the scene's coordinates and their rates (n, k), from which real pairs are told.
    length
        A length of the mechanism.
    """
    model = scene.model
    inside = {name for group in scene.groups for name in group.joints}
    names = [name for name in model.mesh_names if name in inside]
    columns = sorted(j for group in scene.groups for j in group.columns)
    if model.space.behind:
        return teeth_along(model, scene.cache, names, columns, poses()[0])

    def build() -> Batch:
        inputs = [model.q[columns], model.velocity[columns], model.p]
        return Batch(ca.Function("closing", inputs, _speeds(_tried(model, names))), [2])

    q, v = poses()
    closing, size = scene.cache("closing of wheels", build)(q, v, model.p_values)
    there = np.isfinite(v).all(axis=1)
    with np.errstate(invalid="ignore"):
        real = (np.abs(closing) <= REAL * size)[there].all(axis=0)
    real &= carried(model, names, q[there], columns, length)
    return tuple(zip(names, real.tolist(), strict=True))


def meshes_of(model: Model, real: Iterable[tuple[str, bool | AxesOfMesh]]) -> dict[str, MeshForces]:
    """Return the gears, racks and belts by name; those that are real have a mesh force."""
    found: dict[str, MeshForces] = {}
    for name, one in real:
        if isinstance(one, AxesOfMesh):
            found[name] = SpatialMesh(model, model.mechanism.joints[name], one)
        else:
            found[name] = Mesh(model, model.ends[name], real=one)
    return found


def meshes_as_described(model: Model, among: Container[str]) -> dict[str, MeshForces]:
    """Return those among some joints with the forces of mere ratios, in space of their axes."""
    joints = model.mechanism.joints
    names = [name for name in model.mesh_names if name in among]
    lies = {n: model.space.behind and axes_of_mesh(model.mechanism, joints[n]) for n in names}
    return meshes_of(model, lies.items())


def meshes_beside(
    released: Released, model: Model, q: Unknowns, length: float
) -> dict[str, MeshForces]:
    """Return the gears, racks and belts of a motion; those that are real have a mesh force.

    That is looked at beside the start: singular poses alone decide nothing. In space the equation
    of a mesh is one of its bearings alone, and poses tell all.

    Raises
    ------
    MechanismError, UnavailableError
        Teeth in space without a place, or that do not run with their ratio.

    Parameters
    ----------
    released
        The equations of motion; laws that move are left out.
    model
        With the numbers.
    q
        Absolute coordinates of the start.
    length
        A length of the mechanism.
    """
    names = model.mesh_names
    if model.space.behind:
        every = range(model.q.numel())
        return meshes_of(model, teeth_along(model, released.cache, names, every, q[None]))
    rows = [row for row in released.rows if not ca.depends_on(row.expression, released.t)]
    rows += [model.mesh_row(name) for name in names if name in model.in_gaps]
    phi = ca.vertcat(*[row.expression for row in rows])
    gradient = ca.densify(ca.jacobian(phi, model.q))
    equations = ca.Function("equations", [model.q, model.p], [ca.densify(phi), gradient])
    tried = _tried(model, names)
    speeds = ca.Function("speeds", [model.q, model.velocity, model.p], _speeds(tried))
    sizes = model.coordinates.sizes(length)
    gaps = np.array([1.0 if row.unit == "rad" else length for row in rows])

    def at(place: Floats) -> tuple[Floats, Floats]:
        left, G = (np.array(part) for part in equations(place, model.p_values))
        return left.ravel() / gaps, G * sizes / gaps[:, None]

    real = np.ones(len(names), bool)
    for way in ASIDE:
        place = q + way * sizes * freedoms(at(q)[1]).sum(axis=1)
        for _ in range(STEPS):
            left, G = at(place)
            place = place - sizes * np.linalg.lstsq(G, left, rcond=ZERO)[0]
        for rates in freedoms(at(place)[1]).T:
            closing, size = (
                np.array(part).ravel() for part in speeds(place, sizes * rates, model.p_values)
            )
            # a wheel that this freedom does not move is compared with those that it does
            real &= np.abs(closing) <= REAL * np.maximum(size, length * np.abs(rates).max())
        real &= carried(model, names, place[None], range(len(place)), length)
    found = zip(names, real.tolist(), strict=True)
    return {name: Mesh(model, model.ends[name], real=one) for name, one in found}


def _tried(model: Model, names: Sequence[str]) -> list[Mesh]:
    return [Mesh(model, model.ends[name], real=False) for name in names]


def _speeds(meshes: Sequence[Mesh]) -> list[Sym]:
    """Return the speeds of wheels against each other, and the sizes of speeds there."""
    return [ca.vertcat(*[m.closing for m in meshes]), ca.vertcat(*[m.size for m in meshes])]


def carried(
    model: Model, names: Sequence[str], q: Unknowns, columns: Sequence[int], size: float
) -> Booleans:
    """Return whether the teeth of each pair do the work of its equation.

    Parameters
    ----------
    names
        Gears, racks and belts.
    q : (n, k) array
        Poses, of the coordinates `columns`.
    columns
        Positions in q; joints that touch other coordinates are left out.
    size
        A length of the mechanism.
    """
    inside = set(columns)
    rows = [row for row in model.rows if row.owner not in names]
    rows += [model.mesh_row(name) for name in names]
    gradient = ca.jacobian(ca.vertcat(*[row.expression for row in rows]), model.q)
    touched: list[set[int]] = [set() for _ in rows]
    for i, j in zip(*gradient.sparsity().get_triplet(), strict=True):
        touched[i].add(j)
    joints = model.mechanism.joints
    others = [
        i for i, row in enumerate(rows) if not joints[row.owner].meshes and touched[i] <= inside
    ]
    place = {j: k for k, j in enumerate(columns)}
    works = []
    for row, name in enumerate(names, len(rows) - len(names)):
        column = Mesh(model, model.ends[name], real=True).column or {}
        pair = ca.SX(1, len(place))
        for j, entry in column.items():
            if j in place:
                pair[place[j]] = entry
        works += [gradient[row, list(columns)], pair]
    parts = [gradient[others, list(columns)], ca.vertcat(*works)]
    function = ca.Function(
        "works", [model.q[list(columns)], model.p], [ca.densify(p) for p in parts]
    )
    units = np.where(model.coordinates.lengths[list(columns)], size, 1.0)
    chosen = np.linspace(0, len(q) - 1, min(MOST, len(q))).astype(int)
    seen = []
    for k in chosen:
        G, W = (np.array(part) * units for part in function(q[k], model.p_values))
        seen.append((freedoms(G), W))
    least = min((V.shape[1] for V, _ in seen), default=0)  # there are more at singular poses
    result = np.ones(len(names), bool)
    for V, W in seen:
        if V.shape[1] == least:
            done = W @ V
            result &= [_parallel(done[2 * k], done[2 * k + 1]) for k in range(len(names))]
    return result


def _parallel(row: Floats, teeth: Floats) -> bool:
    """Return whether the second vector is a multiple of the first."""
    first, second = np.linalg.norm(row), np.linalg.norm(teeth)
    if first == 0 or not np.isfinite(second):
        return True  # redundant, or without a pitch point: said elsewhere
    along = row / first
    return bool(np.linalg.norm(teeth - (teeth @ along) * along) <= SAME * second and second > 0)


def about_meshes(meshes: Mapping[str, MeshForces], mechanism: Mechanism) -> list[str]:
    """Return what is assumed about gears, racks and belts: no forces of teeth, usual numbers."""
    found, usual = [], dict[str, list[str]]()
    for name, mesh in meshes.items():
        joint = mechanism.joints[name]
        if mesh.column is None:
            why = "a belt without radius" if joint.strands else "no real wheels"
            found.append(f"joint {name}: {why}, its torque is passed on and loads no bearing")
        elif getattr(joint, "pressure_angle", None) == PRESSURE_ANGLE:
            usual.setdefault("pressure angle 20 deg", []).append(name)
        elif joint.keep_for and getattr(joint, joint.keep_for) is None:
            usual.setdefault(f"no {joint.keep_for}", []).append(name)
    return [*found, *(f"{text}: {', '.join(names)}" for text, names in usual.items())]


def slack_belts(
    model: Model,
    meshes: Mapping[str, MeshForces],
    moment: Callable[[str], Any],
    when: Callable[[Any], str],
) -> list[str]:
    """Return belts whose slack strand would have to push, and friction wheels that slip.

    Parameters
    ----------
    model
        It has the values of their numbers.
    moment
        From a belt to the moments (n,) of its reaction.
    when
        From the poses (n,) at which it goes slack to what is said of them.
    """
    found = []
    for name, mesh in meshes.items():
        if not mesh.steady:
            continue
        joint, values = model.mechanism.joints[name], model.mechanism.values()
        need = joint.needed(values, moment(name))
        with np.errstate(invalid="ignore"):
            slack = need > values[f"{name}.{joint.keep_for}"]
        if slack.any():
            found.append(joint.gives_way(when(slack), float(np.nanmax(need))))
    return found
