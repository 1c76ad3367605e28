"""Writes the table of ``theory/evidence/synthesis.md`` from ``docs/data/synthesis-table.json``.

Usage: ``python docs/make_synthesis.py`` writes the table, with ``--check`` nothing is written and
the exit code tells whether the page is up to date. ``python docs/make_synthesis.py --measure
[NAME ...] [--seeds N] [--again]`` runs what the data lack (or, with ``--again``, runs it anew):
every case of ``tests/data/synthesis.json`` that is a problem of the package, for a number of
seeds, and once differential evolution on the same objective. Each run is saved when it is
done; a measurement that was stopped goes on. Times are processor seconds of one core.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import statistics
import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
PAGE, DATA = FOLDER / "theory/evidence/synthesis.md", FOLDER / "data" / "synthesis-table.json"
CASES = FOLDER.parent / "tests" / "data" / "synthesis.json"
BEGIN, END = "<!-- table: docs/make_synthesis.py -->", "<!-- end of the table -->"
TIE = 1e-5
"""Share within which two objectives are the same."""
TASKS = {"rocker-50-1-15": ("design", "least_loss"), "rocker-40-1-05": ("design", "least_loss")}
MANY = (
    "c1-line6-free", "c2-arc5-timed", "c3-closed18-timed", "c4-semi6-timed",
    "c4-semi6-timed-r5-50", "c5-ellipse10-free", "p-heart20-free", "p-fig8-24-timed",
    "wms3-ninepoint",
)  # fmt: skip
"""Cases that are run for twenty seeds, the others for five."""
SLOW = {"P_heart20_free": 10.0, "P_fig8_24_timed": 10.0, "WMS3_ninepoint": 15.0}
"""Processor seconds allowed where the case itself has no bar for them."""


# -- what the cases say ----------------------------------------------------------------------------


def listed() -> dict[str, dict[str, Any]]:
    """Return the cases by name of their problem."""
    found = json.loads(CASES.read_text(encoding="utf-8"))["cases"]
    return {case["id"].lower().replace("_", "-").replace(".", "-"): case for case in found}


def rows() -> list[tuple[str, str]]:
    """Return the problems and tasks of the table, in the order of the cases."""
    return [
        (name, task)
        for name, case in listed().items()
        if bar(case, "design") is not None
        for task in TASKS.get(name, ("design",))
    ]


def bar(case: dict[str, Any], task: str) -> tuple[str, float, int] | None:
    """Return unit, bar and sense (1 where less is better) of a case."""
    found = case.get("bar", {})
    if task == "least_loss":
        return "loss index", found["loss_index"], 1
    keys = (("f_max", "length²", 1), ("max_err_deg", "deg", 1), ("max_abs_dev", "stroke", 1),
            ("mu_min_deg", "deg", -1))  # fmt: skip
    for key, unit, sense in keys:
        if key in found:
            return unit, found[key], sense
    return None


def allowed(case: dict[str, Any]) -> float:
    """Return the processor seconds that a case allows on the machine of the reference."""
    found = case.get("bar", {})
    return float(found.get("cpu_s_median", found.get("cpu_s", SLOW.get(case["id"], math.inf))))


def planned(name: str) -> int:
    """Return how many seeds a case is run for."""
    return 20 if name in MANY else 5


def known(case: dict[str, Any], task: str) -> float:
    """Return the best value that was known before."""
    if case["kind"].startswith("crank-rocker"):
        if task == "least_loss":
            return float(case["min_friction"]["loss_index"])
        return float(case["max_mu"]["mu_min_deg"])
    if "f_of_plant_with_rounded_targets" in case:
        return float(case["f_of_plant_with_rounded_targets"])
    reference = case["reference"]
    keys = ("f", "max_err_deg", "max_abs_dev", "mu_min_deg")
    return next(float(reference[key]) for key in keys if key in reference)


def published(case: dict[str, Any], task: str) -> tuple[float, str] | None:
    """Return the best sound design that others published, recomputed, and its label."""
    if case["kind"].startswith("straight"):
        return 4.8e-4, "Hoecken's proportions"
    if "five_point_Chebyshev_spacing_best_deg" in case:
        return case["five_point_Chebyshev_spacing_best_deg"], "five exact points"
    if case["id"] == "C1_exact_max_mu":
        return 19.022369, "HCDJ, points to 1e-6"
    keys = ("assembles_at_all_poses", "crank_full_rotation", "order_ok", "no_branch_defect")
    sound = [p for p in case.get("published", []) if all(p[key] for key in keys)]
    if case["id"] == "C4_semi6_timed":
        sound = [p for p in sound if "column 6" not in p["label"]]  # longer than its bounds
    if not sound:
        return None
    best = min(sound, key=lambda p: p["f_recomputed"])
    return best["f_recomputed"], best["label"]


# -- measuring -------------------------------------------------------------------------------------


def measure(names: list[str], seeds: int | None, again: bool) -> None:
    """Run what the data lack."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.path[:0] = [str(FOLDER), str(FOLDER.parent)]
    data = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {"runs": {}}
    data["machine"] = f"Python {platform.python_version()}, {platform.machine()}"
    chosen = [row for row in rows() if not names or row[0] in names]
    if again:
        for name, task in chosen:
            data["runs"].pop(f"{name}/{task}", None)
    for name, task in chosen:
        record = data["runs"].setdefault(f"{name}/{task}", {"seeds": []})
        count = seeds or planned(name)
        for seed in range(len(record["seeds"]), count):
            record["seeds"].append(_run(name, task, seed))
            _save(data)
            _say(f"{name}/{task} seed {seed}", record["seeds"][-1])
        if "evolution" not in record:
            record["evolution"] = _evolved(name) if task == "design" else None
            _save(data)
            _say(f"{name}/{task} evolution", record["evolution"])


def _run(name: str, task: str, seed: int) -> dict[str, Any]:
    import mechdae as md
    from mechdae.describe.tasks.synthesis import Synthesis
    from mechdae.design.synthesis.synthesize import synthesize
    from tests.reference import synthesis_verdicts

    problem = md.load(name)
    asked = problem.tasks[task]
    assert isinstance(asked, Synthesis)
    result = synthesize(problem, task, asked, seed=seed)
    reported = [design for design in result.data["designs"] if not design["defects"]]
    judged = [synthesis_verdicts.verdict(name, task, design) for design in reported]
    unsound = [
        {"rank": k, "defects": list(own.defects), "parameters": design["parameters"]}
        for k, (own, design) in enumerate(zip(judged, reported, strict=True))
        if own.defects
    ]
    return {
        "seed": seed, "value": judged[0].value if judged else None, "designs": len(judged),
        "class": reported[0]["class"] if reported else None, "unsound": unsound,
        "starts": result.summary["starts"], "hits": result.summary["hits_of_best"],
        "seconds": round(result.summary["seconds"]["whole"], 3),
        "rejected": len(result.summary["rejected"]),
    }  # fmt: skip


def _evolved(name: str) -> dict[str, Any] | None:
    from synthesis_evolution import evolution, evolve

    case = evolution(listed()[name]) if "hard points" not in listed()[name]["kind"] else None
    if case is None:
        return None
    found = evolve(case, seed=0)
    value = math.degrees(found.value) if "function" in listed()[name]["kind"] else found.value
    return {
        "value": value, "evaluations": found.evaluations,
        "seconds": round(found.seconds, 2), "x": found.x,
    }  # fmt: skip


def _save(data: dict[str, Any]) -> None:
    DATA.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def _say(what: str, record: dict[str, Any] | None) -> None:
    short = {k: v for k, v in (record or {}).items() if k not in ("x", "seed")}
    print(what, short, flush=True)


# -- the table -------------------------------------------------------------------------------------


COLUMNS = (
    "problem", "unit", "published", "known before", "ours", "against known", "seeds at the bar",
    "s", "DE", "DE s", "DE s by ours",
)  # fmt: skip


def table(data: dict[str, Any]) -> str:
    """Return the table with what it says in words."""
    lines, worse, missed, tied, unsound, equal, few = [], [], [], [], [], [], []
    designs, slow, alike = 0, [], []
    cases = listed()
    for name, task in rows():
        record = data["runs"].get(f"{name}/{task}")
        label = name if task == "design" else f"{name}, {task}"
        found = bar(cases[name], task)
        assert found is not None
        unit, limit, sense = found
        before, others = known(cases[name], task), published(cases[name], task)
        cells = [f"`{name}`" + ("" if task == "design" else f", `{task}`"), unit]
        cells += [f"{number(others[0])} ({others[1]})" if others else "", number(before)]
        runs = record["seeds"] if record else []
        values = [run["value"] for run in runs if sound(run)]
        designs += sum(run["designs"] for run in runs)
        unsound += [f"{label}, seed {run['seed']}" for run in runs if run["unsound"]]
        if not record or not values:
            cells.append("no design is sound" if runs else "not measured")
            lines.append("| " + " | ".join([*cells, *[""] * 6]) + " |")
            continue
        best = min(values) if sense > 0 else max(values)
        hits = sum(sense * value <= sense * limit for value in values)
        word = compared(best, before, sense, limit)
        if others and compared(best, others[0], sense, limit) == "tie":
            alike.append(label)
        if word == "tie":
            tied.append(label)
        if word == "worse":
            worse.append(f"{label} ({number(best)} against {number(before)} {unit})")
        if hits < 0.95 * len(runs):
            missed.append(f"{label} ({hits} of {len(runs)})")
        seconds = statistics.median(run["seconds"] for run in runs)
        if seconds > allowed(cases[name]):
            slow.append(f"{label} ({seconds:.2g} s against {allowed(cases[name]):g} s)")
        if len(runs) < planned(name):
            few.append(f"{label} ({len(runs)} of {planned(name)})")
        cells += [number(best), word, f"{hits} of {len(runs)}", f"{seconds:.2g}"]
        evolved = record.get("evolution")
        if evolved:
            cells += [number(evolved["value"]), f"{evolved['seconds']:.3g}",
                      f"{evolved['seconds'] / seconds:.2g}"]  # fmt: skip
            against = compared(evolved["value"], best, sense, limit)
            if against != "worse":
                equal.append(f"{label} ({against})")
        else:
            cells += ["", "", ""]
        lines.append("| " + " | ".join(cells) + " |")
    words = [
        f"{designs} reported designs of all seeds were judged by closed forms.",
        sentence("Runs that reported a design with a defect", unsound),
        sentence("A tie with the best published design, no more", alike),
        sentence("A tie with the best value known before", tied),
        sentence("Worse than what was known before", worse),
        sentence("The bar is reached by fewer than 19 of 20 seeds", missed),
        sentence("The median takes longer than the bar of the case allows", slow),
        sentence("Measured with fewer seeds than planned", few),
        sentence("Differential evolution is as good or better", equal),
    ]
    head = ["| " + " | ".join(COLUMNS) + " |", "|---" * len(COLUMNS) + "|"]
    return "\n".join([*head, *lines, "", *[f"- {text}" for text in words]]) + "\n"


def sound(run: dict[str, Any]) -> bool:
    """Return whether the best design of a run has no defect."""
    return run["value"] is not None and all(other["rank"] > 0 for other in run["unsound"])


def compared(value: float, other: float, sense: int, limit: float) -> str:
    """Return how a value compares with another: both far below the bar are as good as exact."""
    if sense > 0 and max(value, other) <= 1e-3 * limit:
        return "both exact" if value > other * (1 + TIE) else "better, both exact"
    gain = sense * (other - value) / abs(other)
    if abs(gain) <= TIE:
        return "tie"
    return f"{100 * abs(gain):.2g} % better" if gain > 0 else "worse"


def sentence(words: str, names: list[str]) -> str:
    """Return a sentence with a list, or that there is none."""
    return f"{words}: {', '.join(names) if names else 'nowhere'}."


def number(value: float) -> str:
    """Return a number to six digits."""
    return f"{value:.6g}"


def page(text: str, data: dict[str, Any]) -> str:
    """Return the page with the table between its markers."""
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}\n\n{table(data)}\n{END}{tail}"


def main(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--seeds", type=int)
    asked = parser.parse_args(arguments)
    if asked.measure:
        measure(asked.names, asked.seeds, asked.again)
    old = PAGE.read_text(encoding="utf-8")
    text = page(old, json.loads(DATA.read_text(encoding="utf-8")))
    if asked.check:
        print("up to date" if text == old else f"{PAGE.name} is not what {DATA.name} says")
        return 0 if text == old else 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
