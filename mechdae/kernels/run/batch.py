"""casadi functions on arrays of poses: one row per pose.

The compiled machine does it where there is one. Else few poses go through casadi's virtual
machine and its buffers, many through a straight line of NumPy operations, which computes the same.
`Function.map` takes one column per pose, which is one C-ordered row; `Function.buffer`
holds bare pointers, so the arrays it points to live as long as the adapter. Each thread has
buffers of its own.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import numpy as np

from mechdae.kernels.machine.program import program
from mechdae.kernels.run.numpy_backend import NumpyFunction, straight
from mechdae.types import Floats, Graph, Sym

CHUNK = 512
MANY = 512
"""Poses from which the straight line of NumPy operations is faster."""


class Batch:
    """Evaluates a casadi function for many poses.

    Parameters
    ----------
    function
        casadi Function with vector inputs and outputs.
    shared
        Inputs that have one value for all poses.
    chunk
        Largest number of poses in one call of the virtual machine.
    straight
        The function's NumPy form, where somebody keeps it.
    many
        Poses from which it is used; of large functions it is faster from fewer on.
    """

    def __init__(
        self,
        function: Graph,
        shared: Sequence[int] = (),
        chunk: int = CHUNK,
        straight: Callable[[], NumpyFunction | None] | None = None,
        many: int = MANY,
    ) -> None:
        wide = [function.name_out(i) for i in range(function.n_out()) if function.size2_out(i) > 1]
        if wide:  # the compiled machine alone would take them
            raise ValueError(f"{function.name()}: outputs are columns: {', '.join(wide)}")
        self.function = function
        self.shared = set(shared)
        self.rows_in = [function.size1_in(i) for i in range(function.n_in())]
        self.rows_out = [function.size1_out(i) for i in range(function.n_out())]
        self.limit, self.many = chunk, many
        self._kept = straight
        self.lines: list[NumpyFunction | None] = []
        self._programs: list[Any] = []
        self._mapped: dict[int, Any] = {}
        self._buffers = threading.local()
        self.evaluations = 0

    def counting(self) -> Batch:
        """Return the same function with a count of its own of `evaluations`."""
        other = copy(self)
        other.evaluations = 0
        return other

    def __call__(self, *inputs: Floats | list[list[float]]) -> list[Floats]:
        """Return one (n, rows) array for each output.

        Inputs are (n, rows) arrays, shared ones (rows,).
        """
        if not self._programs:
            self._programs.append(program(self.function, sorted(self.shared)))
        found = self._programs[0]
        if found is not None:
            return self._compiled(found, inputs)
        arrays = [self._checked(i, np.asarray(value, float)) for i, value in enumerate(inputs)]
        n = next(len(a) for i, a in enumerate(arrays) if i not in self.shared)
        self.evaluations += n
        if n >= self.many and self.straight is not None:
            return self.straight(arrays)
        results = [np.empty((n, rows)) for rows in self.rows_out]
        if n == 0:
            return results
        size = min(self.limit, 1 << (n - 1).bit_length())
        buffer, trigger, staged_in, staged_out = self._chunk(size)
        for i in self.shared:
            staged_in[i][:] = arrays[i]
        for start in range(0, n, size):
            count = min(size, n - start)
            for i, array in enumerate(arrays):
                if i not in self.shared:
                    staged_in[i][:count] = array[start : start + count]
            trigger()
            for staged, result in zip(staged_out, results, strict=True):
                result[start : start + count] = staged[:count]
        if buffer.ret():
            raise RuntimeError(f"casadi could not evaluate {self.function.name()}")
        return results

    def _compiled(self, found: Any, inputs: tuple[Floats | list[list[float]], ...]) -> list[Floats]:
        try:
            results: list[Floats] = found.many(*inputs)
        except (TypeError, ValueError):
            arrays = [self._checked(i, np.asarray(value, float)) for i, value in enumerate(inputs)]
            results = found.many(*arrays)
        self.evaluations += len(results[0]) if results else 0
        return results

    @property
    def straight(self) -> NumpyFunction | None:
        """The NumPy form of the function, None where there is none; copies share it."""
        if self._kept is not None:
            return self._kept()
        if not self.lines:
            self.lines.append(straight(self.function, sorted(self.shared)))
        return self.lines[0]

    def _checked(self, i: int, array: Floats) -> Floats:
        shape = (self.rows_in[i],)
        if (array.shape if i in self.shared else array.shape[1:]) != shape:
            name = self.function.name_in(i)
            raise ValueError(f"input {name} has rows of shape {array.shape}, not {shape}")
        return array

    def _chunk(self, size: int) -> tuple[Sym, Any, list[Floats], list[Floats]]:
        """Return buffer, trigger and staged arrays of this thread for `size` poses."""
        buffers: dict[Any, Any] = self._buffers.__dict__
        if size not in buffers:
            mapped = self._mapped.get(size)
            if mapped is None:
                mapped = self.function.map(size) if size > 1 else self.function
                self._mapped[size] = mapped
            buffer, trigger = mapped.buffer()
            staged_in: list[Any] = [np.zeros((size, rows)) for rows in self.rows_in]
            staged_out: list[Any] = [np.zeros((size, rows)) for rows in self.rows_out]
            for i, array in enumerate(staged_in):
                if array.size:
                    buffer.set_arg(i, memoryview(array))
            for i, array in enumerate(staged_out):
                if array.size:
                    buffer.set_res(i, memoryview(array))
            buffers[size] = (buffer, trigger, staged_in, staged_out)
        found: tuple[Sym, Any, list[Floats], list[Floats]] = buffers[size]
        return found
