"""Variants of a mechanism: counts, what all orders share, the same motion seen from other links."""

from __future__ import annotations

import json
import tomllib
from itertools import combinations, islice, permutations
from math import tau

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe import layers
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.layers import LinksCrossing, fewest_layers
from tests.shared.command import run

FOUR_BAR = "four-bar-crank-rocker"


def again(variant: md.Variant) -> Problem:
    """Return a variant's problem as its file gives it."""
    return from_dict(tomllib.loads(variant.text), variant.name)


def test_counts_are_those_of_the_article() -> None:
    assert md.count_variants(FOUR_BAR, "order") == (3, 3)
    assert md.count_variants(FOUR_BAR, "inversion") == (4, 4)
    assert md.count_variants(FOUR_BAR, "pairs") == (
        16,
        10,
    )  # 10: chains of 4 links with R, P, fixed
    assert md.count_variants(FOUR_BAR, "construction") == (1296, 666)
    named = [variant.name for variant in md.variants(FOUR_BAR, "construction")]
    assert len(set(named)) == 1296


def test_reversal_leaves_666() -> None:
    turned = {"o1": "o2", "o2": "o1", "a1": "b2", "b2": "a1", "a2": "b1", "b1": "a2"}
    # A ground-crank, B crank-coupler, C coupler-rocker, D ground-rocker: A and D keep first and
    # second link when the loop is run through the other way, B and C exchange them
    seen = set()
    for variant in md.variants(FOUR_BAR, "construction"):
        a, b, c, d = variant.name.split("-")
        seen.add(min((a, b, c, d), (d, turned[c], turned[b], a)))
    assert len(seen) == 666


@pytest.mark.parametrize("name", [FOUR_BAR, "loops"])
def test_orders_have_the_same_angles_and_other_boxes(name: str) -> None:
    if name == "loops":
        four_bar = md.from_loops(
            [
                md.Vector("frame", 0.1, 0.0),
                md.Vector("crank", 0.04),
                md.Vector("coupler", 0.12),
                md.Vector("rocker", 0.08),
            ],
            {"closure": ["crank", "coupler", "-rocker", "-frame"]},
            sketch={"crank": 0.7, "coupler": 0.35, "rocker": 1.0},
        )
        turn = md.Sweep(driver=md.Driver("crank.angle", from_=0, to=tau), poses=31)
        problem = Problem(four_bar, {"turn": turn})  # type: ignore[arg-type]
    else:
        problem = md.load(name)
    found = list(md.variants(problem, "order"))
    assert [variant.fault for variant in found] == ["", "", ""]
    results = [md.solve(again(variant), "turn", poses=31) for variant in found]
    for other in results[1:]:
        for body in ("crank", "coupler", "rocker"):
            one, two = results[0].bodies[body], other.bodies[body]
            assert np.abs(one.angle - two.angle).max() <= 1e-14
            assert np.allclose(one.angular_acceleration, two.angular_acceleration, rtol=1e-11)
    boxes = {tuple(np.round(own.summary["envelope"]["all"], 6)) for own in results}
    assert len(boxes) == 3


def test_orders_have_other_losses() -> None:
    problem = md.load(FOUR_BAR)
    joints = [
        md.Revolute(own.name, own.first, own.second, friction=0.1, pin_radius=0.005)
        for own in problem.mechanism.joints.values()
    ]
    base = problem.mechanism
    mechanism = md.Mechanism(
        ground=base.ground, bodies=base.bodies, joints=joints, parameters=base.parameters,
        sketch=base.sketch, loads=[md.Resistance("work", "D.angle", negative=5.0, positive=5.0)],
    )  # fmt: skip
    cycle = md.Reactions(driver=problem.tasks["turn"].driver, poses=31, cycle=True)
    found = list(md.variants(Problem(mechanism, {"cycle": cycle})))  # type: ignore[arg-type]
    assert all(not variant.left_out for variant in found)
    results = [md.solve(again(variant), "cycle").summary for variant in found]
    # the load acts on the angle of the rocker, which all orders share
    assert np.allclose([own["useful"] for own in results], results[0]["useful"], rtol=1e-9)
    assert len({round(own["loss"], 6) for own in results}) == 3


def test_loops_of_five_vectors_have_twelve_orders() -> None:
    from mechdae.parts.types.chains.variants.orders import cyclic

    for count, number in ((3, 1), (4, 3), (5, 12), (6, 60)):
        seen = set()
        for order in permutations(range(count)):
            turns = [order[k:] + order[:k] for k in range(count)]
            seen.add(min(own for turn in turns for own in (turn, turn[::-1])))
        assert len(cyclic(count)) == len(seen) == number
        assert len({min(t, (0, *t[:0:-1])) for t in cyclic(count)}) == number


def test_inversions_have_the_same_relative_motion() -> None:
    found = {own.about["fixed"]: own for own in md.variants(FOUR_BAR, "inversion")}
    assert list(found) == ["ground", "crank", "coupler", "rocker"]
    first = md.solve(again(found["ground"]), "turn", poses=25)
    for fixed in ("crank", "coupler", "rocker"):
        assert not found[fixed].fault
        problem = again(found[fixed])
        assert set(problem.mechanism.joints) == {"A", "B", "C", "D"}
        result = md.solve(problem, "turn", poses=25)
        turned = {"frame": 0.0} | {
            body: first.bodies[body].angle for body in ("crank", "coupler", "rocker")
        }
        base = turned.pop(fixed)
        for body, angle in turned.items():
            off = result.bodies[body].angle - (angle - base)
            assert np.abs(off - tau * np.round(off[0] / tau)).max() < 1e-12


def test_equal_links_make_fewer_inversions() -> None:
    problem = md.load(FOUR_BAR)
    bare = {"bodies": problem.mechanism.bodies.with_(
        "coupler", md.Body("coupler", points={"B": (0.0, 0.0), "C": ("b", 0.0)}))}  # fmt: skip
    from dataclasses import replace

    mechanism = replace(problem.mechanism, **bare)
    whole = Problem(mechanism, problem.tasks)
    assert md.count_variants(whole, "inversion")[0] == 4
    parallelogram = whole.with_values({"a": 0.04, "c": 0.04, "b": 0.1, "d": 0.1})
    assert md.count_variants(parallelogram, "inversion")[0] == 2
    rhombus = whole.with_values({"a": 0.1, "c": 0.1, "b": 0.1, "d": 0.1})
    assert md.count_variants(rhombus, "inversion")[0] == 1


def test_pairs_are_built_in_one_pose() -> None:
    found = {own.name: own for own in md.variants(FOUR_BAR, "pairs")}
    assert len(found) == 16
    opens = found["pairs-RPRR"]
    assert "opens at joint C" in opens.fault
    slider = md.solve(again(found["pairs-RRRP"]), "turn", poses=13)
    assert slider.joints["D"].slide[0] == pytest.approx(0, abs=1e-12)
    first = md.solve(FOUR_BAR, "turn", poses=2)
    assert slider.bodies["coupler"].angle[0] == pytest.approx(first.bodies["coupler"].angle[0])
    assert "still move" in found["pairs-PPPP"].fault


def test_layers_of_a_stack() -> None:
    pins = {"A": ("ground", "one"), "B": ("one", "two"), "C": ("two", "three")}
    links = ("one", "two", "three")
    free = LinksCrossing(links, frozenset(), frozenset())
    plain = fewest_layers(pins, {}, free)
    assert not isinstance(plain, str)
    assert (plain.count, plain.reach) == (3, {"A": 1, "B": 1, "C": 1})
    apart = LinksCrossing(links, frozenset([frozenset(("one", "three"))]), frozenset())
    stack = fewest_layers(pins, {}, apart)
    assert not isinstance(stack, str)
    assert stack.count == 4
    assert len(set(stack.spans.values())) == 3
    fork = fewest_layers(pins, {"B": "two"}, free)
    assert not isinstance(fork, str)
    low, high = fork.spans["two"]
    assert (low < fork.spans["one"][0] < high, high - low, fork.reach["B"]) == (True, 2, 0)
    over = LinksCrossing(links, frozenset(), frozenset([("two", "A")]))  # the fork passes the pin A
    assert "pins that reach over" in str(fewest_layers(pins, {"B": "two"}, over))
    circle = {"A": ("one", "two"), "B": ("two", "three"), "C": ("three", "one")}
    nested = {"A": "one", "B": "two", "C": "three"}
    assert "around each other" in str(fewest_layers(circle, nested, free))


@pytest.mark.parametrize("last", [False, True])
def test_layers_that_cannot_be_are_told_in_bounded_work(
    last: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three links on the frame pass each other's pins; six more may lie anywhere: 9 to the 9."""
    monkeypatch.setattr(layers, "TRIED", 10_000)
    links = tuple(f"L{k}" for k in range(9))
    three = links[-3:] if last else links[:3]
    pins = {f"A{k}": ("ground", name) for k, name in enumerate(three)}
    pairs = frozenset(frozenset(two) for two in combinations(three, 2))
    over = frozenset((name, pin) for name in three for pin in pins if name not in pins[pin])
    told = fewest_layers(pins, {}, LinksCrossing(links, pairs, over))
    assert told == (
        "no order of layers among the first 10000 that were tried" if last
        else "no order of layers lets all links pass the pins that reach over them"
    )  # fmt: skip


def test_an_overhung_pin_rubs_more() -> None:
    found = {own.name: own for own in md.variants("slider-crank-friction", "construction")}
    forks, over = found["a1-a1-b1"], found["o1-a1-b1"]
    about = over.about["pins"]["O"]
    share = 1 + 2 * about["overhang"] / about["width"]
    assert (about["form"], about["carrier"], share) == ("overhung", "ground", 1.5)
    plain = md.solve("slider-crank-friction", "cycle", poses=2)
    held = md.solve(again(forks), "cycle", poses=2)
    assert held.summary["loss"] == pytest.approx(plain.summary["loss"], rel=1e-12)
    more = md.solve("slider-crank-friction", "cycle", poses=2, set={"r_O": share * 0.02})
    rubs = md.solve(again(over), "cycle", poses=2)
    assert rubs.summary["loss"] == pytest.approx(more.summary["loss"], rel=1e-12)
    changed = md.solve(again(over), "cycle", poses=2, set={"O_overhang": 0.0})
    assert changed.summary["loss"] == pytest.approx(plain.summary["loss"], rel=1e-12)


def test_variants_are_made_when_they_are_asked_for() -> None:
    first = list(islice(md.variants("watt-six-bar", "construction"), 2))
    assert len(first) == 2
    assert md.count_variants("watt-six-bar", "construction")[0] == 6**7
    assert len(list(md.variants(FOUR_BAR, "construction", limit=5))) == 5


def test_what_cannot_be_varied_is_said() -> None:
    with pytest.raises(md.UnknownName, match="order"):
        md.variants(FOUR_BAR, "orders")
    with pytest.raises(md.InputError, match="coupler has 3 joints"):
        list(md.variants("watt-six-bar", "order"))
    with pytest.raises(md.InputError, match="plane"):
        list(md.variants("bennett", "inversion"))
    with pytest.raises(md.InputError, match="above 0"):
        md.variants(FOUR_BAR, limit=0)


def test_command(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:  # type: ignore[no-untyped-def]
    assert main(["variants", FOUR_BAR, "--by", "construction", "--limit", "3", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["count"], data["up_to_reversal"], len(data["variants"])) == (1296, 666, 3)
    place = str(tmp_path / "orders")
    assert main(["variants", FOUR_BAR, "--by", "order", "--out", place]) == 0
    files = sorted((tmp_path / "orders").iterdir())
    assert [file.suffix for file in files] == [".toml"] * 3
    assert md.load(files[0]).mechanism.bodies.keys() == {"crank", "coupler", "rocker"}
    assert main(["variants", FOUR_BAR, "--by", "order", "--out", place]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["variants", "watt-six-bar", "--by", "construction", "--json"]) == 2
    assert "--limit" in capsys.readouterr().err


def test_what_has_no_mobility_has_no_inversions(capsys, tmp_path) -> None:
    pins = [md.Revolute("A", "ground.A", "a.A"), md.Revolute("B", "ground.B", "b.B"),
            md.Revolute("C", "a.C", "b.C")]  # fmt: skip
    truss = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "B": (1, 0)}),
        bodies=[md.Body("a", {"A": (0, 0), "C": (1, 0)}), md.Body("b", {"B": (0, 0), "C": (1, 0)})],
        joints=pins, sketch={"a": tau / 6, "b": tau / 3},
    )  # fmt: skip
    task = md.Sweep(driver=md.Driver("a.angle", from_=tau / 6, to=1.2), poses=3)
    file = tmp_path / "truss.toml"
    md.dump(md.Problem(truss, {"move": task}), file)
    code, _, err = run(capsys, "variants", str(file), "--by", "inversion")
    assert code == 2
    assert "it has no mobility: nothing of it moves, whichever link is fixed" in err
