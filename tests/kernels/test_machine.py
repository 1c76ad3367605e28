"""The compiled machine: bits of NumPy and of casadi's machine, own sine and cosine, robustness."""

from __future__ import annotations

import subprocess
import sys
import threading

import casadi as ca
import mpmath
import numpy as np
import pytest

from mechdae import __version__
from mechdae.kernels.machine import program as compiling
from mechdae.kernels.machine.library import library
from mechdae.kernels.machine.line import CompiledLine
from mechdae.kernels.machine.program import one_by_one, stored
from mechdae.kernels.run import functions
from mechdae.kernels.run.functions import Batch, Call, StepChain, program
from mechdae.kernels.run.numpy_backend import NumpyFunction
from tests.shared.machine import (
    BINARY,
    FUNCTIONS,
    LOGIC,
    SPECIAL,
    UNARY,
    needs_machine,
    numbers,
    random_function,
    same,
)
from tests.shared.paths import ROOT

pytestmark = needs_machine
PAIRS = np.array([(a, b) for a in SPECIAL for b in SPECIAL])
A, B = ca.SX.sym("a"), ca.SX.sym("b")
FEW = 512
"""Poses from which sine and cosine are the machine's own."""


def of_two(make) -> ca.Function:
    return ca.Function("f", [A, B], [make(A, B)])


@pytest.mark.parametrize("name", [*BINARY, *UNARY, *LOGIC])
def test_each_operation_has_numpys_bits_and_casadis(name: str) -> None:
    make = BINARY.get(name) or LOGIC.get(name) or (lambda a, b: UNARY[name](a))
    function = of_two(make)
    x = np.vstack([PAIRS, np.random.default_rng(1).normal(size=(777, 2))])
    columns = [x[:, :1], x[:, 1:]]
    if name not in LOGIC:
        expected = NumpyFunction(function)(columns)[0]
        assert same(program(function).many(*columns)[0], expected)
        for i in (0, 1):  # one operand shared by all poses
            for row in (0, 3, 7, 200):
                own = [columns[0], columns[1]]
                own[i] = x[row, i : i + 1]
                expected = NumpyFunction(function, [i])(own)[0]
                assert same(program(function, [i]).many(*own)[0], expected), (i, row)
    for a, b in x[:200]:
        assert same(program(function).one(float(a), float(b))[0], np.array(function(a, b))[0])


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_of_the_c_library_are_within_two_ulp_of_the_truth(name: str) -> None:
    own = FUNCTIONS[name]
    function = of_two(own if name in ("atan2", "pow") else lambda a, b: own(a) + 0 * b)
    x = np.random.default_rng(2).uniform(0.01, 0.99, size=(400, 2))
    found = program(function).many(x[:, :1], x[:, 1:])[0][:, 0]
    true = {"pow": mpmath.power}.get(name) or getattr(mpmath, name)
    for (a, b), value in zip(x, found, strict=True):
        with mpmath.workdps(40):
            exact = true(a, b) if name in ("atan2", "pow") else true(a)
            assert abs(value - exact) <= 2 * np.spacing(abs(value)), (name, a, b)


def test_sine_and_cosine_are_within_one_ulp() -> None:
    random = np.random.default_rng(5)
    multiples = np.arange(-40, 41) * (np.pi / 2)
    x = np.concatenate([
        random.uniform(-4, 4, 600), random.uniform(-1e5, 1e5, 300), random.normal(size=100) * 1e-9,
        multiples, np.nextafter(multiples, 9), multiples + 1e-6, [0.0, -0.0, 5e-324, 1e-308],
        random.uniform(-1, 1, 50) * 10.0 ** random.uniform(5, 300, 50),
    ])  # fmt: skip
    function = ca.Function("f", [A], [ca.sin(A), ca.cos(A)])
    sine, cosine = program(function).many(x[:, None])
    alone = program(ca.Function("f", [A], [ca.sin(A)])).many(x[:, None])[0]
    assert same(alone, sine)
    worst = 0.0
    with mpmath.workdps(400):
        for value, s, c in zip(x, sine[:, 0], cosine[:, 0], strict=True):
            for own, exact in ((s, mpmath.sin(value)), (c, mpmath.cos(value))):
                worst = max(worst, float(abs(own - exact) / np.spacing(max(abs(own), 5e-324))))
    assert 0.5 <= worst <= 1.0
    assert same(np.signbit(sine[x == 0]), np.signbit(x[x == 0][:, None]))
    odd = program(function).many(np.array([[np.inf], [-np.inf], [np.nan]]))
    assert np.isnan(odd[0]).all()
    assert np.isnan(odd[1]).all()


@pytest.mark.parametrize("seed", range(40))
def test_random_functions_have_numpys_bits_and_casadis(seed: int) -> None:
    function = random_function(seed, 10 + 12 * (seed % 10))
    inputs = numbers(seed, 150)
    expected = NumpyFunction(function, [1])(inputs)
    for own, other in zip(program(function, [1]).many(*inputs), expected, strict=True):
        assert same(own, other)
    unshared = [inputs[0], np.tile(inputs[1], (150, 1)), inputs[2]]
    for own, other in zip(program(function).many(*unshared), expected, strict=True):
        assert same(own, other)
    function = random_function(seed, 60, functions=True)
    for k in range(20):
        at = (inputs[0][k], inputs[1], inputs[2][k])
        for shared in ((), (1,)):
            found = program(function, shared).one(*at)
            for own, other in zip(found, function(*at), strict=True):
                assert same(own, np.array(other).ravel())


def test_all_vector_instructions_give_the_same_bits() -> None:
    machine = library()
    name, level, levels = machine.vectors(None)
    function = random_function(7, 150, functions=True)
    inputs = numbers(7, 700)
    own = program(function, [1])
    try:
        found = []
        for k in range(levels):
            machine.vectors(k)
            found.append(own.many(*inputs))
    finally:
        machine.vectors(level)
    assert name
    for other in found[1:]:
        assert all(same(a, b) for a, b in zip(found[0], other, strict=True))
    with pytest.raises(ValueError, match="level"):
        machine.vectors(levels)


@pytest.mark.parametrize("n", [0, 1, 2, 7, 8, 9, 63, 64, 65, 511, 512, 513, 1500])
def test_blocks_do_not_show(n: int) -> None:
    function = random_function(3, 80, functions=True)
    x, p, y = numbers(3, 1500 if n >= FEW else FEW - 1)
    whole = program(function, [1]).many(x, p, y)
    part = program(function, [1]).many(x[:n], p, y[:n])
    wide = np.zeros((2 * n, 12))
    wide[::2, 1::2][:, :5] = x[:n]
    strided = program(function, [1]).many(wide[::2, 1::2][:, :5], p, np.asfortranarray(y[:n]))
    for a, b, c in zip(part, whole, strided, strict=True):
        assert a.shape == (n, b.shape[1])
        assert same(a, b[:n])
        assert same(a, c)


def test_few_poses_have_the_bits_of_single_calls() -> None:
    function = random_function(5, 80, functions=True)
    x, p, y = numbers(5, FEW, special=False)
    own = program(function, [1])
    few, many = own.many(x[:-1], p, y[:-1]), own.many(x, p, y)
    for k in range(0, FEW - 1, 10):
        assert all(same(a[k], b) for a, b in zip(few, own.one(x[k], p, y[k]), strict=True))
    turned = ca.Function("f", [A], [ca.sin(A), ca.cos(A)])
    places = np.random.default_rng(6).uniform(-9, 9, (FEW, 1))
    few, many = program(turned).many(places[:-1]), program(turned).many(places)
    for a, b in zip(few, many, strict=True):
        assert np.abs(a - b[:-1]).max() <= np.spacing(1.0) / 2


def test_one_pose_may_stand_for_all() -> None:
    function = random_function(4, 40)
    x, p, y = numbers(4, 30)
    own = program(function, [1])
    one = own.many(x, p, y[:1])
    assert all(
        same(a, b) for a, b in zip(one, own.many(x, p, np.repeat(y[:1], 30, 0)), strict=True)
    )


def test_a_chain_is_the_repeated_step_bit_by_bit(monkeypatch) -> None:
    state, step, c = ca.SX.sym("state", 2), ca.SX.sym("step", 2), ca.SX.sym("c", 1)
    new = ca.vertcat(ca.sin(state[1]), ca.fmax(state[0], c) + step[0] * step[1])
    advance = ca.Function("a", [state, step, c], [new, step[0], ca.vertcat(new, c), c])
    at = (np.array([1.0, np.nan]), np.arange(9.0), 0.5, np.array([0.3]))
    compiled = StepChain(advance, 9)(*at)
    monkeypatch.setattr(functions, "library", lambda: None)
    for own, other in zip(compiled, StepChain(advance, 9)(*at), strict=True):
        assert same(own, other)


def test_single_calls_are_casadis_bit_by_bit(monkeypatch) -> None:
    function = ca.Function("f", [A, ca.SX.sym("z", 0), B], [ca.horzcat(A, B, A * B), ca.sin(A)])
    compiled = Call(function)(0.3, [], np.array([2]))
    monkeypatch.setattr(functions, "library", lambda: None)
    for own, other in zip(compiled, Call(function)(0.3, [], np.array([2])), strict=True):
        assert own.shape == other.shape
        assert same(own, other)


def test_instructions_are_read_as_they_are_asked_for() -> None:
    for seed in range(12):
        function = random_function(seed, 8 * seed, functions=True)
        assert stored(function) == one_by_one(function)
    assert stored(ca.Function("f", [A], [])) == b""


def test_products_join_sums_and_sines_their_cosines() -> None:
    x, p = ca.SX.sym("x", 4), ca.SX.sym("p", 2)
    value = x[0] * x[1] + x[2] * p[0] - x[3] * x[0]
    size = program(ca.Function("f", [x, p], [value]), [1]).size
    assert (size["line"], size["once"]) == (3, 0)
    turned = ca.vertcat(ca.sin(x[0]) * ca.sqrt(p[0]), ca.cos(x[0]) / p[1])
    size = program(ca.Function("f", [x, p], [turned]), [1]).size
    assert (size["line"], size["once"]) == (3, 1)
    far = ca.Function("f", [x], [ca.vertcat(*[ca.sqrt(x[k % 4] + k) for k in range(60)])])
    assert program(far).size["registers"] <= 1


@pytest.mark.parametrize("seed", range(12))
def test_lines_compute_each_wanted_value_once(seed: int) -> None:
    function, inputs = random_function(seed, 90, functions=True), numbers(seed, 300)
    rows = [(i, row) for i, count in enumerate((6, 3)) for row in range(count)]
    unwanted = set(rows[seed % 3 :: 3])
    line, whole = CompiledLine.of(function, [1], unwanted), program(function, [1]).many(*inputs)
    assert line is not None
    assert set(line.places) == set(rows) - unwanted
    assert len(set(line.results)) == len(line.results) <= len(line.places)
    turned = [inputs[0].T, inputs[1], inputs[2].T]
    into = {own: np.full(300, 7.0) for own in line.results}
    scalars = line.scalars(turned)
    line.block(turned, scalars, into)
    found = line(inputs)
    for (i, row), (kind, what) in line.places.items():
        value = {
            "result": lambda at: into[at],
            "input": lambda at: inputs[at[0]][:, at[1]],
            "shared": lambda at: np.full(300, inputs[at[0]][at[1]]),
            "scalar": lambda at: np.full(300, scalars[at]),
        }[kind](what)
        assert same(value, whole[i][:, row]), (kind, what)
        assert same(found[i][:, row], whole[i][:, row])
    with pytest.raises(TypeError):
        line.block(turned, scalars, {own: np.zeros(299) for own in line.results})
    size = line._program.size["line"]
    assert size < program(function, [1]).size["line"]


def test_functions_without_a_program_are_left_to_casadi() -> None:
    z = ca.MX.sym("z", 2)
    assert program(ca.Function("f", [z], [z * 2])) is None
    assert program(ca.Function("f", [A], [ca.erf(A)])) is None
    sparse = ca.Function("f", [A], [ca.diag(ca.vertcat(A, A))])
    assert program(sparse) is None


def test_damaged_instructions_are_refused() -> None:
    machine, random = library(), np.random.default_rng(8)
    function = random_function(2, 30)
    code, table = bytearray(one_by_one(function)), compiling._table()
    rows = ((5, 4, 2), (6, 3), (0, 1, 0))
    made = machine.Program(bytes(code), function.sz_w(), *rows, table)
    inputs = numbers(1, 20)
    assert same(made.many(*inputs)[0], program(function, [1]).many(*inputs)[0])
    refused = 0
    for _ in range(3000):
        damaged = bytearray(code)
        damaged[random.integers(len(code))] ^= 1 << random.integers(8)
        try:
            machine.Program(bytes(damaged), function.sz_w(), *rows, table).many(*inputs)
        except ValueError:
            refused += 1
    assert 500 < refused < 2990
    with pytest.raises(ValueError, match="no such program"):
        machine.Program(bytes(code[:-3]), function.sz_w(), *rows, table)


def test_what_is_no_array_of_the_right_shape_is_refused() -> None:
    function = random_function(1, 20)
    own = Batch(function, [1])
    x, p, y = numbers(1, 6, special=False)
    with pytest.raises(ValueError, match="rows of shape"):
        own(x.T[:5], p, y)
    with pytest.raises(ValueError, match="poses"):
        own(x, p, y[:4])
    lists = own(x.tolist(), p.tolist(), y.astype(np.float32))
    assert lists[0].shape == (6, 6)
    with pytest.raises(TypeError):
        program(function).many(x, p)


def test_threads_share_a_program() -> None:
    function = random_function(9, 300, functions=True)
    own, inputs = program(function, [1]), numbers(9, 20000)
    single = (inputs[0][0], inputs[1], inputs[2][0])
    expected = [*own.many(*inputs), *own.one(*single)]
    bad: list[int] = []

    def work(k: int) -> None:
        for _ in range(10):
            found = [*own.many(*inputs), *own.one(*single)]
            if not all(same(a, b) for a, b in zip(found, expected, strict=True)):
                bad.append(k)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not bad


@pytest.mark.parametrize(
    ("chosen", "code", "said"),
    [("numpy", 0, "back end: NumPy"), ("c", 0, "back end: C"), ("fortran", 2, "no back end")],
)
def test_the_back_end_is_chosen_and_named(chosen: str, code: int, said: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mechdae", "--version"], capture_output=True, text=True, cwd=ROOT,
        env={"MECHDAE_BACKEND": chosen, "PATH": "", "PYTHONPATH": str(ROOT)}, check=False,
    )  # fmt: skip
    assert done.returncode == code
    assert said in done.stdout + done.stderr
    assert code or f"mechdae {__version__} (" in done.stdout
