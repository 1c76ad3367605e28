"""A body held at three points, each led on a circle or a line: 3-RPS, 3-PRS, 3-RRS, 6-3 platforms.

A leg is a row of bodies on hinges and guides of which one is free, with a ball joint at its end:
its centre moves on a circle or a line of the body at its other end. Two distances from one point
are a leg too: a circle about the line through their other ends. Legs begin all on known bodies, and
lead points of the platform, or all on the platform, and lead known points.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import casadi as ca
import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.equations.coordinates import QUATERNION
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupPoses,
    OtherShape,
    ShapedGroup,
)
from mechdae.motion.cases.space.triangle import MOST, PAIRS, PointCourse, triangles
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.records import dataclass
from mechdae.types import Floats, Matrix, Sym

if TYPE_CHECKING:
    from mechdae.equations.tree.tree_model import TreeModel

SX = ca.SX


class Rod(NamedTuple):
    """A bar, or a link that spins between two balls: its ends and its length."""

    first: str
    second: str
    length: Sym

    def ends(self, hub: str, group: Group) -> tuple[str, str]:
        """Return the end on a body and the one on a known body; `OtherShape` for other rods."""
        on = [end for end in self[:2] if end.split(".")[0] == hub]
        off = [end for end in self[:2] if end.split(".")[0] not in group.bodies]
        if len(on) != 1 or len(off) != 1:
            raise OtherShape
        return on[0], off[0]


class RodsAndJoints:
    """What a group is made of: rods, other bodies, and joints but those of links that spin."""

    def __init__(self, model: Any, group: Group) -> None:
        idle, joints = getattr(model, "idle", {}), model.mechanism.joints
        spun = {name for link in idle.values() for name in (link.joint, *link.others)}
        self.bodies: list[str] = [body for body in group.bodies if body not in idle]
        self.joints: list[Joint] = [joints[name] for name in group.joints if name not in spun]
        self.rods: list[Rod] = [
            Rod._make((*idle[b].ends, model.length(idle[b]))) for b in group.bodies if b in idle
        ]
        self.rods += [
            Rod(j.first, j.second, model.numbers[f"{j.name}.length"]) for j in self.joints if j.bar
        ]


def both_sides(joints: Iterable[str]) -> dict[str, tuple[str, bool]]:
    """Return the sides of joints to ask `KnownSides` for: ``first NAME``, ``second NAME``."""
    words = (("first", False), ("second", True))
    return {f"{word} {name}": (name, second) for name in joints for word, second in words}


def triad(along: Floats, beside: Floats) -> Floats:
    """Return a frame (3, 3) whose first axis leads along, its second one in the plane of both."""
    x = along / np.linalg.norm(along)
    y = beside - (beside @ x) * x
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


class KnownSides:
    """Where a group's joints lie: in the fixed frame on bodies solved earlier, else in the body.

    Parameters
    ----------
    places
        Points ``body.point`` by name of what they are for.
    sides
        (joint, whether it is its second side) by name: the point and the frame [n, m, a] there.
    numbers
        Expressions over the parameters by name.
    """

    def __init__(
        self,
        scene: Scene,
        group: Group,
        p: Floats,
        places: Mapping[str, str],
        sides: Mapping[str, tuple[str, bool]],
        numbers: Mapping[str, Sym],
    ) -> None:
        self.scene, self.p = scene, p
        model: Any = scene.model
        parts: dict[str, Sym] = {}
        for name, reference in places.items():
            parts[name] = self._point(model, group, reference)
        for name, (joint, second) in sides.items():
            reference = model.mechanism.joints[joint].second if second else (
                model.mechanism.joints[joint].first
            )  # fmt: skip
            C, body = model._side(joint, second), reference.split(".")[0]
            turned = C if body in group.bodies else model.frame(body).side(C)
            parts[name] = ca.horzcat(self._point(model, group, reference), turned)
        parts |= {name: SX(value) for name, value in numbers.items()}
        self._names = list(parts)
        self._shapes = [part.shape for part in parts.values()]
        stacked = ca.vertcat(*[ca.vec(part) for part in parts.values()])
        self._function = ca.Function("sides", [model.q, model.p], [ca.densify(stacked)])

    def _point(self, model: TreeModel, group: Group, reference: str) -> Sym:
        if reference.split(".")[0] in group.bodies:
            return model.local(reference)
        return model.point(reference)

    def at(self, q: Coordinates) -> dict[str, Matrix]:
        """Return arrays by name at the coordinates of earlier groups."""
        values = [q.get(key, 0.0) for key in self.scene.model.q_names]
        found = np.array(self._function(values, self.p)).ravel()
        result, start = {}, 0
        for name, (rows, columns) in zip(self._names, self._shapes, strict=True):
            size = rows * columns
            result[name] = found[start : start + size].reshape(columns, rows).T
            start += size
        return result


READ = {"angle", "slide", "x", "y", *QUATERNION}


class TreeCoordinates:
    """What a group's unknowns are at a pose of its bodies; raises `OtherShape` for other ones."""

    def __init__(self, scene: Scene, group: Group) -> None:
        self.model: Any = scene.model
        joints, blocks = self.model.mechanism.joints, scene.blocks
        unknowns = {i for block in blocks if block.group == group.index for i in block.x}
        self.names: list[tuple[str, str]] = [scene.x_names[i] for i in sorted(unknowns)]
        self.joints = [joints[o] for o in dict.fromkeys(o for o, _ in self.names) if o in joints]
        self.bodies: list[str] = [
            o for o in dict.fromkeys(o for o, _ in self.names) if o not in joints
        ]
        plain = all(not getattr(joint, "crossed", False) for joint in self.joints)
        if not plain or not {word for _, word in self.names} <= {*READ, "z"}:
            raise OtherShape

    @property
    def sides(self) -> dict[str, tuple[str, bool]]:
        """The sides to ask `KnownSides` for."""
        return both_sides(joint.name for joint in self.joints)

    def read(
        self, at: Mapping[str, Floats], frames: Mapping[str, tuple[Floats, Floats]]
    ) -> dict[tuple[str, str], float]:
        """Return the coordinates by name.

        Parameters
        ----------
        at
            What `KnownSides` gives: sides on bodies of `frames` are in the body, others in space.
        frames
            Place (3,) of the anchor and rotation (3, 3) of each body of the group.
        """
        found: dict[tuple[str, str], float] = {}
        for joint in self.joints:
            sides = []
            for word, body in zip(("first", "second"), joint.bodies, strict=True):
                side = at[f"{word} {joint.name}"]
                r, R = frames.get(body, (np.zeros(3), np.eye(3)))
                sides.append((r + R @ side[:, 0], R @ side[:, 1:]))
            (p, A), (q, B) = sides
            Q, t = A.T @ B, A.T @ (q - p)
            values = dict(zip(("x", "y", "slide"), t, strict=True))
            values["angle"] = np.arctan2(Q[1, 0], Q[0, 0])
            values |= dict(zip(QUATERNION, quaternions(Q[None])[0], strict=True))
            found |= {(joint.name, word): float(value) for word, value in values.items()}
        for body in self.bodies:
            r, R = frames[body]
            values = dict(zip("xyz", r, strict=True))
            values |= dict(zip(QUATERNION, quaternions(R[None])[0], strict=True))
            found |= {(body, word): float(value) for word, value in values.items()}
        return {name: found[name] for name in self.names}


BASIS = "elimination: {} complex poses are certified, as many as there can be"
NONE = "two legs at one point do not meet"
LEAST = 1e-9
"""Share of the size below which a radius, or the height of a triangle, is none."""


@dataclass(frozen=True)
class LegChain:
    """Joints from one body to a ball, and whether each leads on from its first side.

    ``free`` is the number of the one that no driver holds.
    """

    joints: tuple[tuple[Joint, bool], ...]
    free: int
    tip: str
    other: str


@dataclass(frozen=True)
class TwoBars:
    """Distances from one point (``other``) to two of one body: their ends and numbers by name."""

    ends: tuple[str, str]
    lengths: tuple[str, str]
    other: str


class ThreePoints(ShapedGroup):
    """A body on three legs of one freedom with balls at their ends."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        model: Any = scene.model
        if group.superfluous or model.mechanism.closure is not None:
            raise OtherShape
        self.group, self.joints = group, model.mechanism.joints
        self.parts: RodsAndJoints = RodsAndJoints(model, group)
        self._read_drivers(scene)
        self.places: dict[str, str] = {}
        self.numbers: dict[str, object] = {}
        self.hub, self.inward, self.legs = self._legs()
        self.tree: TreeCoordinates = TreeCoordinates(scene, group)
        chained = [j.name for leg in self.legs if isinstance(leg, LegChain) for j, _ in leg.joints]
        sides = both_sides(chained) | self.tree.sides
        self.sides: KnownSides = KnownSides(scene, group, p, self.places, sides, self.numbers)

    def _read_drivers(self, scene: Scene) -> None:
        """Sort the group's drivers by the joint whose one coordinate they hold."""
        self.driven: dict[str, int] = {}
        count = len(scene.model.rows)
        for k, c in enumerate(scene.drivers):
            if count + k not in self.group.rows and c.part not in self.group.joints:
                continue
            if c.part not in self.joints or self.joints[c.part].coordinates != (c.word,):
                raise OtherShape
            self.driven[c.part] = k

    # -- what the legs are -----------------------------------------------------------------

    def _legs(self) -> tuple[str, bool, list[LegChain | TwoBars]]:
        """Return the body, whether legs begin on it, and the legs."""
        for hub in self.parts.bodies:
            for inward in (False, True):
                try:
                    return hub, inward, self._legs_of(hub, inward)
                except OtherShape:
                    continue
        raise OtherShape

    def _legs_of(self, hub: str, inward: bool) -> list[LegChain | TwoBars]:
        self.places, self.numbers = {}, {}
        used, bodies, legs = set[str](), {hub}, list[LegChain | TwoBars]()
        for ball in (j for j in self.parts.joints if j.ball):
            leg = self._chain(ball, hub, inward, len(legs))
            used |= {ball.name, *(joint.name for joint, _ in leg.joints)}
            bodies |= {body for joint, _ in leg.joints for body in joint.bodies}
            legs.append(leg)
        legs += self._pairs(hub, inward, len(legs))
        every = {joint.name for joint in self.parts.joints if not joint.bar}
        if len(legs) != 3 or used != every or not bodies >= {*self.parts.bodies}:
            raise OtherShape
        return legs

    def _chain(self, ball: Joint, hub: str, inward: bool, number: int) -> LegChain:
        """Return the leg behind a ball joint, from the body where it begins on."""
        ends = {end.split(".")[0]: end for end in (ball.first, ball.second)}
        outer = [
            body for body in ends if (body not in self.group.bodies if inward else body == hub)
        ]
        if len(outer) != 1 or len(ends) != 2:
            raise OtherShape
        (here,) = (body for body in ends if body not in outer)
        tip, other = f"tip {number}", f"point {number}"
        self.places |= {tip: ends[here], other: ends[outer[0]]}
        row, last = list[tuple[Joint, bool]](), ball
        while here in self.group.bodies and (not inward or here != hub):
            after = [j for j in self.parts.joints if here in j.bodies and j is not last]
            if here == hub or len(after) != 1 or after[0].ball or after[0].bar:
                raise OtherShape
            last = after[0]
            row.append((last, last.second_body == here))
            here = last.first_body if last.second_body == here else last.second_body
        if inward and here != hub:
            raise OtherShape
        row.reverse()
        free = [k for k, (joint, _) in enumerate(row) if self._is_free(joint)]
        if len(free) != 1:
            raise OtherShape
        return LegChain(tuple(row), free[0], tip, other)

    def _is_free(self, joint: Joint) -> bool:
        if joint.rigid:
            return False
        if len(joint.coordinates) != 1 or not (joint.turns or joint.slides):
            raise OtherShape
        return joint.name not in self.driven

    def _pairs(self, hub: str, inward: bool, number: int) -> list[LegChain | TwoBars]:
        """Return the pairs of distances with a common point."""
        met: dict[str, list[tuple[str, Sym]]] = {}
        for rod in self.parts.rods:
            on, off = rod.ends(hub, self.group)
            point, other = (off, on) if inward else (on, off)
            met.setdefault(point, []).append((other, rod.length))
        found: list[LegChain | TwoBars] = []
        for k, (point, bars) in enumerate(met.items(), start=number):
            if len(bars) != 2:
                raise OtherShape
            names = [(f"end {k} {i}", f"length {k} {i}") for i in (0, 1)]
            self.places[f"point {k}"] = point
            for (end, length), (other, value) in zip(names, bars, strict=True):
                self.places[end], self.numbers[length] = other, value
            found.append(
                TwoBars((names[0][0], names[1][0]), (names[0][1], names[1][1]), f"point {k}")
            )
        return found

    # -- all poses -------------------------------------------------------------------------

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses | None:
        """Return all poses, None where legs lead points nowhere."""
        at = self.sides.at(q)
        points = np.stack([at[leg.other].ravel() for leg in self.legs])
        sizes = [float(np.linalg.norm(points[i] - points[j])) for i, j in PAIRS]
        area = np.linalg.norm(np.cross(points[1] - points[0], points[2] - points[0]))
        if not area > LEAST * max(sizes) ** 2:
            return None
        courses = [
            self._led(at, leg, u, max(sizes)) if isinstance(leg, LegChain) else _circle(at, leg)
            for leg in self.legs
        ]
        if any(course is None for course in courses):
            return None
        known = [course for course in courses if isinstance(course, PointCourse)]
        if len(known) < len(courses):  # two spheres that do not meet
            return GroupPoses([], True, NONE, generic=MOST[0], bounded=True)
        if not all(course.straight or course.size > LEAST * max(sizes) for course in known):
            return None
        found = triangles(known, sizes)
        if found is None:
            return None
        poses = [self._pose(at, known, values, points, u) for values in found.values]
        return GroupPoses(
            poses,
            found.proven,
            BASIS.format(found.most) if found.proven else "",
            generic=found.most,
            singular=found.most - found.regular,
            bounded=True,
            by="elimination",
        )

    def _value(self, joint: Joint, u: Floats, free: float) -> float:
        if joint.rigid:
            return 0.0
        return float(u[self.driven[joint.name]]) if joint.name in self.driven else free

    def _walk(
        self, at: Mapping[str, Floats], leg: LegChain, u: Floats, free: float
    ) -> dict[str, tuple[Floats, Floats]]:
        """Return places and rotations of a leg's bodies, seen from where it begins."""
        frames, here = dict[str, tuple[Any, Any]](), (np.zeros(3), np.eye(3))
        for joint, forward in leg.joints:
            near, far = ("first", "second") if forward else ("second", "first")
            side, point = at[f"{near} {joint.name}"], at[f"{far} {joint.name}"]
            r, R = here
            place, A = r + R @ side[:, 0], R @ side[:, 1:]
            value = self._value(joint, u, free) * (1 if forward else -1)
            if joint.slides:
                place = place + A[:, 2] * value
            elif joint.turns:
                c, s = np.cos(value), np.sin(value)
                A = A @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            turned = A @ point[:, 1:].T
            here = (place - turned @ point[:, 0], turned)
            frames[joint.second_body if forward else joint.first_body] = here
        return frames

    def _led(self, at: Mapping[str, Floats], leg: LegChain, u: Floats, size: float) -> PointCourse:
        """Return the circle or line of a leg's end, its value in the sense of the free joint."""
        joint, forward = leg.joints[leg.free]
        tip = at[leg.tip].ravel()

        def end(value: float) -> tuple[Floats, Floats, Floats]:
            frames = self._walk(at, leg, u, value)
            last, _ = leg.joints[-1]
            body = last.second_body if leg.joints[-1][1] else last.first_body
            r, R = frames[body]
            near = at[f"{'first' if forward else 'second'} {joint.name}"]
            start = leg.joints[leg.free - 1] if leg.free else None
            s, S = (np.zeros(3), np.eye(3))
            if start is not None:
                s, S = frames[start[0].second_body if start[1] else start[0].first_body]
            return r + R @ tip, s + S @ near[:, 0], S @ near[:, 3]

        place, pivot, axis = end(0.0)
        axis = axis if forward else -axis
        if joint.slides:
            across = np.linalg.svd(axis[None])[2][1:].T
            return PointCourse(place, np.column_stack([axis, across]), size, True)
        arm = place - pivot
        out = arm - (arm @ axis) * axis
        radius = float(np.linalg.norm(out))
        along = out / radius if radius > 0 else np.linalg.svd(axis[None])[2][1]
        frame = np.column_stack([along, np.cross(axis, along), axis])
        return PointCourse(pivot + (arm @ axis) * axis, frame, radius)

    def _pose(
        self,
        at: Mapping[str, Floats],
        courses: list[PointCourse],
        values: Floats,
        points: Floats,
        u: Floats,
    ) -> dict[tuple[str, str], float]:
        """Return a pose as coordinates, from the values of the three legs."""
        ends = np.stack([course.at(value) for course, value in zip(courses, values, strict=True)])
        base, moved = (ends, points) if not self.inward else (points, ends)
        fixed, turned = (triad(p[1] - p[0], p[2] - p[0]) for p in (base, moved))
        R = fixed @ turned.T
        r = base.mean(axis=0) - R @ moved.mean(axis=0)
        frames = {self.hub: (r, R)}
        for leg, value in zip(self.legs, values, strict=True):
            if not isinstance(leg, LegChain):
                continue
            for body, (s, S) in self._walk(at, leg, u, float(value)).items():
                frames[body] = (r + R @ s, R @ S) if self.inward else (s, S)
        return self.tree.read(at, frames)


def _circle(at: Mapping[str, Floats], leg: TwoBars) -> PointCourse | bool | None:
    """Return where two spheres meet: a circle, False where they do not, None where they touch."""
    (a, b), (L, M) = (
        (at[end].ravel() for end in leg.ends),
        (float(at[n].item()) for n in leg.lengths),
    )
    gap = float(np.linalg.norm(b - a))
    scale = (L + M + gap) ** 2
    if not gap > LEAST * (L + M):
        return None
    axis = (b - a) / gap
    height = (gap**2 + L**2 - M**2) / (2 * gap)
    square = L**2 - height**2
    if abs(square) <= LEAST * scale:
        return None
    if square < 0:
        return False
    along, across = np.linalg.svd(axis[None])[2][1:]
    if np.cross(along, across) @ axis < 0:
        across = -across
    return PointCourse(
        a + height * axis, np.column_stack([along, across, axis]), float(np.sqrt(square))
    )
