"""Starts of function generators lead to the tabled minimax designs.

Tabled values: tests/data/synthesis.json. The minimax problem is solved here on its own, over the
five numbers of a four-bar with its closure in closed form, and judged by `closure_fourbar`.
"""

from __future__ import annotations

import json

import casadi as ca
import numpy as np
import pytest

from mechdae.design.synthesis.fourbar.freudenstein import FunctionRows, function_starts
from mechdae.errors import InputError
from tests.reference import closure_fourbar as closure
from tests.shared.paths import DATA

CASES = {
    case["id"]: case
    for case in json.loads((DATA / "synthesis.json").read_text(encoding="utf-8"))["cases"]
    if case["id"].startswith("FG4")
}
FUNCTIONS = {
    "log10(x)": np.log10,
    "sin(x deg)": lambda x: np.sin(np.radians(x)),
    "x^2": np.square,
    "exp(x)": np.exp,
}


def scales(case, share):
    """Input and output at shares of the interval, from their starts [rad]."""
    (low, high), f = case["x_range"], FUNCTIONS[case["function"]]
    y, (y0, y1) = f(low + (high - low) * share), f(np.array([low, high], float))
    ranges = np.radians([case["delta_phi_deg"], case["delta_psi_deg"]])
    return ranges[0] * share, ranges[1] * (y - y0) / (y1 - y0)


def lobatto(count):
    return (1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2


def minimax(start, inputs, outputs):
    """The minimax design on nodes that is near the start: lengths within a fifth, angles 0.1."""
    z, t = ca.SX.sym("z", 5), ca.SX.sym("t")
    a, b, c, begin, end = ca.vertsplit(z)
    phi = begin + inputs
    x, y = 1 - a * ca.cos(phi), -a * ca.sin(phi)
    far = ca.sqrt(x**2 + y**2)
    theta3 = ca.atan2(y, x) + start.branch * ca.acos((far**2 + b**2 - c**2) / (2 * far * b))
    psi = ca.atan2(b * ca.sin(theta3) - y, b * ca.cos(theta3) - x)
    error = psi - end - start.sense * outputs
    error = ca.atan2(ca.sin(error), ca.cos(error))
    g = ca.vertcat(error - t, error + t, start.branch * ca.sin(psi - theta3))
    k = len(inputs)
    options = {
        "ipopt": {"print_level": 0, "sb": "yes", "max_iter": 300, "tol": 1e-10}, "print_time": 0,
    }  # fmt: skip
    solver = ca.nlpsol("s", "ipopt", {"x": ca.vertcat(z, t), "f": 10 * t, "g": g}, options)
    lengths = np.asarray(start.lengths)[1:]
    angles = np.array([start.input_start, start.output_start])
    found = solver(
        x0=[*lengths, *angles, start.worst],
        lbx=[*np.maximum(lengths / 1.2, 0.1), *angles - 0.1, 0],
        ubx=[*np.minimum(lengths * 1.2, 8.0), *angles + 0.1, start.worst],
        lbg=[-np.inf] * k + [0] * k + [0.05] * k, ubg=[0] * k + [np.inf] * k + [1] * k,
    )  # fmt: skip
    return np.array(found["x"]).ravel()[:5]


@pytest.mark.parametrize("name", CASES)
def test_the_best_start_leads_to_the_tabled_optimum(name) -> None:
    case = CASES[name]
    nodes, fine = scales(case, lobatto(41)), np.linspace(0, 1, 721)
    start = function_starts(*nodes, keep=1, samples=4000)[0]
    z = minimax(start, *nodes)
    wanted = scales(case, fine)
    made = closure.FourBar((1.0, *z[:3]))
    verdict = closure.judged(
        made, z[3] + wanted[0], z[4] + start.sense * wanted[1],
        full_turn=False, ordered=False, output="output", signs=(start.branch,),
    )  # fmt: skip
    assert verdict.defects == ()
    assert np.degrees(verdict.errors.max()) <= case["bar"]["max_err_deg"]


def test_what_a_start_says_is_true() -> None:
    inputs, outputs = scales(CASES["FG4_exp_0_1_90_90"], lobatto(21))
    starts = function_starts(inputs, outputs, keep=10, samples=2000)
    assert starts
    for start in starts:
        made = closure.FourBar(tuple(start.lengths))
        verdict = closure.judged(
            made, start.input_start + inputs, start.output_start + start.sense * outputs,
            full_turn=False, ordered=False, output="output", signs=(start.branch,),
        )  # fmt: skip
        assert verdict.errors.max() == pytest.approx(start.worst, abs=1e-12)
        assert np.sqrt(np.mean(verdict.errors**2)) == pytest.approx(start.residual, abs=1e-12)
        assert start.lengths[0] == 1.0
        assert start.lengths[1:].min() >= 0.1
        assert start.lengths[1:].max() <= 8.0
    worst = [start.worst for start in starts]
    assert worst == sorted(worst)
    for i, one in enumerate(starts):
        for other in starts[:i]:
            apart = np.abs(np.log(one.lengths / other.lengths)).max()
            for a, b in (
                (one.input_start, other.input_start), (one.output_start, other.output_start),
            ):  # fmt: skip
                apart = max(apart, abs(closure.wrapped(a - b)))
            assert apart >= 0.1


def test_derivatives_of_function_rows() -> None:
    generator = np.random.default_rng(0)
    inputs, outputs = scales(CASES["FG4_sin_0_90_90_90"], lobatto(9))
    for branch in (1, -1):
        rows = FunctionRows(inputs, outputs, branch, (0.5, 2.0))
        x = np.column_stack([generator.normal(size=(2000, 3)), generator.uniform(0, 6, (2000, 2))])
        x = rows.kept(x)[:40]
        assert len(x) == 40
        _, sine = rows.errors(x)
        x = x[(np.abs(sine) > 0.1).all(axis=1)]
        assert len(x) > 5
        _, J, own = rows(x, None)
        assert own is None
        for q in range(5):
            h = 1e-6 * np.eye(5)[q]
            slope = (rows(x + h, None)[0] - rows(x - h, None)[0]) / 2e-6
            np.testing.assert_allclose(J[..., q], slope, atol=1e-6 * np.abs(slope).max())


def test_a_planted_function_is_found() -> None:
    made = closure.FourBar((1.0, 0.6, 1.3, 0.9))
    share = lobatto(15)
    inputs = np.radians(100) * share
    psi = np.unwrap(made.moved(0.5 + inputs, (-1,))[0]["output"])
    (start, *_) = function_starts(inputs, psi - psi[0], samples=4000, senses=(1,))
    assert start.worst < 1e-9
    np.testing.assert_allclose(start.lengths, made.lengths, rtol=1e-6)
    assert start.branch == -1


def test_the_same_seed_gives_the_same_starts() -> None:
    nodes = scales(CASES["FG4_sq_0_90deg"], lobatto(15))
    one, two = (function_starts(*nodes, samples=200, seed=3) for _ in range(2))
    assert [s.worst for s in one] == [s.worst for s in two]
    assert [s.worst for s in one] != [s.worst for s in function_starts(*nodes, samples=200)]


def test_bad_functions() -> None:
    with pytest.raises(InputError, match="three or more finite"):
        function_starts([0, 1], [0, 1])
    with pytest.raises(InputError, match="three or more finite"):
        function_starts([0, 1, np.nan], [0, 1, 2])
    with pytest.raises(InputError, match="as many"):
        function_starts([0, 1, 2], [0, 1, 2, 3])
