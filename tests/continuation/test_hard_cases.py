"""Hard cases of planar kinematics against reference values of 28 digits and closed forms.

The files in ``data`` hold the numbers as texts, computed with 50 digits and more; where the
last digits depend on it, the exact input double is among them (``input_hex``).
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from tests.shared.paths import DATA

EPS = np.finfo(float).eps
LONG = np.longdouble


def reference(name: str) -> dict[str, Any]:
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def crank(**keys: Any) -> md.Driver:
    return md.Driver("crank.angle", **keys)


def complex_(points: Any) -> np.ndarray:
    points = np.asarray(points)
    return points[:, 0] + 1j * points[:, 1]


def turned(a: Any, b: Any) -> np.ndarray:
    """Return the difference of two angles, whole turns left out."""
    gap = np.asarray(a, float) - np.asarray(b, float)
    return np.abs(gap - 2 * np.pi * np.round(gap / (2 * np.pi)))


def four_bar(a: float, b: float, c: float, d: float, p=(0.0, 0.0), **sketch: float) -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (d, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (a, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (b, 0), "P": p}),
            md.Body("rocker", {"D": (0, 0), "C": (c, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch=sketch,
    )


# -- near a limit position -------------------------------------------------------------------------

TOGGLE = reference("toggle_fourbar")


@pytest.mark.parametrize(("branch", "mode"), [(1, "+"), (-1, "-")])
def test_rates_up_to_a_millionth_of_a_millionth_before_the_limit(branch: int, mode: str) -> None:
    rows = [row for row in TOGGLE["rows"] if row["branch"] == branch]
    at = [float.fromhex(row["input_hex"]) for row in rows]
    assert at == [float(row["input_double"]) for row in rows]
    problem = md.load("toggle-four-bar")
    result = md.solve(problem.mechanism, md.Sweep(crank(at=at), mode=mode))
    assert list(result.status) == ["ok"] * 12
    assert result.fault is None
    for k, row in enumerate(rows):
        # an input in error by eps theta / 2 changes a speed by this share, four times over
        share = 4 * EPS * at[k] / (2 * float(row["delta"]))
        for body, number in (("coupler", "3"), ("rocker", "4")):
            ours = result.bodies[body]
            gap = turned(ours.angle[k], float(row["t" + number]))
            assert gap <= result.bound.angle[k] + 4 * EPS
            speed, rate = float(row["w" + number]), float(row["al" + number])
            assert abs(ours.angular_velocity[k] - speed) <= share * abs(speed)
            assert abs(ours.angular_acceleration[k] - rate) <= 3 * share * abs(rate)
    # the condition tells how near the limit is: it grows as 1/sqrt(delta)
    delta = np.array([float(row["delta"]) for row in rows])
    spread = result.condition * np.sqrt(delta)
    assert np.all(np.diff(result.condition) > 0)
    assert spread == pytest.approx(spread[-1], rel=0.1)


@pytest.mark.parametrize("row", TOGGLE["unreachable"], ids=lambda row: row["offset"])
def test_beyond_the_limit_the_answer_is_unreachable(row: dict, tmp_path: Path, capsys) -> None:
    inside = [1.0, 1.3, 1.3144247495730805]
    beyond = float(row["input_double"])
    problem = md.load("toggle-four-bar")
    task = md.Sweep(crank(at=[*inside, beyond, 0.5]))
    path = tmp_path / "beyond.toml"
    md.dump(replace(problem, tasks={"beyond": task}, expected=()), path)
    assert main(["solve", str(path), "--json"]) == 1
    captured = capsys.readouterr()
    found = json.loads(captured.out)["tasks"]["beyond"]
    assert found["status"] == ["ok", "ok", "ok", "unassembled", "ok"]
    limit = float(TOGGLE["theta2_limit"])
    assert found["summary"]["limits"] == pytest.approx([-limit, limit], abs=1e-12)
    assert [failed["joint"] for failed in found["summary"]["failed"]] == ["C"]
    assert found["summary"]["failed"][0]["from"] == beyond
    assert "opens at joint C" in captured.err
    assert "limit positions at crank.angle = -75.311" in captured.err
    # what was computed up to there is kept, of the pose that failed only the crank
    alone = md.solve(problem.mechanism, md.Sweep(crank(at=[*inside, 0.5])))
    angles = found["bodies"]["rocker"]["angle"]
    assert angles[3] is None
    assert found["bodies"]["crank"]["angle"][3] == beyond
    assert angles[:3] + angles[4:] == pytest.approx(list(alone.bodies["rocker"].angle), rel=1e-14)
    assert found["condition"][2] > 100 * found["condition"][0]


# -- a cusp of a coupler curve ---------------------------------------------------------------------


def test_cusp_of_a_coupler_curve() -> None:
    data = reference("cusp_coupler")
    p = tuple(float(x) for x in data["coupler_point_local"])
    theta = float(data["params"]["theta_star"])
    mechanism = four_bar(1.0, 3.0, 2.5, 3.2, p, crank=1.0, coupler=-1.2, rocker=-2.24)
    rows = data["rows"]
    at = [theta + float(row["dtheta"]) for row in rows]
    result = md.solve(mechanism, md.Sweep(crank(at=at)))
    assert list(result.status) == ["ok"] * len(rows)
    place = np.array([[float(row["x"]), float(row["y"])] for row in rows])
    speed = np.array([[float(row["vx"]), float(row["vy"])] for row in rows])
    P = result.points["coupler.P"]
    gap = np.hypot(*(P.position - place).T)
    assert np.all(gap <= result.bound.length)
    assert np.all(gap < 2e-14)
    size = math.hypot(*p)
    assert np.abs(P.velocity - speed).max() <= 8 * EPS * size
    # at the cusp only the second derivative is left
    cusp = [row["dtheta"] for row in rows].index("0")
    bend = [float(x) for x in data["second_derivative_at_cusp"]]
    assert P.acceleration[cusp] == pytest.approx(bend, rel=1e-13)
    assert np.abs(P.velocity[cusp]).max() < 1e-14


# -- scales ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", reference("fourbar_scale")["rows"], ids=lambda r: f"{r['s']} m")
def test_any_scale_gives_twelve_digits(row: dict) -> None:
    s, omega = float(row["s"]), float(row["omega"])
    mechanism = four_bar(s, 3 * s, 2.5 * s, 3.2 * s, crank=1.0, coupler=-1.2, rocker=-2.24)
    driver = crank(at=[float(row["theta"])], speed=omega)
    result = md.solve(mechanism, md.Sweep(driver))
    assert result.status[0] == "ok"
    coupler, rocker = result.bodies["coupler"], result.bodies["rocker"]
    for ours, wanted in (
        (coupler.angular_velocity[0], float(row["w3"])),
        (rocker.angular_velocity[0], float(row["w4"])),
        (rocker.angular_acceleration[0], float(row["al4"])),
    ):
        assert abs(ours - wanted) <= 1e-12 * abs(wanted)
    B = np.exp(1j * LONG(row["theta"]))
    line = LONG("3.2") - B
    far = abs(line)
    along = (far * far + 9 - LONG("6.25")) / (2 * far)
    C = complex(B + line / far * (along - 1j * np.sqrt(9 - along * along))) * s
    ours = complex(*result.points["rocker.C"].position[0])
    assert abs(ours - C) <= 1e-15 * abs(C)
    assert result.bound.length[0] < 1e-13 * s


# -- many turns ------------------------------------------------------------------------------------


def geared_tip(theta: Any, ratio: Any) -> Any:
    """Return the pin C of the geared five-bar, from the unreduced angle, in extended floats."""
    theta = np.asarray(theta, LONG)
    left = np.exp(1j * theta)
    right = LONG("2.5") + LONG("0.8") * np.exp(1j * (LONG(ratio) * theta + LONG("0.5")))
    line = right - left
    square = (line * line.conj()).real
    return left + line * (LONG("0.5") + 1j * np.sqrt(9 / square - LONG("0.25")))


@pytest.mark.parametrize(
    ("name", "ratio"), [("geared_fivebar_97_13", "97/13"), ("geared_fivebar_m2", "-2")]
)
def test_geared_five_bar_over_many_turns(name: str, ratio: str) -> None:
    data = reference(name)
    rows = data["rows"]
    at = [float(row["theta1"]) for row in rows]
    problem = md.load("geared-five-bar-97-13").with_values({"mesh.ratio": ratio})
    result = md.solve(problem.mechanism, md.Sweep(crank(at=at)))
    assert list(result.status) == ["ok"] * len(rows)
    C = result.points["left.C"]
    place = np.array([[float(row["Bx"]), float(row["By"])] for row in rows])
    speed = np.array([[float(row["Bvx"]), float(row["Bvy"])] for row in rows])
    fast = np.hypot(*speed.T)
    # the input is rounded: half a unit of its last place times the speed of the point
    rounded = EPS * np.array(at) * fast
    assert np.all(np.hypot(*(C.position - place).T) <= result.bound.length + rounded)
    assert np.all(np.hypot(*(C.velocity - speed).T) <= 1e-11 * fast)
    phi = [float(row["phi"]) for row in rows]
    assert result.bodies["second"].angle == pytest.approx(phi, rel=1e-14)
    # the last row is the first one again, whole turns later
    period = data["closure_input_turns"]
    turns = (at[-1] - at[0]) / (2 * math.pi)
    assert turns / period == pytest.approx(round(turns / period), abs=1e-12)
    assert C.position[-1] == pytest.approx(C.position[0], abs=2e-12)


@pytest.mark.parametrize(("ratio", "turns"), [("97/13", 130), ("-2", 1000)])
def test_a_far_pose_is_reached_on_the_certified_path(ratio: str, turns: int) -> None:
    problem = md.load("geared-five-bar-97-13").with_values({"mesh.ratio": ratio})
    at = [0.3, 0.3 + 2 * math.pi * turns]
    result = md.solve(problem.mechanism, md.Sweep(crank(at=at)))
    assert list(result.status) == ["ok", "ok"]
    exact = LONG(97) / LONG(13) if ratio == "97/13" else LONG(-2)
    gap = np.abs(complex_(result.points["left.C"].position) - geared_tip(at, exact))
    second = abs(float(exact)) * at[1]
    assert np.all(gap.astype(float) <= result.bound.length + np.array([1e-15, EPS * second]))
    assert result.bound.length[1] < 40 * EPS * second
    assert result.bodies["second"].angle[1] == pytest.approx(float(exact) * at[1] + 0.5, rel=1e-14)
    # a step is a share of a turn of the fastest link
    assert result.summary["work"]["path_steps"] < 160 * turns * max(1.0, abs(float(exact)))


# -- change points ---------------------------------------------------------------------------------


def parallel(u: Any) -> Any:
    return np.asarray(u, LONG)


def anti_parallel(u: Any) -> Any:
    """tan(rocker/2) = -2 tan(crank/2), as one continuous function."""
    u = np.asarray(u, LONG)
    return -(u + 2 * np.arctan2(np.sin(u), 3 - np.cos(u)))


def kite(u: Any) -> Any:
    u = np.asarray(u, LONG)
    return u / 2 + np.arcsin(np.sin(u / 2) / 2)


LINKS = {"parallelogram": (1.0, 3.0, 1.0, 3.0), "kite": (1.0, 2.0, 2.0, 1.0)}
BRANCHES = {
    "parallel": ("parallelogram", parallel, np.pi),
    "anti": ("parallelogram", anti_parallel, np.pi),
    "kite": ("kite", kite, 2 * np.pi),
}
"""Links, rocker angle, distance of the change points; one lies at zero."""


def assembled(branch: str, sketched: float) -> md.Mechanism:
    """Return the mechanism sketched on a branch at a crank angle."""
    links, rocker, _ = BRANCHES[branch]
    a, b, c, d = LINKS[links]
    r = float(rocker(sketched))
    side = d + c * np.exp(1j * r) - a * np.exp(1j * sketched)
    return four_bar(a, b, c, d, crank=sketched, coupler=float(np.angle(side)), rocker=r)


def follows(result: md.Result, branch: str) -> None:
    """Assert that every pose lies on the branch, to its bound; speeds to the condition squared.

    Angles of many turns are rounded to many turns' last bits.
    """
    _, rocker, _ = BRANCHES[branch]
    assert set(result.status) == {"ok"}
    u = result.drivers["crank.angle"].position
    closed = rocker(u)
    ours = result.bodies["rocker"]
    unwrapped = ours.angle - np.asarray(closed, float)
    whole = 2 * np.pi * np.round(unwrapped[0] / (2 * np.pi))  # the sketch may count from elsewhere
    slack = 4 * EPS * (1 + np.abs(u))
    assert np.all(np.abs(unwrapped - whole) <= result.bound.angle + slack)
    h = LONG("1e-4")
    rate = (8 * (rocker(u + h) - rocker(u - h)) - rocker(u + 2 * h) + rocker(u - 2 * h)) / (12 * h)
    gap = np.abs(ours.angular_velocity - rate.astype(float))
    rounding = EPS * np.maximum(1, np.abs(u) / np.pi)
    assert np.all(gap <= rounding * result.condition**2 / 4 + 1e-13 + slack)


@pytest.mark.parametrize("row", reference("parallelogram")["rows"], ids=lambda row: row["theta2"])
@pytest.mark.parametrize("branch", ["parallel", "anti"])
def test_parallelogram_between_change_points(row: dict, branch: str) -> None:
    theta = float(row["theta2"])
    name = {"parallel": "parallelogram", "anti": "anti"}[branch]
    angle = float(row[f"theta4_{name}"])
    speed = 1.0 if branch == "parallel" else float(row["w4_anti"])
    assert float(BRANCHES[branch][1](theta)) == pytest.approx(angle, abs=1e-15)
    middle = np.pi * (math.floor(theta / np.pi) + 0.5)
    result = md.solve(assembled(branch, middle), md.Sweep(crank(at=[theta])))
    follows(result, branch)
    assert result.bodies["rocker"].angle[0] == pytest.approx(angle, abs=result.bound.angle[0])
    allowed = EPS * result.condition[0] ** 2 / 4
    assert abs(result.bodies["rocker"].angular_velocity[0] - speed) <= allowed


@pytest.mark.parametrize("row", reference("galloway_kite")["rows"], ids=lambda row: row["theta2"])
def test_kite_between_change_points(row: dict) -> None:
    theta, angle, speed = (float(row[key]) for key in ("theta2", "theta4", "w4"))
    assert float(kite(theta)) == pytest.approx(angle, rel=1e-15)
    middle = 2 * np.pi * (math.floor(theta / (2 * np.pi)) + 0.5)
    result = md.solve(assembled("kite", middle), md.Sweep(crank(at=[theta])))
    follows(result, "kite")
    assert result.bodies["rocker"].angle[0] == pytest.approx(angle, abs=result.bound.angle[0])
    allowed = EPS * result.condition[0] ** 2 / 4
    assert abs(result.bodies["rocker"].angular_velocity[0] - speed) <= allowed


@pytest.mark.parametrize("branch", BRANCHES)
def test_each_piece_ends_at_its_change_points(branch: str) -> None:
    """Stopped there on demand, with both ends located and nothing claimed behind them."""
    _, _, apart = BRANCHES[branch]
    mechanism = assembled(branch, 0.4 * apart)
    driver = crank(from_=0.4 * apart, to=1.6 * apart)
    result = md.solve(mechanism, md.Sweep(driver, poses=60, on_change_point="stop"))
    ends = [e["at"] for e in result.events if e["kind"] == "change_point" and e["in_range"]]
    assert ends == pytest.approx([apart], abs=1e-6)
    u = result.drivers["crank.angle"].position
    before = u < apart
    assert np.all(np.asarray(result.status)[before] == "ok")
    assert not np.any(np.asarray(result.status)[~before] == "ok")
    assert "change point" in result.fault
    gap = np.abs(result.bodies["rocker"].angle - BRANCHES[branch][1](u).astype(float))
    assert np.all(gap[before] <= result.bound.angle[before] + 4 * EPS)


@pytest.mark.parametrize("branch", BRANCHES)
def test_many_turns_on_one_branch(branch: str) -> None:
    """A thousand turns, of the two that take long two hundred."""
    turns, (_, _, apart) = 1000 if branch == "kite" else 200, BRANCHES[branch]
    start = 0.4 * apart
    driver = crank(from_=start, to=start + 2 * np.pi * turns)
    task = md.Sweep(driver, poses=10_007, on_change_point="continue")
    result = md.solve(assembled(branch, start), task)
    follows(result, branch)
    assert result.fault is None
    passed = [e["at"] for e in result.events if e["kind"] == "change_point" and e["in_range"]]
    count = round(2 * np.pi * turns / apart)  # two in a turn of the parallelogram, one of the kite
    assert passed == pytest.approx(list(apart * np.arange(1, count + 1)), abs=1e-9, rel=1e-13)
    assert {e["kind"] for e in result.events if e["in_range"]} == {"change_point"}


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("share", [0.003, 0.1, 0.31, 0.5, 0.77, 0.997])
@pytest.mark.parametrize("branch", BRANCHES)
def test_where_the_steps_fall_does_not_choose_the_branch(
    branch: str, share: float, sense: int
) -> None:
    _, _, apart = BRANCHES[branch]
    start = share * apart
    driver = crank(from_=start, to=start + sense * 4 * np.pi)
    task = md.Sweep(driver, poses=1009, on_change_point="continue")
    follows(md.solve(assembled(branch, start), task), branch)
    close = apart * (1 if sense > 0 else 0)
    at = [close + sense * k * delta for delta in (1e-2, 1e-4, 1e-6) for k in (-1, 1)]
    result = md.solve(assembled(branch, start), md.Sweep(crank(at=at), on_change_point="continue"))
    follows(result, branch)


@pytest.mark.parametrize("state", reference("slider_crank_folding")["states"], ids=lambda s: s["t"])
def test_folding_slider_crank_between_change_points(state: dict) -> None:
    theta, omega = float(state["q"][0]), float(state["v"][0])
    middle = np.pi * round(theta / np.pi)
    mechanism = replace(
        md.load("folding-slider-crank").mechanism, sketch={"crank": middle, "rod": -middle}
    )
    result = md.solve(mechanism, md.Sweep(crank(at=[theta], speed=omega)))
    assert result.status[0] == "ok"
    slide = result.joints["guide"]
    x, v = float(state["slider_x"]), float(state["slider_v"])
    assert slide.slide[0] == pytest.approx(x, abs=1e-14)
    assert slide.slide_velocity[0] == pytest.approx(v, rel=2e-13)
    assert slide.slide_acceleration[0] == pytest.approx(-x * omega**2, rel=1e-12)
    assert turned(result.bodies["rod"].angle[0], -theta) < 1e-14


def test_folded_slider_crank_stays_folded() -> None:
    mechanism = replace(
        md.load("folding-slider-crank").mechanism, sketch={"crank": 0.3, "rod": 0.3 + np.pi}
    )
    task = md.Sweep(crank(from_=-1.5, to=1.5, speed=2.0), poses=31)
    result = md.solve(mechanism, task)
    assert set(result.status) == {"ok"}
    assert np.abs(result.joints["guide"].slide).max() < 1e-14
    assert result.bodies["rod"].angular_velocity == pytest.approx([2.0] * 31, rel=1e-12)


@pytest.mark.parametrize("folded", [False, True])
def test_folding_slider_crank_over_a_hundred_turns(folded: bool) -> None:
    sketch = {"crank": 0.3, "rod": 0.3 + np.pi if folded else -0.3}
    mechanism = replace(md.load("folding-slider-crank").mechanism, sketch=sketch)
    driver = crank(from_=0.3, to=0.3 + 200 * np.pi)
    result = md.solve(mechanism, md.Sweep(driver, poses=3001, on_change_point="continue"))
    assert set(result.status) == {"ok"}
    assert result.fault is None
    u = result.drivers["crank.angle"].position
    rod, slide = result.bodies["rod"].angle, result.joints["guide"].slide
    closed = u + np.pi if folded else -u
    whole = 2 * np.pi * np.round((rod - closed)[0] / (2 * np.pi))
    assert np.all(np.abs(rod - closed - whole) <= result.bound.angle + 4 * EPS * u)
    place = 0 * u if folded else 2 * np.cos(u.astype(LONG)).astype(float)
    assert np.all(np.abs(slide - place) <= result.bound.length + 4 * EPS)
    passed = [e["at"] for e in result.events if e["kind"] == "change_point" and e["in_range"]]
    expected = np.pi * (np.arange(200) + 0.5)
    assert passed == pytest.approx(list(expected), abs=1e-9, rel=1e-13)


# -- a motion that must turn back ------------------------------------------------------------------


@pytest.fixture(scope="module")
def down() -> dict[str, Any]:
    """The double Watt linkage lowered towards its cusp and asked for what lies below."""
    return md.solve("double-watt", "down").to_dict()


def test_double_watt_on_both_sides_of_its_cusp(down: dict[str, Any]) -> None:
    heights = down["drivers"]["coupler_1.M.y"]["position"]
    status = dict(zip(heights, down["status"], strict=True))
    rows = {float(row["yA"]): row["yB_minus_yA"] for row in reference("double_watt_cusp")["rows"]}
    assert status[0.1] == status[0.01] == "ok"
    for row, height in enumerate(heights):
        rise = down["points"]["coupler_2.N"]["position"][row][1]
        if height < 0:
            assert status[height] == "unassembled"
            assert rise is None
        else:
            allowed = 4 * EPS * down["condition"][row]
            assert rise - height == pytest.approx(float(rows[height][0]), abs=allowed)
            assert allowed < 1e-3 * abs(float(rows[height][0]))
    assert down["summary"]["failed"][0]["from"] == -0.01
    low = down["summary"]["limits"][0]
    assert -1e-6 <= low < 0.01
    assert not any(event["kind"] == "limit" for event in down["events"] if event["at"] > 1e-6)


def test_double_watt_turns_back_at_zero(down: dict[str, Any]) -> None:
    assert down["summary"]["limits"][0] == pytest.approx(0.0, abs=1e-6)
