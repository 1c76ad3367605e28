"""The search that a task stands for: its goals over one space, NLPs by class, starts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.limits import limited
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.constraints import Box, LimitConstraint, TransmissionAngle
from mechdae.describe.tasks.goals import Extreme as AskedExtreme
from mechdae.describe.tasks.goals import FunctionTargets, Rocker, StraightLine, Visits
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.tasks.motion import Equilibrium, Motion
from mechdae.describe.tasks.shaking import WORDS, with_shaking
from mechdae.describe.tasks.synthesis import Demand, Synthesis, demand
from mechdae.design.synthesis.exact.complete import Follow
from mechdae.design.synthesis.goals.base import Drawn, Goal, Seed
from mechdae.design.synthesis.goals.dynamic import Dynamic
from mechdae.design.synthesis.goals.extreme import ExtremeGoal
from mechdae.design.synthesis.goals.function import Function
from mechdae.design.synthesis.goals.path_generation import VisitsGoal
from mechdae.design.synthesis.goals.rocker import RockerGoal
from mechdae.design.synthesis.goals.straight import StraightGoal
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.outcome import Outcome, TaskRun
from mechdae.design.synthesis.poses import FreePoses, dimensions
from mechdae.design.synthesis.quantity import Quantity
from mechdae.design.synthesis.robust.values import nominal_notes, robust_goals
from mechdae.design.synthesis.space import TURN, DesignSpace, inside
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import watched
from mechdae.design.synthesis.verification.quantities import quantity_of
from mechdae.design.synthesis.verify import sketched
from mechdae.equations.model import Model
from mechdae.equations.tree.bars import check_bars
from mechdae.errors import InputError, UnknownName
from mechdae.types import Floats, Json, Sym

if TYPE_CHECKING:
    from numpy.random import Generator

    from mechdae.design.synthesis.robust.deviations import Deviations


PICK, MOST = "pick", "most"
"""Parameters of the NLP of a front: share of each objective, the most that it may be."""
NO_LIMIT = 1e6
"""An objective, dimensionless, that every design keeps."""
ENDS = ("stroke", "swing", "time_ratio")
"""Scalars of a summary that follow from the two ends of a coordinate."""

TIMED = re.compile("velocity|acceleration|jerk")
INSIDE = (0.381966, 0.706107)
"""Places in the ranges of free numbers at which bars are looked at."""


def shaken_by(asked: Demand) -> list[str]:
    """Return the tasks whose shaking forces or moments are asked for."""
    every = [goal for goal, _ in asked.goals if isinstance(goal, AskedExtreme)]
    every += [limit.quantity for limit in asked.of(LimitConstraint)]
    return [q.task for q in every if q.path in WORDS]


def _check_bars(mechanism: Mechanism, free: Mapping[str, tuple[float, float]]) -> None:
    """Raise for links that spin freely, in space, whose mass leaves their line, for free numbers
    too.
    """
    check_bars(mechanism)
    for share in INSIDE:
        inside = {name: low + share * (high - low) for name, (low, high) in free.items()}
        check_bars(mechanism.with_values(inside))


class Search:
    """Everything that is built once for a task: goals, limits, space, NLPs."""

    problem: Problem

    def __init__(self, problem: Problem, task: Synthesis) -> None:
        self.asked: Demand = demand(problem, task)
        shaken = shaken_by(self.asked)
        if shaken and problem.mechanism.dimension == 3:
            _check_bars(problem.mechanism, self.asked.free)
        self.problem = problem = with_shaking(problem, shaken)
        self.task = task
        names = [*self.asked.free, *self.asked.choices]
        self._quantities: dict[tuple[str, str], Quantity] = {}
        self.assumed: dict[str, None] = {}
        self._runs: dict[str, TaskRun] = {}
        self._outcomes: list[Outcome] = []
        self.goals: list[Goal] = [
            self._goal(goal, f"goal{k}", names) for k, (goal, _) in enumerate(self.asked.goals)
        ]
        self.weights: list[float] = [weight for _, weight in self.asked.goals]
        self.limits: list[Goal] = [
            self._extreme(limit.quantity, f"limit{k}", names, limit.bounds)
            for k, limit in enumerate(self.asked.of(LimitConstraint))
        ]
        self.size: float = self._size()
        every = [*self.goals, *self.limits]
        bodies = dict.fromkeys(body for goal in every for body in goal.bodies())
        boxed = dict.fromkeys(point for box in self.asked.of(Box) for point in box.points)
        held = [
            b for angle in self.asked.of(TransmissionAngle) for b in angle.between if b != GROUND
        ]

        stopped = limited(problem.mechanism.joints)
        held += [body for joint in stopped for body in joint.bodies if body != GROUND]

        def asks(model: Model) -> dict[str, Sym]:
            found = {point: model.point(point) for point in boxed}
            found |= inside(model, stopped, self.size)
            for goal in every:
                found |= goal.asks(model)
            return found

        whole = [*bodies, *boxed, *held]
        in_plane = problem.mechanism.dimension == 2
        outputs = [
            name if "." in name or not in_plane else f"{name}.angle"
            for name in dict.fromkeys(whole)
        ]
        poses = FreePoses(
            problem.mechanism, self.asked.driver, names, outputs, asks, self.asked.tolerances
        )
        self.space: DesignSpace = DesignSpace(poses, self.asked, self.size, bool(self._runs))
        self.spread: Spread = Spread(self.space)
        for goal in every:
            goal.space, goal.spread = self.space, self.spread
        self.robust: Deviations | None = robust_goals(self.asked, poses, self.goals)
        self.notes: list[str] = [] if self.robust is None else nominal_notes(self.goals)
        # a goal with targets of its own leads: starts are drawn for it, the others follow
        self.lead: Goal = min(self.goals, key=lambda goal: isinstance(goal, ExtremeGoal | Dynamic))
        self.kinds: tuple[str, ...] = self.space.kinds
        for limit in self.asked.of(TransmissionAngle):
            self.space.dyad(limit.between, f"{limit.place}.between")
        self._check_effect()

    def _goal(self, asked: Any, name: str, names: list[str]) -> Goal:
        if isinstance(asked, Visits):
            return VisitsGoal(asked, name)
        if isinstance(asked, FunctionTargets):
            return Function(asked, name)
        if isinstance(asked, StraightLine):
            return StraightGoal(asked, name)
        if isinstance(asked, Rocker):
            return RockerGoal(asked, name)
        return self._extreme(asked, name, names)

    def _extreme(
        self,
        asked: AskedExtreme,
        name: str,
        names: list[str],
        bounds: tuple[float, float] | None = None,
    ) -> Goal:
        if isinstance(self.problem.tasks[asked.task], Motion | Equilibrium):
            return Dynamic(asked, name, self._outcome(asked, names), bounds)
        word, _, part = asked.path.removeprefix("summary/").partition("/")
        if asked.path.startswith("summary/") and word in ENDS:
            return self._ends(asked, name, word, part, bounds)
        key = (asked.task, asked.path)
        if key not in self._quantities:
            more = [name for name in self.asked.tolerances if name not in names]
            every = [*names, *more]
            self._quantities[key] = Quantity(self.problem, asked, self.asked.driver, every)
        quantity = self._quantities[key]
        typical = 1.0
        if not quantity.transmission and asked.path != "summary/efficiency":
            from mechdae.tasks.dispatch.solve import solve

            result = solve(self.problem, asked.task)
            if quantity.forces or asked.path in WORDS or TIMED.search(asked.path):
                self.assumed |= dict.fromkeys(result.summary.get("assumptions", []))
            found = abs(quantity_of(result, asked))
            typical = found if np.isfinite(found) and found > 0 else 1.0
        return ExtremeGoal(asked, name, quantity, typical, bounds)

    @property
    def said_of_speeds(self) -> dict[str, list[str]]:
        """What tasks of forces and rates assume, for a summary."""
        return {"assumptions": list(self.assumed)} if self.assumed else {}

    def _outcome(self, asked: AskedExtreme, names: list[str]) -> Outcome:
        """Return a number of a motion or an equilibrium; those of one task are solved together."""
        if asked.task not in self._runs:
            every = [goal for goal, _ in self.asked.goals if isinstance(goal, AskedExtreme)]
            every += [limit.quantity for limit in self.asked.of(LimitConstraint)]
            paths = dict.fromkeys(q.path for q in every if q.task == asked.task)
            box = list(self.asked.free.values())
            self._runs[asked.task] = TaskRun(self.problem, asked.task, list(paths), names, box)
        outcome = Outcome(self._runs[asked.task], asked.path)
        self._outcomes.append(outcome)
        return outcome

    def _ends(
        self,
        asked: AskedExtreme,
        name: str,
        word: str,
        part: str,
        bounds: tuple[float, float] | None,
    ) -> RockerGoal:
        """Return stroke, swing or time ratio of a task over a turn as a goal or a limit."""
        from mechdae.tasks.dispatch.solve import solve

        place = f"{name}.of: {asked.task}"
        task = self.problem.tasks[asked.task]
        assert isinstance(task, Sweep)
        mechanism = self.problem.mechanism
        if [d.coordinate for d in task.all_drivers] != [self.asked.driver]:
            raise InputError(
                f"task '{asked.task}' is not driven by {self.asked.driver}", where=place
            )
        if not self.asked.full_turn:
            raise InputError(
                f"'{asked.path}' is that of a driver that turns fully", where=place,
                hint='constraints = [{ kind = "full-turn", coordinate = ... }]',
            )  # fmt: skip
        joints = [n for n, j in mechanism.joints.items() if j.slides]
        known = {"stroke": joints, "swing": list(mechanism.bodies)}.get(
            word, [*joints, *mechanism.bodies]
        )
        if part not in known:
            raise UnknownName(f"{word.replace('_', ' ')} of", part, known, where=place)
        rocker = Rocker(joint=part) if part in joints else Rocker(body=part)
        found = solve(self.problem, asked.task)
        typical = abs(float(found.summary.get(word, {}).get(part, 1.0))) or 1.0
        key = "time_ratio" if word == "time_ratio" else "reach"
        sense = 0 if bounds is not None else asked.sense
        return RockerGoal(rocker, name, key, sense, bounds, typical, asked.path)

    def _size(self) -> float:
        """Return a length that the mechanism is as large as [m]."""
        for goal in self.goals:
            if isinstance(goal, VisitsGoal):
                return goal.size
            if isinstance(goal, StraightGoal) and goal.asked.stroke is not None:
                return float(goal.asked.stroke)

        return self.problem.mechanism.scale

    def _check_effect(self) -> None:
        """Refuse free parameters that nothing asked for depends on."""
        import casadi as ca

        poses, n = self.space.poses, len(self.space.names)
        d = ca.SX.sym("d", n)
        x, u = ca.SX.sym("x", poses.nx), ca.SX.sym("u")
        parts = [ca.vertcat(*poses.function(x, u, d))]
        parts += [
            goal.at_pose(x, u, d)
            for goal in [*self.goals, *self.limits] if isinstance(goal, ExtremeGoal)
        ]  # fmt: skip
        parts += [self.space.over_free(poses.model.point(r.point), d) for r in self.asked.regions]
        used = np.array(ca.DM(ca.jacobian_sparsity(ca.vertcat(*parts), d), 1)).any(axis=0)
        named = {g.input_start for g, _ in self.asked.goals if isinstance(g, FunctionTargets)}
        named |= {g.output_start for g, _ in self.asked.goals if isinstance(g, FunctionTargets)}
        for name, has in zip(self.space.names, np.atleast_1d(used).tolist(), strict=True):
            has = has or self._moves_outcome(name)
            if not has and name not in named:
                raise InputError(
                    f"the goal does not depend on '{name}'", where=f"free.{name}",
                    hint="leave it out, or ask for something that depends on it",
                )  # fmt: skip

    def _moves_outcome(self, name: str) -> bool:
        """Return whether a number of a motion or an equilibrium depends on a free parameter."""
        if name not in self.asked.free:
            return bool(self._outcomes)
        k = self.space.names.index(name)
        return any(outcome.depends_on(k, self.space.middle) for outcome in self._outcomes)

    # -- the problem -------------------------------------------------------------------------

    def build(self, kind: str) -> Nlp:
        import casadi as ca

        every = [*self.goals, *self.limits]
        rough = any(isinstance(goal, ExtremeGoal) and goal.quantity.forces for goal in every)
        nlp, space = Nlp(rough, exact=bool(self.asked.objectives)), self.space
        d = space.design(nlp)
        sigma = nlp.parameter("sigma", np.ones(space.poses.nb))
        count = self.asked.objectives
        pick = nlp.parameter(PICK, np.ones(count))
        most = nlp.parameter(MOST, np.full(count, NO_LIMIT))
        for k, (goal, share) in enumerate(zip(self.goals, self.shares, strict=True)):
            nlp.terms.append(goal.add(nlp, d, sigma))
            nlp.objective += (pick[k] if k < count else share) * nlp.terms[-1]
            if k < count:
                gap = (nlp.terms[-1] - most[k]) / (ca.fabs(most[k]) + 1)
                nlp.constrain(f"objective {k + 1}", gap, -np.inf, 0.0)
        for limit in self.limits:
            limit.add(nlp, d, sigma)
        space.limits(nlp, d, sigma, kind)
        return nlp

    @cached_property
    def shares(self) -> list[float]:
        """Factors of the goals' terms in the objective of the NLP; a single goal has one."""
        amounts = [
            weight * goal.unit for goal, weight in zip(self.goals, self.weights, strict=True)
            if not goal.exact
        ]  # fmt: skip
        first = amounts[0] if amounts else 1.0
        return [
            1.0 if goal.exact else weight * goal.unit / first
            for goal, weight in zip(self.goals, self.weights, strict=True)
        ]

    # -- the objective in the user's units -----------------------------------------------------

    @property
    def _counted(self) -> list[int]:
        return [k for k, goal in enumerate(self.goals) if not goal.exact]

    @property
    def sense(self) -> int:
        """1 where less of the reported objective is better."""
        terms = self._counted
        return self.goals[terms[0]].sense if len(terms) == 1 else 1

    @property
    def objective_unit(self) -> float:
        """What the objective of the NLP is multiplied with."""
        terms = self._counted
        first = self.goals[terms[0]].unit if terms else 1
        return first * self.weights[terms[0]] if len(terms) > 1 else first

    def objective(self, values: list[float]) -> float:
        """Return what is reported: the goal's value, of several their weighted sum."""
        terms = self._counted
        if not terms:
            return max(values)
        if len(terms) == 1:
            return values[terms[0]]
        return sum(self.weights[k] * self.goals[k].sense * values[k] for k in terms)

    def shown(self, objective: float) -> float:
        """Return an objective of the NLP in the unit of what is reported."""
        terms = self._counted
        if len(terms) == 1:
            return self.goals[terms[0]].value(objective)
        return objective * self.objective_unit if terms else 0.0

    def claimed(self, terms: list[float]) -> float:
        """Return what the terms of the NLP's objective are in the same unit."""
        values = [goal.value(term) for goal, term in zip(self.goals, terms, strict=True)]
        return self.objective(values) if self._counted else 0.0

    @property
    def between_nodes(self) -> bool:
        """Whether a sweep finds more than the nodes of the NLP see."""
        return any(goal.between_nodes for goal in self.goals if not goal.exact)

    # -- starts ------------------------------------------------------------------------------

    def seeds(self, kind: str, nlp: Nlp, generator: Generator, count: int) -> Iterable[Seed]:
        """Yield starts of a class, the most promising first."""
        spread = self.spread
        others = [goal for goal in [*self.goals, *self.limits] if goal is not self.lead]
        for drawn in self.lead.drawn(kind, generator, count):
            unknowns = {**drawn.unknowns, self.lead.key("x"): drawn.x}
            yield self._seed(spread, drawn, unknowns, drawn.given, others)
        if self.all_solutions is not None:
            return
        first = self.of_design(self.space.middle, kind)
        if first is not None:
            yield first

    def _seed(
        self, spread: Spread, drawn: Drawn, unknowns: dict[str, Floats | list[float]], given: Json,
        others: Iterable[Goal],
    ) -> Seed:  # fmt: skip
        """Return a start with the variables of other goals, and of a whole turn."""
        free = len(self.space.box)
        values = {"d": drawn.d[:free], **unknowns}
        given = {"sigma": drawn.sigma, "choice": drawn.d[free:], **given}
        for goal in others:
            unknowns, more = goal.completed(spread, drawn)
            values |= unknowns
            given |= more
        if self.space.turn_needed:
            values["turn"], given["watched"] = self._turned(spread, drawn)
        for goal in self.goals if self.robust else ():
            values |= goal.deviating(values, given)
        return Seed(values, given, drawn.residual)

    def of_design(self, d: Floats, kind: str, at: float | None = None) -> Seed | None:
        """Return a design in the pose of the file's sketch as a start, ahead of all others.

        All other poses follow from that one. None where the design is not of the class, or does
        not assemble near the sketch: that of the file may lie so far beyond its bounds.
        """
        if not self.spread.turning(d[None], kind)[0]:
            return None
        found = sketched(self.problem, self.space, d, self.lead.first(d) if at is None else at)
        if found is None:
            return None
        u, x = found
        branch = np.array(self.space.poses.function(x, u, d)[1]).ravel()
        drawn = Drawn(d, {}, {}, np.array([u]), x[None], np.sign(branch), -np.inf)
        others = [goal for goal in [*self.goals, *self.limits] if goal is not self.lead]
        return self._seed(self.spread, drawn, {}, {}, [self.lead, *others])

    def leaps(self, values: Mapping[str, Floats], given: Mapping[str, Any]) -> bool:
        """Return whether poses of a function differ by whole turns from what the first leads to."""
        if not isinstance(self.lead, Function):
            return False
        u, x = self.lead.programme(values, given)
        d = dimensions(values["d"], given)
        _, unknowns, _ = self.spread.followed(d, x[0], float(u[0]), u)
        gaps = np.abs(unknowns - x)[:, self.space.turns]
        return not gaps.max(initial=0.0) < np.pi

    def _turned(self, spread: Spread, drawn: Drawn) -> tuple[Floats, Floats]:
        """Return the poses of a whole turn of a start, and driver values that are watched."""
        circle, start = self.space.circle, float(drawn.u[0])
        ahead = int(np.argmin(np.abs(np.mod(circle - start + np.pi, TURN) - np.pi)))
        order = np.roll(np.arange(len(circle)), -ahead)
        turned = circle[order] + TURN * np.round((start - circle[ahead]) / TURN)
        turned = np.unwrap(turned)
        _, x, _ = spread.followed(drawn.d, drawn.x[0], start, turned)
        turn = x[np.argsort(order)]
        if not self.space.watched_dyads:
            return turn, np.zeros(0)
        unknowns, more, _ = watched(spread, drawn.d, turned, x)
        return np.concatenate([turn, more]), unknowns

    @property
    def all_solutions(self) -> int | None:
        """How many solutions an exact goal has within the bounds; None where none are terms."""
        lead = self.lead
        if not isinstance(lead, VisitsGoal) or lead.defective is None:
            return None
        return len(lead.defective) + lead.sound

    @property
    def exact_facts(self) -> dict[str, Any]:
        """How many solutions an exact goal has, and how certain that is; {} where none count."""
        lead = self.lead
        if not isinstance(lead, VisitsGoal):
            return {}
        if lead.within is not None:
            return lead.within.facts
        if not lead.freedoms:
            return {}
        return {"verdict": "found", "basis": "infinite family", "freedoms": lead.freedoms}

    def followed_by(self, follow: Follow) -> None:
        """Have the paths of exact goals followed in another place."""
        for goal in self.goals:
            if isinstance(goal, VisitsGoal):
                goal.follow = follow

    @property
    def around(self) -> bool:
        """Whether the first goal's poses may be reached in any order, either way round."""
        lead = self.lead
        loop = self.space.loop is not None
        return loop and isinstance(lead, VisitsGoal) and lead.asked.timing == "any"
