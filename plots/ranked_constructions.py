"""Constructions of the pins of a slider-crank, the best by losses, depth and effort first."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save
from mechdae.parts.types.drawn.ranking_pictures import sheet


def figure() -> Figure:
    """Return the figure."""
    weights = {"loss": 0.5, "depth": 0.3, "peak_effort": 0.2}
    ranking = md.rank("slider-crank-inertia", weights=weights)
    return sheet(ranking, dict.fromkeys(ranking.order[::13][:12]))


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
