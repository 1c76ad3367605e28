"""Links that are there twice: equations that depend on each other change no motion."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.tasks.check import check
from tests.reference.closed_forms import MECHANISMS
from tests.reference.jets import motion
from tests.reference.truth.drawing import draw
from tests.reference.truth.judging import judge
from tests.shared.mechanisms import doubled

DOUBLED = [
    ("four-bar-crank-rocker", "rocker", "turn"),
    ("four-bar-double-rocker", "coupler", "window"),
    ("slider-crank-offset", "slider", "turn"),
    ("whitworth-quick-return", "link", "turn"),
    ("watt-six-bar", "coupler", "turn"),
    ("jansen-leg", "bar_k", "turn"),
    ("peaucellier", "bar_AB", "window"),
    ("geared-five-bar", "coupler", "turns"),
    ("planetary-gear-train", "planet", "turn"),
    ("gorshkov-seven-link", "rod", "window"),
]


@pytest.mark.parametrize(("name", "body", "task"), DOUBLED)
def test_doubled_links_keep_the_motion(name: str, body: str, task: str) -> None:
    problem = doubled(md.load(name), body)
    result = md.solve(problem, task, poses=73)
    assert set(result.status) <= {"ok", "limit"}
    assert result.summary["superfluous"]
    driver = next(iter(result.drivers.values()))
    u = np.asarray(driver.position, dtype=np.longdouble)
    closed = motion(MECHANISMS[name], u, driver.velocity[0])[0]
    compared = 0
    for part, series in [*result.points.items(), *result.bodies.items()]:
        theirs = np.asarray(closed.get(part, np.nan))
        if not theirs.shape:
            continue
        ours = next(iter(series.values()))
        ours = ours[:, 0] + 1j * ours[:, 1] if np.ndim(ours) == 2 else ours
        bound = result.bound.length if np.iscomplexobj(ours) else result.bound.angle
        rows = np.isfinite(theirs)
        gap = np.abs(ours - theirs)[rows].astype(float)
        slack = 4e-16 * (1 + np.abs(theirs[rows]).astype(float))
        assert np.all(gap <= bound[rows] + slack), part
        compared += 1
    assert compared > 3


@pytest.mark.parametrize(
    ("name", "body"),
    [("four-bar-double-rocker", "coupler"), ("slider-crank", "rod"), ("watt-six-bar", "arm")],
)
def test_doubled_links_keep_limits_rates_and_modes(name: str, body: str) -> None:
    """Expected values of the file, from closed forms, hold for the doubled link."""
    verdicts = check(doubled(md.load(name), body))
    assert len(verdicts) > 4
    for verdict in verdicts:
        if "formula" not in verdict.expected.what:
            assert verdict.met, (verdict.expected.what, verdict)


DRAWN = {"dyads": (0, 1, 3, 6, 8), "gears": (2, 4, 5), "change": (1, 2), "exact": (0, 3, 5)}


@pytest.mark.parametrize(("family", "seeds"), DRAWN.items())
def test_random_mechanisms_with_a_doubled_link(family: str, seeds: tuple[int, ...]) -> None:
    """The independent truth of the mechanism without the twin holds."""
    for seed in seeds:
        case = draw(seed, family)
        mechanism = case.mechanism()
        bodies = list(mechanism.bodies)
        problem = doubled(md.Problem(mechanism, Table({})), bodies[seed % len(bodies)])
        low, high = case.span
        speeds = {"speed": case.speed, "acceleration": case.acceleration}
        driver = md.Driver(case.coordinate, from_=low, to=high, **speeds)
        task = md.Sweep(driver, poses=20, on_change_point=case.crossings)
        result = md.solve(problem.mechanism, task)
        verdict = judge(case, result)
        assert (verdict.faults, verdict.refused) == ([], 0), seed
        assert verdict.ok, seed
        assert "superfluous" in result.summary


def test_a_slider_on_both_plates_of_a_doubled_link() -> None:
    """Two guides hold it only because the plates lie on each other: all is one group."""
    plates = ("plate", "twin")
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (1.0, 0), "E": (0.4, -0.5)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (0.3, 0)}),
            *[md.Body(name, {"B": (0, 0), "C": (0.9, 0)}) for name in plates],
            md.Body("rocker", {"D": (0, 0), "C": (0.7, 0)}),
            md.Body("slider", {"F": (0, 0)}),
            md.Body("rod", {"E": (0, 0), "F": (1.1, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("D", "ground.D", "rocker.D"),
            *[md.Revolute(f"B_{name}", "crank.B", f"{name}.B") for name in plates],
            *[md.Revolute(f"C_{name}", "rocker.C", f"{name}.C") for name in plates],
            *[md.Prismatic(f"g_{name}", f"{name}.B", "slider.F", axis=0.0) for name in plates],
            md.Revolute("E", "ground.E", "rod.E"),
            md.Revolute("F", "slider.F", "rod.F"),
        ],
        sketch={"crank": 1.0, "plate": 0.5, "twin": 0.5, "rocker": 1.5, "rod": 1.3, "slider": 0.5},
    )
    driver = md.Driver("crank.angle", from_=0.8, to=1.4)
    result = md.solve(mechanism, md.Sweep(driver, poses=13))
    assert np.all(result.status == "ok")
    # class IV: plate, rocker, twin and slider make a contour of four pairs
    assert result.summary["formula"] == "I(1) -> IV 5 links(2,3,4,5,6) [3 redundant]"
    B = 0.3 * np.exp(1j * result.drivers["crank.angle"].position)
    chord = 1.0 - B
    along = (0.81 - 0.49 + abs(chord) ** 2) / (2 * abs(chord))
    C = B + (along + 1j * np.sqrt(0.81 - along**2)) * chord / abs(chord)
    axis = (C - B) / 0.9
    foot = ((0.4 - 0.5j - B) * axis.conj()).real
    height = ((0.4 - 0.5j - B) * axis.conj()).imag
    exact = B + (foot + np.sqrt(1.21 - height**2)) * axis
    ours = result.points["slider.F"].position @ np.array([1, 1j])
    assert np.all(abs(ours - exact) <= result.bound.length)


def test_two_drivers_of_a_redundant_mechanism() -> None:
    """A five-bar driven at both cranks, one of its bars doubled: two circles meet."""
    bars = [("a", 0.5), ("b", 0.8), ("b_twin", 0.8), ("c", 0.8), ("d", 0.5)]
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (1, 0)}),
        bodies=[md.Body(name, {"P": (0, 0), "Q": (length, 0)}) for name, length in bars],
        joints=[
            md.Revolute("A", "ground.A", "a.P"),
            md.Revolute("D", "ground.D", "d.P"),
            md.Revolute("B", "a.Q", "b.P"),
            md.Revolute("C", "d.Q", "c.P"),
            md.Revolute("E", "b.Q", "c.Q"),
            md.Revolute("B2", "a.Q", "b_twin.P"),
            md.Revolute("E2", "b_twin.Q", "c.Q"),
        ],
        sketch={"a": 1.6, "d": 1.2, "b": 0.8, "b_twin": 0.8, "c": 2.3},
    )
    drivers = (
        md.Driver("a.angle", from_=1.6, to=2.0, speed=1.0),
        md.Driver("d.angle", from_=1.2, to=1.0, speed=-0.5),
    )
    result = md.solve(mechanism, md.Sweep(drivers=drivers, poses=9))
    assert np.all(result.status == "ok")
    one, two = (0.5 * np.exp(1j * result.drivers[f"{n}.angle"].position) for n in "ad")
    chord = 1 + two - one
    exact = one + chord / 2 + 1j * chord / abs(chord) * np.sqrt(0.64 - abs(chord) ** 2 / 4)
    ours = result.points["b.Q"].position @ np.array([1, 1j])
    assert np.all(abs(ours - exact) <= result.bound.length)
