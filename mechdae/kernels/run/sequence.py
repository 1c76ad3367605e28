"""A chain of equal steps in one call: `mapaccum` through a buffer."""

from __future__ import annotations

from typing import Any

import numpy as np


class Sequence:
    """Calls ``advance(state, [s, ds], consts)`` many times, each from the state before."""

    def __init__(self, advance: Any, count: int) -> None:
        function = advance.mapaccum("advances", count)
        self.buffer, self.trigger = function.buffer()
        self.state = np.zeros(advance.size1_in(0))
        self.steps = np.zeros((count, 2))
        self.consts = np.zeros((count, advance.size1_in(2)))
        self.results: list[Any] = [
            np.zeros((count, advance.size1_out(i))) for i in range(advance.n_out())
        ]
        inputs: list[Any] = [self.state, self.steps, self.consts]
        for i, array in enumerate(inputs):
            self.buffer.set_arg(i, memoryview(array))
        for i, array in enumerate(self.results):
            self.buffer.set_res(i, memoryview(array))

    def __call__(self, state: Any, s: Any, ds: Any, consts: Any) -> list[Any]:
        """Return states, tests, determinants and misses after each step, (count, .).

        `s`, `ds` and `consts` are the same for all steps or have one row for each.
        """
        self.state[:] = state
        self.steps[:, 0], self.steps[:, 1] = s, ds
        self.consts[:] = consts
        self.trigger()
        return [result.copy() for result in self.results]
