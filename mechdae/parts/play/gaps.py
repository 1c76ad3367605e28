"""The gaps of joints: which equations they open, and by how much.

With clearance the equations of a joint, second body minus first, are Phi = w for any w of a set
W that is convex and symmetric: a disc of a pin in its bush, an interval of a pin in a slot and of
teeth, a rhombus of the offset n and the tilt t of a block in its guide. What a set does to a linear
form a w is its support function, the largest value there.

Under load a reaction holds a joint at the point of its gap where reaction times offset is least: it
acts against the offset. To first order outputs move by their linear forms there. The reactions are
those of the pose without play; the angle of friction in a pin is not counted.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from mechdae.describe import Mechanism
from mechdae.describe.joints.joint import GAPS, Joint
from mechdae.describe.joints.limits import check_size
from mechdae.equations.gaps import opened
from mechdae.equations.model import Model, Row
from mechdae.errors import MechanismError
from mechdae.records import dataclass
from mechdae.results import Named
from mechdae.types import Booleans, Floats, Sym


@dataclass(frozen=True)
class JointGap:
    """The gap of one joint.

    Attributes
    ----------
    key
        Of the file, ``clearance`` or another one of `GAPS`.
    size
        Its value there [m, rad].
    rows
        Places of the equations that it opens.
    reach
        How far each of them opens alone, (n, rows) or (1, rows) [m, rad].
    disc
        Whether the set is a disc, else a rhombus with its corners at ``reach``.
    units
        Of the equations that it opens, "m" or "rad".
    """

    joint: str
    key: str
    size: float
    rows: list[int]
    reach: Floats
    disc: bool
    units: list[str]

    def pressed(self, reactions: Floats) -> Floats:
        """Return where reactions (n, rows) on the second body hold the joint, (n, rows).

        They act against the offset: it is the point of the set with the least of reaction times
        offset. Zero where there is no reaction.
        """
        scaled = reactions * self.reach
        if self.disc:
            size = np.sqrt(np.square(scaled).sum(axis=-1, keepdims=True))
            return -self.reach * scaled / np.where(size > 0, size, 1.0)
        first = np.abs(scaled).argmax(axis=-1, keepdims=True)
        corner = np.zeros_like(scaled)
        np.put_along_axis(corner, first, 1.0, axis=-1)
        return -self.reach * corner * np.sign(scaled)


def support(disc: bool, forms: Sequence[Sym], reach: Sequence[Sym], least: float = 0.0) -> Sym:
    """Return the largest value of linear forms on the set of a gap, by their entries.

    Arrays or expressions, one for each row. `least` below the root of a disc lets it have a
    derivative where it vanishes.
    """
    if disc:
        return (sum(part * part for part in forms) + least) ** 0.5 * reach[0]
    sizes = [abs(part) * size for part, size in zip(forms, reach, strict=True)]
    return functools.reduce(ca.fmax if isinstance(sizes[0], ca.SX) else np.maximum, sizes)


def gaps_of(
    mechanism: Mechanism, rows: Sequence[Row], centres: Mapping[str, Floats]
) -> list[JointGap]:
    """Return the gaps of the joints that have equations among `rows`.

    Parameters
    ----------
    centres
        Distance (n,) of the centres of wheels by joint [m].

    Raises
    ------
    MechanismError
        A gap as large as a link, a block that is shorter than its gap, or no gap at all.
    """
    values, found = mechanism.values(), []
    for name, joint in mechanism.joints.items():
        places = {
            row.part: (k, row.unit)
            for k, row in enumerate(rows)
            if row.owner == name and not row.driver
        }
        for key in GAPS:
            size = values.get(f"{name}.{key}")
            if size is not None and places:
                found.append((joint, key, size, places))
    if not found:
        raise MechanismError("the outputs depend on no joint with a clearance", where="outputs")
    sized = [each for each in found if each[2]] or found
    for joint, key, size, _ in sized:
        check_size(mechanism, joint, key, size)
    return [_gap(*each, values, centres) for each in sized]


def _gap(
    joint: Joint, key: str, size: float, places: Mapping[str, tuple[int, str]],
    values: Mapping[str, float], centres: Mapping[str, Floats],
) -> JointGap:  # fmt: skip
    """Return the gap of a joint by the parts of its equations."""
    where, name = f"joints.{joint.name}.{key}", joint.name
    length = values.get(f"{name}.contact_length") if joint.guide else None
    if length is not None and 2 * size >= length:
        raise MechanismError(
            f"the block is {length:g} m long: in a gap of {size:g} m on each side it can turn "
            "round", where=where,
        )  # fmt: skip
    along = key == "backlash" and joint.wheels == 2
    if along and (values[f"{name}.ratio"] == 1 or not centres[name].min(initial=np.inf)):
        raise MechanismError(
            "wheels about one axis have no pitch circle", where=where, hint="backlash_angle"
        )
    reach = opened(joint, key, values, centres.get(name))
    rows, units = (list(each) for each in zip(*[places[part] for part in reach], strict=True))
    each = np.stack([np.atleast_1d(size) for size in reach.values()], axis=1)
    return JointGap(name, key, size, rows, each, joint.hinge, units)


def multipliers(model: Model, joint: str, parts: Sequence[str]) -> Sym:
    """Return what of the reaction (Fx, Fy, M) on the second body opens each row, (rows, 3)."""
    ends = model.ends[joint]

    def along(direction: Sym) -> Sym:
        return ca.horzcat(direction.T, ca.SX(1, 1))

    def of(part: str) -> Sym:
        if part in "xy":
            return ca.SX.eye(3)["xy".index(part), :]
        if part == "n":
            return along(ends.normal())
        if part == "turn":
            return ca.SX.eye(3)[2, :]
        if ends.joint.wheels == 2:
            return ca.SX.eye(3)[2, :] / ends.number("ratio")
        a = ends.number("axis")
        return along(ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a))))

    return ca.densify(ca.vertcat(*[of(part) for part in parts]))


def offsets(gaps: Sequence[JointGap], directions: Sequence[Floats], joints: Named) -> list[Floats]:
    """Return where the reactions hold each joint, (n, rows) by gap.

    Parameters
    ----------
    directions
        By gap, (n, 3 rows), what `multipliers` gives.
    joints
        Of a result with reactions.
    """
    found = []
    for gap, direction in zip(gaps, directions, strict=True):
        reaction = joints[gap.joint].reaction
        matrix = direction.reshape(len(direction), 3, -1).transpose(0, 2, 1)
        found.append(gap.pressed((matrix @ reaction[..., None])[..., 0]))
    return found


def reversals(gap: JointGap, offset: Floats) -> Booleans:
    """Return where offsets (n, rows) jump from one pose to the next, (n,).

    On a disc they turn over by more than a right angle; else they go to another corner.
    """
    turned = np.zeros(len(offset), bool)
    last, after = offset[:-1], offset[1:]
    with np.errstate(invalid="ignore"):
        if gap.disc:
            turned[1:] = (last * after).sum(axis=1) < 0
        else:
            turned[1:] = (np.sign(last) != np.sign(after)).any(axis=1)
    turned[1:] &= np.isfinite(last + after).all(axis=1)
    return turned
