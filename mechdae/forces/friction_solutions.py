"""All solutions of friction at a pose: none, one or several.

A group's sizes m solve m_j = size_j(L + S m), lengths of vectors or the largest of several forms
L + S m, which are linear in the sizes. Guides, slots and meshes are piecewise linear:
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
from mechdae.types import Booleans, Floats, Integers, Matrices, Matrix

STEPS = 16
"""Steps of Newton's method at most."""


def sizes_of(laws: Sequence[str], forms: Sequence[Floats]) -> Floats:
    """Return the sizes (..., k) for the values of their forms, (..., rows) each."""
    every = [_size(law, form) for law, form in zip(laws, forms, strict=True)]
    return np.stack(every, axis=-1) if every else np.zeros(0)


def _size(law: str, form: Floats) -> Any:
    if law == "length":
        return np.sqrt(np.sum(form * form, axis=-1))
    if law in ACROSS:
        return form[..., 0] * form[..., 1 + ACROSS.index(law)] / _least(form)
    return form.max(axis=-1)


def _least(form: Floats) -> Any:
    """Return |t| of the forms (p, t), not below what may be divided by."""
    return np.fmax(np.sqrt(np.sum(form[..., 1:] ** 2, axis=-1)), 1e-150)


def sized(laws: Sequence[str]) -> list[int]:
    """Return the places of sizes that are never negative."""
    return [j for j, law in enumerate(laws) if law not in ACROSS]


def forms_of(start: Sequence[Floats], slope: Sequence[Floats], m: Floats) -> list[Floats]:
    pairs = zip(start, slope, strict=True)
    return [first + (slopes @ m[..., None])[..., 0] for first, slopes in pairs]


def slopes_of(
    laws: Sequence[str], start: Sequence[Floats], slope: Sequence[Floats], m: Floats
) -> Matrices:
    """Return d size / d m, (..., k, k)."""
    rows = []
    for law, form, slopes in zip(laws, forms_of(start, slope, m), slope, strict=True):
        if law == "length":
            length = np.fmax(np.sqrt(np.sum(form * form, axis=-1)), 1e-300)
            rows.append((form[..., None, :] @ slopes)[..., 0, :] / length[..., None])
        elif law in ACROSS:
            size, k = _least(form)[..., None], ACROSS.index(law)
            p, t = form[..., :1], form[..., 1:]
            turned = (t[..., None, :] @ slopes[..., 1:, :])[..., 0, :] * t[..., k : k + 1] / size**2
            moved = slopes[..., 0, :] * t[..., k : k + 1] + p * (slopes[..., 1 + k, :] - turned)
            rows.append(moved / size)
        else:
            most = np.argmax(form, axis=-1)[..., None, None]
            slopes = np.broadcast_to(slopes, (*form.shape[:-1], *slopes.shape[-2:]))
            rows.append(np.take_along_axis(slopes, most, axis=-2)[..., 0, :])
    return np.stack(rows, axis=-2)


def newton(
    laws: Sequence[str], start: Sequence[Floats], slope: Sequence[Floats], starts: Floats
) -> tuple[Floats, Booleans]:
    """Return sizes (n, k) that solve their laws, from starts near them, and which do (n,).

    Forms are those of one pose, or have a row for each start.
    """
    m, going = starts.copy(), np.arange(len(starts))
    ended = np.zeros(len(starts), bool)
    several = bool(start) and start[0].ndim == 2

    def forms(rows: Integers) -> tuple[Sequence[Floats], Sequence[Floats]]:
        if not several:
            return start, slope
        return [forms[rows] for forms in start], [forms[rows] for forms in slope]

    for _ in range(STEPS):
        sizes, (first, onto) = m[going], forms(going)
        left = sizes - sizes_of(laws, forms_of(first, onto, sizes))
        size = np.fmax(np.abs(sizes).max(axis=1, initial=0.0), 1e-300)
        finite = np.isfinite(left).all(axis=1)
        there = finite & (np.abs(left).max(axis=1, initial=0.0) <= 4e-15 * size)
        ended[going[there]] = True
        further = finite & ~there
        sizes, left, size, going = (part[further] for part in (sizes, left, size, going))
        if not len(going):
            break
        matrix = np.eye(m.shape[1]) - slopes_of(laws, *forms(going), sizes)
        step, solved = _solved(matrix, left)
        m[going] = sizes - step
        small = solved & (np.abs(step).max(axis=1, initial=0.0) <= 2e-16 * size)
        ended[going[small]] = True
        going = going[solved & ~small]
    ended[going] = True
    rows = np.flatnonzero(ended)
    left = m[rows] - sizes_of(laws, forms_of(*forms(rows), m[rows]))
    size = np.fmax(np.abs(m[rows]).max(axis=1, initial=0.0), 1e-300)
    ended[rows] = np.abs(left).max(axis=1, initial=0.0) <= 1e-11 * size
    return m, ended


def _solved(matrix: Matrices, right: Floats) -> tuple[Any, Any]:
    """Return the solutions (n, k) of systems, zeros where one is singular, and which are not."""
    try:
        return np.linalg.solve(matrix, right[..., None])[..., 0], np.ones(len(right), bool)
    except np.linalg.LinAlgError:
        found, regular = np.zeros_like(right), np.ones(len(right), bool)
    for k in range(len(right)):
        try:
            found[k] = np.linalg.solve(matrix[k], right[k])
        except np.linalg.LinAlgError:
            regular[k] = False
    return found, regular


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
