"""Linkages found with the mouse in Chromium: of poses, points, curves; taken, saved, solved."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import mechdae as md
from tests.reference import burmester
from tests.reference.coupler_curves import beyond, drawn_four_bar, drawn_geared_five_bar, off
from tests.shared.browser import CHROMIUM
from tests.shared.finding import Finding

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

POSES = [(0.02, 0.02, 0.3), (0.08, 0.08, 0.9), (0.15, 0.07, 0.4), (0.19, 0.03, -0.2),
         (0.12, 0.0, -0.1)]  # fmt: skip


@pytest.fixture(scope="module")
def whole(browser, tmp_path_factory):
    own = Finding(browser, tmp_path_factory.mktemp("editor"))
    yield own
    assert own.said == []


@pytest.fixture
def finding(whole):
    whole.again()
    return whole


def places(page):
    nodes = page.evaluate("mechdae.state().nodes")
    return {own["name"]: complex(own["x"], own["y"]) for own in nodes}


def drop(finding, poses):
    """Press where the body's point is, drag where it looks."""
    mouse = finding.page.mouse
    for x, y, angle in poses:
        u, v = finding.at(x, y)
        mouse.move(u, v)
        mouse.down()
        mouse.move(u + 50 * math.cos(angle), v - 50 * math.sin(angle), steps=3)
        mouse.up()


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_poses_by_the_mouse_become_a_drawing_that_meets_them(finding, tmp_path, count):
    page = finding.page
    finding.choose("Poses")
    drop(finding, POSES[:count])
    poses = page.evaluate("mechdae.finder.task.poses")
    assert np.abs(np.array(poses) - POSES[:count]).max() < 2e-2
    finding.choose("Search")
    found = finding.waited()
    assert found
    assert all(own["good"] for own in found if own["branch"])
    assert all(own["miss"] < 1e-6 for own in found if own["good"])
    page.locator(".linkage").first.click()
    assert found[0]["good"]
    assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
    file = tmp_path / "found.toml"
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    problem = md.load(file)
    driver = problem.task("window").driver.coordinate
    # at the crank's angle of each pose the coupler is where the poses have it
    nodes = places(page)
    a, b = burmester.displacements(poses)
    pins = np.concatenate([[nodes["A"]], a * nodes["A"] + b])
    values = np.unwrap(np.angle(pins - nodes["A0"]))
    for k, value in enumerate(values):
        result = md.solve(
            problem.mechanism, md.Sweep(driver=md.Driver(driver, at=(values[0], value)))
        )
        assert set(result.status) == {"ok"}
        end = a[k - 1] * nodes["B"] + b[k - 1] if k else nodes["B"]
        ways = result.points["coupler.B"].position
        if abs(complex(*ways[1]) - end) > 1e-9:  # on the other branch of this motion's step
            assert page.evaluate(f"mechdae.set({value!r})")
            assert abs(complex(*page.evaluate("mechdae.pose().points['coupler.B']")) - end) < 1e-9


def test_chosen_pivots_are_those_of_the_linkage(finding):
    page = finding.page
    finding.choose("Poses")
    drop(finding, POSES[:3])
    finding.choose("Pivots")
    for place in ((0.05, -0.02), (0.12, -0.03)):
        page.mouse.click(*finding.at(*place))
    finding.choose("Search")
    found = finding.waited()
    assert len(found) == 1
    page.locator(".linkage").first.click()
    nodes = places(page)
    pivots = [complex(*own) for own in page.evaluate("mechdae.finder.task.pivots")]
    assert {nodes["A0"], nodes["B0"]} == set(pivots)
    poses = page.evaluate("mechdae.finder.task.poses")
    ends = [nodes["A"], nodes["B"]] if nodes["A0"] == pivots[0] else [nodes["B"], nodes["A"]]
    for pivot, end in zip(pivots, ends, strict=True):
        assert abs(burmester.point_of_pivot(poses, pivot) - end) < 1e-9


def test_two_points_of_burmesters_curves_are_a_linkage(finding):
    page = finding.page
    finding.choose("Poses")
    drop(finding, POSES[:4])
    finding.choose("Search")
    before = finding.waited()
    near = [own for own in page.evaluate("mechdae.finder.dyads")
            if own["m"] and all(-0.03 < v < 0.14 for v in (*own["z"], *own["m"]))]  # fmt: skip
    assert len(near) > 2
    chosen = [near[0], max(near, key=lambda own: math.dist(own["z"], near[0]["z"]))]
    for own in chosen:
        page.mouse.click(*finding.at(*own["z"]))
    found = page.evaluate("mechdae.finder.found.length")
    assert found == min(12, len(before) + 1)
    poses = page.evaluate("mechdae.finder.task.poses")
    nodes = places(page)
    for point, pivot in (("A", "A0"), ("B", "B0")):
        if pivot in nodes:
            assert np.abs(burmester.misses(poses, nodes[point], nodes[pivot])).max() < 1e-9


def test_points_by_clicks_are_passed_in_their_order(finding):
    page = finding.page
    finding.choose("Points")
    places = [(0.02, 0.02), (0.06, 0.07), (0.11, 0.09), (0.16, 0.07), (0.13, 0.03), (0.08, 0.01)]
    for place in places:
        page.mouse.click(*finding.at(*place))
    finding.choose("Search")
    found = finding.waited()
    points = np.array(page.evaluate("mechdae.finder.task.points")) @ [1, 1j]
    good = [own for own in found if own["good"]]
    assert len(good) >= 3
    for own in good[:3]:
        assert beyond(points, own["way"]) < 0.01 * 0.14
        assert own["order"] == [1, 2, 3, 4, 5, 6]


def drawn(finding, curve):
    mouse = finding.page.mouse
    finding.choose("Curve")
    for k, place in enumerate(np.append(curve, curve[0])):
        mouse.move(*finding.at(place.real, place.imag))
        if k == 0:
            mouse.down()
    mouse.up()


def test_a_curve_by_the_mouse_becomes_a_file_that_python_solves(finding, tmp_path):
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    bean = 1.4 * np.cos(angle) + 1j * (0.7 * np.sin(angle) + 0.45 * np.cos(angle) ** 2)
    drawn(finding, 0.1 + 0.04j + 0.05 * bean)
    found = finding.waited()
    page = finding.page
    page.locator(".linkage").first.click()
    file = tmp_path / "found.toml"
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    result = md.solve(file, "window")
    assert set(result.status) == {"ok"}
    point = next(own for name, own in result.points.items() if name.endswith(".P"))
    way = point.position @ [1, 1j]
    wanted = np.array(page.evaluate("mechdae.finder.task.curve")) @ [1, 1j]
    assert off(wanted, way) < 0.01
    assert abs(off(wanted, way) - found[0]["miss"]) < 2e-3


@pytest.mark.parametrize("full", [True, False], ids=["full turn", "swinging"])
def test_curves_of_random_four_bars_come_back(finding, full):
    """A sample; `tests/scripts/found_linkages.py` measures two hundred of both."""
    generator = np.random.default_rng(3)
    finding.atlas()
    back, times = 0, []
    for _ in range(8):
        curve = drawn_four_bar(generator, full=full)
        found, seconds = finding.curve(curve, whole=False)
        back += min(off(curve, own["way"]) for own in found if own["good"]) < 0.01
        times.append(seconds)
    assert back == 8 or (not full and back >= 6)
    assert np.median(times) < 2.0


@pytest.mark.parametrize("ratio", [-2])
def test_curves_of_geared_five_bars_come_back_with_their_gears(finding, tmp_path, ratio):
    finding.atlas()
    curve = drawn_geared_five_bar(np.random.default_rng(1), ratio)
    found, _ = finding.curve(curve)
    best = next(k for k, own in enumerate(found) if own["class"] == "geared" and own["good"])
    assert found[best]["error"] < 0.01
    thumb = finding.page.locator(".linkage").nth(best)
    thumb.click()
    (shown,) = re.findall(r"\(i = (-?\d)\)", thumb.inner_text())
    file = tmp_path / "geared.toml"
    file.write_text(finding.page.evaluate("mechdae.toml()"), encoding="utf-8")
    assert f"ratio = {shown}" in file.read_text(encoding="utf-8")
    result = md.solve(file, "window")
    assert set(result.status) == {"ok"}
    assert off(curve, result.points["coupler.P"].position @ [1, 1j]) < 0.01


def test_curves_that_six_bars_trace_are_found(finding):
    """Among the candidates are six-bars whose driver does not turn through."""
    finding.atlas()
    s = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    x, y = 1.3 * np.sin(s) * (0.4 + 0.6 * np.cos(s) ** 2) + 0.1 * np.cos(s), 1.5 * np.cos(s)
    hourglass = 0.04 * (x + 1j * y)
    found, _ = finding.curve(hourglass)
    good = [own for own in found if own["good"]]
    assert {own["class"] for own in good} & {"watt", "stephenson"}
    assert min(off(hourglass, own["way"]) for own in good) < 0.01


def test_the_task_goes_on_in_synthesize(finding, tmp_path):
    page = finding.page
    finding.choose("Poses")
    drop(finding, POSES)
    finding.choose("Search")
    found = finding.waited()
    file = tmp_path / "task.toml"
    file.write_text(page.evaluate("mechdae.finder.toml()"), encoding="utf-8")
    result = md.synthesize(file)
    assert result.summary["verdict"] == "proven"
    dyads = burmester.dyads_of_five(page.evaluate("mechdae.finder.task.poses"))
    count = len(dyads) * (len(dyads) - 1) // 2
    assert len(found) == count


TASKS = {
    "points": "[[0, 0], [0.05, 0.05], [0.1, 0.05], [0.1, 0], [0.05, -0.02]]",
    "curve": "Array.from({ length: 40 }, (_, k) => [Math.cos(k / 6.37), Math.sin(k / 6.37)])",
}


@pytest.mark.parametrize("kind", list(TASKS))
def test_tasks_of_curves_are_problem_files(finding, tmp_path, kind):
    finding.choose(kind.capitalize())
    finding.page.evaluate(f"mechdae.finder.task.{kind} = {TASKS[kind]}")
    file = tmp_path / "task.toml"
    file.write_text(finding.page.evaluate("mechdae.finder.toml()"), encoding="utf-8")
    goal = md.load(file).task("design").goal
    assert goal.closed == (kind == "curve")
    assert len(goal.targets) == (25 if kind == "curve" else 5)
