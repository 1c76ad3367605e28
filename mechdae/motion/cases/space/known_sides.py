"""Points and joint frames of a spatial group in numbers, on its bodies and on known ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import casadi as ca
import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.cases.larger_groups.rigid_parts import Coordinates, OtherShape
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
