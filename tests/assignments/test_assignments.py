"""Assignments: round numbers that assemble and transmit well, keys that equal `solve`."""

from __future__ import annotations

import csv
import io
import re
from math import acos, degrees, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.draw.formulas.tree import Grid, Number
from mechdae.errors import InputError, SolveError, UnknownName
from mechdae.parts.paper.amounts import in_turns
from mechdae.parts.paper.assignments.choice import choose, ranges
from mechdae.parts.paper.phrases import phrases
from tests.shared.closing import faults, passages

VARY = {"a_mm": ("30", "50"), "b_mm": (100, 140), "c_mm": (70, 100, 5), "omega": (5, 15)}


@pytest.fixture(scope="module")
def made() -> Any:
    return md.assign("four-bar-crank-rocker", vary=VARY)


def angle(a: float, b: float, c: float, gap: float) -> float:
    """Return the acute angle of coupler and rocker over the distance of their ends."""
    found = acos((b * b + c * c - gap * gap) / (2 * b * c))
    return min(found, np.pi - found)


def test_thirty_variants_turn_and_transmit(made: Any) -> None:
    """Grashof's rule, and the transmission angle where crank and ground are in line."""
    assert len(made) == 30
    assert len({tuple(own.values.values()) for own in made}) == 30
    for own in made:
        a, b, c = (own.values[name] for name in ("a_mm", "b_mm", "c_mm"))
        links = sorted((a, b, c, 100.0))
        assert links[0] == a
        assert links[0] + links[3] < links[1] + links[2]
        least = min(angle(a, b, c, 100 - a), angle(a, b, c, 100 + a))
        assert own.transmission["C"] == pytest.approx(least, abs=1e-12)
        assert least >= radians(30)
        assert (a % 1, b % 2, c % 5) == (0, 0, 0)


def printed(report: Any, letter: str) -> list[list[float]]:
    """Return the numbers of all columns whose head is that letter, in the order of the tables."""
    found = []
    for block in passages(report.document):
        if isinstance(block, Grid) and len(block.rows) == 12:
            for k, head in enumerate(block.heads):
                if letter in str(head):
                    found.append([row[k].value for row in block.rows if isinstance(row[k], Number)])
    return found


def test_keys_equal_solve(made: Any, tmp_path: Path) -> None:
    folder = made.save(tmp_path / "class")
    for own in made[::7]:
        path = folder / "problems" / f"four-bar-crank-rocker-{own.number:02d}.toml"
        result = md.solve(path)
        assert result.task == "turn"
        for body, index in (("coupler", "2"), ("rocker", "3")):
            series = result.bodies[body]
            (omega,) = printed(own.key, f"text='ω', index=('{index}',)")
            (epsilon,) = printed(own.key, f"text='ε', index=('{index}',)")
            assert omega == pytest.approx(series.angular_velocity[:12], abs=1e-3)
            assert epsilon == pytest.approx(series.angular_acceleration[:12], abs=1e-2)
        a, b, c = (own.values[name] for name in ("a_mm", "b_mm", "c_mm"))
        (phi, *_) = printed(own.key, "text='φ', index=('3',)")
        for k in (0, 6):  # crank in line with the ground: the triangle C D and the crank's pin
            gap = 100.0 - a if k == 0 else 100.0 + a
            at_rocker = acos((gap * gap + c * c - b * b) / (2 * gap * c))
            assert phi[k] == pytest.approx(180.0 - degrees(at_rocker), abs=1e-2)
        assert not faults(own.key.document)


def test_sheets_have_no_answers(made: Any) -> None:
    for own in made[:3]:
        tables = [
            block
            for block in passages(own.sheet.document)
            if isinstance(block, Grid) and len(block.rows) == 12
        ]
        assert len(tables) == 3  # positions and rates, those of points, analogues
        known = 0
        for table in tables:
            numbers = [cell for row in table.rows for cell in row if isinstance(cell, Number)]
            known += len(numbers)
        assert known == 12  # the driver's
        text = own.sheet.html()
        assert "variant.toml" not in text
        for column in printed(own.key, "text='ω'"):
            for value in column:
                assert f"{abs(value):.4f}" not in text
        (grid,) = [g for g in passages(own.sheet.document) if isinstance(g, Grid)][:1]
        given = {row[0]: row[1] for row in grid.rows}
        assert given["a"] == f"{own.values['a_mm']:.0f}"
        assert given["px"] == "60"  # all lengths in the unit of those that were drawn


def test_the_same_bytes_for_the_same_seed(made: Any, tmp_path: Path) -> None:
    again = md.assign("four-bar-crank-rocker", vary=VARY)
    one, other = made.save(tmp_path / "one"), again.save(tmp_path / "other")
    files = sorted(path.relative_to(one) for path in one.rglob("*") if path.is_file())
    assert len(files) == 91
    assert files == sorted(path.relative_to(other) for path in other.rglob("*") if path.is_file())
    for path in files:
        assert (one / path).read_bytes() == (other / path).read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "other"]
    rows = list(csv.reader(io.StringIO((one / "variants.csv").read_text(encoding="utf-8"))))
    assert rows[0] == ["variant", *VARY, "transmission of C [deg]"]
    assert [float(x) for x in rows[1][1:5]] == list(made[0].values.values())
    third = md.assign("four-bar-crank-rocker", vary=VARY, count=3, seed=1)
    assert third[0].values != made[0].values


def test_forces_in_russian() -> None:
    """Every equation of the key closes; the resistance of each variant is its own."""
    vary = {"r_mm": (80, 120), "Q_work": (800, 1500, 100)}
    made = md.assign("slider-crank-friction", vary=vary, count=2, lang="ru")
    for own in made:
        assert not faults(own.key.document)
        result = md.solve(own.problem)
        (effort,) = printed(own.key, "text='M', index=('1',)")
        assert effort == pytest.approx(result.efforts["crank.angle"][:12], abs=0.006)
        assert "КПД" in own.sheet.html()
        assert own.problem.mechanism.values()["Q_work"] == own.values["Q_work"]
    assert set(phrases("assignments")["en"]) == set(phrases("assignments")["ru"])


@pytest.mark.parametrize(
    ("speed", "shown"),
    [
        (75 * np.pi / 30, (75.0, "rpm")),
        (-1450 * np.pi / 30, (-1450.0, "rpm")),
        (10.0, (10.0, "rad/s")),
        (0.0, (0.0, "rad/s")),
        (7.8539816, (7.8539816, "rad/s")),
    ],
)
def test_speeds_are_shown_in_the_rounder_unit(speed: float, shown: tuple[float, str]) -> None:
    assert in_turns(speed) == shown


@pytest.mark.parametrize(("lang", "unit"), [("en", "rpm"), ("ru", "об/мин")])
def test_a_speed_in_turns_a_minute_is_one_on_the_sheet(lang: str, unit: str) -> None:
    problem = md.load("slider-crank-friction").with_values({"omega": 75 * np.pi / 30})
    (assignment,) = md.assign(problem, vary={"r_mm": (80, 120)}, count=1, lang=lang)
    text = assignment.sheet.html()
    assert f"75 {unit}" in text
    assert "7.853" not in text
    assert "7,853" not in text


@pytest.mark.parametrize(
    ("ends", "values"),
    [
        (("100", "200"), [100.0, 105.0, 110.0]),
        (("0.1", "0.2"), [0.1, 0.105, 0.11]),
        (("0.103", "0.2", "0.02"), [0.12, 0.14, 0.16]),
        ((5, 15), [5.0, 6.0, 7.0]),
        (("-3", "-1"), [-3.0, -2.9, -2.8]),
    ],
)
def test_values_are_round(ends: Any, values: list[float]) -> None:
    (found,) = ranges(md.load("slider-crank"), {"r": ends})
    assert [found.value(k) for k in range(3)] == values
    assert found.value(found.count - 1) <= float(ends[1])


def test_what_fails_is_counted() -> None:
    """Rods shorter than the crank never turn; of the others the angle is known: acos(r/l)."""
    problem = md.load("slider-crank")
    with pytest.raises(SolveError, match="0 of 5 variants in 21 sets of numbers, which are all"):
        md.assign(problem, vary={"l": (0.05, 0.09, 0.002)}, count=5)
    with pytest.raises(SolveError) as caught:
        md.assign(problem, vary={"l": (0.12, 0.19, 0.01)}, count=5, transmission_angle=radians(80))
    best = degrees(acos(0.1 / 0.19))
    assert "8 have a transmission angle below 80 deg" in str(caught.value)
    assert f"the best of these has {best:.1f} deg" in str(caught.value)


def test_work_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two hundred sets and not one that does: it is given up."""
    calls: list[Any] = []

    class Never:
        name = "turn"

        def __call__(self, values: Any) -> Any:
            calls.append(values)
            raise md.AssemblyError("no")

    drawn = ranges(md.load("slider-crank"), {"r": ("0.1", "0.2", "0.0001")})
    with pytest.raises(SolveError, match="at the sketch: 200"):
        choose([Never()], drawn, 30, 0, 0.5)  # type: ignore[arg-type]
    assert len(calls) == 200


@pytest.mark.parametrize(
    ("vary", "options", "error", "text"),
    [
        ({}, {}, InputError, "name a number"),
        ({"q": (1, 2)}, {}, UnknownName, "unknown parameter 'q'"),
        ({"r_deg": (1, 2)}, {}, InputError, "vary r_deg"),
        ({"r": (2, 1)}, {}, InputError, "not below"),
        ({"r": (1,)}, {}, InputError, "low and high"),
        ({"r": ("x", "2")}, {}, InputError, "not a number"),
        ({"r": ("nan", "2")}, {}, InputError, "not a number"),
        ({"r": (1, 2, 0)}, {}, InputError, "leads nowhere"),
        ({"r": (1, 2, 5)}, {}, InputError, "less than two multiples"),
        ({"r": (1, 2), "r_mm": (1, 2)}, {}, InputError, "twice"),
        ({"r": (1, 2, 0.5)}, {"count": 4}, InputError, "there are 3 sets"),
        ({"r": (1, 2)}, {"count": 0}, InputError, "count"),
        ({"r": (1, 2)}, {"positions": 0}, InputError, "positions"),
        ({"r": (1, 2)}, {"seed": -1}, InputError, "seed"),
        ({"r": (1, 2)}, {"pose": 12}, InputError, "there is no position 12"),
        ({"r": (1, 2)}, {"lang": "de"}, UnknownName, "language"),
        ({"r": (1, 2)}, {"transmission_angle": 2.0}, InputError, "from 0 to 90"),
        ({"r": (1, 2)}, {"task": "modes"}, InputError, "not modes"),
    ],
)
def test_what_is_refused(vary: Any, options: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        md.assign("slider-crank", vary=vary, **options)


def test_mechanisms_without_dyads() -> None:
    with pytest.raises(InputError, match="no dyad"):
        md.assign("rssr", vary={"l": (0.28, 0.32)}, transmission_angle=0.5)
    with pytest.raises(InputError, match="no dyad"):
        md.assign("planetary-gear-train", vary={"z_s": (18, 30)}, transmission_angle=0.5)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "class"
    command = ["assign", "slider-crank", "--vary", "r_mm=80:120", "--count", "2", "--out"]
    assert main([*command, str(target), "--format", "typ"]) == 0
    assert "2 variants of" in capsys.readouterr().err
    assert (target / "sheets" / "slider-crank-02.typ").exists()
    assert main([*command, str(target)]) == 2
    assert "holds something already" in capsys.readouterr().err
    assert main([*command, str(tmp_path / "no" / "class")]) == 2
    assert main([*command, str(target / "variants.csv")]) == 2
    assert "is a file" in capsys.readouterr().err
    assert main(["assign", "slider-crank", "--vary", "a", "--out", str(tmp_path / "b")]) == 2
    assert "NAME=LOW:HIGH" in capsys.readouterr().err
    angle = ["--transmission-deg", "89", "--count", "5", "--out", str(tmp_path / "b")]
    assert main(["assign", "slider-crank", "--vary", "r_mm=80:120", *angle]) == 1
    assert re.search(r"21 have a transmission angle below 89 deg", capsys.readouterr().err)
    assert [path.name for path in tmp_path.iterdir()] == ["class"]


def test_students_have_names(tmp_path: Path) -> None:
    """One variant each, in their order; loads that a variant changes have no arrow of one size."""
    names = tmp_path / "names.txt"
    names.write_text("Ada Lovelace\nГлеб Иванов\n\n", encoding="utf-8")
    command = ["assign", "slider-crank-inertia", "--vary", "r_mm=80:120", "--quiet"]
    target = tmp_path / "class"
    assert main([*command, "--students", str(names), "--out", str(target)]) == 0
    rows = list(csv.reader((target / "variants.csv").read_text(encoding="utf-8").splitlines()))
    assert [row[1] for row in rows] == ["student", "Ada Lovelace", "Глеб Иванов"]
    second = (target / "sheets" / "slider-crank-inertia-02.html").read_text(encoding="utf-8")
    assert "Глеб Иванов, variant 2 of 2" in second
    for count, text in (("3", "Ada\nBob\n"), ("2", "Ada\nAda\n"), ("2", "\n")):
        names.write_text(text, encoding="utf-8")
        more = ["--students", str(names), "--count", count, "--out", str(tmp_path / "none")]
        assert main([*command, *more]) == 2
    assert main([*command, "--students", "nowhere.txt", "--out", str(tmp_path / "none")]) == 2
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(("vary", "shown"), [("r_mm", True), ("Q_work", False)])
def test_arrows_of_loads_on_sheets(vary: str, shown: bool) -> None:
    ranges = {"r_mm": (80, 120), "Q_work": (800, 1200)}
    made = md.assign("slider-crank-inertia", vary={vary: ranges[vary]}, count=1)
    titled = {section.title: section for section in made[0].sheet.document.sections}
    assert ('id="load-work"' in titled["Kinematic diagram"].blocks[0].svg) == shown
