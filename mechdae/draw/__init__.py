"""Pictures of results; matplotlib is imported when the first one is drawn."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mechdae.errors import UnavailableError, UnknownName

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KINDS = {
    "diagram": "mechdae.draw.diagram",
    "plans": "mechdae.draw.plans",
    "curves": "mechdae.draw.graphs.curves",
    "coupler": "mechdae.draw.graphs.coupler",
    "losses": "mechdae.draw.graphs.losses",
    "map": "mechdae.draw.graphs.map",
}
"""Kind of picture -> module whose ``draw(result, ax, **options)`` makes it."""
LATER = ("animation", "page")


def plot(result: Any, kind: str = "diagram", ax: Axes | None = None, **options: Any) -> Axes:
    """Draw a result.

    Parameters
    ----------
    result
        What `mechdae.solve` returned.
    kind
        ``"diagram"``: the kinematic diagram of one pose, see `mechdae.draw.diagram.draw`;
        ``"plans"``: velocities, accelerations and forces of one pose as vector polygons, see
        `mechdae.draw.plans.draw`; ``"curves"``: series against the driver or time, see
        `mechdae.draw.graphs.curves.draw`; ``"coupler"``: paths of points and hodographs;
        ``"losses"``: losses by joint; ``"map"``: a study over its parameters.
    ax
        Axes to draw in; without it a new figure is made. No window is opened.
    **options
        Options of that kind of picture.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    UnavailableError
        A kind that this version does not draw.
    UnknownName
        Not a kind of picture.
    """
    if kind in LATER:
        raise UnavailableError(f"pictures of kind '{kind}' are not drawn by this version")
    if kind not in KINDS:
        raise UnknownName("kind of picture", str(kind), [*KINDS, *LATER])
    axes: Axes = importlib.import_module(KINDS[kind]).draw(result, ax, **options)
    return axes


def save(picture: Axes | Figure, path: str | Path) -> Path:
    """Write a picture to a file, see `mechdae.draw.figure.save`."""
    from mechdae.draw import figure

    return figure.save(picture, path)


__all__ = ["KINDS", "LATER", "plot", "save"]
