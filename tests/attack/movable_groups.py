"""Groups that move by themselves, drawn at random: each has to be said to, and in seconds.

    python -m tests.attack.movable_groups --count 100 --out docs/data/movable-groups.json

Dimensions of four families are drawn that make a group move which at other dimensions is rigid:

- prism: a plate on three equal legs, its pins those of the ground;
- parallelograms: two plates on a common pin, each on two legs, all four equal and parallel;
- dixon-1: nine bars between three pins on a line and three on a line across (Dixon 1899);
- dixon-2: nine bars between three corners each of two rectangles with common axes (Dixon 1899).

A known pin is carried by a crank. Of each the same with one bar longer by 3 % is solved too: it
must not be said to move. The exit code is 1 where either is wrong.
"""

from __future__ import annotations

import math
import sys
import time
from statistics import median
from typing import Any

import numpy as np

import mechdae as md
from tests.shared import attack

LONGER = 1.03
FAMILIES = ("prism", "parallelograms", "dixon-1", "dixon-2")


def drawn(family: str, rng: np.random.Generator) -> tuple[dict[str, Any], Any, list[str]]:
    """Return places of pins, links as names of pins, and which pins the ground holds."""

    def somewhere(count: int, size: float = 1.5) -> Any:
        return rng.uniform(-size, size, (count, 2))

    if family == "prism":
        base, slope = somewhere(3), rng.uniform(0.3, 2.8)
        above = base + 1.4 * np.array([math.cos(slope), math.sin(slope)])
        pins = {f"A{k}": p for k, p in enumerate(base)} | {f"B{k}": p for k, p in enumerate(above)}
        links = [("B0", "B1", "B2"), *((f"A{k}", f"B{k}") for k in range(3))]
        return pins, links, ["A0", "A1", "A2"]
    if family == "parallelograms":
        base, lean = somewhere(4, 2.0), rng.uniform(0.3, 2.8)
        above = base + rng.uniform(1, 2) * np.array([math.cos(lean), math.sin(lean)])
        pins = {f"A{k}": p for k, p in enumerate(base)} | {f"B{k}": p for k, p in enumerate(above)}
        pins["P"] = somewhere(1)[0]
        links = [("B0", "B1", "P"), ("B2", "B3", "P"), *((f"A{k}", f"B{k}") for k in range(4))]
        return pins, links, [f"A{k}" for k in range(4)]
    if family == "dixon-1":
        sizes = rng.uniform(0.4, 2.0, 6) * rng.choice([-1, 1], 6)
        one = [(x, 0.0) for x in sizes[:3]]
        other = [(0.0, y) for y in sizes[3:]]
    else:
        (a, b), (c, d) = rng.uniform(0.4, 2.0, (2, 2))
        corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
        one = list(corners[rng.permutation(4)[:3]] * (a, b))
        other = list(corners[rng.permutation(4)[:3]] * (c, d))
    pins = {f"X{k}": np.array(p) for k, p in enumerate(one)}
    pins |= {f"Y{k}": np.array(p) for k, p in enumerate(other)}
    bars = [(f"X{i}", f"Y{k}") for i in range(3) for k in range(3) if (i, k) != (0, 0)]
    return pins, bars, ["X0", "Y0"]


def mechanism(pins: dict[str, Any], links: Any, held: list[str], longer: float) -> md.Mechanism:
    """Return links on pins; the first one that is held is carried by a crank of length 1."""
    centre = pins[held[0]] - (1.0, 0.0)
    ground = {"C": tuple(centre)} | {pin: tuple(pins[pin]) for pin in held[1:]}
    bodies = [md.Body("crank", {"C": (0, 0), held[0]: (1.0, 0)})]
    joints: list[Any] = [md.Revolute("C", "ground.C", "crank.C")]
    at = {held[0]: f"crank.{held[0]}"} | {pin: f"ground.{pin}" for pin in held[1:]}
    sketch = {"crank": 0.0}
    for k, own in enumerate(links):
        name, first = f"link{k}", pins[own[0]]
        way = pins[own[1]] - first
        turn = math.atan2(way[1], way[0])
        back = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        scale = longer if k == len(links) - 1 else 1.0
        points = {pin: tuple(map(float, scale * back @ (pins[pin] - first))) for pin in own}
        bodies.append(md.Body(name, points))
        sketch[name] = turn
        for pin in own:
            if pin in at:
                joints.append(md.Revolute(f"{pin}_{k}", at[pin], f"{name}.{pin}"))
            else:
                at[pin] = f"{name}.{pin}"
    return md.Mechanism(ground=md.Ground(ground), bodies=bodies, joints=joints, sketch=sketch)


def said(own: md.Mechanism) -> tuple[bool, float, str]:
    """Return whether a group is said to move by itself, seconds of the processor, and the fault."""
    start = time.process_time()
    try:
        result = md.solve(own, md.Modes(md.Driver("crank.angle", at=[0.0])))
        free, fault = bool(result.summary.get("free")), str(result.fault)
    except md.MechdaeError as error:
        fault = str(error)
        free = "moves by itself" in fault or "has a freedom of its own" in fault
    return free, time.process_time() - start, fault


def case(seed: int) -> dict[str, Any]:
    """Return what is said of a group that moves and of the same one with a bar too long."""
    family = FAMILIES[seed % len(FAMILIES)]
    pins, links, held = drawn(family, np.random.default_rng([seed, 61]))
    moves, seconds, fault = said(mechanism(pins, links, held, 1.0))
    rigid, other, _ = said(mechanism(pins, links, held, LONGER))
    return {"family": family, "moves": moves, "seconds": seconds, "fault": fault,
            "wrong": rigid, "seconds_rigid": other}  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    options = attack.parser(__doc__, 100, "groups").parse_args(arguments)
    rows, wrong, figures = list[dict[str, Any]](), list[str](), dict[str, Any]()
    for seed in range(options.seed, options.seed + options.count):
        rows.append(row := case(seed))
        if not row["moves"]:
            wrong.append(f"{seed} {row['family']}: not said to move: {row['fault'][:120]}")
        if row["wrong"]:
            wrong.append(f"{seed} {row['family']}: said to move with a bar too long")
        figures = {"groups": len(rows), "wrong": wrong}
        for family in FAMILIES:
            own = [row for row in rows if row["family"] == family]
            if own:
                spent = [row["seconds"] for row in own]
                figures[family] = {
                    **{"groups": len(own), "said": sum(row["moves"] for row in own)},
                    "seconds_median": round(median(spent), 2),
                    "seconds_most": round(max(spent), 2),
                    "seconds_rigid": round(median(row["seconds_rigid"] for row in own), 2),
                }
        attack.kept(figures, options.out)
    return attack.ended(figures, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())
