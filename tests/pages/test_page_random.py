"""Random mechanisms through the page's modules: nothing is certified there that Python refutes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.attack import page_honesty
from tests.shared.node import needs_node

ROOT = Path(__file__).parents[2]


@needs_node
@pytest.mark.parametrize("start", [0, 320], ids=["any", "rack"])
def test_nothing_is_certified_that_python_refutes(start):
    """Of seed 320 a rack on the crank is elsewhere after whole turns of it."""
    found = page_honesty.chunk(start, 6)
    assert found["faults"] == []
    assert found["certified"] > 40


def read(name):
    return json.loads((ROOT / f"docs/data/{name}.json").read_text(encoding="utf-8"))


def test_the_long_run_found_nothing():
    figures = read("page-honesty")
    assert figures["faults"] == []
    text = (ROOT / "docs/page.md").read_text(encoding="utf-8")
    for word in ("mechanisms", "live", "certified"):
        assert f"{figures[word]} {word}" in text
    assert f"of which {len(figures['untrusted'])} do not trust themselves" in text


def test_the_measured_pages_are_as_good_as_the_page_says():
    """The committed figures hold what is asked of pages, and the documentation repeats them."""
    numbers, bars, browsers = read("page-numbers")["summary"], read("page-bars"), read("browsers")
    text = (ROOT / "docs/page.md").read_text(encoding="utf-8")
    assert numbers["trusted"] == numbers["live"]
    assert numbers["differ"] == numbers["other"] == numbers["unnamed"] == 0
    assert max(numbers["gap"], numbers["position"]) < 1e-12
    assert max(numbers["limit"], numbers["limits_apart"]) < 1e-9
    assert f"all {numbers['live']} live pages" in text
    assert f"{numbers['compared']} poses compared" in text
    for own in bars["pages"].values():
        assert own["bytes"] < 300_000
        assert own["said"] == own["small"] == []
        assert own["too_wide_320"] == own["too_wide_390"] == 0
        assert own["axe"] == {}
    assert bars["summary"]["letters"] <= 0.02
    assert f"{bars['summary']['pages']} pages" in text
    for own in browsers:
        assert own["worst"] < 1e-12
        assert own["said"] == {}
        assert own["not_as_python"] == own["empty"] == []
        assert f"{own['browser']}, {own['pages']} pages" in text
