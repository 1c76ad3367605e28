"""What each output of a study asks of lanes: series of poses, or a number of the whole way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import UnknownName
from mechdae.motion.measures import transmission
from mechdae.motion.measures.along_sweep_extremes import quantities
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass

SPANS = {"swing": "bodies/{}/angle", "stroke": "joints/{}/slide"}
"""Entries of the summary that need no measure to be asked for, and of what they are the span."""
MEASURES = {
    "transmission": "transmission", "extremes": "extremes", "envelope": "envelope",
    "time_ratio": "time-ratio", "return_angle": "time-ratio", "curve": "curve",
}  # fmt: skip
"""Entries of the summary that are computed for many sets at once, and the measures they are of."""
FACTS: dict[str, tuple[str, ...]] = {
    "transmission": ("min", "at", "max", "max_at"),
    "curve": ("length", "area", "closed"),
}
"""Numbers of an entry."""
ENDS = ("min", "max")


@dataclass(frozen=True)
class SeriesReading:
    """A series of poses: `columns` of the derivative of an `order`."""

    order: int
    columns: tuple[int, ...]
    made: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class WayReading:
    """A number of the whole way of a lane.

    ``kind`` is the entry of the summary, ``columns`` what it is read off, ``what`` which number;
    ``angle`` tells that it is measured in radians, else in lengths of the mechanism.
    """

    kind: str
    columns: tuple[int, ...]
    what: tuple[str, ...] = ()
    angle: bool = False


@dataclass(frozen=True)
class ForceReading:
    """A series of forces of a joint or a driver, ``width`` numbers at a pose."""

    part: str
    word: str
    width: int = 1


Reading = SeriesReading | WayReading | ForceReading


def is_of_the_way(path: str, task: Sweep) -> bool:
    """Return whether a path may be a number of the whole way that lanes have."""
    head, _, rest = path.partition("/")
    word, _, rest = rest.partition("/")
    if head != "summary" or not rest:
        return False
    return word in SPANS or MEASURES.get(word) in (task.measures or ())


def reading_of(path: str, outputs: Outputs, task: Sweep) -> Reading | None:
    """Return what a path asks for, None where it is not computed for many sets at once."""
    head, _, rest = path.partition("/")
    if head != "summary":
        return _measured_series(path, outputs) or SeriesReading(*outputs.column_of(path))
    word, _, rest = rest.partition("/")
    if word in SPANS:
        try:
            columns = outputs.column_of(SPANS[word].format(rest))[1]
        except UnknownName:
            return None
        return WayReading("span", columns, angle=word == "swing")
    if MEASURES.get(word) not in (task.measures or ()):
        return None
    return _OF[word](word, rest, outputs)


def _measured_series(path: str, outputs: Outputs) -> SeriesReading | None:
    head, _, rest = path.partition("/")
    joint, _, word = rest.rpartition("/")
    if head != "joints" or word != "transmission_angle":
        return None
    for entry in outputs.entries:
        if entry.part == transmission.PREFIX + joint:
            return SeriesReading(0, entry.columns, _folded)
    return None


def _folded(lines: Any) -> Any:
    """Return transmission angles (k, n) of cross and dot products (2, k, n)."""
    return np.arctan2(np.abs(lines[0]), np.abs(lines[1]))


def _transmission(word: str, rest: str, outputs: Outputs) -> WayReading | None:
    joint, _, what = rest.rpartition("/")
    for entry in outputs.entries:
        if entry.part == transmission.PREFIX + joint and what in FACTS[word]:
            return WayReading(word, entry.columns, (what,), True)
    return None


def _extremes(word: str, rest: str, outputs: Outputs) -> WayReading | None:
    name, *what = rest.split("/")
    if len(what) != 2 or what[0] not in ENDS or what[1] not in ("value", "at"):
        return None
    for quantity in quantities(outputs):
        if quantity.name == name:
            return WayReading(word, (quantity.column,), tuple(what), quantity.is_angle)
    return None


def _strokes(word: str, rest: str, outputs: Outputs) -> WayReading | None:
    found = [q for q in quantities(outputs) if q.part == rest and q.is_output]
    return WayReading(word, (found[0].column,), (), found[0].is_angle) if len(found) == 1 else None


def _envelope(word: str, rest: str, outputs: Outputs) -> WayReading | None:
    points = [e for e in outputs.entries if e.kind == "points" and len(e.columns) == 2]
    if rest != "all":
        points = [entry for entry in points if f"bodies/{entry.part.split('.')[0]}" == rest]
    columns = [column for entry in points for column in entry.columns]
    return WayReading(word, tuple(columns)) if columns else None


def _curve(word: str, rest: str, outputs: Outputs) -> WayReading | None:
    point, _, what = rest.rpartition("/")
    for entry in outputs.entries:
        if entry.kind == "points" and entry.part == point and what in FACTS[word]:
            return WayReading(word, entry.columns, (what,))
    return None


_OF: dict[str, Callable[[str, str, Outputs], WayReading | None]] = {
    "transmission": _transmission, "extremes": _extremes, "time_ratio": _strokes,
    "return_angle": _strokes, "envelope": _envelope, "curve": _curve,
}  # fmt: skip
