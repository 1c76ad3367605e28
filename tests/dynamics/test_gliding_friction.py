"""Friction of balls and of pairs that slide and turn along motions: closed forms, free bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.shared.gliding import RHO, F, G, J, M, R, coast, on_ball, sleeve, turning


def rates(push: Any, moment: Any, inertia: float = J) -> Any:
    """Return the rates of (slide, angle, their speeds) of the sleeve that moves."""

    def found(t: float, y: Any) -> Any:
        v, u = y[2], R * y[3]
        speed = np.hypot(v, u)
        size = F * M * G / np.sqrt(1 + (F * u / speed) ** 2)
        back = size * np.array([v, u]) / speed
        return [y[2], y[3], (push(t) - back[0]) / M, (moment(t) - R * back[1]) / inertia]

    return found


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 1.0])
def test_a_sleeve_of_one_inertia_stops_on_a_straight_line(share: float) -> None:
    """With J = m r^2 sliding and turning keep their ratio: a = f g / sqrt(1 + (f sin)^2)."""
    speed = 1.3
    along, around = speed * np.sqrt(1 - share**2), speed * share
    result = coast(sleeve(M * R**2), along, around / R, tolerance=1e-11)
    a = F * G / np.sqrt(1 + (F * share) ** 2)
    ((kind, when),) = [(event.kind, event.time) for event in result.events]
    assert kind == "stick"
    assert when == pytest.approx(speed / a, rel=2e-9)  # told at 1e-9 of the speed
    assert result.summary["rests_from"] == when
    own, way = result.joints["C"], speed**2 / (2 * a)
    assert own.slide[-1] == pytest.approx(way * along / speed, abs=1e-11)
    assert R * own.angle[-1] == pytest.approx(way * share, abs=1e-11)
    assert result.work["friction.C"][-1] == pytest.approx(-M * speed**2 / 2, rel=1e-12)
    assert result.checks["energy"] < 1e-12


def test_a_sleeve_of_any_inertia_stops_where_an_integration_says() -> None:
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    result = coast(sleeve(contact_length=0.1), 1.0, 15.0, tolerance=1e-11)

    def rests(t: float, y: Any) -> float:
        return float(np.hypot(y[2], R * y[3])) - 1e-8

    rests.terminal = True
    none = lambda t: 0.0  # noqa: E731
    path = solve_ivp(
        rates(none, none), (0, 3), [0, 0, 1.0, 15.0], "DOP853", rtol=1e-12, atol=1e-14, events=rests
    )
    (event,) = result.events
    assert event.kind == "stick"
    assert event.time == pytest.approx(path.t[-1], abs=1e-8)
    own = result.joints["C"]
    assert own.slide[-1] == pytest.approx(path.y[0, -1], abs=1e-10)
    assert own.angle[-1] == pytest.approx(path.y[1, -1], abs=1e-9)
    assert result.checks["energy"] < 1e-12


def test_a_sleeve_starts_where_force_and_moment_together_reach_the_limit() -> None:
    """F^2 + (1 + f^2) (M/r)^2 = (f N)^2, and it goes on as an integration from there."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    push, moment = 3.0, 0.12
    loads = (
        md.Force("push", "sleeve.O", [f"{push}*t", 0, 0]),
        md.Torque("turn", "sleeve", [f"{moment}*t", 0, 0]),
    )
    start = F * M * G / np.sqrt(push**2 + (1 + F**2) * (moment / R) ** 2)
    end = start + 0.7
    result = coast(sleeve(J, *loads), 0.0, 0.0, until=end)
    assert result.events[-1].kind == "slip"
    assert result.events[-1].time == pytest.approx(start, rel=1e-9)
    small = 1e-7 * np.array([push / M, moment / J])  # the way both are pulled there
    path = solve_ivp(
        rates(lambda t: push * t, lambda t: moment * t), (start, end), [0, 0, *small], "Radau",
        rtol=1e-10, atol=1e-13,
    )  # fmt: skip
    own = result.joints["C"]
    assert own.slide[-1] == pytest.approx(path.y[0, -1], rel=1e-5)
    assert own.angle[-1] == pytest.approx(path.y[1, -1], rel=1e-5)
    assert result.checks["energy"] < 1e-11


def test_what_holds_a_sleeve_is_part_of_its_reaction() -> None:
    loads = md.Force("push", "sleeve.O", [1, 0, 0]), md.Torque("turn", "sleeve", [0.02, 0, 0])
    result = coast(sleeve(J, *loads), 0.0, 0.0, until=0.1)
    assert not result.events
    wanted = [-1.0, 0, M * G, -0.02, 0, 0]
    assert np.allclose(result.joints["C"].reaction, wanted, rtol=0, atol=1e-12)


# -- balls -----------------------------------------------------------------------------------


def test_a_round_body_about_its_ball_stops_in_time() -> None:
    """J w' = -rho m g about any level axis."""
    inertia, w = 0.05, np.array([3.0, 4.0, 0.0])
    result = md.solve(on_ball((0, 0, 0), (inertia,) * 3), turning(w, until=2.0, tolerance=1e-12))
    back = RHO * M * G / inertia
    (event,) = result.events
    assert (event.kind, event.joint) == ("stick", "O")
    assert event.time == pytest.approx(5.0 / back, rel=2e-9)
    angle = 25.0 / (2 * back)
    assert result.points["rod.P"].position[-1, 2] == pytest.approx(-np.cos(angle), abs=1e-10)
    assert result.work["friction.O"][-1] == pytest.approx(-inertia * 25 / 2, rel=1e-11)
    assert result.checks["energy"] < 1e-12


def test_a_spin_about_the_load_is_left_and_said() -> None:
    """The level part of the spin goes at rho m g / J; what is left has no law (F6)."""
    inertia, w = 0.05, np.array([3.0, 0.0, 2.0])
    result = md.solve(on_ball((0, 0, 0), (inertia,) * 3), turning(w, until=2.0))
    assert "O turns about the line of its load (F6)" in result.fault
    assert result.events[-1].code == "F6"
    when = 3.0 / (RHO * M * G / inertia)
    assert result.events[-1].time == pytest.approx(when, rel=2e-3)  # told at a sine of 1e-3
    assert result.bodies["rod"].angular_velocity[-2, 2] == pytest.approx(2.0, rel=1e-9)


def test_a_pendulum_on_a_ball_swings_in_its_plane_like_one_in_the_plane() -> None:
    """Turning points of J a'' = -m g l sin(a) -+ rho |F|, integrated for itself."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    length, about = 0.5, 0.05 + M * 0.25

    def swing(sense: float) -> Any:
        def found(t: float, y: Any) -> Any:
            a, moment = 0.0, 0.0
            for _ in range(100):
                a = (-M * G * length * np.sin(y[0]) - sense * moment) / about
                across = M * length * a + M * G * np.sin(y[0])
                along = M * length * y[1] ** 2 + M * G * np.cos(y[0])
                moment = RHO * float(np.hypot(across, along))
            return [y[1], a]

        return found

    def stands(t: float, y: Any) -> float:
        return float(y[1])

    stands.terminal = True
    mechanism = on_ball((0, 0, -length), (0.05, 0.05, 0.01))
    task = md.Motion(start={"rod.P.x": -np.sin(1.0), "rod.P.y": 0.0, "rod.Q.y": 0.0},
                     until=25.0, tolerance=1e-11)  # fmt: skip
    result = md.solve(mechanism, task)
    assert result.fault is None
    t, y, sense = 0.0, [1.0, -1e-9], -1.0
    for event in result.events[:3]:
        assert event.kind == "reversal"
        path = solve_ivp(
            swing(sense), (t, t + 2), y, "DOP853", rtol=1e-10, atol=1e-12, events=stands
        )
        t, y, sense = path.t[-1], [path.y[0, -1], -1e-9 * sense], -sense
        assert event.time == pytest.approx(t, abs=2e-8)
        k = int(np.searchsorted(result.time, event.time))
        assert result.points["rod.P"].position[k, 0] == pytest.approx(-np.sin(y[0]), abs=1e-8)
    assert result.events[-1].kind == "stick"
    tilt = abs(np.arcsin(result.points["rod.P"].position[-1, 0]))
    assert M * G * length * np.sin(tilt) <= RHO * M * G
    assert result.checks["energy"] < 1e-10


def test_a_body_on_a_rough_ball_against_newton_and_euler() -> None:
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    c, w0 = np.array([0, 0.02, -0.5]), np.array([1.0, 2.0, -3.0])
    own = np.array([[0.05, 0.001, 0], [0.001, 0.06, 0.002], [0, 0.002, 0.01]])
    mechanism = on_ball(tuple(c), (0.05, 0.06, 0.01, 0.001, 0, 0.002))
    result = md.solve(mechanism, turning(w0, until=0.6, tolerance=1e-12))

    def turn(e: Any) -> Any:
        w, v = e[0], e[1:]
        K = np.cross(np.eye(3), v)
        return np.eye(3) + 2 * w * K + 2 * K @ K

    def found(t: float, y: Any) -> Any:
        e, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        A = turn(e)
        r, inertia = A @ c, A @ own @ A.T
        weight, moment = np.array([0, 0, -M * G]), np.zeros(3)
        whole = inertia + M * (r @ r * np.eye(3) - np.outer(r, r))
        for _ in range(60):
            inwards = np.cross(w, np.cross(w, r))
            torque = np.cross(r, weight - M * inwards) + moment - np.cross(w, inertia @ w)
            dw = np.linalg.solve(whole, torque)
            load = M * (np.cross(dw, r) + inwards) - weight
            line = load / np.linalg.norm(load)
            sliding = w - (w @ line) * line  # the spin across the load
            moment = -RHO * np.linalg.norm(load) * sliding / np.linalg.norm(sliding)
        de = 0.5 * np.array([-e[1:] @ w, *(e[0] * w + np.cross(w, e[1:]))])
        return np.r_[de, dw]

    path = solve_ivp(found, (0, 0.6), np.r_[1, 0, 0, 0, w0], "DOP853", rtol=1e-11, atol=1e-12)
    end = path.y[:, -1]
    place = turn(end[:4] / np.linalg.norm(end[:4])) @ [0, 0, -1]
    assert np.abs(result.points["rod.P"].position[-1] - place).max() < 1e-10
    assert np.abs(result.bodies["rod"].angular_velocity[-1] - end[4:]).max() < 1e-9
    assert result.checks["energy"] < 1e-12
    assert result.checks["balance"] < 1e-13


@pytest.mark.parametrize("method", ["bdf", "radau", "auto"])
def test_stiff_methods_are_refused(method: str) -> None:
    with pytest.raises(md.UnavailableError, match="of C needs the explicit method"):
        coast(sleeve(), 1.0, 1.0, method=method)


def test_smoothed_friction_of_balls_is_refused() -> None:
    task = turning(np.array([1.0, 0, 0]), until=1.0, friction="smooth", omega_s=1e-3)
    with pytest.raises(md.UnavailableError, match="balls and pairs that slide and turn: joints O"):
        md.solve(on_ball((0, 0, 0), (0.05,) * 3), task)
