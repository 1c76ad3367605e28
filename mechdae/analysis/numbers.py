"""The numbers a scene is evaluated with: parameters, bounds, direction of the path."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.kernels.graphs import ROUNDOFF, Graphs


class Constants:
    """Parameter values and the bounds of `Graphs.constants` for one sweep.

    Attributes
    ----------
    p : (np,) array
    scale : float
        A length of the mechanism [m], the largest distance between points of one body.
    kappa, rho, mu : arrays
        See `Graphs.constants`.
    """

    def __init__(self, graphs: Graphs, size_u: Any, size_x: Any = None, p: Any = None) -> None:
        self.graphs = graphs
        self.p = graphs.scene.model.p_values if p is None else np.asarray(p, float)
        self.scale = mechanism_scale(graphs.scene.model.mechanism)
        angle = np.array([name == "angle" for _, name in graphs.scene.x_names], bool)
        if size_x is None:
            turned = np.array([c.is_angle for c in graphs.scene.drivers], bool)
            largest = float(np.max(np.abs(size_u) * turned, initial=0.0))
            size_x = np.where(angle, 4 * np.pi + 2 * largest, 10 * self.scale)
        self.size_x, self.size_u = np.asarray(size_x, float), np.abs(np.asarray(size_u, float))
        values = graphs.constants(self.size_x, self.size_u, self.p, self.scale)
        self.kappa, self.rho, self.mu = (np.array(value).ravel() for value in values)

    def vector(self) -> Any:
        """Return the input ``consts`` of the kernels."""
        grain = ROUNDOFF * self.size_x
        return np.concatenate([self.p, [self.scale], self.kappa, self.rho, grain])


def mechanism_scale(mechanism: Any) -> float:
    """Return a length of the mechanism [m]: the largest extent of a body or of the ground."""
    values = mechanism.values()
    spans = []
    for name, body in [("ground", mechanism.ground), *mechanism.bodies.items()]:
        if len(body.points) > 1:
            for axis in "xyz"[: mechanism.dimension]:
                places = [values[f"{name}.{point}.{axis}"] for point in body.points]
                spans.append(max(places) - min(places))
    for name, joint in mechanism.joints.items():
        if joint.kind == "distance":
            spans.append(values[f"{name}.length"])
    return max(spans, default=0.0) or 1.0
