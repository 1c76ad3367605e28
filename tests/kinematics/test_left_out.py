"""Bodies in the plane that constraints are missing for, and that nothing asks for: left out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.equations import reduction
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
    monkeypatch.setattr(reduction, "rollers", lambda _: [])
    with pytest.raises(md.MechdaeError, match="missing"):
        turned(drawn(0)[0])
