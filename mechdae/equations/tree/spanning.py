"""Which joints are the edges of the tree, and from which body to which."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.records import dataclass

FREEDOMS = 6


@dataclass(frozen=True)
class Edge:
    """A joint that places a body; ``joint`` is empty for one that is placed in space by itself."""

    joint: str
    parent: str
    child: str
    forward: bool = True


def edges(
    joints: Iterable[Joint],
    groups: Sequence[Collection[str]],
    first: Collection[str] = (),
    then: Collection[str] = (),
    points: Collection[str] = (),
) -> list[Edge]:
    """Return the edges in the order in which they place the bodies.

    In each group of bodies a tree of the largest weight grows from what is placed already (Prim's
    algorithm): the weight of a joint are the equations that it would have if it were cut. Of equal
    ones the nearest to the root is taken: the tree is balanced. Joints of `first` come before all
    others, those of `then` next. A vector places nothing but one of the `points`, which a ball
    joint holds wholly.
    """
    usable = [j for j in joints if j.spatial]
    found: list[Edge] = []
    placed = {GROUND}
    for group in groups:
        depth = dict.fromkeys(placed, 0)
        left = [name for name in group if name not in placed]
        while left:
            best: tuple[tuple[float, int], Edge] | None = None
            for joint in usable:
                for parent, child, forward in (
                    (joint.first_body, joint.second_body, True),
                    (joint.second_body, joint.first_body, False),
                ):
                    if parent not in depth or child not in left:
                        continue
                    if joint.pointer and child not in points:
                        continue
                    held = joint.ball and child in points
                    weight = FREEDOMS if held else _weight(joint, first, then)
                    key = (-weight, depth[parent])
                    if best is None or key < best[0]:
                        best = key, Edge(joint.name, parent, child, forward)
            edge = best[1] if best is not None else Edge("", GROUND, left[0])
            found.append(edge)
            depth[edge.child] = depth[edge.parent] + 1
            left.remove(edge.child)
        placed |= set(group)
    return found


def _weight(joint: Joint, first: Collection[str], then: Collection[str]) -> float:
    if joint.name in first:
        return math.inf
    if joint.name in then:
        return FREEDOMS + 1
    return FREEDOMS - joint.freedoms
