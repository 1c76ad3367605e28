"""Small motions around an equilibrium: eigenvalues, frequencies, damping, shapes.

With z along the freedoms, Z^T M Z z'' + C z' + K z = 0.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import named_coordinate
from mechdae.describe.tasks.motion import Equilibrium
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.rest.balance import NEUTRAL, EquilibriumEquations
from mechdae.equations.forces.generalised import spin
from mechdae.errors import InputError, SingularMassError
from mechdae.types import Floats, Graph, Json, Matrix, Sym, Unknowns

SETTLED = math.log(50)
"""Time, in those of the slowest small motion, after which 2 % of it are left."""


def small_motions(
    balance: EquilibriumEquations,
    task: Equilibrium,
    x: Unknowns,
    basis: Matrix,
    along: list[Floats],
) -> Json:
    """Return eigenvalues of the small motions with frequencies, damping and shapes."""
    M, C, K = along
    n = len(M)
    if not n:
        return {"modes": [], "frequencies": [], "damping": []}
    if np.linalg.eigvalsh((M + M.T) / 2)[0] <= 1e-12 * np.trace(M):
        raise SingularMassError(
            "a freedom has no inertia: there are no frequencies",
            where="bodies",
            hint="give mass and inertia, or linearise = false",
        )
    inverse = np.linalg.inv(M)
    first = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])
    values, vectors = np.linalg.eig(first)
    whole = balance.setup
    names, gradient = told(whole, task, x, n)
    scaled = gradient * whole.kernel.sizes @ basis if len(names) else basis
    labels = names or [".".join(c.key) for c in whole.released.coordinates]
    placed = _placements(whole, x) * whole.kernel.sizes @ basis
    modes: list[Json] = []
    largest = float(np.max(np.abs(values)))
    rounding = NEUTRAL * largest
    for k in np.lexsort((values.imag, np.abs(values))):
        value = values[k]
        if value.imag < -rounding:
            continue  # its conjugate is listed
        real = 0.0 if abs(value.real) <= rounding else float(value.real)
        swing = 0.0 if abs(value.imag) <= rounding else float(value.imag)
        size = math.hypot(real, swing)
        shape = scaled @ vectors[:n, k]
        largest_of = shape[np.argmax(np.abs(shape))]
        shape = shape / largest_of
        bodies = np.reshape(placed @ vectors[:n, k] / largest_of, (-1, whole.model.space.freedoms))
        shown = {
            label: [float(z.real), float(z.imag)] for label, z in zip(labels, shape, strict=True)
        }
        modes.append(
            {
                "eigenvalue": [real, swing],
                "frequency": swing / (2 * math.pi),
                "natural_frequency": size / (2 * math.pi),
                "damping": 0.0 - real / size if size else 0.0,
                "shape": shown,
                "bodies": {
                    body: {
                        word: [float(z.real), float(z.imag)]
                        for word, z in zip(whole.model.space.twist, row, strict=True)
                    }
                    for body, row in zip(_placed_bodies(whole), bodies, strict=True)
                },
            }
        )
    growth = float(values.real.max())
    zero = min(abs(value) for value in values) <= math.sqrt(NEUTRAL) * largest
    verdict = "unstable" if growth > math.sqrt(NEUTRAL) * largest else "stable"
    if zero and verdict == "stable":
        verdict = "neutral"
    elif verdict == "stable" and values.real.max() < -rounding:
        verdict = "asymptotically stable"
    return {
        "modes": modes,
        "stable": verdict,
        "frequencies": [mode["frequency"] for mode in modes],
        "damping": [mode["damping"] for mode in modes],
        "settling_time": SETTLED / -growth if verdict == "asymptotically stable" else None,
    }


def _placements(whole: MotionProblem, x: Unknowns) -> Floats:
    """Return the gradients of origin and angle of each body by the free coordinates.

    In space small turns about the world's axes take the place of the angle.
    """
    model = whole.model
    if model.space.behind:
        return _turned(whole, x)
    rows = [
        ca.vertcat(model.origin(body), model.frame(body).angle)
        for body in whole.problem.mechanism.bodies
    ]
    return _gradient(whole, x, "placements", rows)


def _placed_bodies(whole: MotionProblem) -> list[str]:
    """Return the bodies that have a placement: not those that spin freely between ball joints."""
    return [body for body in whole.problem.mechanism.bodies if body not in whole.model.spinning]


def _turned(whole: MotionProblem, x: Floats) -> Floats:
    """Return the gradients of origin and turn of each body in space."""
    r, k, model = whole.released, whole.kernel, whole.model

    def build() -> Graph:
        rows = []
        for body in _placed_bodies(whole):
            rows.append(ca.jacobian(model.origin(body), model.q))
            rows.append(ca.jacobian(spin(model, body), model.velocity))
        return k.function("gradient", [ca.densify(r.moved(ca.vertcat(*rows)) @ r.V)])

    found = k.call("placements", build)(0.0, x, np.zeros(k.n), whole.loose)[0]
    return np.reshape(found, (-1, k.n), order="F")


def _gradient(whole: MotionProblem, x: Unknowns, name: str, rows: list[Sym]) -> Matrix:
    """Return the gradients (rows, n) of expressions over q by the free coordinates."""
    r, k = whole.released, whole.kernel

    def build() -> Graph:
        return k.function("gradient", [ca.densify(ca.jacobian(r.moved(ca.vertcat(*rows)), r.x))])

    found = k.call(name, build)(0.0, x, np.zeros(k.n), whole.loose)[0]
    return np.reshape(found, (-1, k.n), order="F")


def told(whole: MotionProblem, task: Equilibrium, x: Unknowns, count: int) -> tuple[list[str], Any]:
    """Return the names and gradients of the coordinates in which shapes are given."""
    if task.free is None:
        return [], None
    coordinates = [named_coordinate(whole.problem.mechanism, name) for name in task.free]
    rows = [whole.model.coordinate(c) for c in coordinates]
    gradient = _gradient(whole, x, f"told {task.free}", rows)
    if len(coordinates) != count:
        raise InputError(
            f"the mechanism has {count} freedoms, {len(coordinates)} coordinates are named",
            where="free",
        )
    return [c.text for c in coordinates], gradient
