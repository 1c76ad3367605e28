"""``mechdae bench [P]``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from mechdae.cli import message


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problem", nargs="?", metavar="P", help="default: the standard works")
    parser.add_argument("--quick", action="store_true", help="fewer poses and repeats")
    parser.add_argument("--out", metavar="DIR", help="write bench.json there")


def run(options: argparse.Namespace) -> int:
    from mechdae.bench.kinematics import QUICK_SIZES, SIZES, measure, standard, table, work_of
    from mechdae.describe.problem import load

    works = [work_of(load(options.problem))] if options.problem else standard()
    sizes, repeats = (QUICK_SIZES, 3) if options.quick else (SIZES, 7)
    records = []
    for item in works:
        records += measure(item, sizes, repeats)
    print(table(records))
    if options.out:
        folder = Path(options.out)
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "bench.json"
        path.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
        message(f"written: {path}", options.quiet)
    return 0
