"""Parts to cut and print: solids are closed, parts never meet, what is in the file is to scale.

Solids are read back from the STL file; where bodies are in other poses is told by two of their
points, and whether parts overlap by corners inside of polygons: nothing of how the parts were
made is used.
"""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from tests.shared.command import run
from tests.shared.passing_parts import passing
from tests.shared.paths import FIGURES
from tests.shared.solids import Assembly, open_sides, solids, step_volumes

SHORT = ("four-bar-crank-rocker", "slider-crank", "quick-return-pin")
LONG = (
    "gorshkov-seven-link", "toggle-press", "jansen-leg", "oscillating-cylinder", "double-watt",
    "scotch-yoke",
)  # fmt: skip


@pytest.mark.parametrize("name", SHORT)
def test_no_part_meets_another_one(name: str) -> None:
    found = Assembly(name, 720)
    assert not found.overlaps()
    for several in found.solids.values():
        assert all(open_sides(triangles) == 0 for triangles in several)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_no_part_of_larger_mechanisms_meets_another_one(name: str) -> None:
    found = Assembly(name, 600)
    assert not found.overlaps()
    for several in found.solids.values():
        assert all(open_sides(triangles) == 0 for triangles in several)


def test_the_long_study_found_all_parts_apart() -> None:
    """`tests.scripts.parts_apart`: 1e4 poses of each mechanism of which parts are made."""
    study = json.loads((FIGURES / "parts.json").read_text(encoding="utf-8"))
    made = {name: entry for name, entry in study.items() if "solids" in entry}
    assert len(study) >= 100
    assert len(made) >= 80
    for name, entry in made.items():
        assert (entry["open_sides"], entry["overlaps"]) == (0, []), name
        assert entry["poses"] >= 10_000
    assert all("not reached" not in entry.get("reason", "") for entry in study.values())


def test_parts_in_one_layer_would_be_seen_to_meet() -> None:
    """The check of this file sees a coupler in the layer of the crank."""
    found = Assembly("four-bar-crank-rocker", 72)
    (crank,), (coupler,) = found.solids["crank"], found.solids["coupler"]
    coupler[:, :, 2] += crank[:, :, 2].min() - coupler[:, :, 2].min()
    assert ("crank", "coupler") in found.overlaps()


def test_a_solid_has_the_volume_of_its_plate() -> None:
    """A bar with round ends and two holes: a rectangle, a circle, less two circles."""
    problem = md.four_bar(ground=100, crank=40, coupler=120, rocker=80, units="mm,deg")
    sizes = {"width": 0.012, "thickness": 0.004, "pin": 0.005, "clearance": 1e-4}
    text = md.export(problem, format="stl", **sizes).text
    ((bar,),) = (solids(text)["crank"],)
    a, b, c = bar.transpose(1, 0, 2)
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
    exact = 4 * (40 * 12 + pi * 36 - 2 * pi * 2.6**2)
    assert volume == pytest.approx(exact, rel=2e-3)
    heights = sorted(set(np.round(bar[:, :, 2].ravel(), 6)))
    assert heights == [4.0, 8.0]


@pytest.mark.slow
def test_step_files_hold_true_solids(tmp_path: Path) -> None:
    """Read back by the kernel: valid, named, their volumes those of bars with round ends."""
    pytest.importorskip("OCP.STEPControl", reason="cadquery-ocp-novtk is not installed")
    problem = md.four_bar(ground=100, crank=40, coupler=120, rocker=80, units="mm,deg")
    sizes = {"width": 0.012, "thickness": 0.004, "pin": 0.005, "clearance": 1e-4}
    made = md.export(problem, format="step", **sizes)
    assert made.text == md.export(problem, format="step", **sizes).text
    assert set(made.files) == {"", "parts.csv"}
    for name in ("crank", "coupler", "rocker", "frame", "pin A"):
        assert f"PRODUCT('{name}'" in made.text
    volumes = step_volumes(made.text, tmp_path / "x.step")
    round_ends = pi * 36 - 2 * pi * 2.6**2
    bars = [4 * (length * 12 + round_ends) for length in (40, 80, 100)]
    for volume in bars:
        assert min(abs(v / volume - 1) for v in volumes) < 1e-9
    text = md.export(problem, format="stl", **sizes).text
    assert len(volumes) == sum(map(len, solids(text).values()))


def test_step_files_name_the_package_that_they_need(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in {"OCP", *(name for name in sys.modules if name.startswith("OCP."))}:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(md.UnavailableError, match="STEP files need the package cadquery-ocp-novtk"):
        md.export("slider-crank", format="step")


def test_a_sheet_is_in_millimetres_and_holds_all_parts() -> None:
    problem = md.four_bar(ground=100, crank=40, coupler=120, rocker=80, units="mm,deg")
    made = md.export(problem, format="svg-cut", width=0.012, pin=0.005, clearance=0.0, kerf=2e-4)
    width, height = map(float, re.search(r'width="(\S+)mm" height="(\S+)mm"', made.text).groups())
    assert f'viewBox="0 0 {width:.3f} {height:.3f}"' in made.text
    radii = [float(r) for r in re.findall(r'd="[^"]*?A(\S+)', made.text)]
    assert sorted(set(radii)) == [2.4, 6.1]  # half of the cut on either side of the line
    assert radii.count(6.1) == 4
    assert radii.count(2.4) == 8
    rows = made.files["parts.csv"].splitlines()
    assert [row.split(",")[0] for row in rows[1:5]] == ["crank", "coupler", "rocker", "frame"]
    assert "pin A,1,,,diameter 5 mm; length 7.5 mm; layers 0 to 1" in rows


def test_holes_have_the_clearance_of_their_joint() -> None:
    problem = md.load("slider-crank").with_values({"r": 0.1})
    joints = dict(problem.mechanism.joints)
    joints["B"] = replace(joints["B"], clearance=3e-4)
    joints["guide"] = replace(joints["guide"], clearance=5e-4)
    loose = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    made = md.export(loose, format="svg-cut", pin=0.01, clearance=1e-4)
    radii = [float(r) for r in re.findall(r'd="[^"]*?A(\S+)', made.text)]
    assert {r for r in radii if r < 6} == {5.1, 5.3, 5.5}


def test_what_passes_between_two_poses_is_met() -> None:
    """Two circles of radius 0.01500001 touch for 0.0008 rad, those of 0.0149999 pass."""
    for radius in (0.0149999, 0.01500001):
        gap, met = passing(radius)
        assert met is (gap < 0)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("belt-drive",), "joints.open: no parts are made of joints of kind belt"),
        (("rssr",), "parts are made of mechanisms of the plane"),
        (("slider-crank", "--pin", "-3"), "'-3' is not a length"),
        (("slider-crank", "--pin", "0"), "pin: a length above 0 is needed"),
        (("slider-crank", "--pin", "90mm"), "holes O and B of crank are"),
        (("slider-crank", "--pin", "5mm", "--width", "5mm"), "have no wall around holes"),
        (("elliptic-trammel",), "they would be one hole"),
        (("whitworth-quick-return",), "no order of layers"),
        (("five-bar-robot", "--task", "circle"), "one driver"),
    ],
)
def test_what_cannot_be_made_is_said(words, text: str, tmp_path: Path, capsys) -> None:
    form = ("--format", "svg-cut", "--out", str(tmp_path / "sheet.svg"))
    code, out, err = run(capsys, "export", *words, *form)
    assert (code, out) == (2, "")
    assert text in err
    assert not list(tmp_path.iterdir())


def test_the_command_says_what_it_wrote(tmp_path: Path, capsys) -> None:
    words = ("export", "slider-crank", "--width", "30mm", "--pin", "1cm", "--air", "0.5")
    target = tmp_path / "crank.svg"
    code, out, _ = run(capsys, *words, "--format", "svg-cut", "--out", str(target))
    assert code == 0
    assert out.split() == [str(target), str(tmp_path / "crank.parts.csv")]
    assert "width 30 mm" in (tmp_path / "crank.parts.csv").read_text()
    assert run(capsys, *words, "--format", "dxf", "--out", str(tmp_path / "x.dxf"))[0] == 2
