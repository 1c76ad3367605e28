"""Arms of URDF files: places of the tip by matrices of the file's own numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md

UR5E = [
    ("0 0 0.1625", "0 0 0", "0 0 1"),
    ("0 0 0", "1.570796327 0 0", "0 0 1"),
    ("-0.425 0 0", "0 0 0", "0 0 1"),
    ("-0.3922 0 0.1333", "0 0 0", "0 0 1"),
    ("0 -0.0997 -2.044881182297852e-11", "1.570796327 0 0", "0 0 1"),
    ("0 0.0996 -2.042830148012698e-11", "1.570796326589793 3.141592653589793 3.141592653589793",
     "0 0 1"),
]  # fmt: skip
"""Joints of the file of a UR5e: xyz, rpy, axis."""
LIMITS = 'limit lower="-6.283185307" upper="6.283185307" effort="1" velocity="1"'


def file(rows: Any, folder: Path, more: str = "", kind: str = "revolute") -> Path:
    """Write a URDF file of a row of joints from base to tip."""
    names = ["base", *(f"link{k}" for k in range(1, len(rows))), "tip"]
    text = "".join(f'<link name="{name}"/>' for name in names)
    for k, (xyz, rpy, axis) in enumerate(rows):
        text += (
            f'<joint name="turn{k + 1}" type="{kind}"><parent link="{names[k]}"/>'
            f'<child link="{names[k + 1]}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<axis xyz="{axis}"/><{LIMITS}/></joint>'
        )
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="arm">{text}{more}</robot>', encoding="utf-8")
    return path


def turn(axis: Any, angle: float) -> Any:
    n = np.array(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    M = np.eye(4)
    M[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return M


def tip(rows: Any, angles: Any) -> Any:
    """Return the place of the tip in the base."""
    T = np.eye(4)
    for (xyz, rpy, axis), angle in zip(rows, angles, strict=True):
        M = np.eye(4)
        M[:3, 3] = [float(v) for v in xyz.split()]
        r, p, y = (float(v) for v in rpy.split())
        T = T @ M @ turn([0, 0, 1], y) @ turn([0, 1, 0], p) @ turn([1, 0, 0], r)
        T = T @ turn([float(v) for v in axis.split()], angle)
    return T


def test_an_arm_of_drawn_numbers(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    rows = [
        tuple(" ".join(repr(float(v)) for v in rng.normal(size=3)) for _ in range(3))
        for _ in range(6)
    ]
    arm = md.arm_from_urdf(file(rows, tmp_path, kind="continuous"))
    q = rng.uniform(-3, 3, size=(4, 6))
    world = np.stack([tip(rows, row) for row in q])
    assert np.abs(arm.forward(q) - world).max() < 1e-12
    found = md.arm_poses(arm, world)
    gaps = np.abs(np.exp(1j * found.angles) - np.exp(1j * q)[:, None]).max(axis=2)
    assert np.nanmin(gaps, axis=1).max() < 1e-8
    assert arm.names == tuple(f"turn{k}" for k in range(1, 7))
    assert np.isinf(arm.limits).all()


def test_angles_of_a_few_digits_are_right_ones(tmp_path: Path) -> None:
    """The axes of a UR are parallel exactly, though its file has ten digits of pi / 2."""
    arm = md.arm_from_urdf(file(UR5E, tmp_path))
    q = np.random.default_rng(3).uniform(-3, 3, size=(5, 6))
    world = np.stack([tip(UR5E, row) for row in q])
    assert np.abs(arm.forward(q) - world).max() < 2e-9
    found = md.arm_poses(arm, arm.forward(q))
    assert (found.most, found.status.tolist()) == (8, ["ok"] * 5)
    assert np.allclose(arm.limits, [-2 * np.pi, 2 * np.pi])


def test_tools_and_other_ends(tmp_path: Path) -> None:
    more = (
        '<link name="tool"/><link name="camera"/>'
        '<joint name="mount" type="fixed"><parent link="tip"/><child link="tool"/>'
        '<origin xyz="0 0 0.1"/></joint>'
        '<joint name="bolt" type="fixed"><parent link="link2"/><child link="camera"/></joint>'
    )
    path = file(UR5E, tmp_path, more)
    arm = md.arm_from_urdf(path)
    assert np.allclose(arm.forward(np.zeros(6)) @ [0, 0, -0.1, 1], tip(UR5E, [0] * 6)[:, 3])
    inner = md.arm_from_urdf(path, base="base", tip="tip")
    assert np.allclose(inner.forward(np.ones(6)), tip(UR5E, [1] * 6))
    both = more + (
        '<link name="hook"/><joint name="pin" type="fixed"><parent link="tip"/>'
        '<child link="hook"/></joint>'
    )
    with pytest.raises(md.InputError, match="2 ends are behind the same joints: tool, hook"):
        md.arm_from_urdf(file(UR5E, tmp_path, both))


def test_messages(tmp_path: Path) -> None:
    whole = file(UR5E, tmp_path)
    text = whole.read_text(encoding="utf-8")
    with pytest.raises(md.InputError, match="cannot be read"):
        md.arm_from_urdf(tmp_path / "none.urdf")
    with pytest.raises(md.UnknownName, match="tpi"):
        md.arm_from_urdf(whole, tip="tpi")
    with pytest.raises(md.InputError, match=r"5 joints turn \(turn2, turn3"):
        md.arm_from_urdf(whole, base="link1", tip="tip")
    with pytest.raises(md.InputError, match="link1 does not hang on link2"):
        md.arm_from_urdf(whole, base="link2", tip="link1")
    cases = (
        (text.replace('"turn3" type="revolute"', '"turn3" type="prismatic"'), "no end behind six"),
        (text.replace("</robot>", ""), "no XML"),
        (text.replace("robot", "model"), "no URDF"),
        (text.replace('lower="-6.283185307"', 'lower="7"', 1), "limits of turn1 are reversed"),
        (text.replace(f"<{LIMITS}/>", "", 1), "turn1 has no limits"),
        (text.replace("0 0 0.1625", "0 0.1625"), "'0 0.1625' are not three numbers"),
        (text.replace('<child link="link1"/>', "", 1), "turn1 has no child"),
        (text.replace("<axis", '<mimic joint="turn1"/><axis', 2), "turn1 follows another one"),
        (text.replace('xyz="0 0 1"', 'xyz="0 0 0"', 1), "axis 1 has no direction"),
    )
    for changed, message in cases:
        whole.write_text(changed, encoding="utf-8")
        with pytest.raises(md.InputError, match=message):
            md.arm_from_urdf(whole)
