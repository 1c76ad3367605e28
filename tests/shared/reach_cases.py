"""Bounds of spatial loops from reaches beside sampled derivatives and rounding in 80 bits."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import UNIT
from mechdae.describe.coordinates import coordinate
from mechdae.equations.reduction import model_of, scene
from mechdae.kernels.bounds.walk import ARRAYS, replay
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.graphs.row_reaches import RowReaches
from mechdae.motion.setup.outputs import Outputs
from tests.attack.spatial_honesty import case, platform

PLACES = 16
ROUNDOFF = 2.0**-53


@cache
def parts(loop: str) -> list[tuple[Any, RowReaches]]:
    """Return what a loop's scene holds: its blocks' equations and its outputs, with reaches."""
    rng = np.random.default_rng(sum(map(ord, loop)))
    found = platform(rng) if loop == "platform" else case(rng, loop)
    mechanism = found.mechanism
    drivers = [coordinate(mechanism, "J0.angle")]
    whole = scene(model_of(mechanism, drivers), drivers)
    outputs = Outputs(whole)
    graphs = [BlockGraph(whole, block) for block in whole.blocks]
    known = [graph.reaches for graph in graphs if graph.reaches is not None]
    values = outputs.expression
    known.append(RowReaches(whole, values, whole.reaches_of(values), [whole.x, whole.u]))
    return [(whole, own) for own in known]


def sampled(rows: RowReaches, whole: Any, rng: Any) -> Any:
    """Return sizes of what moves, and places within them; quaternions are as long as 1."""
    kinds = {c.symbol.element_hash(): c.kind for c in whole.unknowns}
    units = [kinds.get(s.element_hash()) is UNIT for s in rows.y.elements()]
    size = np.where(units, 1.0, rng.uniform(0.2, 4.0, rows.y.numel()))
    places = rng.uniform(-1, 1, (PLACES, len(size))) * size
    places[: PLACES // 4] = np.sign(places[: PLACES // 4]) * size
    turned = np.flatnonzero(units)
    for own in turned.reshape(-1, 4) if len(turned) else ():
        places[:, own] = rng.normal(size=(PLACES, 4))
        places[:, own] /= np.linalg.norm(places[:, own], axis=1)[:, None]
    return size, places


def worst(loop: str, rng: Any) -> tuple[float, float, float]:
    """Return the largest ratios of derivatives, second ones and roundings to their bounds."""
    ratios = [0.0, 0.0, 0.0]
    for whole, rows in parts(loop):
        size, places = sampled(rows, whole, rng)
        sizes = ca.vertsplit(ca.SX(ca.DM(size)), [0, *np.cumsum([m.numel() for m in rows.moving])])
        found = rows.bounds(sizes, whole=True)
        count = len(found.second)
        known = ca.Function("b", [rows.p], [found.first, ca.vertcat(*found.second), found.rounding])
        first, second, rounding = (np.array(v) for v in known(whole.model.p_values))
        slope = ca.jacobian(rows.values, rows.y)
        bend = ca.vertcat(*[ca.hessian(row, rows.y)[0] for row in rows.values.elements()])
        at = ca.Function("f", [rows.y, rows.p], [ca.densify(slope), ca.densify(bend)])
        value = ca.Function("v", [rows.y, rows.p], [rows.values])
        for y in places:
            J, H = (np.array(v) for v in at(y, whole.model.p_values))
            ratios[0] = max(ratios[0], _ratio(J, first))
            ratios[1] = max(ratios[1], _ratio(H.reshape(count, -1), second.reshape(count, -1)))
            off = _rounding(value, y, whole.model.p_values)
            ratios[2] = max(ratios[2], _ratio(off, ROUNDOFF * rounding.ravel()))
    return ratios[0], ratios[1], ratios[2]


def _ratio(value: Any, bound: Any) -> float:
    """Return the largest ratio, up to rounding of the derivatives themselves."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(np.abs(value) > 1e-30, np.abs(value) / bound, 0.0)
    return float(np.nanmax(np.where(np.abs(value) < 1e-13, np.minimum(ratio, 1.0), ratio)))


def _rounding(value: Any, y: Any, p: Any) -> Any:
    """Return how far a function in double precision is from the same in 80 bits."""
    double = np.array(value(y, p)).ravel()
    inputs = [np.asarray(v, np.longdouble) for v in (y, p)]
    (exact,) = replay(value, inputs, lambda code, v: ARRAYS[code](*v), np.longdouble)
    return np.array([float(a - b) for a, b in zip(double, exact, strict=True)])
