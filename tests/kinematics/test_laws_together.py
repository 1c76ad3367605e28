"""Laws of time and several drivers with curve joints, jerk, measures and named outputs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError, UnavailableError
from mechdae.motion.kinematics.prepared import prepare
from mechdae.results.tables import table
from tests.reference.closed_forms import MECHANISMS
from tests.reference.jets import derivatives
from tests.shared.mechanisms import cam, rod_and_slot
from tests.shared.series import jerk_of

LONG = np.longdouble
BENT = {"x": "0.02 + s", "y": "4*s**2 - 0.01", "range": (0, 0.07)}
END = complex(0.09, 4 * 0.07**2 - 0.01)


def law(coordinate: str, text: str, last: float, first: float = 0.0) -> md.Driver:
    return md.Driver(coordinate, law=text, from_=first, to=last)


def sweep(mechanism, *drivers: md.Driver, **keys) -> md.Result:
    return md.solve(mechanism, md.Sweep(drivers=list(drivers), **keys))


def on_carriage() -> md.Mechanism:
    """A crank and a rod whose end is guided by a bent slot in a carriage: two drivers."""
    mechanism = rod_and_slot(**BENT)
    crank, rod = mechanism.bodies["crank"], mechanism.bodies["rod"]
    joints = [joint for name, joint in mechanism.joints.items() if name != "slot"]
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (0, 0)}),
        bodies=[crank, rod, md.Body("carriage", {"Q": (0, 0)})],
        joints=[
            *joints,
            md.Curve("slot", "carriage.Q", "rod.B", **BENT),
            md.Prismatic("base", "ground.Q", "carriage.Q"),
        ],
        sketch={"crank": 2.0, "rod": -0.3, "base": 0.0},
    )


def stop(base: float) -> float:
    """Return the crank's angle at which B is at the end of the slot, the rod to the right."""
    end = END + base
    half = math.acos((0.03**2 + abs(end) ** 2 - 0.08**2) / (2 * 0.03 * abs(end)))
    return math.atan2(end.imag, end.real) + half


# -- jerk ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["four-bar-crank-rocker", "whitworth-quick-return"])
def test_jerk_along_a_law(name: str) -> None:
    mechanism = md.load(name).mechanism
    result = sweep(mechanism, law("crank.angle", "1 + sin(3*t)", 2), poses=31, derivatives=3)
    t = np.asarray(result.time, LONG)
    u = 1 + np.sin(3 * t)
    rates = 3 * np.cos(3 * t), -9 * np.sin(3 * t), -27 * np.cos(3 * t)
    assert np.abs(result.drivers["crank.angle"].jerk - rates[2].astype(float)).max() < 1e-13
    closed = derivatives(MECHANISMS[name], u, 3)
    compared = 0
    for part, series in [*result.points.items(), *result.bodies.items()]:
        if part not in closed[0]:
            continue
        f1, f2, f3 = (np.asarray(closed[k][part]) for k in (1, 2, 3))
        theirs = f3 * rates[0] ** 3 + 3 * f2 * rates[0] * rates[1] + f1 * rates[2]
        gap = np.abs(jerk_of(series) - theirs).astype(float)
        assert gap.max() <= 1e-13 * float(np.abs(theirs).max()) + 1e-300, part
        compared += 1
    assert compared


def test_a_jump_of_the_third_derivative_leaves_the_others() -> None:
    mechanism = md.load("four-bar-crank-rocker").mechanism
    crank = law("crank.angle", "1 + max(t - 1, 0)**3", 2)
    result = sweep(mechanism, crank, poses=5, derivatives=3)
    driver = result.drivers["crank.angle"]
    assert np.isnan(driver.jerk).tolist() == [False, False, True, False, False]
    assert driver.jerk[[0, 1, 3, 4]].tolist() == [0, 0, 6, 6]
    assert (
        np.isnan(result.bodies["rocker"].angular_jerk).tolist()
        == [False, False, True] + [False] * 2
    )
    assert np.isfinite(result.bodies["rocker"].angular_acceleration).all()
    assert result.summary["notes"] == ["a law has no third derivative at t = 1"]
    with pytest.raises(InputError, match="a law of time gives its rates itself"):
        sweep(mechanism, replace(crank, jerk=1.0), poses=5)


# -- curves ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["0.3 + 2*sin(3*t)", "0.3 + 3*min(t, 0.5)**2"])
def test_a_cam_follows_a_law_that_turns_back_or_rests(text: str) -> None:
    """An eccentric circle and a point follower are a slider-crank."""
    result = sweep(cam("0.01 + 0.038*cos(s)", "0.038*sin(s)"), law("cam.angle", text, 2), poses=41)
    assert set(result.status) == {"ok"}
    assert result.summary["bound"] == "proved"
    t = result.time.astype(LONG)
    rests = "min" in text
    u = LONG(0.3) + (3 * np.minimum(t, 0.5) ** 2 if rests else 2 * np.sin(3 * t))
    du = np.where(t < 0.5, 6 * t, 0) if rests else 6 * np.cos(3 * t)
    x, root = LONG(0.01) * np.cos(u), np.sqrt(LONG(0.038) ** 2 - (LONG(0.01) * np.cos(u)) ** 2)
    point = result.points["follower.N"]
    y = LONG(0.01) * np.sin(u) + root
    assert np.abs(point.position[:, 1] - y).max() < 1e-16
    speed = (x + x * LONG(0.01) * np.sin(u) / root) * du
    fine = np.isfinite(point.velocity[:, 1])
    assert (~fine).sum() == (1 if rests else 0)  # the corner at t = 0.5
    assert np.abs(point.velocity[fine, 1] - speed[fine]).max() < 1e-15


def test_a_law_ends_where_the_slot_does() -> None:
    mechanism = rod_and_slot(x="s", y=0, range=(0.055, 0.09))
    result = sweep(mechanism, law("crank.angle", "1.6 + t", 1.4), poses=15)
    end = math.acos((0.03**2 + 0.055**2 - 0.08**2) / (2 * 0.03 * 0.055))
    (event,) = result.events
    assert (event["kind"], event["joint"]) == ("end_of_curve", "slot")
    assert event["time"] == pytest.approx(end - 1.6, rel=1e-13)
    assert event["at"] == pytest.approx(end, rel=1e-13)
    assert np.array_equal(result.status == "ok", result.time <= event["time"])
    assert result.summary["failed"][0]["time"][0] == event["time"]
    assert "the contact of joint slot is at the end of its curve" in str(result.fault)
    assert "end of curve t = 0.8" in table(result)


def test_the_end_of_a_slot_along_lines_legs_and_one_driver() -> None:
    """The carriage moves too: the place where B comes to the end of its slot, by cosines."""
    mechanism = on_carriage()

    def there(share: float) -> float:
        """Return how far the crank, 1.5 - share, is above its angle at the end."""
        return 1.5 - share - stop(0.01 * share)

    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if there(middle) > 0 else (low, middle)
    ends = ("crank.angle", 1.5, 0.5), ("base.slide", 0.0, 0.01)
    line = sweep(mechanism, *(md.Driver(c, from_=a, to=b) for c, a, b in ends), poses=11)
    legs = sweep(mechanism, *(md.Driver(c, at=np.linspace(a, b, 11).tolist()) for c, a, b in ends))
    by_law = sweep(
        mechanism,
        law("crank.angle", "1.5 - t**2", 1),
        md.Driver("base.slide", law="0.01*t**2"),
        poses=11,
    )
    for result in (line, legs, by_law):
        (event,) = (event for event in result.events if event["in_range"])
        assert (event["kind"], event["joint"]) == ("end_of_curve", "slot")
        assert event["at"] == pytest.approx([1.5 - low, 0.01 * low], rel=1e-12)
        place = (1.5 - result.drivers["crank.angle"].position) <= low
        assert np.array_equal(result.status == "ok", place)
        assert result.summary["failed"][0]["joint"] == "slot"
        assert 0 < place.sum() < len(place)
    assert by_law.events[0]["time"] == pytest.approx(math.sqrt(low), rel=1e-12)
    held = sweep(
        mechanism,
        md.Driver("crank.angle", range="assembled"),
        md.Driver("base.slide", at=[0.005]),
        poses=5,
    )
    assert held.summary["limits"][0] == pytest.approx(stop(0.005), rel=1e-12)
    assert {event["kind"] for event in held.events} == {"end_of_curve"}


def test_the_parameter_of_a_curve_is_driven_by_a_law() -> None:
    mechanism = rod_and_slot(**BENT)
    mechanism = replace(mechanism, sketch={"slot": 0.05, "crank": 1.6})
    result = sweep(mechanism, law("slot.s", "0.05 + 0.04*t", 1), poses=9)
    assert list(result.status) == ["ok"] * 5 + ["unassembled"] * 4
    assert result.events[0]["time"] == pytest.approx(0.5, rel=1e-13)
    s, B = 0.05 + 0.04 * result.time[:5], result.points["rod.B"]
    assert np.abs(B.position[:5] - np.stack([0.02 + s, 4 * s**2 - 0.01], axis=1)).max() < 1e-16
    assert np.abs(B.velocity[:5] - 0.04 * np.stack([1 + 0 * s, 8 * s], axis=1)).max() < 1e-14
    assert "t [s]" in table(result)


def test_a_roller_that_cuts_along_a_law() -> None:
    """At the place that a sweep of the cam itself finds, and its time."""
    mechanism = cam("0.05*cos(s)", "0.04*sin(s)", 0.035, 0.005, side="left")
    result = sweep(mechanism, law("cam.angle", "0.3 + t/2", 2.6), poses=25)
    (cut,) = result.summary["undercut"]
    (event,) = (event for event in result.events if event["kind"] == "undercut")
    assert cut["from"] == pytest.approx(math.pi / 2, abs=2e-3)
    assert cut["time"][0] == event["time"] == pytest.approx(2 * (cut["from"] - 0.3), rel=1e-12)
    assert "the roller of joint profile cuts into its curve" in str(result.fault)
    assert "at t = 2.5" in str(result.fault)


def test_straight_lines_of_a_scene_keep_their_own_bounds() -> None:
    """What curves divide by is numbered by each set of kernels for itself."""
    problem = md.load("cam-roller-follower")
    task = md.Sweep(law("cam.angle", "0.5 + t", 0.2), poses=3)
    graphs = prepare(problem, task).graphs
    assert graphs.straight.floors is not graphs.floors
    result = md.solve(problem, task)
    assert set(result.status) == {"ok"}
    at = md.solve(problem, md.Sweep(md.Driver("cam.angle", at=[0.5, 0.6, 0.7])))
    assert np.abs(result.joints["profile"].s - at.joints["profile"].s).max() < 1e-15


# -- measures and named outputs --------------------------------------------------------------------


def test_measures_where_other_drivers_are_held() -> None:
    """A crank against a held carriage is the same mechanism with one driver."""
    asked = {"measures": ["extremes", "transmission", "curve"], "poses": 31}
    crank = md.Driver("crank.angle", from_=1.2, to=2.4, speed=2.0)
    held = sweep(on_carriage(), crank, md.Driver("base.slide", at=[0.0]), **asked)
    alone = sweep(rod_and_slot(**BENT), crank, **asked)
    for name, ends in alone.summary["extremes"].items():
        for word, end in ends.items():
            assert held.summary["extremes"][name][word] == pytest.approx(end, rel=1e-12)
    lengths = [found.summary["curve"]["rod.B"]["length"] for found in (held, alone)]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-12)
    for theirs, ours in zip(alone.events, held.events, strict=True):
        assert ours["kind"] == theirs["kind"]
        assert ours["at"] == pytest.approx([theirs["at"], 0.0], rel=1e-12)


def test_measures_along_a_law() -> None:
    """Those of single poses are given, those along a driver refused."""
    problem = md.load("four-bar-crank-rocker")
    crank = law("crank.angle", "1 + t + t**2", 2)
    result = md.solve(problem, md.Sweep(crank, poses=7, measures=["transmission", "curve"]))
    at = md.Driver("crank.angle", at=result.drivers["crank.angle"].position.tolist())
    same = md.solve(problem, md.Sweep(at, measures=["transmission", "curve"]))
    point, other = result.points["coupler.P"], same.points["coupler.P"]
    assert np.abs(point.curvature / other.curvature - 1).max() < 1e-11
    assert np.abs(np.exp(1j * (point.tangent - other.tangent)) - 1).max() < 1e-13
    for joint, series in same.joints.items():
        for name, array in series.items():
            if name == "transmission":
                assert np.abs(result.joints[joint][name] - array).max() < 1e-14
    with pytest.raises(UnavailableError, match="'extremes' needs a single driver that moves"):
        md.solve(problem, md.Sweep(crank, poses=7, measures=["extremes"]))


def test_named_outputs_know_the_time() -> None:
    mechanism = md.load("four-bar-crank-rocker").mechanism
    mechanism = replace(mechanism, outputs={"late": "t**2 + crank.angle"})
    by_law = sweep(mechanism, law("crank.angle", "1 + t**3", 3, 1), poses=5)
    late, t = by_law.outputs["late"], by_law.time
    assert t.tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    assert late.value == pytest.approx(t**2 + 1 + t**3, rel=1e-14)
    assert late.rate == pytest.approx(2 * t + 3 * t**2, rel=1e-14)
    assert late.second == pytest.approx(2 + 6 * t, rel=1e-14)
    other = replace(on_carriage(), outputs={"late": "t"})
    crank = md.Driver("crank.angle", from_=1.4, to=2.0, speed=2.0)
    held = md.Driver("base.slide", at=[0.0])
    result = sweep(other, held, crank, poses=4)
    assert result.outputs["late"].value == pytest.approx([0, 0.1, 0.2, 0.3], abs=1e-15)
