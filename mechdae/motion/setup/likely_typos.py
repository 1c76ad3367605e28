"""Likely typing mistakes: degrees without a suffix, millimetres taken for metres."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import combinations

import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.dimensions import automatic_units
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Driven

TIMES = 10
"""Times all other lengths together that a length looks wrong."""
FEW = 8
"""Points whose distances are compared one by one."""
SMALL = 1e-3
"""Share of the largest length below which a length looks wrong."""
LEAST = 3
"""Lengths that a mechanism must have to tell which of them is out of place."""
MANY = 4 * math.pi
"""Angle of a sketch that looks like degrees without a suffix [rad]."""
TURNS = 5
"""Turns above which a whole number of radians looks like degrees."""


def doubts(problem: Problem) -> list[str]:
    """Return what looks like a slip of the pen in a problem: of its file, drivers, lengths."""
    notes = list(problem.notes)
    text = " ".join(notes)
    for name, task in problem.tasks.items():
        if isinstance(task, Driven):
            slips = driver_slips(task, problem.mechanism)
            untold = [note for note in slips if note.split(" is in")[0].split(": ")[1] not in text]
            notes += [f"tasks.{name}.{note}" for note in untold]
    return notes + odd_lengths(problem.mechanism)


def driver_slips(task: Driven, mechanism: Mechanism) -> list[str]:
    """Return notes about values of drivers that look like degrees or millimetres."""
    notes = []
    for k, driver in enumerate(task.all_drivers):
        c = coordinate(mechanism, driver.coordinate)
        if driver.law is not None:
            continue
        given = {"from": driver.from_, "to": driver.to}
        plain = {word: n for word, n in given.items() if isinstance(n, float)}
        named = [n for n in driver.at or () if isinstance(n, float)]
        if named:
            plain["at"] = max(named, key=abs)
        word, value = max(plain.items(), key=lambda item: abs(item[1]), default=("", 0.0))
        place = "driver" if task.drivers is None else f"drivers[{k}]"
        if not c.is_angle:
            lengths = sum(size for size, _ in _lengths(mechanism, mechanism.values()))
            if lengths and abs(value) > TIMES * lengths:
                words = ", ".join(f"{name}_mm" for name in plain)
                notes.append(
                    f"{place}: {word} = {value:g} is in metres, {abs(value) / lengths:.0f} times "
                    f"all lengths together; did you mean {words}?"
                )
        elif abs(value) > 2 * math.pi * TURNS and value == round(value):
            notes.append(
                f"{place}: {word} = {value:g} is in radians, {abs(value) / (2 * math.pi):.1f} "
                f"turns of {c.part}; did you mean {word}_deg?"
            )
    return notes


def long_length(mechanism: Mechanism) -> str:
    """Return a message about a length that dwarfs all others together, else an empty text."""
    return _longest([item for item in _lengths(mechanism, mechanism.values()) if item[0] > 0])


def _longest(lengths: list[tuple[float, Callable[[], str]]]) -> str:
    sizes = sorted(lengths, key=lambda item: item[0], reverse=True)
    if len(sizes) < LEAST:
        return ""
    (largest, name), others = sizes[0], sum(size for size, _ in sizes[1:])
    if largest <= TIMES * others:
        return ""
    return (
        f"{name()}, {largest / others:.0f} times all other lengths together: is that in metres? "
        "(points_mm, length_mm, NAME_mm are in millimetres)"
    )


def odd_lengths(mechanism: Mechanism) -> list[str]:
    """Return notes on lengths that are out of proportion.

    One more than ten times all others together, one below a thousandth of the largest, radii and
    other sizes of joints and loads more than ten times the largest; links of negative length.
    """
    values = mechanism.values()
    sizes = [item for item in _lengths(mechanism, values) if item[0] > 0]
    long = _longest(sizes)
    notes = [*_backward(mechanism, values), *([long] if long else [])]
    if long or not sizes:
        return notes
    largest = max(size for size, _ in sizes)
    for size, key in sizes if len(sizes) >= LEAST else ():
        if size < SMALL * largest:
            notes.append(
                f"{key()}, {largest / size:.0f} times less than the largest length: is that in "
                "millimetres? (points, length, NAME without a suffix are in metres)"
            )
    owners = (*mechanism.joints, "loads")
    named = [name for name in values if name.partition(".")[0] in owners]
    units = dict(automatic_units(mechanism)) if named else {}
    for name in named:
        if units.get(name) == "m":
            size = abs(values[name])
            if math.isfinite(size) and size > TIMES * largest:
                notes.append(
                    f"{name} is {size:g} m, {size / largest:.0f} times the largest length: is that "
                    "in metres?"
                )
    return notes


def _backward(mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Return notes on links that a negative parameter alone makes point backwards."""
    notes = []
    for name, body in mechanism.bodies.items():
        feet = [point for point, place in body.points.items() if not any(place)]
        for point, (along, *across) in body.points.items():
            negative = along in mechanism.parameters and values[f"{name}.{point}.x"] < 0
            if negative and feet and not any(across):
                notes.append(
                    f"{along} is negative: {point} of {name} lies behind {feet[0]}, on the other "
                    "side of the link's angle"
                )
    return notes


def _lengths(
    mechanism: Mechanism, values: Mapping[str, float]
) -> Iterator[tuple[float, Callable[[], str]]]:
    """Yield the largest distance between joint points of each body, other lengths, their names."""
    axes = mechanism.axes
    points: dict[str, dict[str, tuple[float, ...]]] = {}
    for joint in mechanism.joints.values():
        for reference in (joint.first, joint.second):
            body, point = reference.split(".")
            place = tuple(values.get(f"{reference}.{axis}", 0.0) for axis in axes)
            points.setdefault(body, {})[point] = place
        if joint.bar:
            size = abs(values[f"{joint.name}.length"])
            yield size, partial("{}.length is {:g} m".format, joint.name, size)
    for body, places in points.items():
        if len(places) > 1:
            size = _largest(list(places.values()))
            yield size, partial(_far_apart, body, places, size)
    known = mechanism.parameter_values
    for name, number in mechanism.sketch.items():
        joint_name = name.removesuffix(".slide")
        if joint_name in mechanism.joints and mechanism.joints[joint_name].slides:
            size = abs(evaluate(number, known))
            yield size, partial("the slide of {} is sketched at {:g} m".format, joint_name, size)


def _largest(points: list[tuple[float, ...]]) -> float:
    """Return the largest distance of points."""
    if len(points) <= FEW:
        return max(math.dist(a, b) for a, b in combinations(points, 2))
    places = np.array(points)
    return float(np.linalg.norm(places[:, None] - places[None], axis=2).max())


def _far_apart(body: str, points: dict[str, tuple[float, ...]], size: float) -> str:
    """Return which points of a body are farthest apart."""
    pairs = combinations(points, 2)
    a, b = max(pairs, key=lambda pair: (math.dist(*(points[name] for name in pair)), pair))
    where = "on the ground" if body == GROUND else f"of {body}"
    return f"{b} and {a} {where} are {size:g} m apart"
