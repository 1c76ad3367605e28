"""Paths of points with ticks of equal time, hodographs, and polar diagrams of bearing loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.graphs.abscissa import subtitle_of
from mechdae.draw.graphs.loci import LociPanels, Locus
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.graphs.series import SMALL, Array, vector_of
from mechdae.draw.smooth import smooth_vectors
from mechdae.errors import InputError
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.results import SweepResult

MOST = 6
"""Points that are drawn if none are named."""
PLACES = {
    "position": "points",
    "centre": "instant centres",
    "centrode fixed": "instant centres",
    "centrode moving": "instant centres in the body's axes",
}
"""Quantities that are places, and whose."""
NEAR = 1.5
"""Fixed pivots are shown up to so many sizes of the curves beside them."""


def draw(
    result: SweepResult,
    ax: Axes | None = None,
    *,
    of: Sequence[str] | None = None,
    ticks: bool = True,
    pivots: bool = True,
    label: str = "",
) -> Axes:
    """Draw the paths of points in the plane; of velocities or accelerations, hodographs.

    Options are those of the catalogue. Without ``of`` the points of links that are on no joint,
    such as coupler points, else of all links that are neither driven nor on a fixed pivot.

    Raises
    ------
    InputError
        No point moves, or the vectors have different units.
    """
    return draw_all([result], [label], ax, of=of, ticks=ticks, pivots=pivots)


def draw_all(
    results: Sequence[SweepResult], labels: Sequence[str], ax: Axes | None, *,
    of: Sequence[str] | None = None, ticks: bool = True, pivots: bool = True,
) -> Axes:  # fmt: skip
    """Draw the paths of several variants of a task, see `draw`; ticks only of one."""
    result, several = results[0], len(results) > 1
    chosen = [list(of) if of else default_points(drawn) for drawn in results]
    if not any(chosen):
        raise InputError("no point of this result moves", hint="name points: of=['body.P']")
    fine, loci, quantities, unit = _vectors(results, chosen, labels if several else None)
    places = set(quantities) <= set(PLACES)
    extent = np.vstack([locus.values for locus in loci])
    word = "" if places else f"{quantities[0]} "
    world = places and "centrode moving" not in quantities
    what = f"hodograph of the {' and '.join(quantities)}"
    if places:
        what = f"paths of {' and '.join(PLACES[kind] for kind in quantities)}"
    about = subtitle_of(result, what, *([] if several else filter(None, labels)))
    scale, names = scale_of(unit, [extent], result.units), (f"{word}x", f"{word}y")
    return LociPanels(
        fine, ax, loci, scale, names, about, ticks=ticks and not several,
        pivots=pivots_of(result, extent) if world and pivots else (), origin=not places,
    ).panel  # fmt: skip


def _vectors(
    results: Sequence[Any], chosen: Sequence[list[str]], labels: Sequence[str] | None = None
) -> tuple[Any, list[Locus], list[str], str]:
    """Return the first result at poses near each other, curves, their quantities and unit.

    Raises
    ------
    InputError
        Vectors of several units.
    """
    finest = [smooth_vectors(drawn, names) for drawn, names in zip(results, chosen, strict=True)]
    rows = [
        (vector_of(fine, name), "" if labels is None else f", {labels[k]}")
        for k, (fine, names) in enumerate(zip(finest, chosen, strict=True))
        for name in names
    ]
    units = list(dict.fromkeys(row[2] for row, _ in rows))
    if len(units) > 1:
        raise InputError(f"vectors in {' and in '.join(units)} in one plane", where="of")
    quantities = list(dict.fromkeys(row[1] for row, _ in rows))
    loci = [
        Locus(part + f" {quantity}" * (len(quantities) > 1) + label, values)
        for (part, quantity, _, values), label in rows
    ]
    return finest[0], loci, quantities, units[0]


def default_points(result: SweepResult) -> list[str]:
    """Return the points whose paths say most: coupler points, else those of floating links."""
    mechanism = result.mechanism
    joined: dict[str, str] = {}
    fixed = {name.rpartition(".")[0] for name in result.drivers}
    for joint in mechanism.joints.values():
        for side, other in ((joint.first, joint.second), (joint.second, joint.first)):
            joined[side] = joint.name
            if other.split(".")[0] == GROUND:
                fixed.add(side.split(".")[0])
    moving = [
        name
        for name, series in result.points.items()
        if "position" in series and _spread(series["position"]) > 0
    ]
    free = [name for name in moving if name not in joined]
    floating = [name for name in moving if name.split(".")[0] not in fixed]
    distinct: list[str] = []
    for name in free or floating or moving:
        path = result.points[name].position
        near = SMALL * 1e6 * _spread(path)
        if not any(_same(path, result.points[other].position, near) for other in distinct):
            distinct.append(name)
    return distinct[:MOST]


def _spread(values: Array) -> float:
    finite = values[np.isfinite(values).all(axis=1)]
    if len(finite) < 2:
        return 0.0
    size = float(np.abs(finite).max())
    spread = float(np.ptp(finite, axis=0).max())
    return spread if spread > SMALL * size else 0.0


def _same(first: Array, second: Array, near: float) -> bool:
    return bool(np.allclose(first, second, rtol=0.0, atol=near, equal_nan=True))


def pivots_of(result: SweepResult, points: Array) -> list[tuple[str, Floats]]:
    """Return name and place of the ground's points on joints, near the curves."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return []
    low, high = points.min(axis=0), points.max(axis=0)
    reach = NEAR * float((high - low).max())
    numbers = result.mechanism.values()
    found: dict[tuple[float, float], str] = {}
    for joint in result.mechanism.joints.values():
        for side in (joint.first, joint.second):
            body, _, name = side.partition(".")
            if body != GROUND or not (joint.hinge or joint.slot):
                continue
            place = (float(numbers[f"{side}.x"]), float(numbers[f"{side}.y"]))
            if (np.array(place) >= low - reach).all() and (np.array(place) <= high + reach).all():
                found.setdefault(place, name)
    return [(name, np.array(place)) for place, name in found.items()]


AXES = {
    "reaction": "world axes",
    "reaction body": "axes of the second body",
    "reaction radial": "along and across the link",
}


def draw_polar(result: Any, ax: Axes | None = None, *, of: Sequence[str] | None = None) -> Axes:
    """Draw vectors of joints by their tips, with the driver's values along the curves.

    Without ``of`` the reaction of the pin that has to bear most, of a guide where there is no pin.

    Raises
    ------
    InputError
        No joint has a reaction, or the vectors have different units.
    """
    chosen = list(of) if of else _largest(result)
    if not chosen:
        raise InputError("no joint has a reaction here", hint="solve a task of kind reactions")
    fine, loci, quantities, unit = _vectors([result], [chosen])
    sizes = [np.hypot(*locus.values.T) for locus in loci]
    scale = scale_of(unit, sizes, result.units)
    axes = ", ".join(AXES.get(quantity.split(",")[0], quantity) for quantity in quantities)
    radial = quantities == ["reaction radial"]
    names = ("Fr", "Ft") if radial else ("Fx", "Fy") if unit == "N" else ("x", "y")
    about = subtitle_of(result, axes)
    frame = LociPanels(fine, ax, loci, scale, names, about, ticks=True, origin=True, peaks=True)
    frame.panel.grid(False)
    largest = float(np.nanmax(np.concatenate(sizes), initial=0.0))
    radii = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, float(scale(largest)))
    for radius in radii[1:]:
        look = {"facecolor": "none", "edgecolor": style.GHOST, "linewidth": 0.7 * frame.k}
        frame.panel.add_patch(Circle((0.0, 0.0), float(radius), zorder=1, **look))
    return frame.panel


def _largest(result: SweepResult) -> list[str]:
    """Return the reaction of the pin with the largest force, else of the guide."""
    sizes = {
        name: float(np.nanmax(np.hypot(series.reaction[:, 0], series.reaction[:, 1]), initial=0.0))
        for name, series in result.joints.items()
        if "reaction" in series
    }
    guides = {name for name in sizes if "normal" in result.joints[name]}
    sizes = {name: size for name, size in sizes.items() if name not in guides} or sizes
    return [f"joints/{max(sizes, key=lambda name: sizes[name])}/reaction"] if sizes else []
