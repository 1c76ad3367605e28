"""Groups that keep a freedom of their own: dependent equations that leave bodies free.

The structure counts as many equations as coordinates, or more, but special dimensions make
them depend on each other, at a pose and at all poses near it. Where other groups with
redundant equations hold these bodies, all of them are solved as one group.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from mechdae.errors import FreedomError
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.numerics.null_space import ZERO
from mechdae.types import Booleans, Floats, Unknowns

T = TypeVar("T")

STEP = 1e-3
ITERATIONS = 60
LARGEST_STEP = 0.7
STILL = 1e-15
"""Step after which Newton's method goes nowhere."""
SINGULAR = 1e-6
"""Least singular value by the largest of a pose that is looked at more closely."""
HOLDS = 1e-12
"""Residual of a solution, in sizes of the mechanism and radians."""


def built_without_idle_freedom(build: Callable[[bool], T], assemble: Callable[[T], object]) -> T:
    """Return what `build` gives with groups that have no freedom of their own.

    Parameters
    ----------
    build
        Gets whether all bodies with redundant equations shall be one group.
    assemble
        Assembles redundant groups; raises `FreedomError`.
    """
    try:
        result = build(False)
        assemble(result)
        return result
    except FreedomError as error:
        return coarser(build, assemble, error)


def coarser(build: Callable[[bool], T], assemble: Callable[[T], object], error: FreedomError) -> T:
    """Return what `build` gives with one group for all that redundant equations hold.

    Where that moves by itself too the first `error` is raised.
    """
    try:
        result = build(True)
        assemble(result)
        return result
    except FreedomError:
        raise error from None


def moving(
    graph: BlockGraph,
    poses: Unknowns,
    x: Unknowns,
    u: Floats,
    p: Floats,
    sizes: Floats,
    scale: float,
) -> Booleans:
    """Return which solutions (k, n) of a block belong to a continuum of them: it moves by itself.

    `x` (nx,) are the unknowns of the scene, `sizes` (n,) and `scale` as for `free_poses`.
    """
    r = np.array([scale if unit == "m" else 1.0 for unit in graph.block.units])
    found = np.zeros(len(poses), bool)
    for k, one in enumerate(poses):
        pose = x.copy()
        pose[graph.own] = one
        _, J, _ = graph.value_at(pose, u, p)
        sigma = np.linalg.svd(J / r[:, None] * sizes, compute_uv=False)
        if sigma[-1] < SINGULAR * sigma[0]:
            found[k] = free_poses(graph, pose, u, p, sizes, scale) is not None
    return found


def free_poses(
    graph: BlockGraph, x: Unknowns, u: Floats, p: Floats, sizes: Floats, scale: float
) -> tuple[Unknowns, Unknowns] | None:
    """Return two poses of a block between which it moves by itself, None where it does not.

    The first one is what Newton's method finds from `x` (nx,), in steps of least length. The
    other lies along the null vector of the Jacobian there: to be a freedom, the equations
    must hold away from the first pose and be dependent there too. `sizes` (n,) are those of the
    unknowns, `scale` a length of the mechanism.
    """
    r = np.array([scale if unit == "m" else 1.0 for unit in graph.block.units])

    def scaled(x: Unknowns) -> tuple[Floats, Floats]:
        F, J, _ = graph.value_at(x, u, p)
        return F / r, J / r[:, None] * sizes

    def settled_at(x: Unknowns, most: float) -> Floats:
        x = x.copy()
        for _ in range(ITERATIONS):
            F, J = scaled(x)
            if not (np.all(np.isfinite(F)) and np.all(np.isfinite(J))):
                break
            step = np.linalg.lstsq(J, F, rcond=ZERO)[0]
            size = np.abs(step).max()
            x[graph.own] -= step * sizes * min(1.0, most / max(size, most))
            if size < STILL:
                break
        return x

    def free(x: Unknowns) -> Floats | None:
        """Return the null vector at a solution, None where there is none."""
        F, J = scaled(x)
        if not np.linalg.norm(F) < HOLDS or not np.all(np.isfinite(J)):
            return None
        _, sigma, right = np.linalg.svd(J)
        rank = int(np.sum(sigma > ZERO * max(sigma[0], 1.0)))
        return right[-1] if rank < graph.size else None

    here = settled_at(x, LARGEST_STEP)
    along = free(here)
    if along is None:
        return None
    moved = here.copy()
    moved[graph.own] += STEP * sizes * along
    there = settled_at(moved, LARGEST_STEP)
    apart = np.linalg.norm((there - here)[graph.own] / sizes)
    return (here, there) if apart > STEP / 2 and free(there) is not None else None
