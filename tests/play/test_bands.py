"""Bands of clearance against closed forms and adversaries of their own."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from math import asin, hypot, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import PathPatch

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.gaps import (
    TURN,
    C,
    G,
    L,
    R,
    compared,
    drawn_mechanism,
    slider_crank,
    two_wheels,
    with_gaps,
)
from tests.shared.mechanisms import four_bar
from tests.shared.paths import FIGURES


def played(mechanism: md.Mechanism, poses: int = 25, **keys: object) -> md.Result:
    return md.solve(mechanism, md.Play(TURN, poses=poses, **keys))


def slope(result: md.Result) -> np.ndarray:
    """Sine of the rod's angle."""
    return -R / L * np.sin(result.drivers["crank.angle"].position)


def test_a_slider_moves_by_all_clearances_along_the_rod() -> None:
    """The rod keeps its length: its direction times every offset is that times the slider's way."""
    result = played(slider_crank(clearance=G))
    s = slope(result)
    first = (3 * C + G * np.abs(s)) / np.sqrt(1 - s**2)
    slide = result.joints["guide"]
    assert (slide.slide_reached < first).all()
    assert (first < slide.slide_band).all()
    np.testing.assert_allclose(slide.slide_band, first, rtol=1e-3)
    np.testing.assert_allclose(result.points["slider.C"].position_band[:, 1], G, rtol=1e-6)
    np.testing.assert_allclose(result.points["crank.B"].distance_band, C, rtol=1e-3)
    entry = result.summary["play"]["largest"]["joints/guide/slide"]
    assert entry["shares"]["guide"] == pytest.approx(entry["price"]["guide"] * G)
    assert entry["price"]["B"] == pytest.approx(entry["shares"]["O"] / C)
    assert entry["joint"] in ("O", "B", "C")
    assert sum(entry["shares"].values()) < entry["band"]


def test_a_block_tilts_in_its_guide() -> None:
    """Both ends stay in the guide: at most 2 g / length, and only the middle moves aside by g."""
    result = played(slider_crank(clearance=G, contact_length=0.02))
    angle = result.bodies["slider"].angle_band
    np.testing.assert_allclose(angle, asin(2 * G / 0.02), rtol=1e-6)
    np.testing.assert_allclose(result.points["slider.C"].position_band[:, 1], G, rtol=1e-6)


def test_bands_grow_with_the_clearance_of_a_parameter() -> None:
    problem = md.Problem(slider_crank(), {"t": md.Play(TURN, poses=5)})
    small, large = (md.solve(problem, "t", set={"c": c}) for c in (C, 3 * C))
    ratio = large.joints["guide"].slide_band / small.joints["guide"].slide_band
    np.testing.assert_allclose(ratio, 5 / 3, rtol=1e-3)


def test_loads_press_a_slider_back_through_all_gaps() -> None:
    """What the load pushes along loses all of the band: each gap gives way as far as it can."""
    push = md.Force("push", point="slider.C", value=(-50.0, 0.0))
    mechanism = replace(slider_crank(clearance=G), loads={"push": push})
    result = played(mechanism, under_load=True)
    first = (3 * C + G * np.abs(slope(result))) / np.sqrt(1 - slope(result) ** 2)
    np.testing.assert_allclose(result.joints["guide"].slide_shift, -first, rtol=1e-9)
    sides = result.points["slider.C"].position_shift[:, 1]
    np.testing.assert_allclose(sides, G * np.sign(slope(result)), rtol=1e-9)
    turned = [r for r in result.summary["play"]["reversals"] if r["joint"] == "guide"]
    assert [r["from"] < turn <= r["to"] for r, turn in zip(turned, (pi, 2 * pi), strict=True)]
    at = np.searchsorted(result.drivers["crank.angle"].position, [r["to"] for r in turned])
    away = np.abs(slope(result)[at])
    for reversal, s in zip(turned, away, strict=True):  # across by both gaps, along by the rod
        lost = reversal["lost"]
        assert lost["points/slider.C/position"] == pytest.approx(2 * G / sqrt(1 - s**2))
        assert lost["joints/guide/slide"] == pytest.approx(2 * G * s / sqrt(1 - s**2))
        assert "points/crank.B/position" not in lost
    assert ": slider.C loses" in result.table() or ": rod.C loses" in result.table()


def test_a_block_that_goes_to_another_corner_reverses() -> None:
    """A block that tilts lies at a corner of its gap: each jump of an output has its reversal."""
    push = md.Force("push", point="slider.C", value=(-50.0, 0.0))
    turn = md.Torque("turn", body="slider", value=0.03)
    mechanism = slider_crank(clearance=G, contact_length=0.02)
    loads = {"push": push, "turn": turn}
    result = played(replace(mechanism, loads=loads), 73, under_load=True)
    guide, at = result.joints["guide"], result.drivers["crank.angle"].position
    corners = np.sign(np.stack([guide.gap_offset, guide.gap_turn], axis=1))
    jumps = 1 + np.flatnonzero((corners[1:] != corners[:-1]).any(axis=1))
    aside = np.flatnonzero((corners[1:] * corners[:-1] == 0).all(axis=1))
    assert aside.size, "from its side to a tilt, at right angles"
    said = [r["to"] for r in result.summary["play"]["reversals"] if r["joint"] == "guide"]
    np.testing.assert_array_equal(said, at[jumps])


def test_loads_press_joints_against_their_reactions() -> None:
    """A pin's centre lies where the reaction pushes it from, a block on its side of the guide."""
    push = md.Force("push", point="slider.C", value=(-50.0, 0.0))
    mechanism = replace(slider_crank(clearance=G), loads={"push": push})
    result = played(mechanism, under_load=True)
    rod = np.stack([np.cos(result.bodies["rod"].angle), np.sin(result.bodies["rod"].angle)], 1)
    # the rod is pressed: from C it pushes B towards the crank, C of the slider away from the rod
    np.testing.assert_allclose(result.joints["B"].gap_offset, -C * rod, atol=1e-9 * C)
    np.testing.assert_allclose(result.joints["C"].gap_offset, -C * rod, atol=1e-9 * C)
    guide = result.joints["guide"].gap_offset
    np.testing.assert_allclose(guide, G * np.sign(slope(result)), rtol=1e-9)
    units = {name: unit for name, unit, _ in result.columns() if "gap" in name}
    assert units["B.gap_offset.x"] == units["guide.gap_offset"] == "m"


def test_teeth_lie_on_one_flank_under_load() -> None:
    """A moment on the wheel presses it back by half the play, as an angle of the wheel."""
    pull = md.Torque("pull", body="wheel", value=-3.0)
    result = played(replace(two_wheels(), loads={"pull": pull}), under_load=True)
    np.testing.assert_allclose(result.bodies["wheel"].angle_shift, -0.5e-4 / 0.04, rtol=1e-6)
    assert np.ptp(result.joints["teeth"].gap_turn) == pytest.approx(0, abs=1e-15)
    assert abs(result.joints["teeth"].gap_turn[0]) == pytest.approx(0.5e-4 / 0.02, rel=1e-6)


def test_backlash_turns_the_second_wheel() -> None:
    """Play along the pitch circles, of 20 and 40 mm: as an angle of either wheel."""
    mechanism = two_wheels()
    band = played(mechanism).bodies["wheel"].angle_band
    np.testing.assert_allclose(band, 0.5e-4 / 0.04, rtol=1e-6)
    turned = mechanism.joints["teeth"]
    turned = replace(turned, backlash=None, backlash_angle=2e-3)
    joints = {**mechanism.joints, "teeth": turned}
    band = played(replace(mechanism, joints=joints)).bodies["wheel"].angle_band
    np.testing.assert_allclose(band, 0.5e-3, rtol=1e-6)


def test_near_limit_positions_no_band_is_claimed() -> None:
    """A double rocker: wherever a band is told it is finite, and it grows towards the ends."""
    mechanism = with_gaps(four_bar(0.1, 0.07, 0.1, 0.2, crank=0.5, coupler=0.3, rocker=1.5), 1e-3)
    task = md.Play(md.Driver("crank.angle", range="assembled"), poses=201)
    result = md.solve(mechanism, task)
    band = result.bodies["rocker"].angle_band
    lost = np.isnan(band)
    assert lost[[0, -1]].all()
    assert not lost[100]
    arcs = result.summary["play"]["unbounded"]
    angle = result.drivers["crank.angle"].position
    inside = [(arc["from"] <= angle) & (angle <= arc["to"]) for arc in arcs]
    assert (np.any(inside, axis=0) == lost).all()
    assert "no band is proved from" in result.table()
    kept = np.flatnonzero(~lost)
    assert band[kept[0]] > 2 * np.nanmin(band)


def test_bands_of_large_gaps_hold_what_is_not_of_first_order() -> None:
    """Of 3/1000 of a four-bar: adversaries reach beyond the first order, not beyond the band."""
    mechanism = with_gaps(four_bar(0.1, 0.3, 0.25, 0.28, crank=0.5, coupler=0.6, rocker=1.2), 3e-3)
    found = compared(played(mechanism, poses=3), 1, poses=2, samples=2)
    assert (found.outside, found.short, found.open, found.unbounded) == (0, 0, 0, 0)
    assert max(found.ratios) < 1.2


CASES = {
    "four-bar-crank-rocker": ("turn", 1e-3), "slider-crank": ("turn", 1e-3),
    "gorshkov-seven-link": ("turn", 1e-4), "toggle-press": ("cycle", 1e-4),
    "geared-five-bar": ("turns", 3e-4), "quick-return-pin": ("cycle", 1e-3),
    "rack-and-pinion": ("turn", 1e-3),
}  # fmt: skip
"""Problem -> task, gaps as a share of the size."""
SLOW = pytest.mark.slow(reason="thousands of mechanisms with gaps")


@SLOW
@pytest.mark.parametrize("name", CASES)
def test_no_adversary_leaves_a_band(name: str) -> None:
    problem, (task, share) = md.load(name), CASES[name]
    base = problem.tasks[task]
    play = md.Play(drivers=base.all_drivers, poses=13)
    result = md.solve(with_gaps(problem.mechanism, share), play)
    found = compared(result, 1, poses=3, samples=2, rounds=3)
    assert (found.outside, found.short, found.open) == (0, 0, 0)
    assert found.unbounded < found.bands / 2
    assert np.median(found.ratios) < 1.05
    assert max(found.ratios) < 1.2


@pytest.mark.parametrize("seed", [0, 3, *(pytest.param(k, marks=SLOW) for k in (1, 2, 4, 5))])
def test_no_adversary_leaves_a_band_of_random_mechanisms(seed: int) -> None:
    mechanism = with_gaps(drawn_mechanism(np.random.default_rng(seed), 1 + seed % 3), 2e-5)
    driver = md.Driver("crank.angle", from_=-0.1, to=0.1)
    result = md.solve(mechanism, md.Play(driver, poses=3))
    found = compared(result, seed, poses=1, samples=2)
    assert (found.outside, found.short, found.open) == (0, 0, 0)
    assert found.samples > 100
    assert np.median(found.ratios) < 1.2
    assert max(found.ratios) < 2


def refused(mechanism: md.Mechanism) -> str:
    with pytest.raises(md.MechdaeError) as error:
        played(mechanism)
    return str(error.value)


def with_joint(name: str, **changes: object) -> md.Mechanism:
    mechanism = slider_crank()
    joints = {**mechanism.joints, name: replace(mechanism.joints[name], **changes)}
    return replace(mechanism, joints=joints)


def test_gaps_that_are_none_are_refused() -> None:
    for clearance in (-C, "-c"):
        with pytest.raises(md.MechanismError, match=r"joints\.B\.clearance.*negative"):
            played(with_joint("B", clearance=clearance))
    text = refused(with_joint("B", clearance=0.1))
    assert "joints.B.clearance" in text
    assert "smaller than the link" in text
    assert "round" in refused(with_joint("guide", clearance=G, contact_length=G))
    bare = four_bar(0.1, 0.3, 0.25, 0.28, crank=1.0, coupler=0.3, rocker=1.2)
    assert "no joint has a clearance" in refused(bare)
    for kind, rest in (("distance", "length = 0.1"), ("weld", ""), ("belt", "ratio = 2")):
        text = f'kind = "{kind}"\nbetween = ["ground.O", "slider.C"]\n{rest}\nclearance = 1e-5'
        whole = md.dumps(md.Problem(slider_crank(), {"t": md.Play(TURN, poses=5)}))
        with pytest.raises(md.UnknownName, match=r"joints\.x: unknown key 'clearance'"):
            from_dict(tomllib.loads(f"{whole}\n[joints.x]\n{text}"), "x")


def test_bands_in_space_are_refused_with_the_reason() -> None:
    with pytest.raises(md.UnavailableError, match=r"(?s)not computed in space.*try: toler"):
        md.solve(md.load("rssr").mechanism, md.Play(md.Driver("A.angle", from_=0.0, to=1.0)))


def test_redundant_equations_are_refused() -> None:
    problem = md.load("parallelogram-three-cranks")
    task = next(task for task in problem.tasks.values() if isinstance(task, md.Sweep))
    with pytest.raises(md.UnavailableError, match="redundant"):
        md.solve(with_gaps(problem.mechanism, 1e-3), md.Play(drivers=task.all_drivers, poses=5))


def test_files_tables_and_columns_have_bands(tmp_path: Path) -> None:
    problem = md.Problem(slider_crank(clearance=G), {"t": md.Play(TURN, poses=5)})
    text = md.dumps(problem).replace("clearance = 5e-05", "clearance_mm = 0.05")
    assert "clearance_mm" in text
    path = tmp_path / "again.toml"
    path.write_text(text)
    result = md.solve(path, "t")
    first = md.solve(problem, "t").to_dict()
    assert json.dumps(result.to_dict()["joints"]) == json.dumps(first["joints"])
    columns = {name: unit for name, unit, _ in result.columns()}
    assert columns["slider.C.position_band.x"] == "m"
    assert columns["rod.angle_band"] == "rad"
    assert columns["rod.C.distance_band"] == "m"
    assert "most of it" in result.table()


def test_a_point_moves_no_further_than_its_distance_band() -> None:
    """Links in a row: a crank on a loose pin, its end moves by both clearances in any direction."""
    result = played(slider_crank())
    point = result.points["rod.B"]
    np.testing.assert_allclose(point.distance_band, 2 * C, rtol=1e-3)
    assert (point.distance_band >= 2 * C).all()
    corner = np.hypot(*point.position_band.T)
    np.testing.assert_allclose(corner, hypot(2 * C, 2 * C), rtol=1e-3)


def test_the_long_study_found_nothing_outside() -> None:
    """`tests.scripts.play_bands`: within 1.2 of what is reached in the median, 2 at worst."""
    study = json.loads((FIGURES / "play.json").read_text(encoding="utf-8"))
    assert study["random"]["mechanisms"] >= 200
    assert study["random"]["samples_each"] >= 1e5
    for name, figures in study.items():
        assert (figures["outside"], figures["short"], figures["open"]) == (0, 0, 0), name
        assert figures["median"] < 1.2
        assert figures["worst"] < 2
        assert figures["not_proved"] < figures["bands"] / 4
        assert figures.get("times_a_sweep", 0) <= 3


def test_the_ribbon_follows_the_path_and_closes() -> None:
    """Of few poses of a turn: as wide as the bands everywhere, without a notch at the start."""
    linkage = md.four_bar(ground=0.1, crank=0.04, coupler=0.12, rocker=0.08)
    joints = dict(linkage.mechanism.joints)
    joints["B"] = replace(joints["B"], clearance=1e-4)
    task = md.Play(md.Driver("crank.angle", from_=0.0, to=2 * np.pi), poses=7)
    result = md.solve(replace(linkage.mechanism, joints=joints), task)
    panel = md.plot(result, "band", of=["coupler.C"])
    (ring,) = [p.get_path().vertices for p in panel.patches if isinstance(p, PathPatch)]
    assert len(ring) > 2 * 33
    assert ring[-1] == pytest.approx(ring[0])  # matplotlib does not draw the last one
    left, right = np.split(ring[:-1], 2)
    wide = np.hypot(*(left - right[::-1]).T)
    assert wide.max() / wide.min() == pytest.approx(
        np.ptp(result.points["coupler.C"].distance_band)
        / result.points["coupler.C"].distance_band.min()
        + 1,
        rel=0.1,
    )
    assert left[0] == pytest.approx(left[-1], abs=0.1 * wide.min())
