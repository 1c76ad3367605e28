"""Pages of several drivers and of curves that touch: each driver moved, points dragged, symbols."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from tests.attack import page_drivers
from tests.shared.browser import CHROMIUM, loaded, until
from tests.shared.live import in_page
from tests.shared.node import needs_node
from tests.shared.player import Player

ROOT = Path(__file__).parents[2]


def elbows(tip, base, a, b):
    """Return both places at `a` from the base and `b` from the tip."""
    (x, y), (x0, y0) = tip, base
    d = math.hypot(x - x0, y - y0)
    along = (a * a - b * b + d * d) / (2 * d)
    across = math.sqrt(a * a - along * along)
    e = ((x - x0) / d, (y - y0) / d)
    return [
        (x0 + along * e[0] - side * across * e[1], y0 + along * e[1] + side * across * e[0])
        for side in (1, -1)
    ]


@needs_node
def test_each_driver_moves_on_its_own(tmp_path):
    """Along one of two drivers the other is held; at the limit position an arm is straight."""
    page = md.page("five-bar-robot", "circle")
    values = page.data["numbers"]
    found = in_page(
        page,
        """
const shown = () => [session.drivers(), session.pose.status, session.places_of(session.pose)];
const first = shown();
session.along(0);
const other = session.motion.way.name;
session.drive(session.s + 0.05);
const moved = shown();
const [low, high] = session.motion.ends;
session.drive(high.s);
const limit = [high.s, high.kind, shown()];
session.drive(high.s + 0.01);
const beyond = [session.pose.status, session.reason];
session.drive(moved[0][0]);
session.along(-1);
console.log(JSON.stringify([first, other, moved, limit, beyond, shown(), session.range]));
""",
        tmp_path,
    )
    first, other, moved, limit, beyond, back, span = found
    assert other == "tip.P.x"
    (x, y), status, points = moved
    assert status == "ok"
    assert x == first[0][0] + 0.05
    assert y == first[0][1]
    assert points["tip.P"] == pytest.approx([x, y], abs=1e-13)
    a, b, d = (values[name] for name in "abd")
    for reference, base in (("left.B", (0.0, 0.0)), ("right.D", (d, 0.0))):
        near = [math.dist(points[reference], own) for own in elbows((x, y), base, a, b)]
        assert min(near) < 1e-13
    s, kind, (_, status, _) = limit
    assert kind == status == "limit"
    assert s == pytest.approx(math.sqrt((a + b) ** 2 - y * y), abs=1e-12)
    assert beyond[0] == "unassembled"
    assert "opens at" in beyond[1]
    assert back[0] == first[0]
    for name, place in first[2].items():
        assert back[2][name] == pytest.approx(place, abs=1e-14)
    assert span == [page.data["range"][0], page.data["range"][1]]


@needs_node
def test_a_point_is_dragged_by_both_drivers(tmp_path):
    """Motors follow the tip that is pulled; beyond reach it stops where an arm is straight."""
    page = md.page("five-bar-robot", "forward")
    values = page.data["numbers"]
    a, b, d = (values[name] for name in "abd")
    found = in_page(
        page,
        """
const { columns } = data.entries.find((own) => own.part === "tip.P");
const pull = (to) => {
  for (let k = 0; k < 12; k += 1) session.reach(columns, to, (place) => place);
  session.settle();
  return [session.pose.status, session.drivers(), session.places_of(session.pose), session.reason];
};
console.log(JSON.stringify([pull([0.12, 0.4]), pull([0.05, 0.33]), pull([3, 2])]));
""",
        tmp_path,
    )
    for (status, (left, right), points, _), to in zip(
        found, ([0.12, 0.4], [0.05, 0.33]), strict=False
    ):
        assert status == "ok"
        assert points["tip.P"] == pytest.approx(to, abs=1e-7)
        turned = [(a * math.cos(left), a * math.sin(left))]
        turned.append((d + a * math.cos(right), a * math.sin(right)))
        for elbow in turned:
            assert math.dist(elbow, points["tip.P"]) == pytest.approx(b, abs=1e-13)
    _, (left, right), points, _ = found[2]
    assert math.dist(points["left.B"], points["tip.P"]) == pytest.approx(b, abs=1e-13)
    assert math.dist(points["right.D"], points["tip.P"]) == pytest.approx(b, abs=1e-13)
    reach = max(math.dist((0, 0), points["tip.P"]), math.dist((d, 0), points["tip.P"]))
    assert 0.97 * (a + b) < reach <= a + b + 1e-12


@needs_node
def test_other_modes_follow_the_drivers(tmp_path):
    """Off the file's way too the other modes are the other places of elbows."""
    page = md.page("five-bar-robot", "circle")
    a, b, d = (page.data["numbers"][name] for name in "abd")
    (x, y), own, ghosts, chosen, undone = in_page(
        page,
        """
const [x, y] = session.drivers();
session.move([x + 0.02, y - 0.03]);
const { theta, range, mode, motion } = session;
session.ghosts.carry(theta, range, mode, motion.way, session.drivers());
const ghosts = session.ghosts.at(session.s);
const before = session.places_of(session.pose);
session.remember();
session.choose(ghosts[0].label);
const chosen = [session.drivers(), session.places_of(session.pose)];
session.undo();
const others = ghosts.map(({ pose }) => session.places_of(pose));
console.log(JSON.stringify([session.drivers(), before, others, chosen,
  session.places_of(session.pose)]));
""",
        tmp_path,
    )
    found = {tuple(round(v, 9) for v in (*at["left.B"], *at["right.D"])) for at in [own, *ghosts]}
    wanted = {
        tuple(round(v, 9) for v in (*one, *other))
        for one in elbows((x, y), (0, 0), a, b)
        for other in elbows((x, y), (d, 0), a, b)
    }
    assert found == wanted
    assert chosen[0] == [x, y]
    for name, place in ghosts[0].items():
        assert chosen[1][name] == pytest.approx(place, abs=1e-12)
    assert undone == own


@needs_node
@pytest.mark.parametrize(
    "asked", ["five-bar-robot/forward", "pantograph/circle", "differential/line"]
)
def test_random_ways_of_drivers_are_those_of_python(asked, tmp_path):
    with Player(tmp_path) as player:
        found = page_drivers.examine(asked, 2, player)
    assert found["poses"] >= 4
    assert found["other"] == 0
    assert found["worst"] < page_drivers.SAME


@needs_node
def test_symbols_follow_the_dimensions(tmp_path):
    """A cam is drawn as the numbers make it: its profile touches the roller."""
    page = md.page("cam-roller-follower")
    names = [own["name"] for own in page.data["sliders"]]
    base, h, rho = 0.03, 0.012, 0.01
    given = json.dumps({"base": base, "h": h, "rho": rho})
    shape, roller, angle, places = in_page(
        page,
        f"""
const given = {given};
const t = session.dimension(data.sliders.map((own) => given[own.name] ?? own.value));
session.drive(1);
session.look(data.scene);
const joint = data.scene.joints.find((own) => own.curve);
console.log(JSON.stringify([joint.curve, joint.roller, session.angles_of(session.pose).cam,
  session.places_of(session.pose)]));
""",
        tmp_path,
    )
    assert {"base", "h", "rho"} <= set(names)
    s = np.linspace(0, 2 * np.pi, len(shape))
    r = base + h * (3 - 4 * np.cos(s) + np.cos(2 * s)) / 8
    assert np.abs(np.array(shape) - np.stack([r * np.cos(s), r * np.sin(s)], 1)).max() < 1e-12
    assert roller == rho
    fine = np.linspace(0, 2 * np.pi, 20001)
    r = base + h * (3 - 4 * np.cos(fine) + np.cos(2 * fine)) / 8
    apart = np.hypot(
        r * np.cos(fine + angle) - places["follower.R"][0],
        r * np.sin(fine + angle) - places["follower.R"][1],
    )
    assert apart.min() == pytest.approx(rho, abs=1e-8)


def test_laws_with_corners_are_recorded():
    law = md.Driver("crank.angle", law="abs(t - 1)", from_=0, to=2)
    data = md.page(
        md.load("four-bar-crank-rocker").with_task("corner", md.Sweep(driver=law)), "corner"
    ).data
    assert data["live"] is False
    assert "corners" in data["reason"]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_drivers_by_hand(browser, tmp_path):
    """Sliders of drivers, the choice of what curves are drawn over, a point pulled, the address."""
    page = browser.new_page()
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    file = md.page("five-bar-robot", "forward").save(tmp_path / "page.html")
    loaded(page, file)
    first = page.evaluate("mechdae.pose().driver")
    field = page.locator("#dimensions").get_by_label("left.angle [°]")
    field.fill("120")
    field.press("Enter")
    until(page, "Math.abs(mechdae.pose().driver['left.angle'] - 2 * Math.PI / 3) < 1e-12")
    assert page.evaluate("mechdae.pose().driver['right.angle']") == first["right.angle"]
    assert page.locator("#dimensions select").input_value() == "0"
    assert page.evaluate("mechdae.set({'left.angle': 2.1, 'right.angle': 1})") is True
    wanted = page.evaluate("mechdae.pose().points['tip.P'].position")
    until(page, "location.hash.includes('drivers=')")
    address = page.url
    again = browser.new_page()
    again.goto(address)
    again.evaluate("mechdae.ready")
    assert again.evaluate("mechdae.pose().points['tip.P'].position") == pytest.approx(wanted)
    again.close()
    pins = [own.bounding_box() for own in page.locator("[data-id$='-pin']").all()]
    box = min(pins, key=lambda own: own["y"])  # the tip is the highest pin
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 20, y + 15, steps=5)
    page.mouse.up()
    until(page, f"Math.abs(mechdae.pose().points['tip.P'].position[0] - {wanted[0]}) > 1e-3")
    assert page.evaluate("mechdae.pose().status") == "ok"
    page.locator("#dimensions select").select_option("-1")
    until(page, "mechdae.pose().driver.t !== undefined")
    loaded(page, md.page("five-bar-robot", "circle").save(tmp_path / "circle.html"))
    field = page.locator("#dimensions").get_by_label("tip.P.x [mm]")
    field.fill("2000")
    field.press("Enter")
    until(page, "document.querySelector('#dimensions .note:not([hidden])') !== null")
    assert "opens at" in page.locator("#dimensions .note:not([hidden])").inner_text()
    assert page.evaluate("mechdae.pose().status") == "limit"
    assert page.evaluate("mechdae.set({'tip.P.x': 0.1})") is True  # back from the limit position
    assert page.evaluate("mechdae.set({'tip.P.x': 9})") is False
    assert page.evaluate("mechdae.reason") != ""
    assert said == []
    page.close()
