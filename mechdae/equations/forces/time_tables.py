"""Tables over the time as polynomials between their rows: straight lines or splines.

The coefficients of the piece that holds are inputs; rows are breakpoints of a motion.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.loads import TableLoad, TimeTable
from mechdae.errors import InputError, MechdaeError
from mechdae.types import Floats, Points, Sym, Unknowns

SX = ca.SX
ROUNDING = 8
"""Units of the last place by which a time may lie before a row and count as on it."""
CLOSED = 1e-9
"""Share of the largest value by which the first and the last one of a closed spline may differ."""


class Timed:
    """A table over the time.

    Parameters
    ----------
    name
        What messages call it, "load gust" or "law of T.slide".
    table
        The rows and how they are joined.
    time
        Symbol of the time.
    shift, period
        SX numbers of p, by which the table begins later and after which it repeats; None: once.
    p, p_values
        Symbols of the parameters and their values.
    where
        Key path of the table, for messages about other values.

    Attributes
    ----------
    symbols : SX (6,)
        Time of the turns so far, abscissa of the row, the four coefficients of the piece behind it.
    value : SX
        The table's value.
    """

    def __init__(
        self,
        name: str,
        table: TableLoad | TimeTable,
        time: Sym,
        shift: Sym,
        period: Sym | None,
        p: Sym,
        p_values: Floats,
        where: str = "",
    ) -> None:
        self.name: str = name
        self.table: TableLoad | TimeTable = table
        self.where: str = where
        self.repeats: bool = period is not None
        numbers = ca.vertcat(SX(shift), SX(0) if period is None else SX(period))
        self._numbers = ca.Function("numbers", [p], [ca.densify(numbers)])
        self.symbols: Sym = SX.sym(f"piece_{name}", 6)
        turned, start, *terms = ca.vertsplit(self.symbols)
        at = time - shift - turned - start
        self.value: Sym = terms[0] + at * (terms[1] + at * (terms[2] + at * terms[3]))
        self._put(p_values)

    def at(self, p_values: Floats) -> Timed:
        """Return the same table with other values of the parameters."""
        other = copy(self)
        try:
            other._put(p_values)
        except MechdaeError as problem:
            raise problem.inside(self.where) from None
        return other

    def _put(self, p_values: Floats) -> None:
        table = self.table
        result = np.array(self._numbers(p_values)).ravel()
        self.shift: float = float(result[0])
        X, Y = (np.array(column, float) for column in zip(*table.points, strict=True))
        self.period = self._period(table, X, self.repeats, float(result[1]))
        if self.period is not None and self.period > X[-1] - X[0]:
            X, Y = np.append(X, X[0] + self.period), np.append(Y, Y[0])
        elif self.period is not None:
            self.period = float(X[-1] - X[0])
        self.X, self.Y = X, Y
        self.steps: bool = self.period is not None and not self._closed()
        spline = table.interpolation == "spline"
        if spline and self.steps:
            raise InputError(
                f"the spline of a period begins at {Y[0]:g} and ends at {Y[-1]:g}",
                where="rows" if table.file is None else "file",
                hint="a last row like the first one, or a longer period",
            )
        self.pieces: Floats = _spline(X, Y, self.period is not None) if spline else _lines(X, Y)

    @staticmethod
    def _period(
        table: TableLoad | TimeTable, X: Unknowns, given: bool, value: float
    ) -> float | None:
        span = float(X[-1] - X[0])
        if not given:
            return span if table.periodic else None
        if not value >= span * (1 - 1e-12):
            raise InputError(
                f"a period of {value:g} s is shorter than the table, {span:g} s", where="period"
            )
        return value if value > span * (1 + 1e-12) else span

    def _closed(self) -> bool:
        return bool(abs(self.Y[-1] - self.Y[0]) <= CLOSED * np.abs(self.Y).max())

    @property
    def ends(self) -> tuple[float, float] | None:
        """First and last time that it has a value for; None if it repeats."""
        if self.period is not None:
            return None
        return self.shift + float(self.X[0]), self.shift + float(self.X[-1])

    def knots(self, begin: float, end: float, most: int) -> list[float]:
        """Return the times of rows inside an interval, `most` of them at most."""
        if self.period is None:
            times = self.shift + self.X
            return list(times[(times > begin) & (times < end)][:most].tolist())
        result: list[float] = []
        turn = math.floor((begin - self.shift - self.X[0]) / self.period)
        while len(result) < most:
            times = self.shift + turn * self.period + self.X[:-1]
            if times[0] >= end:
                break
            result += times[(times > begin) & (times < end)].tolist()
            turn += 1
        return result[:most]

    def jumps(self, knot: float) -> bool:
        """Return whether the table jumps at a row."""
        if not self.steps or self.period is None:
            return False
        turn = (knot - self.shift - self.X[0]) / self.period
        return bool(abs(turn - round(turn)) * self.period < 1e-6 * np.diff(self.X).min())

    def piece(self, t: object) -> Floats:
        """Return what stands for `symbols` right behind times, (..., 6)."""
        t = np.asarray(t, float)
        size = np.maximum(np.abs(t), abs(self.shift) + np.abs(self.X).max())
        at = t - self.shift + ROUNDING * np.spacing(size)
        turned = np.zeros_like(at)
        if self.period is not None:
            turned = np.floor((at - self.X[0]) / self.period) * self.period
            at = at - turned
        row = np.clip(np.searchsorted(self.X, at, side="right") - 1, 0, len(self.X) - 2)
        return np.concatenate(
            [turned[..., None], self.X[row][..., None], self.pieces[row]], axis=-1
        )


def _lines(X: Unknowns, Y: Floats) -> Floats:
    """Return the coefficients (n - 1, 4) of straight lines."""
    none = np.zeros(len(X) - 1)
    return np.column_stack([Y[:-1], np.diff(Y) / np.diff(X), none, none])


def _spline(X: Unknowns, Y: Floats, closed: bool) -> Floats:
    """Return the coefficients (n - 1, 4) of the cubic spline.

    Closed ones go on smoothly behind their end, others have the same cubic on both sides of the
    second and of the last row but one.
    """
    h, n = np.diff(X), len(X)
    d = np.diff(Y) / h
    bend = np.zeros(n)
    if closed and n > 2:
        below, above = np.roll(h, 1), h
        right = 6 * (d - np.roll(d, 1))
        bend[:-1] = _cyclic(below, 2 * (below + above), above, right)
        bend[-1] = bend[0]
    elif n == 3:
        bend[:] = 2 * (d[1] - d[0]) / (h[0] + h[1])
    elif n > 3:
        below, middle, above = h[:-1].copy(), 2 * (h[:-1] + h[1:]), h[1:].copy()
        first, last = h[0] / h[1], h[-1] / h[-2]
        middle[0] += h[0] * (1 + first)
        above[0] -= h[0] * first
        middle[-1] += h[-1] * (1 + last)
        below[-1] -= h[-1] * last
        bend[1:-1] = _tridiagonal(below, middle, above, (6 * np.diff(d))[:, None])[:, 0]
        bend[0] = bend[1] - first * (bend[2] - bend[1])
        bend[-1] = bend[-2] + last * (bend[-2] - bend[-3])
    slopes = d - h * (2 * bend[:-1] + bend[1:]) / 6
    return np.column_stack([Y[:-1], slopes, bend[:-1] / 2, np.diff(bend) / (6 * h)])


def _tridiagonal(below: Floats, middle: Floats, above: Floats, right: Points) -> Points:
    """Return the solution of equations of three bands; the first of `below` is not used."""
    n = len(middle)
    middle, right = middle.copy(), right.copy()
    for i in range(1, n):
        share = below[i] / middle[i - 1]
        middle[i] -= share * above[i - 1]
        right[i] -= share * right[i - 1]
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            right[i] -= above[i] * right[i + 1]
        right[i] /= middle[i]
    return right


def _cyclic(below: Floats, middle: Floats, above: Floats, right: Floats) -> Any:
    """Return the solution of equations of three bands that close in a ring."""
    n = len(middle)
    if n < 4:
        full = np.diag(middle)
        for i in range(n):
            full[i, (i - 1) % n] += below[i]
            full[i, (i + 1) % n] += above[i]
        return np.linalg.solve(full, right)
    corner = -middle[0]
    bands = middle.copy()
    bands[0] -= corner
    bands[-1] -= below[0] * above[-1] / corner
    ring = np.zeros(n)
    ring[0], ring[-1] = corner, above[-1]
    one, two = _tridiagonal(below, bands, above, np.column_stack([right, ring])).T
    share = below[0] / corner
    return one - (one[0] + share * one[-1]) / (1 + two[0] + share * two[-1]) * two
