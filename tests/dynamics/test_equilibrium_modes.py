"""The equilibrium that is answered lies on the assembly mode of the sketch, or a note says so."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.dynamics.rest.all_equilibria import Rest, Rests
from mechdae.dynamics.rest.balance import EquilibriumEquations
from mechdae.dynamics.rest.chart import Chart
from mechdae.errors import UnknownName
from tests.attack import equilibria
from tests.shared.paths import DATA

CASES = range(16)


@pytest.mark.parametrize("seed", [*CASES, 310, 699])
def test_random_mechanisms_stay_on_the_sketched_mode(seed: int) -> None:
    assert equilibria.judged(seed)["faults"] == []


def _newton_alone(self: Rests, balance: EquilibriumEquations, chart: Chart, x: object) -> None:
    """The mistake of old: what Newton's method happens to find, with nothing said about it."""
    self.found, self.whole = [], False
    y, lam, left, steps = balance.newton(x)
    if left < 1e-10:
        self.found.append(Rest(y, lam, left, steps, 0.0, True, True, "stable", True))


SEEN = {"Newton alone": 1, "modes not told apart": 19, "the nearest of all": 4}
"""Mistakes, and the first mechanism of the draw that shows each."""


@pytest.mark.parametrize("planted", SEEN)
def test_planted_mistakes_are_seen(planted: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if planted == "Newton alone":
        monkeypatch.setattr(Rests, "__init__", _newton_alone)
    elif planted == "modes not told apart":
        monkeypatch.setattr(Chart, "signs", lambda self, x: "+")
    else:
        monkeypatch.setattr(Rests, "answer", property(lambda self: self.found[0]))
    assert equilibria.judged(SEEN[planted])["faults"]


def _energy(a: float, b: float, side: int) -> float:
    """Energy of the five-bar of the data over the angles of its two outer bars."""
    B = np.array([0.5 * math.cos(a), 0.5 * math.sin(a)])
    D = np.array([0.8 + 0.45 * math.cos(b), 0.45 * math.sin(b)])
    e = D - B
    far = np.hypot(*e)
    e = e / far
    along = (far**2 + 0.8**2 - 0.7**2) / (2 * far)
    if abs(along) >= 0.8:
        return math.nan
    C = B + along * e + side * math.sqrt(0.64 - along**2) * np.array([-e[1], e[0]])
    rod = (C - B) / 0.8
    height = 0.7 * 0.25 * math.sin(a) + 0.4 * (B[1] + 0.4 * rod[1] + 0.05 * rod[0])
    height += 0.6 * (C[1] + D[1]) / 2 + 0.5 * 0.2 * math.sin(b)
    return 9.81 * height + 4 * (a - 2) ** 2 + 4 * (b - 1) ** 2


def test_two_freedoms_where_the_sketched_mode_has_no_rest_to_come_to() -> None:
    """Elbow up, downhill leads to the stretched elbow: the rest lies elbow down, and is so said."""
    start, step = np.array([2.1, 0.75]), 1e-3
    point = start.copy()
    for _ in range(20_000):  # slowly downhill, elbow up
        ways = [(step, 0), (-step, 0), (0, step), (0, -step)]
        values = [_energy(*(point + way), 1) for way in ways]
        if any(math.isnan(value) for value in values):
            break
        assert min(values) < _energy(*point, 1), "there is a rest elbow up"
        point = point + ways[int(np.argmin(values))]
    assert any(math.isnan(value) for value in values)
    grid = np.linspace(-0.05, 0.05, 101)
    values = [[_energy(1.96 + i, 0.93 + j, -1) for j in grid] for i in grid]
    i, j = np.unravel_index(np.argmin(values), (101, 101))
    assert 0 < i < 100
    assert 0 < j < 100

    result = md.solve(DATA / "five-bar-two-springs.toml", "rest")
    assert result.bodies["l1"].angle[0] == pytest.approx(1.96 + grid[i], abs=6e-4)
    assert result.bodies["l4"].angle[0] == pytest.approx(0.93 + grid[j], abs=6e-4)
    assert result.summary["sketched_mode"] is False
    (note,) = result.summary["notes"]
    assert "lies on another mode" in note
    assert "let go the mechanism leaves it" in note


def test_the_mode_can_be_asked_for() -> None:
    case, generator = equilibria.drawn(3)
    problem = from_dict(case.data(generator))
    sketched = md.solve(problem, "rest")
    label = sketched.summary["mode"]
    other = {"+": "-", "-": "+"}[label]
    turned = md.solve(problem, "rest", mode=other)
    assert {entry["mode"] for entry in sketched.summary["equilibria"]} == {"+", "-"}
    assert turned.summary["mode"] == other
    with pytest.raises(UnknownName, match="the modes here are"):
        md.solve(problem, "rest", mode="++")
