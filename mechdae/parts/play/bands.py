"""Bands of outputs, proved: all places that they can have while every joint stays in its gap.

The equations of all bodies, Phi(q, u) = w with w in a product W of convex sets, are enclosed
around a pose q0. With Y near the inverse of Phi_q there, |A B|(r) a bound of the second derivatives
of A Phi over the box |q - q0| <= r, taken twice along the box, and s the support function of W,

    |q - q0| <= s(Y) + |Y Phi(q0)| + |1 - Y Phi_q| r + |Y B|(r) / 2 <= r

proves a solution in the box for every w of W (Krawczyk 1969, Brouwer), and
|1 - Y Phi_q| r + |Y B|(r) < r that it is the only one there; so it goes over into the pose
without gaps as w goes to 0: it is on its assembly mode. An output y then leaves y(q0) by at most

    s(y_q Y) + |y_q Y| |Phi(q0)| + |y_q| |1 - Y Phi_q| r + |y_q Y B - B_y|(r) / 2.

The first term is what the multipliers of the constraints say; the rest, of second order in the
gaps, is certain, so that s less the rest is reached for certain.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from mechdae.equations.model import Model, Row
from mechdae.equations.reduction import Scene
from mechdae.equations.structure_cache import StructureCache
from mechdae.errors import UnavailableError
from mechdae.kernels.bounds.intervals import SLOTS, Floors, enclosure
from mechdae.kernels.bounds.walk import ROUNDOFF
from mechdae.kernels.run.functions import Batch
from mechdae.parts.play.gaps import JointGap, multipliers, support
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Sym

SX = ca.SX
ALLOWANCE, SHARE = 1 + 2.0**-10, 1 + 2.0**-30
"""For the rounding of bounds themselves, of the large part that is a sum of lengths less."""
LEAST = 0.1
"""Share of the widest unknown that every side of the box has at least, in natural sizes."""
NARROW = 1e-9
"""Share of its natural size that a side has at least: gaps of no size leave rounding."""
WIDER = 1.25
"""How much wider than its image a box is made for the next test."""
ROUNDS = 8
"""Boxes that are tried at a pose."""


class BandGraphs:
    """Equations of all bodies of a scene, of given outputs, and bounds of second derivatives.

    Parameters
    ----------
    paths
        Outputs: ``points/P/position``, ``bodies/B/angle``, ``joints/J/slide``.
    """

    def __init__(self, scene: Scene, paths: Sequence[str]) -> None:
        model = self.model = scene.model
        every, self.u = model.driven(scene.drivers)
        keys = list(scene.recover)
        self.q = ca.vertcat(*[model.q[model.places[key]] for key in keys])
        rest = [model.q[place] for key, place in model.places.items() if key not in scene.recover]
        unknown = ca.vertcat(SX(0, 1), *rest)
        self.rows: list[Row] = [
            row
            for row in every
            if ca.depends_on(row.expression, self.q) and not ca.depends_on(row.expression, unknown)
        ]
        self.p, self.y = model.p, ca.vertcat(*[_output(model, path) for path in paths])
        self.phi = ca.vertcat(*[row.expression for row in self.rows])
        self.inverse: Sym = SX.sym("Y", len(keys), len(keys))
        self.r: Sym = SX.sym("r", len(keys))
        recovered = ca.vertcat(*scene.recover.values())
        self.recovered: Batch = self._batch("q", [scene.x, scene.u, self.p], [recovered])
        self.cache: StructureCache = StructureCache()
        if len(self.rows) != len(keys):
            raise UnavailableError(
                f"bands need as many equations as coordinates, here are {len(self.rows)} and "
                f"{len(keys)}: some are redundant, or bodies turn freely"
            )

    def distances(self, q: Floats, u: Floats, p: Floats) -> dict[str, Floats]:
        """Return how far the centres of two wheels in mesh are apart, (n,) by joint [m]."""
        joints = [name for name, joint in self.model.mechanism.joints.items() if joint.wheels == 2]

        def build() -> Batch:
            parts = [ca.norm_2(self.model.ends[name].gap) for name in joints]
            return self._batch("distances", [self.q, self.u, self.p], parts)

        columns = self.cache("distances", build)(q, u, p) if joints else []
        return {name: column[:, 0] for name, column in zip(joints, columns, strict=True)}

    def openings(self, gap: JointGap, pose: tuple[Floats, Floats, Floats]) -> Floats:
        """Return what of a reaction opens the rows of a gap, (n, 3 rows) by columns."""
        parts = [self.rows[k].part for k in gap.rows]

        def build() -> Batch:
            found = multipliers(self.model, gap.joint, parts)
            return self._batch("openings", [self.q, self.u, self.p], [found])

        found: Floats = self.cache(("openings", gap.joint), build)(*pose)[0]
        return found

    @cached_property
    def jacobian(self) -> Batch:
        """(q, u, p) -> Phi_q by columns."""
        return self._batch("jacobian", [self.q, self.u, self.p], [ca.jacobian(self.phi, self.q)])

    def first_order(self, gaps: Sequence[JointGap]) -> Batch:
        """(q, u, reach, Y, p) -> |Phi(q)| at most, s(Y), y_q Y and s(y_q Y) by gap, by columns.

        ``reach`` (rows,) are those of the gaps, one behind the other; of Y by columns.
        """

        def build() -> Batch:
            floors, Y = Floors(SX.sym("floor", SLOTS)), self.inverse
            ranges = [(self.q, self.q), (self.u, self.u)]
            _, rounding = enclosure(self.phi, [self.q, self.u], ranges, floors)
            off = ca.fabs(self.phi) + ROUNDOFF * rounding
            reach = SX.sym("reach", sum(len(gap.rows) for gap in gaps))
            forms = self.y_q @ Y
            known = [_support(gaps, each, reach) for each in (Y, forms)]
            spread = ca.sum2(ca.horzcat(*known[0]))
            inputs = [self.q, self.u, reach, ca.vec(Y), self.p]
            return self._batch("first", inputs, [off, spread, forms, ca.horzcat(*known[1])], floors)

        return self.cache(("first", *[(gap.joint, gap.key) for gap in gaps]), build)

    @cached_property
    def test(self) -> Batch:
        """(q, r, u, Y, p) -> |1 - Y Phi_q| r and |Y B|(r)."""
        bend = self._bent(self.inverse, SX(self.q.numel(), self.y.numel()))
        inputs = [self.q, self.r, self.u, ca.vec(self.inverse), self.p]
        return self._batch("test", inputs, [self._miss, bend], self._second[-1])

    @cached_property
    def rest(self) -> Batch:
        """(q, r, u, off, Y, p) -> what outputs leave their first order by."""
        off, size = SX.sym("off", len(self.rows)), ca.fabs(self.y_q)
        forms = self.y_q @ self.inverse
        rounded = 4 * self.q.numel() * ROUNDOFF * (size @ ca.fabs(self.inverse))
        found = (2 * ca.fabs(forms) + rounded) @ off + size @ self._miss
        found += self._bent(forms, -SX.eye(self.y.numel())) / 2
        inputs = [self.q, self.r, self.u, off, ca.vec(self.inverse), self.p]
        return self._batch("rest", inputs, [found], self._second[-1])

    @cached_property
    def y_q(self) -> Sym:
        """Derivatives of the outputs."""
        return ca.jacobian(self.y, self.q)

    @cached_property
    def _miss(self) -> Sym:
        """|1 - Y Phi_q| r with the rounding of the product."""
        Y, J, n = self.inverse, ca.jacobian(self.phi, self.q), self.q.numel()
        rounding = 2 * n * ROUNDOFF * (ca.fabs(Y) @ (ca.fabs(J) @ self.r))
        return ca.fabs(SX.eye(n) - Y @ J) @ self.r + rounding

    @cached_property
    def _second(self) -> tuple[list[tuple[int, int, int]], Sym, Sym, Floors]:
        """Second derivatives of (Phi, y) that do not vanish, and how far they change in the box.

        Places (i, a, b) with a <= b, values at q, changes at most, divisors without a bound.
        """
        first = ca.jacobian(ca.vertcat(self.phi, self.y), self.q)
        slopes: list[Sym] = first.nonzeros()
        second = ca.jacobian(ca.vertcat(SX(0, 1), *slopes), self.q)
        known = list(zip(*first.sparsity().get_triplet(), strict=True))
        places = [
            (known[k][0], known[k][1], b)
            for k, b in zip(*second.sparsity().get_triplet(), strict=True)
        ]
        valid = [k for k, (_, a, b) in enumerate(places) if a <= b]
        entries: list[Sym] = second.nonzeros()
        values = ca.vertcat(SX(0, 1), *[entries[k] for k in valid])
        floors, v, r = Floors(SX.sym("floor", SLOTS)), SX.sym("v", self.q.numel()), self.r
        ranges = [(self.q - r, self.q + r), (-r, r), (self.u, self.u)]
        third = ca.jtimes(values, self.q, v)
        changes, _ = enclosure(third, [self.q, v, self.u], ranges, floors, rounding=False)
        return [places[k] for k in valid], values, changes, floors

    def _bent(self, forms: Sym, factors: Sym) -> Sym:
        """Return bounds of second derivatives of `forms` Phi + `factors` y, twice along the box.

        They are summed with their signs where q is, so that what cancels does.
        """
        places, values, changes, _ = self._second
        matrix = ca.horzcat(forms, factors)
        pairs: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for k, (i, a, b) in enumerate(places):
            pairs.setdefault((a, b), []).append((i, k))
        total = SX.zeros(matrix.size1())
        for (a, b), entries in pairs.items():
            columns, at = (list(each) for each in zip(*entries, strict=True))
            part = matrix[:, columns]
            size = ca.fabs(part @ values[at]) + ca.fabs(part) @ changes[at]
            total += (1 if a == b else 2) * self.r[a] * self.r[b] * size
        return total

    @staticmethod
    def _batch(
        name: str, inputs: list[Sym], parts: list[Sym], floors: Floors | None = None
    ) -> Batch:
        if floors and (floors.divisors or floors.pieces):
            raise UnavailableError("bands are not proved along curves with divisors or pieces")
        function: Graph = ca.Function(name, inputs, [ca.densify(ca.vec(part)) for part in parts])
        return Batch(function, [len(inputs) - 1])


def _output(model: Model, path: str) -> Sym:
    """Return an output over the coordinates of all bodies."""
    kind, part, name = path.split("/")
    if kind == "bodies":
        return model.frame(part).angle
    if kind == "points":
        return model.point(part)
    return next(value for word, value, _ in model.joint_quantities(part) if word == name)


@dataclass
class Bands:
    """Bands of outputs.

    Attributes
    ----------
    proved : (n,) booleans
    forms : (n, k, rows)
        Linear forms y_q Y: what offsets in the equations do to outputs.
    shares : (n, k, gaps)
        Largest deviation of first order by gap.
    rest : (n, k)
        Bound of all that is not of first order. As the shares nan where nothing is proved.
    """

    proved: Booleans
    forms: Floats
    shares: Floats
    rest: Floats


def bands(
    graphs: BandGraphs, gaps: Sequence[JointGap], pose: tuple[Floats, Floats, Floats], sizes: Floats
) -> Bands:
    """Return the bands around poses.

    Parameters
    ----------
    pose
        q (n, nq), drivers' values (n, nu) and parameters.
    sizes
        Natural ones of q, (nq,).
    """
    q, u, p = pose
    n, nq = q.shape
    J = graphs.jacobian(q, u, p)[0].reshape(n, nq, nq).transpose(0, 2, 1)
    inverse, there = _inverses(J)
    Y = inverse.transpose(0, 2, 1).reshape(n, -1)
    reach = np.concatenate([np.broadcast_to(gap.reach, (n, len(gap.rows))) for gap in gaps], axis=1)
    off, spread, forms, shares = graphs.first_order(gaps)(q, u, reach, Y, p)
    fixed = spread + (np.abs(inverse) @ off[..., None])[..., 0]
    image, proved = _boxes(graphs, (q, u, Y, p), fixed, spread, sizes, there)
    rest = ALLOWANCE * graphs.rest(q, image, u, off, Y, p)[0]
    proved &= np.isfinite(rest).all(axis=1)
    rest[~proved] = np.nan
    forms = forms.reshape(n, nq, -1).transpose(0, 2, 1)
    shares = SHARE * shares.reshape(n, len(gaps), -1).transpose(0, 2, 1)
    shares[~proved] = np.nan
    return Bands(proved, forms, shares, rest)


def _support(gaps: Sequence[JointGap], forms: Sym, reach: Sym) -> list[Sym]:
    """Return the support function of each gap at linear forms (k, rows), (k,)."""
    found, start = list[Sym](), 0
    for gap in gaps:
        count = len(gap.rows)
        sizes = [reach[start + i] for i in range(count)]
        found.append(support(gap.disc, [forms[:, j] for j in gap.rows], sizes))
        start += count
    return found


def _inverses(J: Floats) -> tuple[Floats, Booleans]:
    """Return the inverses of matrices (n, k, k), and where there are any."""
    eye = np.eye(J.shape[1])
    there: Booleans = np.asarray(np.isfinite(J).all(axis=(1, 2)))
    safe = np.where(there[:, None, None], J, eye)
    try:
        return np.linalg.inv(safe), there
    except np.linalg.LinAlgError:  # one of them is singular to the last bit
        there &= np.abs(np.linalg.det(safe)) > 0
        return np.linalg.inv(np.where(there[:, None, None], J, eye)), there


def _boxes(
    graphs: BandGraphs, pose: tuple[Floats, ...], fixed: Floats, spread: Floats, sizes: Floats,
    there: Booleans,
) -> tuple[Floats, Booleans]:  # fmt: skip
    """Return what boxes around poses are mapped into, (n, nq), and where that proves.

    Parameters
    ----------
    pose
        q, u, Y and parameters.
    fixed, spread
        What every image holds, and the part of it that the gaps make, (n, nq).
    """
    q, u, Y, p = pose
    width = np.maximum(LEAST * np.max(spread / sizes, axis=1, keepdims=True), NARROW) * sizes
    box = np.maximum(WIDER * fixed, width)
    image, proved, tried = np.zeros_like(box), np.zeros(len(q), bool), there.copy()
    for _ in range(ROUNDS):
        rows = np.flatnonzero(tried)
        if not len(rows):
            break
        r = box[rows]
        miss, bend = graphs.test(q[rows], r, u[rows], Y[rows], p)
        image[rows] = ALLOWANCE * (fixed[rows] + miss + bend / 2)
        slope = ALLOWANCE * (miss + bend)
        good = (image[rows] <= r).all(axis=1) & (slope < r).all(axis=1)
        proved[rows[good]] = True
        tried[rows[good]] = False
        further = np.where(slope < r, image[rows], np.maximum(image[rows], slope))
        box[rows] = np.maximum(WIDER * further, r)
        tried &= np.isfinite(box).all(axis=1) & (box <= 10 * np.maximum(fixed, width)).all(axis=1)
    return image, proved
