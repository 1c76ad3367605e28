"""What is to be known of designs beside their numbers: links drawn backwards, bounds in the way."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.design.synthesis.fourbar.freudenstein import three_pairs
from mechdae.design.synthesis.fourbar.starts import FourBarStarts
from mechdae.design.synthesis.search import Search


def lengths(mechanism: Mechanism) -> dict[str, str]:
    """Return the parameters that alone say where a pin is on the x axis of a link, and the link."""
    pins = {end for joint in mechanism.joints.values() for end in (joint.first, joint.second)}
    return {
        place[0]: name
        for name, body in mechanism.bodies.items()
        for point, place in body.points.items()
        if f"{name}.{point}" in pins and isinstance(place[0], str)
        and place[0] in mechanism.parameters and not any(place[1:])
    }  # fmt: skip


def drawn_backwards(mechanism: Mechanism, parameters: Mapping[str, float]) -> list[str]:
    """Return which links of a design have a negative length."""
    every = lengths(mechanism)
    return [
        f"{name} is negative: {every[name]} is drawn backwards, its pin on the other side"
        for name, value in parameters.items()
        if name in every and value < 0
    ]


def left_out(search: Search) -> str:
    """Return the lengths that meet three pairs of angles, where bounds leave them out."""
    space, loop, goal = search.space, search.space.loop, search.lead
    asked = goal.asked
    if not isinstance(asked, FunctionTargets) or loop is None or not space.single_loop:
        return ""
    starts = (asked.input_start, asked.output_start)
    if len(asked.targets or ()) != 3 or any(x is None or isinstance(x, str) for x in starts):
        return ""
    mechanism, free = space.poses.mechanism, search.asked.free
    c = coordinate(mechanism, asked.output)
    if not c.is_angle:
        return ""
    bodies = (GROUND, c.part) if c.kind == "body angle" else mechanism.joints[c.part].bodies
    if tuple(bodies) != (GROUND, loop.rocker):
        return ""
    by_body = {body: name for name, body in lengths(mechanism).items()}
    names = [by_body.get(link, "") for link in (loop.crank, loop.coupler, loop.rocker)]
    four = FourBarStarts(space, loop.pins["A"])
    sizes = four.described(space.middle).lengths
    values = np.array([mechanism.values().get(name, np.nan) for name in names])
    if not (set(names) <= set(free) and np.allclose(np.abs(values), sizes[1:])):
        return ""
    x, y = np.array(asked.targets, float).T
    found = three_pairs(
        four.absolute(asked.input_start + x - x[0]), four.output(asked.output_start + y - y[0])
    )
    if found is None:
        return ""
    found = np.sign(values) * found * sizes[0]
    out = [n for n, v in zip(names, found, strict=True) if not free[n][0] <= v <= free[n][1]]
    if not out:
        return ""
    shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, found, strict=True))
    return (
        f"the bounds of {', '.join(out)} leave out the four-bar that meets the three pairs: "
        f"{shown} (a negative length is a link that points the other way)"
    )
