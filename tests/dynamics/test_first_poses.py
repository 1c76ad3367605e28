"""All tasks of a file begin on one assembly mode, the one nearest to the sketch."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.load import load as load_file
from mechdae.dynamics.rest.all_equilibria import Rests
from mechdae.dynamics.sketch import AssembledSketch
from mechdae.errors import SketchError
from tests.attack import first_poses
from tests.shared import begun_cases
from tests.shared.paths import DATA

STARTS = DATA / "starts"


SKETCHED = 1
"""Side of the line between its outer pins at which the sketched coupler has its inner one."""


def four_bar(theta: float, side: int) -> tuple[float, float]:
    """Angles of coupler and rocker of the four-bar of the data: two circles cross."""
    B = 1.06 * np.exp(1j * theta)
    way = 1.33 - B
    along = (abs(way) ** 2 + 1.31**2 - 1.08**2) / (2 * abs(way) ** 2)
    across = math.sqrt(1.31**2 / abs(way) ** 2 - along**2)
    C = B + (along + side * 1j * across) * way
    return float(np.angle(C - B)), float(np.angle(C - 1.33))


def begun_as_swept() -> None:
    """The four-bar sketched 16 degrees from one mode: motions began on the farther one."""
    problem = load_file(STARTS / "four-bar.toml")
    theta = math.radians(21)
    wanted = four_bar(theta, SKETCHED)
    other = four_bar(theta, -SKETCHED)
    assert abs(wanted[0] - math.radians(20)) < 0.3 < abs(other[0] - math.radians(20))
    assert np.degrees(wanted) == pytest.approx([4.561865, 26.6285822], abs=1e-6)
    for task in ("pose", "go"):
        result = md.solve(problem, task)
        found = [result.bodies[body].angle[0] for body in ("coupler", "rocker")]
        assert found == pytest.approx(wanted, abs=1e-12)
        assert result.summary["mode"] == "-"


def test_a_motion_begins_where_the_sweep_does() -> None:
    begun_as_swept()


def test_the_old_start_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: Newton's method from the sketch, wherever it leads."""
    monkeypatch.setattr(AssembledSketch, "pose", lambda self, rough: None)
    with pytest.raises(AssertionError):
        begun_as_swept()


def test_an_equilibrium_is_looked_for_from_the_same_pose() -> None:
    """The crank's angle is stationary in height on the sketched branch, by own differences."""
    result = md.solve(STARTS / "four-bar.toml", "rest")
    theta = float(result.bodies["crank"].angle[0])

    def height(angle: float) -> float:
        coupler, rocker = four_bar(angle, SKETCHED)
        crank = 1.06 * math.sin(angle)
        return 0.5 * (math.sin(angle) + math.sin(coupler) + math.sin(rocker)) + crank

    slope = (height(theta + 1e-5) - height(theta - 1e-5)) / 2e-5
    assert result.bodies["coupler"].angle[0] == pytest.approx(
        four_bar(theta, SKETCHED)[0], abs=1e-9
    )
    assert abs(slope) < 1e-8
    assert (result.summary["mode"], result.summary["sketched_mode"]) == ("-", True)


@pytest.mark.parametrize(
    ("name", "place"),
    [("cam-roller", math.sqrt(0.06**2 - 0.02**2)), ("cam", -math.sqrt(0.05**2 - 0.02**2))],
)
def test_a_roller_does_not_start_inside_of_its_disc(name: str, place: float) -> None:
    problem = load_file(STARTS / f"{name}.toml")
    for task in ("pose", "go"):
        found = md.solve(problem, task).points["follower.P"].position[0]
        assert found == pytest.approx([0, place], abs=1e-12)


@pytest.mark.parametrize("name", ["cam-roller", "cam"])
def test_equilibria_that_are_whole_turns_apart_are_one(name: str) -> None:
    """The centre of the disc above or below its bearing: two, not two for each turn."""
    result = md.solve(STARTS / f"{name}.toml", "rest")
    angles = sorted(own["coordinates"]["cam.angle"] for own in result.summary["equilibria"])
    assert np.cos(angles) == pytest.approx([0, 0], abs=1e-9)
    assert sorted(np.sin(angles)) == pytest.approx([-1, 1], abs=1e-9)
    assert result.summary["all_equilibria"] is True


def sprung(k: float) -> md.Result:
    """A rod of 1 kg and 0.1 m on a weak torsion spring, at rest."""
    data = {
        "schema": 1, "gravity": [0, -9.81], "ground": {"points": {"O": [0, 0]}},
        "bodies": {"rod": {"points": {"O": [0, 0]}, "mass": 1, "center": [0.1, 0]}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "rod.O"]}},
        "loads": {"twist": {"kind": "spring", "coordinate": "rod.angle", "stiffness": k}},
        "sketch": {"rod": 0.3}, "tasks": {"rest": {"kind": "equilibrium"}},
    }  # fmt: skip
    return md.solve(from_dict(data), "rest")


def turns_told() -> None:
    k = 0.08
    grid = np.linspace(-15, 15, 30001)
    force = k * grid + 0.981 * np.cos(grid)  # all zeros have |angle| <= 0.981/k
    zeros = grid[:-1][force[:-1] * force[1:] < 0]
    found = [own["coordinates"]["rod.angle"] for own in sprung(k).summary["equilibria"]]
    assert len(zeros) > 5
    assert sorted(found) == pytest.approx(zeros, abs=1e-3)


def test_a_torsion_spring_tells_turns_apart() -> None:
    """The circuit ended after one turn, and all beyond were left out without a word."""
    turns_told()


def test_turns_taken_for_one_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Rests, "_equal", lambda *_: True)
    with pytest.raises(AssertionError):
        turns_told()


def test_a_sketch_that_does_not_tell_is_refused_by_all() -> None:
    """The crank alone is sketched: the coupler lies on either side."""
    problem = load_file(STARTS / "four-bar.toml")
    mechanism = problem.mechanism.__class__(
        ground=problem.mechanism.ground, bodies=problem.mechanism.bodies,
        joints=problem.mechanism.joints, gravity=problem.mechanism.gravity,
        sketch={"crank": math.radians(21)},
    )  # fmt: skip
    for task in problem.tasks.values():
        with pytest.raises(SketchError, match="does not tell which assembly mode"):
            md.solve(mechanism, task)


def test_modes_that_differ_by_a_slide_are_told_apart() -> None:
    """Sketches offered of modes left slots out, files of designs all slides."""
    assert begun_cases.slotted() < 1


def test_a_design_forgets_the_rough_sketch_it_comes_from() -> None:
    assert begun_cases.told_twice() < 1


def test_a_motion_whose_joints_are_all_sketched_begins_at_its_driver() -> None:
    assert begun_cases.all_joints_told() < 1


def test_two_links_between_balls_about_a_cross_assemble() -> None:
    """Newton's method found two solutions of four, both with a pin turned back."""
    assert begun_cases.two_balls_and_a_cross() < 1


# -- random mechanisms, a sample of the script -------------------------------------------------

SEEDS = [0, 1, 2, 3, 4, 6, 7, 9, 11, 14]


@pytest.mark.parametrize("seed", SEEDS)
def test_tasks_of_random_mechanisms_begin_at_one_pose(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    family = first_poses.FAMILIES[seed % len(first_poses.FAMILIES)]
    monkeypatch.setattr(first_poses, "SETS", 1)
    monkeypatch.setattr(first_poses, "MOST", 1)
    assert not any(itertools.chain(*first_poses.examine(seed, family)))


def test_a_driven_turn_of_a_slot_is_sketched_beside_its_slide() -> None:
    """The file of a design tells both: with the slide alone it assembled on another mode."""
    assert not any(text for sketches in first_poses.examine(420, "dyads")[:2] for text in sketches)
