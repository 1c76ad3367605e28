"""PoseColumns of numbers at many poses: equal ones are kept once, constant ones as one number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.kernels.run.numpy_backend import Place, PoseLine
from mechdae.types import Floats, Integers, Matrix

NOWHERE = -1


class PoseTable:
    """PoseColumns (n,) at poses, each a row of a `store` or an array of its own.

    Parameters
    ----------
    store : (r, n) array
    rows
        The row of each column; several may have the same.
    others
        The arrays of columns that are in no row.
    """

    def __init__(self, store: Floats, rows: Sequence[int], others: Mapping[int, Floats]) -> None:
        self.store, self.rows, self.others = store, list(rows), dict(others)

    def column(self, i: int) -> Floats:
        """Return a column, a view."""
        return self.store[self.rows[i]] if self.rows[i] >= 0 else self.others[i]

    def columns(self, chosen: Sequence[int]) -> Matrix:
        """Return some columns as an (n, k) array: a view where they lie one after another."""
        rows = [self.rows[i] for i in chosen]
        n = self.store.shape[1]
        if not rows:
            return np.empty((n, 0))
        if rows[0] >= 0 and rows == list(range(rows[0], rows[0] + len(rows))):
            return self.store[rows[0] : rows[0] + len(rows)].T
        arrays = [self.column(i) for i in chosen]
        if all(not array.strides[0] for array in arrays):
            return np.broadcast_to(np.array([array[0] for array in arrays]), (n, len(arrays)))
        return np.stack(arrays, axis=1)

    def write(self, poses: Integers, values: Floats) -> None:
        """Write values (k, columns) at some poses (k,).

        PoseColumns that are not one any more get a place of their own.
        """
        writer: dict[int, int] = {}
        for i, row in enumerate(self.rows):
            if row < 0:
                continue
            first = writer.setdefault(row, i)
            if not np.array_equal(values[:, i], values[:, first], equal_nan=True):
                self.rows[i], self.others[i] = NOWHERE, self.store[row].copy()
        for i, row in enumerate(self.rows):
            if writer.get(row) == i:
                self.store[row, poses] = values[:, i]
            elif row < 0 and not np.array_equal(self.others[i][poses], values[:, i], True):
                self.others[i] = self.others[i].copy()
                self.others[i][poses] = values[:, i]


class PoseColumns:
    """Some neighbours of a table, read by rows and columns like an (n, m) array."""

    def __init__(self, table: PoseTable, first: int, count: int) -> None:
        self.table, self._own = table, range(first, first + count)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self), len(self._own)

    def __len__(self) -> int:
        return int(self.table.store.shape[1])

    def __getitem__(self, key: tuple[slice, Any]) -> Floats:
        rows, columns = key
        if isinstance(columns, int | np.integer):
            return self.table.column(self._own[columns])[rows]
        if isinstance(columns, slice):
            return self.table.columns(self._own[columns])[rows]
        return self.table.columns([self._own[i] for i in columns])[rows]

    def __array__(self, dtype: object = None, copy: object = None) -> Floats:
        return self.table.columns(self._own)


class StoreLayout:
    """Which values of a kernel are kept at many poses, each once.

    Parameters
    ----------
    line
        The kernel.
    kept
        (output, order, groups): outputs that are kept, the order of the derivatives they are, and
        their rows in groups that are read together.
    timed
        Whether derivatives are by a driver and become rates in time: then those of different
        orders are not the same where the kernel has them as one.
    """

    def __init__(
        self,
        line: PoseLine,
        kept: Sequence[tuple[int, int, Sequence[Sequence[int]]]],
        timed: bool,
    ) -> None:
        self.line, self.timed = line, timed
        self.sources: list[tuple[int, Place]] = []
        """(order, place) of what each row of the store holds."""
        self.columns: list[tuple[int, Place | None, int]] = []
        """(order, place, row) of each column; no row of what is no number pose by pose."""
        known: dict[tuple[int, Place], int] = {}
        self.spans: list[tuple[int, int]] = []
        for output, order, groups in kept:
            count = sum(map(len, groups))
            rows: list[int] = [NOWHERE] * count
            for group in groups:
                self._put(known, output, order if timed else 0, group, rows)
            self.spans.append((len(self.columns), count))
            places = [line.places.get((output, i)) for i in range(count)]
            self.columns += [(order, p, r) for p, r in zip(places, rows, strict=True)]
        target: dict[tuple[int, int], int] = {}
        for row, (_, (kind, what)) in enumerate(self.sources):
            if kind == "result":
                target.setdefault(what, row)
        self.target = target
        """The row into which the kernel writes each result that is kept."""
        rated = [(order, row) for row, (order, _) in enumerate(self.sources) if order]
        self.rated: list[tuple[int, int]] = sorted(rated, reverse=True)

    def _put(
        self, known: Any, output: int, order: int, group: Sequence[int], rows: list[int]
    ) -> None:
        """Give a group of columns rows one after another, where one is new."""
        keys = [(order, self.line.places.get((output, i))) for i in group]
        moving = [self._moves(*key) for key in keys]
        fresh = any(m and key not in known for m, key in zip(moving, keys, strict=True))
        for i, key, moves in zip(group, keys, moving, strict=True):
            if moves and key in known:
                rows[i] = known[key]
            elif (moves or (fresh and any(moving))) and key[1] is not None:
                rows[i] = len(self.sources)
                self.sources.append((order, key[1]))
                if moves:
                    known[key] = rows[i]

    def _moves(self, order: int, place: Place | None) -> bool:
        """Return whether a value differs from pose to pose and is not an input as it is."""
        kind = place[0] if place is not None else ""
        return kind == "result" or (kind == "input" and order > 0)

    def table(
        self, n: int, inputs: Sequence[Floats], scalars: list[float], speed: float
    ) -> PoseTable:
        """Return a table of n poses, what does not come from the kernel's results filled in.

        `inputs` are those of the kernel for all poses, (rows, n); that of order 0 is not read.
        """
        store, others = np.empty((len(self.sources), n)), {}

        def constant(order: int, kind: str, what: Any) -> Any:
            value = scalars[what] if kind == "scalar" else what
            value = inputs[what[0]][what[1]] if kind == "shared" else value
            return value * self.factor(order, speed) + 0.0 if order and self.timed else value

        for row, (order, (kind, what)) in enumerate(self.sources):
            if kind not in ("result", "input"):
                store[row] = constant(order, kind, what)
        for i, (order, place, row) in enumerate(self.columns):
            if row >= 0:
                continue
            if place is None:
                others[i] = np.broadcast_to(np.nan, n)
            elif place[0] == "input":
                others[i] = inputs[place[1][0]][place[1][1]]
            else:
                others[i] = np.broadcast_to(constant(order, *place), n)
        return PoseTable(store, [row for _, _, row in self.columns], others)

    def factor(self, order: int, speed: float) -> float:
        """Return what a derivative of an order is multiplied by."""
        return (1.0, speed, speed * speed, speed * speed * speed)[order]

    def rates(self, store: Floats, inputs: Sequence[Floats], speed: float) -> None:
        """Turn the derivatives of a block into rates in time, highest order first."""
        for order, row in self.rated:
            kind, what = self.sources[row][1]
            if kind == "result":
                source = store[self.target[what]]
            elif kind == "input":
                source = inputs[what[0]][what[1]]
            else:
                continue
            np.multiply(source, self.factor(order, speed), out=store[row])
