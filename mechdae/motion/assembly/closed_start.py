"""The pose nearest to the sketch of a mechanism of dyads, in one call of one kernel.

All modes are written down in closed form with how far each is from the sketch. What the closed
form does not tell beyond doubt is left to the assembler.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.kernels.graphs.closed_form import ClosedForm, closed_form
from mechdae.kernels.run.functions import Call, without_repeats
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.nearest_mode import told_apart
from mechdae.motion.setup.likely_typos import MANY
from mechdae.motion.setup.scales import scale_of
from mechdae.types import Floats, Graph, Sym

if TYPE_CHECKING:
    from mechdae.motion.assembly.nearest_mode import Sketched

SX = ca.SX
MOST = 16
"""Modes of one part of the mechanism that are compared in one call, at most."""
MARGIN = 1e-9
"""D over A^2 + B^2 below which it is not told in closed form whether a dyad assembles."""
HALF_TURN = 1e-6
"""Turns by which an angle is off half a turn from its sketch at least."""


def looks_like_degrees(sketch: Mapping[str, float]) -> bool:
    """Return whether an angle of a sketch looks like degrees without a suffix."""
    return any(abs(angle) > MANY for angle in sketch.values())


def turns_tell(assembler: Assembler) -> bool:
    """Return whether whole turns of geared bodies tell modes apart."""
    for b, graph in enumerate(assembler.graphs.blocks):
        periods = zip(assembler.solvers[b].turning, assembler.turns.lattices[b].single, strict=True)
        if any(period and not (one and period < 3 * np.pi) for period, one in periods):
            return True
        if any(assembler.turns.whole.told(i) for i in graph.own):
            return True
    return False


class ClosedStart:
    """The mode nearest to a sketch that does not change with the numbers.

    Parameters
    ----------
    assembler
        Of a mechanism of the structure; its sketch is the one that modes are compared with.
    """

    def __init__(self, assembler: Assembler, form: ClosedForm) -> None:
        self.graphs, self.form = assembler.graphs, form
        self.sketched: Sketched = assembler.sketched
        self.wanted: Floats = np.array([entry.wanted for entry in self.sketched.entries])
        owners = [c.owner for c in assembler.scene.unknowns]
        self.angles: Floats = np.array([assembler.sketch.get(owner, 0.0) for owner in owners])
        groups = assembler.scene.groups
        self.parts: list[list[int]] = [
            [b for k in part for b in assembler.blocks_of(groups[k])]
            for part in self.sketched.parts
        ]
        self.columns: list[list[int]] = [
            [i for b in blocks for i in self.graphs.blocks[b].own] for blocks in self.parts
        ]
        self.choices: list[list[Floats]] = [self._choices(blocks) for blocks in self.parts]
        self._call: Call = self.graphs.cache("closed start", lambda: Call(self._function()))

    @property
    def usable(self) -> bool:
        """Whether the modes are few."""
        return all(len(choices) <= MOST for choices in self.choices)

    def _choices(self, blocks: list[int]) -> list[Floats]:
        """Return the signs (nb,) of all modes of some blocks, ones for others."""
        branching = [b for b in blocks if self.form.branches[b]]
        found = []
        for choice in itertools.product((1.0, -1.0), repeat=min(len(branching), MOST)):
            sign = np.ones(self.graphs.nb)
            sign[branching] = choice
            found.append(sign)
        return found

    def _function(self) -> Graph:
        """Return (u, sketched values, sketched angles, p) -> length, and of each part's modes.

        Those are unknowns (nx, m), least D over A^2 + B^2 and its least size, squares of the
        distance from the sketch, least share of a turn by which an angle is off half a turn, and
        the largest turn of a body from its sketch.
        """
        g, scale = self.graphs, scale_of(self.graphs.scene.model)
        u, wanted = SX.sym("u", g.nu), SX.sym("wanted", len(self.wanted))
        angles = SX.sym("angles", g.nx)
        results: list[Sym] = [scale]
        for part, blocks, choices in zip(
            self.sketched.parts, self.parts, self.choices, strict=True
        ):
            columns = [self._mode(part, blocks, sign, u, wanted, angles, scale) for sign in choices]
            results += [ca.horzcat(*rows) for rows in zip(*columns, strict=True)]
        inputs = [u, wanted, angles, g.p]
        return without_repeats("start", inputs, [ca.densify(part.T) for part in results])

    def _mode(
        self, part: list[int], blocks: list[int], sign: Floats, u: Sym, wanted: Sym, angles: Sym,
        scale: Sym,
    ) -> tuple[Sym, ...]:  # fmt: skip
        """Return unknowns, depths, distance, share of a turn and turn of one mode of a part."""
        x, _, _, depth = self.form.symbolic(u, SX(sign))
        inner = depth[blocks] if blocks else SX(1)
        far, between, worst = SX(0), SX(1), SX(0)
        for n, entry in enumerate(self.sketched.entries):
            if entry.stage in part:
                places = zip((x, u, self.graphs.p), entry.value.held, strict=True)
                value = entry.value.function(*[v[i] if i else SX(0, 1) for v, i in places])
                gap = (value - wanted[n]) / (1 if entry.coordinate.is_angle else scale)
                gap = ca.remainder(gap, 2 * np.pi) if entry.turns else gap
                far += gap**2
                if entry.coordinate.kind == "body angle":
                    worst = ca.fmax(worst, ca.fabs(gap))
        for i in (i for b in blocks for i in self.graphs.blocks[b].own):
            if self.graphs.scene.unknowns[i].kind is ANGLE:
                turned = ca.remainder(x[i] - angles[i], 2 * np.pi)
                x[i] = angles[i] + turned
                between = ca.fmin(between, 0.5 - ca.fabs(turned) / (2 * np.pi))
        least = [ca.mmin(inner), ca.mmin(ca.fabs(inner))]
        return x, *least, far, between, worst

    def __call__(self, u: Floats, p: Floats) -> tuple[float, Floats, Floats] | None:
        """Return length, unknowns and signs of the nearest mode at drivers `u`; None: not told."""
        length, *modes = self._call(u, self.wanted, self.angles, p)
        x, sign = np.empty(self.graphs.nx), np.ones(self.graphs.nb)
        for k, (blocks, columns) in enumerate(zip(self.parts, self.columns, strict=True)):
            if not blocks:
                continue
            poses, depth, doubt, far, between, worst = modes[6 * k : 6 * k + 6]
            best = _nearest(depth.tolist(), doubt.tolist(), far.tolist())
            if best is None or not between[best] >= HALF_TURN or worst[best] > math.pi / 2:
                return None
            x[columns] = poses.reshape(len(far), -1)[best, columns]
            sign[blocks] = self.choices[k][best][blocks]
        return float(length[0]), x, sign


def closed_start(assembler: Assembler) -> ClosedStart | None:
    """Return the closed form of an assembler's modes, None where there is none."""
    graphs, scene = assembler.graphs, assembler.scene
    if scene.redundant or scene.checks or graphs.contacts or turns_tell(assembler):
        return None
    if looks_like_degrees(assembler.sketch):
        return None
    form = closed_form(graphs, assembler.p)
    if not isinstance(form, ClosedForm):
        return None
    found = ClosedStart(assembler, form)
    return found if found.usable else None


def _nearest(depth: list[float], doubt: list[float], far: list[float]) -> int | None:
    """Return the mode nearest to the sketch, None where none is or it is not told."""
    if any(least <= MARGIN for least in doubt):
        return None
    assembled = [k for k, least in enumerate(depth) if least > 0 and far[k] == far[k]]
    if not assembled:
        return None
    first, *rest = sorted(assembled, key=far.__getitem__)
    if rest and not told_apart(far[rest[0]], far[first]):
        return None
    return first
