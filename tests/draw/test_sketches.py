"""Diagrams of mechanisms that nothing is asked of: the assembled sketch."""

from __future__ import annotations

import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.expression import evaluate
from mechdae.describe.values import Table
from mechdae.errors import InputError, MechdaeError
from mechdae.tasks.pictures import with_sketch

NAMES = ("four-bar-crank-rocker", "five-bar-robot", "parallelogram-three-cranks",
         "cam-roller-follower", "rssr", "double-wishbone")  # fmt: skip
BARE = """schema = 1
[ground]
points = { A = [0, 0], D = [4, 0] }
[bodies.crank]
points = { A = [0, 0], B = [1, 0] }
[bodies.coupler]
points = { B = [0, 0], C = [3.5, 0] }
[bodies.rocker]
points = { D = [0, 0], C = [2.5, 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
B = { kind = "revolute", between = ["crank.B", "coupler.B"] }
C = { kind = "revolute", between = ["coupler.C", "rocker.C"] }
D = { kind = "revolute", between = ["ground.D", "rocker.D"] }
"""


@pytest.mark.parametrize("name", NAMES)
def test_a_mechanism_is_drawn_at_its_sketch(name: str) -> None:
    problem = md.load(name)
    bare = with_sketch(md.Problem(problem.mechanism, Table()))
    result = md.solve(bare, "sketch")
    assert list(result.status) == ["ok"]
    sketch = problem.mechanism.sketch
    for driver, series in result.drivers.items():
        own = driver if driver in sketch else driver.split(".")[0]
        assert series.position[0] == evaluate(sketch[own], problem.mechanism.parameter_values)
    assert md.plot(problem.mechanism).get_figure() is not None


def test_a_problem_without_tasks_is_drawn(tmp_path) -> None:
    path = tmp_path / "bare.toml"
    path.write_text(BARE + "[sketch]\ncrank_deg = 60\ncoupler_deg = 20\nrocker_deg = 100\n")
    problem = md.load(path)
    assert md.plot(problem, "diagram").get_figure() is not None
    assert main(["plot", str(path), "--out", str(tmp_path / "a.svg")]) == 0
    assert (tmp_path / "a.svg").read_text(encoding="utf-8").startswith("<?xml")
    with pytest.raises(MechdaeError):
        md.plot(problem, "losses")


def test_a_problem_with_tasks_stays_as_it_is() -> None:
    problem = md.load("four-bar-crank-rocker")
    assert with_sketch(problem) is problem


def test_a_sketch_that_tells_too_little_is_named(tmp_path) -> None:
    path = tmp_path / "bare.toml"
    path.write_text(BARE)
    with pytest.raises(InputError, match="the sketch gives fewer coordinates than 1"):
        md.plot(path)


def test_mechanisms_in_notebooks_are_screens() -> None:
    html = md.load("four-bar-crank-rocker").mechanism._repr_html_()
    assert "<pre>bodies" in html
    assert "B: revolute crank.B - coupler.B" in html
