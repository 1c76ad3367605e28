"""The numbers a scene is evaluated with: parameters, bounds, direction of the path."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import PLACE, UNIT
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.mechanism import GROUND, Body, Ground
from mechdae.equations.model import Model
from mechdae.equations.reduction import Scene
from mechdae.kernels.bounds.walk import ROUNDOFF
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.types import Floats, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.equations.cases.curve_contacts import Contact

BOXES = 64
"""Parts of the curves for which bounds are computed apart."""
WIDEST = 1.25
"""Bound of the components of unit quaternions: 1, and what a step may look beyond it."""
MARGIN = 0.1
"""Share of an open curve's range by which a step may look beyond its ends."""


class Constants:
    """Parameter values and the bounds of `Graphs.constants` for one sweep.

    Attributes
    ----------
    p : (np,) array
    scale : float
        A length of the mechanism [m], the largest distance between points of one body.
    kappa, rho, mu : arrays
        See `Graphs.constants`.
    floors : array
        Least sizes of what curves divide by.
    estimated : bool
        Whether the bounds rest on sizes measured along the path (`measured`), or take the
        pieces of a curve to join smoothly.
    """

    floors: Floats
    measured: bool
    kappa: Floats
    rho: Floats
    mu: Floats

    def __init__(
        self,
        graphs: Graphs,
        size_u: Floats,
        size_x: Floats | None = None,
        measured: Floats | None = None,
        p: Floats | None = None,
    ) -> None:
        self.graphs = graphs
        self.p: Floats = graphs.scene.model.p_values if p is None else np.asarray(p, float)
        self.scale: float = graphs.scene.model.mechanism.scale
        angle = graphs.scene.unknowns.turns
        if size_x is None:
            turned = np.array([c.is_angle for c in graphs.scene.drivers], bool)
            largest = float(np.max(np.abs(size_u) * turned, initial=0.0))
            size_x = np.where(angle, 4 * np.pi + 2 * largest, 10 * self.scale)
            size_x[graphs.scene.unknowns.of_kind(UNIT)] = WIDEST
            for i, contact in own_parameters(graphs.scene).items():
                turned_by = (4 * np.pi + 2 * largest) if contact.closed else 0.2 * np.pi
                size_x[i] = max(map(abs, contact.range)) + turned_by * contact.unit
        self.size_x: Floats = np.asarray(size_x, float)
        self.size_u: Floats = np.abs(np.asarray(size_u, float))
        self.boxes: tuple[Floats, Floats] = boxes_of(graphs)
        self.floors, self.measured = self._floors(measured)
        self.estimated: bool = self.measured or (bool(graphs.contacts) and graphs.floors.pieces)
        sizes = (self.size_x, self.size_u, self.p)
        if graphs.contacts:
            values = graphs.constants(*sizes, self.scale, self.floors, *self.boxes)
            self.kappa, self.rho, self.mu = (np.array(value).max(axis=1) for value in values)
        else:
            call: Call = graphs.cache("constants", lambda: Call(graphs.constants))
            boxes = (part.ravel() for part in self.boxes)
            self.kappa, self.rho, self.mu = call(*sizes, self.scale, self.floors, *boxes)

    def _floors(self, measured: Floats | None) -> tuple[Floats, bool]:
        """Return the floors, and whether they had to be measured."""
        graphs = self.graphs
        if not graphs.contacts:
            return np.zeros(0), False
        floors = np.zeros(graphs.floor.numel())
        sizes = (self.size_x, self.size_u, self.p)
        least = np.array(graphs.divisors[1](*sizes, *self.boxes)).min(axis=1, initial=np.inf)
        proved = bool(np.all(least > 0))
        floors[: len(least)] = least if proved or measured is None else measured / 2
        return floors, not proved

    @cached_property
    def consts(self) -> Floats:
        """The input ``consts`` of the kernels; not to be written into."""
        grain = ROUNDOFF * self.size_x
        return np.concatenate([self.p, [self.scale], self.kappa, self.rho, grain, self.floors])


def boxes_of(graphs: Graphs) -> tuple[Floats, Floats]:
    """Return boxes of the contacts' places, (nc, k) lower and upper bounds, all ranges in all.

    A bound over a whole curve at once is wide; the largest of those over its parts is not.
    """
    contacts = own_parameters(graphs.scene)
    count = max(1, round(BOXES ** (1 / max(len(graphs.places), 1)))) if graphs.enclosed else 1
    lows, highs = [], []
    for i in graphs.places:
        low, high = contacts[i].range
        beyond = 0.0 if contacts[i].closed else MARGIN * (high - low)
        edges = np.linspace(low - beyond, high + beyond, count + 1)
        lows.append(edges[:-1])
        highs.append(edges[1:])
    if not lows:
        return np.zeros((0, 1)), np.zeros((0, 1))
    corners = [np.array(np.meshgrid(*sides)).reshape(len(lows), -1) for sides in (lows, highs)]
    return corners[0], corners[1]


def divisors(graphs: Graphs, x: Unknowns, u: Floats) -> Any:
    """Return the least sizes (nd,) at poses x (n, nx), u (n, nu) of what curves divide by."""
    if not graphs.contacts:
        return np.zeros(0)
    values = np.array(graphs.divisors[0](x.T, u.T, graphs.scene.model.p_values[:, None]))
    return np.nanmin(values, axis=1, initial=np.inf)


def own_parameters(scene: Scene) -> dict[int, Contact]:
    """Return the unknowns that are places on a curve, with their joints."""
    contacts = scene.model.contacts
    return {i: contacts[c.owner] for i, c in enumerate(scene.unknowns) if c.kind is PLACE}


def driver_size(model: Model, c: NamedCoordinate, scale: float) -> float:
    """Return the size of a driven coordinate: 1 rad, a length, the range of s over 2 pi."""
    if c.on_curve:
        return model.contacts[c.part].unit
    return 1.0 if c.is_angle else scale


def scale_of(model: Model) -> Sym:
    """Return `Mechanism.scale` of a planar mechanism without curves over the parameters."""
    mechanism = model.mechanism
    spans = [ca.SX(0)]
    parts: list[tuple[str, Body | Ground]] = [(GROUND, mechanism.ground), *mechanism.bodies.items()]
    for name, body in parts:
        for axis in mechanism.axes if len(body.points) > 1 else "":
            places = [ca.SX(model.numbers[f"{name}.{point}.{axis}"]) for point in body.points]
            spans.append(ca.mmax(ca.vertcat(*places)) - ca.mmin(ca.vertcat(*places)))
    for name, joint in mechanism.joints.items():
        if joint.bar:
            spans.append(ca.SX(model.numbers[f"{name}.length"]))
    largest = ca.mmax(ca.vertcat(*spans))
    return ca.if_else(largest == 0, 1.0, largest)
