"""Random planar mechanisms made of dyads, and their closure by complex numbers.

`draw(seed)` returns a `Case`: a description for the package and everything that is needed
to know the truth about it. The closure works dyad by dyad with branch signs, in 80-bit
floats, on truncated power series in time; it shares no code with the package.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

import mechdae as md

LD, CLD = np.longdouble, np.clongdouble
TURN = 2 * np.pi
GRID = 2000
ORDER = 2


class Series:
    """Value and derivatives / k! of a function of time, arrays over poses, up to `ORDER`."""

    __array_ufunc__ = None  # NumPy scalars on the left leave the operation to us

    def __init__(self, c):
        self.c = np.asarray(c, dtype=CLD)

    def __add__(self, o):
        o = lift(o, self)
        return Series(self.c + o.c)

    __radd__ = __add__

    def __neg__(self):
        return Series(-self.c)

    def __sub__(self, o):
        return self + (-lift(o, self))

    def __rsub__(self, o):
        return lift(o, self) - self

    def __mul__(self, o):
        o = lift(o, self)
        out = np.zeros_like(self.c)
        for i in range(len(out)):
            for j in range(i + 1):
                out[i] += self.c[j] * o.c[i - j]
        return Series(out)

    __rmul__ = __mul__

    def __truediv__(self, o):
        o = lift(o, self)
        out = np.zeros_like(self.c)
        for i in range(len(out)):
            rest = self.c[i].copy()
            for j in range(i):
                rest -= out[j] * o.c[i - j]
            out[i] = rest / o.c[0]
        return Series(out)

    def __rtruediv__(self, o):
        return lift(o, self) / self

    def conj(self):
        return Series(np.conj(self.c))

    @property
    def real(self):
        return Series(self.c.real)

    @property
    def imag(self):
        return Series(self.c.imag)

    def sqrt(self):
        """Real square root; nan where the value is negative."""
        out = np.zeros_like(self.c)
        out[0] = np.sqrt(self.c[0].real)
        for i in range(1, len(out)):
            rest = self.c[i].copy()
            for j in range(1, i):
                rest -= out[j] * out[i - j]
            out[i] = rest / (2 * out[0])
        return Series(out)

    def unit(self):
        """exp(i self)."""
        out = np.zeros_like(self.c)
        out[0] = np.exp(1j * self.c[0])
        for i in range(1, len(out)):
            for j in range(1, i + 1):
                out[i] += 1j * j * self.c[j] * out[i - j] / CLD(i)
        return Series(out)

    def turning(self):
        """Argument of the value, first and second derivative of the argument."""
        first = self.c[1] / self.c[0]
        second = self.c[2] / self.c[0] - first * first / 2
        return np.angle(self.c[0]), first.imag, 2 * second.imag


def lift(value, like):
    if isinstance(value, Series):
        return value
    out = np.zeros_like(like.c)
    out[0] = value
    return Series(out)


def turned(angle):
    """exp(i angle) of a float64 number, in 80 bits."""
    return np.exp(1j * CLD(LD(angle)))


# -- elements ------------------------------------------------------------------------------
#
# A place is ("body", "point"); `world` maps bodies to (origin, direction, angle) series.


@dataclass
class Dyad:
    """One group: bodies it adds, its branch sign, and how it is closed."""

    kind: str
    sign: int
    data: dict
    uses: tuple[int, ...] = ()


@dataclass
class Case:
    """A mechanism with its truth."""

    seed: int
    local: dict = field(default_factory=dict)  # body -> {point: (x, y)}
    joints: list = field(default_factory=list)  # (kind, name, first, second, keys)
    dyads: list = field(default_factory=list)
    bodies: list = field(default_factory=list)
    maker: dict = field(default_factory=dict)  # body -> index of the dyad that places it
    s0: float = 0.0
    span: tuple = (0.0, TURN)
    speed: float = 1.0
    acceleration: float = 0.0
    coordinate: str = "crank.angle"
    scale: float = 1.0
    notes: list = field(default_factory=list)
    order: object = None
    dip: float = 1.0

    # -- numbers, possibly perturbed -----------------------------------------------------

    def at(self, body, point, numbers):
        x, y = numbers[body][point]
        return CLD(LD(x)) + 1j * CLD(LD(y))

    def perturbed(self, rng):
        """All lengths changed by a random relative 2^-53 of the mechanism's size."""
        eps = LD(2.0) ** -53
        numbers = {}
        for body, points in self.local.items():
            numbers[body] = {
                name: tuple(LD(v) + eps * LD(self.size) * LD(rng.uniform(-1, 1)) for v in xy)
                for name, xy in points.items()
            }
        return numbers

    @property
    def size(self):
        return max(abs(v) for points in self.local.values() for xy in points.values() for v in xy)

    # -- closure -------------------------------------------------------------------------

    def close(self, u, numbers=None, du=1.0, ddu=0.0, signs=None, order=ORDER):
        """Return world (body -> origin, direction), discriminants (k, n) and their slopes.

        `u` are values of the crank's angle or the ram's slide.
        """
        numbers = numbers or self.local
        u = np.asarray(u, dtype=LD)
        c = np.zeros((order + 1, len(u)), CLD)
        c[0] = u
        if order >= 1:
            c[1] = du
        if order >= 2:
            c[2] = LD(ddu) / 2 if np.isscalar(ddu) else ddu / 2
        driver = Series(c)
        one = lift(1.0, driver)
        world = {"ground": (0 * one, one)}
        angles = {"ground": 0 * one}
        discs, slopes = [], []
        signs = signs or [dyad.sign for dyad in self.dyads]
        with np.errstate(all="ignore"):
            for dyad, sign in zip(self.dyads, signs, strict=True):
                disc = CLOSURES[dyad.kind](self, dyad.data, sign, world, angles, numbers, driver)
                if disc is None:
                    discs.append(np.ones(len(u), LD))
                    slopes.append(np.zeros(len(u), LD))
                else:
                    discs.append(disc.c[0].real)
                    slopes.append(disc.c[1].real if order >= 1 else 0 * disc.c[0].real)
        return world, angles, np.array(discs), np.array(slopes)

    def place(self, world, body, point, numbers=None):
        origin, direction = world[body]
        return origin + direction * self.at(body, point, numbers or self.local)

    # -- reach ---------------------------------------------------------------------------

    @np.errstate(all="ignore")
    def reaches(self, low, high):
        """Return for each dyad the open interval around s0 over which it follows the sketch.

        Ends are (value, True) for a limit position inside [low, high]. None: doubtful.
        """
        first, last = min(low, self.s0), max(high, self.s0)
        n = int(GRID * max(1.0, (last - first) / (TURN if self.angular else 4 * self.size)))
        grid = np.unique(np.concatenate([np.linspace(first, last, n), [self.s0]])).astype(LD)
        _, _, disc, slope = self.close(grid, order=1)
        intervals = []
        for k, dyad in enumerate(self.dyads):
            ends: list = []
            for sense in (-1, 1):
                end = self._first_root(k, grid, disc[k], slope[k], sense)
                if end == "doubtful":
                    return None
                far = LD(-np.inf if sense < 0 else np.inf)
                ends.append((*end, k) if end is not None else (far, False, k))
            for other in dyad.uses:
                ends[0] = max(ends[0], intervals[other][0], key=lambda e: e[0])
                ends[1] = min(ends[1], intervals[other][1], key=lambda e: e[0])
            intervals.append(tuple(ends))
        return intervals

    def _section(self, k, a, b):
        """Return 65 places from a to b with the discriminant and its slope."""
        s = a + (b - a) * np.linspace(0, 1, 65).astype(LD)
        _, _, disc, slope = self.close(s, order=1)
        return s, disc[k], slope[k]

    def _first_root(self, k, grid, disc, slope, sense):
        i = int(np.argmin(np.abs(grid - LD(self.s0))))
        while 0 <= i + sense < len(grid):
            a, b = grid[i], grid[i + sense]
            db = disc[i + sense]
            if not np.isfinite(db):  # an earlier group ended here
                return None
            if db <= 0:
                return self._bisect(k, a, b)
            steep = 4 * max(abs(slope[i]), abs(slope[i + sense])) * abs(b - a)
            if slope[i] * sense < 0 < slope[i + sense] * sense and min(disc[i], db) < steep:
                lo, hi = a, b  # a dip in between
                for _ in range(13):
                    s, value, grade = self._section(k, lo, hi)
                    below = np.flatnonzero(value <= 0)
                    if below.size:
                        return self._bisect(k, lo, s[below[0]])
                    j = int(np.flatnonzero(grade * sense < 0)[-1])
                    lo, hi = s[j], s[min(j + 1, 64)]
                lowest = float(value.min())
                if lowest < 1e-13:
                    return (lo, "pole") if self.dyads[k].kind == "prp" else "doubtful"
                self.dip = min(self.dip, lowest)
            i += sense
        return None

    def _bisect(self, k, good, bad):
        for _ in range(13):
            s, value, _ = self._section(k, good, bad)
            j = int(np.flatnonzero(value <= 0)[0])
            if j == 0 or s[j - 1] == s[j]:
                break
            good, bad = s[j - 1], s[j]
        return good, "pole" if self.dyads[k].kind == "prp" else True

    @property
    def angular(self):
        return self.dyads[0].kind == "crank"

    # -- description ---------------------------------------------------------------------

    def mechanism(self, sketch_at=None, jitter=0.0):
        """Return the package's mechanism, sketched at the driver value `s0`."""
        rng = self.order or np.random.default_rng(self.seed + 1)
        s = self.s0 if sketch_at is None else sketch_at
        world, _, _, _ = self.close([s], order=0)
        sketch = {}
        for body in self.bodies:
            sketch[body] = float(np.angle(complex(world[body][1].c[0][0]))) + jitter * rng.uniform(
                -1, 1
            )
        if self.angular:
            sketch["crank"] = float(s)
        else:
            sketch["guide"] = float(s)
        bodies = [md.Body(name, points=self.local[name]) for name in self.bodies]
        classes = {
            "revolute": md.Revolute, "prismatic": md.Prismatic, "slot": md.PinInSlot,
            "distance": md.Distance, "gear": md.Gear, "weld": md.Weld,
        }  # fmt: skip
        joints = [classes[kind](name, a, b, **keys) for kind, name, a, b, keys in self.joints]
        rng.shuffle(bodies)
        rng.shuffle(joints)
        return md.Mechanism(
            ground=md.Ground(points=self.local["ground"]),
            bodies=bodies,
            joints=joints,
            sketch=sketch,
        )


def _span(case, world, numbers, place):
    return case.place(world, *place, numbers)


def _put(case, world, angles, body, point, place, direction, numbers):
    """Fix a body by one of its points and its direction."""
    origin = place - direction * case.at(body, point, numbers)
    world[body] = (origin, direction)
    angles[body] = None


def close_crank(case, d, _sign, world, angles, numbers, driver):
    direction = driver.unit()
    _put(
        case,
        world,
        angles,
        "crank",
        "O",
        case.place(world, "ground", "O", numbers),
        direction,
        numbers,
    )
    angles["crank"] = driver


def close_ram(case, d, _sign, world, angles, numbers, driver):
    axis = turned(d["axis"])
    place = case.place(world, "ground", "O", numbers) + driver * axis
    _put(case, world, angles, "ram", "O", place, lift(turned(d["turn"]), driver), numbers)
    angles["ram"] = lift(LD(d["turn"]), driver)


def close_wheel(case, d, _sign, world, angles, numbers, driver):
    carrier, other = d["carrier"], d["other"]
    base = angles[carrier]
    ratio, phase = LD(d["ratio"]), LD(d["phase"])
    if d["first"]:  # wheel - c = ratio (other - c) + phase
        angle = base + ratio * (angles[other] - base) + phase
    else:  # other - c = ratio (wheel - c) + phase
        angle = base + (angles[other] - base - phase) / ratio
    _put(
        case,
        world,
        angles,
        d["body"],
        d["pin"],
        _span(case, world, numbers, d["on"]),
        angle.unit(),
        numbers,
    )
    angles[d["body"]] = angle


def _length(case, body, a, b, numbers):
    return case.at(body, b, numbers) - case.at(body, a, numbers)


def two_circles(p, a2, q, b2, sign):
    """Return the point at squared distances a2, b2 from p, q, and the discriminant."""
    line = q - p
    d2 = (line * line.conj()).real
    x = (d2 + a2 - b2) / (2 * d2)
    disc = a2 / d2 - x * x
    return p + line * (x + 1j * sign * disc.sqrt()), disc


def square(z):
    return z.real * z.real + z.imag * z.imag


def close_rrr(case, d, sign, world, angles, numbers, driver):
    """Bodies a (pins a0 on place p, a1) and b (pins b0 on place q, b1); b None: a bar."""
    p, q = _span(case, world, numbers, d["p"]), _span(case, world, numbers, d["q"])
    arm_a = _length(case, d["a"], "p0", "p1", numbers)
    if d["b"] is not None:
        arm_b = _length(case, d["b"], "p0", "p1", numbers)
        b2 = square(arm_b)
    else:
        b2 = LD(d["length"]) ** 2
    pin, disc = two_circles(p, square(arm_a), q, b2, sign)
    _put(case, world, angles, d["a"], "p0", p, (pin - p) / arm_a, numbers)
    if d["b"] is not None:
        _put(case, world, angles, d["b"], "p0", q, (pin - q) / arm_b, numbers)
    return disc


def close_rrp(case, d, sign, world, angles, numbers, driver):
    """Rod a from place p to a pin that moves along a line of body g; block b or a slot."""
    p = _span(case, world, numbers, d["p"])
    g_origin = _span(case, world, numbers, d["g"])
    g_dir = world[d["g"][0]][1]
    axis = g_dir * turned(d["axis"])
    arm = _length(case, d["a"], "p0", "p1", numbers)
    if d["b"] is not None:
        b_dir = g_dir * turned(d["turn"])
        base = g_origin + b_dir * _length(case, d["b"], "guided", "p1", numbers)
    else:
        base = g_origin
    away = (base - p) * axis.conj()
    disc = square(arm) - away.imag * away.imag
    t = -away.real + sign * disc.sqrt()
    pin = base + axis * t
    _put(case, world, angles, d["a"], "p0", p, (pin - p) / arm, numbers)
    if d["b"] is not None:
        _put(case, world, angles, d["b"], "p1", pin, b_dir, numbers)
    return disc / square(arm)


def close_rpr(case, d, sign, world, angles, numbers, driver):
    """Slotted body a pinned at place p; block b (or the bare pin) at place q in its slot."""
    p, q = _span(case, world, numbers, d["p"]), _span(case, world, numbers, d["q"])
    k = _length(case, d["a"], "p0", "slot", numbers) * (1 + 0j)
    along = turned(d["axis"])
    if d["b"] is not None:
        k = k - turned(d["turn"]) * _length(case, d["b"], "p1", "guided", numbers)
    line = q - p
    d2 = (line * line.conj()).real
    across = (np.conj(along) * k).imag
    disc = d2 - across * across
    t = -(np.conj(along) * k).real + sign * disc.sqrt()
    direction = line / (k + t * along)
    _put(case, world, angles, d["a"], "p0", p, direction, numbers)
    if d["b"] is not None:
        _put(case, world, angles, d["b"], "p1", q, direction * turned(d["turn"]), numbers)
    return disc / d2


def close_prp(case, d, sign, world, angles, numbers, driver):
    """Blocks a on a line of body g, b on a line of body h, pinned to each other."""
    lines, dirs = [], []
    for block, on, axis, turn in (("a", "g", "axis", "turn"), ("b", "h", "axis2", "turn2")):
        direction = world[d[on][0]][1]
        own = direction * turned(d[turn])
        base = _span(case, world, numbers, d[on]) + own * _length(
            case, d[block], "guided", "p1", numbers
        )
        lines.append((base, direction * turned(d[axis])))
        dirs.append(own)
    (b1, e1), (b2, e2) = lines
    cross = (e1.conj() * e2).imag
    t = ((b2 - b1) * e2.conj()).imag / (e1 * e2.conj()).imag
    pin = b1 + t * e1
    for block, own in zip("ab", dirs, strict=True):
        _put(case, world, angles, d[block], "p1", pin, own, numbers)
    return cross * cross


CLOSURES = {
    "crank": close_crank, "ram": close_ram, "wheel": close_wheel, "rrr": close_rrr,
    "bar": close_rrr, "rrp": close_rrp, "rpr": close_rpr, "prp": close_prp,
}  # fmt: skip


# -- drawing -------------------------------------------------------------------------------


class Drawer:
    """Builds one random case."""

    def __init__(self, seed, kinds=None, near=None, dyads=None, scale=None, ram=None):
        self.rng = np.random.default_rng(seed)
        self.case = Case(seed)
        self.case.local["ground"] = {}
        self.kinds = kinds or ["rrr", "rrr", "rrp", "rpr", "bar", "prp", "wheel"]
        rng = self.rng
        self.scale = scale or (10.0 ** rng.integers(-6, 4) if rng.random() < 0.4 else 1.0)
        self.near = (
            near
            if near is not None
            else (rng.choice(["change", "toggle", ""], p=[0.15, 0.15, 0.7]))
        )
        self.count = dyads or int(rng.integers(1, 5))
        self.ram = rng.random() < 0.15 if ram is None else ram
        self.known = [("ground", complex(0))]
        self.names = iter(f"b{i}" for i in rng.permutation(40))

    def point(self, body, name, z):
        self.case.local.setdefault(body, {})[name] = (float(z.real), float(z.imag))

    def frame(self, body, points):
        """Put the points of a new body in a frame of random origin and direction."""
        rng = self.rng
        shift = (
            complex(*rng.normal(size=2)) * self.scale * rng.choice([0, 1, 10], p=[0.4, 0.4, 0.2])
        )
        turn = np.exp(1j * rng.uniform(-3, 3)) if rng.random() < 0.6 else 1.0
        for name, z in points.items():
            self.point(body, name, (z - shift) * turn)
        self.case.bodies.append(body)

    def ground_point(self, z):
        name = f"G{len(self.case.local['ground'])}"
        self.point("ground", name, z)
        return ("ground", name)

    def random_place(self):
        """A place on an existing moving body, or a new one on the ground."""
        rng = self.rng
        if rng.random() < 0.4:
            return self.ground_point(complex(*rng.uniform(-3, 3, 2)) * self.scale)
        body = self.case.bodies[int(rng.integers(len(self.case.bodies)))]
        return (body, "p2" if "p2" in self.case.local[body] else next(iter(self.case.local[body])))

    def where(self, place):
        world, _, _disc, _ = self.case.close([self.case.s0], order=0)
        return complex(self.case.place(world, *place).c[0][0])

    def joint(self, kind, a, b, **keys):
        """Add a joint between two places; revolutes and bars in random order."""
        if kind in ("revolute", "distance") and self.rng.random() < 0.5:
            a, b = b, a
        name = f"j{len(self.case.joints)}"
        self.case.joints.append((kind, name, ".".join(a), ".".join(b), keys))

    def draw(self):
        rng, case = self.rng, self.case
        L = self.scale
        self.ground_origin = complex(*rng.normal(size=2)) * L * rng.choice([0, 1])
        case.s0 = float(rng.uniform(-3, 3)) if not self.ram else float(rng.uniform(-0.5, 0.5) * L)
        self.point("ground", "O", self.ground_origin)
        if self.ram:
            axis, turn = float(rng.uniform(-3, 3)), float(rng.uniform(-3, 3))
            r = rng.uniform(0.5, 1.0) * L
            self.frame("ram", {"O": 0j, "p2": r * np.exp(1j * rng.uniform(-3, 3))})
            case.dyads.append(Dyad("ram", 0, {"axis": axis, "turn": turn}))
            case.joints.append(
                ("prismatic", "guide", "ground.O", "ram.O", {"axis": axis, "turn": turn})
            )
            case.maker["ram"] = 0
            case.coordinate = "guide.slide"
        else:
            r = rng.uniform(0.3, 1.2) * L
            self.frame("crank", {"O": 0j, "p2": r * np.exp(1j * rng.uniform(-3, 3))})
            case.dyads.append(Dyad("crank", 0, {}))
            case.maker["crank"] = 0
            case.joints.append(("revolute", "main", "ground.O", "crank.O", {}))
        self.first_arm = r
        for number in range(self.count):
            kind = str(rng.choice(self.kinds))
            if number == 0 and self.near == "change" and not self.ram:
                self.change_point()
                continue
            for _ in range(30):
                if self.add(kind):
                    break
            else:
                if not case.dyads[1:]:
                    return None
        case.scale = L
        self.driver()
        return case

    def uses(self, *places):
        return tuple(sorted({self.case.maker[b] for b, _ in places if b != "ground"}))

    def done(self, dyad, bodies):
        """Keep a dyad if it closes well at the sketch; else take it back."""
        case = self.case
        case.dyads.append(dyad)
        for body in bodies:
            case.maker[body] = len(case.dyads) - 1
        _, _, disc, _ = case.close([case.s0], order=0)
        if disc[-1][0] > 0.03 and np.isfinite(disc[-1][0]):
            return True
        case.dyads.pop()
        for body in bodies:
            del case.maker[body]
            del case.local[body]
            case.bodies.remove(body)
        del case.joints[self.mark :]
        return False

    def link(self, length, third=True):
        """Points p0, p1 at that distance, and a third one."""
        rng = self.rng
        turn = np.exp(1j * rng.uniform(-3, 3)) if rng.random() < 0.5 else 1.0
        points = {"p0": 0j, "p1": length * turn}
        if third:
            points["p2"] = complex(*rng.uniform(-1, 1, 2)) * self.scale
        return points

    def add(self, kind):
        rng, case, L = self.rng, self.case, self.scale
        self.mark = len(case.joints)
        sign = int(rng.choice([-1, 1]))
        place = (next(b for b in ("crank", "ram") if b in case.bodies), "p2")
        p = place if len(case.dyads) == 1 else self.random_place()
        q = self.random_place()
        if kind == "wheel":
            return self.wheel()
        if kind in ("rrr", "bar", "rpr") and (p[0] == q[0]):
            return False
        if kind in ("rrr", "bar"):
            far = abs(self.where(p) - self.where(q))
            if far < 0.2 * L:
                return False
            a, b = far * rng.uniform(0.4, 1.6), far * rng.uniform(0.4, 1.6)
            if self.near == "toggle":
                b = abs(far - a) * (1 + 10.0 ** rng.uniform(-4, -1)) if rng.random() < 0.5 else b
            name_a, name_b = next(self.names), next(self.names)
            self.frame(name_a, self.link(a))
            if kind == "bar":
                data = {"p": p, "q": q, "a": name_a, "b": None, "length": float(b)}
                self.joint("revolute", p, (name_a, "p0"))
                self.joint("distance", q, (name_a, "p1"), length=float(b))
                return self.done(Dyad("bar", sign, data, self.uses(p, q)), [name_a])
            self.frame(name_b, self.link(b))
            data = {"p": p, "q": q, "a": name_a, "b": name_b}
            self.joint("revolute", p, (name_a, "p0"))
            self.joint("revolute", q, (name_b, "p0"))
            self.joint("revolute", (name_a, "p1"), (name_b, "p1"))
            return self.done(Dyad("rrr", sign, data, self.uses(p, q)), [name_a, name_b])
        axis, turn = float(rng.uniform(-3, 3)), float(rng.choice([0, rng.uniform(-3, 3)]))
        offset = complex(*rng.uniform(-0.4, 0.4, 2)) * L * rng.choice([0, 1])
        if kind == "rrp":
            if p[0] == q[0]:
                return False
            name_a = next(self.names)
            self.frame(name_a, self.link(rng.uniform(0.5, 3) * L))
            block = next(self.names) if rng.random() < 0.7 else None
            data = {"p": p, "g": q, "a": name_a, "b": block, "axis": axis, "turn": turn}
            self.joint("revolute", p, (name_a, "p0"))
            if block:
                self.frame(
                    block, {"p1": 0j, "guided": offset, "p2": complex(*rng.uniform(-1, 1, 2)) * L}
                )
                self.joint("revolute", (name_a, "p1"), (block, "p1"))
                self.guide(q, (block, "guided"), axis, turn)
            else:
                self.joint("slot", q, (name_a, "p1"), axis=axis)
            return self.done(
                Dyad("rrp", sign, data, self.uses(p, q)), [name_a, *([block] if block else [])]
            )
        if kind == "rpr":
            if abs(self.where(p) - self.where(q)) < 0.2 * L:
                return False
            name_a = next(self.names)
            points = self.link(1.0 * L)
            points["slot"] = complex(*rng.uniform(-0.5, 0.5, 2)) * L * rng.choice([0, 1])
            if points["slot"] == 0:
                points["slot"] = points["p0"]
            del points["p1"]
            self.frame(name_a, points)
            block = next(self.names) if rng.random() < 0.7 else None
            data = {"p": p, "q": q, "a": name_a, "b": block, "axis": axis, "turn": turn}
            self.joint("revolute", p, (name_a, "p0"))
            if block:
                self.frame(
                    block, {"p1": 0j, "guided": offset, "p2": complex(*rng.uniform(-1, 1, 2)) * L}
                )
                self.joint("revolute", q, (block, "p1"))
                self.guide((name_a, "slot"), (block, "guided"), axis, turn)
            else:
                self.joint("slot", (name_a, "slot"), q, axis=axis)
            return self.done(
                Dyad("rpr", sign, data, self.uses(p, q)), [name_a, *([block] if block else [])]
            )
        if kind == "prp":
            if p[0] == q[0]:
                return False
            axis2, turn2 = float(rng.uniform(-3, 3)), float(rng.uniform(-3, 3))
            names = [next(self.names), next(self.names)]
            for name in names:
                self.frame(
                    name,
                    {
                        "p1": 0j,
                        "guided": complex(*rng.uniform(-0.4, 0.4, 2)) * L,
                        "p2": complex(*rng.uniform(-1, 1, 2)) * L,
                    },
                )
            data = {
                "g": p,
                "h": q,
                "a": names[0],
                "b": names[1],
                "axis": axis,
                "turn": turn,
                "axis2": axis2,
                "turn2": turn2,
            }
            self.guide(p, (names[0], "guided"), axis, turn)
            self.guide(q, (names[1], "guided"), axis2, turn2)
            self.joint("revolute", (names[0], "p1"), (names[1], "p1"))
            return self.done(Dyad("prp", 0, data, self.uses(p, q)), names)
        raise ValueError(kind)

    def guide(self, on, block, axis, turn):
        self.joint("prismatic", on, block, axis=axis, turn=turn)

    def wheel(self):
        """A wheel pinned on a known body with a known angle, meshing with the crank."""
        rng, case = self.rng, self.case
        if "crank" not in case.bodies:
            return False
        on = self.ground_point(complex(*rng.uniform(-2, 2, 2)) * self.scale)
        carrier, other = "ground", "crank"
        if rng.random() < 0.5:  # a planet on the crank, meshing with a fixed wheel
            on, carrier, other = ("crank", "p2"), "crank", "ground"
        name = next(self.names)
        z = self.link(self.scale * rng.uniform(0.2, 0.7))
        ratio = float(rng.choice([-2.0, -0.5, 1.5, -1.0, float(rng.uniform(-3, 3))]))
        first = bool(rng.random() < 0.5)
        phase = float(rng.uniform(-2, 2))
        self.frame(name, z)
        fixed = ("ground", "O") if other == "ground" else ("crank", "O")
        keys = {"ratio": ratio, "phase": phase}
        if carrier != "ground":
            keys["carrier"] = carrier
        pair = [(name, "p0"), fixed]
        self.joint("revolute", on, (name, "p0"))
        a, b = pair if first else pair[::-1]
        self.joint("gear", a, b, **keys)
        data = {
            "body": name,
            "pin": "p0",
            "on": on,
            "carrier": carrier,
            "other": other,
            "ratio": ratio,
            "phase": phase,
            "first": first,
        }
        return self.done(Dyad("wheel", 0, data, (0,)), [name])

    def change_point(self):
        """A four-bar whose longest and shortest links nearly equal the others."""
        rng, case, L = self.rng, self.case, self.scale
        self.mark = len(case.joints)
        gap = 10.0 ** rng.uniform(-10, -2) * rng.choice([-1, 1])
        a = self.first_arm
        d = a * rng.uniform(1.2, 4)
        b = a * rng.uniform(1.2, 4)
        c = rng.choice([d + b - a, a + b - d, a + d - b])
        if c <= 0.1 * a:
            c = d + b - a
        c += gap * L
        q = self.ground_point(self.ground_origin + d * np.exp(1j * rng.uniform(-3, 3)))
        name_a, name_b = next(self.names), next(self.names)
        self.frame(name_a, self.link(b))
        self.frame(name_b, self.link(c))
        self.joint("revolute", ("crank", "p2"), (name_a, "p0"))
        self.joint("revolute", q, (name_b, "p0"))
        self.joint("revolute", (name_a, "p1"), (name_b, "p1"))
        data = {"p": ("crank", "p2"), "q": q, "a": name_a, "b": name_b}
        dyad = Dyad("rrr", int(rng.choice([-1, 1])), data, (0,))
        case.notes.append(f"gap {gap:.1e}")
        for _ in range(20):
            if self.done(dyad, [name_a, name_b]):
                return
            raise RuntimeError("does not close")

    def driver(self):
        rng, case = self.rng, self.case
        case.speed = float(rng.choice([1.0, -2.5, 7.0]))
        case.acceleration = float(rng.choice([0.0, 3.0]))
        if self.ram:
            case.speed *= self.scale
            case.acceleration *= self.scale
            half = rng.uniform(0.5, 4) * self.scale
            case.span = (case.s0 - half, case.s0 + half * rng.uniform(0, 1))
            return
        low = case.s0 + rng.uniform(-7, 1)
        case.span = (float(low), float(low + rng.uniform(0.5, 9)))


@np.errstate(all="ignore")
def draw(seed, **options):
    """Return a case that closes at its sketch, None where the seed gives none."""
    try:
        return Drawer(seed, **options).draw()
    except RuntimeError:
        return None


# -- checking ------------------------------------------------------------------------------

EPS = 2.0**-52


@np.errstate(all="ignore")
def truth(case, u, numbers=None, signs=None):
    """Return per body (position, velocity, acceleration of its points; angle and rates)."""
    world, _, disc, _ = case.close(u, numbers, case.speed, case.acceleration, signs)
    points, angles = {}, {}
    for body in case.bodies:
        angles[body] = world[body][1].turning()
        for name in case.local[body]:
            c = case.place(world, body, name, numbers).c
            points[f"{body}.{name}"] = (c[0], c[1], 2 * c[2])
    return points, angles, disc


def owner(case, part):
    return case.maker[part.split(".")[0]]


@np.errstate(all="ignore")
def check(case, result, reach=None, ratios=None):
    """Return what is wrong with a sweep, as sentences; an empty list is a pass."""
    u = np.asarray(result.drivers[case.coordinate].position)
    wrong = []
    low, high = float(u.min()), float(u.max())
    margin = TURN if case.angular else 0.0
    reach = reach or case.reaches(min(low, case.s0) - margin, max(high, case.s0) + margin)
    if reach is None:
        return wrong
    status = np.asarray(result.status)
    usable = np.isin(status, ("ok", "limit"))
    points, angles, _ = truth(case, u)
    near = 1e-9 * max(1.0 if case.angular else case.scale, abs(low), abs(high))
    inside, edge = {}, {}
    for k, (a, b) in enumerate(reach):
        inside[k] = (u > float(a[0])) & (u < float(b[0]))
        edge[k] = np.zeros(len(u), bool)
        for end in (a, b):
            if np.isfinite(end[0]):
                width = near if end[1] != "pole" else 0.02 * (1 if case.angular else case.scale)
                edge[k] |= np.abs(u - float(end[0])) < width
        if case.angular:
            for turns in range(-4, 5):
                if turns:
                    moved = u + turns * TURN
                    shifted = (moved > float(a[0]) - near) & (moved < float(b[0]) + near)
                    edge[k] |= shifted & ~inside[k]
    everything = np.all([inside[k] & ~edge[k] for k in inside], axis=0)
    lost = everything & ~usable
    if lost.any():
        wrong.append(
            f"{int(lost.sum())} reachable poses {set(status[lost])}, first at {u[lost][0]!r}"
        )
    nothing = np.any([~inside[k] & ~edge[k] for k in inside], axis=0)
    claimed = nothing & usable
    if claimed.any():
        wrong.append(
            f"{int(claimed.sum())} poses beyond a limit {set(status[claimed])}, "
            f"first at {u[claimed][0]!r}"
        )
    wrong += _values(case, result, u, status, usable, points, angles, inside, edge, ratios, reach)
    wrong += _limits(case, result, reach, low, high)
    return wrong


def _values(case, result, u, status, usable, points, angles, inside, edge, ratios, reach):
    wrong = []
    rng = np.random.default_rng(1)
    spread: dict = {}
    for _ in range(4):
        shaken, turned_, _ = truth(
            case,
            np.asarray(u, LD)
            + LD(EPS / 2) * rng.uniform(-1, 1, len(u)) * (1 if case.angular else case.size),
            case.perturbed(rng),
        )
        for part, values in points.items():
            for order in range(3):
                d = np.abs(shaken[part][order] - values[order])
                spread[part, order] = np.fmax(spread.get((part, order), 0), d)
        for body, values in angles.items():
            for order in (1, 2):
                d = np.abs(turned_[body][order] - values[order])
                spread[body, order] = np.fmax(spread.get((body, order), 0), d)
    size = {
        order: np.nanmax(
            [np.abs(points[p][order]).astype(float) for p in points], axis=0, initial=0
        )
        for order in range(3)
    }
    size_a = {
        order: np.nanmax(
            [np.abs(angles[b][order]).astype(float) for b in angles], axis=0, initial=0
        )
        for order in (1, 2)
    }
    ok = status == "ok"
    worst = np.zeros(len(u))
    for part, values in points.items():
        ours = result.points[part].position
        ours = ours[:, 0].astype(LD) + 1j * ours[:, 1].astype(LD)
        k = owner(case, part)
        error = np.abs(ours - values[0]).astype(float)
        slack = EPS / 2 * np.abs(values[0]).astype(float)
        worst = np.fmax(worst, np.where(ok, error, 0))
        bad = ok & ~(error <= result.bound.length + slack)
        if bad.any():
            i = int(np.argmax(np.where(bad, error / result.bound.length, 0)))
            wrong.append(
                f"{part} off by {error[i]:.3g}, bound {result.bound.length[i]:.3g} at {u[i]!r}"
            )
        partial = ~usable & np.isfinite(ours.real)
        bad = partial & ~(error <= 1e-8 * case.size + 1e3 * spread[part, 0])
        if bad.any():
            wrong.append(
                f"{part} of a partial pose off by {np.nanmax(error[bad]):.3g} at {u[bad][0]!r}"
            )
        claimed = np.isfinite(ours.real) & ~inside[k] & ~edge[k] & ~np.isin(status, ["limit"])
        if claimed.any():
            wrong.append(f"{part} has values beyond its limit at {u[claimed][0]!r}")
        for order, name in ((1, "velocity"), (2, "acceleration")):
            rate = result.points[part][name]
            rate = rate[:, 0].astype(LD) + 1j * rate[:, 1].astype(LD)
            error = np.abs(rate - values[order]).astype(float)
            allowed = 30 * spread[part, order].astype(float) + 200 * EPS * size[order]
            bad = ok & ~(error <= allowed)
            if bad.any():
                i = int(np.argmax(np.where(bad, error / allowed, 0)))
                wrong.append(
                    f"{name} of {part} off by {error[i]:.3g}, allowed {allowed[i]:.3g} at {u[i]!r}"
                )
    for body, values in angles.items():
        ours = result.bodies[body].angle
        turned_ = ours.astype(LD) - values[0]
        pi = 4 * np.arctan(LD(1))
        error = np.abs(turned_ - 2 * pi * np.round(turned_ / (2 * pi))).astype(float)
        slack = EPS / 2 * np.abs(ours)
        bad = ok & ~(error <= result.bound.angle + slack)
        if bad.any():
            i = int(np.argmax(np.where(bad, error, 0)))
            wrong.append(
                f"angle {body} off by {error[i]:.3g}, bound {result.bound.angle[i]:.3g} at {u[i]!r}"
            )
        for order, name in ((1, "angular_velocity"), (2, "angular_acceleration")):
            error = np.abs(result.bodies[body][name] - values[order]).astype(float)
            allowed = 30 * spread[body, order].astype(float) + 200 * EPS * (
                size_a[order] + size[order] / case.scale
            )
            bad = ok & ~(error <= allowed)
            if bad.any():
                i = int(np.argmax(np.where(bad, error / allowed, 0)))
                wrong.append(
                    f"{name} of {body} off by {error[i]:.3g}, allowed {allowed[i]:.3g} at {u[i]!r}"
                )
    limits = np.flatnonzero(status == "limit")
    for i in limits:
        wrong += _at_limit(case, result, i, u[i], reach)
    if ratios is not None and ok.any():
        ratios.append(
            float(np.median(result.bound.length[ok] / np.maximum(worst[ok], EPS / 4 * case.size)))
        )
    return wrong


def _at_limit(case, result, i, s, reach):
    """Check a pose at a limit position against the dyad at rest on its fold."""
    ends = [end for pair in reach for end in pair if end[1] is True]
    if not ends:
        return [f"limit at {s!r}, where there is none"]
    end = min(ends, key=lambda e: abs(float(e[0]) - s))
    if abs(float(end[0]) - s) > 1e-12 * max(1.0 if case.angular else case.scale, abs(s)):
        return [f"limit at {s!r}, the nearest is at {float(end[0])!r}"]
    signs = [0 if k == end[2] else d.sign for k, d in enumerate(case.dyads)]
    points, _, _ = truth(case, np.array([end[0]]), signs=signs)
    wrong = []
    for part, values in points.items():
        ours = complex(*result.points[part].position[i])
        error = abs(ours - complex(values[0][0]))
        if np.isfinite(ours) and not error <= result.bound.length[i] + EPS * abs(ours):
            wrong.append(
                f"{part} at the limit off by {error:.3g}, bound {result.bound.length[i]:.3g}"
            )
    return wrong


def _limits(case, result, reach, low, high):
    wrong = []
    rng = np.random.default_rng(2)
    events = [e["at"] for e in result.events if e["kind"] == "limit"]
    others = [e for e in result.events if e["kind"] != "limit"]
    poles = [float(end[0]) for pair in reach for end in pair if end[1] == "pole"]
    for event in others:
        if not any(
            abs(event["at"] - p) < 0.02 * (1 if case.angular else case.scale) for p in poles
        ):
            wrong.append(f"{event['kind']} at {event['at']!r} (smallest dip {case.dip:.1e})")
    ends = {}
    for k, pair in enumerate(reach):
        for end in pair:
            if end[1] is True and end[2] == k:
                ends[float(end[0])] = k
    unit = max(1.0 if case.angular else case.scale, abs(low), abs(high))
    for s, k in ends.items():
        if not low <= s <= high:
            continue
        gap = min((abs(s - e) for e in events), default=np.inf)
        if gap > 1e-12 * unit:
            shift = 0.0
            for _ in range(4):  # how far rounding the data moves the limit
                numbers = case.perturbed(rng)
                _, _, disc, slope = case.close(np.array([s], LD), numbers, order=1)
                shift = max(shift, abs(float(disc[k][0] / slope[k][0])))
            if gap > 1e-12 * unit + 30 * shift:
                wrong.append(
                    f"limit {s!r} of dyad {k} ({case.dyads[k].kind}) off by {gap:.3g} ({events})"
                )
    return wrong


@np.errstate(all="ignore")
def count_modes(case):
    """Return the number of assembly modes at the sketch's driver value, by trying all signs."""
    free = [k for k, d in enumerate(case.dyads) if d.sign]
    count = 0
    for code in range(2 ** len(free)):
        signs = [d.sign for d in case.dyads]
        for j, k in enumerate(free):
            signs[k] = 1 if code >> j & 1 else -1
        _, _, disc, _ = case.close([case.s0], signs=signs, order=0)
        if np.all(disc[:, 0] > 1e-10):
            count += 1
        elif np.any(np.abs(disc[:, 0]) <= 1e-10):
            return None
    return count


def solve(case, poses=60, **keys):
    """Return the package's sweep of a case."""
    values = keys or {"from_": case.span[0], "to": case.span[1]}
    driver = md.Driver(case.coordinate, speed=case.speed, acceleration=case.acceleration, **values)
    return md.solve(case.mechanism(), md.Sweep(driver, poses=None if "at" in values else poses))
