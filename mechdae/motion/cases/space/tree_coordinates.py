"""Coordinates of a tree of joints from places and rotations of the bodies of a group."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.equations.coordinates import QUATERNION
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.cases.larger_groups.rigid_parts import OtherShape
from mechdae.motion.cases.space.known_sides import both_sides
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.types import Floats

READ = {"angle", "slide", "x", "y", *QUATERNION}


class TreeCoordinates:
    """What a group's unknowns are at a pose of its bodies; raises `OtherShape` for other ones."""

    def __init__(self, scene: Scene, group: Group) -> None:
        self.model: Any = scene.model
        joints, blocks = self.model.mechanism.joints, scene.blocks
        unknowns = {i for block in blocks if block.group == group.index for i in block.x}
        self.names = [scene.x_names[i] for i in sorted(unknowns)]
        self.joints = [joints[o] for o in dict.fromkeys(o for o, _ in self.names) if o in joints]
        self.bodies = [o for o in dict.fromkeys(o for o, _ in self.names) if o not in joints]
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
