"""Friction loss of a batch over the span of its crank, to first order, in closed form.

Reactions are those without friction, dyad by dyad from the last one back to the crank; each pin
loses r sin(atan f) |R| |omega|, each guide f |N| |v|. The mean over the angles is for one radian
per second. What is reported of a design is computed again, with friction that acts on reactions.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.parts.types.described.composition import CompositionDemand
from mechdae.parts.types.schemes.aims import ANGLE, SLIDE, Aim
from mechdae.parts.types.schemes.closure import Moved, turned, turning
from mechdae.parts.types.schemes.scheme import DYAD, SLIDER, SWING, Scheme, output_points
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Matrix

ANGLES = 48
"""Crank angles over which a mean is taken; of less than a turn half as many."""
STEP = 1e-6
"""Of central differences, in the aim's unit of lengths."""


@dataclass(frozen=True)
class LossAsked:
    """Friction and load of a task.

    ``pin_radius``: of all pins [m]. ``load``: force (x, y) on the tracing point [N]; or the size of
    what resists the output [N m or N].
    """

    friction: float
    pin_radius: float
    load: tuple[float, ...]

    @property
    def arm(self) -> float:
        """Arm of the friction in a pin [m]."""
        return float(self.pin_radius * np.sin(np.arctan(self.friction)))


def rubbing_of(demand: CompositionDemand) -> LossAsked | None:
    """Return friction and load of a task, None where no loss is asked for."""
    return None if demand.rubbing is None else LossAsked(*demand.rubbing)


def cross(a: Complexes, b: Complexes) -> Matrix:
    """Return the cross product of vectors as complex numbers."""
    return (np.conj(a) * b).imag


class _Statics:
    """Forces on the links of a batch, and what is lost by them.

    `x`, `v` (n, b, t): places and velocities of the points.
    """

    def __init__(
        self, scheme: Scheme, x: Complexes, v: Complexes, aim: Aim, rubbing: LossAsked
    ) -> None:
        self.scheme, self.x, self.v = scheme, x, v
        self.aim, self.rubbing = aim, rubbing
        shape = (len(scheme.links), *x.shape[1:])
        self.force = np.zeros(shape, complex)
        self.moment = np.zeros(shape)
        self.lost = np.zeros(x.shape[1:])
        self.block = np.zeros(x.shape[1:], complex)
        self.speeds = self._speeds()

    def _speeds(self) -> Floats:
        """Return the angular velocities (links, b, t)."""
        found = np.zeros(self.force.shape)
        for number, link in enumerate(self.scheme.links):
            if number and len(link) > 1:
                i, k = link[:2]
                found[number] = ((self.v[k] - self.v[i]) / (self.x[k] - self.x[i])).imag
        for _, guide, block in self.scheme.slides:
            found[block] = found[guide]
        return found

    def load(self) -> None:
        """Put the load on the link that traces, or against the output's motion."""
        scheme, load = self.scheme, self.rubbing.load
        if self.aim.what == ANGLE:
            pair = output_points(scheme)
            link = next(k for k, link in enumerate(scheme.links) if link[:2] == pair)
            self.moment[link] -= load[0] / self.aim.radius * np.sign(self.speeds[link])
        elif self.aim.what == SLIDE:
            speed = self.v[scheme.trace]
            with np.errstate(invalid="ignore", divide="ignore"):
                self.block = -load[0] * np.nan_to_num(speed / np.abs(speed))
        else:
            link = scheme.links_at(scheme.trace)[0]
            self._push(link, np.full(self.x.shape[1:], complex(*load)), scheme.trace)

    def _push(self, link: int, force: Complexes, point: int) -> None:
        """Add a force on a link, with its moment about the origin."""
        self.force[link] += force
        self.moment[link] += cross(self.x[point], force)

    def _pin(self, one: int, other: int, force: Complexes) -> None:
        self.lost += (
            self.rubbing.arm * np.abs(force) * np.abs(self.speeds[one] - self.speeds[other])
        )

    def _guide(self, normal: Matrix, speed: Matrix) -> None:
        self.lost += self.rubbing.friction * self.aim.radius * np.abs(normal) * np.abs(speed)

    def about(self, link: int, point: int) -> Any:
        """Return the moment of what acts on a link about a point."""
        return self.moment[link] - cross(self.x[point], self.force[link])

    def run(self) -> Matrix:
        """Return the losses (b, t)."""
        self.load()
        number = len(self.scheme.links)
        for k in range(self.scheme.size - 1, -1, -1):
            kind, i, j = self.scheme.points[k]
            if kind not in (DYAD, SLIDER, SWING):
                continue
            number -= 2
            {DYAD: self._bars, SLIDER: self._slider, SWING: self._swing}[kind](k, i, j, number)
        self._pin(0, 1, self.force[1])
        return self.lost

    def _hold(self, link: int, force: Complexes, point: int) -> None:
        """Take the reaction on a link at a point from the one before it."""
        hub = self.scheme.links_at(point)[0]
        self._pin(hub, link, force)
        self._push(hub, -force, point)

    def _bars(self, k: int, i: int, j: int, link: int) -> None:
        a, b = self.x[i] - self.x[k], self.x[j] - self.x[k]
        whole = -(self.force[link] + self.force[link + 1])
        one = -self.about(link, k)
        other = cross(b, whole) + self.about(link + 1, k)
        first = (one * b - other * a) / cross(a, b)
        self._pin(link, link + 1, first + self.force[link])
        self._hold(link, first, i)
        self._hold(link + 1, whole - first, j)

    def _slider(self, k: int, i: int, j: int, link: int) -> None:
        moved = Moved(self.x[:, :, :1], self.x)
        way = (self.x[k, :, :1] - self.x[j, :, :1]) * turning(self.scheme, moved, j)
        way = way / np.abs(way)
        a, along = self.x[i] - self.x[k], self.block if k == self.scheme.trace else 0.0
        across = self.about(link, k) - cross(a, self.force[link] + along)
        normal = across / cross(a, 1j * way)
        pressed = normal * 1j * way
        self._pin(link, link + 1, pressed + along)
        guide = self.scheme.links_at(j)[0]
        spin = 1j * self.speeds[guide] * (self.x[k] - self.x[j])
        self._guide(normal, ((self.v[k] - self.v[j] - spin) * np.conj(way)).real)
        self._hold(link, -self.force[link] - pressed - along, i)
        self._push(guide, -pressed, k)

    def _swing(self, k: int, i: int, j: int, link: int) -> None:
        arm = (self.x[k] - self.x[i]) / (self.x[k, :, :1] - self.x[i, :, :1])
        way = (self.x[j, :, :1] - self.x[k, :, :1]) * arm
        way = way / np.abs(way)
        gap = self.x[j] - self.x[i]
        normal = -self.about(link, i) / cross(gap, 1j * way)
        pressed = normal * 1j * way
        spin = 1j * self.speeds[link] * gap
        self._guide(normal, ((self.v[j] - self.v[i] - spin) * np.conj(way)).real)
        self._hold(link + 1, pressed, j)
        self._hold(link, -self.force[link] - pressed, i)


def losses(
    scheme: Scheme, places: Complexes, aim: Aim, rubbing: LossAsked, count: int = ANGLES
) -> Any:
    """Return the mean losses (b,) [W] of sets of places (b, n) at one radian per second."""
    angles = aim.nodes(count if aim.turns else count // 2 + 1)
    if not aim.turns:
        angles = np.append(0.0, angles[len(aim.angles) :])
    elif aim.angles:
        angles = angles[len(aim.angles) :]
    turn = turned(scheme, places, angles, derivatives=True, by_angle=True, dimensions=False)
    assert turn.every is not None
    shape = turn.x.shape[1:]
    rates = np.stack([np.broadcast_to(rates[:, :, 0], shape) for rates in turn.every])
    first = 0 if aim.turns else 1  # the pose of the places alone is in no mean
    with np.errstate(invalid="ignore", divide="ignore"):
        lost = _Statics(scheme, turn.x, rates, aim, rubbing).run()
    return np.nan_to_num(lost[:, first:].mean(axis=1), nan=np.inf)


def loss_slopes(scheme: Scheme, places: Complexes, aim: Aim, rubbing: LossAsked) -> Any:
    """Return derivatives (b, p) of losses by central differences of their closed form."""
    count, size = len(places), 2 * (scheme.size - 1)
    moved = np.repeat(np.asarray(places, complex)[:, None], 2 * size, axis=1)
    for column in range(size):
        step = STEP * (1j if column % 2 else 1.0)
        moved[:, 2 * column, 1 + column // 2] += step
        moved[:, 2 * column + 1, 1 + column // 2] -= step
    found = losses(scheme, moved.reshape(-1, scheme.size), aim, rubbing)
    found = found.reshape(count, size, 2)
    with np.errstate(invalid="ignore"):
        return np.nan_to_num((found[:, :, 0] - found[:, :, 1]) / (2 * STEP), posinf=0, neginf=0)
