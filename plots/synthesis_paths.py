"""Designs of four-bars for a heart, over its points."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    problem = md.load("p-heart20-free")
    task = problem.tasks["design"]
    result = md.synthesize(problem, task, starts=12)
    drawn = md.plot(result, "compare").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
