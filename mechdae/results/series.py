"""Parts of a result: read-only arrays by name, and what is computed when it is first read."""

from __future__ import annotations

from collections.abc import Callable, ItemsView, Iterable, Iterator, KeysView, Mapping, ValuesView
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.values import Table
from mechdae.errors import UnknownName
from mechdae.types import Floats

PLURALS = {
    "body": "bodies",
    "point": "points",
    "joint": "joints",
    "driver": "drivers",
    "output": "outputs",
}


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

    def __reduce__(self) -> tuple[object, ...]:
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

    def get(self, name: str, default: object = None) -> Any:
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

    def __reduce__(self) -> tuple[object, ...]:
        return Summary, (dict(self),)


class Series(Mapping[str, Any]):
    """Arrays of one body, point, joint or driver, by attribute or key; rows are poses.

    An array that is given as a `LazyPart` is computed when it is read.
    """

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        frozen = {}
        for name, value in arrays.items():
            frozen[name] = value if isinstance(value, LazyPart) else _frozen(value)
        self.__dict__["_arrays"] = frozen

    def __getattr__(self, name: str) -> Any:
        arrays = self.__dict__.get("_arrays", {})
        if name not in arrays:
            raise AttributeError(f"no '{name}' here; there is {', '.join(arrays)}")
        return self[name]

    def __setattr__(self, name: str, value: Floats | list[float]) -> None:
        raise AttributeError("results are read-only")

    def __getitem__(self, name: str) -> Any:
        arrays = self.__dict__["_arrays"]
        value = arrays[name]
        if isinstance(value, LazyPart):
            value = arrays[name] = _frozen(value.parts()[name])
        return value

    def open(self) -> dict[str, Floats | LazyPart]:
        """Return the arrays; those that are still to be computed as they are."""
        return dict(self.__dict__["_arrays"])

    def __iter__(self) -> Iterator[str]:
        return iter(self.__dict__["_arrays"])

    def __len__(self) -> int:
        return len(self.__dict__["_arrays"])

    def __dir__(self) -> list[str]:
        """Return the names that can follow a dot: its arrays first of all."""
        return [*self, *(name for name in super().__dir__() if name not in self)]

    def _ipython_key_completions_(self) -> list[str]:
        """Return the names that can stand in brackets."""
        return list(self)

    def __repr__(self) -> str:
        shapes = (f"{name} {_shape(value)}".rstrip() for name, value in self.open().items())
        return f"Series({', '.join(shapes)})"


def _shape(value: Any) -> str:
    """Return the shape of an array; of one that is still to be computed nothing."""
    return "" if isinstance(value, LazyPart) else str(np.shape(value))


def _frozen(value: Floats | list[float]) -> Floats:
    """Return a read-only array: a view where the value is an array of someone else."""
    array = np.asarray(value)
    array.setflags(write=False)
    return array


class Named(Table[Series]):
    """Series by name; an unknown name is answered with the nearest ones."""

    __slots__ = ("_kind",)

    def __init__(self, kind: str, items: Mapping[str, Series]) -> None:
        super().__init__(items)
        self._kind = kind

    if TYPE_CHECKING:  # in place of the many forms of that of `dict`

        def get(self, name: str, default: object = None) -> Any: ...

    def __missing__(self, name: str) -> Series:
        raise UnknownName(self._kind, name, self)

    def __reduce__(self) -> tuple[type[Named], tuple[str, dict[str, Series]]]:  # type: ignore[override]
        return Named, (self._kind, dict(self))

    def _ipython_key_completions_(self) -> list[str]:
        """Return the names that can stand in brackets."""
        return list(self)

    def __repr__(self) -> str:
        return f"{PLURALS[self._kind]}: {', '.join(self)}"
