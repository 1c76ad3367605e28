"""Explanations: every printed equation closes to its digits, in both languages, on all problems."""

from __future__ import annotations

import dataclasses
import json
import math
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.kinds import JOINTS, SPATIAL_JOINTS
from mechdae.draw.formulas.notations import plain
from mechdae.draw.formulas.tree import Equation, Formula
from mechdae.errors import InputError, UnknownName
from mechdae.parts.paper.explanations.explain import KINDS
from mechdae.parts.paper.phrases import phrases
from tests.shared.closing import count, faults, passages

PROBLEMS = sorted(path.stem for path in Path("problems").glob("*.toml"))
FEW = 7


def results() -> list[tuple[str, str]]:
    """Return the first sweep and the first task of reactions of each problem."""
    found = []
    for name in PROBLEMS:
        problem = md.load(name)
        for kind in KINDS:
            tasks = [own for own, task in problem.tasks.items() if task.kind == kind]
            found += [(name, tasks[0])] if tasks else []
    return found


def solved(name: str, task: str) -> Any:
    """Return a task with a few poses where nothing in it asks for more."""
    problem = md.load(name)
    own = problem.task(task)
    if own.kind == "reactions":
        own = dataclasses.replace(own, cycle=False)
    lawful = any(driver.law is not None for driver in own.drivers or [own.driver])
    if own.poses and own.poses > FEW and not lawful:
        own = dataclasses.replace(own, poses=FEW)
    return md.solve(problem.with_task(task, own), task)


@pytest.mark.parametrize(("name", "task"), results())
def test_equations_close_to_their_digits(name: str, task: str) -> None:
    result = solved(name, task)
    for lang in phrases("explanations"):
        told = md.explain(result, lang=lang)
        assert not faults(told.document)
        gaps = [own for own in passages(told.document) if isinstance(own, Formula)]
        for own in gaps:
            assert own.gap is None or own.gap <= 1e-9 * _size(own), plain(own.node)
        html = told.html().replace("<!doctype html>", "").replace('<meta charset="utf-8">', "")
        ElementTree.fromstring(_closed(html))
        assert json.loads(told.json())["sections"]
        assert told.typ().count("$") % 2 == 0


def _size(formula: Formula) -> float:
    """Return the largest number of a formula, one at least."""
    assert isinstance(formula.node, Equation)
    found = [1.0]
    for text in plain(formula.node).replace("−", "-").replace("(", " ").replace(";", " ").split():
        try:
            found.append(abs(float(text.rstrip(")"))))
        except ValueError:
            continue
    return max(found)


def _closed(html: str) -> str:
    """Return HTML as XML: elements without content are closed."""
    lines = []
    for line in html.splitlines():
        lines.append(line.replace('">', '"/>') if line.startswith("<meta") else line)
    return "\n".join(lines)


def test_seven_link_mechanism_as_in_its_article() -> None:
    """Numbers of the article's pose, computed to 40 digits elsewhere."""
    text = str(md.explain("gorshkov-seven-link", "pose"))
    for line in (
        "v_A3 = v_A + v^r_A3A",
        "a_A3 = a_A + a^k_A3A + a^r_A3A",
        "ω_7 = −3.1885957 rad/s",
        "ε_3 = 1.5859601 rad/s²",
        "s_slot = 0.58950000 m",
        "(0.83710; 0.47144) = (0.73848; −0.17374) + (0.09862; 0.64518) m/s",
    ):
        assert line in text
    assert count(md.explain("gorshkov-seven-link", "pose").document) == 46


def test_one_group_only() -> None:
    told = md.explain("gorshkov-seven-link", "pose", group="II.1")
    assert [section.title for section in told.document.sections] == ["Group II.1 RRR(6,7)"]


def test_loads_act_as_the_file_says() -> None:
    """A force in the frame of its body, a weight, a torque: wrenches about the body's origin."""
    data: dict[str, Any] = {
        "schema": 1,
        "gravity": [0.0, -9.81],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {
            "bar": {
                "points": {"O": [0, 0], "B": [2, 0]},
                "mass": 3.0,
                "center": [0.5, 0.0],
                "inertia": 0.1,
            }
        },
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "bar.O"]}},
        "loads": {
            "push": {"kind": "force", "point": "bar.B", "value": [0, 5], "frame": "bar"},
            "twist": {"kind": "torque", "body": "bar", "value": -2.0},
        },
        "tasks": {
            "hold": {
                "kind": "reactions",
                "driver": {"coordinate": "bar.angle", "at_deg": [90], "speed": 0.0},
            }
        },
    }
    result = md.solve(from_dict(data), "hold")
    assert result.loads["push"]["bar"][0] == pytest.approx([-5.0, 0.0, 10.0], abs=1e-14)
    assert result.loads["twist"]["bar"][0] == pytest.approx([0.0, 0.0, -2.0])
    assert result.loads["gravity"]["bar"][0] == pytest.approx([0.0, -29.43, 0.0], abs=1e-14)
    assert "M_1" in str(md.explain(result))


@pytest.mark.parametrize(
    "name", ["rssr", "rssp", "double-wishbone", "wobble-plate", "cardan-joint"]
)
def test_newton_and_euler_in_space(name: str) -> None:
    """Reactions of six components close with m a and J e + w x J w of the accelerations."""
    data = tomllib.loads(Path(f"problems/{name}.toml").read_text(encoding="utf-8"))
    data.pop("expected", None)
    task = next(own for own in data["tasks"].values() if own["kind"] == "sweep")
    turning = set(md.solve(name).bodies)
    for k, (body, own) in enumerate(data["bodies"].items()):
        if body in turning:
            own |= {"mass": 0.5 + k, "center": [0.01, -0.02, 0.03]}
            own["inertia"] = [4e-3, 5e-3, 6e-3, 1e-3, -5e-4, 3e-4]
    data["gravity"] = [0.3, -0.4, -9.81]
    data["tasks"] = {"forces": {"kind": "reactions", "driver": task["driver"], "poses": 5}}
    told = md.explain(md.solve(from_dict(data), "forces"), pose=2)
    assert not faults(told.document)
    closed = [own for own in passages(told.document) if isinstance(own, Formula)]
    sums, powers = ([own for own in closed if own.unit == unit] for unit in ("N", "W"))
    lost = "do not determine the reactions" in told.text()
    assert lost or len(sums) >= len(turning)
    for own in (*sums, *powers):
        assert own.gap is not None
        assert own.gap <= 1e-11 * _size(own)
    assert len(powers) == 1


def test_the_speed_of_a_cardan_shaft() -> None:
    """w cos(d) / (1 - sin^2(f) sin^2(d)) of the textbooks, at f = 70 degrees, cos(d) = 4/5."""
    text = md.explain("cardan-joint", "turn", pose=70).text()
    speed = 10 * 0.8 / (1 - math.sin(math.radians(70)) ** 2 * 0.6**2)
    assert f"θ̇_E = {speed:.6f} rad/s" in text
    assert "ω_2 = ω_1 + θ̇_U·e_U + θ̇_U,2·e_U,2" in text
    assert "ω_2 = θ̇_E·e_E" in text


def test_friction_is_named_with_its_sense() -> None:
    text = " ".join(str(md.explain("quick-return-friction", "cycle", pose=40)).split())
    assert "friction torque" in text
    assert "against the relative rotation" in text
    assert "against the sliding" in text
    assert "P_drivers + P_loads + P_inertia + P_friction = 0" in text


def test_wheels_follow_willis() -> None:
    """The planetary gear: (w1 - wH) = -(z2/z1) (w2 - wH)."""
    told = md.explain("planetary-gear-loads", "loads")
    assert "ω_1,3 = i·ω_2,3 = −0.75000·(−95.238) = 71.429 rad/s" in str(told)


def test_superfluous_constraints_are_said() -> None:
    text = str(md.explain("five-crank-parallelogram", "loads"))
    assert "do not determine the reactions of" in text


def test_languages_have_the_same_words() -> None:
    extra = {*JOINTS, *SPATIAL_JOINTS, "vector"}
    assert set(phrases("explanations")["ru"]) - extra == set(phrases("explanations")["en"]) - extra
    assert "Скорости" in str(md.explain("slider-crank", "turn", lang="ru"))


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"pose": 400}, InputError, "there is no pose 400"),
        ({"lang": "de"}, UnknownName, "language"),
        ({"group": "III"}, UnknownName, "group"),
    ],
)
def test_what_is_refused(options: dict[str, Any], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        md.explain("slider-crank", "turn", **options)


def test_tasks_that_are_refused() -> None:
    with pytest.raises(InputError, match="not modes"):
        md.explain("slider-crank", "modes")
    with pytest.raises(InputError, match="jammed"):
        md.explain("jamming-drawer", "corner")


def test_poses_that_do_not_assemble() -> None:
    problem = md.load("gorshkov-seven-link")
    result = md.solve(problem.with_values({"phi1": 1.2217}), "pose")
    with pytest.raises(InputError, match="unassembled"):
        md.explain(result)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from mechdae.cli import main

    target = tmp_path / "told.html"
    assert main(["explain", "slider-crank", "--format", "html", "--out", str(target)]) == 0
    assert target.read_text(encoding="utf-8").startswith("<!doctype html>")
    capsys.readouterr()
    assert main(["explain", "slider-crank", "--out", str(tmp_path / "no" / "told.txt")]) == 2
    assert "no" in capsys.readouterr().err
    assert main(["explain", "slider-crank", "--out", str(tmp_path)]) == 2
    assert f"{tmp_path}: is a folder" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["told.html"]
    assert main(["explain", "slider-crank", "--group", "II.9"]) == 2
    assert "II.2 RRP" in capsys.readouterr().err
