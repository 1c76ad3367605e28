"""Writes ``speed-and-error.md`` and a table of the README from ``docs/data/bench.json``.

Usage: ``python docs/make_speed.py --measure`` measures everything anew (some minutes) and writes;
without it what was measured last is written; with ``--check`` nothing is, and the exit code tells
whether both are up to date. ``bench.json`` holds what was measured on one machine; its numbers are
not measured again by tests.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
PAGE, DATA = FOLDER / "theory/evidence/speed-and-error.md", FOLDER / "data" / "bench.json"
AIMS = FOLDER / "data" / "aims.json"
README = FOLDER.parent / "README.md"
BEGIN, END = "<!-- speed -->", "<!-- end of speed -->"
sys.path[:0] = [str(FOLDER), str(FOLDER.parent)]

FIRST, AGAIN, WARM = "md.solve, first", "md.solve, again", "md.Solver"
OURS = (FIRST, AGAIN, WARM, "md.Solver.poses")
SHOWN = (1000, 100_000)
"""Numbers of poses in the README."""
IN_README = (0, 1, 2, 4, 7, 8, 9)
"""Columns of the table of whole calls that the README has."""

HEAD = """# Speed against error

`mechdae bench` measures what users call: sweeps of four predefined problems at one to a hundred
thousand poses, whole tasks, a study, and a chain of four-bars of growing length; `mechdae bench P`
the sweep, motion or synthesis of any other problem. `python -m benchmarks`, in the sources, also
measures other methods beside them in the same run, as far as they can be had: a closed form in C
(where a compiler is), pylinkage, scipy, casadi's rootfinder, SUNDIALS. Times are ratios to a
yardstick that runs interleaved with each: the closed-form four-bar in NumPy, two angles with two
derivatives each, for the same number of poses
([yardstick.py](../../../mechdae/parts/bench/runs.py)). Ratios carry from machine to machine,
seconds do not. Medians of processor time are shown. Of `rssr`, a spatial
four-bar, rocker angle and ball are asked for.

The error is the true one: one Newton step whose residual is evaluated in 80-bit floats, at 400
of the poses, in radians or lengths of the mechanism. The bound is what the result itself
claims, for all poses.

![Time over error](../../../plots/speed_against_error.svg)

{runs}
## Whole calls

From the problem to the result with positions, velocities, accelerations, certificates and bounds of
all its bodies, points and joints. *First*: `md.solve` with nothing kept, neither in memory nor on
disk; *again*: the same with another value of a dimension; *warm*: a call of an `md.Solver` with
another value, which the last columns are about; *arrays*: its `poses` at the same driver values,
certified too, without a report.

"""
RUNS = """## Runs

Every row of [bench.json](../../data/bench.json) tells its run, when it was measured, with which
version and back end, and the load of the machine then: the mean number of processes that wanted a
processor.
`mechdae bench --out DIR` writes such rows, and `python docs/make_speed.py --measure` repeats
all of this page but the aims in one run. {said}

| run | measured | date | version | back end | load |
|---|---|---|---|---|---|
"""
ONE = "All tables are of one run."
SEVERAL = "Here tables are of {count} runs."
UNTOLD = """
What is empty was not written down at the time; those dates are when the rows were committed.
"""
START = """
## From the start of a process

The command line from the start of the process to its end, processor time, in multiples of a
process that imports NumPy and casadi and ends.

| process | | ms | x `import numpy, casadi` |
|---|---|---|---|
"""
FOUR = """
## The four-bar by other means

Angles of coupler and rocker, the error against the closed form in 80-bit floats. The closed form
in C and pylinkage's `step_fast_with_kinematics` have velocities and accelerations, the others
positions only; none has a certificate or a bound.

| means | poses | ns/pose | x yardstick | error |
|---|---|---|---|---|
"""
OTHERS = """
## The same positions by other means, {n:,} poses

Interpolation between solved nodes and casadi's `rootfinder` (Newton's method, called through
its buffer from pose to pose) give positions only: no rates, no bound, and they do not notice a
limit position or another branch.

| work | means | x yardstick | error |
|---|---|---|---|
"""
TASKS = """
## Whole tasks

The error is the largest relative difference from the values that the problem's file expects, which
come from closed forms and independent computations, or of the best design from the optimum known;
that of a study the largest difference of its rows from their sets solved alone. The yardstick runs
with 10 000 poses.

| task | problem | n | first, ms | again, ms | warm, ms | x yardstick | error |
|---|---|---|---|---|---|---|---|
"""
STUDIES = """
## Many sets of numbers

Sets at once, processor time; more in [studies](solver.md#studies). The error of a certified row
is the difference from its set alone, that of a screened one from the certified row.

| work, {poses} poses each | call | sets | mechanisms/s | x yardstick | error |
|---|---|---|---|---|---|
"""
CHAIN = """
## Growth with the mechanism

A chain of N four-bars, each driven by the rocker of the one before, angles of all bodies, {n:,}
poses.

| loops | unknowns | build, ms per loop | ns per loop and pose | error | bound |
|---|---|---|---|---|---|
"""
TAIL = """
From {first} to {last} loops the building grows {build:.2f} times per loop, a sweep {pose:.2f}
times per loop and pose: what grows from a hundred loops on is the search for the mode nearest to a
rough sketch, which begins up to 2000 modes and costs as much for one pose as for a thousand. The
error grows because absolute coordinates of the last link carry the errors of all links before it.
"""
FORCES = """
## Forces

The four-bar of the yardstick with masses and a torque on its rocker: reactions and effort without
friction, and with friction in all four pins that acts on the reactions it comes from (then sizes,
reactions, efforts, losses, and the estimate without friction beside). *Forces* starts from the
coordinates of certified poses with their rates; the *whole task* has the certified kinematics and
the checks too; `first` builds the kernels. The error is that against nine absolute equations in
80-bit floats with kinematics of their own ([absolute.py](../../../benchmarks/absolute.py)),
relative to the largest force or torque. *Dense Newton* solves those equations for all poses at
once with LAPACK, *fsolve* pose by pose with `scipy.optimize.fsolve`, its Jacobian given, each
from the last
one; both get pin forces and torque only, from angles and rates in closed form.

| work | means | poses | ns/pose | x yardstick | first, ms | error |
|---|---|---|---|---|---|---|
"""
MOTION = """
## A motion

Andrews' mechanism, all integrators on the same right-hand side; the error is that at the end
against 34 digits. Other motions and tolerances: [work against
precision](motion.md#work-against-precision).

| integrator | tolerance | right-hand sides | ms | x yardstick | error |
|---|---|---|---|---|---|
"""
GOALS = """
## Aims

What mechdae is meant to reach on two cores, and what it does; y is the yardstick at as many
poses. `python -m benchmarks.aims` measures it with the back end that `MECHDAE_BACKEND` names.
Figures that miss their aim are bold. Times are of the processor, on two cores that some twenty
other processes shared: that lengthens calls that touch much memory more than the yardstick.

"""
MISSED = """
Aims not reached, and why:

"""
ENDS = """
## Two back ends

What evaluates the kernels, a compiled machine or NumPy, and what each needs for a pose:
[back ends](../back-ends.md).
"""


def rows(lines: Iterable[Iterable[Any]]) -> str:
    """Return lines of a Markdown table."""
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


def named(record: dict[str, Any]) -> str:
    """Return what a method is called."""
    return ", ".join(word for word in (record["method"], record["setting"]) if word)


def together(records: list[dict[str, Any]]) -> list[dict[str, dict[str, Any]]]:
    """Return the three ways of calling one thing together."""
    found: dict[tuple[str, int], dict[str, dict[str, Any]]] = {}
    for record in records:
        if record["method"] in OURS:
            found.setdefault((record["work"], record["n"]), {})[record["method"]] = record
    return [own for own in found.values() if WARM in own]


def ms(
    own: dict[str, dict[str, Any]], digits: int = 1, ways: Sequence[str] = (FIRST, AGAIN, WARM)
) -> list[str]:
    """Return the milliseconds of first, again, warm, or of other ways."""
    return [f"{own[way]['seconds'] * 1e3:.{digits}f}" if way in own else "" for way in ways]


def started(records: list[dict[str, Any]]) -> str:
    """Return the table of what a process costs from its start."""
    lines = rows(
        (f"`{r['method']}`", r["setting"], f"{r['seconds'] * 1e3:.0f}", f"{r['ratio']:.2f}")
        for r in records
        if r.get("task") == "start"
    )  # fmt: skip
    return START + lines if lines else ""


def aims() -> str:
    """Return the table of aims, and those that are missed."""
    from benchmarks.aims import missed, table

    if not AIMS.exists():
        return ""
    data = json.loads(AIMS.read_text(encoding="utf-8"))
    return f"{GOALS}{table(data)}{MISSED}{missed(data)}"


def calls(records: list[dict[str, Any]], shown: tuple[int, ...] | None = None) -> str:
    """Return the table of whole calls, for the page or, with the numbers `shown`, the README."""
    heads = (
        "sweep", "poses", "first, ms", "again, ms", "warm, ms", "arrays, ms", "ns/pose",
        "x yardstick", "error", "bound",
    )  # fmt: skip
    lines = []
    for own in together(records):
        warm = own[WARM]
        if shown is None or warm["n"] in shown:
            lines.append(
                (
                    warm["work"], f"{warm['n']:,}", *ms(own, 2, OURS),
                    f"{warm['seconds'] / warm['n'] * 1e9:.0f}", f"{warm['ratio']:.1f}",
                    f"{warm['error']:.1e}", f"{warm['bound']:.1e}",
                )
            )  # fmt: skip
    table = [heads, ["---"] * len(heads), *lines]
    return rows(table if shown is None else [[row[k] for k in IN_README] for row in table])


def beside(records: list[dict[str, Any]]) -> str:
    """Return the tables of other means."""
    others = [r for r in records if r["method"] not in OURS]
    slow = [r for r in others if r["method"] in ("interpolated", "rootfinder")]
    four = rows(
        (named(r), f"{r['n']:,}", f"{r['seconds'] / r['n'] * 1e9:.0f}", f"{r['ratio']:.1f}",
         f"{r['error']:.1e}")
        for r in sorted(others, key=lambda r: (named(r), r["n"]))
        if r not in slow
    )  # fmt: skip
    positions = rows((r["work"], named(r), f"{r['ratio']:.1f}", f"{r['error']:.1e}") for r in slow)
    return f"{FOUR}{four}{OTHERS.format(n=slow[0]['n'])}{positions}"


def tasks(records: list[dict[str, Any]]) -> str:
    """Return the tables of whole tasks and of studies."""
    whole = rows(
        (own[WARM]["work"], f"`{own[WARM]['of']}`", own[WARM]["n"], *ms(own),
         f"{own[WARM]['ratio']:.1f}", f"{own[WARM]['error']:.1e}")
        for own in together([r for r in records if "of" in r])
    )  # fmt: skip
    sets = [r for r in records if r["method"] in ("md.study", "md.screen")]
    many = rows(
        (r["work"], f"`{r['method']}`", f"{r['n']:,}", f"{r['n'] / r['seconds']:.0f}",
         f"{r['ratio']:.1f}", f"{r['error']:.1e}")
        for r in sets
    )  # fmt: skip
    return f"{TASKS}{whole}{STUDIES.format(poses=sets[0]['poses'])}{many}"


def chains(records: list[dict[str, Any]]) -> str:
    """Return the table of chains."""
    grown = rows(
        (r["loops"], 2 * r["loops"], f"{r['build_per_loop'] * 1e3:.1f}",
         f"{r['per_loop_and_pose'] * 1e9:.0f}", f"{r['error']:.1e}", f"{r['bound']:.1e}")
        for r in records
    )  # fmt: skip
    first, last = records[0], records[-1]
    tail = TAIL.format(
        first=first["loops"], last=last["loops"],
        build=last["build_per_loop"] / first["build_per_loop"],
        pose=last["per_loop_and_pose"] / first["per_loop_and_pose"],
    )  # fmt: skip
    return f"{CHAIN.format(n=first['n'])}{grown}{tail}"


def forces(records: list[dict[str, Any]]) -> str:
    """Return the tables of forces and of a motion."""
    loaded = rows(
        (r["work"], r["method"], f"{r['n']:,}", f"{r['seconds'] / r['n'] * 1e9:.0f}",
         f"{r['ratio']:.1f}", f"{r['first'] * 1e3:.0f}" if "first" in r else "",
         f"{r['error']:.1e}")
        for r in records
        if r.get("task") == "reactions" and "of" not in r
    )  # fmt: skip
    moved = rows(
        (r["method"], f"{r['tolerance']:.0e}", r["n"], f"{r['seconds'] * 1e3:.1f}",
         f"{r['ratio']:.1f}", f"{r['error']:.1e}")
        for r in records
        if "tolerance" in r
    )  # fmt: skip
    return f"{FORCES}{loaded}{MOTION}{moved}"


def kind_of(record: dict[str, Any]) -> str:
    """Return in words what a record is shown among."""
    if "loops" in record:
        return "growth with the mechanism"
    if "of" in record:
        return "whole tasks"
    if record["method"] in ("md.study", "md.screen"):
        return "many sets of numbers"
    if "tolerance" in record:
        return "a motion"
    if record.get("task") == "start":
        return "starts of processes"
    if record.get("task") == "reactions":
        return "forces"
    return f"`{record['work']}`" if record["method"] in OURS else record["method"]


def runs(records: list[dict[str, Any]]) -> str:
    """Return the table of the runs that records are of."""
    found: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        found.setdefault(record["run"], []).append(record)
    lines, untold = [], False
    for k, own in enumerate(found.values(), start=1):
        loads = [r["load"] for r in own if r["load"] is not None]
        untold |= len(loads) < len(own)
        load = f"{min(loads):.1f} to {max(loads):.1f}" if loads else ""
        dates = sorted({r["date"] for r in own})
        date = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
        words = ", ".join(dict.fromkeys(kind_of(r) for r in own))
        back_end = "; ".join(sorted({r["back_end"] or "" for r in own}))
        version = ", ".join(sorted({r["version"] for r in own}))
        lines.append((k, words, date.replace("T", " "), version, back_end, load))
    said = ONE if len(lines) == 1 else SEVERAL.format(count=len(lines))
    return RUNS.format(said=said) + rows(lines) + (UNTOLD if untold else "")


def page(records: list[dict[str, Any]]) -> str:
    """Return the text of the page."""
    head = HEAD.format(runs=runs(records))
    moving = [r for r in records if "loops" not in r and "task" not in r]
    return "".join(
        (head, calls(moving), started(records), beside(moving), tasks(records),
         chains([r for r in records if "loops" in r]), forces(records), aims(), ENDS)
    )  # fmt: skip


def readme(text: str, records: list[dict[str, Any]]) -> str:
    """Return the README with its table between the markers."""
    moving = [r for r in records if "loops" not in r and "task" not in r]
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}\n\n{calls(moving, SHOWN)}\n{END}{tail}"


def main(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--measure", action="store_true")
    asked = parser.parse_args(arguments)
    from make_evidence import stamped

    if asked.measure:
        from benchmarks.__main__ import main as measured

        measured(["--out", str(DATA.parent)])
        for left in DATA.parent.glob("bench*.svg"):
            left.unlink()
        picture = FOLDER.parent / "plots" / "speed_against_error.py"
        subprocess.run([sys.executable, str(picture)], check=True)
    records = json.loads(DATA.read_text(encoding="utf-8"))
    old = README.read_text(encoding="utf-8")
    wanted = {PAGE: stamped(PAGE.name, page(records)), README: readme(old, records)}
    for path, text in wanted.items():
        if asked.check and path.read_text(encoding="utf-8") != text:
            print(f"{path.name} is not what bench.json says")
            return 1
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
