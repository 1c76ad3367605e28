"""Spatial mechanisms against reference data of 25 and more digits, and by what must hold."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.tasks.check import check
from tests.shared.paths import DATA
from tests.shared.space import (
    bennett,
    cardan,
    double_cardan,
    numbers,
    off,
    reference,
    rssp,
    rssr,
    sarrus,
)

PLACES, RATES, ACCELERATIONS = 1e-14, 1e-13, 1e-12


def at(data: dict[str, Any], row: dict[str, Any], key: str = "u") -> dict[str, Any]:
    """Return the keys of a driver at a row of the data."""
    rate = float(data.get("driver_acceleration", 0.0))
    return {"at": [float(row[key])], "speed": float(data["driver_speed"]), "acceleration": rate}


def solved(
    mechanism: md.Mechanism, driver: str, data: dict[str, Any], row: dict[str, Any], near: Any
) -> md.Result:
    """Return the pose of the mode for which `near` of the modes is least."""
    modes = md.solve(mechanism, md.Modes(driver=md.Driver(driver, at=[float(row["u"])])))
    label = ",".join(modes.labels[int(np.argmin(near(modes)))])
    task = md.Sweep(driver=md.Driver(driver, **at(data, row)), mode=label)
    result = md.solve(mechanism, task)
    assert list(result.status) == ["ok"]
    return result


def turned(angle: Any, wanted: str) -> Any:
    """Return by how much angles differ, whole turns left out."""
    return np.abs(np.exp(1j * np.asarray(angle)) - np.exp(1j * float(wanted)))


@pytest.mark.parametrize("name", ["rssr", "rssr_skew"])
def test_rssr(name: str) -> None:
    data = reference(name)
    mechanism = rssr(data["params"])
    for row in [row for row in data["rows"] if "C" in row]:

        def near(modes: md.Result) -> Any:
            return turned(modes.joints["D"].angle, row["rocker_angle"])  # noqa: B023

        result = solved(mechanism, "A.angle", data, row, near)
        C, D = result.points["rocker.C"], result.joints["D"]
        assert off(C.position[0], row["C"]) < PLACES
        assert off(result.points["bar.C"].velocity[0], row["C_velocity"]) < RATES
        assert off(C.acceleration[0], row["C_acceleration"]) < ACCELERATIONS
        assert off(D.angle_velocity[0], row["rocker_rate"]) < RATES
        assert off(D.angle_acceleration[0], row["rocker_acceleration"]) < ACCELERATIONS
        assert np.abs(C.position[0] - numbers(row["C"])).max() <= result.bound.length[0] < 1e-13
        spin = result.bodies["rocker"].angular_velocity[0]
        axis = numbers(data["params"]["axis_D"])
        assert off(spin, D.angle_velocity[0] * axis / np.linalg.norm(axis)) < RATES


def test_rssp() -> None:
    data = reference("rssp")
    mechanism = rssp(data["params"])
    for row in data["rows"]:

        def near(modes: md.Result) -> Any:
            return np.abs(modes.joints["G"].slide - float(row["slide"]))  # noqa: B023

        result = solved(mechanism, "A.angle", data, row, near)
        G = result.joints["G"]
        assert off(result.points["slider.C"].position[0], row["C"]) < PLACES
        assert off(G.slide[0], row["slide"]) < PLACES
        assert off(G.slide_velocity[0], row["slide_velocity"]) < RATES
        assert off(G.slide_acceleration[0], row["slide_acceleration"]) < ACCELERATIONS


@pytest.mark.parametrize("name", ["cardan", "cardan_oblique_pins"])
def test_cardan_joint(name: str) -> None:
    data = reference(name)
    mechanism = cardan(data["params"])
    sizes = [abs(float(row["out_acceleration"])) for row in data["rows"]]
    sizes.append(float(data["driver_speed"]) ** 2)
    for row in data["rows"]:

        def near(modes: md.Result) -> Any:
            return turned(modes.joints["E"].angle, row["out_angle"])  # noqa: B023

        result = solved(mechanism, "I.angle", data, row, near)
        E = result.joints["E"]
        assert turned(E.angle[0], row["out_angle"]) < PLACES
        assert off(E.angle_velocity[0], row["out_rate"]) < RATES
        gap = abs(E.angle_acceleration[0] - float(row["out_acceleration"]))
        assert gap < ACCELERATIONS * max(sizes)
        assert result.summary["superfluous"][0]["count"] == 3


@pytest.mark.parametrize("name", ["double_cardan_z", "double_cardan_general"])
def test_two_cardan_joints(name: str) -> None:
    data = reference(name)
    mechanism = double_cardan(data["params"])
    sizes = [abs(float(row["out_acceleration"])) for row in data["rows"]]
    sizes.append(float(data["driver_speed"]) ** 2)
    for row in data["rows"]:

        def near(modes: md.Result) -> Any:
            slide = np.abs(modes.joints["E"].slide - float(data["slide"]))
            return turned(modes.joints["E"].angle, row["out_angle"]) + slide  # noqa: B023

        result = solved(mechanism, "I.angle", data, row, near)
        E = result.joints["E"]
        assert turned(E.angle[0], row["out_angle"]) < PLACES
        assert off(E.slide[0], data["slide"]) < PLACES
        assert off(E.angle_velocity[0], row["out_rate"]) < RATES
        gap = abs(E.angle_acceleration[0] - float(row["out_acceleration"]))
        assert gap < ACCELERATIONS * max(sizes)


def test_bennett() -> None:
    data = reference("bennett_motion")
    mechanism = bennett(data["params"])
    for row in data["rows"]:
        task = md.Sweep(driver=md.Driver("P.angle", **at(data, row, "theta1")))
        result = md.solve(mechanism, task)
        assert list(result.status) == ["ok"]
        R, Q = result.points["two.R"], result.joints["Q"]
        assert off(R.position[0], row["joint3"]) < PLACES
        assert off(R.velocity[0], row["joint3_velocity"]) < RATES
        assert off(R.acceleration[0], row["joint3_acceleration"]) < ACCELERATIONS
        assert turned(Q.angle[0], row["theta2"]) < PLACES
        assert off(Q.angle_velocity[0], row["theta2_rate"]) < RATES
        for joint, angle in (("R", "theta3"), ("S", "theta4")):
            assert turned(result.joints[joint].angle[0], row[angle]) < PLACES
        assert result.summary["superfluous"] == [{"joints": ["P", "Q", "R", "S"], "count": 3}]


@pytest.mark.parametrize("name", ["sarrus_motion", "sarrus_unequal"])
def test_sarrus(name: str) -> None:
    data = reference(name)
    mechanism = sarrus(data["params"])
    for row in [row for row in data["rows"] if "mode" in row]:

        def near(modes: md.Result) -> Any:
            high = modes.points["platform.O"].position[:, 2]
            return np.abs(high - float(row["platform_z"]))  # noqa: B023

        result = solved(mechanism, "A1.angle", data, row, near)
        top, platform = result.points["platform.O"], result.bodies["platform"]
        assert off(top.position[0], [0, 0, float(row["platform_z"])]) < PLACES
        assert off(top.velocity[0], [0, 0, float(row["platform_velocity"])]) < RATES
        assert off(top.acceleration[0], [0, 0, float(row["platform_acceleration"])]) < ACCELERATIONS
        assert np.abs(platform.orientation[0] - [1, 0, 0, 0]).max() < PLACES
        assert result.summary["superfluous"][0]["count"] == 1


EXAMPLES = ("rssr", "bennett", "seven-link-loops", "spatial-slider-crank-loops")


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_files_run_as_printed(name: str) -> None:
    problem = md.load(DATA / "spatial" / "examples" / f"{name}.toml")
    for task in problem.tasks:
        result = md.solve(problem, task)
        assert result.fault is None
        assert set(result.status) == {"ok"}
        if name == "bennett" and task == "turn":  # by majorants 653
            assert result.summary["work"]["path_steps"] <= 350
    assert all(verdict.met for verdict in check(problem))
    assert md.dumps(problem)


def test_rates_are_the_derivatives_of_what_is_reported() -> None:
    """Quaternion and angular velocity by differences, a turn comes back to where it began."""
    data = reference("rssr")
    mechanism = rssr(data["params"])
    with pytest.raises(md.MechanismError, match="which assembly mode") as caught:
        md.solve(mechanism, md.Sweep(driver=md.Driver("A.angle", at=[0.0])))
    assert '"D.angle"' in caught.value.hint
    mechanism = replace(mechanism, sketch={"rocker.C": [0.12, 0.15, 0.15]})
    n = 3601
    driver = md.Driver("A.angle", from_=0.0, to=2 * np.pi, speed=1.0)
    result = md.solve(mechanism, md.Sweep(driver=driver, poses=n))
    h = 2 * np.pi / (n - 1)
    for body in ("crank", "rocker"):
        own = result.bodies[body]
        q = own.orientation
        assert np.abs(np.linalg.norm(q, axis=1) - 1).max() < 1e-15
        assert np.abs(np.diff(q, axis=0)).max() < 3 * h  # continuous in sign
        rate = (q[2:] - q[:-2]) / (2 * h)
        w, x, y, z = q[1:-1].T
        E = np.array([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
        assert (
            np.abs(2 * np.einsum("ijn,nj->ni", E, rate) - own.angular_velocity[1:-1]).max() < 1e-4
        )
        slope = (own.angular_velocity[2:] - own.angular_velocity[:-2]) / (2 * h)
        assert np.abs(slope - own.angular_acceleration[1:-1]).max() < 1e-4
    assert np.allclose(
        result.points["rocker.C"].position[0], result.points["rocker.C"].position[-1]
    )
    assert result.summary["work"]["unknowns"] == 1
    assert result.summary["work"]["path_steps"] <= 160


def rocker_angle(length: float, z: float, tilt: float, u: float) -> float:
    """Return the angle of the predefined RSSR's rocker on its second mode: P cos + Q sin = R."""
    B = np.array([0.05 * np.cos(u), 0.05 * np.sin(u), 0.0])
    axis = np.array([1.0, tilt, 0.0]) / np.hypot(1.0, tilt)
    normal = np.array([0.0, 1.0, 0.0]) - axis * axis[1]
    normal /= np.linalg.norm(normal)
    g = np.array([0.1, 0.25, 0.05]) + z * axis - B
    P, Q = 0.3 * normal @ g, 0.3 * np.cross(axis, normal) @ g
    return float(np.arctan2(Q, P) + np.arccos((length**2 - g @ g - 0.15**2) / np.hypot(P, Q)))


def test_sensitivities_and_studies() -> None:
    """By a length, a place and a direction, which is a literal zero, against the closed form."""
    names, middle, h = ("l", "rocker.C.z", "D.axis.y"), (0.3, 0.02, 0.0), 1e-5
    asked = md.Sensitivity(of="poses", outputs=["joints/D/angle"], wrt=list(names))
    found = md.solve("rssr", asked).data["derivatives"]["joints/D/angle"]
    drivers = md.solve("rssr", "poses").drivers["A.angle"].position
    for k, name in enumerate(names):
        for row, u in enumerate(drivers):
            up, down = ([v + s * h * (i == k) for i, v in enumerate(middle)] for s in (1, -1))
            slope = (rocker_angle(*up, u) - rocker_angle(*down, u)) / (2 * h)
            assert found[name][row] == pytest.approx(slope, rel=1e-7), name
    study = md.Study(of="poses", vary={"l": [0.29, 0.31, 3]}, outputs=["joints/D/angle"])
    table = md.solve("rssr", study).table["joints/D/angle"]
    wanted = [[rocker_angle(size, 0.02, 0.0, u) for u in drivers] for size in (0.29, 0.3, 0.31)]
    assert np.abs(np.exp(1j * table) - np.exp(1j * np.array(wanted))).max() < 1e-14


# -- swing and stroke ----------------------------------------------------------------------------


def test_the_swing_of_a_rocker_in_space_is_that_of_its_closed_form() -> None:
    """|B - C| = l gives P cos t + Q sin t = S for the rocker's angle t of each crank angle."""
    r, bar, rocker = 0.05, 0.3, 0.15
    D = np.array([0.1, 0.25, 0.05], np.longdouble)
    result = md.solve("rssr", "turn")

    def angle(u: Any, side: int = 1) -> Any:
        u = np.asarray(u, np.longdouble)
        x, y, z = D[0] + 0.02 - r * np.cos(u), D[1] - r * np.sin(u), D[2] + 0 * u
        P, Q = 2 * rocker * y, 2 * rocker * z
        S = bar**2 - rocker**2 - x**2 - y**2 - z**2
        return np.arctan2(Q, P) + side * np.arccos(S / np.hypot(P, Q))

    told = np.asarray(result.joints["D"].angle)
    side = 1 if np.abs(angle(result.drivers["A.angle"].position, 1) - told).max() < 1e-9 else -1
    grid = np.linspace(0, 2 * np.pi, 4001)
    ends = []
    for sense in (1, -1):  # a parabola through three places of ever narrower brackets
        middle, step = grid[int(np.argmax(sense * angle(grid, side)))], grid[1] - grid[0]
        for _ in range(4):
            low, here, high = angle(np.array([middle - step, middle, middle + step]), side)
            middle += step * float((low - high) / (2 * (low - 2 * here + high)))
            step /= 8
        ends.append(angle(middle, side))
    assert result.summary["swing"]["D"] == pytest.approx(float(ends[0] - ends[1]), abs=1e-14)
    assert result.summary["swing"]["A"] == pytest.approx(2 * np.pi, rel=1e-15)


def test_coordinates_of_one_joint_are_told_apart() -> None:
    """A screw has an angle and a slide; a cross of a shaft bent by b two angles from -b to b."""
    press = md.solve("screw-press", "stroke").summary
    assert set(press["swing"]) == {"nut", "thread"}
    assert press["stroke"]["guide"] == pytest.approx(0.02, rel=1e-13)
    cross = md.solve("cardan-joint", "turn").summary["swing"]
    bend = np.arctan2(3, 4)
    assert cross["U.angle"] == pytest.approx(2 * bend, abs=1e-13)
    assert cross["U.angle2"] == pytest.approx(2 * bend, abs=1e-13)
