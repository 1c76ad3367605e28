"""The shapes of links: bars, rigid polygons, and where bars pass through blocks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from mechdae.describe.mechanism import GROUND, Body
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.places import Place
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.sheet import Sheet, normal, unit
from mechdae.records import dataclass
from mechdae.types import Booleans

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


def hull(points: Array, flat: float = 0.0) -> list[int]:
    """Return the indices of the corners of the convex hull, counter-clockwise (monotone chain).

    What spans twice the area `flat` or less with its neighbours is no corner.
    """
    order = sorted(range(len(points)), key=lambda i: (points[i][0], points[i][1]))

    def half(indices: Iterable[int]) -> list[int]:
        chain: list[int] = []
        for i in indices:
            while len(chain) > 1 and _turn(points, chain[-2], chain[-1], i) <= flat:
                chain.pop()
            chain.append(i)
        return chain[:-1]

    return half(order) + half(reversed(order))


def _turn(points: Array, i: int, j: int, k: int) -> float:
    a, b = points[j] - points[i], points[k] - points[i]
    return float(a[0] * b[1] - a[1] * b[0])


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
    color: str,
    z: float = style.Z_BAR,
    dashed: bool = False,
) -> list[Piece]:
    """Draw bars and polygon of a body; return the lines drawn.

    Blocks and slots hide bars whose ``z`` is below theirs. ``dashed`` are bodies outside the scene.
    """
    width, dash = (style.LINE, style.DASHED) if dashed else (style.BAR, None)
    shape = shape_of(scene, name)
    spots = {
        point: sheet.at(scene.place(f"{name}.{point}", pose))
        for point in scene.mechanism.body(name).points
    }
    pairs = edges(shape)
    if shape.kind == "polygon":
        corners = np.array([spots[point] for point in shape.points])
        with sheet.on(*(f"{name}.{point}" for point in shape.points)):
            sheet.area(
                corners, fill=style.FILL, edge="none", width=0.0, z=style.Z_FILL,
                gid=f"body-{name}-polygon", weight=0.0,
            )  # fmt: skip
        for i, spot in enumerate(corners):
            arms = (corners[i - 1] - spot, corners[(i + 1) % len(corners)] - spot)
            with sheet.on(f"{name}.{shape.points[i]}", turn=name):
                symbols.corner(sheet, spot, arms, None, color)
    for point in shape.inner:
        away = {corner: float(np.hypot(*(spots[corner] - spots[point]))) for corner in shape.points}
        if name != GROUND and not inside(spots[point], corners):
            pairs.append((point, min(away, key=away.__getitem__)))
    for first, second in pairs:
        with sheet.on(f"{name}.{first}", f"{name}.{second}"):
            ends, gid = [spots[first], spots[second]], f"body-{name}-bar"
            sheet.line(ends, color=color, width=width, z=z, dash=dash, gid=gid)
    return [(spots[first], spots[second]) for first, second in pairs]


def draw_bridges(
    sheet: Sheet,
    scene: DrawnScene,
    pose: int,
    place: Place,
    center: Array,
    bars: Mapping[str, list[Piece]],
) -> None:
    """Mark the bars that run past this pin without a break."""
    bodies = [name for name in place.bodies if name != GROUND]
    for reference in place.references if place.pinned else ():
        body = reference.split(".")[0]
        if body == GROUND or shape_of(scene, body).kind == "polygon":
            continue
        arms = _drawn_arms(bars.get(body, []), center)
        along = next((arm for arm in arms if any(arm @ other < -0.99 for other in arms)), None)
        if along is None:
            continue
        others = sum(
            (
                sheet.at(scene.place(f"{name}.{end}", pose)) - center
                for name in bodies
                if name != body
                for end in scene.mechanism.body(name).points
            ),
            np.array([0.0, -1e-6]),
        )
        with sheet.on(reference, turn=body):
            gid = f"bridge-{reference}"
            symbols.bridge(sheet, center, along, -np.asarray(others), gid, style.INK)


def _drawn_arms(bars: list[Piece], center: Array) -> list[Array]:
    """Return the directions in which the lines of a body leave a place."""
    arms = []
    for start, end in bars:
        offsets = np.array([start - center, end - center])
        along = unit(end - start)
        if abs(float(offsets[0] @ normal(along))) < 1.0:
            low, high = (float(offset @ along) for offset in offsets)
            if low < 1.0 and high > 1.0:
                arms.append(along)
            if low < -1.0 and high > -1.0:
                arms.append(-along)
    return arms


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


def within(places: Array, corners: Array) -> Booleans:
    """Return which places (k, 2) lie inside a polygon (m, 2), (k,)."""
    result = np.zeros(len(places), dtype=bool)
    x, y = places.T
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        upright = (ay > y) != (by > y)
        if upright.any():
            with np.errstate(divide="ignore", invalid="ignore"):
                result ^= upright & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return result


def inside(point: Array, corners: Array) -> bool:
    """Return whether a point is inside a polygon."""
    return bool(within(point[None], corners)[0])
