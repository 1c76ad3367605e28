"""Mechanisms that several tests build."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import mechdae as md
from mechdae.describe.mechanism import GROUND

SPEED = 3.0


def four_bar(a: float, b: float, c: float, d: float, **sketch: float) -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (d, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (a, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (b, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (c, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch=sketch,
    )


def five_bar() -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "E": (0.2, 0)}),
        bodies=[
            md.Body("left", {"A": (0, 0), "B": (0.2, 0)}),
            md.Body("right", {"E": (0, 0), "D": (0.2, 0)}),
            md.Body("fore", {"B": (0, 0), "C": (0.25, 0)}),
            md.Body("aft", {"D": (0, 0), "C": (0.25, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "left.A"),
            md.Revolute("E", "ground.E", "right.E"),
            md.Revolute("B", "left.B", "fore.B"),
            md.Revolute("D", "right.D", "aft.D"),
            md.Revolute("C", "fore.C", "aft.C"),
        ],
        sketch={"left": 2.0, "right": 1.0, "fore": 0.9, "aft": 2.2},
    )


def toggle(sketch: float) -> md.Mechanism:
    """Two links of 1 m between a pivot and a slider g away: the angle at the pivot is acos(g/2)."""
    return md.Mechanism(
        ground=md.Ground(points={"A": (0, 0)}),
        bodies=[
            md.Body("s", points={"C": (0, 0)}),
            md.Body("p", points={"A": (0, 0), "B": (1, 0)}),
            md.Body("q", points={"B": (0, 0), "C": (1, 0)}),
        ],
        joints=[
            md.Prismatic("g", "ground.A", "s.C"),
            md.Revolute("a", "ground.A", "p.A"),
            md.Revolute("b", "p.B", "q.B"),
            md.Revolute("c", "q.C", "s.C"),
        ],
        sketch={"g": 1.2, "s": 0.0, "p": sketch, "q": -sketch},
    )


def triad() -> md.Mechanism:
    """Return a platform on three legs, one of them the driven crank (class III)."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "P": (1.0, 0), "R": (0.3, 1.0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (0.1, 0)}),
            md.Body("leg1", {"A": (0, 0), "D": (0.5, 0)}),
            md.Body("leg2", {"P": (0, 0), "E": (0.5, 0)}),
            md.Body("leg3", {"R": (0, 0), "F": (0.5, 0)}),
            md.Body("plate", {"D": (0, 0), "E": (0.3, 0), "F": (0.1, 0.3)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "leg1.A"),
            md.Revolute("P", "ground.P", "leg2.P"),
            md.Revolute("R", "ground.R", "leg3.R"),
            md.Revolute("D", "leg1.D", "plate.D"),
            md.Revolute("E", "leg2.E", "plate.E"),
            md.Revolute("F", "leg3.F", "plate.F"),
        ],
    )


def cam(
    x: str,
    y: str,
    roller: float | None = None,
    lift: float = 0.04,
    start: float = 0.3,
    **keys: object,
) -> md.Mechanism:
    """A cam on the ground's point O and a follower that moves on the y axis."""
    keys = {"closed": True, **keys}
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("cam", {"O": (0, 0)}), md.Body("follower", {"N": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Curve("profile", "cam.O", "follower.N", x=x, y=y, roller_radius=roller, **keys),
            md.Prismatic("guide", "ground.O", "follower.N", axis="pi/2"),
        ],
        sketch={"cam": start, "guide": lift},
    )


def rod_and_slot(**curve: object) -> md.Mechanism:
    """A crank OA, a rod AB of length 0.08 whose end B is guided by a curve from Q."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "A": (0.03, 0)}),
            md.Body("rod", {"A": (0, 0), "B": (0.08, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "rod.A"),
            md.Curve("slot", "ground.Q", "rod.B", **curve),
        ],
        sketch={"crank": 2.0, "rod": -0.3},
    )


def moved(problem: md.Problem, random: np.random.Generator) -> md.Problem:
    """Return the problem with shuffled bodies and joints and other frame origins.

    Frames of bodies that no task drives are turned as well.
    """
    mechanism = problem.mechanism
    values = mechanism.values()
    driven = {
        c.coordinate.split(".")[0]
        for t in problem.tasks.values()
        for c in getattr(t, "all_drivers", ())
    }
    shift = {name: random.normal(size=2) * 0.3 for name in mechanism.bodies}
    turn = {n: 0.0 if n in driven else random.uniform(-3, 3) for n in mechanism.bodies}
    turn[GROUND] = 0.0
    bodies = []
    for name, body in mechanism.bodies.items():
        points = {}
        for point in body.points:
            old = np.array([values[f"{name}.{point}.x"], values[f"{name}.{point}.y"]])
            c, s = math.cos(turn[name]), math.sin(turn[name])
            new = np.array([[c, s], [-s, c]]) @ (old + shift[name])
            points[point] = tuple(new)
        bodies.append(replace(body, points=points))
    joints = []
    for name, joint in mechanism.joints.items():
        first, second = turn[joint.first_body], turn[joint.second_body]
        changes = {}
        if joint.kind in ("prismatic", "pin-in-slot"):
            changes["axis"] = values[f"{name}.axis"] - first
        if joint.kind == "prismatic":
            changes["turn"] = values[f"{name}.turn"] + second - first
        if joint.kind == "gear":
            carrier = turn[joint.carrier] if joint.carrier else 0.0
            ratio = values[f"{name}.ratio"]
            changes["phase"] = (
                values[f"{name}.phase"] + first - carrier - ratio * (second - carrier)
            )
        joints.append(replace(joint, **changes))
    random.shuffle(bodies)
    random.shuffle(joints)
    known = dict(mechanism.sketch.items())
    sketch = {n: v + turn.get(n, 0.0) for n, v in known.items()}
    new = replace(
        mechanism,
        bodies={b.name: b for b in bodies},
        joints={j.name: j for j in joints},
        sketch=sketch,
    )
    return replace(problem, mechanism=new)


def doubled(problem: md.Problem, body: str) -> md.Problem:
    """Return the problem with a second body on the pins of `body`: it changes no motion."""
    mechanism = problem.mechanism
    twin = f"{body}_twin"

    def side(reference: str) -> str:
        name, point = reference.split(".")
        return f"{twin}.{point}" if name == body else reference

    joints = dict(mechanism.joints)
    for name, joint in mechanism.joints.items():
        if body in joint.bodies:
            new = {"first": side(joint.first), "second": side(joint.second)}
            joints[f"{name}_twin"] = replace(joint, name=f"{name}_twin", **new)
    sketch = dict(mechanism.sketch)
    if body in sketch:
        sketch[twin] = sketch[body]
    copy = replace(mechanism.bodies[body], name=twin, number=None)
    bodies = {**mechanism.bodies, twin: copy}
    new_mechanism = replace(mechanism, bodies=bodies, joints=joints, sketch=sketch)
    return replace(problem, mechanism=new_mechanism)
