"""Parts of all predefined mechanisms of the plane: closed, and apart in thousands of poses.

`python -m tests.scripts.parts_apart --poses 10000 --minutes 10 --out docs/data/parts.json`. The
check is that of `tests.shared.solids`, which knows nothing of how parts are made. Mechanisms
without parts have the reason that the export names.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import mechdae as md
from mechdae.describe.file.library import names
from tests.shared.solids import Assembly, open_sides


def entry(name: str, poses: int) -> dict[str, object]:
    """Return counts of a mechanism's parts, or why it has none."""
    try:
        found = Assembly(name, poses)
    except md.MechdaeError as error:
        return {"reason": " ".join(str(error).split())}
    solids = [solid for several in found.solids.values() for solid in several]
    overlaps = [list(pair) for pair in found.overlaps()]
    gaps = sum(open_sides(triangles) for triangles in solids)
    return {
        "solids": len(solids), "poses": len(found.rows), "open_sides": gaps, "overlaps": overlaps,
    }  # fmt: skip


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=10_000)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    whole: dict[str, object] = {}
    end = time.process_time() + 60 * options.minutes
    for name in names():
        if md.load(name).mechanism.dimension != 2:
            continue
        if time.process_time() > end:
            whole[name] = {"reason": "not reached in the time of the script"}
            continue
        whole[name] = entry(name, options.poses)
        print(name, whole[name], file=sys.stderr, flush=True)
    text = json.dumps(whole, indent=1) + "\n"
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
