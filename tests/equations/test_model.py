"""The symbolic model: residuals by hand, derivatives by differences."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.model import Model
from mechdae.equations.space import PLANE


def pair(joint: md.Prismatic, **bodies: dict) -> Mechanism:
    """Return two bodies on pins with one more joint between them."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (1, 0.5)}),
        bodies=[
            md.Body("a", {"O": (0, 0), "A": (0.3, 0.1)}, mass=2, center=(0.2, -0.1), inertia=0.3),
            md.Body("b", {"Q": (0, 0), "B": (-0.2, 0.4)}),
        ],
        joints=[md.Revolute("O", "ground.O", "a.O"), md.Revolute("Q", "ground.Q", "b.Q"), joint],
    )


Q = np.array([0.1, -0.2, 0.7, 0.9, 0.4, -1.3])


def rot(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def ends() -> tuple[np.ndarray, np.ndarray]:
    p1 = Q[:2] + rot(Q[2]) @ [0.3, 0.1]
    p2 = Q[3:5] + rot(Q[5]) @ [-0.2, 0.4]
    return p1, p2


def residual(joint) -> np.ndarray:
    model = Model(pair(joint))
    phi = ca.Function("phi", [model.q, model.p], [model.phi])
    rows = [i for i, row in enumerate(model.rows) if row.owner == "J"]
    return np.array(phi(Q, model.p_values)).ravel()[rows]


def test_residuals_by_hand() -> None:
    p1, p2 = ends()
    gap = p2 - p1
    assert residual(md.Revolute("J", "a.A", "b.B")) == pytest.approx(gap, abs=1e-15)
    direction = Q[2] + 0.3
    normal = np.array([-np.sin(direction), np.cos(direction)])
    expected = [normal @ gap, Q[5] - Q[2] - 0.8]
    slider = md.Prismatic("J", "a.A", "b.B", axis=0.3, turn=0.8)
    assert residual(slider) == pytest.approx(expected, abs=1e-15)
    slot = md.PinInSlot("J", "a.A", "b.B", axis=0.3)
    assert residual(slot) == pytest.approx(expected[:1], abs=1e-15)
    weld = md.Weld("J", "a.A", "b.B", turn=0.8)
    assert residual(weld) == pytest.approx([*gap, expected[1]], abs=1e-15)
    bar = md.Distance("J", "a.A", "b.B", length=0.6)
    assert residual(bar) == pytest.approx([(gap @ gap - 0.36) / 1.2], abs=1e-15)
    gear = md.Gear("J", "a.O", "b.Q", ratio=-1.5, phase=0.2)
    assert residual(gear) == pytest.approx([-1.5 * Q[5] + 0.2 - Q[2]], abs=1e-15)
    for contact, sense in (("external", -1), ("internal", 1)):
        wheels = md.FrictionWheel(
            "J", "a.O", "b.Q", radius=0.3, second_radius=0.45, contact=contact, phase=0.2
        )
        rolled = sense * 0.45 * Q[5] - 0.3 * (Q[2] - 0.2)
        assert residual(wheels) == pytest.approx([rolled], abs=1e-15)


@pytest.mark.parametrize(
    "joint",
    [
        md.Prismatic("J", "a.A", "b.B", axis=0.3, turn=0.8),
        md.PinInSlot("J", "a.A", "b.B", axis=0.3),
        md.Distance("J", "a.A", "b.B", length=0.6),
        md.Gear("J", "a.O", "b.Q", ratio=-1.5),
    ],
)
def test_jacobian_and_gamma_against_differences(joint) -> None:
    model = Model(pair(joint))
    p = model.p_values
    phi = ca.Function("phi", [model.q, model.p], [model.phi])
    phi_q = ca.Function("phi_q", [model.q, model.p], [ca.densify(model.phi_q)])
    gamma = ca.Function("gamma", [model.q, model.velocity, model.p], [model.gamma])
    v = np.array([0.3, -0.5, 1.1, 0.2, 0.8, -0.6])

    def at(t: float) -> np.ndarray:
        return np.array(phi(Q + t * v, p)).ravel()

    h = 1e-3
    slope = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
    bend = (16 * (at(h) + at(-h)) - (at(2 * h) + at(-2 * h)) - 30 * at(0)) / (12 * h * h)
    assert np.array(phi_q(Q, p)) @ v == pytest.approx(slope, abs=1e-10)
    assert np.array(gamma(Q, v, p)).ravel() == pytest.approx(-bend, abs=1e-6)
    assert np.any(np.abs(bend) > 1e-3) or joint.kind == "gear"


def test_mass_matrix_is_the_kinetic_energy() -> None:
    model = Model(pair(md.PinInSlot("J", "a.A", "b.B")))
    mass = ca.Function("M", [model.q, model.p], [ca.densify(model.mass_matrix)])
    v = np.array([0.3, -0.5, 1.1, 0.2, 0.8, -0.6])
    energy = v @ np.array(mass(Q, model.p_values)) @ v / 2
    c = rot(Q[2]) @ [0.2, -0.1]
    centre = v[:2] + v[2] * np.array([-c[1], c[0]])
    assert energy == pytest.approx((2 * centre @ centre + 0.3 * v[2] ** 2) / 2, rel=1e-14)


def test_a_kinematic_task_builds_no_mass_matrix(monkeypatch) -> None:
    built = []
    monkeypatch.setattr(Model, "mass_matrix", property(lambda self: built.append(self)))
    for name in ("slider-crank", "geared-five-bar"):
        md.solve(name)
        md.solve(name, "modes")
    assert built == []


def test_every_number_is_a_parameter() -> None:
    mechanism = md.load("gorshkov-seven-link").mechanism
    model = Model(mechanism)
    assert set(mechanism.parameters) <= set(model.p_names)
    freed = Model(mechanism, free=["crank.A.y", "guide.axis"])
    assert {"crank.A.y", "guide.axis"} <= set(freed.p_names)
    literal = md.load("gorshkov-seven-link").with_values({"crank.A.y": 0.01}).mechanism
    assert "crank.A.y" in Model(literal).p_names


def test_unknown_coordinates_name_the_nearest() -> None:
    mechanism = md.load("slider-crank").mechanism
    for text in ("rod.angel", "rod.C.z", "guide.angle", "ground.O.x", "crank", "B.slide"):
        with pytest.raises(md.InputError):
            coordinate(mechanism, text)


def test_the_plane_moves_points_and_turns_arms() -> None:
    """A twist moves a point like the derivative of its place; power is force times velocity."""
    twist, rate, arm, force = ([0.3, -0.2, 1.7], [0.1, 0.4, -0.9], [0.5, 0.8], [2.0, -3.0])
    velocity = np.array(ca.DM(PLANE.velocity(ca.DM(twist), ca.DM(arm)))).ravel()
    assert velocity == pytest.approx([0.3 - 1.7 * 0.8, -0.2 + 1.7 * 0.5])
    wrench = [*force, PLANE.moment(arm, force)]
    assert np.dot(wrench, twist) == pytest.approx(np.dot(force, velocity))
    acceleration = np.array(ca.DM(PLANE.acceleration(twist, rate, arm))).ravel()
    turned = np.array([-0.9 * -0.8 - 1.7**2 * 0.5, -0.9 * 0.5 - 1.7**2 * 0.8])
    assert acceleration == pytest.approx(np.array(rate[:2]) + turned)
    energy = np.array(ca.DM(PLANE.inertia(2.0, 0.7, arm)))
    assert twist @ energy @ twist == pytest.approx(2.0 * velocity @ velocity + 0.7 * 1.7**2)
    assert PLANE.mobility(3, 4, 0) == 1
