"""What the page of the editor says of linkages that are found is what was measured."""

from __future__ import annotations

import json

from mechdae.parts.page.editor import editor
from tests.scripts import found_linkages
from tests.shared.paths import ROOT

FIGURES = json.loads((ROOT / "docs/data/found-linkages.json").read_text(encoding="utf-8"))


def test_the_page_tells_what_was_measured():
    text = (ROOT / "docs/theory/evidence/finding-linkages.md").read_text(encoding="utf-8")
    assert found_linkages.sentence(FIGURES) in text
    assert found_linkages.table(FIGURES) in text


def test_what_was_measured_is_what_was_aimed_at():
    turning = FIGURES["turning"]
    assert turning["within"] >= 0.95 * turning["curves"]
    assert turning["largest_seconds"] < 2
    assert FIGURES["mechanisms"] >= 2_000_000
    for own in (*FIGURES["curves"].values(), *FIGURES["letters"].values()):
        assert len(own["found"]) == 3
        assert own["seconds"] < 3


def test_the_editor_is_small():
    assert len(editor().html.encode()) < 200_000
