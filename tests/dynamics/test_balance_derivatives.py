"""Derivatives of an equilibrium and of its small motion by parameters, beside a closed form."""

from __future__ import annotations

import tomllib

import mpmath
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict

M, K, L, INERTIA, G, FREE = 2.0, 30.0, 0.4, 0.1, 9.81, 0.3
ROD = f"""
schema = 1
gravity = [0, -{G}]
[parameters]
m = {M}
k = {K}
[ground]
points = {{ O = [0, 0] }}
[bodies.rod]
points = {{ O = [0, 0], P = [{L}, 0] }}
mass = "m"
center = [{L}, 0]
inertia = {INERTIA}
[joints]
O = {{ kind = "revolute", between = ["ground.O", "rod.O"] }}
[loads.coil]
kind = "spring"
coordinate = "rod.angle"
stiffness = "k"
free_length = {FREE}
[sketch]
rod = 0.0
[tasks.rest]
kind = "equilibrium"
linearise = true
[tasks.slopes]
kind = "sensitivity"
of = "rest"
outputs = ["bodies/rod/angle", "points/rod.P/position", "summary/frequencies"]
wrt = ["m", "k"]
"""


def closed(m: mpmath.mpf, k: mpmath.mpf) -> list[mpmath.mpf]:
    """Return angle, place and frequency [Hz]; k (a - free) = -m g l cos a holds the rod."""
    angle = mpmath.findroot(lambda a: k * (a - FREE) + m * G * L * mpmath.cos(a), 0.0)
    stiffness = k - m * G * L * mpmath.sin(angle)
    omega = mpmath.sqrt(stiffness / (INERTIA + m * L * L))
    return [angle, L * mpmath.cos(angle), L * mpmath.sin(angle), omega / (2 * mpmath.pi)]


def test_of_a_rod_on_a_coil_spring() -> None:
    result = md.solve(from_dict(tomllib.loads(ROD)), "slopes")
    assert result.summary["differenced"] == []  # all by the implicit function theorem
    found = result.data["derivatives"]
    for name, slope in (("m", (1, 0)), ("k", (0, 1))):
        slopes = [
            found["bodies/rod/angle"][name],
            *np.ravel(found["points/rod.P/position"][name]),
            found["summary/frequencies"][name],
        ]
        with mpmath.workdps(30):
            for entry, got in enumerate(slopes):
                wanted = mpmath.diff(lambda m, k, e=entry: closed(m, k)[e], (M, K), slope)
                assert float(np.ravel(got)[0]) == pytest.approx(float(wanted), rel=1e-12), entry
