"""Every predefined mechanism, given masses, weight, a load and friction, keeps its books.

`force_audit` checks Newton's and Euler's equations of every body and the law of every joint on
the published numbers. Masses, loads and coefficients are drawn once, with a fixed seed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from tests.reference.force_audit import audit
from tests.reference.force_truth import circle, place, rate, second
from tests.reference.force_truth import slider_crank as free_slider_crank
from tests.shared.force_cases import S1, slider_crank
from tests.shared.predefined import predefined
from tests.shared.series import Poses, Row, only_poses

# joint forces are not unique: parallel cranks; on a change point: a cusp, a folded four-bar
REDUNDANT = {"five-crank-parallelogram", "parallelogram-three-cranks"}
NAMES = [
    name for name in library.names()
    if name not in (*REDUNDANT, "vector-modules-planar")  # a loop each task, sketched at one pose
    and predefined(name).mechanism.dimension == 2
    and any(isinstance(task, md.Sweep) for task in predefined(name).tasks.values())
]  # fmt: skip
BALANCE = 1e-11


def loaded(mechanism: md.Mechanism, friction: float, seed: int) -> md.Mechanism:
    """Return the mechanism with masses, weight, a force, a spring and friction in its joints."""
    draw = np.random.default_rng(seed)
    values = mechanism.values()
    size = max([abs(values[f"{b}.{p}.{x}"]) for b, p in _points(mechanism) for x in "xy"] or [1.0])
    bodies = []
    for body in mechanism.bodies.values():
        mass = float(draw.uniform(0.5, 2))
        center = tuple(float(x) for x in draw.uniform(-0.3, 0.3, 2) * size)
        inertia = float(mass * (0.3 * size) ** 2)
        bodies.append(replace(body, mass=mass, center=center, inertia=inertia))
    joints: list[md.Revolute | Any] = []
    for joint in mechanism.joints.values():
        f = float(draw.uniform(0.5, 1) * friction)
        if isinstance(joint, md.Revolute | md.PinInSlot):
            joint = replace(joint, friction=f, pin_radius=float(0.03 * size))
        elif isinstance(joint, md.Prismatic):
            joint = replace(joint, friction=f, contact_length=float(0.4 * size))
        joints.append(joint)
    last = bodies[-1]
    point = next(iter(last.points))
    push = md.Force("push", f"{last.name}.{point}", (7.0, 11.0), frame=bodies[0].name)
    return replace(
        mechanism, bodies=bodies, joints=joints, loads=[push], gravity=(1.0, -9.81), outputs={}
    )


def _points(mechanism: md.Mechanism):
    for name, body in [("ground", mechanism.ground), *mechanism.bodies.items()]:
        for point in body.points:
            yield name, point


def in_motion(driver: md.Driver) -> md.Driver:
    """Return a driver with a speed, so that there is inertia to keep books of."""
    return driver if driver.timed else replace(driver, speed=1.0)


def task_of(problem: md.Problem, friction: str) -> md.Reactions:
    """Return the first sweep of a file at a few poses as a task of reactions."""
    sweep = next(task for task in problem.tasks.values() if isinstance(task, md.Sweep))
    keys: dict[str, Any] = {"poses": 5, "mode": sweep.mode, "friction": friction}
    if sweep.drivers is not None:
        return md.Reactions(drivers=tuple(map(in_motion, sweep.drivers)), **keys)
    driver = in_motion(sweep.driver)
    if driver.from_ is not None and driver.law is None:
        low, high = (
            problem.mechanism.with_values({}).values().get(x, x) if isinstance(x, str) else x
            for x in (driver.from_, driver.to)
        )
        at = tuple(float(low + (high - low) * share) for share in (0.07, 0.21, 0.43, 0.68, 0.89))
        driver = replace(driver, from_=None, to=None, at=at)
        del keys["poses"]
    elif driver.at is not None:
        del keys["poses"]
    return md.Reactions(driver, **keys)


@pytest.mark.parametrize(
    ("name", "friction"),
    [(name, 0.1) for name in NAMES] + [(name, 0.0) for name in ("belt-drive", "five-bar-robot")],
)
def test_books_of_predefined_mechanisms(name: str, friction: float) -> None:
    problem = md.load(name)
    mechanism = loaded(problem.mechanism, friction, seed=len(name))
    result = md.solve(mechanism, task_of(problem, "coupled" if friction else "none"))
    ok = [k for k, status in enumerate(result.status) if status == "ok"]
    assert len(ok) >= len(result) - 2, list(result.status)
    balance, laws = audit(mechanism, only_poses(result, ok))
    worst = float(np.nanmax(np.asarray(result.condition)[ok]))
    assert balance <= BALANCE * max(1.0, worst / 100)
    assert laws <= BALANCE * max(1.0, worst / 100)


FORCES = [  # of the plane; those of space are compared with free bodies in test_spatial_*.py
    (name, task)
    for name in library.names()
    if name not in REDUNDANT and predefined(name).mechanism.dimension == 2
    for task, own in predefined(name).tasks.items()
    if own.kind == "reactions"
]


@pytest.mark.parametrize(("name", "task"), FORCES)
def test_books_of_predefined_problems_with_forces(name: str, task: str) -> None:
    """Their reactions loads and friction, at nine poses apart from changes of direction."""
    problem = md.load(name)
    reactions = problem.tasks[task]
    driver = in_motion(reactions.driver)
    if driver.at is None:
        low, high = (problem.mechanism.values().get(x, x) for x in (driver.from_, driver.to))
        share = (np.arange(9) + 0.37) / 9
        driver = replace(driver, from_=None, to=None, at=tuple(low + (high - low) * share))
    reactions = replace(reactions, driver=driver, poses=None, cycle=False, outputs=None, find=(),
                  direction="driver")  # fmt: skip
    result = md.solve(problem, reactions)
    ok = [k for k, status in enumerate(result.status) if status in ("ok", "ambiguous")]
    if not ok:
        assert set(result.status) == {"jammed"}
        return
    balance, laws = audit(problem.mechanism, only_poses(result, ok), reactions.friction_radius)
    assert balance <= BALANCE
    assert reactions.friction != "coupled" or laws <= BALANCE


# -- the audit itself ------------------------------------------------------------------------------


def books(theta: np.ndarray) -> tuple[md.Mechanism, Poses]:
    """Return a slider-crank and its result as free bodies give it."""
    mechanism = slider_crank(inertia=True, gravity=(0, -9.81))
    radii = (S1["r_O"], S1["r_B"], S1["r_C"])
    scene, motion = free_slider_crank(
        theta,
        40.0,
        S1["r"],
        S1["l"],
        lambda v: np.where(v < 0, 1000, -200),
        tuple(circle(r, 0.1) for r in radii),
        S1["f_slide"],
        m_rod=1.2,
        I_rod=0.01,
        c_rod=0.1,
        m_slider=2.0,
        gravity=-9.81j,
    )
    found = scene.solve()
    zero = 0 * place(motion["crank"])
    turning = {"crank": motion["crank"], "rod": motion["rod"], "slider": None}
    bodies, points = {}, {}
    for name, angle in turning.items():
        series = (zero, zero, zero) if angle is None else (place(angle), rate(angle), second(angle))
        keys = ("angle", "angular_velocity", "angular_acceleration")
        bodies[name] = Row(zip(keys, series, strict=True))
    unit = np.exp(1j * place(motion["crank"]))
    end = place(motion["slide"])
    velocity = {"B": 40j * 0.1 * unit, "C": rate(motion["slide"]), "O": zero}
    position = {"B": 0.1 * unit, "C": end, "O": zero}
    acceleration = {"B": -160 * unit, "C": second(motion["slide"]), "O": zero}
    for point in ("crank.O", "crank.B", "rod.B", "rod.C", "slider.C"):
        at = point[-1]
        points[point] = Row(
            {
                key: np.stack([np.real(z), np.imag(z)], axis=1)
                for key, z in (
                    ("position", position[at]),
                    ("velocity", velocity[at]),
                    ("acceleration", acceleration[at]),
                )
            }
        )
    joints = {
        name: Row({"reaction": found.reaction(name), "loss": found.loss(name)})
        for name in ("O", "B", "C", "slide")
    }
    joints["slide"]["slide_velocity"] = rate(motion["slide"])
    joints["slide"]["normal"] = found["slide"][0]
    efforts = {"crank.angle": found["T"]}
    return mechanism, Poses(
        len(theta), bodies=bodies, points=points, joints=joints, efforts=efforts
    )


def test_free_bodies_keep_the_books() -> None:
    mechanism, result = books(np.array([0.4, 1.2, 3.5, 5.0]))
    assert max(audit(mechanism, result)) < 1e-15


@pytest.mark.parametrize("part", ["effort", "force", "torque", "loss", "normal", "side"])
def test_the_audit_finds_a_part_in_a_million(part: str) -> None:
    mechanism, result = books(np.array([0.4, 1.2, 3.5, 5.0]))
    joint = result.joints["slide" if part == "normal" else "B"]
    if part == "effort":
        result.efforts["crank.angle"] = result.efforts["crank.angle"] * (1 + 1e-5)
    elif part == "force":
        joint["reaction"][2, 0] *= 1 + 1e-6
    elif part == "torque":
        joint["reaction"][1, 2] *= 1 + 1e-6
    elif part == "loss":
        joint["loss"][3] *= 1 + 1e-6
    elif part == "normal":
        joint["normal"] = joint["normal"] * (1 + 1e-6)
    else:
        joint["reaction"][:, 2] *= -1
    assert max(audit(mechanism, result)) > 1e-9
