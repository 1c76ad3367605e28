"""Slips planted in equations, bounds and forces of spatial mechanisms, seen on random loops."""

from __future__ import annotations

from math import atan, cos, sin, tan

import numpy as np

import mechdae as md
from tests.attack.idle_links import run, tube_with_ball
from tests.attack.spatial_honesty import case, drawn, error_of, random_turn
from tests.shared import begun_cases
from tests.shared.planting import Slip
from tests.shared.reach_cases import worst
from tests.shared.spatial_forces import massive, pose_of

FORCES, SUITE = "forces/test_spatial_", "attack/test_spatial.py"
REACHES = "kernels/test_reaches.py::test_nothing_exceeds_its_bound"
CLOSURE = f"{SUITE}::test_poses_are_where_the_closure_puts_them"
FREE_BODIES = f"{FORCES}reactions.py::test_loops_of_all_pairs_balance_like_free_bodies"
SCREWS = "measures/test_screws.py::"
TEETH, FRICTION = f"{FORCES}teeth.py::", f"{FORCES}friction.py::"


def places(loop: str) -> float:
    """Return how far poses are from the closure in 40 digits, over 1e-9."""
    found = drawn(np.random.default_rng(sum(map(ord, loop))), loop)
    driver = md.Driver(found.driver, at=[0.0, 0.05])
    try:
        result = md.solve(found.mechanism, md.Sweep(driver=driver, derivatives=0))
    except md.MechdaeError:
        return np.inf
    kept = np.flatnonzero(result.status == "ok")
    return max((error_of(found, result, k) for k in kept), default=np.inf) / 1e-9


def cut_hinge() -> float:
    return places("RCUC")


def bar() -> float:
    return places("RSSR")


def ball_on_a_cross() -> float:
    return places("RUSR")


def wheels() -> float:
    return max(places("G-RSSC"), places("k-RSSR"))


def flipped() -> float:
    """All modes of four cylindrical pairs: none has an axis the other way round."""
    found = case(np.random.default_rng(1), "RCCC")
    result = md.solve(found.mechanism, md.Modes(driver=md.Driver("J0.angle", at=[0.0])))
    return max(error_of(found, result, k) for k in range(len(result))) / 1e-9


def reach() -> float:
    """Derivatives of equations over their bounds."""
    return _over("RRSRR")


def plate() -> float:
    return _over("platform")


def eliminated() -> float:
    return _over("RPUC")


def _over(loop: str) -> float:
    first, second, _ = worst(loop, np.random.default_rng(5))
    return max(first, second) - 1e-9


def heavy(loop: str) -> float:
    """Return the difference to free bodies over the largest force, over 1e-10."""
    mechanism = massive(case(np.random.default_rng(11), loop).mechanism, seed=2)
    driver = md.Driver("J0.angle", at=[0.0], speed=2.0, acceleration=1.3)
    result = md.solve(mechanism, md.Reactions(drivers=[driver]))
    reactions, efforts, left, _ = pose_of(result, 0).solve()
    size = max(float(np.abs(own).max()) for own in reactions.values())
    gaps = [np.abs(result.joints[name].reaction[0] - own).max() for name, own in reactions.items()]
    gaps.append(abs(result.efforts["J0.angle"][0] - efforts[0]))
    return max(left, float(max(gaps)) / size) / 1e-10


def transport() -> float:
    """Forces that need the accelerations of what slides on turning bodies."""
    return max(heavy("RSRC"), heavy("RHSC"))


def own_checks() -> float:
    """What the result itself finds, without anything to compare it with."""
    mechanism = massive(case(np.random.default_rng(11), "RSRC").mechanism, seed=2)
    driver = md.Driver("J0.angle", from_=-0.05, to=0.05, speed=2.0)
    result = md.solve(mechanism, md.Reactions(driver=driver, poses=3))
    return max(result.checks.values()) / 1e-9


def tilted() -> float:
    """A bar on a hinge that a load tilts: r sin(atan f) (|N1| + |N2|) of two planes."""
    f, r, b, a, F = 0.1, 0.02, 0.05, 0.3, 70.0
    hinge = {"axis": [0, 0, 1], "friction": f, "pin_radius": r, "contact_length": 2 * b}
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0]}),
        bodies=[md.Body("bar", {"O": [0, 0, 0], "E": [0, 0, a]})],
        joints=[md.SpatialRevolute("O", "ground.O", "bar.O", **hinge)],
        loads=[md.Force("load", "bar.E", [F, 0, 0])],
        sketch={"O": 0},
    )
    driver = md.Driver("O.angle", at=[0.0], speed=1.0)
    effort = md.solve(mechanism, md.Reactions(driver=driver)).efforts["O.angle"][0]
    wanted = r * sin(atan(f)) * F * ((a + b) + (a - b)) / (2 * b)
    return abs(effort - wanted) / wanted / 1e-9


def teeth() -> float:
    """A helical pair: (T tan(alpha)/cos(beta), T, -T tan(beta)) on the second wheel."""
    beta, alpha, T = 0.4, 0.35, 900.0
    turn = {"axis": [0, 0, 1]}
    mesh = {"teeth": (20, 40), "mesh": "external", "helix": beta, "pressure_angle": alpha}
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "B": [0.09, 0, 0]}),
        bodies=[md.Body("one", {"A": [0, 0, 0]}), md.Body("two", {"B": [0, 0, 0]})],
        joints=[
            md.SpatialRevolute("A", "ground.A", "one.A", **turn),
            md.SpatialRevolute("B", "ground.B", "two.B", **turn),
            md.SpatialGear("mesh", "one.A", "two.B", **mesh),
        ],
        loads=[md.Torque("load", "two", [0, 0, 0.06 * T])],
        sketch={"A": 0},
    )
    driver = md.Driver("A.angle", at=[0.0], speed=1.0)
    result = md.solve(mechanism, md.Reactions(driver=driver))
    wanted = np.array([T * tan(alpha) / cos(beta), T, -T * tan(beta)])
    return float(np.abs(result.joints["mesh"].reaction[0, :3] - wanted).max()) / T / 1e-9


def bevel() -> float:
    """Axial and radial forces of a bevel pair whose axes lie anywhere."""
    turn = random_turn(np.random.default_rng(3))
    a1, a2, along = turn.T
    alpha, r1, count = 0.35, 0.02, (20, 40)
    mesh = {"teeth": count, "mesh": "external", "radius": r1, "pressure_angle": alpha}
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": 0.1 * a1, "B": 0.1 * a2}),
        bodies=[md.Body("one", {"A": [0, 0, 0]}), md.Body("two", {"B": [0, 0, 0]})],
        joints=[
            md.SpatialRevolute("A", "ground.A", "one.A", axis=a1),
            md.SpatialRevolute("B", "ground.B", "two.B", axis=a2),
            md.SpatialGear("mesh", "one.A", "two.B", **mesh),
        ],
        loads=[md.Torque("load", "two", 36.0 * a2)],
        sketch={"A": 0},
    )
    try:
        result = md.solve(mechanism, md.Reactions(driver=md.Driver("A.angle", at=[0.0], speed=1)))
    except md.MechdaeError:
        return np.inf
    T, delta = 900.0, atan(2.0)  # of the second wheel: its radius is 0.04
    wanted = tan(alpha) * T * (sin(delta) * a2 - cos(delta) * a1)
    force = result.joints["mesh"].reaction[0, :3]
    across = force - along * (along @ force)
    return float(np.abs(across - wanted).max()) / T / 1e-9


def axes() -> float:
    """Screw axes of a bolt that turns and slides, and of a hinge on a turning arm."""
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0.1, 0, 0)}),
        bodies=[
            md.Body("bolt", {"O": (0.02, 0, 0), "P": (0.07, 0, 0)}),
            md.Body("arm", {"P": (0, 0, 0)}),
        ],
        joints=[
            md.Cylindrical("C", "ground.O", "bolt.O", axis=(0, 0, 1)),
            md.SpatialRevolute("H", "bolt.P", "arm.P", axis=(1, 0, 0)),
        ],
    )
    drivers = [
        md.Driver(name, at=[value], speed=speed)
        for name, value, speed in (("C.angle", 0.4, 2.0), ("C.slide", 0.0, 0.3), ("H.angle", 1, 5))
    ]
    found = md.solve(mechanism, md.Sweep(drivers=drivers, measures=["axodes", "screw-axes"]))
    bolt, pin = found.bodies["bolt"], found.points["arm.P"].position[0]
    hinge, along = (found.centres[f"bolt-arm.{word}"][0] for word in ("point", "direction"))
    spin, speed = found.bodies["arm"].angular_velocity[0], found.points["arm.P"].velocity[0]
    there = speed + np.cross(spin, found.bodies["arm"].axode_fixed_point[0] - pin)
    return max(
        abs(bolt.screw_pitch[0] - 2 * np.pi * 0.15),
        np.abs(bolt.axode_fixed_point[0] - [0.1, 0, 0]).max(),
        np.abs(bolt.axode_moving_point[0] - [0.02, 0, 0]).max(),
        np.abs(np.cross(pin - hinge, along)).max(),
        np.abs(np.cross(there, spin)).max(),
    ) / 1e-9  # fmt: skip


def pressed() -> float:
    """The transmission angle of the rocker of `rssr` at a pose, from the places of its points."""
    driver = md.Driver("A.angle", at=[0.5])
    problem = md.load("rssr")
    found = md.solve(problem.mechanism, md.Sweep(driver=driver, measures=["transmission"]))
    B, C, D = (found.points[name].position[0] for name in ("crank.B", "rocker.C", "rocker.D"))
    way = np.cross([1, 0, 0], C - D)
    sine = abs((C - B) @ way) / np.linalg.norm(C - B) / np.linalg.norm(way)
    return abs(np.sin(found.joints["C"].transmission_angle[0]) - sine) / 1e-9


def loose() -> float:
    """Poses and forces of mechanisms with free rollers, or with a second machine, that are off."""
    words = run(2, 7, ("rollers", "second machine"))
    return float(sum(count for word, count in words.items() if word != "ok"))


def beside_the_line() -> float:
    """The effort of a cylinder with a ball beside its line, relative to that without."""
    with_ball, without = (tube_with_ball(name) for name in ("hand", ""))
    return abs(with_ball / without - 1) / 1e-9


LOOSE = "forces/test_idle_links.py::test_random_mechanisms_close_and_balance"


SLIPS = [
    Slip("describe.spinning_links", "loose = {*rollers(mechanism)} -", "loose = set[str]() -",
         beside_the_line,
         "forces/test_idle_links.py::test_a_roller_beside_the_line_of_a_tube_holds_no_spin"),
    Slip("equations.cases.left_out", "set(model.loose_bodies(rows))", "set[str]()", loose, LOOSE),
    Slip("equations.cases.left_out", "links = [set(joint.bodies) - {GROUND}",
         "links = [set(joint.bodies)", loose, LOOSE),
    Slip("equations.tree.closures", "(ca.sumsqr(cut.gap) / cut.length - cut.length) / 2",
         "(ca.sumsqr(cut.gap) / cut.length - 1.0000001 * cut.length) / 2", bar, CLOSURE),
    Slip("equations.tree.closures", "found.append(ca.dot(cut.a(1), cut.a(2)))", "pass", flipped,
         f"{SUITE}::test_no_mode_has_a_flipped_axis"),
    Slip("equations.tree.invariants", "d.gap) - known", "d.gap) + known", ball_on_a_cross, CLOSURE),
    Slip("equations.tree.tree_model", "CutJoint(P2 - P1,", "CutJoint(P2 + P1,", cut_hinge, CLOSURE),
    Slip("kernels.bounds.reaches", "return across(place, freedom.axis) + after[last]",
         "return across(place, freedom.axis)", reach, REACHES),
    Slip("kernels.bounds.reaches", "2 * ball(part) * end.after[k]", "ball(part) * end.after[k]",
         plate, REACHES),
    Slip("kernels.graphs.row_reaches", "second + share * bends.second", "second + 0 * bends.second",
         eliminated, REACHES),
    Slip("equations.tree.teeth", 'number("phase") - second', 'number("phase") + second', wheels,
         CLOSURE),
    Slip("equations.tree.screws", "2 * ca.cross(carried, going)", "ca.cross(carried, going)",
         transport, FREE_BODIES),
    Slip("equations.tree.screws", "axis * a + ca.cross(spin, axis * v)", "axis * a", transport,
         FREE_BODIES),
    Slip("equations.tree.solid", "ca.cross(spin, J @ spin)", "0 * J @ spin", transport,
         FREE_BODIES),
    Slip("equations.tree.solid", "turning + ca.cross(at - model", "turning - ca.cross(at - model",
         own_checks, FREE_BODIES),
    Slip("equations.forces.spatial_friction", "(1.0, -1 / length))", "(1.0, 1 / length))", tilted,
         f"{FRICTION}test_rssp_has_the_coupled_friction_of_the_data"),
    Slip("forces.teeth.spatial_mesh", "ca.sign(second - first)", "ca.sign(first - second)",
         teeth,
         f"{TEETH}test_parallel_axes"),
    Slip("forces.teeth.spatial_mesh", "ca.cos(helix) * across + ca.sin(helix) * round_",
         "ca.cos(helix) * across - ca.sin(helix) * round_", teeth, f"{TEETH}test_parallel_axes"),
    Slip("forces.teeth.spatial_mesh", "_unit(self.ratio * self.a1 - self.a2)",
         "_unit(self.a1 - self.ratio * self.a2)", bevel, f"{TEETH}test_axes_that_meet"),
    Slip("motion.measures.screws", "self.place[second] + np.cross",
         "self.place[second] - np.cross", axes,
         f"{SCREWS}test_screw_axes_of_a_planar_mechanism_stand_on_its_instant_centres"),
    Slip("motion.measures.screws", "speed[first] - np.cross(", "speed[first] + np.cross(", axes,
         f"{SCREWS}test_screw_axes_of_a_planar_mechanism_stand_on_its_instant_centres"),
    Slip("motion.measures.screws", "TURN * np.sum(direction * speed", "np.sum(direction * speed",
         axes,
         f"{SCREWS}test_turning_and_sliding_at_once_is_a_screw"),
    Slip("motion.measures.screws", "axis.point - self.place[body]) + self.anchors[body]",
         "axis.point - self.place[body])", axes, f"{SCREWS}test_a_nut_turns_about_its_thread"),
    Slip("motion.measures.bars", "ca.cross(axis, model.point(point) - model.point(joint.first))",
         "ca.cross(axis, model.point(point))", pressed,
         f"{SCREWS}test_transmission_of_an_rssr"),
    Slip("motion.assembly.multistart", "for components in self.quaternions:",
         "for components in ():",
         begun_cases.two_balls_and_a_cross,
         "dynamics/test_first_poses.py::test_two_links_between_balls_about_a_cross_assemble"),
]  # fmt: skip
