"""Formulas as Unicode text of one line."""

from __future__ import annotations

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

RAISED = str.maketrans("0123456789-n", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻ⁿ")
MINUS = "−"


def plain(node: Part) -> str:
    """Return a formula as text: ``v_BA = (0.738; −0.174) m/s``."""
    match node:
        case Letter():
            index = "".join(_index(part) for part in node.index)
            mark = f"^{node.mark}" if node.mark else ""
            return node.text + mark + (f"_{index}" if index else "")
        case Number():
            return signed(node.digits) + tail(node.power, node.unit)
        case Column():
            inner = "; ".join(signed(text) for text in node.digits)
            return f"({inner})" + tail(node.power, node.unit)
        case Wording():
            return node.text
        case Less():
            return MINUS + plain(node.inner)
        case Sum():
            return _joined([plain(term) for term in node.terms])
        case Product():
            first, *rest = node.factors
            return "·".join([plain(first), *map(_factor, rest)])
        case Cross():
            return f"{plain(node.first)} × {_bound(node.second)}"
        case Quotient():
            return f"{_bound(node.above)}/{_bound(node.below)}"
        case Listed():
            return ", ".join(plain(own) for own in node.parts)
        case Norm():
            return f"|{plain(node.inner)}|"
        case Equation():
            return " = ".join(plain(side) for side in node.sides)
    raise TypeError(f"no text for {type(node).__name__}")  # pragma: no cover


def signed(digits: str) -> str:
    """Return the digits with a typographic minus."""
    return digits.replace("-", MINUS)


def tail(power: int, unit: str) -> str:
    """Return the power of ten and the unit as they follow a number."""
    text = f"·10{str(power).translate(RAISED)}" if power else ""
    space = "" if unit in ("", "°") else " "
    return f"{text}{space}{unit}"


def _index(part: str) -> str:
    stem, own = stem_and_index(part)
    return stem + own


def _factor(part: Part) -> str:
    text = plain(part)
    return f"({text})" if text.startswith(MINUS) else text


def _bound(node: Part) -> str:
    text = plain(node)
    return f"({text})" if isinstance(node, Sum | Product | Cross) else text


def _joined(terms: list[str]) -> str:
    text = terms[0] if terms else "0"
    for term in terms[1:]:
        text += f" {MINUS} {term[1:]}" if term.startswith(MINUS) else f" + {term}"
    return text
