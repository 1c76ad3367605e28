"""Suffixes of parameters: one rule wherever they are used, in files and where values are set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.reading import check_suffix, split_known, to_si
from mechdae.describe.units import IN_SI, Unit, powers_of
from mechdae.motion.setup.likely_typos import driver_slips

FITS = {
    "_deg": ("rad", "rad/s"), "_rpm": ("rad/s",), "_rad_s": ("rad/s",), "_hz": ("rad/s",),
    "_mm": ("m", "m/s"), "_cm": ("m", "m/s"), "_in": ("m", "m/s"), "_ft": ("m", "m/s"),
    "_kN": ("N",), "_lbf": ("N",), "_N_mm": ("N m",), "_lbf_in": ("N m",), "_g": ("kg",),
    "_lb": ("kg",), "_kg_cm2": ("kg m2",),
}  # fmt: skip
"""What each suffix can be, by the table of the documentation: not read from the package."""
PLACES: dict[str, str] = {
    "bodies.arm.points.K": "m", "bodies.arm.mass": "kg", "bodies.arm.inertia": "kg m2",
    "bodies.arm.center": "m", "joints.O.pin_radius": "m", "joints.O.friction": "1",
    "joints.tie.length": "m", "sketch.arm": "rad", "loads.push.value": "N",
    "loads.twist.value": "N m", "loads.rub.positive": "N m", "loads.pull.stiffness": "N/m",
    "loads.pull.free_length": "m", "loads.pull.preload": "N", "loads.pull.damping": "N s/m",
    "loads.coil.stiffness": "N m/rad", "loads.coil.free_length": "rad",
    "tasks.turn.driver.at": "rad", "tasks.turn.driver.speed": "rad/s",
    "tasks.sway.drivers.law": "rad", "tasks.free.start.arm.angle": "rad",
    "tasks.free.start_speed.arm.angle": "rad/s", "tasks.free.until": "s",
    "tasks.smooth.omega_s": "rad/s",
}  # fmt: skip
FORMS = ("{0}", "-{0}", "2*{0}", "{0}/1000", "abs({0})", "{0} + 3*{0}", "sqrt({0}**2)")
HIDDEN = ("0.013*{0}", "{0}/3.7", "-0.21*{0}")
"""Products with a number that may have a unit of its own: nothing tells what the parameter is."""


def problem(place: str, form: str, key: str) -> dict[str, Any]:
    """Return a problem in which a parameter is used at a place."""
    text = form.format("P")

    def at(own: str, usual: Any) -> Any:
        return text if own == place else usual

    return {
        "schema": 1,
        "parameters": {key: -1.0 if form.startswith("-") else 1.0},
        "gravity": [0, -9.81],
        "ground": {"points": {"O": [0, 0], "H": [0, 1]}},
        "bodies": {
            "arm": {
                "points": {"O": [0, 0], "K": [at("bodies.arm.points.K", 0.3), 0]},
                "mass": at("bodies.arm.mass", 1), "inertia": at("bodies.arm.inertia", 1),
                "center": [at("bodies.arm.center", 0.1), 0],
            },
            "ball": {"points": {"C": [0, 0]}, "mass": 1, "inertia": 1},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "arm.O"],
                  "friction": at("joints.O.friction", 0.1),
                  "pin_radius": at("joints.O.pin_radius", 0.01)},
            "tie": {"kind": "distance", "between": ["arm.K", "ball.C"],
                    "length": at("joints.tie.length", 1)},
        },
        "sketch": {"arm": at("sketch.arm", 0.3)},
        "loads": {
            "push": {"kind": "force", "point": "arm.K",
                     "value": [at("loads.push.value", 1), "arm.angle"]},
            "twist": {"kind": "torque", "body": "arm", "value": at("loads.twist.value", 1)},
            "rub": {"kind": "resistance", "coordinate": "arm.angle",
                    "positive": at("loads.rub.positive", 1)},
            "pull": {"kind": "spring", "between": ["ground.H", "arm.K"],
                     **{own: at(f"loads.pull.{own}", 1)
                        for own in ("stiffness", "free_length", "preload", "damping")}},
            "coil": {"kind": "spring", "coordinate": "arm.angle",
                     **{own: at(f"loads.coil.{own}", 1) for own in ("stiffness", "free_length")}},
        },
        "tasks": {
            "turn": {"kind": "sweep",
                     "driver": {"coordinate": "arm.angle", "at": [at("tasks.turn.driver.at", 0.3)],
                                "speed": at("tasks.turn.driver.speed", 1)}},
            "sway": {"kind": "motion", "until": 1,
                     "drivers": [{"coordinate": "arm.angle",
                                  "law": f"({at('tasks.sway.drivers.law', 1)})"}]},
            "free": {"kind": "motion", "until": at("tasks.free.until", 1),
                     "start": {"arm.angle": at("tasks.free.start.arm.angle", 1)},
                     "start_speed": {"arm.angle": at("tasks.free.start_speed.arm.angle", 1)}},
            "smooth": {"kind": "motion", "until": 1, "friction": "smooth",
                       "omega_s": at("tasks.smooth.omega_s", 1)},
        },
    }  # fmt: skip


def without_radians(unit: str) -> str:
    return {"rad": "1", "rad/s": "1/s", "N m/rad": "N m"}.get(unit, unit)


def refused(data: dict[str, Any]) -> bool:
    try:
        from_dict(data)
    except md.MechdaeError as error:
        if "does not fit 'P'" not in error.what:
            raise
        return True
    return False


@pytest.mark.parametrize("place", PLACES)
def test_a_suffix_has_the_unit_of_the_place_it_is_used_in(place: str) -> None:
    for form in FORMS:
        for suffix, units in FITS.items():
            alone = form in ("{0}", "-{0}")  # elsewhere an angle may be a plain number
            own = [unit if alone else without_radians(unit) for unit in (PLACES[place], *units)]
            wrong = own[0] not in own[1:]
            assert refused(problem(place, form, f"P{suffix}")) == wrong, (form, suffix)


@pytest.mark.parametrize("place", PLACES)
def test_numbers_with_units_of_their_own_tell_nothing(place: str) -> None:
    for form in HIDDEN:
        assert not refused(problem(place, form, "P_rpm"))


def test_the_use_is_named() -> None:
    with pytest.raises(md.InputError, match=r"which is used in loads\.push\.value") as error:
        from_dict(problem("loads.push.value", "2*{0}", "P_rpm"))
    assert "P_kN" in error.value.hint
    assert error.value.where == "parameters.P_rpm"


def test_values_that_are_set_are_held_to_the_same_rule() -> None:
    for place, unit in PLACES.items():
        found = from_dict(problem(place, "{0}", "P"))
        for suffix, units in FITS.items():
            if unit in units:
                changed = found.with_values({f"P{suffix}": 1.5})
                assert changed.mechanism.parameters["P"] != 1.5 or suffix == "_rad_s"
                assert (
                    found.mechanism.with_values({f"P{suffix}": 1.5}).parameters["P"]
                    == (changed.mechanism.parameters["P"])
                )
            elif unit != "1":
                inside = () if place.startswith("tasks.") else (found.mechanism,)
                for own in (found, *inside):
                    with pytest.raises(md.InputError, match="does not fit"):
                        own.with_values({f"P{suffix}": 1.5})


# -- names and units as people write them ----------------------------------------------------------


@pytest.mark.parametrize(
    ("place", "key", "value"),
    [
        ("loads.push.value", "P_N", 1.0), ("loads.twist.value", "P_N_m", 1.0),
        ("bodies.arm.mass", "P_kg", 1.0), ("bodies.arm.inertia", "P_kg_m2", 1.0),
        ("joints.tie.length", "P_m", 1.0), ("sketch.arm", "P_rad", 1.0),
        ("tasks.free.until", "P_s", 1.0),
    ],
)  # fmt: skip
def test_units_of_si_are_a_factor_of_one(place: str, key: str, value: float) -> None:
    found = from_dict(problem(place, "{0}", key))
    assert dict(found.mechanism.parameters) == {"P": value}
    assert found.with_values({key: 2.0}).mechanism.parameters["P"] == 2.0
    for wrong in {"P_N", "P_m", "P_kg", "P_s"} - {key}:
        with pytest.raises(md.InputError, match="does not fit 'P'"):
            from_dict(problem(place, "{0}", wrong))


def test_a_name_that_is_used_with_its_end_keeps_it() -> None:
    data = problem("loads.push.value", "{0}", "P")
    data["parameters"] = {"z_s": 2.0, "P": "3*z_s"}
    found = from_dict(data).mechanism.parameter_values
    assert found == {"z_s": 2.0, "P": 6.0}


def test_keys_take_units_of_si() -> None:
    data = problem("loads.push.value", "{0}", "P")
    data["bodies"]["arm"]["mass_kg"] = data["bodies"]["arm"].pop("mass")
    driver = data["tasks"]["turn"]["driver"]
    driver |= {"at_rad": driver.pop("at"), "speed_rad": driver.pop("speed")}
    found = from_dict(data)
    assert found.mechanism.bodies["arm"].mass == 1.0
    assert found.tasks["turn"].all_drivers[0].at == (0.3,)
    driver["at_m"] = driver.pop("at_rad")
    with pytest.raises(md.InputError, match="the unit '_m' does not fit 'at'"):
        from_dict(data)


@pytest.mark.parametrize(
    ("what", "key", "fits"),
    [
        ("bodies/arm/angle", "value_deg", True), ("bodies/arm/angle", "value_mm", False),
        ("points/arm.K/position", "value_mm", True), ("points/arm.K/position", "abs_deg", False),
        ("efforts/arm.angle", "value_N_mm", True), ("efforts/arm.angle", "value_kN", False),
        ("bodies/arm/angle", "at_deg", True), ("bodies/arm/angle", "at_mm", False),
        ("bodies/arm/angle", "at_rad", True), ("bodies/arm/angle", "at_m", False),
    ],
)  # fmt: skip
def test_expected_values_have_units_of_what_they_are(what: str, key: str, fits: bool) -> None:
    data = problem("loads.push.value", "{0}", "P")
    entry: dict[str, Any] = {"task": "turn", "what": what, key: 1.0}
    data["expected"] = [entry if "value" in key else {**entry, "value": 1.0}]
    if fits:
        assert len(from_dict(data).expected) == 1
        return
    with pytest.raises(md.InputError, match="does not fit") as error:
        from_dict(data)
    assert error.value.where == f"expected[0].{key}"


def test_a_name_that_ends_like_a_unit_is_told_where_it_is_written() -> None:
    data = problem("joints.tie.length", "{0}", "P")
    data["parameters"] = {"r_in": 0.12}
    data["joints"]["tie"]["length"] = "r_in"
    with pytest.raises(md.InputError, match="_in is inches: the parameter is called r") as error:
        from_dict(data)
    assert error.value.where == "parameters.r_in"


@pytest.mark.parametrize(("dimension", "wanted"), [(2, "[0, -9.81]"), (3, "[0, 0, -9.81]")])
def test_one_number_for_gravity(dimension: int, wanted: str) -> None:
    with pytest.raises(md.MechdaeError) as error:
        from_dict({"schema": 1, "dimension": dimension, "gravity": 9.81})
    assert error.value.hint == f"gravity = {wanted}"


def test_millimetres_taken_for_metres_in_a_driver() -> None:
    problem = md.load("oscillating-cylinder")
    slides = [n for n, joint in problem.mechanism.joints.items() if joint.slides]
    driver = md.Driver(f"{slides[0]}.slide", from_=60.0, to=161.5)
    (note,) = driver_slips(md.Sweep(driver), problem.mechanism)
    assert "to = 161.5 is in metres" in note
    assert note.endswith("did you mean from_mm, to_mm?")
    assert not driver_slips(md.Sweep(replace(driver, from_=0.06, to=0.1615)), problem.mechanism)


@pytest.mark.parametrize("unit", IN_SI)
def test_every_suffix_of_si_is_a_factor_of_one_of_what_it_measures(unit: Unit) -> None:
    """A name is what is before the longest ending, and the unit is that of a quantity."""
    assert split_known(f"F{unit.suffix}", {"F"}) == ("F", unit.suffix)
    assert to_si(2.5, unit.suffix) == 2.5
    for si in unit.si:  # "N or N m" is that of what may push or turn
        assert all(powers_of(one) is not None or one in ("J", "W") for one in si.split(" or "))
    check_suffix(f"F{unit.suffix}", unit.si[0], "F")
