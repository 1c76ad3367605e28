"""Every predefined problem meets the values its file expects."""

from __future__ import annotations

import runpy
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.errors import InputError
from mechdae.tasks.check import check
from tests.shared.paths import DOCS
from tests.shared.predefined import predefined

QUICK = (
    "belt-drive", "delta-robot", "double-cardan", "four-bar-crank-rocker", "geared-five-bar-97-13",
    "gorshkov-seven-link", "incline-block", "peaucellier", "rack-and-pinion", "rssr",
    "scotch-yoke", "screw-press", "slider-crank", "slider-crank-friction", "stewart-gough",
)  # fmt: skip
"""Problems whose values are compared whenever the suite runs: one or two of each kind of pair."""
SLOW = pytest.mark.slow(reason="solves all tasks of a problem")


@pytest.mark.parametrize(
    "name", [own if own in QUICK else pytest.param(own, marks=SLOW) for own in library.names()]
)
def test_expected_values(name: str) -> None:
    problem = predefined(name)
    verdicts = check(problem)
    # designs are judged by tests of their own: what they reach is no value to be met
    assert len(verdicts) >= 5 or is_design(problem)
    for verdict in verdicts:
        entry = verdict.expected
        assert verdict.met, f"{entry.task} {entry.what}: {verdict}"
        assert entry.source, "an expected value says where it comes from"
        size = max(1.0, np.abs(verdict.value).max())  # forces in newtons, powers in watts
        # targets of designs have the digits that their source prints
        assert verdict.allowed <= (1e-6 if is_design(problem) else 1e-8) * size


@pytest.mark.parametrize("name", library.names())
def test_every_file_has_title_source_and_tasks(name: str) -> None:
    problem = predefined(name)
    assert problem.title
    assert problem.source
    kinds = {task.kind for task in problem.tasks.values()}
    assert kinds >= {"sweep", "modes"} or kinds & {"reactions", "motion"} or is_design(problem)


def is_design(problem: md.Problem) -> bool:
    return any(task.kind == "synthesis" for task in problem.tasks.values())


@pytest.mark.parametrize("name", [n for n in library.names() if is_design(predefined(n))])
def test_designs_say_what_is_known(name: str) -> None:
    text = (library.folder() / f"{name}.toml").read_text(encoding="utf-8")
    assert "best known" in text.lower()


def test_the_indicator_diagram_is_what_its_script_writes() -> None:
    script = runpy.run_path(str(DOCS / "make_indicator.py"))
    table = library.folder() / "four-stroke-engine.csv"
    assert table.read_text().splitlines() == script["rows"]()


def test_tables_are_written_with_the_problem(tmp_path: Path) -> None:
    problem = md.load("four-stroke-engine")
    path = tmp_path / "engine.toml"
    md.dump(problem, path)
    md.dump(problem, path)  # the file that is there holds the same
    load, again = (own.mechanism.loads["gas"] for own in (problem, md.load(path)))
    assert len(load.points) == 361
    assert load.points == again.points
    table = tmp_path / "four-stroke-engine.csv"
    table.write_text(table.read_text().replace("8000", "8001"))
    with pytest.raises(InputError, match=r"loads\.gas\.file: another file"):
        md.dump(problem, path)


def test_a_wrong_expected_value_is_missed() -> None:
    problem = md.load("slider-crank")
    text = library.find("slider-crank").read_text()
    first = problem.expected[0]
    data = tomllib.loads(text)
    data["expected"][0]["value"] = 1.01 * float(data["expected"][0]["value"])
    from mechdae.describe.file.load import from_dict

    verdicts = check(from_dict(data))
    assert [verdict.met for verdict in verdicts].count(False) == 1
    assert not verdicts[0].met
    assert first.value != data["expected"][0]["value"]


@pytest.mark.parametrize(
    "changes",
    [{"what": "points/none/position"}, {"at": 20.0}, {"what": "points/rod.C"}, {"at": None}],
)
def test_a_bad_path_is_said(changes: dict) -> None:
    from dataclasses import replace

    problem = md.load("slider-crank")
    entry = next(e for e in problem.expected if e.what == "points/slider.C/velocity")
    bad = replace(problem, expected=(replace(entry, **changes),))
    verdict = check(bad)[0]
    assert not verdict.met
    assert verdict.note


def test_the_problem_that_is_not_there() -> None:
    with pytest.raises(InputError, match="unknown problem"):
        md.load("no-such-problem")
