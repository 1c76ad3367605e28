"""Closure of groups by complex numbers, one after the other, each by its own formula.

A place is ("body", "point"). A `World` holds the frames of the bodies that are closed; a
closure adds those of its element and returns its discriminant: above zero while the element
assembles, zero where its two branches meet, None where it has no branches.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .series import CLD, LD, Series, constant


@dataclass
class Element:
    """A group as it is drawn: its kind, branch sign, numbers, and the elements it stands on.

    `root` are the unknowns at the sketch of an element that is followed numerically (see
    `tracks`). `crossings`, `track` and `reach` are found by `Case.survey`.
    """

    kind: str
    sign: int
    data: dict
    uses: tuple[int, ...] = ()
    bodies: tuple[str, ...] = ()
    root: tuple = ()
    crossings: list = field(default_factory=list)
    track: object = None
    reach: tuple = ()

    def flipped(self, u, s0):
        """Return -1 where an odd number of change points lies between the sketch and u, else 1."""
        flips = np.zeros(np.shape(u), int)
        for place in self.crossings:
            flips += (u > place) != (s0 > place)
        return np.where(flips % 2, -1, 1)


class World:
    """Frames of bodies over driver values u, as series; `wide` in 80 bits, else in 64."""

    def __init__(self, case, u, order=0, wide=True, rates=(1.0, 0.0)):
        self.case, self.wide, self.order = case, wide, order
        self.u = np.asarray(u, LD if wide else float)
        c = np.zeros((order + 1, len(self.u)), CLD if wide else complex)
        c[0] = self.u
        if order > 0:
            c[1] = rates[0]
        if order > 1:
            c[2] = self.real(rates[1]) / 2
        self.driver = Series(c)
        one = constant(1.0, self.driver)
        self.frames = {"ground": (constant(0.0, one), one)}
        self.angles = {"ground": constant(0.0, one)}
        self.after = {}  # body -> (body, turn): an angle that is another one's plus a number
        self.discs = []

    def real(self, x):
        return LD(x) if self.wide else float(x)

    def at(self, body, point):
        """Return the local coordinates of a point as a complex number."""
        x, y = self.case.local[body][point]
        return CLD(LD(x)) + 1j * CLD(LD(y)) if self.wide else complex(float(x), float(y))

    def gap(self, body, a, b):
        return self.at(body, b) - self.at(body, a)

    def turned(self, angle):
        """exp(i angle) of a number."""
        return np.exp(1j * CLD(LD(angle))) if self.wide else np.exp(1j * complex(float(angle)))

    def place(self, place):
        origin, direction = self.frames[place[0]]
        return origin + direction * self.at(*place)

    def direction(self, body):
        return self.frames[body][1]

    def put(self, body, point, place, direction, angle=None, after=None):
        """Fix a body by one of its points and its direction."""
        self.frames[body] = (place - direction * self.at(body, point), direction)
        self.angles[body] = angle
        if after:
            known, spec = after
            turn = self.real(spec["turn"])
            self.after[body] = (known, -turn if spec.get("swap") else turn)

    def angle(self, body):
        """Return the unwrapped angle of a body: the sketch's, as it turned on since."""
        if self.angles[body] is None and body in self.after:
            known, turn = self.after[body]
            self.angles[body] = self.angle(known) + turn
        if self.angles[body] is None:
            self.angles[body] = self.direction(body).argument(
                lambda value: self.case.lifted(body, self.u, value.real)
            )
        return self.angles[body]

    def guided(self, body, spec):
        """Return direction of a block and of its guide, which is fixed to `body`.

        With "swap" the joint names the block first, and axis and turn are the block's.
        """
        known = self.direction(body)
        axis, turn = self.turned(spec["axis"]), self.turned(spec["turn"])
        if spec.get("swap"):
            own = known * np.conj(turn)
            return own, own * axis
        return known * turn, known * axis


# -- drivers -------------------------------------------------------------------------------


def close_crank(world, d, _sign):
    world.put("crank", "O", world.place(("ground", "O")), world.driver.unit(), world.driver)


def close_ram(world, d, _sign):
    place = world.place(("ground", "O")) + world.driver * world.turned(d["axis"])
    turn = constant(world.real(d["turn"]), world.driver)
    world.put("ram", "O", place, constant(world.turned(d["turn"]), place), turn)


def close_cylinder(world, d, sign):
    """A link "crank" on ground point O, pushed by a cylinder on ground point Q.

    The block, pinned to the link, slides along the cylinder; its slide is the driver.
    """
    p, q = world.place(("ground", "O")), world.place(("ground", "Q"))
    arm = world.gap("crank", "O", "p1")
    barrel, rod = d["barrel"], d["rod"]
    turn = world.turned(d["turn"])
    reach = (
        world.gap(barrel, "p0", "slot")
        + world.turned(d["axis"]) * world.driver
        - turn * world.gap(rod, "p1", "guided")
    )
    pin, disc = two_circles(p, abs2(arm), q, reach.square(), sign)
    world.put("crank", "O", p, (pin - p) / arm)
    direction = (pin - q) / reach
    world.put(barrel, "p0", q, direction)
    world.put(rod, "p1", pin, direction * turn, after=(barrel, d))
    return disc


# -- gears ---------------------------------------------------------------------------------


def close_gear(world, d, _sign):
    """A wheel on a known place, meshing or belted with a body whose angle is known."""
    base, other = world.angle(d["carrier"]), world.angle(d["other"])
    ratio, phase = world.real(d["ratio"]), world.real(d["phase"])
    if d.get("crossed"):
        ratio = -ratio
    if d["first"]:  # wheel - c = ratio (other - c) + phase
        angle = base + (other - base) * ratio + phase
    else:  # other - c = ratio (wheel - c) + phase
        angle = base + (other - base - phase) / ratio
    world.put(d["body"], "p0", world.place(d["on"]), angle.unit(), angle)


def close_rack(world, d, _sign):
    """A rack guided on a known body, driven by a known wheel."""
    g = d["g"]
    own, along = world.guided(g[0], d)
    tooth = own * world.turned(d["tooth"])
    base = world.place(g) + own * world.gap(d["body"], "guided", "p1")
    rolled = (world.angle(d["wheel"][0]) - world.angle(d["carrier"])) * world.real(d["radius"])
    gap = ((base - world.place(d["wheel"])) * tooth.conjugate()).real
    slide = (rolled + world.real(d["phase"]) - gap) / (along * tooth.conjugate()).real
    world.put(d["body"], "p1", base + along * slide, own, after=(g[0], d))


def close_pinion(world, d, _sign):
    """A wheel on a known place, driven by a known body as its rack."""
    place = world.place(d["on"])
    tooth = world.direction(d["rack"][0]) * world.turned(d["tooth"])
    gap = ((world.place(d["rack"]) - place) * tooth.conjugate()).real
    angle = world.angle(d["carrier"]) + (gap - world.real(d["phase"])) / world.real(d["radius"])
    world.put(d["body"], "p0", place, angle.unit(), angle)


def close_weld(world, d, _sign):
    direction = world.direction(d["on"][0]) * world.turned(d["turn"])
    world.put(d["body"], "p0", world.place(d["on"]), direction, after=(d["on"][0], d))


# -- dyads ---------------------------------------------------------------------------------


def abs2(z):
    return z.real * z.real + z.imag * z.imag


def two_circles(p, a2, q, b2, sign):
    """Return the point at squared distances a2, b2 from p, q, and the discriminant."""
    line = q - p
    d2 = line.square()
    x = (d2 + a2 - b2) / (2 * d2)
    disc = a2 / d2 - x * x
    return p + line * (x + disc.sqrt() * (1j * sign)), disc


def close_meeting(world, d, sign):
    """A dyad with change points by its dimensions, on the crank with its centre at O.

    Where branches cross, the root of the discriminant is a smooth function with a sign: a
    closed one, without the cancellation that the general formula has there. With r the crank
    and g the ground link, and D the distance of the outer pins:

    parallel, kite (links g and r, or r and g): root = r g sin u / D^2, crossings at k pi;
    galloway (r = g, equal links l): height sqrt(l^2 - D^2 / 4) on exp(iu/2), at 2 k pi;
    slider (rod r, guide through O): root = r cos u, at pi/2 + k pi.
    """
    case = world.case
    kind, turn = d["meeting"], world.driver.unit()
    p, u0 = world.place(d["p"]), LD(case.s0)
    r = world.gap("crank", "O", "p2").real
    if kind == "slider":
        pin = world.place(d["g"]) + (turn + turn.conjugate()) * r
        smooth = np.cos(u0)
        still = world.place(d["g"]) + 0 * turn
    elif kind == "galloway":
        half = (world.driver / 2).unit()
        line = world.place(d["q"]) - p
        arm = abs2(world.gap(d["a"], "p0", "p1"))
        rest = constant(arm, line) - line.square() / 4
        height = half * rest.sqrt()
        pin, still = p + line / 2 + height, p + line / 2 - height
        smooth = np.sin(u0 / 2)
    else:
        line = world.place(d["q"]) - p
        a2, b2 = abs2(world.gap(d["a"], "p0", "p1")), abs2(world.gap(d["b"], "p0", "p1"))
        d2 = line.square()
        x = (d2 + (a2 - b2)) / (2 * d2)
        g = (world.place(d["q"]) - world.place(("ground", "O"))).c[0][0].real
        root = turn.imag * (r * g) / d2
        pin, still = p + line * (x + root * 1j), p + line * (x - root * 1j)
        smooth = np.sin(u0)
    # the general formula has sign * |root| at the sketch
    sense = sign * (1 if smooth > 0 else -1)
    both = np.asarray(sense) > 0
    pin = Series(np.where(both, pin.c, still.c))
    world.put(d["a"], "p0", p, (pin - p) / world.gap(d["a"], "p0", "p1"))
    if "g" in d:
        world.put(d["b"], "p1", pin, world.guided(d["g"][0], d)[0], after=(d["g"][0], d))
    else:
        q = world.place(d["q"])
        world.put(d["b"], "p0", q, (pin - q) / world.gap(d["b"], "p0", "p1"))
    return constant(1.0, p)


def close_rrr(world, d, sign):
    """Links a (p0 on place p) and b (p0 on place q), pinned at their p1; b None: a bar."""
    if d.get("meeting"):
        return close_meeting(world, d, sign)
    p, q = world.place(d["p"]), world.place(d["q"])
    arm_a = world.gap(d["a"], "p0", "p1")
    a2 = constant(abs2(arm_a), p)
    if d["b"] is not None:
        arm_b = world.gap(d["b"], "p0", "p1")
        b2 = abs2(arm_b)
    else:
        b2 = world.real(d["length"]) ** 2
    pin, disc = two_circles(p, a2, q, b2, sign)
    world.put(d["a"], "p0", p, (pin - p) / arm_a)
    if d["b"] is not None:
        world.put(d["b"], "p0", q, (pin - q) / arm_b)
    return disc


def close_rrp(world, d, sign):
    """Rod a from place p to a pin that moves along a line of body g; block b or a slot."""
    if d.get("meeting"):
        return close_meeting(world, d, sign)
    p, base = world.place(d["p"]), world.place(d["g"])
    own, axis = world.guided(d["g"][0], d)
    arm = world.gap(d["a"], "p0", "p1")
    if d["b"] is not None:
        base = base + own * world.gap(d["b"], "guided", "p1")
    away = (base - p) * axis.conjugate()
    disc = abs2(arm) - away.imag * away.imag
    pin = base + axis * (disc.sqrt() * sign - away.real)
    world.put(d["a"], "p0", p, (pin - p) / arm)
    if d["b"] is not None:
        world.put(d["b"], "p1", pin, own)
    return disc / abs2(arm)


def close_rpr(world, d, sign):
    """Slotted body a pinned at place p; block b (or the bare pin) at place q in its slot."""
    p, q = world.place(d["p"]), world.place(d["q"])
    k = world.gap(d["a"], "p0", "slot")
    axis, turn = world.turned(d["axis"]), world.turned(d["turn"])
    if d.get("swap"):
        turn = np.conj(turn)
        axis = turn * axis
    if d["b"] is not None:
        k = k - turn * world.gap(d["b"], "p1", "guided")
    line = q - p
    d2 = line.square()
    across = (np.conj(axis) * k).imag
    disc = d2 - across * across
    t = disc.sqrt() * sign - (np.conj(axis) * k).real
    direction = line / (t * axis + k)
    world.put(d["a"], "p0", p, direction)
    if d["b"] is not None:
        world.put(d["b"], "p1", q, direction * turn)
    return disc / d2


def close_prp(world, d, _sign):
    """Blocks a on a line of body g, b on a line of body h, pinned to each other."""
    lines = []
    for block, on, spec in (("a", "g", d["guide_a"]), ("b", "h", d["guide_b"])):
        own, axis = world.guided(d[on][0], spec)
        base = world.place(d[on]) + own * world.gap(d[block], "guided", "p1")
        lines.append((base, own, axis))
    (b1, own1, e1), (b2, own2, e2) = lines
    cross = (e1.conjugate() * e2).imag
    t = ((b2 - b1) * e2.conjugate()).imag / (e1 * e2.conjugate()).imag
    pin = b1 + t * e1
    world.put(d["a"], "p1", pin, own1, after=(d["g"][0], d["guide_a"]))
    world.put(d["b"], "p1", pin, own2, after=(d["h"][0], d["guide_b"]))
    return cross * cross


def close_rpp(world, d, _sign):
    """Body a pinned at place p, sliding along block b, which slides along a line of body g."""
    own, axis = world.guided(d["g"][0], d["guide_b"])
    inner = d["guide_a"]
    direction, along = own * world.turned(inner["turn"]), own * world.turned(inner["axis"])
    p = world.place(d["p"])
    world.put(d["a"], "p0", p, direction, after=(d["b"], inner))
    target = p + direction * world.gap(d["a"], "p0", "guided")
    base = world.place(d["g"]) + own * world.gap(d["b"], "guided", "slot")
    t = ((target - base) * along.conjugate()).imag / (axis * along.conjugate()).imag
    world.put(d["b"], "slot", base + axis * t, own, after=(d["g"][0], d["guide_b"]))


CLOSURES = {
    "crank": close_crank, "ram": close_ram, "cylinder": close_cylinder,
    "gear": close_gear, "rack": close_rack, "pinion": close_pinion, "weld": close_weld,
    "rrr": close_rrr, "bar": close_rrr, "rrp": close_rrp, "rpr": close_rpr,
    "prp": close_prp, "rpp": close_rpp,
}  # fmt: skip
DRIVERS = ("crank", "ram", "cylinder")
