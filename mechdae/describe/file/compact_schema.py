"""A JSON Schema in which what occurs several times stands once, under ``$defs``."""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mechdae.types import Json

INNER, SEVERAL = ("additionalProperties", "items"), ("oneOf", "anyOf", "allOf")
"""Keywords that hold a schema, or a list of them."""
NOTES = ("description", "examples")
LONG = 300
"""Length of a text to which notes are added where they stand."""
SHORT = 60
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
