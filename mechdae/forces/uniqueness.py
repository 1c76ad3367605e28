"""Which reactions are unique where constraints are redundant, in fixed or in turning axes.

With N a basis of the multipliers that balance without any load (self-stress), a component w of
a joint's reaction C lambda is unique where w C N = 0 (Wojtyra 2005; Wojtyra and Fraczek 2013).
Matrices are equilibrated, so that the answer does not depend on units; components along axes
may all be non-unique while a direction between them is.

Force and moment are vectors (3,) each: in the plane one vector (Fx, Fy, M), turned about z.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.forces.friction import normal_form
from mechdae.equations.forces.generalised import Wrench, reaction
from mechdae.equations.model import Model
from mechdae.equations.structure_cache import StructureCache
from mechdae.errors import IndeterminateFrictionError, SolveError
from mechdae.forces.inverse_dynamics import InverseDynamics, LoadedPoses, absolute
from mechdae.kernels.graphs.kinetostatics import Balance
from mechdae.kernels.run.functions import Batch
from mechdae.numerics.null_space import ZERO, equilibrated_null_space, natural_null_space
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrices, Matrix, Reactions, Sym, Unknowns


@dataclass
class Directions:
    """Unique directions (k, 3) or, in space, (k, 6) of a joint's reaction in the axes of `frame`.

    ``turns`` (n, 3, 3) lead from these axes to the world's.
    """

    frame: str
    directions: Floats
    turns: Floats

    def values(self, reaction: Floats) -> dict[str, Matrix | str]:
        """Return directions and the values along them of reactions (n, 3) or (n, 6)."""
        values = in_axes(self.turns, reaction) @ self.directions.T
        return {"directions": self.directions, "values": values, "frame": self.frame}


def in_axes(turns: Floats, reaction: Floats) -> Floats:
    """Return reactions (n, 3) or (n, 6) in axes that `turns` (n, 3, 3) lead to the world's."""
    vectors = reaction.reshape(len(reaction), reaction.shape[1] // 3, 3)
    turned: Floats = np.einsum("nji,nkj->nki", turns, vectors)
    return turned.reshape(reaction.shape)


class Orientations:
    """Rotation matrices of a model's bodies at poses q (n, columns)."""

    def __init__(
        self, model: Model, cache: StructureCache, columns: Sequence[int], q: Floats
    ) -> None:
        self._cache, self._columns, self._q = cache, list(columns), q
        self.model: Model = model
        self.world: Floats = np.broadcast_to(np.eye(3), (len(q), 3, 3))

    def has(self, body: str) -> bool:
        """Return whether a body moves and has axes: a link that spins freely has none."""
        return body in self.model.mechanism.bodies and body not in self.model.spinning

    def of(self, body: str) -> Floats:
        """Return the matrices (n, 3, 3) from a body's axes to the world's."""
        model = self.model
        if not model.space.behind:
            return self.about(body, 0.0)

        def build() -> Batch:
            flat = ca.densify(ca.vec(model.frame(body).R.T))
            inputs = [model.q[self._columns], model.p]
            return Batch(ca.Function("turn", inputs, [flat]), [1])

        batch: Batch = self._cache(("orientation", body), build)
        turns: Floats = batch(self._q, model.p_values)[0]
        return turns.reshape(-1, 3, 3)

    def about(self, body: str, angle: float) -> Floats:
        """Return the matrices (n, 3, 3) from axes at an angle on a body of the plane."""
        angles = np.full(len(self._q), angle)
        if self.has(body):
            angles = angles + self._q[:, self._columns.index(self.model.turn(body))]
        c, s, turns = np.cos(angles), np.sin(angles), np.zeros((len(angles), 3, 3))
        turns[:, 0, 0], turns[:, 0, 1], turns[:, 1, 0], turns[:, 1, 1] = c, -s, s, c
        turns[:, 2, 2] = 1.0
        return turns


def still_directions(
    orientations: Orientations, name: str, spaces: Sequence[Floats], chosen: Integers
) -> Directions:
    """Return the unique directions of a joint's reaction in the axes in which they stand still.

    `spaces` are bases (k, 3) or (k, 6) of them at the poses `chosen`, in the world's axes.
    """
    joint = orientations.model.mechanism.joints[name]
    for frame in ("world", joint.second_body, joint.first_body):
        if frame != "world" and not orientations.has(frame):
            continue
        turns = orientations.world if frame == "world" else orientations.of(frame)
        still = [
            in_axes(np.broadcast_to(turns[k], (len(space), 3, 3)), space)
            for space, k in zip(spaces, chosen, strict=True)
        ]
        shared = common(still)
        if len(shared) == min(map(len, still)):
            return Directions(frame, tidy(shared), turns)
    return Directions("world", spaces[0][:0], orientations.world)


def common(spaces: Sequence[Floats]) -> Floats:
    """Return an orthonormal basis (k, d) of what lies in all spaces.

    At single poses a joint may have more: where the self-stress does not pass through it.
    """
    outside = sum(np.eye(space.shape[1]) - _projector(space) for space in spaces)
    values, vectors = np.linalg.eigh(outside)
    return vectors[:, values < 1e-8].T


def _projector(space: Floats) -> Floats:
    if not len(space):
        return np.zeros((space.shape[1], space.shape[1]))
    basis: Floats = np.linalg.qr(space.T)[0]
    return basis @ basis.T


def tidy(rows: Floats) -> Floats:
    """Return the same directions with a leading positive entry, axes where they span a plane."""
    if not len(rows):
        return rows
    rows = rows.copy()
    place = 0
    for column in range(rows.shape[1]):  # reduced row echelon form, then normalised
        if place == len(rows):
            break
        pivot = place + int(np.argmax(np.abs(rows[place:, column])))
        if abs(rows[pivot, column]) < 1e-7:
            continue
        rows[[place, pivot]] = rows[[pivot, place]]
        rows[place] /= rows[place, column]
        for row in range(len(rows)):
            if row != place:
                rows[row] -= rows[row, column] * rows[place]
        place += 1
    rows[np.abs(rows) < 1e-15] = 0.0
    unit: Floats = rows / np.sqrt((rows * rows).sum(axis=1))[:, None]
    return unit


SX_NOWHERE = ca.SX(6, 1)
"""A way of no length: joints that do not move have a matrix of ways too."""
MOST = 64
"""Poses at which directions are looked for."""


@dataclass
class Uniqueness:
    """What is unique.

    ``whole`` (joints,) tells which reactions are unique altogether, ``joints`` has the
    directions of those in redundant groups and of those that pass their forces on, ``sums``
    bodies and joints whose resultant is unique although the single reactions are not, ``normals``
    the guides and slots whose normal force is unique.
    """

    whole: Booleans
    joints: dict[str, Directions]
    sums: dict[str, list[str]]
    normals: set[str]

    def given(self, balance: Balance, name: str, quantity: str) -> bool:
        """Return whether a quantity of a joint is unique altogether."""
        if quantity == "normal":
            return name in self.normals
        reaction = quantity.startswith("reaction") and name in balance.joints
        return not reaction or bool(self.whole[balance.joints.index(name)])


def require_unique(statics: InverseDynamics, motion: LoadedPoses, paths: Iterable[str]) -> None:
    """Raise `SolveError` for paths of reactions that are not unique."""
    unique = uniqueness(statics, motion)
    for path in paths if unique is not None else ():
        head, _, rest = path.partition("/")
        name, _, quantity = rest.partition("/")
        if head == "joints" and unique and not unique.given(statics.balance, name, quantity):
            raise SolveError(
                f"{path} has no value: constraints are redundant, it is not unique",
                hint="efforts, and reactions whose joints show does not name as redundant",
            )


def uniqueness(statics: InverseDynamics, motion: LoadedPoses) -> Uniqueness | None:
    """Return what is unique, None in a scene without redundant constraints.

    Raises
    ------
    IndeterminateFrictionError
        A joint with friction whose normal force is not unique.
    """
    if not statics.scene.redundant:
        return None
    balance, model = statics.balance, statics.scene.model
    q = absolute(statics.scene, motion)[0]
    there = np.flatnonzero(np.isfinite(q).all(axis=1))
    if not there.size:
        return None
    stressed = _stressed(statics, q, there)
    _check_friction(statics, stressed)
    lost = set(stressed.lost)
    inside = {name for group in statics.scene.redundant for name in group.joints}
    orientations = Orientations(model, statics.scene.cache, balance.columns, q)
    joints = {
        name: stressed.directions(name, orientations)
        for name in balance.joints
        if name in lost | inside
    }
    sums = shared_bodies(model, balance.bodies, [name for name in balance.joints if name in lost])
    normals = {name for name in balance.guides if not stressed.left_open(f"normal {name}")}
    return Uniqueness(~np.isin(balance.joints, stressed.lost), joints, sums, normals)


def shared_bodies(model: Model, bodies: Iterable[str], lost: list[str]) -> dict[str, list[str]]:
    """Return the bodies with several of the joints that are `lost`, and these joints."""
    joints = model.mechanism.joints
    found = {body: [name for name in lost if body in joints[name].bodies] for body in bodies}
    return {body: names for body, names in found.items() if len(names) > 1}


def resultants(
    model: Model, sums: Mapping[str, list[str]], reactions: Mapping[str, Reactions]
) -> list[dict[str, Any]]:
    """Return the unique sums of forces of joints on bodies, as a summary lists them."""
    joints, found = model.mechanism.joints, []
    for body, names in sums.items():
        forces = [reactions[name][:, : len(model.space.axes)] for name in names]
        sides = [1 if joints[name].second_body == body else -1 for name in names]
        force = sum(side * part for side, part in zip(sides, forces, strict=True))
        found.append({"body": body, "joints": names, "force": force})
    return found


@dataclass
class Stressed:
    """Self-stresses at poses with as few of them as there are for good.

    ``chosen`` are the poses and ``q`` their coordinates, ``null`` bases (columns, k) of the
    self-stresses, ``lost`` the joints whose reaction is not unique as a whole.
    """

    maps: ForceColumns | None
    chosen: Integers
    q: Unknowns
    null: list[Matrix]
    lost: list[str] = field(default_factory=list)

    @cached_property
    def matrices(self) -> dict[str, Matrices]:
        """The matrices of `ForceColumns.at` at the poses."""
        return {} if self.maps is None else self.maps.at(self.q)

    def spaces(self, name: str) -> list[Floats]:
        """Return the unique directions (k, 3) of the reaction of a joint at each pose."""
        return [space for space, _ in self._spaces(name)]

    def directions(self, name: str, orientations: Orientations) -> Directions:
        """Return the unique directions of a joint's reaction where they stand still."""
        return still_directions(orientations, name, self.spaces(name), self.chosen)

    def loses(self, name: str) -> bool:
        """Return whether the reaction of a joint is not unique as a whole."""
        return any(len(space) < rank for space, rank in self._spaces(name))

    def _spaces(self, name: str) -> list[tuple[Floats, int]]:
        pairs = list(zip(self.matrices[name], self.null, strict=True))
        if self.maps is None or (weights := self.maps.weights) is None:
            return [unique_space(C, C @ N) for C, N in pairs]
        found = []
        for (C, N), moves in zip(pairs, self.matrices[f"moves {name}"], strict=True):
            across = _across(weights[:, None] * C, moves / weights[:, None])
            space, rank = unique_space(across, across @ N)
            found.append((_unit(space * weights), rank))
        return found

    def left_open(self, name: str) -> bool:
        """Return whether self-stresses change the linear forms of a name."""
        return any(
            np.abs(form @ N).max(initial=0.0) > ZERO * max(np.abs(form).max(), 1e-300)
            for form, N in zip(self.matrices[name], self.null, strict=True)
        )


class ForceColumns:
    """Generalised forces that hold a mechanism together, and what they do in each joint.

    Parameters
    ----------
    model
        Symbols.
    columns
        The joint of each force, "" for what is no joint's, and the force.
    joints
        Whose reactions are asked for.
    places
        Positions in q that count.
    forms
        Linear forms over the columns of a joint, by name.

    Attributes
    ----------
    weights : array or None
        By which components of reactions are compared with each other; in the plane rows tell.
    """

    def __init__(
        self,
        model: Model,
        columns: Sequence[tuple[str, Wrench]],
        joints: Iterable[str],
        places: Sequence[int],
        forms: dict[str, tuple[str, Sym]] | None = None,
    ) -> None:
        self.joints: list[str] = list(joints)
        self._take(model)
        every = [ca.vertcat(*[wrench.get(j, ca.SX(0)) for j in places]) for _, wrench in columns]
        parts = {"columns": ca.horzcat(*every)}
        behind = model.space.behind
        for name in self.joints:
            acting = [
                reaction(model, name, wrench if behind or name == of else {})
                for of, wrench in columns
            ]
            parts[name] = ca.horzcat(
                *[-ca.vertcat(*parts_of_reaction) for parts_of_reaction in acting]
            )
            if behind:
                parts[f"moves {name}"] = ca.horzcat(model.space.moves(model, name), SX_NOWHERE)
        for key, (name, combination) in (forms or {}).items():
            if behind:
                parts[key] = combination @ parts[name]
                continue
            form = ca.SX(combination.shape[0], len(columns))
            form[:, [k for k, (of, _) in enumerate(columns) if of == name]] = combination
            parts[key] = form
        self.cache: StructureCache = StructureCache()
        self._parts, self._inputs = parts, [model.q[list(places)], model.p]

    def of(self, model: Model) -> ForceColumns:
        """Return the same forces for a copy of the model with other numbers."""
        copied = copy(self)
        copied._take(model)
        return copied

    def _take(self, model: Model) -> None:
        """Take the numbers of a model."""
        length = model.mechanism.scale
        self.p: Floats = model.p_values
        self.weights: Floats | None = None
        if model.space.behind:
            self.weights = np.array([1.0] * 3 + [1 / length] * 3)

    def _batch(self, names: tuple[str, ...]) -> Batch:
        stacked = ca.vertcat(*[ca.vec(ca.densify(self._parts[name])) for name in names])
        return Batch(ca.Function("maps", self._inputs, [stacked]), [1])

    def at(self, q: Unknowns, *names: str) -> dict[str, Floats]:
        """Return matrices (n, rows, columns) at poses (n, k), all of them or some by name."""
        names = names or tuple(self._parts)
        batch: Batch = self.cache(names, lambda: self._batch(names))
        flat, found, start = batch(q, self.p)[0], {}, 0
        for name in names:
            rows, columns = self._parts[name].shape
            part = flat[:, start : start + rows * columns]
            found[name] = part.reshape(len(q), columns, rows).transpose(0, 2, 1)
            start += rows * columns
        return found

    def stressed(
        self, q: Unknowns, rows: Integers, stresses: Callable[[Any], Any] = equilibrated_null_space
    ) -> Stressed:
        """Return the self-stresses at some of the poses `rows` (one at least).

        A pose without any tells that there are none for good.
        """
        chosen = rows[np.linspace(0, len(rows) - 1, min(MOST, len(rows))).astype(int)]
        null: list[Matrix] = []
        for k in chosen:
            null.append(stresses(self.at(q[k : k + 1], "columns")["columns"][0]))
            if not null[-1].shape[1]:
                return Stressed(self, chosen, q[chosen], null[-1:] * len(chosen))
        least = min(N.shape[1] for N in null)  # there are more at a singular pose
        columns = [k for k, N in enumerate(null) if N.shape[1] == least]
        found = Stressed(self, chosen[columns], q[chosen[columns]], [null[k] for k in columns])
        found.lost = [name for name in self.joints if found.loses(name)]
        return found


def _stressed(statics: InverseDynamics, q: Unknowns, there: Integers) -> Stressed:
    """Return the self-stresses at poses."""
    columns, model = _columns(statics), statics.scene.model
    if not model.space.behind:
        return columns.stressed(q, there)
    length, balance, rows = model.mechanism.scale, statics.balance, statics.scene.rows
    used = sorted(i for share in balance.shares for i in share.rows)
    sizes = model.coordinates.sizes(length)[balance.columns]
    units = np.array([length if row.unit == "m" else 1.0 for row in rows])
    return columns.stressed(q, there, lambda B: natural_stresses(B, used, sizes, units))


def natural_stresses(
    B: Floats, used: Booleans | list[int], sizes: Floats, units: Floats, share: float = ZERO
) -> Floats:
    """Return a basis (columns, k) of what balances without any load, of the columns `used`.

    Of joints in space a row may do no work at all: there is nothing that would hold it, so that
    natural sizes of coordinates and natural `units` of columns take the place of equilibration.
    A `share` of the largest singular value counts as zero.
    """
    inside = natural_null_space(B[:, used], sizes, units[used], share)
    stresses = np.zeros((B.shape[1], inside.shape[1]))
    stresses[used] = inside
    return stresses


def _columns(statics: InverseDynamics) -> ForceColumns:
    balance, model = statics.balance, statics.scene.model
    used = {i for share in balance.shares for i in share.rows}
    owner = {i: name for name in balance.joints for i in balance.rows_of[name]}
    columns = [
        (owner.get(i, ""), balance.column[i] if i in used else {})
        for i in range(len(statics.scene.rows))
    ]
    known = {f"size {k}": balance.feedbacks[k] for k in balance.active}
    forms = {
        key: (feedback.joint, feedback.forms if feedback.needs is None else feedback.needs)
        for key, feedback in known.items()
    }
    forms |= {f"normal {n}": (n, normal_form(model.ends[n])) for n in balance.guides}
    return ForceColumns(model, columns, balance.joints, balance.columns, forms)


def unique_space(C: Matrix, CN: Floats) -> tuple[Floats, int]:
    """Return the unique directions (k, d) among those that a joint's reaction can have."""
    U, values, _ = np.linalg.svd(C)
    rank = int(np.count_nonzero(values > ZERO * max(values[0], 1e-300)))
    able = U[:, :rank]
    if not CN.shape[1]:
        return tidy(able.T), rank
    inner = able.T @ CN
    left, strength, _ = np.linalg.svd(inner)
    known = int(np.count_nonzero(strength > ZERO * max(np.abs(C).max(), 1e-300)))
    return tidy((able @ left[:, known:]).T), rank


def _across(C: Matrix, moves: Floats) -> Any:
    """Return columns without their parts along the ways, normal to each other, of a joint."""
    sizes = np.linalg.norm(moves, axis=0)
    free = moves[:, sizes > 0] / sizes[sizes > 0]
    return C - free @ (free.T @ C)


def _unit(rows: Floats) -> Floats:
    return rows / np.linalg.norm(rows, axis=1)[:, None] if len(rows) else rows


def _check_friction(statics: InverseDynamics, stressed: Stressed) -> None:
    balance, model = statics.balance, statics.scene.model
    pressed = [balance.feedbacks[k] for k in balance.active if stressed.left_open(f"size {k}")]
    guilty = [feedback.joint for feedback in pressed if not feedback.idle(model.p, model.p_values)]
    if guilty:
        names = ", ".join(dict.fromkeys(guilty))
        raise IndeterminateFrictionError(
            f"friction in joints {names} needs normal forces that are not unique: constraints "
            f"are redundant",
            where=f"joints.{guilty[0]}.friction",
            hint="take redundant joints away, or leave friction out of those joints",
        )
