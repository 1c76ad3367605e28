"""Random mechanisms, among them such that are near-singular on purpose.

`draw(seed)` returns a `Case` that closes at its sketch.
"""

from __future__ import annotations

import numpy as np

from .case import Doubtful
from .drawn_changes import Changes
from .drawn_dyads import DYADS
from .drawn_places import Failed
from .elements import Element

TURN = 2 * np.pi
FAMILIES = {
    "dyads": 0.22,  # chains of dyads
    "gears": 0.14,  # with wheels, belts, racks and planets
    "triads": 0.22,  # a platform on three legs somewhere in the chain
    "geared": 0.05,  # two links and a gear that close together
    "change": 0.07,  # a four-bar that comes near a change point
    "exact": 0.04,  # a dyad that goes through change points
    "saddle": 0.06,  # a platform that comes near a double root
    "toggle": 0.05,  # dyads nearly straight at the sketch
    "slender": 0.05,  # links of very different lengths
    "end": 0.07,  # poses that crowd at a limit position
    "far": 0.03,  # drivers far from zero
    "parallel": 0.0,  # elements side by side on the crank, drawn only where they are asked for
}
GEARS = ("gear", "gear", "belt", "planet", "rack", "pinion", "weld")


class Drawer(Changes):
    """Builds one random case, see `Places` for what can be chosen."""

    def draw(self):
        rng, case, size = self.rng, self.case, self.scale
        exact = self.family == "exact"
        self.origin = complex(*rng.normal(size=2)) * size * rng.choice([0, 1])
        self.begin()
        if exact:  # numbers that add without rounding
            self.origin = complex(*rng.integers(-8, 9, 2)) / 8 * size
        self.point("ground", "O", self.origin)
        arm = self.uniform(0.3, 1.2) * size
        if self.family == "slender" and rng.random() < 0.5:
            arm *= 10.0 ** -self.uniform(0, 4)
        if exact:
            arm = float(rng.integers(3, 13) / 8) * size
        self.arm = arm
        getattr(self, f"drive_{self.driver}")(arm, exact)
        if self.family == "change":
            self.near_change()
        elif self.family == "exact":
            self.through_change()
        elif self.family == "saddle":
            self.near_saddle()
        else:
            self.chain()
        self.task()
        return case

    def drive_crank(self, arm, exact):
        case, rng = self.case, self.rng
        far = 1000 if self.family == "far" else 3
        case.s0 = self.uniform(-far, far)
        turn = 1.0 if exact else np.exp(1j * self.angle())
        self.frame({"O": 0j, "p2": arm * turn}, "crank", plain=exact)
        case.joints.append(("revolute", "main", "ground.O", "crank.O", {}))
        if rng.random() < 0.1:
            case.coordinate = case.driver_key = "main.angle"
            case.driver_key = "main"
        self.done("crank", 0, {}, ())

    def drive_ram(self, arm, exact):
        del exact
        case = self.case
        case.s0 = self.uniform(-0.5, 0.5) * self.scale
        data = {"axis": self.angle(), "turn": self.angle()}
        self.frame({"O": 0j, "p2": arm * np.exp(1j * self.angle())}, "ram")
        case.joints.append(("prismatic", "guide", "ground.O", "ram.O", dict(data)))
        case.coordinate, case.driver_key = "guide.slide", "guide"
        self.done("ram", 0, data, ())

    def drive_cylinder(self, arm, exact):
        """A link on the ground, pushed by a cylinder whose slide is the driver."""
        del exact
        case, size = self.case, self.scale
        self.point("ground", "Q", self.origin + self.vector() + size * np.exp(1j * self.angle()))
        length = self.uniform(0.4, 1.2) * size
        points = {"O": 0j, "p1": length * np.exp(1j * self.angle()), "p2": self.vector()}
        self.frame(points, "crank")
        barrel = self.frame({"p0": 0j, "slot": self.vector(0.3)})
        rod = self.frame({"p1": 0j, "guided": self.vector(0.3), "p2": self.vector()})
        data = {"barrel": barrel, "rod": rod, "axis": self.angle(), "turn": self.angle()}
        case.joints += [
            ("revolute", "main", "ground.O", "crank.O", {}),
            ("revolute", "foot", "ground.Q", f"{barrel}.p0", {}),
            ("revolute", "head", "crank.p1", f"{rod}.p1", {}),
            ("prismatic", "stroke", f"{barrel}.slot", f"{rod}.guided",
             {"axis": data["axis"], "turn": data["turn"]}),
        ]  # fmt: skip
        case.coordinate, case.driver_key = "stroke.slide", "stroke"
        sign = int(self.rng.choice([-1, 1]))
        added, mark = list(self.added), len(case.joints)
        for _ in range(40):
            case.s0 = self.uniform(-2, 2) * size
            self.added, self.mark = list(added), mark
            element = Element("cylinder", sign, data, (), tuple(added))
            case.elements.append(element)
            disc = float(self.world().discs[-1].c[0][0].real)
            if disc > 0.03:
                for body in added:
                    case.maker[body] = 0
                return
            case.elements.pop()
        raise Failed

    def chain(self):
        rng = self.rng
        kinds = list(self.kinds or DYADS)
        count = self.count
        must = {"gears": GEARS, "triads": ("triad",), "geared": ("geared",)}.get(self.family)
        if self.family == "end" and rng.random() < 0.35:
            must = ("triad",)
        if self.family == "parallel" and rng.random() < 0.4:
            must = ("triad", "geared", "planet", "gear", "gear")
            must = must if self.driver == "crank" else ("triad",)
        when = int(rng.integers(count)) if must else -1
        for number in range(count):
            for _ in range(40):
                pool = must if number == when and not self.kinds else kinds
                if self.add(str(rng.choice(pool))):
                    break
            else:
                raise Failed

    def task(self):
        rng, case = self.rng, self.case
        case.speed = float(rng.choice([1.0, -2.5, 7.0]))
        case.acceleration = float(rng.choice([0.0, 3.0]))
        unit = case.unit
        if not case.angular:
            case.speed *= unit
            case.acceleration *= unit
        half = self.uniform(0.5, 4) * unit
        case.span = (case.s0 - half, case.s0 + half * self.uniform(0, 1))
        if case.angular:
            low = case.s0 + self.uniform(-5, 0.5)
            case.span = (low, low + self.uniform(0.5, 6))
        if self.family == "saddle":
            near = float(case.notes[-1].split(" at ")[1])
            case.span = (near - self.uniform(0.05, 1) * unit, near + self.uniform(0.05, 1) * unit)
        if self.family == "parallel" and case.angular:  # more than a turn, both ways round
            low = case.s0 - self.uniform(0.5, 6)
            case.span = (low, low + self.uniform(3, 9))
            case.assembled = bool(rng.random() < 0.15)
        if self.family == "end":
            self.crowd()
        if self.family == "exact" and rng.random() < 0.5:
            self.close_by()

    def close_by(self):
        """Put poses at all distances from a change point, some on it as nearly as it gets."""
        rng, case = self.rng, self.case
        first = np.pi / 2 if case.notes[0] == "slider" else 0.0
        period = 2 * np.pi if case.notes[0] == "galloway" else np.pi
        at = first + period * np.round((case.s0 - first) / period)
        off = 10.0 ** rng.uniform(-16, 0, 20) * rng.choice([-1, 1], 20)
        case.at = tuple(float(s) for s in (*np.sort(at + off), at, case.s0, at + 3.0, at - 3.0))

    def crowd(self):
        """Let the poses end just before or just behind a limit position."""
        rng, case = self.rng, self.case
        wide = TURN / 2 if case.angular else 3 * case.unit
        try:
            case.survey(case.s0 - wide, case.s0 + wide)
        except Doubtful:
            raise Failed from None
        ends = [
            (float(end.at), sense)
            for element in case.elements
            for end, sense in zip(element.reach, (-1, 1), strict=True)
            if end.kind == "limit"
        ]
        if not ends:
            raise Failed
        case.assembled = bool(rng.random() < 0.3)
        at, sense = ends[int(rng.integers(len(ends)))]
        off = 10.0 ** rng.uniform(-12, -1) * case.unit * (1 if rng.random() < 0.2 else -1)
        last = at + sense * off
        wide = 10.0 ** rng.uniform(-3, 0) * case.unit if rng.random() < 0.5 else abs(at - case.s0)
        case.span = tuple(sorted((last, last - sense * wide)))
        case.notes.append(f"{off:.1e} from the limit {at!r}")


ATTEMPTS = 40


@np.errstate(all="ignore")
def draw(seed, family=None, **options):
    """Return a case that closes at its sketch, None where many attempts gave none."""
    if family is None:
        chooser = np.random.default_rng([seed, 1])
        family = str(chooser.choice(list(FAMILIES), p=list(FAMILIES.values())))
    for attempt in range(ATTEMPTS):
        try:
            return Drawer([seed, attempt], family, **options).draw()
        except Failed:
            continue
    return None
