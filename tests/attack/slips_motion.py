"""Slips planted in motion, equilibria and small motions, seen on mechanisms in closed form."""

from __future__ import annotations

import re
from math import log, pi, sin, sqrt

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.attack.held_forces import CLOSE, worst
from tests.shared import begun_cases
from tests.shared.block import X0, C, K, M, block, course
from tests.shared.five_bars import random_rows
from tests.shared.planting import Slip

TILT, G = 0.3, 9.81
D, W = C / (2 * M), sqrt(K / M - (C / (2 * M)) ** 2)
"""Decay and frequency of the block."""
REST = -M * G * sin(TILT) / K
TIMES = [0.1 * k for k in range(31)]


def apart(found: object, wanted: object, allowed: float = 1e-8) -> float:
    """Return the largest difference over what is allowed, infinite for what is no number."""
    gap = float(np.max(np.abs(np.asarray(found, float) - np.asarray(wanted, float))))
    return gap / allowed if np.isfinite(gap) else np.inf


def moved(**keys: object) -> md.Result:
    task = {"kind": "motion", "start": {"guide": "x0"}, "tolerance": 1e-11, "at": TIMES, **keys}
    return md.solve(block(go=task), "go")


def speed(t: object) -> object:
    e = np.exp(-D * np.asarray(t))
    return -(X0 - REST) * e * (D * D + W * W) / W * np.sin(W * np.asarray(t))


def slowly() -> float:
    """What holds mechanisms whose drivers have no speed, with masses and dampers."""
    return worst("ram", 2) / CLOSE


def too_short() -> float:
    """The gap of a bar of 0.1 between two points 1 apart, over what rounding of four digits is."""
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "B": (1.0, 0)}),
        bodies=[md.Body("rod", {"A": (0, 0), "C": (0, 0)})],
        joints=[
            md.Revolute("A", "ground.A", "rod.A"),
            md.Distance("bar", "ground.B", "rod.C", length=0.1),
        ],
        sketch={"rod": 0.0},
    )
    task = md.Sweep(md.Driver("rod.angle", at=[0.0]))
    try:
        text = str(md.solve(mechanism, task).fault)
    except md.MechdaeError as error:
        text = error.what
    found = re.search(r"stays open by ([\d.e+-]+) m", text)
    return np.inf if found is None else abs(float(found[1]) - 0.9) / 1e-3


def told() -> float:
    """Revolutions taken for newtons are refused, and what has no gravity says so."""
    data = {
        "schema": 1, "parameters": {"F_rpm": 1.0},
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"arm": {"points": {"O": [0, 0], "K": [1, 0]}, "mass": 1}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "arm.O"]}},
        "loads": {"push": {"kind": "force", "point": "arm.K", "value": ["2*F", 0]}},
        "tasks": {"hold": {"kind": "reactions", "driver": {"coordinate": "arm.angle", "at": [0]}}},
    }  # fmt: skip
    try:
        from_dict(data)
        return np.inf
    except md.InputError:
        data["parameters"] = {"F": 1.0}
    found = md.solve(from_dict(data), "hold").summary["assumptions"]
    return 0.0 if any("without weight" in own for own in found) else np.inf


def along() -> float:
    """Places, speeds, energies and works of the block at times inside of steps."""
    found = moved()
    t, x = np.array(TIMES), found.outputs["x"].value
    wanted, v = course(np.array(TIMES), M, K, C, X0), speed(np.array(TIMES))
    energy = M * v * v / 2 + K * wanted**2 / 2 + M * G * sin(TILT) * wanted
    return max(
        apart(found.time, t), apart(x, wanted), apart(found.outputs["x"].rate, v, 1e-7),
        apart(found.scalars["energy"], energy, 1e-7), 0.0 if found.fault is None else np.inf,
    )  # fmt: skip


def stiffly() -> float:
    return apart(
        moved(method="bdf", tolerance=1e-9).outputs["x"].value,
        course(np.array(TIMES), M, K, C, X0), 1e-6,
    )  # fmt: skip


def crossed() -> float:
    """The block goes upwards through a place: times by bisection of the closed form."""
    level = 0.05
    event = {"coordinate": "guide.slide", "crosses": level, "direction": "up"}
    events = [e for e in moved(events=[event]).events if e["kind"] == "crossing"]
    grid = np.linspace(0, 3, 30001)
    x = course(grid, M, K, C, X0) - level
    rows = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    wanted = grid[rows] - x[rows] * 1e-4 / (x[rows + 1] - x[rows])
    if [e["direction"] for e in events] != ["up"] * len(wanted):
        return np.inf
    return apart([e["time"] for e in events], wanted, 1e-6)


def rest() -> float:
    found = md.solve(block(), "rest")
    own, state = found.summary["modes"][0], found.outputs["x"].value[0]
    return max(
        apart(state, REST), apart(own["eigenvalue"], [-D, W]),
        apart(own["frequency"], W / (2 * pi)), apart(own["damping"], C / (2 * sqrt(K * M))),
        apart(own["natural_frequency"], sqrt(K / M) / (2 * pi)),
        apart(found.summary["settling_time"], log(50) / D),
        apart(found.data["linear"]["A"], [[0, 1], [-K / M, -C / M]]),
    )  # fmt: skip


SLIDE, MU = 2.0, 0.3


def rubbed() -> float:
    """A block that is thrown along a rough level guide sticks after v^2 / (2 mu g)."""
    problem = from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"block": {"points": {"P": [0, 0]}, "mass": 2.0}},
            "joints": {
                "guide": {"kind": "prismatic", "between": ["ground.O", "block.P"], "friction": MU}
            },
            "tasks": {
                "m": {"kind": "motion", "start": {"guide": 0.0}, "start_speed": {"guide": SLIDE},
                      "until": 1.0, "poses": 11, "tolerance": 1e-11}
            },
        }
    )  # fmt: skip
    found = md.solve(problem, "m")
    events = [e for e in found.events if e["kind"] == "stick"]
    if len(events) != 1:
        return np.inf
    t = np.minimum(found.time, SLIDE / (MU * G))
    return max(
        apart(events[0]["time"], SLIDE / (MU * G)),
        apart(found.joints["guide"].slide, SLIDE * t - MU * G * t * t / 2),
        apart(found.joints["guide"].reaction[0, :2], [-MU * 2 * G, 2 * G]),
        apart(found.work["friction.guide"][-1], -(SLIDE**2), 1e-7),
    )


def held() -> float:
    """A block with a load that grows slips when it is as large as friction allows."""
    problem = from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"block": {"points": {"P": [0, 0]}, "mass": 2.0}},
            "joints": {
                "guide": {"kind": "prismatic", "between": ["ground.O", "block.P"], "friction": MU}
            },
            "loads": {"f": {"kind": "force", "point": "block.P", "value": ["10*t", 0]}},
            "tasks": {"m": {"kind": "motion", "start": {"guide": 0.0}, "until": 1.0, "poses": 6,
                            "tolerance": 1e-11}},
        }
    )  # fmt: skip
    found = md.solve(problem, "m")
    events = [e for e in found.events if e["kind"] == "slip"]
    if len(events) != 1:
        return np.inf
    at = MU * 2 * G / 10
    over = np.maximum(found.time - at, 0)
    return max(
        apart(events[0]["time"], at, 1e-7),
        apart(found.joints["guide"].slide, 10 / 2.0 * over**3 / 6, 1e-7),
    )


def released() -> float:
    """A bar on a pin let go when it is level: the pin bears what its fall leaves of the weight."""
    m, arm, own = 3.0, 0.5, 0.2
    problem = from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"arm": {"points": {"O": [0, 0]}, "mass": m, "center": [arm, 0],
                               "inertia": own}},
            "joints": {"O": {"kind": "revolute", "between": ["ground.O", "arm.O"]}},
            "tasks": {"m": {"kind": "motion", "start": {"arm": 0.0}, "at": [0.0, 0.3],
                            "tolerance": 1e-11}},
        }
    )  # fmt: skip
    found = md.solve(problem, "m")
    whole, body = own + m * arm * arm, found.bodies["arm"]
    speed = np.sqrt(-2 * m * G * arm * np.sin(body.angle) / whole)
    return max(
        apart(found.joints["O"].reaction[0, :2], [0, m * G * (1 - m * arm * arm / whole)]),
        apart(np.abs(body.angular_velocity), speed), apart(found.scalars["energy"], 0, 1e-7),
    )  # fmt: skip


def turned() -> float:
    """A pendulum moved by a law: effort, and the force in its pin."""
    m, arm = 3.0, 0.5
    problem = from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"arm": {"points": {"O": [0, 0]}, "mass": m, "center": [arm, 0],
                               "inertia": 0.2}},
            "joints": {"O": {"kind": "revolute", "between": ["ground.O", "arm.O"]}},
            "tasks": {
                "m": {"kind": "motion", "drivers": [{"coordinate": "arm.angle", "law": "t**2"}],
                      "until": 1.0, "poses": 5, "tolerance": 1e-10}
            },
        }
    )  # fmt: skip
    found = md.solve(problem, "m")
    t = found.time
    effort = (0.2 + m * arm * arm) * 2 + m * G * arm * np.cos(t**2)
    along, across = -m * arm * (2 * t) ** 2, m * arm * 2 + 0 * t
    c, s = np.cos(t**2), np.sin(t**2)
    force = np.stack([along * c - across * s, along * s + across * c + m * G], axis=1)
    return max(
        apart(found.efforts["arm.angle"], effort), apart(found.joints["O"].reaction[:, :2], force),
    )  # fmt: skip


HOLDS = "forces/test_quasi_static.py::test_what_holds_a_mechanism_is_virtual_work"
SUITE = "dynamics/"


def rows_of_several_drivers() -> float:
    """Poses by the values of two motors are those of circles, without a limit on their way."""
    rows = random_rows(400)
    return max(rows.off / 1e-13, float(rows.through), float(rows.refused))


SLIPS = [
    Slip(
        "motion.continuation.legs",
        "good = self.proved(after, test, det, miss, self.sign).all(axis=1)",
        "good, test = np.isfinite(after).all(axis=1), 0 * test",
        rows_of_several_drivers,
        "kinematics/test_tracked_poses.py::test_random_rows_against_circles",
    ),
    Slip(
        "dynamics.integrate",
        "share = (times - starts[place]) / h[place]",
        "share = (times - starts[place]) / h[place - 1]",
        along,
        SUITE + "test_motion.py::test_andrews_between_the_steps",
    ),
    Slip(
        "numerics.roots",
        "if (here < 0) == (f1 < 0):",
        "if (here < 0) != (f1 < 0):",
        crossed,
        SUITE + "test_motion.py::test_events_are_located",
    ),
    Slip(
        "dynamics.watchers.events",
        '("down" if before < 0 else "up")',
        '("up" if before < 0 else "down")',
        crossed,
        SUITE + "test_motion.py::test_an_event_stops_the_motion",
    ),
    Slip(
        "dynamics.watchers.events",
        "expression - crossing.crosses",
        "expression + crossing.crosses",
        crossed,
        "attack/test_slips.py::test_nothing_is_off_without_a_slip",
    ),
    Slip(
        "dynamics.report",
        "energy = kinetic + potential",
        "energy = kinetic - potential",
        along,
        SUITE + "test_motion.py::test_pendulum_keeps_energy_and_length",
    ),
    Slip(
        "dynamics.output_values",
        "found[:, k + 1]",
        "found[:, k]",
        along,
        SUITE + "test_motion.py::test_pendulum_keeps_energy_and_length",
    ),
    Slip(
        "dynamics.output_values",
        "r.push - r.mass @ (r.V @ a)",
        "r.push + r.mass @ (r.V @ a)",
        released,
        SUITE + "test_motion.py::test_reactions_agree_with_those_of_a_sweep",
    ),
    Slip(
        "equations.forces.joint_reactions",
        "times(-multipliers[i], columns[i])",
        "times(multipliers[i], columns[i])",
        turned,
        SUITE + "test_motion.py::test_reactions_agree_with_those_of_a_sweep",
    ),
    Slip(
        "dynamics.rest.small_motions",
        "[-inverse @ K, -inverse @ C]",
        "[-inverse @ K, inverse @ C]",
        rest,
        SUITE + "test_equilibrium.py::test_block_on_a_spring",
    ),
    Slip(
        "dynamics.rest.small_motions",
        "size / (2 * math.pi)",
        "size / math.pi",
        rest,
        SUITE + "test_equilibrium.py::test_block_on_a_spring",
    ),
    Slip(
        "dynamics.rest.small_motions",
        "0.0 - real / size",
        "real / size",
        rest,
        SUITE + "test_equilibrium.py::test_block_on_a_spring",
    ),
    Slip(
        "dynamics.rest.balance",
        "-C * both",
        "C * both",
        rest,
        SUITE + "test_equilibrium.py::test_block_on_a_spring",
    ),
    Slip(
        "dynamics.rest.linear_system",
        "balance[1] @ dv + ",
        "",
        rest,
        SUITE + "test_linear_system.py::test_cart_with_pendulum",
    ),
    Slip(
        "dynamics.bdf",
        "span * np.arange(1, count + 1) / count",
        "span * np.arange(count) / count",
        stiffly,
        SUITE + "test_motion_stiff.py::test_crossings_are_located",
    ),
    Slip(
        "dynamics.bdf",
        "a / (sizes * omega)",
        "a / sizes",
        stiffly,
        SUITE + "test_motion_stiff.py::test_a_stiff_hinge",
    ),
    Slip(
        "dynamics.watchers.sticking",
        "held[:, k] - low[:, k]",
        "held[:, k] + low[:, k]",
        held,
        SUITE + "test_motion_friction.py::test_two_blocks_start_one_after_the_other",
    ),
    Slip(
        "dynamics.watchers.sticking",
        '"slip" if from_rest else "stick"',
        '"stick" if from_rest else "slip"',
        rubbed,
        SUITE + "test_motion_friction.py::test_incline_stops_and_rests_without_creep",
    ),
    Slip(
        "forces.inverse_dynamics",
        'task.direction == "load", task.quasi_static',
        'task.direction == "load", False',
        slowly,
        HOLDS,
    ),
    Slip(
        "equations.forces.loads",
        "SLOW * model.velocity if slow else model.velocity",
        "model.velocity",
        slowly,
        HOLDS,
    ),
    Slip(
        "kernels.graphs.kinetostatics",
        "{} if loads.slow else inertia(self.model, self.bodies)",
        "inertia(self.model, self.bodies)",
        slowly,
        HOLDS,
    ),
    Slip(
        "describe.units",
        "return powers in units",
        "return powers is not units",
        told,
        "describe/test_suffixes.py::test_a_suffix_has_the_unit_of_the_place_it_is_used_in",
    ),
    Slip(
        "describe.assumed",
        "heavy if mechanism.gravity is None else []",
        "[]",
        told,
        "forces/test_assumed.py::test_what_is_not_given_is_said",
    ),
    Slip(
        "motion.assembly.closure",
        "lengths * (share - 1), F)",
        "F, F)",
        too_short,
        "assembly/test_bar_gaps.py::test_bars_of_cranks_and_rockers",
    ),
    Slip(
        "dynamics.space.sketch",
        "bool(columns)",
        "bool(columns and unknown)",
        begun_cases.all_joints_told,
        "dynamics/test_first_poses.py::test_a_motion_whose_joints_are_all_sketched_begins_at_its_driver",
    ),
    Slip(
        "motion.assembly.assembler",
        "mechanism.joints[name].slides",
        "mechanism.joints[name].guide",
        begun_cases.slotted,
        "dynamics/test_first_poses.py::test_modes_that_differ_by_a_slide_are_told_apart",
    ),
]
