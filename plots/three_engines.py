"""Pressure times sliding speed of one seal in each of three engines of equal volume and speed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save

FOLDER = Path(__file__).parent.parent / "docs" / "data" / "engines"
SEALS = {
    "wankel": {"housing0": ("Wankel: apex seal on housing", "#b3261e")},
    "slider-crank": {
        "wall0": ("slider-crank: ring on cylinder", "#1f6fb2"),
        "cylinder": ("slider-crank: skirt on cylinder", "#7fb3dc"),
    },
    "sarich": {
        "slot0": ("Sarich: vane in its slot", "#2e7d32"),
        "face0": ("Sarich: vane on its face", "#8bc48e"),
    },
}
END = 6 * np.pi
"""Three turns of the shaft: one of the Wankel rotor."""


def figure() -> Figure:
    """Return the figure."""
    drawn = Figure(figsize=(8.5, 4.6), layout="constrained")
    ax = drawn.subplots()
    for name, seals in SEALS.items():
        problem = md.load(FOLDER / f"{name}.toml")
        task = problem.tasks["cycle"]
        driver = replace(task.driver, to=END)
        forces = replace(task, driver=driver, poses=541, cycle=False, measures=())
        result = md.solve(problem, forces)
        shaft = np.degrees(next(iter(result.drivers.values())).position)
        for joint, (label, color) in seals.items():
            ax.plot(shaft, result.joints[joint].pv / 1e6, color=color, linewidth=1.4, label=label)
    ax.set_yscale("log")
    ax.set_ylim(0.01, 5000)
    ax.set_xlim(0, np.degrees(END))
    ax.set_xticks(np.arange(0, 1081, 180))
    ax.set_xlabel("shaft [deg]")
    ax.set_ylabel("p v [MW/m²]")
    ax.grid(True, color="#dddddd", linewidth=0.6)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 1.17), ncols=3, frameon=False, fontsize=8.5)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
