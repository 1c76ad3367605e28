"""The mode that each set of a study starts on: the one nearest to its own sketch.

In a mechanism of dyads without gears every group has two modes at most, told apart by the
signs of the blocks' determinants. Where Newton's method leads from each mode of the first set to
one of the same signs in another set, these are all modes of that set, and its sketch chooses among
them. Sets for which this is not so are left to be solved one by one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.assembly.nearest_mode import SketchNumber, told_apart
from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.kernels.run.batch import Batch
from mechdae.kinematics.prepared import Setting
from mechdae.setup.drivers import Sketch
from mechdae.setup.scales import Constants

MOST = 32
"""Modes that all sets are led to, at most."""


@dataclass(frozen=True)
class Starts:
    """Where lanes begin: unknowns (k, nx), signs of the blocks (k, nb), and which are sure."""

    x: Any
    sign: Any
    sure: Any


class OwnModes:
    """Chooses the modes that lanes start on.

    Parameters
    ----------
    setting
        The prepared task, its assembler with the sketch of the first set.
    u, x
        Driver values and pose of the first set's sketch.
    """

    def __init__(self, setting: Setting, u: Any, x: Any) -> None:
        self.assembler, self.scene, self.u, self.x = setting.assembler, setting.scene, u, x
        self.sketched = self.assembler.sketched
        self.modes = [self._modes(part) for part in self.sketched.parts]
        self._values: dict[int, Batch] = {}
        self._size = Batch(_size_of(setting))

    @property
    def usable(self) -> bool:
        """Whether all modes of the first set are known, and tell those of other sets."""
        found = [modes for modes in self.modes if modes is not None]
        return len(found) == len(self.modes) and sum(map(len, found)) <= MOST + len(found)

    def _modes(self, part: list[int]) -> list[Any] | None:
        """Return poses of the whole mechanism, one for each mode of dependent groups."""
        a, found = self.assembler, [self.x]
        for k in part:
            group = self.scene.groups[k]
            blocks = a.blocks_of(group)
            if not blocks:
                continue
            linear = all(a.solvers[b].linear for b in blocks)
            geared = any(not one for b in blocks for one in self._single(b))
            if group.driven or geared or not (linear or group.is_dyad):
                return None
            ahead = []
            for x in found:
                poses, sure, _ = a.candidates(group, x, self.u, search=False, measured=False)
                if not sure or len(poses) != (1 if linear else 2):
                    return None
                ahead += poses
            found = ahead
            if len(found) > MOST:
                return None
        return found

    def _single(self, b: int) -> list[bool]:
        """Return by angle of a block whether whole turns of it make no difference."""
        turning = self.assembler.solvers[b].turning
        pairs = zip(turning, self.assembler.lattices[b].single, strict=True)
        return [one and period < 3 * np.pi for period, one in pairs if period]

    def starts(
        self, lockstep: Any, numbers: Sequence[Constants], sketches: Sequence[Sketch], s: float
    ) -> Starts:
        """Return the start of each lane; `sketches` are theirs, or one for all of them."""
        p = np.array([number.p for number in numbers])
        sizes = self._size(p)[0][:, 0]
        x = np.tile(self.x, (len(p), 1))
        sure = np.ones(len(p), bool)
        sign: Any = None
        for part, modes in zip(self.sketched.parts, self.modes, strict=True):
            own = self._columns(part)
            if not own or modes is None:
                continue
            states = [lockstep.begin(numbers, mode, s) for mode in modes]
            blocks = [b for k in part for b in self.assembler.blocks_of(self.scene.groups[k])]
            for start in states:
                sure &= start.sure[:, blocks].all(axis=1)
            sign = states[0].sign.copy() if sign is None else sign
            far = np.array([self._far(part, start.x, p, sketches, sizes) for start in states])
            order = np.argsort(far, axis=0, kind="stable")
            rows = np.arange(len(p))
            if len(modes) > 1:
                near, next_ = (far[order[k], rows] for k in (0, 1))
                sure &= told_apart(next_, near)
            for k, start in enumerate(states):
                chosen = np.flatnonzero(order[0] == k)
                x[chosen[:, None], own] = start.x[chosen[:, None], own]
                sign[chosen[:, None], blocks] = start.sign[chosen[:, None], blocks]
        if sign is None:  # nothing to choose
            start = lockstep.begin(numbers, self.x, s)
            return Starts(start.x, start.sign, start.sure.all(axis=1))
        return Starts(self._turned(x, sketches), sign, sure)

    def _turned(self, x: Any, sketches: Sequence[Sketch]) -> Any:
        """Return unknowns with each angle on the turn that the lane's sketch asks for."""
        for i, c in enumerate(self.scene.unknowns):
            if c.kind is ANGLE:
                wanted = np.array([sketch.angles.get(c.owner, 0.0) for sketch in sketches])
                x[:, i] -= 2 * np.pi * np.round((x[:, i] - wanted) / (2 * np.pi))
        return x

    def _columns(self, part: list[int]) -> list[int]:
        groups = [self.scene.groups[k] for k in part]
        blocks = [b for group in groups for b in self.assembler.blocks_of(group)]
        return [i for b in blocks for i in self.assembler.graphs.blocks[b].own]

    def _far(self, part: list[int], x: Any, p: Any, sketches: Sequence[Sketch], sizes: Any) -> Any:
        """Return the sums of squares by which poses of lanes are off their sketches."""
        total = np.zeros(len(x))
        for n, entry in enumerate(self.sketched.entries):
            if entry.stage in part:
                total += self._gaps(n, entry, x, p, sketches, sizes) ** 2
        return total

    def _gaps(
        self, n: int, entry: SketchNumber, x: Any, p: Any, sketches: Sequence[Sketch], sizes: Any
    ) -> Any:
        if n not in self._values:
            self._values[n] = Batch(entry.value.function)
        own_x, own_u, own_p = entry.value.held
        u = np.tile(self.u, (len(x), 1))
        value = self._values[n](x[:, own_x], u[:, own_u], p[:, own_p])[0][:, 0]
        wanted = np.array([wanted_by(sketch, entry) for sketch in sketches])
        size = 1.0 if entry.coordinate.is_angle else sizes
        gap = (value - wanted) / size
        return gap - 2 * np.pi * np.round(gap / (2 * np.pi)) if entry.turns else gap


def wanted_by(sketch: Sketch, entry: SketchNumber) -> float:
    """Return what a sketch says of a coordinate."""
    c = entry.coordinate
    return sketch.angles[c.part] if c.kind == "body angle" else sketch.places[c]


def _size_of(setting: Setting) -> Any:
    """Return the function of the parameters that gives the mechanism's size, see `numbers`."""
    model = setting.scene.model
    mechanism = model.mechanism
    spans = [ca.SX(0)]
    parts: list[tuple[str, Any]] = [("ground", mechanism.ground), *mechanism.bodies.items()]
    for name, body in parts:
        for axis in mechanism.axes if len(body.points) > 1 else "":
            places = [ca.SX(model.numbers[f"{name}.{point}.{axis}"]) for point in body.points]
            spans.append(ca.mmax(ca.vertcat(*places)) - ca.mmin(ca.vertcat(*places)))
    for name, joint in mechanism.joints.items():
        if joint.bar:
            spans.append(ca.SX(model.numbers[f"{name}.length"]))
    largest = ca.mmax(ca.vertcat(*spans))
    return ca.Function("size", [model.p], [ca.if_else(largest == 0, 1.0, largest)])
