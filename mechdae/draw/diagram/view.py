"""What a diagram shows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.draw import style
from mechdae.draw.labels.steady import SteadyLabels
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet
from mechdae.records import dataclass


@dataclass(frozen=True)
class View:
    """What a diagram shows, and what the diagrams of one motion have in common.

    Parameters
    ----------
    bounds
        Corners [m] and size of what is in the picture; without it those of the pose.
    peak
        The force that has the longest arrow [N]; without it the largest of the pose.
    memory, scale, larger, margins
        See `Sheet`.
    subtitle
        In place of driver value, task and pose.
    label
        Name of the variant, behind these.
    behind
        Sheets of other variants on the same axes, whose lines labels keep off.
    bare
        Without titles, scale bar and note: another variant has them.
    legend
        Names and colours of variants, in place of the subtitle.
    paper
        Colours of titles, where links have that of their variant.
    overlay
        Draws more between links and labels, and returns what is to be noted below.
    steady
        Labels of a motion, in place of those whose places are chosen in the pose.
    drivers
        Those that are drawn, by default all.
    angles
        Which have an arc.
    """

    traces: bool = True
    ghosts: int | Sequence[int] = 0
    labels: bool = True
    loads: bool = True
    bounds: tuple[Array, Array, float] | None = None
    peak: float | None = None
    memory: dict[str, Array] | None = None
    scale: float | Callable[[float], float] | None = None
    larger: tuple[float, float] = style.USUAL
    margins: style.Margins = style.MARGINS
    subtitle: str = ""
    label: str = ""
    behind: tuple[Sheet, ...] = ()
    bare: bool = False
    legend: tuple[tuple[str, str], ...] = ()
    paper: style.Theme | None = None
    overlay: Callable[[Sheet], str] | None = None
    steady: SteadyLabels | None = None
    drivers: Sequence[NamedCoordinate] | None = None
    angles: Sequence[str] = ()
