"""What commands cost from the start of a process, beside those of another checkout.

python -m tests.scripts.startup OTHER --repeats 11 --out docs/data/startup.json

Processor time of child processes, run in turn; the ratio is the median of ratios of pairs.
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

from tests.shared.paths import ROOT

COMMANDS = {
    "import mechdae": ["-c", "import mechdae"],
    "mechdae list": ["-m", "mechdae", "list"],
    "mechdae show gorshkov-seven-link": ["-m", "mechdae", "show", "gorshkov-seven-link"],
    "mechdae solve slider-crank --poses 1000": [
        "-m", "mechdae", "solve", "slider-crank", "--poses", "1000", "--quiet",
    ],
    "mechdae solve slider-crank-friction": [
        "-m", "mechdae", "solve", "slider-crank-friction", "--quiet",
    ],
}  # fmt: skip


def seconds(root: Path, arguments: list[str], folder: str) -> float:
    """Return the processor time of a command of a checkout."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = dict(os.environ, PYTHONPATH=str(root), MECHDAE_CACHE=f"{folder}/{root.name}")
    subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=own, check=True, capture_output=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measured(other: Path, repeats: int) -> dict[str, dict[str, float]]:
    """Return by command the medians of here and of the other checkout, and their ratio."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in COMMANDS.items():
            times: dict[Path, list[float]] = {ROOT: [], other: []}
            for k in range(repeats + 2):
                for root in [ROOT, other][:: 1 if k % 2 else -1]:
                    spent = seconds(root, arguments, folder)
                    if k > 1:  # before, kernels are built and modules compiled
                        times[root].append(spent)
            pairs = zip(times[ROOT], times[other], strict=True)
            found[name] = {
                "now_ms": round(1e3 * statistics.median(times[ROOT]), 1),
                "before_ms": round(1e3 * statistics.median(times[other]), 1),
                "ratio": round(statistics.median(now / then for now, then in pairs), 3),
            }
            print(name, found[name], flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("other", type=Path, help="another checkout, its machine built")
    parser.add_argument("--repeats", type=int, default=11)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    found = measured(options.other.resolve(), options.repeats)
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
