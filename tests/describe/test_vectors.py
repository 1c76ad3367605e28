"""Closed vector loops: what they expand into, what is refused."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.tasks.show import structure

TOP = 'schema = 1\ntitle = "t"\nsource = "s"\n'
CRANK = """
[parameters]
r = 0.05
l = 0.2
[vectors]
crank = { length = "r" }
rod = { length = "l" }
guide = { angle = 0 }
[loops]
closure = ["crank", "rod", "-guide"]
[sketch]
crank_deg = 60
rod_deg = -10
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed = 2 }
poses = 13
"""


def problem(text: str) -> md.Problem:
    return from_dict(tomllib.loads(TOP + text))


def message(text: str) -> str:
    with pytest.raises(md.InputError) as caught:
        problem(text)
    return str(caught.value)


def test_slider_crank_of_three_vectors() -> None:
    result = md.solve(problem(CRANK))
    u = result.drivers["crank.angle"].position
    x = 0.05 * np.cos(u) + np.sqrt(0.2**2 - (0.05 * np.sin(u)) ** 2)
    assert np.allclose(result.joints["guide_slide"].slide, x, rtol=1e-14, atol=0)


def test_the_same_from_python() -> None:
    mechanism = md.from_loops(
        [md.Vector("crank", "r"), md.Vector("rod", "l"), md.Vector("guide", angle=0.0)],
        {"closure": ["crank", "rod", "-guide"]},
        parameters={"r": 0.05, "l": 0.2},
        sketch={"crank": math.radians(60), "rod": math.radians(-10)},
    )
    assert mechanism == problem(CRANK).mechanism


def test_what_links_and_joints_are_called() -> None:
    mechanism = md.load("seven-link-loops").mechanism
    assert list(mechanism.bodies) == [
        "crank", "rod", "slot_block", "conrod", "guide_block", "coupler", "rocker",
    ]  # fmt: skip
    assert mechanism.bodies["rod"].points == md.Body("b", {"tail": (0, 0), "B": ("GB", 0)}).points
    assert mechanism.ground.points["base_head"] == (0.0, "OG")
    pins = {n: j.bodies for n, j in mechanism.joints.items() if j.hinge}
    assert pins["A"] == ("crank", "slot_block")
    assert pins["B_conrod"] == ("rod", "conrod")
    assert pins["B_coupler"] == ("rod", "coupler")
    assert pins["base_head"] == ("ground", "crank")


def test_modules_beside_the_groups() -> None:
    groups = structure(md.load("seven-link-loops"))["groups"]
    found = [(g["kind"], g["module"]["name"], g["module"]["loops"]) for g in groups[1:]]
    assert found == [
        ("RPR", "la", ["rod_loop"]),
        ("RRP", "l-a", ["slider_loop"]),
        ("RRR", "a-a", ["rocker_loop"]),
    ]
    assert "module" not in groups[0]


def test_length_of_a_vector_is_driven_and_asked_for() -> None:
    """Oscillating cylinder: cosine law for the angle between rocker and frame."""
    found = problem("""
[parameters]
a = 0.3
b = 0.2
[vectors]
frame = { length = "a", angle = 0 }
rocker = { length = "b" }
cylinder = {}
[loops]
one = ["cylinder", "-rocker", "-frame"]
[outputs]
stretch = "cylinder.length - 0.1"
rate = "cylinder.length.speed"
[sketch]
rocker_deg = 90
cylinder_deg = 30
"cylinder.length" = 0.3
[tasks.push]
kind = "sweep"
driver = { coordinate = "cylinder.length", from = 0.25, to = 0.45, speed = 0.5 }
poses = 9
""")
    result = md.solve(found)
    d = result.drivers["cylinder.length"].position
    between = np.arccos((0.3**2 + 0.2**2 - d**2) / (2 * 0.3 * 0.2))
    assert np.allclose(result.bodies["rocker"].angle, math.pi - between, rtol=1e-13)
    assert np.allclose(result.outputs["stretch"].value, d - 0.1, rtol=1e-14)
    assert np.allclose(result.outputs["rate"].value, 0.5, rtol=1e-14)
    (group,) = structure(found)["groups"]
    assert group["module"]["unknown"] == {"rocker": ["angle"], "cylinder": ["angle"]}


@pytest.mark.parametrize("pair", ["block", "pin-in-slot"])
def test_pin_in_the_slot_itself(pair: str) -> None:
    found = problem(f"""
[vectors]
frame = {{ length = 0.2, angle_deg = 90 }}
crank = {{ length = 0.08 }}
rod = {{ pair = "{pair}" }}
[loops]
closure = ["frame", "crank", "-rod"]
[sketch]
crank_deg = 30
rod_deg = 75
[tasks.turn]
kind = "sweep"
driver = {{ coordinate = "crank.angle", at = [0.5], speed = 2 }}
""")
    assert len(found.mechanism.bodies) == (3 if pair == "block" else 2)
    result = md.solve(found)
    x, y = 0.08 * math.cos(0.5), 0.2 + 0.08 * math.sin(0.5)
    assert result.bodies["rod"].angle[0] == pytest.approx(math.atan2(y, x), rel=1e-14)
    assert result.joints["rod_slide"].slide[0] == pytest.approx(math.hypot(x, y), rel=1e-14)
    groups = structure(found)["groups"]
    assert groups[-1]["module"]["name"] == "la"


def test_two_unknown_lengths() -> None:
    """Tangent mechanism: a slotted lever moves a crosshead at a distance."""
    result = md.solve(
        problem("""
[vectors]
distance = { length = 0.1, angle = 0 }
lever = {}
head = { angle_deg = 90 }
[loops]
closure = ["lever", "-head", "-distance"]
[sketch]
lever_deg = 40
[tasks.turn]
kind = "sweep"
driver = { coordinate = "lever.angle", from_deg = 10, to_deg = 60, speed = 1 }
poses = 6
""")
    )
    u = result.drivers["lever.angle"].position
    assert np.allclose(result.joints["head_slide"].slide, 0.1 * np.tan(u), rtol=1e-13)
    assert np.allclose(result.joints["lever_slide"].slide, 0.1 / np.cos(u), rtol=1e-13)


def test_slides_on_slides_and_links_with_bends() -> None:
    """A point on a bent link is carried by a slide on a slide: its Cartesian places."""
    found = problem("""
[parameters]
bend_deg = 30
[vectors]
u = { angle = 0 }
v = { angle_deg = 90 }
crank = { length = 0.1 }
arm = { length = 0.07, along = "crank", offset = "bend" }
[loops]
closure = ["u", "v", "-arm", "-crank"]
[sketch]
arm_deg = 50
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = 10, to_deg = 60, speed = 1 }
poses = 6
""")
    assert found.mechanism.sketch["crank"] == "0.8726646259971648 - bend"
    result = md.solve(found)
    u = result.drivers["crank.angle"].position
    x = 0.1 * np.cos(u) + 0.07 * np.cos(u + math.pi / 6)
    y = 0.1 * np.sin(u) + 0.07 * np.sin(u + math.pi / 6)
    assert np.allclose(result.joints["u_slide"].slide, x, rtol=1e-13)
    assert np.allclose(result.joints["v_slide"].slide, y, rtol=1e-13)


BODIES = """
[ground]
points = { A = [0, 0], D = [0.2, 0] }
[bodies.crank]
points = { A = [0, 0], B = [0.06, 0] }
mass = 1
center = [0.03, 0]
inertia = 0.001
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
[vectors]
frame = { from = "ground.A", to = "ground.D" }
crank_line = { from = "crank.A", to = "crank.B" }
coupler = { length = 0.18 }
rocker = { length = 0.12 }
[loops]
closure = ["crank_line", "coupler", "-rocker", "-frame"]
[nodes]
C = { at = "coupler.head" }
[bodies.coupler]
mass = 2
center = [0.09, 0.01]
inertia = 0.002
points = { P = [0.05, 0.04] }
[sketch]
crank_deg = 60
coupler_deg = 10
rocker_deg = 80
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", at_deg = [60], speed = 1 }
"""


def test_vectors_of_bodies_that_stand_in_the_file() -> None:
    found = problem(BODIES)
    joints = found.mechanism.joints
    assert {n: (j.first, j.second) for n, j in joints.items()} == {
        "A": ("ground.A", "crank.A"),
        "crank_line_head": ("crank.B", "coupler.tail"),
        "C": ("coupler.C", "rocker.C"),
        "frame_head": ("ground.D", "rocker.tail"),
    }
    assert found.mechanism.bodies["coupler"].mass == 2
    result = md.solve(found)
    b = np.array([0.06 * math.cos(math.pi / 3), 0.06 * math.sin(math.pi / 3)])
    c = result.points["rocker.C"].position[0]
    assert np.hypot(*(c - b)) == pytest.approx(0.18, rel=1e-14)
    assert np.hypot(*(c - [0.2, 0])) == pytest.approx(0.12, rel=1e-14)


@pytest.mark.parametrize("name", ["seven-link-loops", "quick-return-loops", "slider-crank-loops"])
def test_written_and_read_again(name: str, tmp_path: Path) -> None:
    found = md.load(name)
    md.dump(found, tmp_path / f"{name}.toml")
    assert "[vectors]" in (tmp_path / f"{name}.toml").read_text()
    assert md.load(tmp_path / f"{name}.toml") == found


def test_written_as_bodies_after_one_number_of_a_link_was_set(tmp_path: Path) -> None:
    found = md.load("slider-crank-loops").with_values({"crank.B.x": 0.11})
    md.dump(found, tmp_path / "p.toml")
    again = md.load(tmp_path / "p.toml")
    assert "[vectors]" not in (tmp_path / "p.toml").read_text()
    assert again.mechanism.loads["work"].coordinate == "slide_slide.slide"
    same = [md.solve(p, "modes").points["rod.C"].position for p in (found, again)]
    assert np.array_equal(*same)


def test_lengths_are_parameters() -> None:
    found = problem(CRANK)
    result = md.solve(found, set={"l": 0.3})
    assert result.joints["guide_slide"].slide[0] == pytest.approx(0.35, rel=1e-15)


def test_loops_repeat() -> None:
    """Two slider-cranks on one crank, by copies of a loop."""
    found = problem("""
[sizes]
N = 2
[parameters]
r = 0.05
[vectors]
crank = { length = "r" }
[repeat.cylinder]
count = "N"
[repeat.cylinder.vectors]
"rod{k}" = { length = "0.2 + 0.01*{k}" }
"bore{k}" = { angle_deg = "90*{k}" }
[repeat.cylinder.loops]
"loop{k}" = ["crank", "rod{k}", "-bore{k}"]
[sketch]
crank_deg = 60
rod1_deg = 100
rod2_deg = 190
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", at_deg = [60], speed = 1 }
""")
    result = md.solve(found)
    s, c = 0.05 * math.sin(math.pi / 3), 0.05 * math.cos(math.pi / 3)
    assert result.joints["bore1_slide"].slide[0] == pytest.approx(s + math.sqrt(0.21**2 - c**2))
    assert result.joints["bore2_slide"].slide[0] == pytest.approx(-c + math.sqrt(0.22**2 - s**2))


def changed(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


VECTOR, LOOP = "guide = { angle = 0 }", 'closure = ["crank", "rod", "-guide"]'
BAD: dict[str, tuple[str, str, str]] = {
    "unknown vector": ('"-guide"', '"-guid"', "loops.closure[2]: unknown vector 'guid'"),
    "twice in a loop": ('"-guide"]', '"-guide", "rod"]', "'rod' is in the loop twice"),
    "in no loop": (VECTOR, f"{VECTOR}\nspare = {{}}", "vectors.spare: the vector is in no loop"),
    "one vector": (LOOP, f'{LOOP}\nalone = ["crank"]', "loops.alone: a loop of two vectors"),
    "no list": (LOOP, 'closure = "crank"', "loops.closure: a list of vectors is needed"),
    "two directions": (
        VECTOR, 'guide = { angle = 0, along = "rod" }', "vectors.guide: 'angle' and 'along'"),
    "both units": (VECTOR, "guide = { angle = 0, angle_deg = 0 }", "'angle' is given twice"),
    "angle twice": (VECTOR, "guide = { angle = 0, offset = 1 }", "'offset' is the angle from"),
    "name twice": (LOOP, f"{LOOP}\n[joints]\nguide = {{ kind = 'weld', between = ['a.b', 'c.d'] }}",
                   "vectors.guide: a joint is called 'guide' too"),
    "along itself": (VECTOR, 'guide = { along = "guide" }', "vectors run along each other"),
    "nothing fixed": (VECTOR, "guide = {}", "vectors: no vector is fixed"),
    "friction of what does not slide": (
        'length = "l"', 'length = "l", friction = 0.1',
        "vectors.rod.friction: a vector that does not slide has no 'friction'"),
    "key of space": (VECTOR, "guide = { elevation = 0 }", "elevation"),
    "segment and length": (
        VECTOR, 'guide = { from = "ground.A", to = "ground.B", angle = 0 }', "contradicts 'from'"),
    "half a segment": (VECTOR, 'guide = { from = "ground.A" }', "the key 'to' is missing"),
    "segment of two bodies": (
        VECTOR, 'guide = { from = "ground.A", to = "x.B" }', "points of one body"),
    "sketch of what is given": (
        "rod_deg = -10", "rod_deg = -10\nguide_deg = 3", "sketch.guide: 'guide' does not turn"),
    "node nowhere": (LOOP, f'{LOOP}\n[nodes]\nC = {{ at = "rad.head" }}', "nodes.C.at: unknown"),
    "node at no end": (LOOP, f'{LOOP}\n[nodes]\nC = {{ at = "rod.had" }}', "unknown end"),
    "node twice": (
        LOOP, f'{LOOP}\n[nodes]\nC = {{ at = "rod.head" }}\nE = {{ at = "guide.head" }}',
        "nodes.E.at: 'C' is the same place"),
    "no loops": (f"[loops]\n{LOOP}", "", "loops: vectors need [loops]"),
    "loose loop": (
        LOOP, f'{LOOP}\nother = ["a", "b", "c"]\n[vectors.a]\nlength = 1\n[vectors.b]\nlength = 1\n'
        "[vectors.c]\nlength = 1",
        "loops.other: the loop shares no vector and no tail"),
    "head and tail meet": (
        LOOP, f'{LOOP}\nagain = ["crank", "-guide"]', "head and tail of 'rod' meet"),
    "parallel links": (
        VECTOR, 'guide = { length = 0.1, along = "crank" }', "no vector is fixed"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD, ids=str)
def test_what_is_refused(case: str) -> None:
    old, new, expected = BAD[case]
    assert expected in message(changed(CRANK, (old, new)))


def test_given_vectors_that_do_not_close() -> None:
    def frame(c: float) -> md.Mechanism:
        return md.from_loops(
            [
                md.Vector("a", 3.0, 0.0), md.Vector("b", 4.0, math.pi / 2),
                md.Vector("c", c, math.atan2(4, 3)), md.Vector("crank", 1.0),
                md.Vector("rod", 6.0), md.Vector("guide", angle=0.0),
            ],
            {"frame": ["a", "b", "-c"], "closure": ["b", "crank", "rod", "-guide"]},
        )  # fmt: skip

    assert frame(5.0).ground.points["b_head"] == (3.0, 4.0)
    with pytest.raises(md.InputError, match=r"vectors.c: given .* do not close: 'c' ends 0\.08"):
        frame(5.1)


def test_parallelogram_written_with_shared_directions_is_refused() -> None:
    vectors: list[Any] = [
        md.Vector("frame", 0.3, 0.0), md.Vector("crank", 0.1),
        md.Vector("coupler", 0.3), md.Vector("rocker", 0.1, along="crank"),
    ]  # fmt: skip
    with pytest.raises(md.InputError, match=r"vectors.rocker: keeps the direction of 'crank'"):
        md.from_loops(vectors, {"one": ["crank", "coupler", "-rocker", "-frame"]})
