"""All solutions of exact goals: published counts, planted four-bars, what is refused.

Counts: 1442 curves through nine points and 64 real ones for problem 3 of Wampler, Morgan & Sommese
1992 (Hauenstein & Sottile 2012); 33 solutions, 15 of them real, for problem 7 of Morgan & Wampler
1990 (manual of PHCpack). Designs are judged by the closed forms of `closure_fourbar`.
"""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import mechdae as md
from mechdae.design.jobs.call import Workers
from mechdae.design.synthesis.exact import coupler_curve as curve
from mechdae.design.synthesis.exact import four_bars as stored
from mechdae.design.synthesis.exact.complete import (
    PathWork,
    all_solutions,
    followed,
    generic,
    traced,
)
from mechdae.design.synthesis.exact.conditions import PathConditions
from mechdae.design.synthesis.exact.four_bars import four_bars_through, guiding_links, with_cognates
from mechdae.design.synthesis.fourbar.exact import exact_path
from mechdae.design.synthesis.fourbar.linkage import joints, poses_of
from mechdae.design.synthesis.job.run import Job, Log, fingerprint
from mechdae.errors import InputError
from mechdae.numerics.homotopy.boxes import apart, enclosed
from mechdae.results.tables import table
from tests.reference import closure_fourbar as closure
from tests.shared.command import run
from tests.shared.paths import ROOT
from tests.shared.synthesis_cases import cases, solved

FIXED = {"pivot_x": 0.0, "pivot_y": 0.0, "other_x": 1.0, "other_y": 0.0}
PIVOTS = tuple(sorted(FIXED))


def planted(generator, count):
    """A four-bar of the closure and places of its coupler point on one branch."""
    while True:
        r = generator.uniform(0.4, 2.0, 4)
        made = closure.FourBar(
            tuple(r.tolist()), complex(*generator.normal(size=2)), *generator.normal(size=3)
        )
        theta = np.sort(generator.uniform(0, 2 * np.pi, count))
        parts = made.moved(theta, (1,))
        points = parts[0]["point"]
        if np.isfinite(points).all() and np.min(made.moved(theta, (1,))[1]) > 0.05:
            return made, np.stack([points.real, points.imag], axis=1)


def closed(design):
    """The design as numbers of the independent closure."""
    return closure.FourBar(
        tuple(design.lengths.tolist()), design.point,
        design.pivot.real, design.pivot.imag, design.turn,
    )  # fmt: skip


def lengths_of(designs):
    return np.array([design.lengths for design in designs])


# -- what is stored --------------------------------------------------------------------------------


def test_what_is_stored_of_nine_points_is_whole() -> None:
    found = stored.paths(9)
    assert len(found.z) == stored.TRIPLES == 1442
    assert found.basis == "trace test"
    every = enclosed(found.family, found.p, found.family.variants(found.z[::20]))
    assert every.certain.all()
    assert len(every.z) == 6 * 73
    assert apart(every)
    figures = json.loads((ROOT / "docs" / "data" / "four-bars.json").read_text(encoding="utf-8"))
    nine, five = figures["cases"]
    assert (nine["solutions"], nine["boxes"], nine["apart"]) == (1442, 8652, True)
    assert nine["bent"] == found.bent < 1e-8
    assert nine["bent_without_one"] > 1e4 * nine["bent"]
    assert five["solutions"] == 36
    page = (ROOT / "docs" / "theory/evidence/assembly-modes.md").read_text(encoding="utf-8")
    for own, words in ((nine, "nine points"), (five, "five points, both fixed pivots")):
        row = (
            words, own["solutions"], f"{own['bent']:.1g}", f"{own['bent_without_one']:.1g}",
            own["boxes"], len(own["trips"]), f"{own['seconds']:.0f} s",
        )  # fmt: skip
        assert f"| {' | '.join(map(str, row))} |" in page


def test_the_trace_of_five_points_is_linear_only_as_a_whole() -> None:
    found = stored.paths(5, PIVOTS)
    assert len(found.z) == 36
    assert traced(found.family, found.p, found.z).bent < 1e-8
    for left in (0, 17, 35):
        part = traced(found.family, found.p, np.delete(found.z, left, axis=0))
        assert part.followed == 35
        assert part.bent > 1e-4


def test_altered_stores_are_refused(tmp_path) -> None:
    with np.load(stored.STORE) as data:
        arrays = dict(data)
    own = PathConditions(5, PIVOTS)
    name = stored.name_of(5, own.given)
    for word, change in (
        ("z", lambda z: np.concatenate([z[:-1], z[:1]])),  # one twice
        ("z", lambda z: z * (1 + 0.3j)),
        ("bent", lambda bent: bent + 1),
    ):
        altered = {**arrays, f"{name}/{word}": change(arrays[f"{name}/{word}"])}
        np.savez(tmp_path / "store.npz", **altered)
        with pytest.raises(InputError, match="do not solve"):
            stored.read(own, tmp_path / "store.npz")
    nine = PathConditions(9)
    np.savez(tmp_path / "store.npz", **{**arrays, "9/z": arrays["9/z"][:-1]})
    with pytest.raises(InputError, match="do not solve"):
        stored.read(nine, tmp_path / "store.npz")


def test_a_search_that_was_broken_off_goes_on_to_the_same_bits() -> None:
    own = PathConditions(5, PIVOTS)
    kept = []
    whole = generic(own, tell=kept.append)
    assert (whole.basis, len(whole.z)) == ("trace test", 36)
    again = generic(own, known=kept[len(kept) // 2])
    assert again.z.tobytes() == whole.z.tobytes()
    assert again.bent == whole.bent


# -- the equation ----------------------------------------------------------------------------------


def test_cognates_have_the_same_curve() -> None:
    generator = np.random.default_rng(4)
    z, d = (generator.normal(size=s) + 1j * generator.normal(size=s) for s in ((5, 8), (2, 6)))
    first = curve.value(z, *d[:, None])
    for other in curve.variants(z):
        own = curve.value(other, *d[:, None])
        np.testing.assert_allclose(own[:, 1:] / own[:, :1], first[:, 1:] / first[:, :1], rtol=1e-8)


def test_residuals_of_twice_the_digits_are_exact() -> None:
    generator = np.random.default_rng(6)
    z, d = (generator.normal(size=s) + 1j * generator.normal(size=s) for s in ((3, 8), (2, 2)))
    found = curve.wide_value(z, *d[:, None])

    class Exact(tuple):
        """A complex number of two fractions."""

        def __add__(self, other):
            return Exact((self[0] + other[0], self[1] + other[1]))

        def __sub__(self, other):
            return Exact((self[0] - other[0], self[1] - other[1]))

        def __mul__(self, other):
            return Exact(
                (self[0] * other[0] - self[1] * other[1], self[0] * other[1] + self[1] * other[0])
            )

    def exact(v):
        return Exact((Fraction(float(v.real)), Fraction(float(v.imag))))

    for n in range(3):
        x, x_, a, a_, y, y_, b, b_ = (exact(v) for v in z[n])
        for k in range(2):
            p, q = exact(d[0, k]), exact(d[1, k])
            A1, B1, C1 = x * (q - a_), x_ * (p - a), p * q - p * a_ - q * a + x * a_ + x_ * a
            A2, B2, C2 = y * (q - b_), y_ * (p - b), p * q - p * b_ - q * b + y * b_ + y_ * b
            D = A1 * B2 - A2 * B1
            G = (B1 * C2 - B2 * C1) * (C1 * A2 - C2 * A1) - D * D
            assert found[n, k] == pytest.approx(complex(*map(float, G)), rel=1e-13)


@pytest.mark.parametrize(
    "given",
    [(), PIVOTS, ("ground", "turn", "crank"), ("along", "across", "rocker", "coupler"),
     ("pivot_x", "across")],
)  # fmt: skip
def test_derivatives_of_conditions(given) -> None:
    own = PathConditions(9 - len(given), given)
    generator = np.random.default_rng(7)
    p, z = own.drawn(generator)
    assert np.abs(own.rows(z[None], p[None], 0 * p[None])[0]).max() < 1e-12
    z = z + 0.1 * generator.normal(size=len(z))
    way = generator.normal(size=len(z))
    _, J, _ = own.residual(p, z[None])
    ends = [own.residual(p, (z + h * way)[None])[0] for h in (1e-5, -1e-5)]
    slope = ((ends[0] - ends[1]) / 2e-5)[0]
    np.testing.assert_allclose(J[0] @ way, slope, rtol=1e-6, atol=1e-7 * np.abs(slope).max())
    rate = generator.normal(size=len(p))
    ends = [own.residual(p + h * rate, z[None])[0] for h in (1e-5, -1e-5)]
    slope = ((ends[0] - ends[1]) / 2e-5)[0]
    scale = np.abs(J[0]).max(axis=1)
    along = own.rows(z[None], p[None], rate[None])[2][0] * scale
    np.testing.assert_allclose(along, slope, rtol=1e-6, atol=1e-7 * np.abs(slope).max() + 1e-9)


# -- five points and both pivots -------------------------------------------------------------------


def test_33_solutions_of_five_points() -> None:
    case = cases()["mw7-fivepoint-fixed-pivots"]
    found = four_bars_through(case["targets"], FIXED)
    assert found.every.facts() == {
        "verdict": "complete", "basis": "trace test", "count": 36, "certified": 33, "boxes": 33,
        "real": 15, "infinite": 3, "singular": 0, "lost": 0,
    }  # fmt: skip
    targets = np.array(case["targets"]) @ [1, 1j]
    known = np.array(
        [
            [complex(*row["x"]) + targets[0], complex(*row["y"]) + targets[0]]
            for row in case["real_solutions_x_y_theta"]
        ]
    )
    pins = np.array([[A[0], B[0]] for A, B, _ in map(joints, found.designs)])
    gaps = np.abs(known[:, None] - pins[None]).max(axis=2)
    assert sorted(gaps.argmin(axis=1)) == list(range(15))
    assert gaps.min(axis=1).max() < 2e-9 * 15  # printed to nine decimals, pins up to 15 away
    for design in found.designs:
        np.testing.assert_allclose(design.points(), targets, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_planted_four_bars_come_back(seed) -> None:
    made, points = planted(np.random.default_rng(seed), 5)
    origin = complex(made.x0, made.y0)
    other = origin + made.lengths[0] * np.exp(1j * made.theta0)
    given = {
        "pivot_x": origin.real, "pivot_y": origin.imag,
        "ground": made.lengths[0], "turn": made.theta0,
    }  # fmt: skip
    found = four_bars_through(points, given)
    assert (found.every.verdict, found.every.count) == ("complete", 36)
    assert len(found.every.z) == 36
    gaps = np.abs(lengths_of(found.designs) - made.lengths).max(axis=1)
    assert gaps.min() < 1e-8
    searched = exact_path(points, {**FIXED, **dict(zip(
        ("pivot_x", "pivot_y", "other_x", "other_y"),
        (origin.real, origin.imag, other.real, other.imag), strict=True,
    ))}, starts=1500, seed=seed)  # fmt: skip
    ours = lengths_of(found.designs)
    for design in searched.designs:
        assert np.abs(ours - design.lengths).max(axis=1).min() < 1e-6
    for design in found.designs:
        own = closed(design)
        for turn, sign, point in zip(design.turns, design.branches, points, strict=True):
            place = own.moved(np.array([turn]), (sign,))[0]["point"][0]
            assert abs(place - complex(*point)) < 1e-6


# -- five poses ------------------------------------------------------------------------------------


def test_four_dyads_are_proven() -> None:
    case = cases()["burmester5-public"]
    found, every = guiding_links(poses_of(case["poses_x_y_theta"]))
    assert (every.verdict, every.basis) == ("proven", "theorem")
    assert (len(every.z), every.count, int(every.real.sum())) == (4, 4, 4)
    known = np.array(case["dyads_G_w_L"])
    for dyad in found:
        own = [dyad.pivot.real, dyad.pivot.imag, dyad.pin.real, dyad.pin.imag, dyad.length]
        assert np.abs(known - own).max(axis=1).min() < 1e-6


def test_parallel_poses() -> None:
    """Without turns the pin moves as the origin does: on a circle about a pivot, or on none."""
    places = np.array([[0, 0], [1, 0], [2, 1], [0, 2], [3, 3]], float)
    _, every = guiding_links(poses_of(np.column_stack([places, np.zeros(5)])))
    assert (every.verdict, len(every.z), every.infinite) == ("complete", 0, 4)
    angles = np.array([0.1, 0.7, 1.5, 2.9, 4.4])
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(5)])
    _, every = guiding_links(poses_of(circle))  # any pin will do: not finitely many
    assert every.verdict == "found"
    assert len(every.z) == 0


# -- nine points -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def nine():
    return four_bars_through(cases()["wms3-ninepoint"]["targets"])


def test_nine_points_have_1442_curves_64_of_them_real(nine) -> None:
    facts = nine.every.facts()
    assert facts["verdict"] == "complete"
    assert (facts["certified"], facts["count"], facts["boxes"]) == (1442, 1442, 8652)
    assert (facts["real"], facts["lost"], facts["singular"]) == (64, 0, 0)
    case = cases()["wms3-ninepoint"]
    targets = np.array(case["targets"])
    every = with_cognates(nine)
    assert len(every) == 6 * 64
    sound = []
    for design in every:
        np.testing.assert_allclose(design.points(), targets @ [1, 1j], atol=1e-6)
        if not design.branch or not design.sense:
            continue
        if not closure.judged(closed(design), design.turns, targets).defects:
            sound.append(design.lengths)
    for key in ("reference", "reference_cognate"):  # the viable one, as driven at either crank
        gaps = np.abs(np.array(sound) - np.array(case[key]["x"][:4])).max(axis=1)
        assert gaps.min() < 1e-4
    assert len(sound) == 2


# -- the job ---------------------------------------------------------------------------------------


def parts(count=3, paths=4):
    """A few short parts of paths of five points."""
    found = stored.paths(5, PIVOTS)
    generator = np.random.default_rng(9)
    target, bend = found.family.numbers(generator), found.family.numbers(generator)
    return [
        PathWork(md.__version__, found.family, found.p, target, bend, found.z[i : i + paths])
        for i in range(0, count * paths, paths)
    ]


def test_parts_of_paths_are_kept_and_are_the_same_anywhere(tmp_path) -> None:
    works = parts()
    here = [followed(work).tobytes() for work in works]
    with Workers(2) as pool:
        spread = Job("", "design", 1, pool, None, None).follow(works)
    assert [ends.tobytes() for ends in spread] == here
    with Log(tmp_path, "text", "design", 1) as log:
        first = Job("", "design", 1, Workers(), log, None).follow(works[:2])
    assert [ends.tobytes() for ends in first] == here[:2]
    lines = (tmp_path / "starts.jsonl").read_bytes().splitlines(keepends=True)
    assert len(lines) == 3
    (tmp_path / "starts.jsonl").write_bytes(b"".join(lines[:2]) + lines[2][:40])  # killed there
    with Log(tmp_path, "text", "design", 1) as log:
        assert list(log.paths) == [fingerprint(works[0])]
        told = []
        job = Job("", "design", 1, Workers(), log, None, lambda *parts: told.append(parts))
        again = job.follow(works)
    # what the log has is told first, then each part; a second route adds its own
    assert told == [(k, len(works)) for k in range(1, len(works) + 1)]
    job.follow(works[:1])
    assert told[-1] == (len(works) + 1, len(works) + 1)
    assert [ends.tobytes() for ends in again] == here
    with Log(tmp_path, "text", "design", 1) as log:
        assert set(log.paths) == {fingerprint(work) for work in works}


def test_lost_paths_are_never_complete() -> None:
    found = stored.paths(5, PIVOTS)
    target = found.family.numbers(np.random.default_rng(2))

    whole = all_solutions(found, target)
    assert (whole.verdict, len(whole.z)) == ("complete", 36)
    short = all_solutions(found, target, lambda works: [0 * followed(w) + np.nan for w in works])
    assert (short.verdict, len(short.z)) == ("found", 0)
    assert short.lost + short.singular + short.infinite == 36


# -- the task --------------------------------------------------------------------------------------


def test_verdicts_are_in_the_summary_and_on_the_terminal(capsys) -> None:
    five = solved("mw7-fivepoint-fixed-pivots").summary
    assert five["verdict"] == "complete"
    assert five["exact"]["certified"] == 33
    assert five["exact"]["within"] == five["solutions"] == 15
    code, out, err = run(capsys, "solve", "burmester5-public")
    assert code == 0, err
    assert "proven: 4 of 4 solutions certified (theorem); 4 real" in " ".join(out.split())


def test_none_exists_where_all_solutions_are_known() -> None:
    problem = md.load("burmester5-public")
    task = problem.tasks["design"]
    free = {**task.free, "la": (0.1, 0.2), "lb": (0.1, 0.2)}  # the dyads are 1.5 long and longer
    result = md.synthesize(problem, replace(task, free=free))
    assert result.data["designs"] == []
    assert result.summary["status"] == "none exists"
    assert result.summary["verdict"] == "proven"
    assert "all 4 solutions are known, no real one is within the bounds" in result.fault


def test_infinitely_many_are_no_verdict() -> None:
    """Points on a circle about the crank's pivot: the crank pin as coupler point, any rocker."""
    angles = np.array([0.2, 1.1, 1.9, 3.0, 4.6])
    points = np.column_stack([0.7 * np.cos(angles), 0.7 * np.sin(angles)])
    found = four_bars_through(points, FIXED)
    assert found.every.verdict == "found"
    assert len(found.every.z) < 36
    for design in found.designs:
        np.testing.assert_allclose(design.points(), points @ [1, 1j], atol=1e-6)


@pytest.mark.parametrize(("poses", "freedoms"), [(4, 2), (3, 4)])
def test_fewer_poses_leave_a_family(poses, freedoms) -> None:
    """Each of the two guiding links has a pin and a pivot, and a length kept at further poses."""
    problem = md.load("burmester5-public")
    task = problem.tasks["design"]
    goal = replace(task.goal, poses=task.goal.poses[:poses])
    result = md.synthesize(problem.with_task("design", replace(task, goal=goal)), starts=2)
    assert result.summary["verdict"] == "found"
    assert result.summary["exact"]["basis"] == "infinite family"
    assert result.summary["exact"]["freedoms"] == freedoms == 2 * (4 - (poses - 1))
    assert f"an infinite family of {freedoms} parameters" in table(result)


def test_a_point_met_twice_is_told_with_its_place(capsys, tmp_path) -> None:
    text = (ROOT / "problems" / "mw7-fivepoint-fixed-pivots.toml").read_text(encoding="utf-8")
    (tmp_path / "twice.toml").write_text(text.replace("[-0.34, 0.22]", "[0.5, 1.06]"))
    code, out, err = run(capsys, "synthesize", str(tmp_path / "twice.toml"))
    assert (code, out) == (2, "")
    assert "tasks.design.goal.targets: two targets are the same point, 1 and 3" in err
    assert "leave one out" in err


def test_bad_points_are_named() -> None:
    points = np.array(cases()["wms3-ninepoint"]["targets"])
    with pytest.raises(InputError, match="two targets are the same point"):
        four_bars_through(np.concatenate([points[:8], points[:1]]))
    with pytest.raises(InputError, match="three to nine"):
        four_bars_through(np.concatenate([points, [[3.0, 3.0]]]))
    with pytest.raises(InputError, match="8 points and 0 given"):
        four_bars_through(points[:8])
