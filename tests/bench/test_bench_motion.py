"""The measurement of motions: methods, errors and counts, never seconds."""

from __future__ import annotations

import importlib.util
import json
import sys

import numpy as np
import pytest

import mechdae as md
from benchmarks import integrators
from benchmarks.__main__ import main as beside
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.parts.bench import motions
from tests.shared.paths import ROOT

KEYS = {"work", "n", "ratio", "yardstick", "error", "seconds", "method", "tolerance", "drift"}
FREE = ("CVODES Adams", "CVODES BDF", "IDAS")


def measure(work, tolerances):
    return motions.measure(work, tolerances, repeats=1, others=integrators.others)


def pendulum(**keys):
    data = {
        "schema": 1,
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"rod": {"points": {"O": [0, 0]}, "mass": 2.0, "center": [0, -1.5]}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "rod.O"]}},
        "tasks": {"swing": {"kind": "motion", "start": {"rod.angle": 1.0}, "until": 2.0}},
    }
    return from_dict(data | keys)


def test_all_methods_come_to_the_values_of_the_problem() -> None:
    """Andrews' mechanism against references of 34 digits; DOP853 is the same method with scipy."""
    work = motions.work_of(md.load("andrews-squeezer"))
    assert work.reference == "values of the problem"
    records, notes = measure(work, (1e-8,))
    assert all(set(record) >= KEYS for record in records)
    assert records[0]["method"] == motions.OURS
    assert "first" in records[0]
    found = {record["method"]: record for record in records}
    assert found[motions.OURS]["error"] <= 2e-9
    assert found[motions.OURS]["drift"] <= 1e-15
    assert found[motions.OURS]["n"] <= 1000
    for method in (*FREE, "IDAS, index 1"):
        assert 1e-9 <= found[method]["error"] <= 1e-5, method
        assert found[method]["n"] >= 400, method
    assert "x yardstick" in motions.table(records, notes)


def test_with_scipy_its_methods_are_measured() -> None:
    pytest.importorskip("scipy")
    work = motions.work_of(md.load("car-axis"))
    records, notes = measure(work, (1e-6, 1e-10))
    own = [r for r in records if r["method"] == "scipy DOP853"]
    assert [r["error"] <= 1e4 * r["tolerance"] for r in own] == [True, True]
    assert own[1]["n"] > own[0]["n"]
    assert [r["tolerance"] for r in records if r["method"] == "scipy Radau"] == [1e-6]
    assert notes == []


def test_without_scipy_a_note_stands_in_its_place(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.integrate", None)
    records, notes = measure(motions.work_of(pendulum()), (1e-8,))
    assert {record["method"] for record in records} == {motions.OURS, *FREE}
    assert notes == [integrators.NO_SCIPY]


def test_an_error_is_seen() -> None:
    """Without values of the problem a tightened run takes their place; angles count in radians."""
    work = motions.work_of(pendulum())
    assert work.reference == "tightened run"
    end = work.ours(1e-12).x
    assert work.error(end) <= 1e-11
    assert work.error(end + 0.01) == pytest.approx(0.01, abs=1e-9)
    # energy of the swing: the speed at the end from the height alone
    result = md.solve(pendulum(), "swing")
    speed = result.bodies["rod"].angular_velocity[-1]
    wanted = np.sqrt(2 * 9.81 / 1.5 * (np.cos(end[0]) - np.cos(1.0)))
    assert abs(speed) == pytest.approx(wanted, rel=1e-6)


def test_outputs_have_natural_sizes() -> None:
    """A length counts in lengths of the mechanism: a thousandth of the size, the same error."""
    errors = []
    for scale in (1.0, 1e-3):
        problem = pendulum(
            gravity=[0, -9.81 * scale],
            bodies={
                "rod": {
                    "points": {"O": [0, 0], "E": [0, -3 * scale]},
                    "mass": 2.0,
                    "center": [0, -1.5 * scale],
                }
            },
            outputs={"far": "rod.E.x", "turn": "rod.angle"},
            expected=[
                {"task": "swing", "what": "summary/state/far", "value": [0.5 * scale, 0.0]},
                {"task": "swing", "what": "summary/state/turn", "value": [0.0, 0.0]},
            ],
        )
        work = motions.work_of(problem)
        errors.append(work.error(np.array([0.7])))
    assert errors[0] == pytest.approx(errors[1], rel=1e-12)
    assert errors[0] == pytest.approx(0.7, rel=1e-12)


def test_dry_friction_is_measured_with_its_events() -> None:
    """The angle at which a crank with friction in four joints stands still, sixteen digits."""
    pytest.importorskip("scipy")
    work = motions.work_of(md.load("coasting-slider-crank"))
    records, notes = measure(work, (1e-8, 1e-10))
    assert notes == []
    found = {(record["method"], record["tolerance"]): record for record in records}
    assert {method for method, _ in found} == {motions.OURS, "scipy DOP853, events"}
    assert found[motions.OURS, 1e-10]["error"] <= 5e-9 / 12.1
    assert found["scipy DOP853, events", 1e-10]["error"] <= 5e-9
    assert work.ours(1e-10).rhs == work.ours(1e-10).rhs  # each run begins without a past
    assert found[motions.OURS, 1e-10]["drift"] <= 1e-15


def test_where_a_pair_sticks_scipy_is_left_out() -> None:
    pytest.importorskip("scipy")
    work = motions.work_of(md.load("incline-block"))
    records, notes = measure(work, (1e-8,))
    assert [record["method"] for record in records] == [motions.OURS]
    assert any("sticks" in note for note in notes)


def test_failures_are_told(monkeypatch) -> None:
    monkeypatch.setattr(integrators, "STEPS", 5)
    records, notes = measure(motions.work_of(pendulum()), (1e-8,))
    assert not {record["method"] for record in records} & set(FREE)
    assert sum("TOO_MUCH_WORK" in note for note in notes) == len(FREE)


def test_the_command_writes_records_and_a_picture(capsys, tmp_path) -> None:
    assert main(["bench", "pendulum", "--quick", "--out", str(tmp_path)]) == 0
    assert "tolerance" in capsys.readouterr().out
    records = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    assert all(set(record) >= KEYS for record in records)
    assert {record["method"] for record in records} == {motions.OURS}
    assert (tmp_path / "bench-motion.svg").stat().st_size > 5000
    assert beside(["pendulum", "--quick", "--out", str(tmp_path)]) == 0
    capsys.readouterr()
    records = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    assert {record["method"] for record in records} >= {motions.OURS, *FREE}


def test_the_page_is_what_was_measured(capsys) -> None:
    spec = importlib.util.spec_from_file_location("make", ROOT / "docs/make_motion_speed.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.main(["--check"]) == 0, capsys.readouterr().out
    for found in module.records().values():
        assert all(set(record) >= KEYS for record in found.values())


def test_values_of_another_file_are_no_truth() -> None:
    """Where a file was edited, what it expects is stale: errors are those to a tightened run."""
    problem = md.load("pendulum")
    fresh = motions.work_of(problem)
    assert fresh.reference == "values of the problem"
    assert fresh.notes == []
    edited = problem.with_values({"g": 9.8})
    stale = motions.work_of(edited)
    assert stale.reference == "tightened run"
    assert "are not those of this file" in stale.notes[0]
    assert stale.error(stale.ours(1e-10).x) < 1e-8
