"""A problem as text for a screen: parts of the mechanism with their points, numbers, tasks."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

from mechdae.describe.dimensions import parameter_units
from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism
from mechdae.describe.tasks.kinds import Task

WIDE = 100
MOST = 24
"""Parts of a kind that are listed."""


def in_notebook(subject: object, text: str) -> str:
    """Return the diagram of a problem's or mechanism's sketch and a text, for notebooks."""
    url = import_module("mechdae")._sketched(subject)
    picture = f'<img src="{url}" alt="as sketched">' if url else ""
    return f"{picture}<pre>{html.escape(text)}</pre>"


def mechanism_lines(mechanism: Mechanism, tasks: Mapping[str, Task]) -> list[str]:
    """Return what a mechanism is made of, a part in each line, and its numbers with units."""
    points: Mapping[str, Body | Ground] = {GROUND: mechanism.ground, **mechanism.bodies}
    lines = ["bodies"]
    lines += _listed(
        f"{name}: {', '.join(body.points) or 'no points'}" for name, body in points.items()
    )
    lines.append("joints")
    lines += _listed(
        f"{name}: {joint.kind} {joint.first} - {joint.second}"
        for name, joint in mechanism.joints.items()
    )
    if mechanism.loads:
        lines.append("loads")
        lines += _listed(f"{name}: {load.kind}" for name, load in mechanism.loads.items())
    if mechanism.parameters:
        values, units = mechanism.parameter_values, parameter_units(mechanism, tasks.values())
        named = ((name, units.get(name, "")) for name in mechanism.parameters)
        texts = [f"{name} = {values[name]:.6g} {unit.strip('1')}".rstrip() for name, unit in named]
        more = f"; {len(texts) - MOST} more" if len(texts) > MOST else ""
        lines += ["parameters", *_wrapped(", ".join(texts[:MOST]) + more)]
    return lines


def tasks_lines(tasks: Mapping[str, Any]) -> list[str]:
    """Return the tasks of a problem with what drives them."""
    lines = ["tasks"] if tasks else []
    for name, task in tasks.items():
        drivers = getattr(task, "all_drivers", ())
        driven = (
            f", driven by {', '.join(driver.coordinate for driver in drivers)}" if drivers else ""
        )
        lines.append(f"  {name}: {task.kind}{driven}")
    return lines


def _listed(texts: Iterable[str]) -> list[str]:
    """Return the texts as lines; of many parts the first ones and how many there are."""
    every = list(texts)
    lines = [line for text in every[:MOST] for line in _wrapped(text)]
    return lines + ([f"  ... and {len(every) - MOST} more"] if len(every) > MOST else [])


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDE, initial_indent="  ", subsequent_indent="      ")
