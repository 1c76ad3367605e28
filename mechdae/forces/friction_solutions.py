"""All solutions of friction at a pose: none, one or several.

A group's sizes m solve m_j = size_j(L + S m). Guides, slots and meshes are piecewise linear:
every choice of pieces gives linear equations, and all choices are tried, so that their count
is proved. Pins are lengths of vectors: one pin leaves a quadratic equation, several are
solved by Newton's method, their count is proved where the map contracts and otherwise that
of the solutions found, as in groups with ball joints. Groups are solved one after another from
the last one, each solution leads to those of the groups before it.

Which of them continues the one without friction: `forces/friction_branches.py`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mechdae.equations.forces.feedback import ACROSS
from mechdae.forces.friction_laws import newton, sized, sizes_of
from mechdae.types import Floats, Matrix

CHOICES = 4096
"""Choices of pieces that are tried in one group."""
SAME = 1e-6
"""Share of the sizes within which two solutions are the same one: near the end of a branch
they are known to half of the digits."""
SLACK = 1e-9
"""Share by which the chosen piece may be smaller than another one."""
STARTS = 64
"""Starts of Newton's method where several pins act on each other."""


def apart(a: Floats, b: Floats) -> float:
    """Return how far two solutions are apart, as a share of the larger one."""
    size = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0), 1e-300)
    return float(np.abs(a - b).max(initial=0.0) / size)


def solutions_of(
    laws: Sequence[str], start: Sequence[Floats], slope: Sequence[Matrix]
) -> tuple[list[Floats], bool]:
    """Return all sizes that fit their laws, and whether their count is proved.

    Parameters
    ----------
    laws
        "length" or "largest", of each size.
    start, slope
        Linear forms (k,) of each size where all are zero, and their slopes (k, sizes).
    """
    if any(law in ACROSS for law in laws):
        return _from_many_starts(laws, start, slope, SLACK), False
    flat = [j for j, law in enumerate(laws) if law == "largest"]
    pins = [j for j, law in enumerate(laws) if law == "length"]
    counts = [len(start[j]) for j in flat]
    if np.prod(counts, initial=1.0) > CHOICES:
        return _solving(laws, start, slope, sizes_of(laws, start)[None]), False
    found, proven = list[Floats](), True
    for choice in itertools.product(*[range(count) for count in counts]):
        tried, sure = _chosen(laws, start, slope, flat, pins, choice)
        proven &= sure
        found += [m for m in tried if _holds(start, slope, flat, pins, choice, m)]
    return _distinct(found), proven


def _distinct(solutions: Iterable[Floats]) -> list[Floats]:
    found: list[Floats] = []
    for m in solutions:
        if all(apart(m, known) > SAME for known in found):
            found.append(m)
    return found


def _from_many_starts(
    laws: Sequence[str], start: Sequence[Any], slope: Sequence[Any], slack: float
) -> list[Floats]:
    """Return the different solutions that are found; lengths are not negative, up to a share."""
    first = sizes_of(laws, start)
    rng, size = np.random.default_rng(0), max(float(np.abs(first).max(initial=0.0)), 1e-300)
    starts = size * 10.0 ** rng.uniform(-1, 3, (STARTS, len(laws)))
    starts *= np.where([law in ACROSS for law in laws], rng.uniform(-1, 1, starts.shape), 1.0)
    starts[0] = first
    solutions, lengths = _solving(laws, start, slope, starts), sized(laws)
    return _distinct(
        m for m in solutions if (m[lengths] >= -slack * np.abs(m).max(initial=0.0)).all()
    )


def _solving(
    laws: Sequence[str], start: Sequence[Floats], slope: Sequence[Matrix], starts: Floats
) -> list[Floats]:
    """Return what Newton's method finds from each of many starts (n, k)."""
    m, good = newton(laws, start, slope, starts)
    return list(m[good])


def _holds(
    start: Sequence[Floats],
    slope: Sequence[Matrix],
    flat: list[int],
    pins: list[int],
    choice: tuple[int, ...],
    m: Floats,
) -> bool:
    """Return whether the chosen pieces are the largest ones, and no length is negative."""
    if not np.isfinite(m).all():
        return False
    slack = SLACK * max(float(np.abs(m).max(initial=0.0)), 0.0)
    for j, k in zip(flat, choice, strict=True):
        form = start[j] + slope[j] @ m
        if form[k] < form.max() - slack:
            return False
    return bool((m[pins] >= -slack).all())


def _chosen(
    laws: Sequence[str],
    start: Sequence[Floats],
    slope: Sequence[Matrix],
    flat: list[int],
    pins: list[int],
    choice: tuple[int, ...],
) -> tuple[list[Floats], bool]:
    """Return the solutions for one choice of pieces; pieces are not checked."""
    count = len(laws)
    a = np.array([start[j][k] for j, k in zip(flat, choice, strict=True)])
    A = np.array([slope[j][k] for j, k in zip(flat, choice, strict=True)]).reshape(-1, count)
    matrix = np.eye(len(flat)) - A[:, flat]
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return [], False
    first, onto = inverse @ a, inverse @ A[:, pins]  # m_flat = first + onto m_pins

    def whole(m_pins: Floats) -> Floats:
        m = np.zeros(count)
        m[pins] = m_pins
        m[flat] = first + onto @ m_pins
        return m

    if not pins:
        return [whole(np.zeros(0))], True
    vectors = [start[j] + slope[j][:, flat] @ first for j in pins]
    turns = [slope[j][:, pins] + slope[j][:, flat] @ onto for j in pins]
    if len(pins) == 1:
        return [whole(np.array([m])) for m in _one_pin(vectors[0], turns[0][:, 0])], True
    lengths = ["length"] * len(pins)
    K = np.array([np.sqrt(np.sum(turn * turn, axis=0)) for turn in turns])
    weights = 1 + K.sum(axis=1)
    if np.max((K @ weights) / weights) < 1:
        one = _solving(lengths, vectors, turns, sizes_of(lengths, vectors)[None])
        return [whole(m) for m in one], bool(one)
    return [whole(m) for m in _from_many_starts(lengths, vectors, turns, 0.0)], False


def _one_pin(vector: Floats, turn: Floats) -> list[float]:
    """Return the m >= 0 with m = |vector + turn m|."""
    a = 1 - float(turn @ turn)
    b, c = float(vector @ turn), float(vector @ vector)
    # a m^2 - 2 b m - c = 0
    if c == 0:
        return [0.0]
    if abs(a) < 1e-14:
        return [-c / (2 * b)] if b < 0 else []
    root = b * b + a * c
    if root < 0:
        return []
    far = b + np.copysign(np.sqrt(root), b)
    roots = [far / a, -c / far] if far else [0.0]
    return sorted({float(m) for m in roots if m >= 0})
