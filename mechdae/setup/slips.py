"""Likely typing mistakes: degrees without a suffix, millimetres taken for metres."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import combinations

import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Driven
from mechdae.setup.drivers import DriverPlan

TIMES = 10
"""Times all other lengths together that a length looks wrong."""
FEW = 8
"""Points whose distances are compared one by one."""
LEAST = 3
"""Lengths that a mechanism must have to tell which of them is out of place."""
TURNS = 5
"""Turns above which a whole number of radians looks like degrees."""


def driver_slips(task: Driven, plan: DriverPlan) -> list[str]:
    """Return notes about values of drivers that look like degrees."""
    notes = []
    for k, (driver, c) in enumerate(zip(task.all_drivers, plan.coordinates, strict=True)):
        if not c.is_angle or driver.law is not None:
            continue
        given = {"from": driver.from_, "to": driver.to}
        plain = {word: n for word, n in given.items() if isinstance(n, float)}
        named = [n for n in driver.at or () if isinstance(n, float)]
        if named:
            plain["at"] = max(named, key=abs)
        word, value = max(plain.items(), key=lambda item: abs(item[1]), default=("", 0.0))
        if abs(value) > 2 * math.pi * TURNS and value == round(value):
            place = "driver" if task.drivers is None else f"drivers[{k}]"
            notes.append(
                f"{place}: {word} = {value:g} is in radians, {abs(value) / (2 * math.pi):.1f} "
                f"turns of {c.part}; did you mean {word}_deg?"
            )
    return notes


def long_length(mechanism: Mechanism) -> str:
    """Return a message about a length that dwarfs all others together, else an empty text."""
    sizes = sorted(_lengths(mechanism), key=lambda item: item[0], reverse=True)
    sizes = [item for item in sizes if item[0] > 0]
    if len(sizes) < LEAST:
        return ""
    (largest, told), others = sizes[0], sum(size for size, _ in sizes[1:])
    if largest <= TIMES * others:
        return ""
    return (
        f"{told()}, {largest / others:.0f} times all other lengths together: is that in metres? "
        "(points_mm, length_mm, NAME_mm are in millimetres)"
    )


def _lengths(mechanism: Mechanism) -> Iterator[tuple[float, Callable[[], str]]]:
    """Yield the largest distance between joint points of each body, other lengths, their names."""
    values = mechanism.values()
    points: dict[str, dict[str, tuple[float, float]]] = {}
    for joint in mechanism.joints.values():
        for reference in (joint.first, joint.second):
            body, point = reference.split(".")
            x, y = (values.get(f"{reference}.{axis}", 0.0) for axis in "xy")
            points.setdefault(body, {})[point] = (x, y)
        if joint.bar:
            size = abs(values[f"{joint.name}.length"])
            yield size, partial("{}.length is {:g} m".format, joint.name, size)
    for body, own in points.items():
        if len(own) > 1:
            size = _largest(list(own.values()))
            yield size, partial(_far_apart, body, own, size)
    known = mechanism.parameter_values
    for name, number in mechanism.sketch.items():
        joint_name = name.removesuffix(".slide")
        if joint_name in mechanism.joints and mechanism.joints[joint_name].slides:
            size = abs(evaluate(number, known))
            yield size, partial("the slide of {} is sketched at {:g} m".format, joint_name, size)


def _largest(points: list[tuple[float, float]]) -> float:
    """Return the largest distance of points."""
    if len(points) <= FEW:
        return max(math.dist(a, b) for a, b in combinations(points, 2))
    x, y = np.array(points).T
    return float(np.hypot(np.subtract.outer(x, x), np.subtract.outer(y, y)).max())


def _far_apart(body: str, points: dict[str, tuple[float, float]], size: float) -> str:
    """Return which points of a body are farthest apart."""
    pairs = combinations(points, 2)
    a, b = max(pairs, key=lambda pair: (math.dist(*(points[name] for name in pair)), pair))
    where = "on the ground" if body == GROUND else f"of {body}"
    return f"{b} and {a} {where} are {size:g} m apart"
