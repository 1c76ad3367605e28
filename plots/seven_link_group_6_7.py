"""Group 6-7 of a seven-link mechanism drawn apart, with its plans of rates."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    result = md.solve(md.load("gorshkov-seven-link"), task="pose")
    drawn = md.plot(result, "plans", group="II.1").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
