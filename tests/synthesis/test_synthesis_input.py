"""What cannot be a synthesis is refused with one message that says what, and where in the file."""

import re
from dataclasses import replace

import pytest

import mechdae as md
from mechdae.describe.file.writing import given
from mechdae.design.synthesis.synthesize import synthesize
from mechdae.errors import InputError, MechdaeError, UnavailableError, UnknownName

NAN = float("nan")
TARGETS = [[3, 3], [2.759, 3.363], [2.372, 3.663], [1.89, 3.862], [1.355, 3.943]]
POINT = {"kind": "path", "point": "coupler.P"}


def refused(name="c2-arc5-timed", kind=InputError, **changed):
    """Return the error of a problem's task with keys changed; None as a value takes a key away."""
    problem = md.load(name)
    task = problem.tasks["design"]
    with pytest.raises(MechdaeError) as caught:
        synthesize(problem, "design", replace(task, **changed), starts=1)
    error = caught.value
    assert isinstance(error, kind), repr(error)
    assert "\n" not in error.what
    return error


def goal_of(name="c2-arc5-timed", **changed):
    """Return the goal of a problem with keys changed."""
    table = {**given(md.load(name).tasks["design"].goal), **changed}
    return {key: value for key, value in table.items() if value is not None}


# -- goals -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "kind", "where", "words"),
    [
        ({"kind": "pathh"}, UnknownName, "goal.kind", "pathh"),
        ({"kind": None}, MechdaeError, "goal", "kind"),
        ({"point": "coupler.Q"}, UnknownName, "goal.point", "coupler.Q"),
        ({"point": None}, MechdaeError, "goal.point", "None|missing"),
        ({"pointt": "coupler.P"}, UnknownName, "goal", "pointt"),
        ({"targets": None}, InputError, "goal.targets", ""),
        ({"targets": []}, InputError, "goal.targets", ""),
        ({"targets": [[3, 3]], "at": [0.5]}, InputError, "goal.targets", "2|two"),
        ({"targets": [[3, 3, 1]] * 5}, InputError, "goal.targets", ""),
        ({"targets": [[3, "three"], *TARGETS[1:]]}, MechdaeError, "goal.targets", "three"),
        ({"targets": [[NAN, 3], *TARGETS[1:]]}, InputError, "goal", "finite number"),
        ({"targets": [[float("inf"), 3], *TARGETS[1:]]}, InputError, "goal", "finite number"),
        ({"at": [0.5, 0.8]}, InputError, "goal.at", "2 values for 5 targets"),
        ({"at": [0.5, NAN, 1, 1.2, 1.4]}, InputError, "goal", "finite number"),
        ({"steps": [0, 1, 2, 3, 4]}, InputError, "goal", "'at' and 'steps'"),
        ({"timing": "sometimes", "at": None}, UnknownName, "goal.timing", "sometimes"),
        ({"measure": "worst"}, UnknownName, "goal.measure", "worst"),
        ({"closed": 1}, InputError, "goal.closed", ""),
        ({"weight": 0}, InputError, "goal.weight", "positive"),
        ({"weight": NAN}, InputError, "goal", "finite number"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_paths(changed, kind, where, words):
    error = refused(kind=kind, goal=goal_of(**changed))
    assert error.where.startswith(where)
    assert re.search(words, error.what)


def test_goal_and_goals():
    assert refused(goals=[goal_of()]).where == "goal"
    assert refused(goal=None).where == "goal"
    assert refused(goal=None, goals=[]).where == "goals"
    assert refused(goal=None, goals=[goal_of(), goal_of(point="coupler.Z")]).where == (
        "goals[1].point"
    )


def test_all_targets_in_one_place():
    error = refused(goal=goal_of(targets=[[3, 3]] * 5))
    assert error.where.startswith("goal.targets")


@pytest.mark.parametrize(
    ("changed", "kind", "where"),
    [
        ({"input": "B0.angle"}, UnknownName, "goal.input"),
        ({"output": "B9.angle"}, MechdaeError, "goal.output"),
        ({"function": "x +"}, MechdaeError, "goal.function"),
        ({"function": "y"}, UnknownName, "goal.function"),
        ({"function": "1"}, InputError, "goal"),
        ({"function": "log(x)", "range": [-1, 1]}, MechdaeError, "goal"),
        ({"range": [1, 1]}, InputError, "goal"),
        ({"range": [1]}, InputError, "goal.range"),
        ({"targets": [[0, 0], [1, 1]]}, InputError, "goal"),
        ({"input_range": None}, InputError, "goal"),
        ({"input_start": "phi9"}, MechdaeError, "goal.input_start"),
        ({"measure": "exact"}, InputError, "goal.measure"),
        ({"measure": "exactly"}, UnknownName, "goal.measure"),
        ({"sense": "fre"}, UnknownName, "goal.sense"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_functions(changed, kind, where):
    name = "fg4-log10-1-2-60-90"
    error = refused(name, kind, goal=goal_of(name, **changed))
    assert error.where.startswith(where)


@pytest.mark.parametrize(
    ("goals", "kind", "where"),
    [
        ([{"kind": "rocker", "body": "roker", "swing": 0.8, "time_ratio": 1.1}], UnknownName,
         "goals[0].body"),
        ([{"kind": "rocker", "body": "rocker", "swing": 7.0, "time_ratio": 1.1}], InputError,
         "goals[0]"),
        ([{"kind": "rocker", "body": "rocker", "swing": 0.8, "time_ratio": 0}], InputError,
         "goals[0]"),
        ([{"kind": "rocker", "body": "rocker"}], InputError, "goals[0]"),
        ([{"kind": "minimise", "of": "cyle/summary/loss"}], UnknownName, "goals[0].of"),
        ([{"kind": "minimise", "of": "cycle"}], InputError, "goals[0].of"),
        ([{"kind": "minimise", "of": "cycle/summary/losss"}], MechdaeError, ""),
        ([{"kind": "minimise", "of": "cycle/joints/Z/loss"}], MechdaeError, ""),
        ([{"kind": "minimise", "of": "turn/summary/loss"}], InputError, ""),
        ([{"kind": "minimise", "of": "cycle/summary/loss", "reduce": "median"}], UnknownName,
         "goals[0].reduce"),
        ([{"kind": "straight-line", "point": "coupler.A", "arc": 9.0}], InputError,
         "goals[0].arc"),
        ([{"kind": "straight-line", "point": "coupler.A", "arc": 3.0, "stroke": -1}], InputError,
         "goals[0].stroke"),
        ([{"kind": "motion", "body": "coupler", "poses": [[0, 0], [1, 1]]}], InputError,
         "goals[0].poses"),
    ],
)  # fmt: skip
def test_other_goals(goals, kind, where):
    error = refused("rocker-50-1-15", kind, goals=goals)
    assert error.where.startswith(where)


def test_task_driven_by_another_coordinate():
    problem = md.load("rocker-50-1-15")
    turn = problem.tasks["turn"]
    other = replace(turn, driver=replace(turn.driver, coordinate="B0.angle"))
    changed = replace(problem, tasks={**problem.tasks, "turn": other})
    with pytest.raises(InputError, match=r"driven by B0\.angle, not by A0\.angle"):
        synthesize(changed, "design", changed.tasks["design"], starts=1)


# -- freedoms --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("free", "kind", "where", "words"),
    [
        ({}, InputError, "free", ""),
        ([1, 2], InputError, "free", ""),
        ({"r9": [1, 2]}, UnknownName, "free", "r9"),
        ({"r1": [2, 1]}, InputError, "free.r1", "2 to 1"),
        ({"r1": [2, 2]}, InputError, "free.r1", "2 to 2"),
        ({"r1": 2}, InputError, "free.r1", ""),
        ({"r1": [1, NAN]}, InputError, "free", "finite number"),
        ({"r1": [1, float("inf")]}, InputError, "free", "finite number"),
        ({"r1": ["one", 2]}, MechdaeError, "free.r1", "one"),
        ({"r1": {"ratios": []}}, InputError, "free.r1.ratios", ""),
        ({"r1": {"ratios": [0]}}, InputError, "free.r1.ratios", "zero"),
        ({"r1": {"ratioss": [1]}}, UnknownName, "free.r1", "ratioss"),
        ({"r1": {"ratios": [1, 2]}}, InputError, "free", "no parameter is free"),
        ({"p": {"point": "ground.Z", "disc": [0, 0, 1]}}, UnknownName, "free.p.point", "Z"),
        ({"p": {"point": "coupler.P", "disc": [0, 0, 1]}}, UnknownName, "free.p.point", ""),
        ({"p": {"point": "ground.A0", "disc": [0, 0, -1]}}, InputError, "free.p.disc", "radius"),
        ({"p": {"point": "ground.A0", "disc": [0, 0]}}, InputError, "free.p.disc", ""),
        ({"p": {"point": "ground.A0", "polygon": [[0, 0], [1, 1]]}}, InputError,
         "free.p.polygon", ""),
        ({"p": {"point": "ground.A0", "polygon": [[0, 0], [1, 0], [0.1, 0.1], [0, 1]]}},
         InputError, "free.p.polygon", "convex"),
        ({"p": {"point": "ground.A0"}}, InputError, "free.p", "polygon"),
    ],
)  # fmt: skip
def test_freedoms(free, kind, where, words):
    error = refused(kind=kind, free=free)
    assert error.where.startswith(where)
    assert re.search(words, error.what)


def test_parameters_without_effect_are_named():
    table = md.load("rocker-50-1-15").tasks["design"].free
    error = refused("rocker-50-1-15", free={**table, "T": [1, 2]})
    assert error.where == "free.T"
    assert "'T'" in error.what
    assert error.hint


# -- constraints -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("constraint", "kind", "where"),
    [
        ({"kind": "full-turns"}, UnknownName, "constraints[0].kind"),
        ({"kind": "full-turn", "coordinate": "B0.angle"}, UnknownName,
         "constraints[0].coordinate"),
        ({"kind": "full-turn", "margins": 1}, UnknownName, "constraints[0]"),
        ({"kind": "full-turn", "margin": NAN}, InputError, "constraints"),
        ({"kind": "transmission-angle", "between": ["coupler", "roker"], "min": 0.5}, UnknownName,
         "constraints[0].between"),
        ({"kind": "transmission-angle", "between": ["coupler", "rocker"]}, InputError,
         "constraints[0].min"),
        ({"kind": "transmission-angle", "between": ["coupler", "rocker"], "min": 2.0}, InputError,
         "constraints[0].min"),
        ({"kind": "transmission-angle", "between": ["coupler", "rocker"], "min": 0.5,
          "over": "day"}, UnknownName, "constraints[0].over"),
        ({"kind": "transmission-angle", "between": ["crank"], "min": 0.5}, InputError,
         "constraints"),
        ({"kind": "transmission-angle", "between": [], "min": 0.5}, InputError, "constraints"),
        ({"kind": "box", "points": ["coupler.Z"], "x": [0, 1]}, UnknownName,
         "constraints[0].points"),
        ({"kind": "box", "points": ["coupler.P"], "x": [1, 0]}, InputError, "constraints[0].x"),
        ({"kind": "box", "points": ["coupler.P"]}, InputError, "constraints[0]"),
        ({"kind": "box", "points": [], "x": [0, 1]}, InputError, "constraints[0].points"),
        ({"kind": "ratio", "of": ["r3", "r9"], "max": 2}, UnknownName, "constraints[0].of"),
        ({"kind": "ratio", "of": ["r3"], "max": 2}, InputError, "constraints[0].of"),
        ({"kind": "ratio", "of": ["x0", "y0"], "max": 2}, InputError, "constraints[0].of"),
        ({"kind": "ratio", "of": ["r3", "r2"]}, InputError, "constraints[0].max"),
        ({"kind": "limit", "of": "cycle/joints/A/loss", "max": 1}, UnknownName,
         "constraints[0].of"),
    ],
)  # fmt: skip
def test_constraints(constraint, kind, where):
    assert refused(kind=kind, constraints=[constraint]).where.startswith(where)


@pytest.mark.parametrize(
    ("constraint", "where"),
    [
        ({"kind": "limit", "of": "cycle/joints/A/losss", "max": 1.0}, ""),
        ({"kind": "limit", "of": "cycle/joints/A/loss"}, "constraints[0]"),
        ({"kind": "limit", "of": "cycle/joints/A/loss", "min": 2.0, "max": 1.0}, "constraints[0]"),
        ({"kind": "limit", "of": "cycle/joints/A/loss", "max": NAN}, "constraints"),
    ],
)
def test_limits_of_other_tasks(constraint, where):
    error = refused("rocker-50-1-15", MechdaeError, constraints=[constraint])
    assert error.where.startswith(where)


# -- the task --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("driver", "where"),
    [
        (None, "driver"),
        ({}, "driver"),
        ({"coordinate": "A9.angle"}, "driver.coordinate"),
        ({"coordinate": "A0.angle", "from": 0}, "driver"),
    ],
)
def test_drivers(driver, where):
    assert refused(kind=MechdaeError, driver=driver).where.startswith(where)


@pytest.mark.parametrize(
    ("name", "goal", "free", "words"),
    [
        ("five-crank-parallelogram",
         {"kind": "path", "point": "beam.B1", "targets": [[1, 1], [0.5, 1.2]]},
         {"L": [0.5, 2]}, "redundant"),
        ("four-stroke-engine", {"kind": "minimise", "of": "cycle/joints/B/reaction"},
         {"l": [0.12, 0.2]}, "tables"),
    ],
)  # fmt: skip
def test_what_is_not_computed_is_refused(name, goal, free, words):
    problem = md.load(name)
    driver = next(t for t in problem.tasks.values() if t.kind == "sweep").driver.coordinate
    task = md.Synthesis(driver={"coordinate": driver}, goal=goal, free=free)
    with pytest.raises(UnavailableError, match=words):
        synthesize(problem, "design", task, starts=1)


# -- what cannot be met ----------------------------------------------------------------------------


def test_targets_out_of_reach_are_proved():
    problem = md.load("c2-arc5-timed")
    far = [[x + 900, y] for x, y in TARGETS]
    task = replace(problem.tasks["design"], goal=goal_of(targets=far, measure="exact"))
    result = synthesize(problem, "design", task, starts=2)
    assert result.data["designs"] == []
    assert result.summary["status"] == "none exists"
    # the coupler point reaches 50 + 50 sqrt 2 from a pivot at the origin
    assert "120.711" in result.fault


@pytest.mark.parametrize(
    ("r1", "r2", "r3", "r4", "missed"),
    [
        # r3 is the shortest: r2 + r1 - r3 - r4 is 0.7 at least, r1 + r2 - r3 - r4 as well
        ([3, 4], [2.9, 3.2], [1, 1.2], [3, 4], 0.7),
        # nothing closes: r2 is longer than the three others together
        ([0.5, 1], [3, 4], [0.1, 0.5], [0.1, 0.5], 2.5),
    ],
)
def test_bounds_that_contradict_a_full_turn(r1, r2, r3, r4, missed):
    problem = md.load("c2-arc5-timed")
    free = {**problem.tasks["design"].free, "r1": r1, "r2": r2, "r3": r3, "r4": r4}
    result = synthesize(problem, "design", replace(problem.tasks["design"], free=free), starts=2)
    assert result.data["designs"] == []
    assert result.summary["status"] == "none exists"
    assert f"missed by {missed:g}" in result.fault
