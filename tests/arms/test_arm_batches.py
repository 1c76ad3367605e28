"""Arms at many places of their hands: each pose drawn is among those found, all lead back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.numerics.arms.chain import arm_of_axes
from tests.shared.arms import ARMS, forward, nearby, product

TURN = 2 * np.pi


def drawn(name: str, n: int, seed: int = 1) -> tuple[Any, Any, Any]:
    """Return an arm, joint angles drawn at random and places of its hand, by elementary motions."""
    links = np.array(ARMS[name], float)
    angles = np.random.default_rng(seed).uniform(-np.pi, np.pi, size=(n, 6))
    return links, angles, np.stack([forward(links, row) for row in angles])


def gaps(angles: Any, one: Any) -> Any:
    """Return how far poses (n, k, 6) are from one pose of each row (n, 6)."""
    return np.abs(np.exp(1j * angles) - np.exp(1j * one)[:, None]).max(axis=2)


@pytest.mark.parametrize("name", ARMS)
def test_poses_drawn_are_among_those_found(name: str) -> None:
    n = 12
    links, angles, hands = drawn(name, n)
    found = md.arm_poses(links, hands)
    assert len(found) == n
    assert np.nanmin(gaps(found.angles, angles), axis=1).max() < 1e-8
    assert found.proven.sum() >= n - 1
    assert set(found.status) <= {"ok", "unproven"}
    assert (found.counts[found.proven] % 2 == 0).all()
    size = np.abs(links[:, [0, 2]]).sum()
    for row, hand in zip(found, hands, strict=True):
        assert np.isfinite(row.bounds).all()
        for pose in row.angles:
            assert np.abs(forward(links, pose) - hand).max() < 1e-9 * (1 + size)
        between = np.abs(np.exp(1j * row.angles[:, None]) - np.exp(1j * row.angles)).max(axis=2)
        assert (between + np.eye(len(between)) > 1e-6).all()


def test_closed_forms_and_eigenvalues_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    """Arms near special ones have their poses, found in another way, and 16 in all."""
    for name in ("ur5e", "kr6", "parallel, quartic"):
        links, _, hands = drawn(name, 3)
        closed = md.arm_poses(links, hands)
        nearly = links + np.random.default_rng(3).normal(size=links.shape) * 1e-8
        general = md.arm_poses(nearly, hands)
        assert (closed.most, general.most) == (8, 16)
        for row, every in zip(closed, general, strict=True):
            for pose in row.angles:
                near = np.abs(np.exp(1j * every.angles) - np.exp(1j * pose)).max(axis=1)
                assert near.min() < 1e-5


def test_certificates_hold_of_poses_alone() -> None:
    """Newton's method doubles digits; a place off a pose is refused, and so is its mirror."""
    off, held = nearby("kr6", 1e-3, 3)
    assert held
    assert off < 1e-9
    assert not nearby("kr6", 0.02, 1)[1]
    for name in ("kr6", "ur5e", "general"):
        links, angles, hands = drawn(name, 20, seed=8)
        found = md.arm_poses(links, hands)
        off_drawn = np.where(np.isnan(found.bounds), np.inf, gaps(found.angles, angles))
        nearest = off_drawn.argmin(axis=1)
        rows = np.arange(20)
        assert (off_drawn[rows, nearest] <= found.bounds[rows, nearest]).all()
        assert np.nanmax(found.bounds) < 1e-6


def test_each_row_has_its_status() -> None:
    links, angles, _ = drawn("kr6", 2)
    angles[1, 4] = 0.0
    hands = np.stack([forward(links, row) for row in angles] * 4)[:7]
    hands[2, :3, 3] = 9.0
    hands[3, 0, 3] = np.nan
    hands[4, :3, :3] *= 1.01
    hands[5, :3, 0] *= -1  # a mirror
    hands[6, :3, 3] = np.inf
    found = md.arm_poses(links, hands)
    assert found.status.tolist() == [
        "ok", "singular", "out of reach", "nan", "no rotation", "no rotation", "nan",
    ]  # fmt: skip
    assert found.proven.tolist() == [True, False, True, False, False, False, False]
    assert (found.counts > 0).tolist() == [True, True, False, False, False, False, False]
    assert np.isnan(found.angles[2:]).all()
    for pose in found[1].angles:
        assert np.abs(forward(links, pose) - hands[1]).max() < 1e-6
    assert "1 out of reach" in repr(found)


@pytest.mark.parametrize("name", ["ur5e", "puma", "sixteen"])
def test_singular_poses_are_said_to_be(name: str) -> None:
    """Where a way with the hand ends: the angle at which two poses meet, from the determinant."""
    links, angles, _ = drawn(name, 1)

    def determinant(turn: float) -> float:
        q = angles[0].copy()
        q[2] = turn
        at = forward(links, q)
        step, rows = 1e-6, []
        for k in range(6):
            moved = q + step * np.eye(6)[k]
            rate = (forward(links, moved) - at) / step
            spin = rate[:3, :3] @ at[:3, :3].T
            rows.append([*rate[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
        return float(np.linalg.det(np.array(rows)))

    turns = np.linspace(-np.pi, np.pi, 60)
    values = [determinant(turn) for turn in turns]
    k = next(k for k in range(59) if values[k] * values[k + 1] < 0)
    low, high = turns[k], turns[k + 1]
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if determinant(middle) * values[k] > 0 else (low, middle)
    angles[0, 2] = low
    found = md.arm_poses(links, np.stack([forward(links, angles[0])] * 2))
    assert found.status.tolist() == ["singular"] * 2
    assert np.nanmin(gaps(found.angles, np.repeat(angles, 2, axis=0)), axis=1).max() < 1e-3


def test_limits_are_applied_and_said() -> None:
    links, _, hands = drawn("ur5e", 40)
    free = md.arm_poses(links, hands)
    low, high = np.full(6, -2.0), np.full(6, 2.5)
    low[0], high[0] = 3.0, 3.0 + TURN  # a turn that does not begin at -pi
    held = md.arm_poses(md.Arm(links, limits=np.stack([low, high], axis=1)), hands)
    assert (held.counts + held.outside == free.counts).all()
    assert held.outside.sum() > 0
    inside = np.isfinite(held.angles).all(axis=2)
    assert ((held.angles >= low - 1e-9) & (held.angles <= high + 1e-9))[inside].all()
    for k in range(40):
        every = free[k].angles
        every = every + TURN * np.ceil((low - every) / TURN) * (np.arange(6) == 0)
        allowed = ((every >= low) & (every <= high)).all(axis=1).sum()
        assert allowed == held.counts[k]
        assert held.status[k] == ("ok" if allowed else "outside limits")
    assert "outside limits" in held.status
    assert held.proven.all()


@pytest.mark.parametrize("name", ["ur5e", "kr6", "crx"])
def test_places_in_single_precision_are_places(name: str) -> None:
    """Their matrices are no rotations in double precision: the nearest ones are meant."""
    links, angles, hands = drawn(name, 10)
    rounded = hands.astype(np.float32).astype(float)
    found = md.arm_poses(links, rounded)
    assert set(found.status) <= {"ok", "unproven"}
    assert found.proven.sum() >= 9
    assert np.nanmin(gaps(found.angles, angles), axis=1).max() < 1e-4
    for row, hand in zip(found, rounded, strict=True):
        for pose in row.angles:
            assert np.abs(forward(links, pose) - hand).max() < 2e-6


def test_an_arm_of_axes_is_that_of_its_rows() -> None:
    """Axes through points, turned one after the other about themselves, by their exponentials."""
    rng = np.random.default_rng(4)
    for kind in range(5):
        points, axes = rng.normal(size=(6, 3)), rng.normal(size=(6, 3))
        if kind in (1, 3):
            axes[2] = axes[1]
            axes[3] = -axes[1]
        if kind in (2, 3):
            points[5] = points[4]
        if kind == 4:
            points[3:] = points[3]
        hand = forward(ARMS["general"], rng.normal(size=6))
        arm = arm_of_axes(points, axes, hand)
        q = rng.uniform(-3, 3, size=(3, 6))
        world = np.stack([product(points, axes, row, hand) for row in q])
        assert np.abs(arm.forward(q) - world).max() < 1e-12
        found = md.arm_poses(arm, world)
        assert found.most == (16 if kind in (0, 2) else 8)
        assert np.nanmin(gaps(found.angles, q), axis=1).max() < 1e-7
        one = md.arm_poses(arm, world[0])
        assert len(one.angles) == found.counts[0]


def test_messages_of_what_is_no_arm() -> None:
    links, _, hands = drawn("ur5e", 2)
    limits = [[-1.0, 1.0]] * 6
    cases: list[tuple[Any, Any, str]] = [
        (links, hands[0, :2], "3 or 4 rows of 4 .* not .2, 4."),
        (links, np.zeros((2, 2, 4, 4)), "not .2, 2, 4, 4."),
        (links, "ur5e", "3 or 4 rows of 4"),
        (links, np.full((4, 4), np.nan), "not finite"),
        (links[:, :2], hands, "six rows"),
        ([*links[:5], ["a", "b", "c"]], hands, "six rows"),
        (np.where(links > 0.1, np.inf, links), hands, "not finite"),
    ]
    for arm, targets, message in cases:
        with pytest.raises(md.InputError, match=message):
            md.arm_poses(arm, targets)
    for numbers, message in (
        ({"limits": limits[:5]}, "six rows .smallest"),
        ({"limits": [*limits[:5], [1.0, -1.0]]}, "limits of joint 6 are reversed: 1 > -1"),
        ({"offsets": [0.0] * 5}, "six angles"),
        ({"base": np.eye(3)}, "3 or 4 rows of 4"),
        ({"tool": -np.eye(4)}, "no rotation"),
        ({"names": ("a", "b")}, "six names"),
    ):
        with pytest.raises(md.InputError, match=message):
            md.Arm(links, **numbers)
    with pytest.raises(md.InputError, match="six angles"):
        md.Arm(links).forward([1.0, 2.0])
    empty = md.arm_poses(links, hands[:0])
    assert (len(empty), empty.angles.shape) == (0, (0, 8, 6))
