"""One evaluation of a casadi function through its buffer: a few microseconds a call."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np


class Call:
    """Evaluates a casadi function with dense inputs and outputs for one set of values.

    Each thread has buffers of its own.
    """

    def __init__(self, function: Any) -> None:
        self.function = function
        self._threads = threading.local()

    def __call__(self, *inputs: Any) -> list[Any]:
        """Return the outputs, columns as (n,) arrays, for inputs given as vectors."""
        try:
            buffers = self._threads.buffers
        except AttributeError:
            buffers = self._threads.buffers = _Buffers(self.function)
        for array, value in zip(buffers.inputs, inputs, strict=True):
            array[:] = value
        buffers.trigger()
        if buffers.buffer.ret():
            raise RuntimeError(f"casadi could not evaluate {self.function.name()}")
        return [view.copy() for view in buffers.views]


class _Buffers:
    """Arrays of one thread; `Function.buffer` holds bare pointers to them."""

    def __init__(self, function: Any) -> None:
        self.buffer, self.trigger = function.buffer()
        self.inputs: list[Any] = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self.outputs: list[Any] = [
            np.zeros(function.size_out(i), order="F") for i in range(function.n_out())
        ]
        for i, array in enumerate(self.inputs):
            if array.size:
                self.buffer.set_arg(i, memoryview(array))
        for i, array in enumerate(self.outputs):
            if array.size:
                self.buffer.set_res(i, memoryview(array.reshape(-1, order="F")))
        self.views = [array[:, 0] if array.shape[1] == 1 else array for array in self.outputs]
