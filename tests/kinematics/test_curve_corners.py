"""Cams made of pieces: over their corners, at them, and next to them."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from tests.shared.mechanisms import SPEED, cam

PI = np.pi
RISE = 2 * PI / 3
ROLLER = 0.01
UP = f"min(max(s/({RISE!r}),0),1)"
DOWN = f"min(max((s-pi)/({RISE!r}),0),1)"
HARMONIC = f"(0.05 - 0.01*cos(pi*{UP}) - 0.01*(1 - cos(pi*{DOWN})))"
UNIFORM = f"(0.04 + 0.02*{UP} - 0.02*{DOWN})"
HEART = "(0.04 + 0.02*min(s/4, (2*pi-s)/(2*pi-4)))"


def polar(radius: str, roller: float | None = None, start: float = 1.0, lift: float = 0.055):
    return cam(f"{radius}*cos(s)", f"{radius}*sin(s)", roller, lift, start)


def at(mechanism: md.Mechanism, angles, **keys) -> md.Result:
    driver = md.Driver("cam.angle", at=[float(a) for a in angles], speed=SPEED)
    return md.solve(mechanism, md.Sweep(driver, **keys))


def harmonic(s, derivatives: int = 2):
    """Return r, r' and r'' of the harmonic cam at places inside its pieces."""
    k = PI / RISE
    up, down = ((s > low) & (s < low + RISE) for low in (0.0, PI))
    r = 0.05 - 0.01 * np.cos(k * np.clip(s, 0, RISE))
    r = r - 0.01 * (1 - np.cos(k * np.clip(s - PI, 0, RISE)))
    first = 0.01 * k * (np.sin(k * s) * up - np.sin(k * (s - PI)) * down)
    second = 0.01 * k**2 * (np.cos(k * s) * up - np.cos(k * (s - PI)) * down)
    return r, first, second


def of_roller(s):
    """Return the cam's angle, the guide's slide, velocity and acceleration with a roller.

    From the pitch curve z(s): the centre is at i g = z exp(i theta).
    """
    r, r1, r2 = harmonic(s)
    e = np.exp(1j * s)
    c1, c2 = (r1 + 1j * r) * e, (r2 - r + 2j * r1) * e
    r3 = -((PI / RISE) ** 2) * r1
    c3 = (r3 - 3 * r1 + 1j * (3 * r2 - r)) * e
    speed = np.abs(c1)
    unit = c1 / speed
    bend = (np.conj(c1) * c2).imag / speed**2  # d(arg c')/ds
    slope = (np.conj(c1) * c3).imag / speed**2 - 2 * bend * (np.conj(c1) * c2).real / speed**2
    z = r * e - 1j * ROLLER * unit
    z1 = c1 + ROLLER * bend * unit
    z2 = c2 + ROLLER * (slope * unit + 1j * bend**2 * unit)
    g = np.abs(z)
    log1 = z1 / z
    log2 = z2 / z - log1**2
    theta1, theta2 = -log1.imag, -log2.imag
    g1, g2 = g * log1.real, g * (log2.real + log1.real**2)
    velocity = g1 / theta1 * SPEED
    acceleration = (g2 - g1 * theta2 / theta1) / theta1**2 * SPEED**2
    return PI / 2 - np.angle(z), g, velocity, acceleration


def test_a_roller_passes_where_the_curvature_jumps() -> None:
    """Over all four corners of rise, dwell, return, dwell; rates between them as derived."""
    s = np.sort(np.concatenate([np.linspace(-0.9, 5.2, 60), [1e-6, RISE - 1e-6, RISE + 1e-6]]))
    angles, g, velocity, acceleration = of_roller(np.mod(s, 2 * PI))
    angles = np.unwrap(angles)
    result = at(polar(HARMONIC, ROLLER), angles)
    assert result.fault is None
    guide = result.joints["guide"]
    assert np.all(np.abs(guide.slide - g) <= result.bound.length)
    assert np.abs(guide.slide_velocity - velocity).max() <= 1e-12
    assert np.abs(guide.slide_acceleration - acceleration).max() <= 1e-10


def test_the_way_over_a_corner_may_end_at_it() -> None:
    corner, g, *_ = of_roller(np.array([RISE]))
    for angles in (corner, [1.0, corner[0]], [corner[0], 1.0]):
        result = at(polar(HARMONIC, ROLLER), angles)
        assert set(result.status) == {"ok"}
        k = int(np.argmin(np.abs(np.asarray(angles) - corner)))
        assert result.joints["guide"].slide[k] == pytest.approx(g[0], rel=1e-14)
        assert np.isnan(result.joints["guide"].slide_acceleration[k])


@pytest.mark.parametrize(("radius", "order"), [(UNIFORM, 1), (HARMONIC, 2)])
def test_no_rate_is_claimed_that_has_two_values(radius: str, order: int) -> None:
    """Half a unit of a derivative is neither its value on the left nor that on the right."""
    corners = PI / 2 - np.array([0.0, RISE])
    result = at(polar(radius), [*corners, *(corners - 1e-7), *(corners + 1e-7)])
    assert result.fault is None
    guide = result.joints["guide"]
    rates = np.stack([guide.slide_velocity, guide.slide_acceleration])
    assert np.isnan(rates[order - 1 :, :2]).all()
    assert np.isfinite(rates[: order - 1, :2]).all()
    assert np.isfinite(rates[:, 2:]).all()
    left, right = (rates[order - 1, k : k + 2] for k in (2, 4))
    assert np.all(np.abs(left - right) > 0.01)
    assert np.isfinite(result.bodies["cam"].angular_velocity).all()  # the cam itself has them
    (note,) = [note for note in result.summary["notes"] if "poses at" in note]
    assert "profile: poses at corners of the curve, cam.angle = 90 deg, -30 deg" in note


def test_the_third_rate_of_a_cam_of_degree_five() -> None:
    x = UP
    radius = f"(0.04 + 0.02*({x})**3*(10 - 15*({x}) + 6*({x})**2))"
    corner = PI / 2 - RISE
    mechanism = cam(f"{radius}*cos(s)", f"{radius}*sin(s)", None, 0.05, 1.0, closed=False,
                    range=(-1, 4))  # fmt: skip
    guide = at(mechanism, [corner, corner - 1e-3], derivatives=3).joints["guide"]
    assert guide.slide_acceleration[0] == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(guide.slide_jerk[0])
    assert guide.slide_jerk[1] == 0.0


def test_forces_at_a_corner_are_not_those_of_half_an_acceleration() -> None:
    mechanism = polar(HARMONIC)
    bodies = [md.Body("cam", {"O": (0, 0)}), md.Body("follower", {"N": (0, 0)}, mass=2.0)]
    loaded = md.Mechanism(
        ground=mechanism.ground, bodies=bodies, joints=[*mechanism.joints.values()],
        sketch=dict(mechanism.sketch),
    )  # fmt: skip
    corner = PI / 2 - RISE
    driver = md.Driver("cam.angle", at=[corner + 1e-4, corner, corner - 1e-4], speed=SPEED)
    forces = md.solve(loaded, md.Reactions(driver)).joints["profile"].reaction[:, 1]
    assert np.isfinite(forces).tolist() == [True, False, True]
    assert forces[0] == pytest.approx(-2 * 0.01 * (PI / RISE * SPEED) ** 2, rel=1e-5)


@pytest.mark.parametrize("start", [-20, -31])
def test_a_whole_turn_ends_where_it_is_asked_to(start: float) -> None:
    """The goal differs from so and so many steps by a rounding, which is no step of its own."""
    first = np.radians(start + 90.0)
    mechanism = polar(HEART, start=float(first), lift=0.043)
    driver = md.Driver("cam.angle", from_=float(first), to=float(np.radians(start - 270.0)))
    result = md.solve(mechanism, md.Sweep(driver, poses=5))
    assert set(result.status) == {"ok"}
    assert result.events == ()


def test_a_pose_a_hair_behind_a_corner() -> None:
    """The largest step and the goal are a rounding of the way apart, the corner in between."""
    radius = f"(0.04 + 0.02*min(max((s-pi/2)/({RISE!r}),0),1))"  # its corner at cam.angle = 0
    mechanism = cam(f"{radius}*cos(s)", f"{radius}*sin(s)", None, 0.05, -PI / 3, closed=False,
                    range=(-1, 4))  # fmt: skip
    hair = np.radians(1e-9)
    result = at(mechanism, [-hair, 0.0, hair, np.radians(-119.9)])
    assert set(result.status) == {"ok"}
    assert result.events == ()


@pytest.mark.parametrize("roller", [None, ROLLER])
def test_a_follower_turns_back_once_in_each_dwell(roller: float | None) -> None:
    """At rest its velocity is rounding, whose zeros are no reversals of their own."""
    rise, fall = (f"10*({x})**3 - 15*({x})**4 + 6*({x})**5" for x in (UP, DOWN))
    mechanism = polar(f"(0.04 + 0.02*({rise}) - 0.02*({fall}))", roller, lift=0.05)
    driver = md.Driver("cam.angle", from_=0.0, to=2 * PI)
    result = md.solve(mechanism, md.Sweep(driver, poses=37, measures=("curve",)))
    path = result.summary["curve"]["follower.N"]
    assert path["length"] == pytest.approx(0.04, rel=1e-12)
    ends = sorted(entry["position"][1] for entry in path["reversals"])
    assert ends == pytest.approx([0.04 + (roller or 0), 0.06 + (roller or 0)], rel=1e-12)
