"""Bodies led at three points, against an elimination in fractions."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.cases.space.triangle import PointCourse, triangles
from tests.reference.three_points import ExactCourse, first_unknowns
from tests.shared.three_points import KINDS, MOST, DrawnPlatform

pytest.importorskip("flint", reason="python-flint is not installed")


def inexact(own: ExactCourse) -> PointCourse:
    """Return a course in floating point."""
    c, u, v = (np.array([float(x) for x in part]) for part in (own.centre, own.u, own.v))
    return PointCourse(c, np.column_stack([u, v, np.cross(u, v)]), float(own.radius), own.straight)


@pytest.mark.parametrize("kind", ["6-3", "one line", "two lines", "three lines"])
def test_as_many_places_as_elimination_finds(kind: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(12):
        drawn = DrawnPlatform(rng, kind)
        wanted, count = first_unknowns(drawn.courses, drawn.squares)
        distances = [float(square) ** 0.5 for square in drawn.squares]
        courses = [inexact(own) for own in drawn.courses]
        found = triangles(courses, distances)
        assert found is not None
        assert found.proven
        assert found.regular == found.most == count == MOST.get(kind, 16)
        ours = found.values[:, 0] if courses[0].straight else np.tan(found.values[:, 0] / 2)
        assert np.allclose(np.sort(ours), wanted, rtol=1e-7, atol=1e-7)  # two nearly meet
        for values in found.values:
            P = [own.at(value) for own, value in zip(courses, values, strict=True)]
            gaps = [np.linalg.norm(P[i] - P[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
            assert np.allclose(gaps, distances, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_all_modes_of_platforms_on_three_legs(kind: str) -> None:
    drawn = DrawnPlatform(np.random.default_rng(3), kind)
    found = md.solve(drawn.mechanism, drawn.task)
    places, _ = drawn.wanted()
    assert found.summary["proven"]
    most = MOST.get(kind, 16)
    assert f"elimination: {most} complex poses are certified" in found.summary["basis"]
    assert "search" not in found.summary
    ours = found.points["top.B0"].position
    assert len(ours) == len(places) > 0
    for place in places:
        assert np.abs(ours - place).max(axis=1).min() < 1e-9
    corners = np.stack([found.points[f"top.B{k}"].position for k in range(3)])
    for (i, j), square in zip(((0, 1), (1, 2), (0, 2)), drawn.squares, strict=True):
        assert np.allclose(np.linalg.norm(corners[i] - corners[j], axis=1) ** 2, float(square))


def three_rps(slides: tuple[float, float, float], turned: bool = False) -> Any:
    """Return an even 3-RPS platform, or the same with the platform held (3-SPR)."""
    out = [(np.cos(a), np.sin(a), 0.0) for a in 2 * np.pi * np.arange(3) / 3]
    base = {f"A{k}": own for k, own in enumerate(out)}
    above = {f"B{k}": tuple(0.6 * x for x in own) for k, own in enumerate(out)}
    lower, upper = ("top", "ground") if turned else ("ground", "top")
    joints: list[Any] = []
    for k, (x, y, _) in enumerate(out):
        joints += [
            md.SpatialRevolute(f"R{k}", f"{lower}.A{k}", f"low{k}.A", axis=(-y, x, 0),
                               zero=(0, 0, 1), axis2=(0, 1, 0), zero2=(0, 0, 1)),
            md.SpatialPrismatic(f"P{k}", f"low{k}.A", f"up{k}.B", axis=(0, 0, 1), zero=(1, 0, 0)),
            md.Spherical(f"S{k}", f"up{k}.B", f"{upper}.B{k}"),
        ]  # fmt: skip
    legs = [body for k in range(3) for body in (
        md.Body(f"low{k}", {"A": (0, 0, 0)}), md.Body(f"up{k}", {"B": (0, 0, 0)}))]  # fmt: skip
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground(above if turned else base),
        bodies=[*legs, md.Body("top", base if turned else above)],
        joints=joints,
    )
    drivers = tuple(md.Driver(f"P{k}.slide", at=(own,)) for k, own in enumerate(slides))
    return mechanism, md.Modes(drivers=drivers)


def test_legs_that_begin_on_the_platform() -> None:
    """Seen from its platform a 3-RPS is a 3-SPR: as many modes, the same turns of its hinges."""
    slides = (1.2, 1.25, 1.3)
    one, other = (md.solve(*three_rps(slides, turned)) for turned in (False, True))
    assert one.summary["proven"]
    assert other.summary["proven"]
    turns = [
        np.stack([result.joints[f"R{k}"].angle for k in range(3)], axis=1)
        for result in (one, other)
    ]
    assert len(turns[0]) == len(turns[1]) == 8
    for own in turns[0]:
        gaps = np.abs(np.exp(1j * turns[1]) - np.exp(1j * own)).max(axis=1)
        assert gaps.min() < 1e-9


def test_even_legs_short_legs_and_a_flat_platform() -> None:
    """Even legs: the platform level at the height of a triangle; legs as long as the gap: flat."""
    even = md.solve(*three_rps((1.2, 1.2, 1.2)))
    assert even.summary["proven"]
    centre = even.points["top.B0"].position
    level = np.abs(centre - [0.6, 0, np.sqrt(1.44 - 0.16)]).max(axis=1)
    assert level.min() < 1e-9
    short = md.solve(*three_rps((0.2, 0.2, 0.2)))
    assert (short.summary["count"], short.summary["proven"]) == (0, True)
    flat = md.solve(*three_rps((0.4, 0.4, 0.4)))
    assert not flat.summary["proven"]
    assert "8 of 16 complex poses are certified" in flat.summary["basis"]


def test_legs_that_are_too_short_stay_open_by_a_length() -> None:
    """The platform must not grow, which a quaternion longer than 1 would let it: it said "1".

    Tips are a triangle of 0.8 around the middle at least, the platform's points one of 0.6.
    """
    mechanism, asked = three_rps((0.2, 0.2, 0.2))
    with pytest.raises(md.AssemblyError) as caught:
        md.solve(mechanism, md.Sweep(drivers=asked.drivers))
    found = re.search(r"joint S[0-2] stays open by (\S+) m", str(caught.value))
    assert found is not None, str(caught.value)
    assert 0.2 * np.sqrt(3) - 1e-3 < float(found[1]) < 1.6


def test_pairs_of_bars_that_do_not_meet() -> None:
    drawn = DrawnPlatform(np.random.default_rng(3), "6-3")
    first = next(j for j in drawn.mechanism.joints.values() if j.name == "L00")
    bars = [
        replace(joint, length=10.0) if joint is first else joint
        for joint in drawn.mechanism.joints.values()
    ]
    found = md.solve(replace(drawn.mechanism, joints={j.name: j for j in bars}), drawn.task)
    assert (found.summary["count"], found.summary["proven"]) == (0, True)
    assert "two legs at one point do not meet" in found.summary["basis"]
