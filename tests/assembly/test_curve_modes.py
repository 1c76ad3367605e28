"""Assembly modes of curve joints: all contacts of a pin or a roller with its curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.errors import MechanismError
from tests.shared.cams import LONG, PI, largest, slider_crank, turn
from tests.shared.mechanisms import cam


def test_all_contacts_of_a_pin_on_lobes_are_found() -> None:
    """Where the ring is as far from the disc's centre as the pin: all roots of one function."""
    lobes, u = 9, 0.3
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "C": (0.003, 0)}),
            md.Body("disc", {"C": (0, 0), "P": (0.05, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("C", "crank.C", "disc.C"),
            md.Curve(
                "ring",
                "ground.O",
                "disc.P",
                x=f"0.05*cos(s) + 0.003*cos({lobes}*s)",
                y=f"0.05*sin(s) - 0.003*sin({lobes}*s)",
                closed=True,
            ),
        ],
        sketch={"crank": u, "disc": -u / lobes},
    )
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[u])))
    center = 0.003 * np.exp(1j * u)

    def ring(s: object) -> object:
        return 0.05 * np.exp(1j * s) + 0.003 * np.exp(-1j * lobes * s)

    fine = np.linspace(0, 2 * PI, 200_001)
    apart = np.abs(ring(fine) - center) - 0.05
    crossings = fine[:-1][apart[:-1] * apart[1:] < 0]
    assert len(crossings) == 2 * (lobes + 1)
    assert result.summary["count"] == len(crossings)
    assert result.summary["proven"] is False
    s = np.sort(result.joints["ring"].s)
    assert np.abs(s - crossings).max() < 2 * PI / 200_000
    assert np.abs(s + u / lobes - 2 * PI).min() < 1e-13, "the contact of the drive"
    P = result.points["disc.P"].position
    for row, place in enumerate(ring(result.joints["ring"].s)):
        assert abs(complex(*P[row]) - place) < 1e-16
        assert abs(complex(*P[row]) - center) == pytest.approx(0.05, rel=1e-14)
    labels = [label for (label,) in result.labels]
    assert sorted(labels) == sorted(f"{sign}{k}" for sign in "+-" for k in range(1, lobes + 2))


def test_a_sweep_starts_on_the_mode_named_and_the_sketch_may_leave_it_open() -> None:
    mechanism = cam("0.01 + 0.03*cos(s)", "0.03*sin(s)", 0.008)
    lower = md.solve(mechanism, replace(turn(), mode="+1"))
    u = lower.drivers["cam.angle"].position
    y = LONG(0.02) * np.sin(u.astype(LONG)) - slider_crank(0.01, 0.038, u)[0]
    assert largest(lower.points["follower.N"].position[:, 1], y) < 1e-16
    for key, value in (("profile", 1.5), ("profile.s", 1.5), ("guide", 0.03)):
        sketched = replace(mechanism, sketch=Table({"cam": 0.3, key: value}))
        assert md.solve(sketched, turn()).points["follower.N"].position[0, 1] > 0
    with pytest.raises(MechanismError, match="does not tell which assembly mode") as caught:
        md.solve(replace(mechanism, sketch=Table({"cam": 0.3})), turn())
    assert "guide" in caught.value.hint
    assert "profile" in caught.value.hint
