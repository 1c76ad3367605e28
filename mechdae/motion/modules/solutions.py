"""All real solutions of a module for many data, polished and labelled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.errors import InputError, UnknownName
from mechdae.motion.modules.catalogue import MODULES, WORDS
from mechdae.motion.modules.places import Vector3, candidates
from mechdae.records import dataclass
from mechdae.types import Floats, Integers, Matrices, Matrix

CLOSED = 1e-13
"""Largest gap of a solution, by the sizes of the vectors."""
SAME = 1e-9
"""Solutions nearer than this, by the sizes, are one."""
CLOSE, ONE = 1e-3, 2e-15
"""Solutions that close to each other are one if the loop closes as well half-way between them."""
STEPS, MORE = 6, 20
CIRCLES = ("a-a-a", "a-a-b", "a-b-b")
"""Modules of three circles: a second look where candidates were lost."""


@dataclass(frozen=True)
class ModuleSolutions:
    """Real solutions of n data, k at most of each; `nan` where there are fewer.

    ``unknowns`` has name -> (n, k): ``length1``, ``elevation2``; ``count`` (n,), ``gap`` (n, k)
    by the sizes of the vectors, ``determinant`` (n, k) of the closure by the unknowns, whose sign
    and the place in the order of it make the ``labels``. ``sure`` (n,) tells that each root of the
    eliminant was accounted for, which near folds need not be.
    """

    unknowns: dict[str, Matrix]
    count: Integers
    gap: Floats
    determinant: Floats
    sure: Any = None

    def labels(self, row: int) -> list[str]:
        """Return the labels of one datum's solutions: ``+``, ``+2``, ``-``, ``-2``."""
        seen = {"+": 0, "-": 0}
        result = []
        for value in self.determinant[row, : self.count[row]]:
            sign = "+" if value >= 0 else "-"
            seen[sign] += 1
            result.append(sign if seen[sign] == 1 else f"{sign}{seen[sign]}")
        return result


def solve_module(
    name: str, vectors: Sequence[Mapping[str, float]], total: Floats | list[float]
) -> ModuleSolutions:
    """Return all real solutions of a spatial module.

    Parameters
    ----------
    name
        As in the catalogue, ``lb-a``.
    vectors
        For each vector what is known of it: arrays (n,) of ``length``, ``elevation``, ``azimuth``.
    total
        The sum of the vectors (n, 3): less the sum of what is known of the loop.

    Raises
    ------
    UnknownName, InputError
        No such module, one without solutions, or numbers that are missing.
    """
    if name not in MODULES:
        raise UnknownName("module", name, MODULES)
    if MODULES[name].singular:
        raise InputError(
            f"'{name}' is structurally singular: its second row holds no unknown",
            hint="one of the vectors needs an unknown length or elevation",
        )
    d = np.atleast_2d(np.asarray(total, float))
    roots = []
    for position, unknown in enumerate(MODULES[name].unknowns):
        needed = [word for letter, word in WORDS.items() if letter not in unknown]
        for word in needed:
            if word not in vectors[position]:
                raise InputError(f"{word} of vector {position + 1} is missing", where=name)
        known = {
            word: np.broadcast_to(np.asarray(vectors[position][word], float), (len(d),))
            for word in needed
        }
        roots.append(Vector3(unknown, known))
    places = candidates(roots, d)
    found = _all(roots, places, d)
    tried = np.isfinite(np.sum(places, axis=0)).all(axis=-1).sum(axis=1)
    found = replace(found, sure=found.count >= tried)
    doubtful = np.flatnonzero(~found.sure)
    if name in CIRCLES and doubtful.size:
        part = [
            Vector3(v.unknown, {word: value[doubtful] for word, value in v.known.items()})
            for v in roots
        ]
        more = _all(part, candidates(part, d[doubtful], wide=True), d[doubtful], MORE)
        return _with(found, doubtful, more)
    return found


def _all(
    vectors: list[Vector3], places: list[Matrices], d: Floats, steps: int = STEPS
) -> ModuleSolutions:
    """Return the solutions near candidates."""
    found = [v.unknowns_of(w) for v, w in zip(vectors, places, strict=True)]
    polished, gap, determinant = _polished(vectors, found, d, steps)
    return _distinct(vectors, polished, gap, determinant, d)


def _with(found: ModuleSolutions, rows: Integers, more: ModuleSolutions) -> ModuleSolutions:
    """Return the solutions with some rows in place of their own."""
    most = max(found.gap.shape[1], more.gap.shape[1])

    def put(one: Floats, other: Floats) -> Floats:
        result = np.full((len(one), most), np.nan)
        result[:, : one.shape[1]] = one
        result[rows] = np.nan
        result[rows, : other.shape[1]] = other
        return result

    count = found.count.copy()
    count[rows] = more.count
    return ModuleSolutions(
        {word: put(value, more.unknowns[word]) for word, value in found.unknowns.items()},
        count,
        put(found.gap, more.gap),
        put(found.determinant, more.determinant),
        found.sure,
    )


def _polished(
    vectors: list[Vector3], found: list[dict[str, Floats]], d: Floats, steps: int
) -> tuple[list[dict[str, Floats]], Floats, Floats]:
    """Return the unknowns after Newton steps on the closure, its gap by the sizes, determinants."""
    best, gap = found, _gap(vectors, found, d)
    for _ in range(steps):
        columns = [c for v, f in zip(vectors, best, strict=True) for c in v.columns(f)]
        step = _step(columns, _closure(vectors, best, d))
        moved: list[dict[str, Floats]] = []
        letters = iter(range(3))
        for solution in best:
            moved.append(
                {word: value - step[..., next(letters)] for word, value in solution.items()}
            )
        new = _gap(vectors, moved, d)
        better = new < gap
        best = [
            {word: np.where(better, new_own[word], value) for word, value in solution.items()}
            for solution, new_own in zip(best, moved, strict=True)
        ]
        gap = np.where(better, new, gap)
    columns = [c for v, f in zip(vectors, best, strict=True) for c in v.columns(f)]
    return best, gap, _volume(columns)


def _volume(columns: list[Matrices]) -> Any:
    first, second, third = columns
    return (first * np.cross(second, third)).sum(axis=-1)


def _step(columns: list[Matrices], rows: Matrices) -> Any:
    """Return J^-1 F of three columns (n, k, 3), by Cramer's rule."""
    first, second, third = columns
    with np.errstate(all="ignore"):
        volume = _volume(columns)
        parts = [
            (rows * np.cross(second, third)).sum(axis=-1),
            (rows * np.cross(third, first)).sum(axis=-1),
            (rows * np.cross(first, second)).sum(axis=-1),
        ]
        return np.stack(parts, axis=-1) / volume[..., None]


def _closure(vectors: list[Vector3], found: list[dict[str, Floats]], d: Floats) -> Any:
    values = [v.value(f) for v, f in zip(vectors, found, strict=True)]
    return np.sum(values, axis=0) - d[:, None, :]


def _gap(vectors: list[Vector3], found: list[dict[str, Floats]], d: Floats) -> Floats:
    values = [v.value(f) for v, f in zip(vectors, found, strict=True)]
    sizes = np.linalg.norm(d, axis=-1)[:, None] + sum(np.linalg.norm(v, axis=-1) for v in values)
    with np.errstate(all="ignore"):
        gap = np.linalg.norm(np.sum(values, axis=0) - d[:, None, :], axis=-1) / sizes
    return np.where(np.isfinite(gap), gap, np.inf)


def _between(
    vectors: list[Vector3],
    found: list[dict[str, Floats]],
    d: Floats,
    rows: Integers,
    pair: tuple[int, int],
) -> Floats:
    """Return the gap half-way between two solutions of some rows."""
    solutions = [
        Vector3(v.unknown, {word: value[rows] for word, value in v.known.items()}) for v in vectors
    ]
    middle: list[dict[str, Floats]] = []
    for part in found:
        middle.append({})
        for word, value in part.items():
            one, other = (np.broadcast_to(value, (len(d), value.shape[1]))[rows, k] for k in pair)
            turn = other - one
            if word != "length":
                turn = np.angle(np.exp(1j * turn))
            middle[-1][word] = (one + turn / 2)[:, None]
    return _gap(solutions, middle, d[rows])[:, 0]


def _distinct(
    vectors: list[Vector3],
    found: list[dict[str, Floats]],
    gap: Floats,
    determinant: Floats,
    d: Floats,
) -> ModuleSolutions:
    """Return the solutions that close, each once, in the order of their determinants."""
    values = np.concatenate([v.value(f) for v, f in zip(vectors, found, strict=True)], axis=-1)
    size = np.linalg.norm(np.where(np.isfinite(values), values, 0.0), axis=-1)
    good = gap <= CLOSED
    k = gap.shape[1]
    for i in range(k):
        for j in range(i):
            apart = np.linalg.norm(values[:, i] - values[:, j], axis=-1)
            near = apart <= CLOSE * (size[:, i] + size[:, j])
            rows = np.flatnonzero(good[:, i] & good[:, j] & near)
            if not rows.size:
                continue
            one = apart[rows] <= SAME * (size[rows, i] + size[rows, j])
            # near a cusp Newton stalls: what closes worse than its neighbour is no solution
            one |= np.maximum(gap[rows, i], gap[rows, j]) > 4 * ONE
            one |= _between(vectors, found, d, rows, (i, j)) <= ONE
            # of two that are one the better stays
            worse = gap[rows, i] >= gap[rows, j]
            good[rows, i] &= ~(one & worse)
            good[rows, j] &= ~(one & ~worse)
    count = good.sum(axis=1)
    order = np.argsort(np.where(good, -determinant, np.inf), axis=1, kind="stable")
    order = order[:, : max(int(count.max(initial=0)), 1)]
    remaining = np.take_along_axis(good, order, axis=1)

    def taken(array: Floats) -> Floats:
        return np.where(remaining, np.take_along_axis(array, order, axis=1), np.nan)

    unknowns = {
        f"{word}{position}": taken(np.broadcast_to(value, gap.shape))
        for position, solution in enumerate(found, start=1)
        for word, value in solution.items()
    }
    return ModuleSolutions(unknowns, count, taken(gap), taken(determinant))
