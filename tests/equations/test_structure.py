"""Assur groups, formula, mobility: right, and independent of the order of writing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import Mechanism
from mechdae.equations.groups import formula
from mechdae.equations.mobility import count_mobility
from mechdae.equations.model import Model
from mechdae.equations.reduction import scene
from mechdae.errors import AssemblyError, MechanismError
from mechdae.tasks.show import structure
from tests.shared.mechanisms import moved, triad

SEVEN = "I(1) -> II.3 RPR(2,3) -> {II.2 RRP(4,5); II.1 RRR(6,7)}"


def scene_of(mechanism: Mechanism, *drivers: str, outputs=None):
    return scene(Model(mechanism), [coordinate(mechanism, d) for d in drivers], outputs)


@pytest.mark.parametrize(
    ("name", "task", "expected", "unknowns", "count"),
    [
        ("gorshkov-seven-link", "pose", SEVEN, 4, 70),
        ("scotch-yoke", "turn", "I(1) -> II.5 RPP(2)", 1, 65),
        ("geared-five-bar", "turns", "I(4) -> III 3 links(1,2,3)", 2, 65),
    ],
)
def test_structure_does_not_depend_on_the_order(name, task, expected, unknowns, count) -> None:
    problem = md.load(name)
    poses = None if task == "pose" else 7
    reference = md.solve(problem, task, poses=poses)
    modes = md.solve(problem, "modes").summary["count"]
    random = np.random.default_rng(7)
    for k in range(count):
        other = moved(problem, random)
        whole = scene_of(other.mechanism, *reference.drivers)
        assert formula(whole.groups) == expected
        assert len(whole.x_names) == unknowns
        if k % 5:
            continue
        result = md.solve(other, task, poses=poses)
        assert result.summary["formula"] == expected
        assert list(result.status) == list(reference.status)
        assert md.solve(other, "modes").summary["count"] == modes
        for point, series in reference.points.items():
            for kind in ("position", "velocity", "acceleration"):
                ours = result.points[point][kind]
                size = np.abs(series[kind]).max() + 1e-3
                assert np.abs(ours - series[kind]).max() < 1e-11 * size, (point, kind)


def test_unknowns_after_reduction() -> None:
    four = md.load("four-bar-crank-rocker").mechanism
    whole = scene_of(four, "crank.angle")
    assert (len(Model(four).q_names), len(whole.x_names)) == (9, 2)
    seven = md.load("gorshkov-seven-link").mechanism
    whole = scene_of(seven, "crank.angle")
    assert [len(block.x) for block in whole.blocks] == [1, 1, 2]


def test_pruning_only_for_named_outputs() -> None:
    seven = md.load("gorshkov-seven-link").mechanism
    assert scene_of(seven, "crank.angle").not_in_scene == []
    pruned = scene_of(seven, "crank.angle", outputs=("slider.C",))
    assert pruned.not_in_scene == ["coupler", "rocker"]
    assert [len(block.x) for block in pruned.blocks] == [1, 1]
    result = md.solve("gorshkov-seven-link", "turn", poses=13)
    assert result.summary["not_in_scene"] == ["coupler", "rocker"]
    assert result.summary["work"]["unknowns"] == 2
    assert "coupler.E" not in result.points
    assert set(result.points) == {"slider.C"}


def test_the_formula_depends_on_the_driver() -> None:
    seven = md.load("gorshkov-seven-link").mechanism
    slide = scene_of(seven, "guide.slide")
    assert formula(slide.groups) == "I(5) -> II.1 RRR(3,4) -> {II.2 RRP(1,2); II.1 RRR(6,7)}"
    rocker = scene_of(seven, "rocker.angle")
    names = [group.name for group in rocker.groups]
    assert names[0] == "I(7)"
    assert {"II.1 RRR(3,6)"} <= set(names)
    coupler = scene_of(md.load("four-bar-crank-rocker").mechanism, "coupler.angle")
    assert coupler.groups[0].driven
    assert coupler.groups[0].bodies == ("crank", "coupler", "rocker")


def test_class_and_order_of_a_triad() -> None:
    whole = scene_of(triad(), "crank.angle")
    group = whole.groups[-1]
    assert (group.class_, group.order, len(group.bodies)) == (3, 3, 4)
    assert len(whole.x_names) == 4


def test_jansen_has_two_dyads_in_parallel() -> None:
    data = structure(md.load("jansen-leg"))
    assert data["formulas"][0]["formula"] == (
        "I(1) -> {II.1 RRR(2,3); II.1 RRR(4,5)} -> II.1 RRR(6,7)"
    )
    assert data["mobility"]["W"] == 1
    assert data["mobility"]["rank"]["mobility"] == 1
    assert all(group["class"] == "II" for group in data["groups"][1:])


def test_count_of_mobility() -> None:
    assert count_mobility(md.load("geared-five-bar").mechanism) == {
        "n": 4,
        "p5": 5,
        "p4": 1,
        "W": 1,
    }


def without(name: str, joint: str) -> Mechanism:
    mechanism = md.load(name).mechanism
    return replace(mechanism, joints={n: j for n, j in mechanism.joints.items() if n != joint})


def test_missing_constraints_name_what_moves() -> None:
    with pytest.raises(MechanismError, match="2 constraints missing: coupler, rocker can still"):
        scene_of(without("gorshkov-seven-link", "F"), "crank.angle")


def test_superfluous_constraints_are_named() -> None:
    mechanism = md.load("four-bar-crank-rocker").mechanism
    extra = md.Distance("brace", "crank.B", "rocker.C", length=0.1)
    braced = replace(mechanism, joints={**mechanism.joints, "brace": extra})
    turn = md.Sweep(md.Driver("crank.angle", from_=0.0, to=1.0))
    with pytest.raises(AssemblyError, match=r"open by .* of the .*brace 1 is redundant"):
        md.solve(braced, turn)
    both = (md.Driver("crank.angle", at=[0.3]), md.Driver("rocker.angle", at=[1.2]))
    with pytest.raises(AssemblyError, match=r"1 is redundant .*\n.*or a driver"):
        md.solve(mechanism, md.Sweep(drivers=both))


def test_show_survives_a_mechanism_that_does_not_assemble() -> None:
    data = structure(md.load("four-bar-crank-rocker").with_values({"b": 0.001}))
    assert "cannot be assembled: joint" in data["formulas"][0]["assembly"]
    assert data["mobility"]["rank"] is None


def test_rank_names_the_superfluous_constraint() -> None:
    text = md.load("slider-crank")
    count = structure(text)["mobility"]
    assert (count["W"], count["rank"]["mobility"], count["rank"]["superfluous"]) == (1, 1, [])
