"""Several tasks in one sheet: what they share stands once, sets of numbers are good for all."""

from __future__ import annotations

import re
from math import cos, radians
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.draw.formulas.tree import Grid, Image, Note, Number, Section
from mechdae.errors import InputError
from tests.shared.closing import faults, passages

TEETH = {"z1": (18, 24)}


@pytest.fixture(scope="module")
def gears() -> md.Assignment:
    """Motion and forces of a pinion, an idler and a wheel, over the same turns of the pinion."""
    made = md.assign(
        "spur-gears-idler", ["turn", "bearings"], vary=TEETH, count=1, positions=3,
        transmission_angle=0.0,
    )  # fmt: skip
    return made[0]


def columns(document: Any) -> dict[str, list[float]]:
    """Return the columns of numbers by letter and index, each of which stands once."""
    found: dict[str, list[float]] = {}
    for grid in passages(document):
        if isinstance(grid, Grid) and len(grid.rows) == 3:
            for k, head in enumerate(grid.heads):
                letter = getattr(head, "parts", (head,))[0]
                numbers = [row[k].value for row in grid.rows if isinstance(row[k], Number)]
                if len(numbers) == 3 and not isinstance(letter, str):
                    name = letter.text + "".join(letter.index) + letter.mark
                    assert name not in found or name == "φ1"
                    found[name] = numbers
    return found


def test_answers_of_two_tasks(gears: md.Assignment) -> None:
    """Meshes turn speeds by numbers of teeth; the flank of a wheel bears T/(r cos alpha)."""
    assert not faults(gears.key.document)
    answers, z1 = columns(gears.key.document), gears.values["z1"]
    assert answers["ω2"] == pytest.approx([-50 * z1 / 24] * 3, abs=1e-3)
    assert answers["ω3"] == pytest.approx([50 * z1 / 45] * 3, abs=1e-3)
    assert answers["M1"] == pytest.approx([300 * z1 / 45] * 3, abs=1e-2)
    flank = 300 / (0.004 * 45 / 2 * cos(radians(20)))  # idler: no moment, the same on both sides
    for name in ("RO1", "RO3", "Rmesh12", "Rmesh23"):
        assert answers[name] == pytest.approx([flank] * 3, rel=1e-4)
    # directions of both flanks on the idler: 90 - 20 deg at the first, 60 - 90 - 20 + 180 at the
    # second one's place; the angle between them is 60 + 2 * 20 deg
    assert answers["RO2"] == pytest.approx([2 * flank * cos(radians(50))] * 3, rel=1e-4)


def test_what_tasks_share_stands_once(gears: md.Assignment) -> None:
    sheet, key = gears.sheet.document, gears.key.document
    titles = [section.title for section in sheet.sections]
    assert titles[-2:] == ["Part 1: turn", "Part 2: bearings"]
    assert [type(block) for block in passages(sheet)].count(Image) == 1
    questions = [
        str(note.parts[0])
        for section in sheet.sections[-2:]
        for note in section.sections[0].blocks
        if isinstance(note, Note)
    ]
    assert [text[:2] for text in questions] == ["1.", "2.", "3.", "4."]
    assert "without friction" in questions[3]
    assert "those of part 1" in str(sheet.sections[-1].blocks)
    for document in (sheet, key):
        first, second = document.sections[-2:]
        assert "Forces and losses" not in names_of(first)
        assert "Forces and losses" in names_of(second)
        assert "Positions" not in names_of(second)
    blanks = [block for block in passages(sheet) if isinstance(block, Grid)]
    numbers = [cell for grid in blanks for row in grid.rows for cell in row]
    assert sum(isinstance(cell, Number) for cell in numbers) == 6  # the driver's, twice
    assert list(gears.problem.tasks) == ["turn", "bearings"]
    html = gears.key.html()
    targets = re.findall(r'href="#([^"]+)"', html)
    assert targets
    assert all(f'id="{target}"' in html for target in targets)


def names_of(section: Section) -> list[str]:
    """Return the titles within a section, those of positions explained in full left out."""
    found = [inner.title for inner in section.sections]
    return found + [name for inner in section.sections[-1:] for name in names_of(inner)] + [
        inner.title for part in section.sections if part.title == "Tables to fill in"
        for inner in part.sections
    ]  # fmt: skip


def test_numbers_are_good_for_all_tasks() -> None:
    """A rod shorter than the crank swings through 30 degrees and never turns."""
    problem = md.load("slider-crank").with_task(
        "swing", md.Sweep(md.Driver("crank.angle", from_=0.0, to=radians(30)))
    )
    vary = {"l_mm": (90, 120, 30)}
    options: dict[str, Any] = {"vary": vary, "transmission_angle": 0.0, "positions": 2}
    assert len(md.assign(problem, "swing", **options)) == 2
    both = md.assign(problem, ["swing", "turn"], **options)
    assert [variant.values["l_mm"] for variant in both] == [120]
    sheet = both[0].sheet.document
    images = [block.svg for block in passages(sheet) if isinstance(block, Image)]
    assert len(set(images)) == len(images) == 2  # each task at a pose of its own
    assert "crank.angle from 0° to 30°" in str(sheet.sections[-2].blocks)
    assert "crank.angle from 0° to 360°" in str(sheet.sections[-1].blocks)


@pytest.mark.parametrize(
    ("tasks", "text"),
    [
        (["turn", "trun"], "unknown task 'trun'"),
        (["turn", "cycle", "turn"], "'turn' stands there twice"),
        (["turn", "modes"], "not modes"),
        (["cycle", "turn"], "turn asks for nothing"),
    ],
)
def test_tasks_that_are_refused(
    tasks: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word for task in tasks for word in ("--task", task)]
    target = ["--count", "1", "--positions", "2", "--out", str(tmp_path / "class")]
    bound = ["--transmission-deg", "0"]
    assert main(["assign", "spur-gears-idler", "--vary", "z1=18:24", *bound, *words, *target]) == 2
    assert text in capsys.readouterr().err
    assert not (tmp_path / "class").exists()


def test_tasks_may_be_values() -> None:
    tasks = ["turn", md.Reactions(md.Driver("pinion.angle", from_=0.0, to=1.0))]
    with pytest.raises(InputError, match="position 3"):
        md.assign("spur-gears-idler", tasks, vary=TEETH, count=1, positions=3, pose=3)
