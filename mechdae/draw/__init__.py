"""Pictures of results; matplotlib is imported when the first one is drawn."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mechdae.errors import UnavailableError, UnknownName

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mechdae.draw.animation import Animation

KINDS = {
    "diagram": "mechdae.draw.diagram",
    "animation": "mechdae.draw.animation",
    "plans": "mechdae.draw.plans",
    "curves": "mechdae.draw.graphs.curves",
    "coupler": "mechdae.draw.graphs.coupler",
    "losses": "mechdae.draw.graphs.losses",
    "map": "mechdae.draw.graphs.map",
}
"""Kind of picture -> module whose ``draw(result, ax, **options)`` makes it."""
LATER = ("page",)


def plot(result: Any, kind: str = "diagram", ax: Axes | None = None, **options: Any) -> Any:
    """Draw a result.

    Parameters
    ----------
    result
        What `mechdae.solve` returned.
    kind
        ``"diagram"``: the kinematic diagram of one pose, see `mechdae.draw.diagram.draw`;
        ``"animation"``: it moves, see `mechdae.draw.animation.animate`;
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
        For an animation an `mechdae.draw.animation.Animation`.

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
    return importlib.import_module(KINDS[kind]).draw(result, ax, **options)


def save(picture: Axes | Figure | Animation, path: str | Path) -> Path:
    """Write a picture to a file, see `mechdae.draw.figure.save`; an animation as a GIF."""
    from mechdae.draw import figure

    moving: Any = picture
    written: Path = moving.save(path) if hasattr(picture, "gif") else figure.save(moving, path)
    return written


__all__ = ["KINDS", "LATER", "plot", "save"]
