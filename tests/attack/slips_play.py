"""Slips planted in the bands of clearance, seen on a slider-crank in closed form and a four-bar."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, pi, sin

import numpy as np

import mechdae as md
from mechdae.motion.kinematics.prepared import SHAPES
from mechdae.parts.play.first import band  # noqa: F401  (known before slips, so patched)
from tests.shared.gaps import (
    TURN,
    C,
    G,
    L,
    R,
    compared,
    least_rod,
    slider_crank,
    two_wheels,
    with_gaps,
)
from tests.shared.mechanisms import four_bar
from tests.shared.planting import Slip

SUITE = "play/test_bands.py::"


def played(mechanism: md.Mechanism, poses: int = 9, **keys: object) -> md.Result:
    SHAPES.clear()  # kernels that are kept know nothing of a slip
    try:
        return md.solve(mechanism, md.Play(TURN, poses=poses, **keys))
    finally:
        SHAPES.clear()


def off(found: np.ndarray, wanted: np.ndarray | float, allowed: float = 1e-3) -> float:
    gap = np.max(np.abs(np.asarray(found) / wanted - 1))
    return float(gap / allowed) if np.isfinite(gap) else np.inf


def first_of(result: md.Result) -> np.ndarray:
    """Return how far the slider moves to first order: by all offsets along the rod."""
    s = R / L * np.sin(result.drivers["crank.angle"].position)
    return (3 * C + G * np.abs(s)) / np.sqrt(1 - s**2)


def pins() -> float:
    result = played(slider_crank(clearance=G))
    slide, largest = result.joints["guide"], result.summary["play"]["largest"]
    first = first_of(result)
    if not ((slide.slide_reached <= first) & (first <= slide.slide_band)).all():
        return np.inf
    price = largest["joints/guide/slide"]["price"]["B"]
    at = largest["joints/guide/slide"]["at"]
    return max(
        off(slide.slide_band, first), off(result.points["crank.B"].distance_band, C),
        off(price, 1 / cos(asin(R / L * sin(at)))),
    )  # fmt: skip


def price() -> float:
    """The price of a pin is what its offset along the rod moves the slider by."""
    SHAPES.clear()
    path = "joints/guide/slide_band"
    slopes = md.Sensitivity(of="play", outputs=(path,), wrt=("c",))
    tasks = {"play": md.Play(TURN, poses=9), "s": slopes}
    result = md.solve(md.Problem(slider_crank(clearance=G), tasks), "s")
    SHAPES.clear()
    s = R / L * np.sin(result.drivers["crank.angle"].position)
    return off(result.data["derivatives"][path]["c"], 1 / np.sqrt(1 - s**2))


def tilt() -> float:
    result = played(slider_crank(clearance=G, contact_length=0.02))
    aside = result.points["slider.C"].position_band[:, 1]
    return max(off(result.bodies["slider"].angle_band, asin(2 * G / 0.02)), off(aside, G))


def teeth() -> float:
    return off(played(two_wheels()).bodies["wheel"].angle_band, 0.5e-4 / 0.04)


def loads() -> float:
    push = md.Force("push", point="slider.C", value=(-50.0, 0.0))
    mechanism = replace(slider_crank(clearance=G), loads={"push": push})
    result = played(mechanism, under_load=True)
    turned = [e["from"] for e in result.summary["play"]["reversals"] if e["joint"] == "guide"]
    sides = len(turned) == 2 and abs(turned[0] - pi) < 1
    lost = result.summary["play"]["reversals"][0]["lost"]["points/slider.C/position"]
    last = np.searchsorted(result.drivers["crank.angle"].position, turned[0] + 1e-9)
    s = R / L * np.sin(result.drivers["crank.angle"].position[last])
    whole = off(lost, 2 * G / np.sqrt(1 - s**2))
    back = off(result.joints["guide"].slide_shift, -first_of(result))
    return max(whole, back) if sides else np.inf


def adversaries() -> float:
    """Large gaps, whose bands hold what is not of first order: none too narrow, none too wide."""
    mechanism = with_gaps(four_bar(0.1, 0.3, 0.25, 0.28, crank=0.5, coupler=0.6, rocker=1.2), 3e-3)
    found = compared(played(mechanism, poses=3), 1, poses=2, samples=2)
    if found.outside or found.short or found.unbounded or not found.ratios:
        return np.inf
    return max(found.ratios) / 1.2


def ends() -> float:
    """A double rocker near its limits: where a band is claimed adversaries stay within it."""
    SHAPES.clear()
    mechanism = with_gaps(four_bar(0.1, 0.07, 0.1, 0.2, crank=0.5, coupler=0.3, rocker=1.5), 2e-3)
    task = md.Play(md.Driver("crank.angle", range="assembled"), poses=41)
    result = md.solve(mechanism, task)
    SHAPES.clear()
    told = bool(result.summary["play"]["unbounded"])
    try:
        found = compared(result, 1, poses=41, samples=1, rounds=2)
    except np.linalg.LinAlgError:  # it folds
        return np.inf
    return np.inf if found.outside or found.open or not told else 0.0


def sizes() -> float:
    """Gaps too large for any band: none is the largest, and loads press nothing."""
    mechanism = with_gaps(four_bar(0.1, 0.3, 0.25, 0.28, crank=0.5, coupler=0.6, rocker=1.2), 0.09)
    try:
        play = played(mechanism).summary["play"]
    except ValueError:
        return np.inf
    return np.inf if play["largest"] or len(play["unbounded"]) != 1 else 0.0


def held_limits() -> float:
    """The price of a limit that holds twice a turn: r over 2 s^3 of the shortest rod r / s."""
    SHAPES.clear()
    best = md.solve(least_rod(0.3), "design").data["designs"][0]
    SHAPES.clear()
    (found,) = [value for name, value in best["active"].items() if "square" in name]
    return off(found, R / (2 * 0.3**3))


PINS = SUITE + "test_a_slider_moves_by_all_clearances_along_the_rod"
LOADS = SUITE + "test_loads_press_a_slider_back_through_all_gaps"
RANDOM = SUITE + "test_bands_of_large_gaps_hold_what_is_not_of_first_order"
SLIPS = [
    Slip("parts.play.gaps", "(sum(part * part for part in forms) + least) ** 0.5",
         "(sum(abs(part) for part in forms) + least)", pins, PINS),
    Slip("equations.gaps", '{"x": size, "y": size}', '{"x": size / 2, "y": size / 2}', pins, PINS),
    Slip("equations.gaps", "ca.asin(2 * size / length)", "ca.asin(size / length)", tilt,
         SUITE + "test_a_block_tilts_in_its_guide"),
    Slip("equations.gaps", "size / 2 * abs(1", "size * abs(1", teeth,
         SUITE + "test_backlash_turns_the_second_wheel"),
    Slip("equations.gaps", "abs(1 - number", "abs(1 + number", teeth,
         SUITE + "test_backlash_turns_the_second_wheel"),
    Slip("parts.play.gaps", "return -self.reach * corner", "return self.reach * corner", loads,
         LOADS),
    Slip("parts.play.gaps", "return -self.reach * scaled", "return self.reach * scaled", loads,
         LOADS),
    Slip("parts.play.first", "support(joint.hinge, parts", "support(False, parts", price,
         "play/test_prices.py::test_the_price_of_a_clearance_is_its_sensitivity"),
    Slip("design.synthesis.designs", "name: sum(each)", "name: max(each)", held_limits,
         "play/test_prices.py::test_the_price_of_a_limit_at_several_poses_is_that_of_all"),
    Slip("parts.play.run", "offset[k] - offset[k - 1]", "offset[k]", loads, LOADS),
    Slip("parts.play.gaps", ".sum(axis=1) < 0", ".sum(axis=1) > 0", loads, LOADS),
    Slip("parts.play.run", "each[gap.joint] / gap.size", "each[gap.joint]", pins, PINS),
    Slip("parts.play.run", "self.first - self.rest", "self.first + self.rest", pins, PINS),
    Slip("parts.play.run", "whole[furthest] + aside", "whole[furthest] / 2 + aside", pins, PINS),
    Slip("parts.play.bands", "SX.eye(self.y.numel())) / 2", "SX.eye(self.y.numel())) / 20",
         adversaries, RANDOM),
    Slip("parts.play.bands", "self._bent(forms, -SX", "self._bent(0 * forms, -SX", adversaries,
         RANDOM),
    Slip("parts.play.run", "shares[:, ~self.found.proved] = np.nan", "shares[:, :0] = np.nan",
         sizes, "play/test_sizes.py::test_a_four_bar_with_gaps_of_any_size"),
    Slip("parts.play.bands", "proved[rows[good]] = True", "proved[rows] = True", ends,
         SUITE + "test_near_limit_positions_no_band_is_claimed"),
]  # fmt: skip
