"""Pairs with dry friction under random loads of time, against event-driven closed forms.

    python -m tests.attack.stuck --count 300 --out docs/data/stuck.json

A block on a guide, a wheel against a resistance, a wheel on a pin with friction, or a block on a
table that a law of time shakes: one freedom whose load is a sum of sines, pulses, ramps and square
waves. Between events speed and place are integrals in closed form; events are the roots of these,
isolated on a grid finer than anything in the load. Cases whose truth is not known to 1e-9 itself,
because a load or a speed nearly touches its limit, are drawn again.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared import attack

G = 9.81
FINE = 60
"""Places of the grid in the shortest time of a load."""
TOUCH = 1e-5
"""Share of the limit by which a load or a speed that nearly touches it has to stay away."""
STEEP = 1e-3
"""Least rate of what passes its limit, over its size and the shortest time of the load."""
TIME = 1e-8
ERF = np.vectorize(math.erf)


@dataclass
class Term:
    """A part of a load: its text, value, integral and double integral, shortest time, corners."""

    text: str
    value: Callable[[Any], Any]
    once: Callable[[Any], Any]
    twice: Callable[[Any], Any]
    short: float
    size: float
    corners: list[float] = field(default_factory=list)


def sine(a: float, w: float, p: float) -> Term:
    return Term(
        f"({a!r})*sin({w!r}*t + {p!r})",
        lambda t: a * np.sin(w * t + p),
        lambda t: -a / w * np.cos(w * t + p),
        lambda t: -a / w**2 * np.sin(w * t + p),
        1 / w,
        abs(a),
    )


def pulse(a: float, c: float, d: float) -> Term:
    half = a * d * math.sqrt(math.pi) / 2

    def twice(t: Any) -> Any:
        u = (t - c) / d
        return half * d * (u * ERF(u) + np.exp(-(u**2)) / math.sqrt(math.pi))

    return Term(
        f"({a!r})*exp(-((t - {c!r})/{d!r})**2)",
        lambda t: a * np.exp(-(((t - c) / d) ** 2)),
        lambda t: half * ERF((t - c) / d),
        twice,
        d,
        abs(a),
    )


def ramp(a: float, c: float, d: float) -> Term:
    """From 0 at c to a at c + d, constant beside."""

    def power(t: Any, n: int) -> Any:
        return np.maximum(t - c, 0) ** n - np.maximum(t - c - d, 0) ** n

    return Term(
        f"({a!r})*min(max(t - {c!r}, 0)/{d!r}, 1)",
        lambda t: a / d * power(t, 1),
        lambda t: a / d * power(t, 2) / 2,
        lambda t: a / d * power(t, 3) / 6,
        d,
        abs(a),
        [c, c + d],
    )


def square(a: float, w: float, p: float, end: float) -> Term:
    def parts(t: Any) -> tuple[Any, Any]:
        turns = np.floor((w * t + p) / (2 * math.pi))
        return turns, w * t + p - 2 * math.pi * turns

    def once(t: Any) -> Any:
        rest = parts(t)[1]
        return a / w * np.minimum(rest, 2 * math.pi - rest)

    def twice(t: Any) -> Any:
        turns, rest = parts(t)
        up = rest**2 / 2
        down = math.pi**2 - (2 * math.pi - rest) ** 2 / 2
        return a / w**2 * (turns * math.pi**2 + np.where(rest <= math.pi, up, down))

    first = math.ceil(p / math.pi)
    last = math.floor((w * end + p) / math.pi)
    corners = [(k * math.pi - p) / w for k in range(first, last + 1)]
    return Term(
        f"({a!r})*sign(sin({w!r}*t + {p!r}))",
        lambda t: a * np.sign(math.pi - parts(t)[1]),
        once,
        twice,
        1 / w,
        abs(a),
        [c for c in corners if 0 < c < end],
    )


@dataclass
class Case:
    """One freedom: inertia, load, limits at rest and while it slides, by the side of the motion.

    ``rest`` and ``slide`` are (falling, growing); the path is told by ``read`` from a result.
    """

    kind: str
    inertia: float
    terms: list[Term]
    rest: tuple[float, float]
    slide: tuple[float, float]
    end: float
    data: dict[str, Any]
    joint: str
    word: str

    def load(self, t: Any) -> Any:
        return sum(own.value(t) for own in self.terms)

    def once(self, t: Any) -> Any:
        return sum(own.once(t) for own in self.terms)

    def twice(self, t: Any) -> Any:
        return sum(own.twice(t) for own in self.terms)

    @property
    def short(self) -> float:
        return min(own.short for own in self.terms)

    @property
    def size(self) -> float:
        return sum(own.size for own in self.terms)


class Touches(Exception):
    """A truth that is not known well enough."""


# -- truth ---------------------------------------------------------------------------------------


def root(value: Callable[[Any], Any], low: float, high: float) -> float:
    """Bisection between places of different signs."""
    left = np.sign(value(low))
    while (middle := (low + high) / 2) not in (low, high):
        if np.sign(value(middle)) == left:
            low = middle
        else:
            high = middle
    return high


def first_fall(
    case: Case, value: Callable[[Any], Any], begin: float, end: float, size: float, fresh: bool
) -> float | None:
    """Return where something above zero first falls to zero; ``fresh``: it begins at zero."""
    ticks = np.linspace(begin, end, max(int((end - begin) / case.short * FINE), FINE) + 1)
    near = begin + (ticks[1] - begin) * 2.0 ** -np.arange(1, 6)
    corners = [c + s * 1e-12 * case.end for own in case.terms for c in own.corners for s in (-1, 1)]
    inside = [c for c in corners if begin < c < end]
    ticks = np.unique(np.concatenate([ticks, near, inside]))
    found = value(ticks)
    first = 1 if fresh else 0
    below = np.flatnonzero(found[first:] <= 0)
    stop = first + int(below[0]) if len(below) else len(ticks) - 1
    own = found[first : stop + 1]
    dips = np.flatnonzero((own[1:-1] < own[:-2]) & (own[1:-1] <= own[2:])) + 1 + first
    for k in dips[: len(dips)].tolist():
        low, high = ticks[k - 1], ticks[k + 1]
        for _ in range(60):
            a, b = low + 0.382 * (high - low), low + 0.618 * (high - low)
            low, high = (low, b) if value(a) <= value(b) else (a, high)
        bottom = value((low + high) / 2)
        if abs(bottom) <= TOUCH * size:
            raise Touches
        if bottom < 0:
            return root(value, ticks[k - 1], (low + high) / 2)
    tops = np.flatnonzero((own[1:-1] > own[:-2]) & (own[1:-1] >= own[2:])) + 1 + first
    if not fresh and any(abs(found[k]) <= TOUCH * size for k in tops.tolist()):
        raise Touches
    if not len(below):
        return None
    return root(value, ticks[stop - 1], ticks[stop])


def moving(case: Case, side: int, begin: float, v: float, drag: float) -> Callable[[Any], Any]:
    """Return the speed of what slides since a time, over its sign."""
    once = float(case.once(begin))
    return lambda s: side * (v + (case.once(s) - once + drag * (s - begin)) / case.inertia)


def truth(case: Case) -> tuple[list[tuple[str, float]], float, float]:
    """Return events (kind, time), and place and speed at the end."""
    t, x, v, side = 0.0, 0.0, 0.0, 0
    events: list[tuple[str, float]] = []

    def known(value: Callable[[Any], Any], at: float, size: float) -> None:
        step = 1e-4 * case.short
        rate = abs(value(at + step) - value(at - step)) / (2 * step)
        if rate < STEEP * size / case.short:
            raise Touches

    falling, growing = case.rest
    ways = [lambda s: growing - case.load(s), lambda s: case.load(s) + falling]
    while t < case.end:
        if len(events) > 60:
            raise Touches
        if side == 0:
            behind = t + 1e-13 * case.end
            load = float(case.load(behind))
            limits = [growing - load, load + falling]
            if min(abs(own) for own in limits) <= TOUCH * case.size and events:
                raise Touches
            if min(limits) < 0:
                at = t
            else:
                times = [first_fall(case, own, behind, case.end, case.size, False) for own in ways]
                known_times = [own for own in times if own is not None]
                if not known_times:
                    break
                at = min(known_times)
                jumps = [c for own in case.terms for c in own.corners if abs(c - at) < 1e-9]
                if not jumps:
                    known(ways[times.index(at)], at, case.size)
                at = jumps[0] if jumps else at
            side = 1 if case.load(at + 1e-12 * case.end) > 0 else -1
            t = at
            if at > 0:  # what begins to move at once has no event
                events.append(("slip", t))
            continue
        drag = -case.slide[1] if side > 0 else case.slide[0]
        begin, place = t, x
        speed0, once0, twice0 = v, float(case.once(t)), float(case.twice(t))

        speed = moving(case, side, begin, speed0, drag)
        top = case.size * case.short / case.inertia
        after = first_fall(case, speed, t, case.end, top, True)
        until = case.end if after is None else after
        dt = until - begin
        x = (
            place
            + speed0 * dt
            + (case.twice(until) - twice0 - once0 * dt + drag * dt**2 / 2) / case.inertia
        )
        v = side * float(speed(until))
        t = until
        if after is None:
            break
        known(speed, after, top)
        v = 0.0
        load = float(case.load(after + 1e-13 * case.end))
        if any(abs(c - after) < 1e-7 for own in case.terms for c in own.corners):
            raise Touches
        held = -falling <= load <= growing
        if min(abs(load + falling), abs(load - growing)) <= TOUCH * case.size:
            raise Touches
        side = 0 if held else (1 if load > 0 else -1)
        events.append(("stick" if held else "reversal", after))
    return events, float(x), float(v)


# -- cases ---------------------------------------------------------------------------------------


def terms_of(rng: Any, end: float, smooth: bool = False) -> list[Term]:
    found = [
        sine(float(rng.uniform(0.3, 1.5)), float(10 ** rng.uniform(0, 2)), float(rng.uniform(0, 6)))
        for _ in range(rng.integers(1, 4))
    ]
    if smooth:
        return found
    if rng.random() < 0.6:
        width = end * float(10 ** rng.uniform(-3.5, -1))
        sign = 1 if rng.random() < 0.5 else -1
        found.append(
            pulse(sign * float(rng.uniform(1, 5)), float(rng.uniform(0.1, 0.9)) * end, width)
        )
    if rng.random() < 0.4:
        found.append(
            ramp(float(rng.uniform(-2, 2)), float(rng.uniform(0, 0.6)) * end,
                 float(rng.uniform(0.01, 0.4)) * end)
        )  # fmt: skip
    if rng.random() < 0.3:
        found.append(
            square(float(rng.uniform(0.2, 1.5)), float(10 ** rng.uniform(0, 1.3)),
                   float(rng.uniform(0.1, 3)), end)
        )  # fmt: skip
    return found


def draw(seed: int) -> Case:
    """Return a case whose truth is not known yet."""
    rng = np.random.default_rng(seed)
    kind = ["guide", "resistance", "pin", "table"][seed % 4]
    end = float(rng.uniform(1, 4))
    joints: dict[str, Any] = {}
    ground = {"points": {"O": [0, 0]}}
    task: dict[str, Any] = {"kind": "motion", "until": end, "tolerance": 1e-11}
    data = {"schema": 1, "gravity": [0, -G], "ground": ground, "tasks": {"m": task}}
    terms = terms_of(rng, end, smooth=kind == "table")
    text = " + ".join(own.text for own in terms)
    size = sum(own.size for own in terms)
    top = size * float(rng.uniform(0.15, 0.8))
    ratio = float(rng.uniform(0.5, 1))
    if kind == "guide":
        mass = float(rng.uniform(0.5, 5))
        static = top / (mass * G)
        joints["G"] = {"kind": "prismatic", "between": ["ground.O", "a.P"],
                       "friction": ratio * static, "friction_static": static}  # fmt: skip
        data |= {
            "bodies": {"a": {"points": {"P": [0, 0]}, "mass": mass}},
            "loads": {"F": {"kind": "force", "point": "a.P", "value": [text, 0]}},
        }
        found = mass, (top, top), (ratio * top, ratio * top), "G", "slide"
    elif kind == "resistance":
        inertia = float(rng.uniform(0.05, 2))
        other = top * float(rng.uniform(0.5, 1.5))
        joints["O"] = {"kind": "revolute", "between": ["ground.O", "wheel.O"]}
        data |= {
            "bodies": {"wheel": {"points": {"O": [0, 0]}, "mass": 1.0, "inertia": inertia}},
            "loads": {
                "T": {"kind": "torque", "body": "wheel", "value": text},
                "rub": {"kind": "resistance", "coordinate": "O.angle", "negative": other,
                        "positive": top},
            },
        }  # fmt: skip
        found = inertia, (other, top), (other, top), "O", "angle"
    elif kind == "pin":
        inertia, mass, radius = (float(rng.uniform(0.05, 2)) for _ in range(3))
        ratios = [top * own / (mass * G * radius) for own in (ratio, 1.0)]
        if max(ratios) >= 0.95:
            radius *= max(ratios) / 0.5
            ratios = [top * own / (mass * G * radius) for own in (ratio, 1.0)]
        slide, static = (math.tan(math.asin(own)) for own in ratios)
        joints["O"] = {"kind": "revolute", "between": ["ground.O", "wheel.O"], "friction": slide,
                       "friction_static": static, "pin_radius": radius}  # fmt: skip
        data |= {
            "bodies": {"wheel": {"points": {"O": [0, 0]}, "mass": mass, "inertia": inertia}},
            "loads": {"T": {"kind": "torque", "body": "wheel", "value": text}},
        }
        found = inertia, (top, top), (ratio * top, ratio * top), "O", "angle"
    else:  # the load on a block of 1 kg is the inertia of the shaking
        static = top / G
        joints["T"] = {"kind": "prismatic", "between": ["ground.O", "table.P"]}
        joints["G"] = {"kind": "prismatic", "between": ["table.P", "a.P"],
                       "friction": ratio * static, "friction_static": static}  # fmt: skip
        law = shaken(rng, terms)
        data |= {
            "bodies": {
                "table": {"points": {"P": [0, 0]}},
                "a": {"points": {"P": [0, 0]}, "mass": 1.0},
            }
        }
        task["drivers"] = [{"coordinate": "T.slide", "law": law}]
        found = 1.0, (top, top), (ratio * top, ratio * top), "G", "slide"
    inertia, rest, slide_, joint, word = found
    coordinate = f"{joint}.{word}"
    task |= {"start": {coordinate: 0}, "start_speed": {coordinate: 0}}
    data["joints"] = joints
    return Case(kind, inertia, terms, rest, slide_, end, data, joint, word)


def shaken(rng: Any, terms: list[Term]) -> str:
    """Return the law whose acceleration is minus the sum of sines."""
    parts = []
    for own in terms:
        a, rest = own.text.split("*sin(")
        w = rest.split("*t")[0]
        parts.append(f"{a}/{w}**2*sin({rest}")
    return " + ".join(parts)


def cases(count: int, first: int = 0) -> Any:
    """Yield (seed, case, truth) of cases whose truth is known, and how many were drawn again."""
    seed, found = first, 0
    while found < count:
        case = draw(seed)
        try:
            yield seed, case, truth(case)
            found += 1
        except Touches:
            pass
        seed += 1


def compared(case: Case, true: Any) -> dict[str, Any]:
    """Return how far the package's events and end are from the truth."""
    events, x, v = true
    result = md.solve(from_dict(case.data), "m")
    kinds = ("slip", "stick", "reversal")
    own = [(e["kind"], e["time"]) for e in result.events if e["kind"] in kinds]
    same = [kind for kind, _ in own] == [kind for kind, _ in events]
    gap = max((abs(a[1] - b[1]) for a, b in zip(own, events, strict=False)), default=0.0)
    series = result.joints[case.joint]
    rate = {"slide": "slide_velocity", "angle": "angular_velocity"}[case.word]
    return {
        "same": same and result.fault is None,
        "events": len(events),
        "time": gap if same else None,
        "place": abs(float(series[case.word][-1]) - x),
        "fault": result.fault,
        "steps": result.summary["steps"],
        "size": max(abs(x), 1e-3),
        "rate": rate,
        "speed": v,
    }


def main(arguments: list[str] | None = None) -> int:
    given = attack.parser(__doc__, 300).parse_args(arguments)
    wrong, worst, places, events, kinds, last = [], 0.0, 0.0, 0, {}, given.seed
    for seed, case, true in cases(given.count, given.seed):
        found = compared(case, true)
        events += found["events"]
        kinds[case.kind] = kinds.get(case.kind, 0) + 1
        last = seed
        if not found["same"] or found["time"] > TIME:
            wrong.append(seed)
            print(seed, case.kind, found, file=sys.stderr)
        else:
            worst = max(worst, found["time"])
            places = max(places, found["place"])
    figures = {
        "cases": given.count, "drawn": last - given.seed + 1, "kinds": kinds, "events": events,
        "wrong": wrong, "worst_time": worst, "worst_place": places, "asked_time": TIME,
    }  # fmt: skip
    return attack.ended(figures, given.out, wrong)


if __name__ == "__main__":
    sys.exit(main())
