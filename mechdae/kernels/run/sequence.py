"""A chain of equal steps in one call: of the compiled machine, else `mapaccum` through a buffer."""

from __future__ import annotations

import threading
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.kernels.machine.program import program
from mechdae.types import Floats, Graph


class Sequence:
    """Calls ``advance(state, [s, ds], consts)`` many times, each from the state before."""

    def __init__(self, advance: Graph, count: int) -> None:
        self.advance, self.count = advance, count
        self._threads = threading.local()

    @cached_property
    def function(self) -> Graph:
        """All steps as a casadi function."""
        return self.advance.mapaccum("advances", self.count)

    @cached_property
    def _program(self) -> Any:
        return program(self.advance)

    @cached_property
    def _rows(self) -> list[int]:
        return [self.advance.size1_out(i) for i in range(self.advance.n_out())]

    def __call__(
        self, state: Floats, s: Any, ds: Floats | float, consts: Floats, count: int | None = None
    ) -> list[Floats]:
        """Return states, tests, determinants and misses after each step, (n, .).

        `s`, `ds` and `consts` are the same for all steps or have one row for each. There are as
        many steps as `count` says, by default all.
        """
        count = count or self.count
        if self._program is None:
            return [part[:count] for part in self._interpreted(state, s, ds, consts, count)]
        steps = np.empty((count, 2))
        steps[:, 0], steps[:, 1] = s, ds
        results = [np.empty((count, rows)) for rows in self._rows]
        given = [np.ascontiguousarray(value, float) for value in (state, steps, consts)]
        self._program.chain(count, *given, *results)
        return results

    def _interpreted(
        self, state: Floats, s: Floats, ds: Any, consts: Floats, count: int
    ) -> list[Floats]:
        """Return the same by casadi's virtual machine; each thread has buffers of its own."""
        try:
            buffers = self._threads.buffers
        except AttributeError:
            buffers = self._threads.buffers = _Buffers(self.function, self.count)
        buffers.state[:] = state
        buffers.steps[:count, 0], buffers.steps[count:, 1] = s, 0.0
        buffers.steps[:count, 1] = ds
        buffers.consts[:] = consts
        buffers.trigger()
        return [result.copy() for result in buffers.results]


class _Buffers:
    """Arrays of one thread; `Function.buffer` holds bare pointers to them."""

    def __init__(self, function: Graph, count: int) -> None:
        self.buffer, self.trigger = function.buffer()
        self.state = np.zeros(function.size1_in(0))
        self.steps = np.zeros((count, 2))
        self.consts = np.zeros((count, function.size1_in(2)))
        self.results: list[Any] = [
            np.zeros((count, function.size1_out(i))) for i in range(function.n_out())
        ]
        inputs: list[Any] = [self.state, self.steps, self.consts]
        for i, array in enumerate(inputs):
            self.buffer.set_arg(i, memoryview(array))
        for i, array in enumerate(self.results):
            self.buffer.set_res(i, memoryview(array))
