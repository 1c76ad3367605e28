"""Every mode has a bound of its error, and keeps it: against Newton's method in 80-bit floats."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.results.tables import table
from tests.attack.refusals import pose_of
from tests.reference.truth.driven import draw
from tests.shared.mechanisms import four_bar

LONG = np.longdouble


def refined(case, x, s):
    """Return the follower's coordinates of a pose to 80-bit rounding."""
    x = x.astype(LONG)
    for _ in range(4):
        F, J = case.closure(x)
        value, slope = case.driven(x)
        F = np.append(F, value - LONG(s))
        x = x - np.linalg.solve(np.vstack([J, slope]).astype(float), F.astype(float))
    assert np.max(np.abs(case.closure(x)[0])) < 1e-17
    return x


def shares(seed, family):
    """Return errors over bounds of all modes of a case, lengths and angles."""
    case = draw(seed, family)
    data = case.data()
    driver = {"coordinate": case.coordinate, "at": [case.s0]}
    data["tasks"] = {"m": {"kind": "modes", "driver": driver}}
    result = md.solve(from_dict(data), task="m")
    assert result.to_dict()["bound"].keys() == {"length", "angle"}
    found = []
    for k in range(len(result.status)):
        bound = {word: float(result.bound[word][k]) for word in ("length", "angle")}
        assert np.isfinite(list(bound.values())).all()
        x = refined(case, pose_of(case, result, k), case.s0)
        for joint in case.joints:
            for body, point, letter in ((*joint[2:4], "a"), (*joint[4:6], "b")):
                if body:
                    at = result.points[f"b{body}.{joint[1]}{letter}"].position[k]
                    off = np.max(np.abs(at - case.place(x, body, point)[0]))
                    found.append(float(off) / bound["length"])
        for body in range(1, case.bodies + 1):
            off = abs(LONG(result.bodies[f"b{body}"].angle[k]) - x[3 * body - 1])
            found.append(float(off) / bound["angle"])
    return found


@pytest.mark.parametrize(
    ("seed", "family"),
    [(0, "pins"), (5, "pins"), (1, "sliders"), (2, "gears"), (3, "mixed"), (4, "short")],
)
def test_modes_keep_their_bound(seed, family):
    found = shares(seed, family)
    assert max(found) <= 1
    assert max(found) > 1e-6  # a bound that says something


def test_a_mode_at_a_limit_has_no_bound():
    """Coupler and rocker in line to the last bit: the error is the root of the rounding."""
    mechanism = four_bar(1, 2, 2, 5, crank=0.0, coupler=0.0, rocker=3.0)
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[0.0])))
    assert len(result.status) >= 1
    assert np.isnan(result.bound.length).all()
    assert result.to_dict()["bound"]["length"][0] is None


def test_the_text_says_the_bound():
    mechanism = four_bar(4, 12, 8, 10, crank=1.0, coupler=0.4, rocker=1.0)
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[1.0])))
    assert result.summary["bound"] == "proved"
    assert (result.bound.length < 1e-12).all()
    assert "error <=  length" in table(result)


def test_a_bound_too_small_is_seen(monkeypatch):
    """Planted: bounds a million times smaller."""
    from mechdae.motion.continuation.output_bounds import OutputBounds

    honest = OutputBounds.by_kind
    monkeypatch.setattr(
        OutputBounds, "by_kind", lambda *a: {k: v * 1e-6 for k, v in honest(*a).items()}
    )
    assert max(shares(3, "mixed")) > 1
