"""Dry friction along motions in space: closed forms, free bodies, the same motion in the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.attack.spatial_honesty import case
from tests.reference import coasting_rssr as rssr
from tests.shared.spatial_forces import massive, pose_of
from tests.shared.spatial_friction import jack, rubbed, rubbing

G = 9.81


def events(result: md.Result) -> list[tuple[str, float]]:
    return [(event.kind, event.time) for event in result.events]


# -- closed forms ----------------------------------------------------------------------------


def spindle_press(f: float) -> md.Mechanism:
    """Return a screw under 1000 N whose spindle and table have masses."""
    return jack(
        f, spindle={"mass": 2.0, "inertia": (0.1, 0.1, 0.01), "center": (0, 0, 0)},
        table={"mass": 3.0, "inertia": (0.1, 0.1, 0.1)},
    )  # fmt: skip


@pytest.mark.parametrize("share", [1.5, 0.5])
def test_a_screw_coasts_up_and_stays_or_runs_back(share: float) -> None:
    """I w' + (Q + m r tan(g) w') r tan(g +- rho) = 0; below rho = g it comes down again."""
    Q, r, inertia, mass, w, lead = 1000.0, 0.02, 0.01, 5.0, 30.0, 0.006 / (2 * np.pi)
    g = np.arctan(lead / r)
    rho = share * g
    up = -Q * r * np.tan(g + rho) / (inertia + mass * lead * r * np.tan(g + rho))
    stop = -w / up
    end = 2 * stop
    result = md.solve(
        spindle_press(np.tan(rho)),
        md.Motion(start={"nut.angle": 0}, start_speed={"nut.angle": w}, until=end, poses=41),
    )
    assert result.fault is None
    kind = "stick" if share > 1 else "reversal"
    assert [own for own, _ in events(result)] == [kind]
    assert events(result)[0][1] == pytest.approx(stop, rel=1e-12)
    t, angle = result.time, result.joints["nut"].angle
    top = -(w**2) / (2 * up)
    down = 0.0
    if share < 1:
        down = -Q * r * np.tan(g - rho) / (inertia + mass * lead * r * np.tan(g - rho))
    wanted = np.where(t < stop, w * t + up * t**2 / 2, top + down * (t - stop) ** 2 / 2)
    assert np.abs(angle - wanted).max() < 1e-11 * top
    assert result.checks["energy"] < 1e-12
    assert result.checks["balance"] < 1e-12
    if share > 1:
        lost = (inertia + mass * lead**2) * w**2 / 2 - Q * lead * top
        assert result.work["friction.nut"][-1] == pytest.approx(-lost, rel=1e-11)


def pendulum(keys: Any) -> md.Mechanism:
    """Return a body on a bearing about a skew axis."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[md.Body("rod", {"O": (0, 0, 0)}, mass=M, center=CENTRE, inertia=INERTIA)],
        joints=[md.SpatialRevolute("O", "ground.O", "rod.O", axis=AXIS, **keys)],
        gravity=(0, 0, -G),
    )


M, CENTRE, INERTIA = 2.0, (0.0, 0.1, 0.4), (0.02, 0.03, 0.015, 0.001, -0.002, 0.003)
AXIS = (1.0, 2.0, 0.5)
PIN = {"friction": 0.3, "pin_radius": 0.02, "contact_length": 0.1, "collar_radius": 0.015}


def bearing(t: float, y: Any) -> Any:
    """Return the rates of angle and speed of the pendulum: Newton and Euler, friction iterated."""
    a = np.array(AXIS) / np.linalg.norm(AXIS)
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    R = np.eye(3) + np.sin(y[0]) * K + (1 - np.cos(y[0])) * K @ K
    xx, yy, zz, xy, xz, yz = INERTIA
    J = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    c, w, weight = R @ CENTRE, y[1] * a, np.array([0, 0, -M * G])
    about = a @ J @ a + M * (c @ c - (a @ c) ** 2)
    moment, before, f = 0.0, 1.0, PIN["friction"]
    while abs(moment - before) > 1e-15:
        before = moment
        dw = (a @ np.cross(c, weight) - np.sign(y[1]) * moment) / about
        F = M * (np.cross(dw * a, c) + np.cross(w, np.cross(w, c))) - weight
        T = J @ a * dw + np.cross(w, J @ w) + np.cross(c, F)
        across, tilt = F - (a @ F) * a, np.cross(a, T)
        planes = [across / 2 + s * tilt / PIN["contact_length"] for s in (1, -1)]
        moment = PIN["pin_radius"] * np.sin(np.arctan(f)) * sum(map(np.linalg.norm, planes))
        moment += f * PIN["collar_radius"] * abs(a @ F)
    return [y[1], dw]


def test_a_pendulum_about_a_skew_axis_turns_back_where_free_bodies_say() -> None:
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    task = md.Motion(
        start={"O.angle": 1.0}, start_speed={"O.angle": 3.0}, until=20, tolerance=1e-12
    )
    result = md.solve(pendulum(PIN), task)
    found = events(result)
    assert found[-1][0] == "stick"
    assert {kind for kind, _ in found[:-1]} == {"reversal"}
    t, y = 0.0, [1.0, 3.0]
    for kind, when in found[:1]:

        def slows(t: float, y: Any) -> float:
            return float(y[1])

        slows.terminal = True
        slows.direction = -np.sign(y[1])
        path = solve_ivp(bearing, (t, t + 3), y, "DOP853", rtol=1e-11, atol=1e-12, events=slows)
        t, y = path.t[-1], path.y[:, -1]
        assert abs(t - when) < 1e-9, kind
        k = int(np.searchsorted(result.time, when))
        assert result.joints["O"].angle[k] == pytest.approx(y[0], abs=1e-9)
        y = [y[0], -1e-12 * np.sign(path.y[1, 0])]
    assert result.checks["energy"] < 1e-12
    assert result.checks["balance"] < 1e-13


def test_a_body_rests_until_friction_at_rest_is_overcome() -> None:
    """A block in an inclined guide under F t: it starts where F t = (f0 N) + weight along."""
    slope, mass, rate = 0.4, 3.0, 5.0
    axis = (np.cos(slope), 0, np.sin(slope))
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"G": (0, 0, 0)}),
        bodies=[md.Body("block", {"G": (0, 0, 0)}, mass=mass)],
        joints=[
            md.SpatialPrismatic(
                "guide", "ground.G", "block.G", axis=axis, friction=0.5, friction_static=0.6
            )
        ],
        loads=[md.Force("pull", "block.G", [f"{rate}*t*{own}" for own in axis])],
        gravity=(0, 0, -G),
    )
    normal, along = mass * G * np.cos(slope), mass * G * np.sin(slope)
    start = (0.6 * normal + along) / rate
    result = md.solve(
        mechanism,
        md.Motion(start={"guide.slide": 0}, start_speed={"guide.slide": 0}, at=(start, 9.0)),
    )
    assert events(result)[-1] == ("slip", pytest.approx(start, rel=1e-11))
    t = 9.0 - start
    pull = 0.1 * normal / mass
    assert result.joints["guide"].slide[-1] == pytest.approx(
        pull * t**2 / 2 + rate / mass * t**3 / 6, rel=1e-9
    )


# -- free bodies -----------------------------------------------------------------------------

BEARING = {"friction": 0.06, "pin_radius": 0.05, "contact_length": 0.3, "collar_radius": 0.04}
KINDS = {
    "revolute": BEARING,
    "universal": BEARING,
    "cylindrical": {"friction": 0.06, "contact_length": 0.3, "pin_radius": 0.04},
    "spherical": {"friction": 0.1, "ball_radius": 0.03},
    "screw": {"friction": 0.15, "thread_radius": 0.03},
    "prismatic": {"friction": 0.1, "contact_length": 0.3, "contact_width": 0.2},
}


ROUGH = ("revolute", "screw")


def off_free_bodies(result: md.Result, names: list[str]) -> float:
    """Return how far reactions are from those of free bodies, with friction as a load, relative."""
    worst = 0.0
    for k in range(len(result.time)):
        pose = pose_of(result, k)
        friction, loads = {name: np.zeros(6) for name in names}, list(pose.loads)
        change = 1.0
        while change > 1e-13:
            pose.loads = list(loads)
            for name, own in friction.items():
                contact = pose.contacts[name]
                for body, sign in ((contact.second, 1), (contact.first, -1)):
                    if body != "ground":
                        wrench = (sign * own[:3], sign * own[3:])
                        pose.loads.append((body, contact.place, *wrench))
            reactions, _, left, _ = pose.solve()
            before = friction
            friction = {n: rubbed(result, n, reactions[n] + own, k) for n, own in before.items()}
            size = max(float(np.abs(own).max()) for own in reactions.values())
            change = max(np.abs(friction[name] - before[name]).max() for name in names) / size
        worst = max(worst, left)
        for name, own in reactions.items():
            whole = own + friction.get(name, 0.0)
            gap = np.abs(result.joints[name].reaction[k] - whole).max()
            worst = max(worst, float(gap) / size)
    return worst


@pytest.mark.parametrize("loop", ["RSRC", "RSUR", "RHSC"])
def test_loops_slow_down_as_their_free_bodies_with_friction(loop: str) -> None:
    mechanism = massive(case(np.random.default_rng(11), loop).mechanism, seed=2)
    rough = {"RSUR": ("universal",), "RSRC": ("spherical", "cylindrical")}.get(loop, ROUGH)
    keys = {n: KINDS[j.kind] if j.kind in rough else {} for n, j in mechanism.joints.items()}
    start = {"start": {"J0.angle": 0.0}, "start_speed": {"J0.angle": 2.0}}
    task = md.Motion(**start, until=0.05, poses=2, tolerance=1e-12)
    result = md.solve(rubbing(mechanism, **keys), task)
    assert result.fault is None
    assert off_free_bodies(result, [name for name, own in keys.items() if own]) < 1e-12
    assert result.checks["energy"] < 1e-11
    assert result.checks["balance"] < 1e-13


def coasting_rssr() -> md.Mechanism:
    """Return the mechanism of `tests.reference.coasting_rssr`."""
    bearing = {
        "friction": rssr.F, "pin_radius": rssr.PIN, "contact_length": rssr.PLANES,
        "collar_radius": rssr.COLLAR,
    }  # fmt: skip
    (m1, J1, c1), (m2, J2, c2), (m3, across) = rssr.CRANK, rssr.ROCKER, rssr.ROD
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": rssr.A, "D": rssr.D}),
        bodies=[
            md.Body(
                "crank", {"A": (0, 0, 0), "B": (rssr.R1, 0, 0)}, mass=m1, center=c1,
                inertia=np.diag(J1),
            ),
            md.Body(
                "bar", {"B": (0, 0, 0), "C": (rssr.BAR, 0, 0)}, mass=m3,
                center=(rssr.BAR / 2, 0, 0), inertia=(0, across, across),
            ),
            md.Body(
                "rocker", {"D": (0, 0, 0), "C": (rssr.R2, 0, rssr.HEIGHT)}, mass=m2, center=c2,
                inertia=np.diag(J2),
            ),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "crank.A", axis=(0, 0, 1), **bearing),
            md.Spherical("B", "crank.B", "bar.B"),
            md.Spherical("C", "rocker.C", "bar.C"),
            md.SpatialRevolute(
                "D", "ground.D", "rocker.D", axis=(1, 0, 0), zero=(0, 1, 0), axis2=(0, 0, 1),
                zero2=(1, 0, 0), **bearing,
            ),
        ],
        gravity=rssr.GRAVITY,
        sketch={"A": 0, "rocker.C": (0.12, 0.15, 0.15)},
    )  # fmt: skip


def test_an_rssr_coasts_to_rest_as_its_free_bodies_do() -> None:
    pytest.importorskip("scipy.integrate")
    task = md.Motion(start={"A.angle": 3.0}, start_speed={"A.angle": 2.5}, until=1, tolerance=1e-12)
    result = md.solve(coasting_rssr(), task)
    assert result.fault is None
    ((kind, stopped),) = events(result)
    assert kind == "stick"
    assert result.summary["rests_from"] == stopped
    phi = float(result.joints["D"].angle[0])
    when, where = rssr.Coasting(phi).stop(3.0, 2.5, 1.0)
    assert stopped == pytest.approx(when, rel=1e-8)
    k = int(np.searchsorted(result.time, stopped))
    assert result.joints["A"].angle[k] == pytest.approx(where, rel=1e-8)
    assert result.checks["energy"] < 1e-12
    assert result.checks["balance"] < 1e-13


# -- the same in the plane -------------------------------------------------------------------

CRANK, ROD, PIN_RADIUS, F = 0.05, 0.2, 0.015, 0.6


def coasting(space: bool) -> md.Mechanism:
    """Return a slider-crank with friction in its pins, in the plane or of pairs of space."""
    d = 3 if space else 2

    def at(*place: float) -> tuple[float, ...]:
        return (*place, 0.0)[:d]

    def inertia(value: float) -> Any:
        return (value, value, value) if space else value

    pin = {"friction": F, "pin_radius": PIN_RADIUS}
    turn: Any = {"axis": (0, 0, 1)} if space else {}
    hinge: Any = md.SpatialRevolute if space else md.Revolute
    guide: Any = md.SpatialPrismatic if space else md.Prismatic
    return md.Mechanism(
        dimension=d,
        ground=md.Ground({"O": at(0, 0)}),
        bodies=[
            md.Body("crank", {"O": at(0, 0), "A": at(CRANK, 0)}, mass=1.0, inertia=inertia(0.02)),
            md.Body(
                "rod", {"A": at(0, 0), "B": at(ROD, 0)}, mass=0.5, inertia=inertia(0.002),
                center=at(ROD / 2, 0),
            ),
            md.Body("slider", {"B": at(0, 0)}, mass=0.8, inertia=inertia(0.001)),
        ],
        joints=[
            hinge("O", "ground.O", "crank.O", **pin, **turn),
            hinge("A", "crank.A", "rod.A", **pin, **turn),
            hinge("B", "rod.B", "slider.B", **pin, **turn),
            guide("G", "ground.O", "slider.B", axis=(1, 0, 0) if space else 0.0),
        ],
        gravity=at(0, -G),
        sketch={"O" if space else "crank": 0.3, "slider.B.x": 0.24},
    )  # fmt: skip


def test_a_slider_crank_of_spatial_pairs_stops_where_that_of_the_plane_does() -> None:
    """Three redundant constraints leave the forces in the plane, on which friction lives."""
    keys = {"until": 8.0, "tolerance": 1e-11}
    start = {"start": {"O.angle": 0.3}, "start_speed": {"O.angle": 12.0}}
    plane, space = (md.solve(coasting(own), md.Motion(**start, **keys)) for own in (False, True))
    assert plane.fault is space.fault is None
    assert space.summary["superfluous_equations"] == 3
    assert plane.summary["rests_from"] == pytest.approx(space.summary["rests_from"], rel=1e-9)
    told = [
        sorted((event.kind, getattr(event, "joint", None) or "") for event in own.events)
        for own in (plane, space)
    ]
    assert told[0] == told[1]
    assert plane.joints["O"].angle[-1] == pytest.approx(space.joints["O"].angle[-1], abs=1e-9)
    assert space.checks["energy"] < 1e-9
    assert space.checks["balance"] < 1e-12


# -- what there is to say ----------------------------------------------------------------------


def test_smoothed_friction_of_a_screw_creeps() -> None:
    """Where it should rest it goes down with w artanh(load / limit)."""
    f, g = 0.12, np.arctan(0.006 / (2 * np.pi * 0.02))
    task = md.Motion(
        start={"nut.angle": 0}, start_speed={"nut.angle": 0}, until=2.0, friction="smooth",
        omega_s=1e-4,
    )  # fmt: skip
    result = md.solve(spindle_press(f), task)
    # tan(g) = tan(rho) s at the share s of the coefficient with which the load is balanced
    share = np.tan(g) / f
    creep = 1e-4 * np.arctanh(share)
    assert result.joints["nut"].angle_velocity[-1] == pytest.approx(-creep, rel=1e-6)


def test_friction_on_forces_that_are_open_is_refused() -> None:
    tilting = {"friction": 0.1, "pin_radius": 0.01, "contact_length": 0.1}
    mechanism = rubbing(coasting(True), A=tilting)
    with pytest.raises(md.IndeterminateFrictionError, match="press on A"):
        md.solve(mechanism, md.Motion(start={"O.angle": 0.3}, until=0.1))
