"""Gears and racks in space: pitch cylinders and cones, a spoke that shows their turn, a rack.

Wheels are drawn as wire: what carries them is seen through them. Where a file gives no size, cones
end where the wheels' points are, and wheels on crossing axes touch where their relative screw axis
meets the common perpendicular.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram.places import hull
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.space import solids
from mechdae.draw.space.anchors import anchor, size_of
from mechdae.draw.space.solids import Facet, Item
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.records import dataclass

SAME = 1e-9
"""Sine, or share of the mechanism's size, below which directions or places are one."""
FACE = 0.2
"""Width of a face over the radius of the smaller wheel, or over the length of a cone."""
USUAL = 0.25
"""Length of cones whose points tell none, in sizes of the mechanism."""
MARGIN = 0.9
"""How far a rack reaches beyond where the wheel comes, in radii."""
TEETH = 5.0
"""Distance of the strokes on a rack, in units of the sheet."""

Place = Callable[[Array], Array]


@dataclass(frozen=True)
class PitchSurface:
    """A wheel: two circles about one axis; lengths in m, in the fixed frame.

    Parameters
    ----------
    body
        The wheel.
    ends
        (2, 3) centres of the circles.
    radii
        Of both circles.
    axis
        (3,) unit direction.
    shaft
        (3,) where its joint on the carrier is drawn.
    anchor
        What it moves with: its own point of the mesh, in a page to the scale of lengths.
    """

    body: str
    ends: Array
    radii: tuple[float, float]
    axis: Array
    shaft: Array
    anchor: Anchor

    @property
    def middle(self) -> Array:
        middle: Array = self.ends.mean(axis=0)
        return middle

    def rims(self) -> list[Array]:
        """Return places on both circles, (m, 3) each."""
        both = zip(self.ends, self.radii, strict=True)
        return [solids.ring(end, self.axis, radius) for end, radius in both]

    def outline(self) -> Array:
        """Return places (m, 3) [m] that reach as far as it does."""
        return np.vstack(self.rims())


@dataclass(frozen=True)
class PitchPlane:
    """A rack: the corners (4, 3) of its pitch plane [m].

    The first two corners follow each other along its way.
    """

    body: str
    corners: Array
    anchor: Anchor

    def outline(self) -> Array:
        """Return places (m, 3) [m] that reach as far as it does."""
        return self.corners


@dataclass(frozen=True)
class _Member:
    """A wheel or rack on the carrier: its axis, a point of it, and its own point of the mesh."""

    body: str
    axis: Array
    place: Array
    own: Array
    shaft: Array
    base: str

    @property
    def anchor(self) -> Anchor:
        return Anchor((self.base,), self.body, "m")

    def foot(self, place: Array) -> Array:
        """Return the point of the axis nearest to a place."""
        return self.place + self.axis * float(self.axis @ (place - self.place))


def surfaces(
    scene: SpatialScene, mesh: Joint, pose: int, moved: Mapping[str, float]
) -> list[PitchSurface | PitchPlane]:
    """Return the wheels, or wheel and rack, of a mesh in one pose; none where it has no teeth.

    Wheels about one line, and those whose axes or places are not known, have none.
    """
    members = [_member(scene, mesh, k, pose, moved) for k in range(2)]
    first, second = members
    if first is None or second is None:
        return []
    size = size_of(scene, pose)
    if mesh.wheels == 1:
        return _with_rack(scene, mesh, pose, first, second)
    ratio = scene.numbers[f"{mesh.name}.ratio"]
    cross = np.cross(first.axis, second.axis)
    sine, gap = float(np.linalg.norm(cross)), second.place - first.place
    if sine > SAME and abs(cross @ gap) <= SAME * sine * size:
        return _cones(scene, mesh, pose, (first, second), ratio)
    pitch = _point(scene, mesh, pose)
    if pitch is None:
        pitch = _rolling(first, second, ratio)
    if pitch is None:
        return []
    feet = [member.foot(pitch) for member in (first, second)]
    radii = [float(np.linalg.norm(pitch - foot)) for foot in feet]
    if min(radii) <= SAME * size:
        return []
    if sine <= SAME:  # each at the height of its own point
        feet = [member.foot(member.own) for member in (first, second)]
    half = 0.5 * FACE * min(radii)
    off = [float(np.linalg.norm(m.own - m.foot(m.own))) for m in members if m is not None]
    apart = float(np.linalg.norm(first.own - second.own))
    # as far apart as the axes are, if the wheels' points are on them
    grow = f"{mesh.first}>{mesh.second}" if max(off) <= SAME * size < apart else "m"
    return [
        PitchSurface(
            m.body,
            np.array([foot - half * m.axis, foot + half * m.axis]),
            (r, r),
            m.axis,
            m.shaft,
            replace(m.anchor, grow=grow),
        )
        for m, foot, r in zip((first, second), feet, radii, strict=True)
    ]


def _member(
    scene: SpatialScene, mesh: Joint, k: int, pose: int, moved: Mapping[str, float]
) -> _Member | None:
    """Return a wheel or rack on its carrier, if its axis and its places are known."""
    joint = scene.mechanism.joints[bearings(scene.mechanism, mesh)[k].joint]
    carrier = getattr(mesh, "carrier", None) or GROUND
    carries_second = joint.second_body == carrier
    here, wheel = joint.second if carries_second else joint.first, mesh.second if k else mesh.first
    axis = scene.axis(joint, pose, second=carries_second)
    known = joint in scene.joints(pose) and wheel in scene.tracks
    if axis is None or not known or not np.isfinite(scene.place(wheel, pose)).all():
        return None
    sides = anchor(scene, joint, pose, moved)
    shaft = sides[0] if carries_second else sides[1]
    place = scene.place(here, pose)
    return _Member(mesh.bodies[k], axis, place, scene.place(wheel, pose), shaft, wheel)


def _point(scene: SpatialScene, mesh: Joint, pose: int) -> Array | None:
    point = getattr(mesh, "point", None)
    return None if point is None or point not in scene.tracks else scene.place(point, pose)


def _rolling(first: _Member, second: _Member, ratio: float) -> Array | None:
    """Return the point of the relative screw axis nearest to both axes; None if it is far away."""
    turn = ratio * first.axis - second.axis
    square = float(turn @ turn)
    if square <= SAME:
        return None
    # velocity of the first wheel less that of the second one, at the first one's point
    slip = -np.cross(second.axis, first.place - second.place)
    point: Array = first.place + np.cross(turn, slip) / square
    normal = np.cross(first.axis, second.axis)
    if float(np.linalg.norm(normal)) <= SAME:
        return first.foot(first.own) + (point - first.foot(point))
    # along the screw axis to the common perpendicular
    gap = second.place - first.place
    system = np.column_stack([first.axis, -second.axis, normal])
    reach = np.linalg.solve(system, gap)[0]
    foot = first.place + reach * first.axis
    return point + turn * float(turn @ (foot - point)) / square


def _cones(
    scene: SpatialScene, mesh: Joint, pose: int, members: tuple[_Member, _Member], ratio: float
) -> list[PitchSurface | PitchPlane]:
    """Return the pitch cones of wheels whose axes meet, cut off on both sides of the teeth."""
    first, second = members
    gap, cosine = second.place - first.place, float(first.axis @ second.axis)
    reach = float(gap @ first.axis - cosine * (gap @ second.axis)) / (1 - cosine**2)
    apex = first.place + reach * first.axis
    way = ratio * first.axis - second.axis
    way = way / np.linalg.norm(way)
    length = 0.0
    pitch = _point(scene, mesh, pose)
    if pitch is not None:
        length = float((pitch - apex) @ way)
    else:
        for member in members:
            height, slope = float((member.own - apex) @ member.axis), float(way @ member.axis)
            if abs(slope) > SAME and abs(height / slope) > abs(length):
                length = height / slope
        sine = float(np.linalg.norm(np.cross(first.axis, way)))
        radius = scene.numbers.get(f"{mesh.name}.radius", 0.0)
        if radius > 0 and sine > SAME:
            length = radius / sine * (-1.0 if length < 0 else 1.0)
    length = length or USUAL * size_of(scene, pose)
    found: list[PitchSurface | PitchPlane] = []
    for member in members:
        sine = float(np.linalg.norm(np.cross(member.axis, way)))
        if sine <= SAME:
            return []
        along = [length * (1 + sign * FACE) for sign in (-1, 1)]
        ends = np.array([apex + member.axis * float(way @ member.axis) * t for t in along])
        radii = (abs(along[0]) * sine, abs(along[1]) * sine)
        found.append(
            PitchSurface(member.body, ends, radii, member.axis, member.shaft, member.anchor)
        )
    return found


def _with_rack(
    scene: SpatialScene, mesh: Joint, pose: int, wheel: _Member, rack: _Member
) -> list[PitchSurface | PitchPlane]:
    radius = scene.numbers[f"{mesh.name}.radius"]
    pitch = _point(scene, mesh, pose)
    foot = wheel.foot(wheel.own if pitch is None else pitch)
    if pitch is None:
        away = np.cross(rack.axis, wheel.axis)
        size = float(np.linalg.norm(away))
        if size <= SAME:
            return []
        pitch = foot + radius * away / size
    out = pitch - foot
    size = float(np.linalg.norm(out))
    if size <= SAME:
        return []
    half = 0.5 * FACE * size
    ends = np.array([foot - half * wheel.axis, foot + half * wheel.axis])
    ways = _ways(scene, mesh, rack, pose) + MARGIN * size * np.array([-1.0, 1.0])
    side = np.cross(out / size, rack.axis)
    corners = [
        pitch + way * rack.axis + sign * 1.4 * half * side
        for way, sign in ((ways[0], -1), (ways[1], -1), (ways[1], 1), (ways[0], 1))
    ]
    return [
        PitchSurface(wheel.body, ends, (size, size), wheel.axis, wheel.shaft, wheel.anchor),
        PitchPlane(rack.body, np.array(corners), rack.anchor),
    ]


def _ways(scene: SpatialScene, mesh: Joint, rack: _Member, pose: int) -> Array:
    """Return between which places along itself the rack meets the wheel, from here, (2,) [m]."""
    joint = scene.mechanism.joints[bearings(scene.mechanism, mesh)[1].joint]
    sense = 1.0 if joint.second_body == rack.body else -1.0
    ways = [scene.along(joint, index) for index in scene.assembled()]
    here = scene.along(joint, pose)
    travel = sense * (here - np.array([way for way in ways if np.isfinite(way)] or [here]))
    return np.array([min(travel.min(), 0.0), max(travel.max(), 0.0)])


def sides(scene: SpatialScene, pose: int) -> dict[str, float]:
    """Return how far along the axis [m] wheels are from the joints that they turn in, by joint."""
    found = {}
    for mesh in scene.joints(pose):
        if not mesh.wheels:
            continue
        for bearing, part in zip(
            bearings(scene.mechanism, mesh), surfaces(scene, mesh, pose, {}), strict=False
        ):
            if isinstance(part, PitchSurface):
                found[bearing.joint] = float((part.middle - part.shaft) @ part.axis)
    return found


# -- on the sheet --------------------------------------------------------------------------------


def wheel_items(
    wheel: PitchSurface, at: Place, mark: Array, gid: str, colors: tuple[str, str]
) -> list[Item]:
    """Return what is drawn of a wheel.

    Parameters
    ----------
    at
        Gives of a place [m] the one on the sheet.
    mark
        (3,) a direction of the body across the axis, for the spoke.
    colors
        Of the wheel and of its shaft.
    """
    color, ink = colors
    metre = float(np.linalg.norm(at(wheel.axis) - at(np.zeros(3))))
    axis = (at(wheel.axis) - at(np.zeros(3))) / metre
    rims = [
        solids.rim(at(end), axis, radius * metre)
        for end, radius in zip(wheel.ends, wheel.radii, strict=True)
    ]
    near, wide = int(axis[2] > 0), 0 if wheel.radii[0] >= wheel.radii[1] else 1
    shown = [near] if wheel.radii[0] == wheel.radii[1] else [near, 1 - near]
    circles = [(np.vstack(rims), style.LINE), *((rims[k], style.THIN) for k in shown)]
    items = [
        wire(Facet("hull", circle, True, fill="none", edge=color, width=width), gid)
        for circle, width in circles
    ]
    center, radius = wheel.ends[wide], wheel.radii[wide]
    end = at(center + radius * mark)
    items.append(
        wire(Facet("line", np.array([at(center), end]), edge=color, width=style.THIN), gid)
    )
    items.append(solids.solid([Facet("dot", end[None], fill=color, size=style.DOT)], gid))
    items[-1].points = np.column_stack([end[:2] + style.DOT * solids.SQUARE, np.full(4, end[2])])
    shaft = np.array([at(wheel.shaft), at(center)])
    if float(np.linalg.norm(shaft[1] - shaft[0])) > 1.0:
        items.append(solids.polyline(shaft, gid, ink, style.BAR, bridges=False))
    for item in items:
        item.anchor = wheel.anchor
    return items


def rack_items(rack: PitchPlane, at: Place, gid: str, color: str) -> list[Item]:
    """Return what is drawn of a rack: its pitch plane, with strokes for the teeth."""
    corners = np.array([at(place) for place in rack.corners])
    along, across = corners[1] - corners[0], corners[3] - corners[0]
    count = max(int(np.linalg.norm(along) / TEETH), 2)
    share = (np.arange(count) + 0.5)[:, None] / count
    starts = corners[0] + share * along
    lines = np.stack([starts, starts + across], axis=1)
    items = [wire(Facet("hull", corners, fill="none", edge=color), gid)]
    items += [wire(Facet("line", line, edge=color, width=style.THIN), gid) for line in lines]
    for item in items:
        item.anchor = rack.anchor
    return items


def wire(facet: Facet, gid: str) -> Item:
    """Return an open line that is drawn by a facet, closed around places."""
    if facet.kind == "line":
        line = facet.points
    else:
        places = facet.places
        line = places[[*hull(places[:, :2].round(9))]]
        line = np.vstack([line, line[:1]])
    return Item(line, facets=[facet], gid=gid, bridges=False, width=facet.width)
