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
from typing import Any, Generic, Protocol, TypeVar

from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.run.numpy_backend import CACHE_BYTES, NumpyFunction

MOST = 16
"""Structures that are kept."""
MOST_BYTES = 256_000_000
"""Estimated size of all of them: instructions of kernels, and buffers of those for many poses."""
PER_INSTRUCTION = 400
"""Bytes of an instruction of a kernel: casadi's own, and those of its NumPy form."""

T = TypeVar("T")


class Sized(Protocol):
    """What was built for a structure."""

    @property
    def size(self) -> int:
        """Estimated bytes."""


class CacheOwner:
    """The structures that someone used last, who thereby keeps them.

    ``free`` are numbers that stay symbols in them even where they are zero.
    """

    def __init__(self, free: frozenset[str] = frozenset()) -> None:
        self.free = free
        self._latest: Any = None
        self._last: OrderedDict[Hashable, Any] = OrderedDict()

    def use(self, key: Hashable, shape: object) -> None:
        """Keep a structure, in the place of the one used longest ago."""
        if self._latest is shape:
            return
        self._latest = shape
        self._last[key] = shape
        self._last.move_to_end(key)
        while len(self._last) > MOST:
            self._last.popitem(last=False)


_HOLDER: ContextVar[CacheOwner | None] = ContextVar("holder", default=None)


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
        self._latest: T | None = None
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
            holder.use(key, shape)
        if self._latest is shape:
            return
        self._latest = shape
        self._last[key] = shape
        self._last.move_to_end(key)
        sizes = [self.size_of(kept) for kept in self._last.values()]
        count = len(sizes)
        while count > self.most or (count > 1 and sum(sizes[-count:]) > self.most_bytes):
            self._last.popitem(last=False)
            count -= 1

    def values(self) -> list[T]:
        """Return what is kept, that used last at the end."""
        with self._lock:
            return list(self._last.values())

    def clear(self) -> None:
        """Forget everything; who holds a structure keeps it, but it is not found again."""
        with self._lock:
            self._living.clear()
            self._last.clear()
            self._latest = None

    def __len__(self) -> int:
        return len(self._last)


@contextmanager
def keep_for(holder: CacheOwner) -> Iterator[None]:
    """Let `holder` keep the structures that are used meanwhile."""
    token = _HOLDER.set(holder)
    try:
        yield
    finally:
        _HOLDER.reset(token)


def free_numbers() -> frozenset[str]:
    """Return the numbers that the holder of this thread wants as symbols."""
    holder = _HOLDER.get()
    return holder.free if holder is not None else frozenset()


def size_of(*caches: StructureCache) -> int:
    """Return the estimated bytes of kernels."""
    known = caches[0]("size", lambda: [0, 0])  # how many things were counted, and their size
    contents = [made for cache in caches for made in cache.contents()]
    if known[0] != len(contents):
        functions = [getattr(made, "function", made) for made in contents]
        sizes: list[int] = [f.n_instructions() for f in functions if hasattr(f, "n_instructions")]
        lines = sum(isinstance(made, NumpyFunction) for made in contents)
        lines += sum(bool(getattr(made, "lines", ())) for made in contents)
        known[:] = len(contents), PER_INSTRUCTION * sum(sizes) + CACHE_BYTES * lines
    return int(known[1])
