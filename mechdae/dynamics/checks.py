"""Checks before a motion begins: equations that never hold, coordinates without inertia."""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.start import Start
from mechdae.equations.motion_equations import row_size
from mechdae.errors import (
    InconsistentStartError,
    IndeterminateFrictionError,
    SingularMassError,
    SolveError,
)
from mechdae.kernels.run.functions import Call
from mechdae.numerics.null_space import dependences, rank, unit_rows
from mechdae.types import Floats, Graph, Unknowns

SX = ca.SX
CLOSED = 1e-9
MASSLESS = 1e-12
"""Least eigenvalue of the scaled mass matrix along the freedoms that counts as inertia."""
ASIDE = 1e-2
"""Way along the freedoms, over natural sizes, to the pose where a rank is looked at again."""
DEFICIENT = 1e-4
"""Singular value, over the largest, that the right-hand side takes for none at a start."""
OPEN = 1e-6
"""Share of the accelerations by which superfluous equations may contradict each other."""


def check_start(setup: MotionProblem, begin: Start) -> None:
    """Raise for equations without a coordinate that do not hold, and laws that fight joints."""
    r = setup.released

    def build() -> Call:
        rows = ca.vertcat(*[row.expression for row in r.rows]) if r.rows else ca.SX(0, 1)
        inputs = [r.model.q, r.t, r.signs, r.model.p]
        return Call(ca.Function("rows", inputs, [ca.densify(rows)]))

    values = r.cache("rows", build)(begin.q, 0.0, setup.loose, setup.model.p_values)[0]
    sizes = np.array([row_size(row.unit, setup.length) for row in r.rows])
    left = {
        row.name: float(value)
        for row, value, size in zip(r.rows, values, sizes, strict=True)
        if abs(value) > (CLOSED + setup.closure) * size
    }
    if left:
        listed = ", ".join(f"{name} {value:.3g}" for name, value in list(left.items())[:6])
        error = InconsistentStartError(
            f"the constraints do not hold together at t = 0; what is left: {listed}",
            where="start",
            hint="a law of time must begin where the start is",
        )
        error.residuals = left
        raise error
    if r.residue.numel():
        moving = [e for e in ca.symvar(r.residue) if e.element_hash() == r.t.element_hash()]
        if moving:
            owners = ", ".join(dict.fromkeys(r.rows[i].owner for i in r.empty))
            raise InconsistentStartError(
                f"laws of time leave no freedom to {owners}: too many coordinates are driven",
                where="drivers",
                hint="drive fewer coordinates",
            )


def check_inertia(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise for freedoms without inertia."""
    k = setup.kernel
    signs = setup.loose
    M, f, J, _ = k.value("parts", 0.0, x, v, signs)
    if not np.isfinite(f).all() or not np.isfinite(M).all():
        loads = ", ".join(setup.loads.wrenches)
        raise SolveError(
            f"forces are not finite at the start: {loads}", where="loads", hint="check the values"
        )
    basis = setup.freedoms(J)
    if not basis.shape[1]:
        return
    scaled = M * np.outer(k.sizes, k.sizes)
    along = basis.T @ scaled @ basis
    values, vectors = np.linalg.eigh(along)
    largest = max(float(values[-1]), float(np.trace(scaled)), 0.0)
    if values[0] > MASSLESS * largest:
        return
    direction = np.abs(basis @ vectors[:, 0])
    chosen = [
        ".".join(c.key)
        for c, share in zip(k.released.coordinates, direction, strict=True)
        if share > 0.1 * direction.max()
    ]
    raise SingularMassError(
        f"nothing that moves with {', '.join(chosen)} has a mass or a moment of inertia, and no "
        "constraint holds it: its acceleration is not determined (S5)",
        where="bodies",
        hint="give mass and inertia to these bodies, or a driver",
    )


def check_friction(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise for friction on forces that superfluous equations leave open.

    Multipliers that balance without any load must not press where there is friction, at the
    start and at a pose beside it: a singular pose alone decides nothing.
    """
    k, r = setup.kernel, setup.released
    if not k.rubs or not r.rows:
        return

    def gradient() -> Graph:
        rows = ca.vertcat(*[row.expression for row in r.rows])
        found = SX(ca.jacobian(rows, r.model.q))
        for name, mesh in r.rubbing.meshes.items():
            if mesh.column is not None:
                i = next(i for i, row in enumerate(r.rows) if row.owner == name and not row.driver)
                found[i, :] = r.stack(mesh.column).T
        forms = [r.pressing(feedback) for feedback in r.rubbing.feedbacks]
        return k.function("gradient", [ca.densify(part) for part in (r.moved(found), *forms)])

    J = k.value("place", 0.0, x, v, setup.loose)[1]
    aside = x + ASIDE * k.sizes * setup.freedoms(J).sum(axis=1)
    for _ in range(4):
        aside = k.value("project", 0.0, aside, v, setup.loose)[0].ravel()
    sizes = r.model.coordinates.sizes(setup.length)
    common: set[str] | None = None
    for place in (x, aside):
        G, *forms = k.call("gradient", gradient)(0.0, place, v, setup.loose)
        G = np.reshape(G, (len(r.rows), -1), order="F") * sizes
        stress = dependences(G) / unit_rows(G)[1]
        found = set()
        for feedback, form in zip(r.rubbing.feedbacks, forms, strict=True):
            if not feedback.friction:
                continue
            pressed = np.reshape(form, (-1, len(r.rows)), order="F") @ stress
            size = np.abs(stress).max(initial=0.0)
            idle = feedback.idle(r.model.p, setup.model.p_values)
            if pressed.size and np.abs(pressed).max() > OPEN * size and not idle:
                found.add(feedback.joint)
        common = found if common is None else common & found
    if common:
        joints = ", ".join(name for name in r.model.mechanism.joints if name in common)
        raise IndeterminateFrictionError(
            f"superfluous equations leave the forces open that press on {joints}: friction (F3) "
            "that follows from them is not determined",
            where=f"joints.{sorted(common)[0]}.friction",
            hint="take away what holds twice, or the friction there",
        )


def check_rest(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise where superfluous equations contradict each other in their accelerations.

    J x'' = gamma is a question of the pose, the speeds and the laws alone: forces are not asked.
    What no acceleration meets is the part of gamma across the image of J.
    """
    k, r = setup.kernel, setup.released
    if not k.m:
        return
    bias = k.call("bias", lambda: k.function("bias", [ca.densify(r.bias)]))
    _, _, J, gamma = k.value("parts", 0.0, x, v, setup.loose)
    turned = bias(0.0, x, v, setup.loose)[0]
    lengths = r.model.coordinates.sizes(setup.length)
    left, sigma, _ = np.linalg.svd(J * k.sizes / k.gaps[:, None])
    asked = gamma.ravel() / k.gaps
    kept = left[:, : rank(sigma, DEFICIENT)]
    rest = asked - kept @ (kept.T @ asked)
    size = max(
        float(np.max(np.abs(asked), initial=0.0)),
        float(np.max(np.abs(turned / lengths), initial=0.0)),
        float(np.max(np.abs(v / k.sizes), initial=0.0)) ** 2,
    )
    if not np.isfinite(rest).all() or np.max(np.abs(rest)) > OPEN * size:
        names = [r.rows[i].name for i in r.left]
        found = dict(zip(names, (rest * k.gaps).tolist(), strict=True))
        worst = max(found, key=lambda name: abs(found[name]))
        error = InconsistentStartError(
            "the pose is singular and the speeds do not fit it: no accelerations meet the "
            f"constraints, {worst} is left with {found[worst]:.3g}",
            where="start",
            hint="start at another pose, or with other speeds",
        )
        error.residuals = found
        raise error
