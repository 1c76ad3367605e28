"""Bounds of poses evaluated in ball arithmetic are at most those reported."""

from __future__ import annotations

import json
from typing import Any

import pytest

import mechdae as md
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from tests.reference.truth.drawing import draw
from tests.reference.truth.judging import swept
from tests.shared.paths import ROOT

pytest.importorskip("flint", reason="python-flint is not installed")


def reported(problem: md.Problem, task: Any) -> tuple[Any, Any, Any]:
    setting = prepare(problem, task)
    done = run(setting, task)
    return setting, done, report(problem, "sweep", task, setting, done)


@pytest.mark.parametrize("family", ["dyads", "gears", "triads", "slender"])
def test_bounds_in_balls_are_no_larger(family: str) -> None:
    """The formula without its allowance, in 192 bits: less than the bound, and not much less."""
    from tests.shared.in_balls import bounds

    for seed in range(2):
        case = draw(seed, family)
        task = swept(case, 6)
        setting, done, result = reported(md.Problem(case.mechanism(), {"sweep": task}), task)
        rows = [k for k, status in enumerate(result.status) if status == "ok"]
        for word, found in bounds(setting, done, rows).items():
            for k, own in zip(rows, found, strict=True):
                assert own <= float(result.bound[word][k])
                assert own >= 0.9 * float(result.bound[word][k])


def test_page_tells_how_many_were_compared() -> None:
    """None larger, no certificate refused, and the numbers are those of the page."""
    found = json.loads((ROOT / "docs" / "data" / "bounds-in-balls.json").read_text())
    page = (ROOT / "docs" / "theory/evidence/certificates.md").read_text(encoding="utf-8")
    assert found["larger"] == found["refused"] == 0
    assert found["faults"] == found["given_up"] == []
    numbers = [found[key] for key in ("mechanisms", "poses", "larger", "written", "refused")]
    assert f"| {' | '.join(map(str, numbers))} |" in page
    write, check = (round(found["seconds_of"][part]) for part in ("write", "check"))
    assert f"{write} s to write all certificates and {check} s to check them" in page
