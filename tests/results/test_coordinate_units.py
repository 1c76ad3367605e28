"""Units come from the coordinate, everywhere: a length is not shown in degrees."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe import coordinates
from mechdae.describe import series_units as units_of_results
from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.coordinates import coordinate, coordinate_unit
from mechdae.results import effort_unit
from tests.shared.paths import DATA

CASE = DATA / "shown" / "point-driver.toml"
WORDS = {
    **dict.fromkeys(("x", "y", "z", "slide", "length"), "m"),
    **dict.fromkeys(("angle", "angle2", "elevation", "azimuth"), "rad"),
    "s": "1",
}
PROBLEMS = (
    "slider-crank", "gorshkov-seven-link", "cam-roller-follower", "double-cardan", "rssr",
    "screw-press", "vector-modules-spatial", "seven-link-loops", "delta-robot",
)  # fmt: skip


def test_a_height_is_in_metres() -> None:
    """230 mm is 0.23 m on the page, the axis of curves, in tables; it is no 13.178 degrees."""
    page = md.page(CASE).data["driver"]
    assert (page["name"], page["unit"]) == ("knuckle.W.z", "m")
    assert page["values"][0] == pytest.approx(0.23, rel=1e-12)
    result = md.solve(CASE)
    assert result.unit("drivers", "knuckle.W.z", "position") == "m"
    assert next(result.columns())[:2] == ("knuckle.W.z.position", "m")
    axes = md.plot(result, "curves")
    assert "[mm]" in axes.figure.axes[-1].get_xlabel()
    assert "deg" not in str(result).split("\n")[2]


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_coordinate_has_its_unit(name: str) -> None:
    """By its last word, or by that of what a name stands for."""
    mechanism = md.load(name).mechanism
    for text in coordinate_names(mechanism):
        word = mechanism.aliases.get(text, text).rpartition(".")[2]
        unit = WORDS[word]
        assert coordinate_unit(mechanism, text) == unit, text
        assert coordinate(mechanism, text).unit == unit, text
        assert effort_unit(mechanism, text) == ("N m" if unit == "rad" else "N"), text


def test_a_rule_of_endings_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: what does not end in slide, x or y is an angle."""

    def ending(_: Any, text: str) -> str:
        return "m" if text.endswith((".slide", ".x", ".y")) else "rad"

    for module in (coordinates, units_of_results):
        monkeypatch.setattr(module, "coordinate_unit", ending)
    with pytest.raises(AssertionError):
        test_a_height_is_in_metres()


def test_a_page_in_the_plane_loads_no_matplotlib() -> None:
    code = (
        "import sys, mechdae as md; md.page('four-bar-crank-rocker', lang='ru');"
        "assert 'matplotlib' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_russian_page_has_russian_units() -> None:
    names = md.page("slider-crank-friction", lang="ru").data["unit_names"]
    units = {"mm": "мм", "m/s": "м/с", "rad/s²": "рад/с²", "N m": "Н·м"}  # by their parts
    for unit, russian in units.items():
        assert re.sub(r"[A-Za-z]+| ", lambda part: names[part[0]], unit) == russian
    assert "unit_names" not in md.page("slider-crank-friction").data


def test_rankings_measure_what_files_do_not() -> None:
    """A slider-crank of 0.1 and 0.3 m reaches from -r to r + l, and 2 r high; sin = r / l."""
    ranking = md.rank("slider-crank")
    values = ranking.rows[0].values
    assert md.load("slider-crank").tasks["turn"].measures is None
    assert values["width"] == pytest.approx(0.5, rel=1e-9)
    assert values["height"] == pytest.approx(0.2, rel=1e-9)
    assert values["transmission_angle"] == pytest.approx(np.arccos(0.1 / 0.3), rel=1e-9)
