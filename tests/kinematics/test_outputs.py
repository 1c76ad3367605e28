"""Named outputs: values and rates against closed forms, pruning, files, errors."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from math import factorial

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.expression_units import output_unit
from mechdae.describe.file import library
from mechdae.describe.file.load import from_dict
from mechdae.results.tables import table
from mechdae.tasks.check import check
from mechdae.tasks.export import csv_text, save
from mechdae.tasks.show import structure
from tests.reference.closed_forms import four_bar
from tests.reference.jets import Jet, sqrt

LONG = np.longdouble
OUTPUTS = {
    "Theta": "rocker.angle - coupler.angle",
    "w": "rocker.angle.speed",
    "power": "k*w*Theta + t",
    "reach": "hypot(coupler.P.x, coupler.P.y)",
    "push": "coupler.P.x.acceleration",
}


def crank_rocker(**outputs: str):
    problem = md.load("four-bar-crank-rocker")
    mechanism = replace(
        problem.mechanism,
        parameters=problem.mechanism.parameters.with_("k", 2.5),
        outputs={**OUTPUTS, **outputs},
    )
    return replace(problem, mechanism=mechanism, expected=())


def closed(t: np.ndarray, law) -> dict[str, Jet]:
    """Return the outputs as series in time, for the crank's angle as a series in time."""
    parts = four_bar(law(t), 0.04, 0.12, 0.08, 0.1, 0.06, 0.04)
    theta = parts["rocker"] - parts["coupler"]
    w = derivative(parts["rocker"])
    x, y = parts["coupler.P"].map(np.real), parts["coupler.P"].map(np.imag)
    return {
        "Theta": theta,
        "w": w,
        "power": cut(w) * cut(theta) * 2.5 + Jet([t, 1 + 0 * t, 0 * t, 0 * t][: len(w.c)]),
        "reach": sqrt(x * x + y * y),
        "push": derivative(derivative(x)),
    }


def derivative(series: Jet) -> Jet:
    return Jet([(k + 1) * series.c[k + 1] for k in range(len(series.c) - 1)])


def cut(series: Jet) -> Jet:
    return Jet(series.c[:3])


def agrees(result: md.Result, expected: dict[str, Jet], derivatives: int) -> int:
    compared = 0
    for name, series in expected.items():
        found = result.outputs[name]
        order = {"w": 1, "power": 1, "push": 2}.get(name, 0)
        assert list(found) == ["value", "rate", "second", "third"][: derivatives + 1 - order]
        for k, key in enumerate(found):
            theirs = np.asarray(series.c[k] * factorial(k), dtype=LONG)
            size = float(np.abs(theirs).max())
            assert np.abs(found[key] - theirs).max() < 2e-14 * (1 + size), (name, key)
            compared += 1
    return compared


@pytest.mark.parametrize("derivatives", [2, 3])
def test_values_and_rates_at_constant_speed(derivatives: int) -> None:
    problem = crank_rocker()
    driver = md.Driver("crank.angle", from_=0.3, to=5.0, speed=2.0)
    result = md.solve(problem, md.Sweep(driver, poses=48, derivatives=derivatives))
    u = result.drivers["crank.angle"].position
    t = (np.asarray(u, LONG) - LONG(u[0])) / 2

    def law(t):
        return Jet([np.asarray(u, LONG), 2 + 0 * t, 0 * t, 0 * t])

    assert agrees(result, closed(t, law), derivatives) == {2: 11, 3: 16}[derivatives]


def test_values_and_rates_by_a_law_of_time() -> None:
    times = [0.0, 0.2, 0.7]
    driver = md.Driver("crank.angle", law="1 + t + t**2/2", times=times)
    result = md.solve(crank_rocker(), md.Sweep(driver, derivatives=3))

    def law(t):
        return Jet([1 + t + t * t / 2, 1 + t, 0.5 + 0 * t, 0 * t])

    assert agrees(result, closed(np.array(times, dtype=LONG), law), 3) == 16


def test_two_drivers_have_rates_in_time() -> None:
    """A slide on a slide: the diagonal s = hypot(x, y) of x = 1 + 2 t, y = 2 + 3 t."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[md.Body("x", points={"P": [0, 0]}), md.Body("y", points={"P": [0, 0]})],
        joints=[
            md.Prismatic("gx", "ground.O", "x.P"),
            md.Prismatic("gy", "x.P", "y.P", axis=np.pi / 2),
        ],
        outputs={"s": "hypot(gx.slide, gy.slide)", "v": "gx.slide.speed + gy.slide.speed"},
    )
    drivers = [
        md.Driver("gx.slide", from_=1, to=3, speed=2),
        md.Driver("gy.slide", from_=2, to=5, speed=3),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers, poses=2, outputs=["s", "v"]))
    assert not result.points
    x, y = np.array([1.0, 3.0]), np.array([2.0, 5.0])
    s = np.hypot(x, y)
    rate = (2 * x + 3 * y) / s
    assert result.outputs["s"].value == pytest.approx(s, rel=1e-15)
    assert result.outputs["s"].rate == pytest.approx(rate, rel=1e-14)
    assert result.outputs["s"].second == pytest.approx((13 - rate**2) / s, rel=1e-12)
    assert result.outputs["v"].value.tolist() == [5, 5]
    assert result.outputs["v"].rate.tolist() == [0, 0]


# -- which ones are computed -------------------------------------------------------------------


def test_only_the_groups_an_output_depends_on_are_in_the_scene() -> None:
    problem = md.load("gorshkov-seven-link")
    mechanism = replace(problem.mechanism, outputs={"GA": "slot.slide", "x": "slider.C.x.speed"})
    sweep = replace(problem.tasks["turn"], poses=3)
    one = md.solve(mechanism, replace(sweep, outputs=["GA"]))
    assert set(one.outputs) == {"GA"}
    assert not any((one.bodies, one.points, one.joints))
    assert one.summary["not_in_scene"] == ["connecting_rod", "slider", "coupler", "rocker"]
    two = md.solve(mechanism, replace(sweep, outputs=["x", "slot"]))
    assert two.summary["not_in_scene"] == ["coupler", "rocker"]
    assert set(two.outputs) == {"x"}
    assert set(two.joints) == {"slot"}
    every = md.solve(mechanism, replace(sweep, outputs=None, driver=problem.tasks["pose"].driver))
    assert set(every.outputs) == {"GA", "x"}
    assert np.array_equal(every.outputs["GA"].rate, every.joints["slot"].slide_velocity)
    whole = md.Problem(mechanism, {"one": replace(sweep, outputs=["x"])})
    assert structure(whole)["tasks"]["one"]["builds"][-1] == "outputs x"


def test_a_mechanism_without_outputs_has_none() -> None:
    result = md.solve("slider-crank", "turn", poses=3)
    assert not result.outputs
    assert "outputs" not in result.to_dict()


def test_a_name_of_a_body_and_of_an_output_means_both() -> None:
    problem = crank_rocker(rocker="rocker.angle*2")
    result = md.solve(problem, replace(problem.tasks["turn"], poses=3, outputs=["rocker"]))
    assert set(result.bodies) == set(result.outputs) == {"rocker"}
    assert np.array_equal(result.outputs["rocker"].value, 2 * result.bodies["rocker"].angle)


def test_modes_have_the_values_of_outputs_without_speeds() -> None:
    problem = crank_rocker()
    result = md.solve(problem, "modes")
    assert set(result.outputs) == {"Theta", "reach"}
    assert list(result.outputs["Theta"]) == ["value"]
    difference = result.bodies["rocker"].angle - result.bodies["coupler"].angle
    assert result.outputs["Theta"].value == pytest.approx(difference, rel=1e-15)
    with pytest.raises(md.InputError, match="speed") as caught:
        md.solve(problem, replace(problem.tasks["modes"], outputs=["w"]))
    assert "outputs.w" in str(caught.value)


def test_rates_that_are_not_there_leave_an_output_out_with_a_note() -> None:
    problem = crank_rocker()
    sweep = replace(problem.tasks["turn"], poses=3, derivatives=0)
    result = md.solve(problem, sweep)
    assert set(result.outputs) == {"Theta", "reach"}
    assert [note.split(" ")[0] for note in result.summary["notes"]] == [
        "outputs.w",
        "outputs.power",
        "outputs.push",
    ]
    with pytest.raises(md.InputError, match="derivatives = 2"):
        md.solve(problem, replace(sweep, outputs=["push"]))


def test_time_needs_a_law_or_a_constant_speed() -> None:
    problem = crank_rocker()
    driver = md.Driver("crank.angle", at=[0.5, 1.0], speed=2.0, acceleration=1.0)
    result = md.solve(problem, md.Sweep(driver))
    assert "power" not in result.outputs
    assert "no time" in result.summary["notes"][0]
    with pytest.raises(md.InputError, match="no time"):
        md.solve(problem, md.Sweep(driver, outputs=["power"]))


def test_only_certified_poses_have_values() -> None:
    """At a limit position there is a value and no rate, beyond it nothing, whatever min says."""
    problem = md.load("four-bar-double-rocker")
    outputs = {"low": "min(right.angle, 10)", "turn": "sign(right.angle.speed)", "two": "1 + 1"}
    mechanism = replace(problem.mechanism, outputs=outputs)
    result = md.solve(mechanism, replace(problem.tasks["window"], poses=5))
    assert list(result.status) == ["limit", "ok", "ok", "ok", "limit"]
    assert result.outputs["low"].value == pytest.approx(result.bodies["right"].angle)
    assert np.isnan(result.outputs["low"].rate[[0, -1]]).all()
    assert np.isnan(result.outputs["turn"].value[[0, -1]]).all()
    assert set(np.abs(result.outputs["turn"].value[1:-1])) == {1.0}
    assert result.outputs["two"].value.tolist() == [2] * 5
    far = replace(problem.tasks["pose"], driver=md.Driver("left.angle", at=[0.3, 2.0]))
    lost = md.solve(mechanism, far)
    assert list(lost.status) == ["ok", "unassembled"]
    for series in lost.outputs.values():
        assert np.isfinite(series.value[0])
        assert np.isnan(series.value[1])


def test_an_output_without_a_finite_value_is_said() -> None:
    problem = crank_rocker(root="sqrt(rocker.C.x - 0.1)")
    result = md.solve(problem, "turn", poses=9)
    value = result.outputs["root"].value
    outside = result.points["rocker.C"].position[:, 0] < 0.1
    assert np.array_equal(np.isnan(value), outside)
    assert outside.any()
    count = int(outside.sum())
    text = f"outputs.root has no finite value at {count} of 9 poses"
    assert text in result.summary["notes"]


# -- where they can be named ----------------------------------------------------------------------


def test_paths_files_and_tables(tmp_path) -> None:
    problem = crank_rocker()
    result = md.solve(problem, "turn", poses=5)
    assert result.value("Theta") == result.value("outputs/Theta/value")
    assert result.value("Theta/rate") == result.outputs["Theta"].rate.tolist()
    with pytest.raises(md.UnknownName, match="Theta"):
        result.value("outputs/Thta/value")
    head = csv_text(result).split("\n")[0].split(",")
    assert {"Theta.value [rad]", "Theta.second [rad/s2]", "w.rate [rad/s2]"} <= set(head)
    assert {"power.value", "reach.value [m]", "push.value [m/s2]"} <= set(head)
    paths = save(result, tmp_path)
    packed = np.load(next(path for path in paths if path.suffix == ".npz"))
    assert np.array_equal(packed["Theta.rate"], result.outputs["Theta"].rate)
    assert "Theta [deg]" in table(result)
    single = md.solve(problem, md.Sweep(md.Driver("crank.angle", at=[1.0]), outputs=["power"]))
    assert "power" in table(single)


def test_expected_values_may_name_outputs() -> None:
    data = tomllib.loads(library.find("four-bar-crank-rocker").read_text())
    data["outputs"] = {"psi": "rocker.angle"}
    value = next(e["value"] for e in data["expected"] if e["what"] == "bodies/rocker/angle")
    entry = {"task": "turn", "at_deg": 40, "value": value, "rel": 1e-12}
    data["expected"] = [
        {**entry, "what": "outputs/psi/value"},
        {**entry, "what": "psi"},
        {**entry, "what": "psi", "value": 1.01 * value},
        {**entry, "what": "outputs/phi/value"},
    ]
    verdicts = check(from_dict(data))
    assert [verdict.met for verdict in verdicts] == [True, True, False, False]
    assert "did you mean outputs/psi" in verdicts[3].note


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("rocker.angle - 2*coupler.angle + 0.3", "rad"),
        ("rocker.C.x.speed", "m/s"),
        ("rocker.C.x.speed*rocker.angle", "m rad/s"),
        ("sqrt(rocker.C.x**2 + rocker.C.y**2)", "m"),
        ("rocker.angle.acceleration/rocker.angle.speed**2", "1/rad"),
        ("sin(rocker.angle)", "1"),
        ("atan2(rocker.C.y, rocker.C.x)", "rad"),
        ("rocker.C.x + rocker.angle", ""),
        ("k*rocker.angle", ""),
        ("max(Theta, 0)/t", "rad/s"),
        ("pi", ""),
    ],
)
def test_units_follow_where_they_can(text: str, unit: str) -> None:
    mechanism = crank_rocker(this=text).mechanism
    assert output_unit(mechanism, "this") == unit
    if unit == "m/s":
        assert output_unit(mechanism, "this", 1) == "m/s2"


# -- errors --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("outputs", "words"),
    [
        ({"mu": "rocker.angel"}, ["outputs.mu", "rocker.angle"]),
        ({"mu": "rocker.angle.sped"}, ["outputs.mu", "rocker.angle.speed"]),
        ({"mu": "Theta + Thet"}, ["outputs.mu", "Theta"]),
        ({"mu": "nu + 1", "nu": "2*mu"}, ["circle: mu -> nu -> mu"]),
        ({"mu": "mu"}, ["outputs.mu", "circle: mu -> mu"]),
        ({"k": "rocker.angle", "mu": "2*k"}, ["outputs.power", "'k' is a parameter and a named"]),
        ({"m/u": "rocker.angle"}, ["outputs.m/u", "not a name"]),
        ({"t": "rocker.angle"}, ["outputs.t", "reserved"]),
        ({"mu": 3}, ["outputs.mu", "in quotes"]),
        ({"mu": "rocker.angle if 1 else 2"}, ["outputs.mu", "arithmetic"]),
    ],
)
def test_bad_outputs_are_refused(outputs: dict, words: list[str]) -> None:
    with pytest.raises(md.InputError) as caught:
        crank_rocker(**outputs)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("text", ["rocker.angle*(1/0)", "max(rocker.angle)", "sin()"])
def test_outputs_that_cannot_be_built_are_refused(text: str) -> None:
    with pytest.raises(md.InputError, match=r"^outputs\.mu"):
        md.solve(crank_rocker(mu=text), "turn", poses=3)


def test_an_unknown_output_of_a_task_is_answered_with_the_nearest() -> None:
    problem = crank_rocker()
    with pytest.raises(md.UnknownName, match="Theta"):
        md.solve(problem, replace(problem.tasks["turn"], outputs=["Thetta"]))
