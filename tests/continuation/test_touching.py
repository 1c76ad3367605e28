"""Branches that touch to a higher order, those that never meet, and change points at one pose.

Two links of 1 m between a pivot and a point at distance d have the branches +-acos(d/2). With
2 - d = c s^(2m) they differ by s^m: both go on where m is a whole number, none where it is not.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.cases.hard_steps import obstacles
from tests.shared.mechanisms import toggle


def on_curve(distance: str, start: float) -> md.Mechanism:
    """The far end of the links is led along a line by a curve x(s): s is the driver."""
    angle = math.acos(float(eval(distance, {"s": start, "cos": math.cos})) / 2)
    return md.Mechanism(
        ground=md.Ground(points={"A": (0, 0)}),
        bodies=[
            md.Body("b1", points={"A": (0, 0), "B": (1, 0)}),
            md.Body("b2", points={"B": (0, 0), "C": (1, 0)}),
        ],
        joints=[
            md.Curve("k", "ground.A", "b2.C", x=distance, y="0*s", range=(-1.5, 1.5)),
            md.Revolute("A", "ground.A", "b1.A"),
            md.Revolute("B", "b1.B", "b2.B"),
        ],
        sketch={"b1": angle, "b2": -angle, "k": start},
    )


def swept(mechanism: md.Mechanism, **keys: object) -> md.Result:
    driver = md.Driver("k.s", from_=-1, to=1) if "law" not in keys else md.Driver("g.slide", **keys)
    return md.solve(mechanism, md.Sweep(driver, poses=41))


def check(result: md.Result, at: float, order: float, time: bool = False) -> None:
    """The place is in its range, the range is small beside the order, and nothing behind is ok."""
    (event,) = [e for e in result.events if e["kind"] in ("change_point", "cusp")]
    assert event["kind"] == ("change_point" if order % 1 == 0 else "cusp")
    place = event["time"] if time else event["at"]
    assert event["order"] == order
    low, high = event["range"]
    assert low <= at <= high
    assert high - low < 8 * (1e-13) ** (1 / (2 * order))  # zeros of e move so far by rounding
    assert abs(place - at) < 1e-6
    assert event["gap"] < 1e-6
    s = result.time if time else result.drivers["k.s"].position
    words = np.array([str(word) for word in result.status])
    assert set(words[s > high]) <= {"unassembled"}
    assert (words[s < low - 0.2] == "ok").all()


@pytest.mark.parametrize("order", [2, 3, 4, 5])
@pytest.mark.parametrize(("at", "lean"), [(0.0, 0.0), (0.1, 0.3), (-0.23, -0.2)])
def test_branches_that_touch_have_a_place_with_a_range(order: int, at: float, lean: float) -> None:
    text = f"2 - 0.2*(s - {at})**{2 * order}*(1 + {lean}*s)"
    check(swept(on_curve(text, -1.0)), at, order)


@pytest.mark.parametrize("power", [3, 5])
def test_a_cusp_has_a_range_too(power: int) -> None:
    check(swept(on_curve(f"2 + 0.2*(s - 0.1)**{power}", -1.0)), 0.1, power / 2)


@pytest.mark.parametrize("order", [2, 3, 4])
@pytest.mark.parametrize("at", [0.0, 0.1])
def test_laws_that_touch_a_limit_position_tangentially(order: int, at: float) -> None:
    law = f"2 - 0.3*(t - {at})**{2 * order}"
    check(swept(toggle(0.9), law=law, from_=-1, to=1), at, order, time=True)


def test_random_places_and_orders() -> None:
    rng = np.random.default_rng(5)
    for _ in range(5):
        at, factor = float(rng.uniform(-0.4, 0.4)), float(rng.uniform(0.05, 0.3))
        order = int(rng.integers(2, 5))
        text = f"2 - {factor!r}*(s - {at!r})**{2 * order}*(1.5 + cos(s))/2"
        check(swept(on_curve(text, -1.0)), at, order)


@pytest.mark.parametrize("off", [1e-4, 1e-8, 1e-10, 1e-11, 1e-12, 1e-13])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_branches_that_never_meet_have_no_change_point(order: int, off: float) -> None:
    """They stay 2 acos(1 - off / 2) apart, in both angles."""
    result = swept(on_curve(f"2 - 0.2*s**{2 * order} - {off}", -1.0))
    kinds = [event["kind"] for event in result.events]
    assert "change_point" not in kinds
    if kinds:  # nearer than steps can be proved
        assert off < 1e-10
        (event,) = result.events
        apart = 2 * math.sqrt(2) * math.acos(1 - off / 2)
        assert event["kind"] == "ambiguous"
        assert event["gap"] == pytest.approx(apart, rel=1e-2)
        assert abs(event["nearest"]) < 1e-6
        assert "ok" not in [str(w) for w in result.status[result.drivers["k.s"].position > 0]]
    else:
        s, ok = result.drivers["k.s"].position, result.status == "ok"
        assert ok[np.abs(s) > 0.06].all()  # nearer poses may lack their certificate
        d = 2 - 0.2 * s[ok] ** (2 * order) - off
        assert result.bodies["b1"].angle[ok] == pytest.approx(np.arccos(d / 2), abs=1e-9)


def test_two_limit_positions_close_together_are_no_change_point() -> None:
    """Between them there is no pose: 2 - d is negative there."""
    result = swept(on_curve("2 - 0.2*s**4 + 1e-10", -1.0))
    assert "change_point" not in [event["kind"] for event in result.events]
    fold = (5e-10) ** 0.25
    assert all(event["at"] < -fold + 1e-9 for event in result.events)


def test_a_place_where_the_proof_ends_is_not_the_change_point(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The mistake that was there before: the check sees it."""
    right = obstacles._touching

    def wrong(touch, s, *rest):
        return replace(right(touch, s, *rest), s=s, reached=None)

    monkeypatch.setattr(obstacles, "_touching", wrong)
    result = swept(on_curve("2 - 0.2*s**6", -1.0))
    with pytest.raises(AssertionError):
        check(result, 0.0, 3)


# -- change points of several groups at one pose ---------------------------------------------------


def parallelograms(serial: bool, sketch: float = 0.6) -> md.Mechanism:
    """Two parallelograms with cranks of 1: the second on the first one's rocker, or beside it."""
    carrier, second = ("r1", 3.0) if serial else ("crank", 3.0)
    base = 5.0 if serial else 3.0
    bodies = [
        md.Body("crank", points={"O": (0, 0), "B": (1, 0)}),
        md.Body("c1", points={"A": (0, 0), "B": (2, 0)}),
        md.Body("r1", points={"C": (0, 0), "B": (1, 0)}),
        md.Body("c2", points={"B": (0, 0), "D": (second, 0)}),
        md.Body("r2", points={"E": (0, 0), "D": (1, 0)}),
    ]
    joints = [
        md.Revolute("O", "ground.O", "crank.O"),
        md.Revolute("A", "crank.B", "c1.A"),
        md.Revolute("B", "c1.B", "r1.B"),
        md.Revolute("C", "ground.C", "r1.C"),
        md.Revolute("B2", f"{carrier}.B", "c2.B"),
        md.Revolute("D", "c2.D", "r2.D"),
        md.Revolute("E", "ground.E", "r2.E"),
    ]
    ground = md.Ground(points={"O": (0, 0), "C": (2, 0), "E": (base, 0)})
    sketched = {"crank": sketch, "c1": 0.0, "r1": sketch, "c2": 0.0, "r2": sketch}
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketched)


def anti(u: np.ndarray, d: float) -> np.ndarray:
    """The rocker of an antiparallelogram with cranks 1 and ground d: tan halves in one ratio."""
    return -2 * np.arctan((d + 1) / (d - 1) * np.tan(u / 2))


def through_zero(serial: bool, action: str) -> md.Result:
    driver = md.Driver("crank.angle", from_=0.6, to=-0.6)
    task = md.Sweep(driver, poses=25, on_change_point=action)
    return md.solve(parallelograms(serial), task)


@pytest.mark.parametrize("serial", [True, False])
def test_two_parallelograms_go_on_together(serial: bool) -> None:
    result = through_zero(serial, "continue")
    assert set(result.status) == {"ok"}
    for body in ("r1", "r2"):
        u = result.drivers["crank.angle"].position
        assert result.bodies[body].angle == pytest.approx(u, abs=1e-12)
    together = [e["together_with"] for e in result.events if e["kind"] == "change_point"]
    assert together == [["II.1 RRR(4,5)"], ["II.1 RRR(2,3)"]]


def test_side_by_side_both_switch() -> None:
    result = through_zero(False, "switch")
    u = result.drivers["crank.angle"].position
    assert set(result.status) == {"ok"}
    for body, d in (("r1", 2.0), ("r2", 3.0)):
        before, behind = u > 1e-9, u < -1e-9
        angle = result.bodies[body].angle
        assert angle[before] == pytest.approx(u[before], abs=1e-12)
        assert angle[behind] == pytest.approx(anti(u[behind], d), abs=1e-11)


def test_one_on_the_other_neither_is_switched_unasked() -> None:
    """Which of the three other ways is meant is not told by "switch"."""
    result = through_zero(True, "switch")
    u = result.drivers["crank.angle"].position
    assert set(result.status[u > 1e-9]) == {"ok"}
    assert set(result.status[u < -1e-9]) == {"unassembled"}
    events = [e for e in result.events if e["kind"] == "change_point" and abs(e["at"]) < 1]
    assert [(e["action"], e["at"]) for e in events] == [("stop", pytest.approx(0, abs=1e-12))] * 2
    assert "which of them is to switch is not told" in result.fault
