"""Units at the end of keys: the same numbers in SI, whatever they were written in."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mechdae as md
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.reading import split_unit, to_si
from mechdae.describe.file.writing import in_units
from mechdae.describe.units import TABLE, UNITS
from mechdae.errors import InputError, UnknownName
from tests.shared.paths import ROOT
from tests.shared.strategies import bounded, numbers

FACTORS = {
    "_deg": math.pi / 180,
    "_rpm": 2 * math.pi / 60,
    "_rad_s": 1.0,
    "_hz": 2 * math.pi,
    "_mm": 1e-3,
    "_cm": 1e-2,
    "_in": 0.0254,
    "_ft": 0.3048,
    "_kN": 1e3,
    "_N_mm": 1e-3,
    "_lbf": 4.4482216152605,
    "_lbf_in": 0.1129848290276167,
    "_g": 1e-3,
    "_lb": 0.45359237,
    "_kg_cm2": 1e-4,
}
"""The international definitions: 1 in = 25.4 mm, 1 lb = 0.45359237 kg, g = 9.80665 m/s2."""


@bounded
@given(st.data())
@pytest.mark.parametrize("suffix", UNITS)
def test_numbers_and_expressions_convert_alike(suffix: str, data: st.DataObject) -> None:
    """Numbers, sums and parameters; a sum is converted as a whole."""
    from mechdae.describe.expression import evaluate

    one, other = data.draw(numbers), data.draw(numbers)
    size = FACTORS[suffix] * (abs(one) + abs(other))
    assert to_si(one, suffix) == pytest.approx(one * FACTORS[suffix], rel=1e-15)
    for text in (f"{one!r} + {other!r}", "one + other", f"one - -1*({other!r})"):
        value = evaluate(to_si(text, suffix), {"one": one, "other": other})
        assert value == pytest.approx((one + other) * FACTORS[suffix], rel=1e-15, abs=1e-15 * size)
    assert set(FACTORS) == set(UNITS)


def test_the_longest_ending_counts() -> None:
    assert split_unit("M_N_mm") == ("M", "_N_mm")
    assert split_unit("M_lbf_in") == ("M", "_lbf_in")
    assert split_unit("_in") == ("_in", "")


def four_bar(imperial: bool) -> dict[str, Any]:
    """Return a four-bar with a force, a torque and a mass, in inches and pounds or in SI."""
    lengths = {"a": 2.0, "b": 7.0, "c": 5.5, "d": 6.0}
    parameters = (
        {f"{name}_in": value for name, value in lengths.items()}
        if imperial
        else {"a": 0.0508, "b": 0.1778, "c": 0.1397, "d": 0.1524}
    )
    load: dict[str, Any] = {"kind": "force", "point": "coupler.C"}
    twist: dict[str, Any] = {"kind": "torque", "body": "rocker"}
    mass: dict[str, Any] = {}
    if imperial:
        load["value_lbf"], twist["value_lbf_in"], mass["mass_lb"] = [3, -20], 12, 1.5
    else:
        load["value"] = [13.3446648457815, -88.96443230521]
        twist["value"], mass["mass"] = 1.3558179483314004, 0.680388555
    driver: dict[str, Any] = {"coordinate": "crank.angle", "from_deg": 0, "to_deg": 360}
    driver |= {"speed_hz": 2} if imperial else {"speed": 4 * math.pi}
    return {
        "schema": 1,
        "gravity": [0, -9.81],
        "parameters": parameters,
        "ground": {"points": {"A": [0, 0], "D": ["d", 0]}},
        "bodies": {
            "crank": {"points": {"A": [0, 0], "B": ["a", 0]}},
            "coupler": {"points": {"B": [0, 0], "C": ["b", 0]}, "center": ["b/2", 0], **mass},
            "rocker": {"points": {"D": [0, 0], "C": ["c", 0]}},
        },
        "joints": {
            "A": {"kind": "revolute", "between": ["ground.A", "crank.A"]},
            "B": {"kind": "revolute", "between": ["crank.B", "coupler.B"]},
            "C": {"kind": "revolute", "between": ["rocker.C", "coupler.C"]},
            "D": {"kind": "revolute", "between": ["ground.D", "rocker.D"]},
        },
        "loads": {"push": load, "twist": twist},
        "sketch": {"crank_deg": 30, "coupler_deg": 20, "rocker_deg": 80},
        "tasks": {"turn": {"kind": "reactions", "driver": driver, "poses": 9}},
    }


def test_inches_and_pounds_give_the_same_si_numbers() -> None:
    one, other = (md.solve(from_dict(four_bar(own)), "turn") for own in (True, False))
    for path in (
        "points/coupler.C/position",
        "points/coupler.C/velocity",
        "joints/B/reaction",
        "efforts/crank.angle",
    ):
        values, expected = (np.asarray(own.value(path)) for own in (one, other))
        assert np.abs(values - expected).max() <= 1e-15 * np.abs(expected).max(), path


def test_units_that_do_not_fit() -> None:
    data = four_bar(True)
    data["bodies"]["coupler"]["mass_in"] = data["bodies"]["coupler"].pop("mass_lb")
    with pytest.raises(InputError, match="the unit '_in' does not fit 'mass'") as caught:
        from_dict(data)
    assert "mass_lb" in str(caught.value)
    changed = md.solve("four-bar-crank-rocker", "turn", set={"a_cm": 3.0}).mechanism.values()
    assert changed["a"] == pytest.approx(0.03, rel=1e-15)


def test_unknown_units_name_the_nearest() -> None:
    for word, meant in {"a_inch": "a_in", "a_milimetre": "a_mm", "omega_rp": "omega_rpm"}.items():
        with pytest.raises(UnknownName, match=f"did you mean {meant}") as caught:
            md.load("four-bar-crank-rocker").with_values({word: 2.0})
        assert "_kg_cm2" in str(caught.value)


def test_parameters_have_the_units_of_their_uses() -> None:
    problem = md.load("four-bar-crank-rocker")
    for word, fits in {"a_deg": "a_in", "omega_mm": "omega_rpm", "crank.B.x_lb": "x_ft"}.items():
        with pytest.raises(InputError, match=f"set {word}: the unit .* does not fit") as caught:
            problem.with_values({word: 2.0})
        assert fits in str(caught.value)
    data = four_bar(True)
    data["parameters"]["a_deg"] = data["parameters"].pop("a_in")
    with pytest.raises(InputError, match=r"parameters.a_deg: .* which is crank.B.x") as caught:
        from_dict(data)
    assert "a_in" in str(caught.value)


def test_an_arc_may_be_a_radius_times_an_angle() -> None:
    data = four_bar(False)
    data["parameters"] |= {"r": 0.5, "phi_deg": 6.0, "d": "r*phi + 0.1"}
    changed = from_dict(data).with_values({"phi_deg": 12.0})
    assert changed.mechanism.values()["d"] == pytest.approx(0.1 + 0.5 * math.pi / 15, rel=1e-15)


def test_the_table_of_the_documentation_is_that_of_the_code() -> None:
    text = (ROOT / "docs/reference/problem-file.md").read_text(encoding="utf-8")
    lines = text.split("| suffix | of | one is |")[1].split("\n\n")[0].splitlines()[2:]
    shown = [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines]
    assert [row[:2] for row in shown] == [[f"`{own.suffix}`", own.of] for own in TABLE]
    for (_, _, size), unit in zip(shown, TABLE, strict=True):
        number, si = size.split(" ", 1)
        above, _, below = number.replace("2π", "6.283185307179586").partition("/")
        value = float(above.replace("π", "3.141592653589793")) / float(below or 1)
        assert value == pytest.approx(unit.factor, rel=1e-15)
        assert si == unit.si[0]


@pytest.mark.parametrize(
    "name", ["toggle-clamp", "c5-ellipse10-free", "toggle-press", "engine-run-up"]
)
def test_a_problem_is_written_in_the_units_of_its_file(name: str) -> None:
    """Designs are: the same numbers to rounding, under the endings that most of them had."""
    problem = md.load(name)
    text = in_units(problem)
    again = from_dict(tomllib.loads(text), name)
    for old, new in (
        (problem.mechanism.parameters, again.mechanism.parameters),
        (problem.mechanism.sketch, again.mechanism.sketch),
    ):
        assert list(old) == list(new)
        for key, value in old.items():
            close = isinstance(value, float) and math.isclose(value, new[key], rel_tol=3e-16)
            assert close or new[key] == value, key
    suffixes = {unit.suffix for unit in TABLE if unit.name in problem.mechanism.units.split(",")}
    written = {split_unit(key)[1] for key in tomllib.loads(text)["sketch"]}
    assert suffixes & written
    assert (
        tomllib.loads(md.dumps(problem)).get("sketch", {}).keys() == problem.mechanism.sketch.keys()
    )


def with_task(**task: Any) -> dict[str, Any]:
    """Return the four-bar with a sweep and a further task."""
    data = four_bar(True)
    data["tasks"]["more"] = task
    return data


LEAST = {"kind": "minimise", "of": "turn/bodies/coupler/angle"}


def sought(**keys: Any) -> dict[str, Any]:
    task = {"driver": {"coordinate": "crank.angle"}, "goal": LEAST, "free": {"a": [0.03, 0.05]}}
    return with_task(kind="synthesis", **{**task, **keys})


def limited(**keys: Any) -> dict[str, Any]:
    return sought(constraints=[{"kind": "limit", **keys}])


def moved(**keys: Any) -> dict[str, Any]:
    return with_task(kind="motion", until=1.0, **keys)


FUNCTION = {"kind": "function", "output": "coupler.B.x", "function": "x", "range": [0, 1]}


@pytest.mark.parametrize(
    ("data", "key", "fits"),
    [
        (limited(of="turn/points/coupler.B/position", max_deg=3), "max_deg", "max_mm"),
        (limited(of="turn/bodies/coupler/angle", min_mm=3), "min_mm", "min_deg"),
        (limited(of="turn/bodies/rocker/angular_velocity", max_mm=3), "max_mm", "max_rpm"),
        (limited(of="turn/summary/swing/rocker", max_in=3), "max_in", "max_deg"),
        (sought(free={"a_deg": [1, 2]}), "free.a_deg", "a_mm"),
        (sought(robust=1, tolerances={"a_rpm": 1}), "tolerances.a_rpm", "a_mm"),
        (sought(robust=1, tolerances_deg={"a": 1}), "tolerances_deg.a_deg", "a_mm"),
        (
            sought(goal={"kind": "path", "point": "coupler.B", "at_mm": [1, 2],
                         "targets": [[0, 1], [1, 1]]}),
            "goal.at_mm", "at_deg",
        ),
        (sought(goal={**FUNCTION, "input_range_mm": 1, "output_range_mm": 1}), "input_range_mm",
         "input_range_deg"),
        (sought(goal={**FUNCTION, "input_range_deg": 1, "output_range_deg": 1}),
         "output_range_deg", "output_range_mm"),
        (sought(objectives=[LEAST] * 2, reference_mm=[1, 1]), "reference_mm", "reference_deg"),
        (sought(objectives=[LEAST, {**LEAST, "of": "turn/points/coupler.B/position"}],
                reference_deg=[1, 1]), "reference_deg", "are in rad and m"),
        (moved(start={"crank.angle_mm": 1}), "start.crank.angle_mm", "crank.angle_deg"),
        (moved(start_speed={"crank.angle_mm": 1}), "start_speed.crank.angle_mm", "angle_rpm"),
        (moved(start_speed={"crank.angle.speed_mm": 1}), "crank.angle.speed_mm", "speed_rpm"),
        (moved(max_step_mm=1), "max_step_mm", "in s"),
        (moved(events=[{"coordinate": "crank.angle", "crosses_mm": 1}]), "events[0].crosses_mm",
         "crosses_deg"),
        (moved(events=[{"coordinate": "coupler.B.x.speed", "crosses_rpm": 1}]),
         "events[0].crosses_rpm", "crosses_mm"),
        (moved(drivers=[{"coordinate": "crank.angle", "law_mm": "t"}]), "drivers[0].law_mm",
         "law_deg"),
        (with_task(kind="sensitivity", of="turn", outputs=["bodies/coupler/angle"],
                   tolerances={"a_deg": 1}), "tolerances.a_deg", "a_mm"),
        (with_task(kind="sweep", driver={"coordinate": "crank.angle", "from": 0, "to": 1},
                   find=[{"output": "coupler.angle", "crosses_mm": 1}]), "find[0].crosses_mm",
         "crosses_deg"),
    ],
    ids=lambda item: item if isinstance(item, str) else "",
)  # fmt: skip
def test_suffixes_fit_what_their_key_belongs_to(data: dict[str, Any], key: str, fits: str) -> None:
    """The unit of a limit is that of what is limited, of a start that of its coordinate."""
    with pytest.raises(InputError, match=r"the unit '_\w+' does not fit") as caught:
        from_dict(data)
    assert key in caught.value.where
    assert caught.value.where.startswith("tasks.more.")
    assert fits in caught.value.hint


def test_suffixes_that_fit_are_read() -> None:
    problem = from_dict(limited(of="turn/bodies/rocker/angular_velocity", max_rpm=30))
    assert problem.tasks["more"].constraints[0].max == pytest.approx(math.pi, rel=1e-15)
    problem = from_dict(moved(start_speed={"crank.angle_rpm": 30}, max_step_s=0.5))
    assert problem.tasks["more"].start_speed["crank.angle"] == pytest.approx(math.pi)
    assert problem.tasks["more"].max_step == 0.5


@pytest.mark.parametrize(
    ("joint", "changes", "said"),
    [
        ("B", {"limits_deg": [90, 10]}, "limits end at 10 deg, not after their start 90 deg"),
        ("B", {"clearance_in": -0.5}, r"clearance is negative \(-0.5 in\)"),
        ("C", {"pin_radius_in": -2}, r"pin_radius is negative \(-2 in\)"),
    ],
)
def test_errors_of_a_file_are_in_its_units(joint: str, changes: Any, said: str) -> None:
    """Also where there is no mechanism yet that would tell them."""
    data = four_bar(True)
    data["joints"][joint] |= changes
    with pytest.raises(InputError, match=said):
        md.solve(from_dict(data), "turn")


def test_input_errors_of_a_task_are_in_the_units_of_the_file() -> None:
    """Not only what a mechanism cannot do: also what its gaps are too large for."""
    data = four_bar(True)
    data["joints"]["B"]["clearance_in"] = 3
    driver = {"coordinate": "crank.angle", "from_deg": 0, "to_deg": 90}
    data["tasks"]["more"] = {"kind": "play", "driver": driver, "poses": 3}
    with pytest.raises(InputError, match=r"clearance is 3 in, .* of crank it is 2 in") as caught:
        md.solve(from_dict(data), "more")
    assert caught.value.where == "joints.B.clearance"
    with pytest.raises(InputError, match=r"clearance is 0.0762 m,"):
        md.solve(from_dict(data), "more", units="m")


@pytest.mark.parametrize(
    ("table", "key", "hint"),
    [
        ("joints.B", "clearance_inch", "did you mean clearance_in? units are _mm, _cm, _in, _ft"),
        ("joints.B", "limits_degree", "did you mean limits_deg? units are _deg"),
        ("joints.B", "backlash_angle_deg", "backlash_angle is a key of gear"),
        ("joints.B", "backlash_mm", "backlash is a key of gear, rack"),
        ("joints.B", "betwen", "did you mean between?"),
    ],
)
def test_unknown_keys_name_what_fits(table: str, key: str, hint: str) -> None:
    data = four_bar(True)
    part = data["joints"][table.partition(".")[2]]
    part[key] = part.pop("between") if key == "betwen" else 1
    with pytest.raises(UnknownName, match=f"unknown key '{key}'") as caught:
        from_dict(data)
    assert caught.value.where == table
    assert caught.value.hint == hint


def test_a_parameter_with_no_unit_is_named_where_it_lacks() -> None:
    data = four_bar(True)
    data["parameters"]["a_inch"] = data["parameters"].pop("a_in")
    with pytest.raises(UnknownName, match="unknown name 'a'") as caught:
        from_dict(data)
    assert caught.value.hint.startswith("did you mean a_in?")


@pytest.mark.parametrize(
    ("path", "near"),
    [
        ("B.angle", "joints/B/angle"),
        ("coupler.B", "points/coupler.B/position"),
        ("bodies/coupler", "bodies/coupler/angle"),
        ("summary/statu", "summary/status"),
    ],
)
def test_unknown_paths_name_whole_ones(path: str, near: str) -> None:
    problem = from_dict(four_bar(True))
    for task in (
        md.Sensitivity(of="turn", outputs=(path,), wrt=("a",)),
        md.Study(of="turn", outputs=(path,), vary={"a": (0.05, 0.051, 2)}),
    ):
        with pytest.raises(UnknownName, match="unknown path") as caught:
            md.solve(problem, task)
        assert near in caught.value.hint, task.kind


def test_loads_have_the_units_of_their_coordinate() -> None:
    data = four_bar(True)
    data["loads"]["brake"] = {"kind": "resistance", "coordinate": "rocker.angle", "positive_kN": 1}
    with pytest.raises(InputError, match=r"loads.brake.positive_kN: .*'_kN' does not fit"):
        from_dict(data)


def test_what_tells_a_unit_for_sure_counts_before_products_with_numbers() -> None:
    """An inertia 0.6*l**2 has a mass in it: it does not make the length unknown."""
    data = four_bar(True)
    data["bodies"]["coupler"]["inertia"] = "0.6*a**2"
    assert parameter_units(from_dict(data).mechanism)["a"] == "m"
