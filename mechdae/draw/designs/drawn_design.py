"""What a synthesis found, as its pictures need it: goals, designs as mechanisms that move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.describe.coordinates import coordinate
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.goals import (
    Asked,
    Extreme,
    FunctionTargets,
    GoalDescription,
    Maximise,
    Rocker,
    StraightLine,
)
from mechdae.describe.tasks.synthesis import Demand, demand, listed_goals
from mechdae.draw import style
from mechdae.draw.diagram.driver import values_of
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.figure import figure_of, new_axes
from mechdae.draw.poses import Seen
from mechdae.draw.primitives import Array
from mechdae.draw.space.spatial_scene import read_spatial
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.results import UNITS, Result

if TYPE_CHECKING:
    from mechdae.results import SynthesisResult

TURN = 2 * np.pi


def runs_of(result: Any) -> list[Mapping[str, Any]]:
    """Return what is known about each start.

    Raises
    ------
    InputError
        None was made.
    """
    runs: list[Mapping[str, Any]] = result.summary["runs"]
    if not runs:
        raise InputError(result.fault or "no start was made", hint="other bounds of what is free")
    return runs


def sense_of(result: SynthesisResult) -> int:
    """Return 1 where less of the objective is better, -1 where more is."""
    counted = _counted(result)
    return -1 if len(counted) == 1 and isinstance(counted[0], Maximise) else 1


def _counted(result: Any) -> list[GoalDescription]:
    """Return the goals in the objective: those that are not met exactly."""
    goals = [goal for goal, _ in listed_goals(result.definition)]
    return [g for g in goals if not isinstance(g, Rocker) and getattr(g, "measure", "") != "exact"]


def chosen(result: Any, design: int | None) -> list[int]:
    """Return the index of a design; without a wish those of all that have no defects.

    Raises
    ------
    InputError
        No design was found, or there is none of that number.
    """
    count = len(result.data["designs"])
    if not count:
        raise InputError(
            result.fault or "no design was found", hint="kinds that show why: census, convergence"
        )
    if design is None:
        sound = [k for k, entry in enumerate(result.data["designs"]) if not entry.get("defects")]
        if not sound:
            raise InputError(
                result.fault or "all designs are rejected",
                hint="design draws each of them, census says why",
            )
        return sound
    if isinstance(design, bool) or not isinstance(design, int) or not -count <= design < count:
        raise InputError(
            f"there is no design {design}", where="design",
            hint=f"a whole number from 0, the best one, to {count - 1}",
        )  # fmt: skip
    return [design % count]


@dataclass(frozen=True)
class DrawnDesign:
    """A design of a synthesis.

    Attributes
    ----------
    index, count
        Which of how many.
    data
        The entry of the result: objective, errors, at, class, hits, problem.
    """

    result: Any
    index: int
    count: int
    data: Mapping[str, Any]

    @property
    def moves(self) -> Any:
        """How it moves: its problem, and the results whole, smooth, at_targets, between."""
        return self.result.motions[self.data["problem"]]

    @property
    def problem(self) -> Problem:
        """The design's own problem."""
        problem: Problem = self.moves.problem
        return problem

    @cached_property
    def demand(self) -> Demand:
        """What the task asks for, with the dimensions of the design."""
        return demand(
            replace(self.problem, mechanism=self.result.mechanism), self.result.definition
        )

    @property
    def goal(self) -> Asked:
        """The goal with targets of its own, else the first."""
        goals = [goal for goal, _ in self.demand.goals]
        return min(goals, key=lambda goal: isinstance(goal, Extreme))

    @property
    def motion(self) -> Result:
        """The design over its whole sweep; it starts at the first target."""
        whole: Result = self.moves.whole
        return whole

    def path(self, what: str) -> Array:
        """Return the path of a point, or of a body's origin, over the whole sweep, smooth."""
        first, *more = [self.places(part, what) for part in self.moves.smooth]
        turned = first if self.demand.full_turn or len(first) == 1 else first[::-1]
        return np.vstack([turned, *more])

    def driven(self, poses: Result) -> Array:
        """Return the driver's values."""
        return np.asarray(poses.drivers[self.demand.driver].position, float)

    def wrapped(self, values: object) -> Array:
        """Return driver values within the sweep: of a full turn, whole turns are taken away."""
        given: Array = np.asarray(values, float)
        if self.demand.full_turn:
            low = float(self.driven(self.motion).min())
            given = low + (given - low) % TURN
        return given

    def places(self, poses: Result, what: str) -> Array:
        """Return where a point is, or the origin of a body."""
        if "." in what:
            return np.asarray(poses.points[what].position, float)
        if self.problem.mechanism.dimension == 3:
            return read_spatial(poses).origin(what)
        return read_scene(poses).origins[what]

    def series(self, poses: Result, text: str) -> Array:
        """Return the values of a coordinate."""
        values = values_of(poses, coordinate(self.problem.mechanism, text))
        assert values is not None
        return values

    @property
    def defects(self) -> list[str]:
        """What is wrong with a solution of an exact goal that is reported all the same."""
        return list(self.data.get("defects", ()))

    def name(self, words: Words) -> str:
        """Return which design it is, with its class, or what is wrong with it."""
        parts = [words("design of", self.index + 1, self.count)]
        if self.defects:
            parts.append(f"{words('rejected')}: {self.defects[0]}")
        if self.data.get("class", "any") != "any":
            parts.append(class_name(self.data["class"], words))
        return "  ·  ".join(parts)

    def facts(self, words: Words, *more: str, before: Sequence[str] = ()) -> list[str]:
        """Return which design it is, `before`, objective, `more`, least transmission angle."""
        objective = words("objective is", words.number(self.data["objective"], 4))
        parts = [self.name(words), *before, objective, *more]
        angle = self.data.get("transmission_angle_min")
        if angle is not None:
            parts.append(words("transmission at least", words.number(np.degrees(angle), 3)))
        return parts


def design_of(result: SynthesisResult, index: int) -> DrawnDesign:
    """Return a design of a result."""
    designs = result.data["designs"]
    return DrawnDesign(result, index, len(designs), designs[index])


def class_name(name: str, words: Words) -> str:
    """Return the word for a class of four-bars; others stay as they are."""
    known = ("crank-rocker", "drag-link", "any")
    return words(name) if name in known else name


def objective_text(result: SynthesisResult, words: Words) -> str:
    """Return what the objective is, for the label of an axis."""
    counted = _counted(result)
    if len(counted) != 1:
        return words("objective")
    goal = counted[0]
    measure = getattr(goal, "measure", "")
    if isinstance(goal, Extreme):
        path = goal.of
        unit = UNITS.get(path.rpartition("/")[2], "")
        shown = f" [{words.status(unit)}]" if unit else ""
        return f"{words('objective')}: {path}{shown}"
    if isinstance(goal, StraightLine):
        return words("objective line")
    if isinstance(goal, FunctionTargets):
        unit = coordinate(result.mechanism, goal.output).unit
        word = "objective largest" if measure == "minimax" else "objective mean"
        power = "" if measure == "minimax" else "²"
        return words(word, f"{words(unit)}{power}")
    if measure == "minimax":
        return words("objective largest", words("m"))
    return words("objective sum", f"{words('m')}²")


SIDE, RIGHT = 52.0, 14.0
"""Room beside the graph in a new figure [pt]."""
UNDER, OVER = 38.0, 4.0
"""Room below and above it."""
SEPARATOR = "  ·  "
MARKS = ("o", "s", "^", "D", "v", "P", "X")


@dataclass(frozen=True)
class DesignPaper:
    """A design as it is looked at, the axes to draw it in, if letters are, in a language."""

    design: DrawnDesign
    shown: Seen
    ax: Axes | None
    labels: bool
    words: Words

    def draw(self, axes: Axes, facts: Sequence[str], pose: int = 0, **options: Any) -> None:
        """Draw the diagram with facts below its title; `options` are those of a `View`."""
        options = {"bounds": self.shown.bounds([pose], True), "labels": self.labels, **options}
        about = SEPARATOR.join(facts)
        view = replace(self.shown.view, loads=False, subtitle=about, **options)
        motion = self.design.motion.in_units(self.design.result.units)
        replace(self.shown, result=motion).draw(axes, view, style.LIGHT, self.words, pose)


def mark_of(index: int) -> str:
    """Return the mark of a design, or of a class of them."""
    return MARKS[index % len(MARKS)]


def above_and_below(
    ax: Axes | None, below: float, share: float, over: float = OVER,
    larger: tuple[float, float] = style.USUAL,
) -> tuple[Axes, Axes]:  # fmt: skip
    """Return axes for the diagram and for the graph.

    Parameters
    ----------
    ax
        Axes whose place is divided; None makes a new figure.
    below
        Height of the graph with its labels in a new figure [pt].
    share
        Share of the place of given axes that the graph takes.
    over
        Room above the graph [pt].
    larger
        How much larger than usual the diagram of a new figure is.
    """
    if ax is not None:
        return ax, divided(ax, share, over)
    upper = new_axes(larger=larger)
    figure, box = figure_of(upper), upper.get_position()
    width, height = figure.get_size_inches() * 72
    tall = height + below
    figure.set_size_inches(width / 72, tall / 72)
    part = height / tall
    upper.set_position((box.x0, 1 - (1 - box.y0) * part, box.width, box.height * part))
    corner, size = (SIDE, UNDER), (width - SIDE - RIGHT, below - UNDER - over)
    lower = figure.add_axes((*np.divide([corner, size], (width, tall)).ravel(),))
    return upper, lower


def divided(ax: Axes, share: float, over: float = OVER) -> Axes:
    """Return new axes in the lower part of the place of others, which become as much lower."""
    figure = figure_of(ax)
    box = ax.get_position()
    part = share * box.height
    ax.set_position((box.x0, box.y0 + part, box.width, box.height - part))
    gap = min((UNDER + over) / 72 / float(figure.get_size_inches()[1]), 0.5 * part)
    return figure.add_axes((box.x0, box.y0, box.width, part - gap))
