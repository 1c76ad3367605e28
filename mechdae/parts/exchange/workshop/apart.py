"""Which plates are proved apart over a whole motion; others need layers of their own.

Between two places of the path Newton-Kantorovich encloses the motion (the tube of a certified
step): no unknown leaves its tangent by more than a bound. With bounds of the derivatives of
points and angles that says how far a plate gets within the step, so a gap that is larger at its
beginning is one throughout. Where it is not, the step is halved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.describe import GROUND
from mechdae.describe.layers import Layers, LinksCrossing, fewest_layers
from mechdae.describe.units import shown
from mechdae.errors import InputError, UnavailableError
from mechdae.kernels.bounds.walk import majorant
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.run.functions import Call
from mechdae.numerics.polygons import polygon_gaps
from mechdae.parts.exchange.workshop.outlines import turned
from mechdae.parts.exchange.workshop.plates import RING, Kit, Plate
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Points

if TYPE_CHECKING:
    from mechdae.describe.values import Table

FIRST = 256
"""Steps that the motion is divided into at first."""
HALVINGS = 40
MOST = 60_000
"""Steps at once at most."""
OFF = 1e-6
"""Share of the driver's range that is left out at a limit position, where no tube is proved."""


@dataclass(frozen=True)
class PlateShape:
    """Circles of radius `radius` around corners of a body and all between them.

    ``corners`` (k, 2) are from the reference point, in the frame of the body. Of a ring there is
    nothing within ``free`` of its centre, the only corner.
    """

    name: str
    body: str | None
    reference: str
    corners: Points
    radius: float
    end: str | None = None
    free: float = 0.0


@dataclass(frozen=True)
class Meeting:
    """Two shapes that are not proved apart: the least gap met and at which value of the driver."""

    one: str
    other: str
    gap: float
    at: str


class Motions:
    """The motion of shapes along a certified path of one driver."""

    def __init__(self, motion: ExportedMotion) -> None:
        self.setting, self.run = motion.single("a set of parts")
        graphs, self.path, evaluator = self.setting.graphs, self.run.path, self.run.evaluator
        if graphs.contacts or any(not graphs.plain(b) for b in range(graphs.nb)):
            raise UnavailableError("parts of mechanisms with curves are not made")
        self.graphs, self.evaluator = graphs, evaluator
        self.values: Table[float] = motion.mechanism.values()
        self.columns: dict[tuple[str, str], list[int]] = {
            (entry.kind, entry.part): list(entry.columns)
            for entry in self.setting.outputs.entries
            if entry.name in ("position", "angle") and entry.kind in ("points", "bodies")
        }
        good = np.asarray(self.run.values, float).ravel()[motion.rows]
        self.low, self.high = float(np.min(good)), float(np.max(good))
        first, last = motion.rows[0], motion.rows[-1]
        gap = sorted(set(range(first, last)) - set(motion.rows))
        if gap:
            raise UnavailableError(
                f"parts are made of one motion, and pose {gap[0]} between its poses is "
                f"{motion.result.status[gap[0]]}",
                where=f"tasks.{motion.task}",
                hint='driver = { coordinate = ..., range = "assembled" }, or ends within it',
            )
        if self.low == self.high:
            raise InputError(
                "parts are made of a motion, and the task has one pose that assembles",
                where=f"tasks.{motion.task}",
                hint="a task of kind sweep with driver = { coordinate = ..., from_deg, to_deg }",
            )
        if "limit" in {str(status) for status in motion.result.status}:
            off = OFF * (self.high - self.low)
            self.low, self.high = self.low + off, self.high - off

    def place(self, value: float) -> str:
        """Return a value of the driver with its unit."""
        return shown(self.setting.plan.coordinates[0].unit, value)

    def steps(self, begin: Floats, length: float) -> tuple[Floats, Floats]:
        """Return outputs (n, ny) at steps' begins, how far each may change in its step (n, ny).

        Not finite where a step is not proved.
        """
        poses = self.evaluator.at(self.path, begin)
        x = np.asarray(poses.x, float).reshape(len(begin), -1).T
        u = np.asarray(self.path.drivers(begin), float).T
        du = np.asarray(self.path.rates(begin, 1)[0], float).T
        consts = np.repeat(np.reshape(self.path.constants.consts, (-1, 1)), len(begin), axis=1)
        rate, away, still = np.zeros_like(x), np.zeros_like(x), np.zeros_like(du)
        good = np.ones(len(begin), bool)
        for block, along, tube in self._blocks:
            _, first, _, beta, _ = (np.asarray(a) for a in along(x, u, rate, du, consts))
            rate[block.own] = first
            away[block.own] = np.abs(first) * length
            numbers = np.vstack([beta, np.full((1, len(begin)), length)])
            found = tube(x, rate, away, u, du, still, numbers, consts)
            test, _, reach = (np.asarray(a) for a in found)
            away[block.own] = reach
            good &= (test[0] <= 1) & np.isfinite(reach).all(axis=0)
        moved = np.vstack([np.abs(rate) * length + away, np.abs(du) * length])
        moved[:, ~good] = 0.0
        changes = (self._slopes @ moved).T
        changes[~good] = np.inf
        return np.asarray(poses.y[0], float), changes

    @cached_property
    def _blocks(self) -> list[tuple[BlockGraph, ca.Function, ca.Function]]:
        """The blocks, each with its derivative along the path and its tube."""
        graphs = self.graphs
        return [(block, graphs.along(b), graphs.tube(b)) for b, block in enumerate(graphs.blocks)]

    @cached_property
    def _slopes(self) -> Floats:
        """Bounds of the derivatives of outputs by unknowns and drivers, (ny, nx + nu)."""
        graphs, scene = self.graphs, self.graphs.scene
        sizes = [ca.SX.sym("size_x", graphs.nx), ca.SX.sym("size_u", graphs.nu)]
        every = ca.vertcat(scene.x, scene.u)
        slope = ca.densify(ca.jacobian(self.setting.outputs.expression, every))
        bound, _ = majorant(slope, [scene.x, scene.u], sizes)
        call = Call(ca.Function("slopes", [*sizes, graphs.p], [ca.densify(bound)]))
        size_x, size_u = self.path.sizes()
        (found,) = call(1.01 * size_x, 1.01 * size_u, self.path.constants.p)
        return np.asarray(found, float).reshape(slope.shape[::-1]).T

    # -- places of shapes ------------------------------------------------------------------

    def corners(self, shape: PlateShape, y: Floats) -> Points:
        """Return the corners of a shape, (n, k, 2), for outputs (n, ny)."""
        place, turn = self._frame(shape, y)
        return place[:, None, :] + shape.corners @ turned(-turn)

    def _frame(self, shape: PlateShape, y: Floats) -> tuple[Points, Floats]:
        place = self._point(shape.reference, y)
        if shape.body is None:
            assert shape.end is not None
            way = self._point(shape.end, y) - place
            return place, np.arctan2(way[:, 1], way[:, 0])
        columns = self.columns.get(("bodies", shape.body))
        return place, y[:, columns[0]] if columns else np.zeros(len(y))

    def _point(self, reference: str, y: Floats) -> Points:
        columns = self.columns.get(("points", reference))
        if columns is None:
            here = [self.values[f"{reference}.{axis}"] for axis in "xy"]
            return np.tile(here, (len(y), 1))
        return y[:, columns]

    def placed(self, kit: Kit, row: int) -> dict[str, tuple[Floats, float]]:
        """Return origin and angle of each plate that moves, in a pose of the task."""
        y = np.asarray(self.run.poses.y[0], float)[[row]]
        found = {}
        for name in kit.moving:
            plate = kit.plates[name]
            place, turn = self._frame(self.shape(plate, 0.0), y)
            angle = float(turn[0])
            found[name] = place[0] - turned(angle) @ self.origin(plate), angle
        return found

    def shape(self, plate: Plate, width: float) -> PlateShape:
        """Return the shape of a plate of a width."""
        radius = plate.outline(width).radius
        if plate.body is None:
            assert plate.ends is not None
            first, second = plate.ends
            return PlateShape(plate.name, None, first, plate.corners, radius, second)
        corners = plate.corners - self.origin(plate)
        free = plate.teeth.low if plate.teeth and plate.teeth.inside else 0.0
        reference = self._reference(plate.body)
        return PlateShape(plate.name, plate.body, reference, corners, radius, None, free)

    def origin(self, plate: Plate) -> Floats:
        """Return the place of a plate's reference point in its frame."""
        if plate.body is None:
            return np.zeros(2)
        return np.array([self.values[f"{self._reference(plate.body)}.{axis}"] for axis in "xy"])

    def _reference(self, body: str) -> str:
        """Return a point of a body."""
        points = [name[:-2] for name in self.values if name.startswith(f"{body}.")]
        return next(p for p in points if body == GROUND or ("points", p) in self.columns)

    def travel(self, shape: PlateShape, changes: Floats) -> Floats:
        """Return how far any point of a shape gets at most in the steps, (n,)."""
        ends = [self.columns.get(("points", r)) for r in (shape.reference, shape.end) if r]
        ways = [np.hypot(changes[:, xy[0]], changes[:, xy[1]]) for xy in ends if xy]
        moved = np.max(ways, axis=0) if ways else np.zeros(len(changes))
        columns = self.columns.get(("bodies", shape.body or ""))
        if columns:
            far = float(np.hypot(*shape.corners.T).max(initial=0.0))
            moved = moved + (far * changes[:, columns[0]] if far else 0.0)
        return moved


def meetings(
    motions: Motions, pairs: list[tuple[PlateShape, PlateShape]], air: float
) -> list[Meeting]:
    """Return the pairs whose distance is not proved above zero, or falls below `air`."""
    edges = np.linspace(motions.low, motions.high, FIRST + 1)
    begin, length = edges[:-1], float(edges[1] - edges[0])
    left = {k: np.ones(len(begin), bool) for k in range(len(pairs))}
    found: dict[int, Meeting] = {}
    for _ in range(HALVINGS):
        y, changes = motions.steps(begin, length)
        for k, rows in list(left.items()):
            one, other = pairs[k]
            gaps = _gaps(motions, one, other, y[rows])
            least = int(np.nanargmin(gaps)) if np.isfinite(gaps).any() else 0
            if not np.isfinite(gaps).all() or gaps[least] < air:
                at = motions.place(float(begin[rows][least]))
                found[k] = Meeting(one.name, other.name, float(gaps[least]), at)
            reach = sum(motions.travel(shape, changes[rows]) for shape in (one, other))
            open_rows = rows.copy()
            open_rows[rows] = ~(gaps > reach)
            left[k] = open_rows
            if k in found or not open_rows.any():
                del left[k]
        if not left:
            break
        wanted = np.any(list(left.values()), axis=0)
        if 2 * np.count_nonzero(wanted) > MOST:
            break
        length /= 2
        begin = np.concatenate([begin[wanted], begin[wanted] + length])
        left = {k: np.tile(rows[wanted], 2) for k, rows in left.items()}
    for k, rows in left.items():
        one, other = pairs[k]
        found[k] = Meeting(one.name, other.name, float("nan"), motions.place(float(begin[rows][0])))
    return [found[k] for k in sorted(found)]


def _gaps(motions: Motions, one: PlateShape, other: PlateShape, y: Floats) -> Floats:
    a, b = motions.corners(one, y), motions.corners(other, y)
    found = polygon_gaps(a, b) - one.radius - other.radius
    for ring, centre, shape, corners in ((one, a, other, b), (other, b, one, a)):
        if ring.free:
            far = np.hypot(*(corners - centre).transpose(2, 0, 1)).max(axis=1)
            found = np.maximum(found, ring.free - far - shape.radius)
    return found


def pairs_of(motions: Motions, kit: Kit) -> list[tuple[PlateShape, PlateShape]]:
    """Return pairs of plates without a common pin or teeth, and of plates with others' pins.

    Pins are as wide as their spacers.
    """
    plates = {name: motions.shape(kit.plates[name], kit.sizes.width) for name in kit.moving}
    pins = {}
    for name, (_, second) in kit.pins.items():
        plate = kit.plates[second]
        corners = (plate.holes[name] - motions.origin(plate))[None]
        whole, radius = motions.shape(plate, 0.0), RING * kit.sizes.pin / 2
        pins[name] = replace(whole, name=name, corners=corners, radius=radius, free=0.0)
    joined = [set(both) for both in (*kit.pins.values(), *(mesh[:2] for mesh in kit.meshes))]
    apart = [(plates[a], plates[b]) for a, b in combinations(plates, 2) if {a, b} not in joined]
    over = [
        (plates[name], pins[pin])
        for shaft in kit.shafts
        for pin in shaft
        for name in plates
        if name not in kit.on_shaft(shaft)
    ]
    return apart + over


@dataclass(frozen=True)
class Stack:
    """Layers of all plates, with what keeps two of them out of the same one.

    Attributes
    ----------
    layers
        Layer of each plate that moves; the frame is in layer 0 and, with ``front``, in the last.
    shafts
        Pins that are one piece.
    pins
        First and last layer of each piece, by its first pin.
    spacers
        Rings of each pin between its plates: the layers that they fill.
    meetings
        Plates, and plates and pins of others, that are not proved apart over the motion.
    """

    layers: dict[str, int]
    shafts: list[list[str]]
    pins: dict[str, tuple[int, int]]
    spacers: dict[str, list[int]]
    front: int | None
    meetings: list[Meeting]


def stacked(motions: Motions, kit: Kit) -> Stack:
    """Return layers in which no part meets another one over the whole motion.

    Raises
    ------
    UnavailableError
        No order of layers lets all plates pass; with a pair that meets.
    """
    met = meetings(motions, pairs_of(motions, kit), kit.sizes.air)
    train = kit.trains()
    links = [(train[m.one], train[m.other]) for m in met if m.other in kit.plates]
    crossed = frozenset(map(frozenset, links))
    passed = frozenset((train[m.one], m.other) for m in met if m.other in kit.pins)
    pairs = {pin: (train[first], train[second]) for pin, (first, second) in kit.pins.items()}
    for meeting in met:
        if meeting.other in kit.plates and train[meeting.one] == train[meeting.other]:
            raise UnavailableError(
                f"{meeting.one} and {meeting.other} meet in the layer of their teeth",
                where="bodies",
                hint=f"gap {meeting.gap * 1e3:.4g} mm at {meeting.at}",
            )
    names = tuple(dict.fromkeys(train[name] for name in kit.moving))
    found = fewest_layers(pairs, {}, LinksCrossing(names, crossed, passed))
    if isinstance(found, str):
        worst = next((m for m in met if m.other in kit.pins), None)
        hint = f"{worst.one} passes over {worst.other}" if worst else ""
        raise UnavailableError(found, where="bodies", hint=hint)
    return _stack(kit, found, met)


def _stack(kit: Kit, found: Layers, met: list[Meeting]) -> Stack:
    train = kit.trains()
    layers = {name: found.spans[train[name]][0] for name in kit.moving}
    top = max(layers.values())
    pieces = [piece for pins in kit.shafts for piece in _pieces(pins, found)]
    shafts: dict[str, tuple[int, int]] = {}
    spacers: dict[str, list[int]] = {}
    for pins in pieces:
        name = pins[0]
        first = min(found.pins[pin][0] for pin in pins)
        last = max(found.pins[pin][1] for pin in pins)
        held = {layers[plate] for plate in kit.on_shaft(pins) if plate != GROUND}
        shafts[name] = first, last
        inside = [layer for layer in range(first + 1, last) if layer not in held]
        if inside:
            spacers[name] = inside
    front = top + 1 if any(last > top for _, last in shafts.values()) else None
    return Stack(layers, pieces, shafts, spacers, front, met)


def _pieces(pins: list[str], found: Layers) -> list[list[str]]:
    """Return the pins of a shaft that reach into each other's layers, by pieces."""
    pieces: list[tuple[int, list[str]]] = []
    for pin in sorted(pins, key=lambda pin: found.pins[pin]):
        first, last = found.pins[pin]
        if pieces and first <= pieces[-1][0]:
            end, known = pieces.pop()
            pieces.append((max(end, last), [*known, pin]))
        else:
            pieces.append((last, [pin]))
    return [sorted(piece, key=pins.index) for _, piece in pieces]
