"""Slips of the pen planted in the package: a text of one function is exchanged for another."""

from __future__ import annotations

import importlib
import inspect
import sys
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest


@dataclass(frozen=True)
class Slip:
    """One planted slip.

    Attributes
    ----------
    place
        "module:function" or "module:Class.method" inside of the package.
    right, wrong
        What the function says, once, and what is planted in its place.
    check
        Returns by how much something is off a closed form, 0 to rounding without the slip, over
        what the tests allow: the slip is seen from 1 on, or where the check raises an error.
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
    module, _, path = slip.place.partition(":")
    home: Any = importlib.import_module(f"mechdae.{module}")
    *outer, name = path.split(".")
    owner = home
    for part in outer:
        owner = getattr(owner, part)
    old = inspect.getattr_static(owner, name)
    inner = getattr(old, "__func__", None) or getattr(old, "fget", None)
    inner = inner or getattr(old, "func", None) or old
    source = textwrap.dedent(inspect.getsource(inner))
    assert source.count(slip.right) == 1, f"{slip.place} does not say '{slip.right}' once"
    space: dict[str, Any] = {}
    exec(compile(source.replace(slip.right, slip.wrong), slip.place, "exec"), vars(home), space)
    new = space[name]
    if hasattr(new, "__set_name__"):
        new.__set_name__(owner, name)
    patch.setattr(owner, name, new)
    for known in [m for key, m in sys.modules.items() if key.startswith(("mechdae.", "tests."))]:
        if not outer and vars(known).get(name) is old:
            patch.setattr(known, name, new)
