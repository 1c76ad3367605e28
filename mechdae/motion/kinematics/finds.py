"""Where outputs cross a value or are extreme along a path, between the poses of a task."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.units import shown
from mechdae.motion.continuation.evaluate import Poses, in_time
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.numerics.roots import root_between
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Json

if TYPE_CHECKING:
    from mechdae.describe.tasks.finds import Find

SAMPLES = 721
"""Places at which an output is looked at, beside the poses of the task."""
GRAIN = 4 * float(np.finfo(float).eps)
ROUNDING = 16 * float(np.finfo(float).eps)
"""Share of its largest value, times the condition, by which rounding may move an output."""
LOOKED_AT = 3
"""Extremes between samples that are refined, the most extreme ones."""
STENCIL = ((1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
"""Central differences of sixth order: distances in steps, and weights."""
SHARE = 1 / 4
"""Step of these differences by the distance of samples."""
DOUBLINGS = 40
SHOWN = 6
"""Poses named in one sentence."""

Values = Callable[[Floats], tuple[Floats, Floats, Floats]]
"""From places (k,) to an output, to the condition of the poses, and to where they lie."""


@dataclass(frozen=True)
class SoughtOutput:
    """Looks for places of one output along a path.

    ``value`` gives it at places; ``s`` (n,) are samples, ``f`` the output there, ``shift`` whole
    turns by which poses lie elsewhere on the path, ``size`` the largest value, ``condition`` that
    of the samples.
    """

    value: Values
    s: Floats
    f: Floats
    shift: Floats
    condition: float

    @classmethod
    def along(cls, s: Floats, value: Values) -> SoughtOutput:
        """Return an output that is looked at in samples (n,)."""
        f, condition, where = value(s)
        worst = float(np.nanmax(condition[np.isfinite(f)], initial=1.0))
        return cls(value, s, f, where - s, worst)

    @property
    def step(self) -> float:
        """The usual distance of samples."""
        return float(self.s[-1] - self.s[0]) / SAMPLES

    @property
    def noise(self) -> float:
        """By how much rounding may move the output."""
        return ROUNDING * self.condition * float(np.nanmax(np.abs(self.f), initial=0.0))

    def at(self, place: float) -> float:
        """Return the output at a place."""
        return float(self.value(np.array([place]))[0][0])

    def joined(self) -> Booleans:
        """Return which neighbouring samples (n - 1,) belong to one motion and have values."""
        known = np.isfinite(self.f)
        joined: Booleans = known[1:] & known[:-1] & (np.abs(np.diff(self.shift)) < self.step)
        return joined

    def crossings(self, level: float) -> list[tuple[float, float, int]]:
        """Return place, bound and sense of each passage of a level."""
        s, f, joined = self.s.tolist(), (self.f - level).tolist(), self.joined()
        passages = []
        for k in np.flatnonzero(joined & ((self.f[1:] >= level) != (self.f[:-1] >= level))):
            ends, place = (f[k], f[k + 1]), s[k]
            if f[k] != 0:
                place = root_between(lambda x: self.at(x) - level, s[k], s[k + 1], ends, self.grain)
            if abs(self.at(place) - level) <= min(map(abs, ends)) + self.noise:  # else a pole
                passages.append(
                    (place, self._between(place, level), 1 if ends[1] > ends[0] else -1)
                )
        return passages

    def grain(self, place: float) -> float:
        """Return the distance from a place that is rounding."""
        return GRAIN * max(abs(place), self.step)

    def _between(self, place: float, level: float) -> float:
        """Return half the width of an interval at whose ends the output is on both sides."""
        width = self.grain(place)
        for _ in range(DOUBLINGS):
            low, high = (self.at(place + way * width) - level for way in (-1, 1))
            if low * high < 0 and min(abs(low), abs(high)) > self.noise:
                return width
            width *= 2
        return math.nan

    def extreme(self, sense: int) -> tuple[float, float, float] | None:
        """Return place, bound and value of the largest (1) or smallest (-1) value."""
        f, joined = sense * self.f, self.joined()
        if not np.isfinite(f).any():
            return None
        inner = 1 + np.flatnonzero(
            joined[1:] & joined[:-1] & (f[1:-1] >= f[:-2]) & (f[1:-1] >= f[2:])
        )
        best = int(np.nanargmax(f))
        tops = [(float(f[best]), float(self.s[best]), 0.0)]
        for k in inner[np.argsort(-f[inner], kind="stable")][:LOOKED_AT]:
            place = self._flat(int(k))
            tops.append((sense * self.at(place), place, self._around(place, sense)))
        value, place, bound = max(tops, key=lambda top: top[0])
        return place, bound, sense * value

    def _flat(self, k: int) -> float:
        """Return where the output is stationary around a sample that is larger than others."""
        low, high = float(self.s[k - 1]), float(self.s[k + 1])
        h = SHARE * float(min(self.s[k] - low, high - self.s[k]))

        def slope(place: float) -> float:
            aside = np.array([n * h * way for n, _ in STENCIL for way in (1, -1)])
            values = self.value(place + aside)[0].reshape(-1, 2)
            return float(
                np.array([weight for _, weight in STENCIL]) @ (values[:, 0] - values[:, 1])
            )

        ends = slope(low), slope(high)
        if not ends[0] * ends[1] < 0:
            return float(self.s[k])
        return root_between(slope, low, high, ends, self.grain)

    def _around(self, place: float, sense: int) -> float:
        """Return half the width of an interval at whose ends the output is less extreme."""
        width, top = self.grain(place), sense * self.at(place)
        for _ in range(DOUBLINGS):
            ends = [sense * self.at(place + way * width) for way in (-1, 1)]
            if max(ends) < top - 2 * self.noise:
                return width
            width *= 2
        return math.nan


def samples(run: Run) -> Floats:
    """Return places of a run's path at which outputs are looked at, its poses and ends among."""
    places = np.asarray(run.places)
    low, high = float(places.min()), float(places.max())
    inside = [end.s for end in run.path.ends if low < end.s < high]
    return np.unique([*places, *np.linspace(low, high, SAMPLES), *inside])


def located(
    finds: Sequence[Find], setting: Setting, run: Run, values: Callable[[str], Values]
) -> tuple[list[Json], list[str]]:
    """Return events at the places that a task looks for, and notes on what there is none of.

    `values` gives what is looked at by the text of a search.
    """
    parameters = setting.scene.model.mechanism.parameter_values
    s = samples(run)
    events, notes = list[Json](), list[str]()
    for i, find in enumerate(finds):
        value = values(find.output)
        sought_output = SoughtOutput.along(s, value)
        f = sought_output.f
        facts = {"name": find.name or find.output, "of": find.output, "in_range": True}
        if find.crosses is not None:
            level, count = evaluate(find.crosses, parameters), len(events)
            for place, bound, sense in sought_output.crossings(level):
                direction = "up" if sense > 0 else "down"
                if find.direction in ("both", direction):
                    event = {
                        "kind": "crossing",
                        **at_place(setting, run, place),
                        "bound": bound,
                        **facts,
                    }
                    events.append(event | {"value": level, "direction": direction})
            if len(events) == count:
                notes.append(f"find[{i}]: {_missed(find, level, f)}")
        else:
            extreme = sought_output.extreme(1 if find.extreme == "max" else -1)
            if extreme is None:
                notes.append(f"find[{i}]: {find.output} has no value over the range")
                continue
            place, bound, top = extreme
            event = {"kind": "extreme", **at_place(setting, run, place), "bound": bound, **facts}
            events.append(event | {"value": top, "extreme": find.extreme})
    return events, notes


def _missed(find: Find, level: float, f: Floats) -> str:
    """Return what is said of a value that is not crossed."""
    if not np.isfinite(f).any():
        return f"{find.output} has no value over the range"
    way = "" if find.direction == "both" else f" {find.direction}wards"
    least, most = np.nanmin(f), np.nanmax(f)
    return f"{find.output} does not cross {level:.6g}{way}: it goes from {least:.6g} to {most:.6g}"


def at_place(setting: Setting, run: Run, place: float) -> Json:
    """Return the driver's value at a place, of several the list, and the time along a law."""
    u = run.path.drivers(np.array([place]))[0].tolist()
    timed = {"time": place} if setting.plan.timing else {}
    return {"at": u if len(u) > 1 else u[0], **timed}


def times(setting: Setting, run: Run, s: Floats) -> Floats | None:
    """Return the times (n,) of places of a run's path, None where the task has none."""
    plan = setting.plan
    if plan.time_of() is None:
        return None
    return s if plan.timing else (s - run.values[0, plan.lead]) / plan.speed[0, plan.lead]


def sought(task: Sweep, outputs: Collection[str]) -> list[Find]:
    """Return what a task looks for of some outputs."""
    return [find for find in task.find or () if find.output in outputs]


def of_sweep(setting: Setting, run: Run, task: Sweep) -> tuple[list[Json], list[str]]:
    """Return what is found of outputs without forces."""
    expressions = setting.expressions
    assert expressions is not None
    columns = setting.outputs.columns(expressions.coordinates)

    def values(text: str) -> Values:
        def value(s: Floats) -> tuple[Floats, Floats, Floats]:
            poses = at_places(setting, run, s)
            there = [array[:, columns] for array in poses.y[: expressions.derivatives + 1]]
            certified = poses.alive.all(axis=1) & ~poses.uncertain
            series = expressions.evaluate(there, times(setting, run, s), certified)[0][text]
            return series.value, poses.condition, poses.places

        return value

    return located(sought(task, expressions.rates), setting, run, values)


def at_places(setting: Setting, run: Run, s: Floats) -> Poses:
    """Return the poses at places of a run's path, with rates in time."""
    poses, plan = run.evaluator.at(run.path, s), setting.plan
    if plan.by_value:
        poses.y = in_time(
            poses.y, *[rate[0, plan.lead] for rate in (plan.speed, plan.acceleration)]
        )
    return poses


def named_poses(setting: Setting, run: Run, rows: Integers) -> str:
    """Return the first of some poses by their driver, beside several of them by number."""
    plan = setting.plan
    if plan.by_value:
        c = plan.coordinates[plan.lead]
        places = [shown(c.unit, run.values[k, plan.lead]) for k in rows[:SHOWN]]
        text = f"{c.text} = {', '.join(places)}"
    else:
        text = f"number {', '.join(str(k) for k in rows[:SHOWN])}"
    return text + (f" and {len(rows) - SHOWN} more" if len(rows) > SHOWN else "")
