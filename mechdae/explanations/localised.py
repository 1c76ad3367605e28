"""Units of a document in its language: m/s is м/с in Russian."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

from mechdae.draw.translated import unit_in_russian
from mechdae.formulas import Column, Document, Number, Wording


def localised(document: Document) -> Document:
    """Return a document with the units of its numbers and heads in its language."""
    if document.lang != "ru":
        return document
    made: Document = _with_units(document)
    return made


def _with_units(node: Any) -> Any:
    if isinstance(node, tuple):
        return tuple(_with_units(own) for own in node)
    if isinstance(node, Number | Column):
        return replace(node, unit=unit_in_russian(node.unit))
    if isinstance(node, Wording):
        return Wording(unit_in_russian(node.text))
    if not is_dataclass(node) or isinstance(node, type):
        return node
    found = {own.name: getattr(node, own.name) for own in fields(node)}
    changed = {
        name: _with_units(value)
        for name, value in found.items()
        if isinstance(value, tuple) or is_dataclass(value)
    }
    return replace(node, **changed)
