"""What a pose reports: the scalar expressions of bodies, points and joints, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, KINDS, LENGTH, CoordinateKind
from mechdae.equations.model import Quantity
from mechdae.equations.reduction import Scene
from mechdae.errors import UnknownName
from mechdae.motion.setup.angular_rates import turning
from mechdae.records import dataclass
from mechdae.results import LazyPart, Named, Series
from mechdae.types import Floats, Points, Sym

RATES = {
    "orientation": ("orientation", "angular_velocity", "angular_acceleration", "angular_jerk"),
    "angle": ("angle", "angular_velocity", "angular_acceleration", "angular_jerk"),
    "position": ("position", "velocity", "acceleration", "jerk"),
    **{
        name: (name, f"{name}_velocity", f"{name}_acceleration", f"{name}_jerk")
        for name in ("slide", "x", "y", "s", "length", "elevation", "azimuth")
    },
}


TURNS = ("orientation",)
"""Quantities that are rotation matrices inside."""
Tables = Mapping[str, Mapping[str, Mapping[str, Any]]]
Request = tuple[str, Any, tuple[str, ...]]
"""What is evaluated beside what is reported: key, expression over q, bodies it depends on."""


@dataclass(frozen=True)
class ReportedQuantity:
    """One reported quantity: where it goes, its scalars and the bodies it depends on."""

    kind: str  # bodies, points or joints; hidden, for other quantities
    part: str
    name: str  # angle, orientation, position, slide or s; value, for hidden ones
    columns: tuple[int, ...]
    bodies: tuple[str, ...]

    @cached_property
    def quantity(self) -> CoordinateKind | None:
        """Which kind of coordinate it is; None of hidden ones."""
        return KINDS.get(self.name)

    @cached_property
    def unit(self) -> str:
        """The SI unit; none of hidden ones."""
        return "m" if self.kind == "points" else self.quantity.unit if self.quantity else ""

    @cached_property
    def is_orientation(self) -> bool:
        """Whether it is the rotation matrix of a body."""
        return self.name in TURNS

    @cached_property
    def is_output(self) -> bool:
        """Whether it is a body's angle or a slide: the coordinates of links, not of points."""
        turns = self.kind == "bodies" and self.quantity is ANGLE
        return turns or (self.kind == "joints" and self.quantity is LENGTH)


class Outputs:
    """The reported quantities of a scene, and what else is evaluated with them.

    Attributes
    ----------
    expression : SX (ny,)
        All scalars over (x, u, p).
    entries : list of Entry
    """

    def __init__(self, scene: Scene, hidden: Iterable[Request] = ()) -> None:
        self.scene = scene
        self.entries: list[ReportedQuantity] = []
        self._scalars: list[Sym] = []
        self._reaches: list[Any] = []
        self._group_of = {body: group.index for group in scene.groups for body in group.bodies}
        for reported in scene.model.quantities(scene.selection):
            self._add(*reported)
        for key, expression, bodies in hidden:
            self._add("hidden", key, ("value", expression, ()), bodies)
        stacked = ca.vertcat(*self._scalars) if self._scalars else ca.SX(0, 1)
        self.expression: Sym = ca.densify(self._one_place(scene.expression(stacked)))
        scene.keep_reaches(self.expression.elements(), self._reaches)

    def _one_place(self, expression: Sym) -> Sym:
        """Return the scalars with points that a pin holds together as one of them.

        That of the group solved first, else the one that moves in fewer directions. Where
        constraints are redundant a pin is closed to within their tolerance only.
        """
        scene, result = self.scene, ca.SX(expression)
        if not scene.groups:
            return result
        place = {e.part: list(e.columns) for e in self.entries if e.kind == "points"}
        at = {group.index: k for k, group in enumerate(scene.groups)}
        stage = {i: at[block.group] for block in scene.blocks for i in block.x}

        def rank(columns: list[int]) -> tuple[int, int]:
            each = [scene.held(result[i]) for i in columns]
            stages = [stage[i] for x, _, _ in each for i in x]
            return max(stages, default=-1), sum(bool(x or u) for x, u, _ in each)

        for group in scene.groups:
            for name in group.joints if not group.superfluous else ():
                joint = scene.model.mechanism.joints[name]
                if joint.coincide and {joint.first, joint.second} <= place.keys():
                    remaining, other = sorted((place[joint.first], place[joint.second]), key=rank)
                    result[other] = result[remaining]
                    for i, k in zip(other, remaining, strict=True):
                        self._reaches[i] = self._reaches[k]
        return result

    def at(self, scene: Scene) -> Outputs:
        """Return the same quantities of the scene with other numbers."""
        other = copy(self)
        other.scene = scene
        return other

    def _add(self, kind: str, part: str, quantity: Quantity, bodies: tuple[str, ...]) -> None:
        name, value, reaches = quantity
        start = len(self._scalars)
        scalars = ca.vertsplit(ca.SX(value))
        self._scalars += scalars
        self._reaches += list(reaches) or [None] * len(scalars)
        columns = tuple(range(start, start + len(scalars)))
        self.entries.append(ReportedQuantity(kind, part, name, columns, bodies))

    @cached_property
    def bounded(self) -> dict[str, list[int]]:
        """The columns of which bounds are told, by what these are called; none without columns."""
        turns = [i for e in self.entries if e.is_output and e.unit == "rad" for i in e.columns]
        lengths = [i for e in self.entries if e.unit == "m" for i in e.columns]
        kinds = (("length", lengths), ("angle", turns))
        return {word: columns for word, columns in kinds if columns}

    @cached_property
    def matrices(self) -> list[int]:
        """The columns of rotation matrices of bodies."""
        return [i for entry in self.entries if entry.is_orientation for i in entry.columns]

    @property
    def bound_words(self) -> list[str]:
        """What bounds are told of: ``length``, ``angle``, those that there are."""
        return list(dict.fromkeys([*self.bounded, *(["angle"] if self.matrices else [])]))

    @property
    def without_rates(self) -> list[int]:
        """The columns of which no rates are reported: turns of joints of the plane."""
        if self.scene.model.joint_rates:
            return []
        turns = (e for e in self.entries if e.kind == "joints" and e.quantity is ANGLE)
        return [i for entry in turns for i in entry.columns]

    @cached_property
    def _reported(self) -> list[tuple[ReportedQuantity, tuple[str, ...], Any]]:
        """What is reported: quantities, names of their rates, where they are in arrays y."""
        found = []
        for entry in self.entries:
            if entry.name != "guide" and entry.kind != "hidden":
                first, last = entry.columns[0], entry.columns[-1]
                columns = slice(first, last + 1) if entry.name == "position" else first
                found.append((entry, self._names(entry), (slice(None), columns)))
        return found

    def _names(self, entry: ReportedQuantity) -> tuple[str, ...]:
        """Return the names of a quantity and of its rates."""
        if entry.kind != "joints" or entry.quantity is not ANGLE:
            return RATES[entry.name]
        if self.scene.model.joint_rates:  # bodies have no angles whose rates would tell
            return (entry.name, *(f"{entry.name}_{rate}" for rate in RATES["position"][1:]))
        return RATES[entry.name][:1]

    def groups_of(self, entry: ReportedQuantity) -> set[int]:
        """Return the groups whose unknowns the quantity depends on."""
        return {self._group_of[body] for body in entry.bodies if body in self._group_of}

    def columns(self, keys: Iterable[str]) -> list[int]:
        """Return the columns of hidden quantities."""
        found = {entry.part: entry.columns for entry in self.entries if entry.kind == "hidden"}
        return [column for key in keys for column in found[key]]

    def column_of(self, path: str) -> tuple[int, tuple[int, ...]]:
        """Return order of the derivative and columns of a path like ``points/rod.B/velocity``.

        Raises
        ------
        UnknownName
            Nothing of that path is computed.
        """
        head, _, tail = path.partition("/")
        part, _, quantity = tail.rpartition("/")
        entries = [e for e in self.entries if e.kind == head and e.name not in ("guide", "value")]
        of_part = [entry for entry in entries if entry.part == part]
        for entry in of_part:
            names = self._names(entry)
            if quantity in names and entry.name not in TURNS:
                return names.index(quantity), entry.columns
        named = of_part or entries
        known = [f"{head}/{entry.part}/{name}" for entry in named for name in self._names(entry)]
        raise UnknownName("path", path, known)

    def named(self, values: list[Floats], extra: Tables | None = None) -> dict[str, Named]:
        """Return bodies, points and joints from the arrays y, y', ... (n, ny), as views of them.

        `extra` has further series: kind, part, name -> array.
        """
        tables: dict[str, dict[str, dict[str, Floats | LazyPart]]] = {
            "bodies": {},
            "points": {},
            "joints": {},
        }
        for entry, names, columns in self._reported:
            series = tables[entry.kind].setdefault(entry.part, {})
            if entry.name in TURNS:
                series |= turning([y[:, list(entry.columns)] for y in values], names)
                continue
            for name, y in zip(names, values, strict=False):
                series[name] = y[columns]
        if len(values) >= 3:
            for entry in self.entries if not self.scene.model.joint_rates else ():
                if entry.name == "slide":
                    later = LazyPart(partial(self._coriolis, entry, values))
                    tables["joints"][entry.part]["coriolis"] = later
        for kind, parts in (extra or {}).items():
            for part, arrays in parts.items():
                tables[kind].setdefault(part, {}).update(arrays)
        words = {"bodies": "body", "points": "point", "joints": "joint"}
        return {
            kind: Named(words[kind], {part: Series(arrays) for part, arrays in table.items()})
            for kind, table in tables.items()
        }

    def _coriolis(self, slide: ReportedQuantity, values: list[Floats]) -> dict[str, Points]:
        """Return ``coriolis``, 2 omega x v_rel of the second body's point, (n, 2)."""
        guide = next((e for e in self.entries if e.part == slide.part and e.name == "guide"), None)
        n = len(values[0])
        if guide is None:
            still = np.where(np.isnan(values[1][:, slide.columns]), np.nan, np.zeros((n, 2)))
            return {"coriolis": still}
        numbers = self.scene.model.mechanism.values()
        direction = values[0][:, guide.columns[0]] + numbers[f"{slide.part}.axis"]
        size = 2 * values[1][:, guide.columns[0]] * values[1][:, slide.columns[0]]
        across = np.stack([-np.sin(direction) * size, np.cos(direction) * size], axis=1)
        return {"coriolis": across}
