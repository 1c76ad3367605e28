"""The picture that compositions have for themselves."""

from __future__ import annotations

from mechdae.draw.catalogue import Picture

SHEET = Picture(
    "mechdae.parts.types.drawn.scheme_sheet",
    "the schemes of a composition side by side, each with its curve",
    of=("schemes",),
    options=("lang",),
    hint="synthesize a task of kind composition and draw its result",
    first=("composition",),
)
