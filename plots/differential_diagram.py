"""A geared differential: the five-bar of an article without its link 3, of mobility two."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    result = md.solve(md.load("differential"), task="laws")
    drawn = md.plot(result, "diagram", pose=330, traces=False, angles=["all"]).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
