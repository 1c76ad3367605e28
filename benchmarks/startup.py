"""What a process costs from its start to its end: commands beside the import of their libraries.

Seconds are those of the processor, of the process and of nothing else; the yardstick is a
process that imports NumPy and casadi and ends. Modules are compiled before, as ``pip install``
does it.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

PROBLEM = "four-bar-crank-rocker"
POSES = 1000
SOLVE = ("solve", PROBLEM, "--task", "turn", "--poses", str(POSES))
KEPT, BUILT = "kernels on disk", "kernels built"
WAYS = (
    ("import numpy, casadi", "", ("-c", "import numpy, casadi")),
    ("mechdae --version", "", ("-m", "mechdae", "--version")),
    ("mechdae list", "", ("-m", "mechdae", "list")),
    (f"mechdae solve --poses {POSES}", KEPT, ("-m", "mechdae", *SOLVE)),
    (f"mechdae solve --poses {POSES}", BUILT, ("-m", "mechdae", *SOLVE)),
)


def spent(command: tuple[str, ...], environment: dict[str, str]) -> float:
    """Return the processor seconds of a process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *command], env=environment, stdout=subprocess.DEVNULL, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)


def measured(rounds: int = 11) -> list[dict[str, Any]]:
    """Return a record for each way: medians over the rounds, in which each goes once."""
    times: dict[tuple[str, str], list[float]] = {way[:2]: [] for way in WAYS}
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "kernels"
        plain = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        plain |= {"PYTHONPYCACHEPREFIX": str(Path(folder) / "compiled")}
        for round_ in range(-1, rounds):  # the first compiles and builds what is kept
            for method, setting, command in WAYS:
                kept = "0" if setting == BUILT else str(cache)
                seconds = spent(command, plain | {"MECHDAE_CACHE": kept})
                if round_ >= 0:
                    times[method, setting].append(seconds)
    medians = {way: statistics.median(found) for way, found in times.items()}
    yardstick = medians[WAYS[0][:2]]
    return [
        {
            "work": "start", "task": "start", "method": method, "setting": setting, "n": 1,
            "seconds": seconds, "ratio": seconds / yardstick, "yardstick": yardstick,
        }
        for (method, setting), seconds in medians.items()
    ]  # fmt: skip


def table(records: list[dict[str, Any]]) -> str:
    """Return the records as text."""
    return "\n".join(
        f"  {r['method']:28} {r['setting']:16} {r['seconds'] * 1e3:7.0f} ms {r['ratio']:6.2f}"
        for r in records
    )


if __name__ == "__main__":
    print(table(measured()))
