"""Write the gas forces of three engines, compare them, and put the table on their page.

    python docs/make_engines.py

A slider-crank, a Wankel and an orbital engine (``data/engines``) fill the same volume per turn of
the shaft and run at the same speed. One indicator diagram stands for all: pressure over the
share of the stroke's volume in each of four strokes, that of ``make_indicator``. Rows of the files
are those places of the diagram at which the predefined engine's crank stands every two degrees.
"""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable
from math import acos, asin, cos, degrees, hypot, pi, radians, sin, sqrt
from pathlib import Path
from typing import Any

from make_indicator import AMBIENT, CRANK, ROD, pressure

import mechdae as md

DOCS = Path(__file__).resolve().parent
FOLDER, DATA = DOCS / "data" / "engines", DOCS / "data" / "engines.json"
PAGE = DOCS / "theory" / "evidence" / "engines.md"
NAMES = {"slider-crank": "slider-crank", "wankel": "Wankel", "sarich": "Sarich"}
STEP = 2
"""Degrees of the shaft between rows."""


def numbers(name: str) -> dict[str, float]:
    """Return the plain parameters of an engine [SI]."""
    table = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))["parameters"]
    plain = {key: value for key, value in table.items() if not isinstance(value, str)}
    return {
        key.removesuffix("_mm"): value / 1000 if key.endswith("_mm") else value
        for key, value in plain.items()
    }


def indicated(stroke: int, share: float) -> float:
    """Return the gauge pressure [Pa] in a stroke, 0 intake to 3 exhaust, by the volume's share."""
    slide = CRANK + ROD - 2 * CRANK * min(1.0, max(0.0, share))
    turn = degrees(acos(max(-1.0, min(1.0, (CRANK**2 + slide**2 - ROD**2) / (2 * CRANK * slide)))))
    return pressure(180.0 * stroke + (turn if stroke % 2 == 0 else 180.0 - turn)) - AMBIENT


def chamber(phase: float, share: Callable[[float], float]) -> float:
    """Return the gauge pressure at a phase, 4 pi for four strokes, 0 before intake."""
    phase %= 4 * pi
    return indicated(min(int(phase / pi), 3), share(phase))


# -- the engines: rows of gas forces over the shaft's angle [rad] --------------------------------


def slider_crank(angle: float) -> dict[str, float]:
    return {"pressure": pressure(degrees(angle)) - AMBIENT}


def wankel(angle: float) -> dict[str, float]:
    """Return forces over flank and width, and pressure differences across the seals [Pa]."""

    def at(j: int) -> float:
        phase = 2 * angle / 3 - pi / 3 - 2 * pi * j / 3 - 2 * pi * (j % 2) + 2 * pi
        return chamber(phase, lambda c: (1 - cos(c)) / 2)

    gas = [at(j) for j in range(3)]
    middles = [angle / 3 + pi / 3 + 2 * pi * j / 3 for j in range(3)]
    row = {
        "x": -sum(p * cos(m) for p, m in zip(gas, middles, strict=True)),
        "y": -sum(p * sin(m) for p, m in zip(gas, middles, strict=True)),
    }
    return row | {f"across{k}": abs(gas[k] - gas[k - 1]) for k in range(3)}


def sarich(angle: float) -> dict[str, float]:
    """Return forces and moments over the width, and pressure differences across the vanes."""
    sizes = numbers("sarich")
    e, h = sizes["e"], sizes["h"]
    mouth = h + e + sizes["gap"]

    def share(c: float) -> float:
        return (h * (1 - cos(c)) + e * cos(pi / 7) * sin(c) ** 2) / (2 * h)

    gas = [chamber(angle - (2 * k + 1) * pi / 7 - 2 * pi * (k % 2) + 2 * pi, share)
           for k in range(7)]  # fmt: skip
    turns = [2 * pi * k / 7 for k in range(7)]
    feet = [h + e * cos(angle - turn) for turn in turns]
    places = [(f * cos(turn), f * sin(turn)) for f, turn in zip(feet, turns, strict=True)]
    x = y = moment = 0.0
    for k, p in enumerate(gas):
        (x1, y1), (x2, y2) = places[k], places[(k + 1) % 7]
        fx, fy = -p * (y2 - y1), p * (x2 - x1)
        x, y = x + fx, y + fy
        moment += ((x1 + x2) / 2 - e * cos(angle)) * fy - ((y1 + y2) / 2 - e * sin(angle)) * fx
    row = {"x": x, "y": y, "moment": moment}
    for k in range(7):
        free, difference = mouth - feet[k], gas[k] - gas[k - 1]
        row[f"side{k}"] = -difference * free
        row[f"turning{k}"] = -difference * free**2 / 2
    return row


ENGINES = {"slider-crank": (slider_crank, 720), "wankel": (wankel, 1080), "sarich": (sarich, 720)}


def write_rows() -> None:
    """Write the files of gas forces, each over one cycle."""
    for name, (row, cycle) in ENGINES.items():
        with (FOLDER / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            every = [radians(d) for d in range(0, cycle + 1, STEP)]
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["shaft", *row(0.0)])
            for angle in every:
                writer.writerow([f"{angle:.15f}", *(f"{v:.9g}" for v in row(angle).values())])


# -- the comparison ------------------------------------------------------------------------------

SEALS = {
    "slider-crank": {"ring on cylinder": ("wall0", "wall1"), "skirt on cylinder": ("cylinder",)},
    "wankel": {"apex seal on housing": tuple(f"housing{k}" for k in range(3))},
    "sarich": {
        "vane in its slot": tuple(f"slot{k}" for k in range(7)),
        "vane on its face": tuple(f"face{k}" for k in range(7)),
    },
}
MOVING = {"slider-crank": "ring0.T", "wankel": "seal0.T", "sarich": "vane0.F"}
DEPTHS = {"slider-crank": "bore", "wankel": "b", "sarich": "b"}
TURNS = 6


def filled(name: str, sizes: dict[str, float]) -> tuple[int, float, float]:
    """Return the chambers, the volume of one [m^3] and how often it is filled per turn."""
    if name == "slider-crank":
        return 1, pi / 4 * sizes["bore"] ** 2 * 2 * sizes["r"], 1 / 2
    if name == "wankel":
        return 3, 3 * sqrt(3) * sizes["e"] * sizes["R"] * sizes["b"], 1 / 3
    return 7, 4 * sin(pi / 7) * sizes["e"] * sizes["h"] * sizes["b"], 1 / 2


def figures(name: str) -> dict[str, Any]:
    """Return what is compared of an engine [SI], over six turns of the shaft."""
    result = md.solve(md.load(FOLDER / f"{name}.toml"), "cycle")
    values, summary = result.mechanism.values(), result.summary
    chambers, volume, times = filled(name, values)
    box, losses, wear = summary["envelope"]["all"], summary["loss_by_joint"], summary["wear"]
    seals = {}
    for seal, joints in SEALS[name].items():
        parts = [wear[joint] for joint in joints]
        seals[seal] = {word: max(part[word] for part in parts) for word in parts[0]}
        seals[seal]["sliding_distance"] /= TURNS
        seals[seal]["loss"] = sum(losses[joint] for joint in joints)
        seals[seal]["peak_force"] = max(float(abs(result.joints[j].normal).max()) for j in joints)
    sealing = sum(seal["loss"] for seal in seals.values())
    body = MOVING[name].partition(".")[0]
    peak = max(hypot(*a) for a in result.points[MOVING[name]].acceleration.tolist())
    bearings = [wear[n] for n in wear if n not in {j for js in SEALS[name].values() for j in js}]
    effort = abs(next(iter(result.efforts.values())))
    return {
        "chambers": chambers, "volume": volume, "filled": chambers * volume * times,
        "indicated": summary["input"], "useful": summary["useful"], "loss_seals": sealing,
        "loss_bearings": summary["loss"] - sealing, "efficiency": summary["efficiency"],
        "seals": seals, "acceleration": peak, "seal_mass": values[f"{body}.mass"],
        "bearing_pressure": max(bearing["peak_pressure"] for bearing in bearings),
        "bearing_pv": max(bearing["mean_pv"] for bearing in bearings),
        "peak_over_mean": float(effort.max()) * values["omega"] / summary["useful"],
        "size": [box[1] - box[0], box[3] - box[2], values[DEPTHS[name]]],
    }  # fmt: skip


def curvatures() -> dict[str, float]:
    """Return the Wankel housing's curvatures [1/m], and how much they change the pressure."""
    sizes = numbers("wankel")
    e, radius = sizes["e"], sizes["R"]
    most, least = ((radius + s * 9 * e) / (radius + s * 3 * e) ** 2 for s in (1, -1))
    ratio = sqrt((1 / sizes["tip"] - least) / (1 / sizes["tip"] - most))
    leaning = degrees(asin(3 * e / radius))
    return {"most": most, "least": least, "ratio": ratio, "leaning": leaning}


ROWS: tuple[tuple[str, Callable[[dict[str, Any]], str]], ...] = (
    ("chambers, volume of each", lambda f: f"{f['chambers']}, {f['volume'] * 1e6:.1f} cm³"),
    ("filled per turn of the shaft", lambda f: f"{f['filled'] * 1e6:.1f} cm³"),
    ("indicated power", lambda f: f"{f['indicated']:.0f} W"),
    ("friction loss in seals", lambda f: f"{f['loss_seals']:.0f} W"),
    ("friction loss in bearings", lambda f: f"{f['loss_bearings']:.0f} W"),
    ("mechanical efficiency", lambda f: f"{f['efficiency']:.3f}"),
    ("largest acceleration of a seal", lambda f: f"{f['acceleration']:.0f} m/s²"),
    ("mass of a seal, times that", lambda f: f"{f['seal_mass'] * 1000:.1f} g, "
     f"{f['seal_mass'] * f['acceleration']:.0f} N"),
    ("largest pressure in a bearing", lambda f: f"{f['bearing_pressure'] / 1e6:.1f} MPa"),
    ("largest mean p v in a bearing", lambda f: f"{f['bearing_pv'] / 1e6:.1f} MW/m²"),
    ("peak over mean torque", lambda f: f"{f['peak_over_mean']:.1f}"),
    ("box of all that moves", lambda f: " × ".join(f"{1000 * s:.0f}" for s in f["size"]) + " mm, "
     f"{f['size'][0] * f['size'][1] * f['size'][2] * 1000:.2f} l"),
)  # fmt: skip


SEAL_COLUMNS = (
    "sliding seal", "largest normal force", "largest pressure", "largest p v", "mean p v",
    "slides per turn", "loss of all",
)  # fmt: skip


def tables(found: dict[str, Any]) -> str:
    """Return the tables of the page."""
    head = " | ".join(NAMES.values())
    lines = [f"| | {head} |", "|---|" + "---|" * len(NAMES)]
    for title, cell in ROWS:
        lines.append(f"| {title} | " + " | ".join(cell(found[name]) for name in NAMES) + " |")
    lines += ["", f"| {' | '.join(SEAL_COLUMNS)} |", "|---" * len(SEAL_COLUMNS) + "|"]
    for name in NAMES:
        for seal, row in found[name]["seals"].items():
            lines.append(
                f"| {NAMES[name]}: {seal} | {row['peak_force']:.0f} N | "
                f"{row['peak_pressure'] / 1e6:.2f} MPa | {row['peak_pv'] / 1e6:.1f} MW/m² | "
                f"{row['mean_pv'] / 1e6:.2f} MW/m² | {row['sliding_distance'] * 1000:.0f} mm | "
                f"{row['loss']:.0f} W |"
            )
    return "\n".join(lines)


def main() -> None:
    write_rows()
    found = {name: figures(name) for name in NAMES} | {"curvatures": curvatures()}
    DATA.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split("| | slider-crank", 1)
    after = rest.split("\n\n", 2)[2]
    PAGE.write_text(f"{before}{tables(found)}\n\n{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
