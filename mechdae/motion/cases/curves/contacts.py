"""The poses of a block with a contact on a curve, by a scan along the curve.

For a place s on the curve the tangent is known and one more unknown follows in closed form:
an angle turns a vector of constant length, a slide enters linearly. What is left is a function
of s; it is scanned, and Newton's method on the whole block refines every change of sign and
every near miss. Blocks with more unknowns are started from many values of them. Contacts
that lie closer together than the scan tells apart may be missed: the count is found, not proven.
"""

from __future__ import annotations

import itertools
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.equations.cases.curve_contacts import Contact
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.kernels.run.functions import local
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.motion.assembly.mode_labels import Assembling, Chooser
from mechdae.motion.assembly.other_forms import Solutions
from mechdae.types import Floats, Graph, Integers, Points, Sym, Unknowns

SCAN = 1440
"""Places looked at along a curve."""
STARTS = 24
"""Values of the other unknowns from which a block of many is started, at each place."""
COARSE = 180
ITERATIONS = 40
SEED = 20181
SAME = 1e-7
SEAM, CORNER = 1e-7, 1e-4
"""How near to the ends of a closed curve its tangents are taken, and angles that count."""
CLOSED = 1e-9
"""Residual of a solution over the size of the mechanism."""


def _along(scene: Scene, contact: Contact) -> Graph:
    """Return the angle of a contact's tangent as a function of its place."""

    def make() -> Graph:
        angle = ca.atan2(contact.tangent[1], contact.tangent[0])
        return ca.Function("t", [contact.s, scene.model.p], [angle])

    return scene.cache(("along", contact.joint.name), make)


class ContactSolver(BlockSolver):
    """Finds the solutions of a block that holds the place of a contact.

    `size` is a length of the mechanism [m].
    """

    def __init__(
        self,
        scene: Scene,
        graph: BlockGraph,
        p: Floats,
        size: float,
        slopes: dict[int, list[float]],
    ) -> None:
        super().__init__(scene, graph, p, size, slopes)
        self._all_p = p
        coordinates = [scene.unknowns[i] for i in graph.own]
        self._periods = scene.unknowns.periods[graph.own]
        self._sizes = scene.unknowns.sizes(size)[graph.own]
        self._at = next(j for j, c in enumerate(coordinates) if c.kind is PLACE)
        contacts = scene.model.contacts
        self.contact: Contact = contacts[coordinates[self._at].owner]
        # (place, angle of the tangent, their function) of every contact in the block
        self._tangents = []
        for j, k in itertools.permutations(range(len(coordinates)), 2):
            if (
                coordinates[j].kind is PLACE
                and coordinates[k].kind is ANGLE
                and coordinates[j].owner == coordinates[k].owner
            ):
                self._tangents.append((j, k, _along(scene, contacts[coordinates[j].owner])))
        bound = {self._at, *(k for j, k, _ in self._tangents if j == self._at)}
        self._others = [j for j in range(self.n) if j not in bound]
        self._closed = not self._others or (len(self._others) == 1 and self._follows())
        inputs = [graph.x, graph.z, scene.u, scene.model.p]
        results = [ca.densify(graph.F), ca.densify(graph.J)]
        self._both = graph.cache("contact", lambda: ca.Function("FJ", inputs, results))

    def _follows(self) -> bool:
        """Return whether the one other unknown follows from s: it turns a vector, or is linear."""
        j = self._others[0]
        return self.turns[j] == (1, 1) if self.angle[j] else self.constant[j][j]

    def period(self, j: int) -> float:
        """Return the period of unknown `j`; 0 where there is none."""
        if self.angle[j]:
            return super().period(j)
        return float(self._periods[j])

    def solve(self, z: Unknowns, u: Floats) -> Solutions | None:
        """Return the solutions found."""
        low, high = self.contact.range
        count = SCAN if self._closed else COARSE
        s = low + (high - low) * np.arange(count + 1) / count
        gap = 0.0
        if not self._closed:
            starts = self._many(s)
        else:
            x = self._on(s)
            g, x, gaps = self._one(x, z, u) if self._others else self._none(x, z, u)
            finite = np.isfinite(g)
            size = float(np.max(np.abs(g[finite]), initial=0.0))
            if finite.all() and np.ptp(g) <= 1e-9 * (size or 1.0) and np.abs(g).max() < 1e-9:
                return Solutions(np.zeros((0, self.n)), False, free=True)
            starts = x[self._near_roots(g)]
            gap = float(np.nanmin(gaps, initial=np.inf))
        found = self._distinct_contacts(self._newton(starts, z, u))
        return Solutions(found, False, 0.0 if len(found) or not np.isfinite(gap) else gap)

    def _on(self, s: Floats) -> Floats:
        """Return unknowns (k, n) at places of the curve, tangents set, others zero."""
        x = np.zeros((len(s), self.n))
        x[:, self._at] = s
        return self.with_tangents(x)

    def with_tangents(self, x: Unknowns) -> Floats:
        """Return unknowns (k, n) with the tangents' angles that belong to their places."""
        p = self._all_p[:, None]
        for j, k, function in self._tangents:
            x[:, k] = np.array(function(x[:, j][None, :], p)).ravel()
        return x

    @staticmethod
    def _near_roots(g: Floats) -> Integers:
        """Return the places next to a change of sign, and where |g| is least beside others."""
        with np.errstate(invalid="ignore"):
            change = np.flatnonzero(g[:-1] * g[1:] <= 0)
            size = np.where(np.isfinite(g), np.abs(g), np.inf)
            inner = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
        small = np.flatnonzero(np.concatenate([[True], inner, [True]]) & np.isfinite(g))
        return np.array(sorted({*change.tolist(), *(change + 1).tolist(), *small.tolist()}), int)

    def _none(self, x: Unknowns, z: Unknowns, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the equation that is left when the tangent's is met: the largest one."""
        F = self.F(x, z, u)
        row = int(np.argmax(np.nanmax(np.abs(F), axis=0)))
        return F[:, row] / self.size, x, np.abs(F[:, row])

    def _one(self, x: Unknowns, z: Unknowns, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return g(s) with the one other unknown eliminated, and that unknown's values."""
        k = self._others[0]

        def at(value: float) -> Any:
            y = x.copy()
            y[:, k] = value
            F = self.F(y, z, u)
            return F[:, rows] if rows is not None else F

        rows = None
        probe = at(0.7)
        largest = np.nanmax(np.abs(probe), axis=0)
        rows = np.sort(np.argsort(largest)[-2:]) if self.n > 2 else np.arange(self.n)
        if not self.angle[k]:
            a, b = at(0.0), at(self.size) - at(0.0)
            g = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / self.size**2
            share = -np.sum(a * b, axis=1) / np.sum(b * b, axis=1)
            x[:, k] = share * self.size
            return g, x, np.abs(g) * self.size
        middle = (at(0.0) + at(np.pi)) / 2
        along, across = at(0.0) - middle, at(np.pi / 2) - middle
        det = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            c = -(middle[:, 0] * across[:, 1] - middle[:, 1] * across[:, 0]) / det
            d = -(along[:, 0] * middle[:, 1] - along[:, 1] * middle[:, 0]) / det
        x[:, k] = np.arctan2(d, c)
        radius = np.hypot(c, d)
        arm = np.sqrt(np.abs(det))
        return radius - 1.0, x, np.abs(radius - 1.0) * arm

    def _many(self, s: Floats) -> Points:
        """Return starts over the curve and over values of all other unknowns."""
        random = np.random.default_rng(SEED)
        x = np.repeat(self._on(s), STARTS, axis=0)
        tangents = {k for _, k, _ in self._tangents}
        for j in self._others:
            if j in tangents:
                continue
            reach = np.pi if self._periods[j] or self.angle[j] else 1.0
            x[:, j] = random.uniform(-reach, reach, len(x)) * self._sizes[j]
        return self.with_tangents(x)

    def _newton(self, x: Unknowns, z: Unknowns, u: Floats) -> Any:
        """Return the starts (k, n) that Newton's method leads to a solution."""
        x = x.copy()
        still = np.ones(len(x), bool)
        done = np.zeros(len(x), bool)
        for _ in range(ITERATIONS):
            rows = np.flatnonzero(still & ~done)
            if not rows.size:
                break
            F, J = self._values(x[rows], z, u)
            fine = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
            still[rows[~fine]] = False
            rows, F, J = rows[fine], F[fine], J[fine]
            if not rows.size:
                break
            weighted = J * self._sizes
            step = np.einsum("kij,kj->ki", np.linalg.pinv(weighted, rcond=1e-13), F)
            size = np.abs(step).max(axis=1)
            step *= np.minimum(1.0, 0.3 / np.maximum(size, 1e-300))[:, None]
            x[rows] -= step * self._sizes
            done[rows] = size < 1e-12
        x = x[done & still]
        # where the block is singular a pole of attraction may be no solution
        F = self.F(x, z, u) if len(x) else np.zeros((0, self.n))
        return x[np.abs(F).max(axis=1, initial=0.0) <= CLOSED * self.size]

    def _values(self, x: Unknowns, z: Unknowns, u: Floats) -> tuple[Floats, Floats]:
        k, n = len(x), self.n
        fixed = [np.tile(np.asarray(v, float)[:, None], k) for v in (z, u, self._all_p)]
        mapped = self._both.map(k) if k > 1 else self._both
        F, J = (np.array(part) for part in mapped(x.T, *fixed))
        return F.T, J.reshape(n, k, n).transpose(1, 0, 2)

    def _distinct_contacts(self, x: Unknowns) -> Floats:
        """Return each solution once, closed curves within their range."""
        low, high = self.contact.range
        distinct: list[Floats] = []
        for row in x:
            if self._periods[self._at]:
                row[self._at] = low + np.remainder(row[self._at] - low, high - low)
            gaps = [
                np.abs(np.where(periodic, np.remainder(d + turn / 2, turn) - turn / 2, d)).max()
                for d in ((row - other) / self._sizes for other in distinct)
                for turn in [2 * np.pi]
                for periodic in [self._periods > 0]
            ]
            if not gaps or min(gaps) > SAME:
                distinct.append(row)
        return np.array(distinct).reshape(-1, self.n)


def contact_solver(
    scene: Scene, graph: BlockGraph, p: Floats, size: float, slopes: dict[int, list[float]]
) -> BlockSolver | None:
    """Return what solves a block that holds the place of a contact, None for others."""
    if graph.redundant or not any(scene.unknowns.places[graph.own]):
        return None
    plain = BlockSolver(scene, graph, p, size, slopes)
    return plain if plain.linear else ContactSolver(scene, graph, p, size, slopes)


class Contacts(Chooser):
    """The contacts of a scene at solved poses: where they are, whether they touch."""

    def __init__(self, assembler: Assembling) -> None:
        self.scene: Scene = assembler.scene
        self.p: Floats = assembler.p

    def of(self, group: Group) -> list[Contact]:
        """Return the contacts of a group's curve joints."""
        every = self.scene.model.contacts
        return [every[name] for name in group.joints if name in every]

    def notes(self) -> list[str]:
        """Return what to know about closed curves whose ends meet at an angle."""
        notes = []
        joints = {name for group in self.scene.groups for name in group.joints}
        for name, contact in self.scene.model.contacts.items():
            if name not in joints or not contact.wrapped:
                continue
            function = self._tangent(contact)
            low, high = contact.range
            step = SEAM * (high - low)
            first, last = (np.array(function(s, self.p)) for s in (low + step, high - step))
            cross = float(last[0, 0] * first[1, 0] - last[1, 0] * first[0, 0])
            angle = abs(np.arctan2(cross, float(np.sum(first * last))))
            if angle > CORNER:
                notes.append(
                    f"joint {name}: the curve has a corner of {np.degrees(angle):.3g} degrees "
                    f"where it closes, velocities jump there"
                )
        return notes

    def _tangent(self, contact: Contact) -> Graph:
        inputs = [contact.s, self.scene.model.p]
        return self.scene.cache(
            ("tangent", contact.joint.name), lambda: ca.Function("t", inputs, [contact.tangent])
        )

    def of_group(self, group: Group, poses: list[Floats], u: Floats) -> list[Floats]:
        """Return the poses at which all contacts of a group touch."""
        return [x for x in poses if self._touch(group, x, u)]

    def _touch(self, group: Group, x: Unknowns, u: Floats) -> bool:
        """Return whether all contacts of a group lie on their curves, rollers outside them."""
        for contact in self.of(group):
            s, ahead = self._at(contact, x, u)
            low, high = contact.range
            slack = 1e-12 * (high - low)
            if not contact.closed and not low - slack <= s <= high + slack:
                return False
            if contact.rolls and not ahead > 0:
                return False
        return True

    def place(self, joint: str, x: Unknowns, u: Floats) -> float:
        """Return s of a contact; of a closed curve within its range."""
        contact = self.scene.model.contacts[joint]
        s = self._at(contact, x, u)[0]
        low, high = contact.range
        return low + float(np.remainder(s - low, high - low)) if contact.closed else s

    def places(self, group: Group, x: Floats, u: Floats) -> dict[str, float]:
        """Return s of a group's contacts."""
        names = [contact.joint.name for contact in self.of(group)]
        return {name: self.place(name, x, u) for name in names}

    def rank(self, group: Group, x: Floats, u: Floats) -> float | None:
        """Return s of a group's first contact."""
        contacts = self.of(group)
        return self.place(contacts[0].joint.name, x, u) if contacts else None

    def _at(self, contact: Contact, x: Unknowns, u: Floats) -> tuple[float, float]:
        """Return s, and whether the tangent's angle points along growing s (above 0)."""

        def make() -> Sym:
            ahead = ca.dot(contact.tangent, contact.direction) if contact.rolls else ca.SX(1)
            return ca.vertcat(contact.s, ahead)

        value = local(self.scene, ("contact", contact.joint.name), make)
        s, ahead = value(x, u, self.p).ravel()
        return float(s), float(ahead)
