"""Mechanisms that do not close: drawn open, the gap as in closed form, and what is too short."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.diagram.scene import read_scene
from tests.shared.command import run

GAP = """
schema = 1
[ground]
points = { K = [0, 0], R = [2.0, 0] }
[bodies.barrel]
points = { K = [0, 0] }
[bodies.rod]
points = { P = [0, 0] }
[bodies.arm]
points = { R = [0, 0], P = [0.5, 0] }
[joints]
K = { kind = "revolute", between = ["ground.K", "barrel.K"] }
cyl = { kind = "prismatic", between = ["barrel.K", "rod.P"] }
P = { kind = "revolute", between = ["arm.P", "rod.P"] }
R = { kind = "revolute", between = ["ground.R", "arm.R"] }
[sketch]
barrel_deg = 10
arm_deg = 120
[tasks.s]
kind = "sweep"
driver = { coordinate = "cyl.slide", at = [1.0] }
"""


def four_bar(a: float, b: float, c: float, d: float, crank: float, sketch=(0.3, 2.0)) -> md.Problem:
    mechanism = md.Mechanism(
        md.Ground({"A": [0, 0], "D": [d, 0]}),
        [
            md.Body("crank", {"A": [0, 0], "B": [a, 0]}),
            md.Body("rod", {"B": [0, 0], "C": [b, 0]}),
            md.Body("rocker", {"D": [0, 0], "C": [c, 0]}),
        ],
        [
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={"crank": crank, "rod": sketch[0], "rocker": sketch[1]},
    )
    return md.Problem(mechanism, {"t": md.Sweep(md.Driver("crank.angle", at=[crank]))})


def blamed(entries) -> dict[str, float]:
    return {own["what"]: own["by"] for own in entries}


@pytest.mark.parametrize("seed", range(40))
def test_the_gap_of_a_dyad_is_that_of_the_triangle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-6, 3)
    while True:
        a, b, c, d = rng.uniform(0.2, 1.0, 4)
        crank, *sketch = rng.uniform(-np.pi, np.pi, 3)
        far = float(np.hypot(d - a * np.cos(crank), a * np.sin(crank)))
        gap = max(far - (b + c), abs(b - c) - far)
        if gap > 0.01 and far > 0.05:
            break
    problem = four_bar(*(scale * x for x in (a, b, c, d)), crank, sketch)
    with pytest.raises(md.AssemblyError):
        md.solve(problem, "t")
    result = md.open_pose(problem)
    (own,) = result.summary["open"]
    assert own["gap"] == pytest.approx(scale * gap, rel=1e-9)
    assert own["joint"] == "C"
    assert np.hypot(*np.subtract(own["to"], own["from"])) == pytest.approx(own["gap"], rel=1e-9)
    short, long_ = blamed(result.summary["too_short"]), blamed(result.summary["too_long"])
    if far > b + c:
        assert {"rod B-C", "rocker C-D"} <= set(short)
        assert not {"rod B-C", "rocker C-D"} & set(long_)
    else:
        longer, shorter = ("rod B-C", "rocker C-D") if b > c else ("rocker C-D", "rod B-C")
        assert longer in long_
        assert shorter in short
    for name in ("rod B-C", "rocker C-D"):
        assert (short | long_)[name] == pytest.approx(scale * gap, rel=1e-6)
    # all other joints are closed
    at = {name: series.position[0] for name, series in result.points.items()}
    assert at["crank.B"] == pytest.approx(at["rod.B"], abs=1e-9 * scale)
    assert at["rocker.D"] == pytest.approx([scale * d, 0.0], abs=1e-9 * scale)
    turn = result.bodies["rocker"].angle[0]
    along = scale * c * np.array([np.cos(turn), np.sin(turn)])
    assert at["rocker.C"] - at["rocker.D"] == pytest.approx(along, rel=1e-9, abs=1e-9 * scale)


def test_a_rod_that_does_not_reach_its_guide() -> None:
    mechanism = md.Mechanism(
        md.Ground({"O": [0, 0], "G": [0, -0.5]}),
        [
            md.Body("crank", {"O": [0, 0], "B": [0.1, 0]}),
            md.Body("rod", {"B": [0, 0], "C": [0.3, 0]}),
            md.Body("slider", {"C": [0, 0]}),
        ],
        [
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("B", "crank.B", "rod.B"),
            md.Revolute("C", "rod.C", "slider.C"),
            md.Prismatic("guide", "ground.G", "slider.C"),
        ],
        sketch={"crank": 0.0, "rod": -1.0, "guide": 0.2},
    )
    task = md.Sweep(md.Driver("crank.angle", at=[0.0]))
    result = md.open_pose(md.Problem(mechanism, {"t": task}))
    (own,) = result.summary["open"]
    assert own["gap"] == pytest.approx(0.2, rel=1e-9)
    assert blamed(result.summary["too_short"])["rod B-C"] == pytest.approx(0.2, rel=1e-9)
    assert own["from"][0] == pytest.approx(0.1, abs=1e-9)  # straight down


def test_a_cylinder_that_is_too_short(tmp_path: Path) -> None:
    """The pivots are 2 m apart, cylinder and arm together reach 1.5 m."""
    path = tmp_path / "gap.toml"
    path.write_text(GAP)
    result = md.open_pose(path)
    (own,) = result.summary["open"]
    assert (own["joint"], own["unit"]) == ("P", "m")
    assert own["gap"] == pytest.approx(0.5, rel=1e-12)
    assert set(blamed(result.summary["too_short"])) == {"arm P-R", "cyl.slide"}
    assert set(blamed(result.summary["too_long"])) == {"ground K-R"}


def test_what_closes_is_not_opened() -> None:
    with pytest.raises(md.SolveError, match="closes at this pose"):
        md.open_pose("four-bar-crank-rocker")


def test_both_ends_and_the_gap_are_drawn() -> None:
    result = md.open_pose(four_bar(0.1, 0.15, 0.12, 0.5, 1.5))
    ax = md.plot(result)
    found = {str(own.get_gid()): own for own in ax.get_children() if own.get_gid()}
    (own,) = result.summary["open"]
    assert found["gap-C"].get_xydata() == pytest.approx(np.array([own["from"], own["to"]]))
    pins = [own.get_center() for own in ax.patches if own.get_gid() == "open-C"]
    assert np.array(sorted(pins)) == pytest.approx(np.array(sorted([own["from"], own["to"]])))
    letters = {text.get_text() for text in ax.texts}
    assert {"C", "2", "3"} <= letters  # C2 of the rod, C3 of the rocker
    assert "label-rod.C" in found
    assert "label-rocker.C" in found
    words = " ".join(letters)
    assert f"C open by {1e3 * own['gap']:.3g} mm" in words
    assert "does not close" in found["subtitle"].get_text()
    assert "too short: " in found["note"].get_text()
    assert read_scene(result).open == {"C"}
    low, high = ax.get_xlim()
    assert all(low < x < high for x, _ in pins)


def test_the_command_draws_it_and_fails(tmp_path: Path, capsys) -> None:
    path = tmp_path / "gap.toml"
    path.write_text(GAP)
    for more in ([], ["--kind", "diagram", "--dark"], ["--kind", "curves"]):
        code, said, err = run(capsys, "plot", str(path), "--out", str(tmp_path), *more)
        assert code == 1
        drawn = Path(said.strip())
        assert drawn.name == "gap-s-open.svg"
        assert 'id="gap-P"' in drawn.read_text()
        assert "cannot be assembled" in err
        assert "drawn open at P by 0.5 m; too short: arm P-R, cyl.slide" in err
        drawn.unlink()
    code, said, _ = run(capsys, "plot", str(path), "--out", str(tmp_path), "--format", "png")
    assert (code, Path(said.strip()).suffix) == (1, ".png")


def test_a_pose_of_a_sweep_that_does_not_assemble(tmp_path: Path, capsys) -> None:
    """Beyond its limit a double rocker stays open by what the links lack."""
    problem = four_bar(0.3, 0.12, 0.15, 0.35, 0.5, (0.9, 1.9))
    task = md.Sweep(md.Driver("crank.angle", from_=0.5, to=2.0), poses=7)
    problem = problem.with_task("t", task)
    result = md.solve(problem, "t")
    lost = int(np.flatnonzero(result.status == "unassembled")[0])
    angle = result.drivers["crank.angle"].position[lost]
    far = np.hypot(0.35 - 0.3 * np.cos(angle), 0.3 * np.sin(angle))
    found = md.open_pose(problem, "t", result=result, pose=lost)
    assert found.summary["open"][0]["gap"] == pytest.approx(far - 0.27, rel=1e-9)
    assert found.drivers["crank.angle"].position[0] == angle
    path = tmp_path / "rocker.toml"
    md.dump(problem, path)
    words = ["plot", str(path), "--pose", str(lost), "--out", str(tmp_path)]
    code, said, _ = run(capsys, *words)
    assert code == 1
    assert Path(said.strip()).name == f"rocker-t-open-{lost}.svg"
