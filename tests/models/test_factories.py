"""Mechanisms by their lengths, against closed forms; the templates they are made of."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from tests.shared.command import run

SEARCHES = {"wiper", "path-synthesis"}
"""Templates with a task of synthesis, which takes long."""
STEPHENSON = (102, 30, 83, 80, 92, -48, 134, -94)


def test_a_four_bar_in_three_lines() -> None:
    result = md.solve(md.four_bar(ground=100, crank=40, coupler=120, rocker=80, units="mm,deg"))
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    assert len(result) == 361
    assert set(result.status) == {"ok"}
    reached = [
        math.acos((c**2 + d**2 - ac**2) / (2 * c * d)) for ac in (b + a, b - a)
    ]  # crank and coupler in one line
    assert result.summary["swing"]["rocker"] == pytest.approx(reached[0] - reached[1], rel=1e-12)
    assert dict(result.mechanism.parameters)["crank"] == 0.04


@pytest.mark.parametrize("seed", range(6))
def test_four_bars_go_as_far_as_they_assemble(seed: int) -> None:
    random = np.random.default_rng(seed)
    d, a, b, c = (random.uniform(20, 100, 4)).round(1).tolist()
    if max(a, b, c, d) > 0.95 * (a + b + c + d - max(a, b, c, d)):
        d = (a + b + c) / 2
    result = md.solve(md.four_bar(d, a, b, c, units="mm"))
    assert not result.fault
    cosines = [(a**2 + d**2 - reach**2) / (2 * a * d) for reach in (abs(b - c), b + c)]
    ends = sorted(np.arccos(np.clip(cosines, -1, 1)))
    turned = result.summary["swing"]["crank"]
    arc = ends[1] - ends[0]
    if ends == [0.0, math.pi]:
        assert turned == pytest.approx(2 * math.pi, rel=1e-12)
    elif ends[0] == 0.0 or ends[1] == math.pi:  # one arc through 0 or pi
        assert turned == pytest.approx(2 * arc, rel=1e-9)
    else:
        assert turned == pytest.approx(arc, rel=1e-9)


def bounds(call) -> dict[str, tuple[str, float]]:
    with pytest.raises(md.InputError, match="assemble at no value") as refused:
        call()
    limits = re.findall(r"(\w+) (at least|at most) ([0-9.e+-]+) mm", refused.value.hint)
    return {name: (word, float(value)) for name, word, value in limits}


def test_the_bound_of_impossible_four_bars_is_named() -> None:
    assert bounds(lambda: md.four_bar(300, 40, 120, 80, units="mm")) == {
        "ground": ("at most", 240), "crank": ("at least", 100),
        "coupler": ("at least", 180), "rocker": ("at least", 140),
    }  # fmt: skip


def test_the_bound_of_an_impossible_slider_crank_is_named() -> None:
    assert bounds(lambda: md.slider_crank(40, 12, 80, units="mm"))["rod"] == ("at least", 40)


@pytest.mark.slow
def test_the_bound_of_impossible_second_loops_is_named() -> None:
    assert bounds(lambda: md.four_bar(100, 40, 320, 80, units="mm"))["coupler"] == ("at most", 220)
    robot = bounds(lambda: md.five_bar(2000, 200, 300, 300, 200, units="mm"))
    assert robot["ground"] == ("at most", 1000)
    d, a, b, c, ex, ey, gx, gy = STEPHENSON
    phi = np.linspace(0, 2 * np.pi, 2_000_001)
    bx, by = a * np.cos(phi), a * np.sin(phi)
    apart = np.hypot(d - bx, -by)
    bent = np.arccos((apart**2 + b**2 - c**2) / (2 * apart * b))
    least = math.inf
    for mode in (1, -1):
        coupler = np.arctan2(-by, d - bx) + mode * bent
        x = bx + ex * np.cos(coupler) - ey * np.sin(coupler)
        y = by + ex * np.sin(coupler) + ey * np.cos(coupler)
        least = min(least, np.hypot(x - gx, y - gy).min())
    limits = bounds(lambda: md.stephenson(*STEPHENSON, 8, 8, units="mm"))
    assert limits["link"] == ("at least", pytest.approx(least - 8, rel=1e-5))


@pytest.mark.parametrize(
    ("factory", "sizes"),
    [
        (md.slider_crank, (40, 120, 50)),
        (md.slider_crank, (40, 12)),
        (md.inverted_slider_crank, (40, 12)),
        (md.five_bar, (200, 150, 300, 250, 200)),
        (md.watt, (100, 30, 90, 80, 50, 80, 120, -30, 40, 90)),
        (md.stephenson, (*STEPHENSON, 86, 89)),
        (md.rssr, (200, 50, 250, 150)),
        (md.cylinder, (400, 0, 300, 280, 480)),
    ],
)
def test_every_factory_gives_its_task(factory, sizes) -> None:
    problem = factory(*sizes, units="mm")
    given = list(problem.mechanism.parameters.values())
    assert all(value in [v * 1000 for v in given if isinstance(v, float)] for value in sizes)
    result = md.solve(problem)
    assert not result.fault
    assert set(result.status) <= {"ok", "limit"}
    assert not result.summary.get("notes")
    assert problem.mechanism.sketch
    assert md.solve(problem, "modes").summary["count"] > 0


def test_a_cylinder_with_a_load_has_forces() -> None:
    problem = md.cylinder(400, 0, 300, 280, 480, units="mm,kN", bore=50, F=2)
    result = md.solve(problem)
    slide = result.drivers["cyl.slide"].position
    lever = np.arccos((0.4**2 + 0.3**2 - slide**2) / (2 * 0.4 * 0.3))
    arm = 0.4 * 0.3 * np.sin(lever) / slide  # of the cylinder about the lever's pin
    assert result.kind == "reactions"
    np.testing.assert_allclose(np.abs(result.efforts["cyl.slide"]), 2000 * np.cos(lever) / arm)
    with pytest.raises(md.InputError, match="above 100, opened above it and below 700"):
        md.cylinder(400, 0, 300, 280, 900)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"px_cm": 3}, "lengths and their rates in two units in one call: px_cm"),
        ({"units": "mm,cm"}, "mm and cm are both units of lengths"),
        ({"crank": -4}, "crank: a length above 0 is needed, not -4"),
        ({"crank": "4"}, "crank: a number is needed, not '4'"),
        ({"crank": math.nan}, "crank: a number is needed"),
        ({"omga": 3}, "did you mean omega"),
    ],
)
def test_bad_calls(change, message: str) -> None:
    call = {"ground": 10, "crank": 4, "coupler": 12, "rocker": 8, "units": "mm"} | change
    with pytest.raises(md.InputError, match=re.escape(message)):
        md.four_bar(**call)


def test_speeds_may_have_another_unit() -> None:
    problem = md.four_bar(10, 4, 12, 8, units="mm,deg", omega_rpm=60)
    assert problem.mechanism.parameters["omega"] == pytest.approx(2 * math.pi)


@pytest.mark.parametrize("name", sorted({*library.families()} - SEARCHES))
def test_templates_solve(name: str, tmp_path) -> None:
    path = tmp_path / f"{name}.toml"
    path.write_text(md.new(name), encoding="utf-8")
    problem = md.load(path)
    for task in problem.tasks:
        result = md.solve(problem, task, poses=9) if task == "turn" else md.solve(problem, task)
        assert not result.fault
        assert not result.summary.get("notes"), "its sketch is near"


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SEARCHES))
def test_templates_of_synthesis_find_designs(name: str, tmp_path) -> None:
    path = tmp_path / f"{name}.toml"
    path.write_text(md.new(name), encoding="utf-8")
    assert md.solve(path, "design").to_dict()["designs"]


def test_new_gives_every_predefined_problem_as_it_is(capsys) -> None:
    for path in library.paths():
        if path.stem not in library.families():
            assert md.new(path.stem) == path.read_text(encoding="utf-8")
    code, out, _ = run(capsys, "new", "oscillating-cylinder")
    line, _, rest = out.partition("\n")
    assert (code, rest) == (0, md.new("oscillating-cylinder"))
    assert line == "#:schema mechdae.schema.json"  # for editors
    code, _, err = run(capsys, "new", "oscilating-cylinder")
    assert code == 2
    assert "did you mean oscillating-cylinder" in err


def test_tables_show_no_noise_no_column_twice_and_lengths_in_the_units_given() -> None:
    rssr = md.rssr(ground=200, crank=50, coupler=220, rocker=120, units="mm,deg")
    lines = str(md.solve(rssr, "turn")).splitlines()
    turning = [
        line.split()[3] for line in lines if line.split()[:2] in (["ok", "0"], ["ok", "180"])
    ]
    assert turning == ["0", "0"]  # the rocker's speed where it turns back, of 4 rad/s
    cylinder = md.cylinder(-100, -200, 150, closed=150, opened=250, units="mm,deg")
    assert str(md.solve(cylinder, "stroke")).count("cyl.slide [mm]") == 1
    modes = str(md.solve(cylinder, "modes"))
    assert "labels of I(1,2,3)" in modes
    assert "cyl_mm = 200" in modes
