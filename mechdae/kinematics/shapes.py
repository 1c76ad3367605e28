"""The models and kernels of structures that were used last, kept for other numbers.

Bounded in number and in size. A structure that someone else still holds is found again too.
"""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Generic, TypeVar

from mechdae.model.kept import Kept

MOST = 16
"""Structures that are kept."""
MOST_BYTES = 256_000_000
"""Estimated size of all of them."""
PER_INSTRUCTION = 400
"""Bytes of an instruction of a kernel: casadi's own, and those of its NumPy form."""

T = TypeVar("T")
_HOLDER: ContextVar[dict[Hashable, Any] | None] = ContextVar("holder", default=None)


class Shapes(Generic[T]):
    """What was built for structures, the least recently used forgotten first.

    Parameters
    ----------
    most, most_bytes
        How many are kept, and how much they may be by `size_of`.
    size_of
        Estimated size in bytes; it may grow while a structure is used.
    """

    def __init__(
        self, size_of: Callable[[T], int], most: int = MOST, most_bytes: int = MOST_BYTES
    ) -> None:
        self.size_of, self.most, self.most_bytes = size_of, most, most_bytes
        self._last: OrderedDict[Hashable, T] = OrderedDict()
        self._living: weakref.WeakValueDictionary[Hashable, Any] = weakref.WeakValueDictionary()
        self._lock = threading.Lock()

    def get(self, key: Hashable) -> T | None:
        """Return what is kept under a key, None where nothing is."""
        with self._lock:
            found: T | None = self._living.get(key)
            if found is not None:
                self._use(key, found)
            return found

    def put(self, key: Hashable, shape: T) -> None:
        """Keep something under a key, in the place of what was there."""
        with self._lock:
            self._living[key] = shape
            self._use(key, shape)

    def _use(self, key: Hashable, shape: T) -> None:
        holder = _HOLDER.get()
        if holder is not None:
            holder[key] = shape
        self._last[key] = shape
        self._last.move_to_end(key)
        sizes = {k: self.size_of(kept) for k, kept in self._last.items()}
        while len(self._last) > self.most or (
            len(self._last) > 1 and sum(sizes.values()) > self.most_bytes
        ):
            oldest, _ = self._last.popitem(last=False)
            del sizes[oldest]

    def clear(self) -> None:
        """Forget everything that nobody else holds."""
        with self._lock:
            self._last.clear()

    def __len__(self) -> int:
        return len(self._last)


@contextmanager
def held_by(holder: dict[Hashable, Any]) -> Iterator[None]:
    """Let `holder` keep the structures that are used meanwhile."""
    token = _HOLDER.set(holder)
    try:
        yield
    finally:
        _HOLDER.reset(token)


def size_of(*kept: Kept) -> int:
    """Return the estimated bytes of kernels."""
    functions = [getattr(made, "function", made) for own in kept for made in own.values()]
    counts: list[int] = [f.n_instructions() for f in functions if hasattr(f, "n_instructions")]
    return PER_INSTRUCTION * sum(counts)
