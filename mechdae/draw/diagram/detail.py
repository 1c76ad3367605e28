"""Enlarged details: circles beside the diagram, where pins are nearer than their symbols."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.diagram import View, draw_scene
from mechdae.draw.diagram.places import Place, places_of
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels.labels import write_all, writings
from mechdae.draw.labels.layout import first_free
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, unit
from mechdae.draw.words import ENGLISH

if TYPE_CHECKING:
    from mechdae.results.result import Result

RADII = (52.0, 44.0, 36.0)
"""Radius of a detail, the first for which there is room,"""
RIM = 9.0
"""and what pins in it are off from its border."""
SCALES = (5, 10, 20, 50, 100, 200)
APART = 4.5 * style.PIN
"""Pins are at least so far from each other in a detail."""
RING = style.PIN + 3.0
"""How far the ring around what is enlarged is from the pins."""
ABOVE = 20.0
"""Rank above all else."""


def draw_details(scene: DrawnScene, result: Result, pose: int, labels: bool, sheet: Sheet) -> str:
    """Draw an enlarged detail of each group of pins whose symbols overlap, where there is room."""
    places = places_of(scene, pose)
    for group in near_pins(sheet, scene, pose, places):
        _draw_detail(sheet, scene, result, pose, places, group, labels)
    return ""


def near_pins(
    sheet: Sheet, scene: DrawnScene, pose: int, places: Sequence[Place]
) -> Iterator[list[Place]]:
    """Yield the groups of places with pins that cover each other, but are not one place."""
    left = [place for place in places if place.pinned]
    spots = {place: sheet.at(scene.place(place.references[0], pose)) for place in left}
    while left:
        group = [left.pop()]
        for place in group:
            near = [p for p in left if np.hypot(*(spots[p] - spots[place])) < 2 * style.PIN]
            left = [other for other in left if other not in near]
            group += near
        if len(group) > 1:
            yield group


def _draw_detail(
    sheet: Sheet, scene: DrawnScene, result: Result, pose: int, places: Sequence[Place],
    group: Sequence[Place], labels: bool,
) -> None:  # fmt: skip
    spots = np.array([sheet.at(scene.place(place.references[0], pose)) for place in group])
    middle = (spots.min(axis=0) + spots.max(axis=0)) / 2
    gaps = np.hypot(*np.moveaxis(spots[:, None] - spots, -1, 0))[np.triu_indices(len(spots), 1)]
    reach = float(np.hypot(*(spots - middle).T).max())
    fine = [scale for scale in SCALES if scale * float(gaps.min()) >= APART]
    for radius in RADII if fine else ():
        foot = free_place(sheet, middle, radius + 14.0)
        if foot is not None and fine[0] * reach <= radius - RIM:
            break
    else:
        return
    # what is near, drawn on a sheet of its own
    part = Sheet(None, np.zeros(2), np.ones(2), theme=sheet.theme)
    part.k, part.metre, part.size = sheet.k, fine[0] * sheet.metre, np.full(2, 2 * radius)
    part.corner = sheet.back(middle) - radius / part.metre
    view = View(traces=False, loads=False, bare=True)
    _, links, _ = draw_scene(part, scene, result, pose, view, ENGLISH)
    names = {f"label-{place.references[0]}" for place in group if labels}
    sheet.elsewhere |= names
    texts = writings(part, scene, pose, places, links)
    write_all(part, [text for text in texts if text.gid in names], links)
    # and put in a circle beside the diagram
    toward, ring = unit(foot - middle), reach + RING
    sheet.line([middle + ring * toward, foot - radius * toward], color=style.FAINT,
               width=style.THIN, gid="detail-line", weight=style.RING)  # fmt: skip
    sheet.circle(middle, ring, edge=style.FAINT, width=style.THIN, gid="detail-of")
    sheet.circle(foot, radius, fill=style.PAPER, edge=style.FAINT, z=ABOVE - 1, gid="detail")
    for shape in part.drawn:
        sheet.paste(replace(
            shape, points=shape.points + foot - radius, z=shape.z + ABOVE,
            gid=None if shape.gid is None else f"detail-{shape.gid}",
            clip=(*foot.tolist(), radius) if shape.kind != "text" else None,
        ))  # fmt: skip
    sheet.circle(foot, radius, edge=style.FAINT, z=2 * ABOVE, gid="detail-rim")
    chosen, text = font(style.NOTE, style.NOTE_FONT), f"{fine[0]} : 1"
    lift = radius + 7.0
    spot = foot + np.array([0.0, lift if toward[1] > 0 else -lift])  # away from the line
    sheet.text(spot, text, chosen, style.FAINT, "detail-scale")
    half = (ink(text, chosen)[1] - ink(text, chosen)[0]) / 2
    sheet.box(spot - half, spot + half)


def free_place(sheet: Sheet, middle: Array, reach: float) -> Array | None:
    """Return the place nearest to another one where nothing is drawn so far around, if any."""
    x, y = (np.arange(reach, max(side - reach, reach) + 1.0, 8.0) for side in sheet.size)
    spots = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    spots = spots[np.argsort(np.hypot(*(spots - middle).T), kind="stable")]
    obstacles = Obstacles(*sheet.obstacles(), sheet.size)
    found = first_free(spots, (reach, reach), obstacles)
    return None if found is None else spots[found]
