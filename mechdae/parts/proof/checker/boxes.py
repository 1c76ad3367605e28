"""Boxes in space: groups on hinges, bodies on distances; all places of a group are looked at.

All equations count, redundant ones included: what meets them is near a mode, or excluded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

from flint import arb, arb_mat

from .arithmetic import ONE, ZERO, Dual, Json, need
from .space import SpatialMechanism, cross, difference, dot, rotation

MOST_BOXES = 200_000
MET = 1e-9
"""How far equations may be off, of the size, that count as met."""
NEAR = 1e-6
"""What meets the equations is so near a mode."""
WIDER = 1.25
"""How much wider than a box another one is that a mode may lie in."""
ALONE = 0.9
"""Bound of |1 - Y J| below which there is one solution in a box."""
SHRUNK = 0.7
"""A box that shrinks by less is halved."""

Box = tuple[int, list[float], list[float]]
"""Chart, middle and half widths."""


def length(values: Iterable[arb]) -> arb:
    """Return an upper bound of the length of a vector."""
    return sum((v * v for v in values), ZERO).sqrt().abs_upper()


def identity(n: int) -> arb_mat:
    return arb_mat(n, n) + 1


class Boxes(ABC):
    """All places of `n` unknowns x of a group, looked at box by box.

    A kind of group has its unknowns in charts: `first` are boxes of all, `at` the equations F and
    their derivatives J in the middle of one, `rests` how much each of combinations W F may differ
    from its tangent in a box, by terms of degree 2 to `order`.
    """

    n: int
    weights: list[float]
    """Of each unknown: the widest by them is halved."""
    order = 2
    met = MET

    def __init__(
        self, m: SpatialMechanism, group: list[str], joints: list[Json], known: set[str], z: Any
    ) -> None:
        self.m, self.group = m, group

    @abstractmethod
    def first(self) -> list[Box]:
        """Return boxes that hold all places."""

    @abstractmethod
    def at(self, chart: int, middle: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        """Return F and its derivatives by each unknown."""

    @abstractmethod
    def rests(self, W: arb_mat, middle: list[float], h: list[arb]) -> list[arb]:
        """Return how much combinations W F differ from their tangents at most."""

    @abstractmethod
    def mode(self, z: list[arb]) -> list[arb]:
        """Return the place of a mode in balls."""

    @abstractmethod
    def inside(self, mode: list[arb], box: Box) -> bool:
        """Whether a mode is in a box that is `WIDER`."""

    def look(self, boxes: list[Box], modes: list[list[arb]]) -> int:
        """Return in how many boxes there is nothing but the modes."""
        count = 0
        while boxes:
            (chart, middle, half), count = boxes.pop(), count + 1
            left = self.shrunk((chart, middle, half), modes)
            if left is None:
                continue
            if min(a / b for a, b in zip(left[2], half, strict=True)) <= SHRUNK:
                boxes.append(left)
                continue
            chart, middle, half = left
            k = max(range(self.n), key=lambda i: half[i] * self.weights[i])
            open_ = count > MOST_BOXES or half[k] < NEAR / 10
            need(not open_, "modes", f"{self.group} may be near {middle}: {count} boxes")
            halved = [r * (0.5 + 1e-9 if i == k else 1) for i, r in enumerate(half)]
            for step in (half[k] / 2, -half[k] / 2):
                moved = [v + step * (i == k) for i, v in enumerate(middle)]
                boxes.append((chart, moved, halved))
        return count

    def shrunk(self, box: Box, modes: list[list[arb]]) -> Box | None:
        """Return a box of all that is left in a box, None where that is nothing or a mode."""
        chart, middle, half = box
        n, h, (F, J) = self.n, [arb(v) for v in half], self.at(chart, middle)
        W = self._combinations(arb_mat(J).mid())
        values, slopes = (W * arb_mat(len(F), 1, F)).entries(), W * arb_mat(J).transpose()
        rows = zip(W.tolist(), values, slopes.tolist(), self.rests(W, middle, h), strict=True)
        alone, ends = True, list[tuple[float, float]]()
        for i, (w, value, slope, rest) in enumerate(rows):
            off = sum(map(abs, w), ZERO) * self.met
            if abs(value) > dot(map(abs, slope), h) + rest + off:
                return None
            if i < n:  # of the rows of Y
                slope[i] -= 1
                loss, moved = dot(map(abs, slope), h), rest * self.order * WIDER ** (self.order - 1)
                near = off * max(half) < h[i] * (1 - ALONE) * NEAR / 2
                alone = alone and bool(loss + moved < h[i] * ALONE and near)
                reach = arb(0, (loss + rest + off).upper()) - value
                low, high = float(reach.lower()) - 1e-12, float(reach.upper()) + 1e-12
                ends.append((max(-half[i], low), min(half[i], high)))
        if alone and any(self.inside(mode, box) for mode in modes):
            return None
        return (
            chart,
            [c + (a + b) / 2 for c, (a, b) in zip(middle, ends, strict=True)],
            [(b - a) / 2 * (1 + 1e-9) + 1e-14 for a, b in ends],
        )

    def _combinations(self, T: arb_mat) -> arb_mat:
        """Return rows W: of Y near the inverse of J, of all equations, of 1 - J Y."""
        Y = (T * T.transpose() + identity(self.n) * arb(1e-9)).inv() * T
        every = identity(T.ncols())
        blocks = (Y, every, every - T.transpose() * Y)
        return arb_mat([row for block in blocks for row in block.mid().tolist()])


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


class LegBoxes(Boxes):
    """The body by its quaternion q and the place T of its origin, by the mechanism's size.

    One entry of q is 1, the others are at most 1: a chart for each of four. With N = |q|^2 and
    R~ = N R the equations are linear in (N T.T, N, N T, R~, R~' T).
    """

    n, order, met = 6, 4, 4 * MET

    def __init__(
        self, m: SpatialMechanism, group: list[str], joints: list[Json], known: set[str], z: Any
    ) -> None:
        super().__init__(m, group, joints, known, z)
        self.weights: list[float] = [2.0] * 3 + [1.0] * 3
        frames, rows = m.placed(z), list[list[arb]]()
        self.legs: list[tuple[list[arb], list[arb], arb]] = list[tuple[list[arb], list[arb], arb]]()
        """Known point, point of the body, length."""
        for joint in joints:
            distance = joint["kind"] == "distance" and len(group) == 1
            need(distance, "groups", f"more than distances of a body in {group}")
            one, other = joint["ends"][:: 1 if joint["bodies"][1] in group else -1]
            b = [v / m.size for v in m.place(one, frames)]
            p = [v / m.size for v in m.points[other[0]][other[1]]]
            square = joint["square"] / arb(m.size) ** 2
            self.legs.append((b, p, square.sqrt()))
            linear = [ONE, dot(p, p) + dot(b, b) - square, *(v * -2 for v in b)]
            rows.append([*linear, *(v * w * -2 for v in b for w in p), *(v * 2 for v in p)])
        self.C = arb_mat(rows)

    def first(self) -> list[Box]:
        reaches = [reach + length(b) + length(p) for b, p, reach in self.legs]
        far = min(float(reach.upper()) for reach in reaches) * (1 + 1e-9)
        return [(chart, [0.0] * 6, [1.0] * 3 + [far] * 3) for chart in range(4)]

    def shrunk(self, box: Box, modes: list[list[arb]]) -> Box | None:
        """Return what is left of a box, None also where a leg is too long or short all over it."""
        chart, middle, half = box
        q, T = [*map(arb, middle[:chart]), ONE, *map(arb, middle[chart:3])], middle[3:]
        r, t, N = length(map(arb, half[:3])), length(map(arb, half[3:])), length(q)
        R = rotation(*(v / dot(q, q).sqrt() for v in q))
        turned = (r * 2 / ONE.max(N - r)).min(arb(2))
        for b, p, reach in self.legs:
            way = [v + dot(row, p) - c for v, row, c in zip(T, R, b, strict=True)]
            off = abs(dot(way, way).sqrt() - reach)
            if off > t + turned * length(p) + MET / reach:
                return None
        return super().shrunk(box, modes)

    def at(self, chart: int, middle: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        x = [Dual(arb(v), {k: ONE}) for k, v in enumerate(middle)]
        q, T = [*x[:chart], ONE, *x[chart:3]], x[3:]
        N = dot(q, q)
        R = [
            [v + (N - ONE) * (i == k) for k, v in enumerate(row)]
            for i, row in enumerate(rotation(*q))
        ]
        terms = [N * dot(T, T), N, *(N * v for v in T), *(v for row in R for v in row)]
        terms += [dot(T, column) for column in zip(*R, strict=True)]
        J = self.C * arb_mat([[term.d.get(k, ZERO) for k in range(6)] for term in terms])
        F = (self.C * arb_mat(17, 1, [term.v for term in terms])).entries()
        return F, J.transpose().tolist()

    def rests(self, W: arb_mat, middle: list[float], h: list[arb]) -> list[arb]:
        T, r, t, found = middle[3:], length(h[:3]), length(h[3:]), list[arb]()
        U = length(map(arb, middle[:3]))
        Q = (U * U + 1).sqrt()
        for w in (W * self.C).tolist():
            s, b, p = abs(w[0]), w[2:5], [v / 2 for v in w[14:]]
            A = abs(w[0] * dot(T, map(arb, T)) + w[1] + dot(b, T))
            K = length(w[5 + k] + p[k % 3] * T[k // 3] * 2 for k in range(9))
            along = length(w[0] * 2 * v + c for v, c in zip(T, b, strict=True))
            more, P = along * t + s * t * t, length(p)
            rest = Q * Q * s * t * t + U * r * more * 2 + r * r * (A + more)
            found.append((rest + t * r * P * (Q * 4 + r * 2) + r * r * K * 1.75).abs_upper())
        return found

    def mode(self, z: list[arb]) -> list[arb]:
        k = self.m.at[self.group[0], "x"]
        return [*z[k + 3 : k + 7], *(v / self.m.size for v in z[k : k + 3])]

    def inside(self, mode: list[arb], box: Box) -> bool:
        chart, middle, half = box
        x = [v / mode[chart] for k, v in enumerate(mode[:4]) if k != chart] + mode[4:]
        return all(abs(v - c) < r * WIDER for v, c, r in zip(x, middle, half, strict=True))
