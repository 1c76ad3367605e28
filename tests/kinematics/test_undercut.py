"""Rollers that cut into their curve."""

from __future__ import annotations

import math

import pytest

import mechdae as md
from tests.shared.cams import PI, turn
from tests.shared.mechanisms import cam


def test_a_roller_too_large_for_the_curve_is_said_to_cut() -> None:
    """In an ellipse the least radius of curvature is b^2/a; the follower locks at a cusp."""
    a, b = 0.05, 0.04
    fits = md.solve(cam("0.05*cos(s)", "0.04*sin(s)", 0.031, 0.01, side="left"), turn())
    assert fits.fault is None
    assert "undercut" not in fits.summary
    roller = 0.035
    result = md.solve(cam("0.05*cos(s)", "0.04*sin(s)", roller, 0.005, side="left"), turn())
    # by symmetry the roller touches on both sides when the long axis is upright
    (cut,) = result.summary["undercut"]
    assert cut["from"] == pytest.approx(PI / 2, abs=1e-8)
    assert cut["from"] >= PI / 2
    assert cut["to"] == pytest.approx(result.summary["limits"][1], abs=1e-8)  # up to the cusp
    (few,) = md.solve(result.mechanism, turn(poses=7)).summary["undercut"]
    assert few["from"] == pytest.approx(PI / 2, abs=1e-8)  # whatever the poses
    assert cut["joint"] == "profile"
    assert 0 < cut["depth"] < roller
    assert "the roller of joint profile cuts into its curve" in str(result.fault)
    assert [e["joint"] for e in result.events if e["kind"] == "undercut"] == ["profile"]
    # cusp of the parallel: the radius of curvature is that of the roller
    sine2 = ((roller * a * b) ** (2 / 3) - b * b) / (a * a - b * b)
    sine = math.sqrt(sine2)
    cosine = math.sqrt(1 - sine2)
    n = complex(b * cosine, a * sine) / math.hypot(b * cosine, a * sine)
    center = complex(a * cosine, b * sine) - roller * n
    assert result.summary["limits"][1] == pytest.approx(
        PI / 2 - math.atan2(center.imag, center.real), rel=1e-12
    )
    modes = md.solve(
        cam("0.05*cos(s)", "0.04*sin(s)", roller, 0.005, side="left"),
        md.Modes(md.Driver("cam.angle", at=[PI / 2 + 0.02])),
    )
    assert 0 < len(modes.summary["undercut"]) < modes.summary["count"]


def test_a_roller_may_cut_away_from_its_contact() -> None:
    """A peanut: the neck is wide enough for the curvature, not for the roller."""
    law = "(0.03 + 0.012*cos(2*s))"
    for roller, cuts in ((0.010, False), (0.02, True)):
        result = md.solve(cam(f"{law}*cos(s)", f"{law}*sin(s)", roller, 0.03 + roller), turn())
        assert ("undercut" in result.summary) == cuts
