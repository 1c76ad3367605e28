"""Plans as data, and as drawn: arrows to a round scale, letters at their ends, the scale below."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels import layout
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import MILLIMETRE, LineLook, Sheet, unit
from mechdae.records import dataclass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {
    "total": style.INK,
    "relative": style.DRIVEN,
    "normal": style.WHEEL,
    "tangential": style.DRIVEN,
    "coriolis": style.ARROW,
    "sliding": "#aa4499",
    "reaction": style.INK,
    "load": style.ARROW,
    "drive": style.ARROW,
    "weight": style.WHEEL,
    "inertia": style.DRIVEN,
    "inner": style.FAINT,
}
"""Colour of each kind of vector; names say the same."""
WIDTH = 1.5
HEAD = (8.5, 2.7)
"""Length and half width of an arrow head."""
LETTER, NAME = 14.0, 12.0
SCALE = 11.0
NAMED = 30.0
"""Shorter arrows have no name of their own; the letters at their ends remain."""
LOOKED_FOR = ("coriolis", "normal")
"""Kinds that are named down to half of an arrow's head."""
POLE = 2.6
ROOM = 24.0
"""Room around a plan for its letters."""
AIR = 2.0
FAR = 10.0
"""A letter farther than this from its end gets a thin line to it."""


def draw_plan(ax: Axes, plan: Plan, scale: float | None = None) -> Sheet:
    """Draw a plan and return the sheet it is on.

    Parameters
    ----------
    ax
        Axes in their final size.
    plan
        What is drawn.
    scale
        Unit of the plan per millimetre; by default the smallest of 1, 2, 5 times a power of ten at
        which the plan fits.
    """
    low, high = plan.corners.min(axis=0), plan.corners.max(axis=0)
    if scale is None:
        scale = round_up(smallest(ax, low, high)) if plan.size > 0 else 1.0
    sheet = Sheet(ax, low, high, scale)
    draw_vectors(sheet, plan)
    _frame(sheet, plan, scale)
    write(sheet, plan.ends, plan.arrows)
    return sheet


def draw_vectors(sheet: Sheet, plan: Plan) -> None:
    """Draw the images of links, the arrows and the pole of a plan."""
    for k, (start, end) in enumerate(plan.sides):
        look: LineLook = {"color": style.FAINT, "width": style.THIN, "dash": style.DASHED}
        look |= {"z": style.Z_TRACE, "gid": f"{plan.word}-image-{k}"}
        sheet.line(sheet.at([start, end]), weight=style.RING, **look)
    for arrow in plan.arrows:
        draw_arrow(sheet, arrow)
    for mark in [end for end in plan.ends if end.gid.endswith("-pole")]:
        sheet.circle(sheet.at(mark.place), POLE, fill=style.PAPER, z=style.Z_PIN, gid=mark.gid)


def smallest(ax: Axes, low: Array, high: Array) -> float:
    """Return the least scale, per millimetre of paper, at which a box fits the axes."""
    sheet = Sheet(ax, low, high)
    room = sheet.size - 2 * ROOM - (0.0, style.STRIP)
    spans = (high - low) / np.maximum(room, 40.0)
    return float(spans.max()) * MILLIMETRE / sheet.k


def draw_arrow(sheet: Sheet, arrow: Arrow) -> None:
    """Draw an arrow from place to place; its line ends at the tip of the head."""
    start, end = sheet.at(arrow.start), sheet.at(arrow.end)
    color = COLORS[arrow.kind]
    width = WIDTH if arrow.kind in ("total", "reaction", "load", "drive") else style.LINE
    dash = style.DASHED if arrow.kind == "inner" else None
    sheet.line([start, end], color=color, width=width, dash=dash, gid=arrow.gid)
    size = min(1.0, float(np.hypot(*(end - start))) / (1.6 * HEAD[0]))
    symbols.tip(sheet, start, end, color, size=(HEAD[0] * size, HEAD[1] * size))


def write(
    sheet: Sheet, ends: Sequence[End], arrows: Sequence[Arrow], tipped: Sequence[Arrow] = ()
) -> None:
    """Place and write the letters at ends and the names of arrows, of some at their tips."""
    rows: list[tuple[str, str, layout.Label, float, str]] = []

    def put(
        text: str, gid: str, size: float, color: str,
        label_of: Callable[[float, float], layout.Label],
    ) -> None:  # fmt: skip
        low, high = ink(f"${text}$", font(size))
        width, height = (high - low + 2 * AIR).tolist()
        rows.append((f"${text}$", gid, label_of(width, height), size, color))

    for end in ends:
        size = NAME if end.gid.endswith(("-normal-end", "-coriolis-end")) else LETTER
        at, away = sheet.at(end.place), _away(end, arrows, sheet)
        beside = partial(layout.around, at, gap=2.5, away=away)
        put(end.text, f"{end.gid}-letter", size, style.INK, beside)
    for arrow in [arrow for arrow in (*arrows, *tipped) if arrow.text]:
        start, tip = sheet.at(arrow.start), sheet.at(arrow.end)
        beside = partial(layout.around, tip, gap=1.0, away=unit(tip - start))
        if arrow not in tipped:
            least = 0.5 * HEAD[0] if arrow.kind in LOOKED_FOR else NAMED
            if float(np.hypot(*(tip - start))) < least:
                continue
            beside = partial(_along, start, tip)
        put(arrow.text, f"{arrow.gid}-name", NAME, COLORS[arrow.kind], beside)
    if not rows:
        return
    spots = layout.place([row[2] for row in rows], sheet.segments, sheet.boxes, sheet.size)
    for (text, gid, _, size, color), spot in zip(rows, spots, strict=True):
        sheet.text(spot, text, font(size), color, gid)
    for end, (_, _, label, _, _), spot in zip(ends, rows, spots, strict=False):
        _lead(sheet, sheet.at(end.place), spot, np.array([label.width, label.height]) / 2 - AIR)


def _along(start: Array, tip: Array, width: float, height: float) -> layout.Label:
    segment = np.array([[*start, *tip, style.SOLID]])
    return replace(layout.along([(start, tip)], width, height, 1.0), own=segment, rank=1)


def _lead(sheet: Sheet, end: Array, spot: Array, half: Array) -> None:
    """Draw a thin line from an end to its letter if that is not beside it."""
    edge = np.clip(end, spot - half, spot + half)
    gap = end - edge
    if float(np.hypot(*gap)) > FAR:
        ends = [edge + 0.15 * gap, end - 0.1 * gap]
        sheet.line(ends, color=style.FAINT, width=0.6 * style.THIN, weight=0)


def _away(end: End, arrows: Sequence[Arrow], sheet: Sheet) -> Array:
    """Return the direction away from the arrows at an end."""
    arms = np.zeros(2)
    for arrow in arrows:
        for here, there in ((arrow.start, arrow.end), (arrow.end, arrow.start)):
            if np.array_equal(here, end.place):
                arms = arms + unit(there - here)
    if np.any(end.place):
        arms = arms - unit(end.place)
    away = -unit(arms)
    return away if np.any(away) else np.array([-0.7, -0.7])


def scale_text(symbol: str, scale: float, unit_text: str) -> str:
    """Return the statement of a scale: ``mu_v = 0.02 (m/s)/mm``."""
    wrapped = f"({unit_text})" if "/" in unit_text else unit_text
    return rf"$\mu_{symbol}$ = {scale:g} {wrapped}/mm"


def _frame(sheet: Sheet, plan: Plan, scale: float) -> None:
    """Write the title above, the scale and a note on what is wrong below."""
    text = scale_text(plan.symbol, scale, plan.unit)
    if plan.size == 0:
        text = plan.note or "all vectors are zero"
    caption(sheet, text, f"{plan.word}-scale")
    heading(sheet, plan.title, f"{plan.word}-title")
    if not plan.closed:
        note = f"open by {plan.gap:.1e} {plan.unit}"
        write_line(sheet, note, f"{plan.word}-gap", 10.0, style.ARROW, right=True)


def caption(sheet: Sheet, text: str, gid: str) -> None:
    """Write a line at the lower left."""
    write_line(sheet, text, gid, 10.0, style.INK)


def heading(sheet: Sheet, text: str, gid: str) -> None:
    """Write a line at the upper left, inside the axes."""
    write_line(sheet, text, gid, float(sheet.size[1]) - 10.0, style.FAINT)


def write_line(
    sheet: Sheet, text: str, gid: str, y: float, color: str, right: bool = False,
    families: Sequence[str] = style.NOTE_FONT,
) -> None:  # fmt: skip
    """Write a line at the left or right border, and keep letters off it."""
    chosen = font(SCALE, families)
    low, high = ink(text, chosen)
    half = float((high - low)[0]) / 2
    x = float(sheet.size[0]) - 4.0 - half if right else 4.0 + half
    sheet.text(np.array([x, y]), text, chosen, color, gid)
    sheet.box((x - half - 4.0, y - 8.0), (x + half + 4.0, y + 8.0))


STEPS = (1, 1.5, 2, 2.5, 4, 5)
"""Scales of plans."""
CLOSED = 1e-9
"""Share of its size by which a plan may stay open before the picture says so."""


@dataclass(frozen=True)
class Arrow:
    """A vector of a plan, in the unit of the plan.

    Parameters
    ----------
    gid
        Its identifier in the SVG.
    kind
        total, relative, normal, tangential, coriolis, sliding, reaction, load, weight,
        inertia or inner.
    start, end
        From the pole.
    text
        Its name in mathtext, without the dollar signs; empty where letters say enough.
    """

    gid: str
    kind: str
    start: Array
    end: Array
    text: str = ""

    @property
    def vector(self) -> Array:
        """From start to end."""
        return self.end - self.start

    @property
    def length(self) -> float:
        return float(np.hypot(*self.vector))

    @property
    def moment(self) -> float:
        """About the pole."""
        return float(self.start[0] * self.vector[1] - self.start[1] * self.vector[0])


@dataclass(frozen=True)
class End:
    """A lettered place of a plan; ``text`` is mathtext without the dollar signs."""

    gid: str
    text: str
    place: Array


@dataclass(frozen=True)
class Plan:
    """A vector polygon or several that share a pole.

    Parameters
    ----------
    word
        velocity, acceleration, or force and the number of the group.
    title
        What stands above it.
    symbol, unit
        Of the scale.
    sides
        Lines between ends of one body: the image of the link.
    relations
        By Assur group: the vector equations drawn, in mathtext.
    gap
        Largest distance between the end of a chain and the place where it belongs.
    note
        Why there is nothing to draw.
    """

    word: str
    title: str
    symbol: str
    unit: str
    arrows: tuple[Arrow, ...] = ()
    ends: tuple[End, ...] = ()
    sides: tuple[tuple[Array, Array], ...] = ()
    relations: tuple[tuple[str, tuple[str, ...]], ...] = ()
    gap: float = 0.0
    note: str = ""

    @property
    def size(self) -> float:
        """Length of the longest vector."""
        return max((arrow.length for arrow in self.arrows), default=0.0)

    @property
    def corners(self) -> Array:
        """Starts and ends of all arrows, the pole before them."""
        return np.array(
            [np.zeros(2), *(p for arrow in self.arrows for p in (arrow.start, arrow.end))]
        )

    @property
    def closed(self) -> bool:
        return self.gap <= CLOSED * self.size


def round_up(number: float) -> float:
    """Return the least of `STEPS` times a power of ten that is not below the number."""
    power = int(np.floor(np.log10(number)))
    rounds = (float(f"{step}e{k}") for k in (power - 1, power, power + 1) for step in STEPS)
    return next(each for each in rounds if each >= number * (1 - 1e-12))
