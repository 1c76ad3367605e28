"""Where bodies and points are in each pose of a result."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.primitives import Array
from mechdae.errors import InputError, UnavailableError
from mechdae.records import dataclass
from mechdae.results.status import stretches
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results.result import Result


FOLDED = np.cos(np.deg2rad(12.0))
"""Two links closer than this at their common pin are hard to tell apart."""
IN_LINE = np.cos(np.deg2rad(25.0))
"""Two links in one line but for less than this are near a dead centre."""
CROWDED = 0.08
"""Joints closer than this share of the longest travel are hard to tell apart."""
BOOK = (30.0, 70.0)
"""Angle of the driver [deg] at which books draw a mechanism."""
SHORT = 4
"""Of so many poses or fewer the first one is drawn."""


@dataclass(frozen=True, kw_only=True)
class DrawnScene(PlacedScene):
    """Placements in the plane.

    Parameters
    ----------
    angles, origins
        By body, the ground included: (n,) rad and (n, 2) m, nan where not computed.
        Bodies of which no pose is known are absent.
    cylinders
        Names of the guides that are drawn as hydraulic cylinders.
    """

    angles: Mapping[str, Array]
    origins: Mapping[str, Array]
    cylinders: frozenset[str] = frozenset()

    @property
    def placed(self) -> Collection[str]:
        return self.origins.keys()

    def points(self, body: str) -> list[str]:
        names = self.mechanism.body(body).points if body in self.origins else ()
        return [f"{body}.{name}" for name in names]

    def track(self, reference: str) -> Array:
        known: dict[str, Array] = self._tracks
        if reference not in known:
            body = reference.split(".")[0]
            known[reference] = self.origins[body] + turned(self.angles[body], self.local(reference))
            known[reference].setflags(write=False)
        return known[reference]

    def place(self, reference: str, pose: int) -> Array:
        body = reference.split(".")[0]
        angle, (u, v) = float(self.angles[body][pose]), self.origins[body][pose].tolist()
        x, y = (self.numbers[f"{reference}.{axis}"] for axis in "xy")
        c, s = cos(angle), sin(angle)
        return np.array([u + c * x - s * y, v + s * x + c * y])

    def in_world(self, frame: str, vector: Array, pose: int) -> Array:
        """Return a vector of a frame, a body or ``world``, in the fixed frame."""
        return vector if frame == "world" else turned(self.angles[frame][[pose]], vector)[0]

    def carried(self, body: str, local: Array, pose: int) -> Array:
        place: Array = self.origins[body][pose] + self.in_world(body, local, pose)
        return place

    def direction(self, body: str, angle: float, pose: int) -> Array:
        """Return the unit vector at `angle` in the frame of `body`."""
        total = self.angles[body][pose] + angle
        return np.array([np.cos(total), np.sin(total)])

    def axis(self, joint: Joint, pose: int) -> Array:
        """Return the unit vector along the axis of a guide or a slot."""
        return self.direction(joint.first_body, self.numbers[f"{joint.name}.axis"], pose)

    def shown(self, body: str, pose: int) -> bool:
        return body in self._there and self._there[body][pose]

    @cached_property
    def _there(self) -> dict[str, list[bool]]:
        """By body, in which poses it has a placement."""
        return {
            body: (np.isfinite(self.angles[body]) & np.isfinite(origins).all(axis=-1)).tolist()
            for body, origins in self.origins.items()
        }

    @cached_property
    def _tracks(self) -> dict[str, Array]:
        return {}

    def known(self) -> Iterable[ArrayLike]:
        return self._there.values()

    def directions(self) -> Iterator[Array]:
        for angle in self.angles.values():
            yield np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def series(self, entry: NamedCoordinate) -> Array:
        unknown = np.full(len(self.status), np.nan)
        if entry.kind == "body angle":
            return self.angles.get(entry.part, unknown)
        if entry.kind == "point":
            known = entry.part in self.origins
            return self.track(f"{entry.part}.{entry.point}")[:, entry.axis] if known else unknown
        joint = self.mechanism.joints[entry.part]
        if entry.on_curve or not {joint.first_body, joint.second_body} <= set(self.origins):
            return unknown
        if entry.kind == "joint angle":
            return self.angles[joint.second_body] - self.angles[joint.first_body]
        return self.slide(joint)

    def slide(self, joint: Joint) -> Array:
        """Return how far the second point is along the joint's axis in each pose, (n,)."""
        axis = self.angles[joint.first_body] + self.numbers[f"{joint.name}.axis"]
        offset = self.track(joint.second) - self.track(joint.first)
        return offset[:, 0] * np.cos(axis) + offset[:, 1] * np.sin(axis)


def turned(angle: Array, vector: Array) -> Array:
    """Return `vector` turned by each angle, (n, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]], axis=-1)


def read_scene(result: Result) -> DrawnScene:
    """Return the placements that a result holds or implies.

    A body is placed by its angle and one point; what a task left out of its result is
    completed from other points of the body, from pins, welds and sliding pairs.

    Raises
    ------
    InputError
        A result without poses.
    UnavailableError
        A spatial mechanism.
    """
    mechanism: Mechanism = result.mechanism
    if mechanism.dimension != 2:
        raise UnavailableError("this picture is not drawn of spatial mechanisms by this version")
    status = tuple(str(entry) for entry in result.status)
    if not status:
        raise InputError("the result holds no pose to draw")
    n = len(status)
    angles, origins = {GROUND: np.zeros(n)}, {GROUND: np.zeros((n, 2))}
    for body in mechanism.bodies:
        if body in result.bodies:
            angles[body] = np.asarray(result.bodies[body].angle, dtype=float)
    for text, driver in (getattr(result, "drivers", None) or {}).items():
        body, _, rest = text.partition(".")
        if rest == "angle" and body in mechanism.bodies and body not in angles:
            angles[body] = np.asarray(driver.position, dtype=float)
    known = {key: np.asarray(entry.position, float) for key, entry in result.points.items()}
    scene = DrawnScene(
        mechanism=mechanism, numbers=mechanism.values(), angles=angles, origins=origins,
        status=status, cylinders=frozenset(_cylinders(mechanism, driver_names(result))),
        open=frozenset(gap["joint"] for gap in open_of(result)), turn=driven_turn(result),
    )  # fmt: skip
    while _complete(scene, angles, origins, known):
        pass
    return replace(scene, angles={body: angles[body] for body in origins})


def open_of(result: Result) -> list[Json]:
    """Return the joints of a pose that does not close: names, gaps, places."""
    return list((getattr(result, "summary", None) or {}).get("open", ()))


def driver_names(result: Result) -> list[str]:
    """Return the coordinates that a task drives, in a motion also those that it holds."""
    given = getattr(result, "drivers", None)
    if given:
        return list(given)
    listed = getattr(getattr(result, "definition", None), "drivers", None) or ()
    moving = getattr(result, "kind", "") in ("motion", "equilibrium")
    return [driver.coordinate for driver in listed] if moving else []


def _cylinders(mechanism: Mechanism, drivers: list[str]) -> Iterator[str]:
    """Yield the driven guides whose two links have one pin each, at the guide's points."""
    for joint in mechanism.joints.values():
        if not joint.guide or f"{joint.name}.slide" not in drivers:
            continue
        ends = ((joint.first_body, joint.first), (joint.second_body, joint.second))
        if all(_hangs(mechanism, joint, body, point) for body, point in ends):
            yield joint.name


def _hangs(mechanism: Mechanism, guide: Joint, body: str, point: str) -> bool:
    """Return whether a link has one joint beside its guide, a pin at the guide's point."""
    others = [
        joint for joint in mechanism.joints.values() if body in joint.bodies and joint != guide
    ]
    if body == GROUND or len(others) != 1 or not others[0].hinge:
        return False
    numbers = mechanism.values()
    side, _ = others[0].ends_at(body)
    return all(numbers[f"{side}.{axis}"] == numbers[f"{point}.{axis}"] for axis in "xy")


def _complete(
    scene: DrawnScene, angles: dict[str, Array], origins: dict[str, Array], known: dict[str, Array]
) -> bool:
    """Add what follows from the placements so far; return whether there was anything."""
    before = len(angles) + len(origins)
    for joint in scene.mechanism.joints.values():
        first, second = joint.first_body, joint.second_body
        turn = scene.numbers.get(f"{joint.name}.turn")
        if turn is not None and first in angles:
            angles.setdefault(second, angles[first] + turn)
        if turn is not None and second in angles:
            angles.setdefault(first, angles[second] - turn)
        if joint.coincide:
            for here, there in ((joint.first, joint.second), (joint.second, joint.first)):
                if here.split(".")[0] in origins and there not in known:
                    known[there] = scene.track(here)
    for reference, position in known.items():
        body = reference.split(".")[0]
        if body not in angles:
            _angle_from_points(scene, body, angles, known)
        if body in angles and body not in origins:
            origins[body] = position - turned(angles[body], scene.local(reference))
    return len(angles) + len(origins) > before


def _angle_from_points(
    scene: DrawnScene, body: str, angles: dict[str, Array], known: Mapping[str, Array]
) -> None:
    """Add the angle of a body of which two different points are known."""
    references = [entry for entry in known if entry.split(".")[0] == body]
    for other in references[1:]:
        local = scene.local(other) - scene.local(references[0])
        if np.hypot(*local) > 0:
            offset = known[other] - known[references[0]]
            angles[body] = np.arctan2(offset[:, 1], offset[:, 0]) - np.arctan2(local[1], local[0])
            return


def longest_run(poses: list[int]) -> list[int]:
    """Return the longest run of consecutive poses, the first of equally long ones."""
    runs = stretches(np.isin(np.arange(max(poses, default=-1) + 1), poses))
    return list(range(*max(runs, key=lambda ends: ends[1] - ends[0], default=(0, 0))))


def named_pose(n: int, pose: int) -> int:
    """Return the index of a pose that is asked for, of n, negative ones from the end.

    Raises
    ------
    InputError
        An index that the result does not have.
    """
    if isinstance(pose, bool) or not isinstance(pose, int | np.integer) or not -n <= pose < n:
        raise InputError(f"there is no pose {pose}", hint=f"a whole number from 0 to {n - 1}")
    return int(pose) % n


def choose_pose(scene: DrawnScene, kind: str, pose: int | None = None) -> int:
    """Return the index of the pose to draw.

    Without a wish: the first assembled pose of a few, or of a list of assembly modes; of a
    longer sweep one with the driver at `BOOK` degrees, in which the fewest pins lie on links that
    are not theirs, and links that share a pin are as far from one line as they can be. Where there
    is none the middle assembled pose, or the nearest to it in which neither two links nor two
    joints lie on each other; near the middle also one in which no two links are in line.

    Raises
    ------
    InputError
        An index that the result does not have.
    """
    n = len(scene.status)
    if pose is not None:
        return named_pose(n, pose)
    assembled = scene.assembled()
    if not assembled:
        return max(range(n), key=lambda k: sum(scene.shown(body, k) for body in scene.origins))
    if kind == "modes" or len(assembled) <= SHORT:
        return assembled[0]
    assembled = longest_run(assembled)
    middle = assembled[len(assembled) // 2]
    aligned = _aligned(scene)
    covered, stretched = (aligned[0] > FOLDED) | _crowded(scene), aligned[1] > IN_LINE
    shut = covered | (aligned[1] > FOLDED)
    open_ones = [k for k in in_book(scene.turn, assembled) if not shut[k]]
    if open_ones:
        behind = _behind(scene)
        return min(open_ones, key=lambda k: (behind[k], round(float(aligned[:, k].max()), 1)))
    far = len(assembled) // 6
    for unclear, most in ((covered | stretched, far), (covered, len(assembled))):
        clear = [index for index in assembled if not unclear[index]]
        best = min(clear, key=lambda index: abs(index - middle), default=None)
        if best is not None and abs(best - middle) <= most:
            return best
    return middle


def in_book(turn: Array | None, poses: Sequence[int]) -> list[int]:
    """Return poses with the driver where books draw it, the nearest to the middle of it first."""
    if turn is None:
        return []
    low, high = BOOK
    away = np.abs(np.rad2deg(turn) % 360.0 - (low + high) / 2)
    near = [k for k in poses if away[k] <= (high - low) / 2 + 1e-9]
    return sorted(near, key=lambda k: round(float(away[k]), 6))


def driven_turn(result: Result) -> Array | None:
    """Return the angle [rad] that the first moving driver gives, (n,); None of a length."""
    for text, driver in (getattr(result, "drivers", None) or {}).items():
        values = np.asarray(driver.position, dtype=float)
        if np.isfinite(values).any() and np.nanmax(values) > np.nanmin(values):
            return values if coordinate(result.mechanism, text).is_angle else None
    return None


def _aligned(scene: DrawnScene) -> Array:
    """Return how nearly two links that share a pin point the same way, and opposite ways, (2, n).

    One where they do.
    """
    pairs = [
        (first, second)
        for joint in scene.mechanism.joints.values()
        if joint.hinge and {joint.first_body, joint.second_body} <= set(scene.origins)
        for first in _arms(scene, joint.first)
        for second in _arms(scene, joint.second)
    ]
    if not pairs:
        return np.zeros((2, len(scene.status)))
    x, y = np.moveaxis(np.array(pairs), -1, 0)
    cosine = x[:, 0] * x[:, 1] + y[:, 0] * y[:, 1]
    found: Array = np.nan_to_num([cosine.max(axis=0), (-cosine).max(axis=0)])
    return found


def _crowded(scene: DrawnScene) -> NDArray[np.bool_]:
    """Return in which poses two joints that are apart elsewhere come together."""
    joints = [j for j in scene.mechanism.joints.values() if {*j.bodies[:2]} <= {*scene.origins}]
    result = np.zeros(len(scene.status), dtype=bool)
    known = scene.assembled()
    if len(joints) < 2 or not known:
        return result
    tracks = np.array([scene.track(joint.second)[known] for joint in joints])
    reach = CROWDED * float(np.ptp(tracks, axis=1).max())
    x, y = np.moveaxis(tracks / (reach or 1.0), -1, 0)
    for i in range(len(tracks) - 1):
        apart = (x[i] - x[i + 1 :]) ** 2 + (y[i] - y[i + 1 :]) ** 2
        moving = apart.max(axis=1) > 1.0
        result[known] |= (apart[moving] < 1.0).any(axis=0)
    return result


def _behind(scene: DrawnScene) -> NDArray[np.intp]:
    """Return on how many links that are not theirs pins lie in each pose, (n,)."""
    joints, known = scene.mechanism.joints.values(), set(scene.origins)
    hinges = [joint for joint in joints if joint.hinge and joint.second_body in known]
    result = np.zeros(len(scene.status), dtype=np.intp)
    pins = np.array([scene.track(joint.second) for joint in hinges])
    for body in set(scene.mechanism.bodies) & known if hinges else ():
        foreign = pins[[body not in joint.bodies for joint in hinges]]
        tracks = [scene.track(point) for point in scene.points(body)]
        for a, b in itertools.combinations(tracks, 2):
            way, arm = b - a, foreign - a
            square = np.maximum((way**2).sum(axis=1), 1e-300)
            along = (arm * way).sum(axis=-1) / square
            off = np.abs(arm[..., 0] * way[:, 1] - arm[..., 1] * way[:, 0]) / square
            result += ((off < CROWDED / 2) & (np.abs(along - 0.5) < 0.5 - CROWDED)).sum(axis=0)
    return result


def _arms(scene: DrawnScene, reference: str) -> list[Array]:
    """Return the unit vectors from a point to the other points of its body."""
    body = reference.split(".")[0]
    if body == GROUND:
        return []
    pin = scene.track(reference)
    arms = []
    for point in scene.points(body):
        length = float(np.hypot(*(scene.local(point) - scene.local(reference))))
        if length > 0:
            arms.append((scene.track(point) - pin) / length)
    return arms
