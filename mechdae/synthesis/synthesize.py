"""The task of kind synthesis: starts, optima, distinct designs, each verified."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.goals import Demand, demand
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Driver, Sweep, Synthesis
from mechdae.describe.writing import dumps
from mechdae.results import Result
from mechdae.synthesis.goals.path import Path
from mechdae.synthesis.ipopt import Optimum
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.poses import Poses, parameters_of
from mechdae.synthesis.search import Goal, Limits, Seed, Space
from mechdae.synthesis.verify import design_problem, verified

FEASIBLE = 1e-7
"""Largest violation of a (dimensionless) constraint at an optimum that counts."""
SAME = 1e-5
"""Share by which objectives of one optimum may differ."""
MOST = 5
"""Designs that are reported."""
ACTIVE = 1e-6
"""Share of its range by which a parameter at its bound may be away from it."""
ZERO = 1e-12
"""Objective of the NLP below which a design is exact."""
WORDS = ("full turn", "transmission", "branch", "order", "turn")
"""Constraints whose prices are told."""


@dataclass(frozen=True)
class Candidate:
    """An optimum with the class and the start it was found from."""

    found: Optimum
    kind: int
    given: dict[str, Any]


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
    goal = _goal(problem, asked)
    problems = [goal.build(kind) for kind in goal.kinds]
    seed = asked.seed if seed is None else seed
    count = asked.starts if starts is None else starts
    built = time.process_time() - began
    candidates, statuses = [], []
    jobs = _jobs(goal, problems, count, seed)
    for kind, start in jobs:
        nlp = problems[kind]
        found = nlp.solve(nlp.point(start.values), start.given)
        statuses.append(found.status)
        if found.violation <= FEASIBLE and np.isfinite(found.objective):
            candidates.append(Candidate(found, kind, start.given))
    distinct = _distinct(candidates)
    designs, rejected = _designs(problem, asked, goal, problems, distinct)
    summary = {
        "starts": len(jobs),
        "converged": len(candidates),
        "distinct": len(distinct),
        "hits_of_best": designs[0]["hits"] if designs else 0,
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
            f"{len(rejected)} of them were rejected by their sweep"
        )
    return Result(
        problem.name, name, task.kind, problem.mechanism, problem.title,
        status=np.array(["ok"] * len(designs)), summary=summary, fault=fault, definition=task,
        data={"designs": designs},
    )  # fmt: skip


def _goal(problem: Problem, asked: Demand) -> Goal:
    targets = np.array(asked.goal.targets)
    spread = np.sum((targets - targets.mean(axis=0)) ** 2, axis=1)
    poses = Poses(problem.mechanism, asked.driver, tuple(asked.free), (asked.goal.point,))
    limits = Limits(asked.full_turn, asked.margin, transmission=asked.transmission)
    return Path(Space(poses, asked.free, limits, float(np.sqrt(np.mean(spread)))), asked.goal)


def _jobs(goal: Goal, problems: Sequence[Nlp], count: int, seed: int) -> list[tuple[int, Seed]]:
    """Return `count` starts of each class, the most promising first."""
    found: list[tuple[int, Seed]] = []
    for k, kind in enumerate(goal.kinds):
        generator = np.random.default_rng([seed, k])
        found += [(k, start) for start in goal.seeds(kind, problems[k], generator, count)]
    return sorted(found, key=lambda pair: pair[1].residual)


def _distinct(candidates: list[Candidate]) -> list[tuple[Candidate, int]]:
    """Return one candidate for each objective, best first, with its hits."""
    found: list[tuple[Candidate, int]] = []
    for candidate in sorted(candidates, key=lambda c: c.found.objective):
        value = candidate.found.objective
        if found:
            last = found[-1][0].found.objective
            if value <= ZERO or value - last <= SAME * last:
                found[-1] = (found[-1][0], found[-1][1] + 1)
                continue
        if len(found) == 3 * MOST:
            break
        found.append((candidate, 1))
    return found


def _designs(
    problem: Problem,
    asked: Demand,
    goal: Goal,
    problems: Sequence[Nlp],
    distinct: list[tuple[Candidate, int]],
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the designs that hold in their sweep, and those that do not with the reasons."""
    designs: list[dict[str, Any]] = []
    rejected: list[dict[str, Any]] = []
    space = goal.space
    weights, targets = np.array(asked.goal.weights), np.array(asked.goal.targets)
    for candidate, hits in distinct:
        if len(designs) == MOST:
            break
        nlp, given = problems[candidate.kind], candidate.given
        found = nlp.polished(candidate.found, given)
        variables = nlp.read(found.z)
        values = dict(zip(space.poses.free, variables["d"].tolist(), strict=True))
        at = goal.driver_values(variables, given)
        sketch = sketch_of(space.poses, variables["d"], variables["x"], float(at[0]))
        checked = verified(
            problem, values, sketch, asked.driver, at, asked.goal.point, targets,
            asked.full_turn, space.size,
        )  # fmt: skip
        objective = float(np.sum(weights * checked.errors**2))
        claimed = goal.objective(found.objective)
        defects = list(checked.defects)
        slack = 1e-6 * claimed + 1e-12 * goal.objective(1.0)
        if not abs(objective - claimed) <= slack:
            defects.append(f"the sweep gives {objective:.6g}, not {claimed:.6g}")
        if defects:
            rejected.append({"objective": claimed, "reasons": defects})
            continue
        last = at[0] + 2 * np.pi * given.get("sense", 1.0) if asked.full_turn else at[-1]
        task = Sweep(Driver(asked.driver, from_=float(at[0]), to=float(last)))
        designs.append(
            {
                "objective": objective,
                "parameters": values,
                "errors": checked.errors.tolist(),
                "at": np.asarray(at).tolist(),
                "defects": [],
                "transmission_angle_min": checked.transmission,
                "active": _active(goal, nlp, found),
                "class": goal.kinds[candidate.kind] or "any",
                "hits": hits,
                "problem": dumps(design_problem(problem, values, sketch, asked.driver, task)),
            }
        )
    return designs, rejected


def _active(goal: Goal, nlp: Nlp, found: Optimum) -> dict[str, float]:
    """Return the parameters and limits that hold the design back, with their prices.

    A price is the change of the objective per unit by which a limit gives way.
    """
    prices = {}
    unit = goal.objective(1.0)
    place = nlp.place("d").start
    for k, name in enumerate(goal.space.poses.free):
        low, high = goal.space.bounds[name]
        if min(found.z[place + k] - low, high - found.z[place + k]) <= ACTIVE * (high - low):
            prices[name] = float(abs(found.bound_prices[place + k]) * unit)
    for word in WORDS:
        rows = [i for i, name in enumerate(nlp.words) if name == word]
        most = float(np.abs(found.prices[rows]).max(initial=0.0))
        if rows and most > ACTIVE:
            prices[word] = most * unit
    return prices


def sketch_of(poses: Poses, d: Any, x: Any, u: float) -> dict[str, float]:
    """Return angles of all bodies and the driver's value at the first pose."""
    scene, model = poses.scene, poses.model
    names = [name for name in scene.recover if name[1] == "angle"]
    stacked = ca.vertcat(*[scene.recover[name] for name in names])
    p = np.array(ca.DM(parameters_of(model, poses.free, ca.SX(ca.DM(d))))).ravel()
    values = ca.Function("angles", [scene.x, scene.u, model.p], [stacked])
    angles = np.array(values(x[: poses.nx], u, p)).ravel()
    sketch = {body: float(angle) for (body, _), angle in zip(names, angles, strict=True)}
    driver = scene.drivers[0].text
    if driver.split(".")[0] not in sketch:
        sketch[driver.removesuffix(".angle")] = u
    return sketch
