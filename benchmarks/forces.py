"""Forces of the four-bar against the yardstick, and by other means beside.

The stage of forces starts from the coordinates of certified poses with their rates and ends
with reactions, efforts, losses and powers; the whole task has the certified kinematics and
the checks as well. The error is that against `absolute` in 80-bit floats, kinematics and all.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmarks import absolute
from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.pairs import Revolute
from mechdae.describe.loads import Torque
from mechdae.describe.mechanism import Body, Ground, Mechanism
from mechdae.describe.tasks.kinds import Driver
from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.values import Table
from mechdae.forces.force_messages import checks
from mechdae.forces.poses import Moving, PoseForces, loaded_run, solved
from mechdae.kernels.run.high_precision import LONG
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.bench.kinematics import interleaved
from mechdae.parts.bench.runs import COUPLER, CRANK, GROUND, ROCKER, yardstick
from mechdae.tasks.solve import solve

SAMPLES = 400
WORKS = {"reactions": "none", "coupled friction": "coupled"}
FIRST = 0.1
"""Angle of the crank at the first pose; at 0 coupler and rocker stop turning on each other."""
TIGHT = 1e-10
NO_SCIPY = "fsolve is not measured: scipy is not installed (pip install 'mechdae[bench]')"


def problem(n: int, friction: str) -> Problem:
    """Return the four-bar of the yardstick with masses, a torque on the rocker, four pins."""
    places = {
        "crank": {"D": (0.0, 0.0), "B": (CRANK, 0.0)},
        "coupler": {"B": (0.0, 0.0), "C": (COUPLER, 0.0)},
        "rocker": {"A": (0.0, 0.0), "C": (ROCKER, 0.0)},
    }
    numbers = zip(absolute.MASSES, absolute.CENTERS, absolute.INERTIAS, strict=True)
    bodies = {
        name: Body(name, Table(points), mass=mass, center=center, inertia=inertia)
        for (name, points), (mass, center, inertia) in zip(places.items(), numbers, strict=True)
    }
    ends = {
        "D": ("ground.D", "crank.D"), "B": ("crank.B", "coupler.B"),
        "C": ("coupler.C", "rocker.C"), "A": ("ground.A", "rocker.A"),
    }  # fmt: skip
    f, r = absolute.FRICTION, absolute.PIN
    pins = {name: Revolute(name, *pair, friction=f, pin_radius=r) for name, pair in ends.items()}
    mechanism = Mechanism(
        ground=Ground(Table({"D": (0.0, 0.0), "A": (GROUND, 0.0)})),
        bodies=Table(bodies),
        joints=Table(pins),
        loads=Table({"work": Torque("work", "rocker", absolute.LOAD)}),
        sketch=Table({"crank": 0.0, "coupler": 1.0, "rocker": 2.0}),
    )
    driver = Driver("crank.angle", from_=FIRST, to=FIRST + 2 * np.pi, speed=absolute.SPEED)
    task = Reactions(driver, poses=n, friction=friction)
    return Problem(mechanism, Table({"forces": task}), name="four-bar with masses")


class Stage:
    """The parts of one task, with kernels built."""

    def __init__(self, n: int, friction: str) -> None:
        own = problem(n, friction)
        task = own.tasks["forces"]
        assert isinstance(task, Reactions)
        self.task = task
        loaded = loaded_run(own, task)
        self.setting, self.moving, self.statics = loaded.setting, loaded.moving, loaded.statics

    def forces(self, moving: Moving | None = None) -> PoseForces:
        """Return the forces at the poses of the run."""
        motion = (moving or self.moving).poses()
        return solved(self.statics, motion, motion.there)

    def whole(self) -> PoseForces:
        """Return them after following the motion again, and check them."""
        moving = Moving(self.setting, run(self.setting, self.task), self.task.quasi_static)
        answer = self.forces(moving)
        checks(self.statics, moving, answer)
        return answer


def measure(
    sizes: tuple[int, ...], repeats: int = 7, compared: int | None = None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return one record per work, means and size, and notes on what was left out.

    Works are the reactions and the effort without friction, and with friction in all four
    pins that acts on the reactions it comes from. ``stage`` [s] is the time of the stage of
    forces alone, ``seconds`` that of the means; ``first`` the whole task from the description
    on. ``error`` is the largest one of a force, relative to the largest force, or of a torque
    or moment to the largest of those. At the size `compared` other means are measured too.
    """
    records: list[dict[str, Any]] = []
    notes: list[str] = []
    for work, friction in WORKS.items():
        truth = None
        for n in sizes:
            start = time.process_time()
            solve(problem(n, friction))
            first = time.process_time() - start
            stage = Stage(n, friction)
            answer = stage.forces()
            crank = np.linspace(FIRST, FIRST + 2 * np.pi, n)
            rows = np.arange(0, n, max(1, n // SAMPLES))
            truth = exact(crank[rows], friction == "coupled")
            ways: dict[str, Callable[[], Any]] = {"forces": stage.forces, "whole task": stage.whole}
            if n == compared:
                ways |= _others(crank, friction == "coupled", notes)
            for method, way in ways.items():
                result = way()
                if isinstance(result, PoseForces):
                    result = table_of(result)
                count = repeats if n != compared or method in ("forces", "whole task") else 3
                ours, theirs = interleaved(way, partial(yardstick, crank), count)
                record = {
                    "task": "reactions", "work": work, "method": method, "setting": "", "n": n,
                    "ratio": ours / theirs, "yardstick": theirs, "seconds": ours,
                    "error": difference(result[rows], truth),
                }  # fmt: skip
                if method == "whole task":
                    record["first"] = first
                    record["not_ok"] = int((~answer.there | answer.jammed | answer.ambiguous).sum())
                records.append(record)
    return records, list(dict.fromkeys(notes))


def exact(crank: Any, friction: bool) -> Any:
    """Return pin forces and torque (n, 9) in 80-bit floats."""
    moving = absolute.motion(crank.astype(LONG))
    return absolute.newton(absolute.equations(moving, friction), absolute.elimination)


def table_of(answer: PoseForces) -> Any:
    """Return pin forces and torque (n, 9) of an answer."""
    forces = answer.whole.reactions[:, :, :2].reshape(len(answer.motion), 8)
    return np.hstack([forces, answer.whole.efforts])


def difference(found: Any, truth: Any) -> float:
    """Return the largest error of forces and of the torque, relative to the largest of them."""
    gap = np.abs(found - truth)
    parts = (slice(0, 8), slice(8, 9))
    return float(max(gap[:, own].max() / np.abs(truth[:, own]).max() for own in parts))


def _others(crank: Any, friction: bool, notes: list[str]) -> dict[str, Callable[[], Any]]:
    """Return other means to the same forces; each builds its equations from the motion."""
    moving = absolute.motion(crank)

    def dense() -> Any:
        return absolute.newton(absolute.equations(moving, friction), absolute.dense)

    found: dict[str, Callable[[], Any]] = {"dense Newton": dense}
    if not friction:
        return found
    try:
        from scipy.optimize import fsolve
    except ImportError:
        notes.append(NO_SCIPY)
        return found

    def one_by_one() -> Any:
        own = absolute.equations(moving, friction)
        y = np.linalg.solve(own.A[0], own.c[0])
        rows = np.empty_like(own.c)
        for k in range(len(rows)):
            A, c, G = own.A[k], own.c[k], own.G[k]

            def left(y: Any, A: Any = A, c: Any = c, G: Any = G) -> Any:
                return A @ y - c - G @ np.hypot(y[0:8:2], y[1:8:2])

            def slope(y: Any, A: Any = A, G: Any = G) -> Any:
                J, along = A.copy(), G / np.hypot(y[0:8:2], y[1:8:2])
                J[:, 0:8:2] -= along * y[0:8:2]
                J[:, 1:8:2] -= along * y[1:8:2]
                return J

            rows[k] = y = fsolve(left, y, fprime=slope, xtol=TIGHT)
        return rows

    return found | {"fsolve": one_by_one}


def table(records: list[dict[str, Any]], notes: list[str]) -> str:
    """Return the records as text."""
    lines = [
        f"{'forces of the four-bar':44} {'poses':>8} {'ms':>9} {'ns/pose':>9} "
        f"{'x yardstick':>12} {'first ms':>9} {'error':>9}"
    ]
    for r in records:
        first = f"{r['first'] * 1e3:9.1f}" if "first" in r else " " * 9
        lines.append(
            f"{r['work'] + ', ' + r['method']:44} {r['n']:8d} {r['seconds'] * 1e3:9.2f} "
            f"{r['seconds'] / r['n'] * 1e9:9.0f} {r['ratio']:12.2f} {first} {r['error']:9.1e}"
        )
    lines.append(
        "forces: from coordinates of certified poses to reactions, efforts, losses, powers; whole "
        "task: with the certified kinematics and the checks; dense Newton, fsolve: pin forces and "
        "torque from angles and their rates"
    )
    return "\n".join([*lines, *notes])


def measured(
    sizes: tuple[int, ...], repeats: int, compared: int
) -> tuple[list[dict[str, Any]], str]:
    """Return the records and their text."""
    records, notes = measure(sizes, repeats, compared)
    return records, table(records, notes)
