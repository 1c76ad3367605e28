"""Gears and racks in space: forces at the pitch point against closed forms and free bodies."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, pi, radians, sin, sqrt, tan
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.attack.spatial_honesty import random_turn
from tests.shared.spatial_forces import massive
from tests.shared.spatial_gears import ALPHA, planets, teeth_as_contacts, teeth_of_planets

REL = 1e-12
SPIN = md.Driver("V.angle", at=[0.0, 1.3], speed=2.0)
Z1, Z2, R1, TORQUE = 18, 45, 0.03, 50.0


def wheels(
    mesh: Any, axes: Any, places: Any, points: Any, torque: float = TORQUE, **more: Any
) -> md.Mechanism:
    """Return a driven wheel and a loaded one in the frame; `points` are those of the mesh."""
    turns = [{"axis": axis} for axis in axes]
    ground = {"A": places[0], "B": places[1]}
    if "pitch" in more:
        ground["P"] = more["pitch"]
    load = md.Torque("load", "two", np.array(axes[1]) / np.linalg.norm(axes[1]) * torque)
    return md.Mechanism(
        dimension=3,
        ground=md.Ground(ground),
        bodies=[
            md.Body("one", {"A": [0, 0, 0], "M": points[0]}),
            md.Body("two", {"B": [0, 0, 0], "M": points[1]}),
        ],
        joints=[
            md.SpatialRevolute("V", "ground.A", "one.A", **turns[0]),
            md.SpatialRevolute("W", "ground.B", "two.B", **turns[1]),
            mesh,
        ],
        loads=[load],
        sketch={"V": 0},
    )


def gear(**keys: Any) -> md.SpatialGear:
    given = {"teeth": (Z1, Z2), "mesh": "external"} | keys
    if "ratio" in keys:
        given = keys
    return md.SpatialGear("mesh", "one.M", "two.M", **given)


def checked(result: md.Result) -> md.Result:
    assert result.fault is None
    assert set(result.status) == {"ok"}
    assert max(v for v in result.checks.values() if v is not None) < 1e-13
    return result


def on_second(result: md.Result) -> Any:
    """Return the force of the teeth on the second wheel, at the first pose."""
    assert result.joints["mesh"].reaction[1] == pytest.approx(
        result.joints["mesh"].reaction[0], rel=1e-10, abs=1e-10
    )  # the frame holds both wheels: the load stands still
    return result.joints["mesh"].reaction[0]


# -- closed forms --------------------------------------------------------------------------------


@pytest.mark.parametrize("helix", [None, 25.0, -25.0])
@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_parallel_axes(helix: float | None, torque: float) -> None:
    """Tangential T/r, radial T/r tan(alpha)/cos(beta), axial T/r tan(beta)."""
    centres, height = R1 * (1 + Z2 / Z1), 0.2
    keys = {} if helix is None else {"helix": radians(helix)}
    points = ([0, 0, height], [0, 0, height - 0.1])
    mechanism = wheels(
        gear(**keys), 2 * [[0, 0, 3]], ([0, 0, 0], [centres, 0, 0.1]), points, torque
    )
    result = checked(md.solve(mechanism, md.Reactions(driver=SPIN)))
    r2, beta = R1 * Z2 / Z1, radians(helix or 0.0)
    F = torque / r2  # at P, (-r2, 0, .) from the second axis: it balances the load
    wanted = np.array([abs(F) * tan(ALPHA) / cos(beta), F, F * tan(beta)])
    reaction = on_second(result)
    # right-handed teeth of the first wheel climb (0, sin, cos): the force across them is (0, c, -s)
    assert reaction[:3] == pytest.approx(wanted * [1, 1, -1], rel=REL, abs=1e-10)
    assert result.efforts["V.angle"] == pytest.approx([torque * Z1 / Z2] * 2, rel=REL)
    P = np.array([R1, 0, height])
    assert result.joints["V"].reaction[0, :3] == pytest.approx(reaction[:3], rel=REL, abs=1e-10)
    carried = np.cross(P, reaction[:3]) * [1, 1, 0]
    assert result.joints["V"].reaction[0, 3:] == pytest.approx(carried, rel=REL, abs=1e-10)


def test_axes_of_opposite_sense_are_the_same_wheels() -> None:
    centres = R1 * (1 + Z2 / Z1)
    places, points = ([0, 0, 0], [centres, 0, 0]), ([0, 0, 0], [0, 0, 0])
    up = wheels(gear(), 2 * [[0, 0, 1]], places, points)
    down = wheels(gear(ratio=Z2 / Z1), [[0, 0, 1], [0, 0, -1]], places, points, -TORQUE)
    found = [on_second(md.solve(own, md.Reactions(driver=SPIN))) for own in (up, down)]
    assert found[0] == pytest.approx(found[1], rel=REL, abs=1e-10)


@pytest.mark.parametrize("ring", [1, 2])
def test_internal_wheels_push_the_ring_outwards(ring: int) -> None:
    """The pitch point lies beyond the smaller wheel; what pushes apart leaves the ring."""
    counts = (60, 24) if ring == 1 else (24, 60)
    r1 = 0.03
    r2 = r1 * counts[1] / counts[0]
    mesh = gear(teeth=counts, mesh="internal")
    places = ([0, 0, 0], [r1 - r2, 0, 0])
    result = md.solve(
        wheels(mesh, 2 * [[0, 0, 1]], places, 2 * [[0, 0, 0]]), md.Reactions(driver=SPIN)
    )
    reaction = on_second(checked(result))
    F = -TORQUE / r2  # P is at (r2, 0, 0) from the second centre
    outwards = 1 if ring == 2 else -1
    wanted = [outwards * abs(F) * tan(ALPHA), F, 0]
    assert reaction[:3] == pytest.approx(wanted, rel=REL, abs=1e-10)


@pytest.mark.parametrize("shaft", [90.0, 60.0, 110.0])
@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_axes_that_meet(shaft: float, torque: float) -> None:
    """Radial T tan(alpha) cos(delta), axial T tan(alpha) sin(delta), off the apex."""
    S = radians(shaft)
    turn = random_turn(np.random.default_rng(int(shaft)))
    apex = np.array([0.3, -0.2, 0.1])
    a1, b1 = turn[:, 2], turn[:, 0]
    a2 = cos(S) * a1 + sin(S) * b1
    delta1, delta2 = (atan2(sin(S), i + cos(S)) for i in (Z2 / Z1, Z1 / Z2))
    assert delta1 + delta2 == pytest.approx(S, rel=1e-14)
    P = apex + R1 / sin(delta1) * (cos(delta1) * a1 + sin(delta1) * b1)
    b2 = (P - apex) - a2 * (a2 @ (P - apex))
    r2, b2 = np.linalg.norm(b2), b2 / np.linalg.norm(b2)
    assert r2 == pytest.approx(R1 * Z2 / Z1, rel=1e-13)
    places = (apex + 0.1 * a1, apex + 0.15 * a2)
    mechanism = wheels(gear(radius=R1), (a1, a2), places, 2 * [[0, 0, 0]], torque)
    result = checked(md.solve(mechanism, md.Reactions(driver=SPIN)))
    along = np.cross(a2, b2)
    F = -torque / r2
    radial, axial = abs(F) * tan(ALPHA) * cos(delta2), abs(F) * tan(ALPHA) * sin(delta2)
    wanted = F * along - radial * b2 + axial * a2
    reaction = on_second(result)
    assert reaction[:3] == pytest.approx(wanted, rel=1e-11, abs=1e-9)
    moment = np.cross(P - (apex + 0.15 * a2), wanted)
    assert reaction[3:] == pytest.approx(moment, rel=1e-11, abs=1e-9)
    assert result.efforts["V.angle"] == pytest.approx([torque * Z1 / Z2] * 2, rel=1e-11)
    # a point of the carrier says the same place
    given = wheels(gear(point="ground.P"), (a1, a2), places, 2 * [[0, 0, 0]], torque, pitch=P)
    other = md.solve(given, md.Reactions(driver=SPIN))
    assert on_second(other) == pytest.approx(reaction, rel=1e-10, abs=1e-9)


def crossed(helix: float, pitch_helix: float = 0.4, torque: float = TORQUE) -> md.Mechanism:
    """Return wheels whose axes cross at right angles; the ratio belongs to `pitch_helix`."""
    r1, r2 = 0.03, 0.05
    mesh = gear(ratio=r2 * tan(pitch_helix) / r1, point="ground.P", helix=helix)
    places = ([0, 0, 0], [0, r1 + r2, 0])
    axes = ([0, 0, 1], [1, 0, 0])
    return wheels(mesh, axes, places, 2 * [[0, 0, 0]], torque, pitch=[0, r1, 0])


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_axes_that_cross(torque: float) -> None:
    """Of right-handed teeth with helix angles b and 90 deg - b."""
    b, r1, r2 = 0.4, 0.03, 0.05
    result = checked(md.solve(crossed(b, b, torque), md.Reactions(driver=SPIN)))
    reaction = on_second(result)
    # about x through (0, r1 + r2, 0) the force (., ., Fz) at P has the moment -r2 Fz
    across = torque / (r2 * sin(b))
    wanted = across * np.array([cos(b), 0, sin(b)]) + abs(across) * tan(ALPHA) * np.array([0, 1, 0])
    assert reaction[:3] == pytest.approx(wanted, rel=REL, abs=1e-9)
    assert result.efforts["V.angle"][0] == pytest.approx(-r1 * across * cos(b), rel=REL)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_rack(sense: float) -> None:
    """The wheel rolls on the side of the rack that its radius tells."""
    radius, push = 0.04 * sense, 120.0
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "B": [0.1, 0, 0]}),
        bodies=[
            md.Body("one", {"A": [0, 0, 0], "M": [0, 0, 0.02]}),
            md.Body("two", {"B": [0, 0, 0]}),
        ],
        joints=[
            md.SpatialRevolute("V", "ground.A", "one.A", axis=[0, 0, 1]),
            md.SpatialPrismatic("W", "ground.B", "two.B", axis=[1, 0, 0]),
            md.SpatialRack("mesh", "one.M", "two.B", radius=radius),
        ],
        loads=[md.Force("load", "two.B", [-push, 0, 0])],
        sketch={"V": 0},
    )
    result = checked(md.solve(mechanism, md.Reactions(driver=SPIN)))
    assert result.efforts["V.angle"] == pytest.approx([push * radius] * 2, rel=REL)
    force = result.joints["mesh"].reaction[0, :3]
    # v = w z x r = w radius x at r = -radius y; teeth push the rack away from the wheel
    assert force == pytest.approx([push, -sense * push * tan(ALPHA), 0], rel=REL, abs=1e-10)
    arm = np.array([0, -radius, 0.02])
    wanted = np.cross(arm, force) * [1, 1, 0]
    assert result.joints["V"].reaction[0, 3:] == pytest.approx(wanted, rel=REL, abs=1e-10)


# -- trains as free bodies -----------------------------------------------------------------------


def agrees(result: md.Result, k: int, teeth: dict[str, Any]) -> None:
    reactions, efforts, left = teeth_as_contacts(result, k, teeth)
    assert left < REL
    size = max(float(np.abs(own).max()) for own in reactions.values())
    for name, own in reactions.items():
        assert np.abs(result.joints[name].reaction[k] - own).max() < REL * size, name
    drivers = result.definition.drivers
    ours = [result.efforts[driver.coordinate][k] for driver in drivers]
    assert np.abs(np.array(ours) - efforts).max() < REL * size


def test_a_planetary_train_of_heavy_bodies() -> None:
    driver = md.Driver("C.angle", at=[0.3, 2.0], speed=7.0, acceleration=-4.0)
    result = checked(md.solve(massive(planets(), seed=5), md.Reactions(drivers=[driver])))
    for k, angle in enumerate([0.3, 2.0]):
        agrees(result, k, teeth_of_planets(angle))


@pytest.mark.parametrize("torque", [10.0, -10.0])
def test_losses_of_a_planetary_train(torque: float) -> None:
    """Mueller: T_c = -T_s (1 - i0 eta0), i0 = -z_r/z_s, eta0 of both meshes or its inverse."""
    loss, i0 = 0.03, -60 / 24
    mechanism = planets(loss, loads=[md.Torque("in", "sun", [0, 0, torque])])
    driver = md.Driver("C.angle", at=[0.0, 1.0], speed=3.0)
    result = checked(md.solve(mechanism, md.Reactions(driver=driver)))
    eta0 = (1 - loss) ** 2
    share = eta0 if torque > 0 else 1 / eta0  # the sun turns forward in the carrier
    assert result.efforts["C.angle"] == pytest.approx([-torque * (1 - i0 * share)] * 2, rel=1e-12)
    lost = result.joints["inner"].loss + result.joints["ring"].loss
    speed = 3.0 * (1 - i0)  # of the sun
    assert lost == pytest.approx(torque * speed + result.efforts["C.angle"] * 3.0, rel=1e-11)


def test_losses_of_axes_that_meet() -> None:
    """The share is lost whichever wheel drives; the couple lies along the common generatrix."""
    loss, places = 0.05, ([0.1, 0, 0], [0, 0.15, 0])
    for torque in (TORQUE, -TORQUE):
        mesh = gear(radius=R1, mesh_loss=loss)
        mechanism = wheels(mesh, ([1, 0, 0], [0, 1, 0]), places, 2 * [[0, 0, 0]], torque)
        result = checked(md.solve(mechanism, md.Reactions(driver=SPIN)))
        speed = -2.0 * Z1 / Z2  # the load takes power where it turns the other way
        taken = -torque * speed
        given = result.efforts["V.angle"][0] * 2.0
        if taken > 0:
            assert taken == pytest.approx(given * (1 - loss), rel=1e-12)
        else:
            assert -given == pytest.approx(-taken * (1 - loss), rel=1e-12)
        assert result.joints["mesh"].loss[0] == pytest.approx(given - taken, rel=1e-11)
        free = md.solve(mechanism, md.Reactions(driver=SPIN, friction="none"))
        # couple on the wheels: against w2 - w1, along the line through apex and pitch point
        force, moment = result.joints["mesh"].reaction[0].reshape(2, 3)
        P = R1 * np.array([Z2 / Z1, 1, 0])
        couple = moment - np.cross(P - places[1], force)
        line = P / np.linalg.norm(P)
        assert np.cross(line, couple) == pytest.approx([0, 0, 0], abs=1e-10)
        turning = np.array([-2.0, speed, 0])
        assert -couple @ turning == pytest.approx(result.joints["mesh"].loss[0], rel=1e-11)
        assert abs(free.efforts["V.angle"][0]) == pytest.approx(TORQUE * Z1 / Z2, rel=1e-12)


def test_a_bevel_differential_of_heavy_bodies() -> None:
    problem = md.load("bevel-differential")
    keys = {"left_mesh": {"radius": 0.024}, "right_mesh": {"radius": 0.024}}
    joints = {n: replace(j, **keys.get(n, {})) for n, j in problem.mechanism.joints.items()}
    mechanism = massive(replace(problem.mechanism, joints=Table(joints)), seed=9)
    drivers = [
        md.Driver("cage_pin.angle", at=[0.4, 1.0], speed=5.0, acceleration=2.0),
        md.Driver("left_pin.angle", at=[0.1, 0.7], speed=-3.0, acceleration=1.0),
    ]
    result = checked(md.solve(mechanism, md.Reactions(drivers=drivers)))
    for k, turn in enumerate([0.4, 1.0]):
        x, y, z = (
            np.array([cos(turn), 0, -sin(turn)]),
            np.eye(3)[1],
            np.array([sin(turn), 0, cos(turn)]),
        )
        teeth = {}
        for name, s in (("left_mesh", -1), ("right_mesh", 1)):
            P = 0.024 * (x * 1.0 + s * y * 2 / 3)
            P = 0.024 * x + s * 0.016 * y  # radii 24 and 16 of side gear and planet
            n = np.array([16, 24]) / sqrt(16**2 + 24**2)
            inwards = n[0] * x - s * n[1] * y  # across the generatrix, to the planet's side
            teeth[name] = (P, [c * cos(ALPHA) * z + sin(ALPHA) * inwards for c in (1, -1)])
        agrees(result, k, teeth)


def test_a_differential_splits_the_torque_evenly() -> None:
    """Without masses both sides get one torque, whatever their speeds are."""
    problem = md.load("bevel-differential")
    result = checked(md.solve(problem, "loads"))
    left, right = (problem.mechanism.values()[f"T_{side}"] for side in ("left", "right"))
    assert result.efforts["left_pin.angle"] == pytest.approx([left - right] * 2, rel=REL)
    for name in ("left_mesh", "right_mesh"):
        force, moment = result.joints[name].reaction[:, :3], result.joints[name].reaction[:, 3:]
        turned = result.points["planet.P"].position
        about_y = (moment + np.cross(turned, force))[:, 1]
        assert np.abs(about_y) == pytest.approx([right] * 2, rel=REL)


# -- what is refused -----------------------------------------------------------------------------

FLAT = {"places": ([0, 0, 0], [0.1, 0, 0]), "axes": 2 * [[0, 0, 1]]}
MEET = {"places": ([0.1, 0, 0], [0, 0.15, 0]), "axes": ([1, 0, 0], [0, 1, 0])}
REFUSED = {
    "one line": (gear(), FLAT | {"places": ([0, 0, 0], [0, 0, 0.1])}, "", "no teeth"),
    "no pitch point": (gear(ratio=1.0), FLAT, "ratio", "no pitch point"),
    "heights": (gear(), FLAT | {"points": ([0, 0, 0], [0, 0, 0.02])}, "between", "heights"),
    "no radius": (gear(), MEET, "radius", "mean pitch radius"),
    "apex": (
        gear(radius=0.03), {"places": 2 * ([0, 0, 0],), "axes": MEET["axes"]}, "between", "apex"
    ),
    "no point": (gear(), FLAT | {"axes": ([0, 0, 1], [0, 1, 1])}, "point", "cross"),
    "point beside": (gear(point="ground.P"), FLAT | {"pitch": [0.05, 0, 0]}, "point", "do not run"),
    "point of a wheel": (gear(point="one.M"), FLAT, "point", "point of the carrier"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_teeth_that_have_no_place_are_refused(name: str) -> None:
    mesh, lies, key, message = REFUSED[name]
    keys = {"points": 2 * [[0, 0, 0]]} | lies
    with pytest.raises(md.InputError, match=message) as told:
        md.solve(wheels(mesh, **keys), md.Reactions(driver=SPIN))
    assert told.value.where == ("joints.mesh" + (f".{key}" if key else ""))


def test_a_helix_that_does_not_run_is_refused_with_the_one_that_does() -> None:
    with pytest.raises(md.MechanismError, match="do not run with its ratio") as told:
        md.solve(crossed(0.5, 0.4), md.Reactions(driver=SPIN))
    assert told.value.where == "joints.mesh.helix"
    assert told.value.hint.startswith(f"helix_deg = {np.degrees(0.4):.6g}")


def test_a_wheel_that_slides_has_no_forces() -> None:
    mechanism = wheels(gear(), **FLAT, points=2 * [[0, 0, 0]])
    sliding = md.Cylindrical("W", "ground.B", "two.B", axis=[0, 0, 1])
    mechanism = replace(mechanism, joints=mechanism.joints.with_("W", sliding))
    drivers = [SPIN, md.Driver("W.slide", at=[0.0, 0.1], speed=1.0)]
    with pytest.raises(md.UnavailableError, match="revolute joint of two"):
        md.solve(mechanism, md.Reactions(drivers=drivers))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"radius": -0.1}, "radius is not above zero"),
        ({"helix": pi / 2}, "helix is 90 degrees or more"),
        ({"pressure_angle": 2.0}, "pressure_angle is 90 degrees or more"),
    ],
)
def test_teeth_that_bear_nothing_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(md.MechanismError, match=message):
        wheels(gear(**keys), **MEET, points=2 * [[0, 0, 0]])
