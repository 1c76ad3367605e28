"""Which gears, racks and belts of a motion are real pairs of wheels.

Those have forces at a pitch point, as in a task of reactions; of others the torque is all there
is. A pair is real if its wheels do not move against each other at the pitch point, whatever the
mechanism does. That is looked at beside the start: singular poses alone decide nothing.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.forces.carriers import RANK, carried, freedoms
from mechdae.model.forces.meshes import KINDS, Mesh
from mechdae.model.model import Model
from mechdae.model.motion_equations import Released

REAL = 1e-8
"""Share of the speeds by which the teeth of a real pair may leave each other."""
ASIDE = (1e-2, 7e-3)
"""Ways along the freedoms, over natural sizes, to the poses that are looked at."""
STEPS = 6
"""Steps of Newton's method back to the constraints there."""


def meshed(model: Model) -> list[str]:
    """Return the gears, racks and belts of a mechanism."""
    return [name for name, joint in model.mechanism.joints.items() if joint.kind in KINDS]


def real_meshes(released: Released, q: Any, length: float) -> dict[str, Mesh]:
    """Return the gears, racks and belts; those that are real have a mesh force.

    Parameters
    ----------
    released
        The equations of motion; laws that move are left out.
    q
        Absolute coordinates of the start.
    length
        A length of the mechanism.
    """
    model = released.model
    names = meshed(model)
    if not names:
        return {}
    rows = [row for row in released.rows if not ca.depends_on(row.expression, released.t)]
    phi = ca.vertcat(*[row.expression for row in rows])
    gradient = ca.densify(ca.jacobian(phi, model.q))
    equations = ca.Function("equations", [model.q, model.p], [ca.densify(phi), gradient])
    tried = [Mesh(model, model.ends[name], real=False) for name in names]
    leaving = [ca.vertcat(*[part(mesh) for mesh in tried]) for part in (_closing, _size)]
    speeds = ca.Function("speeds", [model.q, model.velocity, model.p], leaving)
    sizes = np.array([1.0 if own[1] == "angle" else length for own in model.q_names])
    gaps = np.array([1.0 if row.unit == "rad" else length for row in rows])

    def at(place: Any) -> tuple[Any, Any]:
        left, G = (np.array(part) for part in equations(place, model.p_values))
        return left.ravel() / gaps, G * sizes / gaps[:, None]

    real = np.ones(len(names), bool)
    for way in ASIDE:
        place = q + way * sizes * freedoms(at(q)[1]).sum(axis=1)
        for _ in range(STEPS):
            left, G = at(place)
            place = place - sizes * np.linalg.lstsq(G, left, rcond=RANK)[0]
        for rates in freedoms(at(place)[1]).T:
            closing, size = (
                np.array(part).ravel() for part in speeds(place, sizes * rates, model.p_values)
            )
            # a wheel that this freedom does not move is compared with those that it does
            real &= np.abs(closing) <= REAL * np.maximum(size, length * np.abs(rates).max())
        real &= carried(model, names, place[None], range(len(place)), length)
    return {name: Mesh(model, model.ends[name], bool(real[k])) for k, name in enumerate(names)}


def about(meshes: dict[str, Mesh]) -> list[str]:
    """Return what is assumed about gears, racks and belts that have no forces of teeth."""
    found = []
    for name, mesh in meshes.items():
        if mesh.column is None:
            why = "a belt without radius" if mesh.ends.joint.kind == "belt" else "no real wheels"
            found.append(f"joint {name}: {why}, its torque is passed on and loads no bearing")
    return found


def slack_belts(meshes: dict[str, Mesh], reactions: dict[str, Any], t: Any) -> list[str]:
    """Return belts whose slack strand would have to push, for reactions (n, 3) at times."""
    found = []
    for name, mesh in meshes.items():
        if not mesh.steady:
            continue
        values = mesh.model.mechanism.values()
        radius, pretension = values[f"{name}.radius"], values[f"{name}.pretension"]
        need = np.abs(reactions[name][:, 2]) / (2 * radius * values[f"{name}.ratio"])
        with np.errstate(invalid="ignore"):
            slack = np.flatnonzero(need > pretension)
        if len(slack):
            found.append(
                f"belt {name} goes slack, first at t = {t[slack[0]]:.6g} s: pretension of "
                f"{np.nanmax(need):.6g} N at least is needed"
            )
    return found


def _closing(mesh: Mesh) -> Any:
    return mesh.closing


def _size(mesh: Mesh) -> Any:
    return mesh.size
