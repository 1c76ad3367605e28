"""DXF drawings: audited by ezdxf, measured by their lines, read back as mechanisms."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.parts.exchange.drawings.dxf_read import read_drawing
from mechdae.parts.exchange.drawings.from_drawing import problem_of_drawing
from mechdae.tasks.motion_of import motion_of
from tests.shared.exports import motion
from tests.shared.paths import DATA
from tests.shared.round_trips import back, faults, lost

SAMPLE = (
    "gorshkov-seven-link",
    "geared-five-bar",
    "quick-return-pin",
    "cam-roller-follower",
    "rack-and-pinion",
    "jansen-leg",
    "belt-drive",
    "car-axis",
)


def drawn(name: str, folder: Path, **options: Any) -> Path:
    return md.export(name, format="dxf", **options).save(folder / f"{name}.dxf")[0]


@pytest.mark.parametrize("name", SAMPLE)
def test_audit_finds_no_error(name: str, tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="the extra exchange is not installed")
    document = ezdxf.readfile(drawn(name, tmp_path))
    auditor = document.audit()
    assert (len(auditor.errors), len(auditor.fixes)) == (0, 0)
    assert document.dxfversion == "AC1009"
    used = {own.dxf.layer for own in document.modelspace()}
    assert used <= {layer.dxf.name for layer in document.layers}
    assert {"LINKS", "JOINTS", "PATHS", "NAMES"} <= used | {"LINKS"}


def test_links_and_paths_are_those_of_the_result(tmp_path: Path) -> None:
    name, pose = "four-bar-crank-rocker", 40
    sketch = read_drawing(drawn(name, tmp_path, pose=pose))
    result = motion(name).result

    def at(reference: str) -> Any:
        return np.asarray(result.points[reference].position[pose])

    links = [line for line in sketch.lines if line.layer == "LINKS"]
    crank = [at("crank.A"), at("crank.B")]
    assert any(np.abs(np.array(line.corners) - crank).max() < 1e-14 for line in links)
    values = md.load(name).mechanism.values()
    lengths = [math.dist(line.corners[0], line.corners[1]) for line in links]
    assert any(own == pytest.approx(values["a"], rel=1e-12) for own in lengths)
    paths = [np.array(line.corners) for line in sketch.lines if line.layer == "PATHS"]
    track = result.points["coupler.P"].position
    assert any(len(p) == len(track) and np.abs(p - track).max() < 1e-14 for p in paths)
    circles = {tuple(np.round(c.center, 12)) for c in sketch.circles if c.layer == "JOINTS"}
    assert tuple(np.round(at("crank.B"), 12)) in circles
    fixed = {tuple(np.round(c.center, 12)) for c in sketch.circles if c.layer == "GROUND"}
    assert tuple(np.round(at("crank.A"), 12)) in fixed


def swings(problem: md.Problem) -> list[float]:
    result = md.solve(problem, "turn")
    assert set(result.status) == {"ok"}
    return sorted(float(np.ptp(own.angle)) for own in result.bodies.values())


@pytest.mark.parametrize(
    "name", ["four-bar-crank-rocker", "jansen-leg", "watt-six-bar", "slider-crank-friction"]
)
def test_a_drawing_is_read_back(name: str, tmp_path: Path) -> None:
    path = drawn(name, tmp_path)
    problem = md.read_drawing(path)
    md.dump(problem, tmp_path / "back.toml")
    again = md.load(tmp_path / "back.toml")
    whole = motion(name)
    task = md.Sweep(driver=md.Driver(next(iter(whole.result.drivers)), range="assembled"))
    known = md.solve(whole.problem.with_task("turn", task), "turn")
    known = sorted(float(np.ptp(own.angle)) for own in known.bodies.values())
    assert swings(again) == pytest.approx(known, abs=1e-8)


# -- sketches by hand ------------------------------------------------------------------------------


def dxf(*entities: str, units: int | None = None) -> str:
    head = f"9\n$INSUNITS\n70\n{units}\n" if units is not None else ""
    body = "".join(entities)
    sections = f"0\nSECTION\n2\nHEADER\n{head}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{body}"
    return f"{sections}0\nENDSEC\n0\nEOF\n"


def line(a: Any, b: Any, layer: str = "0") -> str:
    return f"0\nLINE\n8\n{layer}\n10\n{a[0]}\n20\n{a[1]}\n11\n{b[0]}\n21\n{b[1]}\n"


def circle(c: Any, r: float = 1.0, layer: str = "0") -> str:
    return f"0\nCIRCLE\n8\n{layer}\n10\n{c[0]}\n20\n{c[1]}\n40\n{r}\n"


def polyline(*places: Any, closed: bool = False) -> str:
    rows = "".join(f"10\n{x}\n20\n{y}\n" for x, y in places)
    return f"0\nLWPOLYLINE\n8\n0\n90\n{len(places)}\n70\n{int(closed)}\n{rows}"


A, D, B, C = (0, 0), (80, 0), (10, 25), (60, 55)
BARS = (line(A, B), line(B, C), line(C, D))
PINS = (circle(B), circle(C))
FIXED = (circle(A, layer="Ground"), circle(D, layer="Ground"))


def problem(tmp_path: Path, text: str, **options: Any) -> tuple[md.Problem, list[str]]:
    path = tmp_path / "sketch.dxf"
    path.write_text(text)
    return problem_of_drawing(path, **options)


def lengths(own: md.Problem) -> dict[str, float]:
    found = {}
    for name, body in own.mechanism.bodies.items():
        places = list(body.points.values())
        found[name] = math.dist(places[0], places[1])
    return found


@pytest.mark.parametrize(
    ("units", "option", "unit"),
    [(None, None, 1e-3), (4, None, 1e-3), (1, None, 0.0254), (6, "cm", 0.01), (0, None, 1e-3)],
)
def test_units_of_a_sketch(units: Any, option: Any, unit: float, tmp_path: Path) -> None:
    own, remarks = problem(tmp_path, dxf(*BARS, *PINS, *FIXED, units=units), unit=option)
    expected = [unit * math.dist(*ends) for ends in ((A, B), (B, C), (C, D))]
    assert list(lengths(own).values()) == pytest.approx(expected, rel=1e-9)
    assert remarks == ["driver: link1.angle"]
    assert md.solve(own, "turn").fault is None
    assert md.solve(own, "modes").summary["count"] == 2


def test_ways_to_say_what_is_fixed(tmp_path: Path) -> None:
    plain = (circle(A), circle(D))
    known = lengths(problem(tmp_path, dxf(*BARS, *PINS, *FIXED))[0])
    double = (*plain, circle(A, 3), circle(D, 3))
    assert lengths(problem(tmp_path, dxf(*BARS, *PINS, *double))[0]) == known
    own, _ = problem(tmp_path, dxf(*BARS, *PINS, *plain), ground=(A, D))
    assert lengths(own) == known
    base = line(A, D, "FIXED")
    assert lengths(problem(tmp_path, dxf(*BARS, base, *PINS, *plain))[0]) == known
    with pytest.raises(md.InputError, match="no pin is fixed; there are pins at"):
        problem(tmp_path, dxf(*BARS, *PINS, *plain))
    with pytest.raises(md.InputError, match="no pin at"):
        problem(tmp_path, dxf(*BARS, *PINS, *plain), ground=((40, 40),))


def test_ends_at_the_rim_of_a_pin_and_lines_without_one(tmp_path: Path) -> None:
    """Drawn as by hand: bars end at the circle, a triangle of three lines is one link."""
    P = (30, 60)
    bars = (line(A, (9.6, 24.1)), line((10.9, 25.5), C), line(B, P), line(P, C), line(C, D))
    own, _ = problem(tmp_path, dxf(*bars, *PINS, *FIXED))
    assert len(own.mechanism.bodies) == 3
    ternary = next(b for b in own.mechanism.bodies.values() if len(b.points) == 3)
    places = ternary.points
    sides = sorted(math.dist(a, b) for a in places.values() for b in places.values() if a < b)
    assert sides == pytest.approx(
        sorted(1e-3 * math.dist(a, b) for a, b in ((B, C), (B, P), (P, C))), rel=1e-9
    )


def test_several_links_on_a_pin_a_pin_inside_a_line_and_a_guide(tmp_path: Path) -> None:
    """A crank with two rods to sliders: the pin at B carries three links."""
    text = dxf(
        polyline((0, 0), (0, 20)),
        line((0, 20), (60, 0)),
        line((0, 20), (-60, 0)),
        line((-80, 0), (-20, 0), "GUIDES"),
        line((20, 0), (80, 0), "GUIDES"),
        circle((0, 0), layer="GROUND"),
        circle((0, 20)), circle((60, 0)), circle((-60, 0)),
    )  # fmt: skip
    own, _ = problem(tmp_path, text)
    kinds = sorted(joint.kind for joint in own.mechanism.joints.values())
    assert kinds == ["prismatic"] * 2 + ["revolute"] * 5
    result = md.solve(own, "turn")
    assert result.fault is None
    angle = result.bodies["link1"].angle
    x = 0.02 * np.cos(angle) + np.sqrt(
        math.hypot(0.06, 0.02) ** 2 - (0.02 * np.sin(angle)) ** 2
    )  # closed form of the slider on the right
    rod = next(
        name for name, body in own.mechanism.bodies.items()
        if name.startswith("link") and any(
            abs(result.points[f"{name}.{p}"].position[0, 0] - x[0]) < 1e-9 for p in body.points)
    )  # fmt: skip
    end = next(p for p in own.mechanism.bodies[rod].points if p != "B")
    assert np.abs(result.points[f"{rod}.{end}"].position[:, 0] - x).max() < 1e-11


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (dxf(*PINS, *FIXED), "no lines that could be links"),
        (dxf(*BARS), "no circles that could be pins"),
        (dxf(line(A, D, "GROUND"), *FIXED), "all lines are part of the ground"),
        (dxf(*BARS, *PINS, *FIXED, line((0, 90), (50, 95))), r"the line from \(0, 0.09\)"),
        (dxf(*BARS, "0\nLINE\n8\n0\n10\n1\n"), "an entity without its numbers"),
        (dxf(*BARS, circle(("nan", 1))), "an entity without its numbers"),
        ("schema = 1\ntitle = 2\n", "line 1 is no group code"),
        ("AutoCAD Binary DXF\r\n\x1a", "a binary DXF file"),
        ("", "no section of a DXF file"),
    ],
)
def test_bad_drawings_are_told_in_one_message(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "sketch.dxf"
    path.write_text(text)
    with pytest.raises(md.InputError, match=words) as caught:
        md.read_drawing(path)
    assert "sketch.dxf" in str(caught.value)


def test_what_is_not_read_is_counted(tmp_path: Path) -> None:
    extra = "0\nSPLINE\n8\n0\n" * 2
    _, remarks = problem(tmp_path, dxf(*BARS, *PINS, *FIXED, extra))
    assert "not read: 2 SPLINE" in remarks


def test_a_structure_gets_no_task(tmp_path: Path) -> None:
    own, remarks = problem(tmp_path, dxf(*BARS, line(A, C), *PINS, *FIXED))
    assert not own.tasks
    assert remarks == ["mobility by count 0: tasks with drivers are left to be written"]


# -- what does not come back is said ---------------------------------------------------------------

BACK = (
    *("four-bar-crank-rocker", "jansen-leg", "slider-crank-offset", "peaucellier", "watt-six-bar"),
    *("elliptic-trammel", "double-pendulum", "parallelogram-three-cranks", "toggle-press"),
)
LOST = {
    "quick-return-pin": "1 line on layer JOINTS",
    "geared-five-bar-97-13": "2 second circle around a pin",
    "cam-roller-follower": "2 line on layer JOINTS",
    "c1-exact-max-mu": "weld base",
}


@pytest.mark.parametrize("name", [*BACK, *LOST])
def test_a_problem_comes_back_or_what_is_lost_is_said(name: str, tmp_path: Path) -> None:
    """Bodies, joints, mobility, the pose that was drawn, poses of a sweep: all problems are drawn
    by `python -m tests.scripts.round_trips`."""
    found = back(name, tmp_path)
    assert bool(found.get("lost")) == (name in LOST), found
    if name in LOST:
        assert LOST[name] in found["lost"][-1] + found["lost"][0]
    else:
        assert not faults(found), found
        assert "followed" in found or name == "double-pendulum"


def test_a_mesh_without_circles_is_named(tmp_path: Path) -> None:
    """Wheels on one axis have no radii that their ratio tells: the drawing says what it lacks."""
    base = md.load("geared-five-bar").mechanism
    mesh = replace(base.joints["mesh"], second="crank.A", carrier=None)
    whole = replace(base, joints=Table({**base.joints, "mesh": mesh}))
    task = md.Sweep(driver=md.Driver("wheel.angle", at=[0.0, 0.1]))
    problem = md.Problem(whole, Table({"turn": task}), name="geared")
    found = back("geared", tmp_path, motion_of(problem, "turn"))
    assert found == {"lost": ["gear mesh"]}


def test_a_fixed_slot_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slider-crank whose pin runs in a slot of the ground: its travel is twice the crank."""
    whole = md.load(DATA / "slider-crank-in-a-fixed-slot.toml")
    path = md.export(whole, format="dxf").save(tmp_path / "slot.dxf")[0]
    own, remarks = problem_of_drawing(path)
    (slot,) = (joint for joint in own.mechanism.joints.values() if joint.slot)
    result = md.solve(own, "turn")
    assert result.fault is None
    known = [own for own in whole.mechanism.joints.values() if own.slot]
    task = next(iter(whole.tasks))
    driver = next(iter(md.solve(whole, task).drivers))
    sweep = md.Sweep(driver=md.Driver(driver, range="assembled"), poses=361)
    there = md.solve(whole.with_task("turn", sweep), "turn")
    travel = [float(np.ptp(r.joints[j.name].slide)) for r, j in ((result, slot), (there, known[0]))]
    assert travel[0] == pytest.approx(travel[1], rel=1e-6)
    assert not lost(remarks)

    from mechdae.parts.exchange.drawings import from_drawing

    monkeypatch.setattr(from_drawing._Sketch, "_slot", lambda self, pin: None)
    _, remarks = problem_of_drawing(path)
    assert any("2 guide without a pin" in text for text in remarks)


def test_grounds_as_hatches_and_double_circles_are_no_other_mechanism(tmp_path: Path) -> None:
    """Grounds are hatches on a layer of their own, moving pins two circles: what is not read is
    said, and no moving pin becomes a fixed one."""
    hatch = "0\nHATCH\n8\nGROUND\n10\n0\n20\n0\n"
    double = (*PINS, circle(B, 3), circle(C, 3))
    with pytest.raises(md.InputError, match="no pin is fixed"):
        problem(tmp_path, dxf(*BARS, *double, circle(A), circle(D), hatch, hatch))
    text = dxf(*BARS, *double, circle(A), circle(D), hatch, hatch)
    own, remarks = problem(tmp_path, text, ground=(A, D))
    assert len(own.mechanism.bodies) == 3
    assert "2 HATCH on layer GROUND" in remarks[-1]
    assert "2 second circle around a pin" in remarks[-1]


def test_lines_of_the_ground_and_guides_without_a_pin_are_said(tmp_path: Path) -> None:
    more = (line((0, -10), (80, -10), "GROUND"), line((0, 90), (80, 90), "GUIDES"))
    own, remarks = problem(tmp_path, dxf(*BARS, *PINS, *FIXED, *more))
    assert len(own.mechanism.bodies) == 3
    assert "1 guide without a pin" in remarks[-1]
    assert "1 line of the ground without a pin" in remarks[-1]
