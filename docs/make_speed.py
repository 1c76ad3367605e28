"""Writes ``docs/speed-and-error.md`` from ``docs/data/bench.json`` and ``calls.json``.

Usage: ``python -m benchmarks --out docs/data && python docs/make_speed.py``; with ``--check``
nothing is written and the exit code tells whether the page is up to date. ``bench.json`` holds
what was measured on one machine; its numbers are not measured again by tests.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
PAGE, DATA = FOLDER / "speed-and-error.md", FOLDER / "data" / "bench.json"
CALLS = FOLDER / "data" / "calls.json"
sys.path.insert(0, str(FOLDER.parent))

HEAD = """# Speed against error

`mechdae bench` measures sweeps of three predefined problems, `mechdae bench P` those of any
other, and a chain of four-bars of growing length; `python -m benchmarks`, in the sources, also
other methods beside them, and forces. Times are ratios to a yardstick that runs
interleaved with each sweep: the closed-form four-bar in NumPy, two angles with two derivatives
each, for the same number of poses ([yardstick.py](../mechdae/bench/yardstick.py)). Ratios
carry from machine to machine, seconds do not. Medians are shown.

The error is the true one: one Newton step whose residual is evaluated in 80-bit floats, at 400
of the poses, in radians or lengths of the mechanism. The bound is what the result itself
claims, for all poses.

![Time over error](../plots/speed_against_error.svg)

## Sweeps

Positions, velocities and accelerations with certificates and bounds; `first` builds the
kernels too.

| work | poses | ns/pose | x yardstick | first, ms | error | bound |
|---|---|---|---|---|---|---|
"""
WHOLE = """
## Whole calls

What `md.solve` and a warm `md.Solver` take as a whole, from the problem to the result with the
outputs of its task: the first call of a mechanism, the same again with another value of a
dimension, and a solver with another value. `python -m benchmarks.calls --out docs/data/calls.json`
repeats it.

"""
OTHERS = """
## The same positions by other means, {n} poses

Interpolation between solved nodes and casadi's `rootfinder` (Newton's method, called through
its buffer from pose to pose) give positions only: no rates, no bound, and they do not notice a
limit position or another branch.

| work | means | x yardstick | error |
|---|---|---|---|
"""
CHAIN = """
## Growth with the mechanism

A chain of N four-bars, each driven by the rocker of the one before, angles of all bodies, {n}
poses.

| loops | unknowns | build, ms per loop | ns per loop and pose | error | bound |
|---|---|---|---|---|---|
"""
FORCES = """
## Forces

The four-bar of the yardstick with masses and a torque on its rocker: reactions and effort without
friction, and with friction in all four pins that acts on the reactions it comes from (then sizes,
reactions, efforts, losses, and the estimate without friction beside). *Forces* starts from the
coordinates of certified poses with their rates; the *whole task* has the certified kinematics and
the checks too; `first` builds the kernels. The error is that against nine absolute equations in
80-bit floats with kinematics of their own ([absolute.py](../benchmarks/absolute.py)), relative
to the largest force or torque. *Dense Newton* solves those equations for all poses at once with
LAPACK, *fsolve* pose by pose with `scipy.optimize.fsolve`, its Jacobian given, each from the last
one; both get pin forces and torque only, from angles and rates in closed form.

| work | means | poses | ns/pose | x yardstick | first, ms | error |
|---|---|---|---|---|---|---|
"""
TAIL = """
From 10 to {loops} loops the building grows {build:.2f} times per loop, a sweep {pose:.2f}
times per loop and pose. The error grows because absolute coordinates of the last link carry
the errors of all links before it.

"""
ENDS = """
## Two back ends

What evaluates the kernels, a compiled machine or NumPy, and what each needs for a pose:
[back ends](back-ends.md).
"""


def page(records: list[dict[str, Any]]) -> str:
    """Return the text of the page."""
    loaded = [r for r in records if "task" in r]
    single = [r for r in records if "loops" not in r and "task" not in r]
    chain = [r for r in records if "loops" in r]
    lines = [
        f"| {r['work']} | {r['n']:,} | {r['seconds'] / r['n'] * 1e9:.0f} | {r['ratio']:.1f} | "
        f"{r['first'] * 1e3:.0f} | {r['error']:.1e} | {r['bound']:.1e} |"
        for r in single
        if r["method"] == "certified"
    ]
    others = [r for r in single if r["method"] != "certified"]
    means = [
        f"| {r['work']} | {r['method']}, {r['setting']} | {r['ratio']:.1f} | {r['error']:.1e} |"
        for r in others
    ]
    grown = [
        f"| {r['loops']} | {2 * r['loops']} | {r['build_per_loop'] * 1e3:.1f} | "
        f"{r['per_loop_and_pose'] * 1e9:.0f} | {r['error']:.1e} | {r['bound']:.1e} |"
        for r in chain
    ]
    forces = [
        f"| {r['work']} | {r['method']} | {r['n']:,} | {r['seconds'] / r['n'] * 1e9:.0f} | "
        f"{r['ratio']:.1f} | {r['first'] * 1e3:.0f} | {r['error']:.1e} |".replace("| nan |", "| |")
        for r in ({"first": float("nan"), **r} for r in loaded)
    ]
    first, last = chain[0], chain[-1]
    tail = TAIL.format(
        loops=last["loops"],
        build=last["build_per_loop"] / first["build_per_loop"],
        pose=last["per_loop_and_pose"] / first["per_loop_and_pose"],
    )
    from benchmarks.calls import table

    calls = table(json.loads(CALLS.read_text(encoding="utf-8")))
    parts = [
        HEAD,
        "\n".join(lines),
        "\n",
        WHOLE,
        calls,
        "\n",
        OTHERS.format(n=others[0]["n"]),
        "\n".join(means),
    ]
    parts += ["\n", CHAIN.format(n=first["n"]), "\n".join(grown), "\n", tail]
    parts += [FORCES, "\n".join(forces), "\n", ENDS]
    return "".join(parts)


def main(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    text = page(json.loads(DATA.read_text(encoding="utf-8")))
    if "--check" in arguments:
        same = PAGE.exists() and PAGE.read_text(encoding="utf-8") == text
        print("up to date" if same else f"{PAGE.name} is not what bench.json says")
        return 0 if same else 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
