"""A drawn mechanism and the truth about it: closure, reach of each group, change points."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field

import numpy as np

import mechdae as md

from .elements import CLOSURES, DRIVERS, Element, World
from .series import LD, PI
from .tracks import FOLD, Track, vanishes
from .unclosed import SYSTEMS

TURN = 2 * np.pi
GRID = 1200
"""Places a turn at which discriminants are looked at."""
NODES = 200
"""Places a turn at which groups without a closed formula are visited."""
UNSURE = 1e-13
"""A discriminant that comes nearer to zero than this is not judged."""


class Doubtful(Exception):
    """The truth itself is not sure enough to judge by."""


@dataclass
class End:
    """Where an element's motion ends: a driver value, why, and the element that ends."""

    at: object
    kind: str  # limit, change_point, pole; doubtful: not known; open: nothing ends
    owner: int


@dataclass
class Case:
    """A mechanism with its truth; elements are in the order in which they close."""

    seed: int
    local: dict = field(default_factory=dict)  # body -> {point: (x, y)}
    joints: list = field(default_factory=list)  # (kind, name, first, second, keys)
    elements: list = field(default_factory=list)
    bodies: list = field(default_factory=list)
    maker: dict = field(default_factory=dict)  # body -> index of its element
    s0: float = 0.0
    span: tuple = (0.0, TURN)
    assembled: bool = False  # sweep the whole arc in place of the span
    at: tuple = ()  # poses by name in place of the span
    speed: float = 1.0
    acceleration: float = 0.0
    coordinate: str = "crank.angle"
    driver_key: str = "crank"
    scale: float = 1.0
    family: str = ""
    crossings: str = "continue"  # on_change_point of the task
    notes: list = field(default_factory=list)
    lifts: dict = field(default_factory=dict)
    dip: float = 1.0
    surveyed: tuple = ()

    # -- numbers ---------------------------------------------------------------------------

    @property
    def angular(self):
        return self.elements[0].kind == "crank"

    @property
    def unit(self):
        """What 1 is for the driver: a radian or a length."""
        return 1.0 if self.angular else self.scale

    @property
    def size(self):
        return max(abs(v) for points in self.local.values() for xy in points.values() for v in xy)

    def shaken(self, rng, meeting=False, far=0.0):
        """Return the case with all numbers changed by at most a relative 2^-53.

        With `meeting` those stay on which change points hang, and branches go on to meet. Turns
        between bodies are changed by 2^-53 of `far`, the size of their angles, which are sums.
        """
        eps = LD(2.0) ** -53
        other = copy.copy(self)
        kept = self._meeting_places() if meeting else set()
        other.local = {
            body: {
                name: xy
                if (body, name) in kept
                else tuple(LD(v) + eps * LD(self.size) * LD(rng.uniform(-1, 1)) for v in xy)
                for name, xy in points.items()
            }
            for body, points in self.local.items()
        }

        def shake(value, key=None):
            if isinstance(value, float):
                size = max(abs(value), float(far)) if key == "turn" and value else abs(value)
                return LD(value) + eps * LD(size) * LD(rng.uniform(-1, 1))
            if isinstance(value, dict):  # with other numbers branches do not meet any more
                return {k: shake(item, k) for k, item in value.items() if k != "meeting"}
            return [shake(item) for item in value] if isinstance(value, list) else value

        other.elements = []
        for element in self.elements:
            changed = copy.copy(element)
            if not (meeting and "meeting" in element.data):
                changed.data = shake(element.data)
            other.elements.append(changed)
        return other

    def _meeting_places(self):
        """Return the points that make branches meet by their numbers."""
        places = {("ground", "O"), ("crank", "O"), ("crank", "p2")}
        for element in self.elements:
            data = element.data
            if "meeting" in data:
                places |= {data[key] for key in ("p", "q", "g") if key in data}
                places |= {(data[body], p) for body in "ab" for p in ("p0", "p1", "guided")}
        return places

    # -- closure ---------------------------------------------------------------------------

    def close(self, u, order=0, wide=True, rates=(1.0, 0.0), signs=None, upto=None):
        """Return the `World` at driver values u; `signs` replace those of the elements."""
        world = World(self, u, order, wide, rates)
        with np.errstate(all="ignore"):
            for k, element in enumerate(self.elements[:upto]):
                sign = signs[k] if signs else self.sign_of(element, u)
                world.discs.append(CLOSURES[element.kind](world, element_data(element), sign))
        return world

    def sign_of(self, element, u):
        """Return the branch sign at u: another one behind each change point that is crossed.

        A closed form through change points goes on by itself, and is turned for a switch.
        """
        if element.crossings and (self.crossings == "switch") == ("meeting" in element.data):
            return element.sign * element.flipped(u, self.s0)
        return element.sign

    def lifted(self, body, u, value):
        """Return an argument with the whole turns the body has made since the sketch."""
        if body not in self.lifts:
            return value
        grid, turned = self.lifts[body]
        s = np.array(u, float)
        if self.angular:
            for turns in (-1, 1, -2, 2, -3, 3):
                other = s + turns * TURN
                lost = (s < grid[0]) | (s > grid[-1])
                s = np.where(lost & (other >= grid[0]) & (other <= grid[-1]), other, s)
        near = np.interp(s, grid, turned)
        turns = np.round((near - np.asarray(value, float)) / TURN)
        return value + (2 * PI if value.dtype == LD else TURN) * turns

    # -- reach -----------------------------------------------------------------------------

    @np.errstate(all="ignore")
    def survey(self, low, high):
        """Find for each element the interval around the sketch that it can be moved over.

        Sets `reach`, `track` and `crossings` of the elements.

        Raises
        ------
        Doubtful
        """
        low, high = float(min(low, self.s0)), float(max(high, self.s0))
        if self.surveyed and self.surveyed[0] <= low and self.surveyed[1] >= high:
            return
        turns = max(0.5, (high - low) / (TURN if self.angular else 4 * self.scale))
        grid = self._grid(low, high, int(GRID * turns))
        coarse = self._grid(low, high, int(NODES * turns))
        self.lifts, self.dip = {}, 1.0
        needed = {
            element.data[word]
            for element in self.elements
            for word in ("carrier", "other")
            if word in element.data
        }
        needed |= {e.data["wheel"][0] for e in self.elements if e.kind == "rack"}
        after = self.close([self.s0]).after
        while more := {after[body][0] for body in needed if body in after} - needed:
            needed |= more
        world = World(self, grid, order=1, wide=False)
        for k, element in enumerate(self.elements):
            element.crossings = []
            ends = [End(-np.inf, "open", k), End(np.inf, "open", k)]
            for other in element.uses:
                before = self.elements[other].reach
                ends[0] = max(ends[0], before[0], key=lambda e: e.at)
                ends[1] = min(ends[1], before[1], key=lambda e: e.at)
            if element.kind in SYSTEMS:
                ends = self._tracked(k, ends, coarse, low, high)
                element.reach = tuple(ends)
                CLOSURES[element.kind](world, element, element.sign)
            else:
                data = element_data(element)
                disc = CLOSURES[element.kind](world, data, element.sign)
                if disc is not None:
                    found = [self._scan(k, grid, disc, ends, sense) for sense in (-1, 1)]
                    ends = [new or old for new, old in zip(found, ends, strict=True)]
                if "meeting" in element.data:
                    ends = self._meeting(k, element, ends, low, high)
                    CLOSURES[element.kind](world, data, self.sign_of(element, grid))
            element.reach = tuple(ends)
            for body in needed & set(element.bodies):
                if body not in world.after and world.angles[body] is None:
                    self._lift(k, body, grid, ends)
        self.surveyed = (low, high)

    def _grid(self, low, high, n):
        return np.array(sorted({*np.linspace(low, high, n).tolist(), float(self.s0)}))

    def _inner(self, places, ends, fine=True):
        """Return the places between the ends, more of them towards ends that are no parent's."""
        a, b = float(ends[0].at), float(ends[1].at)
        kept = places[(places > a) & (places < b)]
        extra = []
        if fine:
            step = places[1] - places[0]
            shares = [*(np.arange(1, 60) / 60.0) ** 3, *(60.0**-3 * 0.5 ** np.arange(1, 13))]
            for end, sense in ((a, 1), (b, -1)):
                if np.isfinite(end):
                    extra += (end + sense * 2 * step * np.array(shares)).tolist()
        extra = [s for s in extra if a < s < b and places[0] < s < places[-1]]
        return np.array(sorted({*kept.tolist(), *extra}))

    def _tracked(self, k, ends, coarse, low, high):
        element = self.elements[k]
        places = self._inner(coarse, ends)
        given = [
            (end.at, "parent") if np.isfinite(end.at) else (limit, "open")
            for end, limit in zip(ends, (low, high), strict=True)
        ]
        element.track = None
        element.track = track = Track(self, k, *given, places)
        result = []
        for end, (at, kind) in zip(ends, (track.low, track.high), strict=True):
            result.append(end if kind == "parent" else End(at, kind, k))
        return result

    def _meeting(self, k, element, ends, low, high):
        """Find the change points of a dyad that has them by its dimensions."""
        kind = element.data["meeting"]
        first, period = {"slider": (PI / 2, PI), "galloway": (0 * PI, 2 * PI)}.get(
            kind, (0 * PI, PI)
        )
        numbers = range(
            int(np.floor((low - first) / period)) - 1, int(np.ceil((high - first) / period)) + 2
        )
        element.crossings = [first + n * period for n in numbers]
        # the driver stands still on the other branch of a kite of this kind
        if self.crossings == "stop" or (self.crossings == "switch" and kind == "galloway"):
            at = LD(self.s0)
            below = max(c for c in element.crossings if c < at)
            above = min(c for c in element.crossings if c > at)
            element.crossings = []
            ends = [
                max(ends[0], End(below, "change_point", k), key=lambda e: e.at),
                min(ends[1], End(above, "change_point", k), key=lambda e: e.at),
            ]
        return ends

    def _section(self, k, a, b):
        """Return 65 places from a to b with the discriminant and its slope, in 80 bits."""
        s = a + (b - a) * (np.arange(65).astype(LD) / 64)
        disc = self.close(s, order=1, upto=k + 1).discs[k]
        return s, disc.c[0].real, disc.c[1].real

    def _scan(self, k, grid, disc, ends, sense):
        """Return the first end of a dyad in one sense, None where there is none."""
        places = self._inner(grid, ends)
        at = dict(zip(grid.tolist(), range(len(grid)), strict=True))
        new = np.array([s for s in places.tolist() if s not in at])
        value, slope = disc.c[0].real, disc.c[1].real
        if len(new):
            more = self.close(new, order=1, wide=False, upto=k + 1).discs[k]
            value = np.concatenate([value, more.c[0].real])
            slope = np.concatenate([slope, more.c[1].real])
            order = np.argsort(np.concatenate([grid, new]), kind="stable")
            every = np.concatenate([grid, new])[order]
            value, slope = value[order], slope[order]
        else:
            every = grid
        inner = (every > float(ends[0].at)) & (every < float(ends[1].at))
        inner &= (every >= self.s0) if sense > 0 else (every <= self.s0)
        s, value, slope = (part[inner][::sense] for part in (every, value, slope))
        steep = 4 * np.maximum(np.abs(slope[:-1]), np.abs(slope[1:])) * np.abs(np.diff(s))
        dips = (slope[:-1] * sense < 0) & (slope[1:] * sense > 0)
        dips &= np.minimum(value[:-1], value[1:]) < steep
        for i in np.flatnonzero(~(value[1:] > 0) | dips):
            end = self._look(k, LD(s[i]), LD(s[i + 1]), sense)
            if end is not None:
                return end
        last = ends[1 if sense > 0 else 0]
        if last.kind == "limit" and len(s) > 1 and vanishes(float(last.at), s[-2:], value[-2:]):
            return End(LD(s[-1]), "doubtful", k)  # between the last place and that limit
        return None

    def _look(self, k, a, b, sense):
        """Return the end between a and b, the first in the sense of the motion."""
        element = self.elements[k]
        lo, hi = a, b
        for _ in range(14):
            s, value, slope = self._section(k, lo, hi)
            below = np.flatnonzero(value <= 0)
            if not np.all(np.isfinite(value)) or (below.size and not below[0]):
                return End(a, "doubtful", k)
            if below.size:
                return self._bisected(k, s[below[0] - 1], s[below[0]])
            falling = np.flatnonzero(slope * sense < 0)
            rising = np.flatnonzero(slope * sense > 0)
            if not (falling.size and rising.size and falling[0] < rising[-1]):
                return None
            j = int(falling[falling < rising[-1]][-1])
            if s[j] == lo and s[min(j + 1, 64)] == hi:
                break
            lo, hi = s[j], s[min(j + 1, 64)]
        lowest = float(np.min(np.abs(value)))
        if lowest < UNSURE:
            return End(lo, "pole" if element.kind == "prp" else "doubtful", k)
        self.dip = min(self.dip, lowest)
        return None

    def _bisected(self, k, good, bad):
        for _ in range(14):
            s, value, _ = self._section(k, good, bad)
            below = np.flatnonzero(value <= 0)
            if not below.size or not below[0] or s[below[0] - 1] == s[below[0]]:
                break
            good, bad = s[below[0] - 1], s[below[0]]
        return End(good, "pole" if self.elements[k].kind == "prp" else "limit", k)

    def _lift(self, k, body, grid, ends):
        """Tabulate the unwrapped angle of a body over the element's reach."""
        s = self._inner(grid, ends)
        for _ in range(60):
            direction = self.close(s, wide=False, upto=k + 1).direction(body).c[0]
            seen = np.isfinite(direction)
            s, direction = s[seen], direction[seen]
            turned = np.angle(direction)
            wide = np.flatnonzero(np.abs(np.angle(direction[1:] / direction[:-1])) > 1.0)
            if not wide.size:
                break
            if np.min(np.diff(s)[wide]) < 1e-13 * self.unit:
                raise Doubtful(f"{body} turns too fast near {s[wide[0]]!r}")
            more = [s[i] + (s[i + 1] - s[i]) * (np.arange(1, 16) / 16) for i in wide]
            s = np.array(sorted({*s.tolist(), *np.concatenate(more).tolist()}))
        steps = np.concatenate([[0.0], np.angle(direction[1:] / direction[:-1])])
        whole = turned[0] + np.cumsum(steps)
        i = int(np.argmin(np.abs(s - self.s0)))
        whole -= TURN * np.round((whole[i] - turned[i]) / TURN)
        self.lifts[body] = (s, whole)

    def whole(self):
        """Return the two ends of the whole mechanism's motion from the sketch.

        The driver goes on until the first element cannot, and back until the first one cannot:
        each is continued from the sketch on, and they are all on one way of the driver.
        """
        return (
            max((element.reach[0] for element in self.elements), key=lambda end: end.at),
            min((element.reach[1] for element in self.elements), key=lambda end: end.at),
        )

    def periodic(self, k, count=1):
        """Return whether an element is where it was after `count` whole turns of the driver."""
        element, d = self.elements[k], self.elements[k].data
        if not self.angular:
            return False
        turns = 0.0
        if element.kind in ("gear", "geared"):
            ratio = -d["ratio"] if d.get("crossed") else d["ratio"]
            carrier = self.turns(d["carrier"]) if element.kind == "gear" else 0.0
            turns = (self.turns(d["other"]) - carrier) * (ratio if d["first"] else 1 / ratio)
        elif element.kind == "rack":
            turns = 0.0 if self.turns(d["wheel"][0]) == 0 else 0.5
        back = all(self.periodic(other, count) for other in element.uses)
        return float(count * turns).is_integer() and back

    def period(self):
        """Return after how many whole turns of the driver all elements are back, 1 if never."""
        every = range(len(self.elements))
        return next((n for n in range(1, 5) if all(self.periodic(k, n) for k in every)), 1)

    def turns(self, body):
        """Return by how much a body's angle must change, in turns, when the driver's does by one.

        That of a wheel does which gears tie to the driver's own number; that of a link that joints
        alone carry round is the same again, since no equation counts its turns from the driver.
        """
        if body in ("ground", "crank"):
            return float(body == "crank")
        element = self.elements[self.maker[body]]
        d = element.data
        if element.kind == "gear":
            ratio = -d["ratio"] if d.get("crossed") else d["ratio"]
            ratio = ratio if d["first"] else 1 / ratio
            carrier = self.turns(d["carrier"])
            return carrier + (self.turns(d["other"]) - carrier) * ratio
        after = self.close([self.s0]).after.get(body)
        return self.turns(after[0]) if after else 0.0

    # -- description -----------------------------------------------------------------------

    def mechanism(self, sketch_at=None, jitter=0.0):
        """Return the package's mechanism, sketched at the driver value `s0`."""
        rng = np.random.default_rng(self.seed + 1)
        s = self.s0 if sketch_at is None else sketch_at
        world = self.close([s])
        sketch = {
            body: float(np.angle(complex(world.direction(body).c[0][0])))
            + jitter * rng.uniform(-1, 1)
            for body in self.bodies
        }
        for body in self.bodies:  # whole turns count where gears hang on them
            if self.maker[body] and (world.angles[body] is not None or body in world.after):
                sketch[body] = float(world.angle(body).c[0][0].real)
        sketch[self.driver_key] = float(s)
        bodies = [md.Body(name, points=self.local[name]) for name in self.bodies]
        joints = [
            JOINTS[kind](name, a, b, **keys) for kind, name, a, b, keys in self._wound(sketch)
        ]
        rng.shuffle(bodies)
        rng.shuffle(joints)
        return md.Mechanism(
            ground=md.Ground(points=self.local["ground"]),
            bodies=bodies,
            joints=joints,
            sketch=sketch,
        )

    def _wound(self, sketch):
        """Return the joints with whole turns in `turn` where one gear names both bodies.

        Of bodies that keep their directions the turn between them is what the joint says: no
        sketch can say otherwise, and a gear that hangs on both tells whole turns of it.
        """
        ends = [(a.split(".")[0], b.split(".")[0]) for _, _, a, b, _ in self.joints]
        together = {body: {body} for pair in ends for body in pair}
        for (kind, *_), (a, b) in zip(self.joints, ends, strict=True):
            if kind in ("prismatic", "weld"):
                both = together[a] | together[b]
                together.update(dict.fromkeys(both, both))
        geared = [
            {a, b, keys.get("carrier", "ground")}
            for (kind, *_, keys), (a, b) in zip(self.joints, ends, strict=True)
            if kind in ("gear", "belt", "rack", "friction-wheel")
        ]
        for (kind, name, first, second, keys), (a, b) in zip(self.joints, ends, strict=True):
            if kind in ("prismatic", "weld") and any(len(g & together[a]) > 1 for g in geared):
                off = sketch.get(b, 0.0) - sketch.get(a, 0.0) - keys.get("turn", 0.0)
                keys = keys | {"turn": keys.get("turn", 0.0) + TURN * round(off / TURN)}
            yield kind, name, first, second, keys

    def kinds(self):
        """Return the words by which this case is counted."""
        words = [element.kind for element in self.elements]
        for element in self.elements:
            if element.kind == "gear":
                words.append(element.data["word"])
            words += [f"leg {leg['kind']}" for leg in element.data.get("legs", ())]
        return words


def element_data(element):
    """Return what a closure takes: the data, or the element itself where it is tracked."""
    return element if element.kind in SYSTEMS else element.data


JOINTS = {
    "revolute": md.Revolute, "prismatic": md.Prismatic, "slot": md.PinInSlot,
    "distance": md.Distance, "gear": md.Gear, "weld": md.Weld, "rack": md.Rack, "belt": md.Belt,
    "friction-wheel": md.FrictionWheel,
}  # fmt: skip
__all__ = ["DRIVERS", "FOLD", "Case", "Doubtful", "Element", "End"]
