"""Random mechanisms against an independent closure, and mutants that the check must catch."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.attack.mutants import MUTANTS, no_sign
from tests.reference.truth.case import TURN
from tests.reference.truth.drawing import FAMILIES, draw
from tests.reference.truth.judging import judge, solve
from tests.reference.truth.modes import mode_faults

POSES = 24
# a sample of what `tests.attack.honesty` draws: seeds of each family, and the share of poses that
# may be refused although they exist
DRAWN = {
    "dyads": (range(8), 0.0),
    "gears": (range(8), 0.0),
    "triads": (range(5), 0.01),
    "geared": (range(5), 0.0),
    "change": (range(7), 0.0),
    "exact": (range(6), 0.0),
    "saddle": (range(4), 0.0),
    "toggle": (range(4), 0.0),
    "slender": (range(4), 0.1),
    "end": (range(5, 11), 0.0),
    "far": (range(3), 0.0),
    "parallel": (range(12), 0.0),
}


def drawn(family, seeds, **options):
    return [draw(seed, family, **options) for seed in seeds]


def verdicts(cases):
    return [(case, judge(case, solve(case, POSES))) for case in cases]


def faults(cases):
    """Return what is wrong, with the family and seed of the mechanism."""
    return [
        f"{case.family} {case.seed}: {text}"
        for case, verdict in verdicts(cases)
        for text in verdict.faults
    ]


@pytest.mark.parametrize("family", FAMILIES)
def test_families(family, record_property):
    """Every pose marked ok is right; few that exist are refused; the truth is rarely unsure."""
    seeds, share = DRAWN[family]
    judged = verdicts(drawn(family, seeds))
    assert [f"{c.seed}: {text}" for c, v in judged for text in v.faults] == []
    poses = sum(v.poses for _, v in judged)
    refused = sum(v.refused for _, v in judged)
    assert refused <= share * poses
    assert sum(v.ok for _, v in judged) > 0.3 * poses
    assert sum(bool(v.why) for _, v in judged) <= 1
    record_property("bound over error", float(np.nanmedian([v.slack for _, v in judged])))


# what the check has found before
FOUND = {
    "the limit of a group hidden by one of an earlier group just behind": ("dyads", 1139),
    "the same with a triad": ("triads", 4),
    "a later group on another branch at the limit of an earlier one": ("end", 2069),
    "limits far from zero taken for dead points": ("far", 3051),
    "modes of geared bodies held by a distance lost": ("geared", 1007),
    "modes that differ by whole turns said not to be told apart": ("gears", 1002),
    "poses a whole turn away with a rack on the crank": ("gears", 320),
    "rates between two branches right behind a switch": ("exact", 31),
    "a planet where it is not, a whole turn away": ("gears", 1907),
    "a group whole turns away on one that is not there": ("geared", 34251),
    "whole turns of a block that a planet hangs on": ("gears", 25642),
    "values and limits behind branches that nearly cross": ("change", 3722),
    "poses reached behind a place that the truth does not know": ("change", 11043),
    "swing of a pinion on a block that runs away": ("gears", 23293),
    "a pinion that is named by another point than its centre": ("gears", 210098),
    "a change point of a steep branch found whole turns away": ("exact", 15640),
    "the same where the path goes on along the other branch": ("exact", 26124),
    "swing over the whole turns of such a change point": ("exact", 13073),
    "errors of both sides of a change point that cancel at it": ("exact", 5420),
    "accelerations from nodes too near to a change point": ("exact", 202631),
    "a group lost for a moment just before the limit of an earlier one": ("dyads", 3118),
    "the same with a triad behind a cylinder": ("triads", 2959),
    "the same with a platform far away": ("triads", 14101),
    "a limit behind a pole of an earlier group": ("triads", 19061),
    "a fold of a platform far away": ("triads", 3215),
    "a change point missed by a hundredth of a rounding": ("change", 19689),
    "a limit behind branches that cross within rounding": ("change", 22710),
    "a limit before one of another group that was proved from afar": ("end", 33831),
    "a fold behind another one of the same group": ("geared", 62911),
    "a gear on a block and its guide, sketched a whole turn apart": ("gears", 71833),
    "a fold that the truth had found too roughly": ("triads", 91885),
    "a fold of branches that nearly meet, not solved for to the end": ("saddle", 1477),
    "a warning of NumPy about a group that runs away at its limit": ("end", 15080),
}


@pytest.mark.parametrize(("family", "seed"), FOUND.values(), ids=FOUND)
def test_found_before(family, seed):
    case = draw(seed, family)
    verdict = judge(case, solve(case, POSES))
    assert (verdict.faults, verdict.refused, verdict.misnamed) == ([], 0, [])


@pytest.mark.parametrize("seed", [3722, 37086])
def test_behind_branches_that_nearly_cross_nothing_is_ok(seed):
    """Not even what is reached by turning the other way round."""
    case = draw(seed, "change")
    case.crossings = "switch"
    result = solve(case, POSES)
    u = result.drivers[case.coordinate].position
    (at,) = [event["at"] for event in result.events if event["kind"] == "change_point"]
    ends = [event["at"] for event in result.events if event["kind"] == "limit"]
    turned = u - TURN * np.sign(case.s0 - at)
    behind = np.sign(u - at) != np.sign(case.s0 - at)
    behind |= (turned > min(ends)) & (turned < max(ends))
    there = np.isin(result.status, ("ok", "ambiguous"))
    assert there[behind].all()
    assert set(result.status[behind]) == {"ambiguous"}
    assert set(result.status[~behind & there]) == {"ok"}


@pytest.mark.parametrize("seed", [37, 4682, 9750])
def test_poses_before_branches_that_nearly_cross(seed):
    """Branches 1e-8 apart cross up to rounding: the expansion of crossing ones is not theirs."""
    case = draw(seed, "change")
    near = [e for e in solve(case, POSES).events if e["kind"] == "change_point"]
    assert [e["exact"] for e in near] == [False]
    at = near[0]["at"]
    before = 10.0 ** -np.arange(1.5, 9, 0.25) * np.sign(case.s0 - at)
    verdict = judge(case, solve(case, at=[float(s) for s in at + before]))
    assert verdict.faults == []
    assert verdict.ok >= 15


def test_rates_at_a_switch():
    """At the very place they are those of one side, whichever; but all of the same side."""
    case = draw(36304, "exact")
    result = solve(case, POSES)
    assert judge(case, result).faults == []
    u = result.drivers["crank.angle"].position
    velocity = result.points["b21.p1"].velocity
    at, behind = (int(np.flatnonzero(u == value)[0]) for value in (0.0, u[u < 0].max()))
    assert case.crossings == "switch"
    assert np.linalg.norm(velocity[at] - velocity[behind]) > 10
    mixed = velocity.copy()
    mixed[at] = velocity[behind]
    result.points["b21.p1"].__dict__["_arrays"]["velocity"] = mixed
    assert "velocity of b21.p1" in judge(case, result).faults[0]


def test_labels_of_bodies_that_only_slide():
    """The first body of the group has one angle in all modes; each mode has a label."""
    assert mode_faults(draw(32, "triads")) == []


def test_whole_arcs():
    """Both ends of the assembled arc are limit positions, to 1e-12, with their poses."""
    ends = 0
    for case in drawn(
        "dyads", range(3000, 3012), kinds=["rrr", "rrp", "rpr"], count=1, driver="crank"
    ):
        case.assembled = True
        result = solve(case, poses=9)
        assert judge(case, result).faults == [], case.seed
        ends += int(np.sum(result.status == "limit"))
    assert ends >= 6


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
def test_scale(scale):
    """Micrometres to kilometres: the same digits, and bounds of the same relative size."""
    case = draw(12, "dyads", scale=scale, driver="crank")
    result = solve(case)
    assert judge(case, result).faults == []
    ok = result.status == "ok"
    assert np.nanmedian(result.bound.length[ok]) < 1e-10 * scale


def test_values_do_not_depend_on_the_number_of_poses():
    for case in drawn("dyads", range(40, 42)):
        few, many = solve(case, poses=3), solve(case, poses=2001)
        assert list(few.status) == list(many.status[[0, 1000, 2000]])
        for name, series in few.points.items():
            other = many.points[name].position[[0, 1000, 2000]]
            gap = np.abs(series.position - other)
            limit = few.bound.length + many.bound.length[[0, 1000, 2000]]
            assert np.all(np.isnan(gap) | ~(gap > limit[:, None]))


@pytest.mark.parametrize(
    ("family", "seeds"),
    [
        ("dyads", range(100, 106)),
        ("triads", (8, 20)),
        ("gears", (2800, 20200)),  # modes that differ by whole turns
        ("geared", (28240,)),
    ],
)
def test_modes(family, seeds):
    assert [text for case in drawn(family, seeds) for text in mode_faults(case)] == []


# -- planted mutants: the checks above must see each -----------------------------------------


def check(mutant, case):
    return mode_faults(case) if mutant.modes else faults([case])


def test_without_mutants_their_cases_are_right():
    tried = {(mutant.modes, *case) for mutant in MUTANTS for case in mutant.cases}
    for modes, family, seed in sorted(tried):
        case = draw(seed, family)
        assert (mode_faults(case) if modes else faults([case])) == []


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_mutant_is_seen(mutant, monkeypatch):
    """In the words that it is known by."""
    mutant.plant(monkeypatch)
    found = []
    for family, seed in mutant.cases:
        found += check(mutant, draw(seed, family))
        if any(mutant.seen in text for text in found):
            return
    pytest.fail(f"not seen: {found}")


def test_steps_are_proved_without_the_sign(monkeypatch):
    """The sign of the determinant is a second lock: without it nothing becomes wrong."""
    no_sign(monkeypatch)
    assert faults([*drawn("change", range(4)), *drawn("saddle", range(2))]) == []


def test_a_mechanism_that_is_refused_is_counted(monkeypatch):
    """A sweep that marks nothing ok has no fault, and all its poses are refused."""
    from mechdae.motion.continuation.evaluate import Evaluator

    monkeypatch.setattr(
        Evaluator, "_good", lambda self, path, guess, results, *_: np.zeros(results[3].shape, bool)
    )
    case = draw(12, "dyads")
    verdict = judge(case, solve(case, POSES))
    assert (verdict.faults, verdict.ok, verdict.refused) == ([], 0, POSES)


def test_figures_add_up(tmp_path, capsys):
    """The script counts the same in one go, after it was stopped, and in two runs."""
    from tests.attack import honesty

    out = tmp_path / "figures.json"
    options = ["--count", "4", "--seed", "10", "--family", "gears", "--chunk", "2"]
    assert honesty.main([*options, "--out", str(out)]) == 0
    whole = json.loads(out.read_text())
    total = whole["total"]
    assert total["mechanisms"] == 4
    assert total["poses"] == 4 * POSES
    assert total["faults"] == 0
    assert whole["families"]["gears"]["ok"] == total["ok"] > 0
    lines = [json.dumps(part) for part in (whole_about(whole), honesty.chunk((10, 2, "gears")))]
    honesty.parts_of(out).write_text("\n".join(lines) + "\n")
    again = tmp_path / "again.json"
    honesty.parts_of(out).rename(honesty.parts_of(again))
    assert honesty.main([*options, "--out", str(again)]) == 0
    other = json.loads(again.read_text())
    assert "1/1 chunks" in capsys.readouterr().err
    longer = tmp_path / "longer.json"
    for count in ("2", "4"):
        few = [count if option == "4" else option for option in options]
        assert honesty.main([*few, "--out", str(longer)]) == 0
        assert "1/1 chunks" in capsys.readouterr().err
    added = json.loads(longer.read_text())
    for table in (whole, other, added):
        table["total"].pop("seconds"), table["families"]["gears"].pop("seconds")
    assert added == other == whole


def test_the_median_of_classes():
    from tests.attack import honesty

    values = np.exp(np.random.default_rng(4).normal(size=501) * 5)
    classes = {}
    for value in values:
        place = str(round(honesty.BINS * np.log10(value)))
        classes[place] = classes.get(place, 0) + 1
    assert honesty.median(classes) == pytest.approx(np.median(values), rel=0.06)
    assert honesty.median({}) == 0.0


def whole_about(figures):
    return {
        name: figures[name] for name in ("version", "seed", "count", "poses", "family", "chunk")
    }
