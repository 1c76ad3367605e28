"""The closure in absolute coordinates against closed forms, and against itself in 80 bits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference.planar_closure import Closure
from tests.reference.truth.drawing import draw

CASES = [("triads", 0), ("geared", 1), ("gears", 3), ("gears", 5), ("dyads", 2), ("end", 1)]


def closed(family, seed):
    """Return a case with its closure, values of the driver, and the poses there."""
    case = draw(seed, family)
    case.survey(case.s0 - 3 * case.unit, case.s0 + 3 * case.unit)
    low, high = (float(end.at) for end in case.whole())
    low, high = max(low, case.s0 - 2.9 * case.unit), min(high, case.s0 + 2.9 * case.unit)
    u = low + (high - low) * np.linspace(0.02, 0.98, 9)
    world, q = case.close(u), []
    for body in case.bodies:
        origin, direction = world.frames[body]
        lifted = world.angle(body).c[0].real if family in ("gears", "geared") else None
        q += [origin.c[0].real, origin.c[0].imag]
        q.append(np.angle(direction.c[0]) if lifted is None else lifted)
    numbers = case.mechanism().values()
    return case, Closure(case.bodies, case.joints, case.coordinate, numbers), u, np.stack(q, 1)


def apart(closure, one, other):
    """Return the largest difference of poses, whole turns aside."""
    change = (one - other).astype(float).reshape(len(one), -1, 3)
    change[:, :, 2] -= 2 * np.pi * np.round(change[:, :, 2] / (2 * np.pi))
    return closure.size(change.reshape(len(one), -1)).max()


@pytest.mark.parametrize(("family", "seed"), CASES)
def test_poses_and_limit_positions_are_those_of_closed_forms(family, seed):
    case, closure, u, q = closed(family, seed)
    solved = closure.solved(q, u)
    assert apart(closure, solved, q) < 1e-12
    beside = closure.solved(solved + 1e-6 * closure.scale, u)
    assert apart(closure, beside, q) < 1e-12
    reached = closure.followed(solved[:-1], u[:-1], u[1:])
    assert apart(closure, reached, q[1:]) < 1e-9
    for end, near in zip(case.whole(), (0, -1), strict=True):
        if end.kind == "limit" and u[0] - 0.5 < float(end.at) < u[-1] + 0.5:
            at = closure.fold(solved[near], u[near])
            assert at == pytest.approx(float(end.at), abs=1e-10 * case.unit)


def test_rates_are_the_differences_of_poses():
    case, closure, u, q = closed("triads", 0)
    first, second = closure.rates(closure.solved(q, u), u)
    h = 1e-4 * case.unit
    one, two, three = (closure.solved(q, u + k * h) for k in (-1, 0, 1))
    assert np.abs((three - one) / (2 * h) - first).max() < 1e-4 * np.abs(first).max()
    assert np.abs((three - 2 * two + one) / h**2 - second).max() < 1e-3 * np.abs(second).max()


def test_branches_have_other_signs():
    """A four-bar mirrored at its diagonal: one determinant turns, and no steps lead there."""
    numbers = {
        "ground.A.x": 0.0, "ground.A.y": 0.0, "ground.D.x": 3.0, "ground.D.y": 0.0,
        "a.A.x": 0.0, "a.A.y": 0.0, "a.B.x": 1.0, "a.B.y": 0.0, "b.B.x": 0.0, "b.B.y": 0.0,
        "b.C.x": 3.0, "b.C.y": 0.0, "c.D.x": 0.0, "c.D.y": 0.0, "c.C.x": 2.5, "c.C.y": 0.0,
    }  # fmt: skip
    joints = [
        ("revolute", name, one, two, {})
        for name, one, two in (
            ("A", "ground.A", "a.A"), ("B", "a.B", "b.B"),
            ("C", "b.C", "c.C"), ("D", "ground.D", "c.D"),
        )
    ]  # fmt: skip
    closure = Closure(["a", "b", "c"], joints, "a.angle", numbers)
    u = np.array([0.8, 0.8])
    turn = []
    for sign in (1, -1):  # the triangle B, C, D by the law of cosines
        x, y = np.cos(0.8), np.sin(0.8)
        far, base = np.hypot(3 - x, -y), np.arctan2(-y, 3 - x)
        angle = base + sign * np.arccos((9 + far**2 - 2.5**2) / (6 * far))
        c = np.array([x, y]) + 3 * np.array([np.cos(angle), np.sin(angle)])
        turn.append([0, 0, 0.8, x, y, angle, 3, 0, np.arctan2(c[1], c[0] - 3)])
    q = np.array(turn)
    assert np.abs((closure.solved(q, u) - q).astype(float)).max() < 1e-14
    signs = closure.signs(q, u, [{"a"}, {"b", "c"}])
    assert signs[0, 0] == signs[1, 0] != 0
    assert signs[0, 1] == -signs[1, 1] != 0
    there = closure.followed(q, u, u + 0.5)
    assert (closure.signs(there, u + 0.5, [{"a"}, {"b", "c"}]) == signs).all()
