"""A sweep of the package against the truth: what is wrong, and how exact the rest is.

Every pose marked ok is compared, whatever else is said about the case: positions with the
bound that is reported, rates with what rounding the data by half a unit in the last place
does to them. A pose that is not ok although the mechanism goes there is no fault; it is
counted as refused.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

import mechdae as md

from .case import TURN, Doubtful
from .series import LD, PI
from .tracks import FOLD
from .unclosed import SYSTEMS

EPS = 2.0**-52
SHAKES = 4
ZONE_RATES = {1: 1e-10, 2: 1e-7}
"""Share by which rates may be off next to a change point, where they are interpolated."""
TORN = 2 * EPS
"""Share of a radian within which a pose may be on either side of a switch: its own last bit and
that of the place at which the switch is found."""
OWN = 200 * EPS
"""Share of the largest rate by which rates may be off where rounding the data changes nothing."""
LEFT_OPEN = 8 * EPS
"""Share of the rates, over a group's relative determinant, by which the equations solved for them
may be left open: by a matrix and its inverse in doubles, so that even rates of a pin that is on
a known body are off by the condition number."""
NEAR = 1e-9
"""Share of a radian (or of the length of the mechanism) around a limit that is not judged."""
EXTREMES = (200, 2000, 20000)
"""Places at which swing and stroke are looked at; more where bodies turn unevenly."""
BEND = 1.0
"""Change of a turn over a step from place to place [rad] up to which it tells whole turns."""


@dataclass
class Verdict:
    """What came of one sweep.

    ``error`` is the largest error over its bound, ``rate`` the largest error of a rate over
    what is allowed, ``slack`` the median of bound over error. ``stops`` counts places where the
    package gives the path up as not provable, ``misnamed`` are stops whose reason is not the
    one that is reported.
    """

    faults: list = field(default_factory=list)
    poses: int = 0
    ok: int = 0
    limit: int = 0
    beyond: int = 0
    refused: int = 0
    unsure: int = 0
    stops: int = 0
    misnamed: list = field(default_factory=list)
    error: float = 0.0
    rate: float = 0.0
    slack: float = float("nan")
    why: str = ""


def solve(case, poses=60, **keys):
    """Return the package's sweep of a case."""
    return md.solve(case.mechanism(), swept(case, poses, **keys))


def swept(case, poses=60, **keys):
    """Return the task that sweeps a case."""
    values = keys or {"from_": case.span[0], "to": case.span[1]}
    if not keys and case.assembled:
        values = {"range": "assembled"}
    elif not keys and case.at:
        values = {"at": list(case.at)}
    driver = md.Driver(case.coordinate, speed=case.speed, acceleration=case.acceleration, **values)
    count = None if "at" in values else poses
    return md.Sweep(driver, poses=count, on_change_point=case.crossings)


@np.errstate(all="ignore")
def judge(case, result):
    """Return the `Verdict` on a sweep."""
    verdict = Verdict()
    u = np.asarray(result.drivers[case.coordinate].position)
    low, high = float(u.min()), float(u.max())
    margin = TURN if case.angular else 0.1 * case.scale
    try:
        case.survey(min(low, case.s0) - margin, max(high, case.s0) + margin)
        margin *= case.period()
        case.survey(min(low, case.s0) - margin, max(high, case.s0) + margin)
    except Doubtful as doubt:
        verdict.why = str(doubt)
        return verdict
    Judge(case, result, u, verdict).run()
    return verdict


def unwrapped(angle, rate, h):
    """Return angles at steps h as they turn on: between places by the mean of both rates."""
    ahead = h * (rate[:-1] + rate[1:]) / 2
    rise = np.diff(angle)
    rise += TURN * np.round((ahead - rise) / TURN)
    return angle[0] + np.concatenate([[0.0], np.cumsum(rise)])


class Judge:
    def __init__(self, case, result, u, verdict):
        self.case, self.result, self.u, self.verdict = case, result, u, verdict
        self.status = np.asarray(result.status)
        self.ok = self.status == "ok"
        self.usable = np.isin(self.status, ("ok", "limit"))
        self.low, self.high = float(u.min()), float(u.max())
        self.say = verdict.faults.append
        self.meets = any("meeting" in element.data for element in case.elements)

    def run(self):
        case, verdict = self.case, self.verdict
        self._where()
        self.zone = np.zeros(len(self.u), bool)
        self.meetings = [at for element in case.elements for at in element.crossings]
        places = [e["at"] for e in self.result.events if e["kind"] == "change_point"]
        for place in (*self.meetings, *places):
            self.zone |= np.abs(self.u - float(place)) < 0.02 * case.unit
        self._truth()
        self._statuses()
        self._positions()
        self._angles()
        self._joints()
        for i in np.flatnonzero((self.status == "limit") & ~self.unknown):
            self._at_limit(i)
        self._events()
        self._bounds()
        self._extremes()
        verdict.poses = len(self.u)
        verdict.ok = int(self.ok.sum())
        verdict.limit = int((self.status == "limit").sum())
        if self.ok.any():
            tiny = EPS / 4 * case.size
            ratio = self.result.bound.length[self.ok] / np.maximum(self.worst[self.ok], tiny)
            verdict.slack = float(np.median(ratio))

    # -- where each element can be -----------------------------------------------------------

    def _where(self):
        """Set for each element at which poses it can be (inside), and where that is unsure."""
        case, u = self.case, self.u
        near = NEAR * max(case.unit, abs(self.low), abs(self.high))
        self.inside, self.edge = {}, {}
        unknown = np.zeros(len(u), bool)
        for k, element in enumerate(case.elements):
            a, b = element.reach
            first, last = float(a.at), float(b.at)
            inside = (u > first) & (u < last)
            edge = np.zeros(len(u), bool)
            for end in (a, b):
                if np.isfinite(end.at):
                    width = {"pole": 0.05 * case.unit, "change_point": 1e-6 * case.unit}
                    edge |= np.abs(u - float(end.at)) < width.get(end.kind, near)
                if end.kind == "doubtful":
                    unknown |= (u > last - near) if end is b else (u < first + near)
            # the same pose, reached by turning the other way round, perhaps more than once
            around = [n for n in range(-4, 5) if n and case.periodic(k, n)]
            for turns in around:
                moved = u + turns * TURN
                edge |= (moved > first - near) & (moved < last + near) & ~inside
            if around and "doubtful" in (a.kind, b.kind):  # it may get there behind that end
                unknown |= ~inside
            self.inside[k], self.edge[k] = inside, edge
        self.ok, self.usable = self.ok & ~unknown, self.usable & ~unknown
        for k in self.edge:
            self.edge[k] |= unknown
        self.unknown = unknown
        self.sure = np.all([self.inside[k] & ~self.edge[k] for k in self.inside], axis=0)
        self.lost = np.any([~self.inside[k] & ~self.edge[k] for k in self.inside], axis=0)
        within, about = self._on_one_way()
        self.sure |= within & ~unknown
        self.lost |= ~about & ~unknown

    def _on_one_way(self):
        """Return at which poses the whole mechanism surely can be, and at which perhaps, (n,).

        All elements are continued from the sketch on one and the same way of the driver, which
        may turn the other way round where a whole turn leads every one of them back. Sets the
        place on that way at which each pose lies: only there the truth is that of the motion,
        because a platform may come back on another of its branches.
        """
        case, u = self.case, self.u
        near = NEAR * max(case.unit, abs(self.low), abs(self.high))
        widths = {"pole": 0.05 * case.unit, "change_point": 1e-6 * case.unit}
        ends = case.whole()
        first, last = (float(end.at) for end in ends)
        before, behind = (widths.get(end.kind, near) for end in ends)
        within, about = np.zeros(len(u), bool), np.zeros(len(u), bool)
        stopped = any(end.kind not in ("limit", "pole", "open") for end in ends)
        stopped |= any(e["kind"] not in ("limit", "pole") for e in self.result.events)
        self.place = np.asarray(u, LD)
        for turns in sorted(range(-4, 5), key=abs):
            if turns and not all(case.periodic(k, turns) for k in range(len(case.elements))):
                continue
            moved = u + turns * TURN
            perhaps = (moved > first - before) & (moved < last + behind)
            self.place = np.where(perhaps & ~about, self.place + turns * 2 * PI, self.place)
            about |= perhaps
            if not turns or not stopped:
                seen = (moved > case.surveyed[0]) & (moved < case.surveyed[1])
                within |= seen & (moved > first + before) & (moved < last - behind)
        return within, about

    def _statuses(self):
        refused = self.sure & ~self.usable
        self.verdict.refused = int(refused.sum())
        self.verdict.beyond = int(self.lost.sum())
        self.verdict.unsure = int((~self.sure & ~self.lost).sum())
        claimed = self.lost & self.usable
        if claimed.any():
            first = self.u[claimed][0]
            self.say(
                f"{int(claimed.sum())} poses where it cannot be {set(self.status[claimed])}, "
                f"first at {first!r}"
            )

    # -- truth and what rounding does to it --------------------------------------------------

    def _quantities(self, case, u):
        """Return {key: (value, first, second derivative)} of everything reported."""
        world = case.close(u, 2, rates=(case.speed, case.acceleration))
        table = {}
        for body in case.bodies:
            direction = world.direction(body)
            table["angle", body] = direction.argument().derivatives
            for name in case.local[body]:
                table["point", f"{body}.{name}"] = world.place((body, name)).derivatives
        for kind, name, first, second, keys in case.joints:
            if kind in ("prismatic", "slot"):
                one, two = first.split("."), second.split(".")
                axis = world.direction(one[0]) * world.turned(keys["axis"])
                gap = world.place(two) - world.place(one)
                slide = (gap * axis.conjugate()).real.derivatives
                turn = world.direction(one[0]).argument().derivatives[1]
                table["slide", name] = slide
                table["coriolis", name] = (2j * turn * slide[1] * axis.c[0], 0 * turn, 0 * turn)
        return table

    def _truth(self):
        u = self._torn()
        self._loss()
        self.spread = self._shaken(u, meeting=False)
        if self.meets:
            # where branches meet with the numbers given, all others have two branches apart or
            # none: what such others do next to a change point says nothing about these
            for key, kept in self._shaken(u, meeting=True).items():
                self.spread[key] = np.where(self.zone, kept, self.spread[key])
        self.top = {
            (kind, order): np.fmax.reduce(
                [np.abs(v[order]).astype(float) for k, v in self.true.items() if k[0] == kind],
                axis=0,
                initial=0,
            )
            for kind in ("point", "angle", "slide")
            for order in range(3)
            if any(k[0] == kind for k in self.true)
        }
        # Second rates are quadratic in the first. In a pure translation all of them vanish but
        # for the squares of the turning that rounding leaves: velocities over a length.
        self.turning = self.top["point", 1] / self.case.scale + self.top["angle", 1]

    def _shaken(self, u, meeting):
        """Return {(key, order): largest change} when data are rounded otherwise."""
        case, rng, spread = self.case, np.random.default_rng(1), {}
        size = LD(EPS / 2) * np.maximum(np.abs(u), 1 if case.angular else case.size)
        for _ in range(SHAKES):
            other = case.shaken(rng, meeting, np.max(np.abs(u)) if case.angular else 0.0)
            shaken = self._quantities(other, u + size * rng.uniform(-1, 1, len(u)))
            for key, values in self.true.items():
                for order in range(3):
                    d = np.abs(shaken[key][order] - values[order])
                    if key[0] == "angle" and not order:
                        d = np.abs(np.exp(1j * shaken[key][0]) - np.exp(1j * values[0]))
                    known = spread.get((key, order), 0)
                    spread[key, order] = np.fmax(known, d.astype(float))
        return spread

    def _loss(self):
        """Set for each element 1 / its least relative determinant, and those it stands on, (n,)."""
        self.loss = []
        discs = self.case.close(self.place).discs
        for element, disc in zip(self.case.elements, discs, strict=True):
            own = 1.0 if disc is None else 1 / np.sqrt(disc.c[0].real.astype(float))
            self.loss.append(
                np.fmax.reduce([own + 0 * self.u, *(self.loss[k] for k in element.uses)])
            )

    def _torn(self):
        """Set the truth; return driver values none of which lies on a switch.

        At a switch the pose is one and the rates are two. Those of one side must be right
        where the driver's value is the switch up to rounding, and all of the same side.
        """
        case, u = self.case, self.place
        self.true = self._quantities(case, u)
        torn = np.zeros(len(u), bool)
        sides = [u.copy(), u.copy()]
        for place in self.meetings if case.crossings == "switch" else ():
            off = 4 * TORN * max(1.0, abs(float(place)))
            here = np.abs(u - place) <= off / 4
            torn |= here
            for side, sign in zip(sides, (-1, 1), strict=True):
                side[here] = place + sign * off
        if not torn.any():
            return u
        tables = [self._quantities(case, side) for side in sides]
        errors = [self._missed(table) for table in tables]
        second = torn & (errors[1] < errors[0])
        for key, values in self.true.items():
            for order in range(key[0] != "coriolis", 3):
                for rows, table in ((torn & ~second, tables[0]), (second, tables[1])):
                    values[order][rows] = table[key][order][rows]
        return np.where(second, sides[1], np.where(torn, sides[0], u))

    def _missed(self, table):
        """Return by how much the velocities of all points miss those of a table, (n,)."""
        total = np.zeros(len(self.u))
        for (kind, part), values in table.items():
            if kind == "point":
                ours = self.result.points[part].velocity
                ours = ours[:, 0].astype(LD) + 1j * ours[:, 1].astype(LD)
                total = np.fmax(total, np.abs(ours - values[1]).astype(float))
        return total

    def _compare(self, what, key, error, bound):
        """Errors of positions at ok poses, against their bound."""
        size = np.abs(self.true[key][0]).astype(float)
        slack = 2.0**-8 * self.spread[key, 0] + 2.0**-62 * np.maximum(size, 2 * np.abs(self.u))
        if self.meets:  # in closed form, as exact as all else
            slack = 2.0**-58 * np.maximum(size, np.abs(self.u))
        ratio = np.where(self.ok, error / (bound + slack), 0)
        ratio = np.where(np.isnan(ratio), np.inf, ratio)
        i = int(np.argmax(ratio))
        self.verdict.error = max(self.verdict.error, float(ratio[i]))
        if ratio[i] > 1:
            self.say(f"{what} off by {error[i]:.3g}, bound {bound[i]:.3g} at {self.u[i]!r}")

    def _rates(self, what, key, bodies, names, series, allowed_size):
        """Errors of first and second rates of something on `bodies`."""
        loss = np.fmax.reduce([self.loss[self.case.maker[b]] for b in bodies if b != "ground"])
        for order, name in zip((1, 2), names, strict=True):
            rate = series[name]
            if rate.ndim == 2:
                rate = rate[:, 0].astype(LD) + 1j * rate[:, 1].astype(LD)
            error = np.abs(rate - self.true[key][order]).astype(float)
            share = OWN + LEFT_OPEN * loss
            allowed = 30 * self.spread[key, order] + share * allowed_size[order]
            if order == 2:
                allowed = allowed + OWN**2 * allowed_size["squares"]
            allowed = allowed + self.zone * ZONE_RATES[order] * allowed_size[order]
            ratio = np.where(self.ok, error / allowed, 0)
            ratio = np.where(np.isnan(ratio) & self.ok & (error != 0), np.inf, ratio)
            ratio = np.nan_to_num(ratio, nan=0.0, posinf=np.inf)
            i = int(np.argmax(ratio))
            self.verdict.rate = max(self.verdict.rate, float(ratio[i]))
            if ratio[i] > 1:
                self.say(
                    f"{name} of {what} off by {error[i]:.3g}, allowed {allowed[i]:.3g} "
                    f"at {self.u[i]!r}"
                )

    def _positions(self):
        case, result = self.case, self.result
        self.worst = np.zeros(len(self.u))
        for (kind, part), values in self.true.items():
            if kind != "point":
                continue
            ours = result.points[part].position
            ours = ours[:, 0].astype(LD) + 1j * ours[:, 1].astype(LD)
            k = case.maker[part.split(".")[0]]
            error = np.abs(ours - values[0]).astype(float)
            self.worst = np.fmax(self.worst, np.where(self.ok, error, 0))
            self._compare(part, (kind, part), error, result.bound.length)
            partial = ~self.usable & np.isfinite(ours.real) & (self.status != "ambiguous")
            allowed = 1e-8 * case.size + 1e3 * self.spread[(kind, part), 0]
            bad = partial & self.inside[k] & ~self.edge[k] & ~(error <= allowed)
            if bad.any():
                self.say(
                    f"{part} of a partial pose off by {np.fmax.reduce(error[bad]):.3g} "
                    f"at {self.u[bad][0]!r}"
                )
            claimed = np.isfinite(ours.real) & ~self.inside[k] & ~self.edge[k]
            claimed &= (self.status != "limit") & (self.status != "ambiguous")
            if claimed.any():
                self.say(f"{part} has values beyond its limit at {self.u[claimed][0]!r}")
            sizes = {order: self.top["point", order] for order in (1, 2)}
            sizes["squares"] = self.turning**2 * case.scale
            bodies, names = (part.split(".")[0],), ("velocity", "acceleration")
            self._rates(part, (kind, part), bodies, names, result.points[part], sizes)

    def _angles(self):
        case, result = self.case, self.result
        sizes = {
            order: self.top["angle", order] + self.top["point", order] / case.scale
            for order in (1, 2)
        }
        sizes["squares"] = self.turning**2
        for (kind, body), values in self.true.items():
            if kind != "angle":
                continue
            series = result.bodies[body]
            turned = series.angle.astype(LD) - values[0].real
            error = np.abs(turned - 2 * PI * np.round(turned / (2 * PI))).astype(float)
            self._compare(f"angle {body}", (kind, body), error, result.bound.angle)
            names = ("angular_velocity", "angular_acceleration")
            self._rates(f"angle {body}", (kind, body), (body,), names, series, sizes)

    def _joints(self):
        """Slides with their rates, and the Coriolis acceleration."""
        case, result = self.case, self.result
        sizes = {
            order: self.top["point", order] + case.scale * self.top["angle", order]
            for order in (1, 2)
        }
        sizes["squares"] = self.turning**2 * case.scale
        ends = {name: (a.split(".")[0], b.split(".")[0]) for _, name, a, b, _ in case.joints}
        for (kind, name), values in self.true.items():
            if kind != "slide":
                continue
            series = result.joints[name]
            error = np.abs(series.slide - values[0].real).astype(float)
            self._compare(f"slide {name}", (kind, name), error, result.bound.length)
            names = ("slide_velocity", "slide_acceleration")
            self._rates(f"slide {name}", (kind, name), ends[name], names, series, sizes)
            key = ("coriolis", name)
            ours = series.coriolis[:, 0].astype(LD) + 1j * series.coriolis[:, 1].astype(LD)
            error = np.abs(ours - self.true[key][0]).astype(float)
            size = sizes[1] * self.top["angle", 1]
            allowed = 30 * self.spread[key, 0] + OWN * size + OWN**2 * sizes["squares"]
            allowed = allowed + self.zone * 4 * ZONE_RATES[1] * size  # 2 w v, both interpolated
            bad = self.ok & (error > allowed)
            if bad.any():
                i = int(np.flatnonzero(bad)[0])
                self.say(f"coriolis of {name} off by {error[i]:.3g} at {self.u[i]!r}")

    # -- limits and events -------------------------------------------------------------------

    def _ends(self):
        """Return (end, element) for each end that an element of its own has."""
        return [
            (end, k)
            for k, element in enumerate(self.case.elements)
            for end in element.reach
            if np.isfinite(end.at) and end.owner == k
        ]

    def _at_limit(self, i):
        """Check a pose at a limit position against the element at rest on its fold."""
        case, s = self.case, self.u[i]
        ends = [(end, k) for end, k in self._ends() if end.kind == "limit"]
        if not ends:
            self.say(f"limit at {s!r}, where there is none")
            return
        end, k = min(ends, key=lambda pair: abs(float(pair[0].at) - s))
        bounds = case.whole()
        if all(case.periodic(j) for j in range(len(case.elements))) and end not in bounds:
            turned = [(s - float(bound.at), bound) for bound in bounds if bound.kind == "limit"]
            for off, bound in turned:  # reached by turning the other way round
                if abs(off - TURN * np.round(off / TURN)) < 1e-9:
                    end, k = bound, bound.owner
                    s = s - TURN * np.round(off / TURN)
        if abs(float(end.at) - s) > 1e-12 * max(case.unit, abs(s)) + 30 * self._shift(k, end):
            self.say(f"limit at {s!r}, the nearest is at {float(end.at)!r}")
            return
        signs = [element.sign for element in case.elements]
        signs[k] = FOLD if case.elements[k].kind in SYSTEMS else 0
        world = case.close(np.array([end.at]), signs=signs)
        for part in [key[1] for key in self.true if key[0] == "point"]:
            ours = complex(*self.result.points[part].position[i])
            error = abs(ours - complex(world.place(part.split(".")).c[0][0]))
            if np.isfinite(ours) and not error <= self.result.bound.length[i]:
                self.say(
                    f"{part} at the limit off by {error:.3g}, "
                    f"bound {self.result.bound.length[i]:.3g} at {s!r}"
                )

    def _shift(self, k, end):
        """Return how far rounding the data moves a limit."""
        case = self.case
        sense = 1 if end is case.elements[k].reach[1] else -1
        delta = LD(1e-7 * case.unit)
        places = np.array([end.at - sense * delta, end.at - sense * 2 * delta], LD)
        disc = case.close(places, upto=k + 1).discs[k].c[0].real
        slope = abs(disc[1] - disc[0]) / delta
        rng, shift = np.random.default_rng(2), 0.0
        for _ in range(4):
            moved = case.shaken(rng).close(places[:1], upto=k + 1).discs[k].c[0].real
            shift = np.fmax(shift, float(abs(moved[0] - disc[0]) / slope))
        return shift if np.isfinite(shift) else 0.0

    def _events(self):
        case = self.case
        near = {"pole": 0.05 * case.unit, "change_point": 1e-6 * case.unit}
        ours, true = {}, {}
        nearly = [e["at"] for e in self.result.events if e.get("exact") is False]
        for end, k in self._ends():
            true.setdefault(end.kind, []).append((float(end.at), k, end))
        self.stops = []
        near_misses = [e["at"] for e in self.result.events if e.get("exact") is False]
        for event in self.result.events:
            kind, at = event["kind"], event["at"]
            if event.get("ambiguous"):  # whether the motion gets there is left open
                if not any((at - gap) * (gap - case.s0) > 0 for gap in near_misses):
                    self.say(f"{kind} at {at!r} left open without a reason")
                continue
            ours.setdefault(kind, []).append(at)
            known = [place for place, _, _ in true.get(kind, [])]
            if kind == "change_point":
                known += [float(place) for place in self.meetings]
            if kind == "limit" or self._dark(at):
                continue
            if any(abs(at - place) < near.get(kind, 0) for place in known):
                if kind != "change_point" or not self.meetings:
                    self.stops.append(at)
                continue
            self.stops.append(at)
            if kind in ("unproved", "ambiguous") or event.get("exact") is False:
                self.verdict.stops += 1
            elif kind == "change_point" and event.get("exact"):
                self.say(f"exact change point at {at!r}, where branches do not meet")
            elif kind != "pole" or not self._runs_away([at]):
                self.verdict.misnamed.append(f"{kind} at {at!r}, where there is none")
        unit = max(case.unit, abs(self.low), abs(self.high))
        for element in case.elements:
            for at in element.crossings:
                if not self.low < at < self.high or not self._reached(float(at)):
                    continue
                gap = min(
                    (abs(float(at) - e) for e in ours.get("change_point", [])), default=np.inf
                )
                if gap > 1e-12 * unit:
                    self.say(f"change point {float(at)!r} off by {gap:.3g}")
        limits = true.get("limit", [])
        for at, k, end in limits:
            if not self.low <= at <= self.high or not self._reached(at):
                continue
            gap = min((abs(at - e) for e in ours.get("limit", [])), default=np.inf)
            if self._off(gap, unit, k, end):
                kind = case.elements[k].kind
                self.say(f"limit {at!r} of {kind} {k} off by {gap:.3g} ({ours.get('limit', [])})")
        for at in ours.get("limit", []):
            if self._dark(at) or any(min(case.s0, at) <= s <= max(case.s0, at) for s in nearly):
                continue  # behind branches that nearly cross all is ambiguous
            if not limits:
                self.say(f"limit at {at!r}, where there is none")
                continue
            place, k, end = min(limits, key=lambda row: abs(at - row[0]))
            if self._off(abs(at - place), unit, k, end):
                self.say(f"limit at {at!r}, where there is none; the nearest is {place!r}")

    def _bounds(self):
        """The limits of the driver are those of the whole mechanism, and so is what is reached."""
        case, summary = self.case, self.result.summary
        unit = max(case.unit, abs(self.low), abs(self.high))
        if self.stops or any(end.kind == "doubtful" for e in case.elements for end in e.reach):
            return
        ends = case.whole()
        slack = 1e-9 * unit
        for event in self.result.events:
            within = float(ends[0].at) - slack <= event["at"] <= float(ends[1].at) + slack
            outside = not float(ends[0].at) + slack < event["at"] < float(ends[1].at) - slack
            if not (within if event.get("reached", True) else outside):
                self.say(f"{event['kind']} at {event['at']!r} reached: {not within}")
        for ours, end in zip(summary.get("limits", ()), ends, strict=False):
            if ours is None or end.kind not in ("limit", "open"):
                continue
            if not case.surveyed[0] < ours < case.surveyed[1]:
                continue
            if end.kind == "open" or self._off(abs(ours - float(end.at)), unit, end.owner, end):
                self.say(f"limit of the driver {ours!r}, the truth has {float(end.at)!r}")

    def _off(self, gap, unit, k, end):
        """Return whether a limit is missed by more than rounding its data explains."""
        return gap > 1e-12 * unit and gap > 1e-12 * unit + 30 * self._shift(k, end)

    def _dark(self, at):
        """Return whether nothing is known there: not surveyed, or behind a doubtful end."""
        low, high = self.case.surveyed
        for element in self.case.elements:
            first, last = element.reach
            if first.kind == "doubtful":
                low = max(low, float(first.at) + 1e-6 * self.case.unit)
            if last.kind == "doubtful":
                high = min(high, float(last.at) - 1e-6 * self.case.unit)
        return not low <= at <= high

    def _reached(self, at):
        """Return whether the motion does not stop between the sketch and a place."""
        s0 = self.case.s0
        width = 1e-6 * self.case.unit
        return not any(min(s0, at) - width <= stop <= max(s0, at) + width for stop in self.stops)

    def _runs_away(self, places):
        """Return whether something is far away next to all of these places."""
        case = self.case
        places = np.asarray(places, float)
        for shift in (-3e-2, -1e-2, -1e-3, 0, 1e-3, 1e-2, 3e-2):
            table = self._quantities(case, places + shift * case.unit)
            far = np.fmax.reduce(
                [np.abs(v[0]).astype(float) for k, v in table.items() if k[0] != "angle"]
            )
            if np.all(far > max(30 * case.scale, 3 * case.size)):
                return True
        return False

    def _reached_span(self):
        """Return the part of the sweep that the whole mechanism reaches, None where unsure."""
        case = self.case
        first, last = (end.at for end in case.whole())
        low, high = max(LD(self.low), first), min(LD(self.high), last)
        inside = (self.u >= low) & (self.u <= high)
        kinds = [end.kind for end in case.whole()]
        plain = np.isin(self.status, ("ok", "limit", "unassembled")).all()
        if self.stops or low >= high or not plain or self.unknown.any():
            return None
        if not np.array_equal(inside, self.usable):
            return None
        if any(kind not in ("limit", "open") for kind in kinds):
            return None
        return low, high

    def _extremes(self):
        """Swing and stroke contain all that the poses show, and no more than the truth does."""
        case, summary = self.case, self.result.summary
        tables = {"swing": ("angle", "bodies"), "stroke": ("slide", "joints")}
        span = self._reached_span()
        if span is None or len(self.u) < 3:
            return
        for count in EXTREMES:
            # more of them towards the ends, where rates grow like one over a root
            fine = (span[0] + span[1]) / 2 - (span[1] - span[0]) / 2 * np.cos(
                PI * np.arange(count) / (count - 1)
            )
            true = self._quantities(case, np.clip(fine, *span))
            steps = np.diff(fine).astype(float)
            rates = [v[1].real.astype(float) for key, v in true.items() if key[0] == "angle"]
            bends = [np.abs(np.diff(rate[1:-1])) * steps[1:-1] / abs(case.speed) for rate in rates]
            if np.fmax.reduce(bends, axis=None) < BEND:
                break
        else:
            return
        for word, (kind, _) in tables.items():
            for part, ours in summary.get(word, {}).items():
                if (kind, part) not in true:
                    continue
                value = true[kind, part][0].real.astype(float)
                rate = true[kind, part][1].real.astype(float) / case.speed
                if kind == "angle":
                    value = np.concatenate(
                        [value[:1], unwrapped(value[1:-1], rate[1:-1], steps[1:-1]), value[-1:]]
                    )
                    value[[0, -1]] -= TURN * np.round((value[[0, -1]] - value[[1, -2]]) / TURN)
                if not np.all(np.isfinite(value)):
                    continue
                seen = float(value.max() - value.min())
                curve = float(np.max(np.abs(np.diff(rate[1:-1])) * steps[1:-1]))
                curve += float(np.max(np.abs(np.diff(value))[[0, -1]]))
                tiny = 1e-9 * max(seen, case.scale if kind == "slide" else 1.0)
                if not -tiny <= ours - seen <= 2 * curve + tiny:
                    self.say(f"{word} of {part} is {ours!r}, poses of the truth show {seen!r}")
