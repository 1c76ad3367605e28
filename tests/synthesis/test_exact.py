"""Exact synthesis: all real four-bars through points and poses, cognates, their judgement.

Reference values: cases of tests/data/synthesis.json, which cite Wampler, Morgan & Sommese 1992,
Morgan & Wampler 1990 and the manual of PHCpack; else closed forms of `closure_fourbar`.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

from mechdae.design.synthesis.exact.four_bars import guiding_links
from mechdae.design.synthesis.fourbar.exact import PathRows, exact_path
from mechdae.design.synthesis.fourbar.linkage import (
    PlanePoses,
    are_cognates,
    cognates,
    foci,
    grouped,
    joints,
    linkage,
    paired,
    poses_of,
    swapped,
    variants,
    visited,
)
from mechdae.errors import InputError
from mechdae.numerics.levenberg import solve_all
from tests.reference import closure_fourbar as closure
from tests.shared.paths import DATA

CASES = {
    case["id"]: case
    for case in json.loads((DATA / "synthesis.json").read_text(encoding="utf-8"))["cases"]
}
FIXED = {"pivot_x": 0.0, "pivot_y": 0.0, "other_x": 1.0, "other_y": 0.0}


def closed(design):
    """The design as numbers of the independent closure."""
    return closure.FourBar(
        tuple(float(r) for r in design.lengths), design.point,
        design.pivot.real, design.pivot.imag, design.turn,
    )  # fmt: skip


def planted(theta, lengths=(4.0, 1.5, 3.5, 3.0), point=1.2 + 0.9j, sign=1, frame=(0.3, -0.2, 0.4)):
    """A linkage of the closure and its poses: A0, B0, A, B, P."""
    made = closure.FourBar(lengths, point, *frame)
    r1, r2, r3, r4 = lengths
    turn, origin = np.exp(1j * frame[2]), complex(*frame[:2])
    A = r2 * np.exp(1j * np.asarray(theta))
    B, _ = closure.rrr(A, r1 + 0j * A, r3, r4, sign)
    P = made.moved(np.asarray(theta), (sign,))[0]["point"]
    return origin, origin + r1 * turn, origin + turn * A, origin + turn * B, P


# -- the search ------------------------------------------------------------------------------------


def conics(x, t):
    """x^2 + 4 y^2 = 4 and 4 x^2 + y^2 = 4: four points, |x| = |y| = sqrt(4/5)."""
    a, b = x[:, 0], x[:, 1]
    F = np.stack([a * a + 4 * b * b - 4, 4 * a * a + b * b - 4], axis=1)[:, :, None]
    J = np.stack([np.stack([2 * a, 8 * b], 1), np.stack([8 * a, 2 * b], 1)], axis=1)[:, :, None]
    return F, J, None


def anywhere(generator, n):
    return 3 * generator.normal(size=(n, 2)), np.zeros((n, 0))


def test_all_solutions_of_two_conics() -> None:
    found = solve_all(conics, anywhere, 40)
    assert len(found) == 4
    np.testing.assert_allclose(np.abs(found.x), np.sqrt(0.8), rtol=1e-15)
    assert len({(x > 0, y > 0) for x, y in found.x.tolist()}) == 4
    assert found.starts == 40
    assert found.hits.sum() == found.converged == 40
    assert found.iterations <= 40 * 20
    assert found.hits.min() > 1


def test_a_curve_of_solutions_has_no_isolated_one() -> None:
    def line(x, t):
        F, J, _ = conics(x, t)
        F[:, 1], J[:, 1] = 2 * F[:, 0], 2 * J[:, 0]
        return F, J, None

    found = solve_all(line, anywhere, 40)
    assert len(found) == 0
    assert found.converged >= 30


def test_no_real_solution_is_none_found() -> None:
    def apart(x, t):
        F, J, _ = conics(x, t)
        F[:, 1], J[:, 1] = F[:, 0] + 1, J[:, 0]
        return F, J, None

    found = solve_all(apart, anywhere, 40, iterations=60)
    assert len(found) == 0
    assert found.converged == 0


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"pivot_x": 0.1, "other_x": 2.0, "coupler": 3.0},
        {"ground": 1.3, "turn": 0.2, "crank": 0.7},
        {"turn": 0.3, "along": 0.2, "rocker": 2.0, "across": 0.1},
    ],
)
def test_derivatives_of_path_rows(given) -> None:
    generator = np.random.default_rng(1)
    k = 9 - len(given)
    rows = PathRows(generator.normal(size=k) + 1j * generator.normal(size=k), given)
    x, t = rows.draw(generator, 6)
    _, J, own = rows(x, t)
    assert J.shape == (6, k, 2, 9 - len(given))
    for q in range(x.shape[1]):
        h = 1e-6 * np.eye(x.shape[1])[q]
        slope = (rows(x + h, t)[0] - rows(x - h, t)[0]) / 2e-6
        np.testing.assert_allclose(J[:, :, :, q], slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())
    slope = (rows(x, t + 1e-6)[0] - rows(x, t - 1e-6)[0]) / 2e-6
    np.testing.assert_allclose(own, slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


# -- points ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def five():
    return exact_path(CASES["MW7_fivepoint_fixed_pivots"]["targets"], FIXED, starts=4000)


@pytest.fixture(scope="module")
def nine():
    return exact_path(CASES["WMS3_ninepoint"]["targets"], starts=4000)


def test_five_points_and_both_pivots_have_fifteen_real_four_bars(five) -> None:
    case = CASES["MW7_fivepoint_fixed_pivots"]
    first = complex(*case["targets"][0])
    wanted = [
        [complex(*s["x"]) + first, complex(*s["y"]) + first]
        for s in case["real_solutions_x_y_theta"]
    ]
    found = [[A[0], B[0]] for A, B, _ in map(joints, five.designs)]
    apart = np.abs(np.array(wanted)[:, None] - np.array(found)[None]).max(axis=2)
    assert len(found) == len(wanted) == 15
    assert sorted(apart.argmin(axis=1)) == list(range(15))
    assert apart.min(axis=1).max() < 2e-9 * 15  # printed to nine decimals, pins up to 15 away
    for design in five.designs:
        assert design.pivot == pytest.approx(0, abs=1e-12)
        assert design.other_pivot == pytest.approx(1, abs=1e-12)
        assert design.residual < 1e-24
    assert (five.search.hits == 1).sum() < 0.01 * five.search.hits.sum()
    assert five.search.iterations < 110 * five.search.starts


def test_nine_points(nine) -> None:
    case = CASES["WMS3_ninepoint"]
    targets = np.array(case["targets"]) @ [1, 1j]
    assert 48 <= len(nine.designs) <= 64
    assert grouped(nine.designs) == [[i] for i in range(len(nine.designs))]
    assert nine.search.iterations < 120 * nine.search.starts
    for design in nine.designs:
        made = closed(design)
        miss = [
            abs(made.moved(np.array([turn]), (sign,))[0]["point"][0] - target)
            for turn, sign, target in zip(design.turns, design.branches, targets, strict=True)
        ]
        assert sum(m * m for m in miss) < 1e-16


def test_the_one_viable_nine_point_four_bar(nine) -> None:
    case = CASES["WMS3_ninepoint"]
    every = [one for design in nine.designs for one in variants(design)]
    verdicts = [closure.judged(closed(one), one.turns, case["targets"]) for one in every]
    sound = [one for one, verdict in zip(every, verdicts, strict=True) if verdict.defects == ()]
    assert len(sound) == 2  # cognates that are driven by a crank
    assert are_cognates(*sound)
    for design in sound:
        verdict = closure.judged(closed(design), design.turns, case["targets"])
        assert verdict.f < 1e-24
        assert verdict.grashof == "crank-rocker"
        assert np.degrees(verdict.transmission) == pytest.approx(12.0569845, abs=1e-7)
    for wanted, tolerance in (
        (case["reference"]["x"], 1e-8),
        (case["reference_cognate"]["x"], 1e-5),
    ):
        x = [
            [*d.lengths, d.point.real, d.point.imag, d.pivot.real, d.pivot.imag, d.turn]
            for d in sound
        ]
        assert min(np.abs(np.array(one) - wanted).max() for one in x) < tolerance


@pytest.mark.parametrize(
    "given",
    [
        ("ground", "turn", "crank"),
        ("pivot_x", "pivot_y", "coupler"),
        ("other_x", "rocker", "along"),
        ("along", "across", "turn"),
    ],
)
def test_a_planted_four_bar_with_given_dimensions_is_found(given) -> None:
    lengths, point, frame = (4.0, 1.5, 3.5, 3.0), 1.2 + 0.9j, (0.3, -0.2, 0.4)
    theta = np.array([0.2, 0.9, 1.9, 3.0, 4.1, 5.2])
    A0, B0, _, _, P = planted(theta)
    values = {
        "pivot_x": A0.real, "pivot_y": A0.imag, "other_x": B0.real, "other_y": B0.imag,
        "ground": 4.0, "turn": 0.4, "crank": 1.5, "coupler": 3.5, "rocker": 3.0,
        "along": 1.2, "across": 0.9,
    }  # fmt: skip
    found = exact_path(
        np.stack([P.real, P.imag], 1), {name: values[name] for name in given}, starts=1500
    )
    gaps = [
        max(
            np.abs(d.lengths - lengths).max(), abs(d.point - point),
            abs(d.pivot - complex(*frame[:2])),
            np.abs(np.exp(1j * d.turns) - np.exp(1j * theta)).max(),
        )
        for d in found.designs
    ]  # fmt: skip
    assert min(gaps) < 1e-9
    plant = found.designs[int(np.argmin(gaps))]
    assert plant.branch == plant.sense == 1
    for d in found.designs:
        _, _, points = joints(d)
        own = {
            "pivot_x": d.pivot.real, "pivot_y": d.pivot.imag, "other_x": d.other_pivot.real,
            "other_y": d.other_pivot.imag, "ground": d.lengths[0], "turn": d.turn,
            "crank": d.lengths[1], "coupler": d.lengths[2], "rocker": d.lengths[3],
            "along": d.point.real, "across": d.point.imag,
        }  # fmt: skip
        size = max(d.lengths)
        for name in given:
            assert own[name] == pytest.approx(values[name], abs=1e-11 * size)
        np.testing.assert_allclose(points, P, atol=1e-11 * size)


def test_the_same_in_micrometres_far_away() -> None:
    targets = np.array(CASES["MW7_fivepoint_fixed_pivots"]["targets"])
    small = {name: 1e-6 * (value + 3 * name.endswith("x")) for name, value in FIXED.items()}
    one = exact_path(targets, FIXED, starts=400)
    two = exact_path(1e-6 * (targets + np.array([3, 0])), small, starts=400)
    assert len(one.designs) == len(two.designs) > 5
    for a, b in zip(one.designs, two.designs, strict=True):
        np.testing.assert_allclose(b.lengths, 1e-6 * a.lengths, rtol=1e-8)


def test_the_same_seed_gives_the_same_answer() -> None:
    targets = CASES["MW7_fivepoint_fixed_pivots"]["targets"]
    one, two = (exact_path(targets, FIXED, starts=300, seed=4) for _ in range(2))
    np.testing.assert_array_equal(one.search.x, two.search.x)
    np.testing.assert_array_equal(one.search.hits, two.search.hits)
    other = exact_path(targets, FIXED, starts=300, seed=5)
    assert not np.array_equal(one.search.hits, other.search.hits)


def test_a_search_ends_when_enough_is_known() -> None:
    targets = CASES["MW7_fivepoint_fixed_pivots"]["targets"]
    found = exact_path(targets, FIXED, starts=100_000, enough=5)
    assert len(found.designs) >= 5
    assert found.search.starts == 2000


@pytest.mark.parametrize(
    ("targets", "given", "what"),
    [
        ([[0, 0], [1, 0], [np.nan, 1]], {}, "finite points"),
        ([[0, 0], [1, 0]], {}, "three to nine"),
        (np.arange(20).reshape(10, 2), {}, "three to nine"),
        (np.arange(16).reshape(8, 2) ** 2, {}, "16 equations for 17 unknowns"),
        ([*np.arange(8).reshape(4, 2) ** 2, [0, 1]], FIXED, "same point"),
        (np.arange(16).reshape(8, 2) ** 2, {"crnak": 1.0}, "unknown dimension 'crnak'"),
        (np.arange(16).reshape(8, 2) ** 2, {"crank": -1.0}, "no length"),
        (np.arange(16).reshape(8, 2) ** 2, {"crank": np.inf}, "crank = inf"),
        (np.arange(14).reshape(7, 2) ** 2, {"turn": 0.0, "other_x": 1.0}, "given twice"),
    ],
)
def test_bad_points(targets, given, what) -> None:
    with pytest.raises(InputError, match=what):
        exact_path(targets, given)


# -- cognates --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "lengths", [(4.0, 1.5, 3.5, 3.0), (1.5, 3.0, 3.5, 4.0), (4.0, 3.0, 1.5, 3.5)]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_cognates_trace_the_same_curve(lengths, sign) -> None:
    theta = np.linspace(0.2, 6.2, 400)
    theta = theta[
        closure.rrr(lengths[1] * np.exp(1j * theta), lengths[0], *lengths[2:], 1)[1] > 1e-3
    ]
    A0, B0, A, B, P = planted(theta, lengths, sign=sign)
    design = linkage(A0, B0, A, B, P)
    six = variants(design)
    assert len(six) == 6
    for one in six:
        # the closure moves the cognate by its own crank alone
        values, heights = closed(one).moved(one.turns, (one.branches,))
        np.testing.assert_allclose(values["point"], P, atol=1e-9)
        assert min(heights[0]) > 0
        np.testing.assert_allclose(sorted(foci(one), key=abs), sorted(foci(design), key=abs))
        assert are_cognates(design, one)
    pivots = {(round(abs(d.pivot), 6), round(abs(d.other_pivot), 6)) for d in six}
    assert len(pivots) == 6


def test_what_is_no_cognate() -> None:
    theta = np.linspace(0, 6, 7)
    A0, B0, A, B, P = planted(theta)
    design = linkage(A0, B0, A, B, P)
    # the same pivots and coupler triangle up to size, crank and coupler exchanged
    trap = linkage(*planted(theta[:3] / 8 + 0.5, (4.0, 3.5, 1.5, 3.0), (1.2 + 0.9j) * 1.5 / 3.5))
    assert np.allclose(foci(trap), foci(design))
    assert not are_cognates(design, trap)
    for change in (
        planted(theta, (4.0, 1.5 * (1 + 1e-5), 3.5, 3.0)),
        planted(theta, point=1.2 - 0.9j),
        planted(theta, frame=(0.3, -0.2, 0.40001)),
        planted(theta, frame=(0.3001, -0.2, 0.4)),
    ):
        assert not are_cognates(design, linkage(*change))
    assert are_cognates(design, linkage(*planted(theta + 0.1)))
    groups = grouped([design, trap, *cognates(design)[1:], swapped(trap)])
    assert groups == [[0, 2, 3], [1, 4]]


def test_order_of_angles() -> None:
    for turns, sense in (
        ([0, 2, 4, 6], 1),
        ([6, 4, 2, 0], -1),
        ([3, 5, 1, 2], 1),
        ([0, 2, 1, 3], 0),
    ):
        wrapped = closure.wrapped(np.array(turns, float))
        along, told = visited(wrapped)
        assert told == sense == closure.order_of(wrapped)
        np.testing.assert_allclose(np.exp(1j * along), np.exp(1j * wrapped))
        assert sense == 0 or (sense * np.diff(along) > 0).all()


# -- poses -----------------------------------------------------------------------------------------


def eliminated(poses):
    """Pins of all RR dyads of five poses by elimination, sharing nothing with a search.

    The rows (2 (q_j - q_1), |q_j|^2 - |q_1|^2) with q_j = p_j + R_j w must have rank two. Two
    3 x 3 minors are cubics of w; their resultant is found from its values on a circle.
    """
    import mpmath as mp

    p, r = poses.places, poses.rotations
    rows = []
    for j in range(1, 5):
        d, e = p[j] - p[0], r[j] - r[0]
        a, b = np.conj(p[j]) * r[j], np.conj(p[0]) * r[0]
        # columns as (constant, x, y) of w = x + i y
        rows.append(
            [
                (2 * d.real, 2 * e.real, -2 * e.imag),
                (2 * d.imag, 2 * e.imag, 2 * e.real),
                (abs(p[j]) ** 2 - abs(p[0]) ** 2, 2 * (a - b).real, -2 * (a - b).imag),
            ]
        )
    mp.mp.dps = 40

    def minor(which, at):
        """Coefficients in y (0..3) of a minor at x = at."""
        values = []
        for k in range(4):
            M = mp.matrix(3, 3)
            for i, row in enumerate(which):
                for j in range(3):
                    c = rows[row][j]
                    M[i, j] = mp.mpf(c[0]) + mp.mpf(c[1]) * at + mp.mpf(c[2]) * k
            values.append(mp.det(M))
        V = mp.matrix(4, 4)
        for i in range(4):
            for j in range(4):
                V[i, j] = mp.mpf(i) ** j
        return list(mp.lu_solve(V, mp.matrix(values)))

    def resultant(at):
        f, g = minor((0, 1, 2), at), minor((0, 1, 3), at)
        S = mp.matrix(6, 6)
        for i in range(3):
            for j in range(4):
                S[i, i + j], S[3 + i, i + j] = f[3 - j], g[3 - j]
        return mp.det(S)

    n = 10
    scale = mp.mpf(4)
    values = [resultant(scale * mp.expjpi(mp.mpf(2 * k) / n)) for k in range(n)]
    c = [
        mp.fsum(values[k] * mp.expjpi(-mp.mpf(2 * k * i) / n) for k in range(n)) / n / scale**i
        for i in range(n)
    ]
    while abs(c[-1]) * scale ** (len(c) - 1) < mp.mpf(10) ** -25 * max(map(abs, values)):
        c.pop()
    found = []
    for at in mp.polyroots([v.real for v in c], asc=True, maxsteps=500, extraprec=400):
        if abs(mp.im(at)) > 1e-15:
            continue
        at = mp.re(at)
        for y in mp.polyroots(minor((0, 1, 2), at), asc=True, maxsteps=500, extraprec=400):
            if abs(mp.im(y)) > 1e-12 * (1 + abs(y)):
                continue
            w = complex(float(at), float(mp.re(y)))
            M = np.array([[c[0] + c[1] * w.real + c[2] * w.imag for c in row] for row in rows])
            if np.linalg.matrix_rank(M / np.linalg.norm(M, axis=0), tol=1e-9) == 2:
                found.append(w)
    return found


def test_elimination_and_paths_find_the_same_dyads() -> None:
    generator = np.random.default_rng(5)
    counts = []
    for _ in range(4):
        poses = PlanePoses(
            generator.normal(size=5) + 1j * generator.normal(size=5),
            generator.uniform(-2, 2, 5),
        )
        wanted = eliminated(poses)
        found, every = guiding_links(poses)
        assert every.verdict == "proven"
        assert len(found) == len(wanted)
        for dyad in found:
            assert min(abs(dyad.pin - w) / (1 + abs(w)) for w in wanted) < 1e-9
        counts.append(len(found))
    assert set(counts) <= {0, 2, 4}
    assert max(counts) == 4


def test_burmester_public_case() -> None:
    case = CASES["BURMESTER5_public"]
    poses = poses_of(case["poses_x_y_theta"])
    found, _ = guiding_links(poses)
    wanted = sorted(case["dyads_G_w_L"], key=lambda row: row[4])
    assert len(found) == len(wanted) == 4
    for dyad, row in zip(found, wanted, strict=True):
        numbers = [dyad.pivot.real, dyad.pivot.imag, dyad.pin.real, dyad.pin.imag, dyad.length]
        np.testing.assert_allclose(numbers, row, rtol=1e-5)
        np.testing.assert_allclose(np.abs(poses.at(dyad.pin) - dyad.pivot), dyad.length, rtol=1e-14)
    made = paired(poses, found)
    assert len(made) == 12
    for one in made:
        lines = np.exp(1j * (one.couplers + one.turn - one.frame))
        np.testing.assert_allclose(lines, poses.rotations, atol=1e-12)
        np.testing.assert_allclose(one.points(), poses.places, atol=1e-12)
    plant = [one for one in made if np.allclose(one.lengths, (4, 1.5, 3.5, 3), rtol=1e-6)]
    assert [one.branch for one in plant] == [1]
    assert plant[0].frame == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("rows", "what"),
    [
        ([[0, 0, 0], [1, 0, np.nan]], "finite rows"),
        ([[0, 0, 0], [1, 0, 1], [0, 0, 0]], "poses 1 and 3 are the same"),
    ],
)
def test_bad_poses(rows, what) -> None:
    with pytest.raises(InputError, match=what):
        poses_of(rows)


# -- the closure itself ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", [n for n, c in CASES.items() if "branch" in c.get("reference", {})]
)
def test_closure_gives_the_published_objectives(name) -> None:
    case = CASES[name]
    reference = case["reference"]
    made = closure.FourBar.of(reference["x"])
    theta = np.array(reference["theta2"])
    targets = case["targets"]
    if case.get("closed") and len(theta) == len(targets) - 1:
        targets = targets[:-1]
    verdict = closure.judged(made, theta, targets)
    assert verdict.signs == (reference["branch"],)
    if "f" in reference:
        assert verdict.f == pytest.approx(reference["f"], rel=1e-6, abs=1e-15)
    told = reference.get("defects", {})
    if "mu_min_deg" in told:
        assert np.degrees(verdict.transmission) == pytest.approx(told["mu_min_deg"], abs=1e-3)
        assert verdict.turns == told["crank_full_rotation"]


@pytest.mark.parametrize("name", [n for n in CASES if n.startswith("FG")])
def test_closure_gives_the_errors_of_function_generators(name) -> None:
    case = CASES[name]
    reference, (low, high) = case["reference"], case["x_range"]
    f = {
        "log10(x)": np.log10,
        "sin(x deg)": lambda x: np.sin(np.radians(x)),
        "x^2": np.square,
        "exp(x)": np.exp,
    }
    x = np.linspace(low, high, 721)
    y = f[case["function"]](x)
    shares = (x - low) / (high - low), (y - y[0]) / (y[-1] - y[0])
    ranges = np.radians([case["delta_phi_deg"], case["delta_psi_deg"]])
    if name.startswith("FG4"):
        a, b, c, begin, end = reference["a_b_c_phi0_psi0"]
        made = closure.FourBar((1.0, a, b, c))
    else:
        z = reference["z"]
        begin, end = z[3], z[4]
        made = closure.WattTwo.of(z) if "watt" in name else closure.StephensonThree.of(z)
    error, verdict = closure.function_error(made, begin, end, reference["sense"], *shares, ranges)
    assert np.degrees(error) == pytest.approx(reference["max_err_deg"], rel=2e-4, abs=2e-9)
    assert verdict.defects == ()


def test_closure_of_slider_and_gears() -> None:
    # in line: crank 1, coupler 3; dead points at 4 and 2; sin(mu) least where the crank is across
    slider = closure.SliderCrank(1.0, 3.0)
    verdict = closure.judged(slider, [0.0, np.pi], [4.0, 2.0], output="output")
    assert verdict.f == pytest.approx(0, abs=1e-28)
    assert verdict.defects == ()
    assert verdict.transmission == pytest.approx(np.arccos(1 / 3), abs=1e-9)
    short = closure.SliderCrank(1.0, 0.9)
    told = closure.judged(short, [0.0, np.pi], [1.9, -0.1], output="output")
    assert "full turn" in told.defects
    # ratio 1, phase 0 and arms alike: the ground moved in a circle, h constant
    geared = closure.GearedFiveBar((2.0, 0.5, 1.5, 1.5, 0.5), 1.0, 0.0)
    level = closure.judged(geared, [0.0], [geared.moved(np.zeros(1), (1,))[0]["point"][0]])
    assert level.height == pytest.approx(4 * (1 - 4 / 9) * 4 / 9)
