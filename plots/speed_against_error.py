"""Time over error of sweeps and of other ways to the same positions, as measured."""

from __future__ import annotations

import json
from pathlib import Path

from matplotlib.figure import Figure

from mechdae.draw import save
from mechdae.parts.bench.drawn.speed import draw

DATA = Path(__file__).resolve().parents[1] / "docs" / "data" / "bench.json"


def figure() -> Figure:
    """Return the figure."""
    records = json.loads(DATA.read_text(encoding="utf-8"))
    moving = [r for r in records if "loops" not in r and "task" not in r]
    drawn = draw(moving).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
