"""What is said of poses without motion to them: whether the sketched mode exists there."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.assembly.mode_labels import ModeLabels
from mechdae.motion.kinematics import extremes
from mechdae.results.tables import table
from tests.shared.paths import DATA

STEPHENSON = DATA / "use" / "stephenson-beyond-reach.toml"
TURN = 2 * math.pi
POSES = 24


def circles(p: complex, a: float, q: complex, b: float, sign: int) -> complex | None:
    """Return the point a from p and b from q that is left (+) or right of p -> q."""
    d = abs(q - p)
    x = (a * a - b * b + d * d) / (2 * d)
    if abs(x) > a:
        return None
    return p + (q - p) / d * complex(x, sign * math.sqrt(a * a - x * x))


class Stephenson:
    """A four-bar with a dyad on a point of its coupler."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        while True:
            self.b, self.c, self.f, self.g = rng.uniform(1.0, 3.0, 4)
            self.d, self.end = 2.5, complex(*rng.uniform(-2.5, 4.0, 2))
            self.e = complex(*rng.uniform(-1.5, 2.0, 2))
            self.signs = rng.choice([1, -1], 2)
            self.at = float(rng.uniform(0, TURN))
            if self.closes(self.at, self.signs):
                return

    def pins(self, angle: float, signs: tuple[int, int]) -> tuple[complex, complex, complex] | None:
        B = cmath.exp(1j * angle)
        C = circles(B, self.b, self.d, self.c, signs[0])
        if C is None:
            return None
        E = B + self.e * (C - B) / self.b
        F = circles(E, self.f, self.end, self.g, signs[1])
        return None if F is None else (C, E, F)

    def closes(self, angle: float, signs: tuple[int, int]) -> bool:
        return self.pins(angle, signs) is not None

    def mechanism(self) -> md.Mechanism:
        B = cmath.exp(1j * self.at)
        C, E, F = self.pins(self.at, self.signs)
        names = {"crank": B, "coupler": C - B, "rocker": C - self.d, "link": F - E}
        names["out"] = F - self.end
        e = (self.e.real, self.e.imag)
        return md.Mechanism(
            ground=md.Ground({"A": (0, 0), "D": (self.d, 0), "G": (self.end.real, self.end.imag)}),
            bodies=[
                md.Body("crank", {"A": (0, 0), "B": (1, 0)}),
                md.Body("coupler", {"B": (0, 0), "C": (self.b, 0), "E": e}),
                md.Body("rocker", {"D": (0, 0), "C": (self.c, 0)}),
                md.Body("link", {"E": (0, 0), "F": (self.f, 0)}),
                md.Body("out", {"G": (0, 0), "F": (self.g, 0)}),
            ],
            joints=[
                md.Revolute("A", "ground.A", "crank.A"),
                md.Revolute("B", "crank.B", "coupler.B"),
                md.Revolute("C", "coupler.C", "rocker.C"),
                md.Revolute("D", "ground.D", "rocker.D"),
                md.Revolute("E", "coupler.E", "link.E"),
                md.Revolute("F", "link.F", "out.F"),
                md.Revolute("G", "ground.G", "out.G"),
            ],
            sketch={name: cmath.phase(vector) for name, vector in names.items()},
        )

    def wrong(self) -> int:
        """Return of how many lost intervals it is said wrongly that the sketched mode exists."""
        driver = md.Driver("crank.angle", from_=self.at, to=self.at + TURN)
        result = md.solve(self.mechanism(), md.Sweep(driver, poses=POSES + 1))
        places = result.drivers["crank.angle"].position
        wrong = 0
        for entry in result.summary.get("failed", []):
            lost = places[(places > entry["from"]) & (places < entry["to"])]
            there = any(self.closes(angle, self.signs) for angle in lost)
            wrong += bool(entry.get("assembles")) != there
        return wrong


@pytest.mark.parametrize("seed", range(60))
def test_the_sketched_mode_exists_where_it_is_said_to(seed: int) -> None:
    assert Stephenson(seed).wrong() == 0


def test_another_mode_taken_for_the_sketched_one_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted mistake: all modes have the sign of the sketched one."""
    monkeypatch.setattr(ModeLabels, "sign", lambda *_: "+")
    assert sum(Stephenson(seed).wrong() for seed in range(60)) > 3


def test_no_pose_where_the_drawn_linkage_opens() -> None:
    """Between 165.5 and 304.3 degrees the dyad closes with the four-bar crossed only."""
    result = md.solve(md.load(STEPHENSON), "turn")
    (entry,) = result.summary["failed"]
    assert not entry.get("assembles")
    assert entry["joint"] == "F"
    assert "opens at joint F" in result.fault
    assert "leads there" not in table(result)


def swing_error(seed: int) -> float:
    """Return by what share the swing of a crank between two limits is off its closed form."""
    rng = np.random.default_rng(seed)
    while True:
        b, c, d = rng.uniform(0.3, 1.4, 3)
        cosines = [(1 + d * d - span**2) / (2 * d) for span in (b + c, abs(b - c))]
        if abs(cosines[0]) < 0.95 and cosines[1] > 1.05:  # opens outwards, not inwards
            break
    half = math.acos(cosines[0])
    at = 0.5 * half
    B, C = cmath.exp(1j * at), circles(cmath.exp(1j * at), b, d, c, 1)
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (d, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (1, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (b, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (c, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={"crank": at, "coupler": cmath.phase(C - B), "rocker": cmath.phase(C - d)},
    )
    driver = md.Driver("crank.angle", from_=0, to=TURN)
    result = md.solve(mechanism, md.Sweep(driver, poses=13))
    return abs(result.summary["swing"]["crank"] / (2 * half) - 1)


@pytest.mark.parametrize("seed", range(30))
def test_a_driver_swings_as_far_as_its_arc_is_long(seed: int) -> None:
    """Poses that are reached the other way round are whole turns away on the path."""
    assert swing_error(seed) < 1e-9


def test_turns_that_are_not_taken_back_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extremes, "_whole_turns", lambda *_: 0.0)
    assert all(swing_error(seed) > 0.1 for seed in range(3))
