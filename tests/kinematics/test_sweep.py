"""Sweeps against closed forms: values, bounds, limits, work."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

import mechdae as md
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.motion.setup.drivers import plan
from mechdae.parts.bench.kinematics import true_error
from tests.reference.closed_forms import MECHANISMS
from tests.reference.jets import motion
from tests.shared.mechanisms import five_bar, four_bar
from tests.shared.strategies import bounded, scales

LONG = np.longdouble


SWEEPS = [
    ("four-bar-crank-rocker", "turn"),
    ("four-bar-double-rocker", "window"),
    ("geared-five-bar", "turns"),
    ("gorshkov-seven-link", "window"),
    ("jansen-leg", "turn"),
    ("peaucellier", "window"),
    ("planetary-gear-train", "turn"),
    ("scotch-yoke", "turn"),
    ("slider-crank", "turn"),
    ("slider-crank-offset", "turn"),
    ("watt-six-bar", "turn"),
    ("whitworth-quick-return", "turn"),
]


@pytest.mark.parametrize(("name", "task"), SWEEPS)
def test_whole_sweep_against_the_closed_form(name: str, task: str) -> None:
    problem = md.load(name)
    result = md.solve(problem, task, poses=97)
    assert set(result.status) <= {"ok", "limit"}
    _coordinate, driver = next(iter(result.drivers.items()))
    u = np.asarray(driver.position, dtype=LONG)
    speed, fine = driver.velocity[0], np.asarray(result.status) == "ok"
    closed = motion(MECHANISMS[name], u, speed)
    compared = 0
    condition = result.condition[fine]
    for part, series in [*result.points.items(), *result.bodies.items()]:
        if part not in closed[0]:
            continue
        for order, kind in enumerate(list(series)[:3]):
            theirs = np.asarray(closed[order][part])
            ours = series[kind]
            ours = ours[:, 0] + 1j * ours[:, 1] if np.ndim(ours) == 2 else ours
            rows = fine if order else np.isfinite(theirs)
            gap = np.abs(ours - theirs)[rows].astype(float)
            if order == 0:
                bound = result.bound.length if np.iscomplexobj(ours) else result.bound.angle
                slack = 4e-16 * (1 + np.abs(theirs[rows]).astype(float))
                assert np.all(gap <= bound[rows] + slack), (part, kind)
            else:
                size = float(np.nanmax(np.abs(theirs[rows])))
                allowed = 1e-14 * condition ** (2 * order - 1) * (size + abs(speed) ** order)
                assert np.all(gap <= allowed), (part, kind)
            compared += 1
    assert compared > 3


def test_pose_and_long_sweep_agree() -> None:
    """The same driver value gives the same pose from 5 poses and from 40 000."""
    few = md.solve("four-bar-crank-rocker", "turn", poses=5)
    many = md.solve("four-bar-crank-rocker", "turn", poses=40001)
    for kind in ("position", "velocity", "acceleration"):
        a = few.points["coupler.P"][kind]
        b = many.points["coupler.P"][kind][::10000]
        assert np.abs(a - b).max() <= 4e-16 * max(1.0, np.abs(b).max()) * 40


@pytest.mark.parametrize("name", ["four-bar-crank-rocker", "jansen-leg", "gorshkov-seven-link"])
def test_the_bound_holds_in_extended_precision(name: str) -> None:
    problem = md.load(name)
    task = md.Sweep(md.Driver("crank.angle", from_=-0.8, to=0.8), poses=301)
    setting = prepare(problem, task)
    poses = run(setting, task).poses
    error = true_error(setting.graphs, poses.x, poses.s[:, None], setting.assembler.p)
    assert np.all(error <= poses.error)
    assert error.max() > 1e-17


def test_errors_do_not_grow_with_turns() -> None:
    problem = md.load("geared-five-bar")
    task = md.Sweep(md.Driver("wheel.angle", from_=0, to=400 * math.pi), poses=801)
    result = md.solve(problem, task)
    assert np.all(result.status == "ok")
    first = md.solve(problem, md.Sweep(md.Driver("wheel.angle", from_=0, to=4 * math.pi), poses=9))
    B = result.points["crank.B"].position
    for k in range(9):
        again = B[k::8]
        assert np.abs(again - first.points["crank.B"].position[k]).max() < 5e-13
    assert result.bodies["crank"].angle[-1] == pytest.approx(
        result.bodies["crank"].angle[0] + 200 * math.pi, rel=1e-14
    )


@bounded
@given(scales)
def test_micrometres_and_kilometres_give_the_same_digits(scale: float) -> None:
    base = md.load("four-bar-double-rocker")
    reference = md.solve(base, "window", poses=33)
    values = base.mechanism.values()
    lengths = [n for n in base.mechanism.parameters if n in "abcd" or n.startswith("p")]
    assert len(lengths) >= 4
    scaled = base.with_values({name: values[name] * scale for name in lengths})
    result = md.solve(scaled, "window", poses=33)
    assert result.summary["limits"] == pytest.approx(reference.summary["limits"], rel=1e-13)
    fine = np.asarray(reference.status) == "ok"
    for point, series in reference.points.items():
        gap = result.points[point].position[fine] / scale - series.position[fine]
        assert np.abs(gap).max() < 1e-11 * np.abs(series.position[fine]).max() + 1e-13


# -- limits --------------------------------------------------------------------------------------


TOGGLE = four_bar(5, 3, 4.5, 7, crank=0.6, coupler=0.9, rocker=1.8)
TOGGLE_LIMIT = 1.314425749573080455380067264318397235054


def toggle_limit() -> float:
    """Return the crank angle at which coupler and rocker are in line."""
    return math.acos((5**2 + 7**2 - 7.5**2) / (2 * 5 * 7))


def test_limit_of_a_toggle_linkage() -> None:
    assert toggle_limit() == pytest.approx(TOGGLE_LIMIT, rel=1e-15)
    result = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=41))
    assert result.summary["limits"] == pytest.approx([-TOGGLE_LIMIT, TOGGLE_LIMIT], rel=1e-14)
    assert list(result.status[[0, -1]]) == ["limit", "limit"]
    assert np.all(result.status[1:-1] == "ok")
    assert result.fault is None
    assert np.isnan(result.bodies["rocker"].angular_velocity[[0, -1]]).all()
    assert np.isfinite(result.bodies["rocker"].angle).all()
    kinds = [event["kind"] for event in result.events]
    assert kinds == ["limit", "limit"]
    assert result.events[1]["joint"] == "C"
    assert result.events[1]["group"] == ["coupler", "rocker"]


@pytest.mark.parametrize("delta", [1e-3, 1e-6, 1e-9])
def test_close_to_a_limit_the_rates_are_right(delta: float) -> None:
    u = TOGGLE_LIMIT - delta
    result = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", at=[u])))
    assert result.status[0] == "ok"
    t = LONG(u)
    ax, ay = 5 * np.cos(t), 5 * np.sin(t)
    e2 = (7 - ax) ** 2 + ay**2
    cosine = (e2 + LONG("20.25") - 9) / (2 * LONG("4.5") * np.sqrt(e2))
    branch = 1 if result.bodies["rocker"].angle[0] > math.atan2(float(ay), float(ax - 7)) else -1
    t4 = np.arctan2(ay, ax - 7) + branch * np.arccos(cosine)
    t3 = np.arctan2(LONG("4.5") * np.sin(t4) - ay, 7 + LONG("4.5") * np.cos(t4) - ax)
    w4 = 5 * np.sin(t - t3) / (LONG("4.5") * np.sin(t4 - t3))
    allowed = 8 * np.finfo(float).eps * u / (2 * delta)
    assert result.bodies["rocker"].angular_velocity[0] == pytest.approx(float(w4), rel=allowed)
    assert result.condition[0] > 1 / math.sqrt(delta) / 10


@pytest.mark.parametrize("beyond", [1e-9, 1e-6, 1e-3, 0.1])
def test_beyond_a_limit_nothing_is_made_up(beyond: float) -> None:
    at = [TOGGLE_LIMIT - 0.1, TOGGLE_LIMIT + beyond]
    result = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", at=at)))
    assert list(result.status) == ["ok", "unassembled"]
    assert "1.31443" in result.fault or "75.311" in result.fault
    assert result.summary["failed"][0]["joint"] == "C"
    assert np.isnan(result.bodies["rocker"].angle[1])
    assert result.bodies["crank"].angle[1] == at[1]
    assert np.isnan(result.bound.angle[1])


def test_a_sweep_over_a_full_turn_reports_the_arc_without_pose() -> None:
    driver = md.Driver("crank.angle", from_=0, to=2 * math.pi)
    result = md.solve(TOGGLE, md.Sweep(driver, poses=361))
    lost = result.summary["failed"]
    assert len(lost) == 1
    assert lost[0]["from"] == pytest.approx(TOGGLE_LIMIT, rel=1e-13)
    assert lost[0]["to"] == pytest.approx(2 * math.pi - TOGGLE_LIMIT, rel=1e-13)
    assert result.fault is not None
    back = result.bodies["rocker"].angle[-1]
    assert back == pytest.approx(result.bodies["rocker"].angle[0], abs=1e-14)


def test_the_other_circuit_is_not_entered() -> None:
    """A Grashof double rocker has two arcs of the driven link; only one is reached."""
    mechanism = four_bar(4, 2, 5, 5.5, crank=1.0, coupler=0.4, rocker=2.0)
    whole = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=5))
    low, high = whole.summary["limits"]
    assert 0 < low < high < math.pi
    mirrored = -(low + high) / 2
    assert (
        md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[mirrored]))).summary["count"] == 2
    )
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[mirrored])))
    assert result.status[0] == "unassembled"
    assert "no motion from the sketch leads to it" in result.fault
    assert "[sketch] crank_deg" in result.fault


def test_named_poses_in_any_order() -> None:
    at = [0.5, -1.2, 1.3, 0.0, -0.5]
    result = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", at=at)))
    for k, value in enumerate(at):
        single = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", at=[value])))
        assert result.bodies["rocker"].angle[k] == pytest.approx(
            single.bodies["rocker"].angle[0], rel=1e-14
        )


def test_start_on_another_mode() -> None:
    modes = md.solve("gorshkov-seven-link", "modes")
    assert modes.labels == (("+", "+", "+"), ("+", "+", "-"), ("+", "-", "+"), ("+", "-", "-"))
    for k, labels in enumerate(modes.labels):
        result = md.solve("gorshkov-seven-link", "pose", mode=",".join(labels))
        for point in ("slider.C", "coupler.E"):
            assert result.points[point].position[0] == pytest.approx(
                modes.points[point].position[k], abs=1e-14
            )
        assert result.summary["mode"] == ",".join(labels)
    with pytest.raises(md.UnknownName, match="the modes here are"):
        md.solve("gorshkov-seven-link", "pose", mode="-,-,-")


# -- drivers -------------------------------------------------------------------------------------


def test_a_slide_drives() -> None:
    mechanism = md.load("slider-crank").mechanism
    turn = md.solve("slider-crank", "turn", poses=25)
    k = 4
    slide = turn.joints["guide"].slide[k]
    rate = turn.joints["guide"].slide_velocity[k]
    second = turn.joints["guide"].slide_acceleration[k]
    sketch = {"crank": turn.bodies["crank"].angle[k] + 0.1, "rod": turn.bodies["rod"].angle[k]}
    driven = replace(mechanism, sketch={**sketch, "guide": slide + 0.001})
    driver = md.Driver("guide.slide", at=[slide], speed=rate, acceleration=second)
    result = md.solve(driven, md.Sweep(driver))
    assert result.status[0] == "ok"
    crank = result.bodies["crank"]
    assert crank.angle[0] == pytest.approx(turn.bodies["crank"].angle[k], rel=1e-13)
    speed = turn.drivers["crank.angle"].velocity[k]
    assert crank.angular_velocity[0] == pytest.approx(speed, rel=1e-12)
    assert crank.angular_acceleration[0] == pytest.approx(0.0, abs=1e-9 * speed**2)


def test_two_drivers() -> None:
    drivers = [
        md.Driver("left.angle", from_=2.0, to=2.3, speed=0.4, acceleration=0.3),
        md.Driver("right.angle", from_=1.0, to=0.7, speed=-0.3, acceleration=0.1),
    ]
    result = md.solve(five_bar(), md.Sweep(drivers=drivers, poses=9))
    assert np.all(result.status == "ok")
    s = np.linspace(0, 1, 9)

    def tip(a, b):
        p, q = 0.2 * np.exp(1j * a), 0.2 + 0.2 * np.exp(1j * b)
        half = (q - p) / 2
        height = np.sqrt(0.25**2 - np.abs(half) ** 2)
        return p + half + 1j * half / np.abs(half) * height

    C = tip(2.0 + 0.3 * s, 1.0 - 0.3 * s)
    ours = result.points["fore.C"].position
    assert np.abs(ours[:, 0] + 1j * ours[:, 1] - C).max() < 1e-15
    h = 1e-4

    def at(t):
        return tip(2.0 + 0.3 * s + 0.4 * t + 0.15 * t * t, 1.0 - 0.3 * s - 0.3 * t + 0.05 * t * t)

    velocity = (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)
    acceleration = (at(h) - 2 * at(0) + at(-h)) / h**2
    v, a = result.points["fore.C"].velocity, result.points["fore.C"].acceleration
    assert np.abs(v[:, 0] + 1j * v[:, 1] - velocity).max() < 1e-11
    assert np.abs(a[:, 0] + 1j * a[:, 1] - acceleration).max() < 1e-6


def test_derivatives_only_as_asked() -> None:
    task = md.Sweep(md.Driver("crank.angle", at=[0.5]), derivatives=0)
    result = md.solve("slider-crank", task)
    assert set(result.points["rod.C"]) == {"position"}
    assert "velocity" not in result.drivers["crank.angle"]


# -- work ----------------------------------------------------------------------------------------


def test_work_of_a_turn() -> None:
    """A turn takes about 128 path steps and one Newton step per pose, however many poses."""
    for poses in (10, 2000):
        result = md.solve("four-bar-crank-rocker", "turn", poses=poses)
        work = result.summary["work"]
        assert work["path_steps"] <= 140
        assert work["rejected_steps"] <= 5
        assert work["refined_poses"] <= 5
        assert work["pose_evaluations"] <= poses + 200


def test_work_near_a_limit_grows_with_the_logarithm() -> None:
    result = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=41))
    assert result.summary["work"]["path_steps"] < 400


def test_two_drivers_stop_at_a_limit() -> None:
    drivers = [
        md.Driver("left.angle", from_=2.0, to=2.4),
        md.Driver("right.angle", from_=1.0, to=0.7),
    ]
    result = md.solve(five_bar(), md.Sweep(drivers=drivers, poses=9))
    assert list(result.status) == ["ok"] * 8 + ["unassembled"]
    assert result.events[0]["kind"] == "limit"
    left, right = result.events[0]["at"]
    assert (left - 2.0) / 0.4 == pytest.approx((1.0 - right) / 0.3, rel=1e-12)
    p, q = 0.2 * np.exp(1j * left), 0.2 + 0.2 * np.exp(1j * right)
    assert abs(p - q) == pytest.approx(0.5, rel=1e-13)


def test_a_pose_builds_no_other_group() -> None:
    setting = prepare(md.load("gorshkov-seven-link"), md.load("gorshkov-seven-link").tasks["turn"])
    assert [group.name for group in setting.scene.groups] == [
        "I(1)",
        "II.3 RPR(2,3)",
        "II.2 RRP(4,5)",
    ]


# -- faults in the description -------------------------------------------------------------------


def test_sketch_that_does_not_assemble() -> None:
    problem = md.load("gorshkov-seven-link").with_values({"BE": 0.1})
    with pytest.raises(md.AssemblyError, match=r"II\.1 RRR\(6,7\).*joint E stays open by 0\.36"):
        md.solve(problem, "pose")


def test_sketch_that_does_not_tell_the_mode() -> None:
    problem = md.load("gorshkov-seven-link")
    sketch = {"crank": 0.7, "rod": 1.3, "connecting_rod": -0.7}
    poor = replace(problem, mechanism=replace(problem.mechanism, sketch=sketch))
    with pytest.raises(md.MechanismError, match=r"one of rocker_deg, coupler_deg"):
        md.solve(poor, "pose")


def test_bodies_that_are_not_sketched_are_solved_for() -> None:
    result = md.solve("gorshkov-seven-link", "pose")
    assert "block" not in md.load("gorshkov-seven-link").mechanism.sketch
    assert result.bodies["block"].angle[0] == pytest.approx(result.bodies["rod"].angle[0])


def test_plan_refuses_nonsense() -> None:
    mechanism = md.load("slider-crank").mechanism
    same = md.Sweep(md.Driver("crank.angle", from_=1, to=1))
    with pytest.raises(md.InputError, match="same value"):
        plan(mechanism, same)
    with pytest.raises(md.InputError, match="at most"):
        plan(mechanism, md.Sweep(md.Driver("crank.angle", from_=0, to=1), poses=90_000_000))


def test_bounds_are_enlarged_where_unknowns_outgrow_them() -> None:
    """A fast geared body turns further than was assumed from the driver's range."""
    problem = md.load("planetary-gear-train")
    driver = md.Driver("carrier.angle", from_=0, to=40.0)
    result = md.solve(problem, md.Sweep(driver, poses=9))
    assert np.all(result.status == "ok")
    sun = result.bodies["sun"].angle
    assert np.ptp(sun) > 2 * 40.0
    assert np.diff(sun) == pytest.approx(np.full(8, (sun[-1] - sun[0]) / 8), rel=1e-12)


def test_requests_of_later_versions_are_refused() -> None:
    with pytest.raises(md.UnavailableError, match="above the third"):
        md.solve("slider-crank", md.Sweep(md.Driver("crank.angle", at=[1]), derivatives=4))


def test_both_ends_of_a_driving_slide_are_limits() -> None:
    """A dyad behind another dyad, driven from the far end: folds, no dead points."""
    mechanism = four_bar(0.03, 0.09, 0.08, 0.1, crank=1.0, coupler=0.6, rocker=1.7)
    bodies = [*mechanism.bodies.values(), md.Body("rod", {"C": (0, 0), "E": (0.12, 0)})]
    joints = [
        *mechanism.joints.values(),
        md.Revolute("Cr", "rocker.C", "rod.C"),
        md.Revolute("E", "rod.E", "slider.E"),
        md.Prismatic("guide", "ground.D", "slider.E"),
    ]
    sketch = {**mechanism.sketch, "rod": -0.7, "guide": 0.06}
    whole = md.Mechanism(
        mechanism.ground, [*bodies, md.Body("slider", {"E": (0, 0)})], joints, sketch=sketch
    )
    result = md.solve(whole, md.Sweep(md.Driver("guide.slide", range="assembled"), poses=9))
    assert [event["kind"] for event in result.events] == ["limit", "limit"]
    assert result.fault is None
    # crank and coupler in one line: |AC| = b - a or a + b decides the rocker's angle
    ends = []
    for reach in (0.06, 0.12):
        rocker = np.pi - np.arccos((0.08**2 + 0.1**2 - reach**2) / (2 * 0.08 * 0.1))
        C = 0.08 * np.exp(1j * rocker)
        ends.append(C.real + np.sqrt(0.12**2 - C.imag**2))
    assert result.summary["limits"] == pytest.approx(sorted(ends), rel=1e-12)


def test_an_arc_that_never_closes_is_said_to_be_cut() -> None:
    """A gear ratio that is not rational: no limit, and no turn leads back to the first pose."""
    problem = md.load("geared-five-bar").with_values({"i42": "-sqrt(2)"})
    driver = md.Driver("wheel.angle", range="assembled")
    result = md.solve(problem, md.Sweep(driver, poses=5))
    assert result.summary["limits"] == [None, None]
    assert "no end of the assembled arc was found" in result.summary["notes"][-1]
    assert np.all(result.status == "ok")
    # closure without the package: the rocker's pin C from both sides, the gear equation
    crank, coupler = result.bodies["crank"].angle, result.bodies["coupler"].angle
    C = 0.1 + 0.048 * np.exp(1j * crank) - 0.09 * np.exp(1j * coupler)
    assert np.abs(C) == pytest.approx([0.08] * 5, rel=1e-14)
    wheel = result.drivers["wheel.angle"].position
    assert wheel - crank == pytest.approx(-np.sqrt(2) * (coupler - crank), rel=1e-13)
    assert abs(crank[2] - math.radians(20)) < 0.3


# -- cases that once went wrong ------------------------------------------------------------------


def four_bar_tip(u) -> np.ndarray:
    """Return C of the crank-rocker 1, 3, 2.5, 3.2 (open mode) as complex numbers."""
    B = np.exp(1j * np.asarray(u, LONG))
    D = LONG(3.2) - B
    L = abs(D)
    along = (L * L + 9 - LONG(2.5) ** 2) / (2 * L)
    return B + D / L * (along + 1j * np.sqrt(9 - along * along))


@pytest.mark.parametrize(("ratio", "comes_back"), [(0.37, False), (-0.5, False), (2.0, True)])
def test_poses_a_whole_turn_away_with_a_planet(ratio: float, comes_back: bool) -> None:
    """Crank and rocker are the same there, the planet only if it made whole turns meanwhile."""
    mechanism = replace(
        TOGGLE,
        bodies=[
            *TOGGLE.bodies.values(),
            md.Body("wheel", {"B": (0, 0), "P": (1, 0)}),
            md.Body("hand", {"P": (0, 0), "Q": (1, 0)}),
        ],
        joints=[
            *TOGGLE.joints.values(),
            md.Revolute("W", "crank.B", "wheel.B"),
            md.Gear("mesh", "wheel.B", "coupler.B", ratio=ratio, carrier="crank"),
            md.Weld("P", "wheel.P", "hand.P", turn=0.5),
        ],
    )
    sweep = md.Sweep(md.Driver("crank.angle", from_=0.0, to=6.0), poses=61)
    result = md.solve(mechanism, sweep)
    u = result.drivers["crank.angle"].position
    here, back = u < TOGGLE_LIMIT, u > 2 * np.pi - TOGGLE_LIMIT
    assert set(result.status[here]) == {"ok"}
    assert set(result.status[~here & ~back]) == {"unassembled"}
    assert set(result.status[back]) == {"ok" if comes_back else "unassembled"}
    plain = md.solve(TOGGLE, sweep)
    assert np.array_equal(plain.status == "ok", here | back)
    # the wheel as far as the coupler takes it, without the hand where it is not
    coupler, wheel = (result.bodies[name].angle for name in ("coupler", "wheel"))
    gap = np.exp(1j * (coupler - plain.bodies["coupler"].angle)) - 1
    assert np.abs(gap[here | back]).max() < 1e-13
    known = here | (back & comes_back)
    assert np.abs((wheel - u - ratio * (coupler - u))[known]).max() < 1e-13
    for name in ("wheel", "hand"):
        assert np.array_equal(np.isfinite(result.bodies[name].angle), known)


@pytest.mark.parametrize("angle", [-7.2, -0.3, 13.0, 1000.0])
def test_a_sketch_turns_away_from_zero(angle: float) -> None:
    C = four_bar_tip(angle)
    sketch = {
        "crank": angle,
        "coupler": float(np.angle(C - np.exp(1j * angle))),
        "rocker": float(np.angle(C - 3.2)),
    }
    mechanism = four_bar(1, 3, 2.5, 3.2, **sketch)
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=37))
    assert np.all(result.status == "ok")
    ours = result.points["rocker.C"].position
    gap = np.abs(
        ours[:, 0] + 1j * ours[:, 1] - four_bar_tip(result.drivers["crank.angle"].position)
    )
    assert np.all(gap.astype(float) <= result.bound.length + 4e-16 * 4)


@pytest.mark.parametrize("offset", [0.0, 10.0, 1000.0])
def test_the_origin_of_a_frame_does_not_matter(offset: float) -> None:
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (1.2, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "P": (1, 0)}),
            md.Body("arm", {"A": (offset, 0), "B": (offset + 0.9, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("P", "crank.P", "arm.A"),
            md.Distance("bar", "arm.B", "ground.G", length=0.48),
        ],
        sketch={"crank": 0.6, "arm": -1.0},
    )
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", from_=0, to=2), poses=9))
    assert [event["kind"] for event in result.events] == ["limit", "limit"]
    # the data themselves are rounded: offset + 0.9 has an error of eps * offset / 2
    slack = 1e-13 + 4e-16 * offset
    ends = [0.33876240118795971, 1.345734462487903]
    assert [event["at"] for event in result.events] == pytest.approx(ends, abs=slack)
    assert result.summary["work"]["path_steps"] < 1000
    assert np.nanmax(result.bound.length) < 1e-13 * (1 + offset)


def test_a_pole_ends_the_path_and_spoils_nothing_else() -> None:
    """Two guides become parallel: the slides run away, the other dyad knows nothing of it."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "G": (1, 0), "H": (-1, 0.5), "K": (2, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": (0.3, 0)}),
            md.Body("a", {"P": (0, 0)}),
            md.Body("b", {"P": (0, 0)}),
            md.Body("rod", {"B": (0, 0), "C": (2, 0)}),
            md.Body("lever", {"K": (0, 0), "C": (1, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Prismatic("s", "crank.O", "a.P"),
            md.Prismatic("t", "ground.G", "b.P", axis=np.pi / 2),
            md.Revolute("P", "a.P", "b.P"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "lever.C"),
            md.Revolute("K", "ground.K", "lever.K"),
        ],
        sketch={"crank": 0.3, "rod": 0.5, "lever": 1.5},
    )
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", from_=-1, to=2), poses=31))
    poles = [event for event in result.events if event["kind"] == "pole"]
    assert poles
    assert all(abs(abs(event["at"]) - np.pi / 2) < 0.01 for event in poles)
    assert "guides become parallel" in result.fault
    early = result.drivers["crank.angle"].position < 1.5
    assert np.all(result.status[early] == "ok")
    assert result.joints["s"].slide[early] == pytest.approx(
        1 / np.cos(result.drivers["crank.angle"].position[early]), rel=1e-12
    )
    late = ~early & (np.asarray(result.status) == "unassembled")
    assert late.any()
    assert np.isfinite(result.bodies["lever"].angle[late]).all()
    alone = md.solve(
        mechanism, md.Sweep(md.Driver("crank.angle", from_=-1, to=2), poses=31, outputs=["lever"])
    )
    assert np.all(alone.status == "ok")


def test_bounds_do_not_know_the_unit_of_length() -> None:
    loose = []
    for size in (1e-6, 1.0, 1e6):
        mechanism = md.Mechanism(
            ground=md.Ground({"O": (0, 0), "G": (size, 0)}),
            bodies=[
                md.Body("cylinder", {"O": (0, 0)}),
                md.Body("rod", {"C": (0, 0)}),
                md.Body("lever", {"G": (0, 0), "C": (0.6 * size, 0)}),
            ],
            joints=[
                md.Revolute("O", "ground.O", "cylinder.O"),
                md.Prismatic("s", "cylinder.O", "rod.C"),
                md.Revolute("C", "rod.C", "lever.C"),
                md.Revolute("G", "ground.G", "lever.G"),
            ],
            sketch={"cylinder": 0.5, "lever": 2.0, "s": 0.9 * size},
        )
        driver = md.Driver("s.slide", from_=0.7 * size, to=1.3 * size)
        result = md.solve(mechanism, md.Sweep(driver, poses=9))
        assert np.all(result.status == "ok")
        loose.append(result.bound.length.max() / size)
        C = result.points["lever.C"].position / size
        assert np.hypot(*C.T) == pytest.approx(np.linspace(0.7, 1.3, 9), rel=1e-14)
    assert loose == pytest.approx([loose[0]] * 3, rel=1e-6)
    assert loose[0] < 1e-12


def test_swing_does_not_depend_on_the_grid() -> None:
    whole = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=5))
    through = md.solve(TOGGLE, md.Sweep(md.Driver("crank.angle", from_=-3, to=3), poses=7))
    for body in ("coupler", "rocker"):
        assert through.summary["swing"][body] == pytest.approx(
            whole.summary["swing"][body], rel=1e-12
        )


def test_the_assembled_range_is_done_when_geared_bodies_are_back_too() -> None:
    """Sun 20, planet 16, fixed ring 52: the arm turns by 20/72 of the sun, the planet by -45/72.

    Willis: arm = s/(1 + 52/20) = 5/18 s, planet - arm = -20/16 (s - arm), so that the planet turns
    by 5/18 s - 5/4 13/18 s = -5/8 s; both are whole after 72 turns of the sun.
    """
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("sun", points={"O": [0, 0]}),
            md.Body("arm", points={"O": [0, 0], "P": [0.036, 0]}),
            md.Body("planet", points={"P": [0, 0], "X": [0.016, 0]}),
        ],
        joints=[
            md.Revolute("S", "ground.O", "sun.O"),
            md.Revolute("A", "ground.O", "arm.O"),
            md.Revolute("P", "arm.P", "planet.P"),
            md.Gear("g1", "sun.O", "planet.P", teeth=(20, 16), mesh="external", carrier="arm"),
            md.Gear("g2", "planet.P", "ground.O", teeth=(16, 52), mesh="internal", carrier="arm"),
        ],
        sketch={"sun": 0.0},
    )
    sweep = md.Sweep(md.Driver("sun.angle", range="assembled"), poses=3)
    result = md.solve(mechanism, sweep)
    assert result.drivers["sun.angle"].position[-1] == pytest.approx(72 * 2 * math.pi)
    assert result.summary["swing"]["arm"] == pytest.approx(20 * 2 * math.pi)
    assert result.summary["swing"]["planet"] == pytest.approx(45 * 2 * math.pi)
    path = result.points["planet.X"].position
    assert path[-1] == pytest.approx(path[0], abs=1e-14)
    only = md.solve(mechanism, replace(sweep, outputs=["sun"]))  # neither arm nor planet in it
    assert only.drivers["sun.angle"].position[-1] == pytest.approx(2 * math.pi)


def test_a_rack_that_only_goes_on_is_shown_over_one_turn() -> None:
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[md.Body("wheel", points={"O": [0, 0]}), md.Body("rack", points={"T": [0, 0]})],
        joints=[
            md.Revolute("O", "ground.O", "wheel.O"),
            md.Prismatic("guide", "ground.O", "rack.T"),
            md.Rack("mesh", "wheel.O", "rack.T", radius=0.02),
        ],
        sketch={"wheel": 0.0},
    )
    sweep = md.Sweep(md.Driver("wheel.angle", range="assembled"), poses=3)
    result = md.solve(mechanism, sweep)
    assert result.summary["stroke"]["guide"] == pytest.approx(2 * math.pi * 0.02)
    (note,) = result.summary["notes"]
    assert note.startswith("rack does not come back")


@pytest.mark.parametrize(("crank", "slide"), [(0.0, 3.5), (np.pi, 1.5)])
def test_a_motion_that_begins_on_a_limit_position_says_so(crank: float, slide: float) -> None:
    """Crank and rod in line: two mirrored motions leave the pose, no limit is known beyond."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "B": (1.0, 0)}),
            md.Body("rod", {"B": (0, 0), "C": (2.5, 0)}),
            md.Body("slider", {"C": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "slider.C"),
            md.Prismatic("guide", "ground.O", "slider.C"),
        ],
        sketch={"crank": crank, "rod": 0.0, "guide": slide},
    )
    for driver in (
        md.Driver("guide.slide", range="assembled"),
        md.Driver("guide.slide", from_=slide, to=5.0 - slide),
    ):
        result = md.solve(mechanism, md.Sweep(driver, poses=3))
        assert "ok" not in result.status
        assert "limits" not in result.summary
        assert f"the motion begins at guide.slide = {slide} m" in result.fault
        assert "sketch a pose beside it" in result.fault
