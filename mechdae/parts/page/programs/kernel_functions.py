"""What kernels in C and JavaScript are made of: functions, numbers, what goes in and comes out."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from mechdae import __version__
from mechdae.describe.dimensions import parameter_units
from mechdae.equations.parameters import parameters_of
from mechdae.errors import UnavailableError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.parts.page import live
from mechdae.parts.page import page_drivers as ways
from mechdae.tasks import ExportedMotion
from mechdae.types import Graph, Json

WHY = {
    "curves": "its curves touch, which steps of the path alone do not follow",
    "superfluous": "it has redundant equations",
    "change points": "its path goes through change points",
    "open": "it does not assemble",
    "drivers": "no driver is moved by its value",
}
"""What stands in the way of a kernel, by the key of the reason."""


@dataclass(frozen=True)
class KernelSource:
    """A task as functions and numbers.

    Attributes
    ----------
    inputs
        Names, units and values of the numbers that may be changed.
    outputs
        What is computed at a pose, as pages hold it.
    drivers
        Those of pages, each with its value at the first pose.
    """

    motion: ExportedMotion
    setting: Setting
    run: Run
    inputs: tuple[tuple[str, str, float], ...]
    outputs: list[Json]
    drivers: list[Json]

    @property
    def graphs(self) -> Graphs:
        """The functions along straight lines in the drivers' values."""
        return self.setting.graphs.straight

    @property
    def range(self) -> tuple[float, float]:
        """The range of a single driver along the task."""
        return float(min(self.run.places)), float(max(self.run.places))

    @property
    def names(self) -> list[str]:
        """The names of the numbers that may be changed."""
        return [name for name, _, _ in self.inputs]

    def functions(self) -> dict[str, Graph]:
        """Return the functions of numbers, bounds, a step and a pose of order 2 by their names."""
        graphs = self.graphs
        symbols = ca.SX.sym("names", len(self.names))
        numbers = parameters_of(self.setting.scene.model, self.names, symbols)
        x, u, du, ddu, *_, consts = graphs.pose.sx_in()
        still = [ca.SX.zeros(graphs.nu)] * (len(graphs.driven) - 2)
        return {
            "numbers": ca.Function("numbers", [symbols], [numbers]),
            "constants": graphs.constants,
            "advance": graphs.advance,
            "pose": ca.Function(
                "pose",
                [x, u, du, ddu, consts],
                graphs.pose.call([x, u, du, ddu, *still, consts])[:8],
            ),
        }


def kernel_source(motion: ExportedMotion) -> KernelSource:
    """Return what kernels of a motion are made of.

    Raises
    ------
    UnavailableError
        A motion that has to be followed by more than steps of its path.
    """
    setting, run = motion.setting, motion.run
    reason = _why_none(motion)
    if reason or setting is None or run is None:
        raise UnavailableError(
            f"no kernel of this task: {WHY.get(reason, reason)}",
            where=f"tasks.{motion.task}",
            hint="md.function gives its outputs as a casadi function",
        )
    model = setting.scene.model
    values = dict(zip(model.p_names, model.p_values.tolist(), strict=True))
    units = parameter_units(motion.mechanism, motion.problem.tasks.values())
    names = live.numbers_that_move(setting, set())
    outputs = [
        {**entry, "path": f"{entry['kind']}/{entry['part']}/{entry['names'][0]}"}
        for entry in live.entries_of(setting)
    ]
    s, _ = ways.start_of(run.path)
    begin = run.path.drivers(np.array([s]))[0].tolist()
    drivers = [
        {**driver, "value": value}
        for driver, value in zip(ways.driven(setting, motion.result), begin, strict=True)
    ]
    return KernelSource(
        motion,
        setting,
        run,
        tuple((name, str(units.get(name, "") or _unit(name)), values[name]) for name in names),
        outputs,
        drivers,
    )


def _why_none(motion: ExportedMotion) -> str:
    """Return the key of the reason why there is no kernel of a motion, "" where there is one."""
    setting, run = motion.setting, motion.run
    if setting is None or run is None:
        return "drivers"
    if setting.graphs.contacts:
        return "curves"
    if setting.graphs.single:
        return live.why_recorded(setting, run, motion.problem.task(motion.task))
    return "superfluous" if setting.scene.redundant else ""


def _unit(name: str) -> str:
    """Return the unit of an automatic name."""
    return "m" if name.rpartition(".")[2] in ("x", "y", "z", "length", "radius") else "SI"


def head_lines(source: KernelSource) -> list[str]:
    """Return the lines of a header: task, driver, numbers and outputs with their units."""
    motion, (first, *others) = source.motion, source.drivers
    lines = [
        f"mechdae {__version__}: {motion.problem.name}, task {motion.task}",
        "",
        "SI units and radians, counter-clockwise positive.",
    ]
    if others:
        lines += ["Rates are in time, with speeds and accelerations of the drivers.", ""]
        lines += ["drivers u, with their values at the first pose:"]
        lines += [
            f"  {k:3d}  {driver['name']} [{driver['unit']}] = {driver['value']!r}"
            for k, driver in enumerate(source.drivers)
        ]
    else:
        low, high = source.range
        lines += [
            "Rates are by the driver's value s: v = y' ds/dt, a = y'' (ds/dt)^2 + y' d2s/dt2.",
            "",
            f"driver s: {first['name']} [{first['unit']}], in the task from {low!r} to {high!r}",
        ]
    lines += ["", "inputs theta, numbers that may be changed:"]
    for k, (name, unit, value) in enumerate(source.inputs):
        lines.append(f"  {k:3d}  {name} [{unit}] = {value!r}")
    lines += ["", "outputs y, each with y' and y'':"]
    for entry in source.outputs:
        unit = "1" if entry["names"][0] == "orientation" else entry["unit"]
        for j, column in enumerate(entry["columns"]):
            part = f"[{j}]" if len(entry["columns"]) > 1 else ""
            lines.append(f"  {column:3d}  {entry['path']}{part} [{unit}]")
    return lines
