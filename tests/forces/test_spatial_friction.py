"""Friction in space against reference data, and against free bodies with friction as a load."""

from __future__ import annotations

from dataclasses import replace
from math import atan, pi, tan
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.attack.spatial_honesty import case
from tests.shared.paths import DATA
from tests.shared.space import bennett, numbers, off, reference, rssp
from tests.shared.spatial_forces import massive, pose_of
from tests.shared.spatial_friction import jack, rubbed, rubbing


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


@pytest.mark.parametrize("loop", ["RSRC", "RCSR", "RSUR", "RHSC"])
def test_friction_is_a_load_that_follows_the_reactions(loop: str) -> None:
    mechanism = massive(case(np.random.default_rng(11), loop).mechanism, seed=2)
    pin = {"friction": 0.06, "pin_radius": 0.05, "contact_length": 0.3}
    kinds = {"revolute": pin | {"collar_radius": 0.04}, "cylindrical": pin}
    kinds["universal"] = kinds["revolute"]
    kinds["spherical"] = {"friction": 0.2, "ball_radius": 0.05}
    kinds["screw"] = {"friction": 0.15, "thread_radius": 0.03}
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
        friction = {n: rubbed(result, n, reactions[n] + own, 0) for n, own in before.items()}
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


@pytest.mark.parametrize("pitch", [0.006, -0.006])
def test_a_square_thread(pitch: float) -> None:
    """Q r tan(g + rho) up, Q r tan(rho - g) down; efficiency tan g / tan(g + rho)."""
    f, r, Q = 0.12, 0.02, 1000.0
    g, rho = np.arctan(0.006 / (2 * np.pi * r)), np.arctan(f)
    for up in (1.0, -1.0):
        turn = up * np.sign(pitch)
        driver = md.Driver("nut.angle", from_=0, to=turn * 2 * np.pi, speed=turn * 2.0)
        result = md.solve(jack(f, r, pitch), md.Reactions(driver=driver, poses=5, cycle=True))
        assert result.fault is None
        moment = Q * r * np.tan(rho + up * g)
        assert result.efforts["nut.angle"] == pytest.approx([turn * moment] * 5, rel=1e-12)
        locked = result.summary["self_locking_arcs"]
        if up > 0:
            assert result.summary["efficiency"] == pytest.approx(np.tan(g) / np.tan(g + rho), 1e-9)
            assert locked == []
            # it jams where the friction angle and the helix angle are a right angle
            factor = result.summary["critical_factor"]["factor"]
            assert factor * f == pytest.approx(1 / np.tan(g), rel=1e-5)
        else:
            assert np.array(locked).ravel() == pytest.approx(sorted([0, turn * 2 * np.pi]))


@pytest.mark.parametrize(("share", "locks"), [(0.999, False), (1.001, True)])
def test_a_screw_locks_itself_where_friction_is_above_its_slope(share: float, locks: bool) -> None:
    f = share * 0.006 / (2 * np.pi * 0.02)
    driver = md.Driver("nut.angle", from_=0, to=-3, speed=-1)
    result = md.solve(jack(f), md.Reactions(driver=driver, poses=3, cycle=True))
    assert result.fault is None
    assert bool(result.summary["self_locking_arcs"]) == locks
    assert (result.efforts["nut.angle"] < 0).all() == locks
    # driven by its load, it gives tan(g - rho) / tan g, and nothing beyond
    g, rho = np.arctan(0.006 / (2 * np.pi * 0.02)), np.arctan(f)
    assert result.summary["efficiency"] == pytest.approx(np.tan(g - rho) / np.tan(g), rel=1e-6)


def test_friction_of_a_ball_needs_a_unique_load() -> None:
    """A universal joint and a hinge through one point hold the arm as the ball there does."""
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0]}),
        bodies=[md.Body("arm", {"O": [0, 0, 0]}), md.Body("cup", {"O": [0, 0, 0]})],
        joints=[
            md.Spherical("ball", "ground.O", "arm.O", friction=0.1, ball_radius=0.02),
            md.Universal("U", "ground.O", "cup.O", axis=[1, 0, 0], axis2=[0, 1, 0]),
            md.SpatialRevolute("V", "cup.O", "arm.O", axis=[0, 0, 1]),
        ],
        loads=[md.Force("load", "arm.O", [30, 0, -40])],
        sketch={"U": 0, "U.angle2": 0, "V": 0},
    )
    drivers = [md.Driver("V.angle", at=[0.0], speed=2.0)]
    drivers += [md.Driver(f"U.{word}", at=[0.0], speed=0.0) for word in ("angle", "angle2")]
    with pytest.raises(md.IndeterminateFrictionError, match="friction in joints ball"):
        md.solve(mechanism, md.Reactions(drivers=drivers))


@pytest.mark.parametrize("key", ["B", "C"])
def test_balls_of_a_link_that_spins_freely_rub_at_no_known_speed(key: str) -> None:
    mechanism = rubbing(rssp(reference("rssp")["params"]), **{
        key: {"friction": 0.1, "ball_radius": 0.01}
    })  # fmt: skip
    with pytest.raises(md.UnavailableError, match="bar spins freely") as told:
        md.solve(mechanism, md.Reactions(driver=md.Driver("A.angle", at=[0.4], speed=20)))
    assert told.value.where == f"joints.{key}.friction"


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


@pytest.mark.parametrize(("joint", "keys", "message"), [
    (md.Screw, {"axis": [0, 0, 1], "pitch": 0.01}, "friction in a thread needs the radius"),
    (md.Screw, {"axis": [0, 0, 1], "pitch": 1, "thread_radius": 0}, "friction in a thread needs"),
    (md.Spherical, {}, "friction in a ball needs the radius of the ball"),
    (md.Universal, {"axis": [0, 0, 1], "axis2": [1, 0, 0]}, "friction in a pin needs the radius"),
])  # fmt: skip
def test_friction_without_a_radius_is_refused(joint: Any, keys: Any, message: str) -> None:
    with pytest.raises(md.MechanismError, match=message):
        md.Mechanism(
            dimension=3,
            ground=md.Ground({"O": [0, 0, 0]}),
            bodies=[md.Body("one", {"O": [0, 0, 0]})],
            joints=[joint("J", "ground.O", "one.O", friction=0.1, **keys)],
        )


# -- friction on what is unique of a reaction that is not ------------------------------------------


def tightened(F: float, r: float, pitch: float, mu: float, rc: float, muc: float) -> float:
    """Return the torque of a square thread that pushes F away, and of its collar.

    The thread is a wedge of angle lam wound about a cylinder: F tan(lam + phi) at the radius r; the
    collar rubs with muc F at its radius.
    """
    lam, phi = atan(pitch / (2 * pi * r)), atan(mu)
    return F * r * tan(lam + phi) + muc * F * rc


def test_a_screw_with_a_collar() -> None:
    problem = md.load(DATA / "forces" / "screw-with-collar.toml")
    wanted = tightened(900, 0.005, 0.0025, 0.25, 0.009, 0.25)
    assert wanted == pytest.approx(1.5132028358602434 + 2.025, rel=1e-14)
    found = md.solve(problem, "tighten")
    assert found.efforts["collar.angle"] == pytest.approx(wanted, rel=1e-12)
    assert found.fault is None
    assert set(found.summary["not_unique"]) == {"collar", "thread", "guide"}


def test_random_screws_with_collars_both_ways() -> None:
    problem, rng = md.load(DATA / "forces" / "screw-with-collar.toml"), np.random.default_rng(5)
    for _ in range(12):
        r, pitch, rc = (
            rng.uniform(3, 20) / 1000,
            rng.uniform(1, 8) / 1000,
            rng.uniform(5, 30) / 1000,
        )
        mu, F = rng.uniform(0.05, 0.3), rng.uniform(100, 5000)
        own = problem.with_values({"r": r, "p": pitch, "rc": rc, "mu": mu, "F": F})
        for sense in ("positive", "negative"):
            driver = md.Driver("collar.angle", at=[0.3], direction=sense)
            effort = md.solve(own.mechanism, md.Reactions(driver)).efforts["collar.angle"][0]
            if sense == "positive":
                assert effort == pytest.approx(tightened(F, r, pitch, mu, rc, mu), rel=1e-11)
            else:  # let down: friction holds, the load turns
                loose = tightened(F, r, pitch, -mu, rc, -mu)
                assert effort == pytest.approx(loose, rel=1e-10, abs=1e-9 * F * r)


def test_a_radius_of_zero_by_name_is_none() -> None:
    """A pin that presses radially and rubs needs what is not unique, one without a radius not."""
    problem = md.load(DATA / "forces" / "screw-with-collar.toml")
    collar = replace(problem.mechanism.joints["collar"], pin_radius="rp")
    joints, given = problem.mechanism.joints.with_("collar", collar), problem.mechanism.parameters
    for rp in (0.0, 0.003):
        own = replace(problem.mechanism, joints=joints, parameters=given.with_("rp", rp))
        if rp:
            with pytest.raises(md.IndeterminateFrictionError, match="collar"):
                md.solve(own, problem.task("tighten"))
            continue
        found = md.solve(own, problem.task("tighten")).efforts["collar.angle"]
        assert found == pytest.approx(1.5132028358602434 + 2.025, rel=1e-12)


def test_a_screw_with_a_collar_starts_when_the_torque_is_enough() -> None:
    """A motion: what is left of the torque turns the screw, and pushes the nut by its lead."""
    problem = md.load(DATA / "forces" / "screw-with-collar.toml")
    inertia, mass, r, pitch, mu, rc, F = 0.1, 2.0, 0.005, 0.0025, 0.25, 0.009, 900.0
    bodies = [
        replace(problem.mechanism.bodies["screw"], mass=1.0, inertia=3 * (inertia,)),
        replace(problem.mechanism.bodies["nut"], mass=mass, inertia=3 * (inertia,)),
    ]
    for torque in (3.4, 5.0):
        push = md.Torque("push", body="screw", value=(0, 0, torque))
        loads = [*problem.mechanism.loads.values(), push]
        mechanism = replace(problem.mechanism, bodies=bodies, loads=loads)
        found = md.solve(mechanism, md.Motion(start={"collar.angle": 0.0}, until=0.1))
        per = tightened(1.0, r, pitch, mu, rc, mu)  # torque for each newton of the thread
        gain = (torque - per * F) / (inertia + per * mass * pitch / (2 * pi))
        turned = gain * 0.1**2 / 2 if gain > 0 else 0.0
        assert found.joints["collar"].angle[-1] == pytest.approx(turned, rel=1e-7, abs=1e-12)
