"""Equations of a block apart from its numbers: built once for all blocks that differ in them alone.

What an equation makes of parameters and numbers only, ``(k + 1) * pitch``, is one number q of the
block. Blocks whose equations are the same in their unknowns, the drivers and q have one shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.equations.structure_cache import StructureCache
from mechdae.kernels.bounds.walk import number_rounding, replay, symbolic, with_trig
from mechdae.records import dataclass
from mechdae.types import Graph, Sym

SX = ca.SX


class BlockShape:
    """Functions of the equations F(x, z, u; q) = 0 of blocks.

    Parameters
    ----------
    x, z, u, q : SX
        Unknowns, those of earlier blocks, drivers, numbers.
    F : SX
    angles
        Which entries of (x, z) are angles.
    shared
        Whether several blocks may have this shape: its symbols are nobody else's.
    """

    def __init__(
        self, x: Sym, z: Sym, u: Sym, q: Sym, F: Sym, angles: list[int], shared: bool = False
    ) -> None:
        self.x, self.z, self.u, self.q, self.F = x, z, u, q, F
        self.shared, self.cache = shared, StructureCache()
        self.vx, self.vz = SX.sym("vx", x.numel()), SX.sym("vz", z.numel())
        self.vu, self.az = SX.sym("vu", u.numel()), SX.sym("az", z.numel())
        self.au = SX.sym("au", u.numel())
        self.moving = [x, z, u]
        self.every, self.rates = ca.vertcat(x, z, u), ca.vertcat(self.vx, self.vz, self.vu)
        self.J, Fz = ca.jacobian(F, x), ca.jacobian(F, z)
        drift = ca.jtimes(F, ca.vertcat(z, u), ca.vertcat(self.vz, self.vu))
        self.first = ca.jtimes(F, self.every, self.rates)
        self.second = ca.jtimes(self.first, self.every, self.rates)
        pushed = ca.jtimes(F, ca.vertcat(z, u), ca.vertcat(self.az, self.au))
        self._angles = angles
        turned = self._turned(x, z)
        sines, cosines = SX.sym("sin", len(angles)), SX.sym("cos", len(angles))
        self._trig = (turned, sines, cosines)
        parts = with_trig([F, self.J, Fz, -drift, -(self.second + pushed)], *self._trig)
        self.turns_alone = not ca.depends_on(parts[0], turned)
        """Whether angles are in the equations by their sines and cosines only."""
        at = [x, z, u, q, sines, cosines]
        moving = [self.vx, self.vz, self.vu, self.az, self.au]
        self.value = ca.Function("value", at, parts[:3])
        self.push = ca.Function("push", [*at, *moving], parts[3:])

    def _turned(self, x: Sym, z: Sym) -> Sym:
        return ca.vertcat(x, z)[self._angles] if self._angles else SX(0, 1)

    def at(self, x: Sym, z: Sym, u: Sym) -> Any:
        """Return F, J and F_z with the shape's own q."""
        turned = self._turned(x, z)
        return self.value(x, z, u, self.q, ca.sin(turned), ca.cos(turned))

    @cached_property
    def third(self) -> Graph:
        """Right-hand side of the third rates as a function."""
        x, z, u = self.x, self.z, self.u
        ax, jz = SX.sym("ax", x.numel()), SX.sym("jz", z.numel())
        ju = SX.sym("ju", u.numel())
        third = ca.jtimes(self.second, self.every, self.rates)
        third += 3 * ca.jtimes(self.first, self.every, ca.vertcat(ax, self.az, self.au))
        third += ca.jtimes(self.F, ca.vertcat(z, u), ca.vertcat(jz, ju))
        (r3,) = with_trig([-third], *self._trig)
        rates = [self.vx, self.vz, self.vu, ax, self.az, self.au, jz, ju]
        return ca.Function("third", [x, z, u, self.q, *self._trig[1:], *rates], [r3])


@dataclass
class Equations:
    """Equations F(x, z, u; p) = 0, told apart from their numbers.

    ``steps`` are the operations in which an unknown or a driver takes part, ``rows`` the places of
    the results; ``numbers`` are the q as expressions over p, ``noise`` their rounding in units of
    the roundoff.
    """

    function: Graph
    p: Sym
    steps: list[Any] = field(default_factory=list)
    numbers: list[Sym] = field(default_factory=list)
    noise: list[Sym] = field(default_factory=list)
    _known: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        moving: list[list[Any]] = [
            [f"{k}.{i}" for i in range(self.function.numel_in(k))] for k in range(3)
        ]
        parameters = [(symbol, SX(0)) for symbol in self.p.elements()]
        inputs = [*moving, parameters]
        (found,) = replay(self.function, inputs, self._step, lambda number: (SX(number), SX(0)))
        self.rows = [self._place(value) for value in found]

    def _step(self, code: int, inputs: Sequence[Any]) -> Any:
        """Return (expression, noise) of what is a number, else the place of a new step."""
        if all(isinstance(value, tuple) for value in inputs):
            result = symbolic(code, *[value[0] for value in inputs])
            return result, number_rounding(code, result, inputs)
        self.steps.append((code, *map(self._place, inputs)))
        return len(self.steps) - 1

    def _place(self, value: Any) -> Any:
        """Return what stands for a value in a step: a symbol, a step, a q, a number."""
        if not isinstance(value, tuple):
            return value
        number, noise = value
        if number.is_constant():
            return (float(number),)
        place = self._known.setdefault(number.element_hash(), len(self.numbers))
        if place == len(self.numbers):
            self.numbers.append(number)
            self.noise.append(noise)
        return f"3.{place}"

    def shape(self, angles: list[int]) -> BlockShape:
        """Return the shape; `angles` are the angles among (x, z)."""
        counts = [*[self.function.numel_in(k) for k in range(3)], len(self.numbers)]
        x, z, u, q = (SX.sym(name, count) for name, count in zip("xzuq", counts, strict=True))
        values: dict[Any, Any] = {
            f"{k}.{i}": symbol
            for k, part in enumerate((x, z, u, q))
            for i, symbol in enumerate(part.elements())
        }

        def at(place: Any) -> Sym:
            return SX(place[0]) if isinstance(place, tuple) else values[place]

        for k, (code, *inputs) in enumerate(self.steps):
            values[k] = symbolic(code, *map(at, inputs))
        F = ca.vertcat(*map(at, self.rows))
        return BlockShape(x, z, u, q, F, angles, shared=True)
