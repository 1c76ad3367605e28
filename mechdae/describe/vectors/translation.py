"""What coordinates of a mechanism are called in a variant of it, with its drivers and loads.

An angle is one of two links, whatever it is called: that of a body is one against the ground, that
of a joint one between its links. So each is looked for between the links that these two became.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import cached_property
from types import MappingProxyType

from mechdae.describe.coordinates import RATES, coordinate, split_rate
from mechdae.describe.expression import names_in
from mechdae.describe.joints.joint import Joint
from mechdae.describe.loads import (
    NUMBERS,
    TIME,
    VECTORS,
    Force,
    Load,
    Resistance,
    Spring,
    TableLoad,
    Torque,
)
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Driver
from mechdae.describe.vectors.values import negative
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.types import Json

NOTHING: Mapping[str, str] = MappingProxyType({})
Signed = tuple[str, int]
"""The name of a coordinate, and 1 or -1 where it has the other sign."""


def new_point(text: str, called: Mapping[str, str], points: Mapping[str, str]) -> str:
    """Return a point ``body.point``, or a coordinate of it, where links and points are renamed."""
    body, _, rest = text.partition(".")
    end = ".".join(text.split(".")[:2])
    return points[end] + text[len(end) :] if end in points else f"{called.get(body, body)}.{rest}"


def renamed(joint: Joint, called: Mapping[str, str], points: Mapping[str, str] = NOTHING) -> Joint:
    """Return a joint between the same links where these and their points are renamed."""
    changes: Json = {
        side: new_point(getattr(joint, side), called, points) for side in ("first", "second")
    }
    if hasattr(joint, "carrier"):
        carrier = called.get(joint.carrier or GROUND, joint.carrier)
        changes["carrier"] = None if carrier == GROUND else carrier
    return replace(joint, **changes)


@dataclass(frozen=True)
class Translation:
    """From the coordinates of ``base`` to those of ``made``, which has the same joints by name.

    ``called`` are links with another name in it: a link that is fixed now is called ``ground``;
    ``joints`` and ``points`` are those with another name.
    ``instead`` returns a driver for one that has no meaning there: of none of some coordinates, and
    whether it is the only one.
    """

    base: Mechanism
    made: Mechanism
    called: Mapping[str, str] = field(default_factory=dict)
    joints: Mapping[str, str] = field(default_factory=dict)
    points: Mapping[str, str] = field(default_factory=dict)
    instead: Callable[[Driver, Collection[str], bool], Driver] | None = None

    @cached_property
    def _frame(self) -> str:
        """What the ground of the base is called."""
        return self.called.get(GROUND, GROUND)

    def link(self, name: str) -> str:
        """Return the new name of a link."""
        return self.called.get(name, name)

    def point(self, text: str) -> str:
        """Return a point ``body.point`` under its new name."""
        return new_point(text, self.called, self.points)

    def coordinate(self, text: str) -> Signed:
        """Return the coordinate that has the same values, and whether its sign is another.

        Raises
        ------
        InputError
            None has.
        """
        joint = self.base.joints.get(text.partition(".")[0])
        if joint is None and (len(text.split(".")) == 3 or text in self.base.aliases):
            return self._place(text)
        if joint is not None and not text.endswith(".angle"):
            return self._along(text, joint)
        first, second = (GROUND, text.partition(".")[0])
        if joint is not None:
            first, second = joint.first_body, joint.second_body
        return self._angle(text, joint, self.link(first), self.link(second))

    def _angle(self, text: str, joint: Joint | None, first: str, second: str) -> Signed:
        name = self.joints.get(joint.name, joint.name) if joint is not None else ""
        if name in self.made.joints and self._links(name) == (first, second):
            return f"{name}.angle", 1
        if first == GROUND and joint is None and self._frame == GROUND:
            return f"{second}.angle", 1
        between = {self._links(name): name for name, made in self.made.joints.items() if made.turns}
        if (first, second) in between:
            return f"{between[first, second]}.angle", 1
        if first == GROUND:
            return f"{second}.angle", 1
        if (second, first) in between:
            return f"{between[second, first]}.angle", -1
        if second == GROUND:
            return f"{first}.angle", -1
        raise InputError(
            f"'{text}' is the angle between {first} and {second}, which no joint joins here",
            hint="angles of joints have a meaning in all variants that keep the joint",
        )

    def _links(self, joint: str) -> tuple[str, str]:
        made = self.made.joints[joint]
        return made.first_body, made.second_body

    def _along(self, text: str, joint: Joint) -> Signed:
        name, word = self.joints.get(joint.name, joint.name), text.rpartition(".")[2]
        made = self.made.joints.get(name)
        if made is not None and made.pointer and word == "slide":
            word = "length"
        if made is None or word not in made.coordinates:
            raise InputError(f"joint {joint.name} has no '{text}' here")
        return f"{name}.{word}", 1

    def _place(self, text: str) -> Signed:
        if text in self.base.aliases:
            return self.coordinate(self.base.aliases[text])
        if self._frame != GROUND:
            raise InputError(f"'{text}' is a place in axes of {self._frame}, which moves here")
        return self.point(text), 1

    def expression(self, text: str) -> str:
        """Return an expression over the new coordinates; a place is seen from the old ground."""
        names = [name for name in names_in(text) if "." in name]
        found = {name: self._term(name) for name in names}
        if all(name == term for name, term in found.items()):
            return text
        words = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
        return re.sub(rf"(?<![\w.])({words})(?![\w.])", lambda hit: found[hit[0]], text)

    def _term(self, name: str) -> str:
        bare, order = split_rate(name)
        parts = bare.split(".")
        if len(parts) == 3 and parts[0] in self.base.bodies and self._frame != GROUND:
            return self._seen(bare, parts, order)
        joint = self.base.joints.get(parts[0])
        known = parts[0] in self.base.bodies if joint is None else parts[1] in joint.coordinates
        if len(parts) == 2 and known:
            try:
                new, sign = self.coordinate(bare)
            except InputError:
                if parts[1] != "angle" or parts[0] in self.base.joints:
                    raise
                rate = ("", *RATES)[order]
                return f"({parts[0]}.angle{rate} - {self._frame}.angle{rate})"
            return ("-" * (sign < 0)) + new + ("", *RATES)[order]
        if parts[0] in self.base.joints:  # a reaction, an effort
            return ".".join([self.joints.get(parts[0], parts[0]), *name.split(".")[1:]])
        return self.point(name) if len(parts) == 3 else name

    def _seen(self, text: str, parts: list[str], order: int) -> str:
        """Return the place of a point in the axes of the link that was the ground."""
        if order:
            raise InputError(f"the rate of '{text}' against {self._frame} has no name here")
        body, point = self.link(parts[0]), parts[1]
        frame, origin = self._frame, next(iter(self.made.bodies[self._frame].points), None)
        if origin is None:
            raise InputError(f"'{text}' cannot be seen from {frame}, which has no points")
        values = self.made.values()
        place = {a: repr(values[f"{GROUND}.{point}.{a}"]) if body == GROUND else
                 f"{body}.{point}.{a}" for a in "xy"}  # fmt: skip
        off = [f"{place[axis]} - {frame}.{origin}.{axis}" for axis in "xy"]
        sine, cosine = f"sin({frame}.angle)", f"cos({frame}.angle)"
        if parts[2] == "x":
            turned = f"({off[0]})*{cosine} + ({off[1]})*{sine}"
        else:
            turned = f"({off[1]})*{cosine} - ({off[0]})*{sine}"
        return f"({values[f'{frame}.{origin}.{parts[2]}']!r} + {turned})"

    def drivers(self, given: Sequence[Driver]) -> list[tuple[Driver, bool]]:
        """Return drivers of the same motion, and whether each is another in place of one.

        Raises
        ------
        InputError
            Nothing could be driven in place of one.
        """
        found: list[Driver | None] = []
        for driver in given:
            try:
                found.append(self._driver(driver))
            except InputError:
                if self.instead is None:
                    raise
                found.append(None)
        used = [driver.coordinate for driver in found if driver is not None]
        whole: list[tuple[Driver, bool]] = []
        for before, same in zip(given, found, strict=True):
            if same is None and self.instead is not None:
                whole.append((self.instead(before, used, len(given) == 1), True))
                used.append(whole[-1][0].coordinate)
            elif same is not None:
                whole.append((same, False))
        return whole

    def _driver(self, given: Driver) -> Driver:
        text, sign = self.coordinate(given.coordinate)
        coordinate(self.made, text)
        if sign > 0:
            return given if text == given.coordinate else replace(given, coordinate=text)
        turned: Json = {"coordinate": text}
        for word in ("from_", "to", "speed", "acceleration", "jerk", "law"):
            value = getattr(given, word)
            if value is not None:
                turned[word] = negative(value)
        if given.at is not None:
            turned["at"] = tuple(negative(value) for value in given.at)
        if given.table is not None:
            turned["table"] = replace(given.table, factor=negative(given.table.factor))
        if not given.timed:
            turned["direction"] = "positive" if given.direction == "negative" else "negative"
        return replace(given, **turned)

    def outputs(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return what a task reports under new names; what is fixed now is left out."""
        found = []
        for name in names:
            if "." not in name:
                new = self.link(self.joints.get(name, name))
            elif name.partition(".")[2] in self._points(name.partition(".")[0]):
                new = self.point(name)
            else:
                new = self.coordinate(name)[0]
            if new.partition(".")[0] != GROUND:
                found.append(new)
        return tuple(dict.fromkeys(found))

    def _points(self, body: str) -> Mapping[str, object]:
        return self.base.bodies[body].points if body in self.base.bodies else {}

    def load(self, load: Load) -> Load:
        """Return a load on the same links: between links it does the same work.

        A force or a torque on a link keeps that link, a force the axes in which it was given.

        Raises
        ------
        InputError
            It acts on the link that is fixed, or on what has no name here.
        """
        load = self._numbers(load)
        if isinstance(load, Force):
            return replace(load, point=self._moving(load.point), frame=self._axes(load.frame))
        if isinstance(load, Torque):
            return replace(load, body=self._moving(load.body))  # in the plane it has no axes
        if isinstance(load, Spring) and load.between is not None:
            return replace(load, between=tuple(self.point(end) for end in load.between))
        changes: Json = {}
        if isinstance(load, TableLoad) and load.body is not None:
            changes["body"] = self._moving(load.body)
        for word in ("coordinate", "along"):
            text = getattr(load, word, None)
            if text is not None and text != TIME:
                changes[word], sign = self.coordinate(text)
                if sign < 0:
                    changes |= _opposed(load, word)
        return replace(load, **changes)

    def _numbers(self, load: Load) -> Load:
        """Return a load with its expressions over the new coordinates."""
        changes: Json = {}
        for entry in fields(load):
            value = getattr(load, entry.name)
            if entry.metadata.get("kind") in NUMBERS and isinstance(value, str):
                changes[entry.name] = self.expression(value)
            elif entry.metadata.get("kind") in VECTORS and isinstance(value, tuple):
                changes[entry.name] = tuple(
                    self.expression(number) if isinstance(number, str) else number
                    for number in value
                )
        return replace(load, **changes) if changes else load

    def _axes(self, frame: str) -> str:
        """Return what the axes of a load are called: those of the old ground move with it."""
        if frame == "world":
            return frame if self._frame == GROUND else self._frame
        name = self.link(frame)
        return "world" if name == GROUND else name

    def _moving(self, text: str) -> str:
        new = self.link(text) if "." not in text else self.point(text)
        if new.partition(".")[0] == GROUND:
            raise InputError(f"it acts on {text.partition('.')[0]}, which is fixed here")
        return new


def _opposed(load: Load, word: str) -> dict[str, object]:
    """Return the numbers of a load whose coordinate has the other sign."""
    if isinstance(load, Resistance):
        return {"negative": load.positive, "positive": load.negative}
    if isinstance(load, Spring):
        return {"free_length": negative(load.free_length), "preload": negative(load.preload)}
    if isinstance(load, TableLoad) and word == "along":
        return {"factor": negative(load.factor)}
    if isinstance(load, TableLoad) and load.rows is not None:
        rows = tuple((0.0 - abscissa, value) for abscissa, value in reversed(load.rows))
        return {"rows": rows}
    raise InputError(f"a {load.kind} on a coordinate of the other sign is not translated")
