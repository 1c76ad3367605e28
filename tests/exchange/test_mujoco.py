"""MJCF read by MuJoCo itself: at poses of mechdae its equalities hold and its sites are there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.parts.exchange.robots.link_frames import quaternion
from mechdae.parts.exchange.robots.mjcf import mjcf
from mechdae.tasks.motion_of import motion_of
from tests.shared.exports import GRAVITY, coordinate, in_space, keep_for, motion, rows
from tests.shared.paths import DATA

mujoco = pytest.importorskip("mujoco", reason="the extra exchange is not installed")

CLOSURE = 1e-9
SAMPLE = (
    "gorshkov-seven-link",
    "geared-five-bar",
    "quick-return-pin",
    "rack-and-pinion",
    "planetary-gear-train",
    "car-axis",
    "five-crank-parallelogram",
    "screw-press",
    "cardan-joint",
    "bennett",
)


def read(name: str):
    model = mujoco.MjModel.from_xml_string(md.export(name, format="mjcf").text)
    return model, mujoco.MjData(model)


def gaps(model, data) -> tuple[float, float]:
    """Return the largest residual of the equalities, and of sites from the points called so."""
    mujoco.mj_forward(model, data)
    return float(np.abs(data.efc_pos[: data.ne]).max(initial=0.0))


@pytest.mark.parametrize("name", SAMPLE)
def test_equalities_hold_at_200_poses(name: str) -> None:
    model, data = read(name)
    result = motion(name).result
    chosen = rows(name)
    assert model.neq or model.nq == 0 or name == "car-axis"
    placed = 0
    for row in chosen:
        for j in range(model.njnt):
            word = model.joint(j).name
            data.qpos[model.jnt_qposadr[j]] = coordinate(result, word, row)
        assert gaps(model, data) <= CLOSURE
        for s in range(model.nsite):
            point = model.site(s).name
            if point in result.points:
                place = in_space(result.points[point].position[row])
                assert np.abs(data.site_xpos[s] - place).max() <= CLOSURE, (name, row, point)
                placed += 1
    assert placed >= len(chosen) * min(3, len(result.points))


def test_a_wrong_pose_is_seen() -> None:
    model, data = read("gorshkov-seven-link")
    row = rows("gorshkov-seven-link")[5]
    for j in range(model.njnt):
        word = model.joint(j).name
        value = coordinate(motion("gorshkov-seven-link").result, word, row)
        data.qpos[model.jnt_qposadr[j]] = value + (1e-6 if word == "O.angle" else 0.0)
    assert gaps(model, data) > 1e-8


def test_the_model_stands_assembled() -> None:
    for name in ("rssr", "delta-robot", "gorshkov-seven-link"):
        model, data = read(name)
        assert gaps(model, data) <= CLOSURE
        result, row = motion(name).result, motion(name).first
        for s in range(model.nsite):
            point = model.site(s).name
            if point in result.points:
                place = in_space(result.points[point].position[row])
                assert np.abs(data.site_xpos[s] - place).max() <= CLOSURE


def test_ball_joints_at_200_poses() -> None:
    """The bar of the RSSR hangs on a ball: its turn follows from its two points."""
    model, data = read("rssr")
    result = motion("rssr").result
    ball = next(j for j in range(model.njnt) if model.joint(j).name == "B.ball")
    at = model.jnt_qposadr[ball]
    body = model.body("bar").id
    for row in rows("rssr"):
        data.qpos[model.jnt_qposadr[model.joint("A.angle").id]] = result.joints["A"].angle[row]
        data.qpos[model.jnt_qposadr[model.joint("D.angle").id]] = result.joints["D"].angle[row]
        data.qpos[at : at + 4] = (1, 0, 0, 0)
        mujoco.mj_kinematics(model, data)
        # turn the bar from where it is now to where its points are
        R = data.xmat[body].reshape(3, 3)
        own = R @ np.array([1.0, 0, 0])
        way = result.points["bar.C"].position[row] - result.points["bar.B"].position[row]
        way = way / np.linalg.norm(way)
        half = own + way
        half = half / np.linalg.norm(half)
        swing = 2 * np.outer(half, half) - np.eye(3)  # half a turn about the middle: own -> way
        data.qpos[at : at + 4] = quaternion(R.T @ swing @ R)
        assert gaps(model, data) <= CLOSURE


def test_masses_are_those_of_the_file() -> None:
    model, _ = read("slider-crank-inertia")
    values = md.load("slider-crank-inertia").mechanism.values()
    assert model.body("rod").mass[0] == pytest.approx(values["rod.mass"], rel=1e-15)
    assert model.body("rod").inertia.max() == pytest.approx(values["rod.inertia"], rel=1e-12)
    text = md.export("slider-crank-inertia", format="mjcf").text
    assert "assumed for crank, which MuJoCo needs: mass" in text


# -- held against gravity --------------------------------------------------------------------------

HELD = (
    *("four-bar-crank-rocker", "gorshkov-seven-link", "slider-crank-offset", "jansen-leg"),
    *("quick-return-pin", "watt-six-bar", "scotch-yoke", "bean-curve", "geared-five-bar"),
    *("oscillating-cylinder", "toggle-four-bar", "balanced-four-bar", "toggle-press"),
)
GAP, MESH, OFF, SHARE = 1e-4, 1e-3, 1e-5, 0.02
"""How far a loop may open, of the size, and wheels may slip [rad]; how far a force may be off, of
weight times size, and of what holds the mechanism without any mass that is assumed."""


def held(text: str, seconds: float, size: float, gravity=None):
    """Hold a mechanism by its actuators; return the largest gap, last forces and values.

    What wheels slip counts as `GAP` of the size where it is `MESH`.
    """
    model = mujoco.MjModel.from_xml_string(text)
    if gravity is not None:
        model.opt.gravity[:] = gravity
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    worst, mesh = 0.0, np.isin(model.eq_type, (mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtEq.mjEQ_TENDON))
    for k in np.flatnonzero(mesh):  # bars are tendons too, between sites
        if model.eq_type[k] == mujoco.mjtEq.mjEQ_TENDON:
            first = model.tendon_adr[model.eq_obj1id[k]]
            mesh[k] = model.wrap_type[first] == mujoco.mjtWrap.mjWRAP_JOINT
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        opened = np.abs(data.efc_pos[: data.ne])
        opened[mesh[data.efc_id[: data.ne]]] *= size * GAP / MESH
        worst = max(worst, float(opened.max(initial=0.0)))
    assert not any(warning.number for warning in data.warning)
    names = [model.actuator(k).name for k in range(model.nu)]
    ends = dict(zip(names, data.actuator_length.tolist(), strict=True))
    return worst, data.actuator_force.copy(), ends


def weights(model, data) -> dict[str, tuple[float, np.ndarray]]:
    """Return masses and places of centres in the pose of the file, dummies by their joints."""
    mujoco.mj_forward(model, data)
    return {
        model.body(k).name.removesuffix(".block"): (model.body_mass[k], data.xipos[k].copy())
        for k in range(1, model.nbody)
    }


def off(name: str, task: str | None = None) -> tuple[float, float]:
    """Return the gap of a mechanism that is held, and how far forces are off those of mechdae.

    Both are shares: of the size, and of weight times size.
    """
    whole = motion(name, task)
    text = mjcf(whole)[""]
    model = mujoco.MjModel.from_xml_string(text)
    size = max(float(np.abs(own.position).max()) for own in whole.result.points.values())
    worst, forces, ends = held(text, 3.0, size, (*GRAVITY, 0.0))
    assert list(ends) == list(whole.result.drivers)
    there = weights(model, mujoco.MjData(model))
    known = keep_for(whole, there, whole.first, ends)
    weight = -GRAVITY[1] * float(model.body_mass.sum())
    sizes = [size if "angle" in driver else 1.0 for driver in ends]
    return worst / size, float(np.abs((forces - known) / (weight * np.array(sizes))).max())


@pytest.mark.parametrize("name", HELD)
def test_mechanisms_are_held_for_three_seconds(name: str) -> None:
    """Loops stay closed; what holds them is what mechdae computes, near a limit position too."""
    gap, force = off(name)
    assert gap <= GAP
    assert force <= OFF


def test_cylinders_without_mass_hold_an_excavator() -> None:
    """Its rods are given a share of what they push, its cylinders the inertia of a drive; without
    both loops opened by half a metre."""
    whole = motion(str(DATA / "excavator-massless-cylinders.toml"), "forward")
    gap, force = off(str(DATA / "excavator-massless-cylinders.toml"), "forward")
    assert gap <= GAP
    assert force <= 5e-4
    _, forces, ends = held(mjcf(whole)[""], 3.0, 1.0)  # the file's own gravity
    mechanism = replace(whole.mechanism, loads=Table({}))
    drivers = [md.Driver(name, at=[value]) for name, value in ends.items()]
    known = md.solve(mechanism, md.Reactions(drivers=drivers))
    static = np.array([float(known.efforts[name][0]) for name in ends])
    assert np.abs(forces / static - 1).max() <= SHARE


def test_a_delta_robot_holds_its_platform() -> None:
    """In space, with masses of its own: three arms of 0.2 kg and a platform of 0.5 kg."""
    problem = md.load("delta-robot")
    arms = {name: body for name, body in problem.mechanism.bodies.items() if name != "platform"}
    bodies = {
        name: replace(body, mass=0.2, center=(0.04, 0.0, 0.0), inertia=(2e-4, 2e-4, 2e-4))
        for name, body in arms.items()
    }
    platform = problem.mechanism.bodies["platform"]
    bodies["platform"] = replace(platform, mass=0.5, center=(0, 0, 0), inertia=(5e-4, 5e-4, 5e-4))
    mechanism = replace(problem.mechanism, bodies=Table(bodies), gravity=(0.0, 0.0, -9.81))
    whole = motion_of(replace(problem, mechanism=mechanism), None)
    size = max(float(np.abs(point.position).max()) for point in whole.result.points.values())
    worst, forces, ends = held(mjcf(whole)[""], 3.0, size)
    assert worst / size <= GAP
    drivers = [md.Driver(name, at=[value]) for name, value in ends.items()]
    known = md.solve(mechanism, md.Reactions(drivers=drivers))
    static = np.array([float(known.efforts[name][0]) for name in ends])
    assert np.abs(forces / static - 1).max() <= SHARE


def test_actuators_are_those_of_the_drivers() -> None:
    """Ranges hold the task's values; a driver that is no joint has none, and that is said."""
    model, data = read("toggle-press")
    assert (model.nu, model.nkey) == (1, 1)
    result = motion("toggle-press").result
    values = result.drivers["crank.angle"].position
    low, high = model.actuator_ctrlrange[0]
    assert low <= float(np.min(values))
    assert float(np.max(values)) <= high
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert data.ctrl[0] == pytest.approx(float(values[motion("toggle-press").first]))
    word = model.joint(model.actuator_trnid[0, 0]).name
    assert float(data.qpos[model.joint(word).qposadr[0]]) == pytest.approx(data.ctrl[0])
