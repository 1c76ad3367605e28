"""A six-bar whose output rests: output and error at the points that are wanted."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    problem = md.load("six-bar-dwell")
    task = problem.tasks["design"]
    result = md.synthesize(problem, task, starts=8)
    drawn = md.plot(result).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
