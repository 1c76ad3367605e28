"""What the tests of synthesis share: the benchmark cases and how a design is judged."""

from __future__ import annotations

import json
from functools import cache

import numpy as np

import mechdae as md
from mechdae.design.synthesis.synthesize import synthesize
from tests.reference.closure_fourbar import FourBar, judged
from tests.shared.paths import DATA

CASES = DATA / "synthesis.json"


@cache
def cases():
    """Return the benchmark cases by name of their problem."""
    listed = json.loads(CASES.read_text())["cases"]
    return {case["id"].lower().replace("_", "-").replace(".", "-"): case for case in listed}


FEW = {
    "c1-line6-free": 10, "c2-arc5-timed": 10, "c3-closed18-timed": 12, "c4-semi6-timed": 10,
    "c4-semi6-timed-r5-50": 10, "p-fig8-24-timed": 20, "p-heart20-free": 20,
    "fg4-log10-1-2-60-90": 8, "fg4-sq-0-90deg": 8, "fg4-sin-0-90-90-90": 12,
    "straight-180-6-0": 10,
}  # fmt: skip
"""Starts that find the best design; `docs/make_synthesis.py` runs all that the files ask for."""


@cache
def solved(name, task="design", **options):
    """Return the result of a task; each one is computed once."""
    problem = md.load(name)
    if task == "design" and name in FEW:
        options = {"starts": FEW[name], **options}
    return synthesize(problem, task, problem.tasks[task], **options)


def four_bar(parameters, case=None):
    """Return a design as a linkage that shares no code with the package."""
    p = {"x0": 0.0, "y0": 0.0, "theta0": 0.0, "r1": 1.0, "r_cx": 0.0, "r_cy": 0.0, **parameters}
    names = ("r1", "r2", "r3", "r4")
    return FourBar(
        tuple(p[n] for n in names), complex(p["r_cx"], p["r_cy"]), p["x0"], p["y0"], p["theta0"]
    )


def verdict_of(case, design):
    """Judge a design of a path at the driver values it reports."""
    targets = np.array(case["targets"], float)
    closed = case.get("closed") and "theta2" not in case and (targets[0] == targets[-1]).all()
    if closed:
        targets = targets[:-1]
    found = judged(
        four_bar(design["parameters"]), design["at"], targets,
        ordered="unprescribed" in case["timing"],
    )  # fmt: skip
    weights = np.ones(len(targets))
    weights[0] += bool(closed)
    return found, float(np.sum(weights * found.errors**2))
