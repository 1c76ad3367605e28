"""Units of series, columns and entries of a summary by their names."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import fields

from mechdae.describe.coordinate_kinds import KINDS as COORDINATES
from mechdae.describe.coordinate_kinds import kind_of
from mechdae.describe.coordinates import coordinate_unit
from mechdae.describe.joints.joint import GAPS
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.units import over

UNITS = {
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s2",
    "angle": "rad",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s2",
    "orientation": "1",
    **{
        f"{word}{rate}": unit + over
        for word, unit in (
            *((word, "rad") for word in ("angle", "angle2", "elevation", "azimuth")),
            *((word, "m") for word in ("x", "y", "length")),
        )
        for rate, over in (
            ("_velocity", "/s"),
            ("_acceleration", "/s2"),
            ("_jerk", "/s3"),
        )
    },
    **dict.fromkeys(("angle2", "elevation", "azimuth"), "rad"),
    "length": "m",
    "x": "m",
    "y": "m",
    "slide": "m",
    "slide_velocity": "m/s",
    "slide_acceleration": "m/s2",
    "coriolis": "m/s2",
    "s": "1",
    "s_velocity": "1/s",
    "s_acceleration": "1/s2",
    "s_jerk": "1/s3",
    "jerk": "m/s3",
    "angular_jerk": "rad/s3",
    "slide_jerk": "m/s3",
    "transmission_angle": "rad",
    "slide_per_angle": "m",
    "angle_per_slide": "1/m",
    "torque_per_force": "m",
    "force_per_torque": "1/m",
    "tangent": "rad",
    "curvature": "1/m",
    "torsion": "1/m",
    "centrode_fixed": "m",
    "centrode_moving": "m",
    "axode_fixed_direction": "1",
    "axode_fixed_point": "m",
    "axode_moving_direction": "1",
    "axode_moving_point": "m",
    "screw_pitch": "m",
    "loss": "W",
    "loss_uncoupled": "W",
    "normal": "N",
    "gap": "m",
    "gap_angle": "rad",
    "contact_force": "N",
    "contact_moment": "N m",
    "pressure": "Pa",
    "sliding_speed": "m/s",
    "pv": "W/m2",
    "energy": "J",
    "kinetic": "J",
    "potential": "J",
    "drift": "1",
    "gap_offset": "m",
    "gap_turn": "rad",
    **{
        f"{word}{end}": unit
        for word, unit in (("position", "m"), ("distance", "m"), ("slide", "m"), ("angle", "rad"))
        for end in ("_band", "_reached", "_shift")
    },
}

WHOLE = (("Fx", "Fy", "M"), ("N", "N", "N m"))
IN_SPACE = (("Fx", "Fy", "Fz", "Mx", "My", "Mz"), ("N",) * 3 + ("N m",) * 3)
REACTION: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    **dict.fromkeys(("", "uncoupled", "static", "inertial", "body"), WHOLE),
    "radial": (("Fr", "Ft"), ("N", "N")),
}
"""Names and units of a reaction's components by the last word of its name."""
SUMMARY = {
    "swing": "rad",
    "stroke": "m",
    "return_angle": "rad",
    "time_ratio": "1",
    "useful": "W",
    "loss": "W",
    "input": "W",
    "efficiency": "1",
    "efficiency_uncoupled": "1",
    "efficiency_formula_10": "1",
    "frequencies": "Hz",
    "damping": "1",
    "settling_time": "s",
    "envelope": "m",
}
"""Units of entries of a summary."""
WEAR = {"peak_pressure": "Pa", "peak_pv": "W/m2", "mean_pv": "W/m2", "sliding_distance": "m"}
"""Units of what is told of a contact along a cycle."""
OUTPUT_RATES = ("value", "rate", "second", "third")
DRIVER_UNITS = {"velocity": "/s", "acceleration": "/s2", "jerk": "/s3"}
HISTORY = ("last", "highest", "lowest", "peak", "fluctuation", "settling")
"""First steps of paths that give one number of a motion's time history."""
UNITS_OF_HISTORY = {"settling": "s", "fluctuation": "1"}
"""Units of those that are not in the unit of the path."""
SHAKING = {"shaking/force": "N", "shaking/moment": "N m"}
KINDS = ("drivers", "bodies", "points", "joints", "outputs")
TURNS = tuple(word for word, kind in COORDINATES.items() if kind.unit == "rad")
"""Coordinates that are angles."""


OWN_NAMES = frozenset(
    "problem task kind mechanism title drivers bodies points joints outputs centres status bound "
    "condition labels events checks summary fault definition parameters table time efforts parts "
    "solutions unique data scalars work".split()
)
"""First steps of paths that are no named outputs, whatever those are called."""


def whole_path(outputs: Container[str], path: str) -> str:
    """Return the path a named output stands for (``Theta``, ``Theta/rate``), else `path`."""
    name, _, rest = path.partition("/")
    if name in outputs and name not in OWN_NAMES:
        return f"outputs/{name}/{rest or 'value'}"
    return path


def reaction_parts(name: str, width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of the `width` components of a reaction by the name of its series."""
    return IN_SPACE if width == len(IN_SPACE[0]) else REACTION[name[9:]]


def centre_unit(pair: str) -> str:
    """Return the unit of what is told of a pair of bodies: only directions have no length."""
    return "1" if pair.endswith(".direction") else "m"


def series_unit(mechanism: Mechanism, kind: str, part: str, name: str) -> str:
    """Return the unit of a series: of "drivers" by the coordinate, else by its name.

    That of a named output is empty where it does not follow from its expression.
    """
    if kind == "outputs":
        from mechdae.describe.expression_units import output_unit

        return output_unit(mechanism, part, OUTPUT_RATES.index(name))
    if kind != "drivers":
        return UNITS.get(name, "1")
    return coordinate_unit(mechanism, part) + DRIVER_UNITS.get(name, "")


def effort_unit(mechanism: Mechanism, name: str) -> str:
    """Return the unit of the effort at a driver's coordinate."""
    return "N m" if coordinate_unit(mechanism, name) == "rad" else "N"


def path_unit(mechanism: Mechanism, path: str, along: str = "") -> str:
    """Return the unit of what a whole path of a result names; empty where it is not known.

    ``along`` is the coordinate of the driver that moves.
    """
    word, _, rest = whole_path(mechanism.outputs, path).partition("/")
    if word in HISTORY:
        return UNITS_OF_HISTORY.get(word) or path_unit(mechanism, rest, along)
    part, _, name = rest.rpartition("/")
    if word == "outputs" and (part not in mechanism.outputs or name not in OUTPUT_RATES):
        return ""
    if word in KINDS and part:
        return "" if name.startswith("reaction") else series_unit(mechanism, word, part, name)
    if word.startswith("efforts"):
        return effort_unit(mechanism, rest)
    if word == "summary":
        return _summary_unit(mechanism, rest.split("/"), along)
    if word == "work":
        return "J"
    return SHAKING.get(path) or UNITS.get(path.rsplit("/", 1)[-1], "")


def price_unit(mechanism: Mechanism, unit: str, joint: str) -> str:
    """Return the unit of what a quantity in `unit` grows by with the gap of a joint."""
    owner = mechanism.joints.get(joint)
    for entry in fields(owner) if owner is not None else ():
        if entry.name in GAPS and getattr(owner, entry.name) is not None:
            return over(unit, entry.metadata["unit"])
    return ""


def _summary_unit(mechanism: Mechanism, steps: list[str], along: str) -> str:
    """Return the unit of an entry of the summary."""
    word, last = steps[0], steps[-1]
    if last in ("at", "from", "to"):
        return coordinate_unit(mechanism, along) if along else ""
    if word == "play" and len(steps) > 5:
        unit = series_unit(mechanism, *steps[2:5])
        return price_unit(mechanism, unit, last) if steps[5] == "price" else unit
    if word in SUMMARY:
        return SUMMARY[word]
    if word.startswith("loss_by_joint"):
        return "W"
    if word == "wear":
        return WEAR.get(last, "")
    if word == "transmission" and last in ("min", "max"):
        return "rad"
    if word == "extremes" and last == "value":
        return kind_of(steps[1]).unit
    if word == "curve":
        return {"length": "m", "area": "m2"}.get(last, "")
    if word == "state" and steps[1:2] and steps[1] in mechanism.outputs:
        return series_unit(mechanism, "outputs", steps[1], "value")
    return ""
