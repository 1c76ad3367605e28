"""Whether the teeth of gears and racks in space run with their ratio: n.(v1 - v2) = 0 there.

Forces of teeth stand in for the equation of a mesh, so both must do the same work in every motion,
and what pushes the members apart must do none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.equations.structure_cache import StructureCache
from mechdae.equations.tree.teeth import AxesOfMesh, axes_of_mesh
from mechdae.errors import MechanismError, UnavailableError
from mechdae.forces.teeth.spatial_mesh import SpatialMesh
from mechdae.kernels.run.functions import Batch
from mechdae.types import Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.describe.joints.spatial import SpatialGear


SAME = 1e-8
"""Share by which the works of teeth and of their equation may differ."""
MOST = 5
"""Poses at which works are compared."""


def teeth_along(
    model: Any, kept: StructureCache, names: Sequence[str], columns: Sequence[int], q: Unknowns
) -> tuple[tuple[str, AxesOfMesh], ...]:
    """Return how the axes of gears and racks lie.

    Parameters
    ----------
    kept
        Where functions of one structure are kept.
    columns
        Places in the model's q of the coordinates that move.
    q : (n, k) array
        Poses in these coordinates, at which works are compared.

    Raises
    ------
    MechanismError, UnavailableError
        Teeth without a place, or that do not run with their ratio.
    """
    joints = model.mechanism.joints
    lies = tuple((name, axes_of_mesh(model.mechanism, joints[name])) for name in names)
    q = q[np.isfinite(q).all(axis=1)]
    chosen = q[np.linspace(0, len(q) - 1, min(MOST, len(q))).astype(int)]
    sizes = model.coordinates.sizes(model.mechanism.scale)[columns]
    for name, axes in lies:

        def build(name: str = name, axes: AxesOfMesh = axes) -> Batch:
            mesh = SpatialMesh(model, joints[name], axes)
            row = next(row for row in model.rows if row.owner == name)
            works = [ca.jacobian(row.expression, model.q)[columns]]
            works += [
                ca.horzcat(*[SX_ZERO + wrench.get(j, 0) for j in columns])
                for wrench in (mesh.column, mesh.apart)
            ]
            others = [ca.horzcat(mesh.bends, mesh.rolling_helix)]
            flat = ca.vec(ca.densify(ca.horzcat(*works, *others)))
            return Batch(ca.Function("works", [model.q[columns], model.p], [flat]), [1])

        batch = kept(("works of teeth", name, axes), build)
        found = batch(chosen, model.p_values)[0]
        equation, teeth, apart = (part * sizes for part in np.split(found[:, :-2], 3, axis=1))
        _compared(joints[name], axes, (equation, teeth, apart), *found[:, -2:].T)
    return lies


SX_ZERO = ca.SX(0)


def _compared(
    joint: SpatialGear,
    lies: AxesOfMesh,
    works: tuple[Floats, Floats, Floats],
    bends: Floats,
    helix: Floats,
) -> None:
    """Raise for teeth that do other work than their equation."""
    equation, teeth, apart = works
    size = np.abs(equation).max(axis=1, initial=0.0, keepdims=True)
    where = f"joints.{joint.name}"
    if not (np.abs(teeth - equation) <= SAME * size).all():
        key, hint = "point", "another point, or none: it follows from the axes and the ratio"
        if lies.kind == "crossing":
            key, hint = "helix", f"helix_deg = {np.degrees(helix[0]):.6g} at this point"
        raise MechanismError(
            f"the teeth of {joint.name} do not run with its ratio: at the pitch point both wheels "
            f"have other velocities across them",
            where=f"{where}.{key}",
            hint=hint,
        )
    if not (np.abs(apart) <= SAME * np.abs(teeth).max(initial=1.0)).all():
        raise MechanismError(
            f"the teeth of {joint.name} come nearer as they run: this is no pitch point",
            where=f"{where}.point",
            hint="another point",
        )
    if lies.kind == "crossing" and joint.wheels > 1 and not (bends < 0).all():
        raise UnavailableError(
            "internal gears whose axes cross have no forces in this version",
            where=where,
            hint="the pitch point between the axes",
        )
