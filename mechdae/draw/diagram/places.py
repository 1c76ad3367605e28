"""Joint places, points of several bodies that are always at one place; shapes of links."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import dist
from typing import Any, TypeAlias

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Body, Mechanism
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import LineLook, Sheet, normal, unit
from mechdae.records import dataclass
from mechdae.types import Booleans

LONG = 3
"""A joint name of more letters gives way to the name of the point."""
LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True)
class Place:
    """One place where joints are.

    Parameters
    ----------
    references
        The points ``body.point`` that meet there.
    joints
        The joints there.
    """

    references: tuple[str, ...]
    joints: tuple[Joint, ...]

    @property
    def bodies(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(entry.split(".")[0] for entry in self.references))

    @property
    def pinned(self) -> bool:
        """Whether a pin is drawn."""
        return any(joint.pinned for joint in self.joints)

    @property
    def fixed(self) -> bool:
        """Whether the pin turns in the ground."""
        return self.pinned and GROUND in self.bodies

    @property
    def letter(self) -> str:
        """The name on the diagram: of the joint, or of the point if that says more."""
        points = list(dict.fromkeys(entry.split(".")[1] for entry in self.references))
        names = [joint.name for joint in self.joints if joint.coincide or joint.slot]
        one = len(names) == 1 and len(names[0]) <= LONG
        if len(points) == 1 and not (one and len(names[0]) < len(points[0])):
            return points[0]
        if one:
            return names[0]
        short = [name for name in names if len(name) <= LONG]
        if len(short) > 1:
            return ", ".join(short)
        return short[0] if short else min(points, key=lambda text: (len(text), points.index(text)))


AnyScene: TypeAlias = Any
"""A scene of the plane or of space, as the view that is drawn needs it."""


def missing_hint(scene: PlacedScene) -> str:
    """Return what to try where nothing is drawn: the result may not have all bodies."""
    known = {*scene.placed, *scene.helpers}
    missing = [name for name in scene.mechanism.bodies if name not in known]
    if not missing:
        return "another pose or task"
    return f"a task without outputs: the result has no {', '.join(missing)}"


def places_of(scene: PlacedScene, pose: int) -> list[Place]:
    """Return the joint places shown, in the order of the joints.

    A pin in the ground is shown also where its link does not assemble in this pose.
    """
    groups: list[set[str]] = []
    both = scene.joints(pose)
    known = set(scene.placed)
    closed = [each for each in scene.mechanism.joints.values() if each.name not in scene.open]
    fixed = [each for each in closed if each.hinge and GROUND in each.bodies]
    fixed = [each for each in fixed if set(each.bodies) <= known]
    joints = [each for each in scene.mechanism.joints.values() if each in both or each in fixed]
    order: dict[str, int] = {}
    for joint in joints:
        for cluster in _points_of(joint):
            for reference in cluster:
                order.setdefault(reference, len(order))
            joined = set(cluster)
            for group in [group for group in groups if group & joined]:
                joined |= group
                groups.remove(group)
            groups.append(joined)
    groups = _same_local(scene, groups)
    result = []
    for group in sorted(groups, key=lambda group: min(order[entry] for entry in group)):
        references = tuple(
            reference
            for reference in sorted(group, key=order.__getitem__)
            if scene.shown(reference.split(".")[0], pose)
        )
        there = tuple(
            joint for joint in joints if any(group & set(cluster) for cluster in _points_of(joint))
        )
        result.append(Place(references, there))
    return result


def free_points(scene: PlacedScene, pose: int) -> list[str]:
    """Return the points of moving bodies that belong to no joint."""
    joints = [each for each in scene.mechanism.joints.values() if each.name not in scene.open]
    used = {side for joint in joints for side in (joint.first, joint.second)}
    free = []
    for name, body in scene.mechanism.bodies.items():
        spots = [scene.local(side) for side in used if side.split(".")[0] == name]
        for reference in (f"{name}.{point}" for point in body.points):
            if scene.shown(name, pose) and reference not in used:
                here = scene.local(reference)
                if not any(np.allclose(spot, here, atol=1e-12) for spot in spots):
                    free.append(reference)
    return free


def fixed_bodies(mechanism: Mechanism) -> set[str]:
    """Return the ground and the bodies welded to it."""
    fixed = {GROUND}
    welds = [joint for joint in mechanism.joints.values() if joint.rigid]
    for _ in welds:
        for joint in welds:
            if fixed & set(joint.bodies):
                fixed |= set(joint.bodies)
    return fixed


def numbers_of(mechanism: Mechanism) -> dict[str, int]:
    """Return the number of each body: its own, else the next free in declared order."""
    given = {name: body.number for name, body in mechanism.bodies.items()}
    taken = {number for number in given.values() if number is not None}
    free = (number for number in range(1, 2 * len(given) + 2) if number not in taken)
    return {name: next(free) if number is None else number for name, number in given.items()}


def letters_of(scene: PlacedScene, pose: int, places: Sequence[Place]) -> dict[str, str]:
    """Return the letter of each point of joint places and of free points, one for each place.

    Where two places would have one letter, those with one joint of a short name have that name,
    the others the number of their link as an index.
    """
    numbers = numbers_of(scene.mechanism)
    owners: list[tuple[tuple[str, ...], str, list[str]]] = []
    for place in places:
        names = [j.name for j in place.joints if (j.coincide or j.slot) and len(j.name) <= LONG]
        bodies = [body for body in place.bodies if body != GROUND]
        single = names if len(names) == 1 else []
        single = [*single, *_indexed(place.letter, bodies, numbers)]
        owners.append((place.references, place.letter, single))
    for reference in free_points(scene, pose):
        body, point = reference.split(".")
        owners.append(((reference,), point, _indexed(point, [body], numbers)))
    count = Counter(letter for _, letter, _ in owners)
    taken = {letter for letter, often in count.items() if often == 1}
    found: dict[str, str] = {}
    for references, letter, others in owners:
        name = letter
        if count[letter] > 1:
            free = [other for other in others if other not in taken and other not in count]
            name = free[0] if free else references[0]
        taken.add(name)
        found |= dict.fromkeys(references, name)
    return found


def _indexed(letter: str, bodies: Sequence[str], numbers: Mapping[str, int]) -> list[str]:
    return [f"{letter}_{numbers[body]}" for body in bodies]


def written(name: str) -> tuple[str, str]:
    """Return a name as it is written: numbers at its end are an index, also of several names."""
    match = re.fullmatch(r"([A-Za-zα-ω]+)_?(\d+(?:_\d+)?)", name)
    if match or ", " not in name:
        return (match[1], match[2].replace("_", ",")) if match else (name, "")
    pairs = [written(part) for part in name.split(", ")]
    return ", ".join(letter + index.translate(LOWERED) for letter, index in pairs), ""


def _points_of(joint: Joint) -> list[tuple[str, ...]]:
    """Return the places of a joint that are drawn, each with the points that meet there."""
    if joint.coincide:
        return [(joint.first, joint.second)]
    if joint.normal_force:
        return [(joint.second,)]
    if joint.wheels == 1:
        return [(joint.first,)]
    return [(joint.first,), (joint.second,)]


def _same_local(scene: PlacedScene, groups: list[set[str]]) -> list[set[str]]:
    """Join groups that hold the same place of one body under two names."""
    result: list[set[str]] = []
    spots: dict[str, list[tuple[list[float], str]]] = {}
    for group in groups:
        joined = set(group)
        for reference in sorted(group):
            body = reference.split(".")[0]
            here = [scene.numbers[f"{reference}.{axis}"] for axis in scene.mechanism.axes]
            for there, name in spots.setdefault(body, []):
                if dist(here, there) <= 1e-12 and name not in joined:
                    other = next(other for other in result if name in other)
                    joined |= other
                    result.remove(other)
            spots[body].append((here, reference))
        result.append(joined)
    return result


FLAT = 0.02
"""Points this close to a line or a plane, as a share of their spread, lie on it."""


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
    sheet: Sheet, scene: DrawnScene, name: str, pose: int, color: str, z: float, dashed: bool
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
            look: LineLook = {"width": 0.0, "z": style.Z_FILL, "gid": f"body-{name}-polygon"}
            sheet.area(corners, fill=style.FILL, edge="none", weight=0.0, **look)
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
    sheet: Sheet, scene: DrawnScene, pose: int, place: Place, center: Array,
    bars: Mapping[str, list[Piece]],
) -> None:  # fmt: skip
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
        others = [name for name in bodies if name != body]
        ends = [end for name in others for end in scene.points(name)]
        arms = [sheet.at(scene.place(end, pose)) - center for end in ends]
        away = np.array([0.0, 1e-6]) - np.sum(arms, axis=0)
        with sheet.on(reference, turn=body):
            symbols.bridge(sheet, center, along, away, f"bridge-{reference}", style.INK)


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


def ghost_lines(sheet: Sheet, scene: DrawnScene, pose: int) -> Iterator[Piece]:
    """Yield the lines of the links in another pose."""
    for name in scene.mechanism.bodies:
        for pair in edges(shape_of(scene, name)) if scene.shown(name, pose) else ():
            first, second = (sheet.at(scene.place(f"{name}.{point}", pose)) for point in pair)
            yield first, second


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
