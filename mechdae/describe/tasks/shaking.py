"""The shaking force and moment of a task as paths: named outputs of what the masses do.

The force is the sum of m a over all bodies, the moment that of its moments about the origin and of
the change of each body's own moment of momentum about its centre: what the frame has to give to the
motion, and its own bearings feel with the other sign.

In the plane the change of a body's own moment of momentum is I alpha. In space it is the sum over
P_ij u_i x u_j'', with the body's axes u and the second moments of its mass P = tr(J)/2 - J: u'' are
accelerations of points on the body, so that nothing but coordinates of points is needed. Links that
spin freely are bars, as in tasks of reactions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mechdae.describe.coordinates import coordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import MOMENTS, Body, Mechanism
from mechdae.describe.spinning_links import IdleLink, idle_links, points_of
from mechdae.describe.values import Number, Table
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.describe.tasks.kinds import Task

CENTRE = "mass_center"
"""Name of the points that are added at centres of mass; in space ``mass_x``, ``mass_y``, ``mass_z``
lie beside it along the body's axes."""
Terms = dict[str, list[str]]
"""What a body adds to each output."""


class Shaken:
    """What the masses of a mechanism add to force and moment, as texts over coordinates of points.

    Attributes
    ----------
    bodies, parameters : dict
        Those of the mechanism, with the points and numbers that are needed.
    """

    def __init__(self, mechanism: Mechanism, driven: list[str]) -> None:
        self.mechanism = mechanism
        self.bodies: dict[str, Body] = dict[str, Body](mechanism.bodies)
        self.parameters: dict[str, float | str] = dict(mechanism.parameters)
        self.step: float = mechanism.order
        self.idle: dict[str, IdleLink] = {}
        self.nodes: set[str] = set()
        if mechanism.dimension == 3:
            found = [coordinate(mechanism, text) for text in driven]
            self.idle = idle_links(mechanism, [c.part for c in found if c.kind == "point"])
            self.nodes = points_of(mechanism)

    def terms(self, name: str) -> Terms:
        """Return what a body adds, by output."""
        body = self.mechanism.bodies[name]
        if self.mechanism.dimension == 2:
            return self._in_plane(name, body)
        if name in self.idle:
            return self._bar(body, self.idle[name])
        return self._in_space(name, body)

    def _in_plane(self, name: str, body: Body) -> Terms:
        force, moment = Terms(), list[str]()
        if body.mass is not None:
            x, y = (f"{name}.{self._point(name, CENTRE, body.center)}.{axis}" for axis in "xy")
            mass = f"({body.mass})"
            force = {f"shaking_{r[-1]}": [f"{mass}*{r}.acceleration"] for r in (x, y)}
            moment = [f"{mass}*({x}*{y}.acceleration - {y}*{x}.acceleration)"]
        if body.inertia is not None:
            moment.append(f"({body.inertia})*{name}.angle.acceleration")
        return {**force, "shaking_moment": moment}

    def _in_space(self, name: str, body: Body) -> Terms:
        centre = body.center or (0.0, 0.0, 0.0)
        point = next(iter(body.points)) if name in self.nodes else self._point(name, CENTRE, centre)
        at = MassPoint(f"{name}.{point}")
        found = [] if body.mass is None else [_crossed(f"({body.mass})", at, at)]
        if body.inertia is not None:
            axes = []
            for k, axis in enumerate("xyz"):
                beside = tuple(
                    f"({c}) + {self.step!r}" if i == k else c for i, c in enumerate(centre)
                )
                axes.append(MassPoint(f"{name}.{self._point(name, f'mass_{axis}', beside)}", at))
            for (i, j), share in self._second_moments(name, body.inertia).items():
                found.append(_crossed(f"{share}/{self.step**2!r}", axes[i], axes[j]))
        terms = _summed(found)
        if body.mass is not None:
            terms |= {f"shaking_{x}": [f"({body.mass})*{at.rate(x)}"] for x in "xyz"}
        return terms

    def _second_moments(self, name: str, inertia: object) -> dict[tuple[int, int], str]:
        """Return the second moments of a body's mass about its centre that are no literal zero."""
        J = _matrix(inertia)
        found: dict[tuple[int, int], str] = {}
        for i, x in enumerate("xyz"):
            y, z = (other for other in "xyz" if other != x)
            text = f"(({J[y, y]}) + ({J[z, z]}) - ({J[x, x]}))/2"
            found[i, i] = self._number(f"{name}_{x}{x}", text)
            for j, y in enumerate("xyz"):
                if i != j and J[x, y] != 0.0:
                    found[i, j] = self._number(f"{name}_{min(x, y)}{max(x, y)}", f"-({J[x, y]})")
        return found

    def _bar(self, body: Body, link: IdleLink) -> Terms:
        """Return what a link that spins freely adds: its mass on the line, its inertia across."""
        name = link.name
        first, second = (body.points[end.split(".")[1]] for end in link.own)
        centre = body.center or (0.0, 0.0, 0.0)
        way = [
            self._number(f"{name}_way_{x}", f"({b}) - ({a})")
            for x, a, b in zip("xyz", first, second, strict=True)
        ]
        square = self._number(f"{name}_square", " + ".join(f"{w}**2" for w in way))
        start = MassPoint(link.own[0])
        line = MassPoint(link.own[1], start)
        found, terms = [], Terms()
        if body.mass is not None:
            arms = [
                self._number(f"{name}_arm_{x}", f"({c}) - ({a})")
                for x, a, c in zip("xyz", first, centre, strict=True)
            ]
            along = " + ".join(f"{c}*{w}" for c, w in zip(arms, way, strict=True))
            share = self._number(f"{name}_share", f"({along})/{square}")
            at = OnLine(start, line, share)
            found.append(_crossed(f"({body.mass})", at, at))
            terms = {f"shaking_{x}": [f"({body.mass})*{at.rate(x)}"] for x in "xyz"}
        if body.inertia is not None:  # the mean across the line
            J, sides = _matrix(body.inertia), dict(zip("xyz", way, strict=True))
            products = [
                f"({entry})*{sides[x]}*{sides[y]}" for (x, y), entry in J.items() if entry != 0.0
            ]
            axial = " + ".join(products) or "0"
            axial = self._number(f"{name}_axial", f"({axial})/{square}")
            trace = " + ".join(f"({J[x, x]})" for x in "xyz")
            across = self._number(f"{name}_across", f"({trace} - {axial})/(2*{square})")
            found.append(_crossed(across, line, line))
        return {**_summed(found), **terms}

    def _number(self, name: str, text: str) -> str:
        """Return the name of a number that is added to the parameters."""
        name = f"shaking_{name}"
        while name in self.mechanism.parameters:
            name += "_"
        self.parameters[name] = text
        return name

    def _point(self, name: str, point: str, place: tuple[Number, ...] | None) -> str:
        """Return the name of a point that is added to a body."""
        body = self.bodies[name]
        while point in body.points:
            point += "_"
        added = body.points.with_(point, place or (0.0, 0.0))
        self.bodies[name] = replace(body, points=added)
        return point


class MassPoint:
    """A point's coordinates and their accelerations, seen from another one where that is given."""

    def __init__(self, reference: str, origin: MassPoint | None = None) -> None:
        self.reference = reference
        self.origin = origin

    def value(self, axis: str) -> str:
        key = f"{self.reference}.{axis}"
        return f"({key} - {self.origin.value(axis)})" if self.origin else key

    def rate(self, axis: str) -> str:
        """Return the acceleration along an axis."""
        path = f"{self.reference}.{axis}.acceleration"
        return f"({path} - {self.origin.rate(axis)})" if self.origin else path


class OnLine(MassPoint):
    """A point at a share of a line from its start."""

    def __init__(self, start: MassPoint, line: MassPoint, share: str) -> None:
        super().__init__(start.reference)
        self.start = start
        self.line = line
        self.share = share

    def value(self, axis: str) -> str:
        return f"({self.start.value(axis)} + {self.share}*{self.line.value(axis)})"

    def rate(self, axis: str) -> str:
        return f"({self.start.rate(axis)} + {self.share}*{self.line.rate(axis)})"


def _matrix(inertia: Any) -> dict[tuple[str, str], Number]:
    """Return the entries of a matrix of inertia by its axes."""
    moments: dict[str, Number] = dict(zip(MOMENTS, (*inertia, 0.0, 0.0, 0.0), strict=False))
    return {(x, y): moments["".join(sorted(x + y))] for x in "xyz" for y in "xyz"}


def _crossed(factor: str, arm: MassPoint, pull: MassPoint) -> Terms:
    """Return a factor times the cross product of an arm and an acceleration."""
    return {
        f"shaking_moment_{x}": [
            f"{factor}*({arm.value(y)}*{pull.rate(z)} - {arm.value(z)}*{pull.rate(y)})"
        ]
        for x, y, z in ("xyz", "yzx", "zxy")
    }


def _summed(parts: list[Terms]) -> Terms:
    return {word: [text for part in parts for text in part[word]] for word in (parts or [{}])[0]}


WORDS = ("shaking/force", "shaking/moment")
"""Paths below a task."""


def shaking(dimension: int) -> dict[str, tuple[str, ...]]:
    """Return the outputs that the two paths stand for: components of force and moment."""
    axes = "xyz"[:dimension]
    turns = [f"shaking_moment_{axis}" for axis in axes] if dimension == 3 else ["shaking_moment"]
    return dict(zip(WORDS, (tuple(f"shaking_{axis}" for axis in axes), tuple(turns)), strict=True))


def shaking_paths(path: str, dimension: int) -> tuple[str, ...]:
    """Return the paths of the outputs that a path stands for, itself if it is no shaking."""
    names = shaking(dimension).get(path)
    return (path,) if names is None else tuple(f"outputs/{name}/value" for name in names)


def with_shaking(problem: Problem, tasks: Iterable[str]) -> Problem:
    """Return the problem with points at the centres of mass and outputs of what shakes the frame.

    Parameters
    ----------
    tasks
        Names of sweeps that are to have these outputs.

    Raises
    ------
    InputError
        No body has a mass; a task without accelerations.
    """
    wanted = list(dict.fromkeys(tasks))
    names = [name for names in shaking(problem.mechanism.dimension).values() for name in names]
    if not wanted or set(names) <= set(problem.mechanism.outputs):
        return problem
    driven = [d.coordinate for name in wanted for d in _sweep(problem, name).all_drivers]
    mechanism = _with_outputs(problem.mechanism, driven)
    changed: dict[str, Task] = dict(problem.tasks)
    for name in wanted:
        sweep = _sweep(problem, name)
        if sweep.derivatives < 2:
            raise InputError(
                "a shaking force needs accelerations",
                where=f"tasks.{name}.derivatives",
                hint="derivatives = 2",
            )
        if sweep.outputs is not None:
            changed[name] = replace(sweep, outputs=(*sweep.outputs, *names))
    return replace(problem, mechanism=mechanism, tasks=Table(changed), pattern=None)


def _sweep(problem: Problem, name: str) -> Any:
    return problem.tasks[name]


def _with_outputs(mechanism: Mechanism, driven: list[str]) -> Mechanism:
    shaken = Shaken(mechanism, driven)
    outputs = dict(mechanism.outputs)
    sums: Terms = {name: [] for names in shaking(mechanism.dimension).values() for name in names}
    for name, body in mechanism.bodies.items():
        if body.mass is None and body.inertia is None:
            continue
        for word, terms in shaken.terms(name).items():
            whole = f"{word}_{name}"
            if len(terms) > 1 and mechanism.dimension == 3:  # texts have a limited length
                parts = {f"{whole}_{k}": text for k, text in enumerate(terms, start=1)}
                outputs |= parts
                terms = [*parts]
            if terms:
                outputs[whole] = " + ".join(terms)
                sums[word].append(whole)
    if not any(sums.values()):
        raise InputError("no body has a mass: nothing shakes the frame", where="bodies")
    outputs |= {word: " + ".join(parts) or "0" for word, parts in sums.items()}
    return replace(
        mechanism,
        bodies=Table(shaken.bodies),
        outputs=Table(outputs),
        parameters=Table(shaken.parameters),
    )
