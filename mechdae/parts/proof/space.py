"""A spatial mechanism as a certificate has it: exact numbers, places and quaternions of bodies."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe import Joint, Mechanism
from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.spatial import AXES, SpatialJoint, largest
from mechdae.describe.spinning_links import Spin
from mechdae.equations.reduction import Scene
from mechdae.equations.tree.spatial_frames import WORDS
from mechdae.errors import UnavailableError
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.parts.proof.checker.space import SIDES
from mechdae.parts.proof.mechanism import as_text, points_of
from mechdae.types import Floats, Json, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.tree.tree_model import TreeModel


def spatial_mechanism_of(scene: Scene, laws: dict[str, Any]) -> dict[str, Any]:
    """Return bodies, joints and drivers of a scene; of each driver its law.

    A link that turns freely between two balls is the distance of its neighbours' points, wheels
    and racks are sums of coordinates of the joints that they turn or slide in. Of others that spin
    freely between two points a further equation chooses the spin.
    """
    model: Any = scene.model
    mechanism, numbers = model.mechanism, model.mechanism.values()
    idle = model.idle
    bodies = [body for body in scene.bodies if body not in idle]
    spins = [_spin(model, spin) for spin in model.spins if {*spin.bodies} & {*bodies}]
    names = list(dict.fromkeys(name for group in scene.groups for name in group.joints))
    counted = [driver.text for driver in scene.drivers]
    spun = {name for link in idle.values() for name in (link.joint, *link.others)}
    joints, sums = dict[str, Any](), dict[str, Any]()
    for name in names:
        joint = mechanism.joints[name]
        if joint.meshes:
            sums[name] = _sum(mechanism, joint, numbers)
            counted += sums[name]
    for link in idle.values():
        if link.name in scene.bodies:
            first, second = ([Fraction(numbers[f"{p}.{a}"]) for a in AXES] for p in link.own)
            square = sum((x - y) ** 2 for x, y in zip(first, second, strict=True))
            first_end, second_end = link.ends
            bar = {"kind": "distance", "first": first_end, "second": second_end}
            joints[link.joint] = bar | {"square": str(square)}
    for name in names:
        if name not in sums and name not in spun:
            joints[name] = _joint(mechanism.joints[name], numbers, counted)
    points = points_of(scene, bodies, joints)
    content = {"bodies": points, "joints": joints, "drivers": laws}
    more = {"sums": sums, "spins": spins}
    return {"dimension": 3} | content | {key: value for key, value in more.items() if value}


def _spin(model: TreeModel, spin: Spin) -> dict[str, Any]:
    """Return which body hangs on which by the quaternion that has no part along a direction."""
    if spin.sleeve or len({*spin.ends.values()}) > 2:
        raise UnavailableError(
            f"no certificate of {', '.join(spin.bodies)}: they spin freely about the line of their "
            f"ball joints, which {spin.sleeve or 'more than two points'} must lie on",
            hint=f"a universal joint in place of one of {', '.join(spin.joints)}",
        )
    edge, k = model.unspun(spin)
    across = np.array(ca.Function("k", [model.p], [k])(model.p_values)).ravel()
    return {"body": edge.child, "on": edge.parent, "across": [as_text(v) for v in across]}


def _sum(mechanism: Mechanism, mesh: Joint, numbers: dict[str, float]) -> dict[str, str]:
    """Return factors of coordinates, and what is added to their sum: together they vanish."""
    one, other = bearings(mechanism, mesh)
    ratio = Fraction(numbers[f"{mesh.name}.{'ratio' if mesh.wheels > 1 else 'radius'}"])
    factors = (Fraction(-1), ratio) if mesh.wheels > 1 else (ratio, Fraction(-1))
    return {
        **{
            f"{named.joint}.{named.word}": as_text(factor * Fraction(named.sense))
            for named, factor in zip((one, other), factors, strict=True)
        },
        "": as_text(numbers.get(f"{mesh.name}.phase", 0.0)),
    }


def _joint(joint: Joint, numbers: dict[str, float], counted: list[str]) -> Json:
    """Return a joint; of its turns those are unknowns that count for drivers, wheels or a screw."""
    kind = "vector" if joint.pointer else joint.kind
    claim: dict[str, Any] = {"kind": kind, "first": joint.first, "second": joint.second}
    if joint.pointer:
        lengths = {word: f"{joint.name}.{word}" for word in WORDS}
        return claim | {w: as_text(numbers[key]) for w, key in lengths.items() if key in numbers}
    if joint.bar:
        return claim | {"square": as_text(Fraction(numbers[f"{joint.name}.length"]) ** 2)}
    if kind == "screw":
        claim["pitch"] = as_text(numbers[f"{joint.name}.pitch"])
    if isinstance(joint, SpatialJoint) and dict(joint.directions()):
        for second, keys in enumerate(SIDES):
            for key, vector in zip(keys, _side_of(joint, bool(second), numbers), strict=True):
                claim[key] = [as_text(v) for v in vector]
        turns = [word for word in joint.coordinates if word.startswith("angle")]
        claim["unknown"] = [
            word for word in turns if kind == "screw" or f"{joint.name}.{word}" in counted
        ]
    return claim


def _side_of(
    joint: SpatialJoint, second: bool, values: dict[str, float]
) -> tuple[list[float], list[float]]:
    """Return axis and zero of a side; absent ones are what they stand for."""
    axis, zero = joint.side(second)
    along = [values[f"{joint.name}.{axis}.{letter}"] for letter in AXES]
    if zero is not None:
        return along, [values[f"{joint.name}.{zero}.{letter}"] for letter in AXES]
    after = (largest(tuple(along)) + 1) % 3
    return along, [float(k == after) for k in range(3)]


class SpatialFrames:
    """Places and quaternions of all bodies of a scene, and coordinates of joints among them."""

    def __init__(self, scene: Scene, names: list[tuple[str, str]]) -> None:
        self.names, self.p = names, scene.model.p_values
        model: Any = scene.model
        self.bodies: list[str] = list(dict.fromkeys(owner for owner, word in names if word == "x"))
        self.turns: list[str] = list(dict.fromkeys(owner for owner, word in names if word == "0"))
        joints = [(owner, word) for owner, word in names if word not in "xyz0123"]
        rows = [model.origin(body) for body in self.bodies]
        rows += [ca.vec(model.frame(body).R) for body in self.turns]
        rows += [model.relative(*key) for key in joints]
        self.joints = joints
        expression = ca.densify(scene.expression(ca.vertcat(*rows)))
        self._function = ca.Function("frames", [scene.x, scene.u, model.p], [expression])
        self._last: dict[str, Floats] = {}

    def at(self, x: Unknowns, u: Any) -> dict[str, list[str]]:
        """Return the numbers of each body and joint, at unknowns `x` and drivers `u`.

        Signs of quaternions follow those of the call before.
        """
        values = np.array(self._function(x, u, self.p)).ravel()
        count = 3 * len(self.bodies)
        found = {b: list(values[3 * k : 3 * k + 3]) for k, b in enumerate(self.bodies)}
        matrices = values[count : count + 9 * len(self.turns)].reshape(-1, 3, 3)
        for body, R in zip(self.turns, matrices, strict=True):
            q = quaternions(R.T[None])[0]
            q = -q if q @ self._last.get(body, q) < 0 else q
            self._last[body] = q
            found[body] += list(q)
        for (owner, _), value in zip(
            self.joints, values[count + 9 * len(self.turns) :], strict=True
        ):
            found.setdefault(owner, []).append(value)
        return {owner: [as_text(v) for v in values] for owner, values in found.items()}
