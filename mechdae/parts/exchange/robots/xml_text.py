"""XML as text: numbers that read back equal, comments, indentation; the same bytes each time."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree as ET

Element = ET.Element
SMALLEST = 1e-300


def number(value: float) -> str:
    """Return a number with the digits that give the same float back, whole ones without a point."""
    value = float(value)
    return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


def numbers(values: Iterable[float]) -> str:
    return " ".join(number(value) for value in values)


def put(parent: Element, tag: str, text: str = "", **attributes: Any) -> Element:
    """Return a new child; lists become numbers."""
    child = ET.SubElement(parent, tag)
    for name, value in attributes.items():
        word = value if isinstance(value, str) else None
        if word is None:
            single = isinstance(value, int | float)
            word = number(value) if single else numbers(value)
        child.set(name.rstrip("_"), word)
    if text:
        child.text = text
    return child


def remark(parent: Element, text: str) -> None:
    """Put a comment."""
    parent.append(ET.Comment(f" {text.replace('--', '- -')} "))


def document(root: Element) -> str:
    ET.indent(root, "  ")
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
