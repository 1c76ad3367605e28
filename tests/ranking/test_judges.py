"""Weights by judges: published worked examples, agreement, what is refused."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.types.ranking.judges import concordance
from tests.shared.command import run

DRINKS = ("coffee", "wine", "tea", "beer", "sodas", "milk", "water")
ROWS = (
    (1, 9, 5, 2, 1, 1, 1 / 2), (1 / 9, 1, 1 / 3, 1 / 9, 1 / 9, 1 / 9, 1 / 9),
    (1 / 5, 3, 1, 1 / 3, 1 / 4, 1 / 3, 1 / 9), (1 / 2, 9, 3, 1, 1 / 2, 1, 1 / 3),
    (1, 9, 4, 2, 1, 2, 1 / 2), (1, 9, 3, 1, 1 / 2, 1, 1 / 3), (2, 9, 9, 3, 2, 3, 1),
)  # fmt: skip
"""T. L. Saaty, Decision making with the analytic hierarchy process, Int. J. Services Sciences 1
(2008) 83-98, Table 3: which drink is consumed more in the United States."""


def test_weights_are_those_of_a_published_example() -> None:
    pairs = {
        f"{DRINKS[i]} / {DRINKS[j]}": ROWS[i][j] for i, j in combinations(range(len(DRINKS)), 2)
    }
    found = md.judged({"public": pairs})
    printed = (0.177, 0.019, 0.042, 0.116, 0.190, 0.129, 0.327)
    assert [round(found.weights[name], 3) for name in DRINKS] == pytest.approx(printed, abs=1e-9)
    assert found.judges[0].ratio == pytest.approx(0.022, abs=0.0005)
    assert found.notes == ()
    assert found.agreement == 1


def test_agreement_is_that_of_published_examples() -> None:
    # S. Siegel, Nonparametric Statistics for the Behavioral Sciences, McGraw-Hill 1956, 9.6
    executives = np.array([[1, 6, 3, 2, 5, 4], [1, 5, 6, 4, 2, 3], [6, 3, 2, 5, 4, 1]], float)
    assert round(concordance(executives), 2) == 0.16
    tied = np.array([
        [1, 4.5, 2, 4.5, 3, 7.5, 6, 9, 7.5, 10], [2.5, 1, 2.5, 4.5, 4.5, 8, 9, 6.5, 10, 6.5],
        [2, 1, 4.5, 4.5, 4.5, 4.5, 8, 8, 8, 10],
    ])  # fmt: skip
    assert round(concordance(tied), 2) == 0.83


def test_several_judges_meet_at_the_geometric_mean() -> None:
    one = {"a / b": 2, "a / c": 6, "b / c": 3}
    two = {"b / a": 2, "c / a": "6", "b / c": "1/3"}
    found = md.judged({"anna": one, "boris": two})
    # opposite judges: every mean comparison is 1
    assert found.weights == pytest.approx({"a": 1 / 3, "b": 1 / 3, "c": 1 / 3})
    assert found.judges[0].weights == pytest.approx({"a": 0.6, "b": 0.3, "c": 0.1})
    assert found.judges[0].ratio == pytest.approx(0, abs=1e-12)
    assert found.agreement == pytest.approx(0, abs=1e-12)
    assert md.judged({"anna": one, "same": one}).agreement == 1


def test_an_inconsistent_judge_is_named_with_the_pair() -> None:
    found = md.judged({"carl": {"a / b": 3, "b / c": 3, "c / a": 3, "a / d": 1, "b / d": 1,
                                "c / d": 1}})  # fmt: skip
    assert found.judges[0].ratio > 0.1
    assert "judge carl is inconsistent" in found.notes[0]
    assert {"a", "b", "c"} > set(found.judges[0].worst)


@pytest.mark.parametrize(
    ("pairs", "message"),
    [({"a / b": 2, "b / a": 2}, "not reciprocal"), ({"a / b": 2, "b / c": 2}, "a / c is missing"),
     ({"a / b": -1}, "a number above 0 is needed"), ({"a": 2}, "two criteria are compared"),
     ({}, "no criteria are compared")],
)  # fmt: skip
def test_what_is_no_judgment_is_refused(pairs: dict[str, float], message: str) -> None:
    with pytest.raises(md.InputError, match=message):
        md.judged({"anna": pairs})


def test_variants_are_ranked_by_judges(capsys, tmp_path) -> None:
    file = tmp_path / "judges.toml"
    file.write_text(
        '[judges.anna]\n"width / height" = 3\n[judges.boris]\n"width / height" = "1/2"\n'
    )
    code, out, _ = run(
        capsys, "rank", "four-bar-crank-rocker", "--by", "order", "--judges", str(file)
    )
    assert code == 0
    # the mean comparison is sqrt(3/2)
    share = (3 / 2) ** 0.5 / (1 + (3 / 2) ** 0.5)
    assert f"width {share:.4g}, height {1 - share:.4g}" in out
    assert "agreement W = 0" in out
    code, _, err = run(capsys, "rank", "four-bar-crank-rocker", "--judges", str(tmp_path / "no"))
    assert code == 2
    assert "cannot be read" in err
