"""Units that tables, CSV, pictures and pages are shown in; arrays and JSON stay SI."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.describe.units import KNOWN, TABLE, units_of
from mechdae.motion.setup.likely_typos import doubts
from mechdae.results.tables import table
from tests.shared.paths import ROOT

FOUR_BAR = (ROOT / "problems/four-bar-crank-rocker.toml").read_text(encoding="utf-8")
INCH, POUND_FORCE = 0.0254, 4.4482216152605


@pytest.fixture(scope="module")
def forces() -> Any:
    return md.solve("slider-crank-friction", poses=5)


def test_every_unit_of_files_can_be_shown() -> None:
    for unit in TABLE:
        for word in (unit.name, unit.suffix[1:]):
            own = units_of(word).of(unit.si[0])
            assert own.name == unit.name
            assert own.factor * unit.factor == pytest.approx(1.0, rel=1e-15)
    assert {"m", "rad", "N", "N m", "kg", "kg m2"} <= set(KNOWN)


def test_rates_areas_and_curvatures_follow() -> None:
    units = units_of("in,deg,rpm")
    shown = {si: units.of(si).name for si in ("m/s2", "m2", "1/m", "rad/s", "rad/s2", "W")}
    assert shown == {"m/s2": "in/s2", "m2": "in2", "1/m": "1/in", "rad/s": "rpm",
                     "rad/s2": "deg/s2", "W": "W"}  # fmt: skip
    assert units.of("m2").factor == pytest.approx(INCH**-2, rel=1e-15)
    assert units.of("1/m").factor == pytest.approx(INCH, rel=1e-15)
    assert units.of("rad/s").factor == pytest.approx(30 / math.pi, rel=1e-15)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("inch", "did you mean in?"),
        ("mm,in", "mm and in are both units of lengths"),
        ("", "units are m, rad"),
        ("mm,,deg", "unknown unit ''"),
        ("degrees", "did you mean deg?"),
    ],
)
def test_units_that_are_none(asked: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("solve", "plot", "page", "study", "synthesize", "sensitivity"):
        assert main([command, "four-bar-crank-rocker", "--units", asked, *OF.get(command, ())]) == 2
        text = capsys.readouterr().err
        assert "--units" in text
        assert words in text


OF = {"sensitivity": ("--of", "summary/swing/rocker", "--wrt", "a")}


def test_a_table_in_inches_and_pounds(forces: Any) -> None:
    shown = forces.in_units("in,lbf,lbf in")
    head, *rows = table(shown).splitlines()[1:7]
    assert "effort [lbf in]" in head
    assert "|O| [lbf]" in head
    effort = forces.efforts["crank.angle"][1] / (POUND_FORCE * INCH)
    assert float(rows[1].split()[2]) == pytest.approx(effort, rel=1e-5)
    assert f"stroke    slide: {0.2 / INCH:.12g} in" in table(shown)
    assert shown.in_units("m").to_dict() == forces.to_dict()  # the JSON stays SI
    assert (shown.points["crank.B"].position == forces.points["crank.B"].position).all()


def test_a_pose_in_millimetres() -> None:
    found = md.solve("gorshkov-seven-link", "pose")
    text = table(found.in_units("mm,deg"))
    x, y = found.points["rod.B"].position[0] * 1e3
    assert f"( {x:.12g},  {y:.12g}) mm" in text
    assert "38.117 deg\n" in text
    assert " rad" not in text


def test_units_side_by_side_are_said() -> None:
    found = md.solve("four-bar-crank-rocker", "turn")
    assert "(units mixed: deg and rpm)" in table(found.in_units("deg,rpm"))
    assert "mixed" not in table(found.in_units("deg,mm"))
    assert "mixed" not in table(found)


def test_files_have_their_units_in_the_heads(tmp_path: Path, forces: Any) -> None:
    words = ["solve", "slider-crank-friction", "--poses", "5", "--task", "cycle", "--quiet"]
    assert main([*words, "--units", "mm,kN", "--out", str(tmp_path)]) == 0
    with (tmp_path / "cycle.csv").open() as file:
        rows = list(csv.DictReader(file))
    x = [float(row["crank.B.position.x [mm]"]) for row in rows]
    assert x == pytest.approx((1e3 * forces.points["crank.B"].position[:, 0]).tolist(), rel=1e-15)
    y = [float(row["O.reaction.Fy [kN]"]) for row in rows]
    assert y == pytest.approx((forces.joints["O"].reaction[:, 1] / 1e3).tolist(), rel=1e-15)
    data = json.loads((tmp_path / "cycle.json").read_text())["tasks"]["cycle"]
    assert data["points"]["crank.B"]["position"] == forces.points["crank.B"].position.tolist()
    arrays = np.load(tmp_path / "cycle.npz")
    assert (arrays["crank.B.position.x"] == forces.points["crank.B"].position[:, 0]).all()


def test_pictures_and_pages(forces: Any) -> None:
    panels = md.plot(forces.in_units("lbf,lbf_in"), "curves").figure.axes
    labels = [panel.get_ylabel() for panel in panels]
    assert [label.rpartition("[")[2] for label in labels] == ["lbf in]", "lbf]", "W]"]
    effort = panels[0].lines[0].get_ydata()  # of the poses and of places between them
    scaled = forces.efforts["crank.angle"] / (POUND_FORCE * INCH)
    assert effort[[0, -1]] == pytest.approx(scaled[[0, -1]], rel=1e-13)
    gaps = np.abs(effort[:, None] - scaled).min(axis=0)
    assert gaps.max() < 1e-12 * np.abs(scaled).max()
    figure = md.plot(forces.in_units("in"), "diagram").figure
    texts = [own.get_gid() for own in figure.findobj() if own.get_gid()]
    assert "scale-text" in texts
    page = md.page("four-bar-crank-rocker", units="in,rpm")
    assert page.data["shown"]["m"] == [pytest.approx(1 / INCH, rel=1e-15), "in"]
    assert md.page("four-bar-crank-rocker").data["shown"]["m"] == [1000.0, "mm"]  # as its file
    assert "shown" not in md.page("eccentric-slider").data


# -- what looks like another unit ------------------------------------------------------------


def changed(**texts: str) -> Any:
    text = FOUR_BAR
    for old, new in texts.items():
        assert old in text
        text = text.replace(old, new)
    return from_dict(tomllib.loads(text))


def test_an_angle_beside_degrees() -> None:
    assert changed(to_deg="to").notes == (
        "tasks.turn.driver: to = 360 is in radians, beside from_deg; did you mean to_deg?",
    )
    assert changed(crank_deg="crank").notes == (
        "sketch: crank = 40 is in radians, beside coupler_deg; did you mean crank_deg?",
    )
    for good in ("to = 6", 'to = "2*pi"', "to = 7.5"):
        assert not from_dict(tomllib.loads(FOUR_BAR.replace("to_deg = 360", good))).notes, good
    assert not doubts(md.load("four-bar-crank-rocker"))


def test_notes_of_files_reach_check_and_solve(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "four.toml"
    path.write_text(FOUR_BAR.replace("to_deg = 360", "to = 360"))
    for command in (["check"], ["solve", "--task", "turn", "--poses", "4"]):
        main([*command, str(path)])
        assert capsys.readouterr().err.count("did you mean to_deg?") == 1


def test_lengths_out_of_proportion() -> None:
    problem = md.load("four-bar-crank-rocker")
    small = doubts(problem.with_values({"a_mm": 0.04}))
    assert len(small) == 1
    assert "of crank are 4e-05 m apart, 3000 times less than the largest length" in small[0]
    assert not doubts(problem.with_values({"a_mm": 0.13}))
    radius = doubts(md.load("slider-crank-friction").with_values({"r_B": 15.0}))
    assert radius == ["B.pin_radius is 15 m, 50 times the largest length: is that in metres?"]


# -- units that a file is written in -----------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("four-bar-crank-rocker", "mm,deg,rad/s"),
        ("four-stroke-engine", "mm,deg,rpm"),
        ("five-rod-suspension", "mm"),
        ("slider-crank-friction", "deg,rad/s"),
        ("double-pendulum", ""),
    ],
)
def test_what_most_numbers_are_typed_in(name: str, units: str) -> None:
    mechanism = md.load(name).mechanism
    assert {*mechanism.units.split(",")} == {*units.split(",")}
    assert mechanism.with_values({}).units == mechanism.units


def test_one_length_in_millimetres_among_metres() -> None:
    data = tomllib.loads(FOUR_BAR)
    sizes = data["parameters"]
    several = {key: sizes.pop(key) for key in list(sizes) if key.endswith("_mm")}
    sizes |= {key.removesuffix("_mm"): value / 1000 for key, value in several.items()}
    sizes["px_mm"] = 1000 * sizes.pop("px")
    mechanism = from_dict(data).mechanism
    assert "mm" not in mechanism.units
    assert "deg" in mechanism.units


def test_results_are_in_the_units_of_the_file() -> None:
    found = md.solve("four-bar-crank-rocker", "turn", poses=3)
    text = table(found)
    assert "coupler.P.x [mm]" in text
    assert "rocker [rad/s]" in text  # no speed is typed in degrees
    assert "coupler.P.x [in]" in table(found.in_units("in"))
    assert "rocker [deg]" in table(found.in_units("in"))
    assert md.solve(found.mechanism, found.definition).units == found.units


def test_files_for_programs_stay_in_si(tmp_path: Path) -> None:
    words = ["solve", "four-bar-crank-rocker", "--task", "turn", "--poses", "3", "--quiet"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    with (tmp_path / "turn.csv").open() as file:
        heads = next(csv.reader(file))
    assert "coupler.P.position.x [m]" in heads
    assert "crank.angle.position [rad]" in heads
    again = md.read(tmp_path)["turn"]
    assert again.units.by_si["m"].name == "mm"  # those of the file, from the folder too


def test_a_mechanism_of_python_says_its_units() -> None:
    four_bar = md.load("four-bar-crank-rocker").mechanism
    sweep = md.Sweep(driver=md.Driver("crank.angle", at=[0.7]))
    assert ") cm\n" in table(md.solve(dataclasses.replace(four_bar, units="cm"), sweep))
    with pytest.raises(md.MechdaeError, match="did you mean in"):
        dataclasses.replace(four_bar, units="inch")


@pytest.mark.parametrize("lang", ["en", "ru"])
def test_equations_on_paper_close_in_other_units(lang: str) -> None:
    """Each side of an equation is the same number, whatever unit the sides are in."""
    shown = md.explain("slider-crank-friction", pose=40, units="in,lbf", lang=lang)
    plain = md.explain("slider-crank-friction", pose=40, lang=lang)
    assert shown.data() == plain.data()  # data stay SI
    text = shown.text().replace(",", ".")
    ((spin, length, speed, unit),) = re.findall(
        r"\|v_BO\| = \|ω_1\|·\|r_BO\| = (\S+)·(\S+) = (\S+) (\S+)", text
    )
    assert float(spin) * float(length) == pytest.approx(float(speed), rel=1e-4)
    assert float(length) == pytest.approx(0.1 / INCH, rel=1e-4)
    assert unit == {"en": "in/s", "ru": "дюйм/с"}[lang]
    forces = re.findall(r"\|R\| = (\S+) (\S+)", text)
    sizes = re.findall(r"\|R\| = (\S+) (\S+)", plain.text().replace(",", "."))
    assert {unit for _, unit in forces} == {{"en": "lbf", "ru": "фунт-сила"}[lang]}
    for (size, _), (newtons, _) in zip(forces, sizes, strict=True):
        assert float(size) == pytest.approx(float(newtons) / POUND_FORCE, rel=2e-4)


def test_messages_have_the_lengths_of_the_file(tmp_path, capsys) -> None:
    path = tmp_path / "clamp.toml"
    path.write_text(md.new("toggle-clamp").replace("to_mm = 161.5", "to_mm = 400", 1))
    assert main(["solve", str(path), "--task", "close"]) == 1
    said = capsys.readouterr().err
    assert "limit position at cyl.slide = 281.555 mm" in said  # the hypotenuse of hx, hy and a
    assert main(["solve", str(path), "--task", "close", "--units", "m"]) == 1
    assert "limit position at cyl.slide = 0.281555 m" in capsys.readouterr().err
    assert "limit position at cyl.slide = 281.555 mm" in md.solve(path, "close")._repr_html_()
    far = {"b_mm": 5}
    with pytest.raises(md.SolveError, match=r"stays open by [\d.]+ mm"):
        md.solve("toggle-clamp", "close", set=far)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("at least 0.0597367 m, or 1e-05 m", "at least 59.7367 mm, or 0.01 mm"),
        ("moment 3 N m, speed 2 m/s, point2 m", "moment 3 N m, speed 2000 mm/s, point2 m"),
        ("by 1.5707963267949 rad of 0.02 rad/s", "by 90 deg of 1.14592 deg/s"),
        ("35 m apart: is that in metres?", "35 m apart: is that in metres?"),
    ],
)
def test_lengths_in_messages(text: str, shown: str) -> None:
    assert units_of("mm,deg").in_text(text) == shown


def test_a_force_that_is_rounding_is_shown_as_none() -> None:
    """The cylinder of the clamp carries a moment alone at its pose: components and size are 0."""
    lines = md.solve("toggle-clamp", "tenfold").table().splitlines()
    shown = [line.split() for line in lines if line.startswith("  cyl ")]
    sizes = {name: value for _, name, value, *_ in shown if name in ("|reaction|", "normal")}
    assert sizes == {"|reaction|": "0", "normal": "0"}
