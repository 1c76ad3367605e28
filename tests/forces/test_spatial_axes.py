"""Reactions in space in axes of bodies, and along and across links."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.reference.spatial_bodies import rotation
from tests.shared.space import bennett, reference, rssr
from tests.shared.spatial_forces import massive, place

BOTH = ("body", "radial")


def test_axes_are_those_of_the_quaternions_and_places() -> None:
    mechanism = massive(rssr(reference("rssr")["params"]), bars=("bar",))
    mechanism = replace(mechanism, sketch=Table({"A": 0.5, "D": -1.2}))
    task = md.Reactions(driver=md.Driver("A.angle", at=[0.5, 1.0], speed=3.0), axes=BOTH)
    result = md.solve(mechanism, task)
    links = {"A": ("crank.A", "crank.B"), "B": ("bar.B", "bar.C"), "C": ("bar.C", "bar.B"),
             "D": ("rocker.D", "rocker.C")}  # fmt: skip
    for name, (here, there) in links.items():
        own = result.joints[name]
        for k in range(2):
            force = own.reaction[k, :3]
            way = place(result, there, k) - place(result, here, k)
            along = force @ way / np.linalg.norm(way)
            across = np.linalg.norm(np.cross(way, force)) / np.linalg.norm(way)
            size = np.abs(force).max()
            assert own.reaction_radial[k] == pytest.approx([along, across], abs=1e-13 * size)
        if name in "AD":  # seen by the body: a fixed force in the world turns against it
            body = mechanism.joints[name].second_body
            for k in range(2):
                R = rotation(result.bodies[body].orientation[k])
                wanted = [*(R.T @ own.reaction[k, :3]), *(R.T @ own.reaction[k, 3:])]
                size = np.abs(own.reaction[k]).max()
                assert own.reaction_body[k] == pytest.approx(wanted, abs=1e-13 * size)
        else:
            assert "reaction_body" not in own
    assert any("B, C: no reaction_body, bar spins freely" in n for n in result.summary["notes"])


def test_a_pendulum_of_space_feels_its_pull_along_itself() -> None:
    """In axes of the body: m g cos + m w^2 l along the rod, m g sin and m l dw across."""
    m, length, g, w, dw = 2.0, 0.3, 9.81, 3.0, 5.0
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0]}),
        bodies=[md.Body("rod", {"O": [0, 0, 0], "E": [length, 0, 0]}, mass=m,
                        center=[length, 0, 0])],
        joints=[md.SpatialRevolute("O", "ground.O", "rod.O", axis=[0, 1, 0], zero=[0, 0, -1],
                                   axis2=[0, 1, 0], zero2=[1, 0, 0])],
        gravity=(0, 0, -g),
    )  # fmt: skip
    at = [0.0, 0.6]
    task = md.Reactions(driver=md.Driver("O.angle", at=at, speed=w, acceleration=dw), axes=BOTH)
    result = md.solve(mechanism, task)
    own: Any = result.joints["O"]
    for k, phi in enumerate(at):  # O holds the rod against its weight, inward for its turning
        along = -m * g * np.cos(phi) - m * w**2 * length
        across = np.hypot(m * g * np.sin(phi) + m * length * dw, 0.0)
        assert own.reaction_body[k, 0] == pytest.approx(along, rel=1e-13)
        assert np.hypot(*own.reaction_body[k, 1:3]) == pytest.approx(across, rel=1e-12, abs=1e-12)
    assert "reaction_radial" not in own  # a rod with one joint is no link between two
    assert any("O: no reaction_radial" in note for note in result.summary["notes"])


def test_what_is_not_unique_has_no_axes_either() -> None:
    mechanism = massive(bennett(reference("bennett_motion")["params"]))
    modes = md.solve(mechanism, md.Modes(driver=md.Driver("P.angle", at=[1.0])))
    task = md.Reactions(
        driver=md.Driver("P.angle", at=[1.0]), axes=BOTH, mode=",".join(modes.labels[0])
    )
    for own in md.solve(mechanism, task).joints.values():
        assert np.isnan(own.reaction_body).all()
        assert np.isnan(own.reaction_radial).all()
