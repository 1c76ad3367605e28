"""`md.variants`: each variant of a mechanism, and whether it assembles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from mechdae.describe import GROUND, Driver, Joint, Problem, Sweep, Table
from mechdae.describe.file.load import Source, given
from mechdae.describe.layers import LinksCrossing
from mechdae.describe.tasks.kinds import Driven, Modes
from mechdae.describe.values import Number
from mechdae.errors import AssemblyError, InputError, MechdaeError, UnknownName
from mechdae.numerics.polygons import segment_gaps
from mechdae.parts.types.chains.variants import constructions, pair_kinds
from mechdae.parts.types.chains.variants.orders import Orders
from mechdae.parts.types.chains.variants.scheme import Pose, Variant, moves, planar
from mechdae.records import dataclass, public
from mechdae.results import Result
from mechdae.tasks.pictures import with_sketch
from mechdae.tasks.solve import solve
from mechdae.types import Floats

ALONG = ("slide", "s")
"""Coordinates of joints that are places along something."""
STILL = 0.1
"""Share of its mean change between two poses below which a coordinate is near an extreme."""
WAYS = ("order", "inversion", "pairs", "construction")


@public
def variants(
    problem: Source, by: str = "order", *, limit: int | None = None,
    set: Mapping[str, Number] | None = None,
) -> Iterator[Variant]:  # fmt: skip
    """Yield the variants of a mechanism, each when it is asked for.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    by
        "order": cyclic orders of the vectors of a loop; "inversion": fixed links; "pairs":
        revolute or prismatic at each joint; "construction": six for each pin.
    limit
        How many at most.
    set
        Numbers of the problem to change, as of `md.solve`.

    Yields
    ------
    Variant
        With ``fault`` where it does not assemble over its first task.

    Raises
    ------
    InputError
        What cannot be varied so.
    SolveError
        The mechanism itself does not assemble.

    Examples
    --------
    >>> bar = md.four_bar(0.1, 0.04, 0.12, 0.08)
    >>> [variant.name for variant in md.variants(bar, "inversion")]
    ['fixed-ground', 'fixed-crank', 'fixed-coupler', 'fixed-rocker']
    """
    return islice(_Varied(problem, by, set).found(), _checked(limit))


@public
def count_variants(
    problem: Source, by: str = "order", *, set: Mapping[str, Number] | None = None
) -> tuple[int, int]:
    """Return how many variants there are, and how many up to the loop's reversal.

    More exactly up to symmetries of the structure that keep the fixed link, which for a single
    loop is its reversal. Orders are counted without direction, fixed links without regard to it.

    Parameters
    ----------
    problem, by, set
        As of `variants`.

    Returns
    -------
    tuple of two int
        All, and all that differ.

    Raises
    ------
    InputError
        What cannot be varied so.

    Examples
    --------
    >>> md.count_variants(md.four_bar(0.1, 0.04, 0.12, 0.08), "pairs")
    (16, 10)
    """
    return _Varied(problem, by, set).count


def _checked(limit: int | None) -> int | None:
    if limit is not None and (isinstance(limit, bool) or not isinstance(limit, int) or limit < 1):
        raise InputError("a whole number above 0 is needed", where="limit")
    return limit


class _Varied:
    """A mechanism with what its variants need of its motion."""

    def __init__(self, problem: Source, by: str, set: Mapping[str, Number] | None) -> None:
        if by not in WAYS:
            raise UnknownName("way to vary", by, WAYS, where="by")
        whole, _ = given(problem, set=set)
        self.by, self.problem = by, planar(whole, loops=by == "order")

    @property
    def count(self) -> tuple[int, int]:
        mechanism = self.problem.mechanism
        if self.by == "order":
            found = Orders(self.problem, Pose({}, {}, {})).count
        elif self.by == "inversion":
            found = len(pair_kinds.fixed_links(mechanism))
        else:
            way = pair_kinds if self.by == "pairs" else constructions
            counted: tuple[int, int] = way.count(mechanism)
            return counted
        return found, found

    def found(self) -> Iterator[Variant]:
        _ = self.count  # what cannot be varied is said before anything is solved
        problem = driven(self.problem)
        motion = MotionOfVaried(problem)
        if self.by == "construction":
            yield from constructions.Constructions(problem, motion.crossings())
            return
        made: Iterable[Variant]
        if self.by == "order":
            made = Orders(problem, motion.pose)
        else:
            way = pair_kinds.inversions if self.by == "inversion" else pair_kinds.pair_kinds
            made = way(problem, motion.pose)
        for variant in made:
            fault = variant.fault or fault_of(variant)
            closed = variant.about.get("closes") if fault else None
            if isinstance(closed, dict):
                given = closed["given"]
                fault = f"its vectors close {closed['loops']} loops, {given} are given: {fault}"
            yield replace(variant, fault=fault)


def driven(problem: Problem) -> Problem:
    """Return the problem with a task that drives it where none does: by the sketch, throughout.

    Driven is what the sketch gives, those on the ground first; several drivers keep their values.
    """
    if first_sweep(problem) is not None:
        return problem
    bare = with_sketch(replace(problem, tasks=Table()))
    task: Any = bare.tasks["sketch"]
    if len(task.all_drivers) == 1:
        only = Driver(task.all_drivers[0].coordinate, range="assembled")
        task = Sweep(driver=only)
    return replace(problem, tasks=Table({**problem.tasks, "motion": task}))


def fault_of(variant: Variant) -> str:
    """Return why a variant does not assemble over its first sweep, "" where it does."""
    assert variant.problem is not None
    name = first_sweep(variant.problem)
    if name is None:
        left = next((reason for reason in variant.left_out if reason.startswith("tasks.")), "")
        return f"no task is left: {left}" if left else ""
    try:
        fault: str = solve(positions(variant.problem, name)).fault or ""
    except MechdaeError as error:
        return str(error).splitlines()[0]
    return fault


def first_sweep(problem: Problem) -> str | None:
    """Return the first task with driven poses, those through an interval before the others."""
    driven = {
        name: task
        for name, task in problem.tasks.items()
        if isinstance(task, Driven) and not isinstance(task, Modes)
    }
    moving = [name for name, task in driven.items() if isinstance(task, Sweep) and moves(task)]
    return next(iter([*moving, *driven]), None)


def positions(problem: Problem, name: str) -> Problem:
    """Return the problem with one task: the positions of that sweep."""
    task: Any = problem.tasks[name]
    bare = Sweep(driver=task.driver, drivers=task.drivers, poses=task.poses, derivatives=0)
    return replace(problem, tasks=Table({name: bare}), expected=(), pattern=None)


@dataclass
class MotionOfVaried:
    """The poses of the mechanism that is varied, over its first sweep."""

    problem: Problem

    def __post_init__(self) -> None:
        name = first_sweep(self.problem)
        if name is None:
            raise InputError(
                "variants need a task with a driver", where="tasks", hint="a sweep, or reactions"
            )
        self.result: Result = solve(positions(self.problem, name))
        self.data: dict[str, Any] = self.result.to_dict()
        status = self.data["status"]
        self.good: list[int] = [k for k, word in enumerate(status) if word in ("ok", "limit")]
        if not self.good:
            from mechdae.tasks.show import structure

            rank = structure(self.problem)["mobility"]["rank"]
            if rank and rank["mobility"] == 0:
                raise InputError(
                    "it has no mobility: nothing of it moves, whichever link is fixed",
                    where="joints",
                    hint="mechdae show counts it",
                )
            raise AssemblyError(self.result.fault or f"no pose of task '{name}' assembles")

    @property
    def pose(self) -> Pose:
        """The first pose that assembles, or the middle one where the first is a limit."""
        first = self.good[0]
        k = first if self.data["status"][first] == "ok" else self.good[len(self.good) // 2]
        bodies, joints = self.data.get("bodies", {}), self.data.get("joints", {})
        places = {name: series for name, series in joints.items() if {*series} & {*ALONG}}
        return Pose(
            {name: series["angle"][k] for name, series in bodies.items()},
            {point: (float(x[0]), float(x[1])) for point, x in self._all_points([k]).items()},
            {name: next(series[w] for w in ALONG if w in series)[k]
             for name, series in places.items()},
            tuple(name for name, series in joints.items() if self._moves(series, k)),
        )  # fmt: skip

    def _moves(self, series: dict[str, list[float]], k: int) -> bool:
        """Return whether a coordinate of a joint changes near a pose, with no extreme there."""
        near = [j for j in (k - 1, k, k + 1) if j in self.good]
        for word in ("angle", *ALONG):
            values = np.asarray(series.get(word) or [0.0] * len(self.data["status"]))
            step = float(np.ptp(values[self.good])) / max(len(self.good) - 1, 1)
            if step > 0 and float(np.ptp(values[near])) > STILL * step * (len(near) - 1):
                return True
        return False

    def _all_points(self, poses: list[int]) -> dict[str, Floats]:
        """Return places (2, poses) of all points, those of the ground too."""
        mechanism, n = self.problem.mechanism, len(poses)
        values = mechanism.values()
        found = {
            name: np.asarray([series["position"][k] for k in poses], float).T
            for name, series in self.data.get("points", {}).items()
        }
        for point in mechanism.ground.points:
            place = [values[f"{GROUND}.{point}.{axis}"] for axis in "xy"]
            found[f"{GROUND}.{point}"] = np.repeat(np.asarray(place)[:, None], n, axis=1)
        return {name: values if n > 1 else values[:, 0] for name, values in found.items()}

    def crossings(self) -> LinksCrossing:
        """Return which links cross in projection while the mechanism moves, and pass over pins."""
        mechanism = self.problem.mechanism
        width = constructions.thickness(mechanism)
        points = self._all_points(self.good if len(self.good) > 1 else self.good * 2)
        pins = constructions.pins_of(mechanism)
        bars = {name: _bars(name, mechanism.joints, points) for name in mechanism.bodies}
        links = tuple(mechanism.bodies)
        joined = {frozenset((j.first_body, j.second_body)) for j in mechanism.joints.values()}
        pairs = {
            frozenset((one, two))
            for k, one in enumerate(links)
            for two in links[k + 1 :]
            if frozenset((one, two)) not in joined and _near(bars[one], bars[two], width)
        }
        over = {
            (link, pin)
            for pin, pair in pins.items()
            for link in links
            if link not in pair
            and _near(bars[link], [(points[mechanism.joints[pin].first],) * 2], width)
        }
        return LinksCrossing(links, frozenset(pairs), frozenset(over))


Bars = list[tuple[Any, Any]]


def _bars(body: str, joints: Table[Joint], points: dict[str, Floats]) -> Bars:
    """Return the bars of a link between each two of its joints, ends (2, poses)."""
    ends = {
        end: points[end]
        for joint in joints.values()
        for end in (joint.first, joint.second)
        if end.partition(".")[0] == body
    }
    places = list(ends.values())
    if len(places) == 1:
        return [(places[0], places[0])]
    return [(one, two) for k, one in enumerate(places) for two in places[k + 1 :]]


def _near(one: Bars, two: Bars, width: float) -> bool:
    """Return whether any two bars come nearer than a width in any pose."""
    return any(
        bool((segment_gaps(*(x.T for x in (*a, *b))) < width).any()) for a in one for b in two
    )
