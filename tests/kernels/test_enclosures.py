"""Enclosures of expressions over intervals: values, slopes and rounding of every function."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from mechdae.kernels.bounds.intervals import Floors, enclosure, lower_bounds
from mechdae.kernels.bounds.walk import NoMajorant

LONG = np.longdouble

X, P = ca.SX.sym("x", 3), ca.SX.sym("p", 2)

EXPRESSIONS = [
    ca.exp(X[0]) * P[0] - ca.tanh(X[1]),
    ca.sqrt(2 + ca.sin(X[0])) / (3 + ca.cos(X[1])),
    ca.fmin(ca.fmax(X[0] / P[1], -0.4), 0.9) ** 3,
    ca.sinh(X[0]) * ca.cosh(X[1]) + ca.atan(X[2]),
    ca.fabs(X[0]) * ca.sign(X[1]) - ca.remainder(X[2], 1.3),
    ca.log(4 + X[0]) + ca.asin(X[1] / 4) - ca.acos(X[2] / 4),
    (3.5 + X[0]) ** 2.5 + (3.5 + X[0]) ** (-2) + X[1] ** 3,
    ca.atan2(5 + X[0], X[1]) + ca.tan(X[2] / 3),
    ca.if_else(X[0] <= X[1], X[2], X[0] * X[1]),
    2.0 ** X[0] + P[1] ** X[1] - 1 / (X[2] - 4),
]


@pytest.mark.parametrize("k", range(len(EXPRESSIONS)))
def test_enclosures_hold_values_slopes_and_rounding(k: int) -> None:
    random = np.random.default_rng(k)
    slopes = ca.vec(ca.jacobian(EXPRESSIONS[k], X))
    both = ca.densify(ca.vertcat(EXPRESSIONS[k], slopes))
    floor = ca.SX.sym("floor", 16)
    low, high = ca.SX.sym("low", 3), ca.SX.sym("high", 3)
    floors = Floors(floor)
    bounds = enclosure(both, [X], [(low, high)], floors)
    divisors = ca.vertcat(*floors.divisors) if floors.divisors else ca.SX(0, 1)
    measured = ca.Function("d", [X, P], [ca.fabs(divisors)])
    function = ca.Function("b", [low, high, P, floor], list(bounds))
    exact = ca.Function("e", [X, P], [both])
    from mechdae.parts.bench.kinematics import evaluate

    p = np.array([-0.7, 1.9])
    for width in (3.0, 0.1):
        for _ in range(40):
            a = random.uniform(-2.9, 2.9 - width if width < 3 else 0.0, 3)
            x = a + width * random.uniform(0, 1, 3)
            x, b = np.minimum(x, 2.9), np.minimum(a + width, 2.9)
            kept = np.zeros(16)
            kept[: divisors.numel()] = np.array(measured(x, p)).ravel()
            top, slack = (np.array(part).ravel() for part in function(a, b, p, kept))
            value = np.array(exact(x, p)).ravel()
            assert np.all(np.abs(value) <= top * (1 + 1e-12) + 1e-300)
            inputs = [np.asarray(x, LONG)[None, :], np.asarray(p, LONG)[None, :]]
            true = evaluate(exact, inputs)[0]
            assert np.all(np.abs(value - true) <= slack * 2.0**-53 + 1e-30)


def test_divisors_bounded_by_their_interval_need_no_measure() -> None:
    low, high = ca.SX.sym("low", 3), ca.SX.sym("high", 3)
    least = lower_bounds(ca.vertcat(2 + ca.sin(X[0]), X[1], 1 + X[2] ** 2), [X], [(low, high)])
    value = ca.Function("l", [low, high], [least])
    assert np.array(value([-9, -1, -2], [9, 1, 2])).ravel() == pytest.approx([1, 0, 1])
    assert np.array(value([1.4, 1, 3], [1.6, 2, 4])).ravel() == pytest.approx(
        [2.9, 1, 10], rel=0.01
    )
    with pytest.raises(NoMajorant):
        enclosure(ca.erf(X), [X], [(low, high)], Floors(ca.SX.sym("f", 4)))
