"""Sweeps of wheels, racks and belts, and drivers that follow laws of time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from tests.shared.mechanisms import five_bar


def wheels(joint, **bodies) -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (0.3, 0), "G": (0, -0.02)}),
        bodies=[md.Body("a", {"O": (0, 0)}), md.Body("b", {"Q": (0, 0)})],
        joints=[md.Revolute("O", "ground.O", "a.O"), *joint],
        sketch={"a": 0.0},
    )


def test_rack_and_pinion() -> None:
    guide = md.Prismatic("guide", "ground.G", "b.Q")
    mechanism = wheels([guide, md.Rack("mesh", "a.O", "b.Q", radius=0.02, phase=0.1)])
    task = md.Sweep(md.Driver("a.angle", from_=0, to=20, speed=2.0, acceleration=3.0), poses=5)
    result = md.solve(mechanism, task)
    slide = result.joints["guide"]
    # axis . (P2 - P1) is measured from the wheel's centre, the guide starts below it
    assert slide.slide == pytest.approx(0.02 * np.linspace(0, 20, 5) + 0.1, rel=1e-14)
    assert slide.slide_velocity == pytest.approx([0.04] * 5)
    assert slide.slide_acceleration == pytest.approx([0.06] * 5)


@pytest.mark.parametrize(("crossed", "sense"), [(False, 1), (True, -1)])
def test_belt(crossed: bool, sense: int) -> None:
    pin = md.Revolute("Q", "ground.Q", "b.Q")
    mechanism = wheels([pin, md.Belt("belt", "a.O", "b.Q", ratio=2.5, crossed=crossed)])
    result = md.solve(mechanism, md.Sweep(md.Driver("a.angle", from_=0, to=20), poses=5))
    assert result.bodies["b"].angle == pytest.approx(sense * np.linspace(0, 20, 5) / 2.5)
    assert result.summary["work"]["unknowns"] == 0
    with pytest.raises(md.MechanismError, match=r"joints\.belt\.ratio"):
        wheels([pin, md.Belt("belt", "a.O", "b.Q", ratio=-2)])


def test_a_law_of_time_drives() -> None:
    times = [0.0, 0.3, 0.1, 0.7]
    law = md.Driver("crank.angle", law="0.4 + sin(w*t)", times=times)
    problem = md.load("slider-crank").with_values({"omega": 2.0})
    mechanism = replace(problem.mechanism, parameters={**problem.mechanism.parameters, "w": 2.0})
    result = md.solve(mechanism, md.Sweep(law))
    t = np.array(times)
    driver = result.drivers["crank.angle"]
    assert driver.position == pytest.approx(0.4 + np.sin(2 * t))
    assert driver.velocity == pytest.approx(2 * np.cos(2 * t))
    assert driver.acceleration == pytest.approx(-4 * np.sin(2 * t), abs=1e-15)
    r, length = 0.1, 0.3

    def place(t):
        u = 0.4 + np.sin(2 * t)
        return r * np.cos(u) + np.sqrt(length**2 - (r * np.sin(u)) ** 2)

    h = 1e-4
    velocity = (8 * (place(t + h) - place(t - h)) - place(t + 2 * h) + place(t - 2 * h)) / (12 * h)
    bend = (place(t + h) - 2 * place(t) + place(t - h)) / h**2
    guide = result.joints["guide"]
    assert guide.slide == pytest.approx(place(t), rel=1e-14)
    assert guide.slide_velocity == pytest.approx(velocity, abs=1e-12)
    assert guide.slide_acceleration == pytest.approx(bend, abs=1e-7)


def test_two_laws_of_time() -> None:
    times = np.linspace(0, 1, 7).tolist()
    drivers = [
        md.Driver("left.angle", law="2 + 0.2*sin(t)", times=times),
        md.Driver("right.angle", law="1 - 0.2*t", times=times),
    ]
    result = md.solve(five_bar(), md.Sweep(drivers=drivers))
    assert np.all(result.status == "ok")
    t = np.array(times)
    p = 0.2 * np.exp(1j * (2 + 0.2 * np.sin(t)))
    q = 0.2 + 0.2 * np.exp(1j * (1 - 0.2 * t))
    C = result.points["fore.C"].position
    C = C[:, 0] + 1j * C[:, 1]
    assert np.abs(C - p) == pytest.approx(0.25, rel=1e-14)
    assert np.abs(C - q) == pytest.approx(0.25, rel=1e-14)
    vC = result.points["fore.C"].velocity
    vC = vC[:, 0] + 1j * vC[:, 1]
    vp = 0.2j * np.exp(1j * (2 + 0.2 * np.sin(t))) * 0.2 * np.cos(t)
    assert np.real(np.conj(C - p) * (vC - vp)) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(
    ("driver", "words"),
    [
        (md.Driver("crank.angle", law="t"), "times"),
        (md.Driver("crank.angle", law="t", times=[0], speed=1), "itself"),
        (md.Driver("crank.angle", law="log(t)", times=[0]), "finite"),
        (md.Driver("crank.angle", law="q*t", times=[0]), "unknown name 'q'"),
    ],
)
def test_laws_that_cannot_be_used(driver: md.Driver, words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        md.solve("slider-crank", md.Sweep(driver))
