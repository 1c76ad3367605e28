"""What a formula is made of; numbers in it are rounded when it is made, once for all writers."""

from __future__ import annotations

from dataclasses import field, replace
from math import floor, isfinite, log10

from mechdae.records import dataclass

SIGNIFICANT = 5
"""Digits of the largest number of an equation; the others have as many decimals."""
PLAIN = (-3, 6)
"""Powers of ten of the largest number between which no power of ten is split off."""


@dataclass(frozen=True)
class Part:
    """Base of all parts of a formula."""


@dataclass(frozen=True)
class Letter(Part):
    """A symbol: ``Letter("v", ("B", "A"), "n", vector=True)`` is the vector v with index BA.

    Parameters
    ----------
    text
        The letter itself, Greek ones as they are: ``ω``.
    index
        Parts of the index, written one after the other; one of them may have an index of its
        own after ``_`` or digits: ``A_3``.
    mark
        Above right: n, τ, k, r.
    vector
        Whether it is one.
    """

    text: str
    index: tuple[str, ...] = ()
    mark: str = ""
    vector: bool = False


@dataclass(frozen=True)
class Unrounded:
    """What numbers were before they were rounded, for other units.

    Parameters
    ----------
    values
        Of a number one, of a column its components [``unit``].
    alike
        Those that are rounded alike.
    unit
        Theirs in SI, also where it is not written.
    significant
        Digits of the largest.
    """

    values: tuple[float, ...]
    alike: tuple[float, ...]
    unit: str
    significant: int


@dataclass(frozen=True)
class Number(Part):
    """A rounded number, times a power of ten, with its unit."""

    digits: str
    power: int = 0
    unit: str = ""
    exact: Unrounded | None = field(default=None, compare=False, repr=False)

    @property
    def value(self) -> float:
        """What is printed, as a float."""
        return _read(self.digits, self.power)


@dataclass(frozen=True)
class Column(Part):
    """Components of a vector, rounded alike, times one power of ten, with their unit."""

    digits: tuple[str, ...]
    power: int = 0
    unit: str = ""
    exact: Unrounded | None = field(default=None, compare=False, repr=False)

    @property
    def values(self) -> tuple[float, ...]:
        """What is printed, as floats."""
        return tuple(_read(text, self.power) for text in self.digits)

    @property
    def components(self) -> tuple[Number, ...]:
        """Its numbers one by one, without their unit."""
        exact = self.exact
        if exact is None:
            return tuple(Number(text, self.power) for text in self.digits)
        return tuple(
            Number(text, self.power, exact=replace(exact, values=(value,)))
            for text, value in zip(self.digits, exact.values, strict=True)
        )


def _read(digits: str, power: int) -> float:
    """Return printed digits as a number, with a decimal point or comma."""
    return float(f"{digits.replace(',', '.')}e{power}")


@dataclass(frozen=True)
class Wording(Part):
    """Plain words in a formula."""

    text: str


@dataclass(frozen=True)
class UnitName(Wording):
    """The name of the unit of numbers that stand elsewhere."""


@dataclass(frozen=True)
class Less(Part):
    """A term of a sum that is subtracted."""

    inner: Part


@dataclass(frozen=True)
class Sum(Part):
    """Terms that are added; numbers below zero and what is `Less` are subtracted."""

    terms: tuple[Part, ...]


@dataclass(frozen=True)
class Product(Part):
    """Factors side by side."""

    factors: tuple[Part, ...]


@dataclass(frozen=True)
class Cross(Part):
    """The vector product of two vectors; a second one that is a product itself is in brackets."""

    first: Part
    second: Part


@dataclass(frozen=True)
class Quotient(Part):
    """A fraction."""

    above: Part
    below: Part


@dataclass(frozen=True)
class Norm(Part):
    """The length of a vector, or the size of a number."""

    inner: Part


@dataclass(frozen=True)
class Square(Part):
    """The square of a letter, or of what stands in brackets."""

    inner: Part


@dataclass(frozen=True)
class Root(Part):
    """The square root."""

    inner: Part


@dataclass(frozen=True)
class Matrix(Part):
    """Rows of parts in brackets: a column of letters, or the matrix of a linear system."""

    rows: tuple[tuple[Part, ...], ...]


@dataclass(frozen=True)
class Listed(Part):
    """Parts with commas between them."""

    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Equation(Part):
    """Sides that are equal, each to the next."""

    sides: tuple[Part, ...]


def decimals(*values: float, significant: int = SIGNIFICANT) -> tuple[int, int]:
    """Return the decimals and the power of ten with which numbers of one equation are printed.

    The largest of them gets so many significant digits.
    """
    largest = max((abs(value) for value in values if isfinite(value)), default=0.0)
    if not largest:
        return 0, 0
    power = floor(log10(largest))
    if power < PLAIN[0] or power >= PLAIN[1]:
        return significant - 1, power
    return max(0, significant - 1 - power), 0


def rounded(value: float, places: int, power: int = 0) -> str:
    """Return a number over ten to a power with so many decimals; no minus before zero."""
    if not isfinite(value):
        return "–"
    text = f"{value / 10.0**power:.{places}f}"
    return text.lstrip("-") if not float(text) else text


def number(value: float, unit: str = "", significant: int = SIGNIFICANT, of: str = "") -> Number:
    """Return a number with so many significant digits; `of` is a unit that is not written."""
    return replace(like(value, (value,), of or unit, significant), unit=unit)


def like(
    value: float, others: tuple[float, ...], of: str = "", significant: int = SIGNIFICANT
) -> Number:
    """Return a number rounded as others are; its unit `of` is not written."""
    places, power = decimals(*others, significant=significant)
    exact = Unrounded((value,), others, of, significant)
    return Number(rounded(value, places, power), power, exact=exact)


def columns(*vectors: tuple[float, ...], unit: str = "") -> tuple[Column, ...]:
    """Return vectors of one equation, rounded alike; the unit stands with the last."""
    alike = tuple(value for vector in vectors for value in vector)
    places, power = decimals(*alike)
    last = len(vectors) - 1
    return tuple(
        Column(
            tuple(rounded(value, places, power) for value in vector),
            power,
            unit if k == last else "",
            Unrounded(vector, alike, unit, SIGNIFICANT),
        )
        for k, vector in enumerate(vectors)
    )


def numbers(*values: float, unit: str = "") -> tuple[Number, ...]:
    """Return numbers of one equation, rounded alike; the unit stands with the last."""
    shown = [like(value, values, unit) for value in values]
    return (*shown[:-1], *(replace(one, unit=unit) for one in shown[-1:]))


def stem_and_index(text: str) -> tuple[str, str]:
    """Return the letters of a name and the digits after them: ``A_3`` -> A and 3."""
    stem = text.rstrip("0123456789_,")
    rest = ",".join(part for part in text[len(stem) :].split("_") if part)
    return stem, rest


@dataclass(frozen=True)
class Passage:
    """Base of what a section holds."""


@dataclass(frozen=True)
class Note(Passage):
    """A paragraph: words and formulas in the order of the line."""

    parts: tuple[str | Part, ...]


@dataclass(frozen=True)
class Formula(Passage):
    """A formula on a line of its own.

    ``unit`` and ``gap`` tell how far it is from closing before it was rounded, None where it
    states a value.
    """

    node: Part
    gap: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Facts(Passage):
    """Pairs of a name and what it is: words or formulas."""

    rows: tuple[tuple[str, tuple[str | Part, ...]], ...]


@dataclass(frozen=True)
class Grid(Passage):
    """A table: heads, and rows of words or formulas."""

    heads: tuple[str | Part, ...]
    rows: tuple[tuple[str | Part, ...], ...]


@dataclass(frozen=True)
class Image(Passage):
    """A picture as SVG text, and what it shows."""

    svg: str
    caption: str
    width: float = 1.0


@dataclass(frozen=True)
class Section:
    """A heading, blocks below it, and sections inside; pictures that stay beside all of it."""

    title: str
    blocks: tuple[Passage, ...] = ()
    sections: tuple[Section, ...] = ()
    beside: tuple[Image, ...] = ()


@dataclass(frozen=True)
class Document:
    """A titled sequence of sections, in a language (``en`` or ``ru``); pictures beside them."""

    title: str
    subtitle: str = ""
    sections: tuple[Section, ...] = ()
    lang: str = "en"
    beside: tuple[Image, ...] = ()
