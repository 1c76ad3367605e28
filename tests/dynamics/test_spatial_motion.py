"""Motions in space against references of 34 digits, closed forms and free bodies."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.attack.spatial_honesty import case, platform
from tests.reference.spatial_bodies import rotation
from tests.reference.tops import free_body, top
from tests.shared.paths import DATA
from tests.shared.planting import Slip, plant
from tests.shared.spatial_forces import massive, pose_of
from tests.shared.turning import ACROSS, ARM, AXIAL, MASS, G, heavy_top, pinned, started


def states(name: str) -> list[dict[str, Any]]:
    data = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    return [own for own in data["states"] if float(own["t"]) <= 10]


def moved(mechanism: md.Mechanism, **keys: Any) -> md.Result:
    return md.solve(mechanism, md.Motion(**{"tolerance": 1e-12, **keys}))


# -- references ------------------------------------------------------------------------------


@pytest.mark.parametrize(("reading", "section"), [("slender", 0.0), ("square", 0.1)])
def test_bricards_mechanism_has_nine_digits_after_ten_seconds(reading: str, section: float) -> None:
    wanted = states(f"iftomm_a04_bricard_{reading}")
    times = tuple(float(own["t"]) for own in wanted)
    task = md.Motion(start={"J0.angle": 0}, at=times, tolerance=1e-12)
    result = md.solve("bricard", task, set={"section": section})
    for k, own in enumerate(wanted):
        place = np.array([float(value) for value in own["P3"]])
        assert np.abs(result.points["b3.P3"].position[k] - place).max() < 1e-9
        rates = np.array([result.outputs[name].rate[k] for name in "ab"])
        assert np.abs(rates - [float(value) for value in own["v"]]).max() < 2e-9
    assert result.fault is None
    assert result.summary["freedoms"] == 1
    assert result.summary["superfluous_equations"] == 1
    assert result.summary["not_unique"] == [f"J{k}" for k in range(6)]
    assert result.summary["drift"] < 1e-14
    assert result.checks["energy"] < 1e-9
    assert result.checks["balance"] < 1e-13
    assert "S2" in str(result.summary["notes"])


def test_the_flyball_governor_has_nine_digits_after_ten_seconds() -> None:
    wanted = states("iftomm_a05_flyball")
    task = md.load("flyball-governor-springs").tasks["motion"]
    times = tuple(float(own["t"]) for own in wanted)
    keys = {"start": task.start, "start_speed": task.start_speed}
    result = md.solve("flyball-governor-springs", md.Motion(**keys, at=times))
    for k, own in enumerate(wanted):
        found = [result.outputs[name].value[k] for name in ("psi", "alpha1", "alpha2", "s")]
        assert np.abs(np.array(found) - [float(value) for value in own["q"]]).max() < 1e-9
    assert result.checks["balance"] < 1e-13
    momentum = 0.0
    for name, mass in (("ball1", 5.0), ("ball2", 5.0)):
        r, v = (result.points[f"{name}.E"][word] for word in ("position", "velocity"))
        momentum = momentum + mass * np.cross(r, v)[:, 2]
    momentum = momentum + 3.0 * 0.01 / 6 * result.bodies["slider"].angular_velocity[:, 2]
    whole = float(wanted[0]["angular_momentum"])
    alpha = result.outputs["alpha1"].value
    along, across = 0.3e-4 / 6, 0.3 * (1 + 1e-4) / 12
    rods = 0.3 * (0.05 + np.cos(alpha) / 2) ** 2
    rods = rods + along * np.sin(alpha) ** 2 + across * np.cos(alpha) ** 2
    spin = result.bodies["shaft"].angular_velocity[:, 2]
    momentum = momentum + (2 * rods + 0.3e-4 / 6) * spin
    assert np.abs(momentum / whole - 1).max() < 1e-12


def test_six_digits_of_the_governor_take_less_than_600_implicit_steps() -> None:
    last = next(own for own in states("iftomm_a05_flyball") if own["t"] == "10")
    task = md.load("flyball-governor-springs").tasks["motion"]
    keys = {"start": task.start, "start_speed": task.start_speed, "until": 10.0}
    problem = "flyball-governor-springs"
    result = md.solve(problem, md.Motion(**keys, tolerance=1e-6, method="radau"))
    found = [result.outputs[name].value[-1] for name in ("psi", "alpha1", "alpha2", "s")]
    assert np.abs(np.array(found) - [float(value) for value in last["q"]]).max() < 2e-7
    assert result.summary["steps"] <= 600
    assert result.checks["energy"] < 1e-6


def test_a_stiff_motion_by_the_implicit_method() -> None:
    (last,) = [own for own in states("iftomm_a05_flyball") if own["t"] == "1"]
    task = md.load("flyball-governor-springs").tasks["motion"]
    keys = {"start": task.start, "start_speed": task.start_speed}
    result = md.solve(
        "flyball-governor-springs", md.Motion(**keys, until=1.0, tolerance=1e-8, method="bdf")
    )
    assert abs(result.outputs["s"].value[-1] - float(last["q"][3])) < 1e-6
    assert result.summary["steps"] < 1000


# -- closed forms ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tilt", "precession", "spin"), [(0.5, 0.0, 40.0), (1.2, 3.0, 12.0), (2.2, 2.0, 0.0)]
)
def test_a_top_nods_and_precesses_as_the_elliptic_functions_say(
    tilt: float, precession: float, spin: float
) -> None:
    s, c = np.sin(tilt), np.cos(tilt)
    # the spin is the component on the axis, the precession turns the axis about the vertical
    w = precession * np.array([0, 0, 1.0]) + (spin - precession * c) * np.array([s, 0, c])
    times = [0.3, 1.0, 2.5]
    sketch = {"top.P": (s, 0, c)}
    mechanism = heavy_top(sketch=sketch)
    result = moved(mechanism, at=(0.0, *times), tolerance=1e-13, **started(tilt, w))
    P = result.points["top.P"].position
    A = ACROSS + MASS * ARM**2
    for k, t in enumerate(times, start=1):
        u, phi = top(A, AXIAL, MASS * G * ARM, tilt, (precession, spin), t)
        assert abs(P[k, 2] - u) < 1e-11
        wanted = np.sqrt(1 - u * u) * np.array([np.cos(phi), np.sin(phi)])
        assert np.abs(P[k, :2] - wanted).max() < 1e-11
    R = np.array([rotation(own) for own in result.bodies["top"].orientation])
    L = np.einsum(
        "nij,j,nkj,nk->ni", R, [A, A, AXIAL], R, result.bodies["top"].angular_velocity
    )  # fmt: skip
    size = np.abs(L).max()
    assert np.ptp(L[:, 2]) < 1e-12 * size
    assert np.ptp(np.einsum("ni,ni->n", L, R[:, :, 2])) < 1e-12 * size
    energy = result.scalars["energy"]
    assert np.ptp(energy) < 1e-12 * np.abs(energy).max()
    assert result.summary["drift"] < 1e-14


def test_a_free_body_turns_as_jacobis_functions_say() -> None:
    inertia, w = (0.1, 0.2, 0.3), (2.0, 3.0)
    times = [0.7, 3.0, 10.0]
    keys = started(0.0, [w[0], 0.0, w[1]])
    result = moved(pinned(inertia), at=(0.0, *times), tolerance=1e-13, **keys)
    R = np.array([rotation(own) for own in result.bodies["top"].orientation])
    spin = result.bodies["top"].angular_velocity
    for k, t in enumerate(times, start=1):
        assert np.abs(R[k].T @ spin[k] - free_body(inertia, w, t)).max() < 1e-11
    L = np.einsum("nij,j,nkj,nk->ni", R, inertia, R, spin)
    assert np.ptp(L, axis=0).max() < 1e-12 * np.abs(L).max()
    assert np.ptp(result.scalars["energy"]) < 1e-12 * result.scalars["energy"][0]
    assert np.abs(result.joints["O"].reaction).max() < 1e-12


def test_a_slender_rod_on_a_cross_is_a_spherical_pendulum() -> None:
    length, tilt, precession, t = 0.8, 2.0, 1.5, 1.3
    rod = md.Body(
        "rod", {"O": (0, 0, 0), "E": (0, 0, length)}, mass=MASS, center=(0, 0, length / 2),
        inertia=(MASS * length**2 / 12, MASS * length**2 / 12, 0),
    )  # fmt: skip
    place = (length * np.sin(tilt), 0, length * np.cos(tilt))
    cross = md.Universal("O", "ground.O", "rod.O", axis=(1, 0, 0), axis2=(0, 1, 0))
    mechanism = md.Mechanism(
        dimension=3, ground=md.Ground({"O": (0, 0, 0)}), bodies=[rod], joints=[cross],
        gravity=(0, 0, -G), sketch={"rod.E": place},
    )  # fmt: skip
    speed = length * np.sin(tilt) * precession
    result = moved(
        mechanism, start={"rod.E.x": place[0], "rod.E.y": 0}, at=(0.0, t), tolerance=1e-13,
        start_speed={"rod.E.x": 0, "rod.E.y": speed},
    )  # fmt: skip
    A = MASS * length**2 / 3
    u, phi = top(A, AXIAL, MASS * G * length / 2, tilt, (precession, 0.0), t)
    wanted = [*(np.sqrt(1 - u * u) * np.array([np.cos(phi), np.sin(phi)])), u]
    assert np.abs(result.points["rod.E"].position[1] / length - wanted).max() < 1e-11


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_digits_do_not_depend_on_the_unit_of_length(size: float) -> None:
    w = [3.0, 1.0, 20.0]
    one = moved(heavy_top(), at=(0.5, 1.0), tolerance=1e-11, **started(0.6, w))
    other = moved(heavy_top(size), at=(0.5, 1.0), tolerance=1e-11, **started(0.6, w, size))
    assert other.summary["steps"] == one.summary["steps"]
    gap = other.points["top.P"].position / size - one.points["top.P"].position
    assert np.abs(gap).max() < 1e-13
    reactions = other.joints["O"].reaction[:, :3] / size - one.joints["O"].reaction[:, :3]
    assert np.abs(reactions).max() < 1e-11 * np.abs(one.joints["O"].reaction).max()


# -- free bodies -----------------------------------------------------------------------------


def off_free_bodies(result: md.Result) -> float:
    """Return the largest difference of reactions to those of free bodies, relative."""
    worst = 0.0
    for k in range(len(result.time)):
        reactions, _, left, (stresses, _) = pose_of(result, k).solve()
        worst = max(worst, left)
        size = max(float(np.abs(own).max()) for own in reactions.values())
        for name, own in reactions.items():
            assert np.abs(stresses[name]).max(initial=0.0) < 1e-9
            gap = np.abs(result.joints[name].reaction[k] - own).max()
            worst = max(worst, float(gap) / size)
    return worst


@pytest.mark.parametrize("loop", ["RSUR", "RHSC", "RDP"])
def test_loops_move_and_press_as_their_free_bodies_do(loop: str) -> None:
    mechanism = massive(case(np.random.default_rng(5), loop).mechanism, seed=7)
    result = moved(
        mechanism, start={"J0.angle": 0.0}, start_speed={"J0.angle": 2.0}, until=0.05, poses=3
    )
    assert result.fault is None
    assert off_free_bodies(result) < 1e-12
    assert result.checks["energy"] < 1e-9
    assert result.checks["balance"] < 1e-12


def test_a_plate_on_six_bars_moves_with_its_quaternion() -> None:
    mechanism = massive(platform(np.random.default_rng(4)).mechanism)
    result = moved(
        mechanism, start={"J0.angle": 0.0}, start_speed={"J0.angle": 1.0}, until=0.05, poses=2
    )
    assert off_free_bodies(result) < 1e-12
    assert result.checks["energy"] < 1e-9


def test_a_law_of_time_takes_the_effort_of_a_task_of_reactions() -> None:
    mechanism = massive(case(np.random.default_rng(5), "RSRC").mechanism, seed=7)
    law = md.Driver("J0.angle", law="0.3*sin(2*t)")
    result = moved(mechanism, drivers=[law], at=(0.2,))
    t = 0.2
    rates = {"speed": 0.6 * np.cos(2 * t), "acceleration": -1.2 * np.sin(2 * t)}
    sweep = md.Reactions(driver=md.Driver("J0.angle", at=[0.3 * np.sin(2 * t)], **rates))
    wanted = md.solve(mechanism, sweep)
    size = np.abs(wanted.joints["J1"].reaction).max()
    assert abs(result.efforts["J0.angle"][0] - wanted.efforts["J0.angle"][0]) < 1e-10 * size
    for name in mechanism.joints:
        gap = result.joints[name].reaction[0] - wanted.joints[name].reaction[0]
        assert np.abs(gap).max() < 1e-10 * size


# -- what the result says itself -------------------------------------------------------------


@pytest.mark.parametrize(
    ("place", "right", "wrong"),
    [
        ("equations.tree.solid", "J @ turning + ca.cross(spin, J @ spin)", "J @ turning"),
        ("equations.tree.solid", "energy += ca.dot(spin, J @ spin) / 2", "energy += 0"),
        ("equations.tree.released_tree", "value += ca.dot(turned, others)",
         "value += 2 * ca.dot(turned, others)"),
        ("equations.tree.screws", "acceleration += 2 * ca.cross(carried, going)",
            "acceleration += 0"),
    ],
)  # fmt: skip
def test_mistakes_in_the_equations_are_told_by_the_checks(
    place: str, right: str, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if place.endswith("screws"):
        mechanism = massive(case(np.random.default_rng(5), "RHSC").mechanism, seed=7)
        keys = {"start": {"J0.angle": 0.0}, "start_speed": {"J0.angle": 2.0}, "until": 0.05}
    else:
        mechanism = pinned((0.1, 0.2, 0.3), (0.1, 0.2, 0.3), G, sketch={"top.P": (0, 0, 1)})
        keys = {**started(0.4, [1.0, 2.0, 3.0]), "until": 0.3}
    plant(Slip(place, right, wrong, lambda: 0.0, ""), monkeypatch)
    monkeypatch.setattr("mechdae.motion.kinematics.prepared.SHAPES.get", lambda key: None)
    result = moved(mechanism, **keys)
    assert result.fault is not None
    assert max(result.checks.values()) > 1e-6
