"""A pose in space as a sketch: coordinates of joints, and places of points where there are none."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.equations.coordinates import QUATERNION
from mechdae.kernels.run.functions import local
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.mode_tree import Mode
from mechdae.motion.setup.drivers import DECIMALS, DECIMALS_OF_DRIVERS
from mechdae.types import Floats, Json, Sym

if TYPE_CHECKING:
    from mechdae.equations.tree.tree_model import TreeModel


FLAT = 1e-6
"""Share of their distances by which points have to lie beside a line to tell how a body turns."""


def in_space(assembler: Assembler, mode: Mode, u: Floats, q: dict[tuple[str, str], float]) -> Json:
    """Return the coordinates of joints [deg, m], and points of bodies on balls and bars [m]."""
    scene, found = assembler.scene, {}
    tree: Any = scene.model
    driven = {driver.text for driver in scene.drivers}
    balls = {coordinate.owner for coordinate in scene.recovered if coordinate.name in QUATERNION}
    for coordinate in scene.recovered:
        joint = scene.model.mechanism.joints.get(coordinate.owner)
        if joint is None or coordinate.name not in joint.coordinates:
            continue
        if not tree.has_value(coordinate.owner, coordinate.name):
            continue
        name = (
            coordinate.owner
            if coordinate.name == joint.usual
            else f"{coordinate.owner}.{coordinate.name}"
        )
        if coordinate.kind is ANGLE:
            digits = (
                DECIMALS_OF_DRIVERS
                if f"{coordinate.owner}.{coordinate.name}" in driven
                else DECIMALS
            )
            found[f"{name}_deg"] = round(math.degrees(q[coordinate.key]), digits) + 0.0
        else:
            found[name] = q[coordinate.key]
    if not balls:
        return found
    model: Any = scene.model
    for edge in model.edges:
        if (edge.joint or edge.child) in balls:
            names = [f"{edge.child}.{point}" for point in _spread(model, edge.child)]
            make = partial(_side_by_side, model, names)
            places = local(scene, ("sketched", edge.child), make)(mode.x, u, assembler.p)
            found |= dict(zip(names, places.T.tolist(), strict=True))
    return found


def _side_by_side(model: TreeModel, names: list[str]) -> Sym:
    return ca.horzcat(*[model.point(name) for name in names])


def _spread(model: TreeModel, body: str) -> list[str]:
    """Return up to three points of a body in no line, which tell where it is."""
    values, chosen = model.mechanism.values(), []
    places = np.zeros((0, 3))
    for point in model.mechanism.bodies[body].points:
        if not model.has_place(f"{body}.{point}"):
            continue
        place = [values[f"{body}.{point}.{axis}"] for axis in model.mechanism.axes]
        more = np.vstack([places, place])
        spans = more[1:] - more[0]
        size = float(np.abs(spans).max(initial=0.0))
        if len(more) == 1 or np.linalg.matrix_rank(spans, tol=FLAT * size) == len(spans):
            chosen.append(point)
            places = more
        if len(chosen) == 3:
            break
    return chosen
