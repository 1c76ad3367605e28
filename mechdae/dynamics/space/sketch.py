"""The assembled sketch of a spatial mechanism that moves under forces.

A sketch that says all of the tree's coordinates and is a pose is that pose; else the mechanism is
assembled group by group, as a sweep does it; where that is no sweep's business what the sketch says
of joints and of points is met as well as the joints let it be, by the nearest of the poses that are
found from many starts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.dynamics.sketch import EXACT, AssembledSketch, JointClosing, shortest
from mechdae.equations.tree.reading import WIDTH, placements
from mechdae.errors import MechanismError
from mechdae.kernels.run.functions import Call
from mechdae.types import Floats, Unknowns

STARTS = 48
TIE = 1e-6
"""Difference of two distances, over the distance, at which a sketch does not tell poses apart."""
FITS = 30
SAME = 1e-6
RANK = 1e-8
LIGHT = 0.05
"""Weight of the sketch beside the joints, after a few steps with 1."""


class SpatialSketch:
    """A sketch in space, to be assembled."""

    def __init__(self, closing: JointClosing) -> None:
        self.closing = closing
        self.model: Any = closing.setup.model
        r, self.p = closing.r, closing.setup.model.p_values
        self.given: dict[int, float] = {
            closing.m + k: value for k, value in closing.sketched_places().items()
        }

        def build() -> Call:
            model: Any = r.model
            senses = ca.vertcat(ca.SX(0, 1), *[value for _, value in model.senses])
            parts = [r.moved(ca.densify(senses)), r.moved(placements(model))]
            return Call(ca.Function("sketch", [r.x, model.p], [ca.densify(part) for part in parts]))

        self._look = r.cache("sketch", build)

    def pose(self) -> tuple[Any, Any]:
        """Return the free coordinates of the assembled sketch, None and the nearest try else."""
        guess, unknown, held = self._guess()
        found: list[tuple[float, Floats]] = []
        least, nearest = np.inf, guess
        for start in self._starts(guess, unknown):
            x, left = self._tried(start)
            if not self._right(x):
                continue
            if left < least:
                least, nearest = left, x
            if left < self.closing.closed:
                found.append((self._far(x), x))
                if len(found) > 1 or not held:
                    continue
                if not unknown and found[0][0] < EXACT:
                    return x, x
                grouped = AssembledSketch(self.closing).pose(x)
                if grouped is not None:
                    return grouped, grouped
        if not found:
            return (AssembledSketch(self.closing).pose(nearest) if held else None), nearest
        far = min(gap for gap, _ in found)
        x, *tied = [pose for gap, pose in found if gap - far <= TIE * max(far, 1e-3)]
        # without joints that hold them, what turns freely stays as near as it is to angles of 0
        others = [other for other in tied if not self._same(x, other)]
        if held and others and self._told(x):
            if all(self._same(x, other, turned=False) for other in others):
                # bodies turned about and slid back through their points: the joints tell
                return 2 * (min((x, *others), key=self._turned),)
            raise MechanismError(
                "does not tell which assembly mode is meant",
                where="sketch",
                hint=f"say more of {', '.join(unknown)}: joint values, or places of points",
            )
        return x, x

    def _guess(self) -> tuple[Unknowns, list[str], bool]:
        """Return what the sketch says of coordinates, and owners of those that are to be found.

        The last result tells whether joints hold any coordinates, said or not.

        Components of quaternions are never said: the places of points tell them. What nothing is
        said of, and no joint holds, stays at zero.
        """
        closing = self.closing
        guess, unknown = np.zeros(closing.n), []
        known = {(c.part, c.word): value for c, value in closing.places.items()}
        norms = [i for i, row in enumerate(closing.r.left) if closing.r.rows[row].part == "norm"]
        held = [i for i in range(closing.m) if i not in norms]
        columns = set(closing.r.J[held, :].sparsity().get_col()) if held else set()
        cut = set(self.model._cut_joints)
        keys = {c.key for c in closing.r.coordinates}
        pointed = any(key not in keys for key in known)
        for i, free in enumerate(closing.r.coordinates):
            if free.key in known:
                guess[i] = known[free.key]
            elif free.name == "e0":
                guess[i] = 1.0
            sought = (i in columns or pointed) and free.owner not in cut
            if free.key not in known and sought:
                unknown.append(free.owner)
        return guess, list(dict.fromkeys(unknown)), bool(columns)

    def _starts(self, guess: Unknowns, unknown: list[str]) -> Iterator[Floats]:
        """Yield the guess, then poses with what is not known drawn at random."""
        yield guess
        draw, coordinates = np.random.default_rng(0), self.closing.r.coordinates
        for _ in range(STARTS if unknown else 0):
            x = guess.copy()
            for i, free in enumerate(coordinates):
                if free.owner in unknown:
                    width = np.pi if free.kind is ANGLE else 1.0
                    x[i] = self.closing.sizes[i] * draw.uniform(-width, width)
            for ball in coordinates.balls:
                if coordinates[ball[0]].owner in unknown:
                    e = draw.normal(size=4)
                    x[ball] = e / np.linalg.norm(e)
            yield x

    def _tried(self, x: Unknowns) -> tuple[Floats, float]:
        """Return x fitted to the sketch and closed, and what is left of the joints."""
        closing, m = self.closing, self.closing.m
        places = [*range(m), *self.given]
        target = np.concatenate([np.zeros(m), np.array(list(self.given.values()), float)])
        for k in range(FITS if self.given else 0):
            values, J = closing.rows(x)
            weights = np.ones(len(places))
            weights[m:] = 1.0 if 2 * k < FITS else LIGHT
            left = (values[places] - target) * weights
            if not np.isfinite(left).all():
                return x, np.inf
            step = np.linalg.lstsq(J[places] * weights[:, None], -left, rcond=RANK)[0]
            largest = float(np.max(np.abs(step), initial=0.0))
            if largest < 1e-13:
                break
            x = x + closing.sizes * step * min(1.0, 0.5 / largest)
        found, left = closing.close(x, {}, short=0.5)
        return found, left

    def _far(self, x: Unknowns) -> float:
        """Return the distance from what the sketch says, over natural sizes."""
        if not self.given:
            return 0.0
        values, _ = self.closing.rows(x)
        gaps = [values[k] - wanted for k, wanted in self.given.items()]
        turns = [self.closing.moving[k - self.closing.m].is_angle for k in self.given]
        return float(np.linalg.norm(np.where(turns, shortest(np.array(gaps)), gaps)))

    def _told(self, x: Unknowns) -> bool:
        """Return whether the sketch leaves no freedom open at a pose."""
        _, J = self.closing.rows(x)
        rows = J[[*range(self.closing.m), *self.given]]
        return bool(np.linalg.matrix_rank(rows, RANK) == self.closing.n)

    def _right(self, x: Unknowns) -> bool:
        """Return whether the axes of cut joints have the sense they should have."""
        senses = self._look(x, self.p)[0]
        return bool(np.all(senses > 0))

    def _same(self, x: Unknowns, other: Floats, turned: bool = True) -> bool:
        """Return whether all bodies have the same places in two poses, or all of their points."""
        one, two = (np.ravel(self._look(pose, self.p)[1]) for pose in (x, other))
        size = np.tile([self.closing.setup.length] * 3 + [1.0] * 9, len(one) // WIDTH)
        if turned:
            return bool(np.max(np.abs((one - two) / size), initial=0.0) < SAME)
        gaps = (self._points(one) - self._points(two)) / self.closing.setup.length
        return bool(np.max(np.abs(gaps), initial=0.0) < SAME)

    def _points(self, placed: Any) -> Any:
        """Return the places (k, 3) of all points of bodies that are placed."""
        values, found = self.model.mechanism.values(), []
        bodies = [edge.child for edge in self.model.edges]
        for body, place in zip(bodies, placed.reshape(-1, WIDTH), strict=True):
            turn = place[3:].reshape(3, 3).T
            for name in self.model.mechanism.bodies[body].points:
                local = np.array([values[f"{body}.{name}.{axis}"] for axis in "xyz"])
                found.append(place[:3] + turn @ local)
        return np.array(found).reshape(-1, 3)

    def _turned(self, x: Unknowns) -> float:
        """Return how far angles are from those said, from zero where nothing is."""
        guess, turns = self._guess()[0], self.closing.r.coordinates.turns
        return float(np.linalg.norm(shortest((x - guess)[turns])))
