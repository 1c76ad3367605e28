"""Dry friction of pins in slots and of meshes in motion, against closed forms and free bodies."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict

G = 9.81


def events(result: md.Result) -> list[tuple[str, str]]:
    return [(event["kind"], event.get("joint") or event["load"]) for event in result.events]


# -- a pin in a slot of the ground ---------------------------------------------------------------

M, INERTIA, R, MU = 2.0, 0.003, 0.02, 0.3


def rod(
    speed: float, spin: float, arm: float = 0.0, slope: float = 0.0, **more: Any
) -> dict[str, Any]:
    """A rod whose pin slides in a slot of the ground, its centre of mass below the pin."""
    along = [speed * math.cos(slope), spin]
    return {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "rod": {"points": {"P": [0, 0]}, "mass": M, "inertia": INERTIA, "center": [0, -arm]}
        },
        "joints": {
            "slot": {"kind": "pin-in-slot", "between": ["ground.O", "rod.P"], "axis": slope,
                     "friction": MU, "pin_radius": R}
        },
        "tasks": {
            "m": {"kind": "motion", "tolerance": 1e-11, "until": 1.0,
                  "start": {"rod.P.x": 0.0, "rod.angle": 0.0},
                  "start_speed": dict(zip(("rod.P.x", "rod.angle"), along, strict=True))}
        },
        **more,
    }  # fmt: skip


def test_a_pin_slides_until_it_rolls() -> None:
    """Balanced on its pin: the surface slows down with mu g (1 + m r^2/I), then the pin rolls."""
    v, w = 1.0, 5.0
    result = md.solve(from_dict(rod(v, w)), "m")
    surface, slows = v + R * w, MU * G * (1 + M * R**2 / INERTIA)
    (stick,) = result.events
    t = surface / slows
    assert (stick["kind"], stick["joint"]) == ("stick", "slot")
    assert stick["at"] == pytest.approx(t, rel=1e-14)
    rolling = v - MU * G * t
    assert result.joints["slot"].slide_velocity[-1] == pytest.approx(rolling, rel=1e-13)
    assert result.bodies["rod"].angular_velocity[-1] == pytest.approx(-rolling / R, rel=1e-13)
    slid = v * t - MU * G * t**2 / 2
    assert result.joints["slot"].slide[-1] == pytest.approx(slid + rolling * (1 - t), rel=1e-13)
    before = (M * v**2 + INERTIA * w**2) / 2
    lost = (M + INERTIA / R**2) * rolling**2 / 2 - before
    assert result.work["friction.slot"][-1] == pytest.approx(lost, rel=1e-13)
    normal = M * G
    first, last = result.joints["slot"].reaction[[0, -1]]
    assert first == pytest.approx([-MU * normal, normal, -MU * normal * R], rel=1e-13)
    assert last == pytest.approx([0, normal, 0], abs=1e-12)


@pytest.mark.parametrize("degrees", [10, 60])
def test_a_pin_rolls_down_or_slides(degrees: float) -> None:
    """It rolls up to tan(slope) = mu (1 + m r^2/I)."""
    slope = math.radians(degrees)
    result = md.solve(from_dict(rod(0, 0, slope=slope)), "m")
    rolls = math.tan(slope) <= MU * (1 + M * R**2 / INERTIA)
    assert rolls == (degrees == 10)
    down = G * math.sin(slope) / (1 + INERTIA / (M * R**2))
    if not rolls:
        down = G * (math.sin(slope) - MU * math.cos(slope))
    assert result.joints["slot"].slide[-1] == pytest.approx(-down / 2, rel=1e-13)
    assert result.checks["energy"] <= 1e-13


def _bodies(state: Any, arm: float, side: float, sigma: float | None) -> tuple[Any, float, float]:
    """Return accelerations, normal force and friction by Newton and Euler.

    The pin touches the slot below (side 1) or above (-1); its surface slides to `sigma`, or rolls
    (None).
    """
    _, phi, _, w = state
    s, c = math.sin(phi), math.cos(phi)
    down, across = -side * R, (-arm * s, arm * c)  # contact below the pin; pin from the centre
    equations = np.array([
        [M, M * arm * c, 0, -1],  # x'', phi'', N, T
        [0, M * arm * s, -1, 0],
        [0, INERTIA, -across[0], down + across[1]],
        [1, side * R, 0, 0] if sigma is None else [0, 0, MU * side * sigma, 1],
    ])  # fmt: skip
    right = [M * arm * s * w * w, -M * G - M * arm * c * w * w, 0, 0]
    x, turn, N, T = np.linalg.solve(equations, right)
    return np.array([x, turn]), N, T


def _until_an_event(
    integrate: Any, span: Any, y: Any, arm: float, side: float, sigma: float | None
) -> Any:
    def slope(t: float, y: Any) -> Any:
        return [*y[2:], *_bodies(y, arm, side, sigma)[0]]

    def leaves(t: float, y: Any) -> float:
        return side * _bodies(y, arm, side, sigma)[1]

    def changes(t: float, y: Any) -> float:
        if sigma is not None:
            return sigma * float(y[2] + side * R * y[3])
        _, N, T = _bodies(y, arm, side, None)
        return MU * abs(N) - abs(T)

    leaves.terminal = changes.terminal = True
    leaves.direction = changes.direction = -1
    numbers = {"rtol": 3e-14, "atol": 1e-15, "max_step": 0.005, "dense_output": True}
    return integrate.solve_ivp(slope, span, y, "DOP853", events=(leaves, changes), **numbers)


def reference(state: Any, arm: float, times: Any) -> tuple[Any, list[tuple[str, float]], int]:
    """Return states at times, what happened, and changes of side, by scipy between events."""
    integrate = pytest.importorskip("scipy.integrate")
    t, found, log, changed = 0.0, [], [], 0

    def surface(y: Any, side: float) -> float:
        return float(y[2] + side * R * y[3])

    def decide(y: Any, rest: bool) -> tuple[float, float | None]:
        for side in (1.0, -1.0):
            if rest:
                _, N, T = _bodies(y, arm, side, None)
                if side * N >= 0 and abs(T) <= MU * abs(N):
                    return side, None
            for sigma in (1.0, -1.0):
                a, N, _ = _bodies(y, arm, side, sigma)
                moving = a[0] + side * R * a[1] if rest else surface(y, side)
                if side * N >= 0 and moving * sigma > 0:
                    return side, sigma
        raise AssertionError("no contact fits")

    y = np.array(state)
    side, sigma = decide(y, False)
    while True:
        ahead = [own for own in times if own > t]
        run = _until_an_event(integrate, (t, times[-1]), y, arm, side, sigma)
        end = run.t[-1]
        found += [run.sol(own) for own in ahead if own <= end]
        if run.status == 0:
            return np.array(found), log, changed
        t, y = end, run.y[:, -1]
        if len(run.t_events[1]):
            held = _bodies(y, arm, side, None)[2]
            was = sigma
            if was is None:
                sigma = -math.copysign(1, held)
                log.append(("slip", t))
            else:
                side, sigma = decide(y, True)
                log.append(("stick" if sigma is None else "reversal", t))
        else:
            changed, side = changed + 1, -side
            sigma = math.copysign(1, surface(y, side))


@pytest.mark.parametrize(("spin", "lifts"), [(9.0, 0), (30.0, 0), (60.0, 5)])
def test_a_rod_swings_on_its_pin(spin: float, lifts: int) -> None:
    """An eccentric rod slides and rolls, and when it turns over it lifts its pin."""
    arm, times = 0.1, [0.1, 0.25, 0.4, 0.7]
    data = rod(0.0, spin, arm)
    data["tasks"]["m"] |= {"until": times[-1], "at": times, "tolerance": 1e-12}
    result = md.solve(from_dict(data), "m")
    states, log, changed = reference([0.0, 0.0, 0.0, spin], arm, times)
    assert result.fault is None
    assert [event["kind"] for event in result.events] == [kind for kind, _ in log]
    assert [event["at"] for event in result.events] == pytest.approx([t for _, t in log], abs=1e-11)
    turned = result.bodies["rod"]
    assert result.joints["slot"].slide == pytest.approx(states[:, 0], abs=2e-11)
    assert turned.angle == pytest.approx(states[:, 1], abs=5e-11)
    assert turned.angular_velocity == pytest.approx(states[:, 3], abs=1e-9)
    assert result.checks["energy"] <= 1e-10
    assert changed == lifts


def test_a_pin_without_radius_rubs_along_the_slot_alone() -> None:
    data = rod(1.0, 5.0)
    del data["joints"]["slot"]["pin_radius"]
    result = md.solve(from_dict(data), "m")
    assert events(result) == [("stick", "slot")]
    assert result.events[0]["at"] == pytest.approx(1 / (MU * G), rel=1e-14)
    assert result.joints["slot"].slide[-1] == pytest.approx(1 / (2 * MU * G), rel=1e-13)
    assert result.bodies["rod"].angular_velocity[-1] == 5.0


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**10])
def test_scale_changes_nothing(scale: float) -> None:
    """Lengths and gravity times a power of two: the same times in the same steps."""
    found = []
    for s in (1.0, scale):
        data = rod(0.0, 60.0, 0.1 * s)
        data["gravity"] = [0, -G * s]
        data["bodies"]["rod"]["points"]["E"] = [0.2 * s, 0]  # a length of the mechanism
        data["bodies"]["rod"]["inertia"] = INERTIA * s**2
        data["joints"]["slot"]["pin_radius"] = R * s
        found.append(md.solve(from_dict(data), "m"))
    times, expected = ([event["at"] for event in result.events] for result in found[::-1])
    assert times == pytest.approx(expected, rel=1e-14)
    assert found[0].summary["steps"] == found[1].summary["steps"]


# -- meshes ------------------------------------------------------------------------------------

I1, I2, T2, LOSS, W = 0.02, 0.05, 3.0, 0.04, 30.0
PINIONS = {
    "external": ({"kind": "gear", "teeth": [20, 50], "mesh": "external"}, 0.4),
    "internal": ({"kind": "gear", "teeth": [20, 50], "mesh": "internal"}, 0.4),
    "belt": ({"kind": "belt", "ratio": 2.5, "radius": 0.03}, 0.4),
    "torque only": ({"kind": "belt", "ratio": 2.5}, 0.4),
    "rack": ({"kind": "rack", "radius": 0.05}, 0.05),
}


def pair(mesh: dict[str, Any], loads: dict[str, Any], **task: Any) -> dict[str, Any]:
    """Two wheels, or a wheel and a rack on a guide."""
    slides = mesh["kind"] == "rack"
    second = {"mass": I2} if slides else {"inertia": I2}
    bearing = {"kind": "prismatic"} if slides else {"kind": "revolute"}
    place = [0.0, -0.05] if slides else [0.1, 0.0]
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0], "C": place}},
        "bodies": {
            "wheel": {"points": {"O": [0, 0]}, "inertia": I1},
            "other": {"points": {"C": [0, 0]}, **second},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "wheel.O"]},
            "C": {**bearing, "between": ["ground.C", "other.C"]},
            "mesh": {**mesh, "between": ["wheel.O", "other.C"], "mesh_loss": LOSS},
        },
        "sketch": {"wheel": 0.0},
        "loads": loads,
        "tasks": {"m": {"kind": "motion", "tolerance": 1e-10, "start": {"wheel": 0.0}, **task}},
    }


def other(result: md.Result) -> tuple[Any, Any]:
    """Return place and speed of the second wheel or of the rack."""
    body = result.bodies["other"]
    if "slide" in result.joints["C"]:
        return result.joints["C"].slide, result.joints["C"].slide_velocity
    return body.angle, body.angular_velocity


@pytest.mark.parametrize("name", PINIONS)
@pytest.mark.parametrize("load_on", ["second", "first"])
def test_wheels_that_a_load_brakes_to_rest(name: str, load_on: str) -> None:
    """The power that enters the mesh is (1 - loss) of what leaves it, until all stands still.

    The wheel without load drives the other one with its inertia.
    """
    mesh, i = PINIONS[name]
    target = ("C.slide" if name == "rack" else "other.angle") if load_on == "second" else "O.angle"
    work = {"kind": "resistance", "coordinate": target, "positive": T2, "negative": T2}
    data = pair(mesh, {"work": work}, start_speed={"wheel.angle": W}, until=5.0)
    result = md.solve(from_dict(data), "m")
    if load_on == "second":
        slows = T2 * i / ((1 - LOSS) * I1 + i**2 * I2)
    else:
        slows = T2 / (I1 + (1 - LOSS) * i**2 * I2)
    end = W / slows
    assert end < 5.0
    assert result.summary["rests_from"] == pytest.approx(end, rel=1e-13)
    assert {kind for kind, _ in events(result)} == {"stick"}
    assert result.bodies["wheel"].angle[-1] == pytest.approx(W * end / 2, rel=1e-13)
    assert np.abs(other(result)[0][-1]) == pytest.approx(i * W * end / 2, rel=1e-13)
    energy = (I1 + i**2 * I2) * W**2 / 2
    way = W * end / 2 * (i if load_on == "second" else 1)
    assert result.work["work"][-1] == pytest.approx(-T2 * way, rel=1e-13)
    assert result.work["friction.mesh"][-1] == pytest.approx(T2 * way - energy, rel=1e-11)
    assert result.checks["energy"] <= 1e-13


@pytest.mark.parametrize("name", PINIONS)
@pytest.mark.parametrize("forward", [True, False])
def test_a_mesh_holds_until_the_load_is_beyond_its_loss(name: str, forward: bool) -> None:
    """A torque against one that grows or falls: the losses are those of the way it starts."""
    mesh, i = PINIONS[name]
    T1, rate = 2.0, -0.05 if forward else 0.05
    sense = -1.0 if name == "external" else 1.0
    balance = T1 / i  # of the second wheel
    against = f"{-sense * balance}*(1 + {rate}*t)"
    loads: dict[str, Any] = {"drive": {"kind": "torque", "body": "wheel", "value": T1}}
    loads["load"] = {"kind": "torque", "body": "other", "value": against}
    if name == "rack":
        loads["load"] = {"kind": "force", "point": "other.C", "value": [against, 0]}
    data = pair(mesh, loads, until=1.5)
    result = md.solve(from_dict(data), "m")
    share = 1 - LOSS if forward else 1 / (1 - LOSS)
    start = (share - 1) / rate
    assert events(result) == [("slip", "mesh")]
    assert result.events[0]["at"] == pytest.approx(start, rel=1e-11)
    # torque too much on the first wheel, over (inertia, the driven one's by its losses)
    push = abs(rate) * balance * i / share
    inertia = I1 + i**2 * I2 / share
    turned = math.copysign(push / inertia * (1.5 - start) ** 3 / 6, 1 if forward else -1)
    assert result.bodies["wheel"].angle[-1] == pytest.approx(turned, rel=1e-9)
    at_rest = result.joints["mesh"].reaction[0]
    assert np.isfinite(at_rest).all()
    assert result.checks["energy"] <= 1e-9


@pytest.mark.parametrize("play", [0.0, 1e-5])
def test_teeth_load_bearings_that_rub(play: float) -> None:
    """Bearings of a spur pair carry F/cos(alpha); their friction circles brake both wheels.

    Wheels with play turn freely until the first one, that nothing brakes, has crossed half of it.
    """
    mesh, i = PINIONS["external"]
    alpha, rho = math.radians(20), (0.01 * 0.2 / math.sqrt(1.04), 0.015 * 0.1 / math.sqrt(1.01))
    work = {"kind": "resistance", "coordinate": "other.angle", "positive": T2, "negative": T2}
    data = pair({**mesh, "pressure_angle": alpha}, {"work": work},
                start_speed={"wheel.angle": W}, until=0.3)  # fmt: skip
    data["joints"]["mesh"]["mesh_loss"] = 0.0
    data["joints"]["O"] |= {"friction": 0.2, "pin_radius": 0.01}
    data["joints"]["C"] |= {"friction": 0.1, "pin_radius": 0.015}
    if play:
        data["joints"]["mesh"] |= {"backlash": play, "restitution": 0.0}
        data["tasks"]["m"] |= {"clearance": "contact"}
        data["tasks"]["m"]["start_speed"]["other.angle"] = -i * W
    result = md.solve(from_dict(data), "m")
    r1 = 0.1 / (1 + 1 / i)
    r2 = r1 / i
    met = math.sqrt(2 * play / 2 / (T2 / I2 * r2))
    driven = i**2 * I2 / (I1 + i**2 * I2)
    begin = W - driven * met * T2 / I2 / i  # the angular momentum of both wheels, at the first
    one, two = r1 + rho[0] / math.cos(alpha), r2 - rho[1] / math.cos(alpha)
    # I1 a = -F one, I2 i a = F two - T2
    F = T2 / (two + I2 * i * one / I1)
    slows = F * one / I1
    after = result.time > met
    assert result.bodies["wheel"].angular_velocity[after] == pytest.approx(
        begin - slows * (result.time[after] - met), rel=1e-12
    )
    for name, radius in zip("OC", rho, strict=True):
        reaction = result.joints[name].reaction[-1]
        assert np.hypot(*reaction[:2]) == pytest.approx(F / math.cos(alpha), rel=1e-12)
        assert abs(reaction[2]) == pytest.approx(radius * F / math.cos(alpha), rel=1e-12)
