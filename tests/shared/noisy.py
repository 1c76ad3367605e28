"""Cranks of a beam with dimensions that hardly agree, and their poses of least squares."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

import mechdae as md
from mechdae.errors import AssemblyError

PINS = ((0.0, 0.0), (2.0, 0.0), (1.0, 0.7))


def parallelogram(noise: float, seed: int = 0, tolerance: float | None = None) -> md.Mechanism:
    """Return a beam on three cranks whose lengths and holes are off by up to `noise`."""
    draw = np.random.default_rng([seed, 9])
    off = noise * draw.uniform(-1, 1, (3, 3))
    bodies, joints = [], []
    for k in range(3):
        bodies.append(md.Body(f"c{k + 1}", {"A": (0, 0), "B": (1 + off[k, 0], 0)}))
        joints.append(md.Revolute(f"A{k + 1}", f"ground.A{k + 1}", f"c{k + 1}.A"))
        joints.append(md.Revolute(f"B{k + 1}", f"c{k + 1}.B", f"beam.B{k + 1}"))
    holes = {f"B{k + 1}": tuple(np.array(PINS[k]) + off[k, 1:]) for k in range(3)}
    return md.Mechanism(
        ground=md.Ground({f"A{k + 1}": pin for k, pin in enumerate(PINS)}),
        bodies=[*bodies, md.Body("beam", holes)],
        joints=joints,
        sketch={"beam": 0.0, "c1": 1.0, "c2": 1.0, "c3": 1.0},
        closure_tolerance=tolerance,
    )


def least_squares(mechanism: md.Mechanism, phi: float) -> tuple[Any, float]:
    """Return angles of beam, c2 and c3 that leave the pins of the last two least open, and the gap.

    In complex numbers; steps of Gauss and Newton end where the gaps are square to all motions.
    """
    values = mechanism.values()
    length = [values[f"c{k}.B.x"] for k in (1, 2, 3)]
    hole = [values[f"beam.B{k}.x"] + 1j * values[f"beam.B{k}.y"] for k in (1, 2, 3)]
    pin = [complex(*own) for own in PINS]
    start = pin[0] + length[0] * np.exp(1j * phi)
    z = np.array([0.0, phi, phi])
    for _ in range(40):
        arms = [np.exp(1j * z[0]) * (hole[k] - hole[0]) for k in (1, 2)]
        cranks = [length[k] * np.exp(1j * z[k]) for k in (1, 2)]
        gaps = [start + arms[k] - pin[k + 1] - cranks[k] for k in (0, 1)]
        J = np.zeros((2, 3), complex)
        J[:, 0] = [1j * arm for arm in arms]
        J[0, 1], J[1, 2] = -1j * cranks[0], -1j * cranks[1]
        rows = np.vstack([J.real, J.imag])
        left = np.concatenate([np.real(gaps), np.imag(gaps)])
        z = z - np.linalg.lstsq(rows, left, rcond=None)[0]
    return z, float(np.linalg.norm(left))


def bound_missed(seed: int) -> float:
    """Return how far poses are from those of least squares, over their bounds, at most.

    Poses that are not `ok`, and a figure of what stays open that is too small, count as missed.
    """
    noise = 10.0 ** -np.random.default_rng(seed).uniform(4, 10)
    mechanism = parallelogram(noise, seed, 10 * noise)
    sweep = md.Sweep(md.Driver("c1.angle", from_=0.3, to=5.7), poses=7)
    try:
        result = md.solve(mechanism, sweep)
    except AssemblyError:
        return np.inf
    if set(result.status) != {"ok"} or result.fault is not None:
        return np.inf
    worst, largest = 0.0, 0.0
    for k, phi in enumerate(result.drivers["c1.angle"].position):
        z, gap = least_squares(mechanism, float(phi))
        ours = np.array([result.bodies[name].angle[k] for name in ("beam", "c2", "c3")])
        far = np.abs(np.remainder(ours - z + np.pi, 2 * np.pi) - np.pi).max()
        worst, largest = max(worst, far / result.bound.angle[k]), max(largest, gap)
    told = result.summary["closure"]["length"]
    return worst if largest / 2 <= told <= largest * (1 + 1e-6) + 1e-15 else np.inf


def value_named(error: Exception) -> float:
    """Return the tolerance that a message names."""
    found = re.search(r"closure_tolerance = (\S+)", str(error))
    assert found is not None, error
    return float(found[1])
