"""One pose of a spatial mechanism on a sheet: joints, links, arrows, labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from itertools import combinations

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram.places import (
    FLAT,
    Place,
    fixed_bodies,
    free_points,
    hull,
    letters_of,
    places_of,
)
from mechdae.draw.labels.labels import Links, Writing, letter
from mechdae.draw.labels.layout import feet
from mechdae.draw.primitives import PAPER, Anchor, Array
from mechdae.draw.sheet import Sheet
from mechdae.draw.space import solids
from mechdae.draw.space.anchors import anchor, base_of, bases
from mechdae.draw.space.solids import Item
from mechdae.draw.space.spatial_drivers import arrow_of
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.spatial_symbols import SYMBOLS, DrawnSymbol, JointPlace, JointSide, Start
from mechdae.draw.space.spatial_wheels import (
    PitchPlane,
    PitchSurface,
    rack_items,
    surfaces,
    wheel_items,
)
from mechdae.draw.space.viewpoint import Viewpoint
from mechdae.records import dataclass

GAP = 8.0
"""Room between the middle of a joint and its letter."""


@dataclass
class SpatialPose:
    """A pose in units of the sheet: (right, up, towards the eye).

    Parameters
    ----------
    scene, pose
        What is drawn.
    view
        From where.
    moved
        See `mechdae.draw.space.anchors.offsets`.
    colors
        Of bodies that are not drawn in ink.
    outside
        Bodies that are drawn dashed.
    """

    sheet: Sheet
    scene: SpatialScene
    pose: int
    view: Viewpoint
    moved: Mapping[str, float]
    colors: Mapping[str, str] = field(default_factory=dict)
    outside: frozenset[str] = frozenset()

    @cached_property
    def fixed(self) -> set[str]:
        """The ground and the bodies welded to it."""
        return fixed_bodies(self.scene.mechanism)

    def at(self, place: Array) -> Array:
        """Return a place [m] on the sheet with its depth, (3,)."""
        seen = self.view.seen(place)
        return np.array([*self.sheet.at(seen[:2]), seen[2] * self.sheet.metre])

    def anchors(self, joint: Joint) -> tuple[Array, Array]:
        """Return the middle of a joint's symbol, and of what slides in it, on the sheet."""
        center, other = anchor(self.scene, joint, self.pose, self.moved)
        return self.at(center), self.at(other)

    def bases(self, joint: Joint) -> tuple[str, str]:
        """Return the names of the places that the symbol of a joint keeps to."""
        return base_of(joint, self.moved), base_of(joint, self.moved, second=True)

    @cached_property
    def along(self) -> Mapping[str, tuple[str, str, Array, float]]:
        """Places along axes, see `mechdae.draw.space.anchors.bases`."""
        return bases(self.scene, self.pose, self.moved)

    def base(self, name: str) -> Array:
        """Return a point, or a place along an axis, in the fixed frame, (3,) [m]."""
        if "/" not in name:
            return self.scene.place(name, self.pose)
        point, body, axis, way = self.along[name]
        return self.scene.place(point, self.pose) + way * self.turned(body) @ axis

    def turned(self, turn: str) -> Array:
        """Return the directions (3, 3) of what something turns with, as columns."""
        if turn == solids.EYE:
            return self.view.basis.T
        if ">" in turn:
            a, b = (self.base(name) for name in turn.split(">"))
            way = (b - a) / max(float(np.linalg.norm(b - a)), 1e-300)
            return np.array([*solids.across(way), way]).T
        turned: Array = self.scene.turns[turn or GROUND][self.pose]
        return turned

    def turn(self, body: str) -> str:
        """Return what a body turns with: itself, "" where that is not known."""
        return body if body != GROUND and body in self.scene.turns else ""

    @cached_property
    def up(self) -> Array:
        """(3,) what is upright, on the sheet."""
        return self.view.seen(np.array(self.view.upward))

    def color(self, body: str) -> str:
        return self.colors.get(body, style.GROUND if body in self.fixed else style.INK)

    # -- joints and links ------------------------------------------------------------------

    def build(self) -> tuple[list[Item], Links]:
        """Return the items of all joints and links, and what numbers of links are attached to."""
        links = {name: self._link(name) for name in self.scene.mechanism.bodies}
        joints = [j for j in self.scene.joints(self.pose) if j.kind in SYMBOLS]
        places = {joint.name: self.anchors(joint) for joint in joints}
        for joint in joints:
            ends = zip(joint.bodies, places[joint.name], self.bases(joint), strict=True)
            for body, place, base in ends:
                if body in links:
                    links[body].add(place, base)
        for reference in [*free_points(self.scene, self.pose), *self._vector_ends()]:
            place = self.at(self.scene.place(reference, self.pose))
            links[reference.split(".")[0]].add(place, reference)
        items: list[Item] = []
        for joint in joints:
            drawn = self._joint(joint, places[joint.name], links)
            items += drawn.items
            starts = (drawn.first, drawn.second)
            ends = zip(joint.bodies, places[joint.name], self.bases(joint), strict=True)
            for (body, place, base), start in zip(ends, starts, strict=True):
                if body in links:
                    links[body].add(place, base, start)
        attached = Links()
        for name, link in links.items():
            if not self.scene.shown(name, self.pose) or not link.places:
                continue
            bodies, bars, corners = link_items(link)
            items += bodies
            attached.bars[name] = bars
            attached.points[name] = link.places[0][:2]
            if corners is not None:
                attached.polygons[name] = corners
        for reference in free_points(self.scene, self.pose):
            spot = self.at(self.scene.place(reference, self.pose))
            dot = solids.ball(spot, style.DOT, f"point-{reference}", base=reference)
            dot.owner = reference.split(".")[0]
            items.append(dot)
        return items + self._wheels(), attached

    def _wheels(self) -> list[Item]:
        """Return gears and racks; a wheel of several meshes is drawn once if it is of one size."""
        items, seen = list[Item](), set[tuple[str, tuple[float, ...]]]()
        for joint in self.scene.joints(self.pose):
            if not joint.wheels:
                continue
            gid = f"joint-{joint.name}-{joint.kind}"
            for part in surfaces(self.scene, joint, self.pose, self.moved):
                color = self.colors.get(part.body, style.WHEEL)
                if isinstance(part, PitchPlane):
                    items += rack_items(part, self.at, gid, self.color(part.body))
                    continue
                key = part.body, tuple((self.at(part.middle).round(1) + 0.0).tolist())
                if key not in seen:
                    seen.add(key)
                    mark = self._mark(part)
                    items += wheel_items(part, self.at, mark, gid, (color, self.color(part.body)))
        return items

    def _mark(self, wheel: PitchSurface) -> Array:
        """Return a direction (3,) of a wheel across its axis: to a point of it if it has one."""
        turns, axis = self.scene.turns.get(wheel.body), wheel.axis
        arms = [self.scene.place(ref, self.pose) for ref in self.scene.points(wheel.body)]
        ways = [arm - wheel.middle for arm in arms]
        if turns is not None and np.isfinite(turns[self.pose]).all():
            turn = turns[self.pose]
            ways.append(turn @ solids.across(turn.T @ axis)[0])
        flat = [way - axis * (way @ axis) for way in [*ways, solids.across(axis)[0]]]
        sizes = [float(np.linalg.norm(way)) for way in flat]
        long = next(k for k, size in enumerate(sizes) if size > 1e-6 * max(sizes))
        return flat[long] / sizes[long]

    def _vector_ends(self) -> list[str]:
        """Return the points of bodies that turn at which vectors end."""
        return [
            end
            for joint in self.scene.joints(self.pose)
            for end in (joint.first, joint.second)
            if joint.pointer
            and end.split(".")[0] in self.scene.turns
            and not end.startswith(GROUND)
        ]

    def _link(self, name: str) -> SpatialLink:
        return SpatialLink(name, self.color(name), name in self.outside, turn=self.turn(name))

    def _joint(
        self, joint: Joint, places: tuple[Array, Array], links: Mapping[str, SpatialLink]
    ) -> DrawnSymbol:
        sides = []
        for body, place in zip(joint.bodies, places, strict=True):
            others = [
                other
                for other in (links[body].places if body in links else ())
                if float(np.linalg.norm(other - place)) > 1.0
            ]
            targets = np.array(others).reshape(-1, 3)
            fixed, turn = body in self.fixed, self.turn(body)
            if not (turn or fixed) and others:  # it spins freely about the line to its other end
                link = links[body]
                here = self.bases(joint)[body == joint.second_body]
                turn = f"{here}>{next(base for base in link.bases if base != here)}"
            sides.append(JointSide(body, self.color(body), targets, fixed, turn))
        frame = self.scene.frame(joint, self.pose)
        if frame is None:
            frame = self.scene.frame(joint, self.pose, second=True)
        frame = np.eye(3) if frame is None else self.view.seen(frame)
        pin = self.scene.axis(joint, self.pose, second=True)
        at = JointPlace(
            joint.name,
            *places,
            frame,
            frame[2] if pin is None else self.view.seen(pin),
            self._span(joint),
            self.scene.numbers.get(f"{joint.name}.pitch", 1.0) < 0,
            self.up,
            self.bases(joint),
            self.turn(self.scene.holder(joint, self.pose)),
        )
        drawn = SYMBOLS[joint.kind](at, *sides)
        for item in drawn.items:
            if item.anchor is PAPER:
                item.anchor = Anchor(at.bases[:1], at.turn)
        return drawn

    def _span(self, joint: Joint) -> tuple[float, float]:
        """Return how far what slides comes along its axis in all poses, in units of the sheet."""
        ends = [self.along.get(f"{joint.name}/{end}") for end in ("low", "high")]
        low, high = (0.0 if end is None else end[3] * self.sheet.metre for end in ends)
        return low, high

    # -- drivers ---------------------------------------------------------------------------

    def arrow(self, entry: NamedCoordinate, sense: float) -> list[Item]:
        """Return the arrow of a driven coordinate; none where its joint has no place."""
        joint = self.scene.mechanism.joints.get(entry.part)
        if joint is None:
            base = f"{entry.part}.{entry.point}"
            at = self.at(self.scene.place(base, self.pose))
            way = self.view.seen(np.eye(3)[entry.axis])
            arrow = arrow_of(entry, (at, at), [way], (GROUND, entry.part), sense)
            return anchored(arrow, Anchor((base,)))
        if joint not in self.scene.joints(self.pose) or joint.pointer:
            return []
        frame = self.scene.frame(joint, self.pose)
        axis = self.scene.axis(joint, self.pose)
        if axis is None:
            return []
        axes = [self.view.seen(axis)]
        pin = self.scene.axis(joint, self.pose, second=True)
        if pin is not None:
            axes.append(self.view.seen(pin))
        if entry.word in ("x", "y") and frame is not None:
            axes = [self.view.seen(frame["xy".index(entry.word)])]
        center, other = self.anchors(joint)
        if joint.straight and joint.first_body != GROUND:
            center = other  # where its sleeve is
        arrow = arrow_of(entry, (center, other), axes, (joint.first_body, joint.second_body), sense)
        turn = self.turn(self.scene.holder(joint, self.pose))
        return anchored(arrow, Anchor(self.bases(joint)[1:], turn))

    # -- labels ----------------------------------------------------------------------------

    def letters(self, links: Links) -> list[Writing]:
        """Return the letters of joint places, of moved symbols and of free points."""
        every = [place for place in places_of(self.scene, self.pose) if place.references]
        places = [self._staying(place) for place in every]
        names = letters_of(self.scene, self.pose, places)
        joints = self.scene.mechanism.joints
        rows: list[tuple[str, str, Array]] = []
        for place in places:
            if any(joint.name not in self.moved for joint in place.joints):
                ref = place.references[0]
                rows.append((names[ref], ref, self.scene.place(ref, self.pose)))
        for name in self.moved:
            if joints[name] in self.scene.joints(self.pose):
                rows.append(
                    (name, name, anchor(self.scene, joints[name], self.pose, self.moved)[0])
                )
        for joint in self.scene.joints(self.pose):
            center, other = self.anchors(joint)
            if (
                joint.slot
                and joint.first_body == GROUND
                and np.hypot(*(center - other)[:2]) > 2.5 * GAP
            ):
                rows.append((joint.name, joint.name, self.scene.place(joint.first, self.pose)))
        for ref in free_points(self.scene, self.pose):
            rows.append((names[ref], ref, self.scene.place(ref, self.pose)))
        result = []
        for text, gid, spot in ((text, gid, self.at(at)[:2]) for text, gid, at in rows):
            result.append(letter(text, gid, spot, GAP, _arms(links, spot)))
        return result

    def _staying(self, place: Place) -> Place:
        """Return a place without the joints whose symbols are drawn elsewhere, with their names."""
        staying = tuple(joint for joint in place.joints if joint.name not in self.moved)
        if not staying or len(staying) == len(place.joints):
            return place
        ends = {end for joint in staying for end in (joint.first, joint.second)}
        return Place(tuple(ref for ref in place.references if ref in ends), staying)


def _arms(links: Links, spot: Array) -> list[Array]:
    """Return the directions of the bars that begin near a place."""
    found = []
    for bars in links.bars.values():
        for a, b in bars:
            for start, end in ((a, b), (b, a)):
                if np.hypot(*(start - spot)) < 2.5 * GAP and np.hypot(*(end - start)) > 1.0:
                    found.append(end - start)
    return found


def anchored(items: list[Item], anchor: Anchor) -> list[Item]:
    """Return items that all move with one anchor."""
    for item in items:
        item.anchor = anchor
    return items


SAME = 1.0
"""Places nearer than that are one, in units of the sheet."""


@dataclass
class SpatialLink:
    """The places of a body, in units of the sheet, and where bars to others begin.

    Parameters
    ----------
    places
        (3,) each, distinct.
    starts
        Of each the place where a bar to a target begins; None: at the place.
    bases
        Of each what it keeps to in a page; ``turn`` what the body turns with, "" without one.
    """

    name: str
    color: str
    dashed: bool = False
    places: list[Array] = field(default_factory=list)
    starts: list[Start | None] = field(default_factory=list)
    bases: list[str] = field(default_factory=list)
    turn: str = ""

    def add(self, place: Array, base: str, start: Start | None = None) -> None:
        """Add a place; of one that is there the start is completed."""
        for k, known in enumerate(self.places):
            if float(np.linalg.norm(known - place)) < SAME:
                self.starts[k] = self.starts[k] or start
                return
        self.places.append(place)
        self.starts.append(start)
        self.bases.append(base)

    def anchor(self, *places: int) -> Anchor:
        """Return what a line or face between places moves with."""
        bases = tuple(self.bases[k] for k in places)
        return Anchor(bases, self.turn or (">".join(bases) if len(bases) == 2 else ""))

    def begin(self, k: int, target: Array) -> Array:
        """Return where the bar from place `k` to a target begins."""
        start = self.starts[k]
        return self.places[k] if start is None else start(target)


def faces_of(points: Array) -> list[list[int]]:
    """Return the faces of the convex hull of places (k, 3): lists of indices in order.

    Two for places on a line (its ends), one for those in a plane.
    """
    count = len(points)
    if count < 3:
        return [list(range(count))]
    centered = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(centered, full_matrices=True)
    if spread[1] <= FLAT * spread[0]:
        along = centered @ axes[0]
        return [[int(np.argmin(along)), int(np.argmax(along))]]
    if count == 3 or spread[2] <= FLAT * spread[0]:
        return [hull(centered @ axes[:2].T)]
    found: dict[frozenset[int], list[int]] = {}
    size = float(spread[0])
    for i, j, k in combinations(range(count), 3):
        normal = np.cross(points[j] - points[i], points[k] - points[i])
        length = float(np.linalg.norm(normal))
        if length <= 1e-9 * size**2:
            continue
        height = (points - points[i]) @ normal / length
        if height.max() <= 1e-6 * size or height.min() >= -1e-6 * size:
            members = np.flatnonzero(np.abs(height) <= 1e-6 * size)
            u = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
            v = np.cross(normal / length, u)
            flat = (points[members] - points[i]) @ np.array([u, v]).T
            found.setdefault(frozenset(members.tolist()), members[hull(flat)].tolist())
    return list(found.values())


def edges_of(faces: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    """Return the pairs of places that are connected, each once."""
    found: dict[tuple[int, int], None] = {}
    for face in faces:
        pairs = zip(face, [*face[1:], face[0]], strict=True) if len(face) > 2 else [tuple(face)]
        for pair in pairs:
            if len(set(pair)) == 2:
                found[min(pair), max(pair)] = None
    return list(found)


def link_items(link: SpatialLink) -> tuple[list[Item], list[tuple[Array, Array]], Array | None]:
    """Return the items of a link, its bars on the sheet, and its corners if it is one face."""
    if len(link.places) < 2:
        return [], [], None
    points = np.array(link.places)
    faces = faces_of(points)
    gid = f"body-{link.name}-bar"
    items, bars = list[Item](), list[tuple[Array, Array]]()
    for face in faces:
        if len(face) > 2:
            items.append(
                Item(
                    points[face], closed=True, gid=f"body-{link.name}-face", color="none",
                    width=0.0, weight=0.0, owner=link.name, anchor=link.anchor(*face),
                )
            )  # fmt: skip
    width, dash = (style.LINE, style.DASHED) if link.dashed else (style.BAR, None)
    edges = edges_of(faces)
    joined = {k for edge in edges for k in edge}
    for k in range(len(points)):  # what lies inside of a face or between the ends of a bar
        if k not in joined and not _on_edge(points, edges, k):
            near = min(joined, key=lambda j: round(float(np.linalg.norm(points[j] - points[k])), 6))
            edges.append((k, near))
    for a, b in edges:
        ends = np.array([link.begin(a, points[b]), link.begin(b, points[a])])
        if float(np.linalg.norm(ends[1] - ends[0])) > 1e-6:
            bar = solids.polyline(ends, gid, link.color, width, dash=dash, anchor=link.anchor(a, b))
            bar.owner = link.name
            items.append(bar)
            bars.append((ends[0, :2], ends[1, :2]))
    corners = points[faces[0], :2] if len(faces) == 1 and len(faces[0]) > 2 else None
    return items, bars, corners


def _on_edge(points: Array, edges: Sequence[tuple[int, int]], k: int) -> bool:
    a, b = points[np.reshape(edges, (-1, 2)).T]
    return bool((np.linalg.norm(points[k] - feet(points[k], a, b), axis=1) <= SAME).any())
