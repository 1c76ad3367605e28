"""Whole turns of bodies that leave every equation of gears, belts, racks and screws unchanged.

Two solutions whose angles differ by such turns, of all bodies at once, are the same pose. The
turns are the integer null space of the equations that hold unwrapped angles: a lattice, worked
out in exact rational arithmetic. In its Hermite form, with the unknowns in solve order, the
rows that begin in a block are the turns of that block alone by which nothing solved before it
moves; bodies solved later may turn with it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.equations.reduction import Scene
from mechdae.equations.space import PLANE
from mechdae.kernels.run.functions import Local, local
from mechdae.motion.assembly.elimination import BlockSolver, rational
from mechdae.motion.assembly.turns.block_turns import SingleTurns, WholeTurns
from mechdae.types import Floats, Matrix

MOST = 1000
"""Classes of whole turns that are listed; where there are more, they count as infinitely many."""
NEAR = 4
"""Rank up to which all neighbours of a rounded vector are tried."""


class Lattice(SingleTurns):
    """Vectors of whole turns; ``basis`` is (r, n), rows of integers."""

    def __init__(self, basis: list[list[int]], size: int) -> None:
        rows = np.array(basis, float).reshape(-1, size)
        self.size, self.basis = size, _shortened(rows)
        """Size of the vectors, and short vectors that span the lattice."""
        self._each = np.abs(self.basis).sum(axis=0)
        self._apart = len(self.basis) == np.count_nonzero(self.basis)
        if self._apart:  # each row turns one angle
            self.single: list[bool] = [bool(turns == 1) for turns in self._each]
        else:
            self.single = [bool(np.abs(self.remainder(e[None])).max() < 0.25) for e in np.eye(size)]
        """Whether a single turn of each angle alone is in the lattice."""

    def remainder(self, gaps: Floats, weights: Floats | None = None) -> Floats:
        """Return gaps (k, n) [turns] less the lattice vectors nearest to them.

        With `weights` (n,) some entries count more than others.
        """
        gaps = np.asarray(gaps, float)
        if not len(self.basis) or not len(gaps):
            return gaps
        if self._apart:
            turn = self._each
            with np.errstate(invalid="ignore", divide="ignore"):
                return gaps - np.where(turn > 0, turn * np.round(gaps / turn), 0.0)
        w = np.ones(self.size) if weights is None else weights
        share = np.linalg.lstsq((self.basis * w).T, (gaps * w).T)[0].T
        best = gaps - np.round(share) @ self.basis
        if len(self.basis) > NEAR:
            return best
        least = np.sum((best * w) ** 2, axis=1)
        for steps in itertools.product((-1, 0, 1), repeat=len(self.basis)):
            other = gaps - (np.round(share) + np.array(steps)) @ self.basis
            far = np.sum((other * w) ** 2, axis=1)
            closer = far < least - 1e-12
            best[closer], least[closer] = other[closer], far[closer]
        return best

    def classes(self, periods: Sequence[float]) -> Any:
        """Return vectors of turns (k, n), one for each class that differs from the others, or None.

        They are made of `periods` [rad], 0 for what does not turn; None: more than `MOST`.
        """
        if all(self.single[j] for j, period in enumerate(periods) if period):
            return np.zeros((1, self.size))
        steps = []
        for j, period in enumerate(periods):
            unit = np.zeros(self.size)
            unit[j] = round(period / (2 * np.pi))
            count = 1
            while unit[j] and np.abs(self.remainder(count * unit[None])).max() > 0.25:
                count += 1
                if count > MOST:
                    return None
            steps.append([k * unit for k in range(count)])
        if math.prod(map(len, steps)) > MOST:
            return None
        distinct: list[Any] = []
        for parts in itertools.product(*steps):
            turn = sum(parts)
            others = np.array([turn - other for other in distinct]).reshape(-1, self.size)
            if np.all(np.abs(self.remainder(others)).max(axis=1, initial=0.0) > 0.25):
                distinct.append(turn)
        return np.array(distinct)


def with_periods(lattice: Lattice, periods: Sequence[float]) -> Lattice:
    """Return the lattice that solutions of a block are listed by.

    Where turns by which its own equations come back (`periods` [rad], 0 without) move bodies
    solved later by any amount, as a rack on a carrier, there are infinitely many modes: these
    turns are taken for no difference then.
    """
    own = [round(period / (2 * np.pi)) for period in periods]
    turned = sum(turns > 0 for turns in own)
    if len(lattice.basis) >= turned and lattice.classes(periods) is not None:
        return lattice
    rows = [[int(v) for v in row] for row in lattice.basis]
    rows += [[own[j] * (k == j) for k in range(len(own))] for j in range(len(own)) if own[j]]
    wider = Lattice(_echelon(rows), lattice.size)
    away = np.abs(lattice.remainder(wider.basis)).max(axis=1) > 0.25
    wider.moving = wider.basis[away]
    return wider


class GearedTurns(WholeTurns):
    """Whole turns that gears, belts and racks tell apart, and which screws do.

    Their equations hold unwrapped angles, so poses that differ by whole turns of a body may be
    different modes. All other equations take such turns away: of a block and its guide one may be
    sketched at 170 and the other at -190 degrees.
    """

    def __init__(self, scene: Scene, angles: Mapping[str, float], p: Floats) -> None:
        super().__init__(scene, angles, p)
        self._deciding: dict[int, list[tuple[str, Local]]] = {}
        self._rigid = _turning_together(scene.model.mechanism)
        self.geared: list[str] = [name for name in _geared(scene.model.mechanism) if name in angles]

    def lattices(
        self, blocks: list[list[int]], solvers: Sequence[BlockSolver]
    ) -> tuple[list[SingleTurns], list[bool]]:
        exact = lattices(self.scene, blocks)
        found: list[SingleTurns] = [
            with_periods(lattice, solver.turning)
            for lattice, solver in zip(exact, solvers, strict=True)
        ]
        return found, [a is not b for a, b in zip(exact, found, strict=True)]

    def told(self, i: int) -> list[tuple[str, Local]]:
        """Return the sketched geared bodies that turn like angle `i`, its own body first.

        With each comes its angle as a function of a pose.
        """
        if self.scene.unknowns[i].kind is not ANGLE:
            return []
        if i not in self._deciding:
            owner, found = self.scene.unknowns[i].owner, []
            for body in sorted(self.geared, key=lambda name: name != owner):
                angle = self.scene.turn_of(body)
                together = self._rigid[body] == self._rigid.get(owner)
                if together and angle is not None and self.scene.held(angle)[0] == [i]:
                    found.append((body, self._angle(body)))
            self._deciding[i] = found
        return self._deciding[i]

    def _angle(self, body: str) -> Local:
        return local(self.scene, (body, ANGLE), lambda: self.scene.turn_of(body))


def lattices(scene: Scene, blocks: Sequence[list[int]]) -> list[Lattice]:
    """Return for each block (unknowns in solve order) the whole turns of its angles."""
    joints = scene.model.mechanism.joints
    inside = list(dict.fromkeys(name for group in scene.groups for name in group.joints))
    if not any(joints[name].meshes for name in inside):
        key = ("single turns", *map(tuple, blocks))
        return scene.cache(
            key, lambda: [Lattice(_units(scene, unknowns), len(unknowns)) for unknowns in blocks]
        )
    turned = [i for unknowns in blocks for i in unknowns if scene.unknowns[i].kind is ANGLE]
    place = {i: k for k, i in enumerate(turned)}
    rows = _echelon(_projected(scene, inside, turned))
    pivots = [next(k for k, value in enumerate(row) if value) for row in rows]
    found = []
    for unknowns in blocks:
        columns = {place[i]: j for j, i in enumerate(unknowns) if i in place}
        basis = []
        for row, pivot in zip(rows, pivots, strict=True):
            if pivot in columns:
                vector = [0] * len(unknowns)
                for k, j in columns.items():
                    vector[j] = row[k]
                basis.append(vector)
        found.append(Lattice(basis, len(unknowns)))
    return found


def _units(scene: Scene, own: Sequence[int]) -> list[list[int]]:
    """Return single turns of each angle but those of screws, which are elsewhere after a turn."""
    unknowns, winding = [scene.unknowns[i] for i in own], _winding(scene)
    angles = [j for j, c in enumerate(unknowns) if c.kind is ANGLE and c.owner not in winding]
    return [[int(k == j) for k in range(len(own))] for j in angles]


def _winding(scene: Scene) -> set[str]:
    """Return the screws."""
    return {joint.name for joint in scene.model.mechanism.joints.values() if joint.winds}


def _projected(scene: Scene, inside: Sequence[str], turned: Sequence[int]) -> list[list[int]]:
    """Return the turns of unknown angles that leave all equations unchanged, generators."""
    plane = scene.model.space is PLANE
    names, equations = _equations(scene, inside) if plane else _on_bearings(scene, inside)
    column = {name: k for k, name in enumerate(names)}
    owners = [scene.unknowns[i].owner if plane else scene.x_names[i] for i in turned]
    basis = null_space(equations, len(names))
    rows = [[row[column[name]] if name in column else 0 for name in owners] for row in basis]
    # the tangent's angle of a contact is in no such equation
    loose = [k for k, name in enumerate(owners) if name not in column]
    return rows + [[int(j == k) for j in range(len(owners))] for k in loose]


def _on_bearings(
    scene: Scene, inside: Sequence[str]
) -> tuple[list[tuple[str, str]], list[list[Fraction]]]:
    """Return angles of joints in space, and the equations that their whole turns have to meet.

    Wheels turn in one joint each on their carrier; a rack and a screw keep a wheel from turning.
    """
    from mechdae.describe.joints.bearings import bearings

    mechanism, one = scene.model.mechanism, Fraction(1)
    values = mechanism.values()
    names = [c.key for c in scene.recovered if c.kind is ANGLE]
    place = {name: k for k, name in enumerate(names)}
    sums: list[dict[tuple[str, str], Fraction]] = []
    for name in inside:
        joint = mechanism.joints[name]
        if joint.winds:
            sums.append({(name, "angle"): one})
        if not joint.meshes:
            continue
        first, second = bearings(mechanism, joint)
        ratio = rational(joint.turn_ratio(values)) if joint.wheels > 1 else None
        if ratio is None:
            sums += [{(bearing.joint, bearing.word): one} for bearing in (first, second)]
        else:
            sums.append(
                {
                    (first.joint, first.word): Fraction(int(first.sense)),
                    (second.joint, second.word): -ratio * int(second.sense),
                }
            )
    sums += [{(driver.part, driver.word): one} for driver in scene.drivers]
    rows = [[terms.get(name, Fraction(0)) for name in place] for terms in sums]
    return names, [row for row in rows if any(row)]


def _equations(scene: Scene, inside: Sequence[str]) -> tuple[list[str], list[list[Fraction]]]:
    """Return bodies, and the equations that the whole turns of theirs have to meet."""
    mechanism = scene.model.mechanism
    values = mechanism.values()
    bodies = [name for group in scene.groups for name in group.bodies]
    one = Fraction(1)
    sums: list[dict[str | None, Fraction]] = []
    for name in inside:
        joint = mechanism.joints[name]
        first, second = joint.first_body, joint.second_body
        carrier = getattr(joint, "carrier", None)
        if joint.keeps_angle:
            sums.append(_sum((second, one), (first, -one)))
        elif joint.wheels == 1:
            sums.append(_sum((first, one), (carrier, -one)))
        elif joint.meshes:
            ratio = rational(joint.turn_ratio(values))
            if ratio is None:
                sums += [_sum((body, one), (carrier, -one)) for body in (first, second)]
                continue
            sums.append(_sum((second, ratio), (carrier, 1 - ratio), (first, -one)))
    for driver in scene.drivers:
        if driver.kind == "body angle":
            sums.append(_sum((driver.part, one)))
        elif driver.kind == "joint angle":
            joint = mechanism.joints[driver.part]
            sums.append(_sum((joint.second_body, one), (joint.first_body, -one)))
    place = {name: k for k, name in enumerate(bodies)}
    rows = []
    for terms in sums:
        row = [Fraction(0)] * len(bodies)
        for body, factor in terms.items():
            if body in place:
                row[place[body]] = factor
        rows.append(row)
    return bodies, [row for row in rows if any(row)]


def _sum(*terms: tuple[str | None, Fraction]) -> dict[str | None, Fraction]:
    """Return factors by body; the ground does not turn."""
    found: dict[str | None, Fraction] = {}
    for body, factor in terms:
        if body not in (None, GROUND):
            found[body] = found.get(body, Fraction(0)) + factor
    return found


def null_space(rows: Sequence[Sequence[Fraction]], size: int) -> list[list[int]]:
    """Return a basis of all integer vectors k with rows k = 0."""
    whole = []
    for row in rows:
        scale = math.lcm(*[factor.denominator for factor in row])
        whole.append([int(factor * scale) for factor in row])
    # columns of [A; I], taken to a form in which all of A's zero columns are in the null space
    columns = [
        [*(row[k] for row in whole), *(int(j == k) for j in range(size))] for k in range(size)
    ]
    done = 0
    for i in range(len(whole)):
        done = _cleared(columns, done, i)
    return [column[len(whole) :] for column in columns[done:]]


def _echelon(rows: list[list[int]]) -> list[list[int]]:
    """Return rows that span the same lattice, each beginning behind the one before."""
    rows, done = [list(row) for row in rows], 0
    for j in range(len(rows[0]) if rows else 0):
        done = _cleared(rows, done, j)
    return rows[:done]


def _cleared(rows: list[list[int]], done: int, j: int) -> int:
    """Clear entry `j` in all rows from `done` on but one, which comes first; return the next.

    By Euclid's algorithm, rows are exchanged and subtracted from each other.
    """
    while True:
        held = [i for i in range(done, len(rows)) if rows[i][j]]
        if not held:
            return done
        least = min(held, key=lambda i: abs(rows[i][j]))
        rows[done], rows[least] = rows[least], rows[done]
        if len(held) == 1:
            return done + 1
        for i in range(done + 1, len(rows)):
            times = rows[i][j] // rows[done][j]
            if times:
                rows[i] = [a - times * b for a, b in zip(rows[i], rows[done], strict=True)]


def _shortened(basis: Matrix) -> Floats:
    """Return vectors of the same lattice, none of which gets shorter by another one."""
    basis = basis.copy()
    changed = len(basis) > 1
    while changed:
        changed = False
        for i, j in itertools.permutations(range(len(basis)), 2):
            times = np.round(basis[i] @ basis[j] / (basis[j] @ basis[j]))
            shorter = basis[i] - times * basis[j]
            if times and shorter @ shorter < basis[i] @ basis[i]:
                basis[i], changed = shorter, True
    return basis


def _geared(mechanism: Mechanism) -> list[str]:
    """Return the bodies whose unwrapped angles are in an equation, in declared order."""
    named = set()
    for joint in mechanism.joints.values():
        if joint.meshes:
            named |= {joint.first_body, getattr(joint, "carrier", None)}
            named |= {joint.second_body} if joint.wheels == 2 else set()
    return [name for name in mechanism.bodies if name in named]


def _turning_together(mechanism: Mechanism) -> dict[str, str]:
    """Return by body one of those that keep their angle to it: guided or welded ones."""
    leader = {name: name for name in (GROUND, *mechanism.bodies)}

    def of(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    for joint in mechanism.joints.values():
        if joint.keeps_angle:
            leader[of(joint.first_body)] = of(joint.second_body)
    return {name: of(name) for name in leader}
