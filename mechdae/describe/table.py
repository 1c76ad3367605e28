"""An immutable mapping, so that descriptions are values that hash and compare."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn, TypeVar

V = TypeVar("V")


class Table(dict[str, V]):
    """A frozen dict with string keys; the order of entry is kept."""

    __slots__ = ()

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __repr__(self) -> str:
        return f"Table({super().__repr__()})"

    def __reduce__(self) -> tuple[type[Table[V]], tuple[dict[str, V]]]:
        return type(self), (dict(self),)

    def with_(self, key: str, value: V) -> Table[V]:
        """Return a copy in which `key` has `value`."""
        return Table({**self, key: value})

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a Table does not change; `with_` returns a changed copy")

    if not TYPE_CHECKING:  # which know of a dict what it cannot do as little
        __setitem__ = __delitem__ = __ior__ = _refuse
        clear = pop = popitem = setdefault = update = _refuse
