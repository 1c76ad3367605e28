"""All predefined problems of the plane, drawn as DXF and read back.

python -m tests.scripts.round_trips --out docs/data/round-trips.json [NAMES]

Each comes back with its bodies, joints, mobility, pose and motion, or it is said what of it is
lost. The exit code is 1 where something else became of one.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.describe.file import library
from tests.shared.exports import motion
from tests.shared.round_trips import back, faults


def main() -> int:
    """Draw and read."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    table: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in options.names or library.names():
            if md.load(name).mechanism.dimension != 2:
                continue
            try:
                whole = motion(name)
            except md.MechdaeError as error:
                table[name] = {"not drawn": error.what}
                continue
            table[name] = back(name, Path(folder), whole)
            motion.cache_clear()
            print(name, table[name], flush=True)
    wrong = {name: faults(own) for name, own in table.items() if faults(own)}
    told = {
        "drawn": sum("not drawn" not in own for own in table.values()),
        "came back": sum("off" in own and name not in wrong for name, own in table.items()),
        "of them swept": sum("followed" in own for own in table.values()),
        "said to be lost": sum("lost" in own for own in table.values()),
        "faults": wrong,
    }
    found = {"version": md.__version__, **told, "problems": table}
    options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(told)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
