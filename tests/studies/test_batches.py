"""Many sets at once: each row is what the set gives alone, whatever happens to the others."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from benchmarks.batches import page as measures_and_forces
from benchmarks.studies import page as measured
from mechdae.design.studies.batches import screening
from tests.shared.paths import DOCS

FINE = ("ok", "limit")


def drawn(problem: md.Problem, names: list[str], share: float, count: int, seed: int) -> dict:
    rng = np.random.default_rng(seed)
    base = problem.mechanism.values()
    return {n: (base[n] * (1 + share * rng.uniform(-1, 1, count))).tolist() for n in names}


def alone(problem: md.Problem, values: dict[str, float], path: str) -> tuple[str, object, float]:
    """Return status, series and the bound of its positions of one set."""
    try:
        result = md.solve(problem, "turn", set=values)
    except md.MechdaeError:
        return "unassembled", None, 0.0
    words = [str(word) for word in result.status if word not in FINE]
    bounds = [np.nanmax(part, initial=0.0) for part in result.bound.values()]
    return (words[0] if words else "ok"), np.array(result.value(path), float), max(bounds)


def differences(problem: md.Problem, samples: dict, path: str) -> tuple[list[str], md.Result]:
    """Return what rows of a study have otherwise than their sets alone, and the study."""
    study = md.Study(samples=samples, of="turn", outputs=(path,))
    result = md.solve(problem, study)
    faults = []
    for k, row in enumerate(result.table[path]):
        values = {name: own[k] for name, own in samples.items()}
        status, series, bound = alone(problem, values, path)
        if result.status[k] != status:
            faults.append(f"{k}: {result.status[k]}, alone {status}")
        elif series is None:
            faults += [] if np.isnan(row).all() else [f"{k}: values where none assembles"]
        elif np.any(np.isnan(row) != np.isnan(series)):
            faults.append(f"{k}: poses lost or found")
        else:
            rates = path.rpartition("/")[2] not in ("position", "angle", "slide")
            bound = 1e-9 * np.nanmax(np.abs(series), initial=0.0) if rates else 2 * bound
            if np.all(np.isnan(row) | (np.abs(row - series) <= bound)):
                continue
            faults.append(f"{k}: {np.nanmax(np.abs(row - series)):.2g}, bound {bound:.2g}")
    return faults, result


def jansen(poses: int = 60, **keys) -> md.Problem:
    problem = md.load("jansen-leg")
    return problem.with_task("turn", replace(problem.tasks["turn"], poses=poses, **keys))


LENGTHS = list("abcdefghijklm")


@pytest.mark.parametrize("path", ["points/lower.P/position", "bodies/bar_c/angle"])
def test_legs_with_limits_inside_the_turn_are_what_they_are_alone(path: str) -> None:
    """A quarter of the legs lock; bodies before the dyad that opens keep their values."""
    problem = jansen()
    faults, result = differences(problem, drawn(problem, LENGTHS, 0.06, 24, 3), path)
    assert faults == []
    assert {"ok", "unassembled"} == set(result.status)
    assert result.summary["work"]["alone"] <= 1


def test_legs_that_do_not_assemble_at_all() -> None:
    problem = jansen()
    faults, result = differences(
        problem, drawn(problem, LENGTHS, 0.4, 24, 5), "points/lower.P/velocity"
    )
    assert faults == []
    assert np.isnan(result.table["points/lower.P/velocity"]).all(axis=(1, 2)).any()


@pytest.mark.parametrize(
    ("first", "to", "sketch"), [(0.0, 2 * np.pi, 1.0), (6.0, -1.0, 2.0), (-4.0, 9.0, -1.2)]
)
def test_poses_reached_the_other_way_round(first: float, to: float, sketch: float) -> None:
    """The crank of a double rocker turns back at both limits; poses beyond may be reached."""
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": ("d", 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": ("a", 0)}),
            md.Body("coupler", {"B": (0, 0), "C": ("b", 0)}),
            md.Body("rocker", {"D": (0, 0), "C": ("c", 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        parameters={"a": 0.07, "b": 0.12, "c": 0.08, "d": 0.1, "from": first, "at": sketch},
        sketch={"crank": "at", "coupler": 0.3, "rocker": 1.4},
    )
    turn = md.Sweep(md.Driver("crank.angle", from_=first, to=to), poses=41)
    problem = md.Problem(mechanism, {"turn": turn})
    samples = drawn(problem, ["a", "b", "c", "d", "at"], 0.15, 20, 7)
    faults, result = differences(problem, samples, "bodies/rocker/angle")
    assert faults == []
    assert result.summary["work"]["alone"] <= 2


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("slider-crank-offset", "joints/slide/slide_acceleration"),
        ("whitworth-quick-return", ""),
        ("gorshkov-seven-link", ""),
        ("klann-leg", ""),
        ("stephenson-six-bar", ""),
        ("rack-and-pinion", ""),
    ],
)
def test_dyads_of_all_kinds(name: str, path: str) -> None:
    problem = md.load(name)
    turn = next(
        task
        for task in problem.tasks.values()
        if type(task) is md.Sweep and len(task.all_drivers) == 1
    )
    driver = turn.all_drivers[0]
    if driver.range is not None or driver.from_ is None:
        driver = replace(driver, range=None, at=None, from_=0.0, to=6.0)
    turn = replace(turn, driver=driver, poses=25, outputs=None)
    problem = problem.with_task("turn", turn)
    names = [n for n, own in problem.mechanism.parameters.items() if isinstance(own, float)]
    first = md.solve(problem, "turn")
    body = list(first.bodies)[-1]
    path = path if path and "slide" in first.joints else f"bodies/{body}/angular_velocity"
    faults, _ = differences(problem, drawn(problem, names, 0.05, 16, 11), path)
    assert faults == []


def test_sets_that_make_no_mechanism_are_named_and_the_rest_computed() -> None:
    problem = jansen(20)
    samples = drawn(problem, LENGTHS, 0.01, 6, 2)
    samples["m"][1] = 0.0  # a crank of no length
    samples["d"][4] = 0.2  # no triangle: a square root of a negative number
    study = md.Study(samples=samples, of="turn", outputs=("points/lower.P/position",))
    result = md.solve(problem, study)
    assert [entry["set"] for entry in result.summary["faults"]] == [1, 4]
    assert np.isfinite(result.table["points/lower.P/position"]).all(axis=(1, 2)).tolist() == [
        *[True, False, True, True, False, True]
    ]


def test_sets_screened_in_parts_are_those_screened_at_once(monkeypatch) -> None:
    problem = md.load("four-bar-crank-rocker")
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=9))
    path = "bodies/rocker/angle"
    samples = drawn(problem, list("abcd"), 0.03, 7, 3)
    study = md.Study(samples=samples, of="turn", outputs=(path,), certify=False)
    whole = md.solve(problem, study).table[path]
    monkeypatch.setattr(screening, "AT_ONCE", 20)
    parts = md.solve(problem, study).table[path]
    assert np.array_equal(parts, whole)
    alone = md.solve(problem, "turn", set={name: own[-1] for name, own in samples.items()})
    assert np.abs(parts[-1] - alone.bodies["rocker"].angle).max() < 1e-14


def test_the_page_shows_what_was_measured() -> None:
    records = json.loads((DOCS / "data/studies.json").read_text(encoding="utf-8"))
    assert measured(records) in (DOCS / "theory/evidence/solver.md").read_text(encoding="utf-8")
    assert all(own["error"] < 1e-13 and own["screened_error"] < 1e-12 for own in records)


def test_the_page_shows_measures_and_forces() -> None:
    records = json.loads((DOCS / "data/batches.json").read_text(encoding="utf-8"))
    assert measures_and_forces(records) in (DOCS / "theory/evidence/solver.md").read_text(
        encoding="utf-8"
    )
    assert all(own["error"] < 1e-12 for own in records)
    assert all(own["per_second"] > own["one_by_one"] for own in records)
