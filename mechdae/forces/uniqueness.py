"""Which reactions are unique where constraints are superfluous.

With N a basis of the multipliers that balance without any load (self-stress), a component w of
a joint's reaction C lambda is unique where w C N = 0 (Wojtyra 2005; Wojtyra and Fraczek 2013).
Matrices are equilibrated, so that the answer does not depend on units; components along axes
may all be non-unique while a direction between them is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.errors import IndeterminateFrictionError, SolveError
from mechdae.forces.inverse_dynamics import Motion, Statics
from mechdae.kernels.graphs.kinetostatics import Balance
from mechdae.kernels.run.batch import Batch
from mechdae.model.forces.friction import normal_form
from mechdae.model.forces.generalised import Wrench, on_body
from mechdae.numerics.null_space import ZERO, equilibrated_null_space

MOST = 64
"""Poses at which directions are looked for."""


@dataclass
class Directions:
    """Unique directions (k, 3) of a joint's reaction in the axes of `frame`."""

    frame: str
    directions: Any
    angles: Any

    def values(self, reaction: Any) -> dict[str, Any]:
        """Return directions and the reaction's values along them, for (n, 3) reactions."""
        c, s = np.cos(self.angles), np.sin(self.angles)
        turned = np.stack(
            [
                c * reaction[:, 0] + s * reaction[:, 1],
                c * reaction[:, 1] - s * reaction[:, 0],
                reaction[:, 2],
            ],
            axis=1,
        )
        values = turned @ self.directions.T
        return {"directions": self.directions, "values": values, "frame": self.frame}


@dataclass
class Uniqueness:
    """What is unique.

    ``whole`` (joints,) tells which reactions are unique altogether, ``joints`` has the
    directions of those in redundant groups and of those that pass their forces on, ``sums``
    bodies and joints whose resultant is unique although the single reactions are not, ``normals``
    the guides and slots whose normal force is unique.
    """

    whole: Any
    joints: dict[str, Directions]
    sums: dict[str, list[str]]
    normals: set[str]

    def given(self, balance: Balance, name: str, quantity: str) -> bool:
        """Return whether a quantity of a joint is unique altogether."""
        if quantity == "normal":
            return name in self.normals
        reaction = quantity.startswith("reaction") and name in balance.joints
        return not reaction or bool(self.whole[balance.joints.index(name)])


def require_unique(statics: Statics, motion: Motion, paths: Iterable[str]) -> None:
    """Raise `SolveError` for paths of reactions that are not unique."""
    unique = uniqueness(statics, motion)
    for path in paths if unique is not None else ():
        head, _, rest = path.partition("/")
        name, _, quantity = rest.partition("/")
        if head == "joints" and unique and not unique.given(statics.balance, name, quantity):
            raise SolveError(
                f"{path} has no value: constraints are superfluous, it is not unique",
                hint="efforts, and reactions whose joints show does not name as superfluous",
            )


def uniqueness(statics: Statics, motion: Motion) -> Uniqueness | None:
    """Return what is unique, None in a scene without superfluous constraints.

    Raises
    ------
    IndeterminateFrictionError
        A joint with friction whose normal force is not unique.
    """
    if not statics.scene.redundant:
        return None
    balance, model = statics.balance, statics.scene.model
    there = np.flatnonzero(np.isfinite(motion.q).all(axis=1))
    maps = _maps(statics)
    chosen = there[np.linspace(0, len(there) - 1, min(MOST, len(there))).astype(int)]
    if not chosen.size:
        return None
    matrices = maps.at(motion.q[chosen], statics.p)
    null = [equilibrated_null_space(B) for B in matrices["columns"]]
    least = min(N.shape[1] for N in null)  # there are more self-stresses at a change point
    kept = [k for k, N in enumerate(null) if N.shape[1] == least]
    chosen, null = chosen[kept], [null[k] for k in kept]
    matrices = {name: own[kept] for name, own in matrices.items()}
    whole = np.ones(len(balance.joints), bool)
    joints: dict[str, Directions] = {}

    def turned(body: str | None) -> Any:
        place = None if body is None else balance.columns.index(model.places[body, "angle"])
        return np.zeros(len(motion)) if place is None else motion.q[:, place]

    inside = {name for group in statics.scene.redundant for name in group.joints}
    for k, name in enumerate(balance.joints):
        spaces = []
        for C, N in zip(matrices[name], null, strict=True):
            spaces.append(unique_space(C, C @ N))
        whole[k] = all(space.shape[0] == rank for space, rank in spaces)
        if whole[k] and name not in inside:
            continue
        joints[name] = directions(model, name, turned, chosen, [s for s, _ in spaces])
    _check_friction(statics, matrices, null)
    sums: dict[str, list[str]] = {}
    for body in balance.bodies:
        own = [
            name
            for k, name in enumerate(balance.joints)
            if not whole[k] and body in model.mechanism.joints[name].bodies
        ]
        if len(own) > 1:
            sums[body] = own
    normals = set()
    for name in balance.guides:
        forms = matrices[f"normal {name}"]
        if not any(_left_open(form, N) for form, N in zip(forms, null, strict=True)):
            normals.add(name)
    return Uniqueness(whole, joints, sums, normals)


@dataclass
class _Maps:
    """Functions from q to the matrices of the balance."""

    batch: Batch
    shapes: dict[str, tuple[int, int]]

    def at(self, q: Any, p: Any) -> dict[str, Any]:
        flat = self.batch(q, p)[0]
        result, start = {}, 0
        for name, (rows, columns) in self.shapes.items():
            part = flat[:, start : start + rows * columns]
            result[name] = part.reshape(len(q), columns, rows).transpose(0, 2, 1)
            start += rows * columns
        return result


def _maps(statics: Statics) -> _Maps:
    balance, model = statics.balance, statics.scene.model
    count = len(statics.scene.rows)
    used = sorted(i for share in balance.shares for i in share.rows)
    columns = []
    for i in range(count):
        column = balance.column[i] if i in used else {}
        columns.append(ca.vertcat(*[column.get(j, ca.SX(0)) for j in balance.columns]))
    parts = {"columns": ca.horzcat(*columns)}
    for name in balance.joints:
        joint, ends = model.mechanism.joints[name], model.ends[name]
        body, sign = (
            (joint.second_body, -1) if joint.second_body != GROUND else (joint.first_body, 1)
        )
        wrench = []
        for i in range(count):
            own: Wrench = balance.column[i] if i in balance.rows_of[name] else {}
            wrench.append(sign * ca.vertcat(*on_body(model, own, body, ends.p2)))
        parts[name] = ca.horzcat(*wrench)
    known = {f"size {k}": balance.feedbacks[k] for k in balance.active}
    forms = {key: (feedback.joint, feedback.forms) for key, feedback in known.items()}
    forms |= {f"normal {n}": (n, normal_form(model.ends[n])) for n in balance.guides}
    for key, (name, own_form) in forms.items():
        form = ca.SX(own_form.shape[0], count)
        for position, place in enumerate(balance.rows_of[name]):
            form[:, place] = own_form[:, position]
        parts[key] = form
    stacked = ca.vertcat(*[ca.vec(ca.densify(part)) for part in parts.values()])
    function = ca.Function("maps", [balance.inputs[0], model.p], [stacked])
    return _Maps(Batch(function, [1]), {name: part.shape for name, part in parts.items()})


def unique_space(C: Any, CN: Any) -> tuple[Any, int]:
    """Return the unique directions (k, 3) among those that a joint's reaction can have."""
    U, values, _ = np.linalg.svd(C)
    rank = int(np.count_nonzero(values > ZERO * max(values[0], 1e-300)))
    able = U[:, :rank]
    if not CN.shape[1]:
        return _tidy(able.T), rank
    inner = able.T @ CN
    left, strength, _ = np.linalg.svd(inner)
    known = int(np.count_nonzero(strength > ZERO * max(np.abs(C).max(), 1e-300)))
    return _tidy((able @ left[:, known:]).T), rank


def _tidy(rows: Any) -> Any:
    """Return the same directions with a leading positive entry, axes where they span a plane."""
    if not len(rows):
        return rows.reshape(0, 3)
    rows = rows.copy()
    place = 0
    for column in range(3):  # reduced row echelon form, then normalised
        if place == len(rows):
            break
        pivot = place + int(np.argmax(np.abs(rows[place:, column])))
        if abs(rows[pivot, column]) < 1e-7:
            continue
        rows[[place, pivot]] = rows[[pivot, place]]
        rows[place] /= rows[place, column]
        for other in range(len(rows)):
            if other != place:
                rows[other] -= rows[other, column] * rows[place]
        place += 1
    rows[np.abs(rows) < 1e-15] = 0.0
    return rows / np.sqrt((rows * rows).sum(axis=1))[:, None]


def directions(
    model: Any, name: str, turned: Callable[[str | None], Any], chosen: Any, spaces: list[Any]
) -> Directions:
    """Return the unique directions of a joint's reaction in the axes in which they stand still.

    Parameters
    ----------
    turned
        Angles of a body at all poses, zeros for None.
    chosen, spaces
        Some of the poses, and the directions (k, 3) at each of them in world axes.
    """
    joint = model.mechanism.joints[name]
    nothing = turned(None)
    for frame in ("world", joint.second_body, joint.first_body):
        angles = nothing
        if frame in model.mechanism.bodies:
            angles = turned(frame)
        elif frame != "world":
            continue
        still = [
            np.hstack([_rotated(space[:, :2], -angles[k]), space[:, 2:]])
            for space, k in zip(spaces, chosen, strict=True)
        ]
        common = _common(still)
        if len(common) == min(map(len, still)):
            return Directions(frame, _tidy(common), angles)
    return Directions("world", spaces[0][:0], nothing)


def _common(spaces: list[Any]) -> Any:
    """Return an orthonormal basis (k, 3) of what lies in all spaces.

    At single poses a joint may have more: where the self-stress does not pass through it.
    """
    outside = sum(np.eye(3) - _projector(space) for space in spaces)
    values, vectors = np.linalg.eigh(outside)
    return vectors[:, values < 1e-8].T


def _projector(space: Any) -> Any:
    if not len(space):
        return np.zeros((3, 3))
    basis = np.linalg.qr(space.T)[0]
    return basis @ basis.T


def _rotated(vectors: Any, angle: float) -> Any:
    c, s = np.cos(angle), np.sin(angle)
    return vectors @ np.array([[c, s], [-s, c]])


def _left_open(form: Any, N: Any) -> bool:
    """Return whether self-stresses change linear forms of the multipliers."""
    return bool(np.abs(form @ N).max(initial=0.0) > ZERO * max(np.abs(form).max(), 1e-300))


def _check_friction(statics: Statics, matrices: Any, null: list[Any]) -> None:
    balance = statics.balance
    guilty = []
    for k in balance.active:
        name = balance.feedbacks[k].joint
        forms = matrices[f"size {k}"]
        if any(_left_open(form, N) for form, N in zip(forms, null, strict=True)):
            guilty.append(name)
    if guilty:
        names = ", ".join(dict.fromkeys(guilty))
        raise IndeterminateFrictionError(
            f"friction in joints {names} needs normal forces that are not unique: constraints "
            f"are superfluous",
            where=f"joints.{guilty[0]}.friction",
            hint="take superfluous joints away, or leave friction out of those joints",
        )
