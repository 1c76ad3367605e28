"""Formulas and text in the markup of Typst."""

from __future__ import annotations

from mechdae.draw.formulas.plain import signed
from mechdae.draw.formulas.tree import (
    Column,
    Cross,
    Equation,
    Less,
    Letter,
    Listed,
    Norm,
    Number,
    Part,
    Product,
    Quotient,
    Sum,
    Wording,
    stem_and_index,
)

SPECIAL = "\\#$*_`<>@~[]=-+/'\""


def typst(node: Part, *, block: bool = False) -> str:
    """Return a formula between dollar signs; a block has spaces inside them."""
    inner = _inner(node)
    return f"$ {inner} $" if block else f"${inner}$"


def escaped(text: str) -> str:
    """Return words that mean themselves in Typst."""
    return "".join(f"\\{letter}" if letter in SPECIAL else letter for letter in text)


def _inner(node: Part) -> str:
    match node:
        case Letter():
            return _letter(node)
        case Number():
            return _text(signed(node.digits)) + _tail(node.power, node.unit)
        case Column():
            inner = _text("; ").join(_text(signed(text)) for text in node.digits)
            return f"({inner})" + _tail(node.power, node.unit)
        case Wording():
            return _text(node.text)
        case Less():
            return f"-{_inner(node.inner)}"
        case Sum():
            return _sum(node)
        case Product():
            first, *rest = node.factors
            return " dot ".join([_inner(first), *map(_factor, rest)])
        case Cross():
            second = _inner(node.second)
            if isinstance(node.second, Sum | Cross | Product):
                second = f"({second})"
            return f"{_inner(node.first)} times {second}"
        case Quotient():
            return f"({_inner(node.above)})/({_inner(node.below)})"
        case Listed():
            return ", ".join(_inner(own) for own in node.parts)
        case Norm():
            return f"abs({_inner(node.inner)})"
        case Equation():
            return " = ".join(_inner(side) for side in node.sides)
    raise TypeError(f"no Typst for {type(node).__name__}")  # pragma: no cover


def _factor(part: Part) -> str:
    text = _inner(part)
    negative = isinstance(part, Number) and part.digits.startswith("-")
    return f"({text})" if negative else text


def _text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _letter(node: Letter) -> str:
    name = node.text if len(node.text) == 1 else _text(node.text)
    name = f"arrow({name})" if node.vector else name
    index = " ".join(_index(part) for part in node.index)
    mark = node.mark if len(node.mark) < 2 else _text(node.mark)
    mark = f"^({mark})" if mark else ""
    return name + (f"_({index})" if index else "") + mark


def _index(part: str) -> str:
    stem, own = stem_and_index(part)
    letters = stem if len(stem) == 1 else _text(stem) if stem else ""
    if not letters:
        return _text(own)
    return f"{letters}_({_text(own)})" if own else letters


def _tail(power: int, unit: str) -> str:
    text = f" dot 10^({_text(signed(str(power)))})" if power else ""
    if unit:
        text += (" thin " if unit != "°" else "") + _text(unit)
    return text


def _sum(node: Sum) -> str:
    if not node.terms:
        return "0"
    text = _inner(node.terms[0])
    for term in node.terms[1:]:
        if isinstance(term, Less):
            text += " - " + _inner(term.inner)
        elif isinstance(term, Number) and term.digits.startswith("-"):
            text += " - " + _inner(Number(term.digits[1:], term.power, term.unit))
        else:
            text += " + " + _inner(term)
    return text
