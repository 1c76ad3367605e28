"""Counts of chains and Assur groups that take longer than a test may.

Usage: ``python -m tests.scripts.chains_long --out docs/data/chains.json``; some ten minutes.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import mechdae as md

COUNTS: list[tuple[str, dict[str, Any], int]] = [
    ("chains", {"links": 12}, 6856),
    ("chains", {"links": 12, "inversions": True}, 75_397),
    ("chains", {"links": 14}, 318_162),
    ("groups", {"links": 12}, 251_638),
]
"""What is counted, and the number of the literature (Butcher and Hartman 2005, Peisach 2008)."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args().out
    rows = []
    for kind, wanted, known in COUNTS:
        begin = time.process_time()
        if kind == "groups":
            found = sum(1 for _ in md.assur_groups(**wanted))
        else:
            found = md.count_chains(**wanted)
        seconds = round(time.process_time() - begin, 1)
        rows.append({"kind": kind, **wanted, "count": found, "known": known, "seconds": seconds})
        print(rows[-1], flush=True)
        out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
