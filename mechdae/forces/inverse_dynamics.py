"""Forces at poses: signs, table pieces, sizes of friction, reactions, efforts, powers."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import field, fields
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.named import TIME
from mechdae.describe.structure import structure_of
from mechdae.describe.tasks.motion import Reactions
from mechdae.equations.forces.friction import Laws
from mechdae.equations.forces.generalised import MeshForces
from mechdae.equations.forces.loads import BOUNDLESS, Loads
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene
from mechdae.equations.structure_cache import StructureCache
from mechdae.forces.friction_branches import Branches, Stage, some
from mechdae.kernels.graphs.kinetostatics import ALL, RATES, SPEEDS, Balance, motion_of
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.kernels.run.high_precision import LONG, evaluate
from mechdae.kernels.stored.functions import fingerprint, functions_are_kept, stored
from mechdae.motion.continuation.evaluate import Evaluator
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Integers, Matrices, Matrix, Points

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
NUMBERS, FACTOR = 6, 7
"""Places of p and of the factor on friction among the inputs of a balance."""
STANDING = 1e-9
"""Share of all accelerations below which bodies do not move against each other at all."""


@dataclass
class LoadedPoses:
    """Poses to be loaded, rows are poses; nan where one has no value.

    ``w``, ``v``, ``a`` (n, nx + nu) are unknowns and drivers' values with their rates in time,
    ``t`` (n,) or None for a task without time, ``condition`` (n,) that of the constraints; ``nx``
    the number of unknowns. Poses of several mechanisms have numbers ``p`` (n, np) and a ``length``
    (n,) of their own; None: those of the scene.
    """

    w: Matrix
    v: Any
    a: Matrix
    t: Floats | None
    condition: Any
    nx: int
    p: Any = None
    length: Any = None

    @property
    def x(self) -> Any:
        """Unknowns."""
        return self.w[:, : self.nx]

    @property
    def u(self) -> Any:
        """Drivers' values."""
        return self.w[:, self.nx :]

    @property
    def speeds(self) -> Any:
        """The drivers' speeds."""
        return self.v[:, self.nx :]

    @property
    def times(self) -> Floats:
        """Times (n, 1), 0 without any."""
        return np.zeros((len(self), 1)) if self.t is None else np.reshape(self.t, (-1, 1))

    @cached_property
    def there(self) -> Any:
        """Which poses have accelerations."""
        return np.isfinite(self.a).all(axis=1)

    def rows(self, chosen: Integers | list[int]) -> LoadedPoses:
        """Return some of the poses."""
        t = None if self.t is None else self.t[chosen]
        w, v, a, condition = (array[chosen] for array in (self.w, self.v, self.a, self.condition))
        p, length = (None if array is None else array[chosen] for array in (self.p, self.length))
        return LoadedPoses(w, v, a, t, condition, self.nx, p, length)

    def __len__(self) -> int:
        return len(self.w)


def absolute(scene: Scene, motion: LoadedPoses) -> list[Floats]:
    """Return the scene's coordinates and speeds at poses, (n, columns) each."""

    def build() -> Batch:
        (w, dw, _), (q, v, _) = motion_of(scene)
        results = [ca.densify(q), ca.densify(v)]
        return Batch(ca.Function("absolute", [w, dw, scene.model.p], results), shared)

    shared = [2] if motion.p is None else []
    batch: Batch = scene.cache(("absolute coordinates", *shared), build)
    return batch(motion.w, motion.v, scene.model.p_values if motion.p is None else motion.p)


@dataclass
class Loaded:
    """What acts at poses, friction in it or left out.

    ``reactions`` (n, joints, 3), in space (n, joints, 6), are force and moment about the second
    body's point, on the second body [N, N m]; ``efforts`` (n, drivers), ``losses`` (n, joints with
    friction) of power [W], ``normals`` (n, guides).
    """

    reactions: Matrices
    efforts: Floats
    losses: Floats
    normals: Floats

    def put(self, rows: Integers, other: Loaded | float) -> None:
        """Replace some of the poses by others, or by a number."""
        for entry in fields(self) if len(rows) else ():
            values = getattr(self, entry.name)
            values[rows] = getattr(other, entry.name) if isinstance(other, Loaded) else other

    def driven(self, motion: LoadedPoses) -> Any:
        """Return the power of the drivers (n,) [W]."""
        return np.einsum("nk,nk->n", self.efforts, motion.speeds)


@dataclass(frozen=True)
class Kernels:
    """What acts in a scene and its balance in symbols, kept for other numbers."""

    loads: Loads
    laws: Laws
    meshes: Mapping[str, MeshForces]
    balance: Balance
    cache: StructureCache = field(default_factory=StructureCache)


def timed_numbers(model: Model) -> bytes:
    """Return the numbers of a model whose loads have tables over the time: these hold them."""
    loads = model.mechanism.loads.values()
    timed = any(getattr(load, "coordinate", None) == TIME for load in loads)
    return bytes(model.p_values.tobytes()) if timed else b""


class InverseDynamics:
    """The balance of forces of a scene as arrays over poses.

    Parameters
    ----------
    scene, evaluator
        Of the kinematics.
    task
        Which friction, and which end drives.
    motion
        Poses that tell real pairs of wheels from mere ratios of angles.
    """

    single: frozenset[int] = frozenset((NUMBERS, FACTOR))
    """Inputs of a balance that have one value for all poses."""

    def __init__(
        self, scene: Scene, evaluator: Evaluator, task: Reactions, motion: LoadedPoses
    ) -> None:
        self.scene: Scene = scene
        self.evaluator: Evaluator = evaluator
        self.task: Reactions = task
        model = scene.model
        self.p: Floats = model.p_values
        self.length: float = model.mechanism.scale
        self._last: tuple[LoadedPoses, float, list[Floats]] | None = None
        cases, poses = scene.cases("forces of joints"), lambda: absolute(scene, motion)
        pairs = (case.real_along(scene, poses, self.length) for case in cases)
        real: tuple[Any, ...] = sum(pairs, ())
        rubs, turned, slow = task.friction != "none", task.direction == "load", task.quasi_static
        self.key: tuple[Hashable, ...] = (
            "forces", real, task.friction_radius, rubs, turned, slow, timed_numbers(model)
        )  # fmt: skip

        def build() -> Kernels:
            meshes = {name: mesh for c in cases for name, mesh in c.meshes_of(model, real).items()}
            laws = Laws(model, meshes, task.friction_radius, rubs)
            loads = Loads(model, turned, slow=slow, heavy=scene.bodies)
            return Kernels(loads, laws, meshes, Balance(scene, loads, laws, meshes))

        self._kernels: Kernels = scene.cache(self.key, build)
        self.loads: Loads = self._kernels.loads
        self.laws: Laws = self._kernels.laws
        self.meshes: Mapping[str, MeshForces] = self._kernels.meshes
        self.balance: Balance = self._kernels.balance
        notes = (n for case in cases for n in case.about_meshes(self.meshes, model.mechanism))
        self.assumptions: list[str] = [*self.laws.assumptions, *notes]
        self.tables: list[Floats] = [np.array(signal.load.points) for signal in self.loads.signals]

    @property
    def coupled(self) -> bool:
        """Whether any joint has friction that acts on the reactions it comes from."""
        return self.task.friction == "coupled" and bool(self.balance.active)

    # -- functions -------------------------------------------------------------------------

    def batch(
        self, name: str, make: Callable[[], Any], take: Sequence[int] = ALL, factors: bool = False
    ) -> Batch:
        """Return a function of the balance for many poses, with a count of its own.

        With `factors` each pose has a factor on friction of its own.
        """
        single = self.single - ({FACTOR} if factors else set())
        shared = [place for place, k in enumerate(take) if k in single]
        kept: Batch = self._kernels.cache(
            (name, *shared), lambda: Batch(self._stored(name, make), shared)
        )
        return kept.counting()

    def _stored(self, name: str, make: Callable[[], Any]) -> Graph:
        """Return a function of the balance, read from disk where an earlier process built it."""
        if not functions_are_kept() or self.fingerprint is None:
            return make()
        return stored(fingerprint(self.fingerprint, name), make)

    @property
    def fingerprint(self) -> str | None:
        """What names these kernels on disk: all that they are built from; None: they are not kept.

        That is what decides the shape of the task in memory, and the groups that are solved in
        turn. Meshes and tables over the time are built for numbers of their own.
        """
        scene, model = self.scene, self.scene.model
        equations = self.evaluator.graphs.fingerprint
        if equations is None or self.meshes or self.loads.timed:
            return None

        def build() -> str:
            structure = structure_of(model.mechanism)
            numbers = [
                (name, repr(float(number)) if number.is_constant() else str(number))
                for name, number in ((n, ca.SX(symbol)) for n, symbol in model.numbers.items())
            ]
            groups = [
                (g.index, g.bodies, g.joints, g.rows, g.columns, g.superfluous)
                for g in scene.groups
            ]
            drivers = [c.text for c in scene.drivers]
            return fingerprint(
                equations, self.key, structure, list(model.p_names), numbers, groups, drivers,
                scene.x_names, self.balance.columns,
            )  # fmt: skip

        return self._kernels.cache("fingerprint", build)

    def _of(self, name: str) -> Batch:
        """Return a function of the balance by its name."""
        take = {"slipping": SPEEDS, "coming": RATES}.get(name, ALL)
        return self.batch(name, lambda: getattr(self.balance, name), take)

    def powers(self, inputs: Sequence[Floats]) -> Floats:
        """Return those of the balance at poses, (4, n)."""
        return self._of("powers")(*inputs)[0].T

    def imbalance(
        self, inputs: Sequence[Floats], sizes: Floats, loaded: Loaded, friction: bool
    ) -> Floats:
        """Return what is left of the balance of the bodies under what is reported, (n,)."""
        name = f"imbalance {friction}"
        function = self.batch(name, lambda: self.balance.imbalance(friction))
        reactions = loaded.reactions.reshape(len(sizes), -1)
        return function(*inputs, sizes, reactions, loaded.efforts)[0][:, 0]

    @cached_property
    def branches(self) -> Branches:
        """All solutions of poses where there may be none or several."""
        by_factor = self.batch("stages", lambda: self.balance.stages, factors=True)
        return Branches(self.balance, self._of("stages"), by_factor)

    # -- inputs ----------------------------------------------------------------------------

    def inputs(self, motion: LoadedPoses, factor: float = 1.0) -> list[Any]:
        """Return the arrays that the functions of the balance take, sizes left out.

        Those of the motion that was asked for last are kept.
        """
        if self._last is None or self._last[0] is not motion or self._last[1] != factor:
            self._last = (motion, factor, self._inputs(motion, factor))
        return list(self._last[2])

    def _inputs(self, motion: LoadedPoses, factor: float) -> list[Floats]:
        pieces, signs = self._pieces(motion), self.signs(motion)
        return [
            motion.w, motion.v, motion.a, motion.times, pieces, signs, self._p(motion),
            np.array([factor]),
        ]  # fmt: skip

    @cached_property
    def abscissae(self) -> Batch:
        """(w, dw, p) -> where each table is read."""
        at = [signal.at for signal in self.loads.signals]

        def build() -> Graph:
            return self.balance.function("at", [ca.vertcat(*at)], SPEEDS)

        return self.batch("abscissae", build, SPEEDS)

    def _pieces(self, motion: LoadedPoses) -> Floats:
        """Return abscissa, value and slope of the piece of each table, (n, 3 tables)."""
        n = len(motion)
        columns: list[Floats] = []
        if self.tables:
            at = self.abscissae(motion.w, motion.v, self._p(motion))[0]
            for k, table in enumerate(self.tables):
                columns += self._piece(k, table, at[:, k])[:3]
        for timed in self.loads.timed:
            columns += list(timed.piece(motion.times[:, 0]).T)
        return np.stack(columns, axis=1) if columns else np.zeros((n, 0))

    def _piece(self, k: int, table: Points, at: Floats) -> list[Floats]:
        X, Y = table.T
        inside, turns = at, 0 * at
        if self.loads.signals[k].load.periodic:
            turns = np.floor((at - X[0]) / (X[-1] - X[0]))
            inside = X[0] + np.mod(at - X[0], X[-1] - X[0])
        place = np.clip(np.searchsorted(X, inside, side="right") - 1, 0, len(X) - 2)
        slope = (Y[place + 1] - Y[place]) / (X[place + 1] - X[place])
        return [X[place] + (at - inside), Y[place], slope, np.nan_to_num(turns) * len(X) + place]

    def cells(self, motion: LoadedPoses) -> Iterator[tuple[Any, Any]]:
        """Yield a number (n,) for the piece of each table, its abscissa and the piece's (n, 2)."""
        for k, table in enumerate(self.tables):
            at = self.abscissae(motion.w, motion.v, self._p(motion))[0][:, k]
            start, *_, cell = self._piece(k, table, at)
            yield cell, np.stack([at, start], axis=1)
        for timed in self.loads.timed:
            turn, start = timed.piece(motion.times[:, 0]).T[:2]
            rows = np.searchsorted(timed.X, start)
            yield turn * len(timed.X) + rows, np.stack([motion.times[:, 0], np.nan * start], axis=1)

    def speeds(self, motion: LoadedPoses) -> Any:
        """Return the sliding speeds, (n, slips)."""
        return self._of("slipping")(motion.w, motion.v, self._p(motion))[0]

    def lost(self, motion: LoadedPoses) -> Iterator[tuple[str, Booleans, str, str, str]]:
        """Yield loads that may have no value: name, poses (n,), what is wrong, its key, a hint."""
        loads = self.scene.model.mechanism.loads
        for name, (low, high), at in self._ends(motion):
            slack = 1e-12 * max(abs(low), abs(high))
            with np.errstate(invalid="ignore"):
                outside = (at < low - slack) | (at > high + slack)
            key = ".rows" if getattr(loads[name], "file", None) is None else ".file"
            text = "the table ends before the motion does: no value"
            yield name, outside, text, key, "add rows, or periodic = true"
        directed, take = self.loads.directions, (0, 1, 3, 6)
        if directed:
            lengths = self.batch("lengths", lambda: self.balance.function(
                "lengths",
                [ca.vertcat(*[getattr(d, key) for d in directed]) for key in ("length", "pull")],
                take,
            ), take)  # fmt: skip
            length, pull = lengths(motion.w, motion.v, motion.times, self._p(motion))
            text = "the spring has no direction: its points coincide"
            hint = "other points; a spring may only vanish with free_length = 0, preload = 0 and "
            hint += "damping = 0"
            for k, direction in enumerate(directed):
                lost = (length[:, k] <= POINT * self._length(motion)) & (pull[:, k] > 0)
                yield direction.load.name, lost, text, ".between", hint
        names = [n for n, x in loads.items() if x.expressions or getattr(x, "axis", None)]
        if names:
            wrenches = [self.loads.wrenches[name].values() for name in names]
            values = self.batch("loads", lambda: self.balance.function(
                "loads", [ca.vertcat(*[ca.sum1(ca.fabs(ca.vertcat(0, *w))) for w in wrenches])]
            ))  # fmt: skip
            finite = np.abs(values(*self.inputs(motion))[0]) < BOUNDLESS
            there = np.isfinite(motion.v).all(axis=1)
            for name, good in zip(names, finite.T, strict=True):
                yield name, ~good & there, "it has no finite value", "", ""

    def _ends(self, motion: LoadedPoses) -> Iterator[tuple[str, tuple[float, float], Floats]]:
        """Yield tables that end: name, ends, and where they are read (n,)."""
        for k, table in enumerate(self.tables):
            load = self.loads.signals[k].load
            if not load.periodic:
                at = self.abscissae(motion.w, motion.v, self._p(motion))[0][:, k]
                yield load.name, (table[0, 0], table[-1, 0]), at
        for timed in self.loads.timed:
            if timed.ends is not None:
                yield timed.name.removeprefix("load "), timed.ends, motion.times[:, 0]

    def signs(self, motion: LoadedPoses) -> Floats:
        """Return the sign of each sliding speed, (n, slips).

        Where a speed vanishes it is the sign of the coming motion; zero between bodies that do
        not move against each other.
        """
        slips = self.balance.slips
        if not slips:
            return np.zeros((len(motion), 0))
        speeds, largest = self._of("slipping")(motion.w, motion.v, self._p(motion))
        signs = np.sign(speeds)
        turns = np.array([slip.unit == "rad" for slip in slips])
        spins, lengths = self._both(largest[:, 0], largest[:, 1], self._length(motion))
        digits = np.fmax(motion.condition, 1.0)
        rough = DOUBTFUL * digits
        sizes = [(spins if turn else lengths) * rough for turn in turns]
        doubtful = np.abs(speeds.T) <= sizes
        rows = np.flatnonzero(doubtful.any(axis=0))
        if rows.size:
            some = motion.rows(rows)
            exact, rough = self._settled(some)
            size = np.where(turns, spins[rows, None], lengths[rows, None])
            least = digits[rows, None] * size
            chosen = np.where(np.abs(exact) > rough * least, np.sign(exact), 0.0)
            rates, largest = self._of("coming")(some.w, some.v, some.a, self._p(some))
            turn, change = largest.T
            turn = np.maximum(turn, spins[rows] ** 2)
            change = np.maximum(change, turn * self._length(some))
            change = np.where(turns, turn[:, None], change[:, None])
            with np.errstate(invalid="ignore"):
                moves = np.abs(rates) > STANDING * change
                coming = np.where(moves, np.sign(rates), 0.0)
            chosen = np.where(chosen == 0, coming, chosen)
            chosen[~moves & (np.abs(exact) <= STILL * least)] = 0.0  # the rounding of the data
            signs[rows] = np.where(doubtful[:, rows].T, chosen, signs[rows])
        return signs

    def _p(self, motion: LoadedPoses) -> Floats:
        """Return the numbers of poses, (np,) or (n, np)."""
        return self.p if motion.p is None else motion.p

    def _length(self, motion: LoadedPoses) -> float:
        """Return a length of the mechanism at poses, one number or (n,)."""
        return self.length if motion.length is None else motion.length

    @staticmethod
    def _both(spin: Floats, speed: Floats, length: Floats | float) -> tuple[Floats, Floats]:
        """Return the largest angular speed and speed: each brings about the other."""
        speed = np.maximum(speed, spin * length)
        turning = np.divide(speed, length, out=np.zeros_like(speed), where=np.not_equal(length, 0))
        return np.maximum(spin, turning), speed

    def _made_exactly(self) -> tuple[Graph, Graph]:
        g = self.evaluator.graphs

        def refined() -> Graph:
            return ca.Function("refined", [g.x, g.u, g.consts], [g.newton(g.x, g.u)[0]])

        def speeds() -> Graph:
            x, _, trig = g.newton(g.x, g.u)
            parts = g.rates(x, g.u, g.driven, 1, trig)
            places = [ca.vertcat(x, g.u), ca.vertcat(parts["v"], g.driven[0])]
            found = self.balance.slipping(*places, g.p)[0]
            inputs = [g.x, g.u, *([] if g.single else [g.driven[0]]), g.consts]
            return without_repeats("speeds", inputs, [found])

        return self._stored("refined", refined), self._stored("exact speeds", speeds)

    def _settled(self, motion: LoadedPoses) -> tuple[Floats, float]:
        """Return sliding speeds in 80-bit floats, and what is rounding in them."""
        refine, speeds = self.evaluator.graphs.cache(self.key, self._made_exactly)
        g = self.evaluator.graphs
        consts = np.ones((len(motion), g.consts.numel()), LONG)
        consts[:, : len(self.p)] = self._p(motion)
        x, u = motion.x.astype(LONG), motion.u.astype(LONG)
        with np.errstate(all="ignore"):
            for _ in range(2):
                if g.nx:
                    x = evaluate(refine, [x, u, consts])
            rates = [] if g.single else [motion.speeds.astype(LONG)]
            found = evaluate(speeds, [x, u, *rates, consts])
        if g.single:  # with respect to the driver
            found = found * motion.speeds.astype(LONG)
        return found.astype(float), float(64 * np.finfo(LONG).eps)

    # -- solutions -------------------------------------------------------------------------

    def sizes(self, inputs: Sequence[Floats]) -> tuple[Matrix, Matrix, Booleans]:
        """Return sizes without and with friction, and which poses are settled by them.

        Poses that are not settled may have no solution or several: see `Branches`.
        """
        if not self.balance.feedbacks:
            nothing = np.zeros((len(inputs[0]), 0))
            return nothing, nothing, np.ones(len(inputs[0]), bool)
        free, whole, miss, contraction = self._of("solve")(*inputs)
        with np.errstate(invalid="ignore"):
            good = np.all(miss <= SOLVED, axis=1) & np.all(contraction <= UNIQUE, axis=1)
        return free, whole, good

    def forces(self, inputs: Sequence[Floats]) -> tuple[Floats, Floats, Booleans, Loaded, Loaded]:
        """Return sizes without friction and with it, where these have proved to be the only ones,
        what acts without friction and with it: all at once.

        Where they are not, see `Branches`: `sizes` and what acts with them are not solved.
        """
        quiet, sizes, miss, contraction, *rest = self._of("quick")(*inputs)
        with np.errstate(invalid="ignore"):
            good = np.all(contraction <= UNIQUE, axis=1)
            slow = np.flatnonzero(good & ~np.all(miss <= QUICKLY, axis=1))
        free, whole = self._read(rest[:4]), self._read(rest[4:])
        if slow.size:
            chosen = some(inputs, slow)
            sizes[slow], good[slow] = self.sizes(chosen)[1:]
            whole.put(slow, self.loaded(chosen, sizes[slow]))
        return quiet, sizes, good, free, whole

    def staged(self, inputs: Sequence[Floats], sizes: Floats) -> Iterator[Stage]:
        """Yield the linear forms of friction of each group at poses."""
        return self.branches.staged(inputs, np.nan_to_num(sizes))

    def loaded(self, inputs: Sequence[Floats], sizes: Floats, friction: bool = True) -> Loaded:
        """Return what acts with the sizes of friction given."""
        report = self.batch(f"report {friction}", lambda: self.balance.report(friction))
        return self._read(report(*inputs, sizes))

    def static(self, inputs: Sequence[Floats], sizes: Floats) -> Loaded:
        """Return what loads alone do, without inertia and friction."""
        report = self.batch("static", lambda: self.balance.report(False, self.balance.applied))
        return self._read(report(*inputs, sizes))

    def _read(self, results: Sequence[Floats]) -> Loaded:
        width = self.scene.model.space.freedoms
        n, columns = results[0].shape
        return Loaded(results[0].reshape(n, columns // width, width), *results[1:])
