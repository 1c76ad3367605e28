"""The 16 kinematic chains with eight links and one freedom."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save
from mechdae.parts.types.drawn.atlas import atlas


def figure() -> Figure:
    """Return the figure."""
    return atlas(list(md.chains(8)), "Sixteen chains with eight links and one freedom")


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
