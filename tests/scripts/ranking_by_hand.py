"""Rankings against variants that are solved one by one from their exported files.

Every figure is computed anew from the JSON that ``mechdae solve FILE --json`` prints, with
formulas of this module, and the order by weights from these figures.

Usage: ``python -m tests.scripts.ranking_by_hand --out docs/data/ranking.json``; about a minute.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import tempfile
import tomllib
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.cli import main as command
from mechdae.describe.file.load import from_dict

CASES: list[tuple[str, str, int]] = [
    ("slider-crank-inertia", "construction", 18),
    ("quick-return-friction", "construction", 16),
    ("four-bar-crank-rocker", "construction", 6),
    ("four-bar-crank-rocker", "pairs", 4),
    ("four-bar-crank-rocker", "order", 3),
    ("slider-crank-inertia", "inversion", 3),
]
"""Problem, what is varied, how many are drawn at random: 50 together."""


def compared(name: str, by: str, count: int, seed: int, poses: int | None = None) -> dict[str, Any]:
    """Return the largest relative difference of any figure, and whether the order is the same.

    Parameters
    ----------
    poses
        In place of the task's own.
    """
    problem = md.load(name)
    if poses is not None:
        tasks = {
            own: task if task.kind == "modes" else replace(task, poses=poses)
            for own, task in problem.tasks.items()
        }
        problem = md.Problem(problem.mechanism, tasks, name=problem.name)  # type: ignore[arg-type]
    known = [own for own in md.variants(problem, by) if not own.fault]
    generator = np.random.default_rng(seed)
    drawn = [known[k] for k in sorted(generator.permutation(len(known))[:count])]
    raw = md.rank(problem, variants=drawn)
    names = [own["name"] for own in raw.criteria]
    parts = generator.dirichlet(np.ones(len(names)))
    weights = dict(zip(names, map(float, parts), strict=True))
    ranking = md.rank(problem, variants=drawn, weights=weights)
    by_hand = {own.name: figures(own.text, ranking.task, names) for own in drawn}
    worst = max(
        abs(row.values[own] - by_hand[row.name][own]) / max(abs(by_hand[row.name][own]), 1e-300)
        if row.values[own] != by_hand[row.name][own]
        else 0.0
        for row in ranking.rows
        for own in names
    )
    senses = [1.0 if own["sense"] == "min" else -1.0 for own in ranking.criteria]
    score = dict.fromkeys(by_hand, 0.0)
    for own, sense in zip(names, senses, strict=True):
        column = {row: sense * by_hand[row][own] for row in by_hand}
        low, high = min(column.values()), max(column.values())
        for row in by_hand:
            if high - low > 1e-12 * max(abs(high), abs(low)):
                score[row] += weights[own] * (column[row] - low) / (high - low)
    same = all(score[one] <= score[two] + 1e-9 for one, two in pairwise(ranking.order))
    return {
        "problem": name, "by": by, "variants": len(drawn), "figures": len(drawn) * len(names),
        "largest_difference": worst, "same_order": same,
    }  # fmt: skip


def solved(text: str, task: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what the command prints for a problem file, and the file's own tables."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "variant.toml"
        path.write_text(text, encoding="utf-8")
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = command(["solve", str(path), "--task", task, "--json", "--quiet"])
    assert code == 0, text
    return json.loads(out.getvalue())["tasks"][task], tomllib.loads(text)


def figures(text: str, task: str, names: list[str]) -> dict[str, float]:
    """Return the criteria of a variant from its file alone."""
    data, file = solved(text, task)
    values = numbers(text)
    found: dict[str, float] = {}
    summary = data["summary"]
    if "envelope" in summary:
        x0, x1, y0, y1 = summary["envelope"]["all"]
        found |= {"width": x1 - x0, "height": y1 - y0}
    if "layers" in values:
        found |= {"layers": values["layers"], "depth": values["layers"] * values["layer"]}
    found["lengths"] = lengths(file, values)
    if summary.get("transmission"):
        found["transmission_angle"] = min(own["min"] for own in summary["transmission"].values())
    path = output(file, task)
    if path in data["bodies"]:
        found["peak_acceleration"] = most(data["bodies"][path]["angular_acceleration"])
    else:
        found["peak_acceleration"] = most(data["joints"][path]["slide_acceleration"])
    found |= shaking(data, file, values)
    if "efforts" in data:
        (effort,) = data["efforts"].values()
        found["peak_effort"] = most(effort)
        pairs = pairwise(effort)
        found["rms_effort"] = math.sqrt(
            sum((a * a + b * b) / 2 for a, b in pairs) / (len(effort) - 1)
        )
        loads = {
            joint: max(math.hypot(*own[:2]) for own in series["reaction"])
            for joint, series in data["joints"].items()
        }
        found["peak_reaction"] = max(loads.values())
        pins = [joint for joint in loads if f"{joint}_bearing" in values]
        shares = {joint: values[f"{joint}_bearing"] for joint in pins}
        if shares:
            found["bearing_load"] = max(shares[joint] * loads[joint] for joint in shares)
        for word in ("loss", "efficiency"):
            if summary.get(word) is not None:
                found[word] = summary[word]
        if summary.get("critical_factor"):
            found["friction_margin"] = summary["critical_factor"]["factor"]
    return {name: found[name] for name in names}


def numbers(text: str) -> dict[str, float]:
    """Return parameters and automatic names with their values."""
    return from_dict(tomllib.loads(text)).mechanism.values()


def most(series: list[float]) -> float:
    """Return the largest amount."""
    return max(abs(own) for own in series)


def output(file: dict[str, Any], task: str) -> str:
    """Return body or joint that a load resists, or the last on the ground that is not driven."""
    for load in file.get("loads", {}).values():
        if load["kind"] == "resistance":
            part, word = load["coordinate"].rsplit(".", 1)
            if word == "angle" and part in file["joints"]:
                ends = [own.split(".")[0] for own in file["joints"][part]["between"]]
                return str(ends[1])
            return str(part)
    driven = file["tasks"][task]["driver"]["coordinate"].rsplit(".", 1)[0]
    for name, joint in reversed(file["joints"].items()):
        ends = [own.split(".")[0] for own in joint["between"]]
        if "ground" in ends and driven not in (*ends, name):
            slides = joint["kind"] == "prismatic"
            return str(name) if slides else str(next(own for own in ends if own != "ground"))
    raise AssertionError("no output")


def lengths(file: dict[str, Any], values: dict[str, float]) -> float:
    """Return the sum of the distances of the two joints of each link (no link here has three)."""
    ends: dict[str, set[str]] = {}
    for joint in file["joints"].values():
        for end in joint["between"]:
            ends.setdefault(end.split(".")[0], set()).add(end)
    total = 0.0
    for own in ends.values():
        places = {(values[f"{end}.x"], values[f"{end}.y"]) for end in own}
        if len(places) == 2:
            total += math.dist(*places)
    return total


def shaking(
    data: dict[str, Any], file: dict[str, Any], values: dict[str, float]
) -> dict[str, float]:
    """Return the largest sum of m a and of its moments about the origin, by complex numbers."""
    heavy = [name for name, body in file["bodies"].items() if "mass" in body]
    if not heavy:
        return {}
    force: Any = 0.0
    moment: Any = 0.0
    for name in heavy:
        point = next(iter(file["bodies"][name]["points"]))
        series = data["points"][f"{name}.{point}"]
        place, own = (
            np.array(series[word]) @ np.array([1, 1j]) for word in ("position", "acceleration")
        )
        angle, speed, turn = (
            np.array(data["bodies"][name][word])
            for word in ("angle", "angular_velocity", "angular_acceleration")
        )
        centre = complex(values.get(f"{name}.center.x", 0.0), values.get(f"{name}.center.y", 0.0))
        arm = (centre - complex(values[f"{name}.{point}.x"], values[f"{name}.{point}.y"])) * np.exp(
            1j * angle
        )
        mass = values[f"{name}.mass"]
        pull = mass * (own + (1j * turn - speed**2) * arm)
        force = force + pull
        moment = moment + (np.conj(place + arm) * pull).imag
        moment = moment + values.get(f"{name}.inertia", 0.0) * turn
    return {
        "shaking_force": float(np.abs(force).max()),
        "shaking_moment": float(np.abs(moment).max()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args().out
    rows = []
    for seed, (name, by, count) in enumerate(CASES):
        rows.append(compared(name, by, count, seed))
        print(rows[-1], flush=True)
    out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
