"""Criteria of the constructions of a slider-crank as parallel axes."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save
from mechdae.parts.types.drawn.ranking_pictures import parallel


def figure() -> Figure:
    """Return the figure."""
    weights = {"loss": 0.5, "depth": 0.3, "peak_effort": 0.2}
    return parallel(md.rank("slider-crank-inertia", weights=weights))


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
