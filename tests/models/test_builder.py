"""Mechanisms from places in one drawn pose, complete or not."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import mechdae as md


def slider_crank() -> md.DrawnMechanism:
    m = md.build(units="mm,deg", title="own slider-crank")
    m.body("crank").body("rod", P=(60, 80)).body("slider")
    m.pin("O", "ground", "crank", at=(0, 0)).pin("B", "crank", "rod", at=(30, 40))
    return m.pin("C", "rod", "slider", at=(150, 0)).slide("guide", "ground.O", "slider.C")


def test_a_drawn_slider_crank_is_the_closed_form() -> None:
    result = slider_crank().solve()
    r, rod = 0.05, math.hypot(0.12, 0.04)
    phi = result.drivers["crank.angle"].position
    x = r * np.cos(phi) + np.sqrt(rod**2 - (r * np.sin(phi)) ** 2)
    np.testing.assert_allclose(result.joints["guide"].slide, x, rtol=1e-12)
    assert result.summary["swing"]["crank"] == pytest.approx(2 * math.pi)
    assert slider_crank().solve("modes").summary["count"] == 2
    numbers = slider_crank().mechanism().values()
    assert numbers["crank.B.x"] == pytest.approx(0.05)  # lengths are settable by name


def test_the_drawn_pose_is_a_pose_of_the_mechanism() -> None:
    m = slider_crank()
    at = md.Driver("crank.angle", at=[math.atan2(40, 30)])
    pose = md.solve(m.mechanism(), md.Sweep(driver=at))
    for point, place in {"rod.P": (60, 80), "rod.C": (150, 0), "crank.B": (30, 40)}.items():
        assert pose.points[point].position[0] == pytest.approx(np.array(place) / 1000, abs=1e-12)


def test_a_builder_says_what_is_missing() -> None:
    m = md.build(units="mm")
    assert m.missing() == ['no body yet: m.body("crank")']
    m.body("crank").body("rod").body("slider")
    assert "slider has no point and no joint" in m.missing()
    m.pin("O", "ground", "crank", at=(0, 0)).pin("B", "crank", "rod", at=(30, 40))
    m.pin("C", "rod", "slider", at=(150, 0))
    assert m.missing() == ["2 degrees of freedom have no driver; slider hangs on one joint"]
    assert "2 degrees of freedom" in repr(m)
    m.slide("guide", "ground.O", "slider.C")
    assert m.missing() == []
    assert repr(m) == "<DrawnMechanism: 3 bodies, 4 joints; complete>"


def test_it_draws_itself_before_it_is_complete() -> None:
    m = md.build(units="mm").body("crank", A=(0, 0), B=(30, 40))
    assert m.missing() == ["no joint leads from crank to the ground"]
    axes = m.plot()
    assert {"A", "B"} <= {text.get_text().strip("$") for text in axes.texts}
    html = slider_crank()._repr_html_()
    assert "<img src=" in html
    assert "complete" in html
    assert "no body yet" in md.build()._repr_html_()


def test_a_cylinder_between_two_points_finds_its_pressure() -> None:
    m = md.build(units="mm,deg,kN")
    m.body("boom", O=(0, 0), A=(200, 150), T=(1000, 300)).body("ground", H=(400, 0))
    m.pin("O", "ground", "boom").cylinder("cyl", "ground.H", "boom.A", bore=50)
    result = m.drive("cyl", 230, 270).force("F", "boom.T", (0, -2)).solve()
    slide = result.drivers["cyl.slide"].position
    assert (slide[0], slide[-1]) == pytest.approx((0.23, 0.27))
    inner = np.arccos((0.4**2 + 0.25**2 - slide**2) / (2 * 0.4 * 0.25))  # angle A O H
    lever = 0.4 * 0.25 * np.sin(inner) / slide
    turned = inner - math.atan2(150, 200)
    moment = 2000 * math.hypot(1, 0.3) * np.cos(turned + math.atan2(300, 1000))
    area = math.pi / 4 * 0.05**2
    np.testing.assert_allclose(result.outputs["cyl_pressure"].value, moment / lever / area)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.pin("A", "ground", "crnk", at=(0, 0)), "unknown body 'crnk'"),
        (lambda m: m.pin("A", "ground", "crank"), "joint A has no place"),
        (lambda m: m.pin("B", "ground", "crank", at=(31, 40)), "crank.B is drawn 1 away"),
        (lambda m: m.body("crank", C=(1,)), "a place (x, y) is needed"),
        (lambda m: m.body("ground", O=(0, 0)).slide("g", "ground.O", "crank.B"), "is 40 off"),
        (lambda m: m.cylinder("c", "ground.H", "crank.B"), "ground.H has no place yet"),
        (lambda m: md.build(units="mm,cm"), "mm and cm are both units of lengths"),
        (lambda m: md.build().plot(), "nothing is there to draw"),
        (lambda m: m.joint(md.Distance("d", "ground.O", "crank.B", 1.0)), "ground.O has no place"),
    ],
)
def test_bad_calls(call, message: str) -> None:
    m = md.build(units="mm").body("crank", B=(30, 40))
    with pytest.raises(md.InputError, match=re.escape(message)):
        call(m)


def test_two_joints_of_one_name_are_refused() -> None:
    with pytest.raises(md.InputError, match="a joint of that name"):
        slider_crank().pin("B", "ground", "crank", at=(30, 40))


def test_problems_and_mechanisms_show_their_sketch() -> None:
    problem = md.four_bar(100, 40, 120, 80, units="mm")
    for shown in (problem, problem.mechanism, md.load("c5-ellipse10-free")):
        assert shown._repr_html_().startswith('<img src="data:image/svg+xml;base64,')
    lost = problem.mechanism.with_values({"ground": 1.0})
    assert lost._repr_html_().startswith("<pre>")
