"""A class for each kind of task; statuses with their sentences, plain texts in arrays and JSON."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.series_units import OWN_NAMES
from mechdae.results import FINE, Status, Summary, counts, plain, statuses

KINDS = {
    ("four-bar-crank-rocker", "turn"): (md.SweepResult, "centres"),
    ("four-bar-crank-rocker", "modes"): (md.ModesResult, "labels"),
    ("slider-crank-friction", "cycle"): (md.ReactionsResult, "efforts"),
    ("four-bar-motor", "motion"): (md.MotionResult, "work"),
}


@pytest.mark.parametrize(("place", "kind"), KINDS.items(), ids=lambda own: str(own[1]))
def test_a_task_has_a_result_of_its_kind(place: tuple[str, str], kind: tuple[type, str]) -> None:
    result = md.solve(*place)
    assert type(result) is kind[0]
    assert kind[1] in {own.name for own in fields(result)}
    for name in OWN_NAMES:  # whatever the kind, what it does not have is empty
        getattr(result, name)


def test_results_become_those_of_another_kind() -> None:
    sweep = md.solve("four-bar-crank-rocker", "turn", poses=5)
    found = sweep.as_kind(md.ReactionsResult, title="other", checks={"balance": 0.0})
    assert found.bodies is sweep.bodies
    assert found.summary is sweep.summary
    assert found.title == "other"
    assert found.to_dict() == {**sweep.to_dict(), "checks": {"balance": 0.0}}


def test_facts_may_be_given_as_a_dictionary() -> None:
    mechanism = md.load("slider-crank").mechanism
    result = md.StudyResult(
        "p", "t", "study", mechanism, status=np.array(["ok"]), summary={"of": "x"}
    )
    assert isinstance(result.summary, Summary)
    assert result.to_dict()["summary"] == {"of": "x"}


def test_a_status_is_its_text() -> None:
    status = statuses(3)
    status[1] = Status.UNASSEMBLED
    assert status.tolist() == ["ok", "unassembled", "ok"]
    assert type(status.tolist()[1]) is str
    assert (status == Status.OK).tolist() == [True, False, True]
    assert np.isin(status, FINE).tolist() == [True, False, True]
    assert counts(status) == {"ok": 2, "unassembled": 1}
    assert json.dumps(plain({Status.OK: status})) == '{"ok": ["ok", "unassembled", "ok"]}'


def test_the_documentation_has_the_sentences() -> None:
    text = (Path(__file__).parents[2] / "docs" / "reference/statuses.md").read_text(
        encoding="utf-8"
    )
    table = text.partition("\n## ")[0]
    rows = [f"| `{word}` | {word.sentence} |" for word in Status]
    assert [line for line in table.splitlines() if line.startswith("| `")] == rows
