"""MJCF read by MuJoCo itself: at poses of mechdae its equalities hold and its sites are there."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.exchange.robots.link_frames import quaternion
from tests.shared.exports import coordinate, in_space, motion, rows

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
    model = mujoco.MjModel.from_xml_string(md.exported(name, "mjcf").text)
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
    text = md.exported("slider-crank-inertia", "mjcf").text
    assert "assumed for crank, which MuJoCo needs: mass" in text
