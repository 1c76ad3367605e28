"""Reactions from the motion alone: all equations of Newton and Euler at once, densely.

The motion, loads and inertia are read off a result as `force_audit` reads them; which forces a
joint can pass on is written here once more. All unknown forces of all joints and efforts are solved
together in 80-bit floats. At given signs friction is positively homogeneous in the unknowns x, so
that size = size'(x) x and Newton's method reads (A + G size'(x_k)) x_(k+1) = b.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

import mechdae as md
from tests.reference.force_audit import Audit, complex_
from tests.reference.force_truth import solve_linear

CALLS = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt, "exp": np.exp}
LONG = np.longdouble
STILL = 1e-10
"""Share of the fastest of its kind below which a joint does not slide."""
REAL = 1e-7
RAMP, STEPS = 4, 25


class Dense(Audit):
    """All forces of a result, solved anew."""

    def __init__(self, mechanism: md.Mechanism, result: md.Result, radius: str = "exact") -> None:
        super().__init__(mechanism, result, radius)
        self.names = list(mechanism.bodies)
        self.columns: list[np.ndarray] = []
        self.owner: list[tuple[str, int]] = []
        self.sizes: list[tuple[Callable[[Any], Any], Callable[[Any], Any]]] = []
        self.sized: list[str] = []
        self.drags: list[bool] = []

    # -- columns -----------------------------------------------------------------------------------

    def column(self, fill: Callable[[], None]) -> np.ndarray:
        """Return what a unit of something does to the bodies, (n, 3 bodies)."""
        kept = self.force, self.turn
        self.force = defaultdict(lambda: np.zeros(self.n, complex))
        self.turn = defaultdict(lambda: np.zeros(self.n))
        fill()
        found = self.stacked()
        self.force, self.turn = kept
        return found

    def stacked(self) -> np.ndarray:
        parts = []
        for name in self.names:
            force, turn = self.force[name], self.turn[name]
            parts += [np.real(force), np.imag(force), turn]
        return np.stack([np.broadcast_to(part, self.n) for part in parts], axis=1).astype(LONG)

    def unknown(self, owner: str, fill: Callable[[], None]) -> int:
        self.columns.append(self.column(fill))
        self.owner.append((owner, len(self.columns) - 1))
        return len(self.columns) - 1

    def axis(self, joint: Any) -> np.ndarray:
        return np.exp(1j * (self.angle(joint.first_body) + self.values[f"{joint.name}.axis"]))

    def sense(self, speed: Any, rate: Any, turning: bool) -> np.ndarray:
        """Return the sign of a sliding speed, where it vanishes that of the coming motion.

        Zero for a joint that does not slide.
        """
        spin = np.max([np.abs(self.spin(b)) for b in self.names], axis=0)
        growth = np.max([np.abs(self.growth(b)) for b in self.names], axis=0)
        size, change = spin, np.maximum(growth, spin**2)
        if not turning:
            points = self.r.points.values()
            size = np.max([np.abs(complex_(p.velocity)) for p in points], axis=0)
            change = np.max([np.abs(complex_(p.acceleration)) for p in points], axis=0)
            change = np.maximum(change, spin * size)
        coming = np.where(np.abs(rate) <= STILL * change, 0.0, np.sign(rate))
        return np.where(np.abs(speed) <= STILL * size, coming, np.sign(speed))

    def growth(self, body: str) -> np.ndarray:
        if body == "ground":
            return np.zeros(self.n)
        return self.r.bodies[body].angular_acceleration

    def enter(self, name: str, joint: Any, friction: bool) -> None:
        at = self.at(joint.second)
        f = self.values.get(f"{name}.friction", 0.0) if friction else 0.0
        spin = self.spin(joint.second_body) - self.spin(joint.first_body)
        growth = self.growth(joint.second_body) - self.growth(joint.first_body)
        found = self.r.joints[name]
        if isinstance(joint, md.Revolute):
            x, y = (self.unknown(name, lambda d=d: self.pair(joint, d, at)) for d in (1, 1j))
            rho = self.values.get(f"{name}.pin_radius", 0.0) * f
            rho = rho if self.radius == "article" else rho / np.sqrt(1 + f * f)
            drag = -rho * self.sense(spin, growth, True)
            G = self.column(lambda: self.pair(joint, 0j, 0j, drag))
            self.follow(name, lambda v: _length(v, x, y), lambda v: G)
        elif isinstance(joint, md.Prismatic):
            axis = self.axis(joint)
            N = self.unknown(name, lambda: self.pair(joint, 1j * axis, at))
            M = self.unknown(name, lambda: self.pair(joint, 0j, 0j, 1.0))
            half = self.values.get(f"{name}.contact_length", np.inf) / 2
            drag = -f * self.sense(found.slide_velocity, found.slide_acceleration, False)
            G = self.column(lambda: self.pair(joint, drag * axis, at))
            self.follow(name, lambda v: _grip(v, N, M, half), lambda v: G)
        elif isinstance(joint, md.PinInSlot):
            axis = self.axis(joint)
            N = self.unknown(name, lambda: self.pair(joint, 1j * axis, at))
            radius = self.values.get(f"{name}.pin_radius", 0.0)
            both = []
            for side in (-1, 1):
                speed = found.slide_velocity + side * radius * spin
                rate = found.slide_acceleration + side * radius * growth
                drag = -f * self.sense(speed, rate, False) * axis
                place = at - side * radius * 1j * axis
                both.append(self.column(lambda d=drag, p=place: self.pair(joint, d, p)))
            self.follow(
                name,
                lambda v: _grip(v, N, None, np.inf),
                lambda v: np.where((v[:, N] > 0)[:, None], both[1], both[0]),
            )
        elif isinstance(joint, md.Weld):
            for d in (1, 1j):
                self.unknown(name, lambda d=d: self.pair(joint, d, at))
            self.unknown(name, lambda: self.pair(joint, 0j, 0j, 1.0))
        elif isinstance(joint, md.Distance):
            line = at - self.at(joint.first)
            self.unknown(name, lambda: self.pair(joint, line / np.abs(line), at))
        elif isinstance(joint, md.Curve):
            self.contact(name, joint, f)
        elif isinstance(joint, md.Gear | md.Belt | md.Rack | md.FrictionWheel):
            self.mesh(name, joint)
        else:
            raise NotImplementedError(joint)

    def contact(self, name: str, joint: Any, f: float) -> None:
        """A force across the curve at the contact, friction along it; slopes by complex steps."""
        s = np.asarray(self.r.joints[name].s, float)
        frame = np.exp(1j * self.angle(joint.first_body))
        step = 1e-200
        x, y = (
            np.array([evaluate(text, {**self.values, "s": complex(v, step)}) for v in s]).imag
            for text in (joint.x, joint.y)
        )
        along = (x + 1j * y) / np.hypot(x, y) * frame
        at = self.at(joint.second)
        radius = self.values.get(f"{name}.roller_radius", 0.0)
        place = at + (1j if joint.side == "right" else -1j) * along * radius
        N = self.unknown(name, lambda: self.pair(joint, 1j * along, at))
        w = self.spin(joint.second_body), self.spin(joint.first_body)
        v2 = self.velocity(joint.second) + 1j * w[0] * (place - at)
        v1 = self.velocity(joint.first) + 1j * w[1] * (place - self.at(joint.first))
        drag = -f * np.sign(np.real((v2 - v1) * np.conj(along))) * along
        G = self.column(lambda: self.pair(joint, drag, place))
        self.follow(name, lambda v: _grip(v, N, None, np.inf), lambda v: G)

    def follow(self, name: str, slope: Any, effect: Any, drag: bool = True) -> None:
        """Add a force whose size follows from the unknowns: derivative and force per size."""
        self.sizes.append((slope, effect))
        self.sized.append(name)
        self.drags.append(drag)

    def mesh(self, name: str, joint: Any) -> None:
        carrier = joint.carrier or "ground"
        centre, other = self.at(joint.first), self.at(joint.second)
        w1, w2, wc = (self.spin(b) for b in (joint.first_body, joint.second_body, carrier))
        v1, v2 = self.velocity(joint.first), self.velocity(joint.second)
        if isinstance(joint, md.Rack):
            angle = self.angle(joint.second_body) + self.values[f"{name}.axis"]
            tangent = np.exp(1j * angle)
            radius = self.values[f"{name}.radius"]
            arm = -radius * 1j * tangent
            place, away = centre + arm, -np.sign(radius) * 1j * tangent
        elif isinstance(joint, md.FrictionWheel):
            r1, r2 = (self.values[f"{name}.{key}"] for key in ("radius", "second_radius"))
            inside = joint.contact == "internal"
            ratio = (1 if inside else -1) * r2 / r1
            line = (other - centre) / np.abs(other - centre)
            arm = (np.sign(r1 - r2) if inside else 1.0) * r1 * line
            place, tangent, away = centre + arm, 1j * line, 0j * line
        elif isinstance(joint, md.Gear):
            if joint.ratio is not None:
                ratio = self.values[f"{name}.ratio"]
            else:
                z1, z2 = (self.number(z) for z in joint.teeth)
                ratio = (1 if joint.mesh == "internal" else -1) * z2 / z1
            gap = other - centre
            with np.errstate(invalid="ignore", divide="ignore"):
                arm, line = gap / np.float64(1 - ratio), gap / np.abs(gap)
            place, tangent, away = centre + arm, 1j * line, -np.sign(ratio) * line
        else:
            ratio = self.values[f"{name}.ratio"] * (-1 if joint.crossed else 1)
            self.couple(name, joint, carrier, ratio)
            return
        with np.errstate(invalid="ignore"):
            moved = v2 + 1j * w2 * (place - other)
            slip = moved - v1 - 1j * w1 * arm
            size = np.abs((w1 - wc) * arm) + np.abs(moved)
        if np.all(np.abs(slip) <= REAL * size):
            T = self.unknown(name, lambda: self.pair(joint, tangent, place))
            if isinstance(joint, md.FrictionWheel):  # not pressed together but by its bearings
                assert joint.press is None
                return
            push = np.tan(self.values[f"{name}.pressure_angle"]) * away
            G = self.column(lambda: self.pair(joint, push, place))
            self.follow(name, lambda v: _grip(v, T, None, np.inf), lambda v: G, drag=False)
        elif isinstance(joint, md.Rack):
            # virtual work: force along the teeth at the wheel's centre, couple with the carrier

            def fill() -> None:
                self.pair(joint, tangent, centre)
                self.act(joint.first_body, 0j, 0j, -radius)
                self.act(carrier, 0j, 0j, radius)

            self.unknown(name, fill)
        else:
            self.couple(name, joint, carrier, ratio)

    def couple(self, name: str, joint: Any, carrier: str, ratio: float) -> None:
        """A torque on the second body, its share on the first, the rest on the carrier.

        (w1 - wc) = ratio (w2 - wc): the powers cancel.
        """

        def fill() -> None:
            self.act(joint.second_body, 0j, 0j, 1.0)
            self.act(joint.first_body, 0j, 0j, -1 / ratio)
            self.act(carrier, 0j, 0j, 1 / ratio - 1)

        self.unknown(name, fill)

    # -- solving -----------------------------------------------------------------------------------

    def solve(self, friction: bool) -> None:
        """Solve for all unknowns, ``x`` (n, unknowns)."""
        for name, joint in self.m.joints.items():
            self.enter(name, joint, friction)
        for coordinate in self.r.efforts:
            self.unknown(f"effort {coordinate}", lambda c=coordinate: self.along(c, 1.0))
        self.loads()
        self.inertia()
        right = -self.stacked()
        A = np.stack(self.columns, axis=2)
        assert A.shape[1] == A.shape[2], "redundant or not driven"
        scale = np.abs(A).max(axis=2, keepdims=True)
        A, right = A / scale, right / scale[:, :, 0]
        x = solve_linear(A, right)
        for factor in np.linspace(0, 1, RAMP + 1)[1:] if friction else (1.0,):
            for _ in range(STEPS):
                J = A.copy()
                for (slope, effect), drag in zip(self.sizes, self.drags, strict=True):
                    G = effect(x) / scale[:, :, 0] * LONG(factor if drag else 1)
                    J += G[:, :, None] * slope(x)[:, None, :]
                new = solve_linear(J, right)
                size = np.maximum(np.abs(new).max(axis=1), LONG(1e-300))
                self.left = np.abs(new - x).max(axis=1) / size
                x = new
                if np.all(self.left < 1e-17):
                    break
        self.x = x
        self.final = [
            effect(x) * (slope(x) * x).sum(axis=1)[:, None] for slope, effect in self.sizes
        ]

    def wrench(self, name: str, body: str) -> np.ndarray:
        """Return the whole action of a joint on a body, moment about the origin, (n, 3)."""
        row = 3 * self.names.index(body)
        total = np.zeros((self.n, 3), LONG)
        for owner, k in self.owner:
            if owner == name:
                total += (self.columns[k] * self.x[:, k, None])[:, row : row + 3]
        for own, effect in zip(self.sized, self.final, strict=True):
            if own == name:
                total += effect[:, row : row + 3]
        return total

    def reaction(self, name: str) -> np.ndarray:
        """Return Fx, Fy and M about the second body's point, on the second body."""
        joint = self.m.joints[name]
        if joint.second_body != "ground":
            whole = self.wrench(name, joint.second_body)
        else:
            whole = -self.wrench(name, joint.first_body)
        at = self.at(joint.second)
        turn = whole[:, 2] - (at.real * whole[:, 1] - at.imag * whole[:, 0])
        return np.stack([whole[:, 0], whole[:, 1], turn], axis=1)

    def effort(self, coordinate: str) -> np.ndarray:
        (k,) = [k for owner, k in self.owner if owner == f"effort {coordinate}"]
        return self.x[:, k]

    def misses(self) -> float:
        """Return the largest difference to the result, relative to the largest of its kind."""
        force, turn, gaps = LONG(0), LONG(0), []
        done = self.left < 1e-14
        if not done.any():
            return float("nan")
        for name in self.m.joints:
            own = self.reaction(name)
            gap = np.abs(own - self.r.joints[name].reaction)[done]
            gaps.append((np.max(gap[:, :2]), np.max(gap[:, 2])))
            force = max(force, np.abs(own[:, :2]).max())
            turn = max(turn, np.abs(own[:, 2]).max())
        for coordinate, effort in self.r.efforts.items():
            own = self.effort(coordinate)
            gap = np.abs(own - effort)[done].max()
            pushes = not coordinate.endswith("angle")
            gaps.append((gap, 0) if pushes else (0, gap))
            force = max(force, np.abs(own).max()) if pushes else force
            turn = turn if pushes else max(turn, np.abs(own).max())
        turn = max(turn, force * self.length())
        return float(max(max(a / force, b / turn) for a, b in gaps))

    def length(self) -> float:
        """Return the largest distance of two points."""
        places = [self.at(f"{b}.{p}") for b in self.names for p in self.m.bodies[b].points]
        return float(max(np.abs(a - b).max() for a in places for b in places))


def evaluate(text: str, values: dict[str, Any]) -> complex:
    """Return the value of an expression of a curve, complex numbers among its values."""
    return complex(eval(str(text), {"__builtins__": {}}, {**CALLS, **values}))


def _length(v: Any, x: int, y: int) -> Any:
    """Return the derivative of the length of two unknowns, (n, unknowns)."""
    g = np.zeros_like(v)
    whole = np.hypot(v[:, x], v[:, y])
    whole = np.where(whole == 0, 1, whole)
    g[:, x], g[:, y] = v[:, x] / whole, v[:, y] / whole
    return g


def _grip(v: Any, N: int, M: int | None, half: float) -> Any:
    """Return the derivative of max(|N|, |M| / half)."""
    g = np.zeros_like(v)
    tilts = np.zeros(len(v), bool) if M is None else np.abs(v[:, M]) > half * np.abs(v[:, N])
    g[:, N] = np.where(tilts, 0, np.sign(v[:, N]))
    if M is not None:
        g[:, M] = np.where(tilts, np.sign(v[:, M]) / LONG(half), 0)
    return g


__all__ = ["Dense"]
