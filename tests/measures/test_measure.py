"""What is computed of a sweep, what is said of it, and how far it goes."""

from __future__ import annotations

from dataclasses import replace
from math import acos

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.schema import schema
from mechdae.describe.tasks.kinds import MEASURES
from mechdae.motion.kinematics.prepared import prepare
from mechdae.results.tables import table
from tests.reference.closed_forms import four_bar
from tests.shared.measured import measured

OF_SPACE = ("axodes", "screw-axes")
RATIOS = ("velocity-ratio", "mechanical-advantage")
IN_PLANE = tuple(name for name in MEASURES if name not in (*OF_SPACE, *RATIOS))


def test_nothing_is_computed_unless_asked_for() -> None:
    problem = md.load("four-bar-crank-rocker")
    plain = md.solve(problem, "turn", poses=3)
    words = {"transmission", "extremes", "time_ratio", "dwell", "envelope", "curve", "centrodes"}
    assert not words & set(plain.summary)
    assert "centres" not in plain.to_dict()
    bare = prepare(problem, problem.tasks["turn"])
    asked = prepare(problem, replace(problem.tasks["turn"], measures=["transmission"]))
    assert bare.graphs.ny == sum(len(entry.columns) for entry in bare.outputs.entries)
    assert not any(entry.kind == "hidden" for entry in bare.outputs.entries)
    assert asked.graphs.ny == bare.graphs.ny + 2 + 3  # two lines, three turns
    assert (bare.graphs.derivatives, asked.graphs.derivatives) == (2, 2)
    curve = prepare(problem, replace(problem.tasks["turn"], measures=["curve"]))
    assert curve.graphs.derivatives == 3


def test_measures_bring_their_own_rates() -> None:
    """A sweep without velocities still has extremes and curvatures, and reports no rates."""
    result = measured("four-bar-crank-rocker", *IN_PLANE, derivatives=0, poses=9)
    whole = measured("four-bar-crank-rocker", *IN_PLANE, poses=9)
    assert list(result.points["coupler.P"]) == ["position", "tangent", "curvature"]
    assert list(result.bodies["rocker"]) == ["angle", "centrode_fixed", "centrode_moving"]
    assert list(result.drivers["crank.angle"]) == ["position"]
    for word in ("extremes", "time_ratio", "dwell", "envelope", "curve", "transmission"):
        assert result.summary[word] == whole.summary[word]


def test_poses_that_are_not_reached_have_no_measures() -> None:
    driver = md.Driver("left.angle", at=[0.2, 2.5])
    problem = md.load("four-bar-double-rocker")
    result = md.solve(problem, md.Sweep(driver, measures=IN_PLANE))
    assert list(result.status) == ["ok", "unassembled"]
    for array in (
        result.joints["C"].transmission_angle,
        result.points["coupler.P"].curvature,
        result.bodies["coupler"].centrode_fixed[:, 0],
        result.centres["left-right"][:, 0],
    ):
        assert np.isfinite(array[0])
        assert np.isnan(array[1])


def test_one_pose_has_no_range() -> None:
    driver = md.Driver("crank.angle", at=[0.4])
    result = md.solve("four-bar-crank-rocker", md.Sweep(driver, measures=IN_PLANE))
    assert "single value of the driver" in result.summary["notes"][0]
    assert "extremes" not in result.summary
    assert np.isfinite(result.joints["C"].transmission_angle[0])


def test_several_drivers_have_the_measures_of_single_poses() -> None:
    """A two-link arm, both angles driven: the tip's path and the fore-arm's centre."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("arm", points={"O": [0, 0], "E": [1, 0]}),
            md.Body("fore", points={"E": [0, 0], "T": [1, 0]}),
        ],
        joints=[md.Revolute("O", "ground.O", "arm.O"), md.Revolute("E", "arm.E", "fore.E")],
    )
    drivers = [
        md.Driver("arm.angle", from_=0, to=1, speed=1),
        md.Driver("E.angle", from_=0.5, to=2.5, speed=2),
    ]
    sweep = md.Sweep(drivers=drivers, poses=3, measures=["centrodes", "curve"])
    result = md.solve(mechanism, sweep)
    # omega of the fore-arm is 3: its centre is two thirds of the way from E back to O
    u = result.drivers["arm.angle"].position
    pole = np.stack([np.cos(u), np.sin(u)], axis=1) * (2 / 3)
    assert result.bodies["fore"].centrode_fixed == pytest.approx(pole, abs=1e-15)
    v = result.points["fore.T"].velocity
    assert result.points["fore.T"].tangent == pytest.approx(np.arctan2(v[:, 1], v[:, 0]))
    with pytest.raises(md.UnavailableError, match="'dwell' needs a single driver"):
        md.solve(mechanism, replace(sweep, measures=["dwell"]))


def test_unknown_measures_are_answered_with_the_nearest() -> None:
    driver = md.Driver("crank.angle", at=[0.0])
    with pytest.raises(md.UnknownName, match="'centrode'") as caught:
        md.Sweep(driver, measures=["centrode"])
    assert "centrodes" in str(caught.value)
    assert "measures" in str(caught.value)
    entry = next(
        task
        for task in schema()["properties"]["tasks"]["additionalProperties"]["oneOf"]
        if task["properties"]["kind"]["const"] == "sweep"
    )
    assert entry["properties"]["measures"]["items"]["enum"] == list(MEASURES)


def test_lines_for_the_terminal() -> None:
    text = table(measured("slider-crank", *IN_PLANE, poses=3))
    for line in (
        "  transmission angle C: least 70.5287794 deg at 90 deg, greatest 90 deg at 0 deg",
        "  extremes  guide.slide: 0.2 m at 180 deg .. 0.4 m at 0 deg",
        "  time ratio guide: 1 (return in 180 deg)",
        "  envelope  x -0.1 .. 0.4 m, y -0.1 .. 0.1 m",
        "  curve     slider.C: length 0.4 m, closed, area 0 m2",
        "  centre    rod: at infinity at 90 deg, 270 deg",
        "  stationary 180 deg: guide.slide min 0.2 m",
    ):
        assert line in text, line
    edge = np.degrees(acos((0.1**2 + 0.396**2 - 0.3**2) / (2 * 0.1 * 0.396)))
    assert f"dwell     guide: {-edge:.6g} deg .. {edge:.6g} deg at 0.398 m +- 0.002 m" in text


def loose_four_bar(a: float, b: float, c: float, d: float, crank: float, sign: int):
    parts = four_bar(np.array([crank]), a, b, c, d, 0.3, 0.4, sign)
    return md.Mechanism(
        ground=md.Ground(points={"A": [0, 0], "D": [d, 0]}),
        bodies=[
            md.Body("crank", points={"A": [0, 0], "B": [a, 0]}),
            md.Body("coupler", points={"B": [0, 0], "C": [b, 0], "P": [0.3, 0.4]}),
            md.Body("rocker", points={"D": [0, 0], "C": [c, 0]}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={name: float(parts[name][0]) for name in ("crank", "coupler", "rocker")},
    )


@pytest.mark.parametrize(
    ("sizes", "crank", "sign"),
    [
        (
            (0.224072382971274, 1.1197442375383306, 0.20155958866287726, 0.8543731552197638),
            2.04,
            -1,
        ),
        (
            (0.26558553775542726, 0.2558903343759978, 0.8889523243235484, 0.8203268186736603),
            3.5,
            -1,
        ),
    ],
)
def test_limit_positions_cost_no_more_than_they_should(sizes, crank: float, sign: int) -> None:
    """Speeds grow without bound towards limits; neither samples nor zeros may run after them."""
    mechanism = loose_four_bar(*sizes, crank, sign)
    driver = md.Driver("crank.angle", range="assembled")
    plain = md.solve(mechanism, md.Sweep(driver, poses=201))
    result = md.solve(mechanism, md.Sweep(driver, poses=5, measures=IN_PLANE))
    assert "notes" not in result.summary
    assert result.summary["work"]["pose_evaluations"] < 30_000
    assert result.summary["transmission"]["C"]["min"] == pytest.approx(0, abs=1e-14)
    for name, series in plain.bodies.items():
        found = result.summary["extremes"][f"{name}.angle"]
        assert found["min"]["value"] <= series.angle.min() + 1e-14
        assert found["max"]["value"] >= series.angle.max() - 1e-14
        ends = sorted(found[word]["value"] for word in ("min", "max"))
        assert np.ptp(series.angle) == pytest.approx(ends[1] - ends[0], rel=1e-2)


def test_the_driven_slide_goes_as_far_as_the_mechanism() -> None:
    """Crank and rod in line at 0.12 m and 0.06 m: beyond there is no stroke and no path."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0), "B": (0.03, 0)}), md.Body("slider", {"C": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Distance("bar", "crank.B", "slider.C", length=0.09),
            md.Prismatic("guide", "ground.O", "slider.C"),
        ],
        sketch={"crank": 1.0, "guide": 0.1},
    )
    driver = md.Driver("guide.slide", from_=0.05, to=0.125)
    summary = md.solve(mechanism, md.Sweep(driver, poses=11, measures=("curve",))).summary
    assert summary["limits"] == pytest.approx([0.06, 0.12], rel=1e-12)
    assert summary["stroke"]["guide"] == pytest.approx(0.06, rel=1e-12)
    assert summary["curve"]["slider.C"]["length"] == pytest.approx(0.06, rel=1e-12)


def test_the_crank_goes_as_far_as_the_change_point_where_it_stops() -> None:
    problem = md.load("change-point-parallelogram")
    task = replace(
        problem.tasks["turn"], on_change_point="stop", measures=("curve",),
        driver=md.Driver("crank.angle", from_=1.0, to=14.0),
    )  # fmt: skip
    summary = md.solve(problem.mechanism, task).summary
    for part in ("crank", "rocker"):
        assert summary["swing"][part] == pytest.approx(np.pi - 1, rel=1e-9)
    for pin in ("crank.B", "coupler.B"):
        assert summary["curve"][pin]["length"] == pytest.approx(np.pi - 1, rel=1e-9)


def test_a_rest_between_two_change_points_is_one_event() -> None:
    problem = md.load("change-point-parallelogram")
    driver = md.Driver("crank.angle", from_=np.pi / 3, to=10 * np.pi / 3)
    task = replace(
        problem.tasks["turn"], on_change_point="switch", driver=driver, measures=("extremes",)
    )
    events = md.solve(problem.mechanism.with_values({"a": 0.04, "b": 0.1}), task).events
    rests = [event["rest"] for event in events if "rest" in event]
    assert rests == [pytest.approx([2 * np.pi, 3 * np.pi], abs=1e-9)]
