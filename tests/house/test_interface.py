"""What Python users meet: names that Tab lists, the vocabulary of all that they call."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import Any

import mechdae as md
from mechdae.describe.values import Value
from mechdae.records import Record
from tests.shared.paths import ROOT

CLASSES = [
    cls
    for cls in (getattr(md, name) for name in md.__all__)
    if inspect.isclass(cls) and dataclasses.is_dataclass(cls)
]


def listed(thing: object) -> set[str]:
    return {name for name in dir(thing) if name[0] != "_"}


def fields(cls: Any) -> set[str]:
    return {entry.name for entry in dataclasses.fields(cls) if entry.name[0] != "_"}


def test_parts_list_their_fields_and_no_traits() -> None:
    pin = md.Revolute("A", "ground.A", "crank.A")
    assert listed(pin) == {"name", "first", "second", "friction", "friction_static", "pin_radius"}
    assert pin.hinge  # what rooms ask is there
    for cls in (cls for cls in CLASSES if issubclass(cls, Record)):
        names = listed(object.__new__(cls))
        assert fields(cls) <= names, cls
        more = names - fields(cls)
        assert len(more) <= (0 if issubclass(cls, Value) else 8), (cls, more)
        assert all(inspect.getdoc(getattr(cls, name)) for name in more), (cls, more)


def test_results_list_what_their_kind_has() -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=3)
    names = listed(result)
    assert fields(md.SweepResult) <= names
    others = {name for cls in CLASSES if issubclass(cls, md.Result) for name in fields(cls)}
    assert not names & (others - fields(md.SweepResult))
    assert not names & {"codes", "as_kind", "of", "forces", "whole_path", "constructed", "shows"}
    assert not inspect.signature(md.SweepResult).parameters


def test_what_documents_use_is_listed() -> None:
    """Of results, problems and mechanisms in the pages of Python."""
    problem = md.load("four-bar-crank-rocker")
    things: dict[str, Any] = {"result": md.solve(problem, "turn", poses=3), "problem": problem}
    things["mechanism"] = problem.mechanism
    of_kinds = {name for cls in CLASSES if issubclass(cls, md.Result) for name in fields(cls)}
    found = 0
    for path in (ROOT / "docs").glob("*.md"):
        text = path.read_text(encoding="utf-8")
        for block in re.findall(r"```python\n.*?```|`[^`\n]+`", text.replace(".py", ""), re.S):
            for name, thing in things.items():
                used = set(re.findall(rf"(?<![\w.]){name}\.([a-z]\w*)", block))
                used -= of_kinds if name == "result" else set()
                assert used <= listed(thing), (path, name)
                found += len(used)
    assert found > 10
