"""The JSON Schema of the problem file, from the fields that read it; a compact one."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from mechdae.describe.field_docs import about
from mechdae.describe.file.load import SCHEMA, TOP
from mechdae.describe.file.problem import Expected
from mechdae.describe.file.reading import NESTED, suffixes
from mechdae.describe.file.repeat import KEYS
from mechdae.describe.kinds import JOINTS, LOADS, SPATIAL_JOINTS
from mechdae.describe.mechanism import TOLERANCE, Body, Ground
from mechdae.describe.tasks.constraints import Choices, Region
from mechdae.describe.tasks.kinds import TASKS
from mechdae.describe.units import EVERY
from mechdae.describe.values import WITH_UNIT, Value
from mechdae.describe.vectors.values import Node, Vector

if TYPE_CHECKING:
    from mechdae.types import Json

NUMBER = {"oneOf": [{"type": "number"}, {"type": "string", "description": "an expression"}]}
HOLE = r"\{[^{}]*\}"
"""A whole number in braces, ``{k-1}``."""
NAMES = rf"^([A-Za-z_]|{HOLE})([A-Za-z0-9_]|{HOLE})*$"
FILLED = {"type": "string", "pattern": f"^{HOLE}$"}
COUNT = {"type": "string", "description": "a whole number, an expression over [sizes]"}


def _rows(*sizes: int) -> dict[str, Any]:
    """Return the schema of rows of numbers, all of one of the sizes, two at least."""
    rows = [
        {"type": "array", "items": NUMBER, "minItems": size, "maxItems": size} for size in sizes
    ]
    every = [{"type": "array", "items": row, "minItems": 2} for row in rows]
    return every[0] if len(every) == 1 else {"oneOf": every}


EXAMPLES: Json = {
    **dict.fromkeys(("number", "expression", "moment", "inertia"), "2*r"),
    "law": "10*t", "whole": 36, "natural": 2, "numbers": [0, 0.5], "pair": [0.1, 0.3],
    "components": [0, -9.81], "direction": [0, 0, 1], "names": ["rod.B", "slider"],
    "outline": ["A", "B", "P"], "points": {"A": [0, 0], "B": ["r", 0]}, "reference": "rod.B",
    "pairs": [[0, 0.1], [1, 0.3]], "places": [[0.1, 0.2], [0.2, 0.3]],
    "coordinates": {"crank": 0.5}, "start": {"crank": 0.5}, "lists": {"r": [0.1, 0.12]},
    "grid": {"r": [0.1, 0.2, 5]}, "freedoms": {"r": [0.05, 0.2]},
}  # fmt: skip
"""Values of keys by the kind of what they hold."""
_KINDS: dict[str, dict[str, Any]] = {
    "number": NUMBER,
    "expression": NUMBER,
    "name": {"type": "string", "pattern": NAMES},
    "text": {"type": "string"},
    "law": {"type": "string", "description": "an expression of the time t"},
    "whole": {"oneOf": [{"type": "integer", "minimum": 1}, FILLED]},
    "natural": {"oneOf": [{"type": "integer", "minimum": 0}, FILLED]},
    "flag": {"type": "boolean"},
    "numbers": {"type": "array", "items": NUMBER},
    "pair": {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2},
    "rows": {
        "type": "array",
        "minItems": 2,
        "items": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
    },
    "components": {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 3},
    "direction": {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
    "moment": {
        "oneOf": [
            *NUMBER["oneOf"],
            {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
        ]
    },
    "inertia": {
        "oneOf": [
            *NUMBER["oneOf"],
            {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
            {"type": "array", "items": NUMBER, "minItems": 6, "maxItems": 6},
        ]
    },
    "names": {"type": "array", "items": {"type": "string"}},
    "outline": {"type": "array", "items": {"type": "string"}},
    "points": {
        "type": "object",
        "additionalProperties": {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 3},
    },
    "reference": {"type": "string", "pattern": rf"^(\w|{HOLE})+\.(\w|{HOLE})+$"},
    "pairs": _rows(2),
    "places": _rows(2, 3),
    "poses": _rows(3, 7),
    "start": {
        "type": "object",
        "additionalProperties": {"oneOf": [*NUMBER["oneOf"], {"type": "object"}]},
    },
    "coordinates": {"type": "object", "additionalProperties": NUMBER},
    "lists": {
        "type": "object",
        "additionalProperties": {"type": "array", "items": NUMBER, "minItems": 1},
    },
    "grid": {
        "type": "object",
        "additionalProperties": {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
    },
    "free": {},
}


def schema() -> Json:
    """Return the JSON Schema (draft 2020-12) of schema 1."""
    sections = _sections()
    properties: dict[str, Json] = {
        "schema": {"const": SCHEMA},
        "title": {"type": "string"},
        "source": {"type": "string"},
        "dimension": {"enum": [2, 3]},
        "frames": {"const": "drawn"},
        "gravity": _KINDS["components"],
        TOLERANCE: NUMBER,
        "sizes": {"type": "object", "additionalProperties": {"type": "integer"}},
        **sections,
        "tasks": {"type": "object", "additionalProperties": {"oneOf": _tasks()}},
        "expected": {"type": "array", "items": _object(Expected)},
        "repeat": {"type": "object", "additionalProperties": _cell(sections)},
    }
    assert set(properties) == set(TOP)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:mechdae:problem-file:{SCHEMA}",
        "title": "mechdae problem file",
        "type": "object",
        "required": ["schema"],
        "anyOf": [
            {"required": ["bodies", "joints"]},
            {"required": ["vectors", "loops"]},
            {"required": ["repeat"]},
            {"required": ["tasks"], "properties": {"tasks": {"additionalProperties": _bare()}}},
        ],
        "additionalProperties": False,
        "properties": properties | {f"{TOLERANCE}{u}": NUMBER for u in suffixes("m", EVERY)},
    }


def _bare() -> dict[str, Any]:
    """Return the schema of tasks that need no mechanism in their file."""
    kinds = [word for word, kind in TASKS.items() if kind.bare_mechanism() is not None]
    return {"properties": {"kind": {"const": kinds[0]} if len(kinds) == 1 else {"enum": kinds}}}


def _sections() -> dict[str, Json]:
    """Return the tables that describe the mechanism, of the file and of a cell alike."""
    numbers = {"type": "object", "additionalProperties": NUMBER}
    return {
        "parameters": numbers,
        "ground": _object(Ground),
        "bodies": {"type": "object", "additionalProperties": _object(Body, ("name",))},
        "joints": {"type": "object", "additionalProperties": {"oneOf": _joints()}},
        "vectors": {"type": "object", "additionalProperties": _object(Vector, ("name",))},
        "loops": {
            "type": "object",
            "additionalProperties": {"type": "array", "items": {"type": "string"}, "minItems": 2},
        },
        "nodes": {"type": "object", "additionalProperties": _object(Node, ("name",))},
        "sketch": {
            "type": "object",
            "additionalProperties": {"oneOf": [*NUMBER["oneOf"], _KINDS["direction"]]},
        },
        "loads": {
            "type": "object",
            "additionalProperties": {
                "oneOf": [_object(kind, ("name",), kind=word) for word, kind in LOADS.items()]
            },
        },
        "outputs": {"type": "object", "additionalProperties": {"type": "string"}},
    }


def _cell(sections: dict[str, Json]) -> Json:
    """Return the schema of one ``[repeat.NAME]``."""
    whole = {"oneOf": [{"type": "integer"}, COUNT]}
    assert {"count", "from", *sections} == set(KEYS)
    return {
        "type": "object",
        "required": ["count"],
        "additionalProperties": False,
        "properties": {
            "count": {**whole, "description": "number of copies"},
            "from": {**whole, "description": "k of the first copy, 1 by default"},
            **sections,
        },
    }


def _joints() -> list[Json]:
    between = {"type": "array", "items": _KINDS["reference"], "minItems": 2, "maxItems": 2}
    entries = []
    spatial = [(w, kind) for w, kind in SPATIAL_JOINTS.items() if kind is not JOINTS.get(w)]
    for word, kind in [*JOINTS.items(), *spatial]:
        entry = _object(kind, ("name", "first", "second"), kind=word)
        if kind.spatial and word in JOINTS and "axis" not in entry["required"]:
            entry["required"].append("axis")  # without one it is as in the plane
        if not kind.spatial and kind is not JOINTS[word]:  # wheels in space: by a key of theirs
            flat = _object(JOINTS[word], kind=word)["properties"]
            forms = [form for form in entry["properties"] if form not in flat]
            entry["anyOf"] = [{"required": [form]} for form in forms]
        entry["properties"]["between"] = between
        entry["required"].append("between")
        entries.append(entry)
    return entries


def _tasks() -> list[Json]:
    return [_object(kind, kind=word) for word, kind in TASKS.items()]


def _kind(word: str) -> Json:
    """Return the schema of a kind of value."""
    nested = NESTED.get(word)
    if nested is not None:
        entries = [_object(kind, kind=name) for name, kind in nested.classes.items()]
        one = entries[0] if len(entries) == 1 else {"oneOf": entries}
        return {"type": "array", "items": one} if nested.several else one
    if word == "freedoms":
        entries = [_KINDS["pair"], _object(Choices), _object(Region)]
        return {"type": "object", "minProperties": 1, "additionalProperties": {"oneOf": entries}}
    return dict(_KINDS[word])


def _object(description: type[Value], skip: tuple[str, ...] = (), kind: str = "") -> Json:
    properties: dict[str, Json] = {"kind": {"const": kind}} if kind else {}
    needed = ["kind"] if kind else []
    either: list[Json] = []
    for entry in fields(description):
        word = entry.metadata.get("kind")
        if entry.name in skip or word is None:
            continue
        name = entry.name.rstrip("_")
        value = _kind(word) | {"description": about(entry)}
        if word in EXAMPLES:
            value["examples"] = [EXAMPLES[word]]
        choices = list(entry.metadata["choices"])
        if choices and word == "names":
            value["items"] = {"enum": choices}
        elif choices:
            value["enum"] = choices
        forms = [name]
        if word in WITH_UNIT:
            unit = entry.metadata["unit"]
            among = {end: one for end, one in EVERY.items() if unit or "per" not in end}
            forms += [f"{name}{suffix}" for suffix in suffixes(unit, among)]
        properties |= dict.fromkeys(forms, value)
        if entry.metadata["required"] and len(forms) == 1:
            needed.append(name)
        elif entry.metadata["required"]:
            either.append({"oneOf": [{"required": [form]} for form in forms]})
    result = {
        "type": "object",
        "properties": properties,
        "required": needed,
        "additionalProperties": False,
    }
    return result | ({"allOf": either} if either else {})


INNER, SEVERAL = ("additionalProperties", "items"), ("oneOf", "anyOf", "allOf")
"""Keywords that hold a schema, or a list of them."""
NOTES = ("description", "examples")
LONG = 300
"""Length of a text to which notes are added where they stand."""
SHORT = 45
"""Length of a text that is no longer than a reference to it."""
NUMBERS = "\0"
"""Mark of a part's number in a text."""


class _Parts:
    """Schemas, each different one once, as texts in which others are numbers."""

    def __init__(self) -> None:
        self.numbers: dict[str, int] = {}
        self.nodes: list[Json] = []
        self.words: list[str] = []
        self.sizes: list[int] = []
        self.uses: Counter[str] = Counter()

    def enter(self, node: object, word: str) -> object:
        """Return the number of a schema, which is entered under a word; what is none as it is."""
        if not isinstance(node, dict):
            return node
        notes = {key: node[key] for key in NOTES if key in node}
        plain = {key: part for key, part in node.items() if key not in NOTES}
        if notes and len(json.dumps(plain)) > LONG:
            return self._number({"$ref": self.enter(plain, word), **notes}, word)
        short: Json = {}
        for key, value in node.items():
            if key == "properties":
                short[key] = {name: self.enter(part, name) for name, part in value.items()}
            elif key in INNER:
                short[key] = self.enter(value, word)
            elif key in SEVERAL:
                short[key] = [self.enter(part, word) for part in value]
            else:
                short[key] = value
        return self._number(short, word)

    def _number(self, short: Json, word: str) -> str:
        """Return the number of a schema whose parts are numbers."""
        text = json.dumps(short)
        if text not in self.numbers:
            self.numbers[text] = len(self.nodes)
            self.nodes.append(short)
            self.words.append(word)
            inside = re.findall(r"\\u0000(\d+)", text)
            self.sizes.append(len(text) + sum(self.sizes[int(part)] for part in inside))
            self.uses.update(inside)
        return f"{NUMBERS}{self.numbers[text]}"


def compact(schema: Json) -> Json:
    """Return a schema that says the same and is shorter."""
    parts = _Parts()
    whole = str(parts.enter(schema, "file"))
    names: dict[str, str] = {}
    for number in range(len(parts.nodes)):
        key = f"{NUMBERS}{number}"
        if parts.uses[str(number)] > 1 and parts.sizes[number] > SHORT:
            word = parts.words[number]
            taken = set(names.values())
            names[key] = next(
                name for k in range(1, len(parts.nodes) + 1)
                if (name := word if k == 1 else f"{word}_{k}") not in taken
            )  # fmt: skip

    def written(value: object, at: str = "") -> object:
        if isinstance(value, str) and value[:1] == NUMBERS:
            if value in names and value != at:
                return {"$ref": f"#/$defs/{names[value]}"}
            return written(parts.nodes[int(value[1:])])
        if isinstance(value, dict):
            found: Json = {key: written(part) for key, part in value.items()}
            inner = found.pop("$ref", None)  # what notes are about
            return {**inner, **found} if isinstance(inner, dict) else found
        return [written(part) for part in value] if isinstance(value, list) else value

    file = written(whole, whole)
    assert isinstance(file, dict)
    return file | {"$defs": {name: written(key, key) for key, name in names.items()}}
