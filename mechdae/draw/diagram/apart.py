"""The Assur groups of a mechanism drawn apart, in the order of their computation, to one scale.

Each group has its outer pairs with it, marked by a ring: where it hangs on earlier groups or on
the ground.
"""

from __future__ import annotations

import re
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Body
from mechdae.draw import style
from mechdae.draw.closing import check_closes
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.diagram import View, draw_scene, extent, on_axes
from mechdae.draw.diagram.driver import drivers_of
from mechdae.draw.diagram.heads import draw_frame, write_heads
from mechdae.draw.diagram.places import letters_of, missing_hint, numbers_of, places_of
from mechdae.draw.diagram.scene import DrawnScene, choose_pose, read_scene
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels.labels import Links, Writing, write_all, writings
from mechdae.draw.plans.relations import groups_of, named_group
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.types import Json

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes

    from mechdae.results import SweepResult

PAD = (84.0, 78.0)
"""Room of a cell [units] for what is beside its links: symbols and letters."""
BELOW = 48.0
"""Of it below the links: for the name of the group."""
NAME = 26.0
"""How far that is below them."""
LINE = 11.0
"""Distance of the lines of a name."""
MANY = 6
"""Of more groups a new figure is larger."""
RING = 3.2
"""How far the ring around an outer pair is from its pin."""


@dataclass(frozen=True)
class DrawnGroup:
    """A group: its scene, what it is called, its outer points by joint, corners and size."""

    name: str
    about: str
    scene: DrawnScene
    strangers: frozenset[str]
    outer: tuple[Joint, ...]
    bounds: tuple[Array, Array, float]


def draw(
    result: SweepResult,
    ax: Axes | None = None,
    *,
    pose: int | None = None,
    group: str | None = None,
    labels: bool = True,
    dark: bool = False,
    lang: str = "en",
    scale: float | Callable[[float], float] | None = None,
) -> Axes:
    """Draw the Assur groups of one pose apart, each with its outer pairs, name, class and order.

    Options are those of the catalogue; given axes are in their final size.

    Raises
    ------
    InputError
        A pose that does not assemble, or without groups.
    UnknownName
        No such group or language.
    """
    words, theme = Words(lang), style.DARK if dark else style.LIGHT
    scene = read_scene(result)
    index = choose_pose(scene, result.kind, pose)
    pieces = pieces_of(result, scene, index, group, words)
    value = str(result.summary.get("formula", "")) if group is None else ""
    view = View(False, 0, labels, False, (np.zeros(2), np.ones(2), 1.0),
                scale=scale, larger=(max(len(pieces) / MANY, 1.0) ** 0.5,) * 2)  # fmt: skip

    def drawn(paper: Axes | None, shown: View) -> Sheet:
        sheet = draw_pieces(paper, scene, result, index, pieces, shown, theme, words)
        write_heads(sheet, scene, result, index, words, value)
        return sheet

    return on_axes(ax, view, theme, drawn)


def pieces_of(
    result: SweepResult, scene: DrawnScene, pose: int, group: str | None, words: Words
) -> list[DrawnGroup]:
    """Return the groups that are shown in a pose."""
    found = groups_of(result, scene)
    alone = None if group is None else named_group([name for name, _ in found], group)
    entries = {group["name"]: group for group in result.summary.get("groups") or ()}
    earlier = {GROUND}
    pieces = []
    for name, bodies in found:
        there = tuple(body for body in bodies if scene.shown(body, pose))
        if alone in (None, name) and there:
            pieces.append(_piece(scene, pose, name, there, earlier, _about(entries, name, words)))
        earlier |= set(bodies)
    if not pieces:
        raise InputError(
            f"pose {pose} is {scene.status[pose]}: there is no group to draw",
            hint=missing_hint(scene),
        )
    return pieces


def _about(entries: Json, name: str, words: Words) -> str:
    """Return class and order of a group in words, where it has them."""
    entry = entries.get(name) or {}
    if entry.get("class", "0") in ("0", "I"):
        return words("input link") if re.match(r"I\b", name) else ""
    return words("class and order", entry["class"], entry["order"])


def _piece(
    scene: DrawnScene, pose: int, name: str, bodies: tuple[str, ...], earlier: set[str], about: str
) -> DrawnGroup:
    """Return a group alone: its links, and of others the points on which it hangs."""
    whole, mine = scene.mechanism, set(bodies)
    joints = {
        joint.name: joint
        for joint in scene.joints(pose)
        if mine & set(joint.bodies) and set(joint.bodies) <= mine | earlier
    }
    outer = [joint for joint in joints.values() if not set(joint.bodies) <= mine]
    held: dict[str, list[str]] = {}
    for joint in outer:
        for side in (joint.first, joint.second):
            body, point = side.split(".")
            if body not in mine and body != GROUND:
                held.setdefault(body, []).append(point)
    numbers = numbers_of(whole)
    links = {body: replace(whole.bodies[body], number=numbers[body]) for body in bodies}
    for body, points in held.items():
        there = {point: whole.bodies[body].points[point] for point in points}
        links[body] = Body(body, there, number=numbers[body])
    part = copy(whole)  # its links need not be connected
    object.__setattr__(part, "bodies", links)
    object.__setattr__(part, "joints", joints)
    alone = replace(scene, mechanism=part, way=None)
    bounds = extent(alone, pose, False)
    return DrawnGroup(name, about, alone, frozenset(held), tuple(outer), bounds)


def draw_pieces(
    axes: Axes | None, scene: DrawnScene, result: SweepResult, pose: int,
    pieces: Sequence[DrawnGroup], view: View, theme: style.Theme, words: Words,
) -> Sheet:  # fmt: skip
    """Draw groups side by side to one scale; return their sheet."""
    blank = Sheet(axes, np.zeros(2), np.ones(2), larger=view.larger)
    shifts, low, high = _arranged(blank, pieces)
    sheet = Sheet(axes, low, high, view.scale, theme, None, view.larger, (4.0, 4.0, 4.0, 4.0))
    check_closes(sheet, scene, result, pose, words)
    names = letters_of(scene, pose, places_of(scene, pose))
    every = drivers_of(scene, result)
    texts: list[Writing] = []
    links = Links()
    for piece, shift in zip(pieces, shifts, strict=True):
        origins = {name: origin + shift for name, origin in piece.scene.origins.items()}
        moved = replace(piece.scene, origins=origins)
        known = {*moved.mechanism.bodies, *moved.mechanism.joints} - piece.strangers
        drivers = tuple(driver for driver in every if driver.part in known)
        shown = replace(view, bounds=piece.bounds, drivers=drivers)
        places, parts, marks = draw_scene(sheet, moved, result, pose, shown, words)
        for joint in [joint for joint in piece.outer if not joint.meshes]:
            _ring(sheet, moved, joint, pose)
        if view.labels:
            letters = letters_of(moved, pose, places) | names
            rows = writings(sheet, moved, pose, places, parts, marks, letters)
            strange = {f"number-{name}" for name in piece.strangers}
            once = {(row.kind, row.text, row.index): row for row in reversed(rows)}
            texts += [row for row in once.values() if row.gid not in strange]
            for name, corners in parts.polygons.items():
                links.polygons.setdefault(name, corners)
        _caption(sheet, piece, shift)
    note = words("ringed") if any(piece.outer for piece in pieces) else ""
    draw_frame(sheet, scene, result, pose, words, note)
    write_all(sheet, texts, links)
    return sheet


def _ring(sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int) -> None:
    """Mark an outer pair: its pin, or its block."""
    centre, gid = sheet.at(scene.place(joint.second, pose)), f"outer-{joint.name}"
    if not joint.guide:
        centre = sheet.at(scene.place(joint.first, pose)) if joint.coincide else centre
        sheet.circle(centre, style.PIN + RING, edge=style.ARROW, gid=gid, weight=0.5)
        return
    wider = symbols.rectangle(centre, scene.axis(joint, pose), RING)
    sheet.line([*wider, wider[0]], color=style.ARROW, gid=gid, weight=0.5)


def _arranged(sheet: Sheet, pieces: Sequence[DrawnGroup]) -> tuple[list[Array], Array, Array]:
    """Return how far each group is moved [m], and the corners of all: in rows that fit best."""
    sizes = np.array([piece.bounds[1] - piece.bounds[0] for piece in pieces])
    room = sheet.size - (8.0, 8.0 + style.STRIP)
    best: tuple[float, int] = (0.0, 1)
    for columns in range(1, len(pieces) + 1):
        spans = _spans(sizes, columns)
        left = room - np.array([len(row) for row in spans]) * PAD
        whole = np.array([sum(row) for row in spans])
        scale = float((np.maximum(left, 20.0) / np.maximum(whole, 1e-300)).min())
        best = max(best, (scale, columns))
    metre, columns = best
    wide, tall = (
        np.array(spans) + pad / metre
        for spans, pad in zip(_spans(sizes, columns), PAD, strict=True)
    )
    shifts, lift = [], np.array([0.0, (BELOW - PAD[1] / 2) / metre])
    for k, piece in enumerate(pieces):
        i, j = k % columns, k // columns
        cell = np.array([wide[:i].sum() + wide[i] / 2, -tall[:j].sum() - tall[j] / 2])
        shifts.append(cell + lift - (piece.bounds[0] + piece.bounds[1]) / 2)
    return shifts, np.array([0.0, -tall.sum()]), np.array([wide.sum(), 0.0])


def _spans(sizes: Array, columns: int) -> tuple[list[float], list[float]]:
    """Return widths of columns and heights of rows [m]."""
    wide = [float(sizes[k::columns, 0].max()) for k in range(min(columns, len(sizes)))]
    tall = [float(sizes[k : k + columns, 1].max()) for k in range(0, len(sizes), columns)]
    return wide, tall


def _caption(sheet: Sheet, piece: DrawnGroup, shift: Array) -> None:
    """Write name, class and order below a group."""
    low, high, _ = piece.bounds
    foot = sheet.at(np.array([(low[0] + high[0]) / 2, low[1]]) + shift) - (0.0, NAME)
    rows = ((piece.name, style.SUBTITLE, style.INK), (piece.about, style.NOTE, style.FAINT))
    for k, (text, size, color) in enumerate(rows):
        if text:
            chosen = font(size, style.NOTE_FONT)
            spot = foot - (0.0, LINE * k)
            half = (ink(text, chosen)[1] - ink(text, chosen)[0]) / 2
            sheet.text(spot, text, chosen, color, f"group-{piece.name}-{k}")
            sheet.box(spot - half - 2.0, spot + half + 2.0)
