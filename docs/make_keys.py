"""Writes ``docs/reference/keys.md``: every key of the problem file, from its JSON Schema.

``python docs/make_keys.py`` writes; with ``--check`` the exit code is 1 where the page is old.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mechdae.describe.file.schema import schema
from mechdae.describe.units import TABLE

PAGE = Path(__file__).with_name("reference") / "keys.md"
HEAD = """# All keys of the problem file

Generated from the JSON Schema (`mechdae schema`) by `docs/make_keys.py`. Required keys are bold.
A number may be an expression in quotes. Keys with a dimension take
[unit suffixes](problem-file.md#numbers-units-names). What the keys mean is on the pages
[problem file](problem-file.md), [joints](joints.md), [tasks](tasks.md), [forces](forces.md),
[motion](motion.md) and [synthesis](synthesis.md).
"""
SUFFIXES = {unit.suffix for unit in TABLE} | {
    "_m", "_rad", "_s", "_kg", "_N", "_N_m", "_kg_m2", "_m_s", "_m_s2", "_rad_s2", "_W", "_J",
    "_Pa", "_N_per_m", "_N_s_per_m", "_N_m_per_rad", "_N_m_s_per_rad",
}  # fmt: skip


def main(arguments: list[str]) -> int:
    """Write the page, or say whether it is current."""
    text = page(schema())
    if "--check" in arguments:
        return int(PAGE.read_text(encoding="utf-8") != text)
    PAGE.write_text(text, encoding="utf-8")
    return 0


def page(whole: dict[str, Any]) -> str:
    """Return the page of a schema."""
    defs = whole.get("$defs", {})
    parts = [HEAD, table("Top level", resolved(whole, defs), defs)]
    for caption, name in SECTIONS:
        parts += sections(caption, resolved(whole["properties"][name], defs), defs)
    inner: dict[str, dict[str, Any]] = {}
    for task in inside(resolved(whole["properties"]["tasks"], defs), defs):
        for key, spec in task.get("properties", {}).items():
            if key in ("goal", "constraints", "driver", "events", "find"):
                inner.setdefault(key, resolved(spec, defs))
    for key, entry in inner.items():
        parts += sections(f"{key.capitalize()}", entry, defs)
    return "\n".join(parts)


SECTIONS = (
    ("Bodies", "bodies"), ("Joints", "joints"), ("Vectors", "vectors"), ("Nodes", "nodes"),
    ("Loads", "loads"), ("Tasks", "tasks"),
)  # fmt: skip


def resolved(entry: dict[str, Any], defs: dict[str, Any]) -> dict[str, Any]:
    """Return a schema with what it refers to."""
    return resolved(defs[entry["$ref"].rsplit("/", 1)[1]], defs) if "$ref" in entry else entry


def inside(entry: dict[str, Any], defs: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the descriptions of objects with keys of their own."""
    entry = resolved(entry, defs)
    if entry.get("properties"):
        yield entry
        return
    for more in (*entry.get("oneOf", ()), *entry.get("anyOf", ())):
        yield from inside(more, defs)
    for word in ("additionalProperties", "items"):
        if isinstance(entry.get(word), dict):
            yield from inside(entry[word], defs)


def sections(caption: str, entry: dict[str, Any], defs: dict[str, Any]) -> Iterator[str]:
    """Yield a heading and the tables of the kinds below it."""
    kinds = list(inside(entry, defs))
    yield f"## {caption}\n"
    done: set[str] = set()
    seen: set[str] = set()
    for kind in kinds:
        name = kind_of(kind, defs)
        seen.add("space" if name in seen and caption == "Joints" else name)
        text = table(f"{name} in space" if "space" in seen else name, kind, defs, "###")
        if text not in done:
            done.add(text)
            yield text


def kind_of(entry: dict[str, Any], defs: dict[str, Any]) -> str:
    """Return the name of a kind, with the dimension that it belongs to if it needs an axis."""
    kind = resolved(entry["properties"].get("kind", {}), defs)
    return str(kind.get("const") or " ".join(kind.get("enum", ())))


def table(name: str, entry: dict[str, Any], defs: dict[str, Any], level: str = "##") -> str:
    """Return the table of the keys of one object."""
    keys = entry["properties"]
    lines = [f"{level} {name}\n"] if name else []
    lines += ["| key | holds | example |", "|---|---|---|"]
    for key, spec in keys.items():
        bases = {key.removesuffix(suffix) for suffix in SUFFIXES if key.endswith(suffix)}
        if key == "kind" or bases & set(keys):
            continue
        shown = f"**`{key}`**" if key in entry.get("required", ()) else f"`{key}`"
        value = resolved(spec, defs)
        example = spec.get("examples") or value.get("examples") or [""]
        plain = example[0] in ("", "2*r") or not isinstance(example[0], str | list | dict)
        text = "" if plain else f"`{cell(json.dumps(example[0], ensure_ascii=False))}`"
        bare = rf"^{key.replace('_', ' ')}(: | (?=\[)|$)"  # the key's name says nothing more
        words = re.sub(bare, "", holds(spec, defs))
        lines.append(f"| {shown} | {cell(words)} | {text} |")
    return "\n".join(lines) + "\n"


def cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|")


def holds(spec: dict[str, Any], defs: dict[str, Any]) -> str:
    """Return what a key holds, in words."""
    value = resolved(spec, defs)
    text = spec.get("description") or value.get("description") or ""
    choices = value.get("enum") or [
        one["const"] for one in value.get("oneOf", ()) if "const" in one
    ]
    if choices:
        text += (": " if text else "") + ", ".join(f"`{json.dumps(one)}`" for one in choices)
    if "const" in value:
        text += f"`{json.dumps(value['const'])}`"
    types = {"string": "text", "array": "list", "object": "table", "boolean": "true or false"}
    kind = str(value.get("type", "number"))
    return text or types.get(kind, kind)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
