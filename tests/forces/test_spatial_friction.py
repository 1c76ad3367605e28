"""Friction in space against reference data, and against free bodies with friction as a load."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.table import Table
from tests.attack.spatial_honesty import case
from tests.shared.space import bennett, numbers, off, reference, rssp
from tests.shared.spatial_forces import massive, orientation_of_axis, pose_of


def rubbing(mechanism: md.Mechanism, **keys: Any) -> md.Mechanism:
    """Return the mechanism with more keys of joints by name."""
    joints = {n: replace(j, **keys.get(n, {})) for n, j in mechanism.joints.items()}
    return replace(mechanism, joints=Table(joints))


def loaded_rssp(p: dict[str, Any], row: dict[str, Any], **more: Any) -> md.Mechanism:
    at = {k: float(p[k]) for k in p if k[:2] in ("f_", "r_") or k.startswith(("contact", "collar"))}
    pin = {"friction": at["f_A"], "pin_radius": at["r_A"], "collar_radius": at["collar_radius_A"]}
    guide = {"friction": at["f_G"], "contact_width": at["contact_width_G"]}
    mechanism = rubbing(
        rssp(p),
        A=pin | {"contact_length": at["contact_length_A"]} | more.get("A", {}),
        G=guide | {"contact_length": at["contact_length_G"]} | more.get("G", {}),
    )
    slider = mechanism.bodies["slider"]
    points = Table({**slider.points, "E": tuple(numbers(p["E"]))})
    bodies = mechanism.bodies.with_("slider", replace(slider, points=points))
    axis = numbers(p["axis_G"])
    push = -np.sign(float(row["slide_velocity"])) * float(p["Q"]) * axis / np.linalg.norm(axis)
    return replace(
        mechanism,
        bodies=bodies,
        loads=Table({"Q": md.Force("Q", "slider.E", push)}),
        sketch=Table({"A": float(row["u"]), "G": float(row["slide"])}),
    )


@pytest.mark.parametrize("k", range(6))
def test_rssp_has_the_coupled_friction_of_the_data(k: int) -> None:
    data = reference("rssp_friction")
    row, p = data["rows"][k], data["params"]
    driver = md.Driver("A.angle", at=[float(row["u"])], speed=float(data["driver_speed"]))
    result = md.solve(loaded_rssp(p, row), md.Reactions(driver=driver))
    assert list(result.status) == ["ok"]
    assert result.fault is None
    assert max(result.checks.values()) < 1e-13
    turn = "A.angle"
    assert result.efforts[turn][0] == pytest.approx(float(row["effort"]), rel=1e-13)
    free = float(row["effort_without_friction"])
    assert result.parts["uncoupled"][turn][0] == pytest.approx(free, rel=1e-13)
    loss = result.joints["A"].loss[0] + result.joints["G"].loss[0]
    assert loss == pytest.approx(float(row["loss"]), rel=1e-13)
    axis = numbers(p["axis_G"]) / np.linalg.norm(numbers(p["axis_G"]))
    force, moment = result.joints["G"].reaction[0].reshape(2, 3)
    assert abs(force @ axis) == pytest.approx(float(row["guide_friction"]), rel=1e-12)
    assert moment @ axis == pytest.approx(float(row["guide_torsion"]), rel=1e-11)
    across, tilt = force - (force @ axis) * axis, np.cross(axis, moment)
    planes = [across / 2 + s * tilt / float(p["contact_length_G"]) for s in (-1, 1)]
    assert off([np.linalg.norm(own) for own in planes], row["guide_normals"]) < 1e-12


def rubbed(result: md.Result, name: str, wrench: Any) -> Any:
    """Return the friction (6,) on a joint's second body for its reaction, at the first pose."""
    joint = result.mechanism.joints[name]
    (axis, *_) = orientation_of_axis(result, joint, 0)
    a = axis / np.linalg.norm(axis)
    F, M = wrench[:3], wrench[3:]
    f, own = joint.friction, result.joints[name]
    across, tilt = F - (F @ a) * a, np.cross(a, M)
    normals = [across]
    if joint.contact_length is not None:
        normals = [
            across / 2 - tilt / joint.contact_length,
            across / 2 + tilt / joint.contact_length,
        ]
    N = sum(float(np.linalg.norm(each)) for each in normals)
    zero = np.zeros(3)
    if joint.kind == "revolute":
        moment = joint.pin_radius * f / np.sqrt(1 + f**2) * N
        if joint.collar_radius is not None:
            moment += f * joint.collar_radius * abs(F @ a)
        return np.concatenate([zero, -np.sign(own.angle_velocity[0]) * moment * a])
    v, u = own.slide_velocity[0], joint.pin_radius * own.angle_velocity[0]
    speed = np.hypot(v, u)
    size = f * N / np.sqrt(1 + (f * u / speed) ** 2)
    return -size * np.concatenate([v / speed * a, joint.pin_radius * u / speed * a])


@pytest.mark.parametrize("loop", ["RSRC", "RCSR"])
def test_friction_is_a_load_that_follows_the_reactions(loop: str) -> None:
    mechanism = massive(case(np.random.default_rng(11), loop).mechanism, seed=2)
    pin = {"friction": 0.06, "pin_radius": 0.05, "contact_length": 0.3}
    kinds = {"revolute": pin | {"collar_radius": 0.04}, "cylindrical": pin}
    keys = {name: kinds.get(joint.kind, {}) for name, joint in mechanism.joints.items()}
    driver = md.Driver("J0.angle", at=[0.0], speed=2.0)
    result = md.solve(rubbing(mechanism, **keys), md.Reactions(drivers=[driver]))
    assert list(result.status) == ["ok"]
    assert max(result.checks.values()) < 1e-10
    pose = pose_of(result, 0)
    friction = {name: np.zeros(6) for name, own in keys.items() if own}
    loads = list(pose.loads)
    for _ in range(150):
        pose.loads = list(loads)
        for name, own in friction.items():
            contact = pose.contacts[name]
            for body, sign in ((contact.second, 1), (contact.first, -1)):
                if body != "ground":
                    pose.loads.append((body, contact.place, sign * own[:3], sign * own[3:]))
        reactions, efforts, left, _ = pose.solve()
        before = friction
        friction = {name: rubbed(result, name, reactions[name]) for name in friction}
    assert left < 1e-12
    assert max(np.abs(friction[name] - before[name]).max() for name in friction) < 1e-10
    size = max(float(np.abs(own).max()) for own in reactions.values())
    for name, own in reactions.items():
        whole = own + friction.get(name, 0.0)
        assert np.abs(result.joints[name].reaction[0] - whole).max() < 1e-11 * size
    assert abs(result.efforts["J0.angle"][0] - efforts[0]) < 1e-11 * size


def test_a_cycle_has_losses_and_an_efficiency() -> None:
    data = reference("rssp_friction")
    mechanism = loaded_rssp(data["params"], data["rows"][0])
    work = md.Resistance("work", "G.slide", negative=500, positive=500)
    mechanism = replace(mechanism, loads=Table({"work": work}))
    driver = md.Driver("A.angle", from_=0.4, to=0.4 + 2 * np.pi, speed=20)
    result = md.solve(mechanism, md.Reactions(driver=driver, poses=25, cycle=True))
    assert result.fault is None
    summary = result.summary
    assert summary["input"] == pytest.approx(summary["useful"] + summary["loss"], rel=1e-9)
    assert 0.5 < summary["efficiency"] < 1
    stroke = np.ptp(md.solve(mechanism, md.Sweep(driver=driver, poses=2001)).joints["G"].slide)
    assert summary["useful"] == pytest.approx(2 * 500 * stroke * 20 / (2 * np.pi), rel=1e-6)


def test_what_is_assumed_is_said() -> None:
    data = reference("rssp_friction")
    bare = {"contact_length": None, "collar_radius": None}
    guide = {"contact_length": None, "contact_width": None}
    mechanism = loaded_rssp(data["params"], data["rows"][0], A=bare, G=guide)
    result = md.solve(mechanism, md.Reactions(driver=md.Driver("A.angle", at=[0.4], speed=20)))
    said = " ".join(result.summary["assumptions"])
    for word in ("tilting", "collar_radius", "contact_width", "massless"):
        assert word in said


def test_more_friction_jams_the_guide() -> None:
    data = reference("rssp_friction")
    row = data["rows"][0]
    mechanism = loaded_rssp(data["params"], row)
    task = md.Reactions(driver=md.Driver("A.angle", at=[float(row["u"])], speed=20))
    limit = md.solve(mechanism, task).summary["critical_factor"]["factor"]
    for share, word in ((0.999, "ok"), (1.001, "jammed")):
        keys = {
            name: {"friction": share * limit * float(data["params"][f"f_{name}"])} for name in "AG"
        }
        assert list(md.solve(rubbing(mechanism, **keys), task).status) == [word]


def test_friction_needs_unique_normal_forces() -> None:
    mechanism = rubbing(massive(bennett(reference("bennett_motion")["params"])), Q={
        "friction": 0.1, "pin_radius": 0.01
    })  # fmt: skip
    driver = md.Driver("P.angle", at=[1.0], speed=1.0)
    with pytest.raises(md.IndeterminateFrictionError, match="not unique"):
        md.solve(mechanism, md.Reactions(driver=driver, mode="+1"))


@pytest.mark.parametrize(("keys", "message"), [
    ({"friction": 0.1}, "radius of the pin"),
    ({"friction": 0.1, "pin_radius": 0.01, "contact_length": 0}, "contact_length is zero"),
    ({"friction": -0.1, "pin_radius": 0.01}, "friction is negative"),
    ({"friction": 0.1, "pin_radius": 0.01, "collar_radius": -1}, "collar_radius is negative"),
])  # fmt: skip
def test_friction_that_makes_no_pair_is_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(md.MechanismError, match=message):
        rubbing(rssp(reference("rssp")["params"]), A=keys)
