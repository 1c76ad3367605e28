"""The symbolic model of a mechanism: q, p, Phi(q, u; p) = 0 and its derivatives.

Every number of the mechanism is an entry of p. A number written as an expression enters
the residuals as that expression over named parameters; a literal zero enters as zero, so
that a term it multiplies costs nothing, and becomes a symbol when the caller frees it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

import mechdae
from mechdae.additions import of_cases
from mechdae.describe.coordinates import NamedCoordinate, Selection
from mechdae.describe.expression import build
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.equations.coordinates import Coordinates, Frame, fixed_frame, planar_frame
from mechdae.equations.gradients import gradients
from mechdae.equations.joints import Ends, rows_of
from mechdae.equations.space import PLANE
from mechdae.equations.structure_cache import StructureCache, structure_property
from mechdae.records import dataclass
from mechdae.types import Floats, Integers, Sym

if TYPE_CHECKING:
    from mechdae.equations.cases.curve_contacts import Contact

SX = ca.SX
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{
        name: getattr(ca, name)
        for name in "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt sign".split()
    },
    "abs": ca.fabs,
    "min": ca.fmin,
    "max": ca.fmax,
    "hypot": lambda x, y: ca.sqrt(x * x + y * y),
}


@dataclass(frozen=True)
class Row:
    """One scalar equation: the joint or driver it belongs to, its part and unit.

    ``reach`` is what bounds of an equation in space are made of, where it is known.
    """

    owner: str
    part: str
    expression: Sym
    unit: str
    driver: bool = False
    reach: Any = None

    @property
    def name(self) -> str:
        return f"{self.owner}.{self.part}"


Quantity = tuple[str, Sym, Sequence[object]]
"""A word, an expression, and the reaches of its entries where they are known."""
Reported = tuple[str, str, Quantity, tuple[str, ...]]
"""What is reported: kind, part, quantity and the bodies that it depends on."""


TRAITS = {*filter(None, mechdae.CASES.values())}
"""Traits of joints that cases are about."""


def joint_traits(joints: Collection[Joint]) -> frozenset[str]:
    """Return what only some joints have and some of these do, as cases are asked about it."""
    given = ((t, getattr(joint, t, None)) for joint in joints for t in TRAITS)
    return frozenset(t for t, value in given if value is not None and value is not False)


class Model:
    """Symbols and equations of one mechanism.

    Parameters
    ----------
    mechanism
        The description.
    frames
        Makes the frame of a body; the planar (x, y, theta) by default.
    free
        Names of numbers that must stay symbols even where they are a literal zero.

    Attributes
    ----------
    p, p_names, p_values : SX (np,), list, array
        Parameters, their names and values [SI, rad].
    coordinates : Coordinates
        Those of all bodies in declared order, then those of the joints that have their own: see
        `contacts`.
    q, q_names : SX (nq,), list of (owner, name)
        Their symbols and keys.
    space : Space
        What is planar.
    contacts : dict
        Curve joints in symbols, by name.
    rows : list of Row
        Joint equations, without drivers.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        frames: Callable[[str], Frame] = planar_frame,
        free: Iterable[str] = (),
    ) -> None:
        self.mechanism: Mechanism = mechanism
        self.cache: StructureCache = StructureCache()
        self._free = set(free)
        self._make_parameters()
        self._anchors: dict[str, str] = {}
        # pins on the ground first: they stay where they are to the last bit
        joints = sorted(mechanism.joints.values(), key=lambda j: GROUND not in j.bodies)
        for joint in joints:
            for side in (joint.first, joint.second):
                body, point = side.split(".")
                if body != GROUND:
                    self._anchors.setdefault(body, point)
        self._frames = {name: frames(name) for name in mechanism.bodies}
        self._frames[GROUND] = fixed_frame(mechanism.dimension)
        self.space = PLANE
        self.contacts: dict[str, Contact] = self._contacts()
        parts = [self._frames[name].coordinates for name in mechanism.bodies]
        parts += [contact.coordinates for contact in self.contacts.values()]
        self.coordinates: Coordinates = Coordinates(itertools.chain(*parts))
        self.q_names: list[tuple[str, str]] = self.coordinates.keys
        self.q: Sym = ca.vertcat(*[c.symbol for c in self.coordinates])
        self._of_symbol = {c.symbol.element_hash(): c for c in self.coordinates}
        self.ends: dict[str, Ends] = {
            name: Ends(joint, self.frame, self.point, self.numbers, self.contacts.get(name))
            for name, joint in mechanism.joints.items()
        }
        self.rows: list[Row] = [
            Row(name, *row) for name, ends in self.ends.items() for row in rows_of(ends)
        ]

    def _contacts(self) -> dict[str, Contact]:
        """Return the curve joints in symbols, by name."""
        curves = [joint for joint in self.mechanism.joints.values() if joint.on_curve]
        for make in of_cases("contacts") if curves else ():
            parameters = dict(zip(self.p_names, self.p.elements(), strict=True))
            made: dict[str, Contact] = make(
                curves, self.mechanism.values(), parameters, self.numbers, FUNCTIONS
            )
            return made
        return {}

    def _make_parameters(self) -> None:
        mechanism = self.mechanism
        symbols = {name: SX.sym(name) for name in mechanism.parameter_values}
        self.numbers: dict[str, Sym] = {}
        for name, number in mechanism.numbers():
            if isinstance(number, str):
                self.numbers[name] = SX(build(number, symbols, FUNCTIONS))
            elif name not in self._free and (number == 0 or self._is_constant(name)):
                self.numbers[name] = SX(number)
            else:
                self.numbers[name] = symbols[name] = SX.sym(name)
        self.p_names: list[str] = list(symbols)
        self.p: Sym = ca.vertcat(*symbols.values()) if symbols else SX(0, 1)
        self.p_values: Floats = self._values_of(mechanism)

    def _is_constant(self, name: str) -> bool:
        """Return whether a number is no parameter unless the caller frees it."""
        return False

    def _values_of(self, mechanism: Mechanism) -> Floats:
        """Return the values of p (np,) in a mechanism of the same structure."""
        values = mechanism.values()
        return np.array([values[name] for name in self.p_names])

    def at(self, mechanism: Mechanism) -> Model:
        """Return the same symbols with the numbers of a mechanism of the same structure."""
        other = copy(self)
        other.mechanism, other.p_values = mechanism, self._values_of(mechanism)
        other.contacts = {name: c.at(mechanism.joints[name]) for name, c in self.contacts.items()}
        return other

    def part(self, mechanism: Mechanism) -> Model:
        """Return the model of some of the bodies and of the joints among them."""
        return Model(mechanism, free=self._free)

    def groups(
        self, rows: Sequence[Row], coarse: bool = False, out: Collection[str] = ()
    ) -> list[Any] | None:
        """Return the Assur groups; None of the plane, where rows and coordinates are theirs."""
        return None

    def loose_bodies(self, rows: Sequence[Row]) -> list[str]:
        """Return the bodies that constraints are missing for, by structure."""
        pattern = ca.jacobian(ca.vertcat(*[row.expression for row in rows]), self.q).sparsity()
        _, _, columns, _, _, _, coarse = pattern.btf()
        return list(dict.fromkeys(self.q_names[j][0] for j in columns[coarse[2] : coarse[4]]))

    def cases(self, question: str) -> list[Any]:
        """Return what cases add under a question, of those whose trait a joint has."""
        return of_cases(question, joint_traits(self.mechanism.joints.values()))

    opened: tuple[Row, ...] = ()
    in_gaps: frozenset[str] = frozenset()
    """The joints that move in their gaps, and before them their equations, which are left out."""

    @property
    def mesh_names(self) -> list[str]:
        """The gears, racks and belts: joints of wheels that drive each other."""
        return [name for name, joint in self.mechanism.joints.items() if joint.meshes]

    def mesh_row(self, name: str) -> Row:
        """Return the equation of a gear, rack or belt, one that a gap opens too."""
        return next(row for row in (*self.rows, *self.opened) if row.owner == name)

    @property
    def spinning(self) -> Iterable[str]:
        """Bodies that spin freely: their frames are not known."""
        return ()

    @property
    def left_out(self) -> Iterable[str]:
        """What is to be told of bodies that spin freely."""
        return ()

    def knows(self, coordinate: NamedCoordinate) -> bool:
        """Return whether a coordinate has a value: not what turns with bodies that spin freely."""
        return True

    def frame(self, body: str) -> Frame:
        """Return the frame of a body or of the ground; its origin is `anchor`."""
        return self._frames[body]

    def coordinates_among(self, symbols: Iterable[Sym]) -> Coordinates:
        """Return the coordinates that are among some symbols, in the order of these."""
        known = (self._of_symbol.get(symbol.element_hash()) for symbol in symbols)
        return Coordinates(coordinate for coordinate in known if coordinate)

    def replaced(self, expression: Sym, values: Mapping[tuple[str, str], Sym]) -> Sym:
        """Return an expression over q in which coordinates have the values of their keys."""
        held = self.coordinates_among(ca.symvar(SX(expression)))
        used = [(c.symbol, values[c.key]) for c in held if c.key in values]
        if not used:
            return expression
        symbols, replacements = zip(*used, strict=True)
        return ca.substitute(expression, ca.vertcat(*symbols), ca.vertcat(*replacements))

    def twist(self, body: str) -> list[int]:
        """Return the positions in q of a body's coordinates, in the order of a twist."""
        return [self.places[body, name] for name in self.space.twist]

    def turn(self, body: str) -> int:
        """Return the position in q of the angle of a body."""
        return self.twist(body)[-1]

    def anchor(self, body: str) -> str | None:
        """Return the point of a body that its coordinates x, y belong to.

        It is a joint's point: with an origin far away, bounds and rounding would grow with
        the distance although the mechanism is the same.
        """
        return self._anchors.get(body)

    def local(self, reference: str) -> Sym:
        """Return ``body.point`` (or ``body.center``) in the body's frame, from its anchor."""
        body = reference.split(".")[0]
        anchor, axes = self.anchor(body), self.axes
        place = [self.numbers[f"{reference}.{axis}"] for axis in axes]
        if anchor is None:
            return ca.vertcat(*place)
        origin = [self.numbers[f"{body}.{anchor}.{axis}"] for axis in axes]
        return ca.vertcat(*[number - first for number, first in zip(place, origin, strict=True)])

    def center(self, body: str) -> Sym:
        """Return the centre of mass in the body's frame, from its anchor.

        It is the origin of the frame where none is given.
        """
        if f"{body}.center.x" in self.numbers:
            return self.local(f"{body}.center")
        return self.local_origin(body)

    def local_origin(self, body: str) -> Sym:
        """Return the origin of a body in its frame, from its anchor."""
        anchor = self.anchor(body)
        axes = self.mechanism.axes
        return ca.vertcat(*[-self.numbers[f"{body}.{anchor}.{a}"] if anchor else 0 for a in axes])

    def origin(self, body: str) -> Sym:
        """Return the place of a body's origin, where its points' coordinates are zero."""
        return self.frame(body).point(self.local_origin(body))

    def point(self, reference: str) -> Sym:
        """Return the place of ``body.point`` in the fixed frame."""
        if reference not in self._points:
            frame = self.frame(reference.split(".")[0])
            self._points[reference] = frame.point(self.local(reference))
        return self._points[reference]

    @cached_property
    def _points(self) -> dict[str, Sym]:
        """Places of points that were asked for: frames do not change."""
        return {}

    def reported(self, chosen: Selection, listed: bool) -> Selection:
        """Return what of a selection has a value; `listed`: the task names it."""
        return chosen

    def coordinate(self, coordinate: NamedCoordinate) -> Sym:
        """Return the expression of a named coordinate."""
        if coordinate.kind == "body angle":
            return self.frame(coordinate.part).angle
        if coordinate.kind == "point":
            return self.point(f"{coordinate.part}.{coordinate.point}")[coordinate.axis]
        if coordinate.on_curve:
            return self.contacts[coordinate.part].s
        ends = self.ends[coordinate.part]
        if coordinate.kind == "joint angle":
            return ends.second.angle - ends.first.angle
        return ca.dot(ends.axis(), ends.gap)

    axes = "xy"
    joint_rates = False
    """Whether angles of joints have rates of their own; in the plane those of the bodies tell."""

    def turned(self, body: str) -> Quantity:
        """Return how a body is turned: its angle."""
        return "angle", self.frame(body).angle, ()

    def placed(self, reference: str) -> Quantity:
        """Return where a point is."""
        return "position", self.point(reference), ()

    def joint_quantities(self, name: str) -> list[Quantity]:
        """Return what is reported of a joint, and the angle of what guides it."""
        joint, ends = self.mechanism.joints[name], self.ends[name]
        found: list[Quantity] = []
        if joint.straight:
            found.append(("slide", ca.dot(ends.axis(), ends.gap), ()))
            if joint.first_body != GROUND:
                found.append(("guide", ends.first.angle, ()))
        if joint.on_curve:
            found.append(("s", self.contacts[name].s, ()))
        if joint.turns:
            found.append(("angle", ends.second.angle - ends.first.angle, ()))
        return found

    def quantities(self, chosen: Selection) -> list[Reported]:
        """Return what is reported of a selection: of bodies, then points, then joints."""
        found: list[Reported] = []
        found += [("bodies", name, self.turned(name), (name,)) for name in chosen.bodies]
        for reference in chosen.points:
            body = reference.split(".")[0]
            found.append(("points", reference, self.placed(reference), (body,)))
        for name in chosen.joints:
            bodies = tuple(b for b in self.mechanism.joints[name].bodies if b != GROUND)
            found += [("joints", name, each, bodies) for each in self.joint_quantities(name)]
        return found

    def columns_of(self, rows: Sequence[Row]) -> list[dict[Any, Any]]:
        """Return for each row what minus a unit of its multiplier does: its gradient."""
        return gradients(ca.vertcat(*[row.expression for row in rows]), self.q)

    def gradient(self, coordinate: NamedCoordinate) -> dict[Any, Any]:
        """Return what a unit of force or moment along a coordinate does."""
        return gradients(self.coordinate(coordinate), self.q)[0]

    def mass_center(self, body: str) -> Sym:
        """Return the place of a body's centre of mass."""
        return self.frame(body).point(self.center(body))

    def sharing(self, owners: list[str]) -> list[str]:
        """Return joints and drivers whose equations depend on each other, by those of the rows."""
        return owners

    def driven(self, coordinates: Iterable[NamedCoordinate]) -> tuple[list[Row], Sym]:
        """Return all rows, those of the drivers last, and the drivers' symbols u."""
        rows = list(self.rows)
        inputs = []
        for coordinate in coordinates:
            self.demand(coordinate)
            u = SX.sym(f"u_{coordinate.text}")
            residual, reach = self.coordinate(coordinate) - u, self.driver_reach(coordinate, u)
            rows.append(Row(coordinate.text, "driver", residual, coordinate.unit, True, reach))
            inputs.append(u)
        return rows, ca.vertcat(*inputs) if inputs else SX(0, 1)

    def driver_reach(self, coordinate: NamedCoordinate, u: Sym) -> Any:
        """Return what bounds of a driver's equation are made of, None: its terms."""
        return None

    def demand(self, coordinate: NamedCoordinate) -> None:
        """Raise for a coordinate that has no value."""

    @structure_property
    def phi(self) -> Sym:
        """Residuals of all joints, (m,)."""
        return ca.vertcat(*[row.expression for row in self.rows])

    @structure_property
    def phi_q(self) -> Sym:
        """Constraint Jacobian, (m, nq)."""
        return ca.jacobian(self.phi, self.q)

    @structure_property
    def velocity(self) -> Sym:
        """Symbols of the coordinates' rates, (nq,)."""
        return SX.sym("v", self.q.numel())

    @structure_property
    def acceleration(self) -> Sym:
        """Symbols of the coordinates' accelerations, (nq,)."""
        return SX.sym("a", self.q.numel())

    @structure_property
    def places(self) -> dict[tuple[str, str], int]:
        """The position in q of each (owner, name)."""
        return {key: i for i, key in enumerate(self.q_names)}

    @structure_property
    def gamma(self) -> Sym:
        """Right-hand side of Phi_q qdd = gamma: -(Phi_q v)_q v, (m,)."""
        rate = ca.jtimes(self.phi, self.q, self.velocity)
        return -ca.jtimes(rate, self.q, self.velocity)

    @structure_property
    def nu(self) -> Any:
        """Right-hand side of Phi_q qd = nu; zero for joints without a law of time, (m,)."""
        return SX.zeros(len(self.rows))

    @structure_property
    def mass_matrix(self) -> Sym:
        """Mass matrix in the absolute coordinates, (nq, nq); a body's rows belong to its anchor."""
        blocks = []
        for name in self.mechanism.bodies:
            m, inertia = (self.numbers.get(f"{name}.{n}", SX(0)) for n in ("mass", "inertia"))
            c = self.frame(name).direction(self.center(name))
            blocks.append(self.space.inertia(m, inertia, c))
        count = sum(len(contact.coordinates) for contact in self.contacts.values())
        return ca.diagcat(*blocks, SX(count, count)) if count else ca.diagcat(*blocks)


def square_blocks(pattern: Sym) -> tuple[int, Integers, Integers]:
    """Return count and labels of rows and of columns of the block-triangular form."""
    count, rowperm, colperm, rowblock, colblock, _, _ = pattern.btf()
    of_row, of_column = np.empty(pattern.size1(), int), np.empty(pattern.size2(), int)
    for block in range(count):
        of_row[rowperm[rowblock[block] : rowblock[block + 1]]] = block
        of_column[colperm[colblock[block] : colblock[block + 1]]] = block
    return count, of_row, of_column
