"""Velocity ratios against the driver, and the mechanical advantage without losses."""

from __future__ import annotations

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.motion.measures.along_sweep_extremes import AT_REST, quantities
from mechdae.motion.setup.outputs import Outputs
from mechdae.types import Floats

VELOCITY, ADVANTAGE = "velocity-ratio", "mechanical-advantage"
NAMES = {
    VELOCITY: (("velocity_ratio", "slide_per_angle"), ("angle_per_slide", "velocity_ratio")),
    ADVANTAGE: (
        ("mechanical_advantage", "force_per_torque"),
        ("torque_per_force", "mechanical_advantage"),
    ),
}
"""Measure -> name of the series by what drives (angle, slide) and what is driven (angle, slide)."""


def ratios(
    outputs: Outputs, measures: set[str], rates: Floats, driver: NamedCoordinate, unit: float
) -> dict[str, dict[str, dict[str, Floats]]]:
    """Return "bodies" or "joints" -> part -> series of what is reported and is not the driver.

    The velocity ratio is d(output)/d(driver), with its sign. The mechanical advantage is what an
    ideal mechanism makes of the driver's effort, one over the size of that ratio: it grows without
    bound towards a position in which the output rests, and is infinite there.

    Parameters
    ----------
    rates
        First derivatives by the driver, (n, columns of `outputs`).
    unit
        What a radian is for a driver that slides [m].
    """
    scale = outputs.scene.model.mechanism.scale
    found: dict[str, dict[str, dict[str, Floats]]] = {}
    joints = outputs.scene.model.mechanism.joints
    for quantity in quantities(outputs):
        if not quantity.is_output or quantity.name == driver.text:
            continue
        ratio = rates[:, quantity.column]
        rests = AT_REST * (1.0 if quantity.is_angle else scale) / unit
        with np.errstate(divide="ignore"):
            advantage = 1 / np.where(np.abs(ratio) > rests, np.abs(ratio), 0.0)
        values = {VELOCITY: ratio, ADVANTAGE: np.where(np.isnan(ratio), np.nan, advantage)}
        series = found.setdefault("joints" if quantity.part in joints else "bodies", {})
        for measure in sorted(measures, reverse=True):
            name = NAMES[measure][not driver.is_angle][not quantity.is_angle]
            name = name if quantity.alone else f"{quantity.name.rpartition('.')[2]}_{name}"
            series.setdefault(quantity.part, {})[name] = values[measure]
    return found
