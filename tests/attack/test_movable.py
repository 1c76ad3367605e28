"""Groups that move by themselves, drawn at random: a sample, and the figures of the page."""

from __future__ import annotations

import json

import pytest

from tests.attack.movable_groups import FAMILIES, case
from tests.shared.paths import DOCS


@pytest.mark.parametrize("seed", range(len(FAMILIES)))
def test_groups_that_move_are_said_to_and_no_others(seed: int) -> None:
    """Seed 0: a prism of which rounding once hid that it moves."""
    row = case(seed)
    assert row["moves"], row["fault"]
    assert not row["wrong"]


def test_the_page_tells_what_was_measured() -> None:
    found = json.loads((DOCS / "data" / "movable-groups.json").read_text())
    page = (DOCS / "theory/evidence/assembly-modes.md").read_text(encoding="utf-8")
    assert found["wrong"] == []
    longest = max(found[family]["seconds_most"] for family in FAMILIES)
    assert f"{found['groups']} groups drawn to move are all said to, after {longest} s" in page
