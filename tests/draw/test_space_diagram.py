"""Diagrams of spatial mechanisms: symbols, places, labels, views, animation, refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.diagram import diagram
from mechdae.draw.space.anchors import offsets
from mechdae.draw.space.spatial_scene import pose_chains, read_spatial
from mechdae.errors import InputError
from mechdae.tasks.pictures import for_picture

NAMES = (
    "rssr", "rssp", "cardan-joint", "double-cardan", "bennett", "spatial-slider-crank-loops",
)  # fmt: skip


@cache
def solved(name: str, poses: int = 13):
    """The first task of a problem with few poses."""
    problem = md.load(name)
    task, kind = next(iter(problem.tasks.items()))
    if getattr(kind, "poses", None):
        problem = problem.with_task(task, replace(kind, poses=poses))
    return for_picture(problem, task, ("bodies",))


@pytest.fixture
def labels(monkeypatch):
    """Boxes of the labels written in a test: (gid, low, high)."""
    seen = []
    write = diagram.write_all

    def spy(*given):
        seen.append(write(*given))
        return seen[-1]

    monkeypatch.setattr(diagram, "write_all", spy)
    return seen


def gids(axes):
    return {str(own.get_gid()) for own in (*axes.patches, *axes.lines, *axes.texts)}


@pytest.mark.parametrize("name", NAMES)
def test_every_joint_has_its_symbol_and_labels_do_not_overlap(name, labels):
    result = solved(name)
    axes = md.plot(result)
    drawn = gids(axes)
    shown = read_spatial(result).joints(0)
    for joint in shown:
        start = f"vector-{joint.name}" if joint.pointer else f"joint-{joint.name}-"
        assert any(gid.startswith(start) for gid in drawn), joint.name
    assert {"axis-x", "axis-y", "axis-z", "scale-bar"} <= drawn
    (boxes,) = labels
    assert len(boxes) >= len(shown)
    low = np.array([own[1] for own in boxes]) + 0.5
    high = np.array([own[2] for own in boxes]) - 0.5
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    both = np.clip(shared, 0.0, None).prod(axis=-1)
    np.fill_diagonal(both, 0.0)
    assert not both.any()


def test_places_in_the_picture_are_those_of_the_points():
    """Eye at azimuth 30, elevation 20 degrees: right is (-sin a, cos a, 0), written out."""
    result = solved("rssr")
    axes = md.plot(result, pose=2, view="30,20")
    x, y, z = result.points["rocker.C"].position[2]
    a, e = np.deg2rad(30.0), np.deg2rad(20.0)
    right = -np.sin(a) * x + np.cos(a) * y
    up = -np.sin(e) * (np.cos(a) * x + np.sin(a) * y) + np.cos(e) * z
    rim = next(own for own in axes.patches if own.get_gid() == "joint-C-ball")
    np.testing.assert_allclose(rim.center, [right, up], atol=0.04 * rim.radius)


def test_shafts_of_a_cardan_joint_lie_on_their_axes_apart():
    result = solved("cardan-joint")
    scene = read_spatial(result)
    moved = offsets(scene, 0, {})
    assert set(moved) == {"I", "E"}
    first, second = moved["I"] * np.array([1.0, 0, 0]), moved["E"] * np.array([0.8, 0, 0.6])
    assert first @ second < 0
    assert np.linalg.norm(first - second) > 1.5 * abs(moved["I"])


def test_three_views_to_one_scale():
    result = solved("rssr")
    front = md.plot(result, pose=2, view="three")
    axes = front.get_figure(root=True).axes
    assert len(axes) == 4
    place = result.points["rocker.C"].position[2]
    scales = []
    for own, (right, up) in zip(axes, ((0, 2), (1, 2), (0, 1)), strict=False):
        rim = next(own for own in own.patches if own.get_gid() == "joint-C-ball")
        sign = -1.0 if right == 1 else 1.0  # seen from the left, y points to the left
        near = 0.04 * rim.radius
        np.testing.assert_allclose(rim.center, [sign * place[right], place[up]], atol=near)
        ends = own.transData.transform([(0, 0), (1, 0)])
        scales.append(ends[1, 0] - ends[0, 0])
    assert scales == pytest.approx([scales[0]] * 3)
    front_place, left_place, top_place = (own.get_position() for own in axes[:3])
    assert front_place.y0 == left_place.y0  # heights face each other
    assert front_place.x0 == top_place.x0  # and so do widths


def test_near_bars_are_drawn_after_far_ones():
    """Two bars that cross in the picture: the one nearer to the eye is above."""
    bodies = [md.Body(n, {"A": [0, 0, 0], "B": [1, 0, 0]}) for n in ("low", "high")]
    ground = md.Ground({"P": [0, 0, 0], "Q": [0.5, -0.5, 1.0]})
    axis = {"axis": [0, 0, 1]}
    joints = [
        md.SpatialRevolute("P", "ground.P", "low.A", **axis),
        md.SpatialRevolute("Q", "ground.Q", "high.A", **axis, zero=[0, 1, 0], zero2=[1, 0, 0]),
    ]
    mechanism = md.Mechanism(dimension=3, ground=ground, bodies=bodies, joints=joints)
    task = md.Sweep(drivers=[md.Driver("P.angle", at=[0.0]), md.Driver("Q.angle", at=[0.0])])
    result = md.solve(mechanism, task)
    for elevation, above in ((80.0, "high"), (-80.0, "low")):
        axes = md.plot(result, view=(-90.0, elevation))
        z = {own.get_gid(): own.get_zorder() for own in axes.lines}
        bars = [f"body-{name}-bar" for name in ("low", "high")]
        assert max(bars, key=lambda gid: z[gid]) == f"body-{above}-bar"


def test_animation_has_one_scale_and_goes_round():
    moving = md.plot(solved("rssr"), "animation", frames=3, dpi=30)
    assert moving.closed
    assert len(moving) == 3
    frames = moving.frames()
    assert {frame.size for frame in frames} == {(210, 150)}
    assert frames[0].tobytes() != frames[1].tobytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"view": "left"}, "no direction to look from"),
        ({"view": (10.0, 95.0)}, "from -90 to 90"),
        ({"view": "1,2,3"}, "no direction"),
        ({"pose": 99}, "no pose 99"),
    ],
)
def test_what_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        md.plot(solved("rssr"), "diagram", **options)


def test_planar_mechanisms_have_one_view():
    result = md.solve("four-bar-crank-rocker")
    with pytest.raises(InputError, match="planar mechanisms have no option 'view'"):
        md.plot(result, "diagram", view="30,20")


def test_pairs_of_an_open_chain_each_have_their_symbol():
    """Screw, prismatic, planar, cylindrical pair and weld, all coordinates driven."""
    points = {
        "nut": {"H": [0, 0, 0], "P": [0.3, 0, 0]},
        "slide": {"P": [0, 0, 0], "E": [0.1, 0, 0.2]},
        "plate": {"E": [0, 0, 0], "C": [0.25, 0, 0.1], "T": [0, 0.2, 0.1]},
        "rod": {"C": [0, 0, 0], "W": [0.2, 0, 0]},
        "arm": {"W": [0, 0, 0], "Q": [0, 0, 0.15]},
    }
    joints = [
        md.Screw("H", "ground.A", "nut.H", axis=[0, 0, 1], pitch=0.1),
        md.SpatialPrismatic("P", "nut.P", "slide.P", axis=[0, 1, 0]),
        md.PlanarPair("E", "slide.E", "plate.E", axis=[0, 0, 1]),
        md.Cylindrical("C", "plate.C", "rod.C", axis=[1, 0, 0]),
        md.SpatialWeld("W", "rod.W", "arm.W"),
    ]
    values = {"H.angle": 2.0, "P.slide": 0.15, "E.angle": 0.4, "E.x": 0.05, "E.y": 0.02,
              "C.angle": 0.3, "C.slide": 0.12}  # fmt: skip
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0]}),
        bodies=[md.Body(name, own) for name, own in points.items()],
        joints=joints,
    )
    drivers = [md.Driver(name, at=[value]) for name, value in values.items()]
    drawn = gids(md.plot(md.solve(mechanism, md.Sweep(drivers=drivers))))
    wanted = {
        f"joint-{n}" for n in ("H-sleeve", "P-sleeve", "P-guide", "E-plane", "C-sleeve", "W-weld")
    }
    assert (
        wanted | {f"driver-{name}" for name in values} | {"support-H", "body-plate-face"} <= drawn
    )


def test_a_place_keeps_no_name_of_a_joint_that_is_drawn_elsewhere(labels):
    """Two hinges of a fork share a point: the one on the ground is drawn along its axis, named."""
    result = solved("schatz", 5)
    axes = md.plot(result, pose=0)
    texts = [text.get_text() for text in axes.texts]
    assert {"O", "A", "B", "C"} <= set(texts)
    assert not [text for text in texts if "J" in text and "," in text]


def test_chains_that_only_give_a_pose_are_not_drawn():
    """The hexapod's platform is held by its legs; an arm's wrist, whose bodies are as small, is."""
    hexapod = md.load("hexapod").mechanism
    assert pose_chains(hexapod) == {"way_x", "way_y", "way_z", "yawed", "pitched"}
    for name in ("six-axis-arm", "stewart-gough", "cardan-joint", "vector-modules-spatial"):
        assert not pose_chains(md.load(name).mechanism)
    axes = md.plot("hexapod", width="90mm")
    names = " ".join(gids(axes))
    assert "platform" in names
    assert not any(name in names for name in pose_chains(hexapod))
    assert not any("way_x" in text.get_text() for text in axes.texts)


def test_torques_have_two_heads_and_drivers_one():
    axes = md.plot("bevel-differential")
    heads = [own.get_gid() for own in axes.patches if own.get_gid()]
    assert heads.count("load-left") == 2
    assert heads.count("driver-left_pin.angle") == 1


@pytest.mark.parametrize("name", ["stewart-gough", "hexapod", "bevel-differential", "wobble-plate"])
def test_joints_and_drivers_are_before_faces(name):
    """Nothing of a joint, a driver or a load is below a body's face; hidden bars are dashed."""
    axes = md.plot(name, width="90mm")
    shown = [own for own in (*axes.patches, *axes.lines) if own.get_gid()]
    faces = [own.zorder for own in shown if own.get_gid().endswith("-face")]
    symbols = [own.zorder for own in shown if own.get_gid().startswith(("joint-", "driver-"))]
    assert faces
    assert max(faces) < min(symbols)
    if name == "wobble-plate":
        bars = [own for own in axes.lines if own.get_gid() and own.get_gid().endswith("-bar")]
        assert any(own.get_linestyle() == "--" for own in bars)
