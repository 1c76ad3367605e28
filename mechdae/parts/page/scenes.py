"""What a page draws: links and joints as data; places come from the points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe import GROUND, Mechanism
from mechdae.describe.joints.curve import follows_curve, place, span
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.fragments import fragments

if TYPE_CHECKING:
    from mechdae.results import Result
    from mechdae.types import Floats, Json


SAMPLES = 240
"""Pieces of a curve."""


def drawn(result: Any, places: Floats, lang: str) -> tuple[Json, Json]:
    """Return bodies, points and joints of a motion, and the fragments they are drawn by.

    ``places`` are where its poses are on the page's way.
    ``bodies``: their names. ``joints``: name,
    references of its two points, numbers that its symbol is drawn by; angles of guides are in the
    frame of the first body. ``ground``: names of the fixed points, with their places; ``space``:
    the view.
    """
    mechanism = result.mechanism
    values = mechanism.values()
    ground = [f"{GROUND}.{name}" for name in mechanism.ground.points]
    scene: Json = {
        "dimension": mechanism.dimension,
        "bodies": [{"name": name} for name in mechanism.bodies],
        "joints": [_joint(mechanism, name, values) for name in mechanism.joints],
        "ground": ground,
        "places": [[values[f"{point}.{axis}"] for axis in mechanism.axes] for point in ground],
    }
    shares = (places - places.min()) / (np.ptp(places) or 1.0)
    space, drawing = fragments(result, shares, lang)
    return scene | space, drawing


def angles_of(result: Result, scene: Json, drawing: Json) -> dict[str, Floats]:
    """Return the angles [rad] of the bodies that fragments and curves turn with."""
    if scene["dimension"] == 3:
        return {}
    joints = {joint["name"]: joint for joint in scene["joints"]}
    turns = {part.get("turn", "") for part in drawing["parts"]}
    turns |= {f"{name}/axis" for name, joint in joints.items() if {"axis", "curve"} & set(joint)}
    found = set()
    for name, _, kind in (turn.partition("/") for turn in turns if turn and ">" not in turn):
        side = "second" if kind == "rack" else "first"
        found.add(joints[name][side].split(".")[0] if kind else name)
    angles = read_scene(result).angles
    return {body: angles[body] for body in sorted(found - {GROUND}) if body in angles}


def _joint(mechanism: Mechanism, name: str, values: dict[str, float]) -> Json:
    joint = mechanism.joints[name]
    entry: Json = {"name": name, "first": joint.first, "second": joint.second}
    entry["pin"] = joint.coincide
    if mechanism.dimension == 3:
        return entry
    if follows_curve(joint):
        first, last = span(joint, values)
        at = [first + (last - first) * k / SAMPLES for k in range(SAMPLES + 1)]
        entry["curve"] = [[float(f"{v:.6g}") for v in place(joint, values, s)] for s in at]
        entry["roller"] = values.get(f"{name}.roller_radius", 0.0)
    if joint.straight or joint.wheels == 1:
        entry["axis"] = values[f"{name}.axis"]
    if joint.wheels == 1:
        radius = values[f"{name}.radius"]
        entry |= {"radius": abs(radius), "side": -1.0 if radius > 0 else 1.0}
    return entry
