"""Vectors of closed loops over diagrams: they meet head to tail, given ones are told apart."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.vectors.loops_of import LoopVectors, drawn_vectors
from mechdae.draw import style
from tests.shared.command import run
from tests.shared.predefined import predefined

LOOPS = {
    "gorshkov-seven-link": 3, "seven-link-loops": 3, "scotch-yoke": 1, "jansen-leg": 3,
    "sarich-engine": 8, "hypocycloid-drive": 1, "elliptic-trammel": 1, "quick-return-loops": 1,
    "spatial-slider-crank-loops": 1,
}  # fmt: skip


def placed(result: md.Result, vectors: LoopVectors, k: int) -> dict[str, np.ndarray]:
    """Return the vectors of a pose by the points of the result and of the ground."""
    values = result.mechanism.values()

    def place(point: str) -> np.ndarray:
        if point.startswith("ground."):
            return np.array([values[f"{point}.{axis}"] for axis in result.mechanism.axes])
        return np.asarray(result.points[point].position[k])

    return {name: place(head) - place(tail) for name, (tail, head) in vectors.ends.items()}


def first_task(problem: md.Problem) -> str:
    return next(name for name, task in problem.tasks.items() if task.kind in ("sweep", "reactions"))


@pytest.mark.parametrize("name", LOOPS)
def test_vectors_meet_head_to_tail(name: str) -> None:
    problem = predefined(name)
    task = first_task(problem)
    poses = 5 if getattr(problem.tasks[task], "poses", None) else None
    result = md.solve(problem, task, poses=poses)
    vectors = drawn_vectors(problem.mechanism)
    assert len(vectors.loops) == LOOPS[name]
    for k in np.flatnonzero(np.array(result.status) == "ok"):
        spans = placed(result, vectors, k)
        size = max(float(np.linalg.norm(span)) for span in spans.values())
        for loop in vectors.loops.values():
            signs = [-1 if entry[0] == "-" else 1 for entry in loop]
            total = sum(s * spans[e.lstrip("-")] for s, e in zip(signs, loop, strict=True))
            assert np.abs(total).max() <= 1e-12 * size


def test_vectors_and_loops_are_drawn_with_what_is_given() -> None:
    result = md.solve(predefined("gorshkov-seven-link"), "pose")
    axes = md.plot(result, "loops")
    lines = {line.get_gid(): line for line in axes.lines}
    drawn = {name: lines[f"vector-{name}"] for name in drawn_vectors(result.mechanism).vectors}
    colors = {name: line.get_color() for name, line in drawn.items()}
    assert {name for name, color in colors.items() if color == style.ARROW} == {"crank"}
    still = {"ground_OG", "ground_OF", "guide"}
    assert {name for name, color in colors.items() if color == style.GROUND} == still
    dashed = {name for name, line in drawn.items() if line.is_dashed()}
    assert dashed == {"slot", "guide"}
    texts = {text.get_gid(): text.get_text() for text in axes.texts}
    legend = [text for gid, text in texts.items() if str(gid).startswith("legend-")]
    assert [text for text in legend if text.endswith("= 0")] == [
        "I:  1 + 2 − 3 = 0", "II:  1 + 4 + 5 − 6 = 0", "III:  1 + 4 + 7 − 8 − 9 = 0",
    ]  # fmt: skip
    assert {f"loop-{k}" for k in ("I", "II", "III")} <= set(lines)
    # slot and rod lie in one line: they are drawn side by side
    one, two = (np.array(drawn[name].get_xydata()) for name in ("slot", "rod_GB"))
    along = (two[1] - two[0]) / np.hypot(*(two[1] - two[0]))
    offset = one - two[0]
    apart = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0])
    assert apart.min() > 0.002


def test_loops_in_space_and_in_russian() -> None:
    result = md.solve(predefined("spatial-slider-crank-loops"), "turn", poses=9)
    axes = md.plot(result, "loops", lang="ru", dark=True, view=(-60, 25))
    texts = {text.get_text() for text in axes.texts}
    assert {"длина неизвестна", "2  rod", "I:  1 + 2 − 3 − 4 = 0"} <= texts


def test_a_mechanism_without_a_loop_is_refused(capsys, tmp_path) -> None:
    code, _, err = run(capsys, "plot", "double-pendulum", "--kind", "loops", "--out", str(tmp_path))
    assert code == 2
    assert "an open chain is no closed vector loop" in err
