"""Fronts of distance against material of six curves, of the composition and of NSGA-II."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from mechdae.draw import save, style

DATA = Path(__file__).resolve().parents[1] / "docs" / "data" / "compositions.json"


def figure() -> Figure:
    """Return the figure."""
    records = json.loads(DATA.read_text(encoding="utf-8"))["records"]
    with mpl.rc_context({"font.family": style.FONT, "svg.hashsalt": "mechdae"}):
        drawn = Figure(figsize=(9.0, 5.6), dpi=style.DPI, facecolor=style.PAPER)
        panels = drawn.subplots(2, 3, sharex=True, sharey=True).ravel()
        for panel, record in zip(panels, records, strict=True):
            runs = [("NSGA-II", own["points"], style.FAINT) for own in record["material"]["runs"]]
            for name, points, color in [*runs, ("ours", record["material"]["points"], style.ARROW)]:
                if points:
                    x, y = zip(*sorted(points), strict=True)
                    x, y = (*x, 0.75), (*y, y[-1])
                    panel.step(x, y, where="post", color=color, linewidth=1.4, label=name)
                    panel.plot(x[:-1], y[:-1], "o", color=color, markersize=3.5)
            panel.set_title(record["curve"], size=style.SUBTITLE, loc="left")
            panel.set_xlim(0, 0.75)
            panel.set_ylim(2, 10)
            panel.grid(color=style.GHOST, linewidth=0.5)
            panel.tick_params(labelsize=style.TICK)
            for side in ("top", "right"):
                panel.spines[side].set_visible(False)
        panels[0].legend(fontsize=style.TICK, frameon=False)
        drawn.supxlabel("distance", size=style.TICK)
        drawn.supylabel("material, radii of the curve", size=style.TICK)
        drawn.subplots_adjust(0.08, 0.1, 0.98, 0.93, 0.08, 0.18)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
