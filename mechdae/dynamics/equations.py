"""A task of motion in symbols and numbers: what is integrated, from where to where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import build, evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import TOLERANCE as CLOSURE_TOLERANCE
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import TIME
from mechdae.describe.structure import structure_of
from mechdae.describe.tasks.kinds import Driver
from mechdae.describe.tasks.motion import Equilibrium, Motion
from mechdae.equations.forces.dry_friction import Rubbing
from mechdae.equations.forces.feedback import Unilateral
from mechdae.equations.forces.generalised import MeshForces
from mechdae.equations.forces.loads import Loads
from mechdae.equations.forces.time_tables import Timed
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.equations.motion_equations import Law, Released
from mechdae.equations.reduction import released_model
from mechdae.equations.structure_cache import StructureCache, structure_property
from mechdae.equations.tree.bars import check_in_space
from mechdae.errors import InputError, UnavailableError, within
from mechdae.kernels.graphs.equations_of_motion import Kernel
from mechdae.kernels.graphs.smooth_friction import Smooth
from mechdae.kernels.graphs.stepper import Stepper
from mechdae.kernels.run.functions import Call
from mechdae.motion.kinematics import prepared
from mechdae.motion.kinematics.prepared import free_numbers, size_of
from mechdae.numerics.null_space import ZERO, freedoms
from mechdae.records import dataclass
from mechdae.types import Floats, Sym, Unknowns

SX = ca.SX
TOLERANCE = 1e-9
MOST_OPEN = 1e-6
CONTRADICTING = 100.0
"""Share of the largest singular value, over that by which constraints may stay open, up to which
they depend on each other."""
TIGHTEST = 1e-14
STILL = 1e-12
"""Way until the end, in natural sizes, of a law that counts as standing still."""
SHORTEST = 1e-9
"""Share of the whole time that the longest step has to have."""
DRIVERS, IMPACTS = "drivers", "impacts"
"""Names of the work that laws of time put in, and, before a joint's name, that impacts take."""


@dataclass(frozen=True, eq=False)
class MotionShape:
    """What the structure of a task of motion decides: symbols, equations, kernels."""

    model: Model
    loads: Loads
    laws: list[Law]
    cache: StructureCache = field(default_factory=StructureCache)

    @property
    def size(self) -> int:
        """Estimated bytes of its kernels."""
        return size_of(self.model.cache, self.cache)


@dataclass
class MotionProblem:
    """What a motion is computed with: the numbers of a task and the shape they belong to.

    ``end`` is the last time, ``times`` those of the outputs, None for the steps themselves;
    ``notes`` what was assumed; ``held`` are coordinates
    that nothing moves, ``meshes`` gears, racks and belts with the forces of their teeth;
    ``longest`` is the longest step asked for, ``pieces`` those of tables over the time that hold;
    ``likely`` are coordinates to tell the freedoms with, beside those that the start names;
    ``closed`` tells which unilateral contacts are closed.
    """

    problem: Problem
    task: Motion
    model: Model
    loads: Loads
    laws: list[Law]
    cache: StructureCache
    end: float
    times: Any
    tolerance: float
    length: float
    notes: list[str] = field(default_factory=list)
    held: dict[tuple[str, str], float] = field(default_factory=dict)
    meshes: dict[str, MeshForces] = field(default_factory=dict)
    longest: float | None = None
    pieces: Floats = field(default_factory=lambda: np.zeros(0))
    likely: tuple[str, ...] = ()
    closed: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        self.closed = np.zeros(len(self.unilateral))

    @structure_property
    def unilateral(self) -> list[Unilateral]:
        """The contacts of joints that push and do not pull."""
        questions = self.model.cases("unilateral contacts")
        return [contact for make in questions for contact in make(self.model)]

    @structure_property
    def plain(self) -> Released:
        """The equations with nothing held, and without friction in joints."""
        return Released(self.model, self.loads, self.laws, unilateral=self.unilateral)

    @structure_property
    def jointed(self) -> Released:
        """The equations without laws of time."""
        return Released(self.model, self.loads) if self.laws else self.plain

    @cached_property
    def released(self) -> Released:
        if not self.held and not self.rubbing.feedbacks:
            return self.plain
        return self._with(self.rubbing)

    def _with(self, rubbing: Rubbing) -> Released:
        """Return the equations with what is held and with dry friction."""
        key, held = ("released", *self.held, rubbing), list(self.held)
        more = (held, rubbing, self.unilateral)
        return self.cache(key, lambda: Released(self.model, self.loads, self.laws, *more))

    @cached_property
    def rubbing(self) -> Rubbing:
        """Dry friction of resistances, and of joints unless the task leaves it out."""
        if self.task.friction != "none":
            found = self._rubbing(True)
            if found.frictional:
                return found
        plain: Released = self.plain
        return plain.rubbing

    def _rubbing(self, friction: bool) -> Rubbing:
        """Return dry friction with the forces of teeth."""
        real = tuple((name, mesh.kept_by) for name, mesh in self.meshes.items())
        return self.cache(
            ("rubbing", friction, real),
            lambda: Rubbing(self.model, self.loads, friction, self.meshes, self.unilateral),
        )

    @cached_property
    def loaded(self) -> Released:
        """The equations of motion with all forces of teeth."""
        if self.rubbing.feedbacks or not self.meshes:
            return self.released
        return self._with(self._rubbing(False))

    @property
    def loose(self) -> Floats:
        """Inputs of dry friction that neither rubs nor locks, and `fixed`."""
        return np.concatenate([np.zeros(self.rubbing.signs.numel()), self.fixed])

    @property
    def fixed(self) -> Floats:
        """The pieces of tables, the values of what is held, which contacts are closed."""
        return np.concatenate([self.pieces, list(self.held.values()), self.closed])

    def pieces_at(self, t: float) -> Floats:
        """Return the pieces of tables over the time that hold right behind a time."""
        found = [table.piece(t) for table in self.loads.timed]
        return np.concatenate(found) if found else np.zeros(0)

    def laws_at(self, t: float, pieces: Floats) -> list[Floats]:
        """Return the values and the rates of the laws of time, for pieces of tables."""
        loads, model = self.loads, self.model

        def build() -> Call:
            values = ca.densify(ca.vertcat(SX(0, 1), *[law.value for law in self.laws]))
            symbols = ca.vertcat(SX(0, 1), *[table.symbols for table in loads.timed])
            rates = ca.densify(ca.jacobian(values, loads.time))
            return Call(ca.Function("laws", [loads.time, symbols, model.p], [values, rates]))

        return list(self.cache("laws", build)(t, pieces, model.p_values))

    def sided(self, t: Floats, x: Unknowns, v: Floats, signs: Floats) -> Floats:
        """Return inputs (n, k) of dry friction with the signs that smoothed friction has."""
        if not self.smooth:
            return signs
        kernel: Any = self.kernel
        found = signs.copy()
        found[:, : self.rubbing.count] = kernel.batch("sides", lambda: kernel.sides, ())(
            t, x, v, signs
        )[0]
        return found

    def renewed(self, signs: Floats) -> Floats:
        """Return inputs of dry friction with the pieces of tables that hold now."""
        return np.concatenate([signs[: self.rubbing.signs.numel()], self.fixed])

    @cached_property
    def force_kernel(self) -> Kernel:
        """Right-hand side with all forces of teeth, scaled like that of the motion."""
        return self.kernel if self.loaded is self.released else self.kernel_of(self.loaded)

    def kernel_of(self, released: Released) -> Kernel:
        """Return the functions of equations with the numbers of this task."""
        shape: Kernel = released.cache("kernel", lambda: Kernel(released))
        return shape.at(self.model.p_values, self.length, closure=self.closure)

    @cached_property
    def kernel(self) -> Kernel:
        """Right-hand side and projection."""
        if not self.smooth:
            return self.kernel_of(self.released)
        r = self.released
        shape: Kernel = r.cache("smooth", lambda: Smooth(r))
        return shape.at(self.model.p_values, self.length, self.widths, self.closure)

    @cached_property
    def closure(self) -> float:
        """Share of natural sizes by which constraints may stay open because the file says so."""
        share = self.problem.mechanism.tolerance / self.length
        if share > MOST_OPEN:
            raise InputError(
                f"{CLOSURE_TOLERANCE} of a mechanism that moves under forces is {MOST_OPEN:g} of "
                f"its length at most, {MOST_OPEN * self.length:.3g} m"
            )
        return share

    def freedoms(self, J: Floats) -> Floats:
        """Return an orthonormal basis (n, k) of J x = 0, x over natural sizes (n,).

        Constraints that may stay open depend on each other as far as they contradict.
        """
        return freedoms(J, self.kernel.sizes, self.rank)

    @property
    def rank(self) -> float:
        """Share of the largest singular value up to which one counts as zero."""
        return max(ZERO, CONTRADICTING * self.closure)

    @property
    def smooth(self) -> bool:
        return self.task.friction == "smooth" and self.rubbing.count > 0

    @cached_property
    def widths(self) -> Floats:
        """Slope speeds of smoothed friction; of a pin without omega_s v_s over its radius."""
        mechanism = self.problem.mechanism
        known, values = mechanism.parameter_values, mechanism.values()
        given: dict[str, float | None] = {}
        for key in ("v_s", "omega_s"):
            number = getattr(self.task, key)
            given[key] = None if number is None else evaluate(number, known)
            if number is not None and not 0 < (given[key] or 0.0) < np.inf:
                raise InputError(f"a speed above 0 is needed, not {given[key]:g}", where=key)
        found = []
        for slip in self.rubbing.slips:
            width = given["omega_s" if slip.unit == "rad" else "v_s"]
            radius = values.get(f"{slip.owner}.pin_radius", 0.0)
            if width is None and slip.unit == "rad" and given["v_s"] is not None and radius > 0:
                width = given["v_s"] / radius
            if width is None:
                key = "omega_s" if slip.unit == "rad" else "v_s"
                raise InputError(
                    f"smooth friction of {slip.owner} needs '{key}', the speed over which it grows",
                    where=key,
                    hint="a thousandth of the speeds of the motion, or less",
                )
            found.append(width)
        return np.array(found)

    @cached_property
    def works(self) -> list[str]:
        """What does work that is no change of a stored energy."""
        rubbing = [f"friction.{joint}" for joint in self.released.losses]
        return [
            *self.released.powers, *rubbing, *self.impacts, *([DRIVERS] if self.laws else [])
        ]  # fmt: skip

    @property
    def impacts(self) -> list[str]:
        """The works of impacts, by joint."""
        return [f"{IMPACTS}.{name}" for name in dict.fromkeys(c.owner for c in self.unilateral)]

    @property
    def stepper(self) -> Stepper:
        """One step of the motion, for the scalings that the kernel has."""
        return self.kernel.cache("stepper", self._stepper)

    def _stepper(self) -> Stepper:
        r = self.released
        a = SX.sym("a", r.x.numel())
        m = SX.sym("m", self.kernel.rubs)
        lost = [
            sum((self._part(j) * rate * m[j] for j, rate in rates), SX(0))
            for rates in r.losses.values()
        ]
        powers = [*r.powers.values(), *[-part for part in lost], *[SX(0) for _ in self.impacts]]
        if self.laws:
            powers.append(r.driven_power(a) + sum(lost, SX(0)))
        return Stepper(self.kernel, ca.vertcat(*powers) if powers else SX(0, 1), a, m)

    def _part(self, j: int) -> Sym:
        """Return the share of its size that a force of friction has: below 1 where smoothed."""
        owner = self.released.rubbing.owners[j] if self.smooth else None
        return SX(1) if owner is None else ca.fabs(self.released.signs[owner])


def setup(problem: Problem, task: Motion, moves: bool = True) -> MotionProblem:
    """Return what a task of motion is computed with."""
    mechanism = problem.mechanism
    known = mechanism.parameter_values
    if mechanism.dimension == 3:
        check_in_space(mechanism, teeth=False)
    notes = _without_friction(mechanism, task, moves)
    end, times = _times(task, known)
    tolerance = TOLERANCE if task.tolerance is None else evaluate(task.tolerance, known)
    if not TIGHTEST <= tolerance <= 1e-2:
        raise InputError(
            f"a number from {TIGHTEST:g} to 0.01 is needed, not {tolerance:g}", where="tolerance"
        )
    longest = None if task.max_step is None else evaluate(task.max_step, known)
    if longest is not None and not longest >= SHORTEST * end:
        raise InputError(
            f"a time above 0 is needed, {SHORTEST:g} of the whole at least, not {longest:g}",
            where="max_step",
        )
    shape = _shape(mechanism, task)
    model = shape.model.at(mechanism)
    loads = shape.loads.at(model)
    found = MotionProblem(
        problem, task, model, loads, shape.laws, shape.cache, end, times, tolerance,
        mechanism.scale, notes,
    )  # fmt: skip
    found.longest, found.pieces = longest, found.pieces_at(0.0)
    return found


def _shape(mechanism: Mechanism, task: Motion) -> MotionShape:
    """Return the shape of a motion: one that is kept, or a new one."""
    names, gradual = free_numbers(), task.friction == "smooth"
    named = _named_joints(mechanism, task)
    structure = structure_of(mechanism, names)
    key = ("motion", structure, task.drivers, gradual, names, named, task.clearance)
    shape = prepared.SHAPES.get(key)
    if not isinstance(shape, MotionShape):
        model = released_model(mechanism, named, names)
        for opened in model.cases("opened joints") if task.clearance else ():
            opened(model)
        loads = Loads(model, gradual=gradual)
        shape = MotionShape(model, loads, _laws(model, loads, task))
        prepared.SHAPES.put(key, shape)
    return shape


def _named_joints(mechanism: Mechanism, task: Motion) -> tuple[str, ...]:
    """Return the joints in space whose coordinates a task or a load names."""
    if mechanism.dimension == 2:
        return ()
    given = {**(task.start or {}), **(task.start_speed or {})}
    texts = [*given, *(driver.coordinate for driver in task.drivers or ())]
    texts += [getattr(load, "coordinate", None) or "" for load in mechanism.loads.values()]
    parts = (text.split(".")[0] for text in texts)
    return tuple(dict.fromkeys(part for part in parts if part in mechanism.joints))


def as_motion(task: Equilibrium) -> Motion:
    """Return the motion that begins where an equilibrium is looked for."""
    return Motion(start=task.start, drivers=task.drivers, until=1.0, friction=task.friction)


def _times(task: Motion, known: Mapping[str, float]) -> tuple[float, Floats | None]:
    """Return the end and the times of output, None for the steps."""
    times = None
    if task.at is not None:
        times = np.array([evaluate(value, known) for value in task.at])
        if not len(times):
            raise InputError("the list of times is empty", where="at")
        if (np.diff(times) <= 0).any() or times[0] < 0:
            raise InputError("times from 0 on that grow are needed", where="at")
    end = float(times[-1]) if times is not None else 0.0
    if task.until is not None:
        end = evaluate(task.until, known)
        if end <= 0:
            raise InputError(f"a time above 0 is needed, not {end:g}", where="until")
        if times is not None and times[-1] > end:
            raise InputError(f"the time {times[-1]:g} lies behind the end {end:g}", where="at")
        if times is not None and times[-1] < end:
            times = np.append(times, end)
    if task.poses is not None:
        times = np.linspace(0.0, end, task.poses) if task.poses > 1 else np.array([end])
    return end, times


def _laws(model: Model, loads: Loads, task: Motion) -> list[Law]:
    known = {name: model.p[i] for i, name in enumerate(model.p_names)}
    known = {n: symbol for n, symbol in known.items() if n in model.mechanism.parameters}
    known[TIME] = loads.time
    laws = []
    for i, driver in enumerate(task.drivers or ()):
        if driver.table is not None:
            with within(f"drivers[{i}].table"):
                value = _tabulated(model, loads, driver, known, f"drivers[{i}].table")
            laws.append(Law(coordinate(model.mechanism, driver.coordinate), value))
            continue
        text: float | str = driver.law if driver.law is not None else (driver.at or (0.0,))[0]
        with within(f"drivers[{i}].law"):
            value = SX(build(text, known, FUNCTIONS)) if isinstance(text, str) else SX(text)
        laws.append(Law(coordinate(model.mechanism, driver.coordinate), value))
    return laws


def _tabulated(
    model: Model, loads: Loads, driver: Driver, known: Mapping[str, object], where: str
) -> Any:
    """Return the law that a table over the time gives."""
    table = driver.table
    assert table is not None
    if not table.points:
        raise InputError(
            "the file has not been read", where="file", hint="load the problem from its file"
        )
    numbers: dict[str, Any] = {}
    for word in ("factor", "shift", "period"):
        given = getattr(table, word)
        with within(word):
            numbers[word] = build(given, known, FUNCTIONS) if isinstance(given, str) else given
    if table.interpolation == "linear" and len(table.points) > 2:
        raise InputError(
            "straight lines jump in their speed, which no driver can", where="interpolation",
            hint='"spline", the default',
        )  # fmt: skip
    found = Timed(
        f"law of {driver.coordinate}", table, loads.time, SX(numbers["shift"]),
        None if numbers["period"] is None else SX(numbers["period"]), model.p, model.p_values,
        where,
    )  # fmt: skip
    loads.timed.append(found)
    return SX(numbers["factor"]) * found.value


def _without_friction(mechanism: Mechanism, task: Motion, moves: bool) -> list[str]:
    """Return what is assumed about friction."""
    values = mechanism.values()
    found = rubbing(mechanism)
    if not found:
        return []
    if task.friction == "none":
        return [f"friction of {', '.join(found)} is left out, as the task asks"]
    if not moves:
        raise UnavailableError(
            f"with friction in joints {', '.join(found)} many poses are at rest",
            where="friction",
            hint='friction = "none" leaves it out',
        )
    joints = mechanism.joints
    other = [
        name for name in found if not joints[name].smoothed or joints[name].rubs_all_ways(values)
    ]
    gliding = [name for name in found if joints[name].rubs_all_ways(values)]
    if gliding and task.friction != "smooth" and task.method not in (None, "explicit"):
        raise UnavailableError(
            f"friction of {', '.join(gliding)} needs the explicit method: its direction turns in "
            f"no time where they start and stop",
            where="method",
            hint="leave the method out",
        )
    if task.friction == "smooth" and other:
        raise UnavailableError(
            f"smoothed friction is not computed for slots, meshes, balls and pairs that slide and "
            f"turn: joints {', '.join(other)}",
            where="friction",
            hint='friction = "event" computes all joints',
        )
    return []


def rubbing(mechanism: Mechanism, task: Motion | None = None) -> list[str]:
    """Return the joints with friction; none of a task that leaves it out."""
    values, keys = mechanism.values(), ("friction", "friction_static", "mesh_loss")
    if task is not None and task.friction == "none":
        return []
    return [
        name
        for name in mechanism.joints
        if any(values.get(f"{name}.{key}", 0.0) != 0 for key in keys)
    ]


def idle(setup: MotionProblem) -> list[tuple[str, str]]:
    """Return the free coordinates without inertia, constraint and force: nothing moves them."""
    kernel = setup.kernel_of(setup.plain)
    draw = np.random.default_rng(1)
    at = [draw.uniform(-1.0, 1.0, part.numel()) for part in kernel.inputs[:4]]
    M, f, J, _ = kernel.value("parts", *at)
    moved = M.any(axis=0) | J.any(axis=0) | f.any(axis=1)
    if moved.all():
        return []
    # a force may be none at one state alone: the others are looked at in symbols
    M, f, J, _ = kernel.parts(*kernel.inputs[:4], SX(ca.DM(kernel.numbers)))
    found = []
    for i in np.flatnonzero(~moved).tolist():
        entries: list[Any] = [*SX(M[:, i]).nonzeros(), *SX(J[:, i]).nonzeros(), SX(f)[i]]
        if all(entry.is_zero() for entry in entries):
            found.append(setup.plain.coordinates.keys[i])
    return found
