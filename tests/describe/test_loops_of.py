"""Plane mechanisms written as closed vector loops: the same numbers, and loops that close."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.expression import evaluate
from mechdae.describe.file import library
from mechdae.describe.vectors.loops_in_space import joined, shortest_cycles
from mechdae.parts.types.ranking.variants import first_sweep
from tests.shared.command import run
from tests.shared.loop_checks import bodies_of, check_same, turned
from tests.shared.vector_loops import gap, nodes_of


@pytest.mark.parametrize(
    ("name", "loops"),
    [("four-bar-crank-rocker", 1), ("gorshkov-seven-link", 3), ("whitworth-quick-return", 2),
     ("toggle-clamp", 2), ("scotch-yoke", 1), ("peaucellier", 3), ("pantograph", 1),
     ("hypocycloid-drive", 1), ("sarich-engine", 8)],
)  # fmt: skip
def test_loops_have_the_numbers_of_the_bodies(name: str, loops: int) -> None:
    assert check_same(md.load(name)) == loops


def test_the_seven_link_mechanism_has_the_loops_and_modules_of_the_article(
    capsys, tmp_path
) -> None:
    file = tmp_path / "loops.toml"
    code, out, _ = run(capsys, "show", "gorshkov-seven-link", "--loops", "--out", str(file))
    assert code == 0
    assert "loop_1: ground_OG + slot - crank = 0" in out
    assert "slot: length unknown, angle that of rod" in out
    for module in ("module l of slot, α of rod_GB by loop_1",
                   "module l of guide, α of connecting_rod by loop_2",
                   "module α of coupler, α of rocker by loop_3"):  # fmt: skip
        assert module in out
    assert check_same(md.load(file)) == 3
    assert md.load(file).mechanism.closure is not None


def refused(problem: md.Problem) -> str:
    """Return why a problem is not written as loops, "" where it is."""
    try:
        md.loops_of(problem)
    except md.InputError as error:
        return str(error).splitlines()[0]
    return ""


@pytest.mark.slow
def test_all_plane_problems_can_be_written_as_loops() -> None:
    seen, open_chains, counted = set(), 0, 0
    for name in library.names():
        problem = md.load(name)
        key = repr((problem.mechanism.bodies, problem.mechanism.joints))
        if problem.mechanism.dimension != 2 or problem.mechanism.closure or key in seen:
            continue
        seen.add(key)
        why = refused(problem)
        if not why:
            counted += check_same(problem) > 0
        else:
            assert "has no loop" in why
            open_chains += 1
    assert counted >= 50
    assert open_chains >= 10


def test_random_mechanisms_as_loops() -> None:
    rng = np.random.default_rng(11)
    for count in (1, 2, 3, 4):
        assert check_same(bodies_of(rng, count)) == count


@pytest.mark.parametrize("name", ["gorshkov-seven-link", "toggle-clamp", "oscillating-cylinder"])
def test_frames_stay_as_they_were_turned(name: str) -> None:
    assert check_same(turned(md.load(name), np.random.default_rng(1))) > 0


def test_random_mechanisms_with_turned_frames_as_loops() -> None:
    rng = np.random.default_rng(5)
    for count in (1, 2, 3, 4):
        assert check_same(turned(bodies_of(rng, count), rng)) == count


def test_a_frame_is_turned_by_the_axis_of_its_vector(capsys, tmp_path) -> None:
    """The slotted link with its frame a right angle before its slot, the block as the link was."""
    text = (library.folder() / "quick-return-loops.toml").read_text(encoding="utf-8")
    file = tmp_path / "turned.toml"
    new = text.replace("rod   = { ", "rod   = { axis_deg = -90, block_axis_deg = 30, ")
    file.write_text(new.replace("rod_deg = 75", "rod_deg = 165"), encoding="utf-8")
    problem = md.load(file)
    made = problem.mechanism.joints["rod_slide"]
    assert evaluate(made.axis, {}) == pytest.approx(-np.pi / 2)
    task = first_sweep(problem)
    one, two = (md.solve(p, task, poses=5) for p in (md.load("quick-return-loops"), problem))
    for body, off in ((made.first_body, np.pi / 2), (made.second_body, -np.pi / 6)):
        angles = two.bodies[body].angle - one.bodies[body].angle
        assert angles == pytest.approx(np.full(5, off), abs=1e-12)
    file.write_text(text.replace("crank = { l", "crank = { block_axis = 1, l"), encoding="utf-8")
    code, _, err = run(capsys, "show", str(file))
    assert code == 2
    assert "a vector without a block has no 'block_axis'" in err


def test_loops_are_independent_and_short() -> None:
    cube = {f"{a}{b}": (str(a), str(b)) for a, b in
            [(0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4),
             (0, 4), (1, 5), (2, 6), (3, 7)]}  # fmt: skip
    cycles = shortest_cycles(cube, "0")
    assert [len(cycle) for cycle in cycles] == [4] * 5
    rows = [[name in {edge for edge, _ in cycle} for name in cube] for cycle in cycles]
    rank, matrix = 0, np.array(rows, int)
    for column in range(matrix.shape[1]):
        pivot = next((r for r in range(rank, len(matrix)) if matrix[r, column]), None)
        if pivot is None:
            continue
        matrix[[rank, pivot]] = matrix[[pivot, rank]]
        for r in range(len(matrix)):
            if r != rank and matrix[r, column]:
                matrix[r] ^= matrix[rank]
        rank += 1
    assert rank == 12 - 8 + 1
    eight = {"a": ("0", "1"), "b": ("1", "0"), "c": ("1", "2"), "d": ("2", "1")}
    whole = joined(shortest_cycles(eight, "0"), eight)
    assert sorted(len(cycle) for cycle in whole) == [2, 4]
    # three that meet in a row, the one between the others found last
    row = {"a": ("0", "1"), "b": ("1", "0"), "c": ("2", "3"), "d": ("3", "2"),
           "e": ("1", "4"), "f": ("4", "2"), "g": ("2", "1")}  # fmt: skip
    short = shortest_cycles(row, "0")
    assert [len(cycle) for cycle in short] == [2, 2, 3]
    loops = {str(k): [n if way else f"-{n}" for n, way in cycle]
             for k, cycle in enumerate(joined(short, row))}  # fmt: skip
    assert len(set(nodes_of(list(row), loops).values())) == 5


def test_what_is_no_loop_is_said(capsys) -> None:
    with pytest.raises(md.InputError, match="an open chain is no closed vector loop"):
        md.loops_of(md.load("double-pendulum"))
    code, _, err = run(capsys, "show", "double-pendulum", "--loops")
    assert code == 2
    assert "an open chain is no closed vector loop" in err
    loops = md.load("seven-link-loops")
    assert md.loops_of(loops) is loops


def test_vectors_close_in_all_poses() -> None:
    problem = md.loops_of(md.load("gorshkov-seven-link"))
    result = md.solve(problem, "window", poses=5)
    mechanism: Any = problem.mechanism
    closure, values = mechanism.closure, mechanism.values()
    for k in range(5):
        found = {}
        for name, vector in closure.vectors.items():
            if vector.from_ is not None:  # between two points of a body or of the ground
                tail, head = (
                    np.array([values[f"{end}.{axis}"] for axis in "xy"])
                    if end.startswith("ground.") else result.points[end].position[k]
                    for end in (vector.from_, vector.to)
                )  # fmt: skip
                found[name] = head - tail
                continue
            body, turn = closure.directions[name]
            angle = evaluate(turn, values) + (result.bodies[body].angle[k] if body else 0.0)
            length = vector.length
            if length is None:
                length = result.joints[f"{name}_slide"].slide[k]
            length = values.get(length, length) if isinstance(length, str) else length
            found[name] = length * np.array([np.cos(angle), np.sin(angle)])
        assert gap({n: list(loop) for n, loop in closure.loops.items()}, found) < 1e-12
