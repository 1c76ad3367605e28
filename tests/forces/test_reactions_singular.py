"""Forces at and near change points, and what is unique where self-stresses come and go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table

G = 10.0


def loaded(name: str, body: str, mass: float, center: tuple[float, float]) -> md.Mechanism:
    """Return a predefined mechanism with one heavy body."""
    mechanism = md.load(name).mechanism
    bodies = dict(mechanism.bodies)
    bodies[body] = replace(bodies[body], mass=mass, center=center)
    return replace(mechanism, bodies=Table(bodies), gravity=(0.0, -G))


def turn(poses: int, speed: float = 1.0) -> md.Reactions:
    driver = md.Driver("crank.angle", from_=0.0, to=2 * np.pi, speed=speed)
    return md.Reactions(driver=driver, poses=poses, friction="none")


def test_no_forces_on_a_change_point() -> None:
    """The rocker is a bar with two forces: its push is half the weight over sin(phi)."""
    mechanism = loaded("change-point-parallelogram", "coupler", 2.0, (1.5, 0.0))
    at = (0.5, 1e-3, 1e-6, 0.0, -0.5)
    driver = md.Driver("crank.angle", at=at, speed=1.0)
    result = md.solve(mechanism, md.Reactions(driver=driver, friction="none"))
    assert result.status.tolist() == ["ok", "ok", "ok", "singular", "ok"]
    assert np.isnan(result.joints["C"].reaction[3]).all()
    assert np.isnan(result.efforts["crank.angle"][3])
    assert "1 of 5 poses have no finite forces, first at crank.angle = 0 deg" in result.fault
    for k, phi in enumerate(at):
        if phi:
            across = 2.0 * (G - np.sin(phi)) / 2
            expected = [-across / np.tan(phi), -across, 0]
            near = 1e-12 / abs(np.sin(phi))
            assert result.joints["C"].reaction[k] == pytest.approx(expected, rel=near)


def test_change_points_of_a_redundant_beam() -> None:
    """Across a crank the beam's pin has half the crank's weight, at every angle."""
    mechanism = md.load("five-crank-parallelogram").mechanism
    driver = md.Driver("crank0.angle", from_=0.0, to=2 * np.pi, speed=2.0)
    result = md.solve(mechanism, md.Reactions(driver=driver, poses=13, friction="none"))
    phi = result.drivers["crank0.angle"].position
    singular = np.isin(np.arange(13), (0, 6, 12))
    assert (result.status[singular] == "singular").all()
    assert (result.status[~singular] == "ok").all()
    for name in ("beam1", "beam5"):
        own = result.unique[name]
        assert np.asarray(own["directions"]) == pytest.approx(np.array([[0.0, 1.0, 0.0]]))
        values = np.asarray(own["values"])[~singular, 0]
        assert values == pytest.approx(-9.81 / 2 * np.cos(phi[~singular]), abs=1e-10)


@pytest.mark.parametrize("friction", ["article", "coupled"])
def test_a_cycle_over_change_points_has_no_mean_loss(friction: str) -> None:
    mechanism = loaded("change-point-parallelogram", "coupler", 2.0, (1.5, 0.0))
    joints = {
        name: replace(joint, friction=0.1, pin_radius=0.02)
        for name, joint in mechanism.joints.items()
    }
    driver = md.Driver("crank.angle", from_=0.3, to=0.3 + 2 * np.pi, speed=1.0)
    task = md.Reactions(driver=driver, poses=13, friction=friction, cycle=True)
    result = md.solve(replace(mechanism, joints=Table(joints)), task)
    assert "at the change point crank.angle = 180 deg" in result.fault
    assert "loss" not in result.summary
    task = replace(task, friction="none")
    assert md.solve(replace(mechanism, joints=Table(joints)), task).fault is None


def test_the_mean_power_of_masses_is_zero() -> None:
    problem = md.load("slider-crank-inertia").with_values({"Q_work": 0.0, "Q_return": 0.0})
    driver = md.Driver("crank.angle", from_=0.0, to=2 * np.pi, speed=40.0)
    task = md.Reactions(driver=driver, poses=13, friction="none", cycle=True)
    summary = md.solve(problem.mechanism, task).summary
    assert (summary["useful"], summary["input"], summary["loss"]) == (0.0, 0.0, 0.0)
    assert summary["quadrature_error"] < 1e-9
    summary = md.solve(problem.mechanism, replace(task, friction="coupled")).summary
    assert (summary["useful"], summary["efficiency"]) == (0.0, 0.0)
    assert summary["input"] == pytest.approx(summary["loss"], rel=1e-11)


def test_directions_unique_in_all_poses_are_given() -> None:
    """A third crank out of line: where it lies along another the self-stress passes by a joint."""
    mechanism = loaded("parallelogram-three-cranks", "rod", 200.0, (1.6, 0.0))
    result = md.solve(mechanism, turn(13))
    phi = result.drivers["crank.angle"].position
    assert (result.status == "ok").all()
    for joint, frame in (("P", "crank"), ("Q", "middle"), ("R", "rear"), ("A", "crank")):
        own = result.unique[joint]
        assert own["frame"] == frame
        assert np.asarray(own["directions"]) == pytest.approx(np.array([[0.0, 1.0, 0.0]]))
        across = 200 * G * np.cos(phi) if frame == "crank" else 0 * phi
        assert np.asarray(own["values"])[:, 0] == pytest.approx(across, abs=1e-8)
