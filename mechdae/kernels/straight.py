"""A casadi SX function as a straight line of NumPy operations over chunks of poses.

The instruction list is read once; scalars that all poses share are computed once a call.
Operation by operation the results are those of casadi's own virtual machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.replay import LOGIC, NAMES

CACHE_BYTES = 2_000_000
SMALLEST_CHUNK = 512


def into(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with the argument ``out`` of a NumPy operation."""

    def write(*arguments: Any, out: Any = None) -> Any:
        if out is None:
            return function(*arguments)
        out[...] = function(*arguments)
        return out

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
    **{code: into(pair[1]) for code, pair in LOGIC.items()},
}


class Straight:
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
        self._read()
        size = CACHE_BYTES // (8 * max(self.registers, 1))
        self.chunk = max(SMALLEST_CHUNK, 1 << (size.bit_length() - 1))

    @staticmethod
    def supports(function: Any) -> bool:
        """Return whether every operation of the function has a NumPy form."""
        known = {*_UFUNCS, ca.OP_TWICE, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
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
                self._once.append((_UFUNCS[code], sources, scalars))
                scalars += 1
                continue
            if code == ca.OP_OUTPUT:
                steps.append((None, sources, into))
            else:
                place[into[0]] = ("buffer", len(steps))
                steps.append((_UFUNCS[code], sources, None))
            highest.append(need)
        self._scalars = scalars
        self._allocate(steps, sorted(range(len(steps)), key=highest.__getitem__))

    def _allocate(self, steps: list[tuple[Any, list[tuple[str, Any]], Any]], order: Any) -> None:
        """Give each value a buffer until its last use."""
        last = {what: k for k in order for kind, what in steps[k][1] if kind == "buffer"}
        buffer: dict[int, tuple[str, int]] = {}
        free: list[int] = []
        for k in order:
            ufunc, sources, output = steps[k]
            given = [buffer[s[1]] if s[0] == "buffer" else s for s in sources]
            for kind, what in sources:
                if kind == "buffer" and last[what] == k and what in buffer:
                    free.append(buffer.pop(what)[1])
            if ufunc is None:
                self._line.append(("store", output[0], output[1], given[0]))
                continue
            if free:
                target = free.pop()
            else:
                target, self.registers = self.registers, self.registers + 1
            if k in last:
                buffer[k] = ("buffer", target)
            else:
                free.append(target)
            self._line.append((ufunc, given, target))

    def __call__(self, inputs: Sequence[Any]) -> list[Any]:
        """Return one (n, rows) array per output for (n, rows) inputs, shared ones (rows,)."""
        n = next(len(a) for i, a in enumerate(inputs) if i not in self.shared)
        columns = [
            a if i in self.shared else np.ascontiguousarray(np.asarray(a).T)
            for i, a in enumerate(inputs)
        ]
        results = [np.empty((self.function.size1_out(i), n)) for i in range(self.function.n_out())]
        scalar: list[Any] = [None] * self._scalars
        work = np.empty((self.registers, min(self.chunk, n)))

        def value(source: tuple[str, Any], a: int, b: int, rows: Any) -> Any:
            kind, what = source
            if kind == "buffer":
                return rows[what]
            if kind == "input":
                return columns[what[0]][what[1], a:b]
            if kind == "scalar":
                return scalar[what]
            return columns[what[0]][what[1]] if kind == "shared" else what

        with np.errstate(all="ignore"):
            for ufunc, sources, target in self._once:
                scalar[target] = ufunc(*[np.float64(value(s, 0, 0, work)) for s in sources])
            for a in range(0, n, self.chunk):
                b = min(a + self.chunk, n)
                rows = [row[: b - a] for row in work]
                for step in self._line:
                    if step[0] == "store":
                        results[step[1]][step[2], a:b] = value(step[3], a, b, rows)
                    else:
                        ufunc, sources, target = step
                        ufunc(*[value(s, a, b, rows) for s in sources], out=rows[target])
        return [result.T for result in results]


def straight(function: Any, shared: Sequence[int] = ()) -> Straight | None:
    """Return the NumPy form of a function, None where there is none."""
    return Straight(function, shared) if Straight.supports(function) else None
