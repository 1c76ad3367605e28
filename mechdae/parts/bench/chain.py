"""How time and error grow with the mechanism: chains of four-bars, the same cell N times."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe import Driver, Sweep, load
from mechdae.parts.bench.kinematics import FIRST, WARM, SweepWork, measure

PROBLEM = "chain-of-four-bars"
LOOPS = (10, 30, 100, 300)
QUICK_LOOPS = (10, 30)
POSES = 1_000


def chain(loops: int) -> SweepWork:
    """Return the full turn of a chain of that many loops; angles of all bodies are asked for."""
    problem = load(PROBLEM).with_values({"N": loops})
    driver = "rocker0.angle"
    bodies = [f"{body}.angle" for body in problem.mechanism.bodies]
    task = Sweep(
        Driver(driver, from_=0.0, to=2 * np.pi), outputs=tuple(b for b in bodies if b != driver)
    )
    return SweepWork(f"chain of {loops} four-bars", problem, task)


def scaling(
    loops: tuple[int, ...] = LOOPS, poses: int = POSES, repeats: int = 7
) -> list[dict[str, object]]:
    """Return the records of `measure` for each number of loops, and what one loop costs.

    ``loops``; ``build_per_loop`` [s]: scene, kernels and assembly, from the description to the
    first pose; ``per_loop_and_pose`` [s]: a sweep with its kernels built.
    """
    records = []
    for count in loops:
        found = {record["method"]: record for record in measure(chain(count), (poses,), repeats)}
        record = found[WARM]
        record["loops"] = count
        record["build_per_loop"] = (found[FIRST]["seconds"] - record["seconds"]) / count
        record["per_loop_and_pose"] = record["seconds"] / (count * poses)
        records.append(record)
    return records


def table(records: list[dict[str, Any]]) -> str:
    lines = [
        f"{'loops':>6} {'unknowns':>9} {'poses':>7} {'build ms/loop':>14} {'ns/loop/pose':>13} "
        f"{'x yardstick':>12} {'error':>9} {'bound':>9}"
    ]
    lines += [
        f"{r['loops']:6d} {2 * r['loops']:9d} {r['n']:7d} {r['build_per_loop'] * 1e3:14.2f} "
        f"{r['per_loop_and_pose'] * 1e9:13.0f} {r['ratio']:12.1f} {r['error']:9.1e} "
        f"{r['bound']:9.1e}"
        for r in records
    ]
    return "\n".join(lines)
