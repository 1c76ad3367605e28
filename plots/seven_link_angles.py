"""The angles of an article on the diagram of its mechanism, with the article's letters."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save

ANGLES = ("phi=crank", "phi3=rod", "psi=connecting_rod", "gamma=coupler", "delta=rocker")


def figure() -> Figure:
    """Return the figure."""
    result = md.solve(md.load("gorshkov-seven-link"), task="pose")
    drawn = md.plot(result, "diagram", angles=ANGLES).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
