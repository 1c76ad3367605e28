"""Diagrams of what is held and of cylinders; one letter for one pin; the time of a motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.draw import style
from mechdae.draw.diagram.places import letters_of, places_of
from mechdae.draw.diagram.scene import read_scene

HELD = """
schema = 1
[ground]
points = { A = [0, 0], D = [0.3, 0] }
[bodies.one]
points = { A = [0, 0], B = [0.1, 0] }
[bodies.two]
points = { D = [0, 0], E = [0.1, 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "one.A"] }
D = { kind = "revolute", between = ["ground.D", "two.D"] }
[sketch]
one_deg = 30
two_deg = 30
[tasks.t]
kind = "sweep"
drivers = [
  { coordinate = "one.angle", from_deg = 30, to_deg = 90 },
  { coordinate = "two.angle", at_deg = [30] },
]
[tasks.both]
kind = "sweep"
drivers = [
  { coordinate = "one.angle", from_deg = 30, to_deg = 90 },
  { coordinate = "two.angle", from_deg = 0, to_deg = 90 },
]
[tasks.pose]
kind = "sweep"
drivers = [
  { coordinate = "one.angle", at_deg = [30] },
  { coordinate = "two.angle", at_deg = [30] },
]
"""
ARM = """
schema = 1
[ground]
points = { O = [0, 0] }
[bodies.base]
points = { O = [0, 0] }
[bodies.arm]
points = { O = [0, 0], A = [0.3, 0] }
[bodies.fore]
points = { A = [0, 0], T = [0.25, 0] }
[joints]
rail = { kind = "prismatic", between = ["ground.O", "base.O"] }
S = { kind = "revolute", between = ["base.O", "arm.O"] }
E = { kind = "revolute", between = ["arm.A", "fore.A"] }
[sketch]
rail = 0.1
arm_deg = 60
fore_deg = -10
[tasks.t]
kind = "sweep"
drivers = [
  { coordinate = "rail.slide", at = [0.1] },
  { coordinate = "arm.angle", from_deg = 30, to_deg = 90 },
  { coordinate = "E.angle", at_deg = [-70] },
]
"""
DIGGER = """
schema = 1
[ground]
points = { Q = [0, 0], K = [0.3, 1.6] }
[bodies.bucket]
points = { Q = [0, 0], P = [0.5, 0.3] }
[bodies.barrel]
points = { K = [0, 0] }
[bodies.rod]
points = { P = [0, 0] }
[joints]
Q = { kind = "revolute", between = ["ground.Q", "bucket.Q"] }
P = { kind = "revolute", between = ["bucket.P", "rod.P"] }
K = { kind = "revolute", between = ["ground.K", "barrel.K"] }
cyl = { kind = "prismatic", between = ["barrel.K", "rod.P"] }
[sketch]
bucket_deg = 0
barrel_deg = -80
cyl = 1.3
[tasks.stroke]
kind = "sweep"
driver = { coordinate = "cyl.slide", from = 1.1, to = 1.6 }
poses = 11
[tasks.turn]
kind = "sweep"
driver = { coordinate = "bucket.angle", from_deg = -20, to_deg = 20 }
poses = 11
[tasks.locked]
kind = "motion"
drivers = [
  { coordinate = "cyl.slide", at = [1.3] },
]
until = 0.1
"""


@pytest.fixture
def load(tmp_path: Path):
    def loaded(text: str) -> md.Problem:
        path = tmp_path / "problem.toml"
        path.write_text(text)
        return md.load(path)

    return loaded


def cross(first, second) -> float:
    return float(first[0] * second[1] - first[1] * second[0])


def gids(ax) -> list[str]:
    return [str(own.get_gid()) for own in ax.get_children() if own.get_gid()]


def artist(ax, gid: str):
    return next(own for own in ax.get_children() if own.get_gid() == gid)


def subtitle(ax) -> str:
    return artist(ax, "subtitle").get_text()


def test_a_held_driver_is_braked(load) -> None:
    problem = load(HELD)
    ax = md.plot(md.solve(problem, "t"))
    assert "driver-one.angle" in gids(ax)
    assert "driver-two.angle" not in gids(ax)
    assert gids(ax).count("held-two.angle") == 2  # two jaws
    assert artist(ax, "body-one-bar").get_color() == style.DRIVEN
    assert artist(ax, "body-two-bar").get_color() == style.INK
    assert "two.angle = 30° (held)" in subtitle(ax)
    for task in ("both", "pose"):
        ax = md.plot(md.solve(problem, task))
        assert not [gid for gid in gids(ax) if gid.startswith("held")]
        assert {"driver-one.angle", "driver-two.angle"} <= set(gids(ax))
        assert "held" not in subtitle(ax)


def test_jaws_grip_the_bar(load) -> None:
    ax = md.plot(md.solve(load(HELD), "t"), pose=0)
    jaws = [own.get_xydata() for own in ax.get_children() if own.get_gid() == "held-two.angle"]
    middle = np.mean([jaw.mean(axis=0) for jaw in jaws], axis=0) - [0.3, 0.0]
    along = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    assert middle @ [-along[1], along[0]] == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < middle @ along <= 0.05 + 1e-12
    for jaw in jaws:
        assert abs(cross(jaw[1] - jaw[0], along)) < 1e-12


def test_held_slides_and_angles_between_links(load) -> None:
    scene = read_scene(md.solve(load(ARM), "t"))
    pose = len(scene.status) // 2
    ax = md.plot(md.solve(load(ARM), "t"), pose=pose)
    found = gids(ax)
    assert found.count("held-rail.slide") == 2  # stops at both sides of the block
    assert found.count("held-E.angle") == 1  # a strut between the links
    assert [gid for gid in found if gid.startswith("driver")] == ["driver-arm.angle"]
    strut = artist(ax, "held-E.angle").get_xydata()
    pin = scene.place("arm.A", pose)
    for end, far in zip(strut[::-1], ("arm.O", "fore.T"), strict=True):
        way, bar = end - pin, scene.place(far, pose) - pin
        assert abs(cross(way, bar)) < 1e-9
        assert way @ bar > 0


def test_a_held_sun_wheel_has_shoes_at_its_rim() -> None:
    result = md.solve("planetary-gear-train", next(iter(md.load("planetary-gear-train").tasks)))
    names = list(result.drivers)
    ax = md.plot(result)
    held = [gid.removeprefix("held-") for gid in gids(ax) if gid.startswith("held-")]
    still = [name for name in names if np.ptp(result.drivers[name].position) == 0]
    assert set(held) == (set(still) if len(still) < len(names) else set())


def test_a_driven_guide_between_two_pins_is_a_cylinder(load) -> None:
    problem = load(DIGGER)
    result = md.solve(problem, "stroke")
    ax = md.plot(result, pose=4)
    assert "joint-cyl-cylinder" in gids(ax)
    assert "joint-cyl-prismatic" not in gids(ax)
    scene = read_scene(result)
    eye, tip = scene.place("barrel.K", 4), scene.place("rod.P", 4)
    rod = artist(ax, "joint-cyl-cylinder-rod").get_xydata()
    assert rod[1] == pytest.approx(tip)
    assert abs(cross(rod[0] - eye, tip - eye)) < 1e-12
    barrel = artist(ax, "joint-cyl-cylinder").get_xy()
    reach = (barrel - eye) @ (tip - eye) / np.hypot(*(tip - eye))
    assert 0 < reach.min() < (rod[0] - eye) @ (tip - eye) / np.hypot(*(tip - eye)) < reach.max()
    assert reach.max() < 1.1  # shorter than the shortest travel
    # driven elsewhere it is a guide with its block
    ax = md.plot(md.solve(problem, "turn"))
    assert "joint-cyl-prismatic" in gids(ax)
    assert "joint-cyl-cylinder" not in gids(ax)


def test_a_slotted_lever_is_no_cylinder() -> None:
    for name, task in (("gorshkov-seven-link", "pose"), ("slider-crank", "turn")):
        assert not read_scene(md.solve(name, task)).cylinders


def test_a_motion_shows_its_time_and_what_it_holds(load) -> None:
    result = md.solve(
        load(DIGGER.replace("points = { Q = [0, 0], P", "mass = 5\npoints = { Q = [0, 0], P")),
        "locked",
    )
    ax = md.plot(result, pose=-1)
    assert subtitle(ax).startswith("t = 0.1 s")
    assert "(held)" in subtitle(ax)
    assert "held-cyl.slide" in gids(ax)
    assert "t = 0,1 с" in subtitle(md.plot(result, pose=-1, lang="ru"))
    law = md.solve("pendulum", poses=4)
    assert subtitle(md.plot(law, pose=1)).startswith(f"t = {law.time[1]:.5g} s")


def test_no_letter_stands_for_two_pins() -> None:
    """Pins of one name have the names of their joints, else the numbers of their links."""
    bodies = [
        md.Body("crank", {"O": [0, 0], "A": [0.05, 0]}),
        md.Body("front", {"A": [0, 0], "B": [0.19, 0], "T": [0.1, 0.02]}),
        md.Body("rear", {"A": [0, 0], "B": [0.19, 0], "T": [0.1, 0.02]}),
        md.Body("left", {"B": [0, 0]}),
        md.Body("right", {"B": [0, 0]}),
    ]
    joints = [
        md.Revolute("O", "ground.O", "crank.O"),
        md.Revolute("A1", "crank.A", "front.A"),
        md.Revolute("A2", "crank.A", "rear.A"),
        md.Revolute("BF", "front.B", "left.B"),
        md.Revolute("BR", "rear.B", "right.B"),
        md.Prismatic("gf", "ground.O", "left.B", axis=1.2),
        md.Prismatic("gr", "ground.O", "right.B", axis=2.0),
    ]
    mechanism = md.Mechanism(
        md.Ground({"O": [0, 0]}), bodies, joints, sketch={"crank": 1.0, "front": 1.2, "rear": 1.9}
    )
    scene = read_scene(md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=[1.0]))))
    letters = letters_of(scene, 0, places_of(scene, 0))
    assert letters["front.B"] == letters["left.B"] == "BF"
    assert letters["rear.B"] == "BR"
    assert (letters["front.T"], letters["rear.T"]) == ("T_2", "T_3")
    assert letters["crank.A"] == letters["front.A"] == "A"
    by_name: dict[str, list] = {}
    for reference, name in letters.items():
        by_name.setdefault(name, []).append(scene.place(reference, 0))
    for places in by_name.values():
        assert np.ptp(places, axis=0).max() < 1e-9


@pytest.mark.parametrize("name", ["jansen-leg", "watt-six-bar", "four-stroke-engine", "n-four-bar"])
def test_letters_of_predefined_problems_are_unique(name: str) -> None:
    problem = md.load(name)
    task = next(iter(problem.tasks))
    poses = None if problem.tasks[task].kind == "modes" else 3
    scene = read_scene(md.solve(problem, task, poses=poses))
    places = places_of(scene, 0)
    firsts = [letters_of(scene, 0, places)[place.references[0]] for place in places]
    assert len(set(firsts)) == len(firsts)
