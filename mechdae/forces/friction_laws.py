"""Laws of friction: sizes of forces that are lengths of vectors, or the largest of several forms.

Sizes m of a group solve m_j = size_j(L + S m), with forms L + S m that are linear in the sizes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.equations.forces.feedback import ACROSS
from mechdae.types import Booleans, Floats, Integers, Matrices

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
