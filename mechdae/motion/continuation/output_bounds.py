"""From bounds on the unknowns to bounds on points and body angles; what rounding adds to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.setup.outputs import Outputs
from mechdae.motion.setup.scales import Constants
from mechdae.types import Booleans, Floats, Matrix

FEW = 64
"""Rows of which those that others exceed everywhere are left out."""
ILL = 2.0**34
"""Largest `spread` up to which rounding changes the inverse of a block by less than the allowance
of bounds (`mechdae.kernels.graphs.bounds`) covers."""
WORST = 2.0**44
"""The same from which on no bound holds: a pose is not certified."""
TURN = 21**0.5
"""What an error of all entries of a matrix makes of the angle of the quaternion q told for it.

With the largest component q_k the four numbers 4 q_k q, at least 2 in length, are one sum of four
entries and three of two (`mechdae.motion.setup.angular_rates`). Twice the error of their direction
is an angle.
"""
TURNED = 3 / 2**0.5
"""The same for the difference of two rotations, whose norm is sqrt(2) times the angle between."""
QUATERNION = 2.0**-49
"""What rounding adds to it: at most 8.7 half units in the last place in sums, 2 in quotients."""
Row = tuple[tuple[int, ...], tuple[float, ...]]
"""The columns and values of a sparse row."""


class OutputBounds:
    """Bounds on outputs from those on the unknowns, by |dy/dx| bounded for a whole path.

    Half a unit in the last place of the driver's value does not count, bounds are for the
    float64 data given.

    Attributes
    ----------
    words
        ``length`` [m] of the points, ``angle`` [rad] of the bodies, those that there are.
    """

    def __init__(self, graphs: Graphs, outputs: Outputs, constants: Constants) -> None:
        sizes = (constants.size_x, constants.size_u, constants.p, constants.floors)
        if graphs.contacts:
            slope, rounding = graphs.output_bounds(*sizes, *constants.boxes)
            count = constants.boxes[0].shape[1]
            self.rounding: Floats = np.array(rounding).reshape(graphs.ny, count).max(axis=1)
            (rows, columns), values = slope.sparsity().get_triplet(), slope.nonzeros()
        else:
            rows, columns, call = graphs.output_slopes
            values, self.rounding = call(*sizes, *(part.ravel() for part in constants.boxes))
        self._rows = _rows(rows, columns, values, graphs.ny, graphs.nx)
        self.words: dict[str, tuple[list[Row], float]] = {
            word: self.of(columns) for word, columns in outputs.bounded.items()
        }
        if outputs.matrices:
            rows, rounding = self.of(outputs.matrices)
            share = turned(graphs)
            wider = [(columns, tuple(share * v for v in values)) for columns, values in rows]
            self.words["angle"] = wider, TURN * rounding + QUATERNION

    def of(self, columns: Sequence[int]) -> tuple[list[Row], float]:
        """Return rows and rounding of which the largest bound of some columns is made."""
        rows = list(dict.fromkeys(self._rows[i] for i in columns if self._rows[i][0]))
        return _largest(rows), float(self.rounding[columns].max(initial=0.0))

    def by_kind(self, error: Any) -> dict[str, Floats]:
        """Return the bounds (n,) of each of the `words` for those of the unknowns, (nx, n)."""
        error = np.nan_to_num(error, nan=0.0)
        return {word: self.of_kind(word, error, np.empty(error.shape[1])) for word in self.words}

    def of_kind(self, word: str, error: Sequence[Any], into: Floats) -> Floats:
        """Write the bounds of one of the `words` into an (n,) array, and return it."""
        return _worst(error, *self.words[word], into)

    def largest(self, error: Matrix, columns: list[int]) -> Floats:
        """Return the largest bound of some columns at each pose, (n,); `error` is (n, nx)."""
        known = np.nan_to_num(error, nan=0.0).T
        return _worst(known, *self.of(columns), np.empty(len(error)))


def bounded(
    graphs: Graphs, outputs: Outputs, constants: Constants, error: Matrix
) -> dict[str, Floats]:
    """Return the largest bounds of outputs by kind for those of the unknowns, (n, nx)."""
    return OutputBounds(graphs, outputs, constants).by_kind(error.T)


def of_rows(bounds: Callable[[], dict[str, Floats]], rows: Booleans | None) -> dict[str, Floats]:
    """Return the bounds of some poses (n,), nan of others; None: of all."""
    found = bounds()
    if rows is not None:
        for numbers in found.values():
            numbers[~rows] = np.nan
    return found


def turned(graphs: Graphs) -> float:
    """Return what an error of unknowns, by entries of rotations, makes of an angle.

    Quaternions that are unknown make rotations only where they have the length 1.
    """
    balls = any(word == "e0" for _, word in graphs.scene.x_names)
    return TURN if balls else TURNED


def spread(graphs: Graphs, constants: Any, det: Floats, beta: Floats) -> Any:
    """Return in what multiples of rounding the inverses of all blocks are wrong, (n, nb).

    `det` and `beta` are those of poses; see `spread_of`.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        share = constants.mu * beta
        for b in graphs.adjugates:
            if not share[:, b].max(initial=0.0) <= plain_up_to(graphs, b):
                share[:, b] = spread_of(graphs, constants, b, det[:, b], beta[:, b])
    return share


def spread_of(graphs: Graphs, constants: Constants, b: int, det: Floats, beta: Floats) -> Any:
    """Return in what multiples of rounding the inverse of a block is wrong, of some poses.

    That is |J| |J^-1|; for inverses by the adjugate of m >= 3 rows at most |J|^m / |det J|, with
    the units of unknowns and equations divided out. `constants` has mu, scale and p.
    """
    share = constants.mu[b] * beta
    if b not in graphs.adjugates:
        return share
    columns, rows = (part[b] for part in graphs.units(constants.scale, constants.p))
    unit = float(np.prod(rows) / np.prod(columns))
    with np.errstate(divide="ignore"):
        return np.maximum(share, constants.mu[b] ** len(rows) * unit / np.abs(det))


def plain_up_to(graphs: Graphs, b: int) -> float:
    """Return |J| |J^-1| of a block up to which its `spread_of` is below `ILL` in any case."""
    return float(ILL ** (1 / graphs.blocks[b].size)) if b in graphs.adjugates else ILL


def widened(error: Floats, spread: Floats) -> Any:
    """Return bounds (n, nx) of poses, larger where the inverse of a block is far off by rounding.

    Bounds of later blocks rest on the same inverses: the worst of a pose counts for all.
    """
    worst = np.fmax.reduce(spread, axis=1, initial=0.0)
    if not (worst > ILL).any():
        return error
    return error * (1 + np.where((worst > ILL) & np.isfinite(worst), worst / WORST, 0.0))[:, None]


def _rows(
    rows: list[int], columns: list[int], values: Floats | list[float], count: int, width: int
) -> list[Row]:
    """Return the rows of a sparse matrix; the largest entries of several side by side."""
    entries: list[dict[int, float]] = [{} for _ in range(count)]
    for i, j, value in zip(rows, columns, np.asarray(values).tolist(), strict=True):
        column = j % width
        entries[i][column] = max(value, entries[i].get(column, 0.0))
    return [(tuple(row), tuple(row.values())) for row in entries]


def _largest(rows: list[Row]) -> list[Row]:
    """Return the rows that no other one exceeds in every column, where there are few."""
    if not 1 < len(rows) <= FEW:
        return rows
    tables = [dict(zip(*row, strict=True)) for row in rows]
    chosen: list[int] = []
    for i, bounds in enumerate(tables):
        others = [tables[k] for k in range(len(rows)) if k in chosen or k > i]
        if not any(all(v <= table.get(j, -1.0) for j, v in bounds.items()) for table in others):
            chosen.append(i)
    return [rows[i] for i in chosen]


def _worst(
    error: Matrix | Sequence[Floats], rows: list[Row], rounding: float, into: Floats
) -> Floats:
    """Write the largest product of a row with each pose's errors (nx, n), and rounding."""
    if not rows:
        into[...] = 0.0
    for k, (columns, values) in enumerate(rows):
        product = np.multiply(error[columns[0]], values[0], out=None if k else into)
        for j, value in zip(columns[1:], values[1:], strict=True):
            product += error[j] * value
        if k:
            np.maximum(into, product, out=into)
    into += rounding
    return into
