"""The ends of fronts: what the search for each objective alone gave, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mechdae.types import Floats, Json


SAME = 1e-3
"""Share of an objective and of its range by which the end of a front may be off its best."""


def part_of(k: int) -> str:
    """Return the word of the starts of an objective alone."""
    return f"objective {k + 1}"


def census(
    runs: Sequence[Mapping[str, float | str]],
    terms: Sequence[Floats],
    k: int,
    best: float,
    span: float,
) -> Json:
    """Return how the starts of an objective alone ended.

    `runs`, `terms`: all runs, and the objectives (m,) at the end of each, None where constraints
    are missed.
    """
    alone = [
        (run, values) for run, values in zip(runs, terms, strict=True) if run["part"] == part_of(k)
    ]
    near = best + SAME * (abs(best) + span)
    hits = [run for run, values in alone if values is not None and values[k] <= near]
    return {
        "starts": len(alone),
        "met": sum(values is not None for _, values in alone),
        "hits_of_best": len(hits),
        "ipopt": dict(Counter(run["status"] for run, _ in alone)),
        "solved": sum(bool(run["solved"]) for run in hits),
        "found": any(run["solved"] for run in hits),
    }


def missing(k: int, end: Mapping[str, Any]) -> str:
    """Return what is said of an end that was not found."""
    ends = ", ".join(
        f"{count} {status.replace('_', ' ').lower()}" for status, count in end["ipopt"].items()
    )
    why = (
        "its optimum was rejected by its sweep" if end["solved"]
        else "the best did not end at an optimum" if end["hits_of_best"]
        else "better values were found at other levels" if end["met"]
        else "none met all constraints"
    )  # fmt: skip
    return (
        f"the end of objective {k + 1} was not found, the front may go on there: of {end['starts']}"
        f" starts of it alone {end['met']} met all constraints ({ends}); {why}"
    )


def gap_words(gap: Mapping[str, Any]) -> str:
    """Return what is said of a hole that stayed."""
    first, last = (", ".join(f"{x:.6g}" for x in gap[word]) for word in ("first", "last"))
    return (
        f"no point was found between ({first}) and ({last}) from {gap['starts']} further starts: "
        f"the front jumps there, or the search failed"
    )
