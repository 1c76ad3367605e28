"""Equilibria of random four-bars and slider-cranks with springs, on both assembly modes.

The truth is a closed form of its own: the energy along the crank's angle on the branch of the
sketch, with its derivative by a complex step.

    python -m tests.attack.equilibria --count 1000 --out docs/data/equilibria.json
"""

from __future__ import annotations

import cmath
import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import MechdaeError
from tests.shared import attack

G = 9.81
NODES = 1441


@dataclass
class Case:
    """A mechanism with one freedom and two modes.

    ``slider`` tells a slider-crank (``d`` its offset, no ``rocker``); `sign` the mode.
    """

    slider: bool
    crank: float
    rod: float
    rocker: float
    d: float
    masses: tuple[float, float]
    k_turn: float
    rest: float
    k: float
    free: float
    hook: tuple[float, float]
    theta: float
    sign: int

    def joint(self, theta: complex) -> tuple[complex, complex, complex, complex] | None:
        """Return B and C as complex-step numbers (x, y of each), None where it does not close."""
        bx, by = self.crank * _cos(theta), self.crank * _sin(theta)
        if self.slider:
            under = self.rod**2 - (by - self.d) ** 2
            if under.real <= 0:
                return None
            return bx, by, bx + self.sign * cmath.sqrt(under), self.d + 0j
        dx, dy = self.d - bx, -by
        far2 = dx * dx + dy * dy
        along = (far2 + self.rod**2 - self.rocker**2) / (2 * far2)
        under = self.rod**2 / far2 - along * along
        if under.real <= 0:
            return None
        across = self.sign * cmath.sqrt(under)
        return bx, by, bx + along * dx - across * dy, by + along * dy + across * dx

    def energy(self, theta: complex) -> complex | None:
        found = self.joint(theta)
        if found is None:
            return None
        bx, by, cx, cy = found
        height = self.masses[0] * by / 2 + self.masses[1] * (by + cy) / 2
        px, py = (bx + cx) / 2 - self.hook[0], (by + cy) / 2 - self.hook[1]
        stretch = cmath.sqrt(px * px + py * py) - self.free
        turned = theta - self.rest
        return G * height + self.k_turn * turned * turned / 2 + self.k * stretch * stretch / 2

    def slope(self, theta: float) -> float | None:
        value = self.energy(complex(theta, 1e-30))
        return None if value is None else value.imag / 1e-30

    def angles(self, theta: float) -> list[float] | None:
        found = self.joint(complex(theta))
        if found is None:
            return None
        bx, by, cx, cy = (part.real for part in found)
        own = [theta, math.atan2(cy - by, cx - bx)]
        return own if self.slider else [*own, math.atan2(cy, cx - self.d)]

    def arc(self) -> tuple[Any, Any]:
        """Return nodes of the branch both ways from the sketch, up to a turn or its ends."""
        ways = []
        for way in (1, -1):
            nodes = []
            for theta in self.theta + way * np.linspace(0, 2 * math.pi, NODES):
                if self.slope(float(theta)) is None:
                    nodes += self._end(nodes[-1], float(theta))
                    break
                nodes.append(float(theta))
            ways.append(nodes)
        return ways[0], ways[1]

    def _end(self, inside: float, outside: float) -> list[float]:
        """Return nodes that crowd towards the end of the branch: rests may lie there."""
        first = inside
        for _ in range(60):
            middle = (inside + outside) / 2
            if self.slope(middle) is None:
                outside = middle
            else:
                inside = middle
        nodes = [inside + (first - inside) * 0.5**k for k in range(1, 45)]
        return [theta for theta in nodes if self.slope(theta) is not None]

    def rests(self) -> tuple[list[float], float | None]:
        """Return where the energy is stationary on the branch, and the place downhill."""
        roots, downhill = [], None
        for way, nodes in zip((1, -1), self.arc(), strict=True):
            values = [self.slope(theta) for theta in nodes]
            first = None
            for a, b, u, v in zip(nodes, nodes[1:], values, values[1:], strict=False):
                if u * v < 0:
                    roots.append(self._root(a, b))
                    first = roots[-1] if first is None else first
            if first is not None and values[0] * way < 0:
                downhill = first
        return roots, downhill

    def _root(self, a: float, b: float) -> float:
        low = self.slope(a) < 0
        for _ in range(80):
            middle = (a + b) / 2
            if (self.slope(middle) < 0) == low:
                a = middle
            else:
                b = middle
        return (a + b) / 2

    def data(self, generator: Any) -> dict[str, Any]:
        """Return the problem file; the sketch is off by a few degrees but for the crank."""
        off = generator.uniform(-0.05, 0.05, 2)
        angles = self.angles(self.theta)
        ends = {"C": [self.rod, 0], "P": [self.rod / 2, 0], "B": [0, 0]}
        bodies = {
            "crank": {
                "points": {"A": [0, 0], "B": [self.crank, 0]},
                "mass": self.masses[0], "center": [self.crank / 2, 0], "inertia": 0.01,
            },
            "rod": {
                "points": ends, "mass": self.masses[1], "center": [self.rod / 2, 0],
                "inertia": 0.01,
            },
        }  # fmt: skip
        joints = {
            "A": {"kind": "revolute", "between": ["ground.A", "crank.A"]},
            "B": {"kind": "revolute", "between": ["crank.B", "rod.B"]},
        }
        ground = {"A": [0, 0], "S": list(self.hook)}
        sketch = {"crank": self.theta, "rod": angles[1] + off[0]}
        if self.slider:
            ground["O"] = [0, self.d]
            bodies["slider"] = {"points": {"C": [0, 0]}, "mass": 0.5, "inertia": 0.01}
            joints["C"] = {"kind": "revolute", "between": ["rod.C", "slider.C"]}
            joints["guide"] = {"kind": "prismatic", "between": ["ground.O", "slider.C"]}
        else:
            ground["D"] = [self.d, 0]
            bodies["rocker"] = {"points": {"D": [0, 0], "C": [self.rocker, 0]}}
            joints["C"] = {"kind": "revolute", "between": ["rod.C", "rocker.C"]}
            joints["D"] = {"kind": "revolute", "between": ["ground.D", "rocker.D"]}
            sketch["rocker"] = angles[2] + off[1]
        turn = {"kind": "spring", "coordinate": "crank.angle", "stiffness": self.k_turn}
        pull = {"kind": "spring", "between": ["ground.S", "rod.P"], "stiffness": self.k}
        return {
            "schema": 1, "gravity": [0, -G], "ground": {"points": ground}, "bodies": bodies,
            "joints": joints, "sketch": sketch,
            "loads": {"turn": turn | {"free_length": self.rest}, "pull": pull
                      | {"free_length": self.free}},
            "tasks": {"rest": {"kind": "equilibrium", "free": ["crank.angle"]}},
        }  # fmt: skip


def _cos(z: complex) -> complex:
    return cmath.cos(z)


def _sin(z: complex) -> complex:
    return cmath.sin(z)


def drawn(seed: int) -> tuple[Case, Any]:
    """Return a random case and the generator that drew it."""
    generator = np.random.default_rng([31, seed])
    while True:
        slider = bool(generator.random() < 0.4)
        crank, rod, rocker = generator.uniform(0.2, 1.2, 3)
        case = Case(
            slider, crank, rod, rocker,
            generator.uniform(-0.4, 0.4) if slider else generator.uniform(0.5, 1.5),
            tuple(generator.uniform(0.2, 2.0, 2)),
            generator.choice([0.0, generator.uniform(0, 12)]), generator.uniform(-3, 3),
            generator.uniform(0, 150), generator.uniform(0.1, 1.0),
            tuple(generator.uniform(-1, 2, 2)), generator.uniform(-math.pi, math.pi),
            int(generator.choice([-1, 1])),
        )  # fmt: skip
        near = [case.joint(complex(case.theta + off)) for off in (-0.15, 0.0, 0.15)]
        if all(found is not None for found in near):
            return case, generator


def judged(seed: int) -> dict[str, Any]:
    """Return what the package says about a case, and faults."""
    case, generator = drawn(seed)
    roots, downhill = case.rests()
    start = case.angles(case.theta)
    entry: dict[str, Any] = {"seed": seed, "roots": len(roots), "faults": []}
    faults = entry["faults"]
    try:
        result = md.solve(from_dict(case.data(generator)), "rest")
    except MechdaeError as error:
        if roots:
            faults.append(f"refused: {error}")
        entry["refused"] = True
        return entry
    theta = float(result.bodies["crank"].angle[0])
    own = case.angles(theta)
    rod = float(result.bodies["rod"].angle[0])
    on = own is not None and abs(math.remainder(own[1] - rod, 2 * math.pi)) < 1e-6
    arc = [*case.arc()[1][::-1], *case.arc()[0]]
    on = on and arc[0] - 1e-9 <= theta <= arc[-1] + 1e-9
    entry |= {"on": on, "said": bool(result.summary["sketched_mode"])}
    if on != entry["said"]:
        faults.append(f"says on the sketch's mode: {entry['said']}, truth {on}")
    if not on:
        if downhill is not None:
            faults.append(f"left the mode, which has a rest downhill at {downhill:.9g}")
        if not any("another" in note for note in result.summary.get("notes", [])):
            faults.append("left the mode without a note")
        return entry
    gap = min((abs(root - theta) for root in roots), default=math.inf)
    entry["gap"] = gap
    if gap > 1e-7:
        faults.append(f"no rest there: {theta:.9g}, but {roots}")

    def far(root: float) -> float:
        ends = case.angles(root)
        return math.hypot(root - case.theta, *(
            math.remainder(a - b, 2 * math.pi) for a, b in zip(ends[1:], start[1:], strict=True)
        ))  # fmt: skip

    nearest = min(roots, key=far)
    if far(nearest) < 0.3 and abs(theta - nearest) > 1e-7 and far(nearest) < 0.99 * far(theta):
        faults.append(f"the nearest rest is {nearest:.9g}, not {theta:.9g}")
    turned = 0.0 if downhill is None else theta - downhill
    if case.k_turn == 0:
        turned = math.remainder(turned, 2 * math.pi)
    if far(nearest) > 0.4 and abs(turned) > 1e-7:
        faults.append(f"let go it comes to {downhill:.9g}, not {theta:.9g}")
    listed = [e["coordinates"]["crank.angle"] for e in result.summary["equilibria"]]
    for root in roots:
        gaps = [abs(math.remainder(value - root, 2 * math.pi)) for value in listed]
        if case.k_turn == 0 and min(gaps) > 1e-6 and len(listed) < 20:
            faults.append(f"the rest at {root:.9g} is not listed")
    return entry


def main(arguments: list[str] | None = None) -> int:
    options = attack.parser(__doc__, 1000).parse_args(arguments)
    with attack.processes(options.workers) as run:
        seeds = [(seed,) for seed in range(options.seed, options.seed + options.count)]
        entries = list(run(judged, seeds, 20))
    faults = [e for e in entries if e["faults"]]
    figures = {
        "cases": len(entries),
        "answered_on_the_sketched_mode": sum(bool(e.get("on")) for e in entries),
        "answered_elsewhere_with_a_note": sum(e.get("on") is False for e in entries),
        "refused": sum(bool(e.get("refused")) for e in entries),
        "largest_gap_rad": max(e.get("gap", 0.0) for e in entries),
        "faults": faults,
    }
    return attack.ended(figures, options.out, faults)


if __name__ == "__main__":
    sys.exit(main())
