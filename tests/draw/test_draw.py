"""Kinematic diagrams: symbols, radii of wheels, labels, files."""

import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import mechdae as md
from mechdae.cli import main
from mechdae.describe.mechanism import GROUND
from mechdae.draw import save, style
from mechdae.draw.diagram import diagram, wheels
from mechdae.draw.diagram.places import places_of, written
from mechdae.draw.diagram.scene import choose_pose, read_scene
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import draw_labels, numbers_of
from mechdae.draw.words import Words
from tests.shared.paths import ROOT

POSES = np.deg2rad(np.arange(20.0, 381.0, 15.0))


def turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def residuals(mechanism, numbers, q):
    """Constraint equations of planar poses q = {body: (x, y, angle)}."""

    def at(reference):
        x, y, angle = q[reference.split(".")[0]]
        return np.array([x, y]) + turn(angle) @ [numbers[f"{reference}.{a}"] for a in "xy"]

    result = []
    for joint in mechanism.joints.values():
        step = at(joint.second) - at(joint.first)
        angle = q[joint.second_body][2] - q[joint.first_body][2]

        def number(entry, name=joint.name):
            return numbers[f"{name}.{entry}"]

        if joint.kind in ("prismatic", "pin-in-slot"):
            result.append((turn(q[joint.first_body][2] + number("axis")).T @ step)[1])
        if joint.kind in ("revolute", "weld"):
            result.extend(step)
        if joint.kind in ("prismatic", "weld"):
            result.append(angle - number("turn"))
        if joint.kind == "distance":
            result.append((step @ step - number("length") ** 2) / number("length"))
        if joint.kind in ("gear", "belt"):
            carrier = q[joint.carrier or GROUND][2]
            first, second = (q[b][2] - carrier for b in (joint.first_body, joint.second_body))
            result.append(first - number("ratio") * second - number("phase"))
        if joint.kind == "rack":
            axis = turn(q[joint.second_body][2] + number("axis"))[:, 0]
            result.append(axis @ step - number("radius") * q[joint.first_body][2])
    return np.array(result)


def make_result(mechanism, driver, values, guess, kind="sweep", title="", **more):
    """Return a stand-in for a result: poses by Newton's method from pose to pose.

    ``guess`` is {body: (x, y, angle)} near the first pose; ``driver`` a body whose angle
    takes the `values`. A pose that does not assemble has the status "unassembled".
    """
    names, numbers = list(mechanism.bodies), mechanism.values()
    z = np.array([guess[name] for name in names], dtype=float).ravel()

    def equations(z, value):
        q = {GROUND: np.zeros(3), **dict(zip(names, z.reshape(-1, 3), strict=True))}
        return np.append(residuals(mechanism, numbers, q), q[driver][2] - value)

    rows, status = [], []
    for value in np.atleast_1d(values):
        x = z.copy()
        for _ in range(15):
            f = equations(x, value)
            if np.abs(f).max() < 1e-12:
                break
            step = 1e-6
            jacobian = np.array(
                [(equations(x + d, value) - f) / step for d in step * np.eye(len(x))]
            )
            x = x - np.linalg.lstsq(jacobian.T, f, rcond=1e-9)[0]
        good = np.abs(equations(x, value)).max() < 1e-9
        z = x if good else z
        rows.append(x.reshape(-1, 3) if good else np.full((len(names), 3), np.nan))
        status.append("ok" if good else "unassembled")
    poses = dict(zip(names, np.array(rows).transpose(1, 0, 2), strict=True))
    points = {}
    for name, body in mechanism.bodies.items():
        for point in body.points:
            local = [numbers[f"{name}.{point}.{axis}"] for axis in "xy"]
            place = np.array([p[:2] + turn(p[2]) @ local for p in poses[name]])
            points[f"{name}.{point}"] = SimpleNamespace(position=place)
    return SimpleNamespace(
        mechanism=mechanism,
        problem="sample",
        task="task",
        kind=kind,
        title=title,
        status=np.array(status),
        bodies={name: SimpleNamespace(angle=pose[:, 2]) for name, pose in poses.items()},
        points=points,
        joints={},
        drivers={f"{driver}.angle": SimpleNamespace(position=np.atleast_1d(values))},
        summary=more.get("summary", {}),
    )


def seven_link(values=None):
    og = 0.46790884005019448852
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "G": [0, -og], "F": [0.8727, 0]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [0.1716, 0]}, number=1),
            md.Body("block", {"A": [0, 0]}, number=2),
            md.Body("rod", {"G": [0, 0], "B": [0.8342, 0]}, number=3),
            md.Body("connecting_rod", {"B": [0, 0], "C": [0.5179, 0]}, number=4),
            md.Body("slider", {"C": [0, 0]}, number=5),
            md.Body("coupler", {"B": [0, 0], "E": [0.54, 0]}, number=6),
            md.Body("rocker", {"F": [0, 0], "E": [0.3013, 0]}, number=7),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "block.A"),
            md.Prismatic("slot", "rod.G", "block.A"),
            md.Revolute("G", "ground.G", "rod.G"),
            md.Revolute("BC", "rod.B", "connecting_rod.B"),
            md.Revolute("BE", "rod.B", "coupler.B"),
            md.Revolute("C", "connecting_rod.C", "slider.C"),
            md.Prismatic("guide", "ground.O", "slider.C"),
            md.Revolute("E", "rocker.E", "coupler.E"),
            md.Revolute("F", "ground.F", "rocker.F"),
        ],
    )
    d = np.deg2rad
    guess = {
        "crank": (0, 0, d(40)),
        "block": (0.13, 0.11, d(75)),
        "rod": (0, -og, d(75)),
        "connecting_rod": (0.2, 0.34, d(-40)),
        "slider": (0.6, 0, 0),
        "coupler": (0.2, 0.34, d(-10)),
        "rocker": (0.8727, 0, d(120)),
    }
    values = d([38.117]) if values is None else values
    title = "Seven-link lever mechanism, crank with three dyads in two branches"
    return make_result(mechanism, "crank", values, guess, title=title)


def five_bar(values=None):
    mechanism = md.Mechanism(
        ground=md.Ground({"D": [0, 0], "A": [0.1, 0]}),
        bodies=[
            md.Body("crank", {"A": [0, 0], "B": [0.048, 0]}, number=1),
            md.Body("coupler", {"C": [0, 0], "B": [0.09, 0]}, number=2),
            md.Body("rocker", {"D": [0, 0], "C": [0.08, 0]}, number=3),
            md.Body("wheel", {"A": [0, 0]}, number=4),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("wheel_pin", "ground.A", "wheel.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
            md.Gear("mesh", "wheel.A", "coupler.B", carrier="crank", ratio=-1),
        ],
    )
    d = np.deg2rad
    guess = {
        "crank": (0.1, 0, d(20)),
        "coupler": (0.07, -0.04, d(40)),
        "rocker": (0, 0, d(-30)),
        "wheel": (0.1, 0, 0),
    }
    values = d([0.0]) if values is None else values
    title = "Geared five-bar: four-bar driven by a wheel coaxial with the crank"
    return make_result(mechanism, "wheel", values, guess, title=title)


def slider_crank(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "B": [0.1, 0]}),
            md.Body("rod", {"B": [0, 0], "C": [0.3, 0]}),
            md.Body("slider", {"C": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "slider.C"),
            md.Prismatic("slide", "ground.O", "slider.C"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "rod": (0.1, 0, -0.1), "slider": (0.39, 0, 0)}
    return make_result(mechanism, "crank", values, guess, title="Crank-slider")


def whitworth(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "G": [0, -0.25]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [0.1, 0]}),
            md.Body("arm", {"G": [0, 0], "B": [0.5, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.PinInSlot("slot", "arm.G", "crank.A"),
            md.Revolute("G", "ground.G", "arm.G"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "arm": (0, -0.25, 1.2)}
    return make_result(mechanism, "crank", values, guess, title="Quick return, pin in slot")


def four_bar(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"A0": [0, 0], "B0": [0.4, 0]}),
        bodies=[
            md.Body("crank", {"A0": [0, 0], "A": [0.12, 0]}),
            md.Body("coupler", {"A": [0, 0], "B": [0.35, 0], "P": [0.2, 0.16]}),
            md.Body("rocker", {"B0": [0, 0], "B": [0.25, 0]}),
        ],
        joints=[
            md.Revolute("A0", "ground.A0", "crank.A0"),
            md.Revolute("A", "crank.A", "coupler.A"),
            md.Revolute("B", "coupler.B", "rocker.B"),
            md.Revolute("B0", "ground.B0", "rocker.B0"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "coupler": (0.11, 0.03, 0.6), "rocker": (0.4, 0, 1.5)}
    return make_result(mechanism, "crank", values, guess, title="Four-bar with coupler point")


def planetary(values=POSES):
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0]}),
        bodies=[
            md.Body("sun", {"O": [0, 0]}),
            md.Body("arm", {"O": [0, 0], "P": [0.09, 0]}),
            md.Body("planet", {"P": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "sun.O"),
            md.Revolute("O2", "ground.O", "arm.O"),
            md.Revolute("P", "arm.P", "planet.P"),
            md.Gear("outer", "sun.O", "planet.P", carrier="arm", teeth=[24, 12], mesh="external"),
            md.Gear("ring", "ground.O", "planet.P", carrier="arm", teeth=[48, 12], mesh="internal"),
        ],
    )
    guess = {"sun": (0, 0, 0.3), "arm": (0, 0, 0.1), "planet": (0.09, 0.01, -0.3)}
    return make_result(mechanism, "sun", values, guess, title="Planetary gear")


def sine_mechanism(values=POSES):
    """Crank, block, yoke on a fixed guide; the yoke has one point only."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": [0, 0], "S": [0.25, 0]}),
        bodies=[
            md.Body("crank", {"O": [0, 0], "A": [0.1, 0]}),
            md.Body("block", {"A": [0, 0]}),
            md.Body("yoke", {"S": [0, 0], "T": [0.25, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "block.A"),
            md.Prismatic("cross", "yoke.S", "block.A", axis="pi/2", turn=0),
            md.Prismatic("way", "ground.S", "yoke.T"),
        ],
    )
    guess = {"crank": (0, 0, 0.3), "block": (0.1, 0.03, 0), "yoke": (0.1, 0, 0)}
    return make_result(mechanism, "crank", values, guess, title="Sine mechanism")


def zoo():
    """One joint of each remaining kind, hung on the ground; one pose."""
    mechanism = md.Mechanism(
        ground=md.Ground(
            {"O": [0, 0], "D": [0.6, 0], "W": [-0.4, 0.3], "V": [0, 0.5], "Q": [0.9, 0.4]}
        ),
        bodies=[
            md.Body("lever", {"L": [-0.25, 0], "O": [0, 0], "M": [0.15, 0], "R": [0.35, 0]}),
            md.Body("link", {"D": [0, 0], "E": [0.2, 0]}),
            md.Body("bracket", {"E": [0, 0], "X": [0, 0.12]}),
            md.Body("pinion", {"W": [0, 0]}),
            md.Body("rack", {"K": [0, 0]}),
            md.Body("pulley", {"W": [0, 0]}),
            md.Body("disc", {"V": [0, 0]}),
            md.Body("cam", {"Q": [0, 0]}),
            md.Body("follower", {"N": [0, 0]}),
            md.Body("hanger", {"M": [0, 0], "H": [0.2, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "lever.O"),
            md.Revolute("M", "lever.M", "hanger.M"),
            md.PinInSlot("groove", "ground.O", "hanger.H", axis="pi/2"),
            md.Revolute("D", "ground.D", "link.D"),
            md.Weld("E", "link.E", "bracket.E", turn=0),
            md.Distance("bar", "lever.R", "link.E", length=0.2),
            md.Revolute("W", "ground.W", "pinion.W"),
            md.Rack("teeth", "pinion.W", "rack.K", radius=0.08),
            md.Prismatic("way", "ground.W", "rack.K"),
            md.Revolute("V", "ground.V", "disc.V"),
            md.Revolute("W2", "ground.W", "pulley.W"),
            md.Belt("belt", "pulley.W", "disc.V", ratio=2.0),
            md.Revolute("Q", "ground.Q", "cam.Q"),
            md.Curve(
                "profile",
                "cam.Q",
                "follower.N",
                x="0.12*cos(s)",
                y="0.08*sin(s)",
                closed=True,
                roller_radius=0.02,
            ),
            md.Prismatic("stem", "ground.Q", "follower.N", axis="pi/2"),
        ],
    )
    d = np.deg2rad
    poses = {
        "lever": (0, 0, d(15)),
        "link": (0.6, 0, d(115)),
        "bracket": (0.5155, 0.1813, d(115)),
        "pinion": (-0.4, 0.3, 0.4),
        "rack": (-0.3, 0.22, 0),
        "disc": (0, 0.5, 0.2),
        "pulley": (-0.4, 0.3, 0.4),
        "cam": (0.9, 0.4, 0),
        "follower": (0.9, 0.5, 0),
        "hanger": (0.1449, 0.0388, d(-136.4)),
    }
    return SimpleNamespace(
        mechanism=mechanism,
        problem="zoo",
        task="task",
        kind="sweep",
        title="All other joints",
        status=np.array(["ok"]),
        bodies={name: SimpleNamespace(angle=np.array([pose[2]])) for name, pose in poses.items()},
        points={
            f"{name}.{point}": SimpleNamespace(
                position=np.array([pose[:2]])
                + turn(pose[2]) @ [mechanism.values()[f"{name}.{point}.{axis}"] for axis in "xy"]
            )
            for name, pose in poses.items()
            for point in list(mechanism.bodies[name].points)[:1]
        },
        joints={},
        drivers={"way.slide": SimpleNamespace(position=np.array([0.1]))},
        summary={},
    )


SAMPLES = {
    "seven-link": seven_link,
    "five-bar": five_bar,
    "slider-crank": slider_crank,
    "whitworth": whitworth,
    "four-bar": four_bar,
    "planetary": planetary,
    "sine": sine_mechanism,
    "others": zoo,
}


def gids(ax):
    return [artist.get_gid() for artist in ax.get_children() if artist.get_gid()]


def with_gid(ax, gid):
    return [artist for artist in ax.get_children() if artist.get_gid() == gid]


@pytest.fixture
def spied(monkeypatch):
    """Sheets and label boxes of the diagrams drawn in a test."""
    seen = []

    def spy(sheet, *rest):
        drawn = (list(sheet.segments), list(sheet.boxes))
        seen.append((sheet, drawn, draw_labels(sheet, *rest)))
        return seen[-1][2]

    monkeypatch.setattr(diagram, "draw_labels", spy)
    return seen


@pytest.mark.parametrize(
    ("sample", "expected"),
    [
        (seven_link, {"joint-O-pin", "joint-BC-BE-pin", "support-O", "support-F"}),
        (seven_link, {"joint-slot-prismatic", "joint-guide-prismatic", "joint-guide-guide"}),
        (seven_link, {"driver-crank.angle", "number-rod", "label-ground.O", "scale-bar", "title"}),
        (five_bar, {"joint-mesh-gear", "body-coupler-wheel", "joint-A-wheel_pin-pin"}),
        (whitworth, {"joint-slot-pin-in-slot", "joint-slot-pin", "point-arm.B", "trace-arm.B"}),
        (four_bar, {"body-coupler-polygon", "point-coupler.P", "trace-coupler.P"}),
        (sine_mechanism, {"joint-cross-guide", "joint-cross-corner", "joint-way-guide"}),
        (zoo, {"joint-E-weld", "joint-bar-distance", "joint-teeth-rack", "joint-belt-strand"}),
        (zoo, {"joint-profile-curve", "joint-profile-roller", "joint-groove-pin-in-slot"}),
        (zoo, {"bridge-lever.M", "bridge-lever.O", "driver-way.slide"}),
    ],
)
def test_symbols_of_every_joint_kind(sample, expected):
    assert expected <= set(gids(md.plot(sample(), "diagram")))


def test_pins_are_where_the_joints_are():
    ax = md.plot(seven_link())
    (pin,) = with_gid(ax, "joint-A-pin")
    angle = np.deg2rad(38.117)
    assert pin.center == pytest.approx(0.1716 * np.array([np.cos(angle), np.sin(angle)]))
    assert ax.get_aspect() == 1.0
    assert len(with_gid(ax, "joint-BC-BE-pin")) == 1


def test_bar_is_interrupted_by_the_block():
    ax = md.plot(seven_link())
    ends = np.array([line.get_xydata() for line in with_gid(ax, "body-rod-bar")])
    assert len(ends) == 2
    pin = np.array(with_gid(ax, "joint-A-pin")[0].center)
    near = np.hypot(*(ends.reshape(-1, 2) - pin).T)
    assert np.sort(near)[:2] == pytest.approx(2 * [style.BLOCK[0] * unit_length(ax)], rel=1e-6)


def unit_length(ax):
    """Metres per unit of the sheet: a new figure has one unit per point."""
    return np.ptp(ax.get_xlim()) / (ax.get_window_extent().width * 72 / ax.get_figure().dpi)


def test_block_lies_along_its_guide():
    result = seven_link()
    (block,) = with_gid(md.plot(result), "joint-slot-prismatic")
    corners = block.get_xy()
    side = corners[1] - corners[0]
    assert np.arctan2(side[1], side[0]) == pytest.approx(result.bodies["rod"].angle[0])


@pytest.mark.parametrize("ratio", [-0.25, -1.0, -3.0, 0.25, 4.0])
def test_pitch_radii_give_equal_speeds_at_the_pitch_point(ratio):
    first, second = np.array([0.3, -0.1]), np.array([0.5, 0.4])
    distance = np.hypot(*(second - first))
    radii = wheels.pitch_radii(distance, ratio)
    toward = (second - first) / distance
    inside = ratio > 0 and radii[1] > radii[0]  # the first wheel lies inside the second
    touch = first - radii[0] * toward if inside else first + radii[0] * toward
    assert np.hypot(*(touch - first)) == pytest.approx(radii[0])
    assert np.hypot(*(touch - second)) == pytest.approx(radii[1])
    assert (sum(radii) if ratio < 0 else abs(radii[0] - radii[1])) == pytest.approx(distance)
    speeds = [w * np.array([-r[1], r[0]]) for w, r in ((ratio, touch - first), (1, touch - second))]
    np.testing.assert_allclose(*speeds, atol=1e-12)


def test_wheels_without_finite_circles():
    assert wheels.pitch_radii(0.1, 1.0) is None
    assert wheels.pitch_radii(0.0, -2.0) is None


def test_planetary_gear_is_drawn_to_its_teeth():
    ax = md.plot(planetary())
    radii = {
        round(circle.get_radius(), 9)
        for name in ("outer", "ring")
        for circle in with_gid(ax, f"joint-{name}-gear")
    }
    assert radii == {0.06, 0.03, 0.12}
    assert len(with_gid(ax, "joint-outer-gear") + with_gid(ax, "joint-ring-gear")) == 3


def overlap(low, high, other_low, other_high):
    """The common area of each box with each other box, (boxes, others)."""
    shared = np.minimum(high[:, None], other_high) - np.maximum(low[:, None], other_low)
    return np.clip(shared, 0.0, None).prod(axis=-1)


@pytest.mark.parametrize("name", SAMPLES)
def test_labels_cover_neither_links_nor_each_other(name, spied):
    md.plot(SAMPLES[name](), ghosts=2)
    ((sheet, (segments, boxes), labels),) = spied
    low = np.array([label[1] for label in labels]) + 0.5
    high = np.array([label[2] for label in labels]) - 0.5
    assert (low > 0).all()
    assert (high < sheet.size).all()
    shared = overlap(low, high, low, high)
    np.fill_diagonal(shared, 0.0)
    assert not shared.any()
    rows = np.array([row for row in segments if row[4] >= style.SOLID])
    assert not layout.crossing(rows, low, high).any()
    rows = np.array(boxes)
    assert not overlap(low, high, rows[:, :2], rows[:, 2:4]).any()


def test_crossing_is_the_length_inside():
    low, high = np.array([[0.0, 0.0]]), np.array([[2.0, 1.0]])
    rows = np.array(
        [[-1, 0.5, 3, 0.5, 1], [1, 0.5, 1, 9, 1], [0, 2, 3, 2, 1], [5, -1, 5, 3, 1]], dtype=float
    )
    np.testing.assert_allclose(layout.crossing(rows, low, high), [[2.0, 0.5, 0.0, 0.0]])


def test_letters_of_shared_pins():
    scene = read_scene(five_bar())
    assert [place.letter for place in places_of(scene, 0)] == ["A", "B", "C", "D"]
    scene = read_scene(seven_link())
    letters = [place.letter for place in places_of(scene, 0)]
    assert letters == ["O", "A", "G", "B", "C", "E", "F"]
    assert written("A12") == ("A", "12")
    assert written("wheel_pin") == ("wheel_pin", "")


def test_numbers_are_the_bodies_own_or_the_next_free():
    bodies = [md.Body("a", {"P": [0, 0]}), md.Body("b", {"P": [0, 0]}, number=1)]
    joints = [md.Revolute("J", "ground.O", "a.P"), md.Revolute("K", "a.P", "b.P")]
    mechanism = md.Mechanism(md.Ground({"O": [0, 0]}), bodies, joints)
    assert numbers_of(mechanism) == {"a": 2, "b": 1}


def test_default_pose_is_assembled_and_near_the_middle():
    result = seven_link(np.deg2rad(np.linspace(38, -90, 41)))
    assert "unassembled" in result.status
    scene = read_scene(result)
    chosen = choose_pose(scene, "sweep")
    assembled = scene.assembled()
    assert chosen == assembled[len(assembled) // 2]
    assert choose_pose(scene, "modes") == 0
    assert choose_pose(scene, "sweep", -1) == 40
    for wrong in (41, -42, 1.5, True):
        with pytest.raises(md.InputError, match="pose"):
            choose_pose(scene, "sweep", wrong)


def test_default_pose_avoids_links_on_each_other():
    scene = read_scene(slider_crank(np.deg2rad(np.arange(0.0, 361.0, 10.0))))
    angle = np.rad2deg(scene.angles["crank"][choose_pose(scene, "sweep")])
    assert 140 < angle < 220
    assert angle != pytest.approx(180)


def test_default_pose_avoids_a_dead_centre_near_the_middle():
    angles = np.deg2rad(np.arange(0.0, 721.0, 10.0))
    scene = read_scene(slider_crank(angles))
    chosen = choose_pose(scene, "sweep")
    # crank and rod in line at 360 deg: 25 deg between them, with sin(rod) = sin(crank) / 3
    turn = abs(np.rad2deg(angles[chosen]) - 360.0)
    assert turn == pytest.approx(20.0)
    assert turn + np.rad2deg(np.arcsin(np.sin(np.deg2rad(turn)) / 3)) > 25.0


def test_dark_alone_draws_the_diagram_of_reactions(tmp_path, capsys):
    command = ["plot", "quick-return-friction", "--out", str(tmp_path)]
    assert main([*command, "--dark", "--lang", "ru"]) == 0
    assert capsys.readouterr().out.strip().endswith("-diagram.svg")
    assert main([*command, "--dark", "--kind", "curves"]) == 2


def test_letters_are_outlines_in_svg_files_and_text_elsewhere(tmp_path):
    axes = md.plot(seven_link())
    (letter,) = with_gid(axes, "label-crank.A")
    assert letter.get_text() == "A"
    outlines = save(axes, tmp_path / "a.svg").read_text()
    part = outlines.split('id="label-crank.A"')[1].split("</g>")[0]
    assert "<path" in part
    assert "<use" not in part
    letter.set_rotation(30.0)
    part = save(axes, tmp_path / "b.svg").read_text().split('id="label-crank.A"')[1]
    assert "rotate(-30" in part.split("</g>")[0]


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


def test_options():
    result = four_bar()
    bare = gids(md.plot(result, traces=False, labels=False))
    assert not [gid for gid in bare if gid.startswith(("trace", "label", "number", "ghost"))]
    assert gids(md.plot(result, ghosts=3)).count("ghost") == 3 * 5
    with pytest.raises(md.UnknownName, match="unknown option of a picture") as told:
        md.plot(result, trace=False)
    assert "traces" in told.value.hint


def test_traces_break_where_the_mechanism_does():
    result = seven_link(np.deg2rad(np.linspace(38, -90, 9)))
    (trace,) = with_gid(md.plot(result), "trace-rod.B")
    assert (np.isnan(trace.get_ydata()) == (result.status == "unassembled")).all()


def test_given_axes_are_used():
    axes = Figure().subplots(1, 2)
    assert md.plot(four_bar(), ax=axes[1]) is axes[1]
    assert not gids(axes[0])


def test_subtitle_tells_the_driver_value():
    (subtitle,) = with_gid(md.plot(seven_link()), "subtitle")
    assert "crank.angle = 38.117°" in subtitle.get_text()
    (subtitle,) = with_gid(md.plot(zoo()), "subtitle")
    assert "way.slide = 0.1 m" in subtitle.get_text()


@pytest.mark.parametrize(
    ("about", "length", "text"),
    [(0.13, 0.1, "100 mm"), (0.0499, 0.02, "20 mm"), (7.0, 5.0, "5 m"), (1.0, 1.0, "1 m")],
)
def test_scale_bar_has_a_round_length(about, length, text):
    assert diagram.nice_length(about) == pytest.approx(length)
    assert diagram.length_text(length, Words()) == text


def test_long_titles_are_fitted():
    result = four_bar(POSES[:1])
    result.title = "A very long title of a mechanism " * 8
    axes = md.plot(result)
    (title, rest) = (with_gid(axes, gid)[0] for gid in ("title", "title-rest"))
    assert title.get_text().endswith("…")
    assert rest.get_text().endswith("…")
    result.title = "Crank and rocker, coupler and frame; " * 3
    axes = md.plot(result)
    (title, rest) = (with_gid(axes, gid)[0] for gid in ("title", "title-rest"))
    assert f"{title.get_text()} {rest.get_text()}" == result.title
    result.title = "Four-bar"
    assert not with_gid(md.plot(result), "title-rest")


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


def test_unknown_kinds():
    with pytest.raises(md.UnavailableError, match=r"md\.page"):
        md.plot(None, "page")
    with pytest.raises(md.UnknownName, match="diagram"):
        md.plot(None, "diagramm")


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_files_are_the_same_each_time(tmp_path, ending):
    first = save(md.plot(seven_link()), tmp_path / f"a.{ending}")
    second = save(md.plot(seven_link()).get_figure(), tmp_path / f"b.{ending}")
    assert first.read_bytes() == second.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_unknown_format_leaves_nothing(tmp_path):
    with pytest.raises(md.InputError, match="docx"):
        save(md.plot(seven_link()), tmp_path / "a.docx")
    assert not list(tmp_path.iterdir())


def test_result_without_poses_and_spatial_mechanisms_are_refused():
    empty = seven_link()
    empty.status = np.array([])
    with pytest.raises(md.InputError, match="no pose"):
        md.plot(empty)
    spatial = SimpleNamespace(mechanism=SimpleNamespace(dimension=3), status=["ok"])
    with pytest.raises(md.UnavailableError):
        md.plot(spatial)


def test_no_pyplot_and_lazy_import():
    code = (
        "import sys, mechdae.draw; assert 'matplotlib' not in sys.modules;"
        "import mechdae.draw.diagram.diagram; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
