"""Random mechanisms, among them such that are near-singular on purpose.

`draw(seed)` returns a `Case` that closes at its sketch.
"""

from __future__ import annotations

import numpy as np

from .case import Case, Doubtful
from .elements import Element
from .tracks import SYSTEMS

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
DYADS = ("rrr", "rrr", "rrp", "rpr", "bar", "prp", "rpp")
ROLLS = 0.6
"""Of the number by which the ratio of a gear is drawn: above, friction wheels of that ratio."""
GEARS = ("gear", "gear", "belt", "planet", "rack", "pinion", "weld")
LEGS = ("link", "link", "bar", "slide", "slot", "rail", "groove")


class Failed(Exception):
    """The seed gives no mechanism."""


class Drawer:
    """Builds one random case.

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

    def add_rrr(self, kind):
        p, q = self.first_place(), self.place()
        sign = int(self.rng.choice([-1, 1]))
        if p[0] == q[0]:
            return self.forget()
        far = abs(self.where(p) - self.where(q))
        if far < 0.2 * self.scale:
            return self.forget()
        a, b = far * self.uniform(0.4, 1.6), far * self.uniform(0.4, 1.6)
        if self.family == "toggle" and self.rng.random() < 0.6:
            b = abs(far - a) * (1 + 10.0 ** self.uniform(-4, -1))
        if self.family == "slender":
            a = far * 10.0 ** self.uniform(0, 4)
            b = a + far * self.uniform(-0.8, 0.8)
            b = b if b > 0.1 * far else a
        first = self.frame(self.link(a))
        self.joint("revolute", p, (first, "p0"))
        data = {"p": p, "q": q, "a": first, "b": None}
        if kind == "bar":
            data["length"] = float(b)
            self.joint("distance", q, (first, "p1"), length=float(b))
        else:
            data["b"] = second = self.frame(self.link(b))
            self.joint("revolute", q, (second, "p0"))
            self.joint("revolute", (first, "p1"), (second, "p1"))
        return self.done(kind, sign, data, self.uses(p, q))

    def block(self):
        offset = self.vector(0.4) * self.rng.choice([0, 1])
        return self.frame({"p1": 0j, "guided": offset, "p2": self.vector()})

    def add_rrp(self, kind):
        p, q = self.first_place(), self.place()
        sign = int(self.rng.choice([-1, 1]))
        if p[0] == q[0]:
            return self.forget()
        length = self.uniform(0.5, 3) * self.scale
        if self.family == "slender":
            length *= 10.0 ** self.uniform(0, 4)
        data = {"p": p, "g": q, "a": self.frame(self.link(length)), "b": None, **self.spec()}
        self.joint("revolute", p, (data["a"], "p0"))
        if self.rng.random() < 0.7:
            data["b"] = self.block()
            self.joint("revolute", (data["a"], "p1"), (data["b"], "p1"))
            self.guide(q, (data["b"], "guided"), data)
        else:
            data.update(swap=False, turn=0.0)
            self.joint("slot", q, (data["a"], "p1"), axis=data["axis"])
        return self.done(kind, sign, data, self.uses(p, q))

    def add_rpr(self, kind):
        p, q = self.first_place(), self.place()
        sign = int(self.rng.choice([-1, 1]))
        if p[0] == q[0] or abs(self.where(p) - self.where(q)) < 0.2 * self.scale:
            return self.forget()
        slot = self.vector(0.5) * self.rng.choice([0, 1])
        first = self.frame({"p0": 0j, "slot": slot, "p2": self.vector()})
        data = {"p": p, "q": q, "a": first, "b": None, **self.spec()}
        if slot == 0:  # one and the same spot is one point
            data["swap"] = data["swap"] and False
        self.joint("revolute", p, (first, "p0"))
        if self.rng.random() < 0.7:
            data["b"] = self.block()
            self.joint("revolute", q, (data["b"], "p1"))
            self.guide((first, "slot"), (data["b"], "guided"), data)
        else:
            data.update(swap=False, turn=0.0)
            self.joint("slot", (first, "slot"), q, axis=data["axis"])
        return self.done(kind, sign, data, self.uses(p, q))

    def add_prp(self, kind):
        p, q = self.first_place(), self.place()
        if p[0] == q[0]:
            return self.forget()
        data = {"g": p, "h": q, "guide_a": self.spec(), "guide_b": self.spec()}
        for on, key in ((p, "a"), (q, "b")):
            points = {"p1": 0j, "guided": self.vector(0.4), "p2": self.vector()}
            data[key] = self.frame(points)
            self.guide(on, (data[key], "guided"), data[f"guide_{key}"])
        self.joint("revolute", (data["a"], "p1"), (data["b"], "p1"))
        return self.done(kind, 0, data, self.uses(p, q))

    def add_rpp(self, kind):
        p, q = self.first_place(), self.place()
        if p[0] == q[0]:
            return self.forget()
        outer, inner = self.spec(), {"axis": self.angle(), "turn": self.angle()}
        data = {"p": p, "g": q, "guide_b": outer, "guide_a": inner}
        data["b"] = block = self.frame(
            {"guided": self.vector(0.4), "slot": self.vector(0.4), "p2": self.vector()}
        )
        data["a"] = arm = self.frame({"p0": 0j, "guided": self.vector(0.4), "p2": self.vector()})
        along = outer["axis"] if outer["swap"] else outer["axis"] - outer["turn"]
        if abs(np.sin(inner["axis"] - along)) < 0.3:
            return self.forget()
        self.guide(q, (block, "guided"), outer)
        self.joint(
            "prismatic", (block, "slot"), (arm, "guided"), axis=inner["axis"], turn=inner["turn"]
        )
        self.joint("revolute", p, (arm, "p0"))
        return self.done(kind, 0, data, self.uses(p, q))

    # -- gears -----------------------------------------------------------------------------

    def known(self):
        """Return a body whose angle is known: the crank, a wheel, or any moving body."""
        bodies = self.case.bodies
        sure = [
            b
            for b in bodies
            if self.case.elements[self.case.maker[b]].kind in ("crank", "gear", "pinion")
        ]
        pool = sure if sure and self.rng.random() < 0.7 else bodies
        return pool[int(self.rng.integers(len(pool)))]

    def add_gear(self, kind):
        rng = self.rng
        other, carrier = self.known(), "ground"
        on = self.ground(self.origin + self.vector(2))
        if kind == "planet":  # on a moving carrier, about a fixed or a moving sun
            carrier = self.known()
            on = (carrier, "p2")
            others = ["ground", *[b for b in self.case.bodies if b != carrier]]
            other = others[int(rng.integers(len(others)))]
            if "p2" not in self.case.local[carrier]:
                return self.forget()
        body = self.frame(self.link(self.scale * self.uniform(0.2, 0.7)))
        self.joint("revolute", on, (body, "p0"))
        first = bool(rng.random() < 0.5)
        phase = self.uniform(-2, 2)
        data = {
            "body": body, "on": on, "carrier": carrier, "other": other, "first": first,
            "phase": phase, "word": kind,
        }  # fmt: skip
        pair = [(body, "p0"), (other, next(iter(self.case.local[other])))]
        a, b = pair if first else pair[::-1]
        keys = {"phase": phase} | ({"carrier": carrier} if carrier != "ground" else {})
        if kind == "belt":
            data["crossed"] = bool(rng.random() < 0.5)
            data["word"] = "belt crossed" if data["crossed"] else "belt open"
            data["ratio"] = float(rng.choice([0.5, 1.0, 2.0, self.uniform(0.3, 3)]))
            keys |= {"ratio": data["ratio"], "crossed": data["crossed"]}
            self.joint("belt", a, b, **keys)
        else:
            drawn = rng.random()
            if drawn < 0.35:  # by teeth
                teeth = [int(z) for z in rng.integers(12, 60, 2)]
                mesh = str(rng.choice(["external", "internal"]))
                sense = -1 if mesh == "external" else 1
                data["ratio"] = sense * teeth[1] / teeth[0]
                keys |= {"teeth": teeth, "mesh": mesh}
            else:
                data["ratio"] = float(
                    rng.choice([-2.0, -0.5, 1.5, -1.0, 2.0, self.uniform(0.2, 3)])
                    * rng.choice([-1, 1])
                )
                keys["ratio"] = data["ratio"]
            rolls = kind == "gear" and drawn > ROLLS and data["ratio"] != 1.0
            if rolls:  # radii whose quotient is the ratio to the last bit
                contact = "internal" if keys.pop("ratio") > 0 else "external"
                keys |= {"radius": 0.0625, "second_radius": 0.0625 * abs(data["ratio"])}
                self.joint("friction-wheel", a, b, contact=contact, **keys)
                data["word"] = f"friction wheel {contact}"
            else:
                self.joint("gear", a, b, **keys)
            if kind == "gear" and not rolls:
                data["word"] = "gear internal" if data["ratio"] > 0 else "gear external"
        return self.done("gear", 0, data, self.uses(on, (carrier,), (other,)))

    def add_rack(self, kind):
        rng, case = self.rng, self.case
        wheel = self.known()
        carrier = "ground"
        on = self.place()
        if on[0] == wheel:
            return self.forget()
        spec = self.spec()
        body = self.frame({"p1": 0j, "guided": self.vector(0.4), "p2": self.vector()})
        lean = float(rng.choice([0.0, self.uniform(-0.9, 0.9)]))
        along = spec["axis"] if spec["swap"] else spec["axis"] - spec["turn"]
        tooth = float(along + lean + rng.choice([0.0, np.pi]))
        radius = self.uniform(0.2, 0.7) * self.scale * float(rng.choice([-1, 1]))
        center = (wheel, next(iter(case.local[wheel])))
        world = self.world()
        rolled = radius * float(world.angle(wheel).c[0][0].real)
        phase = -rolled + self.uniform(-1, 1) * self.scale
        data = {
            "g": on, "wheel": center, "carrier": carrier, "body": body, "tooth": tooth,
            "radius": radius, "phase": phase, **spec,
        }  # fmt: skip
        self.guide(on, (body, "guided"), spec)
        self.joint("rack", center, (body, "p1"), radius=radius, axis=tooth, phase=phase)
        return self.done(kind, 0, data, self.uses(on, (wheel,)))

    def add_pinion(self, kind):
        rng, case = self.rng, self.case
        rack = case.bodies[int(rng.integers(len(case.bodies)))]
        on = self.place()
        if on[0] == rack or "p2" not in case.local[rack]:
            return self.forget()
        body = self.frame(self.link(self.scale * self.uniform(0.2, 0.7)))
        radius = self.uniform(0.3, 0.9) * self.scale * float(rng.choice([-1, 1]))
        data = {
            "on": on, "rack": (rack, "p2"), "carrier": "ground", "body": body,
            "tooth": self.angle(), "radius": radius, "phase": self.uniform(-1, 1) * self.scale,
        }  # fmt: skip
        keys = {"radius": radius, "axis": data["tooth"], "phase": data["phase"]}
        self.joint("revolute", on, (body, "p0"))
        self.joint("rack", (body, "p0"), data["rack"], **keys)
        return self.done(kind, 0, data, self.uses(on, (rack,)))

    def add_weld(self, kind):
        on = self.place(moving=True)
        body = self.frame({"p0": 0j, "p2": self.vector()})
        data = {"on": on, "turn": self.angle(), "body": body}
        self.joint("weld", on, (body, "p0"), turn=data["turn"])
        return self.done(kind, 0, data, self.uses(on))

    # -- groups without a closed formula -----------------------------------------------------

    def add_triad(self, kind, legs=None):
        """A platform whose three pins are somewhere at the sketch, held by three legs."""
        rng, case, size = self.rng, self.case, self.scale
        long = 10.0 ** self.uniform(-0.3, 3) if self.family == "slender" else 1.0
        places = [self.first_place(), self.place(), self.place()]
        if len({place[0] for place in places}) == 1:
            return self.forget()
        spots = [self.where(place) for place in places]
        center = sum(spots) / 3 + self.vector(1.5)
        pins = [center + self.vector(1.2) for _ in range(3)]
        sides = [abs(pins[i] - pins[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
        if min(sides) < 0.15 * size:
            return self.forget()
        angle = self.angle()
        shift = self.vector(2) * rng.choice([0, 1])
        turn = np.exp(-1j * angle)
        body = self.frame({}, plain=True)
        case.local[body] = {}
        for name, z in zip(("p0", "p1", "p2"), pins, strict=True):
            self.point(body, name, (z - center) * turn - shift)
        self.pin0 = pins[0]
        # the place of p0 and the angle at the sketch
        root = (pins[0].real, pins[0].imag, angle)
        data = {"body": body, "legs": []}
        chosen = legs or [str(rng.choice(LEGS)) for _ in range(3)]
        for number, (word, place, spot, pin) in enumerate(
            zip(chosen, places, spots, pins, strict=True)
        ):
            leg = {"kind": word, "on": place, "pin": f"p{number}"}
            self.leg(body, leg, spot, pin, angle, long)
            data["legs"].append(leg)
        return self.done(kind, 1, data, self.uses(*places), root=root)

    def leg(self, body, leg, spot, pin, angle, long):
        """Make one leg from a known place to the platform's pin."""
        rng, size, word = self.rng, self.scale, leg["kind"]
        plate = (body, leg["pin"])
        far = abs(pin - spot)
        if word in ("link", "bar"):
            if far < 0.1 * size or long > 1:  # a place further away, on the same body
                spot = pin + self.vector() + size * long * np.exp(1j * self.angle())
                leg["on"] = self.marked(leg["on"][0], spot)
                far = abs(pin - spot)
            if word == "bar":
                leg["length"] = float(far)
                self.joint("distance", leg["on"], plate, length=leg["length"])
                return
            points = self.link(far)
            leg["body"] = link = self.frame(points)
            self.joint("revolute", leg["on"], (link, "p0"))
            self.joint("revolute", (link, "p1"), plate)
            return
        leg |= self.spec()
        if word == "slot":
            leg.update(turn=0.0, swap=False)
        if word in ("slide", "slot"):  # a guide on the known body, through the pin
            known = leg["on"][0]
            direction = complex(self.world().direction(known).c[0][0])
            own = direction * np.exp(1j * leg["turn"] * (-1 if leg["swap"] else 1))
            along = (own if leg["swap"] else direction) * np.exp(1j * leg["axis"])
            through = pin
            if word == "slide":
                offset = self.vector(0.4) * rng.choice([0, 1])
                leg["body"] = self.frame({"p1": 0j, "guided": offset, "p2": self.vector()})
                local = self.case.local[leg["body"]]
                gap = complex(*local["guided"]) - complex(*local["p1"])
                through = pin + own * gap
            leg["on"] = self.marked(known, through + along * self.uniform(-1, 1) * size)
            if word == "slot":
                self.joint("slot", leg["on"], plate, axis=leg["axis"])
            else:
                self.guide(leg["on"], (leg["body"], "guided"), leg)
                self.joint("revolute", (leg["body"], "p1"), plate)
            return
        # a guide on the platform, through the known place
        turn = np.exp(1j * leg["turn"] * (-1 if leg["swap"] else 1))
        if word == "groove":
            leg.update(swap=False, turn=0.0)
            turn = 1.0
        axis = np.exp(1j * leg["axis"]) * (turn if leg["swap"] else 1.0)
        platform = np.exp(1j * angle)
        through = spot
        if word == "rail":
            offset = self.vector(0.4) * rng.choice([0, 1])
            leg["body"] = self.frame({"p1": 0j, "guided": offset, "p2": self.vector()})
            local = self.case.local[leg["body"]]
            through = spot + platform * turn * (complex(*local["guided"]) - complex(*local["p1"]))
        z = through + platform * axis * self.uniform(-1, 1) * size
        origin = complex(*self.case.local[body]["p0"])
        local = (z - self.pin0) / platform + origin
        name = f"s{leg['pin'][1]}"
        self.point(body, name, local)
        leg["pin"] = name
        if word == "groove":
            self.joint("slot", (body, name), leg["on"], axis=leg["axis"])
        else:
            self.guide((body, name), (leg["body"], "guided"), leg)
            self.joint("revolute", leg["on"], (leg["body"], "p1"))

    def add_geared(self, kind):
        """Links a and b in a row, b turned by a gear on a, held at its end by a bar or a link."""
        rng, case = self.rng, self.case
        p, q = self.first_place(), self.place()
        if p[0] == q[0]:
            return self.forget()
        others = ["ground", *case.bodies]
        other = others[int(rng.integers(len(others)))]
        a = self.frame(self.link(self.uniform(0.5, 1.5) * self.scale))
        b = self.frame(self.link(self.uniform(0.3, 1.0) * self.scale))
        ratio = float(rng.choice([-2.0, -1.0, -0.5, 2.0, 3.0, self.uniform(-3, 3)]))
        if abs(ratio) < 0.2 or abs(ratio - 1) < 0.2:
            ratio = -1.0
        first = bool(rng.random() < 0.5)
        phase, alpha = self.uniform(-2, 2), self.angle()
        known = float(self.world().angle(other).c[0][0].real)
        if first:
            beta = alpha + ratio * (known - alpha) + phase
        else:
            beta = alpha + (known - alpha - phase) / ratio
        local = case.local
        arm_a, arm_b = (
            complex(*local[body]["p1"]) - complex(*local[body]["p0"]) for body in (a, b)
        )
        pin = self.where(p) + arm_a * np.exp(1j * alpha) + arm_b * np.exp(1j * beta)
        far = abs(pin - self.where(q))
        if far < 0.2 * self.scale:
            return self.forget()
        leg = {"kind": str(rng.choice(["link", "bar"]))}
        self.joint("revolute", p, (a, "p0"))
        self.joint("revolute", (a, "p1"), (b, "p0"))
        pair = [(b, "p0"), (other, next(iter(local[other])))]
        one, two = pair if first else pair[::-1]
        self.joint("gear", one, two, ratio=ratio, phase=phase, carrier=a)
        if leg["kind"] == "bar":
            leg["length"] = float(far)
            self.joint("distance", (b, "p1"), q, length=leg["length"])
        else:
            leg["body"] = self.frame(self.link(far))
            self.joint("revolute", q, (leg["body"], "p0"))
            self.joint("revolute", (leg["body"], "p1"), (b, "p1"))
        data = {
            "p": p, "q": q, "a": a, "b": b, "other": other, "ratio": ratio, "phase": phase,
            "first": first, "leg": leg,
        }  # fmt: skip
        return self.done(kind, 1, data, self.uses(p, q, (other,)), root=(alpha,))

    # -- on purpose ------------------------------------------------------------------------

    def near_change(self):
        """A four-bar whose longest and shortest links nearly equal the others."""
        rng = self.rng
        self.begin()
        gap = 10.0 ** rng.uniform(-16, -2) * rng.choice([-1, 1])
        a = self.arm
        d, b = a * self.uniform(1.2, 4), a * self.uniform(1.2, 4)
        c = rng.choice([d + b - a, a + b - d, a + d - b])
        if c <= 0.1 * a:
            c = d + b - a
        c += gap * self.scale
        q = self.ground(self.origin + d * np.exp(1j * self.angle()))
        first, second = self.frame(self.link(b)), self.frame(self.link(c))
        self.four_bar(("crank", "p2"), q, first, second)
        self.case.notes.append(f"gap {gap:.1e}")
        data = {"p": ("crank", "p2"), "q": q, "a": first, "b": second}
        if not self.done("rrr", int(rng.choice([-1, 1])), data, (0,)):
            raise Failed

    def four_bar(self, p, q, first, second):
        self.joint("revolute", p, (first, "p0"))
        self.joint("revolute", q, (second, "p0"))
        self.joint("revolute", (first, "p1"), (second, "p1"))

    def through_change(self):
        """A parallelogram, a kite or an equal-legged slider-crank with exact numbers."""
        rng, case = self.rng, self.case
        self.begin()
        a = self.arm
        kind = str(rng.choice(["parallel", "kite", "galloway", "slider"]))
        case.notes.append(kind)
        case.crossings = str(rng.choice(["continue", "switch", "stop"], p=[0.6, 0.2, 0.2]))
        sign = int(rng.choice([-1, 1]))
        data = {"p": ("crank", "p2"), "meeting": kind}

        def bar(length, **more):
            points = {"p0": 0j, "p1": length, "p2": self.vector(), **more}
            return self.frame(points, plain=True)

        if kind == "slider":  # rod as long as the crank, the guide through its centre
            data |= {"g": ("ground", "O"), "a": bar(a), "axis": 0.0, "turn": 0.0}
            points = {"p1": 0j, "guided": 0j, "p2": self.vector()}
            data["b"] = block = self.frame(points, plain=True)
            self.joint("revolute", data["p"], (data["a"], "p0"))
            self.joint("revolute", (data["a"], "p1"), (block, "p1"))
            self.guide(data["g"], (block, "guided"), data)
            kept = self.done("rrp", sign, data, (0,))
        else:
            d = float(a * rng.integers(9, 30) / 8)
            b, c = {"parallel": (d, a), "kite": (a, d), "galloway": (d, d)}[kind]
            if kind == "galloway":
                d = a
            ox, oy = case.local["ground"]["O"]
            data["q"] = self.ground(complex(ox + d, oy))
            data["a"], data["b"] = bar(b), bar(c)
            self.four_bar(data["p"], data["q"], data["a"], data["b"])
            kept = self.done("rrr", sign, data, (0,))
        if not kept:
            raise Failed
        far = min(abs(np.sin(case.s0)), abs(np.cos(case.s0)))
        if far < 0.05:
            raise Failed
        for _ in range(int(rng.integers(0, 2))):
            for _ in range(20):
                if self.add(str(rng.choice(DYADS))):
                    break

    def near_saddle(self):
        """A platform on three legs, the third as long as where two branches meet, nearly.

        With the first two legs closed, the third's length is a function of driver and
        platform angle; where it is stationary and no extreme, branches meet.
        """
        rng = self.rng
        for _ in range(40):
            self.begin()
            if not self.add_triad("triad", ["bar", "bar", "bar"]):
                continue
            case = self.case
            element = case.elements[-1]
            spot = self._saddle(element)
            if spot is None:
                case.elements.pop()
                self.forget()
                continue
            gap = 10.0 ** rng.uniform(-10, -2) * rng.choice([-1, 1])
            u, root, length = spot
            leg = element.data["legs"][2]
            leg["length"] = float(length * (1 + gap))
            kind, name, a, b, keys = case.joints[-1]
            case.joints[-1] = (kind, name, a, b, {**keys, "length": leg["length"]})
            case.notes.append(f"gap {gap:.1e} at {u!r}")
            # a sketch somewhat before the near miss, on one of the branches there
            for off in rng.permutation([-0.5, -0.3, 0.3, 0.5]):
                case.s0 = float(u + off * case.unit)
                world = case.close([case.s0], upto=len(case.elements) - 1)
                roots = SYSTEMS["triad"](world, element).all_roots()
                if not roots:
                    continue
                near = sorted(roots, key=lambda r: abs(np.sin((r[2] - root[2]) / 2)))
                element.root = near[int(rng.integers(min(2, len(near))))]
                disc = self.world().discs[-1].c[0][0].real
                if disc > 1e-4:
                    return
            raise Failed
        raise Failed

    def _saddle(self, element):
        """Return driver value, platform and third length at a saddle of that length."""
        case = self.case
        k = len(case.elements) - 1
        legs = element.data["legs"]
        body = element.data["body"]
        x0 = np.array([case.s0 / case.unit, element.root[2]])

        def third(x):
            """Return the third leg's length for many (u, phi), on the sketch's side."""
            world = case.close(x[0] * case.unit, wide=False, upto=k)
            e = np.exp(1j * x[1])
            spots = [world.place(leg["on"]).c[0] for leg in legs]
            arms = [e * world.gap(body, "p0", leg["pin"]) for leg in legs]
            p, q = spots[0] - arms[0], spots[1] - arms[1]
            a2, b2 = legs[0]["length"] ** 2, legs[1]["length"] ** 2
            line = q - p
            d2 = abs(line) ** 2
            along = (d2 + a2 - b2) / (2 * d2)
            Z = p + line * (along + 1j * side * np.sqrt(a2 / d2 - along**2))
            return Z, np.abs(Z + arms[2] - spots[2])

        wanted = complex(*element.root[:2])
        side = -1  # of the branch on which the first two legs are closed
        if abs(third(x0[:, None])[0][0] - wanted) > 1e-6 * self.scale:
            side = 1
        h = 1e-4
        shifts = np.array(
            [(0, 0), (h, 0), (-h, 0), (0, h), (0, -h), (h, h), (h, -h), (-h, h), (-h, -h)]
        ).T
        starts = self.rng.uniform(-1.5, 1.5, (8, 2)) + x0
        for x in starts:
            for _ in range(30):
                _, f = third(x[:, None] + shifts)
                if not np.all(np.isfinite(f)):
                    break
                g = np.array([f[1] - f[2], f[3] - f[4]]) / (2 * h)
                H = (
                    np.array(
                        [
                            [(f[1] - 2 * f[0] + f[2]), (f[5] - f[6] - f[7] + f[8]) / 4],
                            [(f[5] - f[6] - f[7] + f[8]) / 4, (f[3] - 2 * f[0] + f[4])],
                        ]
                    )
                    / h**2
                )
                det = H[0, 0] * H[1, 1] - H[0, 1] ** 2
                if not np.isfinite(det) or det == 0:
                    break
                step = np.linalg.solve(H, g)
                size = float(np.abs(step).max())
                x = x - step * min(1.0, 0.3 / size if size else 1.0)
                if size < 1e-9:
                    if det < -1e-3 * self.scale**2 and abs(x[0] - x0[0]) < 3:
                        Z, f = third(x[:, None])
                        root = (Z[0].real, Z[0].imag, float(x[1]))
                        return float(x[0] * case.unit), root, float(f[0])
                    break
        return None

    # -- whole -----------------------------------------------------------------------------

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
