"""All equilibria of a mechanism that can be found, and which of them the sketch means.

With one freedom the whole circuit of the sketch is followed, and the circuits of the other
assembly modes; every change of sign of the force along it is an equilibrium. With several
freedoms Newton's method and the way downhill start from the sketch, from poses around it on its
mode, and from the other modes; what they find is a list, not a proof that there is no more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mechdae.dynamics.rest.balance import ACCEPTED, SOLVED, EquilibriumEquations, stability
from mechdae.dynamics.rest.chart import Chart
from mechdae.records import dataclass
from mechdae.types import Floats, Unknowns

NEAR = 0.35
"""Distance from the sketch within which an unstable equilibrium may be meant: 20 degrees."""
STEP, LEAST = 0.05, 1e-6
"""Step along a circuit over natural sizes, and the shortest one."""
BEND = 0.15
"""Turn of the tangent in one step."""
FAR = 60.0
"""Way along a circuit that is followed in each direction, in natural sizes."""
SAME = 1e-6
EQUAL = 1e-9
"""Share of the largest load by which forces differ that whole turns leave as they are."""
STARTS = 16
LARGE = 12
"""Freedoms from which on only the sketch is a start."""
REACH = 3.0
"""How far from the sketch starts lie, in natural sizes."""
BISECTIONS = 60
GOLDEN = (3 - math.sqrt(5)) / 2


@dataclass
class Rest:
    """An equilibrium.

    ``far`` is its distance from the sketch in natural sizes, ``on_mode`` tells whether it lies on
    the sketch's mode, ``circuit`` whether it can be reached from the sketch, None where that is
    not known; ``downhill`` whether the mechanism comes there when it is let go.
    """

    x: Floats
    lam: Floats
    left: float
    steps: int
    far: float
    on_mode: bool
    circuit: bool | None
    stable: str
    downhill: bool = False


class Rests:
    """The search for equilibria of a mechanism from its sketch."""

    def __init__(self, balance: EquilibriumEquations, chart: Chart, x: Unknowns) -> None:
        self.balance, self.chart, self.x = balance, chart, x
        self.sizes: Floats = balance.sizes
        self.wheel: Floats = balance.setup.released.coordinates.periods / self.sizes
        self.balls: list[list[int]] = balance.setup.released.coordinates.balls
        self.found: list[Rest] = []
        self.whole, self.crossed = True, False
        self.steps: int = 0
        self._enter(x, on_mode=True, circuit=True, most=0)
        if len(chart.coordinates) == 1:
            self._followed(x, True)
            for other in self._others():
                if not self._met(other):
                    self._followed(other, False)
            if self.crossed:
                for rest in self.found:
                    rest.circuit = rest.circuit or None
        elif chart.coordinates:
            self.whole = False
            self._searched()
        self.found.sort(key=lambda rest: rest.far)

    @property
    def answer(self) -> Rest | None:
        """The equilibrium the sketch means, None where none was found.

        On the sketch's mode: the nearest one if that is within the accuracy of a sketch, else the
        one that the mechanism comes to when it is let go, else the nearest stable one. Where there
        is none of these, the nearest of all.
        """
        on_mode = [rest for rest in self.found if rest.on_mode]
        if on_mode and on_mode[0].far <= NEAR:
            return on_mode[0]
        stable = [rest for rest in on_mode if rest.stable != "unstable"]
        settled = [rest for rest in on_mode if rest.downhill]
        return next(iter([*settled, *stable, *self.found]), None)

    # -- what was found --------------------------------------------------------------------

    def _far(self, x: Unknowns, y: Floats, wound: bool = True) -> float:
        gap = (self._alike(x, y) - x) / self.sizes
        return float(np.linalg.norm(gap if wound else gap - self._turns(gap)))

    def _turns(self, gap: Floats) -> Floats:
        """Return the whole turns in gaps: of angles and of places on closed curves."""
        return self.wheel * np.round(gap / np.where(self.wheel > 0, self.wheel, 1.0))

    def _equal(self, x: Unknowns, y: Floats) -> bool:
        """Return whether whole turns between two poses change no force: a spring may tell them."""
        turns = self._turns((self._alike(x, y) - x) / self.sizes)
        if not turns.any():
            return True
        moved = self.balance.light(x + self.sizes * turns)[0] - self.balance.light(x)[0]
        return float(np.max(np.abs(moved))) <= EQUAL * self.balance.weight(x)

    def _alike(self, x: Unknowns, y: Floats) -> Floats:
        """Return y with unit quaternions of the sign that is nearer to x: they are the same."""
        for ball in self.balls:
            if x[ball] @ y[ball] < 0:
                y = y.copy()
                y[ball] = -y[ball]
        return y

    def _enter(
        self, x: Unknowns, on_mode: bool, circuit: bool | None, most: float = SAME,
        downhill: bool = False,
    ) -> None:  # fmt: skip
        """Enter the equilibrium at x, polished; it must not move by more than `most`."""
        y, lam, left, steps = (x, *self._still(x)) if most == 0 else self.balance.newton(x)
        self.steps += steps
        if left > (SOLVED if most == 0 else ACCEPTED) or self._far(x, y) > max(most, SAME):
            return
        for rest in self.found:
            if self._far(rest.x, y, wound=False) < SAME * 10 and self._equal(rest.x, y):
                rest.on_mode |= on_mode
                rest.downhill |= downhill
                rest.circuit = rest.circuit or circuit
                if self._far(self.x, y) < rest.far:  # the same but for whole turns
                    rest.x, rest.lam, rest.far = y, lam, self._far(self.x, y)
                return
        _, (K, _) = self.balance.stiffness(y)
        far = self._far(self.x, y, wound=circuit is not False)
        self.found.append(Rest(y, lam, left, steps, far, on_mode, circuit, stability(K), downhill))

    def _still(self, x: Unknowns) -> tuple[Floats, float, int]:
        f, J, _ = self.balance.light(x)
        return self.balance.multipliers(f, J), self.balance.left(x), 1

    def _others(self) -> list[Floats]:
        """Return the poses of the modes at the sketch's coordinates."""
        found = [self.balance.closed(x) for x in self.chart.modes(self.x)]
        return [x for x in found if x is not None]

    # -- one freedom -----------------------------------------------------------------------

    def _force(self, x: Unknowns, along: Floats) -> tuple[float, Floats, float]:
        """Return the force along the circuit over the loads, the tangent, and the load's size."""
        f, J, _ = self.balance.light(x)
        basis = self.balance.freedoms(J)
        tangent = basis @ (basis.T @ along)
        length = float(np.linalg.norm(tangent))
        tangent = tangent / length if length else along
        size = self.balance.weight(x)
        return float(f @ tangent) / size if size > 0 else 0.0, tangent, length

    def _met(self, x: Unknowns) -> bool:
        """Return whether a circuit that was followed passes a pose."""
        return any(self._far(y, x, wound=False) < STEP and self._same(y, x) for y in self._passed)

    def _same(self, y: Floats, x: Unknowns) -> bool:
        return self.chart.signs(y) == self.chart.signs(x)

    def _followed(self, start: Any, on_mode: bool) -> None:
        """Enter all equilibria of a circuit, followed both ways from a pose."""
        if on_mode:
            self._passed: list[Any] = []
        self._passed.append(start)
        _, J, _ = self.balance.light(start)
        first = self.balance.freedoms(J)[:, 0]
        for way in (1.0, -1.0):
            self._along(start, way * first, on_mode)

    def _along(self, start: Floats, along: Floats, on_mode: bool) -> None:
        """Follow a circuit one way."""
        force, tangent, _ = self._force(start, along)
        downhill = on_mode and force > 0
        home, on = self.chart.signs(start), on_mode
        before = home
        x, step, way = start, STEP, 0.0
        trail: list[tuple[Floats, Floats, float, float]] = []
        behind = self.balance.closed(start - self.sizes * STEP * tangent)
        if behind is not None:
            pushed, turned, _ = self._force(behind, tangent)
            trail.append((behind, turned, pushed, STEP))
        while way < FAR:
            after = self.balance.closed(x + self.sizes * step * tangent)
            good = after is not None
            if good:
                ahead, turned, length = self._force(after, tangent)
                gone = self._far(x, after)
                good = length > math.cos(BEND) and gone < 1.5 * step
            if not good:
                step /= 2
                if step < LEAST:
                    self.whole = False  # a pose from which no smooth way leads on
                    return
                continue
            now = self.chart.signs(after)
            there = on and now == home
            if now != before and self._passes(x, tangent) * self._passes(after, turned) > 0:
                self.crossed = True  # the modes meet here: not at the end of a mode
            before = now
            trail = [*trail[-1:], (x, tangent, force, step)]
            roots = self._between(trail, ahead)
            changes = force != 0 and force * ahead <= 0  # a step may end on an equilibrium
            if changes and max(abs(force), abs(ahead)) > 10 * SOLVED:
                roots.append(self._root(x, step, tangent, force))
            for root in roots:
                same_mode = on and self.chart.signs(root) == home
                self._enter(root, same_mode, on_mode, 1e-4, downhill and same_mode)
                downhill = downhill and not same_mode
            on = there
            downhill = downhill and on
            way += gone
            self._passed.append(after)
            around = way > 3 * STEP and self._far(start, after, wound=False) < 0.7 * STEP
            if around and self._equal(start, after):
                return
            x, force, tangent = after, ahead, turned
            step = min(1.5 * step, STEP)
        self.whole = False

    def _passes(self, x: Unknowns, tangent: Floats) -> float:
        """Return the rate of the coordinate that tells the mode along a tangent."""
        return float(self.chart.slope(x)[-1] @ (self.sizes * tangent))

    def _between(self, trail: list[tuple[Any, Any, float, float]], ahead: float) -> list[Floats]:
        """Return two places within the last two steps where a force that is least there vanishes.

        A pair of equilibria nearer to each other than a step changes no sign from node to node.
        """
        if len(trail) < 2:
            return []
        (_, _, before, _), (_, _, least, _) = trail
        if not (abs(least) < min(abs(before), abs(ahead)) and least * before > 0 < least * ahead):
            return []
        for x, tangent, force, step in trail:
            low, high = 0.0, step
            for _ in range(BISECTIONS):
                places = [low + share * (high - low) for share in (GOLDEN, 1 - GOLDEN)]
                poses = [self.balance.closed(x + self.sizes * way * tangent) for way in places]
                if any(pose is None for pose in poses):
                    break
                found = [self._force(pose, tangent) for pose in poses]
                for way, pose, (value, turned, _) in zip(places, poses, found, strict=True):
                    if value * force < 0:
                        second = self._root(pose, 1.2 * step - way, turned, value)
                        return [self._root(x, way, tangent, force), second]
                if abs(found[0][0]) < abs(found[1][0]):
                    high = places[1]
                else:
                    low = places[0]
                if high - low < 1e-8:
                    break
        return []

    def _root(self, x: Unknowns, step: float, tangent: Floats, force: float) -> Floats:
        """Return the place in a step where the force vanishes, by bisection."""
        low, high, best = 0.0, step, x
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            pose = self.balance.closed(x + self.sizes * middle * tangent)
            if pose is None:
                break
            best = pose
            value, _, _ = self._force(pose, tangent)
            low, high = (middle, high) if value * force > 0 else (low, middle)
            if high - low < 1e-9:
                break
        return best

    # -- several freedoms --------------------------------------------------------------------

    def _searched(self) -> None:
        """Enter what Newton's method and the way downhill find from many starts."""
        home = self.chart.signs(self.x)
        self._from(self.x, home, True, True)
        if len(self.chart.coordinates) > LARGE:
            return
        for x in self._around(home):
            self._from(x, home, True, False)
        for x in self._others():
            sign = self.chart.signs(x)
            if sign != home:
                self._from(x, sign, False, False)

    def _from(self, x: Unknowns, sign: str, on_mode: bool, sketch: bool) -> None:
        def kept(pose: Unknowns) -> bool:
            return self.chart.signs(pose) == sign

        circuit = True if on_mode else None
        y, _, left, steps = self.balance.newton(x, kept)
        self.steps += steps
        if left <= ACCEPTED and kept(y):
            self._enter(y, on_mode, circuit)
        y = self.balance.settled(x, kept)
        if y is not None:
            z, _, left, steps = self.balance.newton(y)
            self.steps += steps
            if left <= ACCEPTED and kept(z) and self._far(y, z) < 1e-2:
                self._enter(z, on_mode, circuit, downhill=sketch)

    def _around(self, sign: str) -> Iterator[Floats]:
        """Yield poses around the sketch that are reached on its mode."""
        generator = np.random.default_rng(0)
        k = len(self.chart.coordinates)
        for _ in range(STARTS):
            direction = generator.normal(size=k)
            x = self._walked(direction / np.linalg.norm(direction), generator.uniform(0.3, REACH),
                             lambda pose: self.chart.signs(pose) == sign)  # fmt: skip
            yield x

    def _walked(self, along: Floats, way: float, kept: Callable[[Any], bool]) -> Floats:
        """Return the pose at the end of a way from the sketch, or where the mode ends."""
        x, before = self.x, None
        while way > 0:
            _, J, _ = self.balance.light(x)
            basis = self.balance.freedoms(J)
            if basis.shape[1] != len(along):
                return x
            step = basis @ along if before is None else basis @ (basis.T @ before)
            step *= 0.1 / max(float(np.linalg.norm(step)), 1e-300)
            after = self.balance.closed(x + self.sizes * step)
            if after is None or not kept(after):
                return x
            x, before, way = after, step, way - 0.1
        return x
