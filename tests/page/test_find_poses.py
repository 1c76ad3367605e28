"""Linkages of two to five poses in the editor's page: all, beside a solver that is not its own."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mechdae.parts.page import link
from tests.reference import burmester
from tests.shared.node import needs_node, run_script

FIND = (Path(link.__file__).parent / "web/find").as_uri()
CASES = 200
POSES = [[0.02, 0.02, 0.3], [0.08, 0.08, 0.9], [0.15, 0.07, 0.4], [0.19, 0.03, -0.2],
         [0.12, 0.0, -0.1]]  # fmt: skip


def complexes(pairs):
    return [complex(*pair) for pair in pairs]


def in_node(folder, text, **data):
    """Run a text that prints what it finds, with the page's dyads and some data."""
    names = (
        "displacementsOf, moved, pivotOf, circlePointOf, "
        "dyadsAlong, dyadCurve, dyadsOfFive, slidesOf"
    )
    head = [f'import {{ {names} }} from "{FIND}/dyads.js";',
            f'import {{ studied }} from "{FIND}/linkages.js";',
            f'import {{ motionsOf }} from "{FIND}/motions.js";']  # fmt: skip
    head += [f"const {name} = {json.dumps(value)};" for name, value in data.items()]
    return run_script("\n".join([*head, text]), folder)


@pytest.fixture(scope="module")
def cases():
    generator = np.random.default_rng(11)
    return {n: [burmester.planted(generator, n) for _ in range(CASES)] for n in (3, 4, 5)}


@needs_node
def test_three_poses_and_chosen_pivots_give_the_planted_four_bar(cases, tmp_path):
    pivots = [[[m.real, m.imag] for m in ms] for _, ms, _ in cases[3]]
    found = in_node(
        tmp_path,
        "console.log(JSON.stringify(poses.map((own, k) => pivots[k].map((m) => "
        "circlePointOf(displacementsOf(own), m)))));",
        poses=[own[2] for own in cases[3]],
        pivots=pivots,
    )
    for (points, ms, poses), own in zip(cases[3], found, strict=True):
        truth = [burmester.point_of_pivot(poses, m) for m in ms]
        assert np.abs(np.array(truth) - points).max() < 1e-6
        assert np.abs(np.array(complexes(own)) - truth).max() < 1e-7


@needs_node
def test_four_poses_have_on_lines_through_a_pole_all_dyads_that_there_are(cases, tmp_path):
    """Planted dyads, and those of the compatibility linkage at five turns of the crank."""
    wanted, poses = [], []
    for points, ms, own in cases[4]:
        dyads = list(zip(points, ms, strict=True))
        for turn in (0.3, 1.1, 2.4, -0.7, -1.9):
            dyads += burmester.dyads_of_four(own, turn)
        wanted.append([[z.real, z.imag, m.real, m.imag] for z, m in dyads])
        poses.append(own)
    found = in_node(
        tmp_path,
        """
console.log(JSON.stringify(poses.map((own, k) => {
  const D = displacementsOf(own);
  const most = D.reduce((best, one) => (one.a[0] < best.a[0] ? one : best));
  const [c, s] = [1 - most.a[0], -most.a[1]], long = c * c + s * s, [x, y] = most.b;
  const pole = [(x * c + y * s) / long, (y * c - x * s) / long];
  return wanted[k].map(([u, v]) =>
    dyadsAlong(D, Math.atan2(v - pole[1], u - pole[0])).map(({ z, m }) => [...z, ...m]));
})));""",
        poses=poses,
        wanted=wanted,
    )
    missed = 0
    for own, truths, there in zip(poses, wanted, found, strict=True):
        for truth, some in zip(truths, there, strict=True):
            assert len(some) <= 2
            for x, y, u, v in some:
                size = 1 + abs(complex(x, y)) + abs(complex(u, v))
                assert (
                    np.abs(burmester.misses(own, complex(x, y), complex(u, v))).max() < 1e-6 * size
                )
            scale = 1 + np.abs(truth).max()
            near = [np.abs(np.array(one) - truth).max() / scale for one in some]
            missed += min(near, default=1.0) > 1e-5
    assert missed == 0
    assert sum(len(own) for own in wanted) > 5 * CASES  # most turns have dyads


@needs_node
def test_five_poses_have_the_dyads_of_the_resultant(cases, tmp_path):
    found = in_node(
        tmp_path,
        "console.log(JSON.stringify(poses.map((own) => "
        "dyadsOfFive(displacementsOf(own)).map(({ z, m }) => [...z, ...m]))));",
        poses=[own[2] for own in cases[5]],
    )
    counts, known = [], 0
    for (points, ms, poses), own in zip(cases[5], found, strict=True):
        there = [(complex(*one[:2]), complex(*one[2:])) for one in own]
        truth = burmester.dyads_of_five(poses)
        assert len(there) in (2, 4)
        for z, m in [*zip(points, ms, strict=True), *truth]:
            assert min(abs(z - x) + abs(m - y) for x, y in there) < 1e-5 * (1 + abs(z) + abs(m))
        for z, m in there:
            assert np.abs(burmester.misses(poses, z, m)).max() < 1e-8 * (1 + abs(z) + abs(m))
        counts.append(len(there))
        known += len(truth)
    assert set(counts) == {2, 4}
    assert known > 0.95 * sum(counts)  # the resultant loses few


@needs_node
def test_slides_stay_on_their_lines(cases, tmp_path):
    found = in_node(
        tmp_path,
        "console.log(JSON.stringify(poses.map((own) => "
        "slidesOf(displacementsOf(own)).map(({ z, slide }) => [...z, ...slide]))));",
        poses=[own[2] for n in (3, 4) for own in cases[n]],
    )
    for (_, _, poses), own in zip([*cases[3], *cases[4]], found, strict=True):
        a, b = burmester.displacements(poses)
        assert len(own) == (24 if len(poses) == 3 else 1)
        for x, y, u, v in own:
            ways = a * complex(x, y) + b - complex(x, y)
            assert np.abs((ways * complex(u, -v)).imag).max() < 1e-6 * (1 + np.abs(ways).max())


@needs_node
def test_branch_order_and_class_are_those_of_a_followed_four_bar(cases, tmp_path):
    """Against the closed form in steps: `planted` turns its crank onward on one branch."""
    found = in_node(
        tmp_path,
        "console.log(JSON.stringify(poses.map((own, k) => { const [one, two] = pairs[k]; "
        "return studied(one, two, displacementsOf(own)); })));",
        poses=[own[2] for own in cases[4]],
        pairs=[[{"z": [z.real, z.imag], "m": [m.real, m.imag]} for z, m in zip(zs, ms, strict=True)]
               for zs, ms, _ in cases[4]],
    )  # fmt: skip
    passed = 0
    for (zs, ms, poses), own in zip(cases[4], found, strict=True):
        a, b = burmester.displacements(poses)
        pins = np.concatenate([[zs[0]], a * zs[0] + b]) - ms[0]
        turns = np.unwrap(np.angle(pins))
        steps = np.linspace(turns[0], turns[-1], 400)
        far = np.abs(ms[1] - ms[0] - abs(pins[0]) * np.exp(1j * steps))
        bar, rocker = abs(zs[1] - zs[0]), abs(zs[1] - ms[1])
        whole = np.all((far < bar + rocker) & (far > abs(bar - rocker)))
        lengths = sorted([abs(pins[0]), bar, rocker, abs(ms[1] - ms[0])])
        grashof = lengths[0] + lengths[3] < lengths[1] + lengths[2]
        assert (own["class"] == "triple-rocker") == (not grashof)
        if whole:  # the crank passes from the first to the last pose without a limit
            assert own["branch"]
            assert own["order"]
            cosine = (bar**2 + rocker**2 - far**2) / (2 * bar * rocker)
            least = np.arcsin(np.sqrt(1 - cosine**2)).min()
            assert own["angle"] <= least + 1e-6
            if not own["full"]:
                assert own["angle"] == pytest.approx(least, abs=2e-3)
            passed += 1
    assert passed > CASES / 2


@needs_node
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_linkages_that_are_offered_meet_the_poses(count, tmp_path):
    poses = POSES[:count]
    found = in_node(
        tmp_path,
        "console.log(JSON.stringify(motionsOf(poses).found));",
        poses=poses,
    )
    assert found
    kinds = set()
    for own in found:
        for dyad in (own["first"], own["second"]):
            z = complex(*dyad["z"])
            if dyad["m"]:
                assert np.abs(burmester.misses(poses, z, complex(*dyad["m"]))).max() < 1e-9
            else:
                a, b = burmester.displacements(poses)
                assert (
                    np.abs(((a * z + b - z) * complex(*dyad["slide"]).conjugate()).imag).max()
                    < 1e-9
                )
        kinds.add("slider" if own["second"]["m"] is None else "four-bar")
        assert own["facts"]["branch"] or count == 5
    assert kinds == {"slider", "four-bar"} or count in (3, 5)
