"""Figures of the evidence: each with the version and the day of its measurement."""

from __future__ import annotations

import datetime
import re
import sys

import pytest

import mechdae as md
from tests.shared.paths import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import make_evidence


def test_figures_of_the_evidence_say_when_they_were_measured(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert make_evidence.main(["--check"]) == 0, capsys.readouterr().out
    for page in make_evidence.PAGES.glob("*.md"):
        dated = re.search(r"^\*Figures of .*\d{4}-\d\d-\d\d", page.read_text("utf-8"), re.M)
        assert dated or page.name in make_evidence.ANEW, page.name


def test_data_that_changed_are_of_today_and_their_pages_say_so() -> None:
    known = make_evidence.held()
    before = known["data"]["arms.json"]
    assert make_evidence.renewed(known["data"])["arms.json"] == before
    changed = make_evidence.renewed(known["data"] | {"arms.json": before | {"sum": 0}})["arms.json"]
    assert changed == {
        "version": md.__version__,
        "date": datetime.date.today().isoformat(),
        "sum": before["sum"],
    }
    renewed = {"data": known["data"] | {"arms.json": changed}, "sections": known["sections"]}
    text = (make_evidence.PAGES / "arms.md").read_text(encoding="utf-8")
    said = make_evidence.stamped("arms.md", text, renewed)
    assert f"*Figures of {md.__version__}, {changed['date']} ([arms.json]" in said
    assert make_evidence.stamped("arms.md", said, known) == text
    code = "# A\n\n```toml\n# no heading 1\n```\n## B\n\n2\n"
    assert [heading for heading, _ in make_evidence.sections(code)] == ["# A", "## B"]
