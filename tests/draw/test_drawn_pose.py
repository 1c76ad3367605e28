"""Diagrams: which pose is drawn, and what of a mechanism that is not all there."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.draw.diagram.scene import choose_pose, read_scene
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_scene import read_spatial
from tests.shared.drawn import (
    POSES,
    gids,
    seven_link,
    slider_crank,
    with_gid,
)
from tests.shared.paths import ROOT


def test_default_pose_is_assembled_and_near_the_middle():
    result = seven_link(np.deg2rad(np.linspace(38, -90, 41)))
    assert "unassembled" in result.status
    scene = replace(read_scene(result), turn=None)
    chosen = choose_pose(scene, "sweep")
    assembled = scene.assembled()
    assert chosen == assembled[len(assembled) // 2]
    assert choose_pose(scene, "modes") == 0
    assert choose_pose(scene, "sweep", -1) == 40
    for wrong in (41, -42, 1.5, True):
        with pytest.raises(md.InputError, match="pose"):
            choose_pose(scene, "sweep", wrong)


def of_length(result):
    """Return a scene whose driver gives no angle."""
    return replace(read_scene(result), turn=None)


BOOK = (
    "four-bar-crank-rocker", "hoeken-straight-line", "watt-six-bar", "whitworth-quick-return",
    "elliptic-trammel", "slider-crank-inertia", "rssr",
)  # fmt: skip


@pytest.mark.parametrize("name", BOOK)
def test_the_driver_is_where_books_draw_it(name):
    """Between 30 and 70 degrees, and no two links with a common pin within 12 degrees in line."""
    result = md.solve(name)
    flat = result.mechanism.dimension == 2
    scene = read_scene(result) if flat else read_spatial(result)
    pose = choose_pose(scene, result.kind) if flat else choose(scene, result.kind, None, None)[0]
    assert 30.0 <= np.rad2deg(scene.turn[pose]) % 360.0 <= 70.0
    for joint in result.mechanism.joints.values() if flat else ():
        ends = [
            [
                scene.place(f"{body}.{point}", pose) - scene.place(joint.first, pose)
                for point in result.mechanism.body(body).points
            ]
            for body in joint.bodies
            if body != "ground"
        ]
        if joint.hinge and len(ends) == 2:
            for a in ends[0]:
                for b in ends[1]:
                    size = np.hypot(*a) * np.hypot(*b)
                    assert size < 1e-12 or a @ b / size > -np.cos(np.deg2rad(12.0))


def test_no_pin_lies_on_the_link_of_others():
    """At 41 degrees the bar OC of Peaucellier's cell runs through the pivot Q."""
    scene = read_scene(md.solve("peaucellier", "window"))
    pose = choose_pose(scene, "sweep")
    (o, c, q) = (scene.place(ref, pose) for ref in ("ground.O", "arm_C.C", "ground.Q"))
    way = (c - o) / np.hypot(*(c - o))
    assert abs(way[0] * (q - o)[1] - way[1] * (q - o)[0]) > 0.04 * np.hypot(*(c - o))


def test_default_pose_avoids_links_on_each_other():
    scene = of_length(slider_crank(np.deg2rad(np.arange(0.0, 361.0, 10.0))))
    angle = np.rad2deg(scene.angles["crank"][choose_pose(scene, "sweep")])
    assert 140 < angle < 220
    assert angle != pytest.approx(180)


def test_default_pose_avoids_a_dead_centre_near_the_middle():
    angles = np.deg2rad(np.arange(0.0, 721.0, 10.0))
    scene = of_length(slider_crank(angles))
    chosen = choose_pose(scene, "sweep")
    # crank and rod in line at 360 deg: 25 deg between them, with sin(rod) = sin(crank) / 3
    turn = abs(np.rad2deg(angles[chosen]) - 360.0)
    assert turn == pytest.approx(20.0)
    assert turn + np.rad2deg(np.arcsin(np.sin(np.deg2rad(turn)) / 3)) > 25.0


def test_short_sweep_shows_its_first_pose():
    assert choose_pose(read_scene(slider_crank(POSES[:3])), "sweep") == 0


def test_unassembled_pose_says_so():
    result = seven_link(np.deg2rad(np.linspace(38, -90, 9)))
    ax = md.plot(result, pose=-1)
    (note,) = with_gid(ax, "note")
    assert note.get_text().startswith("unassembled, not drawn: crank")
    assert "support-F" in gids(ax)
    assert not with_gid(ax, "body-rod-bar")


def test_bodies_outside_the_scene_are_listed():
    result = seven_link()
    for name in ("coupler", "rocker", "slider"):
        del result.bodies[name]
    result.points = {name: result.points[name] for name in ("slider.C", "crank.A", "rod.B")}
    result.summary = {"not_in_scene": ["coupler", "rocker"]}
    ax = md.plot(result)
    (note,) = with_gid(ax, "note")
    assert note.get_text() == "not in the scene: coupler, rocker"
    names = gids(ax)
    assert {"joint-guide-prismatic", "number-slider", "support-O"} <= set(names)
    assert not {"support-F", "number-coupler", "body-rocker-bar"} & set(names)
    full = seven_link().points["slider.C"].position
    np.testing.assert_allclose(read_scene(result).track("slider.C"), full, atol=1e-12)


def test_traces_break_where_the_mechanism_does():
    result = seven_link(np.deg2rad(np.linspace(38, -90, 9)))
    (trace,) = with_gid(md.plot(result), "trace-rod.B")
    assert (np.isnan(trace.get_ydata()) == (result.status == "unassembled")).all()


def test_modes_have_no_paths_and_their_label_below_the_title():
    axes = md.plot(md.solve("triad-six-modes", "modes"), pose=3)
    (subtitle,) = with_gid(axes, "subtitle")
    assert subtitle.get_text().endswith("mode -1, 4 of 6")  # +1, +2, +3 come before
    assert not [a for a in axes.get_children() if str(a.get_gid()).startswith("trace-")]


def test_a_study_has_no_pose_to_draw():
    problem = md.load("four-bar-crank-rocker")
    study = md.Study(of="turn", vary={"a": [0.03, 0.04, 2]}, outputs=["summary/swing/rocker"])
    with pytest.raises(md.InputError, match="a study has no pose"):
        md.plot(md.solve(problem, study, poses=None), "diagram")


def test_the_command_dashes_bodies_that_no_output_depends_on(tmp_path, capsys):
    text = (ROOT / "problems" / "gorshkov-seven-link.toml").read_text()
    path = tmp_path / "press.toml"
    path.write_text(text.replace("[tasks.pose]\n", '[tasks.pose]\noutputs = ["slider.C"]\n'))

    def bars(source, task):
        command = ["plot", str(source), "--task", task, "--out", str(tmp_path)]
        assert main(command) == 0
        drawn = Path(capsys.readouterr().out.strip()).read_text()
        every = set(re.findall(r'<g id="body-(\w+)-bar">', drawn))
        dashed = re.findall(r'<g id="body-(\w+)-bar">\s*<path [^>]*stroke-dasharray', drawn)
        return every, set(dashed)

    every, dashed = bars(path, "pose")
    assert dashed == {"coupler", "rocker"}
    assert {"crank", "rod", "connecting_rod"} <= every
    # over the whole turn they do not assemble: they are left out
    every, dashed = bars("gorshkov-seven-link", "turn")
    assert not {"coupler", "rocker"} & every
    assert not dashed


def test_a_result_without_poses_is_refused():
    empty = seven_link()
    empty.status = np.array([])
    with pytest.raises(md.InputError, match="no pose"):
        md.plot(empty)


SIX_BAR = """
[ground]
points = { A = [0, 0], D = [0.1, 0], E = [0.1, 0.2] }
[bodies]
crank = { points = { A = [0, 0], B = [0.04, 0] } }
coupler = { points = { B = [0, 0], C = [0.12, 0], F = [FAR, 0] } }
rocker = { points = { D = [0, 0], C = [0.08, 0] } }
rod = { points = { F = [0, 0], G = [0.1, 0] } }
arm = { points = { E = [0, 0], G = [0.09, 0] } }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
B = { kind = "revolute", between = ["crank.B", "coupler.B"] }
C = { kind = "revolute", between = ["coupler.C", "rocker.C"] }
D = { kind = "revolute", between = ["ground.D", "rocker.D"] }
F = { kind = "revolute", between = ["coupler.F", "rod.F"] }
G = { kind = "revolute", between = ["rod.G", "arm.G"] }
E = { kind = "revolute", between = ["ground.E", "arm.E"] }
[sketch]
crank_deg = 40
coupler_deg = 20
rocker_deg = 60
rod_deg = 60
arm_deg = -30
[tasks.pose]
kind = "sweep"
driver = { coordinate = "crank.angle", at_deg = [60] }
"""


@pytest.mark.parametrize("width", [None, "90mm"])
def test_pins_nearer_than_their_symbols_have_an_enlarged_detail(tmp_path, width):
    """C and F are 1 mm apart: 20 mm beside the diagram, with their letters there alone."""
    file = tmp_path / "near.toml"
    file.write_text("schema = 1\n" + SIX_BAR.replace("FAR", "0.121"))
    result = md.solve(file)
    assert "detail-label-coupler.C" not in gids(md.plot(result, "diagram", labels=False))
    axes = md.plot(result, "diagram", width=width)
    assert "detail-label-coupler.C" in gids(axes)
    circles = {own.get_gid(): own for own in axes.patches if hasattr(own, "center")}
    frame = circles["detail"]
    apart = np.subtract(circles["detail-joint-C-pin"].center, circles["detail-joint-F-pin"].center)
    assert np.hypot(*apart) == pytest.approx(20e-3, rel=1e-9)
    for name in "CF":
        away = np.subtract(circles[f"detail-joint-{name}-pin"].center, frame.center)
        assert np.hypot(*away) < frame.radius
        written = [own.get_gid() for own in axes.texts if own.get_text() == name]
        assert len(written) == 1
        assert written[0].startswith("detail-")
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    assert (low < np.subtract(frame.center, frame.radius)).all()
    assert (np.add(frame.center, frame.radius) < high).all()
    bars = [own.get_xydata() for own in axes.lines if str(own.get_gid()).startswith("body-")]
    ways = np.concatenate([np.linspace(*ends[:2], 50) for ends in bars]) - frame.center
    assert np.hypot(*ways.T).min() > frame.radius
    assert "20 : 1" in [own.get_text() for own in axes.texts]
    file.write_text("schema = 1\n" + SIX_BAR.replace("FAR", "0.15"))
    axes = md.plot(md.solve(file), "diagram", width=width)
    assert not [gid for gid in gids(axes) if str(gid).startswith("detail")]
