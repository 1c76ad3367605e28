"""URDF and SDF: loops close at 200 poses, polynomials stay within the errors that are stated."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.exchange.robots.link_frames import of_quaternion, turned
from mechdae.parts.exchange.robots.link_tree import link_tree
from mechdae.parts.exchange.robots.mimic import NotProved, mimics
from mechdae.parts.exchange.robots.sdf import sdf
from mechdae.parts.exchange.robots.urdf import urdf
from mechdae.tasks.motion_of import motion_of
from tests.shared.exports import GRAVITY, block, coordinate, in_space, keep_for, motion, rows
from tests.shared.paths import DATA

CLOSURE = 1e-9
EXCAVATOR = str(DATA / "excavator-massless-cylinders.toml")


def test_drivers_have_actuators_in_all_formats() -> None:
    """A block of 3 kg on a guide moves 3 kg: its spring is 3 w^2, w = 200 rad/s."""
    texts = {form: md.export(block(), format=form).text for form in ("mjcf", "sdf", "urdf")}
    roots = {form: ET.fromstring(text) for form, text in texts.items()}
    spring = roots["mjcf"].find("actuator/position")
    assert spring is not None
    assert float(spring.get("kp", 0)) == pytest.approx(3 * 200**2, rel=1e-12)
    assert float(spring.get("kv", 0)) == pytest.approx(2 * 3 * 200, rel=1e-12)
    low, high = (float(word) for word in spring.get("ctrlrange", "").split())
    assert (low, high) == pytest.approx((0.19, 0.41), rel=1e-9)
    joint = roots["mjcf"].find(".//joint[@armature]")
    assert joint is not None
    assert float(joint.get("armature", 0)) == pytest.approx(0.12, rel=1e-12)  # 3 (200 / 1000)^2
    key = roots["mjcf"].find("keyframe/key")
    assert key is not None
    assert float(key.get("ctrl", 0)) == pytest.approx(0.2, rel=1e-12)
    plugin = roots["sdf"].find("model/plugin")
    assert plugin is not None
    assert plugin.findtext("joint_name") == "guide"
    assert float(plugin.findtext("p_gain") or 0) == pytest.approx(3 * 200**2, rel=1e-12)
    limits = [float(roots["sdf"].findtext(f".//axis/limit/{e}") or 0) for e in ("lower", "upper")]
    assert limits == pytest.approx([-0.01, 0.21], rel=1e-9)
    given = {e.get("name"): float(e.text or 0) for e in roots["urdf"].iterfind(".//param")}
    assert given == pytest.approx({"min": 0.19, "max": 0.41, "initial_value": 0.2}, rel=1e-9)


# -- URDF by a reader of others --------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    ["gorshkov-seven-link", "geared-five-bar", "quick-return-pin", "rack-and-pinion",
     "double-cardan", "bennett"],
)  # fmt: skip
def test_urdf_closes_at_200_poses(name: str, tmp_path) -> None:
    yourdfpy = pytest.importorskip("yourdfpy", reason="the extra exchange is not installed")
    path = tmp_path / "robot.urdf"
    written = md.export(name, format="urdf").save(path)
    assert [own.name for own in written] == ["robot.urdf", "robot.urdf.loops.json"]
    side = json.loads(written[1].read_text())
    robot = yourdfpy.URDF.load(str(path), load_meshes=False)
    result, tree = motion(name).result, link_tree(motion(name))
    joints = {own["joint"]: word for word, own in side["coordinates"].items()}
    assert set(robot.joint_names) == set(joints)
    for row in rows(name):
        value = {joint: coordinate(result, word, row) for joint, word in joints.items()}
        robot.update_cfg({joint: value[joint] for joint in robot.actuated_joint_names})
        place = {link: robot.get_transform(link, "ground") for link in robot.link_map}
        for loop in side["loops"]:
            ends = [
                place[loop[end]["link"]] @ np.array([*loop[end]["xyz"], 1.0])
                for end in ("first", "second")
            ]
            gap = (ends[1] - ends[0])[:3]
            for freedom in loop["freedoms"]:
                axis = place[loop["first"]["link"]][:3, :3] @ np.array(freedom["axis_first"])
                gap = gap - axis * (axis @ gap) if freedom["kind"] == "slide" else gap
            assert np.abs(gap).max() <= CLOSURE, (loop["joint"], row)
        for link in tree.links.values():
            for point, local in link.points.items():
                reference = f"{link.name}.{point}"
                if reference in result.points:
                    there = place[link.name] @ np.array([*local, 1.0])
                    known = in_space(result.points[reference].position[row])
                    assert np.abs(there[:3] - known).max() <= CLOSURE, (reference, row)


def test_mimic_elements_only_where_a_line_is_exact() -> None:
    root = ET.fromstring(md.export("spur-gears-idler", format="urdf").text)
    found = {own.get("name"): own.find("mimic") for own in root.iter("joint")}
    lines = {name: own for name, own in found.items() if own is not None}
    assert (len(lines), len(found)) == (2, 3)
    ratios = sorted(float(own.get("multiplier")) for own in lines.values())
    values = md.load("spur-gears-idler").mechanism
    teeth = [joint.turn_ratio(values.values()) for joint in values.joints.values() if joint.meshes]
    assert ratios[0] == pytest.approx(1 / teeth[0], rel=1e-12)
    assert ratios[1] == pytest.approx(1 / (teeth[0] * teeth[1]), rel=1e-12)
    text = md.export("four-bar-crank-rocker", format="urdf").text
    assert "<mimic" not in text


# -- polynomials -----------------------------------------------------------------------------------


def test_error_is_that_of_the_closed_form() -> None:
    """Crank r, rod l in line with the guide: rod angle -asin(r sin phi / l)."""
    values = md.load("slider-crank").mechanism.values()
    r, rod = values["r"], values["l"]
    for tolerance in (1e-2, 1e-5, 1e-9):
        found = mimics(motion("slider-crank"), ["B.angle"], tolerance, 1.0)
        assert (found.low, found.high) == (0.0, 2 * np.pi)
        phi = np.linspace(0, 2 * np.pi, 20001)
        own = found.polynomials["B.angle"]
        error = np.abs(own.at(phi, found.low, found.high) + np.arcsin(r * np.sin(phi) / rod) + phi)
        assert error.max() <= own.error <= 1.02 * error.max() + 1e-11
        assert own.error <= tolerance


@pytest.mark.parametrize("name", ["gorshkov-seven-link", "jansen-leg", "rssr", "geared-five-bar"])
def test_error_holds_between_the_samples(name: str) -> None:
    own = motion(name)
    words = [m.coordinate for m in link_tree(own).motions() if m.kind != "ball"]
    found = mimics(own, words, 1e-6, own.mechanism.scale)
    s = np.sort(np.random.default_rng(7).uniform(found.low, found.high, 200))
    driver = next(iter(own.result.drivers))
    sweep = md.Sweep(driver=md.Driver(driver, at=tuple(s.tolist())))
    result = md.solve(own.problem, sweep)
    assert set(result.status) == {"ok"}
    for word in words:
        joint, _, quantity = word.partition(".")
        polynomial = found.polynomials[word]
        values = np.asarray(result.joints[joint][quantity])
        error = np.abs(polynomial.at(s, found.low, found.high) - values).max()
        assert error <= polynomial.error <= 1.1e-6 * max(1.0, own.mechanism.scale), word
        assert error >= 0.3 * polynomial.error or polynomial.error < 1e-9, word


def test_a_range_to_limit_positions_stops_short_of_them() -> None:
    found = mimics(motion("four-bar-double-rocker"), ["A.angle"], 1e-6, 1.0)
    low, high = motion("four-bar-double-rocker").result.summary["limits"]
    share = (found.low - low) / (high - low), (high - found.high) / (high - low)
    assert share == pytest.approx((0.02, 0.02), rel=1e-6)


def test_nothing_is_claimed_that_is_not_proved() -> None:
    with pytest.raises(NotProved):
        mimics(motion("bennett"), ["P.angle"], 1e-6, 1.0)
    side = json.loads(md.export("bennett", format="urdf").files[".loops.json"])
    assert side["mimic"] is None
    assert "no step is proved" in side["why_no_mimic"]


# -- SDF -------------------------------------------------------------------------------------------


def pose_of(element: ET.Element) -> np.ndarray:
    """Return the matrix (4, 4) of a pose element."""
    found = np.eye(4)
    own = element.find("pose")
    if own is None:
        return found
    numbers = [float(word) for word in own.text.split()]
    found[:3, 3] = numbers[:3]
    if own.get("rotation_format") == "quat_xyzw":
        x, y, z, w = numbers[3:]
        found[:3, :3] = of_quaternion(np.array([w, x, y, z]))
    return found


def sdf_links(root: ET.Element, values: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the poses of links when joints have turned from the pose of the file.

    The tree is that of joints whose values are given.
    """
    model = root.find("model")
    home = {own.get("name"): pose_of(own) for own in model.iter("link")} | {"world": np.eye(4)}
    found = {"world": np.eye(4)}
    joints = [own for own in model.findall("joint") if own.get("name") in values]
    while len(found) <= len(joints):
        before = len(found)
        for joint in joints:
            parent, child = joint.find("parent").text, joint.find("child").text
            if parent in found and child not in found:
                value, move = values[joint.get("name")], np.eye(4)
                at = home[child] @ pose_of(joint)
                if joint.get("type") != "fixed":
                    axis = np.array([float(w) for w in joint.find("axis/xyz").text.split()])
                    if joint.get("type") == "prismatic":
                        move[:3, 3] = axis * value
                    else:
                        move[:3, :3] = turned(axis, value)
                    assert np.linalg.norm(axis) == pytest.approx(1, abs=1e-12)
                # the child as it was, moved in the joint's frame, carried with the parent
                own = at @ move @ np.linalg.inv(at) @ home[child]
                found[child] = found[parent] @ np.linalg.inv(home[parent]) @ own
        assert len(found) > before
    return found


@pytest.mark.parametrize("name", ["gorshkov-seven-link", "quick-return-pin", "double-cardan"])
def test_sdf_closes_at_200_poses(name: str) -> None:
    root = ET.fromstring(md.export(name, format="sdf").text)
    tree, result = link_tree(motion(name)), motion(name).result
    for row in rows(name):
        values = {}
        for edge in tree.edges.values():
            for own in edge.motions:
                word = own.coordinate if len(edge.motions) > 1 else own.coordinate.split(".")[0]
                moved = coordinate(result, own.coordinate, row) - own.start
                values[word.replace(".", "_")] = moved
        found = sdf_links(root, values)
        for link in tree.links.values():
            for point, local in link.points.items():
                reference = f"{link.name}.{point}"
                if reference in result.points:
                    there = found[link.name] @ np.array([*local, 1.0])
                    known = in_space(result.points[reference].position[row])
                    assert np.abs(there[:3] - known).max() <= CLOSURE, (reference, row)


def test_sdf_joints_meet_in_the_pose_of_the_file() -> None:
    """Each joint's place, in the child's frame, is where mechdae has the points of the joint."""
    for name in ("gorshkov-seven-link", "car-axis", "rssr"):
        root = ET.fromstring(md.export(name, format="sdf").text)
        own = motion(name)
        model = root.find("model")
        home = {link.get("name"): pose_of(link) for link in model.iter("link")}
        for joint in model.findall("joint"):
            if joint.get("name") not in own.mechanism.joints or joint.get("type") == "prismatic":
                continue
            at = home[joint.find("child").text] @ pose_of(joint)
            described = own.mechanism.joints[joint.get("name")]
            body = next(p for p in (described.first, described.second) if p in own.result.points)
            place = in_space(own.result.points[body].position[own.first])
            assert np.abs(at[:3, 3] - place).max() <= CLOSURE
        names = [link.get("name") for link in model.iter("link")]
        assert len(names) == len(set(names))


def test_sdf_gears_have_the_sign_of_the_format() -> None:
    """theta2 = -gearbox_ratio theta1, angles from the reference body."""
    root = ET.fromstring(md.export("geared-five-bar", format="sdf").text)
    (gear,) = [own for own in root.iter("joint") if own.get("type") == "gearbox"]
    ratio = float(gear.find("gearbox_ratio").text)
    result = motion("geared-five-bar").result
    carrier = result.bodies[gear.find("gearbox_reference_body").text].angle
    one = result.bodies[gear.find("parent").text].angle - carrier
    two = result.bodies[gear.find("child").text].angle - carrier
    change = (two - two[0]) + ratio * (one - one[0])
    assert np.abs(change).max() <= CLOSURE


# -- weights ---------------------------------------------------------------------------------------


def sdf_weights(text: str, values: dict[str, float]) -> dict[str, tuple[float, np.ndarray]]:
    """Return masses of links and places of their centres, parts between links by their joints."""
    root = ET.fromstring(text)
    found = {}
    for name, place in sdf_links(root, values).items():
        link = next((own for own in root.iter("link") if own.get("name") == name), None)
        if link is not None:
            own = link.find("inertial")
            there = place @ pose_of(own)
            found[name] = (float(own.find("mass").text), there[:3, 3])
    return found


def urdf_weights(text: str, values: dict[str, float]) -> dict[str, tuple[float, np.ndarray]]:
    """Return what `sdf_weights` does, by a reader of others."""
    yourdfpy = pytest.importorskip("yourdfpy", reason="the extra exchange is not installed")
    robot = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
    robot.update_cfg({joint: values[joint] for joint in robot.actuated_joint_names})
    found = {}
    for name, link in robot.link_map.items():
        if link.inertial is not None:
            place = robot.get_transform(name, "ground") @ link.inertial.origin
            found[name] = (float(link.inertial.mass), place[:3, 3])
    return found


READERS = {"sdf": sdf_weights, "urdf": urdf_weights}
WRITTEN = {"sdf": sdf, "urdf": urdf}


@pytest.mark.parametrize("form", READERS)
@pytest.mark.parametrize(
    "name",
    ["balanced-four-bar", "toggle-four-bar", EXCAVATOR],
)
def test_weights_of_a_file_are_held_by_the_efforts_of_mechdae(name: str, form: str) -> None:
    """Slopes of the potential energy of the links of a file, by each driver."""
    given = motion(name, "forward" if "excavator" in name else None)
    start = {
        word: float(own.position[given.first + 1]) for word, own in given.result.drivers.items()
    }
    for word in start:
        step = 1e-4 * (1.0 if "angle" in word else given.mechanism.scale)
        moves = [
            md.Driver(key, at=[at + k * step * (key == word) for k in (0, -1, 1)])
            for key, at in start.items()
        ]
        near = given.problem.with_task("near", md.Sweep(drivers=moves))
        whole = motion_of(near, "near")
        assert set(whole.result.status) == {"ok"}
        tree = link_tree(whole)
        text = WRITTEN[form](whole)[""]
        energies, first = [], {}
        for row in range(3):
            values = {}
            for edge in tree.edges.values():
                for own in edge.motions:
                    joint = own.coordinate.replace(".", "_")
                    joint = joint if len(edge.motions) > 1 else edge.joint
                    moved = coordinate(whole.result, own.coordinate, row)
                    values[joint] = moved - (own.start if form == "sdf" else 0.0)
            found = READERS[form](text, values)
            first = first or found
            energies.append(sum(-GRAVITY[1] * mass * place[1] for mass, place in found.values()))
        slope = (energies[2] - energies[1]) / (2 * step)
        (known,) = keep_for(whole, first, 0, start)[[*start].index(word)].reshape(1)
        weight = -GRAVITY[1] * sum(mass for mass, _ in first.values()) * given.mechanism.scale
        assert abs(slope - known) <= 1e-6 * weight, (word, slope, known)


def test_a_body_without_mass_gets_a_share_of_its_neighbour() -> None:
    text = sdf(motion(EXCAVATOR, "forward"))[""]
    assert "assumed for rod1: mass 2.4 kg" in text
    assert "0.002 of boom's mass" in text


# -- refused ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "form", "words"),
    [
        ("cam-roller-follower", "mjcf", "joints.profile: a curve joint"),
        ("rssr", "urdf", "joints.B: URDF has no joint for a ball joint"),
        ("delta-robot", "urdf", "URDF has no joint for a body that only bars hold"),
        ("rack-and-pinion", "sdf", "SDFormat has no rack"),
        ("screw-press", "sdf", "screws differ"),
        ("c1-line6-free", "mjcf", "no task with poses along a path"),
    ],
)
def test_what_a_format_cannot_hold_is_refused_by_name(name: str, form: str, words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        md.export(name, format=form)


def test_loads_that_are_left_out_are_named() -> None:
    text = md.export("slider-crank-friction", format="mjcf").text
    assert "not in this file: load work, friction in O, friction in B" in text


def test_limits_of_joints_are_carried() -> None:
    """MuJoCo and URDF count as mechdae does, SDFormat from its pose; loops hold none."""
    problem = md.load("four-bar-crank-rocker")
    joints = problem.mechanism.joints
    for name, limits in (("D", (0.5, 2.5)), ("A", (-1.0, 9.0)), ("B", (-4.0, 4.0)), ("C", (-3, 3))):
        gap = {"clearance": 1e-4, "restitution": 0.5} if name == "B" else {}
        pin = md.Revolute(name, joints[name].first, joints[name].second, limits=limits, **gap)
        joints = joints.with_(name, pin)
    problem = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    texts = {form: md.export(problem, "turn", format=form).text for form in ("mjcf", "sdf", "urdf")}
    roots = {form: ET.fromstring(text) for form, text in texts.items()}
    joint = roots["mjcf"].find(".//joint[@name='B.angle']")
    assert joint is not None
    assert joint.get("range") == "-4 4"
    limit = roots["urdf"].find("joint[@name='B']/limit")
    assert limit is not None
    assert (limit.get("lower"), limit.get("upper")) == ("-4", "4")
    start = float(joint.get("ref", 0))
    path = "model/joint[@name='B']/axis/limit"
    ends = [float(roots["sdf"].findtext(f"{path}/{end}") or 0) for end in ("lower", "upper")]
    assert ends == pytest.approx([-4.0 - start, 4.0 - start], rel=1e-12)
    left = [
        name for name in "ABCD" if roots["mjcf"].find(f".//joint[@name='{name}.angle']") is None
    ]
    assert f"not in this file: limits of {left[0]}: loops hold none" in texts["mjcf"]
    assert "limits of" not in texts["sdf"]
    assert all("not in this file: restitution of B, gap of B" in text for text in texts.values())
