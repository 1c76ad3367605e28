"""How forty starts for a path along an ellipse ended."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    problem = md.load("c5-ellipse10-free")
    task = problem.tasks["design"]
    result = md.synthesize(problem, task, starts=40)
    drawn = md.plot(result, "convergence").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
