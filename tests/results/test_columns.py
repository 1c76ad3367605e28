"""Series are read and written by columns: the same data, without a dictionary of everything."""

from __future__ import annotations

import csv
import gc
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given

import mechdae as md
from mechdae.results import Result, plain
from mechdae.tasks.export import csv_text, json_text
from tests.shared.strategies import bounded, crank_rockers, scaled, scales


@pytest.fixture(scope="module")
def lost() -> Result:
    """A sweep with poses that have no value."""
    driver = md.Driver("left.angle", from_=0.0, to=6.0)
    return md.solve("four-bar-double-rocker", md.Sweep(driver=driver, poses=7))


def by_items(value: Any) -> Any:
    """Return plain data number by number."""
    if isinstance(value, np.ndarray):
        return [by_items(item) for item in value] if value.ndim else by_items(value.item())
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


@pytest.mark.parametrize(
    "array",
    [
        np.array([1.5, np.nan, -np.inf, 2]),
        np.array([[1.0, np.nan], [3.0, 4.0]]),
        np.array(np.nan),
        np.arange(3),
        np.array(["ok", "limit"]),
        np.array([True, False]),
        np.zeros((0, 2)),
    ],
)
def test_arrays_are_plain_item_by_item(array: Any) -> None:
    found = plain(array)
    assert repr(found) == repr(by_items(array))
    json.dumps(found, allow_nan=False)


def leaves(value: Any, path: str = "") -> Any:
    if isinstance(value, dict):
        for key, part in value.items():
            yield from leaves(part, f"{path}/{key}" if path else key)
    else:
        yield path, value
        if isinstance(value, list) and value:
            yield f"{path}/{len(value) - 1}", value[-1]


def test_a_path_names_what_the_dictionary_has(lost: Result) -> None:
    for path, value in leaves(lost.to_dict()):
        if "." not in path.rpartition("/")[2] and "[" not in path:
            assert lost.value(path) == value, path


def test_one_series_is_read_without_the_others(lost: Result, monkeypatch: Any) -> None:
    seen = []
    monkeypatch.setattr("mechdae.results.content.plain", lambda value: seen.append(value) or value)
    lost.value("bodies/right/angle")
    assert len(seen) == 1
    assert seen[0] is lost.bodies["right"].angle


def test_the_table_has_the_digits_of_the_arrays(lost: Result) -> None:
    head, *rows = csv.reader(csv_text(lost).splitlines())
    columns = list(lost.columns())
    assert [word.partition(" [")[0] for word in head[1:]] == [name for name, _, _ in columns]
    for k, row in enumerate(rows):
        assert row[0] == lost.status[k]
        for text, (_, _, array) in zip(row[1:], columns, strict=True):
            value = float(array[k])
            assert text == (repr(value) if math.isfinite(value) else "")


def test_collection_of_cycles_goes_on(lost: Result) -> None:
    assert gc.isenabled()
    lost.to_dict()
    assert gc.isenabled()
    gc.disable()
    try:
        lost.to_dict()
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_json_has_the_content(lost: Result) -> None:
    assert json.loads(json_text([lost]))["tasks"]["sweep"] == lost.to_dict()


@bounded
@given(crank_rockers(), scales)
def test_the_table_and_the_json_hold_the_same_bits(mechanism: md.Mechanism, scale: float) -> None:
    driver = md.Driver("crank.angle", from_=0.5, to=6.0)
    result = md.solve(scaled(mechanism, scale), md.Sweep(driver, poses=5))
    head, *rows = csv.reader(csv_text(result).splitlines())
    columns = {
        title.split(" ")[0]: column for title, column in zip(head, np.array(rows).T, strict=True)
    }
    plain = json.loads(json_text([result]))["tasks"]["sweep"]
    assert list(columns["status"]) == plain["status"]
    assert [*map(float, columns["rocker.angle"])] == plain["bodies"]["rocker"]["angle"]
    for k, axis in enumerate("xy"):
        velocity = [place[k] for place in plain["points"]["coupler.C"]["velocity"]]
        assert [*map(float, columns[f"coupler.C.velocity.{axis}"])] == velocity


PINS = {"C": ("coupler", "rocker"), "B": ("crank", "coupler"), "D": (None, "rocker")}


@pytest.mark.parametrize("listed", [["D.angle"], ["C.angle", "B.angle"], ["rocker", "B.angle"]])
def test_angles_of_pins_that_a_task_lists_are_shown(listed: list[str]) -> None:
    """In the table and as curves: the angle of the second link less that of the first."""
    driver = md.Driver("crank.angle", from_=0.0, to=6.0)
    mechanism = md.four_bar(0.1, 0.04, 0.12, 0.08)
    result = md.solve(mechanism, md.Sweep(driver=driver, poses=4, outputs=listed))
    bodies = md.solve(mechanism, md.Sweep(driver=driver, poses=4)).bodies
    header, *rows = (line for line in str(result).split("\n") if "[deg]" in line or " ok " in line)
    titles = [title.strip() for title in header.split("]")]
    for name in (name for name in listed if name.endswith(".angle")):
        first, second = PINS[name.removesuffix(".angle")]
        place = titles.index(f"{name} [deg")
        shown = [float(row.split()[place + 1]) for row in rows]
        angle = bodies[second].angle - (bodies[first].angle if first else 0.0)
        assert np.allclose(np.radians(shown), angle, atol=1e-5)
    if listed[0] != "rocker":
        assert md.plot(result, "curves").get_lines()
