"""Pictures of plans: one of them, or all of a pose on one page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mechdae.draw import poses, style
from mechdae.draw.diagram import apart
from mechdae.draw.diagram.heads import write_heads
from mechdae.draw.diagram.scene import DrawnScene, choose_pose, read_scene
from mechdae.draw.figure import Drawing, current_format, new_axes, note
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
from mechdae.draw.sheet import MILLIMETRE, Sheet
from mechdae.draw.translated import translated
from mechdae.draw.words import ENGLISH
from mechdae.errors import InputError, UnknownName

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
    return translated(_drawn(result, ax, pose, which, group, scale), lang)


def _drawn(
    result: SweepResult,
    ax: Axes | None,
    pose: int | None,
    which: str | None,
    group: str | None,
    scale: float | Mapping[str, float] | None,
) -> Axes:
    _check(result, which, group)
    scene = read_scene(result)
    index = _pose(result, scene, pose, which)
    scales = _scales(scale, which)
    if which == "friction":
        return _friction(result, scene, index, ax)
    if which == "lever":
        axes = new_axes() if ax is None else ax
        sheet = draw_lever(axes, lever(result, scene, index), scales.get("lever"))
        write_heads(sheet, scene, result, index, ENGLISH)
        return axes
    names = [name for name, _ in groups_of(result, scene)]
    name = None if group is None else named_group(names, group)
    plans = []
    if which != "force":
        words = SYMBOLS if which is None else (which,)
        plans = [motion_plan(result, scene, index, word, name) for word in words]
    if which == "force" or (which is None and result.efforts):
        forces = force_plans(result, scene, index)
        forces = [
            plan for plan in forces if name in (None, *(entry for entry, _ in plan.relations))
        ]
        plans += forces if which == "force" else forces[:FORCES]
    if not plans:
        raise InputError(
            f"no force acts on {name or 'the groups'} in pose {index}", hint="another pose or group"
        )
    if which is not None and len(plans) == 1:
        return _single(result, scene, index, ax, plans[0], scales)
    return _page(result, scene, index, ax, plans, scales, name, whole=which is None)


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


def _single(
    result: SweepResult,
    scene: DrawnScene,
    pose: int,
    ax: Axes | None,
    plan: Plan,
    scales: Mapping[str, float],
) -> Axes:
    axes = new_axes() if ax is None else ax
    sheet = draw_plan(axes, plan, scales.get(_key(plan)))
    write_heads(sheet, scene, result, pose, ENGLISH)
    return axes


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
    figure = Drawing(figsize=(width / 72, height / 72), dpi=sheet.dpi, facecolor=style.PAPER)
    FigureCanvasAgg(figure)
    edge, top = 2 * style.EDGE, sheet.top + style.EDGE
    return figure.add_axes(
        (edge / width, edge / height, 1 - 2 * edge / width, 1 - (edge + top) / height)
    )


def _outer(
    result: SweepResult,
    scene: DrawnScene,
    pose: int,
    ax: Axes | None,
    relations: Sequence[Sequence[tuple[str, tuple[str, ...]]]] = (),
) -> tuple[Axes, float]:
    """Return the axes that hold a page, titles and relations written, and what those take up."""
    axes = _paper() if ax is None else ax
    sheet = Sheet(axes, (0.0, 0.0), (1.0, 1.0))
    sheet.k = min(sheet.k, 1.0)
    write_heads(sheet, scene, result, pose, ENGLISH)
    box = axes.get_window_extent()
    width, height = box.width * 72 / _figure(axes).dpi, box.height * 72 / _figure(axes).dpi
    columns = [_lines(rows, 0.96 * width / len(relations)) for rows in relations]
    columns = [lines if len(lines) <= MOST else [] for lines in columns]
    deepest = max(map(len, columns), default=0)
    for j, lines in enumerate(columns):
        for k, line in enumerate(lines):
            spot, offset = (j / len(columns), 0.0), (4.0, 2.0 + LINE * (deepest - 1 - k))
            more = {"xycoords": "axes fraction", "gid": f"relation-{j}-{k}"}
            note(axes, line, spot, offset, font(SIZE), style.INK, **more)
    return axes, (LINE * deepest + 8.0) / height if deepest else 0.0


def _figure(axes: Axes) -> Figure:
    figure = axes.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def _panel(axes: Axes, left: float, low: float, right: float, high: float) -> Axes:
    """Return axes in a part of others, in shares of their width and height."""
    box = axes.get_position()
    return _figure(axes).add_axes(
        (
            box.x0 + left * box.width,
            box.y0 + low * box.height,
            (right - left) * box.width,
            (high - low) * box.height,
        )
    )


def _page(
    result: SweepResult,
    scene: DrawnScene,
    pose: int,
    ax: Axes | None,
    plans: Sequence[Plan],
    scales: Mapping[str, float],
    group: str | None = None,
    whole: bool = False,
) -> Axes:
    """Draw plans side by side, with the diagram, or a group apart, if the page is to be whole."""
    axes, low = _outer(result, scene, pose, ax, _relations(plans))
    panels = _grid(axes, low, len(plans) + whole, whole)
    if whole:
        _diagram(result, scene, pose, panels[0], group)
    for panel, plan in zip(panels[whole:], plans, strict=True):
        draw_plan(panel, plan, scales.get(_key(plan)))
    return axes


def _grid(axes: Axes, low: float, count: int, whole: bool) -> list[Axes]:
    """Return panels: a large one and two beside it, or rows of equal ones."""
    if whole and count == 3:
        middle = (1 + low) / 2
        return [
            _panel(axes, 0.0, low, 0.49, 1.0),
            _panel(axes, 0.51, middle, 1.0, 1.0),
            _panel(axes, 0.51, low, 1.0, middle - 0.01),
        ]
    return _cells(axes, count, int(np.ceil(np.sqrt(count))), low=low)


def _cells(axes: Axes, count: int, columns: int, left: float = 0.0, low: float = 0.0) -> list[Axes]:
    """Return panels of one size in rows, in the part of axes to the right of and above a place."""
    wide, tall = (1 - left) / columns, (1 - low) / -(-count // columns)
    places = [(left + k % columns * wide, 1 - (k // columns + 1) * tall) for k in range(count)]
    return [_panel(axes, x, y, x + wide - 0.01, y + tall - 0.01) for x, y in places]


def _diagram(
    result: SweepResult, scene: DrawnScene, pose: int, panel: Axes, group: str | None = None
) -> Sheet:
    """Draw the diagram, or a group of it apart, to a round scale and state it."""
    found: list[float] = []

    def rounded(natural: float) -> float:
        found.append(round_up(CLOSE * natural))
        return found[-1]

    if group is None:
        poses.draw(result, panel, pose=pose, traces=False, scale=rounded)
    else:
        apart.draw(result, panel, pose=pose, group=group, scale=rounded)
    for artist in list(panel.texts):
        if str(artist.get_gid()).startswith(("title", "subtitle")):
            artist.remove()
    limits = panel.get_xlim(), panel.get_ylim()
    scale = found[-1]
    sheet = Sheet(panel, (0.0, 0.0), (1.0, 1.0), scale)
    panel.set_xlim(limits[0])
    panel.set_ylim(limits[1])
    sheet.corner = np.array([limits[0][0], limits[1][0]])
    heading(sheet, f"Diagram,  {scale_text('l', scale, 'm')}", "diagram-scale")
    return sheet


def _relations(plans: Sequence[Plan]) -> list[list[tuple[str, tuple[str, ...]]]]:
    """Return the vector equations by kind of plan: groups with their equations."""
    columns: dict[str, list[tuple[str, tuple[str, ...]]]] = {}
    for plan in plans:
        columns.setdefault(_key(plan), []).extend(plan.relations)
    return [rows for rows in columns.values() if rows]


def _lines(rows: Sequence[tuple[str, tuple[str, ...]]], room: float) -> list[str]:
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


def _friction(result: SweepResult, scene: DrawnScene, pose: int, ax: Axes | None) -> Axes:
    pins = pins_of(result, scene, pose)
    if getattr(result.definition, "friction", "coupled") != "coupled" or not pins:
        raise InputError(
            "no reaction of a pin with friction to draw",
            hint='friction = "coupled" in the task, friction and pin_radius in a revolute joint',
        )
    axes, _ = _outer(result, scene, pose, ax)
    columns, share = (1, 0.62) if len(pins) < 3 else (2, 0.5)
    whole = _panel(axes, 0.0, 0.0, share, 1.0)
    _diagram(result, scene, pose, whole)
    draw_lines(whole, pins)
    panels = _cells(axes, len(pins), columns, share + 0.01)
    forces = force_scale_of(panels, pins)
    for panel, pin in zip(panels, pins, strict=True):
        draw_pin(panel, pin, forces)
    return axes
