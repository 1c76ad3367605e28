"""The committed comparison with NSGA-II: figures that follow from its points, and the page."""

from __future__ import annotations

import json
import runpy

import pytest

from tests.shared.paths import DOCS

DATA = DOCS / "data" / "compositions.json"
REFERENCES = {"material": (0.75, 10.0), "points": (1.5, 16.0)}


def records():
    return json.loads(DATA.read_text(encoding="utf-8"))["records"]


def area(points, reference):
    found, top = 0.0, reference[1]
    for x, y in sorted(points):
        if x < reference[0] and y < top:
            found += (reference[0] - x) * (top - y)
            top = y
    return found


@pytest.mark.parametrize("other", REFERENCES)
def test_hypervolumes_are_those_of_the_points_and_ours_are_larger(other: str) -> None:
    assert len(records()) == 6
    for record in records():
        own = record[other]
        assert own["ours"] == pytest.approx(area(own["points"], REFERENCES[other]), rel=1e-12)
        runs = [area(run["points"], REFERENCES[other]) for run in own["runs"]]
        assert own["nsga2"] == pytest.approx(max(runs), rel=1e-12)
        assert own["ours"] > own["nsga2"], (record["curve"], other)
        assert own["circles"]["do_not_assemble"] == 0
        assert own["circles"]["designs"] == len(own["points"])
        assert own["circles"]["largest_difference"] < 1e-9


def test_the_page_has_what_was_measured() -> None:
    table = runpy.run_path(str(DOCS / "make_compositions.py"))["table"]()
    assert table in (DOCS / "theory/evidence/compositions.md").read_text(encoding="utf-8")
