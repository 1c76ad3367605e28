"""The same poses by other means: what speed costs in accuracy, and the certificate in time.

`interpolated` reads positions off quintic Hermite pieces between solved nodes; `rootfinder`
calls casadi's Newton solver from pose to pose, each from the last one. Neither knows rates,
bounds, branches or limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np

from mechdae.continuation.interpolate import quintic
from mechdae.continuation.path import Path
from mechdae.kernels.run.call import Call
from mechdae.kinematics.prepared import Run, Setting

NODES = (24, 48, 96, 192)
TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-13)


MOST = 10_000
"""Poses up to which the sequential solver is measured."""


def alternatives(setting: Setting, result: Run) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield name and function of each way; the functions return unknowns (n, nx)."""
    s = np.asarray(result.poses.s)
    yield from interpolated(setting, result, s)
    if len(s) <= MOST:
        yield from rootfinder(setting, result, s)


def interpolated(setting: Setting, result: Run, s: Any) -> Iterator[tuple[str, Any]]:
    """Yield interpolation between so many equal pieces; the nodes are part of the work."""
    g = setting.graphs
    path = result.path
    assert isinstance(path, Path)
    for count in NODES:
        nodes = np.linspace(s.min(), s.max(), count + 1)
        at_nodes = result.evaluator.at(result.path, nodes)
        if not at_nodes.alive.all():
            return
        states = []
        for place, x in zip(nodes, at_nodes.x, strict=True):
            start = np.concatenate([x, np.zeros(2 * g.nx + g.nb)])
            states.append(path.step(start, float(place), 0.0)[0])
        table = np.array(states)
        parts = [table[:, k * g.nx : (k + 1) * g.nx] for k in range(3)]

        def way(nodes: Any = nodes, parts: Any = parts) -> Any:
            result.evaluator.at(result.path, nodes)
            return quintic(nodes, parts[0], parts[1], parts[2], s)

        yield f"interpolated, {count} nodes", way


def rootfinder(setting: Setting, result: Run, s: Any) -> Iterator[tuple[str, Any]]:
    """Yield casadi's rootfinder at several tolerances, from pose to pose."""
    scene, p = setting.scene, setting.assembler.p
    residual = ca.vertcat(*[graph.F for graph in setting.graphs.blocks])
    problem = {"x": scene.x, "p": ca.vertcat(scene.u, scene.model.p), "g": ca.densify(residual)}
    first = result.poses.x[0]
    for tolerance in TOLERANCES:
        options: dict[str, Any] = {
            "abstol": tolerance,
            "linear_solver": "qr",
            "error_on_fail": False,
        }
        solver = Call(ca.rootfinder("solver", "newton", problem, options))

        def way(solver: Call = solver) -> Any:
            rows = np.empty((len(s), len(first)))
            x = first
            for k, place in enumerate(s):
                x = solver(x, np.concatenate([[place], p]))[0]
                rows[k] = x
            return rows

        yield f"rootfinder, {tolerance:.0e}", way
