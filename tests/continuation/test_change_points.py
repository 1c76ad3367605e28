"""Change points: crossed on the branch's own tangent, logged, or told apart from near ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.cases.hard_steps.crossings.change_points import piece
from mechdae.results import Result
from tests.shared.mechanisms import four_bar

TURN = 2 * np.pi


def sweep(
    mechanism: md.Mechanism, low: float, high: float, poses: int = 361, **keys: object
) -> Result:
    return md.solve(
        mechanism, md.Sweep(md.Driver("crank.angle", from_=low, to=high), poses=poses, **keys)
    )


def crossings(result: Result) -> list[dict]:
    return [event for event in result.events if event["kind"] == "change_point"]


def parallelogram(a: float = 1.0, b: float = 3.0, anti: bool = False) -> md.Mechanism:
    sketch = (1.0, 0.4, 4.6) if anti else (1.0, 0.0, 1.0)
    return four_bar(a, b, a, b, **dict(zip(("crank", "coupler", "rocker"), sketch, strict=True)))


def kite() -> md.Mechanism:
    return four_bar(1, 2, 2, 1, crank=1.0, coupler=0.1, rocker=0.8)


def anti(a: float, b: float, u: np.ndarray) -> np.ndarray:
    """Return the rocker angle of the anti-parallelogram with its two derivatives, (3, n)."""
    k = (b + a) / (b - a)
    half, c, s = np.arctan2(-k * np.sin(u / 2), np.cos(u / 2)), np.cos(u / 2), np.sin(u / 2)
    size = c * c + k * k * s * s
    rate = -k / size
    second = k * (k * k - 1) * c * s / (size * size)
    return np.array([2 * np.unwrap(half), rate, second])


def aligned(ours: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the difference with whole turns of the first pose taken away."""
    gap = ours - truth
    return gap - TURN * np.round(gap[1] / TURN)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_parallelogram_turns_on(size: float) -> None:
    result = sweep(parallelogram(size, 3 * size), 0, 2 * TURN, 721)
    u = result.drivers["crank.angle"].position
    assert set(result.status) == {"ok"}
    assert result.fault is None
    assert np.abs(result.bodies["rocker"].angle - u).max() < 1e-13
    assert np.abs(result.bodies["rocker"].angular_velocity - 1).max() < 1e-11
    assert np.abs(result.bodies["rocker"].angular_acceleration).max() < 2e-9
    assert np.all(np.abs(result.bodies["rocker"].angle - u) <= result.bound.angle)
    assert result.summary["bound"] == "estimated"
    found = crossings(result)
    assert [event["at"] for event in found] == pytest.approx(
        [0, np.pi, TURN, 3 * np.pi, 2 * TURN], abs=1e-13
    )
    first = found[0]
    assert first["group"] == ["coupler", "rocker"]
    assert first["tangents"]["rocker.angle"] == pytest.approx([1, -2], abs=1e-12)
    assert found[1]["tangents"]["rocker.angle"] == pytest.approx([1, -0.5], abs=1e-12)
    assert first["action"] == "continue"
    assert first["exact"]


def test_anti_parallelogram_turns_on() -> None:
    result = sweep(parallelogram(anti=True), -TURN, TURN, 1441)
    u = result.drivers["crank.angle"].position
    truth = anti(1.0, 3.0, u)
    rocker = result.bodies["rocker"]
    assert set(result.status) == {"ok"}
    gap = np.abs(aligned(rocker.angle, truth[0]))
    assert gap.max() < 2e-13
    assert np.all(gap <= result.bound.angle)
    assert np.abs(rocker.angular_velocity - truth[1]).max() < 1e-11
    assert np.abs(rocker.angular_acceleration - truth[2]).max() < 2e-9
    assert crossings(result)[0]["tangents"]["rocker.angle"] == pytest.approx([-2, 1], abs=1e-12)


def test_poses_as_near_as_can_be() -> None:
    """Between the change point and where the equations hold again: the branch's expansion."""
    near = np.concatenate([[0.0], *[[s * 10.0**-k for k in range(1, 17)] for s in (1, -1)]])
    task = md.Sweep(md.Driver("crank.angle", at=tuple(np.pi + near)))
    result = md.solve(parallelogram(anti=True), task)
    u = result.drivers["crank.angle"].position
    half = np.arctan2(-2 * np.sin(u / 2), np.cos(u / 2))
    gap = 2 * half - result.bodies["rocker"].angle
    gap = np.abs(gap - TURN * np.round(gap / TURN))
    assert np.ptp(result.bodies["rocker"].angle) < 0.2
    assert set(result.status) == {"ok"}
    assert gap.max() < 2e-13
    assert np.all(gap <= result.bound.angle)
    assert np.abs(result.bodies["rocker"].angular_velocity + 0.5).max() < 0.01
    assert result.bodies["rocker"].angular_velocity[0] == pytest.approx(-0.5, abs=1e-11)
    assert np.isnan(result.condition[0]) or result.condition[0] > 1e12


@pytest.mark.parametrize("start", [1.0, -2.225440461037537])
def test_steep_branch_keeps_its_bound(start: float) -> None:
    """Lengths 8 and 9: 17 times as fast as the crank, over a place as narrow.

    The branch is odd about the change point, and so is what an interpolant misses: at the
    change point itself nothing is seen of it. Seen from afar the change point is whole turns
    away. Closed form in 80-bit floats.
    """
    a, b, k = 8.0, 9.0, 17
    rocker = 2 * np.arctan2(-k * np.sin(start / 2), np.cos(start / 2))
    side = b + a * np.exp(1j * rocker) - a * np.exp(1j * start)
    sketch = {"crank": start, "coupler": float(np.angle(side)), "rocker": float(rocker)}
    near = [sign * 10.0**-n for n in np.arange(1.25, 13, 0.25) for sign in (1, -1)]
    for turns in (0, 1):
        at = tuple(TURN * turns + v for v in (*near, *np.linspace(-0.05, 0.05, 41)))
        result = md.solve(four_bar(a, b, a, b, **sketch), md.Sweep(md.Driver("crank.angle", at=at)))
        u = result.drivers["crank.angle"].position.astype(np.longdouble)
        c, s = np.cos(u / 2), np.sin(u / 2)
        size = c * c + k * k * s * s
        truth = 2 * np.arctan2(-k * s, c), -k / size, k * (k * k - 1) * c * s / (size * size)
        ours = result.bodies["rocker"]
        gap = (ours.angle - truth[0]).astype(float)
        assert set(result.status) == {"ok"}
        assert np.all(np.abs(gap - TURN * np.round(gap / TURN)) <= result.bound.angle + 1e-15)
        assert result.bound.angle.max() < 2e-11
        assert np.abs(ours.angular_velocity - truth[1]).max() < 1e-10 * k
        assert np.abs(ours.angular_acceleration - truth[2]).max() < 1e-7 * k * k


def test_kite_needs_two_turns() -> None:
    """Galloway's mechanism; on the other branch at 0 the crank stands still on the ground."""
    result = sweep(kite(), 0, 2 * TURN, 1441)
    u = result.drivers["crank.angle"].position
    truth = u / 2 + np.arcsin(np.sin(u / 2) / 2)
    assert set(result.status) == {"ok"}
    assert np.abs(result.bodies["rocker"].angle - truth).max() < 2e-13
    found = crossings(result)
    assert [event["at"] for event in found] == pytest.approx([0, TURN, 2 * TURN], abs=1e-12)
    assert found[0]["tangents"]["rocker.angle"] == [pytest.approx(0.75, abs=1e-12), None]
    assert found[1]["tangents"]["rocker.angle"] == [pytest.approx(0.25, abs=1e-12), None]
    assert "limits" not in result.summary


def test_assembled_range_of_the_kite_closes_after_two_turns() -> None:
    result = md.solve(kite(), md.Sweep(md.Driver("crank.angle", range="assembled"), poses=9))
    u = result.drivers["crank.angle"].position
    assert u[-1] - u[0] == pytest.approx(2 * TURN)
    assert result.summary["limits"] == [None, None]


def test_stop() -> None:
    result = sweep(parallelogram(), 0.5, TURN, 101, on_change_point="stop")
    u = result.drivers["crank.angle"].position
    ahead = u > np.pi
    assert set(result.status[~ahead]) == {"ok"}
    assert set(result.status[ahead]) == {"unassembled"}
    assert "change point" in result.fault
    [event] = [event for event in crossings(result) if event["in_range"]]
    assert event["at"] == pytest.approx(np.pi, abs=1e-13)
    assert event["action"] == "stop"


def test_stop_at_the_change_point_itself() -> None:
    task = md.Sweep(md.Driver("crank.angle", at=(1.0, np.pi)), on_change_point="stop")
    result = md.solve(parallelogram(), task)
    assert list(result.status) == ["ok", "ok"]
    assert result.bodies["rocker"].angle[1] == pytest.approx(np.pi, abs=1e-14)


def test_switch() -> None:
    """From the parallelogram to the anti-parallelogram at pi, and back at 2 pi."""
    result = sweep(parallelogram(), 0.5, 2 * TURN, 401, on_change_point="switch")
    u = result.drivers["crank.angle"].position
    rocker = result.bodies["rocker"].angle
    one, two = u < np.pi, (u > np.pi) & (u < TURN)
    assert np.abs(rocker[one] - u[one]).max() < 1e-13
    truth = 2 * np.arctan2(-2 * np.sin(u[two] / 2), np.cos(u[two] / 2))
    gap = rocker[two] - truth
    assert np.abs(gap - TURN * np.round(gap[0] / TURN)).max() < 1e-12
    assert set(result.status) == {"ok"}
    assert len({event["action"] for event in crossings(result)} - {"switch"}) == 0


def test_switch_where_the_driver_would_stand_still() -> None:
    result = sweep(kite(), 0.5, 3 * np.pi, 61, on_change_point="switch")
    assert "unassembled" in result.status
    assert "change point" in result.fault


def folding() -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (1, 0)}),
            md.Body("rod", {"A": (0, 0), "B": (1, 0)}),
            md.Body("slider", {"B": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Revolute("B", "rod.B", "slider.B"),
            md.Prismatic("guide", "ground.O", "slider.B"),
        ],
        sketch={"crank": 0.7, "rod": -0.7},
    )


@pytest.mark.parametrize("action", ["continue", "switch"])
def test_folding_slider_crank(action: str) -> None:
    """Equal crank and rod: the slider runs on to the other side, or stays where it folds."""
    result = sweep(folding(), 0, 3 * np.pi, 1081, on_change_point=action)
    u = result.drivers["crank.angle"].position
    x = result.points["slider.B"].position[:, 0]
    stays = (u > np.pi / 2) & (u < 3 * np.pi / 2) | (u > 5 * np.pi / 2)
    truth = np.where(stays & (action == "switch"), 0.0, 2 * np.cos(u))
    assert set(result.status) == {"ok"}
    assert np.abs(x - truth).max() < 1e-13
    at = [event["at"] for event in crossings(result)]
    assert at == pytest.approx([np.pi / 2, 3 * np.pi / 2, 5 * np.pi / 2], abs=1e-13)


def in_series(last: float) -> md.Mechanism:
    """A parallelogram 1, 3 that drives a second one, 0.8, 2.5: both fold at the same pose."""
    first = parallelogram()
    ground = md.Ground({"A": (0, 0), "D": (3, 0), "E": (5.5, 0)})
    rocker = md.Body("rocker", {"D": (0, 0), "C": (1, 0), "F": (0.8, 0)})
    return md.Mechanism(
        ground=ground,
        bodies=[
            first.bodies["crank"],
            first.bodies["coupler"],
            rocker,
            md.Body("second", {"F": (0, 0), "G": (2.5, 0)}),
            md.Body("last", {"E": (0, 0), "G": (0.8, 0)}),
        ],
        joints=[
            *first.joints.values(),
            md.Revolute("F", "rocker.F", "second.F"),
            md.Revolute("G", "second.G", "last.G"),
            md.Revolute("E", "ground.E", "last.E"),
        ],
        sketch={**first.sketch, "second": 0.0 if last > 0 else 0.4, "last": last},
    )


@pytest.mark.parametrize("last", [1.0, -1.7])
def test_two_groups_cross_at_one_pose(last: float) -> None:
    result = sweep(in_series(last), 0, TURN, 361)
    u = result.drivers["crank.angle"].position
    truth = u if last > 0 else anti(0.8, 2.5, u)[0]
    assert set(result.status) == {"ok"}
    assert np.abs(aligned(result.bodies["last"].angle, truth)).max() < 2e-13
    assert [event["name"] for event in crossings(result)] == ["II.1 RRR(2,3)", "II.1 RRR(4,5)"] * 3


@pytest.mark.parametrize("excess", [1e-6, 1e-9, 1e-11, 1e-13])
def test_an_avoided_crossing_is_none(excess: float) -> None:
    """A link longer by `excess`: at pi the branches pass each other at a small distance."""
    result = sweep(four_bar(1, 3 + excess, 1, 3, crank=1.0, coupler=0.0, rocker=1.0), 1, 5, 41)
    assert set(result.status) == {"ok"}
    assert not result.events
    assert result.summary["bound"] == "proved"
    # beyond pi the rocker goes the way of the anti-parallelogram
    assert result.bodies["rocker"].angle[-1] == pytest.approx(
        2 * np.arctan(-2 * np.tan(2.5)), abs=1e-4
    )


@pytest.mark.parametrize("lack", [1e-6, 1e-9, 1e-11])
def test_a_limit_just_before_a_crossing(lack: float) -> None:
    """A link shorter by `lack`: the crank turns back before pi."""
    result = sweep(four_bar(1, 3 - lack, 1, 3, crank=1.0, coupler=0.0, rocker=1.0), 1, 3.3, 41)
    limit = np.arccos((1 + 9 - (4 - lack) ** 2) / 6)
    inside = [event["at"] for event in result.events if event["in_range"]]
    assert inside == pytest.approx([limit], abs=1e-10)
    assert result.events[-1]["kind"] == "limit"


@pytest.mark.parametrize("off", [4e-16, -4e-16])
def test_rounding_makes_it_ambiguous(off: float) -> None:
    """One unit in the last place: the poses beyond are given, but not claimed."""
    result = sweep(four_bar(1, 3 + off, 1, 3, crank=1.0, coupler=0.0, rocker=1.0), 1, 5, 41)
    u = result.drivers["crank.angle"].position
    assert set(result.status[u < np.pi]) == {"ok"}
    assert set(result.status[u > np.pi]) == {"ambiguous"}
    assert np.isnan(result.bound.angle[u > np.pi]).all()
    [event] = [event for event in crossings(result) if event["in_range"]]
    assert not event["exact"]
    assert 1e-9 < event["gap"] < 1e-7
    assert "ambiguous" in result.summary["notes"][0]


def test_less_than_a_trillionth_is_ambiguous() -> None:
    """A pin beside its rod makes it longer by 2e-25: the branches come within 5e-13."""
    mechanism = four_bar(1, 3, 1, 3, crank=1.0, coupler=0.0, rocker=1.0)
    bodies = {**mechanism.bodies, "coupler": md.Body("coupler", {"B": (0, 0), "C": (3, 1e-12)})}
    result = sweep(replace(mechanism, bodies=bodies), 1, 5, 41)
    u = result.drivers["crank.angle"].position
    assert set(result.status[u < np.pi]) == {"ok"}
    assert set(result.status[u > np.pi]) == {"ambiguous"}
    [event] = [event for event in crossings(result) if event["in_range"]]
    assert not event["exact"]
    assert 1e-13 < event["gap"] < 1e-12


@pytest.mark.parametrize("off", [0.0, 2e-16])
def test_a_limit_behind_a_near_crossing_is_left_open(off: float) -> None:
    """The crank swings between +-acos(1/4), past a change point at 0: but for a rounding."""
    mechanism = four_bar(2, 3, 1 + off, 4, crank=1.0, coupler=0.3, rocker=1.5)
    result = sweep(mechanism, -1.4, 1.4, 9)
    found = [(event["kind"], event["at"], "ambiguous" in event) for event in result.events]
    end = np.arccos(0.25)
    assert found == [
        ("limit", pytest.approx(-end, abs=1e-12), off > 0),
        ("change_point", pytest.approx(0, abs=1e-7), False),
        ("limit", pytest.approx(end, abs=1e-12), False),
    ]


def test_several_drivers_cross() -> None:
    """The far pivot stands on a carriage: crossed along lines in two drivers."""
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (1, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (3, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (1, 0)}),
            md.Body("carriage", {"D": (0, 0)}),
        ],
        joints=[
            md.Prismatic("guide", "ground.A", "carriage.D"),
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "carriage.D", "rocker.D"),
        ],
        sketch={"crank": 1.0, "coupler": 0.0, "rocker": 1.0},
    )
    drivers = (
        md.Driver("crank.angle", at=(1.0, 4.0, 7.0)),
        md.Driver("guide.slide", at=(3.0, 3.0, 3.0)),
    )
    result = md.solve(mechanism, md.Sweep(drivers=drivers))
    assert list(result.status) == ["ok"] * 3
    assert result.bodies["rocker"].angle == pytest.approx([1, 4, 7], abs=1e-13)


def test_the_expansion_is_exact_for_polynomials() -> None:
    def value(s: float) -> tuple[np.ndarray, ...]:
        c = np.array([3.0, -1.0, 2.0, 0.5, -0.25, 1.0])
        return tuple(np.array([np.polyval(np.polyder(c, k), s)]) for k in range(4))

    found = piece(0.3, 1.1, value(0.3)[:3], value(1.1)[:3])(0.7)
    for ours, truth in zip(found, value(0.7), strict=True):
        assert ours == pytest.approx(truth, rel=1e-12)
