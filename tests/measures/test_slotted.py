"""Lengths of paths that turn back behind a slot: a sample of the script that counts them."""

from __future__ import annotations

import pytest

from tests.attack.slotted_curves import CLOSE, examine


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 5, 8])
def test_lengths_behind_a_slot(seed: int) -> None:
    found = examine(seed)
    assert found is None or max(found.values()) < CLOSE
