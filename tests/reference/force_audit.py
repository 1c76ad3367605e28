"""Balance of forces and friction laws, checked on what a result says and nothing else.

`audit` takes the published reactions, efforts, losses and motion of a result and returns by how
much they miss Newton's and Euler's equations of every body, and the laws of friction of every
joint, as shares of the largest force (or moment) at the pose. It is arithmetic on the result: no
part of the package computes here.
"""

from __future__ import annotations

import ast
import operator
from collections import defaultdict
from typing import Any

import numpy as np

import mechdae as md

GRAVITY_OFF = (0.0, 0.0)
REVERSES = 1e-13
"""Share of the speeds of two bodies below which that of their joint is rounding."""
ALIASES = {"max": "maximum", "min": "minimum", "asin": "arcsin", "acos": "arccos", "atan": "arctan"}
OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


def complex_(array: Any) -> np.ndarray:
    array = np.asarray(array)
    return array[..., 0] + 1j * array[..., 1]


class Audit:
    """The books of one result; ``radius`` is "exact" or "article"."""

    def __init__(self, mechanism: md.Mechanism, result: md.Result, radius: str = "exact") -> None:
        self.m, self.r, self.radius = mechanism, result, radius
        self.values = mechanism.values()
        self.n = len(result)
        self.force: dict[str, np.ndarray] = defaultdict(lambda: np.zeros(self.n, complex))
        self.turn: dict[str, np.ndarray] = defaultdict(lambda: np.zeros(self.n))
        self.force_size = np.zeros(self.n)
        self.turn_size = np.zeros(self.n)

    # -- where things are --------------------------------------------------------------------------

    def number(self, number: Any) -> Any:
        """Return the value of a number, an expression of parameters, coordinates and speeds."""
        if not isinstance(number, str):
            return number
        return self._value(ast.parse(number, mode="eval").body)

    def _value(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.BinOp):
            return OPERATORS[type(node.op)](self._value(node.left), self._value(node.right))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return -self._value(node.operand)
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            return getattr(np, ALIASES.get(name, name))(*[self._value(a) for a in node.args])
        text = ast.unparse(node)
        if text == "pi":
            return np.pi
        if text in self.values:
            return self.values[text]
        if text.endswith(".speed"):
            return self.speed(text.removesuffix(".speed"))
        return self.coordinate(text)

    def coordinate(self, coordinate: str) -> Any:
        first, *rest = self.plain(coordinate).split(".")
        if first in self.m.joints:
            return getattr(self.r.joints[first], rest[0])
        if rest == ["angle"]:
            return self.angle(first)
        position = self.at(f"{first}.{rest[0]}")
        return position.real if rest[1] == "x" else position.imag

    def angle(self, body: str) -> Any:
        return np.zeros(self.n) if body == "ground" else self.r.bodies[body].angle

    def spin(self, body: str) -> Any:
        return np.zeros(self.n) if body == "ground" else self.r.bodies[body].angular_velocity

    def at(self, point: str) -> np.ndarray:
        body, name = point.split(".")
        if body != "ground":
            return complex_(self.r.points[point].position)
        position = [self.number(x) for x in self.m.ground.points[name]]
        return np.full(self.n, complex(*position))

    def velocity(self, point: str) -> np.ndarray:
        if point.startswith("ground."):
            return np.zeros(self.n, complex)
        return complex_(self.r.points[point].velocity)

    def fastest(self) -> float:
        """Return the largest speed of a point."""
        return max(float(np.abs(complex_(p.velocity)).max()) for p in self.r.points.values())

    def plain(self, coordinate: str) -> str:
        """Return the coordinate of a body or joint that a vector's stands for."""
        loops = self.m.closure
        return loops.aliases.get(coordinate, coordinate) if loops else coordinate

    # -- actions -----------------------------------------------------------------------------------

    def act(self, body: str, force: Any, at: Any, turn: Any = 0.0) -> None:
        """Enter a force at a place and a moment, moments about the origin."""
        force = np.broadcast_to(force, self.n)
        self.force[body] = self.force[body] + force
        self.turn[body] = self.turn[body] + np.imag(np.conj(at) * force) + turn
        self.force_size = np.maximum(self.force_size, np.abs(force))
        self.turn_size = np.maximum(
            self.turn_size, np.maximum(np.abs(at) * np.abs(force), np.abs(turn))
        )

    def pair(self, joint: Any, force: Any, at: Any, turn: Any = 0.0) -> None:
        """Enter an action on the second body and the opposite on the first."""
        self.act(joint.second_body, force, at, turn)
        self.act(joint.first_body, -force, at, -turn)

    def along(self, coordinate: str, value: Any) -> None:
        """Enter a generalised force, positive along the growth of its coordinate."""
        first, *rest = self.plain(coordinate).split(".")
        if first in self.m.joints:
            joint = self.m.joints[first]
            if rest == ["angle"]:
                self.pair(joint, 0j, 0j, value)
            else:
                axis = np.exp(1j * (self.angle(joint.first_body) + self.values[f"{first}.axis"]))
                self.pair(joint, value * axis, self.at(joint.second))
        elif rest == ["angle"]:
            self.act(first, 0j, 0j, value)
        else:
            point = f"{first}.{rest[0]}"
            self.act(first, value * (1.0 if rest[1] == "x" else 1j), self.at(point))

    def speed(self, coordinate: str) -> np.ndarray:
        first, *rest = self.plain(coordinate).split(".")
        if first in self.m.joints:
            joint = self.m.joints[first]
            if rest == ["angle"]:
                return self.spin(joint.second_body) - self.spin(joint.first_body)
            return self.r.joints[first].slide_velocity
        if rest == ["angle"]:
            return self.spin(first)
        velocity = self.velocity(f"{first}.{rest[0]}")
        return velocity.real if rest[1] == "x" else velocity.imag

    # -- books -------------------------------------------------------------------------------------

    def loads(self) -> None:
        for load in self.m.loads.values():
            if isinstance(load, md.Force):
                body = load.point.split(".")[0]
                x, y = (self.number(x) for x in load.value)
                value = x + 1j * y
                frame = 0.0 if load.frame == "world" else self.angle(load.frame)
                self.act(body, value * np.exp(1j * frame), self.at(load.point))
            elif isinstance(load, md.Torque):
                self.act(load.body, 0j, 0j, self.number(load.value))
            elif isinstance(load, md.Resistance):
                speed = self.speed(load.coordinate)
                size = np.where(speed < 0, self.number(load.negative), -self.number(load.positive))
                self.along(load.coordinate, np.where(speed == 0, 0.0, size))
            elif isinstance(load, md.Spring) and load.between is not None:
                first, second = load.between
                line = self.at(second) - self.at(first)
                towards = line / np.abs(line)
                rate = np.real(np.conj(towards) * (self.velocity(second) - self.velocity(first)))
                tension = (
                    self.number(load.preload)
                    + self.number(load.stiffness) * (np.abs(line) - self.number(load.free_length))
                    + self.number(load.damping) * rate
                )
                self.act(second.split(".")[0], -tension * towards, self.at(second))
                self.act(first.split(".")[0], tension * towards, self.at(first))
            elif isinstance(load, md.Spring):
                stretch = self.coordinate(load.coordinate) - self.number(load.free_length)
                size = self.number(load.preload) + self.number(load.stiffness) * stretch
                size = size + self.number(load.damping) * self.speed(load.coordinate)
                self.along(load.coordinate, -size)
            else:
                x, y = np.array(load.points).T
                at = self.coordinate(load.coordinate)
                at = x[0] + np.mod(at - x[0], x[-1] - x[0]) if load.periodic else at
                size = self.number(load.factor) * np.interp(at, x, y)
                self.along(load.along or f"{load.body}.angle", size)

    def reactions(self) -> None:
        for name, joint in self.m.joints.items():
            reaction = self.r.joints[name].reaction
            force, turn = complex_(reaction), reaction[:, 2]
            if isinstance(joint, md.Belt) and getattr(joint, "radius", None) is None:
                ratio = self.values[f"{name}.ratio"] * (-1 if joint.crossed else 1)
                self.act(joint.second_body, force, self.at(joint.second), turn)
                self.act(joint.first_body, 0j, 0j, -turn / ratio)
                self.act(joint.carrier or "ground", 0j, 0j, turn / ratio - turn)
            else:
                self.pair(joint, force, self.at(joint.second), turn)
        for coordinate, effort in self.r.efforts.items():
            self.along(coordinate, effort)

    def inertia(self) -> None:
        gravity = complex(*(self.number(g) for g in self.m.gravity or GRAVITY_OFF))
        for name, body in self.m.bodies.items():
            if body.mass is None:
                continue
            mass, angle = self.number(body.mass), self.angle(name)
            local = complex(*(self.number(c) for c in body.center or (0.0, 0.0)))
            point, position = next(iter(body.points.items()))
            arm = (local - complex(*(self.number(x) for x in position))) * np.exp(1j * angle)
            place = self.at(f"{name}.{point}") + arm
            spin, growth = self.spin(name), self.r.bodies[name].angular_acceleration
            acceleration = complex_(self.r.points[f"{name}.{point}"].acceleration)
            acceleration = acceleration + (1j * growth - spin**2) * arm
            self.act(name, -mass * (acceleration - gravity), place)
            if body.inertia is not None:
                self.act(name, 0j, 0j, -self.number(body.inertia) * growth)

    def balance(self) -> float:
        """Return the largest share by which a body is not balanced."""
        self.loads()
        self.inertia()
        self.reactions()
        worst = 0.0
        for body in self.m.bodies:
            with np.errstate(invalid="ignore"):
                worst = max(
                    worst,
                    np.max(np.abs(self.force[body]) / np.maximum(self.force_size, 1e-300)),
                    np.max(np.abs(self.turn[body]) / np.maximum(self.turn_size, 1e-300)),
                )
        return float(worst)

    # -- laws --------------------------------------------------------------------------------------

    def growth(self, body: str) -> Any:
        return np.zeros(self.n) if body == "ground" else self.r.bodies[body].angular_acceleration

    def senses(self, joint: Any, spin: Any) -> tuple[Any, Any]:
        """Return the sense in which a joint turns, and the one that counts where it turns back.

        At a pose where the two bodies turn equally fast it is that of the motion that follows. A
        speed below its rounding may be such a pose or lie just before it: either sense holds.
        """
        both = (joint.second_body, joint.first_body)
        turned, grown = ([own(body) for body in both] for own in (self.spin, self.growth))
        change = grown[0] - grown[1]
        least = REVERSES * np.maximum(np.max(np.abs(grown), axis=0), np.max(np.abs(turned)) ** 2)
        follows = np.where(np.abs(change) > least, np.sign(change), 0.0)
        own = np.where(spin == 0, follows, np.sign(spin))
        reverses = np.abs(spin) <= REVERSES * np.max(np.abs(turned), axis=0)
        return own, np.where(reverses & (follows != 0), follows, own)

    def laws(self) -> float:
        """Return the largest share by which a reaction misses the law of its joint."""
        worst = 0.0
        for name, joint in self.m.joints.items():
            found = self.r.joints[name]
            force, turn = complex_(found.reaction), found.reaction[:, 2]
            f = self.values.get(f"{name}.friction", 0.0)
            lost = np.zeros(self.n)
            size = np.maximum(np.abs(force), 1e-300)
            spin = self.spin(joint.second_body) - self.spin(joint.first_body)
            if isinstance(joint, md.Revolute):
                radius = self.values.get(f"{name}.pin_radius", 0.0)
                rho = radius * f * (1 if self.radius == "article" else 1 / np.sqrt(1 + f * f))
                lost = rho * np.abs(force * spin)
                gaps = [turn + rho * np.abs(force) * own for own in self.senses(joint, spin)]
                gap = np.min(np.abs(gaps), axis=0) / size
                scale = size * np.abs(spin) * max(radius, 1e-300)
            elif isinstance(joint, md.Prismatic | md.PinInSlot):
                axis = np.exp(1j * (self.angle(joint.first_body) + self.values[f"{name}.axis"]))
                pressed, rub = np.imag(force * np.conj(axis)), np.real(force * np.conj(axis))
                speed, grip, moment = found.slide_velocity, np.abs(pressed), 0 * turn
                if isinstance(joint, md.PinInSlot):
                    radius = self.values.get(f"{name}.pin_radius", 0.0)
                    speed = speed + np.sign(pressed) * radius * spin
                    # the contact is beside the centre, to the right for a push to the left
                    moment = np.sign(pressed) * radius * rub - turn
                elif f"{name}.contact_length" in self.values:
                    half = self.values[f"{name}.contact_length"] / 2
                    grip = np.maximum(grip, np.abs(turn) / half)
                size = np.maximum(size, grip)
                lost = f * grip * np.abs(speed)
                if np.abs(speed).max() < 1e-12 * self.fastest():  # at rest: no law to hold
                    lost, speed, gap = 0 * lost, self.fastest(), np.zeros(self.n)
                else:
                    gap = np.abs(rub + f * grip * np.sign(speed)) / size
                gap = np.maximum(gap, np.abs(moment) / size)
                gap = np.maximum(gap, np.abs(found.normal - pressed) / size)
                scale = size * np.abs(speed)
            elif isinstance(joint, md.Distance):
                line = self.at(joint.second) - self.at(joint.first)
                gap = np.abs(np.imag(np.conj(line) * force)) / np.abs(line) / size
                gap = np.maximum(gap, np.abs(turn) / size / np.abs(line))
                scale = size
            else:
                continue
            worst = max(worst, float(np.max(np.abs(gap))))
            if "loss" in found:
                missed = np.abs(found.loss - lost) / np.maximum(scale, 1e-300)
                worst = max(worst, float(np.max(missed)))
        return worst


def audit(mechanism: md.Mechanism, result: md.Result, radius: str = "exact") -> tuple[float, float]:
    """Return how far balance and laws are missed."""
    return Audit(mechanism, result, radius).balance(), Audit(mechanism, result, radius).laws()
