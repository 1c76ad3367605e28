"""Bands as quantities: prices of clearances, studies, designs, against a closed form.

A slider moves by all offsets along the rod over its cosine: with sin = r/l sin(crank), and
clearances c in three pins, by 3 c / cos to first order.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.tasks.constraints import LimitConstraint
from mechdae.describe.tasks.goals import Minimise
from tests.shared.gaps import TURN, C, G, L, R, in_lengths, least_rod, slider_crank, two_wheels

SLIDE = "joints/guide/slide_band"


def problem(**tasks: md.Task) -> md.Problem:
    return md.Problem(in_lengths(), {"play": md.Play(TURN, poses=9), **tasks})


def first(at: np.ndarray, l: float = L) -> np.ndarray:  # noqa: E741
    s = R / l * np.sin(at)
    return (3 * C + G * np.abs(s)) / np.sqrt(1 - s**2)


def test_the_price_of_a_clearance_is_its_sensitivity() -> None:
    wrt = ("c", "O.clearance", "guide.clearance", "l")
    result = md.solve(problem(s=md.Sensitivity(of="play", outputs=(SLIDE,), wrt=wrt)), "s")
    at = result.drivers["crank.angle"].position
    s, step = R / L * np.sin(at), 1e-6
    slopes = result.data["derivatives"][SLIDE]
    np.testing.assert_allclose(result.data["values"][SLIDE], first(at), rtol=1e-9)
    for name in ("c", "O.clearance"):
        np.testing.assert_allclose(slopes[name], 1 / np.sqrt(1 - s**2), rtol=1e-9)
    np.testing.assert_allclose(slopes["guide.clearance"], np.abs(s) / np.sqrt(1 - s**2), rtol=1e-9)
    exact = (first(at, L + step) - first(at, L - step)) / (2 * step)
    np.testing.assert_allclose(slopes["l"], exact, rtol=1e-6, atol=1e-12)


def test_prices_of_all_bands_are_slopes_of_the_bands() -> None:
    """Of places, distances and angles, by a clearance and by a dimension: differences of tasks."""
    paths = ("points/rod.C/distance_band", "points/rod.C/position_band", "bodies/rod/angle_band")
    whole = problem(s=md.Sensitivity(of="play", outputs=paths, wrt=("c", "r")))
    slopes = md.solve(whole, "s").data["derivatives"]
    for name, value, step in (("c", C, 1e-3 * C), ("r", R, 1e-5)):
        up, down = (
            md.solve(whole.with_values({name: value + way * step}), "play") for way in (1, -1)
        )
        for path in paths:
            wanted = np.subtract(up.value(path), down.value(path)) / (2 * step)
            size = 1e-3 * np.abs(wanted).max() + 1e-9
            np.testing.assert_allclose(slopes[path][name], wanted, rtol=5e-3, atol=size)


def test_tables_of_bands_have_one_kind_of_units() -> None:
    """Series and figures stand beside each other; a price of an angle is an angle over a length."""
    largest = "summary/play/largest/joints/guide/slide"
    outputs = (SLIDE, f"{largest}/band", f"{largest}/at", f"{largest}/price/O",
               "summary/play/largest/bodies/rod/angle/price/guide")  # fmt: skip
    whole = problem(
        s=md.Sensitivity(of="play", outputs=outputs[:2], wrt=("c", "l")),
        study=md.Study(of="play", vary={"c": (C, 2 * C, 2)}, outputs=outputs[1:]),
    )
    found = md.solve(whole, "s").in_units("mm,deg")
    lines = [line.split("  ") for line in found.table().splitlines()]
    heads = [[cell.strip() for cell in line if cell] for line in lines if "d/d c" in str(line)]
    for head in heads:
        assert head[-3:] == ["value [mm]", "d/d c [mm/mm]", "d/d l [mm/mm]"]
    assert len(heads) == 2
    study = md.solve(whole, "study")
    assert [study.path_unit(path) for path in outputs[1:]] == ["m", "rad", "1", "rad/m"]
    assert "[deg/mm]" in study.in_units("mm,deg").table()


def test_a_block_that_tilts_has_a_price() -> None:
    """Both ends within the guide: the angle is asin(2 g / b)."""
    b, path, wrt = 0.02, "bodies/slider/angle_band", ("guide.clearance", "guide.contact_length")
    mechanism = slider_crank(clearance=G, contact_length=b)
    tasks = {
        "play": md.Play(TURN, poses=3),
        "s": md.Sensitivity(of="play", outputs=(path,), wrt=wrt),
    }
    found = md.solve(md.Problem(mechanism, tasks), "s").data["derivatives"][path]
    root = sqrt(1 - (2 * G / b) ** 2)
    np.testing.assert_allclose(found["guide.clearance"], 2 / b / root, rtol=1e-9)
    np.testing.assert_allclose(found["guide.contact_length"], -2 * G / b**2 / root, rtol=1e-9)


def test_teeth_have_a_price_too() -> None:
    mechanism = two_wheels()
    tasks = {"play": md.Play(TURN, poses=3), "s": md.Sensitivity(
        of="play", outputs=("bodies/wheel/angle_band",), wrt=("teeth.backlash",),
    )}  # fmt: skip
    found = md.solve(md.Problem(mechanism, tasks), "s").data["derivatives"]
    np.testing.assert_allclose(found["bodies/wheel/angle_band"]["teeth.backlash"], 0.5 / 0.04)


def test_the_widest_band_of_a_turn_is_a_number() -> None:
    """Its names have slashes themselves; rows of a study have it, and it has a slope."""
    path = "summary/play/largest/joints/guide/slide/band"
    tasks = {"study": md.Study(of="play", vary={"c": (C, 2 * C, 2)}, outputs=(path, SLIDE))}
    whole = problem(**tasks)
    played = md.solve(whole, "play")
    assert played.value(path) == np.max(played.joints["guide"].slide_band)
    rows = np.ravel(md.solve(whole, "study").value(f"table/{path}"))
    assert rows[0] == pytest.approx(played.value(path), rel=1e-12)
    assert rows[1] > rows[0]
    with pytest.raises(md.UnknownName, match="unknown path 'summary/play/largest/joints/guide/x'"):
        played.value("summary/play/largest/joints/guide/x")


def designed(limit: float | None, c: float = C, low: float = 0.15, **robust: object) -> md.Result:
    turn = md.Driver("crank.angle", from_=0.0, to=2 * np.pi)
    goal = Minimise(of=f"play/{SLIDE}" if limit is None else "turn/points/rod.C/position")
    rows = () if limit is None else (LimitConstraint(of=f"play/{SLIDE}", max=limit),)
    design = md.Synthesis(
        driver={"coordinate": "crank.angle"}, goal=goal, free={"l": (low, 0.4)}, constraints=rows,
        starts=1, **robust,
    )  # fmt: skip
    whole = problem(design=design)
    joints = {**whole.mechanism.joints, "guide": md.Prismatic("guide", "ground.O", "slider.C")}
    mechanism = replace(whole.mechanism, joints=joints)
    tasks = {**whole.tasks, "play": md.Play(turn, poses=73), "turn": md.Sweep(turn, poses=73)}
    return md.solve(md.Problem(mechanism, tasks), "design", set={"c": c})


@pytest.mark.slow(reason="searches for designs")
def test_a_design_keeps_a_band() -> None:
    """The shortest rod with 3 c / cos below a limit at the widest: cos = 3 c / limit."""
    found = designed(6.5e-5)
    assert found.data["designs"][0]["parameters"]["l"] == pytest.approx(
        R / sqrt(1 - (3 * C / 6.5e-5) ** 2), rel=2e-3
    )
    assert not found.data["designs"][0]["defects"]


@pytest.mark.slow(reason="searches for designs")
def test_a_band_is_a_goal_and_its_value_is_the_proved_one() -> None:
    found = designed(None)
    (design,) = found.data["designs"]
    assert design["parameters"]["l"] == pytest.approx(0.4, rel=1e-6)
    at = 3 * C / sqrt(1 - (R / 0.4) ** 2)
    assert at < design["objective"] < at * 1.001


@pytest.mark.slow(reason="searches for designs")
def test_a_clearance_has_a_tolerance_itself() -> None:
    """Of 3 c / cos, where c is of one pin: what its tolerance adds, and that of the rod."""
    found = designed(None, robust=3, tolerances={"c": 5e-6, "l": 1e-4})
    (design,) = found.data["designs"]
    cos = sqrt(1 - (R / 0.4) ** 2)
    of_c, of_l = 1 / cos * 5e-6, 3 * C * R**2 / 0.4**3 / cos**3 * 1e-4
    sigma = sqrt((of_c**2 + of_l**2) / 3)
    assert design["robust"][0]["sigma"] == pytest.approx(sigma, rel=1e-6)
    assert design["objective"] == pytest.approx(3 * C / cos + 3 * sigma, rel=1e-6)


@pytest.mark.slow(reason="searches for designs")
def test_a_design_without_a_proved_band_is_none() -> None:
    """A rod hardly longer than its crank, with gaps of 3 mm: near folding no band is proved."""
    found = designed(1.0, 3e-3, 0.1002)
    assert not found.data.get("designs")
    assert f"{SLIDE} has no value at" in " ".join(found.table().split())
    assert "the limit is missed" not in found.table()


def test_bands_are_those_of_play() -> None:
    goal = Minimise(of="turn/points/rod.C/distance_band")
    design = md.Synthesis(driver={"coordinate": "crank.angle"}, goal=goal, free={"l": (0.15, 0.4)})
    with pytest.raises(md.InputError, match=r"task 'turn' has no bands"):
        md.solve(problem(turn=md.Sweep(TURN, poses=9), design=design), "design")


def test_the_price_of_a_limit_at_several_poses_is_that_of_all() -> None:
    """The least rod of a crank r with |sin| of its angle up to s: l = r / s, twice a turn."""
    best = md.solve(least_rod(0.3), "design").data["designs"][0]
    assert best["parameters"]["l"] == pytest.approx(R / 0.3, rel=1e-6)
    (price,) = [value for name, value in best["active"].items() if "square" in name]
    assert price == pytest.approx(R / (2 * 0.3**3), rel=1e-3)
