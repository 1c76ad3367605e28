"""One evaluation of a casadi function through its buffer: a few microseconds a call."""

from __future__ import annotations

from typing import Any

import numpy as np


class Call:
    """Evaluates a casadi function with dense inputs and outputs for one set of values.

    `Function.buffer` holds bare pointers, so the arrays live as long as this object.
    """

    def __init__(self, function: Any) -> None:
        self.function = function
        self._buffer, self._trigger = function.buffer()
        self._inputs: list[Any] = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs: list[Any] = [
            np.zeros(function.size_out(i), order="F") for i in range(function.n_out())
        ]
        for i, array in enumerate(self._inputs):
            if array.size:
                self._buffer.set_arg(i, memoryview(array))
        for i, array in enumerate(self._outputs):
            if array.size:
                self._buffer.set_res(i, memoryview(array.reshape(-1, order="F")))
        self._views = [array[:, 0] if array.shape[1] == 1 else array for array in self._outputs]

    def __call__(self, *inputs: Any) -> list[Any]:
        """Return the outputs, columns as (n,) arrays, for inputs given as vectors."""
        for array, value in zip(self._inputs, inputs, strict=True):
            array[:] = value
        self._trigger()
        if self._buffer.ret():
            raise RuntimeError(f"casadi could not evaluate {self.function.name()}")
        return [view.copy() for view in self._views]
