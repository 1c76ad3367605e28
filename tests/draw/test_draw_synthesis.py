"""Pictures of syntheses: numbers as in the result, marks in their places, texts readable."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import mechdae as md
from mechdae.design.synthesis import verify
from mechdae.design.synthesis.synthesize import synthesize
from mechdae.draw import plot, save
from mechdae.draw.catalogue import kinds_of
from mechdae.draw.designs import design, starts, targets
from mechdae.draw.designs.drawn_design import sense_of
from mechdae.draw.style import SERIES
from mechdae.draw.words import Words, table
from mechdae.errors import InputError
from tests.shared.command import run
from tests.shared.readable import assert_readable as graphs_readable

DESIGNS = [kind for kind in kinds_of("designs") if kind != "front"]
STARTS = {
    "c5-ellipse10-free": 8,
    "c2-arc5-timed": 3,
    "fg4-sin-0-90-90-90": 4,
    "straight-180-1-4": 3,
    "rocker-50-1-15": 8,
    "c1-infeasible": 3,
    "burmester5-public": 4,
}
SOLVED: dict[str, md.Result] = {}


def solved(name: str) -> md.Result:
    """Return the designs of a problem from a few starts, solved once."""
    if name not in SOLVED:
        problem = md.load(name)
        SOLVED[name] = synthesize(problem, "design", problem.tasks["design"], starts=STARTS[name])
    return SOLVED[name]


def with_task(result: md.Result, **changes) -> md.Result:
    return replace(result, definition=replace(result.definition, **changes))


def gids(axes) -> dict[str, object]:
    return {a.get_gid(): a for a in axes.findobj() if a.get_gid()}


def axes_of(axes) -> list:
    return axes.get_figure(root=True).axes


def assert_readable(axes) -> None:
    for own in axes_of(axes):
        if not own.axison:  # a diagram
            own.set_xticks([])
            own.set_yticks([])
    graphs_readable(axes)


def words_of(axes) -> str:
    return "\n".join(
        text.get_text() for own in axes_of(axes) for text in own.findobj(match=type(own.title))
    )


# -- designs ---------------------------------------------------------------------------------------


def test_path_and_targets_are_where_they_are() -> None:
    """The ellipse of ten points: x = 10 + 10 cos t, y = 10 + 8 sin t, the tenth is the first."""
    result = solved("c5-ellipse10-free")
    axes = md.plot(result)
    upper, lower = axes_of(axes)
    assert upper is axes
    found = gids(axes)
    rings = [found[f"target-{k}"].center for k in range(1, 10)]
    t = -2 * np.pi / 9 * np.arange(9)
    wanted = np.stack([10 + 10 * np.cos(t), 10 - 8 * np.sin(t)], axis=1)
    assert np.abs(np.array(rings) - wanted).max() < 1e-3
    assert "target-10" not in found
    below = gids(lower)
    assert np.abs(below["targets"].get_xydata() - wanted).max() < 1e-3
    path = np.array(below["path-1"].get_xydata())
    # the path passes every target of the file, given with five digits, as near as the error says
    errors = np.array(result.data["designs"][0]["errors"])
    given = np.array(result.definition.goal.targets, float)[:9, :2]
    assert np.abs(given - wanted).max() < 5e-4
    for place, error in zip(given, errors, strict=True):
        ends = np.stack([path[:-1], path[1:]], axis=1)
        way = ends[:, 1] - ends[:, 0]
        share = np.einsum("ij,ij->i", place - ends[:, 0], way) / np.einsum("ij,ij->i", way, way)
        foot = ends[:, 0] + np.clip(share, 0, 1)[:, None] * way
        gap = np.hypot(*(foot - place).T)
        near = gap < 1.0
        # of chords of the ellipse, whose curvature is 1/6.4 at most
        height = np.hypot(*way[near].T).max() ** 2 / (8 * 6.4)
        assert gap.min() <= error + height
    factor = float(words_of(axes).split("errors × ")[1].split("\n")[0])
    for k, error in enumerate(errors, 1):
        line = below[f"error-{k}"].get_xydata()
        assert np.hypot(*(line[1] - line[0])) == pytest.approx(factor * error, rel=1e-3)
    assert f"design 1 of {len(result.data['designs'])}" in words_of(axes)
    assert_readable(lower)


def test_large_targets_stay_in_the_diagram() -> None:
    result = solved("c2-arc5-timed")
    axes = md.plot(result, "design")
    assert len(axes_of(axes)) == 2
    shown = design.SMALL
    design.SMALL = 0.0
    try:
        axes = md.plot(result, "design")
    finally:
        design.SMALL = shown
    assert len(axes_of(axes)) == 1
    found = gids(axes)
    assert {f"target-number-{k}" for k in range(1, 6)} <= set(found)
    assert "trace-crank.A" in found


def test_poses_of_a_body_have_directions() -> None:
    problem = md.load("c5-ellipse10-free")
    task = problem.tasks["design"]
    rows = [[0, 0, 0.2], [6, 2, 0.5], [11, 1, 0.9], [14, -3, 1.3]]
    goal = {"kind": "motion", "body": "coupler", "poses": rows}
    free = {name: own for name, own in task.free.items() if not name.startswith("r_c")}
    result = synthesize(
        problem, "design", replace(task, goal=goal, free=free, constraints=[]), starts=3
    )
    result = replace(result, definition=replace(task, goal=goal, free=free, constraints=[]))
    shown = design.SMALL
    design.SMALL = 0.0
    try:
        found = gids(md.plot(result, "design"))
    finally:
        design.SMALL = shown
    for k, row in enumerate(rows, 1):
        assert np.allclose(found[f"target-{k}"].center, row[:2], atol=1e-9)
        start, end = found[f"direction-{k}"].get_xydata()
        assert np.arctan2(*(end - start)[::-1]) == pytest.approx(row[2], abs=1e-9)


def test_solutions_with_defects_say_so() -> None:
    """Five poses exactly, in any order: the path reaches all of them; others change the branch."""
    result = solved("burmester5-public")
    sound = [k for k, own in enumerate(result.data["designs"]) if not own["defects"]]
    assert 0 < len(sound) < len(result.data["designs"])
    axes = md.plot(result)
    path = gids(axes)["path-coupler"].get_xydata()
    for k in range(1, 6):
        place = np.array(gids(axes)[f"target-{k}"].center)
        assert np.nanmin(np.hypot(*(path - place).T)) < 5e-3
    assert not any(str(gid).startswith("error-") for gid in gids(axes))
    axes = md.plot(result, "design", design=len(sound))
    assert f"rejected: {result.data['designs'][len(sound)]['defects'][0]}" in words_of(axes)
    found = gids(md.plot(result, "compare"))
    assert sum(str(gid).startswith("path-") for gid in found) == len(sound)
    rows = starts.rows_of(result, Words())
    assert [row.what for row in rows].count("design") == len(sound)
    assert rows[len(sound)].what == "rejected"
    none = replace(result, data={"designs": result.data["designs"][len(sound) :]})
    with pytest.raises(InputError, match="all designs are rejected"):
        md.plot(none, "compare")


def test_function_is_the_wanted_one() -> None:
    """sin x over 0 to 90 deg on spans of 90 deg: an independent curve from the abscissa."""
    result = solved("fg4-sin-0-90-90-90")
    axes = md.plot(result, "design")
    diagram, upper, lower = axes_of(axes)
    assert {"number-crank", "number-coupler"} <= set(gids(diagram))  # the mechanism found
    x, wanted = gids(upper)["wanted"].get_xydata().T
    share = (x - x[0]) / (x[-1] - x[0])
    assert x[-1] - x[0] == pytest.approx(90.0)
    shape = np.sin(share * np.pi / 2)
    # the sense of the output is free
    assert np.abs(np.abs(wanted - wanted[0]) - 90 * shape).max() < 1e-6
    _, output = gids(upper)["output"].get_xydata().T
    _, error = gids(lower)["error"].get_xydata().T
    assert np.abs(output - wanted - error).max() < 1e-9
    worst = np.abs(error).max()
    assert worst == pytest.approx(np.degrees(result.data["designs"][0]["objective"]), rel=1e-3)
    assert f"largest error {worst:.4g} deg" in words_of(axes)
    assert_readable(axes)
    ticks = upper.get_xticks()
    step = ticks[1] - ticks[0]
    assert np.diff(ticks) == pytest.approx(step)
    assert 90 / step == pytest.approx(round(90 / step))  # they divide a quarter of a turn
    assert ticks / step == pytest.approx(np.round(ticks / step))


def test_deviation_from_the_line() -> None:
    result = solved("straight-180-1-4")
    axes = md.plot(result, "design")
    upper, lower = axes_of(axes)
    along, error = gids(lower)["deviation"].get_xydata().T
    assert along[[0, -1]] == pytest.approx([0.0, 1.0], abs=1e-5)
    objective = result.data["designs"][0]["objective"]
    unit = {"µm": 1e-6, "mm": 1e-3}[lower.get_ylabel().split("[")[1][:2]]
    assert np.abs(error).max() * unit == pytest.approx(objective, rel=1e-6)
    piece = gids(upper)["straight"].get_xydata()
    way = (piece[-1] - piece[0]) / np.hypot(*(piece[-1] - piece[0]))
    across = (piece - piece[0]) @ np.array([-way[1], way[0]])
    assert np.ptp(across) < 2.01 * objective
    assert len(gids(upper)["path-coupler.P"].get_xydata()) == 1441
    assert_readable(lower)


def test_extremes_of_a_rocker() -> None:
    """Half way between the extremes, which are ghosts: crank and coupler in one line."""
    result = solved("rocker-50-1-15")
    axes = md.plot(result, "design")
    found = gids(axes)
    assert "50°" in found["swing-text"].get_text()
    arc = found["swing"].get_xydata()
    pivot = np.array([1.0, 0.0])
    turns = np.unwrap(np.arctan2(*(arc - pivot).T[::-1]))
    assert np.degrees(np.ptp(turns)) == pytest.approx(50.0, abs=0.01)
    assert "time ratio 1.15" in words_of(axes)
    assert "transmission ≥ 46.3°" in words_of(axes)


def test_ghosts_of_a_diagram_can_be_named() -> None:
    result = md.solve("four-bar-crank-rocker", "turn")

    def lines(axes) -> int:
        return len(axes.lines)

    none, two = (lines(md.plot(result, "diagram", ghosts=own)) for own in (0, 2))
    assert lines(md.plot(result, "diagram", ghosts=(10, 200))) == two > none
    with pytest.raises(InputError, match="no pose 400"):
        md.plot(result, "diagram", ghosts=[400])


@pytest.mark.parametrize(
    ("gap", "factor"), [(0.0, 0.0), (1e-12, 0.0), (0.01, 500.0), (1.0, 5.0), (20.0, 1.0)]
)
def test_enlargement_is_round(gap: float, factor: float) -> None:
    places = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])
    gaps = np.array([[0.0, 0.0], [0.0, gap], [0.0, 0.0]])
    assert targets.enlargement(gaps, places) == factor


# -- all designs -----------------------------------------------------------------------------------


def test_paths_are_compared() -> None:
    result = solved("c5-ellipse10-free")
    axes = md.plot(result, "compare")
    upper, lower = axes_of(axes)
    for k, own in enumerate(result.data["designs"], 1):
        numbers, errors = gids(lower)[f"errors-{k}"].get_xydata().T
        assert numbers.tolist() == list(range(1, 10))
        assert np.allclose(errors * 1e-3, own["errors"], rtol=1e-12)
        line = gids(upper)[f"path-{k}"]
        assert line.get_color() == SERIES[k - 1]
        assert len(line.get_xydata()) == 1441
    assert upper.get_aspect() == 1.0
    assert_readable(axes)


def test_errors_and_angles_are_compared() -> None:
    result = solved("rocker-50-1-15")
    axes = md.plot(result, "compare")
    for k in range(1, len(result.data["designs"]) + 1):
        x, y = gids(axes)[f"angle-{k}"].get_xydata().T
        assert (x[0], y[0]) == (0.0, 0.0)
        assert np.ptp(y) == pytest.approx(50.0, abs=0.01)
    axes = md.plot(solved("straight-180-1-4"), "compare")
    assert_readable(axes)
    axes = md.plot(solved("fg4-sin-0-90-90-90"), "compare")
    assert gids(axes)["errors-1"].get_xydata()[0, 0] == 0.0
    assert_readable(axes)


def test_a_goal_of_one_number_has_no_curves() -> None:
    result = solved("rocker-50-1-15")
    goal = {"kind": "maximise", "of": "turn/joints/B/transmission_angle"}
    only = with_task(result, goals=None, goal=goal)
    with pytest.raises(InputError, match="one number"):
        md.plot(only, "compare")
    found = gids(md.plot(only, "design"))
    assert "swing" in found


# -- starts and optima -----------------------------------------------------------------------------


def test_starts_and_best_so_far() -> None:
    result = solved("rocker-50-1-15")
    assert sense_of(result) == -1
    runs = result.summary["runs"]
    assert len(runs) == result.summary["starts"] == 8
    axes = md.plot(result, "convergence")
    found = gids(axes)
    values = [run["objective"] for run in runs]
    shown = {
        int(x): y
        for name, own in found.items()
        if name.startswith("starts-")
        for x, y in own.get_xydata()
    }
    assert shown == {k: v for k, v in enumerate(values, 1) if v is not None}
    lost = [k for k, v in enumerate(values, 1) if v is None]
    assert found["failed"].get_xdata().tolist() == lost != []
    best = found["best"].get_ydata()
    held = list(itertools.accumulate((v for v in values if v is not None), max))
    assert best[-1] == held[-1] == pytest.approx(result.data["designs"][0]["objective"], rel=1e-6)
    assert axes.get_yscale() == "linear"
    assert_readable(axes)


def test_decades_have_a_logarithmic_axis() -> None:
    result = solved("c5-ellipse10-free")
    assert sense_of(result) == 1
    axes = md.plot(result, "convergence")
    assert axes.get_yscale() == "log"
    best = np.asarray(gids(axes)["best"].get_ydata(), float)
    assert (np.diff(best[np.isfinite(best)]) <= 0).all()
    assert_readable(axes)


def test_bars_add_up_to_the_starts() -> None:
    for name in ("c5-ellipse10-free", "rocker-50-1-15", "c1-infeasible"):
        result = solved(name)
        rows = starts.rows_of(result, Words())
        assert sum(row.hits for row in rows) == result.summary["starts"]
        axes = md.plot(result, "census")
        bars = [own for gid, own in gids(axes).items() if gid.split("-")[0] in
                ("design", "rejected", "further", "failed")]  # fmt: skip
        assert sorted(bar.get_width() for bar in bars) == sorted(row.hits for row in rows)
        assert_readable(axes)


def test_rejected_optima_are_hatched_with_their_reason() -> None:
    """What three of eight starts found is taken for rejected."""
    result = solved("rocker-50-1-15")
    kept, lost = result.data["designs"]
    summary = {
        **result.summary,
        "rejected": [{"objective": lost["objective"], "reasons": ["it $leaves$ its box", "more"]}],
    }
    changed = replace(result, summary=summary, data={"designs": [kept]})
    rows = starts.rows_of(changed, Words())
    assert [row.what for row in rows] == ["design", "rejected", "failed"]
    assert rows[1].hits == lost["hits"]
    axes = md.plot(changed, "census")
    found = gids(axes)
    assert found["rejected-2"].get_hatch()
    assert not found["design-1"].get_hatch()
    assert "it \\$leaves\\$ its box; …" in found["text-2"].get_text()
    assert_readable(axes)


def test_rejected_optima_of_much_the_same_value_count_once() -> None:
    result = solved("rocker-50-1-15")
    values = [0.8, 0.8, 0.8, 0.79998, 0.5]
    runs = [
        {"class": "any", "status": "Solve_Succeeded", "objective": v, "iterations": 9}
        for v in values
    ]
    rejected = [{"objective": v, "reasons": ["it jams"]} for v in (0.799999, 0.79999)]
    summary = {**result.summary, "runs": runs, "starts": 5, "rejected": rejected}
    rows = starts.rows_of(replace(result, summary=summary, data={"designs": []}), Words())
    assert [(row.what, row.hits) for row in rows] == [
        ("rejected", 3),
        ("rejected", 1),
        ("further", 1),
    ]


def test_many_optima_are_counted_in_one_row() -> None:
    result = solved("rocker-50-1-15")
    runs = [
        {"class": "any", "status": "Solve_Succeeded", "objective": 0.8 / k, "iterations": 9}
        for k in range(1, 31)
    ]
    changed = replace(result, summary={**result.summary, "runs": runs, "starts": 30})
    rows = starts.rows_of(changed, Words())
    assert len(rows) == starts.MOST
    assert rows[-1].text == "17 more optima"


def test_without_designs_the_census_is_drawn() -> None:
    result = solved("c1-infeasible")
    axes = md.plot(result)
    assert "no design found" in words_of(axes)
    assert "ended where no design near meets all limits" in words_of(axes)
    assert "failed" in gids(md.plot(result, "convergence"))
    for kind in ("design", "compare"):
        with pytest.raises(InputError, match="no design exists") as caught:
            md.plot(result, kind)
        assert "census" in caught.value.hint
    empty = replace(result, summary={**result.summary, "runs": []})
    for kind in ("census", "convergence"):
        with pytest.raises(InputError, match="no design"):
            md.plot(empty, kind)


# -- all kinds -------------------------------------------------------------------------------------


def test_what_does_not_suit_is_refused() -> None:
    result = solved("rocker-50-1-15")
    count = len(result.data["designs"])
    for wrong in (count, -count - 1, True, "1"):
        with pytest.raises(InputError, match="no design"):
            md.plot(result, "design", design=wrong)
    with pytest.raises(InputError, match="no poses") as caught:
        md.plot(result, "curves")
    assert "convergence" in caught.value.hint
    sweep = md.solve("slider-crank", "turn")
    for kind in DESIGNS:
        with pytest.raises(InputError, match="kind 'sweep'"):
            md.plot(sweep, kind)


def test_words_have_all_languages() -> None:
    assert set(table("en")) == set(table("ru"))
    axes = md.plot(solved("rocker-50-1-15"), "design", lang="ru")
    assert "вариант 1 из 2" in words_of(axes)
    for kind in ("compare", "convergence", "census"):
        axes = md.plot(solved("c5-ellipse10-free"), kind, lang="ru")
        assert_readable(axes)
        assert not {"design", "start", "target", "error"} & set(words_of(axes).split())


@pytest.mark.parametrize("name", ["c5-ellipse10-free", "straight-180-1-4", "fg4-sin-0-90-90-90"])
def test_given_axes_are_divided_and_returned(name: str) -> None:
    figure = Figure(figsize=(12, 8))
    FigureCanvasAgg(figure)
    for kind in DESIGNS:
        given = figure.add_axes((0.5, 0.2, 0.4, 0.6))
        before = len(figure.axes)
        assert plot(solved(name), kind, given) is given
        for own in figure.axes[before - 1 :]:
            box = own.get_position()
            assert box.x0 == pytest.approx(0.5)
            assert box.x1 <= 0.9 + 1e-12
            assert 0.2 - 1e-12 <= box.y0 < box.y1 <= 0.8 + 1e-12
        for own in list(figure.axes):
            own.remove()


@pytest.mark.parametrize("kind", DESIGNS)
def test_files_are_the_same_each_time(kind: str, tmp_path: Path) -> None:
    result = solved("rocker-50-1-15")
    first = save(md.plot(result, kind), tmp_path / "a.svg").read_bytes()
    assert save(md.plot(result, kind), tmp_path / "b.svg").read_bytes() == first
    assert first.startswith(b"<?xml")


def test_designs_are_moved_once(monkeypatch) -> None:
    """What pictures need of a design is swept when the first one reads it, and not again."""
    result = solved("c5-ellipse10-free")
    fresh = {
        text: verify.DesignMotion(own.problem, own.at, own.full_turn)
        for text, own in result.motions.items()
    }
    count: list[str] = []
    real = verify.solve
    monkeypatch.setattr(verify, "solve", lambda *given: count.append("") or real(*given))
    result = replace(result, motions=fresh)
    plot(result, "census")
    plot(result, "convergence")
    assert count == []
    plot(result, "design")
    assert len(count) == 3  # the whole, smooth, at the targets
    plot(result, "compare")
    before = len(count)
    assert before == 3 + len(fresh) - 1
    for kind in DESIGNS:
        plot(result, kind)
    assert len(count) == before


# -- the command -----------------------------------------------------------------------------------


@pytest.fixture
def quick(monkeypatch):
    """Syntheses are those of this file; all else is solved."""
    from mechdae.tasks import pictures as module

    real = module.solve

    def solve(problem, task=None, **options):
        if task is not None and problem.tasks[task].kind == "synthesis":
            return solved(problem.name)
        return real(problem, task, **options)

    monkeypatch.setattr(module, "solve", solve)


def test_the_command_draws_designs(quick, capsys, tmp_path: Path) -> None:
    words = ["plot", "rocker-50-1-15", "--task", "design", "--out", str(tmp_path)]
    for more, stem in (
        ([], "design"),
        (["--design", "2"], "design-2"),
        (["--kind", "census", "--lang", "ru"], "census"),
    ):
        code, said, err = run(capsys, *words, *more)
        assert (code, err) == (0, "")
        assert Path(said.strip()).name == f"rocker-50-1-15-design-{stem}.svg"
    for wrong, text in (
        (["--design", "3"], "no design 2"),
        (["--design", "0"], "a number from 1"),
        (["--kind", "census", "--design", "1"], "--design is for design, not for census"),
        (["--kind", "diagram"], "no poses"),
        (["--pose", "3"], "--pose is for diagram, groups, plans, loops, not for design"),
        (
            ["--kind", "compare", "--pose", "3"],
            "--pose is for diagram, groups, plans, loops, not for compare",
        ),
        (["--dark"], "--dark is for diagram, groups, animation, loops, not for design"),
        (["--mode", "+"], "no assembly mode"),
    ):
        code, said, err = run(capsys, *words, *wrong)
        assert (code, said) == (2, ""), wrong
        assert text in err
    code, _, err = run(capsys, "plot", "rocker-50-1-15", "--task", "turn", "--kind", "census")
    assert code == 2
    assert "task of kind 'sweep'" in err


def test_the_command_without_designs_draws_the_census(quick, capsys, tmp_path: Path) -> None:
    words = ["plot", "c1-infeasible", "--task", "design", "--out", str(tmp_path)]
    code, said, err = run(capsys, *words)
    assert (code, Path(said.strip()).name) == (1, "c1-infeasible-design-census.svg")
    assert "no design exists" in err
    code, said, err = run(capsys, *words, "--kind", "design")
    assert (code, said) == (2, "")
    assert "census, convergence" in err
