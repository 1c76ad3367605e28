"""One-sided contacts: where they would have to pull. Truths: closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md

R, RHO, E, MASS, G = 0.03, 0.01, 0.015, 0.4, 9.81
STIFFNESS, FREE, OMEGA = 300.0, 0.08, 50.0


def cam(one_sided: str | None = "right", roller: str | None = "rho"):
    """An eccentric disk under a roller in a vertical guide through its pivot."""
    loads = [
        md.Spring("spring", between=("ground.T", "follower.R"), stiffness="k", free_length="l0")
    ]
    return md.Mechanism(
        parameters={"k": STIFFNESS, "l0": FREE, "e": E, "R": R, "rho": RHO, "m": MASS},
        ground=md.Ground({"O": (0, 0), "T": (0, 0.1)}),
        bodies=[
            md.Body("cam", {"O": (0, 0)}),
            md.Body("follower", {"R": (0, 0)}, mass="m", center=(0, 0)),
        ],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Prismatic("guide", "ground.O", "follower.R", axis=np.pi / 2),
            md.Curve(
                "profile", "cam.O", "follower.R", x="e + R*cos(s)", y="R*sin(s)", closed=True,
                roller_radius=roller, one_sided=one_sided,
            ),
        ],
        loads=loads,
        gravity=(0.0, -G),
        sketch={"cam": 0.0, "guide": 0.04},
    )  # fmt: skip


def height(theta):
    return E * np.sin(theta) + np.sqrt((R + RHO) ** 2 - (E * np.cos(theta)) ** 2)


def normal(theta, omega=OMEGA):
    """The force along the line of centres, from Newton's law of the follower."""
    theta = np.asarray(theta, np.longdouble)
    root = np.sqrt((R + RHO) ** 2 - (E * np.cos(theta)) ** 2)
    # y'' of e sin + root, root' = e^2 sin cos / root
    first = E**2 * np.sin(theta) * np.cos(theta) / root
    second = (E**2 * np.cos(2 * theta) - first**2) / root
    rise = omega**2 * (second - E * np.sin(theta))
    push = STIFFNESS * (FREE - (0.1 - height(theta)))
    return (MASS * (rise + G) + push) * (R + RHO) / root


def zeros(force):
    """Places in a turn where a force changes its sign, falling first."""
    grid = np.linspace(0, 2 * np.pi, 2001)
    values = force(grid)
    found = []
    for k in np.flatnonzero(values[1:] * values[:-1] < 0):
        a, b = np.longdouble(grid[k]), np.longdouble(grid[k + 1])
        for _ in range(70):
            middle = (a + b) / 2
            a, b = (middle, b) if force(middle) * values[k] > 0 else (a, middle)
        found.append(float(a))
    return found


def turn(mechanism, omega=OMEGA, poses=13, **keys):
    driver = md.Driver("cam.angle", from_=0.0, to=2 * np.pi, speed=omega)
    return md.solve(mechanism, md.Reactions(driver, poses=poses, **keys))


def test_a_roller_lifts_off_where_its_cam_would_have_to_pull() -> None:
    result = turn(cam())
    falls, rises = zeros(normal)
    (event,) = [e for e in result.events if e["kind"] == "lift_off"]
    assert event["joint"] == "profile"
    assert event["at"] == pytest.approx(falls, abs=1e-12)
    assert event["until"] == pytest.approx(rises, abs=1e-12)
    grid = np.linspace(0, 2 * np.pi, 200_001)
    assert event["force"] == pytest.approx(float(normal(grid).min()), rel=1e-9)
    assert event["strongest_at"] == pytest.approx(grid[normal(grid).argmin()], abs=1e-4)
    assert set(result.status) == {"ok"}
    assert result.fault is None
    assert any("lifts off" in note and "not modelled" in note for note in result.summary["notes"])
    at = result.drivers["cam.angle"].position
    assert -result.joints["profile"].normal == pytest.approx(normal(at).astype(float), rel=1e-11)


def test_short_arcs_between_poses_are_found_and_slow_cams_hold() -> None:
    """The speed at which the least force is just below zero: an arc of a few degrees."""
    low, high = 1.0, OMEGA
    grid = np.linspace(0, 2 * np.pi, 40_001)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if normal(grid, middle).min() > 0 else (low, middle)
    just = high * (1 + 1e-9)
    result = turn(cam(), omega=just, poses=2)
    (event,) = [e for e in result.events if e["kind"] == "lift_off"]
    assert 0 < event["until"] - event["at"] < 1e-3
    assert event["strongest_at"] == pytest.approx(grid[normal(grid, just).argmin()], abs=1e-3)
    held = turn(cam(), omega=low * (1 - 1e-6))
    assert not [e for e in held.events if e["kind"] == "lift_off"]
    assert "notes" not in held.summary


def test_only_what_is_declared_is_watched_and_the_side_counts() -> None:
    assert not [e for e in turn(cam(None)).events if e["kind"] == "lift_off"]
    with pytest.raises(md.MechanismError, match="the roller lies on the right"):
        turn(cam("left"))
    mechanism = cam("left", roller=None)  # the point lies outside, which is right of the curve
    (event,) = [e for e in turn(mechanism, omega=1.0).events if e["kind"] == "lift_off"]
    assert (event["at"], event["until"]) == pytest.approx((0, 2 * np.pi))


def test_ropes_props_teeth_and_blocks() -> None:
    """A bar swung by a crank: centripetal against gravity; a block that tips over its edge."""
    omega = 3.0
    length, mass = 0.5, 2.0

    def swing(one_sided):
        return md.Mechanism(
            ground=md.Ground({"O": (0, 0)}),
            bodies=[
                md.Body("arm", {"O": (0, 0)}),
                md.Body("stone", {"C": (0, 0)}, mass=mass, inertia=1e-3, center=(0, 0)),
            ],
            joints=[
                md.Revolute("O", "ground.O", "arm.O"),
                md.Prismatic("slide", "arm.O", "stone.C"),
                md.Distance("rope", "ground.O", "stone.C", length=length, one_sided=one_sided),
            ],
            gravity=(0.0, -G),
            sketch={"arm": 0.0, "stone": 0.0, "slide": length},
        )

    driver = md.Driver("arm.angle", from_=-np.pi / 2, to=1.5 * np.pi, speed=omega)
    task = md.Reactions(driver, poses=9)
    slack = np.arcsin(omega**2 * length / G)
    events = [e for e in md.solve(swing("pull"), task).events if e["kind"] == "lift_off"]
    # pull towards O = m (w^2 l - g sin): slack where sin theta > w^2 l / g
    assert [(e["at"], e["until"]) for e in events] == [
        pytest.approx((slack, np.pi - slack), abs=1e-12)
    ]
    assert events[0]["force"] == pytest.approx(mass * (omega**2 * length - G), rel=1e-12)
    pushes = [e for e in md.solve(swing("push"), task).events if e["kind"] == "lift_off"]
    assert len(pushes) == 2
    assert pushes[0]["until"] == pytest.approx(slack, abs=1e-12)


def test_bad_values_are_refused_with_the_choices() -> None:
    with pytest.raises(md.InputError, match="one_sided") as caught:
        md.Distance("rope", "ground.O", "a.A", length=1.0, one_sided="left")
    assert "pull" in str(caught.value)


def test_a_motion_says_when_its_contacts_would_pull() -> None:
    """A stone on a rope, an arm of no mass beside it, let go above the pivot."""
    length, start = 0.5, 0.8 * np.pi  # from straight down
    stone = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("arm", {"O": (0, 0)}),
            md.Body("stone", {"C": (0, 0)}, mass=2.0, inertia=0.0, center=(0, 0)),
        ],
        joints=[
            md.Revolute("O", "ground.O", "arm.O"),
            md.Prismatic("slide", "arm.O", "stone.C"),
            md.Distance("rope", "ground.O", "stone.C", length=length, one_sided="pull"),
        ],
        gravity=(0.0, -G),
        sketch={"arm": start - np.pi / 2, "stone": start - np.pi / 2, "slide": length},
    )
    task = md.Motion(start={"arm.angle": start - np.pi / 2}, until=0.6, poses=7)
    result = md.solve(stone, task)
    (event,) = [e for e in result.events if e["kind"] == "lift_off"]
    # from rest w^2 = 2 g (cos a - cos start) / l, pull m (w^2 l + g cos a)
    assert event["at"] == pytest.approx(0.0, abs=1e-12)
    assert event["force"] == pytest.approx(2.0 * G * np.cos(start), rel=1e-9)
    angle = np.arccos(2 * np.cos(start) / 3)
    x, w = np.polynomial.legendre.leggauss(400)
    # the time down to that angle, with a = start - s^2 (the root at rest vanishes)
    edge = np.sqrt(start - angle)
    s = edge * (x + 1) / 2
    rate = np.sqrt(2 * G / length * (np.cos(start - s**2) - np.cos(start)))
    time = float(np.sum(w * edge / 2 * 2 * s / rate))
    assert event["until"] == pytest.approx(time, rel=1e-8)
    assert any("rope" in note and "would have to pull" in note for note in result.summary["notes"])


def test_a_driven_motion_lifts_off_where_the_reactions_task_says() -> None:
    whole = 2 * np.pi / OMEGA
    task = md.Motion(drivers=(md.Driver("cam.angle", law=f"{OMEGA}*t"),), until=whole, poses=5)
    (event,) = [e for e in md.solve(cam(), task).events if e["kind"] == "lift_off"]
    falls, rises = zeros(normal)
    assert event["at"] == pytest.approx(falls / OMEGA, rel=1e-9)
    assert event["until"] == pytest.approx(rises / OMEGA, rel=1e-9)
    grid = np.linspace(0, 2 * np.pi, 200_001)
    assert event["force"] == pytest.approx(float(normal(grid).min()), rel=1e-7)
