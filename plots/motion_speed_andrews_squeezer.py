"""Time over error of integrators on one right-hand side, andrews-squeezer, as measured."""

from __future__ import annotations

import json
from pathlib import Path

from matplotlib.figure import Figure

from mechdae.draw import save
from mechdae.parts.bench.drawn.speed import draw_precision

DATA = Path(__file__).resolve().parents[1] / "docs" / "data" / "motion-andrews-squeezer.json"


def figure() -> Figure:
    """Return the figure."""
    drawn = draw_precision(json.loads(DATA.read_text(encoding="utf-8"))).get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
