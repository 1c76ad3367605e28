"""Path of a coupler point with ticks of equal time."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    result = md.solve(md.load("four-bar-crank-rocker"), task="turn")
    drawn = md.plot(result, "coupler").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
