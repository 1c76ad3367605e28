"""Efficiency of a slider-crank driven by its slider, over crank radius and friction.

The study solves some 170 cycles and takes a minute: ``python plots/efficiency_map.py`` solves it,
writes ``docs/data/efficiency-map.json`` and draws; `figure` draws what was written.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import save

DATA = Path(__file__).resolve().parent.parent / "docs/data/efficiency-map.json"
STUDY = md.Study(
    vary={"r": [0.01, 0.1, 13], "f": [0.02, 0.5, 13]},
    of="cycle",
    outputs=["summary/efficiency"],
)


def problem() -> md.Problem:
    """Return the slider-crank whose load pushes along the motion."""
    given = md.load("slider-crank-friction")
    return given.with_task("cycle", replace(given.tasks["cycle"], poses=2, direction="load"))


def solved() -> dict[str, object]:
    """Return the study, solved, as it is written to the file."""
    found = md.solve(problem(), STUDY)
    return {
        "parameters": {name: values.tolist() for name, values in found.parameters.items()},
        "efficiency": found.table["summary/efficiency"].tolist(),
        "status": found.status.tolist(),
    }


def figure() -> Figure:
    """Return the figure."""
    data = json.loads(DATA.read_text(encoding="utf-8"))
    given = problem()
    result = md.StudyResult(
        "slider-crank-friction",
        "map",
        "study",
        given.mechanism,
        "Slider-crank driven by its slider: crank radius [m] and friction in the pins",
        parameters={name: np.array(values) for name, values in data["parameters"].items()},
        table={"summary/efficiency": np.array(data["efficiency"], float)},
        status=np.array(data["status"]),
        summary={"of": "cycle"},
        definition=STUDY,
    )
    drawn = md.plot(result, "map").get_figure(root=True)
    assert isinstance(drawn, Figure)
    return drawn


if __name__ == "__main__":
    DATA.write_text(json.dumps(solved(), indent=1) + "\n", encoding="utf-8")
    save(figure(), Path(__file__).with_suffix(".svg"))
