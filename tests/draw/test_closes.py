"""What is drawn closes: results read back are drawn as they were, torn ones are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.tasks.goals import Maximise
from mechdae.draw import save
from mechdae.draw.figure import svg_text
from mechdae.errors import InputError
from mechdae.tasks.export import folder
from tests.shared.job_cases import FOUR_BAR
from tests.shared.mechanisms import four_bar
from tests.shared.scheme_cases import BEAN

KEPT = (
    ("slider-crank", "turn", ("diagram", "curves", "coupler", "plans")),
    ("four-bar-crank-rocker", "modes", ("diagram",)),
    ("slider-crank-friction", "cycle", ("diagram", "curves", "losses", "plans")),
    ("pendulum-dry-torque", None, ("diagram", "curves")),
    ("cam-roller-follower", None, ("diagram", "curves")),
    ("rssr", None, ("diagram", "curves")),
    ("double-pendulum", "rest", ("diagram",)),
)
"""Sweep, modes, reactions, motion, cam, space, equilibrium; of each what is drawn."""


def drawn(result: Any, kind: str, **options: Any) -> str:
    text = svg_text(md.plot(result, kind, **options))
    plt.close("all")
    return text


def back(result: Any, folder: Path) -> Any:
    md.save(result, folder)
    return md.read(folder)[result.task]


@pytest.mark.parametrize(("name", "task", "kinds"), KEPT)
def test_what_is_read_back_is_drawn_as_it_was(
    name: str, task: str | None, kinds: tuple[str, ...], tmp_path: Path
) -> None:
    problem = md.load(name)
    result = md.solve(problem, task)
    again = back(result, tmp_path)
    for kind in kinds:
        assert drawn(again, kind) == drawn(result, kind), kind


def test_numbers_that_were_set_are_kept(tmp_path: Path) -> None:
    """The mechanism of a result is the one that was solved, not that of its file."""
    changed = {"a_mm": 35.0}
    result = md.solve("four-bar-crank-rocker", set=changed)
    solver = md.Solver("four-bar-crank-rocker", vary=["a"])
    for k, own in enumerate((result, solver(a=0.035))):
        again = back(own, tmp_path / str(k))
        assert drawn(again, "diagram") == drawn(own, "diagram")
        crank = own.points["crank.B"].position - own.points["crank.A"].position
        assert np.hypot(*crank.T) == pytest.approx(0.035, rel=1e-12)
        assert again.mechanism.values()["a"] == 0.035


@pytest.fixture(scope="module")
def designs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    result = md.synthesize("c5-ellipse10-free", starts=12)
    return result, back(result, tmp_path_factory.mktemp("designs"))


def test_designs_of_a_folder_are_drawn_with_their_own_dimensions(designs: tuple[Any, Any]) -> None:
    result, again = designs
    count = len(result.data["designs"])
    assert count > 1
    for k in range(count):
        assert drawn(again, "design", design=k) == drawn(result, "design", design=k)
    for entry in again.data["designs"]:  # the links are as long as the design says
        motion, own = again.motions[entry["problem"]].whole, entry["parameters"]
        for body, (one, other), length in (
            ("crank", ("A0", "A"), "r2"), ("coupler", ("A", "B"), "r3"),
            ("rocker", ("B0", "B"), "r4"),
        ):  # fmt: skip
            ends = [motion.points[f"{body}.{point}"].position for point in (one, other)]
            assert np.hypot(*(ends[1] - ends[0]).T) == pytest.approx(own[length], rel=1e-9)
        assert motion.mechanism.values()["r2"] == own["r2"]


def test_the_mechanism_of_the_file_in_the_pose_of_a_design_is_refused(
    designs: tuple[Any, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planted: the motions of designs are read with the mechanism of the task."""
    result, _ = designs
    made = folder._made
    monkeypatch.setattr(folder, "_made", lambda own, file, _: made(own, file, result.mechanism))
    torn = back(result, tmp_path)
    with pytest.raises(InputError, match="does not close"):
        drawn(torn, "design")


@pytest.mark.parametrize("seed", range(12))
def test_gaps_that_are_seen_are_refused(seed: int) -> None:
    """Poses of one mechanism with a number of another: half a pixel decides."""
    random = np.random.default_rng(seed)
    a, b, c, d = 0.3, *random.uniform([0.8, 0.7, 0.8], [1.0, 0.9, 1.0])
    mechanism = four_bar(a, b, c, d, coupler=0.6, rocker=1.4)
    driver = md.Driver("crank.angle", at=(float(random.uniform(0, 6)),))
    result = md.solve(mechanism, md.Sweep(driver))
    drawn(result, "diagram")
    name = str(random.choice(["crank.B.x", "coupler.C.x", "rocker.C.x", "ground.D.x"]))
    sheet = md.plot(result, "diagram")
    pixel = float(np.ptp(sheet.get_xlim())) / sheet.get_window_extent().width
    plt.close("all")
    for share, torn in ((0.3, False), (0.8, True)):
        length = mechanism.values()[name] + share * pixel
        other = replace(result, mechanism=mechanism.with_values({name: length}))
        if torn:
            with pytest.raises(InputError, match="does not close"):
                drawn(other, "diagram")
        else:
            drawn(other, "diagram")


def test_points_of_fronts_and_schemes_are_drawn_as_they_were(tmp_path: Path) -> None:
    file = tmp_path / "arc.toml"
    file.write_text(FOUR_BAR.replace("poses = 73", 'poses = 73\nmeasures = ["transmission"]'))
    problem = md.load(file)
    task: Any = problem.tasks["design"]
    least = Maximise(of="turn/joints/B/transmission_angle")
    front = replace(task, goal=None, objectives=(task.goal, least), starts=3, keep=3)
    result = md.synthesize(problem.with_task("design", front))
    again = back(result, tmp_path / "front")
    assert drawn(again, "front") == drawn(result, "front")
    for k in range(len(result.data["designs"])):
        assert drawn(again, "design", design=k) == drawn(result, "design", design=k)
    file.write_text(BEAN)
    result = md.synthesize(file)
    again = back(result, tmp_path / "bean")
    for kind in ("front", "sheet"):
        assert drawn(again, kind) == drawn(result, kind)


@pytest.mark.parametrize(("name", "number"), [("rssr", "coupler"), ("double-wishbone", "upper")])
def test_gaps_in_space_are_refused(name: str, number: str) -> None:
    result = md.solve(name)
    drawn(result, "diagram")
    values = result.mechanism.values()
    body = number if number in result.mechanism.bodies else next(iter(result.mechanism.bodies))
    own = next(
        f"{body}.{point}.{axis}"
        for point in list(result.mechanism.body(body).points)[1:] for axis in "xyz"
        if values[f"{body}.{point}.{axis}"]
    )  # fmt: skip
    other = replace(result, mechanism=result.mechanism.with_values({own: 1.3 * values[own]}))
    with pytest.raises(InputError, match="does not close"):
        drawn(other, "diagram")


def test_open_poses_are_drawn_on_request(tmp_path: Path) -> None:
    """A mechanism that does not assemble is drawn with its gap, which the picture names."""
    mechanism = four_bar(0.3, 0.2, 0.2, 1.0, coupler=0.1, rocker=3.0)
    problem = md.Problem(mechanism, {"turn": md.Sweep(md.Driver("crank.angle", at=(0.5,)))})
    save(md.plot(md.open_pose(problem), "diagram"), tmp_path / "open.svg")
    assert (tmp_path / "open.svg").stat().st_size > 1000
