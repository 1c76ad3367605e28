"""A quantity of one of the problem's tasks as a function of a pose and the free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.goals import Extreme
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.tasks.shaking import WORDS, shaking_paths
from mechdae.design.derivatives.composed import INPUT, SERIES, Composed, is_series
from mechdae.equations.parameters import parameters_of
from mechdae.errors import InputError, UnavailableError, UnknownName
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.poses import loaded_run
from mechdae.motion.kinematics.prepared import prepare
from mechdae.types import Graph

if TYPE_CHECKING:
    from mechdae.motion.kinematics.prepared import Setting

SX = ca.SX
SMOOTH = 1e-4
"""Share of the drivers' speed over which signs of sliding speeds change."""
TRANSMISSION = "transmission_angle"
MEANS = ("summary/loss", "summary/input", "summary/efficiency")
"""Means over a cycle that are goals."""
SUMMARIES = ("summary/stroke/", "summary/swing/", "summary/time_ratio/")
"""Scalars of a sweep that are goals, by the ends of a coordinate."""
NODES = 72
TURN = 2 * np.pi


class Quantity:
    """A quantity of a task."""

    def __init__(self, problem: Problem, asked: Extreme, driver: str, free: Sequence[str]) -> None:
        self.asked: Extreme = asked
        self.free: list[str] = list(free)
        base = problem.tasks[asked.task]
        assert isinstance(base, Sweep)
        self.base = base
        place = f"goal.of: {asked.task}"
        drivers = [d.coordinate for d in base.all_drivers]
        if drivers != [driver]:
            raise InputError(
                f"task '{asked.task}' is driven by {', '.join(drivers)}, not by {driver}",
                where=place,
            )
        self.forces: bool = isinstance(base, Reactions)
        self.transmission: bool = asked.path.endswith(f"/{TRANSMISSION}")
        if asked.path in MEANS and not (isinstance(base, Reactions) and base.cycle):
            raise InputError(
                f"'{asked.path}' belongs to reactions over a cycle",
                where=place,
                hint="cycle = true",
            )
        series = is_series(asked.path) or asked.path in (*MEANS, *WORDS)
        if not series or (self.transmission and self.forces):
            raise UnknownName(
                "path of a goal",
                asked.path,
                ["points/", "bodies/", "joints/", "efforts/", *WORDS, *MEANS, *SUMMARIES],
            )
        if self.transmission and "transmission" not in (base.measures or ()):
            raise InputError(
                f"task '{asked.task}' does not measure transmission angles",
                where=place,
                hint='measures = ["transmission"] in that task',
            )
        if isinstance(base, Reactions) and base.direction != "driver" and asked.path in MEANS:
            raise UnavailableError(
                "means over a cycle that the loads drive are no goals yet", where=place
            )
        if asked.path.rpartition("/")[2] in SERIES.added() and "bands" not in base.holds:
            raise InputError(
                f"task '{asked.task}' has no bands", where=place, hint="a task of kind play"
            )
        measures = base.measures or ()
        wanted = replace(
            base, derivatives=0 if self.transmission else max(2, base.derivatives),
            measures=measures,
        )  # fmt: skip
        self.statics: InverseDynamics | None = None
        if isinstance(wanted, Reactions):
            loaded = loaded_run(problem, wanted, free)
            self.statics = loaded.statics
            self.setting: Setting = loaded.setting
            if self.statics.loads.signals or self.statics.loads.timed:
                raise UnavailableError("loads from tables cannot be optimised yet", where=place)
        else:
            self.setting = prepare(problem, wanted, free=free)
        self.turns: bool = self._closed()

    def _closed(self) -> bool:
        """Whether the task runs over whole turns."""
        values = self.setting.plan.values
        if values is None:
            raise InputError(
                f"task '{self.asked.task}' sweeps what assembles, its poses depend on the design",
                hint="give its driver from and to",
            )
        span = float(abs(values[-1, 0] - values[0, 0]))
        return self.setting.plan.coordinates[0].is_angle and abs(span - TURN) < 1e-9

    @cached_property
    def nodes(self) -> Any:
        """Driver values (k,) at which the quantity is looked at."""
        values = self.setting.plan.values[:, 0]
        if self.setting.plan.named:
            return values
        if self.turns:
            return values[0] + (values[-1] - values[0]) * np.arange(NODES) / NODES
        return np.linspace(values[0], values[-1], min(NODES, max(len(values), 13)) | 1)

    @cached_property
    def weights(self) -> Any:
        """Shares (k,) of the nodes in a mean over the task."""
        weights = np.ones(len(self.nodes))
        if not self.turns and not self.setting.plan.named:
            weights[[0, -1]] = 0.5
        return weights / weights.sum()

    @property
    def bodies(self) -> tuple[str, ...]:
        """All bodies of the task's scene."""
        return tuple(name for group in self.setting.scene.groups for name in group.bodies)

    @property
    def x_names(self) -> list[tuple[str, str]]:
        """(body, coordinate) of the unknowns the function takes."""
        return self.setting.scene.x_names

    @cached_property
    def function(self) -> Graph:
        """(x, u, free) -> values at a pose: the path's, or loss and input of means."""
        if self.transmission:
            return self._sine
        path = self.asked.path
        if path in MEANS:
            assert self.statics is not None
            losses = [f"joints/{name}/loss" for name in self.statics.balance.joints]
            paths = [*losses, INPUT]
        else:
            paths = list(shaking_paths(path, self.setting.scene.model.mechanism.dimension))
        composed = Composed(self.setting, paths, self.free, self.statics, smooth=SMOOTH)
        values = composed.expression
        if path in MEANS:
            values = ca.vertcat(ca.sum1(values[:-1]), values[-1])
        plan = self.setting.plan
        constant = [
            (composed.du, plan.speed[0]), (composed.ddu, plan.acceleration[0]),
            (composed.time, 0.0), (composed.pieces, 0.0), (composed.signs, 0.0),
            (composed.sizes, 0.0),
        ]  # fmt: skip
        old = ca.vertcat(*[symbol for symbol, _ in constant])
        new = ca.vertcat(*[SX(ca.DM(np.broadcast_to(v, s.numel()))) for s, v in constant])
        values = ca.substitute(values, old, new)
        return ca.Function("quantity", [composed.guess, composed.u, composed.free], [values])

    @cached_property
    def _sine(self) -> Graph:
        """(x, u, free) -> sine of the transmission angle."""
        joint = self.asked.path.split("/")[1]
        key = f"transmission of {joint}"
        outputs, g = self.setting.outputs, self.setting.graphs
        lines = [e for e in outputs.entries if e.part == key]
        if not lines:
            known = [
                e.part.removeprefix("transmission of ") for e in outputs.entries
                if e.part.startswith("transmission of ")
            ]  # fmt: skip
            raise UnknownName("joint with a transmission angle", joint, known)
        products = outputs.expression[
            list(lines[0].columns)
        ]  # the first one vanishes with the sine
        sine = ca.fabs(products[0]) / ca.sqrt(ca.sumsqr(products))
        scene, model = self.setting.scene, self.setting.scene.model
        d = SX.sym("d", len(self.free))
        p = parameters_of(model, self.free, d)
        old = ca.vertcat(scene.x, scene.u, model.p)
        sine = ca.substitute(sine, old, ca.vertcat(g.x, g.u, p))
        return ca.Function("sine", [g.x, g.u, d], [sine])
