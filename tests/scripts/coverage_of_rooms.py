"""Statements and branches of each room that the quick suite runs; needs `coverage`.

python -m tests.scripts.coverage_of_rooms --out docs/data/coverage.json [--slow tests/proof ...]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from tests.shared.paths import ROOT

SETTINGS = """[run]
branch = True
parallel = True
source = {package}
data_file = {data}
patch = subprocess
[report]
exclude_also =
    if TYPE_CHECKING:
    @overload
    raise AssertionError
    ^ *\\.\\.\\.$
"""


def room_of(file: str) -> str:
    """The room of a file of the package; a part and the checker of certificates are told apart."""
    names = Path(file).resolve().relative_to(ROOT / "mechdae").parts[:-1]
    if names[:3] == ("parts", "proof", "checker"):
        return "parts.proof.checker"
    return ".".join(names[: 1 + (names[:1] == ("parts",))]) or "alone"


def run(arguments: list[str], environment: dict[str, str]) -> None:
    """One command in the root of the project; failures are read in its output."""
    subprocess.run([sys.executable, "-m", *arguments], cwd=ROOT, env=environment, check=False)


def by_rooms(report: dict) -> dict[str, dict[str, float]]:
    """Counts of coverage's report by files, joined to those of rooms."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    for file, values in report["files"].items():
        one = values["summary"]
        names = "covered_lines", "num_statements", "covered_branches", "num_branches"
        parts = [one[name] for name in names]
        room = room_of(file)
        counts[room] = [a + b for a, b in zip(counts[room], parts, strict=True)]
    return {
        room: {
            "statements": total,
            "statements run": round(lines / total, 4) if total else 1.0,
            "branches": ways,
            "branches run": round(taken / ways, 4) if ways else 1.0,
        }
        for room, (lines, total, taken, ways) in sorted(counts.items())
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--slow", nargs="*", default=(), help="folders of slow tests")
    parser.add_argument("--quick", nargs="*", default=(), help="folders of quick tests: all")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, "settings")
        settings.write_text(SETTINGS.format(package=ROOT / "mechdae", data=Path(folder, "data")))
        environment = {**os.environ, "COVERAGE_RCFILE": str(settings)}
        # what the second command of the README runs, and slow tests that are asked for
        # in one process: those of pytest-xdist end before they write what they have seen
        for which in ([*given.quick], ["-m", "slow", *given.slow])[: 1 + bool(given.slow)]:
            run(["coverage", "run", "-m", "pytest", "-n", "0", *which], environment)
        run(["coverage", "combine"], environment)
        text = Path(folder, "report.json")
        run(["coverage", "json", "-o", str(text)], environment)
        rooms = by_rooms(json.loads(text.read_text()))
    given.out.write_text(json.dumps({"rooms": rooms}, indent=1) + "\n")


if __name__ == "__main__":
    main()
