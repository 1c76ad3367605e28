"""Kernels: back ends agree, bounds bound, no status is lost."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from mechdae.kernels.bounds.walk import NoMajorant, majorant, with_trig
from mechdae.kernels.graphs.blocks import inverse
from mechdae.kernels.run import functions
from mechdae.kernels.run.functions import MANY, Batch, StepChain
from mechdae.kernels.run.numpy_backend import NumpyFunction

RANDOM = np.random.default_rng(3)
X, P = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
EXPRESSION = ca.vertcat(
    ca.sin(X[0]) * P[0] - ca.cos(X[1] + X[2]) / P[1],
    X[0] * X[2] - 2 * P[0] + ca.sqrt(P[1]) * 3,
    -ca.sumsqr(X) + ca.fabs(X[1]) * ca.sin(P[0]),
)
F = ca.Function("f", [X, P], [EXPRESSION, X[1] * P])


def test_casadis_machine_and_numpy_compute_the_same(monkeypatch) -> None:
    monkeypatch.setattr(functions, "library", lambda: None)
    p = np.array([0.7, 1.9])
    x = RANDOM.normal(size=(5000, 3))
    one = np.array([np.array(F(row, p)[0]).ravel() for row in x[:50]])
    few = [Batch(F, shared=[1])(x[k : k + 100], p)[0] for k in range(0, 5000, 100)]
    many = Batch(F, shared=[1])(x, p)
    assert len(x) >= MANY
    assert np.array_equal(few[0][:50], one)
    assert np.abs(np.concatenate(few) - many[0]).max() <= 1e-15
    assert np.abs(many[1] - x[:, 1:2] * p).max() == 0


def test_chunks_do_not_show() -> None:
    line = NumpyFunction(F, shared=[1])
    line.chunk = 7
    p = np.array([0.7, 1.9])
    x = RANDOM.normal(size=(60, 3))
    assert np.array_equal(line([x, p])[0], NumpyFunction(F, shared=[1])([x, p])[0])


def test_results_that_others_are_made_of() -> None:
    """A value that is a result, twice and on the way to others; constants and signed zeros."""
    first = X[0] * X[1]
    second = first + P[0]
    results = [
        ca.vertcat(second, first, second * second, first),
        ca.vertcat(ca.if_else(first < 0, 2, second), X[2], 3.5, P[1]),
        ca.atan2(0 * P[0], ca.vertcat(ca.SX(0.0), ca.SX(-0.0))) + ca.vertcat(0, P[0]),
    ]
    f = ca.Function("f", [X, P], [ca.densify(r) for r in results])
    x, p = RANDOM.normal(size=(700, 3)), np.array([0.7, 1.9])
    line = NumpyFunction(f, shared=[1])
    line.chunk = 64
    for _ in range(2):  # the second time in used buffers
        found = line([x, p])
        for k in (0, 63, 64, 699):
            for own, expected in zip(found, f(x[k], p), strict=True):
                assert np.abs(own[k] - np.array(expected).ravel()).max() <= 1e-15


def test_a_value_is_computed_once_whichever_way_it_is_written() -> None:
    results = ca.vertcat(X[0] * P[0], P[0] * X[0] + X[1], X[1] + X[0] * P[0], X[2], 4.0)
    f = ca.Function("f", [X, P], [results])
    line = NumpyFunction(f, [1], unwanted={(0, 3)})
    assert line.results == [(0, 0), (0, 1)]
    assert line.places[0, 2] == ("result", (0, 1))
    assert line.places[0, 4] == ("constant", 4.0)
    assert (0, 3) not in line.places
    x, p = RANDOM.normal(size=(10, 3)), np.array([0.7, 1.9])
    into = {own: np.empty(10) for own in line.results}
    line.block([x.T, p], line.scalars([x.T, p]), into)
    assert np.array_equal(into[0, 0], x[:, 0] * 0.7)
    assert np.array_equal(into[0, 1], x[:, 0] * 0.7 + x[:, 1])


def test_batch_refuses_a_transposed_array() -> None:
    with pytest.raises(ValueError, match="rows of shape"):
        Batch(F, shared=[1])(np.zeros((4, 2)), np.zeros(2))
    assert Batch(F, shared=[1])(np.zeros((0, 3)), np.zeros(2))[0].shape == (0, 3)


def test_sequence_is_the_repeated_step() -> None:
    state, step, c = ca.SX.sym("state", 2), ca.SX.sym("step", 2), ca.SX.sym("c", 1)
    new = ca.vertcat(state[1], state[0] * c + step[0] * step[1])
    advance = ca.Function("a", [state, step, c], [new, step[0], step[1], c])
    many = StepChain(advance, 4)
    states = many(np.array([1.0, 2.0]), np.arange(4.0), 0.5, np.array([3.0]))[0]
    here = np.array([1.0, 2.0])
    for k in range(4):
        here = np.array([here[1], here[0] * 3 + k * 0.5])
        assert np.array_equal(states[k], here)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6])
def test_inverses(n: int) -> None:
    J = ca.SX.sym("J", n, n)
    inv, det = inverse(J)
    function = ca.Function("inv", [J], [inv, det], {"cse": True})
    for power in (0, 4):
        u, _, v = np.linalg.svd(RANDOM.normal(size=(n, n)))
        sigma = np.logspace(0, -power, n)
        matrix = u @ np.diag(sigma) @ v
        ours, det_value = (np.array(part) for part in function(matrix))
        error = np.abs(ours @ matrix - np.eye(n)).max()
        assert error < 1e-14 * 10**power * 20
        if n <= 4:
            assert det_value.item() == pytest.approx(np.linalg.det(matrix), rel=1e-9)


def test_majorants_bound_values_and_rounding() -> None:
    size, q = ca.SX.sym("size", 3), ca.SX.sym("q", 2)
    expression = ca.vertcat(
        ca.sin(X[0]) * P[0] - ca.cos(X[1] - X[2]) / P[1],
        X[0] * X[2] - 2 * P[0] + ca.sqrt(P[1]),
        ca.sin(P[0]) * X[1] ** 2,
    )
    bound, rounding = majorant(expression, [X], [size], noise={})
    limits = ca.Function("m", [size, P], [bound, rounding])
    exact = ca.Function("e", [X, P], [expression])
    del q
    p = np.array([-0.7, 1.9])
    for _ in range(200):
        x = RANDOM.normal(size=3) * 3
        top, slack = (np.array(part).ravel() for part in limits(np.abs(x), p))
        value = np.array(exact(x, p)).ravel()
        assert np.all(np.abs(value) <= top * (1 + 1e-12))
        wide = np.longdouble(x)
        pl = np.longdouble(p)
        true = np.array(
            [
                np.sin(wide[0]) * pl[0] - np.cos(wide[1] - wide[2]) / pl[1],
                wide[0] * wide[2] - 2 * pl[0] + np.sqrt(pl[1]),
                np.sin(pl[0]) * wide[1] ** 2,
            ]
        )
        assert np.all(np.abs(value - true) <= slack * 2.0**-53 + 1e-30)


def test_an_operation_without_bound_is_refused() -> None:
    with pytest.raises(NoMajorant):
        majorant(ca.exp(X), [X], [ca.SX.sym("s", 3)])


def test_trigonometry_can_be_given() -> None:
    S, C = ca.SX.sym("S", 3), ca.SX.sym("C", 3)
    replaced = with_trig([EXPRESSION], X, S, C)[0]
    function = ca.Function("g", [X, S, C, P], [replaced])
    x, p = RANDOM.normal(size=3), np.array([0.7, 1.9])
    ours = np.array(function(x, np.sin(x), np.cos(x), p)).ravel()
    assert np.array_equal(ours, np.array(F(x, p)[0]).ravel())
    other = np.array(function(x, np.sin(x) + 1, np.cos(x), p)).ravel()
    assert other[0] == pytest.approx(ours[0] + p[0])


def test_a_batch_takes_columns_alone() -> None:
    """The compiled machine would take a row too, other back ends would not."""
    x = ca.SX.sym("x", 2)
    with pytest.raises(ValueError, match="outputs are columns: y"):
        Batch(ca.Function("f", [x], [x.T], ["x"], ["y"]))
