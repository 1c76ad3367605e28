"""Repetition: cells of a problem file, sizes, and chains of any length."""

from __future__ import annotations

import json
import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.expression import evaluate
from mechdae.describe.file import library
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.repeat import MAX_COUNT, expand
from mechdae.describe.file.schema import schema
from mechdae.equations.model import Model
from mechdae.errors import InputError, MechanismError, UnknownName
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.bench.chain import chain, scaling, table
from tests.reference.levers import levers

NAME = "chain-of-four-bars"
TEXT = library.find(NAME).read_text(encoding="utf-8").split("[[expected]]")[0]
LONG = np.longdouble


def load(text: str) -> md.Problem:
    return from_dict(tomllib.loads(text))


def small(old: str = "", new: str = "") -> str:
    """Return the predefined file with three loops and one text replaced."""
    text = TEXT.replace("N = 12", "N = 3", 1)
    assert old in text, old
    return text.replace(old, new, 1)


# -- what is written out -------------------------------------------------------------------------


def test_cells_are_parts_like_any_other() -> None:
    """The expanded mechanism is the one that a loop in Python builds."""
    names = range(1, 4)
    levers = [
        md.Body(
            f"rocker{k}",
            {"G": (0, 0), "C": (f"-(-1)**{k}*c", 0), "B": (f"(-1)**{k}*c", 0)},
        )
        for k in names
    ]
    couplers = [md.Body(f"coupler{k}", {"B": (0, 0), "C": ("b", 0)}) for k in names]
    links = [body for pair in zip(couplers, levers, strict=True) for body in pair]
    joints = [md.Revolute("G0", "ground.G0", "rocker0.G")]
    for k in names:
        joints.append(md.Revolute(f"B{k}", f"rocker{k - 1}.B", f"coupler{k}.B"))
        joints.append(md.Revolute(f"C{k}", f"coupler{k}.C", f"rocker{k}.C"))
        joints.append(md.Revolute(f"G{k}", f"ground.G{k}", f"rocker{k}.G"))
    sketch = {"rocker0": math.radians(60)}
    for k in names:
        sketch |= {f"coupler{k}": math.radians(10), f"rocker{k}": math.radians(90)}
    mechanism = md.Mechanism(
        ground=md.Ground({"G0": (0, 0), **{f"G{k}": (f"{k}*d", 0) for k in names}}),
        bodies=[md.Body("rocker0", {"G": (0, 0), "B": ("r", 0)}), *links],
        joints=joints,
        parameters={"r": 0.02, "b": 0.11, "c": 0.05, "d": 0.1, "omega": 10.0},
        sketch=sketch,
    )
    problem = load(small())
    assert problem.mechanism == mechanism
    assert list(problem.mechanism.bodies) == list(mechanism.bodies)
    assert problem.tasks["last"].outputs == ("rocker3",)
    assert problem.sizes == {"N": 3}
    assert not {"N", "k"} & set(Model(problem.mechanism).p_names)


def test_every_section_of_a_cell() -> None:
    text = """
schema = 1
title = "a {brace} in a title"
[sizes]
N = 2
M = 3
[parameters]
step = "0.3/{N}"
[ground]
points_mm = { A = [0, 0] }
[bodies.b0]
points = { P = [0, 0], Q = [0.1, 0] }
[joints]
J0 = { kind = "revolute", between = ["ground.A", "b0.P"] }
[loads.load]
kind = "table"
coordinate = "b0.angle"
file = "{not}.csv"
body = "b0"
[repeat.arm]
count = "M - 1"
from = "N"
ground = { points_mm = { "A{k}" = ["100*{k}", "{k-2}"] } }
[repeat.arm.parameters]
"l{k}_mm" = "100*{k}"
[repeat.arm.bodies]
"b{k}" = { number = "{2*k}", points = { P = [0, 0], "Q{k-1}x" = ["l{k}", 0] }, outline = ["P"] }
[repeat.arm.joints]
"J{k}" = { kind = "revolute", between = ["ground.A{k}", "b{k}.P"] }
[repeat.arm.sketch]
"b{k}_deg" = "10*{k}"
[repeat.arm.loads]
"turn{k}" = { kind = "torque", body = "b{k}", value = "{-k}*1.3*l{k}" }
[repeat.arm.outputs]
"o{k}" = "b{k}.angle - b{N}.angle"
[repeat.none]
count = 0
bodies = { x = { points = {} } }
"""
    problem = load(text)
    mechanism = problem.mechanism
    values = mechanism.values()
    assert list(mechanism.bodies) == ["b0", "b2", "b3"]
    assert [mechanism.bodies[name].number for name in ("b2", "b3")] == [4, 6]
    assert values["step"] == 0.15
    assert (values["ground.A3.x"], values["ground.A3.y"]) == (0.3, 0.001)
    assert (values["l3"], values["b3.Q2x.x"]) == (pytest.approx(0.3), pytest.approx(0.3))
    assert mechanism.loads["turn3"].value == "(-3)*1.3*l3"
    assert mechanism.outputs["o3"] == "b3.angle - b2.angle"
    known = {**values, "x": 0.0}
    assert evaluate(mechanism.sketch["b3"], known) == pytest.approx(math.radians(30))
    assert evaluate("(-3)**2", {}) == 9.0  # why a negative number gets parentheses
    assert problem.title == "a {brace} in a title"
    assert mechanism.loads["load"].file == "{not}.csv"


def test_no_copy_and_one_copy() -> None:
    none = load(TEXT).with_values({"N": 0})
    assert list(none.mechanism.bodies) == ["rocker0"]
    assert md.solve(none, "turn").fault is None
    assert list(load(TEXT).with_values({"N": 1}).mechanism.bodies)[1:] == ["coupler1", "rocker1"]


# -- what is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('count = "N"', 'count = "M"', ["repeat.loop.count", "unknown size 'M'", "N"]),
        ('count = "N"', 'count = "N/2"', ["repeat.loop.count", "whole", "N/2 = 1.5"]),
        ('count = "N"', 'count = "N - 4"', ["repeat.loop.count", "-1 copies", "negative"]),
        ('count = "N"', "count = 2.5", ["repeat.loop.count", "2.5"]),
        ('count = "N"', "count = true", ["repeat.loop.count", "whole"]),
        ('count = "N"', 'count = "1/0"', ["repeat.loop.count"]),
        ('count = "N"', f"count = {MAX_COUNT + 1}", ["repeat.loop.count", str(MAX_COUNT)]),
        ('count = "N"', "count = 1501", ["repeat.loop.count", "3002 bodies", "3000"]),
        ('count = "N"', 'cuont = "N"', ["repeat.loop", "cuont", "did you mean count"]),
        ('count = "N"', "from = 2", ["repeat.loop", "count", "missing"]),
        ('count = "N"', 'count = "N"\nfrom = 0.5', ["repeat.loop.from", "0.5"]),
        ('count = "N"', 'count = "N"\nfrom = 0', ["repeat.loop.ground.points.G{k} (k = 0)", "G0"]),
        ('count = "N"', 'count = "N"\nfrom = -1', ["(k = -1)", "negative"]),
        ("N = 3", "N = 3.5", ["sizes.N", "whole"]),
        ("N = 3", 'N = "3"', ["sizes.N", "whole"]),
        ("N = 3", "k = 3", ["sizes.k", "number of the copy"]),
        ("N = 3", "N = 3\nr = 2", ["sizes.r", "parameter"]),
        ("[sizes]\nN = 3", "[sizes]\nN = 3\n2N = 3", ["sizes.2N", "not a name"]),
        ('["rocker{N}"]', '["rocker{M}"]', ["tasks.last.outputs[0]", "unknown size 'M'"]),
        ('["rocker{N}"]', '["rocker{k}"]', ["tasks.last.outputs[0]", "outside of a repetition"]),
        ('["rocker{N}"]', '["rocker{N"]', ["tasks.last.outputs[0]", "brace"]),
        ('["rocker{N}"]', '["rocker{N}}"]', ["tasks.last.outputs[0]", "brace"]),
        ('["rocker{N}"]', '["rocker{}"]', ["tasks.last.outputs[0]", "empty"]),
        ('["rocker{N}"]', '["rocker{N+1}"]', ["tasks.last", "rocker4"]),
        ('["rocker{N}"]', '["rocker{open(1)}"]', ["tasks.last.outputs[0]", "open"]),
        (
            'between = ["rocker{k-1}.B"',
            'between = ["rocker{k-2}.B"',
            ["repeat.loop.joints.B{k}.between (k = 1)", "rocker(-1).B"],
        ),
        (
            'between = ["rocker{k-1}.B"',
            'between = ["rocker{k-1}.Z"',
            ["repeat.loop.joints.B{k}.between (k = 1)", "rocker0.Z", "rocker0.B"],
        ),
        (
            'between = ["rocker{k-1}.B"',
            'between = ["rocker{k/2}.B"',
            ["repeat.loop.joints.B{k}.between[0] (k = 1)", "whole", "0.5"],
        ),
        (
            '"C{k}" = { kind = "revolute"',
            '"C{k}" = { kind = "revolut"',
            ["repeat.loop.joints.C{k}.kind (k = 1)", "did you mean revolute"],
        ),
        (
            '"C{k}" = { kind',
            '"C" = { kind',
            ["repeat.loop.joints.C (k = 2)", "'C' is made twice", "put {k}"],
        ),
        (
            '"C{k}" = { kind',
            '"B{k+1}" = { kind',
            ["repeat.loop.joints.B{k} (k = 2)", "repeat.loop.joints.B{k+1} (k = 1)"],
        ),
        ('"C{k}" = { kind', '"C{k-2}" = { kind', ["joints.C{k-2} (k = 1)", "negative"]),
        ('"coupler{k}" = {', '"C{k}" = {', ["'C1' is both a body and a joint"]),
        (
            '"rocker{k}_deg"  = 90',
            '"rocker{k-1}"  = 90',
            ["repeat.loop.sketch.rocker{k-1} (k = 1)", "sketch.rocker0_deg"],
        ),
        ('"coupler{k}_deg" = 10', '"coupler{k}_deg" = nan', ["sketch.coupler{k}_deg (k = 1)"]),
        ('["{k}*d", 0]', '["{k}*e", 0]', ["repeat.loop.ground.points.G{k}.x (k = 1)", "'e'"]),
        ('["{k}*d", 0]', '["k*d", 0]', ["ground.points.G{k}.x (k = 1)", "in braces: {k}"]),
        ('["b", 0]', '["b*{N-k}", 0]', ["repeat.loop.bodies.coupler{k} (k = 3)", "zero length"]),
        ("r_mm = 20", 'r = "0.06/N"', ["parameters.r", "in braces: {N}"]),
        ("[repeat.loop.sketch]", "[repeat.loop.tasks]", ["repeat.loop", "tasks"]),
        ("[repeat.loop]", "[repeat]\nx = 1\n[repeat.loop]", ["repeat.x", "table"]),
    ],
)
def test_bad_repetition_names_the_place(old: str, new: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        load(small(old, new))
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_copies_are_bounded_before_they_are_made() -> None:
    points = ", ".join(f'"P{i}_{{k}}" = [0, 0]' for i in range(3000))
    data = tomllib.loads(f"repeat.wide.count = 2000\nrepeat.wide.ground.points = {{ {points} }}")
    with pytest.raises(InputError, match=r"repeat\.wide: .*characters"):
        expand(data)


def test_errors_while_solving_name_the_cell() -> None:
    problem = load(small('"rocker{k}_deg"  = 90', '"rockr{k}_deg"  = 90'))
    with pytest.raises(UnknownName, match=r"repeat\.loop\.sketch\.rockr\{k\}_deg") as caught:
        md.solve(problem, "turn")
    assert "did you mean" in str(caught.value)


# -- setting sizes -------------------------------------------------------------------------------


def test_sizes_are_set_like_parameters(capsys) -> None:
    problem = load(small())
    longer = problem.with_values({"N": 5, "d": 0.11})
    assert longer.sizes == {"N": 5}
    assert longer.mechanism.values()["ground.G5.x"] == pytest.approx(0.55)
    assert longer.tasks["last"].outputs == ("rocker5",)
    assert problem.sizes == {"N": 3}
    assert longer.with_values({"N": "N - 3"}) == problem.with_values({"N": 2, "d_mm": 110})
    result = md.solve(problem, "last", set={"N": 2})
    assert list(result.bodies) == ["rocker2"]
    assert main(["show", NAME, "--set", "N=2", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["sizes"] == {"N": 2}
    assert shown["mobility"]["n"] == 5
    assert main(["solve", NAME, "--set", "N=1", "--task", "last", "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)["tasks"]["last"]["bodies"]) == ["rocker1"]
    assert main(["solve", NAME, "--set", "N=1.5"]) == 2
    assert "set N: a whole number is needed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"N": -1}, ["set N", "negative"]),
        ({"N": 1500}, ["set N", "3000 bodies"]),
        ({"N": "M"}, ["set N", "unknown size 'M'"]),
        ({"n": 4}, ["set n", "the sizes are N"]),
    ],
)
def test_bad_sizes_are_refused(changes: dict, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        load(small()).with_values(changes)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_the_order_of_settings_does_not_matter() -> None:
    problem = load(small())
    one = problem.with_values({"rocker4.C.x": 0.06, "N": 4, "b": 0.12})
    two = problem.with_values({"N": 4}).with_values({"b": 0.12}).with_values({"rocker4.C.x": 0.06})
    three = two.with_values({"N": 7}).with_values({"N": 4})
    assert one == two == three
    assert one.mechanism.values()["rocker4.C.x"] == 0.06
    with pytest.raises(UnknownName, match=r"rocker4\.C\.x"):
        two.with_values({"N": 3})  # the length that was set is no longer there


def test_tasks_of_the_caller_stay() -> None:
    task = md.Sweep(md.Driver("rocker0.angle", at=[1.0]), outputs=("rocker1",))
    problem = load(small()).with_task("mine", task).with_values({"N": 4})
    assert problem.tasks["mine"] == task
    assert problem.tasks["last"].outputs == ("rocker4",)
    changed = replace(problem, mechanism=problem.mechanism.with_values({"b": 0.12}))
    with pytest.raises(InputError, match="no longer the one of the file"):
        changed.with_values({"N": 2})


# -- writing -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "repeats"),
    [
        ({}, True),
        ({"N": 2}, True),
        ({"N": 4, "d": 0.11, "omega_rpm": 60}, True),
        ({"c": "b/2 + pi/1000"}, True),
        ({"rocker2.C.x": 0.06}, False),
    ],
)
def test_round_trip(changes: dict, repeats: bool, tmp_path) -> None:
    problem = md.load(NAME).with_values(changes)
    path = tmp_path / f"{NAME}.toml"
    md.dump(problem, path)
    again = md.load(path)
    assert again == problem
    assert again.sizes == (problem.sizes if repeats else {})
    if repeats:
        assert again.with_values({"N": 3}) == problem.with_values({"N": 3})
        assert md.dumps(again) == md.dumps(problem)


def test_own_tasks_and_units_round_trip(tmp_path) -> None:
    text = small().replace("schema = 1", 'schema = 1\ngravity = [0, "-9.81"]', 1)
    task = md.Sweep(md.Driver("rocker0.angle", at=[1.0, 2.0], speed=3))
    problem = load(text).with_task("mine", task).with_task("last", task)
    path = tmp_path / "mechanism.toml"
    md.dump(problem, path)
    again = md.load(path)
    assert again == problem
    assert again.mechanism.gravity == (0.0, "-9.81")
    assert again.tasks["turn"].outputs is None
    assert '"rocker{k-1}.B"' in path.read_text()


def test_the_schema_knows_repetition() -> None:
    described = json.loads(json.dumps(schema()))["properties"]
    cell = described["repeat"]["additionalProperties"]["properties"]
    data = tomllib.loads(TEXT)
    assert set(data["repeat"]["loop"]) <= set(cell)
    assert described["sizes"]["additionalProperties"] == {"type": "integer"}
    joint = cell["joints"]["additionalProperties"]["oneOf"][0]["properties"]
    pattern = re.compile(joint["between"]["items"]["pattern"])
    for entry in data["repeat"]["loop"]["joints"].values():
        assert all(pattern.search(reference) for reference in entry["between"])
    assert not pattern.search("rocker{k-1.B")
    assert not pattern.search("rocker")


# -- chains of any length ------------------------------------------------------------------------


def test_the_closed_form_is_its_own_derivative() -> None:
    t, h = np.array([LONG(0.7)]), LONG(1e-6)
    lengths = [LONG(x) for x in ("0.02", "0.11", "0.05", "0.1")]
    before, here, after = (levers(t + s * h, 5, *lengths, LONG(1))[-1] for s in (-1, 0, 1))
    assert float((after[0] - before[0])[0] / (2 * h) / here[1][0]) == pytest.approx(1, abs=1e-11)
    assert float((after[1] - before[1])[0] / (2 * h) / here[2][0]) == pytest.approx(1, abs=1e-11)


@pytest.mark.parametrize(
    ("count", "changes"),
    [(1, {}), (3, {}), (3, {"r": 0.015, "b": 0.104, "c": 0.055, "d": 0.1}), (40, {})],
)
def test_a_chain_against_the_closed_form(count: int, changes: dict) -> None:
    problem = md.load(NAME).with_values({"N": count, **changes})
    task = replace(problem.tasks["turn"], poses=73, outputs=None)
    result = md.solve(problem, task)
    assert set(result.status) == {"ok"}
    values = problem.mechanism.values()
    numbers = [LONG(values[name]) for name in ("r", "b", "c", "d", "omega")]
    t = result.drivers["rocker0.angle"].position.astype(LONG)
    truth = levers(t, count, *numbers)
    scale = np.finfo(float).eps * 20 * count**2  # absolute coordinates grow with the chain
    for k, (angle, speed, bend) in enumerate(truth, start=1):
        body = result.bodies[f"rocker{k}"]
        error = np.abs(body.angle - angle).astype(float)
        assert np.all(error <= result.bound.angle)
        assert error.max() <= scale
        assert np.abs(body.angular_velocity - speed).max() <= 10 * scale * values["omega"]
        assert np.abs(body.angular_acceleration - bend).max() <= 100 * scale * values["omega"] ** 2
    swing = max(truth[-1][0]) - min(truth[-1][0])
    assert result.summary["swing"][f"rocker{count}"] >= float(swing) - scale


def test_work_grows_with_the_chain_and_no_faster() -> None:
    """Instructions of a pose and of a step per loop, buffers, and evaluations of all poses."""
    counts = []
    for loops in (12, 24, 48):
        item = chain(loops)
        setting = prepare(item.problem, replace(item.task, poses=91))
        done = run(setting, replace(item.task, poses=91))
        graphs = setting.graphs
        counts.append(
            (
                graphs.pose.n_instructions(),
                graphs.advance.n_instructions(),
                graphs.constants.n_instructions(),
                graphs.straight_pose.registers,
                done.evaluator.pose.evaluations,
                done.path.counts.steps,
            )
        )
    per_loop = np.diff(np.array(counts)[:, :3], axis=0) / np.array([[12], [24]])
    growth = per_loop[1] / per_loop[0]
    assert np.all(np.abs(growth - 1) < 0.02)
    assert len({row[3] for row in counts}) == 1
    assert len({row[4] for row in counts}) == 1
    assert len({row[5] for row in counts}) == 1


def test_the_measurement_of_chains() -> None:
    records = scaling((1, 2), poses=16, repeats=1)
    assert [record["loops"] for record in records] == [1, 2]
    for record in records:
        assert {"work", "n", "ratio", "yardstick", "error", "seconds"} <= set(record)
        assert record["not_ok"] == 0
        assert 0 <= record["error"] <= record["bound"] < 1e-12
        assert record["build_per_loop"] > 0
    assert len(table(records).splitlines()) == 3


def test_a_mechanism_error_of_a_copy_is_one_of_the_file() -> None:
    with pytest.raises(MechanismError, match=r"repeat\.loop\.joints\.C\{k\}\.friction \(k = 2\)"):
        load(small('"rocker{k}.C"]', '"rocker{k}.C"], friction = "{1-k}"'))
