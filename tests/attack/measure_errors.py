"""Draws random mechanisms; compares refined measures and the errors given with them with truths.

    python -m tests.attack.measure_errors --count 1000 --out docs/data/measure-errors.json

Two kinds of mechanism: cranks with one or two dyads side by side (lengths, areas and extremes of
paths, up to the limit positions), and slider-cranks with dry friction, every third of them with
crank and rod nearly equal (mean losses). The truths are closed forms in 80 bits with fixed Gauss
rules that share nothing with the package. The exit code is 1 where a value is further off than
the error given with it, or an error is larger than the bars below.
"""

from __future__ import annotations

import sys
from itertools import pairwise

import numpy as np

import mechdae as md
from tests.reference.closed_forms import circle_circle, circle_line
from tests.reference.force_truth import LONG, circle, course, panels, place, rate
from tests.reference.force_truth import slider_crank as free_slider_crank
from tests.reference.jets import unit
from tests.shared import attack

TURN = 2 * np.pi
MEAN_BAR, LENGTH_BAR, VALUE_BAR = 1e-9, 1e-9, 1e-9
"""Largest errors given: of a mean, relative to it; of a length, relative; of an extreme, in
lengths of the mechanism."""
WORDS = ("length", "area", "min", "max", "mean")


# -- paths -------------------------------------------------------------------------------------


class Linkage:
    """A crank O-A with a coupler point, an R-R-R dyad A-B-D and perhaps an R-R-P dyad A-C."""

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng([seed, 71])
        self.a = float(draw.uniform(0.3, 1.0))
        self.b, self.c = (float(v) for v in draw.uniform(0.4, 1.6, 2))
        self.d = float(draw.uniform(0.8, 1.8))
        self.px, self.py = (float(v) for v in draw.uniform(-0.8, 0.8, 2))
        self.second = bool(draw.integers(2))
        self.rod, self.offset = float(draw.uniform(0.5, 2.2)), float(draw.uniform(-0.5, 0.5))
        self.sign = int(draw.choice([-1, 1]))
        self.scale = float(10.0 ** draw.integers(-3, 4))
        arcs = [self._of_circle()] + ([self._of_line()] if self.second else [])
        self.start = self._start(arcs, draw)
        if self.start is not None:
            self.low, self.high = self._reach(arcs)

    def _of_circle(self):
        """Return f(theta) >= 0 where B exists."""
        b, c = LONG(self.b), LONG(self.c)
        near, far = (b - c) ** 2, (b + c) ** 2

        def slack(u):
            a, d = LONG(self.a), LONG(self.d)
            square = a**2 + d**2 - 2 * a * d * np.cos(u)
            return np.minimum(square - near, far - square)

        return slack

    def _of_line(self):
        return lambda u: LONG(self.rod) - np.abs(LONG(self.a) * np.sin(u) - LONG(self.offset))

    def _start(self, arcs, draw):
        """Return an angle at which all exist, well inside."""
        for u in draw.uniform(0, TURN, 40):
            if all(f(LONG(u)) > 0.02 for f in arcs):
                return float(u)
        return None

    def _reach(self, arcs):
        """Return the ends of the arc around the start where all exist; None where it is whole."""

        def slack(u):
            return np.min([f(u) for f in arcs], axis=0)

        ends = []
        for sense in (-1, 1):
            steps = LONG(self.start) + sense * np.linspace(0, TURN, 4001).astype(LONG)
            gone = np.flatnonzero(slack(steps) < 0)
            if not gone.size:
                return None, None
            a, b = steps[gone[0] - 1], steps[gone[0]]
            for _ in range(90):
                middle = (a + b) / 2
                a, b = (middle, b) if slack(middle) >= 0 else (a, middle)
            ends.append(a)
        return ends[0], ends[1]

    def at(self, u, limits=False):
        """Return the jets of the points by name; with `limits` their places, ends included."""
        one = unit(course(u, 1.0))
        A = one * LONG(self.a)
        D = one * 0 + LONG(self.d)
        B = circle_circle(A, LONG(self.b), D, LONG(self.c), self.sign)
        ended = (u == self.low) | (u == self.high)
        if limits:  # positions alone: at a limit both solutions are one
            A, D = place(A), place(D)
            B = _meet(A, LONG(self.b), D, LONG(self.c), self.sign, ended)
        along = (B - A) * (1 / LONG(self.b))
        points = {"crank.A": A, "coupler.P": A + along * (LONG(self.px) + 1j * LONG(self.py))}
        points["rocker.B"] = B
        if self.second:
            guide = 1j * LONG(self.offset)
            if limits:
                off = np.imag(A - guide)
                points["block.C"] = (
                    A - 1j * off + _root((LONG(self.rod) - off) * (LONG(self.rod) + off), ended)
                )
            else:
                points["block.C"] = circle_line(A, LONG(self.rod), guide, 1.0, 1)[0]
        return points

    def mechanism(self) -> md.Mechanism:
        k = self.scale
        start = self.at(self.start)
        A, B = place(start["crank.A"])[0], place(start["rocker.B"])[0]
        bodies = {
            "crank": md.Body("crank", {"O": (0, 0), "A": (k * self.a, 0)}),
            "coupler": md.Body(
                "coupler", {"A": (0, 0), "B": (k * self.b, 0), "P": (k * self.px, k * self.py)}
            ),
            "rocker": md.Body("rocker", {"D": (0, 0), "B": (k * self.c, 0)}),
        }
        joints = {
            "O": md.Revolute("O", "ground.O", "crank.O"),
            "A": md.Revolute("A", "crank.A", "coupler.A"),
            "B": md.Revolute("B", "coupler.B", "rocker.B"),
            "D": md.Revolute("D", "ground.D", "rocker.D"),
        }
        sketch = {
            "crank": self.start,
            "coupler": float(np.angle(complex(B - A))),
            "rocker": float(np.angle(complex(B - self.d))),
        }
        ground = {"O": (0, 0), "D": (k * self.d, 0)}
        if self.second:
            C = place(start["block.C"])[0]
            ground["G"] = (0, k * self.offset)
            bodies["rod"] = md.Body("rod", {"A": (0, 0), "C": (k * self.rod, 0)})
            bodies["block"] = md.Body("block", {"C": (0, 0)})
            joints["A2"] = md.Revolute("A2", "crank.A", "rod.A")
            joints["C"] = md.Revolute("C", "rod.C", "block.C")
            joints["guide"] = md.Prismatic("guide", "ground.G", "block.C")
            sketch["rod"] = float(np.angle(complex(C - A)))
        return md.Mechanism(
            ground=md.Ground(ground),
            bodies=list(bodies.values()),
            joints=list(joints.values()),
            sketch=sketch,
        )

    def _course(self, t):
        """Return the crank's angle; between two limits with a sine, so that roots vanish."""
        if self.low is None:
            return self.start + (t + LONG(np.pi) / 2) * 2
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        return middle + half * np.sin(t)

    def _turns_back(self, name):
        """Return where a point that runs to and fro turns back."""
        t = np.linspace(-np.pi / 2, np.pi / 2, 2002)[1:-1].astype(LONG)

        def speed(t):
            point = self.at(self._course(t))[name]
            along = 1j * (place(point) - self.d) if name == "rocker.B" else 1.0
            return np.real(np.conj(along) * rate(point))

        signs = np.sign(speed(t))
        found = []
        for k in np.flatnonzero(signs[1:] * signs[:-1] < 0):
            a, b = t[k], t[k + 1]
            for _ in range(60):
                middle = (a + b) / 2
                before = np.sign(speed(np.array([middle]))[0]) == signs[k]
                a, b = (middle, b) if before else (a, middle)
            found.append(float(a))
        return found

    def grid(self, pieces, inner=()):
        """Return places on the reached arc with weights of the mean over it times its width."""
        x, w = panels([-np.pi / 2, *inner, np.pi / 2], pieces, 40)
        x, w = x.astype(LONG), w.astype(LONG) * LONG(np.pi)
        slope = LONG(2)
        if self.low is not None:
            slope = (self.high - self.low) / 2 * np.cos(x)
        return self._course(x), w * slope

    def integrals(self, pieces):
        found = {}
        for name in self.at(np.array([self.start])):
            inner = self._turns_back(name) if name in ("rocker.B", "block.C") else []
            u, w = self.grid(max(pieces // (len(inner) + 1), 20), inner)
            jet = self.at(u)[name]
            x, v = place(jet), rate(jet)
            found[name] = (
                float(np.sum(w * np.abs(v))) * self.scale,
                float(np.sum(w * np.imag(np.conj(x - x[0]) * v)) / 2) * self.scale**2,
            )
        return found

    def extremes(self):
        """Return name.axis -> (min, max) over the reached arc."""
        count = 4001
        t = np.linspace(-np.pi / 2, np.pi / 2, count).astype(LONG)
        found = {}

        def inside(u):
            for end in (self.low, self.high) if self.low is not None else ():
                u = np.where(np.abs(u - end) < 1e-9, end, u)  # beside it roots are rounding
            return u

        for name in self.at(np.array([self.start])):
            for axis, part in (("x", np.real), ("y", np.imag)):

                def value(t, part=part, name=name):
                    return part(self.at(inside(self._course(t)), limits=True)[name])

                values = value(t)
                ends = []
                for sense in (-1, 1):
                    k = int(np.nanargmax(sense * values))
                    a, b = t[max(k - 1, 0)], t[min(k + 1, count - 1)]
                    for _ in range(60):
                        inner = a + (b - a) * np.array([1, 2], LONG) / 3
                        first, last = sense * value(inner)
                        a, b = (a, inner[1]) if first > last else (inner[0], b)
                    best = max(sense * value(np.array([t[k], (a + b) / 2])))
                    ends.append(float(sense * best) * self.scale)
                found[f"{name}.{axis}"] = ends
        return found


def _root(x, ended):
    """Return the square root, that of rounding at a limit position zero."""
    return np.sqrt(np.where(ended & (x < 1e-12), 0, np.maximum(x, 0)))


def _meet(c1, r1, c2, r2, sign, ended):
    """Return the inner pin of a dyad; stretched or folded where it hardly meets."""
    line = c2 - c1
    square = np.abs(line) ** 2
    along = (square + (r1 - r2) * (r1 + r2)) / (2 * square)
    heron = ((r1 + r2) * (r1 + r2) - square) * (square - (r1 - r2) * (r1 - r2))
    return c1 + line * (along + 1j * sign * _root(heron, ended) / (2 * square))


def of_linkage(seed: int) -> dict | None:
    """Return the worst error, and the worst ratio of error to what was given, of each measure."""
    case = Linkage(seed)
    if case.start is None:
        return None
    fine, coarse = case.integrals(400), case.integrals(200)
    driver = md.Driver("crank.angle", from_=case.start, to=case.start + TURN)
    task = md.Sweep(driver, poses=5, measures=("curve", "extremes"))
    result = md.solve(case.mechanism(), task)
    row = {word: [0.0, 0.0, 0.0] for word in WORDS}

    def compare(word, found, true, given, size, slack):
        off = max(abs(found - true) - slack, 0.0)
        ratio = off / given if given else float(off > 0)
        row[word] = [max(p) for p in zip(row[word], (off / size, given / size, ratio), strict=True)]

    for name, facts in result.summary["curve"].items():
        if name not in fine:
            continue
        (length, area), rough = fine[name], coarse[name]
        slack = 4 * abs(length - rough[0]) + 1e-16 * length
        compare("length", facts["length"], length, facts["error"], length, slack)
        if "area" in facts and case.low is None:
            slack = 4 * abs(area - rough[1]) + 1e-16 * length**2
            compare("area", facts["area"], area, facts["area_error"], length**2, slack)
    for name, ends in case.extremes().items():
        found = result.summary["extremes"].get(name)
        for word, true in zip(("min", "max"), ends, strict=True) if found else ():
            end = found[word]
            compare(word, end["value"], true, end["error"], case.scale, 2e-16 * abs(true))
    return row


# -- means -------------------------------------------------------------------------------------


def of_means(seed: int) -> dict:
    """The same for the mean losses of a slider-crank with friction in all joints."""
    draw = np.random.default_rng([seed, 72])
    rod = float(draw.uniform(0.08, 0.4))
    share = draw.uniform(0.8, 0.93) if seed % 3 == 0 else draw.uniform(0.1, 0.7)
    r = float(share * rod)
    f, guide = float(draw.uniform(0.01, 0.12)), float(draw.uniform(0.01, 0.3))
    radii = [float(v) for v in draw.uniform(0.004, 0.02, 3)]
    numbers = {"r": r, "l": rod, "f": f, "f_slide": guide}
    numbers |= dict(zip(("r_O", "r_B", "r_C"), radii, strict=True))
    result = md.solve("slider-crank-friction", task="cycle", set=numbers)
    row = {word: [0.0, 0.0, 0.0] for word in WORDS}
    if "loss_by_joint" not in result.summary:
        return row  # it jams: there are no means
    rho = tuple(circle(radius, f) for radius in radii)

    def load(v):
        return np.where(v < 0, LONG(1000), LONG(-200))

    names = list(result.summary["loss_by_joint"])

    def means(pieces):
        edges = sorted({0.0, TURN, *result.summary["kinks"], np.pi / 2, np.pi, 3 * np.pi / 2})
        edges = [0.0, *[b for a, b in pairwise(edges) if b - a > 1e-9]]
        at, weights = panels(edges, pieces, 40)
        scene, _ = free_slider_crank(at, 10.0, r, rod, load, rho, guide)
        forces = scene.solve()
        return {name: float(np.sum(weights * forces.loss(name))) for name in names}

    fine, coarse = means(48), means(24)
    for name, found in result.summary["loss_by_joint"].items():
        given = result.summary["mean_errors"]["loss_by_joint"][name]
        slack = 4 * abs(fine[name] - coarse[name]) + 4e-16 * fine[name]
        off = max(abs(found - fine[name]) - slack, 0.0)
        own = (off / fine[name], given / fine[name], off / given)
        row["mean"] = [max(pair) for pair in zip(row["mean"], own, strict=True)]
    return row


def run(first: int, count: int) -> dict:
    """Return for each measure the number of mechanisms, largest error, error given, and ratio."""
    found = {word: {"error": 0.0, "given": 0.0, "ratio": 0.0} for word in WORDS}
    counts = {"linkages": 0, "cycles": 0}
    for seed in range(first, first + count):
        rows = [of_linkage(seed)] + ([of_means(seed)] if seed % 4 == 0 else [])
        counts["linkages"] += rows[0] is not None
        counts["cycles"] += len(rows) - 1
        for row in rows:
            for word, values in (row or {}).items():
                own = found[word]
                for key, value in zip(own, values, strict=True):
                    own[key] = max(own[key], float(value))
                if values[2] > 1:
                    print(f"seed {seed}: {word} {values}", file=sys.stderr)
    return counts | {"measures": found}


def faults(figures: dict) -> list[str]:
    """Return what is larger than it may be."""
    bars = dict.fromkeys(("min", "max"), VALUE_BAR) | {"length": LENGTH_BAR, "mean": MEAN_BAR}
    own = figures["measures"]
    found = [f"{word}: off by more than its error" for word in WORDS if own[word]["ratio"] > 1]
    return found + [f"{word}: error too large" for word in bars if own[word]["given"] > bars[word]]


def main(arguments: list[str] | None = None) -> int:
    options = attack.parser(__doc__, 1000).parse_args(arguments)
    figures = run(options.seed, options.count)
    return attack.ended(figures, options.out, faults(figures))


if __name__ == "__main__":
    sys.exit(main())
