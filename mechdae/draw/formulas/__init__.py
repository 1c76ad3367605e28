"""Formulas as values, and documents made of them: written as text, MathML, Typst or mathtext."""

from __future__ import annotations

from mechdae.draw.formulas.notations import plain
from mechdae.draw.formulas.tree import (
    Column,
    Cross,
    Document,
    Equation,
    Facts,
    Formula,
    Grid,
    Image,
    Less,
    Letter,
    Listed,
    Matrix,
    Norm,
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
    UnitName,
    Wording,
    columns,
    decimals,
    like,
    number,
    numbers,
    rounded,
)

__all__ = [
    "Column", "Cross", "Document", "Equation", "Facts", "Formula", "Grid", "Image", "Less",
    "Letter", "Listed", "Matrix", "Norm", "Note", "Number", "Part", "Passage", "Product",
    "Quotient", "Root", "Section", "Square", "Sum", "UnitName", "Wording", "columns",
    "decimals", "like", "number", "numbers", "plain", "rounded",
]  # fmt: skip
