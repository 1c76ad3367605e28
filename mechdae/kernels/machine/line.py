"""A casadi function on blocks of poses by the compiled machine, each value computed once.

The same as `mechdae.kernels.run.numpy_backend.NumpyFunction`, which reads the function in NumPy.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Any, Self

import numpy as np

from mechdae.kernels.machine.library import library
from mechdae.kernels.machine.program import compiled
from mechdae.types import Floats, Graph

CHUNK = 16_384
"""Poses of a block; those that fit into the caches are the machine's own business."""
Place = tuple[str, Any]


class CompiledLine:
    """Evaluates an SX function with dense vector inputs and outputs for many poses.

    Attributes
    ----------
    results : list of (output, row)
        What is computed pose by pose: every value once.
    places : dict
        (output, row) -> the place of its value: ("result", one of `results`), ("input",
        (input, row)) of an input, ("shared", (input, row)) of a shared one, ("scalar", k) of the
        `scalars` that all poses share.
    """

    chunk = CHUNK

    def __init__(
        self, function: Graph, shared: Sequence[int], program: Any, outputs: list[tuple[int, int]]
    ) -> None:
        self.function, self.shared, self._program = function, set(shared), program
        inputs = [(i, row) for i in range(function.n_in()) for row in range(function.numel_in(i))]
        self.places: dict[tuple[int, int], Place] = {}
        for result, (kind, at) in zip(outputs, program.places, strict=True):
            if kind == 0:
                self.places[result] = ("result", outputs[at])
            elif kind == 1:
                name = "shared" if inputs[at][0] in self.shared else "input"
                self.places[result] = (name, inputs[at])
            elif kind == 2:
                self.places[result] = ("scalar", at)
        self.results = [
            result for result, place in self.places.items() if place == ("result", result)
        ]

    @classmethod
    def of(
        cls,
        function: Graph,
        shared: Sequence[int] = (),
        unwanted: Container[tuple[int, int]] = (),
    ) -> Self | None:
        """Return the line of a function, None where the machine has none.

        `unwanted` are the (output, row) of values that nobody reads: neither they nor what only
        they need is computed.
        """
        machine = library()
        if machine is None:
            return None
        outputs = [
            (i, row) for i in range(function.n_out()) for row in range(function.numel_out(i))
        ]
        wanted = bytes(place not in unwanted for place in outputs)
        program = compiled(machine, function, shared, wanted)
        return None if program is None else cls(function, shared, program, outputs)

    def scalars(self, inputs: Sequence[Floats]) -> list[float]:
        """Return the values that all poses share, for inputs of which only shared ones are read."""
        values: list[float] = self._program.common(*inputs)
        return values

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
        del scalars  # the machine has its own
        self._program.block(*inputs, [into[result] for result in self.results])

    def __call__(self, inputs: Sequence[Floats]) -> list[Floats]:
        """Return one (n, rows) array per output for (n, rows) inputs, shared ones (rows,)."""
        n = next(len(a) for i, a in enumerate(inputs) if i not in self.shared)
        columns = [np.asarray(a, float) for a in inputs]
        columns = [a if i in self.shared else a.T for i, a in enumerate(columns)]
        whole = [np.empty((self.function.numel_out(i), n)) for i in range(self.function.n_out())]
        self.block(columns, [], {result: whole[result[0]][result[1]] for result in self.results})
        common = self.scalars(columns)
        for (i, row), (kind, what) in self.places.items():
            if kind == "result" and what != (i, row):
                whole[i][row] = whole[what[0]][what[1]]
            elif kind in ("input", "shared"):
                whole[i][row] = columns[what[0]][what[1]]
            elif kind == "scalar":
                whole[i][row] = common[what]
        return [result.T for result in whole]
