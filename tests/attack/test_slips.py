"""Slips of the pen in rooms of the package: each is seen, by a check of its own at least.

`python -m tests.attack.test_slips` plants each and runs the test of the suite that it names.
"""

from __future__ import annotations

import ast
import sys

import pytest

from tests.attack import (
    slips_assembly,
    slips_certificates,
    slips_exchange,
    slips_measures,
    slips_motion,
    slips_space,
    slips_space_motion,
    slips_synthesis,
)
from tests.shared.paths import ROOT
from tests.shared.planting import Slip, plant

SLIPS = {
    "exchange": slips_exchange.SLIPS,
    "assembly": slips_assembly.SLIPS,
    "certificates": slips_certificates.SLIPS,
    "measures": slips_measures.SLIPS,
    "motion": slips_motion.SLIPS,
    "space": slips_space.SLIPS,
    "space in motion": slips_space_motion.SLIPS,
    "synthesis": slips_synthesis.SLIPS,
}
ALL = [slip for slips in SLIPS.values() for slip in slips]
CHECKS = {slip.check.__name__: slip.check for slip in ALL}


@pytest.mark.parametrize("name", CHECKS)
def test_nothing_is_off_without_a_slip(name: str) -> None:
    assert CHECKS[name]() < 1


@pytest.mark.parametrize("slip", ALL, ids=lambda slip: slip.name)
def test_a_slip_is_seen(slip: Slip, monkeypatch: pytest.MonkeyPatch) -> None:
    plant(slip, monkeypatch)
    assert not slip.check() < 1


def test_each_room_has_its_slips_and_the_suite_sees_them() -> None:
    assert all(len(slips) >= 10 for slips in SLIPS.values())
    for slip in ALL:
        path, _, name = slip.seen.partition("::")
        tree = ast.parse((ROOT / "tests" / path).read_text(encoding="utf-8"))
        assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, name


def main() -> int:
    """Plant each slip and run the test that it names: it has to fail."""
    unseen = 0
    for slip in ALL:
        with pytest.MonkeyPatch.context() as patch:
            plant(slip, patch)
            code = pytest.main(["-n", "0", "-q", "-x", "--no-header", f"tests/{slip.seen}"])
        unseen += code == 0
        print("seen" if code else "NOT SEEN", slip.name, "by", slip.seen)
    return int(unseen > 0)


if __name__ == "__main__":
    sys.exit(main())
