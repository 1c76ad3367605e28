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
from collections.abc import Sequence

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
        return _with_balls(laws, start, slope), False
    flat = [j for j, law in enumerate(laws) if law == "largest"]
    pins = [j for j, law in enumerate(laws) if law == "length"]
    counts = [len(start[j]) for j in flat]
    proven = True
    if np.prod(counts, initial=1.0) > CHOICES:
        return _solving(laws, start, slope, sizes_of(laws, start)[None]), False
    found: list[Floats] = []
    for choice in itertools.product(*[range(count) for count in counts]):
        own, sure = _chosen(laws, start, slope, flat, pins, choice)
        proven &= sure
        for m in own:
            if _holds(start, slope, flat, pins, choice, m) and all(
                apart(m, other) > SAME for other in found
            ):
                found.append(m)
    return found, proven


def _with_balls(
    laws: Sequence[str], start: Sequence[Floats], slope: Sequence[Matrix]
) -> list[Floats]:
    """Return the solutions found of a group with ball joints: friction turns with the load."""
    first = sizes_of(laws, start)
    rng, size = np.random.default_rng(0), max(float(np.abs(first).max(initial=0.0)), 1e-300)
    starts = size * 10.0 ** rng.uniform(-1, 3, (STARTS, len(laws)))
    starts *= np.where([law in ACROSS for law in laws], rng.uniform(-1, 1, starts.shape), 1.0)
    starts[0] = first
    found: list[Floats] = []
    for m in _solving(laws, start, slope, starts):
        own = m[sized(laws)]
        known = any(apart(m, other) <= SAME for other in found)
        if not known and (own >= -SLACK * np.abs(m).max(initial=0.0)).all():
            found.append(m)
    return found


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
    first_guess = sizes_of(lengths, vectors)
    if np.max((K @ weights) / weights) < 1:
        one = _solving(lengths, vectors, turns, first_guess[None])
        return [whole(m) for m in one], bool(one)
    scales = 10.0 ** np.random.default_rng(0).uniform(-1, 3, (STARTS, len(pins)))
    starts = max(first_guess.max(), 1e-300) * scales
    starts[0] = first_guess
    found: list[Floats] = []
    for m in _solving(lengths, vectors, turns, starts):
        if (m >= 0).all() and all(apart(m, o) > SAME for o in found):
            found.append(m)
    return [whole(m) for m in found], False


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
