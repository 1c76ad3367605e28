"""The smallest gap of a group that cannot be closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.mechanism import Mechanism
from mechdae.equations.groups import Group
from mechdae.equations.model import Model
from mechdae.motion.assembly.closure import Gap, bar_lengths, straight, worst
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.types import Floats, Unknowns

ANGLES = 24
"""Values of each angle from which the least is looked for, where there are one or two."""
LENGTHS = (-1.0, 0.0, 1.0)
"""Values of each length, in lengths of the mechanism."""
MOST, SEED = 600, 1
"""Starts; with more unknowns they are drawn at random."""
BEST = 8
"""Starts that are followed."""
ITERATIONS = 60
STIFF = 1e3
"""Weight of the equations of quaternions' lengths: bodies are not to grow so that joints close."""
SMALL = 1e-14
"""Share of a radian or of the mechanism's length: a shorter step ends the search."""


@np.errstate(over="ignore", invalid="ignore")
def opening(solver: BlockSolver, model: Model, x: Unknowns, u: Floats) -> Gap:
    """Return the joint that stays open and by how much, with the block's equations met best.

    That is least squares over the unknowns of the block, the earlier groups being where `x`
    (nx,) says; lengths are compared with the mechanism's, angles with a radian. Method of
    Levenberg and Marquardt from the best of many places.
    """
    graph, size = solver.graph, solver.size
    sizes = {"m": size, "1": 1 / STIFF}
    units = np.array([sizes.get(unit, 1.0) for unit in graph.block.units])
    widths = np.where(solver.angle, 1.0, size)
    lengths = bar_lengths(model.mechanism, graph.block.owners)
    z = x[graph.uses] if graph.uses else np.zeros(0)
    places = _places(solver) * widths
    misses = straight(solver.F(places, z, u), lengths)[0] / units
    order = np.argsort(np.sum(misses**2, axis=1), kind="stable")[:BEST]
    p = solver.values

    def value(at: Floats) -> tuple[Floats, Floats]:
        full = x.copy()
        full[graph.own] = at
        F, J, _ = graph.value_at(full, u, p)
        F, slope = straight(np.ravel(F), lengths)
        return F / units, J * (slope / units)[:, None] * widths

    found = [_least(value, places[k], widths) for k in order]
    best = min(found, key=lambda F: float(F @ F))
    gap = worst(best, graph.block, size)
    joints = model.mechanism.joints
    owner = gap.joint if gap.joint in joints else gap.joint.rpartition(".")[0]
    return replace(gap, joint=owner if owner in joints else gap.joint, superfluous=False)


def reach(mechanism: Mechanism, group: Group, place: Callable[[str], Any]) -> str:
    """Return how long two hinged links would have to be to close; "" for other groups.

    `place` gives the place of a point of bodies before the group.
    """
    if group.kind != "RRR" or len(group.bodies) != 2:
        return ""
    values, lengths, names, outer = mechanism.values(), [], [], []
    for body in group.bodies:
        pins = [
            mechanism.joints[name] for name in group.joints if body in mechanism.joints[name].bodies
        ]
        pins.sort(key=lambda pin: pin.name not in group.inner)
        points = [pin.ends_at(body)[0] for pin in pins]
        if len(set(points)) != 2 or not all(pin.hinge for pin in pins):
            return ""  # a bar, or a link without length
        outer.append(place(pins[1].ends_at(body)[1]))
        ends = [np.array([values[f"{p}.{axis}"] for axis in "xy"]) for p in points]
        lengths.append(float(np.linalg.norm(ends[1] - ends[0])))
        names.append(_called(mechanism, points))
    apart = float(np.linalg.norm(outer[1] - outer[0]))
    a, b = lengths
    if apart > a + b:
        return (
            f"here {names[0]} at least {apart - b:.6g} m, or {names[1]} at least {apart - a:.6g} m"
        )
    long = int(b > a)
    if apart < abs(a - b):
        most, least = min(a, b) + apart, max(a, b) - apart
        return (
            f"here {names[long]} at most {most:.6g} m, or {names[1 - long]} at least {least:.6g} m"
        )
    return ""


def _called(mechanism: Mechanism, points: list[str]) -> str:
    """Return what the length between two points of a link is called."""
    body = points[0].split(".")[0]
    named = mechanism.bodies[body].points
    first, second = (name for name in named if f"{body}.{name}" in points)
    numbers = [*named[first], *named[second]]
    nonzero = [number for number in numbers if number != 0]
    if len(nonzero) == 1 and nonzero[0] in mechanism.parameters:
        return str(nonzero[0])
    return f"{first} to {second} of {body}"


def _places(solver: BlockSolver) -> Floats:
    """Return places (k, n) to start from, lengths in lengths of the mechanism."""
    if sum(solver.angle) <= 2 and solver.n <= 3:
        turn = 2 * np.pi * np.arange(ANGLES) / ANGLES
        axes = [turn if angle else np.array(LENGTHS) for angle in solver.angle]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, solver.n)
        if len(grid) <= 3 * MOST:
            return grid
    random = np.random.default_rng(SEED).uniform(-1, 1, (MOST, solver.n))
    return random * np.where(solver.angle, np.pi, 1.0)


def _least(value: Any, x: Unknowns, widths: Floats) -> Any:
    """Return the residuals at the least sum of their squares near `x`."""
    F, J = value(x)
    damping = 1e-3
    for _ in range(ITERATIONS):
        normal = J.T @ J
        try:
            step = np.linalg.solve(normal + damping * np.eye(len(x)), J.T @ F)
        except np.linalg.LinAlgError:
            break
        ahead = x - step * widths
        new, slope = value(ahead)
        if new @ new < F @ F:
            x, F, J, damping = ahead, new, slope, max(damping / 10, 1e-12)
        else:
            damping *= 10
        if float(np.abs(step).max()) <= SMALL or damping > 1e12:
            break
    return F
