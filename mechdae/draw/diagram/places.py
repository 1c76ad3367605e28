"""Joint places: points of several bodies that are always at one place, and their letters."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from math import dist
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.records import dataclass

LONG = 3
"""A joint name of more letters gives way to the name of the point."""


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


class JoinedScene(Protocol):
    """What is asked of a scene, in the plane or in space, to find its joint places."""

    @property
    def mechanism(self) -> Mechanism: ...
    @property
    def numbers(self) -> Mapping[str, float]: ...
    @property
    def open(self) -> frozenset[str]: ...
    @property
    def status(self) -> tuple[str, ...]: ...
    @property
    def origins(self) -> Collection[str]: ...

    def joints(self, pose: int) -> list[Joint]:
        """Return the joints whose two bodies are shown."""
        ...

    def assembled(self) -> list[int]:
        """Return the poses that are assembled."""
        ...

    def shown(self, body: str, pose: int) -> bool:
        """Return whether the body has a placement in that pose."""
        ...

    def place(self, reference: str, pose: int) -> NDArray[np.float64]:
        """Return the position of ``body.point`` in one pose."""
        ...

    def local(self, reference: str) -> NDArray[np.float64]:
        """Return the coordinates of ``body.point`` in its body."""
        ...


def missing_hint(scene: JoinedScene) -> str:
    """Return what to try where nothing is drawn: the result may not have all bodies."""
    known = {*scene.origins, *getattr(scene, "helpers", ())}
    missing = [name for name in scene.mechanism.bodies if name not in known]
    if not missing:
        return "another pose or task"
    return f"a task without outputs: the result has no {', '.join(missing)}"


def places_of(scene: JoinedScene, pose: int) -> list[Place]:
    """Return the joint places shown, in the order of the joints.

    A pin in the ground is shown also where its link does not assemble in this pose.
    """
    groups: list[set[str]] = []
    both = scene.joints(pose)
    joints = [
        joint
        for joint in scene.mechanism.joints.values()
        if joint in both
        or (
            joint.hinge
            and joint.name not in scene.open
            and GROUND in joint.bodies
            and set(joint.bodies) <= set(scene.origins)
        )
    ]
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


def free_points(scene: JoinedScene, pose: int) -> list[str]:
    """Return the points of moving bodies that belong to no joint."""
    used = {
        reference
        for joint in scene.mechanism.joints.values()
        if joint.name not in scene.open
        for reference in (joint.first, joint.second)
    }
    return [
        f"{name}.{point}"
        for name, body in scene.mechanism.bodies.items()
        if scene.shown(name, pose)
        for point in body.points
        if f"{name}.{point}" not in used
        and not any(
            reference.split(".")[0] == name
            and np.allclose(scene.local(reference), scene.local(f"{name}.{point}"), atol=1e-12)
            for reference in used
        )
    ]


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


def letters_of(scene: JoinedScene, pose: int, places: Sequence[Place]) -> dict[str, str]:
    """Return the letter of each point of joint places and of free points, one for each place.

    Where two places would have one letter, those with one joint of a short name have that name,
    the others the number of their link as an index.
    """
    numbers = numbers_of(scene.mechanism)
    owners: list[tuple[tuple[str, ...], str, list[str]]] = []
    for place in places:
        names = [j.name for j in place.joints if (j.coincide or j.slot) and len(j.name) <= LONG]
        bodies = [body for body in place.bodies if body != GROUND]
        own = names if len(names) == 1 else []
        own = [*own, *_indexed(place.letter, bodies, numbers)]
        owners.append((place.references, place.letter, own))
    for reference in free_points(scene, pose):
        body, point = reference.split(".")
        owners.append(((reference,), point, _indexed(point, [body], numbers)))
    count = Counter(letter for _, letter, _ in owners)
    taken = {letter for letter, often in count.items() if often == 1}
    found: dict[str, str] = {}
    for references, letter, others in owners:
        name = letter
        if count[letter] > 1:
            free = [own for own in others if own not in taken and own not in count]
            name = free[0] if free else references[0]
        taken.add(name)
        found |= dict.fromkeys(references, name)
    return found


def _indexed(letter: str, bodies: Sequence[str], numbers: Mapping[str, int]) -> list[str]:
    return [f"{letter}_{numbers[body]}" for body in bodies]


def written(name: str) -> tuple[str, str]:
    """Return a name as it is written: numbers at its end are an index."""
    match = re.fullmatch(r"([A-Za-zα-ω]+)_?(\d+(?:_\d+)?)", name)
    return (match[1], match[2].replace("_", ",")) if match else (name, "")


def _points_of(joint: Joint) -> list[tuple[str, ...]]:
    """Return the places of a joint that are drawn, each with the points that meet there."""
    if joint.coincide:
        return [(joint.first, joint.second)]
    if joint.normal_force:
        return [(joint.second,)]
    if joint.wheels == 1:
        return [(joint.first,)]
    return [(joint.first,), (joint.second,)]


def _same_local(scene: JoinedScene, groups: list[set[str]]) -> list[set[str]]:
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
