"""Modes of independent groups multiply: counts and lists against circles that are intersected."""

from __future__ import annotations

import cmath
import math
from itertools import product

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.errors import UnavailableError
from mechdae.motion.assembly import mode_tree
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.mode_tree import ModeTree
from tests.shared.paths import DATA

WALKER = DATA / "use" / "modes-of-a-walker.toml"
CRANK = 0.7
"""Angle of the crank [rad]; its pin is at a unit's distance."""


def circles(p: complex, a: float, q: complex, b: float) -> list[complex]:
    """Return the points a from p and b from q, the one left of p -> q first."""
    d = abs(q - p)
    x = (a * a - b * b + d * d) / (2 * d)
    if abs(x) > a:
        return []
    side = (q - p) / d
    return [p + side * complex(x, sign * math.sqrt(a * a - x * x)) for sign in (1, -1)]


class Dyads:
    """A crank with dyads of bars, each between two joints that are there: ground or earlier."""

    def __init__(self, seed: int, count: int) -> None:
        rng = np.random.default_rng(seed)
        self.pivots = [complex(*rng.uniform(-3, 3, 2)) for _ in range(3)]
        self.bars: list[tuple[int, int, float, float]] = []
        chosen = self.start()
        for _ in range(count):
            ends = rng.choice(len(chosen), 2, replace=False)
            p, q = chosen[ends[0]], chosen[ends[1]]
            share = abs(q - p) * rng.uniform(0.55, 1.2, 2)
            self.bars.append((int(ends[0]), int(ends[1]), float(share[0]), float(share[1])))
            chosen.append(circles(p, share[0], q, share[1])[int(rng.integers(2))])

    def start(self) -> list[complex]:
        return [*self.pivots, cmath.exp(1j * CRANK)]

    def modes(self) -> list[list[complex]]:
        """Return the points of all modes, one group after the other, by brute force."""
        found = [self.start()]
        for i, j, a, b in self.bars:
            found = [[*at, pin] for at in found for pin in circles(at[i], a, at[j], b)]
        return found

    def mechanism(self) -> md.Mechanism:
        ground = {"O": (0.0, 0.0)} | {f"P{k}": (p.real, p.imag) for k, p in enumerate(self.pivots)}
        at = [f"ground.P{k}" for k in range(len(self.pivots))] + ["crank.A"]
        bodies = [md.Body("crank", {"O": (0, 0), "A": (1, 0)})]
        joints = [md.Revolute("O", "ground.O", "crank.O")]
        for k, (i, j, a, b) in enumerate(self.bars):
            for name, length, end in ((f"a{k}", a, i), (f"b{k}", b, j)):
                bodies.append(md.Body(name, {"P": (0, 0), "C": (length, 0)}))
                joints.append(md.Revolute(f"{name}P", at[end], f"{name}.P"))
            joints.append(md.Revolute(f"C{k}", f"a{k}.C", f"b{k}.C"))
            at.append(f"a{k}.C")
        return md.Mechanism(
            ground=md.Ground(ground), bodies=bodies, joints=joints, sketch={"crank": CRANK}
        )


TASK = md.Modes(md.Driver("crank.angle", at=[CRANK]))


def difference(dyads: Dyads) -> float:
    """Return how far listed modes are off those of brute force; inf if there are more or fewer."""
    result = md.solve(dyads.mechanism(), TASK)
    wanted = np.array([at[4:] for at in dyads.modes()]).reshape(-1, len(dyads.bars))
    if result.summary["count"] != len(wanted) or len(result.labels) != len(wanted):
        return math.inf
    if len(set(result.labels)) != len(wanted) or not result.summary["proven"]:
        return math.inf
    pins = [result.points[f"a{k}.C"].position for k in range(len(dyads.bars))]
    found = np.array([pin[:, 0] + 1j * pin[:, 1] for pin in pins]).T
    gaps = np.abs(found[:, None] - wanted[None]).max(axis=2)
    return float(max(gaps.min(axis=0).max(), gaps.min(axis=1).max()))


@pytest.mark.parametrize("seed", range(40))
def test_modes_of_random_dyads_are_those_of_circles(seed: int) -> None:
    assert difference(Dyads(seed, 2 + seed % 5)) < 1e-9


@pytest.mark.parametrize("seed", range(40, 200))
def test_random_counts(seed: int) -> None:
    dyads = Dyads(seed, 2 + seed % 4)
    assert md.solve(dyads.mechanism(), TASK).summary["count"] == len(dyads.modes())


def test_a_group_taken_for_independent_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted mistake: later groups are solved at one pose of those they stand on."""
    honest = ModeTree._dependencies

    def without(self: ModeTree) -> tuple[list[set[int]], list[list[int]]]:
        needs, held = honest(self)
        return needs, [[] for _ in held]

    monkeypatch.setattr(ModeTree, "_dependencies", without)
    assert any(difference(Dyads(seed, 4)) > 1e-6 for seed in range(8))


def test_independent_groups_are_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    solve = Assembler.candidates

    def counted(self, group, *rest, **keys):
        calls.append(group.index)
        return solve(self, group, *rest, **keys)

    monkeypatch.setattr(Assembler, "candidates", counted)
    legs = 10
    dyads = Dyads(0, 0)
    pin = cmath.exp(1j * CRANK)
    dyads.bars = [
        (k % 3, 3, 0.8 * abs(dyads.pivots[k % 3] - pin), 1.0 * abs(dyads.pivots[k % 3] - pin))
        for k in range(legs)
    ]
    result = md.solve(dyads.mechanism(), md.Modes(TASK.driver, limit=3))
    assert result.summary["count"] == 2**legs
    assert [",".join(labels) for labels in result.labels] == [
        ",".join(labels) for labels in list(product("+-", repeat=legs))[:3]
    ]
    assert f"the first 3 of {2**legs} modes are listed" in result.summary["notes"]
    assert calls.count(calls[-1]) <= 2  # the label of the sketch apart
    assert len(calls) <= 2 * (legs + 1)
    whole = md.solve(dyads.mechanism(), TASK)
    assert len(whole.labels) == mode_tree_listed()
    assert f"the first {mode_tree_listed()} of {2**legs} modes are listed" in whole.summary["notes"]


def mode_tree_listed() -> int:
    from mechdae.motion.kinematics.modes_task import LISTED

    return LISTED


def leg(anchor: complex, pivot: complex, side: float) -> int:
    """Return how many poses a leg has: three pairs of circles, one after the other."""
    p2, p3 = complex(7.2 * side, -1.2), complex(4.3 * side, -1.9)
    p5, p6 = complex(2.9 * side, 0.7), complex(-0.6 * side, 2.9)
    count = 0
    for hip in circles(pivot, abs(p6), anchor, 4.465422712353221):
        turn = (hip - pivot) / p6
        for knee in circles(pivot, 2.9546573405388314, anchor, 4.701063709417263):
            count += len(circles(knee, abs(p2 - p3), pivot + p5 * turn, 2.9546573405388314))
    return count


def test_a_walker_has_the_modes_of_its_legs() -> None:
    legs = 1
    for k, side in product(range(3), (1.0, -1.0)):
        turn = 2 * math.pi * k / 3
        anchor = complex(-0.8 * math.sin(turn), 0.8 - 0.8 * math.cos(turn))
        legs *= leg(anchor, complex(3.1 * side, 0.8), side)
    problem = md.load(WALKER)
    result = md.solve(problem, "modes")
    assert (result.summary["count"], result.summary["proven"]) == (legs, True) == (8**6, True)
    assert len(result.labels) == 4
    assert main(["check", str(WALKER), "--quiet"]) == 0


def test_a_mode_is_found_by_its_label_without_the_others() -> None:
    problem = md.load(WALKER)
    label = "-,+,-,+,-,+,-1,+2,+1,-2,+1,+1"
    result = md.solve(problem, "turn", mode=label, poses=2)
    assert result.summary["mode"] == label
    with pytest.raises(md.MechdaeError, match="and 262080 more"):
        md.solve(problem, "turn", mode="+", poses=2)


def test_what_cannot_be_counted_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mode_tree, "MOST_SOLVED", 5)
    with pytest.raises(UnavailableError, match="more than 5 poses"):
        md.solve(Dyads(3, 6).mechanism(), TASK)
