"""Named read-only arrays: of one body, point, joint or driver, and all of a kind by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mechdae.errors import UnknownName
from mechdae.results.lazy import LazyPart
from mechdae.types import Floats

PLURALS = {
    "body": "bodies",
    "point": "points",
    "joint": "joints",
    "driver": "drivers",
    "output": "outputs",
}


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


class Named(Mapping[str, Series]):
    """Series by name; an unknown name is answered with the nearest ones."""

    def __init__(self, kind: str, items: Mapping[str, Series]) -> None:
        self._kind, self._items = kind, dict(items)

    def __getitem__(self, name: str) -> Series:
        if name not in self._items:
            raise UnknownName(self._kind, name, self._items)
        return self._items[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return the series of that name, or the default."""
        return self._items.get(name, default)

    def __contains__(self, name: object) -> bool:
        return name in self._items

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def _ipython_key_completions_(self) -> list[str]:
        """Return the names that can stand in brackets."""
        return list(self)

    def __repr__(self) -> str:
        return f"{PLURALS[self._kind]}: {', '.join(self)}"
