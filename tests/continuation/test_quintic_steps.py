"""Steps of long chains, proved around polynomials through their ends, against the closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest

from mechdae.kernels.bounds.series import NoSeries, SymbolicSeries, expanded
from mechdae.motion.cases.hard_steps.quintic_steps import pieces
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.bench.chain import chain
from tests.reference.levers import levers

LONG = np.longdouble
LOOPS = 40


@cache
def path(loops: int = LOOPS) -> Path:
    """Return the path of a whole turn of a chain."""
    item = chain(loops)
    task = replace(item.task, poses=3)
    found = run(prepare(item.problem, task), task).path
    assert isinstance(found, Path)
    return found


def steps(of: Path) -> tuple:
    """Return places, nodes and drivers' values of both ends of all steps of a path."""
    s, states = np.array(of.s), np.array(of.state)
    u = of.drivers(s)
    return tuple(np.stack([part[:-1], part[1:]], axis=1) for part in (s, states, u))


def truth(of: Path, places, loops: int):
    """Return the levers' angles (n, loops) in 80 bits."""
    numbers = [LONG(text) for text in ("0.02", "0.11", "0.05", "0.1")]
    found = levers(np.asarray(places, LONG), loops, *numbers, LONG(1))
    return np.stack([angle for angle, _, _ in found], axis=1)


def columns(of: Path, loops: int) -> list[int]:
    """Return the places of the levers' angles among the unknowns."""
    names = [unknown.key for unknown in of.graphs.scene.unknowns]
    bodies = [f"rocker{k}" for k in range(1, loops + 1)]
    return [next(i for i, name in enumerate(names) if body in name) for body in bodies]


def test_no_step_is_lost_in_a_long_chain() -> None:
    """Steps of a turn are as many as the largest step asks for, whatever the length."""
    for loops in (12, LOOPS, 100):
        counts = path(loops).counts
        assert (counts.steps, counts.rejected) == (129, 0)


@pytest.mark.parametrize("parts", [1, 4])
def test_the_motion_is_within_the_boxes(parts: int) -> None:
    """The closed form is nowhere further from a polynomial than its bound, which is no guess."""
    of = path()
    s, states, u = steps(of)
    c, line = pieces(s, states, u, of.graphs.nx, parts)
    good, away = of.quintics.boxes(c, line)
    assert good.all()
    own = columns(of, LOOPS)
    middle, half = line[:, 0], line[:, 1]
    largest = 0.0
    for t in np.linspace(-1, 1, 9):
        values = sum(c[:, own, k].astype(LONG) * LONG(t) ** k for k in range(6))
        exact = truth(of, middle.astype(LONG) + LONG(t) * half.astype(LONG), LOOPS)
        off = values - exact
        off -= 2 * np.pi * np.round((off / (2 * np.pi)).astype(float))
        share = np.abs(off).astype(float) / away[:, own]
        assert share.max() <= 1
        largest = max(largest, float(share.max()))
    assert largest > 1e-4
    assert np.nanmax(away) < 1e-4


def test_another_branch_at_one_end_is_not_proved() -> None:
    """A node of the other assembly mode of one loop: that loop and those behind it are open."""
    of = path()
    s, states, u = (part[40:41].copy() for part in steps(of))
    graph = of.graphs.blocks[20]
    state, n = states[0, 1], of.graphs.nx
    rng = np.random.default_rng(0)
    for _ in range(200):  # Newton's method from anywhere finds the other solution of the loop
        x = state[:n].copy()
        x[graph.own] += rng.normal(size=graph.size)
        for _ in range(30):
            F, J, _ = graph.value_at(x, u[0, 1], of.constants.p)
            x[graph.own] -= np.linalg.lstsq(J, F, rcond=None)[0]
        turned = np.sin((x - state[:n])[graph.own] / 2)
        if np.abs(F).max() < 1e-15 and np.abs(turned).max() > 0.05:
            break
    else:
        raise AssertionError("there is no other mode")
    assert of.quintics.proved(s, states, u).all()
    states[0, 1, :n] = x
    held = of.quintics.proved(s, states, u)[0]
    assert held[:20].all()
    assert not held[20:].any()


def test_a_node_that_is_off_is_not_proved() -> None:
    of = path()
    s, states, u = (part[:3].copy() for part in steps(of))
    states[1, 1, of.graphs.blocks[5].own[0]] += 0.01
    held = of.quintics.proved(s, states, u)
    assert held[[0, 2]].all()
    assert held[1, :5].all()
    assert not held[1, 5:].any()


def test_what_is_proved_needs_all_that_is_before(monkeypatch: pytest.MonkeyPatch) -> None:
    of = path()
    proved = np.ones((2, of.graphs.nb), bool)
    proved[0, 7] = False
    whole = of.quintics.with_all_before(proved)
    assert whole[1].all()
    assert whole[0, :7].all()
    assert not whole[0, 7:].any()
    monkeypatch.setattr("mechdae.motion.continuation.path.DEEP", 1000)
    assert path.__wrapped__(12).quintics is None


def test_series_bound_what_they_leave_out() -> None:
    """Sums, products, sines, cosines of random polynomials against samples in 80 bits."""
    rng = np.random.default_rng(3)
    x = ca.SX.sym("x", 2)
    value = ca.vertcat(ca.sin(x[0]) * ca.cos(x[1] - 2 * x[0]) + x[1] ** 2 / 3, 2 * x[0] * x[1])
    function = ca.Function("f", [x], [value])
    c = ca.SX.sym("c", 12)
    series = [SymbolicSeries(c[:6].elements()), SymbolicSeries(c[6:].elements())]
    (found,) = expanded(function, [series])
    parts = [ca.vertcat(*part.c, part.e) for part in found]
    evaluate = ca.Function("g", [c], [ca.horzcat(*parts)])
    t = np.linspace(-1, 1, 101).astype(LONG)
    for _ in range(50):
        numbers = rng.normal(size=12) * 0.3 ** np.tile(np.arange(6), 2) * rng.uniform(0, 1)
        result = np.array(evaluate(numbers), LONG)
        p, q = (sum(LONG(numbers[6 * i + k]) * t**k for k in range(6)) for i in (0, 1))
        exact = (np.sin(p) * np.cos(q - 2 * p) + q * q / 3, 2 * p * q)
        for k, truth_ in enumerate(exact):
            off = np.abs(sum(result[j, k] * t**j for j in range(6)) - truth_).max()
            assert off <= result[6, k]
            assert result[6, k] < 1e3 * off + 1e-12
    with pytest.raises(NoSeries):
        expanded(ca.Function("f", [x], [ca.tan(x)]), [series])
