"""A casadi SX function as a straight line of NumPy operations over chunks of poses.

The instruction list is read once; scalars that all poses share are computed once a call.
Operation by operation the results are those of casadi's own virtual machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import LOGIC, NAMES

CACHE_BYTES = 4_000_000
"""Size of the buffers of a chunk: a call of NumPy costs as much as some 1500 numbers."""
SMALLEST_CHUNK = 512


def into(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with the argument ``out`` of a NumPy operation."""

    def write(*arguments: Any, out: Any) -> None:
        out[...] = function(*arguments)

    return write


_UFUNCS: dict[int, Any] = {
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SQ: np.square,
    ca.OP_INV: np.reciprocal,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_ASSIGN: np.positive,
    **{code: getattr(np, names[1]) for code, names in NAMES.items()},
}
_VALUES = {**_UFUNCS, **{code: pair[1] for code, pair in LOGIC.items()}}
"""Operations that return their result."""
_WRITERS = {**_UFUNCS, **{code: into(pair[1]) for code, pair in LOGIC.items()}}
"""Operations that write it where they are told to."""


class NumpyFunction:
    """Evaluates an SX function with dense vector inputs and outputs for many poses.

    Parameters
    ----------
    function
        The function.
    shared
        Inputs that have one value for all poses.
    """

    def __init__(self, function: Any, shared: Sequence[int] = ()) -> None:
        self.function, self.shared = function, set(shared)
        self._once: list[tuple[Any, ...]] = []
        self._line: list[tuple[Any, ...]] = []
        self.registers = 0
        self._spare: list[Any] = []
        """Buffers between two calls: fresh memory is slow at its first touch."""
        self._read()
        self.chunk = max(SMALLEST_CHUNK, CACHE_BYTES // (8 * max(self.registers, 1)))

    @staticmethod
    def supports(function: Any) -> bool:
        """Return whether every operation of the function has a NumPy form."""
        known = {*_VALUES, ca.OP_TWICE, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
        codes = range(function.n_instructions())
        return function.is_a("SXFunction") and all(
            function.instruction_id(k) in known for k in codes
        )

    def _read(self) -> None:
        """Turn the instructions into steps over numbered values, and the values into buffers.

        Steps are put in the order of the highest entry of the first input that they need:
        what belongs to one block of a chain is computed together, and its buffers are free
        for the next. Scalars that all poses share are computed once and live apart.
        """
        f = self.function
        place: dict[int, tuple[str, Any]] = {}  # register -> where its value is now
        highest: list[int] = []
        steps: list[tuple[Any, list[tuple[str, Any]], Any]] = []
        scalars = 0
        for k in range(f.n_instructions()):
            code = f.instruction_id(k)
            into, out_of = f.instruction_output(k), f.instruction_input(k)
            if code == ca.OP_INPUT:
                kind = "shared" if out_of[0] in self.shared else "input"
                place[into[0]] = (kind, (out_of[0], out_of[1]))
                continue
            if code == ca.OP_CONST:
                place[into[0]] = ("constant", f.instruction_constant(k))
                continue
            sources = [place[i] for i in out_of]
            need, shared = -1, code != ca.OP_OUTPUT
            for kind, what in sources:
                if kind == "buffer":
                    shared, need = False, max(need, highest[what])
                elif kind == "input":
                    shared, need = False, max(need, what[1] if what[0] == 0 else -1)
            if code == ca.OP_TWICE:
                code, sources = ca.OP_ADD, [sources[0], sources[0]]
            if shared:
                place[into[0]] = ("scalar", scalars)
                self._once.append((_VALUES[code], sources, scalars))
                scalars += 1
                continue
            if code == ca.OP_OUTPUT:
                steps.append((None, sources, tuple(into)))
            else:
                place[into[0]] = ("buffer", len(steps))
                steps.append((_WRITERS[code], sources, None))
            highest.append(need)
        self._scalars = scalars
        self._allocate(steps, sorted(range(len(steps)), key=highest.__getitem__))

    def _allocate(self, steps: list[tuple[Any, list[tuple[str, Any]], Any]], order: Any) -> None:
        """Give each value a place: the result it is, else a buffer until its last use."""
        last = {what: k for k in order for kind, what in steps[k][1] if kind == "buffer"}
        home: dict[int, tuple[str, Any]] = {}
        free: list[int] = []
        for k in reversed(order):
            ufunc, sources, output = steps[k]
            if ufunc is None and sources[0][0] == "buffer":
                home[sources[0][1]] = ("result", output)
        line: list[tuple[Any, list[tuple[str, Any]], tuple[str, Any]]] = []
        for k in order:
            ufunc, sources, output = steps[k]
            given = [home[what] if kind == "buffer" else (kind, what) for kind, what in sources]
            for kind, what in sources:
                if kind == "buffer" and last[what] == k and home.get(what, ("",))[0] == "buffer":
                    free.append(home.pop(what)[1])
            if ufunc is None:
                if given[0] != ("result", output):
                    line.append((np.positive, given, ("result", output)))
                continue
            target = home.get(k)
            if target is None:
                if not free:
                    free.append(self.registers)
                    self.registers += 1
                target = ("buffer", free.pop())
                if k in last:
                    home[k] = target
                else:
                    free.append(target[1])
            line.append((ufunc, given, target))
        self._number(line)

    def _number(self, line: list[tuple[Any, list[tuple[str, Any]], tuple[str, Any]]]) -> None:
        """Number the arrays and scalars that the steps use: buffers first, then `others`."""
        number: dict[Any, int] = {("buffer", k): k for k in range(self.registers)}
        self._others: list[tuple[str, Any]] = []

        def key(place: tuple[str, Any]) -> tuple[str, Any]:
            return (place[0], repr(place[1])) if place[0] == "constant" else place

        for _, given, target in line:
            for place in (*given, target):
                if key(place) not in number:
                    number[key(place)] = len(number)
                    self._others.append(place)
        for ufunc, given, target in line:
            second = number[key(given[1])] if len(given) == 2 else -1
            self._line.append((ufunc, number[key(given[0])], second, number[target]))

    def __call__(self, inputs: Sequence[Any]) -> list[Any]:
        """Return one (n, rows) array per output for (n, rows) inputs, shared ones (rows,)."""
        n = next(len(a) for i, a in enumerate(inputs) if i not in self.shared)
        columns = [
            a if i in self.shared else np.ascontiguousarray(np.asarray(a).T)
            for i, a in enumerate(inputs)
        ]
        results = [np.empty((self.function.size1_out(i), n)) for i in range(self.function.n_out())]
        scalar: list[Any] = [None] * self._scalars
        size = min(self.chunk, n)
        try:
            work = self._spare.pop()  # another thread may have taken it
        except IndexError:
            work = np.empty((self.registers, size))
        if work.shape[1] < size:
            work = np.empty((self.registers, size))

        def value(place: tuple[str, Any], a: int = 0, b: int = 0) -> Any:
            kind, what = place
            if kind == "input":
                return columns[what[0]][what[1], a:b]
            if kind == "result":
                return results[what[0]][what[1], a:b]
            if kind == "scalar":
                return scalar[what]
            return columns[what[0]][what[1]] if kind == "shared" else what

        with np.errstate(all="ignore"):
            for ufunc, sources, target in self._once:
                scalar[target] = ufunc(*[np.float64(value(place)) for place in sources])
            for a in range(0, n, self.chunk):
                b = min(a + self.chunk, n)
                at = [row[: b - a] for row in work]
                at += [value(place, a, b) for place in self._others]
                for ufunc, i, j, k in self._line:
                    if j < 0:
                        ufunc(at[i], out=at[k])
                    else:
                        ufunc(at[i], at[j], out=at[k])
        self._spare = [work]
        return [result.T for result in results]


def straight(function: Any, shared: Sequence[int] = ()) -> NumpyFunction | None:
    """Return the NumPy form of a function, None where there is none."""
    return NumpyFunction(function, shared) if NumpyFunction.supports(function) else None
