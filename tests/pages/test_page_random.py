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


def test_the_long_run_found_nothing():
    figures = json.loads((ROOT / "docs/data/page-honesty.json").read_text(encoding="utf-8"))
    assert figures["faults"] == []
    text = (ROOT / "docs/page.md").read_text(encoding="utf-8")
    for word in ("mechanisms", "live", "certified"):
        assert f"{figures[word]} {word}" in text
    assert f"{figures['reasons']['the page does not trust itself']} of them" in text
