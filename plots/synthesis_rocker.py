"""A crank-rocker for a swing and a time ratio, with both extreme positions."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    problem = md.load("rocker-50-1-15")
    task = problem.tasks["design"]
    result = md.synthesize(problem, task, starts=4)
    drawn = md.plot(result).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
