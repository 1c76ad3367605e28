"""Tasks of composition with targets and functions, and their designs closed without the package."""

from __future__ import annotations

import tomllib

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.reference.planar_closure import Closure

SMALL = """
schema = 1
title = "Small searches"
[tasks.t]
kind = "composition"
links = [4]
objectives = ["error", "material"]
samples = 600
starts = 6
grow = 0
keep = 4
"""
CLOSED = [
    [0.5, 1.1], [0.4, 1.1], [0.3, 1.1], [0.2, 1], [0.1, 0.9], [0.05, 0.75], [0.02, 0.6], [0, 0.5],
    [0, 0.4], [0.03, 0.3], [0.1, 0.25], [0.15, 0.2], [0.2, 0.3], [0.3, 0.4], [0.4, 0.5], [0.5, 0.7],
    [0.6, 0.9], [0.6, 1],
]  # fmt: skip
"""Eighteen targets, 20 degrees of the crank apart (Kunjur and Krishnamurty 1997)."""
ELLIPSE = [
    [20, 10], [17.66, 15.142], [11.736, 17.878], [5, 16.928], [0.60307, 12.736],
    [0.60307, 7.2638], [5, 3.0718], [11.736, 2.1215], [17.66, 4.8577], [20, 10],
]  # fmt: skip
"""Nine targets in order, the first one twice (Acharyya and Mandal 2009)."""


def composition(goal, **changes):
    """Return the problem of a small search."""
    data = tomllib.loads(SMALL)
    data["tasks"]["t"] |= {"goal": goal, **changes}
    return from_dict(data, "small")


def designs(goal, **changes):
    """Return the designs of a small search, best error first."""
    result = md.solve(composition(goal, **changes), "t")
    assert result.fault is None, result.fault
    return sorted(result.data["designs"], key=lambda own: own["error"])


def closed(text):
    """Return the closure of a design's file, read without the package, and its bodies."""
    data = tomllib.loads(text)
    numbers, joints = {}, []
    bodies = {"ground": data["ground"], **data["bodies"]}
    for body, entry in bodies.items():
        for point, spot in entry["points"].items():
            numbers |= {f"{body}.{point}.{axis}": own for axis, own in zip("xy", spot, strict=True)}
    for name, joint in data["joints"].items():
        kind = joint["kind"]
        first, second = (
            joint["between"] if "between" in joint else (joint["first"], joint["second"])
        )
        joints.append((kind, name, first, second, {}))
        if kind == "prismatic":
            numbers[f"{name}.axis"] = joint.get("axis", 0.0)
            numbers[f"{name}.turn"] = joint.get("turn", 0.0)
    return Closure(list(data["bodies"]), joints, "crank.angle", numbers), data


def standing(data):
    """Return the pose (1, q) that a file is sketched in: links by their angles, point by point."""
    spots = {("ground", name): np.array(spot) for name, spot in data["ground"]["points"].items()}
    places = {"ground": (np.zeros(2), 0.0)}
    pins = [
        [end.split(".") for end in joint["between"]]
        for joint in data["joints"].values()
        if joint["kind"] == "revolute"
    ]
    while len(places) < len(data["bodies"]) + 1:
        before = len(places)
        for one, other in [*pins, *([b, a] for a, b in pins)]:
            if tuple(one) in spots and other[0] not in places:
                turn = data["sketch"][other[0]]
                c, s = np.cos(turn), np.sin(turn)
                points = data["bodies"][other[0]]["points"]
                spin = np.array([[c, -s], [s, c]])
                origin = spots[tuple(one)] - spin @ points[other[1]]
                places[other[0]] = (origin, turn)
                spots |= {(other[0], n): origin + spin @ p for n, p in points.items()}
        assert len(places) > before
    return np.array([[v for b in data["bodies"] for v in (*places[b][0], places[b][1])]])


def moved(text, angles):
    """Return the closure and its poses (t, q) at angles of the crank, from the file's sketch on.

    Each pose is followed from the one before it.
    """
    closure, data = closed(text)
    q = closure.solved(standing(data), np.array([data["sketch"]["crank"]]))
    order = np.argsort(np.abs(np.asarray(angles) - data["sketch"]["crank"]), kind="stable")
    at, poses = data["sketch"]["crank"], np.zeros((len(angles), q.shape[1]), q.dtype)
    known = [(at, q)]
    for k in order:
        start, own = min(known, key=lambda pair: abs(pair[0] - angles[k]))
        poses[k] = closure.followed(own, np.array([start]), np.array([angles[k]]))[0]
        known.append((angles[k], poses[k][None]))
    return closure, poses


def place_of(closure, q, point):
    """Return the places (t, 2) of a point `body.point`."""
    return closure._place(q, point)[0].T.astype(float)


def output_of(closure, q, coordinate, data):
    """Return the values (t,) of `body.angle`, or of `joint.slide`."""
    owner, what = coordinate.split(".")
    if what == "angle":
        return q[:, closure.column[owner] + 2].astype(float)
    first, second = data["joints"][owner]["between"]
    axis = data["joints"][owner].get("axis", 0.0)
    body = first.split(".")[0]
    turn = axis + (0.0 if body == "ground" else q[:, closure.column[body] + 2].astype(float))
    gap = place_of(closure, q, second) - place_of(closure, q, first)
    return gap[:, 0] * np.cos(turn) + gap[:, 1] * np.sin(turn)
