"""Plans: closed polygons, read back with a ruler, of values computed elsewhere."""

import re
import warnings
from dataclasses import replace
from functools import cache
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.draw import save
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.plans.board import CLOSED, round_up
from mechdae.draw.plans.forces import force_plans
from mechdae.draw.plans.lever import lever, pins_of
from mechdae.draw.plans.relations import motion_plan
from mechdae.results import Named, Series
from tests.shared.predefined import predefined

MILLIMETRE = 72 / 25.4
FEW = 7
PRINTED = 2e-6
"""Rounding of a length in the SVG [pt], which has six decimals."""


@cache
def solved(name, task, poses=None):
    return md.solve(predefined(name), task, poses=poses)


@cache
def friction():
    """Crank at 60 degrees; the expected values are those of the problem file."""
    return solved("slider-crank-friction", "cycle", FEW)


class Ruler:
    """Reads an SVG: lines of groups by their id in millimetres, and the scales in its texts."""

    def __init__(self, picture, folder):
        self.path = save(picture, folder / "plan.svg")
        self.groups = {
            entry.get("id"): entry
            for entry in ElementTree.parse(self.path).iter()
            if entry.tag.endswith("}g") and entry.get("id")
        }
        found = re.findall(r"<!-- (.*?) -->", self.path.read_text(encoding="utf-8"))
        self.scales = {
            symbol: float(number)
            for text in found
            for symbol, number in re.findall(r"\$\\mu_(\w)\$ = ([\d.e+-]+) ", text)
        }

    def points(self, gid):
        """Return the corners of a path [mm], y up."""
        path = next(entry for entry in self.groups[gid].iter() if entry.tag.endswith("}path"))
        numbers = re.findall(r"[-\d.]+", path.get("d"))
        return np.array(numbers, dtype=float).reshape(-1, 2) * (1, -1) / MILLIMETRE

    def line(self, gid):
        """Return the ends of a line [mm]."""
        return self.points(gid)[[0, -1]]

    def circle(self, gid):
        """Return centre and radius of a circle [mm]."""
        low, high = self.points(gid).min(axis=0), self.points(gid).max(axis=0)
        return (low + high) / 2, (high - low)[0] / 2

    def vector(self, gid, symbol):
        """Return a vector in its unit."""
        start, end = self.line(gid)
        return (end - start) * self.scales[symbol]

    def error(self, symbol):
        return PRINTED / MILLIMETRE * self.scales[symbol]


def test_a_velocity_plan_is_read_with_a_ruler(tmp_path):
    ruler = Ruler(
        md.plot(solved("gorshkov-seven-link", "pose"), "plans", which="velocity"), tmp_path
    )
    # Newton on the loop equations, 40 digits
    for gid, value in {
        "velocity-rod.B": [0.7384832042519739, -0.1737443748209195],
        "velocity-connecting_rod.C": [0.89295941063105475, 0.0],
        "velocity-rocker.E": [0.83709889334540402, 0.47144018914312721],
    }.items():
        assert ruler.vector(gid, "v") == pytest.approx(value, abs=ruler.error("v"))
    for gid, size in {
        "velocity-slot-sliding": 0.428639827106,
        "velocity-connecting_rod.C-connecting_rod.B-relative": 0.232486571912,
        "velocity-coupler.E-coupler.B-relative": 0.652677696657,
    }.items():
        length = np.hypot(*ruler.vector(gid, "v"))
        assert length == pytest.approx(size, abs=ruler.error("v")), gid


def test_an_acceleration_plan_is_read_with_a_ruler(tmp_path):
    axes = md.plot(solved("gorshkov-seven-link", "pose"), "plans", which="acceleration")
    ruler = Ruler(axes, tmp_path)
    assert ruler.vector("acceleration-rocker.E", "a") == pytest.approx(
        [-2.9815821136288767, -5.1949428714182643], abs=ruler.error("a")
    )
    sizes = {  # 40 digits, shown to 12
        "acceleration-slot-coriolis": 0.779635856032,
        "acceleration-slot-sliding": 1.65688237592,
        "acceleration-slot-rod.G-normal": 0.487553619369,
        "acceleration-slot-rod.G-tangential": 0.934923452394,
        "acceleration-connecting_rod.C-connecting_rod.B-normal": 0.104363788606,
        "acceleration-connecting_rod.C-connecting_rod.B-tangential": 0.400438836986,
        "acceleration-coupler.E-coupler.B-normal": 0.788866992061,
        "acceleration-coupler.E-coupler.B-tangential": 5.00296800999,
        "acceleration-rocker.E-rocker.F-normal": 3.06336013667,
        "acceleration-rocker.E-rocker.F-tangential": 5.14714367496,
    }
    for gid, size in sizes.items():
        length = np.hypot(*ruler.vector(gid, "a"))
        assert length == pytest.approx(size, abs=ruler.error("a")), gid
    # v_A3A2 points to A3 from A2: the step of Coriolis is 2 omega x v, at 346.76 degrees
    angle = np.degrees(np.arctan2(*ruler.vector("acceleration-slot-coriolis", "a")[::-1])) % 360
    assert angle == pytest.approx(346.760684213, abs=1e-4)


def test_steps_of_a_chain_lie_tip_to_tail(tmp_path):
    axes = md.plot(solved("gorshkov-seven-link", "pose"), "plans", which="acceleration")
    ruler = Ruler(axes, tmp_path)
    chain = ["acceleration-crank.A", "acceleration-slot-coriolis", "acceleration-slot-sliding"]
    lines = [ruler.line(gid) for gid in chain]
    for before, after in pairwise(lines):
        assert before[1] == pytest.approx(after[0], abs=PRINTED)
    other = ruler.line("acceleration-slot-rod.G-tangential")
    assert lines[-1][1] == pytest.approx(other[1], abs=PRINTED)


# -- all problems ------------------------------------------------------------------------------


def suitable():
    """Return problem and task: of every problem the first with forces, or a sweep, if any."""
    found = []
    for name in library.names():
        if predefined(name).mechanism.dimension == 3 or name == "vector-modules-planar":
            continue  # of these modules nothing moves
        tasks = predefined(name).tasks
        kinds = [
            [task for task, entry in tasks.items() if entry.kind == kind]
            for kind in ("reactions", "sweep")
        ]
        found += [(name, task) for task in [*kinds[0], *kinds[1]][:1]]
    return found


SUITABLE = suitable()


@pytest.mark.parametrize(("name", "task"), SUITABLE, ids=[name for name, _ in SUITABLE])
def test_plans_of_all_problems_close(name, task):
    definition = predefined(name).task(task)
    result = solved(name, task, FEW if definition.all_drivers[0].at is None else None)
    scene, drawn = read_scene(result), 0
    poses = [pose for pose, status in enumerate(result.status) if status == "ok"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for pose in poses[len(poses) // 3 :][:2]:
            plans = [
                motion_plan(result, scene, pose, word) for word in ("velocity", "acceleration")
            ]
            plans += force_plans(result, scene, pose) if result.kind == "reactions" else []
            for plan in plans:
                assert plan.gap <= CLOSED * plan.size, (plan.word, pose)
                drawn += len(plan.arrows)
    assert drawn > 0


PAGES = [
    ("gorshkov-seven-link", "window"),
    ("cam-roller-follower", "turn"),
    ("slider-crank-inertia", "cycle"),
]


@pytest.mark.parametrize(("name", "task"), PAGES, ids=str)
def test_pages_are_the_same_each_time(tmp_path, name, task):
    result = solved(name, task, FEW)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        first, second = (
            save(md.plot(result, "plans"), tmp_path / f"{word}.svg").read_bytes() for word in "ab"
        )
    assert first == second
    assert first.count(b"-scale") >= 3


# -- forces ------------------------------------------------------------------------------------


def test_a_force_polygon_is_read_with_a_ruler(tmp_path):
    axes = md.plot(friction(), "plans", pose=1, which="force", group="II.2 RRP(2,3)")
    ruler = Ruler(axes, tmp_path)
    # the load is 1000 N against the motion, the others are Newton-Euler equations in 30 digits
    expected = {
        "force-1-slider-load": [1000.0, 0.0],
        "force-1-slider-slide": [38.712411299545931, -322.60342749621609],
        "force-1-rod-B": [-1038.7124112995459, 322.60342749621609],
    }
    for gid, value in expected.items():
        assert ruler.vector(gid, "F") == pytest.approx(value, abs=ruler.error("F")), gid
    ends = [ruler.line(gid) for gid in expected]
    assert ends[-1][1] == pytest.approx(ends[0][0], abs=PRINTED)
    assert ends[0][1] == pytest.approx(ends[1][0], abs=PRINTED)


def test_reactions_touch_the_friction_circle(tmp_path):
    ruler = Ruler(md.plot(friction(), "plans", pose=1, which="friction"), tmp_path)
    pins = pins_of(friction(), read_scene(friction()), 1)
    for pin, r in zip(pins, (0.020, 0.015, 0.010), strict=True):
        radius = r * np.sin(np.arctan(0.1))
        assert np.hypot(*pin.foot) == pytest.approx(radius, rel=1e-9)
        # the moment of the reaction on the second body works against its turning
        assert np.sign(pin.foot[0] * pin.force[1] - pin.foot[1] * pin.force[0]) == -np.sign(
            pin.spin
        )
        start, end = ruler.line(f"friction-{pin.joint}-line")
        force = ruler.line(f"friction-{pin.joint}-force")
        along = (end - start) / np.hypot(*(end - start))
        # the arrow lies on the line, which is as far from the centre as the circle is wide
        for place in force:
            offset = place - start
            assert offset[0] * along[1] - offset[1] * along[0] == pytest.approx(0.0, abs=1e-5)
        centre, circle = ruler.circle(f"friction-{pin.joint}-circle")
        offset = centre - start
        distance = abs(offset[0] * along[1] - offset[1] * along[0])
        assert distance == pytest.approx(circle, abs=1e-5)


def test_letters_keep_off_lines_of_action():
    axes = md.plot(friction(), "plans", pose=1, which="friction")
    figure = axes.get_figure(root=True)
    figure.draw_without_rendering()
    diagram = figure.axes[1]
    lines = [own for own in diagram.lines if str(own.get_gid()).startswith("friction-line")]
    tracks = [own.get_path().transformed(own.get_transform()) for own in lines]
    letters = [own for own in diagram.texts if str(own.get_gid()).startswith("label-")]
    assert len(tracks) == len(pins_of(friction(), read_scene(friction()), 1)) == 3
    assert {"O", "B", "C"} <= {own.get_text() for own in letters}
    for own in letters:
        box = own.get_window_extent()
        assert not any(track.intersects_bbox(box, filled=False) for track in tracks), own


def test_moments_on_the_lever_are_powers(tmp_path):
    ruler = Ruler(md.plot(friction(), "plans", pose=1, which="lever"), tmp_path)
    pole = ruler.line("lever-crank.B")[0]
    power = {}
    for gid in ("lever-load-slider", "lever-drive-crank-crank.angle-end"):
        start, end = ruler.line(gid)
        arm, force = (start - pole) * ruler.scales["v"], (end - start) * ruler.scales["F"]
        power[gid] = arm[0] * force[1] - arm[1] * force[0]
    # torque 109.87320990514 N m at 10 rad/s, losses of the four joints: see the problem file
    assert power["lever-drive-crank-crank.angle-end"] == pytest.approx(1098.7320990514, rel=1e-6)
    losses = 21.645171366683115 + 19.059834045716025 + 1.8839703471357926 + 39.362047218545281
    assert sum(power.values()) == pytest.approx(losses, rel=1e-5)


LEVERS = [
    ("four-stroke-engine", "cycle"),
    ("quick-return-friction", "cycle"),
    ("quick-return-pin", "cycle"),
    ("toggle-press", "cycle"),
    ("slider-crank-inertia", "cycle"),
]


@pytest.mark.parametrize(("name", "task"), LEVERS, ids=str)
def test_the_lever_is_in_balance(name, task):
    result = solved(name, task, FEW)
    for pose in (1, 2, 4):
        found = lever(result, read_scene(result), pose)
        assert found.size > 0
        assert abs(found.rest) <= 1e-9 * found.size


def test_levers_with_wheels_are_refused():
    result = solved("spur-gears-idler", "cycle", FEW)
    with pytest.raises(md.UnavailableError, match="mesh12"):
        md.plot(result, "plans", which="lever")


# -- scales, wishes, faults --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (0.0051, 0.01),
        (0.005, 0.005),
        (1.0, 1.0),
        (1.0001, 1.5),
        (2.1, 2.5),
        (0.2, 0.2),
        (7e5, 1e6),
        (3e-9, 4e-9),
        (4.1e-9, 5e-9),
    ],
)
def test_scales_are_round(number, expected):
    assert round_up(number) == expected


def test_a_scale_can_be_given(tmp_path):
    result = solved("gorshkov-seven-link", "pose")
    axes = md.plot(result, "plans", which="velocity", scale=0.025)
    ruler = Ruler(axes, tmp_path)
    assert ruler.scales == {"v": 0.025}
    assert np.hypot(*np.diff(ruler.line("velocity-crank.A"), axis=0)[0]) == pytest.approx(
        0.6864 / 0.025, abs=PRINTED
    )
    with pytest.raises(md.InputError, match="several scales"):
        md.plot(result, "plans", scale=0.02)
    with pytest.raises(md.InputError, match="velocity plan is 0"):
        md.plot(result, "plans", which="velocity", scale=0)
    with pytest.raises(md.UnknownName, match="velocity"):
        md.plot(result, "plans", scale={"velocities": 0.02})


def test_a_page_has_its_scales(tmp_path):
    result = solved("gorshkov-seven-link", "pose")
    ruler = Ruler(md.plot(result, "plans", scale={"velocity": 0.05, "acceleration": 0.2}), tmp_path)
    assert ruler.scales == {"l": 0.01, "v": 0.05, "a": 0.2}
    # the crank is 0.1716 m long, its pin 0.6864 m/s fast: on the diagram and on the plan
    assert ruler.scales["v"] * np.hypot(*np.diff(ruler.line("velocity-crank.A"), axis=0)[0]) == (
        pytest.approx(0.6864, abs=ruler.error("v"))
    )
    pins = [ruler.circle(gid)[0] for gid in ("joint-O-pin", "joint-A-pin")]
    assert np.hypot(*(pins[1] - pins[0])) * 0.01 == pytest.approx(0.1716, abs=ruler.error("l"))


def test_a_plan_that_does_not_close_says_so():
    result = solved("four-bar-crank-rocker", "turn", FEW)
    moved = {name: dict(series) for name, series in result.points.items()}
    moved["rocker.C"]["velocity"] = moved["rocker.C"]["velocity"] * 1.001
    spoilt = replace(result, points=Named("point", {k: Series(v) for k, v in moved.items()}))
    for given, notes in ((result, 0), (spoilt, 1)):
        axes = md.plot(given, "plans", pose=2, which="velocity")
        assert len([a for a in axes.texts if a.get_gid() == "velocity-gap"]) == notes


def test_what_has_no_plans():
    sweep = solved("gorshkov-seven-link", "pose")
    with pytest.raises(md.InputError, match="no forces"):
        md.plot(sweep, "plans", which="force")
    with pytest.raises(md.UnknownName, match="velocity"):
        md.plot(sweep, "plans", which="velocities")
    with pytest.raises(md.UnknownName, match="RRP"):
        md.plot(friction(), "plans", pose=1, which="force", group="II.2 RRP(2,4)")
    with pytest.raises(md.InputError, match="kind modes"):
        md.plot(solved("gorshkov-seven-link", "modes"), "plans")
    with pytest.raises(md.InputError, match="friction"):
        md.plot(solved("four-stroke-engine", "shares", FEW), "plans", which="friction")
    window = solved("gorshkov-seven-link", "window", FEW)
    assert window.status[0] == "limit"  # velocities are infinite there
    with pytest.raises(md.InputError, match="pose 0 has no rates"):
        md.plot(window, "plans", pose=0)


def test_vectors_that_are_looked_for_have_names():
    """The Coriolis acceleration and the normal ones, down to half of an arrow's head."""
    axes = md.plot("whitworth-quick-return", "plans", which="acceleration", pose=20)
    axes = axes[0] if isinstance(axes, (list, tuple)) else axes
    figure = axes.get_figure(root=True)
    gids = {str(own.get_gid()) for panel in figure.axes for own in (*panel.lines, *panel.texts)}
    arrows = {gid for gid in gids if gid.endswith(("-coriolis", "-normal"))}
    assert any(gid.endswith("-coriolis") for gid in arrows)
    assert len(arrows) > 2
    assert {f"{gid}-name" for gid in arrows} <= gids
