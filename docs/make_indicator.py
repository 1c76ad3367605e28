"""Write problems/four-stroke-engine.csv, the indicator diagram of the predefined engine.

    python docs/make_indicator.py

Compression and expansion are polytropes p V^n, between them a share of the charge burns by
Wiebe's function (L. Eriksson, I. Andersson, An analytic model for cylinder pressure in a
four-stroke SI engine, SAE 2002-01-0371); the strokes of gas exchange are joined by half
cosines. Crank angles are counted from the top dead centre of gas exchange, pressures are
against that of the crankcase.
"""

from __future__ import annotations

from math import asin, cos, exp, log, pi, radians, sin
from pathlib import Path

CRANK, ROD, BORE = 0.045, 0.145, 0.082  # m, as in the problem file
RATIO = 10.0  # largest to smallest volume
AMBIENT, INTAKE, EXHAUST = 1.0e5, 0.92e5, 1.08e5  # Pa
COMPRESSION, EXPANSION = 1.32, 1.27  # exponents of the polytropes
TOP = 60e5  # Pa, expansion polytrope at the smallest volume
BURN, DURATION = 340.0, 55.0  # deg
OPENS, CLOSES, STEP = 500.0, 220.0, 2  # exhaust opens, intake closes, deg


def travel(angle: float) -> float:
    """Return how far the piston is below its highest position [m]; `angle` in rad."""
    slide = CRANK * cos(angle) + ROD * cos(asin(CRANK / ROD * sin(angle)))
    return CRANK + ROD - slide


def volume(degrees: float) -> float:
    """Return the volume of the cylinder relative to the smallest one."""
    return 1 + (RATIO - 1) * travel(radians(degrees)) / (2 * CRANK)


def burnt(degrees: float) -> float:
    """Return the burnt share of the charge."""
    passed = max(0.0, (degrees - BURN) / DURATION)
    return 1 - exp(log(0.001) * passed**3)


def closed(degrees: float) -> float:
    """Return the pressure while both valves are closed [Pa]."""
    compressed = INTAKE * (volume(CLOSES) / volume(degrees)) ** COMPRESSION
    expanded = TOP * volume(degrees) ** -EXPANSION
    share = burnt(degrees)
    return (1 - share) * compressed + share * expanded


def blend(start: float, end: float, share: float) -> float:
    """Return the half cosine from `start` to `end`."""
    return start + (end - start) * (1 - cos(pi * min(1.0, max(0.0, share)))) / 2


def pressure(degrees: float) -> float:
    """Return the absolute pressure [Pa], 0 to 720 deg."""
    if CLOSES <= degrees <= OPENS:
        return closed(degrees)
    if degrees > OPENS:  # blow-down until 570 deg, then the exhaust stroke
        return blend(closed(OPENS), EXHAUST, (degrees - OPENS) / 70)
    return blend(EXHAUST, INTAKE, degrees / 30)


def rows() -> list[str]:
    """Return the lines of the file."""
    lines = ["crank,pressure,crank_deg"]
    for degrees in range(0, 720 + STEP, STEP):
        gauge = round(pressure(float(degrees)) - AMBIENT)
        lines.append(f"{radians(degrees):.15f},{gauge},{degrees}")
    return lines


if __name__ == "__main__":
    place = Path(__file__).resolve().parent.parent / "problems" / "four-stroke-engine.csv"
    place.write_text("\n".join(rows()) + "\n")
