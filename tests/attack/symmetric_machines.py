"""Random symmetric machines whose pairs let go and stop together, against a solver of their own.

    python -m tests.attack.symmetric_machines --count 300 --out docs/data/symmetric-machines.json

Two or more equal blocks, stacks, wedges or jaws on rough rails, side by side or mirrored, alone or
coupled by springs and links, on a belt, or in space; all loads alike, some apart by 1e-6 to 1e-13
of their size. Which pair slips or sticks when, all that do so in one instant, and where the machine
is in the end is compared with `tests/reference/complementarity.py`. Draws whose truth is on an edge
are drawn again.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.reference.complementarity import Course, Follower, Load, Machine, Slip, Undecided
from tests.shared import attack

END = 4.0
TIME, PLACE = 1e-7, 1e-7
"""Allowed for times, over the whole, and for places at the end, over what moves."""
NEAR = 1e-6
"""Share of the whole time within which events of pairs that are nearly alike are one."""


class Drawn:
    """A machine as it is drawn: as matrices, and as a mechanism."""

    def __init__(self, g: float) -> None:
        self.g = g
        self.mass: list[float] = []
        self.rows: list[Any] = []
        self.slips: list[tuple[str, Any, float, float, int | None, float, float]] = []
        self.springs: list[tuple[int, int | None, float, Any]] = []
        self.loads: list[tuple[int, Any, Any]] = []
        self.places: list[Any] = []
        self.axes: list[Any] = []
        """Of a machine in space: a place and the direction of each rail."""
        self.data: dict[str, Any] = {
            "schema": 1, "gravity": [0, -g], "ground": {"points": {}}, "bodies": {}, "joints": {},
            "loads": {},
        }  # fmt: skip

    def body(self, mass: float, place: Any) -> int:
        name = f"b{len(self.mass)}"
        self.mass.append(mass)
        self.places.append(np.array(place, float))
        self.data["bodies"][name] = {"points": {"P": [0, 0]}, "mass": mass}
        return len(self.mass) - 1

    def _row(self, first: int | None, second: int, e: Any) -> list[tuple[int, Any]]:
        return [(second, np.array(e))] + ([] if first is None else [(first, -np.array(e))])

    def ground(self, place: Any) -> str:
        name = f"G{len(self.data['ground']['points'])}"
        self.data["ground"]["points"][name] = [float(own) for own in place]
        return f"ground.{name}"

    def rail(
        self, first: int | None, second: int, angle: float, mu: float, static: float | None = None,
        belt: tuple[str, float] | None = None,
    ) -> str:  # fmt: skip
        """A rough guide of `second` on `first`, on the ground or on a belt."""
        e, normal = [np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]
        self.rows.append(self._row(first, second, normal))
        name = f"j{len(self.data['joints'])}"
        on = f"b{first}.P" if first is not None else None
        on = belt[0] if belt else on or self.ground(self.places[second])
        keys = {"kind": "prismatic", "between": [on, f"b{second}.P"], "axis": float(angle)}
        keys |= {"friction": mu} if mu else {}
        keys |= {"friction_static": static} if static else {}
        self.data["joints"][name] = keys
        if mu:
            own = (name, self._row(first, second, e), mu, static or mu, len(self.rows) - 1, 0.0)
            self.slips.append((*own, belt[1] if belt else 0.0))
        return name

    def brake(self, joint: str, size: float) -> None:
        """A resistance along a smooth guide of a body on the ground."""
        i = list(self.data["joints"]).index(joint)
        second = int(self.data["joints"][joint]["between"][1][1:].split(".")[0])
        angle = self.data["joints"][joint]["axis"]
        name = f"r{i}"
        self.data["loads"][name] = {
            "kind": "resistance", "coordinate": f"{joint}.slide", "negative": size, "positive": size
        }  # fmt: skip
        row = self._row(None, second, [np.cos(angle), np.sin(angle)])
        self.slips.append((name, row, 1.0, 1.0, None, size, 0.0))

    def link(self, first: int, second: int) -> None:
        """A rod between two bodies on one line."""
        gap = self.places[second] - self.places[first]
        length = float(np.linalg.norm(gap))
        self.rows.append(self._row(first, second, gap / length))
        self.data["joints"][f"j{len(self.data['joints'])}"] = {
            "kind": "distance", "between": [f"b{first}.P", f"b{second}.P"], "length": length
        }  # fmt: skip

    def spring(self, first: int | None, second: int, k: float, anchor: Any = None) -> None:
        """A spring without length of its own: it pulls with k times the way between its ends."""
        on = f"b{first}.P" if first is not None else self.ground(anchor)
        self.data["loads"][f"s{len(self.data['loads'])}"] = {
            "kind": "spring", "between": [on, f"b{second}.P"], "stiffness": k, "free_length": 0
        }  # fmt: skip
        self.springs.append((second, first, k, anchor))

    def pull(self, body: int, e: Any, terms: Any) -> None:
        """A force a + b t + c sin(w t + p) along a direction."""
        a, b, c, w, p = (float(own) for own in terms)
        text = f"({a!r}) + ({b!r})*t + ({c!r})*sin(({w!r})*t + ({p!r}))"
        value = [f"({float(own)!r})*({text})" for own in e]
        self.data["loads"][f"p{len(self.data['loads'])}"] = {
            "kind": "force", "point": f"b{body}.P", "value": value
        }  # fmt: skip
        self.loads.append((body, np.array(e, float), (a, b, c, w, p)))

    # -- both ----------------------------------------------------------------------------------

    def machine(self) -> Machine:
        n = 2 * len(self.mass)

        def stacked(parts: Any) -> Any:
            row = np.zeros(n)
            for body, e in parts:
                row[2 * body : 2 * body + 2] += e
            return row

        K, steady = np.zeros((n, n)), np.zeros(n)
        steady[1::2] = -self.g * np.array(self.mass)
        for second, first, k, anchor in self.springs:
            for axis in range(2):
                j = 2 * second + axis
                K[j, j] += k
                if first is None:
                    steady[j] += k * anchor[axis]
                    continue
                i = 2 * first + axis
                K[i, i] += k
                K[i, j] -= k
                K[j, i] -= k
        G = np.array([stacked(row) for row in self.rows]).reshape(-1, n)
        slips = [Slip(name, stacked(row), mu, static, j, size, speed)
                 for name, row, mu, static, j, size, speed in self.slips]  # fmt: skip
        loads = [Load(stacked([(body, e)]), *terms) for body, e, terms in self.loads]
        return Machine(np.repeat(self.mass, 2), G, K, np.zeros((n, n)), slips, loads, steady,
                       np.concatenate(self.places), np.zeros(n), END)  # fmt: skip

    def problem(self) -> Any:
        sketch = {
            f"b{i}.P.{axis}": float(own)
            for i, place in enumerate(self.places)
            for axis, own in zip("xy", place, strict=True)
        }
        task = {"kind": "motion", "until": END, "at": [END], "tolerance": 1e-11}
        drivers = self.data.get("drivers")
        task |= {"drivers": drivers} if drivers else {}
        data = {key: own for key, own in self.data.items() if key != "drivers"}
        return from_dict({"sketch": sketch} | data | {"tasks": {"go": task}})

    def places_of(self, result: Any) -> Any:
        """Return the places of the bodies at the end of a motion, as the matrices have them."""
        found = [result.points[f"b{i}.P"].position[-1] for i in range(len(self.mass))]
        for i, (place, e) in enumerate(self.axes):
            found[i] = self.places[i] + np.array([e @ (found[i] - place), 0.0])
        return np.concatenate(found)


def terms_of(rng: Any, size: float) -> tuple[float, ...]:
    """Return a load that reaches beyond what friction of a size holds."""
    if rng.random() < 0.4:
        return (size * rng.uniform(-0.5, 0.5), size * rng.uniform(0.5, 1.5), 0.0, 1.0, 0.0)
    c = size * rng.uniform(1.2, 3.0)
    return (0.0, 0.0, c, rng.uniform(0.8, 4.0), rng.choice([0.0, rng.uniform(0, 6.28)]))


def near(rng: Any) -> float:
    """Return 1, or a number beside it."""
    return 1.0 if rng.random() < 0.6 else 1.0 + 10.0 ** rng.uniform(-13, -6)


def coefficients(rng: Any, most: float = 0.6) -> tuple[float, float | None]:
    mu = float(rng.uniform(0.1, most))
    return mu, None if rng.random() < 0.5 else mu * float(rng.uniform(1.0, 1.6))


def blocks(rng: Any, g: float) -> Drawn:
    """Equal blocks on rails side by side or mirrored, perhaps coupled, on the ground."""
    made, count = Drawn(g), int(rng.choice([2, 2, 3, 4]))
    mass, (mu, static) = rng.uniform(0.5, 5), coefficients(rng)
    tilt, mirrored = rng.uniform(-0.15, 0.15), bool(rng.random() < 0.5) and count == 2
    terms, k, own = terms_of(rng, mu * mass * g), rng.uniform(1, 40), rng.random() < 0.5
    for i in range(count):
        angle = np.pi - tilt if mirrored and i else tilt
        e = np.array([np.cos(angle), np.sin(angle)])
        place = 3.0 * e if mirrored else np.array([0.0, 1.5 * i])
        body = made.body(mass, place)
        made.rail(None, body, angle, mu, static)
        made.pull(body, e, scaled(terms, near(rng)))
        if own:
            made.spring(None, body, k, place - 0.7 * e)
    if rng.random() < 0.5:
        for i in range(count - 1):
            made.spring(i, i + 1, rng.uniform(0.05, 0.3) * k)
    return made


def scaled(terms: Any, factor: float) -> tuple[float, ...]:
    a, b, c, w, p = terms
    return (a * factor, b * factor, c * factor, w, p)


def stacks(rng: Any, g: float) -> Drawn:
    """Equal stacks of two blocks, the lower or the upper ones pulled."""
    made, count = Drawn(g), int(rng.choice([2, 3]))
    masses, low, high = rng.uniform(0.5, 4, 2), coefficients(rng), coefficients(rng)
    upper = int(rng.random() < 0.4)
    size = high[0] * masses[1] * g if upper else low[0] * masses.sum() * g
    terms = terms_of(rng, size)
    for i in range(count):
        one, two = (made.body(masses[j], [0.3 * j, 2.0 * i]) for j in range(2))
        made.rail(None, one, 0.0, *low)
        made.rail(one, two, 0.0, *high)
        made.pull(two if upper else one, [1.0, 0.0], scaled(terms, near(rng)))
    return made


def wedges(rng: Any, g: float) -> Drawn:
    """Equal wedges under equal blocks at walls, mirrored or side by side, perhaps coupled."""
    made, count, mirrored = Drawn(g), 2, bool(rng.random() < 0.5)
    m, M, mu = rng.uniform(1, 6), rng.uniform(20, 200), float(rng.uniform(0.05, 0.25))
    angle = rng.uniform(0.1, 0.3)
    up = M * g * np.tan(angle + np.arctan(mu)) + mu * M * g
    terms = (up * rng.uniform(0, 0.5), up * rng.uniform(0.2, 0.7), 0.0, 1.0, 0.0)
    for i in range(count):
        sense = -1.0 if mirrored and i else 1.0
        place = np.array([5.0 * sense, 0.0]) if mirrored else np.array([8.0 * i, 0.0])
        rise = 0.4 * np.array([np.cos(angle), sense * np.sin(angle)])
        wedge, block = made.body(m, place), made.body(M, place + rise)
        made.rail(None, wedge, 0.0, mu)
        made.rail(wedge, block, sense * angle, mu)
        made.rail(None, block, np.pi / 2, mu)
        made.pull(wedge, [-sense, 0.0], scaled(terms, near(rng)))
    if rng.random() < 0.4:
        made.spring(0, 2, rng.uniform(0.01, 0.2) * up)
    return made


def jaws(rng: Any, g: float) -> Drawn:
    """A wedge on its guide spreads two equal jaws on rough guides against springs."""
    made = Drawn(g)
    mu, angle, M = float(rng.uniform(0.05, 0.25)), rng.uniform(0.5, 1.1), rng.uniform(1, 10)
    wedge = made.body(rng.uniform(1, 5), [0.0, 2.0])
    made.rail(None, wedge, np.pi / 2, 0.0)
    k = rng.uniform(50, 400)
    for sense in (1.0, -1.0):
        jaw = made.body(M, [sense * 2.0 * np.tan(angle), 0.0])
        made.rail(None, jaw, 0.0, mu)
        made.rail(wedge, jaw, np.pi / 2 + sense * angle, mu)
        made.spring(None, jaw, k, [0.2 * sense, 0.0])
    size = 3 * k + 4 * mu * M * g
    made.pull(wedge, [0.0, -1.0], terms_of(rng, size))
    return made


def links(rng: Any, g: float) -> Drawn:
    """Equal pairs of blocks joined by rods, on rails."""
    made, count = Drawn(g), int(rng.choice([2, 3]))
    masses, (mu, static) = rng.uniform(0.5, 4, 2), coefficients(rng)
    terms = terms_of(rng, mu * masses.sum() * g)
    for i in range(count):
        one = made.body(masses[0], [0.0, 2.0 * i])
        two = made.body(masses[1], [1.0, 2.0 * i])
        made.rail(None, one, 0.0, mu, static)
        made.rail(None, two, 0.0, mu, static)
        made.link(one, two)
        made.pull(one, [1.0, 0.0], scaled(terms, near(rng)))
    return made


def belt(rng: Any, g: float) -> Drawn:
    """Equal blocks with equal springs on a belt that runs steadily."""
    made, count, v = Drawn(g), int(rng.choice([2, 3])), float(rng.uniform(0.1, 1.0))
    mass, (mu, static) = rng.uniform(0.5, 4), coefficients(rng)
    made.data["bodies"]["belt"] = {"points": {"P": [0, 0]}}
    made.data["joints"]["drive"] = {
        "kind": "prismatic", "between": [made.ground([0.0, 0.0]), "belt.P"], "axis": 0
    }  # fmt: skip
    made.data["drivers"] = [{"coordinate": "drive.slide", "law": f"{v!r}*t"}]
    k = mu * mass * g * rng.uniform(1.0, 4.0)
    for i in range(count):
        place = np.array([1.3 * i, 0.0])
        body = made.body(mass, place)
        made.rail(None, body, 0.0, mu, static, belt=("belt.P", v))
        made.spring(None, body, k * near(rng), place - [0.5, 0.0])
    if rng.random() < 0.4:
        made.spring(0, 1, rng.uniform(0.1, 0.5) * k)
    return made


def brakes(rng: Any, g: float) -> Drawn:
    """Equal slides with equal resistances."""
    made, count = Drawn(g), int(rng.choice([2, 3, 4]))
    mass, size = rng.uniform(0.5, 4), rng.uniform(1, 40)
    terms, angle = terms_of(rng, size), rng.uniform(0, 6.28)
    e = np.array([np.cos(angle), np.sin(angle)])
    made.data["gravity"], made.g = [0, 0.0], 0.0
    for i in range(count):
        body = made.body(mass, [1.0 * i, 2.0 * i])
        made.brake(made.rail(None, body, angle, 0.0), size)
        made.pull(body, e, scaled(terms, near(rng)))
    return made


def spatial(rng: Any, g: float) -> Drawn:
    """Equal blocks on rails in space, turned about the vertical; in the plane of one as brakes."""
    made, count = Drawn(0.0), int(rng.choice([2, 3]))
    mass, (mu, static) = rng.uniform(0.5, 5), coefficients(rng)
    tilt, k, own = rng.uniform(-0.15, 0.15), rng.uniform(1, 40), bool(rng.random() < 0.5)
    terms = terms_of(rng, mu * mass * g)
    along = -mass * g * np.sin(tilt)
    data: dict[str, Any] = {
        "schema": 1, "dimension": 3, "gravity": [0, 0, -g], "ground": {"points": {}}, "bodies": {},
        "joints": {}, "loads": {},
    }  # fmt: skip
    for i in range(count):
        turn = 2 * np.pi * i / count + 0.3
        e = np.array([np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)])
        place, factor = 0.5 * e, near(rng)
        body = made.body(mass, [0.0, 1.5 * i])
        made.rail(None, body, 0.0, 0.0)
        row = made._row(None, body, [1.0, 0.0])
        size = mass * g * np.cos(tilt)
        made.slips.append((f"j{i}", row, mu, static or mu, None, size, 0.0))
        made.pull(body, [1.0, 0.0], scaled(terms, factor))
        text = list(made.data["loads"].values())[-1]["value"][0]
        made.pull(body, [1.0, 0.0], (along, 0.0, 0.0, 1.0, 0.0))
        made.axes.append((place, e))
        data["ground"]["points"][f"G{i}"] = place.tolist()
        data["bodies"][f"b{i}"] = {"points": {"P": [0, 0, 0]}, "mass": mass, "inertia": [1, 1, 1]}
        keys = {"kind": "prismatic", "between": [f"ground.G{i}", f"b{i}.P"], "axis": e.tolist()}
        keys |= {"friction": mu} | ({"friction_static": static} if static else {})
        data["joints"][f"j{i}"] = keys
        data["loads"][f"p{i}"] = {
            "kind": "force", "point": f"b{i}.P", "value": [f"{x!r}*({text})" for x in e.tolist()]
        }  # fmt: skip
        if own:
            made.spring(None, body, k, np.array([-0.4, 1.5 * i]))
            data["ground"]["points"][f"A{i}"] = (place - 0.4 * e).tolist()
            data["loads"][f"s{i}"] = {
                "kind": "spring", "between": [f"ground.A{i}", f"b{i}.P"], "stiffness": k,
                "free_length": 0,
            }  # fmt: skip
    made.data = data | {"sketch": {f"j{i}": 0 for i in range(count)}}
    return made


KINDS = (blocks, stacks, wedges, jaws, links, belt, brakes, spatial)


def drawn(seed: int) -> tuple[Drawn, Course]:
    """Return a machine and its truth."""
    for k in range(40):
        rng = np.random.default_rng([seed, k])
        made = KINDS[seed % len(KINDS)](rng, float(rng.uniform(5, 12)))
        try:
            course = Follower(made.machine()).course()
        except Undecided:
            continue
        if course.events and len(course.events) < 40:
            return made, course
    raise AssertionError(f"nothing drawn from {seed}")


def gathered(events: Any) -> list[tuple[float, str, frozenset[str]]]:
    """Return events with those of one kind that are near each other as one."""
    found: list[tuple[float, str, frozenset[str]]] = []
    for t, kind, names in sorted(events, key=lambda own: own[0]):
        at = next((i for i, own in enumerate(found)
                   if own[1] == kind and t - own[0] <= NEAR * END and not own[2] & names),
                  None)  # fmt: skip
        if at is None:
            found.append((t, kind, names))
        else:
            found[at] = (found[at][0], kind, found[at][2] | names)
    return sorted(found, key=lambda own: (round(own[0] / (NEAR * END)), own[1], sorted(own[2])))


def case(seed: int) -> dict[str, Any]:
    """Return how a motion compares with its truth: what is wrong, the largest differences."""
    made, course = drawn(seed)
    result = md.solve(made.problem(), "go")
    told = {"seed": seed, "kind": KINDS[seed % len(KINDS)].__name__, "events": len(course.events)}
    if result.fault is not None:
        return told | {"wrong": result.fault}
    own = [
        (e["time"], e["kind"], frozenset(e.get("group") or [e.get("joint") or e["load"]]))
        for e in result.events
        if e["kind"] in ("slip", "stick", "reversal")
    ]
    one, two = gathered(own), gathered(course.events)
    if [e[1:] for e in one] != [e[1:] for e in two]:
        return told | {"wrong": f"events {one} are not {two}"}
    times = max((abs(a[0] - b[0]) for a, b in zip(one, two, strict=True)), default=0.0) / END
    place = made.places_of(result)
    begin = np.concatenate(made.places)
    moved = float(np.abs(course.q - begin).max())
    gap = float(np.abs(place - course.q).max()) / max(moved, 1e-3)
    wrong = f"off by {times:.1g} in time, {gap:.1g} in place"
    told |= {"times": times, "places": gap, "together": sum(len(e[2]) > 1 for e in two)}
    return told | ({"wrong": wrong} if times > TIME or gap > PLACE else {})


def main() -> int:
    options = attack.parser(__doc__ or "", 300, "machines").parse_args()
    seeds = [(options.seed + k,) for k in range(options.count)]
    with attack.processes(options.workers) as run:
        found = list(run(case, seeds))
    wrong = [own for own in found if "wrong" in own]
    for own in wrong:
        print(own, file=sys.stderr)
    right = [own for own in found if "wrong" not in own]
    figures = {
        "machines": len(found),
        "wrong": len(wrong),
        "events": sum(own["events"] for own in found),
        "together": sum(own["together"] for own in right),
        "times": max(own["times"] for own in right),
        "places": max(own["places"] for own in right),
    }
    return attack.ended(figures, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())
