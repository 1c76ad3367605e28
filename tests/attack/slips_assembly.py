"""Slips of the pen in what is assembled and told, each seen by a truth of its own."""

from __future__ import annotations

import math
from dataclasses import replace

import mechdae as md
from mechdae.describe.assumed import about_blocks
from mechdae.errors import AssemblyError
from mechdae.motion.kinematics.prepared import SHAPES
from tests.attack.slotted_curves import CLOSE, examine
from tests.shared.booms import reach_missed, slide_missed
from tests.shared.mechanisms import doubled
from tests.shared.noisy import bound_missed, parallelogram, value_named
from tests.shared.planting import Slip

STOPS = "kinematics/test_stops.py::"


def noise() -> float:
    """Poses of dimensions that hardly agree are those of least squares, within their bounds."""
    SHAPES.clear()  # kernels of a slip are no one else's
    try:
        return max(bound_missed(seed) for seed in range(3))
    finally:
        SHAPES.clear()


def stopped() -> float:
    """A rocker's limit of 110 deg, by the law of cosines: where the crank turns to and fro."""
    SHAPES.clear()
    problem = md.load("four-bar-crank-rocker")
    pin, high = problem.mechanism.joints["D"], math.radians(110)
    pin = md.Revolute("D", pin.first, pin.second, limits=(math.radians(50), high))
    joints = problem.mechanism.joints.with_("D", pin)
    problem = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    x, y = 0.1 + 0.08 * math.cos(high), 0.08 * math.sin(high)
    far, way = math.hypot(x, y), math.atan2(y, x)
    inner = math.acos((0.04**2 + far**2 - 0.12**2) / (2 * 0.04 * far))
    driver, law = "crank.angle", md.Driver("crank.angle", law="2*t", times=(0.0, 1.0, 2.0, 3.0))
    ends = md.solve(problem, md.Sweep(md.Driver(driver, range="assembled"), poses=5)).summary
    around = md.Sweep(md.Driver(driver, from_=0.0, to=2 * math.pi), poses=9)
    alone = md.Sweep(md.Driver(driver, at=(math.pi,)))
    tasks = (around, md.Sweep(law), alone)
    status = [md.solve(problem, task).status.tolist() for task in tasks]
    SHAPES.clear()
    turning, timed, pose = [[word == "ok" for word in words] for words in status]
    seen = turning == [True] * 4 + [False] * 3 + [True] * 2 and timed == [True] * 2 + [False] * 2
    if not seen or pose != [False]:
        return math.inf
    found = [math.inf if end is None else end for end in ends.get("limits", [None] * 2)]
    return max(abs(a - b) for a, b in zip(found, (way - inner, way + inner), strict=True)) / 1e-9


def tolerance_told() -> float:
    """The tolerance that a message names is enough, and no more than twenty times what is open."""
    mechanism, at = parallelogram(1e-7, 3), md.Sweep(md.Driver("c1.angle", at=[1.0]))
    try:
        md.solve(mechanism, at)
    except AssemblyError as error:
        enough = value_named(error)
    try:
        result = md.solve(mechanism.with_values({"closure_tolerance": enough}), at)
    except AssemblyError:
        return math.inf
    gap = result.summary["closure"]["length"]
    return enough / gap / 40 if list(result.status) == ["ok"] else math.inf


def slides() -> float:
    """Booms begin where their cylinder is asked for, from sketches out of reach."""
    return max(slide_missed(seed) for seed in range(3))


def reach() -> float:
    """Lengths that would reach are told."""
    return max(reach_missed(seed) for seed in range(4))


def blocks() -> float:
    """Of a guide's blocks the fixed one is told."""
    ends = [("ground.O", "slider.C"), ("slider.C", "ground.O")]
    found = []
    for own in ends:
        mechanism = md.Mechanism(
            ground=md.Ground({"O": (0, 0)}),
            bodies=[md.Body("slider", {"C": (0, 0)}, mass=1.0)],
            joints=[md.Prismatic("guide", *own, friction=0.1, contact_length=0.1)],
        )
        found.append(len(about_blocks(mechanism, ["guide"])))
    return 0.0 if found == [0, 1] else math.inf


def slotted() -> float:
    """Lengths of paths that turn back behind a slot."""
    return max(max((examine(seed) or {"": 0.0}).values()) for seed in range(2)) / CLOSE


def recorded() -> float:
    """A crank's turn in nine poses is recorded in steps whose chords are half a pixel off."""
    problem = doubled(md.load("four-bar-crank-rocker"), "coupler")
    driver = md.Driver("crank.angle", from_=0.0, to=2 * math.pi)
    data = md.page(problem.with_task("turn", md.Sweep(driver, poses=9)), "turn").data
    step = 2 * math.pi / (len(data["driver"]["values"]) - 1)
    return (1 - math.cos(step / 2)) * 300 / 0.5


SUITE = "assembly/test_closure_tolerance.py::"
ROUGH = "assembly/test_rough_sketches.py::"
SLIPS = [
    Slip(
        "kernels.graphs.pose",
        "SX(0)) / CLOSURE",
        "SX(0)) / CLOSURE**2",
        noise,
        SUITE + "test_poses_are_those_of_least_squares_within_their_bounds",
    ),
    Slip(
        "kernels.graphs.bounds",
        "rho + self.tolerated / self.scale if graph.redundant else rho",
        "rho",
        noise,
        SUITE + "test_poses_are_those_of_least_squares_within_their_bounds",
    ),
    Slip(
        "motion.cases.superfluous.closing",
        "values = np.abs(self.residuals(x, u, p))",
        "values = 0.1 * np.abs(self.residuals(x, u, p))",
        noise,
        SUITE + "test_poses_are_those_of_least_squares_within_their_bounds",
    ),
    Slip(
        "motion.assembly.closure",
        "math.log10(2 * whole)",
        "math.log10(whole / 20)",
        tolerance_told,
        SUITE + "test_the_value_that_is_named_does",
    ),
    Slip(
        "motion.cases.superfluous.closing",
        "whole=float(np.linalg.norm(F / r)) * constants.scale",
        "whole=float(np.linalg.norm(F / r)) * constants.scale * 1e3",
        tolerance_told,
        SUITE + "test_a_motion_that_is_locked_names_a_value_that_does",
    ),
    Slip(
        "motion.assembly.not_assembled",
        "np.isfinite(plan.sketch), not any(",
        "np.isfinite(plan.sketch), any(",
        slides,
        ROUGH + "test_a_driven_slide_may_be_sketched_out_of_reach",
    ),
    Slip(
        "motion.assembly.not_assembled",
        "            return row, found",
        "            return u, found",
        slides,
        ROUGH + "test_a_driven_slide_may_be_sketched_out_of_reach",
    ),
    Slip(
        "motion.assembly.least_gap",
        "at least {apart - b:.6g} m",
        "at least {apart - a:.6g} m",
        reach,
        ROUGH + "test_lengths_that_would_reach",
    ),
    Slip(
        "motion.assembly.least_gap",
        "most, least = min(a, b) + apart, max(a, b) - apart",
        "most, least = max(a, b) + apart, max(a, b) - apart",
        reach,
        ROUGH + "test_lengths_that_would_reach",
    ),
    Slip(
        "motion.assembly.least_gap",
        "long = int(b > a)",
        "long = int(a > b)",
        reach,
        ROUGH + "test_lengths_that_would_reach",
    ),
    Slip(
        "describe.assumed",
        "second_body == GROUND",
        "first_body == GROUND",
        blocks,
        "forces/test_assumed.py::test_a_block_that_is_fixed_is_told",
    ),
    Slip(
        "motion.measures.curve",
        "integrate(integrand, charts, size)",
        "integrate(integrand, charts[:1], size)",
        slotted,
        "measures/test_slotted.py::test_lengths_behind_a_slot",
    ),
    Slip(
        "parts.page.document",
        "result = smooth(result, _ways)",
        "result = smooth(result, lambda own: [])",
        recorded,
        "page/test_recorded.py::test_few_poses_of_a_recorded_sweep_are_sampled_on_their_way",
    ),
    Slip(
        "parts.page.document",
        "np.linspace(0, count - 1, min(count, most))",
        "np.linspace(0, count - 1, min(count, 9))",
        recorded,
        "page/test_recorded.py::test_few_poses_of_a_recorded_sweep_are_sampled_on_their_way",
    ),
    Slip(
        "motion.cases.stops.stops",
        "half + room), sentence",
        "half + 1 + room), sentence",
        stopped,
        f"{STOPS}test_one_pose_says_which_limit",
    ),
    Slip(
        "motion.cases.stops.stops",
        "place - (turn or 0.0)",
        "place",
        stopped,
        f"{STOPS}test_the_assembled_arc_ends_at_stops",
    ),
    Slip(
        "motion.cases.stops.stops",
        "run.stopped | behind",
        "run.stopped",
        stopped,
        f"{STOPS}test_poses_behind_a_stop_are_not_reached",
    ),
]
