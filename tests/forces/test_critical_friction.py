"""How much more friction a wedge bears, to both sides: bounded in steps, told up to where."""

from __future__ import annotations

from math import pi, radians, tan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.forces import friction_branches
from tests.reference.wedge import efforts
from tests.shared.planting import Slip, plant

FILE = Path(__file__).parents[1] / "data" / "friction" / "wedge-lifts.toml"


def found(task: str, **values: float) -> md.Result:
    return md.solve(md.load(FILE).with_values(values), task)


def jams(slope: float, mu: float) -> float:
    """Factor at which a push lifts no more: slope and two angles of friction are a right angle."""
    return tan((pi / 2 - slope) / 2) / mu


def test_a_wedge_that_locks_itself_is_pulled_out() -> None:
    slope = radians(8)
    ((lift, _),), ((lower, _),) = (efforts(slope, 0.2, 2000.0, sense) for sense in (-1, 1))
    assert lower == pytest.approx(509.7707667, abs=1e-7)
    assert found("lift").efforts["floor.slide"] == pytest.approx(lift, rel=1e-12)
    down = found("lower")
    assert down.efforts["floor.slide"] == pytest.approx(lower, rel=1e-12)
    assert down.summary["critical_factor"] == {
        "factor": None, "at": None, "joint": None, "up_to": 1000.0
    }  # fmt: skip
    for factor in np.geomspace(1.0, 1000.0, 31):  # with more friction it is pulled out too
        assert efforts(slope, 0.2 * factor, 2000.0, 1)


@pytest.mark.parametrize("seed", range(12))
def test_random_wedges(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lifting jams at the angle of the textbooks, pulling out never does; few steps are taken."""
    rng = np.random.default_rng(seed)
    degrees, mu = rng.uniform(3, 30), rng.uniform(0.05, 0.35)
    counts: list[int] = []
    follow = friction_branches.Branches._follow
    monkeypatch.setattr(
        friction_branches.Branches,
        "_follow",
        lambda *own: (counts.append(1), follow(*own))[1],
    )
    up = found("lift", al_deg=degrees, mu=mu).summary["critical_factor"]
    assert up["factor"] == pytest.approx(jams(radians(degrees), mu), rel=2e-6)
    assert up["up_to"] is None
    down = found("lower", al_deg=degrees, mu=mu).summary["critical_factor"]
    assert (down["factor"], down["up_to"]) == (None, 1000.0)
    assert len(counts) < 200


def test_a_search_that_runs_out_of_steps_says_how_far_it_came(
    monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(friction_branches, "ROUNDS", 5)
    for task in ("lift", "lower"):
        own = found(task).summary["critical_factor"]
        assert own == {"factor": None, "at": None, "joint": None, "up_to": 31 / 16}
    from mechdae.cli import main

    main(["solve", str(FILE), "--task", "lower", "--quiet"])
    assert "not up to 1.9375 times the friction given" in capsys.readouterr().out


def test_planted_steps_from_the_last_sizes_alone_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sizes that fall as 1/factor: from the last ones no long step is found."""
    monkeypatch.setattr(friction_branches, "ROUNDS", 60)
    assert found("lower").summary["critical_factor"]["up_to"] == 1000.0
    right = "share * sizes[going[again]]"
    plant(Slip("forces.friction_branches", right, right[8:], lambda: 0.0, ""), monkeypatch)
    assert found("lower").summary["critical_factor"]["up_to"] < 100.0
