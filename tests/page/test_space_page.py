"""Pages of spatial mechanisms: poses and turns are Python's, the view turns."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.space.viewpoint import Viewpoint
from tests.shared.browser import CHROMIUM, covered, loaded
from tests.shared.live import WEB, in_page
from tests.shared.node import needs_node, run_script

LIVE = ("rssr", "cardan-joint", "spatial-slider-crank-loops")


@pytest.fixture(scope="module")
def made():
    return {name: md.page(name) for name in (*LIVE, "bennett")}


@pytest.fixture(scope="module")
def pages(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    return {name: own.save(folder / f"{name}.html") for name, own in made.items()}


@needs_node
@pytest.mark.parametrize("name", LIVE)
def test_poses_in_space_are_those_of_python(name, made, tmp_path):
    page = made[name]
    assert page.data["live"] is True
    result = md.solve(name, "turn")
    rows = [3, 77, 190, 301]
    places = np.asarray(result.drivers[page.data["driver"]["name"]].position)[rows].tolist()
    found = in_page(
        page,
        f"""
const poses = {json.dumps(places)}.map((s) => session.motion.pose(s));
const told = (pose, e) => e.names.map((_, order) => session.told(pose, e, order));
const row = (pose, e) => [e.kind, e.part, e.names, told(pose, e), pose.status];
console.log(JSON.stringify({{ test: session.selfTest(),
  poses: poses.map((pose) => data.entries.map((e) => row(pose, e))) }}));
""",
        tmp_path,
    )
    assert found["test"] < 0.1
    compared = 0
    for k, pose in zip(rows, found["poses"], strict=True):
        for kind, part, names, values, status in pose:
            assert status == "ok"
            for order, (entry, value) in enumerate(zip(names, values, strict=True)):
                every = np.asarray(getattr(result, kind)[part][entry])
                wanted = np.atleast_1d(every[k])
                if entry == "orientation":
                    wanted = wanted * np.sign(wanted @ np.array(value))
                size = np.abs(every).max() or 1.0
                miss = np.abs(np.array(value) - wanted).max()
                assert miss <= (1e-13, 1e-13, 1e-12)[order] * max(size, 1.0 if order else size)
                compared += 1
    assert compared >= 4 * 3 * len(page.data["entries"])


def test_superfluous_equations_are_recorded_with_turns(made):
    data = made["bennett"].data
    assert "redundant" in data["reason"]
    assert set(data["recorded"]["turns"]) == {"link1", "link2", "link3"}


def test_reactions_in_space_are_shown_as_motions():
    problem = md.load("rssr")
    task = md.Reactions(driver=problem.task("turn").driver, poses=7)
    data = md.page(problem.with_task("loads", task), "loads").data
    assert data["live"] is True
    assert data["forces"] is None
    assert "only motions" in data["without"]


@needs_node
def test_quaternions_and_spins(tmp_path):
    """A turn of 200 degrees about (1, 2, 2)/3 at 3 rad/s, by Rodrigues' formula."""
    axis, angle = np.array([1.0, 2.0, 2.0]) / 3, np.deg2rad(200.0)
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    rate = 3.0 * cross @ turn
    columns = [own.T.ravel().tolist() for own in (turn, rate)]
    found = run_script(
        f'import {{ quaternion, spin }} from "{(WEB / "session.js").as_posix()}";\n'
        f"const [turn, rate] = {json.dumps(columns)};\n"
        "console.log(JSON.stringify([quaternion(turn), spin(rate, turn)]));\n",
        tmp_path,
    )
    wanted = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
    np.testing.assert_allclose(found[0], wanted * np.sign(wanted[0]), atol=1e-15)
    np.testing.assert_allclose(found[1], 3.0 * axis, atol=1e-14)


@needs_node
@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.6, 0.0, -0.8)])
def test_the_page_looks_from_where_the_pictures_do(up, tmp_path):
    found = run_script(
        f'import {{ basisOf }} from "{(WEB / "space.js").as_posix()}";\n'
        f"console.log(JSON.stringify(basisOf({{ azimuth: 37, elevation: -12, up: {list(up)} }})));",
        tmp_path,
    )
    np.testing.assert_allclose(found, Viewpoint(37.0, -12.0, up).basis, atol=1e-15)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_the_view_turns_by_pointer_and_keys(opened):
    page = opened("cardan-joint")
    assert page.evaluate("mechdae.live") is True
    view = "mechdae.view()"
    before = page.evaluate(view)
    parts = page.evaluate("document.querySelectorAll('#diagram .depths > *').length")
    assert parts > 30
    box = page.locator("#diagram").bounding_box()
    page.mouse.move(box["x"] + 40, box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 80, box["y"] + 60)
    page.mouse.up()
    turned = page.evaluate(view)
    assert turned["azimuth"] == pytest.approx(before["azimuth"] - 20)
    assert turned["elevation"] == pytest.approx(before["elevation"] + 10)
    page.locator("#diagram").focus()
    page.keyboard.press("d")
    page.keyboard.press("s")
    keyed = page.evaluate(view)
    assert keyed["azimuth"] == pytest.approx(turned["azimuth"] + 5)
    assert keyed["elevation"] == pytest.approx(turned["elevation"] - 5)
    page.keyboard.press("0")
    assert page.evaluate(view) == pytest.approx(before)
    page.select_option("select[aria-label='View']", "top")
    assert page.evaluate(view)["elevation"] == 90


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_recorded_mechanisms_turn_too(opened):
    page = opened("bennett")
    assert "redundant" in page.evaluate("mechdae.live")
    first = page.inner_html("#diagram .depths")
    page.locator("#diagram").focus()
    page.keyboard.press("a")
    assert page.inner_html("#diagram .depths") != first


INK = """() => {
  const sheet = document.getElementById("diagram").getBoundingClientRect();
  return [...document.querySelectorAll("#diagram .parts [data-id^=label-]")].map((label) => {
    const { left, right } = label.getBoundingClientRect();
    return [label.dataset.id, left - sheet.left, sheet.right - right];
  });
}"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("name", ["double-wishbone", "bevel-differential"])
def test_long_names_stay_in_the_picture(name, browser, tmp_path):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    loaded(page, md.page(name).save(tmp_path / "page.html"))
    for share in (0, 0.25, 0.5, 0.75, 1):
        page.locator("#drive input[type=range]").fill(str(share))
        for label, left, right in page.evaluate(INK):
            assert min(left, right) >= 0, (label, share)
        page.click("#tab-plans")
        assert covered(page) == [], share
    page.close()
