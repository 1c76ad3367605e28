"""Lines of every room: one that grows past its budget needs another one to shrink, or a reason."""

from __future__ import annotations

from pathlib import Path

from tests.shared.paths import ROOT

PACKAGE = ROOT / "mechdae"
BUDGETS = {
    "describe": 13_910,  # rare kinds in modules of their own, which most problems do not import
    "numerics": 4_640,
    "equations": 7_720,  # what is left out of a scene: rollers, second machines, plane and space
    "results": 3_490,
    "draw": 19_520,  # graphs of motions; texts are measured without matplotlib
    "kernels": 7_500,
    "motion": 23_370,  # poses of several drivers at the speed of one
    "forces": 4_730,
    "dynamics": 9_140,
    "design": 15_890,
    "tasks": 2_420,
    "cli": 1_720,
    "parts": 30_680,  # what a page teaches by
}
"""Room -> most lines of its modules; some of them import what annotations name."""
ALONE = 1122
"""Lines of the modules that stand alone: errors, docstrings, records, types, additions."""
TOTAL = 145_700
LONGEST = 500
LONGER = {
    "describe/joints/spatial.py": 520,
    "describe/mechanism.py": 580,
    "describe/vectors/loops_of.py": 560,
    "dynamics/equations.py": 530,
    "equations/tree/tree_model.py": 590,
    "forces/inverse_dynamics.py": 540,
    "kernels/graphs/kinetostatics.py": 520,
    "motion/cases/hard_steps/crossings/change_points.py": 510,
    "parts/types/chains/chains.py": 510,
}
"""Modules above `LONGEST` lines, and how long they may be; each has one purpose."""


def lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0]


def test_rooms_keep_their_budgets() -> None:
    files = sorted(PACKAGE.rglob("*.py"))
    sums: dict[str, int] = {}
    for path in files:
        sums[room_of(path)] = sums.get(room_of(path), 0) + lines(path)
    alone = sum(sums.pop(name) for name in [*sums] if name.endswith(".py"))
    over = [
        f"{room}/ has {count} lines, its budget is {BUDGETS.get(room, 0)}: shorten it, or raise "
        "BUDGETS here by what another room is lowered"
        for room, count in sums.items()
        if count > BUDGETS.get(room, 0)
    ]
    assert not over
    assert alone <= ALONE, "lines of errors, records, types and additions: as those of a room"
    assert sum(BUDGETS.values()) + ALONE <= TOTAL + 1_000, "lower the budgets of shorter rooms"
    assert sum(sums.values()) + alone <= TOTAL, "all lines: shorten something of the package"


def test_modules_are_short() -> None:
    for path in PACKAGE.rglob("*.py"):
        name = path.relative_to(PACKAGE).as_posix()
        assert lines(path) <= LONGER.get(name, LONGEST), name
