"""Forces in the terminal: what is printed of a task of reactions, and what `show` says of it.

Numbers come from the data set of article 003 (40 digits, energy balance closed to 1e-21) and
from closed forms of the slider-crank with friction in its guide alone.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.results.tables import table
from mechdae.results.tables.text import WIDE, fact

CRANK = """
schema = 1

[parameters]
r = 0.1
l = 0.3
f = 0.1
f_slide = 0.12
Q_work = 1000.0
Q_return = 200.0
omega = 10.0

[ground]
points = { O = [0, 0] }
[bodies.crank]
points = { O = [0, 0], B = ["r", 0] }
[bodies.rod]
points = { B = [0, 0], C = ["l", 0] }
[bodies.slider]
points = { C = [0, 0] }

[joints]
O     = { kind = "revolute", between = ["ground.O", "crank.O"], friction = "f", pin_radius = 0.02 }
B     = { kind = "revolute", between = ["crank.B", "rod.B"], friction = "f", pin_radius = 0.015 }
C     = { kind = "revolute", between = ["rod.C", "slider.C"], friction = "f", pin_radius = 0.01 }
slide = { kind = "prismatic", between = ["ground.O", "slider.C"], friction = "f_slide" }

[sketch]
crank_deg = 60
rod_deg = -15

[loads.work]
kind = "resistance"
coordinate = "slide.slide"
negative = "Q_work"
positive = "Q_return"
"""

CENTRED = """
[loads.spring]
kind = "spring"
between = ["ground.O", "crank.B"]
stiffness = 1e3
preload = 0.1
"""
"""A spring along the crank: it presses on the pin in O, its power is rounding."""

JAM = """
schema = 1

[parameters]
r = 0.09
l = 0.10
f = 0.6
F = 100.0

[ground]
points = { O = [0, 0] }
[bodies.crank]
points = { O = [0, 0], B = ["r", 0] }
[bodies.rod]
points = { B = [0, 0], C = ["l", 0] }
[bodies.slider]
points = { C = [0, 0] }

[joints]
O     = { kind = "revolute",  between = ["ground.O", "crank.O"] }
B     = { kind = "revolute",  between = ["crank.B", "rod.B"] }
C     = { kind = "revolute",  between = ["rod.C", "slider.C"] }
guide = { kind = "prismatic", between = ["ground.O", "slider.C"], friction = "f" }

[sketch]
crank_deg = 45
rod_deg = -40

[loads.push]
kind = "force"
point = "slider.C"
value = ["-F", 0]
"""


def load(text: str, folder: Path, name: str = "mine") -> md.Problem:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return md.load(path)


def turn(speed: float = 10.0, **keys: object) -> md.Reactions:
    driver = md.Driver("crank.angle", from_=0.0, to="2*pi", speed=speed)
    return md.Reactions(driver=driver, **keys)


def at(*degrees: float, speed: float = 10.0, **keys: object) -> md.Reactions:
    values = tuple(math.radians(angle) for angle in degrees)
    return md.Reactions(driver=md.Driver("crank.angle", at=values, speed=speed), **keys)


def lines(result: md.Result) -> list[str]:
    """Return the lines of a table; none but titles and names is wider than the terminal."""
    text = table(result).rstrip("\n").split("\n")
    assert all(len(line) <= WIDE for line in text[1:]), max(text[1:], key=len)
    return text


def line(text: list[str], start: str) -> str:
    """Return the only line that starts like this, the lines that go on below it joined."""
    (place,) = [k for k, own in enumerate(text) if own.startswith(start)]
    found = text[place]
    for own in text[place + 1 :]:
        if not own.startswith(" " * 12):
            break
        found += " " + own.strip()
    return found


def numbers(text: str) -> list[float]:
    return [float(n) for n in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]\d+)?(?!\w)", text)]


# -- a row for each pose ---------------------------------------------------------------------------


def test_rows_show_efforts_losses_and_reactions(tmp_path: Path) -> None:
    result = md.solve(load(CRANK, tmp_path), at(30, 60, 90))
    text = lines(result)
    titles = re.split(r"  +", text[1].strip())
    assert titles == [
        "status", "crank.angle [deg]", "effort [N m]", "no friction [N m]", "loss [W]",
        "|O| [N]", "|B| [N]", "|C| [N]",
    ]  # fmt: skip
    row = text[3].split()
    assert row[0] == "ok"
    shown = [float(cell) for cell in row[1:]]
    truth = [60, 109.87320990514, 101.678107607332, 81.9510229780802]
    truth += [1087.65640016506] * 3
    assert shown == pytest.approx(truth, rel=5e-6)
    assert "8 of 9 columns" in text[5]


def test_rows_without_friction_show_every_reaction(tmp_path: Path) -> None:
    text = lines(md.solve(load(CRANK, tmp_path), at(30, 60, friction="none")))
    assert re.split(r"  +", text[1].strip())[2:] == [
        "effort [N m]", "|O| [N]", "|B| [N]", "|C| [N]", "slide N [N]",
    ]  # fmt: skip
    row = [float(cell) for cell in text[3].split()[1:]]
    assert row[2:] == pytest.approx([1044.46593573419] * 3 + [-301.511344577764], rel=5e-6)
    assert line(text, "  friction") == "  friction  left out"


def test_parts_and_named_points_have_columns(tmp_path: Path) -> None:
    text = CRANK.replace("C = [0, 0] }\n\n[joints]", "C = [0, 0] }\nmass = 2.0\n\n[joints]")
    problem = load(text, tmp_path)
    shown = lines(md.solve(problem, at(30, 60, friction="none", parts=("static", "inertial"))))
    assert "static [N m]  inertial [N m]" in shown[1]
    effort, static, inertial = (float(cell) for cell in shown[3].split()[2:5])
    assert effort == pytest.approx(static + inertial, rel=1e-5)
    assert static == pytest.approx(101.678107607332, rel=5e-6)
    assert "slider.C" not in shown[1]
    shown = lines(md.solve(problem, at(30, 60, friction="none", outputs=("slider.C", "slide"))))
    assert "slider.C.x [m]" in shown[1]
    assert "|O|" not in shown[1]


def test_named_outputs_and_efforts_come_before_reactions(tmp_path: Path) -> None:
    text = CRANK + '\n[outputs]\nlean = "rod.angle"\nspeed = "slide.slide.speed"\n'
    problem = load(text, tmp_path)
    titles = re.split(r"  +", lines(md.solve(problem, at(30, 60, friction="none")))[1].strip())
    assert titles[2:5] == ["lean [deg]", "speed [m/s]", "effort [N m]"]
    assert titles[5:] == ["|O| [N]", "|B| [N]", "|C| [N]"]
    listed = lines(md.solve(problem, at(30, 60, outputs=("speed", "O"))))[1]
    assert re.split(r"  +", listed.strip())[2:4] == ["speed [m/s]", "effort [N m]"]


def test_rounding_is_shown_as_nothing(tmp_path: Path) -> None:
    """The guide of an in-line slider carries nothing at the dead points."""
    result = md.solve(load(CRANK, tmp_path), at(0, 180, friction="none"))
    assert 0 < np.abs(result.joints["slide"].normal).max() < 1e-9
    text = lines(result)
    assert [row.split()[-1] for row in text[2:4]] == ["0", "0"]
    idle = load(CRANK + CENTRED, tmp_path)
    result = md.solve(idle, at(10, 50, 200), set={"Q_work": 0.0, "Q_return": 0.0})
    assert 0 < np.abs(result.parts["uncoupled"]["crank.angle"]).max() < 1e-13
    assert [row.split()[3] for row in lines(result)[2:5]] == ["0", "0", "0"]


# -- a single pose ---------------------------------------------------------------------------------


def test_one_pose_has_a_line_for_each_quantity(tmp_path: Path) -> None:
    text = lines(md.solve(load(CRANK, tmp_path), at(60, axes=("radial",))))

    def shown(part: str, name: str) -> str:
        (found,) = [own for own in text if re.match(rf"  {part} +{re.escape(name)} ", own)]
        return found.split(name, 1)[1]

    assert shown("crank.angle", "effort").split() == ["109.873209905", "N", "m"]
    assert shown("crank.angle", "effort_uncoupled").split() == ["101.678107607", "N", "m"]
    assert numbers(shown("O", "reaction")) == pytest.approx(
        [-1038.7124112995459, 322.60342749621609, -2.1645171366683115], rel=1e-8
    )
    assert shown("O", "reaction").endswith("N m")
    assert numbers(shown("O", "|reaction|")) == pytest.approx([1087.65640016506], rel=1e-9)
    assert numbers(shown("slide", "normal")) == pytest.approx([-322.603427496216], rel=1e-9)
    assert numbers(shown("B", "loss")) == pytest.approx([19.059834045716], rel=1e-9)
    assert shown("B", "loss").endswith(" W")
    assert numbers(shown("slide", "loss_uncoupled")) == pytest.approx([36.7885235265711], rel=1e-9)
    assert numbers(shown("slide", "reaction_uncoupled"))[:2] == pytest.approx([0, -301.511344578])
    assert shown("B", "reaction_radial").endswith(") N")
    assert not any("slider.C" in own for own in text)


# -- cycle, jams, several solutions ----------------------------------------------------------------


def test_cycle_shows_powers_efficiencies_and_losses(tmp_path: Path) -> None:
    text = lines(md.solve(load(CRANK, tmp_path), turn(cycle=True, poses=13)))
    assert "  status    13 ok" in text
    cycle = line(text, "  cycle")
    assert numbers(cycle) == pytest.approx(
        [418.768772928588, 381.971863420549, 36.7969095080391, 0.912130722520912,
         10, 0.907399965025289, 0.915248002919152], rel=5e-6,
    )  # fmt: skip
    for words in ("input 418", "useful 381", "loss 36", "efficiency 0.912", "(10) 0.907"):
        assert words in cycle
    place = text.index("  losses    [W]    with feedback  without feedback")
    table_of = {
        own.split()[0]: [float(v) for v in own.split()[1:]] for own in text[place + 1 :][:5]
    }
    truth = {
        "O": [12.6573419747, 12.2946044025],
        "B": [9.49508260569, 9.22095330185],
        "C": [1.34777865653, 1.31724376582],
        "slide": [13.2967062711, 12.537806442],
        "all": [36.7969095080391, 35.3706079120983],
    }
    assert list(table_of) == list(truth)
    for name, values in truth.items():
        assert table_of[name] == pytest.approx(values, rel=5e-6), name
    checks = line(text, "  checks")
    assert len(numbers(checks)) == 3
    assert max(numbers(checks)) < 1e-12
    assert "long guide" in line(text, "  assumes   joint slide")
    assert line(text, "  assumes   massless") == "  assumes   massless: crank, rod, slider"


def test_article_shows_one_column_of_losses(tmp_path: Path) -> None:
    task = turn(cycle=True, poses=13, friction="article", friction_radius="article")
    text = lines(md.solve(load(CRANK, tmp_path), task))
    assert "  losses    [W]    without feedback" in text
    assert "friction circles r f" in line(text, "  friction")
    assert "efficiency 0.907102" in line(text, "  cycle")


def test_self_locking_arcs_are_in_degrees(tmp_path: Path) -> None:
    task = turn(cycle=True, poses=13, direction="load")
    problem = load(CRANK.replace("Q_return = 200.0", "Q_return = 1000.0"), tmp_path)
    found = line(lines(md.solve(problem, task)), "  self-lock")
    ends = [1.85325010277072, 177.149345823584]
    ends += [360 - end for end in reversed(ends)]
    assert numbers(found) == pytest.approx([0, *ends, 360], rel=5e-6)
    both = lines(md.solve(problem, turn(cycle=True, poses=13, direction="both")))
    assert line(both, "  self-lock") == found
    assert both.index("  reverse   resistances push along the motion") < len(both)
    assert [own.startswith("  cycle") for own in both].count(True) == 2


LEAN = 0.9 / math.sqrt(1 - 0.81)
"""tan of the rod's angle with the crank square to the guide."""


def test_jammed_arcs_and_poses_with_the_critical_factor(tmp_path: Path) -> None:
    """The guide jams where f tan(beta) > 1."""
    problem = load(JAM, tmp_path)
    result = md.solve(problem, turn(speed=-1, poses=73, cycle=True))
    text = lines(result)
    assert "  status    59 ok, 7 ambiguous, 7 jammed" in text
    assert line(text, "  cycle").startswith("  cycle     no mean powers with friction: it jams")
    first = math.degrees(math.asin(1 / (0.9 * math.hypot(1, 0.6))))
    jam = line(text, "  jammed")
    assert numbers(jam) == pytest.approx([first, 180 - first, 1 / (0.6 * LEAN), 90], rel=5e-6)
    assert "no equilibrium with friction, proven, by joint guide; " in jam
    place = re.search(r"jammed for crank\.angle from ([\d.]+) deg to ([\d.]+) deg", result.fault)
    assert [float(v) for v in place.groups()] == pytest.approx([first, 180 - first], rel=5e-6)
    assert line(text, "  ambiguous 255") == (
        "  ambiguous 255 deg .. 285 deg (7 poses): 2 solutions, proven; given is the one that "
        "continues from no friction"
    )
    row = next(own for own in text if own.split()[:2] == ["jammed", "80"])
    assert row.split()[2] == "-"
    assert float(row.split()[3]) < 0
    alone = lines(md.solve(problem, at(80, 90, 100, speed=-1)))
    assert line(alone, "  jammed    80").startswith(
        "  jammed    80 deg .. 100 deg (3 poses): no equ"
    )
    assert "(at 90 deg)" in line(alone, "  jammed    80")


def test_a_jam_names_the_joint_whose_friction_matters(tmp_path: Path) -> None:
    """The force in thin pins is larger than that on the guide, their friction plays no part."""
    text = JAM.replace(
        '"crank.B", "rod.B"]', '"crank.B", "rod.B"], friction = 0.1, pin_radius = 1e-5'
    )
    problem = load(text, tmp_path)
    (entry,) = md.solve(problem, at(90, speed=-1)).summary["jammed"]
    assert entry["joint"] == "guide"
    assert entry["critical_factor"] == pytest.approx(1 / (0.6 * LEAN), rel=1e-3)


def test_one_pose_lists_all_solutions(tmp_path: Path) -> None:
    text = lines(md.solve(load(JAM, tmp_path), at(270, speed=-1)))
    assert "  2 solutions, proven" in text
    found = [own for own in text if "effort, solution" in own]
    assert [numbers(own.split("solution")[1])[1] for own in found] == pytest.approx(
        [9 / (1 + 0.6 * LEAN), 9 / (1 - 0.6 * LEAN)], rel=1e-10
    )
    assert [own.endswith("continues from no friction") for own in found] == [True, False]


def test_many_arcs_are_cut(tmp_path: Path) -> None:
    driver = md.Driver("crank.angle", from_=0.0, to="40*pi", speed=-1)
    text = lines(md.solve(load(JAM, tmp_path), md.Reactions(driver=driver, poses=241)))
    assert len([own for own in text if own.startswith("  jammed    ") and "deg" in own]) == 12
    assert "  jammed    8 more" in text


def test_arcs_along_a_law_are_in_time(tmp_path: Path) -> None:
    driver = md.Driver("crank.angle", law="pi/4 + 0.25*t", from_=0.0, to=4.0)
    result = md.solve(
        load(JAM.replace('["-F", 0]', '["F", 0]'), tmp_path),
        md.Reactions(driver=driver, poses=9, cycle=True),
    )
    text = lines(result)
    if not result.summary["jammed_arcs"]:
        pytest.fail("the law does not meet the jam")
    first = math.asin(1 / (0.9 * math.hypot(1, 0.6)))
    low, high = numbers(line(text, "  jammed    t ="))[:2]
    assert [low, high] == pytest.approx([4 * (first - math.pi / 4), 4.0], rel=5e-6)
    assert "jammed for t [s] from" in result.fault


def test_exit_code_of_a_jam(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = JAM + '\n[tasks.jam]\nkind = "reactions"\n'
    text += 'driver = { coordinate = "crank.angle", at_deg = [90], speed = -1 }\n'
    load(text, tmp_path)
    assert main(["solve", str(tmp_path / "mine.toml")]) == 1
    out, err = capsys.readouterr()
    assert "status                                  jammed" in out
    assert "0.807204 times the friction given" in err


# -- what turned up on the way ---------------------------------------------------------------------


def test_a_cycle_without_useful_work_has_no_formula_10(tmp_path: Path) -> None:
    """A constant force gives back over the turn what it took: rounding is no power."""
    problem = load(JAM, tmp_path)
    for friction in ("coupled", "article"):
        task = turn(speed=-1, poses=13, cycle=True, friction=friction)
        result = md.solve(problem, task, set={"f": 0.1})
        assert result.fault is None
        summary = result.summary
        assert "efficiency_formula_10" not in summary
        assert "efficiency_uncoupled" not in summary
        assert summary["useful"] == 0
        assert summary["loss_by_joint_uncoupled"]["guide"] > 0.1
        assert summary.get("efficiency", 0) == 0
        assert "useful 0 W" in line(lines(result), "  cycle")


def test_loads_that_do_no_work_do_not_lock_themselves(tmp_path: Path) -> None:
    """A spring along the crank keeps its length: the signs of its power are rounding."""
    problem = load(CRANK + CENTRED, tmp_path)
    values = {"Q_work": 0.0, "Q_return": 0.0, "crank.B.y": 0.03}
    result = md.solve(problem, turn(cycle=True, poses=13), set=values)
    assert result.summary["loss"] > 1
    assert result.summary["self_locking_arcs"] == []


def test_joints_without_coordinates_have_reactions() -> None:
    """A gear has neither angle nor slide of its own; its reaction is the force of the mesh."""
    problem = md.load("planetary-gear-train")
    driver = next(
        task.driver for task in problem.tasks.values() if isinstance(task, md.Sweep) and task.driver
    )
    result = md.solve(problem, md.Reactions(driver=replace(driver, at=(0.1,), from_=None, to=None,
                                                           range=None)))  # fmt: skip
    gears = [n for n, joint in problem.mechanism.joints.items() if joint.kind == "gear"]
    assert gears
    assert set(gears) <= set(result.joints)
    assert result.joints.get("nobody") is None


def test_reactions_that_are_not_unique() -> None:
    mechanism = md.load("parallelogram-three-cranks").mechanism
    loaded = replace(mechanism, loads={"weight": md.Torque("weight", "crank", 5.0)})
    several = md.solve(loaded, at(50, 60))
    names = several.summary["not_unique"]
    assert names
    text = lines(several)
    assert line(text, "  not unique") == f"  not unique reactions of {', '.join(names)}"
    assert not any(f"|{name}|" in text[1] for name in names)
    single = lines(md.solve(loaded, at(60)))
    for name in names:
        assert any(re.fullmatch(rf"  {name} +reaction +not unique", own) for own in single)
    assert any(re.match(r"  \w+ +reaction, unique +\S+ N along \(", own) for own in single)
    sums = several.summary["unique_sums"]
    assert len(sums) == len([own for own in single if own.startswith("  unique")]) > 0


def test_facts_are_wrapped() -> None:
    text = fact("assumes", "word " * 40)
    assert len(text) == 3
    assert all(len(own) <= WIDE for own in text)
    assert text[0].startswith("  assumes   word")
    assert text[1].startswith(" " * 12 + "word")


# -- show ------------------------------------------------------------------------------------------


def show(text: str, folder: Path, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    load(text, folder)
    assert main(["show", str(folder / "mine.toml"), *options]) == 0
    return capsys.readouterr().out


def task_text(**keys: str) -> str:
    text = '\n[tasks.cycle]\nkind = "reactions"\n'
    text += 'driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed = "omega" }\n'
    return text + "".join(f"{key} = {value}\n" for key, value in keys.items())


def test_show_says_what_is_built(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = show(CRANK + task_text(cycle="true", parts='["static"]'), tmp_path, capsys)
    assert out.split("tasks\n")[1].splitlines() == [
        "  cycle: reactions, 361 poses, positions + velocities + accelerations, "
        "1 unknowns in blocks [1]",
        "    efforts of crank.angle; reactions of O, B, C, slide",
        "    loads: work (resistance)",
        "    friction (coupled) O, B, C: r sin(atan f) |R|; slide: f |N|",
        "    parts of efforts and reactions: static",
        "    cycle: mean powers, losses, efficiency; arcs that jam or lock themselves",
    ]


def test_show_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = CRANK.replace('"f_slide" }', '"f_slide", contact_length = 0.1 }')
    text = text.replace('friction = "f", pin_radius = 0.01 }', "friction = 0, pin_radius = 0.01 }")
    text += task_text(friction='"article"', friction_radius='"article"')
    data = json.loads(show(text, tmp_path, capsys, "--json"))["tasks"]["cycle"]
    assert data["forces"] == {
        "efforts": ["crank.angle"],
        "reactions": ["O", "B", "C", "slide"],
        "loads": {"work": "resistance"},
        "masses": [],
        "massless": ["crank", "rod", "slider"],
        "direction": "driver",
        "quasi_static": False,
        "friction": {"O": "r f |R|", "B": "r f |R|", "slide": "f max(|N|, |M|/b)"},
        "coupled": False,
    }
    assert data["builds"] == ["positions", "velocities", "accelerations"]


def test_show_names_nothing_that_is_not_built(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = CRANK.replace("[joints]", "mass = 2.0\n\n[joints]").replace(
        "schema = 1", "schema = 1\ngravity = [0, -9.81]"
    )
    keys = {"friction": '"none"', "direction": '"load"', "outputs": '["crank"]'}
    out = show(text + task_text(**keys), tmp_path, capsys)
    assert "friction" not in out
    assert "cycle: mean" not in out
    assert "    loads: work (resistance), gravity" in out
    assert "    masses: slider" in out
    assert "    resistances turned round, along the motion" in out


def test_the_template_of_forces_is_computed(capsys: pytest.CaptureFixture[str], tmp_path) -> None:
    """Over a turn useful power is the work of the resistance: both ways of the slider, 2 r each."""
    assert main(["new", "slider-crank-forces"]) == 0
    problem = load(capsys.readouterr().out, tmp_path)
    results = {name: md.solve(problem, name) for name in problem.tasks}
    assert all(result.fault is None for result in results.values())
    p = problem.mechanism.values()
    work = 2 * p["r"] * (p["F_work"] + p["F_back"])
    useful = results["cycle"].summary["useful"]
    assert useful == pytest.approx(work * p["omega"] / (2 * math.pi), rel=1e-9)
