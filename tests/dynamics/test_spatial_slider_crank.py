"""The spatial slider-crank of the IFToMM library, free under gravity: its energy, integrated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md

FILE = Path(__file__).parents[1] / "data" / "spatial" / "spatial-slider-crank.toml"
R, L, Y, Z, G = 0.08, 0.3, 0.1, 0.12, 9.81
CRANK, ROD, SLIDER = (0.12, 1e-4), (0.5, np.array([4e-4, 4e-3, 4e-3])), 2.0
PANEL, NODES = 0.05, 16


def placed(angle: Any) -> tuple[Any, Any, Any, Any]:
    """Slide (n,), mass centre and height of the crank, axes of the rod (n, 3, 3) as columns."""
    pin = np.stack([0 * angle, Y - R * np.sin(angle), Z + R * np.cos(angle)], axis=-1)
    slide = np.sqrt(L**2 - pin[..., 1] ** 2 - pin[..., 2] ** 2)
    end = np.stack([slide, 0 * slide, 0 * slide], axis=-1)
    x = (end - pin) / L
    y = np.stack([-x[..., 1], x[..., 0], 0 * slide], axis=-1)
    y = y / np.sqrt((y * y).sum(axis=-1))[..., None]
    return (
        slide,
        (pin + end) / 2,
        Z + R / 2 * np.cos(angle),
        np.stack([x, y, np.cross(x, y)], axis=-1),
    )


def rate_of(angle: Any, energy: float) -> Any:
    """Speed of the crank at angles, from the energy; derivatives by complex steps."""
    h = 1e-30
    slide, centre, _, axes = (own.imag / h for own in placed(angle + 1j * h))
    places = placed(angle + 0j)
    _, mid, top, frame = (own.real for own in places)
    spin = np.einsum("nji,njk->nik", frame, axes)
    turn = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    inertia = CRANK[1] + CRANK[0] * R**2 / 4 + SLIDER * slide**2
    inertia += ROD[0] * (centre**2).sum(axis=1) + (ROD[1] * turn**2).sum(axis=1)
    potential = G * (CRANK[0] * top + ROD[0] * mid[:, 2])
    return np.sqrt(2 * (energy - potential) / inertia), inertia, potential


def slides(times: list[float], speed: float) -> list[float]:
    """The slide at times: the time that turns take by Gauss's rule, a root by bisection."""
    _, inertia, potential = rate_of(np.zeros(1), 1e3)
    energy = float((inertia * speed**2 / 2 + potential)[0])
    nodes, weights = np.polynomial.legendre.leggauss(NODES)

    def took(low: float, high: float) -> float:
        middle, half = (low + high) / 2, (high - low) / 2
        return float(half * (weights / rate_of(middle + half * nodes, energy)[0]).sum())

    found, t, angle = [], 0.0, 0.0
    for wanted in times:
        while t + (panel := took(angle, angle + PANEL)) < wanted:
            t, angle = t + panel, angle + PANEL
        low, high = angle, angle + PANEL
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if t + took(angle, middle) < wanted else (low, middle)
        found.append(float(placed(np.array([low]))[0][0]))
    return found


def test_the_slide_at_five_times() -> None:
    result = md.solve(md.load(FILE), "run")
    assert result.fault is None
    wanted = slides([0.1, 0.5, 1.0, 2.0, 5.0], 6.0)
    assert wanted[0] == pytest.approx(0.22679632056744, abs=1e-12)
    assert result.joints["S"].slide == pytest.approx(wanted, abs=1e-9)
