"""Every kind of task on mechanisms with no unknowns or one: right values, or a clear message."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.tasks.kinds import TASKS
from mechdae.design.studies.batches.march import Followed
from mechdae.errors import InputError, SolveError
from mechdae.motion.kinematics.prepared import prepare
from tests.shared.command import run
from tests.shared.paths import ROOT
from tests.shared.small import SMALL, Small

AT = (0.0, 0.25, 0.5, 0.75, 1.0)
SETS = (0.03, 0.04, 0.05)
LAW = 'law = "t"'
CLOSE = {"rtol": 1e-12, "atol": 1e-13}
ALL = pytest.mark.parametrize("small", SMALL.values(), ids=list(SMALL))
SINGLE = pytest.mark.parametrize(
    "small", [own for own in SMALL.values() if len(own.drivers) == 1],
    ids=[name for name, own in SMALL.items() if len(own.drivers) == 1],
)  # fmt: skip


def places(small: Small, values=AT, a: float = 0.04) -> np.ndarray:
    return np.array([small.place(u, a) for u in values])


def table(small: Small, values=AT, sets=SETS) -> np.ndarray:
    return np.array([places(small, values, a) for a in sets])


def sweep(small: Small, how: str = "at = [0, 0.25, 0.5, 0.75, 1]", more: str = "") -> str:
    return f'[tasks.turn]\nkind = "sweep"\n{small.driven(how)}{more}'


def study(small: Small, of: str = "turn", how: str = "vary = { a = [0.03, 0.05, 3] }") -> str:
    return f'[tasks.map]\nkind = "study"\nof = "{of}"\n{how}\noutputs = ["{small.path}"]\n'


def solved(small: Small, tasks: str, name: str):
    return md.solve(small.problem(tasks), name)


# -- positions -----------------------------------------------------------------------------------


@ALL
def test_poses(small: Small) -> None:
    for how, values in (("at = [0, 0.25, 0.5, 0.75, 1]", AT), ("at = [0.3]", (0.3,))):
        for more in ("", "outputs = []\n"):
            found = solved(small, sweep(small, how, more), "turn")
            assert set(found.status) == {"ok"}
            if not more:
                place = found.points[small.point].position
                np.testing.assert_allclose(place, places(small, values), **CLOSE)
    task = small.problem(sweep(small))
    assert prepare(task, task.tasks["turn"]).graphs.nx == small.unknowns


@SINGLE
def test_a_range_of_one_pose_or_several(small: Small) -> None:
    for count in (1, 5):
        found = solved(small, sweep(small, "from = 0, to = 1", f"poses = {count}\n"), "turn")
        values = np.linspace(0, 1, count) if count > 1 else [0.0]
        place = found.points[small.point].position
        np.testing.assert_allclose(place, places(small, values), **CLOSE)


@ALL
def test_modes(small: Small) -> None:
    """None of them has an unknown with two values: there is one mode."""
    task = f'[tasks.m]\nkind = "modes"\n{small.driven("at = [0.3]")}'
    found = solved(small, task, "m")
    assert found.summary["count"] == 1
    place = found.points[small.point].position
    np.testing.assert_allclose(place, places(small, (0.3,)), **CLOSE)


# -- many sets -----------------------------------------------------------------------------------


@ALL
def test_studies_of_sweeps(small: Small) -> None:
    for certify in ("", "certify = false\n"):
        for how, values in (("at = [0, 0.25, 0.5, 0.75, 1]", AT), ("at = [0.3]", (0.3,))):
            found = solved(small, sweep(small, how) + study(small) + certify, "map")
            assert set(found.status) == {"ok"}
            np.testing.assert_allclose(found.table[small.path], table(small, values), **CLOSE)


@ALL
def test_studies_of_one_set_and_of_none(small: Small) -> None:
    for how in ("vary = { a = [0.05, 0.07, 1] }", "samples = { a = [0.05] }"):
        found = solved(small, sweep(small) + study(small, how=how), "map")
        wanted = table(small, sets=(0.05,))
        np.testing.assert_allclose(found.table[small.path], wanted, **CLOSE)
    with pytest.raises(InputError, match=r"tasks\.map\.samples\.a: a list with a number at least"):
        solved(small, sweep(small) + study(small, how="samples = { a = [] }"), "map")
    with pytest.raises(InputError, match=r"tasks\.map\.outputs: name the paths"):
        solved(
            small, f'{sweep(small)}[tasks.map]\nkind = "study"\nvary = {{ a = [1, 2, 2] }}', "map"
        )


@ALL
def test_solvers(small: Small) -> None:
    solver = md.Solver(small.problem(sweep(small)), "turn")
    found = solver.many({"a": SETS}, [small.path])
    np.testing.assert_allclose(found.table[small.path], table(small), **CLOSE)
    again = solver(a=0.05)
    np.testing.assert_allclose(again.points[small.point].position, places(small, a=0.05), **CLOSE)
    for nothing in ({"a": []}, {}):
        with pytest.raises(InputError, match="sets"):
            solver.many(nothing, [small.path])
    with pytest.raises(InputError, match="outputs"):
        solver.many({"a": SETS}, [])


@SINGLE
def test_numbers_of_the_whole_way(small: Small) -> None:
    """Lengths of the point's path, its ends along x, and what spans a rising motion has."""
    paths = [f"summary/curve/{small.point}/length"]
    paths += [f"summary/extremes/{small.point}.x/{end}/value" for end in ("min", "max")]
    outputs = f"outputs = {paths}\n"
    task = sweep(small, "from = 0, to = 1", 'poses = 5\nmeasures = ["curve", "extremes"]\n')
    vary = '[tasks.map]\nkind = "study"\nof = "turn"\nvary = { a = [0.03, 0.05, 3] }\n'
    found = solved(small, task + vary + outputs, "map")
    fine = np.linspace(0, 1, 20_001)
    for k, a in enumerate(SETS):
        steps = np.diff(places(small, fine, a), axis=0)
        x = places(small, fine, a)[:, 0]
        wanted = [np.linalg.norm(steps, axis=1).sum(), x.min(), x.max()]
        if np.ptp(x) < 1e-12:
            wanted[1:] = [np.nan, np.nan]
        for path, value in zip(paths, wanted, strict=True):
            np.testing.assert_allclose(found.table[path][k], value, rtol=1e-8)


# -- forces --------------------------------------------------------------------------------------


@ALL
def test_efforts_hold_the_weight(small: Small) -> None:
    """By the slope of the height of the centre, for one set and for many."""
    paths = [f"efforts/{name}" for name in small.drivers]
    task = f'[tasks.f]\nkind = "reactions"\n{small.driven("at = [0.3, 0.6], speed = 0")}'
    found = solved(small, task, "f")
    wanted = np.array([small.slope(u, 0.04) for u in (0.3, 0.6)])
    for k, path in enumerate(paths):
        np.testing.assert_allclose(found.value(path), wanted[:, k], rtol=1e-10, atol=1e-12)
    vary = f"vary = {{ a = [0.03, 0.05, 3] }}\noutputs = {paths}\n"
    found = solved(small, f'{task}[tasks.map]\nkind = "study"\nof = "f"\n{vary}', "map")
    for k, path in enumerate(paths):
        wanted = np.array([[small.slope(u, a)[k] for u in (0.3, 0.6)] for a in SETS])
        np.testing.assert_allclose(found.table[path], wanted, rtol=1e-10, atol=1e-12)
    found = solved(small, task + study(small, "f"), "map")
    np.testing.assert_allclose(found.table[small.path], table(small, (0.3, 0.6)), **CLOSE)


# -- motions and equilibria ----------------------------------------------------------------------


@ALL
def test_motions_that_are_driven(small: Small) -> None:
    task = f'[tasks.go]\nkind = "motion"\nat = [0, 0.05]\n{small.held(LAW)}'
    for name, more in (("go", ""), ("go", "linearise = 0.05\n"), ("map", study(small, "go"))):
        found = solved(small, task + more, name)
        if name == "go":
            place = found.points[small.point].position
            np.testing.assert_allclose(place, places(small, (0, 0.05)), rtol=1e-9, atol=1e-11)
        else:
            wanted = table(small, (0, 0.05))
            np.testing.assert_allclose(found.table[small.path], wanted, rtol=1e-9, atol=1e-11)


@ALL
def test_equilibria_that_are_held(small: Small) -> None:
    """Nothing is free: the pose is what the drivers say, and so are its derivatives."""
    task = f'[tasks.rest]\nkind = "equilibrium"\n{small.held("at = [0.3]")}'
    for more in ("", "linearise = true\n"):
        found = solved(small, task + more, "rest")
        place = found.points[small.point].position
        np.testing.assert_allclose(place, places(small, (0.3,)), rtol=1e-9, atol=1e-11)
    found = solved(small, task + study(small, "rest"), "map")
    wanted = table(small, (0.3,))
    np.testing.assert_allclose(found.table[small.path], wanted, rtol=1e-9, atol=1e-11)
    sensitivity = '[tasks.s]\nkind = "sensitivity"\nof = "rest"\nwrt = ["a"]\n'
    found = solved(small, f'{task}{sensitivity}outputs = ["{small.path}"]\n', "s")
    slope = slopes(small, (0.3,))
    np.testing.assert_allclose(np.ravel(derivative(found, small)), slope.ravel(), atol=1e-8)


@ALL
def test_equilibria_that_hang(small: Small) -> None:
    """What turns about a pin hangs below it; what slides or climbs has none, and says so."""
    task = '[tasks.rest]\nkind = "equilibrium"\n'
    if 'kind = "revolute"' not in small.text:
        with pytest.raises(SolveError, match="no equilibrium"):
            solved(small, task, "rest")
        one = study(small, "rest", "samples = { a = [0.03] }")
        found = solved(small, task + one, "map")
        assert "no equilibrium" in str(found.fault)
        return
    found = solved(small, task, "rest")
    crank = found.points["crank.B"].position[0]
    assert crank[1 if len(crank) == 2 else 2] <= -0.04 + 1e-9


# -- derivatives ---------------------------------------------------------------------------------


def slopes(small: Small, values) -> np.ndarray:
    """Return derivatives of places by a: all of them are of first degree in it."""
    return (places(small, values, 0.05) - places(small, values, 0.03)) / 0.02


def derivative(found, small: Small) -> np.ndarray:
    return np.asarray(found.data["derivatives"][small.path]["a"])


@ALL
def test_sensitivities_of_sweeps(small: Small) -> None:
    head = '[tasks.s]\nkind = "sensitivity"\nof = "turn"\n'
    outputs = f'outputs = ["{small.path}"]\n'
    for order in (1, 2):
        more = f'{head}{outputs}wrt = ["a"]\norder = {order}\n'
        found = solved(small, sweep(small) + more, "s")
        np.testing.assert_allclose(derivative(found, small), slopes(small, AT), atol=1e-12)
    for wrong in (f"{outputs}wrt = []\n", 'outputs = []\nwrt = ["a"]\n'):
        with pytest.raises(InputError, match=r"tasks\.s\.(wrt|outputs): name"):
            solved(small, sweep(small) + head + wrong, "s")


# -- synthesis -----------------------------------------------------------------------------------


@SINGLE
def test_paths_are_synthesised(small: Small) -> None:
    """Two places of the point at a = 0.06, wherever the driver is there."""
    if np.ptp(places(small, (0.2, 0.5)), axis=0).max() < 1e-9:
        return
    targets = [[float(x) for x in own] for own in places(small, (0.2, 0.5), 0.06)]
    task = (
        f'[tasks.d]\nkind = "synthesis"\ndriver = {{ coordinate = "{small.drivers[0]}" }}\n'
        f"starts = 3\nfree = {{ a = [0.01, 0.1] }}\n"
        f'goal = {{ kind = "path", point = "{small.point}", timing = "free", '
        f"targets = {targets} }}\n"
    )
    found = solved(small, task, "d")
    assert found.fault is None
    best = found.data["designs"][0]
    assert best["objective"] <= 1e-16
    assert not best["defects"]
    if not small.unknowns:  # the yoke has others
        assert abs(best["parameters"]["a"] - 0.06) < 1e-6


@SINGLE
def test_a_number_of_the_mechanism_is_least_at_its_bound(small: Small) -> None:
    outputs = '[outputs]\nsize = "a**2"\n'
    task = (
        f'[tasks.d]\nkind = "synthesis"\ndriver = {{ coordinate = "{small.drivers[0]}" }}\n'
        "starts = 2\nfree = { a = [0.01, 0.1] }\n"
        'goal = { kind = "minimise", of = "turn/outputs/size/value" }\n'
    )
    base = sweep(small, "from = 0, to = 1", "poses = 5\n")
    found = solved(small, outputs + base + task, "d")
    assert abs(found.data["designs"][0]["parameters"]["a"] - 0.01) < 1e-8


def test_swings_that_no_parameter_changes_are_refused() -> None:
    task = (
        '[tasks.d]\nkind = "synthesis"\ndriver = { coordinate = "crank.angle" }\n'
        "starts = 2\nfree = { a = [0.01, 0.1] }\n"
        'goal = { kind = "rocker", body = "crank", swing = 1 }\n'
    )
    with pytest.raises(InputError, match="does not depend on 'a'"):
        solved(SMALL["crank"], task, "d")


# -- what is refused -----------------------------------------------------------------------------


@ALL
def test_tasks_of_nothing_are_refused(small: Small) -> None:
    with pytest.raises(InputError, match="the list of values is empty"):
        solved(small, sweep(small, "at = []"), "turn")
    modes = f'[tasks.m]\nkind = "modes"\n{small.driven("at = [0.3]")}'
    for kind in ("study", "sensitivity"):
        more = f'[tasks.x]\nkind = "{kind}"\nof = "m"\noutputs = ["{small.path}"]\n'
        more += "vary = { a = [1, 2, 2] }\n" if kind == "study" else 'wrt = ["a"]\n'
        with pytest.raises(InputError, match="'m' is a task of kind modes"):
            solved(small, modes + more, "x")


def test_the_files_are_solved_by_the_command(capsys) -> None:
    for name in ("crank", "pulleys"):
        file = ROOT / "tests" / "data" / "small" / f"{name}-study.toml"
        code, out, err = run(capsys, "solve", str(file), "--task", "map", "--debug")
        assert (code, err) == (0, "")
        assert "0.03" in out
    found = md.solve(md.load(file), "map").table["points/pulley.E/position"]
    for row in found:  # E stands at (0.05, 0.01) on a pulley about (0.2, 0)
        for place, u in zip(row, np.linspace(0, 2 * np.pi, 5), strict=True):
            turned = (0.05 + 0.01j) * np.exp(0.5j * u) + 0.2
            np.testing.assert_allclose(place, (turned.real, turned.imag), atol=1e-15)


def test_every_kind_is_here() -> None:
    """The kinds that need no loop; a composition makes mechanisms of its own, play needs gaps."""
    known = {"sweep", "modes", "reactions", "motion", "equilibrium", "synthesis", "study"}
    assert set(TASKS) == known | {"sensitivity", "composition", "play"}


# -- planted mistakes ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["crank", "belt", "crank in space"])
def test_a_reduction_over_no_blocks_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = property(lambda own: (own.low.max(axis=0), own.high.min(axis=0)))
    monkeypatch.setattr(Followed, "whole", plain)
    with pytest.raises(ValueError, match="zero-size"):
        test_studies_of_sweeps(SMALL[name])


def test_poses_without_unknowns_that_lose_their_number_are_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from mechdae.design.synthesis.goals.base import Goal

    def lost(own: Goal, values, count: int):
        return np.reshape(values[own.key("x")], (-1, max(own.space.poses.nx, 1)))

    monkeypatch.setattr(Goal, "poses_of", lost)
    with pytest.raises(IndexError):
        test_paths_are_synthesised(SMALL["crank"])
