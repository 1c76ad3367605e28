"""A planted mechanism is found again, for each kind of goal and of mechanism.

Targets come from closed forms (``closure_fourbar`` or written here). The file begins elsewhere
within bounds around the plant. Compared are objective and defects, never dimensions: cognates do
the same as the plant.
"""

import tomllib

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.design.synthesis.synthesize import synthesize
from tests.reference.closure_fourbar import TURN, FourBar, GearedFiveBar, judged, lowest, rrp, rrr

EXACT = 1e-15
"""Objective of a planted optimum, in squares of the targets' size."""


def inline(value):
    """Return a value as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {inline(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(inline(v) for v in value) + "]"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, (bool, np.bool_)):
        return str(bool(value)).lower()
    return repr(float(value)) if not isinstance(value, int) else str(value)


def problem(text, parameters, driver, goals, free, constraints=(), tasks=""):
    """Return a problem with a task of synthesis; without a plant's own values."""
    own = "\n".join(f"{name} = {inline(value)}" for name, value in parameters.items())
    whole = f"""
schema = 1
[parameters]
{own}
{text}
[tasks.design]
kind = "synthesis"
driver = {{ coordinate = "{driver}" }}
goals = {inline(list(goals))}
free = {inline(free)}
constraints = {inline(list(constraints))}
{tasks}
"""
    return from_dict(tomllib.loads(whole))


def designs(found, starts=3, seed=1):
    """Return the designs and the summary of its task."""
    result = synthesize(found, "design", found.tasks["design"], starts=starts, seed=seed)
    for design in result.data["designs"]:
        assert design["defects"] == []
    return result.data["designs"], result


def around(plant, share=0.25, least=0.2):
    """Return bounds around a plant, not centred at it."""
    found = {}
    for name, value in plant.items():
        span = share * max(abs(value), least)
        found[name] = [value - 0.8 * span, value + 1.2 * span]
    return found


def begun(plant, bounds):
    """Return where the file begins: away from the plant, within the bounds."""
    return {name: 0.3 * low + 0.7 * high for name, (low, high) in bounds.items()}


FOUR = """
[ground]
points = { A0 = ["x0", "y0"] }
[bodies.frame]
points = { A0 = [0, 0], B0 = ["r1", 0] }
[bodies.crank]
points = { A0 = [0, 0], A = ["r2", 0] }
[bodies.coupler]
points = { A = [0, 0], B = ["r3", 0], P = ["px", "py"] }
[bodies.rocker]
points = { B0 = [0, 0], B = ["r4", 0] }
[joints]
base = { kind = "weld", between = ["ground.A0", "frame.A0"], turn = "theta0" }
A0 = { kind = "revolute", between = ["frame.A0", "crank.A0"] }
A = { kind = "revolute", between = ["crank.A", "coupler.A"] }
B = { kind = "revolute", between = ["coupler.B", "rocker.B"] }
B0 = { kind = "revolute", between = ["frame.B0", "rocker.B0"] }
[sketch]
crank_deg = 60
coupler_deg = 15
rocker_deg = 95
"""
PLANT = {
    "r1": 4.0, "r2": 1.5, "r3": 3.5, "r4": 3.0, "px": 2.0, "py": 1.2, "x0": 0.4, "y0": -0.3,
    "theta0": 0.2,
}  # fmt: skip
AT = np.radians([10, 50, 95, 140, 200, 260, 320])
TURNED = {"kind": "full-turn", "coordinate": "A0.angle"}


def linkage(p):
    return FourBar(
        tuple(p[f"r{k}"] for k in (1, 2, 3, 4)), complex(p["px"], p["py"]), p["x0"], p["y0"],
        p["theta0"],
    )  # fmt: skip


def places(p, theta):
    """Return places of the coupler point (k, 2)."""
    z = linkage(p).moved(np.asarray(theta), (1,))[0]["point"]
    return np.stack([z.real, z.imag], axis=1)


def size2(targets):
    return float(np.sum((targets - targets.mean(axis=0)) ** 2))


def four(goals, constraints=(TURNED,), plant=PLANT, free=None, tasks="", driver="A0.angle"):
    bounds = around(plant) if free is None else free
    numbers = {name: b for name, b in bounds.items() if isinstance(b, list)}
    given = {**plant, **begun(plant, {n: numbers[n] for n in numbers if n in plant})}
    return problem(FOUR, given, driver, goals, bounds, constraints, tasks)


# -- path ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("timing", ["at", "steps", "free"])
def test_path_of_a_four_bar(timing):
    theta = AT + 0.3
    targets = places(PLANT, theta)
    goal = {"kind": "path", "point": "coupler.P", "targets": targets}
    goal |= {"at": {"at": theta}, "steps": {"steps": AT - AT[0]}, "free": {"timing": "free"}}[
        timing
    ]
    found, _ = designs(four([goal]), starts=6)
    assert found[0]["objective"] <= EXACT * size2(targets)
    verdict = judged(linkage(found[0]["parameters"]), found[0]["at"], targets)
    assert verdict.defects == ()
    assert verdict.f <= EXACT * size2(targets)


SLIDER = """
[ground]
points = { O = [0, 0], E = [0, "e"] }
[bodies.crank]
points = { O = [0, 0], B = ["r", 0] }
[bodies.rod]
points = { B = [0, 0], C = ["l", 0], P = ["px", "py"] }
[bodies.slider]
points = { C = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] FRICTION }
B = { kind = "revolute", between = ["crank.B", "rod.B"] FRICTION }
C = { kind = "revolute", between = ["rod.C", "slider.C"] FRICTION }
guide = { kind = "prismatic", between = ["ground.E", "slider.C"] GUIDE }
[sketch]
crank_deg = 60
rod_deg = -10
"""
SLIDING = {"r": 1.0, "l": 3.2, "e": 0.3, "px": 1.5, "py": 0.6}
BARE = SLIDER.replace(" FRICTION", "").replace(" GUIDE", "")


def slid(p, theta):
    """Return crank pin and slider of a slider-crank."""
    B = p["r"] * np.exp(1j * np.asarray(theta))
    return B, rrp(B, p["l"], 1j * p["e"], 1.0, 1)[0]


def test_path_of_a_slider_crank():
    B, C = slid(SLIDING, AT)
    z = B + complex(SLIDING["px"], SLIDING["py"]) * (C - B) / SLIDING["l"]
    targets = np.stack([z.real, z.imag], axis=1)
    bounds = around(SLIDING)
    goal = {"kind": "path", "point": "rod.P", "targets": targets, "at": AT}
    turned = {"kind": "full-turn", "coordinate": "O.angle"}
    given = begun(SLIDING, bounds)
    found, _ = designs(problem(BARE, given, "O.angle", [goal], bounds, [turned]))
    assert found[0]["objective"] <= EXACT * size2(targets)
    p = found[0]["parameters"]
    B, C = slid(p, AT)
    own = B + complex(p["px"], p["py"]) * (C - B) / p["l"]
    assert np.sum(np.abs(own - z) ** 2) <= EXACT * size2(targets)
    assert p["l"] - abs(p["e"]) > p["r"]


SIX = """
[ground]
points = { A0 = [0, 0], B0 = [1, 0], G = ["gx", "gy"] }
[bodies.crank]
points = { A0 = [0, 0], A = ["a", 0] }
[bodies.coupler]
points = { A = [0, 0], B = ["b", 0], U = ["u", "v"] }
[bodies.rocker]
points = { B0 = [0, 0], B = ["c", 0] }
[bodies.link]
points = { U = [0, 0], F = ["e", 0], P = ["px", "py"] }
[bodies.output]
points = { G = [0, 0], F = ["f", 0] }
[joints]
A0 = { kind = "revolute", between = ["ground.A0", "crank.A0"] }
A = { kind = "revolute", between = ["crank.A", "coupler.A"] }
B = { kind = "revolute", between = ["coupler.B", "rocker.B"] }
B0 = { kind = "revolute", between = ["ground.B0", "rocker.B0"] }
U = { kind = "revolute", between = ["coupler.U", "link.U"] }
F = { kind = "revolute", between = ["link.F", "output.F"] }
G = { kind = "revolute", between = ["ground.G", "output.G"] }
[sketch]
crank_deg = 60
coupler_deg = 30
rocker_deg = 100
link_deg = 0
output_deg = 100
"""
STEPHENSON = {
    "a": 0.35, "b": 1.0, "c": 0.8, "u": 0.5, "v": 0.4, "e": 1.6, "f": 1.1, "gx": 1.9, "gy": 0.1,
    "px": 0.8, "py": 0.3,
}  # fmt: skip


def stephenson(p, theta):
    """Return the pin F and the point P of a Stephenson III, and the heights of its dyads."""
    A = p["a"] * np.exp(1j * np.asarray(theta))
    B, h1 = rrr(A, 1 + 0j * A, p["b"], p["c"], 1)
    U = A + complex(p["u"], p["v"]) * (B - A) / p["b"]
    F, h2 = rrr(U, complex(p["gx"], p["gy"]) + 0j * A, p["e"], p["f"], 1)
    return F, U + complex(p["px"], p["py"]) * (F - U) / p["e"], np.minimum(h1, h2)


def test_path_of_a_six_bar():
    z = stephenson(STEPHENSON, AT)[1]
    assert stephenson(STEPHENSON, np.linspace(0, TURN, 721))[2].min() > 0.02
    targets = np.stack([z.real, z.imag], axis=1)
    goal = {"kind": "path", "point": "link.P", "targets": targets, "at": AT}
    bounds = around(STEPHENSON, share=0.1)
    turned = {"kind": "full-turn", "coordinate": "A0.angle"}
    given = begun(STEPHENSON, bounds)
    found, _ = designs(problem(SIX, given, "A0.angle", [goal], bounds, [turned]))
    assert found[0]["objective"] <= EXACT * size2(targets)
    p = found[0]["parameters"]
    assert np.sum(np.abs(stephenson(p, AT)[1] - z) ** 2) <= EXACT * size2(targets)
    assert stephenson(p, np.linspace(0, TURN, 2881))[2].min() > 0


def test_box_of_a_point_over_a_turn_of_a_six_bar():
    # the pin F of the plant goes further right than the box allows
    turn = np.linspace(0, TURN, 2881)
    z, F = stephenson(STEPHENSON, AT)[1], stephenson(STEPHENSON, turn)[0]
    wall = float(F.real.max()) - 0.02
    targets = np.stack([z.real, z.imag], axis=1)
    goal = {"kind": "path", "point": "link.P", "targets": targets, "at": AT}
    box = {"kind": "box", "points": ["link.F"], "x": [-9.0, wall]}
    bounds = around(STEPHENSON, share=0.1)
    given = begun(STEPHENSON, bounds)
    turned = {"kind": "full-turn", "coordinate": "A0.angle"}
    asked = problem(SIX, given, "A0.angle", [goal], bounds, [turned, box])
    found, _ = designs(asked)
    assert found
    p = {**STEPHENSON, **found[0]["parameters"]}
    reach = stephenson(p, turn)[0].real.max()
    assert reach <= wall + 2e-3
    own = float(np.sum(np.abs(stephenson(p, AT)[1] - z) ** 2))
    assert own == pytest.approx(found[0]["objective"], rel=1e-6, abs=1e-12)


# -- motion ----------------------------------------------------------------------------------------


DYADS = """
[ground]
points = { A0 = ["ax", "ay"], B0 = ["bx", "by"] }
[bodies.crank]
points = { A0 = [0, 0], A = ["la", 0] }
[bodies.coupler]
points = { O = [0, 0], A = ["ux", "uy"], B = ["vx", "vy"] }
[bodies.rocker]
points = { B0 = [0, 0], B = ["lb", 0] }
[joints]
A0 = { kind = "revolute", between = ["ground.A0", "crank.A0"] }
A = { kind = "revolute", between = ["crank.A", "coupler.A"] }
B = { kind = "revolute", between = ["coupler.B", "rocker.B"] }
B0 = { kind = "revolute", between = ["ground.B0", "rocker.B0"] }
[sketch]
crank_deg = 60
coupler_deg = 10
rocker_deg = 80
"""
TWO = {
    "ax": -1.0, "ay": 2.0, "ux": -1.0, "uy": 1.6, "la": 1.5, "bx": 3.0, "by": 1.0, "vx": 2.5,
    "vy": 1.6, "lb": 3.0,
}  # fmt: skip


def carried(p, theta, sign):
    """Return poses (k, 3) of a coupler between two dyads."""
    A0, B0 = complex(p["ax"], p["ay"]), complex(p["bx"], p["by"])
    u, v = complex(p["ux"], p["uy"]), complex(p["vx"], p["vy"])
    A = A0 + p["la"] * np.exp(1j * np.asarray(theta))
    B, height = rrr(A, B0 + 0j * A, abs(v - u), p["lb"], sign)
    turn = (B - A) / (v - u)
    place = A - turn * u
    return np.stack([place.real, place.imag, np.angle(turn)], axis=1), height


@pytest.mark.parametrize(("count", "measure"), [(4, "least-squares"), (5, "exact")])
def test_motion_of_a_coupler(count, measure):
    theta = np.radians([20, 60, 100, 150, 210])[:count]
    poses, height = carried(TWO, theta, 1)
    assert height.min() > 0.01
    goal = {"kind": "motion", "body": "coupler", "poses": poses, "measure": measure}
    bounds = around(TWO, 0.15)
    asked = problem(DYADS, begun(TWO, bounds), "A0.angle", [goal], bounds)
    best = designs(asked, starts=6)[0][0]
    misses = []
    for sign in (1, -1):
        own, height = carried(best["parameters"], best["at"], sign)
        gap = own - poses
        gap[:, 2] = np.sin(gap[:, 2])
        misses.append(np.abs(gap).max())
    # four poses leave more freedom than poses, five leave none
    assert min(misses) <= 1e-6
    span = np.linspace(best["at"][0], best["at"][-1], 721)
    assert carried(best["parameters"], span, 1)[1].min() > 0


# -- function --------------------------------------------------------------------------------------


def test_function_of_a_slider_crank():
    # the slide is measured from the guide's own point: x of the slider
    _, C = slid(SLIDING, AT)
    bounds = around({k: SLIDING[k] for k in ("r", "l", "e")})
    goal = {
        "kind": "function", "input": "O.angle", "output": "guide.slide",
        "targets": np.stack([AT, C.real], axis=1),
    }  # fmt: skip
    given = {**SLIDING, **begun(SLIDING, bounds)}
    found, _ = designs(problem(BARE, given, "O.angle", [goal], bounds))
    p = found[0]["parameters"]
    assert found[0]["objective"] <= EXACT
    np.testing.assert_allclose(slid(p, AT)[1].real, C.real, atol=1e-7)


def test_function_of_a_four_bar():
    plant = {k: PLANT[k] for k in ("r2", "r3", "r4")}
    psi = np.unwrap(linkage(PLANT).moved(AT, (1,))[0]["output"])
    goal = {
        "kind": "function", "input": "A0.angle", "output": "B0.angle",
        "targets": np.stack([AT, psi], axis=1),
    }  # fmt: skip
    bounds = around(plant)
    given = {**PLANT, **begun(plant, bounds)}
    found, _ = designs(problem(FOUR, given, "A0.angle", [goal], bounds))
    p = {**PLANT, **found[0]["parameters"]}
    assert found[0]["objective"] <= EXACT
    np.testing.assert_allclose(np.unwrap(linkage(p).moved(AT, (1,))[0]["output"]), psi, atol=1e-7)


# -- crank-rockers, straight lines -----------------------------------------------------------------


def best_rocker(swing, ratio):
    """Return the best least transmission angle for swing and time ratio with r1 = 1, by scan."""
    offset = np.pi * (ratio - 1) / (ratio + 1)
    r4, first = np.meshgrid(np.linspace(0.2, 2.0, 1201), np.linspace(0.02, 3.0, 3001))
    ends = [1 + r4**2 - 2 * r4 * np.cos(first + s) for s in (0, swing)]
    far, near = np.sqrt(ends[1]), np.sqrt(ends[0])
    # directions of A0-B at both ends
    turned = [np.angle(1 + r4 * np.exp(1j * (np.pi - a))) for a in (first, first + swing)]
    gap = np.abs(turned[1] - turned[0]) - offset
    k, j = np.nonzero(np.diff(np.sign(gap), axis=0))
    share = gap[k, j] / (gap[k, j] - gap[k + 1, j])
    r2, r3 = (far - near) / 2, (far + near) / 2
    own = [np.array(v[k, j] + share * (v[k + 1, j] - v[k, j])) for v in (r2, r3, r4)]
    good = (own[0] > 0.02) & (first[k, j] + swing < np.pi)
    cosines = [
        np.abs(own[1] ** 2 + own[2] ** 2 - (1 + s * own[0]) ** 2) / (2 * own[1] * own[2])
        for s in (1, -1)
    ]
    mu = np.arccos(np.clip(np.maximum(*cosines), 0, 1))
    return float(mu[good].max())


def test_rocker_with_the_best_transmission_angle():
    swing, ratio = np.radians(45), 1.1
    goals = [
        {"kind": "rocker", "body": "rocker", "swing": swing, "time_ratio": ratio},
        {"kind": "maximise", "of": "turn/joints/B/transmission_angle"},
    ]
    plant = {**PLANT, "r1": 1.0, "x0": 0.0, "y0": 0.0, "theta0": 0.0}
    free = {name: [0.15, 1.6] for name in ("r2", "r3", "r4")}
    task = """
[tasks.turn]
kind = "sweep"
driver = { coordinate = "A0.angle", from_deg = 0, to_deg = 360 }
poses = 181
measures = ["transmission"]
"""
    given = {**plant, "r2": 0.3, "r3": 0.9, "r4": 0.7}
    found, _ = designs(problem(FOUR, given, "A0.angle", goals, free, [TURNED], task), starts=6)
    assert found[0]["objective"] == pytest.approx(best_rocker(swing, ratio), abs=2e-4)


def test_straight_line_is_no_worse_than_the_plant():
    # Hoecken's proportions for half a turn: 2.2, 2.8 cranks, the point as far beyond B
    plant = {**PLANT, "r1": 2.2, "r2": 1.0, "r3": 2.8, "r4": 2.8, "px": 5.6, "py": 0.0}
    plant |= {"x0": 0.0, "y0": 0.0, "theta0": 0.0}
    theta = np.linspace(np.pi / 2, 1.5 * np.pi, 721)
    z = linkage(plant).moved(theta, (1,))[0]["point"]
    z = (z - z[0]) / (z[-1] - z[0])
    hoecken = float(np.ptp(z.imag)) / 2
    free = {k: [0.9 * plant[k], 1.1 * plant[k]] for k in ("r1", "r3", "r4", "px")}
    free["py"] = [-0.2, 0.2]
    goal = {"kind": "straight-line", "point": "coupler.P", "arc_deg": 180}
    found, _ = designs(problem(FOUR, plant, "A0.angle", [goal], free, [TURNED]), starts=2)
    best = found[0]
    p = {**plant, **best["parameters"]}
    own = np.linspace(best["at"][0], best["at"][-1], 2881)
    values = [linkage(p).moved(own, (s,))[0]["point"] for s in (1, -1)]
    scaled = [(v - v[0]) / (v[-1] - v[0]) for v in values]
    straight = min(float(np.ptp(v.imag)) / 2 for v in scaled)
    assert straight <= 1.01 * hoecken
    assert lowest(linkage(p), (1,), 0.0, TURN) > 0


# -- forces ----------------------------------------------------------------------------------------

PRESSED = """
[loads.work]
kind = "resistance"
coordinate = "guide.slide"
negative = "F"
positive = "F"
[tasks.cycle]
kind = "reactions"
driver = { coordinate = "O.angle", from_deg = 0, to_deg = 360, speed = 1.0 }
poses = 181
friction = "article"
friction_radius = "article"
cycle = true
"""
NODES = 2 * np.pi * np.arange(20_000) / 20_000
FORCE = {"F": 10.0, "mu": 0.1, "rho": 0.05, "mug": 0.1}
RUBBED = SLIDER.replace(" FRICTION", ', friction = "mu", pin_radius = "rho"').replace(
    " GUIDE", ', friction = "mug"'
)


def pressed(p, theta=NODES):
    """Return effort without friction, rod force, and the losses of pins and guide (article)."""
    B = slid(p, theta)[0]
    lean = np.arcsin((p["e"] - B.imag) / p["l"])  # of the rod
    turn = -p["r"] * np.cos(theta) / (p["l"] * np.cos(lean))  # its speed for a unit of the crank
    speed = -p["r"] * np.sin(theta) - p["l"] * np.sin(lean) * turn
    rod = FORCE["F"] / np.cos(lean)
    side = FORCE["F"] * np.abs(np.tan(lean))
    pins = rod * (1 + np.abs(turn - 1) + np.abs(turn)) * FORCE["mu"] * FORCE["rho"]
    return FORCE["F"] * np.abs(speed), rod, pins + FORCE["mug"] * side * np.abs(speed)


def pressed_problem(goal, free, limits=()):
    given = {**SLIDING, "e": 0.25, **FORCE}
    given = {n: v for n, v in given.items() if n not in ("px", "py")} | {"px": 0.0, "py": 0.0}
    turned = {"kind": "full-turn", "coordinate": "O.angle"}
    return problem(RUBBED, given, "O.angle", [goal], free, [turned, *limits], PRESSED)


def scanned(of, low=-0.4, high=0.6):
    """Return the least of a function of the offset of the guide."""
    return min(of({**SLIDING, "e": e}) for e in np.linspace(low, high, 401))


@pytest.mark.parametrize(
    ("goal", "of"),
    [
        ({"kind": "minimise", "of": "cycle/joints/B/reaction", "reduce": "peak"},
         lambda p: pressed(p)[1].max()),
        ({"kind": "minimise", "of": "cycle/efforts/O.angle", "reduce": "rms"},
         lambda p: np.sqrt(np.mean(pressed(p)[0] ** 2))),
        ({"kind": "minimise", "of": "cycle/summary/loss"},
         lambda p: np.mean(pressed(p)[2])),
        ({"kind": "maximise", "of": "cycle/summary/efficiency"},
         lambda p: np.mean(pressed(p)[2]) / np.mean(pressed(p)[0]) - 1),  # formula (10)
    ],
    ids=["peak reaction", "rms effort", "loss", "efficiency"],
)  # fmt: skip
def test_forces_as_goals(goal, of):
    found, _ = designs(pressed_problem(goal, {"e": [-0.4, 0.6]}), starts=2)
    best = found[0]
    sign = -1 if goal["kind"] == "maximise" else 1
    # what is reported is what the dimensions give, and no other offset is better
    assert sign * best["objective"] == pytest.approx(
        of({**SLIDING, **best["parameters"]}), rel=2e-4
    )
    assert sign * best["objective"] <= scanned(of) + 2e-4 * abs(scanned(of))


def test_limit_on_a_quantity_of_another_task():
    # rods shorter than 2.5 press harder than allowed: the plant's 1.8 cannot be had
    allowed = FORCE["F"] / np.sqrt(1 - (1 / 2.5) ** 2)
    own = {**SLIDING, "e": 0.0}
    x = slid({**own, "l": 1.8}, AT)[1].real
    goal = {
        "kind": "function", "input": "O.angle", "output": "guide.slide",
        "targets": np.stack([AT, x], axis=1),
    }  # fmt: skip
    limit = {"kind": "limit", "of": "cycle/joints/B/reaction", "max": allowed}
    asked = pressed_problem(goal, {"l": [1.5, 4.0], "e": [-0.001, 0.001]}, [limit])
    found, _ = designs(asked, starts=2)
    p = {**SLIDING, **found[0]["parameters"]}
    assert p["l"] == pytest.approx(2.5, rel=2e-3)
    assert pressed(p)[1].max() <= allowed * (1 + 2e-3)
    missed = np.mean((slid(p, AT)[1].real - x) ** 2)
    assert found[0]["objective"] == pytest.approx(missed, rel=1e-6)


# -- several goals, limits of dimensions -----------------------------------------------------------


def test_weighted_sum_of_two_paths():
    other = {**PLANT, "px": 1.0, "py": -0.5}
    first, second = places(PLANT, AT), places(other, AT)
    shift = np.array([0.1, 0.0])
    text = FOUR.replace('P = ["px", "py"] }', 'P = ["px", "py"], Q = [1.0, -0.5] }')
    goals = [
        {"kind": "path", "point": "coupler.P", "targets": first, "at": AT, "weight": 1.0},
        {"kind": "path", "point": "coupler.Q", "targets": second + shift, "at": AT,
         "weight": 3.0},
    ]  # fmt: skip
    bounds = {k: v for k, v in around(PLANT).items() if k in ("x0", "y0", "px", "py")}
    given = {**PLANT, **begun(PLANT, bounds)}
    found, _ = designs(problem(text, given, "A0.angle", goals, bounds, [TURNED]), starts=2)
    # all of the shift goes into x0, and px, py take it back for P (its mean; it turns)
    best = found[0]
    p = {**PLANT, **best["parameters"]}
    values = [
        float(np.sum((places(p, AT) - first) ** 2)),
        float(np.sum((places({**p, "px": 1.0, "py": -0.5}, AT) - second - shift) ** 2)),
    ]
    assert best["goals"] == pytest.approx(values, rel=1e-6, abs=1e-12)
    assert best["objective"] == pytest.approx(values[0] + 3 * values[1], rel=1e-9)
    # the least squares optimum, linear in all that is free
    z = {n: {**PLANT, n: PLANT[n] + 1.0} for n in ("x0", "y0", "px", "py")}
    base = [places(PLANT, AT), places(other, AT)]
    columns = []
    for n, moved in z.items():
        of_p = places(moved, AT) - base[0]
        of_q = (places({**other, n: other[n] + 1.0}, AT) - base[1]) * (n in ("x0", "y0"))
        columns.append(np.concatenate([of_p.ravel(), np.sqrt(3) * of_q.ravel()]))
    A = np.array(columns).T
    b = np.concatenate([np.zeros(2 * len(AT)), np.sqrt(3) * np.tile(shift, len(AT))])
    x = np.linalg.lstsq(A, b, rcond=None)[0]
    assert best["objective"] == pytest.approx(float(np.sum((A @ x - b) ** 2)), rel=1e-6)


def test_ratio_of_lengths():
    targets = places(PLANT, AT)
    goal = {"kind": "path", "point": "coupler.P", "targets": targets, "at": AT}
    loose, tight = (
        designs(four([goal], [TURNED, {"kind": "ratio", "of": ["r3", "r2"], "max": most}]))[0][0]
        for most in (3.5 / 1.5 + 0.3, 3.5 / 1.5 - 0.1)
    )
    assert loose["objective"] <= EXACT * size2(targets)
    p = tight["parameters"]
    assert p["r3"] <= (3.5 / 1.5 - 0.1) * p["r2"] * (1 + 1e-8)
    verdict = judged(linkage(p), tight["at"], targets)
    assert verdict.defects == ()
    assert verdict.f == pytest.approx(tight["objective"], rel=1e-6, abs=EXACT * size2(targets))


@pytest.mark.parametrize(
    ("region", "inside"),
    [
        ({"disc": [0.4, -0.3, 0.2]}, lambda x, y: np.hypot(x - 0.4, y + 0.3) <= 0.2),
        ({"disc": [0.9, -0.3, 0.2]}, lambda x, y: np.hypot(x - 0.9, y + 0.3) <= 0.2 + 1e-7),
        ({"polygon": [[0.2, -0.6], [0.8, -0.6], [0.4, 0.1]]}, lambda x, y: y >= -0.6 - 1e-7),
        ({"polygon": [[0.8, -0.6], [1.2, -0.6], [0.8, 0.0]]}, lambda x, y: x >= 0.8 - 1e-7),
    ],
    ids=["disc", "disc away", "polygon", "polygon away"],
)
def test_pivot_in_a_region(region, inside):
    targets = places(PLANT, AT)
    goal = {"kind": "path", "point": "coupler.P", "targets": targets, "at": AT}
    free = around({k: v for k, v in PLANT.items() if k not in ("x0", "y0")})
    free["pivot"] = {"point": "ground.A0", **region}
    asked = four([goal], free=free)
    best = designs(asked, starts=2)[0][0]
    p = best["parameters"]
    assert inside(p["x0"], p["y0"])
    verdict = judged(linkage(p), best["at"], targets)
    assert verdict.defects == ()
    assert verdict.f == pytest.approx(best["objective"], rel=1e-6, abs=EXACT * size2(targets))
    away = np.hypot(p["x0"] - 0.4, p["y0"] + 0.3)
    if best["objective"] > 1e-9:
        assert away > 0.1  # the plant's pivot is outside, the limit costs something


GEARED = """
[ground]
points = { O = [0, 0], E = ["r1", 0] }
[bodies.crank]
points = { O = [0, 0], A = ["r2", 0] }
[bodies.second]
points = { E = [0, 0], D = ["r5", 0] }
[bodies.link]
points = { A = [0, 0], B = ["r3", 0], P = ["px", "py"] }
[bodies.arm]
points = { D = [0, 0], B = ["r4", 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
E = { kind = "revolute", between = ["ground.E", "second.E"] }
A = { kind = "revolute", between = ["crank.A", "link.A"] }
D = { kind = "revolute", between = ["second.D", "arm.D"] }
B = { kind = "revolute", between = ["link.B", "arm.B"] }
[joints.gears]
kind = "gear"
between = ["second.E", "crank.O"]
carrier = "ground"
ratio = "i"
phase = "phi"
[sketch]
crank_deg = 60
link_deg = 60
arm_deg = 110
"""


def test_gear_ratio_is_chosen():
    plant = {
        "r1": 2.0, "r2": 0.5, "r3": 2.0, "r4": 2.1, "r5": 0.6, "px": 1.0, "py": 0.5, "phi": 0.3,
    }  # fmt: skip
    theta = TURN * np.arange(12) / 12
    cosine = GearedFiveBar(
        tuple(plant[f"r{k}"] for k in (1, 2, 3, 4, 5)), -2, plant["phi"],
        complex(plant["px"], plant["py"]),
    )  # fmt: skip
    z = cosine.moved(theta, (1,))[0]["point"]
    targets = np.stack([z.real, z.imag], axis=1)
    goal = {"kind": "path", "point": "link.P", "targets": targets, "at": theta}
    free = {**around(plant, 0.1), "i": {"ratios": [-1, -2, 1, 2]}}
    turned = {"kind": "full-turn", "coordinate": "O.angle"}
    given = {**begun(plant, around(plant, 0.1)), "i": -1}
    found, _ = designs(problem(GEARED, given, "O.angle", [goal], free, [turned]), starts=8)
    best = found[0]
    p = best["parameters"]
    assert p["i"] == -2
    assert best["objective"] <= EXACT * size2(targets)
    own = GearedFiveBar(
        tuple(p[f"r{k}"] for k in (1, 2, 3, 4, 5)), p["i"], p["phi"], complex(p["px"], p["py"])
    )
    assert judged(own, theta, targets, ordered=False).defects == ()


def test_a_design_is_a_problem_that_solves(tmp_path):
    targets = places(PLANT, AT)
    goal = {"kind": "path", "point": "coupler.P", "targets": targets, "at": AT}
    best = designs(four([goal]))[0][0]
    (tmp_path / "design.toml").write_text(best["problem"])
    again = md.load(tmp_path / "design.toml")
    assert md.solve(again, "path").fault is None


def test_targets_in_any_order():
    targets = places(PLANT, AT)[[3, 0, 5, 1, 6, 2, 4]]
    goal = {"kind": "path", "point": "coupler.P", "targets": targets, "timing": "any"}
    found, _ = designs(four([goal]), starts=12)
    assert found[0]["objective"] <= EXACT * size2(targets)
    verdict = judged(linkage(found[0]["parameters"]), found[0]["at"], targets, ordered=False)
    assert verdict.defects == ()


def test_minimax_and_least_squares_each_win_by_their_measure():
    generator = np.random.default_rng(4)
    targets = places(PLANT, AT) + generator.uniform(-0.05, 0.05, (len(AT), 2))
    goal = {"kind": "path", "point": "coupler.P", "targets": targets, "at": AT}
    found = {
        measure: designs(four([{**goal, "measure": measure}]))[0][0]
        for measure in ("minimax", "least-squares")
    }
    errors = {
        measure: judged(linkage(design["parameters"]), AT, targets).errors
        for measure, design in found.items()
    }
    assert found["minimax"]["objective"] == pytest.approx(errors["minimax"].max(), rel=1e-6)
    squares = {measure: float(np.sum(e**2)) for measure, e in errors.items()}
    assert found["least-squares"]["objective"] == pytest.approx(squares["least-squares"], rel=1e-6)
    assert errors["minimax"].max() < errors["least-squares"].max() * (1 - 1e-3)
    assert squares["least-squares"] < squares["minimax"] * (1 - 1e-3)


TURN_OF_FOUR = """
[tasks.turn]
kind = "sweep"
driver = { coordinate = "A0.angle", from_deg = 0, to_deg = 360, speed = 1.0 }
poses = 181
measures = ["transmission"]
"""


def least_angle(r1, r2, r3, r4):
    """Return the least transmission angle over a turn: at the shortest and the longest diagonal."""
    cosines = [np.abs(r3**2 + r4**2 - (r1 + s * r2) ** 2) / (2 * r3 * r4) for s in (1, -1)]
    return np.arccos(np.clip(np.maximum(*cosines), 0, 1))


def test_transmission_angle_alone():
    goal = {"kind": "maximise", "of": "turn/joints/B/transmission_angle"}
    free = {"r2": [1.0, 2.0], "r3": [3.0, 4.0], "r4": [2.5, 3.5]}
    best = designs(four([goal], free=free, tasks=TURN_OF_FOUR))[0][0]
    p = best["parameters"]
    r2, r3, r4 = np.meshgrid(*[np.linspace(*free[n], 41) for n in ("r2", "r3", "r4")])
    assert best["objective"] == pytest.approx(least_angle(4.0, p["r2"], p["r3"], p["r4"]), abs=1e-7)
    assert best["objective"] >= least_angle(4.0, r2, r3, r4).max() - 1e-9


def test_path_and_transmission_angle_weighed():
    targets = places(PLANT, AT)
    weight = 0.1
    goals = [
        {"kind": "path", "point": "coupler.P", "targets": targets, "at": AT},
        {"kind": "maximise", "of": "turn/joints/B/transmission_angle", "weight": weight},
    ]
    best = designs(four(goals, tasks=TURN_OF_FOUR))[0][0]
    p = best["parameters"]
    f = judged(linkage(p), AT, targets).f
    angle = least_angle(p["r1"], p["r2"], p["r3"], p["r4"])
    assert best["goals"] == pytest.approx([f, angle], rel=1e-6)
    assert best["objective"] == pytest.approx(f - weight * angle, rel=1e-6)
    # better than the plant, which is exact but has no better an angle
    own = least_angle(PLANT["r1"], PLANT["r2"], PLANT["r3"], PLANT["r4"])
    assert best["objective"] < -weight * own - 1e-4


def test_speed_of_the_rocker_stays_below_a_limit():
    # the rocker's rate for one radian a second of the crank, by the closed form of the four-bar
    def fastest(p):
        theta = np.linspace(0, TURN, 20_001)
        psi = np.unwrap(linkage(p).moved(theta, (1,))[0]["output"])
        return float(np.abs(np.gradient(psi, theta)).max())

    targets = places(PLANT, AT)
    most = 0.95 * fastest(PLANT)
    goal = {"kind": "path", "point": "coupler.P", "targets": targets, "at": AT}
    limit = {
        "kind": "limit",
        "of": "turn/bodies/rocker/angular_velocity",
        "max": most,
        "min": -most,
    }
    best = designs(four([goal], [TURNED, limit], tasks=TURN_OF_FOUR))[0][0]
    p = best["parameters"]
    assert fastest(p) <= most * (1 + 4e-3)
    assert best["objective"] > 1e-9
    assert judged(linkage(p), AT, targets).f == pytest.approx(best["objective"], rel=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_path_of_a_mechanism_that_a_slide_drives(scale):
    plant = {name: value * scale for name, value in SLIDING.items()}
    B, C = slid(plant, np.radians([20, 45, 70, 95, 120, 145]))
    z = B + complex(plant["px"], plant["py"]) * (C - B) / plant["l"]
    targets = np.stack([z.real, z.imag], axis=1)
    bounds = around(plant, least=0.2 * scale)
    goal = {"kind": "path", "point": "rod.P", "targets": targets, "timing": "free"}
    best = designs(problem(BARE, begun(plant, bounds), "guide.slide", [goal], bounds))[0][0]
    p = best["parameters"]
    assert best["objective"] <= EXACT * size2(targets)
    # the crank's pin at these slides, on the same side
    C = np.array(best["at"]) + 1j * p["e"]
    B = rrr(0j * C, C, p["r"], p["l"], -1)[0], rrr(0j * C, C, p["r"], p["l"], 1)[0]
    miss = [np.abs(b + complex(p["px"], p["py"]) * (C - b) / p["l"] - z).max() for b in B]
    assert min(miss) <= 1e-7 * scale
    steps = np.diff(best["at"])
    assert (steps < 0).all() or (steps > 0).all()
