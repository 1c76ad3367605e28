"""Certificates of all predefined sweeps and modes, checked; planted alterations, all refused.

    python -m tests.scripts.certificates --alterations 200 --out docs/data/certificates.json

Times are those of the processor. Rows are kept in OUT.part after each problem, and a run that was
stopped goes on from there. With names of problems only their rows in OUT are made anew, with --only
some of the parts.
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
from mechdae.describe.file import library
from mechdae.errors import MechdaeError, SolveError
from mechdae.parts.proof import as_json, check_certificate
from mechdae.parts.proof.write import certificate_of
from tests.shared.altered import KINDS, alter
from tests.shared.altered_lists import alterations_of_lists, is_fault
from tests.shared.certified import CASES, certificate, checked

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
OF_MODES, IN_PLANE, OF_LISTS = 66, 80, 2
"""Alterations that are planted; lists of each kind in each certificate."""
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
    parser.add_argument("--out", required=True)
    parser.add_argument("--only", nargs="*", choices=PARTS, default=PARTS)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    signal.signal(signal.SIGVTALRM, _late)
    out, only = Path(options.out), ("rows",) if options.names else options.only
    with tempfile.TemporaryDirectory() as folder:
        path, done = Path(folder) / "certificate.json", dict[str, Any]()
        for part in only:
            done |= part_of(part, path, options.alterations, out, options.names)
    found = json.loads(out.read_text(encoding="utf-8")) if out.exists() else {}
    found |= done
    out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print({key: value for key, value in done.items() if key != "rows"})
    faults = [done.get(part, {}).get("passed") for part in PARTS if part != "rows"]
    return 1 if done.get("refused") or any(faults) else 0


PARTS = (
    *("rows", "alterations", "alterations_in_space", "alterations_of_modes"),
    *("alterations_in_the_plane", "alterations_of_lists"),
)


def part_of(part: str, path: Path, count: int, out: Path, names: list[str]) -> dict[str, Any]:
    """Return what is written of one of `PARTS`."""
    if part == "rows":
        tasks = every_row(path, out, names)
        return sums(tasks) | {"rows": tasks}
    if part == "alterations_of_lists":
        return {part: of_lists(path)}
    unseen: list[str] | None = [] if part == "alterations_in_the_plane" else None
    planted = {
        "alterations": (count, ALTERED),
        "alterations_in_space": (count, SPATIAL),
        "alterations_of_modes": (OF_MODES, MODES),
        "alterations_in_the_plane": (IN_PLANE, PLANE),
    }
    number, which = planted[part]
    passed = [what for what in alterations(number, path, which, unseen) if what]
    seen = {} if unseen is None else {"seen_beside_the_problem": unseen}
    return {part: {"count": number, "passed": passed} | seen}


def every_row(path: Path, out: Path, names: list[str]) -> list[dict[str, Any]]:
    """Return the rows of all problems, or those in the file with some problems anew."""
    if names:
        known: dict[str, Any] = {name: [] for name in library.names()}
        for row in json.loads(out.read_text(encoding="utf-8"))["rows"]:
            known[row["problem"]] += [] if row["problem"] in names else [row]
    else:
        part = Path(f"{out}.part")
        known = json.loads(part.read_text()) if part.exists() else {}
    for name in names or library.names():
        known[name] = known.get(name) or rows(name, path)
        if not names:
            part.write_text(json.dumps(known))
    if not names:
        part.unlink()
    return [row for name in library.names() for row in known[name]]


def of_lists(path: Path) -> dict[str, Any]:
    """Return what became of lists with an entry less, twice or elsewhere, in all kinds."""
    count, weaker, passed = 0, 0, list[str]()
    for word in CASES:
        content = certificate(word)
        unaltered, rng = checked(content, path.parent), random.Random(7)
        for place, how, other in alterations_of_lists(content, rng, OF_LISTS):
            count += 1
            try:
                sentence = checked(other, path.parent)
            except SolveError:
                continue
            weaker += sentence != unaltered
            if is_fault(sentence, unaltered, place, how):
                passed.append(f"{word}: {how} {place}: {sentence}")
    return {"count": count, "weaker_claims": weaker, "passed": passed}


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
