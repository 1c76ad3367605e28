"""Points and joint frames of a spatial group in numbers, on its bodies and on known ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.types import Floats, Sym

if TYPE_CHECKING:
    from mechdae.equations.tree.tree_model import TreeModel


SX = ca.SX


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

    def at(self, q: Mapping[tuple[str, str], float]) -> dict[str, Any]:
        """Return arrays by name at the coordinates of earlier groups."""
        values = [q.get(key, 0.0) for key in self.scene.model.q_names]
        found = np.array(self._function(values, self.p)).ravel()
        result, start = {}, 0
        for name, (rows, columns) in zip(self._names, self._shapes, strict=True):
            size = rows * columns
            result[name] = found[start : start + size].reshape(columns, rows).T
            start += size
        return result
