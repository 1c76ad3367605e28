"""Links, joints and loops of a tree, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mechdae.parts.exchange.robots.link_frames import BodyFrame, MassOf
from mechdae.types import Floats


@dataclass(frozen=True)
class ElementaryMotion:
    """A freedom of a joint: a turn or a slide of the child, or a ball.

    ``axis`` and ``anchor`` (3,) are in the child's frame in the pose of the tree, ``coordinate``
    is the name of what it measures and ``start`` its value in that pose.
    """

    kind: str  # hinge, slide or ball
    axis: Floats
    anchor: Floats
    coordinate: str
    start: float


@dataclass(frozen=True)
class TreeEdge:
    """A joint of the tree; its motions go from parent to child."""

    joint: str
    kind: str
    parent: str
    child: str
    forward: bool
    motions: tuple[ElementaryMotion, ...]


@dataclass(frozen=True)
class LoopJoint:
    """A joint that is not in the tree.

    ``first_place`` and ``second_place`` (3,) are its points in the frames of the two links.
    ``motions`` are those from the first to the second body, for a frame at the second point with
    the directions of the second body.
    """

    joint: str
    kind: str
    first: str
    second: str
    first_place: Floats
    second_place: Floats
    motions: tuple[ElementaryMotion, ...]
    length: float = 0.0


@dataclass(frozen=True)
class TreeLink:
    """A body as a link: where its frame is, its mass, its points in that frame."""

    name: str
    frame: BodyFrame
    mass: MassOf
    points: Mapping[str, Floats]
    assumed: str = ""


@dataclass(frozen=True)
class Coupling:
    """sum of factor * coordinate = constant, along the whole motion."""

    joint: str
    factors: Mapping[str, float]
    constant: float
