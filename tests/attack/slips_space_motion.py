"""Slips planted in friction along motions in space, vectors beside bodies, teeth, stiff steps."""

from __future__ import annotations

from math import atan, cos, sin, sqrt

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.numerics import radau
from tests.shared.gliding import RHO, F, G, J, M, R, coast, on_ball, sleeve, turning
from tests.shared.planting import Slip
from tests.shared.vectors_beside_bodies import gaps, hanging

GLIDES = "dynamics/test_gliding_friction.py::"
STOPS = f"{GLIDES}test_a_sleeve_of_one_inertia_stops_on_a_straight_line"
STARTS = f"{GLIDES}test_a_sleeve_starts_where_force_and_moment_together_reach_the_limit"
ROUND = f"{GLIDES}test_a_round_body_about_its_ball_stops_in_time"
LEFT = f"{GLIDES}test_a_spin_about_the_load_is_left_and_said"
ROUGH = f"{GLIDES}test_a_body_on_a_rough_ball_against_newton_and_euler"
NEWTON = "forces/test_vectors_beside_bodies.py::test_each_body_obeys_newton_and_euler"
VECTORS = "forces/test_spatial_vector_forces.py::"
LINE = f"{VECTORS}test_a_slide_of_vectors_comes_to_rest"
TRAINS = "dynamics/test_spatial_motion_gears.py::"
STIFF = "dynamics/test_motion_stiff.py::test_a_heavily_damped_spring"
BEARING = (
    "dynamics/test_spatial_motion_friction.py::"
    "test_a_pendulum_about_a_skew_axis_turns_back_where_free_bodies_say"
)


def stops() -> float:
    """A sleeve with J = m r^2: time, way and turn until it rests."""
    speed, share = 1.3, 0.8
    along, around = speed * sqrt(1 - share**2), speed * share
    result = coast(sleeve(M * R**2), along, around / R, tolerance=1e-11)
    if result.fault or not result.events:
        return np.inf
    a = F * G / sqrt(1 + (F * share) ** 2)
    way, own = speed**2 / (2 * a), result.joints["C"]
    off = [result.events[-1].time * a / speed - 1, own.slide[-1] / (way * along / speed) - 1,
           R * own.angle[-1] / (way * share) - 1, 100 * result.checks["energy"]]  # fmt: skip
    return max(map(abs, off)) / 1e-8


def starts() -> float:
    """A sleeve at rest: F^2 + (1 + f^2) (M/r)^2 = (f N)^2."""
    push, moment = 3.0, 0.12
    loads = (
        md.Force("push", "sleeve.O", [f"{push}*t", 0, 0]),
        md.Torque("turn", "sleeve", [f"{moment}*t", 0, 0]),
    )
    start = F * M * G / sqrt(push**2 + (1 + F**2) * (moment / R) ** 2)
    result = coast(sleeve(J, *loads), 0.0, 0.0, until=start + 0.02)
    own = result.joints["C"]
    if result.fault or not result.events or not own.slide[-1] > 0 or not own.angle[-1] > 0:
        return np.inf
    return abs(result.events[-1].time / start - 1) / 1e-8


def round_body() -> float:
    """J w' = -rho m g: time of rest, and the energy."""
    inertia = 0.05
    task = turning(np.array([3.0, 4.0, 0.0]), until=2.0, tolerance=1e-12)
    result = md.solve(on_ball((0, 0, 0), (inertia,) * 3), task)
    if result.fault or not result.events:
        return np.inf
    off = result.events[-1].time * RHO * M * G / inertia / 5.0 - 1
    return max(abs(off), result.checks["energy"]) / 1e-8


def spinning() -> float:
    """The spin about the load stays, the rest goes, and then the motion ends."""
    inertia = 0.05
    task = turning(np.array([3.0, 0.0, 2.0]), until=2.0)
    result = md.solve(on_ball((0, 0, 0), (inertia,) * 3), task)
    if result.fault is None or "F6" not in result.fault:
        return np.inf
    when = 3.0 * inertia / (RHO * M * G)
    late = abs(result.events[-1].time / when - 1) / 2e-3
    return max(late, abs(result.bodies["rod"].angular_velocity[-2, 2] - 2.0) / 1e-8)


def off_newton(data: dict, task: str) -> float:
    problem = from_dict(data)
    result = md.solve(problem, task)
    if result.fault:
        return np.inf
    worst = max(max(gaps(result, problem.mechanism, k).values()) for k in range(3))
    return max(worst, *result.checks.values()) / 1e-10


def carried_vectors() -> float:
    return off_newton(hanging(), "press")


def carried_in_motion() -> float:
    return off_newton(hanging(), "fall")


def rough_line() -> float:
    """A point that slides up a rough line: a = g (sin + f cos)."""
    slope, f = 0.3, 0.5
    data = {
        "schema": 1,
        "title": "a rough line",
        "dimension": 3,
        "gravity": [0, -G, 0],
        "vectors": {"line": {"elevation": slope, "azimuth": 0.4, "friction": f}, "tie": {}},
        "loops": {"closure": ["line", "-tie"]},
        "nodes": {"P": {"at": "line.head"}},
        "bodies": {"P": {"mass": 2.0}},
        "sketch": {"line.length": 1.0, "tie.length": 1, "tie.elevation": slope, "tie.azimuth": 0.4},
        "tasks": {"go": {"kind": "motion", "start": {"line.length": 1.0}, "until": 2.0,
                         "start_speed": {"line.length": 3.0}}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "go")
    if result.fault or not result.events:
        return np.inf
    return abs(result.events[-1].time * G * (sin(slope) + f * cos(slope)) / 3.0 - 1) / 1e-9


def conical() -> float:
    """A mass on a vector of two angles, once round: w^2 = g / (l cos(angle to the vertical))."""
    length, angle = 0.8, 0.5
    w = sqrt(G / (length * cos(angle)))
    start = {"string.elevation": angle - np.pi / 2, "string.azimuth": 0.0}
    data = {
        "schema": 1,
        "title": "a mass on a string",
        "dimension": 3,
        "gravity": [0, -G, 0],
        "vectors": {"string": {"length": length}, "tie": {}},
        "loops": {"closure": ["string", "-tie"]},
        "nodes": {"P": {"at": "string.head"}},
        "bodies": {"P": {"mass": 2.0}},
        "sketch": {**start, "tie.length": length, "tie.elevation": angle - np.pi / 2,
                   "tie.azimuth": 0.0},
        "tasks": {"go": {"kind": "motion", "start": start, "at": [0.5], "tolerance": 1e-11,
                         "start_speed": {"string.elevation": 0, "string.azimuth": w}}},
    }  # fmt: skip
    result = md.solve(from_dict(data), "go")
    if result.fault:
        return np.inf
    s = length * sin(angle)
    wanted = [s * cos(w / 2), -length * cos(angle), s * sin(w / 2)]
    return float(np.abs(result.points["P.P"].position[-1] - wanted).max()) / 1e-8


def bearing() -> float:
    """A wheel on a level bearing whose weight and overhang load two planes: J w' = -M."""
    f, r, b, c, inertia, w = 0.2, 0.02, 0.1, 0.15, 0.05, 6.0
    keys = {"friction": f, "pin_radius": r, "contact_length": b}
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[
            md.Body("wheel", {"O": (0, 0, 0)}, mass=M, center=(c, 0, 0), inertia=(inertia,) * 3)
        ],
        joints=[md.SpatialRevolute("O", "ground.O", "wheel.O", axis=(1, 0, 0), **keys)],
        gravity=(0, 0, -G),
    )
    task = md.Motion(start={"O.angle": 0}, start_speed={"O.angle": w}, until=9.0, tolerance=1e-11)
    result = md.solve(mechanism, task)
    if result.fault or not result.events:
        return np.inf
    planes = abs(0.5 + c / b) + abs(0.5 - c / b)
    moment = r * sin(atan(f)) * M * G * planes
    return abs(result.events[-1].time * moment / inertia / w - 1) / 1e-9


def braked_wheels() -> float:
    """Two wheels in mesh that run down: the loss of teeth is what is left of the energy."""
    turn = {"axis": [0, 0, 1]}
    mesh = {"teeth": (20, 40), "mesh": "external", "mesh_loss": 0.1, "pressure_angle": 0.35}
    one, two, brake, w = 0.02, 0.05, 0.6, 30.0
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "B": [0.09, 0, 0]}),
        bodies=[
            md.Body("one", {"A": [0, 0, 0]}, mass=1.0, inertia=(one, one, one)),
            md.Body("two", {"B": [0, 0, 0]}, mass=1.0, inertia=(two, two, two)),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "one.A", **turn),
            md.SpatialRevolute("B", "ground.B", "two.B", **turn),
            md.SpatialGear("mesh", "one.A", "two.B", **mesh),
        ],
        loads=[md.Torque("brake", "two", [0, 0, brake])],
        sketch={"A": 0},
    )
    task = md.Motion(start={"A.angle": 0}, start_speed={"A.angle": w}, at=(0.0, 0.3))
    result = md.solve(mechanism, task)
    # the second wheel, braked, is driven by the first or drives it: T is what passes the teeth
    found = {}
    for first_drives in (True, False):
        passed = 0.9 if first_drives else 1 / 0.9
        # one w1' = -X, two w2' = passed X r2/r1 - brake, w2 = w1 / 2 (both counted forwards)
        X = brake / (2 * passed + two / (2 * one))
        found[first_drives] = X
    X = found[False] if found[True] < 0 else found[True]
    wanted = w - X / one * 0.3
    return abs(result.joints["A"].angle_velocity[-1] - wanted) / abs(w) / 1e-8


def relaxing() -> float:
    """y' = -k (y - cos t) - sin t from beside its slow solution cos t, k = 1e4."""
    k, y, last, count = 1e4, np.array([1.1]), np.array([np.nan]), 0

    def rates(t: np.ndarray, x: np.ndarray) -> np.ndarray:
        return -k * (x - np.cos(t)[:, None]) - np.sin(t)[:, None]

    try:
        for step in radau.steps(rates, lambda t, x: np.array([[-k]]), 0.0, y, 2.0, 1e-8, 1e-4):
            last, count = step.y, count + step.rejected + 1
            if count > 400:
                return np.inf
    except (ArithmeticError, np.linalg.LinAlgError):
        return np.inf
    return max(abs(float(last[0]) - cos(2.0)) / 1e-6, count / 120)


SLIPS = [
    Slip("equations.forces.spatial_friction", "(1.0, 1 + f * f)", "(1.0, 1.0)", starts, STARTS),
    Slip("equations.forces.spatial_friction", "f / ca.sqrt(1 + (f * across) ** 2)",
         "f / ca.sqrt(1 + f**2)", stops, STOPS),
    Slip("equations.forces.spatial_friction", "moment = -size * across * r * pair.a",
         "moment = -size * across * pair.a", stops, STOPS),
    Slip("equations.forces.spatial_friction", "rho * speed, slip=slip", "rho, slip=slip",
         round_body,
         ROUND),
    Slip("equations.forces.spatial_friction", "across = ca.horzcat(SX.eye(3) - w @ w.T, SX(3, 3))",
         "across = ca.horzcat(SX.eye(3), SX(3, 3))", spinning, LEFT),
    Slip("equations.forces.spatial_friction", "times(rho, column)", "times(-rho, column)", spinning,
         ROUGH),
    Slip("equations.forces.spatial_friction", "ca.horzcat(SX.eye(3) - u @ u.T, SX(3, 3))",
         "ca.horzcat(SX.eye(3), SX(3, 3))", rough_line, LINE),
    Slip("equations.forces.spatial_friction", "((1.0, 1 / length), (1.0, -1 / length))",
         "((1.0, 1 / length), (1.0, 1 / length))", bearing, BEARING),
    Slip("equations.forces.spatial_friction", "-slip.sign * size * self.a",
         "slip.sign * size * self.a",
         bearing, BEARING),
    Slip("dynamics.watchers.sliding", "self.weights[group] * held[..., group] ** 2",
         "held[..., group] ** 2", starts, STARTS),
    Slip("dynamics.watchers.sticking", "- SHARPEST * (sizes", "- 0.5 * (sizes", spinning,
         LEFT),
    Slip("equations.tree.solid", "at, turning = model.point(near), SX.zeros(3)",
         "turning = SX.zeros(3)", carried_vectors, NEWTON),
    Slip("equations.tree.solid", "moment + ca.cross(place - model.frame(body).r, force)",
         "moment - ca.cross(place - model.frame(body).r, force)", carried_vectors, NEWTON),
    Slip("equations.tree.screws", "SX(3, 1), s.velocity(place), place)",
         "SX(3, 1), s.shift, place)",
         carried_vectors, NEWTON),
    Slip("equations.tree.screws", "ca.jtimes(way, q, rates) * model.velocity[j]",
         "0 * model.velocity[j]", conical,
         f"{VECTORS}test_a_spherical_pendulum_of_one_vector_moves_in_a_circle"),
    Slip("equations.tree.screws", "above.acceleration_at(arm), SX", "above.acceleration, SX",
         carried_vectors, NEWTON),
    Slip("equations.tree.screws", "v, a, zero = above.velocity_at(arm)",
         "v, a, zero = above.velocity",
         carried_in_motion, NEWTON),
    Slip("forces.teeth.spatial_mesh", "self._rolling + loss * first",
         "self._rolling - loss * first", braked_wheels,
         f"{TRAINS}test_a_rough_planetary_train_stops_where_that_of_the_plane_does"),
    Slip("forces.teeth.spatial_mesh", "self._couple(-sign * arm", "self._couple(sign * arm",
         braked_wheels, f"{TRAINS}test_a_rough_planetary_train_stops_where_that_of_the_plane_does"),
    Slip("numerics.radau", "weak = EMBEDDED @ Z / h", "weak = EMBEDDED @ Z", relaxing, STIFF),
    Slip("numerics.radau", "y + Z[2] if settled is None", "y + Z[1] if settled is None", relaxing,
         STIFF),
]  # fmt: skip
