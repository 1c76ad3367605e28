"""Slips planted in explanations and groups apart, seen on the mechanism of article 000."""

from __future__ import annotations

import re
from functools import cache

import numpy as np

import mechdae as md
from mechdae.draw.formulas.tree import Formula
from mechdae.errors import MechdaeError
from tests.shared.closing import passages
from tests.shared.planting import Slip

SUITE = "explanations/test_systems.py::test_"
DRAWN = "draw/test_apart.py::test_"
CIRCLES = {"P_1": 0.13668, "a": -1.1733, "b": -1.9809, "p": -0.64926, "q": 0.41582, "x_E": 0.72485,
           "y_E": 0.26253, "h": -0.34412, "φ_6": -8.69033, "φ_4": -41.64031}  # fmt: skip
"""Article 000 with the digits of arithmetic of its own (data/seed-a-printed.csv)."""
SIZES = ((0.42864, 0.53611), (1.65688, 0.93492), (0.89296, 0.23249), (1.25778, 0.40044),
         (0.96072, 0.65268), (5.14713, 5.00297))  # fmt: skip
"""Sizes that solve its systems, in the order of the text."""
LENGTHS = {"BE": 0.54, "F": 0.3013, "BC": 0.5179}


@cache
def pose() -> md.Result:
    return md.solve("gorshkov-seven-link", "pose")


def text() -> str:
    return md.explain(pose()).text().replace("−", "-")


def positions() -> float:
    """What stands behind the last = of each formula, over half a unit of its fifth digit."""
    try:
        told = md.explain(pose())
    except MechdaeError:
        return np.inf
    open_by = [
        part.gap for part in passages(told.document) if isinstance(part, Formula) and part.gap
    ]
    if max(open_by) > 1e-9:
        return np.inf
    lines = re.sub(r"\n {6,}=", " =", text()).splitlines()
    worst = 0.0
    for name, wanted in CIRCLES.items():
        found = [line for line in lines if line.strip().startswith(f"{name} = ")]
        values = [float(re.split(" = ", line)[-1].split()[0].rstrip("°")) for line in found]
        gaps = [abs(value - wanted) / abs(wanted) / 2e-5 for value in values]
        worst = max(worst, *gaps) if gaps else np.inf
    return worst


def systems() -> float:
    found = re.findall(r"^ +\([va][^()]*; [^()]*\) = \((\S+); (\S+)\) m/s", text(), re.MULTILINE)
    sizes = [tuple(abs(float(value)) for value in row) for row in found]
    if len(sizes) != len(SIZES):
        return np.inf
    return float(np.max(np.abs(np.array(sizes) - SIZES)) / 1e-4)


def groups() -> float:
    """Bars of groups apart are as long as links, and no two groups lie on each other."""
    axes = md.plot(pose(), "groups")
    spots = {
        str(patch.get_gid()): np.array(patch.get_center())
        for patch in axes.patches
        if hasattr(patch, "get_center")
    }
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    rings = {f"outer-{pin}" for pin in LENGTHS} & set(spots)
    inside = [left < spots[pin][0] < right and low < spots[pin][1] < high for pin in rings]
    if len(rings) < len(LENGTHS) or not all(inside):
        return np.inf
    bars = {"BE": "E", "F": "E", "BC": "C"}
    gaps = [
        abs(np.hypot(*(spots[f"outer-{ring}"] - spots[f"joint-{pin}-pin"])) - LENGTHS[ring])
        for ring, pin in bars.items()
    ]
    apart = np.hypot(*(spots["outer-BC"] - spots["outer-BE"])) > 0.3
    texts = [text.get_text() for text in axes.texts]
    return max(gaps) / 1e-9 if apart and texts.count("class II, order 2") == 3 else np.inf


def arcs() -> float:
    axes = md.plot(pose(), "diagram", angles=["all"])
    lines = {str(line.get_gid()): line.get_xydata() for line in axes.lines}
    wanted = {"φ4": -41.64031, "φ6": -8.69033, "φ7": 119.38749, "φ1": 38.117}
    worst = 0.0
    for name, degrees in wanted.items():
        arc = lines[f"angle-{name}"]
        a, b, c = arc[0], arc[len(arc) // 2], arc[-1]
        rows = 2 * np.array([b - a, c - a])
        corner = np.linalg.solve(rows, [b @ b - a @ a, c @ c - a @ a])
        turn = np.degrees(np.arctan2(*(arc[-1] - corner)[::-1]))
        worst = max(worst, abs(turn - degrees) / 1e-4)
    return worst


PLACING, SYSTEMS = "parts.paper.explanations.placing", "parts.paper.explanations.systems"
CLOSED, SOLVED = "closed_forms_end_in_the_pose", "systems_of_the_article_have_its_solutions"
APART = "groups_apart_are_to_one_scale_with_their_outer_pairs"
SLIPS = [
    Slip(PLACING, "(P1 - P2)/(2", "(P1 + P2)/(2", positions, SUITE + SOLVED),
    Slip(PLACING, "- {x}1 - a*b)", "+ {x}1 - a*b)", positions, SUITE + SOLVED),
    Slip(PLACING, "(a**2 - 2*a", "(a**2 + 2*a", positions, SUITE + SOLVED),
    Slip(PLACING, "_turn(way, arm)", "_turn(arm, way)", positions, SUITE + SOLVED),
    Slip(PLACING, "(y2 - y1)*c - ", "(y1 - y2)*c - ", positions, SUITE + CLOSED),
    Slip(SYSTEMS, "right[rows] -= sign", "right[rows] += sign", systems, SUITE + SOLVED),
    Slip(SYSTEMS, "k] += sign * one.sign", "k] += one.sign", systems, SUITE + SOLVED),
    Slip(SYSTEMS, "other = [*ways[edge.start], *edge.addends], ways[edge.end]",
         "other = [*ways[edge.start], *edge.addends], ways[edge.start]", systems, SUITE + SOLVED),
    Slip("draw.diagram.apart", "set(joint.bodies) <= mine | earlier", "set(joint.bodies) <= mine",
         groups, DRAWN + APART),
    Slip("draw.diagram.apart", "origin + shift for", "origin - shift for", groups, DRAWN + APART),
    Slip("draw.diagram.angles", "(np.pi - turn) %", "(np.pi + turn) %", arcs,
         DRAWN + "arcs_have_the_angles_of_the_article"),
]  # fmt: skip
