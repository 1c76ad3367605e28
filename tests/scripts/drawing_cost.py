"""Measures what diagrams cost beside saving an empty figure, in processor time.

    python -m tests.scripts.drawing_cost --runs 15

The yardstick is a new figure of the same size with empty equal axes, saved as SVG. Both are made
and saved in turn in one process, after a first time that does not count; the figures are
medians. Seconds depend on the machine; the ratio hardly does.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

PROBLEMS = ("chain-of-four-bars N=12", "chain-of-four-bars N=15")


def timed(function):
    """Return the processor time of a call and what it returned."""
    started = time.process_time()
    result = function()
    return time.process_time() - started, result


def measure(name, folder, runs):
    """Return the medians of an empty figure, of drawing and of saving a diagram, in seconds."""
    import mechdae as md
    from mechdae.draw import save
    from mechdae.draw.figure import new_axes

    name, *sizes = name.split()
    problem = md.load(name).with_values({k: float(v) for k, v in (s.split("=") for s in sizes)})
    task = next(key for key, task in problem.tasks.items() if task.kind == "sweep")
    result = md.solve(problem, task)

    def empty():
        axes = new_axes()
        axes.set_aspect("equal")
        save(axes, folder / "empty.svg")

    rows = []
    for _ in range(runs + 1):
        first, _ = timed(empty)
        second, axes = timed(lambda: md.plot(result, "diagram"))
        third, _ = timed(lambda axes=axes: save(axes, folder / "full.svg"))
        rows.append((first, second, third, (second + third) / first))
    bodies = len(result.mechanism.bodies)
    labels = sum(
        str(own.get_gid()).startswith(("label-", "number-")) for own in axes.get_children()
    )
    return bodies, labels, [statistics.median(column) for column in zip(*rows[1:], strict=True)]


def main(argv=None):
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=PROBLEMS)
    parser.add_argument("--runs", type=int, default=15)
    options = parser.parse_args(argv)
    print(f"{'problem':28s} links labels  empty ms  draw ms  save ms  ratio")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.names:
            bodies, labels, row = measure(name, Path(folder), options.runs)
            empty, draw, save, ratio = row
            print(
                f"{name:28s} {bodies:5d} {labels:6d} {1e3 * empty:9.1f} {1e3 * draw:8.1f}"
                f" {1e3 * save:8.1f} {ratio:6.1f}"
            )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
