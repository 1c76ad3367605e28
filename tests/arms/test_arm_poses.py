"""Arms with six axes against their own forward kinematics and the count of the literature."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.shared.arms import ARMS, forward
from tests.shared.space import ring_of_seven

H = np.pi / 2
SIXTEEN = ARMS["sixteen"]
"""Manseur and Doty 1989: an arm and a place of the hand with 16 real poses."""
PLACE = [
    [-0.760117, -0.641689, 0.102262, -1.140175],
    [0.133333, 0.0, 0.991071, 0.0],
    [-0.635959, 0.766965, 0.085558, 0.0],
]


def test_sixteen_real_poses_are_proven() -> None:
    hand = np.array(PLACE)
    U, _, V = np.linalg.svd(hand[:, :3])
    hand[:, :3] = U @ V
    found = md.arm_poses(SIXTEEN, hand)
    assert found.proven
    assert (found.regular, found.singular, len(found.angles)) == (16, 0, 16)
    for angles in found.angles:
        assert np.abs(forward(SIXTEEN, angles)[:3] - hand).max() < 1e-13
    turned = np.exp(1j * found.angles)
    gaps = np.abs(turned[:, None] - turned).max(axis=2)
    assert gaps[~np.eye(16, dtype=bool)].min() > 1e-3


def test_poses_drawn_at_random_are_among_those_found() -> None:
    rng = np.random.default_rng(2)
    for _ in range(2):
        links = np.stack(
            [rng.normal(size=6), rng.uniform(0.3, 2.8, size=6), rng.normal(size=6)], axis=1
        )
        angles = rng.uniform(-3, 3, size=6)
        hand = forward(links, angles)
        found = md.arm_poses(links, hand)
        assert found.proven
        assert len(found.angles) % 2 == 0
        gaps = np.abs(np.exp(1j * found.angles) - np.exp(1j * angles)).max(axis=1)
        assert gaps.min() < 1e-9
        for own in found.angles:
            assert np.abs(forward(links, own) - hand).max() < 1e-10
        large = links * [1e3, 1, 1e3]
        place = hand.copy()
        place[:3, 3] *= 1e3
        assert len(md.arm_poses(large, place).angles) == len(found.angles)


def wrist(rng: Any, kind: int) -> Any:
    """Return an arm three of whose axes meet: general, with parallel axes, with axes that meet."""
    links = np.stack(
        [rng.normal(size=6), rng.uniform(0.3, 2.8, size=6), rng.normal(size=6)], axis=1
    )
    links[[3, 4], 0] = links[4, 2] = 0
    if kind == 1:
        links[1, 1] = 0
    if kind == 2:
        links[0, 0] = 0
    if kind == 3:
        links[0, 1] = 0
    return links


def turned_round(links: Any) -> Any:
    """Return the same arm from the hand to the foot."""
    a, alpha, d = links.T
    back = np.zeros((6, 3))
    back[:5, 0], back[:5, 1], back[:, 2] = -a[4::-1], -alpha[4::-1], -d[::-1]
    return back


@pytest.mark.parametrize("kind", range(4))
@pytest.mark.parametrize("round_", [False, True])
def test_arms_whose_axes_meet_have_eight_poses(kind: int, round_: bool) -> None:
    rng = np.random.default_rng([kind, round_])
    for _ in range(6):
        links = turned_round(wrist(rng, kind)) if round_ else wrist(rng, kind)
        angles = rng.uniform(-3, 3, size=6)
        hand = forward(links, angles)
        found = md.arm_poses(links, hand)
        assert (found.proven, found.regular, found.most, found.singular) == (True, 8, 8, 0)
        assert len(found.angles) in (2, 4, 6, 8)
        gaps = np.abs(np.exp(1j * found.angles) - np.exp(1j * angles)).max(axis=1)
        assert gaps.min() < 1e-8
        for own in found.angles:
            assert np.abs(forward(links, own) - hand).max() < 1e-9


def test_eight_poses_are_those_of_the_eliminant() -> None:
    """Without the closed form eight of its solutions are these, and eight are elsewhere."""
    links = [(0.2, H, 0), (1, 0.7, 0.1), (0.3, H, 0), (0, -H, 0.9), (0, H, 0), (0, 0, 0.1)]
    hand = forward(links, [0.3, -0.8, 1.1, 0.4, 0.9, -0.5])
    found = md.arm_poses(links, hand)
    assert found.proven
    nearly = [(a + 1e-7 * (k == 3), alpha, d) for k, (a, alpha, d) in enumerate(links)]
    other = md.arm_poses(nearly, hand)
    assert other.most == 16
    for own in found.angles:
        gaps = np.abs(np.exp(1j * other.angles) - np.exp(1j * own)).max(axis=1)
        assert gaps.min() < 1e-4


def test_a_stretched_arm_is_not_called_proven() -> None:
    """At the limit of its reach two poses are one; beyond it there is none, and that is sure."""
    links = [(0, H, 0.4), (0.5, 0, 0), (0, H, 0), (0, -H, 0.4), (0, H, 0), (0, 0, 0.1)]
    hand = forward(links, [0.3, 0.5, H, 0.4, 0.9, -0.5])
    found = md.arm_poses(links, hand)
    assert (found.status, found.proven) == ("singular", False)
    hand[:3, 3] *= 1.4
    found = md.arm_poses(links, hand)
    assert (found.proven, len(found.angles)) == (True, 0)


def test_what_is_refused() -> None:
    with pytest.raises(md.InputError, match="fewer than six freedoms"):
        md.arm_poses([(0, 1, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0), *SIXTEEN[4:]], PLACE)
    with pytest.raises(md.InputError, match="no rotation"):
        md.arm_poses(SIXTEEN, 2 * np.eye(4))
    with pytest.raises(md.InputError, match="six rows"):
        md.arm_poses(SIXTEEN[:5], np.eye(4))


@pytest.mark.slow
def test_solutions_far_off_are_certified() -> None:
    """A ring whose complex solutions reach 78 times its size: there rounding hides residuals."""
    rng = np.random.default_rng(7)
    for _ in range(77):
        mechanism, first, world = ring_of_seven(rng)
    found = md.solve(mechanism, md.Modes(md.Driver("J0.angle", at=(first,))))
    assert found.summary["proven"]
    places = np.stack([found.points[f"b{k}.P{k}"].position for k in range(1, 7)], axis=1)
    assert np.abs(places - world).max(axis=(1, 2)).min() < 1e-9
