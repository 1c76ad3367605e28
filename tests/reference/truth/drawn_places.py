"""Random places, frames and joints of a case, and its elements one by one."""

from __future__ import annotations

import numpy as np

from .case import Case
from .elements import Element
from .unclosed import SYSTEMS


class Failed(Exception):
    """The seed gives no mechanism."""


class Places:
    """Places, frames and joints of a random case, and what was begun of an element.

    Parameters
    ----------
    seed
        List of integers.
    family
        One of `FAMILIES`.
    kinds
        Kinds to draw from in place of the family's own.
    count
        Number of elements after the driver.
    scale
        A length of the mechanism [m].
    driver
        "crank", "ram" or "cylinder".
    """

    def __init__(self, seed, family, kinds=None, count=None, scale=None, driver=None):
        self.rng = rng = np.random.default_rng(seed)
        self.case = Case(seed[0])
        self.case.family = self.family = family
        self.case.local["ground"] = {}
        base = 2.0 if family == "exact" else 10.0  # powers of 2 keep exact numbers exact
        drawn = base ** rng.integers(-6, 4) if rng.random() < 0.4 else 1.0
        self.scale = self.case.scale = scale or drawn
        self.kinds = kinds
        self.count = count or int(rng.choice([1, 2, 3], p=[0.45, 0.35, 0.2]))
        self.driver = driver or str(rng.choice(["crank", "ram", "cylinder"], p=[0.85, 0.08, 0.07]))
        if family in ("change", "exact", "geared", "far", "gears"):
            self.driver = "crank"
        if family == "parallel":
            self.count = count or int(rng.choice([2, 3, 4], p=[0.5, 0.35, 0.15]))
        self.names = iter(f"b{i}" for i in rng.permutation(40))

    # -- places and frames -----------------------------------------------------------------

    def uniform(self, low, high):
        return float(self.rng.uniform(low, high))

    def vector(self, size=1.0):
        return complex(*self.rng.uniform(-1, 1, 2)) * size * self.scale

    def angle(self):
        return self.uniform(-3, 3)

    def point(self, body, name, z):
        self.case.local.setdefault(body, {})[name] = (float(z.real), float(z.imag))

    def frame(self, points, name=None, plain=False):
        """Make a body with its points in a frame of random origin and direction."""
        rng = self.rng
        name = name or next(self.names)
        shift, turn = 0j, 1.0
        if not plain:
            far = rng.choice([0, 1, 10], p=[0.4, 0.4, 0.2])
            shift = complex(*rng.normal(size=2)) * self.scale * far
            turn = np.exp(1j * self.angle()) if rng.random() < 0.6 else 1.0
        for key, z in points.items():
            self.point(name, key, (z - shift) * turn)
        self.case.bodies.append(name)
        self.added.append(name)
        return name

    def ground(self, z):
        name = f"G{len(self.case.local['ground'])}"
        self.point("ground", name, z)
        return ("ground", name)

    def place(self, moving=False):
        """Return a place on an existing moving body, or a new one on the ground."""
        rng = self.rng
        if self.family == "parallel" and not moving and rng.random() < 0.9:
            return self.ground(self.origin + complex(*rng.uniform(-3, 3, 2)) * self.scale)
        if not moving and rng.random() < 0.4:
            return self.ground(self.origin + complex(*rng.uniform(-3, 3, 2)) * self.scale)
        body = self.case.bodies[int(rng.integers(len(self.case.bodies)))]
        points = self.case.local[body]
        return (body, "p2" if "p2" in points else next(iter(points)))

    def world(self):
        return self.case.close([self.case.s0])

    def where(self, place):
        return complex(self.world().place(place).c[0][0])

    def marked(self, body, z):
        """Return a new place on a known body that is at z in the sketch."""
        if body == "ground":
            return self.ground(z)
        origin, direction = self.world().frames[body]
        name = f"m{len(self.case.local[body])}"
        local = (z - complex(origin.c[0][0])) / complex(direction.c[0][0])
        self.extra.append((body, name))
        self.point(body, name, local)
        return (body, name)

    def joint(self, kind, a, b, **keys):
        """Add a joint between two places; revolutes and bars in random order."""
        if kind in ("revolute", "distance") and self.rng.random() < 0.5:
            a, b = b, a
        name = f"j{len(self.case.joints)}"
        self.case.joints.append((kind, name, ".".join(a), ".".join(b), keys))

    def guide(self, on, block, spec):
        """Add the prismatic joint of a block on a known body."""
        if spec.get("swap"):
            on, block = block, on
        self.joint("prismatic", on, block, axis=spec["axis"], turn=spec["turn"])

    def spec(self):
        turn = float(self.rng.choice([0, self.angle()]))
        return {"axis": self.angle(), "turn": turn, "swap": bool(self.rng.random() < 0.3)}

    def uses(self, *places):
        return tuple(sorted({self.case.maker[b] for b, *_ in places if b != "ground"}))

    # -- elements --------------------------------------------------------------------------

    def begin(self):
        self.added, self.extra, self.mark = [], [], len(self.case.joints)

    def done(self, kind, sign, data, uses, root=()):
        """Keep an element if it closes well at the sketch; else take it back."""
        case = self.case
        element = Element(kind, sign, data, uses, tuple(self.added), root)
        case.elements.append(element)
        for body in self.added:
            case.maker[body] = len(case.elements) - 1
        disc = self.world().discs[-1]
        if disc is None:
            return True
        value = float(disc.c[0][0].real)
        if np.isfinite(value) and value > (0.01 if kind in SYSTEMS else 0.03):
            return True
        case.elements.pop()
        self.forget()
        return False

    def forget(self):
        """Take back what was begun."""
        case = self.case
        for body in self.added:
            case.maker.pop(body, None)
            del case.local[body]
            case.bodies.remove(body)
        for body, name in self.extra:
            case.local[body].pop(name, None)
        del case.joints[self.mark :]
        return False

    def add(self, kind):
        self.begin()
        name = {"bar": "rrr", "belt": "gear", "planet": "gear"}.get(kind, kind)
        return getattr(self, f"add_{name}")(kind)

    def link(self, length, third=True):
        """Return points p0, p1 at that distance, and a third one."""
        turn = np.exp(1j * self.angle()) if self.rng.random() < 0.5 else 1.0
        points = {"p0": 0j, "p1": length * turn}
        if third:
            points["p2"] = self.vector()
        return points

    def first_place(self):
        """Return the driven link's place for the first element, then any.

        Of elements side by side it is the driven link's for nearly all of them.
        """
        beside = self.family == "parallel" and self.rng.random() < 0.85
        if len(self.case.elements) == 1 or beside:
            return ("crank" if "crank" in self.case.bodies else "ram", "p2")
        return self.place()
