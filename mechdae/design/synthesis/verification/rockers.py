"""A coordinate back and forth: its way and the times of both strokes."""

from __future__ import annotations

import numpy as np

from mechdae.describe.tasks.goals import Rocker
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import TURN, DesignFile

EXACT = 1e-9
"""Miss of a way, in sizes of the coordinate."""
TIMED = 1e-7
"""Miss of a stroke of the driver [rad]."""


def measured(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return how far way and times are from what is asked for."""
    asked = stated.asked
    assert isinstance(asked, Rocker)
    found, defects = design.turn
    if found is None:
        return Worth(np.inf, np.full(2, np.nan), list(defects))
    defects, part = list(defects), asked.coordinate.rpartition(".")[0]
    table = found.summary.get("stroke" if asked.slides else "swing", {})
    way = table.get(part)
    ends, values = design.swept(claim.at, (asked.coordinate if asked.slides else part,))
    defects += values
    if ends is None or way is None:
        word = "the joint does not slide" if asked.slides else "the body does not swing"
        return Worth(np.inf, np.full(2, np.nan), [*defects, word])
    series = ends.joints[part].slide if asked.slides else ends.bodies[part].angle
    reached = float(np.ptp(series))
    size = max(design.problem.mechanism.scale if asked.slides else 1.0, asked.reach or 0.0)
    wanted = way if asked.reach is None else asked.reach
    errors = np.array([way - wanted, reached - way])
    if np.abs(errors).max() > EXACT * size:
        defects.append(missed(asked.slides, part, float(way), float(wanted), reached))
    turned = float(abs(claim.at[1] - claim.at[0]))
    ratio = turned / (TURN - turned)
    wanted = asked.time_ratio
    if wanted is not None and not abs(turned - TURN * wanted / (1 + wanted)) <= TIMED:
        defects.append(f"the time ratio of {part} is {ratio:.6g}, not {wanted:.6g}")
    value = {"reach": float(way), "time_ratio": ratio}.get(stated.word)
    if value is not None and stated.bounds is not None:
        low, high = stated.bounds
        slack = 1e-7 * max(abs(value), stated.unit)
        if not low - slack <= value <= high + slack:
            defects.append(f"{stated.path} is {value:.6g}, the limit is missed")
    if value is None or stated.bounds is not None:
        value = float(np.abs(errors).max())
    return Worth(value, errors, defects)


def missed(slides: bool, part: str, way: float, wanted: float, reached: float) -> str:
    """Return what is wrong with a way, or with the ends between which it was sought."""
    word = "stroke" if slides else "swing"
    shown = [
        f"{value:.9g} m" if slides else f"{np.degrees(value):.9g} deg"
        for value in (way, wanted, reached)
    ]
    if abs(reached - way) > abs(way - wanted):
        return (
            f"the two ends that the search took are {shown[2]} apart, the {word} of {part} is "
            f"{shown[0]}"
        )
    return f"the {word} of {part} is {shown[0]}, not {shown[1]}"
