"""Bounds of poses of random mechanisms against balls; a certificate of each, written and checked.

    python -m tests.scripts.bounds_in_balls --count 1000 --out docs/data/bounds-in-balls.json

Structures are those of `tests.attack.honesty`; each is built once and swept over a short way with
many sets of dimensions. OUT is written after each structure, and a run that was stopped goes on
behind the last one. The exit code is 1 where a bound in balls exceeds the one reported, or a
certificate that was written is refused.
"""

from __future__ import annotations

import argparse
import copy
import json
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.errors import MechdaeError, SolveError, UnavailableError
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.proof import as_json, check_certificate
from mechdae.parts.proof.write import certificate_of
from tests.reference.truth.drawing import draw
from tests.shared.in_balls import bounds

FAMILIES = ("dyads", "gears", "triads", "slender", "toggle", "geared", "far", "parallel")
SETS, POSES, WAY = 20, 4, 0.08
"""Sets of dimensions of a structure, poses of a sweep, its half length in the driver's unit."""
LONGEST = 60
"""Seconds of the processor for a certificate and its check. Those that take longer are given up,
counted, and told by name."""
NUMBERS = ("mechanisms", "poses", "larger", "written", "refused")
LATE = "not finished"
PARTS = ("balls", "write", "check")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--out", required=True)
    options = parser.parse_args()
    out = Path(options.out)
    found: dict[str, Any] = {**dict.fromkeys(NUMBERS, 0), "structures": 0}
    found |= {"not_written": {}, "given_up": [], "faults": [], "seconds": 0.0}
    found |= {"seconds_of": dict.fromkeys(PARTS, 0.0), "longest": ["", 0.0]}
    if out.exists():
        found = json.loads(out.read_text())
    with tempfile.TemporaryDirectory() as folder:
        while found["mechanisms"] < options.count:
            start, seed = time.process_time(), found["structures"]
            rows = structure(FAMILIES[seed % len(FAMILIES)], seed, Path(folder) / "c.json")
            add(found, rows[: options.count - found["mechanisms"]])
            found["structures"] += 1
            found["seconds"] = round(found["seconds"] + time.process_time() - start, 1)
            out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(found)
    return 1 if found["larger"] or found["refused"] else 0


def add(found: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    reasons = Counter(found["not_written"])
    for row in rows:
        for key in NUMBERS:
            found[key] += row.get(key, 0)
        if "why" in row:
            reasons[row["why"].split(":")[0]] += 1
        found["given_up"] += [row["name"]] * (row.get("why") == LATE)
        for part in PARTS:
            spent = row["seconds"].get(part, 0.0)
            found["seconds_of"][part] = round(found["seconds_of"][part] + spent, 3)
        taken = round(sum(row["seconds"].get(part, 0.0) for part in PARTS[1:]), 2)
        found["longest"] = max(found["longest"], [row["name"], taken], key=lambda own: own[1])
        if "fault" in row:
            found["faults"].append(row["fault"])
    found["not_written"] = dict(reasons)


def structure(family: str, seed: int, path: Path) -> list[dict[str, Any]]:
    """Return what became of the sets of dimensions of a structure."""
    base, rng, rows = draw(seed, family), np.random.default_rng([seed, 23]), []
    for k in range(SETS if base is not None else 0):
        case = copy.copy(base)
        case.local = {
            body: {
                name: tuple(float(v) * (1 + 0.03 * rng.uniform(-1, 1)) for v in xy)
                for name, xy in points.items()
            }
            for body, points in base.local.items()
        }
        way = WAY * case.unit
        at = np.linspace(float(base.s0) - way, float(base.s0) + way, POSES)
        driver = md.Driver(case.coordinate, at=tuple(map(float, at)))
        task = md.Sweep(driver, derivatives=0)
        try:
            problem = md.Problem(case.mechanism(), {"sweep": task}, name=f"{family}-{seed}-{k}")
            rows.append(examined(problem, task, path))
        except MechdaeError:  # it does not close with these dimensions
            continue
    return rows


def examined(problem: md.Problem, task: Any, path: Path) -> dict[str, Any]:
    """Return the figures of one mechanism."""
    setting = prepare(problem, task)
    done = run(setting, task)
    result = report(problem, "sweep", task, setting, done)
    poses = [k for k, status in enumerate(result.status) if status == "ok"]
    row: dict[str, Any] = {"mechanisms": 1, "poses": len(poses), "name": problem.name}
    row["seconds"], start = {}, time.process_time()

    def past(part: str) -> None:
        nonlocal start
        row["seconds"][part] = time.process_time() - start
        start = time.process_time()

    for word, own in bounds(setting, done, poses).items():
        told = [float(result.bound[word][k]) for k in poses]
        row["larger"] = row.get("larger", 0) + sum(
            not a <= b for a, b in zip(own, told, strict=True)
        )
    past("balls")
    signal.signal(signal.SIGVTALRM, _late)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        path.write_text(as_json(certificate_of(problem, "sweep")), encoding="utf-8")
        row["written"] = 1
        past("write")
        check_certificate(path)
    except UnavailableError as error:
        return row | {"why": error.what}
    except SolveError as fault:
        return row | {"refused": 1, "fault": f"{problem.name}: {fault}"}
    except TimeoutError:
        return row | {"written": 0, "why": LATE}
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        past("check" if "write" in row["seconds"] else "write")
    return row


def _late(*_: Any) -> None:
    raise TimeoutError


if __name__ == "__main__":
    sys.exit(main())
