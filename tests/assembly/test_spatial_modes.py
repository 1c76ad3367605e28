"""All modes of spatial groups by paths: six legs and rings of hinges, against data and matrices."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.additions import of_cases
from mechdae.motion.assembly import group_search
from tests.shared.paths import DATA
from tests.shared.space import ring_of_seven


def modes(mechanism, coordinate, value):
    return md.solve(mechanism, md.Modes(md.Driver(coordinate, at=(value,))))


def six_legs(base, platform, legs, links=False):
    """Return a platform on bars, or on links with two ball joints; the first foot is on a slide."""
    feet = {f"B{k}": tuple(place) for k, place in enumerate(base)}
    tops = {f"P{k}": tuple(place) for k, place in enumerate(platform)}
    bodies = [md.Body("foot", {"B0": (0, 0, 0)}), md.Body("platform", tops)]
    joints = [md.SpatialPrismatic("slide", "ground.B0", "foot.B0", axis=(1, 0, 0))]
    for k, length in enumerate(legs):
        foot = f"{'ground' if k else 'foot'}.B{k}"
        if links:
            bodies.append(md.Body(f"leg{k}", {"B": (0, 0, 0), "P": (length, 0, 0)}))
            joints.append(md.Spherical(f"b{k}", foot, f"leg{k}.B"))
            joints.append(md.Spherical(f"p{k}", f"leg{k}.P", f"platform.P{k}"))
        else:
            joints.append(md.Distance(f"l{k}", foot, f"platform.P{k}", length=length))
    return md.Mechanism(
        dimension=3, ground=md.Ground(feet), bodies=bodies, joints=joints, sketch={"slide": 0.0}
    )


def test_the_forty_modes_of_dietmaier_are_proven() -> None:
    found = md.solve("stewart-gough", "modes")
    assert found.summary["count"] == 40
    assert found.summary["proven"]
    assert "40 complex poses are certified" in found.summary["basis"]
    assert "search" not in found.summary
    data = json.loads((DATA / "stewart_dietmaier_40.json").read_text(encoding="utf-8"))
    places = found.points["platform.P1"].position
    for solution in data["solutions"]:
        wanted = np.array([float(text) for text in solution["x"]])[:3]
        assert np.abs(places - wanted).max(axis=1).min() < 1e-9


def test_platforms_on_links_and_with_shared_points() -> None:
    platforms = json.loads((DATA / "stewart_gough.json").read_text(encoding="utf-8"))["platforms"]
    for case, links in zip(platforms, (True, False, True, False, True), strict=True):
        numbers = [np.array(case[word], float) for word in ("base", "platform", "legs")]
        found = modes(six_legs(*numbers, links=links), "slide.slide", 0.0)
        assert found.summary["count"] == case["count_real"]
        whole = case["count_complex"] == 40
        assert found.summary["proven"] == whole
        assert found.summary.get("singular_paths", 0) == 40 - case["count_complex"]
        if not whole:
            assert f"{case['count_complex']} of 40 complex poses" in found.summary["basis"]
            assert found.summary["search"]
        lengths = np.linalg.norm(
            [found.points[f"platform.P{k}"].position - numbers[0][k] for k in range(6)], axis=2
        )
        assert np.abs(lengths.T - numbers[2]).max() < 1e-9


def test_rings_of_seven_hinges_are_proven(monkeypatch) -> None:
    rng = np.random.default_rng(5)
    for backwards in (False, True, True):
        mechanism, first, world = ring_of_seven(rng, backwards)
        found = modes(mechanism, "J0.angle", first)
        assert found.summary["proven"]
        assert "16 complex poses are certified" in found.summary["basis"]
        assert found.summary["count"] % 2 == 0
        assert found.summary["count"] <= 16
        # the pose it was drawn in is one of them
        places = np.stack([found.points[f"b{k}.P{k}"].position for k in range(1, 7)], axis=1)
        assert np.abs(places - world).max(axis=(1, 2)).min() < 1e-9
        # a search from many starts finds no others
        with monkeypatch.context() as patch:
            patch.setattr(group_search, "of_cases", without_paths)
            searched = modes(mechanism, "J0.angle", first)
        others = np.stack([searched.points[f"b{k}.P{k}"].position for k in range(1, 7)], axis=1)
        assert not searched.summary["proven"]
        assert len(others) <= len(places)
        for own in others:
            assert np.abs(places - own).max(axis=(1, 2)).min() < 1e-8


def farthest(found: Any, searched: Any) -> float:
    """Return how far from poses that were found those that were searched are, by exp(i theta)."""
    ours, theirs = (
        np.exp(1j * np.stack([result.joints[f"J{k}"].angle for k in range(1, 7)], axis=1))
        for result in (found, searched)
    )
    return float(np.abs(ours[:, None] - theirs).max(axis=2).min(axis=0).max())


def without_paths(question: str) -> list[Any]:
    """Return what finds whole groups, but not by paths."""
    return of_cases(question) if question == "finders" else []


def test_an_arm_with_a_wrist_is_proven_and_the_search_finds_no_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two of its axes are parallel, the last three meet (Pieper 1968: eight poses)."""
    found = md.solve("six-axis-arm", "modes")
    assert (found.summary["count"], found.summary["proven"]) == (8, True)
    assert "8 complex poses, as many as there can be" in found.summary["basis"]
    monkeypatch.setattr(group_search, "of_cases", without_paths)
    searched = md.solve("six-axis-arm", "modes")
    assert searched.summary["count"] == 8
    assert farthest(found, searched) < 1e-9


def test_arms_with_parallel_axes_and_no_wrist_are_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = md.load("six-axis-arm")
    arm = problem.mechanism
    roll = md.Body("roll", {"W": (0, 0, 0), "V": (0, 0.05, 0.02)})
    bend = replace(arm.joints["J5"], first="roll.V")
    arm = replace(arm, bodies={**arm.bodies, "roll": roll}, joints={**arm.joints, "J5": bend})
    problem = replace(problem, mechanism=arm)
    found = md.solve(problem, "modes")
    assert found.summary["proven"]
    assert "eigenvalues: 16 complex poses are certified" in found.summary["basis"]
    monkeypatch.setattr(group_search, "of_cases", without_paths)
    searched = md.solve(problem, "modes")
    assert searched.summary["basis"].endswith("search from many starts")
    assert farthest(found, searched) < 1e-9


def test_an_arm_with_three_parallel_axes_is_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    """Axes as those of a UR, whose wrist has none that meet in a point."""
    problem = md.load("six-axis-arm")
    arm, joints = problem.mechanism, problem.mechanism.joints
    roll = md.Body("roll", {"W": (0, 0, 0), "V": (0, 0.1, 0)})
    bend = md.Body("bend", {"W": (0, 0, 0), "U": (0, 0, 0.1)})
    turned = {
        "J4": replace(joints["J4"], axis=(0, 1, 0), zero=(1, 0, 0)),
        "J5": replace(joints["J5"], first="roll.V", axis=(0, 0, 1), zero=(1, 0, 0)),
        "J6": replace(joints["J6"], first="bend.U"),
    }
    bodies = {**arm.bodies, "roll": roll, "bend": bend}
    problem = replace(problem, mechanism=replace(arm, bodies=bodies, joints={**joints, **turned}))
    found = md.solve(problem, "modes")
    assert (found.summary["count"], found.summary["proven"]) == (8, True)
    assert "three axes are parallel: 8 complex poses" in found.summary["basis"]
    monkeypatch.setattr(group_search, "of_cases", without_paths)
    searched = md.solve(problem, "modes")
    assert farthest(found, searched) < 1e-9
