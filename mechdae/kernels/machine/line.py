"""A casadi function on blocks of poses by the compiled machine, each value computed once."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Any, Self

from mechdae.kernels.machine.library import library
from mechdae.kernels.machine.program import compiled
from mechdae.kernels.run.numpy_backend import PoseLine
from mechdae.types import Floats, Graph

CHUNK = 16_384
"""Poses of a block; those that fit into the caches are the machine's own business."""


class CompiledLine(PoseLine):
    """A function by the compiled machine."""

    chunk = CHUNK

    def __init__(
        self, function: Graph, shared: Sequence[int], program: Any, outputs: list[tuple[int, int]]
    ) -> None:
        super().__init__(function, shared)
        self._program = program
        inputs = [(i, row) for i in range(function.n_in()) for row in range(function.numel_in(i))]
        self.places = {}
        for result, (kind, at) in zip(outputs, program.places, strict=True):
            if kind == 0:
                self.places[result] = ("result", outputs[at])
            elif kind == 1:
                name = "shared" if inputs[at][0] in self.shared else "input"
                self.places[result] = (name, inputs[at])
            elif kind == 2:
                self.places[result] = ("scalar", at)

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
        values: list[float] = self._program.common(*inputs)
        return values

    def block(
        self, inputs: Sequence[Floats], scalars: list[float], into: Mapping[tuple[int, int], Floats]
    ) -> None:
        del scalars  # the machine has its own
        self._program.block(*inputs, [into[result] for result in self.results])
