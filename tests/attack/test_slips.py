"""Slips of the pen in rooms of the package: each is seen, by a check of its own at least.

`python -m tests.attack.test_slips` plants each and runs the test of the suite that it names.
"""

from __future__ import annotations

import ast
import subprocess
import sys

import pytest

from tests.attack import (
    slips_arms,
    slips_assembly,
    slips_certificates,
    slips_contacts,
    slips_exchange,
    slips_loops,
    slips_measures,
    slips_motion,
    slips_paper,
    slips_play,
    slips_space,
    slips_space_motion,
    slips_synthesis,
)
from tests.shared.paths import ROOT
from tests.shared.planting import Slip, plant

SLIPS = {
    "arms": slips_arms.SLIPS,
    "exchange": slips_exchange.SLIPS,
    "assembly": slips_assembly.SLIPS,
    "certificates": slips_certificates.SLIPS,
    "loops": slips_loops.SLIPS,
    "measures": slips_measures.SLIPS,
    "motion": [*slips_motion.SLIPS, *slips_contacts.SLIPS],
    "paper": slips_paper.SLIPS,
    "play": slips_play.SLIPS,
    "space": slips_space.SLIPS,
    "space in motion": slips_space_motion.SLIPS,
    "synthesis": slips_synthesis.SLIPS,
}
LONGEST = 240.0
"""Seconds of a test; those that slips name take less than one without them."""
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


def seen_alone(number: int) -> bool:
    """Plant one slip and run the test that it names: it has to fail."""
    with pytest.MonkeyPatch.context() as patch:
        plant(ALL[number], patch)
        test = f"tests/{ALL[number].seen}"
        code = pytest.main(["-n", "0", "-q", "-x", "--no-header", test])
    return code in (pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED)  # none ran: not


def main() -> int:
    """Plant each slip in a process of its own, for kernels that are kept know nothing of it.

    A test that does not end is broken off, and has seen it too.
    """
    unseen = 0
    for number, slip in enumerate(ALL):
        command = [sys.executable, "-m", "tests.attack.test_slips", str(number)]
        try:
            code = subprocess.run(command, capture_output=True, timeout=LONGEST).returncode
            found = "seen" if code == 0 else "NOT SEEN"
        except subprocess.TimeoutExpired:
            found = "seen, without end,"
        unseen += found == "NOT SEEN"
        print(found, slip.name, "by", slip.seen, flush=True)
    return int(unseen > 0)


if __name__ == "__main__":
    sys.exit(not seen_alone(int(sys.argv[1])) if len(sys.argv) > 1 else main())
