"""Pictures of results; matplotlib is imported when the first one is drawn."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mechdae.draw.options import DESIGNS, checked
from mechdae.errors import InputError, UnavailableError, UnknownName

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mechdae.draw.animation import Animation

KINDS = {
    "diagram": "mechdae.draw.diagram.diagram",
    "animation": "mechdae.draw.animation",
    "plans": "mechdae.draw.plans",
    "curves": "mechdae.draw.graphs.curves",
    "coupler": "mechdae.draw.graphs.coupler",
    "losses": "mechdae.draw.graphs.losses",
    "map": "mechdae.draw.graphs.map",
    "design": "mechdae.draw.designs.design",
    "compare": "mechdae.draw.designs.compare",
    "convergence": "mechdae.draw.designs.convergence",
    "census": "mechdae.draw.designs.census",
}
"""Kind of picture -> module whose ``draw(result, ax, **options)`` makes it."""
LATER = ("page",)
SHARED = ("diagram", "curves", "coupler")
"""Kinds of pictures of which several, of variants, can share axes."""
OF_SYNTHESES = DESIGNS
"""Kinds of pictures of a synthesis; others have poses."""


def plot(result: Any, kind: str | None = None, ax: Axes | None = None, **options: Any) -> Any:
    """Draw a result.

    Parameters
    ----------
    result
        What `mechdae.solve` returned.
    kind
        ``"diagram"``: the kinematic diagram of one pose, see `mechdae.draw.diagram.diagram.draw`;
        ``"animation"``: it moves, see `mechdae.draw.animation.animate`;
        ``"plans"``: velocities, accelerations and forces of one pose as vector polygons, see
        `mechdae.draw.plans.draw`; ``"curves"``: series against the driver or time, see
        `mechdae.draw.graphs.curves.draw`; ``"coupler"``: paths of points and hodographs;
        ``"losses"``: losses by joint; ``"map"``: a study over its parameters. Of a synthesis
        ``"design"``: a design with its targets, see `mechdae.draw.designs.design.draw`;
        ``"compare"``: all designs; ``"convergence"``: the starts; ``"census"``: the optima.
        Without it the diagram; of a study the map; of a synthesis the best design, of one without
        designs the census.
    ax
        Axes to draw in; without it a new figure is made. No window is opened. On axes that
        hold a diagram, curves or paths of points already, one more of that kind is drawn as a
        variant: each in its colour, to one scale, with their names (``label``) below the title.
    **options
        Options of that kind of picture, see `mechdae.draw.options`; the command line has the
        same ones under the same names.

    Returns
    -------
    matplotlib.axes.Axes
        For an animation an `mechdae.draw.animation.Animation`.

    Raises
    ------
    UnavailableError
        A kind that this version does not draw.
    UnknownName
        Not a kind of picture, or no option of one.
    InputError
        A kind that does not suit the result, an option that does not suit the kind.
    """
    synthesis = getattr(result, "kind", "") == "synthesis"
    if kind is None:
        kind = usual(result)
    if kind in LATER:
        raise UnavailableError(f"pictures of kind '{kind}' are not drawn by this version")
    if kind not in KINDS:
        raise UnknownName("kind of picture", str(kind), [*KINDS, *LATER])
    if synthesis and kind not in OF_SYNTHESES:
        raise InputError(
            f"a synthesis has designs, no poses to draw as '{kind}'",
            hint=f"{', '.join(OF_SYNTHESES)}; or solve the problem of a design and draw that",
        )
    given = checked(kind, options)
    module = importlib.import_module(KINDS[kind])
    if ax is None or kind == "animation":
        drawn = module.draw(result, ax, **given)
        if kind in SHARED:
            _variants().remember(drawn, kind, result, given, None)
        return drawn
    variants = _variants()
    shared = variants.on_axes(ax, kind)
    if shared is not None:
        return variants.add(ax, shared, result, given)
    before = variants.before(ax)
    drawn = module.draw(result, ax, **given)
    variants.remember(ax, kind, result, given, before)
    return drawn


def _variants() -> Any:
    return importlib.import_module("mechdae.draw.variants")


def usual(result: Any) -> str:
    """Return the kind of picture that is drawn of a result if none is asked for."""
    kind = getattr(result, "kind", "")
    if kind == "synthesis":
        return "design" if result.data["designs"] else "census"
    return "map" if kind == "study" else "diagram"


def save(picture: Axes | Figure | Animation, path: str | Path) -> Path:
    """Write a picture to a file, see `mechdae.draw.figure.save`; an animation as a GIF."""
    from mechdae.draw import figure

    moving: Any = picture
    written: Path = moving.save(path) if hasattr(picture, "gif") else figure.save(moving, path)
    return written


__all__ = ["KINDS", "LATER", "OF_SYNTHESES", "plot", "save", "usual"]
