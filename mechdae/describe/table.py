"""An immutable mapping, so that descriptions are values that hash and compare."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

V = TypeVar("V")


class Table(Mapping[str, V]):
    """A frozen dict with string keys; the order of entry is kept."""

    __slots__ = ("_items",)

    def __init__(self, items: Any = ()) -> None:
        self._items: dict[str, V] = dict(items)

    def __getitem__(self, key: str) -> V:
        return self._items[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return f"Table({self._items!r})"

    def with_(self, key: str, value: V) -> Table[V]:
        """Return a copy in which `key` has `value`."""
        return Table({**self._items, key: value})
