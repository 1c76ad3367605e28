"""Links between two ball joints as bars: what acts on them acts on their two ends.

A bar does not feel its spin. With the centre at the share s of its line, mass m and moment of
inertia I across it, its kinetic energy is that of the matrix

    [[m (1-s)^2 + I/l^2, m s (1-s) - I/l^2], [m s (1-s) - I/l^2, m s^2 + I/l^2]]

of its ends' velocities, and its inertia are forces at the two ends.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import MOMENTS, Mechanism
from mechdae.describe.spinning_links import (
    ROUND,
    IdleLink,
    Line,
    Spin,
    idle_links,
    places_of,
    points_of,
    share_of,
    spins,
)
from mechdae.equations.tree.teeth import axes_of_mesh
from mechdae.errors import InputError, UnavailableError
from mechdae.types import Sym

SX = ca.SX


def tensor(model: Any, name: str) -> Sym | None:
    """Return the inertia (3, 3) about the centre in the body's frame, None where none is given.

    What spins freely has none about its line: its frame turns about it as no body does.
    """
    if f"{name}.inertia.xx" not in model.numbers:
        return None
    xx, yy, zz, xy, xz, yz = (model.numbers.get(f"{name}.inertia.{w}", SX(0)) for w in MOMENTS)
    J = ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))
    way = model.spun_about(name)
    return J if way is None else J - way @ way.T * ca.dot(way, J @ way)


class SpinningBar:
    """A link that spins freely.

    Attributes
    ----------
    joints : (str, str)
        Its ball joints.
    places : (SX, SX)
        Their places.
    """

    def __init__(self, model: Any, link: IdleLink) -> None:
        self.model, self.link = model, link
        self.joints: tuple[str, *tuple[str, ...]] = (link.joint, *link.others)
        self.places = tuple(model.point(end) for end in link.ends)

    def shares(self, place: Sym) -> tuple[Sym, Sym]:
        """Return the shares of the two ends in a force at a place of the line."""
        way = self.places[1] - self.places[0]
        second = ca.dot(place - self.places[0], way) / ca.sumsqr(way)
        return 1 - second, second

    def _own(self, reference: str) -> Sym:
        return ca.vertcat(*[self.model.numbers[f"{reference}.{axis}"] for axis in "xyz"])

    def mass_shares(self) -> tuple[Sym, Sym]:
        """Return the shares of the ends in the weight."""
        start, end = (self._own(reference) for reference in self.link.own)
        centre = f"{self.link.name}.center"
        middle = self._own(centre) if f"{centre}.x" in self.model.numbers else SX.zeros(3)
        second = ca.dot(middle - start, end - start) / ca.sumsqr(end - start)
        return 1 - second, second

    def matrix(self) -> tuple[Sym, Sym, Sym]:
        """Return the entries 11, 12, 22 of the mass matrix of the ends."""
        mass = self.model.numbers.get(f"{self.link.name}.mass", SX(0))
        start, end = (self._own(reference) for reference in self.link.own)
        first, second = self.mass_shares()
        length = ca.sumsqr(end - start)
        J, across = tensor(self.model, self.link.name), SX(0)
        if J is not None:  # the mean across the line, over l^2
            along = ca.dot(end - start, J @ (end - start)) / length
            across = (ca.trace(J) - along) / (2 * length)
        return (
            mass * first**2 + across,
            mass * first * second - across,
            mass * second**2 + across,
        )

    def _rates(self) -> tuple[list[Sym], list[Sym]]:
        """Return velocities and accelerations of the ends."""
        model, velocities, accelerations = self.model, [], []
        twists = model.space.kinetics(model).twists
        for end in self.link.ends:
            body = end.split(".")[0]
            moves = body in model.mechanism.bodies
            arm = model.frame(body).direction(model.local(end)) if moves else SX.zeros(3)
            velocities.append(twists[body].velocity_at(arm))
            accelerations.append(twists[body].acceleration_at(arm))
        return velocities, accelerations

    def inertia(self) -> tuple[Sym, Sym]:
        """Return mass times acceleration as forces at the two ends."""
        (first, second), (m11, m12, m22) = self._rates()[1], self.matrix()
        return m11 * first + m12 * second, m12 * first + m22 * second

    def kinetic_energy(self) -> Any:
        (first, second), (m11, m12, m22) = self._rates()[0], self.matrix()
        squares = m11 * ca.sumsqr(first) + m22 * ca.sumsqr(second)
        return squares / 2 + m12 * ca.dot(first, second)


def check_in_space(mechanism: Mechanism, teeth: bool = True) -> None:
    """Raise for what has no forces in space: gears and racks where forces of `teeth` are needed.

    Raises
    ------
    UnavailableError, InputError
        With the key.
    """
    for joint in mechanism.joints.values():
        if joint.meshes and teeth:
            axes_of_mesh(mechanism, joint)
    links, held = check_bars(mechanism), spins(mechanism)
    spun = {body: spin.joints for spin in held for body in spin.bodies}
    spun |= {link.name: (link.joint, *link.others) for link in links.values()}
    for body, ends in spun.items():
        for end in ends:
            if mechanism.values().get(f"{end}.friction", 0.0):
                raise UnavailableError(
                    f"{body} spins freely about the line of its ball joints: how fast they "
                    f"rub is not determined",
                    where=f"joints.{end}.friction",
                    hint=f"a universal joint at one end of {body}",
                )
    _check_points(mechanism, held)
    points = points_of(mechanism)
    for load in mechanism.loads.values():
        for key in ("body", "frame"):
            name = getattr(load, key, None)
            if name in points and name in mechanism.bodies:
                raise InputError(
                    f"{name} is a point of vector loops: it does not turn",
                    where=f"loads.{load.name}.{key}",
                    hint="forces on nodes, or a load along a coordinate of a vector",
                )
            if name in spun:
                raise InputError(
                    f"{name} spins freely about the line of its ball joints: "
                    + ("nothing holds it against a torque" if key == "body" else "it has no axes"),
                    where=f"loads.{load.name}.{key}",
                    hint="forces at its points",
                )


def _check_points(mechanism: Mechanism, held: list[Spin]) -> None:
    """Raise for loads on points that turn with bodies that spin together."""
    lines = {body: line for spin in held for body, line in spin.lines.items()}
    ends = {point for spin in held for point in spin.ends.values()}
    spun = {body for spin in held for body in spin.bodies}
    sleeves = {spin.sleeve for spin in held}
    for load in mechanism.loads.values():
        text = getattr(load, "coordinate", None) or ""
        if text.partition(".")[0] in sleeves and text.endswith(".angle"):
            raise UnavailableError(
                f"the bodies of {text.partition('.')[0]} spin freely about its axis: {text} has no "
                "value",
                where=f"loads.{load.name}",
                hint="nothing holds them against a torque",
            )
        for point in (getattr(load, "point", None), *(getattr(load, "between", None) or ())):
            if point is None or point.split(".")[0] not in spun or point in ends:
                continue
            if share_of(mechanism, lines, point) is None:
                raise UnavailableError(
                    f"{point.split('.')[0]} spins freely about the line of its ball joints: "
                    f"{point} has no place",
                    where=f"loads.{load.name}",
                    hint="points on that line have one",
                )


def check_bars(mechanism: Mechanism) -> dict[str, IdleLink]:
    """Return the links that spin freely; raise `InputError` where a body has no mass of a bar."""
    links = idle_links(mechanism)
    for link in links.values():
        _check_bar(mechanism, link.name, link.own)
    for spin in spins(mechanism):
        for body in spin.bodies:
            bar = mechanism.bodies[body]
            if body in spin.lines:
                _check_bar(mechanism, body, spin.lines[body])
            elif bar.mass is not None or bar.inertia is not None:
                raise InputError(
                    f"{body} spins freely with {', '.join(spin.bodies)}, and its mass does not lie "
                    "about one line",
                    where=f"bodies.{body}",
                    hint="a universal joint at one end, or no mass",
                )
    return links


def _check_bar(mechanism: Mechanism, name: str, line: Line) -> None:
    """Raise for a body that spins freely although its mass does not lie about its line."""
    values = mechanism.values()
    start, end = (np.array(place) for place in places_of(mechanism, name, line))
    size = float(np.linalg.norm(end - start))
    unit = (end - start) / size
    hint = f"{name} spins freely about that line, its motion about it has no equation"
    if mechanism.bodies[name].mass is not None:
        centre = np.array([values.get(f"{name}.center.{axis}", 0.0) for axis in "xyz"]) - start
        if np.linalg.norm(np.cross(unit, centre)) > ROUND * size:
            raise InputError(
                f"the centre of {name} lies beside the line of its ball joints",
                where=f"bodies.{name}.center",
                hint=hint,
            )
    if mechanism.bodies[name].inertia is not None:
        xx, yy, zz, xy, xz, yz = (values.get(f"{name}.inertia.{word}", 0.0) for word in MOMENTS)
        J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        axial = float(unit @ J @ unit)
        across = (xx + yy + zz - axial) / 2
        round_one = across * np.eye(3) + (axial - across) * np.outer(unit, unit)
        if np.abs(J - round_one).max() > ROUND * max(abs(across), abs(axial)):
            raise InputError(
                f"the inertia of {name} is not the same in all directions across the line of its "
                f"ball joints",
                where=f"bodies.{name}.inertia",
                hint=hint,
            )
