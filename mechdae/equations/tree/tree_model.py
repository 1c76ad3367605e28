"""The symbolic model of a spatial mechanism: coordinates of a tree of joints, rows of the others.

It has the interface of `mechdae.equations.model.Model`, so that elimination, blocks, kernels and
paths know nothing of space. The tree belongs to the drivers: what they drive is one of its
coordinates.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.describe.coordinates import NamedCoordinate, Selection
from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.spinning_links import (
    IdleLink,
    Line,
    idle_links,
    points_of,
    spins,
    without,
)
from mechdae.equations.coordinates import QUATERNION, Coordinate, Coordinates, of_owner
from mechdae.equations.groups import Group, body_numbers, spatial_kind
from mechdae.equations.model import Quantity, Row
from mechdae.equations.reduction import groups_of
from mechdae.equations.structure_cache import StructureCache
from mechdae.equations.tree.closures import (
    ROWS,
    UNIT,
    CutJoint,
    angles_of,
    at_distance,
    rows_of,
    senses,
    turned,
)
from mechdae.equations.tree.invariants import Hung, Invariants, invariants
from mechdae.equations.tree.joint_chains import Freedom, WayProduct, WayProducts, Z, apart
from mechdae.equations.tree.skeleton import Skeleton, literal, side
from mechdae.equations.tree.solid import SPACE
from mechdae.equations.tree.spatial_frames import (
    WORDS,
    JointMotion,
    TreeFrame,
    backward,
    by_quaternion,
    forward,
    placed,
    span,
)
from mechdae.equations.tree.spins import Edge, Spinning, edges
from mechdae.equations.tree.teeth import meshed
from mechdae.equations.tree.tree_forces import TreeForces
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.describe.spinning_links import Spin

SX = ca.SX
SLIDES = ("slide", "x", "y")
"""Coordinates of joints along axes."""


class TreeModel(Spinning, TreeForces):
    """Symbols and equations of one spatial mechanism.

    Parameters
    ----------
    mechanism
        The description.
    drivers
        Coordinates that are driven.
    free
        Names of numbers that must stay symbols even where they are a literal zero, or a direction.

    Attributes
    ----------
    edges : list of Edge
        The tree, in the order in which it places the bodies.
    idle : dict
        Links that spin freely between two ball joints, by name.
    spins : list of Spin
        Bodies that spin freely together; their frames are those of one spin.
    loose : list of str
        Bodies that constraints are missing for: they are placed last.
    tree : set of str
        Joints that are edges.
    points : set of str
        Bodies that are points at the ends of vectors.
    senses : list of (joint, expression)
        What must be positive at a pose: equations of cut joints hold for opposite axes too.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        drivers: Sequence[NamedCoordinate] = (),
        free: Iterable[str] = (),
    ) -> None:
        self.mechanism, self.cache, self._free = mechanism, StructureCache(), set(free)
        self.drivers, self.space, self.contacts, self.ends = tuple(drivers), SPACE, {}, {}
        named = [c.part for c in drivers if c.kind == "point"]
        self.idle: dict[str, IdleLink] = idle_links(mechanism, named)
        self.spins: list[Spin] = spins(mechanism, self.drivers)
        self._lines: dict[str, Line] = {name: link.own for name, link in self.idle.items()}
        for spin in self.spins:
            self._lines |= spin.lines
        self._spun = {n: link for link in self.idle.values() for n in (link.joint, *link.others)}
        self._make_parameters()
        self._values = mechanism.values()
        skeleton = self._skeleton()
        rows = skeleton.driven(self.drivers)[0]
        self.loose: list[str] = skeleton.loose_bodies(rows) if drivers else []
        groups = groups_of(skeleton, rows, out=self.loose) if drivers else []
        every = [name for name in mechanism.bodies if name not in {*self.idle, *self.loose}]
        parts = [*([list(group.bodies) for group in groups] or [every]), self.loose]
        self.loose = self.loose + [n for n in self.idle if {*self.bodies_of(n)} & {*self.loose}]
        joints = [j for name, j in mechanism.joints.items() if name not in self._spun]
        self.points: set[str] = points_of(mechanism)
        self.edges: list[Edge] = edges(joints, parts, self._first(), self._then(), self.points)
        self._anchors, self._frames = {}, {}
        self._of: dict[tuple[str, str], Coordinate] = {}
        self._placed: dict[str, str] = {}
        self._place_bodies()
        self.senses: list[tuple[str, Sym]] = []
        self.rows: list[Row] = [row for edge in self.edges for row in self._norms(edge)]
        self.tree: set[str] = {edge.joint for edge in self.edges}
        self._cut_joints = [j.name for j in joints if j.name not in self.tree]
        for name in self._cut_joints:
            self.rows += self._closed(name)
        self.rows += self._unspun()
        for joint in self.mechanism.joints.values():
            if joint.pointer:
                self.senses += [(joint.name, value) for value in self._usual(joint.name)]
        self.rows += [self._length_row(link) for link in self.idle.values()]
        self.coordinates: Coordinates = Coordinates(self._of.values())
        self.q_names: list[tuple[str, str]] = self.coordinates.keys
        self.q: Sym = ca.vertcat(*[c.symbol for c in self.coordinates])
        self._of_symbol = {c.symbol.element_hash(): c for c in self.coordinates}

    def _is_constant(self, name: str) -> bool:
        """Directions that are plain numbers are no parameters."""
        part, _, entry = name.partition(".")
        joint = self.mechanism.joints.get(part)
        return joint is not None and "." in entry and literal(joint)

    def _skeleton(self) -> Skeleton:
        return Skeleton(without(self.mechanism, self.idle), self.spins)

    def _first(self) -> set[str]:
        """Return the joints that must be edges: driven ones, bearings of wheels, screws."""
        found = {c.part for c in self.drivers if c.part in self.mechanism.joints}
        for joint in self.mechanism.joints.values():
            if joint.meshes:
                found |= {bearing.joint for bearing in bearings(self.mechanism, joint)}
        return found

    def _then(self) -> set[str]:
        """Return the joints that should be edges where they can be."""
        return set()

    # -- the tree --------------------------------------------------------------------------

    def _side(self, name: str, second: bool) -> Sym:
        joint = self.mechanism.joints[name]
        return side(joint, second, self.numbers, self._values)

    def _own(self, owner: str, names: Iterable[str], body: str) -> dict[str, Sym]:
        """Return new coordinates of a joint or body by name, known with `body`."""
        made = of_owner(owner, tuple(names))
        self._of |= {c.key: c for c in made}
        self._placed[owner] = body
        return {c.name: c.symbol for c in made}

    def _place_bodies(self) -> None:
        self._frames[GROUND] = TreeFrame(SX(3, 1), SX.eye(3), SX.eye(3), ())  # type: ignore[assignment]
        for edge in self.edges:
            self._frames[edge.child] = self._placed_by(edge)  # type: ignore[assignment]

    def _placed_by(self, edge: Edge) -> TreeFrame:
        if not edge.joint:
            at = self._own(edge.child, ("x", "y", "z", *QUATERNION), edge.child)
            joints = self.mechanism.joints.values()
            sides = [side for j in joints for side in (j.first, j.second)]
            points = [side for side in sides if side.split(".")[0] == edge.child]
            self._anchors[edge.child] = points[0].split(".")[1]
            e = ca.vertcat(*[at[name] for name in QUATERNION])
            place, way = ca.vertcat(*[at[name] for name in "xyz"]), JointMotion(at).way((), True)
            return TreeFrame(place, by_quaternion(e), SX.eye(3), way)
        joint = self.mechanism.joints[edge.joint]
        if edge.child in self.points:
            return self._pointed(edge)
        names = QUATERNION if joint.ball else joint.coordinates
        lead = self._lead(edge.joint)
        if lead is not None:
            names = ("angle",)
        at = self._own(edge.joint, names, edge.child)
        play = JointMotion(at, getattr(joint, "crossed", False), lead)
        C1, C2 = (self._side(edge.joint, second) for second in (False, True))
        known: Any = self._frames[edge.parent]
        here, there = joint.first, joint.second
        if edge.forward:
            self._anchors[edge.child] = there.split(".")[1]
            return forward(known, self.local(here), C1, C2, play)
        self._anchors[edge.child] = here.split(".")[1]
        return backward(known, self.local(there), C1, C2, play)

    def _pointed(self, edge: Edge) -> TreeFrame:
        """Return the frame of a point: at the other end of a vector, or where a ball joint is."""
        joint = self.mechanism.joints[edge.joint]
        here, there = (joint.first, joint.second) if edge.forward else (joint.second, joint.first)
        self._anchors[edge.child] = there.split(".")[1]
        place = self.point(here)
        if joint.pointer:
            coordinates = self._own(edge.joint, joint.coordinates, edge.child)
            way = span(joint, self.numbers, coordinates)
            place = place + (way if edge.forward else -way)
        return TreeFrame(place, SX.eye(3), SX.eye(3))

    def slopes_of(self, name: str) -> dict[str, object]:
        """Return by coordinate of a vector what its end moves by (3,) from its start."""
        joint = self.mechanism.joints[name]
        symbols = {word: self._of[name, word].symbol for word in joint.coordinates}
        way = span(joint, self.numbers, symbols)
        return {word: ca.jacobian(way, symbol) for word, symbol in symbols.items()}

    def _lead(self, name: str) -> Sym:
        pitch = self.numbers.get(f"{name}.pitch")
        return None if pitch is None else pitch / (2 * ca.pi)

    # -- rows ------------------------------------------------------------------------------

    def _norms(self, edge: Edge) -> list[Row]:
        owner = edge.joint or edge.child
        if (owner, "e0") not in self._of:
            return []
        e = ca.vertcat(*[self._of[owner, name].symbol for name in QUATERNION])
        return [Row(owner, "norm", (ca.sumsqr(e) - 1) / 2, "1")]

    def _seen(self, *bodies: str) -> list[TreeFrame]:
        """Return the frames of bodies as they are seen from the last one that all hang on."""
        frames: list[Any] = [self.frame(body) for body in bodies]
        if any(frame.way is None for frame in frames):
            return frames
        shared = len(frames[0].way) - len(apart(frames[0].way, frames[1].way)[0])
        if not shared:
            return frames
        ways = [frame.way[shared:] for frame in frames]
        return [
            TreeFrame(*placed(way), frame.turn, way)
            for frame, way in zip(frames, ways, strict=True)
        ]

    def _gap(
        self, first: str, second: str, C1: Sym, C2: Sym, length: Sym | None = None
    ) -> CutJoint:
        """Return two points with frames C there, seen from the last body that both hang on."""
        seen, locals_ = self._seen(*(p.split(".")[0] for p in (first, second))), (
            self.local(first), self.local(second),
        )  # fmt: skip
        hung = [
            (sense, frame.direction(s), s)
            for sense, frame, s in zip((-1.0, 1.0), seen, locals_, strict=True)
            if length is not None and frame.on_ball
        ]
        A1, A2 = (f.side(C) for f, C in zip(seen, (C1, C2), strict=True))
        P1, P2 = (f.point(s) for f, s in zip(seen, locals_, strict=True))
        one, other = (f.to(s, C) for f, s, C in zip(seen, locals_, (C1, C2), strict=True))
        ways = None if one is None or other is None else (one, other)
        return CutJoint(P2 - P1, A1, A2, {}, length, None, ways, tuple(hung))

    def cut(self, name: str) -> CutJoint:
        """Return a joint as the gap and the frames of its sides."""
        joint = self.mechanism.joints[name]
        C1, C2 = (self._side(name, second) for second in (False, True))
        symbols = {w: self._of[name, w].symbol for w in joint.coordinates if (name, w) in self._of}
        found = self._gap(joint.first, joint.second, C1, C2, self.numbers.get(f"{name}.length"))
        return replace(found, own=symbols, lead=self._lead(name))

    def _invariant(self, joint: Joint) -> Invariants | None:
        """Return the rows of a cut ball joint by the joint that one of its bodies hangs on."""
        way = {edge.child: edge for edge in self.edges}
        driven = {c.part for c in self.drivers}
        found: list[tuple[int, Invariants]] = []
        for here, other in ((joint.second, joint.first), (joint.first, joint.second)):
            bodies = here.split(".")[0], other.split(".")[0]
            edge = way.get(bodies[0])
            if edge is None or not edge.joint:
                continue
            frame, neighbour = self._seen(*bodies)
            parent, _ = self._seen(edge.parent, bodies[1])
            if frame.way is None or neighbour.way is None or parent.way is None:
                continue
            if len(frame.way) <= len(parent.way):
                continue
            at, past = self.mechanism.joints[edge.joint], way.get(edge.parent)
            before = self.mechanism.joints.get(past.joint) if past is not None else None
            driven_by, forth = edge.joint in driven, edge.forward
            hung = Hung(frame, parent, self.local(here), at, before, driven_by, forth)
            rows = invariants(hung, neighbour, self.local(other), self.mechanism.order)
            if rows is not None:
                found.append((0 if hung.crossed else 1 if at.guide else 2, rows))
        return min(found, key=lambda pair: pair[0])[1] if found else None

    def _closed(self, name: str) -> list[Row]:
        """Return the equations of a joint that is no edge; its angles become coordinates."""
        joint = self.mechanism.joints[name]
        if joint.meshes:
            return [Row(name, "mesh", *self._mesh(name))]
        if joint.pointer:
            return self._head(name)
        angles = [word for word in joint.coordinates if word.startswith("angle")]
        if angles:
            self._own(name, angles, joint.second_body)
        invariant = self._invariant(joint) if joint.ball else None
        if invariant is not None:
            self.senses += [(name, value) for value in invariant.positive]
            return [Row(name, *row[:3], reach=row.reach) for row in invariant.rows]
        cut = self.cut(name)
        found = rows_of(joint.kind, cut)
        self.senses += [(name, value) for value in senses(ROWS[joint.kind], cut)]
        for word, sine, cosine in (
            angles_of(cut, getattr(joint, "crossed", False)) if angles else ()
        ):
            row, positive = turned(cut, word, sine, cosine)
            found.append(row)
            self.senses.append((name, positive))
        return [Row(name, *row[:3], reach=row.reach) for row in found]

    def _head(self, name: str) -> list[Row]:
        """Return the equations of a vector that is no edge: it ends at its head."""
        joint = self.mechanism.joints[name]
        way = span(joint, self.numbers, self._own(name, joint.coordinates, joint.second_body))
        gap = self.point(joint.second) - self.point(joint.first) - way
        return [Row(name, axis, gap[k], "m") for k, axis in enumerate("xyz")]

    def _usual(self, name: str) -> list[Sym]:
        """Return what is positive of the usual one of the triples that are the same vector."""
        joint = self.mechanism.joints[name]
        driven = {c.word for c in self.drivers if c.part == name}
        symbols = {
            word: self._of[name, word].symbol for word in joint.coordinates if word not in driven
        }
        turns = {"elevation", "azimuth"} <= symbols.keys()
        forward = {"length", "elevation"} <= symbols.keys()
        return [
            *([ca.cos(symbols["elevation"])] if turns else ()),
            *([symbols["length"]] if forward else ()),
        ]

    def _free_vectors(self) -> list[str]:
        """Return the vectors of which all is unknown: the structure has no equation of theirs."""
        joints = self.mechanism.joints.values()
        return [j.name for j in joints if j.pointer and len(j.coordinates) == len(WORDS)]

    def _mesh(self, name: str) -> tuple[Sym, str]:
        """Return the equation of wheels in the coordinates of their bearings, and its unit."""
        joint = self.mechanism.joints[name]
        return meshed(
            self.mechanism, joint, lambda key: self.numbers[f"{name}.{key}"], self.relative
        )

    def _length_row(self, link: IdleLink) -> Row:
        eye = SX.eye(3)
        cut = self._gap(*link.ends, eye, eye, self.length(link))
        (row,) = at_distance(cut)
        return Row(link.joint, *row[:3], reach=row.reach)

    def length(self, link: IdleLink) -> Sym:
        """Return the distance of the two ball joints of a link that spins freely."""
        along = self._span(*link.own)
        held = [part for part in along if not part.is_zero()]
        return ca.fabs(held[0]) if len(held) == 1 else ca.sqrt(ca.sumsqr(ca.vertcat(*along)))

    def _span(self, first: str, second: str) -> list[Sym]:
        """Return the way between two points of one body, by component."""
        return [
            self.numbers[f"{second}.{axis}"] - self.numbers[f"{first}.{axis}"]
            for axis in self.mechanism.axes
        ]

    # -- what others ask for ---------------------------------------------------------------

    @property
    def spinning(self) -> Iterable[str]:
        return (*self.idle, *(body for spin in self.spins for body in spin.bodies))

    def bodies_of(self, part: str) -> tuple[str, ...]:
        """Return the bodies that place a body or a joint: of an idle link its neighbours."""
        joint = self.mechanism.joints.get(part)
        if part in self._spun:
            return self.bodies_of(self._spun[part].name)
        if part in self.idle:
            return tuple(end.split(".")[0] for end in self.idle[part].ends)
        return joint.bodies if joint is not None else (part,)

    def point(self, reference: str) -> Sym:
        body = reference.split(".")[0]
        if body not in self.idle:
            return super().point(reference)
        link = self.idle[body]
        share = self._share(link, reference)
        if share is None:
            raise self._beside(reference)
        first, second = (self.point(end) for end in link.ends)
        return first + (second - first) * share

    def _share(self, link: IdleLink, reference: str) -> Sym:
        """Return where on the line of a link's ball joints a point lies, None beside it."""
        if reference in link.own:
            return SX(float(reference == link.own[1]))
        along, here = self._span(*link.own), self._span(link.own[0], reference)
        held = [i for i, part in enumerate(along) if not part.is_zero()]
        if len(held) == 1 and all(v.is_zero() for i, v in enumerate(here) if i not in held):
            return here[held[0]] / along[held[0]]
        moved = any(f"{reference}.{axis}" in self._free for axis in self.mechanism.axes)
        if moved or not self.has_place(reference):
            return None
        way = ca.vertcat(*along)
        return ca.dot(way, ca.vertcat(*here)) / ca.sumsqr(way)

    def reported(self, chosen: Selection, listed: bool) -> Selection:
        """Return what of a selection has a value: not what turns with bodies that spin freely."""
        still = {*self.spinning, *self.points}
        bodies = tuple(name for name in chosen.bodies if name not in still)
        lost = [point for point in chosen.points if not self.has_place(point)]
        if listed and lost:
            raise self._beside(lost[0])
        points = tuple(point for point in chosen.points if point not in lost)
        return replace(chosen, bodies=bodies, points=points)

    def coordinate(self, coordinate: NamedCoordinate) -> Sym:
        if coordinate.kind == "point":
            return self.point(f"{coordinate.part}.{coordinate.point}")[coordinate.axis]
        return self.relative(coordinate.part, coordinate.word)

    def loose_bodies(self, rows: Sequence[Row]) -> list[str]:
        return [*self.loose]

    axes = "xyz"
    joint_rates = True

    def turned(self, body: str) -> Quantity:
        """Return how a body is turned: its rotation matrix."""
        return "orientation", ca.vec(self.frame(body).R), self.turn_reaches(body)

    def placed(self, reference: str) -> Quantity:
        return "position", self.point(reference), self.point_reaches(reference)

    def joint_quantities(self, name: str) -> list[Quantity]:
        """Return the coordinates of a joint that have a value."""
        words = self.mechanism.joints[name].coordinates
        return [
            (word, self.relative(name, word), (self.relative_reach(name, word),))
            for word in words
            if self.has_value(name, word)
        ]

    def relative(self, joint: str, word: str) -> Sym:
        """Return a coordinate of a joint: one of the tree, or an expression of them."""
        found = self._of.get((joint, word))
        if found is not None:
            return found.symbol
        if (joint, "angle") in self._of and self._lead(joint) is not None:
            return self._lead(joint) * self._of[joint, "angle"].symbol
        cut = self.cut(joint)
        return ca.dot(cut.A1[:, "xy".find(word)], cut.gap)

    def point_reaches(self, reference: str) -> list[WayProducts | None]:
        """Return the reaches of the three coordinates of a point."""
        body = reference.split(".")[0]
        shares: list[tuple[str, Sym]] = [(reference, 1.0)]
        if body in self.idle:
            link = self.idle[body]
            share = self._share(link, reference)
            shares = [(link.ends[0], 1 - share), (link.ends[1], share)]
        ways = []
        for point, _ in shares:
            frame: Any = self.frame(point.split(".")[0])
            ways.append(frame.to(self.local(point), SX.eye(3)))
        if any(way is None for way in ways):
            return [None] * 3
        factors = [factor for _, factor in shares]
        return [
            WayProducts(
                tuple(WayProduct(w, e, None, f) for w, f in zip(ways, factors, strict=True))
            )
            for e in UNIT
        ]

    def turn_reaches(self, body: str) -> list[WayProducts | None]:
        """Return the reaches of the rotation matrix of a body, by columns."""
        frame: Any = self.frame(body)
        way = frame.to(SX(3, 1), SX.eye(3))
        if way is None:
            return [None] * 9
        return [WayProducts((WayProduct(way, row, column),)) for column in UNIT for row in UNIT]

    def relative_reach(self, joint: str, word: str) -> WayProducts | None:
        """Return the reach of a coordinate of a joint, None of angles and of screws of the tree."""
        coordinate = self._of.get((joint, word))
        if coordinate is not None and coordinate.unit == "m" and word in SLIDES:
            return WayProducts((WayProduct((Freedom("slide", (coordinate.symbol,)),), UNIT[Z]),))
        screw = (joint, "angle") in self._of and self._lead(joint) is not None
        if coordinate is not None or screw:
            return None
        return self.cut(joint).reach("xy".find(word) % 3)

    def driver_reach(self, coordinate: NamedCoordinate, u: Sym) -> WayProducts | None:
        if coordinate.kind == "point":
            known = self.point_reaches(f"{coordinate.part}.{coordinate.point}")[coordinate.axis]
        else:
            known = self.relative_reach(coordinate.part, coordinate.word)
        return None if known is None else replace(known, rest=known.rest - u)

    def sharing(self, owners: list[str]) -> list[str]:
        """Return with the cut joints those of their loops, in the order they are declared."""
        way = {edge.child: edge for edge in self.edges}

        def to_root(body: str) -> list[Edge]:
            found = []
            while body in way:
                found.append(way[body])
                body = way[body].parent
            return found

        names = set(owners)
        for owner in owners:
            if owner in self._cut_joints:
                first, second = (to_root(body) for body in self.mechanism.joints[owner].bodies[:2])
                names |= {
                    edge.joint for edge in (*first, *second) if (edge in first) != (edge in second)
                }
        declared = [name for name in self.mechanism.joints if name in names]
        return declared + [owner for owner in owners if owner not in declared]

    def groups(
        self, rows: Sequence[Row], coarse: bool = False, out: Collection[str] = ()
    ) -> list[Group]:
        """Return the Assur groups with this model's rows and coordinates, but of bodies `out`."""
        skeleton = self._skeleton()
        found = groups_of(skeleton, skeleton.driven(self.drivers)[0], coarse, out)
        stage = {body: k for k, group in enumerate(found) for body in group.bodies}
        numbers = body_numbers(self.mechanism)

        def latest(part: str) -> int:
            bodies = self.bodies_of(part)
            if {*bodies} & {*out}:
                return -1  # a list of its own
            return max((stage[b] for b in bodies if b in stage), default=0)

        part_of = {c.text: c.part for c in self.drivers}
        own_rows: list[list[int]] = [[] for _ in (*found, out)]
        columns: list[list[int]] = [[] for _ in (*found, out)]
        for i, row in enumerate(rows):
            owner = part_of.get(row.owner, row.owner)
            stays = self._placed.get(owner) if row.part in ("norm", "spin") else None
            own_rows[latest(stays or owner)].append(i)
        for j, c in enumerate(self.coordinates):
            part = c.owner if c.owner in self._cut_joints else self._placed[c.owner]
            columns[latest(part)].append(j)
        result = []
        for k, group in enumerate(found):
            links = [link for link in self.idle.values() if latest(link.name) == k]
            bodies = sorted(
                [*group.bodies, *(link.name for link in links)], key=numbers.__getitem__
            )
            joints = [*group.joints, *(name for link in links for name in link.others)]
            joints += [n for n in self._free_vectors() if n not in joints and latest(n) == k]
            result.append(
                replace(
                    group,
                    bodies=tuple(bodies),
                    joints=tuple(joints),
                    rows=tuple(own_rows[k]),
                    columns=tuple(columns[k]),
                    numbers=tuple(numbers[name] for name in bodies),
                    kind=group.kind if group.driven else spatial_kind(len(bodies)),
                )
            )
        return result
