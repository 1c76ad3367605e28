"""Bodies that constraints are missing for, and that nothing asks for: left out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe import spinning_links
from mechdae.equations.cases import left_out
from mechdae.tasks.show import structure
from tests.shared.paths import ROOT

DATA = ROOT / "tests/data/use"


def test_a_roller_that_turns_freely_on_its_pin() -> None:
    problem = md.load(DATA / "idle-roller.toml")
    result = md.solve(problem)
    t = result.drivers["crank.angle"].position
    assert set(result.status) == {"ok"}
    assert result.points["rod.B"].position[:, 0] == pytest.approx(
        np.cos(t) + np.sqrt(9 - np.sin(t) ** 2), abs=1e-12
    )
    assert result.summary["notes"] == ["roller turns freely on its pin: it is left out"]
    mobility = structure(problem)["mobility"]
    assert (mobility["W"], mobility["idle"], mobility["rank"]["mobility"]) == (2, ["roller"], 2)


def test_a_roller_is_left_out_where_all_is_asked_for() -> None:
    problem = md.load(DATA / "idle-roller.toml")
    task = md.Sweep(driver=md.Driver("crank.angle", at=[0.0, 1.0]))
    result = md.solve(problem.mechanism, task)
    assert list(result.status) == ["ok"] * 2
    assert "roller" not in result.bodies
    assert "roller.R" not in result.points
    with pytest.raises(md.MechdaeError, match="constraint missing: roller"):
        md.solve(problem.mechanism, replace(task, outputs=("roller",)))


def rocker(t: Any) -> Any:
    """Return where the end of the rocker is: crank 1, coupler, rocker sqrt 5, ground 4."""
    B = np.stack([-np.sin(t), np.cos(t)], axis=1)
    way = np.array([4.0, 0.0]) - B
    d = np.linalg.norm(way, axis=1)
    along = (10 - 5 + d**2) / (2 * d)
    high = np.sqrt(10 - along**2)
    across = np.stack([-way[:, 1], way[:, 0]], axis=1)
    return B + (way * along[:, None] + across * high[:, None]) / d[:, None]


def test_a_second_machine_does_not_stop_the_first() -> None:
    problem = md.load(DATA / "one-of-two-machines.toml")
    result = md.solve(problem)
    assert list(result.status) == ["ok"] * 37
    t = result.drivers["AB.angle"].position
    assert result.points["BC.C"].position == pytest.approx(rocker(t), abs=1e-12)
    assert result.summary["not_in_scene"] == ["EF", "FG", "GH"]
    task = problem.tasks["first"]
    with pytest.raises(md.MechdaeError, match="constraint missing: EF, FG, GH"):
        md.solve(problem.mechanism, replace(task, outputs=None))
    with pytest.raises(md.MechdaeError, match="constraint missing: EF, FG, GH"):
        md.solve(problem.mechanism, replace(task, outputs=("BC", "GH")))


def weighed(mechanism: md.Mechanism) -> md.Mechanism:
    """Return a mechanism whose bodies weigh in the middle of their points."""
    bodies = [
        replace(body, mass=1.0 + k, center=tuple(np.mean(list(body.points.values()), axis=0)))
        for k, body in enumerate(mechanism.bodies.values())
    ]
    return replace(mechanism, bodies=bodies, gravity=(0.0, -9.81))


def test_weights_of_a_second_machine_are_its_own() -> None:
    mechanism = weighed(md.load(DATA / "one-of-two-machines.toml").mechanism)
    at = np.array([0.3, 1.2, 4.0])
    driver = md.Driver("AB.angle", at=list(at), speed=0.0)
    result = md.solve(mechanism, md.Reactions(driver=driver, outputs=("BC", "CD")))
    assert list(result.status) == ["ok"] * 3

    def height(t: Any) -> Any:  # masses 1, 2, 3 in the middle of crank, coupler, rocker
        B, C = np.cos(t), rocker(t)[:, 1]
        return B / 2 + 2 * (B + C) / 2 + 3 * C / 2

    h = 1e-4
    told = 9.81 * (height(at + h) - height(at - h)) / (2 * h)
    assert result.efforts["AB.angle"] == pytest.approx(told, rel=1e-6)


def test_a_weight_on_the_way_is_not_left_out() -> None:
    mechanism = weighed(md.load(DATA / "idle-roller.toml").mechanism)
    with pytest.raises(md.MechdaeError, match="constraint missing: roller"):
        md.solve(mechanism, md.Reactions(driver=md.Driver("crank.angle", at=[0.5])))


def in_space() -> md.Mechanism:
    """Return a crank, a rod between balls and a rocker in space, a roller and a hand on them."""
    problem = md.load("rssr")
    own = problem.mechanism
    bodies = [*own.bodies.values(), md.Body("roller", {"O": [0, 0, 0], "R": [0, 0.1, 0]})]
    bodies.append(md.Body("hand", {"H": [0.1, 0, 0]}))
    joints = [
        *own.joints.values(),
        md.SpatialRevolute("pin", "crank.B", "roller.O", axis=[1, 0, 0]),
        md.Spherical("wrist", "rocker.C", "hand.H"),
    ]
    return replace(own, bodies=bodies, joints=joints)


def test_rollers_in_space_change_no_number() -> None:
    problem = md.load("rssr")
    task = md.Sweep(driver=md.Driver("A.angle", at=[0.1, 0.5]))
    plain, result = md.solve(problem.mechanism, task), md.solve(in_space(), task)
    assert list(result.status) == ["ok"] * 2
    assert set(result.points) == set(plain.points)
    for point in plain.points:
        assert (result.points[point].position == plain.points[point].position).all()
    assert result.summary["notes"] == [
        "roller turns freely on its pin: it is left out",
        "hand turns freely on its spherical joint: it is left out",
    ]
    shown = structure(md.Problem(in_space(), tasks={"turn": task}))["mobility"]
    assert shown["idle"] == [*structure(problem)["mobility"]["idle"], "roller", "hand"]
    with pytest.raises(md.MechdaeError, match="4 constraints missing: roller, hand"):
        md.solve(in_space(), replace(task, outputs=("roller",)))
    driven = md.Driver("pin.angle", at=[0.1, 0.2])
    both = md.solve(in_space(), md.Sweep(drivers=(md.Driver("A.angle", at=[0.1, 0.5]), driven)))
    assert list(both.status) == ["ok"] * 2
    assert "roller" in both.bodies


def test_other_numbers_of_a_redundant_machine_leave_out_the_same() -> None:
    def solved(length: float) -> md.Result:
        names, ground = ("a", "b", "c"), {n: [k, 0.0] for k, n in enumerate("ABC")}
        bodies = [md.Body(n, {"O": [0, 0], "T": [0, "length"]}) for n in names]
        bodies.append(md.Body("bar", {n: [k, 0.0] for k, n in enumerate("ABC")}))
        bodies.append(md.Body("roller", {"O": [0, 0]}))
        joints = [md.Revolute(f"g{n}", f"ground.{n}", f"{n.lower()}.O") for n in "ABC"]
        joints += [md.Revolute(f"t{n}", f"{n.lower()}.T", f"bar.{n}") for n in "ABC"]
        joints.append(md.Revolute("pin", "a.T", "roller.O"))
        mechanism = md.Mechanism(
            parameters={"length": length}, ground=md.Ground(ground), bodies=bodies, joints=joints
        )
        return md.solve(mechanism, md.Sweep(driver=md.Driver("a.angle", at=[0.3, 0.4])))

    for length in (1.0, 1.25):
        result = solved(length)
        assert list(result.status) == ["ok"] * 2
        assert result.points["a.T"].position[0] == pytest.approx(
            [-length * np.sin(0.3), length * np.cos(0.3)], abs=1e-12
        )
        assert "roller" not in result.bodies


def drawn(seed: int) -> tuple[md.Mechanism, tuple[str, ...]]:
    """Return a random four-bar with rollers on pins of it, and the names of these."""
    rng = np.random.default_rng(seed)
    A, B, C, D = np.array([[0, 0], [0.3, 1], [3, 2], [4, 0]]) + rng.uniform(-0.2, 0.2, (4, 2))
    bodies = [md.Body(n, {n + "1": p - p, n + "2": [np.hypot(*(q - p)), 0]})
              for n, p, q in (("crank", A, B), ("rod", B, C), ("rocker", D, C))]  # fmt: skip
    ends = [("ground.A", "crank.crank1"), ("crank.crank2", "rod.rod1"),
            ("rod.rod2", "rocker.rocker2"), ("ground.D", "rocker.rocker1")]  # fmt: skip
    joints = [md.Revolute(f"J{k}", *own) for k, own in enumerate(ends)]
    idle = tuple(f"roller{k}" for k in range(int(rng.integers(1, 4))))
    for name in idle:
        pin = str(rng.choice(["ground.A", "crank.crank2", "rod.rod2", "rocker.rocker2"]))
        bodies.append(md.Body(name, {"O": rng.uniform(-1, 1, 2), "R": [0.2, 0]}))
        joints.append(md.Revolute(f"pin of {name}".replace(" ", "_"), pin, f"{name}.O"))
    order = rng.permutation(len(joints))
    sketch = {
        f"{n}.angle": float(np.arctan2(*(q - p)[::-1]))
        for n, p, q in (("crank", A, B), ("rod", B, C), ("rocker", D, C))
    }
    mechanism = md.Mechanism(
        ground=md.Ground({"A": A, "D": D}),
        bodies=[bodies[k] for k in rng.permutation(len(bodies))],
        joints=[joints[k] for k in order],
        sketch=sketch,
    )
    return mechanism, idle


def turned(mechanism: md.Mechanism) -> md.Result:
    start = float(mechanism.sketch["crank.angle"])
    driver = md.Driver("crank.angle", from_=start, to=start + 0.2)
    return md.solve(mechanism, md.Sweep(driver=driver, poses=3))


@pytest.mark.parametrize("seed", range(4))
def test_rollers_at_random_change_nothing(seed: int) -> None:
    mechanism, idle = drawn(seed)
    result = turned(mechanism)
    plain = replace(
        mechanism,
        bodies=[body for name, body in mechanism.bodies.items() if name not in idle],
        joints=[j for j in mechanism.joints.values() if not set(idle) & set(j.bodies)],
    )
    other = turned(plain)
    assert list(result.status) == ["ok"] * 3
    for point in other.points:
        assert (result.points[point].position == other.points[point].position).all()
    told = "\n".join(result.summary["notes"])
    assert all(f"{name} turns freely" in told for name in idle)
    assert not set(idle) & set(result.bodies)


def test_a_roller_that_is_not_known_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    for room in (spinning_links, left_out):
        monkeypatch.setattr(room, "rollers", lambda _: [])
    with pytest.raises(md.MechdaeError, match="missing"):
        turned(drawn(0)[0])
