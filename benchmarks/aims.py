"""The aims of speed, and what is reached, with each back end.

``MECHDAE_BACKEND=c python -m benchmarks.aims --out docs/data/aims.json`` measures with one back end
and keeps the figures of the other; `docs/make_speed.py` writes the table. Times are of the
processor, medians, in units of the yardstick (y) of the same run where nothing else is said.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from benchmarks import forces, integrators, startup, studies
from mechdae.kernels.machine.library import backend
from mechdae.parts.bench import chain, kinematics, motions
from mechdae.parts.bench.runs import yardstick

MANY = 100_000
MOST, LEAST = "at most", "at least"


@dataclass(frozen=True)
class Aim:
    """What is measured, its unit, and the bars without and with the compiled machine."""

    work: str
    unit: str
    numpy: float
    c: float
    sense: str = MOST

    def met(self, value: float, compiled: bool) -> bool:
        """Return whether a figure is as good as the bar."""
        bar = self.c if compiled else self.numpy
        return value <= bar if self.sense == MOST else value >= bar


AIMS = {
    "four-bar": Aim("`md.solve`, four-bar, 100 000 poses", "y", 2.0, 1.0),
    "seven-link": Aim("`md.solve`, seven-link, 100 000 poses", "y", 5.0, 2.0),
    "jansen": Aim("`md.solve`, Jansen's leg, 100 000 poses", "y", 7.0, 3.0),
    "memory": Aim("`md.solve`, four-bar, a million poses: most memory", "MB", 400, 400),
    "warm": Aim("`md.Solver`, four-bar, 100 poses, whole result", "ms", 1.0, 0.25),
    "arrays": Aim("`md.Solver.poses`, four-bar, 100 poses, arrays", "ms", 1.0, 0.25),
    "window": Aim("`md.Solver`, seven-link, its whole assembled arc, 181 poses", "ms", 8.0, 8.0),
    "cold": Aim(
        "start to 1000 poses on the terminal, kernels on disk", "`import numpy, casadi`", 1.6, 1.6
    ),
    "built": Aim("the same, kernels built", "`import numpy, casadi`", 2.0, 2.0),
    "study": Aim("study, four-bars +-5 %, two cores", "mechanisms/s", 6000, 15_000, LEAST),
    "legs": Aim("study, Jansen legs +-0.3 %, two cores", "mechanisms/s", 1500, 5000, LEAST),
    "wide": Aim("study, Jansen legs +-5 %, two cores", "mechanisms/s", 1500, 5000, LEAST),
    "screen": Aim("screening, four-bars, two cores", "mechanisms/s", 20_000, 50_000, LEAST),
    "screened": Aim("screening, Jansen legs, two cores", "mechanisms/s", 5000, 12_000, LEAST),
    "reactions": Aim("reactions and effort, four-bar, 100 000 poses", "y", 3.0, 1.5),
    "coupled": Aim("the same with coupled friction in four pins", "y", 8.0, 4.0),
    "slider": Aim("slider-crank with friction, whole cycle, 100 000 poses", "y", 8.0, 4.0),
    "andrews": Aim(
        "Andrews' squeezer, whole task at 1e-10", "scipy DOP853 on the same equations", 1.0, 0.4
    ),
    "build": Aim("chain of four-bars, 10 to 1000 loops: most to build a loop", "ms", 8.0, 8.0),
    "growth": Aim("the same: time a loop and pose, most over least", "", 1.5, 1.5),
}


def sweeps() -> Iterator[tuple[str, float]]:
    for key, item in zip(("four-bar", "seven-link", "jansen"), kinematics.standard(), strict=True):
        for record in kinematics.measure(item, (MANY,)):
            if record["method"] == "md.solve, again":
                yield key, record["ratio"]
    for record in kinematics.measure(kinematics.standard()[0], (100,), 25):
        key = {"md.Solver": "warm", "md.Solver.poses": "arrays"}.get(record["method"])
        if key is not None:
            yield key, 1e3 * record["seconds"]
    length = md.load("gorshkov-seven-link").mechanism.values()["OA"]
    solver = md.Solver("gorshkov-seven-link", "window")
    yield "window", 1e3 * warm(lambda share: solver(OA=length * (1 + share)), 25)


def warm(call: Callable[[float], Any], rounds: int) -> float:
    """Return the median seconds of a call, each with a number that none had before."""
    call(0.0)
    times = []
    for k in range(rounds):
        start = time.process_time()
        call(1e-6 * (k + 1))
        times.append(time.process_time() - start)
    return statistics.median(times)


def memory() -> Iterator[tuple[str, float]]:
    code = (
        "import mechdae as md\n"
        "md.solve('four-bar-crank-rocker', 'turn', poses=1_000_000)\n"
        "lines = open('/proc/self/status').read().splitlines()\n"
        "print(next(line for line in lines if line.startswith('VmHWM')).split()[1])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    yield "memory", float(done.stdout) * 1024 / 1e6


def starts() -> Iterator[tuple[str, float]]:
    for record in startup.measured():
        key = {startup.KEPT: "cold", startup.BUILT: "built"}.get(record["setting"])
        if key is not None:
            yield key, record["ratio"]


def sets() -> Iterator[tuple[str, float]]:
    """Yield mechanisms a second of two processes: twice those of one."""
    keys = (("study", "screen"), ("legs", "screened"), ("wide", ""))
    for entry, (certified, screened) in zip(studies.CASES, keys, strict=True):
        found = studies.measured(entry, 4096, 3)
        yield certified, 2 * found["certified"]["per_second"]
        if screened:
            yield screened, 2 * found["screened"]["per_second"]


def loaded() -> Iterator[tuple[str, float]]:
    angles = np.linspace(0, 2 * np.pi, MANY)
    unit = warm(lambda _: yardstick(angles), 9)
    for key, friction in (("reactions", "none"), ("coupled", "coupled")):
        solver = md.Solver(forces.problem(MANY, friction), "forces")
        name = "coupler.C.x"
        length = solver.problem.mechanism.values().get(name, forces.COUPLER)
        call = partial(_scaled, solver, name, float(length))
        yield key, warm(call, 9) / unit
    problem = md.load("slider-crank-friction")
    problem = problem.with_task("cycle", replace(problem.tasks["cycle"], poses=MANY))
    call = partial(_scaled, md.Solver(problem, "cycle"), "r", problem.mechanism.values()["r"])
    yield "slider", warm(call, 5) / unit


def _scaled(solver: md.Solver, name: str, value: float, share: float) -> md.Result:
    return solver({name: value * (1 + share)})


def andrews() -> Iterator[tuple[str, float]]:
    problem = md.load("andrews-squeezer")
    work = motions.work_of(problem)
    assert work is not None
    records, _ = motions.measure(work, (1e-10,), 7, integrators.others)
    scipy = next((r["seconds"] for r in records if r["method"] == "scipy DOP853"), None)
    if scipy is not None:
        mass = problem.mechanism.values()["m1"]
        call = partial(_scaled, md.Solver(problem, "motion"), "m1", mass)
        yield "andrews", warm(call, 9) / scipy


def chains() -> Iterator[tuple[str, float]]:
    records = chain.scaling((10, 100, 1000), 1000, 3)
    costs = [record["per_loop_and_pose"] for record in records]
    yield "build", 1e3 * max(record["build_per_loop"] for record in records)
    yield "growth", max(costs) / min(costs)


PARTS = (sweeps, memory, starts, sets, loaded, andrews, chains)


def table(data: dict[str, dict[str, float]]) -> str:
    """Return aims and figures as a Markdown table; figures that miss their aim are bold."""
    lines = [
        "| work | unit | NumPy | its aim | compiled machine | its aim |",
        "|---|---|---|---|---|---|",
    ]
    for key, aim in AIMS.items():
        cells = [aim.work, aim.unit]
        for name, bar in (("numpy", aim.numpy), ("c", aim.c)):
            value = data.get(name, {}).get(key)
            told = "" if value is None else _text(value)
            if value is not None and not aim.met(value, name == "c"):
                told = f"**{told}**"
            cells += [told, f"{aim.sense} {bar:,g}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


REASONS = {
    "four-bar": "half of it is the kernel, half fresh memory for 25 MB of results",
    "seven-link": "as for the four-bar",
    "jansen": "as for the four-bar",
    "warm": "each result is assembled from its sketch, followed, bounded and reported in Python, "
    "whatever the number of poses; the same poses as arrays need a sixth of it",
    "arrays": "a dozen calls of NumPy for each proved stretch",
    "window": "both limit positions are found and proved anew in each call",
    "cold": "some 170 modules are read, then the mechanism is modelled before its kernels are read",
    "built": "as above",
    "wide": "a quarter of the legs lock within the turn: steps that have to be proved beside their "
    "limit positions take most of it, and one leg in 1000 is computed alone",
    "reactions": "signs, checks and series of all joints are passes over fresh memory",
    "coupled": "as above",
    "slider": "the means over a cycle look for the places where friction changes: forces are "
    "evaluated twice at all poses",
    "andrews": "the aim is against equations written by hand in NumPy, which take twice as long as "
    "these; the whole task has energy, drift and reactions besides",
    "build": "ten loops also carry what every mechanism costs; each further one takes 7 to 10 ms "
    "of Python: elimination, bounds and names differ from loop to loop",
    "growth": "the sketch of a long chain is rough: up to 2000 modes are begun to find the nearest "
    "of the whole; without that a loop and pose take 490 ns in a chain of 10, 300 ns in one of 300",
}
"""Why an aim may be missed."""


def missed(data: dict[str, dict[str, float]]) -> str:
    """Return the aims that are not reached as a list, each with its figures and the reason."""
    lines = []
    for key, aim in AIMS.items():
        told = []
        for name, words, bar in (("numpy", "NumPy", aim.numpy), ("c", "compiled", aim.c)):
            value = data.get(name, {}).get(key)
            if value is not None and not aim.met(value, name == "c"):
                told.append(f"{words} {_text(value)}, aim {aim.sense} {bar:,g}")
        if told:
            lines.append(f"- {aim.work} [{aim.unit or 'ratio'}]: {'; '.join(told)}. {_why(key)}")
    return "\n".join(lines) + "\n"


def _why(key: str) -> str:
    text = REASONS.get(key, "")
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _text(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.2g}" if value < 10 else f"{value:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", default="", help="parts with this text in their names")
    options = parser.parse_args()
    data: dict[str, dict[str, float]] = {}
    if options.out and options.out.exists():
        data = json.loads(options.out.read_text(encoding="utf-8"))
    own = data.setdefault("c" if backend().startswith("C") else "numpy", {})
    for part in PARTS:
        if options.only in part.__name__:
            own |= {key: float(f"{value:.4g}") for key, value in part()}
    print(table(data))
    if options.out:
        options.out.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
