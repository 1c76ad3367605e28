"""Ends and holes of fronts, and numbers of the user's with kinks, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.tasks.goals import Minimise
from mechdae.describe.values import Table
from mechdae.design.synthesis import pareto as front
from mechdae.design.synthesis.fronts import census, holes, missing
from mechdae.design.synthesis.nlp import kinked, rounded
from mechdae.design.synthesis.synthesize import solved_in_rounds
from tests.shared.paths import DATA

FILE = DATA / "synthesis" / "front-error-size.toml"
SIZE = "turn/outputs/size/value"
LEAST = np.radians(25)


def smallest() -> float:
    """Return the least r1 + r2 + r3 + r4 of a crank-rocker of the file, with P in the crank's pin.

    With r2 at its bound and r3 = r4 = r the transmission angle is 25 degrees at both ends where
    r1 - r2 = 2 r sin 12.5 deg and r1 + r2 = 2 r cos 12.5 deg.
    """
    s, c, r2 = np.sin(LEAST / 2), np.cos(LEAST / 2), 0.01
    r = r2 / (c - s)
    return r2 + (r2 + 2 * r * s) + 2 * r


def test_the_closed_form_is_the_least() -> None:
    """By a grid over unequal links: for each pair the shortest ground that keeps both angles."""
    r3, r4 = np.meshgrid(*[np.linspace(0.01, 0.03, 401)] * 2)
    near = np.sqrt(r3**2 + r4**2 - 2 * r3 * r4 * np.cos(LEAST))
    far = np.sqrt(r3**2 + r4**2 + 2 * r3 * r4 * np.cos(LEAST))
    r1 = 0.01 + near
    total = np.where(r1 + 0.01 <= far, r1 + 0.01 + r3 + r4, np.inf)
    assert smallest() - 1e-9 <= total.min() <= smallest() + 2e-4


def sized(expression: str, **changes) -> md.Problem:
    problem = md.load(FILE)
    mechanism = replace(problem.mechanism, outputs={"size": expression})
    task = replace(problem.tasks["front"], **changes)
    return replace(problem, mechanism=mechanism).with_task("front", task)


@pytest.mark.parametrize(
    "far", ["hypot(px, py)", "abs(px) + abs(py)", "max(abs(px), abs(py))", "sqrt(px**2 + py**2)"]
)
def test_sizes_with_kinks_at_their_least(far: str) -> None:
    """The least size is where the last term has no derivative: the other terms are smooth."""
    goal = Minimise(of=SIZE)
    problem = sized(f"r1 + r2 + r3 + r4 + {far}", objectives=None, goal=goal, starts=2, keep=1)
    found = md.synthesize(problem)
    assert found.fault is None
    best = found.data["designs"][0]
    assert abs(best["objective"] - smallest()) <= 1e-6
    assert abs(best["parameters"]["px"]) <= 1e-6


def test_both_ends_of_a_front_with_a_kink_are_found() -> None:
    found = md.synthesize(sized(FRONT, starts=6, keep=3))
    assert found.summary["status"] == "found"
    points = np.array(found.summary["front"]["points"])
    assert abs(points[-1, 1] - smallest()) <= 1e-6
    assert points[0, 0] <= 1.6262e-6 * (1 + 1e-3)  # tabled by sixty starts of the path alone
    ends = found.summary["front"]["ends"]
    assert [end["starts"] for end in ends] == [3, 3]
    assert all(end["found"] and end["hits_of_best"] for end in ends)
    assert "part of a front" not in str(found)


FRONT = "r1 + r2 + r3 + r4 + hypot(px, py)"


def test_an_end_that_is_not_found_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no start of an objective alone meets the constraints the front is a part of one."""
    calls = []

    def failing(*arguments):
        jobs, optima = solved_in_rounds(*arguments)
        calls.append(len(jobs))
        if len(calls) == 2:
            word = "Maximum_Iterations_Exceeded"
            optima = [replace(own, status=word, violation=1.0) for own in optima]
        return jobs, optima

    monkeypatch.setattr(front, "solved_in_rounds", failing)
    monkeypatch.setattr(front, "finished", lambda *arguments: 0)
    found = md.synthesize(sized("r1 + r2 + r3 + r4", starts=4, keep=2))
    assert found.summary["status"] == "part of a front"
    assert not found.summary["front"]["ends"][1]["found"]
    (note,) = [own for own in found.summary["notes"] if "the end of objective 2" in own]
    assert f"{calls[1]} maximum iterations exceeded" in note
    assert "part of a front" in str(found)


# -- kinks ---------------------------------------------------------------------------------------

FORMULAS = {
    "hypot": (lambda x, y: ca.sqrt(x * x + y * y), np.hypot),
    "abs": (lambda x, y: ca.fabs(x) + 2 * ca.fabs(y), lambda x, y: abs(x) + 2 * abs(y)),
    "max": (lambda x, y: ca.fmax(x, y), np.maximum),
    "min": (lambda x, y: ca.fmin(x, y) + x, lambda x, y: np.minimum(x, y) + x),
    "both": (
        lambda x, y: ca.fmax(ca.fabs(x - y), ca.sqrt(x * x + y * y)),
        lambda x, y: np.maximum(abs(x - y), np.hypot(x, y)),
    ),
}


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("name", FORMULAS)
def test_rounded_kinks(name: str, size: float) -> None:
    """Off by no more than a few shares of their size, and smooth at the kink itself."""
    make, exact = FORMULAS[name]
    x, y, soft = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("soft")
    function = ca.Function("f", [x, y], [make(x, y)])
    assert kinked(function)
    assert not kinked(ca.Function("g", [x, y], [x * y + ca.sin(x)]))
    rng = np.random.default_rng(5)
    samples = size * rng.uniform(-1, 1, (9, 2))
    own = rounded(function, (samples[:, :1], samples[:, 1:]), (x, y), soft)
    both = ca.Function("r", [x, y, soft], [own, ca.hessian(own, ca.vertcat(x, y))[0]])
    for share in (1e-2, 1e-6):
        for a, b in [*(size * rng.uniform(-1, 1, (40, 2))), (0.0, 0.0), (size, size), (0.0, size)]:
            value, bend = (np.array(part) for part in both(a, b, share))
            assert abs(value.item() - exact(a, b)) <= 4 * share * size
            assert np.isfinite(bend).all()


# -- words ---------------------------------------------------------------------------------------


def test_holes_by_hand() -> None:
    """Eleven even gaps; a point taken out leaves two, three taken out a hole."""
    points = np.array([[k, 11.0 - k] for k in range(12)])
    assert holes(points, 12) == []
    assert holes(np.delete(points, [5], axis=0), 12) == []
    (hole,) = holes(np.delete(points, [4, 5, 6], axis=0), 12)
    assert (hole.first.tolist(), hole.last.tolist()) == ([3, 8], [7, 4])
    assert (hole.width, hole.middle.tolist()) == (4 / 11, [5.0, 6.0])
    logs = np.array([[10.0**k, 11.0 - k] for k in range(12)])
    assert holes(logs, 12) == []
    (hole,) = holes(np.delete(logs, [4, 5, 6], axis=0), 12)
    assert hole.middle == pytest.approx([1e5, 6.0])
    assert holes(points[:1], 12) == []
    assert holes(np.array([[1.0, 1.0], [2.0, 2.0]]), 12) == []  # one dominates


def test_holes_of_three_objectives_by_hand() -> None:
    """A grid of x and y with 2 - x - y: neighbours are those with nothing in the ball between."""
    x, y = (own.ravel() / 6 for own in np.meshgrid(np.arange(7), np.arange(7)))
    points = np.stack([x, y, 2 - x - y], axis=1)
    assert holes(points, 28) == []  # five levels in each, six even gaps
    near = np.abs(points[:, :2] - 0.5).max(axis=1)
    assert holes(points[near > 0.1], 28) == []  # one taken out
    found = holes(points[near > 0.35], 28)  # 25 of 49 taken out: what is left is the rim
    assert {round(hole.width, 12) for hole in found} <= {round(5 / 6, 12), 1.0}
    assert all(hole.middle.sum() == pytest.approx(2) for hole in found)
    wide = [h for h in found if h.middle[:2] == pytest.approx([0.5, 0.5])]
    assert wide
    assert holes(points[near > 0.35], 9) == []  # three gaps: none is three times as wide


def three(**keys) -> md.Problem:
    """Two lengths of a crank-rocker at their least, and one over their product."""
    problem = md.load(FILE)
    outputs = {"one": "r3", "two": "r4", "three": "0.01/(r3*r4)"}
    turn = replace(problem.tasks["turn"], outputs=tuple(outputs))
    mechanism = replace(problem.mechanism, outputs=outputs)
    goals = [Minimise(of=f"turn/outputs/{name}/value") for name in outputs]
    task = problem.tasks["front"]
    keys |= {"objectives": goals, "constraints": task.constraints[:1]}
    task = replace(task, free={"r3": (0.1, 0.13), "r4": (0.1, 0.13)}, **keys)
    whole = replace(problem, mechanism=mechanism, tasks=Table({"turn": turn}))
    return whole.with_task("front", task)


def test_a_hole_of_three_objectives_is_filled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without levels the front is its ends: two pairs of lengths, and what is sought between."""
    levels = front.FrontSearch.levels
    monkeypatch.setattr(front.FrontSearch, "levels", lambda self, keep: levels(self, 3))
    found = md.synthesize(three(starts=3, keep=28)).summary["front"]
    points = np.array(found["points"])
    assert points[:, 2] == pytest.approx(0.01 / (points[:, 0] * points[:, 1]), rel=1e-6)
    assert len(points) >= 4
    gaps = [np.ptp([hole["first"], hole["last"]], axis=0).max() for hole in found["holes"]]
    assert max(gaps, default=0) < 0.7 * np.ptp(points, axis=0).max()
    monkeypatch.setattr(front, "TURNS", 0)
    left = md.synthesize(three(starts=3, keep=28)).summary["front"]
    assert (len(left["points"]), len(left["holes"]), left["holes"][0]["starts"]) == (2, 1, 0)


def test_the_census_of_an_end() -> None:
    def run(part: str, status: str, solved: bool) -> dict:
        return {"part": part, "status": status, "solved": solved}

    runs = [
        run("objective 1", "Solve_Succeeded", True), run("objective 1", "Out", False),
        run("objective 2", "Out", False), run("level", "Solve_Succeeded", True),
    ]  # fmt: skip
    terms = [np.array([1.0, 9.0]), None, np.array([5.0, 4.0]), np.array([3.0, 2.0])]
    first = census(runs, terms, 0, 1.0, 4.0)
    assert (first["starts"], first["met"], first["hits_of_best"], first["found"]) == (2, 1, 1, True)
    second = census(runs, terms, 1, 2.0, 7.0)
    assert (second["met"], second["hits_of_best"], second["found"]) == (1, 0, False)
    assert "better values were found at other levels" in missing(1, second)
    third = census(runs, [None] * 4, 1, 2.0, 7.0)
    assert "none met all constraints" in missing(1, third)
    unsolved = census(runs, terms, 1, 4.0, 7.0)  # the best, but where the search broke off
    assert (unsolved["hits_of_best"], unsolved["found"]) == (1, False)
    assert "did not end at an optimum" in missing(1, unsolved)
