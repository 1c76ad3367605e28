"""Forces at poses: signs, table pieces, sizes of friction, reactions, efforts, powers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.continuation.evaluate import Evaluator
from mechdae.describe.named import TIME
from mechdae.describe.tasks.kinds import Reactions
from mechdae.forces.friction_solutions import Branches, FrictionSolutions
from mechdae.forces.meshes import about_meshes, meshes_of, real_along
from mechdae.kernels.graphs.kinetostatics import Balance
from mechdae.kernels.run.batch import Batch
from mechdae.kernels.run.high_precision import LONG, evaluate
from mechdae.model.forces.friction import Laws
from mechdae.model.forces.loads import Loads
from mechdae.model.forces.meshes import Mesh
from mechdae.model.kept import Kept
from mechdae.model.model import Model
from mechdae.model.reduction import Scene

SOLVED = 1e-12
"""Left-over of the sizes of friction, relative to them, that counts as solved."""
QUICKLY = 1e-14
"""The same after the few steps of the quick function; poses above it take more."""
UNIQUE = 0.98
"""Contraction below which the solution is the only one."""
DOUBTFUL = 1e-11
"""Share of all speeds, times the condition, below which a sign is settled in 80-bit floats."""
POINT = 1e-12
"""Share of the mechanism below which the ends of a spring coincide."""
STILL = 1e-14
"""Share of all speeds, times the condition, that the rounding of the data can bring about."""
STANDING = 1e-9
"""Share of all accelerations below which bodies do not move against each other at all."""


@dataclass
class Motion:
    """Poses to be loaded: coordinates of the scene with their rates, rows are poses.

    ``q``, ``v``, ``a`` (n, nc), ``t`` (n,) or None for a task without time; ``x``, ``u`` and
    ``rates`` are unknowns, drivers and the drivers' rates, from which signs are settled;
    ``condition`` (n,) that of the constraints.
    """

    q: Any
    v: Any
    a: Any
    t: Any
    x: Any
    u: Any
    rates: tuple[Any, ...]
    condition: Any

    def rows(self, chosen: Any) -> Motion:
        """Return some of the poses."""
        t = None if self.t is None else self.t[chosen]
        rates = tuple(rate[chosen] for rate in self.rates)
        entries = (self.q, self.v, self.a, self.x, self.u, self.condition)
        q, v, a, x, u, condition = (entry[chosen] for entry in entries)
        return Motion(q, v, a, t, x, u, rates, condition)

    def __len__(self) -> int:
        return len(self.q)


@dataclass
class Loaded:
    """What acts at poses, friction in it or left out.

    Attributes
    ----------
    reactions : (n, joints, 3) array
        Force and moment about the second body's point, on the second body [N, N m].
    efforts : (n, drivers) array
    losses : (n, joints) array
        Power lost [W].
    powers : (n, 5) array
        Of the drivers, of the loads, rate of the kinetic energy [W], kinetic energy [J], sizes of
        all that adds up to the three powers [W].
    normals : (n, guides) array
    imbalance : (n,) array
        What is left of the balance of the bodies, relative to the forces in it.
    """

    reactions: Any
    efforts: Any
    losses: Any
    powers: Any
    normals: Any
    imbalance: Any

    def put(self, rows: Any, other: Loaded | float) -> None:
        """Replace some of the poses by others, or by a number."""
        for entry in fields(self) if len(rows) else ():
            own = getattr(self, entry.name)
            own[rows] = getattr(other, entry.name) if isinstance(other, Loaded) else other


@dataclass
class Forces:
    """Sizes of friction and what acts, without friction and with it.

    ``good`` (n,) tells which poses have proved to have this one solution, see `Branches` for
    others: there `sizes` and `whole` are not solved.
    """

    quiet: Any
    sizes: Any
    good: Any
    free: Loaded
    whole: Loaded


@dataclass(frozen=True)
class Kernels:
    """What acts in a scene and its balance in symbols, kept for other numbers."""

    loads: Loads
    laws: Laws
    meshes: dict[str, Mesh]
    balance: Balance
    kept: Kept = field(default_factory=Kept)


def timed_numbers(model: Model) -> bytes:
    """Return the numbers of a model whose loads have tables over the time: these hold them."""
    loads = model.mechanism.loads.values()
    timed = any(getattr(load, "coordinate", None) == TIME for load in loads)
    return bytes(model.p_values.tobytes()) if timed else b""


class Statics:
    """The balance of forces of a scene as arrays over poses.

    Parameters
    ----------
    scene, evaluator
        Of the kinematics.
    task
        Which friction, and which end drives.
    motion
        Poses that tell real pairs of wheels from mere ratios of angles.
    turned
        Whether resistances push along the motion.
    """

    def __init__(
        self,
        scene: Scene,
        evaluator: Evaluator,
        task: Reactions,
        motion: Motion,
        turned: bool = False,
    ) -> None:
        self.scene, self.evaluator, self.task = scene, evaluator, task
        model = scene.model
        self.p, self.length = model.p_values, model.mechanism.scale
        real = real_along(scene, motion.q, motion.v, self.length)
        friction = task.friction != "none"
        self._key = ("forces", real, task.friction_radius, friction, turned, timed_numbers(model))

        def make() -> Kernels:
            meshes = meshes_of(model, real)
            loads, laws = Loads(model, turned), Laws(model, meshes, task.friction_radius, friction)
            return Kernels(loads, laws, meshes, Balance(scene, loads, laws, meshes))

        self._kernels: Kernels = scene.kept(self._key, make)
        self.loads, self.laws = self._kernels.loads, self._kernels.laws
        self.meshes, self.balance = self._kernels.meshes, self._kernels.balance
        self.assumptions = [*self.laws.assumptions, *about_meshes(self.meshes)]
        self.tables = [np.array(signal.load.points) for signal in self.loads.signals]

    @property
    def frictional(self) -> bool:
        """Whether any joint has friction."""
        return bool(self.balance.active)

    # -- functions -------------------------------------------------------------------------

    def _batch(self, name: str, make: Callable[[], Any]) -> Batch:
        """Return a function of the balance for many poses, with a count of its own."""
        kept: Batch = self._kernels.kept(name, lambda: Batch(make(), self.balance.shared))
        return kept.counting()

    @cached_property
    def _slipping(self) -> Batch:
        batch: Batch = self._kernels.kept("slipping", lambda: Batch(self.balance.slipping, [3]))
        return batch

    @cached_property
    def _solve(self) -> Batch:
        return self._batch("solve", lambda: self.balance.solve)

    @cached_property
    def _quick(self) -> Batch:
        return self._batch("quick", lambda: self.balance.quick)

    @cached_property
    def _whole(self) -> Batch:
        return self._batch("whole", self.balance.report)

    @cached_property
    def _free(self) -> Batch:
        return self._batch("free", lambda: self.balance.report(friction=False))

    @cached_property
    def _static(self) -> Batch:
        return self._batch("static", lambda: self.balance.report(friction=False, base="static"))

    @cached_property
    def branches(self) -> Branches:
        """All solutions of poses where there may be none or several."""
        return Branches(self.balance, self.p, self._stages)

    # -- inputs ----------------------------------------------------------------------------

    def inputs(self, motion: Motion, factor: float = 1.0) -> list[Any]:
        """Return the arrays that the functions of the balance take, sizes left out."""
        n = len(motion)
        t = np.zeros((n, 1)) if motion.t is None else np.reshape(motion.t, (n, 1))
        pieces = self._pieces(motion)
        signs = self.signs(motion)
        return [motion.q, motion.v, motion.a, t, pieces, signs, self.p, np.array([factor])]

    @property
    def _abscissae(self) -> Batch:
        def make() -> Batch:
            at = [signal.at for signal in self.loads.signals]
            inputs = [*self.balance.inputs[:2], self.scene.model.p]
            return Batch(ca.Function("at", inputs, [ca.vertcat(*at)]), [2])

        batch: Batch = self._kernels.kept("abscissae", make)
        return batch

    def _pieces(self, motion: Motion) -> Any:
        """Return abscissa, value and slope of the piece of each table, (n, 3 tables)."""
        n = len(motion)
        columns: list[Any] = []
        if self.tables:
            at = self._abscissae(motion.q, motion.v, self.p)[0]
            for k, table in enumerate(self.tables):
                columns += self._piece(k, table, at[:, k])
        t = np.zeros(n) if motion.t is None else np.reshape(motion.t, n)
        for timed in self.loads.timed:
            columns += list(timed.piece(t).T)
        return np.stack(columns, axis=1) if columns else np.zeros((n, 0))

    def _piece(self, k: int, table: Any, at: Any) -> list[Any]:
        X, Y = table.T
        inside = at
        if self.loads.signals[k].load.periodic:
            inside = X[0] + np.mod(at - X[0], X[-1] - X[0])
        place = np.clip(np.searchsorted(X, inside, side="right") - 1, 0, len(X) - 2)
        slope = (Y[place + 1] - Y[place]) / (X[place + 1] - X[place])
        return [X[place] + (at - inside), Y[place], slope]

    def table_key(self, name: str) -> str:
        """Return the key that gives a table its rows."""
        load = self.scene.model.mechanism.loads[name]
        return "rows" if getattr(load, "file", None) is None else "file"

    def outside(self, motion: Motion) -> dict[str, Any]:
        """Return the poses at which a table has no value, by load."""
        found = {}
        if self.tables:
            at = self._abscissae(motion.q, motion.v, self.p)[0]
            for k, table in enumerate(self.tables):
                load = self.loads.signals[k].load
                slack = 1e-12 * np.abs(table[:, 0]).max()
                with np.errstate(invalid="ignore"):
                    lost = (at[:, k] < table[0, 0] - slack) | (at[:, k] > table[-1, 0] + slack)
                if lost.any() and not load.periodic:
                    found[load.name] = lost
        t = np.zeros(len(motion)) if motion.t is None else np.reshape(motion.t, len(motion))
        for timed in self.loads.timed:
            if timed.ends is not None:
                slack = 1e-12 * max(map(abs, timed.ends))
                lost = (t < timed.ends[0] - slack) | (t > timed.ends[1] + slack)
                if lost.any():
                    found[timed.name.removeprefix("load ")] = lost
        return found

    @property
    def _lengths(self) -> Batch:
        def make() -> Batch:
            own = self.loads.directions
            results = [ca.vertcat(*[d.length for d in own]), ca.vertcat(*[d.pull for d in own])]
            inputs = [*self.balance.inputs[:2], self.scene.model.p, self.loads.time]
            return Batch(ca.Function("lengths", inputs, [ca.densify(r) for r in results]), [2])

        batch: Batch = self._kernels.kept("lengths", make)
        return batch

    def undirected(self, motion: Motion) -> dict[str, Any]:
        """Return the poses at which a spring pulls and has no direction, by load."""
        if not self.loads.directions:
            return {}
        t = np.zeros(len(motion)) if motion.t is None else motion.t
        length, pull = self._lengths(motion.q, motion.v, self.p, np.reshape(t, (-1, 1)))
        lost = (length <= POINT * self.length) & (pull > 0)
        names = [direction.load.name for direction in self.loads.directions]
        return {name: lost[:, k] for k, name in enumerate(names) if lost[:, k].any()}

    def unvalued(self, motion: Motion) -> dict[str, Any]:
        """Return the poses at which a load is not a finite number, by load."""
        loads = self.scene.model.mechanism.loads
        names = [name for name, load in loads.items() if load.expressions]
        if not names:
            return {}

        def make() -> Any:
            wrenches = [self.loads.wrenches[name] for name in names]
            sums = [ca.densify(ca.sum1(ca.fabs(ca.vertcat(0, *w.values())))) for w in wrenches]
            return ca.Function("loads", self.balance.inputs, [ca.vertcat(*sums)])

        function = self._batch("loads", make)
        there = np.isfinite(motion.v).all(axis=1)
        lost = ~np.isfinite(function(*self.inputs(motion))[0]) & there[:, None]
        return {name: lost[:, k] for k, name in enumerate(names) if lost[:, k].any()}

    def signs(self, motion: Motion) -> Any:
        """Return the sign of each sliding speed, (n, slips).

        Where a speed vanishes it is the sign of the coming motion; zero between bodies that do
        not move against each other.
        """
        slips = self.balance.slips
        if not slips:
            return np.zeros((len(motion), 0))
        speeds, rates = self._slipping(motion.q, motion.v, motion.a, self.p)
        signs = np.sign(speeds)
        spins, lengths = self._speeds(motion)
        turns = np.array([slip.unit == "rad" for slip in slips])
        size = np.where(turns, spins[:, None], lengths[:, None])
        digits = np.fmax(motion.condition, 1.0)[:, None]
        doubtful = np.abs(speeds) <= DOUBTFUL * digits * size
        rows = np.flatnonzero(doubtful.any(axis=1))
        if rows.size:
            some = motion.rows(rows)
            exact, rough = self._settled(some)
            least = (digits * size)[rows]
            chosen = np.where(np.abs(exact) > rough * least, np.sign(exact), 0.0)
            spin, length = self._speeds(some, 2)
            change = np.where(turns, spin[:, None], length[:, None])
            with np.errstate(invalid="ignore"):
                moves = np.abs(rates[rows]) > STANDING * change
                coming = np.where(moves, np.sign(rates[rows]), 0.0)
            chosen = np.where(chosen == 0, coming, chosen)
            chosen[~moves & (np.abs(exact) <= STILL * least)] = 0.0  # the rounding of the data
            part = signs[rows]
            part[doubtful[rows]] = chosen[doubtful[rows]]
            signs[rows] = part
        return signs

    def _speeds(self, motion: Motion, order: int = 1) -> tuple[Any, Any]:
        """Return the largest angular speed and speed (or rates of them) at each pose.

        Those of accelerations hold the squares of speeds: what a change of speed is compared
        with.
        """
        coordinates = self.scene.model.coordinates
        angles, places = (
            own[self.balance.columns] for own in (coordinates.turns, coordinates.lengths)
        )
        length = self.length
        spin = np.abs(motion.v[:, angles]).max(axis=1, initial=0.0)
        speed = np.maximum(np.abs(motion.v[:, places]).max(axis=1, initial=0.0), spin * length)
        spin = np.maximum(spin, speed / length if length else 0.0)
        if order == 2:
            turn = np.abs(motion.a[:, angles]).max(axis=1, initial=0.0)
            change = np.abs(motion.a[:, places]).max(axis=1, initial=0.0)
            turn = np.maximum(turn, spin * spin)
            return turn, np.maximum(change, turn * length)
        return spin, speed

    @property
    def _exactly(self) -> Any:
        """(unknowns, drivers, rates, consts) -> sliding speeds, after a Newton step."""
        return self.evaluator.graphs.kept(self._key, self._made_exactly)

    def _made_exactly(self) -> Any:
        g = self.evaluator.graphs
        x, _, trig = g.newton(g.x, g.u)
        parts = g.rates(x, g.u, g.driven, 1, trig)
        scene = g.scene
        coordinates = ca.vertcat(
            *[scene.expression(scene.model.q[j]) for j in self.balance.columns]
        )
        along = ca.SX.sym("along", g.nx + g.nu)
        rate = ca.jtimes(coordinates, ca.vertcat(scene.x, scene.u), along)
        function = ca.Function("q", [scene.x, scene.u, scene.model.p, along], [coordinates, rate])
        q, v = function(x, g.u, g.p, ca.vertcat(parts["v"], g.driven[0]))
        speeds = self.balance.slipping(q, v, 0, g.p)[0]
        inputs = [g.x, g.u, *([] if g.single else [g.driven[0]]), g.consts]
        return (
            ca.Function("refined", inputs[:2] + inputs[-1:], [x]),
            ca.Function("speeds", inputs, [speeds], {"cse": True}),
        )

    def _settled(self, motion: Motion) -> tuple[Any, float]:
        """Return sliding speeds in 80-bit floats, and what is rounding in them."""
        refine, speeds = self._exactly
        g = self.evaluator.graphs
        constants = np.concatenate([self.p, np.ones(g.consts.numel() - len(self.p))])
        consts = np.broadcast_to(constants, (len(motion), len(constants))).astype(LONG)
        x, u = motion.x.astype(LONG), motion.u.astype(LONG)
        with np.errstate(all="ignore"):
            for _ in range(2):
                if g.nx:
                    x = evaluate(refine, [x, u, consts])
            rates = [] if g.single else [motion.rates[0].astype(LONG)]
            found = evaluate(speeds, [x, u, *rates, consts])
        if g.single:  # with respect to the driver
            found = found * motion.rates[0].astype(LONG)
        return found.astype(float), float(64 * np.finfo(LONG).eps)

    # -- solutions -------------------------------------------------------------------------

    def sizes(self, inputs: Sequence[Any]) -> tuple[Any, Any, Any]:
        """Return sizes without and with friction, and which poses are settled by them.

        Poses that are not settled may have no solution or several: see `Branches`.
        """
        if not self.balance.feedbacks:
            nothing = np.zeros((len(inputs[0]), 0))
            return nothing, nothing, np.ones(len(inputs[0]), bool)
        free, whole, miss, contraction = self._solve(*inputs)
        with np.errstate(invalid="ignore"):
            good = np.all(miss <= SOLVED, axis=1) & np.all(contraction <= UNIQUE, axis=1)
        return free, whole, good

    def feeding(self, inputs: Sequence[Any], sizes: Any) -> Any:
        """Return how much friction feeds itself at poses, (n,): at 1 it jams.

        It is the largest real eigenvalue of d size / d m; a feedback that reduces itself is
        negative, however strong.
        """
        found = np.full(len(sizes), -np.inf)
        for slopes in self._gradients(inputs, sizes):
            slopes[~np.isfinite(slopes).all(axis=(1, 2))] = 0.0
            values = np.linalg.eigvals(slopes)
            real = np.abs(values.imag) <= 1e-9 * np.abs(values)
            found = np.fmax(found, np.where(real, values.real, -np.inf).max(axis=1))
        return found

    def _gradients(self, inputs: Sequence[Any], sizes: Any) -> Iterator[Any]:
        """Yield d size / d m of each group, (n, k, k)."""
        for (places, _, laws), values, slope in self._staged(inputs, sizes):
            rows = []
            for own, law, value in zip(slope, laws, values, strict=True):
                if law == "length":
                    size = np.fmax(np.linalg.norm(value, axis=1), 1e-300)
                    rows.append(np.einsum("nr,nkr->nk", value, own) / size[:, None])
                else:
                    most = np.argmax(value, axis=1)[:, None, None]
                    rows.append(np.take_along_axis(own, most, axis=2)[:, :, 0])
            yield np.stack(rows, axis=1).reshape(-1, len(places), len(places))

    def forces(self, inputs: Sequence[Any]) -> Forces:
        """Return sizes and what acts at once: friction with the reactions it feeds."""
        quiet, sizes, miss, contraction, *rest = self._quick(*inputs)
        with np.errstate(invalid="ignore"):
            good = np.all(contraction <= UNIQUE, axis=1)
            slow = np.flatnonzero(good & ~np.all(miss <= QUICKLY, axis=1))
        found = Forces(quiet, sizes, good, self._read(rest[:5]), self._read(rest[5:]))
        if slow.size:
            chosen = some(inputs, slow)
            sizes[slow], good[slow] = self.sizes(chosen)[1:]
            found.whole.put(slow, self.loaded(chosen, sizes[slow]))
        return found

    def settled(
        self, inputs: Sequence[Any], there: Any, critical: bool = True
    ) -> tuple[Forces, dict[int, FrictionSolutions]]:
        """Return the forces, and all solutions of friction at poses with none or several.

        Only poses that are `there` (n,) are examined. Of several solutions the one that
        continues from no friction is taken; poses without a solution are nan.
        """
        forces = self.forces(inputs)
        found: dict[int, FrictionSolutions] = {}
        rows = np.flatnonzero(there & ~forces.good)
        for k in rows:
            found[int(k)] = own = self.branches.at(some(inputs, slice(k, k + 1)), critical)
            forces.sizes[k] = own.sizes[own.connected or 0] if len(own.sizes) else np.nan
        if rows.size:
            forces.whole.put(rows, self.loaded(some(inputs, rows), forces.sizes[rows]))
        return forces, found

    def pieces(self, inputs: Sequence[Any], sizes: Any, jammed: Any) -> Any:
        """Return which piece of each guide, slot and mesh is active, (n, k) whole numbers."""
        columns = []
        for (_, _, laws), values, _ in self._staged(inputs, sizes):
            for value, law in zip(values, laws, strict=True):
                if law == "largest":
                    columns.append(np.where(jammed, 0, np.argmax(value, axis=1)))
        return np.stack(columns, axis=1) if columns else np.zeros((len(sizes), 0), int)

    def _staged(self, inputs: Sequence[Any], sizes: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Yield each group with the forms of its feedbacks (n, rows) and slopes (n, k, rows)."""
        sizes = np.nan_to_num(sizes)
        starts, slopes = self._stages(*inputs, sizes)
        first, second = 0, 0
        for group in self.branches.groups:
            places, forms, _ = group
            rows = sum(s.stop - s.start for s in forms)
            start = starts[:, first : first + rows]
            slope = slopes[:, second : second + rows * len(places)]
            slope = slope.reshape(len(start), len(places), rows)
            value = start + np.einsum("nkr,nk->nr", slope, sizes[:, places])
            yield group, [value[:, own] for own in forms], [slope[:, :, own] for own in forms]
            first, second = first + rows, second + rows * len(places)

    @cached_property
    def most(self) -> float:
        """Factor on friction at which a mesh would lose all of its power, infinite without one."""
        model = self.scene.model
        names = [f"{name}.mesh_loss" for name in self.balance.joints]
        losses = [model.numbers[name] for name in names if name in model.numbers]
        losses_at = self._kernels.kept(
            "losses", lambda: ca.Function("losses", [model.p], [ca.vertcat(0, *losses)])
        )
        values = losses_at(self.p)
        largest = float(ca.mmax(values))
        return (1 + 1e-9) / largest if largest > 0 else np.inf

    @cached_property
    def _stages(self) -> Batch:
        return self._batch("stages", lambda: self.balance.stages)

    def loaded(self, inputs: Sequence[Any], sizes: Any, friction: bool = True) -> Loaded:
        """Return what acts with the sizes of friction given."""
        return self._read((self._whole if friction else self._free)(*inputs, sizes))

    def static(self, inputs: Sequence[Any], sizes: Any) -> Loaded:
        """Return what loads alone do, without inertia and friction."""
        return self._read(self._static(*inputs, sizes))

    def _read(self, results: list[Any]) -> Loaded:
        reactions = results[0].reshape(len(results[0]), -1, 3)
        imbalance = results[5][:, 0] if len(results) > 5 else np.zeros(len(reactions))
        efforts, losses, powers, normals = results[1:5]
        return Loaded(reactions, efforts, losses, powers, normals, imbalance)


def some(inputs: Sequence[Any], rows: Any) -> list[Any]:
    """Return the inputs of the balance at some of the poses."""
    return [array[rows] if array.ndim == 2 else array for array in inputs]
