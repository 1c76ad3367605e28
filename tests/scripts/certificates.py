"""Certificates of all predefined sweeps and modes, checked; planted alterations, all refused.

    python -m tests.scripts.certificates --alterations 200 --out docs/data/certificates.json

Times are those of the processor. What was done is kept in OUT.part after each problem, and a run
that was stopped goes on from there. With names of problems only their rows in OUT are made anew.
The exit code is 1 where a certificate that was written is refused, or an altered one is not.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.certificates import as_json, check_certificate
from mechdae.certificates.write import certificate_of
from mechdae.describe.file import library
from mechdae.errors import MechdaeError, SolveError
from tests.shared.altered import KINDS, alter

ALTERED = (
    ("gorshkov-seven-link", "window"),
    ("pantograph", "poses"),
    ("four-bar-double-rocker", "window"),
    ("double-watt", "modes"),
    ("gorshkov-seven-link", "modes"),
    ("differential", "line"),
    ("triad-six-modes", "modes"),
    ("geared-five-bar", "modes"),
)
SPATIAL = (
    ("rssr", "poses"),
    ("rssr", "modes"),
    ("delta-robot", "path"),
    ("vector-modules-spatial", "l_a_b"),
    ("cardan-joint", "poses"),
)
MODES = tuple(
    (name, "modes")
    for name in (
        *("double-wishbone", "double-cardan", "screw-press", "six-axis-arm", "seven-r"),
        *("stewart-gough", "bennett", "bricard", "sarrus", "flyball-governor", "delta-robot"),
    )
)
"""Modes in space, of which `OF_MODES` alterations are planted."""
OF_MODES = 66
PLANE = (
    ("parallelogram-three-cranks", "turn"),
    ("five-crank-parallelogram", "modes"),
    ("change-point-parallelogram", "turn"),
    ("folding-slider-crank", "turn"),
    ("kite", "pose"),
    ("cam-roller-follower", "turn"),
    ("hypocycloid-drive", "modes"),
    ("wankel-rotor", "modes"),
)
LONGEST = 150
"""Seconds of processor time after which writing and checking a certificate is given up."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--alterations", type=int, default=200)
    parser.add_argument("--out")
    parser.add_argument("--plane", type=int, help="only so many alterations in the plane")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    signal.signal(signal.SIGVTALRM, _late)
    kept = Path(f"{options.out}.part") if options.out else None
    known = json.loads(kept.read_text()) if kept and kept.exists() else {}
    if options.names or options.plane:
        return anew(options.names, options.plane or 0, Path(options.out))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "certificate.json"
        for name in library.names():
            known[name] = known.get(name) or rows(name, path)
            if kept:
                kept.write_text(json.dumps(known))
        tasks = [row for name in library.names() for row in known[name]]
        passed = [what for what in alterations(options.alterations, path, ALTERED) if what]
        spatial = [what for what in alterations(options.alterations, path, SPATIAL) if what]
        of_modes = [what for what in alterations(OF_MODES, path, MODES) if what]
        plane = in_the_plane(options.alterations, path)
    found = sums(tasks) | {
        "alterations": {"count": options.alterations, "passed": passed},
        "alterations_in_space": {"count": options.alterations, "passed": spatial},
        "alterations_of_modes": {"count": OF_MODES, "passed": of_modes},
        "alterations_in_the_plane": plane,
        "rows": tasks,
    }
    if options.out and kept:
        kept.unlink()
        Path(options.out).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print({key: value for key, value in found.items() if key != "rows"})
    failed = found["refused"] or passed or spatial or of_modes or plane["passed"]
    return 1 if failed else 0


def anew(names: list[str], plane: int, out: Path) -> int:
    """Make the rows of some problems anew, and what follows from all rows; alterations."""
    found = json.loads(out.read_text(encoding="utf-8"))
    by_name = {
        name: [row for row in found["rows"] if row["problem"] == name] for name in library.names()
    }
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            by_name[name] = rows(name, Path(folder) / "certificate.json")
        planted = in_the_plane(plane, Path(folder) / "certificate.json")
    tasks = [row for name in library.names() for row in by_name[name]]
    if plane:
        found["alterations_in_the_plane"] = planted
    found |= sums(tasks) | {"rows": tasks}
    out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 1 if found["refused"] or planted["passed"] else 0


def in_the_plane(count: int, path: Path) -> dict[str, Any]:
    """Return what became of alterations; some are seen only where the problem is at hand.

    They change a number that is multiplied by zero at the poses of a certificate.
    """
    unseen = list[str]()
    passed = [what for what in alterations(count, path, PLANE, unseen) if what]
    return {"count": count, "passed": passed, "seen_beside_the_problem": unseen}


def sums(tasks: list[dict[str, Any]]) -> dict[str, Any]:
    """Return counts and processor times of all rows."""
    written = [row for row in tasks if "proved" in row]
    return {
        "tasks": len(tasks),
        "written": len(written),
        "refused": [row for row in tasks if "refused" in row],
        "seconds_sweeps": round(sum(row["solve"] for row in written), 2),
        "seconds_written": round(sum(row["write"] for row in written), 2),
        "seconds_checked": round(sum(row["check"] for row in written), 2),
    }


def rows(name: str, path: Path) -> list[dict[str, Any]]:
    """Return for each sweep and task of modes of a problem what became of its certificate."""
    problem, found = md.load(name), []
    for task, entry in problem.tasks.items():
        if entry.kind not in ("sweep", "modes"):
            continue
        row: dict[str, Any] = {"problem": name, "task": task}
        start = time.process_time()
        md.solve(problem, task)
        row["solve"] = round(time.process_time() - start, 3)
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
        try:
            row |= certified(problem, task, path)
        except TimeoutError:
            row["not_written"] = f"not finished after {LONGEST} s"
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        found.append(row)
        print(row, file=sys.stderr, flush=True)
    return found


def certified(problem: md.Problem, task: str, path: Path) -> dict[str, Any]:
    """Return what became of the certificate of a task, with processor times."""
    start = time.process_time()
    try:
        path.write_text(as_json(certificate_of(problem, task)), encoding="utf-8")
    except MechdaeError as error:
        return {"not_written": error.what}
    row = {"write": round(time.process_time() - start, 3), "bytes": path.stat().st_size}
    start = time.process_time()
    try:
        row["proved"] = check_certificate(path)
    except SolveError as refused:
        row["refused"] = str(refused)
    return row | {"check": round(time.process_time() - start, 3)}


def _late(*_: Any) -> None:
    raise TimeoutError


def alterations(
    count: int, path: Path, which: tuple[tuple[str, str], ...], unseen: list[str] | None = None
) -> list[str]:
    """Return by alteration what passed the check although it is false; "" where it was refused.

    With a list for those `unseen` alone, what passes is compared with the problem too.
    """
    contents = [certificate_of(md.load(name), task) for name, task in (which if count else ())]
    rng, found = random.Random(11), list[str]()
    while len(found) < count:
        content = contents[len(found) % len(contents)]
        kind = rng.choice((*KINDS, *["number"] * len(KINDS)))
        other, what = alter(content, kind, rng)
        if not what:
            continue
        path.write_text(as_json(other), encoding="utf-8")
        try:
            told = f"{content['task']}: {kind} {what}: {check_certificate(path)}"
            if unseen is not None:
                unseen.append(told)
                check_certificate(path, content["problem"])
                unseen.pop()
            found.append(told)
        except SolveError:
            found.append("")
    return found


if __name__ == "__main__":
    sys.exit(main())
