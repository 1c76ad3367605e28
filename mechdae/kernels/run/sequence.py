"""A chain of equal steps in one call: `mapaccum` through a buffer."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np


class Sequence:
    """Calls ``advance(state, [s, ds], consts)`` many times, each from the state before.

    Each thread has buffers of its own.
    """

    def __init__(self, advance: Any, count: int) -> None:
        self.function, self.count = advance.mapaccum("advances", count), count
        self._threads = threading.local()

    def __call__(self, state: Any, s: Any, ds: Any, consts: Any) -> list[Any]:
        """Return states, tests, determinants and misses after each step, (count, .).

        `s`, `ds` and `consts` are the same for all steps or have one row for each.
        """
        try:
            buffers = self._threads.buffers
        except AttributeError:
            buffers = self._threads.buffers = _Buffers(self.function, self.count)
        buffers.state[:] = state
        buffers.steps[:, 0], buffers.steps[:, 1] = s, ds
        buffers.consts[:] = consts
        buffers.trigger()
        return [result.copy() for result in buffers.results]


class _Buffers:
    """Arrays of one thread; `Function.buffer` holds bare pointers to them."""

    def __init__(self, function: Any, count: int) -> None:
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
