"""What kernels in C and JavaScript are made of: functions, numbers, what goes in and comes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from mechdae import __version__
from mechdae.describe.dimensions import parameter_units
from mechdae.equations.parameters import parameters_of
from mechdae.errors import UnavailableError
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.parts.page import live
from mechdae.tasks import ExportedMotion
from mechdae.types import Graph, Json

WHY = {
    "curves": "its curves touch, which steps of the path alone do not follow",
    "superfluous": "it has superfluous equations",
    "change points": "its path goes through change points",
    "open": "it does not assemble",
}
"""What stands in the way of a kernel, by the key of the reason."""


@dataclass(frozen=True)
class KernelOutput:
    """A reported quantity: where it is among the outputs, its names by order of the rate."""

    kind: str
    part: str
    names: tuple[str, ...]
    columns: tuple[int, ...]
    unit: str

    @property
    def path(self) -> str:
        """The path to it, as in the JSON of results."""
        return f"{self.kind}/{self.part}/{self.names[0]}"


@dataclass(frozen=True)
class KernelSource:
    """A task of one driver as functions and numbers.

    Attributes
    ----------
    inputs
        Names, units and values of the numbers that may be changed.
    outputs
        What is computed at a pose.
    start
        What the path begins with, see `mechdae.parts.page.live.numbers_of`.
    low, high
        The driver's range along the task.
    """

    motion: ExportedMotion
    setting: Setting
    run: Run
    inputs: tuple[tuple[str, str, float], ...]
    outputs: tuple[KernelOutput, ...]
    start: Json
    low: float
    high: float

    @property
    def driver(self) -> tuple[str, str]:
        """The driver's coordinate and its unit."""
        name = next(iter(self.motion.result.drivers))
        return name, "rad" if self.start["turns"] else "m"

    @property
    def names(self) -> list[str]:
        """The names of the numbers that may be changed."""
        return [name for name, _, _ in self.inputs]

    def functions(self, wanted: Sequence[str]) -> dict[str, Graph]:
        """Return casadi functions with dense outputs by their names."""
        graphs, model = self.setting.graphs, self.setting.scene.model
        symbols = ca.SX.sym("names", len(self.names))
        numbers = ca.Function("numbers", [symbols], [parameters_of(model, self.names, symbols)])
        known = {
            "numbers": numbers,
            "constants": graphs.constants,
            "advance": graphs.advance,
            "pose": graphs.pose,
        }
        found = {}
        for name in wanted:
            given = known[name].sx_in()
            results = [ca.densify(part) for part in known[name].call(given)]
            found[name] = ca.Function(name, given, results)
        return found


def kernel_source(motion: ExportedMotion) -> KernelSource:
    """Return what kernels of a motion are made of.

    Raises
    ------
    InputError
        A task without one driver.
    UnavailableError
        A motion that has to be followed by more than steps of its path.
    """
    setting, run = motion.single("a kernel")
    reason = "curves" if setting.graphs.contacts else ""
    reason = reason or live.why_recorded(setting, run, motion.problem.task(motion.task))
    if reason:
        raise UnavailableError(
            f"no kernel of this task: {WHY.get(reason, reason)}",
            where=f"tasks.{motion.task}",
            hint="md.function gives its outputs as a casadi function",
        )
    model = setting.scene.model
    values = dict(zip(model.p_names, model.p_values.tolist(), strict=True))
    units = parameter_units(motion.mechanism, motion.problem.tasks.values())
    names = live.numbers_that_move(setting, set())
    in_space = motion.mechanism.dimension == 3
    outputs = tuple(
        KernelOutput(
            entry.kind,
            entry.part,
            tuple(live.names_of(entry, in_space)),
            tuple(entry.columns),
            "1" if entry.is_orientation else entry.unit,
        )
        for entry in setting.outputs.entries
        if entry.kind != "hidden" and entry.name != "guide"
    )
    low, high = min(run.places), max(run.places)
    return KernelSource(
        motion,
        setting,
        run,
        tuple((name, str(units.get(name, "") or _unit(name)), values[name]) for name in names),
        outputs,
        live.numbers_of(setting, run),
        float(low),
        float(high),
    )


def _unit(name: str) -> str:
    """Return the unit of an automatic name."""
    return "m" if name.rpartition(".")[2] in ("x", "y", "z", "length", "radius") else "SI"


def head_lines(source: KernelSource) -> list[str]:
    """Return the lines of a header: task, driver, numbers and outputs with their units."""
    motion = source.motion
    driver, unit = source.driver
    lines = [
        f"mechdae {__version__}: {motion.problem.name}, task {motion.task}",
        "",
        "SI units and radians, counter-clockwise positive. Rates are by the driver's value s:",
        "v = y' ds/dt, a = y'' (ds/dt)^2 + y' d2s/dt2.",
        "",
        f"driver s: {driver} [{unit}], in the task from {source.low!r} to {source.high!r}",
        "",
        "inputs theta, numbers that may be changed:",
    ]
    for k, (name, unit, value) in enumerate(source.inputs):
        lines.append(f"  {k:3d}  {name} [{unit}] = {value!r}")
    lines += ["", "outputs y, each with y' and y'':"]
    for entry in source.outputs:
        for j, column in enumerate(entry.columns):
            part = f"[{j}]" if len(entry.columns) > 1 else ""
            lines.append(f"  {column:3d}  {entry.path}{part} [{entry.unit}]")
    return lines
