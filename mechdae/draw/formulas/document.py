"""Documents of sections with formulas, tables, facts and pictures, and what is written of them.

Writers are in `writers`: text, HTML, Typst and plain data.
"""

from __future__ import annotations

from mechdae.draw.formulas.tree import Part
from mechdae.records import dataclass


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
