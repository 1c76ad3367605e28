"""Arms and platforms beside closed forms: what the page shows, and a part of it measured again."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mechdae as md
from benchmarks.control_loops import (
    BEGIN,
    END,
    Arm,
    arms,
    drawn,
    in_c,
    measured,
    off,
    outputs,
    page,
)
from benchmarks.written import COMPILER
from tests.shared.paths import DOCS, FIGURES

RECORDS = json.loads((FIGURES / "control-loops.json").read_text(encoding="utf-8"))
LOOPS = {"five-bar": 100.0, "excavator": 100.0, "hexapod": 300.0}
"""Microseconds of a call in a loop, at most."""


def test_page_shows_what_was_measured() -> None:
    text = (DOCS / "theory/evidence/solver.md").read_text(encoding="utf-8")
    assert text.split(BEGIN)[1].split(END)[0].strip() == page(RECORDS).strip()
    assert [row["name"] for row in RECORDS] == [arm.name for arm in arms()]
    assert sum(row["jumps"]["calls"] for row in RECORDS) >= 100_000
    for row in RECORDS:
        assert (row["jumps"]["wrong"], row["jumps"]["no_limit_near"]) == (0, 0)
        assert max(each["error"] for each in (*row["arrays"], row["loop"])) < 1e-12
        most = LOOPS.get(row["name"].split()[0].rstrip(","), np.inf)
        assert row["loop"]["mechdae_us"] <= most


def test_a_part_is_measured_again() -> None:
    row = measured(arms()[0], {1: 2, 20: 2}, 40, 60)
    assert row["jumps"]["wrong"] == row["jumps"]["no_limit_near"] == row["loop"]["refused"] == 0
    assert max(each["error"] for each in (*row["arrays"], row["loop"])) < 1e-14
    assert row["name"] in page([row])


IN_C = {row["name"] for row in RECORDS if any("c_us" in each for each in row["arrays"])}


@pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")
@pytest.mark.parametrize(
    "arm", [arm for arm in arms() if arm.name in IN_C], ids=lambda arm: arm.name
)
def test_closed_forms_in_numpy_and_c_are_the_same(arm: Arm) -> None:
    u = drawn(arm, 50, 3)
    known, margin = arm.form(u)
    assert (margin > 0).all()
    closed = in_c(arm, known.shape[1])
    assert closed is not None
    assert np.abs(closed(u) - known).max() < 1e-13


def test_a_wrong_mode_is_seen() -> None:
    arm = next(arm for arm in arms() if arm.name == "five-bar robot, inverse")
    u = drawn(arm, 5, 4)
    poses = md.Solver(arm.problem, arm.task).poses({}, u)
    found = outputs(arm, poses)
    assert off(arm, found, u).max() < 1e-13
    assert off(arm, found + np.array([0.0, 0.1]), u).min() > 0.09
