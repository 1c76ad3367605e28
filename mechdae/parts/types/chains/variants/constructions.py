"""Six constructions of each pin: which link carries it, and whether it is overhung or in a fork.

An overhung pin has a bearing of length w in the link that carries it, and its load at a distance
a from the bearing's edge. The bearing acts like two edges with R (1 + a/w) and R a/w, so friction,
which is proportional to what presses, has R (1 + 2 a/w) in place of R. A fork holds its pin on
both sides: R in all, in two bearings of R/2 each where the fork carries the pin.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

from mechdae.describe import Mechanism, Problem, Table
from mechdae.describe.layers import Layers, LinksCrossing, fewest_layers
from mechdae.errors import InputError
from mechdae.parts.types.chains.variants.scheme import GROUND, Variant, made
from mechdae.parts.types.chains.variants.symmetries import of_structure
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json


FORMS = ("o1", "o2", "a1", "a2", "b1", "b2")
"""o overhung, a fork on the first link, b on the second; then which link carries the pin."""
TURNED = {"o1": "o2", "o2": "o1", "a1": "b2", "b2": "a1", "a2": "b1", "b1": "a2"}
"""The same construction with first and second link exchanged."""
FRAME_BEARING = 2.0
"""Layers that a bearing in the frame is long; in a link it is one layer."""
THIN = 1 / 20
"""Thickness of a layer as a share of the mechanism's size, where there are no pins with radii."""


def pins_of(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Return the pins with the two links that turn in each."""
    pins = {
        name: (joint.first_body, joint.second_body)
        for name, joint in mechanism.joints.items()
        if joint.hinge
    }
    if not pins:
        raise InputError("no joint is a pin", where="joints", hint='kind = "revolute"')
    return pins


def count(mechanism: Mechanism) -> tuple[int, int]:
    """Return 6 to the power of the pins, and how many differ up to symmetries of the chain."""
    pins = pins_of(mechanism)
    group = of_structure(mechanism, kinds=True)
    total = sum(_unchanged_choices(mechanism, pins, links, joints) for links, joints in group)
    return len(FORMS) ** len(pins), total // len(group)


def thickness(mechanism: Mechanism) -> float:
    """Return the thickness of a layer [m]: ``layer`` of the problem, or a pin's diameter."""
    values = mechanism.values()
    if "layer" in mechanism.parameters:
        if not values["layer"] > 0:
            raise InputError(
                f"the thickness of a layer is above 0, not {values['layer']:g}",
                where="parameters.layer",
            )
        return values["layer"]
    radii = [values.get(f"{name}.pin_radius", 0.0) for name in pins_of(mechanism)]
    return 2 * max(radii) or THIN * mechanism.scale


@dataclass(frozen=True)
class Constructions:
    """All constructions of the pins of a mechanism."""

    problem: Problem
    crossings: LinksCrossing

    def __iter__(self) -> Iterator[Variant]:
        known: dict[tuple[str, ...], Layers | str] = {}
        for word in product(FORMS, repeat=len(self.pins)):
            forks = tuple(form[0] for form in word)
            if forks not in known:
                known[forks] = fewest_layers(self.pins, self._forks(word), self.crossings)
            yield self._variant(word, known[forks])

    @cached_property
    def pins(self) -> dict[str, tuple[str, str]]:
        return pins_of(self.problem.mechanism)

    @cached_property
    def thickness(self) -> float:
        """Of a layer [m]."""
        return thickness(self.problem.mechanism)

    @cached_property
    def template(self) -> Variant:
        """The mechanism with the numbers of constructions as parameters."""
        base = self.problem.mechanism
        sizes: dict[str, float | str] = {"layer": self.thickness, "layers": 0.0}
        joints = dict(base.joints)
        for pin in self.pins:
            sizes |= {
                f"{pin}_overhang": 0.0,
                f"{pin}_width": self.thickness,
                f"{pin}_bearings": 1.0,
                f"{pin}_load": f"1 + 2*{pin}_overhang/{pin}_width",
                f"{pin}_bearing": f"(1 + {pin}_overhang/{pin}_width)/{pin}_bearings",
            }
            joint: Any = base.joints[pin]
            if joint.pin_radius is not None:
                radius = f"({joint.pin_radius})*{pin}_load"
                joints[pin] = replace(joint, pin_radius=radius)
        given = {f"{pin}_{word}" for pin in self.pins for word in ("overhang", "width")}
        for name in sizes:
            if name in base.parameters and name not in {"layer", *given}:
                raise InputError(
                    "constructions of pins have a parameter of this name",
                    where=f"parameters.{name}",
                    hint="rename it",
                )
        mechanism = replace(
            base,
            joints=Table(joints),
            parameters=Table({**base.parameters, **sizes}),
            loads=Table(),
            outputs=Table(),
        )
        return made(self.problem, "construction", mechanism, "construction", {})

    def _forks(self, word: tuple[str, ...]) -> dict[str, str]:
        return {
            pin: pair["ab".index(form[0])]
            for (pin, pair), form in zip(self.pins.items(), word, strict=True)
            if form[0] != "o"
        }

    def _variant(self, word: tuple[str, ...], layers: Layers | str) -> Variant:
        name = "-".join(word)
        problem = self.template.problem
        assert problem is not None
        stack = None if isinstance(layers, str) else layers
        numbers: dict[str, float] = {"layers": float(stack.count) if stack else 0.0}
        pins: dict[str, Json] = {}
        for (pin, pair), form in zip(self.pins.items(), word, strict=True):
            carrier = pair[int(form[1]) - 1]
            measures = self._pin(pin, pair, form, carrier, stack.reach[pin] if stack else 1)
            numbers |= {f"{pin}_{key}": value for key, value in measures.items()}
            fork = "" if form[0] == "o" else pair["ab".index(form[0])]
            pins[pin] = {"form": f"fork on {fork}" if fork else "overhung", "carrier": carrier}
            pins[pin] |= {"links": list(pair)}
            pins[pin] |= {"layers": list(stack.pins[pin])} if stack else {}
            pins[pin] |= {
                key: value for key, value in measures.items() if fork == "" or key != "width"
            }
        about: Json = {"pins": pins}
        if stack is not None:
            about |= {
                "layers": stack.count,
                "spans": {link: list(span) for link, span in stack.spans.items()},
            }
        changed = replace(problem.with_values(numbers), name=name, title=problem.title + " " + name)
        fault = "" if stack else f"cannot be built: {layers}"
        return Variant(name, changed, about, self.template.left_out, fault)

    def _pin(
        self, pin: str, pair: tuple[str, str], form: str, carrier: str, reach: int
    ) -> dict[str, float]:
        """Return overhang, length and number of the bearings of a pin."""
        known, thick = self.problem.mechanism.parameter_values, self.thickness
        factor = FRAME_BEARING if carrier == GROUND else 1.0
        width = known.get(f"{pin}_width", factor * thick)
        if not width > 0:
            raise InputError(
                f"a bearing is longer than 0, not {width:g}", where=f"parameters.{pin}_width"
            )
        if form[0] == "o":
            over = known.get(f"{pin}_overhang", (reach - 0.5) * thick)
            if over < 0:
                raise InputError(
                    f"an overhang is not negative ({over:g})", where=f"parameters.{pin}_overhang"
                )
            return {"overhang": over, "width": width, "bearings": 1.0}
        forked = pair["ab".index(form[0])] == carrier
        return {"overhang": 0.0, "width": width, "bearings": 2.0 if forked else 1.0}


def _unchanged_choices(
    mechanism: Mechanism,
    pins: dict[str, tuple[str, str]],
    links: dict[str, str],
    joints: dict[str, str],
) -> int:
    """Return how many constructions a symmetry leaves as they are."""
    number, seen = 1, set()
    for start in pins:
        if start in seen:
            continue
        turned, pin = False, start
        while pin not in seen:
            seen.add(pin)
            turned ^= links[pins[pin][0]] != pins[joints[pin]][0]
            pin = joints[pin]
        fixed = [form for form in FORMS if not turned or TURNED[form] == form]
        number *= len(fixed)
    return number
