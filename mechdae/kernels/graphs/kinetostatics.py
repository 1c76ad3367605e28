"""The balance of forces as casadi functions, group by group from the last one to the driver.

    M qdd + h + B lambda = Q + D m,    m_j = size_j(lambda)

with the multipliers lambda of the joints' and drivers' rows and the sizes m of forces that
follow from them: friction, the force that pushes teeth apart. A joint acts on the bodies of
its own group and of earlier ones, so that the groups are solved in reverse order, each with
its own multipliers as unknowns, as the kinetostatics of Assur groups has it (Artobolevsky,
Theory of Mechanisms and Machines, 1988, ch. 13). Inside a group variables with constant
pivots are eliminated; what is left is as small as in kinematics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, LENGTH
from mechdae.describe.mechanism import GROUND
from mechdae.equations.forces.feedback import Feedback, Slip
from mechdae.equations.forces.friction import Laws, normal_form
from mechdae.equations.forces.generalised import (
    MeshForces,
    Wrench,
    add,
    inertia,
    kinetic_energy,
    power,
    put,
    reaction,
    times,
)
from mechdae.equations.forces.loads import Loads
from mechdae.equations.groups import Group
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.blocks import column
from mechdae.kernels.graphs.friction_sizes import (
    contraction_of,
    miss_of,
    most,
    size_of,
    sizes_by_newton,
)
from mechdae.kernels.graphs.linear import among, solution
from mechdae.kernels.run.functions import without_repeats
from mechdae.records import dataclass
from mechdae.types import Graph, Sym

SX = ca.SX
NEWTON, QUICK = 6, 3
"""Steps of Newton's method for the sizes of a group, from their values without friction: where
those of the quick function are not enough, and in that one."""
ALL, SPEEDS, RATES = range(8), (0, 1, 6), (0, 1, 2, 6)
"""Places of the inputs that functions take: all, those of speeds, those of their rates."""


@dataclass
class Share:
    """A group in the balance: its rows and columns, the solver, its own feedbacks.

    ``feedbacks`` are places in `Balance.feedbacks`; ``forms`` says which rows of the stacked
    linear forms belong to each of them.
    """

    group: Group
    rows: list[int]
    columns: list[int]
    solve: Any
    feedbacks: list[int]
    forms: list[slice]

    def multipliers(self, push: Wrench) -> dict[int, Any]:
        """Return the multipliers by row that balance a generalised force."""
        free = self.solve(ca.vertcat(*[push.get(j, SX(0)) for j in self.columns]))
        return dict(zip(self.rows, ca.vertsplit(free), strict=True)) if self.rows else {}


class Balance:
    """Functions of the balance of a scene.

    Parameters
    ----------
    scene
        Groups and rows.
    loads, laws, meshes
        What acts. Laws without friction build no friction, loads of a slow motion no inertia.

    Attributes
    ----------
    columns : list of int
        Positions in q of the scene's coordinates.
    inputs : list of SX
        What the functions take: w, dw, ddw as of `motion_of`, the time, pieces of tables, signs,
        p, a factor on all friction.
    slips : list of Slip
        Speeds whose signs are inputs, those of friction first.
    feedbacks : list of Feedback
    joints : list of str
        Joints of the scene in declared order.
    """

    def __init__(
        self, scene: Scene, loads: Loads, laws: Laws, meshes: Mapping[str, MeshForces]
    ) -> None:
        self.scene: Scene = scene
        self.model: Model = scene.model
        self.loads: Loads = loads
        self.laws: Laws = laws
        self.meshes = meshes
        self.columns: list[int] = columns_of(scene)
        owners = {name for group in scene.groups for name in group.joints}
        self.joints: list[str] = [name for name in self.model.mechanism.joints if name in owners]
        self.bodies: list[str] = scene.bodies
        self.rows_of: dict[str, list[int]] = {name: [] for name in self.joints}
        for group in scene.groups:
            for i in group.rows:
                if not scene.rows[i].driver:
                    self.rows_of.setdefault(scene.rows[i].owner, []).append(i)
        self.feedbacks: list[Feedback] = []
        self._of_joint: dict[str, list[int]] = {}
        for name in self.joints:
            feedbacks = laws.of(name)
            places = range(len(self.feedbacks), len(self.feedbacks) + len(feedbacks))
            self._of_joint[name] = list(places)
            self.feedbacks += feedbacks
        self.slips: list[Slip] = [*laws.slips, *loads.slips]
        self._make_columns()
        self.shares: list[Share] = [self._share(group) for group in reversed(scene.groups)]
        self.signs: Sym = (
            ca.vertcat(*[slip.sign for slip in self.slips]) if self.slips else SX(0, 1)
        )
        pieces = [signal.piece for signal in loads.signals]
        pieces += [table.symbols for table in loads.timed]
        self.pieces: Sym = ca.vertcat(*pieces) if pieces else SX(0, 1)
        self.sizes: Sym = SX.sym("m", len(self.feedbacks))
        self.inputs: list[Sym] = [
            *motion_of(scene)[0], loads.time, self.pieces, self.signs, self.model.p, laws.factor
        ]  # fmt: skip
        self.inertia: Wrench = {} if loads.slow else inertia(self.model, self.bodies)
        self.applied: Wrench = add(loads.total, *[mesh.steady for mesh in meshes.values()])

    @cached_property
    def active(self) -> list[int]:
        """Places of the feedbacks that are friction."""
        return [j for j, feedback in enumerate(self.feedbacks) if feedback.friction]

    @cached_property
    def lossy(self) -> list[str]:
        """The joints that have friction."""
        lossy = {self.feedbacks[j].joint for j in self.active}
        return [name for name in self.joints if name in lossy]

    def _make_columns(self) -> None:
        rows = self.scene.rows
        self.column: list[Wrench] = self.model.columns_of(rows)
        for name, mesh in self.meshes.items():
            if mesh.column is not None:
                for i in self.rows_of.get(name, []):
                    self.column[i] = mesh.column

    # -- one group ---------------------------------------------------------------------------

    def _share(self, group: Group) -> Share:
        rows, columns = list(group.rows), list(group.columns)
        place = {j: k for k, j in enumerate(columns)}
        multipliers, forms, start = [], [], 0
        for name in group.joints:
            for k in self._of_joint.get(name, []):
                multipliers.append(k)
                count = self.feedbacks[k].forms.shape[0]
                forms.append(slice(start, start + count))
                start += count
        push = SX.sym("push", len(columns))
        lam = [SX.sym(f"lam{i}") for i in rows]
        balance = [-push[k] for k in range(len(columns))]
        for i, symbol in zip(rows, lam, strict=True):
            for j, entry in self.column[i].items():
                if j in place:
                    balance[place[j]] += entry * symbol
        solved = solution(balance, lam) if rows else SX(0, 1)  # points that others carry have none
        symbols = ca.symvar(SX(ca.vertcat(*balance)))
        held = [s for s in symbols if not among(s, [*lam, push])]
        at = ca.vertcat(*held) if held else SX(0, 1)
        function = ca.Function("solve", [at, push], [solved])
        return Share(group, rows, columns, lambda value: function(at, value), multipliers, forms)

    def _forms(self, share: Share, lam: dict[int, Sym], k: int, acting: Wrench) -> Sym:
        """Return the linear forms of a feedback for multipliers by row, and what acts beside them.

        In space they are forms of the joint's reaction.
        """
        feedback = self.feedbacks[k]
        if self.model.space.behind:
            wrench = [acting.get((feedback.joint, c), SX(0)) for c in range(6)]
            for i, value in lam.items():
                for c in range(6):
                    entry = self.column[i].get((feedback.joint, c))
                    wrench[c] = wrench[c] if entry is None else wrench[c] - entry * value
            return feedback.forms @ ca.vertcat(*wrench)
        forces = ca.vertcat(*[lam.get(i, SX(0)) for i in self.rows_of[feedback.joint]])
        return feedback.forms @ forces

    # -- all groups ----------------------------------------------------------------------------

    def chain(
        self,
        base: Wrench,
        used: set[int],
        sizes: Sym | None = None,
        steps: int = 0,
        guess: Any = None,
    ) -> Chain:
        """Return the multipliers under a generalised force `base`.

        Parameters
        ----------
        used
            Feedbacks that act.
        sizes
            Their sizes (all feedbacks, others are not read); None: solved for with `steps` of
            Newton's method, from `guess` or else from their values at m = 0.
        """
        left = dict(base)
        lam: dict[int, Sym] = {}
        found = SX.zeros(len(self.feedbacks))
        result = Chain(lam, found, left)
        for share in self.shares:
            value = share.multipliers(left)
            feedbacks = [k for k in share.feedbacks if k in used]
            if feedbacks:
                causes = [self.feedbacks[k].column for k in feedbacks]
                effects = [share.multipliers(column) for column in causes]
                start = [self._forms(share, value, k, left) for k in feedbacks]
                slope = [
                    [
                        self._forms(share, effect, k, column)
                        for effect, column in zip(effects, causes, strict=True)
                    ]
                    for k in feedbacks
                ]
                result.start[share.group.index] = (feedbacks, start, slope)
                laws = [self.feedbacks[k].law for k in feedbacks]
                if sizes is None:
                    first = None if guess is None else [guess[k] for k in feedbacks]
                    m = sizes_by_newton(laws, start, slope, steps, first)
                    result.misses.append(miss_of(laws, start, slope, m))
                    result.contractions.append(contraction_of(laws, start, slope))
                else:
                    m = [sizes[k] for k in feedbacks]
                for k, size in zip(feedbacks, m, strict=True):
                    found[k] = size
                    put(left, size, self.feedbacks[k].column)
                for i in share.rows:
                    for effect, size in zip(effects, m, strict=True):
                        value[i] = value[i] + effect[i] * size
            lam.update(value)
            for i in share.rows:
                put(left, -value[i], self.column[i])
        return result

    @property
    def base(self) -> Wrench:
        """Loads less inertia."""
        return add(self.applied, times(-1, self.inertia))

    # -- functions ---------------------------------------------------------------------------

    def function(
        self, name: str, results: list[Sym], take: Sequence[int] = ALL, more: Sequence[Sym] = ()
    ) -> Graph:
        """Return a function over some of the inputs, and `more`, of expressions over q, v, a."""
        return driven(self.scene, name, results, [*[self.inputs[k] for k in take], *more])

    @cached_property
    def slipping(self) -> Graph:
        """(w, dw, p) -> relative speeds, largest angular speed and speed of the coordinates."""
        speeds = ca.vertcat(*[slip.speed for slip in self.slips]) if self.slips else SX(0, 1)
        return self.function("slipping", [speeds, self._sizes(self.model.velocity)], SPEEDS)

    @cached_property
    def coming(self) -> Graph:
        """(w, dw, ddw, p) -> rates of the relative speeds, largest rates of the coordinates'."""
        q, v, a = self.model.q, self.model.velocity, self.model.acceleration
        speeds = ca.vertcat(*[slip.speed for slip in self.slips]) if self.slips else SX(0, 1)
        rates = ca.jtimes(speeds, ca.vertcat(q, v), ca.vertcat(v, a))
        return self.function("coming", [rates, self._sizes(a)], RATES)

    def _sizes(self, rates: Sym) -> Sym:
        """Return the largest of the rates of angles, and that of lengths."""
        coordinates = self.model.coordinates
        masks = [ca.DM(np.isin(self.columns, np.flatnonzero(kind))) for kind in (
            coordinates.turns, coordinates.lengths
        )]  # fmt: skip
        return ca.vertcat(*[most(rates[self.columns] * kind) for kind in masks])

    @cached_property
    def solve(self) -> Graph:
        """Sizes of the feedbacks without and with friction, and whether they can be trusted.

        (inputs) -> m without friction (its own law at those reactions), m with it, the
        largest left-over of each group relative to its sizes, contraction of each group.
        """
        law = self._free()[1]
        whole = self.chain(self.base, self._used(friction=True), steps=NEWTON)
        return self.function("solve", [law, *whole.solution])

    def _free(self) -> tuple[Chain, Sym]:
        """Return the balance without friction, and the sizes of all feedbacks by their laws."""
        free = self.chain(self.base, self._used(friction=False), steps=1)
        law = SX(free.sizes)
        for share in self.shares:
            for k in share.feedbacks:
                if self.feedbacks[k].friction:
                    lam = {} if self.model.space.behind else free.lam
                    forms = self._forms(share, lam, k, free.left)
                    law[k] = size_of(self.feedbacks[k].law, forms)
        return free, law

    def _used(self, friction: bool) -> set[int]:
        return {k for k, feedback in enumerate(self.feedbacks) if friction or not feedback.friction}

    @cached_property
    def quick(self) -> Graph:
        """All at once for poses whose sizes a few steps of Newton's method find.

        (inputs) -> the results of `solve`, of the `report` without friction and of the one with it.
        """
        free, law = self._free()
        every = self._used(friction=True)
        whole = self.chain(self.base, every, steps=QUICK)
        results = [law, *whole.solution, *self._reported(free, self._used(friction=False), law)]
        results += self._reported(whole, every, whole.sizes)
        return self.function("quick", results)

    def refined(self, steps: int) -> Graph:
        """Return the function (inputs, m) -> m after some steps of Newton's method."""
        chain = self.chain(self.base, self._used(friction=True), steps=steps, guess=self.sizes)
        return self.function("refined", [chain.sizes], more=[self.sizes])

    @cached_property
    def stages(self) -> Graph:
        """(inputs, m) -> linear forms of each group without its own sizes, and their slopes.

        Forms are stacked in the order of `self.shares`, slopes column by column.
        """
        chain = self.chain(self.base, self._used(friction=True), sizes=self.sizes)
        starts, slopes = [], []
        for share in self.shares:
            rows, start, slope = chain.start.get(share.group.index, ([], [], []))
            starts += start
            for j in range(len(rows)):
                slopes += [slope[i][j] for i in range(len(rows))]
        return self.function("stages", [column(starts), column(slopes)], more=[self.sizes])

    def report(self, friction: bool = True, base: Wrench | None = None) -> Graph:
        """Return the function of what is reported with sizes given, under `base` or all forces.

        (inputs, m) -> reactions (3 joints,), efforts (drivers,), losses (lossy joints,), normal
        forces (guides,).
        """
        used = self._used(friction)
        chain = self.chain(self.base if base is None else base, used, sizes=self.sizes)
        return self.function("report", self._reported(chain, used, self.sizes), more=[self.sizes])

    def _reported(self, chain: Chain, used: set[int], sizes: Sym) -> list[Sym]:
        """Return the results of `report` for multipliers and sizes."""
        reactions: list[Sym] = []
        for name in self.joints:
            behind = self.model.space.behind
            acting = chain.left if behind else self._of(name, chain.lam, used, sizes)
            reactions += reaction(self.model, name, acting)
        efforts = [-chain.lam[i] for i, row in enumerate(self.scene.rows) if row.driver]
        losses = [self._loss(name, sizes) for name in self.lossy]
        return [column(part) for part in (reactions, efforts, losses, self._normals(chain.lam))]

    def _of(self, name: str, lam: dict[int, Sym], used: set[int], sizes: Sym) -> Wrench:
        """Return the generalised force of a joint, friction included."""
        parts = [times(-lam[i], self.column[i]) for i in self.rows_of[name]]
        feedbacks = [k for k in self._of_joint[name] if k in used]
        parts += [times(sizes[k], self.feedbacks[k].column) for k in feedbacks]
        if name in self.meshes:
            parts.append(self.meshes[name].steady)
        return add(*parts)

    def _loss(self, name: str, sizes: Sym) -> Sym:
        feedbacks = [k for k in self._of_joint[name] if self.feedbacks[k].friction]
        return sum((self.feedbacks[k].rate * sizes[k] for k in feedbacks), SX(0))

    @cached_property
    def powers(self) -> Graph:
        """(inputs) -> power of the loads, rate of the kinetic energy, it itself, and the sizes of
        all that adds up to the two powers.
        """
        loads = power(self.model, self.loads.total)
        slow = self.loads.slow
        energy, rate = (SX(0), SX(0)) if slow else kinetic_energy(self.model, self.bodies)
        single = [*loads, *power(self.model, self.inertia)]
        sizes = sum((ca.fabs(power) for power in single), SX(0))
        return self.function("powers", [column([sum(loads, SX(0)), rate, energy, sizes])])

    def _normals(self, lam: dict[int, Sym]) -> list[Sym]:
        """Return the normal force of guides, slots and curves, + along the left normal."""
        found = []
        for name in self.guides:
            multipliers = ca.vertcat(*[lam[i] for i in self.rows_of[name]])
            found.append(-normal_form(self.model.ends[name]) @ multipliers)
        return found

    @property
    def guides(self) -> list[str]:
        """Joints with a normal force, in the order of the reported ones."""
        joints = self.model.mechanism.joints
        return [n for n in self.joints if joints[n].normal_force and not joints[n].spatial]

    def imbalance(self, friction: bool) -> Graph:
        """Return the function (inputs, m, reactions, efforts) -> what is left of the balance.

        That is of the bodies under the reported reactions, relative to the largest force and the
        largest moment in it; a force counts with its arm, whatever the angle between them, so that
        poses where moments vanish (dead centres) are not measured by their rounding.
        """
        used = self._used(friction)
        model, moments = self.model, []
        width = model.space.freedoms
        reactions = SX.sym("reactions", width * len(self.joints))
        efforts = SX.sym("efforts", len(self.scene.drivers))
        parts = [times(-1, self.inertia), self.loads.total]
        for c, effort in zip(self.scene.drivers, ca.vertsplit(efforts), strict=True):
            parts.append(times(effort, model.gradient(c)))
        more = [self.sizes, reactions, efforts]
        if model.space.behind:
            wrenches = [reactions[width * k : width * (k + 1)] for k in range(len(self.joints))]
            known = dict(zip(self.joints, wrenches, strict=True))
            worst = model.space.imbalance(model, self.bodies, parts, known)
            return self.function("imbalance", [worst], more=more)
        for k, name in enumerate(self.joints):
            joint, place = model.mechanism.joints[name], model.ends[name].p2
            if name in self.meshes and (
                self.meshes[name].column is None or (name in self.lossy and joint.strands)
            ):
                lam = self.chain(self.base, used, sizes=self.sizes).lam
                parts.append(self._of(name, lam, used, self.sizes))  # a couple on three bodies
                continue
            fx, fy, moment = ca.vertsplit(reactions[3 * k : 3 * k + 3])
            for body, sign in ((joint.second_body, 1), (joint.first_body, -1)):
                if body != GROUND:
                    arm = place - model.frame(body).r
                    x, y, turn = model.twist(body)
                    turned = moment + arm[0] * fy - arm[1] * fx
                    moments.append(ca.norm_1(arm) * (ca.fabs(fx) + ca.fabs(fy)))
                    parts.append({x: sign * fx, y: sign * fy, turn: sign * turned})
        left, worst = add(*parts), []
        for kind in (LENGTH, ANGLE):
            places = [i for body in self.bodies for i in model.twist(body)]
            places = [i for i in places if model.coordinates[i].kind is kind]
            gap = most(column([left.get(j, SX(0)) for j in places]))
            sizes = [part[j] for part in parts for j in places if j in part]
            size = most(column([*sizes, *(moments if kind is ANGLE else [])]))
            worst.append(ca.if_else(size > 0, gap / size, 0))
        return self.function("imbalance", [ca.fmax(*worst)], more=more)


class Chain:
    """Multipliers by row and sizes of feedbacks; what the solution of the sizes looked like.

    ``left`` is the sum of all that acts: nothing is left of it at the scene's coordinates.
    """

    def __init__(self, lam: dict[int, Sym], sizes: Sym, left: Wrench) -> None:
        self.lam: dict[int, Sym] = lam
        self.sizes: Sym = sizes
        self.left: Wrench = left
        self.start: dict[int, tuple[list[int], list[Any], list[list[Any]]]] = {}
        self.misses: list[Sym] = []
        self.contractions: list[Sym] = []

    @property
    def solution(self) -> list[Sym]:
        """Sizes, the largest left-over of each group relative to its sizes, contractions."""
        return [self.sizes, column(self.misses), column(self.contractions)]


def columns_of(scene: Scene) -> list[int]:
    """Return the positions in q of a scene's coordinates."""
    return sorted(j for group in scene.groups for j in group.columns)


def motion_of(scene: Scene) -> tuple[list[Sym], list[Sym]]:
    """Return w, dw, ddw and the scene's coordinates, speeds, accelerations over them.

    w are the unknowns and the drivers' values: all the rest of a pose follows from them.
    """

    def make() -> tuple[list[Sym], list[Sym]]:
        w = ca.vertcat(scene.x, scene.u)
        dw, ddw = SX.sym("dw", w.numel()), SX.sym("ddw", w.numel())
        q = SX(scene.expression(scene.model.q[columns_of(scene)]))
        v = ca.jtimes(q, w, dw)
        a = ca.jtimes(v, ca.vertcat(w, dw), ca.vertcat(dw, ddw))
        return [w, dw, ddw], [q, v, a]

    return scene.cache("motion of coordinates", make)


def driven(scene: Scene, name: str, results: Sequence[Sym], inputs: Sequence[Sym]) -> Graph:
    """Return a function over w, dw, ddw among other inputs of expressions over q, v, a."""
    model, columns = scene.model, columns_of(scene)
    moved, coordinates = motion_of(scene)
    absolute = [model.q[columns], model.velocity[columns], model.acceleration[columns]]
    others = [entry for entry in inputs if all(entry is not w for w in moved)]
    general = ca.Function(name, [*absolute, *others], [ca.densify(r) for r in results])
    found = general.call([*coordinates, *others])
    return without_repeats(name, list(inputs), [ca.densify(r) for r in found])
