"""casadi functions: built with nothing computed twice, called for one pose, a chain, many poses.

The compiled machine evaluates them where there is one. Else one pose, a chain of steps and few
poses go through casadi's virtual machine and its buffers, many through a straight line of NumPy
operations, which computes the same. `Function.map` takes one column per pose, which is one
C-ordered row; `Function.buffer` holds bare pointers, so the arrays it points to live as long as
the adapter. Each thread has buffers of its own.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Sequence
from copy import copy
from functools import cached_property
from typing import Any, Self
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from mechdae.equations.reduction import Scene
from mechdae.kernels.machine.library import library
from mechdae.kernels.run.numpy_backend import NumpyFunction, straight
from mechdae.types import Floats, Graph, Matrix, Sym, Unknowns


def without_repeats(name: str, inputs: Sequence[Sym], results: Sequence[Sym]) -> Graph:
    """Return the casadi function of `inputs` that gives `results`, nothing computed twice.

    casadi's ``cse`` takes two symbols of one name for the same symbol, and then the numbers are
    wrong without a word (seen in casadi 3.7): inputs with such names get new ones.
    """
    symbols: list[Sym] = list(inputs)
    if isinstance(next(iter(symbols), None), ca.SX):
        names = [symbol.name() for part in symbols for symbol in part.nonzeros()]
        if len(set(names)) < len(names):
            plain = ca.Function(name, symbols, list(results))
            symbols = [ca.SX.sym(f"i{k}", part.sparsity()) for k, part in enumerate(symbols)]
            results = plain.call(symbols)
    return ca.Function(name, symbols, list(results), {"cse": True})


_PROGRAMS: WeakKeyDictionary[Any, dict[tuple[int, ...], Any]] = WeakKeyDictionary()
"""Programs of functions that are still in use."""


def program(function: Graph, shared: Sequence[int] = ()) -> Any:
    """Return the program of a function with dense vectors, None where there is none.

    Parameters
    ----------
    function
        casadi Function.
    shared
        Inputs that have one value for all poses of `many`.
    """
    machine = library()
    if machine is None:
        return None
    from mechdae.kernels.machine.program import compiled

    known = _PROGRAMS.setdefault(function, {})
    key = tuple(sorted(shared))
    if key not in known:
        known[key] = compiled(machine, function, key)
    return known[key]


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

    def __call__(self, *inputs: object) -> list[Floats]:
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

    def _interpreted(self, inputs: tuple[object, ...]) -> list[Floats]:
        """Return the same by casadi's virtual machine; each thread has buffers of its own."""
        try:
            buffers = self._threads.buffers
        except AttributeError:
            buffers = self._threads.buffers = _Buffers.of_pose(self.function)
        for array, value in zip(buffers.inputs, inputs, strict=True):
            array[:] = value
        buffers.run()
        return [(a[:, 0] if a.shape[1] == 1 else a).copy() for a in buffers.outputs]


class _Buffers:
    """Arrays of one thread; `Function.buffer` holds bare pointers to them."""

    def __init__(self, function: Graph, inputs: list[Any], outputs: Sequence[Matrix]) -> None:
        self.name, (self.buffer, self._trigger) = function.name(), function.buffer()
        self.inputs, self.outputs = inputs, outputs
        for arrays, put in ((inputs, self.buffer.set_arg), (outputs, self.buffer.set_res)):
            for i, array in enumerate(arrays):
                if array.size:
                    put(i, memoryview(array.reshape(-1, order="A")))

    def run(self) -> None:
        self._trigger()
        if self.buffer.ret():
            raise RuntimeError(f"casadi could not evaluate {self.name}")

    @classmethod
    def of_pose(cls, function: Graph) -> Self:
        inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        outputs = [np.zeros(function.size_out(i), order="F") for i in range(function.n_out())]
        return cls(function, inputs, outputs)


class Local:
    """A dense expression over (x, u, p) of a scene as a function of one pose.

    It is one of the few entries that the expression holds: a call costs what the expression
    costs, however large the scene around it is.
    """

    def __init__(self, scene: Scene, expression: Sym) -> None:
        self.held: tuple[list[int], list[int], list[int]] = scene.held(expression)
        vectors = (scene.x, scene.u, scene.model.p)
        inputs = [v[i] if i else ca.SX(0, 1) for v, i in zip(vectors, self.held, strict=True)]
        self.function: Graph = ca.Function("local", inputs, [ca.densify(expression)])
        self._call, self._shape = Call(self.function), self.function.size_out(0)

    def __call__(self, x: Unknowns, u: Floats, p: Floats) -> Floats:
        """Return the value as an array of the expression's shape."""
        vectors = (x, u, p)
        value = self._call(*[v[i] for v, i in zip(vectors, self.held, strict=True)])[0]
        return value.reshape(self._shape)


def local(scene: Scene, key: Hashable, make: Callable[[], Sym]) -> Local:
    """Return the function of the expression over q that `make` gives; made once for a scene."""
    return scene.cache(("local", key), lambda: Local(scene, scene.expression(make())))


class StepChain:
    """Calls ``advance(state, [s, ds], consts)`` many times, each from the state before."""

    def __init__(self, advance: Graph, count: int) -> None:
        self.advance: Graph = advance
        self.count: int = count
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
        self, state: Floats, s: Floats, ds: object, consts: Floats, count: int
    ) -> list[Floats]:
        """Return the same by casadi's virtual machine; each thread has buffers of its own."""
        try:
            buffers = self._threads.buffers
        except AttributeError:
            shapes = (
                self.advance.size1_in(0),
                (self.count, 2),
                (self.count, self.advance.size1_in(2)),
            )
            results = [np.zeros((self.count, rows)) for rows in self._rows]
            buffers = _Buffers(self.function, [np.zeros(shape) for shape in shapes], results)
            self._threads.buffers = buffers
        into, steps, numbers = buffers.inputs
        into[:], numbers[:] = state, consts
        steps[:count, 0], steps[count:, 1] = s, 0.0
        steps[:count, 1] = ds
        buffers.run()
        return [result.copy() for result in buffers.outputs]


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
        self.shared: set[int] = set(shared)
        self.rows_in: list[int] = [function.size1_in(i) for i in range(function.n_in())]
        self.rows_out: list[int] = [function.size1_out(i) for i in range(function.n_out())]
        self.limit: int = chunk
        self.many: int = many
        self._kept = straight
        self.lines: list[NumpyFunction | None] = []
        self._programs: list[Any] = []
        self._mapped: dict[int, Any] = {}
        self._buffers = threading.local()
        self.evaluations: int = 0

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
        buffers = self._chunk(size)
        for i in self.shared:
            buffers.inputs[i][:] = arrays[i]
        for start in range(0, n, size):
            count = min(size, n - start)
            for i, array in enumerate(arrays):
                if i not in self.shared:
                    buffers.inputs[i][:count] = array[start : start + count]
            buffers.run()
            for staged, result in zip(buffers.outputs, results, strict=True):
                result[start : start + count] = staged[:count]
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

    def _chunk(self, size: int) -> _Buffers:
        """Return the buffers of this thread for `size` poses."""
        buffers: dict[Any, _Buffers] = self._buffers.__dict__
        if size not in buffers:
            mapped = self._mapped.get(size)
            if mapped is None:
                mapped = self.function.map(size) if size > 1 else self.function
                self._mapped[size] = mapped
            rows = self.rows_in, self.rows_out
            buffers[size] = _Buffers(
                mapped, *([np.zeros((size, r)) for r in part] for part in rows)
            )
        return buffers[size]
