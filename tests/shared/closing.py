"""Whether what an explanation prints closes: the printed numbers of its equations and tables."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from mechdae.draw.formulas.tree import (
    Column,
    Document,
    Equation,
    Formula,
    Grid,
    Less,
    Note,
    Number,
    Part,
    Passage,
    Product,
    Quotient,
    Root,
    Section,
    Square,
    Sum,
)

COMPONENTS = ("x", "y", "z")


def passages(document: Document) -> Iterator[Passage]:
    """Yield what the sections of a document hold."""

    def of(section: Section) -> Iterator[Passage]:
        yield from section.blocks
        for inner in section.sections:
            yield from of(inner)

    for section in document.sections:
        yield from of(section)


def faults(document: Document) -> list[str]:
    """Return the equations whose printed sides differ by more than the rounding of their digits."""
    found = []
    for passage in passages(document):
        if isinstance(passage, Formula) and isinstance(passage.node, Equation):
            found += _sides(passage.node)
        elif isinstance(passage, Grid) and (
            str(passage.heads[2:3]).startswith("('F x") or passage.heads[1:] == COMPONENTS
        ):
            found += _sums(passage)
    return found


def count(document: Document) -> int:
    """Return how many equations have numbers on two sides or more."""
    return sum(
        isinstance(own, Formula)
        and isinstance(own.node, Equation)
        and sum(_value(side) is not None for side in own.node.sides) > 1
        for own in passages(document)
    )


def _sides(equation: Equation) -> list[str]:
    known = [(value, side) for side in equation.sides if (value := _value(side)) is not None]
    faults = []
    for (one, _), (other, _) in itertools.pairwise(known):
        for (a, slack), (b, more) in zip(one, other, strict=True):
            if abs(a - b) > 1.001 * (slack + more):
                faults.append(f"{a} against {b} in {equation}")
    return faults


def _value(part: Part) -> list[tuple[float, float]] | None:
    """Return the components of a side with how far rounding may put each off, None for letters."""
    match part:
        case Number():
            return [_printed(part.digits, part.power)]
        case Column():
            return [_printed(text, part.power) for text in part.digits]
        case Sum():
            terms = [_value(term) for term in part.terms]
            if not terms or any(term is None for term in terms):
                return None
            columns = zip(*(term for term in terms if term is not None), strict=True)
            return [(sum(v for v, _ in own), sum(s for _, s in own)) for own in columns]
        case Product():
            product, slack = 1.0, 0.0
            for factor in part.factors:
                value = _value(factor)
                if value is None:
                    return None
                (own, off), exact = value[0], factor == Number("2")
                slack = abs(product) * (0.0 if exact else off) + abs(own) * slack
                product *= own
            return [(product, slack)]
        case Quotient():
            above, below = _value(part.above), _value(part.below)
            if above is None or below is None:
                return None
            (a, off), (b, more) = above[0], below[0]
            return [(a / b, off / abs(b) + abs(a) * more / b**2)]
        case Less():
            inner = _value(part.inner)
            return None if inner is None else [(-value, off) for value, off in inner]
        case Square():
            return _value(Product((part.inner, part.inner)))
        case Root():
            inner = _value(part.inner)
            if inner is None:
                return None
            ((value, off),) = inner
            low, high = (max(value + sign * off, 0.0) ** 0.5 for sign in (-1.0, 1.0))
            return [((low + high) / 2, (high - low) / 2)]
    return None


def _printed(digits: str, power: int) -> tuple[float, float]:
    """Return a number and half a unit of its last digit."""
    digits = digits.replace(",", ".")  # a Russian document has a comma
    places = len(digits.partition(".")[2])
    exact = digits.strip("-") == "0"
    return float(f"{digits}e{power}"), 0.0 if exact else 0.5 * 10.0 ** (power - places)


def _sums(grid: Grid) -> list[str]:
    """Return the columns of forces and moments that do not add up to nothing."""
    faults = []
    ends = grid.heads[1:] == COMPONENTS  # the last row is what the terms have to be
    for k in range(1 if ends else 2, len(grid.heads)):
        cells = [row[k] for row in grid.rows[:-1]]
        printed = [_printed(own.digits, own.power) for own in cells if isinstance(own, Number)]
        last = grid.rows[-1][k]
        if ends and isinstance(last, Number):
            value, off = _printed(last.digits, last.power)
            printed.append((-value, off))
        total, slack = (sum(own) for own in zip(*printed, strict=True))
        if abs(total) > 1.001 * slack:
            faults.append(f"column {grid.heads[k]} adds up to {total}")
    return faults


def words(document: Document) -> list[str]:
    """Return the plain words of the notes."""
    return [
        part
        for own in passages(document)
        if isinstance(own, Note)
        for part in own.parts
        if isinstance(part, str)
    ]
