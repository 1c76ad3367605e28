"""Time ratio of forward and return stroke over one turn of the driver at constant speed."""

from __future__ import annotations

import math

import numpy as np

from mechdae.motion.measures.along_sweep_extremes import AT_REST, ReportedScalar, stops, travel
from mechdae.motion.measures.track import SAME, TURN, Piece, Track
from mechdae.types import Floats, Json

CLOSED = 1e-9
"""Share of its size within which a quantity is back after a turn."""


def time_ratios(track: Track, wanted: list[ReportedScalar]) -> dict[str, Json]:
    """Return ``time_ratio``, ``return_angle`` and, where there is none, ``no_time_ratio``.

    Keys below are bodies and joints. The ratio is the longer stroke's driver angle over the
    shorter one's, `return_angle` the shorter one; reasons are sentences.
    """
    found: dict[str, Json] = {"time_ratio": {}, "return_angle": {}, "no_time_ratio": {}}
    for quantity in wanted:
        if not quantity.is_output:
            continue
        ratio = _ratio(track, quantity)
        if isinstance(ratio, str):
            found["no_time_ratio"][quantity.label] = ratio
        elif ratio is not None:
            found["time_ratio"][quantity.label] = (TURN - ratio) / ratio
            found["return_angle"][quantity.label] = ratio
    return {word: table for word, table in found.items() if table}


def _ratio(track: Track, quantity: ReportedScalar) -> float | str | None:
    """Return the driver's angle of the shorter stroke, the reason why not, None at rest."""
    if not track.is_angle:
        return "the driver does not turn"
    start, column = track.low, quantity.column
    held = track.reach(start - track.margin, start + TURN + track.margin)
    first, last, limits = track.ends()
    if limits:
        nearest = min(limits, key=lambda limit: abs(limit.s - start))
        word = "a limit position" if nearest.kind == "limit" else "the path's end"
        return f"the driver does not turn fully: {word} at {math.degrees(nearest.s):.6g} deg"
    if not held or first > start or last < start + TURN:
        return "no full turn of the driver was followed"
    piece = Piece(max(start - track.margin, first), min(start + TURN + track.margin, last))
    size = 1.0 if quantity.is_angle else track.scale
    if not np.all(np.isfinite(track.sample(piece).y[1][:, column])):
        return "a pose of the turn is not certified"
    if travel(track.sample(piece), [column])[0] <= AT_REST * size:
        return None
    ends = track.at(np.array([start, start + TURN]))
    gain = [float(array[1, column] - array[0, column]) for array in ends.y[:3]]
    turns = round(gain[0] / TURN) if quantity.is_angle else 0
    if max(abs(gain[0] - turns * TURN), abs(gain[1]), abs(gain[2])) > CLOSED * size:
        return "it is not back after one turn of the driver"
    if turns:
        return "it does not swing, it turns fully"
    (found,) = stops(track, piece, [column], [size])
    if any(stop.rests for stop in found):
        return "it rests over an interval, where its strokes end is not certain"
    highest, lowest = (
        _distinct([stop.first for stop in found if stop.sense == sense], start) for sense in (1, -1)
    )
    if len(highest) != 1 or len(lowest) != 1:
        return f"it has {len(highest)} maxima and {len(lowest)} minima in a turn of the driver"
    stroke = float((lowest[0] - highest[0]) % TURN)
    return min(stroke, TURN - stroke)


def _distinct(places: list[float], start: float) -> Floats:
    """Return places of one turn from `start`, each once."""
    distinct: list[float] = []
    for s in places:
        gaps = [(s - other + TURN / 2) % TURN - TURN / 2 for other in distinct]
        if all(abs(gap) > SAME for gap in gaps):
            distinct.append(float(s))
    return np.array(sorted(start + (s - start) % TURN for s in distinct))
