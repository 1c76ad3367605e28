"""Mechanisms and files that once ended in a traceback: what is valid has the right numbers, what
is not is refused with the place and what to try."""

from __future__ import annotations

import json
import random
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.results.tables import table
from tests.attack import mutations
from tests.shared.paths import DATA

TURN = """[tasks.t]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360 }
"""


def problem(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "own.toml"
    path.write_text("schema = 1\n" + text, encoding="utf-8")
    return path


# -- a sketched slide between a body in the scene and one outside ----------------------------

SLOTTED = """
[ground]
points = { A = [0, 0], D = [0.1, 0] }
[bodies.crank]
points = { A = [0, 0], B = [0.04, 0] }
[bodies.lever]
points = { D = [0, 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
D = { kind = "revolute", between = ["ground.D", "lever.D"] }
slot = { kind = "pin-in-slot", between = ["lever.D", "crank.B"] }
[sketch]
crank_deg = 60
lever_deg = 156.6
slot = 0.087
"""


def test_listed_outputs_leave_a_sketched_slide_outside(tmp_path: Path) -> None:
    path = problem(tmp_path, SLOTTED + TURN + 'outputs = ["crank"]\n')
    result = md.solve(path)
    assert set(result.status) == {"ok"}
    assert result.summary["not_in_scene"] == ["lever"]
    theta = result.drivers["crank.angle"].position
    own = 0.04 * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    assert result.points["crank.B"].position == pytest.approx(own, abs=1e-15)
    assert main(["check", str(path)]) == 0


def test_a_sketched_slide_inside_the_scene_still_chooses(tmp_path: Path) -> None:
    """The pin lies 0.087 m along the slot, not behind its pivot."""
    text = SLOTTED.replace("lever_deg = 156.6\n", "")
    for sign, slide in ((1, "0.087"), (-1, "-0.087")):
        path = problem(tmp_path, text.replace("slot = 0.087", f"slot = {slide}") + TURN)
        result = md.solve(path)
        theta = result.drivers["crank.angle"].position
        away = np.hypot(0.04 * np.cos(theta) - 0.1, 0.04 * np.sin(theta))
        assert result.joints["slot"].slide == pytest.approx(sign * away, abs=1e-14)


# -- a gear that holds its carrier alone -----------------------------------------------------

CARRIED = """
[ground]
points = { A = [0, 0], S = [0.3, 0.1] }
[bodies.crank]
points = { A = [0, 0], B = [0.1, 0] }
[bodies.arm]
points = { P = [0, 0], Q = [0.2, 0.05] }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
s1 = { kind = "pin-in-slot", between = ["arm.P", "crank.B"] }
s2 = { kind = "pin-in-slot", between = ["arm.Q", "ground.S"], axis_deg = 90 }
g = { kind = "KIND", between = ["ground.A", "crank.A"], carrier = "arm" }
[sketch]
crank_deg = 40
arm_deg = ARM
[tasks.t]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = -10, to_deg = 80 }
poses = 10
[tasks.m]
kind = "modes"
driver = { coordinate = "crank.angle", at_deg = [40] }
[tasks.r]
kind = "reactions"
driver = { coordinate = "crank.angle", from_deg = 10, to_deg = 80, speed = 2 }
poses = 8
[loads.push]
kind = "force"
point = "arm.Q"
value = [3, -7]
"""


@pytest.mark.parametrize(
    ("kind", "share", "arm"),
    # 0 - phi = rho (theta - phi): phi = rho theta/(rho - 1)
    [('gear", ratio = -1, x = "', 0.5, 20), ('gear", ratio = 3, x = "', 1.5, 60),
     ('belt", ratio = 2, crossed = true, x = "', 2 / 3, 27)],
)  # fmt: skip
def test_the_carrier_of_two_known_wheels(tmp_path: Path, kind: str, share: float, arm: int) -> None:
    """Arm at `share` times the crank's angle; its two slots then give its place."""
    text = CARRIED.replace('KIND"', kind[: kind.index(", x =")]).replace("ARM", str(arm))
    path = problem(tmp_path, text)
    result = md.solve(path, task="t")
    assert set(result.status) == {"ok"}
    theta = result.drivers["crank.angle"].position
    place, phi = arm_at(theta, share)
    assert result.bodies["arm"].angle == pytest.approx(phi, abs=1e-12)
    assert result.points["arm.P"].position == pytest.approx(place, abs=1e-12)
    modes = md.solve(path, task="m")
    assert (modes.summary["count"], modes.summary["proven"]) == (1, True)
    forces = md.solve(path, task="r")
    theta, step = forces.drivers["crank.angle"].position, 1e-5
    q = [tip(*arm_at(theta + s, share)) for s in (-step, step)]
    rate = (q[1] - q[0]) / (2 * step)
    # virtual power: effort + F . dQ/dtheta = 0
    effort = -(rate @ np.array([3.0, -7.0]))
    assert forces.efforts["crank.angle"] == pytest.approx(effort, abs=1e-7)
    assert forces.checks["balance"] < 1e-12


def arm_at(theta: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Place of arm.P from its two slots: n.(B - P) = 0 and e.(S - Q) = 0."""
    phi = share * theta
    e = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    n = np.stack([-np.sin(phi), np.cos(phi)], axis=1)
    B = 0.1 * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    along = e @ np.array([0.3, 0.1]) - 0.2
    return e * along[:, None] + n * (n * B).sum(axis=1)[:, None], phi


def tip(place: np.ndarray, phi: np.ndarray) -> np.ndarray:
    turned = [0.2 * np.cos(phi) - 0.05 * np.sin(phi), 0.2 * np.sin(phi) + 0.05 * np.cos(phi)]
    return place + np.stack(turned, axis=1)


# -- a carrier that does not carry the wheels ------------------------------------------------

STRAY = """
[ground]
points = { O = [0, 0], P = [0.5, 0.1] }
[bodies.wheel]
points = { O = [0, 0], W = [0.1, 0] }
[bodies.plate]                    # fast on the wheel: the pair never moves against each other
points = { W = [0, 0], E = [0.1, 0.05] }
[bodies.stray]
points = { P = [0, 0], T = [0.2, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "wheel.O"] }
fast = { kind = "weld", between = ["wheel.W", "plate.W"] }
P = { kind = "revolute", between = ["ground.P", "stray.P"] }
mesh = { kind = "MESH", between = ["wheel.O", "plate.E"], carrier = "stray"KEYS }
[sketch]
wheel_deg = 10
stray_deg = 10
[loads.turning]
kind = "torque"
body = "stray"
value = 2.5
[tasks.r]
kind = "reactions"
driver = { coordinate = "wheel.angle", from_deg = 5, to_deg = 65 }
poses = 7
"""


@pytest.mark.parametrize(("mesh", "keys", "share"), [("gear", ", ratio = -2", 1.0)])
def test_a_carrier_that_carries_nothing(tmp_path: Path, mesh: str, keys: str, share: float) -> None:
    """Both wheels turn as one, (th - c) = rho (th - c): the stray body turns with them.

    Its torque comes out at the driver: power 2.5 w + effort w = 0.
    """
    text = STRAY.replace("MESH", mesh).replace("KEYS", keys)
    result = md.solve(problem(tmp_path, text))
    theta = result.drivers["wheel.angle"].position
    assert result.bodies["stray"].angle == pytest.approx(share * theta, abs=1e-13)
    assert result.efforts["wheel.angle"] == pytest.approx(-2.5 * share + 0 * theta, abs=1e-12)
    assert any("mesh" in text for text in result.summary["assumptions"])
    assert result.checks["balance"] < 1e-12


def test_a_planted_mistake_of_carriers_is_seen(tmp_path: Path, monkeypatch) -> None:
    """Wheels that stand still against each other were taken for a pair carried by anything."""
    from mechdae.forces.teeth import real_pairs

    monkeypatch.setattr(real_pairs, "carried", lambda model, names, *_: np.ones(len(names), bool))
    text = STRAY.replace("MESH", "gear").replace("KEYS", ", ratio = -2")
    with pytest.raises(RuntimeError, match="square"):
        md.solve(problem(tmp_path, text))


# -- a curve between bodies that are known ---------------------------------------------------

CIRCLE = """
[ground]
points = { A = [0, 0] }
[bodies.crank]
points = { A = [0, 0], B = [0.1, 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
[joints.k]
kind = "curve"
between = ["ground.A", "crank.B"]
x = "R*cos(s)"
y = "R*sin(s)"
closed = true
[parameters]
R = 0.1
[sketch]
crank_deg = 30
k = 0.5
[loads.push]
kind = "torque"
body = "crank"
value = 1.5
[tasks.t]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = 30, to_deg = 390 }
poses = 37
[tasks.r]
kind = "reactions"
driver = { coordinate = "crank.angle", from_deg = 30, to_deg = 90 }
poses = 4
"""


def test_a_superfluous_curve_follows_its_pin(tmp_path: Path) -> None:
    path = problem(tmp_path, CIRCLE)
    result = md.solve(path, task="t")
    theta = result.drivers["crank.angle"].position
    assert set(result.status) == {"ok"}
    assert result.joints["k"].s == pytest.approx(theta, abs=1e-13)
    assert result.joints["k"].s_velocity == pytest.approx(np.ones(37), abs=1e-13)
    assert result.summary["superfluous"] == [{"joints": ["A", "k"], "count": 1}]
    forces = md.solve(path, task="r")
    assert forces.efforts["crank.angle"] == pytest.approx(np.full(4, -1.5), abs=1e-14)
    assert forces.summary["not_unique"] == ["A", "k"]
    assert np.isnan(forces.joints["k"]["normal"]).all()


def test_a_contradictory_curve_does_not_assemble(tmp_path: Path) -> None:
    for radius in ("0.11", "0.1000001"):
        with pytest.raises(md.SolveError, match="1 redundant"):
            md.solve(problem(tmp_path, CIRCLE), task="t", set={"R": float(radius)})


# -- a cam whose follower has a second guide -------------------------------------------------

ECCENTRIC = """
[parameters]
R = 0.03
e = 0.01
rho = 0.008
offset = 0.006
stem = 0.04
[ground]
points = { O = [0, 0], G = ["offset", 0] }
[bodies.cam]
points = { O = [0, 0] }
[bodies.follower]
points = { C = [0, 0], T = [0, "stem"] }
[joints]
O = { kind = "revolute", between = ["ground.O", "cam.O"] }
guide2 = { kind = "prismatic", between = ["ground.G", "follower.C"], axis_deg = 90 }
guide = { kind = "prismatic", between = ["ground.G", "follower.T"], axis_deg = 90 }
[joints.profile]
kind = "curve"
between = ["cam.O", "follower.C"]
closed = true
roller_radius = "rho"
x = "e + R*cos(s)"
y = "R*sin(s)"
[sketch]
cam_deg = 0
guide_mm = 77
[loads.down]
kind = "force"
point = "follower.T"
value = [0, -20]
[tasks.r]
kind = "reactions"
driver = { coordinate = "cam.angle", from_deg = 10, to_deg = 350, speed = 3 }
poses = 18
"""


def test_a_second_guide_leaves_the_cam_its_force(tmp_path: Path) -> None:
    """The roller's centre is R + rho from the disk's: y = e sin + sqrt((R + rho)^2 - x^2)."""
    result = md.solve(problem(tmp_path, ECCENTRIC))
    theta = result.drivers["cam.angle"].position
    x = 0.006 - 0.01 * np.cos(theta)
    up = np.sqrt(0.038**2 - x**2)
    y = 0.01 * np.sin(theta) + up
    assert result.points["follower.C"].position[:, 1] == pytest.approx(y, abs=1e-13)
    rate = 0.01 * np.cos(theta) - x * 0.01 * np.sin(theta) / up
    assert result.efforts["cam.angle"] == pytest.approx(20 * rate, abs=1e-11)
    # the force goes along the line of centres; the cam holds the load's 20 N alone
    normal = np.abs(result.joints["profile"].normal)
    assert normal == pytest.approx(20 * 0.038 / up, rel=1e-11)
    assert result.summary["not_unique"] == ["guide2", "guide"]
    assert np.isnan(result.joints["guide"]["normal"]).all()


def test_normals_of_needed_guides_are_kept(tmp_path: Path) -> None:
    """Without the second guide the first one has its normal force, 20 N times the slope."""
    text = "\n".join(line for line in ECCENTRIC.splitlines() if not line.startswith("guide2"))
    result = md.solve(problem(tmp_path, text))
    theta = result.drivers["cam.angle"].position
    x = 0.006 - 0.01 * np.cos(theta)
    up = np.sqrt(0.038**2 - x**2)
    assert np.abs(result.joints["guide"].normal) == pytest.approx(20 * np.abs(x) / up, abs=1e-11)


# -- contradictory pins ----------------------------------------------------------------------


def test_two_pins_on_one_point_leave_a_body_free(tmp_path: Path, capsys) -> None:
    path = problem(
        tmp_path,
        """
[ground]
points = { p = [1.0, 0.0] }
[bodies.a]
points = { p = [0.0, 0.0], q = [-2.0, 0.0] }
[bodies.b]
points = { p = [-2.0, -1.0], q = [1.0, -2.0] }
[bodies.c]
points = { p = [-2.0, 0.0], q = [2.0, -1.0] }
[joints]
slot = { kind = "pin-in-slot", between = ["ground.p", "b.q"] }
fast = { kind = "weld", between = ["a.p", "b.q"] }
one = { kind = "revolute", between = ["c.p", "a.p"] }
two = { kind = "revolute", between = ["c.q", "a.p"] }
[sketch]
b = 0.0
c = 0.0
[tasks.t]
kind = "sweep"
driver = { coordinate = "a.q.x", from = 0.3, to = 0.9 }
""",
    )
    with pytest.raises(md.MechanismError, match=r"b can still move.*depend on each other"):
        md.solve(path)
    assert main(["solve", str(path)]) == 2
    assert "can still move" in capsys.readouterr().err


# -- drivers, tasks and other values of the wrong type ---------------------------------------


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('driver_rpm = { coordinate = "crank.angle", at = [1] }', r"tasks\.t\.driver_rpm.*no unit"),
        ('driver_deg = { coordinate = "crank.angle", at = [1] }', r"tasks\.t\.driver_deg.*no unit"),
        ('drivers_mm = [{ coordinate = "crank.angle", at = [1] }]', "drivers_mm.*no unit"),
        ("drivers = []", r"tasks\.t\.drivers: the list of drivers is empty"),
        ('driver = "crank.angle"', r"tasks\.t\.driver"),
        ("driver = []", r"tasks\.t\.driver"),
        ("drivers = [1]", r"tasks\.t\.drivers\[0\]"),
        ('poses_deg = 3\ndriver = { coordinate = "crank.angle", at = [1] }', "poses_deg.*no unit"),
    ],
)
def test_drivers_of_a_file(tmp_path: Path, line: str, words: str) -> None:
    path = problem(tmp_path, SLOTTED + f'[tasks.t]\nkind = "sweep"\n{line}\n')
    with pytest.raises(md.InputError) as caught:
        md.load(path)
    assert re.search("(?s)" + words, str(caught.value))


@pytest.mark.parametrize(
    "call",
    [
        lambda: md.Sweep(driver={"coordinate": "crank.angle", "at": [0.1]}),
        lambda: md.Sweep(driver="crank.angle"),
        lambda: md.Sweep(driver=3),
        lambda: md.Sweep(drivers=md.Driver("crank.angle", at=(0.1,))),
        lambda: md.Sweep(drivers=()),
        lambda: md.Modes(drivers=[{"coordinate": "crank.angle"}]),
        lambda: md.Motion(drivers=["crank.angle"], until=1.0),
        lambda: md.Equilibrium(drivers=[1]),
        *[lambda task=task: md.solve("four-bar-crank-rocker", task=task)
          for task in (5, 2.0, [], {}, True, b"turn")],
        lambda: md.solve("four-bar-crank-rocker", set={5: 1}),
        lambda: md.solve("four-bar-crank-rocker", workers=2),
        lambda: md.load("four-bar-crank-rocker").with_task("x", 5),
        lambda: md.Problem(5),
        lambda: md.function("four-bar-crank-rocker", inputs="crank.angle", outputs=["centres"]),
        lambda: md.function("four-bar-crank-rocker", inputs=[5], outputs=["centres"]),
        lambda: md.function("four-bar-crank-rocker", inputs=["crank.angle"], outputs=[5]),
    ],
)  # fmt: skip
def test_values_of_the_wrong_type_in_python(call) -> None:
    with pytest.raises(md.InputError):
        call()


def test_a_function_far_away_is_nan() -> None:
    inputs, paths = ["crank.angle", "a"], ["points/coupler.P/position"]
    f = md.function("four-bar-crank-rocker", inputs=inputs, outputs=paths)
    for values in ((1e9, 0.04), (-1e9, 0.04), (1e300, 0.04), (np.inf, 0.04), (np.nan, 0.04)):
        assert np.isnan(np.array(f(*values))).all(), values
    # b + c = 0.2 reach no pin further than 0.3 m from A: no pose whatever the step was
    for length in (1e9, 1e6, 1e3, 0.5, 0.31, -1.0, np.nan, 1e300):
        assert np.isnan(np.array(f(0.7, length))).all(), length
    # further crank than the path is long, and one that the path reaches: two circles
    for length in (0.03, 0.06, 0.1, 0.2):
        B = length * np.array([np.cos(0.7), np.sin(0.7)])
        gap = np.array([0.1, 0.0]) - B
        far = np.hypot(*gap)
        along = (far**2 + 0.12**2 - 0.08**2) / (2 * far)
        e, up = gap / far, np.sqrt(0.12**2 - along**2)
        C = B + along * e + up * np.array([-e[1], e[0]])  # above BD, as sketched
        u = (C - B) / 0.12
        P = B + 0.06 * u + 0.04 * np.array([-u[1], u[0]])
        assert np.array(f(0.7, length)).ravel() == pytest.approx(P, abs=1e-13), length


@pytest.mark.parametrize(
    ("text", "words"),
    [("1/0", "no value"), ("2**1000000", "no value"), ("(0-8)**0.5", "not a real"),
     ("log(0)", "no value"), ("sin(1, 2)", "takes 1"), ("min(1)", "2 or more"), ("hypot(1)", "2")],
)  # fmt: skip
@pytest.mark.parametrize("place", ["parameter", "load", "output"])
def test_expressions_without_a_value(tmp_path: Path, place: str, text: str, words: str) -> None:
    extra = {
        "parameter": f'[parameters]\nr = "{text}"\n',
        "load": f'[loads.f]\nkind = "torque"\nbody = "crank"\nvalue = "{text}"\n',
        "output": f'[outputs]\no = "crank.angle + {text}"\n',
    }[place]
    task = TURN.replace("sweep", "reactions")
    path = problem(tmp_path, SLOTTED + extra + task)
    with pytest.raises(md.InputError, match=words):
        md.solve(path, poses=3)


def test_a_law_with_an_infinite_rate_has_none_and_no_warning() -> None:
    """|t|^1.5 has no second derivative at 0, and 0.75/sqrt(t) elsewhere."""
    times = (0.0, 0.25, 1.0)
    driver = md.Driver("crank.angle", law="abs(t)**1.5", times=times)
    result = md.solve("four-bar-crank-rocker", md.Sweep(driver=driver))
    own = result.drivers["crank.angle"]
    assert own.position == pytest.approx([0.0, 0.125, 1.0], abs=1e-15)
    assert own.velocity == pytest.approx([0.0, 0.75, 1.5], abs=1e-14)
    assert np.isnan(own.acceleration[0])
    assert own.acceleration[1:] == pytest.approx([1.5, 0.75], abs=1e-13)


# -- mutated files ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tables() -> dict:
    return mutations.bases()


@pytest.mark.parametrize("first", range(0, 40, 20))
def test_mutated_files_end_with_a_message(first: int, tables: dict, tmp_path: Path) -> None:
    for seed in range(first, first + 20):
        record = mutations.run(seed, tables, tmp_path)
        fault = record.get("fault", "")
        assert not fault or fault.endswith(" s"), record  # seconds are measured by the script


def test_kinds_that_are_no_text(tables: dict) -> None:
    """Each kind of joint, load, task, goal of the predefined files is made a list, a table, ..."""
    seen = set()
    for name, base in tables.items():
        for path in mutations.places(base):
            sort = (path[0], len(path), str(mutations.at(base, path)))
            if path[-1] != "kind" or sort in seen:
                continue
            seen.add(sort)
            for value in ([], {}, [sort[-1]], {"a": sort[-1]}, 3, 0.5, True):
                own = json.loads(json.dumps(base))
                mutations.at(own, path[:-1])["kind"] = value
                with pytest.raises(md.InputError):
                    from_dict(own, name)
    assert len(seen) > 40


@pytest.mark.parametrize("name", ["rssr", "five-rod-suspension", "four-bar-crank-rocker"])
def test_points_far_away_are_answered(name: str, tables: dict, tmp_path: Path) -> None:
    """Lengths whose squares are no numbers: an answer without a warning."""
    own = json.loads(json.dumps(tables[name]))
    points = own["ground"]["points" if "points" in own["ground"] else "points_mm"]
    far = list(points)[-1]
    points[far] = [points[far][0], 1e99, *points[far][2:]]
    path = tmp_path / "far.toml"
    path.write_text(mutations.text_of(own), encoding="utf-8")
    assert main(["show", str(path)]) in (0, 1)


def test_a_driven_body_without_a_joint_of_its_group_stops_a_motion() -> None:
    """A platform that six coordinates of points drive beyond its size: its group has no joint."""
    own = tomllib.loads((DATA / "starts/stewart.toml").read_text(encoding="utf-8"))
    own["bodies"]["plate"]["points"]["T1"][0] = 0.0
    problem = from_dict(own)
    task = next(iter(problem.tasks))
    result = md.solve(problem, task)
    assert set(result.status) == {"unassembled"}
    assert "" in {event["joint"] for event in result.events}
    assert "joint \n" not in table(result)


def test_a_planted_traceback_is_seen(tables: dict, tmp_path: Path, monkeypatch) -> None:
    """Without a check of their count, drivers that are an empty list end in NumPy."""
    from mechdae.describe.tasks import kinds

    def careless(self: kinds.Driven) -> None:
        super(kinds.Driven, self).__post_init__()

    monkeypatch.setattr(kinds.Driven, "__post_init__", careless)

    def own(seed: int, given: dict) -> tuple:
        base = dict(given["four-bar-crank-rocker"])
        del base["expected"]
        base["tasks"] = {"turn": {"kind": "sweep", "drivers": []}}
        return "four-bar-crank-rocker", mutations.text_of(base), [], ["solve"]

    monkeypatch.setattr(mutations, "case", own)
    assert "at " in mutations.run(0, tables, tmp_path)["fault"]


def test_cases_are_the_same_in_every_run(tables: dict) -> None:
    for seed in random.Random(3).sample(range(10_000), 20):
        assert mutations.case(seed, tables) == mutations.case(seed)
