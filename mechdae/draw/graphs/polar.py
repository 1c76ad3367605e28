"""Polar diagrams of bearing loads: the tip of a force around its joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from mechdae.draw import style
from mechdae.draw.graphs.abscissa import abscissa_of
from mechdae.draw.graphs.loci import Locus, draw_loci
from mechdae.draw.graphs.scale import scale_of
from mechdae.draw.graphs.series import vector_of
from mechdae.draw.smooth import smooth_vectors
from mechdae.errors import InputError

AXES = {
    "reaction": "world axes",
    "reaction body": "axes of the second body",
    "reaction radial": "along and across the link",
}


def draw(result: Any, ax: Axes | None = None, *, of: Sequence[str] | None = None) -> Axes:
    """Draw vectors of joints by their tips, with the driver's values along the curves.

    Parameters
    ----------
    result
        Of a task of reactions.
    ax
        Axes to draw in; without it a new figure is made.
    of
        Paths of vectors: ``"joints/B/reaction"``, ``"joints/B/reaction_body"``; without it the
        reaction of the pin that has to bear most, of a guide where there is no pin.

    Returns
    -------
    matplotlib.axes.Axes
        Axes with equal scales and circles of equal size of the vector.

    Raises
    ------
    InputError
        No joint has a reaction, or the vectors have different units.
    """
    chosen = list(of) if of else _largest(result)
    finest = smooth_vectors(result, chosen)
    vectors = [vector_of(finest, path) for path in chosen]
    if not vectors:
        raise InputError("no joint has a reaction here", hint="solve a task of kind reactions")
    if len({unit for _, _, unit, _ in vectors}) > 1:
        raise InputError("the vectors have different units", where="of")
    quantities = list(dict.fromkeys(quantity for _, quantity, _, _ in vectors))
    several = len(quantities) > 1
    loci = [
        Locus(f"{part} {quantity}" if several else part, values)
        for part, quantity, _, values in vectors
    ]
    unit = vectors[0][2]
    scale = scale_of(unit, [np.hypot(*locus.values.T) for locus in loci], result.units)
    axes = ", ".join(AXES.get(quantity.split(",")[0], quantity) for quantity in quantities)
    radial = quantities == ["reaction radial"]
    names = ("Fr", "Ft") if radial else ("Fx", "Fy") if unit == "N" else ("x", "y")
    poses = len(result.status)
    frame = draw_loci(
        finest,
        ax,
        loci,
        abscissa_of(finest),
        scale,
        (f"{names[0]} [{scale.unit}]", f"{names[1]} [{scale.unit}]"),
        title=str(result.title or result.problem),
        subtitle=f"{result.problem}  ·  {result.task}  ·  {poses} poses  ·  {axes}",
        ticks=True,
        origin=True,
        peaks=True,
    )
    panel = frame.panels[0]
    panel.grid(False)
    largest = max(
        (float(np.nanmax(np.hypot(*locus.values.T), initial=0.0)) for locus in loci), default=0.0
    )
    radii = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, float(scale(largest)))
    for radius in radii[1:]:
        panel.add_patch(
            Circle(
                (0.0, 0.0),
                float(radius),
                facecolor="none",
                edgecolor=style.GHOST,
                linewidth=0.7 * frame.k,
                zorder=1,
            )
        )
    return panel


def _largest(result: Any) -> list[str]:
    """Return the reaction of the pin with the largest force, else of the guide."""
    sizes = {
        name: float(np.nanmax(np.hypot(series.reaction[:, 0], series.reaction[:, 1]), initial=0.0))
        for name, series in result.joints.items()
        if "reaction" in series
    }
    guides = {name for name in sizes if "normal" in result.joints[name]}
    sizes = {name: own for name, own in sizes.items() if name not in guides} or sizes
    return [f"joints/{max(sizes, key=lambda name: sizes[name])}/reaction"] if sizes else []
