"""Functions that casadi calls back: dense columns in, one dense result out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca


class DenseCallback(ca.Callback):
    """A function of Python within casadi's graphs; keep it as long as what is built with it."""

    def __init__(
        self, name: str, sizes: Sequence[int], shape: tuple[int, int], options: Any = None
    ) -> None:
        ca.Callback.__init__(self)
        self._sizes, self._shape = tuple(sizes), shape
        self.construct(name, options or {})

    def get_n_in(self) -> int:
        return len(self._sizes)

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self._sizes[i], 1)

    def get_sparsity_out(self, i: int) -> Any:
        return ca.Sparsity.dense(*self._shape)
