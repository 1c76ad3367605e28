"""Where the bodies and points of a spatial mechanism are in each pose of a result."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import AXES, SpatialJoint, largest
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.scene import driven_turn
from mechdae.draw.space.viewpoint import Array
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.results.rotations import matrices

if TYPE_CHECKING:
    from mechdae.results import SweepResult


@dataclass(frozen=True, kw_only=True)
class SpatialScene(PlacedScene):
    """Placements in space.

    Parameters
    ----------
    turns
        By body, the ground included: rotation matrices (n, 3, 3), nan where not known. Links that
        spin freely and the points of vectors have none.
    tracks
        By ``body.point``: positions (n, 3) m, nan where not known.
    coordinates
        By name: values (n,) of the joint coordinates that are known.
    """

    turns: Mapping[str, Array]
    tracks: Mapping[str, Array]
    coordinates: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def helpers(self) -> set[str]:
        """The bodies that are not drawn, see `pose_chains`."""
        return pose_chains(self.mechanism)

    @cached_property
    def placed(self) -> set[str]:
        """The bodies of which a point is known in some pose, and the ground."""
        return {
            GROUND,
            *(ref.split(".")[0] for ref, track in self.tracks.items() if np.isfinite(track).any()),
        }

    def track(self, reference: str) -> Array:
        return self.tracks[reference]

    def place(self, reference: str, pose: int) -> Array:
        place: Array = self.tracks[reference][pose]
        return place

    def origin(self, body: str) -> Array:
        """Return where the origin of a body's frame is, (n, 3)."""
        reference = self.points(body)[0]
        arm: Array = self.turns[body] @ self.local(reference)
        return self.tracks[reference] - arm

    def in_world(self, frame: str, vector: Array, pose: int) -> Array | None:
        """Return a vector of a frame in the fixed frame, None where that is not known."""
        if frame == "world":
            return vector
        if frame not in self.turns or not np.isfinite(self.turns[frame][pose]).all():
            return None
        turned: Array = self.turns[frame][pose] @ vector
        return turned

    def carried(self, body: str, local: Array, pose: int) -> Array:
        known = self.points(body)
        arm = self.in_world(body, local - self.local(known[0]), pose) if known else None
        return np.full(3, np.nan) if arm is None else self.place(known[0], pose) + arm

    def points(self, body: str) -> list[str]:
        names = self.mechanism.body(body).points
        return [f"{body}.{name}" for name in names if f"{body}.{name}" in self.tracks]

    def shown(self, body: str, pose: int) -> bool:
        """Return whether a point of the body has a place in that pose."""
        return body == GROUND or any(
            bool(np.isfinite(self.tracks[ref][pose]).all()) for ref in self.points(body)
        )

    def has(self, joint: Joint, pose: int) -> bool:
        """Return whether both points of a joint have places."""
        tracks = [self.tracks.get(side) for side in (joint.first, joint.second)]
        return all(track is not None and np.isfinite(track[pose]).all() for track in tracks)

    def known(self) -> Iterable[ArrayLike]:
        return (np.isfinite(track).all(axis=-1) for track in self.tracks.values())

    def directions(self) -> Iterator[Array]:
        yield from self.turns.values()

    def frame(self, joint: Joint, pose: int, second: bool = False) -> Array | None:
        """Return normal, across and axis of a side of a joint as rows (3, 3), in the fixed frame.

        None for joints without directions, and where the body's orientation is not known: then
        the other side's frame is tried by the caller.
        """
        given = dict(joint.directions()) if isinstance(joint, SpatialJoint) else {}
        body = joint.second_body if second else joint.first_body
        if not given or body not in self.turns:
            return None
        axis, zero = joint.side(second)  # type: ignore[attr-defined]
        a = self._vector(f"{joint.name}.{axis}")
        n = np.eye(3)[(largest(tuple(a)) + 1) % 3]
        if zero is not None:
            n = self._vector(f"{joint.name}.{zero}")
        a = a / np.linalg.norm(a)
        n = n - a * (a @ n)
        n = n / np.linalg.norm(n)
        rows: Array = np.array([n, np.cross(a, n), a]) @ self.turns[body][pose].T
        return rows if np.isfinite(rows).all() else None

    def holder(self, joint: Joint, pose: int) -> str:
        """Return the body in which the axis of a joint is known."""
        known = self.frame(joint, pose) is not None
        return joint.first_body if known else joint.second_body

    def axis(self, joint: Joint, pose: int, second: bool = False) -> Array | None:
        """Return the axis (3,) of a joint's side in the fixed frame, of either side if need be."""
        sides = (second,) if getattr(joint, "crossed", False) else (second, not second)
        for side in sides:
            frame = self.frame(joint, pose, side)
            if frame is not None:
                last: Array = frame[2]
                return last
        return None

    def series(self, entry: NamedCoordinate) -> Array:
        track = self.tracks.get(f"{entry.part}.{entry.point}") if entry.kind == "point" else None
        if track is not None:
            return track[:, entry.axis]
        return self.coordinates.get(entry.text, np.full(len(self.status), np.nan))

    def along(self, joint: Joint, pose: int) -> float:
        """Return how far the second point is along the joint's axis [m]."""
        axis = self.axis(joint, pose)
        gap = self.place(joint.second, pose) - self.place(joint.first, pose)
        return 0.0 if axis is None else float(gap @ axis)

    @cached_property
    def travels(self) -> dict[str, list[float]]:
        """By straight joint how far it slides [m] in the poses that are assembled."""
        joints = [
            joint
            for joint in self.mechanism.joints.values()
            if joint.straight and {joint.first, joint.second} <= self.tracks.keys()
        ]
        known = {pair.name: [self.along(pair, k) for k in self.assembled()] for pair in joints}
        return {name: [way for way in ways if np.isfinite(way)] for name, ways in known.items()}

    def _vector(self, name: str) -> Array:
        return np.array([self.numbers[f"{name}.{axis}"] for axis in AXES])


def read_spatial(result: Any) -> SpatialScene:
    """Return the placements that a result holds.

    Raises
    ------
    InputError
        A result without poses.
    """
    mechanism: Mechanism = result.mechanism
    status = tuple(str(entry) for entry in result.status)
    if not status:
        raise InputError("the result holds no pose to draw")
    count, values = len(status), mechanism.values()
    turns: dict[str, Array] = {GROUND: np.broadcast_to(np.eye(3), (count, 3, 3))}
    for body, series in result.bodies.items():
        if "orientation" in series:
            turns[body] = matrices(np.asarray(series.orientation, dtype=float))
    tracks: dict[str, Array] = {
        ref: np.asarray(point.position, dtype=float)
        for ref, point in result.points.items()
        if "position" in point
    }
    given, turn = _coordinates(result), driven_turn(result)
    scene = SpatialScene(
        mechanism=mechanism, numbers=values, turns=turns, tracks=tracks, status=status,
        coordinates=given, turn=turn,
    )  # fmt: skip
    for name in mechanism.ground.points:
        ref = f"{GROUND}.{name}"
        tracks[ref] = np.broadcast_to(scene.local(ref), (count, 3))
    ways = _vectors(result, values)
    while _complete(scene, tracks, ways):
        pass
    for ref in [ref for ref in tracks if ref.split(".")[0] in scene.helpers]:
        del tracks[ref]
    return scene


def pose_chains(mechanism: Mechanism) -> set[str]:
    """Return the bodies of chains that only give the pose of a body, and constrain nothing.

    They are three slides and three turns from the ground to a body that others hold; their bodies
    have no masses and no extent.
    """
    joints, values = mechanism.joints.values(), mechanism.values()
    at = {body: [joint for joint in joints if body in joint.bodies] for body in mechanism.bodies}

    def empty(body: str) -> bool:
        points = mechanism.bodies[body].points
        places = np.array([[values[f"{body}.{point}.{x}"] for x in AXES] for point in points])
        extent = float(np.ptp(places, axis=0).max()) if len(places) else 0.0
        return mechanism.bodies[body].mass is None and len(at[body]) == 2 and extent == 0.0

    found = set[str]()
    for joint in joints:
        chain, ways, before = list[str](), list[bool](), GROUND
        while before in joint.bodies:
            ways.append(joint.turns or joint.freedoms > 1)
            body = joint.second_body if joint.first_body == before else joint.first_body
            if body == GROUND or not empty(body):
                break
            chain.append(body)
            before, joint = body, next(further for further in at[body] if further is not joint)
        if ways == [False] * 3 + [True] * 3 and body != GROUND and len(at[body]) > 2:
            found.update(chain)
    return found


def _coordinates(result: SweepResult) -> dict[str, Array]:
    """Return the joint coordinates that a result holds, (n,) each, by name."""
    found = {
        f"{name}.{word}": np.asarray(series[word], dtype=float)
        for name, series in result.joints.items()
        for word in result.mechanism.joints[name].coordinates
        if word in series
    }
    driven = {
        name: np.asarray(series.position, dtype=float) for name, series in result.drivers.items()
    }
    return found | driven


def _vectors(result: SweepResult, values: Mapping[str, float]) -> dict[str, Array]:
    """Return the ways (n, 3) from tail to head of the vectors whose coordinates are known."""
    found = {}
    for joint in result.mechanism.joints.values():
        if not joint.pointer:
            continue
        parts: list[Any] = []
        for word in ("length", "elevation", "azimuth"):
            name = f"{joint.name}.{word}"
            if name in result.drivers:
                parts.append(np.asarray(result.drivers[name].position, dtype=float))
            elif word in joint.coordinates:
                known = result.joints.get(joint.name, {})
                if word in known:
                    parts.append(np.asarray(known[word], dtype=float))
            elif name in values:
                parts.append(values[name])
        if len(parts) == 3:
            length, e, a = parts
            level = length * np.cos(e)
            x, y, z = level * np.cos(a), length * np.sin(e), level * np.sin(a)
            way = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
            found[joint.name] = np.broadcast_to(way, (len(result.status), 3))
    return found


def _complete(scene: SpatialScene, tracks: dict[str, Array], ways: Mapping[str, Array]) -> bool:
    """Add points that follow from those known so far; return whether there was one."""
    before = len(tracks)
    for joint in scene.mechanism.joints.values():
        if joint.coincide:
            for here, there in ((joint.first, joint.second), (joint.second, joint.first)):
                if here in tracks:
                    tracks.setdefault(there, tracks[here])
        if joint.name in ways:
            here, there, way = joint.first, joint.second, ways[joint.name]
            if here in tracks:
                tracks.setdefault(there, tracks[here] + way)
            if there in tracks:
                tracks.setdefault(here, tracks[there] - way)
    for name, body in scene.mechanism.bodies.items():
        known = [ref for ref in (f"{name}.{point}" for point in body.points) if ref in tracks]
        if not known or name not in scene.turns:
            continue
        origin = tracks[known[0]] - scene.turns[name] @ scene.local(known[0])
        for point in body.points:
            ref = f"{name}.{point}"
            if ref not in tracks:
                tracks[ref] = origin + scene.turns[name] @ scene.local(ref)
    return len(tracks) > before
