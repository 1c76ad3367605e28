"""Slips of the pen planted in the package: a text of one function is exchanged for another."""

from __future__ import annotations

import importlib
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from mechdae import additions

INNER = ("__func__", "fget", "func", "make")
"""Where methods and properties of several kinds have their function."""


@dataclass(frozen=True)
class Slip:
    """One planted slip.

    Attributes
    ----------
    place
        A module inside of the package.
    right, wrong
        What one of its functions says, once, and what is planted in its place.
    check
        Returns by how much something is off a closed form, 0 to rounding without the slip, over
        what the tests allow: the slip is seen from 1 on.
    seen
        "file::test" of the suite, which fails with the slip.
    """

    place: str
    right: str
    wrong: str
    check: Callable[[], float]
    seen: str

    @property
    def name(self) -> str:
        return f"{self.place}: {self.wrong}"


def plant(slip: Slip, patch: pytest.MonkeyPatch) -> None:
    """Exchange a function for the one with the slip, in every module that knows it."""
    home = importlib.import_module(f"mechdae.{slip.place}")
    found = [own for own in _functions(home) if own[3].count(slip.right)]
    assert len(found) == 1, f"{slip.place} does not say '{slip.right}' in one function"
    ((owner, name, old, source),) = found
    assert source.count(slip.right) == 1, f"{slip.place} says '{slip.right}' twice"
    space: dict[str, Any] = {}
    exec(compile(source.replace(slip.right, slip.wrong), slip.place, "exec"), vars(home), space)
    new = space[name]
    if hasattr(new, "__set_name__"):
        new.__set_name__(owner, name)
    patch.setattr(owner, name, new)
    additions._answers.cache_clear()  # outside of the suite nothing else forgets it
    tables = [own for key, own in vars(home).items() if isinstance(own, dict) and key.isupper()]
    for table in tables if owner is home else ():  # functions by kind
        for key in [key for key, value in table.items() if value is old]:
            patch.setitem(table, key, new)
    for known in [m for key, m in sys.modules.items() if key.startswith(("mechdae.", "tests."))]:
        if owner is home and vars(known).get(name) is old:
            patch.setattr(known, name, new)


def _functions(home: Any) -> Iterator[tuple[Any, str, Any, str]]:
    """Yield owner, name, value and source of the functions and methods of a module."""
    classes = [own for own in vars(home).values() if isinstance(own, type)]
    for owner in [home, *(own for own in classes if own.__module__ == home.__name__)]:
        for name, value in list(vars(owner).items()):
            inner = next(filter(None, (getattr(value, own, None) for own in INNER)), None)
            inner = inspect.unwrap(inner or value)
            own = inspect.isfunction(inner) and inner.__module__ == home.__name__
            if own and inner.__code__.co_filename == home.__file__:
                yield owner, name, value, textwrap.dedent(inspect.getsource(inner))
