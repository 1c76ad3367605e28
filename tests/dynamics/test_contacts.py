"""Motions with stops: impacts, contacts that last, several at once, against closed forms."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import InputError, MechanismError, UnavailableError
from tests.shared.bouncing import (
    G,
    along_teeth,
    ball,
    carriage,
    disc,
    hits,
    one_block,
    rubbing_slope,
    single_impacts,
    turned_rack,
    two_blocks,
    wheel_and_rack,
)
from tests.shared.paths import ROOT


def test_a_ball_bounces_until_it_lies_still() -> None:
    """Times 2 v e^k / g between impacts, whose sum is finite: what is left out of it is told."""
    e, first = 0.5, math.sqrt(2 / G)
    result = md.solve(from_dict(ball(e, 2.0)), "m")
    times = hits(result)
    assert len(times) == 20
    expected = [first * (1 + 2 * sum(e**j for j in range(1, k + 1))) for k in range(20)]
    assert times == pytest.approx(expected, abs=1e-12)
    (contact,) = [event for event in result.events if event["kind"] == "contact"]
    assert contact["at"] + contact["left_out"] == pytest.approx(first * (1 + e) / (1 - e), abs=1e-9)
    assert "rebounds" in result.summary["notes"][0]
    assert result.work["impacts.floor"][-1] == pytest.approx(-2 * G, rel=1e-9)
    assert result.checks["energy"] <= 1e-12
    floor = result.joints["floor"]
    assert floor.contact_force[[0, -1]] == pytest.approx([0, 2 * G], abs=1e-12)
    assert floor.gap[[0, -1]] == pytest.approx([1, 0], abs=1e-11)
    assert floor.reaction[-1] == pytest.approx([0, 2 * G, 0], abs=1e-11)
    first_hit = result.events[0]
    assert first_hit["speed"] == pytest.approx(G * first, rel=1e-12)
    assert first_hit["impulse"] == pytest.approx(2 * 1.5 * G * first, rel=1e-12)


@pytest.mark.parametrize(
    "count", [50, pytest.param(1000, marks=pytest.mark.slow(reason="a thousand impacts"))]
)
def test_an_elastic_ball_keeps_its_energy(count: int) -> None:
    first = math.sqrt(2 / G)
    until = first * 2 * count
    result = md.solve(from_dict(ball(1.0, until, poses=2)), "m")
    times = hits(result)
    assert len(times) == count
    assert times == pytest.approx([(2 * k + 1) * first for k in range(count)], rel=1e-10)
    assert result.scalars["energy"] == pytest.approx(2 * G, rel=1e-10)


@pytest.mark.parametrize("method", ["bdf", "radau"])
def test_methods_for_stiff_forces_meet_stops_too(method: str) -> None:
    result = md.solve(from_dict(ball(0.5, 1.0, method=method, tolerance=1e-10)), "m")
    first = math.sqrt(2 / G)
    assert hits(result)[:2] == pytest.approx([first, 2 * first], abs=1e-7)
    assert result.checks["energy"] <= 1e-6


def test_joints_that_rub_hit_stops_too() -> None:
    """Down a slope of 60 degrees with friction 0.1 in the guide, then up against it."""
    slope, mu = math.pi / 3, 0.1
    result = md.solve(from_dict(rubbing_slope(slope, mu, 0.5, 1.2)), "m")
    down, up = (G * (math.sin(slope) - side * mu * math.cos(slope)) for side in (1, -1))
    first = math.sqrt(2 / down)
    speed = 0.5 * down * first
    second = first + speed / up + speed / math.sqrt(up * down)
    assert hits(result)[:2] == pytest.approx([first, second], abs=1e-10)
    assert hits(result, "reversal")[0] == pytest.approx(first + speed / up, abs=1e-10)
    assert result.checks["energy"] <= 1e-11


@pytest.mark.parametrize("slope", [0.3, 0.7, 1.0, 1.2, 1.5, math.pi / 2])
@pytest.mark.parametrize(("mu", "e"), [(0.1, 0.0), (0.15, 0.5)])
def test_what_rubs_rests_at_a_stop(slope: float, mu: float, e: float) -> None:
    """Stop and friction share what pulls down: only their sum is unique, but without a load."""
    result = md.solve(from_dict(rubbing_slope(slope, mu, e, 20.0)), "m")
    assert result.fault is None
    down, up = (G * (math.sin(slope) - side * mu * math.cos(slope)) for side in (1, -1))
    first, share = math.sqrt(2 / down), e * math.sqrt(down / up)  # of speeds, by rise and fall
    flights = e * down * first / up * (1 + math.sqrt(up / down)) / (1 - share)
    (contact,) = [event for event in result.events if event["kind"] == "contact"]
    assert contact["at"] == result.summary["rests_from"]
    assert contact["at"] == pytest.approx(first + flights, abs=1e-5 if e else 1e-11)
    floor = result.joints["floor"]
    assert floor.reaction[-1, :2] == pytest.approx([0, 2 * G], abs=1e-9)
    if slope == math.pi / 2:
        assert floor.contact_force[-1] == pytest.approx(2 * G, abs=1e-9)
    else:
        assert math.isnan(floor.contact_force[-1])
        assert "forces of contacts of floor are not unique" in said(result)


def test_what_rubs_leaves_a_stop_when_all_forces_pass_zero() -> None:
    """A vertical load 30 sin(5 t) less the weight presses and pulls at once."""
    for slope, mu in (0.3, 0.1), (1.0, 0.5), (math.pi / 2, 0.1):
        data = rubbing_slope(slope, mu, 0.0, 1.7)
        data["loads"] = {"F": {"kind": "force", "point": "ball.P", "value": [0, "30*sin(5*t)"]}}
        result = md.solve(from_dict(data), "m")
        assert result.fault is None
        release = (math.asin(2 * G / 30) + 2 * math.pi) / 5
        assert hits(result, "release") == pytest.approx([release], abs=1e-11)
        after = result.time > release
        late, angle = result.time[after] - release, 5 * result.time[after]
        turn = 3 * math.cos(5 * release) * late - 0.6 * (np.sin(angle) - math.sin(5 * release))
        rate = math.sin(slope) - mu * math.cos(slope)
        expected = (turn - G * late**2 / 2) * rate
        assert result.joints["floor"].slide[after] == pytest.approx(expected, abs=1e-9)


def test_a_closed_contact_has_no_linear_system() -> None:
    with pytest.raises(UnavailableError, match="a contact is closed"):
        md.solve(from_dict(ball(0.5, 2.0, linearise=1.9)), "m")


def elliptic(k: float) -> float:
    """Return the complete elliptic integral K(k) by the mean of Gauss."""
    a, b = 1.0, math.sqrt(1 - k * k)
    for _ in range(30):
        a, b = (a + b) / 2, math.sqrt(a * b)
    return math.pi / (2 * a)


def pendulum(limits: list[float], e: float, start: float, until: float) -> dict[str, Any]:
    """A pendulum of 0.7 m with stops; its angle counts from the horizontal."""
    return {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"rod": {"points": {"O": [0, 0]}, "mass": 1.3, "center": [0.7, 0]}},
        "joints": {
            "pin": {"kind": "revolute", "between": ["ground.O", "rod.O"], "limits": limits,
                    "restitution": e}
        },
        "tasks": {
            "m": {"kind": "motion", "start": {"rod.angle": start}, "until": until,
                  "tolerance": 1e-13}
        },
    }  # fmt: skip


@pytest.mark.parametrize("turns", [0, 2])
def test_a_pendulum_hits_a_stop_at_its_lowest_place(turns: int) -> None:
    """Half swings of amplitudes that fall by sin(a'/2) = e sin(a/2), a quarter of one first."""
    e, amplitude = 0.6, 1.2
    down = -math.pi / 2
    start = down - amplitude + 2 * math.pi * turns
    result = md.solve(from_dict(pendulum([-math.pi, down], e, start, 5.0)), "m")
    natural, k = math.sqrt(0.7 / G), math.sin(amplitude / 2)
    expected = [natural * elliptic(k)]
    while (last := expected[-1] + 2 * natural * elliptic(e * k)) < 5.0:
        expected.append(last)
        k *= e
    assert hits(result) == pytest.approx(expected, abs=1e-11)
    assert result.checks["energy"] <= 1e-12
    moment = result.joints["pin"].contact_moment
    assert moment == pytest.approx(np.zeros(len(moment)), abs=1e-12)


def test_a_contact_holds_as_long_as_it_is_pressed() -> None:
    """A torque 2 t lifts the rod off its stop when it exceeds the moment of gravity."""
    data = pendulum([0.0, 1.0], 0.3, 0.0, 6.0)
    data["loads"] = {"T": {"kind": "torque", "body": "rod", "value": "2*t"}}
    result = md.solve(from_dict(data), "m")
    needed = 1.3 * G * 0.7
    (lifts,) = hits(result, "release")
    assert lifts == pytest.approx(needed / 2, abs=1e-11)
    times, moment = result.time, result.joints["pin"].contact_moment
    rests = times < lifts
    assert moment[rests] == pytest.approx(needed - 2 * times[rests], abs=1e-11)
    assert (result.bodies["rod"].angle[times > lifts] > 0).all()
    assert result.checks["energy"] <= 1e-10


@pytest.mark.slow(reason="six motions each")
@pytest.mark.parametrize("case", [one_block, two_blocks])
def test_blocks_drawn_at_random_fly_as_in_closed_form(case: Any) -> None:
    draw = np.random.default_rng(11)
    for _ in range(6):
        impacts, time, energy = case(draw)
        assert impacts
        assert time <= 1e-9
        assert energy <= 1e-9


# -- several at once -------------------------------------------------------------------------------


@pytest.mark.parametrize(("law", "after"), [("newton", (0.5, 0.5)), ("poisson", (0.5, 0.5))])
def test_contacts_that_close_at_once_are_not_unique(law: str, after: tuple[float, float]) -> None:
    """At once both speeds turn round; one after the other it depends on the order."""
    data = carriage((1.0, 1.0), ([0.0, 1.0], [-0.5, 0.5]), (0.5, 0.5), impact=law, poses=2,
                    start={"wall": 0.5, "slot": 0.0}, start_speed={"wall": -1.0, "slot": -1.0},
                    until=0.6)  # fmt: skip
    result = md.solve(from_dict(data), "m")
    assert hits(result) == pytest.approx([0.5, 0.5], abs=1e-12)
    assert [event["unique"] for event in result.events if event["kind"] == "impact"] == [False] * 2
    assert "not unique" in " ".join(result.summary["notes"])
    speeds = [event["rebound"] for event in result.events if event["kind"] == "impact"]
    assert speeds == pytest.approx(after, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "e", "wall"),
    [("newton", (0.8, 0.3), 0.0), ("poisson", (0.8, 0.3), 0.25), ("poisson", (0.2, 0.3), 0.0)],
)
def test_laws_differ_where_a_contact_is_closed(
    law: str, e: tuple[float, float], wall: float
) -> None:
    """A block that lies at its wall is hit by one of half its mass: (e1 - e2) m2 v / m1 or none.

    By Poisson each contact gives back its share of m2 v; by Newton the wall's has no speed to.
    """
    starts = {"start": {"wall": 0.0, "slot": 0.1}, "start_speed": {"wall": 0.0, "slot": -1.0}}
    limits = ([0.0, 1.0], [0.0, 1.0])
    data = carriage((2.0, 1.0), limits, e, impact=law, until=0.2, **starts)
    result = md.solve(from_dict(data), "m")
    assert hits(result)[0] == pytest.approx(0.1, abs=1e-12)
    assert result.joints["wall"].slide_velocity[-1] == pytest.approx(wall, abs=1e-12)
    assert result.points["two.P"].velocity[-1, 0] == pytest.approx(e[1], rel=1e-12)
    assert result.checks["energy"] <= 1e-12


def test_a_pendulum_in_space_hits_its_stop_as_in_the_plane() -> None:
    flat = pendulum([-math.pi, -math.pi / 2], 0.6, -math.pi / 2 - 1.2, 1.5)
    data = flat | {
        "dimension": 3,
        "gravity": [0, 0, -G],
        "ground": {"points": {"O": [0, 0, 0]}},
        "bodies": {"rod": {"points": {"O": [0, 0, 0]}, "mass": 1.3, "center": [0.7, 0, 0],
                           "inertia": [1e-12, 1e-12, 1e-12]}},
        "joints": {"pin": flat["joints"]["pin"] | {"axis": [0, -1, 0], "zero": [1, 0, 0]}},
        "tasks": {"m": flat["tasks"]["m"] | {"start": {"pin": -math.pi / 2 - 1.2}}},
    }  # fmt: skip
    solid, plane = (md.solve(from_dict(each), "m") for each in (data, flat))
    assert hits(solid) == pytest.approx(hits(plane), abs=1e-10)
    assert solid.checks["energy"] <= 1e-11


@pytest.mark.parametrize("joint", ["wall", "slot"])
def test_a_law_that_drives_into_a_stop_says_so(joint: str) -> None:
    """1/2 - t reaches the stop at t = 1/2; the other block is free."""
    others = {"wall": {"slot": 0.5}, "slot": {"wall": 0.5}}
    data = carriage(
        (1, 1), ([0.0, 1.0], [0.0, 1.0]), (0.5, 0.5), start=others[joint],
        drivers=[{"coordinate": f"{joint}.slide", "law": "0.5 - t"}],
    )  # fmt: skip
    result = md.solve(from_dict(data), "m")
    assert f"the law of {joint}.slide drives joint {joint} into its stop (low) of 0" in result.fault
    assert result.status[-1] == "jammed"
    last = result.events[-1]
    assert (last["code"], last["joints"]) == ("S4", [joint])
    assert last["at"] == pytest.approx(0.5, abs=1e-11)


@pytest.mark.parametrize(("short", "blocked"), [(5e-12, True), (1e-8, False)])
def test_a_stop_at_a_dead_centre_has_no_impulse(short: float, blocked: bool) -> None:
    """A block 0.459 m from a crank at its dead centre: no finite impulse stops the crank."""
    data = slider_crank(until=0.02)
    data["gravity"] = [0, 0]
    data["joints"]["guide"] = {"kind": "prismatic", "between": ["ground.O", "slider.B"],
                               "limits": [0, 0.459 - short], "restitution": 0.5}  # fmt: skip
    del data["tasks"]["m"]["clearance"]
    data["tasks"]["m"] |= {"start": {"crank": -0.5}, "start_speed": {"crank": 30}}
    result = md.solve(from_dict(data), "m")
    assert ("meets its stop (high) of 0.459 m where no" in str(result.fault)) == blocked
    assert bool(hits(result)) != blocked


# -- gaps of joints ------------------------------------------------------------------------------


def test_a_rack_is_hit_by_one_flank_after_the_other() -> None:
    """Half the play at 1 m/s, then all of it at a speed that falls by e each time."""
    data = wheel_and_rack(start_speed={"wheel": 10.0, "guide": 0.0})
    result = md.solve(from_dict(data), "m")
    expected = [1e-3]
    while (last := expected[-1] + 2e-3 / 0.8 ** len(expected)) < 0.1:
        expected.append(last)
    assert hits(result) == pytest.approx(expected, abs=1e-12)
    ends = [event["end"] for event in result.events]
    assert ends == [f"flank {1 + k % 2}" for k in range(len(ends))]
    momentum = 0.01 * result.bodies["wheel"].angular_velocity / 0.1
    momentum = momentum + 2 * result.joints["guide"].slide_velocity
    assert momentum == pytest.approx(np.full(len(momentum), 1.0), rel=1e-12)
    assert result.checks["energy"] <= 1e-12


def test_teeth_change_flanks_where_the_torque_changes_its_sign() -> None:
    """Torque 1 - 2 t: the rack runs ahead from t = 1/2 on until the play is crossed."""
    result = md.solve(from_dict(turned_rack()), "m")
    (lifts,) = hits(result, "release")
    assert lifts == pytest.approx(0.5, abs=1e-11)
    crossing = (6 * 0.01 * 2e-3 / (0.1 * 2)) ** (1 / 3)
    assert hits(result)[-1] == pytest.approx(0.5 + crossing, abs=1e-9)
    force, t = result.joints["mesh"].contact_force, result.time
    together = t < 0.5
    assert force[together] == pytest.approx(along_teeth(1 - 2 * t[together]), abs=1e-9)
    for at, torque in (0, 1.0), (-1, -0.5):  # by one flank, then by the other
        along = along_teeth(torque)
        apart = abs(along) * math.tan(math.pi / 9)
        wheel, guide = (result.joints[name].reaction[at] for name in ("O", "guide"))
        assert wheel == pytest.approx([along, apart, 0], abs=1e-9)
        place = result.joints["guide"].slide[at]  # the moment is about the middle of the rack
        assert guide == pytest.approx([0, -apart, 0.1 * along + place * apart], abs=1e-9)
    assert result.checks["energy"] <= 1e-10


@pytest.mark.parametrize("key", ["backlash", "backlash_angle"])
def test_gears_cross_their_backlash(key: str) -> None:
    """Wheels of 0.1 and 0.2 m: half the backlash, along the pitch circle or of the first wheel."""
    size = {"backlash": 2e-3, "backlash_angle": 0.02}[key]
    data = wheel_and_rack(until=0.02, start_speed={"wheel": 10.0, "other": 0.0})
    data["ground"]["points"]["Q"] = [0.3, 0]
    data["bodies"]["other"] = {"points": {"Q": [0, 0]}, "mass": 1, "inertia": 0.03}
    del data["bodies"]["rack"], data["joints"]["guide"]
    data["joints"]["Q"] = {"kind": "revolute", "between": ["ground.Q", "other.Q"]}
    data["joints"]["mesh"] = {"kind": "gear", "between": ["wheel.O", "other.Q"], "ratio": -2,
                              key: size, "restitution": 0.5}  # fmt: skip
    result = md.solve(from_dict(data), "m")
    assert hits(result)[:2] == pytest.approx([1e-3, 1e-3 + 2e-3 / 0.5], abs=1e-12)
    assert result.checks["energy"] <= 1e-12


@pytest.mark.parametrize("e", [1.0, 0.7])
def test_a_pin_flies_along_chords_of_its_bush(e: float) -> None:
    """Chords 2 c cos: the speed along the bush stays, that across it falls by e each time."""
    c, speed = 1e-3, 0.2
    result = md.solve(from_dict(disc(e, speed, 0.2)), "m")
    along, across = speed / 2, speed * math.sqrt(3) / 2
    expected = [math.sqrt(3) / 2 * c / speed]
    while across > 1e-4 and expected[-1] < 0.2:
        across *= e
        expected.append(expected[-1] + 2 * c * across / (along**2 + across**2))
    expected = [t for t in expected if t < 0.2]
    assert hits(result)[: len(expected)] == pytest.approx(expected, abs=1e-9)
    assert len(expected) > 15
    assert result.checks["energy"] <= 1e-11
    if e < 1:  # then it slides round, pressed by its inertia
        (contact,) = [event for event in result.events if event["kind"] == "contact"]
        force = result.joints["A"].contact_force[result.time > contact["at"]]
        assert force == pytest.approx(np.full(len(force), 3 * along**2 / c), rel=1e-7)
        assert np.linalg.norm(result.joints["A"].reaction[-1, :2]) == pytest.approx(force[-1])


def spinning_disc(spin: float, mu: float, law: str, **more: Any) -> dict[str, Any]:
    """The disc flies head-on against its pin of 20 mm, and spins."""
    data = disc(0.5, 0.2, 4e-3)
    data["joints"]["A"] |= {"friction": mu, "pin_radius": 0.02}
    data["tasks"]["m"] |= {
        "impact": law, "start": {"disc.P.x": 0.0, "disc.P.y": 0.0},
        "start_speed": {"disc.P.x": 0.5, "disc.P.y": 0.0, "disc.angle": spin}, **more,
    }  # fmt: skip
    return data


@pytest.mark.parametrize(
    ("start", "speed", "load"),
    [((0.0, 0.0), (0.0, 0.0), ""), ((0.5, 0.5), (-1.0, -1.0), ""), ((0.5, 0.5), (-1.0, -2.0), ""),
     ((0.5, 0.0), (-1.0, 0.0), ""), ((0.0, 0.0), (0.0, 0.0), "-(1 - 2*t)**2")],
)  # fmt: skip
def test_contacts_that_touch_without_a_force_stay_closed(start: Any, speed: Any, load: str) -> None:
    """Two blocks without restitution; a load presses them less and less, then again."""
    starts = [dict(zip(("wall", "slot"), values, strict=True)) for values in (start, speed)]
    data = carriage(
        (1.0, 2.0), ([0.0, 1.0], [0.0, 1.0]), (0.0, 0.0), start=starts[0], start_speed=starts[1]
    )
    if load:
        data["loads"] = {"F": {"kind": "force", "point": "two.P", "value": [load, 0]}}
    result = md.solve(from_dict(data), "m")
    assert result.fault is None
    assert len(result.time) < 50
    kinds = [event["kind"] for event in result.events if event["kind"] != "impact"]
    assert kinds == ["contact", "contact"]
    for joint in result.joints.values():
        assert joint.slide[-1] == pytest.approx(0, abs=1e-12)
        pressed = (1 - 2 * result.time[-1]) ** 2 if load else 0.0
        assert joint.contact_force[-1] == pytest.approx(pressed, abs=1e-11)


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("spin", [5.0, 40.0, -40.0])
def test_a_spinning_disc_sticks_or_slides_in_an_impact(law: str, spin: float) -> None:
    """Impulses (1 + e) m v, and mu of it or what stops the surface, r + c from the centre."""
    m, inertia, mu, e, v, r = 3.0, 0.02, 0.2, 0.5, 0.5, 0.021
    result = md.solve(from_dict(spinning_disc(spin, mu, law, until=3e-3)), "m")
    (impact,) = [event for event in result.events if event["kind"] == "impact"]
    assert impact["at"] == pytest.approx(1e-3 / v, abs=1e-12)
    most = mu * (1 + e) * m * v
    stops = abs(spin) * r / (1 / m + r * r / inertia)
    push = min(most, stops)
    assert (push < most) == (abs(spin) == 5.0)
    assert impact["rebound"] == pytest.approx(e * v, rel=1e-9)
    turned = result.bodies["disc"].angular_velocity[-1]
    assert abs(turned) == pytest.approx(abs(spin) - push * r / inertia, rel=1e-9)
    assert abs(result.points["disc.P"].velocity[-1, 1]) == pytest.approx(push / m, rel=1e-9)
    assert result.checks["energy"] <= 1e-11


def test_a_contact_that_lasts_rubs() -> None:
    """A spinning disc hangs on its pin: friction is mu of the contact's force while it slides."""
    data = spinning_disc(30.0, 0.2, "newton", until=1.0)
    data["gravity"] = [0, -G]
    data["tasks"]["m"]["start_speed"] = {"disc.angle": 30.0}
    result = md.solve(from_dict(data), "m")
    joint = result.joints["A"]
    (kept, *_) = [event["at"] for event in result.events if event["kind"] == "contact"]
    held = (result.time > kept) & (np.abs(result.bodies["disc"].angular_velocity) > 1.0)
    normal = joint.contact_force[held]
    assert held.sum() > 5
    size = np.linalg.norm(joint.reaction[held, :2], axis=1)
    assert size == pytest.approx(normal * math.sqrt(1 + 0.2**2), rel=1e-6)
    assert result.work["friction.A"][-1] < 0
    assert result.checks["energy"] <= 1e-7


def slider_crank(**more: Any) -> dict[str, Any]:
    """The slider-crank of Flores, Leine and Glocker, 1 mm above and below its block of 100 mm."""
    bodies, joints = dict[str, Any](), dict[str, Any]()
    for name, first, length, mass, inertia in (
        ("crank", "OA", 0.153, 0.038, 7.4e-5), ("rod", "AB", 0.306, 0.038, 5.9e-4)
    ):  # fmt: skip
        bodies[name] = {"points": {first[0]: [0, 0], first[1]: [length, 0]}, "mass": mass,
                        "inertia": inertia, "center": [length / 2, 0]}  # fmt: skip
    bodies["slider"] = {"points": {"B": [0, 0]}, "mass": 0.076, "inertia": 2.7e-6}
    for name, pair in {"O": ("ground.O", "crank.O"), "A": ("crank.A", "rod.A"),
                       "B": ("rod.B", "slider.B")}.items():  # fmt: skip
        joints[name] = {"kind": "revolute", "between": list(pair)}
    joints["guide"] = {"kind": "prismatic", "between": ["ground.O", "slider.B"],
                       "contact_length": 0.1, "clearance": 0.001, "restitution": 0.4}  # fmt: skip
    return {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": bodies,
        "joints": joints,
        "sketch": {"crank": 0, "rod": 0},
        "tasks": {"m": {"kind": "motion", "clearance": "contact", "start": {"crank": 0},
                        "start_speed": {"crank": 150}, **more}},
    }  # fmt: skip


@pytest.mark.slow(reason="30 ms of a fast slider-crank with some forty impacts")
def test_a_block_with_clearance_moves_as_published() -> None:
    """Flores, Leine, Glocker, Multibody System Dynamics 23, 165 (2010), by a step of 0.1 ms.

    The states are those of the reference file SliderCrankMoreauJeanCombinedProjectionOSI.ref of
    Siconos; its coefficient of friction, 0.01, does not turn the block there.
    """
    times = [0.001, 0.0025, 0.003, 0.004, 0.0273]
    result = md.solve(from_dict(slider_crank(at=times)), "m")
    turns = result.bodies["crank"].angle / (2 * math.pi)
    published = [0.0232542798, 0.0532239782, 0.0618787917, 0.0776563718, 0.3607176265]
    assert turns == pytest.approx(published, rel=0.015)
    heights = [0.0771007342, 0.8302048772, 0.9394276461, 0.7888190714, -0.8153274333]
    found = result.points["slider.B"].position[:, 1] / 1e-3
    assert found == pytest.approx(heights, abs=0.03)
    first, *_ = impacts = [e for e in result.events if e["kind"] == "impact"]
    low = next(event for event in impacts if event["end"].endswith("right"))
    assert first["at"] == pytest.approx(2.7e-3, abs=1e-4)
    assert low["at"] == pytest.approx(25.85e-3, abs=1e-4)
    assert first["rebound"] == pytest.approx(0.3317683281, rel=0.02)
    assert low["rebound"] == pytest.approx(0.2579394652, rel=0.02)
    lifts = hits(result, "release")
    assert lifts[0] == lifts[1]  # both ends of the block at once
    assert result.checks["energy"] <= 1e-8


@pytest.mark.slow(reason="some hundred impacts of a driven mechanism")
def test_two_pins_of_a_slider_crank_fly_in_their_bushes() -> None:
    """A driven crank, one pin that rubs: the audit closes; only impacts are called undecided."""
    data = slider_crank(until=4e-3)
    data["joints"]["guide"] = {"kind": "prismatic", "between": ["ground.O", "slider.B"]}
    data["joints"]["A"] |= {"clearance": 5e-4, "restitution": 0.8, "friction": 0.05,
                            "pin_radius": 0.01}  # fmt: skip
    data["joints"]["B"] |= {"clearance": 5e-4, "restitution": 0.8}
    data["tasks"]["m"] |= {"start": {}, "start_speed": {}}
    data["tasks"]["m"]["drivers"] = [{"coordinate": "crank.angle", "law": "150*t"}]
    result = md.solve(from_dict(data), "m")
    assert {event["joint"] for event in result.events} == {"A", "B"}
    of_contacts = [e for e in result.events if e["kind"] in ("impact", "contact", "release")]
    for event in (event for event in of_contacts if event.get("unique") is False):
        *_, last = [
            e for e in of_contacts if e["joint"] != event["joint"] and e["at"] <= event["at"]
        ]
        assert last["kind"] == "contact" or last["at"] == event["at"], "the other pin touches"
    for name in ("A", "B"):
        assert (result.joints[name].gap >= -1e-12).all()
        assert result.work[f"impacts.{name}"][-1] < 0
    assert result.checks["energy"] <= 1e-9


def test_a_joint_without_a_restitution_keeps_its_equations() -> None:
    data = disc(0.5, 0.2, 0.1)
    del data["joints"]["A"]["restitution"]
    with pytest.raises(InputError, match="joint A has a gap but no restitution") as caught:
        from_dict(data)
    assert "clearance" in str(caught.value)


def said(result: md.Result) -> str:
    return " ".join(result.summary.get("notes", []))


def test_what_a_gap_does_without_is_said() -> None:
    """Friction of guides that are open, joints that stay ideal."""
    data = wheel_and_rack(start_speed={"wheel": 10.0})
    data["joints"]["guide"] |= {"friction": 0.1, "clearance": 1e-3}
    text = said(md.solve(from_dict(data), "m"))
    assert "joint guide has a gap and no restitution: it stays without a gap" in text
    assert "joint guide takes nothing from an impact" in text
    data["joints"]["guide"] |= {"restitution": 0.5}
    assert "joint guide moves in its gap without friction" in said(md.solve(from_dict(data), "m"))


def test_single_impacts_follow_one_another() -> None:
    found, wanted = single_impacts()
    assert found == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-13])
def test_a_block_that_touches_makes_an_impact_not_unique(gap: float) -> None:
    """A block at its wall is hit: it may be thrown back by the wall and hit the other once more."""
    limits = ([0.0, 1.0], [0.0, 1.0])
    starts = {"start": {"wall": gap, "slot": 0.1}, "start_speed": {"wall": 0.0, "slot": -1.0}}
    data = carriage((2, 1), limits, (0.8, 0.3), until=0.15, **starts)
    result = md.solve(from_dict(data), "m")
    impact = next(event for event in result.events if event["kind"] == "impact")
    assert impact["unique"] is False
    assert "touch at once" in said(result)


def test_an_impact_that_adds_energy_says_so() -> None:
    """Coulomb's law with that of Newton, by the example of a disc that is off its centre.

    By Poisson's law no impact adds energy: Pfeiffer, Glocker, Multibody Dynamics with Unilateral
    Contacts, ch. 8.
    """
    data = spinning_disc(40.0, 1.47, "newton", until=3e-3)
    data["bodies"]["disc"]["center"] = [-0.36, 0.04]
    data["joints"]["A"]["restitution"] = 0.92
    for law in ("newton", "poisson"):
        data["tasks"]["m"]["impact"] = law
        result = md.solve(from_dict(data), "m")
        works = [event["work"] for event in result.events if event["kind"] == "impact"]
        assert (max(works) > 1e-9) == ("adds" in said(result)) == (law == "newton")


def test_limits_without_a_restitution_are_passed_with_a_word() -> None:
    data = ball(0.5, 1.0)
    del data["joints"]["floor"]["restitution"]
    result = md.solve(from_dict(data), "m")
    beyond = result.joints["floor"].slide < -1e-9
    assert beyond.any()
    assert (result.status[beyond] == "stopped").all()
    assert (result.status[~beyond] == "ok").all()
    assert "joint floor is beyond its least slide" in str(result.fault)


def test_each_joint_says_when_it_passes_its_limit_first() -> None:
    """Blocks without forces: the second leaves its slot after 0.15 s, the first its wall later."""
    starts = {"start": {"wall": 0.55, "slot": 0.15}, "start_speed": {"wall": -1.0, "slot": -1.0}}
    data = carriage((2, 1), ([0.0, 1.0], [0.0, 1.0]), (1.0, 1.0), until=1.0, poses=11, **starts)
    for joint in data["joints"].values():
        del joint["restitution"]
    fault = str(md.solve(from_dict(data), "m").fault)
    assert "joint slot is beyond its least slide of 0 m, first at t = 0.2 s" in fault
    assert "joint wall is beyond its least slide of 0 m, first at t = 0.6 s" in fault


@pytest.mark.parametrize(("limits", "status"), [([0.0, 1.0], "stopped"), ([-3.0, 1.0], "ok")])
def test_rest_beyond_a_stop_is_no_rest(limits: list[float], status: str) -> None:
    data = pendulum(limits, 0.5, 0.1, 1.0)
    data["sketch"] = {"rod": 0.1}
    data["tasks"]["rest"] = {"kind": "equilibrium"}
    result = md.solve(from_dict(data), "rest")
    assert result.bodies["rod"].angle[0] == pytest.approx(-math.pi / 2, abs=1e-9)
    assert result.status.tolist() == [status]
    assert result.summary["status"] == {status: 1}
    assert ("beyond its least angle" in str(result.fault)) == (status == "stopped")


def test_other_joints_do_not_notice_gaps() -> None:
    """Without the key of the task a clearance changes nothing."""
    data = wheel_and_rack(start_speed={"wheel": 10.0})
    del data["tasks"]["m"]["clearance"]
    result = md.solve(from_dict(data), "m")
    assert not result.events
    slides = result.joints["guide"].slide_velocity
    assert slides == pytest.approx(np.full(len(slides), 1.0), rel=1e-12)


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [-0.1, 1.01])
def test_a_restitution_is_from_zero_to_one(e: float) -> None:
    with pytest.raises(MechanismError, match="from 0 to 1") as caught:
        from_dict(ball(e, 1.0))
    assert "joints.floor.restitution" in str(caught.value)


def test_a_start_beyond_a_stop_is_an_error() -> None:
    with pytest.raises(InputError, match=r"joint floor is beyond its stop \(low\) by 0.5 m"):
        md.solve(from_dict(ball(0.5, 1.0, start={"floor": -0.5})), "m")


@pytest.mark.parametrize("clearance", [0.05, 0.16])
def test_a_clearance_larger_than_a_link_is_refused(clearance: float) -> None:
    data = slider_crank(until=1e-4)
    data["joints"]["A"] |= {"clearance": clearance, "restitution": 0.5}
    if clearance < 0.153:
        assert md.solve(from_dict(data), "m").fault is None
        return
    with pytest.raises(MechanismError, match=r"the next joint of crank it is 0\.153 m") as caught:
        md.solve(from_dict(data), "m")
    assert "joints.A.clearance" in str(caught.value)


def test_redundant_equations_are_refused() -> None:
    """Two parallel guides hold one block twice."""
    data = ball(0.5, 1.0)
    data["bodies"]["ball"]["points"]["Q"] = [1, 0]
    data["ground"]["points"]["Q"] = [1, 0]
    data["joints"]["second"] = {"kind": "prismatic", "between": ["ground.Q", "ball.Q"],
                                "axis": math.pi / 2}  # fmt: skip
    with pytest.raises(MechanismError, match="redundant") as caught:
        md.solve(from_dict(data), "m")
    assert "joints.floor.restitution" in str(caught.value)


def test_figures_of_the_evidence_are_those_measured() -> None:
    """Of `python -m tests.scripts.contacts`."""
    figures = json.loads((ROOT / "docs/data/contacts.json").read_text(encoding="utf-8"))
    blocks = [figures[name] for name in ("one block", "two blocks")]
    assert sum(figure["motions"] for figure in blocks) == 200
    assert all(figure["time"] <= 1e-9 for figure in blocks)
    assert all(figure["energy"] <= 1e-10 for figure in figures.values())
    text = (ROOT / "docs/theory/evidence/motion.md").read_text(encoding="utf-8")
    for figure in blocks:
        assert f"{figure['impacts']} impacts" in text
        assert f"| {figure['time']:.0e} s; {figure['energy']:.0e} |" in text
