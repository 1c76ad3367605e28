"""Random mechanisms against an independent closure, and mutants that the check must catch."""

from __future__ import annotations

import numpy as np
import pytest
import random_mechanisms as rm

import mechdae as md

SEEDS = range(0, 32)
KINDS = ["rrr", "rrr", "rrp", "rpr", "bar", "wheel"]


def drawn(seeds, **options):
    cases = (rm.draw(seed, **options) for seed in seeds)
    return [case for case in cases if case is not None]


def faults(cases, ratios=None, **keys):
    """Return what is wrong, with the seed of the mechanism."""
    found = []
    for case in cases:
        wrong = rm.check(case, rm.solve(case, **keys), ratios=ratios)
        found += [f"seed {case.seed}: {text}" for text in wrong]
    return found


def test_sweeps(record_property):
    ratios: list[float] = []
    assert faults(drawn(SEEDS, kinds=KINDS), ratios) == []
    record_property("median bound over error", float(np.median(ratios)))


def test_crossing_guides():
    """Groups PRP, whose pin runs to infinity where the guides are parallel: not so far here."""
    compared = 0
    for case in drawn(range(5000, 5012), kinds=["prp", "rrr", "rpr"], dyads=3):
        half = 0.2 if case.angular else 0.1 * case.scale
        case.span = (case.s0 - half, case.s0 + half)
        reach = case.reaches(case.s0 - 2 * half, case.s0 + 2 * half)
        if reach is None or any(end[1] == "pole" for pair in reach for end in pair):
            continue
        assert faults([case]) == []
        compared += 1
    assert compared > 4


def test_near_change_points():
    """Two branches come as near as 1e-10 of the lengths: none is mistaken for the other."""
    assert faults(drawn(range(1000, 1016), near="change", dyads=1, ram=False)) == []


def test_limit_positions():
    """Both ends of the assembled arc are limit positions, to 1e-12, with their poses."""
    ends = 0
    options = {"kinds": ["rrr", "rrp", "rpr"], "dyads": 1, "near": "", "ram": False}
    for case in drawn(range(3000, 3024), **options):
        reach = case.reaches(case.s0 - 7, case.s0 + 7)
        if reach is None or not all(np.isfinite(float(end[0])) for end in reach[1]):
            continue
        result = rm.solve(case, poses=9, range="assembled")
        assert rm.check(case, result) == [], case.seed
        assert [result.status[0], result.status[-1]] == ["limit", "limit"], case.seed
        for ours, end in zip(result.summary["limits"], reach[1], strict=True):
            assert abs(ours - float(end[0])) < 1e-12, case.seed
            ends += 1
    assert ends >= 8


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
def test_scale(scale):
    """Micrometres to kilometres: the same digits, and bounds of the same relative size."""
    case = rm.draw(12, scale=scale, near="", ram=False)
    result = rm.solve(case)
    assert rm.check(case, result) == []
    ok = result.status == "ok"
    assert np.nanmedian(result.bound.length[ok]) < 1e-10 * scale


def test_values_do_not_depend_on_the_number_of_poses():
    for case in drawn(range(40, 44), kinds=KINDS):
        few, many = rm.solve(case, poses=3), rm.solve(case, poses=2001)
        assert list(few.status) == list(many.status[[0, 1000, 2000]])
        for name, series in few.points.items():
            other = many.points[name].position[[0, 1000, 2000]]
            gap = np.abs(series.position - other)
            limit = few.bound.length + many.bound.length[[0, 1000, 2000]]
            assert np.all(np.isnan(gap) | ~(gap > limit[:, None]))


def mode_faults(case):
    """Compare the count of modes with all signs tried, and each label with its own sweep."""
    at = {"at": [case.s0]}
    result = md.solve(case.mechanism(), md.Modes(md.Driver(case.coordinate, **at)))
    labels = [",".join(row) for row in result.labels]
    count = rm.count_modes(case)
    wrong = []
    if count is not None and (count != len(labels) or not result.summary["proven"]):
        wrong.append(f"{len(labels)} modes, {count} by trying all signs")
    if len(set(labels)) != len(labels):
        wrong.append(f"two modes have one label: {labels}")
    for row, label in enumerate(labels[:4]):
        task = md.Sweep(md.Driver(case.coordinate, **at), mode=label)
        sweep = md.solve(case.mechanism(), task)
        if sweep.summary["mode"].replace(" ", "") != label:
            wrong.append(f"asked for {label}, got {sweep.summary['mode']}")
        for name, series in sweep.points.items():
            gap = np.abs(series.position[0] - result.points[name].position[row]).max()
            if not gap < 1e-9 * case.size:
                wrong.append(f"mode {label}: {name} {gap:.2g} from the pose of the sweep")
    return [f"seed {case.seed}: {text}" for text in wrong]


def test_modes():
    assert [text for case in drawn(range(100, 112)) for text in mode_faults(case)] == []


# -- planted mutants: the checks above must see each -----------------------------------------

PLAIN = {"kinds": ["rrr", "rrp", "rpr"], "dyads": 2, "near": "", "ram": False}


def plain(seeds=range(4000, 4006)):
    return drawn(seeds, **PLAIN)


def test_plain_cases_are_right():
    assert faults(plain()) == []


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [("second_rate", 1 + 1e-8, "acceleration"), ("first_rate", 1 - 1e-9, "velocity")],
)
def test_wrong_rate_is_seen(monkeypatch, name, factor, words):
    from mechdae.kernels.blocks import BlockGraph

    right = getattr(BlockGraph, name)

    def wrong(self, *args):
        scaled = factor if self.block.x[0] else 1.0  # of all blocks but the first
        return right(self, *args) * scaled

    monkeypatch.setattr(BlockGraph, name, wrong)
    found = faults(plain())
    assert any(words in text for text in found)


@pytest.mark.parametrize("divisor", [100, 1000])
def test_bound_too_small_is_seen(monkeypatch, divisor):
    from mechdae.analysis import report

    right = report.output_bounds

    def wrong(*args):
        return {word: bound / divisor for word, bound in right(*args).items()}

    monkeypatch.setattr(report, "output_bounds", wrong)
    assert any("bound" in text for text in faults(plain()))


def test_wrong_branch_is_seen(monkeypatch):
    from mechdae.analysis.modes import Assembler

    right = Assembler.distance
    monkeypatch.setattr(Assembler, "distance", lambda *args: -right(*args))
    cases = drawn(range(4000, 4004), **{**PLAIN, "dyads": 1})
    assert any("off by" in text for text in faults(cases))


def test_flipped_label_is_seen(monkeypatch):
    from mechdae.analysis.modes import Assembler

    right = Assembler.group_labels

    def wrong(self, group, poses, u):
        labels = right(self, group, poses, u)
        return [text.translate(str.maketrans("+-", "-+")) for text in labels]

    monkeypatch.setattr(Assembler, "group_labels", wrong)
    assert any("asked for" in text for text in mode_faults(plain()[0]))


def test_lost_mode_is_seen(monkeypatch):
    from mechdae.analysis.modes import Assembler

    right = Assembler.candidates

    def wrong(self, group, x, u):
        poses, proven, failure = right(self, group, x, u)
        return poses[:1], proven, failure

    monkeypatch.setattr(Assembler, "candidates", wrong)
    assert any("by trying all signs" in text for text in mode_faults(plain()[0]))


def test_swallowed_limit_is_seen(monkeypatch):
    from mechdae.analysis.path import Path

    monkeypatch.setattr(Path, "_end", lambda self, limit, ended, up: ended.update(self.groups))
    assert any("limit" in text for text in faults(plain()))


def test_moved_limit_is_seen(monkeypatch):
    from dataclasses import replace

    from mechdae.analysis.path import Path

    right = Path._end

    def wrong(self, limit, ended, up):
        return right(self, replace(limit, s=limit.s + (1e-10 if up else -1e-10)), ended, up)

    monkeypatch.setattr(Path, "_end", wrong)
    assert any("limit" in text for text in faults(plain()))
