"""The mechanism of a scene as a certificate has it: exact numbers, places of all its bodies."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.describe.joints.curve import Curve, follows_curve
from mechdae.equations.reduction import Scene
from mechdae.errors import UnavailableError
from mechdae.kernels.bounds.walk import replay
from mechdae.parts.proof.checker.plane import PLANAR_NUMBERS
from mechdae.types import Graph, Json, Unknowns

NAMES = {"pin-in-slot": "slot", "belt": "gear", "friction-wheel": "gear"}
"""Kinds of joints whose equation is that of another one."""
Formula = str | list[Any]
"""The path's parameter "s", an exact number, or an operation and its formulas."""
OPERATIONS = {
    ca.OP_ADD: "+",
    ca.OP_MUL: "*",
    ca.OP_DIV: "/",
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
}
CURVES = OPERATIONS | {ca.OP_SQRT: "sqrt"}


def formulas(
    function: Graph,
    numbers: tuple[str, ...] = (),
    known: dict[int, str] = OPERATIONS,
    what: str = "laws",
) -> list[Formula]:
    """Return the values of a casadi function of s, and of `numbers`, as formulas."""

    def operation(code: int, inputs: list[Any]) -> Formula:
        if code in known:
            return [known[code], *inputs]
        if code == ca.OP_INV:
            return ["/", "1", inputs[0]]
        if code in (ca.OP_SUB, ca.OP_NEG):
            minus = ["*", "-1", inputs[-1]]
            return ["+", inputs[0], minus] if code == ca.OP_SUB else minus
        if code in (ca.OP_SQ, ca.OP_TWICE):
            return ["*", inputs[0] if code == ca.OP_SQ else "2", inputs[0]]
        raise UnavailableError(f"no certificate is written of {what} with such functions")

    inputs = [["s"], list(numbers)] if numbers else [["s"]]
    return list(replay(function, inputs, operation, as_text)[0])


def as_text(value: Any) -> str:
    """Return a number as the exact text 'p/q'."""
    return str(Fraction(value) if isinstance(value, Fraction) else Fraction(float(value)))


def planar_mechanism_of(scene: Scene, laws: dict[str, Formula]) -> dict[str, Any]:
    """Return bodies, joints and drivers of a scene; of each driver its law."""
    mechanism = scene.model.mechanism
    values = mechanism.values()
    bodies = [body for group in scene.groups for body in group.bodies]
    names = list(dict.fromkeys(name for group in scene.groups for name in group.joints))
    joints = {}
    for name in names:
        joint = mechanism.joints[name]
        joints[name] = _joint(joint, values)
        if follows_curve(joint):
            joints[name] |= _curve(scene, joint, values)
    return {"bodies": points_of(scene, bodies, joints), "joints": joints, "drivers": laws}


def points_of(
    scene: Scene, bodies: list[str], joints: dict[str, Json]
) -> dict[str, dict[str, list[str]]]:
    """Return the points of bodies that joints hold, that are reported, or driven."""
    mechanism = scene.model.mechanism
    values, axes = mechanism.values(), "xyz"[: mechanism.dimension]
    points: dict[str, dict[str, list[str]]] = {body: {} for body in (GROUND, *bodies)}
    ends = [joint[key] for joint in joints.values() for key in ("first", "second")]
    driven = [d.text.rpartition(".")[0] for d in scene.drivers if d.text.count(".") == 2]
    for reference in (*ends, *scene.selection.points, *driven):
        body, _, point = reference.partition(".")
        if body in points:
            points[body][point] = [as_text(values[f"{reference}.{axis}"]) for axis in axes]
    return points


def _joint(joint: Joint, values: Any) -> dict[str, str]:
    kind = NAMES.get(joint.kind, joint.kind)
    if kind not in PLANAR_NUMBERS:
        raise UnavailableError(
            f"no certificate is written of joints of kind '{joint.kind}'",
            where=f"joints.{joint.name}",
        )
    claim: dict[str, Any] = {"kind": kind, "first": joint.first, "second": joint.second}
    numbers = {key: values.get(f"{joint.name}.{key}", 0.0) for key in PLANAR_NUMBERS[kind]}
    if joint.wheels == 2 and f"{joint.name}.ratio" not in values:  # two radii
        radii = [Fraction(values[f"{joint.name}.{key}"]) for key in ("second_radius", "radius")]
        numbers["ratio"] = radii[0] / radii[1]
    if joint.wheels == 2:
        numbers["ratio"] *= joint.sense
    carrier = getattr(joint, "carrier", None)
    if carrier:
        claim["carrier"] = carrier
    return claim | {key: as_text(value) for key, value in numbers.items()}


def _curve(scene: Scene, joint: Curve, values: dict[str, float]) -> Json:
    """Return place and roller of a curve: exact numbers are put into its formulas."""
    contact, model = scene.model.contacts[joint.name], scene.model
    if contact.wrapped or not contact.closed:
        raise UnavailableError(
            "no certificate is written of curves that end, or do not repeat by themselves",
            where=f"joints.{joint.name}",
        )
    function = ca.Function("curve", [contact.s, model.p], [ca.densify(contact.point)])
    numbers = tuple(as_text(v) for v in np.ravel(model.p_values))
    x, y = formulas(function, numbers, CURVES, "curves")
    if joint.roller_radius is None:
        return {"x": x, "y": y}
    radius = Fraction(values[f"{joint.name}.roller_radius"])
    return {"x": x, "y": y, "roller": str(radius if joint.side == "right" else -radius)}


class Frames:
    """Origin and angle of all bodies of a scene, in the frames of the file; places on curves.

    Origins are those of the file's frames: they follow from one point of each body.
    """

    def __init__(self, scene: Scene, points: dict[str, dict[str, list[str]]]) -> None:
        model = scene.model
        values, rows = model.mechanism.values(), []
        self.bodies, self.p, locals_ = (
            [body for body in points if body != GROUND],
            model.p_values,
            [],
        )
        for body in self.bodies:
            reference = f"{body}.{next(iter(points[body]))}"
            rows += [model.point(reference), model.frame(body).angle]
            locals_.append([values[f"{reference}.{axis}"] for axis in "xy"])
        self._local = np.array(locals_)
        self.curves = {
            name: [contact.s, *([] if contact.angle is None else [contact.angle])]
            for name, contact in model.contacts.items()
            if any(name in group.joints for group in scene.groups)
        }
        rows += [symbol for symbols in self.curves.values() for symbol in symbols]
        expression = ca.densify(scene.expression(ca.vertcat(*rows)))
        self._function = ca.Function("frames", [scene.x, scene.u, model.p], [expression])

    def at(self, x: Unknowns, u: Any) -> dict[str, list[str]]:
        """Return x, y, angle of each body as exact texts, at unknowns `x` and drivers `u`.

        Of each curve s and the angle of a roller's tangent, by the joint's name.
        """
        values = np.array(self._function(x, u, self.p)).ravel()
        place = values[: 3 * len(self.bodies)].reshape(-1, 3)
        rest = map(as_text, values[3 * len(self.bodies) :])
        contacts = {name: [next(rest) for _ in known] for name, known in self.curves.items()}
        cos, sin = np.cos(place[:, 2]), np.sin(place[:, 2])
        a, b = self._local.T
        origin = place[:, :2] - np.stack([cos * a - sin * b, sin * a + cos * b], axis=1)
        return {
            body: [as_text(v) for v in (*place_of_body, angle)]
            for body, place_of_body, angle in zip(self.bodies, origin, place[:, 2], strict=True)
        } | contacts
