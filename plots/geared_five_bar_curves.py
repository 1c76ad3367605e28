"""Position function of a geared five-bar's crank and its analogue, as an article draws them."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save


def figure() -> Figure:
    """Return the figure."""
    result = md.solve(md.load("geared-five-bar"), task="turns")
    of = ["bodies/crank/angle", "bodies/crank/angular_velocity"]
    drawn = md.plot(result, "curves", of=of).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
