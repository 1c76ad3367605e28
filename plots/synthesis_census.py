"""The optima of a search for a heart-shaped path without a full turn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    problem = md.load("p-heart20-free")
    task = replace(problem.tasks["design"], constraints=[])
    result = md.synthesize(problem, task, starts=8)
    drawn = md.plot(result, "census").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
