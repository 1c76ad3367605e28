"""Pairs that let go or stop in one instant, starts from rest, and solutions that are ruled out."""

from __future__ import annotations

import tomllib
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.dynamics import run
from mechdae.dynamics.watchers import from_rest as ways
from tests.attack.symmetric_machines import KINDS, Drawn, case
from tests.reference.complementarity import Course, Follower, Load, Machine, Slip
from tests.reference.wedge import efforts, starts

DATA = Path(__file__).parents[1] / "data" / "friction"
SLOPE, MU, WEIGHT, MASSES = radians(8), 0.2, 2000.0, (5.0, 200.0)


def file(name: str) -> Any:
    return md.load(DATA / f"{name}.toml")


def told(result: md.Result) -> list[tuple[str, float, frozenset[str]]]:
    """Events of friction: kind, time, all joints of it."""
    return [
        (e["kind"], e["time"], frozenset(e.get("group") or [e["joint"]])) for e in result.events
    ]


def test_two_blocks_let_go_in_the_same_instant() -> None:
    """m x'' = 2 t - 2 of each from t = 1 on."""
    result = md.solve(file("two-blocks"), "run")
    assert result.fault is None
    (event,) = result.events
    assert (event["kind"], event["joint"], event["sign"]) == ("slip", "f1", 1.0)
    assert (event["group"], event["signs"]) == (["f1", "f2"], [1.0, 1.0])
    assert event["time"] == pytest.approx(1.0, abs=1e-12)
    for joint in ("f1", "f2"):
        assert result.joints[joint].slide[-1] == pytest.approx(8 / 3, rel=1e-12)
        assert result.joints[joint].slide_velocity[-1] == pytest.approx(4.0, rel=1e-12)


@pytest.mark.parametrize("count", [9, 12])
def test_more_blocks_than_ways_are_tried_of(count: int) -> None:
    """All stop together, each after v / (mu g); only the later ones are pulled and let go again."""
    mu, g, v, m = 0.3, 10.0, 2.0, 2.0
    data: dict[str, Any] = {
        "schema": 1, "gravity": [0, -g], "ground": {"points": {}}, "bodies": {}, "joints": {},
        "loads": {},
        "tasks": {"m": {"kind": "motion", "until": 2.0, "poses": 3, "tolerance": 1e-11,
                        "start": {f"j{i}": 0 for i in range(count)},
                        "start_speed": {f"j{i}": v for i in range(count)}}},
    }  # fmt: skip
    for i in range(count):
        data["ground"]["points"][f"O{i}"] = [0, 1.0 * i]
        data["bodies"][f"b{i}"] = {"points": {"P": [0, 0]}, "mass": m}
        data["joints"][f"j{i}"] = {
            "kind": "prismatic", "between": [f"ground.O{i}", f"b{i}.P"], "axis": 0, "friction": mu
        }  # fmt: skip
        if i >= 2:
            data["loads"][f"p{i}"] = {
                "kind": "force", "point": f"b{i}.P", "value": ["5*(t + abs(t - 1) - 1)", 0]
            }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    every, pulled = {f"j{i}" for i in range(count)}, {f"j{i}" for i in range(2, count)}
    stop, again = v / (mu * g), 1 + mu * m * g / 10
    assert [(kind, names) for kind, _, names in told(result)] == [
        ("stick", frozenset(every)), ("slip", frozenset(pulled))
    ]  # fmt: skip
    assert [t for _, t, _ in told(result)] == pytest.approx([stop, again], rel=1e-11)
    way = v * stop / 2
    assert result.joints["j0"].slide[-1] == pytest.approx(way, rel=1e-11)
    further = 10 / m * (2 - again) ** 3 / 6
    assert result.joints[f"j{count - 1}"].slide[-1] == pytest.approx(way + further, rel=1e-11)


# -- a wedge: three pairs that stick and one freedom, coupling above 1 -----------------------------


def test_a_wedge_rests_until_its_push_lifts_the_block() -> None:
    ((limit, _),) = efforts(SLOPE, MU, WEIGHT, -1)
    begin = (-limit - 100) / 400
    result = md.solve(file("wedge-at-rest"), "go")
    assert result.fault is None
    (event,) = result.events
    assert (event["kind"], event["group"]) == ("slip", ["floor", "face", "wall"])
    assert event["signs"] == [-1.0, 1.0, 1.0]
    assert event["time"] == pytest.approx(begin, abs=1e-9)
    (slow, *_), *_ = starts(limit - 1.0, SLOPE, MU, WEIGHT, MASSES, -1)  # of 1 N more
    left = np.maximum(result.time - begin, 0.0)
    assert result.joints["floor"].slide == pytest.approx(400 * slow * left**3 / 6, abs=1e-11)
    # that it rests below: no friction lets it start to either side
    for push in (-100.0, 0.999 * limit):
        for sense in (1, -1):
            rates = starts(push, SLOPE, MU, WEIGHT, MASSES, sense)
            assert not any(rate * sense > 0 for rate, _, _ in rates)


def test_a_wedge_pushed_at_once_starts_the_way_it_is_pushed() -> None:
    """Two sets of forces fit the laws; the other one starts against its friction and pulls."""
    right, wrong = sorted(starts(-1500.0, SLOPE, MU, WEIGHT, MASSES, -1))
    assert right[0] < 0 < wrong[0]
    result = md.solve(file("wedge-pushed-up"), "go")
    assert result.fault is None
    assert not [e for e in result.events if e["kind"] == "lift_off"]
    found = result.joints["floor"].slide_acceleration
    assert found == pytest.approx(right[0], rel=1e-12)
    assert result.points["block.Q"].acceleration[:, 1] == pytest.approx(right[1], rel=1e-12)
    notes = result.summary["notes"]
    assert any("2 solutions fit" in n and "would have to pull" in n for n in notes)


def test_without_declared_sides_the_start_alone_decides() -> None:
    problem = tomllib.loads((DATA / "wedge-pushed-up.toml").read_text("utf-8"))
    for joint in problem["joints"].values():
        joint.pop("one_sided")
    result = md.solve(from_dict(problem), "go")
    right, _ = sorted(starts(-1500.0, SLOPE, MU, WEIGHT, MASSES, -1))
    assert result.fault is None
    assert result.joints["floor"].slide_acceleration == pytest.approx(right[0], rel=1e-12)
    assert any("would move against its friction" in note for note in result.summary["notes"])


def test_a_wedge_that_moves_already_is_left_with_both() -> None:
    problem = tomllib.loads((DATA / "wedge-pushed-up.toml").read_text("utf-8"))
    for joint in problem["joints"].values():
        joint.pop("one_sided")
    problem["tasks"]["go"]["start_speed"] = {"floor.slide": -0.1}
    (event,) = [e for e in md.solve(from_dict(problem), "go").events if "code" in e]
    assert event["code"] == "F2"
    found = sorted(own["wedge.x"] for own in event["solutions"])
    wanted = sorted(rate for rate, _, _ in starts(-1500.0, SLOPE, MU, WEIGHT, MASSES, -1))
    assert found == pytest.approx(wanted, rel=1e-9)


# -- many events ---------------------------------------------------------------------------------


def compared(result: md.Result, course: Course, allowed: float) -> None:
    assert result.fault is None
    own, wanted = told(result), course.events
    assert [(kind, names) for kind, _, names in own] == [(k, names) for _, k, names in wanted]
    assert [t for _, t, _ in own] == pytest.approx([t for t, _, _ in wanted], abs=allowed)


def test_two_coupled_blocks_on_a_belt() -> None:
    """27 events in 60 s."""
    e = np.eye(2)
    slips = [Slip(f"f{k + 1}", e[k], 0.07, 0.1, size=10.0, speed=0.1) for k in range(2)]
    K = np.array([[2.2, -1.2], [-1.2, 2.2]])
    machine = Machine(np.ones(2), np.zeros((0, 2)), K, np.zeros((2, 2)), slips, [], np.zeros(2),
                      np.array([0.2, -0.1]), np.full(2, 0.1), 60.0)  # fmt: skip
    course = Follower(machine).course()
    assert len(course.events) == 27
    result = md.solve(file("two-blocks-on-a-belt"), "run")
    compared(result, course, 1e-8)
    found = [result.points[f"b{k}.P"].position[-1, 0] for k in (1, 2)]
    assert found == pytest.approx(course.q, abs=1e-8)


def test_three_blocks_on_each_other() -> None:
    """40 sin t at the lowest of 3, 2 and 1 kg, with coefficients 0.2, 0.3, 0.4."""
    g, T = 9.81, np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])
    sizes = [6 * g, 3 * g, 1 * g]
    slips = [
        Slip(name, T[k], mu, mu, size=size)
        for k, (name, mu, size) in enumerate(zip(("fa", "fb", "fc"), (0.2, 0.3, 0.4), sizes,
                                                 strict=True))
    ]  # fmt: skip
    pull, none = Load(np.array([1.0, 0, 0]), 0, 0, 40.0, 1.0, 0.0), np.zeros((3, 3))
    machine = Machine(np.array([3.0, 2, 1]), np.zeros((0, 3)), none, none, slips, [pull],
                      np.zeros(3), np.zeros(3), np.zeros(3), 12.0)  # fmt: skip
    course = Follower(machine).course()
    assert len(course.events) == 10
    result = md.solve(file("three-blocks-stacked"), "run")
    compared(result, course, 1e-7)
    found = [result.points[f"{body}.P"].position[-1, 0] for body in "abc"]
    assert found == pytest.approx(course.q, abs=1e-8)


# -- random machines -----------------------------------------------------------------------------

SEEDS = (*range(len(KINDS)), 226)
"""One of each kind; in the last the force that holds has its kink where it gives way."""


@pytest.mark.parametrize("seed", SEEDS)
def test_random_symmetric_machines(seed: int) -> None:
    found = case(seed)
    assert "wrong" not in found, found


def test_planted_one_after_the_other_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A moment later nothing is looked at: pairs that are alike hold each other's event up."""
    monkeypatch.setattr(
        ways.WaysFromRest, "_soon", lambda self, t, x, v, sides, rest, chosen: chosen
    )
    result = md.solve(file("two-blocks"), "run")
    assert "(F4)" in (result.fault or "")


def linked() -> Any:
    """Two pairs of blocks of 1 kg, each with a rod between them, at rest under forces 2 t."""
    made = Drawn(10.0)
    for i in range(2):
        one, two = made.body(1.0, [0.0, 2.0 * i]), made.body(1.0, [1.0, 2.0 * i])
        for body in (one, two):
            made.rail(None, body, 0.0, 0.2)
        made.link(one, two)
        made.pull(one, [1.0, 0.0], (0.0, 2.0, 0.0, 1.0, 0.0))
    return made.problem()


def test_linked_pairs_let_go_together() -> None:
    result = md.solve(linked(), "go")
    assert result.fault is None
    ((kind, time, names),) = told(result)
    assert (kind, len(names)) == ("slip", 4)
    assert time == pytest.approx(2.0, abs=1e-9)
    assert result.points["b3.P"].position[-1, 0] - 1 == pytest.approx(2**3 / 6, rel=1e-9)


def test_planted_each_slip_alone_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slips of one freedom looked at one by one: those of linked blocks are more than freedoms."""
    monkeypatch.setattr(ways.WaysFromRest, "_together", lambda *_: False)
    assert "(F" in (md.solve(linked(), "go").fault or "")


def test_planted_any_sense_from_rest_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = file("wedge-at-rest")
    monkeypatch.setattr(
        ways.WaysFromRest, "_margins", lambda self, sides, asked, *_: np.ones(len(asked))
    )
    (event,) = [e for e in md.solve(problem, "go").events if "code" in e][:1]
    assert event["code"] in ("F2", "F4")


def test_events_that_crowd_are_those_of_one_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many blocks as make a crowd, let go one after the other within a millionth of the time."""
    monkeypatch.setattr(run, "CROWD", 3)
    data: dict[str, Any] = {
        "schema": 1, "gravity": [0, -10], "ground": {"points": {}}, "bodies": {}, "joints": {},
        "loads": {}, "tasks": {"m": {"kind": "motion", "until": 2.0, "poses": 2}},
    }  # fmt: skip
    for i in range(5):
        data["ground"]["points"][f"O{i}"] = [0, 1.0 * i]
        data["bodies"][f"b{i}"] = {"points": {"P": [0, 0]}, "mass": 1}
        data["joints"][f"j{i}"] = {
            "kind": "prismatic", "between": [f"ground.O{i}", f"b{i}.P"], "axis": 0, "friction": 0.2
        }  # fmt: skip
        data["loads"][f"p{i}"] = {
            "kind": "force", "point": f"b{i}.P", "value": [f"2*(1 + {i}e-7)*t", 0]
        }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    assert result.fault is None
    assert [names for _, _, names in told(result)] == [{f"j{i}"} for i in range(4, -1, -1)]
