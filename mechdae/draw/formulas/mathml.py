"""Formulas as MathML, which all browsers show without help."""

from __future__ import annotations

from html import escape

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


def mathml(node: Part, *, block: bool = False) -> str:
    """Return a formula as a ``math`` element; a block stands on a line of its own."""
    display = ' display="block"' if block else ""
    return f"<math{display}>{_row(node)}</math>"


def _row(node: Part) -> str:
    return f"<mrow>{_inner(node)}</mrow>"


def _inner(node: Part) -> str:
    match node:
        case Letter():
            return _letter(node)
        case Number():
            return _number(node.digits) + _tail(node.power, node.unit)
        case Column():
            inner = "<mo>;</mo>".join(_number(text) for text in node.digits)
            return f"<mo>(</mo>{inner}<mo>)</mo>" + _tail(node.power, node.unit)
        case Wording():
            return f"<mtext>{escape(node.text)}</mtext>"
        case Less():
            return f"<mo>&#x2212;</mo>{_inner(node.inner)}"
        case Sum():
            return _sum(node)
        case Product():
            first, *rest = node.factors
            return "<mo>&#x22c5;</mo>".join([_inner(first), *map(_factor, rest)])
        case Cross():
            second = _inner(node.second)
            if isinstance(node.second, Sum | Cross | Product):
                second = f"<mo>(</mo>{second}<mo>)</mo>"
            return f"{_inner(node.first)}<mo>&#xd7;</mo>{second}"
        case Quotient():
            return f"<mfrac>{_row(node.above)}{_row(node.below)}</mfrac>"
        case Listed():
            return "<mo>,</mo>".join(_row(own) for own in node.parts)
        case Norm():
            bars = (f'<mo form="{form}" stretchy="false">|</mo>' for form in ("prefix", "postfix"))
            return _inner(node.inner).join(bars)
        case Equation():
            return "<mo>=</mo>".join(_row(side) for side in node.sides)
    raise TypeError(f"no MathML for {type(node).__name__}")  # pragma: no cover


def _factor(part: Part) -> str:
    text = _inner(part)
    negative = isinstance(part, Number) and part.digits.startswith("-")
    return f"<mo>(</mo>{text}<mo>)</mo>" if negative else text


def _letter(node: Letter) -> str:
    name = f"<mi>{escape(node.text)}</mi>"
    if node.vector:
        name = f'<mover>{name}<mo stretchy="false">&#x2192;</mo></mover>'
    index = "".join(_index(part) for part in node.index)
    index = f"<mrow>{index}</mrow>" if index else ""
    mark = f"<mi>{escape(node.mark)}</mi>" if node.mark else ""
    if index and mark:
        return f"<msubsup>{name}{index}{mark}</msubsup>"
    if index:
        return f"<msub>{name}{index}</msub>"
    return f"<msup>{name}{mark}</msup>" if mark else name


def _index(part: str) -> str:
    stem, own = stem_and_index(part)
    letters = f"<mi>{escape(stem)}</mi>" if stem else ""
    if not stem:
        return f"<mn>{escape(own)}</mn>"
    return f"<msub>{letters}<mn>{escape(own)}</mn></msub>" if own else letters


def _number(digits: str) -> str:
    return f"<mn>{escape(signed(digits))}</mn>"


def _tail(power: int, unit: str) -> str:
    text = ""
    if power:
        text = f"<mo>&#x22c5;</mo><msup><mn>10</mn><mn>{signed(str(power))}</mn></msup>"
    if unit:
        space = "" if unit == "°" else '<mspace width="0.25em"/>'
        text += f"{space}<mtext>{escape(unit)}</mtext>"
    return text


def _sum(node: Sum) -> str:
    if not node.terms:
        return "<mn>0</mn>"
    text = _inner(node.terms[0])
    for term in node.terms[1:]:
        if isinstance(term, Less):
            text += "<mo>&#x2212;</mo>" + _inner(term.inner)
        elif isinstance(term, Number) and term.digits.startswith("-"):
            text += "<mo>&#x2212;</mo>" + _inner(Number(term.digits[1:], term.power, term.unit))
        else:
            text += "<mo>+</mo>" + _inner(term)
    return text
