"""Poses of driven groups that exist are not refused; what steps around power series prove."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.kernels.bounds.series import (
    BoundedPolynomial,
    NoSeries,
    SeriesFunction,
    coefficients,
    inverse,
    times,
)
from mechdae.motion.cases.hard_steps import obstacles
from mechdae.motion.continuation.path import Path as Way
from mechdae.motion.continuation.series_steps import Expansion
from tests.attack.refusals import add, examine
from tests.reference.truth.driven import Driven, draw
from tests.shared.paths import DATA

REFUSED = DATA / "refusals"
ONCE_REFUSED = (4, 24)
"""Seeds with poses that were refused when only steps around tangents were proved."""

FARTHEST = 3.25
"""How far the follower goes beside steps of at most 3."""
LIMIT = -1.3440482054848
"""Where the follower's path ends, from the determinant's square over four decades before it."""


# -- series --------------------------------------------------------------------------------------


def enclosed(expression, x, series, rng):
    """Return the largest share of the error bound that is used along the series."""
    function = ca.Function("f", [x], [expression])
    (value,) = SeriesFunction(function)([series])[0]
    worst = 0.0
    for t in np.append(rng.random(40), [0.0, 1.0]):
        shifts = [s.e * rng.uniform(-1, 1) for s in series]
        at = np.array([np.polynomial.polynomial.polyval(t, s.c) for s in series]) + shifts
        exact = float(function(at))
        off = abs(exact - np.polynomial.polynomial.polyval(t, value.c))
        worst = max(worst, off / (value.e + 1e-12))
    return worst, value.e


def drawn_series(rng, count=9):
    x = ca.SX.sym("x", 3)
    series = []
    for _ in range(3):
        c = rng.normal(size=count) * rng.uniform(0.1, 0.6) ** np.arange(count)
        series.append(BoundedPolynomial(c, float(rng.choice([0.0, 1e-6]))))
    sine, cosine = ca.sin(x[0] + 2 * x[1]), ca.cos(x[1] - x[2] / 3)
    return x, series, sine * x[2] ** 2 - cosine * (1.5 + x[0]) + 3 * sine * cosine - x[1]


def test_the_bound_holds_what_a_series_leaves_out():
    rng = np.random.default_rng(1)
    shares = []
    for _ in range(60):
        x, series, expression = drawn_series(rng)
        share, error = enclosed(expression, x, series, rng)
        assert error > 0
        shares.append(share)
    assert max(shares) <= 1
    assert max(shares) > 0.05  # the bound is not idle


def test_a_forgotten_tail_is_seen(monkeypatch):
    """Planted: products keep the errors of their factors and forget the coefficients cut off."""

    def product(a, b):
        count = len(a.c)
        left = a.size * b.e + b.size * a.e + a.e * b.e
        return BoundedPolynomial(np.convolve(a.c, b.c)[:count], left)

    from mechdae.kernels.bounds import series as module

    whole = module.product

    def planted(a, b):
        both = isinstance(a, BoundedPolynomial) and isinstance(b, BoundedPolynomial)
        return product(a, b) if both else whole(a, b)

    rng = np.random.default_rng(1)
    x, series, _ = drawn_series(rng)
    for one in series:
        one.e = 0.0
    assert enclosed(x[0] * x[1] * x[2], x, series, rng)[0] <= 1
    monkeypatch.setitem(module.OPERATIONS, ca.OP_MUL, planted)
    assert enclosed(x[0] * x[1] * x[2], x, series, rng)[0] > 1


def test_inverse_of_a_series():
    rng = np.random.default_rng(2)
    J = rng.normal(size=(10, 4, 4)) * 0.3 ** np.arange(10)[:, None, None]
    product = times(inverse(J, 10), J, 10)
    product[0] -= np.eye(4)
    assert np.abs(product).max() < 1e-12 * np.abs(inverse(J, 10)).max()


def test_what_has_no_series():
    x = ca.SX.sym("x")
    for expression in (ca.sqrt(x), 1 / x, ca.fabs(x)):
        with pytest.raises(NoSeries):
            SeriesFunction(ca.Function("f", [x], [expression]))(
                [[BoundedPolynomial(np.array([2.0, 1.0]))]]
            )


def test_of_numbers_any_function_may_be_taken():
    x, p = ca.SX.sym("x"), ca.SX.sym("p", 2)
    function = ca.Function("f", [x, p], [ca.sqrt(ca.sumsqr(p)) * x + ca.fabs(p[0]) / p[1]])
    known, inputs = SeriesFunction(function, (1,)), [[BoundedPolynomial(np.array([2.0, 1.0]))]]
    numbers = known.numbers([*inputs, [-3.0, 4.0]])
    for own in (None, numbers):
        ((value,),) = known([*inputs, [-3.0, 4.0]], own)
        assert value.c.tolist() == [10.75, 5.0]
    with pytest.raises(NoSeries):
        SeriesFunction(function)


def test_floats_and_series_side_by_side():
    c, e = coefficients([2.0, BoundedPolynomial(np.array([1.0, 3.0]), 0.5)], 2)
    assert c.tolist() == [[2.0, 1.0], [0.0, 3.0]]
    assert e.tolist() == [0.0, 0.5]


# -- steps ---------------------------------------------------------------------------------------


def way_of(case: Driven):
    """Return the package's path of a case, begun at the sketch."""
    from mechdae.motion.kinematics.prepared import covered, first_pose, prepare

    problem = from_dict(case.data())
    task = problem.tasks["t"]
    setting = prepare(problem, task)
    u, x = first_pose(setting, task)

    def follow(numbers):
        graphs = setting.graphs
        path = Way(graphs, numbers, np.zeros(1), np.ones(1), 0.05)
        path.begin(x, float(u[0]))
        return path, None

    return covered(follow, setting, np.array(case.span)[:, None], np.ones(1), (x, u))[0]


@pytest.mark.parametrize("seed", range(12))
def test_a_stretch_does_not_pass_a_limit(seed):
    """However long a step is asked for, what is proved ends before the follower's path does."""
    case = draw(seed)
    path = way_of(case)
    s, state = path.s[0], path.state[0]
    u, d = np.array([s]), np.ones(1)
    blocks = list(range(path.graphs.nb))
    lengths = []
    for way in (-1.0, 1.0):
        ahead = case.follow(case.start, case.s0, case.s0 + way * FARTHEST)
        reach = abs(ahead[-1][0] - case.s0)
        for step in (0.01, 0.3, 3.0):
            found = path.finders.expansion.stretch(state, s, u, d, way * step, 0.0, blocks)
            if found is None:
                continue
            assert abs(found.step) <= min(step, reach) or reach == FARTHEST
            lengths.append(abs(found.step))
            names = path.graphs.scene.x_names
            for share in (0.0, 0.37, 1.0):
                place = s + share * found.step
                x = case.at(ahead, place)
                value = found.at(share)
                for i, (body, name) in enumerate(names):
                    if name != "angle" or not body.startswith("b"):
                        continue
                    truth = x[3 * int(body[1:]) - 1]
                    gap = value[i] - truth
                    gap -= 2 * np.pi * np.round(gap / (2 * np.pi))
                    assert abs(gap) <= found.radius[i] + 1e-9
    assert max(lengths) > 1e-4


def test_a_step_that_is_too_long_is_not_proved(monkeypatch):
    """Planted: what the inverse leaves of the Jacobian does not count; steps pass limits."""
    import mechdae.motion.continuation.series_steps as module

    case = draw(0)
    path = way_of(case)
    state, s = path.state[0], path.s[0]
    blocks = list(range(path.graphs.nb))

    def longest():
        found = path.finders.expansion.stretch(
            state, s, np.array([s]), np.ones(1), 3.0, 0.0, blocks
        )
        return found.step

    honest = longest()
    monkeypatch.setattr(module, "LAST", 1e300)
    assert longest() < 3.0  # the proof shortens what the coefficients allow
    monkeypatch.setattr(Expansion, "_radius", lambda self, c, *rest: np.zeros(c.shape[1]))
    assert longest() == 3.0 > honest


# -- poses that exist ----------------------------------------------------------------------------


def figures(seeds):
    return add([examine(seed) for seed in seeds])["all"]


def test_no_pose_that_exists_is_refused():
    found = figures([*range(12), *ONCE_REFUSED])
    assert found["wrong"] == 0
    assert found["refused"] == 0
    assert found["reached"] > 200


def test_the_sample_notices_without_series(monkeypatch):
    """Planted: only steps around tangents."""
    monkeypatch.setattr(obstacles, "stretched", lambda front, *rest: 0.0)
    assert figures(ONCE_REFUSED)["refused"] > 0


@pytest.mark.parametrize("name", ["short-ternary", "before-a-limit"])
def test_a_file_whose_poses_were_refused(name):
    """A link with two pins 4e-4 of its size apart; a limit that is proved from afar.

    Its truth is in the follower's path: see `tests/attack/refusals.py`.
    """
    result = md.solve(REFUSED / f"{name}.toml", task="t")
    status = [str(word) for word in result.status]
    if name == "short-ternary":
        assert set(status) == {"ok"}
        turned = result.bodies["b0"].angle - result.bodies["b0"].angle[0]
        driver = result.drivers["j0.angle"].position
        # two links on one pivot and a rigid triad between them: all turn as one
        assert np.abs(turned - (driver - driver[0])).max() < 1e-9
        return
    u = result.drivers["j1.slide"].position
    limit = result.summary["limits"][0]
    assert [word == "ok" for word in status] == (u > limit).tolist()
    assert limit == pytest.approx(LIMIT, abs=1e-10)
