"""What the editor finds, measured in Chromium: random four-bars' curves, closed curves, letters.

``python -m tests.scripts.found_linkages --out docs/data/found-linkages.json --page PAGE`` writes
the table of docs/theory/evidence/finding-linkages.md.
Times are processor seconds of the page's thread. Errors are Hausdorff's distance from the wanted
curve as a share of its larger side, of the way that the page's solver follows. Beside the six
curves of `benchmarks/compositions.py` and the outlines of six letters (DejaVu Sans) stands what
`mechdae synthesize` makes of the task that the page saves, by the same measure, with 20 starts; for
the six curves also the distance that `docs/data/compositions.json` has, of both.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

import mechdae as md
from benchmarks.compositions import CURVES
from mechdae.parts.types.schemes.shape import Wanted, distances
from tests.reference.coupler_curves import drawn_four_bar, drawn_geared_five_bar, evenly, off
from tests.shared.browser import ARGUMENTS, CHROMIUM
from tests.shared.finding import Finding
from tests.shared.paths import ROOT

LETTERS = "CDLSUV"
TURNING, SWINGING, GEARED, STARTS, SEED = 200, 24, 10, 20, 5
RATIOS = (-1, 1, -2, 2)
LIMIT = 0.01
HEAD = (
    "| curve | first three, class and error | best of twelve | s | `mechdae synthesize`, error | s "
    "| distance | of compositions |"
)
MARK = "<!-- found -->\n"
END = "<!-- end of found -->"
COMPOSED = ROOT / "docs/data/compositions.json"


def formula(name):
    """Return a closed curve (240,) of `benchmarks/compositions.py`, a decimetre large."""
    s = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)
    x, y = (eval(own, {"s": s, "cos": np.cos, "sin": np.sin}) for own in CURVES[name])
    return 0.04 * evenly(x + 1j * y, 240)


def letter(name):
    """Return the outer outline of a letter, a decimetre high."""
    path = TextPath((0, 0), name, size=0.1, prop=FontProperties(family="DejaVu Sans"))
    outlines = [own @ [1, 1j] for own in path.to_polygons()]
    outer = max(outlines, key=lambda own: np.ptp(own.real))[:-1]
    at = np.linspace(0, len(outer), 20_000, endpoint=False)
    return evenly(np.interp(at, np.arange(len(outer) + 1), np.append(outer, outer[0])), 240)


def distance(curve, way):
    """Return the measure of `benchmarks/compositions.py`."""
    wanted = Wanted(curve)
    return float(distances(evenly(way, 400)[None] / wanted.radius, wanted)[0])


def drawn(count, full):
    """Return so many curves of random four-bars."""
    generator = np.random.default_rng(SEED)
    return [drawn_four_bar(generator, full=full) for _ in range(count)]


def came_back(finding, curve):
    """Return how far the nearest of the first three is off, and the seconds that they take."""
    found, seconds = finding.curve(curve, whole=False)
    return min((off(curve, own["way"]) for own in found if own["good"]), default=1.0), seconds


def summed(rows):
    """Return how many of the curves come back, and what that takes."""
    errors, times = np.array(rows).T
    return {
        "curves": len(rows),
        "within": int(np.sum(errors < LIMIT)),
        "median_error": float(np.median(errors)),
        "median_seconds": float(np.median(times)),
        "largest_seconds": float(np.max(times)),
    }


def synthesized(finding, curve, folder):
    """Return the error of the best design of the task that the page saves, and its seconds."""
    file = folder / "task.toml"
    file.write_text(finding.page.evaluate("mechdae.finder.toml()"), encoding="utf-8")
    begun = time.process_time()
    result = md.synthesize(file, starts=STARTS)
    seconds = time.process_time() - begun
    errors = []
    for design in result.data["designs"]:
        file.write_text(design["problem"], encoding="utf-8")
        way = md.solve(file, "turn").points["coupler.P"].position @ [1, 1j]
        errors.append(off(curve, way[np.isfinite(way)]))
    return {"error": min(errors, default=None), "seconds": seconds}


def single(finding, curve, folder):
    """Return the first three for a curve, beside a synthesis."""
    found, seconds = finding.curve(curve)
    rows = [
        {
            "class": own["class"],
            "error": off(curve, own["way"]),
            "angle": own["angle"],
            "distance": distance(curve, own["way"]),
        }
        for own in found
        if own["good"]
    ]
    beside = synthesized(finding, curve, folder)
    best = min(rows, key=lambda row: row["error"])
    return {"found": rows[:3], "best": best, "seconds": seconds, "synthesis": beside}


def measured(folder):
    """Return all figures."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        finding = Finding(browser, folder)
        figures = {
            "atlas_seconds": finding.atlas(),
            "mechanisms": finding.page.evaluate("mechdae.finder.atlas.count"),
            "page_bytes": (folder / "editor.html").stat().st_size,
        }
        finding.curve(formula("egg"))  # the browser compiles what runs often
        figures["curves"] = {name: single(finding, formula(name), folder) for name in CURVES}
        figures["letters"] = {name: single(finding, letter(name), folder) for name in LETTERS}
        figures["turning"] = summed([came_back(finding, own) for own in drawn(TURNING, True)])
        figures["swinging"] = summed([came_back(finding, own) for own in drawn(SWINGING, False)])
        generator = np.random.default_rng(SEED)
        wheels = [drawn_geared_five_bar(generator, own) for own in RATIOS for _ in range(GEARED)]
        figures["geared"] = summed([came_back(finding, own) for own in wheels])
        assert finding.said == [], finding.said
        browser.close()
    return figures


def percent(error):
    return "over 100 %" if error > 1 else f"{100 * error:.2g} %"


def told(row):
    names = {"watt": "Watt I", "stephenson": "Stephenson III", "geared": "geared five-bar"}
    return f"{names.get(row['class'], row['class'])} {percent(row['error'])}"


def table(figures):
    """Return the rows of the page."""
    records = json.loads(COMPOSED.read_text(encoding="utf-8"))["records"]
    known = {
        own["curve"]: min(own[aim]["least_distance"][0] for aim in ("material", "points"))
        for own in records
    }
    rows = [HEAD, "|---|---|---|---|---|---|---|---|"]
    for name, own in {**figures["curves"], **figures["letters"]}.items():
        three = ", ".join(told(row) for row in own["found"])
        beside = own["synthesis"]
        error = "none" if beside["error"] is None else percent(beside["error"])
        least = min(row["distance"] for row in [*own["found"], own["best"]])
        more = [f"{least:.2g}", f"{known[name]:.2g}"] if name in known else ["", ""]
        cells = [
            name,
            three,
            told(own["best"]),
            f"{own['seconds']:.1f}",
            error,
            f"{beside['seconds']:.0f}",
            *more,
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def sentence(figures):
    """Return what the page says of curves that come back."""
    turning, swinging, geared = (figures[name] for name in ("turning", "swinging", "geared"))
    return (
        f"Of {turning['curves']} curves of random four-bars whose crank turns, "
        f"{turning['within']} come back within 1 % of their size, in "
        f"{turning['median_seconds']:.1f} s by the median and {turning['largest_seconds']:.1f} s "
        f"at most;\nof {swinging['curves']} of four-bars whose links all swing "
        f"{swinging['within']}; of {geared['curves']} of geared five-bars {geared['within']}. "
        f"The atlas takes {figures['atlas_seconds']:.1f} s."
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    figures = measured(folder)
    shutil.rmtree(folder)
    options.out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if options.page:
        text = options.page.read_text(encoding="utf-8")
        before, rest = text.split(MARK, 1)
        after = rest.split(END, 1)[1]
        made = f"{MARK}{sentence(figures)}\n\n{table(figures)}\n\n{END}"
        options.page.write_text(before + made + after, encoding="utf-8")


if __name__ == "__main__":
    main()
