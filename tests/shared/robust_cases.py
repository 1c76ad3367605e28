"""Robust syntheses with a Monte Carlo by closed forms for each: a four-bar and a slider-crank."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdae.describe.file.load import from_dict
from mechdae.describe.tasks.goals import FunctionTargets, Minimise
from tests.reference import deviated
from tests.shared.job_cases import FOUR_BAR

ARC = np.array([[3, 3], [2.759, 3.363], [2.372, 3.663], [1.89, 3.862], [1.355, 3.943]])
AT = np.radians([30, 45, 60, 75, 90])
INPUTS = np.radians([30.0, 50.0, 70.0, 90.0, 110.0])
WANTED = 3.0 - 0.5 * INPUTS**2
FRICTION, RADIUS, GUIDE, LOAD = 0.1, 0.1, 0.12, 10.0
SLIDER = f"""
schema = 1
title = "Slider-crank with friction, the slide a function of the crank"
[parameters]
r = 1.0
l = 3.0
e = 0.0
[ground]
points = {{ O = [0, 0], G = [0, "e"] }}
[bodies.crank]
points = {{ O = [0, 0], B = ["r", 0] }}
[bodies.rod]
points = {{ B = [0, 0], C = ["l", 0] }}
[bodies.slider]
points = {{ C = [0, 0] }}
[joints]
O = {{ kind = "revolute", between = ["ground.O", "crank.O"], friction = {FRICTION}, pin_radius = {RADIUS} }}
B = {{ kind = "revolute", between = ["crank.B", "rod.B"], friction = {FRICTION}, pin_radius = {RADIUS} }}
C = {{ kind = "revolute", between = ["rod.C", "slider.C"], friction = {FRICTION}, pin_radius = {RADIUS} }}
slide = {{ kind = "prismatic", between = ["ground.G", "slider.C"], friction = {GUIDE} }}
[sketch]
crank_deg = 60
rod_deg = -17
[loads.work]
kind = "resistance"
coordinate = "slide.slide"
negative = {LOAD}
positive = {LOAD}
[tasks.cycle]
kind = "reactions"
poses = 73
cycle = true
friction = "article"
friction_radius = "article"
driver = {{ coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed = 1 }}
[tasks.design]
kind = "synthesis"
driver = {{ coordinate = "crank.angle" }}
goal = {{ kind = "minimise", of = "cycle/summary/loss" }}
free = {{ r = [0.2, 3], l = [0.5, 10], e = [-1.5, 1.5] }}
constraints = [
  {{ kind = "full-turn", coordinate = "crank.angle" }},
  {{ kind = "transmission-angle", between = ["rod", "slider"], min_deg = 30 }},
]
starts = 6
"""  # noqa: E501
Sampled = Callable[[dict[str, float], dict[str, float], float, int], float]


@dataclass(frozen=True)
class Case:
    """A problem, changes of its task, half widths, and the robust value by samples."""

    name: str
    text: str
    tolerances: dict[str, float]
    sampled: Sampled
    changes: dict[str, Any]

    def problem(self, factor: float, scale: float = 1.0) -> Any:
        """Return the problem with k standard deviations, half widths times `scale`."""
        loaded = from_dict(tomllib.loads(self.text))
        widths = {name: scale * width for name, width in self.tolerances.items()}
        changes = {"starts": 6, "keep": 1, **self.changes}
        if "measure" in changes:
            changes["goal"] = replace(loaded.tasks["design"].goal, measure=changes.pop("measure"))
        task = replace(loaded.tasks["design"], robust=factor, tolerances=widths, **changes)
        return loaded.with_task("design", task)


def _arc_sign(own: dict[str, float]) -> float:
    one = {name: np.array([value]) for name, value in own.items()}
    return min((1.0, -1.0), key=lambda s: float(((_arc(one, s)) ** 2).sum()))


def _arc(sets: dict[str, Any], sign: float) -> Any:
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(deviated.coupler_point(sets, AT, sign) - ARC, nan=1e9)


def arc_squares(own: dict[str, float], widths: dict[str, float], k: float, count: int) -> float:
    return deviated.of_squares(_arc(deviated.drawn(own, widths, count), _arc_sign(own)), k)


def arc_largest(own: dict[str, float], widths: dict[str, float], k: float, count: int) -> float:
    sign = _arc_sign(own)
    nominal = _arc(deviated.drawn(own, {}, 1), sign)[0]
    return deviated.of_largest(_arc(deviated.drawn(own, widths, count), sign), nominal, k)


def slide_squares(own: dict[str, float], widths: dict[str, float], k: float, count: int) -> float:
    errors = deviated.slider(deviated.drawn(own, widths, count), INPUTS) - WANTED
    return deviated.of_squares(errors / np.sqrt(len(INPUTS)), k)


def slide_largest(own: dict[str, float], widths: dict[str, float], k: float, count: int) -> float:
    nominal = deviated.slider(deviated.drawn(own, {}, 1), INPUTS)[0] - WANTED
    errors = deviated.slider(deviated.drawn(own, widths, count), INPUTS) - WANTED
    return deviated.of_largest(errors[..., None], nominal[:, None], k)


def loss(own: dict[str, float], widths: dict[str, float], k: float, count: int) -> float:
    sets = deviated.drawn(own, widths, count)
    found = deviated.in_chunks(
        lambda p: deviated.slider_loss(p, LOAD, RADIUS, FRICTION, GUIDE), sets
    )
    return deviated.of_value(found, k)


LENGTHS = {"r1": 0.01, "r2": 0.01, "r3": 0.01, "r4": 0.01, "r_cx": 0.01, "r_cy": 0.01}
SLIDES = {"r": 0.005, "l": 0.005, "e": 0.01}
FUNCTION = FunctionTargets(
    output="slide.slide", targets=np.stack([INPUTS, WANTED], axis=1).tolist(),
    input_start=float(INPUTS[0]), output_start=float(WANTED[0]),
)  # fmt: skip
CASES = (
    Case("four-bar, sum of squares", FOUR_BAR, LENGTHS, arc_squares, {}),
    Case("four-bar, largest error", FOUR_BAR, LENGTHS, arc_largest, {"measure": "minimax"}),
    Case("slider-crank, mean square", SLIDER, SLIDES, slide_squares, {"goal": FUNCTION}),
    Case(
        "slider-crank, largest error", SLIDER, SLIDES, slide_largest,
        {"goal": replace(FUNCTION, measure="minimax")},
    ),
    Case(
        "slider-crank, friction loss", SLIDER, {"r": 0.005, "l": 0.05, "e": 0.05}, loss,
        {"goal": Minimise(of="cycle/summary/loss"), "free": {"l": (0.5, 3.0), "e": (-1.0, 1.0)},
         "starts": 3},
    ),
)  # fmt: skip
