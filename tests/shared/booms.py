"""A boom that a cylinder lifts, and four-bars that do not close, with closed forms."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

import mechdae as md
from mechdae.errors import AssemblyError

BASE, PIN = 0.3 - 0.4j, 1.2 + 0.3j


def boom(sketch: Mapping[str, float]) -> md.Mechanism:
    """Return a boom on the ground at 0, its pin on the rod of a cylinder from the base."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "B": (BASE.real, BASE.imag)}),
        bodies=[
            md.Body("boom", {"O": (0, 0), "P": (PIN.real, PIN.imag)}),
            md.Body("barrel", {"B": (0, 0)}),
            md.Body("rod", {"P": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "boom.O"),
            md.Revolute("B", "ground.B", "barrel.B"),
            md.Revolute("P", "boom.P", "rod.P"),
            md.Prismatic("cyl", "barrel.B", "rod.P"),
        ],
        sketch=sketch,
    )


def BOOM(slide: float) -> float:
    """Return the boom's angle at a length of the cylinder, the base on its right."""
    cosine = (abs(BASE) ** 2 + abs(PIN) ** 2 - slide**2) / (2 * abs(BASE) * abs(PIN))
    return float(np.angle(BASE) - np.angle(PIN)) + math.acos(cosine)


def slide_missed(seed: int) -> float:
    """Return how far booms are from the law of cosines, over 1e-12, from sketches out of reach."""
    draw = np.random.default_rng([seed, 3])
    asked = np.sort(draw.uniform(0.85, 1.65, 4))
    sketched = draw.choice([draw.uniform(0.01, 0.7), draw.uniform(1.8, 20)])
    mechanism = boom({"boom": BOOM(float(asked[1])) + draw.uniform(-0.3, 0.3), "cyl": sketched})
    try:
        result = md.solve(mechanism, md.Sweep(md.Driver("cyl.slide", at=asked.tolist())))
    except AssemblyError:
        return math.inf
    if set(result.status) != {"ok"}:
        return math.inf
    wanted = np.array([BOOM(slide) for slide in asked])
    return float(np.abs(result.bodies["boom"].angle - wanted).max() / 1e-12)


def reach_missed(seed: int) -> float:
    """Return how far told lengths of a coupler that does not reach are off, over 1e-5 of them."""
    draw = np.random.default_rng([seed, 5])
    crank, rocker, ground = draw.uniform((1, 1, 4), (2, 2, 5))
    phi, long = draw.uniform(0.5, 2.5), bool(seed % 2)
    apart = abs(ground - crank * np.exp(1j * phi))
    coupler = apart + rocker + 0.2 if long else apart - rocker - 0.1
    bodies = [
        md.Body("crank", {"A": (0, 0), "B": (crank, 0)}),
        md.Body("coupler", {"B": (0, 0), "C": ("c", 0)}),
        md.Body("rocker", {"D": (0, 0), "C": (0, "r")}),
    ]
    ends = [("ground.A", "crank.A"), ("crank.B", "coupler.B"), ("coupler.C", "rocker.C"),
            ("ground.D", "rocker.D")]  # fmt: skip
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (ground, 0)}),
        bodies=bodies,
        joints=[md.Revolute(name, *own) for name, own in zip("ABCD", ends, strict=True)],
        parameters={"c": coupler, "r": rocker},
        sketch={"crank": phi, "coupler": 0.0, "rocker": 1.0},
    )
    try:
        md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[phi])))
    except AssemblyError as error:
        word = "c at most" if long else "c at least"
        found = re.search(rf"here {word} (\S+) m, or r at least (\S+) m", str(error))
        if found is None:
            return math.inf
        wanted = (apart + rocker, coupler - apart) if long else (apart - rocker, apart - coupler)
        told = (float(found[1]), float(found[2]))
        return max(abs(a / b - 1) for a, b in zip(told, wanted, strict=True)) / 1e-5
    return math.inf
