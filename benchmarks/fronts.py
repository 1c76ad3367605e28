"""Fronts of error against friction loss beside NSGA-II, at equal processor time.

``python -m benchmarks.fronts --out docs/data/fronts.json`` (extra ``bench``: pymoo). Three
slider-cranks and three four-bars; our front may have 100 points, NSGA-II has 100 designs in a
population and evaluates whole populations at once by closed forms of its own, which also judge our
designs: the objectives of both fronts come from the same formulas, and both problems have the same
bounds and the same limit of the transmission angle. The reference of the hypervolume is the worst
value of each objective on the two fronts together. A front of more points dominates more:
NSGA-II's is measured whole and with as many points as ours has, chosen one after the other for the
greatest hypervolume.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.numerics.dominance import hypervolume, undominated

TURN = np.linspace(0.0, 2 * np.pi, 721)[:-1]
FRICTION, RADIUS, GUIDE = 0.1, 0.1, 0.12
LEAST = np.radians(20.0)
"""Least transmission angle."""
BOX = (0.5, 20.0)
ARC = [[3, 3], [2.759, 3.363], [2.372, 3.663], [1.89, 3.862], [1.355, 3.943]]
LINE = [[1.0, 2.5], [1.5, 2.6], [2.0, 2.65], [2.5, 2.65], [3.0, 2.6]]
BOW = [[0.0, 2.0], [0.5, 2.4], [1.0, 2.6], [1.5, 2.6], [2.0, 2.4], [2.5, 2.0]]
FOUR_BARS = {
    "four-bar along an arc": (ARC, [30, 45, 60, 75, 90]),
    "four-bar along a line": (LINE, [120, 105, 90, 75, 60]),
    "four-bar along a bow": (BOW, [150, 130, 110, 90, 70, 50]),
}
SLIDERS = {
    "slider-crank, even motion": lambda t: 3.0 - 0.8 * t,
    "slider-crank, square": lambda t: 3.0 - 0.5 * t**2,
    "slider-crank, sine": lambda t: 3.0 - 0.6 * np.sin(t),
}
ORDER = [*SLIDERS, *FOUR_BARS]
AT = np.radians([30.0, 50.0, 70.0, 90.0, 110.0])
SLIDER_BOX = {"r": (0.2, 3.0), "l": (0.5, 10.0), "e": (-1.5, 1.5)}


# -- the problems ----------------------------------------------------------------------------------


def four_bar(name: str, keep: int, starts: int) -> Any:
    targets, at = FOUR_BARS[name]
    pin = {"friction": FRICTION, "pin_radius": RADIUS}
    low, high = BOX
    return from_dict(
        {
            "schema": 1, "title": name,
            "parameters": {"r1": 3.7, "r2": 2.0, "r3": 4.0, "r4": 2.7, "cx": 1.67, "cy": 1.68},
            "ground": {"points": {"A0": [0, 0], "B0": ["r1", 0]}},
            "bodies": {
                "crank": {"points": {"A0": [0, 0], "A": ["r2", 0]}},
                "coupler": {"points": {"A": [0, 0], "B": ["r3", 0], "P": ["cx", "cy"]}},
                "rocker": {"points": {"B0": [0, 0], "B": ["r4", 0]}},
            },
            "joints": {
                "A0": {"kind": "revolute", "between": ["ground.A0", "crank.A0"], **pin},
                "A": {"kind": "revolute", "between": ["crank.A", "coupler.A"], **pin},
                "B": {"kind": "revolute", "between": ["coupler.B", "rocker.B"], **pin},
                "B0": {"kind": "revolute", "between": ["ground.B0", "rocker.B0"], **pin},
            },
            "sketch": {"crank_deg": 60, "coupler_deg": 10, "rocker_deg": 100},
            "loads": {"work": {"kind": "resistance", "coordinate": "rocker.angle",
                               "negative": 10, "positive": 10}},
            "tasks": {
                "cycle": CYCLE,
                "front": {
                    "kind": "synthesis", "driver": {"coordinate": "crank.angle"},
                    "objectives": [
                        {"kind": "path", "point": "coupler.P", "targets": targets, "at_deg": at},
                        {"kind": "minimise", "of": "cycle/summary/loss"},
                    ],
                    "free": {**{r: [low, high] for r in ("r1", "r2", "r3", "r4")},
                             "cx": [-high, high], "cy": [-high, high]},
                    "constraints": [
                        {"kind": "full-turn", "coordinate": "crank.angle"},
                        {"kind": "transmission-angle", "between": ["coupler", "rocker"],
                         "min": float(LEAST)},
                    ],
                    "keep": keep, "starts": starts,
                },
            },
        }
    )  # fmt: skip


CYCLE = {
    "kind": "reactions", "poses": 73, "cycle": True, "friction": "article",
    "friction_radius": "article",
    "driver": {"coordinate": "crank.angle", "from_deg": 0, "to_deg": 360, "speed": 1},
}  # fmt: skip


def slider_crank(name: str, keep: int, starts: int) -> Any:
    wanted = SLIDERS[name](AT)
    pin = {"friction": FRICTION, "pin_radius": RADIUS}
    return from_dict(
        {
            "schema": 1, "title": name, "parameters": {"r": 1.0, "l": 3.0, "e": 0.0},
            "ground": {"points": {"O": [0, 0], "G": [0, "e"]}},
            "bodies": {
                "crank": {"points": {"O": [0, 0], "B": ["r", 0]}},
                "rod": {"points": {"B": [0, 0], "C": ["l", 0]}},
                "slider": {"points": {"C": [0, 0]}},
            },
            "joints": {
                "O": {"kind": "revolute", "between": ["ground.O", "crank.O"], **pin},
                "B": {"kind": "revolute", "between": ["crank.B", "rod.B"], **pin},
                "C": {"kind": "revolute", "between": ["rod.C", "slider.C"], **pin},
                "slide": {"kind": "prismatic", "between": ["ground.G", "slider.C"],
                          "friction": GUIDE},
            },
            "sketch": {"crank_deg": 60, "rod_deg": -17},
            "loads": {"work": {"kind": "resistance", "coordinate": "slide.slide",
                               "negative": 10, "positive": 10}},
            "tasks": {
                "cycle": CYCLE,
                "front": {
                    "kind": "synthesis", "driver": {"coordinate": "crank.angle"},
                    "objectives": [
                        {"kind": "function", "output": "slide.slide",
                         "targets": np.stack([AT, wanted], axis=1).tolist(),
                         "input_start": float(AT[0]), "output_start": float(wanted[0])},
                        {"kind": "minimise", "of": "cycle/summary/loss"},
                    ],
                    "free": {n: list(box) for n, box in SLIDER_BOX.items()},
                    "constraints": [
                        {"kind": "full-turn", "coordinate": "crank.angle"},
                        {"kind": "transmission-angle", "between": ["rod", "slider"],
                         "min": float(LEAST)},
                    ],
                    "keep": keep, "starts": starts,
                },
            },
        }
    )  # fmt: skip


# -- the same by closed forms ----------------------------------------------------------------------


def four_bars(d: Any, targets: Any, at: Any) -> tuple[Any, Any, Any]:
    """Return error, loss (n,) and constraints (n, k), not above zero, of the better branch."""
    one, other = (_branch(d, targets, at, sign) for sign in (1.0, -1.0))
    better = one[0] <= other[0]
    error, loss = (np.where(better, a, b) for a, b in zip(one[:2], other[:2], strict=True))
    return error, loss, one[2]


def _branch(d: Any, targets: Any, at: Any, sign: float) -> tuple[Any, Any, Any]:
    """Return the same of one branch."""
    r1, r2, r3, r4, cx, cy = (own[:, None] for own in np.asarray(d, float).T)
    turn = np.concatenate([np.radians(at), TURN])[None, :]
    x, y = r2 * np.cos(turn), r2 * np.sin(turn)
    gap = np.hypot(r1 - x, y)
    with np.errstate(all="ignore"):
        inner = (r3**2 + gap**2 - r4**2) / (2 * r3 * gap)
        th3 = np.arctan2(-y, r1 - x) + sign * np.arccos(inner)
        th4 = np.arctan2(y + r3 * np.sin(th3), x + r3 * np.cos(th3) - r1)
        sine = np.sin(th4 - th3)
        w3 = r2 * np.sin(turn - th4) / (-r3 * np.sin(th3 - th4))
        w4 = r2 * np.sin(turn - th3) / (r4 * sine)
        force = 10.0 / (r4 * np.abs(sine))
        power = FRICTION * RADIUS * force * (1 + np.abs(w3 - 1) + np.abs(w4 - w3) + np.abs(w4))
        px = x + cx * np.cos(th3) - cy * np.sin(th3)
        py = y + cx * np.sin(th3) + cy * np.cos(th3)
    k = len(at)
    goal = np.asarray(targets, float)
    error = ((px[:, :k] - goal[:, 0]) ** 2 + (py[:, :k] - goal[:, 1]) ** 2).sum(axis=1)
    r1, r2, r3, r4 = (own[:, 0] for own in (r1, r2, r3, r4))
    grashof = np.minimum(
        np.max([r2 + r1 - r3 - r4, r2 + r3 - r1 - r4, r2 + r4 - r1 - r3], axis=0),
        np.max([r1 + r2 - r3 - r4, r1 + r3 - r2 - r4, r1 + r4 - r2 - r3], axis=0),
    )
    cosines = [(r3**2 + r4**2 - own**2) / (2 * r3 * r4) for own in (r1 - r2, r1 + r2)]
    limits = np.stack([grashof, np.abs(cosines).max(axis=0) - np.cos(LEAST)], axis=1)
    return np.nan_to_num(error, nan=1e9), np.nan_to_num(power[:, k:].mean(axis=1), nan=1e9), limits


def sliders(d: Any, wanted: Any) -> tuple[Any, Any, Any]:
    """Return error, loss (n,) and constraints (n, 1) of the slider to the right."""
    r, length, e = (own[:, None] for own in np.asarray(d, float).T)
    turn = np.concatenate([AT, TURN])[None, :]
    with np.errstate(all="ignore"):
        rod = np.arcsin((e - r * np.sin(turn)) / length)
        slide = r * np.cos(turn) + length * np.cos(rod)
        w3 = -r * np.cos(turn) / (length * np.cos(rod))
        speed = -r * np.sin(turn) - length * np.sin(rod) * w3
        pins = 10.0 / np.cos(rod) * FRICTION * RADIUS * (1 + np.abs(w3 - 1) + np.abs(w3))
        guide = GUIDE * 10.0 * np.abs(np.tan(rod)) * np.abs(speed)
    k = len(AT)
    error = ((slide[:, :k] - wanted) ** 2).mean(axis=1)
    loss = (pins + guide)[:, k:].mean(axis=1)
    return (np.nan_to_num(error, nan=1e9), np.nan_to_num(loss, nan=1e9),
            (r + np.abs(e) - length * np.cos(LEAST)))  # fmt: skip


# -- both ------------------------------------------------------------------------------------------


def evolved(evaluate: Any, box: Any, seconds: float, seed: int, size: int) -> tuple[Any, int]:
    """Return the front (n, 2) that NSGA-II has after so much processor time, and evaluations."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem

    low, high = np.array(box, float).T

    class Asked(Problem):
        def __init__(self) -> None:
            limits = evaluate(np.stack([low, high]))[2].shape[1]
            super().__init__(n_var=len(low), n_obj=2, n_ieq_constr=limits, xl=low, xu=high)

        def _evaluate(self, x: Any, out: Any, *_: Any, **__: Any) -> None:
            error, loss, limits = evaluate(x)
            out["F"], out["G"] = np.stack([error, loss], axis=1), limits

    algorithm = NSGA2(pop_size=size)
    algorithm.setup(Asked(), termination=("n_gen", 10**9), seed=seed, verbose=False)
    began = time.process_time()
    while time.process_time() - began < seconds:
        algorithm.next()
    found = algorithm.opt.get("F")
    return np.atleast_2d(found), int(algorithm.evaluator.n_eval)


def chosen(front: Any, count: int, reference: Any) -> Any:
    """Return so many points of a front, one after the other that which adds most."""
    kept: list[int] = []
    while len(kept) < min(count, len(front)):
        gains = [
            -1.0 if k in kept else hypervolume(front[[*kept, k]], reference)
            for k in range(len(front))
        ]
        kept.append(int(np.argmax(gains)))
    return front[kept]


def compared(name: str, keep: int, starts: int, seeds: int) -> dict[str, Any]:
    """Return the fronts of one problem with their hypervolumes."""
    slides = name in SLIDERS
    problem = (slider_crank if slides else four_bar)(name, keep, starts)
    names = list(problem.tasks["front"].free)
    box = SLIDER_BOX.values() if slides else [BOX] * 4 + [(-BOX[1], BOX[1])] * 2
    targets = SLIDERS[name](AT) if slides else FOUR_BARS[name]

    def evaluate(d: Any) -> Any:
        return sliders(d, targets) if slides else four_bars(d, *targets)

    began = time.process_time()
    result = md.synthesize(problem, "front")
    seconds = time.process_time() - began
    designs = result.data["designs"]
    d = np.array([[own["parameters"][n] for n in names] for own in designs])
    error, loss, limits = evaluate(d)
    ours = np.stack([error, loss], axis=1)
    told = np.array([own["objectives"] for own in designs])
    runs = [evolved(evaluate, list(box), seconds, seed, keep) for seed in range(seeds)]
    every = np.vstack([ours, *(front for front, _ in runs)])
    reference = every[undominated(every)].max(axis=0)
    volumes = [hypervolume(front, reference) for front, _ in runs]
    fewer = [hypervolume(chosen(front, len(ours), reference), reference) for front, _ in runs]
    own = hypervolume(ours, reference)
    return {
        "problem": name, "seconds": seconds, "points": len(ours), "reference": reference.tolist(),
        "hypervolume": own, "nsga2": volumes, "nsga2_as_many_points": fewer,
        "ratio": own / max(volumes) if max(volumes) else None,
        "ratio_as_many_points": own / max(fewer) if max(fewer) else None,
        "evaluations": [count for _, count in runs],
        "least": {"ours": ours.min(axis=0).tolist(),
                  "nsga2": np.min([front.min(axis=0) for front, _ in runs], axis=0).tolist()},
        "deviation": float(np.abs(ours / told - 1).max()), "limits": float(limits.max()),
        "front": _short(ours), "nsga2_front": _short(runs[int(np.argmax(volumes))][0]),
        "starts": result.summary["starts"], "population": keep,
    }  # fmt: skip


def _short(front: Any) -> list[list[float]]:
    """Return points by their first objective, to nine digits."""
    order = np.argsort(front[:, 0], kind="stable")
    return [[float(f"{value:.9g}") for value in row] for row in front[order].tolist()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--keep", type=int, default=100)
    parser.add_argument("--starts", type=int, default=16)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--only", nargs="+", default=ORDER)
    parser.add_argument("--picture", type=Path, help="draw what --out holds, and measure nothing")
    options = parser.parse_args()
    if options.picture:
        picture(json.loads(options.out.read_text())["records"], options.picture)
        return
    records = []
    if options.out and options.out.exists():  # problems that were not asked for stay
        known = json.loads(options.out.read_text())["records"]
        records = [own for own in known if own["problem"] not in options.only]
    for name in options.only:
        own = compared(name, options.keep, options.starts, options.seeds)
        records = sorted([*records, own], key=lambda r: ORDER.index(r["problem"]))
        print(json.dumps({k: v for k, v in own.items() if "front" not in k}), flush=True)
        if options.out:
            options.out.write_text(
                json.dumps({"versions": _versions(), "records": records}, indent=1)
            )


# -- table and picture -----------------------------------------------------------------------------

HEAD = (
    "| problem | points | hypervolume, by that of NSGA-II | with as many points "
    "| largest difference of an objective | processor s | evaluations of NSGA-II |"
)


def table(records: list[dict[str, Any]]) -> list[str]:
    """Return the rows of the table of the docs."""
    rows = [HEAD, "|---" * HEAD.count(" | ") + "|---|"]
    for own in records:
        cells = [
            own["problem"], f"{own['points']}", f"{own['ratio']:.5f}",
            f"{own['ratio_as_many_points']:.5f}", f"{own['deviation']:.1e}",
            f"{own['seconds']:.0f}", f"{min(own['evaluations'])}",
        ]  # fmt: skip
        rows.append("| " + " | ".join(cells) + " |")
    return rows


def picture(records: list[dict[str, Any]], path: Path) -> None:
    """Draw the fronts of all problems, errors by their logarithms."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 6), layout="constrained")
    for own, ax in zip(records, figure.subplots(2, 3).ravel(), strict=False):
        for name, marker, color in (("nsga2_front", ".", "0.55"), ("front", "o", "tab:blue")):
            points = np.array(own[name])
            label = "mechdae" if name == "front" else "NSGA-II"
            size = 3.5 if name == "front" else 6
            ax.plot(*points.T, marker, ms=size, color=color, mfc="none" if marker == "o" else color,
                    label=label, zorder=3 if marker == "." else 2)  # fmt: skip
        ax.set_xscale("log")
        unit = "m²"
        ax.set(title=own["problem"], xlabel=f"error [{unit}]", ylabel="friction loss [W]")
        ax.title.set_fontsize(10)
        ax.grid(alpha=0.3)
    figure.axes[0].legend()
    figure.savefig(path, dpi=110)


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("mechdae", "casadi", "pymoo", "numpy")}


if __name__ == "__main__":
    main()
