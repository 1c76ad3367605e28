"""Parts of a result that are computed when they are first read, and then kept."""

from __future__ import annotations

from collections.abc import Callable, ItemsView, Iterable, Iterator, KeysView, Mapping, ValuesView
from threading import RLock
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mechdae.types import Json


class LazyPart:
    """Named parts of a result that one computation gives, when one of them is first read.

    What the computation holds (a path, kernels) is let go of once it is done.
    """

    def __init__(self, compute: Callable[[], Mapping[str, Any]]) -> None:
        self._compute: Callable[[], Mapping[str, Any]] | None = compute
        self._parts: Mapping[str, dict[str, float]] = {}
        self._lock = RLock()

    def parts(self) -> Mapping[str, Any]:
        """Return what the computation gives, by name."""
        with self._lock:
            if self._compute is not None:
                self._parts = self._compute()
                self._compute = None
        return self._parts

    def __reduce__(self) -> tuple[Any, ...]:
        return _known, (dict(self.parts()),)


def _known(parts: Mapping[str, int]) -> LazyPart:
    return LazyPart(lambda: parts)


class Summary(dict[str, Any]):
    """Entries by name; one that is a `LazyPart` is computed when it is read.

    It is left out where the computation does not give it. Whoever reads all entries gets all
    computed; `copy` and `only` leave open what is open.
    """

    def _settled(self, later: LazyPart) -> None:
        parts = later.parts()
        for name, value in list(super().items()):
            if value is later:
                if name in parts:
                    self[name] = parts[name]
                else:
                    super().pop(name, None)

    def _all(self) -> None:
        for value in list(super().values()):
            if isinstance(value, LazyPart):
                self._settled(value)

    def __getitem__(self, name: str) -> Any:
        value = super().__getitem__(name)
        if isinstance(value, LazyPart):
            self._settled(value)
            value = super().__getitem__(name)
        return value

    def __contains__(self, name: object) -> bool:
        value = super().get(name)  # type: ignore[call-overload]
        if isinstance(value, LazyPart):
            self._settled(value)
        return super().__contains__(name)

    def get(self, name: str, default: Any = None) -> Any:
        """Return the entry of that name, or the default."""
        return super().get(name, default) if name in self else default

    def names(self) -> list[str]:
        """Return the names there are or may be, without computing any."""
        return list(super().keys())

    def copy(self) -> Summary:
        """Return the same entries, those open that are open here."""
        return self.only(self.names())

    def changed(self, **entries: list[str] | LazyPart) -> Summary:
        """Return the same entries, some of them changed or added."""
        found = self.copy()
        found.update(entries)
        return found

    def only(self, names: Iterable[str]) -> Summary:
        """Return some of the entries, those open that are open here."""
        known = dict(super().items())
        return Summary({name: known[name] for name in names})

    def __iter__(self) -> Iterator[str]:
        self._all()
        return super().__iter__()

    def __len__(self) -> int:
        self._all()
        return super().__len__()

    def __bool__(self) -> bool:
        return any(not isinstance(value, LazyPart) for value in super().values()) or len(self) > 0

    def keys(self) -> KeysView[str]:  # type: ignore[override]
        self._all()
        return super().keys()

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        self._all()
        return super().values()

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        self._all()
        return super().items()

    def __eq__(self, other: object) -> bool:
        for one in (self, other):
            if isinstance(one, Summary):
                one._all()
        return super().__eq__(other)

    def __or__(self, other: Any) -> Any:
        return dict(self) | other

    def __repr__(self) -> str:
        self._all()
        return super().__repr__()

    def __reduce__(self) -> tuple[tuple[Json] | type[Summary], ...]:
        return Summary, (dict(self),)
