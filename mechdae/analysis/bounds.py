"""From bounds on the unknowns to bounds on points and body angles."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.evaluate import Poses
from mechdae.analysis.numbers import Constants
from mechdae.analysis.outputs import Outputs
from mechdae.kernels.graphs import Graphs


def output_bounds(
    graphs: Graphs, outputs: Outputs, constants: Constants, poses: Poses
) -> dict[str, Any]:
    """Return ``length`` (n,) [m] over the points and ``angle`` (n,) [rad] over the bodies.

    |dy/dx| is bounded for all poses at once; half a unit in the last place of the driver's
    value does not count, the bound is for the float64 data given.
    """
    slope, rounding = (
        np.array(part)
        for part in graphs.output_bounds(
            constants.size_x, constants.size_u, constants.p, constants.floors, *constants.boxes
        )
    )
    count = constants.boxes[0].shape[1]
    rounding = rounding.reshape(graphs.ny, count).max(axis=1)
    slope = slope.reshape(graphs.ny, count, graphs.nx).max(axis=1)
    error = np.nan_to_num(poses.error, nan=0.0)
    result = {}
    for word, kinds in (("length", ("position", "slide")), ("angle", ("angle",))):
        entries = [e for e in outputs.entries if e.name in kinds]
        if word == "angle":
            entries = [e for e in entries if e.kind == "bodies"]
        columns = [i for entry in entries for i in entry.columns]
        if not columns:
            continue
        rows = np.array(sorted({tuple(row) for row in slope[columns].tolist()}))
        worst = (error @ rows.T).max(axis=1, initial=0.0)
        result[word] = worst + float(rounding[columns].max(initial=0.0))
    return result
