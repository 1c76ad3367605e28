"""Friction circles of a quick return, and the reactions that touch them."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    result = md.solve(md.load("quick-return-friction"), task="cycle", poses=37)
    drawn = md.plot(result, "plans", pose=4, which="friction").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
