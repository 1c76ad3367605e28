"""Pictures of plans: one of them, or all of a pose on one page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox, BboxTransformTo

from mechdae.draw import style
from mechdae.draw.diagram import apart
from mechdae.draw.diagram.diagram import View
from mechdae.draw.diagram.heads import write_heads
from mechdae.draw.diagram.scene import DrawnScene, choose_pose, read_scene
from mechdae.draw.figure import current_format, figure_of, new_axes, new_figure, note
from mechdae.draw.fonts import font, ink
from mechdae.draw.plans.board import Plan, draw_plan, heading, round_up, scale_text
from mechdae.draw.plans.forces import force_plans
from mechdae.draw.plans.lever import (
    draw_lever,
    draw_lines,
    draw_pin,
    force_scale_of,
    lever,
    pins_of,
)
from mechdae.draw.plans.relations import SYMBOLS, groups_of, motion_plan, named_group
from mechdae.draw.poses import seen
from mechdae.draw.sheet import MILLIMETRE, Sheet
from mechdae.draw.translated import translated
from mechdae.draw.words import ENGLISH
from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.results import SweepResult


KINDS = ("velocity", "acceleration", "force", "friction", "lever")
PAPER = (297.0, 210.0)
"""Page of several plans [mm]: A4, on its side."""
NARROWEST = 0.6
"""Least width of a page, over that."""
SIZE, LINE = 9.5, 13.5
"""Size of the letters of relations and distance of their lines [pt]."""
MOST = 8
"""More relations than so many lines are left out."""
EQUATIONS = 20
"""And more of them than so many."""
FORCES = 6
"""Force polygons on a page with the other plans, those of the last groups."""
CLOSE = 0.9
"""A diagram may reach into its margin by so much for a larger scale."""


def draw(
    result: SweepResult,
    ax: Axes | None = None,
    *,
    pose: int | None = None,
    which: str | None = None,
    group: str | None = None,
    scale: float | Mapping[str, float] | None = None,
    lang: str = "en",
) -> Axes:
    """Draw plans of one pose to scale, with the options of the catalogue.

    Axes are in their final size, which the scale refers to; new ones for several plans are a page
    of A4. Without ``which`` it holds the diagram, the plans and, of a task of kind reactions, the
    force polygons of the last six groups, with a ``group`` that group drawn apart. ``scale`` is in
    m/s, m/s2 or N, for a page by name: ``{"velocity": 0.02}``; by default 1, 2, 5 times a power of
    ten at which the plan fits.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the plan, or those that hold the axes of the page.

    Raises
    ------
    InputError
        A pose without rates or forces, or a result that has none.
    UnknownName
        Not a kind of plan, or not a group.
    """
    _check(result, which, group)
    scene = read_scene(result)
    page = PlanPage(result, scene, _pose(result, scene, pose, which), _scales(scale, which))
    if which == "friction":
        return translated(page.friction(ax), lang)
    if which == "lever":
        levered = lever(result, scene, page.pose)
        return translated(page.alone(ax, draw_lever, levered, "lever"), lang)
    names = [name for name, _ in groups_of(result, scene)]
    name = None if group is None else named_group(names, group)
    words = SYMBOLS if which is None else [which] if which != "force" else []
    plans = [motion_plan(result, scene, page.pose, word, name) for word in words]
    if which == "force" or (which is None and result.efforts):
        forces = force_plans(result, scene, page.pose)
        wanted = [plan for plan in forces if name in (None, *(key for key, _ in plan.relations))]
        plans += wanted if which == "force" else wanted[:FORCES]
    if not plans:
        raise InputError(
            f"no force acts on {name or 'the groups'} in pose {page.pose}",
            hint="another pose or group",
        )
    if which is not None and len(plans) == 1:
        return translated(page.alone(ax, draw_plan, plans[0], _key(plans[0])), lang)
    return translated(page.draw(ax, plans, name, whole=which is None), lang)


def _check(result: SweepResult, which: str | None, group: str | None) -> None:
    """Refuse plans that there are not, and those of forces where there are none."""
    if which is not None and which not in KINDS:
        raise UnknownName("kind of plan", str(which), KINDS)
    if which in ("force", "friction", "lever") and not result.efforts:
        raise InputError(
            f"a result of kind {result.kind} has no forces to draw",
            hint="solve a task of kind reactions",
        )
    if group is not None and which in ("friction", "lever"):
        raise InputError(f"{which} is drawn of the whole mechanism", where="group")


def _scales(scale: float | Mapping[str, float] | None, which: str | None) -> Mapping[str, float]:
    """Return the wished scales by the word of their plan."""
    if scale is None:
        return {}
    if isinstance(scale, Mapping):
        words = ("velocity", "acceleration", "force", "lever")
        for word in scale:
            if word not in words:
                raise UnknownName("plan", str(word), words)
        scales = dict(scale)
    elif which is None or which == "friction":
        raise InputError("several plans have several scales", hint='scale={"velocity": 0.02}')
    else:
        scales = {which: float(scale)}
    for word, number in scales.items():
        if not 0 < number < float("inf"):
            raise InputError(f"the scale of the {word} plan is {number}", hint="a number above 0")
    return scales


def _pose(result: SweepResult, scene: DrawnScene, pose: int | None, which: str | None) -> int:
    """Return the pose to draw: it has the rates, and for forces the efforts."""
    order = 1 if which == "velocity" else 2
    names = ("velocity", "acceleration")[:order]
    tables = [series[name] for series in result.points.values() for name in names if name in series]
    if not tables or any(name not in series for series in result.points.values() for name in names):
        raise InputError(
            f"the result has no {names[-1]} of points",
            hint=f"derivatives = {order} in the task, and bodies among its outputs",
        )
    known = np.all([np.isfinite(table).all(axis=1) for table in tables], axis=0)
    if result.kind == "reactions" and which not in ("velocity", "acceleration"):
        known &= np.all([np.isfinite(effort) for effort in result.efforts.values()], axis=0)
    index = choose_pose(scene, result.kind, pose)
    if known[index]:
        return index
    rows = np.flatnonzero(known)
    if pose is not None or not rows.size:
        what = "rates" if result.kind == "sweep" else "rates or no forces"
        raise InputError(
            f"pose {index} has no {what}: it is {scene.status[index]}",
            hint=f"pose {rows[np.argmin(np.abs(rows - index))]} has" if rows.size else "",
        )
    return int(rows[np.argmin(np.abs(rows - index))])


def _key(plan: Plan) -> str:
    """Return the name under which a plan's scale is given."""
    return "force" if plan.word.startswith("force-") else plan.word


# -- pages -------------------------------------------------------------------------------------


def _paper() -> Axes:
    """Return empty axes below the title strip of a page."""
    sheet = current_format()
    share = 1.0 if sheet.width is None else 72 * sheet.width / (PAPER[0] * MILLIMETRE)
    if share < NARROWEST:
        raise InputError(
            f"a page of plans is {NARROWEST * PAPER[0]:.0f} mm wide at least", where="width",
            hint="which = \"velocity\", ... (--which) draws one plan",
        )  # fmt: skip
    width, height = (share * side * MILLIMETRE for side in PAPER)
    figure = new_figure(width / 72, height / 72)
    edge, top = 2 * style.EDGE, sheet.top + style.EDGE
    return figure.add_axes(
        (edge / width, edge / height, 1 - 2 * edge / width, 1 - (edge + top) / height)
    )


@dataclass(frozen=True)
class PlanPage:
    """What is drawn of one pose, with the scales wished for by the word of their plan."""

    result: SweepResult
    scene: DrawnScene
    pose: int
    scales: Mapping[str, float]

    def _heads(self, sheet: Sheet) -> None:
        write_heads(sheet, self.scene, self.result, self.pose, ENGLISH)

    def alone(self, ax: Axes | None, draw: Callable[..., Sheet], plan: object, word: str) -> Axes:
        """Draw one plan by its function."""
        axes = new_axes() if ax is None else ax
        self._heads(draw(axes, plan, self.scales.get(word)))
        return axes

    def _outer(self, ax: Axes | None, relations: Sequence[Rows] = ()) -> tuple[Axes, float]:
        """Return the axes that hold a page, with its texts, and what relations take up of it."""
        axes = _paper() if ax is None else ax
        sheet = Sheet(axes, (0.0, 0.0), (1.0, 1.0))
        sheet.k = min(sheet.k, 1.0)
        self._heads(sheet)
        width, height = np.array(axes.get_window_extent().size) * 72 / figure_of(axes).dpi
        columns = [_lines(rows, 0.96 * width / len(relations)) for rows in relations]
        columns = [lines if len(lines) <= MOST else [] for lines in columns]
        deepest = max(map(len, columns), default=0)
        for j, lines in enumerate(columns):
            for k, line in enumerate(lines):
                spot, offset = (j / len(columns), 0.0), (4.0, 2.0 + LINE * (deepest - 1 - k))
                more = {"xycoords": "axes fraction", "gid": f"relation-{j}-{k}"}
                note(axes, line, spot, offset, font(SIZE), style.INK, **more)
        return axes, (LINE * deepest + 8.0) / height if deepest else 0.0

    def draw(self, ax: Axes | None, plans: Sequence[Plan], group: str | None, whole: bool) -> Axes:
        """Draw plans side by side, with the diagram, or a group apart, if the page is whole."""
        axes, low = self._outer(ax, _relations(plans))
        count = len(plans) + whole
        if whole and count == 3:  # a large one and two beside it
            middle = (1 + low) / 2
            places = [(0.0, low, 0.49), (0.51, middle, 1.0), (0.51, low, 1.0)]
            tops = 1.0, 1.0, middle - 0.01
            panels = [_panel(axes, *place, top) for place, top in zip(places, tops, strict=True)]
        else:
            panels = _cells(axes, count, int(np.ceil(np.sqrt(count))), low=low)
        if whole:
            self._diagram(panels[0], group)
        for panel, plan in zip(panels[whole:], plans, strict=True):
            draw_plan(panel, plan, self.scales.get(_key(plan)))
        return axes

    def _diagram(
        self, panel: Axes, group: str | None, overlay: Callable[[Sheet], str] | None = None
    ) -> None:
        """Draw the diagram, or a group of it apart, to a round scale and state it."""

        def rounded(natural: float) -> float:
            return round_up(CLOSE * natural)

        if group is None:
            shown = seen(self.result, self.pose)
            bounds = shown.bounds([self.pose], False)
            view = replace(shown.view, traces=False, bounds=bounds, scale=rounded, overlay=overlay)
            sheet = shown.draw(panel, view, style.LIGHT, ENGLISH)
        else:
            given = self.scene, self.result, self.pose
            pieces = apart.pieces_of(self.result, self.scene, self.pose, group, ENGLISH)
            view = View(traces=False, loads=False, scale=rounded)
            sheet = apart.draw_pieces(panel, *given, pieces, view, style.LIGHT, ENGLISH)
        for artist in list(panel.texts):
            if str(artist.get_gid()).startswith(("title", "subtitle")):
                artist.remove()
        heading(sheet, f"Diagram,  {scale_text('l', sheet.scale, 'm')}", "diagram-scale")

    def friction(self, ax: Axes | None) -> Axes:
        """Draw the diagram with its friction circles, and each pin enlarged."""
        pins = pins_of(self.result, self.scene, self.pose)
        if getattr(self.result.definition, "friction", "coupled") != "coupled" or not pins:
            raise InputError(
                "no reaction of a pin with friction to draw",
                hint='friction = "coupled" in the task, '
                "friction and pin_radius in a revolute joint",
            )
        axes, _ = self._outer(ax)
        columns, share = (1, 0.62) if len(pins) < 3 else (2, 0.5)
        whole = _panel(axes, 0.0, 0.0, share, 1.0)
        self._diagram(whole, None, lambda sheet: draw_lines(sheet, pins))
        panels = _cells(axes, len(pins), columns, share + 0.01)
        forces = force_scale_of(panels, pins)
        for panel, pin in zip(panels, pins, strict=True):
            draw_pin(panel, pin, forces)
        return axes


def _panel(axes: Axes, left: float, low: float, right: float, high: float) -> Axes:
    """Return axes in a part of others, in shares of their width and height."""
    part = Bbox.from_extents(left, low, right, high)
    place = part.transformed(BboxTransformTo(axes.get_position()))
    return figure_of(axes).add_axes(place.bounds)


def _cells(axes: Axes, count: int, columns: int, left: float = 0.0, low: float = 0.0) -> list[Axes]:
    """Return panels of one size in rows, in the part of axes to the right of and above a place."""
    wide, tall = (1 - left) / columns, (1 - low) / -(-count // columns)
    places = [(left + k % columns * wide, 1 - (k // columns + 1) * tall) for k in range(count)]
    return [_panel(axes, x, y, x + wide - 0.01, y + tall - 0.01) for x, y in places]


Rows = Sequence[tuple[str, tuple[str, ...]]]
"""Names of groups with their vector equations."""


def _relations(plans: Sequence[Plan]) -> list[Rows]:
    """Return the vector equations by kind of plan: groups with their equations."""
    columns: dict[str, Rows] = {}
    for plan in plans:
        columns[_key(plan)] = (*columns.get(_key(plan), ()), *plan.relations)
    return [rows for rows in columns.values() if rows]


def _lines(rows: Rows, room: float) -> list[str]:
    """Return equations as lines of mathtext no wider than the room [pt], as far as possible."""
    if sum(len(texts) for _, texts in rows) > EQUATIONS:
        return []
    lines: list[str] = []
    chosen = font(SIZE)
    for group, texts in rows:
        line, width = (f"{group}:   ", 6.0 * len(group)) if group else ("", 0.0)
        for k, text in enumerate(texts):
            wide = float(ink(f"${text}$", chosen)[1][0]) + 12.0
            if k and width + wide > room:
                lines.append(f"{line},")
                line, width = f"        ${text}$", 20.0 + wide
            else:
                line, width = f"{line},   ${text}$" if k else f"{line}${text}$", width + wide
        lines.append(line)
    return lines
