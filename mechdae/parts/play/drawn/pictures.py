"""The picture that bands have for themselves."""

from __future__ import annotations

from mechdae.draw.catalogue import Picture

BAND = Picture(
    "mechdae.parts.play.drawn.ribbons",
    "paths of points with the bands that clearance gives them",
    of=("bands",),
    options=("of", "pivots"),
    needs=("series",),
    lacks="has no bands",
    hint="a task of kind play",
    first=("play",),
    usual_of=("play",),
)
