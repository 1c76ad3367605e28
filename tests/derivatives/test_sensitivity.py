"""Derivatives of poses, speeds, reactions and cycles against 40-digit differences."""

from __future__ import annotations

import functools
import json
import math
from dataclasses import replace
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from tests.shared.force_cases import slider_crank

PHI = math.pi / 3
NAMES = ("r", "l", "f", "f_slide", "r_C", "omega", "m_rod", "I_rod", "c_rod", "m_slider")
BASE = {
    "r": 0.1, "l": 0.3, "f": 0.1, "f_slide": 0.12, "r_C": 0.010, "omega": 40.0, "m_rod": 1.2,
    "I_rod": 0.01, "c_rod": 0.1, "m_slider": 2.0,
}  # fmt: skip


def text() -> str:
    """Return a slider-crank with masses and friction in every joint as a problem file."""
    parameters = "\n".join(f"{name} = {value!r}" for name, value in BASE.items())
    return f"""
schema = 1
[parameters]
{parameters}
reach = "r + l"
[ground]
points = {{ O = [0, 0] }}
[bodies.crank]
points = {{ O = [0, 0], B = ["r", 0] }}
[bodies.rod]
points = {{ B = [0, 0], C = ["l", 0] }}
mass = "m_rod"
inertia = "I_rod"
center = ["c_rod", 0]
[bodies.slider]
points = {{ C = [0, 0] }}
mass = "m_slider"
center = [0, 0]
[joints]
O = {{ kind = "revolute", between = ["ground.O", "crank.O"], friction = "f", pin_radius = 0.02 }}
B = {{ kind = "revolute", between = ["crank.B", "rod.B"], friction = "f", pin_radius = 0.015 }}
C = {{ kind = "revolute", between = ["rod.C", "slider.C"], friction = "f", pin_radius = "r_C" }}
slide = {{ kind = "prismatic", between = ["ground.O", "slider.C"], friction = "f_slide" }}
[sketch]
crank_deg = 60
rod_deg = -15
[loads.work]
kind = "resistance"
coordinate = "slide.slide"
negative = 1000
positive = 200
[outputs]
gap = "reach - slider.C.x"
[tasks.pose]
kind = "reactions"
driver = {{ coordinate = "crank.angle", at = ["{PHI!r}"], speed = "omega" }}
[tasks.cycle]
kind = "reactions"
driver = {{ coordinate = "crank.angle", from_deg = 0, to_deg = 360, speed = "omega" }}
poses = 5
cycle = true
[tasks.turn]
kind = "sweep"
driver = {{ coordinate = "crank.angle", from = "r", to = "2*r + 1", speed = "omega" }}
poses = 4
"""


@pytest.fixture(scope="module")
def problem(tmp_path_factory) -> md.Problem:
    path = tmp_path_factory.mktemp("sensitivity") / "crank.toml"
    path.write_text(text(), encoding="utf-8")
    return md.load(path)


def effort(**given):
    """Return the balancing torque, the reaction in B (2,) and the loss in the slide, by hand.

    Newton and Euler for rod and slider with friction circles.
    """
    p = {name: mp.mpf(value) for name, value in BASE.items()} | given
    phi = given.get("phi", mp.mpf(PHI))
    r, rod, w = p["r"], p["l"], p["omega"]
    beta = mp.asin(r * mp.sin(phi) / rod)  # the rod points down by beta
    w2 = -r * mp.cos(phi) * w / (rod * mp.cos(beta))
    e2 = (r * mp.sin(phi) * w**2 - rod * mp.sin(beta) * w2**2) / (rod * mp.cos(beta))
    v = -r * mp.sin(phi) * w + rod * mp.sin(beta) * w2
    a = -r * mp.cos(phi) * w**2 - rod * mp.cos(beta) * w2**2 + rod * mp.sin(beta) * e2
    along = (mp.cos(beta), -mp.sin(beta))
    c = p["c_rod"]
    centre = (
        -r * mp.cos(phi) * w**2 - c * (along[0] * w2**2 + along[1] * e2),
        -r * mp.sin(phi) * w**2 + c * (along[0] * e2 - along[1] * w2**2),
    )
    circle = p["f"] / mp.sqrt(1 + p["f"] ** 2)
    rho = [radius * circle for radius in (mp.mpf("0.02"), mp.mpf("0.015"), p["r_C"])]
    load = mp.mpf(1000) if v < 0 else -mp.mpf(200)
    m, mass = p["m_rod"], p["m_slider"]

    turn_b = turn_c = size = fx = fy = mp.mpf(0)
    for _ in range(400):  # what friction adds is a small share of what it comes from
        gx = load - p["f_slide"] * size * mp.sign(v) - mass * a  # on the rod at C
        before, fx = (fx, fy), m * centre[0] - gx
        ahead = rod - c
        rest = p["I_rod"] * e2 - turn_b - turn_c - c * along[1] * fx
        rest += ahead * (along[1] * gx - along[0] * m * centre[1])
        fy = -rest / (rod * along[0])
        gy = m * centre[1] - fy
        size = abs(gy)
        turn_b = -rho[1] * mp.hypot(fx, fy) * mp.sign(w2 - w)
        turn_c = rho[2] * mp.hypot(gx, gy) * mp.sign(0 - w2)
        if abs(fx - before[0]) + abs(fy - before[1]) <= mp.eps * 1000 * abs(fx):
            break
    n = gy
    back = rho[1] * mp.hypot(fx, fy) * mp.sign(w2 - w) + rho[0] * mp.hypot(fx, fy) * -mp.sign(w)
    torque = r * (mp.cos(phi) * fy - mp.sin(phi) * fx) - back
    return torque, fx, fy, p["f_slide"] * abs(n) * abs(v)


def by_differences(name: str, second: str | None = None) -> list[float]:
    """Return derivatives of the four values from differences with 40 digits."""
    with mp.workdps(80):
        h, k = (mp.mpf(BASE[n or name]) * mp.mpf(10) ** -20 for n in (name, second))

        def at(i: int, j: int) -> list:
            moved = {name: mp.mpf(BASE[name]) + i * h}
            if second not in (None, name):
                moved[second] = mp.mpf(BASE[second]) + j * k
            return list(effort(**moved))

        if second is None:
            parts = [(up - down) / (2 * h) for up, down in zip(at(1, 0), at(-1, 0), strict=True)]
        elif second == name:
            three = zip(at(1, 0), at(0, 0), at(-1, 0), strict=True)
            parts = [(up - 2 * middle + down) / h**2 for up, middle, down in three]
        else:
            four = zip(at(1, 1), at(1, -1), at(-1, 1), at(-1, -1), strict=True)
            parts = [(a - b - c + d) / (4 * h * k) for a, b, c, d in four]
        return [float(part) for part in parts]


PATHS = ("efforts/crank.angle", "joints/B/reaction", "joints/slide/loss")


def flat(derivatives, name: str) -> list[float]:
    torque, reaction, loss = (np.asarray(derivatives[path][name])[0] for path in PATHS)
    return [float(torque), float(reaction[0]), float(reaction[1]), float(loss)]


@pytest.fixture(scope="module")
def solved(problem) -> md.Result:
    task = md.Sensitivity(of="pose", outputs=PATHS, wrt=NAMES, order=2)
    return md.solve(problem, task)


def test_the_hand_made_reference_is_the_published_one() -> None:
    assert float(effort()[0]) == pytest.approx(125.545445723846, rel=1e-13)


@pytest.mark.parametrize("name", NAMES)
def test_first_derivatives(solved, name) -> None:
    expected = by_differences(name)
    size = max(map(abs, expected))
    assert flat(solved.data["derivatives"], name) == pytest.approx(
        expected, rel=1e-9, abs=1e-9 * size
    )


@pytest.mark.parametrize("pair", [("r", "r"), ("r", "l"), ("f", "f"), ("r", "f"), ("l", "m_rod")])
def test_second_derivatives(solved, pair) -> None:
    names = sorted(pair, key=NAMES.index)
    expected = (
        by_differences(*names) if names[0] != names[1] else by_differences(names[0], names[0])
    )
    size = max(map(abs, expected))
    found = flat(solved.data["second"], ",".join(names))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6 * size)


def test_kinematics_driver_values_and_named_outputs(problem) -> None:
    """The driver starts at r and ends at 2 r + 1: a pose moves with its parameter too."""
    outputs = ("points/slider.C/position", "points/slider.C/velocity", "gap")
    task = md.Sensitivity(of="turn", outputs=outputs, wrt=("r", "omega", "l"), order=2)
    result = md.solve(problem, task)
    r, rod, w = 0.1, 0.3, 40.0

    def place(r, rod=rod, w=w, share=0.0):
        phi = r + share * (r + 1)
        return r * mp.cos(phi) + mp.sqrt(rod**2 - (r * mp.sin(phi)) ** 2)

    def speed(r, rod=rod, w=w, share=0.0):
        phi = r + share * (r + 1)
        return w * mp.diff(lambda x: r * mp.cos(x) + mp.sqrt(rod**2 - (r * mp.sin(x)) ** 2), phi)

    shares = [0, mp.mpf(1) / 3, mp.mpf(2) / 3, 1]
    first, second = result.data["derivatives"], result.data["second"]
    for k, share in enumerate(shares):
        with mp.workdps(40):
            for function, path in ((place, outputs[0]), (speed, outputs[1])):
                here = functools.partial(function, share=share)
                by_r = float(mp.diff(here, mp.mpf(r)))
                twice = float(mp.diff(here, mp.mpf(r), 2))
                by_l = float(mp.diff(lambda x, f=here: f(r, x), mp.mpf(rod)))
                assert first[path]["r"][k, 0] == pytest.approx(by_r, rel=1e-9, abs=1e-12)
                assert first[path]["l"][k, 0] == pytest.approx(by_l, rel=1e-9, abs=1e-12)
                assert second[path]["r,r"][k, 0] == pytest.approx(twice, rel=1e-6, abs=1e-9)
            by_w = float(speed(r, share=share)) / w
        assert first[outputs[1]]["omega"][k, 0] == pytest.approx(by_w, rel=1e-9, abs=1e-12)
        named = first["outputs/gap/value"]["r"][k]
        assert named == pytest.approx(1 - first[outputs[0]]["r"][k, 0], rel=1e-12)


def test_cycles_and_limits_are_differenced_with_an_error(problem) -> None:
    """Without masses the efficiency does not depend on the size of the load's speed."""
    task = md.Sensitivity(of="cycle", outputs=("summary/efficiency",), wrt=("f", "f_slide"))
    result = md.solve(problem, task)
    found = result.data["derivatives"]["summary/efficiency"]
    error = result.data["estimated_error"]["summary/efficiency"]
    assert all(-1 < found[name] < 0 and error[name] < 1e-10 for name in ("f", "f_slide"))
    # by a chord over two independent solutions, to the accuracy of a chord
    h = 1e-4
    up, down = (
        md.solve(problem, "cycle", set={"f": 0.1 + d}).summary["efficiency"] for d in (h, -h)
    )
    assert found["f"] == pytest.approx((up - down) / (2 * h), rel=1e-5)
    limits = md.Sensitivity(of="window", outputs=("summary/limits",), wrt=("BE",))
    seven = md.load("gorshkov-seven-link")
    values = md.solve(seven, limits).data["derivatives"]["summary/limits"]["BE"]
    # B, E, F stretched: |BF| = BE + EF at both ends, B on the rod behind the crank's pin
    p = seven.mechanism.values()

    def slack(phi, be):
        ax, ay = p["OA"] * mp.cos(phi), p["OA"] * mp.sin(phi)
        turn = mp.atan2(ay + p["OG"], ax)
        bx, by = p["GB"] * mp.cos(turn), p["GB"] * mp.sin(turn) - p["OG"]
        return mp.hypot(bx - p["OF"], by) - be - p["EF"]

    ends = md.solve(seven, "window").summary["limits"]
    for end, found_slope in zip(ends, values, strict=True):
        with mp.workdps(40):
            by_phi = mp.diff(lambda x: slack(x, mp.mpf(p["BE"])), mp.mpf(end))
        assert found_slope == pytest.approx(float(1 / by_phi), rel=1e-9)


def test_tolerances_three_ways(problem) -> None:
    task = md.Sensitivity(
        of="pose", outputs=("efforts/crank.angle",), tolerances={"r": 1e-4, "l": 2e-4}
    )
    result = md.solve(problem, task)
    slopes = [by_differences(name)[0] for name in ("r", "l")]
    spread = result.data["tolerances"]["efforts/crank.angle"]
    parts = [slopes[0] * 1e-4, slopes[1] * 2e-4]
    assert spread["worst_case"][0] == pytest.approx(abs(parts[0]) + abs(parts[1]), rel=1e-9)
    assert spread["first_order"][0] == pytest.approx(math.hypot(*parts) / math.sqrt(3), rel=1e-9)
    sampled = spread["monte_carlo"]
    assert sampled["samples"] == 1000
    assert sampled["std"][0] == pytest.approx(spread["first_order"][0], rel=0.08)
    middle = float(effort()[0])
    assert abs(sampled["mean"][0] - middle) < 0.1 * spread["first_order"][0]
    assert sampled["max"][0] - middle < 1.001 * spread["worst_case"][0]


def test_a_literal_zero_can_be_differentiated_by(problem) -> None:
    """The slider's guide runs through O; an offset e of the pin C off the rod's axis tells."""
    task = md.Sensitivity(of="turn", outputs=("points/slider.C/position",), wrt=("rod.C.y",))
    found = md.solve(problem, task).data["derivatives"]["points/slider.C/position"]["rod.C.y"]
    assert np.abs(found).max() < 1e-12  # |BC| grows with e^2 only
    with pytest.raises(md.InputError, match="unknown parameter"):
        md.solve(problem, md.Sensitivity(of="turn", outputs=("gap",), wrt=("rod.C.z",)))
    with pytest.raises(md.InputError, match="path"):
        md.solve(problem, md.Sensitivity(of="turn", outputs=("points/no.C/position",), wrt=("r",)))


def test_command_line(tmp_path, capsys) -> None:
    path = tmp_path / "crank.toml"
    path.write_text(text(), encoding="utf-8")
    words = ["sensitivity", str(path), "--task", "pose", "--of", "efforts/crank.angle"]
    assert main([*words, "--wrt", "r", "f", "--tolerance", "l=1e-4", "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "d/d r [N m/m]" in out
    assert "worst case" in out
    data = json.loads((tmp_path / "sensitivity.json").read_text())["tasks"]["sensitivity"]
    assert data["kind"] == "sensitivity"
    assert set(data["derivatives"]["efforts/crank.angle"]) == {"r", "f", "l"}
    assert main([*words]) == 2
    assert "--wrt" in capsys.readouterr().err
    assert main([*words, "--wrt", "radius"]) == 2


# -- functions -------------------------------------------------------------------------------------


def test_function_of_positions_and_forces(problem) -> None:
    f = md.function(
        problem,
        inputs=["crank.angle", "r", "f"],
        outputs=["efforts/crank.angle", "joints/B/reaction", "points/slider.C/position", "gap"],
    )
    torque, reaction, place, gap = (np.array(part).ravel() for part in f(PHI, 0.1, 0.1))
    expected = [float(value) for value in effort()]
    assert torque[0] == pytest.approx(expected[0], rel=1e-12)
    assert reaction[:2] == pytest.approx(expected[1:3], rel=1e-12)
    assert gap[0] == pytest.approx(0.4 - place[0], rel=1e-14)
    other = effort(r=mp.mpf("0.12"), f=mp.mpf("0.2"), phi=mp.mpf(2))
    assert float(f(2.0, 0.12, 0.2)[0]) == pytest.approx(float(other[0]), rel=1e-12)


def test_derivatives_of_functions(problem) -> None:
    import casadi as ca

    f = md.function(problem, inputs=["r", "f"], outputs=["efforts/crank.angle"], task="pose")
    x = ca.MX.sym("x", 2)
    hessian, gradient = ca.hessian(f(x[0], x[1]), x)
    first = np.array(ca.Function("g", [x], [gradient])([0.1, 0.1])).ravel()
    second = np.array(ca.Function("h", [x], [hessian])([0.1, 0.1]))
    assert first == pytest.approx([by_differences("r")[0], by_differences("f")[0]], rel=1e-9)
    assert second[0, 0] == pytest.approx(by_differences("r", "r")[0], rel=1e-6)
    assert second[0, 1] == pytest.approx(by_differences("r", "f")[0], rel=1e-6)


def test_functions_stay_on_their_branch_and_say_nan() -> None:
    f = md.function(
        "gorshkov-seven-link", inputs=["crank.angle", "BE"], outputs=["points/coupler.E/position"]
    )
    window = md.solve("gorshkov-seven-link", "window", poses=9)
    angles = window.drivers["crank.angle"].position
    for k in (1, 4, 7):
        found = np.array(f(angles[k], 0.54)).ravel()
        assert found == pytest.approx(window.points["coupler.E"].position[k], rel=1e-12)
    assert np.isnan(np.array(f(2.0, 0.54))).all()  # behind the limit position
    assert np.isnan(np.array(f(0.5, 0.1))).all()  # the dyad does not reach


def test_function_refuses_what_is_not_there(problem) -> None:
    with pytest.raises(md.UnknownName, match="input"):
        md.function(problem, inputs=["crank.angel"], outputs=["gap"])
    with pytest.raises(md.UnknownName, match="path"):
        md.function(problem, inputs=["crank.angle"], outputs=["points/rod.D/position"])
    with pytest.raises(md.UnknownName, match="path"):
        md.function(problem, inputs=["crank.angle"], outputs=["summary/efficiency"])
    for twice in ((["crank.angle", "r", "r"], ["gap"]), (["crank.angle"], ["gap", "gap"])):
        with pytest.raises(md.InputError, match="names of their own"):
            md.function(problem, inputs=twice[0], outputs=twice[1])


def test_the_place_of_a_point_on_its_body_is_an_input() -> None:
    """Its name is that of a coordinate, which could be driven."""
    problem = md.load("slider-crank-friction")
    for task in ("cycle", None):
        f = md.function(
            problem, inputs=["crank.angle", "rod.C.x"], outputs=["efforts/crank.angle"], task=task
        )
        for length in (0.3, 0.5):
            pose = replace(problem.tasks["cycle"], cycle=False, poses=None)
            at = replace(pose.driver, at=(1.0,), from_=None, to=None)
            own = problem.with_values({"rod.C.x": length}).mechanism
            forces = md.solve(own, replace(pose, driver=at))
            assert float(f(1.0, length)) == pytest.approx(
                forces.efforts["crank.angle"][0], rel=1e-11
            )
    with pytest.raises(
        md.InputError, match=r"rod\.angle is not driven in this task, crank\.angle is"
    ):
        md.function(
            problem,
            inputs=["crank.angle", "rod.angle"],
            outputs=["efforts/crank.angle"],
            task="cycle",
        )


def test_function_of_a_mechanism_without_tasks() -> None:
    mechanism = slider_crank()
    f = md.function(
        mechanism, inputs=["crank.angle", "crank.angle.speed"], outputs=["points/slider.C/velocity"]
    )
    r, rod, w = 0.1, 0.3, 7.0
    slope = mp.diff(lambda x: r * mp.cos(x) + mp.sqrt(rod**2 - (r * mp.sin(x)) ** 2), 1.0)
    assert float(f(1.0, w)[0]) == pytest.approx(float(slope) * w, rel=1e-12)


def test_one_sweep_and_functions_that_are_kept(monkeypatch) -> None:
    """Values and derivatives come from one run; other numbers of the structure build nothing."""
    from mechdae.design.studies import sensitivity
    from mechdae.motion.continuation.evaluate import Evaluator

    problem = md.load("four-bar-crank-rocker")
    outputs = ("points/coupler.P/position", "bodies/rocker/angle")
    task = md.Sensitivity(of="turn", outputs=outputs, wrt=("a", "b"))
    solver = md.Solver(problem.with_task("slopes", task), "slopes")
    calls: list[str] = []

    def counted(place: Any, name: str) -> None:
        own = getattr(place, name)
        monkeypatch.setattr(place, name, lambda *a, **k: (calls.append(name), own(*a, **k))[1])

    counted(Evaluator, "at")
    counted(sensitivity, "Composed")
    counted(sensitivity, "run")
    solver()
    assert calls == ["run", "at", "Composed"]
    solver({"b": 0.1201})
    assert calls[3:] == ["run", "at"]


def test_order_two_has_the_first_derivatives_of_order_one() -> None:
    """By the residuals alone, and through Newton steps: the same to rounding."""
    problem = md.load("four-bar-crank-rocker")
    outputs = ("points/coupler.P/acceleration", "bodies/rocker/angle")
    one, two = (
        md.solve(
            problem.with_task(
                "slopes", md.Sensitivity(of="turn", outputs=outputs, wrt=("a", "d"), order=order)
            ),
            "slopes",
        ).data["derivatives"]
        for order in (1, 2)
    )
    for path in outputs:
        for name in ("a", "d"):
            first, other = one[path][name], two[path][name]
            assert np.abs(first - other).max() <= 1e-12 * np.abs(first).max()


def test_functions_of_reactions_in_space_have_force_and_moment() -> None:
    problem = md.load("rssr")
    heavy = {"rocker": replace(problem.mechanism.bodies["rocker"], mass=0.4)}
    bodies = [heavy.get(name, body) for name, body in problem.mechanism.bodies.items()]
    mechanism = replace(problem.mechanism, bodies=bodies)
    task = md.Reactions(md.Driver("A.angle", at=(0.5,), speed=10.0))
    problem = md.Problem(mechanism, {"forces": task})
    solved = md.solve(problem, "forces")
    f = md.function(problem, task="forces", inputs=["A.angle"], outputs=["joints/D/reaction"])
    found = np.array(f(0.5)).ravel()
    assert found.shape == (6,)
    assert np.abs(found).max() > 1
    assert found == pytest.approx(np.array(solved.joints["D"].reaction)[0], abs=1e-13)
