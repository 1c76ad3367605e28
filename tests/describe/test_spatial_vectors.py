"""Closed vector loops in space: what they become, closed forms of their sweeps, what is refused."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.tasks.show import structure

TEXT = """
schema = 1
title = "t"
source = "s"
dimension = 3
[vectors]
crank  = { length = 0.05, elevation = 0 }
rod    = { length = 0.3 }
offset = { length = 0.06, elevation_deg = 63, azimuth_deg = -29 }
slide  = { elevation_deg = 14.3, azimuth_deg = 23 }
[loops]
closure = ["crank", "rod", "-slide", "-offset"]
[sketch]
"crank.azimuth_deg" = 0
"slide.length" = 0.3
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.azimuth", from_deg = 0, to_deg = 360, speed = 3 }
poses = 25
"""


def problem(text: str = TEXT) -> md.Problem:
    return from_dict(tomllib.loads(text))


def direction(elevation: float, azimuth: float) -> np.ndarray:
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), math.sin(elevation), level * math.sin(azimuth)])


def test_a_spatial_slider_crank_against_sphere_and_line() -> None:
    result = md.solve(problem())
    offset = 0.06 * direction(math.radians(63), math.radians(-29))
    way = direction(math.radians(14.3), math.radians(23))
    u = result.drivers["crank.azimuth"].position
    w = 0.05 * np.stack([np.cos(u), 0 * u, np.sin(u)], axis=1) - offset
    along = w @ way
    slide = along + np.sqrt(along**2 - (w**2).sum(axis=1) + 0.3**2)
    assert np.allclose(result.joints["slide"].length, slide, rtol=1e-14)
    rod = offset + slide[:, None] * way - (w + offset)
    assert np.allclose(result.joints["rod"].elevation, np.arcsin(rod[:, 1] / 0.3), atol=1e-13)
    gap = result.joints["rod"].azimuth - np.arctan2(rod[:, 2], rod[:, 0])
    assert np.allclose(np.exp(1j * gap), 1, atol=1e-13)
    assert np.allclose(result.points["rod_head.rod_head"].position, offset + slide[:, None] * way)
    assert list(result.summary["stroke"]) == ["slide"]
    assert result.summary["bound"] == "proved"


def test_rates_are_derivatives() -> None:
    result = md.solve(problem())
    u, h = 1.0, 1e-4
    text = TEXT.replace("from_deg = 0, to_deg = 360", f"at = [{u - h}, {u}, {u + h}]")
    result = md.solve(problem(text.replace("poses = 25\n", "")))
    one = result.joints["slide"]
    assert one.length_velocity[1] == pytest.approx((one.length[2] - one.length[0]) / (2 * h) * 3)
    second = (one.length[2] - 2 * one.length[1] + one.length[0]) / h**2
    assert one.length_acceleration[1] == pytest.approx(9 * second, rel=1e-5)


def test_two_loops_are_solved_one_after_the_other() -> None:
    """A second loop hangs on the head of the first: its module is named, and the order."""
    text = TEXT.replace(
        "[loops]",
        "arm = { length = 0.2, azimuth_deg = 40 }\nlink = { length = 0.25, elevation_deg = -20 }\n"
        "up = { elevation_deg = 90, azimuth = 0 }\n"
        '[loops]\nsecond = ["slide", "arm", "-link", "-up"]',
    )
    found = structure(problem(text))
    modules = [group["module"] for group in found["groups"] if "module" in group]
    assert [(m["name"], m["loops"]) for m in modules] == [
        ("ab-l", ["closure"]),
        ("l-a-b", ["second"]),
    ]


def test_modules_are_solved_in_closed_form_and_proven() -> None:
    """Counts of the table of the modules; the eight of three elevations are all real."""
    found = md.load("vector-modules-spatial")
    for task, count in (("la_b", 2), ("lb_a", 4), ("l_a_b", 4), ("a_a_a", 8), ("a_b_b", 4)):
        result = md.solve(found, task)
        assert result.summary["proven"]
        assert result.summary["count"] == count
        assert "search" not in result.summary


def test_the_sense_of_a_loop_does_not_matter() -> None:
    """The same loop with every vector run backwards has the same modes."""
    text = TEXT.replace("[tasks.turn]", "[tasks.modes]").replace('"sweep"', '"modes"')
    text = text.replace("from_deg = 0, to_deg = 360, speed = 3", "at_deg = [40]")
    text = text.replace("poses = 25\n", "")
    other = text.replace(
        '["crank", "rod", "-slide", "-offset"]', '["offset", "slide", "-rod", "-crank"]'
    )
    one, two = md.solve(problem(text)), md.solve(problem(other))
    assert one.summary["proven"]
    assert two.summary["proven"]
    assert np.allclose(np.sort(one.joints["slide"].length), np.sort(two.joints["slide"].length))


def test_the_same_from_python_and_written_again(tmp_path: Path) -> None:
    degrees = math.radians
    mechanism = md.from_loops(
        [
            md.Vector("crank", 0.05, elevation=0.0),
            md.Vector("rod", 0.3),
            md.Vector("offset", 0.06, elevation=degrees(63), azimuth=degrees(-29)),
            md.Vector("slide", elevation=degrees(14.3), azimuth=degrees(23)),
        ],
        {"closure": ["crank", "rod", "-slide", "-offset"]},
        sketch={"crank.azimuth": 0.0, "slide.length": 0.3},
        dimension=3,
    )
    found = problem()
    assert mechanism == found.mechanism
    md.dump(found, tmp_path / "mechanism.toml")
    assert md.load(tmp_path / "mechanism.toml") == found
    assert "[vectors]" in (tmp_path / "mechanism.toml").read_text()


@pytest.mark.parametrize("name", ["vector-modules-spatial"])
def test_every_usable_module_is_named(name: str) -> None:
    found = md.load(name)
    groups = structure(found)["groups"]
    names = {module["name"] for g in groups if (module := g.get("module")) and module["name"]}
    wanted = {task.replace("_", "-") for task in found.tasks} - {"move", "lab"}
    assert len(wanted) == 18
    assert wanted <= names


BAD = {
    "key of the plane": ('rod    = { length = 0.3 }', 'rod = { length = 0.3, angle = 1 }',
                         "vectors.rod.angle: 'angle' is a key of vectors in the plane"),
    "bodies beside": ("[loops]", "[bodies.a]\npoints = { A = [0, 0, 0] }\n[loops]",
                      "bodies.a: no chain of joints connects a to the ground"),
    "loose loop": ("[loops]", "a = { length = 1 }\nb = { length = 1 }\n[loops]\n"
                   'other = ["a", "b"]', "loops.other: the loop shares no vector"),
    "twice": ('"-offset"]', '"-offset", "rod"]', "'rod' is in the loop twice"),
    "in the plane": ("dimension = 3\n", "", "is a key of vectors in space"),
    "driven and given": ('"crank.azimuth", from', '"rod.length", from',
                         "has no coordinate 'rod.length'"),
    "open": ('[loops]\nclosure = ["crank", "rod", "-slide", "-offset"]',
             "x = { length = 1, elevation = 0, azimuth = 0 }\n"
             "y = { length = 2, elevation = 0, azimuth = 0 }\n"
             'z = { length = 3.5, elevation = 0, azimuth = 0 }\n[loops]\n'
             'given = ["x", "y", "-z"]\nclosure = ["crank", "rod", "-slide", "-offset"]\n'
             'tie = ["x", "offset", "-z"]', "do not close"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD, ids=str)
def test_what_is_refused(case: str) -> None:
    old, new, expected = BAD[case]
    assert old in TEXT
    with pytest.raises(md.InputError) as caught:
        problem(TEXT.replace(old, new))
    assert expected in str(caught.value)
