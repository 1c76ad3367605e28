"""The shapes of links: bars, rigid polygons, and where bars pass through blocks."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechdae.describe.mechanism import GROUND, Body
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.sheet import Sheet, unit
from mechdae.records import dataclass

FLAT = 0.02
"""Points this close to one line, as a share of their spread, count as collinear."""


@dataclass(frozen=True)
class LinkShape:
    """How a link is drawn.

    Parameters
    ----------
    kind
        "polygon", "bar" or "point".
    points
        Point names: the corners in order, the points of a bar from end to end, or one.
    inner
        Points that a polygon holds besides its corners.
    """

    kind: str
    points: tuple[str, ...]
    inner: tuple[str, ...] = ()


@dataclass(frozen=True)
class HiddenStretch:
    """A stretch of a bar that is hidden by a block or a slot, in units of the sheet."""

    start: Array
    end: Array


Piece = tuple[Array, Array]


def shape_of(scene: DrawnScene, name: str) -> LinkShape:
    """Return the shape of a body from its points; points on one place count once."""
    body = scene.mechanism.body(name)
    local = {point: scene.local(f"{name}.{point}") for point in body.points}
    distinct: list[str] = []
    for point, place in local.items():
        if all(np.hypot(*(place - local[other])) > 1e-12 for other in distinct):
            distinct.append(point)
    if isinstance(body, Body) and body.outline is not None and len(body.outline) > 2:
        inner = tuple(point for point in distinct if point not in body.outline)
        return LinkShape("polygon", tuple(body.outline), inner)
    if len(distinct) < 2:
        return LinkShape("point", tuple(distinct))
    if len(distinct) == 2:
        return LinkShape("bar", tuple(distinct))
    places = np.array([local[point] for point in distinct])
    centered = places - places.mean(axis=0)
    _, spread, axes = np.linalg.svd(centered, full_matrices=True)
    if spread[1] <= FLAT * spread[0]:
        order = np.argsort(centered @ axes[0], kind="stable")
        return LinkShape("bar", tuple(distinct[i] for i in order))
    corners = hull(places)
    inner = tuple(point for i, point in enumerate(distinct) if i not in corners)
    return LinkShape("polygon", tuple(distinct[i] for i in corners), inner)


def hull(points: Array) -> list[int]:
    """Return the indices of the corners of the convex hull, counter-clockwise."""
    order = sorted(range(len(points)), key=lambda i: (points[i][0], points[i][1]))

    def half(indices: Iterable[int]) -> list[int]:
        chain: list[int] = []
        for i in indices:
            while len(chain) > 1 and _turn(points, chain[-2], chain[-1], i) <= 0:
                chain.pop()
            chain.append(i)
        return chain[:-1]

    return half(order) + half(reversed(order))


def _turn(points: Array, i: int, j: int, k: int) -> float:
    a, b = points[j] - points[i], points[k] - points[i]
    return float(a[0] * b[1] - a[1] * b[0])


def pieces(start: Array, end: Array, gaps: Iterable[HiddenStretch]) -> list[Piece]:
    """Return what is left of a bar outside the gaps that lie on it."""
    along, length = unit(end - start), float(np.hypot(*(end - start)))
    spans: list[tuple[float, float]] = [(0.0, length)]
    for gap in gaps:
        offsets = np.array([gap.start - start, gap.end - start])
        beside = np.abs(offsets @ np.array([-along[1], along[0]]))
        if beside.max() > 1.0:
            continue
        low, high = sorted((offsets @ along).tolist())
        spans = [
            part
            for a, b in spans
            for part in ((a, min(b, low)), (max(a, high), b))
            if part[1] - part[0] > 1e-9
        ]
    return [(start + a * along, start + b * along) for a, b in spans]


def edges(shape: LinkShape) -> list[tuple[str, str]]:
    """Return the pairs of points that a shape connects by lines."""
    if shape.kind == "polygon":
        return list(zip(shape.points, (*shape.points[1:], shape.points[0]), strict=True))
    if shape.kind == "bar":
        return [(shape.points[0], shape.points[-1])]
    return []


def draw_body(
    sheet: Sheet,
    scene: DrawnScene,
    name: str,
    pose: int,
    gaps: Iterable[HiddenStretch],
    color: str,
    z: float = style.Z_BAR,
    dashed: bool = False,
) -> list[Piece]:
    """Draw bars and polygon of a body; return the lines drawn.

    The bars of a body that has a block end at it: their ``z`` is below that of blocks.
    ``dashed`` are bodies outside the scene.
    """
    width, dash = (style.LINE, style.DASHED) if dashed else (style.BAR, None)
    shape = shape_of(scene, name)
    spots = {
        point: sheet.at(scene.place(f"{name}.{point}", pose))
        for point in scene.mechanism.body(name).points
    }
    if shape.kind == "polygon":
        corners = np.array([spots[point] for point in shape.points])
        sheet.area(
            corners,
            fill=style.FILL,
            edge="none",
            width=0.0,
            z=style.Z_FILL,
            gid=f"body-{name}-polygon",
            weight=0.0,
        )
        for i, spot in enumerate(corners):
            arms = (corners[i - 1] - spot, corners[(i + 1) % len(corners)] - spot)
            symbols.corner(sheet, spot, arms, None, color)
    drawn: list[Piece] = []
    gaps = list(gaps)
    for first, second in edges(shape):
        drawn += pieces(spots[first], spots[second], gaps)
    for point in shape.inner:
        nearest = min(
            shape.points, key=lambda corner: float(np.hypot(*(spots[corner] - spots[point])))
        )
        if name != GROUND and not inside(spots[point], corners):
            drawn += pieces(spots[point], spots[nearest], gaps)
    for start, end in drawn:
        sheet.line([start, end], color=color, width=width, z=z, dash=dash, gid=f"body-{name}-bar")
    return drawn


def draw_ghost(sheet: Sheet, scene: DrawnScene, name: str, pose: int) -> None:
    """Draw the lines of a body in another pose, faintly."""
    for first, second in edges(shape_of(scene, name)):
        ends = [sheet.at(scene.place(f"{name}.{point}", pose)) for point in (first, second)]
        sheet.line(
            ends,
            color=style.GHOST,
            width=style.LINE,
            z=style.Z_GHOST,
            gid="ghost",
            weight=style.SHADE,
        )


def inside(point: Array, corners: Array) -> bool:
    """Return whether a point is inside a polygon (rays to the right)."""
    result = False
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if (a[1] > point[1]) != (b[1] > point[1]):
            reach = a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            result ^= bool(point[0] < reach)
    return result
