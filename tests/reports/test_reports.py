"""Reports: what is in them, that their numbers close, the same bytes each time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.draw.formulas.tree import Grid, Number
from mechdae.errors import InputError, UnknownName
from mechdae.parts.paper.phrases import phrases
from tests.shared.closing import faults, passages


@pytest.fixture(scope="module")
def made() -> Any:
    return md.report("slider-crank-inertia", "cycle")


def grid_with(report: Any, head: str) -> Grid:
    """Return the table with a column of that letter."""
    for own in passages(report.document):
        if isinstance(own, Grid) and any(head in str(entry) for entry in own.heads[1:]):
            return own
    raise AssertionError(head)


def last_with(grid: Grid, head: str) -> int:
    """Return the place of the last column of that letter."""
    return max(k for k, entry in enumerate(grid.heads) if head in str(entry))


def printed(grid: Grid, column: int) -> list[float]:
    cells = [row[column] for row in grid.rows]
    return [own.value for own in cells if isinstance(own, Number)]


def test_sections_and_sums(made: Any) -> None:
    titles = [section.title for section in made.document.sections]
    assert titles == [
        "Assignment",
        "Kinematic diagram",
        "Structure",
        "Position 1 in full",
        "Positions",
        "Forces and losses",
        "Plans. Curves",
        "Checks and bounds of the error",
    ]
    assert not faults(made.document)


def test_twelve_positions_and_analogues_of_a_slider_crank(made: Any) -> None:
    """Closed form: x = r cos f + sqrt(l^2 - r^2 sin^2 f), its derivatives by f."""
    r, length = 0.1, 0.3
    phi = np.deg2rad(30.0 * np.arange(12))
    root = np.sqrt(length**2 - (r * np.sin(phi)) ** 2)
    x = r * np.cos(phi) + root
    first = -r * np.sin(phi) - r**2 * np.sin(phi) * np.cos(phi) / root
    grid = grid_with(made, "'slide',), mark='', vector=False), UnitName(text='m')")
    assert len(grid.rows) == 12
    assert printed(grid, 1) == pytest.approx(np.rad2deg(phi), abs=0.006)
    assert printed(grid, 3) == pytest.approx(x, abs=1e-5)
    grid = grid_with(made, "mark='′'")
    assert printed(grid, last_with(grid, "mark='′'")) == pytest.approx(first, abs=1e-5)
    grid = grid_with(made, "mark='′′'")
    rod = np.arcsin(-r * np.sin(phi) / length)
    bend = -r * np.cos(phi) / (length * np.cos(rod))
    second = -r * np.cos(phi) - length * (np.cos(rod) * bend**2 + np.sin(rod) * _bend2(phi))
    assert printed(grid, last_with(grid, "mark='′′'")) == pytest.approx(second, abs=1e-5)


def _bend2(phi: Any) -> Any:
    """Return the second derivative of the rod's angle: sin b = -q sin f, q = r/l."""
    q = 1 / 3
    s, c = np.sin(phi), np.cos(phi)
    cosine = np.sqrt(1 - (q * s) ** 2)
    return q * s / cosine - q**3 * s * c**2 / cosine**3


def test_the_file_is_whole_and_the_same_each_time(made: Any, tmp_path: Path) -> None:
    one, other = made.save(tmp_path / "a.html"), made.save(tmp_path / "b.html")
    text = one.read_text(encoding="utf-8")
    assert text == other.read_text(encoding="utf-8")
    assert (
        text.count("<img") == 8
    )  # diagram, groups apart, two plans, forces of two groups, curves, losses
    assert not re.search(r"https?://(?!www\.w3\.org)", text)
    assert "<script" not in text
    assert {path.name for path in tmp_path.iterdir()} == {"a.html", "b.html"}


def test_a_pdf_is_the_same_each_time(made: Any, tmp_path: Path) -> None:
    pytest.importorskip("typst", reason="a PDF needs the package typst")
    one, other = made.save(tmp_path / "a.pdf"), made.save(tmp_path / "b.pdf")
    assert one.read_bytes()[:5] == b"%PDF-"
    assert one.read_bytes() == other.read_bytes()


def test_russian_and_limit_positions() -> None:
    """The seven-link mechanism from limit to limit: rates of the first position are not known."""
    report = md.report("gorshkov-seven-link", "window", positions=4, lang="ru")
    assert report.document.sections[0].title == "Задание"
    assert not faults(report.document)
    grid = grid_with(report, "'ω'")
    assert [own == "–" for own in grid.rows[0][1:]] == [True] * (len(grid.heads) - 1)
    assert set(phrases("reports")["ru"]) == set(phrases("reports")["en"])
    assert report.typ().startswith("#set document")


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"positions": 0}, InputError),
        ({"positions": 1000}, InputError),
        ({"lang": "de"}, UnknownName),
        ({"task": "modes"}, InputError),
    ],
)
def test_what_is_refused(options: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        md.report("slider-crank", **options)


def test_the_command_refuses_files_before_it_computes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", "slider-crank", "--out", str(tmp_path / "a.docx")]) == 2
    assert ".html .typ .pdf" in capsys.readouterr().err
    assert main(["report", "slider-crank", "--out", str(tmp_path / "no" / "a.html")]) == 2
    assert "no such folder" in capsys.readouterr().err
    target = tmp_path / "a.typ"
    command = ["report", "slider-crank", "--positions", "1", "--pose", "5", "--out", str(target)]
    assert main(command) == 2
    assert "there is no position 5" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_plans_stand_beside_the_position_that_they_explain(made: Any) -> None:
    """In the explanation too, drawn when its HTML is wanted; sections are linked from the top."""
    place = next(own for own in made.document.sections if own.title == "Position 1 in full")
    assert [image.caption[:8] for image in place.beside] == ["Plan of ", "Plan of "]
    text = made.html()
    for k in range(1, len(made.document.sections) + 1):
        assert f'href="#s{k}"' in text
        assert text.count(f'id="s{k}"') == 1
    explained = md.explain("slider-crank-inertia", "cycle")
    assert "illustrated" not in vars(explained)
    assert explained.html().count("<figure>") == 4  # diagram, groups apart, two plans
    assert (
        explained.data()["sections"]
        == md.explain("slider-crank-inertia", "cycle").data()["sections"]
    )
    assert "<figure>" not in explained.text()


def test_tables_that_fit_beside_each_other_are_one(made: Any) -> None:
    tables = [own for own in passages(made.document) if isinstance(own, Grid)]
    kinematic = [own for own in tables if len(own.rows) == 12]
    assert max(len(own.heads) for own in kinematic) > 8
    assert all(len(own.heads) <= 12 for own in kinematic)


def test_a_picture_of_losses_is_no_longer_than_it_is_seen(made: Any) -> None:
    """Half a pixel is enough: the text of all pictures of a report together."""
    assert len(made.html()) < 700_000
