"""Joints of several freedoms as chains of joints of one, with small links between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdae.parts.exchange.robots.link_frames import BodyFrame
from mechdae.parts.exchange.robots.link_tree import LinkTree
from mechdae.parts.exchange.robots.tree_parts import ElementaryMotion, LoopJoint, TreeEdge
from mechdae.types import Floats


@dataclass(frozen=True)
class ChainJoint:
    """A joint of one freedom, or of none; ``frame`` is that of its child in the tree's pose.

    ``name`` is the joint's where it has one freedom, else the joint's with the coordinate's word.
    ``small`` tells that the child is no body of the mechanism.
    """

    name: str
    parent: str
    child: str
    frame: BodyFrame
    motion: ElementaryMotion | None
    small: bool

    @property
    def axis(self) -> Floats:
        """The direction of a hinge or slide in the child's frame (3,)."""
        assert self.motion is not None
        return self.motion.axis / np.linalg.norm(self.motion.axis)


def chain(tree: LinkTree, edge: TreeEdge) -> list[ChainJoint]:
    """Return the joints of one freedom that make a joint of the tree."""
    return _chain(edge.joint, edge.parent, edge.child, tree.links[edge.child].frame, edge.motions)


def loop_chain(tree: LinkTree, loop: LoopJoint) -> list[ChainJoint]:
    """Return the joints of one freedom that make a joint which closes a loop."""
    second = tree.frame(loop.second)
    frame = BodyFrame(second.world(loop.second_place), second.R)
    return _chain(loop.joint, loop.first, loop.second, frame, loop.motions)


def _chain(
    joint: str, parent: str, child: str, frame: BodyFrame, motions: tuple[ElementaryMotion, ...]
) -> list[ChainJoint]:
    if len(motions) < 2:
        motion = motions[0] if motions else None
        return [ChainJoint(joint, parent, child, frame, motion, False)]
    found = []
    for k, motion in enumerate(motions):
        word = motion.coordinate.rpartition(".")[2]
        last = k == len(motions) - 1
        here = frame if last else BodyFrame(frame.world(motion.anchor), frame.R)
        name = child if last else f"{joint}_{word}_part"
        found.append(ChainJoint(f"{joint}_{word}", parent, name, here, motion, not last))
        parent = name
    return found
