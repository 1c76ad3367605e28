"""Formulas as Unicode text of one line, as MathML, Typst and mathtext: one walk, four notations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from html import escape

from mechdae.draw.formulas.tree import (
    Column,
    Cross,
    Equation,
    Less,
    Letter,
    Listed,
    Matrix,
    Norm,
    Number,
    Part,
    Product,
    Quotient,
    Root,
    Square,
    Sum,
    Wording,
    stem_and_index,
)
from mechdae.records import dataclass

RAISED = str.maketrans("0123456789-n", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻ⁿ")
MINUS = "−"
SPECIAL = "\\#$*_`<>@~[]=-+/'\""
"""Letters that mean something in Typst outside of formulas."""


@dataclass(frozen=True)
class Notation:
    """How the pieces of a formula are written.

    Parameters
    ----------
    letter, digits, words
        A symbol with its index and mark, a number, plain words in a formula.
    power, unit
        What stands for a power of ten and for a unit behind a number.
    minus, less, plus
        The sign before a term alone, and the signs between two terms.
    times, cross, comma, semicolon, equal
        What stands between two factors, vectors, parts, components, sides.
    brackets, bars
        What is before and behind a term in brackets and a size.
    row, fraction, square, root, matrix
        A formula inside of another one; what is made of two, of one, of rows of them.
    """

    letter: Callable[[Letter], str]
    digits: Callable[[str], str]
    words: Callable[[str], str]
    power: Callable[[int], str]
    unit: Callable[[str], str]
    minus: str = MINUS
    less: str = f" {MINUS} "
    plus: str = " + "
    times: str = "·"
    cross: str = " × "
    comma: str = ", "
    semicolon: str = "; "
    equal: str = " = "
    brackets: tuple[str, str] = ("(", ")")
    bars: tuple[str, str] = ("|", "|")
    row: Callable[[str], str] = str
    fraction: Callable[[str, str], str] | None = None
    square: Callable[[str], str] = lambda text: f"{text}²"
    root: Callable[[str], str] = lambda text: f"√({text})"
    matrix: Callable[[list[list[str]]], str] | None = None

    def write(self, node: Part) -> str:
        """Return a formula in this notation."""
        match node:
            case Letter():
                return self.letter(node)
            case Number():
                return self.digits(node.digits) + self._tail(node)
            case Column():
                inner = self.semicolon.join(map(self.digits, node.digits))
                return inner.join(self.brackets) + self._tail(node)
            case Wording():
                return self.words(node.text)
            case Less():
                return self.minus + self._taken(node.inner)
            case Sum():
                return self._sum(node.terms)
            case Product():
                first = self._bound(node.factors[0]) if isinstance(node.factors[0], Sum) else ""
                factors = map(self._factor, node.factors[1:])
                return self.times.join([first or self.write(node.factors[0]), *factors])
            case Cross():
                return self.write(node.first) + self.cross + self._bound(node.second)
            case Quotient():
                if self.fraction is None:
                    return f"{self._bound(node.above)}/{self._bound(node.below)}"
                above, below = (self.row(self.write(part)) for part in (node.above, node.below))
                return self.fraction(above, below)
            case Listed():
                return self.comma.join(self.row(self.write(part)) for part in node.parts)
            case Norm():
                return self.write(node.inner).join(self.bars)
            case Square():
                text = self._bound(node.inner)
                signless = _without_minus(node.inner) is None
                return self.square(self.row(text if signless else text.join(self.brackets)))
            case Root():
                return self.root(self.write(node.inner))
            case Matrix():
                cells = [[self.write(cell) for cell in row] for row in node.rows]
                if self.matrix is not None:
                    return self.matrix(cells)
                return self.semicolon.join(map(self.comma.join, cells)).join(self.brackets)
            case Equation():
                return self.equal.join(self.row(self.write(side)) for side in node.sides)
        raise TypeError(f"no notation of {type(node).__name__}")  # pragma: no cover

    def _tail(self, node: Number | Column) -> str:
        power = self.power(node.power) if node.power else ""
        return power + (self.unit(node.unit) if node.unit else "")

    def _sum(self, terms: tuple[Part, ...]) -> str:
        text = self.write(terms[0]) if terms else self.digits("0")
        for term in terms[1:]:
            positive = _without_minus(term)
            text += self.plus if positive is None else self.less
            text += self.write(term) if positive is None else self._taken(positive)
        return text

    def _taken(self, node: Part) -> str:
        """Return what stands behind a minus: a minus of its own is in brackets."""
        if isinstance(node, Product) and _without_minus(node) is not None:
            return self.times.join(map(self._factor, node.factors))
        return self._factor(node)

    def _factor(self, node: Part) -> str:
        text = self.write(node)
        plain_text = _without_minus(node) is None and not isinstance(node, Sum)
        return text if plain_text else text.join(self.brackets)

    def _bound(self, node: Part) -> str:
        text = self.write(node)
        return text.join(self.brackets) if isinstance(node, Sum | Product | Cross) else text


def _without_minus(node: Part) -> Part | None:
    """Return a term without the minus that it begins with, None where it begins with none."""
    match node:
        case Less():
            return node.inner
        case Number() if node.digits.startswith("-"):
            return replace(node, digits=node.digits[1:])
        case Product():
            first = _without_minus(node.factors[0])
            return None if first is None else Product((first, *node.factors[1:]))
    return None


def signed(digits: str) -> str:
    """Return the digits with a typographic minus."""
    return digits.replace("-", MINUS)


# -- text --------------------------------------------------------------------------------------


def _plain_letter(node: Letter) -> str:
    index = "".join("".join(stem_and_index(part)) for part in node.index)
    mark = f"^{node.mark}" if node.mark else ""
    return node.text + mark + (f"_{index}" if index else "")


PLAIN = Notation(
    letter=_plain_letter,
    digits=signed,
    words=str,
    power=lambda power: f"·10{str(power).translate(RAISED)}",
    unit=lambda unit: unit if unit == "°" else f" {unit}",
)


def plain(node: Part) -> str:
    """Return a formula as text: ``v_BA = (0.738; −0.174) m/s``."""
    return PLAIN.write(node)


# -- MathML ------------------------------------------------------------------------------------


def _element(name: str) -> Callable[[str], str]:
    return lambda text: f"<{name}>{escape(text)}</{name}>"


_mi, _mn, _mtext = _element("mi"), _element("mn"), _element("mtext")


def _mathml_letter(node: Letter) -> str:
    name = _mi(node.text)
    if node.vector:
        name = f'<mover>{name}<mo stretchy="false">&#x2192;</mo></mover>'
    index = "".join(map(_mathml_index, node.index))
    index = f"<mrow>{index}</mrow>" if index else ""
    mark = _mi(node.mark) if node.mark else ""
    tag = {(True, True): "msubsup", (True, False): "msub", (False, True): "msup"}.get(
        (bool(index), bool(mark))
    )
    return f"<{tag}>{name}{index}{mark}</{tag}>" if tag else name


def _mathml_index(part: str) -> str:
    stem, digits = stem_and_index(part)
    if stem and digits:
        return f"<msub>{_mi(stem)}{_mn(digits)}</msub>"
    return _mi(stem) if stem else _mn(digits)


def _mathml_matrix(cells: list[list[str]]) -> str:
    rows = ("".join(f"<mtd>{cell}</mtd>" for cell in row) for row in cells)
    table = "".join(f"<mtr>{row}</mtr>" for row in rows)
    return f"<mrow><mo>(</mo><mtable>{table}</mtable><mo>)</mo></mrow>"


MATHML = Notation(
    letter=_mathml_letter,
    digits=lambda digits: _mn(signed(digits)),
    words=_mtext,
    power=lambda power: f"<mo>&#x22c5;</mo><msup><mn>10</mn>{_mn(signed(str(power)))}</msup>",
    unit=lambda unit: ("" if unit == "°" else '<mspace width="0.25em"/>') + _mtext(unit),
    minus="<mo>&#x2212;</mo>",
    less="<mo>&#x2212;</mo>",
    plus="<mo>+</mo>",
    times="<mo>&#x22c5;</mo>",
    cross="<mo>&#xd7;</mo>",
    comma="<mo>,</mo>",
    semicolon="<mo>;</mo>",
    equal="<mo>=</mo>",
    brackets=("<mo>(</mo>", "<mo>)</mo>"),
    bars=(
        '<mo form="prefix" stretchy="false">|</mo>',
        '<mo form="postfix" stretchy="false">|</mo>',
    ),
    row=lambda text: f"<mrow>{text}</mrow>",
    fraction=lambda above, below: f"<mfrac>{above}{below}</mfrac>",
    square=lambda text: f"<msup>{text}<mn>2</mn></msup>",
    root=lambda text: f"<msqrt>{text}</msqrt>",
    matrix=_mathml_matrix,
)


def mathml(node: Part) -> str:
    """Return a formula as a ``math`` element, which all browsers show without help."""
    return f"<math>{MATHML.row(MATHML.write(node))}</math>"


# -- Typst -------------------------------------------------------------------------------------


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _single(text: str) -> str:
    """Return a letter as it is, several as words: Typst would take them for factors."""
    return text if len(text) < 2 else _quoted(text)


def _typst_letter(node: Letter) -> str:
    name = _single(node.text) or _quoted("")
    index = " ".join(map(_typst_index, node.index))
    mark = f"^({_single(node.mark)})" if node.mark else ""
    return (f"arrow({name})" if node.vector else name) + (f"_({index})" if index else "") + mark


def _typst_index(part: str) -> str:
    stem, digits = stem_and_index(part)
    if stem and digits:
        return f"{_single(stem)}_({_quoted(digits)})"
    return _single(stem) if stem else _quoted(digits)


TYPST = Notation(
    letter=_typst_letter,
    digits=lambda digits: _quoted(signed(digits)),
    words=_quoted,
    power=lambda power: f" dot 10^({_quoted(signed(str(power)))})",
    unit=lambda unit: ("" if unit == "°" else " thin ") + _quoted(unit),
    minus="-",
    less=" - ",
    times=" dot ",
    cross=" times ",
    semicolon=_quoted("; "),
    bars=("abs(", ")"),
    fraction=lambda above, below: f"({above})/({below})",
    square=lambda text: f"{text}^2",
    root=lambda text: f"sqrt({text})",
    matrix=lambda cells: f"mat({'; '.join(map(', '.join, cells))})",
)


def typst(node: Part, *, block: bool = False) -> str:
    """Return a formula between dollar signs; a block has spaces inside them."""
    inner = TYPST.write(node)
    return f"$ {inner} $" if block else f"${inner}$"


def escaped(text: str) -> str:
    """Return words that mean themselves in Typst."""
    return "".join(f"\\{letter}" if letter in SPECIAL else letter for letter in text)


# -- mathtext ----------------------------------------------------------------------------------


def _mathtext_letter(node: Letter) -> str:
    index = "".join(map(written_letter, node.index))
    text = rf"\mathbf{{{node.text}}}" if node.vector else node.text
    mark = node.mark.replace("τ", r"\tau")
    return text + (f"_{{{index}}}" if index else "") + (f"^{{{mark}}}" if mark else "")


MATHTEXT = replace(PLAIN, letter=_mathtext_letter)


def mathtext(node: Part) -> str:
    r"""Return a formula for matplotlib: ``\mathbf{v}_{BA} = \mathbf{v}_{B}``, no dollar signs."""
    return MATHTEXT.write(node)


def written_letter(letter: str) -> str:
    """Return the mathtext of a letter: numbers at its end as an index."""
    stem, index = stem_and_index(letter)
    stem = stem.replace("_", r"\_").replace(" ", "")
    body = stem if len(stem) < 2 else rf"\mathit{{{stem}}}"
    return body + (f"_{{{index}}}" if index else "")
