"""Vector loops at random, in numbers: orders that assemble or cannot, bodies written as loops."""

from __future__ import annotations

import numpy as np
import pytest

from tests.shared.loop_checks import bodies_of, check_same, tried


@pytest.mark.slow
def test_orders_of_two_hundred_random_mechanisms() -> None:
    rng = np.random.default_rng(2026)
    counted = np.array([tried(rng, 1 + k % 4, 4, 30) for k in range(200)])
    assert counted.sum(axis=0).min() >= 150


@pytest.mark.slow
def test_five_hundred_random_mechanisms_as_loops() -> None:
    rng = np.random.default_rng(12)
    for k in range(500):
        assert check_same(bodies_of(rng, 1 + k % 4)) == 1 + k % 4
