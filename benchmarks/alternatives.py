"""The same poses by other means: what speed costs in accuracy, and the certificate in time.

`interpolated` reads positions off quintic Hermite pieces between solved nodes; `rootfinder`
calls casadi's Newton solver from pose to pose, each from the last one. Neither knows rates,
bounds, branches or limits.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from benchmarks import four_bar
from mechdae.kernels.run.functions import Call
from mechdae.motion.continuation.interpolate import quintic
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.parts.bench.kinematics import Other, SweepWork, unknowns_error

NODES = (24, 48, 96, 192)
TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-13)


SAMPLES = 400


def alternatives(compared: int, work: SweepWork, setting: Setting, result: Run) -> Iterator[Other]:
    """Yield other means to the poses of a sweep that was prepared and followed.

    Those that the four-bar alone has at all numbers of poses, the others at `compared` ones.
    """
    s = np.asarray(result.poses.s)
    values = work.problem.mechanism.values()
    if tuple(values.get(name) for name in "abcd") == four_bar.LENGTHS:
        yield from four_bar.others(s)
    if len(s) != compared or not result.poses.alive.all():
        return
    rows = np.arange(0, len(s), max(1, len(s) // SAMPLES))

    def error(x: Any) -> float:
        return unknowns_error(setting, x[rows], s[rows])[0]

    ways = [("interpolated", *way) for way in interpolated(setting, result, s)]
    ways += [("rootfinder", *way) for way in rootfinder(setting, result, s)]
    yield from (Other(*way, error) for way in ways)


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

        yield f"{count} nodes", way


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

        yield f"{tolerance:.0e}", way
