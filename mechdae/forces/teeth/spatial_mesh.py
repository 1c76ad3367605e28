"""Gears and racks in space as the forces between their teeth.

At the pitch point P both members have one velocity across the teeth. The teeth run along t in the
common tangent plane of the pitch surfaces, whose normal is n; the force acts along n x t, and
tan(pressure angle) times it pushes the members apart along n, whichever side of a tooth bears.

- parallel axes: P lies on the line of centres and divides it by the ratio, n along it;
- axes that meet: P lies on the generatrix that the pitch cones share, along ratio a1 - a2, n across
  it in the plane of the axes;
- axes that cross: P is given, n is normal to both velocities there.

The pressure angle is that of a section normal to the teeth; the helix is that of the first member,
positive if right-handed.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2004, ch. 3 (axes of rotation, pitch
surfaces), 11 and 16.

Whether the teeth of gears and racks in space run with their ratio: n.(v1 - v2) = 0 there.

Forces of teeth stand in for the equation of a mesh, so both must do the same work in every motion,
and what pushes the members apart must do none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.equations.forces.generalised import Wrench, add, couples, pair, times
from mechdae.equations.structure_cache import StructureCache
from mechdae.equations.tree.solid import entries
from mechdae.equations.tree.teeth import AxesOfMesh, axes_of_mesh
from mechdae.errors import MechanismError, UnavailableError
from mechdae.kernels.run.functions import Batch
from mechdae.types import Floats, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.describe.joints.spatial import SpatialGear

SX = ca.SX


class SpatialMesh:
    """The forces of a gear or rack in space; attributes as of `mesh.Mesh`.

    ``tangential`` (1, 6) is a form of the joint's reaction: minus its force across the teeth.
    ``rolling_helix`` is the helix with which teeth at the pitch point run with the ratio, where
    axes cross; ``bends`` the product of the curvatures of both pitch surfaces.
    """

    def __init__(self, model: Any, joint: Joint, lies: AxesOfMesh) -> None:
        self.model, self.joint, self.lies = model, joint, lies
        self.real, self.steady = True, Wrench()
        members = bearings(model.mechanism, joint)
        self.a1, self.a2 = (model.axes_of(b.joint)[0][:, 2] for b in members)
        self.O1, self.O2 = (model.point(self._on_carrier(b.joint)) for b in members)
        turn = members[0].sense * model.relative(members[0].joint, members[0].word)
        self._turning = ca.jtimes(turn, model.q, model.velocity)
        self.ratio: Sym | None = self.number("ratio") if joint.wheels > 1 else None
        self.P, self.normal = self._place()
        self._along()
        self._forces()

    @property
    def kept_by(self) -> AxesOfMesh:
        """What decides its equations beside its joint."""
        return self.lies

    def number(self, entry: str) -> Sym:
        return self.model.numbers[f"{self.joint.name}.{entry}"]

    def _on_carrier(self, name: str) -> str:
        """Return the point of a bearing on the carrier."""
        joint, carrier = self.model.mechanism.joints[name], getattr(self.joint, "carrier", None)
        point: str = joint.ends_at(carrier or GROUND)[0]
        return point

    def _second_velocity(self, place: Sym) -> Sym:
        """Return the velocity of the second member on the carrier at a place, a unit of its own."""
        return self.a2 if self.ratio is None else ca.cross(self.a2, place - self.O2)

    def _place(self) -> tuple[Sym, Sym]:
        """Return the pitch point and the normal of the pitch plane."""
        point = getattr(self.joint, "point", None)
        P = None if point is None else self.model.point(point)
        if self.lies.kind == "crossing":
            v1 = ca.cross(self.a1, P - self.O1)
            return P, _unit(ca.cross(v1, self._second_velocity(P)))
        if self.lies.kind == "meeting":
            return self._on_cones(P)
        height = self.model.point(self.joint.first) - self.O1
        up = self.a1 * ca.dot(self.a1, height)
        if self.ratio is None:
            away = ca.cross(self.a2, self.a1)
            return self.O1 + self.number("radius") * away + up if P is None else P, away
        gap = self.O2 - self.O1
        gap = gap - self.a1 * ca.dot(self.a1, gap)
        centre = self.O1 + gap / (1 - ca.dot(self.a1, self.a2) * self.ratio) + up
        return centre if P is None else P, _unit(gap)

    def _on_cones(self, P: Sym) -> tuple[Sym, Sym]:
        way = _unit(self.ratio * self.a1 - self.a2)
        if P is None:
            gap, cosine = self.O2 - self.O1, ca.dot(self.a1, self.a2)
            reach = ca.dot(gap, self.a1) - cosine * ca.dot(gap, self.a2)
            apex = self.O1 + self.a1 * reach / (1 - cosine**2)
            sine = ca.norm_2(ca.cross(self.a1, way))
            P = apex + self.lies.side * way * self.number("radius") / sine
        return P, _unit(ca.cross(way, ca.cross(self.a1, P - self.O1)))

    def _along(self) -> None:
        """Set the direction in the pitch plane across the teeth."""
        self._v1 = ca.cross(self.a1, self.P - self.O1)
        round_ = _unit(self._v1)
        across = ca.cross(self.normal, round_)
        if getattr(self.joint, "helix", None) is not None:
            across = across * ca.sign(ca.dot(across, self.a1))
            helix = self.number("helix")
            across = ca.cos(helix) * across + ca.sin(helix) * round_
        self.across: Sym = ca.cross(self.normal, across)
        second = self._second_velocity(self.P)
        slip = self.ratio * self._v1 - second if self.ratio is not None else self._v1
        along = ca.cross(self.normal, round_)
        along = along * ca.sign(ca.dot(along, self.a1))
        self.rolling_helix: Sym = ca.atan(ca.dot(slip, round_) / ca.dot(slip, along))

    def _bend(self, axis: Sym, place: Sym) -> Sym:
        """Return the curvature of a pitch surface, positive with its axis along the normal."""
        arm = self.P - place
        arm = arm - axis * ca.dot(axis, arm)
        return -ca.dot(self.normal, arm) / ca.sumsqr(arm)

    def _forces(self) -> None:
        joint, model = self.joint, self.model
        if self.ratio is None:
            size = -1 / ca.dot(self.across, self.a2)
        else:
            size = 1 / ca.dot(self.across, self._v1)
        first = self._bend(self.a1, self.O1)
        second = SX(0) if self.ratio is None else self._bend(self.a2, self.O2)
        away = self.normal * ca.sign(second - first) * ca.tan(self.number("pressure_angle"))
        place = model.point(joint.second)
        self.bends: Sym = first * second
        ends = (joint.first_body, joint.second_body)

        def force(value: Sym) -> Wrench:
            moment = ca.cross(self.P - place, value)
            acting = pair(model, *ends, self.P, value)
            return add(acting, entries((joint.name,), value, moment))

        self.column: Wrench = times(size, force(self.across))
        self.apart: Wrench = force(away)
        self.tangential: Sym = ca.horzcat(-self.across.T, SX(1, 3))
        turned = self.a2 / self.ratio if self.ratio is not None else SX(3, 1)
        gone = turned - self.a1
        self._rolling, self._axis = ca.norm_2(gone), _unit(gone)
        self._carried = ca.dot(self._axis, turned), ca.dot(self._axis, self.a1)
        self.rubbing: Sym = self._rolling * self._turning

    @property
    def holding(self) -> Wrench:
        """Return what a unit of the couple about the axis that the members roll about does."""
        return self._couple(self._axis)

    def _couple(self, moment: Sym) -> Wrench:
        ends = (self.joint.first_body, self.joint.second_body)
        acting = couples(self.model, *ends, moment)
        return add(acting, entries((self.joint.name,), SX(3, 1), moment))

    def lost(self, loss: Sym, side: int, sign: Sym) -> tuple[Sym, Wrench]:
        """Return arm and generalised force of the loss per unit of tangential force.

        A couple between the wheels about the axis they roll about takes the share of the power
        that enters the mesh, on the carrier. `side` is the sign of the multiplier, `sign` that
        of the rubbing speed.
        """
        speed = ca.dot(self.across, self._v1)
        second, first = self._carried
        first_drives = side * sign * ca.sign(speed) < 0
        by_first = self._rolling + loss * first
        by_second = self._rolling - loss * second
        arm = loss * ca.fabs(speed) / ca.if_else(first_drives, by_first, by_second)
        return arm, self._couple(-sign * arm * self._axis)


def _unit(vector: Sym) -> Sym:
    return vector / ca.norm_2(vector)


SAME = 1e-8
"""Share by which the works of teeth and of their equation may differ."""
MOST = 5
"""Poses at which works are compared."""


def teeth_along(
    model: Any, cache: StructureCache, names: Sequence[str], columns: Sequence[int], q: Unknowns
) -> tuple[tuple[str, AxesOfMesh], ...]:
    """Return how the axes of gears and racks lie.

    Parameters
    ----------
    cache
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
                ca.horzcat(*[ca.SX(0) + wrench.get(j, 0) for j in columns])
                for wrench in (mesh.column, mesh.apart)
            ]
            others = [ca.horzcat(mesh.bends, mesh.rolling_helix)]
            flat = ca.vec(ca.densify(ca.horzcat(*works, *others)))
            return Batch(ca.Function("works", [model.q[columns], model.p], [flat]), [1])

        batch = cache(("works of teeth", name, axes), build)
        found = batch(chosen, model.p_values)[0]
        equation, teeth, apart = (part * sizes for part in np.split(found[:, :-2], 3, axis=1))
        _compared(joints[name], axes, (equation, teeth, apart), *found[:, -2:].T)
    return lies


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
