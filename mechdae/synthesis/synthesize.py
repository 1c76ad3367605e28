"""The task of kind synthesis: starts, optima, distinct designs, each verified."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.goals import Demand, demand
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Driver, Sweep, Synthesis
from mechdae.describe.writing import dumps
from mechdae.errors import UnavailableError
from mechdae.results import Result
from mechdae.synthesis.ipopt import Optimum
from mechdae.synthesis.path import Limits, PathGoal, PathProblem
from mechdae.synthesis.poses import Poses, parameters_of
from mechdae.synthesis.projection import CLASSES, Start, screened
from mechdae.synthesis.verify import design_problem, verified

SAMPLES = 20_000
"""Ratios drawn in the screening of each class."""
FEASIBLE = 1e-7
"""Largest violation of a constraint at an optimum that counts."""
SAME = 1e-5
"""Share by which objectives of one optimum may differ."""
MOST = 10
"""Designs that are reported."""
ACTIVE = 1e-6
"""Share of its range by which a parameter at its bound may be away from it."""
ZERO = 1e-12
"""Share of the targets' size squared below which an objective is that of an exact design."""


@dataclass(frozen=True)
class Candidate:
    """An optimum with the class, branch and sense it was found in."""

    found: Optimum
    kind: int
    branch: Any
    sense: int
    objective: float


def synthesize(
    problem: Problem,
    name: str,
    task: Synthesis,
    starts: int | None = None,
    seed: int | None = None,
) -> Result:
    """Return the designs of a task of synthesis, best first, each swept and certified.

    Raises
    ------
    InputError, UnavailableError
        What is asked for is wrong, or not computed by this version.
    """
    asked = demand(problem.mechanism, task)
    began = time.process_time()
    poses = Poses(problem.mechanism, asked.driver, tuple(asked.free), (asked.goal.point,))
    classes = _classes(poses, asked)
    seed = asked.seed if seed is None else seed
    count = asked.starts if starts is None else starts
    built = time.process_time() - began
    jobs = list(_starts(classes, asked, count, seed))
    candidates, statuses = [], []
    for kind, start in jobs:
        own = classes[kind]
        z0, branch = own.point_of(start)
        found = own.solve(z0, branch, start.sense)
        statuses.append(found.status)
        if found.violation <= FEASIBLE and np.isfinite(found.objective):
            objective = found.objective * own.size**2
            candidates.append(Candidate(found, kind, branch, start.sense, objective))
    distinct = _distinct(candidates, classes)
    designs, rejected = _designs(problem, name, asked, poses, classes, distinct)
    summary = {
        "starts": len(jobs),
        "converged": len(candidates),
        "distinct": len(distinct),
        "hits_of_best": distinct[0][1] if distinct else 0,
        "seed": seed,
        "status": "found" if designs else "none found",
        "rejected": rejected,
        "ipopt": {word: statuses.count(word) for word in dict.fromkeys(statuses)},
        "seconds": {"build": built, "whole": time.process_time() - began},
    }
    fault = None
    if not designs:
        fault = (
            f"no design found from {len(jobs)} starts: {len(candidates)} met all constraints, "
            f"{len(rejected)} were rejected by their sweep"
        )
    return Result(
        problem.name, name, task.kind, problem.mechanism, problem.title,
        status=np.array(["ok"] * len(designs)), summary=summary, fault=fault, definition=task,
        data={"designs": designs},
    )  # fmt: skip


def _classes(poses: Poses, asked: Demand) -> list[PathProblem]:
    goal = PathGoal(
        asked.goal.point,
        np.array(asked.goal.targets),
        asked.goal.timing,
        np.array(asked.goal.programme) if asked.goal.programme else None,
        np.array(asked.goal.weights),
    )
    limits = Limits(grashof=asked.margin, transmission=asked.transmission)
    kinds = CLASSES if asked.full_turn else ("",)
    made = [PathProblem(poses, goal, asked.free, kind, limits) for kind in kinds]
    if made[0].loop is None:
        raise UnavailableError(
            "paths of other mechanisms than four-bars with revolutes are not computed by this "
            "version",
            where="goal",
        )
    return made


def _starts(
    classes: list[PathProblem], asked: Demand, count: int, seed: int
) -> Iterable[tuple[int, Start]]:
    """Yield starts of all classes, those with the smallest residual first."""
    goal = classes[0].goal
    found: list[tuple[int, Start]] = []
    for k, own in enumerate(classes):
        generator = np.random.default_rng([seed, k])
        programme = own.relative_programme()
        found += [
            (k, start)
            for start in screened(
                goal.targets, generator, SAMPLES, count, own.kind or "crank-rocker", programme,
                goal.mode, own.fixed_frame(), own.length_limits(),
            )
        ]  # fmt: skip
    found.sort(key=lambda pair: pair[1].residual)
    return found[:count]


def _distinct(
    candidates: list[Candidate], classes: list[PathProblem]
) -> list[tuple[Candidate, int]]:
    """Return one candidate for each objective, best first and polished, with its hits."""
    order = sorted(candidates, key=lambda c: c.objective)
    found: list[tuple[Candidate, int]] = []
    for candidate in order:
        size = classes[candidate.kind].size ** 2
        if found:
            last = found[-1][0].objective
            exact = max(candidate.objective, last) <= ZERO * size
            if exact or candidate.objective - last <= SAME * max(last, ZERO * size):
                found[-1] = (found[-1][0], found[-1][1] + 1)
                continue
        if len(found) == 3 * MOST:
            break
        found.append((candidate, 1))
    return found


def _designs(
    problem: Problem,
    name: str,
    asked: Demand,
    poses: Poses,
    classes: list[PathProblem],
    distinct: list[tuple[Candidate, int]],
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    designs: list[dict[str, Any]] = []
    rejected: list[dict[str, Any]] = []
    for candidate, hits in distinct:
        if len(designs) == MOST:
            break
        own = classes[candidate.kind]
        found = own.polished(candidate.found, candidate.branch, candidate.sense)
        values = dict(zip(poses.free, found.z[: own.n].tolist(), strict=True))
        at = own.driver_values(found.z, candidate.sense)
        sketch = sketch_of(poses, own, found.z, at[0])
        checked = verified(
            problem, values, sketch, asked.driver, at, asked.goal.point,
            np.array(asked.goal.targets), asked.full_turn, own.size,
        )  # fmt: skip
        weights = np.array(asked.goal.weights)
        objective = float(np.sum(weights * checked.errors**2))
        claimed = found.objective * own.size**2
        defects = list(checked.defects)
        if not np.isfinite(objective) or abs(objective - claimed) > 1e-6 * claimed + 1e-12 * (
            own.size**2
        ):
            defects.append(f"the sweep gives {objective:.6g}, not {claimed:.6g}")
        if defects:
            rejected.append({"objective": claimed, "reasons": defects})
            continue
        task = Sweep(
            Driver(asked.driver, from_=float(at[0]), to=float(at[0] + 2 * np.pi * candidate.sense))
            if asked.full_turn
            else Driver(asked.driver, from_=float(at[0]), to=float(at[-1]))
        )
        designs.append(
            {
                "objective": objective,
                "parameters": values,
                "errors": checked.errors.tolist(),
                "at": at.tolist(),
                "defects": [],
                "transmission_angle_min": checked.transmission,
                "active": own.active(found, ACTIVE),
                "class": own.kind or "any",
                "hits": hits,
                "problem": dumps(design_problem(problem, values, sketch, asked.driver, task)),
            }
        )
    return designs, rejected


def sketch_of(poses: Poses, own: PathProblem, z: Any, u: float) -> dict[str, float]:
    """Return angles of all bodies and the driver's value at the first target."""
    scene, model = poses.scene, poses.model
    d = z[: own.n]
    names = [name for name in scene.recover if name[1] == "angle"]
    stacked = ca.vertcat(*[scene.recover[name] for name in names])
    values = ca.Function("angles", [scene.x, scene.u, model.p], [stacked])
    p = np.array(ca.DM(parameters_of(model, poses.free, ca.SX(ca.DM(d))))).ravel()
    angles = np.array(values(own.first_pose(z), u, p)).ravel()
    sketch = {body: float(angle) for (body, _), angle in zip(names, angles, strict=True)}
    driver = scene.drivers[0].text
    if driver.split(".")[0] not in sketch:
        sketch[driver.removesuffix(".angle")] = float(u)
    return sketch
