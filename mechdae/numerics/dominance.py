"""Which points of a front others dominate, and how much room a front dominates."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.types import Booleans, Floats, Points


def undominated(values: Floats | list[list[int]], slack: float = 0.0) -> Booleans:
    """Return which rows of values (n, m), the less the better, no other row is better than.

    With a `slack` a row is better too that is worse by less than this share of a value.
    """
    values = np.asarray(values, float)
    found = np.ones(len(values), bool)
    for k, design in enumerate(values):
        edge = slack * np.abs(design)
        better = (values <= design + edge).all(axis=1) & (values < design - edge).any(axis=1)
        found[k] = not better.any()
    return found


def best_of(
    designs: list[dict[str, Floats | list[int]]], signs: Floats, same: float
) -> list[dict[str, Any]]:
    """Return the designs that no other one dominates, each once, by their first objective.

    Those that differ by less than a share of the range of each objective are one.
    """
    if not designs:
        return []
    values = np.array([design["objectives"] for design in designs]) * signs
    front = np.flatnonzero(undominated(values))
    order = front[np.lexsort(values[front].T[::-1])]
    span = np.maximum(np.ptp(values[front], axis=0), 1e-300)
    found: list[int] = []
    for k in order.tolist():
        near = [np.abs(values[k] - values[j]).max(initial=0.0) for j in found]
        gaps = [(np.abs(values[k] - values[j]) / span).max() for j in found]
        if not any(gap <= same or size == 0.0 for gap, size in zip(gaps, near, strict=True)):
            found.append(k)
    return [designs[k] for k in found]


def thinned(values: object, most: int) -> list[int]:
    """Return the places of `most` points of a front of two objectives, in their order.

    Of more that one goes whose loss takes least from the hypervolume, one after the other; the ends
    stay.

    `values` (n, 2): points that do not dominate each other, sorted by the first.
    """
    values = np.asarray(values, float)
    indices = list(range(len(values)))
    while len(indices) > max(most, 2):
        left = values[indices]
        losses = (left[2:, 0] - left[1:-1, 0]) * (left[:-2, 1] - left[1:-1, 1])
        del indices[1 + int(np.argmin(losses))]
    return indices


def hypervolume(values: Points | list[list[int]], reference: Floats | list[int]) -> float:
    """Return the room that points dominate up to a reference, the less the better.

    `values` (n, m): points, m up to 3; what is beyond the reference in one of them counts nothing.
    `reference` (m,): worst values.

    Notes
    -----
    In the plane a sum of rectangles; in space slices of the third objective, each a plane one.
    """
    values, reference = np.asarray(values, float), np.asarray(reference, float)
    inside = values[(values < reference).all(axis=1)]
    if not len(inside):
        return 0.0
    if values.shape[1] == 2:
        return _area(inside, reference)
    order = inside[np.argsort(inside[:, 2], kind="stable")]
    heights = np.append(order[:, 2], reference[2])
    return float(
        sum(
            (heights[k + 1] - heights[k]) * _area(order[: k + 1, :2], reference[:2])
            for k in range(len(order))
        )
    )


def _area(values: Points, reference: Floats) -> float:
    order = values[np.lexsort((values[:, 1], values[:, 0]))]
    area, top = 0.0, float(reference[1])
    for x, y in order.tolist():
        if y < top:
            area += (float(reference[0]) - x) * (top - y)
            top = y
    return area
