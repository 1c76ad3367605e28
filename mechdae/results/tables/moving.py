"""Which columns of a motion are shown first: the output with its rates, then what moves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechdae.results import TURNS, Result
from mechdae.results.tables.text import Column, cells, noises, size_of
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.results.series import Series


RELATIVE = (*TURNS, "slide", "x", "y", "length")
"""Coordinates of joints in space, angles first."""
SLIDE = ("slide", "slide_velocity", "slide_acceleration")
ANGLE = ("angle", "angular_velocity", "angular_acceleration")
SIZED: dict[str, tuple[str, ...]] = {
    "bodies": ANGLE[1:],
    "joints": SLIDE[1:],
    "points": ("velocity", "acceleration"),
}
"""Rates whose largest sizes tell what of them is rounding."""


class Quantities:
    """The series of a result as columns, rounding noise as 0, what stands still left out.

    The noise of positions is the larger of their bound and of the rounding of the mechanism's
    largest coordinate, that of rates the rounding of the largest rate of their kind.
    """

    def __init__(self, result: Result) -> None:
        self.result = result
        largest = {word: 0.0 for words in SIZED.values() for word in words}
        parts = [
            (words, each)
            for kind, words in SIZED.items()
            for each in getattr(result, kind).values()
        ]
        arrays = [(word, each[word]) for words, each in parts for word in words if word in each]
        for word, values in arrays:
            largest[word] = max(largest[word], size_of(values))
        noise = noises(result)
        self.length: float = noise["length"]
        self.angle: float = noise["angle"]
        self._rates = {word: 1e-14 * size for word, size in largest.items()}
        names = (coordinate.rpartition(".") for coordinate in result.drivers)
        self._driven = {part for part, _, word in names if word in (*RELATIVE, "s")}
        """Bodies and joints with a coordinate that is driven."""

    def columns(self) -> list[Column]:
        """Return all columns that move: the output, points, then other joints and bodies.

        The output's rates come at once, after all positions where the task lists what it shows.
        """
        driven = set(self.result.drivers)
        found: list[Column] = []
        rates = [
            self._named(name, "rate")
            for name, series in self.result.outputs.items()
            if "rate" in series and np.isfinite(series["rate"]).any()
        ]
        first = None if self.result.outputs else self._output()
        if first is not None:
            columns = list(self._part(*first, rates=2))
            found, rates = columns[:1], columns[1:]
        listed = getattr(self.result.definition, "outputs", None) is not None
        found += [] if listed else rates
        done = {first}
        if len(driven) > 1 and not listed:  # what cylinders and legs do
            slides: list[Column] = []
            for name, series in self.result.joints.items():
                slide = ("joints", name)
                if "slide" in series and name not in self._driven and slide not in done:
                    slides += self._part(*slide, rates=0)
                    done.add(slide)
            found = slides + found
        # a mechanism is made for its last links, not for the driven ones
        points = self.distinct_points()[::-1]
        points.sort(key=lambda name: f"{name.split('.')[0]}.angle" in driven)
        for name in points:
            if not {f"{name}.{axis}" for axis in self.result.mechanism.axes} <= driven:
                found += self._point(name)
        for kind in ("joints", "bodies"):
            for name in getattr(self.result, kind):
                if (kind, name) not in done and name not in self._driven:
                    found += self._part(kind, name, rates=1 if kind == "bodies" else 0)
        found += rates if listed else []
        known = {title for title, _ in self._listed()} if listed else set()
        return [column for column in found if column[0] not in known]

    def needed(self) -> list[Column]:
        """Return time, drivers, named outputs and what the task lists by name, in its order."""
        result = self.result
        driven = [
            self.column(name, result.unit("drivers", name, "position"), series.position, share=1.0)
            for name, series in result.drivers.items()
        ]
        known = [title for title, _ in driven]
        listed = self.outputs() + [c for c in self._listed() if c[0] not in known]
        if getattr(result.definition, "measures", None):
            from mechdae.results.tables.measures import ratio_columns

            listed += ratio_columns(result)
        return (
            driven + listed
            if result.time is None
            else [("t [s]", cells(result.time)), *listed, *driven]
        )

    def _listed(self) -> list[Column]:
        found: list[Column] = []
        for name in getattr(self.result.definition, "outputs", None) or ():
            if name in self.result.points:
                found += self._point(name)
            for kind in ("bodies", "joints"):
                if name in getattr(self.result, kind):
                    found += self._part(kind, name, rates=0)
            joint, _, word = name.rpartition(".")
            series = self.result.joints.get(joint, {})
            if word in series:
                unit = self.result.unit("joints", joint, word)
                noise = self.noise("joints", joint, word)
                found.append(self.column(name, unit, series[word], noise))
        return found

    def outputs(self) -> list[Column]:
        """Return the named outputs."""
        return [self._named(name, "value") for name in self.result.outputs]

    def _named(self, name: str, word: str) -> Column:
        unit = self.result.unit("outputs", name, word)
        values = self.result.outputs[name][word]
        if unit:
            unit, values = self._in(unit, values)
        plain = name if word == "value" else f"d {name}/dt"
        return f"{name} [{unit}]" if unit else plain, cells(values, size_of(values))

    def distinct_points(self) -> list[str]:
        """Return the points that move, each place once."""
        places = {name: series.position for name, series in self.result.points.items()}
        distinct: list[str] = []
        for name, place in places.items():
            series = self.result.points[name]
            if _changes(place, series, "velocity", self.length) and not any(
                np.array_equal(place, places[other], equal_nan=True) for other in distinct
            ):
                distinct.append(name)
        return distinct

    def noise(self, kind: str, part: str, name: str) -> float:
        """Return up to which size a number of a part's series is 0."""
        if name in self._rates:
            return self._rates[name]
        if kind == "drivers":
            return 0.0
        if name == "angle":
            return self.angle
        return self.length if name in ("position", "slide") else 0.0

    # -- one part ----------------------------------------------------------------------------

    def _output(self) -> tuple[str, str] | None:
        """Return the last slide or link on the ground that moves and is not driven, if any."""
        joints = self.result.mechanism.joints
        grounded = {body for joint in joints.values() if "ground" in joint.bodies
                    for body in joint.bodies}  # fmt: skip
        found: tuple[str, str] | None = None
        if self.result.mechanism.dimension == 3:
            return self._last_in_space()
        for name, series in self.result.bodies.items():
            free = name in grounded and name not in self._driven
            if free and _changes(series["angle"], series, "angular_velocity", self.angle):
                found = ("bodies", name)
        for name, series in self.result.joints.items():
            slides = "ground" in joints[name].bodies and "slide" in series
            free = slides and name not in self._driven
            if free and _changes(series["slide"], series, "slide_velocity", self.length):
                found = ("joints", name)
        return found

    def _last_in_space(self) -> tuple[str, str] | None:
        """Return the last joint on the ground that moves and is not driven, if any."""
        joints, found = self.result.mechanism.joints, None
        for name, series in self.result.joints.items():
            free = "ground" in joints[name].bodies and name not in self._driven
            if free and list(self._relative(name, series, 0)):
                found = ("joints", name)
        return found

    def _relative(self, name: str, series: Series, rates: int) -> Iterator[Column]:
        """Yield the coordinates of a joint in space that change, with some of their rates."""
        for word in RELATIVE:
            turns = word in TURNS
            noise = self.angle if turns else self.length
            values = series.get(word)
            if values is None or not _changes(values, series, f"{word}_velocity", noise):
                continue
            yield self.column(f"{name}.{word}", "rad" if turns else "m", values, noise)
            for rate in ("velocity", "acceleration")[:rates]:
                if f"{word}_{rate}" in series:
                    unit = self.result.unit("joints", name, f"{word}_{rate}")
                    rates_of = [f"{w}_{rate}" for w in RELATIVE if (w in TURNS) == turns]
                    alike = [s[w] for s in self.result.joints.values() for w in rates_of if w in s]
                    largest = max(map(size_of, alike))
                    values = series[f"{word}_{rate}"]
                    yield self.column(f"{name}.{word}", unit, values, 1e-14 * largest)

    def _part(self, kind: str, name: str, rates: int) -> Iterator[Column]:
        """Yield a body's angle or a joint's slide or place, with some of its rates."""
        series = getattr(self.result, kind)[name]
        if kind == "joints" and self.result.mechanism.dimension == 3:
            yield from self._relative(name, series, rates)
            return
        joint = self.result.mechanism.joints[name] if kind == "joints" else None
        if joint is not None and not (joint.straight or joint.on_curve):
            return
        if joint is not None and joint.on_curve:
            if _changes(series["s"], series, "s_velocity", 0.0):
                yield f"{name}.s", cells(series["s"])
            return
        turns = kind == "bodies"
        words, noise = (ANGLE, self.angle) if turns else (SLIDE, self.length)
        values = series.get(words[0])
        if values is None or not _changes(values, series, words[1], noise):
            return
        title, unit = (name, "rad") if turns else (f"{name}.slide", "m")
        yield self.column(title, unit, values, noise)
        for word in words[1 : rates + 1]:
            if word in series:
                unit = self.result.unit(kind, name, word)
                yield self.column(name, unit, series[word], self._rates[word])

    def _point(self, name: str) -> Iterator[Column]:
        """Yield the coordinates of a point that change."""
        places = self.result.points[name].position
        for i, axis in enumerate(self.result.mechanism.axes):
            if len(places) < 2 or _span(places[:, i]) > self.length:
                yield self.column(f"{name}.{axis}", "m", places[:, i], self.length)

    def _in(self, unit: str, values: Floats) -> tuple[str, Floats]:
        """Return the unit in which values are shown, and the values in it."""
        shown = self.result.units.read(unit)
        return shown.name, values if shown.factor == 1 else values * shown.factor

    def column(
        self, name: str, unit: str, values: Floats, noise: float = 0.0, share: float = 0.0
    ) -> Column:
        """Return a column in the unit it is shown in; what is noise, or rounding, is 0.

        Rounding is what is nothing beside a `share` of the largest number.
        """
        shown = self.result.units.read(unit)
        numbers = values if shown.factor == 1 else values * shown.factor
        size = share * float(np.max(np.abs(numbers), initial=0.0)) if share else 0.0
        return f"{name} [{shown.name}]", cells(numbers, size, noise=noise * shown.factor)


def _changes(values: Floats, series: Series, rate: str, noise: float) -> bool:
    """Return whether values change by more than noise, a single one of them by its rate."""
    values = np.asarray(values, float)
    if len(values) > 1:
        return max(_span(column) for column in values.reshape(len(values), -1).T) > noise
    return rate not in series or size_of(series[rate]) > 0


def _span(values: Floats) -> float:
    """Return the range of the values that are there."""
    there = values[np.isfinite(values)]
    return float(np.ptp(there)) if there.size else 0.0
