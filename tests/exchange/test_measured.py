"""What the page of exports shows is what was measured, and a part of it is measured again."""

from __future__ import annotations

import json

import pytest

from tests.scripts.exports import BEGIN, END, polynomials, written
from tests.shared.paths import DOCS, FIGURES

TABLE = json.loads((FIGURES / "exports.json").read_text(encoding="utf-8"))


def test_page_shows_what_was_measured() -> None:
    text = (DOCS / "theory/evidence/exchange.md").read_text(encoding="utf-8")
    assert text.split(BEGIN)[1].split(END)[0].strip() == written(TABLE).strip()
    gaps = [own["closure"] for own in TABLE.values() if own.get("closure") is not None]
    assert len(gaps) >= 20
    assert max(gaps) < 1e-12
    proved = [own["polynomials"] for own in TABLE.values()
              if isinstance(own.get("polynomials"), dict)]  # fmt: skip
    assert len(proved) >= 20
    assert all(own["error"] <= 1e-6 and own["share"] <= 1 for own in proved)


@pytest.mark.parametrize("name", ["slider-crank", "oscillating-cylinder", "cardan-joint"])
def test_a_part_is_measured_again(name: str) -> None:
    known, own = TABLE[name]["polynomials"], polynomials(name)
    assert own["degree"] == known["degree"]
    assert own["error"] == pytest.approx(known["error"], rel=1e-3)
    assert own["share"] == pytest.approx(known["share"], rel=1e-3)
