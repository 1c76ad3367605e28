"""What is built once for a structure and shared by all its numbers, such as kernels."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Any, Generic, Self, TypeVar, overload

T = TypeVar("T")


class StructureCache:
    """Things made when they are first asked for, by key; made once, whichever thread asks."""

    def __init__(self) -> None:
        self._made: dict[Hashable, Any] = {}
        self._lock = threading.RLock()

    def __call__(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what is kept under a key; `make` must not use any numbers."""
        try:
            found: T = self._made[key]
        except KeyError:
            with self._lock:
                if key not in self._made:
                    self._made[key] = make()
                found = self._made[key]
        return found

    def __len__(self) -> int:
        return len(self._made)

    def values(self) -> list[object]:
        """Return all that has been made."""
        with self._lock:
            return list(self._made.values())

    def contents(self) -> list[object]:
        """Return all that has been made, also what is in the caches of it."""
        found = self.values()
        for made in [*found]:
            inner = made if isinstance(made, StructureCache) else getattr(made, "cache", None)
            found += inner.contents() if isinstance(inner, StructureCache) else ()
        return found


class structure_property(Generic[T]):  # noqa: N801  (used like `property`)
    """A property that is made once for an object and all copies of it with other numbers.

    Each of them keeps it as an attribute of its own once it has asked for it.
    """

    def __init__(self, make: Callable[[Any], T]) -> None:
        self.make: Callable[[Any], T] = make
        self.__doc__ = make.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self.key: tuple[str, str] = (owner.__qualname__, name)
        self.name: str = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type | None = None) -> T: ...
    def __get__(self, instance: Any, owner: type | None = None) -> Self | T:
        if instance is None:
            return self
        made: T = instance.cache(self.key, lambda: self.built(instance))
        instance.__dict__[self.name] = made
        return made

    def built(self, instance: object) -> T:
        """Return what is made where nothing is kept."""
        return self.make(instance)


def forget(instance: object) -> None:
    """Take away the structure properties that an object keeps, whose cache is another one now."""
    for owner in type(instance).__mro__:
        for name, member in vars(owner).items():
            if isinstance(member, structure_property):
                instance.__dict__.pop(name, None)
