"""Forces on vector loops in space: points with masses, against Newton's law for each of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict

R, L, OMEGA, MB, MC, G, F = 0.05, 0.3, 20.0, 0.7, 1.3, 9.81, 0.15
PUSH = (10.0, -20.0, 30.0)
SLIDE = (np.radians(14.3), np.radians(23.0))


def direction(elevation: float, azimuth: float) -> Any:
    return np.array([
        np.cos(elevation) * np.cos(azimuth), np.sin(elevation), np.cos(elevation) * np.sin(azimuth)
    ])  # fmt: skip


def slider_crank(friction: float = 0.0, **more: Any) -> md.Problem:
    """Return a crank about y, a rod, a guide along a line in space; masses at both heads."""
    data = {
        "schema": 1,
        "title": "crank, rod and slide",
        "dimension": 3,
        "gravity": [0, -G, 0],
        "vectors": {
            "crank": {"length": R, "elevation": 0},
            "rod": {"length": L},
            "offset": {"length": 0.06, "elevation_deg": 63, "azimuth_deg": -29},
            "slide": {"elevation": SLIDE[0], "azimuth": SLIDE[1]},
        },
        "loops": {"closure": ["crank", "rod", "-slide", "-offset"]},
        "nodes": {"B": {"at": "crank.head"}, "C": {"at": "rod.head"}},
        "bodies": {"B": {"mass": MB}, "C": {"mass": MC}},
        "loads": {"push": {"kind": "force", "point": "C.C", "value": list(PUSH)}},
        "sketch": {"crank.azimuth": 0, "slide.length": 0.3},
        "tasks": {
            "turn": {
                "kind": "reactions",
                "driver": {"coordinate": "crank.azimuth", "at": [0.3, 1.7, 4.0], "speed": OMEGA,
                           "acceleration": 7.0},
            }
        },
    }  # fmt: skip
    if friction:
        data["vectors"]["slide"]["friction"] = friction  # type: ignore[index]
    return from_dict(data | more)


def newton(B: Any, C: Any, accelerations: Any, speed: float, f: float) -> tuple[Any, Any, Any]:
    """Return the forces on B by the crank, on C by the rod and on C by the guide."""
    a, c = accelerations
    weight = np.array([0, -G, 0])
    u, rod = direction(*SLIDE), (C - B) / L
    need = MC * c - MC * weight - np.array(PUSH)  # = T rod + N + friction along u
    guide, T = np.zeros(3), 0.0
    for _ in range(60):
        rub = -np.sign(speed) * f * np.linalg.norm(guide) * u
        T = (need - rub) @ u / (rod @ u)
        guide = need - rub - T * rod
    return MB * a - MB * weight + T * rod, T * rod, guide + rub


@pytest.mark.parametrize("f", [0.0, F])
def test_a_slider_crank_of_vectors_presses_as_newton_says(f: float) -> None:
    result = md.solve(slider_crank(f), "turn")
    assert result.fault is None
    assert max(result.checks.values()) < 1e-13
    B, C = result.points["B.B"], result.points["C.C"]
    for k in range(3):
        crank, rod, guide = newton(
            B.position[k], C.position[k], (B.acceleration[k], C.acceleration[k]),
            result.joints["slide"].length_velocity[k], f,
        )  # fmt: skip
        way = B.position[k]
        round_ = np.array([-way[2], 0, way[0]])  # dB / d azimuth
        effort = crank @ round_
        assert result.efforts["crank.azimuth"][k] == pytest.approx(effort, rel=1e-11, abs=1e-11)
        size = np.linalg.norm(crank)
        held = crank - effort * round_ / (round_ @ round_)  # the drive is no part of it
        for name, own in (("crank", held), ("rod", rod), ("slide", guide)):
            reaction = result.joints[name].reaction[k]
            assert np.abs(reaction[:3] - own).max() < 1e-12 * size, name
            assert np.abs(reaction[3:]).max() < 1e-12 * size
    if f:
        lost = result.joints["slide"].loss
        assert (lost > 0).all()
        driven = result.efforts["crank.azimuth"] * OMEGA
        assert np.isfinite(driven).all()


def test_what_drives_a_vector_has_its_unit() -> None:
    result = md.solve(slider_crank(), "turn")
    assert "effort [N m]" in str(result)


def test_a_spherical_pendulum_of_one_vector_moves_in_a_circle() -> None:
    """A conical pendulum about y: w^2 = g / (l cos(angle to the vertical))."""
    length, angle = 0.8, 0.5
    w = np.sqrt(G / (length * np.cos(angle)))
    data = {
        "schema": 1,
        "title": "a mass on a string",
        "dimension": 3,
        "gravity": [0, -G, 0],
        "vectors": {
            "string": {"length": length},
            "level": {"azimuth": 0, "elevation": 0},
            "across": {"azimuth": np.pi / 2, "elevation": 0},
            "up": {"azimuth": 0, "elevation": np.pi / 2},
        },
        "loops": {"closure": ["string", "-up", "-across", "-level"]},
        "nodes": {"P": {"at": "string.head"}},
        "bodies": {"P": {"mass": 2.0}},
        "sketch": {"string.elevation": -(np.pi / 2 - angle), "string.azimuth": 0.0},
        "tasks": {
            "go": {
                "kind": "motion",
                "start": {"string.elevation": -(np.pi / 2 - angle), "string.azimuth": 0.0},
                "start_speed": {"string.elevation": 0, "string.azimuth": w},
                "until": 2.0,
                "poses": 5,
                "tolerance": 1e-12,
            }
        },
    }
    result = md.solve(from_dict(data), "go")
    assert result.fault is None
    t, s = result.time, length * np.sin(angle)
    wanted = np.stack([s * np.cos(w * t), np.full(5, -length * np.cos(angle)), s * np.sin(w * t)])
    assert np.abs(result.points["P.P"].position - wanted.T).max() < 1e-10
    pull = 2.0 * G / np.cos(angle)
    assert np.linalg.norm(result.joints["string"].reaction[:, :3], axis=1) == pytest.approx(pull)
    assert result.checks["energy"] < 1e-12
    assert result.checks["balance"] < 1e-12


def test_a_slide_of_vectors_comes_to_rest() -> None:
    """A mass that slides down a rough line: a = g (sin - f cos), up it stops for good."""
    slope = 0.3
    data = {
        "schema": 1,
        "title": "a rough line",
        "dimension": 3,
        "gravity": [0, -G, 0],
        "vectors": {
            "line": {"elevation": slope, "azimuth": 0.4, "friction": 0.5},
            "tie": {},
        },
        "loops": {"closure": ["line", "-tie"]},
        "nodes": {"P": {"at": "line.head"}},
        "bodies": {"P": {"mass": 2.0}},
        "sketch": {"line.length": 1.0, "tie.length": 1, "tie.elevation": slope,
                   "tie.azimuth": 0.4},
        "tasks": {"go": {"kind": "motion", "start": {"line.length": 1.0},
                         "start_speed": {"line.length": 3.0}, "until": 2.0}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "go")
    a = G * (np.sin(slope) + 0.5 * np.cos(slope))
    assert [event.kind for event in result.events] == ["stick"]
    assert result.events[0].time == pytest.approx(3.0 / a, rel=1e-11)
    assert result.joints["line"].length[-1] == pytest.approx(1 + 9 / (2 * a), rel=1e-11)


@pytest.mark.parametrize(
    ("where", "keys", "message"),
    [
        ("loads.push.frame", {"loads": {"push": {
            "kind": "force", "point": "C.C", "value": [1, 0, 0], "frame": "B"}}}, "does not turn"),
        ("loads.push.body", {"loads": {"push": {
            "kind": "torque", "body": "B", "value": [1, 0, 0]}}}, "does not turn"),
        ("bodies.B.inertia", {"bodies": {"B": {"mass": 1, "inertia": [1, 1, 1]}}}, "a point"),
        ("bodies.link.points", {"bodies": {"link": {"mass": 1}}}, "has no point"),
    ],
)  # fmt: skip
def test_what_points_cannot_have_is_refused(where: str, keys: Any, message: str) -> None:
    with pytest.raises(md.InputError, match=message) as told:
        md.solve(slider_crank(**keys), "turn")
    assert str(told.value.where).endswith(where)


def test_friction_needs_a_given_direction() -> None:
    with pytest.raises(md.InputError, match="does not slide along a direction") as told:
        slider_crank(vectors={"crank": {"length": R}, "rod": {"friction": 0.1}},
                     loops={"closure": ["crank", "-rod"]}, nodes={}, bodies={}, loads={},
                     sketch={}, tasks={})  # fmt: skip
    assert str(told.value.where).endswith("vectors.rod.friction")
