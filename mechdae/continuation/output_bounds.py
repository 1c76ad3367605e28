"""From bounds on the unknowns to bounds on points and body angles."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.setup.outputs import Outputs
from mechdae.setup.scales import Constants


def output_bounds(
    graphs: Graphs, outputs: Outputs, constants: Constants, error: Any
) -> dict[str, Any]:
    """Return ``length`` (n,) [m] over the points and ``angle`` (n,) [rad] over the bodies.

    `error` (n, nx) are the bounds of the unknowns. |dy/dx| is bounded for all poses at once; half
    a unit in the last place of the driver's value does not count, the bound is for the float64
    data given.
    """
    bounds = OutputBounds(graphs, outputs, constants)
    result = {}
    turns = [e for e in outputs.entries if e.is_output and e.unit == "rad"]
    lengths = [e for e in outputs.entries if e.unit == "m"]
    for word, entries in (("length", lengths), ("angle", turns)):
        columns = [i for entry in entries for i in entry.columns]
        if columns:
            result[word] = bounds.largest(error, columns)
    return result


class OutputBounds:
    """Bounds on outputs from those on the unknowns, by |dy/dx| bounded for a whole path."""

    def __init__(self, graphs: Graphs, outputs: Outputs, constants: Constants) -> None:
        sizes = (constants.size_x, constants.size_u, constants.p, constants.floors)
        if graphs.contacts:
            slope, rounding = graphs.output_bounds(*sizes, *constants.boxes)
            count = constants.boxes[0].shape[1]
            self.rounding = np.array(rounding).reshape(graphs.ny, count).max(axis=1)
            (rows, columns), values = slope.sparsity().get_triplet(), slope.nonzeros()
        else:
            rows, columns, call = graphs.output_slopes
            values, self.rounding = call(*sizes, *(part.ravel() for part in constants.boxes))
        self.rows = _rows(rows, columns, values, graphs.ny, graphs.nx)

    def largest(self, error: Any, columns: list[int]) -> Any:
        """Return the largest bound of some columns at each pose, (n,); `error` is (n, nx)."""
        error = np.nan_to_num(error, nan=0.0)
        worst = _worst(error, [self.rows[i] for i in columns])
        return worst + float(self.rounding[columns].max(initial=0.0))


Row = tuple[tuple[int, ...], tuple[float, ...]]
"""The columns and values of a sparse row."""


def _rows(rows: Any, columns: Any, values: Any, count: int, width: int) -> list[Row]:
    """Return the rows of a sparse matrix; the largest entries of several side by side."""
    entries: list[dict[int, float]] = [{} for _ in range(count)]
    for i, j, value in zip(rows, columns, np.asarray(values).tolist(), strict=True):
        column = j % width
        entries[i][column] = max(value, entries[i].get(column, 0.0))
    return [(tuple(row), tuple(row.values())) for row in entries]


def _worst(error: Any, rows: list[Row]) -> Any:
    """Return the largest product of a row with each pose's errors, (n,)."""
    values: dict[tuple[int, ...], dict[tuple[float, ...], None]] = {}
    for columns, row in rows:
        values.setdefault(columns, {})[row] = None
    worst = np.zeros(len(error))
    for columns, distinct in values.items():
        if columns:
            products = error[:, columns] @ np.array(list(distinct)).T
            np.maximum(worst, products.max(axis=1), out=worst)
    return worst
