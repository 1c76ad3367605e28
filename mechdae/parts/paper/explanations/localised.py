"""Units and numbers of a document in its language: 1.5 m/s is 1,5 м/с in Russian."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass, replace
from typing import Any

from mechdae.draw.formulas import Column, Document, Number, Wording
from mechdae.draw.words import unit_in_russian

NUMBER = re.compile(r"(?<![\w.])(\d+)\.(\d+)(?=(e[-+]?\d+)?(?![\w.]))")
"""A number with decimals that stands by itself."""


def localised(document: Document) -> Document:
    """Return a document with the units and decimal signs of its language."""
    if document.lang != "ru":
        return document
    made: Document = _with_units(document)
    return made


def _with_units(node: Any) -> Any:
    if isinstance(node, tuple):
        return tuple(_with_units(inner) for inner in node)
    if isinstance(node, Number):
        return replace(node, digits=_comma(node.digits), unit=unit_in_russian(node.unit))
    if isinstance(node, Column):
        digits = tuple(map(_comma, node.digits))
        return replace(node, digits=digits, unit=unit_in_russian(node.unit))
    if isinstance(node, str):
        return _comma(node)
    if isinstance(node, Wording):
        return Wording(unit_in_russian(node.text))
    if not is_dataclass(node) or isinstance(node, type):
        return node
    found = {entry.name: getattr(node, entry.name) for entry in fields(node)}
    changed = {
        name: _with_units(value)
        for name, value in found.items()
        if isinstance(value, tuple) or is_dataclass(value)
    }
    return replace(node, **changed)


def _comma(text: str) -> str:
    """Return a number with a decimal comma; other texts, names such as A.B among them, stay."""
    return NUMBER.sub(r"\1,\2", text)
