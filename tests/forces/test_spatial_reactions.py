"""Reactions and efforts in space against free bodies, reference data and planar mechanisms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.attack.spatial_honesty import case, platform, random_turn
from tests.shared.space import bennett, numbers, off, reference, rssr, sarrus
from tests.shared.spatial_forces import massive, pose_of

CLOSE = 1e-12


def forces(mechanism: md.Mechanism, driver: str, at: list[float], **more: Any) -> md.Result:
    drivers = [md.Driver(driver, at=at, speed=2.0, acceleration=1.3)]
    return md.solve(mechanism, md.Reactions(drivers=drivers, **more))


def with_loads(mechanism: md.Mechanism, *loads: Any) -> md.Mechanism:
    every = {**mechanism.loads, **{load.name: load for load in loads}}
    return replace(mechanism, loads=Table(every))


def worst(result: md.Result, driver: str) -> float:
    """Return the largest difference to free bodies over the largest force or moment."""
    largest = 0.0
    for k in range(len(result)):
        reactions, efforts, left, (stresses, _) = pose_of(result, k).solve()
        assert left < CLOSE
        size = max(float(np.abs(own).max()) for own in reactions.values())
        gaps = [result.efforts[driver][k] - efforts[0]]
        for name, own in reactions.items():
            ours = result.joints[name].reaction[k]
            if np.abs(stresses[name]).max(initial=0.0) < 1e-9:
                gaps += list(ours - own)
            else:
                assert np.isnan(ours).all()
        largest = max(largest, float(np.abs(gaps).max()) / size)
    return largest


def checked(result: md.Result) -> None:
    assert result.fault is None
    assert set(result.status) == {"ok"}
    assert max(result.checks.values()) < CLOSE


def loaded_rssr(p: dict[str, Any], **keys: Any) -> md.Mechanism:
    length, m = float(p["l"]), float(p["m_bar"])
    slender = m * length**2 / 12

    def own(name: str) -> dict[str, Any]:
        inertia, centre = numbers(p[f"I_{name}"]), numbers(p[f"c_{name}"])
        return {"mass": float(p[f"m_{name}"]), "center": centre, "inertia": inertia}

    middle = {"mass": m, "center": [length / 2, 0, 0], "inertia": [0, slender, slender]}
    mechanism = rssr(p, crank=own("crank"), rocker=own("rocker"), bar=middle | keys)
    load = md.Torque("work", "rocker", [0, 0, float(p["M_rocker"])], frame="rocker")
    mechanism = replace(mechanism, gravity=tuple(numbers(p["gravity"])))
    return with_loads(mechanism, load)


@pytest.fixture(scope="module")
def data() -> dict[str, Any]:
    return reference("rssr_forces")


@pytest.fixture(scope="module")
def loaded(data: dict[str, Any]) -> md.Mechanism:
    return replace(loaded_rssr(data["params"]), sketch=Table({"A": 0.5, "D": -1.2}))


def test_rssr_has_the_forces_of_the_data(data: dict[str, Any], loaded: md.Mechanism) -> None:
    at = [float(row["u"]) for row in data["rows"]]
    speed = float(data["driver_speed"])
    task = md.Reactions(drivers=[md.Driver("A.angle", at=at, speed=speed)], parts=["static"])
    result = md.solve(loaded, task)
    checked(result)
    for k, row in enumerate(data["rows"]):
        assert result.efforts["A.angle"][k] == pytest.approx(float(row["effort"]), rel=1e-14)
        for name in "AD":
            force, moment = result.joints[name].reaction[k].reshape(2, 3)
            assert off(force, row[f"reaction_{name}_force"]) < 1e-14
            assert off(moment, row[f"reaction_{name}_moment"]) < 1e-14
        for name in "BC":
            force, moment = result.joints[name].reaction[k].reshape(2, 3)
            assert off(force, row[f"force_on_bar_at_{name}"]) < 1e-14
            assert not moment.any()
    # at rest: the weight of all that turns about A, and nothing of the speed
    rest = md.solve(loaded, md.Reactions(driver=md.Driver("A.angle", at=at, speed=0)))
    assert np.allclose(result.joints["A"].reaction_static, rest.joints["A"].reaction, atol=1e-12)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_other_sizes_have_the_same_digits(
    data: dict[str, Any], loaded: md.Mechanism, factor: float
) -> None:
    """Lengths times s, masses as they are: speeds over s leave accelerations as they are."""
    p = {k: v for k, v in data["params"].items() if k not in ("A", "D", "B", "C", "l")}
    for name in ("A", "D", "B", "C"):
        p[name] = (numbers(data["params"][name]) * factor).tolist()
    p["l"] = float(data["params"]["l"]) * factor
    for name in ("crank", "rocker"):
        p[f"c_{name}"] = (numbers(p[f"c_{name}"]) * factor).tolist()
        p[f"I_{name}"] = (numbers(p[f"I_{name}"]) * factor**2).tolist()
    p["M_rocker"] = float(p["M_rocker"]) * factor
    other = replace(loaded_rssr(p), sketch=Table({"A": 0.5, "D": -1.2}))
    speed = float(data["driver_speed"]) / factor**0.5
    task = md.Reactions(driver=md.Driver("A.angle", at=[0.5, 2.0], speed=speed))
    result = md.solve(other, task)
    checked(result)
    for k, row in enumerate(data["rows"][:2]):
        assert result.efforts["A.angle"][k] / factor == pytest.approx(float(row["effort"]), 1e-13)
        assert off(result.joints["D"].reaction[k, :3], row["reaction_D_force"]) < 1e-13


def test_springs_and_expressions_on_an_rssr() -> None:
    mechanism = massive(rssr(reference("rssr")["params"]), bars=("bar",))
    springs = (
        md.Spring("tie", between=("crank.cm", "rocker.C"), stiffness=100, free_length=0.05),
        md.Spring("held", between=("ground.D", "bar.cm"), stiffness=70, free_length=0.02),
        md.Spring("turned", coordinate="D.angle", stiffness=3, free_length=0.1),
    )
    mechanism = replace(mechanism, sketch=Table({"A": 0.5, "D": -1.2}))
    result = forces(with_loads(mechanism, *springs), "A.angle", [0.5, 1.0])
    checked(result)
    assert worst(result, "A.angle") < CLOSE
    pull = md.Force("pull", "rocker.C", [0, "10*D.angle", 2])
    values = forces(with_loads(mechanism, pull), "A.angle", [0.5])
    known = md.Force("pull", "rocker.C", [0, 10 * float(values.joints["D"].angle[0]), 2])
    same = forces(with_loads(mechanism, known), "A.angle", [0.5])
    assert np.allclose(values.joints["A"].reaction, same.joints["A"].reaction, rtol=1e-13)


@pytest.mark.parametrize("loop", ["RHSC", "RERC", "RCUC", "RSUR"])
def test_loops_of_all_pairs_balance_like_free_bodies(loop: str) -> None:
    mechanism = massive(case(np.random.default_rng(5), loop).mechanism, seed=7)
    springs = [
        md.Spring(f"at_{name}_{word}", coordinate=f"{name}.{word}", stiffness=20, free_length=0.3)
        for name, joint in mechanism.joints.items()
        if joint.kind != "universal"
        for word in ("angle", "slide")
        if word in joint.coordinates
    ]
    result = forces(with_loads(mechanism, *springs), "J0.angle", [0.0])
    assert list(result.status) == ["ok"]
    assert worst(result, "J0.angle") < CLOSE
    assert max(result.checks.values()) < 1e-10  # some of these loops are ill-conditioned


def mode(mechanism: md.Mechanism, driver: str, at: float) -> str:
    modes = md.solve(mechanism, md.Modes(driver=md.Driver(driver, at=[at])))
    return ",".join(modes.labels[0])


@pytest.mark.parametrize(("name", "stresses"), [("bennett", 3), ("sarrus", 1)])
def test_superfluous_constraints_leave_the_effort(name: str, stresses: int) -> None:
    if name == "bennett":
        mechanism, driver, at = massive(bennett(reference("bennett_motion")["params"])), "P", 1.0
    else:
        mechanism, driver, at = massive(sarrus(reference("sarrus_motion")["params"])), "A1", 1.1
    turn = f"{driver}.angle"
    result = forces(mechanism, turn, [at], mode=mode(mechanism, turn, at))
    checked(result)
    assert result.summary["superfluous"][0]["count"] == stresses
    assert result.summary["not_unique"] == list(mechanism.joints)
    assert worst(result, turn) < CLOSE
    reactions, _, _, (open_ones, _) = pose_of(result, 0).solve()
    for joint, own in result.unique.items():
        assert open_ones[joint].shape[1] == stresses
        turns = {"world": np.eye(3)}
        for body in mechanism.bodies:
            w, *v = result.bodies[body].orientation[0]
            K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
            turns[body] = np.eye(3) + 2 * w * K + 2 * K @ K
        for direction, value in zip(own["directions"], own["values"][0], strict=True):
            R = turns[own["frame"]]
            world = np.concatenate([R @ direction[:3], R @ direction[3:]])
            size = float(np.abs(reactions[joint]).max())
            assert np.abs(world @ open_ones[joint]).max() < 1e-9
            assert abs(world @ reactions[joint] - value) < 1e-11 * size
    for entry in result.summary["unique_sums"]:
        total = sum(
            (1 if mechanism.joints[n].second_body == entry["body"] else -1) * reactions[n][:3]
            for n in entry["joints"]
        )
        assert np.abs(entry["force"][0] - total).max() < 1e-11 * np.abs(total).max()


def four_bar(planar: bool, turn: Any = None) -> md.Mechanism:
    """Return a loaded four-bar of the plane, or the same turned, with hinges in space."""
    z, R = [] if planar else [0], np.eye(2 if planar else 3) if turn is None else turn

    def body(name: str, length: float, mass: float, inertia: float) -> md.Body:
        moments = inertia if planar else [0.3, 0.2, inertia]
        ends = {"P": [0, 0, *z], "Q": [length, 0, *z]}
        centre = [0.4 * length, 0.1, *z]
        return md.Body(name, ends, mass=mass, center=centre, inertia=moments)

    def joint(name: str, first: str, second: str) -> Any:
        if planar:
            return md.Revolute(name, first, second)
        turned = R if first.startswith("ground") else np.eye(3)
        sides = {"axis": turned[:, 2], "zero": turned[:, 0], "axis2": [0, 0, 1], "zero2": [1, 0, 0]}
        return md.SpatialRevolute(name, first, second, **sides)

    pairs = (
        ("A", "ground.A", "crank.P"),
        ("B", "crank.Q", "coupler.P"),
        ("C", "coupler.Q", "rocker.Q"),
        ("D", "ground.D", "rocker.P"),
    )
    torque = 3.0 if planar else R @ [0, 0, 3.0]
    sketch = {"crank": 1.0, "rocker": 1.3} if planar else {"A": 1.0, "D": 1.3}
    return md.Mechanism(
        dimension=2 if planar else 3,
        ground=md.Ground({"A": [0, 0, *z], "D": R @ [1.0, 0, *z]}),
        bodies=[
            body("crank", 0.3, 1, 0.01),
            body("coupler", 0.9, 2, 0.1),
            body("rocker", 0.7, 3, 0.2),
        ],
        joints=[joint(*pair) for pair in pairs],
        loads=[
            md.Force("pull", "coupler.Q", [5, -3, *z], frame="coupler"),
            md.Torque("turn", "rocker", torque),
            md.Spring("tie", between=("ground.A", "coupler.Q"), stiffness=50, free_length=0.2),
        ],
        gravity=tuple(R @ [0, -9.81, *z]),
        sketch=sketch,
    )


@pytest.mark.parametrize("seed", [None, 8])
def test_a_planar_four_bar_in_space_has_the_planar_forces(seed: int | None) -> None:
    turn = np.eye(3) if seed is None else random_turn(np.random.default_rng(seed))
    plane = forces(four_bar(planar=True), "crank.angle", [1.0, 2.0])
    space = forces(four_bar(planar=False, turn=turn), "A.angle", [1.0, 2.0])
    checked(space)
    assert off(space.efforts["A.angle"], plane.efforts["crank.angle"]) < 1e-13
    assert space.summary["superfluous"][0]["count"] == 3
    for name in plane.joints:
        own = space.unique[name]
        along = own["directions"][:, :3] @ turn  # what lies in the plane is unique
        assert along.shape == (2, 3)
        assert np.abs(own["directions"][:, 3:]).max() < CLOSE
        assert np.abs(along[:, 2]).max() < CLOSE
        assert off(own["values"], plane.joints[name].reaction[:, :2] @ along[:, :2].T) < 1e-13


def test_a_plate_on_six_bars_has_a_quaternion_and_the_forces_of_free_bodies() -> None:
    mechanism = massive(platform(np.random.default_rng(4)).mechanism)
    result = forces(mechanism, "J0.angle", [0.0])
    assert list(result.status) == ["ok"]
    assert worst(result, "J0.angle") < CLOSE
    assert max(result.checks.values()) < 1e-11  # speeds are known to 1e-12 of the energy


REFUSED = [
    ({"loads": [md.Torque("t", "rocker", 3.0)]}, "three numbers are needed in space"),
    ({"loads": [md.Force("f", "rocker.C", [1, 2])]}, "three numbers are needed, not 2"),
    ({"loads": [md.Torque("t", "bar", [1, 0, 0])]}, "bar spins freely"),
    ({"loads": [md.Force("f", "rocker.C", [1, 2, 3], frame="bar")]}, "it has no axes"),
    ({"bar": {"center": [0.1, 0.02, 0]}}, "beside the line of its ball joints"),
    ({"bar": {"inertia": [0, 0.1, 0.2]}}, "not the same in all directions"),
]


@pytest.mark.parametrize(("change", "message"), REFUSED)
def test_what_has_no_forces_is_refused(
    data: dict[str, Any], loaded: md.Mechanism, change: dict[str, Any], message: str
) -> None:
    mechanism = loaded
    if "bar" in change:
        mechanism = loaded_rssr(data["params"], **change["bar"])
    mechanism = with_loads(mechanism, *change.get("loads", ()))
    with pytest.raises(md.MechdaeError, match=message):
        forces(mechanism, "A.angle", [0.5], axes=change.get("axes"))


def test_a_torque_of_space_is_refused_in_the_plane() -> None:
    mechanism = with_loads(four_bar(planar=True), md.Torque("t", "rocker", [0, 0, 1]))
    with pytest.raises(md.InputError, match="one number is needed in the plane"):
        forces(mechanism, "crank.angle", [1.0])
