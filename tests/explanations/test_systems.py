"""Linear systems and closed forms of positions: solved again from what is printed."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.draw.formulas.notations import plain
from mechdae.draw.formulas.tree import Column, Equation, Formula, Grid, Matrix, Product
from tests.shared.closing import faults, passages


def formulas(told: Any) -> list[Formula]:
    return [own for own in passages(told.document) if isinstance(own, Formula)]


def printed_systems(told: Any) -> list[tuple[Any, Any, Any]]:
    """Return matrix, right side and solution of each system, as printed."""
    found = []
    for first, second in pairwise([own.node for own in formulas(told)]):
        match first, second:
            case (
                Equation((Product((Matrix(rows), Matrix() as names)), Column() as right)),
                Equation((Matrix() as again, Column() as sizes)),
            ) if names == again:
                matrix = [[cell.value for cell in row] for row in rows]  # type: ignore[attr-defined]
                found.append((np.array(matrix), np.array(right.values), np.array(sizes.values)))
    return found


def test_systems_of_the_article_have_its_solutions() -> None:
    """Article 000 prints 0.536, 0.429; 0.934, 1.657; 0.893, 0.232; 0.932, 0.621 and so on.

    Its a_C, v_E and what follows are off by slips, so those are solved here once more.
    """
    told = md.explain("gorshkov-seven-link", "pose")
    assert all((own.gap or 0.0) < 1e-12 for own in formulas(told))
    systems = printed_systems(told)
    assert len(systems) == 6
    for matrix, right, sizes in systems:
        assert np.linalg.solve(matrix, right) == pytest.approx(sizes, rel=1e-3)
    size = [sorted(np.abs(sizes).round(3).tolist()) for _, _, sizes in systems]
    assert size[0] == [0.429, 0.536]
    assert size[1] == pytest.approx([0.934, 1.657], abs=1.1e-3)
    assert size[2] == pytest.approx([0.232, 0.893], abs=1e-3)
    text = told.text()
    for line in ("= −0.64926 m", "= 0.41582 m²", "= −1.1733 m", "= −1.9809", "= 0.13668 m²"):
        assert line in text  # p, q, a, b and P of the article: -0.649, 0.416, -1.173, -1.98, 0.137


def test_tables_have_no_empty_cell() -> None:
    for lang, heads in (("en", "angle with x"), ("ru", "угол с осью x")):
        told = md.explain("gorshkov-seven-link", "pose", lang=lang)
        grids = [own for own in passages(told.document) if isinstance(own, Grid)]
        assert len(grids) == 12
        for grid in grids:
            assert grid.heads[2:5] == (heads, "x", "y")
            for row in grid.rows:
                cells = [cell if isinstance(cell, str) else plain(cell) for cell in row]
                assert all(cells)
                size, angle, x, y = (
                    float(
                        re.sub("[^0-9.,-]", "", c.replace("−", "-").split("·")[0]).replace(",", ".")
                    )
                    for c in cells[1:5]
                )
                turn = np.deg2rad(angle)
                assert [x, y] == pytest.approx(
                    size * np.array([np.cos(turn), np.sin(turn)]), abs=2e-4
                )


def slider(angle: float, turn: float, offset: float, back: bool) -> dict[str, Any]:
    """Return a crank with a rod on a slider whose pin is beside its guide."""
    sketch = {"crank": 0.7, "rod": angle + (2.6 if back else -0.4) - turn}
    return mechanism(
        {
            "crank": {"O": [0, 0], "A": [0.1, 0.02]},
            "rod": {"A": [0, 0], "B": [0.4 * np.cos(turn), 0.4 * np.sin(turn)]},
            "slider": {"S": [0, 0], "B": [0.01, offset]},
        },
        {
            "O": ("revolute", "ground.O", "crank.O", {}),
            "A": ("revolute", "crank.A", "rod.A", {}),
            "B": ("revolute", "rod.B", "slider.B", {}),
            "guide": ("prismatic", "ground.O", "slider.S", {"axis": angle}),
        },
        sketch,
    )


def swing(axis: float, turn: float, offset: float, back: bool) -> dict[str, Any]:
    """Return a crank whose block slides on a link beside its pivot."""
    sketch = {"crank": 0.7, "link": 1.2 - axis + (np.pi if back else 0.0)}
    return mechanism(
        {
            "crank": {"O": [0, 0], "A": [0.1, 0.02]},
            "block": {"A": [0, 0], "S": [0.02, 0.03]},
            "link": {"G": [0, 0], "Q": [0.0, offset], "P": [0.3, 0.1]},
        },
        {
            "O": ("revolute", "ground.O", "crank.O", {}),
            "A": ("revolute", "crank.A", "block.A", {}),
            "slot": ("prismatic", "link.Q", "block.S", {"axis": axis, "turn": turn}),
            "G": ("revolute", "ground.G", "link.G", {}),
        },
        sketch,
    )


def mechanism(bodies: Any, joints: Any, sketch: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "ground": {"points": {"O": [0, 0], "G": [0.05, -0.25]}},
        "bodies": {name: {"points": points} for name, points in bodies.items()},
        "joints": {
            name: {"kind": kind, "between": [first, second], **more}
            for name, (kind, first, second, more) in joints.items()
        },
        "sketch": sketch,
        "tasks": {
            "pose": {
                "kind": "sweep",
                "driver": {
                    "coordinate": "crank.angle",
                    "at": [0.7],
                    "speed": 3.0,
                    "acceleration": 2.0,
                },
                "derivatives": 2,
            }
        },
    }


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("offset", [0.0, 0.03, -0.04])
@pytest.mark.parametrize("turn", [0.0, 0.8, -2.0])
@pytest.mark.parametrize("make", [slider, swing])
def test_closed_forms_end_in_the_pose(make: Any, turn: float, offset: float, back: bool) -> None:
    """Offsets of pins and guides, both assemblies, lines that are not the axes of their links."""
    told = md.explain(md.solve(from_dict(make(0.3, turn, offset, back)), "pose"))
    assert not faults(told.document)
    assert len(printed_systems(told)) == 2
    angles = [own for own in formulas(told) if plain(own.node).startswith("φ_")]
    assert angles
    for own in angles:
        assert own.gap is not None
        assert own.gap < 1e-12
    for matrix, right, sizes in printed_systems(told):
        solved = np.linalg.solve(matrix, right)
        assert solved == pytest.approx(sizes, abs=2e-3 * np.abs(sizes).max())
