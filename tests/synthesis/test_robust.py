"""Robust goals: beside Monte Carlo by closed forms, jobs, goals of all kinds, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.tasks.goals import Maximise, Minimise
from mechdae.design.synthesis.robust.values import of_squares
from tests.reference.deviated import SAMPLES
from tests.scripts.robust_goals import FACTOR, compared
from tests.shared.paths import ROOT
from tests.shared.robust_cases import CASES, LENGTHS, Case

ARC, SLIDE, LOSS = CASES[0], CASES[2], CASES[4]
DATA = json.loads((ROOT / "docs/data/robust.json").read_text())["records"]


# -- the formula -----------------------------------------------------------------------------------


def test_mean_and_sigma_of_a_sum_of_squares_by_samples() -> None:
    """Linear residuals of even deviations: the moments are exact, samples of them are not."""
    generator = np.random.default_rng(5)
    errors, slopes = generator.normal(size=(4, 2)), generator.normal(size=(4, 2, 3))
    weights = np.array([1.0, 2.0, 0.5, 1.0])
    value, parts = of_squares(errors, slopes, weights, 2.0)
    steps = generator.uniform(-np.sqrt(3), np.sqrt(3), (400_000, 3))
    moved = errors + np.einsum("kmt,nt->nkm", slopes, steps)
    total = np.einsum("k,nkm->n", weights, moved**2)
    assert parts["nominal"] == pytest.approx(weights @ (errors**2).sum(axis=1), rel=1e-14)
    assert parts["mean"] == pytest.approx(total.mean(), rel=5e-3)
    assert parts["sigma"] == pytest.approx(total.std(), rel=5e-3)
    assert value == pytest.approx(parts["mean"] + 2 * parts["sigma"], rel=1e-14)


# -- beside closed forms ---------------------------------------------------------------------------


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_robust_values_are_those_of_samples(case: Case) -> None:
    count = SAMPLES if case is not LOSS else 10_000
    own = compared(case, 1.0, count)
    assert abs(own["off"]) < 0.01
    committed = next(r for r in DATA if r["case"] == case.name and r["scale"] == 1.0)
    assert own["value"] == pytest.approx(committed["value"], rel=1e-5)


def test_committed_samples_are_within_one_percent() -> None:
    assert {record["case"] for record in DATA} == {case.name for case in CASES}
    for record in DATA:
        assert record["samples"] == SAMPLES == 100_000
        if record["scale"] == 1.0:
            assert abs(record["value"] / record["monte_carlo"] - 1) < 0.01


def test_the_table_of_the_docs_is_the_committed_one() -> None:
    text = (ROOT / "docs/theory/evidence/synthesis.md").read_text(encoding="utf-8")
    table = text.partition("<!-- robust -->\n")[2].partition("<!-- end of robust -->")[0]
    assert table.splitlines() == [
        f"| {r['case']} | {r['scale']:g} | {r['nominal']:.5g} | {r['sigma']:.4g} "
        f"| {r['value']:.6g} | {r['monte_carlo']:.6g} | {100 * r['off']:+.2f} % |"
        for r in DATA
    ]


def test_a_robust_design_is_better_than_the_nominal_one_when_both_deviate() -> None:
    robust = ARC.problem(FACTOR)
    plain = replace(robust.tasks["design"], robust=None, tolerances=None)
    one, other = (
        md.synthesize(problem, "design").data["designs"][0]
        for problem in (robust, robust.with_task("design", plain))
    )
    assert "robust" not in other
    found = [ARC.sampled(own["parameters"], LENGTHS, FACTOR, SAMPLES) for own in (one, other)]
    assert found[0] < 0.9 * found[1]
    assert one["robust"][0]["nominal"] > other["objective"]


# -- jobs ------------------------------------------------------------------------------------------


def answer(result: Any) -> dict[str, Any]:
    found = json.loads(json.dumps(result.to_dict()))
    found["summary"].pop("seconds")
    return found


def test_a_robust_job_goes_on_and_has_the_same_bits_in_two_workers(tmp_path: Path) -> None:
    problem = ARC.problem(FACTOR)
    whole = answer(md.synthesize(problem, "design", out=tmp_path))
    log = tmp_path / "starts.jsonl"
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:3]) + lines[3][:-9])  # killed while a line was written
    assert answer(md.synthesize(problem, "design", out=tmp_path)) == whole
    assert answer(md.synthesize(problem, "design", workers=2)) == whole


# -- goals of all kinds ----------------------------------------------------------------------------


def changed(name: str, widths: dict[str, float], **changes: Any) -> Any:
    problem = md.load(name)
    own = {"robust": 2, "tolerances": widths, "keep": 1, "starts": 2, **changes}
    return problem.with_task("design", replace(problem.tasks["design"], **own))


def of_measure(name: str, measure: str) -> Any:
    return replace(md.load(name).tasks["design"].goal, measure=measure)


@pytest.mark.parametrize(
    "problem",
    [
        changed("burmester5-public", {"la": 0.01, "ux": 0.01, "bx": 0.01},
                goal=of_measure("burmester5-public", "least-squares")),
        changed("wishbone-poses", {"rod": 1e-4, "knuckle.steer.x": 1e-4}),
        changed("rssr-path", {"l": 1e-4, "tw": 1e-3}),
    ],
    ids=lambda problem: problem.name,
)  # fmt: skip
def test_poses_and_paths_in_plane_and_space(problem: Any) -> None:
    """What the NLP has and the derivatives of a task of sensitivity of the design are one."""
    result = md.synthesize(problem, "design")
    best = result.data["designs"][0]
    parts = best["robust"][0]
    assert best["objective"] == parts["value"] == parts["mean"] + 2 * parts["sigma"]
    assert best["objective"] == pytest.approx(min(result.summary["objectives"]), rel=1e-6)
    assert parts["nominal"] < parts["mean"]


@pytest.mark.parametrize(
    "problem",
    [
        changed("fg4-exp-0-1-90-90", {"a": 1e-3, "c": 1e-3, "ground.B0.x": 1e-3}),
        changed("straight-180-1-4", {"r2": 1e-3, "r3": 1e-3}),
        changed("slider-crank-least-loss", {"l": 2e-3, "e": 1e-3, "Q_work": 20}, starts=1,
                goal=Minimise(of="cycle/efforts/crank.angle", reduce="rms")),
        changed("slider-crank-least-loss", {"l": 2e-3, "e": 1e-3}, starts=1,
                goal=Minimise(of="cycle/bodies/rod/angular_velocity")),
        changed("slider-crank-least-loss", {"l": 2e-3, "e": 1e-3}, starts=1,
                goal=Maximise(of="cycle/joints/slide/slide")),
    ],
    ids=["function", "straight-line", "root mean square", "peak", "least"],
)  # fmt: skip
def test_other_goals_are_what_the_sweep_says(problem: Any) -> None:
    result = md.synthesize(problem, "design")
    best = result.data["designs"][0]
    parts = best["robust"][0]
    reached = result.summary["objectives"]
    assert best["objective"] == parts["value"] == pytest.approx(abs(min(reached)), rel=1e-2)
    assert parts["sigma"] > 0


def test_an_objective_of_a_front_is_robust_beside_one_that_is_not() -> None:
    problem = ARC.problem(FACTOR)
    turn = replace(problem.tasks["turn"], measures=("transmission",))
    problem = problem.with_task("turn", turn)
    task = problem.tasks["design"]
    objectives = (task.goal, Maximise(of="turn/joints/B/transmission_angle"))
    task = replace(task, goal=None, objectives=objectives, starts=4, keep=4)
    result = md.synthesize(problem.with_task("design", task), "design")
    (note,) = result.summary["notes"]
    assert note.startswith("a transmission angle (turn/joints/B/transmission_angle)")
    assert len(result.data["designs"]) >= 3
    for design in result.data["designs"]:
        value = ARC.sampled(design["parameters"], LENGTHS, FACTOR, SAMPLES)
        assert design["objectives"][0] == pytest.approx(value, rel=0.01)
        assert design["robust"][1] is None


def test_the_table_has_what_a_robust_value_is_made_of() -> None:
    text = str(md.synthesize(ARC.problem(FACTOR), "design"))
    heads = [word for word in text.splitlines()[1].split() if not word.startswith("[")]
    assert heads[:4] == ["design", "objective", "nominal", "sigma"]


# -- what is refused -------------------------------------------------------------------------------


def test_what_no_robust_goal_takes() -> None:
    problem = ARC.problem(FACTOR)
    task = problem.tasks["design"]
    exact = replace(task.goal, measure="exact")
    for changes, where, words in (
        ({"robust": -1.0}, "robust", "not negative"),
        ({"tolerances": None}, "robust", "tolerances are needed"),
        ({"tolerances": {}}, "robust", "tolerances are needed"),
        ({"tolerances": {"r1": 0.0}}, "tolerances", "no tolerance is above zero"),
        ({"tolerances": {"r9": 0.1}}, "tolerances.r9", "unknown parameter 'r9'"),
        ({"tolerances": {"r1": -0.1}}, "tolerances.r1", "not negative"),
        ({"robust": None}, "tolerances", "alone change nothing"),
        ({"tolerances": {"r1_deg": 1}}, "tolerances.r1_deg", "deg"),
        ({"robust": "x"}, "robust", "unknown name 'x'"),
        ({"tolerances": {"coupler.P.x": 0.1}}, "tolerances.coupler.P.x", "follows from others"),
        (
            {"tolerances": {"ground.A0.x": 0.1, "coupler.A.y": 0.1, "rocker.mass": 1.0}},
            "tolerances.rocker.mass",
            "rocker.mass",
        ),
        ({"tolerances": {"crank.mass": 0.1}}, "tolerances.crank.mass", "crank.mass"),
        ({"goal": exact}, "robust", "met or not"),
    ):
        with pytest.raises(md.MechdaeError, match=words) as caught:
            md.synthesize(problem.with_task("design", replace(task, **changes)), "design")
        assert caught.value.where == f"tasks.design.{where}"


def test_goals_without_deviations_are_refused_by_name() -> None:
    problem = changed("c1-exact-max-mu", {"r1": 0.1})
    with pytest.raises(md.UnavailableError, match="transmission angle") as caught:
        md.synthesize(problem, "design")
    assert caught.value.where == "tasks.design.robust"
    with pytest.raises(md.InputError, match="'phi0' is where a scale starts"):
        md.synthesize(changed("fg4-exp-0-1-90-90", {"phi0": 0.01}), "design")
