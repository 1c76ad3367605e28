"""Kernels printed as JavaScript give casadi's numbers."""

from __future__ import annotations

import json

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.page import link
from mechdae.parts.page.programs import javascript
from mechdae.parts.page.programs.javascript import (
    OPERATIONS,
    NotPrintable,
    operations_of,
    script,
    tables,
)
from tests.shared.node import needs_node, run_script

pytestmark = needs_node
SPECIAL = [0.0, -0.0, 1.0, -1.0, 2.5, -2.5, 3.5, 0.5, -0.5, 1e-300, -1e300, np.inf, -np.inf, np.nan]


def evaluated(function, arguments, folder):
    """Return the outputs of the printed function for each row of inputs; pages print the same."""
    made = operations_of(function, "kernel")
    last, (first, _) = made.outputs[-1], made.outputs[0]
    known = {"kernel": made}
    rows = json.dumps([[repr(float(v)) for v in row] for row in arguments])
    text = f"""
import {{ scriptOf }} from "{(link.WEB / "compile.js").as_posix()}";
const given = {json.dumps(script(known))};
if (scriptOf({json.dumps(tables(known))}) !== given) throw new Error("a page prints another text");
const {{ kernel }} = new Function(`return ${{given}}`)();
const names = {{ nan: NaN, inf: Infinity, "-inf": -Infinity }};
const read = (t) => t in names ? names[t] : Number(t);
const text = (v) => String(v).replace("Infinity", "inf").replace("NaN", "nan");
const shown = (v) => Object.is(v, -0) ? "-0.0" : text(v);
console.log(JSON.stringify({rows}.map((row) => {{
  const M = new Float64Array(kernel.size);
  M.set(row.map(read));
  kernel(M);
  return Array.from(M.slice({first}, {last[0] + last[1]}), shown);
}})));
"""
    return np.array([[float(v) for v in row] for row in run_script(text, folder)])


def expected(function, arguments):
    counts = np.cumsum([function.numel_in(i) for i in range(function.n_in())])[:-1]
    rows = []
    for row in arguments:
        results = function.call([ca.DM(part) for part in np.split(np.asarray(row), counts)])
        dense = [np.array(ca.densify(result)).ravel(order="F") for result in results]
        rows.append(np.concatenate(dense))
    return np.array(rows)


UNARY = ["sin", "cos", "tan", "sqrt", "exp", "log", "asin", "acos", "atan", "sinh", "cosh", "tanh",
         "fabs", "sign", "floor", "ceil", "log1p", "expm1"]  # fmt: skip
EXACT = {"sqrt", "fabs", "sign", "floor", "ceil", "sq", "twice", "inv", "neg"}


@pytest.mark.parametrize("name", UNARY)
def test_functions_of_one_number(name, tmp_path):
    x = ca.SX.sym("x")
    function = ca.Function("f", [x], [getattr(ca, name)(x)])
    rng = np.random.default_rng(1)
    arguments = np.array([*SPECIAL, *rng.normal(size=200)])[:, None]
    found, wanted = evaluated(function, arguments, tmp_path), expected(function, arguments)
    near = np.isfinite(wanted)
    assert np.array_equal(found[~near], wanted[~near], equal_nan=True)
    if name in EXACT:
        assert np.array_equal(found[near], wanted[near])
    else:
        assert np.all(np.abs(found[near] - wanted[near]) <= 4 * np.spacing(np.abs(wanted[near])))


@pytest.mark.parametrize(
    "operation",
    [
        lambda a, b: a + b,
        lambda a, b: a - b,
        lambda a, b: a * b,
        lambda a, b: a / b,
        lambda a, b: -a * a + 2 * b,
        lambda a, b: 1 / a,
        lambda a, b: a < b,
        lambda a, b: a <= b,
        lambda a, b: a == b,
        lambda a, b: a != b,
        lambda a, b: ca.logic_not(a),
        lambda a, b: ca.logic_and(a, b),
        lambda a, b: ca.logic_or(a, b),
        lambda a, b: ca.if_else(a > b, a, 0),
        lambda a, b: ca.if_else(a > b, a * 3, b),
        ca.fmod,
        ca.copysign,
    ],
)
def test_functions_of_two_numbers_are_exact(operation, tmp_path):
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("f", [a, b], [operation(a, b)])
    rng = np.random.default_rng(2)
    finite = [v for v in SPECIAL if np.isfinite(v) and abs(v) < 1e100]
    pairs = [(u, v) for u in finite for v in finite]
    arguments = np.vstack([pairs, rng.normal(size=(200, 2))])
    found, wanted = evaluated(function, arguments, tmp_path), expected(function, arguments)
    assert np.array_equal(found, wanted, equal_nan=True)


def test_minimum_and_maximum_hand_nan_on_as_numpy_does(tmp_path):
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("f", [a, b], [ca.fmin(a, b), ca.fmax(a, b)])
    arguments = np.array([[1.0, 2.0], [np.nan, 1.0], [1.0, np.nan], [-3.0, -4.0]])
    found = evaluated(function, arguments, tmp_path)
    wanted = np.stack([np.minimum(*arguments.T), np.maximum(*arguments.T)], axis=1)
    assert np.array_equal(found, wanted, equal_nan=True)


def test_remainder_rounds_halves_to_even_as_numpy_does(tmp_path):
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("f", [a, b], [ca.remainder(a, b)])
    halves = [[k / 2, 1.0] for k in range(-9, 10)]
    arguments = np.vstack([halves, np.random.default_rng(4).normal(size=(200, 2))])
    x, y = arguments.T
    wanted = (x - y * np.rint(x / y))[:, None]
    assert np.array_equal(evaluated(function, arguments, tmp_path), wanted)


@pytest.mark.parametrize("name", ["pose", "advance", "constants"])
def test_kernels_folded_and_in_pieces_give_the_same_bits(name, tmp_path, monkeypatch):
    problem = md.load("jansen-leg")
    task = next(iter(problem.tasks.values()))
    setting = prepare(problem, task)
    path = run(setting, task).path
    function = getattr(setting.graphs, name)
    numbers = path.constants
    some = [(path.s[k], path.state[k]) for k in (0, 20, 40, 60)]
    nx = setting.graphs.nx
    arguments = {
        "pose": [np.concatenate([x[:nx], [s], numbers.consts]) for s, x in some],
        "advance": [np.concatenate([x, [s, 0.03], numbers.consts, [0, 1]]) for s, x in some],
        "constants": [np.concatenate([numbers.size_x, numbers.size_u, numbers.p, [numbers.scale]])],
    }[name]
    folded = evaluated(function, arguments, tmp_path)
    monkeypatch.setattr(javascript, "WHOLE", 50)
    monkeypatch.setattr(javascript, "PIECE", 37)
    pieces = evaluated(function, arguments, tmp_path)
    monkeypatch.setattr(javascript, "LONGEST", 0)
    unfolded = evaluated(function, arguments, tmp_path)
    assert np.array_equal(folded, pieces, equal_nan=True)
    assert np.array_equal(folded, unfolded, equal_nan=True)
    wanted = expected(function, arguments)
    assert np.isfinite(wanted).all()
    assert np.max(np.abs(folded - wanted) / (1 + np.abs(wanted))) < 1e-12


def test_operations_that_cannot_be_printed_are_refused():
    x = ca.SX.sym("x")
    with pytest.raises(NotPrintable, match="strange"):
        operations_of(ca.Function("f", [x], [ca.erf(x)]), "strange")
    assert ca.OP_ERF not in OPERATIONS
