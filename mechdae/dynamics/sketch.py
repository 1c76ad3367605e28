"""The assembled sketch of a mechanism that moves under forces: the pose that sweeps assemble too.

A sketch that is a pose is that pose. Else coordinates that could be driven keep their sketched
values, and the mechanism is assembled group by group on the mode nearest to the sketch.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from copy import copy
from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.dynamics.equations import MotionProblem
from mechdae.equations.coordinates import QUATERNION, Coordinates
from mechdae.equations.motion_equations import Released
from mechdae.errors import MechanismError, MechdaeError, SketchError
from mechdae.kernels.run.functions import Call
from mechdae.motion.kinematics.driverless import assembled, independent, likely_drivers
from mechdae.motion.kinematics.prepared import Setting
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.motion.setup.drivers import Sketch
from mechdae.numerics.null_space import freedoms
from mechdae.types import Floats, Unknowns

SX = ca.SX
CLOSED = 1e-12
"""Left-over of a constraint, over its natural size, that counts as closed."""
RANK = 1e-7
"""Share of the largest singular value up to which constraints count as dependent: those of
dimensions that hardly agree are, else the start would leave the sketch for a pose that locks."""
CORNERS = (0.0, np.pi / 2, np.pi, -np.pi / 2)
GUESSES = 256
SAME = 1e-6
EXACT = 1e-9
"""Distance from a sketch [rad, sizes] at which it is the pose but for rounding."""


class Transfer:
    """From the coordinates of a model to those of another one of the same mechanism."""

    def __init__(self, source: Any, target: Any) -> None:
        self.source, self.target = source, target

    @cached_property
    def _function(self) -> Call:
        from mechdae.equations.tree.reading import placements, reading

        source, target = self.source, self.target
        bodies = [edge.child for edge in source.edges]
        values, turns = reading(target, bodies, placements(source))
        inputs, results = [source.q, source.p, target.p], [values, turns]
        return Call(ca.Function("transfer", inputs, [ca.densify(part) for part in results]))

    def at(self, source: Any, target: Any) -> Transfer:
        """Return the same for copies of the models with other numbers."""
        other, self._function = copy(self), self._function
        other.source, other.target = source, target
        return other

    def __call__(self, q: Unknowns) -> Floats:
        """Return the coordinates (nq,) of the target at a pose (nq,) of the source."""
        found, turns = self._function(q, self.source.p_values, self.target.p_values)
        found = found.copy()
        balls = [key[0] for key in self.target.q_names if key[1] == QUATERNION[0]]
        for k, owner in enumerate(balls):
            matrix = turns[9 * k : 9 * (k + 1)].reshape(3, 3, order="F")
            places = [self.target.places[owner, name] for name in QUATERNION]
            found[places] = quaternions(matrix[None])[0]
        return found


def wound(coordinates: Coordinates, x: Unknowns, near: Mapping[tuple[str, str], float]) -> Floats:
    """Return x with angles moved by whole turns to the values they are said to be near to."""
    x = x.copy()
    for i, c in enumerate(coordinates):
        if c.period and c.key in near:
            x[i] += c.period * np.round((near[c.key] - x[i]) / c.period)
    return x


class JointClosing(Protocol):
    """What closes the joints at the start of a motion.

    ``drawn`` is the sketch, with what the start alone gives, ``said`` what the sketch itself does;
    ``aims`` are coordinates that are moved to a value, ``named`` those that the start names.
    """

    setup: MotionProblem
    r: Released
    drawn: Sketch
    said: set[NamedCoordinate]
    places: dict[NamedCoordinate, float]
    aims: dict[NamedCoordinate, float]
    named: list[NamedCoordinate]
    moving: list[NamedCoordinate]
    m: int
    n: int
    sizes: Any
    scales: Any
    closed: float
    rank: float

    def rows(self, x: Unknowns) -> tuple[Any, Any]: ...
    def close(self, x: Unknowns, aims: Any, short: float = ...) -> tuple[Any, float]: ...
    def sketched_places(self) -> dict[int, float]: ...


class AssembledSketch:
    """The sketch assembled group by group, as a sweep assembles it.

    Driven are coordinates that tell the freedoms apart: those that the start and the task name,
    drivers of other tasks, what else the sketch gives.
    """

    def __init__(self, closing: JointClosing) -> None:
        self.closing, self.setup, self.r = closing, closing.setup, closing.r
        drawn = closing.drawn.coordinates(self.setup.problem.mechanism)
        self.known: dict[NamedCoordinate, float] = drawn | closing.places

    def pose(self, rough: Floats) -> Any:
        """Return the free coordinates of the assembled sketch, None where no sweep assembles it."""
        drivers = self._drivers(rough)
        if not drivers:
            return None
        values = [self._slope(c, rough)[0] for c in drivers]
        sketch = {**dict(zip(drivers, values, strict=True)), **self.known}
        aims = {c: value for c, value in self.closing.aims.items() if c in drivers}
        why: MechdaeError | None = None
        for moved in ({}, aims):  # it may close where the start is alone
            try:
                setting, u, x = assembled(self.setup.problem, sketch | moved, drivers)
            except SketchError:
                raise
            except MechdaeError as error:
                why = why or error
                continue
            found, left = self.closing.close(self._free(setting, x, u), {})
            if left < self.closing.closed:
                self.setup.notes += setting.notes
                return found
        if why is not None:
            self.setup.notes.append(
                f"the sketch is closed by Newton's method, other assembly modes are not compared: "
                f"{why.what}"
            )
        return None

    def _drivers(self, x: Unknowns) -> list[NamedCoordinate]:
        """Return as many coordinates as there are freedoms, none where they do not tell them."""
        closing, problem = self.closing, self.setup.problem
        named = [c.text for c in closing.named]
        every = [*likely_drivers(problem, [*named, *self.setup.likely]), *self.known]
        every.sort(key=lambda c: (c not in closing.said, c not in self.known))
        basis = freedoms(closing.rows(x)[1][: closing.m], share=closing.rank)
        found = independent(every, lambda c: self._slope(c, x)[1] * closing.sizes, basis)
        return found if len(found) == basis.shape[1] else []

    def _slope(self, c: NamedCoordinate, x: Any) -> tuple[float, Floats]:
        """Return the value of a coordinate and its gradient by the free ones."""
        r, model = self.r, self.setup.model

        def build() -> Call:
            row = r.moved(model.coordinate(c))
            slope = ca.densify(ca.jacobian(row, r.x))
            return Call(ca.Function("slope", [r.x, model.p], [ca.densify(row), slope]))

        value, slope = r.cache(("slope", c.text), build)(x, model.p_values)
        return float(value[0]), np.ravel(slope)

    def _free(self, setting: Setting, pose: Unknowns, u: Floats) -> Floats:
        """Return the free coordinates at a pose of a sweep."""
        q = setting.assembler.coordinates(pose, u)
        if self.setup.problem.mechanism.dimension == 2:
            return np.array([q[c.key] for c in self.r.coordinates])
        model = setting.scene.model
        found = Transfer(model, self.setup.model)(np.array([q[key] for key in model.q_names]))
        near = {(c.part, c.word): value for c, value in self.closing.places.items()}
        return wound(self.r.coordinates, found[self.r.free], near)


class PlanarSketch:
    """A sketch in the plane, to be assembled."""

    def __init__(self, closing: JointClosing) -> None:
        self.closing, self.r = closing, closing.r

    def pose(self) -> tuple[Unknowns, Unknowns]:
        """Return the free coordinates of the assembled sketch, None and the nearest try else."""
        guess, loose, lengths = self._guess()
        tries = self._closings(guess, loose)
        first = next(tries)
        open_chain = not self.closing.m and not self.closing.said & self.closing.places.keys()
        if open_chain or (not loose and self._exact(*first, guess, lengths)):
            return first[0], first[0]
        closed: list[Floats] = []
        nearest = first
        for x, left in itertools.chain([first], tries):
            nearest = min(nearest, (x, left), key=lambda fitted: fitted[1])
            if left < self.closing.closed and not any(self._same(x, other) for other in closed):
                closed.append(x)
                grouped = AssembledSketch(self.closing).pose(x) if len(closed) == 1 else None
                if grouped is not None:
                    return grouped, grouped
        if not closed:
            return AssembledSketch(self.closing).pose(nearest[0]), nearest[0]
        if len(closed) > 1:
            bodies = list(dict.fromkeys(self.r.coordinates[i].owner for i in loose))
            raise MechanismError(
                "does not tell which assembly mode is meant",
                where="sketch",
                hint=f"add {', '.join(f'{body}_deg' for body in bodies)} to [sketch]",
            )
        return closed[0], closed[0]

    def _guess(self) -> tuple[Unknowns, list[int], list[int]]:
        """Return what the sketch says of coordinates, and constrained ones that it leaves out."""
        closing = self.closing
        guess, unknown = np.zeros(closing.n), []
        known, angles = closing.places, closing.drawn.angles
        on_curves = {c.part: value for c, value in known.items() if c.on_curve}
        for i, free in enumerate(self.r.coordinates):
            if free.owner in closing.setup.model.contacts:
                guess[i] = free.middle
                if free.kind is PLACE:
                    guess[i] = on_curves.get(free.owner, free.middle)
                unknown += [] if any(c.part == free.owner for c in known) else [i]
            elif free.kind is ANGLE:
                guess[i] = angles.get(free.owner, 0.0)
                unknown += [] if free.owner in angles else [i]
        held = set(self.r.J.sparsity().get_col()) if closing.m else set()
        lengths = np.flatnonzero(self.r.coordinates.lengths).tolist()
        return guess, [i for i in unknown if i in held], [i for i in lengths if i in held]

    def _closings(self, guess: Unknowns, loose: list[int]) -> Iterator[tuple[Floats, float]]:
        """Yield poses closed from a guess with `loose` turned about, and what is left of each."""
        closing = self.closing
        tried = itertools.product(CORNERS, repeat=len(loose))
        for corners in itertools.islice(tried, GUESSES):
            x = guess.copy()
            for i, corner in zip(loose, corners, strict=True):
                x[i] += corner * closing.sizes[i]
            x = self._placed(x)
            if closing.places:
                x, _ = closing.close(x, closing.sketched_places(), short=0.5)
            yield closing.close(x, {}, short=0.5)

    def _placed(self, x: Unknowns) -> Floats:
        """Return x with its lengths fitted while its angles stay."""
        closing = self.closing
        moved = np.flatnonzero(self.r.coordinates.lengths)
        if len(moved):
            values, J = closing.rows(x)
            values = values.copy()
            rows = list(range(closing.m))
            for k, value in closing.sketched_places().items():
                values[closing.m + k] -= value
                rows.append(closing.m + k)
            step = np.linalg.lstsq(J[rows][:, moved], -values[rows], rcond=closing.rank)[0]
            x = x.copy()
            x[moved] += closing.sizes[moved] * step
        return x

    def _exact(self, x: Unknowns, left: float, guess: Unknowns, lengths: list[int]) -> bool:
        """Return whether a closed pose is all that the sketch says, and that says all of it."""
        if left >= self.closing.closed:
            return False
        closing, places = self.closing, self.closing.sketched_places()
        values, J = closing.rows(x)
        rows = J[[closing.m + k for k in places]]
        if lengths and np.linalg.matrix_rank(rows[:, lengths], RANK) < len(lengths):
            return False
        gaps = [values[closing.m + k] - wanted for k, wanted in places.items()]
        gaps += list(((x - guess) / closing.sizes)[self.r.coordinates.turns])
        return bool(np.max(np.abs(gaps), initial=0.0) < EXACT)

    def _same(self, x: Unknowns, other: Any) -> bool:
        gap = (x - other) / self.closing.sizes
        turns = self.r.coordinates.turns
        gap[turns] = shortest(gap[turns])
        return bool(np.max(np.abs(gap), initial=0.0) < SAME)


def shortest(angles: Floats) -> Floats:
    """Return the same turns by less than half a turn to either side."""
    return np.remainder(angles + np.pi, 2 * np.pi) - np.pi
