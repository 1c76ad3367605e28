"""The way from one frame to another: rigid links, and the freedoms of joints between them.

What is known of a row of a spatial mechanism beside its expression: from it follow bounds of its
derivatives, because a rotation turns what is behind it and stretches nothing
(`mechdae.kernels.bounds.reaches`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import casadi as ca

from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
X, Z = 0, 2


@dataclass(frozen=True, eq=False)
class RigidPart:
    """From one frame to the next of one body: place (3,) and rotation (3, 3), constants."""

    place: Sym
    turn: Sym

    def back(self) -> RigidPart:
        return RigidPart(-self.turn.T @ self.place, self.turn.T)


@dataclass(frozen=True, eq=False)
class Freedom:
    """One coordinate of a joint: a ``turn`` about an axis of the frame, a ``slide``, a ``screw``.

    A ``ball`` has the four components of a quaternion. ``lead`` is the slide a radian of a screw.
    ``sense`` is -1 of a freedom that the way goes back through.
    """

    word: str
    symbols: tuple[Sym, ...]
    axis: int = Z
    lead: Sym = 0
    sense: int = 1

    def back(self) -> Freedom:
        return replace(self, sense=-self.sense)

    def is_slide_of(self, symbol: Sym) -> bool:
        """Return whether this is the slide with that coordinate."""
        return self.word == "slide" and self.symbols[0].element_hash() == symbol.element_hash()

    @property
    def turns(self) -> bool:
        return self.word in ("turn", "screw")

    @property
    def slides(self) -> bool:
        return self.word in ("slide", "screw")


Way = tuple[RigidPart | Freedom, ...]


@dataclass(frozen=True, eq=False)
class WayProduct:
    """A product of what is at both ends of a way, the frame of its start at rest.

    ``start`` and ``tip`` are directions (3,) in the frames there, of any length, or None: the
    points. Of a direction and a point it is the component of the point, of two points half the
    square of their distance. ``factor`` is a constant.
    """

    way: Way
    start: Any = None
    tip: Sym | None = None
    factor: Sym = 1.0

    @property
    def unslid(self) -> WayProduct:
        """The same product along a shorter way: slides do not turn directions."""
        if self.start is None or self.tip is None:
            return self
        remaining = (p for p in self.way if not (isinstance(p, Freedom) and p.word == "slide"))
        return replace(self, way=joined(tuple(remaining)))


@dataclass(frozen=True, eq=False)
class WayProducts:
    """A scalar as a sum of products along ways and of a ``rest`` that is bounded by its terms."""

    products: tuple[WayProduct, ...]
    rest: Sym = field(default_factory=lambda: SX(0))

    @property
    def unslid(self) -> WayProducts:
        """The same sum along ways without slides that move nothing."""
        return replace(self, products=tuple(product.unslid for product in self.products))

    def without(self, slide: Sym, factor: Sym, rest: Sym) -> WayProducts:
        """Return the sum times a factor where a slide, by its symbol, is zero; `rest` is so."""
        products = []
        for product in self.products:
            remaining = (
                p for p in product.way if not (isinstance(p, Freedom) and p.is_slide_of(slide))
            )
            products.append(
                replace(product, way=joined(tuple(remaining)), factor=factor * product.factor)
            )
        return WayProducts(tuple(products), factor * rest).unslid


def back(way: Way) -> Way:
    """Return the way from its end to its start."""
    return tuple(part.back() for part in reversed(way))


def joined(*ways: Way) -> Way:
    """Return ways one after the other, with links and freedoms in turn."""
    found: list[RigidPart | Freedom] = []
    for part in (part for way in ways for part in way):
        last = found[-1] if found else None
        if isinstance(part, RigidPart) and isinstance(last, RigidPart):
            place = last.place + last.turn @ part.place
            found[-1] = RigidPart(ca.sparsify(place), ca.sparsify(last.turn @ part.turn))
        else:
            found.append(part)
    return tuple(found)


def apart(first: Way, second: Way) -> tuple[Way, Way]:
    """Return two ways from one frame without what they share at their beginning."""
    count = 0
    for one, other in zip(first, second, strict=False):
        if one is not other:
            break
        count += 1
    return first[count:], second[count:]


def freedoms(at: Mapping[str, Sym], crossed: bool, lead: Sym | None) -> Way:
    """Return the freedoms of a joint with these coordinates, from its first side."""
    if "e0" in at:
        ball = Freedom("ball", tuple(at[f"e{k}"] for k in range(4)))
        return (*(Freedom("slide", (at[w],), k) for k, w in enumerate("xyz") if w in at), ball)
    if lead is not None:
        return (Freedom("screw", (at["angle"],), Z, lead),)
    axes = {"x": 0, "y": 1, "slide": 2}
    found: list[RigidPart | Freedom] = [
        Freedom("slide", (at[word],), axis) for word, axis in axes.items() if word in at
    ]
    if "angle" in at:
        found.append(Freedom("turn", (at["angle"],), Z))
    if crossed:
        found.append(Freedom("turn", (at["angle2"],), X))
    return tuple(found)
