"""Schemes with their dimensions for six closed curves, beside NSGA-II on the same screening.

``python -m benchmarks.compositions --out docs/data/compositions.json`` (extra ``bench``: pymoo).
Six curves from formulas; fronts of distance against material (reference 0.75, 10) and of distance
against points (1.5, 16), pins with the tracing point, as the teaching challenges count joints.

Both methods have the same processor time (`--seconds` for each front), the same measure, closed
forms, limits (sines of dyads, shortest bars) and schemes, and the reference bounds what they look
for. NSGA-II chooses the scheme and its dimensions together (a number of the scheme and the places
of its points), a hundred in a population, evaluated in batches; it starts from the sets that our
own screening found best, whose time is counted for it too. Both fronts are certified: what fails a
sweep of `md.solve` is dropped from either, and counted.

Our designs are judged once more by circles at 20 001 angles (`tests/reference/circles.py`), which
share no code with the package.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae import __version__
from mechdae.numerics.dominance import hypervolume, undominated
from mechdae.parts.types.described.composition import asked_of
from mechdae.parts.types.schemes.aims import Aim
from mechdae.parts.types.schemes.closure import material, shortest, turned
from mechdae.parts.types.schemes.descent import SHORT
from mechdae.parts.types.schemes.designs import certified, problem_of_scheme, tracer
from mechdae.parts.types.schemes.placed_design import PlacedDesign
from mechdae.parts.types.schemes.scheme import read
from mechdae.parts.types.schemes.search import SchemeSearch
from mechdae.parts.types.schemes.shape import Wanted, distances
from mechdae.parts.types.schemes.work_items import FoundSets, SizedScheme, computed
from tests.reference.circles import followed, of_file

TURN = 2 * np.pi
CURVES = {
    "egg": ("(1 + 0.22*cos(s) + 0.07*cos(2*s))*cos(s)", "(1 + 0.22*cos(s) + 0.07*cos(2*s))*sin(s)"),
    "hourglass": ("1.3*sin(s)*(0.4 + 0.6*cos(s)**2) + 0.1*cos(s)", "1.5*cos(s)"),
    "bean": ("1.4*cos(s)", "0.7*sin(s) + 0.45*cos(s)**2"),
    "kidney": ("cos(s) - 0.45*cos(2*s)", "1.1*sin(s) - 0.3*sin(2*s)"),
    "letter": ("0.6*sin(2*s) + 0.2*sin(s)", "1.3*cos(s) + 0.1*cos(2*s)"),
    "foot": ("1.5*cos(s)", "0.42*sin(s) + 0.2*sin(s)**2 + 0.12*cos(2*s)*sin(s)"),
}
"""Egg r = 1 + k cos phi + m cos 2 phi, hourglass, bean, kidney, letter (an 8), path of a foot."""
UNIT = Aim("curve")
"""Curves of radius 1: errors and lengths are in its units."""
REFERENCES = {"material": (0.75, 10.0), "points": (1.5, 16.0)}
LEAST = 0.06
ANGLES = 120
POPULATION = 100


def unit_curve(name: str) -> Any:
    """Return the corners (400,) of a curve of radius 1 about zero."""
    goal = md.CurveGoal(x=CURVES[name][0], y=CURVES[name][1])
    corners = asked_of(md.Composition(goal=goal), {}).corners
    wanted = Wanted(np.array([complex(*corner) for corner in corners]))
    return (wanted.corners - wanted.center) / wanted.radius


# -- ours ------------------------------------------------------------------------------------------


class Timed:
    """Computes pieces until the time is used up; then nothing more is found."""

    def __init__(self, seconds: float) -> None:
        self.end = time.process_time() + seconds
        self.screened: dict[str, list[FoundSets]] = {}
        self.sets = 0
        self.over = False
        self.screening = 0.0

    def __call__(self, pieces: Any) -> list[FoundSets]:
        found = []
        for piece in pieces:
            if time.process_time() > self.end:
                self.over = True
                size = read(piece.scheme).size
                none = np.zeros(0)
                found.append(FoundSets(np.zeros((0, size), complex), none, none, none, none))
                continue
            began = time.process_time()
            own = computed(piece)
            assert isinstance(own, FoundSets), own
            found.append(own)
            self.sets += piece.count if piece.do == "screen" else len(piece.places)
            if piece.do == "screen":
                self.screened.setdefault(piece.scheme, []).append(own)
                self.screening += time.process_time() - began
        return found


def ours(
    corners: Any, seconds: float, seed: int, other: str
) -> tuple[list[SizedScheme], Timed, list[Any]]:
    """Return what the search found in so much time; where growth ends, it begins anew."""
    run, found, rounds = Timed(seconds), [], []
    while not run.over:
        task = md.Composition(
            goal=md.CurveGoal(targets=[[z.real, z.imag] for z in corners]),
            links=[4, 6], objectives=["error", other], reference=list(REFERENCES[other]),
            samples=1000, starts=24, grow=60, points=12, seed=seed,
        )  # fmt: skip
        search = SchemeSearch(replace(asked_of(task, {}), points=12), run)
        archive = search.search(lambda own=search.rounds: run.over or _exhausted(own))
        found += archive.every
        rounds += search.rounds
        seed += 1
    return found, run, rounds


def _exhausted(rounds: list[Any]) -> bool:
    """Return whether the last round of growth found no scheme that was not tried before."""
    grown = [own for own in rounds if own["round"].startswith("growth") and "," not in own["round"]]
    return bool(grown) and not grown[-1]["pieces"]


# -- NSGA-II ---------------------------------------------------------------------------------------


def evolved(
    corners: Any, screened: dict[str, list[FoundSets]], other: str, seconds: float, seed: int
) -> tuple[list[SizedScheme], int]:
    """Return the front of NSGA-II after so much processor time, and its evaluations."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem

    texts = list(screened)
    schemes = [read(text) for text in texts]
    wanted, most = Wanted(corners), max(own.size for own in schemes)
    reference = np.array(REFERENCES[other])
    angles = TURN * np.arange(ANGLES) / ANGLES

    def measured(rows: Any) -> Any:
        number = np.clip(rows[:, 0].astype(int), 0, len(schemes) - 1)
        values, limits = np.full((len(rows), 2), 50.0), np.full((len(rows), 4), 10.0)
        for k in np.unique(number):
            at, scheme = np.flatnonzero(number == k), schemes[k]
            places = placed(rows[at], scheme)
            turn = turned(scheme, places, angles)
            least, short = turn.least, shortest(scheme, places)
            limits[at, :2] = np.stack([LEAST - least, SHORT - short], axis=1)
            good = (least >= LEAST) & (short >= SHORT)
            if good.any():
                curve = turn.x[scheme.trace][good]
                amount = material(scheme, places[good])
                values[at[good], 0] = distances(curve, wanted)
                values[at[good], 1] = amount if other == "material" else scheme.size
                limits[at[good], 2:] = values[at[good]] / reference - 1
        return values, limits

    def placed(rows: Any, scheme: Any) -> Any:
        flat = rows[:, 1 : 1 + 2 * (scheme.size - 1)]
        return np.concatenate(
            [np.zeros((len(rows), 1), complex), flat[:, 0::2] + 1j * flat[:, 1::2]], axis=1
        )

    class Schemes(Problem):
        def __init__(self) -> None:
            low = np.array([0.0] + [-6.0] * (2 * (most - 1)))
            high = np.array([len(schemes) - 1e-9] + [6.0] * (2 * (most - 1)))
            super().__init__(n_var=len(low), n_obj=2, n_ieq_constr=4, xl=low, xu=high)

        def _evaluate(self, x: Any, out: Any, *_: Any, **__: Any) -> None:
            out["F"], out["G"] = measured(x)

    first = _first(texts, screened, most, seed)
    algorithm = NSGA2(pop_size=POPULATION, sampling=first)
    algorithm.setup(Schemes(), termination=("n_gen", 10**9), seed=seed, verbose=False)
    began = time.process_time()
    while time.process_time() - began < seconds:
        algorithm.next()
    found = []
    for row, value, broken in zip(
        np.atleast_2d(algorithm.opt.get("X")), np.atleast_2d(algorithm.opt.get("F")),
        np.atleast_2d(algorithm.opt.get("G")), strict=True,
    ):  # fmt: skip
        if (broken <= 0).all():
            scheme = schemes[int(row[0])]
            places = placed(row[None], scheme)
            amount = float(material(scheme, places)[0])
            found.append(SizedScheme(scheme, places[0], float(value[0]), amount, 1.0))
    return found, int(algorithm.evaluator.n_eval)


def _first(texts: list[str], screened: Any, most: int, seed: int) -> Any:
    """Return the best screened sets, as many of each scheme, as rows of variables."""
    each = max(1, POPULATION // len(texts) + 1)
    rows = []
    for k, text in enumerate(texts):
        places = np.concatenate([own.places for own in screened[text]])
        error = np.concatenate([own.error for own in screened[text]])
        for own in places[np.argsort(error, kind="stable")[:each]]:
            row = np.random.default_rng([seed, k]).normal(0, 1, 1 + 2 * (most - 1))
            row[0] = k + 0.5
            flat = np.stack([own[1:].real, own[1:].imag], axis=1).ravel()
            row[1 : 1 + len(flat)] = flat
            rows.append(row)
    order = np.random.default_rng(seed).permutation(len(rows))
    return np.array(rows)[order[:POPULATION]]


# -- both ------------------------------------------------------------------------------------------


def certified_front(entries: list[SizedScheme], corners: Any, other: str) -> dict[str, Any]:
    """Return the front of entries that hold over the whole turn, and how many do not."""
    wanted = Wanted(corners)
    reference = np.array(REFERENCES[other])
    values = np.array([[e.error, e.value(other, UNIT)] for e in entries]).reshape(-1, 2)
    left = (values < reference).all(axis=1)
    points, failed, files, known = [], 0, [], {}
    while True:
        at = np.flatnonzero(left)
        if not len(at):
            break
        at = at[undominated(values[at])]
        missing = [k for k in at.tolist() if k not in known]
        if not missing:
            break
        for k in missing:
            entry = entries[k]
            placed = PlacedDesign(entry.places, {}, {})
            problem = problem_of_scheme(entry.scheme, placed, "scheme", "")
            own = certified(problem, tracer(entry.scheme))
            if own.reasons:
                failed, left[k] = failed + 1, False
                continue
            known[k] = md.dumps(problem)
            values[k, 0] = float(distances(own.curve[None], wanted)[0])
    for k in sorted(known, key=lambda k: tuple(values[k])):
        if k in at:
            points.append(values[k].tolist())
            files.append((entries[k].scheme.text, known[k]))
    volume = hypervolume(np.array(points).reshape(-1, 2), reference) if points else 0.0
    return {"points": points, "hypervolume": volume, "failed": failed, "files": files}


def followed_by_circles(files: Any, corners: Any, points: Any) -> dict[str, Any]:
    """Return how many designs fail to assemble at 20 001 angles, and how far errors differ."""
    wanted, open_, gap = Wanted(corners), 0, 0.0
    for (_, text), (error, _) in zip(files, points, strict=True):
        places, links = of_file(text)
        _, least = followed(places, links, TURN * np.arange(20001) / 20000)
        open_ += not least > 0
        curve, _ = followed(places, links, TURN * np.arange(720) / 720)
        own = float(distances(curve["P"][None], wanted)[0])
        gap = max(gap, abs(own - error))
    return {"designs": len(files), "do_not_assemble": open_, "largest_difference": gap}


def compared(name: str, seconds: float, seeds: int, fronts: list[str]) -> dict[str, Any]:
    """Return fronts and hypervolumes of one curve."""
    corners = unit_curve(name)
    record: dict[str, Any] = {"curve": name, "formulas": CURVES[name], "seconds": seconds}
    for other in fronts:
        entries, run, rounds = ours(corners, seconds, 0, other)
        own = certified_front(entries, corners, other)
        checked = followed_by_circles(own["files"], corners, own["points"])
        runs = []
        for seed in range(seeds):
            entries, count = evolved(corners, run.screened, other, seconds - run.screening, seed)
            front = certified_front(entries, corners, other)
            runs.append(
                {
                    "seed": seed, "evaluations": count, "hypervolume": front["hypervolume"],
                    "failed": front["failed"], "points": front["points"],
                }
            )  # fmt: skip
        best = max(entry["hypervolume"] for entry in runs)
        record[other] = {
            "ours": own["hypervolume"], "nsga2": best, "larger": own["hypervolume"] > best,
            "least_distance": [
                min((p[0] for p in own["points"]), default=None),
                min((p[0] for r in runs for p in r["points"]), default=None),
            ],
            "points": own["points"], "schemes": [text for text, _ in own["files"]],
            "failed": own["failed"], "circles": checked, "runs": runs, "sets": run.sets,
            "screening_seconds": run.screening, "rounds": rounds,
        }  # fmt: skip
    return record


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--seconds", type=float, default=180.0, help="of each curve and method")
    parser.add_argument("--seeds", type=int, default=1, help="runs of NSGA-II for each front")
    parser.add_argument("--only", nargs="+", default=list(CURVES))
    parser.add_argument("--fronts", nargs="+", choices=list(REFERENCES), default=list(REFERENCES))
    options = parser.parse_args()
    records = []
    for name in options.only:
        own = compared(name, options.seconds, options.seeds, options.fronts)
        records.append(own)
        for other in options.fronts:
            print(name, other, {k: own[other][k] for k in ("ours", "nsga2", "failed", "circles")},
                  flush=True)  # fmt: skip
        if options.out:
            options.out.write_text(
                json.dumps({"versions": _versions(), "records": records}, indent=1)
            )


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {"mechdae": __version__, **{name: version(name) for name in ("numpy", "pymoo")}}


if __name__ == "__main__":
    main()
