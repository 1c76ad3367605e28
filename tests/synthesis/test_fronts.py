"""Fronts of several objectives: dominance by hand, points against closed forms, jobs, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from benchmarks import fronts as benchmark
from mechdae.cli import main
from mechdae.describe.tasks.goals import Maximise, Minimise
from mechdae.describe.tasks.synthesis import demand
from mechdae.design.synthesis.pareto import FrontSearch, Level, Point
from mechdae.numerics.dominance import best_of, hypervolume, thinned, undominated
from tests.reference.closure_fourbar import FourBar, judged
from tests.shared.job_cases import FOUR_BAR
from tests.shared.paths import ROOT

TARGETS = np.array([[3, 3], [2.759, 3.363], [2.372, 3.663], [1.89, 3.862], [1.355, 3.943]])
AT = np.radians([30, 45, 60, 75, 90])
LEAST = "turn/joints/B/transmission_angle"


# -- dominance -------------------------------------------------------------------------------------


def test_hypervolumes_by_hand() -> None:
    assert hypervolume([[1, 1]], [3, 4]) == 6.0
    assert hypervolume([[1, 2], [2, 1], [2, 2], [5, 0]], [3, 3]) == 3.0
    assert hypervolume([[0, 0, 0]], [1, 2, 3]) == 6.0
    assert hypervolume([[4, 4]], [3, 3]) == 0.0


@pytest.mark.parametrize("m", [2, 3])
def test_hypervolume_is_the_share_of_random_points(m: int) -> None:
    """Inclusion and exclusion over all subsets: exact, and nothing of the slicing."""
    values = np.random.default_rng(m).random((7, m))
    whole = 0.0
    for size in range(1, len(values) + 1):
        for some in combinations(range(len(values)), size):
            whole += (-1) ** (size + 1) * float(np.prod(1 - values[list(some)].max(axis=0)))
    assert hypervolume(values, np.ones(m)) == pytest.approx(whole, rel=1e-12)


def test_undominated_points_and_doubles() -> None:
    values = [[1, 5], [2, 4], [2, 5], [3, 3], [3, 3]]
    assert undominated(values).tolist() == [True, True, False, True, True]
    kept = best_of([{"objectives": own} for own in values], np.ones(2), 1e-3)
    assert [own["objectives"] for own in kept] == [[1, 5], [2, 4], [3, 3]]


def test_points_that_are_left_out_cost_least() -> None:
    values = [[0, 10], [1, 6], [2, 5], [4, 1], [5, 0]]
    # what each inner one alone covers: 1 x 4, 2 x 1, 1 x 4; without (2, 5) 3 x 4 and 1 x 5
    assert thinned(values, 5) == [0, 1, 2, 3, 4]
    assert thinned(values, 4) == [0, 1, 3, 4]
    assert thinned(values, 3) == [0, 1, 4]
    assert thinned([], 3) == []
    every = [[0, *some, 4] for some in combinations(range(1, 4), 2)]
    best = max(every, key=lambda some: hypervolume([values[k] for k in some], [6, 11]))
    assert best == thinned(values, 4)


# -- a front ---------------------------------------------------------------------------------------


def task_of(problem: Any, **changes: Any) -> Any:
    path = problem.tasks["design"].goal
    asked = {"goal": None, "objectives": (path, Maximise(of=LEAST)), "starts": 8, "keep": 9}
    return replace(problem.tasks["design"], **{**asked, **changes})


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("front") / "arc.toml"
    path.write_text(FOUR_BAR.replace("poses = 73", 'poses = 73\nmeasures = ["transmission"]'))
    loaded = md.load(path)
    return loaded.with_task("design", task_of(loaded))


@pytest.fixture(scope="module")
def result(problem: Any) -> Any:
    return md.synthesize(problem)


def values_of(design: dict[str, Any]) -> tuple[float, float, list[str]]:
    """Error and least transmission angle of a design, by the closed form, and its defects."""
    own = design["parameters"]
    lengths = tuple(own[name] for name in ("r1", "r2", "r3", "r4"))
    linkage = FourBar(lengths, complex(own["r_cx"], own["r_cy"]))
    verdict = judged(linkage, AT, TARGETS)
    error = float((np.asarray(verdict.errors) ** 2).sum())
    r1, r2, r3, r4 = lengths
    cosines = [(r3**2 + r4**2 - far**2) / (2 * r3 * r4) for far in (r1 - r2, r1 + r2)]
    return error, float(min(np.arccos(np.abs(cosines)))), list(verdict.defects)


def test_each_point_is_what_the_closed_form_says(result: Any) -> None:
    designs = result.data["designs"]
    assert 6 <= len(designs) <= 9
    for design in designs:
        error, least, defects = values_of(design)
        assert not defects
        assert design["objectives"][0] == pytest.approx(error, rel=1e-6, abs=1e-13)
        assert design["objectives"][1] == pytest.approx(least, rel=1e-9)
        assert design["objective"] == design["objectives"][0]


def test_the_ends_are_those_of_single_goals(result: Any) -> None:
    points = np.array(result.summary["front"]["points"])
    assert points[0, 0] == pytest.approx(7.41575131e-07, rel=1e-5)  # tabled, case C2
    assert (np.diff(points[:, 0]) > 0).all()
    assert (np.diff(points[:, 1]) > 0).all()  # larger angles cost error: none is dominated
    assert points[-1, 1] > np.radians(85)


def test_no_single_search_is_better_than_the_front(problem: Any, result: Any) -> None:
    """The same error with the angle as a limit, by the search of one goal and other starts."""
    points = np.array(result.summary["front"]["points"])
    k = len(points) // 2
    from mechdae.describe.tasks.constraints import FullTurn, TransmissionAngle

    limit = TransmissionAngle(between=("coupler", "rocker"), min=float(points[k, 1]))
    task = task_of(
        problem, goal=problem.tasks["design"].objectives[0], objectives=None, starts=8, seed=11,
        constraints=(FullTurn(margin=1e-6), limit), keep=1,
    )  # fmt: skip
    alone = md.synthesize(problem.with_task("design", task))
    assert points[k, 0] <= alone.data["designs"][0]["objective"] * (1 + 1e-4)


def test_the_report_states_its_reference(problem: Any, result: Any) -> None:
    front = result.summary["front"]
    assert [own["sense"] for own in front["objectives"]] == ["least", "largest"]
    assert [own["unit"] for own in front["objectives"]] == ["m2", "rad"]
    points = np.array(front["points"])
    assert front["reference"] == [points[:, 0].max(), points[:, 1].min()]
    signed = points * [1, -1]
    assert front["hypervolume"] == hypervolume(signed, signed.max(axis=0))
    text = str(result)
    assert "error of coupler.P [m2]" in text
    assert f"front     {len(points)} points, hypervolume" in text
    names = [name for name, _, _ in result.columns()]
    assert names[:2] == ["error of coupler.P", f"least of {LEAST}"]
    axes = md.plot(result)
    assert axes.get_xlabel() == "error of coupler.P [m2]"
    edge = next(own for own in axes.lines if own.get_gid() == "front")
    assert len(edge.get_xdata()) == len(points)
    with pytest.raises(md.InputError, match="no front"):
        md.plot(replace(result, summary=result.summary.only(["status"])), "front")


def answer(result: Any) -> dict[str, Any]:
    found = json.loads(json.dumps(result.to_dict()))
    found["summary"].pop("seconds")
    return found


def test_a_broken_off_front_goes_on_to_the_same_bits(
    problem: Any, result: Any, tmp_path: Path
) -> None:
    assert answer(md.synthesize(problem, out=tmp_path)) == answer(result)
    log = tmp_path / "starts.jsonl"
    whole = log.read_bytes().splitlines(keepends=True)
    assert len(whole) == 1 + result.summary["starts"]
    log.write_bytes(b"".join(whole[:9]) + whole[9][:-7])  # killed while a line was written
    assert answer(md.synthesize(problem, out=tmp_path)) == answer(result)
    assert len(log.read_bytes().splitlines()) == len(whole)


def test_two_workers_give_the_same_bits(problem: Any, result: Any) -> None:
    assert answer(md.synthesize(problem, workers=2)) == answer(result)


# -- beside NSGA-II --------------------------------------------------------------------------------


def test_the_table_of_the_docs_is_what_was_measured() -> None:
    records = json.loads((ROOT / "docs/data/fronts.json").read_text(encoding="utf-8"))["records"]
    text = (ROOT / "docs/theory/evidence/synthesis.md").read_text(encoding="utf-8")
    shown = text.partition("<!-- fronts -->\n")[2].partition("<!-- end of fronts -->")[0]
    assert shown.splitlines() == benchmark.table(records)
    assert [own["problem"] for own in records] == benchmark.ORDER
    for own in records:
        ours = np.array(own["front"])
        volume = hypervolume(ours, own["reference"])
        assert volume == pytest.approx(own["hypervolume"], rel=1e-7)
        assert own["ratio"] == own["hypervolume"] / max(own["nsga2"])
        assert own["deviation"] < 1e-4  # of the closed forms, a grid over corners
        assert own["limits"] < 1e-6


@pytest.mark.parametrize("name", ["slider-crank, sine", "four-bar along an arc"])
def test_designs_of_the_benchmark_are_what_its_closed_forms_say(name: str) -> None:
    """Few points of a front that the benchmark measures, judged by the formulas of NSGA-II."""
    slides = name in benchmark.SLIDERS
    problem = (benchmark.slider_crank if slides else benchmark.four_bar)(name, 4, 4)
    designs = md.synthesize(problem, "front").data["designs"]
    names = list(problem.tasks["front"].free)
    d = np.array([[own["parameters"][n] for n in names] for own in designs])
    if slides:
        error, loss, limits = benchmark.sliders(d, benchmark.SLIDERS[name](benchmark.AT))
    else:
        error, loss, limits = benchmark.four_bars(d, *benchmark.FOUR_BARS[name])
    told = np.array([own["objectives"] for own in designs])
    assert len(told) >= 3
    assert told[:, 0] == pytest.approx(error, rel=1e-9)
    assert told[:, 1] == pytest.approx(loss, rel=1e-4)
    assert limits.max() < 1e-6


def test_gaps_beside_points_that_keep_their_level_to_rounding_only() -> None:
    """A point 1e-12 above the level it was sought at leaves the gap below it open."""
    front = FrontSearch.__new__(FrontSearch)
    front.count = 2
    terms = [[0.0, 4.0], [1.0, 2.0 + 1e-12], [3.0, 0.0]]
    front.points = [Point(0, {}, None, np.array(own)) for own in terms]  # type: ignore[arg-type]
    known = [Level(0, np.array([1e6, 2.0]))]
    gaps = front.gaps(known)
    assert [(gap.width, gap.low, gap.high) for gap in gaps] == [
        (1.0, 2.0 + 1e-12, 4.0), (2.0, 0.0, 2.0 + 1e-12)
    ]  # fmt: skip
    areas = [gap.area for gap in front.gaps([*known, Level(0, np.array([1e6, 1.0]))])]
    assert areas == pytest.approx([2.0, 1.0, 2.0])  # below a level that led nowhere half of it
    levels = [float(level.most[1]) for level in front.between(gaps, 3, several=True)]
    assert levels == pytest.approx([3.0, 4 / 3, 2 / 3])


# -- what makes no front ---------------------------------------------------------------------------


def test_objectives_that_make_no_front(problem: Any) -> None:
    path, least = problem.tasks["design"].objectives
    loss = Minimise(of="turn/joints/B/transmission_angle", reduce="mean")
    for changes, where, words in (
        ({"objectives": (path,)}, "objectives", "one objective has no front"),
        ({"objectives": ()}, "objectives", "no objective is given"),
        ({"objectives": (path, path)}, "objectives[1]", "the same as objectives[0]"),
        ({"objectives": (path, loss, replace_sense(loss))}, "objectives[2]", "the opposite of"),
        ({"objectives": (path, least) * 2}, "objectives", "at most 3"),
        ({"goal": path}, "goal", "met exactly"),
        ({"objectives": (least, replace(path, measure="exact"))}, "objectives[1]", "met or not"),
        ({"reference": (1.0,)}, "reference", "2 numbers are needed"),
    ):
        with pytest.raises(md.InputError, match=words.replace("[", r"\[")) as caught:
            demand(problem, task_of(problem, **{"objectives": (path, least), **changes}))
        assert caught.value.where == where


def replace_sense(goal: Minimise) -> Maximise:
    return Maximise(of=goal.of, reduce=goal.reduce)


def test_ends_that_cannot_be_met(problem: Any, capsys: Any, tmp_path: Path) -> None:
    path = tmp_path / "arc.toml"
    task = problem.tasks["design"]
    free = {**task.free, "r2": (40.0, 50.0), "r1": (1.0, 2.0), "r3": (1.0, 2.0), "r4": (1.0, 2.0)}
    md.dump(problem.with_task("design", replace(task, free=free, starts=2)), path)
    assert main(["synthesize", str(path), "--quiet", "--json"]) == 1
    told = capsys.readouterr()
    assert "no design found" in told.err
    assert json.loads(told.out)["tasks"]["design"]["designs"] == []
