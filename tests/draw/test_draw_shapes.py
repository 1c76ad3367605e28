"""Shapes of small motions: displacements of bodies as in closed form, and their animation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import mechdae as md
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.swinging import TRAVEL, TURN, swinging
from tests.shared.command import run

PENDULUM = """
schema = 1
title = "Two point masses on rods"
gravity = [0, -9.81]
[ground]
points = { O = [0, 0] }
[bodies.upper]
points = { O = [0, 0], A = [0.5, 0] }
mass = 2
center = [0.5, 0]
inertia = 0
[bodies.lower]
points = { A = [0, 0], T = [0.5, 0] }
mass = 2
center = [0.5, 0]
inertia = 0
[joints]
O = { kind = "revolute", between = ["ground.O", "upper.O"] }
A = { kind = "revolute", between = ["upper.A", "lower.A"] }
[sketch]
upper_deg = -88
lower_deg = -93
[tasks.rest]
kind = "equilibrium"
free = ["upper.angle", "lower.angle"]
linearise = true
[tasks.plain]
kind = "equilibrium"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "two.toml"
    path.write_text(PENDULUM)
    return path


def test_bodies_move_as_the_shape_says(file: Path) -> None:
    """Of equal masses and lengths the lower angle is sqrt(2) and -sqrt(2) times the upper one."""
    modes = md.solve(file, "rest").summary["modes"]
    frequencies = np.sqrt(9.81 / 0.5 * np.array([2 - np.sqrt(2), 2 + np.sqrt(2)])) / (2 * np.pi)
    assert [mode["frequency"] for mode in modes] == pytest.approx(frequencies, rel=1e-9)
    for mode, ratio in zip(modes, (np.sqrt(2), -np.sqrt(2)), strict=True):
        upper, lower = mode["bodies"]["upper"], mode["bodies"]["lower"]
        assert lower["angle"][0] / upper["angle"][0] == pytest.approx(ratio, rel=1e-7)
        assert upper["angle"] == pytest.approx(mode["shape"]["upper.angle"], abs=1e-9)
        assert (upper["x"][0], upper["y"][0]) == pytest.approx((0.0, 0.0), abs=1e-9)
        # the lower rod hangs on the end of the upper one: 0.5 m below, it goes sideways
        assert lower["x"][0] == pytest.approx(0.5 * upper["angle"][0], rel=1e-7)
        assert lower["y"][0] == pytest.approx(0.0, abs=1e-7)


def test_poses_of_a_shape(file: Path) -> None:
    result = md.solve(file, "rest")
    for number in (1, 2):
        moving = swinging(result, number, 24)
        angles = np.array([moving.bodies[body].angle for body in ("upper", "lower")])
        rest = np.full(2, -np.pi / 2)
        assert angles[:, -1] == pytest.approx(rest, abs=1e-7)  # the last one is the rest
        assert angles[:, :12] - rest[:, None] == pytest.approx(
            -(angles[:, 12:24] - rest[:, None]), abs=1e-7
        )
        assert np.abs(angles - rest[:, None]).max() <= TURN * (1 + 1e-9)
        scene = read_scene(moving)
        tip = scene.track("lower.T")
        assert np.hypot(*(tip - tip[-1]).T).max() <= 1.1 * TRAVEL * 1.0  # 1 m long
        apart = scene.track("upper.A") - scene.track("lower.A")
        assert np.hypot(*apart.T).max() < 1e-9  # links of small motions keep together


def test_the_animation_of_a_shape(file: Path, tmp_path: Path, capsys) -> None:
    moving = md.plot(md.solve(file, "rest"), "animation", shape=2, frames=6)
    assert (len(moving), moving.closed) == (6, True)
    assert "shape 2 of 2" in moving.subtitle
    assert "Hz" in moving.subtitle
    assert moving.ghosts == (6,)
    words = ["plot", str(file), "--kind", "animation", "--frames", "4", "--out", str(tmp_path)]
    for task in ("rest", "plain"):  # the command asks for small motions itself
        code, said, _ = run(capsys, *words, "--task", task, "--shape", "2", "--lang", "ru")
        path = Path(said.strip())
        assert (code, path.name) == (0, f"two-{task}-animation-shape-2.gif")
        with Image.open(path) as picture:
            assert picture.n_frames == 4
    code, said, _ = run(capsys, *words)
    assert (code, Path(said.strip()).name) == (0, "two-rest-animation.gif")


def test_what_has_no_shape(file: Path) -> None:
    with pytest.raises(md.InputError, match="no shapes of small motions") as told:
        md.plot(md.solve(file, "plain"), "animation")
    assert told.value.hint == "linearise = true"
    result = md.solve(file, "rest")
    for wrong in (0, 3, True, 1.5):
        with pytest.raises(md.InputError, match="there is no shape") as told:
            md.plot(result, "animation", shape=wrong)
        assert "from 1 to 2" in told.value.hint
    with pytest.raises(md.InputError, match="equilibrium"):
        md.plot(md.solve("four-bar-crank-rocker", "turn", poses=5), "animation", shape=1)


def test_a_shape_that_does_not_swing_goes_to_and_fro(file: Path) -> None:
    for name in ("upper", "A"):
        oil = f'kind = "spring"\ncoordinate = "{name}.angle"\ndamping = 200\n'
        file.write_text(file.read_text() + f"[loads.oil_{name}]\n{oil}")
    result = md.solve(file, "rest")
    still = [k for k, own in enumerate(result.summary["modes"], 1) if not own["eigenvalue"][1]]
    moving = md.plot(result, "animation", shape=still[0], frames=5)
    assert not moving.closed
    assert moving.poses == (0, 1, 2, 3, 4, 3, 2, 1)
    assert "1/s" in moving.subtitle
    away = np.abs(moving.result.bodies["upper"].angle[:5] - moving.result.bodies["upper"].angle[5])
    assert (np.diff(away) < 0).all()
