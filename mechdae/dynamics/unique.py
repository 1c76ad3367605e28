"""Which reactions of a motion are unique, by the rule of a task of reactions.

Superfluous equations leave self-stresses open as long as the motion lasts; pairs that stick
together and are more than the freedoms leave others open as long as they stick: the force that
holds a locked pair is one more multiplier.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import field
from typing import Any

import numpy as np

from mechdae.dynamics.observe import Observer, States, alike
from mechdae.equations.forces.generalised import Wrench
from mechdae.equations.forces.joint_reactions import columns_in_space, lock_columns
from mechdae.equations.gradients import gradients
from mechdae.equations.model import Model
from mechdae.equations.motion_equations import row_size
from mechdae.equations.structure_cache import StructureCache
from mechdae.forces.unique_in_space import Orientations
from mechdae.forces.uniqueness import ForceColumns, Stressed, directions, in_space, shared_bodies
from mechdae.numerics.null_space import ZERO, equilibrated_null_space, natural_null_space
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrix, Reactions, Unknowns


@dataclass
class Unique:
    """Which reactions of a motion are unique.

    ``lost`` (n, joints) tells the states at which a joint's reaction is not unique as a whole,
    ``multipliers`` (rows,) those that are unique at the end, ``dependent`` the equations that
    always depend on each other, ``joints`` the unique parts of the other reactions in the form
    of `Result.unique`; ``summary`` and ``notes`` go to the result.
    """

    lost: Booleans
    multipliers: Booleans
    dependent: list[str]
    joints: dict[str, dict[str, Any]] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


class _Holding:
    """What holds the mechanism together: rows, slips (forces of locks), what pushes wheels apart.

    Joints are told by name, what is no joint's by "".
    """

    def __init__(self, observer: Observer) -> None:
        self.r, self.model = observer.r, observer.model
        rubbing = self.r.rubbing
        self.rows, self.slips = len(self.r.rows), len(rubbing.slips)
        self.names = list(self.model.mechanism.joints)
        meshes = {n: mesh for n, mesh in rubbing.meshes.items() if mesh.column is not None}
        self.weights: Any = None
        self.length, self.share = observer.setup.length, observer.setup.rank
        if self.model.space.behind:
            self._columns_in_space()
            return
        columns: list[tuple[str, Wrench]] = []
        for row in self.r.rows:
            (own,) = gradients(row.expression, self.model.q)
            if row.owner in meshes and not row.driver:
                own = meshes[row.owner].column or own
            columns.append(("" if row.driver else row.owner, own))
        for slip in rubbing.slips:
            (own,) = gradients(slip.speed, self.model.velocity)
            columns.append((slip.owner if slip.falls is None else "", own))
        columns += [(name, mesh.apart) for name, mesh in meshes.items()]
        self.owners = [name for name, _ in columns]

        self.maps = ForceColumns(self.model, columns, self.names, range(self.model.q.numel()))
        self.cache = self.maps.cache

    def _columns_in_space(self) -> None:
        """Fill in columns with what they do in all joints of the tree."""
        owners = ["" if row.driver else row.owner for row in self.r.rows]
        owners += [slip.owner for slip in self.r.rubbing.slips]
        meshes = self.r.rubbing.meshes
        owners = [owner if owner in self.names else "" for owner in [*owners, *meshes]]
        wrenches = [*columns_in_space(self.r), *lock_columns(self.r)]
        wrenches += [mesh.apart for mesh in meshes.values()]
        columns = list(zip(owners, wrenches, strict=True))
        self.owners = owners
        self.maps = ForceColumns(self.model, columns, self.names, range(self.model.q.numel()))
        self.cache = self.maps.cache

    def of(self, observer: Observer) -> _Holding:
        """Return the same for other numbers."""
        other, model = copy(self), observer.model
        other.share = observer.setup.rank
        other.maps, other.model = self.maps.of(model), model
        if model.space.behind:
            length = model.mechanism.scale
            other.length = length
            other.maps.weights = np.array([1.0] * 3 + [1 / length] * 3)
        return other

    def stresses(self, B: Matrix, locked: Booleans) -> Floats:
        """Return a basis (columns, k) of what balances without any load, some slips locked."""
        used = np.zeros(B.shape[1], bool)
        used[: self.rows] = True
        used[self.rows : self.rows + self.slips] = locked
        N = self._null(B, used)
        for k in range(self.rows + self.slips, B.shape[1]):
            own = [i for i in range(self.rows) if self.owners[i] == self.owners[k]]
            used[k] = bool(np.abs(N[own]).max(initial=0.0) > ZERO)
        return self._null(B, used) if used[self.rows + self.slips :].any() else N

    def left(self, q: Unknowns, rows: Integers, locked: Booleans) -> tuple[Stressed, Any, Any]:
        """Return what is unique at poses, some slips locked: as a whole, joints, multipliers."""
        if not self.rows or not len(rows):
            nothing = Stressed(None, rows, q[rows], [])
            return nothing, np.zeros(len(self.names), bool), np.ones(self.rows, bool)
        found = self.maps.stressed(q, rows, lambda B: self.stresses(B, locked))
        open_ = np.max([np.abs(N).max(axis=1, initial=0.0) for N in found.null], axis=0)
        return found, np.isin(self.names, found.lost), open_[: self.rows] <= ZERO

    def _null(self, B: Matrix, used: Booleans) -> Matrix:
        held = np.abs(B[:, used]).max(axis=1, initial=0.0) > 0
        N = np.zeros((len(used), 0))
        if held.any() and self.model.space.behind:
            sizes = self.model.coordinates.sizes(self.length)
            units = [row_size(row.unit, self.length) for row in self.r.rows]
            units += [row_size(slip.unit, self.length) for slip in self.r.rubbing.slips]
            units += [self.length] * (len(used) - len(units))
            units_used = np.array(units)[used]
            inside = natural_null_space(B[held][:, used], sizes[held], units_used, self.share)
            N = np.zeros((len(used), inside.shape[1]))
            N[used] = inside
        elif held.any():
            inside = equilibrated_null_space(B[held][:, used], self.share)
            N = np.zeros((len(used), inside.shape[1]))
            N[used] = inside
        return N


@dataclass(frozen=True)
class PlacedModel:
    """What `Orientations` reads of a scene."""

    model: Model
    cache: StructureCache = field(default_factory=StructureCache)


def unique(observer: Observer, s: States, q: Unknowns, reactions: dict[str, Floats]) -> Unique:
    """Return what is unique of the reactions of a motion."""
    shape: _Holding = observer.cache("holding", lambda: _Holding(observer))
    holding = shape.of(observer)
    n, slips = len(s.t), holding.slips
    there = np.flatnonzero(np.isfinite(q).all(axis=1))
    always, lost, known = holding.left(q, there, np.zeros(slips, bool))
    dependent = [row.name for row, own in zip(observer.r.rows, known, strict=True) if not own]
    found = Unique(np.tile(lost, (n, 1)), known, dependent)
    if always.lost and reactions:
        _describe(found, observer.model, always, q, reactions)
    for locked, rows in alike(s.signs[:, slips : 2 * slips] > 0):
        if not locked.any():
            continue
        own, lost, known = holding.left(q, rows[np.isin(rows, there)], locked)
        found.lost[rows] = lost
        if n - 1 in rows:
            found.multipliers = known
        more = [
            name
            for name in own.lost
            if name not in always.lost or _least(own, name) < _least(always, name)
        ]
        if more:
            found.notes.append(_together(holding, locked, more, float(s.t[rows[0]])))
        for name in more:
            if name in found.joints:
                found.joints[name]["values"][rows] = np.nan
    return found


def _least(left: Stressed, name: str) -> int:
    """Return how many directions of a joint's reaction are unique."""
    return min(map(len, left.spaces(name)))


def _describe(
    found: Unique, model: Model, left: Stressed, q: Unknowns, reactions: Mapping[str, Reactions]
) -> None:
    """Fill in what superfluous equations leave unique."""
    joints = model.mechanism.joints

    def turned(body: str) -> Any:
        return q[:, model.turn(body)]

    scene: Any = PlacedModel(model)
    for name in left.lost:
        own: Any
        if model.space.behind:
            own = in_space(Orientations(scene, range(q.shape[1]), q), name, left)
        else:
            own = directions(model, name, len(q), turned, left)
        found.joints[name] = own.values(reactions[name])
    found.summary["not_unique"] = left.lost
    found.summary["unique_sums"] = sums = []
    for body, names in shared_bodies(model, model.mechanism.bodies, left.lost).items():
        sides = [1 if joints[name].second_body == body else -1 for name in names]
        forces = [reactions[name][:, : len(model.space.axes)] for name in names]
        parts = [side * own for side, own in zip(sides, forces, strict=True)]
        sums.append({"body": body, "joints": names, "force": sum(parts)})


def _together(holding: _Holding, locked: Booleans, lost: list[str], t: float) -> str:
    stuck = list(dict.fromkeys(holding.r.rubbing.slips[k].owner for k in np.flatnonzero(locked)))
    return (
        f"at t = {t:.6g} s {', '.join(stuck)} stick together, more of them than freedoms: the "
        f"reactions of {', '.join(lost)} are not unique then and not given"
    )


def dependence_note(found: dict[str, list[str]]) -> str:
    """Return what to say about equations that depend on each other."""
    equations, unique = ", ".join(found["equations"]), ", ".join(found["unique"]) or "none"
    return (
        f"equations that depend on each other (S2): {equations}; reactions that "
        f"are not unique: {', '.join(found['not_unique']) or 'none'}, that are: {unique}"
    )
