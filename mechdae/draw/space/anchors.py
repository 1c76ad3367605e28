"""Where the symbols of joints are drawn: at their points, or along their axes beside others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw.diagram.loads import center_and_foot
from mechdae.draw.diagram.places import fixed_bodies
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.viewpoint import Array

AWAY = 0.3
"""A symbol that is moved along its axis goes so many sizes of the mechanism."""
MOST = 4
"""Of more symbols at one place the others stay there."""
STEPS = (-1.0, 1.0, -2.0, 2.0)
USUAL_SIZE = 1.0
"""Size [m] of a mechanism all of whose points are one place."""


def size_of(scene: SpatialScene, pose: int) -> float:
    """Return the largest extent of the points in one pose [m]; not zero."""
    places = [track[pose] for track in scene.tracks.values() if np.isfinite(track[pose]).all()]
    spread = float(np.ptp(np.array(places), axis=0).max()) if places else 0.0
    return spread if spread > 0 else USUAL_SIZE


def movable(joint: Joint) -> bool:
    """Return whether any place on a joint's axis is as good as its points: turning pairs."""
    return joint.coincide and joint.freedoms == 1


def offsets(scene: SpatialScene, pose: int, sides: Mapping[str, float]) -> dict[str, float]:
    """Return how far along their axes [m] the symbols of turning pairs are moved, by joint.

    Those that share their place with other joints are, so that all of them can be seen: where
    they are farthest from each other and from the bars that end there; of wheels on the side
    where the wheel is, which `sides` tells.
    """
    size, found = size_of(scene, pose), dict[str, float]()
    for cluster in _clusters(scene, pose, 1e-6 * size):
        staying = [joint for joint in cluster if not movable(joint)]
        moving = [joint for joint in cluster if movable(joint)]
        if not staying:
            between = [joint for joint in moving if GROUND not in joint.bodies]
            staying = between[len(between) // 2 :][:1] or moving[:1]
        moving = [joint for joint in moving if joint not in staying][:MOST]
        if moving:
            found |= _apart(scene, pose, moving, staying[0], size, sides)
    return found


def _clusters(scene: SpatialScene, pose: int, near: float) -> list[list[Joint]]:
    """Return the hinges that are at one place, several of them."""
    groups: list[tuple[Array, list[Joint]]] = []
    for joint in scene.joints(pose):
        if not joint.hinge:
            continue
        place = scene.place(joint.first, pose)
        known = next((hinges for at, hinges in groups if np.linalg.norm(at - place) <= near), None)
        if known is None:
            groups.append((place, [joint]))
        else:
            known.append(joint)
    return [hinges for _, hinges in groups if len(hinges) > 1]


def _apart(
    scene: SpatialScene,
    pose: int,
    moving: Sequence[Joint],
    staying: Joint,
    size: float,
    sides: Mapping[str, float],
) -> dict[str, float]:
    middle, step = scene.place(staying.first, pose), AWAY * size
    bodies = [np.zeros(3)]
    for body in {body for joint in (*moving, staying) for body in joint.bodies} - {GROUND}:
        for reference in scene.points(body):
            away = scene.place(reference, pose) - middle
            if np.linalg.norm(away) > 1e-6 * size:
                bodies.append(step * away / np.linalg.norm(away))
    axes = [scene.axis(joint, pose) for joint in moving]
    known = np.array([np.zeros(3) if axis is None else axis for axis in axes])
    best, signs = -np.inf, (0.0,) * len(moving)
    for choice in product(STEPS, repeat=len(moving)):
        places = np.vstack(
            [*bodies, *(step * s * axis for s, axis in zip(choice, known, strict=True))]
        )
        i, j = np.triu_indices(len(places), 1)
        free = j >= len(bodies)
        least = float(np.linalg.norm(places[i[free]] - places[j[free]], axis=1).min())
        beside = sum(s * sides.get(j.name, 0.0) > 0 for s, j in zip(choice, moving, strict=True))
        worth = round(least / step - 0.3 * sum(abs(s) for s in choice) + 2 * beside, 9)
        if worth > best:
            best, signs = worth, choice
    return {
        joint.name: step * sign
        for joint, sign, axis in zip(moving, signs, axes, strict=True)
        if axis is not None
    }


def anchor(
    scene: SpatialScene, joint: Joint, pose: int, moved: Mapping[str, float]
) -> tuple[Array, Array]:
    """Return where the symbol of a joint is, and where what slides in it is, (3,) m each."""
    first, second = scene.place(joint.first, pose), scene.place(joint.second, pose)
    way = moved.get(joint.name, 0.0)
    if way:
        axis = scene.axis(joint, pose)
        if axis is not None:
            first = first + way * axis
            return first, first
    return (first, first) if joint.coincide else (first, second)


def bases(
    scene: SpatialScene, pose: int, moved: Mapping[str, float]
) -> dict[str, tuple[str, str, Array, float]]:
    """Return places beside points that a page needs: symbols that are moved, ends of ways, masses.

    By name a point, the body that turns what is beside it, a direction (3,) in that body, and how
    far along it [m].
    """
    found: dict[str, tuple[str, str, Array, float]] = {}
    for joint in scene.joints(pose):
        axis = scene.axis(joint, pose)
        if axis is None:
            continue
        body = scene.holder(joint, pose)
        local = scene.turns[body][pose].T @ axis
        if moved.get(joint.name):
            found[f"{joint.name}/"] = joint.first, body, local, moved[joint.name]
        if joint.straight:
            ways = scene.travels[joint.name] or [scene.along(joint, pose)]
            held = holds(scene, joint)
            through, ends = joint.first, (min(ways), max(ways))
            if held:  # the shaft is the second body's
                through, ends = joint.second, (-max(ways), -min(ways))
            low, high = min(ends[0], 0.0), max(ends[1], 0.0)
            found[f"{joint.name}/low"] = through, body, local, low
            found[f"{joint.name}/high"] = through, body, local, high
    coupled = {getattr(load, "body", None) for load in scene.mechanism.loads.values()}
    for name in scene.mechanism.bodies:
        known = scene.points(name) if name in scene.turns else []
        local = [scene.local(point) for point in known]
        places = dict(zip(("center", "foot"), center_and_foot(scene, name) or (), strict=False))
        if name in coupled and known:
            places["middle"] = np.mean(local, axis=0)
        for word, place in places.items() if known else ():
            way = place - local[0]
            size = float(np.linalg.norm(way))
            found[f"{name}/{word}"] = known[0], name, way / (size or 1.0), size
    return found


def holds(scene: SpatialScene, joint: Joint) -> bool:
    """Return whether the sleeve of a slide is fixed and its guide moves."""
    fixed = fixed_bodies(scene.mechanism)
    return joint.turns and joint.first_body in fixed and joint.second_body not in fixed


def base_of(joint: Joint, moved: Mapping[str, float], second: bool = False) -> str:
    """Return the name of the place that a symbol keeps to: a point, or one of `bases`."""
    if moved.get(joint.name):
        return f"{joint.name}/"
    return joint.second if second and not joint.coincide else joint.first
