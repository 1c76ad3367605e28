"""A task of motion in symbols and numbers: what is integrated, from where to where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import build, evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import TIME
from mechdae.describe.tasks.kinds import Driver, Equilibrium, Motion
from mechdae.errors import InputError, MechdaeError, UnavailableError
from mechdae.kernels.graphs.equations_of_motion import Kernel
from mechdae.kernels.graphs.smooth_friction import Smooth
from mechdae.kernels.graphs.stepper import Stepper
from mechdae.kernels.run.batch import Batch
from mechdae.model.forces.dry_friction import Rubbing
from mechdae.model.forces.loads import Loads
from mechdae.model.forces.meshes import Mesh
from mechdae.model.forces.time_tables import Timed
from mechdae.model.model import FUNCTIONS, Model
from mechdae.model.motion_equations import Law, Released

SX = ca.SX
TOLERANCE = 1e-9
TIGHTEST = 1e-14
STILL = 1e-12
"""Way until the end, in natural sizes, of a law that counts as standing still."""
SHORTEST = 1e-9
"""Share of the whole time that the longest step has to have."""
DRIVERS = "drivers"
"""Name of the work that laws of time put in."""


@dataclass
class Setup:
    """What a motion is computed with.

    ``end`` is the last time, ``times`` those of the outputs, None for the steps themselves;
    ``notes`` what was assumed; ``held`` are coordinates
    that nothing moves, ``meshes`` gears, racks and belts with the forces of their teeth;
    ``longest`` is the longest step asked for, ``pieces`` those of tables over the time that hold.
    """

    problem: Problem
    task: Motion
    model: Model
    loads: Loads
    laws: list[Law]
    end: float
    times: Any
    tolerance: float
    length: float
    notes: list[str] = field(default_factory=list)
    held: dict[tuple[str, str], float] = field(default_factory=dict)
    meshes: dict[str, Mesh] = field(default_factory=dict)
    longest: float | None = None
    pieces: Any = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def plain(self) -> Released:
        """The equations with nothing held, and without friction in joints."""
        return Released(self.model, self.loads, self.laws)

    @cached_property
    def jointed(self) -> Released:
        """The equations without laws of time."""
        return Released(self.model, self.loads) if self.laws else self.plain

    @cached_property
    def released(self) -> Released:
        """The equations of motion."""
        if not self.held and not self.rubbing.feedbacks:
            return self.plain
        return Released(self.model, self.loads, self.laws, self.held, self.rubbing)

    @cached_property
    def rubbing(self) -> Rubbing:
        """Dry friction of resistances, and of joints unless the task leaves it out.

        Forces of teeth load bearings: they count in the motion if anything rubs.
        """
        if self.task.friction != "none":
            found = Rubbing(self.model, self.loads, True, self.meshes)
            if found.frictional:
                return found
        return self.plain.rubbing

    @cached_property
    def loaded(self) -> Released:
        """The equations of motion with all forces of teeth."""
        if self.rubbing.feedbacks or not self.meshes:
            return self.released
        rubbing = Rubbing(self.model, self.loads, False, self.meshes)
        return Released(self.model, self.loads, self.laws, self.held, rubbing)

    @property
    def loose(self) -> Any:
        """Inputs of dry friction that neither rubs nor locks, with the pieces of tables."""
        return np.concatenate([np.zeros(self.rubbing.signs.numel()), self.pieces])

    def pieces_at(self, t: float) -> Any:
        """Return the pieces of tables over the time that hold right behind a time."""
        found = [table.piece(t) for table in self.loads.timed]
        return np.concatenate(found) if found else np.zeros(0)

    def sided(self, t: Any, x: Any, v: Any, signs: Any) -> Any:
        """Return inputs (n, k) of dry friction with the signs that smoothed friction has."""
        if not self.smooth:
            return signs
        kernel: Any = self.kernel
        sides = Batch(kernel.sides, [], straight=lambda: None)
        found = signs.copy()
        found[:, : self.rubbing.count] = sides(t, x, v, signs)[0]
        return found

    def renewed(self, signs: Any) -> Any:
        """Return inputs of dry friction with the pieces of tables that hold now."""
        return np.concatenate([signs[: self.rubbing.signs.numel()], self.pieces])

    @cached_property
    def force_kernel(self) -> Kernel:
        """Right-hand side with all forces of teeth, scaled like that of the motion."""
        if self.loaded is self.released:
            return self.kernel
        r = self.loaded
        return Kernel(r, self.model.p_values, self.sizes(r), self.length)

    def sizes(self, released: Released) -> Any:
        """Return natural sizes of the free coordinates: 1 rad, a length, the range of s / 2 pi."""
        return released.coordinates.sizes(self.length)

    @cached_property
    def kernel(self) -> Kernel:
        """Right-hand side and projection."""
        r = self.released
        if self.smooth:
            return Smooth(r, self.model.p_values, self.sizes(r), self.length, self.widths)
        return Kernel(r, self.model.p_values, self.sizes(r), self.length)

    @property
    def smooth(self) -> bool:
        """Whether friction is smoothed."""
        return self.task.friction == "smooth" and self.rubbing.count > 0

    @cached_property
    def widths(self) -> Any:
        """Slope speeds of smoothed friction by slip; of a pin without omega_s, v_s over its radius.

        Raises
        ------
        InputError
            The key that is missing, or a speed that is none.
        """
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
            own = given["omega_s" if slip.unit == "rad" else "v_s"]
            radius = values.get(f"{slip.owner}.pin_radius", 0.0)
            if own is None and slip.unit == "rad" and given["v_s"] is not None and radius > 0:
                own = given["v_s"] / radius
            if own is None:
                key = "omega_s" if slip.unit == "rad" else "v_s"
                raise InputError(
                    f"smooth friction of {slip.owner} needs '{key}', the speed over which it grows",
                    where=key,
                    hint="a thousandth of the speeds of the motion, or less",
                )
            found.append(own)
        return np.array(found)

    @cached_property
    def works(self) -> list[str]:
        """What does work that is no change of a stored energy."""
        rubbing = [f"friction.{joint}" for joint in self.released.losses]
        return [*self.released.powers, *rubbing, *([DRIVERS] if self.laws else [])]

    @cached_property
    def stepper(self) -> Stepper:
        r = self.released
        a = SX.sym("a", r.x.numel())
        m = SX.sym("m", self.kernel.rubs)
        lost = [
            sum((self._part(j) * rate * m[j] for j, rate in own), SX(0))
            for own in r.losses.values()
        ]
        powers = [*r.powers.values(), *[-part for part in lost]]
        if self.laws:
            powers.append(r.driven_power(a) + sum(lost, SX(0)))
        return Stepper(self.kernel, ca.vertcat(*powers) if powers else SX(0, 1), a, m)

    def _part(self, j: int) -> Any:
        """Return the share of its size that a force of friction has: below 1 where smoothed."""
        owner = self.released.rubbing.owners[j] if self.smooth else None
        return SX(1) if owner is None else ca.fabs(self.released.signs[owner])


def setup(problem: Problem, task: Motion, moves: bool = True) -> Setup:
    """Return what a task of motion is computed with.

    An equilibrium (`moves` is False) has no friction.

    Raises
    ------
    InputError
        Times or a tolerance that mean nothing.
    UnavailableError
        Friction in an equilibrium, or smoothed.
    """
    mechanism = problem.mechanism
    known = mechanism.parameter_values
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
    model = Model(mechanism)
    loads = Loads(model, gradual=task.friction == "smooth")
    laws = _laws(model, loads, task)
    scale = mechanism.scale
    found = Setup(problem, task, model, loads, laws, end, times, tolerance, scale, notes)
    found.longest, found.pieces = longest, found.pieces_at(0.0)
    return found


def as_motion(task: Equilibrium) -> Motion:
    """Return the motion that begins where an equilibrium is looked for."""
    return Motion(start=task.start, drivers=task.drivers, until=1.0, friction=task.friction)


def _times(task: Motion, known: Mapping[str, float]) -> tuple[float, Any]:
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
            try:
                value = _tabulated(model, loads, driver, known)
            except MechdaeError as problem:
                raise problem.inside(f"drivers[{i}].table") from None
            laws.append(Law(coordinate(model.mechanism, driver.coordinate), value))
            continue
        text: Any = driver.law if driver.law is not None else (driver.at or (0.0,))[0]
        try:
            value = SX(build(text, known, FUNCTIONS)) if isinstance(text, str) else SX(text)
        except MechdaeError as problem:
            raise problem.inside(f"drivers[{i}].law") from None
        laws.append(Law(coordinate(model.mechanism, driver.coordinate), value))
    return laws


def _tabulated(model: Model, loads: Loads, driver: Driver, known: dict[str, Any]) -> Any:
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
        try:
            numbers[word] = build(given, known, FUNCTIONS) if isinstance(given, str) else given
        except MechdaeError as problem:
            raise problem.inside(word) from None
    if table.interpolation == "linear" and len(table.points) > 2:
        raise InputError(
            "straight lines jump in their speed, which no driver can", where="interpolation",
            hint='"spline", the default',
        )  # fmt: skip
    found = Timed(
        f"law of {driver.coordinate}", table, loads.time, SX(numbers["shift"]),
        None if numbers["period"] is None else SX(numbers["period"]), model.p, model.p_values,
    )  # fmt: skip
    loads.timed.append(found)
    return SX(numbers["factor"]) * found.value


def _without_friction(mechanism: Mechanism, task: Motion, moves: bool) -> list[str]:
    """Return what is assumed about friction.

    Raises
    ------
    UnavailableError
        A joint has friction and the task does not leave it out.
    """
    values = mechanism.values()
    found = [name for name, joint in mechanism.joints.items() if _rubs(joint, values)]
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
    other = [own for own in found if not joints[own].smoothed]
    if task.friction == "smooth" and other:
        raise UnavailableError(
            f"smoothed friction is not computed for slots and meshes: joints {', '.join(other)}",
            where="friction",
            hint='friction = "event" computes all joints',
        )
    return []


def _rubs(joint: Joint, values: dict[str, float]) -> bool:
    keys = ("friction", "friction_static", "mesh_loss")
    return any(values.get(f"{joint.name}.{key}", 0.0) != 0 for key in keys)


def idle(setup: Setup) -> list[tuple[str, str]]:
    """Return the free coordinates without inertia, constraint and force: nothing moves them."""
    released = setup.plain
    kernel = Kernel(released, setup.model.p_values, setup.sizes(released), setup.length)
    M, f, J, _ = kernel.parts(kernel.t, kernel.x, kernel.v, kernel.signs)
    found = []
    for i, name in enumerate(released.coordinates.keys):
        own: list[Any] = [*SX(M[:, i]).nonzeros(), *SX(J[:, i]).nonzeros(), SX(f)[i]]
        if all(entry.is_zero() for entry in own):
            found.append(name)
    return found
