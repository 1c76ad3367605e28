"""What the JSON of a result has, and what stands at a path in it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from mechdae.describe.series_units import KINDS
from mechdae.errors import UnknownName
from mechdae.results.plain import plain
from mechdae.results.result import Result
from mechdae.results.series import LazyPart, Series, Summary


def content_of(result: Result) -> dict[str, object]:
    """Return what the JSON of a task has, in its order, as arrays, mappings and sequences."""
    content: dict[str, object] = {"kind": result.kind}
    if result.time is not None:
        content["time"] = result.time
    for name in KINDS:
        table = _joints(result) if name == "joints" else getattr(result, name)
        if table:
            content[name] = table
    for word, series in (("efforts", result.efforts), *_parts(result)):
        if series:
            content[word] = series
    content |= result.scalars
    if result.work:
        content["work"] = result.work
    for name in ("parameters", "table"):
        if arrays := getattr(result, name):
            content[name] = {key: np.asarray(array) for key, array in arrays.items()}
    content |= result.data
    if result.centres:
        content["centres"] = result.centres
    if result.kind == "modes":
        content["labels"] = result.labels
    content["status"] = np.asarray(result.status, dtype=str)
    content["bound"] = result.bound
    if result.condition is not None:
        content["condition"] = result.condition
    content["events"] = result.events
    if result.solutions:
        content["solutions"] = result.solutions
    if result.checks.names() if isinstance(result.checks, Summary) else result.checks:
        content["checks"] = result.checks
    content["summary"] = result.summary.changed(fault=LazyPart(partial(_fault, result)))
    return content


def _fault(result: Result) -> dict[str, str]:
    return {} if result.fault is None else {"fault": result.fault}


def _joints(result: Result) -> Summary:
    """Return the series of joints with what is unique of their reactions."""
    joints = Summary({name: Summary(series.open()) for name, series in result.joints.items()})
    for name in result.unique.names():
        if name in result.joints:
            joints[name]["unique"] = LazyPart(partial(_unique_of, result, name))
        else:
            joints[name] = LazyPart(partial(_unlisted, result, name))
    return joints


def _unique_of(result: Result, joint: str) -> dict[str, object]:
    return {"unique": result.unique[joint]} if joint in result.unique else {}


def _unlisted(result: Result, joint: str) -> dict[str, object]:
    unique = _unique_of(result, joint)
    return {joint: unique} if unique else {}


def _parts(result: Result) -> list[tuple[str, Series]]:
    return [(f"efforts_{word}", series) for word, series in result.parts.items()]


def value_at(content: Mapping[str, object], whole: str, path: str) -> Any:
    """Return the plain data at a `whole` path, which was asked for as `path`."""
    here: Any = content
    steps = whole.split("/")
    while steps:
        if _is_list(here) and steps[0].isdigit() and int(steps[0]) < len(here):
            here = here[int(steps.pop(0))]
            continue
        known = here if isinstance(here, Mapping) else {}
        counts = range(1, len(steps) + 1)  # names may have slashes themselves
        count = next((k for k in counts if "/".join(steps[:k]) in known), 1)
        step = "/".join(steps[:count])
        if step not in known:
            known = {str(key): key for key in known}
            if step not in known:
                before = "/".join(whole.split("/")[: -len(steps)])
                level = [f"{before}/{name}" if before else name for name in known]
                raise UnknownName("path", path, level if before else [*level, *_paths(content)])
            step = known[step]
        here, steps = here[step], steps[count:]
    return plain(here)


def _paths(content: Mapping[str, object]) -> list[str]:
    """Return the paths of all series."""
    kinds = {kind: parts for kind in KINDS if isinstance(parts := content.get(kind), Mapping)}
    return [
        f"{kind}/{part}/{name}"
        for kind, parts in kinds.items() for part, series in parts.items()
        for name in (series if isinstance(series, Mapping) else ())
    ]  # fmt: skip


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim > 0)
