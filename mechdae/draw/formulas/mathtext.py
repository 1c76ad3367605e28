"""Formulas as matplotlib's mathtext, without the dollar signs."""

from __future__ import annotations

from mechdae.draw.formulas.tree import (
    Equation,
    Letter,
    Part,
    Sum,
    Wording,
    stem_and_index,
)

MARKS = {"τ": r"\tau"}


def mathtext(node: Part) -> str:
    r"""Return a formula of letters: ``\mathbf{v}_{BA} = \mathbf{v}_{B}``."""
    match node:
        case Letter():
            index = "".join(written_letter(part) for part in node.index)
            text = rf"\mathbf{{{node.text}}}" if node.vector else node.text
            mark = MARKS.get(node.mark, node.mark)
            return text + (f"_{{{index}}}" if index else "") + (f"^{{{mark}}}" if mark else "")
        case Wording():
            return node.text
        case Sum():
            return " + ".join(mathtext(term) for term in node.terms) or "0"
        case Equation():
            return " = ".join(mathtext(side) for side in node.sides)
    raise TypeError(f"plans have no {type(node).__name__}")  # pragma: no cover


def written_letter(letter: str) -> str:
    """Return the mathtext of a letter: numbers at its end as an index."""
    stem, index = stem_and_index(letter)
    stem = stem.replace("_", r"\_").replace(" ", "")
    body = stem if len(stem) < 2 else rf"\mathit{{{stem}}}"
    return body + (f"_{{{index}}}" if index else "")
