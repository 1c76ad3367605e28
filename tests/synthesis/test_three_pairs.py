"""Three pairs of angles (Freudenstein), and what bounds leave out; margins by the size."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.design.synthesis.fourbar.freudenstein import three_pairs
from tests.reference.closure_fourbar import rrr
from tests.shared.paths import DATA

CASE = DATA / "synthesis" / "rocker-mirrored.toml"
PAIRS = [[0.698, 1.745], [1.309, 2.007], [1.920, 2.356]]


def task_of(pairs, measure, bounds, ground=4.0):
    """Return the case with other pairs, measure, bounds of crank and rocker, and ground."""
    text = CASE.read_text(encoding="utf-8").replace("least-squares", measure)
    text = text.replace("= [0.2, 6]", f"= {bounds}").replace("B0 = [4, 0]", f"B0 = [{ground}, 0]")
    head, _, _ = text.rpartition("targets =")
    return from_dict(tomllib.loads(f"{head}targets = {pairs}\n"))


def planted(generator):
    """Return a four-bar on a ground of one, links of either sign, and three pairs of its angles."""
    while True:
        a, b, c = generator.uniform([0.3, 0.3, 0.3], [3, 4, 3])
        a, c = a * generator.choice([-1, 1]), c * generator.choice([-1, 1])
        phi = np.sort(generator.uniform(0, 6, 3))
        B, height = rrr(a * np.exp(1j * phi), 1 + 0j * phi, b, abs(c), generator.choice([-1, 1]))
        psi = np.angle((B - 1) / c)
        rows = np.stack([np.cos(psi), -np.cos(phi), np.ones(3)])
        if (height > 0.01).all() and np.linalg.cond(rows) < 1e4:
            return (a, b, c), phi, psi


def test_three_pairs_give_back_the_four_bar():
    generator = np.random.default_rng(3)
    for _ in range(300):
        lengths, phi, psi = planted(generator)
        np.testing.assert_allclose(three_pairs(phi, psi), lengths, rtol=1e-8)
    assert three_pairs(np.array([0.3, 0.3, 1.0]), np.array([0.4, 0.4, 0.9])) is None


def test_exact_targets_of_a_function():
    """45, 90, 135 degrees to 60, 80, 100: the three constants by hand."""
    phi, psi = np.radians([[45, 90, 135], [60, 80, 100]])
    K = np.linalg.solve(
        np.stack([np.cos(psi), -np.cos(phi), np.ones(3)], axis=1), np.cos(phi - psi)
    )
    a, c = 1 / K[0], 1 / K[1]
    wanted = [a, np.sqrt(1 + a * a + c * c - 2 * a * c * K[2]), c]
    np.testing.assert_allclose(wanted, [0.113497352, 1.050144156, 0.244310504], rtol=1e-8)
    pairs = np.stack([phi, psi], axis=1).tolist()
    result = md.synthesize(task_of(pairs, "exact", "[0.05, 6]", 1.0), starts=4)
    best = result.data["designs"][0]
    np.testing.assert_allclose(list(best["parameters"].values()), wanted, rtol=1e-8)
    assert np.abs(best["errors"]).max() < 1e-9
    assert not best["defects"]
    assert "notes" not in result.summary


@pytest.mark.parametrize("measure", ["exact", "least-squares"])
def test_bounds_that_leave_out_the_answer_are_told(measure):
    x, y = np.array(PAIRS).T
    a, b, c = 4 * three_pairs(x, y)
    assert a < 0 > c
    found = md.synthesize(task_of(PAIRS, measure, "[0.2, 6]"), starts=4)
    said = found.fault if measure == "exact" else found.summary["notes"][0]
    assert "the bounds of a, c leave out" in said
    assert f"a = {a:.6g}, b = {b:.6g}, c = {c:.6g}" in said
    # what is said is followed, and works
    followed = md.synthesize(task_of(PAIRS, measure, "[-5, 5]"), starts=8)
    best = followed.data["designs"][0]
    np.testing.assert_allclose(list(best["parameters"].values()), [a, b, c], rtol=1e-6)
    assert "a is negative: crank is drawn backwards" in best["note"]
    assert "c is negative: rocker" in best["note"]
    assert "notes" not in followed.summary
    assert "drawn backwards" in " ".join(str(followed).split())


def test_three_values_of_a_place_are_met_without_a_word_about_angles():
    """The height of the rocker's pin, of a four-bar with 1.2, 3.5, 2.5 on 4."""
    x = np.radians([40.0, 65.0, 90.0])
    B, _ = rrr(1.2 * np.exp(1j * x), 4 + 0j * x, 3.5, 2.5, 1)
    problem = task_of(np.stack([x, B.imag], axis=1).tolist(), "exact", "[0.2, 6]")
    task = problem.tasks["design"]
    task = replace(task, goal=replace(task.goal, output="rocker.B.y"))
    result = md.synthesize(problem.with_task("design", task), starts=4)
    assert np.abs(result.data["designs"][0]["errors"]).max() < 1e-9
    assert "notes" not in result.summary


@pytest.mark.parametrize("size", [1e-9, 1e6])
def test_a_full_turn_is_asked_for_by_the_size_of_the_mechanism(size):
    problem = md.load("c2-arc5-timed")
    lengths = ("r1", "r2", "r3", "r4", "r_cx", "r_cy", "x0", "y0")

    def scaled(by):
        mechanism = problem.mechanism
        own = problem.tasks["design"]
        targets = (by * np.array(own.goal.targets)).tolist()
        task = replace(
            own, goal=replace(own.goal, targets=targets), constraints=({"kind": "full-turn"},),
            free={name: tuple(by * np.array(pair)) for name, pair in own.free.items()},
        )  # fmt: skip
        values = {name: by * mechanism.values()[name] for name in lengths}
        whole = replace(problem, mechanism=mechanism.with_values(values))
        return md.synthesize(whole.with_task("design", task), starts=2).data["designs"][0]

    one, other = scaled(1.0), scaled(size)
    assert other["objective"] == pytest.approx(size**2 * one["objective"], rel=1e-6)
    for name, value in one["parameters"].items():
        assert other["parameters"][name] == pytest.approx(size * value, rel=1e-4)
