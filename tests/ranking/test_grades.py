"""Criteria in words, and the places that single judges give. Truths: sums by hand."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mechdae as md
from tests.shared.command import run

PROBLEM = "four-bar-crank-rocker"
ORDERS = ("order-crank-coupler-rocker", "order-crank-rocker-coupler", "order-coupler-crank-rocker")
FILE = """
[scale]
simple = 5
usual = 3
awkward = 0
[judges.anna]
"width / upkeep" = 4
[judges.boris]
"width / upkeep" = "1/4"
[grades.upkeep]
order-crank-coupler-rocker = "usual"
order-crank-rocker-coupler = { anna = "simple", boris = "awkward" }
order-coupler-crank-rocker = { anna = "awkward", boris = "simple" }
"""


def test_grades_are_numbers_and_places_those_of_single_judges(capsys, tmp_path) -> None:
    file = tmp_path / "judges.toml"
    file.write_text(FILE)
    ranking = md.rank(PROBLEM, by="order", judges=file)
    rows = {row.name: row.values for row in ranking.rows}
    assert [rows[name]["upkeep"] for name in ORDERS] == [3, 2.5, 2.5]
    assert dict(ranking.criteria[1]) == {"name": "upkeep", "unit": "1", "sense": "max"}
    width = np.array([rows[name]["width"] for name in ORDERS])
    wide = (width - width.min()) / np.ptp(width)
    grades = {"anna": np.array([3, 5, 0.0]), "boris": np.array([3, 0, 5.0])}
    places = []
    for judge, share in (("anna", 0.8), ("boris", 0.2)):
        sums = share * wide + (1 - share) * (5 - grades[judge]) / 5
        places.append(np.argsort(np.argsort(sums)) + 1)
    ends = zip(np.min(places, axis=0), np.max(places, axis=0), strict=True)
    assert ranking.places == dict(zip(ORDERS, ends, strict=True))
    assert len({*ranking.places.values()}) > 1
    both = 0.5 * wide + 0.5 * np.array([0, 1, 1])
    assert [ranking.score[name] for name in ORDERS] == pytest.approx(both)
    code, out, _ = run(capsys, "rank", PROBLEM, "--by", "order", "--judges", str(file))
    assert code == 0
    assert "upkeep: simple 5, usual 3, awkward 0; more is better" in out
    low, high = next(pair for pair in ranking.places.values() if pair[0] < pair[1])
    assert f"{low}..{high}" in out
    code, out, _ = run(capsys, "rank", PROBLEM, "--by", "order", "--judges", str(file), "--json")
    data = json.loads(out)
    assert data["judgment"]["scale"] == {"simple": 5, "usual": 3, "awkward": 0}
    listed = {row["name"]: tuple(row["places"]) for row in data["rows"]}
    assert listed == ranking.places


def test_grades_alone_take_weights_and_the_usual_scale() -> None:
    words = dict(zip(ORDERS, ("poor", "good", "fair"), strict=True))
    judgment = md.judged({}, grades={"upkeep": words})
    ranking = md.rank(PROBLEM, by="order", judges=judgment, weights={"upkeep": 1})
    assert [ranking.score[name] for name in ORDERS] == [1, 0, 0.5]
    assert ranking.places == {}


def test_a_variant_without_a_grade_is_named() -> None:
    judgment = md.judged({}, grades={"upkeep": {ORDERS[0]: "poor", ORDERS[1]: "good"}})
    ranking = md.rank(PROBLEM, by="order", judges=judgment)
    assert ranking.missing["upkeep"] == (ORDERS[2],)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"usual"\n', '"usul"\n', "did you mean usual?"),
        ('anna = "simple", boris', 'ana = "simple", boris', "did you mean anna?"),
        (', boris = "awkward"', "", "judge boris gives no grade"),
        ("order-crank-coupler-rocker", "order-crank-copler-rocker",
         "did you mean order-crank-coupler-rocker"),
        ("upkeep", "height", "is computed, it is not graded"),
        ("usual = 3", "usual = 5", "each with a number of its own"),
        ("usual = 3", 'usual = "three"', "scale.usual: a number is needed"),
        ("[scale]", "[skale]", "did you mean scale?"),
        ("[grades.upkeep]", "[grades]", "grades.order-crank-coupler-rocker: a word for each"),
    ],
)  # fmt: skip
def test_what_is_no_grade_is_refused(capsys, tmp_path, old, new, message) -> None:
    file = tmp_path / "judges.toml"
    file.write_text(FILE.replace(old, new))
    code, _, err = run(capsys, "rank", PROBLEM, "--by", "order", "--judges", str(file))
    assert code == 2
    assert message in err


def test_judges_give_weights_themselves(capsys, tmp_path) -> None:
    file = tmp_path / "judges.toml"
    file.write_text(FILE)
    words = ("rank", PROBLEM, "--by", "order", "--judges", str(file), "--weights", "width=1")
    code, _, err = run(capsys, *words)
    assert code == 2
    assert "judges give criteria and weights themselves" in err
