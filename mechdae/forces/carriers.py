"""Whether the carrier that a gear, rack or belt names carries its wheels.

The forces of teeth stand in for the equation of a pair of wheels: both must do the same work in
every motion that the other joints allow. Where the carrier does not hold the wheels, the equation
still couples angles, but a force between the wheels would leave the carrier without what turns it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.model.forces.meshes import KINDS, Mesh
from mechdae.model.model import Model

SAME = 1e-8
"""Share by which the two may differ."""
RANK = 1e-9
MOST = 5
"""Poses that are looked at."""


def carried(model: Model, names: Sequence[str], q: Any, columns: Sequence[int], size: float) -> Any:
    """Return whether the teeth of each pair do the work of its equation.

    Parameters
    ----------
    names
        Gears, racks and belts.
    q : (n, k) array
        Poses, of the coordinates `columns`.
    columns
        Positions in q; joints that touch other coordinates are left out.
    size
        A length of the mechanism.
    """
    inside = set(columns)
    gradient = ca.jacobian(model.phi, model.q)
    touched: list[set[int]] = [set() for _ in model.rows]
    for i, j in zip(*gradient.sparsity().get_triplet(), strict=True):
        touched[i].add(j)
    joints = model.mechanism.joints
    others = [
        i for i, row in enumerate(model.rows)
        if joints[row.owner].kind not in KINDS and touched[i] <= inside
    ]  # fmt: skip
    place = {j: k for k, j in enumerate(columns)}
    works = []
    for name in names:
        row = next(i for i, row in enumerate(model.rows) if row.owner == name)
        column = Mesh(model, model.ends[name], real=True).column or {}
        pair = ca.SX(1, len(place))
        for j, entry in column.items():
            if j in place:
                pair[place[j]] = entry
        works += [gradient[row, list(columns)], pair]
    parts = [gradient[others, list(columns)], ca.vertcat(*works)]
    function = ca.Function(
        "works", [model.q[list(columns)], model.p], [ca.densify(p) for p in parts]
    )
    units = np.array([1.0 if model.q_names[j][1] in ("angle", "s") else size for j in columns])
    chosen = np.linspace(0, len(q) - 1, min(MOST, len(q))).astype(int)
    seen = []
    for k in chosen:
        G, W = (np.array(part) * units for part in function(q[k], model.p_values))
        seen.append((freedoms(G), W))
    least = min((V.shape[1] for V, _ in seen), default=0)  # there are more at singular poses
    result = np.ones(len(names), bool)
    for V, W in seen:
        if V.shape[1] == least:
            done = W @ V
            result &= [_parallel(done[2 * k], done[2 * k + 1]) for k in range(len(names))]
    return result


def _parallel(row: Any, teeth: Any) -> bool:
    """Return whether the second vector is a multiple of the first."""
    first, second = np.linalg.norm(row), np.linalg.norm(teeth)
    if first == 0 or not np.isfinite(second):
        return (
            True  # the equation is superfluous, or the wheels have no pitch point: told elsewhere
        )
    along = row / first
    return bool(np.linalg.norm(teeth - (teeth @ along) * along) <= SAME * second and second > 0)


def freedoms(G: Any) -> Any:
    """Return a basis (n, k) of the rates that equations leave."""
    norms = np.linalg.norm(G, axis=1, keepdims=True)
    _, sigma, right = np.linalg.svd(G / np.where(norms > 0, norms, 1.0))
    rank = int(np.sum(sigma > RANK * sigma[0])) if len(sigma) else 0
    return right[rank:].T
