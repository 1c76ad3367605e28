"""A set of dimensions in the place and the pose in which its design is reported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.parts.types.described.composition import CompositionDemand
from mechdae.parts.types.schemes.aims import ANGLE, CURVE, PATH, Aim
from mechdae.parts.types.schemes.closure import Moved, turned, turning
from mechdae.parts.types.schemes.scheme import SLIDER, Scheme, output_points, pivot_of
from mechdae.parts.types.schemes.shape import POINTS, Wanted, centred, fitted, resampled
from mechdae.parts.types.schemes.targets.visits import function_errors, visited
from mechdae.parts.types.schemes.work_items import SizedScheme
from mechdae.records import dataclass
from mechdae.types import Complexes

ANGLES = 720
"""Crank angles by which a design is laid on the wanted curve."""
TURN = 2 * np.pi


@dataclass(frozen=True)
class PlacedDesign:
    """Places of a scheme in one pose, and what its coordinates are called there.

    ``places`` (n,) complex [m]. ``angles``: of links in that pose, where they are not along their
    first two points. ``zeros``: point of a guide -> place that slides are counted from. ``at``
    (k,): angles of the crank at the targets, from that pose; None without targets. ``wanted`` (k,
    2): places [m], or (k,) values of the output, at these angles. ``span``: angles of the crank,
    from that pose, over which the design is certified.
    """

    places: Complexes
    angles: Mapping[int, float]
    zeros: Mapping[int, complex]
    at: Any = None
    wanted: Any = None
    span: tuple[float, float] = (0.0, TURN)


def placed_design(entry: SizedScheme, aim: Aim, demand: CompositionDemand) -> PlacedDesign:
    """Return a set on the wanted curve, by its targets, or with the first values of a function."""
    if aim.what == CURVE:
        return PlacedDesign(_on_curve(entry, Wanted(np.array(aim.corners))), {}, {})
    if aim.what == PATH:
        return _by_targets(entry, aim, demand)
    return _with_values(entry, aim, demand)


def output_link(scheme: Scheme) -> int:
    """Return the link whose angle is the output of a function."""
    pair = output_points(scheme)
    return next(k for k, link in enumerate(scheme.links) if link[:2] == pair)


def ways_of(scheme: Scheme, x: Complexes) -> list[tuple[complex, complex]]:
    """Return the ends of each guide in the first pose, between which its block goes.

    A guide of a moving link begins at the link's point on it.

    `x` (n, t): places of the points at all angles, those of the pose first.
    """
    found = []
    moved = Moved(x[:, None, :1], x[:, None, :])
    for k, link, _ in scheme.slides:
        kind, i, j = scheme.points[k]
        if kind == SLIDER:
            base, block, turn = j, k, turning(scheme, moved, j)[0]
        else:
            base, block, turn = k, j, (x[k] - x[i]) / (x[k, 0] - x[i, 0])
        way = x[block, 0] - x[base, 0]
        way = way / abs(way)
        along = ((x[block] - x[base]) * np.conj(way * turn)).real
        low, high = float(along.min()), float(along.max())
        if link:
            low, high = min(low, 0.0), max(high, 0.0)
        first, last = (complex(x[base, 0] + way * bound) for bound in (low, high))
        found.append((first, last))
    return found


def _on_curve(entry: SizedScheme, wanted: Wanted) -> Any:
    """Return the places (n,) [m] of a set, laid with its curve on the wanted one."""
    places = entry.places[None]
    x = turned(entry.scheme, places, TURN * np.arange(ANGLES) / ANGLES).x[entry.scheme.trace]
    curve = resampled(x, POINTS).points
    target = wanted.points(POINTS)
    fit = fitted(centred(curve), target - target.mean())
    moved = wanted.center + wanted.radius * target.mean()
    return moved + wanted.radius * fit.factor[0] * (entry.places - curve[0].mean())


def _by_targets(entry: SizedScheme, aim: Aim, demand: CompositionDemand) -> PlacedDesign:
    """Return a set whose tracing point goes by the targets, in the pose at the first one."""
    visits = demand.visits
    assert visits is not None
    met = visited(entry.scheme, entry.places[None], aim)
    angles = met.angles[0]
    # in the pose at the first target: there the crank's angle is the one that is given
    places = turned(entry.scheme, entry.places[None], angles[:1]).x[:, 0, 0]
    spots = aim.center + aim.radius * (met.factor[0] * places + met.shift[0])
    named = {1: float(visits.programme[0])} if visits.timing == "absolute" else {}
    wanted = np.array(visits.targets, float)
    return PlacedDesign(spots, named, {}, angles - angles[0], wanted, aim.span)


def _with_values(entry: SizedScheme, aim: Aim, demand: CompositionDemand) -> PlacedDesign:
    """Return a set whose input and output have the values that are asked for."""
    function, scheme = demand.function, entry.scheme
    assert function is not None
    _, offset = function_errors(scheme, entry.places[None], aim)
    start = function.output_start or 0.0
    spots = entry.places * aim.radius
    wanted = start + np.array(function.outputs, float)
    angles = {1: float(function.input_start or 0.0)}
    zeros = {}
    if aim.what == ANGLE:
        angles[output_link(scheme)] = start + float(offset[0])
    else:
        k, g = scheme.trace, pivot_of(scheme)
        way = (spots[k] - spots[g]) / abs(spots[k] - spots[g])
        # outputs are counted from the point of the guide, targets from the first value
        first = abs(spots[k] - spots[g]) + float(offset[0]) * aim.unit
        zeros[g] = complex(spots[k] - way * (start + first))
    return PlacedDesign(spots, angles, zeros, np.array(aim.angles), wanted, aim.span)
