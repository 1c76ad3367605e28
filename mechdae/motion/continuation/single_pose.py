"""Certificates of single poses: is there a solution, and how near."""

from __future__ import annotations

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.continuation.evaluate import H_LIMIT
from mechdae.motion.continuation.output_bounds import WORST, spread, widened
from mechdae.motion.setup.scales import Constants, divisors
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrix, Unknowns


@dataclass(frozen=True)
class Certified:
    """Poses of one value of the drivers: ``sure`` (k,), and bounds ``error`` (k, nx) where so.

    ``x`` (k, nx) are the poses after one more Newton step, where they are certain.
    """

    x: Matrix
    sure: Booleans
    error: Floats
    constants: Constants


def certified(graphs: Graphs, x: Unknowns, u: Floats) -> Certified:
    """Return which poses (k, nx) at driver values `u` pass the test of Newton and Kantorovich."""
    k = len(x)
    constants = Constants(graphs, np.abs(u))
    wide = 1.5 * np.abs(x).max(axis=0, initial=0.0)
    measured = divisors(graphs, x, np.tile(u, (k, 1))) / 2 if graphs.contacts and k else None
    if measured is not None or np.any(wide > constants.size_x):
        size_x = np.maximum(constants.size_x, wide)
        constants = Constants(graphs, np.abs(u), size_x, measured)
    consts = constants.vector
    rates = [] if graphs.single else [np.zeros(graphs.nu) for _ in graphs.driven]
    poses, sure, error = np.array(x, float), np.zeros(k, bool), np.full((k, graphs.nx), np.nan)
    for row in range(k):
        moved, bound, det, beta, eta = graphs.pose(x[row], u, *rates, consts)[:5]
        det, beta, eta = (np.array(part).ravel() for part in (det, beta, eta))
        with np.errstate(invalid="ignore", over="ignore"):
            h = constants.kappa * beta * (np.sqrt(eta) + beta * constants.rho)
            good = h <= H_LIMIT
        redundant = np.array([graph.redundant for graph in graphs.blocks], bool)
        ill = spread(graphs, constants, det[None], beta[None])
        sure[row] = np.all(good & ((det > 0) | ~redundant)) and np.all(ill <= WORST)
        if sure[row]:
            poses[row] = np.array(moved).ravel()
            error[row] = widened(np.array(bound).reshape(1, -1), ill)
    return Certified(poses, sure, error, constants)
