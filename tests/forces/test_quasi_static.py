"""Forces of tasks whose drivers have no speed: those of a slow motion, without inertia."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, sin, sqrt

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.values import Table
from tests.attack.held_forces import CLOSE, worst
from tests.reference.virtual_work import Burden, Frame, along, dyad, efforts, planar
from tests.shared.held import FAMILIES
from tests.shared.live import in_page
from tests.shared.node import needs_node
from tests.shared.paths import DATA

CASES = DATA / "forces"
G = 9.81


@pytest.mark.parametrize("family", FAMILIES)
def test_what_holds_a_mechanism_is_virtual_work(family: str) -> None:
    assert worst(family, 4) < CLOSE


# -- cases -----------------------------------------------------------------------------------------


def triangle(a: float, b: float, side: float) -> float:
    """Return the angle between the sides a and b opposite of a side."""
    c = (a * a + b * b - side * side) / (2 * a * b)
    return atan2(sqrt(1 - c * c), c)


def held_boom(
    length: float, anchor: tuple[float, float], pin: tuple[float, float],
    centre: tuple[float, float], mass: float,
) -> float:  # fmt: skip
    """Return the force of a cylinder: moments about the boom's hinge, the angle by the cosines."""
    a, b = sqrt(anchor[0] ** 2 + anchor[1] ** 2), sqrt(pin[0] ** 2 + pin[1] ** 2)
    turn = atan2(anchor[1], anchor[0]) + triangle(a, b, length) - atan2(pin[1], pin[0])
    lever = a * b * sin(triangle(a, b, length)) / length
    return mass * G * (centre[0] * cos(turn) - centre[1] * sin(turn)) / lever


def test_a_cylinder_holds_a_boom() -> None:
    found = md.solve(md.load(CASES / "boom-on-a-cylinder.toml"), "hold")
    wanted = [held_boom(own, (0.6, -0.3), (2.2, 0.5), (2.4, 0.4), 1200) for own in (2.0, 2.2)]
    assert wanted == pytest.approx([38262.5646, 29338.5681], abs=1e-3)  # by hand, 9 digits
    assert found.efforts["cyl.slide"] == pytest.approx(wanted, rel=1e-12)
    found = md.solve(md.load(CASES / "hold-without-speed.toml"), "hold")
    wanted = [held_boom(1.05, (0.4, -0.5), (1.0, 0.0), (1.5, 0.0), 300)]
    assert wanted == pytest.approx([6771.289354733079], rel=1e-14)
    assert found.efforts["ram.slide"] == pytest.approx(wanted, rel=1e-12)


def excavator(u: np.ndarray) -> dict[str, Frame]:
    """Return the links of the excavator over the lengths of its cylinders: four triangles."""

    def link(at: np.ndarray, far: np.ndarray, local: np.ndarray) -> Frame:
        way = far - at
        return planar(at, atan2(way[1], way[0]) - atan2(local[1], local[0]))

    hinge, Cb = np.zeros(2), np.array([0.6, -0.3])
    kb, ka = np.array([2.2, 0.5]), np.array([-0.6, 0.15])
    t = np.array([-0.1368, 0.3759])
    Kb = dyad(hinge, Cb, float(np.hypot(*kb)), u[0], 1)
    boom = link(hinge, Kb, kb)
    A, Ca = boom.place(np.array([5.0, 0])), boom.place(np.array([2.0, 0.9]))
    Ka = dyad(A, Ca, float(np.hypot(*ka)), u[1], -1)
    arm = link(A, Ka, ka)
    R, Q, Cq = (arm.place(np.array(own)) for own in ([2.2, 0], [2.6, 0], [0.3, 0.45]))
    S = dyad(R, Cq, 0.5, u[2], -1)
    T = dyad(S, Q, 0.62, float(np.hypot(*t)), 1)
    found = {"boom": boom, "arm": arm, "bucket": link(Q, T, t)}
    found |= {"rocker": along(R, S), "hlink": along(S, T)}
    for k, (start, end) in enumerate(((Cb, Kb), (Ca, Ka), (Cq, S)), start=1):
        found[f"bar{k}"] = along(start, end)
        found[f"rod{k}"] = planar(end, found[f"bar{k}"].angle)
    return found


def test_three_cylinders_hold_an_excavator() -> None:
    problem = md.load(CASES / "excavator.toml")
    found = md.solve(problem, "forces")
    places = [(2.1, 3.3, 1.75), (2.2, 3.35, 1.8), (2.3, 3.4, 1.85)]
    masses = {
        "boom": (1200.0, (2.4, 0.4)), "arm": (600.0, (0.9, 0.1)), "rocker": (30.0, (0.25, 0.0)),
        "hlink": (35.0, (0.31, 0.0)), "bucket": (500.0, (0.6, 0.3)),
    }  # fmt: skip
    masses |= {f"bar{k}": (60.0, (0.6, 0.0)) for k in (1, 2, 3)}
    masses |= {f"rod{k}": (60.0, (-0.6, 0.0)) for k in (1, 2, 3)}
    burden = Burden(np.array([0, -G]), {k: (m, np.array(c)) for k, (m, c) in masses.items()})
    wanted = np.array([efforts(excavator, burden, np.array(own)) for own in places])
    assert wanted[0] == pytest.approx([134.3e3, -13.3e3, -2.7e3], rel=2e-3)
    ours = np.stack([found.efforts[f"cyl{k}.slide"] for k in (1, 2, 3)], axis=1)
    assert ours == pytest.approx(wanted, rel=1e-7)
    still = [replace(own, speed=0.0) for own in problem.task("forces").all_drivers]
    rests = md.solve(problem.mechanism, replace(problem.task("forces"), drivers=tuple(still)))
    again = np.stack([rests.efforts[f"cyl{k}.slide"] for k in (1, 2, 3)], axis=1)
    assert again == pytest.approx(ours, rel=1e-13)


# -- all places that compute forces ----------------------------------------------------------------


def arm(**driver: object) -> md.Problem:
    """Return an arm with a mass, a spring with damping, friction in its pin, and tasks."""
    return from_dict({
        "schema": 1,
        "parameters": {"m": 3.0, "c": 0.4, "k": 50.0},
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0], "H": [0, 1]}},
        "bodies": {
            "arm": {"points": {"O": [0, 0], "K": [0.3, 0]}, "mass": "m", "center": ["c", 0.1],
                    "inertia": 0.2},
        },
        "joints": {
            "O": {"kind": "revolute", "between": ["ground.O", "arm.O"], "friction": 0.2,
                  "pin_radius": 0.05},
        },
        "sketch": {"arm": 0.3},
        "loads": {
            "pull": {"kind": "spring", "between": ["ground.H", "arm.K"], "stiffness": "k",
                     "free_length": 0.5, "damping": 40.0},
            "rub": {"kind": "resistance", "coordinate": "arm.angle", "positive": 2.0,
                    "negative": 1.0},
        },
        "tasks": {
            "hold": {"kind": "reactions",
                     "driver": {"coordinate": "arm.angle", "at": [0.3], **driver}},
            "lift": {"kind": "reactions", "cycle": True,
                     "driver": {"coordinate": "arm.angle", "from": 0.2, "to": 0.9, **driver}},
        },
    })  # fmt: skip


def holds(q: float = 0.3, sense: int = 1, speed: float = 0.0, m: float = 3.0) -> float:
    """Return the torque that turns the arm: moments about its pin, friction of the circle.

    R is the force of the pin: effort = moment of the loads + resistance + rho |R|.
    """
    e, n = np.array([cos(q), sin(q)]), np.array([-sin(q), cos(q)])
    centre, K = 0.4 * e + 0.1 * n, 0.3 * e
    gap = np.array([0, 1.0]) - K
    length = float(np.hypot(*gap))
    rate = -float(gap @ (0.3 * n)) * speed / length
    pull = (50 * (length - 0.5) + 40 * rate) * gap / length
    weight = np.array([0, -m * G])
    gained = m * -(speed**2) * centre  # mass times acceleration, at constant speed
    R = gained - weight - pull
    moment = -(centre[0] * weight[1] - centre[1] * weight[0]) - (K[0] * pull[1] - K[1] * pull[0])
    moment += centre[0] * gained[1] - centre[1] * gained[0]
    rho = 0.05 * 0.2 / sqrt(1 + 0.2**2)
    rest = 2.0 if sense > 0 else 1.0
    return float(moment + sense * (rest + rho * np.hypot(*R)))


def test_a_slow_motion_either_way_and_a_fast_one() -> None:
    for driver, wanted in (
        ({}, holds()),
        ({"direction": "positive"}, holds()),
        ({"direction": "negative"}, holds(sense=-1)),
        ({"speed": 2.0}, holds(speed=2.0)),
        ({"speed": -2.0}, holds(speed=-2.0, sense=-1)),
    ):
        found = md.solve(arm(**driver), "hold")
        assert found.efforts["arm.angle"][0] == pytest.approx(wanted, rel=1e-12), driver
        assert found.fault is None
        assert found.checks["energy"] is None or found.checks["energy"] < 1e-9
        said = " ".join(found.summary["assumptions"])
        assert ("quasi-static" in said) == ("speed" not in driver)
        if not {"speed", "direction"} & set(driver):
            assert "slow motion in the positive sense of arm.angle" in said
    assert abs(holds(speed=2.0) - holds()) > 1  # damping counts


def test_mean_powers_of_a_slow_motion_are_those_at_one_unit() -> None:
    found = md.solve(arm(), "lift")
    q, w = np.polynomial.legendre.leggauss(20)
    means = [holds(0.55 + 0.35 * x) for x in q]
    assert found.summary["input"] == pytest.approx(float(np.dot(w, means)) / 2, rel=1e-9)
    assert any("powers are those at 1 rad/s" in own for own in found.summary["assumptions"])


def test_functions_studies_solvers_and_derivatives_see_no_speed() -> None:
    problem, path = arm(), "efforts/arm.angle"
    for m in (3.0, 5.0):
        wanted = pytest.approx(holds(m=m), rel=1e-11)
        f = md.function(problem, inputs=["m"], outputs=[path], task="hold")
        assert float(f(m)) == wanted
        solver = md.Solver(problem, "hold", vary=("m",))
        assert solver(m=m).efforts["arm.angle"][0] == wanted
    slope = (holds(m=3.001) - holds(m=2.999)) / 0.002
    task = md.Sensitivity(of="hold", outputs=(path,), wrt=("m",))
    found = md.solve(problem.with_task("s", task), "s").data["derivatives"][path]["m"]
    assert float(np.ravel(found)[0]) == pytest.approx(slope, rel=1e-7)


def test_rows_of_a_study_see_no_speed() -> None:
    problem, path = md.load(CASES / "hold-without-speed.toml"), "efforts/ram.slide"
    sets = {"boom.mass": [100.0, 300.0, 500.0]}
    found = md.Solver(problem, "hold", vary=("boom.mass",)).many(sets, outputs=[path])
    wanted = [held_boom(1.05, (0.4, -0.5), (1.0, 0.0), (1.5, 0.0), m) for m in (100, 300, 500)]
    assert np.ravel(found.table[path]) == pytest.approx(wanted, rel=1e-11)


def test_a_function_of_the_speed_has_inertia() -> None:
    f = md.function(
        arm(), inputs=["arm.angle", "arm.angle.speed"], outputs=["efforts/arm.angle"], task="hold"
    )
    assert float(f(0.3, 2.0)) == pytest.approx(holds(speed=2.0), rel=1e-11)
    assert float(f(0.3, 1e-9)) == pytest.approx(holds(), rel=1e-7)
    slow = md.function(arm(), inputs=["arm.angle"], outputs=["efforts/arm.angle"])
    assert float(slow(0.3)) == pytest.approx(holds(), rel=1e-11)


def test_explained_forces_close_without_inertia() -> None:
    found = md.explain(arm(), "hold")
    text = found.text()
    assert "Φ2" not in text
    assert "quasi-static" in text
    for section in found.document.sections:
        for gap in _gaps(section):
            assert gap < 1e-9


def _gaps(section: object) -> list[float]:
    own = [part.gap for part in section.blocks if getattr(part, "gap", None) is not None]
    return own + [gap for inner in section.sections for gap in _gaps(inner)]


@needs_node
def test_a_page_sees_no_speed(tmp_path) -> None:
    page = md.page(arm(), "lift")
    body = """
const found = [0.3, 0.7].map((s) => session.forcesAt(session.motion.pose(s)));
console.log(JSON.stringify([session.checkForces(), session.data.slow,
  ...found.map((f) => f.efforts["arm.angle"])]));
"""
    good, slow, *efforts_ = in_page(page, body, tmp_path)
    assert good
    assert slow
    assert efforts_ == pytest.approx([holds(), holds(0.7)], rel=1e-9)


@needs_node
def test_a_driver_that_a_page_moves_by_itself_has_no_inertia(tmp_path) -> None:
    """All drivers rest in the task, one is pulled by hand: nobody gave its speed."""
    problem = md.load(CASES / "excavator.toml")
    still = [replace(own, speed=0.0) for own in problem.task("forces").all_drivers]
    task = replace(problem.task("forces"), drivers=tuple(still))
    page = md.page(problem.with_task("forces", task), "forces")
    body = """
session.along(0);
const { s } = session;
console.log(JSON.stringify([s, session.forcesAt(session.motion.pose(s)).efforts]));
"""
    length, found = in_page(page, body, tmp_path)
    assert length == pytest.approx(2.1)
    plain = md.solve(problem, "forces").efforts
    assert [found[f"cyl{k}.slide"] for k in (1, 2, 3)] == pytest.approx(
        [plain[f"cyl{k}.slide"][0] for k in (1, 2, 3)], rel=1e-8
    )


# -- input -----------------------------------------------------------------------------------------


def test_a_speed_for_one_of_two_drivers_is_no_speed_for_both() -> None:
    drivers = [md.Driver("a.angle", at=[0.1], speed=1.0), md.Driver("b.angle", at=[0.2])]
    with pytest.raises(md.InputError, match=r"no speed of b\.angle"):
        md.Reactions(drivers=drivers)
    assert md.Reactions(drivers=[replace(drivers[0], speed=0.0), drivers[1]]).quasi_static
    both = [replace(own, speed=0.0) for own in drivers]
    assert not md.Reactions(drivers=both).quasi_static
    with pytest.raises(md.InputError, match=r"no speed of a\.angle"):
        md.Reactions(md.Driver("a.angle", at=[0.1], acceleration=1.0))
    with pytest.raises(md.InputError, match="tells the sense"):
        md.Driver("a.angle", at=[0.1], speed=1.0, direction="negative")
    with pytest.raises(md.InputError, match="no driver has a speed"):
        md.Reactions(md.Driver("a.angle", at=[0.1]), parts=["inertial"])


@pytest.mark.parametrize(
    ("value", "text"),
    [("5*t", "this task has no time"), ("30/arm.angle.speed", "no finite value")],
)
def test_loads_that_a_slow_motion_has_no_value_for(value: str, text: str) -> None:
    problem = arm()
    load = md.Torque("push", body="arm", value=value)
    loads = {**problem.mechanism.loads, "push": load}
    mechanism = replace(problem.mechanism, loads=Table(loads))
    with pytest.raises(md.InputError, match=text):
        md.solve(replace(problem, mechanism=mechanism), "hold")
