"""Forces as somebody who reads only the documentation would try them: by hand, with bad input."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main

SLIDER = """
schema = 1
[parameters]
r = 0.05
l = 0.15
f = 0.0
fg = 0.0
[ground]
points = { O = [0, 0] }
[bodies.crank]
points = { O = [0, 0], B = ["r", 0] }
[bodies.rod]
points = { B = [0, 0], C = ["l", 0] }
[bodies.slider]
points = { C = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
B = { kind = "revolute", between = ["crank.B", "rod.B"] }
C = { kind = "revolute", between = ["rod.C", "slider.C"] }
guide = { kind = "prismatic", between = ["ground.O", "slider.C"], friction = "fg" }
[sketch]
crank_deg = 60
rod_deg = -15
"""
PUSH = '[loads.push]\nkind = "force"\npoint = "slider.C"\nvalue = [-300, -8]\n'
TURN = "from_deg = 0, to_deg = 360"


def task(driver: str, more: str = "") -> str:
    speed = "" if "speed" in driver else ", speed = 30"
    head = '\n[tasks.c]\nkind = "reactions"\ndriver = { coordinate = "crank.angle", '
    return f"{head}{driver}{speed} }}\n{more}\n"


@pytest.fixture
def write(tmp_path: Path) -> Any:
    def written(text: str) -> Path:
        path = tmp_path / "p.toml"
        path.write_text(text)
        return path

    return written


# -- hand formulas -----------------------------------------------------------------------------

LEVER = """
schema = 1
gravity = [0.5, -9.81]
[ground]
points = { O = [0.1, 0.2] }
[bodies.lever]
points = { O = [0, 0], P = [0.5, 0.1] }
mass = 3.0
center = [0.2, 0.05]
inertia = 0.3
[joints]
O = { kind = "revolute", between = ["ground.O", "lever.O"], friction = 0.2, pin_radius = 0.02 }
[sketch]
lever_deg = 20
[loads.F]
kind = "force"
point = "lever.P"
value = ["-30*lever.angle.speed", "-100 - 5*lever.angle"]
[loads.T]
kind = "torque"
body = "lever"
value = "2*t"
[loads.R]
kind = "resistance"
coordinate = "lever.angle"
positive = 4
negative = 6
[loads.K]
kind = "spring"
coordinate = "O.angle"
stiffness = 11
free_length = 0.2
preload = 1.5
damping = 0.7
[tasks.law]
kind = "reactions"
driver = { coordinate = "lever.angle", law = "0.3 + s*(0.1*sin(2*t) + 0.2*t**3)", from = 0, to = 1 }
poses = 5
[parameters]
s = 1
"""


@pytest.mark.parametrize("s", [1.0, -1.0])
def test_a_lever_with_every_kind_of_load_along_a_law(write: Any, s: float) -> None:
    result = md.solve(write(LEVER), "law", set={"s": s})
    for k, t in enumerate(np.linspace(0, 1, 5)):
        angle = 0.3 + s * (0.1 * math.sin(2 * t) + 0.2 * t**3)
        speed = s * (0.2 * math.cos(2 * t) + 0.6 * t * t)
        growth = s * (-0.4 * math.sin(2 * t) + 1.2 * t)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        centre, P = turn @ [0.2, 0.05], turn @ [0.5, 0.1]
        force, weight = np.array([-30 * speed, -100 - 5 * angle]), 3 * np.array([0.5, -9.81])
        inertia = 3 * (growth * np.array([-centre[1], centre[0]]) - speed**2 * centre)
        R = inertia - force - weight
        moment = P[0] * force[1] - P[1] * force[0] + centre[0] * weight[1] - centre[1] * weight[0]
        moment += 2 * t - (4 if s > 0 else -6) - (1.5 + 11 * (angle - 0.2) + 0.7 * speed)
        rubbing = -s * 0.02 * math.sin(math.atan(0.2)) * math.hypot(*R)
        wanted = (0.3 + 3 * centre @ centre) * growth - moment - rubbing
        assert result.efforts["lever.angle"][k] == pytest.approx(wanted, rel=1e-12)
        assert result.joints["O"].reaction[k] == pytest.approx([*R, rubbing], rel=1e-12)
        assert result.joints["O"].loss[k] == pytest.approx(abs(rubbing * speed), rel=1e-12)


ROBOT = """
schema = 1
gravity = [0, -9.81]
[ground]
points = { O = [0, 0] }
[bodies.a]
points = { O = [0, 0], E = [0.5, 0] }
mass = 4.0
center = [0.2, 0]
inertia = 0.1
[bodies.b]
points = { E = [0, 0], P = [0.4, 0] }
mass = 2.0
center = [0.15, 0]
inertia = 0.04
[joints]
O = { kind = "revolute", between = ["ground.O", "a.O"] }
E = { kind = "revolute", between = ["a.E", "b.E"] }
[sketch]
a_deg = 20
b_deg = 70
[tasks.joint]
kind = "reactions"
drivers = [
  { coordinate = "O.angle", at = [0.3, 0.5], speed = 1.0 },
  { coordinate = "E.angle", at = [0.8, 0.9], speed = -2, acceleration = 3 },
]
[tasks.link]
kind = "reactions"
drivers = [
  { coordinate = "a.angle", at = [0.3, 0.5], speed = 1.0 },
  { coordinate = "b.angle", at = [1.1, 1.4], speed = -1, acceleration = 3 },
]
"""


def test_two_motors_in_the_joints_and_on_the_links(write: Any) -> None:
    problem = md.load(write(ROBOT))
    joint, link = md.solve(problem, "joint"), md.solve(problem, "link")
    for k, (q1, q2) in enumerate([(0.3, 0.8), (0.5, 0.9)]):
        w1, w2, a1, a2 = 1.0, -2.0, 0.0, 3.0
        h, g = 2 * 0.5 * 0.15, 9.81
        elbow = (0.04 + 2 * 0.15**2) * (a1 + a2) + h * (math.cos(q2) * a1 + math.sin(q2) * w1**2)
        elbow += 2 * g * 0.15 * math.cos(q1 + q2)
        base = elbow + (0.1 + 4 * 0.2**2 + 2 * 0.5**2) * a1
        base += h * (math.cos(q2) * (a1 + a2) - math.sin(q2) * (w1 + w2) ** 2)
        base += (4 * 0.2 + 2 * 0.5) * g * math.cos(q1)
        assert joint.efforts["O.angle"][k] == pytest.approx(base, rel=1e-12)
        assert joint.efforts["E.angle"][k] == pytest.approx(elbow, rel=1e-12)
        # on the link itself the upper motor stands on the ground and does not push the lower one
        assert link.efforts["a.angle"][k] == pytest.approx(base - elbow, rel=1e-12)
        assert link.efforts["b.angle"][k] == pytest.approx(elbow, rel=1e-12)


# -- checks and figures ------------------------------------------------------------------------


def test_dead_centres_without_any_moment_are_balanced(write: Any) -> None:
    """At 0 and 180 deg all moments vanish; their rounding is no imbalance."""
    text = SLIDER + PUSH + task(TURN, 'poses = 7\nfriction = "none"\ncycle = true')
    result = md.solve(write(text), "c")
    assert result.fault is None
    assert result.checks["balance"] < 1e-12
    assert result.joints["guide"].normal[[0, 3, 6]] == pytest.approx([8, 8, 8], rel=1e-12)


def test_the_critical_factor_is_that_of_a_pose_where_friction_feeds_itself(write: Any) -> None:
    """Where the load drives f tan(beta) slows and never jams, where it resists it jams at 1."""
    text = SLIDER + PUSH.replace("-8", "0") + task("at_deg = [80, 90, 240]")
    found = md.solve(write(text), "c", set={"fg": 0.15}).summary["critical_factor"]
    lean = math.tan(math.asin(0.05 / 0.15 * math.sin(math.radians(60))))
    assert found["factor"] == pytest.approx(1 / (0.15 * lean), rel=2e-6)
    assert found["at"] == pytest.approx(math.radians(240))
    assert found["joint"] == "guide"


GEARS = """
schema = 1
[ground]
points = { A = [0, 0], B = [0.3, 0] }
[bodies.u]
points = { A = [0, 0] }
[bodies.v]
points = { B = [0, 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "u.A"] }
B = { kind = "revolute", between = ["ground.B", "v.B"] }
g = { kind = "gear", between = ["u.A", "v.B"], ratio = -2, mesh_loss = 0.03 }
[sketch]
u_deg = 0
v_deg = 0
[loads.T]
kind = "resistance"
coordinate = "v.angle"
positive = 10
negative = 10
[tasks.c]
kind = "reactions"
driver = { coordinate = "u.angle", at = [0.5], speed = 3 }
"""


def test_meshes_lose_all_of_their_power_at_most(write: Any) -> None:
    driven = md.solve(write(GEARS), "c")
    assert driven.efforts["u.angle"][0] == pytest.approx(5 / 0.97, rel=1e-12)
    assert driven.summary["critical_factor"]["factor"] == pytest.approx(1 / 0.03, rel=2e-6)
    back = md.solve(write(GEARS.replace("= 10", "= -10")), "c")
    assert back.efforts["u.angle"][0] == pytest.approx(-5 * 0.97, rel=1e-12)
    assert back.summary["critical_factor"]["factor"] is None


# -- means that are none -----------------------------------------------------------------------

WORK = '[loads.work]\nkind = "resistance"\ncoordinate = "guide.slide"\nnegative = "{}"\n'


@pytest.mark.parametrize(
    ("driver", "key"),
    [
        (TURN + ", speed = 0", "driver.speed"),
        ("at_deg = [0, 30, 10]", "driver.at"),
    ],
)
def test_a_cycle_needs_a_motion_one_way(write: Any, driver: str, key: str) -> None:
    text = SLIDER + PUSH + task(driver, "cycle = true")
    with pytest.raises(md.InputError, match=f"tasks.c.{key}"):
        md.solve(write(text), "c")


@pytest.mark.parametrize("value", ["log(guide.slide - 0.15)", "1/(guide.slide - 0.15)"])
def test_means_that_are_not_known_are_a_fault(write: Any, value: str) -> None:
    text = SLIDER + WORK.format(value) + task(TURN, "poses = 2\ncycle = true")
    assert "mean powers of the cycle" in (md.solve(write(text), "c").fault or "")


@pytest.mark.parametrize("value", ["log(guide.slide - 0.15)", "1/(crank.angle - pi/2)"])
def test_a_load_without_a_finite_value_is_named(write: Any, value: str) -> None:
    text = SLIDER + WORK.format(value) + task("at_deg = [30, 90]")
    with pytest.raises(md.InputError, match=r"loads\.work: .* crank.angle = 1.5708"):
        md.solve(write(text), "c")


# -- loads -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "load",
    [
        'kind = "spring"\ncoordinate = "guide.slide"\nstiffness_mm = 5',
        'kind = "spring"\ncoordinate = "crank.angle"\ndamping_rpm = 5',
        'kind = "torque"\nbody = "rod"\nvalue_mm = 5',
        'kind = "force"\npoint = "rod.B"\nvalue_deg = [1, 2]',
        'kind = "resistance"\ncoordinate = "guide.slide"\nnegative_mm = 5',
    ],
)
def test_a_unit_that_would_scale_a_force_is_refused(write: Any, load: str) -> None:
    path = write(SLIDER + f"[loads.x]\n{load}\n" + task(TURN))
    with pytest.raises(md.InputError, match="does not fit"):
        md.load(path)


def test_a_unit_of_rows_is_refused_with_the_units_they_have(write: Any) -> None:
    load = 'kind = "table"\ncoordinate = "crank.angle"\nbody = "rod"\nrows_deg = [[0, 1], [360, 2]]'
    path = write(SLIDER + f"[loads.x]\n{load}\n" + task(TURN))
    with pytest.raises(md.InputError, match=r"rows_deg: 'rows' is no number") as caught:
        md.load(path)
    assert caught.value.hint == "rows = ..., in m or rad, and N or N m"


def test_setting_a_load_in_a_unit_of_length_is_refused(write: Any) -> None:
    problem = md.load(write(SLIDER + WORK.replace('"{}"', "800") + task(TURN)))
    with pytest.raises(md.InputError, match="does not fit 'negative'"):
        problem.with_values({"loads.work.negative_mm": 3})


def test_a_force_on_the_ground_is_an_error(write: Any) -> None:
    path = write(SLIDER + PUSH.replace("slider.C", "ground.O") + task(TURN))
    with pytest.raises(md.InputError, match=r"loads\.push\.point: .*ground"):
        md.load(path)


TABLE = '[loads.g]\nkind = "table"\ncoordinate = "crank.angle"\nbody = "crank"\nfile = "g.csv"\n'


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        ("0,nan\n3,2\n7,3\n", "row 1 has a gap"),  # not a header
        ("a,b\n", "two rows at least"),
        ("a,b\n0,1\n", "two rows at least"),
    ],
)
def test_a_file_that_is_no_table_is_refused(write: Any, rows: str, text: str) -> None:
    path = write(SLIDER + TABLE + task(TURN))
    (path.parent / "g.csv").write_text(rows)
    with pytest.raises(md.InputError, match=rf"loads\.g\.file: {text}"):
        md.load(path)


def test_a_table_has_one_source(write: Any) -> None:
    path = write(SLIDER + TABLE + "rows = [[0, 1], [7, 2]]\n" + task(TURN))
    (path.parent / "g.csv").write_text("0,1\n7,2\n")
    with pytest.raises(md.InputError, match="not both"):
        md.load(path)


# -- reactions that are not unique ---------------------------------------------------------------

TWO = """
schema = 1
[ground]
points = { O = [0, 0], P = [0, 0.2] }
[bodies.s]
points = { A = [0, 0], B = [0, 0.2], C = [0.1, 0.05] }
mass = 1
[joints]
g1 = { kind = "prismatic", between = ["ground.O", "s.A"] }
g2 = { kind = "prismatic", between = ["ground.P", "s.B"] }
[sketch]
s_deg = 0
g1 = 0.1
[loads.F]
kind = "force"
point = "s.C"
value = [10, -100]
[tasks.c]
kind = "reactions"
driver = { coordinate = "g1.slide", from = 0.1, to = 0.2, speed = 1 }
poses = 3
parts = ["static"]
friction = "none"
"""


def test_two_guides_share_a_load_in_no_known_way(write: Any) -> None:
    problem = md.load(write(TWO))
    result = md.solve(problem, "c")
    assert result.efforts["g1.slide"] == pytest.approx([-10] * 3)
    for name in ("g1", "g2"):
        for quantity in ("reaction", "reaction_static", "normal"):
            assert np.isnan(result.joints[name][quantity]).all(), (name, quantity)
    (shared,) = result.summary["unique_sums"]
    assert np.asarray(shared["force"]) == pytest.approx(np.array([[0, 100]] * 3))
    of = md.Sensitivity(of="c", outputs=("joints/g1/normal",), wrt=("s.mass",))
    with pytest.raises(md.SolveError, match="not unique"):
        md.solve(problem, of)
    with pytest.raises(md.SolveError, match="not unique"):
        md.function(problem, inputs=["g1.slide"], outputs=["joints/g1/reaction"], task="c")


# -- sensitivity on the command line -------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--of", "status", "--wrt", "fg"], "status is not a number"),
        (["--of", "summary", "--wrt", "fg"], "summary is not a number"),
        (["--of", "efforts/crank.angle", "--tolerance", "fg"], "--tolerance: 'fg'"),
        (["--of", "efforts/crank.angle", "--tolerance", "fg=x"], "tolerances.fg: unknown name"),
        (["--of", "efforts/crank.angle", "--tolerance", "fh=1"], "tolerances.fh: unknown param"),
    ],
)
def test_what_has_no_derivative_is_said(
    write: Any, capsys: Any, options: list[str], text: str
) -> None:
    path = write(SLIDER + PUSH + task("at_deg = [30, 90]"))
    assert main(["sensitivity", str(path), "--task", "c", *options]) == 2
    assert text in capsys.readouterr().err
