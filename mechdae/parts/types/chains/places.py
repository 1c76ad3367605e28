"""Places for the joints or the links of a chain in the plane, so that it can be drawn and built.

Distances in the plane follow those in the graph (Kamada and Kawai 1989), by classical scaling and
majorisation; a small fixed disturbance keeps lengths from being equal, where a mechanism would
have change points.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechdae.parts.types.chains.chains import KinematicChain

ROUNDS = 200
SHIFT = 0.08
"""Of the disturbance, in sides of links."""


def joint_places(chain: KinematicChain) -> NDArray[np.float64]:
    """Return a place for each joint (joints, 2), joints on one link about a side 1 apart."""
    joints = [set(joint) for joint in chain.joints]
    edges = [
        (i, j)
        for i in range(len(joints))
        for j in range(i + 1, len(joints))
        if joints[i] & joints[j]
    ]
    places = _spread(len(joints), edges)
    angles = 2.4 * np.arange(len(joints))  # the golden angle: no two shifts are alike
    return places + SHIFT * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def link_places(chain: KinematicChain) -> NDArray[np.float64]:
    """Return a place for each link as a vertex of the chain's graph (links, 2)."""
    return _spread(chain.links, chain.joints)


def _spread(count: int, edges: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """Return places whose distances are near those in the graph."""
    wanted = _distances(count, edges)
    centred = np.eye(count) - 1 / count
    values, vectors = np.linalg.eigh(-0.5 * centred @ wanted**2 @ centred)
    places = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0))
    signs = np.sign(places[np.argmax(np.abs(places) > 1e-9, axis=0), range(2)])
    places = places * np.where(signs == 0, 1.0, signs)
    angles = 2.4 * np.arange(count)
    places = places + 0.01 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    weights = 1 / np.maximum(wanted, 1.0) ** 2
    np.fill_diagonal(weights, 0.0)
    laplacian = np.diag(weights.sum(axis=1)) - weights
    inverse = np.linalg.pinv(laplacian)
    for _ in range(ROUNDS):  # Guttman's transform
        apart = np.linalg.norm(places[:, None] - places[None], axis=2)
        np.fill_diagonal(apart, 1.0)
        pull = -weights * wanted / np.maximum(apart, 1e-9)
        np.fill_diagonal(pull, 0.0)
        np.fill_diagonal(pull, -pull.sum(axis=1))
        places = inverse @ pull @ places
    return np.asarray(places)


def _distances(count: int, edges: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """Return the number of edges between any two vertices (Floyd and Warshall)."""
    apart = np.full((count, count), float(count))
    np.fill_diagonal(apart, 0.0)
    for i, j in edges:
        apart[i, j] = apart[j, i] = 1.0
    for k in range(count):
        apart = np.minimum(apart, apart[:, [k]] + apart[[k]])
    return apart
