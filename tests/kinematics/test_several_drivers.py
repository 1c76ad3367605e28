"""Several drivers: straight legs, held drivers, differentials, cylinders, joints that drive."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.kernels.run.functions import StepChain
from mechdae.motion.kinematics.prepared import prepare
from mechdae.results.tables import table
from mechdae.tasks.check import check
from tests.reference.closed_forms import circle_circle
from tests.reference.jets import Jet, arg, unit
from tests.shared.mechanisms import five_bar

LONG = np.longdouble


def sweep(mechanism, *drivers: md.Driver, **keys) -> md.Result:
    return md.solve(mechanism, md.Sweep(drivers=list(drivers), **keys))


def tip(left, right, sign=1):
    """The pin C of `five_bar` by its crank angles."""
    p, q = 0.2 * unit(left), 0.2 + 0.2 * unit(right)
    return circle_circle(p, 0.25, q, 0.25, sign)


def place(result: md.Result, point: str):
    series = result.points[point].position
    return series[:, 0] + 1j * series[:, 1]


# -- from pose to pose -----------------------------------------------------------------------------


def test_legs_from_pose_to_pose(monkeypatch) -> None:
    """Many poses along a curve: proved leg by leg, 32 legs in one call of the kernel."""
    calls = []
    call = StepChain.__call__
    monkeypatch.setattr(StepChain, "__call__", lambda *given: calls.append(1) or call(*given))
    a = np.linspace(0, 2 * np.pi, 500)
    left, right = 2 + 0.2 * np.sin(a), 1 - 0.2 * np.sin(2 * a)
    result = sweep(
        five_bar(),
        md.Driver("left.angle", at=left.tolist(), speed=0.3),
        md.Driver("right.angle", at=right.tolist(), speed=-0.2),
    )
    assert set(result.status) == {"ok"}
    assert np.abs(place(result, "fore.C") - tip(left, right)).max() < 1e-15
    t = Jet.variable(np.zeros(500), 2)
    velocity = tip(left + 0.3 * t, right - 0.2 * t).c[1]
    ours = result.points["fore.C"].velocity
    assert np.abs(ours[:, 0] + 1j * ours[:, 1] - velocity).max() < 1e-14
    work = result.summary["work"]
    assert work["path_steps"] == 500
    assert work["rejected_steps"] == 0
    assert work["pose_evaluations"] == 500
    assert len(calls) <= 500 / 32 + 1


def test_legs_across_the_workspace() -> None:
    """Poses far from each other: each leg in as many steps as its proof needs."""
    random = np.random.default_rng(4)
    left = 2 + random.uniform(-0.2, 0.2, 60)
    right = 1 + random.uniform(-0.2, 0.2, 60)
    drivers = [
        md.Driver("left.angle", at=left.tolist()),
        md.Driver("right.angle", at=right.tolist()),
    ]
    result = sweep(five_bar(), *drivers)
    assert set(result.status) == {"ok"}
    assert np.abs(place(result, "fore.C") - tip(left, right)).max() < 1e-15
    assert 60 < result.summary["work"]["path_steps"] < 60 * 10
    mirrored = md.solve(five_bar(), md.Sweep(drivers=drivers, mode="+"))
    assert np.abs(place(mirrored, "fore.C") - tip(left, right, -1)).max() < 1e-15


def with_a_follower() -> md.Mechanism:
    """The five-bar with a dyad on its right crank that does not need the other one."""
    plain = five_bar()
    return replace(
        plain,
        ground=md.Ground({"A": (0, 0), "E": (0.2, 0), "G": (0.5, 0)}),
        bodies=[
            *plain.bodies.values(),
            md.Body("link", {"D": (0, 0), "F": (0.3, 0)}),
            md.Body("arm", {"G": (0, 0), "F": (0.2, 0)}),
        ],
        joints=[
            *plain.joints.values(),
            md.Revolute("Dl", "right.D", "link.D"),
            md.Revolute("F", "link.F", "arm.F"),
            md.Revolute("G", "ground.G", "arm.G"),
        ],
        sketch={**plain.sketch, "link": 0.2, "arm": 1.6},
    )


def test_groups_that_are_left_go_on_behind_a_limit() -> None:
    left, right = [2.0, 2.1, 2.6, 2.1], [1.2, 1.0, 0.7, 1.0]
    result = sweep(
        with_a_follower(),
        md.Driver("left.angle", at=left),
        md.Driver("right.angle", at=right),
    )
    assert list(result.status) == ["ok", "ok", "unassembled", "unassembled"]
    assert np.isnan(result.bodies["fore"].angle[2:]).all()
    D = 0.2 + 0.2 * unit(np.array(right))
    F = circle_circle(D, 0.3, 0.5 + 0 * D, 0.2, 1)
    assert np.abs(place(result, "arm.F") - F).max() < 1e-15
    event = result.events[0]
    assert event["group"] == ["fore", "aft"]
    p, q = 0.2 * unit(event["at"][0]), 0.2 + 0.2 * unit(event["at"][1])
    assert abs(p - q) == pytest.approx(0.5, rel=1e-13)
    assert (event["at"][0] - 2.1) / 0.5 == pytest.approx((1.0 - event["at"][1]) / 0.3, rel=1e-12)


def test_a_named_pose_on_a_limit() -> None:
    """Both cranks at 45 degrees to each other's side, forearms in one line."""
    half = math.acos(0.15 / 0.2)
    left, right = math.pi - half, half
    assert abs(0.2 * unit(left) - 0.2 - 0.2 * unit(right)) == pytest.approx(0.5, rel=1e-15)
    result = sweep(
        five_bar(),
        md.Driver("left.angle", at=[2.0, left]),
        md.Driver("right.angle", at=[1.0, right]),
    )
    assert list(result.status) == ["ok", "limit"]
    assert result.fault is None
    assert np.isnan(result.bodies["fore"].angular_velocity[1])
    assert place(result, "fore.C")[1] == pytest.approx(0.1 + 0.2j * math.sin(half), abs=1e-8)


def test_a_first_pose_behind_a_limit() -> None:
    result = sweep(
        five_bar(),
        md.Driver("left.angle", from_=2.6, to=2.7),
        md.Driver("right.angle", from_=0.7, to=0.6),
        poses=3,
    )
    assert list(result.status) == ["unassembled"] * 3
    assert "limit position at left.angle = 141.217 deg, right.angle" in (result.fault or "")
    assert "no assembly mode exists at the first pose" in (result.fault or "")
    with pytest.raises(md.SolveError, match="held drivers"):
        sweep(
            five_bar(),
            md.Driver("right.angle", range="assembled"),
            md.Driver("left.angle", at=[3.5]),
        )


def parallelogram_and_wheel() -> md.Mechanism:
    plain = md.load("change-point-parallelogram").mechanism
    return replace(
        plain,
        bodies=[*plain.bodies.values(), md.Body("wheel", {"A": (0, 0)})],
        joints=[*plain.joints.values(), md.Revolute("W", "ground.A", "wheel.A")],
        sketch={**plain.sketch, "wheel": 0.0},
    )


@pytest.mark.parametrize("count", [4, 13, 300])
def test_legs_over_change_points(count: int) -> None:
    """Both branches are kept over two change points, however near to them a pose lies."""
    crank = np.linspace(math.pi / 3, math.pi / 3 + 7, count)
    drivers = [
        md.Driver("crank.angle", at=crank.tolist()),
        md.Driver("wheel.angle", at=np.sin(crank).tolist()),
    ]
    result = sweep(parallelogram_and_wheel(), *drivers)
    assert set(result.status) == {"ok"}
    assert np.abs(result.bodies["rocker"].angle - crank).max() < 1e-13
    assert [event["kind"] for event in result.events] == ["change_point"] * 2
    places = [event["at"][0] for event in result.events]
    assert places == pytest.approx([math.pi, 2 * math.pi], rel=1e-14)
    crossed = sweep(parallelogram_and_wheel(), *drivers, mode="+")
    assert set(crossed.status) == {"ok"}
    # anti-parallelogram: tan(rocker/2) = -(d + a)/(d - a) tan(crank/2), here -2
    rocker = 2 * np.arctan2(-2 * np.sin(crank / 2), np.cos(crank / 2))
    assert np.abs(np.sin((crossed.bodies["rocker"].angle - rocker) / 2)).max() < 1e-12


def test_a_corner_on_a_change_point_ends_the_motion() -> None:
    """No leg begins where two branches meet: nothing is claimed from there on."""
    result = sweep(
        parallelogram_and_wheel(),
        md.Driver("crank.angle", at=[1.0, math.pi, 4.0]),
        md.Driver("wheel.angle", at=[0.0, 0.1, 0.2]),
    )
    assert list(result.status) == ["ok", "unassembled", "unassembled"]
    assert result.events[0]["at"][0] == pytest.approx(math.pi, abs=1e-6)
    assert "the motion stops at crank.angle = 180 deg" in (result.fault or "")
    assert result.bodies["wheel"].angle == pytest.approx([0.0, 0.1, 0.2])


def test_poses_that_are_the_sketch_itself() -> None:
    result = sweep(
        five_bar(), md.Driver("left.angle", at=[2.0]), md.Driver("right.angle", at=[1.0])
    )
    assert list(result.status) == ["ok"]
    assert result.summary["work"]["path_steps"] == 1
    assert place(result, "fore.C")[0] == pytest.approx(tip(2.0, 1.0), rel=1e-14)


# -- lines -----------------------------------------------------------------------------------------


def test_extremes_along_a_line() -> None:
    """The swing along a line is refined: it does not depend on the number of poses."""
    drivers = [
        md.Driver("left.angle", from_=2.0, to=2.3),
        md.Driver("right.angle", from_=0.6, to=2.6),
    ]
    few, many = (sweep(five_bar(), *drivers, poses=n).summary["swing"] for n in (3, 300))
    assert few == pytest.approx(many, rel=1e-13)
    s = np.linspace(0, 1, 400001)
    left, right = 2 + 0.3 * s, 0.6 + 2.0 * s
    fore = np.angle(tip(left, right) - 0.2 * unit(left))
    assert many["fore"] == pytest.approx(np.ptp(fore), rel=1e-10)
    assert np.ptp(fore) > 1.01 * abs(fore[-1] - fore[0])


# -- one driver moves, others are held -------------------------------------------------------------


def test_the_assembled_arc_with_a_held_driver() -> None:
    result = sweep(
        five_bar(),
        md.Driver("left.angle", range="assembled", speed=2.0, acceleration=3.0),
        md.Driver("right.angle", at=[1.2]),
        poses=41,
    )
    D = 0.2 + 0.2 * unit(LONG(1.2))
    # the forearms in one line: |B - D| = 0.5
    reach = np.abs(D)
    off = np.arccos((LONG(0.2) ** 2 + reach**2 - LONG(0.5) ** 2) / (2 * LONG(0.2) * reach))
    middle = np.arctan2(D.imag, D.real)
    assert result.summary["limits"] == pytest.approx(
        [float(middle - off), float(middle + off)], rel=1e-13
    )
    assert list(result.status) == ["limit"] + ["ok"] * 39 + ["limit"]
    assert result.drivers["right.angle"].velocity == pytest.approx(np.zeros(41))
    assert result.drivers["left.angle"].acceleration == pytest.approx(np.full(41, 3.0))
    t = Jet.variable(np.zeros(39), 2)
    left = result.drivers["left.angle"].position[1:-1] + 2 * t + 1.5 * t * t
    closed = tip(left, 1.2 + 0 * t)
    for order, name in enumerate(("position", "velocity", "acceleration")):
        series = result.points["fore.C"][name][1:-1]
        gap = np.abs(series[:, 0] + 1j * series[:, 1] - math.factorial(order) * closed.c[order])
        noise = 1e-15 * result.condition[1:-1] ** (2 * order + 1)
        assert np.all(gap <= 20 * noise), name
    assert result.events[0]["at"][1] == 1.2
    assert "limits    -105.522990125 deg .. 174.277925541 deg" in table(result)


def test_a_held_driver_turns_with_whole_turns() -> None:
    """Poses behind a limit that are reached the other way round, as with a single driver."""
    moving = md.Driver("left.angle", from_=2.0, to=2.0 + 2 * math.pi)
    result = sweep(five_bar(), moving, md.Driver("right.angle", at=[1.2]), poses=49)
    low, high = 2 * math.pi - 1.841723614232363, 3.041723614232363
    left = result.drivers["left.angle"].position
    between = (left > high) & (left < low)
    assert np.array_equal(result.status == "unassembled", between)
    fine = ~between
    assert np.abs(place(result, "fore.C")[fine] - tip(left[fine], 1.2)).max() < 1e-14


def test_held_drivers_beside_lists_and_laws() -> None:
    at = sweep(
        five_bar(), md.Driver("left.angle", at=[2.0, 2.2, 1.9]), md.Driver("right.angle", at=[1.1])
    )
    assert set(at.status) == {"ok"}
    assert at.drivers["right.angle"].position == pytest.approx([1.1] * 3)
    assert at.bodies["right"].angular_velocity == pytest.approx([0.0] * 3)
    assert at.bodies["left"].angular_velocity == pytest.approx([1.0] * 3)
    named = sweep(
        five_bar(),
        md.Driver("left.angle", law="2 + t**2", times=[0, 0.1, 0.2]),
        md.Driver("right.angle", at=[1.1]),
    )
    assert named.bodies["left"].angular_velocity == pytest.approx([0.0, 0.2, 0.4])
    assert np.abs(place(named, "fore.C") - tip(2 + named.time**2, 1.1)).max() < 1e-15
    poses = [md.Driver("left.angle", at=[2.0]), md.Driver("right.angle", at=[1.1])]
    one = sweep(five_bar(), *poses)
    assert one.bodies["right"].angular_velocity == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("drivers", "words"),
    [
        (
            [
                md.Driver("left.angle", range="assembled"),
                md.Driver("right.angle", range="assembled"),
            ],
            "a single driver that moves",
        ),
        (
            [md.Driver("left.angle", at=[1, 2]), md.Driver("right.angle", at=[1], speed=2)],
            "is held while others move",
        ),
        (
            [md.Driver("left.angle", at=[1, 2]), md.Driver("right.angle", at=[1, 2, 3])],
            "different numbers of poses",
        ),
    ],
)
def test_drivers_that_do_not_go_together(drivers: list[md.Driver], words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        sweep(five_bar(), *drivers)


def test_an_expected_value_follows_the_driver_that_moves() -> None:
    problem = md.load("differential")
    entry = next(e for e in problem.expected if e.task == "planet" and e.at is not None)
    verdict = check(replace(problem, expected=(replace(entry, at=0.1234),)))[0]
    assert "no pose at 0.1234" in verdict.note


# -- what can be driven ----------------------------------------------------------------------------


def test_an_elbow_and_a_crank_drive() -> None:
    """A joint's angle beside a body's angle gives back what the two cranks gave."""
    cranks = [
        md.Driver("left.angle", at=[2.0, 2.1, 2.05], speed=0.3, acceleration=0.2),
        md.Driver("right.angle", at=[1.0, 0.9, 1.05], speed=-0.5, acceleration=0.1),
    ]
    forward = sweep(five_bar(), *cranks)
    for k in range(3):
        left = forward.bodies["left"]
        elbow = forward.joints["C"].angle[k]
        aft, fore = forward.bodies["aft"], forward.bodies["fore"]
        back = sweep(
            five_bar(),
            md.Driver("left.angle", at=[left.angle[k]], speed=0.3, acceleration=0.2),
            md.Driver(
                "C.angle",
                at=[elbow],
                speed=float(aft.angular_velocity[k] - fore.angular_velocity[k]),
                acceleration=float(aft.angular_acceleration[k] - fore.angular_acceleration[k]),
            ),
        )
        right = back.bodies["right"]
        assert right.angle[0] == pytest.approx(forward.bodies["right"].angle[k], rel=1e-13)
        assert right.angular_velocity[0] == pytest.approx(-0.5, rel=1e-11)
        assert right.angular_acceleration[0] == pytest.approx(0.1, rel=1e-10)


def test_a_point_and_a_crank_drive() -> None:
    """A crank and one coordinate of the tip: the forearm's angle follows from both."""
    result = sweep(
        five_bar(),
        md.Driver("fore.C.x", law="0.1 + 0.02*sin(t)", from_=0, to=6),
        md.Driver("left.angle", law="2 - 0.05*t", from_=0, to=6),
        poses=31,
    )
    assert set(result.status) == {"ok"}
    x = np.asarray(0.1 + 0.02 * np.sin(result.time), LONG)
    B = LONG("0.2") * unit(2 - 0.05 * result.time)
    C = x + 1j * (B.imag + np.sqrt(LONG("0.0625") - (x - B.real) ** 2))
    assert np.abs(place(result, "fore.C") - C).max() < 1e-15
    assert np.abs(tip(2 - 0.05 * result.time, result.bodies["right"].angle) - C).max() < 1e-14


def boom(s: Jet) -> dict[str, Jet]:
    """The oscillating cylinder by its slide."""
    A = LONG("0.6") - 1j * LONG("0.3")
    zero = 0 * unit(s)
    B = circle_circle(zero, LONG("1.1"), zero + A, s, 1)
    return {"boom": arg(B), "barrel": arg(B - A, 1.5), "boom.T": B * LONG("2.4") / LONG("1.1")}


@pytest.mark.parametrize("task", ["lift", "start"])
def test_oscillating_cylinder(task: str) -> None:
    result = md.solve("oscillating-cylinder", task)
    assert set(result.status) == {"ok"}
    if task == "lift":
        jet = Jet.variable(np.asarray(result.drivers["ram.slide"].position, LONG), 2)
        rate = np.array([1, 0.05, 0.05**2])
    else:
        t = Jet.variable(np.asarray(result.time, LONG), 2)
        wave = unit(2 * LONG(np.pi) / 10 * t).map(np.imag)
        jet = LONG("0.75") + (t / 10 - wave / (2 * LONG(np.pi))) / 2
        rate = np.ones(3)
    for part, closed in boom(jet).items():
        series = result.points[part] if "." in part else result.bodies[part]
        for order, name in enumerate(series):
            ours = series[name][:, 0] + 1j * series[name][:, 1] if "." in part else series[name]
            wanted = closed.c[order] * math.factorial(order) * rate[order]
            gap = np.abs(ours - wanted).astype(float).max()
            assert gap <= 1e-12 * float(np.abs(wanted).max()), (part, name)


def test_the_whole_stroke_of_a_cylinder() -> None:
    result = md.solve("oscillating-cylinder", "reach")
    c = np.hypot(LONG("0.6"), LONG("0.3"))
    limits = [float(LONG("1.1") - c), float(LONG("1.1") + c)]
    assert result.summary["limits"] == pytest.approx(limits, rel=1e-14)
    assert list(result.status) == ["limit"] + ["ok"] * 99 + ["limit"]
    turned = result.bodies["boom"].angle + math.atan2(0.3, 0.6)
    assert turned[[0, -1]] == pytest.approx([0, math.pi], abs=1e-7)


# -- wheels: the formula of Willis -----------------------------------------------------------------

Z = {"s1": 24, "p1": 18, "r1": 60, "s2": 20, "p2": 16, "r2": 52}


def two_stages(*fixed: str) -> md.Mechanism:
    """Two planetary stages in a row: the first arm carries the second sun."""

    def meshes(stage: str, sun: str, arm: str, ring: str) -> list:
        planet = f"planet{stage}"
        outer, inner = (Z[f"s{stage}"], Z[f"p{stage}"]), (Z[f"r{stage}"], Z[f"p{stage}"])
        return [
            md.Revolute(f"P{stage}", f"{arm}.P", f"{planet}.P"),
            md.Gear(f"m{stage}", f"{sun}.O", f"{planet}.P", carrier=arm, teeth=outer,
                    mesh="external"),
            md.Gear(f"n{stage}", f"{ring}.O", f"{planet}.P", carrier=arm, teeth=inner,
                    mesh="internal"),
        ]  # fmt: skip

    pins = [
        (md.Weld if name in fixed else md.Revolute)(f"O_{name}", "ground.O", f"{name}.O")
        for name in ("sun", "arm1", "arm2", "ring1", "ring2")
    ]
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("sun", {"O": (0, 0)}),
            md.Body("arm1", {"O": (0, 0), "P": (0.042, 0)}),
            md.Body("arm2", {"O": (0, 0), "P": (0.036, 0)}),
            md.Body("ring1", {"O": (0, 0)}),
            md.Body("ring2", {"O": (0, 0)}),
            md.Body("planet1", {"P": (0, 0)}),
            md.Body("planet2", {"P": (0, 0), "T": (0.016, 0)}),
        ],
        joints=[*pins, *meshes("1", "sun", "arm1", "ring1"), *meshes("2", "arm1", "arm2", "ring2")],
        sketch={},
    )


def willis(q: dict[str, np.ndarray]) -> None:
    """(sun - arm)/(ring - arm) = -z_ring/z_sun in both stages, (planet - arm) by its meshes."""
    stages = (("1", "sun", "arm1", "ring1"), ("2", "arm1", "arm2", "ring2"))
    for stage, sun, arm, ring in stages:
        zs, zp, zr = (Z[f"{w}{stage}"] for w in "spr")
        size = max(np.abs(value).max() for value in q.values())
        rest = (q[sun] - q[arm]) * zs + (q[ring] - q[arm]) * zr
        assert np.abs(rest).max() <= 1e-13 * size * zr
        rest = (q[ring] - q[arm]) * zr - (q[f"planet{stage}"] - q[arm]) * zp
        assert np.abs(rest).max() <= 1e-13 * size * zr


@pytest.mark.parametrize(
    ("fixed", "drivers"),
    [
        (("ring1", "ring2"), ["sun.angle"]),
        (("ring1", "ring2"), ["arm2.angle"]),
        (("ring1",), ["sun.angle", "ring2.angle"]),
        (("ring1",), ["arm2.angle", "ring2.angle"]),
        (("ring1",), ["arm2.angle", "planet2.angle"]),
        ((), ["sun.angle", "ring1.angle", "ring2.angle"]),
        ((), ["ring1.angle", "arm1.angle", "P2.angle"]),
    ],
)
def test_two_stage_epicyclic_trains(fixed: tuple[str, ...], drivers: list[str]) -> None:
    """Whatever drives, nothing is left to solve and both stages obey Willis' equation."""
    laws = [
        md.Driver(c, law=f"{0.7 + k}*t - {0.4 * k}*cos({1 + k}*t)", from_=0, to=9)
        for k, c in enumerate(drivers)
    ]
    result = sweep(two_stages(*fixed), *laws, poses=20)
    assert set(result.status) == {"ok"}
    assert result.summary["work"]["unknowns"] == 0
    for name in ("angle", "angular_velocity", "angular_acceleration"):
        q = {body: result.bodies[body][name] for body in result.bodies}
        willis(q)
        if name == "angular_velocity":
            for ring in fixed:
                assert np.abs(q[ring]).max() == 0
    T = place(result, "planet2.T")
    wanted = 0.036 * unit(result.bodies["arm2"].angle)
    wanted = wanted + 0.016 * unit(result.bodies["planet2"].angle)
    assert np.abs(T - wanted).max() < 1e-15


def test_reduction_of_two_stages() -> None:
    result = md.solve(
        two_stages("ring1", "ring2"), md.Sweep(md.Driver("sun.angle", from_=0, to=35), poses=6)
    )
    ratio = (1 + 60 / 24) * (1 + 52 / 20)
    assert result.bodies["arm2"].angular_velocity == pytest.approx(np.full(6, 1 / ratio), rel=1e-14)


def test_two_suns_drive_a_carrier() -> None:
    """The bevel-free differential: two meshing planets, the carrier at the mean of the suns."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("a", {"O": (0, 0)}),
            md.Body("b", {"O": (0, 0)}),
            md.Body("case", {"O": (0, 0), "P": (0.03, 0), "Q": (0.018, 0.024)}),
            md.Body("p", {"P": (0, 0)}),
            md.Body("q", {"Q": (0, 0)}),
        ],
        joints=[
            *[md.Revolute(f"O_{name}", "ground.O", f"{name}.O") for name in ("a", "b", "case")],
            md.Revolute("P", "case.P", "p.P"),
            md.Revolute("Q", "case.Q", "q.Q"),
            md.Gear("ap", "a.O", "p.P", carrier="case", teeth=(30, 20), mesh="external"),
            md.Gear("pq", "p.P", "q.Q", carrier="case", teeth=(20, 20), mesh="external"),
            md.Gear("bq", "b.O", "q.Q", carrier="case", teeth=(30, 20), mesh="external"),
        ],
        sketch={},
    )
    suns = [md.Driver("a.angle", law="3*t", from_=0, to=4), md.Driver("b.angle", law="sin(5*t)")]
    result = sweep(mechanism, *suns, poses=33)
    assert result.summary["work"]["unknowns"] == 0
    case = result.bodies["case"]
    assert case.angle == pytest.approx((3 * result.time + np.sin(5 * result.time)) / 2, abs=1e-14)
    assert case.angular_velocity == pytest.approx((3 + 5 * np.cos(5 * result.time)) / 2)
    # reversed: the case and one sun drive the other sun
    back = sweep(
        mechanism,
        md.Driver("case.angle", law="(3*t + sin(5*t))/2", from_=0, to=4),
        md.Driver("b.angle", law="sin(5*t)"),
        poses=33,
    )
    assert back.bodies["a"].angular_velocity == pytest.approx(np.full(33, 3.0), rel=1e-13)
    # a wheel stands still: the other turns twice as fast as the case
    held = sweep(
        mechanism, md.Driver("case.angle", from_=0, to=9, speed=2), md.Driver("b.angle", at=[0.0])
    )
    assert held.bodies["a"].angular_velocity == pytest.approx(np.full(361, 4.0))


def test_the_differential_of_the_article() -> None:
    """Coupler and point C against (11), with the ratio of an internal mesh as well."""
    for i42 in (-1.0, 1.5):
        result = md.solve("differential", "laws", set={"i42": i42}, poses=61)
        t = Jet.variable(np.asarray(result.time, LONG), 2)
        crank = LONG("0.35") + LONG("1.2") * unit(4 * t).map(np.imag)
        coupler = (5 * t - (1 - i42) * crank) / i42
        C = LONG("0.1") + LONG("0.048") * unit(crank) - LONG("0.09") * unit(coupler)
        for order, name in enumerate(("angle", "angular_velocity", "angular_acceleration")):
            wanted = coupler.c[order] * math.factorial(order)
            gap = np.abs(result.bodies["coupler"][name] - wanted).astype(float)
            assert gap.max() <= 1e-14 * float(np.abs(wanted).max())
        for order, name in enumerate(("position", "velocity", "acceleration")):
            series = result.points["coupler.C"][name]
            wanted = C.c[order] * math.factorial(order)
            gap = np.abs(series[:, 0] + 1j * series[:, 1] - wanted).astype(float)
            assert gap.max() <= 1e-13 * float(np.abs(wanted).max())


def test_several_drivers_build_no_course_without_a_law() -> None:
    problem = md.load("differential")
    line = prepare(problem, problem.tasks["line"])
    assert line.graphs.course is None
    assert line.graphs.straight is line.graphs
    planet = prepare(problem, problem.tasks["planet"])
    assert planet.graphs.course is not None
    assert planet.graphs.turns


def test_a_pose_behind_one_out_of_reach_is_not_reached() -> None:
    """The hand of an arm of 0.3 and 0.2 is sent out to 0.63 and back: the last pose assembles."""
    arm = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("up", points={"O": [0, 0], "E": [0.3, 0]}),
            md.Body("fore", points={"E": [0, 0], "H": [0.2, 0]}),
        ],
        joints=[md.Revolute("O", "ground.O", "up.O"), md.Revolute("E", "up.E", "fore.E")],
        sketch={"up": 0.2, "fore": 1.8, "fore.H.x": 0.25, "fore.H.y": 0.25},
    )
    out = md.Driver("fore.H.x", at=[0.25, 0.6, 0.3]), md.Driver("fore.H.y", at=[0.2, 0.2, 0.1])
    result = sweep(arm, *out)
    assert list(result.status) == ["ok", "unassembled", "unassembled"]
    assert result.fault is not None
    assert result.fault.startswith("2 of 3 poses are not reached")
    assert result.events[0]["at"][0] == pytest.approx(math.sqrt(0.25 - 0.04), abs=1e-12)
