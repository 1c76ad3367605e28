"""One evaluation of a casadi function: about a microsecond a call, a few without the machine."""

from __future__ import annotations

import threading
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.kernels.machine.program import program
from mechdae.types import Floats, Graph


class Call:
    """Evaluates a casadi function with dense inputs and outputs for one set of values."""

    def __init__(self, function: Graph) -> None:
        self.function = function
        self._threads = threading.local()

    @cached_property
    def _program(self) -> Any:
        return program(self.function)

    @cached_property
    def _matrices(self) -> list[tuple[int, tuple[int, int]]]:
        """Outputs of several columns, with their shapes."""
        shapes = [self.function.size_out(i) for i in range(self.function.n_out())]
        return [(i, shape) for i, shape in enumerate(shapes) if shape[1] != 1]

    def __call__(self, *inputs: Any) -> list[Floats]:
        """Return the outputs, columns as (n,) arrays, for inputs given as vectors."""
        if self._program is None:
            return self._interpreted(inputs)
        try:
            results: list[Floats] = self._program.one(*inputs)
        except TypeError:
            results = self._program.one(*[np.asarray(value, float) for value in inputs])
        for i, shape in self._matrices:
            results[i] = results[i].reshape(shape, order="F")
        return results

    def _interpreted(self, inputs: tuple[Any, ...]) -> list[Floats]:
        """Return the same by casadi's virtual machine; each thread has buffers of its own."""
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

    def __init__(self, function: Graph) -> None:
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
