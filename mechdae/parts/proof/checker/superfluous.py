"""Redundant equations of the plane: motions in closed form that meet all equations exactly.

More equations than coordinates have solutions only where numbers fit each other exactly, so the
motion is written down as sums of harmonics and put into all equations in exact numbers.
"""

from __future__ import annotations

from typing import Any

from flint import acb, arb, arb_mat

from .arithmetic import (
    ONE,
    ZERO,
    Dual,
    FalseClaim,
    Json,
    RingElement,
    ball,
    exact,
    exact_precision,
    exacts,
    field,
    need,
)
from .counts import Count, complex_poses_of
from .paths import intervals, numbered
from .plane import PlanarMechanism
from .theorems_in_plane import IN_PLANE

MOST_HARMONICS, MOST_TURNS = 60, 1000
"""Of a coordinate of a motion."""
EQUATIONS = {"revolute": 2, "weld": 3, "prismatic": 2}
"""Of a joint; others have one."""
LONGEST_GAP = 1e-4
"""Length of a step next to a change point where nothing is said of the rank."""
SHORTEST = arb(2) ** -12
"""Part of a step on which the rank has to be shown."""


class Harmonics(RingElement):
    """An exact sum of c exp(i k s) over integers k, by k; angles are sums of s and right angles."""

    def __init__(self, factors: dict[Any, acb]) -> None:
        self.factors = {k: v for k, v in factors.items() if not acb(v).is_zero()}

    def __add__(self, other: Harmonics | acb) -> Harmonics:
        more = other.factors if isinstance(other, Harmonics) else {0: acb(other)}
        keys = {*self.factors, *more}
        return Harmonics({k: self.factors.get(k, 0) + more.get(k, 0) for k in keys})

    def __mul__(self, other: Harmonics | acb) -> Harmonics:
        if not isinstance(other, Harmonics):
            return Harmonics({k: v * other for k, v in self.factors.items()})
        pairs = ((i, v, j, w) for i, v in self.factors.items() for j, w in other.factors.items())
        return sum((Harmonics({i + j: v * w}) for i, v, j, w in pairs), Harmonics({}))

    def cos(self) -> Harmonics:
        k, right_angles = (acb(self.factors.get(key, 0)).real for key in ("s", "right"))
        if not (abs(k) <= MOST_TURNS and k.is_integer() and right_angles.is_integer()):
            raise ArithmeticError("no exact cosine of such an angle")
        unit = [acb(1), acb(0, 1), acb(-1), acb(0, -1)][int(float(right_angles)) % 4]
        return _cosine(int(float(k)), unit / 2)

    def sin(self) -> Harmonics:
        return (self + Harmonics({"right": -1})).cos()

    def at(self, s: arb) -> arb:
        """Return its real value, in a ball."""
        angles, total = {"s": s, "right": arb.pi() / 2}, ZERO
        for k, factor in self.factors.items():
            value = angles[k] if k in angles else acb(0, s * k).exp()
            total += acb(factor * value).real
        return total


def _cosine(k: int, factor: acb) -> Harmonics:
    """Return factor exp(i k s) and its mirror image."""
    return Harmonics({k: factor}) + Harmonics({-k: factor.conjugate()})


class ClosedMotion(PlanarMechanism):
    """A mechanism with more equations than coordinates, and its motion in closed form."""

    def __init__(self, data: Json, at: str = "mechanism") -> None:
        place = f"{at}/superfluous"
        numbers = [exact(k, place) for k in field(data, "superfluous", list, at)]
        left_out = {int(float(k)) for k in numbers if k.is_integer()}
        super().__init__(data, at, square=False)
        self.left_out = left_out
        self._leave_out(place)
        known = len({*range(self.joint_equations)} & left_out)
        once = len(numbers) == len(left_out) == known
        need(once, place, "one stands twice, or is of no joint")
        self.need_square(at)
        self.motion: list[Harmonics] = self._motion(field(data, "motion", dict, at), f"{at}/motion")

    def _leave_out(self, place: str) -> None:
        """Set the joints that poses are counted by: those of the equations that are kept."""
        row = 0
        self.counted: dict[str, Json] = dict(self.joints)
        for name, joint in self.joints.items():
            count = EQUATIONS.get(joint["kind"], 1)
            left = len(self.left_out & {*range(row, row + count)})
            of_pin = not left or joint["kind"] == "revolute"
            need(of_pin, place, "not the number of an equation of a pin")
            if left == 1:  # what is left of a pin is a line that a point is on
                self.counted[name] = joint | {"kind": "slot"}
            elif left:
                del self.counted[name]
            row += count
        self.joint_equations = row

    def _motion(self, data: Json, at: str) -> list[Harmonics]:
        """Return the motion s -> pose that is written down; it has to meet all equations."""
        z = list[Harmonics]()
        for body in self.bodies:
            *places, angle = field(data, body, list, at)
            need(len(places) == 2, f"{at}/{body}", "not x, y and an angle")
            z += [_harmonics(rows, f"{at}/{body}") for rows in places]
            s, right_angles = exacts(angle, 2, f"{at}/{body}")
            z.append(Harmonics({"s": s, "right": right_angles}))
        with exact_precision():
            for k, row in enumerate(self.every([*z, Harmonics({"s": 1})])):
                need(not row.factors, at, f"equation {k} does not hold along the motion")
        return z

    def every(self, z: Any) -> list[Any]:
        """Return all equations."""
        return super().rows(z)

    def rows(self, z: Any) -> list[Any]:
        """Return the equations that are kept, as many as there are coordinates."""
        return [row for k, row in enumerate(self.every(z)) if k not in self.left_out]

    def pose(self, s: arb) -> list[arb]:
        """Return the pose of the motion in balls."""
        return [*(x.at(s) for x in self.motion), s]

    def is_alone(self, s: arb) -> bool:
        """Whether the Jacobian of all equations has full rank for all s in a ball."""

        def jacobian(s: arb) -> arb_mat:
            rows = self.every([Dual(x, {k: ONE}) for k, x in enumerate(self.pose(s))])
            return arb_mat([[row.d.get(k, ZERO) for k in range(self.n)] for row in rows])

        J = jacobian(s.mid())
        Y = (J.transpose() * J).inv() * J.transpose()
        loss = Y.mid() * jacobian(s) - 1
        return all(sum((abs(v).upper() for v in row), ZERO) < 1 for row in loss.tolist())


def _harmonics(data: list[object], place: str) -> Harmonics:
    """Return a sum of a cos ks + b sin ks of rows k, a, b."""
    rows = [exacts(row, 3, place) for row in data]
    orders = {float(k) for k, *_ in rows if k.is_integer()}
    why = f"more than {MOST_HARMONICS} harmonics, one that stands twice, or part of one"
    need(len(orders) == len(rows) <= MOST_HARMONICS, place, why)
    return sum((_cosine(int(float(k)), acb(a, -b) / 2) for k, a, b in rows), Harmonics({}))


def parts_of_full_rank(m: ClosedMotion, s: arb, to: arb, at: str) -> int:
    """Return the number of parts of a way on each of which the Jacobian has full rank."""
    step, least, count = to - s, abs(to - s) * SHORTEST, 0
    while s < to:
        end = to if step >= to - s else (s + step).mid()
        try:
            proved = m.is_alone(((s + end) / 2).mid() + ball((end - s) * 0.5000001))
        except ZeroDivisionError:
            proved = False
        if proved:
            s, step, count = end, step * 1.5, count + 1
        elif step < least:
            raise FalseClaim(at, f"the rank falls at {s.str(12)}")
        else:
            step = step / 2
    return count


def check_closed_sweep(m: ClosedMotion, data: Json) -> str:
    """Check the ranks along a motion and the poses on it."""
    path = field(data, "path", dict, "certificate")
    first = last = exact(path.get("at"), "path/at")
    parts, crossed, longest = 0, 0, ZERO
    for at, step, s, last in intervals(field(path, "steps", list, "path"), first):
        if step.get("change_point") is True:
            crossed, longest = crossed + 1, max(longest, last - s)
        else:
            parts += parts_of_full_rank(m, s, last, at)
    parts += not path["steps"] and m.is_alone(first)
    need(parts or crossed, "path/at", "the rank falls there")
    need(exact(path.get("to"), "path/to") == last, "path/to", "is not where the last step ends")
    why = f"{longest.str(3)} is no distance next to a change point"
    need(longest < LONGEST_GAP, "path/steps", why)
    for k, pose in enumerate(field(data, "poses", list, "certificate")):
        at = f"poses/{k}"
        place = exact(field(pose, "at", str, at), f"{at}/at")
        on_path = pose.get("status") == "ok" and first <= place <= last
        need(on_path, at, "its status is not what the path says of it")
        m.compare(m.pose(place), pose, at)
    equations = f"{len(m.left_out)} redundant equations that hold identically"
    claims = numbered(data["poses"], first, last)
    return f"{parts} parts of full rank, {crossed} change points, {equations}, {claims}"


def check_closed_modes(m: ClosedMotion, data: Json) -> str:
    """Check the mode of the motion: no other pose that theorems count meets all equations."""
    s, groups = exact(field(data, "at", str, "modes"), "at"), field(data, "groups", list, "modes")
    counted = Count(m, groups, IN_PLANE)
    boxes = [pose.box() for _, pose in complex_poses_of(m, data, s, groups, IN_PLANE)]
    every = counted.most == len(boxes) and counted.complete
    need(every, "complex", f"{len(boxes)} poses, and not all {counted.most}: {counted}")
    fit = [box for box in boxes if all(row.contains(0) for row in m.every(box))]
    one = len(field(data, "modes", list, "modes")) == 1 == len(fit)
    z = m.pose(s)
    alike = one and IN_PLANE.alike(m, groups, z, fit[0])
    need(alike, "modes", f"{len(fit)} poses may meet all equations, one does for sure")
    m.compare(z, data["modes"][0], "modes/0")
    miss = f"miss {len(m.left_out)} redundant equations"
    others = f"{counted.most - 1} of {counted.most} complex poses, {counted}, {miss}"
    return f"1 mode, and no others: {others}"
