"""Outputs that use forces, and where outputs cross values: free bodies and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

import mechdae as md
from tests.shared.command import run

A, B, H, JAW, MASS, SPEED, G = 0.12, 0.14, np.array([0.06, -0.15]), 1e4, 2.0, 0.02, 9.81
RHO, GUIDE, HALF = 0.008 * math.sin(math.atan(0.1)), 0.12, 0.03
"""Radius of the friction circles, friction of the guide, half the length of its block."""


def angles(s):
    """Return the angles of arm, link and barrel, and the jaw's place, of the cylinder's length."""
    d, bearing = mp.hypot(*H), mp.atan2(H[1], H[0])
    arm = bearing + mp.acos((A**2 + d**2 - s**2) / (2 * A * d))
    ax, ay = A * mp.cos(arm), A * mp.sin(arm)
    link = -mp.asin(ay / B)
    return arm, link, mp.atan2(ay - H[1], ax - H[0]), ax + B * mp.cos(link)


def clamp(s: float, friction: bool = True) -> tuple[float, float]:
    """Return effort and loss: free bodies of five links, friction circles by iteration.

    Unknown are the forces on the second body of O, A, Ar, B, H, normal force, moment and effort of
    the cylinder on the rod, normal force and moment of the guide on the jaw.
    """
    values = [float(v) for v in angles(s)]
    rates = [SPEED * float(mp.diff(lambda x, k=k: angles(x)[k], s)) for k in range(4)]
    pull = MASS * SPEED**2 * float(mp.diff(lambda x: angles(x)[3], s, 2))
    arm, _, barrel, x = values
    a, b = A * np.array([math.cos(arm), math.sin(arm)]), np.array([x, 0.0])
    along = np.array([math.cos(barrel), math.sin(barrel)])
    across = np.array([-along[1], along[0]])
    turns = {"ground": 0.0, "arm": rates[0], "link": rates[1], "rod": rates[2], "jaw": 0.0}
    turns["barrel"] = rates[2]
    pins = [("ground", "arm", np.zeros(2)), ("arm", "link", a), ("arm", "rod", a)]
    pins += [("link", "jaw", b), ("ground", "barrel", H)]
    bodies = ["arm", "link", "jaw", "barrel", "rod"]
    lhs, fixed = np.zeros((15, 15)), np.zeros(15)
    frictional = {}

    def acts(column: int, body: str, force, place, moment: float = 0.0) -> None:
        if body in bodies:
            row = 3 * bodies.index(body)
            lhs[row : row + 2, column] += force
            lhs[row + 2, column] += place[0] * force[1] - place[1] * force[0] + moment

    for k, (first, second, place) in enumerate(pins):
        for axis in range(2):
            unit = np.eye(2)[axis]
            acts(2 * k + axis, second, unit, place)
            acts(2 * k + axis, first, -unit, place)
    for sign, body in ((1, "rod"), (-1, "barrel")):
        acts(10, body, sign * across, a)
        acts(11, body, np.zeros(2), a, sign)
        acts(12, body, sign * along, a)
    acts(13, "jaw", np.array([0.0, 1.0]), b)
    acts(14, "jaw", np.zeros(2), b, 1.0)
    jaw = 3 * bodies.index("jaw")
    fixed[jaw : jaw + 2] += [-JAW - pull, -MASS * G]
    fixed[jaw + 2] += b[0] * -MASS * G
    forces = np.linalg.solve(lhs, -fixed)
    for _ in range(200 if friction else 0):
        frictional = {}
        loads = fixed.copy()
        for k, (first, second, _) in enumerate(pins):
            turn = turns[second] - turns[first]
            moment = -np.sign(turn) * RHO * math.hypot(*forces[2 * k : 2 * k + 2])
            for sign, body in ((1, second), (-1, first)):
                if body in bodies:
                    loads[3 * bodies.index(body) + 2] += sign * moment
            frictional[k] = -moment * turn
        drag = GUIDE * max(abs(forces[13]), abs(forces[14]) / HALF)
        loads[jaw] -= np.sign(rates[3]) * drag
        frictional["guide"] = drag * abs(rates[3])
        forces = np.linalg.solve(lhs, -loads)
    return float(forces[12]), sum(frictional.values())


def where(friction: bool) -> float:
    low, high = 0.15, 0.161
    for _ in range(45):
        middle = (low + high) / 2
        low, high = (middle, high) if JAW / abs(clamp(middle, friction)[0]) < 10 else (low, middle)
    return (low + high) / 2


@pytest.mark.parametrize("task", ["close", "smooth"])
def test_a_clamp_multiplies_by_ten_from_a_stroke_on(task: str) -> None:
    result = md.solve("toggle-clamp", task)
    (event,) = [event for event in result.events if event.kind == "crossing"]
    stroke = where(task == "close")
    assert event.at == pytest.approx(stroke, abs=1e-12)
    assert event["bound"] < 1e-12
    assert f"{1000 * event.at:.2f}" == ("157.44" if task == "close" else "155.86")
    assert (event.value, event.direction) == (10, "up")
    row = 100
    effort, lost = clamp(float(result.drivers["cyl.slide"].position[row]), task == "close")
    assert result.outputs["amp"].value[row] == pytest.approx(JAW / abs(effort), rel=1e-10)
    assert result.outputs["lost"].value[row] == pytest.approx(lost, rel=1e-9, abs=1e-12)


def test_the_best_efficiency_lies_between_the_poses() -> None:
    result = md.solve("toggle-clamp", "close")
    (event,) = [event for event in result.events if event.kind == "extreme"]
    value, slide = result.outputs["efficiency"].value, result.drivers["cyl.slide"].position
    best = int(np.nanargmax(value))
    assert 0 < best < len(value) - 1
    assert event.value >= value[best]
    assert abs(event.at - slide[best]) < slide[1] - slide[0]
    for way in (-1, 1):
        effort, lost = clamp(event.at + way * 1e-5)
        power = SPEED * abs(effort)
        assert (power - lost) / power < event.value + 1e-12


def test_the_command_shows_the_stroke(capsys) -> None:
    code, out, _ = run(capsys, "solve", "toggle-clamp", "--task", "close", "--units", "mm")
    assert code == 0
    assert "crossing  157.435885441 mm: amp crosses 10, going up" in out


CRANK = {"coordinate": "crank.angle", "from_": 0, "to": "2*pi", "speed": 10}


def sweep(problem: str, *finds, **changes):
    driver = md.Driver(**{**CRANK, **changes})
    return md.solve(problem, md.Sweep(driver=driver, poses=13, find=finds))


def test_places_of_a_slider_crank_are_those_of_the_closed_form() -> None:
    r, rod, x = 0.1, 0.3, 0.33
    result = sweep("slider-crank", {"output": "guide.slide", "crosses": x})
    cosine = (r**2 + x**2 - rod**2) / (2 * r * x)
    places = [math.acos(cosine), 2 * math.pi - math.acos(cosine)]
    assert [event.at for event in result.events] == pytest.approx(places, abs=1e-13)
    assert [event.direction for event in result.events] == ["down", "up"]
    for event, place in zip(result.events, places, strict=True):
        assert abs(event.at - place) <= event["bound"] < 1e-12
    up = {"output": "guide.slide", "crosses": "l + r/3 - 1/300", "direction": "up"}
    (event,) = sweep("slider-crank", up).events
    assert event.at == pytest.approx(places[1], abs=1e-12)


def test_extremes_are_those_of_the_closed_form() -> None:
    r, rod, w = mp.mpf("0.1"), mp.mpf("0.3"), 10

    def speed(phi):
        return w * mp.diff(lambda p: r * mp.cos(p) + mp.sqrt(rod**2 - (r * mp.sin(p)) ** 2), phi)

    top = mp.findroot(lambda phi: mp.diff(speed, phi), 1.3)
    finds = [{"output": "guide.slide.speed", "extreme": word} for word in ("min", "max")]
    least, most = sweep("slider-crank", *finds).events
    assert abs(least.at - float(top)) < 1e-9
    assert abs(least.at - float(top)) <= least["bound"]
    assert least.value == pytest.approx(float(speed(top)), rel=1e-13)
    assert most.at == pytest.approx(2 * math.pi - float(top), abs=1e-9)


def test_a_value_at_the_end_is_an_extreme() -> None:
    (event,) = sweep("slider-crank", {"output": "guide.slide", "extreme": "max"}, to=1).events
    assert (event.at, event["bound"]) == (0.0, 0.0)


def test_a_pole_is_no_crossing() -> None:
    result = sweep("slider-crank", {"output": "1/(guide.slide - 0.33)", "crosses": 0.0})
    assert not result.events
    (note,) = result.summary["notes"]
    assert "find[0]: 1/(guide.slide - 0.33) does not cross 0: it goes from" in note


def test_a_value_that_is_not_reached_tells_the_range() -> None:
    result = sweep("slider-crank", {"output": "guide.slide", "crosses": 2})
    assert result.summary["notes"] == [
        "find[0]: guide.slide does not cross 2: it goes from 0.2 to 0.4"
    ]


def test_laws_of_time_tell_the_time() -> None:
    driver = md.Driver("crank.angle", law="5*t**2", from_=0, to=1)
    task = md.Sweep(driver=driver, poses=11, find=[{"output": "guide.slide", "crosses": 0.33}])
    event = md.solve("slider-crank", task).events[0]
    place = math.acos((0.1**2 + 0.33**2 - 0.3**2) / (2 * 0.1 * 0.33))
    assert event.at == pytest.approx(place, abs=1e-12)
    assert event.time == pytest.approx(math.sqrt(place / 5), abs=1e-12)


def test_several_drivers_name_all_their_values() -> None:
    drivers = [md.Driver("left.angle", from_=2.0, to=2.4), md.Driver("right.angle", at=[1.0])]
    find = {"output": "tip.P.y", "crosses": 0.4}
    result = md.solve("five-bar-robot", md.Sweep(drivers=drivers, find=[find]))
    for event in result.events:
        held = [md.Driver(d.coordinate, at=[v]) for d, v in zip(drivers, event.at, strict=True)]
        place = md.solve("five-bar-robot", md.Sweep(drivers=held)).points["tip.P"].position[0]
        assert place[1] == pytest.approx(0.4, abs=1e-12)
    assert len(result.events) == 1


@pytest.mark.parametrize(
    ("find", "hint"),
    [
        ({"output": "rocker.angl", "crosses": 1}, "did you mean rocker.angle"),
        ({"output": "crank.efort", "crosses": 1}, "did you mean crank.effort"),
        ({"output": "rocker.angle"}, "one of 'crosses' and 'extreme' is needed"),
        ({"output": "rocker.angle", "extreme": "maximum"}, "did you mean max"),
        ({"output": "rocker.angle", "crosses": "q"}, "unknown parameter 'q'"),
        ({"output": "rocker.angle", "crosses": 1, "direction": "u"}, "did you mean up"),
        ({"output": "crank.effort", "crosses": 1}, "tasks of kind reactions and motion"),
    ],
)
def test_bad_searches(find, hint: str) -> None:
    with pytest.raises(md.InputError, match=hint):
        sweep("four-bar-crank-rocker", find)
    with pytest.raises(md.InputError, match="does not move over an interval"):
        sweep("four-bar-crank-rocker", {"output": "rocker.angle", "crosses": 1}, from_=None,
              to=None, at=[0.0])  # fmt: skip


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("rocker.power", "rocker.angle is not driven here"),
        ("crank.effort", "tasks of kind reactions and motion that drive crank.angle give"),
        ("A.reaction.x", "tasks of kind reactions and motion give"),
        ("A.loss", "tasks of kind reactions give"),
    ],
)
def test_outputs_say_which_tasks_give_them(output: str, message: str) -> None:
    problem = md.load("four-bar-motor")
    mechanism = replace(problem.mechanism, outputs={"F": output})
    task = md.Reactions(driver=md.Driver(**CRANK), outputs=("F",))
    if "driven" not in message:
        assert not md.solve(mechanism, task).fault
        task = md.Sweep(driver=md.Driver(**CRANK), outputs=("F",))
    with pytest.raises(md.InputError, match=message):
        md.solve(mechanism, task)


def test_motions_give_efforts_and_powers_of_their_laws() -> None:
    problem = md.load("four-bar-motor")
    outputs = {"P": "crank.power", "R": "hypot(A.reaction.x, A.reaction.y)"}
    mechanism = replace(problem.mechanism, outputs=outputs)
    law = md.Driver("crank.angle", law="10*t")
    motion = md.solve(mechanism, md.Motion(drivers=[law], until=0.2, at=[0, 0.1, 0.2]))
    at = md.Driver("crank.angle", at=[0, 1, 2], speed=10)
    forces = md.solve(mechanism, md.Reactions(driver=at))
    for name in outputs:
        expected = forces.outputs[name].value
        np.testing.assert_allclose(motion.outputs[name].value, expected, rtol=1e-8)
    np.testing.assert_allclose(forces.outputs["P"].value, 10 * forces.efforts["crank.angle"])
