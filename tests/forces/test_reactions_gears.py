"""Forces of gears, racks and planets against hand calculation and free bodies (`force_truth`)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md
from tests.reference.force_truth import Couple, Mass, Pin, Scene, Tooth
from tests.shared.force_cases import reactions

REL = 1e-12
TAN = math.tan(math.radians(20))


# -- gears -----------------------------------------------------------------------------------------


def spur_pair(torque: float, loss: float | None = None, angle: float = 20.0) -> md.Mechanism:
    """Return two wheels in external mesh, pitch radii 0.03 and 0.09, the second loaded."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (0.12, 0)}),
        bodies=[md.Body("pinion", {"O": (0, 0)}), md.Body("wheel", {"Q": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "pinion.O"),
            md.Revolute("Q", "ground.Q", "wheel.Q"),
            md.Gear(
                "mesh",
                "pinion.O",
                "wheel.Q",
                teeth=(20, 60),
                mesh="external",
                pressure_angle=math.radians(angle),
                mesh_loss=loss,
            ),
        ],
        loads=[md.Torque("load", "wheel", torque)],
        sketch={"pinion": 0.0},
    )


@pytest.mark.parametrize("torque", [45.0, -45.0])
@pytest.mark.parametrize("angle", [20.0, 14.5, 0.0])
def test_bearing_loads_of_a_spur_pair(torque: float, angle: float) -> None:
    result = md.solve(
        spur_pair(torque, angle=angle), reactions("pinion.angle", at=[0.0, 1.0], speed=5)
    )
    tangential = torque / 0.09  # on the wheel, at the pitch point (0.03, 0), along y
    apart = abs(tangential) * math.tan(math.radians(angle))
    mesh = [apart, tangential, -torque]
    assert result.efforts["pinion.angle"] == pytest.approx([torque / 3] * 2, rel=REL)
    for name, expected in (
        ("mesh", mesh),
        ("Q", [-apart, -tangential, 0]),
        ("O", [apart, tangential, 0]),
    ):
        assert result.joints[name].reaction == pytest.approx(
            np.array([expected] * 2), rel=REL, abs=1e-11
        )
    size = abs(torque) / (0.09 * math.cos(math.radians(angle)))
    for name in "OQ":
        assert np.hypot(*result.joints[name].reaction[0, :2]) == pytest.approx(size, rel=REL)


@pytest.mark.parametrize("speed", [5.0, -5.0])
@pytest.mark.parametrize("torque", [45.0, -45.0])
def test_loss_of_a_mesh(torque: float, speed: float) -> None:
    """The share is taken of the power that enters, whichever wheel it comes from."""
    task = reactions("pinion.angle", at=[0.3], speed=speed, friction="coupled")
    result = md.solve(spur_pair(torque, loss=0.03), task)
    # the wheel turns against the pinion; the load brakes where its power is negative
    load = torque * -speed / 3
    expected = -load / 0.97 if load < 0 else -load * 0.97
    power = result.efforts["pinion.angle"][0] * speed
    assert power == pytest.approx(expected, rel=REL)
    assert result.joints["mesh"].loss[0] == pytest.approx(power + load, rel=REL)
    assert result.joints["mesh"].loss[0] > 0


def test_bearing_loads_of_an_internal_mesh() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0.06, 0), "Q": (0, 0)}),
        bodies=[md.Body("pinion", {"O": (0, 0)}), md.Body("ring", {"Q": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "pinion.O"),
            md.Revolute("Q", "ground.Q", "ring.Q"),
            md.Gear("mesh", "pinion.O", "ring.Q", teeth=(20, 60), mesh="internal"),
        ],
        loads=[md.Torque("load", "ring", 45)],
        sketch={"pinion": 0.0},
    )
    result = md.solve(mechanism, reactions("pinion.angle", at=[0.2], speed=5))
    # pitch radii 0.03 and 0.09, pitch point (0.09, 0); the ring is pushed outwards there
    tangential = -45 / 0.09
    apart = abs(tangential) * TAN
    assert result.efforts["pinion.angle"][0] == pytest.approx(-15, rel=REL)
    for name, expected in (
        ("mesh", [apart, tangential, -45]),
        ("Q", [-apart, -tangential, 0]),
        ("O", [apart, tangential, 0]),
    ):
        assert result.joints[name].reaction[0] == pytest.approx(expected, rel=REL, abs=1e-11)


SUN, PLANET, RING = 0.024, 0.018, 0.060


def planetary(
    output: float, loss: float | None = None, mass: float | None = None, ring_first: bool = False
) -> md.Mechanism:
    """Return sun, one planet, ring at rest; z = 24, 18, 60, module 2 mm; load on the carrier."""
    ring_ends = ("ground.S", "planet.P") if ring_first else ("planet.P", "ground.S")
    ring_teeth = (60, 18) if ring_first else (18, 60)
    return md.Mechanism(
        ground=md.Ground({"S": (0, 0)}),
        bodies=[
            md.Body("sun", {"S": (0, 0)}),
            md.Body("carrier", {"S": (0, 0), "P": (SUN + PLANET, 0)}),
            md.Body("planet", {"P": (0, 0)}, mass=mass),
        ],
        joints=[
            md.Revolute("S", "ground.S", "sun.S"),
            md.Revolute("C", "ground.S", "carrier.S"),
            md.Revolute("P", "carrier.P", "planet.P"),
            md.Gear(
                "inner",
                "sun.S",
                "planet.P",
                carrier="carrier",
                teeth=(24, 18),
                mesh="external",
                mesh_loss=loss,
            ),
            md.Gear(
                "outer",
                *ring_ends,
                carrier="carrier",
                teeth=ring_teeth,
                mesh="internal",
                mesh_loss=loss,
            ),
        ],
        loads=[md.Torque("load", "carrier", output)],
        sketch={"sun": 0.0},
    )


@pytest.mark.parametrize("ring_first", [False, True])
@pytest.mark.parametrize("output", [-84.0, 84.0])
def test_forces_of_a_planetary_gear(output: float, ring_first: bool) -> None:
    """Textbook: both meshes of the planet carry the same force, its pin twice as much."""
    at = np.array([0.0, 0.7, 3.0])
    result = md.solve(
        planetary(output, ring_first=ring_first), reactions("sun.angle", at=at, speed=7)
    )
    carrier = result.bodies["carrier"].angle
    assert np.diff(carrier) == pytest.approx(np.diff(at) * 24 / 84, rel=REL)
    sun = -output * 24 / 84
    assert result.efforts["sun.angle"] == pytest.approx([sun] * 3, rel=REL)
    out = np.exp(1j * carrier)
    tangential = sun / SUN  # force on the planet at the sun, along i out
    apart = abs(tangential) * TAN
    inner = tangential * 1j * out + apart * out
    outer = tangential * 1j * out - apart * out  # on the planet, pushed inwards by the ring
    pin = -2 * tangential * 1j * out
    joints = result.joints
    sign = -1 if ring_first is False else 1  # the reaction acts on the second body
    for name, force, turn in (
        ("inner", inner, -PLANET * tangential),
        ("outer", sign * outer, PLANET * tangential if ring_first else -RING * tangential),
        ("P", pin, 0.0),
        ("S", inner, 0.0),
        ("C", pin, 0.0),
    ):
        found = joints[name].reaction
        gap = np.abs(found[:, 0] + 1j * found[:, 1] - force)
        assert gap.max() <= REL * 4 * abs(tangential), name
        assert found[:, 2] == pytest.approx([turn] * 3, rel=REL, abs=1e-11), name
    # the ring holds what sun and carrier do not
    assert RING * tangential == pytest.approx(-output - sun, rel=REL)


def test_the_planets_pin_carries_the_planet_round() -> None:
    w, mass = 70.0, 0.4
    result = md.solve(
        planetary(-84.0, mass=mass), reactions("sun.angle", at=[0.7], speed=w, parts=("inertial",))
    )
    out = np.exp(1j * result.bodies["carrier"].angle[0])
    centripetal = -mass * (w * 24 / 84) ** 2 * (SUN + PLANET) * out
    found = result.joints["P"].reaction[0]
    pin = -2 * 24 / SUN * 1j * out + centripetal
    assert abs(complex(*found[:2]) - pin) <= REL * abs(pin)
    moved = result.joints["P"].reaction_inertial[0]
    assert abs(complex(*moved[:2]) - centripetal) <= REL * abs(pin)


@pytest.mark.parametrize("ring_first", [False, True])
def test_efficiency_of_a_planetary_gear_in_both_directions(ring_first: bool) -> None:
    """The meshes lose their share of the power that rolls through them, seen from the carrier."""
    zeta = 0.02
    through = (1 - zeta) ** 2
    task = reactions("sun.angle", at=[0.5], speed=10, friction="coupled")
    drives = md.solve(planetary(-84.0, zeta, ring_first=ring_first), task)
    ratio = 60 / 24
    # sun drives the carrier: output over input
    eta = (1 + ratio * through) / (1 + ratio)
    given = drives.efforts["sun.angle"][0] * 10
    assert 84 * 10 * 24 / 84 / given == pytest.approx(eta, rel=REL)
    lost = drives.joints["inner"].loss[0] + drives.joints["outer"].loss[0]
    assert lost == pytest.approx(given - 240, rel=REL)
    # of what enters each: the rolling power is T_s (w_s - w_c)
    rolling = given * (1 - 24 / 84)
    assert drives.joints["inner"].loss[0] == pytest.approx(zeta * rolling, rel=REL)
    assert drives.joints["outer"].loss[0] == pytest.approx(zeta * (1 - zeta) * rolling, rel=REL)
    # the carrier drives the sun
    driven = md.solve(planetary(84.0, zeta, ring_first=ring_first), task)
    back = (1 + ratio) / (1 + ratio / through)
    assert -driven.efforts["sun.angle"][0] * 10 / 240 == pytest.approx(back, rel=REL)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("load", [300.0, -300.0])
def test_rack_and_pinion(side: int, load: float) -> None:
    radius = side * 0.05
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (0, -radius)}),
        bodies=[md.Body("pinion", {"O": (0, 0)}), md.Body("rack", {"R": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "pinion.O"),
            md.Prismatic("guide", "ground.G", "rack.R"),
            md.Rack("mesh", "pinion.O", "rack.R", radius=radius),
        ],
        loads=[md.Force("load", "rack.R", (load, 0))],
        sketch={"pinion": 0.0},
    )
    at = np.array([0.0, 0.6])
    result = md.solve(mechanism, reactions("pinion.angle", at=at, speed=2))
    assert result.efforts["pinion.angle"] == pytest.approx([-load * radius] * 2, rel=REL)
    apart = -side * abs(load) * TAN  # the rack is pushed away from the pinion
    travel = result.joints["guide"].slide
    assert travel == pytest.approx(radius * at, rel=REL, abs=1e-15)
    joints = result.joints
    for k in range(2):
        assert joints["O"].reaction[k] == pytest.approx([-load, apart, 0], rel=REL, abs=1e-11)
        assert joints["mesh"].reaction[k, :2] == pytest.approx([-load, apart], rel=REL, abs=1e-11)
        # the force passes the rack's point at the pitch point, under the pinion's centre
        assert joints["mesh"].reaction[k, 2] == pytest.approx(
            -travel[k] * apart, rel=REL, abs=1e-11
        )
        assert joints["guide"].reaction[k] == pytest.approx(
            [0, -apart, travel[k] * apart], rel=REL, abs=1e-11
        )
    size = abs(load) / math.cos(math.radians(20))
    assert np.hypot(*joints["O"].reaction[0, :2]) == pytest.approx(size, rel=REL)


def test_free_bodies_reproduce_the_spur_pair() -> None:
    # the elementary formula by the general scene: T/(r cos alpha)
    scene = Scene(
        1,
        {"pinion": Mass(), "wheel": Mass()},
        {
            "O": Pin("ground", "pinion", 0j),
            "Q": Pin("ground", "wheel", 0.12 + 0j),
            "mesh": Tooth("pinion", "wheel", 0.03 + 0j, 1j, 1 + 0j, math.radians(20)),
            "T": Couple("ground", "pinion"),
        },
        [("wheel", 0.12 + 0j, 0j, -45.0)],
    )
    found = scene.solve()
    assert float(found["T"][0]) == pytest.approx(-15, rel=1e-15)
    assert float(abs(found["O"][0])) == pytest.approx(
        45 / (0.09 * math.cos(math.radians(20))), rel=1e-14
    )


# -- a gear that locks itself ----------------------------------------------------------------------


def reducer(zeta: float, **torques: float) -> md.Mechanism:
    """Return carrier, sun at rest (50 teeth), planet (50 and 49), second sun (51)."""
    return md.Mechanism(
        ground=md.Ground({"S": (0, 0)}),
        bodies=[
            md.Body("carrier", {"S": (0, 0), "P": (0.1, 0)}),
            md.Body("planet", {"P": (0, 0)}),
            md.Body("out", {"S": (0, 0)}),
        ],
        joints=[
            md.Revolute("C", "ground.S", "carrier.S"),
            md.Revolute("P", "carrier.P", "planet.P"),
            md.Revolute("Q", "ground.S", "out.S"),
            md.Gear(
                "fixed",
                "ground.S",
                "planet.P",
                carrier="carrier",
                teeth=(50, 50),
                mesh="external",
                mesh_loss=zeta,
            ),
            md.Gear(
                "moving",
                "out.S",
                "planet.P",
                carrier="carrier",
                teeth=(51, 49),
                mesh="external",
                mesh_loss=zeta,
            ),
        ],
        loads=[md.Torque(f"on_{body}", body, torque) for body, torque in torques.items()],
        sketch={"carrier": 0.0},
    )


I0 = 49 / 51


def test_a_reducer_and_its_efficiency() -> None:
    zeta = 0.02
    through = (1 - zeta) ** 2
    task = reactions("carrier.angle", at=[0.4], speed=100, friction="coupled")
    result = md.solve(reducer(zeta, out=-10.0), task)
    assert result.bodies["out"].angular_velocity[0] == pytest.approx(100 * (1 - I0), rel=REL)
    # seen from the carrier the loaded sun drives the one at rest
    assert result.efforts["carrier.angle"][0] == pytest.approx(10 * (1 - through * I0), rel=REL)
    lost = result.joints["fixed"].loss[0] + result.joints["moving"].loss[0]
    eta = (1 - I0) / (1 - through * I0)
    assert 1 - lost / (result.efforts["carrier.angle"][0] * 100) == pytest.approx(eta, rel=1e-11)


@pytest.mark.parametrize("zeta", [0.0195, 0.02])
def test_a_reducer_locks_against_its_output(zeta: float) -> None:
    through = (1 - zeta) ** 2
    speed = 100 * (1 - I0)
    task = reactions("out.angle", at=[0.01], speed=speed, friction="coupled")
    result = md.solve(reducer(zeta, carrier=-0.5), task)
    if through > I0:
        assert list(result.status) == ["ok"]
        near = 1 - I0 / through
        expected = 0.5 / near
        assert result.efforts["out.angle"][0] == pytest.approx(expected, rel=REL / near)
    else:
        assert list(result.status) == ["jammed"]
        (entry,) = result.summary["jammed"]
        assert entry["critical_factor"] == pytest.approx((1 - math.sqrt(I0)) / zeta, rel=1e-9)
