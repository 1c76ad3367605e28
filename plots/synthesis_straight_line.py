"""A point on a straight line over half a turn, and its deviation."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    problem = md.load("straight-180-1-4")
    task = problem.tasks["design"]
    result = md.synthesize(problem, task, starts=6)
    drawn = md.plot(result).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
