"""Results of all predefined problems before and after a change: equal bits, or within their bounds.

    python -m tests.scripts.same_numbers dump BEFORE        # one JSON file for each task
    python -m tests.scripts.same_numbers dump AFTER         # with the changed code
    python -m tests.scripts.same_numbers compare BEFORE AFTER

`compare` prints each value that differs with its path, both values and their difference over the
largest of its series; exit code 1 when anything is further apart than ``--within`` (default 0:
the last bit counts).
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LONG = ("synthesis",)
"""Kinds of tasks that are dumped on demand only."""


def dump(folder: Path, only: list[str], every: bool) -> int:
    import mechdae as md
    from mechdae.describe.file import library

    folder.mkdir(parents=True, exist_ok=True)
    for problem_name in only or library.names():
        problem = md.load(problem_name)
        for task_name, task in problem.tasks.items():
            if task.kind in LONG and not every:
                continue
            target = folder / f"{problem_name}.{task_name}.json"
            if target.exists():
                continue
            try:
                content = md.solve(problem, task_name).to_dict()
            except md.MechdaeError as error:
                content = {"error": f"{type(error).__name__}: {error}"}
            target.write_text(json.dumps(content), encoding="utf-8")
    return 0


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, part in value.items():
            yield from leaves(part, f"{path}/{key}")
    elif isinstance(value, list):
        if value and all(isinstance(x, int | float | None) for x in value):
            yield path, value
        else:
            for k, part in enumerate(value):
                yield from leaves(part, f"{path}/{k}")
    else:
        yield path, value


def apart(a: Any, b: Any) -> float:
    """Return the largest difference over the largest size; infinite where the kinds differ."""
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        sizes = [abs(x) for x in (*a, *b) if isinstance(x, int | float)]
        gaps = [0.0 if x == y else gap(x, y) for x, y in zip(a, b, strict=True)]
        return max(gaps) / (max(sizes) or 1.0) if max(gaps, default=0.0) else 0.0
    size = max((abs(x) for x in (a, b) if isinstance(x, int | float)), default=1.0) or 1.0
    return gap(a, b) / size


def gap(x: Any, y: Any) -> float:
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (x, y))
    return abs(x - y) if numbers else math.inf


def compare(before: Path, after: Path, within: float) -> int:
    worst = 0.0
    files = sorted(p.name for p in before.glob("*.json"))
    for name in files:
        if not (after / name).exists():
            print(f"{name}: missing")
            worst = math.inf
            continue
        old = dict(leaves(json.loads((before / name).read_text(encoding="utf-8"))))
        new = dict(leaves(json.loads((after / name).read_text(encoding="utf-8"))))
        for path in sorted(old.keys() | new.keys()):
            if path not in old or path not in new:
                print(f"{name}{path}: {'new' if path in new else 'gone'}")
                worst = math.inf
            elif old[path] != new[path]:
                far = apart(old[path], new[path])
                worst = max(worst, far)
                if far > within:
                    print(f"{name}{path}: {far:.2e}")
    print(f"{len(files)} tasks, largest difference {worst:.3g}")
    return 1 if worst > within else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    writing = commands.add_parser("dump")
    writing.add_argument("folder", type=Path)
    writing.add_argument("--only", nargs="*", default=[], metavar="PROBLEM")
    writing.add_argument("--every", action="store_true", help="syntheses too")
    reading = commands.add_parser("compare")
    reading.add_argument("before", type=Path)
    reading.add_argument("after", type=Path)
    reading.add_argument("--within", type=float, default=0.0)
    given = parser.parse_args()
    if given.command == "dump":
        return dump(given.folder, given.only, given.every)
    return compare(given.before, given.after, given.within)


if __name__ == "__main__":
    sys.exit(main())
