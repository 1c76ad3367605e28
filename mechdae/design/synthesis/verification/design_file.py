"""A design as its file says it: what is swept and solved of it, and nothing of the search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.limits import limited
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.describe.tasks.studies import Sensitivity
from mechdae.describe.values import Table
from mechdae.design.studies.sensitivity import sensitivity, sharp
from mechdae.errors import MechdaeError
from mechdae.motion.kinematics.sweep import sweep
from mechdae.records import dataclass
from mechdae.results import FINE, Result
from mechdae.results.rotations import matrices
from mechdae.tasks.dispatch.solve import solve
from mechdae.types import Floats, Matrix

POSES = 721
"""Poses of a sweep over a turn."""
TURN = 2 * np.pi
ORIGIN = "origin_of_the_frame"
AXES = tuple(f"{ORIGIN}_{axis}" for axis in "xyz")
"""Names of the points that a design has where deviations of a body are asked for."""


def with_origin(mechanism: Mechanism, body: str) -> Mechanism:
    """Return a mechanism with points at the origin of a body's frame and, in space, on its axes."""
    described = mechanism.bodies[body]
    every = [ORIGIN, *AXES] if mechanism.dimension == 3 else [ORIGIN]
    places = np.vstack([np.zeros(mechanism.dimension), np.eye(mechanism.dimension)])
    added = {name: tuple(place) for name, place in zip(every, places.tolist(), strict=False)}
    described = replace(described, points=Table({**described.points, **added}))
    return replace(mechanism, bodies=Table({**mechanism.bodies, body: described}))


def driven(coordinate: str, low: float, high: float) -> Driver:
    """Return a driver over a range, or at the one value that it is."""
    return Driver(coordinate, at=(low,)) if low == high else Driver(coordinate, from_=low, to=high)


@dataclass
class DesignFile:
    """A design to be measured.

    ``at``: the driver's values at the poses of the first goal. ``full_turn``: whether the driver
    has to turn fully. ``around``: whether those poses may be reached in any order, either way
    round.
    """

    problem: Problem
    driver: str
    at: Floats
    full_turn: bool = False
    around: bool = False
    dyads: bool = False
    boxed: tuple[str, ...] = ()
    tasks: Mapping[str, Task] = field(default_factory=dict)

    @cached_property
    def turned(self) -> bool:
        """Whether the driver is an angle, not a slide."""
        return coordinate(self.problem.mechanism, self.driver).is_angle

    @cached_property
    def numbers(self) -> Mapping[str, float]:
        """The parameters and dimensions of the file by name."""
        return self.problem.mechanism.values()

    def with_tasks(self, tasks: Mapping[str, Task]) -> Problem:
        return replace(self.problem, tasks=Table(tasks))

    # -- sweeps --------------------------------------------------------------------------------

    def poses_at(self, at: Floats | list[float]) -> Sweep:
        """Return the task of poses at driver values."""
        return Sweep(Driver(self.driver, at=tuple(float(value) for value in at)))

    def swept(
        self, at: Floats | list[float], outputs: tuple[str, ...]
    ) -> tuple[Result | None, list[str]]:
        """Return the poses at driver values, and what is wrong with them."""
        found, bad = self._swept(replace(self.poses_at(at), outputs=outputs, derivatives=0))
        if found is None:
            return None, [f"does not assemble: {bad}"]
        if found.summary.get("stopped"):
            return found, [str(found.fault)]
        return found, [f"{bad} of {len(at)} poses are not reached on one branch"] if bad else []

    def _swept(self, task: Sweep) -> tuple[Result | None, Any]:
        """Return a sweep of the design and how many poses are missing, or None and why."""
        try:
            found = sweep(self.with_tasks({"way": task}), "way", task)
        except MechdaeError as error:
            return None, error.what
        return found, sum(str(word) not in FINE for word in found.status)

    @cached_property
    def turn(self) -> tuple[Result | None, list[str]]:
        """A whole turn of the driver on a fine grid, or what the first goal needs of it."""
        if self.full_turn:
            first = float(self.at[0])
            return self._ranged(first, first + TURN)
        found: tuple[Result | None, list[str]] = (None, [])
        for low, high in self._arcs():
            found = self._ranged(low, high)
            if not found[1]:
                break
        return found

    def _arcs(self) -> list[tuple[float, float]]:
        """Return the ranges that hold all poses, of poses in any order the shortest one first."""
        if not self.around:
            return [(float(np.min(self.at)), float(np.max(self.at)))]
        turned = np.sort(np.mod(self.at, TURN))
        arcs = [
            (float(turned[k]), float(turned[k - 1] + (TURN if k else 0)))
            for k in range(len(turned))
        ]
        return sorted(arcs, key=lambda arc: arc[1] - arc[0])

    def _ranged(self, low: float, high: float) -> tuple[Result | None, list[str]]:
        task = Sweep(
            driven(self.driver, low, high), poses=None if low == high else POSES,
            outputs=None if limited(self.problem.mechanism.joints) else self.boxed or None,
            derivatives=2,
            measures=("transmission",) if self.dyads else (),
        )  # fmt: skip
        found, lost = self._swept(task)
        if found is None:
            return None, [f"does not move over its range: {lost}"]
        if found.summary.get("stopped"):
            return found, [str(found.fault)]
        if lost or (self.full_turn and found.summary.get("limits")):
            word = "turn fully" if self.full_turn else "run over its range"
            return found, [f"the input does not {word} on one circuit"]
        return found, []

    @cached_property
    def transmission(self) -> float | None:
        """The least transmission angle over that range [rad], where there are dyads."""
        if self.turn[0] is None:
            return None
        angles = [e["min"] for e in self.turn[0].summary.get("transmission", {}).values()]
        return float(min(angles)) if angles else None

    def transmissions(self, at: Floats | list[float]) -> dict[str, Floats]:
        """Return the transmission angles (k,) by joint at driver values."""
        task = Sweep(
            Driver(self.driver, at=tuple(float(value) for value in at)), derivatives=0,
            measures=("transmission",),
        )  # fmt: skip
        joints = self.solved_as(task).joints
        return {
            name: np.asarray(joint["transmission_angle"], float)
            for name, joint in joints.items() if "transmission_angle" in joint
        }  # fmt: skip

    # -- tasks ---------------------------------------------------------------------------------

    def solved(self, task: str, figures: tuple[str, ...] = ()) -> Result:
        """Return the result of one of the problem's own tasks, sharp enough for its `figures`."""
        problem = self.with_tasks(self.tasks)
        found = solve(sharp(problem, task, figures) if figures else problem, task)
        assert isinstance(found, Result)
        return found

    def solved_as(self, task: Task) -> Result:
        """Return the result of a task of one's own with these dimensions."""
        found = solve(self.with_tasks({"own": task}), "own")
        assert isinstance(found, Result)
        return found

    def slopes(
        self, task: Sweep | str, paths: tuple[str, ...], names: Sequence[str], origin: str = ""
    ) -> dict[str, tuple[Any, Any]]:
        """Return values (n, w) and derivatives (n, w, nt) by names of paths of a task, or its name.

        They are those of a task of sensitivity of the file of this design; with the name of a body
        in `origin` its file has the point `ORIGIN` at the origin of that body's frame, in space
        the points `AXES` one metre along its axes too.
        """
        added = {} if isinstance(task, str) else {"own": task}
        asked = Sensitivity(of=task if isinstance(task, str) else "own", outputs=paths,
                            wrt=tuple(names))  # fmt: skip
        problem = self.with_tasks({**self.tasks, **added, "slopes": asked})
        if origin:
            problem = replace(problem, mechanism=with_origin(problem.mechanism, origin))
        data = sensitivity(problem, "slopes", asked).data
        found = {}
        for path in paths:
            value = np.atleast_1d(np.asarray(data["values"][path], float))
            by_name = [np.asarray(data["derivatives"][path][n], float) for n in names]
            rows = len(value)
            found[path] = (
                value.reshape(rows, -1),
                np.stack([slopes.reshape(rows, -1) for slopes in by_name], axis=2),
            )
        return found

    def origin(self, found: Result, body: str) -> Matrix:
        """Return where the origin of a body's frame is, (n, 2) or (n, 3)."""
        mechanism = self.problem.mechanism
        name = next(iter(mechanism.bodies[body].points))
        local = np.array([self.numbers[f"{body}.{name}.{axis}"] for axis in mechanism.axes])
        if mechanism.dimension == 2:
            angle = found.bodies[body].angle
            c, s = np.cos(angle), np.sin(angle)
            arm = np.stack([c * local[0] - s * local[1], s * local[0] + c * local[1]], axis=1)
        else:
            arm = matrices(found.bodies[body].orientation) @ local
        place: Matrix = found.points[f"{body}.{name}"].position - arm
        return place
