"""Transmission angles of dyads: between the lines along which its links hold the inner joint.

In every dyad the inner joint (or the outer one, where a slide is inside) is held along two
lines: a link with two pins holds it along the line through them, a guide along its normal.
The acute angle between the lines is the complement of the pressure angle, and vanishes
where the dyad locks. A cam and its follower touch along the common normal of the contact;
the other line is that of the follower.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.measures.along_sweep_extremes import AT_REST, TIE
from mechdae.motion.measures.track import SAME, Sample, Track
from mechdae.motion.setup.outputs import Outputs, Request
from mechdae.records import dataclass
from mechdae.types import Floats, Points, Sym

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint
    from mechdae.equations.model import Model


PREFIX = "transmission of "


@dataclass(frozen=True)
class Dyad:
    """Where a group has a transmission angle.

    ``joint`` is the one it belongs to and ``bodies`` the two that this joint joins; ``lines`` are
    the directions of the two lines, over the coordinates of the scene.
    """

    joint: str
    bodies: tuple[str, str]
    group: Group
    lines: tuple[Sym, Sym]

    @property
    def products(self) -> Sym:
        """Cross and dot product of the lines (2, 1)."""
        (a, b), (c, d) = (ca.vertsplit(line) for line in self.lines)
        return ca.vertcat(a * d - b * c, a * c + b * d)

    @property
    def sine(self) -> Sym:
        """Sine of the angle between the lines, with the sign of the side they are on."""
        return self.products[0] / ca.norm_2(self.products)


def dyads(scene: Scene) -> list[Dyad]:
    """Return the groups of a scene that have a transmission angle, in the order of solving."""
    found = []
    for group in scene.groups:
        if not group.is_dyad and group.kind != "cam":
            continue
        lines = _lines(scene, group)
        if lines is not None:
            key, first, second = lines
            bodies = scene.model.mechanism.joints[key].bodies[:2]
            found.append(Dyad(key, (bodies[0], bodies[1]), group, (first, second)))
    return found


def requests(scene: Scene) -> list[Request]:
    """Return cross and dot product of the two lines of each dyad."""
    found = []
    for dyad in dyads(scene):
        joints = [scene.model.mechanism.joints[name] for name in dyad.group.joints]
        moving = dict.fromkeys(b for joint in joints for b in joint.bodies if b != GROUND)
        found.append((PREFIX + dyad.joint, dyad.products, tuple(moving)))
    return found


def _lines(scene: Scene, group: Group) -> tuple[str, Sym, Sym] | None:
    """Return the joint a dyad's transmission angle belongs to, and the directions of its lines."""
    model, bodies = scene.model, set(group.bodies)
    joints = {name: model.mechanism.joints[name] for name in group.joints}

    def pin(name: str) -> Sym:
        joint = joints[name]
        return model.point(joint.first if joint.first_body in bodies else joint.second)

    def line(name: str, to: Sym) -> Sym:
        """Line along which the link between an outer joint and `to` holds it."""
        if joints[name].guide:
            return model.ends[name].normal()
        return to - pin(name)

    higher = [name for name, joint in joints.items() if not joint.lower]
    if not higher:
        inner = group.inner[0]
        a, b = (name for name in group.joints if name != inner)
        if joints[inner].hinge:
            return inner, line(a, pin(inner)), line(b, pin(inner))
        return inner, *_across_guide(model.ends[inner].normal(), a, b, joints, pin, model)
    key = higher[0]
    (lower,) = (name for name in group.joints if name != key)
    ends = model.ends[key]
    second_inside = joints[key].second_body in bodies
    if joints[key].bar:
        return key, line(lower, ends.p2 if second_inside else ends.p1), ends.gap
    if joints[key].on_curve:
        contact = model.contacts[key]
        dx, dy = ca.vertsplit(contact.tangent)
        normal = contact.normal if contact.rolls else ca.vertcat(dy, -dx)
        place = ends.p2 if second_inside else ends.p1 + ends.first.direction(contact.point)
        return key, line(lower, place), ends.first.direction(normal)
    if not joints[key].slot:
        return None
    return key, line(lower, ends.p2), ends.normal()  # the pin is the inner or an outer joint


def _across_guide(
    normal: Sym, a: str, b: str, joints: dict[str, Joint], pin: Any, model: Model
) -> tuple[Sym, Sym]:
    """Return the lines of a dyad with a slide inside: between outer pins, or outer normal."""
    slides = [name for name in (a, b) if joints[name].guide]
    if slides:
        return model.ends[slides[0]].normal(), normal
    return pin(b) - pin(a), normal


def angles(outputs: Outputs, values: Floats) -> dict[str, dict[str, Floats]]:
    """Return ``transmission_angle`` [rad] by joint at given poses, 0 to pi/2."""
    return angles_of(outputs, values, _folded)


def angles_of(
    outputs: Outputs, values: Floats, folded: Callable[[Any], Any]
) -> dict[str, dict[str, Floats]]:
    """Return ``transmission_angle`` by joint, `folded` from its columns at given poses."""
    return {
        entry.part.removeprefix(PREFIX): {"transmission_angle": folded(values[:, entry.columns])}
        for entry in outputs.entries
        if entry.part.startswith(PREFIX)
    }


def _folded(lines: Points) -> Floats:
    return np.arctan2(np.abs(lines[:, 0]), np.abs(lines[:, 1]))


def summary(track: Track, outputs: Outputs) -> dict[str, dict[str, float]]:
    """Return joint -> {"min", "at", "max", "max_at"} over the sweep, refined."""
    return summary_of(track, outputs, _Family, _folded)


class _Family:
    """What vanishes where the angle of two columns is stationary or at an end, with derivatives."""

    def __init__(self, columns: list[int]) -> None:
        self.columns = columns

    def __call__(self, sample: Sample) -> tuple[Floats, Floats]:
        """Return the rate of the angle times its square's size; cross product; dot product."""
        s, c = ([array[:, k] for array in sample.y[:3]] for k in self.columns)
        turn, rate = c[0] * s[1] - s[0] * c[1], c[0] * s[2] - s[0] * c[2]
        return np.stack([turn, s[0], c[0]], axis=1), np.stack([rate, s[1], c[1]], axis=1)

    def moving(self, sample: Sample, unit: float) -> Any:
        """Return which of these are no rounding noise."""
        size = np.square(sample.y[0][:, self.columns]).sum(axis=1)
        with np.errstate(invalid="ignore"):
            largest = np.abs(self(sample)[0])
            largest[:, 0] *= unit / size
            largest[:, 1:] /= np.sqrt(size)[:, None]
            return (largest > AT_REST).any(axis=0)


def summary_of(
    track: Track, outputs: Outputs, family_of: Callable[[list[int]], Any], folded: Any
) -> dict[str, dict[str, float]]:
    """Return joint -> {"min", "at", "max", "max_at"} of angles that `folded` reads off columns."""
    found = {}
    for entry in outputs.entries:
        if not entry.part.startswith(PREFIX):
            continue
        columns = list(entry.columns)
        family = family_of(columns)
        places = []
        slack = SAME * track.unit
        for piece in track.pieces(track.low - track.margin, track.high + track.margin):
            moving = family.moving(track.sample(piece), track.unit)
            for s in np.concatenate(track.zeros(piece, family, moving)):
                if track.low - slack <= s + piece.shift <= track.high + slack:
                    places.append((s, s + piece.shift))
        for piece in track.pieces(track.low, track.high):
            places += [(s, s + piece.shift) for s in (piece.low, piece.high)]
        if places:
            s, at = np.array(sorted(places, key=lambda pair: pair[1])).T
            values = folded(track.at(s).y[0][:, columns])
            found[entry.part.removeprefix(PREFIX)] = _extremes(track, at, values)
    return found


def _extremes(track: Track, at: Floats, values: Floats) -> dict[str, float]:
    least, most = float(np.nanmin(values)), float(np.nanmax(values))
    slack = TIE * (most - least)
    first, last = (
        float(np.clip(at[np.flatnonzero(there)[0]], track.low, track.high))
        for there in (values <= least + slack, values >= most - slack)
    )
    return {"min": least, "at": first, "max": most, "max_at": last}
