"""``mechdae list``: reads titles and kinds only, imports no numerics."""

from __future__ import annotations

import argparse
import json
import tomllib
from typing import Any

from mechdae.describe.file import library


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="a list of {name, kinds, title}")


def run(options: argparse.Namespace) -> int:
    entries = [_entry(name) for name in library.names()]
    if options.json:
        print(json.dumps(entries, ensure_ascii=False))
        return 0
    width = max((len(entry["name"]) for entry in entries), default=0)
    for entry in entries:
        print(f"{entry['name']:{width}}  {','.join(entry['kinds']):12}  {entry['title']}")
    return 0


def _entry(name: str) -> dict[str, Any]:
    data = tomllib.loads(library.find(name).read_text(encoding="utf-8"))
    kinds = sorted({str(task.get("kind", "")) for task in data.get("tasks", {}).values()})
    return {"name": name, "kinds": kinds, "title": data.get("title", "")}
