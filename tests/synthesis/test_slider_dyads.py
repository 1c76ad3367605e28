"""Limits of transmission angles in synthesis: dyads with slides, and where there is no angle."""

from __future__ import annotations

import tomllib

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import InputError
from tests.attack import slider_dyads


def problem_of(text):
    return from_dict(tomllib.loads(text))


SAMPLE = (0, 1, 2, 3, 4, 5, 67, 136, 156)
"""One seed of each family of ``slider_dyads.py``; poses that leap by a turn, the other mode of the
first dyad, poses beyond their branch. Many of them: the script itself."""


@pytest.mark.parametrize("seed", SAMPLE)
def test_a_limit_holds_on_the_closed_form(seed):
    found = slider_dyads.judged(seed)
    assert not found["faults"]
    assert found["margin"] == pytest.approx(0, abs=1e-6), "the best design lies on the limit"


def test_a_limit_on_the_sign_of_the_determinant_alone_is_seen(monkeypatch):
    """The old rule: of a dyad with a slide only the side was held, not the angle."""
    from mechdae.design.synthesis import designs
    from mechdae.design.synthesis.poses import FreePoses

    monkeypatch.setattr(FreePoses, "sine", lambda self, dyad, branch, values, sigma: 1.0)
    monkeypatch.setattr(designs, "_missed_limits", lambda search, design: [])
    faults = [slider_dyads.judged(seed)["faults"] for seed in (0, 1, 3)]
    assert all("the limit is" in " ".join(own) for own in faults)


def test_a_limit_that_is_not_in_the_problem_is_seen_by_the_sweep(monkeypatch):
    from mechdae.design.synthesis.poses import FreePoses

    monkeypatch.setattr(FreePoses, "sine", lambda self, dyad, branch, values, sigma: 1.0)
    assert "the transmission angle in B" in slider_dyads.judged(0)["faults"][0]


@pytest.mark.parametrize("pair", [["crank", "slider"], ["crank", "rod"], ["rod"]])
def test_bodies_between_which_there_is_no_angle_are_refused(pair):
    _, text, *_ = slider_dyads.case(0)
    text = text.replace('["rod", "slider"]', str(pair).replace("'", '"'))
    with pytest.raises(InputError) as caught:
        md.synthesize(problem_of(text))
    assert caught.value.where == "tasks.design.constraints[1].between"
    assert "rod and slider (joint B)" in caught.value.hint


def test_the_best_transmission_angle_of_a_slider_crank():
    """sin of the pressure angle is at most (r + |e|)/l: the best has e = 0 and the longest l."""
    _, text, *_ = slider_dyads.case(0)
    head, _, _ = text.partition("[tasks.design]")
    text = (
        head
        + """[tasks.turn]
kind = "sweep"
driver = { coordinate = "O.angle", from_deg = 0, to_deg = 360 }
measures = ["transmission"]
poses = 73
[tasks.design]
kind = "synthesis"
driver = { coordinate = "O.angle" }
starts = 4
goal = { kind = "maximise", of = "turn/joints/B/transmission_angle" }
constraints = [{ kind = "full-turn", coordinate = "O.angle" }]
free = { l = [1.5, 4], e = [-1, 1] }
"""
    )
    best = md.synthesize(problem_of(text), "design").data["designs"][0]
    assert best["objective"] == pytest.approx(1.3181160716528180, abs=1e-9)  # acos(1/4)
    assert best["parameters"]["e"] == pytest.approx(0, abs=1e-6)
