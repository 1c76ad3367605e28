"""What students read: loads in words, one unit of length, decimal commas, rates of points."""

from __future__ import annotations

import base64
import re
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.units import units_of
from mechdae.draw.formulas.notations import plain
from mechdae.draw.formulas.tree import Grid, Letter, Part
from mechdae.parts.paper.phrases import Phrases
from mechdae.parts.paper.reports.sections import parameters
from tests.shared.closing import passages
from tests.shared.command import run
from tests.shared.paths import DATA

SHAPER = DATA / "shown" / "shaper.toml"


def words_of(document: Any) -> str:
    return " ".join(str(cell) for own in passages(document) if isinstance(own, Grid)
                    for row in own.rows for cell in row)  # fmt: skip


@pytest.mark.parametrize(("lang", "load", "millimetre"), [
    ("en", "1500 N against the motion while ram_guide.slide falls", "mm"),
    ("ru", "1500 Н против движения, пока ram_guide.slide убывает", "мм"),
])  # fmt: skip
def test_a_load_is_told_in_words(lang: str, load: str, millimetre: str) -> None:
    made = md.assign(SHAPER, vary={"r_mm": (80, 100, 2)}, count=1, task="forces", lang=lang)
    sheet = made[0].sheet.document
    text = words_of(sheet)
    assert load in text
    assert "resistance" not in text
    grids = [own for own in passages(sheet) if isinstance(own, Grid)]
    units = {row[0]: row[2] for row in grids[0].rows}
    assert [units[own] for own in "rhLcy"] == [millimetre] * 5  # all lengths in one unit
    assert {row[0]: row[1] for row in grids[0].rows}["L"] == "350"
    for own in grids[1:4]:  # no column is empty
        assert all(any(row[k] for row in own.rows) for k in range(len(own.rows[0])))
    html = made[0].sheet.html()
    assert "with the friction" not in html
    assert "учётом трения" not in html


def test_as_many_variants_as_there_are(capsys: Any, tmp_path: Any) -> None:
    """Some of 21 sets transmit well: that many variants, and a word about it."""
    words = ["assign", "four-bar-crank-rocker", "--vary", "a_mm=30:50", "--positions", "4", "--out"]
    code, _, err = run(capsys, *words, str(tmp_path / "class"))
    assert code == 0
    assert re.search(r"\d+ variants of 21 sets of numbers: no 30 in these ranges", err)
    code, _, err = run(capsys, *words, str(tmp_path / "other"), "--count", "22")
    assert code == 2
    assert "22 are wanted" in err


def test_russian_numbers_have_a_comma() -> None:
    text = md.explain("slider-crank", lang="ru").text()
    assert re.search(r"\d,\d", text)
    assert not re.search(r"(?<![\w.])\d+\.\d+(?![\w.])", text)
    assert re.search(r"\d\.\d", md.explain("slider-crank").text())


def test_a_notebook_has_its_own_policy() -> None:
    told = md.explain("slider-crank")
    assert "Content-Security-Policy" in told.html()
    assert "Content-Security-Policy" not in told._repr_html_()


def test_reports_have_the_rates_of_points() -> None:
    """Of the crank's pin: v = w r across, a = w^2 r inwards, w = 10 rad/s, r = 0.1 m."""
    document = md.report("slider-crank", positions=4).document
    columns: dict[str, list[float]] = {}
    for grid in passages(document):
        if isinstance(grid, Grid):
            for k, head in enumerate(grid.heads):
                letter = getattr(head, "parts", (head,))[0]
                if not isinstance(letter, Letter):
                    continue
                name = letter.text + "".join(letter.index)
                if name in ("vBx", "vBy", "aBx", "aBy"):
                    columns[name] = [getattr(row[k], "value", np.nan) for row in grid.rows]
    angle = np.pi / 2 * np.arange(4)
    assert columns["vBx"] == pytest.approx(-np.sin(angle), abs=1e-4)
    assert columns["vBy"] == pytest.approx(np.cos(angle), abs=1e-4)
    assert columns["aBx"] == pytest.approx(-10 * np.cos(angle), abs=1e-3)
    assert columns["aBy"] == pytest.approx(-10 * np.sin(angle), abs=1e-3)


def test_notebooks_show_all_modes_and_words_for_pictures() -> None:
    html = md.solve("gorshkov-seven-link", "modes")._repr_html_()
    svg = base64.b64decode(re.findall(r"base64,([^\"]+)", html)[0]).decode()
    assert svg.count('id="subtitle') == 4
    axes = md.plot("gorshkov-seven-link", "diagram")
    _, told = axes._repr_png_()
    assert "Seven-link" in told["alt"]


def test_a_fixed_rack_is_hatched() -> None:
    """The lower rack of the ground is, the upper one on the table is not."""
    axes = md.plot("rack-and-pinion", "diagram")
    gids = {str(own.get_gid()) for own in axes.findobj()}
    mechanism = md.load("rack-and-pinion").mechanism
    racks = [own for own in mechanism.joints.values() if own.wheels == 1]
    fixed = [own for own in racks if own.second_body == "ground"]
    assert len(racks) == 2
    assert len(fixed) == 1
    for own in racks:
        assert (f"joint-{own.name}-ground" in gids) == (own in fixed)


def test_given_numbers_have_units_and_round_digits() -> None:
    """A module follows from products with numbers of teeth, a base circle from its curve."""
    for name, units in (
        ("planetary-gear-loads", {"m": ("2", "mm"), "z_s": ("24", ""), "alpha": ("20", "°")}),
        ("cam-roller-follower", {"base": ("25", "mm"), "h": ("16", "mm"), "omega": ("120", "rpm")}),
        ("screw-press", {"coarse": ("0.006", "m"), "alpha": ("2", "rad/s²")}),
    ):
        problem = md.load(name)
        say = Phrases("en", "reports", units_of((), problem.mechanism.units))
        rows = {str(row[0]): row[1:] for row in parameters(problem, say).rows}
        assert {word: rows[word] for word in units} == units


@pytest.mark.parametrize("problem", ["four-stroke-engine", "screw-press"])
def test_tables_fit_the_page_and_have_no_columns_of_rounding(problem: str) -> None:
    """The piston moves along its cylinder alone; 120 figures of 9 pt are as wide as A4."""
    document = md.report(problem, positions=3).document
    titled = {section.title: section for section in document.sections}
    tables = [
        block for part in titled["Positions"].sections for block in part.blocks
        if isinstance(block, Grid)
    ]  # fmt: skip
    for grid in tables:
        widths = [max(len(plain(cell)) if isinstance(cell, Part) else len(cell) for cell in column)
                  for column in zip(grid.heads, *grid.rows, strict=True)]  # fmt: skip
        assert sum(widths) + 1.8 * len(widths) <= 115 + 5
        for k, head in enumerate(grid.heads[1:], 1):
            letter = getattr(head, "parts", (head,))[0]
            if letter.text in ("v", "a"):
                sizes = [abs(row[k].value) for row in grid.rows]
                assert max(sizes) > 1e-6, (problem, letter)
    assert tables
