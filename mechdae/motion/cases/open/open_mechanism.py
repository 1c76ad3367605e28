"""A mechanism that does not close, drawn all the same: open at a joint, the gap as small as can be.

All other joints are closed exactly and the drivers stay where they are; what is least is half
the square of the gap, by Newton's method with the second derivatives of all equations. At the
least gap its derivative by each length is what says which links are too short or too long.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.expression import evaluate
from mechdae.describe.file.load import chosen
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.values import Number
from mechdae.equations.model import Model
from mechdae.errors import SolveError
from mechdae.kernels.run.functions import Call
from mechdae.motion.setup.drivers import plan, sketched
from mechdae.records import dataclass, public
from mechdae.results import FINE, Named, Result, Series, Status, Summary, SweepResult, statuses
from mechdae.types import Floats, Json, Unknowns

CLOSED = 1e-9
"""Gap over a length of the mechanism, or in radians, that counts as closed."""
STEPS = 300
LARGEST = 0.5
"""Largest step, in lengths of the mechanism and radians."""
MOST = 3
"""Joints that are opened at most."""
TRIED = 8
"""Joints of one loop that are tried: the gap is drawn where it is least."""
PULLS = 0.5
"""Change of the gap with a length from which the length is said to be too short or too long."""


@dataclass(frozen=True)
class Open:
    """A pose with joints that stay open: coordinates, values of their equations, prices."""

    joints: tuple[str, ...]
    q: Unknowns
    size: float
    prices: Floats


@public
def open_pose(
    problem: Problem | str | Path,
    task: str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    result: Result | None = None,
    pose: int | None = None,
) -> SweepResult:
    """Return the pose of a mechanism that does not close, with its gap as small as can be.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        The task whose drivers' values are kept: those of the sketch, else of its first pose.
    set
        Numbers to change, as of `md.solve`.
    result, pose
        A result of that task and the index of a pose that is not assembled: the drivers'
        values are those of that pose, and the links start from the nearest assembled one.

    Returns
    -------
    Result
        One pose with status unassembled; ``summary["open"]`` lists the open joints with gap,
        unit and the places ``from`` and ``to``; ``too_short`` and ``too_long`` the lengths and
        drivers whose change closes it, ``by`` how much to first order.

    Raises
    ------
    SolveError
        The mechanism closes, or no joint alone leaves the others closed.

    Examples
    --------
    >>> pose = md.open_pose(md.four_bar(0.1, 0.04, 0.12, 0.08), set={"coupler": 0.5})
    >>> gap = pose.summary["open"][0]
    >>> gap["joint"], round(gap["gap"], 4)
    ('C', 0.3328)
    """
    whole, name = chosen(problem, task, set)
    meant = whole.tasks[name]
    mechanism = _plain(whole.mechanism)
    equations = _Equations(mechanism, *_driven(whole.mechanism, meant, result, pose))
    if result is not None and pose is not None:
        equations.keep(result, pose)
    start = equations.start(*_sketch(whole.mechanism, result, pose))
    found = equations.least(start)
    return _report(whole, name, meant, equations, found)


def _plain(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with numbers in place of expressions."""
    values = mechanism.values()
    changes = {
        name: values[name] for name, number in mechanism.numbers() if isinstance(number, str)
    }
    return mechanism.with_values(changes)


def _driven(
    mechanism: Mechanism, task: Task, result: Result | None, pose: int | None
) -> tuple[list[NamedCoordinate], list[float]]:
    """Return the drivers that have a value at the start, and their values."""
    if result is not None and pose is not None and result.drivers:
        drivers = {text: float(series.position[pose]) for text, series in result.drivers.items()}
        return [coordinate(mechanism, text) for text in drivers], list(drivers.values())
    if isinstance(task, Driven):
        numbers = plan(mechanism, task)
        first = (
            np.full(len(numbers.coordinates), np.nan) if numbers.first is None else numbers.first
        )
        values = np.where(np.isnan(numbers.sketch), first, numbers.sketch)
        pairs = list(zip(numbers.coordinates, values.tolist(), strict=True))
    else:
        known = mechanism.parameter_values
        listed = [
            driver for driver in getattr(task, "drivers", None) or () if driver.at is not None
        ]
        pairs = [(coordinate(mechanism, d.coordinate), evaluate(d.at[0], known)) for d in listed]
    return [c for c, v in pairs if not np.isnan(v)], [v for _, v in pairs if not np.isnan(v)]


def _sketch(
    mechanism: Mechanism, result: Result | None, pose: int | None
) -> tuple[dict[str, float], dict[NamedCoordinate, float]]:
    """Return rough angles of bodies and values of other coordinates."""
    drawn = sketched(mechanism)
    if result is None or pose is None:
        return drawn.angles, drawn.places
    status = np.asarray(result.status)
    known = np.flatnonzero(np.isin(status, FINE))
    if not len(known):
        return drawn.angles, drawn.places
    near = int(known[np.argmin(np.abs(known - pose))])
    found = {
        body: float(series.angle[near])
        for body, series in result.bodies.items()
        if "angle" in series
    }
    return drawn.angles | found, {}


class _Equations:
    """Equations of the joints and the drivers as arrays, with their second derivatives."""

    def __init__(
        self, mechanism: Mechanism, drivers: list[NamedCoordinate], values: list[float]
    ) -> None:
        names = [name for name, _ in mechanism.numbers()]
        self.mechanism, self.model = mechanism, Model(mechanism, free=names)
        self.scale = mechanism.scale
        self.rows, u = self.model.driven(drivers)
        self.u, self.drivers = np.array(values), drivers
        self.sizes = np.array([self.scale if row.unit == "m" else 1.0 for row in self.rows])
        self.owners = [row.owner for row in self.rows]
        self.lengths = self.model.coordinates.lengths
        self.units = np.where(self.lengths, self.scale, 1.0)
        self.q0, self.free = np.zeros(len(self.units)), np.ones(len(self.units), bool)
        model, q = self.model, self.model.q
        phi = ca.vertcat(*[row.expression for row in self.rows]) / self.sizes
        prices = ca.SX.sym("prices", len(self.rows))
        scaled = ca.DM(self.units)
        slope = ca.jacobian(phi, q) @ ca.diag(scaled)
        bent = ca.hessian(ca.dot(prices, phi), q)[0]
        bent = ca.diag(scaled) @ bent @ ca.diag(scaled)
        by_numbers = ca.gradient(ca.dot(prices, phi), ca.vertcat(model.p, u))
        inputs, rest = [q, u, model.p], [ca.densify(column) for column in (phi, slope)]
        self._values = Call(ca.Function("open", inputs, rest))
        self._bent = Call(ca.Function("bent", [*inputs, prices], [ca.densify(bent)]))
        self._by = ca.Function("by", [*inputs, prices], [ca.densify(by_numbers)])

    def keep(self, result: Result, pose: int) -> None:
        """Keep the bodies that a pose of a result has a place for: groups before the open one."""
        values = self.mechanism.values()
        for body in self.mechanism.bodies:
            anchor = f"{body}.{self.model.anchor(body)}"
            angle = result.bodies.get(body, {}).get("angle")
            point = result.points.get(anchor, {}).get("position")
            if angle is None or point is None or not np.isfinite(point[pose]).all():
                continue
            assert f"{anchor}.x" in values
            places = self.model.twist(body)
            self.q0[places], self.free[places] = (*point[pose], angle[pose]), False

    def moved(self, q: Unknowns, step: Floats, most: float = 1.0) -> Floats:
        """Return coordinates after a step of the free ones, in their sizes."""
        after = q.copy()
        after[self.free] += most * self.units[self.free] * step
        return after

    def at(self, q: Unknowns) -> tuple[Any, Any]:
        """Return the equations over their sizes, and their slopes by the free coordinates."""
        phi, slope = self._values(q, self.u, self.model.p_values)
        return phi, np.reshape(slope, (len(self.rows), len(q)), order="F")[:, self.free]

    def bent(self, q: Unknowns, prices: Floats) -> Any:
        """Return the second derivatives of the equations, weighted by their prices."""
        found = self._bent(q, self.u, self.model.p_values, prices)[0]
        return np.reshape(found, (len(q), len(q)), order="F")[np.ix_(self.free, self.free)]

    def by_numbers(self, found: Open) -> tuple[dict[str, float], dict[str, float]]:
        """Return the change of the gap [m or rad over the unit] by numbers, and by drivers."""
        slopes = np.array(self._by(found.q, self.u, self.model.p_values, found.prices)).ravel()
        slopes = slopes * self.scale**2 / found.size  # prices are of half the square, scaled
        split = len(self.model.p_names)
        texts = [c.text for c in self.drivers]
        return (
            dict(zip(self.model.p_names, slopes[:split].tolist(), strict=True)),
            dict(zip(texts, slopes[split:].tolist(), strict=True)),
        )

    # -- poses -----------------------------------------------------------------------------------

    def start(self, angles: dict[str, float], places: dict[NamedCoordinate, float]) -> Floats:
        """Return the pose at which the equations are violated least, from a rough one."""
        q = self.q0.copy()
        for k, c in enumerate(self.model.coordinates):
            if c.kind is ANGLE and c.owner in angles and self.free[k]:
                q[k] = angles[c.owner]
        moving = self.lengths[self.free]
        for _ in range(3):  # the places of the bodies first, with the angles as drawn
            phi, slope = self.at(q)
            step = np.zeros(len(moving))
            step[moving] = -np.linalg.lstsq(slope[:, moving], phi, rcond=1e-9)[0]
            q = self.moved(q, step)
        damping = 1e-3
        phi, slope = self.at(q)
        for _ in range(STEPS):
            matrix = np.vstack([slope, np.sqrt(damping) * np.eye(slope.shape[1])])
            right = np.concatenate([-phi, np.zeros(slope.shape[1])])
            trial = self.moved(q, np.linalg.lstsq(matrix, right, rcond=None)[0])
            after, bent = self.at(trial)
            if after @ after < phi @ phi:
                small = phi @ phi - after @ after < 1e-16 * (phi @ phi)
                q, phi, slope, damping = trial, after, bent, max(damping / 5.0, 1e-12)
                if small:
                    break
            else:
                damping *= 4.0
                if damping > 1e9:
                    break
        return q

    def least(self, start: Floats) -> Open:
        """Return the pose with the least gap of all joints that may be opened."""
        phi, _ = self.at(start)
        if np.max(np.abs(phi), initial=0.0) <= CLOSED:
            raise SolveError(
                "the mechanism closes at this pose", hint="draw the result of the task"
            )
        left: dict[str, float] = {}
        for owner, value in zip(self.owners, phi, strict=True):
            left[owner] = float(np.hypot(left.get(owner, 0.0), value))
        worst = max(left.values())
        candidates = sorted(
            (name for name in self.mechanism.joints if left.get(name, 0.0) > 1e-6 * worst),
            key=lambda name: (self._order(name), -left[name]),
        )
        found = []
        for name in candidates[:TRIED]:
            attempt = self._opened((name,), start)
            if attempt is not None:
                found.append(attempt)
        if not found:
            chosen: tuple[str, ...] = ()
            for name in sorted(candidates, key=lambda name: -left[name])[:MOST]:
                chosen = (*chosen, name)
                attempt = self._opened(chosen, start) if len(chosen) > 1 else None
                if attempt is not None:
                    return attempt
            raise SolveError("no joint alone leaves the others closed: several loops are open")
        least = min(attempt.size for attempt in found)
        return next(attempt for attempt in found if attempt.size <= least * (1 + 1e-6))

    def _order(self, name: str) -> tuple[int, bool, bool]:
        """Return what is opened first: pins between moving links that are not driven."""
        joint = self.mechanism.joints[name]
        driven = {c.part for c in self.drivers}
        return joint.opening, GROUND in joint.bodies, bool(driven & set(joint.bodies))

    def _opened(self, names: tuple[str, ...], start: Floats) -> Open | None:
        """Return the pose with the least gap in some joints, None where others stay open too."""
        loose = np.array([owner in names for owner in self.owners])
        if any(self.rows[k].unit != "m" for k in np.flatnonzero(loose).tolist()):
            return None  # wheels and guides that turn have no gap that is a length
        q, prices = start.copy(), np.zeros(len(self.rows))
        for _ in range(STEPS):
            phi, slope = self.at(q)
            tight, pull = slope[~loose], slope[loose].T @ phi[loose]
            prices[loose] = phi[loose]
            prices[~loose] = np.linalg.lstsq(tight.T, -pull, rcond=1e-9)[0]
            back = np.linalg.lstsq(tight, -phi[~loose], rcond=1e-9)[0]
            _, sizes, axes = np.linalg.svd(tight)
            rank = int((sizes > 1e-9 * sizes.max(initial=0.0)).sum()) if sizes.size else 0
            along = axes[rank:].T
            step = back
            if along.size:
                bent = slope[loose].T @ slope[loose] + self.bent(q, prices)
                values, vectors = np.linalg.eigh(along.T @ bent @ along)
                values = np.maximum(np.abs(values), 1e-6 * max(np.abs(values).max(), 1e-12))
                right = along.T @ (pull + bent @ back)
                step = back - along @ (vectors @ ((vectors.T @ right) / values))
            largest = float(np.max(np.abs(step), initial=0.0))
            q = self.moved(q, step, min(1.0, LARGEST / largest if largest else 1.0))
            if largest < 1e-12:
                break
        phi, slope = self.at(q)
        pull = slope[loose].T @ phi[loose]
        prices[loose] = phi[loose]
        prices[~loose] = np.linalg.lstsq(slope[~loose].T, -pull, rcond=1e-9)[0]
        rest = pull + slope[~loose].T @ prices[~loose]
        gap = float(np.linalg.norm(phi[loose]))
        closed = np.max(np.abs(phi[~loose]), initial=0.0) <= CLOSED
        if not closed or float(np.max(np.abs(rest))) > 1e-6 * max(gap, CLOSED):
            return None
        return Open(names, q, gap * self.scale, prices)


def _report(
    problem: Problem, name: str, task: Task, equations: _Equations, found: Open
) -> SweepResult:
    model = equations.model
    mechanism = problem.mechanism
    points = [f"{body}.{point}" for body, link in mechanism.bodies.items() for point in link.points]
    grounds = [f"{GROUND}.{point}" for point in mechanism.ground.points]
    angles = ca.vertcat(*[model.frame(body).angle for body in mechanism.bodies])
    places = ca.horzcat(*[model.point(reference) for reference in (*points, *grounds)])
    function = ca.Function("placed", [model.q, model.p], [angles, places])
    turned, placed = (np.array(part) for part in function(found.q, model.p_values))
    at = dict(zip((*points, *grounds), placed.T, strict=True))
    gaps = [_gap(equations, joint, found.q, at) for joint in found.joints]
    short, long_ = _to_blame(equations, found)
    words = ", ".join(f"{gap['joint']} by {gap['gap']:.4g} {gap['unit']}" for gap in gaps)
    summary: Json = {
        "poses": 1,
        "status": {"unassembled": 1},
        "open": gaps,
        "too_short": short,
        "too_long": long_,
        "bound": "estimated",
        "not_in_scene": [],
    }
    return SweepResult(
        problem.name,
        name,
        task.kind if isinstance(task, Driven) else "sweep",
        mechanism,
        problem.title,
        drivers=Named(
            "driver",
            {
                c.text: Series({"position": np.array([value])})
                for c, value in zip(equations.drivers, equations.u.tolist(), strict=True)
            },
        ),
        bodies=Named(
            "body",
            {body: Series({"angle": turned[k]}) for k, body in enumerate(mechanism.bodies)},
        ),
        points=Named(
            "point", {point: Series({"position": at[point][None, :]}) for point in points}
        ),
        status=statuses(1, Status.UNASSEMBLED),
        summary=Summary(summary),
        fault=f"the mechanism does not close: drawn open at {words}{said(summary)}",
        definition=task,
    )


def said(summary: Json) -> str:
    """Return what is too short or too long, in words, empty where nothing is known."""
    parts = [
        f"{word}: {', '.join(event['what'] for event in summary[key])}"
        for key, word in (("too_short", "too short"), ("too_long", "too long"))
        if summary[key]
    ]
    return "; " + "; ".join(parts) if parts else ""


def _gap(equations: _Equations, name: str, q: Unknowns, at: dict[str, Floats]) -> Json:
    """Return the gap of an open joint: from the first point, or the foot on its guide."""
    joint = equations.mechanism.joints[name]
    first, second = at[joint.first], at[joint.second]
    phi, _ = equations.at(q)
    rows = np.array([owner == name for owner in equations.owners])
    size = float(np.linalg.norm((phi * equations.sizes)[rows]))
    if not joint.coincide:
        way = second - first
        length = float(np.hypot(*way))
        # the foot on a guide or a curve, or the end of a rod of its length
        axis = equations.mechanism.values().get(f"{name}.axis")
        if joint.slot and axis is not None:
            k = None if joint.first_body == GROUND else equations.model.turn(joint.first_body)
            turn = axis + (q[k] if k is not None else 0.0)
            along = np.array([np.cos(turn), np.sin(turn)])
            first = first + float(way @ along) * along
        elif joint.bar and length > 0:
            wanted = equations.mechanism.values()[f"{name}.length"]
            first, size = first + way * wanted / length, abs(length - wanted)
    return {
        "joint": name,
        "gap": size,
        "unit": "m",
        "from": [float(value) for value in first],
        "to": [float(value) for value in second],
    }


def _to_blame(equations: _Equations, found: Open) -> tuple[list[Json], list[Json]]:
    """Return the lengths and drivers that are too short, and those that are too long."""
    numbers, drivers = equations.by_numbers(found)
    rows = list(_lengths(equations.mechanism, numbers))
    rows += [(c.text, drivers[c.text]) for c in equations.drivers if c.unit == "m"]
    short: list[Json] = []
    long_: list[Json] = []
    for what, slope in sorted(rows, key=lambda row: -abs(row[1])):
        if abs(slope) >= PULLS:
            entry = {"what": what, "by": found.size / abs(slope), "slope": slope}
            (short if slope < 0 else long_).append(entry)
    return short, long_


def _lengths(mechanism: Mechanism, numbers: dict[str, float]) -> Iterator[tuple[str, float]]:
    """Yield the lengths between the joints of each link with the change of the gap by them."""
    values = mechanism.values()
    used: dict[str, list[str]] = {}
    for joint in mechanism.joints.values():
        for side in (joint.first, joint.second):
            body, point = side.split(".")
            if point not in used.setdefault(body, []):
                used[body].append(point)
        if joint.bar:
            yield f"{joint.name}.length", numbers.get(f"{joint.name}.length", 0.0)
    for body, points in used.items():
        for a, b in itertools.combinations(points, 2):
            way = np.array([values[f"{body}.{b}.{x}"] - values[f"{body}.{a}.{x}"] for x in "xy"])
            length = float(np.hypot(*way))
            if length == 0:
                continue
            along = way / length
            ends = (_slope(numbers, f"{body}.{b}"), -_slope(numbers, f"{body}.{a}"))
            pulls = [float(end @ along) for end in ends]
            slope = min(pulls, key=abs) if pulls[0] * pulls[1] > 0 else 0.0
            yield f"{body} {a}-{b}", slope


def _slope(numbers: dict[str, float], point: str) -> Floats:
    return np.array([numbers.get(f"{point}.{axis}", 0.0) for axis in "xy"])
