"""Groups of bodies on hinges, closed by further hinges: boxes of turns."""

from __future__ import annotations

from typing import Any

from flint import arb, arb_mat

from .arithmetic import ONE, ZERO, Json, need
from .boxes import MET, WIDER, Box, Boxes, length
from .space import SpatialMechanism, cross, difference, dot


class HingeBoxes(Boxes):
    """Bodies of a group on hinges from known ones on, and the hinges besides that close it.

    With turns as unknowns it closes where points and axes of these meet, F = (P - P', a - a') = 0.
    The second derivatives of a side are at most the way from the outer hinge to P, and 1.
    """

    def __init__(
        self, m: SpatialMechanism, group: list[str], joints: list[Json], known: set[str], z: Any
    ) -> None:
        super().__init__(m, group, joints, known, z)
        frames = m.placed(z)
        self.base: dict[str, tuple[arb_mat, arb_mat]] = {
            body: (arb_mat(3, 1, frames[body][0]) * (ONE / m.size), arb_mat(frames[body][1]))
            for body in known
        }
        self.tree = list[Any]()
        """Near and far side of each hinge on which a body hangs."""
        self.chains: dict[str, list[int]] = {body: [] for body in known}
        """Hinges of the tree from known bodies to a body."""
        self.cuts: list[tuple[tuple[str, arb_mat, arb_mat], tuple[str, arb_mat, arb_mat]]] = [
            (self._side(joint, 0), self._side(joint, 1)) for joint in joints
        ]
        """Both sides of the hinges that close the group."""
        while ready := [
            (near, far, pair)
            for pair in self.cuts
            for near, far in (pair, pair[::-1])
            if near[0] in self.chains and far[0] not in self.chains
        ]:
            near, far, pair = min(ready, key=lambda sides: len(self.chains[sides[0][0]]))
            self.chains[far[0]] = [*self.chains[near[0]], len(self.tree)]
            self.tree.append((near, far))
            self.cuts.remove(pair)
        self.n, self.weights = len(self.tree), [1.0] * len(self.tree)
        hung = self.n == len(group) and self.cuts
        need(hung, "groups", f"{group} do not hang on hinges from known bodies")
        self.bends: list[list[list[arb]]] = [
            bend for cut in self.cuts for bend in self.second_derivatives(cut)
        ]

    def _side(self, joint: Json, k: int) -> tuple[str, arb_mat, arb_mat]:
        """Return a body, and of its side of a hinge the point, by the size, normal .. axis."""
        need(joint["kind"] == "revolute", "groups", f"more than hinges in {self.group}")
        body, point = joint["ends"][k]
        p = arb_mat(3, 1, self.m.points[body][point]) * (ONE / self.m.size)
        return body, p, arb_mat(joint["sides"][k]).transpose()

    def second_derivatives(self, cut: Any) -> tuple[list[list[arb]], list[list[arb]]]:
        """Return bounds of the second derivatives of P - P' and of a - a'."""
        place, axis = ([[ZERO] * self.n for _ in range(self.n)] for _ in "Pa")
        for body, p, _ in cut:
            way, far = ZERO, dict[int, arb]()
            for k in reversed(self.chains[body]):
                far[k] = way = way + length((p - self.tree[k][1][1]).entries())
                p = self.tree[k][0][1]
            for i, j in [(i, j) for i in far for j in far]:
                place[i][j], axis[i][j] = place[i][j] + far[max(i, j)], axis[i][j] + 1
        return place, axis

    def rests(self, W: arb_mat, middle: list[float], h: list[arb]) -> list[arb]:
        bent = [dot([dot(row, h) for row in bend], h) / 2 for bend in self.bends]
        return [
            dot([length(w[3 * k : 3 * k + 3]) for k in range(len(bent))], bent) for w in W.tolist()
        ]

    def first(self) -> list[Box]:
        return [(0, [0.0] * self.n, [3.15] * self.n)]

    def inside(self, mode: list[arb], box: Box) -> bool:
        for (c, s), u, r in zip(mode, map(arb, box[1]), box[2], strict=True):
            off = arb.atan2(s * u.cos() - c * u.sin(), c * u.cos() + s * u.sin())
            if not abs(off) < r * WIDER:
                return False
        return True

    def at(self, chart: int, middle: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        """Return F and its derivatives by each turn, at turns or their cosines and sines."""
        frames, axes = dict(self.base), list[Any]()
        for ((near, p, E), (far, q, D)), t in zip(self.tree, middle, strict=True):
            (r, R), (c, s) = frames[near], t if isinstance(t, tuple) else arb(t).sin_cos()[::-1]
            X, o = R * E, r + R * p
            R = X * arb_mat([[c, -s, 0], [s, c, 0], [0, 0, 1]]) * D.transpose()
            axes.append((o.entries(), X.entries()[2::3]))
            frames[far] = o - R * q, R
        F, J = list[arb](), [list[arb]() for _ in middle]
        for cut in self.cuts:
            sides = list[Any]()
            for body, p, E in cut:
                r, R = frames[body]
                sides.append(((r + R * p).entries(), (R * E).entries()[2::3], self.chains[body]))
            F += difference(*(P + a for P, a, _ in sides))
            for k, (o, axis) in enumerate(axes):
                moved = (
                    cross(axis, difference(P, o)) + cross(axis, a) if k in chain else [ZERO] * 6
                    for P, a, chain in sides
                )
                J[k] += difference(*moved)
        return F, J

    def mode(self, z: list[arb]) -> list[tuple[arb, arb]]:
        """Return cosines and sines of the turns in a mode, which has to close the group."""
        frames, found = self.m.placed(z), list[tuple[arb, arb]]()
        for (near, _, E), (far, _, D) in self.tree:
            X, n = (arb_mat(frames[near][1]) * E).entries(), (arb_mat(frames[far][1]) * D).entries()
            found.append((dot(X[::3], n[::3]), dot(X[1::3], n[::3])))
        closed = all(abs(v) < MET for v in self.at(0, found)[0])
        need(closed, "modes", f"equations are off by more than {MET} of the size")
        return found
