"""Spatial mechanisms with masses and loads, and their poses as free bodies."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.values import Table
from tests.reference.spatial_bodies import Contact, FreeBody, Pose, bar, rigid, rotation, wrenches

GRAVITY = (1.1, -2.3, -9.4)


def tensor(rng: Any, size: float) -> tuple[float, ...]:
    """Return the six numbers of a random body's inertia."""
    points = rng.normal(size=(5, 3)) * size
    J = sum((p @ p) * np.eye(3) - np.outer(p, p) for p in points)
    return (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])


def massive(mechanism: md.Mechanism, seed: int = 3, bars: tuple[str, ...] = ()) -> md.Mechanism:
    """Return the mechanism with random masses, centres and inertia, a force, a torque and gravity.

    Each body gets a point ``cm``, its centre; `bars` are uniform bars between their two points.
    """
    rng, size, bodies = np.random.default_rng(seed), mechanism.scale, {}
    values = mechanism.values()
    for name, body in mechanism.bodies.items():
        mass = rng.uniform(0.5, 2)
        centre, J = 0.3 * size * rng.normal(size=3), tensor(rng, 0.2 * size)
        if name in bars:
            first, second = (
                np.array([values[f"{name}.{p}.{a}"] for a in "xyz"]) for p in body.points
            )
            way = second - first
            assert (way[1:] == 0).all()
            centre = first + 0.4 * way
            J = (0.1, 0.7 * mass * way[0] ** 2, 0.7 * mass * way[0] ** 2)
        points = {**body.points, "cm": tuple(centre)}
        bodies[name] = replace(body, points=Table(points), mass=mass, center=centre, inertia=J)
    turning = [name for name in bodies if name not in bars]
    last, first = turning[-1], turning[0]
    loads = [
        md.Force("push", f"{last}.cm", rng.normal(size=3) * 30),
        md.Force("carried", f"{first}.cm", rng.normal(size=3) * 30, frame=first),
        md.Torque("turn", last, rng.normal(size=3) * 10 * size),
        md.Torque("turn2", first, rng.normal(size=3) * 10 * size, frame=last),
    ]
    return replace(
        mechanism, bodies=Table(bodies), gravity=GRAVITY, loads=Table({o.name: o for o in loads})
    )


def orientation(result: Any, body: str, k: int) -> Any:
    return np.eye(3) if body == "ground" else rotation(result.bodies[body].orientation[k])


def place(result: Any, reference: str, k: int) -> Any:
    body, point = reference.split(".")
    if body != "ground":
        return result.points[reference].position[k]
    values = result.mechanism.values()
    return np.array([values[f"ground.{point}.{axis}"] for axis in "xyz"])


def pose_of(result: Any, k: int, skip: tuple[str, ...] = ()) -> Pose:
    """Return one pose of a result of kind reactions as free bodies, without some joints."""
    mechanism, values = result.mechanism, result.mechanism.values()
    bodies: dict[str, FreeBody] = {}
    loads = []
    for name, body in mechanism.bodies.items():
        r, a = (result.points[f"{name}.cm"][word][k] for word in ("position", "acceleration"))
        m = values[f"{name}.mass"]
        xx, yy, zz, xy, xz, yz = (
            values.get(f"{name}.inertia.{w}", 0.0) for w in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
        J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if name in result.bodies:
            own = result.bodies[name]
            spin, turning = own.angular_velocity[k], own.angular_acceleration[k]
            bodies[name] = rigid(m, J, orientation(result, name, k), r, a, spin, turning)
        else:
            ends = [f"{name}.{point}" for point in body.points if point != "cm"]
            places, rates = (
                [result.points[end][word][k] for end in ends]
                for word in ("position", "acceleration")
            )
            bodies[name] = bar(m, yy, 0.4, places, rates)
        loads.append((name, r, m * np.array(mechanism.gravity), np.zeros(3)))
    for load in mechanism.loads.values():
        loads += _load(result, load, k)
    contacts = {}
    for name, joint in mechanism.joints.items():
        if name in skip:
            continue
        turned = orientation_of_axis(result, joint, k)
        gap = place(result, joint.second, k) - place(result, joint.first, k)
        lead = values.get(f"{name}.pitch", 0.0) / (2 * np.pi)
        found = wrenches(joint.kind, *turned, lead=lead, gap=gap)
        here = place(result, joint.second, k)
        contacts[name] = Contact(joint.first_body, joint.second_body, here, found)
    drives = []
    for driver in result.definition.drivers or ():
        part, word = driver.coordinate.split(".")
        joint = mechanism.joints[part]
        (axis, *_), zero = orientation_of_axis(result, joint, k), np.zeros(3)
        axis = axis / np.linalg.norm(axis)
        w = [zero, axis] if word == "angle" else [axis, zero]
        drives.append(
            (joint.first_body, joint.second_body, place(result, joint.second, k), np.concatenate(w))
        )
    return Pose(bodies, contacts, loads, drives)


def orientation_of_axis(result: Any, joint: Any, k: int) -> list[Any]:
    """Return the axes of a joint in the world: of the first body, of the second of a cross."""
    values, found = result.mechanism.values(), []
    for key, body in (("axis", joint.first_body), ("axis2", joint.second_body)):
        if getattr(joint, key, None) is not None and (key == "axis" or joint.kind == "universal"):
            own = np.array([values[f"{joint.name}.{key}.{a}"] for a in "xyz"])
            found.append(orientation(result, body, k) @ own)
    return found


def _load(result: Any, load: Any, k: int) -> list[Any]:
    zero = np.zeros(3)
    if load.kind in ("force", "torque"):
        turn = np.eye(3) if load.frame == "world" else orientation(result, load.frame, k)
        value = turn @ np.array(load.value, float)
        if load.kind == "torque":
            return [(load.body, place(result, f"{load.body}.cm", k), zero, value)]
        return [(load.point.split(".")[0], place(result, load.point, k), value, zero)]
    if load.kind == "table":
        part, word = load.coordinate.split(".")
        x, y = np.array(load.rows).T
        value = load.factor * np.interp(result.joints[part][word][k], x, y)
        turn = np.eye(3) if load.frame == "world" else orientation(result, load.frame, k)
        axis = turn @ np.array(load.axis, float)
        moment = value * axis / np.linalg.norm(axis)
        return [(load.body, place(result, f"{load.body}.cm", k), zero, moment)]
    assert load.kind == "spring"
    if load.between is not None:
        ends = [place(result, reference, k) for reference in load.between]
        way = ends[1] - ends[0]
        pull = load.stiffness * (np.linalg.norm(way) - load.free_length) * way / np.linalg.norm(way)
        first, second = (reference.split(".")[0] for reference in load.between)
        both = [(first, ends[0], pull, zero), (second, ends[1], -pull, zero)]
    else:
        part, word = load.coordinate.split(".")
        joint = result.mechanism.joints[part]
        value = result.joints[part][word][k] - load.free_length
        (axis, *_), here = orientation_of_axis(result, joint, k), place(result, joint.second, k)
        tension = -load.stiffness * value * axis / np.linalg.norm(axis)
        parts = (zero, tension) if word == "angle" else (tension, zero)
        both = [
            (joint.second_body, here, *parts),
            (joint.first_body, here, -parts[0], -parts[1]),
        ]
    return [own for own in both if own[0] != "ground"]
