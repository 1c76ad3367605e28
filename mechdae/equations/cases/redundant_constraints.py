"""Which Assur groups have more equations than coordinates.

Structure alone tells a redundant equation from a needed one only up to exchange: in a
parallelogram with a third crank either crank may be called the redundant one. A set of
bodies is *determined* when its own joints to itself and to solved bodies fix all of its
coordinates, anywhere and not only by their number: parallel guides hold a slider in one direction.
From the driver outwards the smallest determined sets are the Assur groups;
sets that share bodies are alternatives to each other, and together they make one redundant
group. A set without driver that is held by one solved body only would stand still on it: it
moves by special dimensions, and is solved together with what moves it. A joint of one
equation counts as the link and the lower pairs that replace it, so that it is an alternative
like a body.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.equations.model import Model, Row, square_blocks
from mechdae.numerics.null_space import freedoms
from mechdae.records import dataclass
from mechdae.types import Integers, Sym

SEED = 7
LOOSE = 1e-6


def redundant_blocks(
    model: Model, rows: Sequence[Row], pattern: Sym, coarse: bool
) -> tuple[int, Integers, Integers]:
    """Return blocks as `square_blocks` does, where equations are redundant.

    The bodies with redundant equations, and those they depend on, are cut into determined
    sets of bodies; each set is one block. With `coarse` they are left in one, but for the
    driven ones. The rest is square.
    """
    body_of = [name for name, _ in model.q_names]
    touched: list[set[str]] = [set() for _ in rows]
    for i, j in zip(*pattern.get_triplet(), strict=True):
        touched[i].add(body_of[j])
    over = _overdetermined(pattern, body_of, touched)
    of_row, of_column = np.full(len(rows), -1), np.full(len(body_of), -1)
    known: set[str] = set()
    sets = _Cutter(model, rows, over).sets(coarse)
    for label, members in enumerate(sets):
        known |= members
        of_column[[j for j, name in enumerate(body_of) if name in members]] = label
        rows_inside = [
            i for i, bodies in enumerate(touched) if bodies & members and bodies <= known
        ]
        of_row[rows_inside] = label
    other_rows, other_columns = np.flatnonzero(of_row < 0), np.flatnonzero(of_column < 0)
    if not other_columns.size:
        return len(sets), of_row, of_column
    part, _ = pattern.sub(other_rows.tolist(), other_columns.tolist())
    count, part_row, part_column = square_blocks(part)
    of_row[other_rows], of_column[other_columns] = part_row + len(sets), part_column + len(sets)
    return len(sets) + count, of_row, of_column


def _overdetermined(pattern: Sym, body_of: list[str], touched: list[set[str]]) -> set[str]:
    """Return the bodies that redundant equations touch, and those they depend on."""
    count, rowperm, colperm, rowblock, colblock, coarse_rows, coarse_cols = pattern.btf()
    rows_for: dict[str, set[int]] = {name: set() for name in body_of}
    for block in range(count):
        for j in colperm[colblock[block] : colblock[block + 1]]:
            rows_for[body_of[j]] |= set(rowperm[rowblock[block] : rowblock[block + 1]])
    over = rowperm[: coarse_rows[2]]
    for j in colperm[: coarse_cols[1]]:
        rows_for[body_of[j]] |= set(over)
    result, front = set[str](), [name for i in over for name in touched[i]]
    while front:
        name = front.pop()
        if name not in result:
            result.add(name)
            front += [other for i in rows_for[name] for other in touched[i]]
    return result


def _anywhere(model: Model, rows: Sequence[Row]) -> list[dict[int, float]]:
    """Return the rows of the Jacobian at coordinates that are no pose, by column.

    Equations that depend on each other there do so everywhere: parallel guides, two pins on
    one spot. Lengths are in parts of the mechanism, rows of size 1.
    """
    values = model.mechanism.values()
    places = [abs(value) for name, value in values.items() if name[-2:] in (".x", ".y")]
    size = max(places, default=0.0) or 1.0
    weights = model.coordinates.sizes(size)
    middles = [c.middle for c in model.coordinates]
    phi = ca.vertcat(*[row.expression for row in rows])
    jacobian = ca.jacobian(phi, model.q)
    function = ca.Function("J", [model.q, model.p], [ca.densify(jacobian)])
    somewhere = np.random.default_rng(SEED).uniform(-1, 1, len(weights)) * weights + middles
    matrix = np.array(function(somewhere, model.p_values)) * weights
    norms = np.linalg.norm(matrix, axis=1)
    matrix /= np.where(norms > 0, norms, 1.0)[:, None]
    entries: list[dict[int, float]] = [{} for _ in rows]
    for i, j in zip(*jacobian.sparsity().get_triplet(), strict=True):
        entries[i][j] = float(matrix[i, j])
    return entries


@dataclass(frozen=True)
class _Link:
    """An equation as the cutter sees it: its row of the Jacobian, what it belongs to."""

    entries: dict[int, float]
    bodies: frozenset[str]
    grounded: bool
    driver: bool = False
    weld: bool = False


class _Cutter:
    """Cuts bodies with redundant equations into groups.

    Parameters
    ----------
    model, rows
        Bodies, all equations with those of the drivers.
    bodies
        Those to be cut; they depend on no others.
    """

    def __init__(self, model: Model, rows: Sequence[Row], bodies: set[str]) -> None:
        self.real = [n for n in (*model.mechanism.bodies, *model.contacts) if n in bodies]
        self.bodies = list(model.mechanism.bodies)
        self.body_of = [name for name, _ in model.q_names]
        self.columns: dict[str, list[int]] = {name: [] for name in self.real}
        for j, name in enumerate(self.body_of):
            if name in bodies:
                self.columns[name].append(j)
        self.size = len(self.body_of)
        self.links: list[_Link] = []
        owners = Counter(row.owner for row in rows if not row.driver)
        for row, entries in zip(rows, _anywhere(model, rows), strict=True):
            touched = list(dict.fromkeys(self.body_of[j] for j in entries))
            if not touched or not set(touched) <= bodies:
                continue
            joint = None if row.driver else model.mechanism.joints[row.owner]
            grounded = joint is not None and GROUND in joint.bodies
            weld = joint is not None and joint.rigid
            if joint is not None and owners[row.owner] == 1:
                self._add_link(row.owner, entries, touched, grounded)
            else:
                self.links.append(_Link(entries, frozenset(touched), grounded, row.driver, weld))
        self.order = {name: i for i, name in enumerate(self.columns)}
        self.of_body: dict[str, list[int]] = {name: [] for name in self.order}
        for i, link in enumerate(self.links):
            for name in link.bodies:
                self.of_body[name].append(i)
        self.matrix = np.zeros((len(self.links), self.size))
        for i, link in enumerate(self.links):
            self.matrix[i, list(link.entries)] = list(link.entries.values())

    def _add_link(
        self, joint: str, entries: dict[int, float], touched: list[str], grounded: bool
    ) -> None:
        """Put a link with three coordinates in the place of a joint of one equation.

        Two of its four equations belong to either side; what remains of them without the link
        is the equation of the joint.
        """
        name = f"link of {joint}"
        a, b, c = symbols = [self.size, self.size + 1, self.size + 2]
        self.size += 3
        self.columns[name] = symbols
        first = touched if grounded else touched[:-1]
        for side, ground, turn, rest in (
            (first, False, 1.0, {b: 1.0, a: 0.3}),
            (touched[len(first) :], grounded, -1.0, {c: 1.0, b: 0.7}),
        ):
            near = {j: value for j, value in entries.items() if self.body_of[j] in side}
            members = frozenset([*side, name])
            self.links += [_Link({**near, a: turn}, members, ground), _Link(rest, members, ground)]

    # -- sets of bodies --------------------------------------------------------------------

    def sets(self, coarse: bool) -> list[set[str]]:
        """Return the groups that the bodies are made of, in solve order."""
        left, known = set(self.order), set[str]()
        result = []
        while left:
            one = self._nearest(left, known) or set(left)
            if coarse and not any(self.links[i].driver for i in self._inside(one, known)):
                one = set(left)
            one = self._with_alternatives(one, left, known)
            result.append(one)
            known |= one
            left -= one
        return self._with_bodies([one & set(self.real) for one in result])

    def _with_bodies(self, sets: list[set[str]]) -> list[set[str]]:
        """Return the sets with places on curves between solved bodies put to those bodies.

        Such a place follows from them: its joint is redundant for them, and no group of its own.
        """
        distinct: list[set[str]] = []
        for one in sets:
            if one and not one & set(self.bodies):
                near = {n for name in one for i in self.of_body[name] for n in self.links[i].bodies}
                last = next((known for known in reversed(distinct) if known & near), None)
                if last is not None:
                    last |= one
                    continue
            if one:
                distinct.append(one)
        return distinct

    def _inside(self, bodies: set[str], known: set[str]) -> list[int]:
        """Return the equations that touch `bodies` and nothing else but `known` ones."""
        near = sorted({i for name in bodies for i in self.of_body[name]})
        return [i for i in near if self.links[i].bodies <= bodies | known]

    def _determined(self, bodies: set[str], known: set[str]) -> set[str]:
        """Return the bodies that are fixed by the joints among `bodies` and to `known` ones."""
        left = set(bodies)
        while left:
            rows = self._inside(left, known)
            if not rows:
                return set()
            columns = sorted(j for name in left for j in self.columns[name])
            part = self.matrix[np.ix_(rows, columns)]
            free = np.abs(freedoms(part)).max(axis=1, initial=0.0)
            loose = {columns[k] for k in np.flatnonzero(free > LOOSE)}
            if not loose:
                return left
            left = {name for name in left if not loose & set(self.columns[name])}
        return left

    def _moving(self, bodies: set[str], known: set[str]) -> list[set[str]]:
        """Return the connected determined sets that would not stand still."""
        left = self._determined(bodies, known)
        result = []
        while left:
            one = self._connected(min(left, key=self.order.__getitem__), left, known)
            left -= one
            if self._moves(one, known):
                result.append(one)
        return result

    def _connected(self, start: str, inside: set[str], known: set[str]) -> set[str]:
        result, front = {start}, [start]
        while front:
            for i in self.of_body[front.pop()]:
                if self.links[i].bodies <= inside | known:
                    new = (self.links[i].bodies & inside) - result
                    result |= new
                    front += new
        return result

    def _moves(self, bodies: set[str], known: set[str]) -> bool:
        links = [self.links[i] for i in self._inside(bodies, known)]
        held = {name for link in links for name in link.bodies & known}
        bases = len(held) + any(link.grounded for link in links)
        welded = len(bodies) == 1 and any(link.weld for link in links)
        return bases > 1 or welded or any(link.driver for link in links)

    def _smallest(
        self, pool: set[str], known: set[str], keep: str | None = None, first: Iterable[str] = ()
    ) -> set[str]:
        """Return a smallest moving set within `pool`; it has the body `keep`, if any.

        Bodies of `first` are given up first. Empty where there is none.
        """

        def within(bodies: set[str]) -> set[str]:
            sets = self._moving(bodies, known)
            return next((one for one in sets if keep is None or keep in one), set())

        result = within(pool)
        early = set(first)
        for name in sorted(result, key=lambda n: (n not in early, -self.order[n])):
            if name != keep and name in result:
                result = within(result - {name}) or result
        return result

    def _nearest(self, left: set[str], known: set[str]) -> set[str]:
        """Return a smallest moving set as near to the solved bodies as there is one."""
        for near in self._spreading(left, known):
            one = self._smallest(near, known)
            if one:
                return one
        return set()

    def _spreading(self, left: set[str], known: set[str]) -> Iterable[set[str]]:
        """Yield the bodies of `left` at most 1, 2, .. joints away from the solved ones."""
        near = {
            name
            for link in self.links
            if link.grounded or link.driver or link.bodies & known
            for name in link.bodies & left
        }
        while near:
            yield near
            ahead = near | {
                n for name in near for i in self.of_body[name] for n in self.links[i].bodies & left
            }
            near = ahead if ahead != near else set()

    def _with_alternatives(self, one: set[str], left: set[str], known: set[str]) -> set[str]:
        """Return the set joined with those that fix some of its bodies without the others."""
        whole = set(one)
        front = sorted(whole, key=self.order.__getitem__)
        while front and len(whole) > 1:
            pool = left - {front.pop(0)}
            others = set().union(*self._moving(pool, known)) & whole
            for body in sorted(others, key=self.order.__getitem__):
                other = self._smallest(pool, known, body, whole)
                if not other <= whole:
                    whole |= other
                    front = sorted(whole, key=self.order.__getitem__)
                    break
        return whole
