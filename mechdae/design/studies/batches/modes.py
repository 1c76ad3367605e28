"""The pose that each set starts from: the assembly mode nearest to its own sketch."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.design.studies.batches.numbers import Numbers, Sketches
from mechdae.kernels.graphs.closed_form import ClosedForm
from mechdae.kernels.run.functions import Batch
from mechdae.motion.assembly.closed_start import HALF_TURN, MARGIN, looks_like_degrees, turns_tell
from mechdae.motion.assembly.nearest_mode import SketchNumber, told_apart
from mechdae.motion.kinematics.prepared import Setting
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrices, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.assembly.nearest_mode import Sketched

MOST = 64
"""Modes that are compared in one part of the mechanism, at most."""


@dataclass(frozen=True)
class Starts:
    """Where lanes begin: unknowns (k, nx), signs of the determinants (k, nb).

    ``sure`` (k,) tells which are known, ``open`` (k,) which do not assemble on any mode.
    """

    x: Matrix
    sign: Matrix
    sure: Booleans
    open: Booleans


class StartingModes:
    """Chooses the modes that lanes start on."""

    def __init__(self, setting: Setting, form: ClosedForm) -> None:
        self.setting, self.form, self.graphs = setting, form, setting.graphs
        self.assembler, self.scene = setting.assembler, setting.scene
        self.sketched: Sketched = self.assembler.sketched
        self.parts: list[list[int]] = [self._blocks(part) for part in self.sketched.parts]

    @property
    def usable(self) -> bool:
        """Whether the modes are few, and whole turns of their angles make no difference."""
        if turns_tell(self.assembler) or looks_like_degrees(self.assembler.sketch):
            return False
        return all(2 ** int(self.form.branches[blocks].sum()) <= MOST for blocks in self.parts)

    def _blocks(self, part: list[int]) -> list[int]:
        groups = [self.scene.groups[k] for k in part]
        return [b for group in groups for b in self.assembler.blocks_of(group)]

    def __call__(self, numbers: Numbers, u: Floats) -> Starts:
        """Return the starts of lanes at the driver's values `u` (k,)."""
        count, g = len(u), self.graphs
        x, sign = np.zeros((count, g.nx)), np.ones((count, g.nb))
        sure, nowhere = np.ones(count, bool), np.zeros(count, bool)
        for part, blocks in zip(self.sketched.parts, self.parts, strict=True):
            if not blocks:
                continue
            columns = [i for b in blocks for i in g.blocks[b].own]
            poses, signs, far, doubtful = self._modes(part, blocks, numbers, u)
            order = np.argsort(far, axis=0, kind="stable")
            rows = np.arange(count)
            best = order[0]
            none = ~np.isfinite(far[best, rows])
            nowhere |= none & ~doubtful
            sure &= ~doubtful
            if len(far) > 1:
                near, next_ = far[best, rows], far[order[1], rows]
                with np.errstate(invalid="ignore"):
                    sure &= none | ~np.isfinite(next_) | told_apart(next_, near)
            x[:, columns] = poses[best, rows][:, columns]
            sign[:, blocks] = signs[best]
        turned, halves = self._turned(x, numbers.sketches)
        return Starts(turned, sign, (sure & ~halves) | nowhere, nowhere)

    def _modes(
        self, part: list[int], blocks: list[int], numbers: Numbers, u: Floats
    ) -> tuple[Matrices, Floats, Floats, Booleans]:
        """Return poses (m, k, nx), signs (m, blocks), squares by which they are off (m, k).

        A mode that does not assemble is infinitely far; the last part tells for which lanes that
        is not sure.
        """
        count, g = len(u), self.graphs
        branching = [b for b in blocks if self.form.branches[b]]
        choices = list(itertools.product((1.0, -1.0), repeat=len(branching)))
        poses, far = [], []
        signs = np.ones((len(choices), len(blocks)))
        doubtful = np.zeros(count, bool)
        for m, choice in enumerate(choices):
            sign = np.ones((count, g.nb))
            sign[:, branching] = choice
            x, depth = self.form.poses(u[:, None], sign, numbers.p)
            inner = depth[:, blocks]
            with np.errstate(invalid="ignore"):
                doubtful |= (np.abs(inner) <= MARGIN).any(axis=1)
                assembled = (inner > 0).all(axis=1)
                off = self._far(part, x, u, numbers)
            for k, b in enumerate(blocks):
                signs[m, k] = sign[0, b]
            poses.append(x)
            far.append(np.where(assembled & np.isfinite(off), off, np.inf))
        return np.array(poses), signs, np.array(far), doubtful

    def _turned(self, x: Unknowns, sketches: Sketches) -> tuple[Floats, Booleans]:
        """Return unknowns with angles on the turns that sketches ask for, and which are between."""
        between = np.zeros(len(x), bool)
        for i, c in enumerate(self.scene.unknowns):
            if c.kind is ANGLE:
                turns = (x[:, i] - sketches.angles.get(c.owner, 0.0)) / (2 * np.pi)
                x[:, i] -= 2 * np.pi * np.round(turns)
                between |= np.abs(np.abs(turns - np.round(turns)) - 0.5) < HALF_TURN
        return x, between

    def _far(self, part: list[int], x: Unknowns, u: Floats, numbers: Numbers) -> Floats:
        """Return the sums of squares by which poses of lanes are off their sketches."""
        total = np.zeros(len(x))
        for entry in self.sketched.entries:
            if entry.stage in part:
                total += self._gaps(entry, x, u, numbers) ** 2
        return total

    def _gaps(self, entry: SketchNumber, x: Unknowns, u: Floats, numbers: Numbers) -> Floats:
        value: Batch = self.graphs.cache(
            ("sketched", entry.coordinate), lambda: Batch(entry.value.function)
        )
        own_x, own_u, own_p = entry.value.held
        found = value(x[:, own_x], u[:, None][:, own_u], numbers.p[:, own_p])[0][:, 0]
        c, sketches = entry.coordinate, numbers.sketches
        wanted = sketches.angles[c.part] if c.kind == "body angle" else sketches.places[c]
        gap = (found - wanted) / (1.0 if c.is_angle else numbers.scale)
        return gap - 2 * np.pi * np.round(gap / (2 * np.pi)) if entry.turns else gap
