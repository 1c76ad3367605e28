"""Pictures of curve joints: the curve, its roller, what drives along it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.shared.mechanisms import rod_and_slot


def test_cam_roller_groove_and_track_are_drawn() -> None:
    def drawn(result: object) -> dict:
        ax = md.plot(result, "diagram")
        return {artist.get_gid(): artist for artist in ax.get_children() if artist.get_gid()}

    problem = md.load("cam-roller-follower")
    result = md.solve(problem, "turn", poses=3)
    found = drawn(result)
    outline = np.array(found["joint-profile-curve"].get_xydata())
    u = result.drivers["cam.angle"].position[0]
    values = problem.mechanism.values()
    at_start = (values["base"] + 0.0) * np.array([math.cos(u), math.sin(u)])
    assert np.hypot(*(outline - at_start).T).min() < 1e-12
    roller = found["joint-profile-roller"]
    assert roller.get_radius() == pytest.approx(values["rho"], rel=1e-9)
    gap = np.hypot(*(outline - np.array(roller.center)).T).min()
    assert gap == pytest.approx(values["rho"], rel=1e-3), "the roller touches the cam"
    slot = rod_and_slot(x="0.02 + s", y="4*s**2 - 0.01", range=(0, 0.07))
    result = md.solve(slot, md.Sweep(md.Driver("crank.angle", at=[2.0])))
    assert {"joint-slot-curve", "joint-slot-follower"} <= set(drawn(result))
    driven = replace(slot, sketch=Table({"slot": 0.05, "crank": 1.6}))
    result = md.solve(driven, md.Sweep(md.Driver("slot.s", at=[0.05])))
    assert "driver-slot.s" in drawn(result)
