"""Static problems with friction that have one answer, several or none.

The files ``data/friction_*.json`` hold the cases with all their solutions; those given as
dimensions of a case are the doubles nearest to them.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from tests.reference.force_truth import LONG, Line, Mass, Scene, Slot, circle, panels
from tests.reference.force_truth import slider_crank as free_slider_crank
from tests.shared.force_cases import (
    drawer,
    reactions,
    slider_crank,
    tipping_block,
    two_guides,
    two_slider_cranks,
)
from tests.shared.paths import DATA

EPS = float(np.finfo(float).eps)
REL = 1e-11


def reference(name: str) -> dict[str, Any]:
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def only(result: md.Result) -> dict[str, Any]:
    """Return the entry of the one ambiguous pose."""
    assert list(result.status) == ["ambiguous"]
    (entry,) = result.to_dict()["solutions"]
    return entry


def jammed(result: md.Result) -> dict[str, Any]:
    """Return the entry of the one jammed pose."""
    assert list(result.status) == ["jammed"]
    assert result.fault is not None
    assert "jam" in result.fault
    (entry,) = result.summary["jammed"]
    return entry


# -- friction circles ------------------------------------------------------------------------------

CIRCLES = reference("friction_slider_crank_friction")
NUMBERS = {k: float(v) for k, v in CIRCLES["params"].items() if k != "convention"}


def circles(radius: str, theta: float) -> md.Result:
    p = NUMBERS
    mechanism = slider_crank(
        load=md.Force("load", "slider.C", (-p["P"], 0)),
        gravity=(0, -9.81),
        masses={"m_slider": p["m"]},
        r=p["r"],
        l=p["l"],
        r_O=p["rO"],
        r_B=p["rA"],
        r_C=p["rB"],
        f=p["mu"],
        f_slide=p["mus"],
    )
    task = reactions(at=[theta], speed=p["w"], friction="coupled", friction_radius=radius)
    return md.solve(mechanism, task)


def free_circles(radius: str, theta: float):
    p = NUMBERS
    law = circle if radius == "exact" else lambda r, f: LONG(r) * LONG(f)
    scene, _ = free_slider_crank(
        theta,
        p["w"],
        p["r"],
        p["l"],
        lambda v: -p["P"],
        tuple(law(p[k], p["mu"]) for k in ("rO", "rA", "rB")),
        p["mus"],
        m_slider=p["m"],
        gravity=-9.81j,
    )
    return scene.solve()


ROWS = [("exact", row) for row in CIRCLES["rows"]] + [
    ("article", row) for row in CIRCLES["small_angle_rows"]
]


@pytest.mark.parametrize(("radius", "row"), ROWS, ids=lambda x: x if isinstance(x, str) else "")
def test_free_bodies_reproduce_friction_circles(radius: str, row: dict) -> None:
    found = free_circles(radius, float(row["theta"]))
    (solution,) = row["solutions"]
    assert float(found["T"][0]) == pytest.approx(float(solution["torque"]), rel=1e-15)
    assert float(found["slide"][0][0]) == pytest.approx(float(solution["N"]), rel=1e-15)
    assert float(abs(found["B"][0])) == pytest.approx(float(solution["F"]), rel=1e-15)


@pytest.mark.parametrize(("radius", "row"), ROWS, ids=lambda x: x if isinstance(x, str) else "")
def test_slider_crank_with_friction_circles(radius: str, row: dict) -> None:
    """At the double nearest to pi/2 the rod still turns the way it does before it."""
    result = circles(radius, float(row["theta"]))
    (solution,) = row["solutions"]
    assert list(result.status) == ["ok"]
    joints = result.joints
    assert result.bodies["rod"].angular_velocity[0] == pytest.approx(
        float(row["wr"]), rel=1e-12, abs=1e-14
    )
    assert result.points["slider.C"].acceleration[0, 0] == pytest.approx(
        float(row["slider_a"]), rel=1e-12
    )
    assert result.efforts["crank.angle"][0] == pytest.approx(float(solution["torque"]), rel=REL)
    assert joints["slide"].normal[0] == pytest.approx(float(solution["N"]), rel=REL)
    for name in ("B", "C"):
        size = np.hypot(*joints[name].reaction[0, :2])
        assert size == pytest.approx(float(solution["F"]), rel=REL)
    # the force of the rod leans by psi
    force = joints["C"].reaction[0]
    lean = math.atan(force[1] / force[0])
    assert lean == pytest.approx(float(solution["psi"]), rel=REL)


# -- jamming of a slider-crank ---------------------------------------------------------------------

JAM = reference("friction_slider_crank_jam")
JAM_ENDS = [float(end) for end in JAM["jam_interval_theta"]]


def jam_mechanism() -> md.Mechanism:
    return slider_crank(
        load=md.Force("load", "slider.C", (-100, 0)),
        joints="s",
        r=0.09,
        l=0.1,
        f_slide=0.6,
        sketch={"crank": 0.8, "rod": -0.7},
    )


def jam_sense(row: dict) -> float:
    return -1.0 if "omega=-1" in row["sense"] else 1.0


def free_jam(row: dict):
    scene, _ = free_slider_crank(
        float(row["theta"]), jam_sense(row), 0.09, 0.1, lambda v: -100.0, f=0.6
    )
    return scene.every_solution()


@pytest.mark.parametrize("row", JAM["rows"], ids=lambda row: row["theta"][:9])
def test_free_bodies_reproduce_jamming(row: dict) -> None:
    found = free_jam(row)
    assert len(found) == row["n_solutions"]
    for ours, theirs in zip(found, row["solutions"], strict=True):
        near = abs(1 - float(row["mus_tan_psi"]))
        rel = 1e-14 + 4 * EPS / near
        assert float(ours["T"][0]) == pytest.approx(float(theirs["torque"]), rel=rel)
        assert float(ours["slide"][0][0]) == pytest.approx(float(theirs["N"]), rel=rel)


@pytest.mark.parametrize("row", JAM["rows"], ids=lambda row: row["theta"][:9])
def test_jamming_rows(row: dict) -> None:
    theta = float(row["theta"])
    task = reactions(at=[theta], speed=jam_sense(row), friction="coupled")
    result = md.solve(jam_mechanism(), task)
    truth = free_jam(row)
    # the input's own rounding, magnified by the nearness of the limit
    rel = REL + 16 * EPS / abs(1 - float(row["mus_tan_psi"]))
    if row["n_solutions"] == 0:
        entry = jammed(result)
        assert math.isnan(result.efforts["crank.angle"][0])
        assert np.all(np.isnan(result.joints["slide"].reaction))
        # no factor on the friction above this one leaves an answer that grew from none
        assert entry["critical_factor"] == pytest.approx(1 / float(row["mus_tan_psi"]), rel=1e-9)
    elif row["n_solutions"] == 1:
        assert list(result.status) == ["ok"]
        assert result.efforts["crank.angle"][0] == pytest.approx(float(truth[0]["T"][0]), rel=rel)
        assert result.joints["slide"].normal[0] == pytest.approx(
            float(truth[0]["slide"][0][0]), rel=rel
        )
    else:
        entry = only(result)
        assert entry["count"] == 2
        assert entry["proven"] is True
        assert entry["at"] == pytest.approx(theta)
        by_torque = {
            round(float(s["torque"]), 6): (float(s["torque"]), float(s["N"]))
            for s in row["solutions"]
        }
        assert len(entry["solutions"]) == 2
        for solution in entry["solutions"]:
            torque, normal = by_torque.pop(round(solution["efforts"]["crank.angle"], 6))
            assert solution["efforts"]["crank.angle"] == pytest.approx(torque, rel=REL)
            assert solution["reactions"]["slide"][1] == pytest.approx(normal, rel=REL)
            # the one that friction growing from nothing leads to has the smaller force
            assert solution["connected"] is (abs(torque) < 10)


def test_ends_of_the_jammed_arc() -> None:
    mechanism = jam_mechanism()
    task = reactions(from_=0.2, to=3.0, poses=29, speed=-1, friction="coupled", cycle=True)
    arcs = md.solve(mechanism, task).summary["jammed_arcs"]
    assert len(arcs) == 1
    assert sorted(arcs[0]) == pytest.approx(JAM_ENDS, abs=1e-9)


def test_poses_on_both_sides_of_the_ends() -> None:
    d = 1e-9
    low, high = JAM_ENDS
    task = reactions(at=[low - d, low + d, high - d, high + d], speed=-1, friction="coupled")
    result = md.solve(jam_mechanism(), task)
    assert list(result.status) == ["ok", "jammed", "jammed", "ok"]
    assert [entry["pose"] for entry in result.summary["jammed"]] == [1, 2]
    for entry in result.summary["jammed"]:
        assert entry["critical_factor"] == pytest.approx(1, abs=1e-7)
        assert entry["critical_factor"] < 1


def test_the_whole_turn_has_a_jammed_arc_and_one_with_two_answers() -> None:
    # below the guide the load pushes along the motion: the mirrored arc is the ambiguous one
    low, high = JAM_ENDS
    at = [0.5, (low + high) / 2, 2.5, 4.0, 2 * math.pi - (low + high) / 2, 5.5]
    result = md.solve(jam_mechanism(), reactions(at=at, speed=-1, friction="coupled"))
    assert list(result.status) == ["ok", "jammed", "ok", "ok", "ambiguous", "ok"]
    (entry,) = result.to_dict()["solutions"]
    assert (entry["pose"], entry["count"]) == (4, 2)


# -- f_crit = cot phi ------------------------------------------------------------------------------


def cotangent(f: float, assist: bool) -> md.Result:
    """Return lambda = 1/3 at 90 degrees: the guide alone rubs, 1000 N against or along."""
    sign = -1 if assist else 1
    mechanism = slider_crank(joints="s", f_slide=f, Q_work=sign * 1000, Q_return=sign * 1000)
    return md.solve(mechanism, reactions(at=[math.pi / 2], speed=1, friction="coupled"))


def test_the_effort_grows_to_the_critical_friction() -> None:
    critical = 2 * math.sqrt(2)  # cot beta, sin beta = 1/3
    for f, printed in ((2.82, 33563), (2.828, 662202)):
        effort = cotangent(f, assist=False).efforts["crank.angle"][0]
        near = 1 - f / critical
        assert effort == pytest.approx(100 / near, rel=REL + 16 * EPS / near)
        assert effort == pytest.approx(printed, abs=1)
    entry = jammed(cotangent(2.829, assist=False))
    assert entry["critical_factor"] == pytest.approx(critical / 2.829, rel=1e-9)


def test_an_assisting_load_has_two_answers_above_the_critical_friction() -> None:
    critical = 2 * math.sqrt(2)
    below = cotangent(2.82, assist=True)
    assert list(below.status) == ["ok"]
    assert below.efforts["crank.angle"][0] == pytest.approx(-100 / (1 + 2.82 / critical), rel=REL)
    for f, printed in ((2.829, (-49.99, 4.9e5)), (3.5, (-44.7, 421))):
        entry = only(cotangent(f, assist=True))
        assert entry["count"] == 2
        efforts = sorted(s["efforts"]["crank.angle"] for s in entry["solutions"])
        expected = [-100 / (1 + f / critical), 100 / (f / critical - 1)]
        rel = REL + 16 * EPS / (f / critical - 1)
        assert efforts == pytest.approx(expected, rel=rel)
        assert efforts == pytest.approx(printed, rel=1e-2)


# -- dead zones of a driven crank ------------------------------------------------------------------


def line_of_action(theta: Any, rho: Any, r: float, l: float) -> Any:  # noqa: E741
    """Return the arm of the rod's force about O, friction in B off, less rho.

    The slider drives the crank counter-clockwise, all three friction circles have the radius
    rho. The massless rod presses the crank at B with a force F and friction turns the rod by
    -rho F (sgn(w - 1) + sgn(w)), w its turning over the crank's; so the line of F leans. The
    crank is turned while the arm, less what friction in B takes, is above rho.
    """
    theta, rho, r, l = (LONG(x) for x in (theta, rho, r, l))  # noqa: E741
    beta = np.arcsin(r * np.sin(theta) / l)
    w = -r * np.cos(theta) / (l * np.cos(beta))
    lean = -np.arcsin(rho * (np.sign(w - 1) + np.sign(w)) / l)
    return r * np.sin(np.pi * LONG(1) - beta + lean - theta) + rho * np.sign(w - 1) - rho


def root(function, low: float, high: float) -> float:
    low, high = LONG(low), LONG(high)
    sign = np.sign(function(low))
    for _ in range(70):
        middle = (low + high) / 2
        low, high = (middle, high) if np.sign(function(middle)) == sign else (low, middle)
    return float(low)


def dead_zone(rho: Any) -> tuple[float, float]:
    """Return the end of the zone after the right dead centre, the start of that before the left."""
    return tuple(
        root(lambda x: line_of_action(x, rho, 0.1, 0.3), low, low + 0.5)
        for low in (1e-3, math.pi - 0.501)
    )


def test_free_bodies_reproduce_the_half_widths() -> None:
    for radius, f, printed in ((0.010, 0.1, 0.01990), (0.010, 0.2, 0.03923), (0.020, 0.2, 0.07853)):
        rho = circle(radius, f)
        # at the dead centre on the right the law of the reference is exact
        assert dead_zone(rho)[0] == pytest.approx(float(np.arcsin(2 * rho / LONG(0.1))), rel=1e-14)
        assert dead_zone(rho)[0] == pytest.approx(printed, abs=1e-5)
        for end in dead_zone(rho):
            scene, _ = free_slider_crank(
                [end - 1e-12, end + 1e-12], 1, 0.1, 0.3, lambda v: 1000 * np.sign(v), (rho,) * 3
            )
            torque = scene.solve()["T"]
            assert torque[0] * torque[1] < 0


@pytest.mark.parametrize(
    ("radius", "f", "printed"),
    [(0.010, 0.1, 0.01990), (0.010, 0.2, 0.03923), (0.020, 0.2, 0.07853)],
)
def test_half_width_of_the_dead_zone(radius: float, f: float, printed: float) -> None:
    top, bottom = dead_zone(circle(radius, f))
    assert top == pytest.approx(printed, abs=1e-5)
    mechanism = slider_crank(
        joints="OBC", r_O=radius, r_B=radius, r_C=radius, f=f, Q_work=-1000, Q_return=-1000
    )
    task = reactions(from_=0, to=math.pi, poses=19, speed=1, friction="coupled", cycle=True)
    arcs = md.solve(mechanism, task).summary["self_locking_arcs"]
    assert len(arcs) == 2
    assert arcs[0] == pytest.approx([0, top], abs=1e-9)
    assert arcs[1] == pytest.approx([bottom, math.pi], abs=1e-9)


@pytest.mark.parametrize(("radius", "f"), [(0.010, 0.1), (0.020, 0.2)])
def test_a_driving_slider_jams_inside_the_dead_zone(radius: float, f: float) -> None:
    end = dead_zone(circle(radius, f))[0]
    mechanism = slider_crank(
        joints="OBC",
        r_O=radius,
        r_B=radius,
        r_C=radius,
        f=f,
        load=md.Resistance("brake", "crank.angle", negative=5, positive=5),
        sketch={"crank": 1.0, "rod": -0.3, "slide": 0.34},
    )
    theta = np.array([end + 1e-8, end - 1e-8, end / 2])
    at = 0.1 * np.cos(theta) + np.sqrt(0.09 - 0.01 * np.sin(theta) ** 2)
    task = reactions("slide.slide", at=at, speed=-0.1, friction="coupled")
    result = md.solve(mechanism, task)
    assert list(result.status) == ["ok", "jammed", "jammed"]
    assert [entry["pose"] for entry in result.summary["jammed"]] == [1, 2]
    assert result.summary["jammed"][0]["critical_factor"] == pytest.approx(1, abs=1e-5)


# -- the block of Painleve -------------------------------------------------------------------------

BLOCK = reference("friction_painleve_slider")["cases"]


def block_id(case: dict) -> str:
    return ",".join(case["params"][k] for k in ("p", "mu")) + f",{case['params']['slide_dir']}"


@pytest.mark.parametrize("case", BLOCK, ids=block_id)
def test_free_bodies_reproduce_the_block(case: dict) -> None:
    p = {name: float(value) for name, value in case["params"].items()}
    contact = {"axis": 1 + 0j, "speed": p["slide_dir"], "f": p["mu"]}
    scene = Scene(
        1,
        {"block": Mass(p["m"], 0.01, 1j * p["h_com"], 0j)},
        {
            "rear": Slot("ground", "block", -p["L"] / 2 + 0j, **contact),
            "front": Slot("ground", "block", p["L"] / 2 + 0j, **contact),
            "drive": Line("ground", "block", 1j * p["h_com"], 1 + 0j),
        },
        [("block", 1j * p["p"], p["P"] + 0j, 0.0)],
    )
    found = scene.every_solution()
    assert len(found) == case["n_solutions"]
    for ours, theirs in zip(found, case["solutions"], strict=True):
        assert float(ours["rear"][0]) == pytest.approx(float(theirs["N1"]), rel=1e-14)
        assert float(ours["front"][0]) == pytest.approx(float(theirs["N2"]), rel=1e-14)
        assert -float(ours["drive"][0]) / p["m"] == pytest.approx(float(theirs["acc"]), rel=1e-14)


@pytest.mark.parametrize("case", BLOCK, ids=block_id)
@pytest.mark.parametrize("acceleration", [0.0, 3.0])
def test_tipping_block(case: dict, acceleration: float) -> None:
    """Prescribed acceleration: none, one or two answers, as for the freely sliding block."""
    p = {name: float(value) for name, value in case["params"].items()}
    task = reactions(
        "block.M.x", at=[0.3], speed=p["slide_dir"], acceleration=acceleration, friction="coupled"
    )
    result = md.solve(tipping_block(p["mu"], p["p"]), task)
    if case["n_solutions"] == 0:
        entry = jammed(result)
        assert entry["critical_factor"] == pytest.approx(
            float(case["mu_critical"]) / p["mu"], rel=1e-9
        )
        return
    answers = {
        round(float(s["N1"]), 6): (float(s["N1"]), float(s["N2"]), float(s["acc"]))
        for s in case["solutions"]
    }
    if case["n_solutions"] == 1:
        assert list(result.status) == ["ok"]
        found = [
            (
                result.joints["rear"].normal[0],
                result.joints["front"].normal[0],
                result.efforts["block.M.x"][0],
            )
        ]
    else:
        entry = only(result)
        assert entry["proven"] is True
        found = [
            (s["reactions"]["rear"][1], s["reactions"]["front"][1], s["efforts"]["block.M.x"])
            for s in entry["solutions"]
        ]
        connected = [s["reactions"]["rear"][1] for s in entry["solutions"] if s["connected"]]
        # the answer that grew from none has the sign of A
        assert len(connected) == 1
        assert connected[0] * float(case["A"]) > 0
    assert len(found) == len(answers)
    for rear, front, effort in found:
        n1, n2, acc = answers.pop(round(float(rear), 6))
        assert (rear, front) == pytest.approx((n1, n2), rel=REL)
        assert effort == pytest.approx(p["m"] * (acceleration - acc), rel=REL)


# -- drawer ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("mu", [0.2, 0.29999])
def test_the_drawer_slides(mu: float) -> None:
    data = reference("friction_drawer")
    (case,) = (c for c in data["cases"] if float(c["mu"]) == mu)
    result = md.solve(drawer(mu), reactions("drawer.H.x", at=[0.2], speed=0.1, friction="coupled"))
    assert list(result.status) == ["ok"]
    near = 1 - 2 * mu * 0.5 / 0.3
    assert near == pytest.approx(float(case["net_force_over_F"]), rel=1e-11)
    rel = REL + 8 * EPS / near
    effort = result.efforts["drawer.H.x"][0]
    assert effort == pytest.approx(1 / near, rel=rel)
    guide = result.joints["guide"]
    assert guide.reaction[0] == pytest.approx([1 - effort, 0, 0.5 * effort], rel=rel, abs=1e-12)
    assert guide.loss[0] == pytest.approx(0.1 * (effort - 1), rel=rel)


@pytest.mark.parametrize("mu", [0.30001, 0.5])
@pytest.mark.parametrize("speed", [0.1, -0.1])
def test_the_drawer_jams(mu: float, speed: float) -> None:
    result = md.solve(
        drawer(mu), reactions("drawer.H.x", at=[0.2], speed=speed, friction="coupled")
    )
    assert jammed(result)["critical_factor"] == pytest.approx(0.3 / mu, rel=1e-9)


def test_the_message_of_a_jam_names_the_joint_and_the_limit() -> None:
    result = md.solve(drawer(0.5), reactions("drawer.H.x", at=[0.2], speed=1, friction="coupled"))
    assert jammed(result)["critical_factor"] == pytest.approx(0.6, rel=1e-9)
    assert "0.6" in result.fault
    assert "drawer.H.x = 0.2" in result.fault
    assert "guide" in result.fault


# -- two pairs that jam, each by itself ------------------------------------------------------------


def test_two_independent_pairs_have_four_answers() -> None:
    theta = 1.4
    result = md.solve(two_slider_cranks(), reactions(at=[theta], speed=1, friction="coupled"))
    entry = only(result)
    assert entry["count"] == 4
    assert entry["proven"] is True
    first, second = (
        [
            (float(s["T"][0]), float(s["slide"][0][0]))
            for s in free_slider_crank(theta, 1.0, 0.09, 0.1, lambda v, p=p: -p, f=f)[
                0
            ].every_solution()
        ]
        for p, f in ((100.0, 0.6), (50.0, 0.7))
    )
    assert len(first) == len(second) == 2
    expected = sorted((a[0] + b[0], a[1], b[1]) for a in first for b in second)
    found = sorted(
        (
            s["efforts"]["crank.angle"],
            s["reactions"]["slide"][1],
            -s["reactions"]["slide2"][1],
        )
        for s in entry["solutions"]
    )
    for ours, theirs in zip(found, expected, strict=True):
        assert ours == pytest.approx(theirs, rel=1e-10)
    assert sum(s["connected"] for s in entry["solutions"]) == 1


def test_one_pair_that_jams_is_enough() -> None:
    result = md.solve(two_slider_cranks(), reactions(at=[1.4], speed=-1, friction="coupled"))
    # the pair that jams first decides: f tan beta = 1
    tangent = math.tan(math.asin(0.9 * math.sin(1.4)))
    assert jammed(result)["critical_factor"] == pytest.approx(1 / (0.7 * tangent), rel=1e-9)


# -- the number of answers, drawn at random --------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_number_of_answers_against_all_sides_of_the_contacts(seed: int) -> None:
    """Guides alone rub, long or short, with and without masses: the count is exact."""
    draw = np.random.default_rng(seed)
    r = float(draw.uniform(0.05, 0.12))
    l = float(draw.uniform(1.02, 2.5) * r)  # noqa: E741
    f = float(draw.uniform(0.3, 2.5))
    length = float(draw.uniform(0.002, 0.1)) if seed % 2 else None
    speed, force = float(draw.uniform(0.5, 20) * (-1) ** seed), float(draw.uniform(-200, 200))
    masses = {"m_rod": 1.5, "I_rod": 0.01, "c_rod": 0.4 * l, "m_slider": 0.8} if seed % 3 else {}
    gravity = (0.0, -9.81) if masses else None
    at = draw.uniform(0.1, 6.1, 8)
    mechanism = slider_crank(
        joints="s",
        r=r,
        l=l,
        f_slide=f,
        contact_length=length,
        load=md.Force("push", "slider.C", (force, 0)),
        masses=masses,
        gravity=gravity,
        sketch={"crank": 1.0, "rod": -math.asin(r / l * math.sin(1.0))},
    )
    result = md.solve(mechanism, reactions(at=at, speed=speed, friction="coupled"))
    several = {entry["pose"]: entry for entry in result.to_dict().get("solutions", [])}
    none = {entry["pose"]: entry for entry in result.summary.get("jammed", [])}
    for pose, theta in enumerate(at):
        scene, _ = free_slider_crank(
            theta,
            speed,
            r,
            l,
            lambda v: force,
            f=f,
            half=None if length is None else length / 2,
            gravity=-9.81j if masses else 0.0,
            **masses,
        )
        expected: list[float] = []
        for found in sorted(float(s["T"][0]) for s in scene.every_solution()):
            if not expected or found - expected[-1] > 1e-9 * abs(found):
                expected.append(found)
        if pose in none:
            assert expected == []
            assert none[pose]["proven"] is True
            assert 0 < none[pose]["critical_factor"] < 1
        elif pose in several:
            assert several[pose]["count"] == len(expected) > 1
            assert several[pose]["proven"] is True
            efforts = sorted(s["efforts"]["crank.angle"] for s in several[pose]["solutions"])
            assert efforts == pytest.approx(expected, rel=1e-9)
        else:
            assert result.status[pose] == "ok"
            assert [result.efforts["crank.angle"][pose]] == pytest.approx(expected, rel=1e-9)


# -- normal forces that are not unique -------------------------------------------------------------


def test_friction_on_a_shared_load_is_refused() -> None:
    task = reactions("left.slide", at=[0.2], speed=1, friction="coupled")
    with pytest.raises(md.MechdaeError) as caught:
        md.solve(two_guides(), task)
    text = str(caught.value)
    assert "left" in text
    assert "right" in text
    assert "unique" in text
    assert "\n" not in caught.value.what


def test_without_friction_the_shared_load_is_reported_as_not_unique() -> None:
    task = reactions("left.slide", at=[0.2], speed=1, friction="none")
    result = md.solve(two_guides(friction=False), task)
    assert list(result.status) == ["ok"]
    assert result.efforts["left.slide"][0] == pytest.approx(0, abs=1e-12)
    for name in ("left", "right"):
        assert np.all(np.isnan(result.joints[name].reaction))


# -- several pins ----------------------------------------------------------------------------------


def heavy_pins(scale: float = 1.0):
    """Return pins nearly as large as the crank: a mechanism whose slider drives, and its scene."""
    r, l, f, theta, torque = 0.06, 0.12, 0.8, 3.18, -10.0  # noqa: E741
    radii = {"r_O": 0.047, "r_B": 0.043, "r_C": 0.009}
    masses = {"m_slider": 1.0, "m_rod": 2.0, "I_rod": 0.01, "c_rod": 0.05}
    mechanism = slider_crank(
        joints="OBC",
        r=r,
        l=l,
        f=f,
        **radii,
        masses=masses,
        gravity=(0, -9.81),
        load=md.Torque("brake", "crank", torque),
        sketch={"crank": 3.4, "rod": 0.13, "slide": 0.061},
    )
    scene, motion = free_slider_crank(
        theta,
        -10.0,
        r,
        l,
        lambda v: 0.0,
        tuple(circle(radius, f) * LONG(scale) for radius in radii.values()),
        gravity=-9.81j,
        **masses,
    )
    scene.joints["T"] = Line("ground", "slider", scene.joints["slide"].at, 1 + 0j)
    scene.loads.append(("crank", 0j, 0j, torque))
    slide = motion["slide"]
    position, speed, acceleration = (float(slide.c[k][0]) * (1, 1, 2)[k] for k in range(3))
    task = reactions(
        "slide.slide", at=[position], speed=speed, acceleration=acceleration, friction="coupled"
    )
    return mechanism, task, scene


def test_of_several_solutions_the_connected_one_is_given() -> None:
    """Friction grows from nothing in small steps; another answer is 400 N away from that one."""
    mechanism, task, scene = heavy_pins()
    found = heavy_pins(0.0)[2].solve(friction=False)
    x = found.x
    for scale in np.linspace(0, 1, 161) ** 2:
        part = heavy_pins(scale)[2]
        new = part.solve(start=x).x
        assert np.abs(new - x).max() < 0.2 * np.abs(x).max()
        x = new
    connected = float(x[0, -1])
    other = float(scene.solve(start=np.full_like(x, 0.0) + OTHER).x[0, -1])
    assert abs(other - connected) > 100
    result = md.solve(mechanism, task)
    assert result.efforts["slide.slide"][0] == pytest.approx(connected, rel=REL)
    entry = only(result)
    efforts = sorted(s["efforts"]["slide.slide"] for s in entry["solutions"])
    assert efforts == pytest.approx(sorted([other, connected]), rel=REL)
    (first,) = [s for s in entry["solutions"] if s["connected"]]
    assert first["efforts"]["slide.slide"] == pytest.approx(connected, rel=REL)


OTHER = np.array([[200.0, -20, 200, -20, 200, -40, 50, 1, -300]], LONG)


# -- on the command line ---------------------------------------------------------------------------


def test_jammed_and_ambiguous_poses_on_the_command_line(tmp_path: Path, capsys) -> None:
    low, high = JAM_ENDS
    at = (0.5, (low + high) / 2, 2 * math.pi - (low + high) / 2)
    task = reactions(at=at, speed=-1, friction="coupled")
    path = tmp_path / "jam.toml"
    md.dump(md.Problem(jam_mechanism(), {"push": task}, title="jam"), path)
    assert main(["solve", str(path), "--json"]) == 1
    captured = capsys.readouterr()
    found = json.loads(captured.out)["tasks"]["push"]
    assert found["kind"] == "reactions"
    assert found["status"] == ["ok", "jammed", "ambiguous"]
    assert found["efforts"]["crank.angle"][1] is None
    assert found["joints"]["slide"]["reaction"][1] == [None] * 3
    assert found["joints"]["slide"]["loss"][1] is None
    # what friction leaves out is there
    assert found["efforts_uncoupled"]["crank.angle"][1] is not None
    assert [entry["pose"] for entry in found["solutions"]] == [2]
    assert found["solutions"][0]["count"] == 2
    assert "jam" in captured.err
    assert "Traceback" not in captured.err
    assert main(["solve", str(path)]) == 1
    assert "jammed" in capsys.readouterr().out
    assert main(["solve", str(path), "--out", str(tmp_path / "out")]) == 1
    assert {p.suffix for p in (tmp_path / "out").rglob("*.*")} >= {".csv", ".json", ".npz"}


# -- a turn with arcs that jam or have two answers -------------------------------------------------


def guide_alone(load: float) -> md.Result:
    """Return a turn of the mechanism above, the load against the motion or along it."""
    mechanism = slider_crank(
        joints="s",
        r=0.09,
        l=0.1,
        f_slide=0.6,
        Q_work=load,
        Q_return=load,
        sketch={"crank": 0.8, "rod": -0.7},
    )
    task = reactions(from_=0, to=2 * math.pi, poses=25, speed=1, friction="coupled", cycle=True)
    return md.solve(mechanism, task)


def test_a_turn_that_jams_twice_has_no_mean_power() -> None:
    result = guide_alone(100)
    arcs = result.summary["jammed_arcs"]
    low, high = JAM_ENDS
    assert np.ravel(arcs) == pytest.approx([low, high, low + math.pi, high + math.pi], abs=1e-9)
    assert "efficiency" not in result.summary
    assert "jammed" in result.fault
    inside = (np.sin(result.bodies["crank"].angle) ** 2) > math.sin(low) ** 2
    assert np.array_equal(np.asarray(result.status) == "jammed", inside)


def test_a_turn_with_two_answers_means_over_the_connected_one() -> None:
    result = guide_alone(-100)
    assert result.summary["jammed_arcs"] == []
    assert "several solutions" in result.fault
    # on the branch that friction growing from nothing leads to: T = T0 / (1 + f tan beta)
    at, weights = panels([k * math.pi / 2 for k in range(5)], 12, 40)
    beta = np.arcsin(0.9 * np.sin(at))
    given = 100 * np.abs(0.09 * np.sin(at) + 0.09 * np.cos(at) * np.tan(beta))
    output = given / (1 + 0.6 * np.abs(np.tan(beta)))
    assert result.summary["input"] == pytest.approx(given @ weights, rel=1e-9)
    assert result.summary["useful"] == pytest.approx(output @ weights, rel=1e-9)
    assert result.summary["efficiency"] == pytest.approx(
        (output @ weights) / (given @ weights), rel=1e-9
    )


def test_arcs_with_several_solutions_are_found_between_the_poses() -> None:
    """In the return sense there are two where mu tan(beta) > 1: the same arc that jams forwards."""
    task = reactions(from_=0.2, to=1.27, poses=3, speed=1, friction="coupled", cycle=True)
    result = md.solve(jam_mechanism(), task)
    ((first, last),) = result.summary["ambiguous_arcs"]
    assert first == pytest.approx(JAM_ENDS[0], abs=1e-9)
    assert last == 1.27
    assert "several solutions" in result.fault
    assert np.isfinite(result.summary["efficiency"])
    calm = reactions(from_=0.2, to=1.2, poses=3, speed=1, friction="coupled", cycle=True)
    assert "ambiguous_arcs" not in md.solve(jam_mechanism(), calm).summary
