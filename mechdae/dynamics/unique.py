"""Which reactions of a motion are unique, by the rule of a task of reactions.

Superfluous equations leave self-stresses open as long as the motion lasts; pairs that stick
together and are more than the freedoms leave others open as long as they stick: the force that
holds a locked pair is one more multiplier.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.dynamics.observe import Observer, States
from mechdae.forces.uniqueness import MOST, directions, unique_space
from mechdae.kernels.run.batch import Batch
from mechdae.model.forces.generalised import Wrench, on_body
from mechdae.numerics.null_space import ZERO, equilibrated_null_space

SX = ca.SX


@dataclass
class Unique:
    """What is unique of a motion.

    ``lost`` (n, joints) tells the states at which a joint's reaction is not unique as a whole,
    ``multipliers`` (rows,) those that are unique at the end, ``dependent`` the equations that
    depend on each other for good, ``joints`` what is of the others as `Result.unique` has it,
    ``summary`` and ``notes`` what there is to say.
    """

    lost: Any
    multipliers: Any
    dependent: list[str]
    joints: dict[str, dict[str, Any]] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@dataclass
class _Left:
    """What is unique at poses.

    ``chosen`` are the poses, ``lost`` (joints,) tells which reactions are not unique, ``spaces``
    has the directions that are by joint and pose, ``known`` (rows,) which multipliers are.
    """

    chosen: Any
    lost: Any
    spaces: list[list[Any]]
    known: Any


class _Balance:
    """Columns of all forces that hold the mechanism together, and what they do in each joint.

    Columns are those of the rows, of the slips (forces of locks), and of what pushes wheels apart.
    """

    def __init__(self, observer: Observer) -> None:
        self.r, self.model = observer.r, observer.model
        self.rubbing = self.r.rubbing
        self.rows, self.slips = len(self.r.rows), len(self.rubbing.slips)
        self.names = list(self.model.mechanism.joints)
        self.meshes = [
            name for name, mesh in self.rubbing.meshes.items() if mesh.column is not None
        ]

    @cached_property
    def _columns(self) -> list[tuple[str, Wrench]]:
        """The owner of each column, "" for what is no joint's, and its generalised force."""
        found = []
        for row in self.r.rows:
            own = _gradient(row.expression, self.model.q)
            if row.owner in self.meshes and not row.driver:
                own = self.rubbing.meshes[row.owner].column or own
            found.append(("" if row.driver else row.owner, own))
        for slip in self.rubbing.slips:
            joint = slip.owner if slip.falls is None else ""
            found.append((joint, _gradient(slip.speed, self.model.velocity)))
        found += [(name, self.rubbing.meshes[name].apart) for name in self.meshes]
        return found

    @cached_property
    def _function(self) -> tuple[Batch, list[tuple[int, int]]]:
        parts = [ca.horzcat(*[self.r.stack(own) for _, own in self._columns])]
        for name in self.names:
            joint, place = self.model.mechanism.joints[name], self.model.ends[name].p2
            ground = joint.second_body == GROUND
            body = joint.first_body if ground else joint.second_body
            wrenches = [
                on_body(self.model, own if owner == name else {}, body, place)
                for owner, own in self._columns
            ]
            sign = 1 if ground else -1
            parts.append(ca.horzcat(*[sign * ca.vertcat(*wrench) for wrench in wrenches]))
        stacked = ca.vertcat(*[ca.vec(ca.densify(part)) for part in parts])
        inputs = [self.model.q, self.model.p]
        return Batch(ca.Function("balance", inputs, [stacked]), [1]), [p.shape for p in parts]

    def at(self, q: Any) -> list[Any]:
        """Return the columns (n, nq, k) at poses, then what they are in each joint (n, 3, k)."""
        batch, shapes = self._function
        flat, found, start = batch(q, self.model.p_values)[0], [], 0
        for rows, columns in shapes:
            part = flat[:, start : start + rows * columns]
            found.append(part.reshape(len(q), columns, rows).transpose(0, 2, 1))
            start += rows * columns
        return found

    def stresses(self, B: Any, locked: Any) -> Any:
        """Return a basis (columns, k) of what balances without any load, some slips locked."""
        used = np.zeros(B.shape[1], bool)
        used[: self.rows] = True
        used[self.rows : self.rows + self.slips] = locked
        N = self._null(B, used)
        first = self.rows + self.slips
        for k, name in enumerate(self.meshes):
            own = [i for i, row in enumerate(self.r.rows) if row.owner == name and not row.driver]
            used[first + k] = bool(np.abs(N[own]).max(initial=0.0) > ZERO)
        return self._null(B, used) if used[first:].any() else N

    def left(self, q: Any, rows: Any, locked: Any) -> _Left:
        """Return what is unique at poses, some slips locked."""
        names = len(self.names)
        nothing = np.zeros(names, bool), [[np.eye(3)]] * names, np.ones(self.rows, bool)
        if not self.rows or not len(rows):
            return _Left(rows, *nothing)
        chosen = rows[np.linspace(0, len(rows) - 1, min(MOST, len(rows))).astype(int)]
        B, *maps = self.at(q[chosen])
        null = [self.stresses(own, locked) for own in B]
        least = min(N.shape[1] for N in null)  # there are more self-stresses at a singular pose
        if least == 0:
            return _Left(chosen, *nothing)
        kept = [k for k, N in enumerate(null) if N.shape[1] == least]
        found = [[unique_space(C[k], C[k] @ null[k]) for k in kept] for C in maps]
        lost = np.array([any(len(space) < rank for space, rank in own) for own in found])
        spaces = [[space for space, _ in own] for own in found]
        open_ = np.max([np.abs(null[k]).max(axis=1, initial=0.0) for k in kept], axis=0)
        return _Left(chosen[kept], lost, spaces, open_[: self.rows] <= ZERO)

    @staticmethod
    def _null(B: Any, used: Any) -> Any:
        held = np.abs(B[:, used]).max(axis=1, initial=0.0) > 0
        N = np.zeros((len(used), 0))
        if held.any():
            inside = equilibrated_null_space(B[held][:, used])
            N = np.zeros((len(used), inside.shape[1]))
            N[used] = inside
        return N


def unique(observer: Observer, s: States, q: Any, reactions: dict[str, Any]) -> Unique:
    """Return what is unique of the reactions of a motion."""
    balance = _Balance(observer)
    n, slips = len(s.t), balance.slips
    there = np.flatnonzero(np.isfinite(q).all(axis=1))
    always = balance.left(q, there, np.zeros(slips, bool))
    dependent = [
        row.name for row, own in zip(observer.r.rows, always.known, strict=True) if not own
    ]
    found = Unique(np.tile(always.lost, (n, 1)), always.known, dependent)
    if always.lost.any() and reactions:
        _describe(found, balance, always, q, reactions)
    for locked, rows in _alike(s.signs[:, slips : 2 * slips] > 0):
        if not locked.any():
            continue
        own = balance.left(q, rows[np.isin(rows, there)], locked)
        found.lost[rows] = own.lost
        if n - 1 in rows:
            found.multipliers = own.known
        more = [
            name
            for k, name in enumerate(balance.names)
            if own.lost[k] and (not always.lost[k] or _least(own, k) < _least(always, k))
        ]
        if more:
            found.notes.append(_together(balance, locked, more, float(s.t[rows[0]])))
        for name in more:
            if name in found.joints:
                found.joints[name]["values"][rows] = np.nan
    return found


def _least(left: _Left, joint: int) -> int:
    """Return how many directions of a joint's reaction are unique."""
    return min(map(len, left.spaces[joint]))


def _alike(patterns: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each pattern of locks with the states that have it."""
    rows = np.arange(len(patterns))
    while len(rows):
        same = (patterns[rows] == patterns[rows[0]]).all(axis=1)
        yield patterns[rows[0]], rows[same]
        rows = rows[~same]


def _describe(
    found: Unique, balance: _Balance, left: _Left, q: Any, reactions: dict[str, Any]
) -> None:
    """Fill in what superfluous equations leave unique."""
    model, joints = balance.model, balance.model.mechanism.joints

    def turned(body: str | None) -> Any:
        return np.zeros(len(q)) if body is None else q[:, model.places[body, "angle"]]

    lost = [name for name, own in zip(balance.names, left.lost, strict=True) if own]
    for name, spaces in zip(balance.names, left.spaces, strict=True):
        if name in lost:
            own = directions(model, name, turned, left.chosen, spaces)
            found.joints[name] = own.values(reactions[name])
    found.summary["not_unique"] = lost
    found.summary["unique_sums"] = sums = []
    for body in model.mechanism.bodies:
        names = [name for name in lost if body in joints[name].bodies]
        if len(names) > 1:
            sides = [1 if joints[name].second_body == body else -1 for name in names]
            parts = [side * reactions[name][:, :2] for side, name in zip(sides, names, strict=True)]
            sums.append({"body": body, "joints": names, "force": sum(parts)})


def _together(balance: _Balance, locked: Any, lost: list[str], t: float) -> str:
    stuck = list(dict.fromkeys(balance.rubbing.slips[k].owner for k in np.flatnonzero(locked)))
    return (
        f"at t = {t:.6g} s {', '.join(stuck)} stick together, more of them than freedoms: the "
        f"reactions of {', '.join(lost)} are not unique then and not given"
    )


def _gradient(expression: Any, symbols: Any) -> Wrench:
    gradient = ca.jacobian(expression, symbols)
    places = gradient.sparsity().get_triplet()[1]
    return dict(zip(places, gradient.nonzeros(), strict=True))


def dependence_note(found: dict[str, Any]) -> str:
    """Return what to say about equations that depend on each other."""
    equations, unique = ", ".join(found["equations"]), ", ".join(found["unique"]) or "none"
    return (
        f"equations that depend on each other (S2): {equations}; reactions that "
        f"are not unique: {', '.join(found['not_unique']) or 'none'}, that are: {unique}"
    )
