"""Measures of spatial mechanisms: a helix, and an RSSR against its closed form."""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest

import mechdae as md
from tests.attack.spatial_honesty import case

TURN = 2 * np.pi
NAMES = ("extremes", "time-ratio", "dwell", "envelope", "curve")


def screw(pitch: float) -> md.Mechanism:
    """A nut on a thread along z, with a point P beside the axis."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[md.Body("nut", {"O": (0, 0, 0), "P": (0.03, 0.04, 0.1)})],
        joints=[md.Screw("H", "ground.O", "nut.O", axis=(0, 0, 1), pitch=pitch)],
    )


@pytest.mark.parametrize("pitch", [0.12, -0.02])
def test_a_helix(pitch: float) -> None:
    """Length, direction, curvature r / (r^2 + c^2), torsion c / (r^2 + c^2), c the pitch / 2 pi."""
    r, c, phase = 0.05, pitch / TURN, np.arctan2(0.04, 0.03)
    driver = md.Driver("H.angle", from_=-phase, to=TURN - phase)
    result = md.solve(screw(pitch), md.Sweep(driver=driver, poses=5, measures=NAMES))
    path, u = result.points["nut.P"], result.drivers["H.angle"].position + phase
    along = np.stack([-r * np.sin(u), r * np.cos(u), np.full(5, c)], axis=1) / np.hypot(r, c)
    np.testing.assert_allclose(path.direction, along, atol=1e-14)
    np.testing.assert_allclose(path.curvature, r / (r**2 + c**2), rtol=1e-13)
    np.testing.assert_allclose(path.torsion, c / (r**2 + c**2), rtol=1e-13)
    facts = result.summary["curve"]["nut.P"]
    assert facts["length"] == pytest.approx(TURN * np.hypot(r, c), rel=1e-14)
    assert not facts["closed"]
    assert "area" not in facts
    ends = sorted([0.1 - phase * c, 0.1 + (TURN - phase) * c])
    box = result.summary["envelope"]["bodies"]["nut"]
    low = min(ends[0], *(end - 0.1 for end in ends))  # O runs along the axis
    np.testing.assert_allclose(box, [-r, r, -r, r, low, ends[1]], atol=1e-15)


@cache
def swing() -> tuple[tuple[mpmath.mpf, mpmath.mpf], ...]:
    """Crank angle and rocker angle at both ends of the rocker's swing, in 30 digits.

    |d|^2 + R^2 + 2 R (d_y cos psi + d_z sin psi) = l^2, d from the bar's ball on the crank to the
    rocker's circle.
    """
    r, l, R = mpmath.mpf("0.05"), mpmath.mpf("0.3"), mpmath.mpf("0.15")  # noqa: E741

    def rocker(phi: mpmath.mpf) -> mpmath.mpf:
        d = [
            mpmath.mpf("0.12") - r * mpmath.cos(phi),
            mpmath.mpf("0.25") - r * mpmath.sin(phi),
            mpmath.mpf("0.05"),
        ]
        right = (l**2 - R**2 - sum(v * v for v in d)) / (2 * R)
        return mpmath.atan2(d[2], d[1]) + mpmath.acos(right / mpmath.hypot(d[1], d[2]))

    with mpmath.workdps(30):
        slope = lambda phi: mpmath.diff(rocker, phi)  # noqa: E731
        ends = [mpmath.findroot(slope, near) for near in ("1.1", "4.1")]
        return tuple((phi, rocker(phi)) for phi in ends)


def test_a_spatial_rocker() -> None:
    (first, low), (second, high) = (tuple(map(float, end)) for end in swing())
    problem = md.load("rssr")
    for poses, to in ((5, TURN), (40, -TURN)):
        driver = md.Driver("A.angle", from_=0.0, to=to)
        task = md.Sweep(driver=driver, poses=poses, measures=NAMES)
        result = md.solve(problem.with_task("measured", task), "measured")
        found = result.summary["extremes"]["D.angle"]
        assert found["min"]["value"] == pytest.approx(low, abs=1e-14)
        assert found["max"]["value"] == pytest.approx(high, abs=1e-14)
        at = [found[end]["at"] % TURN for end in ("min", "max")]
        assert at == pytest.approx([first, second], abs=1e-12)
        told = [event.at % TURN for event in result.events if event.of == "D.angle"]
        assert sorted(told) == pytest.approx([first, second], abs=1e-12)
        part = (second - first) / TURN
        ratio = max(part, 1 - part) / min(part, 1 - part)
        assert result.summary["time_ratio"]["D"] == pytest.approx(ratio, abs=1e-12)
        facts = result.summary["curve"]["rocker.C"]
        assert facts["length"] == pytest.approx(2 * 0.15 * (high - low), rel=1e-13)
        assert facts["closed"]
        box = result.summary["envelope"]["bodies"]["rocker"]  # of D and C
        top = 0.05 + 0.15 * np.sin(low)
        sides = [0.1, 0.12, 0.25 + 0.15 * np.cos(high), 0.25, 0.05, top]
        np.testing.assert_allclose(box, sides, atol=1e-14)
        path = result.points["rocker.C"]
        np.testing.assert_allclose(path.curvature, 1 / 0.15, rtol=1e-10)
        np.testing.assert_allclose(path.torsion, 0, atol=1e-9)
        for dwell in result.summary["dwell"]["D"]:
            assert any(
                dwell["from"] < phi + turn < dwell["to"]
                for phi in (first, second)
                for turn in (-TURN, 0.0, TURN)
            )


def test_joints_of_two_coordinates_are_named_with_them() -> None:
    found = case(np.random.default_rng(3), "RSRC")
    driver = md.Driver("J0.angle", from_=-0.1, to=0.1)
    result = md.solve(found.mechanism, md.Sweep(driver=driver, poses=3, measures=NAMES))
    assert {"J2.angle", "J3.angle", "J3.slide"} <= set(result.summary["extremes"])
    assert set(result.summary["no_time_ratio"]) == {"J2", "J3.angle", "J3.slide"}


@pytest.mark.parametrize("name", ["centrodes", "instant-centres"])
def test_measures_of_the_plane_are_refused(name: str) -> None:
    task = md.Sweep(driver=md.Driver("H.angle", from_=0.0, to=1.0), measures=("curve", name))
    with pytest.raises(md.UnavailableError, match=f"'{name}' is one of the plane") as caught:
        md.solve(screw(0.1), task)
    assert "extremes" in str(caught.value.hint)
