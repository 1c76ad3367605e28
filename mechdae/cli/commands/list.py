"""``mechdae list``: reads titles and kinds only, imports no numerics."""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from mechdae.cli.progress import say
from mechdae.describe.file import library

if TYPE_CHECKING:
    from mechdae.types import Json


TEXT = re.compile(r' *= *"([^"\\]*)" *(?:#.*)?$')
TASK = re.compile(r"\[tasks\.\w+\] *(?:#.*)?$")
OF_TASK = re.compile(r"\[\[?tasks\.\w+\.")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="a list of {name, kinds, title}")


def run(options: argparse.Namespace) -> int:
    entries = [scanned(path) for path in library.paths()]
    if options.json:
        print(json.dumps(entries, ensure_ascii=False))
        return 0
    width = max((len(entry["name"]) for entry in entries), default=0)
    for entry in entries:
        kinds = ",".join(entry["kinds"])
        say(f"{entry['name']:{width}}  {kinds:12}  {entry['title']}", width + 2)
    return 0


def scanned(path: Path) -> Json:
    """Return name, kinds of tasks and title of a problem file.

    Its lines are read, not parsed, as long as title and kinds stand in lines of their own.
    """
    text = path.read_text(encoding="utf-8")
    title, kinds = _lines(text) or ("", [])
    if not title or not kinds:
        data = tomllib.loads(text)
        title = data.get("title", "")
        kinds = [str(task.get("kind", "")) for task in data.get("tasks", {}).values()]
    return {"name": path.stem, "kinds": sorted(set(kinds)), "title": title}


def _lines(text: str) -> tuple[str, list[str]] | None:
    """Return title and kinds of tasks, None for a file that is written in an unusual way."""
    kinds: list[str] = []
    title, top, task = "", True, False
    if '"""' in text or "'''" in text:
        return None  # a line may be one of a text
    for line in text.splitlines():
        if line.startswith("["):
            new = TASK.match(line) is not None
            if task or (not new and "tasks" in line[:8] and not OF_TASK.match(line)):
                return None
            top, task = False, new
        elif line.startswith("title" if top else "kind") and (top or task):
            found = TEXT.match(line, 5 if top else 4)
            if found is None:
                return None
            title, kinds = (found[1], kinds) if top else (title, [*kinds, found[1]])
            task = False
        elif top and line.startswith("tasks"):
            return None
    return None if task else (title, kinds)
