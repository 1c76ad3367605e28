"""A casadi SX function as a straight line of NumPy operations over chunks of poses.

The instruction list is read once; scalars that all poses share are computed once a call.
Operation by operation the results are those of casadi's own virtual machine.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import LOGIC, NAMES
from mechdae.types import Floats, Graph

CACHE_BYTES = 4_000_000
"""Size of the buffers of a chunk: a call of NumPy costs as much as some 1500 numbers."""
SMALLEST_CHUNK = 512


def _write(function: Callable[..., Any], *arguments: object, out: Floats) -> None:
    """Do an operation as one of NumPy with the argument ``out``."""
    out[...] = function(*arguments)


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
EITHER_WAY = (ca.OP_ADD, ca.OP_MUL)
"""Operations whose arguments may change places, which casadi takes for other ones."""
_VALUES = {**_UFUNCS, **{code: pair[1] for code, pair in LOGIC.items()}}
"""Operations that return their result."""
_WRITERS = {**_UFUNCS, **{code: partial(_write, pair[1]) for code, pair in LOGIC.items()}}
"""Operations that write it where they are told to."""


Place = tuple[str, Any]
"""Where a value is: ("input", (i, j)), ("shared", (i, j)), ("constant", number), ("scalar", k),
("buffer", k) or ("result", (output, row))."""
Operation = tuple[Any, list[Place], Any]


class PoseLine:
    """Evaluates an SX function with dense vector inputs and outputs for many poses.

    `shared`: inputs that have one value for all poses.

    Attributes
    ----------
    results : list of (output, row)
        What is computed pose by pose: every value once.
    places : dict
        (output, row) -> the place of its value: one of `results`, an input, a constant, or one
        of the `scalars` that all poses share.
    chunk : int
        Most poses of a block.
    """

    chunk: int
    places: dict[tuple[int, int], Place]

    def __init__(self, function: Graph, shared: Sequence[int] = ()) -> None:
        self.function: Graph = function
        self.shared: set[int] = set(shared)

    @cached_property
    def results(self) -> list[tuple[int, int]]:
        return [result for result, place in self.places.items() if place == ("result", result)]

    def scalars(self, inputs: Sequence[Floats]) -> list[float]:
        """Return the values that all poses share, for inputs of which only shared ones are read."""
        raise NotImplementedError

    def block(
        self, inputs: Sequence[Floats], scalars: list[float], into: Mapping[tuple[int, int], Floats]
    ) -> None:
        """Compute the results of a block of poses.

        Parameters
        ----------
        inputs
            One (rows, n) array for each input, shared ones (rows,).
        scalars
            What `scalars` gives for them.
        into
            (output, row) -> (n,) array to be written, for all of `results`.
        """
        raise NotImplementedError

    def value(
        self,
        place: Place,
        inputs: Sequence[Floats],
        scalars: list[float],
        into: Mapping[tuple[int, int], Floats],
    ) -> Any:
        """Return what stands at a place: an array (n,) or one number."""
        kind, what = place
        if kind in ("input", "shared"):
            return inputs[what[0]][what[1]]
        if kind == "result":
            return into[what]
        return scalars[what] if kind == "scalar" else what

    def __call__(self, inputs: Sequence[Floats]) -> list[Floats]:
        """Return one (n, rows) array per output for (n, rows) inputs, shared ones (rows,)."""
        n = next(len(a) for i, a in enumerate(inputs) if i not in self.shared)
        columns = [
            a if i in self.shared else np.ascontiguousarray(np.asarray(a, float).T)
            for i, a in enumerate(inputs)
        ]
        f, scalars = self.function, self.scalars(columns)
        whole = [np.empty((f.size1_out(i), n)) for i in range(f.n_out())]
        for a in range(0, n, self.chunk):
            some = slice(a, a + self.chunk)
            block = [c if i in self.shared else c[:, some] for i, c in enumerate(columns)]
            into = {result: whole[result[0]][result[1], some] for result in self.results}
            self.block(block, scalars, into)
        into = {result: whole[result[0]][result[1]] for result in self.results}
        for (i, row), place in self.places.items():
            if place != ("result", (i, row)):
                whole[i][row] = self.value(place, columns, scalars, into)
        return [result.T for result in whole]


class NumpyFunction(PoseLine):
    """A function in NumPy.

    `unwanted` are the (output, row) of values that nobody reads: neither they nor what only they
    need is computed.
    """

    def __init__(
        self,
        function: Graph,
        shared: Sequence[int] = (),
        unwanted: Container[tuple[int, int]] = (),
    ) -> None:
        super().__init__(function, shared)
        self._unwanted = unwanted
        self.places: dict[tuple[int, int], Place] = {}
        self._once: list[tuple[Any, ...]] = []
        self._line: list[tuple[Any, ...]] = []
        self.registers: int = 0
        self._spare: list[Any] = []
        """Buffers between two calls: fresh memory is slow at its first touch."""
        self._read()
        self.chunk: int = max(SMALLEST_CHUNK, CACHE_BYTES // (8 * max(self.registers, 1)))

    @staticmethod
    def supports(function: Graph) -> bool:
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
        place: dict[int, Place] = {}  # register -> where its value is now
        highest: list[int] = []
        steps: list[Operation] = []
        first: dict[int, tuple[int, int]] = {}  # step -> the result that its value is
        known: dict[Any, Place] = {}  # what was computed already, from which values
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
            if code == ca.OP_OUTPUT:
                (kind, what), slot = sources[0], (into[0], into[1])
                if slot in self._unwanted:
                    continue
                if kind == "buffer":
                    kind, what = "result", first.setdefault(what, slot)
                self.places[slot] = (kind, what)
                continue
            need, shared = -1, True
            for kind, what in sources:
                if kind == "buffer":
                    shared, need = False, max(need, highest[what])
                elif kind == "input":
                    shared, need = False, max(need, what[1] if what[0] == 0 else -1)
            if code == ca.OP_TWICE:
                code, sources = ca.OP_ADD, [sources[0], sources[0]]
            texts = [f"{kind} {what!r}" for kind, what in sources]
            made = (code, *(sorted(texts) if code in EITHER_WAY else texts))
            if made in known:
                place[into[0]] = known[made]
                continue
            if shared:
                place[into[0]] = known[made] = ("scalar", len(self._once))
                self._once.append((_VALUES[code], sources))
                continue
            place[into[0]] = known[made] = ("buffer", len(steps))
            steps.append((_WRITERS[code], sources, None))
            highest.append(need)
        self._allocate(steps, sorted(range(len(steps)), key=highest.__getitem__), first)

    def _allocate(
        self, steps: list[Operation], order: list[int], first: dict[int, tuple[int, int]]
    ) -> None:
        """Give each value a place: the result it is, else a buffer until its last use."""
        needed = set(first)
        for k in reversed(range(len(steps))):
            if k in needed:
                needed |= {what for kind, what in steps[k][1] if kind == "buffer"}
        order = [k for k in order if k in needed]
        last = {what: k for k in order for kind, what in steps[k][1] if kind == "buffer"}
        home: dict[int, Place] = {k: ("result", slot) for k, slot in first.items()}
        free: list[int] = []
        line: list[Operation] = []
        for k in order:
            ufunc, sources, _ = steps[k]
            given = [home[what] if kind == "buffer" else (kind, what) for kind, what in sources]
            for kind, what in sources:
                if kind == "buffer" and last[what] == k and home.get(what, ("",))[0] == "buffer":
                    free.append(home.pop(what)[1])
            target = home.get(k)
            if target is None:
                if not free:
                    free.append(self.registers)
                    self.registers += 1
                target = ("buffer", free.pop())
                home[k] = target
            line.append((ufunc, given, target))
        self._number(line)

    def _number(self, line: list[Operation]) -> None:
        """Number the arrays and scalars that the steps use: buffers first, then `others`."""
        number: dict[Any, int] = {("buffer", k): k for k in range(self.registers)}
        self._others: list[Place] = []

        def key(place: Place) -> Place:
            return (place[0], repr(place[1])) if place[0] == "constant" else place

        for _, given, target in line:
            for place in (*given, target):
                if key(place) not in number:
                    number[key(place)] = len(number)
                    self._others.append(place)
        for ufunc, given, target in line:
            second = number[key(given[1])] if len(given) == 2 else -1
            self._line.append((ufunc, number[key(given[0])], second, number[target]))

    def scalars(self, inputs: Sequence[Floats]) -> list[float]:
        found: list[float] = []
        with np.errstate(all="ignore"):
            for ufunc, sources in self._once:
                values = (self.value(place, inputs, found, {}) for place in sources)
                found.append(ufunc(*map(np.float64, values)))
        return found

    def block(
        self, inputs: Sequence[Floats], scalars: list[float], into: Mapping[tuple[int, int], Floats]
    ) -> None:
        n = next(a.shape[1] for i, a in enumerate(inputs) if i not in self.shared)
        try:
            work = self._spare.pop()  # another thread may have taken it
        except IndexError:
            work = np.empty((self.registers, n))
        if work.shape[1] < n:
            work = np.empty((self.registers, n))
        at = [row[:n] for row in work]
        at += [self.value(place, inputs, scalars, into) for place in self._others]
        with np.errstate(all="ignore"):
            for ufunc, i, j, k in self._line:
                if j < 0:
                    ufunc(at[i], out=at[k])
                else:
                    ufunc(at[i], at[j], out=at[k])
        self._spare = [work]


def straight(
    function: Graph, shared: Sequence[int] = (), unwanted: Container[tuple[int, int]] = ()
) -> NumpyFunction | None:
    """Return the NumPy form of a function, None where there is none."""
    known = NumpyFunction.supports(function)
    return NumpyFunction(function, shared, unwanted) if known else None
