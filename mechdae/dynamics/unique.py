"""Which reactions of a motion are unique, by the rule of a task of reactions.

Redundant equations leave self-stresses open as long as the motion lasts; pairs that stick
together and are more than the freedoms leave others open as long as they stick: the force that
holds a locked pair is one more multiplier.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.dynamics.output_values import Observer, States, alike
from mechdae.equations.forces.feedback import Unilateral
from mechdae.equations.forces.joint_reactions import lock_columns, row_columns
from mechdae.equations.model import Model
from mechdae.equations.motion_equations import row_size
from mechdae.equations.structure_cache import StructureCache
from mechdae.forces.uniqueness import (
    ForceColumns,
    Orientations,
    Stressed,
    natural_stresses,
    resultants,
    shared_bodies,
)
from mechdae.numerics.null_space import ZERO, equilibrated_null_space
from mechdae.records import dataclass
from mechdae.results import LazyPart, Series, Summary
from mechdae.types import Booleans, Floats, Integers, Matrix, Reactions, Unknowns

if TYPE_CHECKING:
    from mechdae.dynamics.equations import MotionProblem


@dataclass
class Unique:
    """Which reactions of a motion are unique.

    ``lost`` (n, joints) tells the states at which a joint's reaction is not unique as a whole,
    ``multipliers`` (rows,) those that are unique at the end, ``dependent`` the equations that
    always depend on each other, ``joints`` the unique parts of the other reactions in the form
    of `Result.unique`; ``summary`` and ``notes`` go to the result. ``contacts`` (n, contacts) tells
    the states at which the force of a contact is not unique.
    """

    lost: Booleans
    contacts: Booleans
    multipliers: Booleans
    dependent: list[str]
    joints: dict[str, dict[str, Any]] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


class _Holding:
    """What holds it together: rows, slips (forces of locks), what pushes wheels apart."""

    def __init__(self, observer: Observer) -> None:
        self.r, self.model, self.share = observer.r, observer.model, observer.setup.rank
        rubbing = self.r.rubbing
        locks = self.r.lockable_pairs
        self.rows, self.slips = len(self.r.rows), len(locks)
        self.names = list(self.model.mechanism.joints)
        meshes = {n: mesh for n, mesh in rubbing.meshes.items() if mesh.column is not None}
        owners = ["" if row.driver else row.owner for row in self.r.rows]
        owners += [lock.owner for lock in locks]
        self.owners = [owner if owner in self.names else "" for owner in [*owners, *meshes]]
        wrenches = [*row_columns(self.r), *lock_columns(self.r)]
        wrenches += [mesh.apart for mesh in meshes.values()]
        columns = list(zip(self.owners, wrenches, strict=True))
        self.maps = ForceColumns(self.model, columns, self.names, range(self.model.q.numel()))
        self.cache = self.maps.cache

    def of(self, observer: Observer) -> _Holding:
        """Return the same for other numbers."""
        copied = copy(self)
        copied.maps, copied.model = self.maps.of(observer.model), observer.model
        copied.share = observer.setup.rank
        return copied

    def stresses(self, B: Matrix, locked: Booleans) -> Floats:
        """Return a basis (columns, k) of what balances without any load, some slips locked."""
        used = np.zeros(B.shape[1], bool)
        used[: self.rows] = True
        used[self.rows : self.rows + self.slips] = locked
        N = self._null(B, used)
        for k in range(self.rows + self.slips, B.shape[1]):
            of_joint = [i for i, owner in enumerate(self.owners[:k]) if owner == self.owners[k]]
            used[k] = bool(np.abs(N[of_joint]).max(initial=0.0) > ZERO)
        return self._null(B, used) if used[self.rows + self.slips :].any() else N

    def left(self, q: Unknowns, rows: Integers, locked: Booleans) -> tuple[Stressed, Any, Any]:
        """Return what is unique at poses, some slips locked: as a whole, joints, multipliers.

        Behind the multipliers of rows are forces that hold slips and contacts.
        """
        if not (self.rows or locked.any()) or not len(rows):
            nothing = Stressed(None, rows, q[rows], [])
            unique_ones = np.ones(self.rows + self.slips, bool)
            return nothing, np.zeros(len(self.names), bool), unique_ones
        found = self.maps.stressed(q, rows, lambda B: self.stresses(B, locked))
        open_ = np.max([np.abs(N).max(axis=1, initial=0.0) for N in found.null], axis=0)
        alone = open_[: self.rows + self.slips] <= ZERO
        return found, np.isin(self.names, found.lost), alone

    def _null(self, B: Matrix, used: Booleans) -> Matrix:
        held = np.abs(B[:, used]).max(axis=1, initial=0.0) > 0
        if not held.any():
            return np.zeros((len(used), 0))
        if self.model.space.behind:
            length = self.model.mechanism.scale
            units = [row_size(row.unit, length) for row in self.r.rows]
            units += [row_size(lock.unit, length) for lock in self.r.lockable_pairs]
            units += [length] * (len(used) - len(units))
            sizes = self.model.coordinates.sizes(length)
            return natural_stresses(B[held], used, sizes[held], np.array(units), self.share)
        inside = equilibrated_null_space(B[held][:, used], self.share)
        N = np.zeros((len(used), inside.shape[1]))
        N[used] = inside
        return N


def unique(observer: Observer, s: States, q: Unknowns, reactions: dict[str, Floats]) -> Unique:
    shape: _Holding = observer.cache("holding", lambda: _Holding(observer))
    holding = shape.of(observer)
    n, slips = len(s.t), holding.slips
    there = np.flatnonzero(np.isfinite(q).all(axis=1))
    always, lost, known = holding.left(q, there, np.zeros(slips, bool))
    known, rows_of = known[: holding.rows], observer.r.rows
    dependent = [row.name for row, alone in zip(rows_of, known, strict=True) if not alone]
    contacts = observer.r.unilateral
    found = Unique(np.tile(lost, (n, 1)), np.zeros((n, len(contacts)), bool), known, dependent)
    if always.lost and reactions:
        _describe(found, observer.model, always, q, reactions)
    for locked, rows in alike(observer.holds(s)):
        if not locked.any():
            continue
        stressed, lost, known = holding.left(q, rows[np.isin(rows, there)], locked)
        found.lost[rows] = lost
        open_ = (~known[holding.rows :] & locked)[slips - len(contacts) :]
        found.contacts[rows] = open_
        if n - 1 in rows:
            found.multipliers = known[: holding.rows]
        more = [
            name
            for name in stressed.lost
            if name not in always.lost or _least(stressed, name) < _least(always, name)
        ]
        what = [f"the reactions of {', '.join(more)}"] if more else []
        pushed = dict.fromkeys(contacts[i].owner for i in np.flatnonzero(open_).tolist())
        what += [f"forces of contacts of {', '.join(pushed)}"] if pushed else []
        if what:
            found.notes.append(_together(holding, locked, what, float(s.t[rows[0]])))
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
    """Fill in what redundant equations leave unique."""
    orientations = Orientations(model, StructureCache(), range(q.shape[1]), q)
    for name in left.lost:
        unique_part = left.directions(name, orientations)
        found.joints[name] = unique_part.values(reactions[name])
    found.summary["not_unique"] = left.lost
    sums = shared_bodies(model, model.mechanism.bodies, left.lost)
    found.summary["unique_sums"] = resultants(model, sums, reactions)


def _together(holding: _Holding, locked: Booleans, what: list[str], t: float) -> str:
    pairs = [pair for pair, used in zip(holding.r.lockable_pairs, locked, strict=True) if used]
    stuck = list(dict.fromkeys(pair.owner for pair in pairs))
    touch = "touch or " if any(isinstance(pair, Unilateral) for pair in pairs) else ""
    return (
        f"at t = {t:.6g} s {', '.join(stuck)} {touch}stick together, more of them than freedoms: "
        f"{' and '.join(what)} are not unique then and not given"
    )


def dependence_note(found: dict[str, list[str]]) -> str:
    """Return what to say about equations that depend on each other."""
    equations, unique = ", ".join(found["equations"]), ", ".join(found["unique"]) or "none"
    return (
        f"equations that depend on each other (S2): {equations}; reactions that "
        f"are not unique: {', '.join(found['not_unique']) or 'none'}, that are: {unique}"
    )


class Determined:
    """The reactions of a motion by joint, nan where they are not unique.

    `q` (n, nq): absolute coordinates at the states.
    """

    def __init__(self, observer: Observer, states: States, q: Floats) -> None:
        self.setup: MotionProblem = observer.setup
        self.joints: list[str] = list(self.setup.model.mechanism.joints)
        self._later = LazyPart(lambda: self._found(observer, states, q))

    @staticmethod
    def _found(observer: Observer, states: States, q: Floats) -> dict[str, object]:
        multipliers = observer.multipliers(states)
        reactions = observer.reactions(states, multipliers)
        sole = unique(observer, states, q, reactions)
        for k, reaction in enumerate(reactions.values()):
            reaction[sole.lost[:, k]] = np.nan
        return {"multipliers": multipliers, "reactions": reactions, "sole": sole}

    @property
    def sole(self) -> Unique:
        found: Unique = self._later.parts()["sole"]
        return found

    @property
    def reactions(self) -> dict[str, Reactions]:
        """Reactions (n, 3) by joint."""
        found: dict[str, Reactions] = self._later.parts()["reactions"]
        return found

    def series(self) -> dict[str, LazyPart]:
        """Return the reaction of each joint as an array to be read later."""
        return {joint: self._reaction(joint) for joint in self.joints}

    def _reaction(self, joint: str) -> LazyPart:
        return LazyPart(lambda: {"reaction": self.reactions[joint]})

    def unique(self) -> Summary:
        """Return what is unique of the other reactions by joint, to be read later."""
        return Summary(dict.fromkeys(self.joints, LazyPart(lambda: self.sole.joints)))

    def efforts(self) -> Series:
        """Return the efforts of the laws of coordinates, nan where they are not unique."""

        def found() -> dict[str, Floats]:
            return {
                row.owner: -multiplier if alone else np.full(len(multiplier), np.nan)
                for row, multiplier, alone in self._rows()
                if row.driver and row.part == "law"
            }

        rows = self.setup.released.rows
        names = [row.owner for row in rows if row.driver and row.part == "law"]
        return Series(dict.fromkeys(names, LazyPart(found)))

    def _rows(self) -> Any:
        """Return rows with their multipliers (n,) and whether those are unique at the end."""
        multipliers = self._later.parts()["multipliers"]
        return zip(self.setup.released.rows, multipliers.T, self.sole.multipliers, strict=True)

    def summary(
        self, forced: Mapping[str, float], superfluous: int, before: list[str], after: list[str]
    ) -> LazyPart:
        """Return multipliers at the end, what is not unique, and the notes."""

        def found() -> dict[str, Any]:
            sole, dependence = self.sole, list[str]()
            multipliers: dict[str, float | None] = dict(forced)
            known = {*forced, *(".".join(key) for key in self.setup.held)}
            for row, multiplier, alone in self._rows():
                if row.name not in known and self.setup.released.tells(row):
                    multipliers[row.name] = float(multiplier[-1]) if alone else None
            summary: dict[str, object] = {"multipliers": multipliers, **sole.summary}
            if superfluous and sole.dependent:
                lost = sole.summary.get("not_unique", [])
                joints = [name for name in self.joints if name not in lost]
                redundant = {"equations": sole.dependent, "unique": joints, "not_unique": lost}
                summary["redundant"] = redundant
                dependence = [dependence_note(redundant)]
            if remarks := [*sole.notes, *before, *dependence, *after]:
                summary["notes"] = remarks
            return summary

        return LazyPart(found)
