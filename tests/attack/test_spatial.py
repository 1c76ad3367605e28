"""A sample of the random spatial loops: no pose `ok` and outside of its bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.cases.space.orientation_checks import OrientationChecks
from tests.attack.honesty import page
from tests.attack.spatial_honesty import LOOPS, case, drawn, error_of, judged, platform
from tests.attack.spatial_mutants import MUTANTS
from tests.attack.spatial_mutants import told as told_by
from tests.attack.spatial_page import DATA, of_vectors, runs, tables
from tests.attack.spatial_page import vectors as vectors_found
from tests.attack.spatial_poses import judged as judge
from tests.attack.spatial_poses import solved
from tests.attack.spatial_sketches import assembled, sketched
from tests.attack.spatial_structures import draw, structure
from tests.attack.spatial_vectors import ReportedVectors
from tests.attack.spatial_vectors import judged as judge_vectors
from tests.attack.vector_sets import draw as draw_vectors
from tests.attack.vector_structures import structure as vectors

SLOW = ("RCCC", "RRRRRRR", "RUURR")


@pytest.mark.parametrize("loop", [name for name in LOOPS if name not in SLOW])
def test_poses_are_where_the_closure_puts_them(loop: str) -> None:
    found = drawn(np.random.default_rng(sum(map(ord, loop))), loop)
    told = judged(found, poses=3)
    assert told["ok"] >= 1  # the planted pose is the middle one
    assert told["wrong"] == 0
    assert told["wide"] == 0


@pytest.mark.parametrize(
    ("loop", "seed", "most"), [("RHEC", 1, 60), ("RERC", 1, 48), ("RCRUP", 2, 200)]
)
def test_slides_do_not_shorten_steps(loop: str, seed: int, most: int) -> None:
    """Bounded by their terms, the equations took 354, 267 and 641 steps for this."""
    found = drawn(np.random.default_rng(seed), loop)
    driver = md.Driver(found.driver, from_=-0.3, to=0.3)
    result = md.solve(found.mechanism, md.Sweep(driver=driver, poses=3, derivatives=0))
    assert list(result.status) == ["ok"] * 3
    assert result.summary["work"]["path_steps"] <= most
    for k in range(3):
        assert error_of(found, result, k) <= result.bound.length[k] < 1e-9


def test_the_closure_sees_a_point_that_is_off() -> None:
    """The judge of this file: a mechanism whose bar is 1e-9 longer is found out."""
    found = case(np.random.default_rng(3), "RSRC")
    points = dict(found.mechanism.bodies["b1"].points)
    x, y, z = points["P1"]
    points["P1"] = (x + 1e-9, y, z)
    longer = replace(found.mechanism.bodies["b1"], points=points)
    bodies = found.mechanism.bodies.with_("b1", longer)
    told = judged(replace(found, mechanism=replace(found.mechanism, bodies=bodies)), poses=3)
    assert told["wrong"] == told["ok"] >= 1


def test_no_mode_has_a_flipped_axis() -> None:
    """Equations of cut axes hold for opposite ones too: of all modes each solves the closure."""
    found = case(np.random.default_rng(1), "RCCC")
    result = md.solve(found.mechanism, md.Modes(driver=md.Driver("J0.angle", at=[0.0])))
    assert len(result) >= 1
    for k in range(len(result)):
        assert error_of(found, result, k) < 1e-9


@pytest.mark.parametrize("number", [0, 2, 9])
def test_many_sets_of_one_structure(number: int) -> None:
    """A slide and a ball, two loops with a bar, a wheel: a sample of `spatial_poses`."""
    rng = np.random.default_rng((1, number))
    told = judge(draw(structure(rng), rng, 6), rng, poses=3)
    assert told["mechanisms"] >= 5
    assert told["tracked"] >= 10
    assert told["wrong"] == told["turned wrong"] == 0


@pytest.mark.parametrize("number", [5, 7, 16])
def test_wheels_of_many_sets(number: int) -> None:
    """Axes that are parallel, a rack on the driven link, bevel wheels on it: one held fixed."""
    rng = np.random.default_rng((4, number))
    found = structure(rng, wheels=True)
    assert found.name == {5: "g=-RCSR", 7: "ok-RPHERR", 16: "og^-RRSUP"}[number]
    told = judge(draw(found, rng, 5), rng, poses=3)
    assert told["mechanisms"] >= 4
    assert told["tracked"] >= 8
    assert told["wrong"] == told["turned wrong"] == 0


@pytest.mark.parametrize("number", [0, 2, 3])
def test_many_sets_of_one_structure_of_vectors(number: int) -> None:
    """One loop, a loop beside a crank, two loops: a sample of `spatial_vectors`."""
    rng = np.random.default_rng((1, number))
    told = judge_vectors(draw_vectors(vectors(rng), rng, 6), rng, poses=3)
    assert told["mechanisms"] >= 5
    assert told["tracked"] >= 6
    assert told["wrong"] == told["turned wrong"] == 0


@pytest.mark.parametrize("name", MUTANTS)
def test_mistakes_planted_in_space_are_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert told_by(MUTANTS[name], monkeypatch) > 0


def test_a_plate_on_six_bars() -> None:
    found = platform(np.random.default_rng(4))
    driver = md.Driver("J0.angle", from_=-0.04, to=0.0)
    result = md.solve(found.mechanism, md.Sweep(driver=driver, poses=3, derivatives=0))
    assert list(result.status) == ["ok"] * 3
    assert result.summary["work"]["unknowns"] == 7
    for k in range(3):
        assert error_of(found, result, k) <= result.bound.length[k] < 1e-6
    for name, place in found.planted.items():
        assert np.abs(result.points[f"plate.{name}"].position[-1] - place).max() < 1e-12


def test_a_quaternion_and_its_opposite_are_one_mode() -> None:
    found = platform(np.random.default_rng(4))
    modes = md.solve(found.mechanism, md.Modes(driver=md.Driver("J0.angle", at=[0.0])))
    places = modes.points["plate.T0"].position
    assert modes.summary["count"] == len(modes) >= 1
    for k, own in enumerate(places):
        assert all(np.abs(own - other).max() > 1e-6 for other in places[:k])


@pytest.mark.parametrize("loop", ["RSRC", "RRSRR", "RCUC", "k-RSSR"])
def test_rough_places_of_points_alone_tell_the_pose(loop: str) -> None:
    rng = np.random.default_rng((3, sum(map(ord, loop))))
    word, off = assembled(sketched(rng, drawn(rng, loop), noise=0.2))
    assert word == "ok"
    assert off < 2.0


def test_a_flipped_axis_would_be_seen() -> None:
    """The judge of sketches: a pose whose last axis is the other way round is no solution."""
    found = case(np.random.default_rng(3), "RSRC")
    pair = found.closure.pairs[3]
    turned = replace(pair, a2=-np.array(pair.a2), n2=np.array(pair.n2))
    closure = replace(found.closure, pairs=[*found.closure.pairs[:3], turned])
    assert assembled(found)[0] == "ok"
    assert assembled(replace(found, closure=closure))[0] == "flipped"


def test_a_sketch_with_axes_turned_round_is_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Places at which the equations hold with an axis the other way: the pose is another one."""
    found = case(np.random.default_rng(1), "RCCC")
    asked = md.Modes(driver=md.Driver("J0.angle", at=[0.0]))
    with monkeypatch.context() as patch:
        patch.setattr(OrientationChecks, "of_group", lambda self, group, poses, u: poses)
        every = md.solve(found.mechanism, asked)
    wrong = [k for k in range(len(every)) if not error_of(found, every, k) < 1e-9]
    assert wrong
    places = {
        f"{name}.{axis}": float(every.points[name].position[wrong[0], i])
        for name in every.points
        for i, axis in enumerate("xyz")
        if not name.startswith("ground")
    }
    mechanism = replace(found.mechanism, sketch=places)
    driver = md.Driver("J0.angle", at=[0.0])
    result = md.solve(mechanism, md.Sweep(driver=driver, derivatives=0))
    assert result.status[0] == "ok"
    assert error_of(found, result, 0) < 1e-9
    assert any("lies far from it" in note for note in result.summary["notes"])


def test_a_change_point_whose_third_order_is_lost_to_rounding_is_singular() -> None:
    """The 79th set of a screw, a bar and a hinge: it ended with a division by zero."""
    rng = np.random.default_rng((3, 4))
    found = draw(structure(rng), rng, 250, 0.3)
    results, _ = solved(replace(found, mechanisms=found.mechanisms[:79]), rng, 7, 0.3)
    assert list(results[78].status) == 3 * ["unassembled"] + ["singular"] + 3 * ["unassembled"]


def test_a_sum_of_numbers_that_cancel_counts_in_the_bound() -> None:
    """A nearly level vector is as long as the heights of two others leave: 6e-12 of it was lost."""
    (l0, e0), (l2, e2) = (
        (0.912039233088773, 3.0574626321697385),
        (1.0568871063952663, -0.0725772791),
    )
    e1 = 9.593927823292603e-07
    mechanism = md.from_loops(
        [md.Vector("v0", length=l0, elevation=e0), md.Vector("v1", elevation=e1),
         md.Vector("v2", length=l2, elevation=e2)],
        {"L": ("v0", "-v1", "v2")}, dimension=3,
        sketch={"v0.azimuth": -2.29, "v1.azimuth": 2.2, "v2.azimuth": -3.1},
    )  # fmt: skip
    wide = np.longdouble
    exact = (l0 * np.sin(wide(e0)) + l2 * np.sin(wide(e2))) / np.sin(wide(e1))
    driver = md.Driver("v0.azimuth", from_=-2.29, to=-2.2)
    result = md.solve(mechanism, md.Sweep(driver=driver, poses=3, derivatives=0))
    assert set(result.status) == {"ok"}
    assert 0 < np.abs(result.joints["v1"].length - exact).max() <= result.bound.length.min()


def test_a_plate_whose_sketch_is_a_pose_is_found_where_the_search_fails() -> None:
    """One of its legs is 10 000 times shorter than others: 512 starts led to no pose of it."""
    rng = np.random.default_rng((1, 13))
    found = draw_vectors(vectors(rng), rng, 20)
    driver = md.Driver(found.structure.driver, at=[float(found.start[0][17, found.loops.driven])])
    result = md.solve(found.mechanisms[17], md.Sweep(driver=driver, derivatives=0))
    assert list(result.status) == ["ok"]
    own = ReportedVectors(found, [result] * 18, [17])
    loops, first = found.loops.chosen([17]), np.zeros(1, int)
    there = loops.placed(found.start[0][[17]], {k: q[[17]] for k, q in found.start[1].items()})
    assert own.errors(there[0], first, first)[0] < 1e-9


def test_the_page_tells_what_the_runs_have_found() -> None:
    text = (DATA.parent / "theory/evidence/honesty.md").read_text("utf-8")
    assert page(text, tables(runs()) | of_vectors(vectors_found())) == text
    assert "| **all** |" in text
