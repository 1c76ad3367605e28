"""The command `mechdae bench` with other methods beside, and more: ``python -m benchmarks``.

Without a problem everything is measured that ``docs/theory/evidence/speed-and-error.md`` shows.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from benchmarks import alternatives, forces, integrators, startup, studies
from mechdae.describe.file.load import load
from mechdae.parts.bench import kinematics, motions
from mechdae.parts.bench.commands import bench

TIGHT = (1e-10,)


def more(quick: bool, say: Callable[[str], None]) -> Iterator[list[dict[str, Any]]]:
    """Measure forces, a motion and studies, each with other methods beside; print the records."""
    sizes = kinematics.QUICK_SIZES if quick else kinematics.SIZES[2:]
    repeats = 3 if quick else 7
    say("measuring forces")
    compared = kinematics.QUICK_COMPARED if quick else kinematics.COMPARED
    records, text = forces.measured(sizes, repeats, compared)
    print(text)
    yield records
    say("measuring a motion")
    work = motions.work_of(load("andrews-squeezer"))
    assert work is not None
    moved, notes = motions.measure(work, TIGHT, repeats, integrators.others)
    print(motions.table(moved, notes))
    yield moved
    say("measuring starts of processes")
    started = startup.measured(3 if quick else 11)
    print(startup.table(started))
    yield started
    say("measuring studies")
    sets, rounds = (200, 1) if quick else (4096, 3)
    many = [
        studies.measured(entry, sets, rounds) for entry in studies.CASES[: 1 if quick else None]
    ]
    print(studies.page(many))
    yield [row for own in many for row in studies.records(own)]


def main(words: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    bench.arguments(parser)
    parser.set_defaults(quiet=False)
    asked = parser.parse_args(words)
    compared = kinematics.QUICK_COMPARED if asked.quick else kinematics.COMPARED
    others = partial(alternatives.alternatives, compared)
    return bench.run(asked, bench.Beside(others, integrators.others, more))


if __name__ == "__main__":
    raise SystemExit(main())
