"""Least and greatest values with their driver values, stationary positions, boxes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.motion.measures.along_sweep_extremes import Course
from mechdae.motion.measures.stationary_places import AT_REST
from mechdae.motion.measures.track import Track

if TYPE_CHECKING:
    from mechdae.types import Json


def extremes(track: Track, courses: dict[str, Course]) -> dict[str, dict[str, dict[str, float]]]:
    """Return name -> {"min": {"value", "at", "error"}, "max": {...}} of everything that moves."""
    found = {}
    for name, course in courses.items():
        low, high = course.extreme(-1), course.extreme(1)
        if course.moves and low is not None and high is not None:
            size = 1.0 if course.quantity.is_angle else track.scale
            errors = track.errors([low.place, high.place], course.quantity.column)
            rests = [AT_REST * size if place.rest else 0.0 for place in (low, high)]
            found[name] = {
                word: {"value": place.value, "at": place.at, "error": float(error + rest)}
                for word, place, error, rest in zip(
                    ("min", "max"), (low, high), errors, rests, strict=True
                )
            }
    return found


def stationary_events(courses: dict[str, Course]) -> list[Json]:
    """Return the stationary positions (dead points) of bodies and slides as events."""
    return [
        {
            "kind": "stationary",
            "of": name,
            "at": place.at,
            "value": place.value,
            "extreme": "max" if place.sense > 0 else "min",
            "in_range": True,
            **({"rest": list(place.rest)} if place.rest else {}),
        }
        for name, course in courses.items()
        if course.quantity.is_output
        for place in course.stationary
    ]


def envelope(courses: dict[str, Course]) -> Json:
    """Return the box [xmin, xmax, ymin, ymax] swept by the points: of all, and by body.

    In space zmin and zmax follow.
    """
    boxes: dict[str, list[float]] = {}
    axes = {name[-1] for name, course in courses.items() if not course.quantity.is_output}
    for name, course in courses.items():
        part, _, axis = name.rpartition(".")
        low, high = course.extreme(-1), course.extreme(1)
        if course.quantity.is_output or low is None or high is None:
            continue
        first = 2 * "xyz".index(axis)
        for key in ("all", f"bodies/{part.split('.')[0]}"):
            box = boxes.setdefault(key, [float("inf"), -float("inf")] * len(axes))
            box[first] = min(box[first], low.value)
            box[first + 1] = max(box[first + 1], high.value)
    if not boxes:
        return {}
    bodies = {key.removeprefix("bodies/"): box for key, box in boxes.items() if key != "all"}
    return {"all": boxes["all"], "bodies": bodies}
