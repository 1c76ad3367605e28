"""The measurement of sweeps and of whole tasks, with other methods beside: never seconds."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

import mechdae as md
from benchmarks import four_bar
from benchmarks.__main__ import main
from mechdae.motion.kinematics.prepared import SHAPES, prepare
from mechdae.parts.bench import kinematics, tasks

KEYS = {"work", "n", "ratio", "yardstick", "error", "seconds", "method", "setting"}
CRANK = np.linspace(0.0, 2 * np.pi, 37)


def test_other_means_are_never_nearer_to_the_truth(capsys, tmp_path) -> None:
    """Fewer nodes, looser tolerances."""
    assert main(["slider-crank", "--quick", "--out", str(tmp_path)]) == 0
    assert "yardstick" in capsys.readouterr().out
    records = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    assert all(set(record) >= KEYS for record in records)
    ours = next(record["error"] for record in records if record["method"] == kinematics.WARM)
    for method in ("interpolated", "rootfinder"):
        others = [record["error"] for record in records if record["method"] == method]
        assert len(others) == 4
        assert others[0] > 10 * others[-1] > 10 * ours
    assert (tmp_path / "bench.svg").stat().st_size > 5000


def test_a_first_call_has_nothing_kept_and_others_have_other_numbers() -> None:
    """Calls are counted: three ways at each size, each with numbers that none had before."""
    item = kinematics.standard()[0]
    problem = item.problem.with_task(kinematics.TASK, item.of(5))
    kinematics.solve(problem, kinematics.TASK)
    assert len(SHAPES)
    kept = kinematics.timed_first(lambda: len(SHAPES) and pytest.fail("something is kept"))
    assert kept >= 0
    sets = kinematics.sets_of(problem, item.changed)
    values = [next(sets)["b"] for _ in range(5)]
    assert len(set(values)) == 5
    assert np.allclose(values, 0.09, rtol=1e-5)
    (alone,) = item.of(1).all_drivers[0].at
    assert alone == pytest.approx(2 * np.pi / 3)


@pytest.mark.parametrize("n", [1, 37])
def test_the_package_and_other_means_agree_on_the_four_bar(n: int) -> None:
    """Errors against the closed form in 80-bit floats; fsolve stops at its own tolerance."""
    item = kinematics.standard()[0]
    result = md.solve(item.problem, item.of(n))
    crank = result.drivers["crank.angle"].position
    angles = [result.bodies[name].angle for name in ("coupler", "rocker")]
    assert four_bar.off(angles, crank) < 2e-15
    found = {other.method: other.error(other.way()) for other in four_bar.others(crank)}
    if four_bar.compiled() is not None:
        assert found["closed form in C"] < 1e-14
    if "scipy fsolve" in found:
        assert found["scipy fsolve"] < 1e-7
    assert found.get("pylinkage", 0.0) < 1e-12


def test_an_error_of_another_method_is_seen() -> None:
    from mechdae.parts.bench.runs import yardstick

    angles = np.array(yardstick(CRANK)[:2])
    assert four_bar.off(angles + 2 * np.pi, CRANK) < 1e-14, "whole turns are no error"
    angles[1, 3] += 1e-6
    assert four_bar.off(angles, CRANK) == pytest.approx(1e-6, rel=1e-6)


def test_what_is_not_there_is_left_out(monkeypatch) -> None:
    for name in ("scipy", "scipy.optimize", "pylinkage", "pylinkage.actuators"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(four_bar, "compiled", lambda: None)
    assert list(four_bar.others(CRANK)) == []


def test_whole_tasks_have_the_error_against_what_files_expect() -> None:
    records = tasks.measure(tasks.QUICK_WORKS, repeats=1, sets=4)
    assert all(set(record) >= KEYS for record in records)
    first = records[:3]
    assert [record["method"] for record in first] == list(kinematics.OURS)[:3]
    assert {record["n"] for record in first} == {361}
    assert all(record["error"] < 1e-12 for record in records)
    assert records[-1]["n"] == 4
    assert "study" in tasks.table(records)


def test_a_value_that_is_off_is_an_error() -> None:
    problem = md.load("slider-crank-inertia")
    assert tasks.off_expected(problem, "cycle") < 1e-12
    other = problem.with_values({"m_slider": problem.mechanism.values()["slider.mass"] * 1.01})
    assert tasks.off_expected(other, "cycle") > 1e-4


def test_a_spatial_four_bar_costs_no_more_than_a_planar_one() -> None:
    """Work is counted, not timed: instructions of a pose with rates, certificate and bounds."""
    counts = []
    for item in (kinematics.standard()[0], kinematics.spatial()):
        setting = prepare(item.problem, item.of(100))
        counts.append(setting.graphs.pose.n_instructions())
    assert counts[1] <= 1.5 * counts[0]
    record = kinematics.measure(kinematics.spatial(), (100,), 1)[0]
    assert record["error"] <= 1e-15
    assert record["not_ok"] == 0
