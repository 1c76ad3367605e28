"""Static equilibrium of a released mechanism, and small motions around it.

Newton's method on f(x) - J^T lambda = 0, phi(x) = 0 along the freedoms that the constraints
leave: with Z a basis of them, x = x0 + Z z,

    Z^T M Z z'' + C z' + K z = 0,   C = -Z^T df/dv Z,   K = -Z^T d(f - J^T lambda)/dx Z.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

from mechdae.analysis.motion.checks import freedoms
from mechdae.analysis.motion.meshing import meshed
from mechdae.analysis.motion.observe import Observer, States
from mechdae.analysis.motion.report import Whole, evaluated, with_reactions
from mechdae.analysis.motion.setup import Setup, as_motion, idle, setup
from mechdae.analysis.motion.start import start
from mechdae.analysis.motion.unique import unique
from mechdae.analysis.named import NamedOutputs, requests
from mechdae.analysis.outputs import Outputs
from mechdae.describe.coordinates import selection
from mechdae.describe.moving import named_coordinate
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Equilibrium
from mechdae.errors import InputError, SingularMassError, SolveError
from mechdae.kernels.call import Call
from mechdae.results import Named, Result, Series

STEPS = 100
SOLVED = 1e-13
"""Force left over, of those that balance, that counts as none."""
ACCEPTED = 1e-10
SHORT = 0.4
"""Largest change of a coordinate in one step, over its natural size."""
NEUTRAL = 1e-9
"""Share of the largest eigenvalue below which one counts as zero."""
RANK = 1e-9


class _Statics:
    """Equations of equilibrium of a setup as arrays."""

    def __init__(self, setup: Setup) -> None:
        self.setup, k = setup, setup.kernel
        r = setup.released
        lam = ca.SX.sym("lam", k.m)
        force = ca.densify(r.f) - r.J.T @ lam
        slopes = [ca.jacobian(force, r.x), ca.jacobian(ca.densify(r.f), r.v)]
        parts = [r.f, r.J, r.phi, *slopes, r.M]
        function = k.function("statics", [ca.densify(part) for part in parts], [lam])
        self._call = Call(function)
        lengths = [1.0 if name == "angle" else setup.length for _, name in setup.model.q_names]
        weights = ca.fabs(r.applied) * ca.DM(lengths)
        self._weight = Call(k.function("weight", [ca.mmax(ca.densify(weights))]))
        self.sizes, self.gaps, self.n, self.m = k.sizes, k.gaps, k.n, k.m
        self.signs = setup.loose

    def at(self, x: Any, lam: Any) -> list[Any]:
        """Return f, J, phi, stiffness, damping and mass with natural sizes as units."""
        found = self._call(0.0, x, np.zeros(self.n), self.signs, lam)
        shapes = [(self.n,), (self.m, self.n), (self.m,), *[(self.n, self.n)] * 3]
        f, J, phi, K, C, M = (
            np.reshape(a, shape, order="F") for a, shape in zip(found, shapes, strict=True)
        )
        s, g = self.sizes, self.gaps
        both = np.outer(s, s)
        return [f * s, J * s / g[:, None], phi / g, -K * both, -C * both, M * both]

    def weight(self, x: Any) -> float:
        """Return the largest load on a body, times a length of the mechanism."""
        return float(self._weight(0.0, x, np.zeros(self.n), self.signs)[0].max())

    def multipliers(self, f: Any, J: Any) -> Any:
        """Return the shortest multipliers, over natural sizes, that balance forces best."""
        return np.linalg.lstsq(J.T, f, rcond=RANK)[0] if self.m else np.zeros(0)


def equilibrium(problem: Problem, name: str, task: Equilibrium) -> Result:
    """Return the result of a task of equilibrium.

    Raises
    ------
    SolveError
        No equilibrium is found from the sketch.
    InputError
        Loads that depend on the time, a number of free coordinates that is not that of the
        freedoms.
    """
    whole, x = _prepared(problem, task)
    statics = _Statics(whole)
    x, lam, left, steps = _solved(statics, x)
    _, J, phi, K, C, M = statics.at(x, lam / statics.gaps)
    basis = freedoms(J * statics.gaps[:, None] / statics.sizes, statics.sizes)
    summary: dict[str, Any] = {
        "poses": 1,
        "status": {"ok": 1},
        "freedoms": basis.shape[1],
        "coordinates": statics.n,
        "constraints": statics.m,
        "iterations": steps,
        "residual": left,
        "closure": float(np.max(np.abs(phi), initial=0.0)),
        "bound": "estimated",
        "not_in_scene": [],
    }
    along = [basis.T @ part @ basis for part in (M, C, K)]
    summary["stable"] = _stability(along[2])
    if task.linearise:
        summary |= _small_motions(whole, task, x, basis, along)
    return _report(problem, name, task, whole, x, lam / statics.gaps, summary)


def _prepared(problem: Problem, task: Equilibrium) -> tuple[Setup, Any]:
    whole = setup(problem, as_motion(task), moves=False)
    if whole.loads.uses_time:
        raise InputError("it uses t", where=f"loads.{whole.loads.uses_time[0]}")
    begin = start(whole)
    whole.held = {own: float(begin.q[whole.model.places[own]]) for own in idle(whole)}
    return whole, begin.q[whole.released.free]


def _solved(statics: _Statics, x: Any) -> tuple[Any, Any, float, int]:
    """Return coordinates, multipliers (over natural sizes), what is left and steps."""
    lam, left = np.zeros(statics.m), math.inf
    best: tuple[float, Any, Any] = (math.inf, x, lam)
    stalled = steps = 0
    while steps < STEPS:
        steps += 1
        f, J, phi, *_ = statics.at(x, lam / statics.gaps)
        if not np.isfinite(f).all():
            break
        lam = statics.multipliers(f, J)
        size = statics.weight(x)
        balance = f - J.T @ lam
        left = float(np.max(np.abs(balance))) / size if size > 0 else 0.0
        left = max(left, float(np.max(np.abs(phi), initial=0.0)))
        stalled = 0 if left < 0.5 * best[0] else stalled + 1
        if left < best[0]:
            best = (left, x, lam)
        if left == 0 or (stalled >= 3 and best[0] <= SOLVED) or stalled >= 40:
            break
        K = statics.at(x, lam / statics.gaps)[3]
        basis = freedoms(J * statics.gaps[:, None] / statics.sizes, statics.sizes)
        close = -np.linalg.lstsq(J, phi, rcond=RANK)[0] if statics.m else np.zeros(statics.n)
        stiff = basis.T @ K @ basis
        pull = basis.T @ (balance - K @ close)
        step = close + basis @ np.linalg.lstsq(stiff, pull, rcond=1e-13)[0]
        largest = float(np.max(np.abs(step), initial=0.0))
        x = x + statics.sizes * step * min(1.0, SHORT / largest if largest else 1.0)
    left, x, lam = best
    if left > ACCEPTED:
        raise SolveError(
            f"no equilibrium was found near the sketch: {left:.2g} of the forces is left after "
            f"{steps} steps",
            where="start",
            hint="sketch a pose nearer to it, or hold coordinates with drivers",
        )
    return x, lam, left, steps


def _stability(K: Any) -> str:
    """Return "stable", "unstable" or "neutral" by the stiffness along the freedoms."""
    if not len(K):
        return "stable"
    values = np.linalg.eigvals(K).real
    largest = np.max(np.abs(values))
    if values.min() < -NEUTRAL * largest:
        return "unstable"
    return "stable" if values.min() > NEUTRAL * largest else "neutral"


def _small_motions(
    whole: Setup, task: Equilibrium, x: Any, basis: Any, along: list[Any]
) -> dict[str, Any]:
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
    names, gradient = _told(whole, task, x, n)
    scaled = gradient * whole.kernel.sizes @ basis if len(names) else basis
    labels = names or [".".join(own) for own in whole.released.names]
    modes: list[dict[str, Any]] = []
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
        shape = shape / shape[np.argmax(np.abs(shape))]
        told = {
            label: [float(z.real), float(z.imag)] for label, z in zip(labels, shape, strict=True)
        }
        modes.append(
            {
                "eigenvalue": [real, swing],
                "frequency": swing / (2 * math.pi),
                "natural_frequency": size / (2 * math.pi),
                "damping": 0.0 - real / size if size else 0.0,
                "shape": told,
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
    }


def _told(whole: Setup, task: Equilibrium, x: Any, count: int) -> tuple[list[str], Any]:
    """Return the names and gradients of the coordinates that shapes are told in."""
    if task.free is None:
        return [], None
    coordinates = [named_coordinate(whole.problem.mechanism, name) for name in task.free]
    r = whole.released
    rows = r.moved(ca.vertcat(*[whole.model.coordinate(c) for c in coordinates]))
    function = whole.kernel.function("told", [ca.densify(ca.jacobian(rows, r.x))])
    signs = whole.loose
    gradient = np.array(function(0.0, x, np.zeros(len(x)), signs))
    if len(coordinates) != count:
        raise InputError(
            f"the mechanism has {count} freedoms, {len(coordinates)} coordinates are named",
            where="free",
        )
    return [c.text for c in coordinates], gradient


def _report(
    problem: Problem,
    name: str,
    task: Equilibrium,
    whole: Setup,
    x: Any,
    lam: Any,
    summary: dict[str, Any],
) -> Result:
    model, n = whole.model, len(x)
    observer = Observer(whole)
    still = np.zeros((1, n))
    signs = whole.loose[None, :]
    none = np.zeros((1, 0))
    state = States(np.zeros(1), x[None, :], still, still, lam[None, :], none, signs)
    q, v, a = observer.absolute(state)
    chosen = selection(problem.mechanism, task.outputs, forces=True)
    expressions = NamedOutputs(model, chosen.named, 2, task.outputs is not None, time=False)
    outputs: Any = Outputs(Whole(model, chosen), requests(model, list(expressions.rates)))  # type: ignore[arg-type]
    y = evaluated(model, outputs.expression, q, v, a)
    columns = outputs.columns(expressions.coordinates)
    certified = np.ones(1, bool)
    named: dict[str, Any] = outputs.named(y[:1])
    found, lost = expressions.evaluate([part[:, columns] for part in y], None, certified)
    series = {own: Series({"value": found[own]["value"]}) for own in found}
    every = observer.multipliers(state)
    reactions = {} if meshed(model) else observer.reactions(state, q, every)
    sole = unique(observer, state, q, reactions)
    for k, own in enumerate(reactions.values()):
        own[sole.lost[:, k]] = np.nan
    named["joints"] = with_reactions(named["joints"], reactions, chosen)
    summary |= sole.summary
    summary["state"] = {own: float(series[own].value[0]) for own in series}
    rows = whole.released.rows
    summary["multipliers"] = {
        row.name: float(every[0, i]) if sole.multipliers[i] else None
        for i, row in enumerate(rows)
        if (row.owner, row.part) not in whole.held
    }
    notes = whole.notes + expressions.notes + lost
    if whole.loads.slips:
        owners = ", ".join(slip.owner for slip in whole.loads.slips)
        notes.append(f"at rest {owners} resists nothing here: what it could hold is left out")
    if notes:
        summary["notes"] = notes
    return Result(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        outputs=Named("output", series),
        status=np.array(["ok"], dtype="<U11"),
        summary=summary,
        definition=task,
        unique=sole.joints,
        **named,
    )
