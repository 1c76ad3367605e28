"""Descriptions to TOML: SI and radians, one line per joint, as a person would write it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from mechdae.describe.joints import Joint
from mechdae.describe.problem import SCHEMA, Problem
from mechdae.describe.tasks import Driver
from mechdae.describe.values import NAME, Value


def dump(problem: Problem, path: str | Path) -> None:
    """Write the problem to a TOML file that `load` reads back to an equal problem."""
    target = Path(path)
    text = dumps(problem)
    partial = target.with_name(target.name + ".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(target)


def dumps(problem: Problem) -> str:
    """Return the TOML text of the problem."""
    mechanism = problem.mechanism
    lines = [f"schema = {SCHEMA}"]
    for entry in ("title", "source"):
        if getattr(problem, entry):
            lines.append(f"{entry} = {_text(getattr(problem, entry))}")
    if mechanism.gravity is not None:
        lines.append(f"gravity = {_value(mechanism.gravity)}")
    lines += _section("parameters", mechanism.parameters)
    lines += _section("ground", _given(mechanism.ground))
    for name, body in mechanism.bodies.items():
        lines += ["", f"[bodies.{name}]", *_entries(_given(body, skip=("name",)))]
    lines += _section("joints", {n: _joint(j) for n, j in mechanism.joints.items()})
    lines += _section("sketch", mechanism.sketch)
    lines += _section(
        "loads",
        {n: {"kind": x.kind, **_given(x, skip=("name",))} for n, x in mechanism.loads.items()},
    )
    lines += _section("outputs", mechanism.outputs)
    for name, task in problem.tasks.items():
        lines += ["", f"[tasks.{name}]", f"kind = {_text(task.kind)}", *_entries(_given(task))]
    for expected in problem.expected:
        lines += ["", "[[expected]]", *_entries(_given(expected))]
    return "\n".join(lines) + "\n"


def _given(value: Value, skip: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the fields that differ from their default, under their file keys."""
    return {
        entry.name.rstrip("_"): getattr(value, entry.name)
        for entry in fields(value)
        if entry.name not in skip
        and getattr(value, entry.name) is not None
        and getattr(value, entry.name) != entry.default
    }


def _joint(joint: Joint) -> dict[str, Any]:
    rest = _given(joint, skip=("name", "first", "second"))
    return {"kind": joint.kind, "between": [joint.first, joint.second], **rest}


def _section(name: str, entries: Mapping[str, Any]) -> list[str]:
    return ["", f"[{name}]", *_entries(entries)] if entries else []


def _entries(entries: Mapping[str, Any]) -> list[str]:
    return [f"{_key(name)} = {_value(value)}" for name, value in entries.items()]


def _key(name: str) -> str:
    return name if NAME.match(name) else _text(name)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Driver):
        value = _given(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(_entries(value)) + " }" if value else "{}"
    return "[" + ", ".join(_value(item) for item in value) + "]"
