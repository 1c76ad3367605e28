"""What solving costs beside a checkout from before there were certificates: it should be the same.

    python -m tests.scripts.without_certify OTHER --out docs/data/without-certify.json

OTHER is a checkout of 3e5cff2, its machine built. Of each problem a warm call of `md.Solver` with
another value, `md.solve` of a structure that is known, and the command from the start of a process
are timed in processes of both checkouts, in turn, by processor time. The ratio is the median of
those of pairs.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.shared.paths import ROOT

CASES = {
    "four-bar-crank-rocker": ("turn", "modes"),
    "gorshkov-seven-link": ("window", "modes"),
    "jansen-leg": ("turn",),
    "geared-five-bar": ("turns", "modes"),
    "double-watt": ("down",),
    "triad-six-modes": ("window", "modes"),
    "planetary-gear-train": ("turn",),
    "chain-of-four-bars": ("turn", "modes"),
    "rssr": ("turn", "modes"),
    "cardan-joint": ("turn", "modes"),
    "bennett": ("turn",),
    "delta-robot": ("path", "modes"),
    "hexapod": ("inverse",),
}
"""Tasks of the predefined problems that are timed."""
WORKER = """
import sys, time
import mechdae as md
problem, task = md.load(sys.argv[1]), sys.argv[2]
key, value = next((k, v) for k, v in problem.mechanism.values().items() if abs(v) > 1e-3)
solver, count = md.Solver(problem, task), 0
def warm():
    global count
    count += 1
    try:
        solver({key: value * (1 + 1e-9 * count)})
    except md.MechdaeError:
        pass
calls = {"warm": warm, "solve": lambda: md.solve(problem, task)}
for line in sys.stdin:
    word, times = line.split()
    start = time.process_time()
    for _ in range(int(times)):
        calls[word]()
    print((time.process_time() - start) / int(times), flush=True)
"""
MANY = 61
SHORTEST = 0.03
"""Bursts where some seem slower, seconds that a burst of calls takes at least."""


class Worker:
    """A process of a checkout that times calls of one task."""

    def __init__(self, root: Path, name: str, task: str, folder: str) -> None:
        own = dict(os.environ, PYTHONPATH=str(root), MECHDAE_CACHE=f"{folder}/{root.name}")
        self.process = subprocess.Popen(
            [sys.executable, "-c", WORKER, name, task],
            **{"cwd": folder, "env": own, "text": True},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def seconds(self, word: str, times: int) -> float:
        """Return the processor time of a call, the mean of some."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{word} {times}\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def command(root: Path, name: str, task: str, folder: str) -> float:
    """Return the processor time of the command of a checkout."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = dict(os.environ, PYTHONPATH=str(root), MECHDAE_CACHE=f"{folder}/{root.name}")
    words = [sys.executable, "-m", "mechdae", "solve", name, "--task", task, "--quiet"]
    done = subprocess.run(words, cwd=folder, env=own, capture_output=True)
    assert done.returncode in (0, 1), done.stderr  # 1: some poses are not reached
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def told(pairs: list[tuple[float, float]]) -> dict[str, float]:
    """Return medians of here and there in milliseconds, and the median of ratios."""
    return {
        "now_ms": round(1e3 * statistics.median(now for now, _ in pairs), 3),
        "before_ms": round(1e3 * statistics.median(then for _, then in pairs), 3),
        "ratio": round(statistics.median(now / then for now, then in pairs), 3),
    }


def bursts(workers: list[Worker], word: str, repeats: int) -> dict[str, float]:
    """Return the figures of so many bursts of calls in turn."""
    longest = max(worker.seconds(word, 3) for worker in workers)
    times, pairs = max(1, round(SHORTEST / longest)), list[tuple[float, float]]()
    for k in range(repeats):
        own = [worker.seconds(word, times) for worker in workers[:: 1 if k % 2 else -1]]
        pairs.append((own[0], own[1]) if k % 2 else (own[1], own[0]))
    return told(pairs)


def measured(name: str, task: str, other: Path, repeats: int) -> dict[str, Any]:
    """Return the figures of a task."""
    found: dict[str, Any] = {"problem": name, "task": task}
    with tempfile.TemporaryDirectory() as folder:
        commands = [
            (command(ROOT, name, task, folder), command(other, name, task, folder))
            for _ in range(2 + repeats // 3)
        ]
        found["command"] = told(commands[1:])  # before, kernels are built and modules compiled
        workers = [Worker(root, name, task, folder) for root in (ROOT, other)]
        for word in ("warm", "solve"):
            found[word] = bursts(workers, word, repeats)
            if 1.05 < found[word]["ratio"] < 2:  # noise of a loaded machine, or not
                found[word] = bursts(workers, word, MANY) | {"bursts": MANY}
        for worker in workers:
            worker.close()
    print(found, flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("other", type=Path, help="another checkout, its machine built")
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--only", nargs="*", default=[*CASES], help="problems")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    if options.out and options.out.exists():  # a run that was stopped goes on
        rows = json.loads(options.out.read_text())["rows"]
    known = {(row["problem"], row["task"]) for row in rows}
    for name in options.only:
        for task in CASES[name]:
            if (name, task) in known:
                continue
            rows.append(measured(name, task, options.other.resolve(), options.repeats))
            if options.out:
                medians = {
                    word: round(statistics.median(row[word]["ratio"] for row in rows), 3)
                    for word in ("warm", "solve", "command")
                }
                text = json.dumps({"median": medians, "rows": rows}, indent=1)
                options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
