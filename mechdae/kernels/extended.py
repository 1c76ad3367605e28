"""Values of casadi functions in 80-bit floats, where the machine has them.

The graph is walked instruction by instruction with ``numpy.longdouble``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.kernels.replay import ARRAYS, replay

LONG = np.longdouble


def evaluate(function: Any, inputs: list[Any]) -> Any:
    """Return the first output (n, rows) for inputs (n, columns) of any float type."""
    dtype = np.result_type(*inputs)
    columns = [list(np.asarray(value).T) for value in inputs]
    rows = replay(function, columns, lambda code, args: ARRAYS[code](*args), dtype.type)[0]
    return np.stack([np.broadcast_to(row, len(inputs[0])) for row in rows], axis=1)
