"""Instant centres of pairs of bodies, and centrodes: their paths in both planes.

With velocities v of two body-fixed points that are at X0 and angular velocities omega, the
points at rest relative to each other lie at X0 + k x (v2 - v1) / (omega2 - omega1).
"""

from __future__ import annotations

import itertools
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.equations.reduction import Scene
from mechdae.errors import InputError
from mechdae.motion.measures.along_sweep_extremes import AT_REST, stops, travel
from mechdae.motion.measures.track import SAME, Track
from mechdae.motion.setup.outputs import Outputs, Request
from mechdae.types import Floats, Json, Points

FRAME, PIN = "frame of ", "pin "
FAR = 1e12
"""Lengths of the mechanism beyond which a centre is at infinity."""
MOST = 20_000_000
"""Numbers that all instant centres together may have."""
NEAR = 1e-6
"""Share of the driver's unit within which two places are one: the end of a rest is no sharper."""


def bodies_of(scene: Scene) -> list[str]:
    """Return the bodies of a scene in declared order."""
    inside = {name for group in scene.groups for name in group.bodies}
    return [name for name in scene.model.mechanism.bodies if name in inside]


def requests(scene: Scene, pairs: bool) -> list[Request]:
    """Return anchor and angle of each body, with `pairs` also the pins between them."""
    model = scene.model
    found: list[Request] = []
    inside = bodies_of(scene)
    for name in inside:
        frame = model.frame(name)
        found.append((FRAME + name, ca.vertcat(frame.r, frame.angle), (name,)))
    for name, joint in model.mechanism.joints.items() if pairs else ():
        bodies = tuple(body for body in joint.bodies if body != GROUND)
        if joint.hinge and set(bodies) <= set(inside):
            found.append((PIN + name, model.point(joint.first), bodies))
    return found


class Planes:
    """Places, velocities and turns of all bodies at poses.

    `values` are y, y' of the poses; a body's point is its anchor.
    """

    def __init__(self, outputs: Outputs, values: list[Floats], scale: float) -> None:
        self.outputs, self.scale, self.count = outputs, scale, len(values[0])
        model = outputs.scene.model
        self.anchors: dict[str, Floats] = {}
        self.place: dict[str, Any] = {GROUND: np.zeros((self.count, 2))}
        self.speed: dict[str, Points] = {GROUND: np.zeros((self.count, 2))}
        self.angle: dict[str, Floats] = {GROUND: np.zeros(self.count)}
        self.turn: dict[str, Any] = {GROUND: np.zeros(self.count)}
        self.pins: dict[frozenset[str], Points] = {}
        self.pinned: set[str] = {
            name for name in bodies_of(outputs.scene) if is_pinned(outputs.scene, name)
        }
        numbers = model.mechanism.values()
        for entry in outputs.entries:
            columns = list(entry.columns)
            if entry.kind == "hidden" and entry.part.startswith(FRAME):
                name = entry.part.removeprefix(FRAME)
                point = model.anchor(name)
                local = [numbers[f"{name}.{point}.{axis}"] if point else 0.0 for axis in "xy"]
                self.anchors[name] = np.array(local)
                self.place[name], self.speed[name] = (array[:, columns[:2]] for array in values)
                self.angle[name], self.turn[name] = (array[:, columns[2]] for array in values)
            elif entry.kind == "hidden" and entry.part.startswith(PIN):
                joint = model.mechanism.joints[entry.part.removeprefix(PIN)]
                self.pins[frozenset((joint.first_body, joint.second_body))] = values[0][:, columns]

    @property
    def bodies(self) -> list[str]:
        return list(self.anchors)

    def centre(self, first: str, second: str) -> Any:
        """Return the instant centre of two bodies (n, 2); nan at infinity."""
        pin = self.pins.get(frozenset((first, second)))
        if pin is not None:
            return pin
        base = self.place[second]
        if first == GROUND and second in self.pinned:
            return base
        arm = base - self.place[first]
        drift = self.speed[second] - self.speed[first] - self.turn[first][:, None] * _cross(arm)
        turn = self.turn[second] - self.turn[first]
        size = np.abs(turn) * self.scale
        way = np.hypot(drift[:, 0], drift[:, 1])
        with np.errstate(invalid="ignore", divide="ignore"):
            centre = base + _cross(drift) / turn[:, None]
            there = (size > way / FAR) & np.isfinite(centre).all(axis=1)
        return np.where(there[:, None], centre, np.nan)

    def moving(self, body: str, centre: Points) -> Any:
        """Return a place in the body's own frame, that of the file."""
        arm = centre - self.place[body]
        cos, sin = np.cos(self.angle[body]), np.sin(self.angle[body])
        turned = np.stack([cos * arm[:, 0] + sin * arm[:, 1], cos * arm[:, 1] - sin * arm[:, 0]], 1)
        return self.anchors[body] + turned


def is_pinned(scene: Scene, body: str) -> bool:
    """Return whether a body's anchor stays where it is, by structure."""
    place = scene.expression(scene.model.frame(body).r)
    return bool(ca.jacobian(place, ca.vertcat(scene.x, scene.u)).nnz() == 0)


def at_infinity(track: Track, outputs: Outputs, columns: list[int]) -> Json:
    """Return where a body's instant centre against the ground is at infinity.

    ``at_infinity`` has the driver values at which a body stops turning, of an interval in which
    it rests both ends, ``never_turn`` the bodies that do not turn at all.
    """
    found: dict[str, list[float]] = {}
    still = []
    scene = outputs.scene
    for body, column in zip(bodies_of(scene), columns, strict=True):
        if body not in scene.selection.bodies or is_pinned(scene, body):
            continue
        pieces = track.pieces(track.low - track.margin, track.high + track.margin)
        if not any(travel(track.sample(piece), [column])[0] > AT_REST for piece in pieces):
            still.append(body)
            continue
        slack = SAME * track.unit
        places = sorted(
            float(np.clip(s + piece.shift, track.low, track.high))
            for piece in pieces
            for stop in stops(track, piece, [column], [1.0])[0]
            for s in (stop.first, stop.last)
            if stop.last + piece.shift >= track.low - slack
            and stop.first + piece.shift <= track.high + slack
        )
        if places:
            far = np.diff(places, prepend=-np.inf) > NEAR * track.unit
            found[body] = [s for s, new in zip(places, far, strict=True) if new]
    summary: dict[str, dict[str, list[float]]] = {"at_infinity": found} if found else {}
    return summary | ({"never_turn": still} if still else {})


def _cross(vectors: Points) -> Points:
    """Return k x v of each row."""
    return np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)


def centrodes(planes: Planes, wanted: tuple[str, ...]) -> dict[str, dict[str, Points]]:
    """Return ``centrode_fixed`` and ``centrode_moving`` (n, 2) of bodies that ever turn."""
    found = {}
    for body in wanted:
        centre = planes.centre(GROUND, body)
        if np.isfinite(centre).any():
            moving = planes.moving(body, centre)
            found[body] = {"centrode_fixed": centre, "centrode_moving": moving}
    return found


def instant_centres(planes: Planes) -> tuple[dict[str, Points], list[str]]:
    """Return "first-second" -> centres (n, 2), and the pairs whose centre is always far away.

    Raises
    ------
    InputError
        More numbers than `MOST`.
    """
    names = [GROUND, *planes.bodies]
    pairs = list(itertools.combinations(names, 2))
    if 2 * len(pairs) * planes.count > MOST:
        raise InputError(
            f"{len(pairs)} pairs of bodies at {planes.count} poses are too many instant centres",
            where="measures",
            hint="name the bodies that matter in 'outputs', or take fewer poses",
        )
    found, far = {}, []
    for first, second in pairs:
        centre = planes.centre(first, second)
        if np.isfinite(centre).any():
            found[f"{first}-{second}"] = centre
        else:
            far.append(f"{first}-{second}")
    return found, far
